//! Spherical triangles and polygons, for maps that are central projections in parts: straight edges there are arcs of great circles.
//!
//! Source: A. Van Oosterom and J. Strackee, "The Solid Angle of a Plane Triangle", IEEE TBME 30(2), 1983.

use glam::{DVec2, DVec3};

/// Corners of a rectangle that three lines have cut.
const MAX_CORNERS: usize = 8;

/// Solid angle of a triangle as seen from the origin, sr; its corners are of any length.
pub fn triangle_solid_angle(a: DVec3, b: DVec3, c: DVec3) -> f64 {
    // The plane's area from differences, which are exact where the corners are.
    let volume = (b - a).cross(c - a).dot(a).abs();
    let (la, lb, lc) = (a.length(), b.length(), c.length());
    2.0 * volume.atan2(la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb)
}

/// A convex polygon in a plane.
#[derive(Clone, Copy)]
pub(super) struct Polygon {
    corners: [DVec2; MAX_CORNERS],
    count: usize,
}

impl Polygon {
    pub fn rectangle(lower: DVec2, upper: DVec2) -> Self {
        let mut corners = [DVec2::ZERO; MAX_CORNERS];
        corners[..4].copy_from_slice(&[lower, DVec2::new(upper.x, lower.y), upper, DVec2::new(lower.x, upper.y)]);
        Self { corners, count: 4 }
    }

    /// The part where `normal · p ≥ offset`.
    pub fn clipped(&self, normal: DVec2, offset: f64) -> Self {
        let mut kept = Self {
            corners: [DVec2::ZERO; MAX_CORNERS],
            count: 0,
        };
        let mut push = |p: DVec2| {
            if kept.count < MAX_CORNERS {
                kept.corners[kept.count] = p;
                kept.count += 1;
            }
        };
        for i in 0..self.count {
            let (p, q) = (self.corners[i], self.corners[(i + 1) % self.count]);
            let (hp, hq) = (normal.dot(p) - offset, normal.dot(q) - offset);
            if hp >= 0.0 {
                push(p);
            }
            if (hp > 0.0 && hq < 0.0) || (hp < 0.0 && hq > 0.0) {
                push(p + (q - p) * (hp / (hp - hq)));
            }
        }
        kept
    }

    /// Its solid angle when `lift` says where its points are in space.
    pub fn solid_angle(&self, lift: impl Fn(DVec2) -> DVec3) -> f64 {
        if self.count < 3 {
            return 0.0;
        }
        let at = |i: usize| lift(self.corners[i]);
        (1..self.count - 1)
            .map(|i| triangle_solid_angle(at(0), at(i), at(i + 1)))
            .sum()
    }
}

/// Derivatives of p/‖p‖ from those of p.
pub(super) fn derivatives_of_projection(p: DVec3, by: [DVec3; 2]) -> [DVec3; 2] {
    let length = p.length();
    let d = p / length;
    by.map(|v| (v - d * d.dot(v)) / length)
}
