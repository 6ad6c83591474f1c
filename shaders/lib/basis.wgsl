// Orthonormal bases, as in src/math/basis.rs, and small things all of the rest needs.
#import oct

const PI: f32 = 3.14159265;
const TAU: f32 = 6.2831853;
const FRAC_1_PI: f32 = 0.318309886;
// Stands for infinity, which WGSL has no word for.
const FAR: f32 = 3.0e38;

struct Basis {
    x: vec3<f32>,
    y: vec3<f32>,
    z: vec3<f32>,
}

fn basis_around(z: vec3<f32>) -> Basis {
    let sign = copysign(1.0, z.z);
    let a = -1.0 / (sign + z.z);
    let b = z.x * z.y * a;
    return Basis(
        vec3(1.0 + sign * z.x * z.x * a, sign * b, -sign * z.x),
        vec3(b, sign + z.y * z.y * a, -z.y),
        z,
    );
}

fn basis_local(basis: Basis, w: vec3<f32>) -> vec3<f32> {
    return vec3(dot(basis.x, w), dot(basis.y, w), dot(basis.z, w));
}

fn basis_world(basis: Basis, l: vec3<f32>) -> vec3<f32> {
    return basis.x * l.x + basis.y * l.y + basis.z * l.z;
}

fn normalize_or(v: vec3<f32>, fallback: vec3<f32>) -> vec3<f32> {
    let squared = dot(v, v);
    if squared > 1e-37 && squared < FAR {
        return v * (1.0 / sqrt(squared));
    }
    return fallback;
}

fn max_element(v: vec3<f32>) -> f32 {
    return max(v.x, max(v.y, v.z));
}

fn pow5(x: f32) -> f32 {
    let x2 = x * x;
    return x * (x2 * x2);
}
