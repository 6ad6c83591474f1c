//! OpenEXR: scene-linear 32-bit float, with what is needed to make the picture again in the header.
//!
//! | attribute | type | |
//! |---|---|---|
//! | `dataWindow`, `displayWindow` | box | the part computed, in the whole picture |
//! | `chromaticities` | | sRGB's (ITU-R BT.709, D65) |
//! | `software`, `sunfleckVersion` | string | `Sunfleck 0.1.0 (commit)`; version and commit alone |
//! | `adapter`, `scene`, `command` | string | device, SCENE as given, the whole command line |
//! | `index`, `accelerator` | string | what found photons (`tree`, `hardware`), and surfaces (`bvh`, `kd`) |
//! | `seed`, `iterations`, `photonsPerIteration` | int | double where above 2³¹ − 1; photon *paths* |
//! | `samplesPerPixel` | int | `iterations`, under the name that other tools read |
//! | `alpha`, `firstRadius`, `lastRadius` | float | metres; the median where each pixel has its own |
//! | `renderTimeSeconds` | float | from the first iteration to the last |
//! | `capDate`, `utcOffset` | | when it was saved, UTC |
//! | `screenWindowWidth` | float | what the whole picture is wide: at distance 1; metres if orthographic |
//! | `projection` | string | `perspective` or `orthographic` |
//! | `worldToCamera` | m44f | row vectors, as in Imath: p·M; +x right, +y up, looking along −z |
//!
//! Channels: `R`, `G`, `B`, and on request `Variance.Y`, the estimated variance of the pixel's luminance.

mod read;

pub use read::{MAX_READ_PIXELS, data_window, read};

use std::collections::HashMap;
use std::io;
use std::path::Path;
use std::time::{SystemTime, UNIX_EPOCH};

use ::exr::meta::attribute::{AttributeValue, Chromaticities, IntegerBounds, Text};
use ::exr::prelude::{
    AnyChannel, AnyChannels, Encoding, FlatSamples, ImageAttributes, Layer, LayerAttributes, Vec2, WritableImage,
};
use glam::{Mat4, Vec3, Vec4};

use super::{Error, Picture, VERSION, atomic};
use crate::layout::Camera;
use crate::ppm::{Params, RadiusSchedule};

/// Where a picture came from.
#[derive(Clone, Debug, Default)]
pub struct Header {
    /// As given.
    pub scene: String,
    /// The command line.
    pub command: String,
    /// Device that computed it.
    pub adapter: String,
    /// What found photons: `tree` or `hardware`.
    pub index: String,
    /// What found the surface that a ray meets: `bvh` or `kd`.
    pub accelerator: String,
    /// Of the random numbers.
    pub seed: u32,
    /// Of the radius schedule.
    pub alpha: f32,
    /// Of the first iteration, metres; the median over the pixels.
    pub first_radius: f32,
    /// Of the last iteration, metres, likewise.
    pub last_radius: f32,
    /// In the mean.
    pub iterations: u32,
    /// Photon paths emitted an iteration.
    pub photons_per_iteration: u32,
    /// Wall clock.
    pub seconds: f64,
    /// The camera.
    pub camera: Camera,
}

impl Header {
    /// What an estimate of `params` says of itself after so many `iterations`; `first_radius`: metres, the median over the
    /// pixels. The rest is empty.
    pub fn of(params: &Params, first_radius: f32, iterations: u32) -> Self {
        Self {
            seed: params.seed,
            alpha: params.alpha,
            first_radius,
            last_radius: first_radius * RadiusSchedule::new(params.alpha).scale(iterations),
            iterations,
            photons_per_iteration: params.n_paths,
            ..Self::default()
        }
    }
}

/// Writes `picture`, losslessly compressed.
pub fn write(path: &Path, picture: &Picture, header: &Header) -> Result<(), Error> {
    let [width, height] = picture.crop_size();
    let channel = |name: &str, samples: Vec<f32>| AnyChannel::new(name, FlatSamples::F32(samples));
    let mut channels: Vec<_> = ["R", "G", "B"]
        .into_iter()
        .enumerate()
        .map(|(c, name)| channel(name, picture.rgb.iter().map(|rgb| rgb[c]).collect()))
        .collect();
    channels.extend(picture.variance.iter().map(|v| channel("Variance.Y", v.clone())));
    let layer = Layer::new(
        (width, height),
        layer_attributes(picture, header),
        Encoding::SMALL_LOSSLESS,
        AnyChannels::sort(channels.into()),
    );
    let mut image = ::exr::prelude::Image::from_layer(layer);
    image.attributes = ImageAttributes {
        display_window: IntegerBounds::from_dimensions((picture.size[0] as usize, picture.size[1] as usize)),
        chromaticities: Some(Chromaticities {
            red: Vec2(0.64, 0.33),
            green: Vec2(0.30, 0.60),
            blue: Vec2(0.15, 0.06),
            white: Vec2(0.3127, 0.3290),
        }),
        ..image.attributes
    };
    atomic::write(path, |writer| image.write().to_buffered(writer).map_err(to_io))
}

fn layer_attributes(picture: &Picture, header: &Header) -> LayerAttributes {
    // OpenEXR's strings are UTF-8; the crate's checked constructors refuse all but Latin-1.
    let text = |s: &str| Text::from_slice_unchecked(s.as_bytes());
    let count = |n: u32| i32::try_from(n).map_or(AttributeValue::F64(f64::from(n)), AttributeValue::I32);
    let projection = if header.camera.orthographic == 1 { "orthographic" } else { "perspective" };
    let other: HashMap<Text, AttributeValue> = [
        ("sunfleckVersion", AttributeValue::Text(text(VERSION))),
        ("scene", AttributeValue::Text(text(&header.scene))),
        ("command", AttributeValue::Text(text(&header.command))),
        ("adapter", AttributeValue::Text(text(&header.adapter))),
        ("index", AttributeValue::Text(text(&header.index))),
        ("accelerator", AttributeValue::Text(text(&header.accelerator))),
        ("projection", AttributeValue::Text(text(projection))),
        ("seed", count(header.seed)),
        ("iterations", count(header.iterations)),
        ("samplesPerPixel", count(header.iterations)),
        ("photonsPerIteration", count(header.photons_per_iteration)),
        ("alpha", AttributeValue::F32(header.alpha)),
        ("firstRadius", AttributeValue::F32(header.first_radius)),
        ("lastRadius", AttributeValue::F32(header.last_radius)),
        ("renderTimeSeconds", AttributeValue::F32(header.seconds as f32)),
    ]
    .map(|(name, value)| (text(name), value))
    .into();
    LayerAttributes {
        layer_position: Vec2(picture.crop[0] as i32, picture.crop[1] as i32),
        software_name: Some(text(&format!("Sunfleck {VERSION}"))),
        capture_date: Some(text(&utc_date(SystemTime::now()))),
        utc_offset: Some(0.0),
        // Of the display window, whatever part of it was computed.
        screen_window_width: 2.0 * header.camera.half_width,
        world_to_camera: Some(camera_from_world(&header.camera).to_cols_array()),
        other,
        ..LayerAttributes::default()
    }
}

/// Column-major for column vectors, which is row-major for Imath's row vectors.
fn camera_from_world(camera: &Camera) -> Mat4 {
    let axis = |v: [f32; 3], w| Vec4::from((Vec3::from(v), w));
    let world_from_camera = Mat4::from_cols(
        axis(camera.right, 0.0),
        axis(camera.up, 0.0),
        axis(camera.forward.map(|c| -c), 0.0),
        axis(camera.position, 1.0),
    );
    if world_from_camera.determinant() == 0.0 { Mat4::IDENTITY } else { world_from_camera.inverse() }
}

/// "YYYY:MM:DD hh:mm:ss", UTC, as `capDate` wants it.
fn utc_date(time: SystemTime) -> String {
    let seconds = time.duration_since(UNIX_EPOCH).map_or(0, |d| d.as_secs());
    let (mut day, second) = (seconds / 86_400, seconds % 86_400);
    let leap = |y: u64| y.is_multiple_of(4) && (!y.is_multiple_of(100) || y.is_multiple_of(400));
    let mut year = 1970;
    while day >= 365 + u64::from(leap(year)) {
        day -= 365 + u64::from(leap(year));
        year += 1;
    }
    let mut month = 0;
    let lengths = [31, 28 + u64::from(leap(year)), 31, 30, 31, 30, 31, 31, 30, 31, 30, 31];
    while day >= lengths[month] {
        day -= lengths[month];
        month += 1;
    }
    let (hour, minute, second) = (second / 3600, second / 60 % 60, second % 60);
    format!("{year:04}:{:02}:{:02} {hour:02}:{minute:02}:{second:02}", month + 1, day + 1)
}

fn to_io(error: ::exr::error::Error) -> io::Error {
    match error {
        ::exr::error::Error::Io(e) => e,
        e => io::Error::other(e.to_string()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::time::Duration;

    fn picture() -> Picture {
        Picture {
            size: [20, 10],
            crop: [3, 2, 8, 6],
            rgb: (0..20).map(|i| [i as f32, 1e-30 * i as f32, -0.5]).collect(),
            variance: Some((0..20).map(|i| i as f32).collect()),
        }
    }

    #[test]
    fn reads_back_bit_for_bit() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.exr");
        write(&path, &picture(), &Header::default()).unwrap();
        assert_eq!(read(&path).unwrap(), Picture { variance: None, ..picture() });
    }

    #[test]
    fn the_header_says_where_it_came_from() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.exr");
        let camera = Camera {
            right: [0.0, 0.0, -1.0],
            up: [0.0, 1.0, 0.0],
            forward: [-1.0, 0.0, 0.0],
            position: [5.0, 1.0, 0.0],
            ..Camera::default()
        };
        let params = Params { seed: u32::MAX, alpha: 0.5, n_paths: 1_234, ..Params::new(20, 10) };
        let header = Header {
            scene: "söne".into(),
            adapter: "llvmpipe".into(),
            index: "tree".into(),
            accelerator: "bvh".into(),
            seconds: 2.5,
            camera,
            ..Header::of(&params, 0.25, 2)
        };
        write(&path, &picture(), &header).unwrap();
        let meta = ::exr::meta::MetaData::read_from_file(&path, true).unwrap();
        let own = &meta.headers[0].own_attributes;
        let get = |name: &str| own.other[&Text::from(name)].clone();
        assert_eq!(get("seed"), AttributeValue::F64(f64::from(u32::MAX)));
        assert_eq!(get("iterations"), AttributeValue::I32(2));
        assert_eq!(get("photonsPerIteration"), AttributeValue::I32(1_234));
        assert_eq!(get("alpha"), AttributeValue::F32(0.5));
        assert_eq!(get("firstRadius"), AttributeValue::F32(0.25));
        // r₂² = r₁² · (1+α)/2
        let AttributeValue::F32(last) = get("lastRadius") else { panic!("a float") };
        assert!((last - 0.25 * 0.75f32.sqrt()).abs() < 1e-6, "{last}");
        for (name, value) in [("sunfleckVersion", VERSION), ("index", "tree"), ("accelerator", "bvh")] {
            assert_eq!(get(name), AttributeValue::Text(Text::from(value)));
        }
        let m = Mat4::from_cols_array(&own.world_to_camera.unwrap());
        assert_eq!(m.transform_point3(Vec3::new(5.0, 1.0, 0.0)), Vec3::ZERO);
        assert_eq!(m.transform_point3(Vec3::new(3.0, 1.0, 0.0)), Vec3::new(0.0, 0.0, -2.0));
        assert_eq!(meta.headers[0].shared_attributes.display_window.size, Vec2(20, 10));
        assert_eq!(own.layer_position, Vec2(3, 2));
    }

    #[test]
    fn dates() {
        let at = |s| utc_date(UNIX_EPOCH + Duration::from_secs(s));
        assert_eq!(at(0), "1970:01:01 00:00:00");
        assert_eq!(at(951_782_400), "2000:02:29 00:00:00");
        assert_eq!(at(1_735_689_599), "2024:12:31 23:59:59");
    }
}
