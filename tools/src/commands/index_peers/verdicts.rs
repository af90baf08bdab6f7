//! What is good of our indexes beside those of other libraries: builds that take no longer, and rays that are no slower, scene by scene.
//!
//! A ratio lies between that of our least and their greatest and the other way round.

use clerestory_tools::experiments::findings::{Bound, Judged, Measured as Number, judge};

use super::{Found, KINDS, Measured, Spread};

/// Ours by the same heuristic as that of [`SAME_HEURISTIC`].
const BINNED: &str = "bvh2, binned";
/// A peer by the binned surface area heuristic.
pub const SAME_HEURISTIC: &str = "bvh, SAH";
/// Names of our indexes of eight children a node begin so.
const WIDE: &str = "wide";
/// Scenes whose rays wide nodes are to speed up: their addresses begin so.
const WIDE_SCENES: [&str; 3] = ["builtin:conference", "builtin:box-city", "builtin:sphere-flake"];
/// By how much, over [`BINNED`].
const WIDE_GAIN: f64 = 1.6;
/// The peer whose hits are as careful as ours, by the end of its name.
const ROBUST: &str = "robust";
/// What share of its rate they are to reach, and in how many scenes.
const ROBUST_SHARE: f64 = 0.8;
const ROBUST_SCENES: usize = 2;

fn ratio(ours: Spread, theirs: Spread) -> Number {
    Number {
        value: ours.median / theirs.median,
        low: ours.least / theirs.greatest,
        high: ours.greatest / theirs.least,
    }
}

/// Of each scene the best of ours over the best of the others; none for scenes without either.
fn of_best(found: &Found, of: impl Fn(&Measured) -> Spread, is_less_better: bool) -> Vec<(String, Number)> {
    let best = |scene: &[Measured], is_ours: bool| {
        let medians = scene.iter().filter(|one| one.is_ours == is_ours).map(&of);
        medians.min_by(|a, b| {
            let order = a.median.total_cmp(&b.median);
            if is_less_better { order } else { order.reverse() }
        })
    };
    let of_scene = |scene: &[Measured]| {
        let number = ratio(best(scene, true)?, best(scene, false)?);
        Some((scene[0].scene.clone(), number))
    };
    let scenes = found.indexes.chunk_by(|a, b| a.scene == b.scene);
    scenes.filter_map(of_scene).collect()
}

/// Of each scene our binned build over that of the peer with the same heuristic.
fn of_same_heuristic(found: &Found) -> Vec<(String, Number)> {
    let of_scene = |scene: &[Measured]| {
        let build = |name: &str| scene.iter().find(|one| one.index == name).map(|one| one.build);
        Some((scene[0].scene.clone(), ratio(build(BINNED)?, build(SAME_HEURISTIC)?)))
    };
    let scenes = found.indexes.chunk_by(|a, b| a.scene == b.scene);
    scenes.filter_map(of_scene).collect()
}

/// Of each scene the best rate of our wide indexes over that of the index that `of` tells; none for scenes without either.
fn of_wide(found: &Found, kind: usize, of: impl Fn(&str) -> bool) -> Vec<(String, Number)> {
    let rate = |one: &Measured| one.mrays_per_second[kind];
    let of_scene = |scene: &[Measured]| {
        let wide = scene.iter().filter(|one| one.is_ours && one.index.starts_with(WIDE));
        let wide = wide.map(rate).max_by(|a, b| a.median.total_cmp(&b.median))?;
        let other = scene.iter().find(|one| of(&one.index)).map(rate)?;
        Some((scene[0].scene.clone(), ratio(wide, other)))
    };
    let scenes = found.indexes.chunk_by(|a, b| a.scene == b.scene);
    scenes.filter_map(of_scene).collect()
}

/// The verdicts.
pub fn verdicts(found: &Found) -> Vec<Judged> {
    let mut all = vec![
        judge(
            "the fastest of our builds takes no longer than the fastest of the others: time over theirs",
            Bound::AtMost(1.0),
            "",
            of_best(found, |one| one.build, true),
        ),
        judge(
            &format!(
                "our binned build takes no longer than that of {SAME_HEURISTIC}, by the same heuristic: time over its"
            ),
            Bound::AtMost(1.0),
            "",
            of_same_heuristic(found),
        ),
    ];
    for (kind, word) in KINDS.into_iter().enumerate() {
        all.push(judge(
            &format!("{word} rays in the best of our indexes are as many a second as in the best of the others: rate over theirs"),
            Bound::AtLeast(1.0),
            "",
            of_best(found, |one| one.mrays_per_second[kind], false),
        ));
        let mut over_binary = of_wide(found, kind, |name| name == BINNED);
        over_binary.retain(|(scene, _)| WIDE_SCENES.iter().any(|of| scene.starts_with(of)));
        all.push(judge(
            &format!("{word} rays in eight children a node are {WIDE_GAIN} times as many a second as in {BINNED}: rate over its"),
            Bound::AtLeast(WIDE_GAIN),
            "rows are the scenes that wide nodes were made for",
            over_binary,
        ));
        let mut over_robust = of_wide(found, kind, |name| name.ends_with(ROBUST));
        over_robust.sort_by(|a, b| b.1.value.total_cmp(&a.1.value));
        over_robust.truncate(ROBUST_SCENES);
        all.push(judge(
            &format!(
                "{word} rays in eight children a node reach {ROBUST_SHARE} of the rate of Embree's robust mode in {ROBUST_SCENES} scenes: rate over its"
            ),
            Bound::AtLeast(ROBUST_SHARE),
            "rows are the best scenes",
            over_robust,
        ));
    }
    all
}

#[cfg(test)]
mod tests {
    use clerestory_tools::experiments::findings::Verdict;

    use super::super::Disagreement;
    use super::*;

    fn spread(median: f64) -> Spread {
        Spread {
            median,
            least: 0.95 * median,
            greatest: 1.05 * median,
        }
    }

    fn one(index: &str, is_ours: bool, build: f64, rays: f64) -> Measured {
        Measured {
            scene: "room".into(),
            index: index.into(),
            is_ours,
            triangles: 1,
            build: spread(build),
            sah_cost: None,
            mrays_per_second: [spread(rays); 2],
            ratios: [1.0; 2],
            rays: [1; 2],
            hits: [1; 2],
            disagreement: [Disagreement::default(); 2],
        }
    }

    fn found(indexes: Vec<Measured>) -> Found {
        Found {
            device: String::new(),
            driver: String::new(),
            engine_version: "",
            processor: String::new(),
            threads: 1,
            load: None,
            repeat: 1,
            absent: Vec::new(),
            indexes,
            work: Vec::new(),
        }
    }

    #[test]
    fn wide_nodes_are_held_against_binary_ones_and_embree() {
        let mut indexes = Vec::new();
        for (scene, wide, robust) in [
            ("builtin:conference", 2.0, 10.0),
            ("builtin:materials", 1.0, 1.0),
            ("builtin:sphere-flake?depth=3", 1.5, 1.5),
        ] {
            let of = |one: Measured| Measured {
                scene: scene.into(),
                ..one
            };
            indexes.push(of(one(BINNED, true, 1.0, 1.0)));
            indexes.push(of(one("wide, of binned", true, 1.0, wide)));
            indexes.push(of(one("wide, of lbvh, high", true, 1.0, 0.5 * wide)));
            indexes.push(of(one("Embree, robust", false, 1.0, robust)));
        }
        let all = verdicts(&found(indexes));
        let number = |i: usize| all[i].found.map(|found| found.value);
        // `materials` is not of the scenes of the first, the conference not of the two best of the second.
        assert_eq!([3, 4].map(number), [1.5, 1.0].map(Some));
        assert_ne!(all[3].verdict, Verdict::Holds);
    }

    #[test]
    fn the_best_of_ours_are_held_against_the_best_of_the_others() {
        let all = verdicts(&found(vec![
            one(BINNED, true, 4.0, 3.0),
            one("lbvh, fast", true, 1.0, 2.0),
            one(SAME_HEURISTIC, false, 2.0, 1.0),
            one("Embree", false, 3.0, 10.0),
        ]));
        let number = |i: usize| all[i].found.map(|found| found.value);
        assert_eq!([0, 1, 2, 5].map(number), [0.5, 2.0, 0.3, 0.3].map(Some));
        assert_eq!(all[0].verdict, Verdict::Holds);
        assert!([1, 2, 5].map(|i| matches!(all[i].verdict, Verdict::Fails { .. })) == [true; 3]);
        // Nothing to hold against.
        let alone = verdicts(&found(vec![one(BINNED, true, 4.0, 3.0)]));
        assert!(alone.iter().all(|judged| judged.verdict == Verdict::NotRun));
    }
}
