//! Furniture for the rooms of the shipped scenes. Each piece stands on y = 0 about the y axis and faces +z.

use glam::{Affine3A, Quat, Vec2, Vec3};

use super::curved::spline;
use super::shape::{Random, Shape};

/// A cushion: a rounded box, swollen in the middle. `size` in metres, centred on x and z, standing on y = 0.
pub fn cushion(size: Vec3, radius: f32, swell: f32) -> Shape {
    let half = 0.5 * size;
    let mut pillow = Shape::padded_cuboid(-half, half, radius, 4, [10, 1, 10]);
    for (p, normal) in pillow.positions.iter_mut().zip(&mut pillow.normals) {
        let q = *p / half;
        let bulge = (1.0 - q.x * q.x).max(0.0) * (1.0 - q.z * q.z).max(0.0);
        let slope = Vec2::new(
            -2.0 * q.x / half.x * (1.0 - q.z * q.z).max(0.0),
            -2.0 * q.z / half.z * (1.0 - q.x * q.x).max(0.0),
        ) * swell;
        let side = q.y.clamp(-1.0, 1.0);
        p.y += swell * bulge * side;
        let stretch = 1.0 + swell * bulge / half.y;
        *normal = Vec3::new(
            normal.x - slope.x * side * normal.y / stretch,
            normal.y / stretch,
            normal.z - slope.y * side * normal.y / stretch,
        )
        .normalize();
    }
    pillow.moved(Vec3::Y * half.y)
}

/// The upholstered parts of a sofa of `width` metres with `seats` seats, and its wooden feet.
pub fn sofa(width: f32, seats: usize) -> (Shape, Shape) {
    let (depth, arm, seat_top, arm_top, back_top) = (0.92, 0.20, 0.30, 0.62, 0.84);
    let block = |x0: f32, x1: f32, y0: f32, y1: f32, z0: f32, z1: f32, radius: f32| {
        Shape::rounded_cuboid(Vec3::new(x0, y0, z0), Vec3::new(x1, y1, z1), radius, 4)
    };
    let (h, d) = (0.5 * width, 0.5 * depth);
    let mut body = block(-h + arm - 0.01, h - arm + 0.01, 0.11, seat_top, -d + 0.05, d - 0.03, 0.03);
    body.append(block(-h, -h + arm, 0.10, arm_top, -d + 0.02, d, 0.07));
    body.append(block(h - arm, h, 0.10, arm_top, -d + 0.02, d, 0.07));
    body.append(block(-h + arm - 0.02, h - arm + 0.02, 0.12, back_top, -d, -d + 0.20, 0.07));
    let inner = width - 2.0 * arm;
    let seat = inner / seats as f32;
    for k in 0..seats {
        let x = -0.5 * inner + (k as f32 + 0.5) * seat;
        let bottom = cushion(Vec3::new(seat - 0.012, 0.15, depth - 0.22), 0.045, 0.022);
        body.append(bottom.moved(Vec3::new(x, seat_top - 0.006, 0.085)));
        let back = cushion(Vec3::new(seat - 0.03, 0.15, 0.42), 0.06, 0.035);
        let lean = Quat::from_rotation_x(1.36);
        let pose = Affine3A::from_rotation_translation(lean, Vec3::new(x, seat_top + 0.345, -d + 0.185));
        body.append(back.transformed(pose));
    }
    let mut feet = Shape::default();
    for x in [-h + 0.10, h - 0.10] {
        for z in [-d + 0.10, d - 0.10] {
            let (from, to) = (Vec3::new(x, 0.12, z), Vec3::new(x, -0.001, z));
            feet.append(Shape::tube(&[from, to], |t| 0.030 - 0.010 * t, 20));
        }
    }
    (body, feet)
}

/// A low table: a top with rounded edges on four leaning legs and a shelf.
pub fn table(size: Vec3) -> Shape {
    let (x, z) = (0.5 * size.x, 0.5 * size.z);
    let thick = 0.036;
    let mut shape = Shape::rounded_cuboid(Vec3::new(-x, size.y - thick, -z), Vec3::new(x, size.y, z), 0.010, 4);
    let (lx, lz) = (x - 0.09, z - 0.08);
    for (sx, sz) in [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)] {
        let top = Vec3::new(sx * lx, size.y - thick + 0.004, sz * lz);
        let foot = Vec3::new(sx * (lx + 0.045), -0.001, sz * (lz + 0.035));
        shape.append(Shape::tube(&[top, foot], |t| 0.024 - 0.010 * t, 24));
    }
    shape.append(Shape::rounded_cuboid(
        Vec3::new(-lx - 0.005, 0.13, -lz - 0.005),
        Vec3::new(lx + 0.005, 0.148, lz + 0.005),
        0.006,
        3,
    ));
    shape
}

/// A picture frame around an opening of `size` metres, its back at z = 0, and the place of the picture.
pub fn frame(size: Vec2, width: f32) -> (Shape, Shape) {
    let (x, y) = (0.5 * size.x, 0.5 * size.y);
    let bar = |x0: f32, y0: f32, x1: f32, y1: f32| {
        Shape::rounded_cuboid(Vec3::new(x0, y0, -0.001), Vec3::new(x1, y1, 0.026), 0.007, 3)
    };
    let bars = [
        bar(-x - width, -y - width, x + width, -y),
        bar(-x - width, y, x + width, y + width),
        bar(-x - width + 0.0005, -y - 0.008, -x, y + 0.008),
        bar(x, -y - 0.008, x + width - 0.0005, y + 0.008),
    ];
    let edge = 0.004;
    let mut picture = Shape::quad(
        Vec3::new(-x - edge, -y - edge, 0.009),
        Vec3::X * (size.x + 2.0 * edge),
        Vec3::Y * (size.y + 2.0 * edge),
    );
    for uv in &mut picture.uvs {
        *uv /= size + 2.0 * edge;
    }
    (Shape::union(bars), picture)
}

/// A row of books along +x on y = 0 with their backs at z = 0, `length` metres of them, each in one of `colors`.
pub fn books(length: f32, tallest: f32, colors: &[Vec3], seed: u32) -> Shape {
    let mut random = Random::new(seed);
    let mut shape = Shape::default();
    let mut x = 0.0;
    while x < length - 0.05 {
        let width = random.between(0.014, 0.045);
        let height = tallest * random.between(0.70, 1.0);
        let depth = random.between(0.13, 0.18);
        let color = colors[(random.unit() * colors.len() as f32) as usize % colors.len()];
        let lean = if random.unit() < 0.08 { -0.10 } else { 0.0 };
        let book = Shape::rounded_cuboid(Vec3::new(0.0, -0.001, -depth), Vec3::new(width, height, 0.0), 0.004, 2);
        let pose =
            Affine3A::from_rotation_translation(Quat::from_rotation_z(lean), Vec3::new(x, 0.0, -random.unit() * 0.02));
        shape.append(book.transformed(pose).colored(color * random.between(0.8, 1.1)));
        x += width + 0.0015 - lean * height;
    }
    shape
}

/// A floor-length curtain in folds, `size` metres wide and high, hanging in the plane z = 0.
pub fn curtain(size: Vec2, folds: usize, seed: u32) -> Shape {
    let surface = move |u: f32, v: f32| {
        let drift = super::pattern::noise(Vec2::new(u * 6.0 + 10.0, 0.5), [64, 1], seed) - 0.5;
        let phase = std::f32::consts::TAU * folds as f32 * u + 3.0 * drift;
        let gather = 0.035 + 0.020 * (1.0 - v);
        Vec3::new((u - 0.5) * size.x + 0.3 * gather * (2.0 * phase).sin(), v * size.y, gather * phase.sin())
    };
    Shape::sheet(24 * folds, 12, |u, v| (surface(u, v), super::curved::normal_of(surface, u, v)))
}

/// A log from `from` to `to` with rough bark.
pub fn log(from: Vec3, to: Vec3, radius: f32, seed: u32) -> Shape {
    let mut random = Random::new(seed);
    let sag =
        Vec3::new(random.between(-1.0, 1.0), random.between(-0.4, 0.4), random.between(-1.0, 1.0)) * (0.12 * radius);
    let path = spline(&[from, from.lerp(to, 0.35) + sag, from.lerp(to, 0.7) - 0.5 * sag, to], 14);
    let mut shape = Shape::tube(&path, |_| radius, 40);
    let sides = 40;
    let n_rings = path.len();
    for (ring, centre) in path.iter().enumerate() {
        for k in 0..sides {
            let i = ring * sides + k;
            let bark = super::pattern::noise(Vec2::new(k as f32 * 0.4, ring as f32 * 0.22), [16, 512], seed)
                + 0.5 * super::pattern::noise(Vec2::new(k as f32 * 0.8, ring as f32 * 0.35), [32, 512], seed + 1);
            let p = shape.positions[i];
            shape.positions[i] = p + (p - *centre) * (0.16 * (bark - 0.75));
        }
    }
    // The two flat ends repeat their rings.
    let ends = n_rings * sides;
    for k in 0..sides {
        shape.positions[ends + 1 + k] = shape.positions[k];
        shape.positions[ends + sides + 2 + k] = shape.positions[ends - sides + k];
    }
    shape.smooth(ends);
    shape
}
