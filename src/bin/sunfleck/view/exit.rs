//! Last things before the process ends, when nobody asked for its end: Xlib calls `exit` when the display is gone
//! ([ADR 13](../../../../docs/adr/0013-exit.md)).

use std::sync::{Mutex, MutexGuard, Once, PoisonError};

type Last = Box<dyn FnOnce() + Send>;

static LAST: Mutex<Option<Last>> = Mutex::new(None);

/// As long as it lives, `exit` does something first.
pub struct Guard(());

impl Guard {
    /// There is one at a time.
    pub fn new(last: impl FnOnce() + Send + 'static) -> Self {
        static REGISTERED: Once = Once::new();
        REGISTERED.call_once(register);
        *lock() = Some(Box::new(last));
        Self(())
    }
}

impl Drop for Guard {
    fn drop(&mut self) {
        disarm();
    }
}

/// Nothing is done any more, whoever exits.
pub fn disarm() {
    *lock() = None;
}

fn lock() -> MutexGuard<'static, Option<Last>> {
    LAST.lock().unwrap_or_else(PoisonError::into_inner)
}

#[cfg(unix)]
#[allow(unsafe_code, reason = "docs/adr/0013-exit.md")]
fn register() {
    // SAFETY: this is its declaration in C11, 7.22.4.2.
    unsafe extern "C" {
        safe fn atexit(function: extern "C" fn()) -> std::ffi::c_int;
    }
    // Without it the process ends as it would have.
    let _ = atexit(at_exit);
}

/// No library ends the process there.
#[cfg(not(unix))]
fn register() {}

#[cfg(unix)]
extern "C" fn at_exit() {
    let Some(last) = lock().take() else { return };
    // On another thread: this one has lost its thread-local variables, and a panic must not leave this function.
    if let Ok(thread) = std::thread::Builder::new().name("exit".to_owned()).spawn(last) {
        let _ = thread.join();
    }
}
