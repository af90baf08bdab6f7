//! Closest approach of a ray to a point, and ray/sphere intersection.
//!
//! The squared distance comes from the vector that is left after projection, not from |δ|² − t², which cancels; the half chord then
//! follows from (r − d)(r + d) (E. Haines et al., "Precision Improvements for Ray/Sphere Intersection", Ray Tracing Gems, 2019, ch. 7).
//! GLSL functions of the same names are in `accel/sphere.glsl`.

use glam::DVec3;

use crate::catalogue::{Role, Row, sources};

/// Where a ray is closest to a point.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ClosestApproach {
    /// Ray parameter of the closest point.
    pub t: f64,
    /// Squared distance there, m².
    pub distance_squared: f64,
}

/// Closest approach of a ray to `centre`; the direction has unit length.
pub fn closest_approach(origin: DVec3, direction: DVec3, centre: DVec3) -> ClosestApproach {
    let delta = centre - origin;
    let t = delta.dot(direction);
    ClosestApproach {
        t,
        distance_squared: (delta - t * direction).length_squared(),
    }
}

/// Parameters of entry and exit of a ray's line into a sphere; the direction has unit length. Touching counts; a radius of zero or
/// less, and NaN anywhere, is a miss.
pub fn intersect_sphere(origin: DVec3, direction: DVec3, centre: DVec3, radius: f64) -> Option<[f64; 2]> {
    let approach = closest_approach(origin, direction, centre);
    let distance = approach.distance_squared.sqrt();
    let chord_squared = (radius - distance) * (radius + distance);
    if !(radius > 0.0 && chord_squared >= 0.0) {
        return None;
    }
    let half = chord_squared.sqrt();
    Some([approach.t - half, approach.t + half])
}

/// Rows of the catalogue.
pub(crate) const ROWS: &[Row] = &[Row {
    id: "PM-I-1",
    name: "ray/sphere hit and closest approach",
    role: Role::Kernel,
    limits: "One sphere at a time: no index holds spheres, and no kernel of the engine includes it, so that it serves hosts' kernels alone.",
    sources: &[sources::HAINES_2019.whole()],
    shaders: &["shaders/accel/sphere.glsl"],
    tests: &[
        "engine/src/accel/sphere.rs::approach_matches_the_definition",
        "engine/src/accel/sphere.rs::spheres_are_hit_from_outside_inside_and_behind_and_touched_once",
        "tests/tests/twins/geometry.rs::spheres_agree_with_their_twins",
    ],
    api: &[
        "clerestory::accel::sphere::intersect_sphere",
        "clerestory::accel::sphere::closest_approach",
    ],
    ..Row::of(file!())
}];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn approach_matches_the_definition() {
        let direction = DVec3::new(2.0, -1.0, 2.0) / 3.0;
        let normal = DVec3::new(1.0, 2.0, 0.0) / 5f64.sqrt();
        for (t, d) in [(0.5, 1e-3), (-2.0, 1.0), (1e5, 1e-2), (0.0, 0.0)] {
            let origin = DVec3::new(0.3, -7.0, 2.0);
            let approach = closest_approach(origin, direction, origin + t * direction + d * normal);
            // t and the residual vector carry rounding of size ε|δ|; 8ε covers dot product and subtraction.
            let bound = 8.0 * f64::EPSILON * (10.0 + f64::abs(t));
            assert!((approach.t - t).abs() <= bound);
            assert!((approach.distance_squared.sqrt() - d).abs() <= bound);
        }
    }

    #[test]
    fn spheres_are_hit_from_outside_inside_and_behind_and_touched_once() {
        let z = DVec3::Z;
        let hit = |x: f64, o: f64, r: f64| intersect_sphere(DVec3::new(x, 0.0, o), z, DVec3::ZERO, r);
        assert_eq!(hit(0.0, -3.0, 1.0), Some([2.0, 4.0]));
        assert_eq!(hit(0.0, 0.0, 1.0), Some([-1.0, 1.0]));
        assert_eq!(hit(0.0, 3.0, 1.0), Some([-4.0, -2.0]));
        assert_eq!(hit(1.0, -3.0, 1.0), Some([3.0, 3.0]));
        assert_eq!(hit(1.0 + f64::EPSILON, -3.0, 1.0), None);
        assert_eq!(hit(0.0, -3.0, 0.0), None);
        assert_eq!(hit(0.0, -3.0, -1.0), None);
        assert_eq!(hit(f64::NAN, -3.0, 1.0), None);
        assert_eq!(hit(0.0, -3.0, f64::NAN), None);
    }
}
