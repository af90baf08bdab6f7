//! Footprints of photons in media: how they pass and scatter there, and how wide a kernel they ask for. Twin of
//! `techniques/photon_mapping/photon_footprint.glsl`.
//!
//! A photon's two vectors span an area across its way; the distance in which as many photons collide as there are in it makes a volume of it, the reciprocal of the
//! density of collisions. Source: B. Fabianowski, "Interactive Manycore Photon Mapping", PhD thesis, Trinity College Dublin, 2011, §7.2, §7.3.1 and §7.3.2, where
//! the unit of lengths is a metre. Guarantee: no length is compared with a constant, only with the unit length.

use crate::catalogue::{Bias, Role, Row, sources};
use crate::gpu::shaders::constants::{FOOTPRINT_PASSED_MIN, LOG_SERIES_BELOW};
use crate::transport::differentials::{Differentials, reemission_differentials, roulette_differentials};
use glam::DVec3;
use std::f64::consts::PI;

/// How kernels are made from footprints.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct EventKernelSettings {
    /// Times the cube root of the volume, [`event_step`] included.
    pub spread: f64,
    /// Cube root, over that of the square of the unit length times the least mean free path, from which on kernels grow slower; 0 for none.
    pub dampening: f64,
    /// The unit of lengths, m; it scales with the scene.
    pub unit_length: f64,
    /// Least radius, m.
    pub length_min: f64,
    /// Greatest radius, m.
    pub length_max: f64,
}

/// What the cube root of a footprint's volume is multiplied by where n photons are emitted: ∛(4π/n).
pub fn event_step(photons: f64) -> f64 {
    (4.0 * PI / photons).cbrt()
}

/// ln(1 + x), also of small x.
pub fn log_of_one_plus(x: f64) -> f64 {
    if x < f64::from(LOG_SERIES_BELOW) {
        x - 0.5 * x * x
    } else {
        (1.0 + x).ln()
    }
}

/// |⟨z1, z2, w⟩| after the distance `t` along `w`: the area across the way, over that of the step, m².
pub fn footprint_across(d: &Differentials, t: f64, w: DVec3) -> f64 {
    (d.z1 + t * d.w1).cross(d.z2 + t * d.w2).dot(w).abs()
}

/// Radius of the kernel of a collision with a footprint `across`, m², which had the density `pdf` on its way, 1/m; `extinction`, 1/m, is that of the medium at its
/// densest.
pub fn event_radius(s: &EventKernelSettings, across: f64, pdf: f64, extinction: f64) -> f64 {
    let unit = s.unit_length * s.unit_length;
    let root = (across / unit * extinction / pdf).cbrt();
    let damped = if s.dampening > 0.0 {
        s.dampening * log_of_one_plus(root / s.dampening)
    } else {
        root
    };
    let radius = s.spread * (unit / extinction).cbrt() * damped;
    if across > 0.0 && pdf > 0.0 && radius < s.length_max {
        radius.max(s.length_min)
    } else if across > 0.0 {
        s.length_max
    } else {
        s.length_min
    }
}

/// After a part of the photons has gone no further.
pub fn passed_differentials(d: &Differentials, passed: f64) -> Differentials {
    roulette_differentials(d, passed.max(f64::from(FOOTPRINT_PASSED_MIN)))
}

/// After scattering into `direction` with the density `phase`, 1/sr, which a share `survival` of photons outlives: as from a point behind, so far that the expected
/// volume stays. `here` is the extinction at the collision, 1/m.
pub fn scattered_in_medium(
    across: f64,
    pdf: f64,
    here: f64,
    survival: f64,
    direction: DVec3,
    phase: f64,
) -> Differentials {
    let side = if pdf > 0.0 {
        (across * here / (pdf * survival)).sqrt()
    } else {
        0.0
    };
    reemission_differentials(side, direction, phase, 4.0 * PI)
}

/// Rows of the catalogue.
pub(crate) const ROWS: &[Row] = &[
    Row {
        id: "PM-PD-9",
        name: "photon differentials through a medium, as far as a surface",
        role: Role::PartOf("PM-SYS-1"),
        limits: "No less than a ten-thousandth counts as having passed; in grids that share is reckoned from the bounds of the density.",
        sources: &[sources::FABIANOWSKI_2011.at("§7.2.1.1")],
        shaders: &["shaders/techniques/photon_mapping/photon_footprint.glsl"],
        tests: &[
            "engine/src/techniques/photon_mapping/volume/chain_tests.rs::chains_of_events_in_media_agree_with_finite_differences",
            "engine/src/techniques/photon_mapping/volume/chain_tests.rs::footprints_that_forget_who_has_collided_are_too_small",
            "tests/tests/photon/volume_footprints.rs::kernels_in_nested_bodies_are_those_of_all_that_photons_have_passed",
            "tests/tests/photon/volume_footprints.rs::kernels_behind_glass_are_those_of_refracted_footprints",
            "engine/src/techniques/photon_mapping/volume/footprint.rs::volumes_are_reciprocals_of_the_density_of_collisions",
            "tests/tests/twins/photons.rs::footprints_in_media_agree_with_their_twins",
        ],
        settings: &["volume_kernel"],
        ..Row::of(file!())
    },
    Row {
        id: "PM-PD-10",
        name: "photon differentials as far as a collision: a third parameter, and a volume",
        role: Role::PartOf("PM-SYS-1"),
        limits: "The third vector lies along the way, so that a product of the other two is all that is kept; its length is the reciprocal of the density with which photons collide there.",
        sources: &[sources::FABIANOWSKI_2011.at("§7.2.1.2")],
        shaders: &["shaders/techniques/photon_mapping/photon_footprint.glsl"],
        tests: &[
            "engine/src/techniques/photon_mapping/volume/chain_tests.rs::each_event_in_media_agrees_with_finite_differences",
            "engine/src/techniques/photon_mapping/volume/footprint.rs::volumes_are_reciprocals_of_the_density_of_collisions",
            "tests/tests/photon/volume.rs::kernels_from_footprints_hold_as_many_collisions_as_they_should",
            "tests/tests/twins/photons.rs::footprints_in_media_agree_with_their_twins",
        ],
        settings: &["volume_kernel"],
        ..Row::of(file!())
    },
    Row {
        id: "PM-PD-11",
        name: "photon differentials after scattering in a medium: as from a point behind, so far that the expected volume stays, for every phase function",
        role: Role::PartOf("PM-SYS-1"),
        limits: "Where the footprint came from is forgotten, and so is its form.",
        sources: &[sources::FABIANOWSKI_2011.at("§7.2.2 and §7.2.3")],
        shaders: &[
            "shaders/techniques/photon_mapping/photon_footprint.glsl",
            "shaders/techniques/photon_mapping/photon_medium.comp",
        ],
        tests: &[
            "engine/src/techniques/photon_mapping/volume/chain_tests.rs::each_event_in_media_agrees_with_finite_differences",
            "engine/src/techniques/photon_mapping/volume/footprint.rs::scattering_keeps_the_expected_volume",
            "tests/tests/photon/volume.rs::kernels_from_footprints_agree_with_the_path_tracer",
            "tests/tests/twins/photons.rs::footprints_in_media_agree_with_their_twins",
        ],
        settings: &["volume_kernel"],
        ..Row::of(file!())
    },
    Row {
        id: "PM-DE-8",
        name: "dampening of kernels in media by a logarithm",
        role: Role::PartOf("PM-SYS-1"),
        limits: "The strength that errs least depends on the scene and on how often photons were scattered; the unit is a ninth of the scene's diagonal where none is given, not a metre.",
        sources: &[sources::FABIANOWSKI_2011.at("§7.3.2")],
        bias: Some(Bias::Consistent(
            "kernels blur events, the less the stronger they are dampened, until they have shrunk",
        )),
        shaders: &["shaders/techniques/photon_mapping/photon_footprint.glsl"],
        tests: &[
            "engine/src/techniques/photon_mapping/volume/footprint.rs::dampening_has_its_published_values",
            "engine/src/techniques/photon_mapping/volume/footprint.rs::scaling_the_scene_and_the_unit_scales_the_kernel",
            "tests/tests/twins/photons.rs::footprints_in_media_agree_with_their_twins",
        ],
        settings: &["volume_dampening", "unit_length"],
        ..Row::of(file!())
    },
];

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::Phase;
    use crate::test_random::Random;
    use crate::transport::differentials::emission_differentials;
    use crate::transport::phase::{phase_direction, phase_function, phase_function_sample};

    const SETTINGS: EventKernelSettings = EventKernelSettings {
        spread: 1.0,
        dampening: 0.0,
        unit_length: 1.0,
        length_min: 0.0,
        length_max: 1e9,
    };

    #[test]
    fn volumes_are_reciprocals_of_the_density_of_collisions() {
        // V = 4π r² e^(σ r) / (n σ) about a point light.
        let (n, uniform) = (1e5, 0.25 / PI);
        for sigma in [1e-3, 0.5, 40.0] {
            for depth in [1e-4, 1.0, 8.0] {
                let r = depth / sigma;
                let across = footprint_across(&emission_differentials(DVec3::Z, uniform), r, DVec3::Z);
                let pdf = sigma * (-depth).exp();
                let settings = EventKernelSettings {
                    spread: 3.0 * event_step(n),
                    ..SETTINGS
                };
                let volume = 4.0 * PI * r * r * f64::exp(depth) / (n * sigma);
                let radius = event_radius(&settings, across, pdf, sigma);
                assert!((radius / (3.0 * volume.cbrt()) - 1.0).abs() < 1e-12, "{sigma} {depth}");
                // As many collisions in the ball, whatever the distance: 113.
                let inside = 4.0 / 3.0 * PI * radius.powi(3) / volume;
                assert!((inside - 113.0973).abs() < 1e-3, "{inside}");
                // A boundary on the way, with what has passed it, changes nothing.
                let half = passed_differentials(&emission_differentials(DVec3::Z, uniform), (-0.5 * depth).exp());
                let rest = sigma * (-0.5 * depth).exp();
                let across = footprint_across(&half, r, DVec3::Z);
                assert!((event_radius(&settings, across, rest, sigma) / radius - 1.0).abs() < 1e-12);
            }
        }
    }

    #[test]
    fn dampening_has_its_published_values() {
        let radius = |root: f64, dampening| {
            let settings = EventKernelSettings { dampening, ..SETTINGS };
            event_radius(&settings, root.powi(3), 1.0, 1.0)
        };
        for (root, d, expected) in [
            (1.0, 1.5, 0.766),
            (1.0, 3.0, 0.863),
            (1.0, 10.0, 0.953),
            (10.0, 1.5, 3.055),
            (10.0, 3.0, 4.399),
            (10.0, 10.0, 6.931),
        ] {
            assert!(
                (radius(root, d) - expected).abs() < 6e-4,
                "{root} {d}: {}",
                radius(root, d)
            );
        }
        assert!((radius(7.0, 1e9) / 7.0 - 1.0).abs() < 1e-6 && (radius(7.0, 0.0) / 7.0 - 1.0).abs() < 1e-12);
        // The series goes over into the logarithm.
        let below = f64::from(LOG_SERIES_BELOW);
        assert!((log_of_one_plus(below * 0.999_999) / below.ln_1p() - 1.0).abs() < 2e-6);
    }

    #[test]
    fn scaling_the_scene_and_the_unit_scales_the_kernel() {
        for by in [1e-3, 1e3] {
            let damped = EventKernelSettings {
                dampening: 1.5,
                ..SETTINGS
            };
            let scaled = EventKernelSettings {
                unit_length: by,
                length_max: 1e9 * by,
                ..damped
            };
            let (plain, other) = (
                event_radius(&damped, 2.0, 0.3, 0.7),
                event_radius(&scaled, 2.0 * by * by, 0.3 / by, 0.7 / by),
            );
            assert!((other / by / plain - 1.0).abs() < 1e-12, "{by}: {other} {plain}");
        }
    }

    #[test]
    fn footprints_without_a_volume_have_the_least_kernel_and_endless_ones_the_greatest() {
        let settings = EventKernelSettings {
            length_min: 0.1,
            length_max: 2.0,
            ..SETTINGS
        };
        assert_eq!(event_radius(&settings, 0.0, 1.0, 1.0), 0.1);
        assert_eq!(event_radius(&settings, 1e-9, 1.0, 1.0), 0.1);
        assert_eq!(event_radius(&settings, 1.0, 0.0, 1.0), 2.0);
        assert_eq!(event_radius(&settings, 1e9, 1.0, 1.0), 2.0);
        assert_eq!(event_radius(&settings, f64::NAN, 1.0, 1.0), 0.1);
    }

    #[test]
    fn scattering_keeps_the_expected_volume() {
        let mut random = Random(17);
        for phase in [
            Phase::Isotropic,
            Phase::Schlick { k: 0.8 },
            Phase::Schlick { k: -0.5 },
            Phase::HenyeyGreenstein { g: 0.6 },
        ] {
            let (across, pdf, here, survival) = (0.3, 0.2, 0.7, 0.8);
            let n = 40_000;
            let (mut sum, mut squares) = (0.0, 0.0);
            for _ in 0..n {
                let [u, v] = [random.unit(), random.unit()].map(f64::from);
                let wi = phase_direction(DVec3::Z, phase_function_sample(phase, u), v);
                let p = phase_function(phase, DVec3::Z, wi);
                let d = scattered_in_medium(across, pdf, here, survival, wi, p);
                // At once, where the density of further collisions is that of the medium.
                let ratio = footprint_across(&d, 0.0, wi) / here / (across / (pdf * survival));
                (sum, squares) = (sum + ratio, squares + ratio * ratio);
            }
            let mean = sum / f64::from(n);
            let deviation = ((squares / f64::from(n) - mean * mean) / f64::from(n)).sqrt();
            // None of them has directions so rare that their footprints are cut off; of an even one all are alike, but for rounding.
            assert!(
                (mean - 1.0).abs() < 3.0 * deviation + 1e-9,
                "{phase:?}: {mean} ± {deviation}"
            );
        }
    }
}
