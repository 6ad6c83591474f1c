//! Buffers that grow, and reading them back.

use std::sync::mpsc;
use std::time::Duration;

use bytemuck::Pod;

use super::context::{Buffer, Context};
use super::kernels::Batch;
use crate::device::Error;

/// An array on the device that keeps its memory from one iteration to the next.
pub(super) struct Array {
    what: &'static str,
    stride: u64,
    usage: wgpu::BufferUsages,
    /// Bound whole, so that it may not be larger than a binding.
    whole: bool,
    buffer: Option<Buffer>,
}

impl Array {
    /// Empty; shaders see all of it at once.
    pub(super) fn new<T>(what: &'static str) -> Self {
        let usage = wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_SRC | wgpu::BufferUsages::COPY_DST;
        Self { what, stride: size_of::<T>() as u64, usage, whole: true, buffer: None }
    }

    /// Empty; boxes of two corners each, over which the device can build its tree.
    pub(super) fn of_boxes(what: &'static str) -> Self {
        let array = Self::new::<[f32; 6]>(what);
        Self { usage: array.usage | wgpu::BufferUsages::BLAS_INPUT, ..array }
    }

    /// Empty; shaders see a range of it at a time.
    #[cfg(feature = "render")]
    pub(super) fn in_ranges<T>(what: &'static str) -> Self {
        Self { whole: false, ..Self::new::<T>(what) }
    }

    /// Elements that fit.
    pub(super) fn capacity(&self) -> u64 {
        self.buffer.as_ref().map_or(0, |buffer| buffer.raw.size() / self.stride)
    }

    /// Makes room for `n` elements. What was in it is lost if it has to grow; new memory is zero.
    pub(super) fn reserve(&mut self, context: &Context, n: u64) -> Result<(), Error> {
        if self.buffer.is_some() && self.capacity() >= n {
            return Ok(());
        }
        self.buffer = None;
        let bytes = n.max(1) * self.stride;
        let bound = if self.whole { bytes } else { 0 };
        self.buffer = Some(context.buffer(self.what, bytes, bound, self.usage)?);
        Ok(())
    }

    /// Gives its memory back.
    #[cfg(feature = "render")]
    pub(super) fn free(&mut self) {
        self.buffer = None;
    }

    /// The buffer; call [`Array::reserve`] first.
    pub(super) fn raw(&self) -> &wgpu::Buffer {
        &self.buffer.as_ref().expect("reserved before use").raw
    }

    /// All of it.
    pub(super) fn all(&self) -> wgpu::BindingResource<'_> {
        self.raw().as_entire_binding()
    }

    /// `n` elements from `first` on, whose address is a multiple of 256 bytes.
    #[cfg(feature = "render")]
    pub(super) fn range(&self, first: u32, n: u32) -> wgpu::BindingResource<'_> {
        wgpu::BindingResource::Buffer(wgpu::BufferBinding {
            buffer: self.raw(),
            offset: u64::from(first) * self.stride,
            size: wgpu::BufferSize::new(u64::from(n) * self.stride),
        })
    }

    /// Replaces the contents.
    pub(super) fn write<T: Pod>(&mut self, context: &Context, data: &[T]) -> Result<(), Error> {
        debug_assert_eq!(size_of::<T>() as u64, self.stride, "{}", self.what);
        self.reserve(context, data.len() as u64)?;
        // In pieces, for the queue keeps a copy of each until it is done.
        context.guarded(|| {
            for (i, piece) in bytemuck::cast_slice::<T, u8>(data).chunks(PIECE).enumerate() {
                context.queue.write_buffer(self.raw(), (i * PIECE) as u64, piece);
                context.queue.submit([]);
            }
            context.check()
        })
    }
}

/// How long a callback may be late.
const CALLBACK: Duration = Duration::from_secs(60);
/// Bytes moved between host and device at once.
const PIECE: usize = 32 << 20;

/// Memory the host can read.
#[derive(Default)]
pub(super) struct Readback {
    buffer: Option<Buffer>,
}

impl Readback {
    /// The first `n` elements; waits for the device.
    pub(super) fn read<T: Pod>(
        &mut self,
        context: &Context,
        shared: &super::kernels::Shared,
        from: &wgpu::Buffer,
        n: usize,
    ) -> Result<Vec<T>, Error> {
        self.read_from(context, shared, from, 0, n)
    }

    /// `n` elements from a byte on; waits for the device.
    pub(super) fn read_from<T: Pod>(
        &mut self,
        context: &Context,
        shared: &super::kernels::Shared,
        from: &wgpu::Buffer,
        first_byte: u64,
        n: usize,
    ) -> Result<Vec<T>, Error> {
        let end = (n as u64).checked_mul(size_of::<T>() as u64).and_then(|bytes| bytes.checked_add(first_byte));
        if end.is_none_or(|end| end > from.size()) {
            let what = format!("{n} elements from byte {first_byte} on are asked of a buffer of {} bytes", from.size());
            return Err(context.error(what));
        }
        let mut elements = vec![T::zeroed(); n];
        let bytes: &mut [u8] = bytemuck::cast_slice_mut(&mut elements);
        let piece = bytes.len().min(PIECE).next_multiple_of(16) as u64;
        if self.buffer.as_ref().is_none_or(|buffer| buffer.raw.size() < piece) {
            self.buffer = None;
            let usage = wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST;
            self.buffer = Some(context.buffer("readback", piece, 0, usage)?);
        }
        let buffer = &self.buffer.as_ref().expect("made above").raw;
        let read_part = |(i, part): (usize, &mut [u8])| {
            let mut batch = Batch::new(context, shared, "readback");
            batch.encoder().copy_buffer_to_buffer(from, first_byte + (i * PIECE) as u64, buffer, 0, part.len() as u64);
            batch.submit()?;
            let slice = buffer.slice(..part.len() as u64);
            let (sender, receiver) = mpsc::channel();
            slice.map_async(wgpu::MapMode::Read, move |result| drop(sender.send(result)));
            context.wait()?;
            // Another thread that polls the device may be the one that calls back, a moment after this one is through.
            match receiver.recv_timeout(CALLBACK) {
                Ok(Ok(())) => {}
                _ => return Err(context.error("memory could not be read back".to_owned())),
            }
            let view = slice.get_mapped_range().map_err(|error| context.error(error.to_string()))?;
            part.copy_from_slice(&view);
            drop(view);
            buffer.unmap();
            context.check()
        };
        context.guarded(|| bytes.chunks_mut(PIECE).enumerate().try_for_each(read_part))?;
        Ok(elements)
    }
}
