// What every kernel sees: the constants of the iteration and the arguments of one dispatch.
#import layout

struct Arguments {
    // What each kernel says it is.
    values: vec4<u32>,
    // Tree over photons: (first box, number of boxes) of two levels in each.
    levels: array<vec4<u32>, 6>,
}

@group(1) @binding(0) var<uniform> arguments: Arguments;
@group(1) @binding(1) var<uniform> frame: Frame;

// Index of a thread in a dispatch that may be spread over two dimensions; `threads` a workgroup.
fn thread_index(workgroup: vec3<u32>, workgroups: vec3<u32>, local: u32, threads: u32) -> u32 {
    return (workgroup.y * workgroups.x + workgroup.x) * threads + local;
}
