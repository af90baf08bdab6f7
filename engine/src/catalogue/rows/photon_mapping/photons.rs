//! Rows on photons, their differentials, and what they are estimated from (`PM-DE-`, `PM-F-`, `PM-PD-`, `PM-PH-`).

use crate::catalogue::{Row, measured, part, unbiased};

pub(super) const ROWS: &[Row] = &[
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
        "clerestory report photon-kernels photon-nearest photon-ring",
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
                "engine/src/techniques/photon_mapping/kernel/tests.rs::flat_footprints_are_widened_where_asked_for",
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
        "tools/test",
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
        "tools/test",
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
        "clerestory report photon-settings",
        part(
            "PM-PH-2",
            "random numbers of photons: Owen-scrambled Sobol' points, or independent",
            "Owen 1995; Interactive Manycore Photon Mapping, 2011, §3.3.3",
            "engine/src/techniques/photon_mapping/tracer.rs",
            &[
                "engine/src/techniques/mod.rs::every_setting_is_explained",
                "tests/tests/photon/determinism.rs::runs_are_equal_and_seeds_are_not",
                "tests/tests/photon/sphere.rs::reflections_in_a_sphere_are_those_of_the_closed_form",
            ],
        ),
    ),
];
