//! The write thread: pictures on their way to files.
//!
//! It waits for no iteration, and holds none up. While the camera moves there are but previews: the picture is written when
//! there is one.

use std::path::PathBuf;
use std::sync::Arc;

use anyhow::Result;
use sunfleck::output;
use sunfleck::output::display::Look;
use sunfleck::scene::settings::Settings;

use super::{Board, Choice, Message, Phase, Shared, Snapshot, catch};
use crate::{job, progress};

/// What to write, and where.
#[derive(Clone, Debug, PartialEq)]
pub struct Save {
    /// `.exr` or `.png`.
    pub path: PathBuf,
    /// As they are now, perhaps not of the film yet.
    pub settings: Arc<Settings>,
    /// Whose picture it is.
    pub scene: Option<Arc<Choice>>,
}

impl Save {
    /// What is to be written, or why nothing is; none as long as that is to be seen.
    pub(super) fn ready(&self, board: &Board) -> Option<Result<Arc<Snapshot>, &'static str>> {
        if self.scene != board.wanted.scene {
            return Some(Err("its scene was left before there was a picture of it"));
        }
        // What is read again may be another picture.
        let is_of = |snapshot: &&Arc<Snapshot>| Some(&snapshot.opened.choice) == self.scene.as_ref();
        let snapshot = board.snapshot.as_ref().filter(is_of).filter(|_| board.phase != Phase::Loading || board.quit);
        let has_failed = matches!(board.phase, Phase::Failed(_));
        match snapshot.filter(|snapshot| !snapshot.is_preview) {
            Some(snapshot) => Some(Ok(Arc::clone(snapshot))),
            None if has_failed || board.quit || self.scene.is_none() => Some(Err("there is no picture yet")),
            None => None,
        }
    }

    /// Writes a film. Returns the number of its iterations.
    pub fn write(&self, snapshot: &Snapshot) -> Result<u32> {
        let (film, machine) = (&snapshot.film, &snapshot.machine);
        snapshot.opened.source.check_not_read(&self.settings, &self.path)?;
        let picture = snapshot.picture();
        if job::is_png(&self.path) {
            output::png::write(&self.path, &picture, &Look::of(&self.settings))?;
        } else {
            let (opened, flags) = (&snapshot.opened, &machine.flags);
            let name = &opened.source.name;
            let header = output::exr::Header {
                scene: name.clone(),
                command: opened.command(name, &snapshot.settings, flags, film.n_iterations, &self.path),
                adapter: machine.device.clone(),
                index: machine.index.clone(),
                accelerator: snapshot.scene.accelerator().to_string(),
                seconds: snapshot.seconds,
                camera: snapshot.camera,
                ..output::exr::Header::of(&snapshot.params, snapshot.first_radius, film.n_iterations)
            };
            output::exr::write(&self.path, &picture, &header)?;
        }
        Ok(film.n_iterations)
    }
}

/// Until the interface is gone and all is written.
pub fn run(shared: &Shared) {
    let next = |board: &Board| {
        let mut saves = board.saves.iter().enumerate();
        saves.find_map(|(i, save)| Some((i, save.ready(board)?)))
    };
    loop {
        let (save, snapshot) = {
            let mut board = shared.wait_until(|board| next(board).is_some());
            let Some((i, snapshot)) = next(&board) else { break };
            (board.saves.remove(i), snapshot)
        };
        let path = save.path.display();
        let done = match snapshot {
            Ok(snapshot) => catch(|| save.write(&snapshot).map_err(|error| crate::one_line(&crate::chain(&error)))),
            Err(why) => Ok(Err(format!("{path} was not written: {why}"))),
        };
        let message = match done.flatten() {
            Ok(n) => Message::Said(format!("saved {path} after {}", progress::iterations(n))),
            Err(error) => Message::Error(error),
        };
        shared.update(|board| match message {
            // There is no window any more to tell it in.
            Message::Error(error) if board.quit => crate::say_error(&error),
            message => board.messages.push(message),
        });
    }
}
