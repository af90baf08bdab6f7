//! Stages of deferred frames of many lights: what each takes by the number of lights, what a frame's error costs the path tracer, what tiles and tests before rays save, and where tiles
//! see too few lights.
//!
//! Source: C. Sun, "Many-Light Real-Time Global Illumination using Sparse Voxel Octree", Master's thesis, WPI, 2015, §4 and table 5.1. Oracles: of what tiles see the same
//! lights at all pixels, of a frame's error the path tracer of many samples.

use std::sync::Arc;

use clerestory::film::picture::{self, Picture};
use clerestory::film::{CompareOptions, compare};
use clerestory::gpu::{Gpu, Timings};
use clerestory::scene::Scene;
use clerestory::techniques::instant_radiosity::Bound;
use clerestory::techniques::instant_radiosity::many_light::{ManyLight, ManyLightSettings};
use clerestory::techniques::{PathTracer, PathTracerSettings};
use clerestory::transport::random::SamplerKind;
use clerestory::transport::{GpuScene, PathSet};
use clerestory::{Result, scene};

use super::deferred_pictures::{self, write_pictures};
use crate::experiments::findings::{
    Axes, Bound as Limit, Criterion, Findings, Measured, Repeats, Study, curves, geometric_mean, rows,
};
use crate::experiments::measures::Context;
use crate::experiments::measures::pictures::finished;
use crate::experiments::reference::short_name;
use crate::timing::timed;

const SCENES: [&str; 3] = ["builtin:cornell-box", "builtin:box-room", "builtin:conference"];
/// Scenes in which few lights of many are seen from where the camera is, and one in which most are.
const DARK_SCENES: [&str; 3] = ["builtin:passage", "builtin:divider-room", "builtin:cornell-box"];
pub(super) const ALL: &str = "bounces=0..2,lobes=diffuse+glossy";
pub(super) const INDIRECT: &str = "bounces=2,lobes=diffuse+glossy";

const FULL: Form = Form {
    side: 96,
    lights: &[512, 1024, 2048, 4096, 8192, 16_384],
    dark_lights: &[128, 512, 2048, 8192],
    dark_side: 64,
    frame_side: 48,
    samples: 16,
    reference: 16_384,
    turns: 15,
};
const SMOKE: Form = Form {
    side: 16,
    lights: &[32, 64],
    dark_lights: &[16, 64],
    dark_side: 16,
    frame_side: 12,
    samples: 4,
    reference: 256,
    turns: 2,
};
/// Frames that the light of a tile is judged by.
const DARK_FRAMES: u32 = 4;
/// Tiles along a side.
pub(super) const TILES: u32 = 4;

#[derive(Clone, Copy)]
struct Form {
    /// Pixels along a side of frames whose stages are timed.
    side: u32,
    /// Walks of each.
    lights: &'static [u32],
    /// Walks of frames whose tiles are judged.
    dark_lights: &'static [u32],
    /// Pixels along a side of those.
    dark_side: u32,
    /// Pixels along a side of frames beside the path tracer.
    frame_side: u32,
    /// Samples of its pictures.
    samples: u32,
    /// Samples of its reference.
    reference: u32,
    turns: usize,
}

impl Form {
    /// The last of a list.
    const fn last(list: &[u32]) -> u32 {
        list[list.len() - 1]
    }

    const fn most(&self) -> u32 {
        Self::last(self.lights)
    }

    const fn most_dark(&self) -> u32 {
        Self::last(self.dark_lights)
    }
}

rows! {
    /// A number of walks.
    struct Row = "Stages of a frame" by [scene, walks] {
        scene: String = "scene",
        walks: u64 = "walks",
        lights: u64 = "virtual lights",
        placing: Repeats = "lights (ms)",
        drawing: Repeats = "G-buffer and split (ms)",
        direct: Repeats = "direct light (ms)",
        gather: Repeats = "gather (ms)",
        merge: Repeats = "merge and filter (ms)",
        light: Repeats = "gather for a light over that for one of the fewest",
        others: Repeats = "drawing, direct light and merge over those with the fewest lights",
        asked: f64 = "share of pairs whose visibility is asked for",
        bytes: u64 = "bytes between passes",
        most_bytes: f64 = "bytes between passes over those with the fewest lights",
    }
}
rows! {
    /// A frame of 512 walks beside the path tracer on the same light paths.
    struct Beside = "The error of a frame of 512 walks, and what it costs the path tracer" by [scene, paths] {
        scene: String = "scene",
        paths: String = "light paths",
        frame: Repeats = "frame (s)",
        frame_error: Repeats = "relative MSE of a frame",
        sample: Repeats = "path tracer, a sample per pixel (s)",
        sample_error: Repeats = "path tracer, relative MSE times samples per pixel",
        over: Repeats = "time of the path tracer to a frame's error over a frame's",
    }
}
rows! {
    /// As many pairs of a pixel and a light, by tiles and without.
    struct Tiles = "Pairs in tiles and without" by [scene] {
        scene: String = "scene",
        tiles: Repeats = "a pair in tiles (ns)",
        whole: Repeats = "a pair without (ns)",
        over: Repeats = "in tiles over without",
    }
}
rows! {
    /// Tiles beside all of the same lights.
    struct Dark = "Light of tiles beside that of all lights" by [scene, walks] {
        scene: String = "scene",
        walks: u64 = "walks",
        raw: f64 = "relative RMSE",
        filtered: f64 = "relative RMSE with the filter",
        over: f64 = "RMSE over that of the fewest lights",
        black: f64 = "share of lit pixels whose tile sees no light (%)",
    }
}

/// What was found.
#[derive(Default, serde::Serialize, serde::Deserialize)]
pub struct Found {
    stages: Vec<Row>,
    beside: Vec<Beside>,
    tiles: Vec<Tiles>,
    dark: Vec<Dark>,
    has_pictures: bool,
    /// Whether pictures of albedo, of split normals, of the reflective shadow map and of direct light were written, too.
    #[serde(default)]
    has_further_pictures: bool,
}

const OF_STAGES: &[Criterion<Row>] = &[
    Criterion::each(
        "the gather is linear in the lights: time for a light over that for one of the fewest",
        Limit::Between(0.9, 1.1),
        |row: &Row| (&row.light).into(),
    ),
    Criterion::each(
        "other stages of the frame do not grow with the lights: time over that with the fewest",
        Limit::Between(0.9, 1.1),
        |row: &Row| (&row.others).into(),
    )
    .because("walks alone do, one for each light"),
    Criterion::each(
        "more lights take no more memory between passes: ratio of bytes",
        Limit::AtMost(1.0),
        |row: &Row| row.most_bytes.into(),
    )
    .in_every_form(),
    Criterion::each(
        "what can bring nothing is asked for nothing: share of pairs that are",
        Limit::AtMost(0.9),
        |row: &Row| row.asked.into(),
    ),
];

const OF_FRAMES: &[Criterion<Beside>] = &[Criterion::each(
    "a frame's error costs the path tracer four times as long: ratio",
    Limit::AtLeast(4.0),
    |row: &Beside| (&row.over).into(),
)];

const OF_TILES: &[Criterion<Tiles>] = &[Criterion::each(
    "a pair takes no longer in tiles: ratio",
    Limit::AtMost(1.0),
    |row: &Tiles| (&row.over).into(),
)];

const OF_DARK: &[Criterion<Dark>] = &[
    Criterion::each(
        "with 64 times the lights tiles err a quarter at most: ratio of errors",
        Limit::AtMost(0.25),
        |row: &Dark| row.over.into(),
    )
    .among(|row| {
        [FULL, SMOKE]
            .iter()
            .any(|form| row.walks == u64::from(form.most_dark()))
    })
    .because("independent lights would leave an eighth; few of those in a tile bring most of its light"),
    Criterion::each(
        "the filter takes error away: RMSE over that without",
        Limit::AtMost(1.0),
        |row: &Dark| (row.filtered / row.raw).into(),
    ),
];

/// Milliseconds of the stages of a frame.
#[derive(Clone, Copy, Default)]
struct Stages {
    placing: f64,
    drawing: f64,
    direct: f64,
    gather: f64,
    merge: f64,
}

impl Stages {
    fn add(&mut self, timings: &Timings) {
        for pass in &timings.passes {
            let stage = match pass.name.as_str() {
                "raster: surfaces" | "many-light: split" => &mut self.drawing,
                "many-light: direct" => &mut self.direct,
                "many-light: gather" => &mut self.gather,
                "many-light: merge" => &mut self.merge,
                name if name.starts_with("film") => continue,
                _ => &mut self.placing,
            };
            *stage += pass.nanoseconds.map_or(f64::NAN, |ns| ns as f64 * 1e-6);
        }
    }

    fn others(&self) -> f64 {
        self.drawing + self.direct + self.merge
    }
}

/// A scene on the device.
pub(super) struct Subject {
    pub scene: Scene,
    pub on_device: Arc<GpuScene>,
}

impl Subject {
    pub fn new(gpu: &Gpu, address: &str) -> Result<Self> {
        let scene = scene::load(address)?;
        let on_device = Arc::new(GpuScene::new(gpu, &scene)?);
        Ok(Self { scene, on_device })
    }

    /// Frames of it.
    pub fn renderer(&self, gpu: &Gpu, side: u32, settings: ManyLightSettings) -> Result<ManyLight> {
        ManyLight::new(
            gpu,
            Arc::clone(&self.on_device),
            &self.scene.cameras[0],
            [side; 2],
            settings,
        )
    }

    /// A picture of so many frames.
    pub fn picture(&self, gpu: &Gpu, side: u32, frames: u32, settings: ManyLightSettings) -> Result<Picture> {
        let mut renderer = self.renderer(gpu, side, settings)?;
        finished(&mut renderer, frames)
    }
}

/// A frame that begins a picture, after one that does not count: caches are then as the same frame leaves them, whoever had the turn before.
fn warm_frame(renderer: &mut ManyLight, subject: &Subject) -> Result<Stages> {
    frame(renderer, subject)?;
    frame(renderer, subject)
}

/// A frame that begins a picture.
fn frame(renderer: &mut ManyLight, subject: &Subject) -> Result<Stages> {
    renderer.set_camera(&subject.scene.cameras[0])?;
    let mut stages = Stages::default();
    while let Some(step) = renderer.step(1)? {
        step.timings.iter().for_each(|timings| stages.add(timings));
    }
    Ok(stages)
}

fn stages_of_scene(context: &Context<'_>, gpu: &Gpu, subject: &Subject, name: &str, form: Form) -> Result<Vec<Row>> {
    let mut renderers = Vec::new();
    for walks in form.lights {
        let settings = ManyLightSettings {
            lights: *walks,
            interleave: TILES,
            ..ManyLightSettings::default()
        };
        renderers.push(subject.renderer(gpu, form.side, settings)?);
    }
    let found = context.in_turns(form.turns, renderers.len(), |i| warm_frame(&mut renderers[i], subject))?;
    let counts: Vec<_> = renderers.iter().map(ManyLight::counts).collect();
    let landed = |i: usize| counts[i].lights as f64 / counts[i].frames as f64;
    let bytes: Vec<u64> = renderers.iter().map(ManyLight::bytes).collect();
    let rows = form.lights.iter().enumerate().map(|(i, walks)| {
        let of = |stage: fn(&Stages) -> f64| -> Repeats { found[i].iter().map(stage).collect() };
        let over = |value: &dyn Fn(&Stages) -> f64| -> Repeats {
            let turns = found[i].iter().zip(&found[0]);
            turns.map(|(these, fewest)| value(these) / value(fewest)).collect()
        };
        Row {
            scene: name.into(),
            walks: (*walks).into(),
            lights: landed(i).round() as u64,
            placing: of(|stages| stages.placing),
            drawing: of(|stages| stages.drawing),
            direct: of(|stages| stages.direct),
            gather: of(|stages| stages.gather),
            merge: of(|stages| stages.merge),
            light: over(&|stages| stages.gather).scaled(landed(0) / landed(i)),
            others: over(&Stages::others),
            asked: counts[i].visibility_tests as f64 / counts[i].connections as f64,
            bytes: bytes[i],
            most_bytes: bytes[i] as f64 / bytes[0] as f64,
        }
    });
    Ok(rows.collect())
}

/// The same lights a pixel with tiles of many lights and without tiles of few.
fn tiles_of_scene(context: &Context<'_>, gpu: &Gpu, subject: &Subject, name: &str, form: Form) -> Result<Tiles> {
    let most = form.lights[form.lights.len() / 2];
    let mut renderers = Vec::new();
    for interleave in [TILES, 1] {
        let settings = ManyLightSettings {
            lights: most / (TILES * TILES) * interleave * interleave,
            interleave,
            path_set: INDIRECT.parse()?,
            ..ManyLightSettings::default()
        };
        renderers.push(subject.renderer(gpu, form.side, settings)?);
    }
    let found = context.in_turns(form.turns, renderers.len(), |i| {
        let renderer = &mut renderers[i];
        let before = renderer.counts();
        let stages = warm_frame(renderer, subject)?;
        let after = renderer.counts();
        // Without a history both frames are the same one.
        let pairs = (after.connections - before.connections) / (after.frames - before.frames);
        Ok(1e6 * stages.gather / pairs as f64)
    })?;
    let turns = found[0].iter().zip(&found[1]);
    Ok(Tiles {
        scene: name.into(),
        over: turns.map(|(tiles, whole)| tiles / whole).collect(),
        tiles: Repeats(found[0].clone()),
        whole: Repeats(found[1].clone()),
    })
}

/// Frames and pictures of the path tracer in turns, against its picture of many samples.
fn beside_of_scene(
    context: &Context<'_>,
    gpu: &Gpu,
    subject: &Subject,
    (name, paths_shown): (&str, &str),
    form: Form,
) -> Result<Beside> {
    let size = [form.frame_side; 2];
    let path_set: PathSet = paths_shown.parse()?;
    let of_paths = |seed| PathTracerSettings {
        path_set,
        sampler: SamplerKind::Pcg,
        seed,
        ..PathTracerSettings::default()
    };
    let paths = |seed| {
        let scene = Arc::clone(&subject.on_device);
        PathTracer::new(gpu, scene, &subject.scene.cameras[0], size, of_paths(seed))
    };
    let mut oracle = paths(0)?;
    let reference = finished(&mut oracle, form.reference)?;
    drop(oracle);
    let error = |picture: &Picture| -> Result<f64> {
        Ok(compare(picture, &reference, &CompareOptions::default())?.relative_mse)
    };
    let settings = ManyLightSettings {
        path_set,
        ..ManyLightSettings::default()
    };
    let mut frames = subject.renderer(gpu, form.frame_side, settings)?;
    let mut tracer = paths(1)?;
    let mut seed = 1;
    let found = context.in_turns(form.turns, 2, |i| {
        seed += 1;
        let (picture, seconds) = if i == 0 {
            frames.restart(seed)?;
            timed(|| finished(&mut frames, 1))
        } else {
            tracer.restart(seed)?;
            timed(|| finished(&mut tracer, form.samples))
        };
        Ok([seconds, error(&picture?)?])
    })?;
    let of = |contender: usize, part: usize| Repeats(found[contender].iter().map(|turn| turn[part]).collect());
    let samples = f64::from(form.samples);
    let (sample, sample_error) = (of(1, 0).scaled(1.0 / samples), of(1, 1).scaled(samples));
    let turns = found[0].iter().zip(&found[1]);
    Ok(Beside {
        scene: name.into(),
        paths: paths_shown.into(),
        over: turns
            .map(|([frame, error], [path, path_error])| path * path_error / (frame * error))
            .collect(),
        frame: of(0, 0),
        frame_error: of(0, 1),
        sample,
        sample_error,
    })
}

/// How far tiles are from what all of the same lights bring.
fn dark_of_scene(gpu: &Gpu, subject: &Subject, name: &str, form: Form) -> Result<Vec<Dark>> {
    let mut rows: Vec<Dark> = Vec::new();
    for walks in form.dark_lights {
        let radiance = |filter, whole_sets| -> Result<Vec<f32>> {
            let settings = ManyLightSettings {
                lights: *walks,
                interleave: TILES,
                filter,
                whole_sets,
                bound: Bound::None,
                path_set: INDIRECT.parse()?,
                ..ManyLightSettings::default()
            };
            let picture = subject.picture(gpu, form.dark_side, DARK_FRAMES, settings)?;
            Ok(picture.require(picture::RADIANCE)?.values().to_vec())
        };
        let (all, raw, filtered) = (radiance(false, true)?, radiance(false, false)?, radiance(true, false)?);
        // Of a pixel beside a light its own brightness is the measure, else few pixels had all of the error.
        let mean = all.iter().map(|value| f64::from(*value)).sum::<f64>() / all.len() as f64;
        let error = |found: &[f32]| {
            let pairs = found.iter().zip(&all);
            let squares = pairs.map(|(found, all)| (f64::from(found - all) / (f64::from(*all) + 0.1 * mean)).powi(2));
            (squares.sum::<f64>() / all.len() as f64).sqrt()
        };
        let is_lit = |pixel: &[f32]| pixel.iter().any(|value| *value > 0.0);
        let lit = all.chunks_exact(3).filter(|pixel| is_lit(pixel)).count();
        let pairs = all.chunks_exact(3).zip(raw.chunks_exact(3));
        let black = pairs.filter(|(all, raw)| is_lit(all) && !is_lit(raw)).count();
        let raw = error(&raw);
        rows.push(Dark {
            scene: name.into(),
            walks: (*walks).into(),
            raw,
            filtered: error(&filtered),
            over: raw / rows.first().map_or(raw, |fewest| fewest.raw),
            black: 100.0 * black as f64 / lit.max(1) as f64,
        });
    }
    Ok(rows)
}

impl Study for Found {
    fn measure(context: &Context<'_>) -> Result<Self> {
        let gpu = (context.gpu)()?;
        let form = context.pick(FULL, SMOKE);
        let name = |address: &&str| short_name(address).to_owned();
        let (mut tiles, mut beside) = (Vec::new(), Vec::new());
        let stages = context.each(context.first(&SCENES, 1), name, |address| {
            let subject = Subject::new(&gpu, address)?;
            let name = short_name(address);
            for paths in [ALL, INDIRECT] {
                beside.push(beside_of_scene(context, &gpu, &subject, (name, paths), form)?);
            }
            tiles.push(tiles_of_scene(context, &gpu, &subject, name, form)?);
            stages_of_scene(context, &gpu, &subject, name, form)
        })?;
        let dark = context.each(context.first(&DARK_SCENES, 1), name, |address| {
            dark_of_scene(&gpu, &Subject::new(&gpu, address)?, short_name(address), form)
        })?;
        write_pictures(context, &gpu)?;
        Ok(Self {
            stages,
            beside,
            tiles,
            dark,
            has_pictures: true,
            has_further_pictures: true,
        })
    }

    fn findings(&self) -> Findings {
        let last = self.stages.iter().filter(|row| row.walks == u64::from(FULL.most()));
        let light = geometric_mean(last.map(|row| Measured::from(&row.light)));
        let stages = Findings::of(&self.stages, OF_STAGES)
            .headline(
                "gather for a light of 16,384 over that for one of 512, geometric mean of three scenes",
                light,
            )
            .note(format!(
                "{0} × {0} pixels in {TILES} × {TILES} tiles, shadow rays, times of the device. Lights are those that have landed, 64 bytes each, which bytes between passes do not count.",
                FULL.side
            ))
            .curves(
                "gather",
                "Time of the gather against the number of lights",
                Axes::rates("virtual lights", "gather (ms)"),
                curves(
                    &self.stages,
                    |row| row.scene.clone(),
                    |row| (row.lights as f64, row.gather.measured()),
                ),
            );
        let tiles = Findings::of(&self.tiles, OF_TILES).note(format!(
            "As many pairs: {TILES} × {TILES} tiles of as many lights each as all pixels have without tiles."
        ));
        let dark = Findings::of(&self.dark, OF_DARK).note(format!(
            "{0} × {0} pixels, {DARK_FRAMES} frames without a bound; errors are over a value and a tenth of the mean.",
            FULL.dark_side
        ));
        let beside = Findings::of(&self.beside, OF_FRAMES).note(format!(
            "{0} × {0} pixels, wall clock; the path tracer's MSE falls with one over its samples, of which pictures have {1}, and its reference {2}. A frame sees every pixel at the same place in it, so that edges of \
             lamps and of what is small have all of their error in one frame, and has the biases of its bound and its filter; its time is that of the stages above.",
            FULL.frame_side, FULL.samples, FULL.reference,
        ));
        let all = stages.and(beside).and(tiles).and(dark);
        let shown = if self.has_pictures {
            deferred_pictures::shown(self.has_further_pictures)
        } else {
            Vec::new()
        };
        shown
            .into_iter()
            .fold(all, |all, (file, words)| all.picture(file, words))
    }
}
