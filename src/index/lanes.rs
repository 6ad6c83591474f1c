//! Eight numbers at a time, with the widest instructions this machine has: chosen when a search starts, without `unsafe`
//! (see ADR 6). Every choice computes the same bits: single additions and multiplications, none fused.

/// Lanes of all vectors here.
pub const WIDTH: usize = 8;

/// Eight numbers in memory.
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(C, align(32))]
pub struct Eight(pub [f32; WIDTH]);

/// One instruction set. Numbers are not NaN.
pub trait Lanes: Copy {
    /// Eight numbers in registers.
    type F32: Copy;

    fn splat(self, x: f32) -> Self::F32;
    fn load(self, x: &[f32; WIDTH]) -> Self::F32;
    fn store(self, x: Self::F32) -> [f32; WIDTH];
    fn add(self, a: Self::F32, b: Self::F32) -> Self::F32;
    fn sub(self, a: Self::F32, b: Self::F32) -> Self::F32;
    fn mul(self, a: Self::F32, b: Self::F32) -> Self::F32;
    fn max(self, a: Self::F32, b: Self::F32) -> Self::F32;
    /// Bit i: a ≤ b in lane i.
    fn le(self, a: Self::F32, b: Self::F32) -> u8;
    /// The lanes whose bit is set, moved to the front; what follows them means nothing.
    fn compress(self, bits: u8, x: Self::F32) -> [f32; WIDTH];
    /// The same for integers.
    fn compress_u32(self, bits: u8, x: &[u32; WIDTH]) -> [u32; WIDTH];

    /// The first of the least among the lanes whose bit is set, and its number; infinite if no bit is set.
    fn least(self, bits: u8, x: Self::F32) -> (f32, u32);

    /// x² + y² + z², from left to right.
    #[inline(always)]
    fn length2(self, [x, y, z]: [Self::F32; 3]) -> Self::F32 {
        self.add(self.add(self.mul(x, x), self.mul(y, y)), self.mul(z, z))
    }
}

/// What is compiled for every instruction set. All it calls must be inlined, or it runs with the least.
pub trait Task {
    type Output;
    fn run<L: Lanes>(self, lanes: L) -> Self::Output;
}

/// Runs a task with the best of this machine.
#[inline]
pub fn dispatch<T: Task>(task: T) -> T::Output {
    #[cfg(target_arch = "x86_64")]
    if let Some(lanes) = pulp::x86::V3::try_new() {
        return lanes.vectorize(x86::On(lanes, task));
    }
    task.run(Portable)
}

/// What the target of the build has.
#[derive(Clone, Copy)]
pub struct Portable;

impl Lanes for Portable {
    type F32 = wide::f32x8;

    #[inline(always)]
    fn splat(self, x: f32) -> Self::F32 {
        wide::f32x8::splat(x)
    }

    #[inline(always)]
    fn load(self, x: &[f32; WIDTH]) -> Self::F32 {
        wide::f32x8::from(*x)
    }

    #[inline(always)]
    fn store(self, x: Self::F32) -> [f32; WIDTH] {
        x.to_array()
    }

    #[inline(always)]
    fn add(self, a: Self::F32, b: Self::F32) -> Self::F32 {
        a + b
    }

    #[inline(always)]
    fn sub(self, a: Self::F32, b: Self::F32) -> Self::F32 {
        a - b
    }

    #[inline(always)]
    fn mul(self, a: Self::F32, b: Self::F32) -> Self::F32 {
        a * b
    }

    #[inline(always)]
    fn max(self, a: Self::F32, b: Self::F32) -> Self::F32 {
        a.fast_max(b)
    }

    #[inline(always)]
    fn le(self, a: Self::F32, b: Self::F32) -> u8 {
        a.simd_le(b).to_bitmask() as u8
    }

    #[inline(always)]
    fn compress(self, bits: u8, x: Self::F32) -> [f32; WIDTH] {
        packed(bits, &x.to_array())
    }

    #[inline(always)]
    fn compress_u32(self, bits: u8, x: &[u32; WIDTH]) -> [u32; WIDTH] {
        packed(bits, x)
    }

    #[inline(always)]
    fn least(self, bits: u8, x: Self::F32) -> (f32, u32) {
        let (mut least, mut lane) = (f32::INFINITY, 0);
        for (i, x) in (0..).zip(x.to_array()) {
            if bits >> i & 1 == 1 && x < least {
                (least, lane) = (x, i);
            }
        }
        (least, lane)
    }
}

#[inline(always)]
fn packed<T: Copy + Default>(bits: u8, x: &[T; WIDTH]) -> [T; WIDTH] {
    let (mut out, mut n) = ([T::default(); WIDTH], 0);
    for (i, &x) in x.iter().enumerate() {
        out[n % WIDTH] = x;
        n += usize::from(bits >> i & 1);
    }
    out
}

#[cfg(target_arch = "x86_64")]
mod x86 {
    use std::arch::x86_64::{__m256, __m256i, _CMP_LE_OQ};

    use bytemuck::cast;
    use pulp::NullaryFnOnce;
    use pulp::x86::V3;

    use super::{Lanes, Task, WIDTH};

    pub struct On<L, T>(pub L, pub T);

    impl<L: Lanes, T: Task> NullaryFnOnce for On<L, T> {
        type Output = T::Output;

        #[inline(always)]
        fn call(self) -> T::Output {
            self.1.run(self.0)
        }
    }

    /// For each set of bits the lanes to take, a byte each.
    static FRONT: [[u8; WIDTH]; 256] = {
        let mut table = [[0; WIDTH]; 256];
        let mut bits = 0;
        while bits < 256 {
            let (mut lane, mut n) = (0, 0);
            while lane < WIDTH {
                if bits >> lane & 1 == 1 {
                    table[bits][n] = lane as u8;
                    n += 1;
                }
                lane += 1;
            }
            bits += 1;
        }
        table
    };

    #[inline(always)]
    fn front(on: V3, bits: u8, x: __m256) -> __m256 {
        let lanes: [[u8; WIDTH]; 2] = [FRONT[usize::from(bits)], [0; WIDTH]];
        let lanes: __m256i = on.avx2._mm256_cvtepu8_epi32(cast(lanes));
        on.avx2._mm256_permutevar8x32_ps(x, lanes)
    }

    impl Lanes for V3 {
        type F32 = __m256;

        #[inline(always)]
        fn splat(self, x: f32) -> __m256 {
            self.avx._mm256_set1_ps(x)
        }

        #[inline(always)]
        fn load(self, x: &[f32; WIDTH]) -> __m256 {
            cast(*x)
        }

        #[inline(always)]
        fn store(self, x: __m256) -> [f32; WIDTH] {
            cast(x)
        }

        #[inline(always)]
        fn add(self, a: __m256, b: __m256) -> __m256 {
            self.avx._mm256_add_ps(a, b)
        }

        #[inline(always)]
        fn sub(self, a: __m256, b: __m256) -> __m256 {
            self.avx._mm256_sub_ps(a, b)
        }

        #[inline(always)]
        fn mul(self, a: __m256, b: __m256) -> __m256 {
            self.avx._mm256_mul_ps(a, b)
        }

        #[inline(always)]
        fn max(self, a: __m256, b: __m256) -> __m256 {
            self.avx._mm256_max_ps(a, b)
        }

        #[inline(always)]
        fn le(self, a: __m256, b: __m256) -> u8 {
            self.avx._mm256_movemask_ps(self.avx._mm256_cmp_ps::<_CMP_LE_OQ>(a, b)) as u8
        }

        #[inline(always)]
        fn compress(self, bits: u8, x: __m256) -> [f32; WIDTH] {
            cast(front(self, bits, x))
        }

        #[inline(always)]
        fn compress_u32(self, bits: u8, x: &[u32; WIDTH]) -> [u32; WIDTH] {
            cast(front(self, bits, cast(*x)))
        }

        #[inline(always)]
        fn least(self, bits: u8, x: __m256) -> (f32, u32) {
            let bit: __m256i = cast([1i32, 2, 4, 8, 16, 32, 64, 128]);
            let set = self.avx2._mm256_and_si256(self.avx._mm256_set1_epi32(i32::from(bits)), bit);
            let set: __m256 = cast(self.avx2._mm256_cmpeq_epi32(set, bit));
            let x = self.avx._mm256_blendv_ps(self.splat(f32::INFINITY), x, set);
            // The least of all lanes, in all lanes.
            let m = self.avx._mm256_min_ps(x, self.avx._mm256_permute2f128_ps::<1>(x, x));
            let m = self.avx._mm256_min_ps(m, self.avx._mm256_permute_ps::<0b01_00_11_10>(m));
            let m = self.avx._mm256_min_ps(m, self.avx._mm256_permute_ps::<0b10_11_00_01>(m));
            let at = self.le(x, m);
            (self.store(m)[0], u32::from(at).trailing_zeros())
        }
    }
}
