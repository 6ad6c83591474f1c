//! Stand-ins until the loader and the backends are here.

use std::path::Path;
use sunfleck::layout::{self, EyeVertex, Frame, Photon};
use sunfleck::ppm::{Error, Film, FirstRadius, Params, StageTimes, Stages, film};
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

pub const NAMES: [(&str, &str); 2] = [("cornell", "a box"), ("glass", "a goblet")];

pub struct Loaded {
    pub scene: Scene,
    pub warnings: Vec<String>,
}

pub fn shipped(name: &str) -> Option<Scene> {
    NAMES.iter().any(|n| n.0 == name).then(Scene::default)
}

pub fn load(path: &Path) -> Result<Loaded, std::io::Error> {
    std::fs::read(path)?;
    Ok(Loaded { scene: Scene::default(), warnings: vec!["nothing is read yet".into()] })
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

pub struct Gradient {
    film: Film,
    n_paths: u32,
}

impl Gradient {
    pub fn new(params: &Params) -> Self {
        let [width, height] = params.film_size();
        let film = Film { width, height, n_iterations: 0, pixels: vec![[0.0; 4]; (width * height) as usize] };
        Self { film, n_paths: params.n_paths }
    }
}

impl Stages for Gradient {
    fn device(&self) -> String {
        "gradient".into()
    }
    fn camera(&self) -> layout::Camera {
        layout::Camera { right: [1.0, 0.0, 0.0], up: [0.0, 1.0, 0.0], forward: [0.0, 0.0, -1.0], ..Default::default() }
    }
    fn trace_eye(&mut self, _: &Frame) -> Result<(), Error> {
        Ok(())
    }
    fn trace_photons(&mut self, _: &Frame) -> Result<(), Error> {
        std::thread::sleep(std::time::Duration::from_millis(100));
        Ok(())
    }
    fn build_index(&mut self, _: &Frame) -> Result<(), Error> {
        Ok(())
    }
    fn gather(&mut self, _: &Frame) -> Result<(), Error> {
        Ok(())
    }
    fn accumulate(&mut self, frame: &Frame) -> Result<(), Error> {
        self.film.n_iterations = frame.iteration;
        for (i, pixel) in self.film.pixels.iter_mut().enumerate() {
            let (x, y) = (i as u32 % frame.width + frame.crop_x, i as u32 / frame.width + frame.crop_y);
            let rgb = [x as f32 / frame.full_width as f32, y as f32 / frame.full_height as f32, 0.2];
            film::add(pixel, frame.iteration, rgb);
        }
        Ok(())
    }
    fn set_first_radii(&mut self, _: &[f32]) -> Result<(), Error> {
        Ok(())
    }
    fn eye_vertices(&mut self) -> Result<Vec<EyeVertex>, Error> {
        Ok(vec![EyeVertex::default(); self.film.pixels.len()])
    }
    fn set_eye_vertices(&mut self, _: &[EyeVertex]) -> Result<(), Error> {
        Ok(())
    }
    fn photons(&mut self) -> Result<Vec<Photon>, Error> {
        Ok(vec![])
    }
    fn set_photons(&mut self, _: &[Photon]) -> Result<(), Error> {
        Ok(())
    }
    fn radiance(&mut self) -> Result<Vec<[f32; 3]>, Error> {
        Ok(vec![])
    }
    fn film(&mut self) -> Result<Film, Error> {
        Ok(self.film.clone())
    }
    fn n_photons(&self) -> u32 {
        self.n_paths * 2
    }
    fn times(&mut self) -> Result<StageTimes, Error> {
        Ok(StageTimes { photons: 0.1, ..Default::default() })
    }
}
