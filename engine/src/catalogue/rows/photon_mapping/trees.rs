//! Rows on kd-trees, their traversal and caches, and intersections (`PM-CA-`, `PM-I-`, `PM-KD-`, `PM-TR-`).

use crate::catalogue::{Row, measured, part};

pub(super) const ROWS: &[Row] = &[
    measured(
        "clerestory report kd-caches kd-rays",
        part(
            "PM-CA-1",
            "kd node cache I: the top of the tree in shared memory",
            "Interactive Manycore Photon Mapping 2011, §4.3",
            "engine/src/accel/kd/cache.rs",
            &["engine/src/accel/kd/tests.rs::caches_change_where_work_is_done_and_no_hit"],
        ),
    ),
    measured(
        "clerestory report kd-caches kd-rays",
        part(
            "PM-CA-2",
            "node cache II: the same with boxes",
            "Interactive Manycore Photon Mapping 2011, §4.3",
            "engine/src/accel/kd/cache.rs",
            &["engine/src/accel/kd/tests.rs::caches_change_where_work_is_done_and_no_hit"],
        ),
    ),
    measured(
        "clerestory report kd-caches kd-rays",
        part(
            "PM-CA-3",
            "stack cache I: the last entry in registers",
            "Interactive Manycore Photon Mapping 2011, §4.3",
            "engine/src/accel/kd/cache.rs",
            &["engine/src/accel/kd/tests.rs::caches_change_where_work_is_done_and_no_hit"],
        ),
    ),
    measured(
        "clerestory report kd-caches kd-rays",
        part(
            "PM-CA-4",
            "stack cache II: entries as bytes in registers",
            "Interactive Manycore Photon Mapping 2011, §4.3",
            "engine/src/accel/kd/cache.rs",
            &["engine/src/accel/kd/tests.rs::caches_change_where_work_is_done_and_no_hit"],
        ),
    ),
    measured(
        "clerestory report kd-caches kd-rays",
        part(
            "PM-CA-5",
            "stack cache III: a leaf that waits",
            "Interactive Manycore Photon Mapping 2011, §4.3",
            "engine/src/accel/kd/cache.rs",
            &["engine/src/accel/kd/tests.rs::caches_change_where_work_is_done_and_no_hit"],
        ),
    ),
    measured(
        "clerestory report kd-threads",
        part(
            "PM-CA-6",
            "speculation: rays with a leaf that waits go on until all of their subgroup have one",
            "Aila and Laine 2009; Interactive Manycore Photon Mapping 2011, §4.3.2.3",
            "engine/src/accel/kd/cache.rs",
            &["tests/tests/kd.rs::votes_change_no_hit"],
        ),
    ),
    measured(
        "clerestory report kd-caches kd-rays",
        part(
            "PM-CA-7",
            "caches of nodes and of the last entry together",
            "Interactive Manycore Photon Mapping 2011, §4.3",
            "engine/src/accel/kd/cache.rs",
            &["engine/src/accel/kd/tests.rs::caches_change_where_work_is_done_and_no_hit"],
        ),
    ),
    measured(
        "clerestory report sphere-tests",
        part(
            "PM-I-1",
            "ray/sphere hit and closest approach",
            "Haines et al. 2019",
            "engine/src/accel/sphere.rs",
            &[
                "engine/src/accel/sphere.rs::approach_matches_the_definition",
                "engine/src/accel/sphere.rs::spheres_are_hit_from_outside_inside_and_behind_and_touched_once",
            ],
        ),
    ),
    measured(
        "clerestory report triangle-tests",
        part(
            "PM-I-2",
            "Möller–Trumbore triangle test (oracle in f64)",
            "Möller and Trumbore 1997",
            "engine/src/accel/triangle.rs",
            &["engine/src/accel/triangle/tests.rs::oracles_agree_with_each_other"],
        ),
    ),
    measured(
        "clerestory report triangle-tests",
        part(
            "PM-I-3",
            "projected triangle test, made ready beforehand (measured, not in the kernels)",
            "Wald 2004, 7.1",
            "engine/src/accel/triangle/wald.rs",
            &["engine/src/accel/triangle/wald.rs::hits_differ_from_the_oracle_only_near_edges"],
        ),
    ),
    measured(
        "clerestory report compact-rays",
        part(
            "PM-I-4",
            "slabs test of boxes",
            "Kay and Kajiya 1986",
            "engine/src/accel/photon_map/complete_bvh.rs",
            &[
                "engine/src/accel/photon_map/compact_bvh/tests.rs::rays_visit_the_same_leaves_in_the_same_order",
                "tests/tests/lbvh.rs::compact_queries_are_the_twins",
            ],
        ),
    ),
    measured(
        "clerestory report compact-map",
        part(
            "PM-I-5",
            "points in boxes",
            "Interactive Manycore Photon Mapping, 2011, §3.2.4.2",
            "engine/src/accel/photon_map/complete_bvh.rs",
            &["engine/src/accel/photon_map/compact_bvh/tests.rs::points_visit_the_same_leaves_in_the_same_order"],
        ),
    ),
    measured(
        "clerestory report kd-heuristics",
        part(
            "PM-KD-1",
            "kd-trees by the surface area heuristic, O(n log n), with perfect splits",
            "Wald and Havran 2006",
            "engine/src/accel/kd/build.rs",
            &[
                "engine/src/accel/kd/tests.rs::every_point_of_a_triangle_lies_in_a_leaf_that_holds_it",
                "engine/src/accel/kd/tests.rs::a_wall_ends_in_a_leaf_without_volume",
                "engine/src/accel/kd/tests.rs::bytes_do_not_depend_on_the_number_of_threads",
            ],
        ),
    ),
    measured(
        "clerestory report kd-probability",
        part(
            "PM-KD-2",
            "exact probability of a visit from inside the scene, in closed form",
            "Interactive Manycore Photon Mapping 2011, §4.1.1; Hoer and Love 1965",
            "engine/src/accel/kd/probability.rs",
            &[
                "engine/src/accel/kd/probability/tests.rs::the_closed_form_is_the_integral_of_solid_angles",
                "engine/src/accel/kd/probability/tests.rs::probabilities_are_those_of_the_reference_table",
            ],
        ),
    ),
    measured(
        "clerestory report kd-probability",
        part(
            "PM-KD-3",
            "the same by 26 regions",
            "Interactive Manycore Photon Mapping 2011, §4.1.2",
            "engine/src/accel/kd/probability.rs",
            &["engine/src/accel/kd/probability/tests.rs::probabilities_are_those_of_the_reference_table"],
        ),
    ),
    measured(
        "clerestory report kd-heuristics",
        part(
            "PM-KD-4",
            "the same by overlapping slabs (SIROH), incrementally",
            "Interactive Manycore Photon Mapping 2011, §4.1.3",
            "engine/src/accel/kd/probability.rs",
            &[
                "engine/src/accel/kd/probability/tests.rs::parts_handed_down_are_those_of_the_children",
                "engine/src/accel/kd/probability/tests.rs::every_heuristic_gives_the_scene_itself_one",
            ],
        ),
    ),
    measured(
        "clerestory report kd-traversal kd-rays",
        part(
            "PM-TR-1",
            "traversal of kd-trees with a stack",
            "Wald 2004, 7.1",
            "engine/src/accel/kd/traverse.rs",
            &[
                "engine/src/accel/kd/tests.rs::every_scheme_returns_what_trying_all_triangles_returns",
                "tests/tests/kd.rs::kernels_of_every_scheme_are_their_twins",
            ],
        ),
    ),
    measured(
        "clerestory report kd-traversal",
        part(
            "PM-TR-2",
            "restart behind a leaf in three forms, each shown to fail",
            "Foley and Sugerman 2005",
            "engine/src/accel/kd/shifted_restart.rs",
            &[
                "engine/src/accel/kd/shifted_restart_tests.rs::restarts_behind_a_leaf_fail_in_all_three_forms_and_flags_do_not",
            ],
        ),
    ),
    measured(
        "clerestory report kd-traversal kd-rays",
        part(
            "PM-TR-3",
            "the same without a stack, by a word of flags",
            "Interactive Manycore Photon Mapping 2011, §4.2.2",
            "engine/src/accel/kd/traverse.rs",
            &[
                "engine/src/accel/kd/tests.rs::every_scheme_returns_what_trying_all_triangles_returns",
                "engine/src/accel/kd/tests.rs::ways_as_long_as_the_word_of_flags_are_gone_to_their_end",
                "tests/tests/kd.rs::kernels_of_every_scheme_are_their_twins",
            ],
        ),
    ),
    measured(
        "clerestory report kd-traversal kd-rays",
        part(
            "PM-TR-4",
            "flags with push-down",
            "Horn et al. 2007",
            "engine/src/accel/kd/traverse.rs",
            &[
                "engine/src/accel/kd/tests.rs::every_scheme_returns_what_trying_all_triangles_returns",
                "tests/tests/kd.rs::kernels_of_every_scheme_are_their_twins",
            ],
        ),
    ),
    measured(
        "clerestory report kd-traversal kd-rays",
        part(
            "PM-TR-5",
            "flags with a short stack",
            "Horn et al. 2007",
            "engine/src/accel/kd/traverse.rs",
            &[
                "engine/src/accel/kd/tests.rs::every_scheme_returns_what_trying_all_triangles_returns",
                "tests/tests/kd.rs::kernels_of_every_scheme_are_their_twins",
            ],
        ),
    ),
    measured(
        "clerestory report kd-traversal kd-rays",
        part(
            "PM-TR-6",
            "flags with both",
            "Horn et al. 2007",
            "engine/src/accel/kd/traverse.rs",
            &[
                "engine/src/accel/kd/tests.rs::every_scheme_returns_what_trying_all_triangles_returns",
                "engine/src/accel/kd/tests.rs::work_is_in_the_order_of_the_schemes",
                "tests/tests/kd.rs::kernels_of_every_scheme_are_their_twins",
            ],
        ),
    ),
];
