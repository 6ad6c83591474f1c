// Eye paths, as in src/cpu/eye.rs: from the lens through mirrors and glass to the first surface rough enough to gather
// photons at.
#import rng
#import camera
#import bsdf_surface
#import light

@group(0) @binding(0) var<storage, read_write> eye_vertices: array<EyeVertex>;

const ROULETTE_AFTER: u32 = 4u;

// Weight of a direction that the BSDF chose with density `pdf`, where lights are sampled too; 1 where they were not.
fn balance(pdf: f32, light_pdf: f32) -> f32 {
    return select(1.0, pdf / (pdf + light_pdf), pdf > 0.0);
}

// Writes eye_vertices; one thread per pixel of the chunk. values: pixels in the chunk, first pixel.
@compute @workgroup_size(64)
fn trace_eye(
    @builtin(workgroup_id) workgroup: vec3<u32>,
    @builtin(num_workgroups) workgroups: vec3<u32>,
    @builtin(local_invocation_index) local: u32,
) {
    let index = thread_index(workgroup, workgroups, local, 64u);
    if index >= arguments.values.x {
        return;
    }
    let i = arguments.values.y + index;
    let xy = vec2(i % frame.width, i / frame.width);
    let pixel = (frame.crop_y + xy.y) * frame.full_width + frame.crop_x + xy.x;
    var rng = rng_new(STREAM_EYE, pixel, frame.iteration, frame.seed);
    let start = camera_ray(xy, rng_next4(&rng));
    var origin = start.origin;
    var direction = start.direction;
    let longest = min(frame.max_eye_segments, frame.max_segments);
    var vertex = EyeVertex();
    var radiance = vec3(0.0);
    var throughput = vec3(1.0);
    var medium = vec3(0.0);
    var pdf = 0.0;
    var segments = 0u;
    // The last ray only looks whether the direction sampled where photons are gathered leads straight to a light.
    var last = false;
    var alpha_seed = rng_alpha_seed(rng);
    while segments < longest || last {
        let ray = Ray(origin, direction, FAR, alpha_seed, select(SEER_EYE, SEER_LIGHT, last));
        if !last {
            segments += 1u;
        }
        let hit = trace_walk(ray, false);
        if hit.primitive == NONE {
            radiance += throughput * light_environment(direction) * balance(pdf, light_environment_pdf(direction));
            break;
        }
        let s = surface_at(hit, origin, direction);
        throughput *= absorbed(s, medium, hit.t);
        if any(s.emission != vec3(0.0)) {
            radiance += throughput * s.emission * balance(pdf, light_area_pdf(s.light, hit.t, dot(s.normal, direction)));
        }
        if last {
            break;
        }
        let bsdf = bsdf_new(s);
        let outgoing = -direction;
        let u = rng_next4(&rng);
        let follow = bsdf_follow_probability(bsdf, outgoing);
        let stop = u.x >= follow;
        throughput /= select(follow, 1.0 - follow, stop);
        var lobes = bsdf_traced(bsdf);
        var sample_lights = !bsdf_is_smooth(bsdf) && segments < longest;
        if stop {
            lobes = bsdf_gathered(bsdf);
            sample_lights = (frame.flags & FRAME_SAMPLE_DIRECT) != 0u && segments < frame.max_segments;
            vertex = eye_fill(bsdf, s, outgoing);
            vertex.throughput = throughput;
        }
        if sample_lights {
            radiance += throughput * eye_direct(bsdf, s, outgoing, medium, lobes, &rng);
        }
        if stop && !(sample_lights && !bsdf_is_diffuse(bsdf) && tables.has_extended != 0u) {
            break;
        }
        last = stop;
        alpha_seed = rng_alpha_seed(rng);
        let v = rng_next4(&rng);
        let scatter = bsdf_sample(bsdf, outgoing, lobes, RADIANCE, v.xyz);
        if !scatter.ok {
            break;
        }
        throughput *= scatter.weight;
        pdf = scatter.pdf;
        if !last {
            if (frame.flags & FRAME_ROULETTE) != 0u && segments > ROULETTE_AFTER {
                let survive = min(max_element(throughput), 0.95);
                if v.w >= survive {
                    break;
                }
                throughput /= survive;
            }
            alpha_seed = rng_alpha_seed(rng);
        }
        if scatter.transmitted {
            medium = beyond(s);
        }
        direction = scatter.direction;
        origin = trace_leave(s.position, s.normal, direction);
    }
    vertex.flags |= segments << 8u;
    vertex.radiance = radiance;
    eye_vertices[index] = vertex;
}

// Light sampled towards the surface. Directions the BSDF samples are followed as well, and the two share the light
// between them.
fn eye_direct(
    bsdf: Bsdf,
    s: Surface,
    outgoing: vec3<f32>,
    medium: vec3<f32>,
    lobes: u32,
    rng: ptr<function, Rng>,
) -> vec3<f32> {
    let alpha_seed = rng_alpha_seed(*rng);
    let u = rng_next4(rng);
    let incoming = light_sample(s.position, u.xyz);
    if incoming.pdf <= 0.0 {
        return vec3(0.0);
    }
    let f = bsdf_evaluate(bsdf, outgoing, incoming.direction, lobes, RADIANCE);
    if all(f == vec3(0.0)) || all(incoming.light == vec3(0.0)) {
        return vec3(0.0);
    }
    let cosine = abs(dot(bsdf.frame.z, incoming.direction));
    var share = 1.0;
    if !incoming.point_like && !bsdf_is_diffuse(bsdf) {
        share = incoming.pdf / (incoming.pdf + bsdf_pdf(bsdf, outgoing, incoming.direction, lobes));
    }
    let origin = trace_leave(s.position, s.normal, incoming.direction);
    // A little short of the light itself.
    let ray = Ray(origin, incoming.direction, incoming.distance * (1.0 - 1e-4), alpha_seed, SEER_LIGHT);
    if trace_walk(ray, true).primitive != NONE {
        return vec3(0.0);
    }
    return f * incoming.light * (cosine * share / incoming.pdf) * transmittance(medium, incoming.distance);
}

fn eye_fill(bsdf: Bsdf, s: Surface, outgoing: vec3<f32>) -> EyeVertex {
    let m = material_at(s.material);
    let glossy = (bsdf_gathered(bsdf) & LOBE_SPECULAR) != 0u;
    var vertex = EyeVertex();
    vertex.position = s.position;
    vertex.flags = EYE_GATHER | select(0u, EYE_GLOSSY, glossy);
    vertex.normal = oct_encode(s.normal);
    vertex.diffuse = bsdf_diffuse(bsdf, dot(bsdf.frame.z, outgoing));
    vertex.shading_normal = oct_encode(s.shading_normal);
    vertex.base_color = s.base_color;
    vertex.outgoing = oct_encode(outgoing);
    vertex.roughness = s.roughness;
    vertex.f0 = m.f0;
    vertex.metallic = s.metallic;
    vertex.transmission = s.transmission;
    vertex.eta = bsdf.eta;
    vertex.f90 = m.f90;
    vertex.material_flags = m.flags;
    return vertex;
}
