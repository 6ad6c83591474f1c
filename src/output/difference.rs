//! Where two pictures differ: [`super::compare`]'s figures, pixel by pixel.

use rayon::prelude::*;

use super::Picture;
use super::compare::same_window;

/// What of a picture x and a reference y is shown. Each is a mean over the pixel's three channels.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Measure {
    /// |x − y|.
    #[default]
    Absolute,
    /// (x − y)².
    Squared,
    /// |x − y| / (|y| + 0.01).
    Relative,
    /// (x − y)² / (y² + 0.01): the mean over the picture is the relMSE.
    RelativeSquared,
    /// x − y.
    Signed,
}

impl Measure {
    /// All, in the order they are best listed in.
    pub const ALL: [Self; 5] = [Self::Absolute, Self::Squared, Self::Relative, Self::RelativeSquared, Self::Signed];

    /// Of one channel.
    pub fn of(self, x: f64, y: f64) -> f64 {
        let d = x - y;
        match self {
            Self::Absolute => d.abs(),
            Self::Squared => d * d,
            Self::Relative => d.abs() / (y.abs() + 0.01),
            Self::RelativeSquared => d * d / (y * y + 0.01),
            Self::Signed => d,
        }
    }
}

/// A difference, pixel by pixel.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Image {
    /// `[h·w]` over the crop, row-major; NaN where either picture has a value that is not finite.
    pub values: Vec<f32>,
    /// Over the pixels that are finite, if there are any.
    pub mean: Option<f64>,
}

/// The difference of two pictures of the same size and crop; otherwise says what differs.
pub fn image(picture: &Picture, reference: &Picture, measure: Measure) -> Result<Image, String> {
    same_window(picture, reference)?;
    let pixel = |(x, y): (&[f32; 3], &[f32; 3])| {
        if !x.iter().chain(y).all(|c| c.is_finite()) {
            return f32::NAN;
        }
        ((0..3).map(|c| measure.of(f64::from(x[c]), f64::from(y[c]))).sum::<f64>() / 3.0) as f32
    };
    let values: Vec<f32> = picture.rgb.par_iter().zip(&reference.rgb).map(pixel).collect();
    let (mut sum, mut n) = (0.0, 0u64);
    for v in values.iter().filter(|v| !v.is_nan()) {
        sum += f64::from(*v);
        n += 1;
    }
    Ok(Image { values, mean: (n > 0).then(|| sum / n as f64) })
}

#[cfg(test)]
mod tests {
    use super::super::compare::compare;
    use super::*;

    fn picture(rgb: Vec<[f32; 3]>) -> Picture {
        let n = rgb.len() as u32;
        Picture { size: [n, 1], crop: [0, 0, n, 1], rgb, variance: None }
    }

    #[test]
    fn closed_values() {
        let (x, y) = (picture(vec![[3.0, 1.0, 0.0]]), picture(vec![[1.0, 2.0, 0.0]]));
        let mean = |m| image(&x, &y, m).unwrap().mean.unwrap();
        assert!((mean(Measure::Absolute) - 1.0).abs() < 1e-7);
        assert!((mean(Measure::Squared) - 5.0 / 3.0).abs() < 1e-6);
        assert!((mean(Measure::Relative) - (2.0 / 1.01 + 1.0 / 2.01) / 3.0).abs() < 1e-6);
        assert!((mean(Measure::RelativeSquared) - (4.0 / 1.01 + 1.0 / 4.01) / 3.0).abs() < 1e-6);
        assert!((mean(Measure::Signed) - 1.0 / 3.0).abs() < 1e-7);
    }

    #[test]
    fn means_are_those_of_compare() {
        let value = |i: u32| (i.wrapping_mul(2_654_435_761) >> 8) as f32 / 16e6;
        let noise = |seed: u32| (0..500).map(|i| [0, 1, 2].map(|c| value(seed + 3 * i + c))).collect::<Vec<_>>();
        let (mut x, y) = (picture(noise(1)), picture(noise(7777)));
        x.rgb[3] = [1.0, f32::NAN, 1.0];
        x.rgb[4] = [f32::INFINITY, 1.0, 1.0];
        let figures = compare(&x, &y).unwrap();
        let relative = image(&x, &y, Measure::RelativeSquared).unwrap();
        let mean = relative.mean.unwrap();
        assert!((mean / figures.rel_mse - 1.0).abs() < 1e-6, "{mean} {}", figures.rel_mse);
        assert!(relative.values[3].is_nan() && relative.values[4].is_nan() && relative.values[5].is_finite());
        let signed = image(&x, &y, Measure::Signed).unwrap();
        assert!((signed.mean.unwrap() - figures.mean_difference).abs() < 1e-7);
    }

    #[test]
    fn other_sizes_are_refused_and_nothing_finite_has_no_mean() {
        let a = picture(vec![[f32::NAN; 3]; 2]);
        assert!(image(&a, &picture(vec![[0.0; 3]; 3]), Measure::Absolute).unwrap_err().contains("windows differ"));
        assert_eq!(image(&a, &a, Measure::Squared).unwrap().mean, None);
    }
}
