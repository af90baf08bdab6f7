//! Axis-aligned boxes in f64, in which construction weighs and clips.

use crate::accel::Aabb;
use glam::DVec3;

/// A box.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bounds {
    /// Lower corner.
    pub lower: DVec3,
    /// Upper corner.
    pub upper: DVec3,
}

impl Bounds {
    /// Differences of the corners; zero for the empty box.
    pub fn extent(&self) -> DVec3 {
        (self.upper - self.lower).max(DVec3::ZERO)
    }

    /// Volume.
    pub fn volume(&self) -> f64 {
        let e = self.extent();
        e.x * e.y * e.z
    }

    /// Half the surface area.
    pub fn half_area(&self) -> f64 {
        let e = self.extent();
        e.x * e.y + e.y * e.z + e.z * e.x
    }

    /// The parts below and above a plane.
    pub fn split(&self, axis: usize, plane: f64) -> [Self; 2] {
        let (mut below, mut above) = (*self, *self);
        below.upper[axis] = plane;
        above.lower[axis] = plane;
        [below, above]
    }
}

impl From<Aabb> for Bounds {
    fn from(bounds: Aabb) -> Self {
        Self {
            lower: bounds.lower.as_dvec3(),
            upper: bounds.upper.as_dvec3(),
        }
    }
}
