// Points into the order of the tree: 16 bytes each, the position and the index that the point had.
#import common

@group(0) @binding(0) var<storage, read> order: array<u32>;
// Records of some words, a position first in each. As integers, for an index is in the bits of one of them.
@group(0) @binding(1) var<storage, read> records: array<u32>;
@group(0) @binding(2) var<storage, read_write> sorted: array<vec4<u32>>;

// Reads order and records, writes sorted; one thread per point. values: points, words in a record.
@compute @workgroup_size(64)
fn sort_points(
    @builtin(workgroup_id) workgroup: vec3<u32>,
    @builtin(num_workgroups) workgroups: vec3<u32>,
    @builtin(local_invocation_index) local: u32,
) {
    let i = thread_index(workgroup, workgroups, local, 64u);
    if i < arguments.values.x {
        let index = order[i];
        let at = index * arguments.values.y;
        sorted[i] = vec4(records[at], records[at + 1u], records[at + 2u], index);
    }
}
