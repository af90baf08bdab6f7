//! What a density grid leaves of light along an eye ray, for all photons that the ray sees: one walk by ratio tracking, or a table. Twin of
//! `techniques/photon_mapping/photon_transmittance.glsl`.
//!
//! The product of a walk's steps before a place is an unbiased estimate of the transmittance to there, for each place of the ray. For a ray to keep all of them they are few: a tentative
//! collision that is real with little probability is mostly no step, and otherwise a greater one for it; and when all steps but three are taken, bands end by chance at real collisions, as by
//! delta tracking, which takes one step a band. Where light ends at a share s of tentative collisions of the density μ, the variance over the squared transmittance is
//! exp(∫ max(s, ¼) s μ) − 1, against exp(∫ s μ) − 1 by delta tracking, but for the last bands and the roulette of what is nearly nothing.
//!
//! Source: J. Novák, A. Selle and W. Jarosz, "Residual Ratio Tracking for Estimating Attenuation in Participating Media", SIGGRAPH Asia 2014; steps of a least size are the engine's own.

use crate::catalogue::{Bias, Role, Row, sources};
use crate::gpu::shaders::constants::{
    RATIO_ROULETTE_BELOW, RATIO_ROULETTE_SURVIVAL, WAY_STEP_LEAST, WAY_STEPS, WAY_STEPS_OF_BANDS,
};
use glam::DVec3;

/// How the transmittance along eye rays through density grids is found; in homogeneous media it is exact.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum VolumeTransmittance {
    /// By ratio tracking, unbiased towards every photon.
    Walk,
    /// By a table of its logarithm at 64 places as far apart on the way through the grid, from the density midway between them: without noise, and wrong by what the density does in between.
    Table,
}

/// What a tentative collision leaves of the light that has `passed`, behind so many steps of the ray, and whether that is a step.
///
/// Of each band's light the share `real`, at most 1, ends there on average; `u` in [0, 1)². At most [`WAY_STEPS`] steps of a ray.
pub fn attenuate(real: DVec3, steps: u32, u: [f64; 2], passed: DVec3) -> (bool, DVec3) {
    let real = DVec3::select(passed.cmpeq(DVec3::ZERO), DVec3::ZERO, real);
    if steps + WAY_STEPS_OF_BANDS >= WAY_STEPS {
        let ends = DVec3::splat(u[0]).cmplt(real);
        return (ends.any(), DVec3::select(ends, DVec3::ZERO, passed));
    }
    let chance = (real.max_element() / f64::from(WAY_STEP_LEAST)).min(1.0);
    if u[0] >= chance {
        return (false, passed);
    }
    let passed = passed * (DVec3::ONE - real / chance);
    if passed.max_element() >= f64::from(RATIO_ROULETTE_BELOW) {
        return (true, passed);
    }
    let survival = f64::from(RATIO_ROULETTE_SURVIVAL);
    let kept = if u[1] < survival { 1.0 / survival } else { 0.0 };
    (true, passed * kept)
}

/// Rows of the catalogue.
pub(crate) const ROWS: &[Row] = &[
    Row {
        id: "CL-PHOTON-WALK",
        name: "transmittance towards all photons that a ray sees through a grid: one walk by ratio tracking, whose product so far each is multiplied by",
        role: Role::PartOf("PM-SYS-1"),
        limits: "All that one ray sees shares the noise of its walk; behind sixteen steps, of which three are the bands', light ends by chance.",
        sources: &[sources::NOVAK_2014.whole(), sources::WOODCOCK_1965.whole()],
        bias: Some(Bias::Unbiased),
        shaders: &[
            "shaders/techniques/photon_mapping/photon_beam_way.glsl",
            "shaders/techniques/photon_mapping/photon_transmittance.glsl",
            "shaders/transport/media_tracking.glsl",
        ],
        tests: &[
            "engine/src/techniques/photon_mapping/volume/transmittance.rs::products_of_steps_are_unbiased_at_every_place",
            "engine/src/techniques/photon_mapping/volume/transmittance.rs::steps_vary_less_than_delta_tracking_and_are_bounded",
            "tests/tests/photon/grid_transmittance.rs::walks_have_the_exact_transmittance_and_vary_less_than_delta_tracking",
            "tests/tests/photon/grid_transmittance.rs::homogeneous_media_have_the_same_bits_by_either",
            "tests/tests/photon/grid_transmittance.rs::waves_shrink_until_ways_through_grids_fit_beside_them",
            "tests/tests/photon/volume.rs::grids_agree_with_the_path_tracer",
            "tests/tests/photon/volume_queues.rs::queues_and_packets_wait_for_walks_through_grids",
            "tests/tests/twins/photons.rs::steps_through_grids_agree_with_their_twins",
        ],
        settings: &["volume_transmittance"],
        ..Row::of(file!())
    },
    Row {
        id: "CL-PHOTON-TABLE",
        name: "transmittance towards all photons that a ray sees through a grid: a table of its logarithm at 64 places",
        role: Role::PartOf("PM-SYS-1"),
        limits: "Wrong where density is not straight within a 64th of a ray's way through the grid, and blind to a layer that is thinner; 64 look-ups of the density a ray, however thin it is.",
        sources: &[sources::JENSEN_CHRISTENSEN_1998.whole()],
        bias: Some(Bias::Biased(
            "what the density does within a 64th of the way through the grid, of which the table has the middle alone",
        )),
        shaders: &["shaders/techniques/photon_mapping/photon_beam_way.glsl"],
        tests: &[
            "tests/tests/photon/grid_transmittance.rs::tables_err_by_what_lies_between_their_places",
            "tests/tests/photon/grid_transmittance.rs::tables_agree_with_the_path_tracer",
            "tests/tests/photon/grid_transmittance.rs::tables_are_kept_for_queries_that_a_quota_stops",
            "tests/tests/photon/grid_transmittance.rs::the_sky_behind_a_grid_needs_no_table",
            "tests/tests/photon/grid_transmittance.rs::homogeneous_media_have_the_same_bits_by_either",
        ],
        settings: &["volume_transmittance"],
        ..Row::of(file!())
    },
];

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_random::Random;

    const RAYS: u32 = 10_000;
    /// |z| that chance exceeds once in a million.
    const Z_MAX: f64 = 4.9;

    /// Shares of tentative collisions that are real by band, and how many there are on average: tight and loose bounds, a band that passes, and light that takes all steps and more.
    const CASES: [(DVec3, f64); 5] = [
        (DVec3::new(0.3, 0.1, 0.6), 3.0),
        (DVec3::new(1.0, 0.5, 0.25), 2.0),
        (DVec3::new(0.01, 0.005, 0.002), 200.0),
        (DVec3::new(0.05, 0.05, 0.05), 60.0),
        (DVec3::new(0.1, 0.01, 0.0), 200.0),
    ];

    /// What a walk has left halfway and at the end, and its steps.
    fn walk(random: &mut Random, (real, mean): (DVec3, f64)) -> ([DVec3; 2], u32) {
        let mut draw = || f64::from(random.unit());
        let (mut t, mut steps, mut passed) = (0.0, 0, DVec3::ONE);
        let mut halfway = None;
        loop {
            t -= (1.0 - draw()).ln() / mean;
            if t >= 0.5 {
                halfway.get_or_insert(passed);
            }
            if t >= 1.0 {
                return ([halfway.unwrap_or(passed), passed], steps);
            }
            let (is_step, left) = attenuate(real, steps, [draw(), draw()], passed);
            steps += u32::from(is_step);
            passed = left;
        }
    }

    /// Means and variances of bands halfway and at the end.
    fn moments(case: (DVec3, f64)) -> [[DVec3; 2]; 2] {
        let mut random = Random(3);
        let mut sums = [[DVec3::ZERO; 2]; 2];
        for _ in 0..RAYS {
            let (found, steps) = walk(&mut random, case);
            assert!(steps <= WAY_STEPS, "{case:?}: {steps} steps");
            for (sums, passed) in sums.iter_mut().zip(found) {
                sums[0] += passed;
                sums[1] += passed * passed;
            }
        }
        sums.map(|[sum, squares]| {
            let mean = sum / f64::from(RAYS);
            [mean, squares / f64::from(RAYS) - mean * mean]
        })
    }

    #[test]
    fn products_of_steps_are_unbiased_at_every_place() {
        for case in CASES {
            for ([mean, variance], share) in moments(case).into_iter().zip([0.5, 1.0]) {
                let exact = (-case.0 * case.1 * share).exp();
                for band in 0..3 {
                    let error = (variance[band] / f64::from(RAYS)).sqrt();
                    let off = (mean[band] - exact[band]).abs();
                    assert!(
                        off <= Z_MAX * error + 1e-8,
                        "{case:?}, {share}, {band}: {mean}, {exact}"
                    );
                }
            }
        }
    }

    #[test]
    fn steps_vary_less_than_delta_tracking_and_are_bounded() {
        for case in &CASES[..4] {
            let [_, [_, variance]] = moments(*case);
            let exact = (-case.0 * case.1).exp();
            for band in (0..3).filter(|band| case.0[*band] < 1.0) {
                let delta = exact[band] * (1.0 - exact[band]);
                assert!(
                    variance[band] < 0.75 * delta,
                    "{case:?}, {band}: {} {delta}",
                    variance[band]
                );
            }
        }
        // What ends at once is a step, and nothing ends twice.
        assert_eq!(attenuate(DVec3::ONE, 0, [0.999, 0.0], DVec3::ONE), (true, DVec3::ZERO));
        assert_eq!(
            attenuate(DVec3::ONE, WAY_STEPS, [0.0, 0.0], DVec3::ZERO),
            (false, DVec3::ZERO)
        );
    }
}
