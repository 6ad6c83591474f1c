//! How far a picture still is from where it converges to, told from the picture alone: the two half-buffer estimate.
//!
//! The iterations go into two halves A and B with the means A̅ and B̅ of n_A and n_B iterations. Independent iterations of
//! variance σ² make Var(A̅ − B̅) = σ²(1/n_A + 1/n_B), and the variance of the mean M of all n = n_A + n_B is σ²/n. So
//! (A̅ − B̅)² · n_A·n_B/n² has the variance of M as its expectation, and over (M² + 0.01), averaged over pixels and
//! channels, it estimates the relMSE that [`super::compare`] would find against the limit of the iterations. With
//! n_A = n_B it does so too where σ² changes from iteration to iteration, as it does with a shrinking radius.
//!
//! It sees noise, not bias: what every iteration gets wrong alike (the blur of the radius, paths cut off) is in neither
//! A̅ − B̅ nor this estimate. It takes M for the unknown limit in the denominator, which is fair once a pixel's noise is
//! small against the pixel: before, it is some percent too high, and a firefly, which raises M with itself, counts for
//! 1 at most with n_A = n_B, where against the limit it may count for any number. And it is noisy itself: from a picture
//! of N pixels with normal noise its own relative error is about √(2/3N), and much more where a few fireflies are most of
//! the error.

use rayon::prelude::*;

use crate::ppm::film::Film;

/// The two halves of a film.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Halves {
    size: [u32; 2],
    /// Iterations in each.
    n: [u32; 2],
    /// Mean of each, linear RGB, `[h·w]`. In f32: the block that comes next is what the film has and these do not, so a
    /// rounding error in them does not stay.
    mean: [Vec<[f32; 3]>; 2],
}

impl Halves {
    /// Takes what `film` has and the last one had not, n·M_n − m·M_m, as one block into the half that has fewer
    /// iterations. A film of another size or with fewer iterations starts again; one with as many changes nothing. That
    /// a film is another render's does not show otherwise: start with a new `Halves` then.
    ///
    /// A film is f32: the mean of a block of k iterations, n in all, is exact to about 2⁻²⁴·n/k of the pixel's value.
    pub fn add(&mut self, film: &Film) {
        let size = [film.width, film.height];
        if size != self.size || film.n_iterations < self.n_iterations() || film.pixels.len() != self.mean[0].len() {
            let none = vec![[0.0; 3]; film.pixels.len()];
            *self = Self { size, n: [0; 2], mean: [none.clone(), none] };
        }
        let block = film.n_iterations - self.n_iterations();
        if block == 0 {
            return;
        }
        let into = usize::from(self.n[1] < self.n[0]);
        let [n, before, other] = [film.n_iterations, self.n[into], self.n[1 - into]].map(f64::from);
        let after = before + f64::from(block);
        let (low, high) = self.mean.split_at_mut(1);
        let (mean, others) = if into == 0 { (&mut low[0], &high[0]) } else { (&mut high[0], &low[0]) };
        // The half is the film's sum without the other half: n·M_n − m·M_m added to what was in it.
        mean.par_iter_mut().zip(others).zip(&film.pixels).for_each(|((mean, others), pixel)| {
            for c in 0..3 {
                mean[c] = ((n * f64::from(pixel[c]) - other * f64::from(others[c])) / after) as f32;
            }
        });
        self.n[into] += block;
    }

    /// Iterations of the last film.
    pub fn n_iterations(&self) -> u32 {
        self.n[0] + self.n[1]
    }

    /// Estimated relMSE of the mean of all iterations. None while a half is empty or no pixel is finite.
    pub fn rel_mse(&self) -> Option<f64> {
        let [a, b] = self.n.map(f64::from);
        let n = a + b;
        let weight = a * b / (n * n);
        if weight.is_nan() || weight == 0.0 {
            return None;
        }
        let pixel = |(x, y): (&[f32; 3], &[f32; 3])| {
            let channel = |c: usize| {
                let (x, y) = (f64::from(x[c]), f64::from(y[c]));
                let mean = (a * x + b * y) / n;
                (x - y).powi(2) * weight / (mean * mean + 0.01)
            };
            (channel(0) + channel(1) + channel(2)) / 3.0
        };
        // In chunks that are summed in their order: the same number whatever the threads do.
        let chunks = self.mean[0].par_chunks(1 << 12).zip(self.mean[1].par_chunks(1 << 12));
        let sums: Vec<(f64, u64)> = chunks
            .map(|(x, y)| {
                let errors = x.iter().zip(y).map(pixel).filter(|e| e.is_finite());
                errors.fold((0.0, 0), |(sum, n), e| (sum + e, n + 1))
            })
            .collect();
        let (sum, pixels) = sums.iter().fold((0.0, 0), |(s, n), part| (s + part.0, n + part.1));
        (pixels > 0).then(|| sum / pixels as f64)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ppm::film::add;

    const SIZE: u32 = 96;

    /// Uniform in [0, 1), of three numbers.
    fn random(pixel: u32, iteration: u32, channel: u32) -> f32 {
        let mut h = pixel.wrapping_mul(0x9e37_79b1) ^ iteration.wrapping_mul(0x85eb_ca77) ^ channel << 29;
        for _ in 0..3 {
            h = (h ^ h >> 16).wrapping_mul(0x7feb_352d);
            h = (h ^ h >> 15).wrapping_mul(0x846c_a68b);
        }
        (h >> 8) as f32 / (1 << 24) as f32
    }

    fn truth(pixel: u32) -> f32 {
        0.05 + pixel as f32 / (SIZE * SIZE) as f32
    }

    /// One more iteration: noise about the truth, as strong as `strength` says.
    fn iterate(film: &mut Film, strength: impl Fn(u32) -> f32) {
        film.n_iterations += 1;
        let i = film.n_iterations;
        for (p, pixel) in (0..).zip(&mut film.pixels) {
            let noise = |c| truth(p) * (1.0 + strength(i) * (2.0 * random(p, i, c) - 1.0));
            add(pixel, i, [noise(0), noise(1), noise(2)]);
        }
    }

    fn empty() -> Film {
        Film { width: SIZE, height: SIZE, n_iterations: 0, pixels: vec![[0.0; 4]; (SIZE * SIZE) as usize] }
    }

    fn true_rel_mse(film: &Film) -> f64 {
        let error = |p: u32, x: f32| f64::from(x - truth(p)).powi(2) / (f64::from(truth(p)).powi(2) + 0.01);
        let errors = (0..).zip(&film.pixels).map(|(p, x)| (0..3).map(|c| error(p, x[c])).sum::<f64>() / 3.0);
        errors.sum::<f64>() / film.pixels.len() as f64
    }

    /// The estimate after the blocks, and how many times the truth it is.
    fn ratio(blocks: &[u32], strength: impl Fn(u32) -> f32) -> (Halves, f64) {
        let (mut film, mut halves) = (empty(), Halves::default());
        for block in blocks {
            (0..*block).for_each(|_| iterate(&mut film, &strength));
            halves.add(&film);
        }
        let ratio = halves.rel_mse().unwrap() / true_rel_mse(&film);
        (halves, ratio)
    }

    // 27 648 values: the estimate and the truth each scatter by √(2/27 648), 0.9 %; 4 % is three of both.
    #[test]
    fn estimates_the_true_error() {
        for blocks in [&[1u32, 1][..], &[1; 16], &[3, 1, 1, 4, 2, 5], &[1, 9], &[7, 2]] {
            let (halves, ratio) = ratio(blocks, |_| 0.2);
            assert!((ratio - 1.0).abs() < 0.04, "{blocks:?} {:?}: {ratio}", halves.n);
            assert_eq!(halves.n_iterations(), blocks.iter().sum::<u32>());
        }
    }

    #[test]
    fn equal_halves_need_no_equal_noise() {
        let (halves, ratio) = ratio(&[1; 8], |i| i as f32 / 20.0);
        assert_eq!(halves.n, [4, 4]);
        assert!((ratio - 1.0).abs() < 0.04, "{ratio}");
    }

    #[test]
    fn blocks_go_to_the_half_that_has_fewer() {
        assert_eq!(ratio(&[1, 9], |_| 0.5).0.n, [1, 9]);
        assert_eq!(ratio(&[1, 3, 1, 2, 4], |_| 0.5).0.n, [4, 7]);
    }

    #[test]
    fn none_until_both_halves_have_something() {
        let (mut film, mut halves) = (empty(), Halves::default());
        assert_eq!(halves.rel_mse(), None);
        halves.add(&film);
        assert_eq!(halves.rel_mse(), None);
        iterate(&mut film, |_| 0.5);
        halves.add(&film);
        halves.add(&film);
        assert_eq!((halves.rel_mse(), halves.n), (None, [1, 0]));
        let first = film.clone();
        iterate(&mut film, |_| 0.5);
        halves.add(&film);
        assert!(halves.rel_mse().is_some());
        halves.add(&first); // Started again.
        assert_eq!((halves.rel_mse(), halves.n), (None, [1, 0]));
        halves.add(&Film { width: 1, height: 1, n_iterations: 5, pixels: vec![[1.0; 4]] });
        assert_eq!((halves.n, halves.mean[0].len()), ([5, 0], 1));
        halves.add(&Film { width: 1, height: 1, n_iterations: 6, pixels: vec![[f32::NAN; 4]] });
        assert_eq!(halves.rel_mse(), None);
    }
}
