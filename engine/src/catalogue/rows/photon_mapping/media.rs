//! Rows on light in participating media (`PM-VOL-`).

use crate::catalogue::{Row, measured, part, unbiased};
use crate::techniques::Bias;

pub(super) const ROWS: &[Row] = &[
    measured(
        "clerestory report free-flight",
        unbiased(part(
            "PM-VOL-1",
            "transmittance: analytic and by ratio tracking; ray marching as their baseline",
            "Jensen and Christensen 1998; Novák et al. 2014",
            "engine/src/transport/medium.rs",
            &[
                "tests/tests/media/absorption.rs::beers_law_is_exact",
                "tests/tests/media/absorption.rs::shadow_rays_are_attenuated_exactly",
                "tests/tests/media/heterogeneous.rs::gradients_attenuate_by_their_integral",
                "engine/src/transport/free_flight.rs::marched_transmittance_errs_by_the_step_and_in_the_middle_by_its_square",
                "engine/src/transport/free_flight.rs::ratio_tracking_is_unbiased_however_loose_the_majorant",
            ],
        )),
    ),
    measured(
        "clerestory report free-flight",
        unbiased(part(
            "PM-VOL-2",
            "free flight through homogeneous media",
            "Jensen and Christensen 1998; Wilkie et al. 2014",
            "engine/src/transport/medium.rs",
            &[
                "engine/src/transport/medium.rs::free_flights_are_unbiased_in_every_band",
                "engine/src/transport/medium.rs::extremes_stay_finite",
            ],
        )),
    ),
    Row {
        bias: Some(Bias::Consistent("the step")),
        experiment: "clerestory report free-flight",
        ..part(
            "PM-VOL-3",
            "free flight by ray marching, steps fixed or adaptive (baseline)",
            "Jensen and Christensen 1998",
            "engine/src/transport/free_flight.rs",
            &["engine/src/transport/free_flight.rs::marched_flights_are_biased_by_their_step"],
        )
    },
    measured(
        "clerestory report free-flight",
        unbiased(part(
            "PM-VOL-4",
            "free flight by delta tracking",
            "Woodcock et al. 1965; Coleman 1968",
            "engine/src/transport/medium.rs",
            &[
                "engine/src/transport/free_flight.rs::tracked_flights_follow_their_distribution_however_loose_the_majorant",
                "engine/src/transport/medium.rs::null_collisions_keep_the_expectation",
                "tests/tests/media/heterogeneous.rs::constant_grids_are_homogeneous_media",
                "tests/tests/media/heterogeneous.rs::emptiness_and_loose_majorants_cost_noise_only",
            ],
        )),
    ),
];
