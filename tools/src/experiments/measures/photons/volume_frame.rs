//! What a frame of photons in media costs when the light moves: milliseconds of photons, of their map, of eye rays and of density estimation, and rates of each.
//!
//! Source of the comparison: B. Fabianowski, "Interactive Manycore Photon Mapping", PhD thesis, Trinity College Dublin, 2011, §7.5 and Table 7.6, on a GPU of
//! its time. Its figures stand beside ours.

use std::sync::Arc;
use std::time::Instant;

use clerestory::gpu::{Gpu, Timings};
use clerestory::render::Renderer;
use clerestory::scene::LightKind;
use clerestory::techniques::photon_mapping::{PhotonMapper, PhotonSettings};
use clerestory::{Result, scene};
use glam::Vec3;

use super::frames::{PHOTON_PASSES, STEP, milliseconds, rate};
use super::scenarios::{Depths, SCENARIOS, Scenario, TWO_BOUNCES};
use crate::experiments::findings::{Bound, Criterion, Findings, Repeats, Study, geometric_mean, rows};
use crate::experiments::measures::Context;

/// Pixels, frames that count, after one that compiles kernels, and the source's photons over ours.
const FULL: ([u32; 2], u32, u32) = ([128, 96], 5, 1);
const SMOKE: ([u32; 2], u32, u32) = ([16, 12], 2, 256);
/// Scenes of a smoke run.
const SMOKE_SCENES: usize = 1;
/// How passes are called: of density estimation in media and on surfaces, and of both maps.
const MEDIA_PASSES: [&str; 2] = ["photon: beams", "photon: plane rays"];
const SURFACE_PASSES: &str = "photon: gather";
const MAP_PASSES: [&str; 2] = ["map: ", "volume map: "];
/// Where walks of photons and of eye paths start, and where each bounce of them begins.
const STARTS: [&str; 3] = ["photon: emit", "photon: glow", "path: camera"];
const BOUNCES: [&str; 2] = ["photon: extend", "path: extend"];
/// Stages that have bounces, and how many of these stand by themselves, the last with all that come after it.
const STAGES: [&str; 4] = ["photons", "eye rays", "density estimation", "queries of surfaces"];
const PHOTONS: usize = 0;
const RAYS: usize = 1;
const ESTIMATION: usize = 2;
const SURFACES: usize = 3;
const BOUNCE_NAMES: [&str; 4] = ["1", "2", "3", "4 and later"];
/// Loop iterations of a submission: more than a bounce's, so that each is of one piece.
const SUBMISSION_WORK: u64 = 1 << 30;

/// A frame of the source.
struct Published {
    /// Collisions that are stored.
    events: u64,
    /// Kernels that a query meets.
    contributions: f64,
    /// Milliseconds of photon tracing, of the map's construction, of ray tracing and of density estimation.
    stages: [f64; 4],
}

/// Table 7.6, in the order of the scenes.
const PUBLISHED: [Published; 9] = [
    Published {
        events: 892_776,
        contributions: 1156.3,
        stages: [49.83, 20.37, 10.44, 263.25],
    },
    Published {
        events: 1_012_995,
        contributions: 903.5,
        stages: [49.60, 23.04, 9.96, 203.52],
    },
    Published {
        events: 922_823,
        contributions: 791.6,
        stages: [46.89, 21.17, 9.96, 182.69],
    },
    Published {
        events: 310_189,
        contributions: 1091.1,
        stages: [109.03, 8.27, 11.74, 119.31],
    },
    Published {
        events: 327_471,
        contributions: 1152.6,
        stages: [110.22, 8.67, 11.74, 123.93],
    },
    Published {
        events: 311_908,
        contributions: 1010.3,
        stages: [169.94, 8.23, 12.12, 132.55],
    },
    Published {
        events: 351_797,
        contributions: 1305.7,
        stages: [26.31, 9.76, 11.96, 322.11],
    },
    Published {
        events: 358_297,
        contributions: 1151.8,
        stages: [26.25, 9.63, 11.94, 249.37],
    },
    Published {
        events: 365_337,
        contributions: 1194.7,
        stages: [26.50, 10.64, 11.89, 269.88],
    },
];

rows! {
    /// A scene's frames.
    struct Row = "A frame with a moving light in a medium" by [scene] {
        scene: String = "scene",
        photons: u64 = "photons",
        events: Repeats = "collisions",
        contributions: Repeats = "k, contributions per query",
        trace: Repeats = "trace (ms)",
        map: Repeats = "maps (ms)",
        rays: Repeats = "eye rays (ms)",
        estimation: Repeats = "density estimation (ms)",
        surfaces: Repeats = "queries of surfaces (ms)",
        all: Repeats = "frame (ms)",
        share: Repeats = "share of trace and density estimation",
        frames: Repeats = "frames/s",
        traced: Repeats = "thousand photons traced/s",
        met: Repeats = "million contributions/s, media",
        gathered: Repeats = "million contributions/s, surfaces",
        ratio: Repeats = "contributions/s, media over surfaces",
    }
    beside "source: collisions" = |row| published(&row.scene, |frame| frame.events).into();
    beside "source: k" = |row| published(&row.scene, |frame| frame.contributions).into();
    beside "source: trace (ms)" = |row| published(&row.scene, |frame| frame.stages[0]).into();
    beside "source: map (ms)" = |row| published(&row.scene, |frame| frame.stages[1]).into();
    beside "source: rays (ms)" = |row| published(&row.scene, |frame| frame.stages[2]).into();
    beside "source: density estimation (ms)" = |row| published(&row.scene, |frame| frame.stages[3]).into();
    beside "source: share of trace and density estimation" = |row| published(&row.scene, Published::share).into();
}

rows! {
    /// A stage's bounce.
    struct Stage = "Stages of a frame by bounce" by [scene, stage, bounce] {
        scene: String = "scene",
        stage: String = "stage",
        bounce: String = "bounce",
        jobs: Option<Repeats> = "jobs that begin",
        time: Repeats = "time (ms)",
        share: Repeats = "share of the frame (%)",
    }
}

fn published<T>(scene: &str, of: fn(&Published) -> T) -> Option<T> {
    let place = SCENARIOS.iter().position(|scenario| scenario.name == scene)?;
    PUBLISHED.get(place).map(of)
}

impl Published {
    fn share(&self) -> f64 {
        (self.stages[0] + self.stages[3]) / self.stages.iter().sum::<f64>()
    }
}

/// What was found.
#[derive(Debug, Default, serde::Serialize, serde::Deserialize)]
pub struct Found {
    frames: Vec<Row>,
    #[serde(default)]
    stages: Vec<Stage>,
}

const CRITERIA: &[Criterion<Row>] = &[
    Criterion::each(
        "photons and density estimation take most of a frame: their share",
        Bound::AtLeast(0.5),
        |row: &Row| (&row.share).into(),
    )
    .because("most is more than half; the source's are 0.88 to 0.94"),
    Criterion::each(
        "media give at least half as many contributions a second as surfaces: ratio",
        Bound::AtLeast(0.5),
        |row: &Row| (&row.ratio).into(),
    ),
];

impl Study for Found {
    fn measure(context: &Context<'_>) -> Result<Self> {
        let gpu = (context.gpu)()?;
        let name = |scenario: &Scenario| scenario.name.to_owned();
        let scenarios = context.first(&SCENARIOS, SMOKE_SCENES);
        let mut stages = Vec::new();
        let frames = context.each(scenarios, name, |scenario| {
            let (size, count, share) = context.pick(FULL, SMOKE);
            let frames = frames(&gpu, scenario, size, count, share)?;
            stages.extend(stages_of(scenario, size, &frames));
            Ok(vec![Row::of(scenario, share, &frames)])
        })?;
        Ok(Self { frames, stages })
    }

    fn findings(&self) -> Findings {
        Findings::of(&self.frames, CRITERIA)
            .headline(
                "frames per second, geometric mean of the scenes",
                geometric_mean(self.frames.iter().map(|row| row.frames.measured())),
            )
            .stacked_bars(
                "frame",
                "Milliseconds of a frame with a moving light in a medium, medians",
                &self.frames,
                |row| row.scene.clone(),
                &[
                    ("photons", |row: &Row| row.trace.measured().value),
                    ("maps", |row: &Row| row.map.measured().value),
                    ("eye rays", |row: &Row| row.rays.measured().value),
                    ("density estimation", |row: &Row| row.estimation.measured().value),
                    ("queries of surfaces", |row: &Row| row.surfaces.measured().value),
                ],
            )
            .note(format!(
                "{} × {} pixels, one sample each; {} frames, the lamp 3 cm further along each axis in each, so that intervals hold what its place changes too. Light of one and two bounces, \
                 with the source's photons and greatest radii, under the default dampening. Unlike the source's, our photons land on surfaces as well, which are asked for them: the share leaves the time of these \
                 queries out, maps are both, and direct light is the photons'. Times of passes are GPU times, a frame is wall clock.",
                FULL.0[0], FULL.0[1], FULL.1,
            ))
            .note(
                "Source: 512 × 512 pixels on a GPU of 2008, with up to four rays a pixel; its rays hold shadow rays. Rates are the stage's count over its time. A smoke run has a 256th of the \
                 photons.",
            )
            .and(Findings::of(&self.stages, &[]))
            .note(
                "A stage is one kernel or a few over the jobs of a bounce. Jobs are those that a walk begins with, a photon or a pixel each; later ones are what is left of them. A bounce of photons ends where they \
                 land or collide, one of eye rays behind the query of what it passed through.",
            )
    }
}

/// Frames that count.
fn frames(gpu: &Gpu, scenario: &Scenario, size: [u32; 2], count: u32, share: u32) -> Result<Vec<Frame>> {
    let scene = scene::load(scenario.scene)?;
    let uploaded = Arc::clone(Renderer::new(gpu, &scene)?.gpu_scene());
    let camera = scene.require_camera(None)?;
    let settings = PhotonSettings {
        submission_work: SUBMISSION_WORK,
        ..scenario.settings(TWO_BOUNCES, Depths::UpToOne, share)?
    };
    let mut mapper = PhotonMapper::new(gpu, Arc::clone(&uploaded), camera, size, settings)?;
    let mut frames = Vec::new();
    for number in 0..=count {
        for (index, light) in scene.lights.iter().enumerate() {
            uploaded.move_light(gpu, index, &moved(light.kind, STEP * number as f32))?;
        }
        mapper.restart(number)?;
        let frame = Frame::of(&mut mapper)?;
        if number > 0 {
            frames.push(frame);
        }
    }
    Ok(frames)
}

/// A light with a place elsewhere.
fn moved(mut light: LightKind, offset: Vec3) -> LightKind {
    match &mut light {
        LightKind::Point { position, .. } | LightKind::Spot { position, .. } => *position += offset,
        LightKind::Directional { .. } => {}
    }
    light
}

/// Milliseconds and counts of one frame.
#[derive(Debug, Clone, Copy, Default)]
struct Frame {
    trace: f64,
    map: f64,
    rays: f64,
    estimation: f64,
    surfaces: f64,
    /// By wall clock: all of it, with the host's share.
    all: f64,
    emitted: f64,
    events: f64,
    /// Rays through media, and the kernels that they met.
    asked: f64,
    met: f64,
    /// Kernels about points of surfaces.
    gathered: f64,
    /// Milliseconds by stage and bounce.
    by_bounce: [[f64; BOUNCE_NAMES.len()]; STAGES.len()],
}

impl Frame {
    fn of(mapper: &mut PhotonMapper) -> Result<Self> {
        let (mut frame, mut bounce) = (Self::default(), 0);
        let before = mapper.counts();
        let clock = Instant::now();
        while let Some(step) = mapper.step(1)? {
            step.timings.iter().for_each(|timings| frame.add(timings, &mut bounce));
        }
        frame.all = 1e3 * clock.elapsed().as_secs_f64();
        let after = mapper.counts();
        frame.map = 1e3 * (after.map_seconds - before.map_seconds);
        frame.emitted = (after.photons.emitted - before.photons.emitted) as f64;
        frame.events = (after.events - before.events) as f64;
        frame.asked = (after.beams.queries - before.beams.queries) as f64;
        frame.met = (after.beams.photons - before.beams.photons) as f64;
        frame.gathered = (after.gather.photons - before.gather.photons) as f64;
        Ok(frame)
    }

    /// Photons and eye paths are not under way at the same time: one number of bounces serves both.
    fn add(&mut self, timings: &Timings, bounce: &mut usize) {
        for pass in &timings.passes {
            let milliseconds = milliseconds(pass);
            let is_of = |names: &[&str]| names.iter().any(|name| pass.name.starts_with(*name));
            if is_of(&STARTS) {
                *bounce = 0;
            }
            *bounce += usize::from(is_of(&BOUNCES));
            let stage = if is_of(&MEDIA_PASSES) {
                self.estimation += milliseconds;
                ESTIMATION
            } else if is_of(&[SURFACE_PASSES]) {
                self.surfaces += milliseconds;
                SURFACES
            } else if is_of(&[PHOTON_PASSES]) {
                self.trace += milliseconds;
                PHOTONS
            } else if is_of(&MAP_PASSES) {
                continue;
            } else {
                self.rays += milliseconds;
                RAYS
            };
            // What comes before the first bounce begins it.
            let place = bounce.saturating_sub(1).min(BOUNCE_NAMES.len() - 1);
            self.by_bounce[stage][place] += milliseconds;
        }
    }
}

/// Milliseconds and shares of each stage and bounce, with the jobs that walks begin with.
fn stages_of(scenario: &Scenario, size: [u32; 2], frames: &[Frame]) -> Vec<Stage> {
    let pixels = f64::from(size[0] * size[1]);
    let of_bounce = |stage: usize, bounce: usize| {
        let jobs = |frame: &Frame| match (stage, bounce) {
            (PHOTONS, 0) => Some(frame.emitted),
            (RAYS, 0) => Some(pixels),
            _ => None,
        };
        let of = |frame: &Frame| frame.by_bounce[stage][bounce];
        Stage {
            scene: scenario.name.into(),
            stage: STAGES[stage].into(),
            bounce: BOUNCE_NAMES[bounce].into(),
            jobs: frames.iter().map(jobs).collect(),
            time: frames.iter().map(of).collect(),
            share: frames.iter().map(|frame| 100.0 * of(frame) / frame.all).collect(),
        }
    };
    let stages = 0..STAGES.len();
    stages
        .flat_map(|stage| (0..BOUNCE_NAMES.len()).map(move |bounce| (stage, bounce)))
        .map(|(stage, bounce)| of_bounce(stage, bounce))
        .collect()
}

impl Row {
    fn of(scenario: &Scenario, share: u32, frames: &[Frame]) -> Self {
        let of = |value: fn(&Frame) -> f64| frames.iter().map(value).collect::<Repeats>();
        let (met, gathered) = (
            of(|frame| 1e-3 * rate(frame.met, frame.estimation)),
            of(|frame| 1e-3 * rate(frame.gathered, frame.surfaces)),
        );
        Self {
            scene: scenario.name.into(),
            photons: (scenario.photons / share).into(),
            events: of(|frame| frame.events),
            contributions: of(|frame| frame.met / frame.asked.max(1.0)),
            trace: of(|frame| frame.trace),
            map: of(|frame| frame.map),
            rays: of(|frame| frame.rays),
            estimation: of(|frame| frame.estimation),
            surfaces: of(|frame| frame.surfaces),
            all: of(|frame| frame.all),
            share: of(|frame| (frame.trace + frame.estimation) / (frame.all - frame.surfaces)),
            frames: of(|frame| 1e3 / frame.all),
            traced: of(|frame| rate(frame.emitted, frame.trace)),
            ratio: met.over(&gathered),
            met,
            gathered,
        }
    }
}
