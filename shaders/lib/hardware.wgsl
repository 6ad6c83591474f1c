// The walk of `tree` by the adapter's ray queries: `walk` calls `visit` for each point within the visitor's radius, in
// whatever order the boxes are found.
//
// The module that imports this defines the same as one that imports `tree`, but its `tree` is an acceleration_structure:
// one box a slot, around every place from which the point may lie within the largest radius (inflate.wgsl).
#import common

fn walk(visitor: ptr<function, Visitor>, centre: vec3<f32>, n_points: u32, n_levels: u32) {
    var query: ray_query;
    // A ray that does not leave the place. Its direction has no zero, for the tests against boxes divide by it.
    let ray = RayDesc(RAY_FLAG_SKIP_TRIANGLES, 0xffu, 0.0, 1e-16, centre, vec3(1e-16));
    rayQueryInitialize(&query, tree, ray);
    // Nothing is ever committed, so that the ray stays as long as it is and finds every box.
    while rayQueryProceed(&query) {
        let slot = rayQueryGetCandidateIntersection(&query).primitive_index;
        // A box may be found that the centre is not in, and there is one though there be no point.
        if slot >= n_points {
            continue;
        }
        let delta = position_of(slot) - centre;
        let distance2 = delta.x * delta.x + delta.y * delta.y + delta.z * delta.z;
        if distance2 <= (*visitor).radius2 {
            visit(visitor, slot, delta, distance2);
        }
    }
}
