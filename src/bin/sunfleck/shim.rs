//! Stand-ins until the loader and the backends are here.

use std::path::Path;
use sunfleck::ppm::FirstRadius;
use sunfleck::scene::{Camera, Scene};

pub fn parse_count(text: &str) -> Result<u32, String> {
    let wrong = || format!("{text:?} is not a count such as 500000, 500k or 2M");
    let (digits, factor) = match text.trim().chars().last() {
        Some('k' | 'K') => (&text[..text.len() - 1], 1e3),
        Some('M' | 'm') => (&text[..text.len() - 1], 1e6),
        _ => (text, 1.0),
    };
    let value = digits.trim().parse::<f64>().map_err(|_| wrong())? * factor;
    if value < 0.0 || value > f64::from(u32::MAX) || value.fract() != 0.0 { Err(wrong()) } else { Ok(value as u32) }
}

#[derive(Default)]
pub struct Settings {
    pub scene: Option<std::path::PathBuf>,
    pub size: Option<[u32; 2]>,
    pub photons: Option<u32>,
    pub alpha: Option<f32>,
    pub radius: Option<FirstRadius>,
    pub exposure: Option<f32>,
    pub camera: Option<String>,
}

impl Settings {
    pub fn load(path: &Path) -> Result<Self, std::io::Error> {
        std::fs::read(path)?;
        Ok(Self::default())
    }
    pub fn set(&mut self, pair: &str) -> Result<(), String> {
        Err(format!("unknown key {pair:?}"))
    }
    pub fn apply_to_scene(&self, _: &mut Scene) -> Result<(), std::io::Error> {
        Ok(())
    }
}

pub fn default_camera(_: &Scene) -> Camera {
    Camera {
        name: "default".into(),
        world_from_camera: glam::Affine3A::IDENTITY,
        projection: sunfleck::scene::Projection::Perspective { yfov: 1.0 },
        aperture_radius: 0.0,
        focus_distance: 1.0,
        aspect: None,
    }
}
