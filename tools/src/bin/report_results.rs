//! Measures error against time of the path tracer on generated scenes and writes the table into a Markdown file.
//!
//! Each row is the median of repeats with different seeds. Errors are taken against a reference of 16 times the greatest number of samples,
//! with a seed of its own, which is kept in a folder between runs; its own noise adds at most a sixteenth to a row's MSE. Only the part
//! of the file between two marks is replaced, so that other measurements can stand beside it.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::Parser;
use clerestory::film::exr;
use clerestory::film::metrics::{CompareOptions, compare};
use clerestory::film::picture::Picture;
use clerestory::gpu::{DeviceSelection, Gpu, GpuOptions};
use clerestory::render::{RenderOptions, Renderer};
use clerestory::{Error, Result, scene};

/// Measures error against time and writes the table.
#[derive(Debug, Parser)]
#[command(name = "tools/report")]
struct Arguments {
    /// The smallest form: 48 × 48 pixels, 2 to 32 samples a pixel; under two minutes on two cores.
    #[arg(long)]
    smallest: bool,
    /// Scenes to measure.
    #[arg(
        long,
        value_delimiter = ',',
        default_value = "builtin:cornell-box,builtin:materials,builtin:passage,builtin:ring"
    )]
    scenes: Vec<String>,
    /// Renderings a row, of which the median counts.
    #[arg(long, default_value_t = 3, value_parser = clap::value_parser!(u32).range(1..=99))]
    repeats: u32,
    /// Device: part of its name, or its index.
    #[arg(long)]
    device: Option<String>,
    /// File whose marked part is replaced; it is made if there is none.
    #[arg(short, long, default_value = "RESULTS.md")]
    output: PathBuf,
    /// Folder that keeps the references.
    #[arg(long, default_value = "out/references")]
    references: PathBuf,
}

const BEGIN: &str = "<!-- begin: error against time, written by tools/report -->";
const END: &str = "<!-- end: error against time -->";
/// Samples of the reference over the most samples of a row.
const REFERENCE_FACTOR: u32 = 16;
/// Far from the seeds of the rows.
const REFERENCE_SEED: u32 = 1_000_003;

/// One line of the table.
struct Row {
    spp: u32,
    seconds: f64,
    gpu_seconds: f64,
    rays_per_second: f64,
    relative_mse: f64,
    bias: f64,
    flip: f64,
}

fn main() -> ExitCode {
    match run(&Arguments::parse()) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("{error}");
            ExitCode::FAILURE
        }
    }
}

fn run(arguments: &Arguments) -> Result<()> {
    let selection = arguments.device.as_deref().map_or(DeviceSelection::Fastest, |text| {
        text.parse().unwrap_or_else(|never| match never {})
    });
    let gpu = Gpu::headless(&GpuOptions {
        device: selection,
        ..GpuOptions::default()
    })?;
    let (size, all_spp) = if arguments.smallest {
        ([48, 48], [2, 8, 32])
    } else {
        ([128, 128], [4, 16, 64])
    };
    let mut text = head(&gpu, size, arguments.repeats, all_spp[2] * REFERENCE_FACTOR);
    for address in &arguments.scenes {
        eprintln!("{address}");
        let renderer = Renderer::new(&gpu, &scene::load(address)?)?;
        let reference = reference(
            &renderer,
            address,
            size,
            all_spp[2] * REFERENCE_FACTOR,
            &arguments.references,
        )?;
        let mut rows = Vec::new();
        for spp in all_spp {
            rows.push(measure(&renderer, &reference, size, spp, arguments.repeats)?);
        }
        table(&mut text, address, &renderer, &rows);
    }
    write_between_marks(&arguments.output, &text)
}

fn options(size: [u32; 2], spp: u32, seed: u32) -> RenderOptions {
    RenderOptions {
        technique: Some("path".into()),
        size,
        spp,
        seed,
        ..RenderOptions::default()
    }
}

/// The reference from its folder, or rendered and put there.
fn reference(renderer: &Renderer, address: &str, size: [u32; 2], spp: u32, folder: &Path) -> Result<Picture> {
    let name: String = address
        .chars()
        .map(|c| if c.is_ascii_alphanumeric() { c } else { '-' })
        .collect();
    let version = env!("CARGO_PKG_VERSION");
    let path = folder.join(format!("{name}-{}x{}-{spp}-{version}.exr", size[0], size[1]));
    if path.is_file() {
        return exr::read(&path);
    }
    std::fs::create_dir_all(folder).map_err(|error| Error::io(folder, error))?;
    let mut rendering = renderer.start(&options(size, spp, REFERENCE_SEED))?;
    while rendering.step()?.is_some() {}
    let picture = rendering.finish()?.picture;
    exr::write(&path, &picture)?;
    Ok(picture)
}

fn measure(renderer: &Renderer, reference: &Picture, size: [u32; 2], spp: u32, repeats: u32) -> Result<Row> {
    // Once for nothing, so that no row pays for the driver's compilation.
    let mut warm = renderer.start(&options(size, 1, 0))?;
    while warm.step()?.is_some() {}
    let mut rows = Vec::new();
    for seed in 0..repeats {
        let mut rendering = renderer.start(&options(size, spp, seed))?;
        while rendering.step()?.is_some() {}
        let rendered = rendering.finish()?;
        let error = compare(&rendered.picture, reference, &CompareOptions::default())?;
        let rays = rendered.report.counters.get("rays").copied().unwrap_or(0) as f64;
        rows.push(Row {
            spp,
            seconds: rendered.report.render_seconds,
            gpu_seconds: rendered.report.gpu_seconds,
            rays_per_second: rays / rendered.report.render_seconds,
            relative_mse: error.relative_mse,
            bias: error.relative_bias,
            flip: error.flip,
        });
    }
    let median = |value: fn(&Row) -> f64| {
        let mut values: Vec<f64> = rows.iter().map(value).collect();
        values.sort_by(f64::total_cmp);
        values[values.len() / 2]
    };
    Ok(Row {
        spp,
        seconds: median(|row| row.seconds),
        gpu_seconds: median(|row| row.gpu_seconds),
        rays_per_second: median(|row| row.rays_per_second),
        relative_mse: median(|row| row.relative_mse),
        bias: median(|row| row.bias),
        flip: median(|row| row.flip),
    })
}

fn head(gpu: &Gpu, size: [u32; 2], repeats: u32, reference_spp: u32) -> String {
    let caps = gpu.caps();
    let read = |path| std::fs::read_to_string(path).unwrap_or_default();
    let cpu = read("/proc/cpuinfo")
        .lines()
        .find_map(|line| {
            line.strip_prefix("model name")
                .map(|rest| rest.trim_start_matches([' ', '\t', ':']).to_owned())
        })
        .unwrap_or_else(|| "unknown processor".into());
    let cores = std::thread::available_parallelism().map_or(0, usize::from);
    let load = read("/proc/loadavg").split(' ').next().unwrap_or("?").to_owned();
    format!(
        "- Device: {}; driver: {}.\n- Machine: {cpu}, {cores} cores; load average {load} when it began.\n- Clerestory {}, technique `path` \
         with its default settings, {} × {} pixels; each row is the median of {repeats} renderings with different seeds.\n- References: \
         {reference_spp} samples a pixel, a seed of their own.\n- Seconds: wall clock of the rendering after one picture that warms the \
         driver's cache; GPU: by its timestamps. Rays: closest hits and shadow rays, over wall clock.\n\n",
        caps.device,
        caps.driver,
        env!("CARGO_PKG_VERSION"),
        size[0],
        size[1]
    )
}

fn table(text: &mut String, address: &str, renderer: &Renderer, rows: &[Row]) {
    let triangles = renderer.gpu_scene().profile().triangles;
    // Writing to a string cannot fail.
    let _ = writeln!(text, "### `{address}` ({triangles} triangles)\n");
    text.push_str(
        "| samples a pixel | seconds | GPU seconds | million rays/s | relative MSE | relative bias | FLIP |\n",
    );
    text.push_str("|---:|---:|---:|---:|---:|---:|---:|\n");
    for row in rows {
        let _ = writeln!(
            text,
            "| {} | {:.3} | {:.3} | {:.2} | {:.3e} | {:+.1e} | {:.4} |",
            row.spp,
            row.seconds,
            row.gpu_seconds,
            row.rays_per_second * 1e-6,
            row.relative_mse,
            row.bias,
            row.flip
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

/// Replaces what stands between the marks, or appends it with its heading.
fn write_between_marks(path: &Path, text: &str) -> Result<()> {
    let old = match std::fs::read_to_string(path) {
        Ok(old) => old,
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => {
            "# Results\n\nMeasured, not promised: every table says on what machine and driver, and how to repeat it.\n"
                .to_owned()
        }
        Err(error) => return Err(Error::io(path, error)),
    };
    let marked = format!("{BEGIN}\n\n{}\n\n{END}", text.trim_end());
    let new = match (old.find(BEGIN), old.find(END)) {
        (Some(begin), Some(end)) if begin < end => format!("{}{marked}{}", &old[..begin], &old[end + END.len()..]),
        _ => format!(
            "{}\n\n## Error against time: `tools/report`\n\n{marked}\n",
            old.trim_end()
        ),
    };
    std::fs::write(path, new).map_err(|error| Error::io(path, error))
}
