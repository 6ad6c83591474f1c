//! The paint thread: from the newest film to what the window shows.

use std::sync::Arc;

use super::{Board, Frame, Shared};
use sunfleck::output::png::Look;

/// What is shown of a film.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub enum View {
    #[default]
    Picture,
}

/// A picture for the window.
#[derive(Debug)]
pub struct Painted {
    /// Pixels.
    pub size: [usize; 2],
    /// sRGB-encoded, opaque, row-major.
    pub rgba: Vec<u8>,
    /// What it was made from.
    pub frame: Arc<Frame>,
    pub look: Look,
    pub view: View,
    /// Stops; found automatically if the look has none.
    pub exposure: f32,
}

/// Until the interface is gone.
pub fn run(shared: &Shared) {
    loop {
        let (frame, look, view) = {
            let board = shared.wait_until(|board| board.frame.as_ref().is_some_and(|frame| !is_painted(board, frame)));
            if board.quit {
                break;
            }
            let Some(frame) = board.frame.clone() else { continue };
            (frame, board.wanted.look, board.wanted.view)
        };
        let painted = Arc::new(paint(frame, look, view));
        shared.update(|board| board.painted = Some(painted));
    }
}

fn is_painted(board: &Board, frame: &Arc<Frame>) -> bool {
    board.painted.as_ref().is_some_and(|painted| {
        Arc::ptr_eq(&painted.frame, frame)
            && (painted.look, painted.view) == (board.wanted.look, board.wanted.view)
    })
}

fn paint(frame: Arc<Frame>, look: Look, view: View) -> Painted {
    todo!()
}
