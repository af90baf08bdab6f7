//! What a frame of photon mapping costs when the light moves: milliseconds of photons, of their map and of the picture, and rates of each.
//!
//! Source of the comparison: "Interactive Manycore Photon Mapping", PhD thesis, Trinity College Dublin, 2011, §6.3 and Table 6.6, on a GPU of
//! its time. Its figures stand beside ours.

use std::time::Instant;

use clerestory::gpu::{Gpu, Timings};
use clerestory::scene::{LightKind, Scene};
use clerestory::techniques::photon_mapping::kernel::KernelProfile;
use clerestory::techniques::photon_mapping::{PhotonMapper, PhotonSettings};
use clerestory::{Result, scene};
use glam::Vec3;

use super::cases::{CASES, Case, mapper};
use super::map_builds;
use crate::experiments::measures::Context;
use crate::experiments::table::{Cell, Table};
use crate::timing::{Spread, median};

const SIZE: [u32; 2] = [128, 96];
const SMOKE_SIZE: [u32; 2] = [16, 12];
/// Frames that count, after one that compiles kernels.
const FRAMES: u32 = 5;
const SMOKE_FRAMES: u32 = 2;
/// Scenes of the smoke form.
const SMOKE_SCENES: [&str; 1] = ["Passage"];
/// The light's way in a frame: 3 cm an axis, away from ceilings.
const STEP: Vec3 = Vec3::new(0.03, -0.03, 0.03);
/// How passes of photons are called, those of their map, and that of queries among the eye's.
const PHOTON_PASSES: &str = "photon: ";
const MAP_PASSES: &str = "map: ";
const GATHER_PASSES: &str = "photon: gather";

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

/// The measure.
pub fn measure(context: &Context<'_>) -> Result<Vec<Table>> {
    let gpu = (context.gpu)()?;
    let mut table = frames_table();
    let mut rates = rates_table();
    let mut maps = map_builds::table();
    let cases: Vec<(&Case, KernelProfile, &str)> = CASES
        .iter()
        .map(|case| (case, KernelProfile::Uniform, ""))
        .chain(
            CASES
                .last()
                .map(|ring| (ring, KernelProfile::Epanechnikov, ", Epanechnikov")),
        )
        .filter(|(case, ..)| !context.smoke || SMOKE_SCENES.contains(&case.published.name))
        .collect();
    for (done, (case, profile, word)) in cases.iter().enumerate() {
        if context.watch.stopped() {
            break;
        }
        let name = format!("{}{word}", case.name());
        context.watch.begin(&name, done, cases.len());
        let settings = PhotonSettings {
            profile: *profile,
            ..case.settings(context.smoke)?
        };
        let frames = frames(context, &gpu, case, &settings)?;
        table.row(frames_row(&name, case, &frames));
        rates.row(rates_row(&name, &frames));
        if word.is_empty() {
            maps.row(map_builds::row(
                context,
                &gpu,
                case,
                if context.smoke { SMOKE_SIZE } else { SIZE },
            )?);
        }
    }
    map_builds::note(&mut maps, context.smoke);
    let size = if context.smoke { SMOKE_SIZE } else { SIZE };
    table.note(format!(
        "{} × {} pixels, one sample each, direct light by shadow rays; medians of {} frames, the lamp 3 cm further along each axis in each. Photons, map and \
         kernels are those of the frame alone. Trace and render are GPU times; the map's are those of its passes, with the host's share, or of the host with copies where the device cannot build it. A frame is wall clock without the \
         upload of the moved scene and the memory for its light.",
        size[0],
        size[1],
        if context.smoke { SMOKE_FRAMES } else { FRAMES },
    ));
    table.note("Source: 512 × 512 pixels at most, on a GPU of 2008; the last row's kernel is Epanechnikov's, 1 % slower there.");
    rates.note("Of the same frames: the stage's count over its time; median, least and greatest.");
    Ok(vec![table, rates, maps])
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

fn frames(context: &Context<'_>, gpu: &Gpu, case: &Case, settings: &PhotonSettings) -> Result<Vec<Frame>> {
    let (size, count) = if context.smoke {
        (SMOKE_SIZE, SMOKE_FRAMES)
    } else {
        (SIZE, FRAMES)
    };
    let mut moving = scene::load(case.scene)?;
    let mut frames = Vec::new();
    // Kept until the next one stands, so that kernels are compiled once.
    let mut _earlier = None;
    for number in 0..=count {
        let mut mapper = mapper(gpu, &moving, size, settings.clone())?;
        let frame = frame(&mut mapper)?;
        _earlier = Some(mapper);
        if number > 0 {
            frames.push(frame);
        }
        move_lights(&mut moving, STEP);
    }
    Ok(frames)
}

fn frame(mapper: &mut PhotonMapper) -> Result<Frame> {
    let mut frame = Frame::default();
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

impl Frame {
    fn add(&mut self, timings: &Timings) {
        for pass in &timings.passes {
            let milliseconds = pass.nanoseconds.unwrap_or(0) as f64 * 1e-6;
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

fn frames_table() -> Table {
    Table::new(
        "A frame with a moving light",
        &[
            "scene",
            "counterpart",
            "interactions",
            "k, contributions a query",
            "trace (ms)",
            "map (ms)",
            "render (ms)",
            "queries' share of it (ms)",
            "frame (ms)",
            "frames a second",
            "source: trace (ms)",
            "source: map (ms)",
            "source: render (ms)",
            "source: frames a second",
        ],
    )
}

fn frames_row(name: &str, case: &Case, frames: &[Frame]) -> Vec<Cell> {
    let of = |field: fn(&Frame) -> f64| median(frames.iter().map(field).collect());
    let [trace, map, render, rate] = case.published.frame;
    vec![
        name.into(),
        case.published.name.into(),
        of(|f| f.interactions).into(),
        of(|f| f.gathered / f.queries.max(1.0)).into(),
        of(|f| f.trace).into(),
        of(|f| f.map).into(),
        of(|f| f.render).into(),
        of(|f| f.gather).into(),
        of(|f| f.all).into(),
        of(|f| 1e3 / f.all).into(),
        trace.into(),
        map.into(),
        render.into(),
        rate.into(),
    ]
}

fn rates_table() -> Table {
    Table::new(
        "Rates of the stages",
        &[
            "scene",
            "thousand photons traced a second",
            "least … greatest",
            "million photons gathered a second",
            "least … greatest",
            "thousand kernels built into a map a second",
            "least … greatest",
        ],
    )
}

fn rates_row(name: &str, frames: &[Frame]) -> Vec<Cell> {
    let rates: [fn(&Frame) -> f64; 3] = [
        |f| rate(f.emitted, f.trace),
        |f| rate(f.gathered, f.gather) * 1e-3,
        |f| rate(f.records, f.map),
    ];
    let mut row: Vec<Cell> = vec![name.into()];
    for rate in rates {
        let spread = Spread::of(frames.iter().map(rate).collect());
        let range = [spread.least, spread.greatest].map(|value| Cell::Number(value).to_string());
        row.extend([spread.median.into(), range.join(" … ").into()]);
    }
    row
}

/// Thousands a second.
fn rate(count: f64, milliseconds: f64) -> f64 {
    if milliseconds > 0.0 { count / milliseconds } else { 0.0 }
}
