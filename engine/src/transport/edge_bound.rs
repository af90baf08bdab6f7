//! Bounds of the geometry term G = cos cos / d² between two points that see each other, whose 1/d² no sampling of points removes.
//!
//! Two bounds are in use, and they lose different light: min(G, b) leaves edges at grazing angles alone (Kollig and Keller, "Illumination in the Presence of
//! Weak Singularities", 2006), max(d², B) in the denominator bounds the distance whatever the angles. Each is a share of G in \[0, 1\]: what it leaves out has
//! the weight of one less that share, by which other means can bring it, so that both together are unbiased. The shares take cosines to geometric
//! normals: whoever estimates the one part and whoever estimates the other must agree on them, whatever they shade by. Exactly 1 where a
//! bound does nothing. Units: b in m⁻², B in m². Twin of `transport/edge_bound.glsl`.

use crate::gpu::shaders::constants::{EDGE_DISTANCE, EDGE_GEOMETRY, EDGE_UNBOUNDED};

/// A bound.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum EdgeBound {
    /// None.
    #[default]
    Unbounded,
    /// G is this at most, m⁻².
    Geometry(f64),
    /// The squared distance counts as this at least, m².
    Distance(f64),
}

impl EdgeBound {
    /// What kernels are specialized to.
    pub(crate) fn kind(self) -> u32 {
        match self {
            Self::Unbounded => EDGE_UNBOUNDED,
            Self::Geometry(_) => EDGE_GEOMETRY,
            Self::Distance(_) => EDGE_DISTANCE,
        }
    }

    /// What the geometry term is at most, m⁻²: the greatest finite number where it is not bounded.
    pub(crate) fn geometry_most(self) -> f32 {
        match self {
            Self::Unbounded => f32::MAX,
            Self::Geometry(most) => most as f32,
            Self::Distance(least) => ((1.0 / least) as f32).min(f32::MAX),
        }
    }

    /// What they are told.
    pub(crate) fn value(self) -> f32 {
        match self {
            Self::Unbounded => 0.0,
            Self::Geometry(value) | Self::Distance(value) => value as f32,
        }
    }
}

/// Cosines at both ends over the squared distance, m⁻².
pub fn geometry_term(cos_a: f64, cos_b: f64, squared: f64) -> f64 {
    cos_a * cos_b / squared
}

/// The part of the geometry term that a bound leaves, in \[0, 1\].
pub fn bounded_share(bound: EdgeBound, cos_a: f64, cos_b: f64, squared: f64) -> f64 {
    match bound {
        EdgeBound::Unbounded => 1.0,
        EdgeBound::Geometry(most) => {
            let (cosines, most) = (cos_a * cos_b, most * squared);
            if most < cosines { most / cosines } else { 1.0 }
        }
        EdgeBound::Distance(least) if squared < least => squared / least,
        EdgeBound::Distance(_) => 1.0,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_random::Random;

    #[test]
    fn bounds_hold_and_shares_make_them() {
        let mut random = Random(5);
        for _ in 0..10_000 {
            let (a, b) = (f64::from(random.unit()), f64::from(random.unit()));
            let squared = f64::from(random.magnitude(-8, 8));
            let limit = f64::from(random.magnitude(-8, 8));
            let g = geometry_term(a, b, squared);
            let by_geometry = g * bounded_share(EdgeBound::Geometry(limit), a, b, squared);
            assert!(
                (by_geometry - g.min(limit)).abs() <= 1e-12 * g.min(limit),
                "{g} {limit}"
            );
            let by_distance = g * bounded_share(EdgeBound::Distance(limit), a, b, squared);
            let expected = a * b / squared.max(limit);
            assert!((by_distance - expected).abs() <= 1e-12 * expected, "{g} {limit}");
            assert_eq!(bounded_share(EdgeBound::Unbounded, a, b, squared), 1.0);
        }
    }

    /// In a sphere of radius 1 the term is a quarter for every two points, so that half of that leaves half of each edge: with an albedo of 0.8, what steps of compensation leave out.
    #[test]
    fn steps_leave_a_geometric_series_in_a_sphere() {
        let mut random = Random(6);
        let mut direction = || {
            let z = 2.0 * f64::from(random.unit()) - 1.0;
            let angle = std::f64::consts::TAU * f64::from(random.unit());
            let r = (1.0 - z * z).sqrt();
            glam::DVec3::new(r * angle.cos(), r * angle.sin(), z)
        };
        for _ in 0..1000 {
            let (a, b) = (direction(), direction());
            let squared = (b - a).length_squared();
            let [cos_a, cos_b] = [(a, a - b), (b, b - a)].map(|(normal, way)| normal.dot(way) / squared.sqrt());
            assert!((geometry_term(cos_a, cos_b, squared) - 0.25).abs() < 1e-12);
            let left_out = 1.0 - bounded_share(EdgeBound::Geometry(0.125), cos_a, cos_b, squared);
            for (steps, expected) in [(1, 0.4), (2, 0.16), (3, 0.064)] {
                let residual = (0.8 * left_out).powi(steps);
                assert!((residual - expected).abs() < 1e-12, "{steps}: {residual}");
            }
        }
    }

    #[test]
    fn points_at_one_place_have_a_share_that_is_a_number() {
        for bound in [EdgeBound::Geometry(3.0), EdgeBound::Distance(3.0)] {
            assert_eq!(bounded_share(bound, 1.0, 1.0, 0.0), 0.0, "{bound:?}");
        }
        // Two points of one plane lose nothing to a bound of G, which is zero there, and all to one of the distance.
        assert_eq!(bounded_share(EdgeBound::Geometry(3.0), 0.0, 0.0, 0.0), 1.0);
        assert_eq!(bounded_share(EdgeBound::Distance(3.0), 0.0, 0.0, 0.0), 0.0);
        // Edges that are long enough are whole, to the bit.
        assert_eq!(bounded_share(EdgeBound::Geometry(3.0), 1.0, 1.0, 1.0), 1.0);
        assert_eq!(bounded_share(EdgeBound::Distance(3.0), 1.0, 1.0, 3.0), 1.0);
    }
}
