//! Whether two triangles have more in common than the corners they share: exactly.
//!
//! Signs of determinants, by Shewchuk 1997, "Adaptive Precision Floating-Point Arithmetic and Fast Robust Geometric
//! Predicates", exact unless products vanish: coordinates below some 10⁻⁷⁰ of the largest may.

use robust::{Coord, Coord3D, orient2d, orient3d};

type Point = [f64; 3];
type Triangle = [Point; 3];

/// Whether three points are on one line, or in one place.
pub fn are_collinear(t: Triangle) -> bool {
    projection(t).is_none()
}

/// Whether two triangles, neither [collinear](are_collinear), intersect in more than what follows from the corners they
/// share. `ids` names the corners; two are the same where their ids are. Triangles with the same three corners do not.
pub fn intersect(a: Triangle, a_ids: [u32; 3], b: Triangle, b_ids: [u32; 3]) -> bool {
    let (a, a_shared) = shared_first(a, a_ids, b_ids);
    let (b, b_shared) = shared_first(b, b_ids, a_ids);
    debug_assert_eq!(a_shared, b_shared);
    match a_shared {
        0 => {
            let (of_b, of_a) = (sides(a, b), sides(b, a));
            !is_apart(&of_b) && !is_apart(&of_a) && (edges_meet(a, b) || edges_meet(b, a))
        }
        // What they have in common besides the corner reaches, from the corner, as far as the opposite edge of one.
        1 => {
            let (of_b, of_a) = (sides(a, b), sides(b, a));
            !is_apart(&of_b[1..])
                && !is_apart(&of_a[1..])
                && (segment_meets([b[1], b[2]], a) || segment_meets([a[1], a[2]], b))
        }
        // Folded onto each other. Shared corners may come in either order.
        2 => {
            let apex = b[2];
            side(a, apex) == 0.0
                && projection(a)
                    .is_some_and(|axes| same_sign(turn(axes, a[0], a[1], a[2]), turn(axes, a[0], a[1], apex)))
        }
        _ => false,
    }
}

/// Corners that the other triangle has, before the others; and how many they are.
fn shared_first(t: Triangle, ids: [u32; 3], other: [u32; 3]) -> (Triangle, usize) {
    let mut order = [0, 1, 2];
    order.sort_by_key(|&i: &usize| !other.contains(&ids[i]));
    (order.map(|i| t[i]), ids.iter().filter(|id| other.contains(id)).count())
}

/// On which side of a triangle's plane a point is.
fn side([a, b, c]: Triangle, p: Point) -> f64 {
    let coord = |[x, y, z]: Point| Coord3D { x, y, z };
    orient3d(coord(a), coord(b), coord(c), coord(p))
}

fn sides(t: Triangle, of: Triangle) -> [f64; 3] {
    of.map(|p| side(t, p))
}

/// All strictly on the same side.
fn is_apart(sides: &[f64]) -> bool {
    sides.iter().all(|&s| s > 0.0) || sides.iter().all(|&s| s < 0.0)
}

fn same_sign(a: f64, b: f64) -> bool {
    (a > 0.0 && b > 0.0) || (a < 0.0 && b < 0.0)
}

fn edges_meet([a, b, c]: Triangle, t: Triangle) -> bool {
    [[a, b], [b, c], [c, a]].into_iter().any(|edge| segment_meets(edge, t))
}

/// Whether a segment has a point of a triangle, its edges included.
fn segment_meets([p, q]: [Point; 2], t: Triangle) -> bool {
    let (of_p, of_q) = (side(t, p), side(t, q));
    if same_sign(of_p, of_q) {
        return false;
    }
    let [a, b, c] = t;
    if of_p == 0.0 && of_q == 0.0 {
        let Some(axes) = projection(t) else { return false };
        return is_inside(axes, p, t) || [[a, b], [b, c], [c, a]].into_iter().any(|edge| cross(axes, [p, q], edge));
    }
    let around = [[a, b], [b, c], [c, a]].map(|[from, to]| side([p, q, from], to));
    around.iter().all(|&s| s >= 0.0) || around.iter().all(|&s| s <= 0.0)
}

/// Two axes along which the triangle has an area.
fn projection([a, b, c]: Triangle) -> Option<[usize; 2]> {
    [[0, 1], [1, 2], [2, 0]].into_iter().find(|&axes| turn(axes, a, b, c) != 0.0)
}

fn turn([x, y]: [usize; 2], a: Point, b: Point, c: Point) -> f64 {
    let coord = |p: Point| Coord { x: p[x], y: p[y] };
    orient2d(coord(a), coord(b), coord(c))
}

fn is_inside(axes: [usize; 2], p: Point, [a, b, c]: Triangle) -> bool {
    let turns = [turn(axes, a, b, p), turn(axes, b, c, p), turn(axes, c, a, p)];
    turns.iter().all(|&s| s >= 0.0) || turns.iter().all(|&s| s <= 0.0)
}

/// Whether two segments in a plane have a point in common.
fn cross(axes: [usize; 2], [p, q]: [Point; 2], [a, b]: [Point; 2]) -> bool {
    let of_pq = [turn(axes, p, q, a), turn(axes, p, q, b)];
    let of_ab = [turn(axes, a, b, p), turn(axes, a, b, q)];
    if of_pq == [0.0; 2] && of_ab == [0.0; 2] {
        // On one line.
        return axes
            .into_iter()
            .all(|axis| p[axis].min(q[axis]) <= a[axis].max(b[axis]) && a[axis].min(b[axis]) <= p[axis].max(q[axis]));
    }
    !same_sign(of_pq[0], of_pq[1]) && !same_sign(of_ab[0], of_ab[1])
}

#[cfg(test)]
mod tests {
    use super::*;

    const FLAT: Triangle = [[0.0, 0.0, 0.0], [2.0, 0.0, 0.0], [0.0, 2.0, 0.0]];

    /// With no corner in common, by any order of the corners of either, either first.
    fn apart(b: Triangle) -> bool {
        all_orders([0, 1, 2], b, [3, 4, 5])
    }

    fn all_orders(a_ids: [u32; 3], b: Triangle, b_ids: [u32; 3]) -> bool {
        let orders = [[0, 1, 2], [1, 2, 0], [2, 0, 1], [0, 2, 1], [2, 1, 0], [1, 0, 2]];
        let mut answers = Vec::new();
        for i in orders {
            for j in orders {
                let (a, a_ids) = (i.map(|k| FLAT[k]), i.map(|k| a_ids[k]));
                let (b, b_ids) = (j.map(|k| b[k]), j.map(|k| b_ids[k]));
                answers.extend([intersect(a, a_ids, b, b_ids), intersect(b, b_ids, a, a_ids)]);
            }
        }
        assert!(answers.iter().all(|answer| *answer == answers[0]), "{b:?}");
        !answers[0]
    }

    #[test]
    fn no_corner_shared() {
        assert!(!apart([[0.5, 0.5, -1.0], [0.5, 0.5, 1.0], [3.0, 3.0, 1.0]]), "through");
        assert!(!apart([[0.5, 0.5, 0.0], [0.5, 0.5, 1.0], [3.0, 3.0, 1.0]]), "a corner on it");
        assert!(!apart([[1.0, 1.0, 0.0], [1.0, 1.0, 1.0], [3.0, 3.0, 1.0]]), "a corner on its edge");
        assert!(!apart([[1.0, -1.0, 0.0], [1.0, 1.0, 0.0], [4.0, -1.0, 1.0]]), "an edge in its plane");
        assert!(apart([[1.0, 1.0 + 1e-15, 0.0], [1.0, 1.0, 1.0], [3.0, 3.0, 1.0]]), "beside its edge");
        assert!(apart([[0.5, 0.5, 1e-300], [0.5, 0.5, 1.0], [3.0, 3.0, 1.0]]), "above it");
        assert!(apart([[2.5, 0.0, -1.0], [2.5, 0.0, 1.0], [4.0, 0.0, 0.0]]), "across its plane only");
    }

    #[test]
    fn in_one_plane() {
        assert!(!apart([[0.1, 0.1, 0.0], [0.2, 0.1, 0.0], [0.1, 0.2, 0.0]]), "within");
        assert!(!apart([[-9.0, -9.0, 0.0], [9.0, -9.0, 0.0], [0.0, 20.0, 0.0]]), "around");
        assert!(!apart([[-1.0, 0.5, 0.0], [3.0, 0.5, 0.0], [0.0, 9.0, 0.0]]), "across");
        assert!(!apart([[2.0, 0.0, 0.0], [3.0, 0.0, 0.0], [3.0, 1.0, 0.0]]), "at a corner");
        assert!(!apart([[0.5, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, -1.0, 0.0]]), "along an edge");
        assert!(apart([[2.1, 0.0, 0.0], [3.0, 0.0, 0.0], [3.0, 1.0, 0.0]]), "apart, on the line of an edge");
        assert!(apart([[1.1, 1.1, 0.0], [3.0, 1.0, 0.0], [3.0, 3.0, 0.0]]), "beside");
    }

    #[test]
    fn one_corner_shared() {
        let meets = |b, c| !all_orders([0, 1, 2], [FLAT[0], b, c], [0, 4, 5]);
        assert!(meets([1.0, 1.0, 1.0], [1.0, 1.0, -1.0]), "the opposite edge goes through");
        assert!(meets([9.0, 9.0, 1.0], [9.0, 9.0, -1.0]), "through the opposite edge");
        assert!(meets([0.5, 0.5, 0.0], [0.0, 0.0, 1.0]), "an edge on it");
        assert!(meets([4.0, 0.0, 0.0], [0.0, 0.0, 1.0]), "an edge along its edge");
        assert!(meets([9.0, 0.5, 0.0], [0.5, 9.0, 0.0]), "in one plane");
        assert!(!meets([-1.0, 0.0, 0.0], [0.0, -1.0, 0.0]), "in one plane, beside");
        assert!(!meets([1.0, 1.0, 1.0], [0.0, 0.0, 1.0]), "above");
        assert!(!meets([-1.0, -1.0, 1.0], [-1.0, -1.0, -1.0]), "through the corner only");
    }

    #[test]
    fn an_edge_shared() {
        let meets = |c| !all_orders([0, 1, 2], [FLAT[0], FLAT[1], c], [0, 1, 5]);
        assert!(meets([0.5, 0.1, 0.0]) && meets([9.0, 9.0, 0.0]), "folded back");
        assert!(!meets([0.5, -1.0, 0.0]) && !meets([0.5, 1.0, 1e-300]), "unfolded");
        assert!(all_orders([0, 1, 2], FLAT, [1, 2, 0]), "a duplicate");
    }

    #[test]
    fn no_area() {
        assert!(are_collinear([[0.1; 3], [0.2; 3], [0.4; 3]]));
        // 0.1 + 0.2 is rounded, and so is not half of 0.6.
        assert!(!are_collinear([[0.0; 3], [0.1, 0.2, 0.0], [0.1 + 0.2, 0.6, 0.0]]));
    }
}
