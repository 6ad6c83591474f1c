//! Whether a scene can be rendered.

use super::{AlphaMode, Camera, Environment, Image, Material, Mesh, Projection, PunctualKind, PunctualLight, Scene};
use super::{Sphere, Texture};
use glam::{Mat3, Vec3};
use std::f32::consts::{FRAC_PI_2, PI};

/// What is wrong with a scene.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("{place}: {problem}")]
pub struct SceneError {
    /// Which object and field, `mesh "floor": normals`.
    pub place: String,
    /// In words.
    pub problem: String,
}

/// What is wrong, without saying where yet.
type Problem = Result<(), (&'static str, String)>;

impl Scene {
    /// Says whether backends may rely on it: indices in range, attributes of one length, finite numbers within their
    /// ranges, and something to see. It may lack a camera and a light.
    pub fn check(&self) -> Result<(), SceneError> {
        let n_materials = self.materials.len();
        let n_images = self.images.len();
        for (i, mesh) in self.meshes.iter().enumerate() {
            each("mesh", &mesh.name, i, check_mesh(mesh, n_materials))?;
        }
        for (i, sphere) in self.spheres.iter().enumerate() {
            each("sphere", "", i, check_sphere(sphere, n_materials))?;
        }
        for (i, material) in self.materials.iter().enumerate() {
            each("material", &material.name, i, check_material(material, n_images))?;
        }
        for (i, image) in self.images.iter().enumerate() {
            each("image", &image.name, i, check_image(image))?;
        }
        for (i, light) in self.lights.iter().enumerate() {
            each("light", "", i, check_light(light))?;
        }
        for (i, camera) in self.cameras.iter().enumerate() {
            each("camera", &camera.name, i, check_camera(camera))?;
        }
        if let Some(environment) = &self.environment {
            each("environment", "", 0, check_environment(environment))?;
        }
        let n_vertices: usize = self.meshes.iter().map(|mesh| mesh.positions.len()).sum();
        let n_primitives = self.spheres.len() + self.meshes.iter().map(|mesh| mesh.triangles.len()).sum::<usize>();
        let problem = if n_primitives == 0 {
            "there is no triangle and no sphere".into()
        } else if n_vertices > u32::MAX as usize || n_primitives > i32::MAX as usize {
            format!("{n_vertices} vertices and {n_primitives} primitives are too many")
        } else {
            return Ok(());
        };
        Err(SceneError { place: "scene".into(), problem })
    }
}

impl Camera {
    /// The same for a camera by itself.
    pub fn check(&self) -> Result<(), SceneError> {
        each("camera", &self.name, 0, check_camera(self))
    }
}

/// Says where a problem is.
fn each(kind: &str, name: &str, i: usize, problem: Problem) -> Result<(), SceneError> {
    problem.map_err(|(field, problem)| {
        let object = if name.is_empty() { format!("{kind} {i}") } else { format!("{kind} {name:?}") };
        let place = if field.is_empty() { object } else { format!("{object}: {field}") };
        SceneError { place, problem }
    })
}

fn require(condition: bool, field: &'static str, problem: impl FnOnce() -> String) -> Problem {
    if condition { Ok(()) } else { Err((field, problem())) }
}

fn check_mesh(mesh: &Mesh, n_materials: usize) -> Problem {
    let n = mesh.positions.len();
    require(mesh.material < n_materials, "material", || format!("{} of {n_materials}", mesh.material))?;
    let lengths = [
        ("normals", mesh.normals.len()),
        ("tangents", mesh.tangents.len()),
        ("uv0", mesh.uv0.len()),
        ("uv1", mesh.uv1.len()),
        ("colors", mesh.colors.len()),
    ];
    for (field, length) in lengths {
        require(length == 0 || length == n, field, || format!("{length} for {n} vertices"))?;
    }
    for (i, triangle) in mesh.triangles.iter().enumerate() {
        require(triangle.iter().all(|&corner| (corner as usize) < n), "triangles", || {
            format!("triangle {i} is {triangle:?}, but there are {n} vertices")
        })?;
    }
    let finite = |field, bad: Option<usize>| match bad {
        Some(i) => Err((field, format!("vertex {i} is not finite"))),
        None => Ok(()),
    };
    finite("positions", mesh.positions.iter().position(|v| !v.is_finite()))?;
    finite("normals", mesh.normals.iter().position(|v| !v.is_finite()))?;
    finite("tangents", mesh.tangents.iter().position(|v| !v.is_finite()))?;
    finite("uv0", mesh.uv0.iter().position(|v| !v.is_finite()))?;
    finite("uv1", mesh.uv1.iter().position(|v| !v.is_finite()))?;
    finite("colors", mesh.colors.iter().position(|v| !(v.is_finite() && v.min_element() >= 0.0)))
}

fn check_sphere(sphere: &Sphere, n_materials: usize) -> Problem {
    require(sphere.material < n_materials, "material", || format!("{} of {n_materials}", sphere.material))?;
    require(sphere.centre.is_finite(), "centre", || format!("{} is not finite", sphere.centre))?;
    require(sphere.radius > 0.0 && sphere.radius.is_finite(), "radius", || {
        format!("{} is not a positive number", sphere.radius)
    })
}

fn check_material(material: &Material, n_images: usize) -> Problem {
    let m = material;
    let cutoff = match m.alpha {
        AlphaMode::Mask(cutoff) => cutoff,
        AlphaMode::Opaque | AlphaMode::Blend => 0.0,
    };
    let in_unit = |x: f32| (0.0..=1.0).contains(&x);
    let units = [
        ("base_color", m.base_color.x),
        ("base_color", m.base_color.y),
        ("base_color", m.base_color.z),
        ("opacity", m.opacity),
        ("metallic", m.metallic),
        ("roughness", m.roughness),
        ("transmission", m.transmission),
        ("specular", m.specular),
    ];
    for (field, value) in units {
        require(in_unit(value), field, || format!("{value} is not between 0 and 1"))?;
    }
    for (field, value) in [("emission", m.emission), ("specular_color", m.specular_color), ("absorption", m.absorption)]
    {
        require(not_negative(value), field, || format!("{value} is not finite and ≥ 0"))?;
    }
    require(cutoff.is_finite() && cutoff >= 0.0, "alpha", || format!("{cutoff} is not a cut-off"))?;
    require(m.ior > 0.0 && m.ior.is_finite(), "ior", || format!("{} is not a positive number", m.ior))?;
    require(m.normal_scale.is_finite(), "normal_scale", || format!("{} is not finite", m.normal_scale))?;
    check_texture("base_color_texture", &m.base_color_texture, n_images)?;
    check_texture("metallic_roughness_texture", &m.metallic_roughness_texture, n_images)?;
    check_texture("normal_texture", &m.normal_texture, n_images)?;
    check_texture("emission_texture", &m.emission_texture, n_images)?;
    check_texture("transmission_texture", &m.transmission_texture, n_images)
}

fn check_texture(field: &'static str, texture: &Option<Texture>, n_images: usize) -> Problem {
    let Some(texture) = texture else { return Ok(()) };
    require(texture.image < n_images, field, || format!("image {} of {n_images}", texture.image))?;
    require(texture.uv_set <= 1, field, || format!("texture coordinates {} of 2", texture.uv_set))?;
    require(texture.transform.is_finite() && texture.offset.is_finite(), field, || "the transform is not finite".into())
}

fn check_image(image: &Image) -> Problem {
    let (w, h) = (image.width, image.height);
    let fits = |side: u32| (1..=u32::from(u16::MAX)).contains(&side);
    require(fits(w) && fits(h), "", || format!("{w} × {h} is not within 65535 × 65535"))?;
    let n = image.texels.len();
    require(n == w as usize * h as usize, "texels", || format!("{n} for {w} × {h}"))
}

fn check_light(light: &PunctualLight) -> Problem {
    require(not_negative(light.intensity), "intensity", || format!("{} is not finite and ≥ 0", light.intensity))?;
    if light.kind != PunctualKind::Directional {
        require(light.position.is_finite(), "position", || format!("{} is not finite", light.position))?;
    }
    if light.kind != PunctualKind::Point {
        require((light.direction.length() - 1.0).abs() < 1e-3, "direction", || {
            format!("{} is not of unit length", light.direction)
        })?;
    }
    match light.kind {
        PunctualKind::Spot { inner, outer } => {
            require(0.0 <= inner && inner < outer && outer <= FRAC_PI_2 + 1e-6, "angles", || {
                format!("{inner} and {outer} are not 0 ≤ inner < outer ≤ π/2")
            })
        }
        PunctualKind::Point | PunctualKind::Directional => Ok(()),
    }
}

fn check_camera(camera: &Camera) -> Problem {
    let m = Mat3::from(camera.world_from_camera.matrix3);
    let rigid = (m.transpose() * m).abs_diff_eq(Mat3::IDENTITY, 1e-3) && m.determinant() > 0.0;
    require(rigid && camera.world_from_camera.is_finite(), "world_from_camera", || "is not rigid".into())?;
    match camera.projection {
        Projection::Perspective { yfov } => require(yfov > 0.0 && yfov < PI, "projection", || {
            format!("a field of view of {yfov} is not between 0 and π")
        })?,
        Projection::Orthographic { ymag } => require(ymag > 0.0 && ymag.is_finite(), "projection", || {
            format!("a half-height of {ymag} is not positive")
        })?,
    }
    let (radius, focus) = (camera.aperture_radius, camera.focus_distance);
    require(radius >= 0.0 && radius.is_finite(), "aperture_radius", || format!("{radius} is not finite and ≥ 0"))?;
    require(focus > 0.0 && focus.is_finite(), "focus_distance", || format!("{focus} is not positive"))?;
    let aspect = camera.aspect.unwrap_or(1.0);
    require(aspect > 0.0 && aspect.is_finite(), "aspect", || format!("{aspect} is not positive"))
}

fn check_environment(environment: &Environment) -> Problem {
    let (w, h, n) = (environment.width as usize, environment.height as usize, environment.texels.len());
    require(n > 0 && w.checked_mul(h) == Some(n), "texels", || format!("{n} for {w} × {h}"))?;
    let bad = environment.texels.iter().position(|&texel| !not_negative(texel));
    require(bad.is_none(), "texels", || format!("texel {} is not finite and ≥ 0", bad.unwrap_or(0)))?;
    require(environment.rotation.is_finite(), "rotation", || format!("{} is not finite", environment.rotation))?;
    let strength = environment.strength;
    require(strength.is_finite() && strength >= 0.0, "strength", || format!("{strength} is not finite and ≥ 0"))?;
    require(not_negative(environment.tint), "tint", || format!("{} is not finite and ≥ 0", environment.tint))
}

fn not_negative(v: Vec3) -> bool {
    v.is_finite() && v.min_element() >= 0.0
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::Arc;

    fn triangle() -> Scene {
        let mesh = Mesh {
            name: "floor".into(),
            positions: vec![Vec3::ZERO, Vec3::X, Vec3::Z],
            triangles: vec![[0, 1, 2]],
            ..Mesh::default()
        };
        Scene { meshes: vec![mesh.into()], materials: vec![Material::default()], ..Scene::default() }
    }

    #[test]
    fn names_object_and_field() {
        assert_eq!(triangle().check(), Ok(()));
        let mut scene = triangle();
        Arc::make_mut(&mut scene.meshes[0]).triangles[0][1] = 3;
        let message = scene.check().unwrap_err().to_string();
        assert_eq!(message, r#"mesh "floor": triangles: triangle 0 is [0, 3, 2], but there are 3 vertices"#);
        let mut scene = triangle();
        Arc::make_mut(&mut scene.meshes[0]).uv0 = vec![glam::Vec2::ZERO];
        assert_eq!(scene.check().unwrap_err().place, r#"mesh "floor": uv0"#);
        let mut scene = triangle();
        scene.materials[0].roughness = f32::NAN;
        assert_eq!(scene.check().unwrap_err().place, "material 0: roughness");
        let mut scene = triangle();
        scene.spheres.push(Sphere { centre: Vec3::ZERO, radius: 0.0, inward: false, material: 0 });
        assert_eq!(scene.check().unwrap_err().place, "sphere 0: radius");
        assert_eq!(Scene::default().check().unwrap_err().place, "scene");
    }
}
