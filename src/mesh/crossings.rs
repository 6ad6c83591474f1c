//! Whether two triangles have more in common than the corners they share, and whether they pass through each other: exactly.
//!
//! Signs of determinants, by Shewchuk 1997, "Adaptive Precision Floating-Point Arithmetic and Fast Robust Geometric
//! Predicates", exact unless products vanish: coordinates below some 10⁻⁷⁰ of the largest may.

use glam::DVec3;
use robust::{Coord, Coord3D, orient2d, orient3d};

use super::largest;

type Point = [f64; 3];
type Triangle = [Point; 3];

/// Whether three points are on one line, or in one place.
pub fn are_collinear(t: Triangle) -> bool {
    projection(t).is_none()
}

/// What two triangles have in common beyond the corners they share.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Contact {
    /// The inside of one goes through the inside of the other, from one side to the other.
    Cross,
    /// A corner or an edge of one lies on the other, or they overlap in one plane.
    Touch,
}

/// What two triangles, neither [collinear](are_collinear), have in common beyond what follows from the corners they share.
/// `ids` names the corners; two are the same where their ids are. Triangles with the same three corners have nothing.
pub fn contact(a: Triangle, a_ids: [u32; 3], b: Triangle, b_ids: [u32; 3]) -> Option<Contact> {
    let (a, a_shared) = shared_first(a, a_ids, b_ids);
    let (b, b_shared) = shared_first(b, b_ids, a_ids);
    debug_assert_eq!(a_shared, b_shared);
    match a_shared {
        0 | 1 => {
            if are_parted(a, b, a_shared) {
                return None;
            }
            let (of_b, of_a) = (sides(a, b), sides(b, a));
            let are_apart = is_apart(&of_b[a_shared..]) || is_apart(&of_a[a_shared..]);
            // What they have in common besides a shared corner reaches, from there, as far as the opposite edge of one.
            let meet = || match a_shared {
                0 => edges_meet(a, b) || edges_meet(b, a),
                _ => segment_meets([b[1], b[2]], a) || segment_meets([a[1], a[2]], b),
            };
            match !are_apart && meet() {
                true if cross(a, of_a, b, of_b) => Some(Contact::Cross),
                true => Some(Contact::Touch),
                false => None,
            }
        }
        // Folded onto each other. Shared corners may come in either order.
        2 => {
            let apex = b[2];
            let axes = projection(a)?;
            let folded = same_sign(turn(axes, a[0], a[1], a[2]), turn(axes, a[0], a[1], apex)) && side(a, apex) == 0.0;
            folded.then_some(Contact::Touch)
        }
        _ => None,
    }
}

/// Whether a plane parts two triangles, but for their first corner where that is `shared`: never wrongly, but false may mean
/// that it was not found. Saves the exact tests, which take longest where four points are in one plane.
fn are_parted(a: Triangle, b: Triangle, shared: usize) -> bool {
    let origin = DVec3::from(a[0]);
    let from = |p: Point| DVec3::from(p) - origin;
    let (a, b) = (a.map(from), b.map(from));
    let normal = match shared {
        0 => a[0] + a[1] + a[2] - (b[0] + b[1] + b[2]),
        _ => {
            let towards = |p: DVec3| p / largest(p);
            towards(a[1]) + towards(a[2]) - towards(b[1]) - towards(b[2])
        }
    };
    // Twice as much as four roundings, and what products may lose that vanish.
    let error = |p: DVec3| 4.0 * f64::EPSILON * normal.abs().dot(p.abs()) + f64::MIN_POSITIVE;
    let least = a[shared..].iter().fold(f64::INFINITY, |least, &p| least.min(normal.dot(p) - error(p)));
    let most = b[shared..].iter().fold(f64::NEG_INFINITY, |most, &p| most.max(normal.dot(p) + error(p)));
    if shared == 0 { least > most } else { least > 0.0 && most < 0.0 }
}

/// Whether two triangles pass through each other, given on which sides of one the corners of the other are.
///
/// They do if each has corners on both sides of the other's plane, and what both leave of the line that the planes have in
/// common overlaps in more than a point (Guigue & Devillers 2003, "Fast and Robust Triangle-Triangle Overlap Test Using
/// Orientation Predicates", made strict).
fn cross(a: Triangle, of_a: [f64; 3], b: Triangle, of_b: [f64; 3]) -> bool {
    /// The corner that is alone on its side first, in the same sense of rotation; and whether that side is the positive one.
    fn alone_first(t: Triangle, sides: [f64; 3]) -> Option<(Triangle, bool)> {
        let lonely = |i: &usize| {
            let [s, next, other] = [0, 1, 2].map(|k| sides[(i + k) % 3]);
            (s > 0.0 && next <= 0.0 && other <= 0.0 || s < 0.0 && next >= 0.0 && other >= 0.0)
                && (next != 0.0 || other != 0.0)
        };
        let i = (0..3).find(lonely)?;
        Some(([0, 1, 2].map(|k| t[(i + k) % 3]), sides[i] > 0.0))
    }
    let (Some((mut a, a_is_above)), Some((mut b, b_is_above))) = (alone_first(a, of_a), alone_first(b, of_b)) else {
        return false;
    };
    // To turn one round changes the side of the other.
    if a_is_above {
        b.swap(1, 2);
    }
    if b_is_above {
        a.swap(1, 2);
    }
    side([a[0], a[1], b[0]], b[1]) > 0.0 && side([a[0], a[2], b[2]], b[0]) > 0.0
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
        return is_inside(axes, p, t)
            || [[a, b], [b, c], [c, a]].into_iter().any(|edge| segments_meet(axes, [p, q], edge));
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
fn segments_meet(axes: [usize; 2], [p, q]: [Point; 2], [a, b]: [Point; 2]) -> bool {
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

    const CROSS: Option<Contact> = Some(Contact::Cross);
    const TOUCH: Option<Contact> = Some(Contact::Touch);

    /// With [`FLAT`], which has no corner in common with it.
    fn apart(b: Triangle) -> Option<Contact> {
        in_any_order([0, 1, 2], b, [3, 4, 5])
    }

    /// By any order of the corners of either, either first.
    fn in_any_order(a_ids: [u32; 3], b: Triangle, b_ids: [u32; 3]) -> Option<Contact> {
        let orders = [[0, 1, 2], [1, 2, 0], [2, 0, 1], [0, 2, 1], [2, 1, 0], [1, 0, 2]];
        let mut answers = Vec::new();
        for i in orders {
            for j in orders {
                let (a, a_ids) = (i.map(|k| FLAT[k]), i.map(|k| a_ids[k]));
                let (b, b_ids) = (j.map(|k| b[k]), j.map(|k| b_ids[k]));
                answers.extend([contact(a, a_ids, b, b_ids), contact(b, b_ids, a, a_ids)]);
            }
        }
        assert!(answers.iter().all(|answer| *answer == answers[0]), "{b:?}");
        answers[0]
    }

    #[test]
    fn no_corner_shared() {
        assert_eq!(apart([[0.5, 0.5, -1.0], [0.5, 0.5, 1.0], [3.0, 3.0, 1.0]]), CROSS, "through");
        assert_eq!(
            apart([[0.5, 0.5, -1.0], [0.5, 0.7, 1.0], [3.0, 3.0, 0.0]]),
            CROSS,
            "through, a corner in its plane"
        );
        assert_eq!(apart([[0.5, 0.5, 0.0], [0.5, 0.5, 1.0], [3.0, 3.0, 1.0]]), TOUCH, "a corner on it");
        assert_eq!(apart([[1.0, 1.0, 0.0], [1.0, 1.0, 1.0], [3.0, 3.0, 1.0]]), TOUCH, "a corner on its edge");
        assert_eq!(apart([[1.0, -1.0, 0.0], [1.0, 1.0, 0.0], [4.0, -1.0, 1.0]]), TOUCH, "an edge in its plane");
        assert_eq!(apart([[1.0, 1.0, -1.0], [1.0, 1.0, 1.0], [3.0, 3.0, 1.0]]), TOUCH, "its edge, and no more");
        assert_eq!(apart([[1.0, 1.0 + 1e-15, 0.0], [1.0, 1.0, 1.0], [3.0, 3.0, 1.0]]), None, "beside its edge");
        assert_eq!(apart([[0.5, 0.5, 1e-300], [0.5, 0.5, 1.0], [3.0, 3.0, 1.0]]), None, "above it");
        assert_eq!(apart([[2.5, 0.0, -1.0], [2.5, 0.0, 1.0], [4.0, 0.0, 0.0]]), None, "across its plane only");
    }

    #[test]
    fn in_one_plane() {
        assert_eq!(apart([[0.1, 0.1, 0.0], [0.2, 0.1, 0.0], [0.1, 0.2, 0.0]]), TOUCH, "within");
        assert_eq!(apart([[-9.0, -9.0, 0.0], [9.0, -9.0, 0.0], [0.0, 20.0, 0.0]]), TOUCH, "around");
        assert_eq!(apart([[-1.0, 0.5, 0.0], [3.0, 0.5, 0.0], [0.0, 9.0, 0.0]]), TOUCH, "across");
        assert_eq!(apart([[2.0, 0.0, 0.0], [3.0, 0.0, 0.0], [3.0, 1.0, 0.0]]), TOUCH, "at a corner");
        assert_eq!(apart([[0.5, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, -1.0, 0.0]]), TOUCH, "along an edge");
        assert_eq!(apart([[2.1, 0.0, 0.0], [3.0, 0.0, 0.0], [3.0, 1.0, 0.0]]), None, "apart, on the line of an edge");
        assert_eq!(apart([[2.1, 0.0, 0.0], [2.2, 0.0, 0.0], [-30.0, -1.0, 0.0]]), None, "the same, but hard to part");
        assert_eq!(apart([[1.1, 1.1, 0.0], [3.0, 1.0, 0.0], [3.0, 3.0, 0.0]]), None, "beside");
    }

    #[test]
    fn one_corner_shared() {
        let meets = |b, c| in_any_order([0, 1, 2], [FLAT[0], b, c], [0, 4, 5]);
        assert_eq!(meets([1.0, 1.0, 1.0], [1.0, 1.0, -1.0]), CROSS, "the opposite edge goes through its edge");
        assert_eq!(meets([9.0, 9.0, 1.0], [9.0, 9.0, -1.0]), CROSS, "through the opposite edge");
        assert_eq!(meets([0.5, 0.5, 0.0], [0.0, 0.0, 1.0]), TOUCH, "an edge on it");
        assert_eq!(meets([4.0, 0.0, 0.0], [0.0, 0.0, 1.0]), TOUCH, "an edge along its edge");
        assert_eq!(meets([1.0, 0.0, 1.0], [1.0, 0.0, -1.0]), TOUCH, "its edge, and no more");
        assert_eq!(meets([9.0, 0.5, 0.0], [0.5, 9.0, 0.0]), TOUCH, "in one plane");
        assert_eq!(meets([-1.0, 0.0, 0.0], [0.0, -1.0, 0.0]), None, "in one plane, beside");
        assert_eq!(meets([1.0, 1.0, 1.0], [0.0, 0.0, 1.0]), None, "above");
        assert_eq!(meets([-1.0, -1.0, 1.0], [-1.0, -1.0, -1.0]), None, "through the corner only");
    }

    #[test]
    fn an_edge_shared() {
        let meets = |c| in_any_order([0, 1, 2], [FLAT[0], FLAT[1], c], [0, 1, 5]);
        assert_eq!([meets([0.5, 0.1, 0.0]), meets([9.0, 9.0, 0.0])], [TOUCH; 2], "folded back");
        assert_eq!([meets([0.5, -1.0, 0.0]), meets([0.5, 1.0, 1e-300])], [None; 2], "unfolded");
        assert_eq!(in_any_order([0, 1, 2], FLAT, [1, 2, 0]), None, "a duplicate");
    }

    #[test]
    fn no_area() {
        assert!(are_collinear([[0.1; 3], [0.2; 3], [0.4; 3]]));
        // 0.1 + 0.2 is rounded, and so is not half of 0.6.
        assert!(!are_collinear([[0.0; 3], [0.1, 0.2, 0.0], [0.1 + 0.2, 0.6, 0.0]]));
    }
}
