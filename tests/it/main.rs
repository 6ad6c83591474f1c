//! Integration tests.

#[cfg(feature = "render")]
mod cli;
#[cfg(all(feature = "render", feature = "gpu"))]
mod gpu;
mod index;
#[cfg(all(feature = "render", feature = "gpu"))]
mod layout;
mod physics;
#[cfg(feature = "render")]
mod reference;
mod sampling;
