// Where a query would stand among points in Morton order. The module that imports this defines fn position_of, as for `walk`.
#import morton_code

// Number of points before the query; `all` is the box around the points.
fn rank_of(centre: vec3<f32>, n_points: u32, all: PointBox) -> u32 {
    let code = morton_code(centre, all.min, all.max);
    var low = 0u;
    var high = n_points;
    while low < high {
        let middle = low + (high - low) / 2u;
        let other = morton_code(position_of(middle), all.min, all.max);
        if other.y < code.y || (other.y == code.y && other.x < code.x) {
            low = middle + 1u;
        } else {
            high = middle;
        }
    }
    return low;
}

// The first of the `n` points around a rank, as many on either side as there are.
fn first_around(rank: u32, n: u32, n_points: u32) -> u32 {
    return min(max(rank, n / 2u) - n / 2u, n_points - n);
}
