//! What renders behind the window, on threads of its own: the interface says what it wants and looks at what there is,
//! and never waits.
//!
//! The render thread compares what is wanted with what it has and does the least that leads there. What was wanted in
//! between is never rendered, so that no queue of camera positions can build up.

mod paint;
mod session;
mod worker;

use std::path::PathBuf;
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;

use glam::Vec3;
use sunfleck::output::Picture;
use sunfleck::output::display::Look;
use sunfleck::ppm::StageTimes;
use sunfleck::scene::load::Loaded;
use sunfleck::scene::settings::Settings;

pub use paint::{Comparison, Insides, Legend, Painted, Painting, Values, View};
pub use session::Frame;

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
    /// Counts requests to read the scene again.
    pub reloads: u32,
    /// In the place of those that the scene was opened with.
    pub settings: Option<Arc<Settings>>,
    /// The camera is moving: quick previews instead of the picture.
    pub moving: bool,
    /// Counts restarts.
    pub restarts: u32,
    pub paused: bool,
    /// Iterations to do though paused: grows by one a step.
    pub steps: u32,
    pub limits: Limits,
    pub painting: Painting,
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
#[derive(Clone, Debug)]
pub struct Opened {
    /// With the settings that it was opened with.
    pub source: Source,
    /// The settings as their file has them.
    pub read: Settings,
    /// As the file has it, before settings.
    pub loaded: Loaded,
}

impl Opened {
    /// Least and greatest corner of the scene as its file has it, metres.
    pub fn bounds(&self) -> [Vec3; 2] {
        self.loaded.scene.bounds()
    }
}

/// One iteration, for the plots.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Record {
    /// From 1.
    pub iteration: u32,
    /// Since the restart, pauses left out.
    pub seconds: f64,
    /// Median over the pixels, metres.
    pub radius: f32,
    pub times: StageTimes,
    pub n_photons: u32,
    pub n_paths: u32,
}

/// An error of a picture, after so many iterations.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Measured {
    pub iteration: u32,
    pub rel_mse: f64,
}

/// All of an estimate's iterations.
#[derive(Clone, Debug, Default)]
pub struct History {
    pub records: Vec<Record>,
    /// From the two halves of the iterations.
    pub estimated: Vec<Measured>,
    /// Against the reference.
    pub against_reference: Vec<Measured>,
}

/// A picture to compare with.
#[derive(Clone, Debug)]
pub struct Reference {
    /// For people.
    pub name: String,
    pub picture: Picture,
}

/// What to write, and where.
#[derive(Clone, Debug, PartialEq)]
pub struct Save {
    /// `.exr` or `.png`.
    pub path: PathBuf,
    pub look: Look,
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
    saves: Vec<Save>,
    reference: Option<Arc<Reference>>,
    quit: bool,
    /// Changes with every restart.
    estimate: u64,
    phase: Phase,
    device: String,
    opened: Option<Arc<Opened>>,
    frame: Option<Arc<Frame>>,
    painted: Option<Arc<Painted>>,
    history: History,
    messages: Vec<Message>,
}

struct Shared {
    board: Mutex<Board>,
    changed: Condvar,
    wake: Wake,
}

impl Shared {
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

    /// Waits until something changes, unless `ready` already.
    fn wait_until(&self, mut ready: impl FnMut(&mut Board) -> bool) -> MutexGuard<'_, Board> {
        let guard = self.board();
        self.changed.wait_while(guard, |board| !board.quit && !ready(board)).unwrap_or_else(PoisonError::into_inner)
    }
}

/// What can be seen at a moment.
pub struct Now {
    pub phase: Phase,
    pub device: String,
    pub opened: Option<Arc<Opened>>,
    /// The newest film.
    pub frame: Option<Arc<Frame>>,
    /// The newest picture of it.
    pub painted: Option<Arc<Painted>>,
    pub reference: Option<Arc<Reference>>,
}

/// The interface's end.
pub struct Engine {
    shared: Arc<Shared>,
    /// What searches the photons: `tree` or `hardware`.
    index: String,
    threads: Vec<JoinHandle<()>>,
}

impl Engine {
    /// Starts the threads; `wake` is called from them.
    pub fn start(device: Device, wake: Wake) -> std::io::Result<Self> {
        let shared = Arc::new(Shared { board: Mutex::default(), changed: Condvar::new(), wake });
        let index = device.index();
        let named = |name: &str| std::thread::Builder::new().name(name.to_owned());
        let (render, paint) = (Arc::clone(&shared), Arc::clone(&shared));
        let threads = vec![
            named("render").spawn(move || worker::run(&render, &device))?,
            named("paint").spawn(move || paint::run(&paint))?,
        ];
        Ok(Self { shared, index, threads })
    }

    /// What searches the photons: `tree` or `hardware`.
    pub fn index(&self) -> &str {
        &self.index
    }

    /// Says what is wanted from now on.
    pub fn want(&self, wanted: &Wanted) {
        let mut board = self.shared.board();
        if board.wanted != *wanted {
            board.wanted = wanted.clone();
            self.shared.changed.notify_all();
        }
    }

    /// Writes the picture as it is, without stopping; a message says how it went.
    pub fn save(&self, save: Save) {
        self.shared.board().saves.push(save);
        self.shared.changed.notify_all();
    }

    /// What errors are measured against, and pictures compared with.
    pub fn set_reference(&self, reference: Option<Arc<Reference>>) {
        let mut board = self.shared.board();
        board.history.against_reference.clear();
        board.reference = reference;
        self.shared.changed.notify_all();
    }

    /// What other threads set it with.
    pub fn referee(&self) -> impl Fn(Reference) + Send + 'static {
        let shared = Arc::clone(&self.shared);
        move |reference| {
            shared.update(|board| {
                board.history.against_reference.clear();
                board.reference = Some(Arc::new(reference));
            });
        }
    }

    /// What there is.
    pub fn now(&self) -> Now {
        let board = self.shared.board();
        Now {
            phase: board.phase.clone(),
            device: board.device.clone(),
            opened: board.opened.clone(),
            frame: board.frame.clone(),
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
    /// Waits for the stage under way, and for files that are being written.
    fn drop(&mut self) {
        self.shared.board().quit = true;
        self.shared.changed.notify_all();
        for thread in self.threads.drain(..) {
            let _ = thread.join();
        }
    }
}
