//! Clocks, and what is said of repeated times.

use std::time::Instant;

/// How long something took.
#[derive(Clone, Copy, Debug, Default)]
pub struct Time {
    /// Seconds by the wall clock.
    pub wall: f64,
    /// User and system seconds of all threads of this process, where the system tells them.
    pub cpu: Option<f64>,
}

/// Does `work`, and says how long it took.
pub fn timed<T>(work: impl FnOnce() -> T) -> (T, Time) {
    let (wall, cpu) = (Instant::now(), cpu_seconds());
    let done = work();
    let cpu = cpu.zip(cpu_seconds()).map(|(before, after)| after - before);
    (done, Time { wall: wall.elapsed().as_secs_f64(), cpu })
}

#[cfg(unix)]
fn cpu_seconds() -> Option<f64> {
    let now = rustix::time::clock_gettime(rustix::time::ClockId::ProcessCPUTime);
    Some(now.tv_sec as f64 + 1e-9 * now.tv_nsec as f64)
}

#[cfg(not(unix))]
fn cpu_seconds() -> Option<f64> {
    None
}

/// The same work, timed again and again.
#[derive(Clone, Debug, Default)]
pub struct Times(Vec<Time>);

impl Times {
    pub fn push(&mut self, time: Time) {
        self.0.push(time);
    }

    /// Wall seconds.
    pub fn wall(&self) -> Spread {
        Spread::of(self.0.iter().map(|t| t.wall).collect())
    }

    /// CPU seconds, if the system tells them.
    pub fn cpu(&self) -> Option<Spread> {
        let times: Option<Vec<f64>> = self.0.iter().map(|t| t.cpu).collect();
        times.filter(|t| !t.is_empty()).map(Spread::of)
    }
}

/// What is said of several figures; NaN of none.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Spread {
    /// The middle one, or the mean of the two in the middle.
    pub median: f64,
    pub mean: f64,
    pub least: f64,
    pub most: f64,
}

impl Spread {
    pub fn of(mut figures: Vec<f64>) -> Self {
        figures.sort_by(f64::total_cmp);
        let n = figures.len();
        if n == 0 {
            return Self { median: f64::NAN, mean: f64::NAN, least: f64::NAN, most: f64::NAN };
        }
        Self {
            median: 0.5 * (figures[(n - 1) / 2] + figures[n / 2]),
            mean: figures.iter().sum::<f64>() / n as f64,
            least: figures[0],
            most: figures[n - 1],
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn spreads() {
        let odd = Spread::of(vec![5.0, 1.0, 3.0]);
        assert_eq!(odd, Spread { median: 3.0, mean: 3.0, least: 1.0, most: 5.0 });
        assert_eq!(Spread::of(vec![4.0, 1.0, 2.0, 9.0]).median, 3.0);
        assert!(Spread::of(vec![]).median.is_nan());
    }

    #[cfg(unix)]
    #[test]
    fn work_costs_cpu_seconds_and_sleep_does_not() {
        let (_, slept) = timed(|| std::thread::sleep(std::time::Duration::from_millis(30)));
        assert!(slept.wall >= 0.03);
        let (_, worked) = timed(|| {
            let began = Instant::now();
            while began.elapsed().as_millis() < 30 {
                std::hint::spin_loop();
            }
        });
        // Other tests run beside this one, in the same process: no upper bound holds.
        assert!(worked.cpu.is_some_and(|cpu| cpu > 0.005));
    }
}
