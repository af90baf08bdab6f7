//! A mirror in a room by distance impostors: pictures side by side, from the classical environment map to the search in distances, and the path tracer's.
//!
//! `mirror_room [FILE] [--scene SCENE] [--size WxH] [--spp N] [--map TEXELS] [--steps N]`
//!
//! From left to right: the map looked up in the direction of the reflected ray, as if all were infinitely far; with one step by distances; by the hybrid search
//! of `--steps` steps; and by rays. All have the same light paths: direct light, and direct light in a mirror. What each differs from the last one by is printed.
//!
//! Source: L. Szirmay-Kalos, B. Aszódi, I. Lazányi, M. Premecz, "Approximate Ray-Tracing on the GPU with Distance Impostors", CGF 24(3), 2005.

use std::path::Path;
use std::process::ExitCode;

use clerestory::Result;
use clerestory::film::tone::{ToneCurve, ToneMap};
use clerestory::film::{Picture, png};
use clerestory::gpu::{Gpu, GpuOptions};
use clerestory::render::{RenderOptions, Renderer};
use clerestory::scene;
use clerestory::techniques;
use clerestory_samples::arguments::Arguments;
use serde_json::{Value, json};

const SCENE: &str = "builtin:divider-room?object=mirror";
/// Pixels of each picture, unless told otherwise.
const SIZE: [u32; 2] = [240, 240];
const SAMPLES: u32 = 64;
const STEPS: u32 = 8;
const TEXELS: u32 = 256;
/// Stops, for the default scene.
const EXPOSURE: f64 = 1.0;
/// Pictures side by side.
const PICTURES: u32 = 4;

fn main() -> ExitCode {
    clerestory_samples::run_with(
        "mirror_room",
        &["--scene", "--size", "--spp", "--map", "--steps"],
        sample,
    )
}

fn sample(path: &Path, arguments: &Arguments) -> Result<()> {
    let gpu = Gpu::headless(&GpuOptions::default())?;
    let renderer = Renderer::new(&gpu, &scene::load(arguments.text("--scene").unwrap_or(SCENE))?)?;
    let size = arguments.size("--size")?.unwrap_or(SIZE);
    let spp = arguments.value("--spp")?.unwrap_or(SAMPLES);
    let steps: u32 = arguments.value("--steps")?.unwrap_or(STEPS);
    let texels: u32 = arguments.value("--map")?.unwrap_or(TEXELS);
    let paths = techniques::by_id("impostor")?.path_set.to_string();
    let by = |method: &str| json!({ "method": method, "steps": steps, "side": texels });
    let columns: [(&str, &str, Value); PICTURES as usize] = [
        ("the map alone", "impostor", by("classical")),
        ("one step", "impostor", by("one_step")),
        ("the search", "impostor", by("hybrid")),
        ("rays", "path", json!({ "path_set": paths })),
    ];
    let mut pictures = Vec::new();
    for (name, technique, settings) in columns {
        let rendered = renderer.render(&RenderOptions {
            technique: Some(technique.into()),
            size,
            spp,
            settings: settings.into(),
            ..RenderOptions::default()
        })?;
        pictures.push((name, rendered.picture.main_layer()?.values().to_vec()));
    }
    if let Some(((_, rays), others)) = pictures.split_last() {
        for (name, values) in others {
            println!(
                "{name}: differs from rays by {:.1} % of their mean",
                100.0 * difference(values, rays)
            );
        }
    }
    let [width, height] = size;
    let mut strip = Vec::new();
    let row = 3 * width as usize;
    for y in 0..height as usize {
        for (_, values) in &pictures {
            strip.extend_from_slice(&values[y * row..(y + 1) * row]);
        }
    }
    let strip = Picture::from_radiance(PICTURES * width, height, strip)?;
    let tone = ToneMap {
        exposure: EXPOSURE,
        curve: ToneCurve::PbrNeutral,
    };
    clerestory_samples::make_folder(path)?;
    png::write(path, &png::tone_mapped(strip.main_layer()?, strip.width(), &tone))?;
    clerestory_samples::check_messages(&gpu.validation_log())
}

/// Mean size of the differences over the mean of what is expected.
fn difference(found: &[f32], expected: &[f32]) -> f64 {
    let sizes = found.iter().zip(expected).map(|(a, b)| f64::from((a - b).abs()));
    sizes.sum::<f64>() / expected.iter().map(|value| f64::from(*value)).sum::<f64>()
}
