//! Colours for numbers.

use std::sync::Arc;

use eframe::egui::{Color32, ColorImage};
use rayon::prelude::*;
use sunfleck::output::Picture;
use sunfleck::output::display;
use sunfleck::output::false_colour::{self, NOT_FINITE, Scale};
use sunfleck::output::tonemap::ToneMap;
use sunfleck::ppm::film::luminance;

/// The numbers behind the colours.
#[derive(Clone, Debug)]
pub enum Values {
    Rgb(Arc<Vec<[f32; 3]>>),
    Scalar(Arc<Vec<f32>>),
}

/// What the colours of a scalar mean.
#[derive(Clone, Debug, PartialEq)]
pub struct Legend {
    pub range: [f32; 2],
    pub log: bool,
    /// Green to red about 0.
    pub signed: bool,
}

/// 0 on a logarithmic scale, where there is nothing; not on the map. RGBA.
pub const NOTHING: [u8; 4] = [72, 72, 72, 255];

/// What a view in stops spans, about mid grey.
const STOPS: [f32; 2] = [-8.0, 8.0];

/// Colours, and what they stand for.
pub struct Colours {
    pub rgba: Vec<u8>,
    pub values: Values,
    pub legend: Option<Legend>,
    pub mean: Option<f64>,
}

impl Colours {
    /// As [`on_display`] has it.
    pub fn of_picture(picture: Picture, exposure: f32, tonemap: ToneMap) -> Self {
        let rgba = on_display(&picture, exposure, tonemap);
        Self { rgba, values: Values::Rgb(Arc::new(picture.rgb)), legend: None, mean: None }
    }

    /// As [`in_false_colour`] has it.
    pub fn of_stops(picture: &Picture, exposure: f32) -> Self {
        let rgba = in_false_colour(picture, exposure);
        let values = picture.rgb.iter().map(|&rgb| stops(rgb, exposure)).collect();
        let legend = Some(Legend { range: STOPS, log: false, signed: false });
        Self { rgba, values: Values::Scalar(Arc::new(values)), legend, mean: None }
    }
}

/// Luminance after exposure, about mid grey.
pub fn stops(rgb: [f32; 3], exposure: f32) -> f32 {
    (luminance(rgb).max(0.0) / false_colour::MID_GREY).log2() + exposure
}

/// As a PNG has it, but for pixels that are not finite: in the window they are [`NOT_FINITE`], in every view and comparison,
/// where a tone curve makes black or white of them. A file is to be looked at without a legend, and keeps the curve's.
pub fn on_display(picture: &Picture, exposure: f32, tonemap: ToneMap) -> Vec<u8> {
    let mut rgba = vec![];
    display::rgba8(picture, exposure, tonemap, &mut rgba);
    mark(&mut rgba, &picture.rgb);
    rgba
}

/// Luminance in stops.
pub fn in_false_colour(picture: &Picture, exposure: f32) -> Vec<u8> {
    let mut rgba = vec![];
    false_colour::luminance_in_stops(&picture.rgb, exposure, STOPS, &mut rgba);
    rgba
}

/// Marks the pixels of `rgba` whose values are not finite.
fn mark(rgba: &mut [u8], values: &[[f32; 3]]) {
    rgba.par_chunks_mut(1 << 14).zip(values.par_chunks(1 << 12)).for_each(|(rgba, values)| {
        let pixels = rgba.chunks_exact_mut(4).zip(values).filter(|(_, rgb)| !rgb.iter().all(|c| c.is_finite()));
        pixels.for_each(|(rgba, _)| rgba.copy_from_slice(&NOT_FINITE));
    });
}

/// From bytes with an alpha of 255 to what textures are made from.
pub fn image(size: [usize; 2], rgba: &[u8]) -> ColorImage {
    let pixels = rgba.par_chunks_exact(4).with_min_len(1 << 14).map(|c| Color32::from_rgb(c[0], c[1], c[2])).collect();
    ColorImage::new(size, pixels)
}

/// Means of squares of pixels, so many that no side is longer than `most` pixels.
pub fn reduced(image: &ColorImage, most: usize) -> ColorImage {
    let size = image.size;
    let factor = size[0].max(size[1]).div_ceil(most.max(1)).max(1);
    let small = size.map(|side| side.div_ceil(factor));
    let mean = |i: usize| {
        let [x0, y0] = [factor * (i % small[0]), factor * (i / small[0])];
        let (mut sum, mut n) = ([0u32; 3], 0);
        for y in y0..(y0 + factor).min(size[1]) {
            for x in x0..(x0 + factor).min(size[0]) {
                let [r, g, b, _] = image.pixels[y * size[0] + x].to_array();
                sum.iter_mut().zip([r, g, b]).for_each(|(sum, c)| *sum += u32::from(c));
                n += 1;
            }
        }
        let [r, g, b] = sum.map(|sum| ((sum + n / 2) / n.max(1)) as u8);
        Color32::from_rgb(r, g, b)
    };
    ColorImage::new(small, (0..small[0] * small[1]).into_par_iter().map(mean).collect())
}

/// Numbers in false colour.
pub fn scalar(values: Vec<f32>, log: bool) -> Colours {
    let mut rgba = vec![];
    let range = false_colour::scalar(&values, &Scale { range: None, log }, &mut rgba);
    if log {
        // It has no place on the scale, and is what one looks for: where nothing is found.
        let zeros = rgba.chunks_exact_mut(4).zip(&values).filter(|(_, value)| **value == 0.0);
        zeros.for_each(|(rgba, _)| rgba.copy_from_slice(&NOTHING));
    }
    let legend = Some(Legend { range, log, signed: false });
    Colours { rgba, values: Values::Scalar(Arc::new(values)), legend, mean: None }
}

/// Where nothing is met it is endlessly far, which has no place on the scale.
pub fn far(colours: &mut Colours) {
    let Values::Scalar(depths) = &colours.values else { return };
    for (rgba, depth) in colours.rgba.chunks_exact_mut(4).zip(depths.iter()) {
        if *depth == f32::INFINITY {
            rgba.copy_from_slice(&NOTHING);
        }
    }
}

/// Three numbers as the colour that `encoded` makes of them, in [0, 1].
pub fn plain(values: Vec<[f32; 3]>, encoded: fn([f32; 3]) -> [f32; 3]) -> Colours {
    let byte = |c: f32| (255.0 * c.clamp(0.0, 1.0) + 0.5) as u8;
    let mut rgba: Vec<_> = values.iter().map(|&v| encoded(v).map(byte)).flat_map(|[r, g, b]| [r, g, b, 255]).collect();
    mark(&mut rgba, &values);
    Colours { rgba, values: Values::Rgb(Arc::new(values)), legend: None, mean: None }
}
