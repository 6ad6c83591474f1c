//! How much one dispatch does.

use crate::gpu::kernels::Took;

/// What a slow device does in a second: pixels of eye paths or of the gather, photon paths.
const SLOWLY: f64 = 4e6;
/// Of the amount before, at most: a dispatch may have been done before it was waited for.
const GROWTH: u32 = 2;

/// How much the dispatches of a stage do, each chosen by how long one before it took. Where photons lie dense a pixel takes a
/// hundred times what it takes elsewhere, and nothing is known of a camera that is new.
pub(super) struct Pace {
    amount: u32,
    /// What counts as one, of what a slow device does [`SLOWLY`].
    unit: u32,
    most: u32,
    /// That a dispatch is to take.
    seconds: f64,
}

impl Pace {
    /// `most` at a time.
    pub(super) fn new(unit: u32, most: u32) -> Self {
        Self { amount: most, unit, most, seconds: f64::INFINITY }
    }

    /// What the next dispatch is to do.
    pub(super) fn amount(&self) -> u32 {
        self.amount
    }

    /// Of something new, each dispatch of which is to take so many seconds: with what even a slow device does in them.
    pub(super) fn begin(&mut self, seconds: f64) {
        self.seconds = seconds;
        self.amount = self.amount.min(self.fitting(SLOWLY * seconds / f64::from(self.unit)));
    }

    /// From a dispatch that is done, if there is one.
    pub(super) fn learn(&mut self, took: Option<Took>) {
        if let Some(Took { amount: amount @ 1.., seconds: took }) = took
            && took > 0.0
        {
            let fitting = self.fitting(f64::from(amount) * self.seconds / took);
            // It may have done more than it was to, there being a least.
            self.amount = fitting.min(self.amount.max(amount).saturating_mul(GROWTH));
        }
    }

    fn fitting(&self, amount: f64) -> u32 {
        (amount as u32).clamp(1, self.most)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Amounts of the dispatches of a stage of `n` on a device that takes `cost(i)` for the i-th, two of which are under way.
    fn stage(pace: &mut Pace, n: u32, cost: impl Fn(u32) -> f64) -> Vec<(u32, f64)> {
        let (mut first, mut done): (u32, Vec<(u32, f64)>) = (0, vec![]);
        while first < n {
            let amount = pace.amount().min(n - first);
            done.push((amount, (first..first + amount).map(&cost).sum()));
            first += amount;
            if let Some(&(amount, seconds_taken)) = done.len().checked_sub(2).and_then(|i| done.get(i)) {
                pace.learn(Some(Took { amount, seconds: seconds_taken }));
            }
        }
        done
    }

    #[test]
    fn dispatches_take_as_long_as_they_may() {
        let mut pace = Pace::new(1, 1 << 19);
        pace.begin(0.004);
        assert_eq!(pace.amount(), 16_000);
        // A device that does 50 million in a second, ten times what was begun with.
        let first = stage(&mut pace, 2_000_000, |_| 2e-8);
        assert!(first.iter().all(|(_, took)| *took < 0.0041) && first.len() < 20, "{first:?}");
        let second = stage(&mut pace, 2_000_000, |_| 2e-8);
        assert_eq!(second.len(), 10);
        // One that is slower than was thought.
        pace.begin(0.004);
        let slow = stage(&mut pace, 200_000, |_| 1e-6);
        assert!(slow[4..].iter().all(|(_, took)| *took < 0.0041), "{slow:?}");
    }

    #[test]
    fn a_dense_part_takes_long_twice() {
        let mut pace = Pace::new(1, 1 << 19);
        pace.begin(0.004);
        let dense = |i: u32| if (500_000..700_000).contains(&i) { 2e-6 } else { 2e-8 };
        let done = stage(&mut pace, 1_000_000, dense);
        assert!(done.iter().filter(|(_, took)| *took > 0.0041).count() <= 2, "{done:?}");
    }

    #[test]
    fn nothing_is_learnt_from_nothing() {
        let mut pace = Pace::new(1, 100);
        for took in [None, Some(Took { amount: 0, seconds: 1.0 }), Some(Took { amount: 5, seconds: 0.0 })] {
            pace.learn(took);
            assert_eq!(pace.amount(), 100);
        }
        pace.begin(0.0);
        assert_eq!(pace.amount(), 1);
    }
}
