//! `clerestory report`: runs experiments by name; without names, error against time on surfaces and in media, into a page of results.
//!
//! Only the part of the page between two marks is replaced, so that other measurements can stand beside it.

mod files;

use std::cell::{Cell, RefCell};
use std::path::PathBuf;
use std::process::ExitCode;

use clap::Args;
use clerestory::gpu::Gpu;
use clerestory::{Error, Result, scene};
use clerestory_tools::experiments::measures::{self, Context};
use clerestory_tools::experiments::render_sweep::{self, Places};
use clerestory_tools::experiments::sweep::Sweep;
use clerestory_tools::experiments::watch::Watch;
use clerestory_tools::experiments::{self, Experiment, Kind};
use clerestory_tools::machine;
use clerestory_tools::page::Block;

use super::check_validation;
use super::progress::Bar;
use crate::failure::{Code, Failure, Outcome};
use crate::options::DeviceOptions;
use crate::output;

/// Runs experiments by name: error against time and work with plots, slopes and pictures, or tables of measured numbers
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  clerestory report --list                         the experiments
  clerestory report samplers                       into out/report/samplers: index.html, report.md, report.json, CSV, plots, pictures
  clerestory report convergence roulette           two of them
  clerestory report map-quality --page RESULTS.md  its tables also into a part of that page
  clerestory report kd-or-bvh --scene model.ply    a kd-tree beside bounding volumes on a model of your own
  clerestory report my-experiment.toml             an experiment of your own; the format is that of tools/experiments/
  clerestory report                                error against time on surfaces and in media, also into RESULTS.md
  clerestory report --smoke                        its smallest form, under two minutes on two cores
  clerestory report --scene model.glb --repeat 3 -o model.md

Finished pictures are kept in the experiment's folder, references in a folder of their own: an interrupted report goes on where it \
stopped, and a changed experiment renders only what is missing. Changes of scenes, settings, kernels and driver are noticed by \
themselves; after a change of the engine's Rust code that changes pictures, --fresh measures anew.")]
pub struct Arguments {
    /// Experiments by name or .toml file, into a folder each; without any, error-against-time and error-in-media, also into RESULTS.md
    #[arg(value_name = "EXPERIMENT")]
    experiments: Vec<String>,
    /// Lists the experiments
    #[arg(long, conflicts_with = "experiments")]
    list: bool,
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
    /// File whose marked parts are replaced when no experiment is named, made if there is none; by default RESULTS.md, with --smoke none
    #[arg(short, long, value_name = "FILE", conflicts_with = "experiments")]
    output: Option<PathBuf>,
    /// File of which a named experiment replaces its marked part, made if there is none
    #[arg(long, value_name = "FILE", requires = "experiments")]
    page: Option<PathBuf>,
    /// Folder that keeps the references
    #[arg(long, value_name = "FOLDER", default_value = "out/references")]
    references: PathBuf,
    #[command(flatten)]
    device: DeviceOptions,
}

/// The page of results.
const PAGE: &str = "RESULTS.md";
/// What runs without names, and the part of the page that it writes.
const DEFAULTS: [(&str, Block<'static>); 2] = [
    (
        "error-against-time",
        Block {
            name: "error against time",
            command: "clerestory report",
        },
    ),
    (
        "error-in-media",
        Block {
            name: "error against time in media",
            command: "clerestory report",
        },
    ),
];

/// Runs the command.
pub fn run(arguments: &Arguments) -> Outcome<ExitCode> {
    if arguments.list {
        return list();
    }
    let found = wanted(arguments)?;
    for (experiment, _) in &found {
        refuse_scenes(arguments, experiment)?;
    }
    let bar = Bar::start()?;
    // Opened for the first experiment that needs it, and kept: kernels compile once.
    let mut gpu = None;
    for (experiment, block) in found {
        let command = format!("clerestory report {}", experiment.name);
        let own = Block {
            name: experiment.part(),
            command: &command,
        };
        let part = match block {
            Some(block) => page_of_all(arguments).map(|page| (block, page)),
            None => {
                let known = DEFAULTS.iter().find(|(name, _)| *name == experiment.name);
                let block = known.map_or(own, |(_, block)| *block);
                arguments.page.clone().map(|page| (block, page))
            }
        };
        let about = format!("{}: {}", experiment.name, experiment.title);
        let interrupted = match experiment.kind()? {
            Kind::Measure(name) => {
                output::note(&about);
                measure(arguments, &experiment, name, &bar, part)?
            }
            Kind::Sweep(sweep) => {
                let gpu = match &mut gpu {
                    Some(gpu) => gpu,
                    None => gpu.insert(arguments.device.open()?),
                };
                output::note(&about);
                render(arguments, &experiment, &chosen(arguments, sweep), gpu, &bar, part)?
            }
        };
        if interrupted {
            output::note("interrupted; the same command goes on where a sweep stopped, and takes a measure anew");
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

/// The experiments to run, with the part of the page that each writes. Scenes of the command line's stand in for those of one experiment.
fn wanted(arguments: &Arguments) -> Result<Vec<(Experiment, Option<Block<'static>>)>> {
    if arguments.experiments.is_empty() {
        let count = if arguments.scenes.is_empty() { DEFAULTS.len() } else { 1 };
        let found = DEFAULTS[..count].iter();
        return found
            .map(|(name, block)| Ok((experiments::find(name)?, Some(*block))))
            .collect();
    }
    let found = arguments.experiments.iter();
    found.map(|name| Ok((experiments::find(name)?, None))).collect()
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
fn measure(
    arguments: &Arguments,
    experiment: &Experiment,
    name: &str,
    bar: &Bar,
    part: Option<(Block<'_>, PathBuf)>,
) -> Outcome<bool> {
    let device = RefCell::new("none".to_owned());
    let open = || {
        let gpu = Gpu::headless(&arguments.device.options())?;
        *device.borrow_mut() = format!("{}, driver {}", gpu.caps().device, gpu.caps().driver);
        Ok(gpu)
    };
    let load = machine::load().unwrap_or_else(|| "unknown".into());
    let folder = folder(arguments, experiment);
    let context = Context {
        smoke: arguments.smoke,
        scenes: &arguments.scenes,
        gpu: &open,
        folder: &folder,
        watch: bar,
    };
    let run = (measures::find(name)?.run)(&context);
    bar.clear();
    let mut run = run?;
    if arguments.smoke {
        run.findings = run.findings.of_smoke_run();
    }
    if bar.stopped() {
        // Whole tables of an earlier run are worth more than the part of this one.
        return Ok(true);
    }
    let page = files::measure(&folder, experiment, &run)?;
    output::print(&page)?;
    output::note(&format!("wrote {}", folder.display()));
    if let Some((block, path)) = part {
        let facts = output::one_line(&format!(
            "Machine: {}, {} threads, load average {load} when it began; Vulkan device: {}. Clerestory {}.",
            machine::processor(),
            machine::threads(),
            device.borrow(),
            env!("CARGO_PKG_VERSION"),
        ));
        block.write(
            &path,
            &format!("{facts}\n\n{}", files::for_a_page(experiment, &run.findings)),
        )?;
        output::note(&format!("wrote {}", path.display()));
    }
    Ok(false)
}

/// Where the experiments go that run without being named.
fn page_of_all(arguments: &Arguments) -> Option<PathBuf> {
    let page = arguments.output.clone();
    page.or_else(|| (!arguments.smoke).then(|| PAGE.into()))
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
    gpu: &Gpu,
    bar: &Bar,
    part: Option<(Block<'_>, PathBuf)>,
) -> Outcome<bool> {
    let places = Places {
        folder: folder(arguments, experiment),
        references: arguments.references.clone(),
        fresh: arguments.fresh,
    };
    let unread = Cell::new(false);
    let load = |address: &str| scene::load(address).inspect_err(|_| unread.set(true));
    let results = render_sweep::run(gpu, experiment, sweep, arguments.smoke, &places, &load, bar);
    bar.clear();
    let results = results.map_err(|error| {
        if unread.get() {
            Failure::scene(error)
        } else {
            error.into()
        }
    })?;
    let text = files::sweep(&places.folder, experiment, &results)?;
    match part.filter(|_| !results.interrupted) {
        Some((block, page)) => {
            block.write(&page, &text)?;
            output::note(&format!("wrote {}", page.display()));
        }
        None => output::print(&text)?,
    }
    output::note(&format!(
        "{} pictures measured, {} found from earlier runs; wrote {}",
        results.measured,
        results.found,
        places.folder.join("index.html").display()
    ));
    Ok(results.interrupted)
}
