//! From the unit square to where samples are wanted, each warp beside its density.

use std::f32::consts::{FRAC_1_PI, PI, TAU};

use glam::{Vec2, Vec3};

/// Uniform on the unit disc (Shirley & Chiu 1997, concentric).
#[inline]
pub fn disc(u: [f32; 2]) -> Vec2 {
    let p = Vec2::new(2.0 * u[0] - 1.0, 2.0 * u[1] - 1.0);
    if p == Vec2::ZERO {
        return p;
    }
    let (r, phi) =
        if p.x.abs() > p.y.abs() { (p.x, PI / 4.0 * (p.y / p.x)) } else { (p.y, PI / 2.0 - PI / 4.0 * (p.x / p.y)) };
    Vec2::new(r * phi.cos(), r * phi.sin())
}

/// Cosine-weighted on the hemisphere around +z; density [`cosine_pdf`].
#[inline]
pub fn cosine(u: [f32; 2]) -> Vec3 {
    let p = disc(u);
    Vec3::new(p.x, p.y, (1.0 - p.length_squared()).max(0.0).sqrt())
}

/// Per steradian, of the direction with this cosine.
#[inline]
pub fn cosine_pdf(cos: f32) -> f32 {
    cos.max(0.0) * FRAC_1_PI
}

/// Uniform on the unit sphere; density 1/(4π) per steradian.
#[inline]
pub fn sphere(u: [f32; 2]) -> Vec3 {
    let z = 1.0 - 2.0 * u[0];
    let r = (1.0 - z * z).max(0.0).sqrt();
    let phi = TAU * u[1];
    Vec3::new(r * phi.cos(), r * phi.sin(), z)
}

/// Uniform in the cone around +z with this cosine of the half-angle; density [`cone_pdf`].
#[inline]
pub fn cone(u: [f32; 2], cos_max: f32) -> Vec3 {
    let z = 1.0 - u[0] * (1.0 - cos_max);
    let r = (1.0 - z * z).max(0.0).sqrt();
    let phi = TAU * u[1];
    Vec3::new(r * phi.cos(), r * phi.sin(), z)
}

/// Per steradian, inside the cone.
#[inline]
pub fn cone_pdf(cos_max: f32) -> f32 {
    1.0 / (TAU * (1.0 - cos_max))
}

/// Barycentric weights of the second and third corner, uniform over a triangle; density 1/area.
#[inline]
pub fn triangle(u: [f32; 2]) -> Vec2 {
    let s = u[0].sqrt();
    Vec2::new(s * (1.0 - u[1]), s * u[1])
}
