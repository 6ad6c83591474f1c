//! Integration tests.

#[cfg(feature = "render")]
mod cli;
#[cfg(all(feature = "render", feature = "gpu"))]
mod gpu;
#[cfg(all(feature = "render", feature = "gpu"))]
mod layout;
mod index;
mod physics;
