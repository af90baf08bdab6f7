//! Flights through coloured media whose distance is drawn by the largest extinction of all bands (baseline). Twin of `transport/densest_band.glsl`. The path tracer
//! and photons draw from the mixture of all bands ([`medium`](super::medium)) instead.
//!
//! Source: B. Fabianowski, "Interactive Manycore Photon Mapping", PhD thesis, Trinity College Dublin, 2011, §7.3.3. Guarantees: weights are unbiased for each band; but that of a
//! band with less than half of the largest extinction has a second moment that grows with the distance without bound, as exp((σ_max − 2σ) t). Distances in metres, coefficients in m⁻¹.

use super::medium::{FreeFlight, sample_free_flight, transmittance};
use crate::catalogue::{Bias, Role, Row, sources};
use glam::DVec3;

/// Probability one of the band of the largest extinction, the first of equal ones.
pub fn densest_band(sigma_t: DVec3) -> DVec3 {
    let most = sigma_t.max_element();
    if sigma_t.x >= most {
        DVec3::X
    } else if sigma_t.y >= most {
        DVec3::Y
    } else {
        DVec3::Z
    }
}

/// A flight of at most `t_max` ([`FAR_AWAY`](super::medium::FAR_AWAY): to infinity) through a homogeneous medium, by that band alone. `u` in [0, 1).
///
/// Its weights are exp((σ_max − σ) t) where it ends at `t_max`, and σ_s / σ_max times that where it collides.
pub fn densest_band_flight(sigma_s: DVec3, sigma_t: DVec3, t_max: f64, u: f64) -> FreeFlight {
    sample_free_flight(sigma_s, sigma_t, densest_band(sigma_t), t_max, [u, 0.0])
}

/// E\[w²\] of the weight of flights of [`sample_free_flight`] that pass the distance `t`, 0 for those that do not.
///
/// By [`densest_band`] it is exp((σ_max − 2σ) t), of a mixture at most the transmittance over the band's probability.
pub fn passed_second_moment(sigma_t: DVec3, bands: DVec3, t: f64) -> DVec3 {
    transmittance(2.0 * sigma_t, t) / bands.dot(transmittance(sigma_t, t))
}

/// Rows of the catalogue.
pub(crate) const ROWS: &[Row] = &[Row {
    id: "PM-DE-9",
    name: "free flight of all bands by the densest one (baseline)",
    role: Role::Yardstick,
    limits: "The second moment of bands with less than half of the largest extinction grows with the distance without bound; never in a picture.",
    sources: &[sources::FABIANOWSKI_2011.at("§7.3.3")],
    bias: Some(Bias::Unbiased),
    shaders: &["shaders/transport/densest_band.glsl"],
    tests: &[
        "engine/src/transport/densest_band.rs::transmitted_and_scattered_flux_is_unbiased_in_every_band",
        "engine/src/transport/densest_band.rs::second_moments_grow_without_bound_and_those_of_mixtures_do_not",
        "tests/tests/twins/media.rs::flights_by_the_densest_band_agree_with_their_twins",
    ],
    api: &[
        "clerestory::transport::densest_band::densest_band_flight",
        "clerestory::transport::densest_band::passed_second_moment",
    ],
    ..Row::of(file!())
}];

#[cfg(test)]
mod tests {
    use super::super::testing::random3;
    use super::*;

    /// A coloured medium of the source: one band is dense, two are thin.
    const SIGMA_S: DVec3 = DVec3::new(0.5, 0.01, 0.01);
    const SIGMA_T: DVec3 = DVec3::new(0.51, 0.02, 0.02);
    const EVEN: DVec3 = DVec3::splat(1.0 / 3.0);
    /// |z| that chance exceeds once in a million.
    const Z_MAX: f64 = 4.9;

    /// Mean and standard error of the mean.
    fn mean(values: impl Iterator<Item = f64> + Clone) -> (f64, f64) {
        let n = values.clone().count() as f64;
        let mean = values.clone().sum::<f64>() / n;
        let squares: f64 = values.map(|v| (v - mean).powi(2)).sum();
        (mean, (squares / (n * (n - 1.0))).sqrt())
    }

    fn flights(t_max: f64) -> Vec<FreeFlight> {
        let draw = |i| densest_band_flight(SIGMA_S, SIGMA_T, t_max, random3(i, 51).x);
        (0..200_000).map(draw).collect()
    }

    #[test]
    fn transmitted_and_scattered_flux_is_unbiased_in_every_band() {
        for t_max in [1.0, 4.0, 8.0] {
            let flights = flights(t_max);
            for band in 0..3 {
                let (s, t) = (SIGMA_S[band], SIGMA_T[band]);
                let passed = flights.iter().map(|f| if f.collides { 0.0 } else { f.weight[band] });
                let scattered = flights.iter().map(|f| if f.collides { f.weight[band] } else { 0.0 });
                for (what, (found, error), exact) in [
                    ("transmitted", mean(passed), (-t * t_max).exp()),
                    ("scattered", mean(scattered), s / t * (1.0 - (-t * t_max).exp())),
                ] {
                    assert!(
                        (found - exact).abs() < Z_MAX * error,
                        "{what} after {t_max} m, band {band}: {found} ± {error}, {exact}"
                    );
                }
            }
        }
    }

    #[test]
    fn second_moments_grow_without_bound_and_those_of_mixtures_do_not() {
        // The weight of the source's coloured ring at 4 m.
        let passing = densest_band_flight(SIGMA_S, SIGMA_T, 4.0, 0.999);
        assert!((passing.weight.y - (0.49f64 * 4.0).exp()).abs() < 1e-12 && (passing.weight.x - 1.0).abs() < 1e-12);
        let mut before = DVec3::ZERO;
        for t in [1.0, 4.0, 8.0, 16.0] {
            let grown = passed_second_moment(SIGMA_T, densest_band(SIGMA_T), t);
            let closed = ((DVec3::splat(0.51) - 2.0 * SIGMA_T) * t).exp();
            assert!(
                (grown / closed - 1.0).abs().max_element() < 1e-12,
                "{t}: {grown} {closed}"
            );
            assert!(grown.y > before.y && grown.x < 1.0, "{t}: {grown}");
            before = grown;
            let mixed = passed_second_moment(SIGMA_T, EVEN, t);
            let bound = 3.0 * transmittance(SIGMA_T, t);
            assert!(mixed.cmple(bound).all(), "{t}: {mixed} {bound}");
            if t > 8.0 {
                continue;
            }
            let squares = flights(t);
            let squares = squares
                .iter()
                .map(|f| if f.collides { 0.0 } else { f.weight.y.powi(2) });
            let (found, error) = mean(squares);
            assert!(
                (found - grown.y).abs() < Z_MAX * error,
                "{t}: {found} ± {error}, {}",
                grown.y
            );
        }
        assert!(before.y > 1e3);
        // The first of equal bands, and no band of an empty medium is worse than another.
        assert_eq!(densest_band(DVec3::new(0.2, 0.7, 0.7)), DVec3::Y);
        assert_eq!(densest_band(DVec3::ZERO), DVec3::X);
        assert!(!densest_band_flight(DVec3::ZERO, DVec3::ZERO, 1.0, 0.5).collides);
    }
}
