//! From a glTF file to a picture: what the file needs, what could not be carried over, how long it took.
//!
//! `render_gltf [SCENE.gltf] [--output FILE.png] [--camera NAME] [--size WxH] [--spp N]`
//!
//! Writes a PNG and, beside it, an EXR with everything that is known about the picture. Without a scene it writes a small glTF of its own
//! with a buffer and a texture, and renders that.

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clerestory::film::tone::{ToneCurve, ToneMap};
use clerestory::film::{exr, png};
use clerestory::gpu::{Gpu, GpuOptions};
use clerestory::render::{FrameReport, RenderOptions, render};
use clerestory::{Error, Result, scene};
use clerestory_samples::arguments::Arguments;
use clerestory_samples::small_gltf;

fn main() -> ExitCode {
    clerestory_samples::report(run())
}

fn run() -> Result<()> {
    let arguments = Arguments::of_process(&["--output", "--camera", "--size", "--spp"], 1)?;
    if let Some(path) = arguments.alone(0) {
        return sample(path, &arguments);
    }
    let folder = tempfile::tempdir().map_err(|error| Error::io(std::env::temp_dir(), error))?;
    let path = small_gltf::write(folder.path())?;
    sample(&path.to_string_lossy(), &arguments)
}

fn sample(path: &str, arguments: &Arguments) -> Result<()> {
    let scene = scene::load(path)?;
    let gpu = Gpu::headless(&GpuOptions::default())?;
    let rendered = render(
        &gpu,
        &scene,
        &RenderOptions {
            camera: arguments.text("--camera").map(Into::into),
            size: arguments.size("--size")?.unwrap_or([320, 240]),
            spp: arguments.value("--spp")?.unwrap_or(32),
            ..RenderOptions::default()
        },
    )?;
    print(&rendered.report);

    let output = PathBuf::from(arguments.text("--output").unwrap_or("out/render_gltf.png"));
    clerestory_samples::make_folder(&output)?;
    let tone = ToneMap {
        exposure: f64::from(scene.defaults.exposure),
        curve: ToneCurve::PbrNeutral,
    };
    let picture = &rendered.picture;
    png::write(
        &output,
        &png::tone_mapped(picture.main_layer()?, picture.width(), &tone),
    )?;
    let beside: &Path = &output.with_extension("exr");
    exr::write(beside, picture)?;
    println!("wrote {} and {}", output.display(), beside.display());
    clerestory_samples::check_messages(&gpu.validation_log())
}

fn print(report: &FrameReport) {
    println!("the scene: {}", report.profile);
    for note in &report.notes {
        println!("note: {} at {}: {}", note.feature, note.at, note.instead);
    }
    for skipped in &report.skipped {
        println!("left out: {}, as {}", skipped.what, skipped.why);
    }
    println!(
        "{} by {} on {}: {} samples per pixel of camera {:?} in {:.2} s, {:.2} s of them on the GPU",
        report.path_set,
        report.technique,
        report.device,
        report.samples[1],
        report.camera,
        report.render_seconds,
        report.gpu_seconds
    );
    for pass in &report.passes {
        match pass.gpu_ms {
            Some(milliseconds) => println!("{milliseconds:10.2} ms  {} × {}", pass.count, pass.name),
            None => println!("{} × {}", pass.count, pass.name),
        }
    }
    let rays = report.counters.get("rays").copied().unwrap_or(0);
    println!(
        "{rays} rays, {} samples that were not finite, {:.1} MB of index",
        report.non_finite_samples.total(),
        report.index.statistics.bytes as f64 * 1e-6
    );
}
