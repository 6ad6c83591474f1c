//! Ctrl-C and SIGTERM: the first asks to stop and save, the second ends the program at once.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use anyhow::{Context, Result};
use signal_hook::consts::{SIGINT, SIGTERM};
use signal_hook::flag;

/// Whether to stop.
pub struct Stop(Arc<AtomicBool>);

impl Stop {
    /// Takes over both signals.
    pub fn install() -> Result<Self> {
        let asked = Arc::new(AtomicBool::new(false));
        for signal in [SIGINT, SIGTERM] {
            // In this order: the exit is armed by the flag that the first signal sets after it.
            flag::register_conditional_shutdown(signal, i32::from(crate::INTERRUPTED), Arc::clone(&asked))
                .and_then(|_| flag::register(signal, Arc::clone(&asked)))
                .context("cannot take over Ctrl-C")?;
        }
        Ok(Self(asked))
    }

    /// Whether somebody asked.
    pub fn asked(&self) -> bool {
        self.0.load(Ordering::Relaxed)
    }
}
