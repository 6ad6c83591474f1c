//! What a scene held goes back to the system when it is left ([ADR 14](../../../../docs/adr/0014-allocator.md)).

/// Large arrays get pages of their own from now on, which are given back as they are dropped. To be called before there is
/// any thread.
#[cfg(all(target_os = "linux", target_env = "gnu"))]
#[allow(unsafe_code, reason = "docs/adr/0014-allocator.md")]
pub fn give_back_large() {
    use std::ffi::c_int;

    /// `M_MMAP_THRESHOLD` of glibc's `malloc.h`.
    const MMAP_THRESHOLD: c_int = -3;
    /// In bytes; glibc begins at half of it, and raises that to 32 MiB with what it sees dropped, unless it is set.
    const LARGE: c_int = 256 << 10;

    unsafe extern "C" {
        fn mallopt(parameter: c_int, value: c_int) -> c_int;
    }
    // SAFETY: this is its declaration in glibc's `malloc.h`, and there is no other thread yet, which is all it asks for.
    // Where it refuses, memory is kept as before.
    let _ = unsafe { mallopt(MMAP_THRESHOLD, LARGE) };
}

/// Other allocators give back by themselves.
#[cfg(not(all(target_os = "linux", target_env = "gnu")))]
pub fn give_back_large() {}
