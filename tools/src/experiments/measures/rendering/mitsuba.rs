//! Agreement with Mitsuba 3 and the time to equal error beside it: [`agreement`](crate::agreement) as an experiment.
//!
//! Oracle: converged pictures by Mitsuba, which shares no code with this engine. Where no Python with Mitsuba is found nothing is measured, and
//! the table says so; a Python that is named but has no Mitsuba is an error. Pictures, scenes and the agreement's own report go to the
//! experiment's folder.

use clerestory::film::z_test::SIGNIFICANCE;
use clerestory::{Error, Result, atomic};

use crate::agreement::{
    AgreementOptions, AgreementReport, BIAS_Z_MAX, PYTHON_VARIABLE, SceneAgreement, Uncompared, mitsuba_version,
    run_with,
};
use crate::experiments::findings::{Bound, Criterion, Findings, Measured, Study, geometric_mean, rows};
use crate::experiments::jackknife;
use crate::experiments::kept_rows::KeptRows;
use crate::experiments::measures::Context;
use crate::experiments::table::Table;
use crate::mitsuba::scenes::scenes;

/// How to get what is missing.
const INSTALL: &str = "To measure: `python3 -m venv ~/mitsuba && ~/mitsuba/bin/pip install mitsuba==3.9.1 numpy`, then \
                       `CLERESTORY_MITSUBA_PYTHON=~/mitsuba/bin/python`; tools/mitsuba/README.md has the details.";

/// What would have to be there.
const MITSUBA: &str = "Mitsuba";

rows! {
    /// A scene by both renderers.
    struct Agreement = "Agreement within noise" by [scene] {
        scene: String = "scene",
        shows: String = "what it tests",
        verdict: Option<String> = "verdict",
        agrees: Option<f64> = "agrees: 1, undecided: ½, differs: 0",
        mean_squared_z: Option<f64> = "mean z²",
        accepted: Option<f64> = "values accepted (%)",
        worst_z: Option<f64> = "worst z",
        blocks: Option<f64> = "blocks accepted (%)",
        bias: Option<f64> = "bias (%)",
        bias_z: Option<f64> = "bias z",
        non_finite: u64 = "samples of ours that were not finite",
        second_looks: u64 = "calls for another look",
        uncompared: Option<String> = "not compared because",
    }
}

rows! {
    /// A race on a scene.
    struct Time = "Time to equal error" by [scene] {
        scene: String = "scene",
        sampler: Option<String> = "our sampler",
        error: Option<f64> = "relative MSE to reach",
        ours: Option<f64> = "our time (s)",
        best: Option<String> = "Mitsuba's best",
        theirs: Option<f64> = "its time (s)",
        ratio: Option<f64> = "ratio",
        ratio_error: Option<f64> = "standard error of the ratio",
        freedom: Option<f64> = "its degrees of freedom",
        processor: Option<f64> = "ratio of processor time",
        scalar: Option<f64> = "ratio to its scalar variant",
        samples: Option<f64> = "relative MSE over that of its best sampler at equal samples",
        samples_error: Option<f64> = "standard error of that",
        rate: Option<f64> = "paths per second over those of its best",
        bounded: Option<String> = "bounded by",
        chosen: Option<String> = "technique chosen for the error",
        chosen_seconds: Option<f64> = "its picture's time (s)",
        pilots: Option<f64> = "its pilots' time (s)",
        reached: Option<f64> = "relative MSE that it reaches",
        chosen_ratio: Option<f64> = "ratio by the chosen technique",
        unraced: Option<String> = "not raced because",
    }
}

/// What was found.
#[derive(Debug, Default, serde::Serialize, serde::Deserialize)]
pub struct Found {
    /// Why nothing was measured.
    cause: Option<String>,
    agreement: Vec<Agreement>,
    /// How it was compared, in sentences.
    compared: Vec<String>,
    times: Vec<Time>,
    /// How it was timed, and what came of it, in sentences.
    timed: Vec<String>,
}

pub(super) const OF_AGREEMENT: &[Criterion<Agreement>] = &[
    Criterion::each(
        "no scene differs, by values or by blocks; ½ where heavy tails leave it undecided",
        Bound::AtLeast(0.5),
        |row: &Agreement| row.agrees.unwrap_or(f64::NAN).into(),
    )
    .because("verdicts of the z-test at its own rate of false alarms, one in a hundred scenes")
    .needs(MITSUBA),
    Criterion::each(
        "every sample is finite: those that are not",
        Bound::AtMost(0.0),
        |row: &Agreement| row.non_finite.into(),
    )
    .needs(MITSUBA),
    Criterion::all(
        "few scenes look suspicious: those that do over the most that do by chance",
        Bound::AtMost(1.0),
        |rows: &[&Agreement]| {
            let calls: u64 = rows.iter().map(|row| row.second_looks).sum();
            (!rows.is_empty()).then(|| (calls as f64 / most_by_chance(rows.len(), CALLS_BY_CHANCE) as f64).into())
        },
    )
    .among(|row| row.uncompared.is_none())
    .because("by chance one scene in a hundred does by its blocks, and one by its bias; no more than the most do so in 99 of 100 runs")
    .needs(MITSUBA),
];

const OF_TIMES: &[Criterion<Time>] = &[
    Criterion::each(
        "the ratio of times to equal error is above 1",
        Bound::AtLeast(1.0),
        Time::ratio,
    )
    .because("with 95 % by Student's t; a scene without an error to reach gives no ratio, and fails")
    .needs(MITSUBA),
    Criterion::each("no scene is below half of Mitsuba's best", Bound::AtLeast(0.5), Time::ratio)
        .because("what a user loses at most on a scene of his own; with 95 %")
        .needs(MITSUBA),
    Criterion::all(
        "beside Mitsuba's best by the path tracer alone, geometric mean of the ratios",
        Bound::AtLeast(0.75),
        |rows: &[&Time]| geometric_mean(rows.iter().map(|row| row.ratio())),
    )
    .needs(MITSUBA),
    Criterion::all(
        "beside Mitsuba's best with the technique chosen for the error, without its pilots, geometric mean of the ratios",
        Bound::AtLeast(1.0),
        |rows: &[&Time]| {
            let told = rows.iter().filter(|row| !row.is_lost_in_noise());
            geometric_mean(told.map(|row| row.chosen_ratio.unwrap_or(f64::NAN).into()))
        },
    )
    .because("scenes are left out where the error of the chosen picture is lost in the noise of Mitsuba's converged one")
    .needs(MITSUBA),
    Criterion::all(
        "beside Mitsuba's scalar variant, geometric mean of the ratios",
        Bound::AtLeast(1.5),
        |rows: &[&Time]| geometric_mean(rows.iter().map(|row| row.scalar.unwrap_or(f64::NAN).into())),
    )
    .needs(MITSUBA),
    Criterion::each(
        "at equal samples the relative MSE is that of Mitsuba's best sampler",
        Bound::AtMost(1.05),
        |row: &Time| {
            let value = row.samples.unwrap_or(f64::NAN);
            let margin = NORMAL_95 * row.samples_error.unwrap_or(0.0);
            Measured {
                value,
                low: value - margin,
                high: value + margin,
            }
        },
    )
    .because("with 95 %, by the spread of both renderers' pictures")
    .needs(MITSUBA),
];

/// Standard deviations to either side of the mean within which 95 % of normal numbers are.
const NORMAL_95: f64 = 1.96;

/// Share of scenes that are called for another look though both renderers agree.
const CALLS_BY_CHANCE: f64 = 0.02;
/// Share of runs in which no more are called by chance.
const QUANTILE: f64 = 0.99;
const NO_ERROR: &str = "a contender is missing, or its pictures have no noise or values that are not finite";

/// The quantile of the binomial distribution: the least count that calls of so many scenes, each with probability `p`, exceed in one of a hundred
/// runs at most.
fn most_by_chance(scenes: usize, p: f64) -> u64 {
    let mut term = (1.0 - p).powf(scenes as f64);
    let mut sum = term;
    let mut most = 0;
    while sum < QUANTILE && most < scenes {
        term *= (scenes - most) as f64 / (most + 1) as f64 * p / (1.0 - p);
        sum += term;
        most += 1;
    }
    most as u64
}

/// Degrees of freedom of the sum of independent variances, each with those of its own. Source: Welch, *The generalization of "Student's" problem when
/// several different population variances are involved*, Biometrika 34, 1947.
fn degrees_of_freedom(variances: &[(f64, f64)]) -> f64 {
    let sum: f64 = variances.iter().map(|(variance, _)| variance).sum();
    let squares: f64 = variances
        .iter()
        .map(|(variance, freedom)| variance * variance / freedom)
        .sum();
    sum * sum / squares
}

/// What makes a race lost, by the rate of paths and the relative MSE at equal samples, both over Mitsuba's.
fn bounded_by(rate: f64, error: f64) -> &'static str {
    match (rate < 1.0, error > 1.0) {
        (false, false) => "nothing",
        (true, true) if rate * error > 1.0 => "error at equal samples, then paths per second",
        (true, true) => "paths per second, then error at equal samples",
        (true, false) => "paths per second",
        (false, true) => "error at equal samples",
    }
}

impl Time {
    /// Whether it was raced, and the chosen technique's error could not be told.
    fn is_lost_in_noise(&self) -> bool {
        self.unraced.is_none() && self.chosen_ratio.is_none()
    }

    /// The ratio with its interval, by its logarithm; no number without a race.
    fn ratio(&self) -> Measured {
        let ratio = self.ratio.unwrap_or(f64::NAN);
        let repeats = self.freedom.map_or(0, |freedom| freedom as usize + 1);
        let margin = jackknife::margin(self.ratio_error.map(|error| error / ratio), repeats).exp();
        Measured {
            value: ratio,
            low: ratio / margin,
            high: ratio * margin,
        }
    }

    fn of(scene: &SceneAgreement, options: &AgreementOptions) -> Self {
        let Some(race) = &scene.race else {
            return Self {
                scene: scene.name.clone(),
                unraced: Some(NO_ERROR.into()),
                ..Self::default()
            };
        };
        let best = &race.against_best;
        let [ours, theirs] = race.pair(best);
        let [samples, samples_error] = race.error_at_equal_samples();
        let rate = ours.paths_per_second / theirs.paths_per_second;
        let chosen = scene.chosen.as_ref();
        // Seconds vary from round to round, or from picture to picture where there is one round.
        let timed = match options.timing_rounds {
            ..=1 => options.timing_pictures,
            rounds => rounds,
        };
        let parts = [ours, theirs].map(|one| {
            let by_error = (one.relative_mse_error / one.relative_mse).powi(2);
            let by_seconds = (one.seconds_error.unwrap_or(0.0) / one.seconds).powi(2);
            [
                (by_error, one.pictures.saturating_sub(1) as f64),
                (by_seconds, f64::from(timed.saturating_sub(1))),
            ]
        });
        Self {
            scene: scene.name.clone(),
            sampler: Some(ours.sampler.clone()),
            error: finite(best.error),
            ours: finite(best.our_seconds),
            best: Some(race.their_best()),
            theirs: finite(best.their_seconds),
            ratio: finite(best.ratio),
            ratio_error: finite(best.ratio_error),
            freedom: finite(degrees_of_freedom(parts.as_flattened())),
            processor: best.cpu_ratio.and_then(finite),
            scalar: finite(race.against_scalar.ratio),
            samples: finite(samples),
            samples_error: finite(samples_error),
            rate: finite(rate),
            bounded: Some(bounded_by(rate, ours.relative_mse / theirs.relative_mse).into()),
            chosen: chosen.map(|one| match &*one.variant {
                "" => one.technique.clone(),
                variant => format!("{} ({variant})", one.technique),
            }),
            chosen_seconds: chosen.and_then(|one| finite(one.seconds)),
            pilots: chosen.and_then(|one| finite(one.pilot_seconds)),
            reached: chosen.and_then(|one| finite(one.relative_mse)),
            chosen_ratio: chosen.and_then(|one| finite(one.ratio)),
            unraced: None,
        }
    }
}

impl Agreement {
    fn of(scene: &SceneAgreement) -> Self {
        Self {
            scene: scene.name.clone(),
            shows: scene.shows.clone(),
            verdict: Some(scene.verdict().replace('*', "")),
            agrees: Some(match (scene.passes(), scene.agrees()) {
                (false, _) => 0.0,
                (true, false) => 0.5,
                (true, true) => 1.0,
            }),
            mean_squared_z: finite(scene.mean_squared_z),
            accepted: Some(scene.values.accepted_fraction * 100.0),
            worst_z: finite(scene.values.worst_z),
            blocks: Some(scene.blocks.accepted_fraction * 100.0),
            bias: finite(scene.relative_bias * 100.0),
            bias_z: finite(scene.values.bias_z),
            non_finite: scene.non_finite,
            second_looks: scene.is_suspicious().into(),
            uncompared: None,
        }
    }

    fn not_compared(one: &Uncompared) -> Self {
        Self {
            scene: one.name.clone(),
            uncompared: Some(one.cause.clone()),
            ..Self::default()
        }
    }
}

/// How scenes were compared, in a sentence.
pub(super) fn comparison(report: &AgreementReport) -> String {
    let options = &report.options;
    format!(
        "{0} × {0} pixels, {1} samples per pixel on both sides, {2}. Every value is tested at a significance of {SIGNIFICANCE} for the whole \
         picture. A rejected 8 × 8 block or |bias z| above {BIAS_Z_MAX} calls for another look.",
        options.size,
        options.passes * options.samples_per_pass,
        report.machine.mitsuba,
    )
}

/// The rows of all scenes, those that were not compared last.
pub(super) fn agreements(report: &AgreementReport) -> Vec<Agreement> {
    let rows = report.scenes.iter().map(Agreement::of);
    rows.chain(report.uncompared.iter().map(Agreement::not_compared))
        .collect()
}

impl Found {
    fn of(report: &AgreementReport) -> Self {
        let options = &report.options;
        let raced = report.scenes.iter().filter(|_| options.timing_rounds > 0);
        Self {
            cause: None,
            agreement: agreements(report),
            compared: vec![comparison(report)],
            times: raced.map(|scene| Time::of(scene, options)).collect(),
            timed: [report.race_method()]
                .into_iter()
                .chain(report.race_summary())
                .collect(),
        }
    }
}

impl Study for Found {
    fn measure(context: &Context<'_>) -> Result<Self> {
        let options = options(context);
        match mitsuba_version(&options.python) {
            Err(cause) => Ok(Self {
                cause: Some(without_mitsuba(cause)?),
                ..Self::default()
            }),
            Ok(version) => {
                context.watch.note(&format!("Mitsuba {version}"));
                let report = compared(context, &options)?;
                for (ending, text) in ["json", "md"].into_iter().zip(report.texts()?) {
                    atomic::write(&context.file(&format!("agreement.{ending}"))?, text.as_bytes())?;
                }
                Ok(Self::of(&report))
            }
        }
    }

    fn findings(&self) -> Findings {
        let noted =
            |findings: Findings, notes: &[String]| notes.iter().fold(findings, |all, note| all.note(note.as_str()));
        let agreement = match &self.cause {
            Some(cause) => Findings::from(vec![not_measured(cause)]).judged(&self.agreement, OF_AGREEMENT),
            None => noted(Findings::of(&self.agreement, OF_AGREEMENT), &self.compared),
        };
        let raced: Vec<Time> = self.times.iter().filter(|row| row.ratio.is_some()).cloned().collect();
        let times = Findings::of(&self.times, OF_TIMES).headline(
            "Mitsuba's time to equal error over ours, geometric mean",
            geometric_mean(raced.iter().map(Time::ratio)),
        );
        agreement.and(noted(times, &self.timed).bars(
            "ratio",
            "Mitsuba's time to equal error over ours",
            &raced,
            |row| ["Mitsuba's best over ours".to_owned(), row.scene.clone()],
            Time::ratio,
        ))
    }
}

/// Compares and races scene by scene. Scenes take minutes each, and are kept as soon as they are there, first without their race, so that a run that was stopped
/// goes on; smoke runs keep nothing.
fn compared(context: &Context<'_>, options: &AgreementOptions) -> Result<AgreementReport> {
    let gpu = (context.gpu)()?;
    let mut report = AgreementReport::begin(&gpu, options)?;
    if context.smoke {
        return run_with(&gpu, report, context.watch, &mut |_| Ok(()));
    }
    let device = format!("{}, {}", gpu.caps().device, gpu.caps().driver);
    let mut kept = KeptRows::open(context.folder, &device, &report.machine.mitsuba)?;
    let names: Vec<&str> = scenes()?.iter().map(|scene| scene.name).collect();
    for (place, name) in names.iter().enumerate() {
        let known = [true, false].map(|raced| kept.get::<SceneAgreement>(place, &case(name, raced)));
        report
            .scenes
            .extend(known.into_iter().flatten().next().unwrap_or_default());
    }
    let state = |scene: &SceneAgreement| (scene.name.clone(), scene.race.is_some());
    let mut known: Vec<(String, bool)> = report.scenes.iter().map(state).collect();
    run_with(&gpu, report, context.watch, &mut |report| {
        for (place, name) in names.iter().enumerate() {
            let scene = report.scenes.iter().find(|scene| scene.name == *name);
            if let Some(scene) = scene.filter(|scene| !known.contains(&state(scene))) {
                kept.add(place, &case(name, scene.race.is_some()), std::slice::from_ref(scene))?;
                known.push(state(scene));
            }
        }
        Ok(())
    })
}

/// What a scene's row is kept as, before and after its race.
fn case(scene: &str, raced: bool) -> String {
    match raced {
        true => format!("{scene}, raced"),
        false => scene.into(),
    }
}

fn options(context: &Context<'_>) -> AgreementOptions {
    let all = AgreementOptions {
        output: context.folder.join("scenes"),
        ..AgreementOptions::default()
    };
    if !context.smoke {
        return all;
    }
    // Two scenes, one of them with a medium.
    AgreementOptions {
        scenes: vec!["cornell-box".into(), "fog-box".into()],
        size: 16,
        passes: 32,
        samples_per_pass: 4,
        timing_rounds: 1,
        timing_pictures: 3,
        timing_samples: 4,
        ..all
    }
}

/// What a page says of a Python without Mitsuba.
///
/// # Errors
/// That cause where somebody named the Python.
pub(super) fn without_mitsuba(cause: Error) -> Result<String> {
    said_of(cause, std::env::var_os(PYTHON_VARIABLE).is_some())
}

fn said_of(cause: Error, is_named: bool) -> Result<String> {
    if is_named { Err(cause) } else { Ok(cause.to_string()) }
}

pub(super) fn not_measured(cause: &str) -> Table {
    let mut table = Table::new("Agreement with Mitsuba 3", &["result"]);
    table.row([format!("not measured: {cause}").into()]);
    table.note(INSTALL);
    table
}

/// A number, if it is one.
fn finite(number: f64) -> Option<f64> {
    number.is_finite().then_some(number)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::agreement::{Chosen, made_up};
    use crate::experiments::findings::Verdict;
    use crate::experiments::watch::Unwatched;

    /// What tells how to get Mitsuba.
    const README: &str = include_str!("../../../../mitsuba/README.md");

    #[test]
    fn without_mitsuba_the_table_says_how_to_get_it() {
        let table = not_measured("python3: cannot be run");
        assert_eq!(table.fault(), None);
        let text = table.markdown();
        assert!(
            text.contains("not measured: python3") && text.contains("pip install mitsuba"),
            "{text}"
        );
    }

    #[test]
    fn a_named_python_without_mitsuba_is_an_error() {
        let cause = || Error::setting("python", "python3", "did not run Mitsuba 3");
        assert!(said_of(cause(), true).is_err());
        let found = Found {
            cause: Some(said_of(cause(), false).unwrap()),
            ..Found::default()
        };
        let found = found.findings();
        assert_eq!(found.tables.len(), 1);
        assert!(
            found
                .verdicts
                .iter()
                .all(|judged| judged.rows == 0 && judged.found.is_none())
        );
    }

    #[test]
    fn the_version_is_that_of_the_instructions() {
        let install = INSTALL.split('`').nth(1).unwrap();
        assert!(README.contains(install), "{install}");
    }

    fn made_up_chosen() -> Chosen {
        Chosen {
            technique: "photon".into(),
            variant: String::new(),
            asked: 0.5f64.sqrt(),
            samples: 16,
            pilot_seconds: 1.0,
            seconds: 1.0,
            relative_mse: 0.4,
            ratio: 1.2,
            ratio_error: 0.1,
        }
    }

    fn decided(verdict: &Verdict) -> Option<bool> {
        match verdict {
            Verdict::Holds => Some(true),
            Verdict::Fails { .. } => Some(false),
            _ => None,
        }
    }

    #[test]
    fn a_report_becomes_sound_tables() {
        let report = made_up();
        let Findings { tables, verdicts, .. } = Found::of(&report).findings();
        let rows: Vec<usize> = tables.iter().map(|table| table.rows.len()).collect();
        // Two scenes, one of which was not raced, and says so.
        assert_eq!(rows, [2, 2]);
        assert!(tables.iter().all(|table| table.fault().is_none()));
        let text: String = tables.iter().map(Table::markdown).collect();
        for part in [
            "| raced | nothing | agrees |",
            "|bias z| above 4.5",
            "| raced | sobol | 0.5000 | 2.000 | llvm_ad_rgb, independent | 1.000 | 0.5000 | 0.03536 | 8.669 |",
            NO_ERROR,
            "slower in 1, undecided",
        ] {
            assert!(text.contains(part), "{part} in {text}");
        }
        let holds: Vec<bool> = verdicts.iter().map(|judged| judged.verdict == Verdict::Holds).collect();
        // Faster to equal error is Mitsuba in this race; the scene that was not raced fails whatever is asked of races.
        assert_eq!(holds, [[true; 3].as_slice(), &[false; 6]].concat(), "{verdicts:?}");
        assert_eq!((verdicts[3].rows, verdicts[3].failing), (2, 2));
        let mut raced = AgreementReport {
            scenes: report.scenes[..1].to_vec(),
            ..report.clone()
        };
        raced.scenes[0].chosen = Some(made_up_chosen());
        let Findings { verdicts, .. } = Found::of(&raced).findings();
        let holds: Vec<Option<bool>> = verdicts[3..].iter().map(|judged| decided(&judged.verdict)).collect();
        // A ratio of 0.5 ± 0.035, one of 1.2 by the technique that was chosen, 3 beside the scalar variant, and 0.625 of the error at equal samples.
        let expected = [Some(false), None, Some(false), Some(true), Some(true), Some(true)];
        assert_eq!(holds, expected, "{verdicts:?}");
        let untimed = AgreementReport {
            scenes: report.scenes[1..].to_vec(),
            options: AgreementOptions {
                timing_rounds: 0,
                ..report.options
            },
            ..report
        };
        assert_eq!(Found::of(&untimed).findings().tables.len(), 1);
        let refused = AgreementReport {
            uncompared: vec![Uncompared {
                name: "refused".into(),
                cause: "is not finite".into(),
            }],
            ..untimed
        };
        let first = &Found::of(&refused).findings().verdicts[0];
        assert_eq!((first.failing, first.worst.as_str()), (1, "refused"));
    }

    #[test]
    fn races_are_lost_by_paths_per_second_or_by_errors() {
        let of =
            [(0.5, 0.8), (1.5, 1.2), (0.5, 1.5), (0.9, 2.0), (1.2, 0.9)].map(|(rate, error)| bounded_by(rate, error));
        assert_eq!(
            of,
            [
                "paths per second",
                "error at equal samples",
                "paths per second, then error at equal samples",
                "error at equal samples, then paths per second",
                "nothing",
            ]
        );
    }

    #[test]
    fn chosen_pictures_without_a_known_error_are_left_out() {
        let report = made_up();
        let mut scenes = vec![report.scenes[0].clone(); 2];
        scenes[0].chosen = Some(made_up_chosen());
        let judged = |scenes: &[SceneAgreement]| {
            let report = AgreementReport {
                scenes: scenes.to_vec(),
                ..report.clone()
            };
            Found::of(&report).findings().verdicts[6].found.map(|found| found.value)
        };
        assert_eq!(judged(&scenes), Some(1.2));
        // A scene without a race is not one without noise.
        scenes.push(report.scenes[1].clone());
        assert!(judged(&scenes).unwrap().is_nan());
    }

    #[test]
    fn chance_calls_as_many_scenes_as_the_binomial_distribution_says() {
        // Of 25 at 2 %: none in 60.3 %, one at most in 91.1 %, two in 98.7 %, three in 99.9 %.
        let most = [0, 1, 8, 25, 100].map(|scenes| most_by_chance(scenes, CALLS_BY_CHANCE));
        assert_eq!(most, [0, 1, 2, 3, 6]);
        let scene = |uncompared: Option<&str>, second_looks| Agreement {
            second_looks,
            uncompared: uncompared.map(Into::into),
            ..Agreement::default()
        };
        let verdict = |calls: usize, others: usize| {
            let compared = (0..25).map(|i| scene(None, u64::from(i < calls)));
            let rows: Vec<Agreement> = compared.chain((0..others).map(|_| scene(Some("refused"), 0))).collect();
            OF_AGREEMENT[2].judge(&rows).verdict == Verdict::Holds
        };
        assert!(verdict(3, 0) && !verdict(4, 0));
        // Those that were not compared are no scenes that agree.
        assert!(!verdict(4, 100));
    }

    #[test]
    fn few_rounds_make_wide_intervals() {
        // Of one part alone its own, of two equal ones both together.
        assert_eq!(degrees_of_freedom(&[(0.25, 2.0), (0.0, 5.0)]), 2.0);
        assert_eq!(degrees_of_freedom(&[(0.25, 2.0), (0.25, 2.0)]), 4.0);
        let time = |freedom| Time {
            ratio: Some(1.25),
            ratio_error: Some(0.125),
            freedom,
            ..Time::default()
        };
        // ln 1.25 = 0.223 is above 2.042 standard errors of a tenth, but below 4.303.
        assert!(time(Some(30.5)).ratio().low > 1.0 && time(Some(2.5)).ratio().low < 1.0);
        let unknown = Time {
            ratio_error: None,
            ..time(None)
        };
        assert_eq!(unknown.ratio().high, f64::INFINITY);
        assert!(Time::default().ratio().value.is_nan());
    }

    #[test]
    fn both_forms_are_sound_options() {
        for smoke in [false, true] {
            let gpu = || Err(clerestory::Error::setting("device", "none", "is not to be opened"));
            let context = Context {
                smoke,
                scenes: &[],
                gpu: &gpu,
                folder: std::path::Path::new("folder"),
                watch: &Unwatched,
            };
            let options = options(&context);
            options.check().unwrap();
            assert!(options.output.starts_with("folder"));
        }
    }
}
