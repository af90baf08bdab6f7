//! Rows on the photon map (`PM-MAP-`).

use crate::catalogue::{Row, measured, part};

pub(super) const ROWS: &[Row] = &[
    measured(
        "clerestory report map-quality",
        part(
            "PM-MAP-3",
            "tree by the voxel volume heuristic",
            "Interactive Manycore Photon Mapping, 2011, §6.1.1",
            "engine/src/accel/photon_map/vvh.rs",
            &["engine/src/accel/photon_map/tests.rs::sweeps_are_valid_and_beat_the_linear_tree"],
        ),
    ),
    measured(
        "clerestory report map-construction merge-example",
        part(
            "PM-MAP-4",
            "linear hierarchy by split lists",
            "Lauterbach et al. 2009",
            "engine/src/accel/photon_map/split_lists.rs",
            &["engine/src/accel/photon_map/tests.rs::merging_split_lists_and_clusters_make_the_tree_of_the_definition"],
        ),
    ),
    measured(
        "clerestory report map-construction map-quality merge-example",
        part(
            "PM-MAP-5",
            "linear hierarchy by merging",
            "Interactive Manycore Photon Mapping, 2011, §6.1.2",
            "engine/src/accel/photon_map/merge.rs",
            &[
                "engine/src/accel/photon_map/tests.rs::the_worked_example_of_the_merge_comes_out_step_by_step",
                "engine/src/accel/photon_map/tests.rs::merging_split_lists_and_clusters_make_the_tree_of_the_definition",
            ],
        ),
    ),
    measured(
        "clerestory report leaf-sizes",
        part(
            "PM-MAP-6",
            "automatic leaf size of photon maps",
            "Interactive Manycore Photon Mapping, 2011, §6.1.3",
            "engine/src/accel/photon_map/leaf_threshold.rs",
            &["engine/src/accel/photon_map/leaf_threshold.rs::leaf_sizes_follow_the_cover_of_the_scene"],
        ),
    ),
    measured(
        "clerestory report compact-map",
        part(
            "PM-MAP-7",
            "complete nodes and sibling pairs",
            "Interactive Manycore Photon Mapping, 2011, §6.2.4",
            "engine/src/accel/photon_map/complete_bvh.rs",
            &["engine/src/accel/photon_map/compact_bvh/tests.rs::pairs_are_recovered_to_the_bit_from_half_the_bytes"],
        ),
    ),
    measured(
        "clerestory report compact-map",
        part(
            "PM-MAP-8",
            "compact sibling pairs",
            "Interactive Manycore Photon Mapping, 2011, §6.2.1",
            "engine/src/accel/photon_map/compact_bvh.rs",
            &[
                "engine/src/accel/photon_map/compact_bvh/tests.rs::pairs_are_recovered_to_the_bit_from_half_the_bytes",
                "engine/src/accel/photon_map/compact_bvh/tests.rs::loose_boxes_are_refused",
            ],
        ),
    ),
    measured(
        "clerestory report compact-map photon-frame",
        part(
            "PM-MAP-9",
            "point queries on compact pairs",
            "Interactive Manycore Photon Mapping, 2011, §6.2.3",
            "engine/src/accel/photon_map/compact_bvh.rs",
            &[
                "engine/src/accel/photon_map/compact_bvh/tests.rs::points_visit_the_same_leaves_in_the_same_order",
                "tests/tests/lbvh.rs::compact_queries_are_the_twins",
            ],
        ),
    ),
    measured(
        "clerestory report compact-rays",
        part(
            "PM-MAP-10",
            "ray queries on compact pairs",
            "Interactive Manycore Photon Mapping, 2011, §6.2.2",
            "engine/src/accel/photon_map/compact_bvh.rs",
            &[
                "engine/src/accel/photon_map/compact_bvh/tests.rs::rays_visit_the_same_leaves_in_the_same_order",
                "tests/tests/lbvh.rs::compact_queries_are_the_twins",
            ],
        ),
    ),
    measured(
        "clerestory report map-construction",
        part(
            "PM-MAP-11",
            "linear hierarchy by clusters",
            "Pantaleoni and Luebke 2010",
            "engine/src/accel/photon_map/clustered.rs",
            &[
                "engine/src/accel/photon_map/tests.rs::sorting_by_clusters_is_the_stable_sort",
                "engine/src/accel/photon_map/tests.rs::merging_split_lists_and_clusters_make_the_tree_of_the_definition",
            ],
        ),
    ),
];
