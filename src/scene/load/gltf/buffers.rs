//! Buffers, buffer views and accessors, read with every bound checked.

use super::document::{Accessor, Document};
use crate::scene::load::files::Source;
use crate::scene::load::{LoadError, MAX_FILE_BYTES, MAX_VERTICES};
use std::borrow::Cow;

/// Elements of an accessor without bytes behind it (all zero), at most.
const MAX_IMPLIED_ELEMENTS: u64 = 16 << 20;

/// The buffers of a document, in memory.
pub(super) struct Buffers<'a> {
    source: &'a Source,
    document: &'a Document,
    /// `None`: without data, an error where it is used.
    bytes: Vec<Option<Cow<'a, [u8]>>>,
}

/// glTF's component types.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Component {
    I8,
    U8,
    I16,
    U16,
    U32,
    F32,
}

impl Component {
    fn from_code(code: u32) -> Result<Self, String> {
        Ok(match code {
            5120 => Self::I8,
            5121 => Self::U8,
            5122 => Self::I16,
            5123 => Self::U16,
            5125 => Self::U32,
            5126 => Self::F32,
            _ => return Err(format!("{code} is not a component type")),
        })
    }

    fn size(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::U32 | Self::F32 => 4,
        }
    }
}

/// Elements at regular distances. `bytes` reaches to the end of the last of them.
#[derive(Clone, Copy)]
struct Elements<'b> {
    bytes: &'b [u8],
    stride: usize,
    size: usize,
}

impl<'b> Elements<'b> {
    fn iter(self) -> impl Iterator<Item = &'b [u8]> {
        self.bytes.chunks(self.stride.max(1)).map(move |chunk| &chunk[..self.size])
    }
}

impl<'a> Buffers<'a> {
    /// Reads all buffers; `glb` is the binary chunk of a GLB file.
    pub(super) fn load(source: &'a Source, document: &'a Document, glb: Option<&'a [u8]>) -> Result<Self, LoadError> {
        let mut bytes = Vec::with_capacity(document.buffers.len());
        let mut left = MAX_FILE_BYTES;
        for (i, buffer) in document.buffers.iter().enumerate() {
            let place = format!("buffers[{i}]");
            let mut data = match &buffer.uri {
                Some(uri) => Some(Cow::Owned(source.read_uri(&format!("{place}.uri"), uri)?)),
                None if i == 0 => glb.map(Cow::Borrowed),
                None => None,
            };
            if let Some(data) = &mut data {
                let length = data.len() as u64;
                if length < buffer.byte_length {
                    let problem = format!("{} bytes are promised, {length} are there", buffer.byte_length);
                    return Err(source.invalid(format!("{place}.byteLength"), problem));
                }
                left = left.checked_sub(length).ok_or_else(|| {
                    source.too_large(&place, format!("more than {} MiB of buffers", MAX_FILE_BYTES >> 20))
                })?;
            }
            bytes.push(data);
        }
        Ok(Self { source, document, bytes })
    }

    /// The accessor at `index`; `place` names the field that holds the index.
    pub(super) fn accessor(&self, index: usize, place: &str) -> Result<&'a Accessor, LoadError> {
        lookup(self.source, &self.document.accessors, index, "accessors", place)
    }

    /// The bytes of a buffer view.
    pub(super) fn view(&self, index: usize, place: &str) -> Result<&[u8], LoadError> {
        let view = lookup(self.source, &self.document.buffer_views, index, "bufferViews", place)?;
        let place = format!("bufferViews[{index}]");
        lookup(self.source, &self.document.buffers, view.buffer, "buffers", &format!("{place}.buffer"))?;
        let bytes = self.bytes.get(view.buffer).and_then(Option::as_ref).ok_or_else(|| {
            self.source.invalid(format!("buffers[{}].uri", view.buffer), "is missing, and there is no binary chunk")
        })?;
        range(bytes, view.byte_offset, view.byte_length).ok_or_else(|| {
            let problem = format!(
                "bytes {} + {} lie outside buffer {} of {} bytes",
                view.byte_offset,
                view.byte_length,
                view.buffer,
                bytes.len()
            );
            self.source.invalid(place, problem)
        })
    }

    /// An accessor of `N` components each, as floats; normalised integers become [0, 1] or [−1, 1].
    pub(super) fn floats<const N: usize>(&self, index: usize, place: &str) -> Result<Vec<[f32; N]>, LoadError> {
        let accessor = self.accessor(index, place)?;
        self.floats_as(index, place, accessor.normalized)
    }

    /// As [`Self::floats`], with integers normalised or not whatever the accessor says.
    pub(super) fn floats_as<const N: usize>(
        &self,
        index: usize,
        place: &str,
        normalized: bool,
    ) -> Result<Vec<[f32; N]>, LoadError> {
        let component = self.component(index, place)?;
        match (component, normalized) {
            (Component::F32, _) => self.gather(index, place, |b: [u8; 4]| f32::from_le_bytes(b)),
            (Component::U8, true) => self.gather(index, place, |[b]: [u8; 1]| f32::from(b) / 255.0),
            (Component::U8, false) => self.gather(index, place, |[b]: [u8; 1]| f32::from(b)),
            (Component::I8, true) => self.gather(index, place, |[b]: [u8; 1]| (f32::from(b as i8) / 127.0).max(-1.0)),
            (Component::I8, false) => self.gather(index, place, |[b]: [u8; 1]| f32::from(b as i8)),
            (Component::U16, true) => self.gather(index, place, |b| f32::from(u16::from_le_bytes(b)) / 65535.0),
            (Component::U16, false) => self.gather(index, place, |b| f32::from(u16::from_le_bytes(b))),
            (Component::I16, true) => {
                self.gather(index, place, |b| (f32::from(i16::from_le_bytes(b)) / 32767.0).max(-1.0))
            }
            (Component::I16, false) => self.gather(index, place, |b| f32::from(i16::from_le_bytes(b))),
            (Component::U32, _) => {
                let place = format!("accessors[{index}].componentType");
                Err(self.source.invalid(place, "32-bit integers are for indices only"))
            }
        }
    }

    /// An accessor of unsigned integers, as for `indices`.
    pub(super) fn indices(&self, index: usize, place: &str) -> Result<Vec<u32>, LoadError> {
        let single = |elements: Vec<[u32; 1]>| elements.into_iter().map(|[i]| i).collect();
        match self.component(index, place)? {
            Component::U8 => self.gather(index, place, |[b]: [u8; 1]| u32::from(b)).map(single),
            Component::U16 => self.gather(index, place, |b| u32::from(u16::from_le_bytes(b))).map(single),
            Component::U32 => self.gather(index, place, u32::from_le_bytes).map(single),
            other => {
                let place = format!("accessors[{index}].componentType");
                Err(self.source.invalid(place, format!("{other:?} cannot be an index")))
            }
        }
    }

    fn component(&self, index: usize, place: &str) -> Result<Component, LoadError> {
        Component::from_code(self.accessor(index, place)?.component_type)
            .map_err(|problem| self.source.invalid(format!("accessors[{index}].componentType"), problem))
    }

    /// Reads `N` components of `SIZE` bytes per element, sparse ones over dense ones over zeros.
    fn gather<const N: usize, const SIZE: usize, T: Copy + Default>(
        &self,
        index: usize,
        place: &str,
        convert: impl Fn([u8; SIZE]) -> T,
    ) -> Result<Vec<[T; N]>, LoadError> {
        let accessor = self.accessor(index, place)?;
        let here = format!("accessors[{index}]");
        let n = n_components(&accessor.shape)
            .ok_or_else(|| self.source.invalid(format!("{here}.type"), format!("{:?} is unknown", accessor.shape)))?;
        if n != N {
            let problem = format!("accessor {index} has {n} components an element, not {N}");
            return Err(self.source.invalid(place, problem));
        }
        let element = |bytes: &[u8]| {
            let mut element = [T::default(); N];
            for (value, bytes) in element.iter_mut().zip(bytes.as_chunks::<SIZE>().0) {
                *value = convert(*bytes);
            }
            element
        };
        let mut values = match accessor.buffer_view {
            Some(view) => self
                .elements(view, accessor.byte_offset, accessor.count, N * SIZE, true, &here)?
                .iter()
                .map(element)
                .collect(),
            None if accessor.count > MAX_IMPLIED_ELEMENTS => {
                let problem = format!("more than {MAX_IMPLIED_ELEMENTS} elements without a buffer view");
                return Err(self.source.too_large(format!("{here}.count"), problem));
            }
            None => vec![[T::default(); N]; accessor.count as usize],
        };
        if let Some(sparse) = &accessor.sparse {
            let here = format!("{here}.sparse");
            let component = Component::from_code(sparse.indices.component_type)
                .map_err(|problem| self.source.invalid(format!("{here}.indices.componentType"), problem))?;
            let size = component.size();
            let (view, offset) = (sparse.indices.buffer_view, sparse.indices.byte_offset);
            let indices = self.elements(view, offset, sparse.count, size, false, &format!("{here}.indices"))?;
            let (view, offset) = (sparse.values.buffer_view, sparse.values.byte_offset);
            let replacements = self.elements(view, offset, sparse.count, N * SIZE, false, &format!("{here}.values"))?;
            for (i, replacement) in indices.iter().zip(replacements.iter()) {
                let i = little_endian(i);
                let slot = values.get_mut(i).ok_or_else(|| {
                    let problem = format!("index {i} of an accessor of {} elements", accessor.count);
                    self.source.invalid(format!("{here}.indices"), problem)
                })?;
                *slot = element(replacement);
            }
        }
        Ok(values)
    }

    /// `count` elements of `size` bytes in a buffer view from `offset` on.
    fn elements(
        &self,
        view: usize,
        offset: u64,
        count: u64,
        size: usize,
        strided: bool,
        place: &str,
    ) -> Result<Elements<'_>, LoadError> {
        let bytes = self.view(view, &format!("{place}.bufferView"))?;
        let stride = match self.document.buffer_views[view].byte_stride {
            Some(stride) if strided => stride,
            _ => size as u64,
        };
        // Checked before `count` is believed; a stride shorter than the element would make it cheap to lie.
        if stride < size as u64 {
            let problem = format!("{stride} is less than an element of accessor at {place}, {size} bytes");
            return Err(self.source.invalid(format!("bufferViews[{view}].byteStride"), problem));
        }
        if count > MAX_VERTICES * 3 {
            let problem = format!("{count} is more than {}", MAX_VERTICES * 3);
            return Err(self.source.too_large(format!("{place}.count"), problem));
        }
        let length = match count {
            0 => Some(0),
            _ => stride.checked_mul(count - 1).and_then(|reach| reach.checked_add(size as u64)),
        };
        let bytes = length.and_then(|length| range(bytes, offset, length)).ok_or_else(|| {
            let problem = format!(
                "{count} elements of {size} bytes, {stride} bytes apart, from byte {offset} on exceed buffer view {view} of {} bytes",
                bytes.len()
            );
            self.source.invalid(place, problem)
        })?;
        // Within the buffer now, so that the stride fits a usize.
        Ok(Elements { bytes, stride: stride as usize, size })
    }
}

/// `list[index]`, or an error at `place`.
pub(super) fn lookup<'a, T>(
    source: &Source,
    list: &'a [T],
    index: usize,
    what: &str,
    place: &str,
) -> Result<&'a T, LoadError> {
    list.get(index)
        .ok_or_else(|| source.invalid(place, format!("{index} is out of range: there are {} {what}", list.len())))
}

fn n_components(shape: &str) -> Option<usize> {
    Some(match shape {
        "SCALAR" => 1,
        "VEC2" => 2,
        "VEC3" => 3,
        "VEC4" | "MAT2" => 4,
        "MAT3" => 9,
        "MAT4" => 16,
        _ => return None,
    })
}

fn range(bytes: &[u8], offset: u64, length: u64) -> Option<&[u8]> {
    let start = usize::try_from(offset).ok()?;
    let end = start.checked_add(usize::try_from(length).ok()?)?;
    bytes.get(start..end)
}

fn little_endian(bytes: &[u8]) -> usize {
    bytes.iter().rev().fold(0, |value, byte| value << 8 | usize::from(*byte))
}
