// Box around all points: first of each block of BLOCK points, then of the blocks.
#import common

// Records of some words, a position first in each.
@group(0) @binding(0) var<storage, read> positions: array<f32>;
@group(0) @binding(1) var<storage, read_write> blocks: array<PointBox>;
@group(0) @binding(2) var<storage, read_write> bounds: PointBox;

const THREADS: u32 = 64u;
const PER_THREAD: u32 = 32u;
const BLOCK: u32 = THREADS * PER_THREAD;
const HUGE: f32 = 3.4028234e38;

var<workgroup> low: array<vec3<f32>, THREADS>;
var<workgroup> high: array<vec3<f32>, THREADS>;

fn reduce(local: u32) {
    for (var half = THREADS / 2u; half > 0u; half /= 2u) {
        workgroupBarrier();
        if local < half {
            low[local] = min(low[local], low[local + half]);
            high[local] = max(high[local], high[local + half]);
        }
    }
}

// Reads positions, writes blocks; one workgroup per block. values: points, words in a record.
@compute @workgroup_size(64)
fn bounds_of_blocks(
    @builtin(workgroup_id) workgroup: vec3<u32>,
    @builtin(num_workgroups) workgroups: vec3<u32>,
    @builtin(local_invocation_index) local: u32,
) {
    let n = arguments.values.x;
    let block = workgroup.y * workgroups.x + workgroup.x;
    var box_min = vec3(HUGE);
    var box_max = vec3(-HUGE);
    for (var j = 0u; j < PER_THREAD; j++) {
        let i = block * BLOCK + j * THREADS + local;
        if i < n {
            let at = i * arguments.values.y;
            let position = vec3(positions[at], positions[at + 1u], positions[at + 2u]);
            box_min = min(box_min, position);
            box_max = max(box_max, position);
        }
    }
    low[local] = box_min;
    high[local] = box_max;
    reduce(local);
    if local == 0u && block * BLOCK < n {
        blocks[block] = PointBox(low[0], 0u, high[0], 0u);
    }
}

// Reads blocks, writes bounds; one workgroup. values.x: points.
@compute @workgroup_size(64)
fn bounds_of_all(@builtin(local_invocation_index) local: u32) {
    let n = (arguments.values.x + BLOCK - 1u) / BLOCK;
    var box_min = vec3(HUGE);
    var box_max = vec3(-HUGE);
    for (var i = local; i < n; i += THREADS) {
        box_min = min(box_min, blocks[i].min);
        box_max = max(box_max, blocks[i].max);
    }
    low[local] = box_min;
    high[local] = box_max;
    reduce(local);
    if local == 0u {
        bounds = PointBox(low[0], 0u, high[0], 0u);
    }
}
