//! The shipped scenes are what they claim to be.

use std::collections::HashMap;

use glam::{DVec3, Vec3};

use super::shape::Shape;
use super::{NAMES, bathroom, glass, shipped};
use crate::scene::{Mesh, Scene};

/// Corners of all triangles, welded by position.
fn welded<'a>(shapes: impl IntoIterator<Item = (&'a [Vec3], &'a [[u32; 3]])>) -> Vec<[[u32; 3]; 3]> {
    let bits = |p: Vec3| (p + Vec3::ZERO).to_array().map(f32::to_bits);
    shapes.into_iter().flat_map(|(p, t)| t.iter().map(move |t| t.map(|i| bits(p[i as usize])))).collect()
}

/// Every edge is used once in each direction.
fn assert_closed(name: &str, triangles: &[[[u32; 3]; 3]]) {
    let mut edges = HashMap::new();
    for t in triangles {
        for k in 0..3 {
            *edges.entry((t[k], t[(k + 1) % 3])).or_insert(0) += 1;
        }
    }
    for (&(a, b), &n) in &edges {
        let place = a.map(f32::from_bits);
        assert_eq!(n, 1, "{name}: an edge at {place:?} is used {n} times in one direction");
        assert_eq!(edges.get(&(b, a)), Some(&1), "{name}: an edge at {place:?} has one side only");
    }
}

/// m³; positive where the triangles face outwards.
fn signed_volume(triangles: &[[[u32; 3]; 3]]) -> f64 {
    let corner = |c: [u32; 3]| DVec3::from_array(c.map(|v| f64::from(f32::from_bits(v))));
    triangles.iter().map(|t| corner(t[0]).dot(corner(t[1]).cross(corner(t[2])))).sum::<f64>() / 6.0
}

fn of(shape: &Shape) -> (&[Vec3], &[[u32; 3]]) {
    (&shape.positions, &shape.triangles)
}

fn of_mesh(mesh: &Mesh) -> (&[Vec3], &[[u32; 3]]) {
    (&mesh.positions, &mesh.triangles)
}

fn scenes() -> impl Iterator<Item = (&'static str, Scene)> {
    NAMES.iter().map(|name| (*name, shipped(name).expect("a shipped name")))
}

#[test]
fn names() {
    assert!(shipped("no such scene").is_none());
    assert_eq!(scenes().count(), 5);
}

#[test]
fn refracting_solids_are_closed_and_face_outwards() {
    for (name, scene) in scenes() {
        for mesh in &scene.meshes {
            let material = &scene.materials[mesh.material];
            // The water ends inside the walls; the goblet and its wine are looked at together below.
            let shared = ["goblet", "wine against glass", "wine against air", "water"];
            if material.volume && !shared.contains(&mesh.name.as_str()) {
                let triangles = welded([of_mesh(mesh)]);
                assert_closed(&format!("{name}, {}", mesh.name), &triangles);
                assert!(signed_volume(&triangles) > 0.0, "{name}, {}", mesh.name);
            }
        }
    }
}

#[test]
fn wine_and_goblet_share_their_interface() {
    let goblet = glass::Goblet::new();
    let wine = welded([of(&goblet.interface), of(&goblet.surface)]);
    assert_closed("wine", &wine);
    let volume = signed_volume(&wine);
    assert!((1.0e-4..4.0e-4).contains(&volume), "a glass of wine is one to four decilitres: {volume} m³");
    let inverted = goblet.interface.clone().inverted();
    let solid = welded([of(&goblet.glass), of(&inverted)]);
    assert_closed("goblet", &solid);
    assert!(signed_volume(&solid) > 0.0);
}

#[test]
fn shade_holds_air() {
    let shade = bathroom::shade();
    let triangles = welded([of(&shade)]);
    assert_closed("shade", &triangles);
    let volume = signed_volume(&triangles);
    assert!((1e-4..1e-3).contains(&volume), "{volume} m³ of glass");
}

#[test]
fn triangles_are_sound() {
    for (name, scene) in scenes() {
        assert!(!scene.cameras.is_empty());
        for mesh in &scene.meshes {
            let place = format!("{name}, {}", mesh.name);
            let n = mesh.positions.len();
            assert!(mesh.material < scene.materials.len(), "{place}");
            assert_eq!(mesh.normals.len(), n, "{place}");
            assert!(mesh.uv0.is_empty() || mesh.uv0.len() == n, "{place}");
            assert!(mesh.colors.is_empty() || mesh.colors.len() == n, "{place}");
            assert!(mesh.positions.iter().all(|p| p.is_finite()), "{place}");
            assert!(mesh.uv0.iter().all(|p| p.is_finite()), "{place}");
            assert!(mesh.normals.iter().all(|p| (p.length() - 1.0).abs() < 1e-4), "{place}");
            for t in &mesh.triangles {
                let [a, b, c] = t.map(|i| mesh.positions[i as usize]);
                let cross = (b - a).cross(c - a);
                let longest = (b - a).length().max((c - b).length()).max((a - c).length());
                // Higher than a five-thousandth of its longest side.
                assert!(cross.length() > 2e-4 * longest * longest, "{place}: {a} {b} {c}");
                let normals = t.map(|i| mesh.normals[i as usize]);
                for normal in normals {
                    assert!(normal.dot(cross) > 0.0, "{place}: a normal at {a} points through its triangle");
                }
            }
        }
    }
}

#[test]
fn sizes_are_as_stated() {
    let ranges = [60_000..140_000, 60_000..180_000, 200_000..300_000, 60_000..250_000, 60_000..250_000];
    for ((name, scene), range) in scenes().zip(ranges) {
        let n: usize = scene.meshes.iter().map(|m| m.triangles.len()).sum();
        println!("{name}: {n} triangles, {} meshes", scene.meshes.len());
        assert!(range.contains(&n), "{name}: {n} triangles");
    }
}

#[test]
fn fire_is_hundreds_of_lamps() {
    let scene = shipped("fireplace").expect("a shipped name");
    let n: usize = scene
        .meshes
        .iter()
        .filter(|m| scene.materials[m.material].emission != Vec3::ZERO)
        .map(|m| m.triangles.len() / 20)
        .sum();
    assert!(n > 400, "{n} emitters");
}

#[test]
fn reflectances_are_moderate() {
    for (name, scene) in scenes() {
        for mesh in &scene.meshes {
            let m = &scene.materials[mesh.material];
            if m.metallic > 0.0 || m.transmission > 0.0 {
                continue;
            }
            let brightest = m.base_color_texture.map_or(255, |texture| {
                let texels = &scene.images[texture.image].texels;
                texels.iter().flat_map(|t| [t[0], t[1], t[2]]).max().unwrap_or(255)
            });
            let texel = ((f32::from(brightest) / 255.0 + 0.055) / 1.055).powf(2.4);
            let tint = mesh.colors.iter().map(|c| c.truncate().max_element()).fold(0.0, f32::max);
            let tint = if mesh.colors.is_empty() { 1.0 } else { tint };
            let albedo = m.base_color.max_element() * texel * tint;
            assert!(albedo <= 0.86, "{name}, {}: {albedo}", mesh.name);
        }
    }
}

#[test]
fn made_alike_twice() {
    for (name, scene) in scenes() {
        let again = shipped(name).expect("a shipped name");
        for (a, b) in scene.meshes.iter().zip(&again.meshes) {
            assert!(a.positions == b.positions && a.normals == b.normals && a.triangles == b.triangles, "{}", a.name);
            assert!(a.uv0 == b.uv0 && a.colors == b.colors && a.material == b.material, "{}", a.name);
        }
        assert_eq!(scene.meshes.len(), again.meshes.len());
        assert_eq!(format!("{:?}", scene.materials), format!("{:?}", again.materials));
        assert_eq!(format!("{:?}", scene.cameras), format!("{:?}", again.cameras));
        assert!(scene.images.iter().zip(&again.images).all(|(a, b)| a.texels == b.texels));
    }
}
