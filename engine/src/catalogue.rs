//! The catalogue: one row for every system that the engine carries, so that a reader finds where a publication lives in the code.
//!
//! Ids with the prefixes `BG-`, `PM-` and `MET-` are those of the five research documents that the engine follows (visibility and media,
//! photon mapping, metals and reflections); where two documents describe one thing, their rows point at one implementation. Ids with
//! the prefix `CL-` are the engine's own, for published methods outside of those documents. Guarantee: the tests below check that the
//! module, every test and every experiment named here exist.

use crate::techniques::Bias;
use crate::transport::PathSet;

/// One system.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize)]
pub struct Row {
    /// Unique id with its prefix, such as `BG-3`.
    pub id: &'static str,
    /// What it is.
    pub name: &'static str,
    /// Where it was published.
    pub publication: &'static str,
    /// Its main file, below `engine/`.
    pub module: &'static str,
    /// The light paths of its picture; `None` for what makes no picture by itself.
    pub path_set: Option<PathSet>,
    /// Its bias as an estimator; `None` for what is evaluated, not estimated.
    pub bias: Option<Bias>,
    /// Device features beyond the baseline, by their Vulkan names.
    pub needs: &'static [&'static str],
    /// Its tests as `file::function`, the file from the repository's root.
    pub tests: &'static [&'static str],
    /// The command that measures it, from the repository's root; `None` while there is none.
    pub experiment: Option<&'static str>,
}

/// A row of something exact that runs everywhere and makes no picture by itself.
const fn part(
    id: &'static str,
    name: &'static str,
    publication: &'static str,
    module: &'static str,
    tests: &'static [&'static str],
) -> Row {
    Row {
        id,
        name,
        publication,
        module,
        path_set: None,
        bias: None,
        needs: &[],
        tests,
        experiment: None,
    }
}

/// As [`part`], for estimators without bias.
const fn unbiased(row: Row) -> Row {
    Row {
        bias: Some(Bias::Unbiased),
        ..row
    }
}

const RADIOMETRY: &[&str] = &[
    "engine/src/transport/lights.rs::point_light_irradiance_and_flux",
    "engine/src/transport/lights.rs::spot_flux_and_falloff",
    "engine/src/transport/lights.rs::a_triangle_seen_by_its_density_has_its_solid_angle",
    "tests/tests/smoke.rs::a_furnace_has_its_radiance",
];
const SAMPLING: &[&str] = &[
    "engine/src/transport/warp.rs::directions_follow_their_density",
    "engine/src/transport/bsdf/tests.rs::samples_follow_their_density",
    "engine/src/transport/bsdf/tests.rs::weight_is_value_over_density_and_density_integrates",
    "engine/src/transport/lights.rs::heuristics_sum_to_one",
];
const PATH_TRACER: &[&str] = &[
    "tests/tests/smoke.rs::a_furnace_has_its_radiance",
    "tests/tests/smoke.rs::the_cornell_box_is_finite_and_lit",
];

/// All rows, ordered by document and id.
pub fn all() -> &'static [Row] {
    ROWS
}

const ROWS: &[Row] = &[
    part(
        "BG-1",
        "radiometry and surface transport (without media)",
        "Veach 1997, chapter 3",
        "src/transport/lights.rs",
        RADIOMETRY,
    ),
    unbiased(part(
        "BG-2",
        "Monte Carlo and importance sampling",
        "Veach 1997, chapters 2 and 9",
        "src/transport/warp.rs",
        SAMPLING,
    )),
    Row {
        path_set: Some(PathSet::ALL),
        experiment: Some("tools/report"),
        ..unbiased(part(
            "BG-3",
            "path tracer, surfaces: technique `path`",
            "Kajiya 1986; Veach 1997, chapters 9 and 10; Laine, Karras and Aila 2013",
            "src/transport/path_tracer/mod.rs",
            PATH_TRACER,
        ))
    },
    part(
        "BG-14",
        "ray index: binary BVH by binned surface-area heuristic",
        "Wald 2007; Aila and Laine 2009; Laine 2010; Ize 2013",
        "src/accel/bvh2.rs",
        &[
            "engine/src/accel/bvh2/tests.rs::traversal_equals_trying_all_triangles_bit_for_bit",
            "engine/src/accel/bvh2/tests.rs::hits_agree_with_f64_up_to_their_stated_error",
            "engine/src/accel/bvh2/tests.rs::no_ray_passes_between_the_triangles_of_a_sphere",
            "engine/src/accel/bvh2/tests.rs::stopped_traversals_go_on_without_loss_or_repetition",
        ],
    ),
    part(
        "PM-F-1",
        "radiometry of point and spot lights",
        "Veach 1997, chapter 3; Khronos, KHR_lights_punctual",
        "src/transport/lights.rs",
        RADIOMETRY,
    ),
    unbiased(part(
        "PM-F-2",
        "surface models: Lambert, mirror, refraction (path tracer); modified Phong (function)",
        "Lafortune and Willems 1994; Walter et al. 2007",
        "src/transport/phong.rs",
        &[
            "engine/src/transport/phong.rs::white_furnace",
            "engine/src/transport/phong.rs::reciprocal",
            "engine/src/transport/phong.rs::samples_follow_their_density",
            "engine/src/transport/bsdf/tests.rs::specular_zero_is_exactly_lambert",
            "engine/src/transport/bsdf/tests.rs::clear_solid_is_the_smooth_dielectric",
        ],
    )),
    unbiased(part(
        "PM-F-3",
        "phase functions of Henyey and Greenstein and of Schlick (functions; no medium yet)",
        "Henyey and Greenstein 1941; Blasi, Le Saëc and Schlick 1993",
        "src/transport/phase.rs",
        &[
            "engine/src/transport/phase.rs::normalised_with_their_mean_cosines",
            "engine/src/transport/phase.rs::samples_follow_their_density",
        ],
    )),
    part(
        "PM-I-1",
        "ray/sphere hit and closest approach",
        "Haines et al. 2019",
        "src/accel/sphere.rs",
        &[
            "engine/src/accel/sphere.rs::approach_matches_the_definition",
            "engine/src/accel/sphere.rs::sphere_hits_inside_outside_tangent_and_behind",
        ],
    ),
    part(
        "PM-I-2",
        "Möller–Trumbore triangle test (oracle in f64)",
        "Möller and Trumbore 1997",
        "src/accel/triangle.rs",
        &["engine/src/accel/triangle/tests.rs::oracles_agree_with_each_other"],
    ),
    part(
        "MET-B1",
        "radiometry and rendering equation",
        "Kajiya 1986",
        "src/transport/lights.rs",
        RADIOMETRY,
    ),
    unbiased(part(
        "MET-B2",
        "microfacet product of distribution, masking and Fresnel factor",
        "Walter et al. 2007; Heitz 2014",
        "src/transport/bsdf/mod.rs",
        &[
            "engine/src/transport/bsdf/tests.rs::white_furnace",
            "engine/src/transport/bsdf/tests.rs::reflection_is_reciprocal_and_transmission_up_to_eta_squared",
            "engine/src/transport/bsdf/tests.rs::samples_follow_their_density",
        ],
    )),
    unbiased(part(
        "MET-B7",
        "coupled matte and specular reflection",
        "Kelemen and Szirmay-Kalos 2001; Shirley et al. 1997",
        "src/transport/bsdf/mod.rs",
        &[
            "engine/src/transport/bsdf/tests.rs::white_furnace",
            "engine/src/transport/bsdf/tests.rs::reflection_is_reciprocal_and_transmission_up_to_eta_squared",
        ],
    )),
    unbiased(part(
        "MET-B8",
        "path estimation: light sampling, BRDF sampling, Russian roulette",
        "Kajiya 1986; Veach 1997, chapters 9 and 10",
        "src/transport/path_tracer/mod.rs",
        PATH_TRACER,
    )),
    part(
        "MET-F1",
        "exact unpolarised conductor Fresnel",
        "Born and Wolf, Principles of Optics, 14.2",
        "src/transport/fresnel.rs",
        &["engine/src/transport/fresnel.rs::conductor_without_extinction_is_the_dielectric"],
    ),
    part(
        "CL-FRESNEL",
        "exact dielectric Fresnel",
        "Born and Wolf, Principles of Optics, 1.5",
        "src/transport/fresnel.rs",
        &["engine/src/transport/fresnel.rs::dielectric_equals_the_textbook_form_and_its_edges"],
    ),
    part(
        "CL-METALS",
        "measured metals: gold, silver, copper, aluminium",
        "Johnson and Christy 1972; Rakić 1995",
        "src/scene/metals.rs",
        &["engine/src/scene/metals.rs::normal_reflectances_have_the_colours_of_the_metals"],
    ),
    unbiased(part(
        "CL-GGX",
        "GGX distribution, height-correlated masking, visible normals by spherical caps",
        "Walter et al. 2007; Heitz 2014; Dupuy and Benyoub 2023",
        "src/transport/ggx.rs",
        &[
            "engine/src/transport/ggx.rs::densities_are_normalised",
            "engine/src/transport/ggx.rs::visible_normals_follow_their_density",
            "engine/src/transport/ggx.rs::masking_limits",
        ],
    )),
    part(
        "CL-MULTISCATTER",
        "compensation of rough metals for scattering among microfacets",
        "Kulla and Conty 2017",
        "src/transport/albedo.rs",
        &[
            "engine/src/transport/bsdf/tests.rs::white_furnace",
            "engine/src/transport/bsdf/tests.rs::albedo_table_interpolates_within_its_bound",
        ],
    ),
    part(
        "CL-NORMALS",
        "shading normals and normal maps that never gain energy",
        "Veach 1997, 5.3 (the problem; the bend towards the viewer is the engine's own)",
        "src/transport/shading_normal.rs",
        &[
            "engine/src/transport/shading_normal.rs::adapted_normals_face_the_viewer_and_lose_energy_only",
            "engine/src/transport/shading_normal.rs::flat_maps_keep_the_normal",
        ],
    ),
    unbiased(part(
        "CL-SOBOL",
        "Owen-scrambled Sobol' points by hashing",
        "Burley 2020; Laine and Karras 2011",
        "src/transport/random.rs",
        &[
            "engine/src/transport/random.rs::pascal_steps_equal_the_direction_numbers",
            "engine/src/transport/random.rs::sobol_pairs_are_stratified_plain_and_scrambled",
            "engine/src/transport/random.rs::owen_hash_changes_a_bit_by_the_lower_bits_only",
        ],
    )),
    unbiased(part(
        "CL-PCG",
        "counter-based random numbers by PCG hashes",
        "Jarzynski and Olano 2020",
        "src/transport/random.rs",
        &[
            "engine/src/transport/random.rs::pcg_avalanche_and_means",
            "engine/src/transport/random.rs::floats_stay_below_one",
        ],
    )),
    unbiased(part(
        "CL-ENVIRONMENT",
        "environment light with importance sampling",
        "Pharr, Jakob and Humphreys 2016, 14.2.4",
        "src/transport/environment.rs",
        &[
            "engine/src/transport/environment.rs::directions_and_coordinates_agree",
            "engine/src/transport/environment.rs::samples_follow_the_density",
            "engine/src/transport/environment.rs::light_is_never_missed_and_bad_maps_are_errors",
        ],
    )),
    unbiased(part(
        "CL-LIGHTS",
        "choice of lights by power",
        "Shirley, Wang and Zimmerman 1996 (inversion of the cumulative distribution)",
        "src/transport/distribution.rs",
        &[
            "engine/src/transport/distribution.rs::probabilities_follow_weights_and_none_is_lost",
            "engine/src/transport/distribution.rs::cells_follow_their_probability",
        ],
    )),
    part(
        "CL-PATHSET",
        "restriction of a picture to a set of light paths",
        "Heckbert 1990, path notation",
        "src/transport/path_set.rs",
        &[
            "engine/src/transport/path_set.rs::text_round_trips",
            "engine/src/transport/bsdf/tests.rs::masks_divide_the_whole",
        ],
    ),
    part(
        "CL-TRIANGLE",
        "watertight triangle test",
        "Woop, Benthin and Wald 2013",
        "src/accel/triangle.rs",
        &[
            "engine/src/accel/triangle/tests.rs::hits_keep_their_stated_error_and_misses_are_right",
            "engine/src/accel/triangle/tests.rs::edges_and_vertices_belong_to_both_sides",
        ],
    ),
    part(
        "CL-OFFSET",
        "ray origins off their surface by error bounds",
        "Pharr, Jakob and Humphreys 2016, 3.9",
        "src/accel/offset.rs",
        &[
            "engine/src/accel/offset/tests.rs::position_lies_within_its_rounding_bound",
            "engine/src/accel/offset/tests.rs::leaving_rays_meet_neither_their_triangle_nor_coplanar_ones",
        ],
    ),
    part(
        "CL-SUM",
        "sums of samples in pairs of floats",
        "Dekker 1971; Joldes, Muller and Popescu 2017",
        "src/film/accumulate.rs",
        &[
            "engine/src/film/accumulate.rs::a_million_equal_samples_do_not_stall",
            "engine/src/film/accumulate.rs::alternating_magnitudes_agree_with_an_integer_sum",
        ],
    ),
    part(
        "CL-ERROR",
        "error metrics: MSE, relative MSE, bias, quantile, FLIP",
        "Rousselle, Knaus and Zwicker 2011; Andersson et al. 2020",
        "src/film/metrics.rs",
        &[
            "engine/src/film/metrics.rs::formulas_on_numbers_done_by_hand",
            "engine/src/film/metrics.rs::flip_sees_what_tone_mapping_shows",
        ],
    ),
    part(
        "CL-ZTEST",
        "agreement of two pictures by z-test with Šidák's correction",
        "Subr and Arvo 2007; Šidák 1967",
        "src/film/z_test.rs",
        &[
            "engine/src/film/z_test.rs::false_alarms_come_at_the_stated_rate",
            "engine/src/film/z_test.rs::a_bias_of_one_per_cent_is_found",
        ],
    ),
    part(
        "CL-GLTF",
        "reader of glTF 2.0",
        "Khronos, glTF 2.0 specification",
        "src/scene/gltf/mod.rs",
        &[
            "engine/src/scene/gltf/tests/features.rs::text_and_binary_containers_give_the_same_scene",
            "engine/src/scene/gltf/tests/features.rs::material_extensions_are_carried_over",
            "engine/src/scene/gltf/tests/malformed.rs::every_truncation_is_an_error",
        ],
    ),
];

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeSet;
    use std::path::{Path, PathBuf};

    fn repository() -> PathBuf {
        Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
    }

    /// Whether the source holds a test function of that name.
    fn has_test(source: &str, name: &str) -> bool {
        let lines: Vec<&str> = source.lines().map(str::trim).collect();
        lines.iter().enumerate().any(|(i, line)| {
            line.starts_with(&format!("fn {name}("))
                && lines[..i]
                    .iter()
                    .rev()
                    .take_while(|above| above.starts_with("#[") || above.starts_with("///"))
                    .any(|above| *above == "#[test]")
        })
    }

    #[test]
    fn ids_are_unique_and_have_a_known_prefix() {
        let mut seen = BTreeSet::new();
        for row in all() {
            assert!(seen.insert(row.id), "{} twice", row.id);
            assert!(
                ["BG-", "PM-", "MET-", "CL-"]
                    .iter()
                    .any(|prefix| row.id.starts_with(prefix)),
                "{}",
                row.id
            );
            assert!(!row.name.is_empty() && !row.publication.is_empty(), "{}", row.id);
        }
    }

    #[test]
    fn modules_tests_and_experiments_exist() {
        for row in all() {
            let module = repository().join("engine").join(row.module);
            assert!(module.is_file(), "{}: no module {}", row.id, row.module);
            assert!(!row.tests.is_empty(), "{}: no test", row.id);
            for test in row.tests {
                let (file, name) = test.split_once("::").expect("tests are file::function");
                let source = std::fs::read_to_string(repository().join(file))
                    .unwrap_or_else(|error| panic!("{}: {file}: {error}", row.id));
                assert!(has_test(&source, name), "{}: no test {test}", row.id);
            }
            if let Some(command) = row.experiment {
                let program = command.split_whitespace().next().unwrap_or_default();
                assert!(repository().join(program).is_file(), "{}: no {program}", row.id);
            }
        }
    }

    #[test]
    fn only_test_functions_count() {
        let source = "#[test]\nfn real() {\n}\nfn helper() {\n}\n";
        assert!(has_test(source, "real"));
        assert!(!has_test(source, "helper") && !has_test(source, "rea"));
    }
}
