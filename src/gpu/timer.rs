//! How long the stages take.

use std::time::Instant;

use super::buffers::Readback;
use super::context::Context;
use super::kernels::{Batch, Shared};
use crate::device::Error;

/// Bytes from one stage's pair of timestamps to the next: they are resolved to multiples of this.
const SPACING: u64 = wgpu::QUERY_RESOLVE_BUFFER_ALIGNMENT;

/// Timestamps at the beginning and the end of each stage; wall time after waiting where there are none.
pub(super) struct Timer<const N: usize> {
    queries: Option<(wgpu::QuerySet, wgpu::Buffer)>,
    /// Which stages have been timed and not been read.
    pending: [bool; N],
    seconds: [f64; N],
    begun: Instant,
}

impl<const N: usize> Timer<N> {
    pub(super) fn new(context: &Context) -> Self {
        let queries = context.timestamps.then(|| {
            let set = context.device.create_query_set(&wgpu::QuerySetDescriptor {
                label: Some("stages"),
                ty: wgpu::QueryType::Timestamp,
                count: 2 * N as u32,
            });
            let buffer = context.device.create_buffer(&wgpu::BufferDescriptor {
                label: Some("timestamps"),
                size: N as u64 * SPACING,
                usage: wgpu::BufferUsages::QUERY_RESOLVE | wgpu::BufferUsages::COPY_SRC,
                mapped_at_creation: false,
            });
            (set, buffer)
        });
        Self { queries, pending: [false; N], seconds: [0.0; N], begun: Instant::now() }
    }

    /// Before the first dispatch of a stage.
    pub(super) fn begin(&mut self, stage: usize, batch: &mut Batch<'_>) {
        match &self.queries {
            Some((set, _)) => batch.encoder().write_timestamp(set, 2 * stage as u32),
            None => self.begun = Instant::now(),
        }
    }

    /// After the last dispatch of a stage; submits it.
    pub(super) fn end(&mut self, stage: usize, mut batch: Batch<'_>, context: &Context) -> Result<(), Error> {
        if let Some((set, _)) = &self.queries {
            batch.encoder().write_timestamp(set, 2 * stage as u32 + 1);
            self.pending[stage] = true;
            return batch.submit();
        }
        batch.submit()?;
        context.wait()?;
        self.seconds[stage] = self.begun.elapsed().as_secs_f64();
        Ok(())
    }

    /// Waits for the device and reads what has been timed.
    pub(super) fn read(
        &mut self,
        context: &Context,
        shared: &Shared,
        readback: &mut Readback,
    ) -> Result<[f64; N], Error> {
        if let Some((set, buffer)) = &self.queries
            && self.pending.contains(&true)
        {
            let timed: Vec<usize> = (0..N).filter(|&stage| self.pending[stage]).collect();
            let mut batch = Batch::new(context, shared, "timestamps");
            for &stage in &timed {
                // Each pair on its own: one that was never written may not be resolved.
                let queries = 2 * stage as u32..2 * stage as u32 + 2;
                batch.encoder().resolve_query_set(set, queries, buffer, stage as u64 * SPACING);
            }
            batch.submit()?;
            let words = (SPACING / 8) as usize;
            let ticks: Vec<u64> = readback.read(context, shared, buffer, words * N)?;
            let period = f64::from(context.queue.get_timestamp_period()) * 1e-9;
            for stage in timed {
                let [begin, end] = [ticks[stage * words], ticks[stage * words + 1]];
                self.seconds[stage] = end.saturating_sub(begin) as f64 * period;
            }
            self.pending = [false; N];
        }
        Ok(self.seconds)
    }
}
