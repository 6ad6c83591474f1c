//! The paint thread: it paints the newest film as it is wanted now.
//!
//! It has threads of its own, or a slow iteration would keep a change of exposure waiting. Of films that are but newer it
//! paints no more than leaves the processor half of the time. What it painted is dropped here, too: memory of a large film
//! takes longer to give back than a frame of the window may last.

use std::sync::atomic::Ordering;
use std::sync::{Arc, PoisonError};
use std::time::{Duration, Instant};

use super::paint::{Painted, Painter, Painting, fitting};
use super::{Board, Measured, Message, Phase, Reference, Shared, Snapshot, catch, is_same};

/// Between looks whether a picture is used by nobody any more.
const LOOK_EVERY: Duration = Duration::from_millis(100);

/// Until the interface is gone.
pub fn run(shared: &Shared) {
    let n_threads = (rayon::current_num_threads() / 2).max(1);
    let pool = rayon::ThreadPoolBuilder::new().num_threads(n_threads).build();
    let mut state = State::default();
    while let Some(next) = wait(shared, &mut state) {
        let task = match next {
            Next::Drop(left) => {
                drop(left);
                continue;
            }
            Next::Forget => {
                (state.painter, state.failed) = (Painter::default(), None);
                continue;
            }
            Next::Paint(task) => task,
        };
        task.snapshot.is_taken.store(true, Ordering::Relaxed);
        let (began, painter) = (Instant::now(), &mut state.painter);
        let mut work = || {
            let (estimated, figures) = painter.measure(&task.snapshot, task.reference.as_ref());
            let mut painted = painter.paint(&task.snapshot, task.reference.clone(), task.painting);
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
        state.rested = Some(Instant::now() + began.elapsed());
        match done {
            Ok((painted, estimated)) => {
                state.painted.push(Arc::clone(&painted));
                shared.update(|board| publish(board, &task, painted, estimated));
            }
            Err(error) => {
                state.painter = Painter::default();
                shared.update(|board| board.messages.push(Message::Error(format!("cannot show the picture: {error}"))));
                state.failed = Some(task);
            }
        }
    }
}

#[derive(Default)]
struct State {
    painter: Painter,
    /// What could not be painted is not tried again.
    failed: Option<Task>,
    /// All that somebody may still use, so that nobody else is the last to.
    painted: Vec<Arc<Painted>>,
    /// When it has rested as long as it worked last.
    rested: Option<Instant>,
}

enum Next {
    Paint(Task),
    /// There is nothing to paint: what is kept is of a scene that was left.
    Forget,
    /// What nobody uses any more.
    Drop(Vec<Arc<Painted>>),
}

impl State {
    /// Or until when there is nothing to do, unless something changes.
    fn next(&mut self, board: &Board) -> Result<Next, Option<Instant>> {
        let now = Instant::now();
        let left: Vec<_> = self.painted.extract_if(.., |painted| Arc::strong_count(painted) == 1).collect();
        if !left.is_empty() {
            return Ok(Next::Drop(left));
        }
        // The one that is shown has others that use it.
        let look = (self.painted.len() > usize::from(board.painted.is_some())).then(|| now + LOOK_EVERY);
        match Task::of(board) {
            None if !self.painter.is_empty() || self.failed.is_some() => Ok(Next::Forget),
            Some(task) if !task.is_painted(board) && self.failed.as_ref().is_none_or(|failed| !failed.is(&task)) => {
                match self.rested.filter(|&rested| rested > now && task.is_but_newer(board)) {
                    Some(rested) => Err(Some(look.map_or(rested, |look| look.min(rested)))),
                    None => Ok(Next::Paint(task)),
                }
            }
            _ => Err(look),
        }
    }
}

/// What to do next; nothing if the interface is gone.
fn wait(shared: &Shared, state: &mut State) -> Option<Next> {
    let mut board = shared.board();
    while !board.quit {
        board = match state.next(&board) {
            Ok(next) => return Some(next),
            Err(None) => shared.changed.wait(board).unwrap_or_else(PoisonError::into_inner),
            Err(Some(until)) => {
                let time = until.saturating_duration_since(Instant::now());
                shared.changed.wait_timeout(board, time).unwrap_or_else(PoisonError::into_inner).0
            }
        };
    }
    None
}

/// What is to be painted.
struct Task {
    snapshot: Arc<Snapshot>,
    reference: Option<Arc<Reference>>,
    painting: Painting,
    most_side: Option<usize>,
}

impl Task {
    fn of(board: &Board) -> Option<Self> {
        Some(Self {
            snapshot: board.snapshot.clone()?,
            reference: board.reference.clone(),
            painting: board.wanted.painting,
            most_side: board.most_side,
        })
    }

    fn is(&self, other: &Self) -> bool {
        Arc::ptr_eq(&self.snapshot, &other.snapshot)
            && self.painting == other.painting
            && is_same(self.reference.as_ref(), other.reference.as_ref())
    }

    /// Whether `painted` is of something like it: as it is wanted, beside the reference that is wanted.
    fn is_like(&self, painted: &Painted) -> bool {
        let reference = painted.reference.as_ref().map(|(reference, _)| reference);
        painted.painting == self.painting && is_same(reference, fitting(self.reference.as_ref(), &self.snapshot))
    }

    fn is_painted(&self, board: &Board) -> bool {
        let is_it = |painted: &Arc<Painted>| Arc::ptr_eq(&painted.snapshot, &self.snapshot) && self.is_like(painted);
        board.painted.as_ref().is_some_and(is_it)
    }

    /// Whether it has nothing that is waited for: the film of more iterations of what is shown, and not the last.
    fn is_but_newer(&self, board: &Board) -> bool {
        let is_older = |painted: &Arc<Painted>| {
            let (before, now) = (&painted.snapshot, &self.snapshot);
            before.estimate == now.estimate && before.has() == now.has() && self.is_like(painted)
        };
        board.phase == Phase::Rendering && board.painted.as_ref().is_some_and(is_older)
    }
}

/// Shows what was painted, and notes the errors of its film: estimated, and against the reference.
fn publish(board: &mut Board, task: &Task, painted: Arc<Painted>, estimated: Option<f64>) {
    let figures = painted.figures;
    let snapshot = &task.snapshot;
    // Or the scene was left.
    if board.snapshot.as_ref().is_some_and(|now| Arc::ptr_eq(&now.opened, &snapshot.opened)) {
        board.painted = Some(painted);
    }
    if snapshot.estimate != board.estimate || snapshot.is_preview {
        return;
    }
    let (iteration, seconds) = (snapshot.film.n_iterations, snapshot.seconds);
    let point = |rel_mse, trimmed| Measured { iteration, seconds, rel_mse, trimmed };
    if let Some(rel_mse) = estimated {
        board.history.estimated.push(point(rel_mse, None));
    }
    // Another reference may have been set in the meantime.
    if let Some(figures) = figures.filter(|_| is_same(task.reference.as_ref(), board.reference.as_ref())) {
        board.history.against_reference.push(point(figures.rel_mse, Some(figures.rel_mse_trimmed)));
    }
}

#[cfg(test)]
mod tests {
    use eframe::egui::ColorImage;
    use sunfleck::output::difference::Measure;
    use sunfleck::output::display;
    use sunfleck::output::false_colour::NOT_FINITE;
    use sunfleck::output::tonemap::ToneMap;
    use sunfleck::ppm::Interrupt;

    use super::super::paint::{Comparison, Needs, View};
    use super::super::session::tests::session;
    use super::*;

    /// Of the first iterations, and the first of them painted.
    fn snapshots() -> ([Arc<Snapshot>; 3], Arc<Painted>) {
        let mut session = session(Interrupt::default());
        let snapshots = std::array::from_fn(|_| {
            session.iterate().unwrap();
            Arc::new(session.snapshot().unwrap())
        });
        let painted = Painter::default().paint(&snapshots[0], None, Painting::default());
        (snapshots, Arc::new(painted))
    }

    fn board(snapshot: &Arc<Snapshot>, painted: &Arc<Painted>) -> Board {
        Board {
            snapshot: Some(Arc::clone(snapshot)),
            painted: Some(Arc::clone(painted)),
            phase: Phase::Rendering,
            ..Board::default()
        }
    }

    #[test]
    fn a_newer_film_waits_and_what_is_asked_for_does_not() {
        let ([first, second, third], painted) = snapshots();
        let mut state = State { rested: Some(Instant::now() + Duration::from_secs(3600)), ..State::default() };
        let mut paints = |board: &Board| matches!(state.next(board), Ok(Next::Paint(_)));
        assert!(!paints(&board(&first, &painted)));
        assert!(!paints(&board(&second, &painted)));
        let mut asked = board(&second, &painted);
        asked.wanted.painting.look.exposure = Some(1.0);
        assert!(paints(&asked));
        asked = board(&second, &painted);
        asked.reference = Some(Arc::new(Reference { name: String::new(), picture: first.picture() }));
        assert!(paints(&asked));
        asked = board(&second, &painted);
        asked.phase = Phase::Paused;
        assert!(paints(&asked));
        let restarted = Snapshot { estimate: 2, ..Snapshot::clone(&third) };
        assert!(paints(&board(&Arc::new(restarted), &painted)));
        let looked_into = Snapshot { insides: Some(Arc::default()), ..Snapshot::clone(&third) };
        assert!(paints(&board(&Arc::new(looked_into), &painted)));
        state.rested = Some(Instant::now());
        assert!(matches!(state.next(&board(&second, &painted)), Ok(Next::Paint(_))));
    }

    #[test]
    fn what_was_painted_is_dropped_by_who_painted_it() {
        let ([first, second, _], shown) = snapshots();
        let mut state = State { painted: vec![Arc::clone(&shown)], ..State::default() };
        let mut board = board(&first, &shown);
        assert!(matches!(state.next(&board), Err(None)));
        // The window still shows it, and does not say when it no longer does.
        let newer = Arc::new(Painter::default().paint(&second, None, Painting::default()));
        (board.snapshot, board.painted) = (Some(second), Some(Arc::clone(&newer)));
        state.painted.push(newer);
        assert!(matches!(state.next(&board), Err(Some(_))));
        drop(shown);
        assert!(matches!(state.next(&board), Ok(Next::Drop(left)) if left.len() == 1));
        assert!(matches!(state.next(&board), Err(None)));
        // Of a scene that is left, too.
        (board.snapshot, board.painted) = (None, None);
        assert!(matches!(state.next(&board), Ok(Next::Drop(left)) if left.len() == 1));
        assert!(matches!(state.next(&board), Err(None)));
    }

    #[test]
    fn a_reference_is_made_again_only_to_be_shown_otherwise() {
        let ([first, second, _], _) = snapshots();
        let reference = Arc::new(Reference { name: String::new(), picture: first.picture() });
        let mut painter = Painter::default();
        let mut painting = Painting::default();
        painting.look.exposure = Some(0.0);
        let mut image_of = |snapshot, painting| {
            let painted = painter.paint(snapshot, Some(Arc::clone(&reference)), painting);
            painted.reference.unwrap().1
        };
        let image = image_of(&first, painting);
        let wiped = Painting { comparison: Comparison::Wipe, view: View::Albedo, ..painting };
        assert!(Arc::ptr_eq(&image, &image_of(&second, wiped)));
        let stops = image_of(&second, Painting { view: View::Stops, ..painting });
        assert!(image.pixels != stops.pixels);
        painting.look.exposure = Some(1.0);
        let brighter = image_of(&second, painting);
        assert!(image.pixels != brighter.pixels);
        // As if made for the first time.
        let painted = Painter::default().paint(&second, Some(Arc::clone(&reference)), painting);
        assert!(painted.reference.unwrap().1 == brighter);
    }

    #[test]
    fn previews_flicker_less_than_their_light() {
        let ([first, ..], _) = snapshots();
        let lit = |stops: f32, is_preview| {
            let mut film = first.film.as_ref().clone();
            film.pixels.iter_mut().flatten().for_each(|c| *c *= stops.exp2());
            Arc::new(Snapshot { film: Arc::new(film), is_preview, ..Snapshot::clone(&first) })
        };
        let mut painter = Painter::default();
        let mut exposure =
            |stops, is_preview| painter.paint(&lit(stops, is_preview), None, Painting::default()).exposure;
        let own = exposure(0.0, false);
        for (stops, is_preview, shown) in [
            (0.1, true, 0.0),
            (-0.2, true, 0.0),
            (1.0, true, -0.75),
            (0.9, true, -0.75),
            (0.9, false, -0.9),
            (-2.0, true, 1.75),
        ] {
            let off = exposure(stops, is_preview) - own - shown;
            assert!(off.abs() < 1e-3, "{stops} {is_preview}: {off}");
        }
        // Given, it is what is given, and no preview begins there.
        let painting =
            Painting { look: display::Look { exposure: Some(3.0), ..Default::default() }, ..Painting::default() };
        assert_eq!(painter.paint(&lit(0.0, true), None, painting).exposure, 3.0);
        let off = painter.paint(&lit(-2.0, true), None, Painting::default()).exposure - own - 1.75;
        assert!(off.abs() < 1e-3, "{off}");
    }

    #[test]
    fn a_difference_ends_where_it_is_told_to() {
        let ([first, second, _], _) = snapshots();
        let mut picture = first.picture();
        let n = picture.rgb.len();
        picture.rgb[..n / 4].fill([1e30; 3]);
        let reference = Arc::new(Reference { name: String::new(), picture });
        for measure in Measure::ALL {
            let mut painting = Painting { comparison: Comparison::Difference(measure), ..Painting::default() };
            let paint = |painting| Painter::default().paint(&second, Some(Arc::clone(&reference)), painting);
            let least = if measure == Measure::Signed { -1.0 } else { 0.0 };
            let automatic = paint(painting);
            let [low, high] = automatic.legend.as_ref().unwrap().range;
            assert!(high > 0.0 && high < 100.0 && low == least * high, "{measure:?} {low} {high}");
            // What is beside the block is seen.
            assert!(automatic.image.pixels[n / 4..].iter().any(|c| c.r().max(c.g()).max(c.b()) > 100), "{measure:?}");
            painting.ends[measure as usize] = Some(0.37);
            let given = paint(painting);
            assert_eq!(given.legend.as_ref().unwrap().range, [least * 0.37, 0.37], "{measure:?}");
            assert!(given.image.pixels != automatic.image.pixels, "{measure:?}");
            // That of another is none of its own.
            painting.ends = [Some(0.37); Measure::ALL.len()];
            painting.ends[measure as usize] = None;
            assert!(paint(painting).image.pixels == automatic.image.pixels, "{measure:?}");
        }
    }

    /// In the window alone, and wherever it shows the picture or the reference.
    #[test]
    fn what_is_not_finite_is_marked() {
        let ([first, ..], _) = snapshots();
        let mut film = first.film.as_ref().clone();
        film.pixels[3][0] = f32::INFINITY;
        film.pixels[4][2] = f32::NAN;
        let snapshot = Arc::new(Snapshot { film: Arc::new(film), ..Snapshot::clone(&first) });
        let mut picture = first.picture();
        picture.rgb[5] = [f32::NEG_INFINITY, 0.0, 0.0];
        let reference = Arc::new(Reference { name: String::new(), picture });
        let marked = |image: &ColorImage| -> Vec<usize> {
            (0..image.pixels.len()).filter(|&i| image.pixels[i].to_array() == NOT_FINITE).collect()
        };
        // Those of a kind of light are the picture until an iteration is looked into.
        for view in [View::Picture, View::Stops, View::Direct] {
            let painting = Painting { view, comparison: Comparison::Wipe, ..Painting::default() };
            let painted = Painter::default().paint(&snapshot, Some(Arc::clone(&reference)), painting);
            assert_eq!(marked(&painted.image), [3, 4], "{view:?}");
            assert_eq!(marked(&painted.reference.as_ref().unwrap().1), [5], "{view:?}");
        }
        for comparison in Measure::ALL.map(Comparison::Difference).into_iter().chain([Comparison::Flip]) {
            let painting = Painting { comparison, ..Painting::default() };
            let painted = Painter::default().paint(&snapshot, Some(Arc::clone(&reference)), painting);
            assert_eq!(marked(&painted.image), [3, 4, 5], "{comparison:?}");
        }
        // Not what is written.
        let mut bytes = vec![];
        display::rgb8(&snapshot.picture(), 0.0, ToneMap::Srgb, &mut bytes);
        assert!(bytes.chunks_exact(3).all(|rgb| rgb != &NOT_FINITE[..3]));
    }

    #[test]
    fn a_view_behind_a_difference_needs_nothing() {
        let ([first, second, _], painted) = snapshots();
        let reference = Arc::new(Reference { name: String::new(), picture: first.picture() });
        let mut board = board(&second, &painted);
        let painting = Painting {
            view: View::Caustic,
            comparison: Comparison::Difference(Measure::Absolute),
            ..Painting::default()
        };
        board.wanted.painting = painting;
        let split = Needs { split: true, ..Needs::default() };
        assert_eq!(board.needs(), split);
        let difference = Arc::new(Painter::default().paint(&second, Some(reference), painting));
        assert!(!difference.lacks());
        board.painted = Some(difference);
        assert_eq!(board.needs(), Needs::default());
        board.wanted.painting.comparison = Comparison::Wipe;
        assert_eq!(board.needs(), split);
        // One that cannot be shown, as no reference is there, hides nothing.
        let view = Painter::default().paint(&second, None, painting);
        assert!(view.lacks());
    }
}
