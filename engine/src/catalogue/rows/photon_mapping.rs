//! Rows of the document on photon mapping (`PM-`).

use super::super::{Row, measured, part, unbiased};
use crate::techniques::Bias;
use crate::transport::PathSet;

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
        "clerestory report photon-kernels photon-convergence",
        part(
            "PM-DE-1",
            "density estimation with kernels of one radius",
            "Jensen 2001; Interactive Manycore Photon Mapping, 2011, §3.4.2",
            "engine/src/techniques/photon_mapping/gather.rs",
            &[
                "engine/src/techniques/photon_mapping/kernel/tests.rs::equal_disks_are_the_estimator_of_fixed_bandwidth",
                "tests/tests/photon/sphere.rs::all_reflections_sum_up_for_every_kernel",
                "tests/tests/photon/traps.rs::thin_walls_let_no_photon_through",
            ],
        ),
    ),
    measured(
        "clerestory report photon-kernels photon-settings",
        part(
            "PM-DE-2",
            "kernels: uniform, cone, Epanechnikov",
            "Jensen 2001; Silverman 1986; Interactive Manycore Photon Mapping, 2011, §3.4.2",
            "engine/src/techniques/photon_mapping/kernel.rs",
            &[
                "engine/src/techniques/photon_mapping/kernel/tests.rs::profiles_integrate_to_one_with_their_variance",
                "tests/tests/twins/photons.rs::weights_agree_with_their_twins",
                "tests/tests/photon/sphere.rs::all_reflections_sum_up_for_every_kernel",
            ],
        ),
    ),
    measured(
        "clerestory report photon-kernels",
        part(
            "PM-DE-3",
            "nearest neighbours: one kernel about each point, up to its k-th photon",
            "Jensen 2001, §7; Interactive Manycore Photon Mapping, 2011, §3.4.2.1",
            "engine/src/techniques/photon_mapping/gather.rs",
            &["tests/tests/photon/settings.rs::nearest_neighbours_agree_with_the_path_tracer"],
        ),
    ),
    measured(
        "clerestory report photon-statistics photon-kernels",
        part(
            "PM-DE-4",
            "variable kernels: a bandwidth of each photon's own",
            "Interactive Manycore Photon Mapping, 2011, §3.4.2.3",
            "engine/src/techniques/photon_mapping/gather.rs",
            &[
                "engine/src/techniques/photon_mapping/kernel/tests.rs::equal_disks_are_the_estimator_of_fixed_bandwidth",
                "engine/src/techniques/photon_mapping/kernel/tests.rs::even_light_is_estimated_without_bias",
                "tests/tests/photon/settings.rs::every_shape_agrees_with_the_path_tracer",
            ],
        ),
    ),
    measured(
        "clerestory report photon-statistics photon-kernels photon-settings",
        part(
            "PM-DE-5",
            "kernels as skewed ellipsoids of footprints, in nine numbers and a normal",
            "Interactive Manycore Photon Mapping, 2011, §5.2.1",
            "engine/src/techniques/photon_mapping/kernel.rs",
            &[
                "engine/src/techniques/photon_mapping/kernel/tests.rs::weights_are_those_of_the_inverse_matrix",
                "engine/src/techniques/photon_mapping/kernel/tests.rs::kernels_integrate_to_one_over_the_tangent_plane",
                "engine/src/techniques/photon_mapping/kernel/tests.rs::boxes_hold_the_ellipsoid_and_touch_it",
                "engine/src/techniques/photon_mapping/kernel/tests.rs::the_normal_is_no_product_of_the_axes",
                "engine/src/techniques/photon_mapping/kernel/tests.rs::records_come_back",
                "tests/tests/twins/photons.rs::kernels_agree_with_their_twins",
                "tests/tests/twins/photons.rs::records_agree_with_their_twins",
            ],
        ),
    ),
    measured(
        "clerestory report photon-statistics photon-kernels",
        part(
            "PM-DE-6",
            "dampening, clamp and discard of kernels",
            "Interactive Manycore Photon Mapping, 2011, §5.2.2",
            "engine/src/techniques/photon_mapping/kernel.rs",
            &[
                "engine/src/techniques/photon_mapping/kernel/tests.rs::dampening_takes_the_root_of_the_longer_axis",
                "engine/src/techniques/photon_mapping/kernel/tests.rs::flat_and_empty_footprints_have_no_kernel_and_long_ones_are_clamped",
                "engine/src/techniques/photon_mapping/kernel/tests.rs::scaling_the_scene_and_the_unit_scales_the_kernel",
                "engine/src/techniques/photon_mapping/kernel/room_tests.rs::kernels_cover_the_room_as_published",
                "engine/src/techniques/photon_mapping/kernel/room_tests.rs::stronger_dampening_means_fewer_kernels_over_a_point",
                "engine/src/techniques/photon_mapping/kernel/room_tests.rs::the_room_looks_the_same_at_every_scale_when_the_unit_goes_with_it",
            ],
        ),
    ),
    measured(
        "clerestory agreement --scene cornell-point,sphere-flake",
        part(
            "PM-F-1",
            "radiometry of point and spot lights, split into direct and indirect light",
            "Veach 1997, chapter 3; Khronos, KHR_lights_punctual",
            "engine/src/transport/lights.rs",
            &[
                "engine/src/transport/lights.rs::point_light_irradiance_and_flux",
                "engine/src/transport/lights.rs::spot_flux_and_falloff",
                "tests/tests/path_tracer.rs::point_spot_and_directional_lights_follow_their_laws",
                "tests/tests/path_tracer.rs::path_sets_are_a_partition",
            ],
        ),
    ),
    measured(
        "clerestory agreement --scene cornell-box,cornell-mirror,cornell-glass",
        unbiased(part(
            "PM-F-2",
            "surface models: Lambert, mirror, refraction (path tracer); modified Phong (function)",
            "Lafortune and Willems 1994; Walter et al. 2007",
            "engine/src/transport/phong.rs",
            &[
                "engine/src/transport/phong.rs::white_furnace",
                "engine/src/transport/phong.rs::reciprocal",
                "engine/src/transport/phong.rs::samples_follow_their_density",
                "engine/src/transport/bsdf/tests.rs::specular_zero_is_exactly_lambert",
                "engine/src/transport/bsdf/tests.rs::clear_solid_is_the_smooth_dielectric",
                "tests/tests/path_tracer.rs::smooth_slabs_transmit_and_reflect_in_closed_form",
            ],
        )),
    ),
    measured(
        "clerestory report phase-functions",
        unbiased(part(
            "PM-F-3",
            "phase functions of Henyey and Greenstein, Schlick and Rayleigh",
            "Henyey and Greenstein 1941; Blasi, Le Saëc and Schlick 1993",
            "engine/src/transport/phase.rs",
            &[
                "engine/src/transport/phase.rs::normalised_with_their_mean_cosines",
                "engine/src/transport/phase.rs::samples_follow_their_density",
            ],
        )),
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
    measured(
        "clerestory report photon-statistics",
        part(
            "PM-PD-0",
            "photon differentials: four vectors and one global step",
            "Igehy 1999; Schjøth et al. 2007; Interactive Manycore Photon Mapping, 2011, §3.1.2 and §5.1",
            "engine/src/transport/differentials/mod.rs",
            &[
                "engine/src/transport/differentials/chain_tests.rs::chains_of_events_agree_with_finite_differences",
                "engine/src/transport/differentials/footprint_tests.rs::scaling_the_scene_scales_positions_alone",
                "engine/src/transport/differentials/footprint_tests.rs::what_is_not_a_number_or_too_large_is_zeroed",
                "tests/tests/twins/photons.rs::guards_agree_with_their_twins",
            ],
        ),
    ),
    measured(
        "clerestory report photon-statistics",
        part(
            "PM-PD-1",
            "differentials of emission",
            "Interactive Manycore Photon Mapping, 2011, §5.1.1",
            "engine/src/transport/differentials/mod.rs",
            &[
                "engine/src/transport/differentials/footprint_tests.rs::emitted_photons_share_what_they_meet",
                "engine/src/transport/differentials/footprint_tests.rs::lights_with_area_and_beams_share_their_surface",
                "tests/tests/twins/photons.rs::emissions_agree_with_their_twins",
            ],
        ),
    ),
    measured(
        "clerestory report photon-statistics",
        part(
            "PM-PD-2",
            "differentials of propagation to a surface",
            "Igehy 1999; Interactive Manycore Photon Mapping, 2011, §3.1.2.3",
            "engine/src/transport/differentials/mod.rs",
            &[
                "engine/src/transport/differentials/chain_tests.rs::each_event_agrees_with_finite_differences",
                "engine/src/transport/differentials/footprint_tests.rs::grazing_transfers_stay_finite_and_in_the_plane",
                "tests/tests/twins/photons.rs::events_agree_with_their_twins",
            ],
        ),
    ),
    measured(
        "clerestory report photon-statistics",
        part(
            "PM-PD-3",
            "differentials of mirror reflection",
            "Igehy 1999; Interactive Manycore Photon Mapping, 2011, §3.1.2.4",
            "engine/src/transport/differentials/mod.rs",
            &[
                "engine/src/transport/differentials/chain_tests.rs::the_printed_reflection_is_wrong",
                "engine/src/transport/differentials/chain_tests.rs::each_event_agrees_with_finite_differences",
                "engine/src/transport/differentials/footprint_tests.rs::a_concave_mirror_about_the_light_focuses_to_nothing",
                "engine/src/transport/differentials/footprint_tests.rs::mirrors_and_flat_glass_have_the_areas_of_unfolded_paths",
            ],
        ),
    ),
    measured(
        "clerestory report photon-statistics",
        part(
            "PM-PD-4",
            "derivatives of interpolated normals from a hit's coordinates",
            "Interactive Manycore Photon Mapping, 2011, §5.1.2",
            "engine/src/transport/differentials/mod.rs",
            &[
                "engine/src/transport/differentials/chain_tests.rs::derivatives_of_normals_agree_with_finite_differences",
                "tests/tests/twins/photons.rs::derivatives_of_normals_agree_with_their_twins",
            ],
        ),
    ),
    measured(
        "clerestory report photon-kernels",
        part(
            "PM-PD-5",
            "differentials of refraction",
            "Igehy 1999; Interactive Manycore Photon Mapping, 2011, §3.1.2.5",
            "engine/src/transport/differentials/mod.rs",
            &[
                "engine/src/transport/differentials/chain_tests.rs::each_event_agrees_with_finite_differences",
                "engine/src/transport/differentials/footprint_tests.rs::mirrors_and_flat_glass_have_the_areas_of_unfolded_paths",
            ],
        ),
    ),
    measured(
        "clerestory report photon-statistics",
        part(
            "PM-PD-6",
            "differentials of diffuse reflection: absorbed and emitted anew",
            "Interactive Manycore Photon Mapping, 2011, §5.1.3",
            "engine/src/transport/differentials/mod.rs",
            &[
                "engine/src/transport/differentials/footprint_tests.rs::reemission_keeps_the_expected_area",
                "engine/src/techniques/photon_mapping/kernel/room_tests.rs::footprints_after_a_diffuse_bounce_follow_the_density_of_photons",
                "engine/src/transport/differentials/path_differentials.rs::reemission_stands_between_its_two_parameters_and_all_four",
            ],
        ),
    ),
    measured(
        "clerestory report photon-statistics",
        part(
            "PM-PD-7",
            "differentials of Russian roulette",
            "Interactive Manycore Photon Mapping, 2011, §5.1.4",
            "engine/src/transport/differentials/mod.rs",
            &["engine/src/transport/differentials/footprint_tests.rs::roulette_makes_up_for_those_that_it_ends"],
        ),
    ),
    measured(
        "clerestory report photon-statistics",
        part(
            "PM-PD-8",
            "path differentials (reference)",
            "Suykens and Willems 2001; Interactive Manycore Photon Mapping, 2011, §3.1.2.5",
            "engine/src/transport/differentials/path_differentials.rs",
            &[
                "engine/src/transport/differentials/path_differentials.rs::two_parameters_are_photon_differentials",
                "engine/src/transport/differentials/path_differentials.rs::parallelograms_fill_the_footprint",
                "engine/src/transport/differentials/path_differentials.rs::scattering_derivatives_agree_with_finite_differences",
            ],
        ),
    ),
    measured(
        "clerestory report photon-statistics",
        part(
            "PM-PD-13",
            "differentials of camera rays",
            "Igehy 1999",
            "engine/src/transport/differentials/mod.rs",
            &[
                "engine/src/transport/differentials/footprint_tests.rs::camera_footprints_are_pixels",
                "tests/tests/twins/photons.rs::emissions_agree_with_their_twins",
            ],
        ),
    ),
    measured(
        "clerestory report photon-statistics photon-frame",
        part(
            "PM-PH-1",
            "photon tracing on surfaces, from every kind of light",
            "Jensen 2001; Interactive Manycore Photon Mapping, 2011, §3.4.1 and §5.2.3",
            "engine/src/techniques/photon_mapping/tracer.rs",
            &[
                "tests/tests/photon/flux.rs::closed_rooms_keep_every_photon_and_lose_flux_by_reflection_alone",
                "tests/tests/photon/flux.rs::photons_that_leave_are_counted",
                "tests/tests/photon/lights.rs::points_spots_and_suns_shine_as_they_should",
                "tests/tests/photon/lights.rs::lamps_and_skies_shine_as_they_should",
                "tests/tests/photon/materials.rs::walls_of_all_kinds_light_the_floor",
                "tests/tests/photon/determinism.rs::runs_are_equal_and_seeds_are_not",
            ],
        ),
    ),
    measured(
        "clerestory report photon-statistics",
        part(
            "PM-PH-2",
            "random numbers of photons: Owen-scrambled Sobol' points, or independent",
            "Owen 1995; Interactive Manycore Photon Mapping, 2011, §3.3.3",
            "engine/src/techniques/photon_mapping/tracer.rs",
            &[
                "engine/src/techniques/photon.rs::every_setting_is_explained",
                "tests/tests/photon/determinism.rs::runs_are_equal_and_seeds_are_not",
                "tests/tests/photon/sphere.rs::reflections_in_a_sphere_are_those_of_the_closed_form",
            ],
        ),
    ),
    measured(
        "clerestory report photon-kernels",
        part(
            "PM-ST-6",
            "queries of the photon map, a subgroup's together",
            "Interactive Manycore Photon Mapping, 2011, §7.4.2",
            "engine/src/techniques/photon_mapping/gather.rs",
            &["tests/tests/photon/settings.rs::points_that_ask_together_see_the_same"],
        ),
    ),
    measured(
        "clerestory report photon-frame",
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
    Row {
        path_set: Some(PathSet::ALL),
        bias: Some(Bias::Consistent(
            "kernels blur what they gather, and lose light at edges, until they have shrunk",
        )),
        ..measured(
            "clerestory report photon-convergence photon-or-path photon-frame photon-settings",
            part(
                "PM-SYS-1",
                "technique `photon`: direct light and specular chains by rays, all else from a photon map, anew for each pass (stochastic progressive photon mapping)",
                "Jensen 2001; Hachisuka and Jensen 2009; Knaus and Zwicker 2011; Interactive Manycore Photon Mapping, 2011, §6.3",
                "engine/src/techniques/photon_mapping/mapper.rs",
                &[
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
