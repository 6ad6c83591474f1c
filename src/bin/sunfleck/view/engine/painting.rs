//! The paint thread: it paints the newest film as it is wanted now.
//!
//! It has threads of its own, or a slow iteration would keep a change of exposure waiting.

use std::sync::Arc;

use super::paint::{Painted, Painter, Painting, fitting};
use super::{Board, Frame, Measured, Message, Reference, Shared, catch, is_same};

/// Until the interface is gone.
pub fn run(shared: &Shared) {
    let n_threads = (rayon::current_num_threads() / 2).max(1);
    let pool = rayon::ThreadPoolBuilder::new().num_threads(n_threads).build();
    let mut painter = Painter::default();
    // What could not be painted is not tried again.
    let mut failed: Option<Task> = None;
    loop {
        let task = {
            let board = shared.wait_until(|board| match &board.frame {
                Some(frame) => !is_painted(board, frame) && failed.as_ref().is_none_or(|task| !task.is_of(board)),
                None => !painter.is_empty() || failed.is_some(),
            });
            if board.quit {
                break;
            }
            Task::of(&board)
        };
        let Some(task) = task else {
            (painter, failed) = (Painter::default(), None);
            continue;
        };
        let mut work = || {
            let (estimated, figures) = painter.measure(&task.frame, task.reference.as_ref());
            let mut painted = painter.paint(&task.frame, task.reference.clone(), task.painting);
            match figures {
                Some(Ok(figures)) => painted.figures = Some(figures),
                Some(Err(why)) => painted.problem = Some(why),
                None => {}
            }
            painted.reduce(task.most_side);
            (Arc::new(painted), estimated)
        };
        let done = catch(|| match &pool {
            Ok(pool) => pool.install(&mut work),
            Err(_) => work(), // Without a pool of its own it takes the common one.
        });
        match done {
            Ok((painted, estimated)) => shared.update(|board| publish(board, &task, painted, estimated)),
            Err(error) => {
                painter = Painter::default();
                shared.update(|board| board.messages.push(Message::Error(format!("cannot show the picture: {error}"))));
                failed = Some(task);
            }
        }
    }
}

/// What is to be painted.
struct Task {
    frame: Arc<Frame>,
    reference: Option<Arc<Reference>>,
    painting: Painting,
    most_side: Option<usize>,
}

impl Task {
    fn of(board: &Board) -> Option<Self> {
        Some(Self {
            frame: board.frame.clone()?,
            reference: board.reference.clone(),
            painting: board.wanted.painting,
            most_side: board.most_side,
        })
    }

    fn is_of(&self, board: &Board) -> bool {
        board.frame.as_ref().is_some_and(|frame| Arc::ptr_eq(frame, &self.frame))
            && self.painting == board.wanted.painting
            && is_same(self.reference.as_ref(), board.reference.as_ref())
    }
}

/// Shows what was painted, and notes the errors of its film: estimated, and against the reference.
fn publish(board: &mut Board, task: &Task, painted: Arc<Painted>, estimated: Option<f64>) {
    let figures = painted.figures;
    let frame = &task.frame;
    if board.frame.is_some() {
        board.painted = Some(painted);
    }
    if frame.estimate != board.estimate || frame.is_preview {
        return;
    }
    let (iteration, seconds) = (frame.film.n_iterations, frame.seconds);
    let point = |rel_mse, trimmed| Measured { iteration, seconds, rel_mse, trimmed };
    if let Some(rel_mse) = estimated {
        board.history.estimated.push(point(rel_mse, None));
    }
    // Another reference may have been set in the meantime.
    if let Some(figures) = figures.filter(|_| is_same(task.reference.as_ref(), board.reference.as_ref())) {
        board.history.against_reference.push(point(figures.rel_mse, Some(figures.rel_mse_trimmed)));
    }
}

fn is_painted(board: &Board, frame: &Arc<Frame>) -> bool {
    board.painted.as_ref().is_some_and(|painted| {
        Arc::ptr_eq(&painted.frame, frame)
            && painted.painting == board.wanted.painting
            && is_same(painted.reference.as_ref().map(|r| &r.0), fitting(board.reference.as_ref(), frame))
    })
}
