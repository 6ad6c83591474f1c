// The BSDF of a surface that was just met, and the media on its sides.
#import surface
#import bsdf

fn bsdf_new(s: Surface, known: vec3<f32>) -> Bsdf {
    let m = material_at(s.material);
    let volume = (m.flags & MATERIAL_VOLUME) != 0u;
    let b = Bsdf(
        basis_around(s.shading_normal),
        s.normal,
        s.base_color,
        m.f0,
        m.f90,
        s.roughness,
        s.roughness * s.roughness,
        s.metallic,
        s.transmission,
        select(m.ior, 1.0 / m.ior, volume && !s.front),
        volume,
        vec2(0.0),
    );
    return bsdf_with_known(b, known);
}

// What is left after `t` metres to the surface. A back face knows what is behind it better than the path does.
fn absorbed(s: Surface, medium: vec3<f32>, t: f32) -> vec3<f32> {
    let m = material_at(s.material);
    let sigma = select(medium, m.absorption, !s.front && (m.flags & MATERIAL_VOLUME) != 0u);
    return transmittance(sigma, t);
}

fn transmittance(sigma: vec3<f32>, t: f32) -> vec3<f32> {
    if all(sigma == vec3(0.0)) {
        return vec3(1.0);
    }
    return exp(-sigma * t);
}

// Absorption on the other side of a surface.
fn beyond(s: Surface) -> vec3<f32> {
    let m = material_at(s.material);
    return select(vec3(0.0), m.absorption, s.front && (m.flags & MATERIAL_VOLUME) != 0u);
}
