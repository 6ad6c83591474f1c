//! Integration tests.

#[cfg(all(feature = "render", feature = "gpu"))]
mod gpu;
#[cfg(all(feature = "render", feature = "gpu"))]
mod layout;
#[cfg(feature = "render")]
mod loading;
