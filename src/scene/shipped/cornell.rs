//! `cornell`: the box with a red and a green wall, a mirror ball and a glass ball.

use glam::Vec3;

use super::Builder;
use super::shape::Shape;
use crate::scene::{Material, Scene};

/// Half the inner width, metres.
const HALF: f32 = 1.25;
/// Inner height, metres.
const HEIGHT: f32 = 2.5;

pub(super) fn scene() -> Scene {
    let mut b = Builder::default();
    let white = b.material(Material::diffuse("white wall", Vec3::new(0.74, 0.73, 0.70)));
    let red = b.material(Material::diffuse("red wall", Vec3::new(0.58, 0.07, 0.05)));
    let green = b.material(Material::diffuse("green wall", Vec3::new(0.13, 0.42, 0.11)));
    let (x, y, z) = (Vec3::X * 2.0 * HALF, Vec3::Y * HEIGHT, Vec3::Z * 2.0 * HALF);
    let corner = Vec3::new(-HALF, 0.0, -HALF);
    let shell = [Shape::quad(corner + z, x, -z), Shape::quad(corner + y, x, z), Shape::quad(corner, x, y)];
    b.add("floor, ceiling and back wall", Shape::union(shell), white);
    b.add("left wall", Shape::quad(corner + z, -z, y), red);
    b.add("right wall", Shape::quad(corner + x, z, y), green);

    let lamp = b.material(Material::emitter("lamp", Vec3::new(33.0, 27.8, 21.2)));
    let (w, d) = (0.70, 0.52);
    b.add("lamp", Shape::quad(Vec3::new(-w / 2.0, HEIGHT - 0.012, -d / 2.0), Vec3::X * w, Vec3::Z * d), lamp);
    let frame = b.material(Material::metal("lamp frame", Vec3::splat(0.6), 0.35));
    let rim = 0.02;
    let (x0, x1, z0, z1) = (-w / 2.0 - rim, w / 2.0 + rim, -d / 2.0 - rim, d / 2.0 + rim);
    let bar = |min_x: f32, max_x: f32, min_z: f32, max_z: f32| {
        Shape::cuboid(Vec3::new(min_x, HEIGHT - 0.02, min_z), Vec3::new(max_x, HEIGHT + 0.001, max_z))
    };
    let bars = [
        bar(x0, x0 + rim - 0.001, z0, z1),
        bar(x1 - rim + 0.001, x1, z0, z1),
        bar(x0 + rim - 0.001, x1 - rim + 0.001, z0, z0 + rim - 0.001),
        bar(x0 + rim - 0.001, x1 - rim + 0.001, z1 - rim + 0.001, z1),
    ];
    b.add("lamp frame", Shape::union(bars), frame);

    let mirror = b.material(Material::metal("mirror", Vec3::new(0.92, 0.91, 0.89), 0.0));
    b.add("mirror ball", Shape::icosphere(Vec3::new(-0.50, 0.519, -0.45), 0.52, 5), mirror);
    let glass = b.material(Material::glass("glass", 1.5));
    b.add("glass ball", Shape::icosphere(Vec3::new(0.56, 0.461, 0.38), 0.46, 6), glass);

    b.camera("front", Vec3::new(0.0, 1.25, 4.75), Vec3::new(0.0, 1.22, 0.0), 40.5, 1.0);
    b.scene
}
