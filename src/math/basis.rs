//! Orthonormal bases.

use glam::Vec3;

/// A right-handed orthonormal basis; z is the surface normal.
#[derive(Clone, Copy, Debug)]
pub struct Basis {
    /// Unit.
    pub x: Vec3,
    /// Unit.
    pub y: Vec3,
    /// Unit.
    pub z: Vec3,
}

impl Basis {
    /// Around a unit vector (Duff et al. 2017, "Building an Orthonormal Basis, Revisited").
    #[inline]
    pub fn around(z: Vec3) -> Self {
        let sign = 1f32.copysign(z.z);
        let a = -1.0 / (sign + z.z);
        let b = z.x * z.y * a;
        Self {
            x: Vec3::new(1.0 + sign * z.x * z.x * a, sign * b, -sign * z.x),
            y: Vec3::new(b, sign + z.y * z.y * a, -z.y),
            z,
        }
    }

    /// Coordinates in the basis of a world vector.
    #[inline]
    pub fn local(&self, w: Vec3) -> Vec3 {
        Vec3::new(self.x.dot(w), self.y.dot(w), self.z.dot(w))
    }

    /// World vector of coordinates in the basis.
    #[inline]
    pub fn world(&self, l: Vec3) -> Vec3 {
        self.x * l.x + self.y * l.y + self.z * l.z
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn is_orthonormal_right_handed_and_inverts() {
        for i in 0..2000u32 {
            let [u, v, w, _] = crate::math::rng::unit4(crate::math::rng::pcg4d([i, 0, 0, 0]));
            let z = (Vec3::new(u, v, w) * 2.0 - 1.0).normalize_or(Vec3::NEG_Z);
            let f = Basis::around(z);
            assert!((f.x.cross(f.y) - f.z).length() < 1e-5, "{f:?}");
            assert!((f.x.length() - 1.0).abs() < 1e-5 && f.x.dot(f.y).abs() < 1e-5);
            let p = Vec3::new(0.3, -2.0, 0.7);
            assert!((f.world(f.local(p)) - p).length() < 1e-5);
        }
    }
}
