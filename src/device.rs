//! What can go wrong on the device that does the work.

use crate::index;

/// Why a device did not do what it was asked for.
#[derive(Debug, thiserror::Error)]
pub enum Error {
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
