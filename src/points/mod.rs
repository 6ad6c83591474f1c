//! Geometry tasks on point clouds: correspondence, registration of two scans, normals, and the files they come in.
//!
//! Everything is in the cloud's own unit, whichever that is: nothing here has an absolute tolerance. Positions are `f64`;
//! the searches run in `f32` in a frame of the cloud's own ([`Frame`]), so that a survey far from its origin loses nothing.
//! Results do not depend on the number of threads.

mod cloud;
mod correspondence;
pub mod generate;
pub mod io;
mod normals;
mod orientation;
mod registration;
mod rigid;

use std::path::PathBuf;

pub use cloud::{Cloud, Frame, Indexed, Precision};
pub use correspondence::{Match, automatic_outlier, correspond};
pub use normals::{Normals, estimate};
pub use orientation::orient;
pub use registration::{Iteration, Method, Registration, Settings, register};
pub use rigid::Rigid;

use crate::index;

/// Why a task on a cloud cannot be done. One line.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum Error {
    /// A file cannot be read, or is not what its name says.
    #[error("{}: {problem}", path.display())]
    File {
        /// As given.
        path: PathBuf,
        /// In words, with the line or the vertex.
        problem: String,
    },
    /// NaN, infinite, or beyond ±1e100.
    #[error("point {0}: a coordinate is not a number of reasonable size")]
    Coordinate(usize),
    /// Fewer points than the task takes.
    #[error("{points} points: {task} needs at least {needed}")]
    TooFew {
        /// How many there are.
        points: usize,
        /// What was asked for.
        task: &'static str,
        /// How many it takes.
        needed: usize,
    },
    /// Of a neighbourhood: 3 to [`index::MAX_K`].
    #[error("k is {0}: a normal takes 3 to {max} neighbours", max = index::MAX_K)]
    Neighbours(usize),
    /// Nothing to fit: no two points are near enough to each other.
    #[error("iteration {iteration}: {matches} points have a neighbour within {distance}: at least 3 must")]
    Apart {
        /// From 0.
        iteration: usize,
        /// Pairs within that distance.
        matches: usize,
        /// The outlier distance, in the clouds' unit.
        distance: f64,
    },
    /// More than one motion fits equally well.
    #[error("the matched points lie on a line or in one place: they do not say how to turn")]
    Undetermined,
    /// Of the search.
    #[error(transparent)]
    Search(#[from] index::Error),
}
