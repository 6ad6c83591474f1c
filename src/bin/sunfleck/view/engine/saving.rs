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

use super::{Board, Choice, Frame, Message, Phase, Shared, catch};
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
    pub(super) fn ready(&self, board: &Board) -> Option<Result<Arc<Frame>, &'static str>> {
        if self.scene != board.wanted.scene {
            return Some(Err("its scene was left before there was a picture of it"));
        }
        // What is read again may be another picture.
        let is_of = |frame: &&Arc<Frame>| Some(&frame.opened.choice) == self.scene.as_ref();
        let frame = board.frame.as_ref().filter(is_of).filter(|_| board.phase != Phase::Loading || board.quit);
        let has_failed = matches!(board.phase, Phase::Failed(_));
        match frame.filter(|frame| !frame.is_preview || has_failed) {
            Some(frame) => Some(Ok(Arc::clone(frame))),
            None if has_failed || board.quit || self.scene.is_none() => Some(Err("there is no picture yet")),
            None => None,
        }
    }

    /// Writes a film. Returns the number of its iterations.
    pub fn write(&self, frame: &Frame) -> Result<u32> {
        let (film, machine) = (&frame.film, &frame.machine);
        frame.opened.source.check_not_read(&self.settings, &self.path)?;
        let picture = frame.picture();
        if job::is_png(&self.path) {
            output::png::write(&self.path, &picture, &Look::of(&self.settings))?;
        } else {
            let (opened, flags) = (&frame.opened, &machine.flags);
            let name = &opened.source.name;
            let header = output::exr::Header {
                scene: name.clone(),
                command: opened.command(name, &frame.settings, flags, film.n_iterations, &self.path),
                adapter: machine.device.clone(),
                index: machine.index.clone(),
                accelerator: frame.scene.accelerator().to_string(),
                seconds: frame.seconds,
                camera: frame.camera,
                ..output::exr::Header::of(&frame.params, frame.first_radius, film.n_iterations)
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
        let (save, frame) = {
            let mut board = shared.wait_until(|board| next(board).is_some());
            let Some((i, frame)) = next(&board) else { break };
            (board.saves.remove(i), frame)
        };
        let path = save.path.display();
        let done = match frame {
            Ok(frame) => catch(|| save.write(&frame).map_err(|error| crate::one_line(&crate::chain(&error)))),
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
