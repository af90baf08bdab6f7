//! Photons traced a second beside other renderers: Mitsuba 3's particle tracer and LuxCore's photon cache, on exported scenes, in turns.
//!
//! Peers run in processes of their own through `tools/mitsuba/photons.py`, with the Python that has Mitsuba; one that is not there is left out,
//! and the table says so.

use std::path::{Path, PathBuf};
use std::process::Command;

use clerestory::film::atomic;
use clerestory::gpu::Gpu;
use clerestory::scene::Scene;
use clerestory::techniques::photon_mapping::{MapperCounts, PhotonSettings};
use clerestory::{Error, Result, scene};

use super::cases::mapper;
use crate::agreement::PYTHON_VARIABLE;
use crate::experiments::measures::Context;
use crate::experiments::table::{Cell, Table};
use crate::mitsuba::{self, ExportOptions};
use crate::python;
use crate::timing::{Spread, median};

const SCENES: [&str; 4] = [
    "builtin:cornell-box",
    "builtin:passage",
    "builtin:box-room?mirror=no",
    "builtin:conference",
];
const SMOKE_SCENES: usize = 1;
const PEERS: [&str; 2] = ["mitsuba", "luxcore"];
const PHOTONS: u32 = 1 << 17;
const SMOKE_PHOTONS: u32 = 1 << 12;
/// Each renderer's turns, and its rounds in each.
const TURNS: u32 = 3;
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

/// What a renderer's turns gave, by round.
#[derive(Default)]
struct Turns {
    version: String,
    photons: Vec<f64>,
    /// Closest-hit rays of photons; of a peer its landings, which are no more.
    segments: Vec<f64>,
    trace: Vec<f64>,
    map: Vec<f64>,
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

/// The measure.
pub fn measure(context: &Context<'_>) -> Result<Vec<Table>> {
    let gpu = (context.gpu)()?;
    let python: PathBuf = std::env::var_os(PYTHON_VARIABLE).map_or_else(|| "python3".into(), PathBuf::from);
    for (name, text) in SCRIPTS {
        atomic::write(&context.file(name)?, text.as_bytes())?;
    }
    let scenes = if context.smoke {
        &SCENES[..SMOKE_SCENES]
    } else {
        &SCENES[..]
    };
    let mut table = Table::new(
        "Photons traced a second",
        &[
            "scene",
            "renderer",
            "photons",
            "segments a photon",
            "thousand photons a second",
            "least … greatest",
            "thousand segments a second",
            "map (ms)",
            "photons a second, of ours",
            "segments a second, of ours",
        ],
    );
    for (done, address) in scenes.iter().enumerate() {
        if context.watch.stopped() {
            break;
        }
        context.watch.begin(address, done, scenes.len());
        rows(context, &gpu, &python, address, &mut table)?;
    }
    table.note(format!(
        "{PHOTONS} photons a round, {DEPTH} edges of a light path asked for at most, every renderer in {TURNS} turns of {ROUNDS} rounds; medians. Photons \
         of different renderers are of different length: ours meet Russian roulette at every landing, Mitsuba's from the fifth on and are joined to the \
         camera at every vertex, by a shadow ray each, LuxCore's go on without roulette. A segment is a ray from one landing to the next; LuxCore tells \
         landings alone, which are no more than segments, Mitsuba neither. Ours is wall clock of tracing alone; the map is that of kernels, LuxCore's of \
         radiance photons where the camera sees.",
    ));
    Ok(vec![table])
}

fn rows(context: &Context<'_>, gpu: &Gpu, python: &Path, address: &str, table: &mut Table) -> Result<()> {
    let scene = scene::load(address)?;
    let name = address.trim_start_matches("builtin:");
    let photons = if context.smoke { SMOKE_PHOTONS } else { PHOTONS };
    let turns = if context.smoke { 1 } else { TURNS };
    let folder = context.folder.join(name.replace(['?', '='], "-"));
    // Renderers bend directions at smooth surfaces differently, which is nothing to rates.
    let options = ExportOptions { shading_normals: true };
    let exported = mitsuba::export_with(&scene, "", SIZE.map(|side| 4 * side), &folder, options);
    let mut ours = Turns {
        version: "clerestory".into(),
        ..Turns::default()
    };
    let mut peers = PEERS.map(|_| Turns::default());
    let mut left_out = [const { None }; PEERS.len()];
    for _ in 0..turns {
        trace(gpu, &scene, photons, &mut ours)?;
        for (index, peer) in PEERS.iter().enumerate().filter(|_| !context.smoke) {
            if left_out[index].is_some() || context.watch.stopped() {
                continue;
            }
            let answer = match &exported {
                Ok(exported) => ask(context, python, peer, &exported.scene, photons),
                Err(cause) => Err(Error::setting("scene", address, cause.to_string())),
            };
            match answer {
                Ok(Some(answer)) => peers[index].add(answer),
                Ok(None) => {}
                Err(cause) => left_out[index] = Some(cause),
            }
        }
    }
    let our_rates = ours.rates();
    table.row(ours.row(name, our_rates));
    for (index, peer) in PEERS.iter().enumerate() {
        if let Some(cause) = &left_out[index] {
            let what = if peers[index].trace.is_empty() {
                "not measured"
            } else {
                "in some turns only"
            };
            table.note(format!("{name}, {peer}: {what}: {cause}"));
        }
        if !peers[index].trace.is_empty() {
            table.row(peers[index].row(name, our_rates));
        }
    }
    Ok(())
}

/// A turn of ours: rounds after one that compiles kernels.
fn trace(gpu: &Gpu, scene: &Scene, photons: u32, turns: &mut Turns) -> Result<()> {
    let settings = PhotonSettings {
        path_set: format!("bounces=0..{DEPTH}").parse()?,
        photons,
        ..PhotonSettings::default()
    };
    let mut mapper = mapper(gpu, scene, SIZE, settings)?;
    let mut before = MapperCounts::default();
    for round in 0..=ROUNDS {
        while mapper.step(round + 1)?.is_some() {}
        let counts = mapper.counts();
        if round > 0 {
            turns.photons.push(f64::from(photons));
            turns.segments.push((counts.photons.rays - before.photons.rays) as f64);
            turns.trace.push(counts.trace_seconds - before.trace_seconds);
            turns.map.push(counts.map_seconds - before.map_seconds);
        }
        before = counts;
    }
    Ok(())
}

fn ask(context: &Context<'_>, python: &Path, peer: &str, scene: &Path, photons: u32) -> Result<Option<Answer>> {
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
    let answer = serde_json::from_str(&text);
    answer
        .map(Some)
        .map_err(|cause| Error::setting(peer, text, cause.to_string()))
}

impl Turns {
    fn add(&mut self, answer: Answer) {
        self.version = answer.version;
        self.photons.extend(answer.photons);
        self.segments.extend(answer.landings.unwrap_or_default());
        self.trace.extend(answer.trace_seconds);
        self.map.extend(answer.map_seconds.unwrap_or_default());
    }

    /// Thousands of `counts` a second.
    fn rate(&self, counts: &[f64]) -> Spread {
        let rate = |(count, seconds): (&f64, &f64)| 1e-3 * count / seconds;
        Spread::of(counts.iter().zip(&self.trace).map(rate).collect())
    }

    /// Of photons and of segments, medians.
    fn rates(&self) -> [f64; 2] {
        [&self.photons, &self.segments].map(|counts| self.rate(counts).median)
    }

    fn row(&self, scene: &str, ours: [f64; 2]) -> Vec<Cell> {
        // Medians of nothing are no numbers.
        let known = |value: f64| {
            if value.is_nan() {
                Cell::from("unknown")
            } else {
                value.into()
            }
        };
        let spread = self.rate(&self.photons);
        let range = [spread.least, spread.greatest].map(|value| Cell::Number(value).to_string());
        let [photons, segments] = self.rates();
        vec![
            scene.into(),
            self.version.as_str().into(),
            median(self.photons.clone()).into(),
            known(median(self.segments.clone()) / median(self.photons.clone())),
            photons.into(),
            range.join(" … ").into(),
            known(segments),
            known(1e3 * median(self.map.clone())),
            (photons / ours[0]).into(),
            known(segments / ours[1]),
        ]
    }
}
