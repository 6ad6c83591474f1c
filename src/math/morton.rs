//! Morton order in 63 bits: 21 an axis.

use glam::Vec3;

/// Cells an axis is divided into.
pub const CELLS: f32 = 2_097_152.0;

/// Spreads the low 21 bits so that two zeros follow each.
#[inline]
pub fn spread(v: u32) -> u64 {
    let mut v = u64::from(v) & 0x1f_ffff;
    v = (v | v << 32) & 0x001f_0000_0000_ffff;
    v = (v | v << 16) & 0x001f_0000_ff00_00ff;
    v = (v | v << 8) & 0x100f_00f0_0f00_f00f;
    v = (v | v << 4) & 0x10c3_0c30_c30c_30c3;
    (v | v << 2) & 0x1249_2492_4924_9249
}

/// x in the highest of each three bits.
#[inline]
pub fn interleave(cell: [u32; 3]) -> u64 {
    spread(cell[0]) << 2 | spread(cell[1]) << 1 | spread(cell[2])
}

/// A box divided into [`CELLS`] cells an axis.
#[derive(Clone, Copy, Debug, Default)]
pub struct Grid {
    min: Vec3,
    /// Cells a unit of length; 0 along an axis that is one cell.
    scale: Vec3,
}

impl Grid {
    /// Over the box from `min` to `max`. A side below 1e-30, whose inverse may overflow, is one cell.
    pub fn new(min: Vec3, max: Vec3) -> Self {
        Self { min, scale: (max - min).map(|side| if side < 1e-30 { 0.0 } else { CELLS / side }) }
    }

    /// The 63-bit Morton code of the cell of a point, or of the cell nearest to it.
    #[inline]
    pub fn key(&self, p: Vec3) -> u64 {
        let cell = ((p - self.min) * self.scale).clamp(Vec3::ZERO, Vec3::splat(CELLS - 1.0)).as_uvec3();
        interleave(cell.to_array())
    }

    /// Its longest side.
    pub fn longest_side(&self) -> f32 {
        self.scale.map(|scale| if scale > 0.0 { CELLS / scale } else { 0.0 }).max_element()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bits_land_where_they_belong() {
        for bit in 0..21 {
            for axis in 0..3 {
                let mut cell = [0; 3];
                cell[axis] = 1 << bit;
                assert_eq!(interleave(cell), 1 << (3 * bit + 2 - axis));
            }
        }
        assert_eq!(interleave([u32::MAX; 3]), (1 << 63) - 1);
    }
}
