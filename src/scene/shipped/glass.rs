//! `glass`: a goblet of red wine and marbles under a small lamp.
//!
//! The wine is modelled by its interfaces. Air to glass has index 1.5. Where the wine wets the bowl, the surface's front
//! is the glass and its inside the wine: index 1.33 / 1.5. The wine's upper surface has air in front: 1.33. A segment
//! is absorbed by the material whose back face it ends on, so the wine is what interface and upper surface enclose; they
//! share the vertices of the ring where they meet.

use glam::Vec3;

use super::curved::Profile;
use super::shape::Shape;
use super::{Builder, srgb};
use crate::scene::{Material, Scene};

/// Index of refraction of wine.
const WINE_IOR: f32 = 1.345;
/// Index of refraction of glass.
const GLASS_IOR: f32 = 1.5;
/// Segments around the goblet.
const SEGMENTS: usize = 224;

/// The three surfaces of a goblet with wine, standing on y = 0.
pub(super) struct Goblet {
    /// Air in front, glass inside; open where the wine wets the bowl.
    pub glass: Shape,
    /// Glass in front, wine inside.
    pub interface: Shape,
    /// Air in front, wine inside.
    pub surface: Shape,
}

impl Goblet {
    pub fn new() -> Self {
        let outside = Profile::start(0.0, 0.0030)
            .curve([0.012, 0.0030], [0.022, 0.0012], [0.0335, 0.0008], 10)
            .curve([0.0352, 0.0008], [0.0362, 0.0014], [0.0362, 0.0024], 6)
            .curve([0.0362, 0.0034], [0.0345, 0.0042], [0.0320, 0.0046], 6)
            .curve([0.0180, 0.0068], [0.0060, 0.0085], [0.0046, 0.0200], 14)
            .curve([0.0036, 0.0290], [0.0034, 0.0400], [0.0034, 0.0550], 10)
            .curve([0.0034, 0.0700], [0.0042, 0.0850], [0.0085, 0.0900], 10)
            .curve([0.0250, 0.0955], [0.0435, 0.1180], [0.0435, 0.1450], 26)
            .curve([0.0435, 0.1700], [0.0365, 0.1930], [0.0345, 0.2120], 20)
            .curve([0.0344, 0.2132], [0.0328, 0.2132], [0.0327, 0.2120], 8);
        // Down the inner wall: to the wine's level, then wetted.
        let inside = outside.curve([0.0340, 0.1960], [0.0405, 0.1800], [0.0415, 0.1560], 18);
        let rim_of_wine = inside.last_index();
        let rim = inside.last();
        let all = inside.curve([0.0418, 0.1480], [0.0417, 0.1390], [0.0404, 0.1320], 8).curve(
            [0.0368, 0.1120],
            [0.0190, 0.0975],
            [0.0, 0.0968],
            26,
        );
        let plain = |_| (1.0, 0.0);
        // The wine climbs the wall by a millimetre and a half. From wall to axis: the air is above.
        let level = |d: f32| rim.y - 0.0015 * (1.0 - (-d / 0.0016).exp());
        let surface = [0.0003, 0.0007, 0.0012, 0.0018, 0.0026, 0.0036, 0.0050, 0.0070, 0.0100, 0.0160]
            .into_iter()
            .fold(Profile::start(rim.x, rim.y), |profile, d| profile.to(rim.x - d, level(d)))
            .to(0.0, level(1.0));
        Self {
            glass: all.lathe_part(0..=rim_of_wine, SEGMENTS, plain),
            interface: all.lathe_part(rim_of_wine..=all.last_index(), SEGMENTS, plain).inverted(),
            surface: surface.lathe(SEGMENTS),
        }
    }
}

pub(super) fn scene() -> Scene {
    let mut b = Builder::default();
    let table = b.material(Material::diffuse("table", Vec3::new(0.76, 0.73, 0.69)));
    // A sweep of paper: table, bend, wall.
    let (half, front, back, bend, top) = (1.3, 1.1, -0.75, 0.35, 1.7);
    let steps = 48;
    let paper = Shape::sheet(1, steps + 2, |u, v| {
        let k = (v * (steps + 2) as f32).round();
        let x = Vec3::X * half * (2.0 * u - 1.0);
        let quarter = std::f32::consts::FRAC_PI_2;
        if k == 0.0 {
            (x + Vec3::Z * front, Vec3::Y)
        } else if k == (steps + 2) as f32 {
            (x + Vec3::new(0.0, top, back), Vec3::Z)
        } else {
            let (sin, cos) = (quarter * (k - 1.0) / steps as f32).sin_cos();
            let normal = Vec3::new(0.0, cos, sin);
            (x + Vec3::new(0.0, bend, back + bend) - normal * bend, normal)
        }
    });
    b.add("paper", paper, table);

    let glass = b.material(Material::glass("glass", GLASS_IOR));
    let wine_absorption = Vec3::new(9.0, 115.0, 100.0);
    let mut wine = Material::glass("wine against glass", WINE_IOR / GLASS_IOR);
    wine.absorption = wine_absorption;
    let interface = b.material(wine);
    let mut wine = Material::glass("wine against air", WINE_IOR);
    wine.absorption = wine_absorption;
    let surface = b.material(wine);
    let goblet = Goblet::new();
    let place = Vec3::new(-0.02, 0.0, 0.0);
    b.add("goblet", goblet.glass.moved(place), glass);
    b.add("wine against glass", goblet.interface.moved(place), interface);
    b.add("wine against air", goblet.surface.moved(place), surface);

    for (k, (x, z, radius, color)) in [
        (0.098, 0.062, 0.0125, 0x2E6FD0),
        (0.118, 0.024, 0.0105, 0xF0A818),
        (-0.112, 0.070, 0.0115, 0x2FA860),
        (0.045, 0.095, 0.0095, 0xE8E8F0),
    ]
    .into_iter()
    .enumerate()
    {
        let mut material = Material::glass(&format!("marble {k}"), 1.52);
        // Through the middle of a marble the colour is what it says.
        material.absorption = srgb(color).max(Vec3::splat(0.01)).map(|c| -c.ln() / (2.0 * radius));
        let material = b.material(material);
        b.add(&format!("marble {k}"), Shape::icosphere(Vec3::new(x, radius + 0.0007, z), radius, 5), material);
    }

    let bulb = b.material(Material::emitter("lamp", Vec3::new(2600.0, 2250.0, 1750.0)));
    b.add("lamp", Shape::icosphere(Vec3::new(-0.34, 0.46, -0.30), 0.011, 2), bulb);
    let soft = b.material(Material::emitter("soft light", Vec3::new(1.0, 1.15, 1.4)));
    b.add("soft light", Shape::quad(Vec3::new(0.75, 0.15, 0.55), Vec3::new(-0.45, 0.0, 0.60), Vec3::Y * 0.9), soft);

    b.camera("table", Vec3::new(0.10, 0.30, 0.62), Vec3::new(0.005, 0.083, 0.0), 24.0, 16.0 / 9.0);
    b.scene
}
