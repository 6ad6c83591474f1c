//! `fireplace`: a long room lit by hundreds of small flames in a niche, and two candles.

use glam::{Affine3A, Quat, Vec2, Vec3};

use super::curved::{Profile, spline};
use super::furniture;
use super::shape::{Random, Shape, Tiling};
use super::{Builder, glossy, pattern, srgb};
use crate::scene::{Material, Scene};

/// The room's corners, metres; the fireplace is in the wall at −z.
const MIN: Vec3 = Vec3::new(-2.6, 0.0, -3.6);
/// See [`MIN`].
const MAX: Vec3 = Vec3::new(2.6, 2.75, 3.6);
/// Front of the chimney breast, z in metres.
const BREAST: f32 = -3.15;
/// Half the width of the chimney breast, metres.
const BREAST_HALF: f32 = 0.95;
/// Half the width and the height of the niche, and z of its back, metres.
const NICHE: Vec3 = Vec3::new(0.52, 0.78, -3.58);
/// Height of the hearth over the floor, metres.
const HEARTH: f32 = 0.06;

pub(super) fn scene() -> Scene {
    let mut b = Builder::default();
    room(&mut b);
    chimney(&mut b);
    fire(&mut b);
    fender(&mut b);
    seats(&mut b);
    walls(&mut b);
    b.camera("sofa", Vec3::new(1.95, 1.42, 2.35), Vec3::new(-0.35, 0.72, -2.6), 42.0, 16.0 / 9.0);
    b.scene
}

/// Walls, ceiling, boards, skirting.
fn room(b: &mut Builder) {
    let paint = b.material(Material::diffuse("wall", srgb(0xA9B3A4)));
    let white = b.material(Material::diffuse("ceiling", srgb(0xE9E4DA)));
    let size = MAX - MIN;
    let (x, y, z) = (Vec3::X * size.x, Vec3::Y * size.y, Vec3::Z * size.z);
    let walls = [(MIN, x), (MIN + x, z), (MIN + x + z, -x), (MIN + z, -z)];
    b.add("walls", Shape::union(walls.map(|(corner, along)| Shape::quad(corner, along, y))), paint);
    b.add("ceiling", Shape::quad(MIN + y, x, z), white);
    let image = b.image(pattern::boards("floor boards", 8, 0x9A6B3F, 0x5E3B20, 5), [1.6, 1.12]);
    let mut boards = glossy("floor boards", Vec3::splat(0.9), 0.28);
    boards.base_color_texture = Some(image);
    let boards = b.material(boards);
    b.add("floor", Shape::quad(MIN + z, x, -z), boards);

    let trim = b.material(glossy("trim", srgb(0xE6E0D4), 0.4));
    let mut shape = Shape::default();
    let mut lift = 0.0;
    for (corner, along) in walls {
        let inward = along.cross(y).normalize();
        for (low, high, depth) in [(-0.001, 0.12, 0.016), (2.66, 2.751, 0.07)] {
            lift += 0.0003;
            let (p, q) = (corner - inward * 0.001, corner + along + inward * depth);
            let (min, max) = (p.min(q) + Vec3::Y * low, p.max(q) + Vec3::Y * high);
            let (min, max) = if low < 1.0 { (min, max + Vec3::Y * lift) } else { (min + Vec3::Y * lift, max) };
            shape.append(Shape::rounded_cuboid(min, max, 0.006, 3));
        }
    }
    b.add("skirting and cornice", shape, trim);
}

/// Chimney breast of brick, niche, hearth, mantel.
fn chimney(b: &mut Builder) {
    let mortar = b.material(Material::diffuse("mortar", srgb(0x8C8378)));
    let brick = b.material(Material::diffuse("brick", srgb(0x9C4F37)));
    let soot = b.material(Material::diffuse("sooty brick", srgb(0x54392E)));
    let (w, h, back) = (NICHE.x, NICHE.y + HEARTH, NICHE.z);
    let (half, top) = (BREAST_HALF, MAX.y + 0.001);
    let at = Vec3::new;
    // The front leaves the opening out: two piers and what is above.
    let faces = [
        (at(-half, 0.0, BREAST), at(half - w, 0.0, 0.0), at(0.0, h, 0.0)),
        (at(w, 0.0, BREAST), at(half - w, 0.0, 0.0), at(0.0, h, 0.0)),
        (at(-half, h, BREAST), at(2.0 * half, 0.0, 0.0), at(0.0, top - h, 0.0)),
        (at(half, 0.0, BREAST), at(0.0, 0.0, MIN.z - BREAST), at(0.0, top, 0.0)),
        (at(-half, 0.0, MIN.z), at(0.0, 0.0, BREAST - MIN.z), at(0.0, top, 0.0)),
    ];
    let inside = [
        (at(-w, 0.0, back), at(2.0 * w, 0.0, 0.0), at(0.0, h, 0.0)),
        (at(-w, 0.0, BREAST), at(0.0, 0.0, back - BREAST), at(0.0, h, 0.0)),
        (at(w, 0.0, back), at(0.0, 0.0, BREAST - back), at(0.0, h, 0.0)),
        (at(-w, h, back), at(2.0 * w, 0.0, 0.0), at(0.0, 0.0, BREAST - back)),
    ];
    let quads = faces.iter().chain(&inside).map(|&(corner, u, v)| Shape::quad(corner, u, v));
    b.add("mortar", Shape::union(quads), mortar);
    let tiling = Tiling {
        pitch: Vec2::new(0.225, 0.075),
        joint: 0.010,
        height: 0.006,
        bevel: 0.003,
        bond: 0.5,
        tilt: 0.02,
        variation: 0.22,
        seed: 4,
    };
    let lay = |faces: &[(Vec3, Vec3, Vec3)]| {
        let parts = faces
            .iter()
            .enumerate()
            .map(|(k, &(corner, u, v))| Tiling { seed: 40 + k as u32, ..tiling }.over(corner, u, v, |_| true));
        Shape::union(parts)
    };
    b.add("bricks", lay(&faces), brick);
    b.add("sooty bricks", lay(&inside), soot);

    let stone = b.material(glossy("hearth stone", srgb(0x4A4744), 0.35));
    let low = at(-half - 0.12, -0.001, back - 0.01);
    b.add("hearth", Shape::rounded_cuboid(low, at(half + 0.12, HEARTH, BREAST + 0.46), 0.008, 3), stone);
    let oak_image = b.image(pattern::boards("mantel oak", 2, 0x7A5232, 0x452A17, 8), [1.4, 0.6]);
    let mut oak = glossy("mantel oak", Vec3::splat(0.9), 0.4);
    oak.base_color_texture = Some(oak_image);
    let oak = b.material(oak);
    let mantel = Shape::cuboid(at(-half - 0.16, 1.17, BREAST - 0.05), at(half + 0.16, 1.235, BREAST + 0.22));
    b.add("mantel", mantel, oak);
    let mut brackets = Shape::default();
    for x in [-0.72, 0.72] {
        brackets.append(Shape::cuboid(at(x - 0.05, 1.02, BREAST - 0.02), at(x + 0.05, 1.171, BREAST + 0.15)));
    }
    b.add("brackets", brackets, oak);
    candles(b);
}

/// Two candlesticks with burning candles, a clock, a vase, on the mantel.
fn candles(b: &mut Builder) {
    let brass = b.material(Material::metal("polished brass", Vec3::new(0.80, 0.60, 0.28), 0.12));
    let wax = b.material(glossy("wax", srgb(0xEFE6CF), 0.35));
    let flame = b.material(Material::emitter("candle flame", Vec3::new(260.0, 150.0, 52.0)));
    let stick = Profile::start(0.0, 0.0)
        .to(0.042, 0.0)
        .crease()
        .to(0.042, 0.008)
        .crease()
        .curve([0.030, 0.016], [0.010, 0.018], [0.009, 0.045], 10)
        .curve([0.009, 0.055], [0.018, 0.055], [0.018, 0.064], 8)
        .curve([0.018, 0.073], [0.009, 0.073], [0.009, 0.085], 8)
        .curve([0.009, 0.120], [0.022, 0.130], [0.022, 0.142], 10)
        .crease()
        .to(0.0, 0.142);
    let candle = Profile::start(0.0, -0.001).to(0.011, -0.001).crease().to(0.011, 0.13).crease().to(0.0, 0.128);
    let tongue = Profile::start(0.0, 0.0).curve([0.006, 0.0], [0.008, 0.010], [0.0052, 0.018], 6).curve(
        [0.0035, 0.024],
        [0.0015, 0.030],
        [0.0, 0.036],
        5,
    );
    for (k, x) in [-0.80, -0.62, 0.86].into_iter().enumerate() {
        let at = Vec3::new(x, 1.234, BREAST + 0.10 + 0.03 * (k as f32 - 1.0).abs());
        b.add("candlestick", stick.lathe(48).moved(at), brass);
        b.add("candle", candle.lathe(32).moved(at + Vec3::Y * 0.142), wax);
        b.add("candle flame", tongue.lathe(12).moved(at + Vec3::Y * 0.275), flame);
    }
    let vase_paint = b.material(glossy("vase", srgb(0x23506E), 0.08));
    let vase = Profile::start(0.0, 0.0)
        .to(0.045, 0.0)
        .crease()
        .curve([0.10, 0.05], [0.11, 0.15], [0.045, 0.21], 24)
        .curve([0.030, 0.23], [0.030, 0.25], [0.046, 0.275], 12)
        .curve([0.044, 0.279], [0.041, 0.277], [0.040, 0.272], 5)
        .curve([0.022, 0.25], [0.022, 0.23], [0.035, 0.21], 10)
        .to(0.0, 0.20);
    b.add("vase", vase.lathe(96).moved(Vec3::new(0.58, 1.234, BREAST + 0.10)), vase_paint);
}

/// Logs, embers and flames.
fn fire(b: &mut Builder) {
    let iron = b.material(Material::metal("iron", Vec3::splat(0.22), 0.5));
    let z = 0.5 * (BREAST + NICHE.z) + 0.02;
    let mut grate = Shape::default();
    for k in 0..7 {
        let x = -0.27 + 0.09 * k as f32;
        let (from, to) = (Vec3::new(x, HEARTH + 0.075, z - 0.14), Vec3::new(x, HEARTH + 0.075, z + 0.14));
        let tip = to + Vec3::new(0.0, 0.05, 0.02);
        grate.append(Shape::tube(&spline(&[from, from.lerp(to, 0.5), to, tip], 6), |_| 0.007, 12));
    }
    for dz in [-0.10, 0.10] {
        let (y, span) = (HEARTH + 0.065, 0.31);
        grate.append(Shape::rod(Vec3::new(-span, y, z + dz), Vec3::new(span, y, z + dz), 0.008, 12));
        for x in [-0.27, 0.27] {
            grate.append(Shape::rod(Vec3::new(x, HEARTH - 0.001, z + dz), Vec3::new(x, y, z + dz), 0.008, 12));
        }
    }
    b.add("grate", grate, iron);

    let bark = b.material(Material::diffuse("bark", srgb(0x4A3426)));
    let base = HEARTH + 0.082;
    let logs = [
        ([-0.30, 0.048, 0.085], [0.29, 0.050, 0.070], 0.050),
        ([-0.28, 0.046, -0.075], [0.31, 0.052, -0.065], 0.052),
        ([-0.22, 0.125, 0.015], [0.24, 0.140, 0.040], 0.046),
        ([-0.17, 0.20, -0.09], [0.12, 0.065, 0.15], 0.036),
        ([0.24, 0.205, -0.07], [-0.05, 0.215, 0.06], 0.034),
    ];
    let mut wood = Shape::default();
    let place = |p: [f32; 3]| Vec3::from(p) + Vec3::new(0.0, base, z);
    for (k, (from, to, radius)) in logs.into_iter().enumerate() {
        wood.append(furniture::log(place(from), place(to), radius, 60 + k as u32));
    }
    b.add("logs", wood, bark);

    let mut random = Random::new(404);
    let ember = b.material(Material::emitter("ember", Vec3::new(24.0, 4.6, 0.7)));
    let mut embers = Shape::default();
    for _ in 0..150 {
        let at = Vec3::new(
            random.between(-0.27, 0.27),
            HEARTH + random.between(0.004, 0.022),
            z + random.between(-0.12, 0.12),
        );
        embers.append(Shape::icosphere(at, random.between(0.004, 0.010), 0));
    }
    b.add("embers", embers, ember);
    let hues = [
        ("flame core", Vec3::new(150.0, 88.0, 34.0)),
        ("flame", Vec3::new(95.0, 40.0, 9.0)),
        ("flame tip", Vec3::new(46.0, 13.0, 1.8)),
    ];
    let mut tongues: [Shape; 3] = Default::default();
    for _ in 0..330 {
        let (u, v) = (random.unit() + random.unit() - 1.0, random.unit() + random.unit() - 1.0);
        let (x, dz) = (0.27 * u, 0.12 * v);
        let reach = 0.34 * (1.0 - u.abs()).powf(0.8) + 0.05;
        let t = random.unit() * random.unit().max(0.3);
        let from = Vec3::new(x * (1.0 - 0.5 * t), base + 0.10 + reach * t, z + dz * (1.0 - 0.6 * t));
        let hue = if t < 0.18 {
            0
        } else if t < 0.5 {
            1
        } else {
            2
        };
        let length = random.between(0.045, 0.11) * (1.0 - 0.45 * t);
        let width = length * random.between(0.13, 0.22);
        let sway = Vec3::new(random.between(-0.35, 0.35) - 0.4 * u, 1.0, random.between(-0.3, 0.3)).normalize();
        tongues[hue].append(tongue(from, sway * length, width, random.between(0.0, 6.0)));
    }
    for ((name, emission), shape) in hues.into_iter().zip(tongues) {
        let material = b.material(Material::emitter(name, emission));
        b.add(name, shape, material);
    }
}

/// A flame: two pyramids over a triangle, twelve centimetres long at the most.
fn tongue(from: Vec3, along: Vec3, width: f32, turn: f32) -> Shape {
    let pose = Affine3A::from_rotation_translation(
        Quat::from_rotation_arc(Vec3::Y, along.normalize()) * Quat::from_rotation_y(turn),
        from,
    );
    let length = along.length();
    let profile = Profile::start(0.0, 0.0).to(width, 0.28 * length).to(0.6 * width, 0.60 * length).to(0.0, length);
    profile.lathe(5).transformed(pose)
}

/// A fender of rough brass and fire irons.
fn fender(b: &mut Builder) {
    let brass = b.material(Material::metal("brass", Vec3::new(0.78, 0.56, 0.25), 0.28));
    let (x, z, y) = (0.88, BREAST + 0.40, HEARTH);
    let mut shape = Shape::default();
    for (height, radius) in [(0.20, 0.013), (0.035, 0.010)] {
        let corner = 0.07;
        let path = [
            Vec3::new(-x, y + height, BREAST + 0.03),
            Vec3::new(-x, y + height, z - corner),
            Vec3::new(-x + 0.3 * corner, y + height, z - 0.3 * corner),
            Vec3::new(-x + corner, y + height, z),
            Vec3::new(0.0, y + height, z),
            Vec3::new(x - corner, y + height, z),
            Vec3::new(x - 0.3 * corner, y + height, z - 0.3 * corner),
            Vec3::new(x, y + height, z - corner),
            Vec3::new(x, y + height, BREAST + 0.03),
        ];
        shape.append(Shape::tube(&spline(&path, 8), move |_| radius, 20));
    }
    let n = 26;
    for k in 0..=n {
        let px = -x + 0.07 + (2.0 * x - 0.14) * k as f32 / n as f32;
        let radius = if k % 13 == 0 { 0.009 } else { 0.005 };
        shape.append(Shape::rod(Vec3::new(px, y + 0.03, z), Vec3::new(px, y + 0.20, z), radius, 12));
    }
    for px in [-x, -x + 0.07, 0.0, x - 0.07, x] {
        let pz = if px.abs() > x - 0.01 { BREAST + 0.06 } else { z };
        shape.append(Shape::rod(Vec3::new(px, y - 0.001, pz), Vec3::new(px, y + 0.20, pz), 0.010, 16));
        shape.append(Shape::icosphere(Vec3::new(px, y + 0.222, pz), 0.019, 3));
    }
    b.add("fender", shape, brass);
    // A log basket would hide the fire; irons in a stand do not.
    let mut irons = Shape::default();
    let at = Vec3::new(-1.02, HEARTH - 0.001, BREAST + 0.24);
    let foot = Profile::start(0.0, 0.0).to(0.085, 0.0).crease().to(0.085, 0.010).crease().curve(
        [0.05, 0.02],
        [0.012, 0.02],
        [0.010, 0.05],
        10,
    );
    irons.append(foot.to(0.010, 0.60).crease().to(0.0, 0.60).lathe(40).moved(at));
    irons.append(Shape::icosphere(at + Vec3::Y * 0.615, 0.022, 3));
    irons.append(Shape::torus(at + Vec3::Y * 0.50, 0.055, 0.005, 48, 12));
    for k in 0..3 {
        let (sin, cos) = (2.1 * k as f32 + 0.4).sin_cos();
        let p = at + Vec3::new(0.056 * cos, 0.0, 0.056 * sin);
        irons.append(Shape::rod(p + Vec3::Y * 0.06, p + Vec3::Y * 0.58, 0.005, 12));
        irons.append(Shape::icosphere(p + Vec3::Y * 0.59, 0.013, 2));
    }
    b.add("fire irons", irons, brass);
}

/// Sofa, armchair, table with bowl and books, rug.
fn seats(b: &mut Builder) {
    let green = b.material(Material::diffuse("sofa cloth", srgb(0x3F5E52)));
    let leather = b.material(glossy("leather", srgb(0x7A4427), 0.42));
    let walnut = b.material(glossy("walnut", srgb(0x5B3A24), 0.25));
    let (body, feet) = furniture::sofa(2.05, 3);
    let (angle, at) = (std::f32::consts::FRAC_PI_2, Vec3::new(-1.72, 0.0, -0.65));
    b.add("sofa", body.placed(angle, at), green);
    b.add("sofa feet", feet.placed(angle, at), walnut);
    let (body, feet) = furniture::sofa(0.92, 1);
    let (angle, at) = (-1.15, Vec3::new(1.52, 0.0, -1.35));
    b.add("armchair", body.placed(angle, at), leather);
    b.add("armchair feet", feet.placed(angle, at), walnut);
    for (k, (z, turn, color)) in [(-1.32, 0.35, 0xC8893B), (0.0, -0.25, 0xA23B30)].into_iter().enumerate() {
        let cloth = b.material(Material::diffuse(&format!("cushion {k}"), srgb(color)));
        let pose = Affine3A::from_rotation_translation(
            Quat::from_rotation_y(std::f32::consts::FRAC_PI_2)
                * Quat::from_rotation_z(turn * 0.3)
                * Quat::from_rotation_x(1.20),
            Vec3::new(-1.66, 0.66, z),
        );
        let pillow = furniture::cushion(Vec3::new(0.42, 0.09, 0.40), 0.035, 0.045);
        b.add(&format!("cushion {k}"), pillow.transformed(pose), cloth);
    }

    let image = b.image(pattern::rug(), [1.0, 1.0]);
    let mut rug = Material::diffuse("rug", Vec3::splat(0.9));
    rug.base_color_texture = Some(image);
    let rug = b.material(rug);
    let (rx, rz, rt) = (1.15, 1.55, 0.012);
    let mut top = Shape::quad(Vec3::new(-rx, rt, rz), Vec3::X * 2.0 * rx, -Vec3::Z * 2.0 * rz);
    // The pattern's long side lies along z.
    for uv in &mut top.uvs {
        *uv = Vec2::new(uv.y / (2.0 * rz), uv.x / (2.0 * rx));
    }
    b.add("rug", top.moved(Vec3::new(-0.15, 0.0, -0.80)), rug);
    let edge = b.material(Material::diffuse("rug edge", srgb(0x8C7A58)));
    let low = Vec3::new(-0.15 - rx - 0.004, -0.001, -0.80 - rz - 0.004);
    let high = Vec3::new(-0.15 + rx + 0.004, rt - 0.001, -0.80 + rz + 0.004);
    b.add("rug edge", Shape::rounded_cuboid(low, high, 0.004, 2), edge);

    let at = Vec3::new(-0.22, rt, -0.75);
    let turn = 0.08;
    b.add("table", furniture::table(Vec3::new(0.62, 0.42, 1.10)).placed(turn, at), walnut);
    let bowl_paint = b.material(glossy("bowl", srgb(0xD8CDB8), 0.15));
    let bowl = Profile::start(0.0, 0.0)
        .to(0.055, 0.0)
        .crease()
        .curve([0.10, 0.01], [0.145, 0.04], [0.155, 0.075], 16)
        .curve([0.156, 0.079], [0.151, 0.079], [0.149, 0.076], 5)
        .curve([0.138, 0.045], [0.095, 0.018], [0.0, 0.014], 16);
    let table_top = at + Vec3::Y * 0.4195;
    b.add("bowl", bowl.lathe(96).moved(table_top + Vec3::new(0.02, 0.0, -0.22)), bowl_paint);
    let apple = b.material(glossy("apple", srgb(0xB5322A), 0.2));
    let mut apples = Shape::default();
    for [x, y, z] in [[0.045, 0.058, 0.01], [-0.045, 0.056, 0.035], [-0.005, 0.054, -0.055], [0.0, 0.105, -0.005]] {
        apples.append(Shape::icosphere(table_top + Vec3::new(0.02 + x, y, -0.22 + z), 0.038, 3));
    }
    b.add("apples", apples, apple);
    for (k, (turn, color)) in [(0.3, 0x274B6B), (0.05, 0xB8A06A), (0.55, 0x6B2A2F)].into_iter().enumerate() {
        let cover = b.material(glossy(&format!("book cover {k}"), srgb(color), 0.45));
        let size = Vec3::new(0.15, 0.028, 0.21) * (1.0 - 0.06 * k as f32);
        let book = Shape::rounded_cuboid(-0.5 * size, 0.5 * size, 0.003, 2);
        let y = 0.0135 + 0.0272 * k as f32;
        b.add(&format!("book {k}"), book.placed(turn, table_top + Vec3::new(0.02, y, 0.24)), cover);
    }
}

/// Pictures, a bookcase, curtains.
fn walls(b: &mut Builder) {
    let gilt = b.material(Material::metal("gilt frame", Vec3::new(0.72, 0.52, 0.24), 0.38));
    let images = [
        pattern::hills("evening hills", 3, [0x35506E, 0xE8B27A], 0x24382F, 0x8C8A9C),
        pattern::discs("discs", 12, 0xE9E0CC, &[0xC94F36, 0x2E5A6B, 0xE0A93E, 0x3A3A3A]),
        pattern::hills("morning hills", 9, [0x9CC0D8, 0xF2DCC0], 0x3E5B3A, 0xA9B7B4),
    ];
    let places = [
        (Vec3::new(0.0, 1.86, BREAST + 0.011), 0.0, Vec2::new(0.86, 0.62)),
        (Vec3::new(MIN.x + 0.002, 1.62, 0.05), std::f32::consts::FRAC_PI_2, Vec2::new(0.48, 0.62)),
        (Vec3::new(MIN.x + 0.002, 1.62, -1.25), std::f32::consts::FRAC_PI_2, Vec2::new(0.80, 0.58)),
    ];
    for (image, (at, turn, size)) in images.into_iter().zip(places) {
        let name = image.name.clone();
        let texture = b.image(image, [1.0, 1.0]);
        let mut canvas = Material::diffuse(&name, Vec3::splat(0.85));
        canvas.base_color_texture = Some(texture);
        let canvas = b.material(canvas);
        let (frame, picture) = furniture::frame(size, 0.055);
        b.add("picture frame", frame.placed(turn, at), gilt);
        b.add(&name, picture.placed(turn, at), canvas);
    }

    let shelf = b.material(glossy("bookcase", srgb(0x4E3422), 0.35));
    let (x0, x1, z0) = (1.10, 2.40, MIN.z + 0.017);
    let (depth, height, board) = (0.28, 2.05, 0.024);
    let part = |x0: f32, x1: f32, y0: f32, y1: f32, z1: f32| {
        Shape::rounded_cuboid(Vec3::new(x0, y0, z0), Vec3::new(x1, y1, z0 + z1), 0.003, 2)
    };
    let mut case = part(x0, x0 + board, -0.001, height, depth);
    case.append(part(x1 - board, x1, -0.001, height, depth));
    case.append(part(x0 + 0.001, x1 - 0.001, 0.001, height - 0.001, 0.014));
    let colors = [0x7A2E2A, 0x2C4A5E, 0x4F5D3A, 0xB59A5B, 0x3A2E3F, 0xC9BFA8, 0x8A5A33].map(srgb);
    let mut volumes = Shape::default();
    let rows = 6;
    for k in 0..rows {
        let y = 0.06 + (height - 0.085) * k as f32 / (rows - 1) as f32;
        case.append(part(x0 + 0.002, x1 - 0.002, y, y + board, depth - 0.003));
        if k < rows - 1 {
            let row = furniture::books(x1 - x0 - 2.0 * board - 0.02, 0.30, &colors, 900 + k);
            volumes.append(row.moved(Vec3::new(x0 + board + 0.01, y + board, z0 + depth - 0.05)));
        }
    }
    b.add("bookcase", case, shelf);
    let cover = b.material(glossy("books", Vec3::ONE, 0.5));
    b.add("books", volumes, cover);

    let velvet = b.material(Material::diffuse("curtain", srgb(0x6B2E33)));
    for (k, z) in [0.62, 2.30].into_iter().enumerate() {
        let cloth = furniture::curtain(Vec2::new(0.75, 2.42), 7, 70 + k as u32);
        let at = Vec3::new(MIN.x + 0.10, 0.02, z + 0.45);
        b.add("curtain", cloth.placed(std::f32::consts::FRAC_PI_2, at), velvet);
    }
    let iron = b.material(Material::metal("curtain rod", Vec3::new(0.30, 0.27, 0.24), 0.3));
    let (y, x) = (2.455, MIN.x + 0.10);
    let mut rod = Shape::rod(Vec3::new(x, y, 0.55), Vec3::new(x, y, 3.3), 0.013, 20);
    for z in [0.55, 3.3] {
        rod.append(Shape::icosphere(Vec3::new(x, y, z), 0.028, 3));
    }
    b.add("curtain rod", rod, iron);
}
