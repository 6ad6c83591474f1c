// How a chunk of photon paths lies in memory; src/gpu/photons.rs has the same numbers.

// Threads in a chunk.
const CHUNK: u32 = 65536u;
// Paths a thread.
const PATHS: u32 = 4u;
// Photons a thread may store in one round.
const SLOTS: u32 = 32u;
// The thread has more to store.
const ALIVE: u32 = 0x80000000u;

// In `counters`: photons so far, threads that go on, threads that went on after the last round.
const COUNT_PHOTONS: u32 = 0u;
const COUNT_ALIVE: u32 = 1u;
const COUNT_UNFINISHED: u32 = 2u;
// Then a word a thread: photons stored, and ALIVE.
const COUNTS: u32 = 4u;
// Then two words a workgroup: photons and threads that go on; after the scan where they are to go.
const BLOCKS: u32 = COUNTS + CHUNK;
const N_BLOCKS: u32 = CHUNK / 64u;

struct PathState {
    origin: vec3<f32>,
    path: u32,
    direction: vec3<f32>,
    dimension: u32,
    power: vec3<f32>,
    // As a photon has them in its high 8 bits: with PHOTON_CAUSTIC.
    segments: u32,
    medium: vec3<f32>,
    // Paths of the thread still to begin; with ACTIVE, the present one has not ended.
    left: u32,
}

const ACTIVE: u32 = 0x80000000u;

// In `states`: where each thread is at the end of the round; where those that go on were at its beginning; all paths of the
// chunk as they leave the lamps.
const GOING_ON: u32 = CHUNK;
const FRESH: u32 = 2u * CHUNK;
