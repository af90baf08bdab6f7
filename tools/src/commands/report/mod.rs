//! `clerestory report`: runs experiments by name; without names, error against time on surfaces and in media.
//!
//! What a run found goes into a folder of its own. With `--results` its rows are kept in the repository's `results/` too, from which all pages there are
//! made.

mod files;
mod places;

use std::cell::{Cell, RefCell};
use std::path::PathBuf;
use std::process::ExitCode;
use std::time::Instant;

use clap::Args;
use clerestory::gpu::Gpu;
use clerestory::{Error, Result, scene};
use clerestory_tools::experiments::kept_rows;
use clerestory_tools::experiments::measures::{self, Context};
use clerestory_tools::experiments::pages::{self, Stored};
use clerestory_tools::experiments::render_sweep;
use clerestory_tools::experiments::sweep::Sweep;
use clerestory_tools::experiments::watch::Watch;
use clerestory_tools::experiments::{self, Experiment, Kind};

use super::check_validation;
use super::progress::Bar;
use crate::failure::{Code, Failure, Outcome};
use crate::options::DeviceOptions;
use crate::output;
use crate::outputs::{Overwriting, Written};
use places::Places;

/// Runs experiments by name: error against time and work with plots, slopes and pictures, or tables of measured numbers
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  clerestory report --list                         the experiments
  clerestory report samplers                       into out/report/samplers: index.html, report.md, report.json, CSV, plots, pictures
  clerestory report convergence roulette           two of them
  clerestory report map-quality --results          its rows and its page also into results/map-quality
  clerestory report --pages                        all pages of results/ anew from the rows that are kept there
  clerestory report --all --smoke                  the smallest form of every experiment
  clerestory report kd-or-bvh --scene model.ply    a kd-tree beside bounding volumes on a model of your own
  clerestory report my-experiment.toml             an experiment of your own; the format is that of tools/experiments/
  clerestory report                                error against time on surfaces and in media
  clerestory report --smoke                        its smallest form
  clerestory report --scene model.glb --repeat 3   error against time on a model of your own

Finished pictures are kept in the experiment's folder, references in a folder of their own: an interrupted report goes on where it \
stopped, and a changed experiment renders only what is missing. Changes of scenes, settings, kernels and driver are noticed by \
themselves; after a change of the engine's Rust code that changes pictures, --fresh measures anew.")]
pub struct Arguments {
    /// Experiments by name or .toml file, into a folder each; without any, error-against-time and error-in-media
    #[arg(value_name = "EXPERIMENT")]
    experiments: Vec<String>,
    /// Lists the experiments
    #[arg(long, conflicts_with = "experiments")]
    list: bool,
    /// Runs every experiment
    #[arg(long, conflicts_with_all = ["experiments", "list"])]
    all: bool,
    /// Keeps what was found in results/ of the working folder too, and writes the pages there
    #[arg(long, conflicts_with_all = ["smoke", "scenes", "repeat", "list"])]
    results: bool,
    /// Runs nothing; writes all pages of results/ anew from what is kept there
    #[arg(long, conflicts_with_all = ["experiments", "results", "smoke", "list", "all"])]
    pages: bool,
    /// Folder of the experiments' results
    #[arg(long, value_name = "FOLDER", default_value = "out/report")]
    folder: PathBuf,
    /// The smallest form: small pictures, few samples, two repeats; into a folder NAME-smoke
    #[arg(long)]
    smoke: bool,
    /// Scenes in place of the experiment's, of sweeps and of experiments on kd-trees; may be given several times
    #[arg(long = "scene", value_name = "SCENE")]
    scenes: Vec<String>,
    /// Pictures of each budget in place of the experiment's number
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=99))]
    repeat: Option<u32>,
    /// Measures everything anew, references included
    #[arg(long)]
    fresh: bool,
    /// Folder that keeps the references
    #[arg(long, value_name = "FOLDER", default_value = "out/references")]
    references: PathBuf,
    #[command(flatten)]
    overwriting: Overwriting,
    #[command(flatten)]
    device: DeviceOptions,
}

/// What runs without names.
const DEFAULTS: [&str; 2] = ["error-against-time", "error-in-media"];

/// Runs the command.
pub fn run(arguments: &Arguments) -> Outcome<ExitCode> {
    if arguments.list {
        return list();
    }
    if arguments.pages {
        places::write_all(arguments.overwriting)?;
        return Ok(ExitCode::SUCCESS);
    }
    let found = wanted(arguments)?;
    for experiment in &found {
        refuse_scenes(arguments, experiment)?;
        if arguments.results && !experiments::names().any(|name| name == experiment.name) {
            let cause = "is not one of this repository's experiments: leave out --results";
            return Err(Error::setting("experiment", &experiment.name, cause).into());
        }
    }
    let all_places = places::plan(arguments, &found)?;
    let bar = Bar::start()?;
    // Opened for the first experiment that needs it, and kept: kernels compile once.
    let mut gpu = None;
    for (experiment, places) in found.iter().zip(&all_places) {
        let about = format!("{}: {}", experiment.name, experiment.title);
        let interrupted = match experiment.kind()? {
            Kind::Measure(name) => {
                output::note(&about);
                measure(arguments, experiment, name, places, &bar)?
            }
            Kind::Sweep(sweep) => {
                let gpu = match &mut gpu {
                    Some(gpu) => gpu,
                    None => gpu.insert(arguments.device.open()?),
                };
                output::note(&about);
                render(arguments, experiment, &chosen(arguments, sweep), places, gpu, &bar)?
            }
        };
        if interrupted {
            output::note(
                "interrupted; the same command goes on where a sweep or one of the longest measures stopped, and takes other measures anew",
            );
            return Ok(Code::Interrupted.into());
        }
    }
    if let Some(gpu) = gpu {
        let log = gpu.validation_log();
        drop(gpu);
        check_validation(&log)?;
    }
    Ok(ExitCode::SUCCESS)
}

/// The experiments to run. Scenes of the command line's stand in for those of one experiment.
fn wanted(arguments: &Arguments) -> Result<Vec<Experiment>> {
    if arguments.all {
        return experiments::names().map(experiments::find).collect();
    }
    if arguments.experiments.is_empty() {
        let count = if arguments.scenes.is_empty() { DEFAULTS.len() } else { 1 };
        return DEFAULTS[..count].iter().map(|name| experiments::find(name)).collect();
    }
    arguments
        .experiments
        .iter()
        .map(|name| experiments::find(name))
        .collect()
}

/// Scenes for a measure that has its own.
fn refuse_scenes(arguments: &Arguments, experiment: &Experiment) -> Result<()> {
    if let Kind::Measure(name) = experiment.kind()?
        && !arguments.scenes.is_empty()
        && !measures::find(name)?.takes_scenes
    {
        let cause = "has scenes of its own, or none: leave out --scene";
        return Err(Error::setting("experiment", &experiment.name, cause));
    }
    Ok(())
}

fn list() -> Outcome<ExitCode> {
    let mut text = String::new();
    for name in experiments::names() {
        let experiment = experiments::find(name)?;
        let aliases = match experiment.aliases.as_slice() {
            [] => String::new(),
            aliases => format!(", also {}", aliases.join(", ")),
        };
        text += &format!(
            "{}{} ({})\n  {}\n  {}\n",
            output::bold(&experiment.name),
            aliases,
            experiment.systems.join(", "),
            experiment.title,
            experiment.about_in_short()
        );
    }
    output::print(&text)?;
    Ok(ExitCode::SUCCESS)
}

/// The folder of an experiment's results.
fn folder(arguments: &Arguments, experiment: &Experiment) -> PathBuf {
    let form = if arguments.smoke { "-smoke" } else { "" };
    arguments.folder.join(format!("{}{form}", experiment.name))
}

/// Verdicts and tables go to standard output and, with all digits, into the folder. Says whether it was interrupted.
fn measure(arguments: &Arguments, experiment: &Experiment, name: &str, places: &Places, bar: &Bar) -> Outcome<bool> {
    let device = RefCell::new(String::new());
    let open = || {
        let gpu = Gpu::headless(&arguments.device.options())?;
        *device.borrow_mut() = format!("{}, driver {}", gpu.caps().device, gpu.caps().driver);
        Ok(gpu)
    };
    let (begun, clock) = (begun(experiment), Instant::now());
    let folder = folder(arguments, experiment);
    if arguments.fresh {
        kept_rows::forget(&folder)?;
    }
    let context = Context {
        smoke: arguments.smoke,
        scenes: &arguments.scenes,
        gpu: &open,
        folder: &folder,
        watch: bar,
    };
    let measure = measures::find(name)?;
    let rows = (measure.run)(&context);
    bar.clear();
    let rows = rows?;
    if bar.stopped() {
        // Whole tables of an earlier run are worth more than the part of this one.
        return Ok(true);
    }
    let mut findings = (measure.read)(&rows)?;
    if arguments.smoke {
        findings = findings.of_smoke_run();
    }
    let (page, files) = files::measure(experiment, &findings, &rows)?;
    // What was measured is printed whatever becomes of the files, and written whatever becomes of the printing.
    let printed = output::print(&page);
    let mut written = vec![places.folder.write(&files)];
    if let Some(results) = &places.results {
        let run = begun.end(clock.elapsed().as_secs_f64(), device.take());
        let found = serde_json::from_str(&rows).map_err(|cause| Error::setting("rows", name, cause.to_string()))?;
        written.push(results.keep(experiment, &Stored { run, found }, &folder)?);
    }
    Written::check_all(written)?;
    kept_rows::forget(&folder)?;
    printed?;
    if places.results.is_some() {
        places::write_summaries()?;
    }
    Ok(false)
}

/// How an experiment is run that begins now.
fn begun(experiment: &Experiment) -> pages::Run {
    pages::Run::begin(format!("clerestory report {} --results", experiment.name))
}

/// The sweep with the changes that the command line asks for.
fn chosen(arguments: &Arguments, sweep: &Sweep) -> Sweep {
    let mut sweep = if arguments.smoke {
        sweep.smoke_form()
    } else {
        sweep.clone()
    };
    if !arguments.scenes.is_empty() {
        sweep.scenes.clone_from(&arguments.scenes);
    }
    sweep.repeats = arguments.repeat.unwrap_or(sweep.repeats);
    sweep
}

/// Renders and writes everything; says whether it was interrupted.
fn render(
    arguments: &Arguments,
    experiment: &Experiment,
    sweep: &Sweep,
    places: &Places,
    gpu: &Gpu,
    bar: &Bar,
) -> Outcome<bool> {
    let (begun, clock) = (begun(experiment), Instant::now());
    let of_sweep = render_sweep::Places {
        folder: folder(arguments, experiment),
        references: arguments.references.clone(),
        fresh: arguments.fresh,
    };
    let unread = Cell::new(false);
    let load = |address: &str| scene::load(address).inspect_err(|_| unread.set(true));
    let results = render_sweep::run(gpu, experiment, sweep, arguments.smoke, &of_sweep, &load, bar);
    bar.clear();
    let results = results.map_err(|error| {
        if unread.get() {
            Failure::scene(error)
        } else {
            error.into()
        }
    })?;
    let (text, files) = files::sweep(experiment, &results)?;
    let printed = output::print(&text);
    let mut written = vec![places.folder.write(&files)];
    let kept = places.results.as_ref().filter(|_| !results.interrupted);
    if let Some(kept) = kept {
        let run = begun.end(
            clock.elapsed().as_secs_f64(),
            format!("{}, driver {}", results.device, results.driver),
        );
        let found = serde_json::to_value(&results)
            .map_err(|cause| Error::setting("results", &experiment.name, cause.to_string()))?;
        let stored = Stored { run, found };
        written.push(kept.keep(experiment, &stored, &of_sweep.folder)?);
    }
    Written::check_all(written)?;
    printed?;
    if kept.is_some() {
        places::write_summaries()?;
    }
    output::note(&format!(
        "{} pictures measured, {} found from earlier runs",
        results.measured, results.found
    ));
    Ok(results.interrupted)
}
