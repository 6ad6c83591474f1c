//! What triangles of every file format go through: into the world, and the unusable ones out.

use super::{MAX_COORDINATE, Warnings};
use crate::scene::Mesh;
use glam::{DAffine3, DMat3, Vec2, Vec3, Vec4};

/// Transforms a mesh with all its attributes. A mirror image keeps its front the front.
pub(super) fn transform(mesh: &mut Mesh, world_from_mesh: &DAffine3) {
    if *world_from_mesh == DAffine3::IDENTITY {
        return;
    }
    let matrix = world_from_mesh.matrix3;
    let mirrored = matrix.determinant() < 0.0;
    let linear = matrix.as_mat3();
    let translation = world_from_mesh.translation.as_vec3();
    for position in &mut mesh.positions {
        *position = linear * *position + translation;
    }
    let normal_matrix = cofactors(matrix);
    for normal in &mut mesh.normals {
        *normal = (normal_matrix * normal.as_dvec3()).normalize_or_zero().as_vec3();
    }
    for tangent in &mut mesh.tangents {
        let sign = if mirrored { -tangent.w } else { tangent.w };
        *tangent = (matrix * tangent.truncate().as_dvec3()).normalize_or_zero().as_vec3().extend(sign);
    }
    if mirrored {
        for triangle in &mut mesh.triangles {
            triangle.swap(1, 2);
        }
    }
}

/// det·M⁻ᵀ with the sign of the determinant taken out: carries normals, also where M squashes one axis to nothing.
fn cofactors(m: DMat3) -> DMat3 {
    let sign = if m.determinant() < 0.0 { -1.0 } else { 1.0 };
    DMat3::from_cols(m.y_axis.cross(m.z_axis), m.z_axis.cross(m.x_axis), m.x_axis.cross(m.y_axis)) * sign
}

/// Checks positions, drops triangles without area, mends or drops attributes that are not numbers.
///
/// The indices must be in range and the attributes as long as the positions. The error is in words.
pub(super) fn clean(mesh: &mut Mesh, place: &str, warnings: &mut Warnings) -> Result<(), String> {
    let far = |p: &Vec3| p.abs().max_element() > MAX_COORDINATE;
    if let Some(i) = mesh.positions.iter().position(|p| !p.is_finite()) {
        return Err(format!("vertex {i} of mesh {:?} is not finite", mesh.name));
    }
    if let Some(i) = mesh.positions.iter().position(far) {
        return Err(format!("vertex {i} of mesh {:?} is more than {MAX_COORDINATE:e} m from the origin", mesh.name));
    }
    let n_before = mesh.triangles.len();
    let positions = &mesh.positions;
    mesh.triangles.retain(|&triangle| {
        let [a, b, c] = triangle.map(|i| positions[i as usize]);
        // Its root is divided by later: it must not have run into the smallest f32.
        (b - a).cross(c - a).length_squared() >= f32::MIN_POSITIVE
    });
    if mesh.triangles.len() < n_before {
        warnings.add_flat(n_before - mesh.triangles.len(), place);
    }
    mend_normals(mesh, place, warnings);
    let unit = |t: &Vec4| (t.truncate().length_squared() - 1.0).abs() < 0.1 && t.w != 0.0;
    if !mesh.tangents.iter().all(unit) {
        warnings.push(format!("{place}: tangents are not unit vectors and are derived instead"));
        mesh.tangents = Vec::new();
    }
    for tangent in &mut mesh.tangents {
        *tangent = tangent.truncate().normalize().extend(tangent.w.signum());
    }
    for uv in mesh.uv0.iter_mut().chain(&mut mesh.uv1).filter(|uv| !uv.is_finite()) {
        warnings.push(format!("{place}: texture coordinates that are not finite are taken as 0"));
        *uv = Vec2::ZERO;
    }
    for color in &mut mesh.colors {
        // `max` and `min` also turn NaN into a number.
        *color = color.max(Vec4::ZERO).min(Vec4::ONE);
    }
    Ok(())
}

/// Makes normals unit; a vertex without one gets that of the triangles around it.
fn mend_normals(mesh: &mut Mesh, place: &str, warnings: &mut Warnings) {
    let mut n_missing = 0;
    for normal in &mut mesh.normals {
        *normal = normal.try_normalize().unwrap_or(Vec3::ZERO);
        n_missing += usize::from(*normal == Vec3::ZERO);
    }
    if n_missing == 0 {
        return;
    }
    if n_missing == mesh.normals.len() {
        warnings.push(format!("{place}: no normal is valid; the mesh is faceted"));
        mesh.normals = Vec::new();
        return;
    }
    warnings.push(format!("{place}: {n_missing} normals are invalid and are derived from the triangles"));
    let mut derived = vec![Vec3::ZERO; mesh.positions.len()];
    for &triangle in &mesh.triangles {
        let [a, b, c] = triangle.map(|i| mesh.positions[i as usize]);
        let normal = (b - a).cross(c - a);
        for i in triangle {
            derived[i as usize] += normal;
        }
    }
    for (normal, derived) in mesh.normals.iter_mut().zip(derived) {
        if *normal == Vec3::ZERO {
            *normal = derived.try_normalize().unwrap_or(Vec3::Y);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec3;

    #[test]
    fn a_mirror_keeps_the_front_in_front() {
        let mut mesh = Mesh {
            positions: vec![Vec3::ZERO, Vec3::X, Vec3::Y],
            normals: vec![Vec3::Z; 3],
            tangents: vec![Vec4::new(1.0, 0.0, 0.0, 1.0); 3],
            triangles: vec![[0, 1, 2]],
            ..Mesh::default()
        };
        transform(&mut mesh, &DAffine3::from_scale(DVec3::new(-2.0, 1.0, 1.0)));
        let [a, b, c] = mesh.triangles[0].map(|i| mesh.positions[i as usize]);
        assert_eq!((b - a).cross(c - a).normalize(), Vec3::Z);
        assert_eq!(mesh.normals[0], Vec3::Z);
        assert_eq!(mesh.tangents[0], Vec4::new(-1.0, 0.0, 0.0, -1.0));
    }

    #[test]
    fn normals_survive_a_squashed_axis() {
        let mut mesh = Mesh { positions: vec![Vec3::ZERO], normals: vec![Vec3::new(0.6, 0.8, 0.0)], ..Mesh::default() };
        transform(&mut mesh, &DAffine3::from_scale(DVec3::new(2.0, 1.0, 1.0)));
        assert!(mesh.normals[0].abs_diff_eq(Vec3::new(0.3, 0.8, 0.0).normalize(), 1e-6));
        mesh.normals = vec![Vec3::new(0.6, 0.8, 0.0)];
        transform(&mut mesh, &DAffine3::from_scale(DVec3::new(1.0, 0.0, 1.0)));
        assert_eq!(mesh.normals[0], Vec3::Y);
    }
}
