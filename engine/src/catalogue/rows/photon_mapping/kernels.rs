//! Rows on building blocks over streams, and models of devices and threads (`PM-B-`, `PM-X-`).

use crate::catalogue::{Row, measured, part};

pub(super) const ROWS: &[Row] = &[
    measured(
        "clerestory bench --sort",
        part(
            "PM-B-1",
            "inclusive and exclusive scan, segmented scan, reductions",
            "Blelloch 1990; Sengupta et al. 2007; Dotsenko et al. 2008",
            "engine/src/kernels/scan.rs",
            &[
                "tests/tests/kernels/blocks.rs::scans_are_as_their_twin",
                "tests/tests/kernels/blocks.rs::reductions_of_words_are_as_their_twin",
                "tests/tests/kernels/blocks.rs::boxes_are_exact_and_leave_nans_out",
                "engine/src/kernels/stream.rs::every_element_is_in_one_block",
            ],
        ),
    ),
    measured(
        "clerestory bench --sort",
        part(
            "PM-B-2",
            "stream compaction",
            "Blelloch 1990",
            "engine/src/kernels/partition.rs",
            &["tests/tests/kernels/blocks.rs::partitions_are_as_their_twins"],
        ),
    ),
    measured(
        "clerestory bench --sort",
        part(
            "PM-B-3",
            "split",
            "Blelloch 1990",
            "engine/src/kernels/partition.rs",
            &[
                "tests/tests/kernels/blocks.rs::partitions_are_as_their_twins",
                "tests/tests/kernels/blocks.rs::splits_by_bits_sort",
            ],
        ),
    ),
    measured(
        "clerestory bench --sort --peers",
        part(
            "PM-B-4",
            "radix sort of 32- and 64-bit keys, with or without values",
            "Satish, Harris and Garland 2009; Ashkiani et al. 2016",
            "engine/src/kernels/radix_sort.rs",
            &[
                "tests/tests/kernels/sort.rs::every_size_and_pattern_is_as_by_std",
                "tests/tests/kernels/sort.rs::bits_and_orders_are_those_asked_for",
                "tests/tests/kernels/sort.rs::repeated_sorts_give_the_same_bits_in_every_form",
                "tests/tests/kernels/sort.rs::many_keys_take_the_other_plan",
                "tests/tests/kernels/many_sorts.rs::sorts_of_random_sizes_and_patterns_are_as_by_std",
            ],
        ),
    ),
    measured(
        "clerestory report device-model",
        part(
            "PM-X-0",
            "cost model of the device: dependent loads, copies, tickets of a queue, boundaries",
            "Interactive Manycore Photon Mapping, 2011, §2.2.2 to §2.2.4; Wong et al. 2010",
            "engine/src/kernels/device_model.rs",
            &[
                "engine/src/kernels/device_model.rs::chains_visit_every_place_before_they_come_back",
                "tests/tests/kernels/device_model.rs::timed_runs_have_walked_copied_and_counted_what_was_asked",
            ],
        ),
    ),
    measured(
        "clerestory report persistent-threads kd-threads",
        part(
            "PM-X-1",
            "closest hits of a buffer of rays: one thread a ray",
            "Aila and Laine 2009",
            "engine/src/accel/trace.rs",
            &[
                "tests/tests/persistent_threads.rs::both_models_trace_every_ray_once_and_find_what_the_twin_finds",
                "tests/tests/ray_index.rs::kernels_are_their_twins_on_soups",
                "tests/tests/ray_index.rs::kernels_are_their_twins_on_hard_cases",
            ],
        ),
    ),
    measured(
        "clerestory report persistent-threads kd-threads",
        part(
            "PM-X-2",
            "closest hits of a buffer of rays: persistent threads on a queue with quotas",
            "Aila and Laine 2009; Interactive Manycore Photon Mapping, 2011, §2.2.3.4",
            "engine/src/accel/trace.rs",
            &[
                "tests/tests/persistent_threads.rs::both_models_trace_every_ray_once_and_find_what_the_twin_finds",
                "tests/tests/persistent_threads.rs::a_queue_without_a_quota_loses_rays_where_loops_are_capped_and_one_with_a_quota_none",
                "tests/tests/persistent_threads.rs::settings_that_could_lose_rays_are_refused",
            ],
        ),
    ),
    measured(
        "clerestory report compact-map compact-rays",
        part(
            "PM-X-3",
            "traffic model: every access served by itself, as exact counts of bytes",
            "Interactive Manycore Photon Mapping, 2011, §4.3.3",
            "engine/src/accel/photon_map/complete_bvh.rs",
            &[
                "engine/src/accel/photon_map/compact_bvh/tests.rs::points_visit_the_same_leaves_in_the_same_order",
                "engine/src/accel/photon_map/compact_bvh/tests.rs::rays_visit_the_same_leaves_in_the_same_order",
            ],
        ),
    ),
];
