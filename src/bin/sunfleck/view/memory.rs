//! What a scene held goes back to the system when it is left ([ADR 14](../../../../docs/adr/0014-allocator.md)).

/// Large arrays get pages of their own from now on, which are given back as they are dropped; what is smaller comes from a few
/// heaps that keep little at their ends. To be called before there is any thread.
#[cfg(all(target_os = "linux", target_env = "gnu"))]
#[allow(unsafe_code, reason = "docs/adr/0014-allocator.md")]
pub fn give_back_large() {
    use std::ffi::c_int;

    // Of glibc's `malloc.h`.
    const M_TRIM_THRESHOLD: c_int = -1;
    const M_MMAP_THRESHOLD: c_int = -3;
    const M_ARENA_MAX: c_int = -8;
    /// Bytes; glibc begins at half of it, and raises that up to 32 MiB with what it sees dropped, unless it is set.
    const LARGE: c_int = 256 << 10;
    /// Bytes at the end of a heap that are kept for what comes next: enough for a frame. glibc by itself comes to 64 MiB.
    const KEPT: c_int = 8 << 20;
    /// Heaps, each of which comes to keep so much; glibc has up to eight for each core, and gives a new thread any of them.
    const HEAPS: c_int = 4;

    unsafe extern "C" {
        fn mallopt(parameter: c_int, value: c_int) -> c_int;
    }
    for (parameter, value) in [(M_MMAP_THRESHOLD, LARGE), (M_TRIM_THRESHOLD, KEPT), (M_ARENA_MAX, HEAPS)] {
        // SAFETY: this is its declaration in glibc's `malloc.h`, and there is no other thread yet, which is all it asks for.
        // Where it refuses, memory is kept as before.
        let _ = unsafe { mallopt(parameter, value) };
    }
}

/// Other allocators give back by themselves.
#[cfg(not(all(target_os = "linux", target_env = "gnu")))]
pub fn give_back_large() {}
