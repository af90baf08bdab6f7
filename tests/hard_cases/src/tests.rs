//! The table itself: names, words, the page; and that judgements find what is wrong.

use std::collections::BTreeSet;
use std::path::Path;

use super::*;

fn repository() -> std::path::PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

#[test]
fn every_case_says_what_it_is_and_has_a_judge() {
    let mut names = BTreeSet::new();
    for case in all() {
        let plain = case
            .name
            .chars()
            .all(|c| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '-');
        assert!(plain && names.insert(case.name), "{}", case.name);
        for text in [case.breaks, case.expects] {
            assert!(text.len() > 20 && text.ends_with('.'), "{}: {text}", case.name);
        }
        assert!(
            case.techniques.is_some() || case.rays.is_some() || case.lobes.is_some(),
            "{}",
            case.name
        );
        let file = format!("tests/hard_cases/src/cases/{}.rs", case.name.replace('-', "_"));
        assert!(repository().join(&file).is_file(), "{file}");
        assert!(by_name(case.name).is_some_and(|found| found.name == case.name));
    }
    let files = std::fs::read_dir(repository().join("tests/hard_cases/src/cases"))
        .expect("folder")
        .count();
    assert_eq!(files, all().len() + 1, "one file each, and the list");
    let names: Vec<String> = subjects().iter().map(Subject::name).collect();
    for name in [
        "path (sobol)",
        "path (pcg)",
        "photon",
        "photon (beams)",
        "photon (march)",
    ] {
        assert!(names.contains(&name.to_owned()), "{name}: {names:?}");
    }
    assert!(
        !names.contains(&"photon (ray)".to_owned()),
        "the default twice: {names:?}"
    );
}

#[test]
fn estimates_of_media_are_judged_where_there_are_some() {
    let of_media = |subject: &Subject| matches!(subject, Subject::Technique { volume: Some(_), .. });
    for case in all() {
        let scene = (case.picture)().unwrap_or_else(|error| panic!("{}: {error}", case.name));
        let shows_media = clerestory::scene::SceneProfile::of(&scene).media.any();
        assert_eq!(case.of_media, shows_media, "{}", case.name);
        for subject in subjects().iter().filter(|subject| of_media(subject)) {
            assert_eq!(
                subject.concerns(case),
                case.of_media,
                "{}: {}",
                case.name,
                subject.name()
            );
        }
    }
}

#[test]
fn every_case_has_a_scene_to_show() {
    for case in all() {
        let scene = (case.picture)().unwrap_or_else(|error| panic!("{}: {error}", case.name));
        scene.check().unwrap_or_else(|error| panic!("{}: {error}", case.name));
        assert!(scene.camera(None).is_some(), "{}: no camera", case.name);
    }
}

#[test]
fn the_page_describes_every_case_and_names_every_subject() {
    let page = std::fs::read_to_string(repository().join(PAGE)).unwrap_or_default();
    let again = "write it anew: cargo run --release -p clerestory-tools --bin clerestory -- stability --markdown > docs/stability.md";
    let picture = |case: &HardCase| repository().join(PICTURES).join(format!("{}.png", case.name));
    let sections: Vec<String> = (all().iter())
        .map(|case| case_section(case, picture(case).is_file()))
        .collect();
    assert!(page.ends_with(&sections.join("\n")), "{again}");
    assert!(page.contains(&promises()), "{again}");
    for subject in subjects() {
        assert!(
            page.contains(&format!("| {} |", subject.name())),
            "{}: {again}",
            subject.name()
        );
    }
    for case in all() {
        let row = page
            .lines()
            .find(|line| line.starts_with(&format!("| [{name}](#{name}) |", name = case.name)));
        let row = row.unwrap_or_else(|| panic!("{}: {again}", case.name));
        let cells: Vec<&str> = row
            .split(" | ")
            .skip(1)
            .map(|cell| cell.trim_end_matches(" |"))
            .collect();
        for (subject, cell) in subjects().iter().zip(cells) {
            assert_eq!(
                subject.concerns(case),
                cell != "–",
                "{}, {}: {again}",
                case.name,
                subject.name()
            );
        }
        let bytes = std::fs::metadata(picture(case)).map_or(0, |data| data.len());
        let again = "write it anew: cargo run --release -p clerestory-tools --bin clerestory -- stability --pictures docs/hard-cases";
        assert!((1..30_000).contains(&bytes), "{}: {bytes} bytes; {again}", case.name);
    }
}

/// A picture of one pixel.
fn painted(value: f32) -> Painted {
    Painted {
        radiance: vec![value; 3],
        variance: vec![1e-4; 3],
        samples: vec![4.0],
        non_finite: 0,
        spp: 4,
        counters: std::collections::BTreeMap::new(),
        tolerance: 0.0,
        passes: None,
    }
}

fn passes(check: impl FnOnce(&mut Judgement)) -> bool {
    let mut judgement = Judgement::default();
    check(&mut judgement);
    judgement.figures().iter().all(Figure::passes)
}

#[test]
fn tolerances_are_those_of_the_photons_and_no_promise_hides_in_them() {
    use crate::easel::photon_tolerance;
    let of_a_pass = photon_tolerance(f64::from(1u32 << 14));
    assert!((of_a_pass - 0.05).abs() < 1e-12);
    assert!((photon_tolerance(4.0 * f64::from(1u32 << 14)) - 0.5 * of_a_pass).abs() < 1e-12);
    // An error of 3.3 %, that of a room far from the origin, is more than the noise of four passes: it has to be documented.
    let judged = |documented| {
        let mut judgement = Judgement::default();
        let room = Painted {
            variance: vec![1e-8; 3],
            tolerance: photon_tolerance(f64::from(1u32 << 16)),
            ..painted(1.033)
        };
        judgement
            .mean_documented("", &room, [1.0; 3], [0.0, documented])
            .expect("picture");
        let worst = judgement.worst().expect("figures").clone();
        (worst.passes(), worst.is_documented())
    };
    assert_eq!(judged(0.0), (false, false));
    assert_eq!(judged(0.04), (false, true));
}

#[test]
fn judgements_find_what_is_wrong() {
    assert!(passes(|j| j.sound("", &painted(1.0))));
    assert!(!passes(|j| j.sound("", &painted(f32::NAN))));
    assert!(!passes(|j| j.sound("", &painted(-1.0))));
    assert!(!passes(|j| j.sound(
        "",
        &Painted {
            non_finite: 1,
            ..painted(1.0)
        }
    )));
    assert!(!passes(|j| j.sound("", &Painted { spp: 5, ..painted(1.0) })));
    assert!(!passes(|j| j.exactly("", &painted(1.0 + f32::EPSILON), [1.0; 3])));
    assert!(!passes(|j| j.at_most("", f64::NAN, 1.0)));
    // A deviation of 0.01 per channel and pixel.
    assert!(passes(|j| j.uniform("", &painted(1.02), [1.0; 3]).expect("picture")));
    assert!(!passes(|j| j.uniform("", &painted(1.06), [1.0; 3]).expect("picture")));
    // Of a technique with a bias, the mean over the picture alone.
    let biased = |value: f32| Painted {
        tolerance: 0.05,
        ..painted(value)
    };
    assert!(passes(|j| j.uniform("", &biased(1.09), [1.0; 3]).expect("picture")));
    assert!(!passes(|j| j.uniform("", &biased(1.11), [1.0; 3]).expect("picture")));
    assert!(!passes(|j| j.mean_at_most("", &biased(1.11), 1.0)));
    assert!(passes(|j| j.mean_at_most("", &painted(1.03), 1.0)));
    assert!(!passes(|j| j.mean_at_most("", &painted(1.06), 1.0)));
    assert!(!passes(|j| j.same_bits("", &painted(1.0), &painted(0.5))));
    assert!(!passes(|j| j.refused("", Ok(()), |_| true)));
    assert!(!passes(|j| j.refused(
        "",
        Err::<(), _>(clerestory::Error::setting("a", 1, "b")),
        |_| false
    )));
}

#[test]
fn means_of_shared_noise_are_judged_by_their_passes() {
    // Passes that differ by 0.1 either way: 0.1 · 7.9 / √15 for 16 of them, whatever the pixels' variance says.
    let shared = |value: f32, count: usize| Painted {
        variance: vec![1e-12; 3],
        passes: Some(
            (0..count)
                .map(|i| [f64::from(value) + 0.1 - 0.2 * (i % 2) as f64; 3])
                .collect(),
        ),
        ..painted(value)
    };
    for (value, right) in [(1.19, true), (1.22, false), (0.81, true), (0.78, false)] {
        assert_eq!(
            passes(|j| j.uniform("", &shared(value, 16), [1.0; 3]).expect("picture")),
            right,
            "{value}"
        );
        assert_eq!(
            passes(|j| j.mean_at_most("", &shared(value, 16), 1.0)),
            right || value < 1.0,
            "{value}"
        );
        let exact = painted(1.0);
        assert_eq!(
            passes(|j| j
                .same_expectations(
                    "",
                    &shared(value, 16),
                    &Painted {
                        variance: vec![0.0; 3],
                        ..exact
                    }
                )
                .expect("picture")),
            right,
            "{value}"
        );
    }
    // Two such pictures differ by √2 times as much, and fewer passes know their variance less well.
    assert!(passes(|j| j
        .same_expectations("", &shared(1.27, 16), &shared(1.0, 16))
        .expect("picture")));
    assert!(!passes(|j| j
        .same_expectations("", &shared(1.31, 16), &shared(1.0, 16))
        .expect("picture")));
    assert!(passes(|j| j.uniform("", &shared(1.5, 4), [1.0; 3]).expect("picture")));
    // Of a single pass nothing is known of the noise.
    assert!(!passes(|j| j.mean_at_most("", &shared(1.01, 1), 1.0)));
}

#[test]
fn only_pictures_that_others_get_wrong_as_well_are_excused() {
    let judged = |wrong: &[&str]| {
        let mut judgement = Judgement::default();
        for picture in ["room", "court: by day"] {
            judgement.at_most(
                format!("{picture}: error of the mean"),
                f64::from(u8::from(wrong.contains(&picture))),
                0.5,
            );
        }
        judgement
    };
    let (right, room, both) = (judged(&[]), judged(&["room"]), judged(&["room", "court: by day"]));
    assert!(right.errs_where(&right) && room.errs_where(&room) && room.errs_where(&both));
    assert!(!room.errs_where(&right) && !both.errs_where(&room) && !judged(&["court: by day"]).errs_where(&room));
}

#[test]
fn wrong_values_are_no_unsound_pictures() {
    let sound = |check: &dyn Fn(&mut Judgement)| {
        let mut judgement = Judgement::default();
        check(&mut judgement);
        judgement.has_sound_pictures()
    };
    assert!(sound(&|j| j.exactly("", &painted(1.0), [2.0; 3])));
    assert!(!sound(&|j| j.exactly("", &painted(f32::NAN), [1.0; 3])));
    assert!(!sound(&|j| j.same_bits("", &painted(1.0), &painted(0.5))));
    assert!(!sound(&|j| j.refused("", Ok(()), |_| true)));
    for info in clerestory::techniques::all() {
        let partial = info.path_set != clerestory::transport::PathSet::ALL;
        assert!(
            Subject::of(info)
                .iter()
                .all(|subject| subject.limits().is_some() == partial)
        );
    }
}

#[test]
fn the_worst_figure_decides() {
    let mut judgement = Judgement::default();
    judgement.at_most("fine", 1.0, 2.0);
    assert!(judgement.worst().is_some_and(Figure::passes));
    judgement.at_most_documented("so so", 3.0, 2.0, 4.0);
    judgement.at_most("fine too", 1.9, 2.0);
    let worst = judgement.worst().expect("figure");
    assert!(!worst.passes() && worst.is_documented());
    judgement.at_most("wrong", 2.1, 2.0);
    assert!(
        judgement
            .worst()
            .is_some_and(|worst| !worst.is_documented() && worst.what == "wrong")
    );
}

#[test]
fn an_index_that_loses_triangles_is_found_out() {
    use clerestory::accel::bvh2::{Bvh2, Bvh2Settings};
    let lossy = IndexCase {
        name: "lossy",
        build: |triangles| {
            let half = &triangles[..triangles.len() / 2];
            Ok(Box::new(Bvh2::build(half, &Bvh2Settings::default())?))
        },
    };
    let sets = (cases::ALL[0].rays.expect("rays"))();
    let judgement = rays::judge(&lossy, &sets).expect("judgement");
    let worst = judgement.worst().expect("figure");
    assert!(!worst.is_documented(), "{worst}");
    let judgement = rays::judge(&INDEXES[0], &sets).expect("judgement");
    assert!(judgement.figures().iter().all(Figure::passes));
}
