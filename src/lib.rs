//! Sunfleck: progressive photon mapping, and the neighbour search under it.
//!
//! Import order, left never names right: `math` → `index` → `files` → `points` → `mesh` → `device` → `layout` → `scene` → `ppm` → `cpu` |
//! `gpu` → `inspect` → `output`. `cpu` and `gpu` do not know each other.

#[cfg(feature = "render")]
pub mod cpu;
pub mod device;
#[cfg(any(feature = "points", feature = "mesh"))]
mod files;
#[cfg(feature = "gpu")]
pub mod gpu;
pub mod index;
#[cfg(feature = "render")]
pub mod inspect;
pub mod layout;
pub mod math;
#[cfg(feature = "mesh")]
pub mod mesh;
#[cfg(feature = "render")]
pub mod output;
#[cfg(feature = "points")]
pub mod points;
#[cfg(feature = "render")]
pub mod ppm;
#[cfg(feature = "render")]
pub mod scene;

// Its Rust is compiled and run with the documentation tests.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
pub struct Readme;
