// Boxes for ray queries: around each point, every place from which it may lie within a radius.
#import common

// Records of some words, a position first in each.
@group(0) @binding(0) var<storage, read> positions: array<f32>;
// Six to a box: the least corner, the greatest.
@group(0) @binding(1) var<storage, read_write> boxes: array<f32>;

const LARGEST: f32 = 3.4028234e38;
// Twice what a sum is off by, at most, in either direction.
const ROUNDING: f32 = 2.3841858e-7;

// Reads positions, writes boxes; one thread per box. values: points, boxes, words in a record, the bits of half the
// boxes' width before rounding.
@compute @workgroup_size(64)
fn inflate(
    @builtin(workgroup_id) workgroup: vec3<u32>,
    @builtin(num_workgroups) workgroups: vec3<u32>,
    @builtin(local_invocation_index) local: u32,
) {
    let i = thread_index(workgroup, workgroups, local, 64u);
    if i >= arguments.values.y {
        return;
    }
    // A box without a point lies anywhere: the walk passes it over.
    var position = vec3(0.0);
    if i < arguments.values.x {
        let at = i * arguments.values.z;
        position = vec3(positions[at], positions[at + 1u], positions[at + 2u]);
    }
    let reach = bitcast<f32>(arguments.values.w);
    // Outwards, and not to infinity: an infinite box has no place in a tree.
    let low = clamp(position - reach, vec3(-LARGEST), vec3(LARGEST));
    let high = clamp(position + reach, vec3(-LARGEST), vec3(LARGEST));
    let box_min = max(low - abs(low) * ROUNDING, vec3(-LARGEST));
    let box_max = min(high + abs(high) * ROUNDING, vec3(LARGEST));
    boxes[i * 6u] = box_min.x;
    boxes[i * 6u + 1u] = box_min.y;
    boxes[i * 6u + 2u] = box_min.z;
    boxes[i * 6u + 3u] = box_max.x;
    boxes[i * 6u + 4u] = box_max.y;
    boxes[i * 6u + 5u] = box_max.z;
}
