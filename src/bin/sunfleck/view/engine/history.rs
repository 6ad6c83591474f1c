//! What an estimate has gone through, for the plots: in memory that does not grow with the iterations.

use sunfleck::ppm::StageTimes;

/// Every iteration up to this one is kept, and as many of every doubling after it.
const ALL_UP_TO: u32 = 512;

/// One iteration, for the plots.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Record {
    /// From 1.
    pub iteration: u32,
    /// Since the restart, pauses left out.
    pub seconds: f64,
    /// Median over the pixels, metres.
    pub radius: f32,
    /// Of all iterations since the restart, together.
    pub times: StageTimes,
    pub n_photons: u32,
    pub n_paths: u32,
}

/// An error of a picture, after so many iterations.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Measured {
    pub iteration: u32,
    /// Since the restart, pauses left out.
    pub seconds: f64,
    pub rel_mse: f64,
    /// Of an error against a reference, the same without the thousandth of the pixels that is worst: single bright ones
    /// rule the mean.
    pub trimmed: Option<f64>,
}

/// What belongs to an iteration.
pub trait OfIteration {
    fn iteration(&self) -> u32;
}

impl OfIteration for Record {
    fn iteration(&self) -> u32 {
        self.iteration
    }
}

impl OfIteration for Measured {
    fn iteration(&self) -> u32 {
        self.iteration
    }
}

/// A line over the iterations: all of the first, then fewer and fewer, as a logarithmic axis shows them, and the last.
#[derive(Clone, Debug)]
pub struct Series<T>(Vec<T>);

impl<T> Default for Series<T> {
    fn default() -> Self {
        Self(vec![])
    }
}

/// Iterations of one group are one point, once there are later ones.
fn group(iteration: u32) -> (u32, u32) {
    let doublings = (iteration / ALL_UP_TO).checked_ilog2().unwrap_or(0);
    (doublings, iteration >> doublings)
}

impl<T: OfIteration + Copy> Series<T> {
    /// Adds a point, unless its iteration is not after the last.
    pub fn push(&mut self, point: T) {
        let Self(points) = self;
        if points.last().is_some_and(|last| last.iteration() >= point.iteration()) {
            return;
        }
        if let [.., before, last] = points[..]
            && group(before.iteration()) == group(last.iteration())
        {
            points.pop();
        }
        points.push(point);
    }

    pub fn last(&self) -> Option<&T> {
        self.0.last()
    }

    pub fn clear(&mut self) {
        self.0.clear();
    }

    /// At most `n` points (two or more), evenly over the logarithm of the iteration, the last one among them.
    pub fn sample(&self, n: usize) -> Vec<T> {
        let Self(points) = self;
        let (Some(first), Some(last)) = (points.first(), points.last()) else { return vec![] };
        if points.len() <= n {
            return points.clone();
        }
        let [first, last] = [first, last].map(|point| f64::from(point.iteration().max(1)));
        let mut sampled: Vec<T> = Vec::with_capacity(n);
        for i in 0..n - 1 {
            let at = first * (last / first).powf(i as f64 / (n - 1) as f64);
            let next = points.partition_point(|point| f64::from(point.iteration()) < at);
            let point = points[next.min(points.len() - 1)];
            if sampled.last().is_none_or(|before| before.iteration() < point.iteration()) {
                sampled.push(point);
            }
        }
        sampled.extend(self.last().filter(|last| sampled.last().is_none_or(|s| s.iteration() < last.iteration())));
        sampled
    }
}

/// All of an estimate's iterations.
#[derive(Clone, Debug, Default)]
pub struct History {
    pub records: Series<Record>,
    /// From the two halves of the iterations.
    pub estimated: Series<Measured>,
    /// Against the reference.
    pub against_reference: Series<Measured>,
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(iterations: impl Iterator<Item = u32>) -> Series<Measured> {
        let mut series = Series::default();
        for iteration in iterations {
            series.push(Measured { iteration, seconds: 0.0, rel_mse: 1.0, trimmed: None });
        }
        series
    }

    fn iterations(points: &[Measured]) -> Vec<u32> {
        points.iter().map(|point| point.iteration).collect()
    }

    #[test]
    fn memory_is_bounded_and_the_last_is_there() {
        let mut longest = 0;
        let mut series = Series::default();
        for iteration in 1..=300_000 {
            series.push(Measured { iteration, ..Default::default() });
            assert_eq!(series.last().map(|last| last.iteration), Some(iteration));
            longest = longest.max(series.0.len());
        }
        // 300 000 is less than ten doublings of 512.
        assert!(longest <= 11 * 512 + 1, "{longest}");
        assert_eq!(iterations(&series.0[..600]), (1..=600).collect::<Vec<_>>());
        assert!(series.0.is_sorted_by(|a, b| a.iteration < b.iteration));
        // No more than a 512th is between two.
        assert!(series.0.windows(2).all(|w| w[1].iteration - w[0].iteration <= w[0].iteration / 512 + 1));
        // To the end of time.
        let wide = of((0..).map(|i| (1.001f64.powi(i) as u32).saturating_add(i as u32)).take_while(|&i| i < u32::MAX));
        assert!(wide.0.len() <= 24 * 512 + 1);
    }

    #[test]
    fn a_sample_is_small_and_even_in_the_logarithm() {
        let series = of(1..=100_000);
        let sample = iterations(&series.sample(500));
        assert!((250..=500).contains(&sample.len()), "{}", sample.len());
        assert_eq!((sample[0], sample.last()), (1, Some(&100_000)));
        assert!(sample.is_sorted_by(|a, b| a < b));
        let largest_gap = sample.windows(2).map(|w| f64::from(w[1]) / f64::from(w[0])).skip(1).fold(0.0, f64::max);
        assert!(largest_gap <= 1.5, "{largest_gap}");
        assert_eq!(iterations(&of(1..=20).sample(500)), (1..=20).collect::<Vec<_>>());
        assert_eq!(iterations(&of(1..=5000).sample(2)), [1, 5000]);
        assert!(of(0..0).sample(500).is_empty());
    }

    #[test]
    fn what_is_not_later_is_no_point() {
        assert_eq!(iterations(&of([3, 3, 2, 7, 7, 9].into_iter()).0), [3, 7, 9]);
    }
}
