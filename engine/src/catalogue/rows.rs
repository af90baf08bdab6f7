//! The rows, ordered by document and id. Tests that speak for several systems have a name of their own.

use super::{Row, measured, part, unbiased};
use crate::techniques::Bias;
use crate::transport::PathSet;

const RADIOMETRY: &[&str] = &[
    "engine/src/transport/lights.rs::point_light_irradiance_and_flux",
    "engine/src/transport/lights.rs::spot_flux_and_falloff",
    "engine/src/transport/lights.rs::a_triangle_seen_by_its_density_has_its_solid_angle",
    "tests/tests/path_tracer.rs::point_spot_and_directional_lights_follow_their_laws",
    "tests/tests/path_tracer.rs::closed_furnaces_have_the_radiance_of_the_geometric_series",
];
const SAMPLING: &[&str] = &[
    "engine/src/transport/warp.rs::directions_follow_their_density",
    "engine/src/transport/bsdf/tests.rs::samples_follow_their_density",
    "engine/src/transport/bsdf/tests.rs::weight_is_value_over_density_and_density_integrates",
    "tests/tests/samplers.rs::warps_keep_areas",
    "tests/tests/samplers.rs::pairs_fill_the_square_evenly",
];
const PATH_TRACER: &[&str] = &[
    "tests/tests/path_tracer.rs::closed_furnaces_have_the_radiance_of_the_geometric_series",
    "tests/tests/path_tracer.rs::a_light_in_a_lambert_sphere_fills_it_evenly",
    "tests/tests/path_tracer.rs::white_objects_vanish_in_a_white_furnace",
    "tests/tests/path_tracer.rs::point_spot_and_directional_lights_follow_their_laws",
    "tests/tests/path_tracer.rs::environments_light_a_plane_by_their_cosine_integral",
    "tests/tests/path_tracer.rs::smooth_slabs_transmit_and_reflect_in_closed_form",
    "tests/tests/path_tracer.rs::rough_glass_loses_what_the_f64_twin_says",
    "tests/tests/media/homogeneous.rs::fluence_about_a_source_is_the_exact_one",
    "tests/tests/media/homogeneous.rs::rays_past_a_source_have_the_exact_multiple_scattering",
    "tests/tests/media/slab.rs::reflectance_and_transmittance_are_those_of_the_tables",
    "tests/tests/media/mechanics.rs::parts_of_everything_sum_to_the_whole",
    "tests/tests/hard_cases.rs::techniques_take_every_second_case_as_documented",
    "tests/tests/hard_cases.rs::techniques_take_the_cases_between_as_documented",
    "tests/tests/determinism.rs::threads_of_the_driver_and_of_the_host_never_show",
];
const TRANSPORT_EQUATION: &[&str] = &[
    "engine/src/transport/lights.rs::a_triangle_seen_by_its_density_has_its_solid_angle",
    "engine/src/transport/phase.rs::normalised_with_their_mean_cosines",
    "engine/src/transport/phase.rs::samples_follow_their_density",
    "tests/tests/path_tracer.rs::closed_furnaces_have_the_radiance_of_the_geometric_series",
    "tests/tests/media/absorption.rs::beers_law_is_exact",
    "tests/tests/media/absorption.rs::emission_is_integrated_exactly",
    "tests/tests/media/furnace.rs::lossless_media_vanish",
];
const FREE_FLIGHT: &[&str] = &[
    "engine/src/transport/medium.rs::free_flights_are_unbiased_in_every_band",
    "engine/src/transport/medium.rs::null_collisions_keep_the_expectation",
    "engine/src/transport/medium.rs::equi_angular_samples_follow_their_density",
    "tests/tests/twins/media.rs::free_flight",
    "tests/tests/media/homogeneous.rs::single_scattering_is_the_airlight_integral",
    "tests/tests/media/heterogeneous.rs::gradients_attenuate_by_their_integral",
    "tests/tests/media/heterogeneous.rs::constant_grids_are_homogeneous_media",
    "tests/tests/media/heterogeneous.rs::layered_slabs_depend_on_their_optical_depth_alone",
    "tests/tests/media/slab.rs::bands_of_a_chromatic_medium_are_those_of_grey_ones",
];
const ESTIMATION: &[&str] = &[
    "engine/src/transport/lights.rs::heuristics_sum_to_one",
    "tests/tests/path_tracer.rs::lights_are_chosen_in_the_end_as_often_as_their_weights_say",
    "tests/tests/path_tracer.rs::closed_furnaces_have_the_radiance_of_the_geometric_series",
    "tests/tests/path_tracer.rs::the_variance_layer_is_the_variance_of_the_means",
    "tests/tests/path_tracer.rs::sobol_draws_have_the_same_expectation_and_less_variance_between_seeds",
];

pub(super) const ROWS: &[Row] = &[
    measured(
        "clerestory report error-in-media",
        part(
            "BG-1",
            "radiometry, transport between surfaces and in media",
            "Chandrasekhar 1960; Veach 1997, chapter 3",
            "engine/src/transport/medium.rs",
            TRANSPORT_EQUATION,
        ),
    ),
    measured(
        "clerestory report convergence",
        unbiased(part(
            "BG-2",
            "Monte Carlo and importance sampling",
            "Veach 1997, chapters 2 and 9",
            "engine/src/transport/warp.rs",
            SAMPLING,
        )),
    ),
    Row {
        path_set: Some(PathSet::ALL),
        experiment: "clerestory report error-against-time",
        ..unbiased(part(
            "BG-3",
            "path tracer, surfaces and media: technique `path`",
            "Kajiya 1986; Veach 1997, chapters 9 and 10; Laine, Karras and Aila 2013",
            "engine/src/transport/path_tracer/mod.rs",
            PATH_TRACER,
        ))
    },
    measured(
        "clerestory agreement --scene fog-box,smoke",
        unbiased(part(
            "BG-4",
            "free flight and transmittance: analytic, delta and ratio tracking, equi-angular",
            "Woodcock et al. 1965; Kulla and Fajardo 2012; Novák et al. 2014; Miller et al. 2019",
            "engine/src/transport/path_tracer/mod.rs",
            FREE_FLIGHT,
        )),
    ),
    measured(
        "clerestory index --peers",
        part(
            "BG-14",
            "ray index: binary BVH by binned surface-area heuristic",
            "Wald 2007; Aila and Laine 2009; Laine 2010; Ize 2013",
            "engine/src/accel/bvh2.rs",
            &[
                "engine/src/accel/bvh2/tests.rs::traversal_equals_trying_all_triangles_bit_for_bit",
                "engine/src/accel/bvh2/tests.rs::hits_agree_with_f64_up_to_their_stated_error",
                "engine/src/accel/bvh2/tests.rs::no_ray_passes_between_the_triangles_of_a_sphere",
                "engine/src/accel/bvh2/tests.rs::stopped_traversals_go_on_without_loss_or_repetition",
                "tests/tests/ray_index.rs::kernels_are_their_twins_on_soups",
                "tests/tests/ray_index.rs::kernels_are_their_twins_on_hard_cases",
                "tests/tests/hard_cases.rs::ray_indexes_answer_as_a_search_through_all_triangles",
            ],
        ),
    ),
    measured(
        "clerestory agreement --scene box-city-sky",
        part(
            "DP-1",
            "latitude–longitude map (y up, as glTF)",
            "Blinn and Newell 1976",
            "engine/src/transport/environment.rs",
            &["engine/src/transport/environment.rs::directions_and_coordinates_agree"],
        ),
    ),
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
                "tests/tests/kernels/sort.rs::runs_give_the_same_bits",
                "tests/tests/kernels/sort.rs::many_keys_take_the_other_plan",
                "tests/tests/kernels/many_sorts.rs::sorts_of_random_sizes_and_patterns_are_as_by_std",
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
                "engine/src/accel/sphere.rs::sphere_hits_inside_outside_tangent_and_behind",
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
        "clerestory report compact-rays",
        part(
            "PM-I-4",
            "slabs test of boxes",
            "Kay and Kajiya 1986",
            "engine/src/accel/complete_bvh.rs",
            &[
                "engine/src/accel/compact_bvh/tests.rs::rays_visit_the_same_leaves_in_the_same_order",
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
            "engine/src/accel/complete_bvh.rs",
            &["engine/src/accel/compact_bvh/tests.rs::points_visit_the_same_leaves_in_the_same_order"],
        ),
    ),
    measured(
        "clerestory report map-quality",
        part(
            "PM-MAP-3",
            "tree by the voxel volume heuristic",
            "Interactive Manycore Photon Mapping, 2011, §6.1.1",
            "engine/src/accel/vvh.rs",
            &["engine/src/accel/lbvh/builders_tests.rs::sweeps_are_valid_and_beat_the_linear_tree"],
        ),
    ),
    measured(
        "clerestory report map-construction merge-example",
        part(
            "PM-MAP-4",
            "linear hierarchy by split lists",
            "Lauterbach et al. 2009",
            "engine/src/accel/lbvh/split_lists.rs",
            &[
                "engine/src/accel/lbvh/builders_tests.rs::merging_split_lists_and_clusters_make_the_tree_of_the_definition",
            ],
        ),
    ),
    measured(
        "clerestory report map-construction map-quality merge-example",
        part(
            "PM-MAP-5",
            "linear hierarchy by merging",
            "Interactive Manycore Photon Mapping, 2011, §6.1.2",
            "engine/src/accel/lbvh/merge.rs",
            &[
                "engine/src/accel/lbvh/builders_tests.rs::the_worked_example_of_the_merge_comes_out_step_by_step",
                "engine/src/accel/lbvh/builders_tests.rs::merging_split_lists_and_clusters_make_the_tree_of_the_definition",
            ],
        ),
    ),
    measured(
        "clerestory report leaf-sizes",
        part(
            "PM-MAP-6",
            "automatic leaf size of photon maps",
            "Interactive Manycore Photon Mapping, 2011, §6.1.3",
            "engine/src/accel/lbvh/leaf_threshold.rs",
            &["engine/src/accel/lbvh/leaf_threshold.rs::leaf_sizes_follow_the_cover_of_the_scene"],
        ),
    ),
    measured(
        "clerestory report compact-map",
        part(
            "PM-MAP-7",
            "complete nodes and sibling pairs",
            "Interactive Manycore Photon Mapping, 2011, §6.2.4",
            "engine/src/accel/complete_bvh.rs",
            &["engine/src/accel/compact_bvh/tests.rs::pairs_are_recovered_to_the_bit_from_half_the_bytes"],
        ),
    ),
    measured(
        "clerestory report compact-map",
        part(
            "PM-MAP-8",
            "compact sibling pairs",
            "Interactive Manycore Photon Mapping, 2011, §6.2.1",
            "engine/src/accel/compact_bvh.rs",
            &[
                "engine/src/accel/compact_bvh/tests.rs::pairs_are_recovered_to_the_bit_from_half_the_bytes",
                "engine/src/accel/compact_bvh/tests.rs::loose_boxes_are_refused",
            ],
        ),
    ),
    measured(
        "clerestory report compact-map",
        part(
            "PM-MAP-9",
            "point queries on compact pairs",
            "Interactive Manycore Photon Mapping, 2011, §6.2.3",
            "engine/src/accel/compact_bvh.rs",
            &[
                "engine/src/accel/compact_bvh/tests.rs::points_visit_the_same_leaves_in_the_same_order",
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
            "engine/src/accel/compact_bvh.rs",
            &[
                "engine/src/accel/compact_bvh/tests.rs::rays_visit_the_same_leaves_in_the_same_order",
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
            "engine/src/accel/lbvh/clustered.rs",
            &[
                "engine/src/accel/lbvh/builders_tests.rs::sorting_by_clusters_is_the_stable_sort",
                "engine/src/accel/lbvh/builders_tests.rs::merging_split_lists_and_clusters_make_the_tree_of_the_definition",
            ],
        ),
    ),
    measured(
        "clerestory report persistent-threads",
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
        "clerestory report persistent-threads",
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
        "clerestory agreement --scene cornell-box,cornell-point",
        part(
            "MET-B1",
            "radiometry and rendering equation",
            "Kajiya 1986",
            "engine/src/transport/lights.rs",
            RADIOMETRY,
        ),
    ),
    measured(
        "clerestory agreement --scene furnace-metal,furnace-glass",
        unbiased(part(
            "MET-B2",
            "microfacet product of distribution, masking and Fresnel factor",
            "Walter et al. 2007; Heitz 2014",
            "engine/src/transport/bsdf/mod.rs",
            &[
                "engine/src/transport/bsdf/tests.rs::white_furnace",
                "engine/src/transport/bsdf/tests.rs::reflection_is_reciprocal_and_transmission_up_to_eta_squared",
                "engine/src/transport/bsdf/tests.rs::samples_follow_their_density",
            ],
        )),
    ),
    measured(
        "clerestory report coupled-reflection",
        unbiased(part(
            "MET-B7",
            "coupled matte and specular reflection",
            "Kelemen and Szirmay-Kalos 2001; Shirley et al. 1997",
            "engine/src/transport/bsdf/mod.rs",
            &[
                "engine/src/transport/bsdf/tests.rs::white_furnace",
                "engine/src/transport/bsdf/tests.rs::reflection_is_reciprocal_and_transmission_up_to_eta_squared",
            ],
        )),
    ),
    measured(
        "clerestory report roulette",
        unbiased(part(
            "MET-B8",
            "path estimation: light sampling, BRDF sampling, Russian roulette",
            "Kajiya 1986; Veach 1997, chapters 9 and 10",
            "engine/src/transport/path_tracer/mod.rs",
            ESTIMATION,
        )),
    ),
    measured(
        "clerestory agreement --scene cornell-metals,ring-mirror",
        part(
            "MET-F1",
            "exact unpolarised conductor Fresnel",
            "Born and Wolf, Principles of Optics, 14.2",
            "engine/src/transport/fresnel.rs",
            &["engine/src/transport/fresnel.rs::conductor_without_extinction_is_the_dielectric"],
        ),
    ),
    measured(
        "clerestory agreement --scene cornell-glass",
        part(
            "CL-FRESNEL",
            "exact dielectric Fresnel",
            "Born and Wolf, Principles of Optics, 1.5",
            "engine/src/transport/fresnel.rs",
            &["engine/src/transport/fresnel.rs::dielectric_equals_the_textbook_form_and_its_edges"],
        ),
    ),
    measured(
        "clerestory agreement --scene cornell-metals",
        part(
            "CL-METALS",
            "measured metals: gold, silver, copper, aluminium, iron, chromium, titanium, nickel, cobalt",
            "Johnson and Christy 1972, 1974; Rakić 1995",
            "engine/src/scene/metals/mod.rs",
            &[
                "engine/src/scene/metals/mod.rs::spectra_reflect_what_others_computed_of_them",
                "engine/src/scene/metals/mod.rs::channels_reflect_as_their_spectra_do",
                "engine/src/scene/metals/mod.rs::channels_reflect_like_other_samples_of_the_metals",
            ],
        ),
    ),
    measured(
        "clerestory agreement --scene cornell-frosted,ring-rough",
        unbiased(part(
            "CL-GGX",
            "GGX distribution, height-correlated masking, visible normals by spherical caps",
            "Walter et al. 2007; Heitz 2014; Dupuy and Benyoub 2023",
            "engine/src/transport/ggx.rs",
            &[
                "engine/src/transport/ggx.rs::densities_are_normalised",
                "engine/src/transport/ggx.rs::visible_normals_follow_their_density",
                "engine/src/transport/ggx.rs::masking_limits",
                "tests/tests/samplers.rs::visible_normals_follow_their_density",
            ],
        )),
    ),
    measured(
        "clerestory report multiple-scattering",
        part(
            "CL-MULTISCATTER",
            "compensation of rough metals for scattering among microfacets",
            "Kulla and Conty 2017",
            "engine/src/transport/albedo.rs",
            &[
                "engine/src/transport/bsdf/tests.rs::white_furnace",
                "engine/src/transport/bsdf/tests.rs::albedo_table_interpolates_within_its_bound",
            ],
        ),
    ),
    measured(
        "clerestory report shading-normals",
        part(
            "CL-NORMALS",
            "shading normals and normal maps that never gain energy",
            "Veach 1997, 5.3 (the problem; the bend towards the viewer is the engine's own)",
            "engine/src/transport/shading_normal.rs",
            &[
                "engine/src/transport/shading_normal.rs::adapted_normals_face_the_viewer_and_lose_energy_only",
                "engine/src/transport/shading_normal.rs::flat_maps_keep_the_normal",
            ],
        ),
    ),
    measured(
        "clerestory report samplers",
        unbiased(part(
            "CL-SOBOL",
            "Owen-scrambled Sobol' points by hashing",
            "Burley 2020; Laine and Karras 2011",
            "engine/src/transport/random.rs",
            &[
                "engine/src/transport/random.rs::pascal_steps_equal_the_direction_numbers",
                "engine/src/transport/random.rs::sobol_pairs_are_stratified_plain_and_scrambled",
                "engine/src/transport/random.rs::owen_hash_changes_a_bit_by_the_lower_bits_only",
                "tests/tests/samplers.rs::sobol_samples_of_a_pixel_are_stratified",
            ],
        )),
    ),
    measured(
        "clerestory agreement",
        unbiased(part(
            "CL-PCG",
            "counter-based random numbers by PCG hashes",
            "Jarzynski and Olano 2020",
            "engine/src/transport/random.rs",
            &[
                "engine/src/transport/random.rs::pcg_avalanche_and_means",
                "engine/src/transport/random.rs::floats_stay_below_one",
            ],
        )),
    ),
    measured(
        "clerestory agreement --scene box-city-sky",
        unbiased(part(
            "CL-ENVIRONMENT",
            "environment light with importance sampling",
            "Pharr, Jakob and Humphreys 2016, 14.2.4",
            "engine/src/transport/environment.rs",
            &[
                "engine/src/transport/environment.rs::directions_and_coordinates_agree",
                "engine/src/transport/environment.rs::samples_follow_the_density",
                "engine/src/transport/environment.rs::light_is_never_missed_and_bad_maps_are_errors",
                "tests/tests/samplers.rs::environments_are_sampled_by_their_texels_and_evenly_within",
                "tests/tests/path_tracer.rs::environments_light_a_plane_by_their_cosine_integral",
            ],
        )),
    ),
    measured(
        "clerestory report light-sampling",
        unbiased(part(
            "CL-LIGHTS",
            "choice of lights by power, limited for distant ones",
            "Shirley, Wang and Zimmerman 1996 (inversion of the cumulative distribution)",
            "engine/src/transport/distribution.rs",
            &[
                "engine/src/transport/distribution.rs::probabilities_follow_weights_and_none_is_lost",
                "engine/src/transport/distribution.rs::cells_follow_their_probability",
                "tests/tests/samplers.rs::lights_are_chosen_by_their_power",
            ],
        )),
    ),
    measured(
        "clerestory report path-sets",
        part(
            "CL-PATHSET",
            "restriction of a picture to a set of light paths",
            "Heckbert 1990, path notation",
            "engine/src/transport/path_set/mod.rs",
            &[
                "engine/src/transport/path_set/tests.rs::text_round_trips",
                "engine/src/transport/path_set/tests.rs::automata_accept_what_backtracking_accepts",
                "tests/tests/path_sets.rs::glass_casts_caustics_that_are_a_part",
                "tests/tests/path_sets.rs::coats_over_diffuse_bases_are_told_apart",
                "tests/tests/path_sets.rs::drawn_labels_agree_with_masks",
                "tests/tests/path_tracer.rs::path_sets_are_a_partition",
                "engine/src/transport/bsdf/tests.rs::masks_divide_the_whole",
            ],
        ),
    ),
    measured(
        "clerestory bench",
        part(
            "CL-TRIANGLE",
            "watertight triangle test",
            "Woop, Benthin and Wald 2013",
            "engine/src/accel/triangle.rs",
            &[
                "engine/src/accel/triangle/tests.rs::hits_keep_their_stated_error_and_misses_are_right",
                "engine/src/accel/triangle/tests.rs::edges_and_vertices_belong_to_both_sides",
            ],
        ),
    ),
    measured(
        "clerestory report ray-offsets",
        part(
            "CL-OFFSET",
            "ray origins off their surface by error bounds",
            "Pharr, Jakob and Humphreys 2016, 3.9",
            "engine/src/accel/offset.rs",
            &[
                "engine/src/accel/offset/tests.rs::position_lies_within_its_rounding_bound",
                "engine/src/accel/offset/tests.rs::leaving_rays_meet_neither_their_triangle_nor_coplanar_ones",
            ],
        ),
    ),
    measured(
        "clerestory report sample-sums",
        part(
            "CL-SUM",
            "sums of samples in pairs of floats",
            "Dekker 1971; Joldes, Muller and Popescu 2017",
            "engine/src/film/accumulate.rs",
            &[
                "engine/src/film/accumulate.rs::a_million_equal_samples_do_not_stall",
                "engine/src/film/accumulate.rs::alternating_magnitudes_agree_with_an_integer_sum",
            ],
        ),
    ),
    measured(
        "clerestory report error-against-time",
        part(
            "CL-ERROR",
            "error metrics: MSE, relative MSE, bias, quantile, FLIP",
            "Rousselle, Knaus and Zwicker 2011; Andersson et al. 2020",
            "engine/src/film/metrics.rs",
            &[
                "engine/src/film/metrics.rs::formulas_on_numbers_done_by_hand",
                "engine/src/film/metrics.rs::flip_sees_what_tone_mapping_shows",
            ],
        ),
    ),
    measured(
        "clerestory agreement",
        part(
            "CL-ZTEST",
            "agreement of two pictures by z-test with Šidák's correction",
            "Subr and Arvo 2007; Šidák 1967",
            "engine/src/film/z_test.rs",
            &[
                "engine/src/film/z_test.rs::false_alarms_come_at_the_stated_rate",
                "engine/src/film/z_test.rs::a_bias_of_one_per_cent_is_found",
            ],
        ),
    ),
    measured(
        "clerestory report alpha",
        unbiased(part(
            "CL-ALPHA",
            "alpha: masks, and blending by chance",
            "Enderton, Sintorn, Shirley and Luebke 2010",
            "engine/src/transport/path_tracer/mod.rs",
            &[
                "tests/tests/alpha.rs::masks_are_all_or_nothing",
                "tests/tests/alpha.rs::blended_walls_thin_out_the_light_behind_them",
                "tests/tests/alpha.rs::blended_surfaces_scatter_in_proportion_to_alpha",
                "tests/tests/alpha.rs::textures_and_vertex_colours_carry_alpha",
            ],
        )),
    ),
    measured(
        "clerestory report absorption",
        part(
            "CL-ABSORPTION",
            "absorption inside of solids",
            "Khronos, KHR_materials_volume (law of Beer and Lambert)",
            "engine/src/transport/path_tracer/mod.rs",
            &["tests/tests/path_tracer.rs::light_inside_an_absorbing_body_is_absorbed_on_all_of_its_way"],
        ),
    ),
    measured(
        "tools/models",
        part(
            "CL-TEXTURE",
            "texture look-ups: nearest, bilinear, three ways to wrap, sRGB",
            "Khronos, glTF 2.0 specification, 3.8; IEC 61966-2-1",
            "engine/src/scene/texture.rs",
            &[
                "engine/src/scene/texture.rs::half_texels_and_wrap_modes_meet_at_borders",
                "tests/tests/twin_texture.rs::look_ups_agree_with_their_twins",
            ],
        ),
    ),
    measured(
        "clerestory report tangents",
        part(
            "CL-TANGENT",
            "tangent frames of normal maps",
            "Mikkelsen 2008 (MikkTSpace)",
            "engine/src/scene/tangents.rs",
            &[
                "engine/src/scene/tangents.rs::tangents_follow_u_and_the_sign_follows_mirroring",
                "engine/src/scene/tangents.rs::disagreeing_corners_split_vertices",
            ],
        ),
    ),
    measured(
        "clerestory agreement",
        part(
            "CL-CORNELL",
            "Cornell box and the other generated scenes",
            "Goral, Torrance, Greenberg and Battaile 1984; Cornell University, Cornell Box Data; Haines 1987",
            "engine/src/scene/builtin/mod.rs",
            &[
                "engine/src/scene/builtin/cornell.rs::the_areas_are_those_of_the_published_data",
                "engine/src/scene/builtin/mod.rs::every_entry_builds_with_its_defaults_and_has_what_it_promises",
            ],
        ),
    ),
    measured(
        "clerestory report automatic-choice",
        part(
            "CL-PLAN",
            "automatic choice of technique, settings and samples by pilot pictures",
            "the engine's own",
            "engine/src/plan/mod.rs",
            &[
                "engine/src/plan/noise.rs::pairs_know_their_error",
                "engine/src/plan/model.rs::models_return_what_they_were_fitted_to",
                "engine/src/plan/mod.rs::what_cannot_be_had_is_said",
                "tests/tests/automatic_choice.rs::predictions_come_true",
                "tests/tests/automatic_choice.rs::what_cannot_be_chosen_says_why",
            ],
        ),
    ),
    measured(
        "clerestory report scene-profile",
        part(
            "CL-PROFILE",
            "only what a scene needs: profile and specialization",
            "Khronos, SPIR-V specification, 2.12 (specialization constants)",
            "engine/src/scene/profile.rs",
            &[
                "tests/tests/profile.rs::what_is_absent_costs_no_pass",
                "tests/tests/profile.rs::what_is_absent_costs_no_byte",
                "tests/tests/profile.rs::features_that_are_compiled_in_without_need_change_no_bit",
            ],
        ),
    ),
    measured(
        "clerestory report barriers",
        part(
            "CL-BARRIERS",
            "hand-recorded passes whose missing barriers are errors",
            "Khronos, Vulkan 1.3 specification, chapter 7",
            "engine/src/gpu/recorder.rs",
            &[
                "tests/tests/gpu_floor.rs::missing_barrier_is_an_error_that_names_both_passes",
                "tests/tests/gpu_floor.rs::write_after_read_and_wrong_scope_are_hazards",
                "tests/tests/layers.rs::the_recorder_catches_a_missing_barrier_between_dispatches",
            ],
        ),
    ),
    measured(
        "clerestory report picture-formats",
        part(
            "CL-EXR",
            "pictures as OpenEXR with layers and facts, Radiance HDR and PNG",
            "Academy Software Foundation, Technical Introduction to OpenEXR; Ward 1991",
            "engine/src/film/exr.rs",
            &[
                "engine/src/film/exr.rs::every_bit_and_every_attribute_comes_back",
                "engine/src/film/hdr.rs::round_trip_errs_by_at_most_a_step_of_the_largest_channel",
                "engine/src/film/png.rs::a_written_file_reads_back_to_the_byte",
            ],
        ),
    ),
    measured(
        "tools/models",
        part(
            "CL-SIDECAR",
            "sidecar of a model: environment, metals, cameras, exposure, technique, participating media with grids of densities",
            "the engine's own",
            "engine/src/scene/sidecar/mod.rs",
            &[
                "engine/tests/scene_load.rs::a_sidecar_adds_what_the_model_cannot_say",
                "engine/tests/scene_load.rs::sidecar_faults_have_their_line_or_key",
            ],
        ),
    ),
    measured(
        "tools/models",
        part(
            "CL-MESH",
            "readers of PLY and OBJ",
            "Turk 1994; Wavefront, OBJ and MTL",
            "engine/src/scene/ply.rs",
            &[
                "engine/src/scene/ply.rs::all_encodings_are_read",
                "engine/src/scene/ply.rs::every_cut_is_an_error_and_no_panic",
                "engine/src/scene/obj.rs::faces_materials_and_coordinates_are_read",
            ],
        ),
    ),
    measured(
        "tools/models",
        part(
            "CL-GLTF",
            "reader of glTF 2.0",
            "Khronos, glTF 2.0 specification",
            "engine/src/scene/gltf/mod.rs",
            &[
                "engine/src/scene/gltf/tests/features.rs::text_and_binary_containers_give_the_same_scene",
                "engine/src/scene/gltf/tests/features.rs::material_extensions_are_carried_over",
                "engine/src/scene/gltf/tests/malformed.rs::every_truncation_is_an_error",
            ],
        ),
    ),
    measured(
        "clerestory index",
        part(
            "CL-LBVH",
            "linear hierarchy as ray index, on the host and on the device, with refitting",
            "Apetrei 2014; Karras 2012",
            "engine/src/accel/lbvh/radix.rs",
            &[
                "engine/src/accel/lbvh/tests.rs::trees_are_valid_on_hard_boxes",
                "engine/src/accel/lbvh/tests.rs::the_order_of_climbing_never_shows",
                "engine/src/accel/lbvh/tests.rs::hits_are_those_of_the_binned_tree",
                "engine/src/accel/lbvh/tests.rs::refitted_trees_have_the_hits_of_new_ones",
                "tests/tests/lbvh.rs::device_builds_are_the_twins_on_soups",
                "tests/tests/lbvh.rs::device_builds_are_the_twins_on_hard_cases",
                "tests/tests/lbvh.rs::device_refits_are_the_twins",
            ],
        ),
    ),
    measured(
        "clerestory report tree-quality",
        part(
            "CL-TREELETS",
            "optimisation of trees by treelets, mini trees and reinsertion",
            "Domingues and Pedrini 2015; Ganestam et al. 2015; Meister and Bittner 2018",
            "engine/src/accel/optimise.rs",
            &[
                "engine/src/accel/optimise/tests.rs::every_step_gives_valid_trees_that_cost_no_more",
                "engine/src/accel/optimise/tests.rs::trees_do_not_depend_on_the_number_of_threads",
                "engine/src/accel/lbvh/tests.rs::restructured_trees_are_valid_and_cost_no_more",
                "engine/src/accel/lbvh/tests.rs::bytes_do_not_depend_on_the_number_of_threads",
            ],
        ),
    ),
];
