//! How long the stages take.

use std::time::Instant;

use super::buffers::Readback;
use super::context::Context;
use super::kernels::{Batch, Shared};
use crate::ppm::{Error, StageTimes};

/// The stages, in the order of [`StageTimes`].
#[derive(Clone, Copy, Debug)]
pub(super) enum Stage {
    Eye,
    Photons,
    Build,
    Gather,
    Accumulate,
}

const N_STAGES: u32 = 5;
/// Bytes from one stage's pair of timestamps to the next: they are resolved to multiples of this.
const SPACING: u64 = wgpu::QUERY_RESOLVE_BUFFER_ALIGNMENT;

/// Timestamps at the beginning and the end of each stage; wall time after waiting where there are none.
pub(super) struct Timer {
    queries: Option<(wgpu::QuerySet, wgpu::Buffer)>,
    /// Which stages have been timed and not been read.
    pending: [bool; N_STAGES as usize],
    seconds: [f64; N_STAGES as usize],
    begun: Instant,
}

impl Timer {
    pub(super) fn new(context: &Context) -> Self {
        let queries = context.timestamps.then(|| {
            let set = context.device.create_query_set(&wgpu::QuerySetDescriptor {
                label: Some("stages"),
                ty: wgpu::QueryType::Timestamp,
                count: 2 * N_STAGES,
            });
            let buffer = context.device.create_buffer(&wgpu::BufferDescriptor {
                label: Some("timestamps"),
                size: u64::from(N_STAGES) * SPACING,
                usage: wgpu::BufferUsages::QUERY_RESOLVE | wgpu::BufferUsages::COPY_SRC,
                mapped_at_creation: false,
            });
            (set, buffer)
        });
        Self { queries, pending: [false; 5], seconds: [0.0; 5], begun: Instant::now() }
    }

    /// Before the first dispatch of a stage.
    pub(super) fn begin(&mut self, stage: Stage, batch: &mut Batch<'_>) {
        match &self.queries {
            Some((set, _)) => batch.encoder().write_timestamp(set, 2 * stage as u32),
            None => self.begun = Instant::now(),
        }
    }

    /// After the last dispatch of a stage; submits it.
    pub(super) fn end(&mut self, stage: Stage, mut batch: Batch<'_>, context: &Context) -> Result<(), Error> {
        if let Some((set, _)) = &self.queries {
            batch.encoder().write_timestamp(set, 2 * stage as u32 + 1);
            self.pending[stage as usize] = true;
            return batch.submit();
        }
        batch.submit()?;
        context.wait()?;
        self.seconds[stage as usize] = self.begun.elapsed().as_secs_f64();
        Ok(())
    }

    /// Waits for the device and reads what has been timed.
    pub(super) fn read(
        &mut self,
        context: &Context,
        shared: &Shared,
        readback: &mut Readback,
    ) -> Result<StageTimes, Error> {
        if let Some((set, buffer)) = &self.queries
            && self.pending.contains(&true)
        {
            let timed: Vec<u32> = (0..N_STAGES).filter(|stage| self.pending[*stage as usize]).collect();
            let mut batch = Batch::new(context, shared, "timestamps");
            for &stage in &timed {
                // Each pair on its own: one that was never written may not be resolved.
                let queries = 2 * stage..2 * stage + 2;
                batch.encoder().resolve_query_set(set, queries, buffer, u64::from(stage) * SPACING);
            }
            batch.submit()?;
            let words = (SPACING / 8) as usize;
            let ticks: Vec<u64> = readback.read(context, shared, buffer, words * N_STAGES as usize)?;
            let period = f64::from(context.queue.get_timestamp_period()) * 1e-9;
            for stage in timed.into_iter().map(|stage| stage as usize) {
                let [begin, end] = [ticks[stage * words], ticks[stage * words + 1]];
                self.seconds[stage] = end.saturating_sub(begin) as f64 * period;
            }
            self.pending = [false; 5];
        }
        let [eye, photons, build, gather, accumulate] = self.seconds;
        Ok(StageTimes { eye, photons, build, gather, accumulate })
    }
}
