//! Rows of the document on visibility and media about maps of directions (`DP-`, `OEM-`).

use super::super::{Row, measured, part};
use crate::techniques::Bias;

const DENSITY: &str = "clerestory report map-density map-choice";
const DENSITY_AND_ERROR: &str = "clerestory report map-density map-error map-choice";
const RENDERING: &str = "clerestory report map-rendering";

pub(super) const ROWS: &[Row] = &[
    measured(
        DENSITY_AND_ERROR,
        part(
            "DP-1",
            "latitude–longitude map; environments take it with y up, as glTF",
            "Blinn and Newell 1976",
            "engine/src/maps/lat_long.rs",
            &[
                "engine/src/maps/tests/places.rs::directions_come_back_from_their_places",
                "engine/src/maps/tests/solid_angles.rs::texels_sum_to_the_sphere",
                "engine/src/maps/tests/density.rs::extremes_are_where_the_table_says",
                "engine/src/maps/tests/solid_angles.rs::midpoint_sums_are_off_as_stated",
                "tests/tests/twins/maps.rs::maps_agree_with_their_twins",
                "tests/tests/twins/maps.rs::directions_come_back_in_single_precision",
                "engine/src/transport/environment.rs::directions_and_coordinates_agree",
                "engine/src/maps/tests/printed.rs::a_longitude_of_a_quotient_folds_half_turns",
                "engine/src/maps/tests/density.rs::ratios_along_great_circles_are_those_of_the_figures",
            ],
        ),
    ),
    measured(
        DENSITY_AND_ERROR,
        part(
            "DP-2",
            "sphere map (mirror ball)",
            "Miller and Hoffman 1984",
            "engine/src/maps/sphere_map.rs",
            &[
                "engine/src/maps/tests/places.rs::directions_come_back_from_their_places",
                "engine/src/maps/tests/solid_angles.rs::texels_sum_to_the_sphere",
                "engine/src/maps/tests/density.rs::extremes_are_where_the_table_says",
                "engine/src/maps/tests/printed.rs::the_printed_sphere_map_is_that_of_the_negated_direction",
                "engine/src/maps/tests/density.rs::anisotropies_are_those_of_the_table",
                "tests/tests/twins/maps.rs::maps_agree_with_their_twins",
                "tests/tests/twins/maps.rs::directions_come_back_in_single_precision",
                "tests/tests/directional_maps.rs::look_ups_in_cubes_and_discs_are_their_twins",
            ],
        ),
    ),
    measured(
        DENSITY_AND_ERROR,
        part(
            "DP-3",
            "cube map",
            "Greene 1986",
            "engine/src/maps/cube.rs",
            &[
                "engine/src/maps/tests/places.rs::directions_come_back_from_their_places",
                "engine/src/maps/tests/solid_angles.rs::texels_sum_to_the_sphere",
                "engine/src/maps/tests/density.rs::extremes_are_where_the_table_says",
                "engine/src/maps/tests/places.rs::the_poles_and_axes_are_where_they_belong",
                "engine/src/maps/tests/seams.rs::border_texels_touch_what_they_repeat",
                "tests/tests/twins/maps.rs::maps_agree_with_their_twins",
                "tests/tests/twins/maps.rs::directions_come_back_in_single_precision",
                "engine/src/maps/tests/density.rs::ratios_along_great_circles_are_those_of_the_figures",
                "tests/tests/directional_maps.rs::look_ups_in_cubes_and_discs_are_their_twins",
            ],
        ),
    ),
    measured(
        DENSITY_AND_ERROR,
        part(
            "DP-4",
            "dual paraboloid map",
            "Heidrich and Seidel 1998",
            "engine/src/maps/paraboloid.rs",
            &[
                "tests/tests/raster/cuts.rs::paraboloids_come_nearer_with_smaller_pieces",
                "engine/src/maps/tests/places.rs::directions_come_back_from_their_places",
                "engine/src/maps/tests/solid_angles.rs::texels_sum_to_the_sphere",
                "engine/src/maps/tests/density.rs::extremes_are_where_the_table_says",
                "engine/src/maps/tests/solid_angles.rs::rectangles_have_the_integral_of_the_density",
                "tests/tests/twins/maps.rs::maps_agree_with_their_twins",
                "tests/tests/twins/maps.rs::directions_come_back_in_single_precision",
                "engine/src/maps/tests/density.rs::ratios_along_great_circles_are_those_of_the_figures",
                "tests/tests/directional_maps.rs::look_ups_in_cubes_and_discs_are_their_twins",
            ],
        ),
    ),
    measured(
        DENSITY,
        part(
            "DP-5",
            "Nusselt's map of the hemisphere",
            "Nusselt 1928",
            "engine/src/maps/nusselt.rs",
            &[
                "engine/src/maps/tests/places.rs::directions_come_back_from_their_places",
                "engine/src/maps/tests/solid_angles.rs::texels_sum_to_the_sphere",
                "engine/src/maps/tests/density.rs::extremes_are_where_the_table_says",
                "engine/src/maps/tests/solid_angles.rs::rectangles_have_the_integral_of_the_density",
                "tests/tests/twins/maps.rs::maps_agree_with_their_twins",
                "tests/tests/twins/maps.rs::directions_come_back_in_single_precision",
                "tests/tests/directional_maps.rs::look_ups_in_cubes_and_discs_are_their_twins",
            ],
        ),
    ),
    measured(
        DENSITY_AND_ERROR,
        part(
            "OEM-1",
            "octahedron map, square layout",
            "Praun and Hoppe 2003; Engelhardt and Dachsbacher 2008",
            "engine/src/maps/octahedron.rs",
            &[
                "engine/src/maps/tests/places.rs::directions_come_back_from_their_places",
                "engine/src/maps/tests/solid_angles.rs::texels_sum_to_the_sphere",
                "engine/src/maps/tests/density.rs::extremes_are_where_the_table_says",
                "engine/src/maps/tests/printed.rs::a_sign_of_zero_that_is_zero_folds_the_map_onto_itself",
                "engine/src/maps/tests/printed.rs::matrices_of_octants_are_the_map",
                "engine/src/maps/tests/seams.rs::border_texels_touch_what_they_repeat",
                "engine/src/maps/tests/seams.rs::look_ups_are_continuous_over_seams",
                "engine/src/maps/tests/levels.rs::the_mirrored_direction_repairs_the_lower_seams",
                "engine/src/maps/tests/irradiance.rs::constant_radiance_gives_pi_for_every_normal",
                "tests/tests/twins/maps.rs::maps_agree_with_their_twins",
                "tests/tests/twins/maps.rs::directions_come_back_in_single_precision",
                "engine/src/maps/tests/density.rs::ratios_along_great_circles_are_those_of_the_figures",
                "tests/tests/directional_maps.rs::shadows_by_octahedron_and_cube_are_as_good",
            ],
        ),
    ),
    measured(
        DENSITY_AND_ERROR,
        part(
            "OEM-2",
            "octahedron map, rectangular layout",
            "Engelhardt and Dachsbacher 2008",
            "engine/src/maps/octahedron.rs",
            &[
                "engine/src/maps/tests/places.rs::directions_come_back_from_their_places",
                "engine/src/maps/tests/solid_angles.rs::texels_sum_to_the_sphere",
                "engine/src/maps/tests/density.rs::extremes_are_where_the_table_says",
                "engine/src/maps/tests/printed.rs::a_second_half_that_is_not_mirrored_tears_the_rectangle",
                "engine/src/maps/tests/seams.rs::border_texels_touch_what_they_repeat",
                "engine/src/maps/tests/levels.rs::the_octants_own_map_has_no_seams",
                "tests/tests/twins/maps.rs::maps_agree_with_their_twins",
                "tests/tests/twins/maps.rs::directions_come_back_in_single_precision",
                "tests/tests/directional_maps.rs::shadows_by_octahedron_and_cube_are_as_good",
            ],
        ),
    ),
    measured(
        DENSITY_AND_ERROR,
        part(
            "OEM-3",
            "octahedron maps by other central projections",
            "Engelhardt 2013, 7.1.2",
            "engine/src/maps/octahedron.rs",
            &[
                "engine/src/maps/tests/places.rs::directions_come_back_from_their_places",
                "engine/src/maps/tests/solid_angles.rs::texels_sum_to_the_sphere",
                "engine/src/maps/tests/density.rs::extremes_are_where_the_table_says",
                "engine/src/maps/tests/density.rs::the_perspective_family_is_best_at_one",
                "tests/tests/twins/maps.rs::maps_agree_with_their_twins",
                "tests/tests/twins/maps.rs::directions_come_back_in_single_precision",
            ],
        ),
    ),
    measured(
        RENDERING,
        Row {
            needs: &["geometryShader"],
            ..part(
                "OEM-4a",
                "octahedron maps rendered live: exact split by a geometry shader",
                "Engelhardt 2013, 7.2.1 and 7.3.2",
                "engine/src/raster/octants.rs",
                &[
                    "tests/tests/raster/directions.rs::octahedra_are_as_rays_see_them_and_have_no_holes",
                    "tests/tests/raster/cuts.rs::exact_cuts_interpolate_what_rays_meet",
                    "tests/tests/raster/cuts.rs::cuts_emit_what_their_twins_say",
                    "engine/src/raster/octants.rs::triangles_in_general_position_give_thirteen_at_most",
                    "engine/src/raster/octants.rs::triangles_on_a_lattice_give_no_more_than_shaders_may_emit",
                    "engine/src/raster/octants.rs::pieces_cover_the_triangle_and_lie_in_their_octants",
                    "engine/src/raster/octants.rs::cuts_are_the_same_from_both_ends",
                    "tests/tests/twins/raster.rs::pieces_of_octants_agree_with_their_twins",
                ],
            )
        },
    ),
    measured(
        RENDERING,
        Row {
            needs: &["geometryShader"],
            bias: Some(Bias::Biased("edges stay straight where their images bend")),
            ..part(
                "OEM-4b",
                "octahedron maps rendered live: split along the equator alone",
                "Engelhardt 2013, 7.2.1 and 7.3.2",
                "engine/src/raster/octants.rs",
                &[
                    "tests/tests/raster/cuts.rs::halves_and_outlines_are_wrong_as_stated",
                    "tests/tests/raster/cuts.rs::cuts_emit_what_their_twins_say",
                    "tests/tests/raster/cuts.rs::the_split_emits_least",
                ],
            )
        },
    ),
    measured(
        RENDERING,
        Row {
            needs: &["geometryShader"],
            bias: Some(Bias::Biased("what is interpolated inside of outlines")),
            ..part(
                "OEM-4c",
                "octahedron maps rendered live: split outlines",
                "Engelhardt 2013, 7.2.1 and 7.3.2",
                "engine/src/raster/octants.rs",
                &[
                    "tests/tests/raster/cuts.rs::halves_and_outlines_are_wrong_as_stated",
                    "tests/tests/raster/cuts.rs::cuts_emit_what_their_twins_say",
                    "tests/tests/twins/raster.rs::outlines_agree_with_their_twins",
                ],
            )
        },
    ),
    measured(
        RENDERING,
        Row {
            ..part(
                "OEM-4d",
                "octahedron maps rendered live: mask of each octant",
                "Engelhardt 2013, 7.2.1 and 7.3.2",
                "engine/src/raster/pipelines.rs",
                &[
                    "tests/tests/raster/directions.rs::octahedra_are_as_rays_see_them_and_have_no_holes",
                    "tests/tests/raster/cuts.rs::exact_cuts_interpolate_what_rays_meet",
                    "tests/tests/raster/cuts.rs::cuts_emit_what_their_twins_say",
                ],
            )
        },
    ),
    measured(
        RENDERING,
        Row {
            bias: Some(Bias::Consistent("straight edges, and gaps at seams, as long as pieces")),
            ..part(
                "OEM-4e",
                "octahedron maps rendered live: unsplit pieces of triangles",
                "Engelhardt 2013, 7.2.1 and 7.3.2",
                "engine/src/raster/tessellation.rs",
                &[
                    "tests/tests/raster/cuts.rs::unsplit_maps_come_nearer_with_smaller_pieces",
                    "engine/src/raster/tessellation.rs::pieces_fill_the_triangle_and_share_their_edges",
                    "tests/tests/twins/raster.rs::pieces_of_triangles_agree_with_their_twins",
                ],
            )
        },
    ),
    measured(
        RENDERING,
        Row {
            bias: Some(Bias::Biased("holes and points as wide as texels")),
            ..part(
                "OEM-4f",
                "octahedron maps of points: splats, pull and push",
                "Engelhardt 2013, 7.4; Ritschel et al. 2008",
                "engine/src/raster/splats.rs",
                &[
                    "tests/tests/raster/splats.rs::splats_and_their_fill_are_those_of_the_twin",
                    "tests/tests/raster/splats.rs::rooms_of_splats_are_closed_and_as_far_as_rays_go",
                    "engine/src/raster/splats.rs::surfels_share_the_area_evenly",
                ],
            )
        },
    ),
    measured(
        RENDERING,
        Row {
            needs: &["shaderClipDistance"],
            ..part(
                "OEM-4g",
                "octahedron maps rendered live: linear octants with clip distances",
                "Engelhardt and Dachsbacher 2008; linear octants are the engine's own",
                "engine/src/raster/octahedron.rs",
                &[
                    "tests/tests/raster/directions.rs::octahedra_are_as_rays_see_them_and_have_no_holes",
                    "tests/tests/raster/cuts.rs::exact_cuts_interpolate_what_rays_meet",
                    "tests/tests/raster/cuts.rs::cuts_emit_what_their_twins_say",
                    "tests/tests/raster/directions.rs::views_project_as_the_maps_encode",
                    "engine/src/maps/tests/printed.rs::matrices_of_octants_are_the_map",
                ],
            )
        },
    ),
    measured(
        "clerestory report map-levels map-borders",
        part(
            "OEM-5",
            "look-ups in octahedron maps: unfiltered, repaired levels of detail, borders at each level",
            "Engelhardt and Dachsbacher 2008; Engelhardt 2013, 7.2.2",
            "engine/src/maps/directional_map.rs",
            &[
                "tests/tests/directional_maps.rs::borders_are_texels_of_the_inside",
                "tests/tests/directional_maps.rs::levels_keep_the_integral",
                "tests/tests/directional_maps.rs::look_ups_are_seamless",
                "tests/tests/directional_maps.rs::seams_hold_no_energy",
                "tests/tests/directional_maps.rs::constant_radiance_stays_constant",
                "engine/src/maps/tests/levels.rs::the_mirrored_direction_repairs_the_lower_seams",
                "engine/src/maps/tests/levels.rs::the_octants_own_map_has_no_seams",
                "engine/src/maps/tests/seams.rs::border_texels_touch_what_they_repeat",
                "engine/src/maps/tests/seams.rs::look_ups_are_continuous_over_seams",
                "engine/src/maps/tests/glossy.rs::levels_keep_the_integral",
            ],
        ),
    ),
    measured(
        "clerestory report map-glossiness",
        part(
            "OEM-6",
            "spherical summed-area table: means over boxes, and lobes of several, for continuous glossiness",
            "Crow 1984; Engelhardt and Dachsbacher 2008",
            "engine/src/maps/spherical_sat.rs",
            &[
                "tests/tests/directional_maps.rs::tables_hold_means_of_boxes_under_a_sun",
                "tests/tests/directional_maps.rs::constant_radiance_stays_constant",
                "engine/src/maps/tests/glossy.rs::tables_hold_the_means_of_boxes",
                "engine/src/maps/tests/glossy.rs::boxes_have_no_seams",
                "tests/tests/directional_maps.rs::lobes_are_their_twins",
                "engine/src/maps/tests/box_lobes.rs::borders_hold_the_largest_box",
                "engine/src/maps/tests/box_lobes.rs::lobes_on_folds_and_edges_are_as_good_as_elsewhere",
            ],
        ),
    ),
];
