//! Photons and their segments traced per second beside other renderers: Mitsuba 3's particle tracer and LuxCore's photon cache, on exported
//! scenes, in turns.
//!
//! Peers run in processes of their own through `tools/mitsuba/photons.py`, with the Python that has Mitsuba; one that is not there is left out,
//! and a table says so.

use std::path::Path;
use std::process::Command;

use clerestory::atomic;
use clerestory::gpu::Gpu;
use clerestory::scene::Scene;
use clerestory::techniques::photon_mapping::{MapperCounts, PhotonSettings};
use clerestory::{Error, Result, scene};

use super::cases::mapper;
use crate::agreement::python_of_environment;
use crate::experiments::findings::{Bound, Criterion, Findings, Measured, Repeats, Study, geometric_mean, rows};
use crate::experiments::measures::Context;
use crate::experiments::reference::short_name;
use crate::mitsuba::{self, ExportOptions};
use crate::python;
use crate::timing::median;

const SCENES: [&str; 4] = [
    "builtin:cornell-box",
    "builtin:passage",
    "builtin:box-room?mirror=no",
    "builtin:conference",
];
const MITSUBA: &str = "mitsuba";
const LUXCORE: &str = "luxcore";
/// Ours first.
const RENDERERS: [&str; 3] = ["clerestory", MITSUBA, LUXCORE];
const PHOTONS: u32 = 1 << 17;
const SMOKE_PHOTONS: u32 = 1 << 12;
/// Each renderer's turns, and its rounds in each.
const TURNS: usize = 5;
const ROUNDS: u32 = 3;
/// Edges of a light path at most.
const DEPTH: u32 = 8;
/// Of the picture that asks the map: next to nothing.
const SIZE: [u32; 2] = [16, 16];
/// The scripts, the second of which uses the first.
const SCRIPTS: [(&str, &str); 2] = [
    ("reference.py", include_str!("../../../../mitsuba/reference.py")),
    (SCRIPT, include_str!("../../../../mitsuba/photons.py")),
];
const SCRIPT: &str = "photons.py";
const NEEDED: &str = "Mitsuba 3 or pyluxcore; see tools/mitsuba/README.md";

rows! {
    /// A renderer on a scene.
    struct Row = "Photons traced per second" by [scene, renderer] {
        scene: String = "scene",
        renderer: String = "renderer",
        version: String = "version",
        photons: f64 = "photons per round",
        segments: Option<Repeats> = "segments per photon",
        rate: Repeats = "thousand photons/s",
        segment_rate: Option<Repeats> = "thousand segments/s",
        map: Option<Repeats> = "map (ms)",
        ours_over: Repeats = "photons/s, ours over this",
        our_segments_over: Option<Repeats> = "segments/s, ours over this or the most that it can have",
    }
}

rows! {
    /// A renderer that did not trace a scene, or not in all turns.
    struct LeftOut = "Left out" by [scene, renderer] {
        scene: String = "scene",
        renderer: String = "renderer",
        turns: u64 = "turns measured",
        cause: String = "cause",
    }
}

/// What was found.
#[derive(Debug, Default, serde::Serialize, serde::Deserialize)]
pub struct Found {
    rates: Vec<Row>,
    left_out: Vec<LeftOut>,
}

const SMALL_FACTOR: &str =
    "a small factor is half an order of magnitude at most; photons are of different length, segments are the same work";
const CRITERIA: &[Criterion<Row>] = &[
    Criterion::each(
        "segments per second are a third of Mitsuba's or more",
        Bound::AtLeast(1.0 / 3.0),
        Row::segments_over,
    )
    .among(|row| row.renderer == MITSUBA)
    .needs("Mitsuba")
    .because(SMALL_FACTOR),
    Criterion::each(
        "segments per second are a third of LuxCore's or more",
        Bound::AtLeast(1.0 / 3.0),
        Row::segments_over,
    )
    .among(|row| row.renderer == LUXCORE)
    .needs("LuxCore")
    .because(SMALL_FACTOR),
];

/// Medians of the rounds of a renderer's turn.
#[derive(Debug, Clone, Default)]
struct Turn {
    version: String,
    photons: f64,
    /// Photons a second.
    rate: f64,
    /// Closest-hit rays of photons; of a peer its landings, which are no more.
    segments: Option<f64>,
    segment_rate: Option<f64>,
    map_seconds: Option<f64>,
}

impl Turn {
    /// Segments a second; of a renderer that tells none, those of photons that all go on to the end.
    fn most_segments(&self) -> f64 {
        self.segment_rate.unwrap_or(f64::from(DEPTH) * self.rate)
    }
}

/// What the script prints.
#[derive(serde::Deserialize)]
struct Answer {
    version: String,
    photons: Vec<f64>,
    landings: Option<Vec<f64>>,
    trace_seconds: Vec<f64>,
    map_seconds: Option<Vec<f64>>,
}

impl From<Answer> for Turn {
    fn from(answer: Answer) -> Self {
        let rate = |counts: &[f64]| {
            let rates = counts.iter().zip(&answer.trace_seconds);
            median(rates.map(|(count, seconds)| count / seconds).collect())
        };
        // Medians of nothing are no numbers.
        let known = |values: Option<&[f64]>| {
            values
                .map(|values| median(values.to_vec()))
                .filter(|value| !value.is_nan())
        };
        Self {
            photons: median(answer.photons.clone()),
            rate: rate(&answer.photons),
            segments: known(answer.landings.as_deref()),
            segment_rate: answer.landings.as_deref().map(rate).filter(|rate| !rate.is_nan()),
            map_seconds: known(answer.map_seconds.as_deref()),
            version: answer.version,
        }
    }
}

impl Row {
    /// Segments a second, ours over this one's; not a number where ours are not known.
    fn segments_over(&self) -> Measured {
        let ratio = self.our_segments_over.as_ref();
        ratio.map_or(f64::NAN.into(), Repeats::measured)
    }

    /// Of turns of a renderer beside ours, of which it may have left some out; none without any.
    fn of(scene: &str, renderer: &str, turns: &[Option<Turn>], ours: &[Option<Turn>]) -> Option<Self> {
        let both = turns.iter().zip(ours);
        let both: Vec<(&Turn, &Turn)> = both
            .filter_map(|(this, ours)| this.as_ref().zip(ours.as_ref()))
            .collect();
        let (first, _) = both.first()?;
        let known = |of: &dyn Fn(&Turn, &Turn) -> Option<f64>| {
            both.iter()
                .map(|(this, ours)| of(this, ours))
                .collect::<Option<Repeats>>()
        };
        Some(Self {
            scene: scene.into(),
            renderer: renderer.into(),
            version: first.version.clone(),
            photons: first.photons,
            segments: known(&|this, _| Some(this.segments? / this.photons)),
            rate: both.iter().map(|(this, _)| 1e-3 * this.rate).collect(),
            segment_rate: known(&|this, _| Some(1e-3 * this.segment_rate?)),
            map: known(&|this, _| Some(1e3 * this.map_seconds?)),
            ours_over: both.iter().map(|(this, ours)| ours.rate / this.rate).collect(),
            our_segments_over: known(&|this, ours| Some(ours.segment_rate? / this.most_segments())),
        })
    }
}

impl Study for Found {
    fn measure(context: &Context<'_>) -> Result<Self> {
        let gpu = (context.gpu)()?;
        let python = python_of_environment();
        for (name, text) in SCRIPTS {
            atomic::write(&context.file(name)?, text.as_bytes())?;
        }
        let mut left_out = Vec::new();
        let name = |address: &&str| short_name(address).to_owned();
        let rates = context.each(context.first(&SCENES, 1), name, |address| {
            let (rows, others) = renderers(context, &gpu, &python, address)?;
            left_out.extend(others);
            Ok(rows)
        })?;
        Ok(Self { rates, left_out })
    }

    fn findings(&self) -> Findings {
        let mitsubas = self.rates.iter().filter(|row| row.renderer == MITSUBA);
        Findings::of(&self.rates, CRITERIA)
            .headline(
                "segments per second over the most that Mitsuba's photons can have, geometric mean",
                geometric_mean(mitsubas.map(Row::segments_over)),
            )
            .bars(
                "rates",
                "Thousand photons traced per second",
                &self.rates,
                |row| [row.scene.clone(), row.renderer.clone()],
                |row| row.rate.measured(),
            )
            .note(format!(
                "{DEPTH} edges of a light path asked for at most; a turn is the median of {ROUNDS} rounds. Photons of different renderers are of \
                 different length: ours meet Russian roulette at every landing, Mitsuba's from the fifth on and are joined to the camera at every \
                 vertex, by a shadow ray each, LuxCore's go on without roulette. A segment is a ray from one landing to the next; LuxCore tells \
                 landings alone, which are no more than segments, Mitsuba neither: beside it, ours stand against {DEPTH} segments of each of its \
                 photons, the most that they can have. Ours is wall clock of tracing alone; the map is that of kernels, LuxCore's of radiance \
                 photons where the camera sees.",
            ))
            .and(Findings::of(&self.left_out, &[]))
    }
}

/// All renderers on a scene, in turns, and those that were left out. A smoke run has ours alone.
fn renderers(context: &Context<'_>, gpu: &Gpu, python: &Path, address: &str) -> Result<(Vec<Row>, Vec<LeftOut>)> {
    let scene = scene::load(address)?;
    let name = short_name(address);
    let photons = context.pick(PHOTONS, SMOKE_PHOTONS);
    let folder = context.folder.join(name.replace(['?', '='], "-"));
    // Renderers bend directions at smooth surfaces differently, which is nothing to rates.
    let options = ExportOptions { shading_normals: true };
    let exported = mitsuba::export_with(&scene, "", SIZE.map(|side| 4 * side), &folder, options);
    let renderers = context.first(&RENDERERS, 1);
    let mut causes: Vec<Option<String>> = vec![None; renderers.len()];
    let turns = context.in_turns(TURNS, renderers.len(), |i| {
        if i == 0 {
            return trace(gpu, &scene, photons).map(Some);
        }
        if causes[i].is_some() || context.watch.stopped() {
            return Ok(None);
        }
        let answer = match &exported {
            Ok(exported) => ask(context, python, renderers[i], &exported.scene, photons),
            Err(cause) => Err(Error::setting("scene", address, cause.to_string())),
        };
        Ok(answer.unwrap_or_else(|cause| {
            causes[i] = Some(cause.to_string());
            None
        }))
    })?;
    let all = renderers.iter().zip(&turns);
    let rows = all
        .clone()
        .filter_map(|(renderer, of)| Row::of(name, renderer, of, &turns[0]));
    let left_out = all.zip(causes).filter_map(|((renderer, of), cause)| {
        Some(LeftOut {
            scene: name.into(),
            renderer: (*renderer).into(),
            turns: of.iter().flatten().count() as u64,
            cause: cause?,
        })
    });
    Ok((rows.collect(), left_out.collect()))
}

/// A turn of ours: rounds after one that compiles kernels.
fn trace(gpu: &Gpu, scene: &Scene, photons: u32) -> Result<Turn> {
    let settings = PhotonSettings {
        path_set: format!("bounces=0..{DEPTH}").parse()?,
        photons,
        ..PhotonSettings::default()
    };
    let mut mapper = mapper(gpu, scene, SIZE, settings)?;
    let mut before = MapperCounts::default();
    let (mut rays, mut trace_seconds, mut map_seconds) = (Vec::new(), Vec::new(), Vec::new());
    for round in 0..=ROUNDS {
        while mapper.step(round + 1)?.is_some() {}
        let counts = mapper.counts();
        if round > 0 {
            rays.push((counts.photons.rays - before.photons.rays) as f64);
            trace_seconds.push(counts.trace_seconds - before.trace_seconds);
            map_seconds.push(counts.map_seconds - before.map_seconds);
        }
        before = counts;
    }
    Ok(Turn::from(Answer {
        version: env!("CARGO_PKG_VERSION").to_owned(),
        photons: vec![f64::from(photons); rays.len()],
        landings: Some(rays),
        trace_seconds,
        map_seconds: Some(map_seconds),
    }))
}

fn ask(context: &Context<'_>, python: &Path, peer: &str, scene: &Path, photons: u32) -> Result<Option<Turn>> {
    let mut command = Command::new(python);
    command
        .arg(context.folder.join(SCRIPT))
        .args([peer.as_ref(), scene.as_os_str()])
        .args(["--photons", &photons.to_string()])
        .args(["--rounds", &ROUNDS.to_string()])
        .args(["--depth", &DEPTH.to_string()]);
    let Some(text) = python::run(python, &mut command, NEEDED, context.watch)? else {
        return Ok(None);
    };
    let answer = serde_json::from_str::<Answer>(&text);
    answer
        .map(|answer| Some(answer.into()))
        .map_err(|cause| Error::setting(peer, text, cause.to_string()))
}
