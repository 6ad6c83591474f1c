// Photons into the order of the tree.
#import common

// A photon's bits, whatever they mean.
struct Record {
    first: vec4<u32>,
    second: vec4<u32>,
}

@group(0) @binding(0) var<storage, read> order: array<u32>;
@group(0) @binding(1) var<storage, read> photons: array<Record>;
@group(0) @binding(2) var<storage, read_write> sorted: array<Record>;

// Reads order and photons, writes sorted; one thread per photon. values.x: photons.
@compute @workgroup_size(64)
fn permute(
    @builtin(workgroup_id) workgroup: vec3<u32>,
    @builtin(num_workgroups) workgroups: vec3<u32>,
    @builtin(local_invocation_index) local: u32,
) {
    let i = thread_index(workgroup, workgroups, local, 64u);
    if i < arguments.values.x {
        sorted[i] = photons[order[i]];
    }
}
