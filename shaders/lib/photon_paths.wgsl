// How a chunk of photon paths lies in memory; src/gpu/photons.rs has the same numbers.

// Paths in a chunk.
const CHUNK: u32 = 65536u;
// Photons a path may store in one round.
const SLOTS: u32 = 16u;
// The path has more to store.
const ALIVE: u32 = 0x80000000u;

// In `counters`: photons so far, paths that go on, paths that went on after the last round.
const COUNT_PHOTONS: u32 = 0u;
const COUNT_ALIVE: u32 = 1u;
const COUNT_UNFINISHED: u32 = 2u;
// Then a word a thread: photons stored, and ALIVE.
const COUNTS: u32 = 4u;
// Then two words a workgroup: photons and paths that go on; after the scan where they are to go.
const BLOCKS: u32 = COUNTS + CHUNK;
const N_BLOCKS: u32 = CHUNK / 64u;
