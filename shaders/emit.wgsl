// Photons as they leave the lamps, as in src/cpu/photons.rs.
#import rng
#import light
#import photon_paths

@group(0) @binding(0) var<storage, read_write> states: array<PathState>;

// Writes states; one thread per path of the chunk. values: paths in the chunk, first path.
@compute @workgroup_size(64)
fn emit_photons(
    @builtin(workgroup_id) workgroup: vec3<u32>,
    @builtin(num_workgroups) workgroups: vec3<u32>,
    @builtin(local_invocation_index) local: u32,
) {
    let i = thread_index(workgroup, workgroups, local, 64u);
    if i >= arguments.values.x {
        return;
    }
    var rng = rng_new(STREAM_PHOTON, arguments.values.y + i, frame.iteration, frame.seed);
    let u = rng_next4(&rng);
    let v = rng_next4(&rng);
    let emission = light_emit(u.xyz, v.xyz);
    states[FRESH + i] = PathState(
        emission.origin,
        rng.path,
        emission.direction,
        rng.dimension,
        emission.power,
        0u,
        vec3(0.0),
        select(0u, ACTIVE, emission.ok),
    );
}
