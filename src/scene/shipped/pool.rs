//! `pool`: sun through waves onto a mosaic floor, seen from the terrace.
//!
//! The water is the sheet of its waves, which goes on a little way into the walls: below it a path is in water until it
//! comes out again, so floor and walls need no surface of their own.

use std::sync::Arc;

use glam::{Affine3A, Quat, Vec2, Vec3};

use super::curved::{Profile, spline};
use super::pattern;
use super::shape::{Random, Shape, Tiling};
use super::{Builder, glossy, srgb};
use crate::scene::{Environment, Material, PunctualKind, PunctualLight, Scene};

/// Half the inner size of the pool along x and z, metres.
const HALF: Vec2 = Vec2::new(3.0, 2.0);
/// Depth of the floor below the calm water, metres.
const DEPTH: f32 = 1.35;
/// Height of the terrace above the calm water, metres.
const TERRACE: f32 = 0.14;
/// How far the water goes into the walls, metres.
const OVERLAP: f32 = 0.01;
/// Cells of the waves along x and z.
const CELLS: [usize; 2] = [384, 256];

/// A sine wave on the water.
struct Wave {
    /// Wave vector, rad/m.
    k: Vec2,
    /// Metres.
    amplitude: f32,
    /// Radians.
    phase: f32,
}

/// Waves of 0.3 m to 2.4 m, mostly from one side, steepness alike in every octave.
fn waves() -> Vec<Wave> {
    let mut random = Random::new(20);
    let n = 44;
    (0..n)
        .map(|i| {
            let t = (i as f32 + random.unit()) / n as f32;
            let length = 0.30 * 8.0f32.powf(t);
            let angle = 0.6 + 1.5 * (random.unit() + random.unit() + random.unit() - 1.5);
            let k = Vec2::new(angle.cos(), angle.sin()) * (std::f32::consts::TAU / length);
            let amplitude = 0.0036 * length.powf(0.9) * random.between(0.6, 1.4);
            Wave { k, amplitude, phase: random.between(0.0, std::f32::consts::TAU) }
        })
        .collect()
}

/// The surface of the water, air in front.
fn water() -> Shape {
    let waves = waves();
    let half = HALF + OVERLAP;
    let surface = Shape::sheet(CELLS[0], CELLS[1], |u, v| {
        let (x, z) = ((2.0 * u - 1.0) * half.x, (1.0 - 2.0 * v) * half.y);
        let (mut height, mut slope) = (0.0, Vec2::ZERO);
        for wave in &waves {
            let (sin, cos) = (wave.k.dot(Vec2::new(x, z)) + wave.phase).sin_cos();
            height += wave.amplitude * sin;
            slope += wave.k * (wave.amplitude * cos);
        }
        (Vec3::new(x, height, z), Vec3::new(-slope.x, 1.0, -slope.y).normalize())
    });
    surface.without_uvs()
}

pub(super) fn scene() -> Scene {
    let mut b = Builder::default();
    let mut matter = Material::glass("water", 1.333);
    matter.absorption = Vec3::new(0.27, 0.050, 0.030);
    let water_material = b.material(matter);
    b.add("water", water(), water_material);

    basin(&mut b);
    terrace(&mut b);
    things(&mut b);

    b.scene.lights.push(PunctualLight {
        name: "sun".into(),
        position: Vec3::ZERO,
        direction: Vec3::new(-0.45, -1.0, -0.35).normalize(),
        intensity: Vec3::new(2.5, 2.3, 1.95),
        kind: PunctualKind::Directional,
    });
    b.scene.environment = Some(sky());
    b.camera("garden", Vec3::new(2.55, 2.85, 4.05), Vec3::new(-0.30, -0.62, -0.42), 40.0, 16.0 / 9.0);
    b.scene
}

/// Mosaic walls, floor and steps.
fn basin(b: &mut Builder) {
    let texture = b.image(pattern::mosaic(16), [0.40, 0.40]);
    let mut mosaic = Material::diffuse("mosaic", Vec3::splat(0.95));
    mosaic.base_color_texture = Some(texture);
    let mosaic = b.material(mosaic);
    let (x, y, z) = (HALF.x, TERRACE - 0.055, HALF.y);
    let low = -DEPTH;
    let (w, h, d) = (Vec3::X * 2.0 * x, Vec3::Y * (y + DEPTH), Vec3::Z * 2.0 * z);
    let basin = [
        Shape::quad(Vec3::new(-x, low, z), w, -d),
        Shape::quad(Vec3::new(-x, low, -z), w, h),
        Shape::quad(Vec3::new(x, low, z), -w, h),
        Shape::quad(Vec3::new(-x, low, z), -d, h),
        Shape::quad(Vec3::new(x, low, -z), d, h),
    ];
    b.add("basin", Shape::union(basin), mosaic);
    // Wide steps down from the far wall; they go on a millimetre into walls and floor.
    let steps = [(0.42, -0.30), (0.84, -0.65), (1.26, -1.00)].map(|(reach, level)| {
        Shape::cuboid(Vec3::new(-x - 0.001, low - 0.001, -z - 0.001), Vec3::new(x + 0.001, level, reach - z))
    });
    b.add("steps", Shape::union(steps), mosaic);
}

/// Coping around the pool and the stone terrace beyond.
fn terrace(b: &mut Builder) {
    let coping = b.material(glossy("coping", srgb(0xDDD6C8), 0.55));
    let (x, z, w) = (HALF.x, HALF.y, 0.32);
    let mut stones = Shape::default();
    let mut lay = |from: Vec3, along: Vec3, length: f32, across: Vec3| {
        let n = (length / 0.62).round();
        for i in 0..n as usize {
            let (s0, s1) = (length * i as f32 / n + 0.002, length * (i as f32 + 1.0) / n - 0.002);
            let (p, q) = (from + along * s0, from + along * s1 + across * w);
            let (min, max) = (p.min(q), p.max(q));
            let (low, high) = (Vec3::new(min.x, TERRACE - 0.06, min.z), Vec3::new(max.x, TERRACE, max.z));
            stones.append(Shape::rounded_cuboid(low, high, 0.012, 3));
        }
    };
    let lip = 0.025;
    let (xi, zi) = (x - lip, z - lip);
    lay(Vec3::new(-xi - w, 0.0, zi), Vec3::X, 2.0 * (xi + w), Vec3::Z);
    lay(Vec3::new(-xi - w, 0.0, -zi), Vec3::X, 2.0 * (xi + w), -Vec3::Z);
    lay(Vec3::new(xi, 0.0, -zi), Vec3::Z, 2.0 * zi, Vec3::X);
    lay(Vec3::new(-xi, 0.0, -zi), Vec3::Z, 2.0 * zi, -Vec3::X);
    b.add("coping", stones, coping);

    let stone = b.material(glossy("terrace", srgb(0xC4B196), 0.7));
    let joint = b.material(Material::diffuse("terrace joint", srgb(0x6E6456)));
    let (outer_x, outer_z) = (x + 2.2, z + 2.2);
    let ground = TERRACE - 0.012;
    // Rectangles (corner and size) that leave a hole of half-size (hx, hz).
    let around = |hx: f32, hz: f32| {
        [
            (Vec3::new(-outer_x, ground, outer_z), 2.0 * outer_x, outer_z - hz),
            (Vec3::new(-outer_x, ground, -hz), 2.0 * outer_x, outer_z - hz),
            (Vec3::new(-outer_x, ground, hz), outer_x - hx, 2.0 * hz),
            (Vec3::new(hx, ground, hz), outer_x - hx, 2.0 * hz),
        ]
    };
    let base = around(x + 0.2, z + 0.2).map(|(corner, w, h)| Shape::quad(corner, Vec3::X * w, -Vec3::Z * h));
    b.add("terrace joint", Shape::union(base), joint);
    let tiling = Tiling {
        pitch: Vec2::new(0.6, 0.4),
        joint: 0.006,
        height: 0.006,
        bevel: 0.004,
        bond: 0.5,
        tilt: 0.002,
        variation: 0.25,
        seed: 3,
    };
    let slabs = around(xi + w - 0.005, zi + w - 0.005)
        .map(|(corner, w, h)| tiling.over(corner, Vec3::X * w, -Vec3::Z * h, |_| true));
    b.add("terrace", Shape::union(slabs), stone);

    let plaster = b.material(Material::diffuse("garden wall", srgb(0xE6DFD2)));
    let (t, top) = (0.22, 1.25);
    let low = Vec3::new(-outer_x - t, ground - 0.01, -outer_z - t);
    let walls = [
        Shape::rounded_cuboid(low, Vec3::new(outer_x, top, -outer_z + 0.02), 0.02, 3),
        Shape::rounded_cuboid(low, Vec3::new(-outer_x + 0.02, top + 0.001, outer_z), 0.02, 3),
    ];
    b.add("garden wall", Shape::union(walls), plaster);
}

/// A ladder, a ball, a planter.
fn things(b: &mut Builder) {
    let chrome = b.material(Material::metal("chrome", Vec3::new(0.62, 0.63, 0.65), 0.08));
    let mut ladder = Shape::default();
    let x = HALF.x;
    for z in [-0.62, -0.14] {
        let points = [
            Vec3::new(x + 0.62, TERRACE - 0.02, z),
            Vec3::new(x + 0.61, 0.60, z),
            Vec3::new(x + 0.42, 0.88, z),
            Vec3::new(x + 0.10, 0.86, z),
            Vec3::new(x - 0.11, 0.58, z),
            Vec3::new(x - 0.13, 0.0, z),
            Vec3::new(x - 0.13, -0.60, z),
            Vec3::new(x - 0.13, -0.98, z),
        ];
        ladder.append(Shape::tube(&spline(&points, 12), |_| 0.021, 24));
    }
    for k in 0..3 {
        let y = -0.22 - 0.29 * k as f32;
        ladder.append(Shape::rod(Vec3::new(x - 0.13, y, -0.62), Vec3::new(x - 0.13, y, -0.14), 0.017, 20));
    }
    let across = Affine3A::from_translation(Vec3::Z * 0.30) * Affine3A::from_scale(Vec3::new(-1.0, 1.0, 1.0));
    b.add("ladder", ladder.transformed(across), chrome);

    let rubber = b.material(glossy("beach ball", Vec3::ONE, 0.25));
    let radius = 0.23;
    let colors = [0xE4E0D8, 0xE03A2F, 0xE4E0D8, 0x2B6FC4, 0xE4E0D8, 0xE4AC28].map(srgb);
    let n = 8;
    let mut ball = Shape::default();
    for (k, color) in colors.iter().enumerate() {
        let from = std::f32::consts::TAU * k as f32 / 6.0;
        let panel = Shape::sheet(n, 4 * n, |u, v| {
            let (azimuth, polar) = (from + u * std::f32::consts::TAU / 6.0, 0.06 + v * (std::f32::consts::PI - 0.12));
            let normal = Vec3::new(polar.sin() * azimuth.cos(), polar.cos(), polar.sin() * azimuth.sin());
            (normal * radius, normal)
        });
        ball.append(panel.colored(*color));
    }
    for up in [1.0, -1.0] {
        let rim = radius * 0.06f32.sin();
        let height = radius * 0.06f32.cos();
        let disc = Profile::start(rim, height).to(rim * 0.5, height + 0.0003).to(0.0, height + 0.0004).lathe(6 * n);
        let turn = if up > 0.0 { Quat::IDENTITY } else { Quat::from_rotation_x(std::f32::consts::PI) };
        ball.append(disc.transformed(Affine3A::from_quat(turn)).colored(srgb(0xE4E0D8)));
    }
    let pose = Affine3A::from_rotation_translation(
        Quat::from_rotation_z(0.7) * Quat::from_rotation_x(0.5),
        Vec3::new(0.75, 0.14, 0.30),
    );
    b.add("beach ball", ball.without_uvs().transformed(pose), rubber);

    let wood = b.material(glossy("teak", srgb(0x9A6A3C), 0.45));
    let cloth = b.material(Material::diffuse("lounger cloth", srgb(0xE4DCCB)));
    let place =
        Affine3A::from_rotation_translation(Quat::from_rotation_y(0.22), Vec3::new(1.55, TERRACE - 0.008, -3.25));
    let (frame, pads) = lounger();
    b.add("lounger", frame.transformed(place), wood);
    b.add("lounger pads", pads.transformed(place), cloth);

    let clay = b.material(Material::diffuse("clay", srgb(0xB5603C)));
    let pot = Profile::start(0.0, 0.0)
        .to(0.17, 0.0)
        .crease()
        .to(0.25, 0.40)
        .crease()
        .to(0.27, 0.40)
        .crease()
        .to(0.275, 0.47)
        .crease()
        .to(0.25, 0.47)
        .crease()
        .to(0.235, 0.40)
        .crease()
        .to(0.0, 0.40)
        .lathe(64);
    let leaf = b.material(glossy("leaf", srgb(0x46863C), 0.45));
    for (k, place) in
        [Vec3::new(-3.9, TERRACE - 0.01, -2.85), Vec3::new(-0.4, TERRACE - 0.01, -3.3)].into_iter().enumerate()
    {
        b.add(&format!("pot {k}"), pot.clone().moved(place), clay);
        b.add(&format!("plant {k}"), plant(17 + k as u32).moved(place + Vec3::Y * 0.395), leaf);
    }
}

/// A wooden lounger along x, its head at −x, and its two pads.
fn lounger() -> (Shape, Shape) {
    let block = |min: [f32; 3], max: [f32; 3]| Shape::rounded_cuboid(Vec3::from(min), Vec3::from(max), 0.006, 2);
    let mut frame = Shape::default();
    for side in [-0.31, 0.27] {
        frame.append(block([-0.95, 0.25, side], [0.95, 0.31, side + 0.04]));
        for x in [-0.80, 0.74] {
            frame.append(block([x, 0.0, side + 0.002], [x + 0.06, 0.255, side + 0.038]));
        }
    }
    for k in 0..12 {
        let x = -0.22 + 0.096 * k as f32;
        frame.append(block([x, 0.292, -0.29], [x + 0.07, 0.312, 0.29]));
    }
    let mut back = Shape::default();
    for k in 0..8 {
        let x = -0.75 + 0.094 * k as f32;
        back.append(block([x, -0.012, -0.27], [x + 0.07, 0.010, 0.27]));
    }
    let lean = Affine3A::from_rotation_translation(Quat::from_rotation_z(-0.75), Vec3::new(-0.22, 0.305, 0.0));
    frame.append(back.transformed(lean));
    let mut pads =
        super::furniture::cushion(Vec3::new(1.12, 0.07, 0.56), 0.028, 0.012).moved(Vec3::new(0.36, 0.311, 0.0));
    let pad = super::furniture::cushion(Vec3::new(0.74, 0.07, 0.56), 0.028, 0.012).moved(Vec3::new(-0.39, 0.009, 0.0));
    pads.append(pad.transformed(lean));
    (frame, pads)
}

/// A tuft of long bent leaves.
fn plant(seed: u32) -> Shape {
    let mut random = Random::new(seed);
    let mut shape = Shape::default();
    for _ in 0..70 {
        let azimuth = random.between(0.0, std::f32::consts::TAU);
        let out = Vec3::new(azimuth.cos(), 0.0, azimuth.sin());
        let side = out.cross(Vec3::Y);
        let (length, droop) = (random.between(0.45, 0.85), random.between(0.25, 1.1));
        let (root, width) = (random.between(0.01, 0.08), random.between(0.012, 0.022));
        let spine = |t: f32| {
            let s = length * t;
            out * (root + s * (0.25 + 0.55 * droop * t)) + Vec3::Y * (s * (1.0 - 0.55 * droop * t * t))
        };
        let point = |u: f32, v: f32| {
            let blade = width * (1.0 - v).powf(0.7) * (0.4 + 1.2 * v.min(0.5)) + 0.0008;
            spine(v) + side * ((2.0 * u - 1.0) * blade) + out * (0.3 * blade * (2.0 * u - 1.0).powi(2))
        };
        let tint = random.between(0.6, 1.0);
        let blade = Shape::sheet(2, 10, |u, v| {
            let v = 0.999 * v;
            (point(u, v), super::curved::normal_of(point, u, v.clamp(0.01, 0.98)))
        });
        shape.append(blade.without_uvs().colored(Vec3::new(tint, tint, tint * 0.9)));
    }
    shape
}

/// A clear sky without the sun, the same all around.
fn sky() -> Environment {
    let (width, height) = (128, 64);
    let zenith = Vec3::new(0.055, 0.105, 0.2125);
    let horizon = Vec3::new(0.2, 0.225, 0.255);
    let ground = Vec3::new(0.075, 0.07, 0.0625);
    let texels = (0..height)
        .flat_map(|row| {
            let polar = std::f32::consts::PI * (row as f32 + 0.5) / height as f32;
            let up = polar.cos();
            let color = if up > 0.0 { horizon.lerp(zenith, up.powf(0.45)) } else { ground };
            std::iter::repeat_n(color, width as usize)
        })
        .collect();
    Environment { width, height, texels: Arc::new(texels), rotation: 0.0, strength: 1.0, tint: Vec3::ONE }
}
