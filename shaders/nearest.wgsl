// The nearest points of each query, sorted, ties in order of the index. The lists lie in the results: the ball shrinks as
// they fill, so that few points get that far. So that it is small from the beginning, the points that are next to
// the query in Morton order come first.
#import search
#import rank

@group(0) @binding(4) var<storage, read_write> found: array<u32>;
// [query][k]
@group(0) @binding(5) var<storage, read_write> indices: array<u32>;
// The bits of squared distances, which are ordered as the numbers are.
@group(0) @binding(6) var<storage, read_write> distances2: array<u32>;
// All levels of the tree, the one around all points last.
@group(0) @binding(7) var<storage, read> boxes: array<PointBox>;

const INFINITE: u32 = 0x7f800000u;

struct Visitor {
    // Once the list is full, its last distance.
    radius2: f32,
    row: u32,
    n: u32,
    // Slots that are known already: the first, and their number.
    seeds: vec2<u32>,
}

// further.z: k.
fn begin(query: u32, centre: vec3<f32>, radius2: f32) -> Visitor {
    let n_points = arguments.further.x;
    let k = arguments.further.z;
    var visitor: Visitor;
    visitor.radius2 = radius2;
    visitor.row = query * k;
    // Without a tree of our own the order of the points is not known either.
    if n_points == 0u || arguments.further.y == 0u {
        return visitor;
    }
    let rank = rank_of(centre, n_points, boxes[level_of(arguments.further.y - 1u).x]);
    let n = min(clamp(2u * k, 8u, 64u), n_points);
    let first = first_around(rank, n, n_points);
    for (var i = 0u; i < n; i++) {
        // From the query's place outwards, to both sides in turn; around the end where there are no more on one.
        let step = select(i / 2u, n - (i + 1u) / 2u, (i & 1u) != 0u);
        let slot = first + (rank - first + step) % n;
        let delta = position_of(slot) - centre;
        let distance2 = delta.x * delta.x + delta.y * delta.y + delta.z * delta.z;
        if distance2 <= visitor.radius2 {
            visit(&visitor, slot, delta, distance2);
        }
    }
    visitor.seeds = vec2(first, n);
    return visitor;
}

fn visit(visitor: ptr<function, Visitor>, slot: u32, delta: vec3<f32>, distance2: f32) {
    // A slot before the first wraps around.
    if slot - (*visitor).seeds.x < (*visitor).seeds.y {
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
