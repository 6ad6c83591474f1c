//! Photon paths in chunks and rounds, and their photons in one array.

use std::sync::Arc;

use super::scene::SceneBuffers;
use super::{N_STAGES, PHOTONS, Pace};
use crate::device::Error;
use crate::gpu::buffers::{Array, Readback};
use crate::gpu::context::Context;
use crate::gpu::kernels::{Access, Batch, Kernel, Modules, Shared};
use crate::gpu::timer::Timer;
use crate::layout::{Frame, Photon};

/// As in `shaders/lib/photon_paths.wgsl`.
const CHUNK: u32 = 65536;
/// As there.
const PATHS: u32 = 4;
/// As there.
const SLOTS: u32 = 32;
/// Words before the counts of the threads.
const N_TOTALS: u32 = 4;
/// Threads a workgroup.
const THREADS: u32 = 64;
/// Workgroups of the smallest dispatches of paths.
const FEWEST_GROUPS: u32 = 16;
/// As many more in the rounds after the first, where most paths have ended.
const LATER: u32 = 4;

/// Kernels and memory of the photon paths.
pub(super) struct PhotonPaths {
    emit: Arc<Kernel>,
    trace: Arc<Kernel>,
    offsets: Arc<Kernel>,
    write: Arc<Kernel>,
    slots: Array,
    counters: Array,
    states: Array,
    /// In workgroups.
    pub(super) pace: Pace,
    /// Rounds each chunk gets. A thread that needs more shows in the counters; then all is done again with more.
    rounds: u32,
}

impl PhotonPaths {
    pub(super) fn new(modules: &Modules<'_>) -> Result<Self, Error> {
        use Access::{Read, Write};
        Ok(Self {
            emit: modules.kernel("emit", "emit_photons", &[Write])?,
            trace: modules.kernel("photons", "trace_photons", &[Write, Write, Write])?,
            offsets: modules.kernel("compact", "compact_offsets", &[Read, Write, Write, Write])?,
            write: modules.kernel("compact", "compact_write", &[Read, Write, Write, Write])?,
            slots: Array::new::<Photon>("photon slots"),
            counters: Array::new::<u32>("photon counters"),
            states: Array::new::<[u32; 16]>("photon paths"),
            pace: Pace::new(THREADS * PATHS, CHUNK / THREADS),
            rounds: 2,
        })
    }

    /// Follows the paths of `frame`; returns the number of photons, all of which are in `photons`.
    pub(super) fn trace(
        &mut self,
        context: &Context,
        shared: &Shared,
        scene: &SceneBuffers,
        frame: &Frame,
        photons: &mut Array,
        readback: &mut Readback,
        timer: &mut Timer<N_STAGES>,
    ) -> Result<u32, Error> {
        self.slots.reserve(context, u64::from(CHUNK * SLOTS))?;
        self.counters.reserve(context, u64::from(N_TOTALS + CHUNK + 2 * CHUNK / THREADS))?;
        self.states.reserve(context, u64::from((2 + PATHS) * CHUNK))?;
        if photons.capacity() == 0 {
            let most = context.most_bytes_bound() / size_of::<Photon>() as u64;
            photons.reserve(context, (2 * u64::from(frame.n_paths)).min(most))?;
        }
        let most_rounds = (PATHS * frame.max_photon_segments).div_ceil(SLOTS).max(1);
        loop {
            self.rounds = self.rounds.min(most_rounds);
            let room = photons.capacity().min(u64::from(u32::MAX)) as u32;
            self.record(context, shared, scene, frame, photons, room, timer)?;
            let totals: Vec<u32> = readback.read(context, shared, self.counters.raw(), N_TOTALS as usize)?;
            let [n, _, unfinished, _] = totals[..] else { unreachable!("four words were asked for") };
            if unfinished > 0 && self.rounds < most_rounds {
                self.rounds *= 2;
            } else if n > room {
                // A quarter more, for the number changes from one iteration to the next; less if that is too much.
                let needed = u64::from(n);
                if photons.reserve(context, needed + needed / 4).is_err() {
                    photons.reserve(context, needed)?;
                }
            } else {
                return Ok(n);
            }
        }
    }

    fn record(
        &mut self,
        context: &Context,
        shared: &Shared,
        scene: &SceneBuffers,
        frame: &Frame,
        photons: &Array,
        room: u32,
        timer: &mut Timer<N_STAGES>,
    ) -> Result<(), Error> {
        let mut batch = Batch::new(context, shared, "photons");
        scene.set_frame(&batch, frame);
        timer.begin(PHOTONS, &mut batch);
        batch.encoder().clear_buffer(self.counters.raw(), 0, Some(u64::from(4 * N_TOTALS)));
        // Workgroups that begin paths, recorded since the last cut. Few paths are left for the rounds after the first: they
        // say nothing about what a path takes.
        let mut begun = 0;
        for first in (0..frame.n_paths).step_by((CHUNK * PATHS) as usize) {
            if first > 0 {
                self.pace.learn(batch.cut(std::mem::take(&mut begun))?);
            }
            let n = (CHUNK * PATHS).min(frame.n_paths - first);
            let groups = n.div_ceil(THREADS * PATHS);
            batch.dispatch(&self.emit, &[self.states.all()], [n, first, 0, 0], n.div_ceil(THREADS));
            for round in 0..self.rounds {
                if round > 0 {
                    let took = batch.cut_if_interruptible(std::mem::take(&mut begun))?;
                    self.pace.learn(took);
                }
                let buffers = [self.slots.all(), self.counters.all(), self.states.all()];
                let mut group = 0;
                while group < groups {
                    if group > 0 {
                        self.pace.learn(batch.cut(std::mem::take(&mut begun))?);
                    }
                    let amount = self.pace.amount().max(FEWEST_GROUPS) * if round == 0 { 1 } else { LATER };
                    let part = amount.min(groups - group);
                    batch.dispatch(&self.trace, &buffers, [n, first, round, group], part);
                    begun += if round == 0 { part } else { 0 };
                    group += part;
                }
                if begun < groups {
                    // The last part may be a small one, and what is below goes with it.
                    begun = 0;
                }
                let buffers = [self.slots.all(), self.counters.all(), self.states.all(), photons.all()];
                let last = u32::from(round + 1 == self.rounds);
                batch.dispatch(&self.offsets, &buffers, [groups, 0, 0, last], 1);
                batch.dispatch(&self.write, &buffers, [room, 0, 0, 0], groups);
            }
        }
        timer.end(PHOTONS, batch, context)
    }
}
