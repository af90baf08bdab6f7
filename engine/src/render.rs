//! Floor 7: a scene, a technique, a camera and a film, tied together.
//!
//! [`render`] is the whole way in one call; [`Renderer`] keeps a scene on the device for several pictures, and [`Rendering`] refines one
//! step by step, so that a host can show progress, stop at any time and keep what is there.

pub mod spectral;

use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::Arc;
use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

use crate::accel::{IndexKind, IndexReport};
use crate::film::PixelFormat;
use crate::film::picture::{Metadata, NonFiniteSamples, Picture};
use crate::gpu::{Buffer, Gpu, MemoryReport, PipelineInfo};
use crate::scene::{Camera, Light, Note, Scene, SceneProfile};
use crate::settings::Settings;
use crate::techniques::{self, Card, Skipped, Technique, View};
use crate::transport::{GpuScene, PathSet};
use crate::{Error, Result};

/// How long samples that are under way when the time is used up may go on: no step is begun that, taking as long as the longest before it, would end later.
const GRACE: Duration = Duration::from_millis(500);

/// What to render and how.
///
/// ```
/// use clerestory::render::RenderOptions;
/// use clerestory::techniques::PathTracerSettings;
///
/// // Settings typed in Rust; those of files come as `serde_json::Value`.
/// let options = RenderOptions {
///     technique: Some("path".into()),
///     settings: PathTracerSettings {
///         roulette_start: 8,
///         ..PathTracerSettings::default()
///     }
///     .into(),
///     ..RenderOptions::default()
/// };
/// ```
#[derive(Debug, Clone)]
pub struct RenderOptions {
    /// Technique id; `None` takes the scene's own, else `path`.
    pub technique: Option<String>,
    /// Camera by name; `None` takes the first.
    pub camera: Option<String>,
    /// Pixels across and down.
    pub size: [u32; 2],
    /// Samples per pixel to stop at.
    pub spp: u32,
    /// Seed of the random numbers.
    pub seed: u32,
    /// Also gathers albedo, normal and depth of what is seen first.
    pub aovs: bool,
    /// Stops after about this long, with what is there: after the step at hand, or up to half a second later where samples are under way; never before the first
    /// step, which compiles the kernels. A scene that is too hard may leave pixels without a sample, as the report's `samples` says.
    pub time_budget: Option<Duration>,
    /// The technique's settings: its struct, or JSON. Seed and AOVs are those above, whatever a struct says.
    pub settings: Settings,
}

impl Default for RenderOptions {
    fn default() -> Self {
        Self {
            technique: None,
            camera: None,
            size: [512, 512],
            spp: 64,
            seed: 0,
            aovs: false,
            time_budget: None,
            settings: Settings::default(),
        }
    }
}

/// A finished picture with its report.
#[derive(Debug, Clone)]
#[non_exhaustive]
pub struct Rendered {
    /// Layers `radiance`, `variance` (of the mean), `samples`, and AOVs.
    pub picture: Picture,
    /// How it came about.
    pub report: FrameReport,
}

/// GPU time of all passes of one name.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
#[non_exhaustive]
pub struct PassReport {
    /// The pass's name.
    pub name: String,
    /// How often it ran.
    pub count: u64,
    /// GPU milliseconds in all; `None` without timestamps.
    pub gpu_ms: Option<f64>,
}

/// Everything that is known about how a picture was made.
#[derive(Debug, Clone, serde::Serialize)]
#[non_exhaustive]
pub struct FrameReport {
    /// File or `builtin:` address.
    pub scene: String,
    /// Camera name.
    pub camera: String,
    /// Technique id.
    pub technique: String,
    /// Which light paths the picture contains.
    pub path_set: String,
    /// Pixels across and down.
    pub size: [u32; 2],
    /// Samples per pixel that were asked for.
    pub spp: u32,
    /// Fewest and most samples that a pixel has received.
    pub samples: [u32; 2],
    /// Samples that a pixel has received on average.
    pub mean_samples: f64,
    /// Seed.
    pub seed: u32,
    /// True when it was stopped before all samples were there.
    pub stopped_early: bool,
    /// Samples left out because they were NaN or infinite, by kind.
    pub non_finite_samples: NonFiniteSamples,
    /// Device name.
    pub device: String,
    /// Driver name and version.
    pub driver: String,
    /// Engine version.
    pub engine_version: String,
    /// When it was finished, ISO 8601 in UTC.
    pub time: String,
    /// Seconds of wall clock: upload and index of the scene.
    pub upload_seconds: f64,
    /// Wall-clock seconds since the technique was ready, with the compilation of kernels by the driver in the first step.
    pub render_seconds: f64,
    /// Wall-clock seconds after the first step that ended with samples, and has compiled the kernels.
    pub steady_seconds: f64,
    /// Work units (see the technique's counters) per second of steady time.
    pub steady_rates: BTreeMap<String, f64>,
    /// Seconds of GPU time in all passes; 0 without timestamps.
    pub gpu_seconds: f64,
    /// GPU time by pass.
    pub passes: Vec<PassReport>,
    /// Exact counts of work since the rendering was prepared, earlier cameras included.
    pub counters: BTreeMap<String, u64>,
    /// Device memory in use.
    pub memory: MemoryReport,
    /// The ray index.
    pub index: IndexReport,
    /// What the scene needs.
    pub profile: SceneProfile,
    /// What was left out, and why.
    pub skipped: Vec<Skipped>,
    /// Kernels and their specialization.
    pub pipelines: Vec<PipelineInfo>,
    /// The technique's settings.
    pub settings: serde_json::Value,
    /// What the reader of the scene could not carry over.
    pub notes: Vec<Note>,
}

/// Where a rendering stands.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[non_exhaustive]
pub struct Progress {
    /// Share of the work that is done, by samples or by the time budget, whichever is further.
    pub fraction: f64,
    /// Seconds since it began.
    pub seconds: f64,
    /// Rays traced so far, earlier cameras included; 0 where the technique counts none.
    pub rays: u64,
}

/// How a scene is kept on a device. What it says changes times, not pictures.
///
/// ```
/// use clerestory::accel::IndexKind;
/// use clerestory::render::RendererDesc;
///
/// let desc = RendererDesc {
///     index: "lbvh".parse::<IndexKind>()?,
///     ..RendererDesc::default()
/// };
/// # Ok::<(), clerestory::Error>(())
/// ```
#[derive(Debug, Clone, Default)]
pub struct RendererDesc {
    /// Kind of the ray index.
    pub index: IndexKind,
    /// Folder where a kd-tree is read from if the same was kept there before, and kept otherwise. The report says which
    /// ([`IndexReport::kept`]); failing to read or write there is not an error. Files there are trusted with how long rays take, not with the
    /// picture ([`KdTree::kept`](crate::accel::kd::KdTree::kept)).
    pub index_folder: Option<PathBuf>,
}

/// A scene on a device, ready to be rendered.
#[derive(Debug, Clone)]
pub struct Renderer {
    gpu: Gpu,
    scene: Arc<Scene>,
    gpu_scene: Arc<GpuScene>,
    upload_seconds: f64,
}

/// Renders a scene: upload, all samples, picture and report.
///
/// # Errors
/// As [`Renderer::new`], [`Renderer::start`] and [`Rendering::step`].
pub fn render(gpu: &Gpu, scene: &Scene, options: &RenderOptions) -> Result<Rendered> {
    Renderer::new(gpu, scene)?.render(options)
}

impl Renderer {
    /// Checks and uploads a scene.
    ///
    /// # Errors
    /// [`Error::Scene`], [`Error::LimitExceeded`], [`Error::OutOfMemory`].
    pub fn new(gpu: &Gpu, scene: &Scene) -> Result<Self> {
        Self::with(gpu, scene, &RendererDesc::default())
    }

    /// As [`Renderer::new`], as the description says.
    ///
    /// # Errors
    /// As [`Renderer::new`], and [`Error::Setting`] for settings of the index that are out of range.
    pub fn with(gpu: &Gpu, scene: &Scene, desc: &RendererDesc) -> Result<Self> {
        let start = Instant::now();
        let folder = desc.index_folder.as_deref();
        let gpu_scene = Arc::new(GpuScene::with_kept_index(gpu, scene, &desc.index, folder)?);
        let upload_seconds = start.elapsed().as_secs_f64();
        // Only names, cameras and the names of lights are needed from here on; the geometry lives on the device.
        let scene = Scene {
            name: scene.name.clone(),
            source: scene.source.clone(),
            cameras: scene.cameras.clone(),
            lights: scene.lights.clone(),
            defaults: scene.defaults.clone(),
            notes: scene.notes.clone(),
            ..Scene::default()
        };
        Ok(Self {
            gpu: gpu.clone(),
            scene: Arc::new(scene),
            gpu_scene,
            upload_seconds,
        })
    }

    /// The device.
    pub(crate) fn gpu(&self) -> &Gpu {
        &self.gpu
    }

    /// The scene on the device.
    pub fn gpu_scene(&self) -> &Arc<GpuScene> {
        &self.gpu_scene
    }

    /// Lights without area, as the scene has them.
    pub(crate) fn lights(&self) -> &[Light] {
        &self.scene.lights
    }

    /// All samples of a picture, and its report.
    ///
    /// # Errors
    /// As [`Renderer::start`] and [`Rendering::step`].
    pub fn render(&self, options: &RenderOptions) -> Result<Rendered> {
        let mut rendering = self.start(options)?;
        while rendering.step()?.is_some() {}
        rendering.finish()
    }

    /// Prepares a picture by one of the engine's techniques.
    ///
    /// # Errors
    /// [`Error::Setting`] for an option out of range or a camera that does not exist, [`Error::Unsupported`] when the technique cannot
    /// model the scene, [`Error::MissingFeature`], [`Error::OutOfMemory`].
    pub fn start(&self, options: &RenderOptions) -> Result<Rendering> {
        let id = options
            .technique
            .as_deref()
            .or(self.scene.defaults.technique.as_deref())
            .unwrap_or("path");
        self.start_technique(techniques::by_id(id)?, options)
    }

    /// Prepares a picture by a technique of the host's own (see [`techniques`]), whatever the options name.
    ///
    /// # Errors
    /// As [`Renderer::start`].
    pub fn start_technique(&self, card: &Card, options: &RenderOptions) -> Result<Rendering> {
        if options.spp == 0 {
            return Err(Error::setting("spp", 0, "is not at least 1"));
        }
        let camera = self.scene.require_camera(options.camera.as_deref())?;
        let view = View {
            camera,
            size: options.size,
            seed: options.seed,
            aovs: options.aovs,
        };
        let start = Instant::now();
        let technique = card.prepare(&self.gpu, Arc::clone(&self.gpu_scene), &view, &options.settings)?;
        Ok(Rendering {
            renderer: self.clone(),
            options: options.clone(),
            technique_id: card.id,
            camera: camera.name.clone(),
            technique,
            start,
            begun: None,
            done: 0,
            within_samples: false,
            first_samples: None,
            passes: BTreeMap::new(),
            longest: Duration::ZERO,
            finished: false,
        })
    }
}

/// A picture in the making.
pub struct Rendering {
    renderer: Renderer,
    options: RenderOptions,
    technique_id: &'static str,
    camera: String,
    technique: Box<dyn Technique>,
    start: Instant,
    /// When the first step ended.
    begun: Option<Instant>,
    /// Pixel samples that are there, and whether the last step has ended with others under way.
    done: u64,
    within_samples: bool,
    /// When the first step ended that had samples, and the counters then.
    first_samples: Option<(Instant, BTreeMap<&'static str, u64>)>,
    passes: BTreeMap<String, (u64, Option<u64>)>,
    /// The longest step behind the first one, which also compiles.
    longest: Duration,
    finished: bool,
}

impl Rendering {
    /// Does a bounded piece of work, whatever the scene, so that a host can stop between two steps; `None` when all samples are there or the time is used up.
    ///
    /// # Errors
    /// [`Error::DeviceLost`], [`Error::OutOfMemory`], [`Error::Overflow`].
    pub fn step(&mut self) -> Result<Option<Progress>> {
        if self.is_out_of_time() {
            return Ok(None);
        }
        let clock = Instant::now();
        let Some(step) = self.technique.step(self.options.spp)? else {
            self.finished = true;
            return Ok(None);
        };
        if self.begun.is_some() {
            self.longest = self.longest.max(clock.elapsed());
        }
        for pass in step.timings.iter().flat_map(|timings| &timings.passes) {
            let entry = self.passes.entry(pass.name.clone()).or_insert((0, Some(0)));
            entry.0 += 1;
            entry.1 = entry.1.zip(pass.nanoseconds).map(|(sum, ns)| sum + ns);
        }
        let counters = self.technique.counters();
        let rays = counters.get("rays").copied().unwrap_or(0);
        self.begun.get_or_insert_with(Instant::now);
        self.within_samples = step.done <= self.done;
        self.done = step.done;
        if self.first_samples.is_none() && step.done > 0 {
            self.first_samples = Some((Instant::now(), counters));
        }
        self.finished = step.done >= step.wanted;
        let seconds = self.start.elapsed().as_secs_f64();
        let by_work = step.done as f64 / step.wanted.max(1) as f64;
        let by_time = self
            .options
            .time_budget
            .map_or(0.0, |budget| seconds / budget.as_secs_f64().max(1e-9));
        Ok(Some(Progress {
            fraction: by_work.max(by_time).min(1.0),
            seconds,
            rays,
        }))
    }

    /// Whether the time is used up. One step is always done, and samples under way have a little more time, counted from when kernels were there.
    fn is_out_of_time(&self) -> bool {
        let (Some(budget), Some(begun)) = (self.options.time_budget, self.begun) else {
            return false;
        };
        let late = self.start.elapsed().checked_sub(budget);
        late.is_some_and(|late| !self.within_samples || late.min(begun.elapsed()) + self.longest >= GRACE)
    }

    /// Asks for another number of samples per pixel, of which 0 is taken as 1; those that are there stay.
    pub fn set_spp(&mut self, spp: u32) {
        self.options.spp = spp.max(1);
        self.finished = false;
    }

    /// Pixels across and down.
    pub fn size(&self) -> [u32; 2] {
        self.options.size
    }

    /// The light paths of the picture.
    pub fn path_set(&self) -> PathSet {
        self.technique.path_set()
    }

    /// Looks through another camera, starting again from the first sample and second.
    ///
    /// # Errors
    /// [`Error::Setting`] for a camera that cannot be used, with which nothing changes; [`Error::DeviceLost`].
    pub fn set_camera(&mut self, camera: &Camera) -> Result<()> {
        self.technique.set_camera(camera)?;
        self.camera.clone_from(&camera.name);
        (self.start, self.begun, self.finished) = (Instant::now(), None, false);
        (self.first_samples, self.done, self.within_samples) = (None, 0, false);
        self.passes.clear();
        Ok(())
    }

    /// Writes the picture as it is now to a buffer on the device; see [`Technique::display`].
    ///
    /// # Errors
    /// [`Error::Setting`] when the buffer is too small, [`Error::DeviceLost`].
    pub fn display(&mut self, target: &Buffer, exposure: f32, format: PixelFormat) -> Result<()> {
        self.technique.display(target, exposure, format)
    }

    /// The picture as it is now, without its report.
    ///
    /// # Errors
    /// [`Error::DeviceLost`], [`Error::OutOfMemory`].
    pub fn picture(&mut self) -> Result<Picture> {
        Ok(self.technique.picture()?.0)
    }

    /// The picture and its report, at any time after the first step. Pixels that have no sample yet are black.
    ///
    /// # Errors
    /// As [`Rendering::picture`].
    pub fn finish(mut self) -> Result<Rendered> {
        let end = Instant::now();
        let (mut picture, non_finite_samples) = self.technique.picture()?;
        let report = self.report(&picture, non_finite_samples, end);
        picture.metadata = Metadata {
            scene: Some(report.scene.clone()),
            technique: Some(report.technique.clone()),
            path_set: Some(report.path_set.clone()),
            settings: Some(report.settings.to_string()),
            seed: Some(u64::from(report.seed)),
            // The mean where pixels have differing numbers.
            spp: Some(match report.samples {
                [fewest, most] if fewest < most => report.mean_samples.round() as u64,
                [_, most] => most.into(),
            }),
            device: Some(report.device.clone()),
            driver: Some(report.driver.clone()),
            engine_version: Some(report.engine_version.clone()),
            time: Some(report.time.clone()),
            seconds: Some(report.render_seconds),
            other: BTreeMap::from([("camera".to_owned(), self.camera.clone())]),
        };
        Ok(Rendered { picture, report })
    }

    fn report(&self, picture: &Picture, non_finite_samples: NonFiniteSamples, end: Instant) -> FrameReport {
        let caps = self.renderer.gpu.caps();
        let counters = self.technique.counters();
        let (steady_start, before) = self.first_samples.clone().unwrap_or((end, counters.clone()));
        let steady_seconds = end.saturating_duration_since(steady_start).as_secs_f64();
        let rate = |(name, count): (&&'static str, &u64)| {
            let done = count - before.get(*name).copied().unwrap_or(0);
            (done > 0).then(|| ((*name).to_owned(), done as f64 / steady_seconds))
        };
        let samples = picture.layer("samples").map(|layer| layer.values()).unwrap_or_default();
        let least = samples.iter().copied().fold(f32::INFINITY, f32::min);
        let greatest = samples.iter().copied().fold(0.0, f32::max);
        let gpu_ns: u64 = self.passes.values().filter_map(|(_, ns)| *ns).sum();
        FrameReport {
            scene: self.renderer.scene.source.clone(),
            camera: self.camera.clone(),
            technique: self.technique_id.into(),
            path_set: self.technique.path_set().to_string(),
            size: self.options.size,
            spp: self.options.spp,
            samples: [least.min(greatest) as u32, greatest as u32],
            mean_samples: samples.iter().map(|count| f64::from(*count)).sum::<f64>() / samples.len().max(1) as f64,
            seed: self.options.seed,
            stopped_early: !self.finished,
            non_finite_samples,
            device: caps.device.clone(),
            driver: caps.driver.clone(),
            engine_version: env!("CARGO_PKG_VERSION").into(),
            time: iso_8601(SystemTime::now()),
            upload_seconds: self.renderer.upload_seconds,
            render_seconds: end.duration_since(self.start).as_secs_f64(),
            steady_seconds,
            steady_rates: if steady_seconds > 0.0 {
                counters.iter().filter_map(rate).collect()
            } else {
                BTreeMap::new()
            },
            gpu_seconds: gpu_ns as f64 * 1e-9,
            passes: self
                .passes
                .iter()
                .map(|(name, (count, ns))| PassReport {
                    name: name.clone(),
                    count: *count,
                    gpu_ms: ns.filter(|_| caps.timestamp_period > 0.0).map(|ns| ns as f64 * 1e-6),
                })
                .collect(),
            counters: counters
                .iter()
                .map(|(name, count)| ((*name).to_owned(), *count))
                .collect(),
            memory: self.renderer.gpu.memory_report(),
            index: self.renderer.gpu_scene.index_report(),
            profile: self.renderer.gpu_scene.profile().clone(),
            skipped: self.technique.skipped(),
            pipelines: self.technique.pipelines(),
            settings: self.technique.settings(),
            notes: self.renderer.scene.notes.clone(),
        }
    }
}

/// `2026-11-21T04:40:00Z`, by the civil calendar (Howard Hinnant's `civil_from_days`).
fn iso_8601(time: SystemTime) -> String {
    let seconds = time.duration_since(UNIX_EPOCH).map_or(0, |since| since.as_secs());
    let (days, second) = ((seconds / 86_400) as i64, seconds % 86_400);
    let shifted = days + 719_468;
    let era = shifted.div_euclid(146_097);
    let day_of_era = shifted.rem_euclid(146_097);
    let year_of_era = (day_of_era - day_of_era / 1_460 + day_of_era / 36_524 - day_of_era / 146_096) / 365;
    let day_of_year = day_of_era - (365 * year_of_era + year_of_era / 4 - year_of_era / 100);
    let month_from_march = (5 * day_of_year + 2) / 153;
    let day = day_of_year - (153 * month_from_march + 2) / 5 + 1;
    let month = if month_from_march < 10 {
        month_from_march + 3
    } else {
        month_from_march - 9
    };
    let year = year_of_era + era * 400 + i64::from(month <= 2);
    format!(
        "{year:04}-{month:02}-{day:02}T{:02}:{:02}:{:02}Z",
        second / 3600,
        second / 60 % 60,
        second % 60
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_are_civil() {
        let at = |seconds| iso_8601(UNIX_EPOCH + Duration::from_secs(seconds));
        assert_eq!(at(0), "1970-01-01T00:00:00Z");
        assert_eq!(at(951_782_400), "2000-02-29T00:00:00Z");
        assert_eq!(at(1_798_761_599), "2026-12-31T23:59:59Z");
    }
}
