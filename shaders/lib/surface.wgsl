// What a hit looks like once textures are read, as in src/cpu/surface.rs.
#import trace

struct Surface {
    position: vec3<f32>,
    normal: vec3<f32>,
    shading_normal: vec3<f32>,
    front: bool,
    material: u32,
    light: u32,
    base_color: vec3<f32>,
    roughness: f32,
    metallic: f32,
    transmission: f32,
    emission: vec3<f32>,
}

fn surface_at(hit: Hit, origin: vec3<f32>, direction: vec3<f32>) -> Surface {
    let p = primitives[hit.primitive];
    let m = material_at(p.material);
    let position = surface_point(p, hit, origin, direction);
    let outward = geometric_normal(p, position);
    let front = dot(outward, direction) <= 0.0;
    let at = attributes_at(p, hit.u, hit.v);

    var base_color = m.base_color * at.color.xyz;
    var roughness = m.roughness;
    var metallic = m.metallic;
    var transmission = m.transmission;
    var emission = select(vec3(0.0), m.emission, front || (m.flags & MATERIAL_DOUBLE_SIDED) != 0u);
    var bent = vec3(0.0, 0.0, 1.0);
    // One call, so that the code of a texture look-up is there once.
    for (var use_of = 0u; use_of < 5u; use_of++) {
        var slot = m.base_color_slot;
        switch use_of {
            case 1u: { slot = m.metallic_roughness_slot; }
            case 2u: { slot = m.transmission_slot; }
            case 3u: { slot = select(m.emission_slot, NONE, all(emission == vec3(0.0))); }
            case 4u: { slot = m.normal_slot; }
            default: {}
        }
        if slot == NONE {
            continue;
        }
        let texel = texture_sample(slot, at);
        switch use_of {
            case 0u: { base_color *= texel.xyz; }
            case 1u: {
                roughness *= texel.y;
                metallic *= texel.z;
            }
            case 2u: { transmission *= texel.x; }
            case 3u: { emission *= texel.xyz; }
            default: { bent = (texel.xyz * 2.0 - 1.0) * vec3(m.normal_scale, m.normal_scale, 1.0); }
        }
    }
    return Surface(
        position,
        select(-outward, outward, front),
        surface_shading_normal(p, m.normal_slot, bent, hit, outward, front, direction),
        front,
        p.material,
        p.light,
        base_color,
        roughness,
        metallic,
        transmission,
        emission,
    );
}

// From the corners where there are corners: nearer to the surface than origin + t·direction.
fn surface_point(p: Primitive, hit: Hit, origin: vec3<f32>, direction: vec3<f32>) -> vec3<f32> {
    if (p.flags & PRIMITIVE_SPHERE) != 0u {
        let along = origin + hit.t * direction;
        return p.a + normalize(along - p.a) * p.b.x;
    }
    return p.a * (1.0 - hit.u - hit.v) + p.b * hit.u + p.c * hit.v;
}

// Radiance that the front of a primitive emits at a point.
fn surface_emission(p: Primitive, at: Attributes) -> vec3<f32> {
    let m = material_at(p.material);
    if m.emission_slot == NONE || all(m.emission == vec3(0.0)) {
        return m.emission;
    }
    return m.emission * texture_sample(m.emission_slot, at).xyz;
}

// Whether a shading normal has a lobe to show.
fn surface_seen(n: vec3<f32>, direction: vec3<f32>, outward: vec3<f32>) -> bool {
    return dot(n, direction) < -1e-3 && dot(n, outward) > 0.0;
}

fn surface_shading_normal(
    p: Primitive,
    normal_slot: u32,
    bent: vec3<f32>,
    hit: Hit,
    outward: vec3<f32>,
    front: bool,
    direction: vec3<f32>,
) -> vec3<f32> {
    let side = select(-1.0, 1.0, front);
    if (p.flags & (PRIMITIVE_SPHERE | PRIMITIVE_FLAT)) != 0u {
        return side * outward;
    }
    let i = p.vertices;
    let w = 1.0 - hit.u - hit.v;
    let interpolated =
        normalize_or(vertices[i.x].normal * w + vertices[i.y].normal * hit.u + vertices[i.z].normal * hit.v, outward);
    var n = interpolated;
    if normal_slot != NONE {
        var along = vertices[i.x].tangent * w + vertices[i.y].tangent * hit.u + vertices[i.z].tangent * hit.v;
        along = normalize_or(along - interpolated * dot(interpolated, along), vec3(0.0));
        if all(along == vec3(0.0)) {
            n = normalize_or(basis_world(basis_around(interpolated), bent), interpolated);
        } else {
            let hand = select(1.0, -1.0, (p.flags & PRIMITIVE_MIRRORED_UV) != 0u);
            n = normalize_or(
                along * bent.x + cross(interpolated, along) * (hand * bent.y) + interpolated * bent.z,
                interpolated,
            );
        }
    }
    if surface_seen(side * n, direction, side * outward) {
        return side * n;
    }
    if surface_seen(side * interpolated, direction, side * outward) {
        return side * interpolated;
    }
    return side * outward;
}
