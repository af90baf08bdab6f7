//! Agreement with Mitsuba 3 and the time to equal error beside it: [`agreement`](crate::agreement) as an experiment.
//!
//! Oracle: converged pictures by Mitsuba, which shares no code with this engine. Where no Python with Mitsuba is found nothing is measured, and
//! the table says so; a Python that is named but has no Mitsuba is an error. Pictures, scenes and the agreement's own report go to the
//! experiment's folder.

use clerestory::film::z_test::{ACCEPTED_FRACTION, SIGNIFICANCE};
use clerestory::{Error, Result};

use crate::agreement::{AgreementOptions, AgreementReport, BIAS_Z_MAX, PYTHON_VARIABLE, mitsuba_version, run_with};
use crate::experiments::measures::Context;
use crate::experiments::table::{Cell, Table};

/// How to get what is missing.
const INSTALL: &str = "To measure: `python3 -m venv ~/mitsuba && ~/mitsuba/bin/pip install mitsuba==3.9.1 numpy`, then \
                       `CLERESTORY_MITSUBA_PYTHON=~/mitsuba/bin/python`; tools/mitsuba/README.md has the details.";

/// The measure.
pub fn measure(context: &Context<'_>) -> Result<Vec<Table>> {
    let options = options(context);
    match mitsuba_version(&options.python) {
        Err(cause) => without_mitsuba(cause, std::env::var_os(PYTHON_VARIABLE).is_some()),
        Ok(version) => {
            context.watch.note(&format!("Mitsuba {version}"));
            let report = run_with(&(context.gpu)()?, &options, context.watch)?;
            Ok(tables(&report))
        }
    }
}

fn options(context: &Context<'_>) -> AgreementOptions {
    let all = AgreementOptions {
        output: context.folder.join("scenes"),
        results: Some(context.folder.join("agreement")),
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

/// What follows from a Python without Mitsuba: an error where somebody named that Python.
fn without_mitsuba(cause: Error, is_named: bool) -> Result<Vec<Table>> {
    if is_named {
        return Err(cause);
    }
    Ok(vec![not_measured(&cause.to_string())])
}

fn not_measured(cause: &str) -> Table {
    let mut table = Table::new("Agreement with Mitsuba 3", &["result"]);
    table.row([format!("not measured: {cause}").into()]);
    table.note(INSTALL);
    table
}

fn tables(report: &AgreementReport) -> Vec<Table> {
    let options = &report.options;
    let mut agreement = Table::new(
        "Agreement within noise",
        &[
            "scene",
            "what it tests",
            "verdict",
            "values accepted (%)",
            "worst z",
            "blocks accepted (%)",
            "bias (%)",
            "bias z",
        ],
    );
    for scene in &report.scenes {
        agreement.row([
            scene.name.as_str().into(),
            scene.shows.as_str().into(),
            scene.verdict().into(),
            (scene.values.accepted_fraction * 100.0).into(),
            finite(scene.values.worst_z),
            (scene.blocks.accepted_fraction * 100.0).into(),
            finite(scene.relative_bias * 100.0),
            finite(scene.values.bias_z),
        ]);
    }
    agreement.note(format!(
        "{0} × {0} pixels, {1} samples a pixel on both sides, {2}. Every value is tested at a significance of {3} for the whole picture; \
         with {4} % of them accepted a scene agrees. A rejected 8 × 8 block or |bias z| above {BIAS_Z_MAX} calls for another look: chance \
         does either about once in 100 scenes.",
        options.size,
        options.passes * options.samples_per_pass,
        report.machine.mitsuba,
        SIGNIFICANCE,
        ACCEPTED_FRACTION * 100.0,
    ));
    for line in report.uncompared_lines() {
        agreement.note(line);
    }

    let mut times = Table::new(
        "Time to equal error",
        &[
            "scene",
            "our sampler",
            "relative MSE to reach",
            "our seconds",
            "Mitsuba's best",
            "its seconds",
            "ratio",
            "standard error of the ratio",
            "ratio of processor seconds",
            "ratio to its scalar variant",
        ],
    );
    for scene in &report.scenes {
        let Some(race) = &scene.race else { continue };
        let best = &race.against_best;
        let [ours, _] = race.pair(best);
        times.row([
            scene.name.as_str().into(),
            ours.sampler.as_str().into(),
            best.error.into(),
            best.our_seconds.into(),
            race.their_best().into(),
            best.their_seconds.into(),
            best.ratio.into(),
            finite(best.ratio_error),
            best.cpu_ratio.map_or("-".into(), finite),
            race.against_scalar.ratio.into(),
        ]);
    }
    if times.rows.is_empty() {
        return vec![agreement];
    }
    times.note(report.race_method());
    for line in report.race_summary() {
        times.note(line);
    }
    vec![agreement, times]
}

/// A number, or a dash for one that is not there.
fn finite(number: f64) -> Cell {
    if number.is_finite() { number.into() } else { "-".into() }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::agreement::made_up;
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
        assert!(without_mitsuba(cause(), true).is_err());
        assert_eq!(without_mitsuba(cause(), false).unwrap().len(), 1);
    }

    #[test]
    fn the_version_is_that_of_the_instructions() {
        let install = INSTALL.split('`').nth(1).unwrap();
        assert!(README.contains(install), "{install}");
    }

    #[test]
    fn a_report_becomes_sound_tables() {
        let report = made_up();
        let tables = tables(&report);
        let rows: Vec<usize> = tables.iter().map(|table| table.rows.len()).collect();
        // Two scenes, one of them with times.
        assert_eq!(rows, [2, 1]);
        assert!(tables.iter().all(|table| table.fault().is_none()));
        let text: String = tables.iter().map(Table::markdown).collect();
        for part in [
            "| raced | nothing | agrees | 100.0 |",
            "with 99.75 % of them accepted",
            "|bias z| above 4.5",
            "| raced | sobol | 0.5000 | 2.000 | llvm_ad_rgb, independent | 1.000 | 0.5000 | 0.03536 |",
            "slower in 1, undecided",
        ] {
            assert!(text.contains(part), "{part} in {text}");
        }
        let untimed = AgreementReport {
            scenes: report.scenes[1..].to_vec(),
            ..report
        };
        assert_eq!(super::tables(&untimed).len(), 1);
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
