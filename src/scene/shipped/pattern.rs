//! Images of the shipped scenes, made by code: mosaic, wood, cloth, and pictures for a wall.

use glam::{Vec2, Vec3};

use super::shape::{Random, hash};
use crate::scene::Image;

/// An image from a function of the texel's centre in [0, 1]², v down, that gives sRGB-encoded colour in [0, 1].
pub fn image(name: &str, width: u32, height: u32, color: impl Fn(Vec2) -> Vec3) -> Image {
    let texels = (0..height)
        .flat_map(|y| (0..width).map(move |x| Vec2::new(x as f32 + 0.5, y as f32 + 0.5)))
        .map(|p| {
            let c = color(p / Vec2::new(width as f32, height as f32)).clamp(Vec3::ZERO, Vec3::ONE) * 255.0;
            [c.x.round() as u8, c.y.round() as u8, c.z.round() as u8, 255]
        })
        .collect();
    Image { name: name.into(), width, height, texels }
}

/// sRGB-encoded colour in [0, 1] of 0xRRGGBB.
pub fn encoded(hex: u32) -> Vec3 {
    Vec3::new((hex >> 16 & 255) as f32, (hex >> 8 & 255) as f32, (hex & 255) as f32) / 255.0
}

/// Smooth noise in [0, 1] that repeats after `period` cells in x and y.
pub fn noise(p: Vec2, period: [u32; 2], seed: u32) -> f32 {
    let cell = p.floor();
    let f = p - cell;
    let f = f * f * (Vec2::splat(3.0) - 2.0 * f);
    let at = |dx: i32, dy: i32| {
        let x = (cell.x as i32 + dx).rem_euclid(period[0] as i32) as u32;
        let y = (cell.y as i32 + dy).rem_euclid(period[1] as i32) as u32;
        hash(x.wrapping_mul(0x8DA6_B343) ^ y.wrapping_mul(0xD816_3841) ^ seed) as f32 / u32::MAX as f32
    };
    let top = at(0, 0) * (1.0 - f.x) + at(1, 0) * f.x;
    let bottom = at(0, 1) * (1.0 - f.x) + at(1, 1) * f.x;
    top * (1.0 - f.y) + bottom * f.y
}

/// `n × n` glass mosaic stones of a few blues; it repeats.
pub fn mosaic(n: u32) -> Image {
    let palette = [0x84BFD2, 0x93CBDA, 0x74B0CA, 0xA6D7E0, 0x7FB8C8, 0x9BD0D8].map(encoded);
    let texels = n * 16;
    image("mosaic", texels, texels, |p| {
        let q = p * n as f32;
        let cell = q.floor();
        let inside = (q - cell - Vec2::splat(0.5)).abs().max_element();
        if inside > 0.44 {
            return encoded(0xDCE4E2);
        }
        let mut random = Random::new(cell.x as u32 * 131 + cell.y as u32 * 7919 + 11);
        let base = palette[(random.unit() * palette.len() as f32) as usize];
        base * random.between(0.94, 1.04)
    })
}

/// Boards of `rows` rows, alternately shifted, along u; it repeats.
pub fn boards(name: &str, rows: u32, light: u32, dark: u32, seed: u32) -> Image {
    let (light, dark) = (encoded(light), encoded(dark));
    image(name, 512, 512, |p| {
        let row = (p.y * rows as f32).floor();
        let within = p.y * rows as f32 - row;
        let mut random = Random::new(seed ^ (row as u32 * 977 + 3));
        let shift = random.unit();
        let along = (p.x + shift).fract();
        let tone = random.between(-0.22, 0.22);
        let joint = within < 0.025 || along < 0.004;
        let grain_seed = seed.wrapping_add(row as u32 * 7);
        let streak = noise(Vec2::new(p.x * 6.0, p.y * rows as f32 * 14.0), [6, rows * 14], grain_seed);
        let fine = noise(Vec2::new(p.x * 24.0, p.y * rows as f32 * 40.0), [24, rows * 40], grain_seed + 1);
        let mix = (0.35 + 0.45 * streak + 0.2 * fine + tone).clamp(0.0, 1.0);
        let color = light.lerp(dark, mix);
        if joint { color * 0.35 } else { color }
    })
}

/// A woven rug with a border and a field of lozenges, seen once.
pub fn rug() -> Image {
    let [red, dark, cream, blue, gold] = [0x8E2F2A, 0x3B1B1E, 0xD9C6A0, 0x2E4560, 0xB98A3C].map(encoded);
    image("rug", 512, 384, |p| {
        let size = Vec2::new(4.0, 3.0);
        let q = p * size;
        let edge = q.min(size - q).min_element();
        let weave = 0.94 + 0.06 * noise(p * Vec2::new(256.0, 192.0), [256, 192], 5);
        let lozenge = |cell: f32, q: Vec2| {
            let r = (q / cell - (q / cell).floor() - Vec2::splat(0.5)).abs();
            r.x + r.y
        };
        let color = if edge < 0.06 {
            cream
        } else if edge < 0.16 {
            dark
        } else if edge < 0.42 {
            let d = lozenge(0.13, q - Vec2::splat(0.16));
            if d < 0.18 {
                gold
            } else if d < 0.30 {
                cream
            } else {
                blue
            }
        } else if edge < 0.48 {
            cream
        } else {
            let c = (q - 0.5 * size) / Vec2::new(1.3, 0.85);
            let medallion = c.x.abs() + c.y.abs();
            let d = lozenge(0.24, q);
            if medallion < 0.35 {
                cream
            } else if medallion < 0.55 {
                blue
            } else if medallion < 0.72 {
                gold
            } else if medallion < 0.78 {
                dark
            } else if d < 0.12 {
                gold
            } else if d < 0.2 {
                dark
            } else {
                red
            }
        };
        color * weave
    })
}

/// A landscape of hills in flat colours.
pub fn hills(name: &str, seed: u32, sky: [u32; 2], near: u32, far: u32) -> Image {
    let (sky, near, far) = (sky.map(encoded), encoded(near), encoded(far));
    image(name, 256, 192, |p| {
        let mut color = sky[0].lerp(sky[1], (p.y / 0.6).min(1.0));
        let sun = Vec2::new(0.68, 0.30);
        if (p - sun).length() < 0.075 {
            color = encoded(0xF6E3B0);
        }
        for layer in 0..5 {
            let t = layer as f32 / 4.0;
            let wave = noise(Vec2::new(p.x * (2.0 + 1.5 * t) + t * 3.0, 0.5), [64, 1], seed + layer)
                + 0.35 * noise(Vec2::new(p.x * 9.0 + t, 0.5), [64, 1], seed + 40 + layer);
            if p.y > 0.40 + 0.13 * layer as f32 - 0.20 * (wave - 0.6) {
                color = far.lerp(near, t);
            }
        }
        color
    })
}

/// Overlapping discs on a plain ground.
pub fn discs(name: &str, seed: u32, ground: u32, palette: &[u32]) -> Image {
    let mut random = Random::new(seed);
    let discs: Vec<(Vec2, f32, Vec3)> = (0..9)
        .map(|k| {
            let centre = Vec2::new(random.between(0.15, 0.85), random.between(0.15, 0.85));
            (centre, random.between(0.06, 0.20), encoded(palette[k % palette.len()]))
        })
        .collect();
    image(name, 192, 256, |p| {
        discs.iter().fold(encoded(ground), |color, &(centre, radius, disc)| {
            let d = (p - centre) * Vec2::new(1.0, 256.0 / 192.0);
            if d.length() < radius { color * 0.25 + disc * 0.75 } else { color }
        })
    })
}

/// Stripes along u for a towel: white cloth with a few bands.
pub fn stripes(name: &str, cloth: u32, band: u32) -> Image {
    let (cloth, band) = (encoded(cloth), encoded(band));
    image(name, 64, 256, |p| {
        let bands = [(0.04, 0.055), (0.065, 0.105), (0.115, 0.13), (0.87, 0.885), (0.895, 0.935), (0.945, 0.96)];
        let weave = 0.95 + 0.05 * noise(p * Vec2::new(32.0, 128.0), [32, 128], 9);
        if bands.iter().any(|&(from, to)| p.y > from && p.y < to) { band * weave } else { cloth * weave }
    })
}
