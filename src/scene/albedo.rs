//! Directional albedo of the GGX reflection lobe, tabulated: what single scattering keeps. The BSDF divides by it, so
//! that rough metals lose nothing (Turquin 2019) and coated diffusers reflect what the coat lets through.

use std::sync::OnceLock;

use glam::Vec3;

use crate::math::{ggx, rng};

/// Steps over the cosine, 0 to 1.
pub const COSINES: usize = 64;
/// Steps over the perceptual roughness, 0 to 1.
pub const ROUGHNESSES: usize = 32;
const SAMPLES: u32 = 512;

/// `[ROUGHNESSES][COSINES]` of (a, b): the lobe with reflectance `f0` at normal incidence and `f90` at grazing reflects
/// f0·a + f90·b of the light from a direction with that cosine, Schlick's Fresnel term included.
pub fn table() -> &'static [[f32; 2]] {
    static TABLE: OnceLock<Vec<[f32; 2]>> = OnceLock::new();
    TABLE.get_or_init(|| {
        (0..ROUGHNESSES * COSINES)
            .map(|i| {
                let cosine = (i % COSINES) as f32 / (COSINES - 1) as f32;
                let roughness = (i / COSINES) as f32 / (ROUGHNESSES - 1) as f32;
                integrate(cosine.max(1e-3), (roughness * roughness).max(ggx::MIN_ALPHA))
            })
            .collect()
    })
}

/// Visible normals are sampled, so each sample weighs G2/G1 (Heitz 2018, equation 19).
fn integrate(cosine: f32, alpha: f32) -> [f32; 2] {
    let outgoing = Vec3::new((1.0 - cosine * cosine).max(0.0).sqrt(), 0.0, cosine);
    let (mut a, mut b) = (0.0, 0.0);
    for i in 0..SAMPLES {
        // Hammersley points.
        let u = [(i as f32 + 0.5) / SAMPLES as f32, rng::unit(i.reverse_bits())];
        let half = ggx::sample_visible_normal(outgoing, alpha, u);
        let incoming = 2.0 * outgoing.dot(half) * half - outgoing;
        if incoming.z <= 0.0 {
            continue;
        }
        let weight = f64::from(ggx::g2_over_g1(cosine, incoming.z, alpha));
        let grazing = f64::from((1.0 - outgoing.dot(half)).max(0.0).powi(5));
        a += weight * (1.0 - grazing);
        b += weight * grazing;
    }
    [(a / f64::from(SAMPLES)) as f32, (b / f64::from(SAMPLES)) as f32]
}

/// Bilinear look-up in [`table`].
#[inline]
pub fn look_up(table: &[[f32; 2]], cosine: f32, roughness: f32) -> [f32; 2] {
    let x = cosine.clamp(0.0, 1.0) * (COSINES - 1) as f32;
    let y = roughness.clamp(0.0, 1.0) * (ROUGHNESSES - 1) as f32;
    let (i, j) = ((x as usize).min(COSINES - 2), (y as usize).min(ROUGHNESSES - 2));
    let (fx, fy) = (x - i as f32, y - j as f32);
    let at = |i: usize, j: usize| table[j * COSINES + i];
    let mut out = [0.0; 2];
    for (c, v) in out.iter_mut().enumerate() {
        let low = at(i, j)[c] * (1.0 - fx) + at(i + 1, j)[c] * fx;
        let high = at(i, j + 1)[c] * (1.0 - fx) + at(i + 1, j + 1)[c] * fx;
        *v = low * (1.0 - fy) + high * fy;
    }
    out
}
