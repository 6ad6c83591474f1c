// The isotropic GGX distribution, as in src/math/ggx.rs.
#import basis

const MIN_ALPHA: f32 = 1e-3;

fn ggx_distribution(cosine: f32, alpha: f32) -> f32 {
    let a2 = alpha * alpha;
    // Written so that it does not cancel near the pole.
    let d = (1.0 - cosine) * (1.0 + cosine) + a2 * cosine * cosine;
    return a2 / (PI * d * d);
}

fn ggx_slope(cosine: f32, alpha: f32) -> f32 {
    return sqrt(alpha * alpha + (1.0 - alpha * alpha) * cosine * cosine);
}

fn ggx_visibility(cos_o: f32, cos_i: f32, alpha: f32) -> f32 {
    return 0.5 / (cos_o * ggx_slope(cos_i, alpha) + cos_i * ggx_slope(cos_o, alpha));
}

fn ggx_sample_visible_normal(outgoing: vec3<f32>, alpha: f32, u: vec2<f32>) -> vec3<f32> {
    let stretched = normalize(vec3(alpha * outgoing.x, alpha * outgoing.y, outgoing.z));
    let z = (1.0 - u.y) * (1.0 + stretched.z) - stretched.z;
    let r = sqrt(max(1.0 - z * z, 0.0));
    let phi = TAU * u.x;
    let half_way = vec3(r * cos(phi), r * sin(phi), z) + stretched;
    return normalize_or(vec3(alpha * half_way.x, alpha * half_way.y, max(half_way.z, 0.0)), vec3(0.0, 0.0, 1.0));
}

fn ggx_visible_normal_pdf(cos_o: f32, cos_h: f32, o_dot_h: f32, alpha: f32) -> f32 {
    return 2.0 / (cos_o + ggx_slope(cos_o, alpha)) * ggx_distribution(cos_h, alpha) * max(o_dot_h, 0.0);
}
