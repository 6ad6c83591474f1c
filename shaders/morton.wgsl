// 63-bit Morton code of each point in the points' bounds, 21 bits an axis.
#import common
#import morton_code

// Records of some words, a position first in each.
@group(0) @binding(0) var<storage, read> positions: array<f32>;
@group(0) @binding(1) var<storage, read> bounds: PointBox;
// Low and high word.
@group(0) @binding(2) var<storage, read_write> keys: array<vec2<u32>>;
@group(0) @binding(3) var<storage, read_write> order: array<u32>;

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
    let at = i * arguments.values.y;
    let position = vec3(positions[at], positions[at + 1u], positions[at + 2u]);
    keys[i] = morton_code(position, bounds.min, bounds.max);
    order[i] = i;
}
