//! Unit vectors in one `u32`: the octahedral map (Meyer et al. 2010; Cigolle et al. 2014).

use glam::{Vec2, Vec3};

fn square_from_unit(v: Vec3) -> Vec2 {
    let v = v / (v.x.abs() + v.y.abs() + v.z.abs());
    let p = Vec2::new(v.x, v.y);
    if v.z >= 0.0 { p } else { (Vec2::ONE - Vec2::new(p.y.abs(), p.x.abs())) * Vec2::ONE.copysign(p) }
}

#[inline]
fn vector_from_square(p: Vec2) -> Vec3 {
    let z = 1.0 - p.x.abs() - p.y.abs();
    let t = (-z).max(0.0);
    Vec3::new(p.x - t.copysign(p.x), p.y - t.copysign(p.y), z)
}

#[inline]
fn quantise(v: f32, steps: f32) -> u32 {
    // Not `round`: halves go to even in WGSL and away from zero here.
    ((v * 0.5 + 0.5) * steps + 0.5).clamp(0.0, steps) as u32
}

/// 16 bits a component, x in the low half; within 7e-5 radians.
#[inline]
pub fn encode(v: Vec3) -> u32 {
    let p = square_from_unit(v);
    quantise(p.x, 65535.0) | quantise(p.y, 65535.0) << 16
}

/// The unit vector that [`encode`] was given.
#[inline]
pub fn decode(bits: u32) -> Vec3 {
    decode_unscaled(bits).normalize()
}

/// [`decode`] without the square root: the length is between 1/√3 and 1.
#[inline]
pub fn decode_unscaled(bits: u32) -> Vec3 {
    vector_from_square(Vec2::new((bits & 0xffff) as f32, (bits >> 16) as f32) * (2.0 / 65535.0) - 1.0)
}

/// 12 bits a component in the low 24 bits; within 1.1e-3 radians.
#[inline]
pub fn encode24(v: Vec3) -> u32 {
    let p = square_from_unit(v);
    quantise(p.x, 4095.0) | quantise(p.y, 4095.0) << 12
}

/// The unit vector that [`encode24`] was given; the high 8 bits are ignored.
#[inline]
pub fn decode24(bits: u32) -> Vec3 {
    decode24_unscaled(bits).normalize()
}

/// [`decode24`] without the square root: the length is between 1/√3 and 1.
#[inline]
pub fn decode24_unscaled(bits: u32) -> Vec3 {
    vector_from_square(Vec2::new((bits & 0xfff) as f32, (bits >> 12 & 0xfff) as f32) * (2.0 / 4095.0) - 1.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::{rng, warp};

    #[test]
    fn errors_stay_within_what_is_documented() {
        let axes = [Vec3::X, Vec3::Y, Vec3::Z, Vec3::NEG_X, Vec3::NEG_Y, Vec3::NEG_Z];
        let random = (0..20_000u32).map(|i| {
            let [u, v, ..] = rng::unit4(rng::pcg4d([i, 1, 2, 3]));
            warp::sphere([u, v])
        });
        for v in axes.into_iter().chain(random) {
            assert!((decode(encode(v)) - v).length() < 7e-5, "{v}");
            assert!((decode24(encode24(v)) - v).length() < 1.1e-3, "{v}");
        }
    }
}
