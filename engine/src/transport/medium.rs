//! Free flight, emission and direct light along a ray in a medium. Twin of `transport/medium.glsl`, which explains the bands.
//!
//! Sources: Wilkie et al., "Hero Wavelength Spectral Sampling" (2014); Miller, Georgiev and Jarosz, "A Null-scattering Path Integral
//! Formulation of Light Transport" (2019); Kulla and Fajardo, "Importance Sampling Techniques for Path Tracing in Participating Media" (2012).
//! Guarantees: weights are finite, and unbiased for each band whatever the bands' probabilities. Distances in metres, coefficients in m⁻¹.

use crate::catalogue::{Bias, Role, Row, sources};
use crate::gpu::shaders::constants;
use glam::DVec3;

/// A distance beyond every scene, which stands for infinity.
pub const FAR_AWAY: f64 = constants::FAR_AWAY as f64;
const EXPONENT_MAX: f64 = constants::EXPONENT_MAX as f64;
const SERIES_DEPTH: f64 = constants::SERIES_DEPTH as f64;
const EQUI_ANGULAR_GAIN: f64 = constants::EQUI_ANGULAR_GAIN as f64;

/// The band that `u` in [0, 1) chooses; never one of probability zero.
pub fn choose_band(bands: DVec3, u: f64) -> usize {
    let target = u * bands.element_sum();
    let chosen = if target < bands.x {
        0
    } else if target < bands.x + bands.y {
        1
    } else {
        2
    };
    if chosen == 2 && bands.z <= 0.0 {
        usize::from(bands.y > 0.0)
    } else {
        chosen
    }
}

/// Transmittances as multiples of that of a band with the coefficient `reference`.
pub fn relative_transmittance(sigma_t: DVec3, reference: f64, t: f64) -> DVec3 {
    ((DVec3::splat(reference) - sigma_t) * t)
        .clamp(DVec3::splat(-EXPONENT_MAX), DVec3::splat(EXPONENT_MAX))
        .exp()
}

/// Transmittance of each band, after Bouguer, Lambert and Beer.
pub fn transmittance(sigma_t: DVec3, t: f64) -> DVec3 {
    (-sigma_t * t).exp()
}

/// What a flight through a homogeneous medium comes to.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FreeFlight {
    /// Distance of the collision, or that of the end.
    pub t: f64,
    /// It ends in a collision.
    pub collides: bool,
    /// Weight of the throughput, the scattering coefficient included.
    pub weight: DVec3,
    /// Probabilities of the bands afterwards.
    pub bands: DVec3,
}

/// A flight of at most `t_max` ([`FAR_AWAY`]: to infinity) through a homogeneous medium.
pub fn sample_free_flight(sigma_s: DVec3, sigma_t: DVec3, bands: DVec3, t_max: f64, u: [f64; 2]) -> FreeFlight {
    let reference = sigma_t[choose_band(bands, u[1])];
    let t = if reference > 0.0 {
        -(1.0 - u[0]).ln() / reference
    } else {
        FAR_AWAY
    };
    let collides = t < t_max;
    let t = t.min(t_max);
    let e = relative_transmittance(sigma_t, reference, t);
    let share = if collides { sigma_t * e } else { e };
    let density = bands.dot(share);
    FreeFlight {
        t,
        collides,
        weight: if collides { sigma_s * e } else { e } / density,
        bands: bands * share / density,
    }
}

/// Density of collisions of [`sample_free_flight`], m⁻¹.
pub fn collision_density(sigma_t: DVec3, bands: DVec3, t: f64) -> f64 {
    bands.dot(sigma_t * transmittance(sigma_t, t))
}

/// The integral of the transmittance from 0 to `t`, m.
pub fn attenuated_length(sigma_t: f64, t: f64) -> f64 {
    let x = sigma_t * t;
    if x < SERIES_DEPTH {
        t * (1.0 - x * (1.0 / 2.0 - x * (1.0 / 6.0 - x * (1.0 / 24.0))))
    } else {
        (1.0 - (-x).exp()) / sigma_t
    }
}

/// Where a light is by a segment of a ray.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct EquiAngular {
    /// Distance along the ray from the segment's start.
    pub along: f64,
    /// Distance off the ray.
    pub off: f64,
    /// Angle that the segment subtends at the light; 0 where there is nothing to sample.
    pub range: f64,
}

/// The place of `light`, a point of it, by a segment of length `t_max` ([`FAR_AWAY`]: endless).
pub fn equi_angular(start: DVec3, direction: DVec3, t_max: f64, light: DVec3) -> EquiAngular {
    let to = light - start;
    let along = to.dot(direction);
    let off = (to - along * direction).length();
    let range = if t_max >= FAR_AWAY {
        off.atan2(-along)
    } else {
        (off * t_max).atan2(off * off - along * (t_max - along))
    };
    EquiAngular {
        along,
        off,
        range: if off > 0.0 { range } else { 0.0 },
    }
}

/// A distance along the segment, evenly over the angle at the light.
pub fn equi_angular_sample(e: EquiAngular, t_max: f64, u: f64) -> f64 {
    let (s, c) = (u * e.range).sin_cos();
    // Nothing is left of it, or less, where the end is infinitely far or rounding leads past it.
    let depth = e.off * c + e.along * s;
    if depth > 0.0 {
        (s * (e.off * e.off + e.along * e.along) / depth).clamp(0.0, t_max)
    } else {
        t_max
    }
}

/// Its density, m⁻¹.
pub fn equi_angular_pdf(e: EquiAngular, t: f64) -> f64 {
    let d = t - e.along;
    if e.range > 0.0 {
        e.off / (e.range * (e.off * e.off + d * d))
    } else {
        0.0
    }
}

/// Whether a sample of the segment is worth a ray of its own beside the collision of a free flight, whose density is at most `extinction` m⁻¹: by
/// the densities where the segment is nearest to the light. Of an endless ray that is the case within two thirds of a mean free path.
pub fn equi_angular_helps(e: EquiAngular, t_max: f64, extinction: f64) -> bool {
    equi_angular_pdf(e, e.along.clamp(0.0, t_max)) > EQUI_ANGULAR_GAIN * extinction
}

/// Whether `u` in [0, 1) makes a tentative collision with an extinction of `real` shares (at most 1) of the majorant a real one; the
/// probabilities of the bands and the weight afterwards. `scattered` is the scattering coefficient in the same unit.
pub fn sample_null_collision(
    real: DVec3,
    scattered: DVec3,
    u: f64,
    bands: DVec3,
    weight: DVec3,
) -> (bool, DVec3, DVec3) {
    let probability = bands.dot(real);
    let null_probability = bands.dot(DVec3::ONE - real);
    // Rounded, the two may sum to less than the greatest u.
    let collides = u < probability || null_probability <= 0.0;
    let share = if collides { real } else { DVec3::ONE - real };
    let inverse = 1.0 / if collides { probability } else { null_probability };
    let weight = weight * if collides { scattered } else { share } * inverse;
    (collides, bands * share * inverse, weight)
}

/// Rows of the catalogue.
pub(crate) const ROWS: &[Row] = &[
    Row {
        id: "BG-1",
        name: "radiometry, transport between surfaces and in media",
        role: Role::PartOf("BG-3"),
        limits: "Geometric optics in three bands, without polarization; light takes no time.",
        sources: &[sources::CHANDRASEKHAR_1960.whole(), sources::VEACH_1997.at("chapter 3")],
        shaders: &["shaders/transport/medium.glsl"],
        tests: &[
            "engine/src/transport/lights.rs::a_triangle_seen_by_its_density_has_its_solid_angle",
            "engine/src/transport/phase.rs::normalised_with_their_mean_cosines",
            "engine/src/transport/phase.rs::samples_follow_their_density",
            "tests/tests/media/absorption.rs::beers_law_is_exact",
            "tests/tests/media/absorption.rs::emission_is_integrated_exactly",
            "tests/tests/media/furnace.rs::lossless_media_vanish",
            "tests/tests/media/homogeneous.rs::rays_past_a_source_have_the_exact_multiple_scattering",
            "tests/tests/media/mechanics.rs::parts_of_everything_sum_to_the_whole",
            "tests/tests/twins/media.rs::free_flight_agrees_with_its_twin",
            "engine/src/transport/medium.rs::extremes_stay_finite",
        ],
        api: &["clerestory::transport::medium"],
        ..Row::of(file!())
    },
    Row {
        id: "BG-4",
        name: "free flight and transmittance: analytic, delta and ratio tracking, equi-angular",
        role: Role::PartOf("BG-3"),
        limits: "Equi-angular samples are taken of one light a way, chosen by its power alone; not inside solids that refract, nor of area lights where all are larger than half a mean free path, nor where a grid's densest cell would make ways through it deeper than 6144; in grids the looser the bound of the density, the more steps tracking takes and the more noise ratio tracking has.",
        sources: &[
            sources::WOODCOCK_1965.whole(),
            sources::KULLA_FAJARDO_2012.whole(),
            sources::NOVAK_2014.whole(),
            sources::MILLER_2019.whole(),
        ],
        shaders: &[
            "shaders/techniques/path/path_medium.comp",
            "shaders/transport/media_tracking.glsl",
        ],
        bias: Some(Bias::Unbiased),
        tests: &[
            "engine/src/transport/medium.rs::free_flights_are_unbiased_in_every_band",
            "engine/src/transport/medium.rs::null_collisions_keep_the_expectation",
            "engine/src/transport/medium.rs::equi_angular_samples_follow_their_density",
            "tests/tests/twins/media.rs::free_flight_agrees_with_its_twin",
            "tests/tests/twins/media.rs::equi_angular_samples_and_null_collisions_agree_with_their_twins",
            "tests/tests/media/homogeneous.rs::single_scattering_is_the_airlight_integral",
            "engine/src/transport/gpu_scene/airlight.rs::small_lamps_in_thin_open_media_are_worth_samples",
            "engine/src/transport/gpu_scene/airlight.rs::grids_of_one_very_dense_cell_have_none",
            "tests/tests/media/area_lights.rs::single_scattering_beside_a_lamp_is_its_integral",
            "tests/tests/media/area_lights.rs::lamps_among_bodies_glass_and_alpha_keep_their_expectation",
            "tests/tests/media/area_lights.rs::ways_through_grids_of_loose_bounds_are_cut_without_a_trace",
            "tests/tests/media/area_lights.rs::without_lights_that_have_a_place_nothing_of_it_exists",
            "tests/tests/media/heterogeneous.rs::gradients_attenuate_by_their_integral",
            "tests/tests/media/heterogeneous.rs::constant_grids_are_homogeneous_media",
            "tests/tests/media/heterogeneous.rs::layered_slabs_depend_on_their_optical_depth_alone",
            "tests/tests/media/slab.rs::bands_of_a_chromatic_medium_are_those_of_grey_ones",
            "tests/tests/media/slab.rs::reflectance_and_transmittance_are_those_of_the_tables",
        ],
        experiment: "clerestory agreement --scene fog-box,smoke",
        settings: &["equiangular"],
        api: &["clerestory::transport::medium"],
        ..Row::of(file!())
    },
    Row {
        id: "PM-VOL-1",
        name: "transmittance: analytic and by ratio tracking; ray marching as their baseline",
        role: Role::PartOf("BG-3"),
        limits: "The looser the bound of the density, the more noise ratio tracking has.",
        sources: &[sources::JENSEN_CHRISTENSEN_1998.whole(), sources::NOVAK_2014.whole()],
        shaders: &["shaders/transport/medium.glsl", "shaders/transport/media_tracking.glsl"],
        bias: Some(Bias::Unbiased),
        tests: &[
            "tests/tests/media/absorption.rs::beers_law_is_exact",
            "tests/tests/media/absorption.rs::shadow_rays_are_attenuated_exactly",
            "tests/tests/media/heterogeneous.rs::gradients_attenuate_by_their_integral",
            "engine/src/transport/free_flight.rs::marched_transmittance_errs_by_the_step_and_in_the_middle_by_its_square",
            "engine/src/transport/free_flight.rs::ratio_tracking_is_unbiased_however_loose_the_majorant",
        ],
        api: &["clerestory::transport::medium"],
        ..Row::of(file!())
    },
    Row {
        id: "PM-VOL-2",
        name: "free flight through homogeneous media",
        role: Role::PartOf("BG-3"),
        limits: "Media of one density only.",
        sources: &[sources::JENSEN_CHRISTENSEN_1998.whole(), sources::WILKIE_2014.whole()],
        shaders: &["shaders/transport/medium.glsl"],
        bias: Some(Bias::Unbiased),
        tests: &[
            "engine/src/transport/medium.rs::free_flights_are_unbiased_in_every_band",
            "engine/src/transport/medium.rs::extremes_stay_finite",
            "tests/tests/media/homogeneous.rs::fluence_about_a_source_is_the_exact_one",
            "tests/tests/twins/media.rs::equi_angular_samples_and_null_collisions_agree_with_their_twins",
        ],
        api: &["clerestory::transport::medium"],
        ..Row::of(file!())
    },
    Row {
        id: "PM-VOL-4",
        name: "free flight by delta tracking",
        role: Role::PartOf("BG-3"),
        limits: "Needs a bound of the density, and takes more steps the looser it is.",
        sources: &[sources::WOODCOCK_1965.whole(), sources::COLEMAN_1968.whole()],
        shaders: &["shaders/transport/medium.glsl", "shaders/transport/media_tracking.glsl"],
        bias: Some(Bias::Unbiased),
        tests: &[
            "engine/src/transport/free_flight.rs::tracked_flights_follow_their_distribution_however_loose_the_majorant",
            "engine/src/transport/medium.rs::null_collisions_keep_the_expectation",
            "tests/tests/media/heterogeneous.rs::constant_grids_are_homogeneous_media",
            "tests/tests/media/heterogeneous.rs::emptiness_and_loose_majorants_cost_noise_only",
            "tests/tests/twins/media.rs::equi_angular_samples_and_null_collisions_agree_with_their_twins",
        ],
        api: &["clerestory::transport::medium"],
        ..Row::of(file!())
    },
];

#[cfg(test)]
mod tests {
    use super::super::testing::{chi_square_test, random3};
    use super::*;

    /// Means within 4.9 standard errors (a rate of 10⁻⁶ each).
    fn expect(what: &str, values: impl Iterator<Item = f64> + Clone, expected: f64) {
        let n = values.clone().count() as f64;
        let mean = values.clone().sum::<f64>() / n;
        let error = (values.map(|v| (v - mean).powi(2)).sum::<f64>() / n / n).sqrt();
        assert!(
            (mean - expected).abs() < 4.9 * error + 1e-12,
            "{what}: {mean} ± {error}, {expected}"
        );
    }

    /// Σ over collisions of weight × f(t), and over escapes of weight, are ∫ σs e^(−σt) f dt and e^(−σ d), for each band.
    #[test]
    fn free_flights_are_unbiased_in_every_band() {
        let (sigma_s, sigma_t) = (DVec3::new(0.2, 1.0, 6.0), DVec3::new(0.5, 2.0, 6.0));
        let bands = DVec3::new(0.5, 0.3, 0.2);
        for t_max in [0.7, 3.0] {
            let flights: Vec<_> = (0..200_000)
                .map(|i| random3(i, 31))
                .map(|u| sample_free_flight(sigma_s, sigma_t, bands, t_max, [u.x, u.y]))
                .collect();
            for band in 0..3 {
                let (s, t) = (sigma_s[band], sigma_t[band]);
                let escaped = flights.iter().map(|f| if f.collides { 0.0 } else { f.weight[band] });
                expect("escapes", escaped, (-t * t_max).exp());
                let first_moment = flights
                    .iter()
                    .map(|f| if f.collides { f.weight[band] * f.t } else { 0.0 });
                let exact = s * (1.0 / (t * t) - (-t * t_max).exp() * (t_max / t + 1.0 / (t * t)));
                expect("collisions", first_moment, exact);
                assert!(flights.iter().all(|f| (f.bands.element_sum() - 1.0).abs() < 1e-12));
                // Never more than the band's own walk would have, over the probability of the band.
                let most = s.max(t) / t / bands[band] + 1e-9;
                assert!(flights.iter().all(|f| f.weight[band] <= most));
            }
        }
    }

    #[test]
    fn extremes_stay_finite() {
        let thirds = DVec3::splat(1.0 / 3.0);
        for sigma in [0.0, 1e-30, 1e-4, 1.0, 1e4] {
            for other in [0.0, 1.0, 1e4] {
                for t_max in [1e-6, 1.0, 1e5, FAR_AWAY] {
                    for i in 0..100 {
                        let u = random3(i, 32);
                        let sigma_t = DVec3::new(sigma, other, 0.3);
                        let f = sample_free_flight(sigma_t, sigma_t, thirds, t_max, [u.x, u.y]);
                        assert!(
                            f.weight.is_finite() && f.bands.is_finite(),
                            "{sigma} {other} {t_max}: {f:?}"
                        );
                    }
                }
            }
        }
        assert_eq!(attenuated_length(0.0, 2.0), 2.0);
        assert!((attenuated_length(1e4, 1.0) - 1e-4).abs() < 1e-12);
        let step = attenuated_length(0.050_000_1, 1.0) - attenuated_length(0.049_999_9, 1.0);
        assert!(step.abs() < 2e-7);
    }

    #[test]
    fn null_collisions_keep_the_expectation() {
        let (real, scattered) = (DVec3::new(0.1, 0.5, 1.0), DVec3::new(0.05, 0.5, 0.4));
        let bands = DVec3::new(0.2, 0.5, 0.3);
        let all: Vec<_> = (0..100_000)
            .map(|i| sample_null_collision(real, scattered, random3(i, 33).x, bands, DVec3::ONE))
            .collect();
        for band in 0..3 {
            expect(
                "real",
                all.iter().map(|a| if a.0 { a.2[band] } else { 0.0 }),
                scattered[band],
            );
            expect(
                "null",
                all.iter().map(|a| if a.0 { 0.0 } else { a.2[band] }),
                1.0 - real[band],
            );
        }
    }

    /// The angle to an infinitely far end may be rounded past it.
    #[test]
    fn equi_angular_samples_end_where_the_segment_does() {
        let e = equi_angular(DVec3::ZERO, DVec3::X, FAR_AWAY, DVec3::new(0.7, 0.3, 0.0));
        let past = EquiAngular {
            range: e.range * (1.0 + 1e-12),
            ..e
        };
        assert_eq!(equi_angular_sample(past, FAR_AWAY, 1.0), FAR_AWAY);
    }

    /// Chi-square at 10⁻⁵, six tests.
    #[test]
    fn equi_angular_samples_follow_their_density() {
        for (along, off, t_max) in [
            (1.0, 0.5, 3.0),
            (-2.0, 0.1, 4.0),
            (5.0, 1.0, 2.0),
            (1.0, 1.0, FAR_AWAY),
            (-1.0, 0.3, FAR_AWAY),
            (0.0, 2.0, 1e-3),
        ] {
            let e = equi_angular(DVec3::ZERO, DVec3::X, t_max, DVec3::new(along, off, 0.0));
            // Cells even in the angle, whose share is known, cut at distances by the closed form of the distribution.
            let (n, cells) = (50_000, 32);
            let mut observed = vec![0.0; cells];
            let angle = |t: f64| ((t - along) / off).atan() - (-along / off).atan();
            for i in 0..n {
                let t = equi_angular_sample(e, t_max, random3(i, 34).x);
                assert!((0.0..=t_max).contains(&t) && equi_angular_pdf(e, t) > 0.0);
                let cell = (angle(t) / e.range * cells as f64) as usize;
                observed[cell.min(cells - 1)] += 1.0;
            }
            let p = chi_square_test(&observed, &vec![f64::from(n) / cells as f64; cells]);
            assert!(p > 1e-5, "{along} {off} {t_max}: {p}");
            // The density is the derivative of the angle.
            let (t, h) = (0.4 * t_max.min(2.0), 1e-4 * t_max.min(1.0));
            let slope = (angle(t + h) - angle(t - h)) / (2.0 * h * e.range);
            assert!((equi_angular_pdf(e, t) / slope - 1.0).abs() < 1e-5);
        }
    }
}
