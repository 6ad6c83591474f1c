//! Where two pictures differ: [`super::compare`]'s figures, pixel by pixel.

use rayon::prelude::*;

use super::Picture;
use super::compare::same_window;
use super::false_colour::round_up;

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

    /// As far as pictures of one scene differ: by ten times `white`, radiance, or ten times the reference. More is a fault.
    fn most(self, white: f32) -> f32 {
        let most = match self {
            Self::Absolute | Self::Signed => 10.0 * white,
            Self::Squared => (10.0 * white).powi(2),
            Self::Relative => 10.0,
            Self::RelativeSquared => 100.0,
        };
        most.min(f32::MAX)
    }
}

/// A difference, pixel by pixel.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Image {
    /// `[h·w]` over the crop, row-major; NaN where either picture has a value that is not finite, and only there.
    pub values: Vec<f32>,
    /// Over the pixels that are finite, if there are any.
    pub mean: Option<f64>,
}

impl Image {
    /// Where colours from 0 up (for [`Measure::Signed`]: either way) best end: at the 99th percentile of |v|, or if that is 0
    /// the largest, rounded up to 1, 2 or 5 times a power of ten, so that it seldom changes while a picture converges. Above
    /// 0, finite.
    ///
    /// Left out, however many, are pixels that differ by more than ten times `white`, the radiance that is shown white
    /// (2^−exposure); of relative measures, ten times the reference.
    pub fn automatic_end(&self, measure: Measure, white: f32) -> f32 {
        let most = measure.most(white);
        let mut kept: Vec<f32> = self.values.iter().map(|v| v.abs()).filter(|v| *v <= most).collect();
        let Some(last) = kept.len().checked_sub(1) else { return round_up(most) };
        let (_, &mut high, above) = kept.select_nth_unstable_by(last - last / 100, f32::total_cmp);
        let high = if high > 0.0 { high } else { above.iter().copied().fold(0.0, f32::max) };
        round_up(if high > 0.0 { high } else { most })
    }
}

/// The difference of two pictures of the same size and crop; otherwise says what differs.
pub fn image(picture: &Picture, reference: &Picture, measure: Measure) -> Result<Image, String> {
    same_window(picture, reference)?;
    let pixel = |(x, y): (&[f32; 3], &[f32; 3])| {
        if !x.iter().chain(y).all(|c| c.is_finite()) {
            return f32::NAN;
        }
        let mean = (0..3).map(|c| measure.of(f64::from(x[c]), f64::from(y[c]))).sum::<f64>() / 3.0;
        // The square of a finite number may not be one.
        mean.clamp(f32::MIN.into(), f32::MAX.into()) as f32
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

    /// Whatever share of the picture is out of all bounds, the rest is seen.
    #[test]
    fn what_is_out_of_all_bounds_does_not_set_the_range() {
        let end = |x: Vec<[f32; 3]>, y: Vec<[f32; 3]>, measure| {
            image(&picture(x), &picture(y), measure).unwrap().automatic_end(measure, 2.0)
        };
        let reference = vec![[1.0; 3]; 1000];
        let noisy = |i: usize| [1.0 + if i.is_multiple_of(2) { 0.04 } else { -0.04 }; 3];
        for (measure, expected) in [
            (Measure::Absolute, 0.05),
            (Measure::Signed, 0.05),
            (Measure::Squared, 0.002),
            (Measure::Relative, 0.05),
            (Measure::RelativeSquared, 0.002),
        ] {
            let noise: Vec<_> = (0..1000).map(noisy).collect();
            assert_eq!(end(noise.clone(), reference.clone(), measure), expected, "{measure:?}");
            for odd in [1e30, f32::MAX, f32::INFINITY, f32::NAN] {
                for n in [1, 300, 990] {
                    let mut broken = noise.clone();
                    broken[..n].fill([odd; 3]);
                    assert_eq!(end(broken, reference.clone(), measure), expected, "{measure:?} {n} of {odd}");
                }
            }
            // A single pixel is found, and nothing is no range.
            let mut spot = reference.clone();
            spot[77] = noisy(0);
            assert_eq!(end(spot, reference.clone(), measure), expected, "{measure:?}");
            for all in [1.0, f32::NAN, f32::MAX] {
                let end = end(vec![[all; 3]; 1000], reference.clone(), measure);
                assert!(end > 0.0 && end.is_finite(), "{measure:?} {all} {end}");
            }
        }
        // In the reference, too.
        let mut broken = reference.clone();
        broken[..300].fill([1e30; 3]);
        assert_eq!(end((0..1000).map(noisy).collect(), broken, Measure::Absolute), 0.05);
    }

    /// Only what is not finite is marked as such.
    #[test]
    fn finite_pixels_have_finite_differences() {
        let (x, y) = (picture(vec![[1e30; 3], [f32::MAX; 3]]), picture(vec![[0.0; 3], [f32::MIN; 3]]));
        for measure in Measure::ALL {
            let of = image(&x, &y, measure).unwrap();
            assert!(of.values.iter().all(|v| v.is_finite()) && of.mean.is_some_and(f64::is_finite), "{measure:?}");
        }
        assert_eq!(image(&y, &x, Measure::Signed).unwrap().values[1], f32::MIN);
    }

    #[test]
    fn other_sizes_are_refused_and_nothing_finite_has_no_mean() {
        let a = picture(vec![[f32::NAN; 3]; 2]);
        assert!(image(&a, &picture(vec![[0.0; 3]; 3]), Measure::Absolute).unwrap_err().contains("windows differ"));
        assert_eq!(image(&a, &a, Measure::Squared).unwrap().mean, None);
    }
}
