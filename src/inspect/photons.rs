//! Photons as points over the picture.

use glam::Vec3;
use rayon::prelude::*;

use super::{FirstHits, View};
use crate::layout::Photon;
use crate::ppm::film::luminance;

/// What colours a photon.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ColorBy {
    /// [`power_color`], on a logarithmic scale over [`power_range`].
    #[default]
    Power,
    /// [`bounce_color`].
    Bounce,
}

/// How photons are drawn.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Style {
    /// What colours them.
    pub color: ColorBy,
    /// Diameter of a point, pixels; it always covers the pixel that it is in.
    pub point_size: f32,
    /// Also what lies behind the first surface: behind glass, or on the far side of a wall.
    pub through: bool,
}

impl Default for Style {
    fn default() -> Self {
        Self { color: ColorBy::default(), point_size: 2.0, through: false }
    }
}

/// A photon on the film.
struct Point {
    pixel: [u32; 2],
    at: [f32; 2],
    depth: f32,
    color: [u8; 3],
}

/// The photons over the film of `hits`: sRGB and straight alpha (0 or 255), `[h·w]`, row-major. The nearest is in front;
/// those behind what the pixel sees first are left out unless [`Style::through`].
pub fn draw(photons: &[Photon], hits: &FirstHits, style: &Style) -> Vec<[u8; 4]> {
    let view = hits.view();
    let range = match style.color {
        ColorBy::Power => power_range(photons),
        ColorBy::Bounce => [1.0, 1.0],
    };
    let points: Vec<Point> = photons
        .par_iter()
        .with_min_len(4096)
        .filter_map(|photon| {
            let position = Vec3::from(photon.position);
            let (at, depth) = view.project(position)?;
            let pixel = view.pixel(at)?;
            if !style.through && !is_seen(hits, pixel, position, depth) {
                return None;
            }
            let color = match style.color {
                ColorBy::Power => power_color(place(luminance(photon.power), range)),
                ColorBy::Bounce => bounce_color(photon.segments()),
            };
            Some(Point { pixel, at: at.to_array(), depth, color })
        })
        .collect();
    splat(view, &points, style.point_size * 0.5)
}

/// Whether a point that falls on `pixel` lies before what is seen there first, or on it.
fn is_seen(hits: &FirstHits, [x, y]: [u32; 2], point: Vec3, depth: f32) -> bool {
    let Some(hit) = hits.hit(x, y) else { return true };
    // On a slope depth changes within the pixel; the distance from the tangent plane does not.
    let off = (point - hit.position).dot(hit.normal).abs();
    depth <= hit.depth * (1.0 + 1e-4) || off <= hits.view().pixel_height(depth)
}

fn splat(view: &View, points: &[Point], radius: f32) -> Vec<[u8; 4]> {
    let [width, height] = view.film_size();
    let n = width as usize * height as usize;
    let mut picture = vec![[0; 4]; n];
    let mut depths = vec![f32::INFINITY; n];
    let reach = radius.max(0.0).ceil() as u32;
    for &Point { pixel: [x, y], at, depth, color: [r, g, b] } in points {
        for py in y.saturating_sub(reach)..=(y + reach).min(height - 1) {
            for px in x.saturating_sub(reach)..=(x + reach).min(width - 1) {
                let (dx, dy) = (px as f32 + 0.5 - at[0], py as f32 + 0.5 - at[1]);
                let i = py as usize * width as usize + px as usize;
                let covered = [px, py] == [x, y] || dx * dx + dy * dy <= radius * radius;
                if covered && depth < depths[i] {
                    depths[i] = depth;
                    picture[i] = [r, g, b, 255];
                }
            }
        }
    }
    picture
}

/// Photons looked at for [`power_range`].
const SAMPLED: usize = 10_000;

/// Luminance of the powers of all but the weakest and the strongest hundredth of some of the photons, W before the
/// division by the number of paths. Dark photons do not count; without others it is [1, 1].
pub fn power_range(photons: &[Photon]) -> [f32; 2] {
    let some = photons.iter().step_by(photons.len().div_ceil(SAMPLED).max(1));
    let mut powers: Vec<f32> = some.map(|p| luminance(p.power)).filter(|&power| power > 0.0).collect();
    powers.sort_unstable_by(f32::total_cmp);
    let Some(last) = powers.len().checked_sub(1) else { return [1.0; 2] };
    [powers[last / 100], powers[last - last / 100]]
}

/// On a logarithmic scale from the first to the second, in [0, 1].
fn place(power: f32, [least, most]: [f32; 2]) -> f32 {
    if power <= least {
        return if least < most { 0.0 } else { 1.0 };
    }
    if least < most { ((power / least).ln() / (most / least).ln()).min(1.0) } else { 1.0 }
}

/// From dark violet (`t` = 0) through red and orange to bright yellow (1), ever brighter; sRGB.
pub fn power_color(t: f32) -> [u8; 3] {
    const COLORS: [[f32; 3]; 4] =
        [[50.0, 15.0, 95.0], [165.0, 35.0, 95.0], [240.0, 115.0, 35.0], [255.0, 240.0, 150.0]];
    let at = t.clamp(0.0, 1.0) * (COLORS.len() - 1) as f32;
    let k = (at as usize).min(COLORS.len() - 2);
    Vec3::from(COLORS[k]).lerp(COLORS[k + 1].into(), at - k as f32).to_array().map(|c| c.round() as u8)
}

/// A colour of its own for paths of 1 to 7 segments, one for all longer ones; sRGB. They can be told apart by the colour
/// blind (Okabe & Ito 2008, "Color Universal Design"), the black of the set made grey.
pub fn bounce_color(segments: u32) -> [u8; 3] {
    const COLORS: [[u8; 3]; 8] = [
        [240, 228, 66],
        [86, 180, 233],
        [213, 94, 0],
        [0, 158, 115],
        [204, 121, 167],
        [230, 159, 0],
        [0, 114, 178],
        [153, 153, 153],
    ];
    COLORS[(segments.max(1) as usize - 1).min(COLORS.len() - 1)]
}
