//! Photon planes: two flights of a photon through a homogeneous medium, and where rays meet what they span. Twin of `techniques/photon_mapping/photon_event.glsl`.
//!
//! Source: B. Bitterli and W. Jarosz, "Beyond Points and Beams: Higher-Dimensional Photon Samples for Volumetric Light Transport", ACM TOG 36(4), 2017: the distances
//! of both flights and that along the eye's ray are integrated over, which leaves a Jacobian in the place of a kernel, L = Σ τ(t) σs² p(ω₂, −v) Φ / |v · (ω₁ × ω₂)|. Flights are
//! short: each ends by chance, as in the band that comes farthest of those that scatter.
//!
//! Guarantees: nothing is blurred; boxes hold their planes but for rounding. Limits: a ray in the plane itself has no bound, and little of a plane's area:
//! the variance of what one ray sees grows with the logarithm of the number of planes. Under narrow phase functions nearly all light comes by flights that are nearly parallel to each other and to
//! rays, so that pictures of some dozens of passes are too dark. Where eye paths go on ([`volume_paths`](crate::techniques::photon_mapping::PhotonSettings::volume_paths)) a plane has the share of its
//! light that makes up for the volume that stands below it ([`photon_share`](crate::transport::photon_share)): the limits are then those of light that a mirror scatters first, which is the planes' alone.

use super::event::{PhotonBeam, pack_beam, unpack_beam};
use crate::gpu::shaders::constants::WIDE_QUARTERS;
use glam::{DVec3, Vec3};

/// Words of a record of a map that has planes, or collisions, beside beams: 48 bytes.
pub type WideWords = [[u32; 4]; WIDE_QUARTERS as usize];

/// Two flights of a photon.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PhotonPlane {
    /// Where the first flight begins, m.
    pub start: Vec3,
    /// The first flight, m.
    pub first: Vec3,
    /// The second one, from wherever on the first one, m.
    pub second: Vec3,
    /// At the start.
    pub flux: Vec3,
    /// Their medium, by the scene's numbers.
    pub medium: u32,
    /// Scatterings before the end of the second flight, at most [`PHOTON_BOUNCE_MAX`](crate::gpu::shaders::constants::PHOTON_BOUNCE_MAX).
    pub bounce: u32,
    /// What tells how far its light was from its first scattering, as [`distance2_in_plane`](crate::transport::photon_share::distance2_in_plane) has it; 0 where eye paths have no share of it.
    pub light: f32,
}

/// The words of a plane.
pub fn pack_plane(p: &PhotonPlane) -> WideWords {
    let [q0, q1] = pack_beam(&PhotonBeam {
        start: p.start,
        end: p.start + p.first,
        flux: p.flux,
        medium: p.medium,
        bounce: p.bounce,
    });
    let [x, y, z] = p.second.to_array().map(f32::to_bits);
    [q0, q1, [x, y, z, p.light.to_bits()]]
}

/// The plane of these words.
pub fn unpack_plane(words: &WideWords) -> PhotonPlane {
    let [q0, q1, [x, y, z, light]] = *words;
    let beam = unpack_beam(&[q0, q1]);
    PhotonPlane {
        start: beam.start,
        first: beam.end - beam.start,
        second: Vec3::from_array([x, y, z].map(f32::from_bits)),
        flux: beam.flux,
        medium: beam.medium,
        bounce: beam.bounce,
        light: f32::from_bits(light),
    }
}

/// Whether the words are those of a plane, rather than of a beam in a map that has both.
pub fn is_plane(words: &WideWords) -> bool {
    unpack_plane(words).second != Vec3::ZERO
}

/// The ends of a plane's box, from those of its first flight.
pub(super) fn plane_corners(second: Vec3, a: Vec3, b: Vec3) -> [Vec3; 2] {
    let (c, d) = (a + second, b + second);
    [a.min(b).min(c.min(d)), a.max(b).max(c.max(d))]
}

/// Extinction of the band through which light comes farthest, of those with any, 1/m.
pub fn least_extinction(sigma_t: DVec3) -> f64 {
    let extinctions = sigma_t.to_array().into_iter().filter(|sigma| *sigma != 0.0);
    extinctions.fold(f64::INFINITY, f64::min)
}

/// Extinction with which the flights of planes end: of the band through which light comes farthest, of those that scatter, 1/m; infinite where none does.
pub fn plane_extinction(sigma_s: DVec3, sigma_t: DVec3) -> f64 {
    least_extinction(DVec3::select(sigma_s.cmpeq(DVec3::ZERO), DVec3::ZERO, sigma_t))
}

/// Where a ray meets the plane that two flights span.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PlaneMeeting {
    /// Distance along the ray, m.
    pub t: f64,
    /// Shares of the flights.
    pub along: [f64; 2],
    /// Volume of the box that the ray's direction spans with them, m²; 0 where the ray lies in the plane, and nothing else is known.
    pub jacobian: f64,
}

/// Where a ray meets the plane from `start` on that two flights span.
pub fn meet_plane(origin: DVec3, direction: DVec3, start: DVec3, first: DVec3, second: DVec3) -> PlaneMeeting {
    let across = first.cross(second);
    let jacobian = direction.dot(across);
    if jacobian == 0.0 {
        return PlaneMeeting {
            t: 0.0,
            along: [-1.0; 2],
            jacobian: 0.0,
        };
    }
    let delta = origin - start;
    let shares = [second.cross(direction), direction.cross(first)].map(|normal| delta.dot(normal) / jacobian);
    PlaneMeeting {
        t: -delta.dot(across) / jacobian,
        along: shares,
        jacobian: jacobian.abs(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gpu::shaders::constants::PHOTON_BOUNCE_MAX;
    use crate::scene::Phase;
    use crate::techniques::photon_mapping::volume::event::event_box;
    use crate::test_random::Random;
    use crate::transport::phase::phase_function;
    use std::f64::consts::PI;

    fn plane_of(random: &mut Random, bounce: u32) -> PhotonPlane {
        PhotonPlane {
            start: random.vector() * 4.0,
            first: random.vector() * 2.0,
            second: random.vector() * 3.0,
            flux: Vec3::new(random.unit(), random.unit(), random.unit()),
            medium: bounce * 3,
            bounce,
            light: random.signed(),
        }
    }

    #[test]
    fn planes_come_back_and_their_boxes_hold_them() {
        let mut random = Random(12);
        for bounce in 0..70 {
            let plane = plane_of(&mut random, bounce);
            let words = pack_plane(&plane);
            assert!(is_plane(&words) && size_of_val(&words) == 48);
            let back = unpack_plane(&words);
            assert_eq!(
                (back.start, back.second, back.medium, back.light),
                (plane.start, plane.second, plane.medium, plane.light)
            );
            assert_eq!(back.bounce, bounce.min(PHOTON_BOUNCE_MAX));
            assert!((back.first - plane.first).abs().max_element() < 1e-6);
            assert!((back.flux - plane.flux).abs().max_element() <= plane.flux.max_element() / 511.0);
            let end = plane.start + plane.first;
            let [low, high] = plane_corners(plane.second, plane.start, end);
            let bounds = event_box(low, high, 0.0);
            for i in 0..=8 {
                for j in 0..=8 {
                    let at = plane.start + plane.first * (i as f32 / 8.0) + plane.second * (j as f32 / 8.0);
                    assert!(
                        bounds.lower.cmple(at).all() && bounds.upper.cmpge(at).all(),
                        "{at} {bounds:?}"
                    );
                }
            }
            let beam = pack_plane(&PhotonPlane {
                second: Vec3::ZERO,
                ..plane
            });
            assert!(!is_plane(&beam), "whatever its light is");
        }
    }

    #[test]
    fn rays_meet_planes_where_both_are() {
        let mut random = Random(13);
        for _ in 0..1000 {
            let [origin, start, first, second] = [0; 4].map(|_| random.vector().as_dvec3());
            let direction = random.direction().as_dvec3().normalize();
            let met = meet_plane(origin, direction, start, first, second);
            assert!((met.jacobian - direction.dot(first.cross(second)).abs()).abs() < 1e-15);
            let by_ray = origin + met.t * direction;
            let by_plane = start + met.along[0] * first + met.along[1] * second;
            assert!(by_ray.distance(by_plane) < 1e-12 / met.jacobian, "{met:?}");
        }
        assert_eq!(
            meet_plane(DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::X, DVec3::Z).jacobian,
            0.0
        );
        // Bands without extinction are none that flights end in.
        assert_eq!(least_extinction(DVec3::new(0.0, 3.0, 2.0)), 2.0);
        // Nor those that scatter nothing.
        let (sigma_s, sigma_t) = (DVec3::new(0.5, 0.0, 1.0), DVec3::new(2.0, 0.1, 1.5));
        assert_eq!(plane_extinction(sigma_s, sigma_t), 1.5);
    }

    #[test]
    fn eye_paths_and_planes_know_one_volume() {
        let mut random = Random(14);
        for _ in 0..1000 {
            let [origin, start, first, second] = [0; 4].map(|_| random.vector().as_dvec3());
            let ray = random.direction().as_dvec3().normalize();
            let of_plane = meet_plane(origin, ray, start, first, second).jacobian / (first.length() * second.length());
            // An eye path goes the second flight back, and then looks back along the first.
            let crossing = ray.cross(-second.normalize());
            let of_path = crossing.dot(-first.normalize()).abs();
            assert!((of_plane - of_path).abs() < 1e-13, "{of_plane} {of_path}");
        }
    }

    #[test]
    fn planes_have_the_double_scattering_integral() {
        // A laser of 1 W from `start` along x, through a medium of coefficients 0.3 and 0.2, and a ray of 3 m along z.
        let (sigma_s, sigma_t) = (0.3, 0.5);
        let phase = Phase::HenyeyGreenstein { g: 0.4 };
        let (start, laser, ray) = (DVec3::new(-1.0, 0.7, 1.2), DVec3::X, DVec3::Z);
        let (reach, t_max) = (2.5, 3.0);
        // Scattered at any two places of both, by the rule of midpoints: the laser's light, and what the distance between them leaves of it.
        let n = 600;
        let place = |i: i32| (f64::from(i) + 0.5) / f64::from(n);
        let mut expected = 0.0;
        for i in 0..n {
            for j in 0..n {
                let (t0, t) = (place(i) * reach, place(j) * t_max);
                let way = t * ray - (start + t0 * laser);
                let between = way.length();
                let w = way / between;
                let turns = phase_function(phase, laser, w) * phase_function(phase, w, -ray);
                expected += sigma_s * sigma_s * turns * (-sigma_t * (t0 + between + t)).exp() / (between * between);
            }
        }
        expected *= reach * t_max / f64::from(n * n);
        // Planes of all second directions, of flights that come as far as the mean says: each once, with the density of its direction.
        let (rings, around) = (1500, 1500);
        let mut found = 0.0;
        for i in 0..rings {
            for j in 0..around {
                let z = 2.0 * (f64::from(i) + 0.5) / f64::from(rings) - 1.0;
                let phi = 2.0 * PI * (f64::from(j) + 0.5) / f64::from(around);
                let r = (1.0 - z * z).sqrt();
                let w = DVec3::new(r * phi.cos(), r * phi.sin(), z);
                let far = 60.0;
                let met = meet_plane(DVec3::ZERO, ray, start, reach * laser, far * w);
                let inside = met.along.iter().all(|share| (0.0..1.0).contains(share));
                if met.jacobian > 0.0 && inside && met.t > 0.0 && met.t < t_max {
                    // The probability that both flights come as far is the transmittance.
                    let along = met.along[0] * reach + met.along[1] * far;
                    let left = (-sigma_t * (along + met.t)).exp();
                    let density = phase_function(phase, laser, w);
                    let light = reach * far / met.jacobian * sigma_s * sigma_s * phase_function(phase, w, -ray) * left;
                    found += density * light;
                }
            }
        }
        found *= 4.0 * PI / f64::from(rings * around);
        // The rims of what rays meet go through cells of directions.
        assert!((found / expected - 1.0).abs() < 3e-3, "{found} {expected}");
    }
}
