//! The registry of hard cases comes out as it says, and settings that cannot be are refused.

use clerestory::Error;
use clerestory::scene::SceneProfile;
use clerestory::techniques::{PathTracer, PathTracerSettings};
use clerestory_hard_cases::{HardCase, Outcome, Subject, Verdict, all, judge, subjects};
use clerestory_tests::render::{builtin, upload};
use clerestory_tests::with_gpu;

/// What is wrong with an outcome, in words.
fn fault(case: &HardCase, subject: &Subject, outcome: &Outcome) -> Option<String> {
    let expected = match (outcome.verdict, subject) {
        (Verdict::Fails, _) => false,
        (Verdict::Pass, Subject::Technique { info, .. }) => info.id != "path" || case.documented.is_none(),
        (Verdict::Pass, _) => true,
        // What a technique refuses it says beforehand of the scene that the case shows; one that shows a part of the light may refuse another of
        // the case's scenes. Some estimates of light in media have none for grids.
        (Verdict::Refused, Subject::Technique { info, volume, .. }) => {
            let shown = (case.picture)().map(|scene| SceneProfile::of(&scene));
            let refuses = |shown: &SceneProfile| {
                !(info.refusals)(shown).is_empty() || (volume.is_some() && shown.media.heterogeneous)
            };
            subject.limits().is_some() || shown.is_ok_and(|shown| refuses(&shown))
        }
        (Verdict::Refused, _) => false,
        (Verdict::Degrades, _) => {
            let documented = case.documented_of(subject).map(str::to_owned);
            outcome.reason.is_some() && (outcome.reason == documented || outcome.reason == subject.limits())
        }
    };
    (!expected).then(|| format!("{outcome:?}"))
}

/// Judges all cases on the subjects of a kind.
fn check(kind: impl Fn(&Subject) -> bool) {
    check_some(kind, |_| true);
}

/// Judges some cases on the subjects of a kind.
fn check_some(kind: impl Fn(&Subject) -> bool, some: impl Fn(&HardCase) -> bool) {
    with_gpu(|gpu| {
        let mut faults = Vec::new();
        let mut judged = 0;
        for subject in subjects().iter().filter(|subject| kind(subject)) {
            for case in all().iter().filter(|case| some(case)) {
                if let Some(outcome) = judge(gpu, case, subject) {
                    judged += 1;
                    faults.extend(fault(case, subject, &outcome));
                }
            }
        }
        assert!(judged > 0);
        assert!(faults.is_empty(), "not as documented:\n{}", faults.join("\n"));
    });
}

/// Subjects that have a test each; all other techniques share one.
const ALONE: [&str; 13] = [
    "path (sobol)",
    "path (pcg)",
    "photon",
    "photon (beams)",
    "photon (planes)",
    "photon (unified)",
    "photon (march)",
    "vpl",
    "bdpt",
    "many-light",
    "impostor",
    "localized-gather",
    "ray-bundles",
];

fn check_alone(name: &str) {
    check_some_alone(name, |_| true);
}

fn check_some_alone(name: &str, some: impl Fn(&HardCase) -> bool) {
    assert!(ALONE.contains(&name), "{name} is judged twice");
    check_some(|subject| subject.name() == name, some);
}

/// Cases of materials, whose pictures by virtual lights take as long as those of all others.
const OF_MATERIALS: [&str; 5] = [
    "nested-dielectrics",
    "extreme-roughness",
    "extreme-refraction",
    "grazing-incidence",
    "black-and-white",
];

fn is_of_materials(case: &HardCase) -> bool {
    OF_MATERIALS.contains(&case.name)
}

/// Cases whose media are a ball that scatters, most of a picture.
const BALLS_OF_MEDIA: [&str; 3] = ["media-narrow-phase", "media-albedo-one", "media-uneven-bands"];
const GRIDS_AND_SHEETS: [&str; 2] = ["media-grids", "media-thin-sheet"];

fn is_ball_of_a_medium(case: &HardCase) -> bool {
    BALLS_OF_MEDIA.contains(&case.name)
}

/// Whether a case has neither media nor materials that take long.
fn is_another(case: &HardCase) -> bool {
    !is_of_materials(case) && !case.of_media
}

#[test]
fn the_path_tracer_takes_the_cases_as_documented() {
    check_alone("path (sobol)");
}

#[test]
fn the_path_tracer_takes_the_cases_with_independent_samples() {
    check_alone("path (pcg)");
}

#[test]
fn photon_mapping_takes_the_cases_of_materials_as_documented() {
    check_some_alone("photon", is_of_materials);
}

#[test]
fn photon_mapping_takes_the_cases_of_media_as_documented() {
    check_some_alone("photon", |case| case.of_media);
}

#[test]
fn photon_mapping_takes_the_other_cases_as_documented() {
    check_some_alone("photon", is_another);
}

#[test]
fn photon_beams_take_balls_of_media_as_documented() {
    check_some_alone("photon (beams)", is_ball_of_a_medium);
}

#[test]
fn photon_beams_take_the_other_cases_of_media_as_documented() {
    check_some_alone("photon (beams)", |case| !is_ball_of_a_medium(case));
}

#[test]
fn photon_planes_take_balls_of_media_as_documented() {
    check_some_alone("photon (planes)", is_ball_of_a_medium);
}

#[test]
fn photon_planes_take_the_other_cases_of_media_as_documented() {
    check_some_alone("photon (planes)", |case| !is_ball_of_a_medium(case));
}

#[test]
fn photon_points_and_beams_together_take_balls_of_media_as_documented() {
    check_some_alone("photon (unified)", is_ball_of_a_medium);
}

#[test]
fn photon_points_and_beams_together_take_the_other_cases_of_media_as_documented() {
    check_some_alone("photon (unified)", |case| !is_ball_of_a_medium(case));
}

#[test]
fn marches_take_the_cases_of_media_as_documented() {
    check_alone("photon (march)");
}

#[test]
fn virtual_lights_take_the_cases_of_materials_as_documented() {
    check_some_alone("vpl", is_of_materials);
}

#[test]
fn virtual_lights_take_the_other_cases_as_documented() {
    check_some_alone("vpl", is_another);
}

/// The balls of media one by one, and the other media in two parts.
#[test]
fn virtual_lights_take_narrow_phase_functions_as_documented() {
    check_some_alone("vpl", |case| case.name == BALLS_OF_MEDIA[0]);
}

#[test]
fn virtual_lights_take_media_that_absorb_nothing_as_documented() {
    check_some_alone("vpl", |case| case.name == BALLS_OF_MEDIA[1]);
}

#[test]
fn virtual_lights_take_media_of_uneven_bands_as_documented() {
    check_some_alone("vpl", |case| case.name == BALLS_OF_MEDIA[2]);
}

#[test]
fn virtual_lights_take_grids_and_sheets_as_documented() {
    check_some_alone("vpl", |case| GRIDS_AND_SHEETS.contains(&case.name));
}

#[test]
fn virtual_lights_take_the_other_cases_of_media_as_documented() {
    check_some_alone("vpl", |case| {
        case.of_media && !is_ball_of_a_medium(case) && !GRIDS_AND_SHEETS.contains(&case.name)
    });
}

#[test]
fn bidirectional_paths_take_the_cases_of_materials_as_documented() {
    check_some_alone("bdpt", is_of_materials);
}

#[test]
fn bidirectional_paths_take_the_other_cases_as_documented() {
    check_some_alone("bdpt", |case| !OF_MATERIALS.contains(&case.name) && !case.of_media);
}

#[test]
fn bidirectional_paths_take_the_cases_of_media_as_documented() {
    check_some_alone("bdpt", |case| case.of_media);
}

#[test]
fn frames_of_many_lights_take_the_cases_of_materials_as_documented() {
    check_some_alone("many-light", is_of_materials);
}

#[test]
fn frames_of_many_lights_take_the_other_cases_as_documented() {
    check_some_alone("many-light", |case| !is_of_materials(case));
}

#[test]
fn impostors_take_the_cases_as_documented() {
    check_alone("impostor");
}

#[test]
fn localized_gathers_take_the_cases_as_documented() {
    check_alone("localized-gather");
}

#[test]
fn ray_bundles_take_the_cases_as_documented() {
    check_alone("ray-bundles");
}

#[test]
fn the_other_techniques_take_the_cases_as_documented() {
    check(|subject| matches!(subject, Subject::Technique { .. }) && !ALONE.contains(&subject.name().as_str()));
}

#[test]
fn ray_indexes_answer_as_a_search_through_all_triangles() {
    check(|subject| matches!(subject, Subject::Index(_)));
}

#[test]
fn scattering_functions_stay_finite_and_keep_their_energy() {
    check(|subject| matches!(subject, Subject::Lobes));
}

#[test]
fn settings_out_of_range_are_refused_by_name() {
    with_gpu(|gpu| {
        let scene = builtin("builtin:furnace-box");
        let uploaded = upload(gpu, &scene);
        let fine = PathTracerSettings::default;
        for (wanted, settings) in [
            (
                "roulette_cap",
                PathTracerSettings {
                    roulette_cap: 0.0,
                    ..fine()
                },
            ),
            (
                "roulette_cap",
                PathTracerSettings {
                    roulette_cap: f32::NAN,
                    ..fine()
                },
            ),
            (
                "roulette_cap",
                PathTracerSettings {
                    roulette_cap: 1.5,
                    ..fine()
                },
            ),
            ("ray_quota", PathTracerSettings { ray_quota: 0, ..fine() }),
            (
                "ray_quota",
                PathTracerSettings {
                    ray_quota: 65_536,
                    ..fine()
                },
            ),
            (
                "paths_in_flight",
                PathTracerSettings {
                    paths_in_flight: u32::MAX,
                    ..fine()
                },
            ),
        ] {
            match PathTracer::new(gpu, uploaded.clone(), &scene.cameras[0], [16, 16], settings) {
                Err(Error::Setting { name, .. }) => assert_eq!(name, wanted),
                other => panic!("{wanted}: {}", other.is_ok()),
            }
        }
        let mut camera = scene.cameras[0].clone();
        camera.lens_radius = f32::NAN;
        assert!(PathTracer::new(gpu, uploaded, &camera, [16, 16], fine()).is_err());
    });
}
