//! How fast the window is: what its frames cost, and how long an input waits for its picture.

use std::collections::VecDeque;
use std::time::{Duration, Instant};

/// Frames that are looked at.
const MOST_FRAMES: usize = 200;

#[derive(Default)]
pub struct Timing {
    frames: VecDeque<Duration>,
    /// When something was asked for, and the estimate under way then.
    asked: Option<(Instant, u64)>,
    waits: VecDeque<Duration>,
}

impl Timing {
    /// A frame took the interface thread so long, waits for the display left out.
    pub fn frame(&mut self, took: Duration) {
        push(&mut self.frames, took);
    }

    /// Another picture was asked for, while `estimate` was being rendered.
    pub fn ask(&mut self, now: Instant, estimate: u64) {
        self.asked.get_or_insert((now, estimate));
    }

    /// Nothing is asked for any more.
    pub fn give_up(&mut self) {
        self.asked = None;
    }

    /// A picture of `estimate` is shown.
    pub fn see(&mut self, now: Instant, estimate: u64) {
        if let Some((when, _)) = self.asked.take_if(|(_, before)| estimate > *before) {
            push(&mut self.waits, now - when);
        }
    }

    /// From inputs to their pictures, the newest.
    pub fn waits(&self) -> impl Iterator<Item = Duration> {
        self.waits.iter().copied()
    }

    /// For people.
    pub fn text(&self) -> String {
        let text = |of: &VecDeque<Duration>| {
            let ms = |part| percentile(of.iter().copied(), part).unwrap_or_default().as_secs_f64() * 1e3;
            format!("{:.1} ms, 95 % within {:.1} ms (of {})", ms(0.5), ms(0.95), of.len())
        };
        let mut lines = format!("The window's frames: {}", text(&self.frames));
        if !self.waits.is_empty() {
            lines += &format!("\nFrom an input to its picture: {}", text(&self.waits));
        }
        lines
    }
}

fn push(times: &mut VecDeque<Duration>, time: Duration) {
    if times.len() == MOST_FRAMES {
        times.pop_front();
    }
    times.push_back(time);
}

/// The least that `part` of the times, from 0 to 1, do not exceed; none of nothing.
pub fn percentile(times: impl Iterator<Item = Duration>, part: f64) -> Option<Duration> {
    let mut times: Vec<_> = times.collect();
    times.sort_unstable();
    let rank = (part * times.len() as f64).ceil() as usize;
    times.get(rank.saturating_sub(1)).copied()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn percentiles_are_of_the_newest_frames() {
        let mut timing = Timing::default();
        let percentile = |timing: &Timing, part| percentile(timing.frames.iter().copied(), part);
        assert_eq!(percentile(&timing, 0.95), None);
        (0..1000).for_each(|i| timing.frame(Duration::from_millis(i)));
        // 800 to 999.
        assert_eq!(percentile(&timing, 0.5), Some(Duration::from_millis(899)));
        assert_eq!(percentile(&timing, 0.95), Some(Duration::from_millis(989)));
        assert_eq!(percentile(&timing, 1.0), Some(Duration::from_millis(999)));
    }

    #[test]
    fn an_input_waits_for_an_estimate_that_began_after_it() {
        let (mut timing, start) = (Timing::default(), Instant::now());
        let at = |ms| start + Duration::from_millis(ms);
        timing.ask(at(0), 3);
        timing.see(at(5), 3);
        timing.ask(at(7), 3);
        timing.see(at(20), 4);
        timing.see(at(30), 5);
        // Nobody waits while no scene is open.
        timing.ask(at(40), 5);
        timing.give_up();
        timing.ask(at(90), 5);
        timing.see(at(100), 6);
        assert_eq!(timing.waits, [20, 10].map(Duration::from_millis));
    }
}
