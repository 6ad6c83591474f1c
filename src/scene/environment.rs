//! The environment map as a light.

use std::f32::consts::{PI, TAU};

use glam::{DVec3, Vec2, Vec3};

use super::Environment;

impl Environment {
    /// Texture coordinates of the direction `d` (unit, world space) in a map that is not rotated:
    /// u = ½ + atan2(z, x)/2π, v = acos(y)/π.
    pub fn uv_of(d: Vec3) -> Vec2 {
        Vec2::new(0.5 + d.z.atan2(d.x) / TAU, d.y.clamp(-1.0, 1.0).acos() / PI)
    }

    /// The inverse of [`Environment::uv_of`].
    pub fn direction_of(uv: Vec2) -> Vec3 {
        let (phi, theta) = ((uv.x - 0.5) * TAU, uv.y * PI);
        Vec3::new(theta.sin() * phi.cos(), theta.cos(), theta.sin() * phi.sin())
    }

    /// The same radiance from everywhere. Several rows, for directions are sampled by row.
    pub fn uniform(radiance: Vec3) -> Self {
        Self { width: 2, height: 32, texels: vec![radiance; 64].into(), rotation: 0.0, strength: 1.0, tint: Vec3::ONE }
    }
}

/// Without strength and tint: radiance with the cumulative probability within its row, cumulative probability of the rows,
/// and mean radiance over the sphere. Radiance is interpolated bilinearly, so a texel's weight is the mean over its
/// neighbours: nothing bright has density zero.
pub(super) fn pack(e: &Environment) -> (Vec<[f32; 4]>, Vec<f32>, Vec3) {
    let (w, h) = (e.width as usize, e.height as usize);
    let luminance = |x: usize, y: usize| f64::from(e.texels[y * w + x].dot(Vec3::new(0.2126, 0.7152, 0.0722)).max(0.0));
    let solid_angle = |y: usize| {
        let cos = |y: usize| (std::f64::consts::PI * y as f64 / h as f64).cos();
        (cos(y) - cos(y + 1)) / (2.0 * w as f64)
    };
    let mut texels = Vec::with_capacity(w * h);
    let mut rows = Vec::with_capacity(h);
    let (mut total, mut mean) = (0.0, DVec3::ZERO);
    for y in 0..h {
        let weight = |x: usize| {
            let mut sum = 0.0;
            for ny in [y.saturating_sub(1), y, (y + 1).min(h - 1)] {
                for nx in [(x + w - 1) % w, x, (x + 1) % w] {
                    sum += luminance(nx, ny);
                }
            }
            sum
        };
        let row: f64 = (0..w).map(weight).sum();
        let mut sum = 0.0;
        for x in 0..w {
            sum += weight(x);
            mean += e.texels[y * w + x].as_dvec3() * solid_angle(y);
            let cumulative = if x == w - 1 {
                1.0
            } else if row > 0.0 {
                sum / row
            } else {
                (x + 1) as f64 / w as f64
            };
            let c = e.texels[y * w + x];
            texels.push([c.x, c.y, c.z, cumulative as f32]);
        }
        total += row * solid_angle(y);
        rows.push(total);
    }
    let mut rows: Vec<f32> = rows.iter().map(|r| if total > 0.0 { (r / total) as f32 } else { 0.0 }).collect();
    if let Some(last) = rows.last_mut() {
        *last = 1.0;
    }
    (texels, rows, mean.as_vec3())
}
