// The constants of the iteration, and the camera.
#import common

@group(2) @binding(0) var<uniform> frame: Frame;
@group(2) @binding(1) var<uniform> camera: Camera;
