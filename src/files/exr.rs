//! OpenEXR files of any program: which of a file's channels are the picture, and their pixels one by one.
//!
//! The decoder takes a file's word: it allocates what a header asks for, and asserts that damaged data are what it expects.
//! So headers are checked before anything is decoded, and, as a last resort, a panic comes back as an error.

use std::cell::RefCell;
use std::collections::BTreeMap;
use std::io::{Read, Seek, SeekFrom};
use std::panic::{AssertUnwindSafe, catch_unwind};

use ::exr::block::UncompressedBlock;
use ::exr::block::chunk::{Chunk, CompressedBlock};
use ::exr::error::Error as Problem;
use ::exr::image::read::layers::ChannelsReader;
use ::exr::image::read::specific_channels::ReadSpecificChannel;
use ::exr::meta::attribute::Text;
use ::exr::meta::header::Header;
use ::exr::meta::{Headers, MetaData};
use ::exr::prelude::{Compression, ReadChannels, Vec2};
use rayon::prelude::*;

use super::shorten;

/// Every OpenEXR file begins with these.
pub const MAGIC: [u8; 4] = [0x76, 0x2f, 0x31, 0x01];

/// What a header may ask for, in whichever part.
pub struct Limits {
    /// What is wrong with a width and a height.
    pub size: fn(usize, usize) -> Result<(), String>,
    /// Of the blocks, all channels of some rows or of a tile, that are decoded at once.
    pub block_bytes: usize,
}

/// A file whose header has been read.
pub struct Image<R> {
    file: R,
    headers: Headers,
    part: usize,
    channels: Channels,
    /// How many blocks are decoded side by side.
    at_once: usize,
}

impl<R: Read + Seek> Image<R> {
    /// Reads the header, from the beginning of the file, and chooses what is the picture. No part may have deep data.
    pub fn open(mut file: R, limits: &Limits) -> Result<Self, String> {
        let n_bytes = file.seek(SeekFrom::End(0)).and_then(|n| file.rewind().map(|()| n)).map_err(|e| e.to_string())?;
        let headers = caught(|| MetaData::read_from_buffered(&mut file, false))?.headers;
        for header in &headers {
            (limits.size)(header.layer_size.0, header.layer_size.1)?;
            if block_bytes(header).is_none_or(|n| n > limits.block_bytes) || header.chunk_count as u64 > n_bytes {
                return Err("its blocks are too large, or more than it can have".into());
            }
        }
        let (part, channels) = choose(&headers)?;
        let block = block_bytes(&headers[part]).unwrap_or(usize::MAX).max(1);
        let at_once = (limits.block_bytes / block).clamp(1, 4 * rayon::current_num_threads());
        Ok(Self { file, headers, part, channels, at_once })
    }

    /// Of the part that has the picture.
    pub fn header(&self) -> &Header {
        &self.headers[self.part]
    }

    /// Gives each pixel, counted from the corner of the data window, and its linear RGB to `sink`, in the order of the
    /// file.
    pub fn decode(self, sink: impl FnMut([usize; 2], [f32; 3])) -> Result<(), String> {
        let sink = RefCell::new(sink);
        let give = |at: Vec2<usize>, rgb| sink.borrow_mut()([at.0, at.1], rgb);
        let wanted = ::exr::prelude::read().no_deep_data().largest_resolution_level().specific_channels();
        match self.channels.clone() {
            Channels::Rgb([r, g, b]) => {
                let set = |_: &mut (), at, (r, g, b): (f32, f32, f32)| give(at, [r, g, b]);
                let wanted = wanted.required(r).required(g).required(b).collect_pixels(|_, _| (), set);
                caught(|| self.blocks(&wanted))
            }
            Channels::Grey(y) => {
                let set = |_: &mut (), at, (y,): (f32,)| give(at, [y; 3]);
                let wanted = wanted.required(y).collect_pixels(|_, _| (), set);
                caught(|| self.blocks(&wanted))
            }
        }
    }

    /// Decodes some blocks at a time on the threads of the caller, which hand a panic on: on those that the decoder makes
    /// for itself it would end the program.
    fn blocks<'w>(mut self, wanted: &'w impl ReadChannels<'w>) -> Result<(), Problem> {
        let mut pixels = wanted.create_channels_reader(self.header())?;
        self.file.rewind()?;
        let reader = ::exr::block::read(self.file, false)?;
        let meta = reader.meta_data().clone();
        let mut chunks =
            reader.filter_chunks(false, |_, tile, block| block.layer == self.part && pixels.filter_block(tile))?;
        loop {
            let some = chunks.by_ref().take(self.at_once).collect::<Result<Vec<_>, _>>()?;
            if some.is_empty() {
                return Ok(());
            }
            let decode = |chunk| {
                check_counters(&chunk, &meta)?;
                UncompressedBlock::decompress_chunk(chunk, &meta, false)
            };
            let decoded: Vec<_> = some.into_par_iter().map(decode).collect();
            for block in decoded {
                let block = block?;
                // The table of where the blocks are may lead to one of another part or of a smaller copy.
                if block.index.layer != self.part || block.index.level != Vec2(0, 0) {
                    return Err(Problem::Invalid("a block is not where it should be".into()));
                }
                pixels.read_block(&meta.headers[self.part], block)?;
            }
        }
    }
}

/// Eleven counters begin a block of DWA, and the decoder allocates what they say, which no `catch_unwind` survives.
fn check_counters(chunk: &Chunk, meta: &MetaData) -> Result<(), Problem> {
    let Some(header) = meta.headers.get(chunk.layer_index) else { return Ok(()) };
    let data = match (&chunk.compressed_block, header.compression) {
        (CompressedBlock::ScanLine(block), Compression::DWAA(_) | Compression::DWAB(_)) => &block.compressed_pixels_le,
        (CompressedBlock::Tile(block), Compression::DWAA(_) | Compression::DWAB(_)) => &block.compressed_pixels_le,
        _ => return Ok(()),
    };
    let tile = header.get_block_data_indices(&chunk.compressed_block)?;
    let size = header.get_absolute_block_pixel_coordinates(tile)?.size;
    let bytes =
        |width: usize, height: usize| width.saturating_mul(height).saturating_mul(header.channels.bytes_per_pixel);
    // It is not compressed.
    if data.len() == bytes(size.0, size.1) {
        return Ok(());
    }
    // Whole squares of 8 × 8 coefficients, and bytes that could not be shortened.
    let most = bytes(size.0 + 7, size.1 + 7).saturating_mul(2) as u64;
    // What four sections have when they are decoded, one of them after each of two steps.
    let counters = data.as_chunks().0.iter().map(|bytes| u64::from_le_bytes(*bytes));
    if counters.take(10).enumerate().any(|(i, n)| matches!(i, 1 | 6..=9) && n > most) {
        return Err(Problem::Invalid("a block has more than it can".into()));
    }
    Ok(())
}

/// Of the largest block, decoded.
fn block_bytes(header: &Header) -> Option<usize> {
    let block = header.max_block_pixel_size();
    block.0.checked_mul(block.1)?.checked_mul(header.channels.bytes_per_pixel)
}

/// What the decoder says, or that it panicked.
fn caught<T>(work: impl FnOnce() -> Result<T, Problem>) -> Result<T, String> {
    match catch_unwind(AssertUnwindSafe(work)) {
        Ok(Err(Problem::Invalid(what))) => Err(format!("the file is cut off or damaged: {what}")),
        Ok(result) => result.map_err(|e| e.to_string()),
        Err(_) => Err("the OpenEXR data are damaged".into()),
    }
}

/// What a picture is made of.
#[derive(Clone, Debug)]
enum Channels {
    Rgb([Text; 3]),
    Grey(Text),
}

/// The part and its channels that are the picture.
///
/// It is in the first part with channels `R`, `G` and `B`. If there is none, it is the one layer that has them, as in
/// `Combined.R`, in either case, or `Y` as grey, in the first part that has it; of several layers, the one whose name ends
/// in "Combined" or "beauty", which renderers call the sum of their passes.
fn choose(headers: &[Header]) -> Result<(usize, Channels), String> {
    let parts = || headers.iter().enumerate();
    let find = |header: &Header, name: &str| {
        let is_named = |c: &&Text| c.as_slice().eq_ignore_ascii_case(name.as_bytes());
        header.channels.list.iter().map(|c| &c.name).find(is_named).cloned()
    };
    let plain = ["R", "G", "B"];
    let has = |header: &Header, name: &str| header.channels.list.iter().any(|c| c.name == *name);
    if let Some(part) = parts().find(|(_, header)| plain.iter().all(|name| has(header, name))) {
        return Ok((part.0, Channels::Rgb(plain.map(Text::from))));
    }

    let mut layers: BTreeMap<String, (usize, Channels)> = BTreeMap::new();
    for (part, header) in parts() {
        for (name, channels) in triples(header) {
            layers.entry(name).or_insert((part, Channels::Rgb(channels)));
        }
    }
    if let Some(found) = layers.remove("") {
        return Ok(found);
    }
    // With chroma it is not grey, and with X no luminance.
    let is_grey = |part: usize| ["X", "RY", "BY"].iter().all(|name| find(&headers[part], name).is_none());
    let luminance = parts().find_map(|(part, header)| Some((part, find(header, "Y")?)));
    if let Some((part, y)) = luminance.filter(|(part, _)| is_grey(*part)) {
        layers.entry("Y".into()).or_insert((part, Channels::Grey(y)));
    }
    if layers.len() > 1 {
        let is_sum = |name: &String| ["combined", "beauty"].iter().any(|end| name.to_lowercase().ends_with(end));
        let names: Vec<String> = layers.keys().cloned().collect();
        layers.retain(|name, _| is_sum(name));
        if layers.len() != 1 {
            let names = listed(names.iter().map(String::as_str));
            return Err(format!(
                "several layers could be the picture, and no single one is called Combined or beauty: {names}"
            ));
        }
    }
    layers.into_values().next().ok_or_else(|| {
        let names: Vec<_> =
            headers.iter().flat_map(|header| &header.channels.list).map(|c| lossy(c.name.as_slice())).collect();
        format!("it has no channels R, G and B, plain or of a layer, but {}", listed(names.iter().map(String::as_str)))
    })
}

/// The layers of a part that have red, green and blue.
fn triples(header: &Header) -> impl Iterator<Item = (String, [Text; 3])> {
    let mut layers: BTreeMap<&[u8], [Option<&Text>; 3]> = BTreeMap::new();
    for name in header.channels.list.iter().map(|c| &c.name) {
        let (layer, channel) = match name.as_slice().iter().rposition(|&byte| byte == b'.') {
            Some(dot) => (&name.as_slice()[..dot], &name.as_slice()[dot + 1..]),
            None => (&[][..], name.as_slice()),
        };
        if let Some(i) = ["R", "G", "B"].iter().position(|c| channel.eq_ignore_ascii_case(c.as_bytes())) {
            layers.entry(layer).or_default()[i].get_or_insert(name);
        }
    }
    layers.into_iter().filter_map(|(layer, [r, g, b])| Some((lossy(layer), [r?.clone(), g?.clone(), b?.clone()])))
}

fn lossy(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

/// For a message of one line.
fn listed<'a>(names: impl Iterator<Item = &'a str>) -> String {
    const MOST: usize = 24;
    let mut names: Vec<_> = names.map(shorten).collect();
    if names.len() > MOST {
        let more = names.len() - MOST;
        names.truncate(MOST);
        names.push(format!("{more} more"));
    }
    names.join(", ")
}

#[cfg(test)]
mod tests {
    use super::*;
    use ::exr::prelude::{
        AnyChannel, AnyChannels, Encoding, FlatSamples, ImageAttributes, Layer, LayerAttributes, WritableImage, f16,
    };
    use std::io::Cursor;

    const SIZE: usize = 24;
    const LIMITS: Limits = Limits { size: |_, _| Ok(()), block_bytes: 1 << 20 };

    /// Parts with the same channels, of which each pixel of part `p` is `p`.
    fn saved(n_parts: usize, channels: &[&str], encoding: Encoding) -> Vec<u8> {
        let part = |part: usize| {
            let channel =
                |name: &&str| AnyChannel::new(*name, FlatSamples::F16(vec![f16::from_f32(part as f32); SIZE * SIZE]));
            let channels = AnyChannels::sort(channels.iter().map(channel).collect());
            Layer::new((SIZE, SIZE), LayerAttributes::named(&*format!("part {part}")), encoding, channels)
        };
        let parts: Vec<_> = (0..n_parts).map(part).collect();
        let mut bytes = Cursor::new(Vec::new());
        let image = ::exr::prelude::Image::from_layers(ImageAttributes::with_size((SIZE, SIZE)), parts);
        image.write().to_buffered(&mut bytes).unwrap();
        bytes.into_inner()
    }

    fn decode(bytes: &[u8], limits: &Limits) -> Result<Vec<[f32; 3]>, String> {
        let mut pixels = Vec::new();
        Image::open(Cursor::new(bytes), limits)?.decode(|_, rgb| pixels.push(rgb))?;
        Ok(pixels)
    }

    #[test]
    fn blocks_are_decoded_in_turn_where_few_fit() {
        let encoding = Encoding { compression: Compression::ZIP1, ..Encoding::UNCOMPRESSED };
        let bytes = saved(1, &["R", "G", "B"], encoding);
        for n_blocks in [1, 5, 1000] {
            let limits = Limits { block_bytes: n_blocks * 6 * SIZE, ..LIMITS };
            assert_eq!(decode(&bytes, &limits), Ok(vec![[0.0; 3]; SIZE * SIZE]));
        }
        let error = decode(&bytes, &Limits { block_bytes: 6 * SIZE - 1, ..LIMITS }).unwrap_err();
        assert!(error.contains("blocks are too large"), "{error}");
        let error = decode(&bytes, &Limits { size: |width, _| Err(format!("{width} is too wide")), ..LIMITS });
        assert_eq!(error.unwrap_err(), "24 is too wide");
    }

    #[test]
    fn damaged_files_do_not_panic() {
        use Compression::{B44, DWAA, DWAB, PIZ, PXR24, RLE, Uncompressed, ZIP16};
        let mut n_refused = 0;
        for compression in [Uncompressed, RLE, ZIP16, PIZ, PXR24, B44, DWAA(None), DWAB(None)] {
            let original = saved(1, &["R", "G", "B"], Encoding { compression, ..Encoding::FAST_LOSSLESS });
            for i in (0..original.len().min(1200)).step_by(3) {
                for value in [0, 127, 255] {
                    let mut bytes = original.clone();
                    bytes[i] = value;
                    n_refused += usize::from(decode(&bytes, &LIMITS).is_err());
                }
            }
        }
        assert!(n_refused > 500, "{n_refused}");
    }

    #[test]
    fn a_panic_of_the_decoder_is_an_error() {
        let result = caught(|| (0..9).into_par_iter().map(|i| assert!(i < 3)).map(Ok).collect::<Result<(), _>>());
        assert_eq!(result, Err("the OpenEXR data are damaged".into()));
    }

    /// The tables of where the blocks are lead to those of the other part.
    #[test]
    fn blocks_of_another_part_are_refused() {
        let bytes = saved(2, &["R", "G", "B"], Encoding { compression: Compression::ZIP1, ..Encoding::UNCOMPRESSED });
        assert_eq!(decode(&bytes, &LIMITS), Ok(vec![[0.0; 3]; SIZE * SIZE]));
        let first = ::exr::block::read(Cursor::new(&bytes[..]), false).unwrap();
        assert!(first.headers().iter().all(|header| header.chunk_count == SIZE));
        // The tables come last before the blocks, whose first is where the first table says.
        let table =
            (0..bytes.len() - 8).find(|&i| bytes[i..i + 8] == ((i + 2 * 8 * SIZE) as u64).to_le_bytes()).unwrap();
        let mut swapped = bytes.clone();
        swapped[table..][..16 * SIZE].rotate_left(8 * SIZE);
        assert!(decode(&swapped, &LIMITS).unwrap_err().contains("not where it should be"));
    }
}
