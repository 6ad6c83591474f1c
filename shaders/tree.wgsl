// Tight boxes of the implicit tree over sorted photons, level by level.
#import common

@group(0) @binding(0) var<storage, read> photons: array<Photon>;
@group(0) @binding(1) var<storage, read_write> boxes: array<PointBox>;

// Reads photons, writes the boxes of level 0; one thread per box. values: photons, boxes.
@compute @workgroup_size(64)
fn tree_leaves(
    @builtin(workgroup_id) workgroup: vec3<u32>,
    @builtin(num_workgroups) workgroups: vec3<u32>,
    @builtin(local_invocation_index) local: u32,
) {
    let k = thread_index(workgroup, workgroups, local, 64u);
    if k >= arguments.values.y {
        return;
    }
    let begin = k * LEAF_SIZE;
    let end = min(begin + LEAF_SIZE, arguments.values.x);
    var box_min = photons[begin].position;
    var box_max = box_min;
    for (var i = begin + 1u; i < end; i++) {
        let position = photons[i].position;
        box_min = min(box_min, position);
        box_max = max(box_max, position);
    }
    boxes[k] = PointBox(box_min, 0u, box_max, 0u);
}

// Reads the boxes of one level, writes those of the next; one thread per box written.
// values: first box of the level below, their number, first box of this level, their number.
@compute @workgroup_size(64)
fn tree_level(
    @builtin(workgroup_id) workgroup: vec3<u32>,
    @builtin(num_workgroups) workgroups: vec3<u32>,
    @builtin(local_invocation_index) local: u32,
) {
    let k = thread_index(workgroup, workgroups, local, 64u);
    if k >= arguments.values.w {
        return;
    }
    let begin = k * FANOUT;
    let end = min(begin + FANOUT, arguments.values.y);
    let below = arguments.values.x;
    var box_min = boxes[below + begin].min;
    var box_max = boxes[below + begin].max;
    for (var i = begin + 1u; i < end; i++) {
        box_min = min(box_min, boxes[below + i].min);
        box_max = max(box_max, boxes[below + i].max);
    }
    boxes[arguments.values.z + k] = PointBox(box_min, 0u, box_max, 0u);
}
