// A search for each of many queries over points in the order of a tree; `search` is the entry point.
//
// The module that imports this defines
//   struct Visitor and fn visit, as for `walk`;
//   fn begin(query: u32, centre: vec3<f32>, radius2: f32) -> Visitor, before the first point: its radius2 is what is
//   searched;
//   fn end(visitor: ptr<function, Visitor>, query: u32), after the last.
// Queries come in any order, `query` is the one the caller knows. Bindings from 4 on are the module's own.
#import tree

// In the order of the tree: the bits of the position, and the index the point had.
@group(0) @binding(0) var<storage, read> points: array<vec4<u32>>;
@group(0) @binding(1) var<storage, read> tree: array<TreeNode>;
// Records of some words, a position first in each; in Morton order, followed by the index the query had.
@group(0) @binding(2) var<storage, read> queries: array<u32>;
// One for all, or one a query.
@group(0) @binding(3) var<storage, read> radii: array<f32>;

const LARGEST: f32 = 3.4028234e38;

fn position_of(slot: u32) -> vec3<f32> {
    return bitcast<vec3<f32>>(points[slot].xyz);
}

// The caller's index of the point in a slot.
fn index_of(slot: u32) -> u32 {
    return points[slot].w;
}

// Reads points, tree, queries and radii; one thread per query.
// values: first query, the one after the last, words in a record, 1: each has its radius.
// further: points, levels of the tree, whatever the module says, 1: in Morton order.
@compute @workgroup_size(64)
fn search(
    @builtin(workgroup_id) workgroup: vec3<u32>,
    @builtin(num_workgroups) workgroups: vec3<u32>,
    @builtin(local_invocation_index) local: u32,
) {
    let i = arguments.values.x + thread_index(workgroup, workgroups, local, 64u);
    if i >= arguments.values.y {
        return;
    }
    let at = i * arguments.values.z;
    let centre = bitcast<vec3<f32>>(vec3(queries[at], queries[at + 1u], queries[at + 2u]));
    var query = i;
    if arguments.further.w != 0u {
        query = queries[at + 3u];
    }
    let radius = radii[query * arguments.values.w];
    // Nothing is within a radius below zero, and everything within one whose square overflows.
    let radius2 = select(-1.0, min(radius * radius, LARGEST), radius >= 0.0);
    var visitor = begin(query, centre, radius2);
    walk(&visitor, centre, arguments.further.x, arguments.further.y);
    end(&visitor, query);
}
