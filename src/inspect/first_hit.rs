//! What a pixel sees first, apart from light: for views of depth, normal and colour, and to select by a click.

use glam::{Vec2, Vec3};
use rayon::prelude::*;

use super::View;
use crate::cpu::surface::{self, Surface};
use crate::cpu::trace::{self, Ray, Seer};
use crate::math::oct;
use crate::scene::{PackedScene, Scene};

/// The first surface on the way from the camera.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    /// Along the ray, metres.
    pub distance: f32,
    /// Along the camera's axis, metres.
    pub depth: f32,
    /// Metres, world space.
    pub position: Vec3,
    /// Shading normal on the camera's side: unit, world space.
    pub normal: Vec3,
    /// Linear RGB with the sRGB primaries, textures included, each in [0, 1].
    pub base_color: Vec3,
    /// Index into [`Scene::materials`].
    pub material: u32,
    /// What [`Hit::object`] makes a mesh or a sphere of.
    pub object: u32,
}

/// What a surface is part of.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Object {
    /// Index into [`Scene::meshes`].
    Mesh(usize),
    /// Index into [`Scene::spheres`].
    Sphere(usize),
}

impl Hit {
    /// In the scene that was packed.
    pub fn object(&self, scene: &Scene) -> Object {
        let index = self.object as usize;
        match index.checked_sub(scene.meshes.len()) {
            None => Object::Mesh(index),
            Some(sphere) => Object::Sphere(sphere),
        }
    }
}

/// A hit, in fewer bytes.
#[derive(Clone, Copy, Debug)]
struct Pixel {
    /// Infinite: nothing was hit.
    distance: f32,
    /// Octahedral.
    normal: u32,
    base_color: [f32; 3],
    material: u32,
    object: u32,
}

/// The first hit through the centre of each pixel of a film.
#[derive(Clone, Debug)]
pub struct FirstHits {
    view: View,
    pixels: Vec<Pixel>,
}

impl FirstHits {
    /// One ray a pixel, on all threads. Where a surface is half transparent, it is there for some pixels and not for
    /// others.
    pub fn trace(scene: &PackedScene, view: &View) -> Self {
        let [width, height] = view.film_size();
        let pixels = (0..width * height)
            .into_par_iter()
            .with_min_len(256)
            .map(|i| {
                let centre = Vec2::new((i % width) as f32, (i / width) as f32) + 0.5;
                let found = first(scene, view, centre, i);
                found.map_or(NOTHING, |(distance, s)| Pixel {
                    distance,
                    normal: oct::encode(s.shading_normal),
                    base_color: s.base_color.to_array(),
                    material: s.material,
                    object: s.object,
                })
            })
            .collect();
        Self { view: *view, pixels }
    }

    /// As it was traced.
    pub fn view(&self) -> &View {
        &self.view
    }

    /// Of the film pixel (`x`, `y`); none where nothing is hit, or outside.
    pub fn hit(&self, x: u32, y: u32) -> Option<Hit> {
        let [width, height] = self.view.film_size();
        let inside = x < width && y < height;
        let pixel = inside.then(|| self.pixels[(y * width + x) as usize])?;
        let (origin, direction) = self.view.ray(Vec2::new(x as f32, y as f32) + 0.5);
        (pixel.distance < f32::INFINITY).then(|| Hit {
            distance: pixel.distance,
            depth: pixel.distance * direction.dot(self.view.camera.forward.into()),
            position: origin + direction * pixel.distance,
            normal: oct::decode(pixel.normal),
            base_color: pixel.base_color.into(),
            material: pixel.material,
            object: pixel.object,
        })
    }

    /// Depth along the camera's axis, metres, `[h·w]`, row-major; infinite where nothing is hit.
    pub fn depths(&self) -> Vec<f32> {
        self.each(|hit| hit.map_or(f32::INFINITY, |hit| hit.depth))
    }

    /// Shading normals, unit, world space, `[h·w]`, row-major; zero where nothing is hit.
    pub fn normals(&self) -> Vec<[f32; 3]> {
        self.each(|hit| hit.map_or([0.0; 3], |hit| hit.normal.to_array()))
    }

    /// Base colours, linear, `[h·w]`, row-major; zero where nothing is hit.
    pub fn base_colors(&self) -> Vec<[f32; 3]> {
        self.pixels.iter().map(|pixel| pixel.base_color).collect()
    }

    fn each<T: Send>(&self, value: impl Fn(Option<Hit>) -> T + Sync) -> Vec<T> {
        let [width, height] = self.view.film_size();
        let pixels = (0..width * height).into_par_iter().with_min_len(4096);
        pixels.map(|i| value(self.hit(i % width, i / width))).collect()
    }
}

const NOTHING: Pixel =
    Pixel { distance: f32::INFINITY, normal: 0, base_color: [0.0; 3], material: u32::MAX, object: u32::MAX };

/// What the film shows first at `at`, in film coordinates; none where nothing is hit, or outside.
pub fn pick(scene: &PackedScene, view: &View, at: Vec2) -> Option<Hit> {
    let [x, y] = view.pixel(at)?;
    let (distance, s) = first(scene, view, at, y * view.film_size()[0] + x)?;
    let (_, direction) = view.ray(at);
    Some(Hit {
        distance,
        depth: distance * direction.dot(view.camera.forward.into()),
        position: s.position,
        normal: s.shading_normal,
        base_color: s.base_color,
        material: s.material,
        object: s.object,
    })
}

/// Distance and surface.
fn first(scene: &PackedScene, view: &View, at: Vec2, alpha_seed: u32) -> Option<(f32, Found)> {
    let (origin, direction) = view.ray(at);
    let ray = Ray { origin, direction, t_max: f32::INFINITY, alpha_seed, seer: Seer::Eye };
    let hit = trace::nearest(scene, &ray)?;
    let Surface { position, shading_normal, base_color, material, .. } = surface::at(scene, &hit, origin, direction);
    let object = scene.primitives[hit.primitive as usize].object;
    Some((hit.t, Found { position, shading_normal, base_color, material, object }))
}

/// Of a surface, what is told here.
struct Found {
    position: Vec3,
    shading_normal: Vec3,
    base_color: Vec3,
    material: u32,
    object: u32,
}
