//! From scene-linear radiance to what a display shows: exposure, a tone curve, the sRGB encoding.
//!
//! All functions take and give linear RGB with the sRGB primaries (ITU-R BT.709, D65 white).

use crate::ppm::film::luminance;
use crate::scene::settings::MAX_EXPOSURE;
pub use crate::scene::settings::ToneMap;

impl ToneMap {
    /// Exposed radiance to display-linear RGB in [0, 1]. NaN and negative values count as 0.
    pub fn apply(self, rgb: [f32; 3]) -> [f32; 3] {
        let rgb = rgb.map(|c| if c > 0.0 { c.min(1e9) } else { 0.0 });
        let mapped = match self {
            Self::Neutral => neutral(rgb),
            Self::Agx => agx(rgb),
            Self::Srgb => rgb,
        };
        mapped.map(|c| c.clamp(0.0, 1.0))
    }
}

/// "Khronos PBR Neutral Tone Mapper" specification, version 1.
fn neutral(rgb: [f32; 3]) -> [f32; 3] {
    const F90: f32 = 0.04; // Reflection of a dielectric at normal incidence, taken off again.
    const START: f32 = 0.8 - F90;
    const DESATURATION: f32 = 0.15;
    let lowest = rgb[0].min(rgb[1]).min(rgb[2]);
    let offset = if lowest < 2.0 * F90 { lowest - lowest * lowest / (4.0 * F90) } else { F90 };
    let rgb = rgb.map(|c| c - offset);
    let peak = rgb[0].max(rgb[1]).max(rgb[2]);
    if peak < START {
        return rgb;
    }
    let room = 1.0 - START;
    let compressed = 1.0 - room * room / (peak + room - START);
    let keep = 1.0 / (DESATURATION * (peak - compressed) + 1.0);
    rgb.map(|c| compressed + (c * (compressed / peak) - compressed) * keep)
}

/// AgX's base look: primaries drawn in by a fifth towards white, a logarithm over 16.5 stops, a sigmoid per channel.
fn agx(rgb: [f32; 3]) -> [f32; 3] {
    /// Moving the chromaticities of all three primaries the share `INSET` towards the white point is, for linear RGB,
    /// c ↦ (1 − INSET)·c + w·c with these weights; their sum is INSET, so white stays.
    const INSET: f32 = 0.2;
    const WEIGHTS: [f32; 3] = [0.042_398_9, 0.078_430_2, 0.079_170_9];
    const LOWEST: f32 = -10.0; // Stops about mid grey.
    const HIGHEST: f32 = 6.5;
    let weigh = |c: [f32; 3]| c[0] * WEIGHTS[0] + c[1] * WEIGHTS[1] + c[2] * WEIGHTS[2];

    let white = weigh(rgb);
    let curved = rgb.map(|c| {
        let stops = (((1.0 - INSET) * c + white) / 0.18).max(1e-10).log2();
        agx_curve(((stops - LOWEST) / (HIGHEST - LOWEST)).clamp(0.0, 1.0), -LOWEST / (HIGHEST - LOWEST))
    });
    // The way back: `white` of the inset colour is white·(1 − INSET) + white·INSET, itself.
    let white = weigh(curved);
    curved.map(|c| ((c - white) / (1.0 - INSET)).max(0.0).powf(2.2))
}

/// Sigmoid through (0, 0), (`pivot`, ½) with slope 2, and (1, 1): on each side u ↦ s·u/(1 + (s·u/k)^p)^(1/p) about the
/// pivot, with k such that it reaches its end.
fn agx_curve(x: f32, pivot: f32) -> f32 {
    const SLOPE: f32 = 2.0;
    const MIDDLE: f32 = 0.5;
    let side = |sign: f32, power: f32, run: f32| {
        let reach = SLOPE * run; // What a straight line would reach.
        let k = reach / ((reach / MIDDLE).powf(power) - 1.0).powf(1.0 / power);
        let u = SLOPE * (x - pivot).abs();
        MIDDLE + sign * u / (1.0 + (u / k).powf(power)).powf(1.0 / power)
    };
    if x < pivot { side(-1.0, 3.0, pivot) } else { side(1.0, 3.25, 1.0 - pivot) }
}

/// IEC 61966-2-1: display-linear to encoded, both in [0, 1].
pub fn srgb_encode(linear: f32) -> f32 {
    if linear <= 0.003_130_8 { 12.92 * linear } else { 1.055 * linear.powf(1.0 / 2.4) - 0.055 }
}

/// Automatic exposure, stops: brings the picture's log-average luminance to the key 0.18·4^f, with f in [−1, 1] by where
/// the average lies between the darkest and the brightest: mid grey half-way, darker where most is dark, brighter where most
/// is bright (Reinhard 2002, "Parameter estimation for photographic tone reproduction"). So a dim background does not burn
/// out what stands before it. Where brightest and darkest lie within two stops, f is less, in proportion: that of a flat
/// picture would be its noise's.
///
/// It is measured in the logarithms of lit pixels, those brighter than 2⁻¹⁶ of the 90th percentile of what is above 0; of a
/// large picture, of one in each stretch of pixels of a length that gives 2¹⁸ at most, at another place in every stretch, so
/// that all columns are looked at. Of these the darkest and the brightest 2 % are left out, and the next 8 % on average are
/// the darkest and the brightest: neither a black background nor a few fireflies move it, and a lamp that comes into view
/// does little by little. A black picture gets 0.
pub fn automatic_exposure(rgb: &[[f32; 3]]) -> f32 {
    const MOST: usize = 1 << 18;
    /// 2³² over the golden ratio: the fractions of its multiples are spread evenly (Weyl).
    const GOLDEN: u32 = 0x9E37_79B9;
    let stretches = (0u32..).zip(rgb.chunks(rgb.len().div_ceil(MOST).max(1)));
    let some = stretches.map(|(i, of)| of[((u64::from(GOLDEN.wrapping_mul(i)) * of.len() as u64) >> 32) as usize]);
    let mut lit: Vec<f32> = some.map(luminance).filter(|y| *y > 0.0 && y.is_finite()).collect();
    if lit.is_empty() {
        return 0.0;
    }
    lit.sort_unstable_by(f32::total_cmp);
    let dimmest = lit[(lit.len() - 1) * 90 / 100] / 65536.0;
    let lit = &lit[lit.partition_point(|&y| y <= dimmest)..];
    let mean = |from: usize, to: usize| {
        let first = (lit.len() * from / 100).min(lit.len() - 1);
        let part = &lit[first..(lit.len() * to / 100).max(first + 1)];
        part.iter().map(|&y| f64::from(y).log2()).sum::<f64>() / part.len() as f64
    };
    let [low, middle, high] = [mean(2, 10), mean(2, 98), mean(90, 98)];
    let f = (2.0 * middle - low - high) / (high - low).max(2.0);
    ((0.18f64.log2() + 2.0 * f - middle) as f32).clamp(-MAX_EXPOSURE, MAX_EXPOSURE)
}

#[cfg(test)]
mod tests {
    use super::*;

    const ALL: [ToneMap; 3] = [ToneMap::Neutral, ToneMap::Agx, ToneMap::Srgb];

    #[test]
    fn black_stays_black_and_nothing_leaves_the_display() {
        for map in ALL {
            assert!(map.apply([0.0; 3]).iter().all(|&c| c < 2e-4), "{map:?} {:?}", map.apply([0.0; 3]));
            for c in [f32::NAN, f32::NEG_INFINITY, -1.0, f32::INFINITY, f32::MAX, 1e-40] {
                for rgb in [[c; 3], [c, 0.0, 1.0], [0.5, c, 2.0]] {
                    assert!(map.apply(rgb).iter().all(|v| (0.0..=1.0).contains(v)), "{map:?} {rgb:?}");
                }
            }
        }
    }

    #[test]
    fn closed_values() {
        // Neutral: grey above 0.08 loses 0.04; at 0.04 the parabola loses 0.04 − 0.01.
        assert!((ToneMap::Neutral.apply([0.18; 3])[0] - 0.14).abs() < 1e-6);
        assert!((ToneMap::Neutral.apply([0.04; 3])[0] - 0.01).abs() < 1e-6);
        // Peak 1.24 after the offset: 1 − 0.24²/(1.24 + 0.24 − 0.76) = 0.92, and grey stays grey.
        assert!(ToneMap::Neutral.apply([1.28; 3]).iter().all(|c| (c - 0.92).abs() < 1e-6));
        // AgX: mid grey is half the encoded range, the lowest and highest stops its ends.
        assert!((ToneMap::Agx.apply([0.18; 3])[1] - 0.5f32.powf(2.2)).abs() < 1e-5);
        assert!((ToneMap::Agx.apply([0.18 * 6.5f32.exp2(); 3])[1] - 1.0).abs() < 1e-5);
        assert_eq!(ToneMap::Srgb.apply([0.25, 1.0, 3.0]), [0.25, 1.0, 1.0]);
    }

    #[test]
    fn greys_stay_grey_and_in_order() {
        for map in ALL {
            let mut last = -1.0;
            for i in -120..80 {
                let [r, g, b] = map.apply([(i as f32 / 8.0).exp2(); 3]);
                assert!((r - g).abs() < 1e-5 && (g - b).abs() < 1e-5, "{map:?} {r} {g} {b}");
                assert!(g >= last, "{map:?} at 2^{i}/8");
                last = g;
            }
        }
    }

    #[test]
    fn channels_keep_their_order() {
        for map in ALL {
            for scale in [0.01, 0.1, 1.0, 10.0] {
                let [r, g, b] = map.apply([0.9 * scale, 0.4 * scale, 0.1 * scale]);
                assert!(r >= g && g >= b, "{map:?} {scale}: {r} {g} {b}");
            }
        }
    }

    #[test]
    fn srgb_is_the_standards() {
        assert_eq!(srgb_encode(0.0), 0.0);
        assert!((srgb_encode(1.0) - 1.0).abs() < 1e-6);
        assert!((srgb_encode(0.214_041_14) - 0.5).abs() < 1e-6);
        assert!((srgb_encode(0.003_130_9) - srgb_encode(0.003_130_7)).abs() < 1e-5);
    }

    /// Stripes as far apart as the pixels that are looked at, or nearly, are seen as they are.
    #[test]
    fn exposure_of_a_large_picture_goes_by_all_its_columns() {
        for (width, period) in [(1024, 4), (1024, 2), (1028, 257), (1000, 4)] {
            let stripes = |x: usize| if x.is_multiple_of(period) { 64.0 } else { 0.25 };
            let picture = |height: usize| -> Vec<_> { (0..width * height).map(|i| [stripes(i % width); 3]).collect() };
            let [large, small] = [1024, 64].map(|height| automatic_exposure(&picture(height)));
            assert!((large - small).abs() < 0.02, "{width} {period}: {large} {small}");
        }
    }

    #[test]
    fn exposure_ignores_background_and_fireflies() {
        let grey = vec![[0.36; 3]; 1000];
        assert!((automatic_exposure(&grey) + 1.0).abs() < 1e-5);
        let mut noisy = grey.clone();
        noisy.extend([[0.0; 3]; 5000]);
        noisy.extend([[1e-6; 3]; 1000]);
        noisy.extend([[1e6; 3], [f32::INFINITY; 3], [f32::NAN; 3]]);
        assert!((automatic_exposure(&noisy) + 1.0).abs() < 1e-2, "{}", automatic_exposure(&noisy));
        // A dim background three stops below the subject: of 960 pixels that count, 880 are dim, and f = −5/6.
        let mut subject = vec![[0.125; 3]; 900];
        subject.extend([[1.0; 3]; 100]);
        let expected = 0.18f32.log2() - 2.0 * 5.0 / 6.0 + 3.0 * 880.0 / 960.0;
        assert!((automatic_exposure(&subject) - expected).abs() < 1e-5);
        // A lamp comes into a view that spans so many stops, so many above it.
        for (span, lamp) in [(2.0, 8.0), (0.15, 8.0), (2.0, 14.0), (0.01, 14.0)] {
            let mut last = None;
            for n in 0..90 {
                let mut room: Vec<_> = (0..1000 - n).map(|i| [(span * i as f32 / 1e3).exp2(); 3]).collect();
                room.extend(vec![[f32::exp2(span + lamp); 3]; n]);
                let exposure = automatic_exposure(&room);
                let step = (exposure - last.unwrap_or(exposure)).abs();
                assert!(step < 0.3, "{span} {lamp} {n}: {last:?} {exposure}");
                last = Some(exposure);
            }
        }
        // The noise of a flat picture is not looked at.
        let flat: Vec<_> = (0..1000).map(|i| [if i % 10 == 0 { 0.1801 } else { 0.18 }; 3]).collect();
        assert!(automatic_exposure(&flat).abs() < 0.01, "{}", automatic_exposure(&flat));
        assert_eq!(automatic_exposure(&[]), 0.0);
        assert_eq!(automatic_exposure(&[[0.0; 3]; 4]), 0.0);
    }
}
