//! How far it is, on standard error: a bar on a terminal, a line a second elsewhere, nothing when asked to be quiet.

use std::io::IsTerminal;
use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

/// Steps of the bar: more than a terminal has columns.
const STEPS: u64 = 1000;

/// What there is to say after an iteration.
pub struct Status {
    /// Done.
    pub iterations: u32,
    /// Since the first iteration began.
    pub seconds: f64,
    /// Of the budget, from 0 to 1.
    pub spent: f64,
    /// Photon paths an iteration.
    pub n_paths: u32,
    /// Of this iteration, metres.
    pub radius: f32,
}

/// Says how far it is.
pub enum Progress {
    /// Nothing.
    Quiet,
    /// On a terminal.
    Bar(ProgressBar),
    /// Into a file or a pipe.
    Lines {
        /// When the last line was written.
        last: Option<Instant>,
    },
}

impl Progress {
    pub fn new(quiet: bool) -> Self {
        if quiet {
            return Self::Quiet;
        }
        if !std::io::stderr().is_terminal() {
            return Self::Lines { last: None };
        }
        let bar = ProgressBar::with_draw_target(Some(STEPS), ProgressDrawTarget::stderr());
        let style = ProgressStyle::with_template("{wide_bar} {msg}").unwrap_or_else(|_| ProgressStyle::default_bar());
        bar.set_style(style);
        bar.set_message("first photons");
        bar.tick();
        Self::Bar(bar)
    }

    /// After an iteration.
    pub fn update(&mut self, status: &Status) {
        match self {
            Self::Quiet => {}
            Self::Bar(bar) => {
                bar.set_message(status.line());
                bar.set_position((status.spent * STEPS as f64) as u64);
            }
            Self::Lines { last } => {
                if last.is_none_or(|last| last.elapsed() >= Duration::from_secs(1)) {
                    eprintln!("{:3.0} %  {}", 100.0 * status.spent, status.line());
                    *last = Some(Instant::now());
                }
            }
        }
    }

    /// A line that stays.
    pub fn say(&self, line: &str) {
        match self {
            Self::Quiet => {}
            Self::Bar(bar) if !bar.is_finished() => bar.suspend(|| eprintln!("{line}")),
            _ => eprintln!("{line}"),
        }
    }

    /// No more iterations.
    pub fn finish(&self) {
        if let Self::Bar(bar) = self {
            bar.finish_and_clear();
        }
    }
}

impl Status {
    fn line(&self) -> String {
        let seconds = self.seconds.max(1e-9);
        let rate = f64::from(self.iterations) / seconds;
        let left = seconds * (1.0 - self.spent) / self.spent.max(1e-9);
        format!(
            "iteration {}, {} left, {} it/s, {} photons/s, radius {}",
            self.iterations,
            self::seconds(left),
            three_digits(rate),
            with_prefix(rate * f64::from(self.n_paths)),
            length(self.radius),
        )
    }
}

/// "4.2 s", "42 s", "3:05 min", "2:00 h".
pub fn seconds(time: f64) -> String {
    let seconds = time.round() as u64;
    match seconds {
        0..10 => format!("{time:.1} s"),
        10..60 => format!("{seconds} s"),
        60..3600 => format!("{}:{:02} min", seconds / 60, seconds % 60),
        _ => format!("{}:{:02} h", seconds / 3600, seconds / 60 % 60),
    }
}

/// Metres in a handy unit.
pub fn length(metres: f32) -> String {
    let metres = f64::from(metres);
    match metres {
        m if m >= 1000.0 => format!("{} km", three_digits(m / 1e3)),
        m if m >= 1.0 => format!("{} m", three_digits(m)),
        m if m >= 1e-3 => format!("{} mm", three_digits(m * 1e3)),
        m => format!("{} µm", three_digits(m * 1e6)),
    }
}

/// So many of them.
#[cfg(feature = "view")]
pub fn iterations(n: u32) -> String {
    if n == 1 { "1 iteration".to_owned() } else { format!("{n} iterations") }
}

/// Places after the point that a length among others of this `scale` needs, both in metres.
#[cfg(feature = "view")]
pub fn decimals(scale: f64) -> usize {
    if scale > 0.0 { (2 - scale.log10().floor() as i32).clamp(0, 9) as usize } else { 2 }
}

pub fn with_prefix(x: f64) -> String {
    match x {
        x if x >= 1e9 => format!("{} G", three_digits(x / 1e9)),
        x if x >= 1e6 => format!("{} M", three_digits(x / 1e6)),
        x if x >= 1e3 => format!("{} k", three_digits(x / 1e3)),
        x => three_digits(x) + " ",
    }
}

fn three_digits(x: f64) -> String {
    match x {
        x if x >= 100.0 => format!("{x:.0}"),
        x if x >= 10.0 => format!("{x:.1}"),
        x => format!("{x:.2}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[cfg(feature = "view")]
    #[test]
    fn small_lengths_have_more_decimals() {
        for (scale, n) in [(2.3, 2), (250.0, 0), (1e-30, 9), (0.0, 2), (f64::NAN, 2)] {
            assert_eq!(decimals(scale), n, "{scale}");
        }
    }

    #[test]
    fn numbers_for_people() {
        assert_eq!(seconds(4.25), "4.2 s");
        assert_eq!(seconds(185.0), "3:05 min");
        assert_eq!(seconds(7260.0), "2:01 h");
        assert_eq!(length(0.00321), "3.21 mm");
        assert_eq!(length(12.34), "12.3 m");
        assert_eq!(length(4.2e-5), "42.0 µm");
        assert_eq!(with_prefix(1.25e6), "1.25 M");
        assert_eq!(with_prefix(12.0), "12.0 ");
    }
}
