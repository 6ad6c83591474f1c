//! Single and double precision.

use std::fmt::Debug;
use std::ops::{Add, Div, Mul, Neg, Sub};

mod sealed {
    pub trait Sealed {}
    impl Sealed for f32 {}
    impl Sealed for f64 {}
}

/// The precision of a mesh and of the rays through it: `f32` or `f64`.
pub trait Scalar:
    sealed::Sealed
    + Copy
    + Debug
    + Default
    + PartialOrd
    + Send
    + Sync
    + Into<f64>
    + Neg<Output = Self>
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + 'static
{
    /// 0.
    const ZERO: Self;
    /// 1.
    const ONE: Self;
    /// ∞.
    const INFINITY: Self;
    /// Distance from 1 to the next number.
    const EPSILON: f64;
    /// Coordinates and lengths are at most 2 to this power, and the size of a mesh at least its inverse: products of
    /// three neither overflow nor vanish.
    const EXPONENT: i32;
    /// a·b − c·d to within 1.5 units in the last place, unless it underflows.
    fn difference_of_products(a: Self, b: Self, c: Self, d: Self) -> Self;
    /// Rounded.
    fn of(x: f64) -> Self;
}

impl Scalar for f32 {
    const ZERO: Self = 0.0;
    const ONE: Self = 1.0;
    const INFINITY: Self = f32::INFINITY;
    const EPSILON: f64 = f32::EPSILON as f64;
    const EXPONENT: i32 = 40;
    /// In double precision, in which the products are exact. Where the target has no fused multiply-add, that is a function of
    /// the C library, and with mingw's it is rounded twice.
    #[inline]
    fn difference_of_products(a: Self, b: Self, c: Self, d: Self) -> Self {
        let [a, b, c, d] = [a, b, c, d].map(f64::from);
        (a * b - c * d) as f32
    }
    #[inline]
    fn of(x: f64) -> Self {
        x as f32
    }
}

impl Scalar for f64 {
    const ZERO: Self = 0.0;
    const ONE: Self = 1.0;
    const INFINITY: Self = f64::INFINITY;
    const EPSILON: f64 = f64::EPSILON;
    const EXPONENT: i32 = 300;
    /// Kahan's way. (Jeannerod, Louvet & Muller 2013, "Further analysis of Kahan's algorithm for the accurate computation
    /// of 2×2 determinants".)
    #[inline]
    fn difference_of_products(a: Self, b: Self, c: Self, d: Self) -> Self {
        let product = c * d;
        let error = (-c).mul_add(d, product);
        a.mul_add(b, -product) + error
    }
    #[inline]
    fn of(x: f64) -> Self {
        x
    }
}
