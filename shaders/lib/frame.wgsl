// The constants of the iteration.
#import common

@group(2) @binding(0) var<uniform> frame: Frame;
