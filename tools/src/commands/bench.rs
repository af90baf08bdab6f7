//! `clerestory bench`: paths and rays per second, medians of repeated runs with their spread.

use std::path::PathBuf;
use std::process::ExitCode;

use clap::Args;
use clerestory::gpu::Gpu;
use clerestory::render::{RenderOptions, Renderer};
use clerestory::{Result, scene};
use clerestory_tools::machine;
use clerestory_tools::page::Block;
use clerestory_tools::timing::{Spread, timed};

use super::{check_validation, index, index_peers, sort_rates};
use crate::failure::{Failure, Outcome};
use crate::options::{DeviceOptions, Size, parse_size};
use crate::output::{self, Table};
use crate::outputs::{Inputs, OutputFolder, OutputPage, Overwriting, Written};

/// Measures paths and rays per second of the path tracer: medians of repeated runs
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  clerestory bench
  clerestory bench --scene builtin:sphere-flake --scene model.glb --repeat 9 --json
  clerestory bench --sort --peers --folder out/sort --page results/sort.md
  clerestory bench --peers                       sorts, then index builds and rays per second, beside other libraries

A first run, which is not measured, compiles the kernels. Rates are by wall clock from the first step to the last; figures vary with \
the load of the machine, so compare ratios of runs made together. `clerestory report` measures errors too.")]
pub struct Arguments {
    /// A scene; may be given several times; by default the Cornell box and the materials, with --peers those of `clerestory index`
    #[arg(long = "scene", value_name = "SCENE")]
    scenes: Vec<String>,
    /// Measured runs of each scene
    #[arg(long, value_name = "N", default_value_t = 5, value_parser = clap::value_parser!(u32).range(1..=999))]
    repeat: u32,
    /// Samples per pixel
    #[arg(long, value_name = "N", default_value_t = 16, value_parser = clap::value_parser!(u32).range(1..))]
    spp: u32,
    /// Pixels: WIDTHxHEIGHT, or the height alone
    #[arg(long, default_value = "128", value_parser = parse_size)]
    size: Size,
    /// Measures keys per second of the radix sort beside the standard library's instead
    #[arg(long)]
    sort: bool,
    /// Measures the kernels beside other libraries instead: with --sort only the sort, also beside rdst and radsort; otherwise also what
    /// `clerestory index --peers` measures: index builds and rays per second
    #[arg(long)]
    peers: bool,
    /// Writes the rates of --sort and --peers as JSON, CSV and plots (SVG) to this folder too
    #[arg(long, value_name = "FOLDER")]
    folder: Option<PathBuf>,
    /// Writes the rates of --sort into a marked part of this page too; the rest of it stays
    #[arg(long, value_name = "FILE.md", requires = "sort")]
    page: Option<PathBuf>,
    /// Prints JSON
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    overwriting: Overwriting,
    #[command(flatten)]
    device: DeviceOptions,
}

/// Scenes to render when none is asked for.
const SCENES: [&str; 2] = ["builtin:cornell-box", "builtin:materials"];
/// Rays of --peers.
const PEER_RAYS: u32 = 100_000;

#[derive(Debug, serde::Serialize)]
struct Measured {
    scene: String,
    size: [u32; 2],
    spp: u32,
    repeat: u32,
    seconds: Spread,
    gpu_seconds: Spread,
    paths_per_second: Spread,
    rays_per_second: Spread,
}

/// Runs the command.
pub fn run(arguments: &Arguments) -> Outcome<ExitCode> {
    let of_kernels = arguments.sort || arguments.peers;
    if arguments.folder.is_some() && !of_kernels {
        return Err(Failure::usage("--folder needs --sort or --peers"));
    }
    let scenes = |defaults: &[&str]| match &arguments.scenes[..] {
        [] => defaults.iter().map(|scene| (*scene).to_owned()).collect(),
        given => given.to_vec(),
    };
    let places = Places::plan(arguments)?;
    let gpu = arguments.device.open()?;
    if of_kernels {
        return run_kernels(gpu, arguments, &scenes(&index::SCENES), &places);
    }
    let mut all = Vec::new();
    for address in &scenes(&SCENES) {
        let scene = scene::load(address).map_err(Failure::scene)?;
        let options = RenderOptions {
            technique: Some("path".into()),
            size: arguments.size.pixels(scene.defaults.aspect),
            spp: arguments.spp,
            ..RenderOptions::default()
        };
        let renderer = Renderer::new(&gpu, &scene)?;
        all.push(measure(&renderer, address, &options, arguments.repeat)?);
    }
    let (caps, log) = (gpu.caps().clone(), gpu.validation_log());
    drop(gpu);
    check_validation(&log)?;
    if arguments.json {
        output::print_json(&serde_json::json!({
            "device": caps.device, "driver": caps.driver, "engine_version": env!("CARGO_PKG_VERSION"), "scenes": all,
        }))?;
        return Ok(ExitCode::SUCCESS);
    }
    let mut table = Table::new(
        &[
            "scene", "pixels", "spp", "seconds", "GPU s", "paths/s", "rays/s", "spread",
        ],
        &[],
    );
    for one in &all {
        table.row([
            one.scene.clone(),
            format!("{}x{}", one.size[0], one.size[1]),
            one.spp.to_string(),
            format!("{:.3}", one.seconds.median),
            format!("{:.3}", one.gpu_seconds.median),
            output::metric(one.paths_per_second.median),
            output::metric(one.rays_per_second.median),
            format!("±{:.1} %", 100.0 * one.rays_per_second.relative()),
        ]);
    }
    let head = output::one_line(&format!(
        "{}, driver {}; medians of {} runs",
        caps.device, caps.driver, arguments.repeat
    ));
    output::print(&format!("{head}\n{}", table.text()))?;
    Ok(ExitCode::SUCCESS)
}

/// Where the rates go.
struct Places {
    sorts: Option<OutputFolder>,
    indexes: Option<OutputFolder>,
    page: Option<OutputPage>,
}

impl Places {
    /// Checks all that will be written, before anything is measured.
    fn plan(arguments: &Arguments) -> Outcome<Self> {
        let mut inputs = Inputs::default();
        for address in &arguments.scenes {
            inputs.add_address(address);
        }
        let page = OutputPage::plan(arguments.page.as_deref(), &mut inputs, arguments.overwriting)?;
        let folder = arguments.folder.as_deref();
        let plan = |names: &[&str], wanted: bool| {
            let folder = folder.filter(|_| wanted);
            folder
                .map(|folder| OutputFolder::plan(folder, names, &inputs, arguments.overwriting))
                .transpose()
        };
        Ok(Self {
            sorts: plan(&sort_rates::FILES, true)?,
            indexes: plan(&index_peers::FILES, !arguments.sort)?,
            page,
        })
    }
}

/// The part of a page that holds the rates of sorts.
const SORT_BLOCK: Block<'static> = Block {
    name: "sorted keys a second",
    command: "clerestory bench --sort --peers",
};

/// The sort beside its peers and, where not it alone is asked for, the indexes beside theirs.
fn run_kernels(gpu: Gpu, arguments: &Arguments, scenes: &[String], places: &Places) -> Outcome<ExitCode> {
    let load = || machine::load().unwrap_or_else(|| "unknown".into());
    let load_before = load();
    let rates = sort_rates::measure(&gpu, arguments.repeat, arguments.peers)?;
    let load_after = load();
    let settings = index_peers::Settings {
        scenes,
        rays: PEER_RAYS,
        repeat: arguments.repeat,
    };
    let indexes = if arguments.sort {
        None
    } else {
        Some(index_peers::measure(&gpu, &settings)?)
    };
    let (caps, log) = (gpu.caps().clone(), gpu.validation_log());
    drop(gpu);
    check_validation(&log)?;
    let document = serde_json::json!({
        "device": caps.device, "driver": caps.driver, "engine_version": env!("CARGO_PKG_VERSION"), "processor": machine::processor(),
        "threads": machine::threads(), "load_before": load_before, "load_after": load_after, "repeat": arguments.repeat, "sorts": rates,
        "indexes": indexes,
    });
    let head = output::one_line(&format!(
        "{}, driver {}; {}, {} threads; random 32-bit keys per second, medians of {} runs in turns (least … greatest), load average \
         {load_before} before and {load_after} after",
        caps.device,
        caps.driver,
        machine::processor(),
        machine::threads(),
        arguments.repeat,
    ));
    // What was measured is printed whatever becomes of the files, and written whatever becomes of the printing.
    let printed = if arguments.json {
        output::print_json(&document)
    } else {
        let of_indexes = indexes.as_ref().map_or_else(String::new, index_peers::markdown);
        output::print(&format!("{head}\n{}{of_indexes}", sort_rates::tables(&rates)))
    };
    let mut written = Vec::new();
    if let Some(page) = &places.page {
        written.push(page.write(SORT_BLOCK, &format!("{head}.\n\n{}", sort_rates::markdown(&rates))));
    }
    if let Some(folder) = &places.sorts {
        written.push(folder.write(&sort_rates::files(&rates, &document)?));
    }
    if let (Some(folder), Some(indexes)) = (&places.indexes, &indexes) {
        written.push(folder.write(&index_peers::files(indexes)?));
    }
    Written::check_all(written)?;
    printed?;
    Ok(ExitCode::SUCCESS)
}

fn measure(renderer: &Renderer, address: &str, options: &RenderOptions, repeat: u32) -> Result<Measured> {
    once(renderer, options)?;
    let runs = (0..repeat)
        .map(|seed| {
            let options = RenderOptions {
                seed,
                ..options.clone()
            };
            once(renderer, &options)
        })
        .collect::<Result<Vec<_>>>()?;
    let spread = |of: fn(&[f64; 4]) -> f64| Spread::of(runs.iter().map(of).collect());
    Ok(Measured {
        scene: address.into(),
        size: options.size,
        spp: options.spp,
        repeat,
        seconds: spread(|run| run[0]),
        gpu_seconds: spread(|run| run[1]),
        paths_per_second: spread(|run| run[2] / run[0]),
        rays_per_second: spread(|run| run[3] / run[0]),
    })
}

/// Seconds, GPU seconds, paths and rays of one run.
fn once(renderer: &Renderer, options: &RenderOptions) -> Result<[f64; 4]> {
    let mut rendering = renderer.start(options)?;
    let (rendered, seconds) = timed(|| -> Result<()> {
        while rendering.step()?.is_some() {}
        Ok(())
    });
    rendered?;
    let report = rendering.finish()?.report;
    let count = |name: &str| report.counters.get(name).map_or(0.0, |count| *count as f64);
    Ok([seconds, report.gpu_seconds, count("paths"), count("rays")])
}
