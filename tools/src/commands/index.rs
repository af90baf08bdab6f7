//! `clerestory index`: ray indexes side by side, by the time they take to build, their cost and the work of rays in them.

use std::path::PathBuf;
use std::process::ExitCode;

use clap::Args;
use clerestory::accel::bvh2::{Bvh2, Bvh2Settings};
use clerestory::accel::kd::{KdSettings, KdTree};
use clerestory::accel::lbvh::{self, BuildQuality, LbvhBuilder, LbvhSettings};
use clerestory::accel::wide::{WideBvh, WideSettings};
use clerestory::accel::{BuildStages, IndexKind, Ray, RayIndex, TraversalCounters};
use clerestory::scene::Scene;
use clerestory::{Error, Result, scene};
use clerestory_tools::random::Random;
use clerestory_tools::timing::{median, timed};
use clerestory_tools::{geometry, machine};
use glam::Vec3;

use super::{check_validation, index_peers};
use crate::failure::{Failure, Outcome};
use crate::options::DeviceOptions;
use crate::output::{self, Table};
use crate::outputs::{Inputs, OutputFolder, OutputPage, Overwriting};

/// Compares ray indexes: build time, surface area cost, depth, and what rays visit
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  clerestory index
  clerestory index --scene 'builtin:sphere-flake?depth=4' --repeat 9 --json
  clerestory index --index-cache out/indexes
  clerestory index --peers --rays 262144
  clerestory index --peers --rays 262144 --repeat 9 --folder out/index --page results/index.md

Build times are medians of wall-clock time, from triangles on the host to an index where it is built; times by stage are those of the \
median build. Builds on the device include the copies to it. Steps are the nodes and triangles that a ray visits, exact counts over the same \
rays for every index; a node of a kd-tree is one plane, though, not two boxes, and one of a wide tree is eight. Half of the rays leave the camera, half leave surfaces in random directions.")]
pub struct Arguments {
    /// A scene; may be given several times
    #[arg(long = "scene", value_name = "SCENE", default_values = SCENES)]
    scenes: Vec<String>,
    /// Builds of each index
    #[arg(long, value_name = "N", default_value_t = 3, value_parser = clap::value_parser!(u32).range(1..=999))]
    repeat: u32,
    /// Rays
    #[arg(long, value_name = "N", default_value_t = 100_000, value_parser = clap::value_parser!(u32).range(2..))]
    rays: u32,
    /// Folder that keeps kd-trees: a tree over the same triangles is read from there instead of being built again, in repeats too. A file there is trusted with how long rays take, not with what they hit: what is damaged, or no such tree, is built anew
    #[arg(long, value_name = "FOLDER", conflicts_with = "peers")]
    index_cache: Option<PathBuf>,
    /// Measures builds, and rays per second of the device's kernels, beside obvhs, bvh and, where it is installed, Embree on the processor, instead
    #[arg(long)]
    peers: bool,
    /// Writes what --peers finds as JSON, CSV, Markdown and charts (SVG) into this folder too
    #[arg(long, value_name = "FOLDER", requires = "peers")]
    folder: Option<PathBuf>,
    /// Writes what --peers finds into a marked part of this page; the rest of it stays
    #[arg(long, value_name = "FILE.md", requires = "peers")]
    page: Option<PathBuf>,
    /// Prints JSON
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    overwriting: Overwriting,
    #[command(flatten)]
    device: DeviceOptions,
}

/// Scenes of a quarter of a million triangles and of fewer.
pub(super) const SCENES: [&str; 5] = [
    "builtin:conference",
    "builtin:box-city?n=25000",
    "builtin:sphere-flake?depth=3&frequency=4",
    "builtin:materials",
    "builtin:triangle-soup?n=250000&size=0.01",
];

/// One index of one scene.
#[derive(Debug, serde::Serialize)]
struct Measured {
    scene: String,
    index: String,
    triangles: u64,
    nodes: u64,
    depth: u32,
    seconds: f64,
    /// Surface area cost, and its ratio to that of the first index.
    sah_cost: f64,
    sah_ratio: f64,
    /// Nodes and triangles per ray, and the ratio to those of the first index.
    steps: f64,
    steps_ratio: f64,
    /// Milliseconds by stage.
    stages: Vec<(String, f64)>,
}

/// The kd-tree of a scene that was to be kept.
#[derive(Debug, serde::Serialize)]
struct Kept {
    scene: String,
    /// Whether it was there before the run.
    was_read: bool,
    /// Seconds of the build, or of reading.
    seconds: f64,
    /// Why it could not be kept.
    not_kept: Option<String>,
}

/// An index that could not be built.
#[derive(Debug, serde::Serialize)]
struct Skipped {
    scene: String,
    index: &'static str,
    because: String,
}

/// The index that the device builds.
const ON_DEVICE: &str = "lbvh, fast, device";

/// The index that may be kept.
const KD: &str = "kd";

/// Builds an index.
type Build = fn(&[[Vec3; 3]]) -> Result<Box<dyn RayIndex>>;

/// The indexes, the one that others are compared with first.
const INDEXES: [(&str, Build); 8] = [
    ("bvh2, binned", |t| {
        Ok(Box::new(Bvh2::build(t, &Bvh2Settings::default())?))
    }),
    ("lbvh, fast", |t| Ok(Box::new(lbvh::build(t, &fast(30))?))),
    ("lbvh, fast, 63 bits", |t| Ok(Box::new(lbvh::build(t, &fast(63))?))),
    ("lbvh, high", |t| {
        Ok(Box::new(lbvh::build(t, &LbvhSettings::default())?))
    }),
    ("lbvh, high, 3 reinsertions", |t| {
        Ok(Box::new(lbvh::build(t, &reinserted(3))?))
    }),
    (KD, |t| Ok(Box::new(KdTree::build(t, &KdSettings::default())?))),
    ("wide", |t| Ok(Box::new(WideBvh::build(t, &WideSettings::default())?))),
    // What the level above costs where there is nothing to share.
    ("two-level, one instance", |t| {
        IndexKind::TwoLevel(WideSettings::default()).build(t)
    }),
];

fn fast(code_bits: u32) -> LbvhSettings {
    LbvhSettings {
        code_bits,
        quality: BuildQuality::Fast,
        ..LbvhSettings::default()
    }
}

fn reinserted(reinsertions: u32) -> LbvhSettings {
    LbvhSettings {
        reinsertions,
        ..LbvhSettings::default()
    }
}

/// Runs the command.
pub fn run(arguments: &Arguments) -> Outcome<ExitCode> {
    let mut inputs = Inputs::default();
    for address in &arguments.scenes {
        inputs.add_address(address);
    }
    let page = OutputPage::plan(arguments.page.as_deref(), &mut inputs, arguments.overwriting)?;
    let folder = arguments.folder.as_deref();
    let folder = folder.map(|folder| OutputFolder::plan(folder, &index_peers::FILES, &inputs, arguments.overwriting));
    let folder = folder.transpose()?;
    let gpu = arguments.device.open()?;
    if arguments.peers {
        let settings = index_peers::Settings {
            scenes: &arguments.scenes,
            rays: arguments.rays,
            repeat: arguments.repeat,
        };
        return index_peers::run(gpu, &settings, folder.as_ref(), page.as_ref(), arguments.json);
    }
    let builder = LbvhBuilder::new(&gpu, &fast(30))?;
    let mut all: Vec<Measured> = Vec::new();
    let mut skipped: Vec<Skipped> = Vec::new();
    let mut all_kept: Vec<Kept> = Vec::new();
    for address in &arguments.scenes {
        let scene = scene::load(address).map_err(Failure::scene)?;
        let triangles = geometry::triangles(&scene);
        let rays = rays_among(&scene, &triangles, arguments.rays);
        let base = all.len();
        for (name, build) in INDEXES {
            let folder = arguments.index_cache.as_deref().filter(|_| name == KD);
            let mut measured = match folder {
                None => measure(&triangles, &rays, build, arguments.repeat)?,
                Some(folder) => {
                    let read = |t: &[[Vec3; 3]]| KdTree::kept(t, &KdSettings::default(), folder);
                    let (kept, seconds) = timed(|| read(&triangles));
                    let kept = kept?;
                    all_kept.push(Kept {
                        scene: address.clone(),
                        was_read: kept.was_read,
                        seconds,
                        not_kept: kept.not_kept.map(|error| error.to_string()),
                    });
                    measure(&triangles, &rays, |t| Ok(Box::new(read(t)?.tree)), arguments.repeat)?
                }
            };
            (measured.scene, measured.index) = (address.clone(), name.into());
            if let Some(first) = all.get(base) {
                measured.sah_ratio = measured.sah_cost / first.sah_cost;
                measured.steps_ratio = measured.steps / first.steps;
            }
            all.push(measured);
        }
        match measure_device(&builder, &triangles, &rays, arguments.repeat)? {
            Ok(mut device) => {
                (device.scene, device.index) = (address.clone(), ON_DEVICE.into());
                device.sah_ratio = device.sah_cost / all[base].sah_cost;
                device.steps_ratio = device.steps / all[base].steps;
                all.push(device);
            }
            Err(because) => skipped.push(Skipped {
                scene: address.clone(),
                index: ON_DEVICE,
                because,
            }),
        }
    }
    let (caps, log) = (gpu.caps().clone(), gpu.validation_log());
    drop((builder, gpu));
    check_validation(&log)?;
    if arguments.json {
        output::print_json(&serde_json::json!({
            "device": caps.device, "driver": caps.driver, "engine_version": env!("CARGO_PKG_VERSION"),
            "processor": machine::processor(), "threads": machine::threads(), "load": machine::load(), "indexes": all,
            "skipped": skipped, "kept": all_kept,
        }))?;
        return Ok(ExitCode::SUCCESS);
    }
    let head = [
        "scene",
        "index",
        "triangles",
        "depth",
        "ms",
        "SAH cost",
        "SAH ratio",
        "steps/ray",
        "steps ratio",
    ];
    let mut table = Table::new(&head, &[1]);
    for one in &all {
        table.row([
            one.scene.clone(),
            one.index.clone(),
            one.triangles.to_string(),
            one.depth.to_string(),
            format!("{:.1}", 1e3 * one.seconds),
            format!("{:.2}", one.sah_cost),
            format!("{:.3}", one.sah_ratio),
            format!("{:.2}", one.steps),
            format!("{:.3}", one.steps_ratio),
        ]);
    }
    let mut text = table.text();
    for one in &all {
        let stages: Vec<String> = one
            .stages
            .iter()
            .map(|(name, ms)| format!("{name} {ms:.2} ms"))
            .collect();
        text += &format!("\n{}, {}: {}", one.scene, one.index, stages.join(", "));
    }
    for one in &all_kept {
        let ms = 1e3 * one.seconds;
        let how = match (&one.not_kept, one.was_read) {
            (Some(cause), _) => format!("built in {ms:.1} ms, not kept: {cause}"),
            (None, true) => format!("read in {ms:.1} ms, not built; repeats were read too"),
            (None, false) => format!("built in {ms:.1} ms and kept; repeats were read"),
        };
        text += &format!("\n{}, {KD}: {how}", one.scene);
    }
    for one in &skipped {
        text += &format!("\n{}, {}: skipped, {}", one.scene, one.index, one.because);
    }
    output::print(&(text + "\n"))?;
    Ok(ExitCode::SUCCESS)
}

fn measure(
    triangles: &[[Vec3; 3]],
    rays: &[Ray],
    build: impl Fn(&[[Vec3; 3]]) -> Result<Box<dyn RayIndex>>,
    repeat: u32,
) -> Result<Measured> {
    let mut index = build(triangles)?;
    let mut builds = Vec::new();
    for _ in 0..repeat {
        let (built, seconds) = timed(|| build(triangles));
        index = built?;
        builds.push((seconds, used(&index.stages())));
    }
    Ok(measured(index.as_ref(), rays, builds))
}

/// Of the build on the device that leaves the index there; what rays visit is counted in one that is read back. Or why the device cannot
/// build it.
fn measure_device(
    builder: &LbvhBuilder,
    triangles: &[[Vec3; 3]],
    rays: &[Ray],
    repeat: u32,
) -> Result<std::result::Result<Measured, String>> {
    let built = match builder.build(triangles) {
        Ok(built) => built,
        Err(error @ Error::LimitExceeded { .. }) => return Ok(Err(error.to_string())),
        Err(error) => return Err(error),
    };
    if built.buffers.is_none() {
        return Ok(Err("fewer than two triangles that rays can meet".into()));
    }
    let index = built.index;
    let mut builds = Vec::new();
    for _ in 0..repeat {
        let (resident, seconds) = timed(|| builder.build_resident(triangles));
        let stages = resident?.map(|resident| resident.stages).unwrap_or_default();
        builds.push((seconds, used(&stages)));
    }
    Ok(Ok(measured(&index, rays, builds)))
}

/// The stages that a build has, with their milliseconds.
fn used(stages: &BuildStages) -> Vec<(String, f64)> {
    let stages = stages.named().into_iter().filter(|(_, ms)| *ms > 0.0);
    stages.map(|(name, ms)| (name.to_owned(), ms)).collect()
}

/// Seconds of a build and its milliseconds by stage.
type BuildTime = (f64, Vec<(String, f64)>);

fn measured(index: &dyn RayIndex, rays: &[Ray], mut builds: Vec<BuildTime>) -> Measured {
    builds.sort_by(|a, b| a.0.total_cmp(&b.0));
    let seconds = median(builds.iter().map(|(seconds, _)| *seconds).collect());
    let middle = builds.len() / 2;
    let stages = builds
        .into_iter()
        .nth(middle)
        .map(|(_, stages)| stages)
        .unwrap_or_default();
    let mut counters = TraversalCounters::default();
    for ray in rays {
        index.closest_hit_filtered(ray, &mut |_, _| true, &mut counters);
    }
    let statistics = index.statistics();
    Measured {
        scene: String::new(),
        index: String::new(),
        triangles: statistics.triangles,
        nodes: statistics.nodes,
        depth: statistics.max_depth,
        seconds,
        sah_cost: statistics.sah_cost,
        sah_ratio: 1.0,
        steps: (counters.nodes + counters.triangles) as f64 / rays.len() as f64,
        steps_ratio: 1.0,
        stages,
    }
}

/// By turns rays from the first camera to the centres of random triangles and from such centres in random directions; without a camera
/// all are of the second kind.
fn rays_among(scene: &Scene, triangles: &[[Vec3; 3]], count: u32) -> Vec<Ray> {
    let mut random = Random::new(1);
    let eye = scene
        .cameras
        .first()
        .map(|camera| camera.transform.translation.as_vec3());
    (0..count)
        .map(|i| {
            let direction = random.direction().as_vec3();
            let centre = |place: f64| {
                let chosen = (place * triangles.len() as f64) as usize;
                triangles
                    .get(chosen.min(triangles.len().saturating_sub(1)))
                    .map_or(Vec3::ZERO, |t| (t[0] + t[1] + t[2]) / 3.0)
            };
            let target = centre(random.unit());
            let (origin, direction, t_min) = match eye {
                Some(eye) if i % 2 == 0 => (eye, (target - eye).normalize_or(direction), 0.0),
                _ => (target, direction, 1e-3),
            };
            Ray {
                origin: origin.into(),
                t_min,
                direction: direction.into(),
                t_max: f32::INFINITY,
            }
        })
        .collect()
}
