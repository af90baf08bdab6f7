//! What a frame of photon mapping costs when the light moves: milliseconds of photons, of their map and of the picture, and rates of each.
//!
//! Source of the comparison: B. Fabianowski, "Interactive Manycore Photon Mapping", PhD thesis, Trinity College Dublin, 2011, §6.3 and Table 6.6, on a GPU of
//! its time. Its figures stand beside ours.

use std::time::Instant;

use clerestory::gpu::{Gpu, Timings};
use clerestory::scene::{LightKind, Scene};
use clerestory::techniques::photon_mapping::kernel::KernelProfile;
use clerestory::techniques::photon_mapping::{PhotonMapper, PhotonSettings};
use clerestory::{Result, scene};
use glam::Vec3;

use super::cases::{Case, cases, mapper, published};
use super::frames::{PHOTON_PASSES, STEP, milliseconds, rate};
use super::map_builds;
use crate::experiments::findings::{Bound, Criterion, Findings, Repeats, Study, geometric_mean, rows};
use crate::experiments::measures::Context;

/// Pixels, and frames that count, after one that compiles kernels.
const FULL: ([u32; 2], u32) = ([128, 96], 5);
const SMOKE: ([u32; 2], u32) = ([16, 12], 2);
/// Counterparts of the scenes of a smoke run.
const SMOKE_CASES: &[&str] = &["Passage"];
/// The counterpart of the scene that has the other profile too.
const OF_BOTH_PROFILES: &str = "Ring";
/// How passes of photons' map are called, and that of queries among the eye's.
const MAP_PASSES: &str = "map: ";
const GATHER_PASSES: &str = "photon: gather";

rows! {
    /// A scene's frames.
    struct Row = "A frame with a moving light" by [scene, profile] {
        scene: String = "scene",
        profile: String = "kernels' profile",
        counterpart: String = "counterpart",
        interactions: Repeats = "interactions",
        contributions: Repeats = "k, contributions per query",
        trace: Repeats = "trace (ms)",
        map: Repeats = "map (ms)",
        render: Repeats = "render (ms)",
        gather: Repeats = "queries' share of it (ms)",
        all: Repeats = "frame (ms)",
        share: Repeats = "queries' share of the frame",
        frames: Repeats = "frames/s",
        traced: Repeats = "thousand photons traced/s",
        gathered: Repeats = "million photons gathered/s",
        built: Repeats = "thousand kernels built into a map/s",
    }
    beside "source: trace (ms)" = |row| published(&row.counterpart).map(|source| source.frame[0]).into();
    beside "source: map (ms)" = |row| published(&row.counterpart).map(|source| source.frame[1]).into();
    beside "source: render (ms)" = |row| published(&row.counterpart).map(|source| source.frame[2]).into();
    beside "source: frames/s" = |row| published(&row.counterpart).map(|source| source.frame[3]).into();
}

/// What was found.
#[derive(Debug, Default, serde::Serialize, serde::Deserialize)]
pub struct Found {
    frames: Vec<Row>,
    maps: map_builds::Found,
}

const CRITERIA: &[Criterion<Row>] = &[Criterion::each(
    "queries take most of the frame: their share",
    Bound::AtLeast(0.5),
    |row: &Row| (&row.share).into(),
)
.because("most is more than half")];

impl Study for Found {
    fn measure(context: &Context<'_>) -> Result<Self> {
        let gpu = (context.gpu)()?;
        let (size, count) = context.pick(FULL, SMOKE);
        let cases = cases(context, SMOKE_CASES);
        let uniform = cases.iter().map(|case| (*case, KernelProfile::Uniform));
        let other = cases.iter().filter(|case| case.published.name == OF_BOTH_PROFILES);
        let other = other.map(|case| (*case, KernelProfile::Epanechnikov));
        let all: Vec<(&Case, KernelProfile)> = uniform.chain(other).collect();
        let name = |(case, profile): &(&Case, KernelProfile)| format!("{}, {}", case.name(), word(*profile));
        let frames = context.each(&all, name, |(case, profile)| {
            let settings = PhotonSettings {
                profile: *profile,
                ..case.settings(context.smoke)?
            };
            let frames = frames(&gpu, case, &settings, size, count)?;
            Ok(vec![Row::of(case, *profile, &frames)])
        })?;
        let maps = map_builds::Found::measure(context, &gpu, &cases, size)?;
        Ok(Self { frames, maps })
    }

    fn findings(&self) -> Findings {
        let rates = self.frames.iter().map(|row| row.frames.measured());
        Findings::of(&self.frames, CRITERIA)
            .headline("frames per second, geometric mean of the scenes", geometric_mean(rates))
            .stacked_bars(
                "frame",
                "Milliseconds of a frame with a moving light, medians",
                &self.frames,
                |row| format!("{}, {}", row.scene, row.profile),
                &[
                    ("photons", |row: &Row| row.trace.measured().value),
                    ("map", |row: &Row| row.map.measured().value),
                    ("queries", |row: &Row| row.gather.measured().value),
                    ("rest of the picture", |row: &Row| {
                        row.render.measured().value - row.gather.measured().value
                    }),
                ],
            )
            .note(format!(
                "{} × {} pixels, one sample each, direct light by shadow rays; {} frames, the lamp 3 cm further along each axis in each, so that \
                 intervals hold what the light's place changes too. Photons, map and kernels are those of the frame alone. Trace and render are \
                 GPU times; the map's are those of its passes, with the host's share, or of the host with copies where the device cannot build \
                 it. A frame is wall clock without the upload of the moved scene and the memory for its light.",
                FULL.0[0], FULL.0[1], FULL.1,
            ))
            .note(
                "Source: 512 × 512 pixels at most, on a GPU of 2008; Epanechnikov's kernel is 1 % slower there. Rates are the stage's count over \
                 its time.",
            )
            .and(self.maps.findings())
    }
}

fn word(profile: KernelProfile) -> String {
    format!("{profile:?}")
}

/// Moves every light: lamps, and meshes that shine.
fn move_lights(scene: &mut Scene, offset: Vec3) {
    for light in &mut scene.lights {
        match &mut light.kind {
            LightKind::Point { position, .. } | LightKind::Spot { position, .. } => *position += offset,
            LightKind::Directional { .. } => {}
        }
    }
    let shines: Vec<bool> = scene.materials.iter().map(|m| m.emission.max_element() > 0.0).collect();
    for mesh in &mut scene.meshes {
        let material = mesh.material.and_then(|material| shines.get(material as usize));
        if material.is_some_and(|shines| *shines) {
            mesh.positions.iter_mut().for_each(|position| *position += offset);
        }
    }
}

/// Frames that count.
fn frames(gpu: &Gpu, case: &Case, settings: &PhotonSettings, size: [u32; 2], count: u32) -> Result<Vec<Frame>> {
    let mut moving = scene::load(case.scene)?;
    let mut frames = Vec::new();
    // Kept until the next one stands, so that kernels are compiled once.
    let mut _earlier = None;
    for number in 0..=count {
        let mut mapper = mapper(gpu, &moving, size, settings.clone())?;
        let frame = Frame::of(&mut mapper)?;
        _earlier = Some(mapper);
        if number > 0 {
            frames.push(frame);
        }
        move_lights(&mut moving, STEP);
    }
    Ok(frames)
}

/// Milliseconds and counts of one frame.
#[derive(Debug, Clone, Copy, Default)]
struct Frame {
    trace: f64,
    map: f64,
    gather: f64,
    render: f64,
    /// By wall clock: all of it, with the host's share.
    all: f64,
    emitted: f64,
    interactions: f64,
    records: f64,
    gathered: f64,
    queries: f64,
}

impl Frame {
    fn of(mapper: &mut PhotonMapper) -> Result<Self> {
        let mut frame = Self::default();
        let clock = Instant::now();
        while let Some(step) = mapper.step(1)? {
            step.timings.iter().for_each(|timings| frame.add(timings));
        }
        frame.all = 1e3 * clock.elapsed().as_secs_f64();
        let counts = mapper.counts();
        frame.map = 1e3 * counts.map_seconds;
        frame.emitted = counts.photons.emitted as f64;
        frame.interactions = counts.photons.deposits as f64;
        frame.records = counts.records as f64;
        frame.gathered = counts.gather.photons as f64;
        frame.queries = counts.gather.queries as f64;
        Ok(frame)
    }

    fn add(&mut self, timings: &Timings) {
        for pass in &timings.passes {
            let milliseconds = milliseconds(pass);
            if pass.name.starts_with(GATHER_PASSES) {
                self.gather += milliseconds;
                self.render += milliseconds;
            } else if pass.name.starts_with(PHOTON_PASSES) {
                self.trace += milliseconds;
            } else if !pass.name.starts_with(MAP_PASSES) {
                self.render += milliseconds;
            }
        }
    }
}

impl Row {
    fn of(case: &Case, profile: KernelProfile, frames: &[Frame]) -> Self {
        let of = |value: fn(&Frame) -> f64| frames.iter().map(value).collect::<Repeats>();
        Self {
            scene: case.name().into(),
            profile: word(profile),
            counterpart: case.published.name.into(),
            interactions: of(|frame| frame.interactions),
            contributions: of(|frame| frame.gathered / frame.queries.max(1.0)),
            trace: of(|frame| frame.trace),
            map: of(|frame| frame.map),
            render: of(|frame| frame.render),
            gather: of(|frame| frame.gather),
            all: of(|frame| frame.all),
            share: of(|frame| frame.gather / frame.all),
            frames: of(|frame| 1e3 / frame.all),
            traced: of(|frame| rate(frame.emitted, frame.trace)),
            gathered: of(|frame| 1e-3 * rate(frame.gathered, frame.gather)),
            built: of(|frame| rate(frame.records, frame.map)),
        }
    }
}
