// Photons from the slots of their threads into one array, in the order of the threads, and the paths that go on likewise.
#import common
#import photon_paths

// A photon's and a path's bits, whatever they mean.
struct Record {
    first: vec4<u32>,
    second: vec4<u32>,
}

struct LongRecord {
    first: Record,
    second: Record,
}

@group(0) @binding(0) var<storage, read> slots: array<Record>;
@group(0) @binding(1) var<storage, read_write> counters: array<u32>;
@group(0) @binding(2) var<storage, read_write> states: array<LongRecord>;
@group(0) @binding(3) var<storage, read_write> photons: array<Record>;

const THREADS: u32 = 64u;

var<workgroup> partial: array<vec2<u32>, THREADS>;

// Exclusive prefix sum of one pair a thread.
fn prefix(local: u32, value: vec2<u32>) -> vec2<u32> {
    partial[local] = value;
    for (var step = 1u; step < THREADS; step *= 2u) {
        workgroupBarrier();
        var other = vec2(0u);
        if local >= step {
            other = partial[local - step];
        }
        workgroupBarrier();
        partial[local] += other;
    }
    return partial[local] - value;
}

// Reads and writes counters; one workgroup. values: workgroups of the chunk, -, -, whether this is the last round.
@compute @workgroup_size(64)
fn compact_offsets(@builtin(local_invocation_index) local: u32) {
    let n = arguments.values.x;
    let per_thread = (n + THREADS - 1u) / THREADS;
    let begin = min(local * per_thread, n);
    let end = min(begin + per_thread, n);
    var sum = vec2(0u);
    for (var i = begin; i < end; i++) {
        sum += vec2(counters[BLOCKS + 2u * i], counters[BLOCKS + 2u * i + 1u]);
    }
    let before = prefix(local, sum);
    var running = before + vec2(counters[COUNT_PHOTONS], 0u);
    storageBarrier();
    for (var i = begin; i < end; i++) {
        let count = vec2(counters[BLOCKS + 2u * i], counters[BLOCKS + 2u * i + 1u]);
        counters[BLOCKS + 2u * i] = running.x;
        counters[BLOCKS + 2u * i + 1u] = running.y;
        running += count;
    }
    if local == THREADS - 1u {
        counters[COUNT_PHOTONS] = running.x;
        counters[COUNT_ALIVE] = running.y;
        if arguments.values.w != 0u {
            counters[COUNT_UNFINISHED] += running.y;
        }
    }
}

// Reads slots, counters and states, writes photons and states; one thread per thread of the chunk.
// values.x: photons that there is room for.
@compute @workgroup_size(64)
fn compact_write(@builtin(workgroup_id) workgroup: vec3<u32>, @builtin(local_invocation_index) local: u32) {
    let thread = workgroup.x * THREADS + local;
    let result = counters[COUNTS + thread];
    let alive = (result & ALIVE) != 0u;
    let stored = result & ~ALIVE;
    let offset = prefix(local, vec2(stored, select(0u, 1u, alive)));
    let first = counters[BLOCKS + 2u * workgroup.x] + offset.x;
    for (var j = 0u; j < stored; j++) {
        // What does not fit is counted all the same: the host sees that and does it again with more room.
        if first + j < arguments.values.x {
            photons[first + j] = slots[j * CHUNK + thread];
        }
    }
    if alive {
        states[GOING_ON + counters[BLOCKS + 2u * workgroup.x + 1u] + offset.y] = states[thread];
    }
}
