// What every kernel sees: the arguments of one dispatch.
#import layout

struct Arguments {
    // What each kernel says it is.
    values: vec4<u32>,
    // Tree over points: (first box, number of boxes) of two levels in each.
    levels: array<vec4<u32>, 6>,
    // What each kernel says it is.
    further: vec4<u32>,
}

@group(1) @binding(0) var<uniform> arguments: Arguments;

// Index of a thread in a dispatch that may be spread over two dimensions; `threads` a workgroup.
fn thread_index(workgroup: vec3<u32>, workgroups: vec3<u32>, local: u32, threads: u32) -> u32 {
    return (workgroup.y * workgroups.x + workgroup.x) * threads + local;
}

// Pixel of a thread: a workgroup takes 8×8 of them, 4×2 to each eight threads, so that neighbours in the machine are
// neighbours in the picture.
fn tile_pixel(workgroup: vec3<u32>, workgroups: vec3<u32>, local: u32, width: u32) -> vec2<u32> {
    let tile = workgroup.y * workgroups.x + workgroup.x;
    let across = (width + 7u) / 8u;
    let corner = vec2(tile % across, tile / across) * 8u;
    let x = (local & 3u) | ((local >> 1u) & 4u);
    let y = ((local >> 2u) & 1u) | ((local >> 3u) & 6u);
    return corner + vec2(x, y);
}

// (first box, number of boxes) of a level of the tree.
fn level_of(level: u32) -> vec2<u32> {
    let pair = arguments.levels[level / 2u];
    return select(pair.zw, pair.xy, (level & 1u) == 0u);
}
