// Photon paths, as in src/cpu/photons.rs: from the lamps, through everything, stored wherever an eye path could gather.
// A chunk of paths is traced in rounds. In one round a path stores at most SLOTS photons in slots of its own; whoever has
// more to store goes on in the next round. Nothing is appended by atomics, so the order does not depend on the device.
#import rng
#import bsdf_surface
#import light
#import photon_paths

struct PathState {
    origin: vec3<f32>,
    path: u32,
    direction: vec3<f32>,
    dimension: u32,
    power: vec3<f32>,
    segments: u32,
    medium: vec3<f32>,
    pad: u32,
}

// [slot][thread]
@group(0) @binding(0) var<storage, read_write> slots: array<Photon>;
@group(0) @binding(1) var<storage, read_write> counters: array<u32>;
// Where this round's paths are at its end, by thread; after CHUNK of them, where they were at its beginning.
@group(0) @binding(2) var<storage, read_write> states: array<PathState>;

// Flux crosses the real surface, but the BSDF weighs it by the shading normal's cosine (Veach 1997, §5.3).
fn photon_shading(s: Surface, incoming: vec3<f32>) -> f32 {
    if all(s.normal == s.shading_normal) {
        return 1.0;
    }
    return clamp(dot(s.shading_normal, incoming) / max(dot(s.normal, incoming), 1e-3), 0.0, 8.0);
}

// Follows one path until it ends or its slots are full; returns the number of photons stored, with ALIVE if it goes on.
fn photon_follow(thread: u32, state: ptr<function, PathState>) -> u32 {
    var rng = Rng((*state).path, (*state).dimension, frame.iteration, frame.seed);
    // The eye's side adds at least one segment.
    let longest = min(frame.max_photon_segments, max(frame.max_segments, 1u) - 1u);
    var stored = 0u;
    while (*state).segments < longest {
        if stored == SLOTS {
            (*state).dimension = rng.dimension;
            return stored | ALIVE;
        }
        let ray = Ray((*state).origin, (*state).direction, FAR, rng_alpha_seed(rng), SEER_LIGHT);
        (*state).segments += 1u;
        let hit = trace_walk(ray, false);
        if hit.primitive == NONE {
            return stored;
        }
        let s = surface_at(hit, ray.origin, ray.direction);
        let power = (*state).power * absorbed(s, (*state).medium, hit.t);
        let bsdf = bsdf_new(s);
        let incoming = -ray.direction;
        let is_direct = (*state).segments == 1u;
        if bsdf_gathered(bsdf) != 0u && !(is_direct && (frame.flags & FRAME_SAMPLE_DIRECT) != 0u) {
            slots[stored * CHUNK + thread] = Photon(
                s.position,
                oct_encode24(s.normal) | (min((*state).segments, 255u) << 24u),
                power * photon_shading(s, incoming),
                oct_encode(incoming),
            );
            stored += 1u;
        }
        let u = rng_next4(&rng);
        let scatter = bsdf_sample(bsdf, incoming, LOBES_ALL, IMPORTANCE, u.xyz);
        if !scatter.ok {
            return stored;
        }
        var next = power * scatter.weight;
        if (frame.flags & FRAME_ROULETTE) != 0u {
            // By the change in power: photons stay about as strong as they were emitted.
            let survive = min(max_element(next) / max(max_element(power), 1.1754944e-38), 1.0);
            if u.w >= survive {
                return stored;
            }
            next /= survive;
        }
        if max_element(next) <= 0.0 {
            return stored;
        }
        (*state).power = next;
        if scatter.transmitted {
            (*state).medium = beyond(s);
        }
        (*state).direction = scatter.direction;
        (*state).origin = trace_leave(s.position, s.normal, scatter.direction);
    }
    return stored;
}

var<workgroup> n_stored: atomic<u32>;
var<workgroup> n_alive: atomic<u32>;

// Reads states and counters, writes slots, counters and states; one thread per path of the chunk.
// values: paths in the chunk, first path, round.
@compute @workgroup_size(64)
fn trace_photons(@builtin(workgroup_id) workgroup: vec3<u32>, @builtin(local_invocation_index) local: u32) {
    let thread = workgroup.x * 64u + local;
    let round = arguments.values.z;
    if local == 0u {
        atomicStore(&n_stored, 0u);
        atomicStore(&n_alive, 0u);
    }
    workgroupBarrier();
    var state = PathState();
    var goes_on = false;
    if round == 0u {
        if thread < arguments.values.x {
            var rng = rng_new(STREAM_PHOTON, arguments.values.y + thread, frame.iteration, frame.seed);
            let u = rng_next4(&rng);
            let v = rng_next4(&rng);
            let emission = light_emit(u.xyz, v.xyz);
            goes_on = emission.ok;
            state.origin = emission.origin;
            state.path = rng.path;
            state.direction = emission.direction;
            state.dimension = rng.dimension;
            state.power = emission.power;
        }
    } else if thread < counters[COUNT_ALIVE] {
        state = states[CHUNK + thread];
        goes_on = true;
    }
    var result = 0u;
    if goes_on {
        result = photon_follow(thread, &state);
    }
    counters[COUNTS + thread] = result;
    if (result & ALIVE) != 0u {
        states[thread] = state;
        atomicAdd(&n_alive, 1u);
    }
    atomicAdd(&n_stored, result & ~ALIVE);
    workgroupBarrier();
    if local == 0u {
        counters[BLOCKS + 2u * workgroup.x] = atomicLoad(&n_stored);
        counters[BLOCKS + 2u * workgroup.x + 1u] = atomicLoad(&n_alive);
    }
}
