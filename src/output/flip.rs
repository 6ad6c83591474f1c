//! LDR-ꟻLIP: how different two pictures look to someone who flips between them on a screen.
//!
//! Andersson, Nilsson, Akenine-Möller, Oskarsson, Åström and Fairchild, "ꟻLIP: A Difference Evaluator for Alternating
//! Images", Proc. ACM Comput. Graph. Interact. Tech. 3(2), 2020. Per pixel, in [0, 1]: a colour difference after what
//! the eye does not resolve is filtered out, raised where edges or points differ. All filters are sums of Gaussians and
//! their derivatives, so they are applied as a column and then a row, row by row of the picture.

use glam::{DMat3, DVec3, Vec3};
use rayon::prelude::*;

/// Pixels per degree of the paper's viewer: 0.7 m from a 0.7 m wide screen of 3840 pixels.
pub const PIXELS_PER_DEGREE: f32 = 67.02;

/// What ꟻLIP finds.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Flip {
    /// 0, no difference, to 1, the largest; `[h·w]`, row-major; NaN where either picture is not finite.
    pub error: Vec<f32>,
    /// Of the errors that are finite, if there are any.
    pub mean: Option<f64>,
}

/// Compares two pictures of `size` (width, height) as a display shows them: linear RGB with the sRGB primaries in
/// [0, 1], `[h·w]`, row-major ([`super::display::linear`]); what is outside is cut off. The order of the two does not
/// matter. A pixel that is not finite in either is left out: to its neighbours it is black in both. `pixels_per_degree`
/// of visual angle, above 0: [`PIXELS_PER_DEGREE`].
///
/// Says what is wrong if a picture is not of that size, or `pixels_per_degree` not in [1, 1000].
pub fn flip(x: &[[f32; 3]], y: &[[f32; 3]], size: [usize; 2], pixels_per_degree: f32) -> Result<Flip, String> {
    let [width, height] = size;
    let pixels = width.checked_mul(height);
    if pixels != Some(x.len()) || pixels != Some(y.len()) {
        return Err(format!("pictures of {} and {} pixels are not {width}x{height}", x.len(), y.len()));
    }
    if !(1.0..=1000.0).contains(&pixels_per_degree) {
        return Err(format!("{pixels_per_degree} pixels per degree is not in 1 to 1000"));
    }
    if x.is_empty() {
        return Ok(Flip::default());
    }
    let filters = Filters::new(f64::from(pixels_per_degree));
    let space = Space::new();
    let finite: Vec<bool> = x.iter().zip(y).map(|(x, y)| x.iter().chain(y).all(|c| c.is_finite())).collect();
    let planes = [x, y].map(|rgb| Planes::new(rgb, &finite, &space));
    let mut error = vec![0.0; x.len()];
    error.par_chunks_mut(width).enumerate().for_each_init(
        || (Row::default(), Row::default(), Vec::new()),
        |(a, b, scratch), (at, error)| {
            a.filter(&planes[0], &filters, width, at, scratch);
            b.filter(&planes[1], &filters, width, at, scratch);
            for (i, (error, &finite)) in error.iter_mut().zip(&finite[at * width..]).enumerate() {
                if !finite {
                    *error = f32::NAN;
                    continue;
                }
                let colour = space.colour_difference(a.opponent(i), b.opponent(i));
                let edges = (a.edges(i) - b.edges(i)).abs().max((a.points(i) - b.points(i)).abs());
                let feature = (edges * std::f32::consts::FRAC_1_SQRT_2).clamp(0.0, 1.0).sqrt();
                *error = colour.powf(1.0 - feature);
            }
        },
    );
    let n = finite.iter().filter(|finite| **finite).count();
    let sum: f64 = error.iter().filter(|e| !e.is_nan()).map(|e| f64::from(*e)).sum();
    Ok(Flip { error, mean: (n > 0).then(|| sum / n as f64) })
}

/// Taps of the filters; each is symmetric about its middle tap, or antisymmetric (`edge`).
struct Filters {
    /// Contrast sensitivity, equation 1 and table 1: achromatic, red–green, and the two of blue–yellow, whose weights
    /// are such that the sum of all taps, in two dimensions, is 1.
    sensitivity: [Vec<f32>; 4],
    /// Feature detection, section 3.2: a Gaussian, and its first and second derivative.
    smooth: Vec<f32>,
    edge: Vec<f32>,
    point: Vec<f32>,
}

impl Filters {
    fn new(pixels_per_degree: f64) -> Self {
        use std::f64::consts::PI;
        let taps = |radius: f64, f: &dyn Fn(f64) -> f64| -> Vec<f64> {
            let radius = radius.ceil() as i32;
            (-radius..=radius).map(|i| f(f64::from(i))).collect()
        };
        // a·√(π/b)·exp(−π²d²/b), d in degrees.
        let widest = 0.04f64;
        let radius = 3.0 * (widest / (2.0 * PI * PI)).sqrt() * pixels_per_degree;
        let gaussian = |b: f64| taps(radius, &|i| (-(PI * i / pixels_per_degree).powi(2) / b).exp());
        let of = |terms: &[(f64, f64)]| -> Vec<Vec<f32>> {
            let weighted: Vec<_> = terms.iter().map(|&(a, b)| (a * (PI / b).sqrt(), gaussian(b))).collect();
            let total: f64 = weighted.iter().map(|(w, g)| w * g.iter().sum::<f64>().powi(2)).sum();
            // Applied twice, so each has the root of its weight.
            let scaled = |(w, g): (f64, Vec<f64>)| g.into_iter().map(|v| (v * (w / total).sqrt()) as f32).collect();
            weighted.into_iter().map(scaled).collect()
        };
        let one = |a, b| of(&[(a, b)]).swap_remove(0);
        let [wide, narrow] = [0, 1].map(|i| of(&[(34.1, 0.04), (13.5, 0.025)]).swap_remove(i));

        let sigma = 0.5 * 0.082 * pixels_per_degree;
        let detect = |f: &dyn Fn(f64) -> f64| {
            let taps = taps(3.0 * sigma, &|i| f(i / sigma) * (-0.5 * (i / sigma).powi(2)).exp());
            let positive: f64 = taps.iter().filter(|v| **v > 0.0).sum();
            let negative: f64 = taps.iter().filter(|v| **v < 0.0).sum();
            // What is above 0 sums to 1, what is below to −1.
            taps.into_iter().map(|v| (if v > 0.0 { v / positive } else { v / -negative.min(-1e-30) }) as f32).collect()
        };
        Self {
            sensitivity: [one(1.0, 0.0047), one(1.0, 0.0053), wide, narrow],
            smooth: detect(&|_| 1.0),
            edge: detect(&|u| -u),
            point: detect(&|u| u * u - 1.0),
        }
    }
}

/// Colour spaces, for the white of sRGB.
struct Space {
    /// XYZ over the white's, of linear RGB.
    from_rgb: DMat3,
    to_rgb: DMat3,
    /// The largest colour difference there is, green against blue, to the power of [`Space::POWER`].
    largest: f32,
}

impl Space {
    /// q_c of the paper.
    const POWER: f32 = 0.7;

    fn new() -> Self {
        // IEC 61966-2-1.
        let xyz = DMat3::from_cols(
            DVec3::new(0.412_390_8, 0.212_639_0, 0.019_330_8),
            DVec3::new(0.357_584_3, 0.715_168_7, 0.119_194_8),
            DVec3::new(0.180_480_8, 0.072_192_3, 0.950_532_2),
        );
        let from_rgb = DMat3::from_diagonal((xyz * DVec3::ONE).recip()) * xyz;
        let mut space = Self { from_rgb, to_rgb: from_rgb.inverse(), largest: 1.0 };
        let lab = |rgb: DVec3| hunt(lab((space.from_rgb * rgb).as_vec3()));
        space.largest = hyab(lab(DVec3::Y), lab(DVec3::Z)).powf(Self::POWER);
        space
    }

    /// YCₓC_z, "linearised CIELAB", of linear RGB.
    fn opponent(&self, rgb: [f32; 3]) -> [f32; 3] {
        let rgb = Vec3::from(rgb.map(|c| c.clamp(0.0, 1.0)));
        let [x, y, z] = (self.from_rgb.as_mat3() * rgb).to_array();
        [116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z)]
    }

    /// Section 3.1.2 and 3.1.3: of two filtered YCₓC_z colours, in [0, 1].
    fn colour_difference(&self, x: [f32; 3], y: [f32; 3]) -> f32 {
        // p_c and p_t: up to the share p_c of the largest difference is p_t of the range.
        const KNEE: f32 = 0.4;
        const KNEE_AT: f32 = 0.95;
        let [x, y] = [x, y].map(|[y, cx, cz]| {
            let y = (y + 16.0) / 116.0;
            let rgb = self.to_rgb.as_mat3() * Vec3::new(y + cx / 500.0, y, y - cz / 200.0);
            hunt(lab(self.from_rgb.as_mat3() * rgb.clamp(Vec3::ZERO, Vec3::ONE)))
        });
        let difference = hyab(x, y).powf(Self::POWER);
        let knee = KNEE * self.largest;
        let mapped = if difference < knee {
            difference * KNEE_AT / knee
        } else {
            KNEE_AT + (difference - knee) / (self.largest - knee) * (1.0 - KNEE_AT)
        };
        mapped.clamp(0.0, 1.0)
    }
}

/// CIELAB of XYZ over the white's.
fn lab(xyz: Vec3) -> [f32; 3] {
    const D: f32 = 6.0 / 29.0;
    let [x, y, z] = xyz.to_array().map(|t| if t > D * D * D { t.cbrt() } else { t / (3.0 * D * D) + 4.0 / 29.0 });
    [116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z)]
}

/// The Hunt effect: colours are less vivid in the dark.
fn hunt([l, a, b]: [f32; 3]) -> [f32; 3] {
    [l, 0.01 * l * a, 0.01 * l * b]
}

/// Distance of two CIELAB colours, for large differences (Abasi et al. 2020).
fn hyab(x: [f32; 3], y: [f32; 3]) -> f32 {
    (x[0] - y[0]).abs() + (x[1] - y[1]).hypot(x[2] - y[2])
}

/// A picture as YCₓC_z, each `[h·w]`, and Y again in [0, 1].
struct Planes {
    opponent: [Vec<f32>; 3],
    grey: Vec<f32>,
}

impl Planes {
    fn new(rgb: &[[f32; 3]], finite: &[bool], space: &Space) -> Self {
        let pixel = |(&rgb, &finite)| space.opponent(if finite { rgb } else { [0.0; 3] });
        let pixels: Vec<_> = rgb.par_iter().zip(finite).map(pixel).collect();
        let plane = |c: usize| pixels.iter().map(|p| p[c]).collect();
        let grey = pixels.iter().map(|p| (p[0] + 16.0) / 116.0).collect();
        Self { opponent: [plane(0), plane(1), plane(2)], grey }
    }
}

/// One row of a picture after all filters, each `[w]`.
#[derive(Default)]
struct Row {
    opponent: [Vec<f32>; 3],
    edge: [Vec<f32>; 2],
    point: [Vec<f32>; 2],
}

impl Row {
    fn filter(&mut self, planes: &Planes, filters: &Filters, width: usize, at: usize, scratch: &mut Vec<f32>) {
        let all = self.opponent.iter_mut().chain(&mut self.edge).chain(&mut self.point);
        all.for_each(|row| {
            row.clear();
            row.resize(width, 0.0);
        });
        for (taps, channel) in filters.sensitivity.iter().zip([0, 1, 2, 2]) {
            column(&planes.opponent[channel], width, at, taps, scratch);
            row(scratch, taps, &mut self.opponent[channel]);
        }
        column(&planes.grey, width, at, &filters.smooth, scratch);
        row(scratch, &filters.edge, &mut self.edge[0]);
        row(scratch, &filters.point, &mut self.point[0]);
        column(&planes.grey, width, at, &filters.edge, scratch);
        row(scratch, &filters.smooth, &mut self.edge[1]);
        column(&planes.grey, width, at, &filters.point, scratch);
        row(scratch, &filters.smooth, &mut self.point[1]);
    }

    fn opponent(&self, i: usize) -> [f32; 3] {
        [self.opponent[0][i], self.opponent[1][i], self.opponent[2][i]]
    }

    fn edges(&self, i: usize) -> f32 {
        (self.edge[0][i].powi(2) + self.edge[1][i].powi(2)).sqrt()
    }

    fn points(&self, i: usize) -> f32 {
        (self.point[0][i].powi(2) + self.point[1][i].powi(2)).sqrt()
    }
}

/// Row `at` of `plane` filtered along the columns into `out`, `[r + w + r]` for taps of radius r: the ends are repeated,
/// as are the first and the last row.
fn column(plane: &[f32], width: usize, at: usize, taps: &[f32], out: &mut Vec<f32>) {
    let (radius, last) = (taps.len() / 2, plane.len() / width - 1);
    out.clear();
    out.resize(width + 2 * radius, 0.0);
    let middle = &mut out[radius..radius + width];
    for (i, &tap) in taps.iter().enumerate() {
        let from = (at + i).saturating_sub(radius).min(last);
        add(middle, tap, &plane[from * width..][..width]);
    }
    let (first, end) = (out[radius], out[radius + width - 1]);
    out[..radius].fill(first);
    out[radius + width..].fill(end);
}

/// Adds `padded`, `[r + w + r]`, filtered along the row to `out`, `[w]`.
fn row(padded: &[f32], taps: &[f32], out: &mut [f32]) {
    for (i, &tap) in taps.iter().enumerate() {
        add(out, tap, &padded[i..i + out.len()]);
    }
}

fn add(to: &mut [f32], factor: f32, from: &[f32]) {
    to.iter_mut().zip(from).for_each(|(to, from)| *to += factor * from);
}

#[cfg(test)]
mod tests {
    use super::*;

    const SIZE: [usize; 2] = [48, 32];

    /// Two noisy ramps, one of another tint with a patch in it, the other with a bright pixel.
    fn synthetic(k: usize) -> Vec<[f32; 3]> {
        let pixel = |x: usize, y: usize| {
            if (x, y, k) == (38, 25, 0) {
                return [1.0; 3];
            }
            let patch =
                if (10..30).contains(&x) && (8..20).contains(&y) && k == 1 { [0.2, 1.0, 1.5] } else { [1.0; 3] };
            std::array::from_fn(|c| {
                let noise = (x * 37 + y * 101 + c * 53 + k * 29) % 64;
                let ramp = 0.5 * x as f32 / 47.0 * if c == k { 0.6 } else { 1.0 };
                ((ramp + 0.5 * noise as f32 / 63.0 * if k == 0 { 0.3 } else { 0.5 }) * patch[c]).min(1.0)
            })
        };
        (0..32).flat_map(|y| (0..48).map(move |x| pixel(x, y))).collect()
    }

    // Numbers of the authors' own package, flip-evaluator 1.7 for Python (LDR, the pictures sRGB-encoded in f32). Means it
    // and this find of pictures in renders/, both at 67.02: bathroom and fireplace 0.73017 and 0.72999, glass and pool
    // 0.56578 and 0.56577.
    #[test]
    fn equals_the_authors_implementation() {
        let places = [(0, 0), (47, 31), (10, 8), (20, 14), (38, 25), (5, 30)];
        let theirs = [
            (67.02, 0.434_077_6, [0.257_557_2, 0.667_519_2, 0.302_012_3, 0.483_675_5, 0.630_389, 0.311_791_9]),
            (20.0, 0.549_738_5, [0.467_554_1, 0.732_468_2, 0.517_521_7, 0.528_246_5, 0.877_053_8, 0.493_828_7]),
        ];
        for (pixels_per_degree, mean, errors) in theirs {
            let ours = flip(&synthetic(0), &synthetic(1), SIZE, pixels_per_degree).unwrap();
            let our_mean = ours.mean.unwrap();
            assert!((our_mean - mean).abs() < 1e-3, "{our_mean} instead of {mean}");
            for ((x, y), error) in places.into_iter().zip(errors) {
                let ours = ours.error[y * 48 + x];
                assert!((ours - error).abs() < 1e-3f32, "({x}, {y}): {ours} instead of {error}");
            }
        }
    }

    #[test]
    fn is_symmetric_and_zero_for_the_same() {
        let (x, y) = (synthetic(0), synthetic(1));
        let there = flip(&x, &y, SIZE, PIXELS_PER_DEGREE).unwrap();
        let back = flip(&y, &x, SIZE, PIXELS_PER_DEGREE).unwrap();
        assert!(there.error.iter().zip(&back.error).all(|(a, b)| (a - b).abs() < 1e-6));
        assert!(there.error.iter().all(|e| (0.0..=1.0).contains(e)));
        assert_eq!(flip(&x, &x, SIZE, PIXELS_PER_DEGREE).unwrap().mean, Some(0.0));
    }

    #[test]
    fn what_is_not_finite_is_left_out_and_does_not_spread() {
        let (x, y) = (synthetic(0), synthetic(1));
        let all = flip(&x, &y, SIZE, PIXELS_PER_DEGREE).unwrap();
        let (at, beside) = (20 * 48 + 30, 20 * 48 + 31);
        for broken in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
            let mut wild = x.clone();
            wild[at][1] = broken;
            let same = flip(&wild, &x, SIZE, PIXELS_PER_DEGREE).unwrap();
            assert!(same.error[at].is_nan() && same.mean == Some(0.0), "{broken}: {:?}", same.mean);
            let there = flip(&wild, &y, SIZE, PIXELS_PER_DEGREE).unwrap();
            assert_eq!(there.error.iter().filter(|e| e.is_nan()).count(), 1);
            assert!(
                there.error[at].is_nan() && there.error[0] == all.error[0] && there.error[beside] != all.error[beside]
            );
            let kept: Vec<f64> = there.error.iter().filter(|e| !e.is_nan()).map(|e| f64::from(*e)).collect();
            let mean = kept.iter().sum::<f64>() / kept.len() as f64;
            assert!((there.mean.unwrap() - mean).abs() < 1e-12);
        }
        let none = flip(&[[f32::NAN; 3]; 6], &[[0.5; 3]; 6], [3, 2], PIXELS_PER_DEGREE).unwrap();
        assert!(none.mean.is_none() && none.error.iter().all(|e| e.is_nan()));
    }

    #[test]
    fn odd_values_and_sizes() {
        let wild = [[-1e30, f32::MAX, -4.0], [0.0; 3], [f32::MAX; 3], [1.0; 3]];
        let tame = [[0.0, 1.0, 0.0], [0.0; 3], [1.0; 3], [1.0; 3]];
        for size in [[4, 1], [1, 4], [2, 2]] {
            assert_eq!(flip(&wild, &tame, size, 1.0).unwrap().error, [0.0; 4]);
        }
        assert!(flip(&wild, &tame, [3, 1], 67.0).unwrap_err().contains("4 and 4 pixels are not 3x1"));
        assert!(flip(&wild, &tame, [2, 2], 0.0).unwrap_err().contains("not in 1 to 1000"));
        assert_eq!(flip(&[], &[], [0, 7], 67.0).unwrap(), Flip::default());
    }
}
