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

// Writes eye_vertices; one thread per pixel of the chunk. values: rows in the chunk, first row, elements to skip.
@compute @workgroup_size(64)
fn trace_eye(
    @builtin(workgroup_id) workgroup: vec3<u32>,
    @builtin(num_workgroups) workgroups: vec3<u32>,
    @builtin(local_invocation_index) local: u32,
) {
    var xy = tile_pixel(workgroup, workgroups, local, frame.width);
    if xy.x >= frame.width || xy.y >= arguments.values.x {
        return;
    }
    let index = arguments.values.z + xy.y * frame.width + xy.x;
    xy.y += arguments.values.y;
    let pixel = (frame.crop_y + xy.y) * frame.full_width + frame.crop_x + xy.x;
    var rng = rng_new(STREAM_EYE, pixel, frame.iteration, frame.seed);
    let start = camera_ray(xy, rng_next4(&rng));
    let longest = min(frame.max_eye_segments, frame.max_segments);
    var vertex = EyeVertex();
    var radiance = vec3(0.0);
    var throughput = vec3(1.0);
    var medium = vec3(0.0);
    var pdf = 0.0;
    var segments = 0u;
    // The last ray only looks whether the direction sampled where photons are gathered leads straight to a light.
    var last = false;
    // Whether there is another ray after the one towards a light.
    var goes_on = true;
    // Rays towards lights take turns with those of the path, so that the code of the search is there once.
    var to_light = false;
    var pending = vec3(0.0);
    var light_ray: Ray;
    var ray = Ray(start.origin, start.direction, FAR, rng_alpha_seed(rng), SEER_EYE);
    for (var step = 0u; step < 2u * longest + 2u; step++) {
        if !to_light && !(goes_on && (segments < longest || last)) {
            break;
        }
        var traced = ray;
        if to_light {
            traced = light_ray;
        } else if !last {
            segments += 1u;
        }
        let hit = trace_walk(traced, to_light);
        if to_light {
            to_light = false;
            if hit.primitive == NONE {
                radiance += pending;
            }
            continue;
        }
        let direction = ray.direction;
        if hit.primitive == NONE {
            radiance += throughput * light_environment(direction) * balance(pdf, light_environment_pdf(direction));
            break;
        }
        let s = surface_at(hit, ray.origin, direction);
        throughput *= absorbed(s, medium, hit.t);
        if any(s.emission != vec3(0.0)) {
            radiance += throughput * s.emission * balance(pdf, light_area_pdf(s.light, hit.t, dot(s.normal, direction)));
        }
        if last {
            break;
        }
        let outgoing = -direction;
        let bsdf = bsdf_new(s, outgoing);
        let u = rng_next4(&rng);
        let follow = bsdf_follow_probability(bsdf);
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
            // Directions the BSDF samples are followed as well, and the two share the light between them.
            light_ray.alpha_seed = rng_alpha_seed(rng);
            let w = rng_next4(&rng);
            let incoming = light_sample(s.position, w.xyz);
            let f = bsdf_evaluate(bsdf, outgoing, incoming.direction, lobes, RADIANCE);
            if incoming.pdf > 0.0 && any(f * incoming.light != vec3(0.0)) {
                var share = 1.0;
                if !incoming.point_like && !bsdf_is_diffuse(bsdf) {
                    share = incoming.pdf / (incoming.pdf + bsdf_pdf(bsdf, outgoing, incoming.direction, lobes));
                }
                let cosine = abs(dot(bsdf.basis.z, incoming.direction));
                let arriving = f * incoming.light * (cosine * share / incoming.pdf);
                pending = throughput * (arriving * transmittance(medium, incoming.distance));
                light_ray.origin = trace_leave(s.position, s.normal, incoming.direction);
                light_ray.direction = incoming.direction;
                // A little short of the light itself.
                light_ray.t_max = incoming.distance * (1.0 - 1e-4);
                light_ray.seer = SEER_LIGHT;
                to_light = true;
            }
        }
        goes_on = !stop || (sample_lights && !bsdf_is_diffuse(bsdf) && tables.has_extended != 0u);
        if !goes_on {
            continue;
        }
        last = stop;
        ray.alpha_seed = rng_alpha_seed(rng);
        let v = rng_next4(&rng);
        let scatter = bsdf_sample(bsdf, outgoing, lobes, RADIANCE, v.xyz);
        goes_on = scatter.ok;
        throughput *= scatter.weight;
        pdf = scatter.pdf;
        if !last {
            if (frame.flags & FRAME_ROULETTE) != 0u && segments > ROULETTE_AFTER {
                let survive = min(max_element(throughput), 0.95);
                goes_on = goes_on && v.w < survive;
                throughput /= survive;
            }
            ray.alpha_seed = rng_alpha_seed(rng);
        }
        if scatter.transmitted {
            medium = beyond(s);
        }
        ray.direction = scatter.direction;
        ray.origin = trace_leave(s.position, s.normal, scatter.direction);
        ray.seer = select(SEER_EYE, SEER_LIGHT, last);
    }
    vertex.flags |= segments << 8u;
    vertex.radiance = radiance;
    eye_vertices[index] = vertex;
}

fn eye_fill(bsdf: Bsdf, s: Surface, outgoing: vec3<f32>) -> EyeVertex {
    let m = material_at(s.material);
    let glossy = (bsdf_gathered(bsdf) & LOBE_SPECULAR) != 0u;
    var vertex = EyeVertex();
    vertex.position = s.position;
    vertex.flags = EYE_GATHER | select(0u, EYE_GLOSSY, glossy);
    vertex.normal = oct_encode(s.normal);
    vertex.diffuse = bsdf_diffuse(bsdf, bsdf.known_albedo);
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
