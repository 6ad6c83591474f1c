//! Integration tests.

#[cfg(feature = "render")]
mod cli;
#[cfg(all(feature = "render", feature = "gpu"))]
mod backends;
#[cfg(all(feature = "render", feature = "gpu"))]
mod gpu;
#[cfg(all(feature = "render", feature = "gpu"))]
mod layout;
mod layering;
mod physics;
