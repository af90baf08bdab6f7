//! Rows of the engine's own (`CL-`): published methods outside of the documents.

use super::super::{Row, measured, part, unbiased};
use crate::techniques::Bias;

pub(super) const ROWS: &[Row] = &[
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
                "engine/src/scene/normal_map.rs::flat_maps_keep_the_normal",
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
                "engine/src/film/metrics.rs::formulas_give_what_hand_calculation_gives",
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
            "engine/src/techniques/path/mod.rs",
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
            "engine/src/techniques/path/mod.rs",
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
            "engine/src/accel/lbvh/radix_tree.rs",
            &[
                "engine/src/accel/lbvh/tests.rs::trees_are_valid_on_hard_boxes",
                "engine/src/accel/lbvh/tests.rs::the_order_of_climbing_never_shows",
                "engine/src/accel/lbvh/tests.rs::hits_are_those_of_the_binned_tree",
                "engine/src/accel/lbvh/tests.rs::refitted_trees_have_the_hits_of_new_ones",
                "tests/tests/lbvh.rs::device_builds_are_the_twins_on_soups",
                "tests/tests/lbvh.rs::device_builds_are_the_twins_on_hard_cases",
                "tests/tests/lbvh.rs::trees_that_are_too_deep_are_made_again_as_the_hosts",
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
    measured(
        "clerestory report map-density map-error map-choice",
        part(
            "CL-EQUAL-AREA",
            "equal-area octahedron map",
            "Clarberg 2008",
            "engine/src/maps/equal_area.rs",
            &[
                "engine/src/maps/tests/density.rs::statistics_are_those_of_the_table",
                "engine/src/maps/tests/places.rs::directions_come_back_from_their_places",
                "engine/src/maps/tests/seams.rs::look_ups_are_continuous_over_seams",
                "tests/tests/twins/maps.rs::directions_come_back_in_single_precision",
            ],
        ),
    ),
    measured(
        "clerestory report map-glossiness",
        part(
            "CL-PREFILTER",
            "environment maps filtered by the GGX lobe, a map for each roughness",
            "Kautz et al. 2000; Karis 2013",
            "engine/src/maps/prefilter.rs",
            &[
                "tests/tests/directional_maps.rs::filtered_maps_are_sums_over_the_lobe",
                "tests/tests/directional_maps.rs::constant_radiance_stays_constant",
                "engine/src/maps/tests/glossy.rs::filtered_maps_are_integrals_of_the_lobe",
                "engine/src/maps/tests/glossy.rs::lobes_have_the_width_that_is_said",
            ],
        ),
    ),
    measured(
        "clerestory report map-glossiness",
        part(
            "CL-BOX-LOBE",
            "lobes of glossy reflections as staircases of boxes of a summed-area table",
            "this engine; Bellman 1961 (the best staircase)",
            "engine/src/maps/box_lobe.rs",
            &[
                "engine/src/maps/tests/box_lobes.rs::weights_share_the_lobe",
                "engine/src/maps/tests/box_lobes.rs::the_staircase_is_the_best_one",
                "engine/src/maps/tests/box_lobes.rs::borders_hold_the_largest_box",
                "engine/src/maps/tests/box_lobes.rs::constant_radiance_is_constant_through_every_lobe",
                "tests/tests/directional_maps.rs::lobes_are_their_twins",
            ],
        ),
    ),
    measured(
        "clerestory report map-error",
        part(
            "CL-IRRADIANCE",
            "irradiance under a map, and maps of it over normals",
            "Lambert 1760; Ramamoorthi and Hanrahan 2001",
            "engine/src/maps/irradiance.rs",
            &[
                "engine/src/maps/tests/irradiance.rs::constant_radiance_gives_pi_for_every_normal",
                "engine/src/maps/tests/irradiance.rs::a_sky_that_fades_to_the_horizon_gives_two_thirds_of_pi",
                "engine/src/maps/tests/irradiance.rs::a_sun_of_one_texel_is_lamberts_polygon",
                "engine/src/maps/tests/irradiance.rs::maps_of_irradiance_hold_it_for_every_normal",
                "tests/tests/directional_maps.rs::the_widest_lobe_is_irradiance",
            ],
        ),
    ),
    measured(
        "clerestory maps sky.hdr sky.exr --to octahedron",
        part(
            "CL-RESAMPLE",
            "conversion between maps by solid angle, `clerestory maps`",
            "this engine",
            "engine/src/maps/resample.rs",
            &[
                "engine/src/maps/tests/conversions.rs::constant_radiance_stays_constant_in_every_map",
                "engine/src/maps/tests/conversions.rs::halves_of_a_map_are_means_of_its_texels",
                "engine/src/maps/tests/conversions.rs::conversions_keep_the_integral",
                "engine/src/maps/tests/conversions.rs::smooth_light_comes_back",
                "engine/src/maps/tests/conversions.rs::conversions_can_be_watched_and_stopped",
                "tools/tests/maps.rs::every_format_leads_to_every_other",
                "tools/tests/maps.rs::a_conversion_that_is_stopped_leaves_the_old_file",
                "tools/tests/maps.rs::directions_are_those_of_environments",
                "tools/tests/maps.rs::scenes_look_the_same_after_a_round_trip",
            ],
        ),
    ),
    measured(
        "clerestory report map-density",
        part(
            "CL-PACKED",
            "directions in a word",
            "Meyer et al. 2010; Cigolle et al. 2014",
            "engine/src/maps/packed_direction.rs",
            &[
                "engine/src/maps/packed_direction.rs::directions_come_back_within_their_bounds",
                "engine/src/maps/packed_direction.rs::the_nearest_of_four_is_two_thirds_as_far_off",
                "tests/tests/twins/maps.rs::levels_borders_and_words_agree_with_their_twins",
            ],
        ),
    ),
    Row {
        bias: Some(Bias::Biased(
            "no interreflection beyond a probe, no parallax, round lobes, unshadowed directional lights",
        )),
        ..measured(
            "clerestory report preview-picture",
            part(
                "CL-PREVIEW",
                "raster preview: deferred shading with shadow maps and light probes",
                "Deering et al. 1988; Saito and Takahashi 1990; Kautz et al. 2000; Karis 2013",
                "engine/src/techniques/preview/mod.rs",
                &[
                    "tests/tests/preview/light.rs::white_surfaces_vanish_in_a_white_furnace",
                    "tests/tests/preview/light.rs::albedos_in_a_uniform_environment_are_the_path_tracers",
                    "tests/tests/preview/light.rs::a_lambert_sphere_under_a_cosine_sky_has_the_closed_form",
                    "tests/tests/preview/light.rs::a_mirror_sphere_shows_the_environment",
                    "tests/tests/preview/light.rs::rough_reflections_are_close_to_the_path_tracers",
                    "tests/tests/preview/light.rs::direct_light_is_the_path_tracers",
                    "tests/tests/preview/moving.rs::moved_objects_are_as_if_made_there",
                    "tests/tests/preview/moving.rs::passes_are_those_that_are_needed",
                    "engine/src/techniques/preview/probe.rs::lobes_grow_from_level_to_level",
                    "engine/src/techniques/preview/probe.rs::levels_of_lobes_are_those_of_their_widths",
                    "engine/src/techniques/preview/probe.rs::mixtures_are_near_the_lobe",
                ],
            ),
        )
    },
    Row {
        bias: Some(Bias::Biased("radiance at texel centres; parallax beside its place")),
        ..measured(
            "clerestory report live-maps",
            part(
                "CL-LIVE-MAP",
                "live maps: light at a place drawn each frame as an octahedron, for reflections of objects that move",
                "Blinn and Newell 1976; Greene 1986; Engelhardt and Dachsbacher 2008",
                "engine/src/techniques/preview/live.rs",
                &[
                    "tests/tests/preview/live.rs::irradiance_in_a_closed_room_is_that_of_rays",
                    "tests/tests/preview/live.rs::reflections_at_the_middle_are_those_of_rays",
                    "tests/tests/preview/live.rs::deviations_beside_the_middle_are_parallax",
                    "tests/tests/preview/moving.rs::objects_are_left_out_of_their_own_maps",
                ],
            ),
        )
    },
];
