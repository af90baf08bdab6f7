//! `clerestory stability`: the hard cases on every technique, ray index and scattering function.

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::Args;
use clerestory::Error;
use clerestory::film::{ToneMap, png};
use clerestory::gpu::Gpu;
use clerestory::render::{RenderOptions, render};
use clerestory::techniques;
use clerestory_hard_cases::{
    HardCase, Outcome as Judged, PICTURES, Row, Subject, Verdict, all, by_name, judge, markdown, subjects,
};

use super::check_validation;
use crate::failure::{Code, Failure, Outcome};
use crate::options::DeviceOptions;
use crate::output::{self, Table};
use crate::outputs::{Inputs, Outputs, Overwriting};

/// Runs the hard cases: extreme scales, slivers, grazing light, lights without power, media as thin as air … and says which pass
#[derive(Debug, Args)]
#[command(after_help = "\
A case passes, degrades as documented, is refused with the reason, or fails; the figure beside the verdict is the one that came \
closest to its bound. The exit code is 4 when a case fails.

Examples:
  clerestory stability
  clerestory stability scales far-from-origin
  clerestory stability --technique path
  clerestory stability --list                        what each case breaks, and the expected result
  clerestory stability --pictures docs/hard-cases    a small picture of each case; --overwrite where others lie there
  clerestory stability --markdown > docs/stability.md")]
pub struct Arguments {
    /// Only these cases
    #[arg(value_name = "CASE")]
    cases: Vec<String>,
    /// Only these techniques, by their ids
    #[arg(long, value_name = "ID", value_delimiter = ',')]
    technique: Vec<String>,
    /// Lists the cases without running them
    #[arg(long, conflicts_with_all = ["markdown", "pictures", "technique"])]
    list: bool,
    /// Prints JSON
    #[arg(long, conflicts_with = "markdown")]
    json: bool,
    /// Prints a page of Markdown
    #[arg(long)]
    markdown: bool,
    /// Writes a small picture of each case to this folder instead of running it
    #[arg(long, value_name = "FOLDER", conflicts_with_all = ["markdown", "json"])]
    pictures: Option<PathBuf>,
    #[command(flatten)]
    overwriting: Overwriting,
    #[command(flatten)]
    device: DeviceOptions,
}

/// What `--list --json` prints of a case.
#[derive(serde::Serialize)]
struct Listed {
    name: &'static str,
    breaks: &'static str,
    expects: &'static str,
    documented: Option<&'static str>,
    documented_bias: Option<&'static str>,
    subjects: Vec<String>,
}

/// Runs the command.
pub fn run(arguments: &Arguments) -> Outcome<ExitCode> {
    let cases = wanted_cases(&arguments.cases)?;
    let subjects = wanted_subjects(&arguments.technique)?;
    if arguments.list {
        list(&cases, &subjects, arguments.json)?;
        return Ok(ExitCode::SUCCESS);
    }
    let pictures = arguments
        .pictures
        .as_deref()
        .map(|folder| plan(&cases, folder, arguments.overwriting.overwrite))
        .transpose()?;
    let gpu = arguments.device.open()?;
    let log = gpu.validation_log();
    let device = format!("{} ({})", gpu.caps().device, gpu.caps().driver);
    if let Some(plans) = &pictures {
        paint(&gpu, &cases, plans)?;
        drop(gpu);
        check_validation(&log)?;
        return Ok(ExitCode::SUCCESS);
    }
    let judged: Vec<Row<'_>> = (cases.into_iter())
        .map(|case| {
            output::note(case.name);
            let outcomes = subjects.iter().map(|subject| judge(&gpu, case, subject));
            (case, outcomes.collect())
        })
        .collect();
    drop(gpu);
    check_validation(&log)?;
    let names: Vec<String> = subjects.iter().map(Subject::name).collect();
    let outcomes: Vec<&Judged> = judged.iter().flat_map(|(_, outcomes)| outcomes).flatten().collect();
    if arguments.json {
        output::print_json(&serde_json::json!({ "device": device, "subjects": names, "outcomes": outcomes }))?;
    } else if arguments.markdown {
        let pictured = |case: &HardCase| Path::new(PICTURES).join(format!("{}.png", case.name)).is_file();
        output::print(&markdown(&device, &names, &judged, pictured))?;
    } else {
        output::print(&table(&outcomes))?;
    }
    let failed = outcomes
        .iter()
        .filter(|outcome| outcome.verdict == Verdict::Fails)
        .count();
    if failed == 0 {
        return Ok(ExitCode::SUCCESS);
    }
    Err(Failure {
        code: Code::Differ,
        message: format!("{failed} of {} verdicts are failures", outcomes.len()),
        hint: None,
    })
}

fn wanted_cases(names: &[String]) -> Outcome<Vec<&'static HardCase>> {
    if names.is_empty() {
        return Ok(all().iter().collect());
    }
    let find = |name: &String| {
        by_name(name).ok_or_else(|| {
            Failure::usage(format!("no hard case is called {name:?}"))
                .hint("`clerestory stability --list` shows all of them")
        })
    };
    names.iter().map(find).collect()
}

/// All subjects, or the given techniques alone.
fn wanted_subjects(ids: &[String]) -> Outcome<Vec<Subject>> {
    for id in ids {
        techniques::by_id(id)?;
    }
    let wanted = |subject: &Subject| match subject {
        Subject::Technique { info, .. } => ids.is_empty() || ids.iter().any(|id| id == info.id),
        Subject::Index(_) | Subject::Lobes => ids.is_empty(),
    };
    Ok(subjects().into_iter().filter(wanted).collect())
}

fn list(cases: &[&'static HardCase], subjects: &[Subject], json: bool) -> Outcome {
    let listed = cases.iter().map(|case| Listed {
        name: case.name,
        breaks: case.breaks,
        expects: case.expects,
        documented: case.documented,
        documented_bias: case.documented_bias,
        subjects: (subjects.iter())
            .filter(|subject| subject.concerns(case))
            .map(Subject::name)
            .collect(),
    });
    let listed: Vec<Listed> = listed.collect();
    if json {
        return output::print_json(&listed);
    }
    let mut text = String::new();
    for case in listed {
        text += &format!(
            "{}\n  breaks   {}\n  expects  {}\n",
            output::bold(case.name),
            case.breaks,
            case.expects
        );
        if let Some(documented) = case.documented {
            text += &format!("  degrades {documented}\n");
        }
        if let Some(documented) = case.documented_bias {
            text += &format!("  degrades where pictures have a bias: {documented}\n");
        }
        text += &format!("  against  {}\n", case.subjects.join(", "));
    }
    output::print(&text)
}

/// Verdicts as rows, and below them the reasons of those that do not pass.
fn table(outcomes: &[&Judged]) -> String {
    let mut table = Table::new(
        &["case", "against", "verdict", "measured: worst for its bound"],
        &[1, 2, 3],
    );
    let mut reasons = String::new();
    for outcome in outcomes {
        table.row([
            outcome.case.to_owned(),
            outcome.subject.clone(),
            outcome.verdict.word().to_owned(),
            outcome.measured.clone(),
        ]);
        if let Some(reason) = &outcome.reason {
            reasons += &format!("{}, {}: {}\n", outcome.case, outcome.subject, output::one_line(reason));
        }
    }
    let mut text = table.text();
    if !reasons.is_empty() {
        text += &format!("\n{reasons}");
    }
    text
}

/// Pixels along a side of the cases' pictures, and their samples.
const PICTURE: (u32, u32) = (64, 512);

/// The plans of the cases' pictures; all are checked before one is painted.
fn plan(cases: &[&HardCase], folder: &Path, overwrite: bool) -> Outcome<Vec<Outputs>> {
    let path = |case: &&HardCase| folder.join(format!("{}.png", case.name));
    let plans = cases
        .iter()
        .map(path)
        .map(|path| Outputs::one(&path, &Inputs::default(), overwrite));
    plans.collect()
}

fn paint(gpu: &Gpu, cases: &[&HardCase], plans: &[Outputs]) -> Outcome {
    for (case, plan) in cases.iter().zip(plans) {
        let options = RenderOptions {
            size: [PICTURE.0; 2],
            spp: PICTURE.1,
            ..RenderOptions::default()
        };
        let rendered = match render(gpu, &(case.picture)()?, &options) {
            Err(error @ Error::Unsupported { .. }) => {
                output::warn(&format!("{}: {error}", case.name));
                continue;
            }
            rendered => rendered?,
        };
        let layer = rendered.picture.main_layer()?;
        let tone = ToneMap {
            exposure: exposure(layer.values()),
            ..ToneMap::default()
        };
        let shown = png::tone_mapped(layer, PICTURE.0, &tone);
        let written = plan.write(&[png::to_bytes(&shown, case.name)?], || None);
        output::note(&format!("wrote {}", written.names()));
        written.check()?;
    }
    Ok(())
}

/// Stops that bring the mean of what is not black to a middle grey, whatever the power of the lights.
fn exposure(values: &[f32]) -> f64 {
    const GREY: f64 = 0.3;
    let lit = values.iter().copied().filter(|v| v.is_finite() && *v > 0.0);
    let (sum, count) = lit.fold((0.0, 0u32), |(sum, count), v| (sum + f64::from(v), count + 1));
    if count == 0 {
        0.0
    } else {
        (GREY * f64::from(count) / sum).log2()
    }
}
