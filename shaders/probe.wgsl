// The BSDF alone: tests ask it what they ask the CPU's.
#import bsdf

struct Query {
    // The known direction is its `outgoing`.
    vertex: EyeVertex,
    other: vec3<f32>,
    lobes: u32,
    u: vec3<f32>,
    transport: u32,
}

struct Answer {
    value: vec3<f32>,
    pdf: f32,
    direction: vec3<f32>,
    sampled_pdf: f32,
    weight: vec3<f32>,
    // Bit 0: there is a direction; bit 1: it goes through.
    flags: u32,
}

@group(0) @binding(0) var<storage, read> queries: array<Query>;
@group(0) @binding(1) var<storage, read_write> answers: array<Answer>;

// Reads queries, writes answers; one thread per query. values.x: queries.
@compute @workgroup_size(64)
fn probe(
    @builtin(workgroup_id) workgroup: vec3<u32>,
    @builtin(num_workgroups) workgroups: vec3<u32>,
    @builtin(local_invocation_index) local: u32,
) {
    let i = thread_index(workgroup, workgroups, local, 64u);
    if i >= arguments.values.x {
        return;
    }
    let q = queries[i];
    let b = bsdf_of_vertex(q.vertex);
    let known = oct_decode(q.vertex.outgoing);
    let sampled = bsdf_sample(b, known, q.lobes, q.transport, q.u);
    answers[i] = Answer(
        bsdf_evaluate(b, known, q.other, q.lobes, q.transport),
        bsdf_pdf(b, known, q.other, q.lobes),
        sampled.direction,
        sampled.pdf,
        sampled.weight,
        select(0u, 1u, sampled.ok) | select(0u, 2u, sampled.transmitted),
    );
}
