//! Random numbers by counting: a hash of (path, dimension, iteration, seed), the same integers on CPU and GPU.

/// Jarzynski & Olano 2020, "Hash Functions for GPU Rendering": pcg4d.
#[inline]
pub fn pcg4d(v: [u32; 4]) -> [u32; 4] {
    let [mut x, mut y, mut z, mut w] = v.map(|c| c.wrapping_mul(1664525).wrapping_add(1013904223));
    x = x.wrapping_add(y.wrapping_mul(w));
    y = y.wrapping_add(z.wrapping_mul(x));
    z = z.wrapping_add(x.wrapping_mul(y));
    w = w.wrapping_add(y.wrapping_mul(z));
    x ^= x >> 16;
    y ^= y >> 16;
    z ^= z >> 16;
    w ^= w >> 16;
    x = x.wrapping_add(y.wrapping_mul(w));
    y = y.wrapping_add(z.wrapping_mul(x));
    z = z.wrapping_add(x.wrapping_mul(y));
    w = w.wrapping_add(y.wrapping_mul(z));
    [x, y, z, w]
}

/// The upper 24 bits as a number in [0, 1).
#[inline]
pub fn unit(bits: u32) -> f32 {
    (bits >> 8) as f32 * (1.0 / 16_777_216.0)
}

/// [`unit()`] of each.
#[inline]
pub fn unit4(bits: [u32; 4]) -> [f32; 4] {
    bits.map(unit)
}

/// Which kind of path draws: keeps their numbers apart.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stream {
    /// From the lens.
    Eye = 0,
    /// From the lamps.
    Photon = 1,
}

/// The random numbers of one path.
#[derive(Clone, Copy, Debug)]
pub struct Rng {
    /// Pixel of the whole picture, or photon path.
    pub path: u32,
    /// How many fours have been drawn, from `stream << 24`.
    pub dimension: u32,
    /// Iteration.
    pub iteration: u32,
    /// Seed.
    pub seed: u32,
}

impl Rng {
    /// At the path's first dimension.
    #[inline]
    pub fn new(stream: Stream, path: u32, iteration: u32, seed: u32) -> Self {
        Self { path, dimension: (stream as u32) << 24, iteration, seed }
    }

    /// Four more numbers in [0, 1).
    #[inline]
    pub fn next4(&mut self) -> [f32; 4] {
        let bits = pcg4d([self.path, self.dimension, self.iteration, self.seed]);
        self.dimension += 1;
        unit4(bits)
    }

    /// Decides where half-transparent surfaces are there for the next ray; draws nothing.
    #[inline]
    pub fn alpha_seed(&self) -> u32 {
        self.path.wrapping_mul(0x9e37_79b1) ^ self.iteration.wrapping_mul(0x85eb_ca6b) ^ self.dimension ^ self.seed
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn neighbouring_paths_dimensions_and_seeds_are_uniform_and_uncorrelated() {
        let n = 200_000u32;
        let draw = |vary: usize, i: u32| {
            let mut v = [3, 5, 7, 11];
            v[vary] = i;
            unit4(pcg4d(v))
        };
        for vary in 0..4 {
            let mut bins = [0u32; 64];
            let (mut lag, mut cross) = (0.0, 0.0);
            for i in 0..n {
                let (a, b) = (draw(vary, i), draw(vary, i + 1));
                bins[(a[0] * 64.0) as usize] += 1;
                lag += f64::from((a[0] - 0.5) * (b[0] - 0.5));
                cross += f64::from((a[0] - 0.5) * (a[1] - 0.5));
            }
            let expected = f64::from(n) / 64.0;
            let chi2: f64 = bins.iter().map(|&b| (f64::from(b) - expected).powi(2) / expected).sum();
            assert!(chi2 < 120.0, "χ² {chi2} over 63 degrees of freedom, component {vary}");
            let sigma = f64::from(n).sqrt() / 12.0;
            assert!(lag.abs() < 5.0 * sigma && cross.abs() < 5.0 * sigma, "{lag} {cross} {sigma}");
        }
    }
}
