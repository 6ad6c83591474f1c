//! What the window keeps: settings with undo, and limits.

use std::sync::Arc;

use sunfleck::scene::settings::Settings;

use super::engine::Limits;

/// Steps that can be undone.
const MOST_UNDONE: usize = 256;

/// Settings, and how to go back to what they were.
#[derive(Clone, Debug, Default)]
pub struct Edits {
    now: Arc<Settings>,
    undo: Vec<Arc<Settings>>,
    redo: Vec<Arc<Settings>>,
    /// What the last edit was of, and when: a drag is one step.
    last: Option<(&'static str, f64)>,
}

impl Edits {
    /// Edits of the same thing within so many seconds are one step.
    const ONE_STEP: f64 = 0.7;

    pub fn new(settings: Settings) -> Self {
        Self { now: Arc::new(settings), ..Self::default() }
    }

    pub fn now(&self) -> &Arc<Settings> {
        &self.now
    }

    /// Replaces the settings; `what` is edited at `time`, seconds.
    pub fn set(&mut self, what: &'static str, time: f64, settings: Settings) {
        if settings == *self.now {
            return;
        }
        let before = std::mem::replace(&mut self.now, Arc::new(settings));
        let goes_on = self.last.is_some_and(|(last, when)| last == what && time - when < Self::ONE_STEP);
        if goes_on && self.undo.last() == Some(&self.now) {
            // Back where it began: no step at all.
            self.undo.pop();
            self.redo.clear();
            self.last = None;
            return;
        }
        if !goes_on {
            self.undo.push(before);
            if self.undo.len() > MOST_UNDONE {
                self.undo.remove(0);
            }
        }
        self.redo.clear();
        self.last = Some((what, time));
    }

    /// The next edit is a step of its own, whatever it is of.
    pub fn end_step(&mut self) {
        self.last = None;
    }

    /// At every frame: edits while a button is down are one step, and of others than those before it went down.
    pub fn pointer(&mut self, time: f64, goes_down: bool, is_down: bool) {
        if goes_down {
            self.end_step();
        }
        if let (true, Some((_, when))) = (is_down, &mut self.last) {
            *when = time;
        }
    }

    /// Changes the settings, and those of every step.
    pub fn map(&mut self, change: impl Fn(&Settings) -> Settings) {
        let all = self.undo.iter_mut().chain(&mut self.redo).chain([&mut self.now]);
        all.for_each(|settings| *settings = Arc::new(change(settings)));
    }

    pub fn can_undo(&self) -> bool {
        !self.undo.is_empty()
    }

    pub fn can_redo(&self) -> bool {
        !self.redo.is_empty()
    }

    pub fn undo(&mut self) {
        if let Some(before) = self.undo.pop() {
            self.redo.push(std::mem::replace(&mut self.now, before));
            self.last = None;
        }
    }

    pub fn redo(&mut self) {
        if let Some(after) = self.redo.pop() {
            self.undo.push(std::mem::replace(&mut self.now, after));
            self.last = None;
        }
    }
}

/// Whose word the limits are: a flag's for every scene, a settings file's for its own.
#[derive(Default)]
pub struct LimitsOfScenes {
    flags: Limits,
    /// What the settings of the scene that is open have brought.
    brought: Limits,
    /// What was there before.
    before: Limits,
}

impl LimitsOfScenes {
    pub fn new(flags: Limits) -> Self {
        Self { flags, ..Self::default() }
    }

    /// Those for every scene.
    pub fn flags(&self) -> Limits {
        self.flags
    }

    /// The limits that a scene with these settings begins with; `now` are those of the scene before.
    pub fn of_next(&mut self, now: Limits, settings: &Settings) -> Limits {
        let flags = self.flags;
        let iterations = settings.iterations.map(|n| n.0).filter(|_| flags.iterations.is_none());
        let seconds = settings.seconds.filter(|_| flags.seconds.is_none());
        let without = Limits {
            iterations: if self.brought.iterations.is_some() { self.before.iterations } else { now.iterations },
            seconds: if self.brought.seconds.is_some() { self.before.seconds } else { now.seconds },
            ..now
        };
        self.brought = Limits { iterations, seconds, noise: None };
        self.before = without;
        Limits { iterations: iterations.or(without.iterations), seconds: seconds.or(without.seconds), ..without }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn with_alpha(alpha: f32) -> Settings {
        Settings { alpha: Some(alpha), ..Settings::default() }
    }

    #[test]
    fn a_drag_is_one_step() {
        let mut edits = Edits::new(with_alpha(0.1));
        for i in 0..10 {
            edits.set("alpha", 0.1 * f64::from(i), with_alpha(0.2 + 0.01 * i as f32));
        }
        edits.set("seed", 1.0, Settings { seed: Some(3), ..edits.now().as_ref().clone() });
        edits.set("seed", 9.0, Settings { seed: Some(4), ..edits.now().as_ref().clone() });
        edits.undo();
        assert_eq!(edits.now().seed, Some(3));
        edits.undo();
        assert_eq!((edits.now().seed, edits.now().alpha), (None, Some(0.29)));
        edits.undo();
        assert_eq!(edits.now().alpha, Some(0.1));
        assert!(!edits.can_undo() && edits.can_redo());
        // Back where it began, it is none.
        edits.set("alpha", 15.0, with_alpha(0.2));
        edits.set("alpha", 15.1, with_alpha(0.1));
        assert!(!edits.can_undo() && !edits.can_redo());
        edits.set("alpha", 15.2, with_alpha(0.29));
        edits.undo();
        assert_eq!((edits.now().alpha, edits.can_undo()), (Some(0.1), false));
        edits.redo();
        assert_eq!(edits.now().alpha, Some(0.29));
        edits.set("alpha", 20.0, with_alpha(0.5));
        assert!(!edits.can_redo());
    }

    #[test]
    fn a_press_is_one_step_however_long_it_rests() {
        let mut edits = Edits::new(with_alpha(0.1));
        let mut time = 0.0;
        for press in 1..=2 {
            for i in 1..=3 {
                edits.pointer(time, i == 1, true);
                edits.set("alpha", time, with_alpha(0.1 * press as f32 + 0.01 * i as f32));
                // Frames go by.
                for _ in 0..30 {
                    time += 0.1;
                    edits.pointer(time, false, true);
                }
            }
            time += 0.1;
            edits.pointer(time, false, false);
        }
        let alphas: Vec<_> =
            std::iter::from_fn(|| edits.can_undo().then(|| (edits.undo(), edits.now().alpha).1)).collect();
        assert_eq!(alphas, [Some(0.13), Some(0.1)]);
    }
}
