//! `clerestory agreement`: pictures of this engine and of Mitsuba 3 compared within their noise.

use std::path::PathBuf;
use std::process::ExitCode;

use clap::Args;
use clerestory::techniques::path;
use clerestory_tools::agreement::{AgreementOptions, AgreementReport, run_with};
use clerestory_tools::experiments::watch::Watch;
use clerestory_tools::mitsuba::scenes::scenes;
use clerestory_tools::page::Block;

use super::check_validation;
use super::progress::Bar;
use crate::failure::{Code, Failure, Outcome};
use crate::options::{Adaptive, DeviceOptions};
use crate::output;
use crate::outputs::{self, Inputs, OutputPage, Outputs, Overwriting, Repeated, Written};

/// Compares converged pictures with those of Mitsuba 3, within their noise, and measures both renderers' time to equal error
#[derive(Debug, Args)]
#[command(after_help = "\
It needs a Python with the package `mitsuba`: tools/mitsuba/README.md says how to install it.

Examples:
  clerestory agreement --list
  clerestory agreement --scene cornell-box --timing-rounds 0
  clerestory agreement --python ~/mitsuba/bin/python --results tools/mitsuba/results --page results/agreement.md")]
pub struct Arguments {
    /// Only these scenes
    #[arg(long = "scene", value_name = "NAME", value_delimiter = ',')]
    scenes: Vec<String>,
    /// Lists the scenes
    #[arg(long)]
    list: bool,
    /// Width and height of the compared pictures, pixels
    #[arg(long, value_name = "PIXELS", default_value_t = AgreementOptions::default().size)]
    size: u32,
    /// Independent passes of Mitsuba
    #[arg(long, value_name = "N", default_value_t = AgreementOptions::default().passes)]
    passes: u32,
    /// Samples per pixel in each pass
    #[arg(long, value_name = "N", default_value_t = AgreementOptions::default().samples_per_pass)]
    spp: u32,
    /// Seed of both renderers
    #[arg(long, value_name = "N", default_value_t = AgreementOptions::default().seed)]
    seed: u32,
    /// Rounds of timed pictures, in which both renderers take turns; with 0 nothing is timed
    #[arg(long, value_name = "N", default_value_t = AgreementOptions::default().timing_rounds)]
    timing_rounds: u32,
    /// Timed pictures per turn
    #[arg(long, value_name = "N", default_value_t = AgreementOptions::default().timing_pictures)]
    timing_pictures: u32,
    /// Samples per pixel of a timed picture, a square number
    #[arg(long, value_name = "N", default_value_t = AgreementOptions::default().timing_samples)]
    timing_spp: u32,
    /// Gives pixels of this engine's pictures samples by their noise, as `clerestory render --adaptive` does
    #[arg(long, value_enum, value_name = "ERROR", num_args = 0..=1, require_equals = true, default_missing_value = "relative")]
    adaptive: Option<Adaptive>,
    /// The Python that has Mitsuba; by default CLERESTORY_MITSUBA_PYTHON, else python3
    #[arg(long, value_name = "FILE")]
    python: Option<PathBuf>,
    /// Folder for scenes and pictures
    #[arg(short, long, value_name = "FOLDER", default_value = "out/agreement")]
    output: PathBuf,
    /// Writes the report to NAME.md and NAME.json
    #[arg(long, value_name = "NAME")]
    results: Option<PathBuf>,
    /// Keeps the scenes that the report at --results holds, if it was made on this machine with these options; without --scene only the others
    /// are compared
    #[arg(long, requires = "results")]
    keep: bool,
    /// Writes errors and times to equal error beside Mitsuba's into a marked part of this page; the rest of it stays
    #[arg(long, value_name = "FILE.md")]
    page: Option<PathBuf>,
    /// Prints the report as JSON instead of Markdown
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    overwriting: Overwriting,
    #[command(flatten)]
    device: DeviceOptions,
}

const BLOCK: Block<'static> = Block {
    name: "error and speed beside Mitsuba 3",
    command: "clerestory agreement",
};

/// Runs the command.
pub fn run(arguments: &Arguments) -> Outcome<ExitCode> {
    if arguments.list {
        let mut table = output::Table::new(&["scene", "shows"], &[1]);
        for scene in scenes()? {
            table.row([scene.name.to_string(), scene.shows.to_string()]);
        }
        output::print(&table.text())?;
        return Ok(ExitCode::SUCCESS);
    }
    if arguments.page.is_some() && arguments.timing_rounds == 0 {
        return Err(Failure::usage(
            "--page needs times, and --timing-rounds 0 measures none",
        ));
    }
    let defaults = AgreementOptions::default();
    let options = AgreementOptions {
        scenes: arguments.scenes.clone(),
        size: arguments.size,
        passes: arguments.passes,
        samples_per_pass: arguments.spp,
        seed: arguments.seed,
        timing_rounds: arguments.timing_rounds,
        timing_pictures: arguments.timing_pictures,
        timing_samples: arguments.timing_spp,
        adaptive: match arguments.adaptive {
            Some(Adaptive::Relative) => path::Adaptive::Relative,
            Some(Adaptive::Absolute) => path::Adaptive::Absolute,
            Some(Adaptive::Off) | None => path::Adaptive::Off,
        },
        python: arguments.python.clone().unwrap_or(defaults.python),
        output: arguments.output.clone(),
    };
    options.check()?;
    let mut inputs = Inputs::of(&arguments.python);
    let page = OutputPage::plan(arguments.page.as_deref(), &mut inputs, arguments.overwriting)?;
    outputs::check_folder(&arguments.output, &inputs)?;
    let mut results = match &arguments.results {
        Some(prefix) => {
            let files = ["json", "md"].map(|ending| prefix.with_extension(ending));
            let plan = Outputs::plan(&files, &inputs, arguments.overwriting.overwrite)?;
            Some(Repeated::new(plan))
        }
        None => None,
    };
    let gpu = arguments.device.open()?;
    let mut begun = AgreementReport::begin(&gpu, &options)?;
    if let Some(prefix) = arguments.results.as_ref().filter(|_| arguments.keep) {
        begun.scenes = AgreementReport::kept(prefix, &begun.machine, &options);
    }
    let bar = Bar::start()?;
    let report = run_with(&gpu, begun, &bar, &mut |report| {
        if let Some(results) = &mut results {
            results.write(&report.texts()?.map(String::into_bytes));
        }
        Ok(())
    });
    bar.clear();
    let kept = results.map_or(Ok(()), Repeated::check);
    let report = match report {
        Ok(report) => report,
        Err(error) => {
            if let Err(unkept) = kept {
                unkept.report();
            }
            return Err(error.into());
        }
    };
    let log = gpu.validation_log();
    drop(gpu);
    check_validation(&log)?;
    if bar.stopped() {
        output::note("interrupted; the reports hold what was compared before");
        kept?;
        return Ok(Code::Interrupted.into());
    }
    // What was measured is printed whatever becomes of the files, and written whatever becomes of the printing.
    let printed = if arguments.json {
        output::print_json(&report)
    } else {
        output::print(&report.to_markdown())
    };
    let written = page.map(|page| page.write(BLOCK, &report.to_results_block()));
    kept?;
    written.map_or(Ok(()), Written::check)?;
    printed?;
    if report.passes() {
        return Ok(ExitCode::SUCCESS);
    }
    let differ = report.scenes.iter().any(|scene| !scene.passes());
    Err(Failure {
        code: if differ { Code::Differ } else { Code::Run },
        message: if differ {
            "the renderers differ beyond their noise".into()
        } else {
            report.uncompared_lines().join(" ")
        },
        hint: None,
    })
}
