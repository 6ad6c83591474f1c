//! Time, on the wall and on the cores.

use std::hint::black_box;
use std::time::Instant;

/// Milliseconds: of all threads on a core, and of the wall.
#[derive(Clone, Copy, Default)]
pub struct Spent {
    pub cpu: f64,
    pub wall: f64,
}

/// What `run` takes and gives. What it gives is dropped after that.
pub fn clocked<T>(run: impl FnOnce() -> T) -> (Spent, T) {
    let (start, before) = (Instant::now(), cpu());
    let result = black_box(run());
    (Spent { cpu: cpu() - before, wall: start.elapsed().as_secs_f64() * 1e3 }, result)
}

/// Medians and least of CPU, medians and least of the wall.
pub struct Summary {
    pub cpu: f64,
    pub least_cpu: f64,
    pub wall: f64,
    pub least_wall: f64,
}

impl Summary {
    pub fn of(spent: &[Spent]) -> Self {
        let sorted = |of: fn(&Spent) -> f64| {
            let mut all: Vec<_> = spent.iter().map(of).collect();
            all.sort_by(f64::total_cmp);
            all
        };
        let (cpu, wall) = (sorted(|s| s.cpu), sorted(|s| s.wall));
        Self { cpu: cpu[cpu.len() / 2], least_cpu: cpu[0], wall: wall[wall.len() / 2], least_wall: wall[0] }
    }
}

impl std::fmt::Display for Summary {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self { cpu, least_cpu, wall, least_wall } = self;
        write!(f, "{cpu:.1} ms of CPU (least {least_cpu:.1}), {wall:.1} ms (least {least_wall:.1})")
    }
}

/// Milliseconds that the threads of this process have been on a core (Linux; elsewhere zero).
fn cpu() -> f64 {
    let tasks = std::fs::read_dir("/proc/self/task").into_iter().flatten().flatten();
    let on_cpu = tasks.filter_map(|task| {
        let text = std::fs::read_to_string(task.path().join("schedstat")).ok()?;
        text.split_whitespace().next()?.parse::<f64>().ok()
    });
    on_cpu.sum::<f64>() / 1e6
}
