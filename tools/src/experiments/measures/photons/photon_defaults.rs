//! Photon kernels from footprints beside fixed ones: which settings of either err least at equal time on some scenes, and how long both take to
//! equal error on others, by their defaults and by what was found.
//!
//! Oracle: the path tracer, which shares no bias with photons; its own variance is subtracted, and its error stands beside what it judges.

use clerestory::Result;
use clerestory::gpu::Gpu;

use super::kernel_contest::{Candidate, DEFAULTS, FIXED, FOOTPRINTS, Stage, curve, time_to};
use crate::experiments::findings::{Bound, Criterion, Findings, Measured, Repeats, Study, geometric_mean, rows};
use crate::experiments::measures::Context;
use crate::experiments::reference::short_name;

/// Scenes that settings are found on.
const FOUND_ON: [&str; 3] = [
    "builtin:cornell-box?sphere=glass&boxes=none",
    "builtin:passage",
    "builtin:ring?roughness=0.3",
];
/// Six others, which judge.
const JUDGED_ON: [&str; 6] = [
    "builtin:box-room?mirror=no",
    "builtin:divider-room",
    "builtin:divider-room?roughness=0.3",
    "builtin:ring?roughness=0.2&height=1",
    "builtin:cornell-box?sphere=gold",
    "builtin:sphere-flake",
];
/// Seconds of a picture where settings are found, and budgets of those that judge.
const SECONDS: f64 = 0.25;
const BUDGETS: [f64; 3] = [0.1, 0.4, 1.2];
/// Samples per pixel of references: fewer where settings are only found.
const FINDING_SPP: u32 = 32_768;
const JUDGING_SPP: u32 = 262_144;
const FOUND: &str = "found";

rows! {
    /// Settings on the scenes that they are found on.
    struct Tried = "Settings at equal time, on the scenes that they are found on" by [kernels, settings] {
        kernels: String = "kernels",
        settings: String = "settings",
        error: Repeats = "relative RMSE, geometric mean of the scenes",
        seconds: Repeats = "seconds of a picture",
        wins: bool = "least error of its kind",
    }
}

rows! {
    /// Kernels of a kind on one of the other scenes.
    struct Curve = "Error against time on other scenes" by [scene, kernels, choice] {
        scene: String = "scene",
        kernels: String = "kernels",
        choice: String = "settings are",
        settings: String = "settings",
        slope: Repeats = "slope of log relative RMSE against log time",
        error: Repeats = "relative RMSE at the greatest budget",
        seconds: Repeats = "seconds of the greatest budget",
        reference: Repeats = "reference's own error over this",
    }
}

rows! {
    /// Both kinds on one of the other scenes.
    struct Contest = "Time to equal error on other scenes" by [scene, choice] {
        scene: String = "scene",
        choice: String = "settings are",
        error: f64 = "relative RMSE that both reach",
        ratio: Repeats = "time of fixed kernels over that of footprints",
    }
}

/// What was found.
#[derive(Debug, Default, serde::Serialize, serde::Deserialize)]
pub struct Found {
    tried: Vec<Tried>,
    curves: Vec<Curve>,
    contests: Vec<Contest>,
}

const OF_CONTESTS: &[Criterion<Contest>] = &[
    Criterion::all(
        "footprints by their defaults reach the error of fixed kernels in less time: the others' time over theirs, geometric mean of the six scenes",
        Bound::AtLeast(1.0),
        |rows: &[&Contest]| geometric_mean(rows.iter().map(|row| row.ratio.measured())),
    )
    .among(|row| row.choice == DEFAULTS),
    Criterion::all(
        "fixed kernels by their defaults reach the error of footprints in less time: the others' time over theirs, geometric mean of the six scenes",
        Bound::AtLeast(1.0),
        |rows: &[&Contest]| geometric_mean(rows.iter().map(|row| inverse(&row.ratio).measured())),
    )
    .among(|row| row.choice == DEFAULTS),
    Criterion::all(
        "footprints by what was found reach the error of fixed kernels in less time: the others' time over theirs, geometric mean of the six scenes",
        Bound::AtLeast(1.0),
        |rows: &[&Contest]| geometric_mean(rows.iter().map(|row| row.ratio.measured())),
    )
    .among(|row| row.choice == FOUND),
];

const AS_FAR: &str = "a stated equivalence, not scatter: over 12 times the time 0.05 is a factor of 1.13 in the error";
const SLOPES: Bound = Bound::Between(-0.3833, -0.2833);
const OF_CURVES: &[Criterion<Curve>] = &[
    Criterion::each(
        "the reference's own error is below a tenth of what it judges",
        Bound::AtMost(0.1),
        |row: &Curve| (&row.reference).into(),
    ),
    Criterion::all(
        "errors of footprints fall with slope −⅓, mean of the scenes",
        SLOPES,
        mean_slope,
    )
    .among(|row| row.kernels == FOOTPRINTS && row.choice == DEFAULTS)
    .because(AS_FAR),
    Criterion::all(
        "errors of fixed kernels fall with slope −⅓, mean of the scenes",
        SLOPES,
        mean_slope,
    )
    .among(|row| row.kernels == FIXED && row.choice == DEFAULTS)
    .because(AS_FAR),
];

fn inverse(ratios: &Repeats) -> Repeats {
    ratios.0.iter().map(|ratio| 1.0 / ratio).collect()
}

fn mean_slope(rows: &[&Curve]) -> Option<Measured> {
    let slopes: Vec<Measured> = rows.iter().map(|row| row.slope.measured()).collect();
    let mean = |of: fn(&Measured) -> f64| slopes.iter().map(of).sum::<f64>() / slopes.len() as f64;
    (!slopes.is_empty()).then(|| Measured {
        value: mean(|slope| slope.value),
        low: mean(|slope| slope.low),
        high: mean(|slope| slope.high),
    })
}

impl Found {
    /// Tries all settings; those of least error, one of each kind, come back. `None` when it was stopped.
    fn find(&mut self, context: &Context<'_>, gpu: &Gpu) -> Result<Option<[Candidate; 2]>> {
        let mut candidates = Candidate::all(context);
        let mut of_scenes = Vec::new();
        for (done, address) in context.first(&FOUND_ON, 1).iter().enumerate() {
            context
                .watch
                .begin(short_name(address), done, FOUND_ON.len() + JUDGED_ON.len());
            let Some(stage) = Stage::new(context, gpu, address, FINDING_SPP)? else {
                return Ok(None);
            };
            let Some(pictures) = stage.pictures(context, &candidates.iter().collect::<Vec<_>>(), &[SECONDS])? else {
                return Ok(None);
            };
            of_scenes.push(pictures);
        }
        for (i, candidate) in candidates.iter().enumerate() {
            let turns = of_scenes.first().map_or(0, |scene| scene[i][0].len());
            let mean = |part: usize| -> Repeats {
                let of_turn = |turn: usize| of_scenes.iter().map(|scene| scene[i][0][turn][part].ln()).sum::<f64>();
                (0..turns)
                    .map(|turn| (of_turn(turn) / of_scenes.len() as f64).exp())
                    .collect()
            };
            self.tried.push(Tried {
                kernels: candidate.kernels.into(),
                settings: candidate.words.clone(),
                error: mean(0),
                seconds: mean(1),
                wins: false,
            });
        }
        let mut winner = |kernels: &str| {
            let of_kind = (0..self.tried.len()).filter(|i| self.tried[*i].kernels == kernels);
            let error = |i: &usize| self.tried[*i].error.measured().value;
            let best = of_kind.min_by(|a, b| error(a).total_cmp(&error(b))).unwrap_or(0);
            self.tried[best].wins = true;
            best
        };
        let [fixed, footprints] = [winner(FIXED), winner(FOOTPRINTS)];
        // The later one first, so that the earlier stays where it is.
        let later = candidates.remove(fixed.max(footprints));
        let earlier = candidates.remove(fixed.min(footprints));
        Ok(Some(if fixed < footprints {
            [earlier, later]
        } else {
            [later, earlier]
        }))
    }

    /// Adds one of the other scenes; false when it was stopped.
    fn judge(&mut self, context: &Context<'_>, gpu: &Gpu, address: &str, found: &[Candidate; 2]) -> Result<bool> {
        let Some(stage) = Stage::new(context, gpu, address, JUDGING_SPP)? else {
            return Ok(false);
        };
        let defaults = [FIXED, FOOTPRINTS].map(Candidate::defaults);
        let all = [&defaults[0], &defaults[1], &found[0], &found[1]];
        let budgets = context.first(&BUDGETS, 2);
        let Some(pictures) = stage.pictures(context, &all, budgets)? else {
            return Ok(false);
        };
        for (pair, choice) in pictures.chunks(2).zip([DEFAULTS, FOUND]) {
            let turns = 0..pair[0][0].len();
            let mut reached = 0.0_f64;
            for (side, budgets) in pair.iter().enumerate() {
                let candidate = all[side + if choice == FOUND { 2 } else { 0 }];
                let [error, seconds, reference] = budgets.last().map(|last| Repeats::by_part(last)).unwrap_or_default();
                let slope = |turn| {
                    let curve = curve(budgets, turn);
                    let [[e0, s0], [e1, s1]] = [curve[0], curve[curve.len() - 1]];
                    (e1 / e0).ln() / (s1 / s0).ln()
                };
                reached = reached.max(error.measured().value);
                self.curves.push(Curve {
                    scene: short_name(address).into(),
                    kernels: candidate.kernels.into(),
                    choice: choice.into(),
                    settings: candidate.words.clone(),
                    slope: turns.clone().map(slope).collect(),
                    error,
                    seconds,
                    reference,
                });
            }
            let time = |side: usize, turn: usize| time_to(reached, &curve(&pair[side], turn));
            self.contests.push(Contest {
                scene: short_name(address).into(),
                choice: choice.into(),
                error: reached,
                ratio: turns.map(|turn| time(0, turn) / time(1, turn)).collect(),
            });
        }
        Ok(true)
    }
}

impl Study for Found {
    fn measure(context: &Context<'_>) -> Result<Self> {
        let gpu = (context.gpu)()?;
        let mut all = Self::default();
        let Some(found) = all.find(context, &gpu)? else {
            return Ok(all);
        };
        let scenes = context.first(&JUDGED_ON, 1);
        for (done, address) in scenes.iter().enumerate() {
            context.watch.begin(
                short_name(address),
                FOUND_ON.len() + done,
                FOUND_ON.len() + JUDGED_ON.len(),
            );
            if context.watch.stopped() || !all.judge(context, &gpu, address, &found)? {
                break;
            }
        }
        Ok(all)
    }

    fn findings(&self) -> Findings {
        let by_defaults = self.contests.iter().filter(|row| row.choice == DEFAULTS);
        Findings::of(&self.contests, OF_CONTESTS)
            .headline(
                "time of fixed kernels over that of footprints by their defaults, geometric mean of six scenes",
                geometric_mean(by_defaults.map(|row| row.ratio.measured())),
            )
            .note(
                "Each turn's times are read off its own three budgets, in logarithms; before the first, by the line through the first two. What is \
                 found were the settings of least error at equal time on three other scenes, which the last table lists.",
            )
            .and(Findings::of(&self.curves, OF_CURVES))
            .note(
                "Indirect light, 20 × 20 pixels. Passes are as many as take the budget by the seconds of two. Relative RMSE has the reference's \
                 variance subtracted; the reference's own error is the root of that variance's mean.",
            )
            .and(Findings::of(&self.tried, &[]))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_contest_the_other_way_round_has_the_inverse_ratios() {
        assert_eq!(inverse(&Repeats(vec![0.5, 4.0])), Repeats(vec![2.0, 0.25]));
    }
}
