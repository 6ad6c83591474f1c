//! What can go wrong on the device that does the work, and what can end it early.

use std::fmt;
use std::sync::Arc;

use crate::index;

/// Asked now and then by work under way whether it is still wanted. The default never ends anything.
#[derive(Clone, Default)]
pub struct Interrupt(Option<Arc<dyn Fn() -> bool + Send + Sync>>);

impl Interrupt {
    /// Ends what asks as soon as `is_unwanted` says so. It is called from any thread, some hundred times a second: it must
    /// not wait for anything.
    pub fn when(is_unwanted: impl Fn() -> bool + Send + Sync + 'static) -> Self {
        Self(Some(Arc::new(is_unwanted)))
    }

    /// Whether it can ever end anything.
    pub fn is_set(&self) -> bool {
        self.0.is_some()
    }

    /// [`Error::Interrupted`] if what asks is to end.
    #[inline]
    pub fn check(&self) -> Result<(), Error> {
        match &self.0 {
            Some(is_unwanted) if is_unwanted() => Err(Error::Interrupted),
            _ => Ok(()),
        }
    }
}

impl fmt::Debug for Interrupt {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_tuple("Interrupt").field(&self.is_set()).finish()
    }
}

/// Why a device did not do what it was asked for.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// An [`Interrupt`] ended the work.
    #[error("interrupted")]
    Interrupted,
    /// The device failed or was lost.
    #[error("{device}: {message}")]
    Device {
        /// Name of the device.
        device: String,
        /// What it said.
        message: String,
    },
    /// Something is larger than the device allows.
    #[error("{what} needs {needed} bytes, but {device} allows {allowed}")]
    TooLarge {
        /// What would not fit.
        what: String,
        /// Bytes.
        needed: u64,
        /// Bytes.
        allowed: u64,
        /// Name of the device.
        device: String,
    },
    /// No adapter, or none that fits what was asked for.
    #[error("{0}")]
    NoDevice(String),
    /// A custom visitor does not compile; the message names the line.
    #[error("{0}")]
    Shader(String),
    /// A buffer that was passed in cannot be used.
    #[error("the buffer of {what} {problem}")]
    Buffer {
        /// What is in it.
        what: &'static str,
        /// What is wrong with it.
        problem: String,
    },
    /// What was asked of a neighbour search makes no sense.
    #[error(transparent)]
    Search(#[from] index::Error),
}
