//! How a picture's brightness is spread: counts per quarter stop of the luminance and of each channel.

use rayon::prelude::*;

use super::false_colour::MID_GREY;
use crate::ppm::film::luminance;

/// The low end of the first bin, stops about mid grey (0.18).
pub const LOWEST: i32 = -12;

/// The high end of the last bin, stops about mid grey.
pub const HIGHEST: i32 = 12;

/// Bins in a stop.
pub const PER_STOP: usize = 4;

/// Bins.
pub const BINS: usize = (HIGHEST - LOWEST) as usize * PER_STOP;

/// Counts of one quantity. All of them sum to the number of pixels.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Counts {
    /// Bin `i` holds the pixels from [`stop_of`]`(i)` (inclusive) to `stop_of(i + 1)`.
    pub bins: [u64; BINS],
    /// Below the first bin: black and negative values too.
    pub below: u64,
    /// Above the last bin, but finite.
    pub above: u64,
    /// NaN and infinities.
    pub not_finite: u64,
}

impl Default for Counts {
    fn default() -> Self {
        Self { bins: [0; BINS], below: 0, above: 0, not_finite: 0 }
    }
}

/// Of one picture.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Histogram {
    /// Of red, green and blue.
    pub channels: [Counts; 3],
    /// Of the luminance.
    pub luminance: Counts,
}

/// The low end of bin `i`, stops about mid grey.
pub fn stop_of(i: usize) -> f32 {
    LOWEST as f32 + i as f32 / PER_STOP as f32
}

impl Counts {
    /// `offset`: what is added to a value's log₂ to give stops above [`LOWEST`].
    fn add(&mut self, value: f32, offset: f32) {
        if !value.is_finite() {
            self.not_finite += 1;
            return;
        }
        let bin = ((value.max(0.0).log2() + offset) * PER_STOP as f32).floor();
        if bin < 0.0 {
            self.below += 1;
        } else if bin >= BINS as f32 {
            self.above += 1;
        } else {
            self.bins[bin as usize] += 1;
        }
    }

    fn merge(&mut self, other: &Self) {
        self.bins.iter_mut().zip(&other.bins).for_each(|(a, b)| *a += b);
        self.below += other.below;
        self.above += other.above;
        self.not_finite += other.not_finite;
    }
}

impl Histogram {
    /// Of linear RGB brought up by `exposure` stops.
    pub fn of(rgb: &[[f32; 3]], exposure: f32) -> Self {
        let offset = exposure - MID_GREY.log2() - LOWEST as f32;
        let count = |mut counts: Box<Self>, rgb: &[f32; 3]| {
            counts.channels.iter_mut().zip(rgb).for_each(|(channel, &value)| channel.add(value, offset));
            counts.luminance.add(luminance(*rgb), offset);
            counts
        };
        let parts = rgb.par_chunks(1 << 14).map(|rgb| rgb.iter().fold(Box::default(), count));
        *parts.reduce(Box::default, |mut a, b| {
            a.channels.iter_mut().zip(&b.channels).for_each(|(a, b)| a.merge(b));
            a.luminance.merge(&b.luminance);
            a
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_value_is_in_one_place() {
        let at = |stops: f32| MID_GREY * stops.exp2();
        let rgb = [
            [at(0.1), at(-11.9), at(11.9)],
            [at(0.1), at(-12.1), at(12.1)],
            [f32::NAN, 0.0, f32::INFINITY],
            [at(2.3), -1.0, at(2.3)],
        ];
        let histogram = Histogram::of(&rgb, 0.0);
        let [r, g, b] = &histogram.channels;
        assert_eq!((r.bins[48], r.bins[57], r.not_finite, r.below, r.above), (2, 1, 1, 0, 0));
        assert_eq!((g.bins[0], g.not_finite, g.below, g.above), (1, 0, 3, 0));
        assert_eq!((b.bins[BINS - 1], b.bins[57], b.not_finite, b.above), (1, 1, 1, 1));
        assert_eq!(histogram.luminance.not_finite, 1);
        assert_eq!((stop_of(48), stop_of(57)), (0.0, 2.25));
    }

    #[test]
    fn exposure_moves_it_and_nothing_is_lost() {
        let rgb: Vec<_> = (0..100_000).map(|i| [(i as f32 / 3e3 - 17.0).exp2(), i as f32, 0.5]).collect();
        let (a, b) = (Histogram::of(&rgb, 0.0), Histogram::of(&rgb, -1.5));
        assert_eq!(a.channels[2].bins.iter().position(|&n| n > 0), Some(53)); // log₂(0.5/0.18) = 1.47.
        assert_eq!(b.channels[2].bins.iter().position(|&n| n > 0), Some(47));
        for counts in a.channels.iter().chain([&a.luminance]) {
            let total = counts.bins.iter().sum::<u64>() + counts.below + counts.above + counts.not_finite;
            assert_eq!(total, 100_000);
        }
        assert_eq!(a.channels[0].bins[50], 750); // 3000 values a stop.
    }
}
