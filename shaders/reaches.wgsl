// How far the nearest photons are around each eye vertex, and how wide the pixel is there. The photons that are next to it in
// Morton order come first, so that the ball is small from the beginning.
#import frame
#import tree
#import rank

@group(0) @binding(0) var<storage, read> eye_vertices: array<EyeVertex>;
@group(0) @binding(1) var<storage, read> photons: array<Photon>;
@group(0) @binding(2) var<storage, read> tree: array<TreeNode>;
// All levels of the tree, the one around all photons last.
@group(0) @binding(3) var<storage, read> boxes: array<PointBox>;
@group(0) @binding(4) var<storage, read_write> reaches: array<Reach>;

const LARGEST: f32 = 3.4028234e38;
const SEEDS: u32 = 2u * REACHED;

struct Visitor {
    // Once the list is full, its last distance.
    radius2: f32,
    n: u32,
    // Slots that are known already: the first, and their number.
    seeds: vec2<u32>,
    // Squared, sorted.
    distances2: array<f32, REACHED>,
}

fn position_of(slot: u32) -> vec3<f32> {
    return photons[slot].position;
}

fn visit(visitor: ptr<function, Visitor>, slot: u32, delta: vec3<f32>, distance2: f32) {
    // A slot before the first wraps around.
    if slot - (*visitor).seeds.x < (*visitor).seeds.y {
        return;
    }
    var at = (*visitor).n;
    if at == REACHED {
        at = REACHED - 1u;
    } else {
        (*visitor).n = at + 1u;
    }
    while at > 0u && (*visitor).distances2[at - 1u] > distance2 {
        (*visitor).distances2[at] = (*visitor).distances2[at - 1u];
        at -= 1u;
    }
    (*visitor).distances2[at] = distance2;
    if (*visitor).n == REACHED {
        (*visitor).radius2 = (*visitor).distances2[REACHED - 1u];
    }
}

// As in src/ppm/radius.rs.
fn footprint(position: vec3<f32>) -> f32 {
    let pixel = 2.0 * camera.half_height / f32(frame.full_height);
    return select(pixel * distance(position, camera.position), pixel, camera.orthographic != 0u);
}

// Reads eye_vertices, photons, tree and boxes, writes reaches; one thread per pixel of the chunk.
// values: rows in the chunk, photons, levels of the tree, elements to skip.
@compute @workgroup_size(64)
fn find_reaches(
    @builtin(workgroup_id) workgroup: vec3<u32>,
    @builtin(num_workgroups) workgroups: vec3<u32>,
    @builtin(local_invocation_index) local: u32,
) {
    let xy = tile_pixel(workgroup, workgroups, local, frame.width);
    if xy.x >= frame.width || xy.y >= arguments.values.x {
        return;
    }
    let pixel = arguments.values.w + xy.y * frame.width + xy.x;
    let position = eye_vertices[pixel].position;
    let width = footprint(position);
    if (eye_vertices[pixel].flags & EYE_GATHER) == 0u {
        reaches[pixel] = Reach(-1.0, width);
        return;
    }
    let n_photons = arguments.values.y;
    let n_levels = arguments.values.z;
    if n_photons < REACHED || n_levels == 0u {
        reaches[pixel] = Reach(LARGEST, width);
        return;
    }
    var visitor: Visitor;
    visitor.radius2 = LARGEST;
    let n = min(SEEDS, n_photons);
    let rank = rank_of(position, n_photons, boxes[level_of(n_levels - 1u).x]);
    let first = first_around(rank, n, n_photons);
    for (var slot = first; slot < first + n; slot++) {
        let delta = position_of(slot) - position;
        let distance2 = delta.x * delta.x + delta.y * delta.y + delta.z * delta.z;
        if distance2 <= visitor.radius2 {
            visit(&visitor, slot, delta, distance2);
        }
    }
    visitor.seeds = vec2(first, n);
    walk(&visitor, position, n_photons, n_levels);
    reaches[pixel] = Reach(select(LARGEST, sqrt(visitor.radius2), visitor.n == REACHED), width);
}
