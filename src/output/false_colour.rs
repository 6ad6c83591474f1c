//! Numbers as colours: a scalar per pixel to RGBA8, with the range and the ticks of its legend.
//!
//! The map is Green's cubehelix (D. A. Green, "A colour scheme for the display of astronomical intensity images", Bull.
//! Astron. Soc. India 39, 2011): from black to white with a perceived brightness that rises evenly, so it keeps its
//! order in grey print and for the colour-blind.

use std::f32::consts::TAU;
use std::sync::LazyLock;

use rayon::prelude::*;

use super::tonemap::srgb_encode;
use crate::ppm::film::luminance;

/// What NaN and infinities are shown in; not on the map. RGBA.
pub const NOT_FINITE: [u8; 4] = [255, 0, 255, 255];

/// Linear luminance that counts as mid grey.
pub const MID_GREY: f32 = 0.18;

/// What a logarithmic scale spans whose low end is not positive.
const LOG_SPAN: f32 = 1e4;
/// What one spans at most that is chosen automatically: of what is smaller, rounding errors among it, nothing can be seen.
const MOST_LOG_SPAN: f32 = 1e6;

/// Which value gets which place on the map.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Scale {
    /// Values at the low and the high end; automatic if none ([`automatic_range`]).
    pub range: Option<[f32; 2]>,
    /// By the logarithm. Values that are not positive are then at the low end.
    pub log: bool,
}

impl Scale {
    /// The range that `values` are shown in: low < high, both finite and, of a logarithmic scale, positive.
    pub fn range_of(&self, values: &[f32]) -> [f32; 2] {
        let [low, high] = match self.range {
            Some(range) => range,
            None => automatic_range(values, self.log),
        };
        proper(low, high, self.log)
    }
}

/// Mends what is no range.
fn proper(low: f32, high: f32, log: bool) -> [f32; 2] {
    let finite = |v: f32, or: f32| if v.is_finite() { v } else { or };
    let (low, high) = (finite(low, 0.0), finite(high, 1.0));
    let (low, high) = if low <= high { (low, high) } else { (high, low) };
    if log {
        let high = if high > 0.0 { high.max(f32::MIN_POSITIVE * 1e6) } else { 1.0 };
        let low = if low > 0.0 { low.max(f32::MIN_POSITIVE) } else { (high / LOG_SPAN).max(f32::MIN_POSITIVE) };
        if low < high { [low, high] } else { [high / 2.0, (high * 2.0).min(f32::MAX)] }
    } else if low < high {
        [low, high]
    } else {
        let half = (low.abs() / 2.0).max(0.5);
        [(low - half).max(f32::MIN), (low + half).min(f32::MAX)]
    }
}

/// The 1st and the 99th percentile of the finite values (of the positive ones among them if `log`, and then no more than six
/// decades apart); if there are none, [0, 1]. They may be equal.
pub fn automatic_range(values: &[f32], log: bool) -> [f32; 2] {
    let mut kept: Vec<f32> = values.iter().copied().filter(|v| v.is_finite() && (!log || *v > 0.0)).collect();
    let Some(last) = kept.len().checked_sub(1) else {
        return [0.0, 1.0];
    };
    let mut at = |i: usize| *kept.select_nth_unstable_by(i, f32::total_cmp).1;
    let [low, high] = [at(last / 100), at(last - last / 100)];
    [if log { low.max(high / MOST_LOG_SPAN) } else { low }, high]
}

/// `values` through the map into `bytes`, RGBA8, whose old content goes; the range used.
pub fn scalar(values: &[f32], scale: &Scale, bytes: &mut Vec<u8>) -> [f32; 2] {
    let range = scale.range_of(values);
    let place = place(range, scale.log);
    paint(values, bytes, |&v| if v.is_finite() { colour(place(v)) } else { NOT_FINITE });
    range
}

/// The luminance of `rgb` in stops about mid grey, log₂(Y·2^`exposure` / 0.18), linear over `stops` (low, high), RGBA8.
/// Black is at the low end.
pub fn luminance_in_stops(rgb: &[[f32; 3]], exposure: f32, stops: [f32; 2], bytes: &mut Vec<u8>) {
    let offset = exposure - MID_GREY.log2();
    let place = place(proper(stops[0], stops[1], false), false);
    paint(rgb, bytes, |&rgb| {
        let y = luminance(rgb);
        if y.is_finite() { colour(place(y.max(0.0).log2() + offset)) } else { NOT_FINITE }
    });
}

/// Signed values, RGBA8: green above 0, red below, black at 0; the encoded sRGB of |v| over `most` (above 0), full from
/// there on.
pub fn signed(values: &[f32], most: f32, bytes: &mut Vec<u8>) {
    paint(values, bytes, |&v| {
        let level = (srgb_encode((v.abs() / most).min(1.0)) * 255.0 + 0.5) as u8;
        match v {
            _ if !v.is_finite() => NOT_FINITE,
            _ if v < 0.0 => [level, 0, 0, 255],
            _ => [0, level, 0, 255],
        }
    });
}

fn paint<T: Sync>(values: &[T], bytes: &mut Vec<u8>, colour: impl Fn(&T) -> [u8; 4] + Sync) {
    bytes.resize(values.len() * 4, 0);
    bytes.par_chunks_mut(1 << 14).zip(values.par_chunks(1 << 12)).for_each(|(bytes, values)| {
        for (bytes, value) in bytes.chunks_exact_mut(4).zip(values) {
            bytes.copy_from_slice(&colour(value));
        }
    });
}

/// From a finite value to its place on the map, where 0 is the low and 1 the high end; may be outside.
fn place([low, high]: [f32; 2], log: bool) -> impl Fn(f32) -> f32 + Sync {
    let (a, b) = if log { (low.log2(), high.log2()) } else { (low, high) };
    // Halves: the difference of two finite values may not be one.
    let scale = 0.5 / (0.5 * b - 0.5 * a);
    move |v| (if log { v.max(0.0).log2() } else { v } - a) * scale
}

/// The map's colour at `place` in [0, 1], for a legend's bar; outside, the end's. RGBA.
pub fn colour(place: f32) -> [u8; 4] {
    static MAP: LazyLock<[[u8; 4]; 1024]> = LazyLock::new(|| std::array::from_fn(|i| cubehelix(i as f32 / 1023.0)));
    MAP[(place.clamp(0.0, 1.0) * 1023.0 + 0.5) as usize] // NaN is 0.
}

/// Green 2011, equations 1 and 2, with his start ½, −1.5 rotations, hue 1, γ 1. The values are encoded sRGB.
fn cubehelix(place: f32) -> [u8; 4] {
    let (sin, cos) = (TAU * (0.5 / 3.0 - 1.5 * place)).sin_cos();
    let amplitude = place * (1.0 - place) / 2.0;
    let level = |c: f32, s: f32| ((place + amplitude * (c * cos + s * sin)).clamp(0.0, 1.0) * 255.0 + 0.5) as u8;
    [level(-0.14861, 1.78277), level(-0.29227, -0.90649), level(1.97294, 0.0), 255]
}

/// The least of 1, 2 and 5 times the powers of ten that is no less than `value`, which is above 0; finite.
pub fn round_up(value: f32) -> f32 {
    let slack = 1.0 - 1e-6; // A round value is itself, which f32 rounds.
    let value = f64::from(value);
    let power = 10f64.powf(value.log10().floor());
    let step = [1.0, 2.0, 5.0].into_iter().find(|step| step * power >= value * slack).unwrap_or(10.0);
    (step * power).min(f32::MAX.into()) as f32
}

/// Round values inside `range` (low, high) for a legend, rising, two to nine: multiples of 1, 2 or 5 times a
/// power of ten; on a logarithmic scale powers of ten, and 2 and 5 times them where it spans under two and a half
/// decades. A range that is none is mended as [`Scale::range_of`] does.
pub fn ticks(range: [f32; 2], log: bool) -> Vec<f32> {
    let range = proper(range[0], range[1], log);
    let [low, high] = range.map(f64::from);
    let slack = 1e-6; // A tick may be the end itself, which f32 rounds.
    if !log || high / low < 5.0 {
        let rough = (high - low) / 5.0;
        let power = 10f64.powf(rough.log10().floor());
        let step = power * [1.0, 2.0, 5.0, 10.0].into_iter().find(|s| s * power >= rough * 0.7).unwrap_or(10.0);
        let first = (low / step - slack).ceil();
        let last = (high / step + slack).floor();
        let mut ticks: Vec<_> = (0..=(last - first) as u32).map(|i| ((first + f64::from(i)) * step) as f32).collect();
        ticks.dedup();
        return ticks;
    }
    let (from, to) = (low.log10(), high.log10());
    let every = ((to - from) / 7.0).ceil() as usize;
    let steps: &[f64] = if to - from < 2.5 { &[1.0, 2.0, 5.0] } else { &[1.0] };
    let inside = |v: &f64| *v >= low * (1.0 - slack) && *v <= high * (1.0 + slack);
    let decades = (from.floor() as i32..=to.ceil() as i32).filter(|d| d.rem_euclid(every as i32) == 0);
    decades.flat_map(|d| steps.iter().map(move |s| s * 10f64.powi(d))).filter(inside).map(|v| v as f32).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_map_rises_evenly_from_black_to_white() {
        assert_eq!((colour(0.0), colour(1.0)), ([0, 0, 0, 255], [255; 4]));
        assert_eq!((colour(-3.0), colour(7.0), colour(f32::NAN)), (colour(0.0), colour(1.0), colour(0.0)));
        // Green's perceived brightness: 0.30 R + 0.59 G + 0.11 B is the place itself.
        for i in 0..=100 {
            let place = i as f32 / 100.0;
            let [r, g, b, _] = cubehelix(place).map(|c| f32::from(c) / 255.0);
            assert!((0.30 * r + 0.59 * g + 0.11 * b - place).abs() < 0.01, "{place}");
            assert_ne!(colour(place), NOT_FINITE);
        }
    }

    #[test]
    fn ranges_leave_outliers_and_what_is_not_finite() {
        let mut values: Vec<f32> = (0..=1000).map(|i| i as f32).collect();
        values.extend([f32::NAN, f32::INFINITY, f32::NEG_INFINITY]);
        assert_eq!(automatic_range(&values, false), [10.0, 990.0]);
        assert_eq!(automatic_range(&values, true), [10.0, 991.0]); // Of 1 to 1000.
        assert_eq!(automatic_range(&[f32::NAN], false), [0.0, 1.0]);
        for log in [false, true] {
            for range in [None, Some([0.0, 0.0]), Some([3.0, -1.0]), Some([f32::NAN, f32::INFINITY])] {
                for values in [&[][..], &[0.0], &[5.0; 9], &[-1.0, -2.0], &[f32::MAX, f32::MIN], &[1e-45]] {
                    let [low, high] = Scale { range, log }.range_of(values);
                    assert!(low < high && low.is_finite() && high.is_finite() && (!log || low > 0.0), "{low} {high}");
                }
            }
        }
    }

    #[test]
    fn values_find_their_place() {
        let mut bytes = vec![9; 3];
        let pixel = |bytes: &[u8], i: usize| <[u8; 4]>::try_from(&bytes[4 * i..][..4]).unwrap();
        let linear = Scale { range: Some([-1.0, 3.0]), log: false };
        assert_eq!(scalar(&[-1.0, 1.0, 3.0, 9.0, f32::NAN], &linear, &mut bytes), [-1.0, 3.0]);
        let places = [colour(0.0), colour(0.5), colour(1.0), colour(1.0), NOT_FINITE];
        assert_eq!(places, std::array::from_fn(|i| pixel(&bytes, i)));
        let log = Scale { range: Some([0.01, 100.0]), log: true };
        scalar(&[0.0, 1.0, 10.0, -5.0, f32::INFINITY], &log, &mut bytes);
        let places = [colour(0.0), colour(0.5), colour(0.75), colour(0.0), NOT_FINITE];
        assert_eq!(places, std::array::from_fn(|i| pixel(&bytes, i)));
        luminance_in_stops(&[[0.09; 3], [0.0; 3], [0.36; 3], [f32::NAN; 3]], 1.0, [-4.0, 4.0], &mut bytes);
        let places = [colour(0.5), colour(0.0), colour(0.75), NOT_FINITE];
        assert_eq!(places, std::array::from_fn(|i| pixel(&bytes, i)));
        assert_eq!(bytes.len(), 16);
    }

    #[test]
    fn signs_are_green_and_red() {
        let mut bytes = Vec::new();
        signed(&[0.0, 2.0, -4.0, f32::NAN], 2.0, &mut bytes);
        assert_eq!(bytes, [[0, 0, 0, 255], [0, 255, 0, 255], [255, 0, 0, 255], NOT_FINITE].concat());
    }

    #[test]
    fn round_numbers_are_themselves_and_others_rise_to_them() {
        for power in -40..=38 {
            for (digits, round) in [("1", "1"), ("1.01", "2"), ("2", "2"), ("2.1", "5"), ("5", "5"), ("5.1", "10")] {
                let number = |digits: &str| format!("{digits}e{power}").parse::<f32>().unwrap();
                let (value, expected) = (number(digits), number(round).min(f32::MAX));
                if value < f32::INFINITY {
                    let rounded = round_up(value);
                    // Below 1e-38 f32 has but few digits.
                    assert!(rounded == expected || power < -37 && rounded >= value, "{value} {rounded}");
                }
            }
        }
        assert_eq!(round_up(f32::MAX), f32::MAX);
    }

    #[test]
    fn ticks_are_round_and_inside() {
        assert_eq!(ticks([0.0, 1.0], false), [0.0, 0.2, 0.4, 0.6, 0.8, 1.0]);
        assert_eq!(ticks([-3.2, 7.0], false), [-2.0, 0.0, 2.0, 4.0, 6.0]);
        assert_eq!(ticks([0.01, 1e3], true), [0.01, 0.1, 1.0, 10.0, 100.0, 1000.0]);
        assert_eq!(ticks([0.3, 7.0], true), [0.5, 1.0, 2.0, 5.0]);
        assert_eq!(ticks([2.0, 4.0], true), ticks([2.0, 4.0], false));
        let mut low = 1e-20f32;
        while low < 1e15 {
            for factor in [1.01f32, 1.5, 3.0, 6.0, 20.0, 400.0, 1e5, 1e12, 1e20] {
                for log in [false, true] {
                    let ticks = ticks([low, low * factor], log);
                    assert!((2..=9).contains(&ticks.len()), "{low} {factor} {log}: {ticks:?}");
                    assert!(ticks.is_sorted_by(|a, b| a < b));
                    let slack = 1e-5 * low * factor;
                    assert!(ticks.iter().all(|t| *t >= low - slack && *t <= low * factor + slack));
                }
            }
            low *= 7.3;
        }
        ticks([f32::MIN, f32::MAX], false);
        ticks([1e-45, f32::MAX], true);
    }
}
