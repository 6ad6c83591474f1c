// Exclusive prefix sum, n counts to n + 1 offsets: blocks are summed, the sums scanned, each block scanned from its own.
// Sums that overflow stay at the largest number, so the last offset tells.
#import common

@group(0) @binding(0) var<storage, read> counts: array<u32>;
@group(0) @binding(1) var<storage, read_write> sums: array<u32>;
@group(0) @binding(2) var<storage, read_write> offsets: array<u32>;

const THREADS: u32 = 64u;
const PER_THREAD: u32 = 32u;
const BLOCK: u32 = THREADS * PER_THREAD;

fn add(a: u32, b: u32) -> u32 {
    let sum = a + b;
    return select(sum, NONE, sum < a);
}

// What a thread of a block sums: a run of neighbouring counts.
fn run_of(block: u32, local: u32) -> vec2<u32> {
    let begin = block * BLOCK + local * PER_THREAD;
    return min(vec2(begin, begin + PER_THREAD), vec2(arguments.values.x));
}

fn sum_of(run: vec2<u32>) -> u32 {
    var sum = 0u;
    for (var i = run.x; i < run.y; i++) {
        sum = add(sum, counts[i]);
    }
    return sum;
}

var<workgroup> partial: array<u32, THREADS>;

// Sum of the values of the threads up to this one.
fn inclusive(local: u32, value: u32) -> u32 {
    partial[local] = value;
    for (var step = 1u; step < THREADS; step *= 2u) {
        workgroupBarrier();
        var other = 0u;
        if local >= step {
            other = partial[local - step];
        }
        workgroupBarrier();
        partial[local] = add(partial[local], other);
    }
    workgroupBarrier();
    return partial[local];
}

fn exclusive(local: u32, value: u32) -> u32 {
    _ = inclusive(local, value);
    if local == 0u {
        return 0u;
    }
    return partial[local - 1u];
}

// Reads counts, writes sums; one workgroup per block. values: counts, blocks.
@compute @workgroup_size(64)
fn scan_blocks(
    @builtin(workgroup_id) workgroup: vec3<u32>,
    @builtin(num_workgroups) workgroups: vec3<u32>,
    @builtin(local_invocation_index) local: u32,
) {
    let block = workgroup.y * workgroups.x + workgroup.x;
    let total = inclusive(local, sum_of(run_of(block, local)));
    if local == THREADS - 1u && block < arguments.values.y {
        sums[block] = total;
    }
}

// Makes the sums those of the blocks before; one workgroup. values: counts, blocks.
@compute @workgroup_size(64)
fn scan_sums(@builtin(local_invocation_index) local: u32) {
    let n = arguments.values.y;
    let per_thread = (n + THREADS - 1u) / THREADS;
    let begin = min(local * per_thread, n);
    let end = min(begin + per_thread, n);
    var sum = 0u;
    for (var i = begin; i < end; i++) {
        sum = add(sum, sums[i]);
    }
    var running = exclusive(local, sum);
    for (var i = begin; i < end; i++) {
        let value = sums[i];
        sums[i] = running;
        running = add(running, value);
    }
}

// Reads counts and sums, writes offsets; one workgroup per block. values: counts, blocks.
@compute @workgroup_size(64)
fn scan_offsets(
    @builtin(workgroup_id) workgroup: vec3<u32>,
    @builtin(num_workgroups) workgroups: vec3<u32>,
    @builtin(local_invocation_index) local: u32,
) {
    let block = workgroup.y * workgroups.x + workgroup.x;
    let run = run_of(block, local);
    let before = exclusive(local, sum_of(run));
    if block >= arguments.values.y {
        return;
    }
    var running = add(sums[block], before);
    for (var i = run.x; i < run.y; i++) {
        offsets[i] = running;
        running = add(running, counts[i]);
    }
    // The thread whose run ends the counts.
    if run.x < run.y && run.y == arguments.values.x {
        offsets[run.y] = running;
    }
}
