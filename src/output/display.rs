//! From a picture to the bytes of a screen or a PNG: exposure, tone curve, sRGB encoding, dither.

use rayon::prelude::*;

use super::Picture;
use super::tonemap::{ToneMap, automatic_exposure, srgb_encode};
use crate::scene::settings::Settings;

/// How a picture is shown.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Look {
    /// Stops; automatic if none ([`automatic_exposure`]).
    pub exposure: Option<f32>,
    /// Tone curve.
    pub tonemap: ToneMap,
}

impl Look {
    /// As settings say.
    pub fn of(settings: &Settings) -> Self {
        Self { exposure: settings.exposure, tonemap: settings.tonemap.unwrap_or_default() }
    }

    /// The exposure that `rgb` is shown with, stops.
    pub fn exposure_of(&self, rgb: &[[f32; 3]]) -> f32 {
        self.exposure.unwrap_or_else(|| automatic_exposure(rgb))
    }
}

/// 8-bit sRGB, three bytes a pixel, row-major over the crop, into `bytes`, whose old content goes.
///
/// An ordered dither of one level breaks up bands; where a pixel falls in its pattern depends on its place in the whole
/// picture, so a crop is the same as the part of the whole.
pub fn rgb8(picture: &Picture, exposure: f32, tonemap: ToneMap, bytes: &mut Vec<u8>) {
    encode::<3>(picture, exposure, tonemap, bytes);
}

/// The same with a fourth byte, alpha, 255.
pub fn rgba8(picture: &Picture, exposure: f32, tonemap: ToneMap, bytes: &mut Vec<u8>) {
    encode::<4>(picture, exposure, tonemap, bytes);
}

/// What a display shows, linear in [0, 1], `[h·w]`: [`rgba8`] before the sRGB encoding and the dither.
pub fn linear(rgb: &[[f32; 3]], exposure: f32, tonemap: ToneMap) -> Vec<[f32; 3]> {
    let scale = exposure.exp2();
    rgb.par_iter().map(|rgb| tonemap.apply(rgb.map(|c| c * scale))).collect()
}

fn encode<const N: usize>(picture: &Picture, exposure: f32, tonemap: ToneMap, bytes: &mut Vec<u8>) {
    let scale = exposure.exp2();
    let [x0, y0] = [picture.crop[0] as usize, picture.crop[1] as usize];
    let width = picture.crop_size()[0].max(1);
    bytes.resize(picture.rgb.len() * N, 255);
    let rows = bytes.par_chunks_mut(width * N).zip(picture.rgb.par_chunks(width));
    rows.enumerate().for_each(|(y, (bytes, row))| {
        for (x, (bytes, rgb)) in bytes.chunks_exact_mut(N).zip(row).enumerate() {
            let threshold = bayer(x0 + x, y0 + y);
            let shown = tonemap.apply(rgb.map(|c| c * scale)).map(|c| (srgb_encode(c) * 255.0 + threshold) as u8);
            bytes.fill(255);
            bytes[..3].copy_from_slice(&shown);
        }
    });
}

/// Bayer's 8×8 matrix, (0, 1), mean ½: bits of x ⊕ y and y, interleaved and reversed.
fn bayer(x: usize, y: usize) -> f32 {
    let mut rank = 0;
    for bit in 0..3 {
        rank = rank << 2 | ((x ^ y) >> bit & 1) << 1 | y >> bit & 1;
    }
    (rank as f32 + 0.5) / 64.0
}

#[cfg(test)]
mod tests {
    use super::*;

    fn picture(width: u32, rgb: Vec<[f32; 3]>) -> Picture {
        let height = rgb.len() as u32 / width;
        Picture { size: [width, height], crop: [0, 0, width, height], rgb, variance: None }
    }

    #[test]
    fn dither_has_each_rank_once() {
        let mut ranks: Vec<_> = (0..64).map(|i| (bayer(i % 8, i / 8) * 64.0) as u32).collect();
        ranks.sort();
        assert_eq!(ranks, (0..64).collect::<Vec<_>>());
    }

    #[test]
    fn levels_average_to_the_value_and_ends_are_exact() {
        let mut bytes = Vec::new();
        for (value, mean) in [(0.0, 0.0), (1.0, 255.0), (0.5, 255.0 * f64::from(srgb_encode(0.5)))] {
            rgb8(&picture(8, vec![[value; 3]; 64]), 0.0, ToneMap::Srgb, &mut bytes);
            let average = bytes.iter().map(|&b| f64::from(b)).sum::<f64>() / bytes.len() as f64;
            assert!((average - mean).abs() < 0.01, "{value}: {average}");
        }
    }

    #[test]
    fn a_used_buffer_and_alpha_change_nothing() {
        let small = picture(3, (0..6).map(|i| [i as f32 / 5.0, 0.3, f32::NAN]).collect());
        let (mut three, mut four) = (Vec::new(), vec![7; 1000]);
        rgb8(&small, -1.0, ToneMap::Agx, &mut three);
        rgba8(&small, -1.0, ToneMap::Agx, &mut four);
        assert_eq!((three.len(), four.len()), (18, 24));
        for (three, four) in three.chunks(3).zip(four.chunks(4)) {
            assert_eq!((three, 255), (&four[..3], four[3]));
        }
        rgba8(&Picture::default(), 0.0, ToneMap::Agx, &mut four);
        assert!(four.is_empty());
    }

    #[test]
    fn a_crop_is_the_part_of_the_whole() {
        let whole = picture(9, (0..63).map(|i| [i as f32 / 63.0, 0.2, 0.01]).collect());
        let part = (2..5).flat_map(|y| (3..7).map(move |x| y * 9 + x)).map(|i: usize| whole.rgb[i]).collect();
        let crop = Picture { crop: [3, 2, 7, 5], rgb: part, ..whole.clone() };
        let (mut a, mut b) = (Vec::new(), Vec::new());
        rgba8(&whole, 0.0, ToneMap::Neutral, &mut a);
        rgba8(&crop, 0.0, ToneMap::Neutral, &mut b);
        for y in 0..3 {
            assert_eq!(b[y * 16..][..16], a[((y + 2) * 9 + 3) * 4..][..16]);
        }
    }

    #[test]
    fn linear_is_the_display_before_encoding() {
        let rgb = vec![[0.1, 0.5, 3.0], [f32::NAN, f32::INFINITY, -1.0]];
        let shown = linear(&rgb, 1.0, ToneMap::Srgb);
        assert_eq!(shown, [[0.2, 1.0, 1.0], [0.0, 1.0, 0.0]]);
    }
}
