//! The render thread.

use std::sync::Arc;

use anyhow::{Context as _, Result};
use sunfleck::layout;
use sunfleck::ppm::{Error, Params};
use sunfleck::scene::settings::{Index, Settings};
use sunfleck::scene::{Accelerator, PackedScene, Scene};

use super::reading::{self, Reader};
use super::session::Session;
use super::{Board, Message, Opened, Phase, Shared, Wanted, catch, is_same};
use crate::cli::InputArgs;
use crate::devices::Device;
use crate::job;

/// What the render thread has of what is wanted.
#[derive(Default)]
struct Have {
    wanted: Wanted,
    reader: Reader,
    session: Option<Session>,
    opened: Option<Arc<Opened>>,
    /// That scene, for the next session of it; empty while there is one.
    packed: Arc<PackedScene>,
    estimate: u64,
    steps_done: u32,
}

/// What stages under way are for.
pub struct Work {
    wanted: Wanted,
    opened: Arc<Opened>,
    /// To the end, unless the scene is left.
    keep_on: bool,
}

impl Work {
    /// Whether what is wanted `now` makes it pointless.
    pub fn is_unwanted(&self, now: &Wanted) -> bool {
        is_other_scene(&self.wanted, now) || !self.keep_on && is_other_estimate(&self.opened, &self.wanted, now)
    }
}

/// Until the interface is gone.
pub fn run(shared: &Arc<Shared>, mut device: Device) {
    let mut have = Have::default();
    loop {
        let wanted = {
            let board = shared.wait_until(|board| {
                have.is_behind(&board.wanted)
                    || have.can_go_on(&board.wanted, board.noise())
                    || have.should_show(board)
                    || have.should_say(board)
            });
            if board.quit {
                break;
            }
            board.wanted.clone()
        };
        let done =
            catch(|| have.follow(shared, &mut device, &wanted).map_err(|error| crate::one_line(&crate::chain(&error))));
        if let Err(error) = done.flatten() {
            have.fail(shared, error);
        }
    }
}

impl Board {
    fn noise(&self) -> Option<f64> {
        self.history.estimated.last().map(|measured| measured.rel_mse)
    }
}

impl Have {
    /// Whether what is wanted calls for more than going on.
    fn is_behind(&self, wanted: &Wanted) -> bool {
        is_other_scene(&self.wanted, wanted) || self.wanted.retries != wanted.retries || self.is_stale(wanted)
    }

    /// Whether the estimate under way is not the one wanted.
    fn is_stale(&self, wanted: &Wanted) -> bool {
        self.opened.as_ref().is_some_and(|opened| is_other_estimate(opened, &self.wanted, wanted))
    }

    fn can_go_on(&self, wanted: &Wanted, noise: Option<f64>) -> bool {
        let Some(session) = &self.session else { return false };
        match wanted.paused {
            true => self.steps_done < wanted.steps || session.n_iterations == 0,
            false => !session.is_done(wanted, noise),
        }
    }

    /// Whether there is nothing to do but to show what there is.
    fn should_show(&self, board: &Board) -> bool {
        self.session.as_ref().is_some_and(|session| session.owes(board.needs()))
    }

    /// Whether it rests without having said so: a limit was reached, or a pause asked for, after the last film was shown.
    fn should_say(&self, board: &Board) -> bool {
        self.session.is_some() && !self.can_go_on(&board.wanted, board.noise()) && board.phase != resting(&board.wanted)
    }

    /// Does one thing that leads towards what is wanted.
    fn follow(&mut self, shared: &Arc<Shared>, device: &mut Device, wanted: &Wanted) -> Result<()> {
        let is_retry = self.wanted.retries != wanted.retries && self.session.is_none() && wanted.scene.is_some();
        let reads = is_other_scene(&self.wanted, wanted) || is_retry && self.opened.is_none();
        let is_stale = self.is_stale(wanted);
        let before = std::mem::replace(&mut self.wanted, wanted.clone());
        if reads {
            // The memory of the device first; of a scene that is read again the picture stays, for the file may be broken.
            let opened_before = self.opened.take();
            (self.session, self.packed) = (None, Arc::default());
            let stays = wanted.reads_again && before.scene == wanted.scene;
            // Freed here, and not while others wait for the board.
            drop(shared.update(|board| {
                board.phase = if wanted.scene.is_some() { Phase::Loading } else { Phase::Empty };
                (!stays).then(|| (board.opened.take(), board.snapshot.take(), board.painted.take()))
            }));
            let Some(choice) = wanted.scene.clone() else { return Ok(()) };
            let is_left = |board: &Board| is_other_scene(wanted, &board.wanted);
            let on_host = device.backend() == "cpu";
            let read = move |interrupt: &_| reading::open(&choice, on_host, interrupt);
            let Some((opened, packed)) = self.reader.read(shared, read, is_left)? else {
                return Ok(());
            };
            let opened = Arc::new(opened);
            self.packed = Arc::new(packed);
            self.opened = Some(Arc::clone(&opened));
            // As the interface will, when it sees the file.
            let mut wanted = wanted.clone();
            if let (Some(edited), Some(before), true) = (&mut wanted.settings, opened_before, wanted.reads_again) {
                *edited = Arc::new(edited.rebased(&before.source.settings, &opened.source.settings));
            }
            self.wanted = wanted.clone();
            drop(shared.update(|board| {
                board.messages.extend(device.cannot(&opened.source).into_iter().map(Message::Warning));
                board.wanted.settings.clone_from(&wanted.settings);
                (board.opened.replace(opened), board.snapshot.take(), board.painted.take())
            }));
            return self.prepare(shared, device, &wanted);
        }
        if is_stale || is_retry {
            let same = self.opened.as_ref().is_some_and(|opened| is_rendered_alike(opened, &before, wanted));
            return match same && self.session.is_some() {
                true => self.restart(shared, wanted),
                false => self.prepare(shared, device, wanted),
            };
        }
        let noise = shared.board().noise();
        match self.can_go_on(wanted, noise) {
            true => self.iterate(shared, wanted),
            false => self.show(shared, wanted, true),
        }
    }

    /// Whether nobody wants the scene any more.
    fn is_left(&self, board: &Board) -> bool {
        board.quit || is_other_scene(&self.wanted, &board.wanted)
    }

    /// Applies the settings, as far as possible to the scene that the device has.
    fn prepare(&mut self, shared: &Shared, device: &mut Device, wanted: &Wanted) -> Result<()> {
        let Some(opened) = self.opened.clone() else { return Ok(()) };
        let on_host = device.backend() == "cpu";
        let settings = wanted.settings.as_deref().unwrap_or(&opened.source.settings).clone();
        let is_same_scene = |session: &Session| {
            Arc::ptr_eq(&session.opened, &opened) && of_scene(&session.settings) == of_scene(&settings)
        };
        match self.session.as_mut().filter(|session| is_same_scene(session)) {
            Some(session) => {
                let held = session.input.params.clone();
                job::prepare_again(&mut session.input, &settings, &opened.loaded.scene.cameras)?;
                let params = &session.input.params;
                if job::needs_more(params, &held) {
                    job::check_memory(params, on_host.then_some(&held))?;
                }
                session.settings = Arc::new(settings);
            }
            None => {
                let input = job::prepare(&opened.source, &settings, opened.loaded.clone(), &InputArgs::default())?;
                if self.is_left(&shared.board()) {
                    // Nothing ends what comes.
                    return Ok(());
                }
                let held = self.session.as_ref().map(|session| &session.input.params);
                if held.is_none_or(|held| job::needs_more(&input.params, held)) {
                    job::check_memory(&input.params, held.filter(|_| on_host))?;
                }
                // Unless its tree is there already; what is read again is still there as it was.
                if self.session.is_none() && self.packed.nodes.is_empty() && !wanted.reads_again {
                    job::check_scene_memory(&input.scene).with_context(|| opened.source.name.clone())?;
                }
                shared.update(|board| board.phase = Phase::Preparing);
                // What has been said of this scene is not said again at every change.
                let said = self.session.as_ref().map_or(&[][..], |session| &session.input.warnings);
                let is_new = |warning: &&String| !said.contains(warning);
                let warnings: Vec<_> = input.warnings.iter().filter(is_new).cloned().map(Message::Warning).collect();
                let can_follow = device.can_follow(&settings);
                // Of another device the memory first.
                if !can_follow {
                    self.end_session();
                }
                device.follow(&settings)?;
                let settings = Arc::new(settings);
                match &mut self.session {
                    Some(session) => session.change(device, settings, input)?,
                    None => {
                        device.recover()?;
                        let (before, interrupt) = (Arc::clone(&self.packed), shared.interrupt());
                        self.session = Some(Session::new(device, opened, settings, input, &before, interrupt)?);
                        self.packed = Arc::default();
                    }
                }
                shared.update(|board| {
                    board.messages.extend(warnings);
                    board.device = self.session.as_ref().map_or(String::new(), |s| s.machine.device.clone());
                });
            }
        }
        self.restart(shared, wanted)
    }

    fn restart(&mut self, shared: &Shared, wanted: &Wanted) -> Result<()> {
        let Some(session) = &mut self.session else { return Ok(()) };
        self.estimate += 1;
        self.steps_done = wanted.steps;
        shared.update(|board| {
            board.phase = Phase::Starting;
            board.estimate = self.estimate;
            board.history = Default::default();
        });
        session.restart(self.estimate, wanted.moving)?;
        // At once: what it took to come here may have outlasted the motion.
        if wanted.moving { self.iterate(shared, wanted) } else { Ok(()) }
    }

    fn iterate(&mut self, shared: &Shared, wanted: &Wanted) -> Result<()> {
        let Some(session) = &mut self.session else { return Ok(()) };
        let work = Work {
            wanted: wanted.clone(),
            opened: Arc::clone(&session.opened),
            // The first picture of a preview is always shown, or a camera that keeps moving would show none.
            keep_on: wanted.moving && session.n_iterations == 0,
        };
        shared.redirect(|board| board.work = Some(work));
        let done = session.start().and_then(|()| {
            shared.enter(Phase::Rendering);
            session.iterate()
        });
        shared.redirect(|board| board.work = None);
        let record = match done {
            Err(Error::Interrupted) => return Ok(()),
            done => done?,
        };
        let (noise, wanted) = {
            // A step that was asked for meanwhile is this one.
            let board = shared.board();
            (board.noise(), Wanted { paused: board.wanted.paused, steps: board.wanted.steps, ..wanted.clone() })
        };
        // Steps that were not done before it went on are not done after a later pause.
        self.steps_done = if wanted.paused { (self.steps_done + 1).min(wanted.steps) } else { wanted.steps };
        shared.note(|board| board.history.records.push(record));
        self.show(shared, &wanted, !self.can_go_on(&wanted, noise))
    }

    /// Publishes the film now and then; at once if it `is_last` for a while.
    fn show(&mut self, shared: &Shared, wanted: &Wanted, is_last: bool) -> Result<()> {
        let Some(session) = &mut self.session else { return Ok(()) };
        let needs = shared.board().needs();
        // The film alone is quick to have, and shown after every iteration.
        let is_long = needs.is_any();
        if is_long {
            let (wanted, opened) = (wanted.clone(), Arc::clone(&session.opened));
            let keep_on = wanted.moving && session.n_iterations == 1;
            shared.redirect(|board| board.work = Some(Work { wanted, opened, keep_on }));
        }
        let snapshot = session.snapshot_if_due(is_last, needs);
        if is_long {
            shared.redirect(|board| board.work = None);
        }
        let snapshot = match snapshot {
            Err(Error::Interrupted) => return Ok(()),
            snapshot => snapshot?,
        };
        if let Some(snapshot) = snapshot {
            // What nobody has taken is freed here, and not while others wait for the board.
            drop(shared.update(|board| board.snapshot.replace(Arc::new(snapshot))));
        }
        if is_last {
            shared.enter(resting(wanted));
        }
        Ok(())
    }

    /// Gives the memory of the device back, and keeps the scene for the next session of it.
    fn end_session(&mut self) {
        if let Some(session) = self.session.take() {
            self.packed = session.into_scene();
        }
    }

    /// The film so far stays on view, and can be saved.
    fn fail(&mut self, shared: &Shared, text: String) {
        self.end_session();
        shared.update(|board| {
            board.work = None;
            board.phase = Phase::Failed(text);
        });
    }
}

/// The phase of an estimate that does not go on.
fn resting(wanted: &Wanted) -> Phase {
    if wanted.paused { Phase::Paused } else { Phase::Reached }
}

pub fn is_other_scene(before: &Wanted, now: &Wanted) -> bool {
    (&before.scene, before.reloads) != (&now.scene, now.reloads)
}

/// Whether the estimate that was wanted before is not the one wanted now, of the same scene.
fn is_other_estimate(opened: &Opened, before: &Wanted, now: &Wanted) -> bool {
    before.moving != now.moving || is_asked_anew(opened, before, now)
}

/// The same, but for the wish for a preview.
pub fn is_asked_anew(opened: &Opened, before: &Wanted, now: &Wanted) -> bool {
    before.restarts != now.restarts || !is_rendered_alike(opened, before, now)
}

/// Whether the settings leave the estimate as it is, however they say it. Quick where they are the same.
fn is_rendered_alike(opened: &Opened, before: &Wanted, now: &Wanted) -> bool {
    let [a, b] = [before, now].map(|wanted| wanted.settings.as_deref().unwrap_or(&opened.source.settings));
    is_same(before.settings.as_ref(), now.settings.as_ref())
        || rendered(opened, a).is_some_and(|a| Some(a) == rendered(opened, b))
            && is_changed_alike(&opened.loaded.scene, a, b)
}

/// What the estimate depends on, but for the changes to materials and lights; none of settings that cannot be rendered.
fn rendered(opened: &Opened, settings: &Settings) -> Option<(Settings, Params, layout::Camera)> {
    let mut camera = settings.camera_of(&opened.loaded.scene.cameras).ok()?;
    if camera.aperture_radius == 0.0 {
        camera.focus_distance = 1.0;
    }
    let params = job::params(settings, &InputArgs::default(), &camera).ok()?;
    let of_scene = Settings { materials: vec![], scene_lights: vec![], ..of_scene(settings) };
    Some((of_scene, params, camera.pack(1, 1)))
}

/// Whether the changes to materials and lights come to the same.
fn is_changed_alike(scene: &Scene, before: &Settings, now: &Settings) -> bool {
    let changed = |settings: &Settings| {
        let (mut materials, mut lights) = (scene.materials.clone(), scene.lights.clone());
        settings.change_materials_and_lights(&mut materials, &mut lights).ok()?;
        Some((materials, lights))
    };
    (&before.materials, &before.scene_lights) == (&now.materials, &now.scene_lights)
        || changed(before).is_some_and(|before| Some(before) == changed(now))
}

/// Those settings that change the scene or how it is searched: not the camera, not the rest of the estimator's.
fn of_scene(settings: &Settings) -> Settings {
    Settings {
        size: None,
        photons: None,
        alpha: None,
        radius: None,
        kernel: None,
        direct: None,
        iterations: None,
        seconds: None,
        seed: None,
        exposure: None,
        tonemap: None,
        max_segments: None,
        camera: None,
        // Nothing in the place of a default.
        index: settings.index.filter(|&index| index != Index::default()),
        accel: settings.accel.filter(|&accel| accel != Accelerator::default()),
        light_scale: settings.light_scale.filter(|&scale| scale != 1.0),
        ..settings.clone()
    }
}

#[cfg(test)]
mod tests {
    use super::super::Choice;
    use super::*;

    #[test]
    fn a_motion_that_is_over_before_its_scene_is_ready_has_its_preview() {
        let set = ["size=32x24", "photons=500"].map(str::to_owned).to_vec();
        let resting = Wanted {
            scene: Some(Arc::new(Choice { name: "cornell".to_owned(), set })),
            limits_at_first: Some(Default::default()),
            ..Wanted::default()
        };
        let moving = Wanted { moving: true, ..resting.clone() };
        let shared = Shared::new(Arc::new(|| {}));
        let (mut have, mut device) = (Have::default(), Device::Cpu(Accelerator::Bvh));
        shared.board().wanted = resting.clone();
        have.follow(&shared, &mut device, &moving).unwrap();
        let is_preview = || shared.board().snapshot.as_ref().map(|snapshot| snapshot.is_preview);
        assert_eq!(is_preview(), Some(true));
        assert!(have.is_behind(&resting));
        for _ in 0..2 {
            have.follow(&shared, &mut device, &resting).unwrap();
        }
        assert_eq!(is_preview(), Some(false));
    }
}
