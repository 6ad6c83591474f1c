// All neighbours of each query in compressed rows. One kernel counts and then writes, so that both find the same.
#import search

@group(0) @binding(4) var<storage, read_write> counts: array<u32>;
@group(0) @binding(5) var<storage, read> offsets: array<u32>;
@group(0) @binding(6) var<storage, read_write> indices: array<u32>;
@group(0) @binding(7) var<storage, read_write> distances2: array<f32>;

struct Visitor {
    radius2: f32,
    // In the row, while it is written.
    next: u32,
    n: u32,
}

// further.z, 0: count, 1: write.
fn begin(query: u32, centre: vec3<f32>, radius2: f32) -> Visitor {
    var visitor: Visitor;
    visitor.radius2 = radius2;
    if arguments.further.z != 0u {
        visitor.next = offsets[query];
    }
    return visitor;
}

fn visit(visitor: ptr<function, Visitor>, slot: u32, delta: vec3<f32>, distance2: f32) {
    if arguments.further.z != 0u {
        let at = (*visitor).next + (*visitor).n;
        indices[at] = index_of(slot);
        distances2[at] = distance2;
    }
    (*visitor).n += 1u;
}

fn end(visitor: ptr<function, Visitor>, query: u32) {
    if arguments.further.z == 0u {
        counts[query] = (*visitor).n;
    }
}
