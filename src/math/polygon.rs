//! Polygons in space.

use glam::{DVec2, DVec3};

/// Triangles of a simple polygon as indices of its corners: a fan if it is convex, else ears are cut off.
pub fn triangulate(points: &[DVec3]) -> impl Iterator<Item = [usize; 3]> + use<> {
    /// Corners of a polygon that is examined; more are taken as convex.
    const MAX_CORNERS: usize = 64;
    let n = points.len();
    let mut triangles = Vec::with_capacity(n.saturating_sub(2));
    let mut corners: Vec<usize> = (0..n).collect();
    let flat = project(points);
    while (4..=MAX_CORNERS).contains(&corners.len()) && !is_convex(&flat, &corners) {
        let m = corners.len();
        let is_ear = |&i: &usize| {
            let (a, b, c) = (corners[(i + m - 1) % m], corners[i], corners[(i + 1) % m]);
            area(flat[a], flat[b], flat[c]) > 0.0
                && !corners.iter().any(|&p| p != a && p != b && p != c && contains([a, b, c].map(|i| flat[i]), flat[p]))
        };
        // Without an ear the polygon crosses itself: any answer will do.
        let ear = (0..m).find(is_ear).unwrap_or(0);
        triangles.push([corners[(ear + m - 1) % m], corners[ear], corners[(ear + 1) % m]]);
        corners.remove(ear);
    }
    for i in 2..corners.len() {
        triangles.push([corners[0], corners[i - 1], corners[i]]);
    }
    triangles.into_iter()
}

/// The polygon on the plane of its (Newell) normal, seen so that it is counter-clockwise.
fn project(points: &[DVec3]) -> Vec<DVec2> {
    let points: Vec<DVec3> = points.iter().map(|p| p - points[0]).collect();
    let normal: DVec3 = points.windows(2).map(|edge| edge[0].cross(edge[1])).sum();
    // Scaled first: its square may vanish.
    let (x, y) = (normal / normal.abs().max_element()).try_normalize().unwrap_or(DVec3::Z).any_orthonormal_pair();
    points.iter().map(|p| DVec2::new(p.dot(x), p.dot(y))).collect()
}

fn is_convex(flat: &[DVec2], corners: &[usize]) -> bool {
    let m = corners.len();
    (0..m).all(|i| area(flat[corners[i]], flat[corners[(i + 1) % m]], flat[corners[(i + 2) % m]]) >= 0.0)
}

/// Twice the area, positive if counter-clockwise.
fn area(a: DVec2, b: DVec2, c: DVec2) -> f64 {
    (b - a).perp_dot(c - a)
}

fn contains([a, b, c]: [DVec2; 3], p: DVec2) -> bool {
    area(a, b, p) >= 0.0 && area(b, c, p) >= 0.0 && area(c, a, p) >= 0.0
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DQuat;

    #[test]
    fn a_concave_polygon_keeps_its_area() {
        let outline = [(0, 0), (4, 0), (4, 4), (3, 1), (1, 1), (0, 4)].map(|(x, y)| DVec2::new(x.into(), y.into()));
        let tilt = DQuat::from_rotation_x(2.0) * DQuat::from_rotation_y(1.0);
        let points = outline.map(|p| tilt * p.extend(0.0));
        let areas: Vec<f64> = triangulate(&points).map(|[a, b, c]| area(outline[a], outline[b], outline[c])).collect();
        assert_eq!(areas.len(), 4);
        assert!(areas.iter().all(|&area| area >= 0.0));
        // 16 less the trapezium between (4, 4), (3, 1), (1, 1), (0, 4).
        assert!((areas.iter().sum::<f64>() / 2.0 - (16.0 - 9.0)).abs() < 1e-9);
    }
}
