//! Rows of the document on visibility and media (`BG-`). Tests that speak for several systems have a name of their own.

use super::super::{Row, measured, part, unbiased};
use crate::techniques::Bias;
use crate::transport::PathSet;

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
    "tests/tests/twins/media.rs::free_flight_agrees_with_its_twin",
    "tests/tests/media/homogeneous.rs::single_scattering_is_the_airlight_integral",
    "tests/tests/media/heterogeneous.rs::gradients_attenuate_by_their_integral",
    "tests/tests/media/heterogeneous.rs::constant_grids_are_homogeneous_media",
    "tests/tests/media/heterogeneous.rs::layered_slabs_depend_on_their_optical_depth_alone",
    "tests/tests/media/slab.rs::bands_of_a_chromatic_medium_are_those_of_grey_ones",
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
            "engine/src/techniques/path/mod.rs",
            PATH_TRACER,
        ))
    },
    measured(
        "clerestory agreement --scene fog-box,smoke",
        unbiased(part(
            "BG-4",
            "free flight and transmittance: analytic, delta and ratio tracking, equi-angular",
            "Woodcock et al. 1965; Kulla and Fajardo 2012; Novák et al. 2014; Miller et al. 2019",
            "engine/src/techniques/path/mod.rs",
            FREE_FLIGHT,
        )),
    ),
    Row {
        bias: Some(Bias::Biased(
            "borders of shadows are those of texels; contact shadows begin `width + 1` texel diagonals late",
        )),
        ..measured(
            "clerestory report shadow-maps",
            part(
                "BG-10",
                "omnidirectional shadow maps of point lights, as cubes or octahedra",
                "Williams 1978; Gerasimov 2004; Engelhardt and Dachsbacher 2008; Holbert 2011",
                "engine/src/raster/omni_shadow.rs",
                &[
                    "engine/src/raster/omni_shadow/tests.rs::radii_are_those_of_texels",
                    "engine/src/raster/omni_shadow/tests.rs::planes_do_not_shade_themselves",
                    "engine/src/raster/omni_shadow/tests.rs::planes_do_not_shade_themselves_where_positions_are_rounded",
                    "tests/tests/preview/shadows.rs::maps_agree_with_rays_but_for_the_borders_of_shadows",
                    "tests/tests/preview/shadows.rs::lights_close_to_surfaces_and_in_planes_of_geometry_are_wrong_at_borders_alone",
                    "tests/tests/preview/shadows.rs::shadows_do_not_depend_on_the_scale",
                    "tests/tests/preview/shadows.rs::look_ups_are_their_twins",
                    "tests/tests/preview/shadows.rs::filters_keep_the_mean",
                    "tests/tests/preview/shadows.rs::convex_rooms_have_no_shadows",
                    "tests/tests/preview/penumbra.rs::filtered_edges_are_ramps_about_the_edge",
                    "tests/tests/twins/shadows.rs::shadow_maps_agree_with_their_twins",
                ],
            ),
        )
    },
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
                "tests/tests/raster/gbuffer.rs::what_is_seen_is_what_rays_meet",
                "tests/tests/raster/gbuffer.rs::hard_cases_are_seen_as_rays_meet_them",
            ],
        ),
    ),
];
