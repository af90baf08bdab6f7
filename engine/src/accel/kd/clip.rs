//! The box of the part of a triangle that lies in a node.
//!
//! Source: V. Havran and J. Bittner, "On Improving KD-Trees for Ray Shooting", WSCG 2002 (split clipping); I. Sutherland and G. Hodgman,
//! "Reentrant Polygon Clipping", CACM 17(1), 1974.

use super::bounds::Bounds;
use crate::accel::Aabb;
use glam::{DVec3, Vec3};

/// A triangle has three corners and gains one at most with each of six planes.
const MAX_CORNERS: usize = 9;

/// A convex polygon.
struct Polygon {
    corners: [DVec3; MAX_CORNERS],
    count: usize,
}

impl Polygon {
    fn push(&mut self, corner: DVec3) {
        if self.count < MAX_CORNERS {
            self.corners[self.count] = corner;
            self.count += 1;
        }
    }

    /// Keeps what lies on one side of a plane, which is closed.
    fn clip(&self, axis: usize, plane: f64, above: bool) -> Self {
        let mut kept = Self {
            corners: self.corners,
            count: 0,
        };
        let height = |corner: DVec3| {
            if above {
                corner[axis] - plane
            } else {
                plane - corner[axis]
            }
        };
        for i in 0..self.count {
            let (from, to) = (self.corners[i], self.corners[(i + 1) % self.count]);
            let (before, after) = (height(from), height(to));
            if before >= 0.0 {
                kept.push(from);
            }
            if (before > 0.0 && after < 0.0) || (before < 0.0 && after > 0.0) {
                let mut crossing = from + (to - from) * (before / (before - after));
                crossing[axis] = plane;
                kept.push(crossing);
            }
        }
        kept
    }
}

/// The box of `triangle` within `node`, rounded outward to f32 but not beyond the node; `None` where they do not meet.
pub fn clipped_bounds(triangle: &[Vec3; 3], node: &Aabb) -> Option<Aabb> {
    let bounds = Bounds::from(*node);
    let mut polygon = Polygon {
        corners: [DVec3::ZERO; MAX_CORNERS],
        count: 0,
    };
    for corner in triangle {
        polygon.push(corner.as_dvec3());
    }
    for axis in 0..3 {
        for (plane, above) in [(bounds.lower[axis], true), (bounds.upper[axis], false)] {
            polygon = polygon.clip(axis, plane, above);
        }
    }
    let corners = &polygon.corners[..polygon.count];
    let first = *corners.first()?;
    let (lower, upper) = corners
        .iter()
        .fold((first, first), |(lower, upper), c| (lower.min(*c), upper.max(*c)));
    let mut clipped = *node;
    for axis in 0..3 {
        clipped.lower[axis] = clipped.lower[axis].max(below(lower[axis]));
        clipped.upper[axis] = clipped.upper[axis].min(above(upper[axis]));
    }
    Some(clipped.without_negative_zero())
}

/// The greatest f32 that is not above.
fn below(x: f64) -> f32 {
    let rounded = x as f32;
    if f64::from(rounded) > x {
        rounded.next_down()
    } else {
        rounded
    }
}

/// The least f32 that is not below.
fn above(x: f64) -> f32 {
    let rounded = x as f32;
    if f64::from(rounded) < x {
        rounded.next_up()
    } else {
        rounded
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn node(lower: f32, upper: f32) -> Aabb {
        Aabb {
            lower: Vec3::splat(lower),
            upper: Vec3::splat(upper),
        }
    }

    #[test]
    fn a_diagonal_edge_is_cut_where_it_leaves_the_node() {
        let triangle = [Vec3::ZERO, Vec3::new(4.0, 4.0, 0.0), Vec3::new(4.0, 0.0, 0.0)];
        let clipped = clipped_bounds(&triangle, &node(0.0, 1.0)).unwrap();
        assert_eq!((clipped.lower, clipped.upper), (Vec3::ZERO, Vec3::new(1.0, 1.0, 0.0)));
        let above = Aabb {
            lower: Vec3::new(0.0, 2.0, 0.0),
            upper: Vec3::new(3.0, 3.0, 1.0),
        };
        let clipped = clipped_bounds(&triangle, &above).unwrap();
        assert_eq!(clipped.lower, Vec3::new(2.0, 2.0, 0.0));
        // Its box meets this node, the triangle itself does not.
        let beside = Aabb {
            lower: Vec3::new(0.0, 1.0, 0.0),
            upper: Vec3::new(0.5, 2.0, 1.0),
        };
        assert!(clipped_bounds(&triangle, &beside).is_none());
    }

    #[test]
    fn touching_counts_and_rounding_goes_outward() {
        let triangle = [Vec3::ZERO, Vec3::X, Vec3::Y];
        let touching = Aabb {
            lower: Vec3::new(1.0, 0.0, 0.0),
            upper: Vec3::new(2.0, 1.0, 1.0),
        };
        let clipped = clipped_bounds(&triangle, &touching).unwrap();
        assert_eq!((clipped.lower, clipped.upper), (Vec3::X, Vec3::X));
        let thin = [Vec3::ZERO, Vec3::new(3.0, 1.0, 0.0), Vec3::new(3.0, 0.0, 0.0)];
        let clipped = clipped_bounds(&thin, &node(0.0, 1.0)).unwrap();
        assert!(f64::from(clipped.upper.y) >= 1.0 / 3.0 && f64::from(clipped.upper.y.next_down()) < 1.0 / 3.0);
    }
}
