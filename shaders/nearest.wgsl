// The nearest points of each query, sorted, ties in order of the index. The lists lie in the results: the ball shrinks as
// they fill, so that few points get that far. So that it is small from the beginning, the points of the node that is
// likely to hold the nearest ones come first.
#import search

@group(0) @binding(4) var<storage, read_write> found: array<u32>;
// [query][k]
@group(0) @binding(5) var<storage, read_write> indices: array<u32>;
// The bits of squared distances, which are ordered as the numbers are.
@group(0) @binding(6) var<storage, read_write> distances2: array<u32>;

const INFINITE: u32 = 0x7f800000u;

struct Visitor {
    // Once the list is full, its last distance.
    radius2: f32,
    row: u32,
    n: u32,
    // The SEEDS points from here on are known already.
    seeds: u32,
}

// further.z: k.
fn begin(query: u32, centre: vec3<f32>, radius2: f32) -> Visitor {
    var visitor: Visitor;
    visitor.radius2 = radius2;
    visitor.row = query * arguments.further.z;
    visitor.seeds = NONE;
    let first = near_node(centre, arguments.further.y);
    if first == NONE {
        return visitor;
    }
    for (var slot = first; slot < min(first + SEEDS, arguments.further.x); slot++) {
        let delta = position_of(slot) - centre;
        let distance2 = delta.x * delta.x + delta.y * delta.y + delta.z * delta.z;
        if distance2 <= visitor.radius2 {
            visit(&visitor, slot, delta, distance2);
        }
    }
    visitor.seeds = first;
    return visitor;
}

fn visit(visitor: ptr<function, Visitor>, slot: u32, delta: vec3<f32>, distance2: f32) {
    if slot - (*visitor).seeds < SEEDS && (*visitor).seeds != NONE {
        return;
    }
    let k = arguments.further.z;
    let row = (*visitor).row;
    let bits = bitcast<u32>(distance2);
    let index = index_of(slot);
    var at = (*visitor).n;
    if at == k {
        at = k - 1u;
        if bits == distances2[row + at] && index > indices[row + at] {
            return;
        }
    } else {
        (*visitor).n = at + 1u;
    }
    while at > 0u {
        let before = distances2[row + at - 1u];
        let index_before = indices[row + at - 1u];
        if before < bits || (before == bits && index_before < index) {
            break;
        }
        distances2[row + at] = before;
        indices[row + at] = index_before;
        at -= 1u;
    }
    distances2[row + at] = bits;
    indices[row + at] = index;
    if (*visitor).n == k {
        (*visitor).radius2 = bitcast<f32>(distances2[row + k - 1u]);
    }
}

fn end(visitor: ptr<function, Visitor>, query: u32) {
    found[query] = (*visitor).n;
    for (var at = (*visitor).n; at < arguments.further.z; at++) {
        indices[(*visitor).row + at] = NONE;
        distances2[(*visitor).row + at] = INFINITE;
    }
}
