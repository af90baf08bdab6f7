//! How far ways of photons through homogeneous media are stored as beams. Twin of `techniques/photon_mapping/photon_event.glsl`.
//!
//! A long beam goes on to the next surface, with what the medium leaves of its light at each place. A short one ends by chance, as a flight does in the band through which light comes farthest
//! of those that scatter: it is there with the probability of that band's transmittance, and has all of the band's light while it is there, and of other bands' what they have less of. Where
//! bands are alike it ends where the photon collides. Both have one expectation. At a transmittance τ along the beam a short one's square has 1/τ that of a long one's.
//!
//! Source: W. Jarosz, D. Nowrouzezahrai, I. Sadeghi and H. W. Jensen, "A Comprehensive Theory of Volumetric Radiance Estimation Using Photon Points and Beams", ACM TOG 30(1), 2011, whose
//! bands are alike.

use super::BIAS;
use super::plane::plane_extinction;
use crate::catalogue::{Role, Row, sources};
use glam::DVec3;

/// How far ways of photons are stored.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum BeamLength {
    /// To the next surface.
    Long,
    /// As far as a flight of the photon comes.
    Short,
}

/// What takes from light along a short beam, 1/m: the extinction of each band beyond that with which the beam ends; at least one band scatters.
pub fn short_way_extinction(sigma_s: DVec3, sigma_t: DVec3) -> DVec3 {
    let least = DVec3::splat(plane_extinction(sigma_s, sigma_t));
    sigma_t.max(least) - least
}

/// Rows of the catalogue.
pub(crate) const ROWS: &[Row] = &[Row {
    id: "CL-PHOTON-SHORT",
    name: "photon beams, short ones: each ends by chance, as a flight does in the band that comes farthest",
    role: Role::PartOf("PM-SYS-1"),
    limits: "Homogeneous media alone; noisier than long ones by the reciprocal of what is left of light along them.",
    sources: &[sources::JAROSZ_2011.whole()],
    bias: Some(BIAS),
    shaders: &[
        "shaders/techniques/photon_mapping/photon_beam.comp",
        "shaders/techniques/photon_mapping/photon_event.glsl",
        "shaders/techniques/photon_mapping/photon_medium.comp",
    ],
    tests: &[
        "engine/src/techniques/photon_mapping/volume/ways.rs::short_ways_keep_the_expectation_of_every_band",
        "tests/tests/photon/short_beams.rs::short_beams_have_the_radiance_of_a_slab",
        "tests/tests/photon/short_beams.rs::short_and_long_beams_have_one_mean_and_another_variance",
        "tests/tests/photon/short_beams.rs::short_beams_agree_with_the_path_tracer_in_every_band",
        "tests/tests/twins/photons.rs::short_ways_agree_with_their_twins",
    ],
    settings: &["volume_beams"],
    ..Row::of(file!())
}];

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_random::Random;

    #[test]
    fn short_ways_keep_the_expectation_of_every_band() {
        const WAYS: u32 = 20_000;
        let (sigma_s, sigma_t) = (DVec3::new(1.0, 2.0, 0.0), DVec3::new(1.5, 2.2, 0.3));
        let extinction = plane_extinction(sigma_s, sigma_t);
        // Of the bands that scatter.
        assert_eq!(extinction, 1.5);
        let beyond = short_way_extinction(sigma_s, sigma_t);
        assert!((beyond - DVec3::new(0.0, 0.7, 0.0)).abs().max_element() < 1e-12);
        for along in [0.3, 1.0] {
            let mut random = Random(4);
            let there = (0..WAYS).filter(|_| -(1.0 - f64::from(random.unit())).ln() / extinction > along);
            let share = there.count() as f64 / f64::from(WAYS);
            let of_bands = (-beyond * along).exp();
            for band in 0..2 {
                let (found, exact) = (share * of_bands[band], (-sigma_t[band] * along).exp());
                let deviation = of_bands[band] * (share * (1.0 - share) / f64::from(WAYS)).sqrt();
                // Chance exceeds this once in a million.
                assert!(
                    (found - exact).abs() < 4.9 * deviation,
                    "{along}, {band}: {found}, {exact}"
                );
            }
        }
        let grey = DVec3::splat(3.0);
        assert_eq!(short_way_extinction(grey, grey), DVec3::ZERO);
    }
}
