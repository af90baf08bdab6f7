//! Frames of a lamp that moves, lit by virtual lights that are kept or new: time, shadow maps, errors, and how much pictures change.
//!
//! Source: S. Laine et al., "Incremental Instant Radiosity for Real-Time Indirect Illumination", EGSR 2007. Oracle: the path tracer.

use std::sync::Arc;
use std::time::Instant;

use clerestory::film::picture;
use clerestory::gpu::Gpu;
use clerestory::scene::{LightKind, Scene, SceneProfile};
use clerestory::techniques::instant_radiosity::many_light::{ManyLight, ManyLightSettings, Placement, Visibility};
use clerestory::techniques::path::{PathTracer, PathTracerSettings};
use clerestory::transport::GpuScene;
use clerestory::{Result, scene};
use glam::{DVec3, Vec3};

use super::vpl_receiver::{self, Receiver};
use crate::experiments::findings::{Bound, Criterion, Findings, Measured, Repeats, Study, geometric_mean, rows};
use crate::experiments::measures::Context;
use crate::experiments::measures::pictures::{Panel, finished, light_panel, mean_of, tiled};
use crate::experiments::reference::short_name;

/// Scenes, whether the lamp is a spot, where it begins and how far it goes on in a frame, as shares of the box around each.
pub(super) const SCENES: [(&str, bool, Vec3, Vec3); 3] = [
    (
        "builtin:cornell-box",
        false,
        Vec3::new(0.3, 0.75, 0.5),
        Vec3::new(0.01, 0.0, 0.01),
    ),
    (
        "builtin:box-room",
        true,
        Vec3::new(0.35, 0.6, 0.5),
        Vec3::new(0.01, 0.0, 0.0),
    ),
    (
        "builtin:divider-room",
        false,
        // Behind the divider, over which its light comes.
        Vec3::new(0.3, 0.6, 0.3),
        Vec3::new(0.005, 0.0, 0.0),
    ),
];
/// Pixels, lights, texels along a side of a map, frames of a lamp that moves, samples per pixel of the oracle, and frames between two of its own.
const FULL: Form = Form {
    side: 48,
    lights: 256,
    map_side: 64,
    frames: 30,
    oracle: 8192,
    every: 6,
};
const SMOKE: Form = Form {
    side: 12,
    lights: 32,
    map_side: 8,
    frames: 5,
    oracle: 64,
    every: 2,
};
pub(super) const RENEWED: u32 = 8;
/// Of the oracle's first picture.
pub(super) const ORACLE_SEED: u32 = 1000;
/// The last frames of all scenes, and of a body that moves: by kept lights, by new walks, and by the oracle.
const SHOWN: &str = "moving.png";
/// Pixels along a side that show one, and what is white over the mean.
const ENLARGED: u32 = 4;
const WHITE: f64 = 3.0;
/// Frames of a lamp that stands still.
const STILL: u32 = 8;
/// Pictures of new walks behind the jump.
const JUMP_SEEDS: u32 = 8;
pub(super) const INDIRECT: &str = "bounces=2,lobes=diffuse+glossy";
const KEPT: &str = "kept lights";
const NEW: &str = "new walks";
const WAYS: [(&str, Placement); 2] = [(KEPT, Placement::Incremental), (NEW, Placement::Walks)];

#[derive(Clone, Copy)]
pub(super) struct Form {
    pub side: u32,
    pub lights: u32,
    pub map_side: u32,
    pub frames: u32,
    pub oracle: u32,
    pub every: u32,
}

rows! {
    /// Where virtual lights come from.
    struct Row = "Frames of a lamp that moves" by [scene, way] {
        scene: String = "scene",
        way: String = "virtual lights",
        renewed: u64 = "most new lights of a frame",
        maps: Repeats = "maps",
        time: Repeats = "frame (ms)",
        error: Repeats = "relative RMSE",
        change: Repeats = "change from frame to frame over the mean",
    }
}
rows! {
    /// What frames of a lamp that stands still do.
    struct Still = "Frames of a lamp that stands still, kept lights" by [scene] {
        scene: String = "scene",
        lights: u64 = "new lights",
        rays: u64 = "rays to lights",
        maps: u64 = "maps",
    }
}
rows! {
    /// What becomes of kept lights whose lamp jumps back to where it began.
    struct Jump = "Frames behind a jump of the lamp, kept lights" by [scene] {
        scene: String = "scene",
        frames: u64 = "frames that renew all lights",
        first: f64 = "relative RMSE of the first frame",
        settled: f64 = "relative RMSE behind so many frames",
        new: Repeats = "relative RMSE of new walks",
        oracle: f64 = "oracle's own relative RMSE",
    }
}
rows! {
    /// Kept lights beside new ones.
    struct Pair = "Kept lights beside new walks" by [scene] {
        scene: String = "scene",
        renewed: u64 = "most new lights of a frame",
        faster: Measured = "time of new walks over that of kept lights",
        error: Measured = "error of kept lights over that of new walks",
        change: Measured = "change from frame to frame over that of new walks",
    }
}

/// What was found.
#[derive(Default, serde::Serialize, serde::Deserialize)]
pub struct Found {
    moving: Vec<Row>,
    still: Vec<Still>,
    jumps: Vec<Jump>,
    receivers: Vec<Receiver>,
}

const OF_PAIRS: &[Criterion<Pair>] = &[
    Criterion::each(
        "no more than 8 lights are new in a frame: the most",
        Bound::AtMost(RENEWED as f64),
        |row: &Pair| row.renewed.into(),
    )
    .in_every_form(),
    Criterion::each(
        "frames take half of the time at most: that of new walks over this",
        Bound::AtLeast(2.0),
        |row: &Pair| row.faster,
    ),
    Criterion::each(
        "kept lights err no more than new ones: ratio of errors",
        Bound::AtMost(1.0),
        |row: &Pair| row.error,
    ),
    Criterion::each(
        "pictures change less from frame to frame: ratio of changes",
        Bound::AtMost(1.0),
        |row: &Pair| row.change,
    ),
];

const OF_STILL: &[Criterion<Still>] = &[Criterion::each(
    "nothing is new while the lamp stands: lights, rays and maps",
    Bound::AtMost(0.0),
    |row: &Still| (row.lights + row.rays + row.maps).into(),
)
.in_every_form()];

const OF_JUMPS: &[Criterion<Jump>] = &[
    Criterion::each(
        "once all lights are renewed behind a jump, they err no more than new ones: ratio of errors",
        Bound::AtMost(1.0),
        |row: &Jump| Repeats(row.new.0.iter().map(|new| row.settled / new).collect()).measured(),
    ),
    Criterion::each(
        "the oracle errs by less than a tenth of what it judges: ratio of errors",
        Bound::AtMost(0.1),
        |row: &Jump| (row.oracle / row.settled.min(row.new.measured().value)).into(),
    ),
];

fn pairs(rows: &[Row]) -> Vec<Pair> {
    let kept = rows.iter().filter(|row| row.way == KEPT);
    let pair = |kept: &Row| {
        let new = rows.iter().find(|row| row.scene == kept.scene && row.way == NEW)?;
        Some(Pair {
            scene: kept.scene.clone(),
            renewed: kept.renewed,
            faster: new.time.over(&kept.time).measured(),
            error: kept.error.over(&new.error).measured(),
            change: kept.change.over(&new.change).measured(),
        })
    };
    kept.filter_map(pair).collect()
}

/// A scene that a lamp of so much light alone lights, and the lamp's way.
pub(super) struct Subject {
    pub scene: Scene,
    lower: Vec3,
    /// Of the box around it, m.
    pub size: Vec3,
    is_spot: bool,
    start: Vec3,
    step: Vec3,
}

impl Subject {
    pub fn new((address, is_spot, start, step): (&str, bool, Vec3, Vec3)) -> Result<Self> {
        let mut scene = scene::load(address)?;
        for material in &mut scene.materials {
            material.emission = Vec3::ZERO;
        }
        scene.lights.clear();
        scene.environment = None;
        let [lower, upper] = SceneProfile::of(&scene)
            .bounds
            .unwrap_or_default()
            .map(|corner| DVec3::from_array(corner).as_vec3());
        let mut subject = Self {
            scene,
            lower,
            size: upper - lower,
            is_spot,
            start,
            step,
        };
        let kind = subject.lamp(0);
        subject.scene.add_light("lamp", kind);
        Ok(subject)
    }

    /// The lamp in a frame. A spot is directed upwards, and turns to one side as it goes.
    fn lamp(&self, frame: u32) -> LightKind {
        let position = self.lower + self.size * (self.start + frame as f32 * self.step);
        let intensity = Vec3::splat(self.size.length_squared());
        if self.is_spot {
            LightKind::Spot {
                position,
                direction: Vec3::new(0.02 * frame as f32, 1.0, 0.2).normalize(),
                intensity,
                inner: 0.5,
                outer: 0.9,
            }
        } else {
            LightKind::Point { position, intensity }
        }
    }
}

/// Frames of it.
pub(super) fn renderer(
    gpu: &Gpu,
    scene: &Arc<GpuScene>,
    subject: &Subject,
    settings: ManyLightSettings,
    form: Form,
) -> Result<ManyLight> {
    ManyLight::new(
        gpu,
        Arc::clone(scene),
        &subject.scene.cameras[0],
        [form.side; 2],
        settings,
    )
}

/// The oracle: light of the same paths without a bound, `form.oracle` samples per pixel.
pub(super) fn oracle(gpu: &Gpu, scene: &Arc<GpuScene>, subject: &Subject, form: Form) -> Result<PathTracer> {
    let settings = PathTracerSettings {
        path_set: INDIRECT.parse()?,
        ..PathTracerSettings::default()
    };
    PathTracer::new(
        gpu,
        Arc::clone(scene),
        &subject.scene.cameras[0],
        [form.side; 2],
        settings,
    )
}

/// The oracle's picture of the scene as it is.
pub(super) fn traced(oracle: &mut PathTracer, form: Form, seed: u32) -> Result<Vec<f32>> {
    oracle.restart(seed)?;
    let picture = finished(oracle, form.oracle)?;
    Ok(picture.require(picture::RADIANCE)?.values().to_vec())
}

/// A frame that begins a picture, and its milliseconds of wall clock.
pub(super) fn frame(renderer: &mut ManyLight, subject: &Subject, seed: Option<u32>) -> Result<(Vec<f32>, f64)> {
    match seed {
        Some(seed) => renderer.restart(seed)?,
        None => renderer.set_camera(&subject.scene.cameras[0])?,
    }
    let clock = Instant::now();
    while renderer.step(1)?.is_some() {}
    let milliseconds = 1e3 * clock.elapsed().as_secs_f64();
    let (picture, _) = renderer.picture()?;
    Ok((picture.require(picture::RADIANCE)?.values().to_vec(), milliseconds))
}

/// Root of the mean squared difference, over the mean of the second.
pub(super) fn difference(a: &[f32], b: &[f32]) -> f64 {
    let squares: f64 = a.iter().zip(b).map(|(a, b)| f64::from(a - b).powi(2)).sum();
    let sum: f64 = b.iter().map(|value| f64::from(*value)).sum();
    (squares * b.len() as f64).sqrt() / sum
}

/// Light side by side, as bright as the last one is.
pub(super) fn side_by_side(all: [&[f32]; 3]) -> Vec<Panel> {
    let white = WHITE * mean_of(all[2]).max(f64::MIN_POSITIVE);
    all.map(|light| light_panel(light, white)).into()
}

/// What frames of a way have been.
#[derive(Default)]
struct Frames {
    maps: Vec<f64>,
    time: Vec<f64>,
    error: Vec<f64>,
    change: Vec<f64>,
    renewed: u64,
    last: Vec<f32>,
}

/// What was found, and panels of the last frame.
fn of_scene(
    context: &Context<'_>,
    gpu: &Gpu,
    case: (&str, bool, Vec3, Vec3),
) -> Result<(Vec<Row>, Still, Jump, Vec<Panel>)> {
    let form = context.pick(FULL, SMOKE);
    let subject = Subject::new(case)?;
    let scene = Arc::new(GpuScene::new(gpu, &subject.scene)?);
    let base = ManyLightSettings {
        lights: form.lights,
        visibility: Visibility::Maps,
        map_side: form.map_side,
        renewed: RENEWED,
        path_set: INDIRECT.parse()?,
        ..ManyLightSettings::default()
    };
    let of_way = |placement| {
        let settings = ManyLightSettings {
            placement,
            ..base.clone()
        };
        renderer(gpu, &scene, &subject, settings, form)
    };
    let mut renderers = [of_way(WAYS[0].1)?, of_way(WAYS[1].1)?];
    let mut oracle = oracle(gpu, &scene, &subject, form)?;
    let mut found = [Frames::default(), Frames::default()];
    let mut shown = Vec::new();
    // The first frame, of all lights, compiles kernels and does not count.
    for number in 0..=form.frames {
        scene.move_light(gpu, 0, &subject.lamp(number))?;
        let truth = match number {
            0 => None,
            number if number % form.every == 0 => Some(traced(&mut oracle, form, ORACLE_SEED + number)?),
            _ => None,
        };
        for turn in 0..WAYS.len() {
            let way = (turn + number as usize) % WAYS.len();
            let (renderer, frames) = (&mut renderers[way], &mut found[way]);
            let before = renderer.counts();
            let seed = (WAYS[way].1 == Placement::Walks).then_some(number);
            let (radiance, milliseconds) = frame(renderer, &subject, seed)?;
            let after = renderer.counts();
            if number > 0 {
                frames.maps.push((after.maps - before.maps) as f64);
                frames.time.push(milliseconds);
                frames.change.push(difference(&frames.last, &radiance));
                frames
                    .error
                    .extend(truth.as_ref().map(|truth| difference(&radiance, truth)));
                frames.renewed = frames.renewed.max(after.renewed - before.renewed);
            }
            frames.last = radiance;
        }
        if let Some(truth) = truth {
            shown = side_by_side([&found[0].last, &found[1].last, &truth]);
        }
    }
    // Until all is settled, and then frames that count.
    let still = &mut renderers[0];
    for _ in 0..form.lights {
        let before = still.counts().renewed;
        frame(still, &subject, None)?;
        if still.counts().renewed == before {
            break;
        }
    }
    let before = still.counts();
    for _ in 0..STILL {
        frame(still, &subject, None)?;
    }
    let after = still.counts();
    let name = short_name(case.0).to_owned();
    scene.move_light(gpu, 0, &subject.lamp(0))?;
    let [truth, again] = [ORACLE_SEED, 2 * ORACLE_SEED].map(|seed| traced(&mut oracle, form, seed));
    let (truth, again) = (truth?, again?);
    let first = difference(&frame(&mut renderers[0], &subject, None)?.0, &truth);
    let renewals = form.lights.div_ceil(RENEWED);
    for _ in 2..renewals {
        frame(&mut renderers[0], &subject, None)?;
    }
    let settled = difference(&frame(&mut renderers[0], &subject, None)?.0, &truth);
    let new = (0..JUMP_SEEDS).map(|seed| Ok(difference(&frame(&mut renderers[1], &subject, Some(seed))?.0, &truth)));
    let jump = Jump {
        scene: name.clone(),
        frames: renewals.into(),
        first,
        settled,
        new: Repeats(new.collect::<Result<_>>()?),
        // Two oracles differ by the root of two of their errors.
        oracle: difference(&again, &truth) * std::f64::consts::FRAC_1_SQRT_2,
    };
    let rows = WAYS.iter().zip(found).map(|((way, _), frames)| Row {
        scene: name.clone(),
        way: (*way).into(),
        renewed: frames.renewed,
        maps: Repeats(frames.maps),
        time: Repeats(frames.time),
        error: Repeats(frames.error),
        change: Repeats(frames.change),
    });
    let still = Still {
        scene: name.clone(),
        lights: after.renewed - before.renewed,
        rays: after.sight_rays - before.sight_rays,
        maps: after.maps - before.maps,
    };
    Ok((rows.collect(), still, jump, shown))
}

impl Study for Found {
    fn measure(context: &Context<'_>) -> Result<Self> {
        let gpu = (context.gpu)()?;
        let (mut still, mut jumps, mut shown) = (Vec::new(), Vec::new(), Vec::new());
        let moving = context.each(
            context.first(&SCENES, 1),
            |(address, ..)| short_name(address).to_owned(),
            |case| {
                let (rows, of_case, jump, panels) = of_scene(context, &gpu, *case)?;
                still.push(of_case);
                jumps.push(jump);
                shown.push(panels);
                Ok(rows)
            },
        )?;
        let form = context.pick(FULL, SMOKE);
        let (receiver, panels) = vpl_receiver::measure(&gpu, form)?;
        shown.push(panels);
        context.picture(SHOWN, &tiled([form.side; 2], ENLARGED, &shown));
        Ok(Self {
            moving,
            still,
            jumps,
            receivers: vec![receiver],
        })
    }

    fn findings(&self) -> Findings {
        let pairs = pairs(&self.moving);
        let all = Findings::of(&pairs, OF_PAIRS)
            .headline(
                "time of frames with new walks over that of frames with kept lights, geometric mean of three scenes",
                geometric_mean(pairs.iter().map(|pair| pair.faster)),
            )
            .and(Findings::of(&self.still, OF_STILL))
            .and(Findings::of(&self.jumps, OF_JUMPS))
            .and(vpl_receiver::findings(&self.receivers))
            .and(Findings::of(&self.moving, &[]))
            .note(format!(
                "{0} × {0} pixels, {1} virtual lights with exact maps of {2}² texels, four by four tiles and their filter; {3} frames in which the lamp goes on, behind a first one that places all lights. \
                 Ways take turns in each frame. A frame is wall clock, with the host's triangulations; new walks have another seed in each frame. Both ways have the bound and the filter of \
                 the defaults, and errors hold what these leave out and blur.",
                FULL.side, FULL.lights, FULL.map_side, FULL.frames,
            ));
        if self.moving.is_empty() {
            return all;
        }
        all.picture(
            SHOWN,
            "Indirect light of the last frame by kept lights, by new walks and by the oracle: a row a scene, and in the last one a block that has risen under a lamp that stands still.",
        )
    }
}
