//! Reading a scene may take long: a thread of its own does it, which nobody waits for once the scene is not wanted any more.

use std::sync::{Arc, Mutex, PoisonError};
use std::thread::{Builder, JoinHandle};

use anyhow::{Result, anyhow};
use glam::Vec3;

use super::{Board, Choice, Opened, Shared, catch};
use crate::scenes::Source;

/// Scenes that are read though they were left, at most: each takes memory.
const MOST_LEFT: usize = 1;

/// The threads that read.
#[derive(Default)]
pub struct Reader {
    left: Vec<JoinHandle<()>>,
}

impl Reader {
    /// Does `read`; none if it `is_left` before that has come to its end.
    pub fn read<T: Send + 'static>(
        &mut self,
        shared: &Arc<Shared>,
        read: impl FnOnce() -> Result<T> + Send + 'static,
        is_left: impl Fn(&Board) -> bool,
    ) -> Result<Option<T>> {
        self.left.retain(|thread| !thread.is_finished());
        if self.left.len() > MOST_LEFT {
            let _ = self.left.remove(0).join();
        }
        let done = Arc::new(Mutex::new(None));
        let take = |done: &Mutex<Option<_>>| done.lock().unwrap_or_else(PoisonError::into_inner).take();
        let (theirs, result) = (Arc::clone(shared), Arc::clone(&done));
        let thread = Builder::new().name("read".to_owned()).spawn(move || {
            let read = catch(read).unwrap_or_else(|panic| Err(anyhow!(panic)));
            *result.lock().unwrap_or_else(PoisonError::into_inner) = Some(read);
            theirs.update(|_| ());
        })?;
        let mut found = None;
        drop(shared.wait_until(|board| {
            found = take(&done);
            found.is_some() || is_left(board)
        }));
        if found.is_none() {
            self.left.push(thread);
        }
        found.transpose()
    }
}

/// Reads a scene and the settings that lie beside it.
pub fn open(choice: &Arc<Choice>) -> Result<Opened> {
    let mut source = Source::resolve(&choice.name)?;
    let read = source.settings.clone();
    source.set(&choice.set)?;
    let mut loaded = source.scene()?;
    source.settings.add_default_camera(&mut loaded.scene);
    let bounds = loaded.scene.bounds(&source.settings.spheres()).unwrap_or([-0.5, 0.5].map(Vec3::splat));
    Ok(Opened { choice: Arc::clone(choice), source, read, loaded, bounds })
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::mpsc::channel;

    #[test]
    fn a_scene_can_be_left_while_it_is_read() {
        let shared = Shared::new(Arc::new(|| {}));
        let mut reader = Reader::default();
        let never = |_: &Board| false;
        assert_eq!(reader.read(&shared, || Ok(7), never).unwrap(), Some(7));
        let missing = reader.read(&shared, || -> Result<()> { anyhow::bail!("no file") }, never).unwrap_err();
        assert_eq!(missing.to_string(), "no file");
        let panic = reader.read(&shared, || -> Result<()> { panic!("ouch") }, never).unwrap_err();
        assert_eq!(panic.to_string(), "a bug in sunfleck: ouch");
        // One that takes for ever, and then others.
        let (hold, held) = channel::<()>();
        assert_eq!(reader.read(&shared, move || Ok(held.recv()?), |_| true).unwrap(), None);
        assert_eq!(reader.read(&shared, || Ok(8), never).unwrap(), Some(8));
        // The window closes.
        let (other, held) = channel::<()>();
        shared.board().quit = true;
        assert_eq!(reader.read(&shared, move || Ok(held.recv()?), never).unwrap(), None);
        drop((hold, other));
    }
}
