//! `clerestory render`: a scene to a picture, with a report of how it came about and, against a reference, how wrong it is.

mod choice;
mod files;
mod progress;
mod summary;

use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::Duration;

use clap::{Args, ValueEnum};
use clerestory::Error;
use clerestory::accel::IndexKind;
use clerestory::film::picture::{ALBEDO, DEPTH, NORMAL, SAMPLES, VARIANCE};
use clerestory::film::{CompareOptions, Picture, ToneCurve, ToneMap, compare};
use clerestory::input::{InputFile, read_text};
use clerestory::plan::Goal;
use clerestory::render::{RenderOptions, Rendered, Renderer, RendererDesc};
use clerestory::scene::{self, LoadOptions, Scene};
use clerestory::settings::Settings;
use clerestory::techniques;
use clerestory::transport::PathSet;
use clerestory_tools::machine::available_memory;
use serde_json::{Map, Value};

use super::check_validation;
use super::compare::finite;
use crate::failure::{Code, Failure, Outcome};
use crate::options::{Adaptive, DeviceOptions, Size, parse_duration, parse_size};
use crate::outputs::{Inputs, Outputs, Overwriting, Written};
use crate::{frame_report, output, pictures};
use choice::ChoiceReport;
use files::{Document, ErrorAgainst, Files};
use progress::Interruptible;
use summary::Why;

/// Renders a scene to an EXR picture, a PNG to look at and a JSON report
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  clerestory render                                          the Cornell box
  clerestory render 'builtin:cornell-box?sphere=glass' --spp 256 -o out/glass.exr
  clerestory render model.glb --camera front --size 1280x720 --time-budget 30s --tone neutral
  clerestory render model.glb --error 0.02 --explain         as many samples as it takes, with the settings that suit the scene
  clerestory render model.glb --time 20s                     the best picture in that time
  clerestory render --path-set direct --aov normal,albedo,depth
  clerestory render --spp 4096 -o reference.exr
  clerestory render --spp 16 --seed 1 --reference reference.exr
  clerestory render --settings '{\"roulette_start\": 8}' --stats json | jq .steady_rates
  clerestory render --adaptive --aov samples -o out/uneven.exr     more samples where the noise is
  clerestory render --stats table                            passes, work, memory and index in full

Beside a model NAME.gltf, NAME.scene.toml may say what glTF cannot: environment map, measured metals, aperture, exposure, technique.

Ctrl-C stops after the current step and writes the picture so far, with exit code 130; a second one, or one while the index is built, stops at once and writes nothing. \
Files that are read, or that this program did not write, are refused as output before the rendering begins. An interrupted picture does not replace one with more \
samples, nor any picture one that came to its place in the meantime: it is written beside it, as NAME-2.exr. What cannot be written in the end is kept in the \
system's folder for temporary files, which the error names. \
`clerestory list` names the techniques and their settings, `clerestory scenes` the generated scenes.")]
pub struct Arguments {
    /// A scene file (gltf, glb, ply, obj, toml) or `builtin:` address
    #[arg(default_value = "builtin:cornell-box")]
    scene: String,
    /// The picture to write: NAME.exr with NAME.png and NAME.json beside it, or NAME.png with NAME.json; by default out/SCENE.exr.
    /// Missing folders are created, which the error output says
    #[arg(short, long, value_name = "FILE")]
    output: Option<PathBuf>,
    /// Technique; by default the scene's, else `path`
    #[arg(long, value_name = "ID")]
    technique: Option<String>,
    /// Samples per pixel
    #[arg(long, value_name = "N", default_value_t = 64, value_parser = clap::value_parser!(u32).range(1..))]
    spp: u32,
    /// Pixels: WIDTHxHEIGHT, or the height alone; by default the reference's size, else 512 high by the scene's aspect
    #[arg(long, value_parser = parse_size)]
    size: Option<Size>,
    /// Seed of the random numbers; the same seed gives the same picture
    #[arg(long, value_name = "N", default_value_t = 0)]
    seed: u32,
    /// Camera by name; by default the scene's first
    #[arg(long, value_name = "NAME")]
    camera: Option<String>,
    /// Chooses technique, settings and samples for this error: the root of the relative MSE as `compare` has it, 0.02 is 2 %
    ///
    /// Small pilot pictures measure the noise and bias of every technique. One whose bias exceeds the error is refused with that figure, and so is the
    /// path tracer where it misses light that others find (light of sources without area by way of mirrors and smooth glass). --explain shows
    /// all figures.
    #[arg(long, value_name = "ERROR", value_parser = positive, conflicts_with_all = ["spp", "time_budget"])]
    error: Option<f64>,
    /// Chooses technique, settings and samples for this time, pilots included (10s, 500ms, 2min); with --error, the most that it may take
    #[arg(long, value_name = "TIME", value_parser = parse_duration, conflicts_with_all = ["spp", "time_budget"])]
    time: Option<Duration>,
    /// Shows the alternatives, and why they were not chosen
    #[arg(long)]
    explain: bool,
    /// Which light paths: words or an expression from light to eye, e.g. direct, LS+DE; --help says more
    ///
    /// Words: all, none, emitted, direct, indirect, bounces=1..3, lobes=diffuse+glossy+…. Expressions: L events E, with the events D
    /// diffuse, G glossy, S specular (r or t after them for one side: Gt), V volume, . any, [DG] one of these, [^S] one of the others; (D|S) a
    /// choice; * + ? {2} {1,3} {2,} repeat what is before them; | joins paths, ! in front means all but these. Parts with commas between
    /// them are intersected. Put expressions in quotes: 'L(D|S)E', 'LD{1,3}E', '!L.*S.*E'. docs/path-sets.md shows pictures.
    #[arg(long, value_name = "SET", value_parser = parse_path_set)]
    path_set: Option<PathSet>,
    /// Sequence of random numbers; by default that of the settings, else sobol
    #[arg(long, value_enum)]
    sampler: Option<Sampler>,
    /// After a pilot, takes more samples where the noise is, as many in all; by the relative error unless `absolute` is said. The EXR layer `samples` shows them
    ///
    /// A pilot of a quarter of the samples per pixel measures the noise; the rest goes to pixels in proportion to the noise of those around them, a quarter of the mean at
    /// least. The picture stays unbiased. Below 8 samples per pixel it is the picture without.
    #[arg(long, value_enum, value_name = "ERROR", num_args = 0..=1, require_equals = true, default_missing_value = "relative")]
    adaptive: Option<Adaptive>,
    /// Ray index: bvh2 by binned SAH, lbvh along the Morton curve (shortest build, slower rays), lbvh-high optimised, lbvh-device like lbvh but built by the device, kd a kd-tree (longest build), wide eight children a node, made of lbvh-high (the fastest rays), wide-device the same made of lbvh-device by the device, two-level a wide one for each mesh under one over its instances (the least memory), driver the driver's acceleration structure by ray queries (where `clerestory info` says that it is offered), auto two-level where that needs much less memory or all else would not fit, else wide. The picture is the same with each, but for rounding with two-level
    #[arg(long, value_name = "bvh2|lbvh|lbvh-high|lbvh-device|kd|wide|wide-device|two-level|driver|auto", default_value_t, value_parser = parse_index)]
    index: IndexKind,
    /// With --index kd: folder that keeps kd-trees; a tree over the same triangles is read from there instead of being built again. A file there is trusted with how long rays take, not with the picture: what is damaged, or no such tree, is built anew
    #[arg(long, value_name = "FOLDER")]
    index_cache: Option<PathBuf>,
    /// The technique's settings as JSON, or @FILE that holds them
    #[arg(long, value_name = "JSON|@FILE")]
    settings: Option<String>,
    /// Layers of the EXR besides radiance
    #[arg(long, value_enum, value_delimiter = ',', value_name = "LAYER,…")]
    aov: Vec<Aov>,
    /// Stops after about this time with the samples taken so far: 10s, 500ms, 2min
    ///
    /// Samples under way have up to half a second more. A scene so hard that no path ends in that time gives a black picture; the report's `samples` tells.
    #[arg(long, value_name = "TIME", value_parser = parse_duration)]
    time_budget: Option<Duration>,
    /// What to print about the run to standard output
    #[arg(long, value_enum, default_value_t = Statistics::Summary)]
    stats: Statistics,
    /// A picture of the same view: prints and reports the error against it
    #[arg(long, value_name = "FILE")]
    reference: Option<PathBuf>,
    /// Exposure of the PNG in stops; by default the scene's, or none where the tone curve goes by the picture's brightness
    #[arg(long, value_name = "STOPS", allow_negative_numbers = true, value_parser = finite)]
    exposure: Option<f64>,
    /// Tone curve of the PNG
    #[arg(long, value_enum, default_value_t = Tone::Srgb)]
    tone: Tone,
    #[command(flatten)]
    overwriting: Overwriting,
    #[command(flatten)]
    device: DeviceOptions,
}

/// Tone curves.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum Tone {
    /// Clipped: what lies in [0, 1] is shown exactly.
    Srgb,
    /// Khronos PBR Neutral: highlights roll off towards white.
    Neutral,
    /// L/(1 + L) of each band.
    Bands,
    /// By the picture's own brightness, for all pixels alike; `--exposure` is added to it.
    Photographic,
    /// By the picture's own brightness, and what is around each pixel.
    PhotographicLocal,
}

impl From<Tone> for ToneCurve {
    fn from(tone: Tone) -> Self {
        match tone {
            Tone::Srgb => Self::Srgb,
            Tone::Neutral => Self::PbrNeutral,
            Tone::Bands => Self::Bands,
            Tone::Photographic => Self::Photographic,
            Tone::PhotographicLocal => Self::PhotographicLocal,
        }
    }
}

/// Sequences of random numbers.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Sampler {
    /// Owen-scrambled Sobol' points, stratified over the samples of a pixel.
    Sobol,
    /// Independent samples.
    Pcg,
}

/// Layers of the EXR.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Aov {
    /// World-space shading normal at the first hit.
    Normal,
    /// Linear base colour at the first hit.
    Albedo,
    /// Distance from the camera to the first hit, metres.
    Depth,
    /// Variance of the radiance's mean.
    Variance,
    /// Samples of each pixel.
    Samples,
}

impl Aov {
    fn layer(self) -> &'static str {
        match self {
            Self::Normal => NORMAL,
            Self::Albedo => ALBEDO,
            Self::Depth => DEPTH,
            Self::Variance => VARIANCE,
            Self::Samples => SAMPLES,
        }
    }

    /// Whether it is gathered only when asked for.
    fn extra(self) -> bool {
        matches!(self, Self::Normal | Self::Albedo | Self::Depth)
    }
}

/// What is printed at the end.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Statistics {
    /// About ten lines that matter: files, technique, seconds, rates, memory, error.
    Summary,
    /// The whole frame report as tables.
    Table,
    /// The whole frame report as JSON.
    Json,
    /// Nothing.
    None,
}

fn positive(text: &str) -> Result<f64, String> {
    match finite(text)? {
        number if number > 0.0 => Ok(number),
        _ => Err("must be above 0".into()),
    }
}

fn parse_path_set(text: &str) -> Result<PathSet, String> {
    text.parse().map_err(without_name)
}

fn parse_index(text: &str) -> Result<IndexKind, String> {
    text.parse().map_err(without_name)
}

/// The error in words, without the setting's name, which is the option's.
fn without_name(error: Error) -> String {
    match error {
        Error::Setting { value, cause, .. } => format!("{value} {cause}"),
        other => other.to_string(),
    }
}

/// Runs the command.
pub fn run(arguments: &Arguments) -> Outcome<ExitCode> {
    if arguments.index_cache.is_some() && !matches!(arguments.index, IndexKind::Kd(_)) {
        return Err(Failure::usage(
            "--index-cache keeps only kd-trees; use it with --index kd",
        ));
    }
    let loaded = scene::load_with(&arguments.scene, &LoadOptions::default()).map_err(Failure::scene)?;
    let scene = loaded.scene;
    for note in &scene.notes {
        output::warn(&format!("{} ({}): {}", note.feature, note.at, note.instead));
    }
    let reference = arguments.reference.as_deref().map(pictures::read).transpose()?;
    let options = options(arguments, &scene, reference.as_ref())?;
    let files = Files::choose(arguments.output.as_deref(), &scene.name)?;
    let outputs = Outputs::plan(
        &files.all(),
        &inputs(arguments, &loaded.files),
        arguments.overwriting.overwrite,
    )?;
    let gpu = arguments.device.open()?;
    tracing::info!(device = gpu.caps().device, driver = gpu.caps().driver, "device");
    let desc = RendererDesc {
        index: arguments.index,
        index_folder: arguments.index_cache.clone(),
    };
    let renderer = Renderer::with(&gpu, &scene, &desc)?;
    // Not before: until the index is built there is nothing that an interrupt could keep, and nothing that looks at it.
    let interruptible = Interruptible::start()?;
    let goal = Goal {
        error: arguments.error,
        time: arguments.time,
    };
    let plan = if goal.error.is_some() || goal.time.is_some() {
        Some(interruptible.plan(&renderer, &options, goal)?)
    } else {
        None
    };
    let options = match &plan {
        Some(plan) => choice::announce(plan, &options, arguments.explain)?,
        None => options,
    };
    let (rendered, interrupted) = interruptible.render(&renderer, &options)?;
    drop(renderer);
    let validation = gpu.validation_log();
    drop(gpu);
    let curve = ToneCurve::from(arguments.tone);
    let standard = if curve.adapts() {
        0.0
    } else {
        f64::from(scene.defaults.exposure)
    };
    let tone = ToneMap {
        exposure: arguments.exposure.unwrap_or(standard),
        curve,
    };
    let error = match &reference {
        Some(reference) => Some(measure(arguments, &rendered, reference, tone)?),
        None => None,
    };
    let document = Document {
        report: &rendered.report,
        interrupted,
        tone,
        choice: plan
            .as_ref()
            .map(|plan| ChoiceReport::new(plan, &rendered, error.as_ref()))
            .transpose()?,
        error,
    };
    let layers: Vec<&str> = arguments.aov.iter().map(|aov| aov.layer()).collect();
    let written = files.write(&outputs, &rendered.picture, &layers, &document)?;
    let why = match (&plan, &arguments.technique, &scene.defaults.technique) {
        (Some(plan), ..) => Why::Chosen(plan.goal),
        (None, Some(_), _) => Why::Asked,
        (None, None, Some(_)) => Why::Scene,
        (None, None, None) => Why::Default,
    };
    conclude(arguments, &document, &rendered.picture, &written, why)?;
    written.check()?;
    check_validation(&validation)?;
    Ok(if interrupted {
        Code::Interrupted.into()
    } else {
        ExitCode::SUCCESS
    })
}

/// All files that are read.
fn inputs(arguments: &Arguments, files: &[InputFile]) -> Inputs {
    let mut inputs = Inputs::of(&arguments.reference);
    inputs.add_scene(&arguments.scene, files);
    if let Some(file) = arguments.settings.as_deref().and_then(|text| text.strip_prefix('@')) {
        inputs.add(file);
    }
    inputs
}

fn options(arguments: &Arguments, scene: &Scene, reference: Option<&Picture>) -> Outcome<RenderOptions> {
    let by_aspect = |size: Size| size.pixels(scene.defaults.aspect);
    let size = match (arguments.size, reference) {
        (Some(size), _) => by_aspect(size),
        (None, Some(reference)) => [reference.width(), reference.height()],
        (None, None) => by_aspect(Size::DEFAULT),
    };
    if let Some(reference) = reference {
        reference.main_layer()?;
        let of_reference = [reference.width(), reference.height()];
        if of_reference != size {
            let message = format!(
                "the reference has {} × {} pixels, the picture would have {} × {}",
                of_reference[0], of_reference[1], size[0], size[1]
            );
            return Err(Failure::usage(message).hint("without --size the picture takes the reference's size"));
        }
    }
    check_memory(size, available_memory())?;
    Ok(RenderOptions {
        technique: arguments.technique.clone(),
        camera: arguments.camera.clone(),
        size,
        spp: arguments.spp,
        seed: arguments.seed,
        aovs: arguments.aov.iter().any(|aov| aov.extra()),
        time_budget: arguments.time_budget,
        settings: settings(arguments, scene)?,
    })
}

/// Refuses pictures that cannot fit, before the system ends the program for them. `available` is `None` where the system does not tell.
fn check_memory(size: [u32; 2], available: Option<u64>) -> Outcome {
    // Film on the device (which may be the host's own memory), and all layers of the finished picture.
    const BYTES_PER_PIXEL: u64 = 56 + 14 * 4;
    let needed = u64::from(size[0]) * u64::from(size[1]) * BYTES_PER_PIXEL;
    match available {
        Some(available) if needed > available => Err(Failure::usage(format!(
            "a picture of {} × {} pixels takes about {} of memory; {} are free",
            size[0],
            size[1],
            output::bytes(needed),
            output::bytes(available)
        ))
        .hint("render a smaller --size")),
        _ => Ok(()),
    }
}

/// The technique's settings: those given as JSON, changed by the options of their own.
fn settings(arguments: &Arguments, scene: &Scene) -> Outcome<Settings> {
    let mut settings = match arguments.settings.as_deref() {
        None => Map::new(),
        Some(text) => read_settings(text)?,
    };
    let technique = arguments.technique.as_deref().or(scene.defaults.technique.as_deref());
    let info = techniques::by_id(technique.unwrap_or("path"))?;
    let names = info.settings.names();
    if let Some(unknown) = settings.keys().find(|key| !names.contains(&key.as_str())) {
        return Err(
            Failure::usage(format!("--settings: technique {} has no {unknown:?}", info.id)).hint(
                match option_of(unknown) {
                    Some(option) => format!("use {option}"),
                    None => format!("it has: {}", names.join(", ")),
                },
            ),
        );
    }
    let path_set = arguments.path_set.map(|set| set.to_string());
    let sampler = arguments.sampler.map(|sampler| match sampler {
        Sampler::Sobol => "sobol".to_owned(),
        Sampler::Pcg => "pcg".to_owned(),
    });
    let adaptive = arguments.adaptive.map(|adaptive| match adaptive {
        Adaptive::Relative => "relative".to_owned(),
        Adaptive::Absolute => "absolute".to_owned(),
        Adaptive::Off => "off".to_owned(),
    });
    for (key, option, value) in [
        ("path_set", "--path-set", path_set),
        ("sampler", "--sampler", sampler),
        ("adaptive", "--adaptive", adaptive),
    ] {
        let Some(value) = value else { continue };
        if key == "path_set" && !info.settings.has(key) && arguments.path_set == Some(info.path_set) {
            continue;
        }
        if !info.settings.has(key) {
            return Err(Failure::usage(format!("technique {} has no {option}", info.id)));
        }
        settings.insert(key.to_owned(), Value::String(value));
    }
    let settings = Value::Object(settings);
    info.settings.check(&settings)?;
    Ok(settings.into())
}

/// The option of the command line for what is not a technique's setting.
fn option_of(name: &str) -> Option<&'static str> {
    match name {
        "seed" => Some("--seed"),
        "spp" | "samples" => Some("--spp"),
        "size" | "width" | "height" => Some("--size"),
        "camera" => Some("--camera"),
        "technique" => Some("--technique"),
        "aov" | "aovs" => Some("--aov"),
        "time_budget" => Some("--time-budget"),
        "exposure" => Some("--exposure"),
        "tone" => Some("--tone"),
        _ => None,
    }
}

/// Most bytes of a file of settings.
const MOST_SETTINGS: u64 = 1 << 20;

fn read_settings(text: &str) -> Outcome<Map<String, Value>> {
    let (text, from) = match text.strip_prefix('@') {
        Some(path) => {
            let text = read_text(Path::new(path), MOST_SETTINGS)
                .map_err(|error| Failure::usage(format!("--settings: {error}")))?;
            (text, path)
        }
        None => (text.to_owned(), "the text"),
    };
    serde_json::from_str(&text).map_err(|cause| {
        Failure::usage(format!("--settings: {from} is not a JSON object: {cause}"))
            .hint("write for example --settings '{\"roulette_start\": 8}'; `clerestory list path` explains all settings of a technique")
    })
}

/// Whether two texts stand for the same light paths.
fn same_path_set(a: &str, b: &str) -> bool {
    a == b || matches!((a.parse::<PathSet>(), b.parse::<PathSet>()), (Ok(a), Ok(b)) if a == b)
}

fn measure(arguments: &Arguments, rendered: &Rendered, reference: &Picture, tone: ToneMap) -> Outcome<ErrorAgainst> {
    if let Some(of_reference) = &reference.metadata.path_set
        && !same_path_set(of_reference, &rendered.report.path_set)
    {
        output::warn(&format!(
            "the reference holds the light paths {of_reference:?}, the picture {:?}: the error counts the difference",
            rendered.report.path_set
        ));
    }
    let options = CompareOptions {
        tone,
        ..CompareOptions::default()
    };
    Ok(ErrorAgainst {
        reference: arguments.reference.clone().unwrap_or_default(),
        metrics: compare(&rendered.picture, reference, &options)?,
    })
}

/// Says what came out.
fn conclude(arguments: &Arguments, document: &Document<'_>, picture: &Picture, written: &Written, why: Why) -> Outcome {
    match arguments.stats {
        Statistics::None => {}
        Statistics::Summary => output::print(&summary::text(document, picture, &written.names(), why))?,
        Statistics::Json => output::print_json(document)?,
        Statistics::Table => {
            let mut text = frame_report::text(document.report);
            if let Some(error) = &document.error {
                text += &format!(
                    "\n{}\n{}\n",
                    output::bold(&output::one_line(&format!(
                        "error against {}",
                        error.reference.display()
                    ))),
                    error.metrics
                );
            }
            output::print(&text)?;
        }
    }
    if let Some(choice) = &document.choice {
        output::note(&choice.text(document.report, picture));
    }
    let report = document.report;
    let said = matches!(arguments.stats, Statistics::Summary | Statistics::Table);
    if report.non_finite_samples.total() > 0 && !said {
        output::warn(&format!(
            "{} samples were NaN and {} infinite; they are left out",
            report.non_finite_samples.nan, report.non_finite_samples.infinite
        ));
    }
    if report.stopped_early {
        let [least, most] = report.samples;
        let samples = if least == most {
            format!("{most}")
        } else {
            format!("{least} to {most}")
        };
        let cause = if document.interrupted {
            "interrupted"
        } else {
            "time is up"
        };
        output::warn(&format!("{cause}: {samples} of {} samples per pixel", report.spp));
    }
    // The summary begins with them.
    if arguments.stats != Statistics::Summary {
        output::note(&format!("wrote {}", written.names()));
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    #[cfg(unix)]
    fn settings_come_from_regular_files_alone() {
        let refusal = read_settings("@/dev/zero").err().map(|failure| failure.message);
        assert!(refusal.is_some_and(|message| message.contains("not a regular file")));
    }

    #[test]
    fn pictures_that_cannot_fit_are_refused() {
        assert!(check_memory([512, 512], Some(1 << 30)).is_ok() && check_memory([65_535; 2], None).is_ok());
        let refusal = check_memory([65_535; 2], Some(1 << 30))
            .err()
            .map(|failure| failure.message);
        assert!(refusal.is_some_and(|message| message.contains("65535 × 65535") && message.contains("1.00 GiB")));
    }
}
