//! `bathroom`: lamps inside thick glass. No light reaches the room except through it, so sampling the lamps finds nothing.

use std::f32::consts::{PI, TAU};

use glam::{Affine3A, Quat, Vec2, Vec3};

use super::curved::{Profile, normal_of, spline};
use super::shape::{Random, Shape, Tiling};
use super::{Builder, glossy, pattern, srgb};
use crate::scene::{Material, Scene};

/// The room's corners, metres: the vanity stands at the back wall (−z).
const MIN: Vec3 = Vec3::new(-1.6, 0.0, -1.3);
/// See [`MIN`].
const MAX: Vec3 = Vec3::new(1.6, 2.5, 2.3);
/// Top of the tiles on the walls, metres.
const TILED: f32 = 1.32;

pub(super) fn scene() -> Scene {
    let mut b = Builder::default();
    room(&mut b);
    let chrome = b.material(Material::metal("chrome", Vec3::new(0.80, 0.81, 0.83), 0.03));
    let ceramic = b.material(glossy("ceramic", Vec3::new(0.82, 0.82, 0.80), 0.06));
    let glass = b.material(Material::glass("glass", 1.5));
    vanity(&mut b, chrome, ceramic);
    mirror(&mut b, chrome);
    let filament = b.material(Material::emitter("filament", Vec3::new(15000.0, 11200.0, 7200.0)));
    for x in [-0.62, 0.62] {
        lamp(&mut b, Vec3::new(x, 1.62, MIN.z + 0.16), glass, filament, chrome);
    }
    shelf(&mut b, glass, chrome);
    towels(&mut b, chrome);
    tub(&mut b, ceramic, chrome);
    b.camera("door", Vec3::new(1.18, 1.50, 2.05), Vec3::new(-0.20, 1.02, -1.3), 46.0, 16.0 / 9.0);
    b.scene
}

/// Painted walls, tiles to shoulder height, floor tiles.
fn room(b: &mut Builder) {
    let paint = b.material(Material::diffuse("paint", srgb(0xE4DED2)));
    let size = MAX - MIN;
    let (x, y, z) = (Vec3::X * size.x, Vec3::Y * size.y, Vec3::Z * size.z);
    // Corner and horizontal edge of each wall, seen from inside from left to right.
    let walls = [(MIN, x), (MIN + x, z), (MIN + x + z, -x), (MIN + z, -z)];
    let shell = walls.map(|(corner, along)| Shape::quad(corner, along, y));
    let mut shell = Shape::union(shell);
    shell.append(Shape::quad(MIN + y, x, z));
    b.add("walls and ceiling", shell, paint);

    let joint = b.material(Material::diffuse("joint", srgb(0xCFCAC0)));
    let tile = b.material(glossy("wall tile", srgb(0x7FA9A3), 0.07));
    let tiling = Tiling {
        pitch: Vec2::new(0.20, 0.075),
        joint: 0.003,
        height: 0.003,
        bevel: 0.003,
        bond: 0.5,
        tilt: 0.006,
        variation: 0.10,
        seed: 1,
    };
    let (mut ground, mut tiles) = (Shape::default(), Shape::default());
    for (k, (corner, along)) in walls.into_iter().enumerate() {
        let inward = along.cross(y).normalize();
        let along_unit = along.normalize();
        let foot = corner + inward * 0.009;
        let (from, to) = (foot + along_unit * 0.009, along - along_unit * 0.018);
        ground.append(Shape::quad(from - Vec3::Y * 0.001, to, Vec3::Y * (TILED + 0.001)));
        ground.append(Shape::quad(from + Vec3::Y * TILED, to, -inward * 0.01));
        tiles.append(Tiling { seed: k as u32 + 1, ..tiling }.over(from, to, Vec3::Y * TILED, |_| true));
    }
    b.add("joint", ground, joint);
    b.add("wall tiles", tiles, tile);
    let cap = b.material(glossy("tile border", srgb(0x1F3B44), 0.07));
    let mut k = 0.0;
    let borders = walls.map(|(corner, along)| {
        // No two tops in one plane where they meet in a corner.
        k += 0.0004;
        let inward = along.cross(y).normalize();
        let unit = along.normalize();
        let (p, q) = (corner + unit * 0.002, corner + along - unit * 0.002 + inward * 0.018);
        let (low, high) = (p.min(q) + Vec3::Y * (TILED - 0.004), p.max(q) + Vec3::Y * (TILED + 0.026 + k));
        Shape::rounded_cuboid(low, high, 0.006, 3)
    });
    b.add("tile border", Shape::union(borders), cap);

    let floor_joint = b.material(Material::diffuse("floor joint", srgb(0x5C5852)));
    b.add("floor joint", Shape::quad(MIN + z, x, -z), floor_joint);
    let floor = Tiling {
        pitch: Vec2::splat(0.30),
        joint: 0.004,
        height: 0.004,
        bevel: 0.002,
        bond: 0.0,
        tilt: 0.002,
        variation: 0.03,
        seed: 9,
    };
    for (name, color, parity) in [("floor tile, light", 0xD8D2C6, 0), ("floor tile, dark", 0x39424A, 1)] {
        let material = b.material(glossy(name, srgb(color), 0.12));
        let tiles = floor.over(MIN + z, x, -z, |p| {
            let cell = (p / 0.30).floor();
            (cell.x as i32 + cell.y as i32).rem_euclid(2) == parity
        });
        b.add(name, tiles, material);
    }
}

/// Cabinet, counter, basin and tap.
fn vanity(b: &mut Builder, chrome: usize, ceramic: usize) {
    let back = MIN.z + 0.010;
    let wood_image = b.image(pattern::boards("oak", 5, 0xB78A58, 0x7A5230, 21), [1.2, 1.2]);
    let mut oak = glossy("oak", Vec3::splat(0.9), 0.35);
    oak.base_color_texture = Some(wood_image);
    let oak = b.material(oak);
    let front = back + 0.50;
    b.add("cabinet", Shape::cuboid(Vec3::new(-0.70, 0.16, back), Vec3::new(0.70, 0.778, front)), oak);
    let mut doors = Shape::default();
    for k in 0..4 {
        let x = -0.70 + 0.35 * k as f32;
        doors.append(Shape::cuboid(
            Vec3::new(x + 0.004, 0.166, front - 0.002),
            Vec3::new(x + 0.346, 0.768, front + 0.018),
        ));
    }
    b.add("doors", doors, oak);
    let mut pulls = Shape::default();
    for k in 0..4 {
        let x = -0.70 + 0.35 * k as f32 + if k % 2 == 0 { 0.31 } else { 0.04 };
        let (y0, y1, z) = (0.56, 0.70, front + 0.042);
        let path = [
            Vec3::new(x, y0, front + 0.017),
            Vec3::new(x, y0, z - 0.008),
            Vec3::new(x, y0 + 0.012, z),
            Vec3::new(x, y1 - 0.012, z),
            Vec3::new(x, y1, z - 0.008),
            Vec3::new(x, y1, front + 0.017),
        ];
        pulls.append(Shape::tube(&spline(&path, 6), |_| 0.0045, 16));
    }
    b.add("pulls", pulls, chrome);
    let stone = b.material(glossy("counter", srgb(0x2D2C30), 0.10));
    let counter = Shape::rounded_cuboid(Vec3::new(-0.73, 0.776, back), Vec3::new(0.73, 0.816, front + 0.035), 0.006, 3);
    b.add("counter", counter, stone);

    let place = Vec3::new(0.0, 0.815, back + 0.275);
    let basin = Profile::start(0.0, 0.0)
        .to(0.12, 0.0)
        .crease()
        .curve([0.19, 0.015], [0.215, 0.07], [0.220, 0.125], 16)
        .curve([0.221, 0.133], [0.209, 0.133], [0.208, 0.125], 8)
        .curve([0.200, 0.06], [0.16, 0.028], [0.024, 0.022], 22)
        .to(0.0, 0.0215);
    b.add("basin", basin.lathe(128).moved(place), ceramic);
    let plug =
        Profile::start(0.026, 0.020).to(0.026, 0.0255).crease().curve([0.026, 0.028], [0.01, 0.029], [0.0, 0.029], 8);
    b.add("plug", plug.lathe(48).moved(place), chrome);

    let root = Vec3::new(0.0, 0.814, back + 0.036);
    let spout: Vec<Vec3> = [[0.0, 0.02], [0.0, 0.20], [0.012, 0.262], [0.055, 0.295], [0.108, 0.275], [0.128, 0.235]]
        .map(|[z, y]: [f32; 2]| root + Vec3::new(0.0, y, z))
        .to_vec();
    let mut tap = Shape::tube(&spline(&spout, 14), |_| 0.0115, 32);
    let foot = Profile::start(0.027, 0.0)
        .to(0.027, 0.006)
        .crease()
        .curve([0.026, 0.012], [0.016, 0.012], [0.015, 0.03], 10)
        .to(0.015, 0.045)
        .crease()
        .to(0.0, 0.045);
    tap.append(foot.lathe(48).moved(root));
    tap.append(Shape::tube(
        &[Vec3::ZERO, Vec3::new(0.03, 0.004, 0.0), Vec3::new(0.085, 0.022, 0.0)].map(|p| root + Vec3::Y * 0.032 + p),
        |t| 0.0065 - 0.002 * t,
        20,
    ));
    b.add("tap", tap, chrome);

    // A soap bottle with a pump, and a cup with brushes.
    let soap = b.material(glossy("soap bottle", srgb(0xB9522F), 0.15));
    let bottle = Profile::start(0.0, 0.0)
        .to(0.030, 0.0)
        .curve([0.034, 0.0], [0.034, 0.002], [0.034, 0.006], 4)
        .to(0.034, 0.10)
        .curve([0.034, 0.125], [0.012, 0.120], [0.012, 0.138], 10)
        .to(0.012, 0.146)
        .crease()
        .to(0.0, 0.146);
    let at = Vec3::new(-0.40, 0.815, back + 0.17);
    b.add("soap bottle", bottle.lathe(64).moved(at), soap);
    let pump: Vec<Vec3> = [[0.0, 0.14], [0.0, 0.178], [0.006, 0.188], [0.022, 0.190], [0.045, 0.184]]
        .map(|[x, y]: [f32; 2]| at + Vec3::new(0.5 * x, y, x))
        .to_vec();
    b.add("pump", Shape::tube(&spline(&pump, 8), |_| 0.0042, 16), chrome);
    let cup = Profile::start(0.0, 0.0)
        .to(0.034, 0.0)
        .crease()
        .to(0.038, 0.095)
        .curve([0.038, 0.0975], [0.0355, 0.0975], [0.0355, 0.095], 6)
        .to(0.032, 0.004)
        .crease()
        .to(0.0, 0.004);
    let at = Vec3::new(0.42, 0.815, back + 0.15);
    b.add("cup", cup.lathe(64).moved(at), ceramic);
    for (k, (lean, color)) in [(0.22f32, 0x2E6FB0), (-0.18, 0xD9503F)].into_iter().enumerate() {
        let brush = b.material(glossy(&format!("toothbrush {k}"), srgb(color), 0.2));
        let (from, to) = (Vec3::new(-0.020 * lean.signum(), 0.010, 0.0), Vec3::new(lean * 0.13, 0.165, 0.01));
        b.add(&format!("toothbrush {k}"), Shape::rod(at + from, at + to, 0.0038, 12), brush);
    }
}

/// The mirror over the basin, with a frame.
fn mirror(b: &mut Builder, chrome: usize) {
    let silver = b.material(Material::metal("mirror", Vec3::splat(0.90), 0.0));
    let (x, y0, y1, z) = (0.42, 1.27, 2.10, MIN.z + 0.025);
    b.add("mirror", Shape::quad(Vec3::new(-x, y0, z), Vec3::X * 2.0 * x, Vec3::Y * (y1 - y0)), silver);
    let w = 0.022;
    let bar = |x0: f32, y0: f32, x1: f32, y1: f32| {
        Shape::rounded_cuboid(Vec3::new(x0, y0, MIN.z + 0.004), Vec3::new(x1, y1, z + 0.012), 0.004, 2)
    };
    let bars = [
        bar(-x - w, y0 - w, x + w, y0 + 0.002),
        bar(-x - w, y1 - 0.002, x + w, y1 + w),
        bar(-x - w, y0 - 0.003, -x + 0.002, y1 + 0.003),
        bar(x - 0.002, y0 - 0.003, x + w, y1 + 0.003),
    ];
    b.add("mirror frame", Shape::union(bars), chrome);
}

/// Glass between the two surfaces of a lamp's shade, about the y axis: outside ribbed, inside smooth.
pub(super) fn shade() -> Shape {
    let outside = Profile::start(0.0, -0.085)
        .curve([0.030, -0.085], [0.052, -0.072], [0.054, -0.040], 16)
        .curve([0.056, 0.0], [0.050, 0.030], [0.040, 0.060], 20)
        .curve([0.035, 0.075], [0.020, 0.080], [0.0, 0.080], 12);
    let ribs = |angle: f32| (1.0 + 0.016 * (12.0 * angle).cos(), -0.192 * (12.0 * angle).sin());
    let mut shade = outside.lathe_part(0..=outside.last_index(), 240, ribs);
    let inside = Profile::start(0.0, -0.077)
        .curve([0.026, -0.077], [0.044, -0.066], [0.045, -0.040], 12)
        .curve([0.047, 0.0], [0.042, 0.028], [0.032, 0.056], 14)
        .curve([0.028, 0.067], [0.016, 0.071], [0.0, 0.071], 10);
    shade.append(inside.lathe(120).inverted());
    shade
}

/// A sconce: thick closed glass with a glowing helix inside, on a chrome arm.
fn lamp(b: &mut Builder, centre: Vec3, glass: usize, filament: usize, chrome: usize) {
    b.add("shade", shade().moved(centre), glass);
    let turns = 7.0;
    let n = 20 * turns as usize;
    let helix: Vec<Vec3> = (0..=n)
        .map(|k| {
            let t = k as f32 / n as f32;
            let (sin, cos) = (TAU * turns * t).sin_cos();
            centre + Vec3::new(0.0065 * cos, -0.030 + 0.050 * t, 0.0065 * sin)
        })
        .collect();
    b.add("filament", Shape::tube(&helix, |_| 0.0011, 6), filament);
    let wires = [
        vec![Vec3::new(0.0065, 0.0215, 0.0), Vec3::new(0.006, 0.060, 0.0)],
        vec![Vec3::new(0.0065, -0.0325, 0.0), Vec3::new(-0.012, -0.034, 0.0), Vec3::new(-0.012, 0.060, 0.0)],
    ]
    .map(|path| Shape::tube(&path.iter().map(|p| centre + *p).collect::<Vec<_>>(), |_| 0.0006, 8));
    b.add("wires", Shape::union(wires), chrome);
    // A cup that holds the glass from above, half a millimetre clear of it.
    let cup = Profile::start(0.0, 0.0805)
        .to(0.030, 0.0805)
        .crease()
        .to(0.034, 0.0780)
        .crease()
        .to(0.034, 0.100)
        .crease()
        .curve([0.034, 0.110], [0.014, 0.112], [0.012, 0.130], 10)
        .crease()
        .to(0.0, 0.130);
    let mut arm = cup.lathe(48).moved(centre);
    let wall = MIN.z;
    let path = [
        Vec3::new(centre.x, centre.y + 0.120, centre.z),
        Vec3::new(centre.x, centre.y + 0.150, centre.z - 0.006),
        Vec3::new(centre.x, centre.y + 0.168, centre.z - 0.040),
        Vec3::new(centre.x, centre.y + 0.160, centre.z - 0.100),
        Vec3::new(centre.x, centre.y + 0.150, wall + 0.005),
    ];
    arm.append(Shape::tube(&spline(&path, 10), |_| 0.008, 24));
    let plate = Profile::start(0.0, 0.0).to(0.045, 0.0).to(0.045, 0.010).crease().curve(
        [0.044, 0.018],
        [0.02, 0.02],
        [0.0, 0.02],
        10,
    );
    let upright = Quat::from_rotation_x(PI / 2.0);
    let pose = Affine3A::from_rotation_translation(upright, Vec3::new(centre.x, centre.y + 0.150, wall - 0.001));
    arm.append(plate.lathe(64).transformed(pose));
    b.add("lamp arm", arm, chrome);
}

/// A glass shelf with flasks on the right-hand wall side of the mirror.
fn shelf(b: &mut Builder, glass: usize, chrome: usize) {
    let (x0, x1, y, z0, z1) = (-0.40, 0.40, 1.165, MIN.z + 0.026, MIN.z + 0.142);
    let board = Shape::rounded_cuboid(Vec3::new(x0, y, z0), Vec3::new(x1, y + 0.009, z1), 0.002, 2);
    b.add("glass shelf", board, glass);
    let mut brackets = Shape::default();
    for x in [x0 + 0.07, x1 - 0.07] {
        let (low, high) = (Vec3::new(x - 0.008, y - 0.012, MIN.z + 0.005), Vec3::new(x + 0.008, y - 0.001, z0 + 0.055));
        brackets.append(Shape::rounded_cuboid(low, high, 0.003, 2));
    }
    b.add("shelf brackets", brackets, chrome);
    for (k, (x, color, scale)) in
        [(-0.24, 0x4E86C0, 1.0), (-0.13, 0xD89A3A, 0.8), (0.20, 0x5FB08A, 1.1)].into_iter().enumerate()
    {
        let mut matter = Material::glass(&format!("flask {k}"), 1.45);
        matter.absorption = srgb(color).map(|c| -c.max(0.02).ln() / 0.05);
        let matter = b.material(matter);
        let flask = Profile::start(0.0, 0.0)
            .to(0.018, 0.0)
            .curve([0.025, 0.0], [0.026, 0.004], [0.026, 0.012], 6)
            .curve([0.026, 0.050], [0.010, 0.050], [0.0085, 0.062], 14)
            .curve([0.0085, 0.066], [0.006, 0.0665], [0.0, 0.0665], 5);
        let at = Vec3::new(x, y + 0.0098, MIN.z + 0.085);
        let size = Affine3A::from_scale_rotation_translation(Vec3::splat(scale), Quat::IDENTITY, at);
        b.add(&format!("flask {k}"), flask.lathe(72).transformed(size), matter);
        let ball = Shape::icosphere(at + Vec3::Y * scale * 0.0775, scale * 0.0105, 3);
        b.add(&format!("stopper {k}"), ball, chrome);
    }
}

/// A rail on the left wall with two towels over it, and a ring with a small one.
fn towels(b: &mut Builder, chrome: usize) {
    let (x, y, z0, z1) = (MIN.x + 0.10, 1.08, -0.55, 0.35);
    let mut rail = Shape::rod(Vec3::new(x, y, z0), Vec3::new(x, y, z1), 0.009, 24);
    for z in [z0, z1] {
        rail.append(Shape::icosphere(Vec3::new(x, y, z), 0.0145, 3));
        rail.append(Shape::rod(Vec3::new(MIN.x + 0.005, y, z), Vec3::new(x, y, z), 0.008, 20));
    }
    b.add("towel rail", rail, chrome);
    for (k, (from, to, drop, cloth, band)) in
        [(-0.48, -0.10, 0.58, 0xF0EBE0, 0x2F6F7A), (-0.04, 0.29, 0.44, 0xC96F4A, 0xF0E0C8)].into_iter().enumerate()
    {
        let image = b.image(pattern::stripes(&format!("towel {k}"), cloth, band), [1.0, 1.0]);
        let mut matter = Material::diffuse(&format!("towel {k}"), Vec3::splat(0.85));
        matter.base_color_texture = Some(image);
        let matter = b.material(matter);
        let seed = 31 + k as u32;
        let back = 0.8 * drop;
        let bend = PI * 0.0135;
        let total = drop + bend + back;
        let surface = move |u: f32, v: f32| {
            // Down in front, up over the rail, down behind; folds grow towards the hem.
            let s = v * total;
            let (out, height, hang) = if s < drop {
                (0.0135, -(drop - s), (drop - s) / drop)
            } else if s < drop + bend {
                let a = PI * (s - drop) / bend;
                (0.0135 * a.cos(), 0.0135 * a.sin(), 0.0)
            } else {
                (-0.0135, -(s - drop - bend), (s - drop - bend) / back)
            };
            let fold = pattern::noise(Vec2::new(u * 5.0 + 8.0, 0.5), [64, 1], seed) - 0.5;
            let ripple = (u * 23.0 + 2.0 * fold).sin() * 0.006 + fold * 0.022;
            let swell = hang.powf(0.7) * ripple.abs().min(0.03) * if out > 0.0 { 1.0 } else { -0.6 };
            Vec3::new(x + out + swell, y + height, to + (from - to) * u)
        };
        let cloth = Shape::sheet(72, 120, |u, v| (surface(u, v), normal_of(surface, u, v)));
        b.add(&format!("towel {k}"), cloth, matter);
    }
}

/// A free-standing tub at the right-hand wall, a rug in front of the vanity.
fn tub(b: &mut Builder, ceramic: usize, chrome: usize) {
    let tub = Profile::start(0.0, 0.0)
        .to(0.66, 0.0)
        .crease()
        .curve([0.80, 0.10], [0.86, 0.34], [0.93, 0.56], 22)
        .curve([0.965, 0.582], [0.965, 0.605], [0.93, 0.603], 8)
        .curve([0.885, 0.60], [0.87, 0.57], [0.85, 0.50], 10)
        .curve([0.80, 0.22], [0.72, 0.11], [0.45, 0.10], 22)
        .to(0.0, 0.09);
    let scale =
        Affine3A::from_translation(Vec3::new(1.08, 0.003, -0.02)) * Affine3A::from_scale(Vec3::new(0.42, 1.0, 0.92));
    b.add("tub", tub.lathe(160).transformed(scale), ceramic);
    let root = Vec3::new(1.08, 0.0, -1.10);
    let path = [
        root + Vec3::new(0.0, 0.0, 0.0),
        root + Vec3::new(0.0, 0.70, 0.0),
        root + Vec3::new(0.0, 0.82, 0.03),
        root + Vec3::new(0.0, 0.88, 0.16),
        root + Vec3::new(0.0, 0.85, 0.33),
        root + Vec3::new(0.0, 0.77, 0.38),
    ];
    b.add("tub filler", Shape::tube(&spline(&path, 12), |_| 0.016, 28), chrome);

    let mut random = Random::new(77);
    let mat = b.material(Material::diffuse("bath mat", srgb(0xD9D2C4)));
    let mut shape = Shape::rounded_cuboid(Vec3::new(-0.42, 0.003, -0.58), Vec3::new(0.42, 0.020, -0.06), 0.008, 3);
    for i in 0..21 {
        let x = -0.40 + 0.04 * i as f32;
        let y = 0.019 + random.between(0.0, 0.002);
        shape.append(Shape::tube(
            &[Vec3::new(x, y, -0.57), Vec3::new(x, y + 0.001, -0.32), Vec3::new(x, y, -0.07)],
            |_| 0.008,
            10,
        ));
    }
    b.add("bath mat", shape, mat);
}
