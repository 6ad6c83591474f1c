//! How large the radius is: first, and in each iteration.

use crate::layout::{Camera, EyeVertex, Frame, Photon};

/// Knaus & Zwicker 2011, equation 15 and its product form: r²(i+1) = r²(i)·(i+α)/(i+1), so
/// r²(i) = r²(1)·Γ(i+α)/(Γ(1+α)·i!).
#[derive(Clone, Copy, Debug)]
pub struct RadiusSchedule {
    alpha: f64,
}

impl RadiusSchedule {
    /// α in (0, 1).
    pub fn new(alpha: f32) -> Self {
        Self { alpha: f64::from(alpha) }
    }

    /// Radius of iteration `i` (from 1) over the radius of iteration 1.
    pub fn scale(&self, i: u32) -> f32 {
        let squared: f64 = (1..i).map(|k| ((f64::from(k) + self.alpha) / (f64::from(k) + 1.0)).ln()).sum();
        (0.5 * squared).exp() as f32
    }
}

/// To come.
pub fn first_radii(_frame: &Frame, _camera: &Camera, eye: &[EyeVertex], _photons: &[Photon]) -> Vec<f32> {
    vec![1.0; eye.len()]
}
