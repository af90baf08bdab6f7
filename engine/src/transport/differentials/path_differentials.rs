//! Path differentials: derivatives of a photon by every parameter of its path, the reference for re-emissions of photon differentials.
//!
//! Source: Suykens and Willems, "Path Differentials and Applications" (2001), §3 and §4, with the global parameter steps that Interactive
//! Manycore Photon Mapping (2011), §3.1.2.5 describes. Each scattering into a sampled direction adds two parameters in \[0, 1\], in
//! which n photons are n^(−1/m) apart when there are m of them; the footprint is the Minkowski sum of the m vectors. Storage grows with
//! the path and the footprint of long paths with n^(−2/m), which is why the engine's photons carry [`Differentials`] instead. Guarantee:
//! for m = 2 the footprint is that of photon differentials.

use super::{
    Differentials, emission_differentials, reflect_differentials, refract_differentials, transfer_differentials,
};
use crate::catalogue::{Role, Row, sources};
use glam::DVec3;
use std::f64::consts::PI;

/// Most parameters: emission and two re-emissions.
pub const PATH_PARAMETERS_MAX: usize = 6;

/// Derivatives by m ≤ [`PATH_PARAMETERS_MAX`] parameters, two from each sampled direction.
#[derive(Debug, Clone, PartialEq)]
pub struct PathDifferentials {
    pairs: Vec<Differentials>,
}

/// By parameters of \[0, 1\]², which directions of density `pdf` have derivatives of area 1/`pdf` by.
fn unit_parameters(direction: DVec3, pdf: f64) -> Differentials {
    emission_differentials(direction, pdf / (4.0 * PI))
}

impl PathDifferentials {
    /// Of a point that emits with density `pdf` per solid angle.
    pub fn emission(direction: DVec3, pdf: f64) -> Self {
        Self {
            pairs: vec![unit_parameters(direction, pdf)],
        }
    }

    /// Number of parameters m.
    pub fn parameters(&self) -> usize {
        2 * self.pairs.len()
    }

    /// After the distance `t` along `w` to a surface of geometric normal `n`.
    pub fn transfer(&mut self, t: f64, w: DVec3, n: DVec3) {
        for d in &mut self.pairs {
            *d = transfer_differentials(d, t, w, n);
        }
    }

    /// Mirror reflection; `normal_derivatives` gives the changes of `n` for a pair of parameters.
    pub fn reflect(&mut self, w: DVec3, n: DVec3, normal_derivatives: impl Fn(&Differentials) -> [DVec3; 2]) {
        for d in &mut self.pairs {
            *d = reflect_differentials(d, w, n, normal_derivatives(d));
        }
    }

    /// Refraction, as [`refract_differentials`].
    pub fn refract(&mut self, w: DVec3, n: DVec3, eta: f64, normal_derivatives: impl Fn(&Differentials) -> [DVec3; 2]) {
        for d in &mut self.pairs {
            *d = refract_differentials(d, w, n, eta, normal_derivatives(d));
        }
    }

    /// Scattering about `n` into the sampled `direction` of density `pdf`, which adds two parameters.
    ///
    /// The direction turns with the normal when earlier parameters change. `false`, and nothing done, when there are
    /// [`PATH_PARAMETERS_MAX`] parameters already.
    #[must_use]
    pub fn scatter(
        &mut self,
        n: DVec3,
        direction: DVec3,
        pdf: f64,
        normal_derivatives: impl Fn(&Differentials) -> [DVec3; 2],
    ) -> bool {
        if self.parameters() >= PATH_PARAMETERS_MAX {
            return false;
        }
        for d in &mut self.pairs {
            let [dn1, dn2] = normal_derivatives(d);
            d.w1 = n.cross(dn1).cross(direction);
            d.w2 = n.cross(dn2).cross(direction);
        }
        self.pairs.push(unit_parameters(direction, pdf));
        true
    }

    /// The m vectors whose Minkowski sum is the footprint of one of n photons, m.
    pub fn footprint(&self, photons: f64) -> Vec<DVec3> {
        let step = photons.powf(-1.0 / self.parameters() as f64);
        self.pairs.iter().flat_map(|d| [step * d.z1, step * d.z2]).collect()
    }

    /// Area of the footprint, m²: of a sum of segments that lie in a plane it is that of all parallelograms of two of them.
    pub fn footprint_area(&self, photons: f64) -> f64 {
        let v = self.footprint(photons);
        (0..v.len())
            .flat_map(|i| (0..i).map(move |k| (i, k)))
            .map(|(i, k)| v[i].cross(v[k]).length())
            .sum()
    }
}

/// Rows of the catalogue.
pub(crate) const ROWS: &[Row] = &[Row {
    id: "PM-PD-8",
    name: "path differentials (reference)",
    role: Role::Yardstick,
    limits: "Storage grows with the path: a reference for the footprints that photons carry.",
    sources: &[
        sources::SUYKENS_WILLEMS_2001.whole(),
        sources::FABIANOWSKI_2011.at("§3.1.2.5"),
    ],
    tests: &[
        "engine/src/transport/differentials/path_differentials.rs::two_parameters_are_photon_differentials",
        "engine/src/transport/differentials/path_differentials.rs::parallelograms_fill_the_footprint",
        "engine/src/transport/differentials/path_differentials.rs::scattering_derivatives_agree_with_finite_differences",
    ],
    api: &["clerestory::transport::differentials::path_differentials::PathDifferentials"],
    ..Row::of(file!())
}];

#[cfg(test)]
mod tests {
    use super::super::{diffuse_reemission, footprint_side};
    use super::*;
    use crate::transport::testing::random3;
    use crate::transport::warp::{
        UNIFORM_SPHERE_PDF, cosine_hemisphere_pdf, square_to_cosine_hemisphere, square_to_sphere,
    };

    const FLAT: fn(&Differentials) -> [DVec3; 2] = |_| [DVec3::ZERO; 2];

    #[test]
    fn two_parameters_are_photon_differentials() {
        for i in 0..100 {
            let w = square_to_sphere(random3(i, 31).truncate());
            let n = square_to_sphere(random3(i, 32).truncate());
            if w.dot(n).abs() < 0.05 {
                continue;
            }
            let photons = 1e5;
            let mut path = PathDifferentials::emission(w, UNIFORM_SPHERE_PDF);
            path.transfer(2.0, w, n);
            let photon = transfer_differentials(&emission_differentials(w, UNIFORM_SPHERE_PDF), 2.0, w, n);
            let area = 4.0 * PI / photons * footprint_side(&photon).powi(2);
            assert!((path.footprint_area(photons) / area - 1.0).abs() < 1e-12);
        }
    }

    #[test]
    fn parallelograms_fill_the_footprint() {
        // Share of random points that lie in the sum of three segments, by its faces' half-planes, against the sum of parallelograms.
        let mut path = PathDifferentials::emission(DVec3::Z, 1.0);
        path.pairs[0] = Differentials {
            z1: DVec3::new(1.0, 0.2, 0.0),
            z2: DVec3::new(-0.3, 0.8, 0.0),
            ..Differentials::default()
        };
        path.pairs.push(Differentials {
            z1: DVec3::new(0.5, 0.7, 0.0),
            ..Differentials::default()
        });
        let vectors = path.footprint(1.0);
        // Width in the direction of each vector's normal: the sum's support function.
        let inside = |x: DVec3| {
            vectors.iter().filter(|v| v.length() > 0.0).all(|v| {
                let across = v.cross(DVec3::Z);
                x.dot(across).abs() <= 0.5 * vectors.iter().map(|u| u.dot(across).abs()).sum::<f64>()
            })
        };
        let (draws, side) = (200_000u32, 4.0);
        let count = (0..draws)
            .filter(|i| {
                let u = random3(*i, 41);
                inside(DVec3::new((u.x - 0.5) * side, (u.y - 0.5) * side, 0.0))
            })
            .count();
        let share = path.footprint_area(1.0) / (side * side);
        let deviation = (share * (1.0 - share) / f64::from(draws)).sqrt();
        // Five standard deviations: false alarm 6e-7.
        assert!((count as f64 / f64::from(draws) - share).abs() < 5.0 * deviation);
    }

    #[test]
    fn scattering_derivatives_agree_with_finite_differences() {
        // Emission to a sphere, diffuse reflection there with its frame carried along, and on to a plane.
        let (centre, radius) = (DVec3::new(0.3, -0.2, 2.0), 1.0);
        let plane = DVec3::new(0.2, 0.1, 1.0).normalize();
        let meet = |x: DVec3, w: DVec3| {
            let to = centre - x;
            let along = to.dot(w);
            x + w * (along - (radius * radius - (to - along * w).length_squared()).sqrt())
        };
        let w0 = DVec3::new(0.1, 0.05, 1.0).normalize();
        let mut path = PathDifferentials::emission(w0, UNIFORM_SPHERE_PDF);
        let emitted = path.pairs[0];
        let hit = meet(DVec3::ZERO, w0);
        let n0 = (hit - centre) / radius;
        path.transfer(hit.length(), w0, n0);
        let out = (n0 + DVec3::new(0.4, 0.3, 0.0)).normalize();
        let on_sphere = |d: &Differentials| [d.z1 / radius, d.z2 / radius];
        assert!(path.scatter(n0, out, cosine_hemisphere_pdf(out.dot(n0)), on_sphere));
        let scattered = path.pairs[1];
        let to_plane = |x: DVec3, w: DVec3| x - w * ((x.dot(plane) + 1.0) / w.dot(plane));
        let end = to_plane(hit, out);
        path.transfer((end - hit).length(), out, plane);
        let trace = |p: [f64; 4]| {
            let w = (w0 + p[0] * emitted.w1 + p[1] * emitted.w2).normalize();
            let x = meet(DVec3::ZERO, w);
            let n = (x - centre) / radius;
            let turn = glam::DQuat::from_rotation_arc(n0, n);
            let local = (out + p[2] * scattered.w1 + p[3] * scattered.w2).normalize();
            to_plane(x, turn * local)
        };
        let vectors = path.footprint(1.0);
        for (k, vector) in vectors.iter().enumerate() {
            let h = 1e-5;
            let at = |s: f64| {
                let mut p = [0.0; 4];
                p[k] = s * h;
                trace(p)
            };
            let difference = (at(1.0) - at(-1.0)) / (2.0 * h);
            let error = (difference - *vector).length() / vector.length();
            assert!(error < 1e-8, "{k}: {error:e}");
        }
        assert!(path.scatter(plane, plane, 1.0, FLAT) && path.parameters() == PATH_PARAMETERS_MAX);
        assert!(!path.scatter(plane, plane, 1.0, FLAT));
    }

    #[test]
    fn reemission_stands_between_its_two_parameters_and_all_four() {
        // A diffuse bounce between parallel planes: the footprint of photon differentials is larger than what the new parameters alone
        // give for n photons, and smaller than that of all four with their wider steps.
        let photons = 1e5;
        let mut checked = 0;
        for i in 0..1000 {
            let w = square_to_cosine_hemisphere(random3(i, 51).truncate());
            let out = square_to_cosine_hemisphere(random3(i, 52).truncate());
            if w.z < 0.1 || out.z < 0.1 {
                continue;
            }
            let pdf = cosine_hemisphere_pdf(out.z);
            let (t1, t2) = (1.0 / w.z, 1.0 / out.z);
            let back = DVec3::new(out.x, out.y, -out.z);
            let mut path = PathDifferentials::emission(w, UNIFORM_SPHERE_PDF);
            path.transfer(t1, w, DVec3::Z);
            assert!(path.scatter(DVec3::Z, back, pdf, FLAT));
            path.transfer(t2, back, DVec3::Z);
            let photon = transfer_differentials(&emission_differentials(w, UNIFORM_SPHERE_PDF), t1, w, DVec3::Z);
            let photon = diffuse_reemission(&photon, back, pdf);
            let photon = transfer_differentials(&photon, t2, back, DVec3::Z);
            let area = 4.0 * PI / photons * footprint_side(&photon).powi(2);
            let own = t2 * t2 / (photons * pdf * out.z);
            assert!(own < area && area < path.footprint_area(photons), "{i}");
            checked += 1;
        }
        assert!(checked > 900, "{checked}");
    }
}
