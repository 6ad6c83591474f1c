// The implicit tree over sorted points: tight boxes level by level, and nodes that hold eight of them in 64 bytes.
#import common

// Records of some words, a position first in each.
@group(0) @binding(0) var<storage, read> positions: array<f32>;
@group(0) @binding(1) var<storage, read_write> boxes: array<PointBox>;
@group(0) @binding(2) var<storage, read_write> tree: array<TreeNode>;

// Reads positions, writes the boxes of level 0; one thread per box. values: points, boxes, words in a record.
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
    let stride = arguments.values.z;
    var box_min = vec3(positions[begin * stride], positions[begin * stride + 1u], positions[begin * stride + 2u]);
    var box_max = box_min;
    for (var i = begin + 1u; i < end; i++) {
        let position = vec3(positions[i * stride], positions[i * stride + 1u], positions[i * stride + 2u]);
        box_min = min(box_min, position);
        box_max = max(box_max, position);
    }
    boxes[k] = PointBox(box_min, 0u, box_max, 0u);
}

// Exponent, with its bias, of the least power of two that makes 254 steps reach over an extent.
fn exponents_of(extent: vec3<f32>) -> vec3<u32> {
    // As the least normal number at the least; divided first, for 254 steps may be beyond the largest.
    let bits = bitcast<vec3<u32>>(max(extent / 254.0, vec3(1.1754944e-38)));
    return min((bits + vec3(0x7fffffu)) >> vec3(23u), vec3(254u));
}

// Steps from the origin, the box of the steps around the box of the coordinates.
fn steps_below(low: vec3<f32>, origin: vec3<f32>, scale: vec3<f32>) -> vec3<u32> {
    let steps = clamp(floor((low - origin) / scale), vec3(0.0), vec3(255.0));
    return vec3<u32>(select(steps, steps - 1.0, origin + steps * scale > low));
}

fn steps_above(high: vec3<f32>, origin: vec3<f32>, scale: vec3<f32>) -> vec3<u32> {
    let steps = clamp(ceil((high - origin) / scale), vec3(0.0), vec3(255.0));
    return vec3<u32>(select(steps, steps + 1.0, origin + steps * scale < high));
}

// Reads the boxes of one level, writes those of the next and their nodes; one thread per box written.
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

    let exponents = exponents_of(box_max - box_min);
    let scale = bitcast<vec3<f32>>(exponents << vec3(23u));
    // Low and high steps along each axis, four children in a word.
    var lows = array<vec3<u32>, 2>();
    var highs = array<vec3<u32>, 2>();
    for (var i = begin; i < end; i++) {
        let child = i - begin;
        let shift = vec3(8u * (child & 3u));
        lows[child >> 2u] |= steps_below(boxes[below + i].min, box_min, scale) << shift;
        highs[child >> 2u] |= steps_above(boxes[below + i].max, box_min, scale) << shift;
    }
    var node: TreeNode;
    node.origin = box_min;
    node.exponents = exponents.x | (exponents.y << 8u) | (exponents.z << 16u) | ((end - begin) << 24u);
    node.x = vec4(lows[0].x, lows[1].x, highs[0].x, highs[1].x);
    node.y = vec4(lows[0].y, lows[1].y, highs[0].y, highs[1].y);
    node.z = vec4(lows[0].z, lows[1].z, highs[0].z, highs[1].z);
    // Leaves have boxes but no nodes.
    tree[arguments.values.z + k - level_of(0u).y] = node;
}
