// Density estimate at each eye vertex: the photons within its radius, found in the implicit tree.
#import common
#import oct
#import bsdf

@group(0) @binding(0) var<storage, read> eye_vertices: array<EyeVertex>;
@group(0) @binding(1) var<storage, read> first_radii: array<f32>;
@group(0) @binding(2) var<storage, read> photons: array<Photon>;
@group(0) @binding(3) var<storage, read> boxes: array<PointBox>;
@group(0) @binding(4) var<storage, read_write> radiance: array<vec4<f32>>;

// As in src/cpu/gather.rs.
const MIN_NORMAL_COSINE: f32 = 0.9;
const MAX_PLANE_OFFSET: f32 = 0.1;

// (first box, number of boxes) of a level.
fn level_of(level: u32) -> vec2<u32> {
    let pair = arguments.levels[level / 2u];
    return select(pair.zw, pair.xy, (level & 1u) == 0u);
}

fn squared_distance_to_box(point: vec3<f32>, k: u32) -> f32 {
    let d = max(max(boxes[k].min - point, point - boxes[k].max), vec3(0.0));
    return d.x * d.x + d.y * d.y + d.z * d.z;
}

// Reads eye_vertices, first_radii, photons and boxes, writes radiance; one thread per pixel of the chunk.
// values: rows in the chunk, photons, levels of the tree.
@compute @workgroup_size(64)
fn gather(
    @builtin(workgroup_id) workgroup: vec3<u32>,
    @builtin(num_workgroups) workgroups: vec3<u32>,
    @builtin(local_invocation_index) local: u32,
) {
    let xy = tile_pixel(workgroup, workgroups, local, frame.width);
    if xy.x >= frame.width || xy.y >= arguments.values.x {
        return;
    }
    let pixel = xy.y * frame.width + xy.x;
    let n_photons = arguments.values.y;
    let n_levels = arguments.values.z;
    let vertex = eye_vertices[pixel];
    if (vertex.flags & EYE_GATHER) == 0u || n_photons == 0u || n_levels == 0u {
        radiance[pixel] = vec4(vertex.radiance, 0.0);
        return;
    }

    let position = vertex.position;
    let normal = oct_decode(vertex.normal);
    let shading_normal = oct_decode(vertex.shading_normal);
    let glossy = (vertex.flags & EYE_GLOSSY) != 0u;
    // Light is gathered on both sides where some of it comes through.
    let both_sides = glossy && vertex.transmission > 0.0;
    let bsdf = bsdf_of_vertex(vertex);
    let outgoing = oct_decode(vertex.outgoing);
    let eye_segments = (vertex.flags >> 8u) & 0xffu;
    let constant_kernel = (frame.flags & FRAME_CONSTANT_KERNEL) != 0u;
    let radius = first_radii[pixel] * frame.radius_scale;
    let radius2 = radius * radius;
    let inverse_radius2 = 1.0 / radius2;

    var diffuse_sum = vec3(0.0);
    var glossy_sum = vec3(0.0);
    let top = n_levels - 1u;
    var level = top;
    var k = 0u;
    var span = level_of(level);
    // Each step visits another box, and there are at most span.x + 1 of them.
    let bound = span.x + 1u;
    for (var step = 0u; step < bound; step++) {
        if squared_distance_to_box(position, span.x + k) <= radius2 {
            if level > 0u {
                level -= 1u;
                k *= FANOUT;
                span = level_of(level);
                continue;
            }
            let end = min((k + 1u) * LEAF_SIZE, n_photons);
            for (var i = k * LEAF_SIZE; i < end; i++) {
                let delta = photons[i].position - position;
                let d2 = delta.x * delta.x + delta.y * delta.y + delta.z * delta.z;
                if d2 > radius2 {
                    continue;
                }
                if abs(dot(delta, normal)) > MAX_PLANE_OFFSET * radius {
                    continue;
                }
                let packed = photons[i].normal_and_segments;
                let photon_normal = oct_decode24_unscaled(packed);
                let facing = dot(photon_normal, normal);
                if facing * facing < MIN_NORMAL_COSINE * MIN_NORMAL_COSINE * dot(photon_normal, photon_normal)
                    || (facing < 0.0 && !both_sides) {
                    continue;
                }
                if eye_segments + (packed >> 24u) > frame.max_segments {
                    continue;
                }
                let weight = select(2.0 * (1.0 - d2 * inverse_radius2), 1.0, constant_kernel);
                let power = weight * photons[i].power;
                let incoming = oct_decode_unscaled(photons[i].direction);
                if dot(incoming, shading_normal) > 0.0 {
                    diffuse_sum += power;
                }
                if glossy {
                    glossy_sum += power * bsdf_evaluate(bsdf, outgoing, normalize(incoming), LOBE_SPECULAR, RADIANCE);
                }
            }
        }
        // The next box in depth-first order: the sibling, or the parent's sibling after the last of eight.
        k += 1u;
        if k >= span.y {
            break;
        }
        let up = min(countTrailingZeros(k) / 3u, top - level);
        if up > 0u {
            level += up;
            k >>= 3u * up;
            span = level_of(level);
        }
    }
    let sum = vertex.diffuse * diffuse_sum + glossy_sum;
    let scale = inverse_radius2 / (PI * f32(frame.n_paths));
    radiance[pixel] = vec4(vertex.radiance + vertex.throughput * sum * scale, 0.0);
}
