//! The points and queries of the comparison, as raw little-endian f32 triples, so that every program reads the same bytes.

use std::f32::consts::PI;
use std::fs;
use std::path::Path;

use anyhow::Result;
use fastrand::Rng;
use glam::{Vec3, vec3};

const SEED: u64 = 1;
const N_PHOTONS: usize = 500_000;
/// Pixels.
const IMAGE: [usize; 2] = [1920, 1080];
/// Metres, from the origin.
const ROOM: Vec3 = vec3(4.0, 2.5, 5.0);
const SPHERE: (Vec3, f32) = (vec3(2.3, 0.7, 2.8), 0.6);
const EYE: Vec3 = vec3(2.0, 1.3, 0.2);
/// Half the horizontal field of view, tangent.
const TAN_HALF_FOV: f32 = 0.8;
/// Photons within the radius of a query on a flat surface, far from edges.
const NEIGHBOURS: f32 = 50.0;
const N_SAMPLES: usize = 1_000_000;
const N_QUERIES: usize = 32_768;

/// Writes `photons`, `camera`, `shuffled`, `samples` and `queries` (.f32) and `radius`, that of the photon case, into
/// `folder`.
pub fn generate(folder: &Path) -> Result<()> {
    fs::create_dir_all(folder)?;
    let mut rng = Rng::with_seed(SEED);
    let photons: Vec<Vec3> = (0..N_PHOTONS).map(|_| on_surface(&mut rng)).collect();
    let mut queries: Vec<Vec3> = (0..IMAGE[1]).flat_map(|y| (0..IMAGE[0]).map(move |x| seen(x, y))).collect();
    let density = N_PHOTONS as f32 / area();
    let radius = (NEIGHBOURS / (PI * density)).sqrt();
    write(folder, "photons", &photons)?;
    write(folder, "camera", &queries)?;
    rng.shuffle(&mut queries);
    write(folder, "shuffled", &queries)?;
    write(folder, "samples", &uniform(&mut rng, N_SAMPLES))?;
    write(folder, "queries", &uniform(&mut rng, N_QUERIES))?;
    fs::write(folder.join("radius"), radius.to_string())?;
    Ok(())
}

fn write(folder: &Path, name: &str, points: &[Vec3]) -> Result<()> {
    Ok(fs::write(folder.join(name).with_extension("f32"), bytemuck::cast_slice::<Vec3, u8>(points))?)
}

fn uniform(rng: &mut Rng, n: usize) -> Vec<Vec3> {
    (0..n).map(|_| vec3(rng.f32(), rng.f32(), rng.f32())).collect()
}

/// Of two opposite walls, by the axis across.
fn walls() -> [f32; 3] {
    [2.0 * ROOM.y * ROOM.z, 2.0 * ROOM.x * ROOM.z, 2.0 * ROOM.x * ROOM.y]
}

fn area() -> f32 {
    walls().iter().sum::<f32>() + 4.0 * PI * SPHERE.1 * SPHERE.1
}

/// Uniform over the walls and the sphere.
fn on_surface(rng: &mut Rng) -> Vec3 {
    let mut at = rng.f32() * area();
    for (axis, wall) in walls().into_iter().enumerate() {
        if at < wall {
            let mut p = vec3(rng.f32(), rng.f32(), rng.f32()) * ROOM;
            p[axis] = if rng.bool() { ROOM[axis] } else { 0.0 };
            return p;
        }
        at -= wall;
    }
    let (z, phi) = (2.0 * rng.f32() - 1.0, 2.0 * PI * rng.f32());
    let sine = (1.0 - z * z).max(0.0).sqrt();
    SPHERE.0 + SPHERE.1 * vec3(sine * phi.cos(), sine * phi.sin(), z)
}

/// What the pixel's centre shows.
fn seen(x: usize, y: usize) -> Vec3 {
    let [width, height] = IMAGE.map(|n| n as f32);
    let across = (2.0 * (x as f32 + 0.5) / width - 1.0) * TAN_HALF_FOV;
    let up = (1.0 - 2.0 * (y as f32 + 0.5) / height) * TAN_HALF_FOV * height / width;
    let d = vec3(across, up, 1.0).normalize();
    let to = SPHERE.0 - EYE;
    let middle = to.dot(d);
    let inside = SPHERE.1 * SPHERE.1 - (to.length_squared() - middle * middle);
    if inside > 0.0 {
        return EYE + (middle - inside.sqrt()) * d;
    }
    let wall = Vec3::select(d.cmpgt(Vec3::ZERO), ROOM, Vec3::ZERO);
    let t = (wall - EYE) / d;
    let axis = (0..3).min_by(|&a, &b| t[a].total_cmp(&t[b])).unwrap_or(0);
    let mut p = EYE + t[axis] * d;
    p[axis] = wall[axis];
    p
}
