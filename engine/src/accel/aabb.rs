//! Axis-aligned boxes in f32, as all indexes bound things with and kernels read them.
//!
//! Guarantee: unions are exact, by minimum and maximum; sizes are in f64, which holds a box's extents but for one rounding each.

use bytemuck::{Pod, Zeroable};
use glam::{DVec3, Vec3};

/// An axis-aligned box.
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct Aabb {
    /// Lower corner.
    pub lower: Vec3,
    /// Upper corner.
    pub upper: Vec3,
}

impl Aabb {
    /// The box that holds nothing.
    pub const EMPTY: Self = Self {
        lower: Vec3::INFINITY,
        upper: Vec3::NEG_INFINITY,
    };

    /// Smallest box around both.
    pub fn union(self, other: Self) -> Self {
        Self {
            lower: self.lower.min(other.lower),
            upper: self.upper.max(other.upper),
        }
    }

    /// Smallest box around this and a point.
    pub fn with_point(self, point: Vec3) -> Self {
        self.union(Self {
            lower: point,
            upper: point,
        })
    }

    /// The same box with one kind of zero: both have one order, but two patterns of bits, which some compare and devices need not keep.
    pub fn without_negative_zero(self) -> Self {
        Self {
            lower: self.lower + Vec3::ZERO,
            upper: self.upper + Vec3::ZERO,
        }
    }

    /// Half the surface area, m²; zero for the empty box.
    pub fn half_area(&self) -> f64 {
        let e = self.extent();
        e.x * e.y + e.y * e.z + e.z * e.x
    }

    /// Volume, m³; zero for the empty box.
    pub fn volume(&self) -> f64 {
        let e = self.extent();
        e.x * e.y * e.z
    }

    fn extent(&self) -> DVec3 {
        (self.upper.as_dvec3() - self.lower.as_dvec3()).max(DVec3::ZERO)
    }
}
