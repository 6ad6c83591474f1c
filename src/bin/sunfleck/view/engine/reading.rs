//! Reading a scene may take long: a thread of its own does it, which nobody waits for once the scene is not wanted any more.

use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::Builder;

use anyhow::{Result, anyhow};
use glam::Vec3;
use sunfleck::ppm::Interrupt;
use sunfleck::scene::PackedScene;
use sunfleck::scene::load::Loaded;

use super::{Board, Choice, Opened, Shared, catch};
use crate::cli::InputArgs;
use crate::job;
use crate::scenes::Source;

/// Threads that read, at most, those that were left among them: each holds a scene.
const MOST: usize = 2;

/// Starts threads that read.
#[derive(Default)]
pub struct Reader {
    /// Under way.
    n_reading: Arc<AtomicUsize>,
}

impl Reader {
    /// Does `read`, as soon as there are not too many at it; none if it `is_left` before that has come to its end, or the
    /// window closes, which the interrupt tells it.
    pub fn read<T: Send + 'static>(
        &self,
        shared: &Arc<Shared>,
        read: impl FnOnce(&Interrupt) -> Result<T> + Send + 'static,
        is_left: impl Fn(&Board) -> bool,
    ) -> Result<Option<T>> {
        let is_free = || self.n_reading.load(Ordering::Relaxed) < MOST;
        drop(shared.wait_until(|board| is_free() || is_left(board)));
        if !is_free() {
            return Ok(None);
        }
        let (done, n_reading) = (Arc::new(Mutex::new(None)), Arc::clone(&self.n_reading));
        let (theirs, result) = (Arc::clone(shared), Arc::clone(&done));
        let take = |done: &Mutex<Option<_>>| done.lock().unwrap_or_else(PoisonError::into_inner).take();
        let left = Arc::new(AtomicBool::new(false));
        let is_unwanted = Arc::clone(&left);
        let interrupt = Interrupt::when(move || is_unwanted.load(Ordering::Relaxed));
        // Counted before it begins, lest another begins as well.
        self.n_reading.fetch_add(1, Ordering::Relaxed);
        let started = Builder::new().name("read".to_owned()).spawn(move || {
            let read = catch(|| read(&interrupt)).unwrap_or_else(|panic| Err(anyhow!(panic)));
            // Before somebody takes the result, and begins with the next.
            n_reading.fetch_sub(1, Ordering::Relaxed);
            *result.lock().unwrap_or_else(PoisonError::into_inner) = Some(read);
            drop(result);
            theirs.update(|_| ());
        });
        if let Err(error) = started {
            self.n_reading.fetch_sub(1, Ordering::Relaxed);
            return Err(error.into());
        }
        let mut found = None;
        drop(shared.wait_until(|board| {
            found = take(&done);
            found.is_some() || is_left(board)
        }));
        left.store(found.is_none(), Ordering::Relaxed);
        found.transpose()
    }
}

/// Reads a scene and the settings that lie beside it, and packs it with these, to be rendered `on_host` perhaps.
pub fn open(choice: &Arc<Choice>, on_host: bool, interrupt: &Interrupt) -> Result<(Opened, PackedScene)> {
    let mut source = Source::resolve(&choice.name)?;
    let read = source.settings.clone();
    source.set(&choice.set)?;
    let mut loaded = source.scene_unless(interrupt)?;
    interrupt.check()?;
    let has_camera = !loaded.scene.cameras.is_empty();
    source.settings.add_default_camera(&mut loaded.scene);
    let bounds = loaded.scene.subject_bounds(&source.settings.added_spheres());
    let bounds = bounds.unwrap_or([-0.5, 0.5].map(Vec3::splat));
    let stands_at = loaded.scene.cameras.first().map(|camera| Vec3::from(camera.world_from_camera.translation));
    let is_inside = stands_at.is_some_and(|at| at.clamp(bounds[0], bounds[1]) == at);
    let is_closed = !has_camera && is_inside;
    // Of one that cannot be rendered as it is, nothing: whoever tries is told why.
    let packed = pack(&source, &loaded, on_host, interrupt).unwrap_or_default();
    let read = Mutex::new(Arc::new(read));
    Ok((Opened { choice: Arc::clone(choice), source, read, loaded, bounds, is_closed }, packed))
}

fn pack(source: &Source, loaded: &Loaded, on_host: bool, interrupt: &Interrupt) -> Result<PackedScene> {
    let settings = &source.settings;
    let input = job::prepare(source, settings, loaded.clone(), &InputArgs::default())?;
    job::check_scene_memory(&input.scene)?;
    interrupt.check()?;
    let packed = PackedScene::new(&input.scene);
    interrupt.check()?;
    Ok(packed.accelerated(settings.accel.filter(|_| on_host).unwrap_or_default())?)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::mpsc::channel;

    #[test]
    fn a_scene_can_be_left_while_it_is_read() {
        let shared = Shared::new(Arc::new(|| {}));
        let reader = Reader::default();
        let never = |_: &Board| false;
        assert_eq!(reader.read(&shared, |_| Ok(7), never).unwrap(), Some(7));
        let missing = reader.read(&shared, |_| -> Result<()> { anyhow::bail!("no file") }, never).unwrap_err();
        assert_eq!(missing.to_string(), "no file");
        let panic = reader.read(&shared, |_| -> Result<()> { panic!("ouch") }, never).unwrap_err();
        assert_eq!(panic.to_string(), "a bug in sunfleck: ouch");
        // One that takes for ever, and then others.
        let (end, forever) = channel::<()>();
        assert_eq!(reader.read(&shared, move |_| Ok(forever.recv()?), |_| true).unwrap(), None);
        assert_eq!(reader.read(&shared, |_| Ok(8), never).unwrap(), Some(8));
        // Two of them: the next one waits, and can be left, until one ends; and the window can be closed.
        let (other, forever) = channel::<()>();
        assert_eq!(reader.read(&shared, move |_| Ok(forever.recv()?), |_| true).unwrap(), None);
        assert_eq!(reader.read(&shared, |_| Ok(9), |_| true).unwrap(), None);
        end.send(()).unwrap();
        assert_eq!(reader.read(&shared, |_| Ok(9), never).unwrap(), Some(9));
        let (another, forever) = channel::<()>();
        assert_eq!(reader.read(&shared, move |_| Ok(forever.recv()?), |_| true).unwrap(), None);
        shared.board().quit = true;
        assert_eq!(reader.read(&shared, |_| Ok(10), never).unwrap(), None);
        drop((other, another));
    }

    #[test]
    fn what_is_left_is_told() {
        let (shared, reader) = (Shared::new(Arc::new(|| {})), Reader::default());
        let (tell, told) = channel();
        let read = move |interrupt: &Interrupt| {
            while interrupt.check().is_ok() {
                std::thread::yield_now();
            }
            Ok(tell.send(())?)
        };
        assert_eq!(reader.read(&shared, read, |_| true).unwrap(), None);
        told.recv().unwrap();
    }
}
