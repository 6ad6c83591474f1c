// Density estimate at each eye vertex: the photons within its radius, found in the implicit tree.
#import frame
#import tree
#import oct
#import bsdf

@group(0) @binding(0) var<storage, read> eye_vertices: array<EyeVertex>;
@group(0) @binding(1) var<storage, read> first_radii: array<f32>;
@group(0) @binding(2) var<storage, read> photons: array<Photon>;
@group(0) @binding(3) var<storage, read> tree: array<TreeNode>;
@group(0) @binding(4) var<storage, read_write> radiance: array<vec4<f32>>;

// As in src/cpu/gather.rs.
const MIN_NORMAL_COSINE: f32 = 0.9;
const MAX_PLANE_OFFSET: f32 = 0.1;

struct Visitor {
    radius2: f32,
    radius: f32,
    inverse_radius2: f32,
    normal: vec3<f32>,
    shading_normal: vec3<f32>,
    outgoing: vec3<f32>,
    segments: u32,
    glossy: bool,
    // Light is gathered on both sides where some of it comes through.
    both_sides: bool,
    bsdf: Bsdf,
    diffuse_sum: vec3<f32>,
    glossy_sum: vec3<f32>,
}

fn position_of(slot: u32) -> vec3<f32> {
    return photons[slot].position;
}

fn visit(visitor: ptr<function, Visitor>, slot: u32, delta: vec3<f32>, distance2: f32) {
    if abs(dot(delta, (*visitor).normal)) > MAX_PLANE_OFFSET * (*visitor).radius {
        return;
    }
    let packed = photons[slot].normal_and_segments;
    let photon_normal = oct_decode24_unscaled(packed);
    let facing = dot(photon_normal, (*visitor).normal);
    if facing * facing < MIN_NORMAL_COSINE * MIN_NORMAL_COSINE * dot(photon_normal, photon_normal)
        || (facing < 0.0 && !(*visitor).both_sides) {
        return;
    }
    if (*visitor).segments + ((packed >> 24u) & MAX_PHOTON_SEGMENTS) > frame.max_segments {
        return;
    }
    let constant_kernel = (frame.flags & FRAME_CONSTANT_KERNEL) != 0u;
    let weight = select(2.0 * (1.0 - distance2 * (*visitor).inverse_radius2), 1.0, constant_kernel);
    let power = weight * photons[slot].power;
    let incoming = oct_decode_unscaled(photons[slot].direction);
    if dot(incoming, (*visitor).shading_normal) > 0.0 {
        (*visitor).diffuse_sum += power;
    }
    if (*visitor).glossy {
        let direction = normalize(incoming);
        (*visitor).glossy_sum +=
            power * bsdf_evaluate((*visitor).bsdf, (*visitor).outgoing, direction, LOBE_SPECULAR, RADIANCE);
    }
}

// Reads eye_vertices, first_radii, photons and tree, writes radiance; one thread per pixel of the chunk.
// values: rows in the chunk, photons, levels of the tree, elements to skip.
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
    let pixel = arguments.values.w + xy.y * frame.width + xy.x;
    let vertex = eye_vertices[pixel];
    if (vertex.flags & EYE_GATHER) == 0u {
        radiance[pixel] = vec4(vertex.radiance, 0.0);
        return;
    }

    let radius = first_radii[pixel] * frame.radius_scale;
    var visitor: Visitor;
    visitor.radius = radius;
    visitor.radius2 = radius * radius;
    visitor.inverse_radius2 = 1.0 / visitor.radius2;
    visitor.normal = oct_decode(vertex.normal);
    visitor.shading_normal = oct_decode(vertex.shading_normal);
    visitor.outgoing = oct_decode(vertex.outgoing);
    visitor.segments = (vertex.flags >> 8u) & 0xffu;
    visitor.glossy = (vertex.flags & EYE_GLOSSY) != 0u;
    visitor.both_sides = visitor.glossy && vertex.transmission > 0.0;
    visitor.bsdf = bsdf_of_vertex(vertex);
    walk(&visitor, vertex.position, arguments.values.y, arguments.values.z);
    let sum = vertex.diffuse * visitor.diffuse_sum + visitor.glossy_sum;
    let scale = visitor.inverse_radius2 / (PI * f32(frame.n_paths));
    radiance[pixel] = vec4(vertex.radiance + vertex.throughput * sum * scale, 0.0);
}
