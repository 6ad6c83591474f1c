//! Integration tests.

#[cfg(feature = "render")]
mod accelerators;
#[cfg(all(feature = "render", feature = "gpu"))]
mod backends;
#[cfg(feature = "render")]
mod bench;
#[cfg(feature = "render")]
mod cli;
#[cfg(all(feature = "render", feature = "gpu"))]
mod gpu;
#[cfg(feature = "gpu")]
mod gpu_hardware;
#[cfg(feature = "gpu")]
mod gpu_search;
mod index;
mod indices;
#[cfg(feature = "render")]
mod inspect;
#[cfg(all(feature = "render", feature = "gpu"))]
mod interrupts;
mod kd;
mod layering;
#[cfg(all(feature = "render", feature = "gpu"))]
mod layout;
#[cfg(feature = "render")]
mod loading;
#[cfg(feature = "mesh")]
mod mesh;
#[cfg(feature = "render")]
mod physics;
#[cfg(feature = "render")]
mod points;
#[cfg(feature = "render")]
mod reference;
#[cfg(feature = "render")]
mod sampling;
#[cfg(all(feature = "view", target_os = "linux"))]
mod viewer;

/// What the system says of a file that is not there, without its number.
#[cfg(feature = "mesh")]
fn not_found() -> String {
    let text = std::fs::File::open("no such file").unwrap_err().to_string();
    text.split(" (os error").next().unwrap().to_owned()
}
