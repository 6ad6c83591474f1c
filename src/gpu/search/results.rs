//! What a search has found, left on the device.

use std::marker::PhantomData;
use std::sync::Arc;

use bytemuck::Pod;

use super::super::buffers::{Array, Readback};
use super::super::context::Context;
use super::super::kernels::Shared;
use crate::device::Error;
use crate::index::{NearestLists, Neighbours};

/// An array on the device. It counts against the budget while it lives.
pub struct DeviceArray<T> {
    context: Arc<Context>,
    shared: Arc<Shared>,
    array: Array,
    len: usize,
    element: PhantomData<T>,
}

impl<T: Pod> DeviceArray<T> {
    pub(super) fn new(
        context: &Arc<Context>,
        shared: &Arc<Shared>,
        what: &'static str,
        len: u64,
    ) -> Result<Self, Error> {
        let mut array = Array::new::<T>(what);
        array.reserve(context, len)?;
        let len = len as usize;
        Ok(Self { context: Arc::clone(context), shared: Arc::clone(shared), array, len, element: PhantomData })
    }

    /// Number of elements.
    pub fn len(&self) -> usize {
        self.len
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.len == 0
    }

    /// The buffer, at least as long as the array: usages `STORAGE`, `COPY_SRC` and `COPY_DST`.
    pub fn buffer(&self) -> &wgpu::Buffer {
        self.array.raw()
    }

    pub(super) fn all(&self) -> wgpu::BindingResource<'_> {
        self.array.all()
    }

    /// The last element.
    pub(super) fn last(&self, readback: &mut Readback) -> Result<T, Error> {
        let at = (self.len - 1) * size_of::<T>();
        let read: Vec<T> = readback.read_from(&self.context, &self.shared, self.array.raw(), at as u64, 1)?;
        Ok(read[0])
    }

    /// Waits for the device and copies the elements to the host.
    pub fn download(&self) -> Result<Vec<T>, Error> {
        if self.len == 0 {
            return Ok(Vec::new());
        }
        Readback::default().read(&self.context, &self.shared, self.array.raw(), self.len)
    }
}

/// All neighbours of all queries in compressed rows, as [`Neighbours`].
pub struct DeviceNeighbours {
    /// `[queries + 1]`.
    pub offsets: DeviceArray<u32>,
    /// Points, `[offsets[queries]]`; within a row in no particular order.
    pub indices: DeviceArray<u32>,
    /// Their squared distances.
    pub distances2: DeviceArray<f32>,
}

impl DeviceNeighbours {
    /// Waits for the device and copies all of it to the host.
    pub fn download(&self) -> Result<Neighbours, Error> {
        Ok(Neighbours {
            offsets: self.offsets.download()?.into_iter().map(|offset| offset as usize).collect(),
            indices: self.indices.download()?,
            distances2: self.distances2.download()?,
        })
    }
}

/// The k nearest of all queries, as [`NearestLists`].
pub struct DeviceNearest {
    /// Length of a row.
    pub k: usize,
    /// `[queries]`: how many were found.
    pub found: DeviceArray<u32>,
    /// Points, `[queries · k]`, nearest first; `u32::MAX` for none.
    pub indices: DeviceArray<u32>,
    /// Their squared distances, infinite for none.
    pub distances2: DeviceArray<f32>,
}

impl DeviceNearest {
    /// Waits for the device and copies all of it to the host.
    pub fn download(&self) -> Result<NearestLists, Error> {
        Ok(NearestLists {
            k: self.k,
            found: self.found.download()?,
            indices: self.indices.download()?,
            distances2: self.distances2.download()?,
        })
    }
}
