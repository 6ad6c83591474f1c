// 63-bit Morton code of each point in the points' bounds, 21 bits an axis.
#import common

// Records of some words, a position first in each.
@group(0) @binding(0) var<storage, read> positions: array<f32>;
@group(0) @binding(1) var<storage, read> bounds: PointBox;
// Low and high word.
@group(0) @binding(2) var<storage, read_write> keys: array<vec2<u32>>;
@group(0) @binding(3) var<storage, read_write> order: array<u32>;

const CELLS: f32 = 2097152.0;

// Spreads the low 11 bits to every third bit.
fn spread(value: u32) -> u32 {
    var v = value & 0x7ffu;
    v = (v | (v << 16u)) & 0x070000ffu;
    v = (v | (v << 8u)) & 0x0700f00fu;
    v = (v | (v << 4u)) & 0x430c30c3u;
    v = (v | (v << 2u)) & 0x49249249u;
    return v;
}

// Bits of x, y and z at 3k + 2, 3k + 1 and 3k, as in src/math/morton.rs: the lower 10 bits of each axis fill bits 0 to 29, the upper 11 bits 30 to 62.
fn morton(cell: vec3<u32>) -> vec2<u32> {
    let low = (spread(cell.x & 0x3ffu) << 2u) | (spread(cell.y & 0x3ffu) << 1u) | spread(cell.z & 0x3ffu);
    let x = spread(cell.x >> 10u);
    let y = spread(cell.y >> 10u);
    let z = spread(cell.z >> 10u);
    // x << 2 | y << 1 | z has 33 bits; two of them go into the low word.
    let upper = (x << 2u) | (y << 1u) | z;
    return vec2(low | (upper << 30u), (upper >> 2u) | ((x >> 30u) << 30u));
}

// Reads positions and bounds, writes keys and order; one thread per point. values: points, words in a record.
@compute @workgroup_size(64)
fn morton_keys(
    @builtin(workgroup_id) workgroup: vec3<u32>,
    @builtin(num_workgroups) workgroups: vec3<u32>,
    @builtin(local_invocation_index) local: u32,
) {
    let i = thread_index(workgroup, workgroups, local, 64u);
    if i >= arguments.values.x {
        return;
    }
    let extent = bounds.max - bounds.min;
    // Below this the quotient would overflow; everything is then in one cell.
    let flat = extent < vec3(1e-30);
    let scale = select(vec3(CELLS) / extent, vec3(0.0), flat);
    let at = i * arguments.values.y;
    let position = vec3(positions[at], positions[at + 1u], positions[at + 2u]);
    let scaled = (position - bounds.min) * scale;
    let cell = vec3<u32>(clamp(scaled, vec3(0.0), vec3(CELLS - 1.0)));
    keys[i] = morton(cell);
    order[i] = i;
}
