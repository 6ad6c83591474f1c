// One pass of a stable radix sort, least significant digit first, 7 bits a digit: nine passes sort 63 bits.
// Reduce, then scan: digits are counted per block, the counts scanned per digit over the blocks, and each block writes
// its keys behind those of the blocks before it. Each thread takes a run of neighbouring keys, so ranks come from
// counters of its own, with a handful of barriers a block and no ordering between workgroups.
#import common

// Low and high word.
@group(0) @binding(0) var<storage, read> keys: array<vec2<u32>>;
@group(0) @binding(1) var<storage, read> order: array<u32>;
@group(0) @binding(2) var<storage, read_write> keys_out: array<vec2<u32>>;
@group(0) @binding(3) var<storage, read_write> order_out: array<u32>;
// [digit][block]: counts, after the scan the keys of the same digit in earlier blocks.
@group(0) @binding(4) var<storage, read_write> counts: array<u32>;
// [digit]: keys of this digit.
@group(0) @binding(5) var<storage, read_write> totals: array<u32>;

const DIGITS: u32 = 128u;
const THREADS: u32 = 64u;

fn digit_of(key: vec2<u32>, shift: u32) -> u32 {
    if shift >= 32u {
        return (key.y >> (shift - 32u)) & (DIGITS - 1u);
    }
    // Bits from both words; a shift by 32 is undefined.
    let upper = select(key.y << (32u - shift), 0u, shift == 0u);
    return ((key.x >> shift) | upper) & (DIGITS - 1u);
}

var<workgroup> histogram: array<atomic<u32>, DIGITS>;

// Reads keys, writes counts; one workgroup per block. values: keys, shift, blocks, keys a thread takes.
@compute @workgroup_size(64)
fn sort_count(
    @builtin(workgroup_id) workgroup: vec3<u32>,
    @builtin(num_workgroups) workgroups: vec3<u32>,
    @builtin(local_invocation_index) local: u32,
) {
    let n = arguments.values.x;
    let shift = arguments.values.y;
    let n_blocks = arguments.values.z;
    let block = workgroup.y * workgroups.x + workgroup.x;
    atomicStore(&histogram[local], 0u);
    atomicStore(&histogram[local + THREADS], 0u);
    workgroupBarrier();
    let per_thread = arguments.values.w;
    for (var j = 0u; j < per_thread; j++) {
        let i = (block * per_thread + j) * THREADS + local;
        if i < n {
            atomicAdd(&histogram[digit_of(keys[i], shift)], 1u);
        }
    }
    workgroupBarrier();
    if block < n_blocks {
        counts[local * n_blocks + block] = atomicLoad(&histogram[local]);
        counts[(local + THREADS) * n_blocks + block] = atomicLoad(&histogram[local + THREADS]);
    }
}

var<workgroup> partial: array<u32, THREADS>;

// Exclusive prefix sum of one value a thread.
fn prefix(local: u32, value: u32) -> u32 {
    partial[local] = value;
    for (var step = 1u; step < THREADS; step *= 2u) {
        workgroupBarrier();
        var other = 0u;
        if local >= step {
            other = partial[local - step];
        }
        workgroupBarrier();
        partial[local] += other;
    }
    return partial[local] - value;
}

// Reads and writes counts, writes totals; one workgroup per digit. values: keys, shift, blocks, keys a thread takes.
@compute @workgroup_size(64)
fn sort_scan(@builtin(workgroup_id) workgroup: vec3<u32>, @builtin(local_invocation_index) local: u32) {
    let n_blocks = arguments.values.z;
    let per_thread = (n_blocks + THREADS - 1u) / THREADS;
    let first = workgroup.x * n_blocks;
    let begin = min(local * per_thread, n_blocks);
    let end = min(begin + per_thread, n_blocks);
    var sum = 0u;
    for (var i = begin; i < end; i++) {
        sum += counts[first + i];
    }
    let before = prefix(local, sum);
    var running = before;
    for (var i = begin; i < end; i++) {
        let count = counts[first + i];
        counts[first + i] = running;
        running += count;
    }
    if local == THREADS - 1u {
        totals[workgroup.x] = before + sum;
    }
}

// [thread][pair of digits], two counters of 16 bits in a word.
var<workgroup> ranks: array<u32, THREADS * THREADS>;
var<workgroup> bases: array<u32, DIGITS>;

// Reads keys, order, counts and totals, writes keys_out and order_out; one workgroup per block. values: keys, shift, blocks, keys a thread takes.
@compute @workgroup_size(64)
fn sort_scatter(
    @builtin(workgroup_id) workgroup: vec3<u32>,
    @builtin(num_workgroups) workgroups: vec3<u32>,
    @builtin(local_invocation_index) local: u32,
) {
    let n = arguments.values.x;
    let shift = arguments.values.y;
    let n_blocks = arguments.values.z;
    let block = workgroup.y * workgroups.x + workgroup.x;
    for (var i = 0u; i < THREADS; i++) {
        ranks[i * THREADS + local] = 0u;
    }

    let even = totals[2u * local];
    let smaller = prefix(local, even + totals[2u * local + 1u]);
    let in_blocks = min(block, n_blocks - 1u);
    bases[2u * local] = smaller + counts[2u * local * n_blocks + in_blocks];
    bases[2u * local + 1u] = smaller + even + counts[(2u * local + 1u) * n_blocks + in_blocks];
    workgroupBarrier();

    let per_thread = arguments.values.w;
    let begin = min((block * THREADS + local) * per_thread, n);
    let end = min(begin + per_thread, n);
    for (var i = begin; i < end; i++) {
        let digit = digit_of(keys[i], shift);
        ranks[local * THREADS + digit / 2u] += 1u << (16u * (digit & 1u));
    }
    workgroupBarrier();

    var running = 0u;
    for (var thread = 0u; thread < THREADS; thread++) {
        let count = ranks[thread * THREADS + local];
        ranks[thread * THREADS + local] = running;
        running += count;
    }
    workgroupBarrier();

    for (var i = begin; i < end; i++) {
        let key = keys[i];
        let digit = digit_of(key, shift);
        let slot = local * THREADS + digit / 2u;
        let half = 16u * (digit & 1u);
        let word = ranks[slot];
        ranks[slot] = word + (1u << half);
        let to = bases[digit] + ((word >> half) & 0xffffu);
        keys_out[to] = key;
        order_out[to] = order[i];
    }
}
