//! The isotropic GGX distribution of microfacet normals, in a basis whose z is the surface normal.

use std::f32::consts::{PI, TAU};

use glam::Vec3;

/// Narrower lobes are treated as mirrors: beyond this, `f32` cannot resolve them.
pub const MIN_ALPHA: f32 = 1e-3;

/// Density of normals per steradian (Walter et al. 2007, equation 33).
#[inline]
pub fn distribution(cos: f32, alpha: f32) -> f32 {
    let a2 = alpha * alpha;
    // (1 − cos²) + a²cos², written so that it does not cancel near the pole.
    let d = (1.0 - cos) * (1.0 + cos) + a2 * cos * cos;
    a2 / (PI * d * d)
}

/// √(α² + (1 − α²)cos²): cos·√(1 + α²tan²).
#[inline]
fn slope(cos: f32, alpha: f32) -> f32 {
    (alpha * alpha + (1.0 - alpha * alpha) * cos * cos).sqrt()
}

/// Masking alone (Smith).
#[inline]
pub fn g1(cos: f32, alpha: f32) -> f32 {
    2.0 * cos / (cos + slope(cos, alpha))
}

/// G2/(4·cos_o·cos_i), height-correlated (Heitz 2014).
#[inline]
pub fn visibility(cos_o: f32, cos_i: f32, alpha: f32) -> f32 {
    0.5 / (cos_o * slope(cos_i, alpha) + cos_i * slope(cos_o, alpha))
}

/// What a sample of the visible normals weighs.
#[inline]
pub fn g2_over_g1(cos_o: f32, cos_i: f32, alpha: f32) -> f32 {
    4.0 * cos_o * cos_i * visibility(cos_o, cos_i, alpha) / g1(cos_o, alpha)
}

/// A microfacet normal as seen from `outgoing` (z > 0), with density [`visible_normal_pdf`] (Dupuy & Benyoub 2023,
/// "Sampling Visible GGX Normals with Spherical Caps").
#[inline]
pub fn sample_visible_normal(outgoing: Vec3, alpha: f32, u: [f32; 2]) -> Vec3 {
    let stretched = Vec3::new(alpha * outgoing.x, alpha * outgoing.y, outgoing.z).normalize();
    let z = (1.0 - u[1]) * (1.0 + stretched.z) - stretched.z;
    let r = (1.0 - z * z).max(0.0).sqrt();
    let phi = TAU * u[0];
    let half = Vec3::new(r * phi.cos(), r * phi.sin(), z) + stretched;
    Vec3::new(alpha * half.x, alpha * half.y, half.z.max(0.0)).normalize_or(Vec3::Z)
}

/// Per steradian of microfacet normals: G1·D·(o·h)/cos_o.
#[inline]
pub fn visible_normal_pdf(cos_o: f32, cos_h: f32, o_dot_h: f32, alpha: f32) -> f32 {
    // G1/cos_o without the 0/0 at grazing.
    2.0 / (cos_o + slope(cos_o, alpha)) * distribution(cos_h, alpha) * o_dot_h.max(0.0)
}
