//! Boxes, and the box of what a cell leaves of a triangle (Sutherland & Hodgman 1974).
//!
//! What is built over are corners in single precision; clipping is in double precision, against a cell wider by
//! [`SLACK`], and what rounding may take away is given back: a triangle that has a point in a cell is never dropped from
//! it, and the box holds all its points there. A coordinate that all corners share stays exactly that, so that planar
//! triangles stay planar.

/// An axis-aligned box, in the frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Aabb {
    pub min: [f32; 3],
    pub max: [f32; 3],
}

/// How far outside a cell clipping goes.
const SLACK: f64 = 1.0 / (1u64 << 40) as f64;
/// Above the error of a point cut by six planes.
const PAD: f64 = 1.0 / (1u64 << 45) as f64;
/// Corners of a triangle cut by six planes, and room for some that rounding adds.
const MOST: usize = 12;

impl Aabb {
    pub const NOTHING: Self = Self { min: [f32::INFINITY; 3], max: [f32::NEG_INFINITY; 3] };

    pub fn with(mut self, p: [f32; 3]) -> Self {
        for (axis, x) in p.into_iter().enumerate() {
            self.min[axis] = self.min[axis].min(x);
            self.max[axis] = self.max[axis].max(x);
        }
        self
    }

    /// Around a triangle.
    pub fn of(corners: &[[f32; 3]; 3]) -> Self {
        corners.iter().fold(Self::NOTHING, |b, &p| b.with(p))
    }

    /// The parts below and above a plane.
    pub fn cut(self, axis: usize, at: f32) -> [Self; 2] {
        let (mut below, mut above) = (self, self);
        below.max[axis] = at;
        above.min[axis] = at;
        [below, above]
    }
}

#[derive(Clone, Copy)]
struct Corner {
    at: [f64; 3],
    /// Computed, not given.
    cut: bool,
}

const NONE: Corner = Corner { at: [0.0; 3], cut: false };

/// The box of the triangle's part in the cell; nothing if there is none.
pub fn clip(triangle: &[[f32; 3]; 3], cell: &Aabb) -> Option<Aabb> {
    let whole = Aabb::of(triangle);
    let (mut polygon, mut other) = ([NONE; MOST], [NONE; MOST]);
    let mut n = 3;
    for (corner, p) in polygon.iter_mut().zip(triangle) {
        corner.at = p.map(f64::from);
    }
    for axis in 0..3 {
        for (plane, sign, needed) in [
            (f64::from(cell.min[axis]) - SLACK, 1.0, whole.min[axis] < cell.min[axis]),
            (f64::from(cell.max[axis]) + SLACK, -1.0, whole.max[axis] > cell.max[axis]),
        ] {
            if needed {
                match cut(&polygon[..n], &mut other, axis, plane, sign) {
                    Some(0) => return None,
                    Some(left) => n = left,
                    None => return within(&whole, cell, whole),
                }
                std::mem::swap(&mut polygon, &mut other);
            }
        }
    }
    let mut left = Aabb::NOTHING;
    for corner in &polygon[..n] {
        for (axis, &x) in corner.at.iter().enumerate() {
            let pad = if corner.cut { PAD } else { 0.0 };
            left.min[axis] = left.min[axis].min(down(x - pad));
            left.max[axis] = left.max[axis].max(up(x + pad));
        }
    }
    within(&whole, cell, left)
}

/// The box `left`, cut to the cell and to the whole triangle's box.
fn within(whole: &Aabb, cell: &Aabb, mut left: Aabb) -> Option<Aabb> {
    for axis in 0..3 {
        let (min, max) = (whole.min[axis].max(cell.min[axis]), whole.max[axis].min(cell.max[axis]));
        if min > max {
            return None;
        }
        // + 0: never −0.
        left.min[axis] = left.min[axis].clamp(min, max) + 0.0;
        left.max[axis] = left.max[axis].clamp(min, max) + 0.0;
    }
    Some(left)
}

/// Keeps what is on the side of the plane that `sign` points to; number of corners, none if they are too many.
fn cut(polygon: &[Corner], into: &mut [Corner; MOST], axis: usize, plane: f64, sign: f64) -> Option<usize> {
    let mut n = 0;
    let mut keep = |corner| {
        // A convex polygon gains one corner a plane; rounding may make it slightly concave, and then it may gain more.
        *into.get_mut(n)? = corner;
        n += 1;
        Some(())
    };
    let outside = |corner: &Corner| (corner.at[axis] - plane) * sign < 0.0;
    for (i, from) in polygon.iter().enumerate() {
        let to = &polygon[(i + 1) % polygon.len()];
        if !outside(from) {
            keep(*from)?;
        }
        if outside(from) != outside(to) {
            let part = (plane - from.at[axis]) / (to.at[axis] - from.at[axis]);
            let mut at = std::array::from_fn(|axis| {
                let (a, b) = (from.at[axis], to.at[axis]);
                (a + part * (b - a)).clamp(a.min(b), a.max(b))
            });
            at[axis] = plane;
            keep(Corner { at, cut: true })?;
        }
    }
    Some(n)
}

fn down(x: f64) -> f32 {
    let rounded = x as f32;
    if f64::from(rounded) > x { rounded.next_down() } else { rounded }
}

fn up(x: f64) -> f32 {
    let rounded = x as f32;
    if f64::from(rounded) < x { rounded.next_up() } else { rounded }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::rng::pcg4d;

    /// Single-precision points on edges, which clipping can only round, and cells that end there.
    #[test]
    fn a_point_of_a_triangle_in_a_cell_is_in_its_box() {
        let mut cut = 0;
        for seed in 0..20_000 {
            let mut drawn = 0;
            let mut below = |n: u32| {
                drawn += 1;
                pcg4d([seed, drawn, 3, 1])[0] % n
            };
            let mut place = |n: u32| [(); 3].map(|()| below(n) as f32 / 512.0);
            let (a, d, c) = (place(512), place(64), place(512));
            let b = std::array::from_fn(|i| a[i] + 7.0 * d[i]);
            let k = (1 + below(6)) as f32;
            let on_edge: [f32; 3] = std::array::from_fn(|i| a[i] + k * d[i]);
            let mut cell = Aabb { min: on_edge, max: on_edge };
            for axis in 0..3 {
                let size = 0.1 * (1 + below(5)) as f32;
                if below(2) == 0 {
                    cell.min[axis] -= size;
                } else {
                    cell.max[axis] += size;
                }
            }
            let left = clip(&[a, b, c], &cell).expect("it has a point there");
            for (axis, &x) in on_edge.iter().enumerate() {
                assert!(left.min[axis] <= x && x <= left.max[axis], "seed {seed}");
                assert!(left.min[axis] >= cell.min[axis] && left.max[axis] <= cell.max[axis], "seed {seed}");
            }
            cut += usize::from(left.max != cell.max && left.min != cell.min);
        }
        assert!(cut > 1000, "only {cut} were cut");
    }

    #[test]
    fn boxes_are_rounded_outward() {
        for seed in 0..1000 {
            let [a, b, sign, _] = pcg4d([seed, 0, 3, 2]);
            let x = (f64::from(a) + f64::from(b) / 4e9) / 4e9 * if sign % 2 == 0 { 1.0 } else { -1.0 };
            let (below, above) = (f64::from(down(x)), f64::from(up(x)));
            assert!(below <= x && x <= above && above - below < 1e-6, "{x}");
        }
        assert_eq!((down(0.5), up(0.5)), (0.5, 0.5));
    }

    #[test]
    fn the_box_is_that_of_the_part() {
        let cell = Aabb { min: [0.0; 3], max: [1.0; 3] };
        // A corner of the triangle is cut off at x = 0, half way.
        let left = clip(&[[-0.5, 0.25, 0.5], [0.5, 0.25, 0.5], [0.5, 0.75, 0.5]], &cell).unwrap();
        assert!((left.min[0], left.max[0], left.min[1], left.min[2], left.max[2]) == (0.0, 0.5, 0.25, 0.5, 0.5));
        assert_eq!(left.max[1], 0.75);
        let left = clip(&[[-0.5, 0.25, 0.5], [0.5, 0.25, 0.5], [-0.5, 0.75, 0.5]], &cell).unwrap();
        assert!((left.max[1] - 0.5).abs() < 1e-6 && left.max[0] == 0.5);
        // Its box meets the cell, the triangle does not.
        assert_eq!(clip(&[[-0.9, 0.5, 0.5], [0.5, 1.9, 0.5], [-0.9, 1.9, 0.5]], &cell), None);
        assert_eq!(clip(&[[2.0, 0.5, 0.5], [3.0, 1.0, 0.5], [3.0, 0.0, 0.5]], &cell), None);
    }
}
