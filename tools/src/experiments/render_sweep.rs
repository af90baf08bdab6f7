//! Rendering a sweep: references, pictures and their measurements, with all that is already there left as it is.
//!
//! The variants take turns (repeats outermost, then budgets, then variants), so that a change of the machine's load meets all of them. Each
//! variant renders one sample a pixel first, so that no measurement pays for the driver's compilation.
//! Guarantees: each finished picture is kept at once; a stop, asked for at any time, loses the picture at hand at most.

use std::path::{Path, PathBuf};
use std::time::Duration;

use clerestory::film::metrics::{CompareOptions, compare};
use clerestory::film::picture::RADIANCE;
use clerestory::film::{Picture, ToneCurve, ToneMap, exr};
use clerestory::gpu::Gpu;
use clerestory::render::{RenderOptions, Rendered, Renderer};
use clerestory::scene::{Scene, SceneProfile};
use clerestory::{Error, Result};
use serde_json::Value;

use super::Experiment;
use super::fingerprint::{self, Fingerprint};
use super::measurement::{Measurement, Store};
use super::reference::{self, Identity};
use super::results::{Point, Results, SceneResults, VariantResults};
use super::sweep::{Budget, SPP_MAX, Sweep, Variant};
use super::unbiased;
use super::watch::Watch;
use crate::machine;

/// Where a sweep keeps its things.
#[derive(Debug, Clone)]
pub struct Places {
    /// The experiment's own folder.
    pub folder: PathBuf,
    /// The folder of references, which experiments share.
    pub references: PathBuf,
    /// Measures everything anew, references included.
    pub fresh: bool,
}

/// Renders what is missing and returns everything; `load` reads a scene by its address.
///
/// # Errors
/// Those of scenes, techniques and files. A scene that a technique cannot model, or not with a setting, is no error: the variant says so in the results.
pub fn run(
    gpu: &Gpu,
    experiment: &Experiment,
    sweep: &Sweep,
    smoke: bool,
    places: &Places,
    load: &dyn Fn(&str) -> Result<Scene>,
    watch: &dyn Watch,
) -> Result<Results> {
    sweep.check()?;
    let pictures = places.folder.join(PICTURES);
    std::fs::create_dir_all(&pictures).map_err(|error| Error::io(&pictures, error))?;
    let caps = gpu.caps();
    let load_average = machine::load();
    let machine = format!("{}, {} threads", machine::processor(), machine::threads());
    let all = sweep.scenes.len() * sweep.variants.len() * sweep.budgets().len() * sweep.repeats as usize;
    let mut running = Running {
        gpu,
        sweep,
        places,
        load,
        watch,
        store: Store::open(&places.folder.join(MEASUREMENTS))?,
        place: serde_json::json!({
            "engine": ENGINE, "device": caps.device, "driver": caps.driver, "machine": machine, "optimised": !cfg!(debug_assertions),
        }),
        all,
        measured: 0,
        found: 0,
    };
    let mut scenes = Vec::new();
    for address in &sweep.scenes {
        if watch.stopped() {
            break;
        }
        scenes.extend(running.scene(address)?);
    }
    let done = running.measured + running.found;
    let refused: usize = scenes
        .iter()
        .flat_map(|scene| &scene.variants)
        .filter(|variant| variant.refused.is_some())
        .map(|_| sweep.budgets().len() * sweep.repeats as usize)
        .sum();
    Ok(Results {
        experiment: experiment.name.clone(),
        title: experiment.title.clone(),
        about: experiment.about.clone(),
        systems: experiment.systems.clone(),
        smoke,
        sweep: sweep.clone(),
        engine_version: ENGINE.into(),
        device: caps.device.clone(),
        driver: caps.driver.clone(),
        machine,
        load: load_average,
        interrupted: done + refused < all,
        measured: running.measured,
        found: running.found,
        scenes,
    })
}

const ENGINE: &str = env!("CARGO_PKG_VERSION");
/// The file of measurements in the experiment's folder.
const MEASUREMENTS: &str = "measurements.jsonl";
/// The folder of pictures in the experiment's folder.
const PICTURES: &str = "pictures";

struct Running<'a> {
    gpu: &'a Gpu,
    sweep: &'a Sweep,
    places: &'a Places,
    load: &'a dyn Fn(&str) -> Result<Scene>,
    watch: &'a dyn Watch,
    store: Store,
    /// What of the machine measurements depend on.
    place: Value,
    all: usize,
    measured: usize,
    found: usize,
}

/// A scene with its reference, uploaded when the first picture needs it.
struct Stage<'a> {
    address: &'a str,
    scene: Scene,
    print: String,
    tone: ToneMap,
    renderer: Option<Renderer>,
}

/// A picture to measure.
struct Task {
    variant: usize,
    budget: usize,
    seed: u32,
    key: String,
    /// Where the picture is kept, for the one of each variant that is shown.
    shown: Option<PathBuf>,
}

impl Running<'_> {
    /// `None` when it was stopped before the reference was there.
    fn scene(&mut self, address: &str) -> Result<Option<SceneResults>> {
        let mut scene = (self.load)(address)?;
        let print = fingerprint::scene(&mut scene);
        let triangles = SceneProfile::of(&scene).triangles;
        let tone = ToneMap {
            exposure: f64::from(scene.defaults.exposure),
            curve: ToneCurve::Srgb,
        };
        let mut stage = Stage {
            address,
            scene,
            print,
            tone,
            renderer: None,
        };
        let Some((reference_path, reference_key, reference)) = self.reference(&mut stage)? else {
            return Ok(None);
        };
        let mut variants = self.variants()?;
        let tasks = self.tasks(&stage, &variants, &reference_key)?;
        let mut warm = vec![false; variants.len()];
        for task in &tasks {
            let variant = &mut variants[task.variant];
            if variant.refused.is_some() {
                continue;
            }
            let there = !self.places.fresh && task.shown.as_ref().is_none_or(|path| path.is_file());
            let measurement = match self.store.get(&task.key).filter(|_| there) {
                Some(kept) => {
                    self.found += 1;
                    kept.clone()
                }
                None => match self.measure(&mut stage, task, &mut warm, &reference) {
                    Ok(Some(measurement)) => measurement,
                    Ok(None) => continue,
                    Err(error) => {
                        let cause = refusal(error)?;
                        self.watch.note(&format!("{address}: {}: {cause}", variant.name));
                        variant.refused = Some(cause);
                        continue;
                    }
                },
            };
            variant.points[task.budget]
                .measurements
                .push(measurement.within_results());
            if let Some(path) = &task.shown {
                variant.picture = Some(exr::read(path)?);
            }
        }
        for variant in &mut variants {
            variant.points.retain(|point| !point.measurements.is_empty());
        }
        Ok(Some(SceneResults {
            address: address.into(),
            triangles,
            reference: reference_path
                .file_name()
                .unwrap_or_default()
                .to_string_lossy()
                .into_owned(),
            tone,
            reference_error_of_mean: unbiased::error_of_mean(&reference)?,
            reference_picture: Some(reference),
            variants,
        }))
    }

    fn reference(&mut self, stage: &mut Stage<'_>) -> Result<Option<(PathBuf, String, Picture)>> {
        let (plan, settings) = (&self.sweep.reference, self.sweep.reference_settings()?);
        let identity = Identity {
            scene: &stage.print,
            camera: self.sweep.camera.as_deref(),
            size: self.sweep.size,
            technique: &plan.technique,
            settings: &settings,
            spp: plan.spp,
            seed: reference::SEED,
            engine: ENGINE,
        };
        let (key, path) = (identity.key()?, identity.path(&self.places.references, stage.address)?);
        let what = format!("{}: reference, {} spp", stage.address, plan.spp);
        if !self.places.fresh
            && let Some(picture) = reference::kept(&path)?
        {
            refuse_black(&what, &picture)?;
            return Ok(Some((path, key, picture)));
        }
        self.watch.begin(&what, self.measured + self.found, self.all);
        let options = self.options(&plan.technique, &settings, Budget::Spp(plan.spp), reference::SEED);
        let Some(rendered) = self.render(stage, &options)? else {
            return Ok(None);
        };
        refuse_black(&what, &rendered.picture)?;
        let picture = reference::keep(&path, &key, &rendered)?;
        Ok(Some((path, key, picture)))
    }

    fn variants(&self) -> Result<Vec<VariantResults>> {
        let empty = |variant: &Variant| {
            let points = self.sweep.budgets().into_iter().map(|budget| Point {
                budget,
                measurements: Vec::new(),
            });
            Ok(VariantResults {
                name: variant.name.clone(),
                technique: variant.technique.clone(),
                settings: self.sweep.settings(&variant.technique, &variant.settings)?,
                refused: None,
                points: points.collect(),
                picture: None,
            })
        };
        self.sweep.variants.iter().map(empty).collect()
    }

    fn tasks(&self, stage: &Stage<'_>, variants: &[VariantResults], reference: &str) -> Result<Vec<Task>> {
        let budgets = self.sweep.budgets();
        let mut tasks = Vec::new();
        for (repeat, seed) in self.sweep.seeds().enumerate() {
            for (budget, allowed) in budgets.iter().enumerate() {
                for (variant, facts) in variants.iter().enumerate() {
                    let all = serde_json::json!({
                        "scene": stage.print, "camera": self.sweep.camera, "size": self.sweep.size, "technique": facts.technique,
                        "settings": facts.settings, "budget": allowed, "seed": seed, "reference": reference, "place": self.place,
                    });
                    let key = Fingerprint::of(all.to_string().as_bytes());
                    let is_shown = repeat == 0 && budget + 1 == budgets.len();
                    let shown = is_shown.then(|| self.places.folder.join(PICTURES).join(format!("{key}.exr")));
                    tasks.push(Task {
                        variant,
                        budget,
                        seed,
                        key,
                        shown,
                    });
                }
            }
        }
        Ok(tasks)
    }

    /// `None` when it was stopped.
    fn measure(
        &mut self,
        stage: &mut Stage<'_>,
        task: &Task,
        warm: &mut [bool],
        reference: &Picture,
    ) -> Result<Option<Measurement>> {
        let variant = &self.sweep.variants[task.variant];
        let budget = self.sweep.budgets()[task.budget];
        let settings = self.sweep.settings(&variant.technique, &variant.settings)?;
        let what = format!("{}: {}, {budget}, seed {}", stage.address, variant.name, task.seed);
        self.watch.begin(&what, self.measured + self.found, self.all);
        if !warm[task.variant] {
            let options = self.options(&variant.technique, &settings, Budget::Spp(1), 0);
            if self.render(stage, &options)?.is_none() {
                return Ok(None);
            }
            warm[task.variant] = true;
        }
        let options = self.options(&variant.technique, &settings, budget, task.seed);
        let Some(rendered) = self.render(stage, &options)? else {
            return Ok(None);
        };
        if let Some(path) = &task.shown {
            keep_picture(path, &rendered.picture)?;
        }
        let measurement = judge(&rendered, reference, task, budget, stage.tone)?;
        let measurement = self.store.add(&measurement)?;
        self.measured += 1;
        Ok(Some(measurement))
    }

    fn options(&self, technique: &str, settings: &Value, budget: Budget, seed: u32) -> RenderOptions {
        RenderOptions {
            technique: Some(technique.into()),
            camera: self.sweep.camera.clone(),
            size: self.sweep.size,
            spp: match budget {
                Budget::Spp(spp) => spp,
                Budget::Seconds(_) => SPP_MAX,
            },
            seed,
            time_budget: match budget {
                Budget::Spp(_) => None,
                Budget::Seconds(seconds) => Some(Duration::from_secs_f64(seconds)),
            },
            settings: settings.clone().into(),
            ..RenderOptions::default()
        }
    }

    /// `None` when it was stopped.
    fn render(&self, stage: &mut Stage<'_>, options: &RenderOptions) -> Result<Option<Rendered>> {
        let renderer = match &stage.renderer {
            Some(renderer) => renderer,
            None => stage.renderer.insert(Renderer::new(self.gpu, &stage.scene)?),
        };
        let mut rendering = match options.technique.as_deref() {
            Some(id) => renderer.start_technique(self.sweep.card(id)?, options)?,
            None => renderer.start(options)?,
        };
        while let Some(progress) = rendering.step()? {
            self.watch.step(progress);
            if self.watch.stopped() {
                return Ok(None);
            }
        }
        rendering.finish().map(Some)
    }
}

/// Why a scene is refused. Settings are those that the technique allows ([`Sweep::check`]), so that one that is refused here does not fit the scene.
///
/// # Errors
/// Any other error.
fn refusal(error: Error) -> Result<String> {
    match error {
        Error::Unsupported { technique, reasons } => Ok(format!("technique {technique}: {}", reasons.join("; "))),
        setting @ Error::Setting { .. } => Ok(setting.to_string()),
        other => Err(other),
    }
}

/// Radiance alone.
fn keep_picture(path: &Path, picture: &Picture) -> Result<()> {
    let mut kept = Picture::new(picture.width(), picture.height())?;
    kept.metadata = picture.metadata.clone();
    kept.add_layer(RADIANCE, 3, picture.main_layer()?.pixels().flatten().collect())?;
    exr::write(path, &kept)
}

/// Refuses a reference that no error is relative to.
fn refuse_black(what: &str, picture: &Picture) -> Result<()> {
    if picture.main_layer()?.values().iter().any(|&value| value != 0.0) {
        return Ok(());
    }
    Err(Error::setting(
        "reference",
        what,
        "the picture is black, so that no error relative to it exists: take more samples or a brighter scene",
    ))
}

fn judge(rendered: &Rendered, reference: &Picture, task: &Task, budget: Budget, tone: ToneMap) -> Result<Measurement> {
    let options = CompareOptions {
        tone,
        ..CompareOptions::default()
    };
    let metrics = compare(&rendered.picture, reference, &options)?;
    let (picture, report) = (&rendered.picture, &rendered.report);
    let samples = picture.layer(clerestory::film::picture::SAMPLES).map(|layer| {
        let sum: f64 = layer.values().iter().map(|count| f64::from(*count)).sum();
        sum / layer.values().len().max(1) as f64
    });
    Ok(Measurement {
        key: task.key.clone(),
        kernels: fingerprint::kernels(&report.pipelines),
        scene: report.scene.clone(),
        technique: report.technique.clone(),
        settings: report.settings.clone(),
        budget,
        seed: task.seed,
        samples: samples.unwrap_or(f64::from(report.samples[1])),
        seconds: report.render_seconds,
        gpu_seconds: report.gpu_seconds,
        counters: report.counters.clone(),
        error: unbiased::measure(picture, reference)?,
        relative_bias: Some(metrics.relative_bias).filter(|bias| bias.is_finite()),
        flip: metrics.flip,
        quantile_999: metrics.quantile_999,
        non_finite: metrics.non_finite_test + report.non_finite_samples.total(),
        time: report.time.clone(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_does_not_fit_a_scene_is_refused_and_all_else_is_an_error() {
        let refused = Error::Unsupported {
            technique: "photon".into(),
            reasons: vec!["one".into(), "two".into()],
        };
        assert_eq!(refusal(refused).unwrap(), "technique photon: one; two");
        let cause = refusal(Error::setting("volume", "beams", "need homogeneous media")).unwrap();
        assert_eq!(cause, "setting volume: beams need homogeneous media");
        assert!(refusal(Error::scene("a.gltf", "meshes", "has none")).is_err());
    }
}
