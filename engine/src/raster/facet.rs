//! Refraction by planar facets, as a second eye: what a facet of a gem shows is what a rasterizer draws from there.
//!
//! Source: S. Guy, C. Soler, "Graphics Gems Revisited: Fast and Physically-Based Rendering of Gemstones", ACM TOG 23(3) (SIGGRAPH), 2004: refracted rays of an eye are taken for those from one point, which is moved along the facet's normal; facets
//! that mirror within mirror that point, which is exact.
//!
//! The point is the one whose ray to the facet's middle is the refracted one. Away from the middle rays of a plane do not go through one point: the error grows with the facet's angle seen from the eye, and is greatest
//! in the plane of incidence. In the limit of small facets, or of far eyes, there is none. Deterministic. A yardstick for searches along refracted rays.

use glam::DVec3;

use crate::catalogue::{Bias, Role, Row, Source};

/// Sines of angles of incidence below which light counts as perpendicular.
const STRAIGHT: f64 = 1e-9;

/// A planar facet of a body.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Facet {
    /// Its middle, metres.
    pub middle: DVec3,
    /// Unit normal, out of the body.
    pub normal: DVec3,
}

impl Facet {
    /// Where an eye's rays that are refracted into a body of so many times the index of what surrounds it seem to come from: exactly for the one through the middle. `None` for an eye that is not before the facet, and where the
    /// middle reflects all light, which an index below 1 may.
    pub fn virtual_eye(&self, eye: DVec3, index: f64) -> Option<DVec3> {
        let height = (eye - self.middle).dot(self.normal);
        let foot = eye - height * self.normal;
        let away = foot.distance(self.middle);
        if !(height > 0.0 && index > 0.0) {
            return None;
        }
        let sine = away / away.hypot(height);
        let refracted = sine / index;
        if refracted >= 1.0 {
            return None;
        }
        let depth = if sine < STRAIGHT {
            index * height
        } else {
            away * (1.0 - refracted * refracted).sqrt() / refracted
        };
        Some(foot + depth * self.normal)
    }

    /// The mirror image of a place in the facet's plane: from where light seems to come that the facet mirrors within.
    pub fn mirrored(&self, place: DVec3) -> DVec3 {
        place - 2.0 * (place - self.middle).dot(self.normal) * self.normal
    }
}

const GUY_SOLER_2004: Source = Source {
    key: "guy-soler-2004",
    authors: "S. Guy, C. Soler",
    title: "Graphics Gems Revisited: Fast and Physically-Based Rendering of Gemstones",
    venue: "ACM TOG 23(3) (SIGGRAPH)",
    year: 2004,
};

/// Rows of the catalogue.
pub(crate) const ROWS: &[Row] = &[Row {
    id: "MET-P5",
    name: "refraction by planar facets: a second eye for each",
    role: Role::Yardstick,
    limits: "Planar facets; rays away from a facet's middle err by as much as it is wide from the eye.",
    sources: &[GUY_SOLER_2004.whole()],
    bias: Some(Bias::Biased(
        "refracted rays of a facet are taken to come from one point",
    )),
    tests: &[
        "engine/src/raster/facet.rs::the_middle_is_exact_and_error_falls_with_the_facet",
        "engine/src/raster/facet.rs::facets_that_mirror_are_exact",
        "engine/src/raster/facet.rs::facets_without_a_refracted_ray_have_no_eye",
    ],
    api: &["clerestory::raster::facet::Facet"],
    ..Row::of(file!())
}];

#[cfg(test)]
mod tests {
    use super::*;
    use crate::maps::impostor::proxy::{mirrored, refracted};

    const FACET: Facet = Facet {
        middle: DVec3::new(0.2, -0.1, 0.5),
        normal: DVec3::new(0.6, 0.0, 0.8),
    };
    /// Of diamond.
    const INDEX: f64 = 2.42;

    /// A place of the facet's plane.
    fn place(u: f64, v: f64) -> DVec3 {
        let (x, y) = FACET.normal.any_orthonormal_pair();
        FACET.middle + u * x + v * y
    }

    /// An eye at an angle from the normal, radians, and a distance from the middle.
    fn eye(angle: f64, distance: f64) -> DVec3 {
        let (x, _) = FACET.normal.any_orthonormal_pair();
        FACET.middle + distance * (angle.cos() * FACET.normal + angle.sin() * x)
    }

    /// Between the refracted ray at a place and the one from the second eye, degrees.
    fn off(eye: DVec3, at: DVec3) -> f64 {
        let exact = refracted((at - eye).normalize(), FACET.normal, 1.0 / INDEX);
        let from = FACET.virtual_eye(eye, INDEX).expect("an eye");
        exact.angle_between(at - from).to_degrees()
    }

    #[test]
    fn the_middle_is_exact_and_error_falls_with_the_facet() {
        for angle in [0.0, 1e-12, 0.4, 1.0, 1.4] {
            let eye = eye(angle, 2.0);
            assert!(off(eye, FACET.middle) < 1e-5, "{angle}: {}", off(eye, FACET.middle));
            // To both sides: in the plane of incidence and across it.
            let worst = |half: f64| {
                [(half, 0.0), (-half, 0.0), (0.0, half), (0.0, -half)]
                    .map(|(u, v)| off(eye, place(u, v)))
                    .into_iter()
                    .fold(0.0, f64::max)
            };
            let [wide, half, quarter] = [0.2, 0.1, 0.05].map(worst);
            println!("{angle}: {wide:.4}° {half:.4}° {quarter:.4}°");
            assert!(half < 0.6 * wide && quarter < 0.6 * half, "{wide} {half} {quarter}");
            assert!(wide < 3.0, "{angle}: {wide}");
        }
        // The same facet from four times as far.
        assert!(off(eye(1.0, 8.0), place(0.2, 0.0)) < 0.35 * off(eye(1.0, 2.0), place(0.2, 0.0)));
        // Straight down it is the apparent depth, times the index instead of over it.
        let straight = FACET.virtual_eye(eye(0.0, 2.0), INDEX).expect("an eye");
        assert!(
            (straight - (FACET.middle + 2.0 * INDEX * FACET.normal)).length() < 1e-9,
            "{straight}"
        );
    }

    #[test]
    fn facets_that_mirror_are_exact() {
        let from = eye(0.7, 1.3);
        for at in [place(0.0, 0.0), place(0.3, -0.4), place(-1.0, 0.2)] {
            let exact = mirrored((at - from).normalize(), FACET.normal);
            let found = (at - FACET.mirrored(from)).normalize();
            assert!((exact - found).length() < 1e-12, "{exact} {found}");
        }
    }

    #[test]
    fn facets_without_a_refracted_ray_have_no_eye() {
        assert_eq!(FACET.virtual_eye(FACET.middle - FACET.normal, INDEX), None);
        assert_eq!(FACET.virtual_eye(FACET.middle, INDEX), None);
        // Out of diamond into air, beyond the critical angle.
        assert_eq!(FACET.virtual_eye(eye(0.5, 1.0), 1.0 / INDEX), None);
        assert!(FACET.virtual_eye(eye(0.3, 1.0), 1.0 / INDEX).is_some());
        assert_eq!(FACET.virtual_eye(eye(0.3, 1.0), f64::NAN), None);
    }
}
