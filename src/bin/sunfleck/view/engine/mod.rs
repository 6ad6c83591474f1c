//! What renders behind the window, on threads of its own: the interface says what it wants and looks at what there is,
//! and never waits.
//!
//! The render thread compares what is wanted with what it has and does the least that leads there. What was wanted in
//! between is never rendered, so that no queue of camera positions can build up.

mod colours;
mod history;
mod paint;
mod painting;
mod reading;
mod saving;
mod session;
#[cfg(test)]
mod tests;
mod worker;

use std::any::Any;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;

use anyhow::{Error, Result};
use glam::Vec3;
use sunfleck::output::Picture;
use sunfleck::ppm::Interrupt;
use sunfleck::scene::load::Loaded;
use sunfleck::scene::settings::Settings;

pub use colours::{Legend, NOTHING, Values};
pub use history::{History, Measured, Record, Series};
pub use paint::{Comparison, Insides, Painted, Painting, View};
pub use saving::Save;
pub use session::Snapshot;
use worker::Work;
pub use worker::{is_asked_anew, is_other_scene};

use crate::devices::Device;
use crate::scenes::Source;

/// Called when there is something new to look at.
pub type Wake = Arc<dyn Fn() + Send + Sync>;

/// When to pause by itself: whatever comes first; counted since the restart.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Limits {
    pub iterations: Option<u32>,
    pub seconds: Option<f64>,
    /// Estimated relMSE.
    pub noise: Option<f64>,
}

impl Limits {
    /// With those of a settings file where there are none.
    pub fn or_of(self, settings: &Settings) -> Self {
        let iterations = self.iterations.or(settings.iterations.map(|n| n.0));
        Self { iterations, seconds: self.seconds.or(settings.seconds), ..self }
    }
}

/// A scene to open.
#[derive(Clone, Debug, PartialEq)]
pub struct Choice {
    /// File, or name of a shipped scene.
    pub name: String,
    /// `key=value`, over its settings.
    pub set: Vec<String>,
}

/// What the interface wants. Cheap to clone and to compare.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Wanted {
    pub scene: Option<Arc<Choice>>,
    /// Counts requests to read the scene, or to read it again.
    pub reloads: u32,
    /// What is read is what was open: it stays on view meanwhile, and what was changed stays changed.
    pub reads_again: bool,
    /// In the place of those that the scene was opened with.
    pub settings: Option<Arc<Settings>>,
    /// The camera is moving: quick previews instead of the picture.
    pub moving: bool,
    /// Counts restarts.
    pub restarts: u32,
    pub paused: bool,
    /// Iterations to do though paused: grows by one a step.
    pub steps: u32,
    /// Counts requests to do again what failed, with the device opened anew if it was lost.
    pub retries: u32,
    pub limits: Limits,
    /// In their place, for a scene that the interface has not seen yet: those for every scene, with what its settings say where
    /// there are none.
    pub limits_at_first: Option<Limits>,
    pub painting: Painting,
}

impl Wanted {
    /// The limits of a scene that was opened with these settings.
    pub fn limits_with(&self, settings: &Settings) -> Limits {
        self.limits_at_first.map_or(self.limits, |given| given.or_of(settings))
    }
}

/// What the render thread is doing.
#[derive(Clone, Debug, Default, PartialEq)]
pub enum Phase {
    #[default]
    Empty,
    Loading,
    /// Packing the scene, taking it to the device.
    Preparing,
    /// First photons, for the first radii.
    Starting,
    Rendering,
    Paused,
    /// A limit was reached.
    Reached,
    /// What went wrong, one line.
    Failed(String),
}

/// What was read.
#[derive(Debug)]
pub struct Opened {
    /// What asked for it.
    pub choice: Arc<Choice>,
    /// With the settings that it was opened with.
    pub source: Source,
    /// The settings as their file has them now.
    read: Mutex<Arc<Settings>>,
    /// As the file has it, before settings; the default camera is added if it has none.
    pub loaded: Loaded,
    /// Least and greatest corner of the scene and of the spheres that its settings add, without what lies far outside
    /// ([`sunfleck::scene::Scene::subject_bounds`]), metres; those of a cube of side 1 about the origin if there is nothing.
    pub bounds: [Vec3; 2],
    /// Whether the default camera stands within them: in a closed room, or under a dome.
    pub is_closed: bool,
}

impl Opened {
    /// The settings as their file has them.
    pub fn read(&self) -> Arc<Settings> {
        Arc::clone(&self.read.lock().unwrap_or_else(PoisonError::into_inner))
    }

    /// Takes what the file says, after it was written.
    pub fn read_settings_again(&self) -> Result<()> {
        let now = Source::resolve(&self.choice.name)?.settings;
        *self.read.lock().unwrap_or_else(PoisonError::into_inner) = Arc::new(now);
        Ok(())
    }

    /// The material called as the one of that index was in a version before.
    pub fn material_as(&self, before: &Self, index: usize) -> Option<usize> {
        let name = &before.loaded.scene.materials.get(index)?.name;
        let materials = &self.loaded.scene.materials;
        // Several may have the name.
        let same = materials.get(index).is_some_and(|material| material.name == *name).then_some(index);
        same.or_else(|| materials.iter().position(|material| material.name == *name))
    }

    /// What renders this scene, called `scene`, with `settings` on the command line, on the device that the flags say.
    pub fn command(
        &self,
        scene: &str,
        settings: &Settings,
        device_flags: &str,
        iterations: u32,
        output: &Path,
    ) -> String {
        let read = self.read();
        // So many iterations, however long they take.
        let unlimited = |settings: &Settings| Settings { iterations: None, seconds: None, ..settings.clone() };
        let mut pairs = unlimited(settings).difference(&unlimited(&read));
        if read.seconds.is_some() {
            pairs.push("seconds=".to_owned());
        }
        let mut command = format!("sunfleck render {}", crate::render::quote(scene));
        for pair in pairs {
            command += &format!(" --set {}", crate::render::quote(&pair));
        }
        let output = crate::render::quote(&output.to_string_lossy());
        format!("{command} {device_flags} --iterations {} -o {output}", iterations.max(1))
    }
}

/// A picture to compare with.
#[derive(Clone, Debug)]
pub struct Reference {
    /// For people.
    pub name: String,
    pub picture: Picture,
}

/// Something that happened, for people.
#[derive(Clone, Debug, PartialEq)]
pub enum Message {
    Said(String),
    Warning(String),
    Error(String),
}

/// What the threads share. Locks are held for moments.
#[derive(Default)]
struct Board {
    wanted: Wanted,
    /// To be written.
    saves: Vec<Save>,
    reference: Option<Arc<Reference>>,
    /// Counts choices of a reference, and is the number of the one that is there.
    references: [u64; 2],
    /// Of a picture that the window can show, pixels.
    most_side: Option<usize>,
    quit: bool,
    /// Stages under way, and what they are for.
    work: Option<Work>,
    /// Changes with every restart.
    estimate: u64,
    phase: Phase,
    device: String,
    opened: Option<Arc<Opened>>,
    snapshot: Option<Arc<Snapshot>>,
    painted: Option<Arc<Painted>>,
    history: History,
    messages: Vec<Message>,
}

struct Shared {
    board: Mutex<Board>,
    changed: Condvar,
    wake: Wake,
    /// Whether nobody wants the work under way any more: asked often, so apart from the lock.
    is_unwanted: Arc<AtomicBool>,
    /// How often.
    #[cfg(test)]
    asks: Arc<std::sync::atomic::AtomicU32>,
}

impl Shared {
    fn new(wake: Wake) -> Arc<Self> {
        Arc::new(Self {
            board: Mutex::default(),
            changed: Condvar::new(),
            wake,
            is_unwanted: Arc::default(),
            #[cfg(test)]
            asks: Arc::default(),
        })
    }

    fn board(&self) -> MutexGuard<'_, Board> {
        // Nothing that holds the lock can leave it half changed.
        self.board.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Changes what is shared, and tells everybody.
    fn update<T>(&self, change: impl FnOnce(&mut Board) -> T) -> T {
        let result = change(&mut self.board());
        self.changed.notify_all();
        (self.wake)();
        result
    }

    /// Says what is being done, if that is news.
    fn enter(&self, phase: Phase) {
        if self.board().phase != phase {
            self.update(|board| board.phase = phase);
        }
    }

    /// Ends stages that nobody wants.
    fn interrupt(&self) -> Interrupt {
        let is_unwanted = Arc::clone(&self.is_unwanted);
        #[cfg(test)]
        let asks = Arc::clone(&self.asks);
        Interrupt::when(move || {
            #[cfg(test)]
            asks.fetch_add(1, Ordering::Relaxed);
            is_unwanted.load(Ordering::Relaxed)
        })
    }

    /// Changes what is wanted, and ends what is not.
    fn redirect(&self, change: impl FnOnce(&mut Board)) {
        let mut board = self.board();
        change(&mut board);
        let is_unwanted = board.work.as_ref().is_some_and(|work| board.quit || work.is_unwanted(&board.wanted));
        self.is_unwanted.store(is_unwanted, Ordering::Relaxed);
        self.changed.notify_all();
    }

    /// Notes what nobody needs to look at by itself.
    fn note<T>(&self, change: impl FnOnce(&mut Board) -> T) -> T {
        change(&mut self.board())
    }

    /// Waits until something changes, unless `ready` already.
    fn wait_until(&self, mut ready: impl FnMut(&mut Board) -> bool) -> MutexGuard<'_, Board> {
        let guard = self.board();
        self.changed.wait_while(guard, |board| !board.quit && !ready(board)).unwrap_or_else(PoisonError::into_inner)
    }
}

/// Whether both are the same one, or neither is there.
pub fn is_same<T>(a: Option<&Arc<T>>, b: Option<&Arc<T>>) -> bool {
    match (a, b) {
        (Some(a), Some(b)) => Arc::ptr_eq(a, b),
        (a, b) => a.is_none() && b.is_none(),
    }
}

/// Does `work`; a panic in it becomes an error, one line. What it leaves half done is for the caller to throw away.
pub fn catch<T>(work: impl FnOnce() -> T) -> Result<T, String> {
    catch_unwind(AssertUnwindSafe(work)).map_err(|panic| format!("a bug in sunfleck: {}", panic_text(&*panic)))
}

/// What was panicked with, one line.
pub fn panic_text(panic: &(dyn Any + Send)) -> String {
    let text = panic.downcast_ref::<&str>().copied().or(panic.downcast_ref::<String>().map(String::as_str));
    crate::one_line(text.unwrap_or("panic"))
}

/// What can be seen at a moment.
pub struct Now {
    pub phase: Phase,
    /// The one under way; changes with every restart.
    pub estimate: u64,
    pub device: String,
    pub opened: Option<Arc<Opened>>,
    /// The newest film.
    pub snapshot: Option<Arc<Snapshot>>,
    /// The newest picture of it.
    pub painted: Option<Arc<Painted>>,
    pub reference: Option<Arc<Reference>>,
}

/// The interface's end.
pub struct Engine {
    shared: Arc<Shared>,
    backend: &'static str,
    has_ray_queries: bool,
    device_flags: String,
    threads: Vec<JoinHandle<()>>,
}

impl Engine {
    /// Starts the threads; `wake` is called from them.
    pub fn start(device: Device, wake: Wake) -> std::io::Result<Self> {
        let shared = Shared::new(wake);
        let (backend, has_ray_queries, device_flags) = (device.backend(), device.has_ray_queries(), device.flags());
        let named = |name: &str| std::thread::Builder::new().name(name.to_owned());
        let [render, paint, write] = std::array::from_fn(|_| Arc::clone(&shared));
        let threads = vec![
            named("render").spawn(move || worker::run(&render, device))?,
            named("paint").spawn(move || painting::run(&paint))?,
            named("write").spawn(move || saving::run(&write))?,
        ];
        Ok(Self { shared, backend, has_ray_queries, device_flags, threads })
    }

    /// `cpu` or `gpu`.
    pub fn backend(&self) -> &'static str {
        self.backend
    }

    /// Whether the device can find photons by ray queries.
    pub fn has_ray_queries(&self) -> bool {
        self.has_ray_queries
    }

    /// What chooses the device on the command line.
    pub fn device_flags(&self) -> &str {
        &self.device_flags
    }

    /// Says what is wanted from now on.
    pub fn want(&self, wanted: &Wanted) {
        if self.shared.board().wanted != *wanted {
            self.shared.redirect(|board| board.wanted = wanted.clone());
        }
    }

    /// Writes the newest picture on a thread of its own, as soon as there is one; a message says how it went. Asked again
    /// before it is written, it is written once.
    pub fn save(&self, save: Save) {
        self.shared.redirect(|board| {
            board.saves.retain(|other| other.path != save.path);
            board.saves.push(save);
        });
    }

    /// What other threads ask how many seconds the newest picture has taken.
    pub fn clock(&self) -> impl Fn() -> f64 + Send + Sync + 'static {
        let shared = Arc::clone(&self.shared);
        move || shared.board().snapshot.as_ref().map_or(0.0, |snapshot| snapshot.seconds)
    }

    /// What other threads write what there is with, and come back when that is done: for the end.
    pub fn writer(&self) -> impl Fn(&Save) -> Result<()> + Send + Sync + 'static {
        let shared = Arc::clone(&self.shared);
        move |save| {
            let ready = save.ready(&shared.board()).unwrap_or(Err("there is no picture yet"));
            let snapshot = ready.map_err(Error::msg)?;
            save.write(&snapshot).map(|_| ())
        }
    }

    /// Larger pictures are shown reduced, pixels a side.
    pub fn set_most_side(&self, most_side: usize) {
        self.shared.board().most_side = Some(most_side);
    }

    /// Chooses what errors are measured against, and pictures compared with: it is set when it is there, from any thread, unless
    /// one that was chosen later is there before.
    pub fn choose_reference(&self) -> impl FnOnce(Option<Reference>) + Send + 'static {
        let shared = Arc::clone(&self.shared);
        let number = shared.note(|board| {
            board.references[0] += 1;
            board.references[0]
        });
        move |reference| {
            // Freed here, and not while others wait for the board.
            drop(shared.update(|board| {
                let [_, there] = &mut board.references;
                if number < *there {
                    return None;
                }
                *there = number;
                board.history.against_reference.clear();
                std::mem::replace(&mut board.reference, reference.map(Arc::new))
            }));
        }
    }

    /// What there is.
    pub fn now(&self) -> Now {
        let board = self.shared.board();
        Now {
            phase: board.phase.clone(),
            estimate: board.estimate,
            device: board.device.clone(),
            opened: board.opened.clone(),
            snapshot: board.snapshot.clone(),
            painted: board.painted.clone(),
            reference: board.reference.clone(),
        }
    }

    /// Reads the history.
    pub fn history<T>(&self, read: impl FnOnce(&History) -> T) -> T {
        read(&self.shared.board().history)
    }

    /// What other threads say things with.
    pub fn speaker(&self) -> impl Fn(Message) + Send + 'static {
        let shared = Arc::clone(&self.shared);
        move |message| shared.update(|board| board.messages.push(message))
    }

    /// What has been said since.
    pub fn take_messages(&self) -> Vec<Message> {
        std::mem::take(&mut self.shared.board().messages)
    }
}

impl Drop for Engine {
    /// Waits for a painting under way, and for files that are being written; not for a scene that is being read.
    fn drop(&mut self) {
        self.shared.redirect(|board| board.quit = true);
        for thread in self.threads.drain(..) {
            let _ = thread.join();
        }
    }
}
