// A walk through the implicit tree over points: `walk` calls `visit` for each point within the visitor's radius.
//
// The module that imports this defines
//   var tree: array<TreeNode>, in storage;
//   fn position_of(slot: u32) -> vec3<f32>, the point in a slot;
//   struct Visitor, with a field `radius2: f32` that `visit` may shrink: points beyond it are passed over;
//   fn visit(visitor: ptr<function, Visitor>, slot: u32, delta: vec3<f32>, distance2: f32), delta from the centre to the
//   point, distance2 its square: once for each point found.
#import common

// Squared distances from a point to four intervals along one axis, zero inside.
fn outside(origin: f32, scale: f32, low: u32, high: u32, at: f32) -> vec4<f32> {
    // The product is exact, so this is what the build checked, fused or not.
    let lows = origin + vec4<f32>(unpack4xU8(low)) * scale;
    let highs = origin + vec4<f32>(unpack4xU8(high)) * scale;
    let d = max(max(lows - at, at - highs), vec4(0.0));
    return d * d;
}

fn bits_within(distance2: vec4<f32>, radius2: f32) -> u32 {
    let bits = select(vec4(0u), vec4(1u, 2u, 4u, 8u), distance2 <= vec4(radius2));
    return bits.x | bits.y | bits.z | bits.w;
}

// Bit i: child i comes within the radius of the centre.
fn children_within(node: TreeNode, centre: vec3<f32>, radius2: f32) -> u32 {
    let scale = bitcast<vec3<f32>>(((vec3(node.exponents) >> vec3(0u, 8u, 16u)) & vec3(0xffu)) << vec3(23u));
    let near = outside(node.origin.x, scale.x, node.x.x, node.x.z, centre.x)
        + outside(node.origin.y, scale.y, node.y.x, node.y.z, centre.y)
        + outside(node.origin.z, scale.z, node.z.x, node.z.z, centre.z);
    let far = outside(node.origin.x, scale.x, node.x.y, node.x.w, centre.x)
        + outside(node.origin.y, scale.y, node.y.y, node.y.w, centre.y)
        + outside(node.origin.z, scale.z, node.z.y, node.z.w, centre.z);
    let present = (1u << (node.exponents >> 24u)) - 1u;
    return (bits_within(near, radius2) | (bits_within(far, radius2) << 4u)) & present;
}

// Over `n_points`, whose tree has `n_levels` levels of boxes. It ends whatever is in the tree: levels only descend, and
// each node gives at most eight children.
fn walk(visitor: ptr<function, Visitor>, centre: vec3<f32>, n_points: u32, n_levels: u32) {
    if n_points == 0u || n_levels == 0u {
        return;
    }
    let n_leaves = level_of(0u).y;
    // Level 0 is the nodes whose children are leaves.
    let top = max(n_levels, 2u) - 2u;
    var level = top;
    var k = 0u;
    // Children of node k of the level that are still to be entered; those of the levels above, eight bits each.
    var pending = 1u;
    var above = vec2(0u);
    if n_levels > 1u {
        pending = children_within(tree[level_of(top + 1u).x - n_leaves], centre, (*visitor).radius2);
    }
    loop {
        // Down to the next leaf.
        while level > 0u || pending == 0u {
            if pending == 0u {
                if level == top {
                    return;
                }
                pending = above.x & 0xffu;
                above = vec2((above.x >> 8u) | (above.y << 24u), above.y >> 8u);
                level += 1u;
                k >>= 3u;
            } else {
                k = k * FANOUT + firstTrailingBit(pending);
                pending &= pending - 1u;
                above = vec2((above.x << 8u) | pending, (above.y << 8u) | (above.x >> 24u));
                pending = children_within(tree[level_of(level).x - n_leaves + k], centre, (*visitor).radius2);
                level -= 1u;
            }
        }
        let first = (k * FANOUT + firstTrailingBit(pending)) * LEAF_SIZE;
        pending &= pending - 1u;
        // First which points, then what is done with them: neighbouring threads mostly find others of the eight.
        let present = min(LEAF_SIZE, n_points - first);
        var found = 0u;
        for (var i = 0u; i < present; i++) {
            let delta = position_of(first + i) - centre;
            let distance2 = delta.x * delta.x + delta.y * delta.y + delta.z * delta.z;
            found |= select(0u, 1u << i, distance2 <= (*visitor).radius2);
        }
        while found != 0u {
            let slot = first + firstTrailingBit(found);
            found &= found - 1u;
            let delta = position_of(slot) - centre;
            let distance2 = delta.x * delta.x + delta.y * delta.y + delta.z * delta.z;
            if distance2 <= (*visitor).radius2 {
                visit(visitor, slot, delta, distance2);
            }
        }
    }
}
