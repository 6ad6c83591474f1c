//! Integration tests.

#[cfg(all(feature = "render", feature = "gpu"))]
mod backends;
#[cfg(all(feature = "render", feature = "gpu"))]
mod gpu;
#[cfg(all(feature = "render", feature = "gpu"))]
mod layout;
mod physics;
