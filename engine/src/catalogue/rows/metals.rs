//! Rows of the document on metals and reflections (`MET-`). Tests that speak for several systems have a name of their own.

use super::super::{Row, measured, part, unbiased};

const RADIOMETRY: &[&str] = &[
    "engine/src/transport/lights.rs::point_light_irradiance_and_flux",
    "engine/src/transport/lights.rs::spot_flux_and_falloff",
    "engine/src/transport/lights.rs::a_triangle_seen_by_its_density_has_its_solid_angle",
    "tests/tests/path_tracer.rs::point_spot_and_directional_lights_follow_their_laws",
    "tests/tests/path_tracer.rs::closed_furnaces_have_the_radiance_of_the_geometric_series",
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
            "engine/src/techniques/path/mod.rs",
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
];
