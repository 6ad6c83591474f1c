//! What `sunfleck::inspect` shows, and the bit of a photon that it rests on.

use std::sync::Arc;

use glam::{Vec2, Vec3};
use sunfleck::cpu::trace::{self, Ray, Seer};
use sunfleck::cpu::{CpuStages, gather};
use sunfleck::index;
use sunfleck::inspect::{self, ColorBy, FirstHits, Hit, Iteration, Object, Split, Style, View};
use sunfleck::layout::{self, EYE_GATHER, EyeVertex, Frame, PRIMITIVE_SPHERE, Photon};
use sunfleck::math::oct;
use sunfleck::ppm::{self, Direct, Error, FirstRadius, Interrupt, Params, Stages};
use sunfleck::scene::{Camera, Material, Mesh, PackedScene, Projection, PunctualKind, PunctualLight, Scene, Sphere};

const SIZE: u32 = 32;

/// Facing +y at the height `y`.
fn floor(y: f32, material: usize) -> Mesh {
    Mesh {
        name: "floor".into(),
        positions: [[-4., y, 4.], [4., y, 4.], [4., y, -4.], [-4., y, -4.]].map(Vec3::from).to_vec(),
        triangles: vec![[0, 1, 2], [0, 2, 3]],
        material,
        ..Mesh::default()
    }
}

/// A ball over a floor, and a lamp above that is a point.
fn ball(material: Material) -> Scene {
    let light = PunctualLight {
        name: String::new(),
        position: Vec3::new(0.3, 3.0, 0.0),
        direction: Vec3::NEG_Y,
        intensity: Vec3::splat(10.0),
        kind: PunctualKind::Point,
    };
    Scene {
        meshes: vec![floor(0.0, 0).into()],
        spheres: vec![Sphere { centre: Vec3::Y, radius: 0.4, inward: false, material: 1 }],
        materials: vec![Material::diffuse("floor", Vec3::new(0.7, 0.6, 0.5)), material],
        lights: vec![light],
        cameras: vec![Camera::look_at("", Vec3::new(0.0, 2.5, 5.0), Vec3::new(0.0, 0.5, 0.0), Vec3::Y, 0.6)],
        ..Scene::default()
    }
}

fn photons(scene: &Scene, params: &Params) -> (Arc<PackedScene>, Vec<Photon>) {
    let packed = Arc::new(PackedScene::new(scene));
    let mut stages = CpuStages::new(packed.clone(), layout::Camera::default(), [1, 1]);
    stages.trace_photons(&params.frame(1)).expect("photons");
    (packed, stages.photons().expect("photons"))
}

/// Whether the photon came straight from the ball.
fn is_from_ball(scene: &PackedScene, photon: &Photon) -> bool {
    let direction = oct::decode(photon.direction);
    let origin = Vec3::from(photon.position) + Vec3::Y * 1e-4;
    let ray = Ray { origin, direction, t_max: f32::INFINITY, alpha_seed: 0, seer: Seer::Light };
    trace::nearest(scene, &ray)
        .is_some_and(|hit| scene.primitives[hit.primitive as usize].flags & PRIMITIVE_SPHERE != 0)
}

#[test]
fn caustic_photons_lie_where_a_glass_ball_sends_light() {
    let params = Params { n_paths: 50_000, direct: Direct::Photons, ..Params::new(1, 1) };
    let (packed, photons) = photons(&ball(Material::glass("glass", 1.5)), &params);
    let of =
        |caustic, segments| photons.iter().filter(|p| p.is_caustic() == caustic && p.segments() == segments).count();
    // Straight from the lamp; off the ball; through the ball; from the floor off the ball.
    assert!(of(false, 1) > 10_000 && of(true, 1) == 0);
    assert!(of(true, 2) > 5 && of(false, 2) == 0, "{} and {}", of(true, 2), of(false, 2));
    assert!(of(true, 3) > 300, "{}", of(true, 3));
    assert!(of(false, 3) > 0, "{}", of(false, 3));
    let caustic: Vec<&Photon> = photons.iter().filter(|p| p.is_caustic()).collect();
    // Octahedral directions are within 7e-5: some that grazed the ball seem to have missed it.
    let missed = caustic.iter().filter(|p| !is_from_ball(&packed, p)).count();
    assert!(missed * 200 <= caustic.len(), "{missed} of {}", caustic.len());
    // The ball focuses: most of the light that it lets through falls where its shadow would be.
    let shadow = |p: &&&Photon| Vec3::from(p.position).distance(Vec3::new(-0.15, 0.0, 0.0)) < 0.6;
    let focused = caustic.iter().filter(|p| p.segments() == 3).filter(shadow).count();
    assert!(focused * 10 > of(true, 3) * 7, "{focused} of {}", of(true, 3));
}

#[test]
fn caustic_photons_come_off_what_stores_none() {
    let params = Params { n_paths: 20_000, ..Params::new(1, 1) };
    let caustic = |material| {
        let (_, photons) = photons(&ball(material), &params);
        photons.iter().filter(|p| p.is_caustic()).count()
    };
    let metal = |roughness| Material::metal("", Vec3::ONE, roughness);
    assert!(caustic(metal(0.0)) > 20);
    assert!(caustic(metal(0.2)) > 20);
    assert_eq!(caustic(metal(0.5)), 0);
    assert_eq!(caustic(Material::diffuse("", Vec3::ONE)), 0);
    // A smooth coat sends some light on, its base the rest.
    let coated = Material { roughness: 0.0, ..Material::default() };
    let (_, all) = photons(&ball(coated.clone()), &params);
    let n = caustic(coated);
    assert!(n > 5 && n < all.iter().filter(|p| p.segments() == 2).count() / 2, "{n}");
}

#[test]
fn a_photon_path_is_as_long_as_its_bits_count() {
    let mut scene = ball(Material::diffuse("", Vec3::ONE));
    scene.materials[0].base_color = Vec3::ONE;
    scene.spheres[0] = Sphere { centre: Vec3::Y, radius: 2.5, inward: true, material: 1 };
    let params = Params { n_paths: 20, roulette: false, max_photon_segments: 1000, ..Params::new(1, 1) };
    let (_, photons) = photons(&scene, &params);
    assert!(photons.iter().all(|p| !p.is_caustic()));
    assert_eq!(photons.iter().map(Photon::segments).max(), Some(layout::MAX_PHOTON_SEGMENTS));
}

/// Photons that the estimate takes, by looking at all of them.
fn brute_force(frame: &Frame, vertex: &EyeVertex, radius: f32, photons: &[Photon]) -> usize {
    let normal = oct::decode(vertex.normal);
    let near = |p: &&Photon| {
        let d2 = index::distance2(p.position.into(), vertex.position.into());
        let off = (Vec3::from(p.position) - Vec3::from(vertex.position)).dot(normal);
        d2 <= index::radius2(radius)
            && off.abs() <= gather::MAX_PLANE_OFFSET * radius
            && oct::decode24(p.normal_and_segments).dot(normal) >= gather::MIN_NORMAL_COSINE
            && (vertex.flags >> 8 & 255) + p.segments() <= frame.max_segments
    };
    if vertex.flags & EYE_GATHER == 0 { 0 } else { photons.iter().filter(near).count() }
}

#[test]
fn the_parts_of_the_light_add_up_to_it() {
    let scene = ball(Material::glass("glass", 1.5));
    let packed = Arc::new(PackedScene::new(&scene));
    for direct in [Direct::Sampled, Direct::Photons] {
        let params = Params { n_paths: 20_000, direct, max_segments: 7, ..Params::new(SIZE, SIZE) };
        let mut stages = CpuStages::new(packed.clone(), scene.cameras[0].pack(SIZE, SIZE), params.film_size());
        let first_radii = ppm::start(&mut stages, &params).expect("start");
        let mut mean = Split::default();
        for i in 1..=3 {
            let frame = params.frame(i);
            ppm::iterate(&mut stages, &frame).expect("iteration");
            let (vertices, photons) = (stages.eye_vertices().expect("eye"), stages.photons().expect("photons"));
            let iteration = Iteration::new(&packed, &frame, &vertices, &first_radii.each, &photons);
            let split = iteration.split(&Interrupt::default()).expect("split");
            assert_sums(&split, &stages.radiance().expect("radiance"));
            let radii = iteration.radii();
            assert!(radii.iter().zip(&first_radii.each).all(|(r, first)| *r == first * frame.radius_scale));
            let nodes = iteration.nodes_visited(&Interrupt::default()).expect("nodes");
            let unwanted = Interrupt::when(|| true);
            assert!(matches!(iteration.split(&unwanted), Err(Error::Interrupted)));
            assert!(matches!(iteration.nodes_visited(&unwanted), Err(Error::Interrupted)));
            for (pixel, parts) in split.pixels.iter().enumerate().step_by(7) {
                let expected = brute_force(&frame, &vertices[pixel], radii[pixel], &photons);
                assert_eq!(parts.gathered, expected as f32, "pixel {pixel}");
                assert_eq!(nodes[pixel] > 0, vertices[pixel].flags & EYE_GATHER != 0, "pixel {pixel}");
            }
            mean.add(&split);
        }
        assert_eq!(mean.n_iterations, 3);
        assert_sums(&mean, &stages.film().expect("film").rgb());
        let brightest =
            |part: &dyn Fn(&inspect::Parts) -> [f32; 3]| mean.pixels.iter().map(|p| part(p)[0]).fold(0.0, f32::max);
        let (d, c, i) = (brightest(&|p| p.direct), brightest(&|p| p.caustic), brightest(&|p| p.indirect));
        assert!(d > 0.0 && c > i && i > 0.0, "direct {d}, caustic {c}, indirect {i}");
        assert!(mean.pixels.iter().any(|p| p.gathered > 5.0));
    }
}

#[track_caller]
fn assert_sums(split: &Split, radiance: &[[f32; 3]]) {
    assert_eq!(split.pixels.len(), radiance.len());
    for (i, (parts, &radiance)) in split.pixels.iter().zip(radiance).enumerate() {
        let sum = Vec3::from(parts.direct) + Vec3::from(parts.caustic) + Vec3::from(parts.indirect);
        let off = (sum - Vec3::from(radiance)).abs().max_element();
        assert!(off <= 1e-5 * Vec3::from(radiance).max_element(), "pixel {i}: {sum} is not {radiance:?}");
    }
}

/// Of a pinhole at `from` that looks at the origin, 90° high.
fn view(from: Vec3, size: [u32; 2], crop: [u32; 4]) -> View {
    let camera = Camera::look_at("", from, Vec3::ZERO, Vec3::Y, std::f32::consts::FRAC_PI_2);
    View::new(camera.pack(size[0], size[1]), size, crop)
}

#[test]
fn the_first_hit_is_what_is_in_front() {
    let scene = ball(Material::metal("metal", Vec3::new(0.9, 0.5, 0.1), 0.3));
    let packed = PackedScene::new(&scene);
    // From right above, the ball before the floor.
    let above = Vec3::new(0.0, 5.0, 1e-4);
    let (size, crop) = ([64, 48], [0, 0, 64, 48]);
    let whole = FirstHits::trace(&packed, &view(above, size, crop));
    let middle = whole.hit(32, 24).expect("the ball");
    assert!((middle.distance - 3.6).abs() < 0.02 && (middle.depth - 3.6).abs() < 0.02, "{middle:?}");
    assert!(middle.normal.y > 0.9 && middle.position.distance(Vec3::Y * 1.4) < 0.15, "{middle:?}");
    assert_eq!((middle.material, middle.object(&scene)), (1, Object::Sphere(0)));
    assert!((middle.base_color - Vec3::new(0.9, 0.5, 0.1)).length() < 1e-6);
    let corner = whole.hit(16, 40).expect("the floor");
    assert!((corner.depth - 5.0).abs() < 1e-2 && corner.distance > 6.5 && corner.position.y.abs() < 1e-3, "{corner:?}");
    assert_eq!((corner.material, corner.object(&scene)), (0, Object::Mesh(0)));
    assert_eq!(whole.hit(64, 0), None);
    assert_eq!(whole.depths()[24 * 64 + 32], middle.depth);
    assert_eq!(whole.normals()[24 * 64 + 32], middle.normal.to_array());
    assert_eq!(whole.base_colors()[40 * 64 + 16], [0.7, 0.6, 0.5]);

    let part_view = view(above, size, [10, 20, 40, 30]);
    let part = FirstHits::trace(&packed, &part_view);
    let same = |a: Hit, b: Hit| a.object == b.object && a.position.distance(b.position) < 1e-4;
    assert!(same(part.hit(32 - 10, 24 - 20).expect("the ball"), middle));
    let picked = inspect::pick(&packed, &part_view, Vec2::new(22.5, 4.5)).expect("the ball");
    assert!(same(picked, middle) && picked.normal.distance(middle.normal) < 1e-4, "{picked:?}");
    for outside in [Vec2::new(30.0, 1.0), Vec2::new(-0.1, 1.0), Vec2::NAN] {
        assert_eq!(inspect::pick(&packed, &part_view, outside), None);
    }

    // Away from everything.
    let up = Camera::look_at("", above, Vec3::Y * 9.0, Vec3::X, 1.0).pack(8, 8);
    let nothing = FirstHits::trace(&packed, &View::new(up, [8, 8], [0, 0, 8, 8]));
    assert_eq!(nothing.hit(4, 4), None);
    assert!(nothing.depths().iter().all(|d| *d == f32::INFINITY));
}

#[test]
fn points_appear_where_rays_go() {
    let mut parallel = Camera::look_at("", Vec3::new(1.0, 2.0, 3.0), Vec3::ZERO, Vec3::Y, 0.7);
    parallel.aperture_radius = 0.3;
    let lens = parallel.clone();
    parallel.projection = Projection::Orthographic { ymag: 1.5 };
    for camera in [lens, parallel] {
        let view = View::new(camera.pack(40, 30), [40, 30], [7, 3, 33, 29]);
        assert_eq!(view.film_size(), [26, 26]);
        let (middle, axis) = view.ray(Vec2::new(13.0, 12.0));
        assert!(axis.dot(Vec3::new(1.0, 2.0, 3.0).normalize()) < -1.0 + 1e-5, "{axis} from {middle}");
        for at in [Vec2::new(0.5, 0.5), Vec2::new(25.25, 3.0), Vec2::new(12.0, 20.75)] {
            let (origin, direction) = view.ray(at);
            let (found, depth) = view.project(origin + 2.0 * direction).expect("in front");
            assert!(found.distance(at) < 1e-3 && (depth - 2.0 * direction.dot(axis)).abs() < 1e-5, "{found}, not {at}");
            assert_eq!(view.project(origin - 2.0 * direction), None);
        }
    }
}

fn photon(position: Vec3, power: f32, segments: u32) -> Photon {
    let normal_and_segments = oct::encode24(Vec3::Y) | segments << 24;
    Photon { position: position.to_array(), normal_and_segments, power: [power; 3], direction: oct::encode(Vec3::Y) }
}

#[test]
fn photons_are_drawn_in_front_of_surfaces_and_not_behind() {
    let scene = ball(Material::default());
    let packed = PackedScene::new(&scene);
    let view = view(Vec3::new(0.0, 0.5, 3.0), [65, 65], [0, 0, 65, 65]);
    let hits = FirstHits::trace(&packed, &view);
    let [on_ball, behind_ball, on_floor, below_floor, in_the_air] =
        [[0.0, 1.0, 0.4], [0.0, 1.1, -0.41], [0.6, 0.0, -3.9], [0.6, -0.3, 1.0], [-0.6, 1.0, 0.0]].map(Vec3::from);
    let places = [on_ball, behind_ball, on_floor, below_floor, in_the_air];
    let drawn = |style: &Style| {
        places.map(|p| {
            let picture = inspect::draw(&[photon(p, 1.0, 3)], &hits, style);
            let (at, _) = view.project(p).expect("in view");
            let there = picture[at.y as usize * 65 + at.x as usize];
            assert_eq!(picture.iter().any(|c| c[3] > 0), there[3] == 255);
            (there[3] == 255).then(|| [there[0], there[1], there[2]])
        })
    };
    let style = Style { color: ColorBy::Bounce, point_size: 1.0, through: false };
    let color = Some(inspect::bounce_color(3));
    assert_eq!(drawn(&style), [color, None, color, None, color]);
    assert_eq!(drawn(&Style { through: true, ..style }), [color; 5]);
}

#[test]
fn photons_are_coloured_by_power_or_bounce() {
    let packed = PackedScene::default();
    let view = view(Vec3::Z * 2.0, [9, 9], [0, 0, 9, 9]);
    let hits = FirstHits::trace(&packed, &view);
    // One behind the other in the middle, a third at the side, one behind the camera.
    let photons = [(Vec3::ZERO, 4.0, 1), (Vec3::Z, 1.0, 2), (Vec3::X, 2.0, 90), (Vec3::Z * 3.0, 3.0, 1)]
        .map(|(p, w, n)| photon(p, w, n));
    let mut style = Style { color: ColorBy::Power, point_size: 1.0, through: false };
    let opaque = |[r, g, b]: [u8; 3]| [r, g, b, 255];
    let picture = inspect::draw(&photons, &hits, &style);
    let (middle, side) = (4 * 9 + 4, 4 * 9 + 6);
    assert_eq!(picture[middle], opaque(inspect::power_color(0.0)));
    assert_eq!(picture[side], opaque(inspect::power_color(0.5)));
    assert_eq!(picture.iter().filter(|c| c[3] > 0).count(), 2);
    style.color = ColorBy::Bounce;
    let picture = inspect::draw(&photons, &hits, &style);
    assert_eq!([picture[middle], picture[side]], [opaque(inspect::bounce_color(2)), opaque(inspect::bounce_color(90))]);
    style.point_size = 3.0;
    assert_eq!(inspect::draw(&photons, &hits, &style).iter().filter(|c| c[3] > 0).count(), 9 + 7 - 1);
    let brightness = |t| inspect::power_color(t).map(u32::from).iter().sum::<u32>();
    assert!((0..10).all(|i| brightness(i as f32 / 10.0) < brightness((i + 1) as f32 / 10.0)));
    let colors: std::collections::HashSet<_> = (1..=8).map(inspect::bounce_color).collect();
    assert_eq!(colors.len(), 8);
    // Whatever the powers are.
    assert_eq!(inspect::power_range(&[]), [1.0, 1.0]);
    assert_eq!(inspect::power_range(&[photon(Vec3::ZERO, 0.0, 1)]), [1.0, 1.0]);
    let same = [photon(Vec3::ZERO, 0.0, 1), photon(Vec3::X, 5.0, 1)];
    style.color = ColorBy::Power;
    assert_eq!(inspect::draw(&same, &hits, &style)[side], opaque(inspect::power_color(1.0)));
}

#[test]
fn a_fixed_radius_is_the_radius_of_every_pixel() {
    let scene = ball(Material::default());
    let packed = Arc::new(PackedScene::new(&scene));
    let params = Params { n_paths: 500, radius: FirstRadius::Fixed(0.25), ..Params::new(4, 4) };
    let mut stages = CpuStages::new(packed.clone(), scene.cameras[0].pack(4, 4), [4, 4]);
    let radii = ppm::start(&mut stages, &params).expect("start");
    let frame = params.frame(1);
    assert_eq!(Iteration::new(&packed, &frame, &[], &radii.each, &[]).radii(), [0.25; 16]);
    assert_eq!(radii.gathers, [true; 16]);
}

#[test]
fn only_pixels_that_gather_have_a_radius_to_tell() {
    let mut scene = ball(Material::default());
    // Of the upper half the sky is seen, and nothing that reaches it.
    scene.cameras[0] = Camera::look_at("", Vec3::new(0.0, 0.5, 5.0), Vec3::new(0.0, 0.5, 0.0), Vec3::Y, 0.6);
    let packed = Arc::new(PackedScene::new(&scene));
    let params = Params { n_paths: 20_000, ..Params::new(SIZE, SIZE) };
    let mut stages = CpuStages::new(packed.clone(), scene.cameras[0].pack(SIZE, SIZE), params.film_size());
    let radii = ppm::start(&mut stages, &params).expect("start");
    let n = radii.gathers.iter().filter(|gathers| **gathers).count();
    assert!((200..700).contains(&n), "{n} pixels gather");
    stages.trace_eye(&params.frame(0)).expect("the pilot's paths");
    let vertices = stages.eye_vertices().expect("eye");
    assert!(vertices.iter().zip(&radii.gathers).all(|(v, &gathers)| gathers == (v.flags & EYE_GATHER != 0)));
    let fixed = Params { radius: FirstRadius::Fixed(0.25), ..params.clone() };
    let mut given = ppm::start(&mut stages, &fixed).expect("start");
    given.look_at(&vertices);
    assert!(given.gathers == radii.gathers && given.gathering().count() == n);
    // The others have one for paths that hit something later.
    assert!(radii.each.iter().all(|r| *r > 0.0 && r.is_finite()));
    let mut gathering: Vec<f32> = radii.gathering().collect();
    gathering.sort_unstable_by(f32::total_cmp);
    assert_eq!(gathering.len(), n);
    assert_eq!(radii.spread(), [gathering[0], gathering[n / 2], gathering[n - 1]]);
    // Without light there is nothing to go by.
    scene.lights.clear();
    let mut stages = CpuStages::new(Arc::new(PackedScene::new(&scene)), stages.camera(), params.film_size());
    let dark = ppm::start(&mut stages, &params).expect("start");
    let [smallest, _, largest] = dark.spread();
    assert!(dark.gathers == radii.gathers && smallest == largest && smallest > 0.0);
}
