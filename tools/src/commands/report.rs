//! `clerestory report`: error against time of the path tracer on several scenes, written into a page of results.
//!
//! Each row is the median of repeats with different seeds. Errors are taken against a reference of 16 times the greatest number of samples,
//! with a seed of its own, which is kept in a folder between runs; its own noise adds at most a sixteenth to a row's MSE. Only the part
//! of the file between two marks is replaced, so that other measurements can stand beside it.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::Args;
use clerestory::film::exr;
use clerestory::film::metrics::{CompareOptions, compare};
use clerestory::film::picture::Picture;
use clerestory::gpu::Gpu;
use clerestory::render::{RenderOptions, Rendered, Renderer};
use clerestory::{Error, Result, scene};
use clerestory_tools::experiments;
use clerestory_tools::experiments::measures::{self, Context};
use clerestory_tools::machine::{self, median};
use clerestory_tools::page::Block;

use super::check_validation;
use crate::failure::{Failure, Outcome};
use crate::options::DeviceOptions;
use crate::output;

/// Measures error against time on several scenes, and writes the tables into RESULTS.md
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  clerestory report --smoke                        the smallest form, under two minutes on two cores
  clerestory report                                128 × 128 pixels, 4 to 64 samples a pixel
  clerestory report --scene model.glb --repeat 5 -o model.md

The part of the file between its two marks is replaced, the rest stays. References are rendered once with 16 times the samples, and \
kept; delete their folder after a change that changes pictures.")]
pub struct Arguments {
    /// Experiments by name, into a folder each; without any, error against time of the path tracer, into RESULTS.md
    #[arg(value_name = "EXPERIMENT")]
    experiments: Vec<String>,
    /// Lists the experiments
    #[arg(long, conflicts_with = "experiments")]
    list: bool,
    /// Folder of the experiments' results
    #[arg(long, value_name = "FOLDER", default_value = "out/report")]
    folder: PathBuf,
    /// The smallest form: 48 × 48 pixels, 2 to 32 samples a pixel
    #[arg(long)]
    smoke: bool,
    /// A scene; may be given several times
    #[arg(long = "scene", value_name = "SCENE", value_delimiter = ',', default_values = SCENES)]
    scenes: Vec<String>,
    /// Renderings a row, of which the median counts
    #[arg(long, value_name = "N", default_value_t = 3, value_parser = clap::value_parser!(u32).range(1..=99))]
    repeat: u32,
    /// File whose marked part is replaced; it is made if there is none
    #[arg(short, long, value_name = "FILE", default_value = "RESULTS.md")]
    output: PathBuf,
    /// Folder that keeps the references
    #[arg(long, value_name = "FOLDER", default_value = "out/references")]
    references: PathBuf,
    #[command(flatten)]
    device: DeviceOptions,
}

const SCENES: [&str; 4] = [
    "builtin:cornell-box",
    "builtin:materials",
    "builtin:passage",
    "builtin:ring",
];
const BLOCK: Block = Block {
    name: "error against time",
    command: "clerestory report",
};
/// Samples of the reference over the most samples of a row.
const REFERENCE_FACTOR: u32 = 16;
/// Far from the seeds of the rows.
const REFERENCE_SEED: u32 = 1_000_003;

/// How large the pictures are and how many samples their rows have.
struct Plan {
    size: [u32; 2],
    spp: [u32; 3],
    repeat: u32,
    smoke: bool,
}

impl Plan {
    fn reference_spp(&self) -> u32 {
        self.spp[2] * REFERENCE_FACTOR
    }
}

/// One line of the table.
struct Row {
    spp: u32,
    seconds: f64,
    gpu_seconds: f64,
    paths_per_second: f64,
    rays_per_second: f64,
    relative_mse: f64,
    bias: f64,
    flip: f64,
}

/// Runs the command.
pub fn run(arguments: &Arguments) -> Outcome<ExitCode> {
    if arguments.list {
        return list();
    }
    if !arguments.experiments.is_empty() {
        return run_experiments(arguments);
    }
    let (size, spp) = if arguments.smoke {
        ([48, 48], [2, 8, 32])
    } else {
        ([128, 128], [4, 16, 64])
    };
    let plan = Plan {
        size,
        spp,
        repeat: arguments.repeat,
        smoke: arguments.smoke,
    };
    let gpu = arguments.device.open()?;
    let mut text = head(&gpu, &plan);
    for address in &arguments.scenes {
        output::note(address);
        let scene = scene::load(address).map_err(Failure::scene)?;
        let renderer = Renderer::new(&gpu, &scene)?;
        let reference = reference(&renderer, address, &plan, &arguments.references)?;
        let rows = plan.spp.map(|spp| measure(&renderer, &reference, &plan, spp));
        let rows = rows.into_iter().collect::<Result<Vec<Row>>>()?;
        table(&mut text, address, &renderer, &rows);
    }
    let log = gpu.validation_log();
    drop(gpu);
    check_validation(&log)?;
    BLOCK.write(&arguments.output, &text)?;
    output::note(&format!("wrote {}", arguments.output.display()));
    Ok(ExitCode::SUCCESS)
}

fn list() -> Outcome<ExitCode> {
    let mut table = output::Table::new(&["experiment", "systems", "shows"], &[1, 2]);
    for name in experiments::names() {
        let experiment = experiments::find(name)?;
        table.row([experiment.name, experiment.systems.join(", "), experiment.title]);
    }
    output::print(&table.text())?;
    Ok(ExitCode::SUCCESS)
}

/// Runs experiments by name; the tables go to standard output and, with all digits, into a folder for each.
fn run_experiments(arguments: &Arguments) -> Outcome<ExitCode> {
    let found: Result<Vec<_>> = arguments
        .experiments
        .iter()
        .map(|name| experiments::find(name))
        .collect();
    let open = || Gpu::headless(&arguments.device.options());
    let context = Context {
        smoke: arguments.smoke,
        gpu: &open,
    };
    for experiment in found? {
        let measure = measures::find(&experiment.measure)?;
        output::note(&format!("{}: {}", experiment.name, experiment.title));
        let tables = (measure.run)(&context)?;
        let folder = arguments.folder.join(&experiment.name);
        std::fs::create_dir_all(&folder).map_err(|error| Error::io(&folder, error))?;
        let mut page = format!("# {}: {}\n", experiment.name, experiment.title);
        for (index, table) in tables.iter().enumerate() {
            page += &format!("\n{}", table.markdown());
            let path = folder.join(format!("{}.csv", index + 1));
            std::fs::write(&path, table.csv()).map_err(|error| Error::io(&path, error))?;
        }
        for (name, text) in [
            ("report.md", page.clone()),
            ("report.json", output::json_text("report.json", &tables)?),
        ] {
            let path = folder.join(name);
            std::fs::write(&path, text).map_err(|error| Error::io(&path, error))?;
        }
        output::print(&page)?;
        output::note(&format!("wrote {}", folder.display()));
    }
    Ok(ExitCode::SUCCESS)
}

fn render(renderer: &Renderer, plan: &Plan, spp: u32, seed: u32) -> Result<Rendered> {
    let mut rendering = renderer.start(&RenderOptions {
        technique: Some("path".into()),
        size: plan.size,
        spp,
        seed,
        ..RenderOptions::default()
    })?;
    while rendering.step()?.is_some() {}
    rendering.finish()
}

/// The reference from its folder, or rendered and put there.
fn reference(renderer: &Renderer, address: &str, plan: &Plan, folder: &Path) -> Result<Picture> {
    let name: String = address
        .chars()
        .map(|c| if c.is_ascii_alphanumeric() { c } else { '-' })
        .collect();
    let ([width, height], spp) = (plan.size, plan.reference_spp());
    let version = env!("CARGO_PKG_VERSION");
    let path = folder.join(format!("{name}-{width}x{height}-{spp}-{version}.exr"));
    if path.is_file() {
        return exr::read(&path);
    }
    std::fs::create_dir_all(folder).map_err(|error| Error::io(folder, error))?;
    let picture = render(renderer, plan, spp, REFERENCE_SEED)?.picture;
    exr::write(&path, &picture)?;
    Ok(picture)
}

fn measure(renderer: &Renderer, reference: &Picture, plan: &Plan, spp: u32) -> Result<Row> {
    // Once for nothing, so that no row pays for the driver's compilation.
    render(renderer, plan, 1, 0)?;
    let mut rows = Vec::new();
    for seed in 0..plan.repeat {
        let rendered = render(renderer, plan, spp, seed)?;
        let error = compare(&rendered.picture, reference, &CompareOptions::default())?;
        let rate = |what: &str| {
            let count = rendered.report.counters.get(what).copied().unwrap_or(0);
            count as f64 / rendered.report.render_seconds
        };
        rows.push(Row {
            spp,
            seconds: rendered.report.render_seconds,
            gpu_seconds: rendered.report.gpu_seconds,
            paths_per_second: rate("paths"),
            rays_per_second: rate("rays"),
            relative_mse: error.relative_mse,
            bias: error.relative_bias,
            flip: error.flip,
        });
    }
    let median = |value: fn(&Row) -> f64| median(rows.iter().map(value).collect());
    Ok(Row {
        spp,
        seconds: median(|row| row.seconds),
        gpu_seconds: median(|row| row.gpu_seconds),
        paths_per_second: median(|row| row.paths_per_second),
        rays_per_second: median(|row| row.rays_per_second),
        relative_mse: median(|row| row.relative_mse),
        bias: median(|row| row.bias),
        flip: median(|row| row.flip),
    })
}

fn head(gpu: &Gpu, plan: &Plan) -> String {
    let caps = gpu.caps();
    let load = machine::load().map_or(String::new(), |load| format!("; load average {load} when it began"));
    let smoke = if plan.smoke {
        "- **Smoke run** (`--smoke`): the smallest form, which shows that everything works; its pictures are too small to judge speed by.\n"
    } else {
        ""
    };
    format!(
        "{smoke}- Device: {}; driver: {}.\n- Machine: {}, {} threads{load}.\n- Clerestory {}, technique `path` with its default settings, {} × {} \
         pixels; each row is the median of {} renderings with different seeds.\n- References: {} samples a pixel, a seed of their own.\n\
         - Seconds: wall clock of the rendering after one picture that warms the driver's cache; GPU: by its timestamps. Paths (from \
         the camera) and rays (closest hits and shadow rays): over wall clock.\n\n",
        caps.device,
        caps.driver,
        machine::processor(),
        machine::threads(),
        env!("CARGO_PKG_VERSION"),
        plan.size[0],
        plan.size[1],
        plan.repeat,
        plan.reference_spp(),
    )
}

fn table(text: &mut String, address: &str, renderer: &Renderer, rows: &[Row]) {
    let triangles = renderer.gpu_scene().profile().triangles;
    // Writing to a string cannot fail.
    let _ = writeln!(text, "### `{address}` ({triangles} triangles)\n");
    text.push_str(
        "| samples a pixel | relative MSE | relative bias | FLIP | seconds | GPU seconds | million paths/s | million rays/s |\n",
    );
    text.push_str("|---:|---:|---:|---:|---:|---:|---:|---:|\n");
    for row in rows {
        let _ = writeln!(
            text,
            "| {} | {:.3e} | {:+.1e} | {:.4} | {:.3} | {:.3} | {:.3} | {:.2} |",
            row.spp,
            row.relative_mse,
            row.bias,
            row.flip,
            row.seconds,
            row.gpu_seconds,
            row.paths_per_second * 1e-6,
            row.rays_per_second * 1e-6
        );
    }
    if let [first, .., last] = rows {
        let slope = (last.relative_mse / first.relative_mse).ln() / (f64::from(last.spp) / f64::from(first.spp)).ln();
        let _ = writeln!(
            text,
            "\nRelative MSE falls as samples^({slope:.2}) from the first row to the last; independent samples give −1.\n"
        );
    }
}
