//! Rows on queries and their queues, and whole renderers (`PM-ST-`, `PM-SYS-`).

use crate::catalogue::{Row, measured, part};
use crate::techniques::Bias;
use crate::transport::PathSet;

pub(super) const ROWS: &[Row] = &[
    measured(
        "clerestory report photon-queues",
        part(
            "PM-ST-2",
            "queue of queries, type I: an invocation a place of the wave",
            "Interactive Manycore Photon Mapping, 2011, §7.4.1",
            "engine/src/techniques/photon_mapping/queue.rs",
            &[
                "tests/tests/photon/queues.rs::every_queue_gives_the_same_picture",
                "tests/tests/photon/queues.rs::queues_take_queries_that_a_quota_stops",
                "tests/tests/photon/queues.rs::queues_take_places_that_all_lie_in_the_same_thousand_kernels",
            ],
        ),
    ),
    measured(
        "clerestory report photon-queues",
        part(
            "PM-ST-3",
            "queue of queries, type II: places that ask, by stream compaction",
            "Interactive Manycore Photon Mapping, 2011, §7.4.1",
            "engine/src/techniques/photon_mapping/queue.rs",
            &[
                "tests/tests/photon/queues.rs::every_queue_gives_the_same_picture",
                "tests/tests/photon/queues.rs::queues_take_queries_that_a_quota_stops",
                "tests/tests/photon/queues.rs::queues_may_stay_empty",
            ],
        ),
    ),
    measured(
        "clerestory report photon-queues",
        part(
            "PM-ST-4",
            "queue of queries, type III: places that ask, in blocks that subgroups collect in shared memory",
            "Interactive Manycore Photon Mapping, 2011, §7.4.1",
            "engine/src/techniques/photon_mapping/queue.rs",
            &[
                "tests/tests/photon/queues.rs::every_queue_gives_the_same_picture",
                "tests/tests/photon/queues.rs::queues_take_queries_that_a_quota_stops",
                "tests/tests/photon/queues.rs::queues_may_stay_empty",
                "tests/tests/photon/queues.rs::queues_never_show_on_any_number_of_threads",
            ],
        ),
    ),
    measured(
        "clerestory report photon-frame photon-queues",
        part(
            "PM-ST-5",
            "queries of the photon map, one a thread",
            "Interactive Manycore Photon Mapping, 2011, §7.4.2",
            "engine/src/techniques/photon_mapping/gather.rs",
            &[
                "tests/tests/photon/determinism.rs::queries_that_a_quota_stops_go_through_all_records",
                "tests/tests/photon/flux.rs::the_picture_has_the_flux_of_the_map",
                "tests/tests/photon/determinism.rs::threads_never_show",
            ],
        ),
    ),
    measured(
        "clerestory report photon-kernels photon-queues",
        part(
            "PM-ST-6",
            "queries of the photon map, a subgroup's together",
            "Interactive Manycore Photon Mapping, 2011, §7.4.2",
            "engine/src/techniques/photon_mapping/gather.rs",
            &["tests/tests/photon/settings.rs::points_that_ask_together_see_the_same"],
        ),
    ),
    Row {
        path_set: Some(PathSet::ALL),
        bias: Some(Bias::Consistent(
            "kernels blur what they gather, and lose light at edges, until they have shrunk",
        )),
        ..measured(
            "clerestory report photon-convergence photon-or-path photon-nearest photon-ring photon-frame photon-peers photon-settings",
            part(
                "PM-SYS-1",
                "technique `photon`: direct light and specular chains by rays, all else from a photon map, anew for each pass (stochastic progressive photon mapping)",
                "Jensen 2001; Hachisuka and Jensen 2009; Knaus and Zwicker 2011; Interactive Manycore Photon Mapping, 2011, §6.3",
                "engine/src/techniques/photon_mapping/mapper.rs",
                &[
                    "tests/tests/photon/convergence.rs::bias_and_variance_fall_as_radii_foretell",
                    "tests/tests/photon/convergence.rs::radii_fall_at_the_rate_of_the_theory",
                    "tests/tests/photon/settings.rs::every_shape_agrees_with_the_path_tracer",
                    "tests/tests/photon/settings.rs::direct_photons_and_final_gather_have_the_same_light",
                    "tests/tests/photon/settings.rs::parts_of_the_light_sum_to_the_whole",
                    "tests/tests/photon/sphere.rs::furnaces_are_uniform",
                    "tests/tests/photon/scale.rs::powers_of_two_never_show",
                    "tests/tests/photon/traps.rs::glass_is_not_black",
                    "tests/tests/photon/traps.rs::the_ring_has_its_cusp_where_geometry_puts_it",
                    "tests/tests/photon/traps.rs::colours_bleed_through_the_passage_as_they_should",
                    "tests/tests/hard_cases.rs::techniques_take_every_second_case_as_documented",
                ],
            ),
        )
    },
];
