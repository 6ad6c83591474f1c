//! What the iterations add up to.

/// Mean of the iterations' images, and how they scatter.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Film {
    /// Pixels.
    pub width: u32,
    /// Pixels.
    pub height: u32,
    /// Iterations in the mean.
    pub n_iterations: u32,
    /// Mean radiance (linear RGB) and, fourth, the sum of squared deviations of the luminance from its running mean
    /// (Welford 1962), `[h·w]`, row-major.
    pub pixels: Vec<[f32; 4]>,
}

/// Luminance of linear RGB with the sRGB primaries (ITU-R BT.709).
pub fn luminance(rgb: [f32; 3]) -> f32 {
    0.2126 * rgb[0] + 0.7152 * rgb[1] + 0.0722 * rgb[2]
}

/// Adds the `i`-th image's pixel (i from 1) to a film pixel.
#[inline]
pub fn add(pixel: &mut [f32; 4], i: u32, radiance: [f32; 3]) {
    let before = luminance([pixel[0], pixel[1], pixel[2]]);
    let weight = 1.0 / i as f32;
    for c in 0..3 {
        pixel[c] += (radiance[c] - pixel[c]) * weight;
    }
    let now = luminance(radiance);
    let after = luminance([pixel[0], pixel[1], pixel[2]]);
    pixel[3] += (now - before) * (now - after);
}

impl Film {
    /// Mean radiance, `[h·w]`.
    pub fn rgb(&self) -> Vec<[f32; 3]> {
        self.pixels.iter().map(|p| [p[0], p[1], p[2]]).collect()
    }

    /// Estimated variance of each pixel's mean luminance, `[h·w]`; infinite before the second iteration.
    pub fn variance_of_mean(&self) -> Vec<f32> {
        let n = self.n_iterations as f32;
        self.pixels.iter().map(|p| if n < 2.0 { f32::INFINITY } else { p[3].max(0.0) / (n * (n - 1.0)) }).collect()
    }
}
