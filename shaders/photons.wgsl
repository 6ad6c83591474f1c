// Photon paths, as in src/cpu/photons.rs: from the lamps, through everything, stored wherever an eye path could gather.
// A thread follows several paths, one after the other, so that it is not idle when its neighbours' paths are longer.
// A chunk of paths is traced in rounds. In one round a thread stores at most SLOTS photons in slots of its own; whoever
// has more to store goes on in the next round. Nothing is appended by atomics, so the order does not depend on the device.
#import rng
#import bsdf_surface
#import photon_paths

// [slot][thread]
@group(0) @binding(0) var<storage, read_write> slots: array<Photon>;
@group(0) @binding(1) var<storage, read_write> counters: array<u32>;
@group(0) @binding(2) var<storage, read_write> states: array<PathState>;

// Flux crosses the real surface, but the BSDF weighs it by the shading normal's cosine (Veach 1997, §5.3).
fn photon_shading(s: Surface, incoming: vec3<f32>) -> f32 {
    if all(s.normal == s.shading_normal) {
        return 1.0;
    }
    return clamp(dot(s.shading_normal, incoming) / max(dot(s.normal, incoming), 1e-3), 0.0, 8.0);
}

// Begins the thread's next path.
fn photon_begin(state: PathState) -> PathState {
    let path = state.path + 1u;
    var fresh = states[FRESH + path - arguments.values.y];
    fresh.left |= state.left - 1u;
    return fresh;
}

// Follows the present path by one segment; returns whether it stored a photon.
fn photon_step(state: ptr<function, PathState>, slot: u32) -> bool {
    var rng = Rng((*state).path, (*state).dimension, frame.iteration, frame.seed);
    let ray = Ray((*state).origin, (*state).direction, FAR, rng_alpha_seed(rng), SEER_LIGHT);
    // Until it is known to go on.
    (*state).left &= ~ACTIVE;
    (*state).segments += 1u;
    let hit = trace_walk(ray, false);
    if hit.primitive == NONE {
        return false;
    }
    let s = surface_at(hit, ray.origin, ray.direction);
    let power = (*state).power * absorbed(s, (*state).medium, hit.t);
    let incoming = -ray.direction;
    let bsdf = bsdf_new(s, incoming);
    let is_direct = ((*state).segments & MAX_PHOTON_SEGMENTS) == 1u;
    let store = bsdf_gathered(bsdf) != 0u && !(is_direct && (frame.flags & FRAME_SAMPLE_DIRECT) != 0u);
    if store {
        slots[slot] = Photon(
            s.position,
            oct_encode24(s.normal) | ((*state).segments << 24u),
            power * photon_shading(s, incoming),
            oct_encode(incoming),
        );
    }
    let u = rng_next4(&rng);
    let scatter = bsdf_sample(bsdf, incoming, LOBES_ALL, IMPORTANCE, u.xyz);
    if !scatter.ok {
        return store;
    }
    var next = power * scatter.weight;
    if (frame.flags & FRAME_ROULETTE) != 0u {
        // By the change in power: photons stay about as strong as they were emitted.
        let survive = min(max_element(next) / max(max_element(power), 1.1754944e-38), 1.0);
        if u.w >= survive {
            return store;
        }
        next /= survive;
    }
    if max_element(next) <= 0.0 {
        return store;
    }
    (*state).power = next;
    (*state).dimension = rng.dimension;
    let was_caustic = is_direct || ((*state).segments & PHOTON_CAUSTIC) != 0u;
    let caustic = was_caustic && scatter.specular && (bsdf_traced(bsdf) & LOBE_SPECULAR) != 0u;
    (*state).segments = ((*state).segments & MAX_PHOTON_SEGMENTS) | select(0u, PHOTON_CAUSTIC, caustic);
    if scatter.transmitted {
        (*state).medium = beyond(s);
    }
    (*state).direction = scatter.direction;
    (*state).origin = trace_leave(s.position, s.normal, scatter.direction);
    (*state).left |= ACTIVE;
    return store;
}

var<workgroup> n_stored: atomic<u32>;
var<workgroup> n_alive: atomic<u32>;

// Reads states and counters, writes slots, counters and states; PATHS paths a thread.
// values: paths in the chunk, first path, round, first workgroup.
@compute @workgroup_size(64)
fn trace_photons(@builtin(workgroup_id) workgroup: vec3<u32>, @builtin(local_invocation_index) local: u32) {
    let group = arguments.values.w + workgroup.x;
    let thread = group * 64u + local;
    if local == 0u {
        atomicStore(&n_stored, 0u);
        atomicStore(&n_alive, 0u);
    }
    workgroupBarrier();
    var state = PathState();
    if arguments.values.z == 0u {
        let before = min(thread * PATHS, arguments.values.x);
        state.path = arguments.values.y + before - 1u;
        state.left = min(PATHS, arguments.values.x - before);
    } else if thread < counters[COUNT_ALIVE] {
        state = states[GOING_ON + thread];
    }
    // The eye's side adds at least one segment.
    let longest = min(min(frame.max_photon_segments, MAX_PHOTON_SEGMENTS), max(frame.max_segments, 1u) - 1u);
    var stored = 0u;
    let bound = PATHS * (longest + 2u);
    for (var step = 0u; step < bound && state.left != 0u; step++) {
        if state.left < ACTIVE {
            state = photon_begin(state);
        }
        if (state.segments & MAX_PHOTON_SEGMENTS) >= longest {
            state.left &= ~ACTIVE;
        }
        if state.left >= ACTIVE {
            if stored == SLOTS {
                break;
            }
            stored += select(0u, 1u, photon_step(&state, stored * CHUNK + thread));
        }
    }
    var alive = 0u;
    if state.left != 0u {
        states[thread] = state;
        alive = 1u;
    }
    counters[COUNTS + thread] = stored | (alive * ALIVE);
    atomicAdd(&n_stored, stored);
    atomicAdd(&n_alive, alive);
    workgroupBarrier();
    if local == 0u {
        counters[BLOCKS + 2u * group] = atomicLoad(&n_stored);
        counters[BLOCKS + 2u * group + 1u] = atomicLoad(&n_alive);
    }
}
