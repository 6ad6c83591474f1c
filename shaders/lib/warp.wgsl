// From the unit square to where samples are wanted, as in src/math/warp.rs.
#import basis

fn warp_disc(u: vec2<f32>) -> vec2<f32> {
    let p = vec2(2.0 * u.x - 1.0, 2.0 * u.y - 1.0);
    if p.x == 0.0 && p.y == 0.0 {
        return p;
    }
    var r = p.y;
    var phi = PI / 2.0 - PI / 4.0 * (p.x / p.y);
    if abs(p.x) > abs(p.y) {
        r = p.x;
        phi = PI / 4.0 * (p.y / p.x);
    }
    return vec2(r * cos(phi), r * sin(phi));
}

fn warp_cosine(u: vec2<f32>) -> vec3<f32> {
    let p = warp_disc(u);
    return vec3(p, sqrt(max(1.0 - dot(p, p), 0.0)));
}

fn warp_cosine_pdf(cosine: f32) -> f32 {
    return max(cosine, 0.0) * FRAC_1_PI;
}

fn warp_sphere(u: vec2<f32>) -> vec3<f32> {
    let z = 1.0 - 2.0 * u.x;
    let r = sqrt(max(1.0 - z * z, 0.0));
    let phi = TAU * u.y;
    return vec3(r * cos(phi), r * sin(phi), z);
}

fn warp_cone(u: vec2<f32>, cos_max: f32) -> vec3<f32> {
    let z = 1.0 - u.x * (1.0 - cos_max);
    let r = sqrt(max(1.0 - z * z, 0.0));
    let phi = TAU * u.y;
    return vec3(r * cos(phi), r * sin(phi), z);
}

fn warp_triangle(u: vec2<f32>) -> vec2<f32> {
    let s = sqrt(u.x);
    return vec2(s * (1.0 - u.y), s * u.y);
}
