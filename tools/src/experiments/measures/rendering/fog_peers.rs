//! Photons and paths in fog beside LuxCore's bidirectional paths and its path tracer: means, and time to equal error, on exported scenes of which one has a volumetric caustic of a small lamp.
//!
//! LuxCore runs in a process of its own through `tools/mitsuba/bidirectional.py`, with the Python that has it; where there is none, a table says so. Means say whether its
//! bidirectional paths can be a reference in fog, where no path from the eye finds a small lamp behind glass. Errors are those of the spread between pictures, each about its own renderer's
//! mean, so that neither the blur of photons' kernels nor what another renderer models otherwise is part of them.

use std::path::Path;

use clerestory::gpu::Gpu;
use clerestory::render::{RenderOptions, Renderer};
use clerestory::{Error, Result, atomic, scene};
use serde_json::{Value, json};

use super::peers::{Asked, Contender, LUXCORE_SCRIPTS, Turn, luxcore_turn, our_turn};
use crate::agreement::python_of_environment;
use crate::experiments::findings::{Bound, Criterion, Findings, Measured, Repeats, Study, rows};
use crate::experiments::measures::Context;
use crate::experiments::reference::{short_name, slug};
use crate::mitsuba::{self, ExportOptions, Exported};

const CAUSTIC: &str = "builtin:fog-box?sphere=glass&boxes=none&lamp=0.1";
const SCENES: [&str; 3] = [
    "builtin:fog-box?boxes=none",
    "builtin:fog-box?sphere=glass&boxes=none",
    CAUSTIC,
];
const SIDE: u32 = 32;
const SMOKE_SIDE: u32 = 8;
/// Of a pass.
const PHOTONS: u32 = 1 << 15;
const SMOKE_PHOTONS: u32 = 1 << 9;
/// Each renderer's turns, and its pictures in each.
const TURNS: usize = 5;
const PICTURES: u32 = 3;
const SMOKE_PICTURES: u32 = 2;
/// Edges of a bidirectional path from either end at most: of all light that goes farther, next to nothing is seen.
const EDGES: &str = "16";
/// As many edges in all.
const PATH_EDGES: &str = "32";

/// Of ours: the name in tables, the technique, the estimate in media, and samples per pixel of a picture, which of photons are passes; the same of a smoke run.
struct Ours {
    name: &'static str,
    technique: &'static str,
    volume: Option<&'static str>,
    samples: [u32; 2],
}

const OURS: [Ours; 4] = [
    Ours {
        name: OUR_PATHS,
        technique: "path",
        volume: None,
        samples: [256, 4],
    },
    Ours {
        name: "photons, beam estimate",
        technique: "photon",
        volume: Some("ray"),
        samples: [4, 1],
    },
    Ours {
        name: "photon beams",
        technique: "photon",
        volume: Some("beams"),
        samples: [4, 1],
    },
    Ours {
        name: "photons, both",
        technique: "photon",
        volume: Some("unified"),
        samples: [4, 1],
    },
];
const OUR_PATHS: &str = "path tracer";

/// Of LuxCore: the name in tables, the engine, its samples per pixel, and the edges of a path at most.
struct Theirs {
    name: &'static str,
    engine: &'static str,
    samples: u32,
    edges: &'static str,
}

const THEIRS: [Theirs; 2] = [
    Theirs {
        name: THEIR_PATHS,
        engine: "PATHCPU",
        samples: 64,
        edges: PATH_EDGES,
    },
    Theirs {
        name: BIDIRECTIONAL,
        engine: "BIDIRCPU",
        samples: 16,
        edges: EDGES,
    },
];
const THEIR_PATHS: &str = "LuxCore's path tracer";
const BIDIRECTIONAL: &str = "LuxCore's bidirectional paths";

rows! {
    /// A renderer on a scene.
    struct Brightness = "Means of pictures" by [scene, renderer] {
        scene: String = "scene",
        renderer: String = "renderer",
        version: String = "version",
        mean: f64 = "mean (W m⁻² sr⁻¹)",
        over: Measured = "over our path tracer's",
        error: Measured = "relative MSE of a picture",
        seconds: Repeats = "a picture (s)",
    }
}
rows! {
    /// A technique of ours and an engine of LuxCore's on a scene.
    struct Row = "Time to equal error" by [scene, technique, peer] {
        scene: String = "scene",
        technique: String = "our technique",
        peer: String = "beside",
        over: Measured = "its time to equal error over ours",
    }
}
rows! {
    /// A scene that LuxCore did not render.
    struct LeftOut = "Left out" by [scene, renderer] {
        scene: String = "scene",
        renderer: String = "renderer",
        cause: String = "cause",
    }
}

/// What was found.
#[derive(Debug, Default, serde::Serialize, serde::Deserialize)]
pub struct Found {
    means: Vec<Brightness>,
    rows: Vec<Row>,
    left_out: Vec<LeftOut>,
}

/// A reference must be nearer than the bias that is allowed to what it judges.
const OF_A_REFERENCE: Bound = Bound::Between(0.99, 1.01);

const OF_MEANS: &[Criterion<Brightness>] = &[
    Criterion::each(
        "LuxCore's path tracer has our path tracer's mean: ratio",
        OF_A_REFERENCE,
        |row: &Brightness| row.over,
    )
    .among(|row| row.renderer == THEIR_PATHS && row.scene != short_name(CAUSTIC))
    .because("the bias that estimates of photons may have is 1 %, and a reference has none; where a small lamp makes a caustic neither path tracer converges")
    .needs("LuxCore"),
    Criterion::each(
        "LuxCore's bidirectional paths have our path tracer's mean and can be a reference: ratio",
        OF_A_REFERENCE,
        |row: &Brightness| row.over,
    )
    .among(|row| row.renderer == BIDIRECTIONAL && row.scene != short_name(CAUSTIC))
    .because("as of its path tracer")
    .needs("LuxCore"),
];

const CRITERIA: &[Criterion<Row>] = &[Criterion::each(
    "a small lamp's caustic takes LuxCore ten times as long as photons",
    Bound::AtLeast(10.0),
    |row: &Row| row.over,
)
.among(|row| row.scene == short_name(CAUSTIC) && row.technique != OUR_PATHS)
.because("the tenth of other renderers' time to equal error that is wanted of photons there")
.needs("LuxCore")];

impl Study for Found {
    fn measure(context: &Context<'_>) -> Result<Self> {
        let gpu = (context.gpu)()?;
        let python = python_of_environment();
        for (name, text) in LUXCORE_SCRIPTS {
            atomic::write(&context.file(name)?, text.as_bytes())?;
        }
        let mut found = Self::default();
        let name = |address: &&str| short_name(address).to_owned();
        found.means = context.each(context.first(&SCENES, 1), name, |address| {
            let of_scene = of_scene(context, &gpu, &python, address)?;
            found.rows.extend(of_scene.rows);
            found.left_out.extend(of_scene.left_out);
            Ok(of_scene.means)
        })?;
        Ok(found)
    }

    fn findings(&self) -> Findings {
        Findings::of(&self.means, OF_MEANS)
            .note(format!(
                "{SIDE} × {SIDE} pixels, {TURNS} turns of {PICTURES} pictures, {PHOTONS} photons a pass. LuxCore renders without roulette, whose survival is in the weights of some connections and not in \
                 those of others, so that its bidirectional paths are too bright with it. They follow light and eye over at most {EDGES} edges each, its path tracer over {PATH_EDGES}. In fog their \
                 weights, and what they splat to the camera, take the direction in which light came for a normal: they lose light."
            ))
            .and(Findings::of(&self.rows, CRITERIA).note(
                "Relative MSE by the spread between pictures, each about its own renderer's mean. LuxCore's seconds have its preparation of a picture, ours those of a technique on a scene that is on the device.",
            ))
            .and(Findings::of(&self.left_out, &[]))
    }
}

/// All renderers in turns, and what LuxCore is missing for. A smoke run has ours alone.
fn of_scene(context: &Context<'_>, gpu: &Gpu, python: &Path, address: &str) -> Result<Found> {
    let scene = scene::load(address)?;
    let name = short_name(address);
    let side = context.pick(SIDE, SMOKE_SIDE);
    let folder = context.folder.join(slug(address));
    let exported = mitsuba::export_with(&scene, "", [side; 2], &folder, ExportOptions { shading_normals: true });
    let renderer = Renderer::new(gpu, &scene)?;
    let mut causes: [Option<String>; THEIRS.len()] = Default::default();
    let mut versions: [String; THEIRS.len()] = Default::default();
    let mut seed = 0;
    let contenders = OURS.len() + context.pick(THEIRS.len(), 0);
    let turns = context.in_turns(TURNS, contenders, |i| {
        seed += PICTURES + 1;
        let Some(peer) = i.checked_sub(OURS.len()) else {
            let pictures = context.pick(PICTURES, SMOKE_PICTURES);
            let (turn, _) = our_turn(&renderer, &options(context, &OURS[i], seed), pictures)?;
            return Ok(turn);
        };
        if causes[peer].is_some() || context.watch.stopped() {
            return Ok(Turn::new());
        }
        Ok(
            match their_turn(context, python, exported.as_ref(), &THEIRS[peer], seed) {
                Ok((turn, version)) => {
                    versions[peer] = version;
                    turn
                }
                Err(cause) => {
                    causes[peer] = Some(cause.to_string());
                    Turn::new()
                }
            },
        )
    })?;
    let all: Vec<Option<Contender>> = turns.into_iter().map(Contender::of).collect();
    let contender = |i: usize| all.get(i).and_then(Option::as_ref);
    let mut found = Found::default();
    let mut add_mean = |renderer: &str, version: &str, one: Option<&Contender>| {
        if let (Some(one), Some(paths)) = (one, contender(0)) {
            found.means.push(Brightness {
                scene: name.into(),
                renderer: renderer.into(),
                version: version.into(),
                mean: one.mean,
                over: one.brightness_over(paths),
                error: one.error,
                seconds: one.seconds.clone(),
            });
        }
    };
    for (i, ours) in OURS.iter().enumerate() {
        add_mean(
            ours.name,
            concat!("Clerestory ", env!("CARGO_PKG_VERSION")),
            contender(i),
        );
    }
    for (peer, theirs) in THEIRS.iter().enumerate() {
        add_mean(theirs.name, &versions[peer], contender(OURS.len() + peer));
    }
    for (peer, theirs) in THEIRS.iter().enumerate() {
        let missing = match (&causes[peer], contender(OURS.len() + peer)) {
            (Some(cause), _) => cause.clone(),
            (None, None) if context.smoke => "smoke runs have ours alone".into(),
            (None, None) => "it was stopped before there were pictures enough".into(),
            (None, Some(beside)) => {
                let rows = OURS.iter().enumerate().filter_map(|(i, ours)| {
                    Some(Row {
                        scene: name.into(),
                        technique: ours.name.into(),
                        peer: theirs.name.into(),
                        over: contender(i)?.time_of(beside),
                    })
                });
                found.rows.extend(rows);
                continue;
            }
        };
        found.left_out.push(LeftOut {
            scene: name.into(),
            renderer: theirs.name.into(),
            cause: missing,
        });
    }
    Ok(found)
}

fn options(context: &Context<'_>, ours: &Ours, seed: u32) -> RenderOptions {
    let settings: Value = match ours.volume {
        Some(volume) => json!({ "volume": volume, "photons": context.pick(PHOTONS, SMOKE_PHOTONS) }),
        None => json!({ "sampler": "pcg" }),
    };
    RenderOptions {
        technique: Some(ours.technique.into()),
        size: [context.pick(SIDE, SMOKE_SIDE); 2],
        spp: context.pick(ours.samples[0], ours.samples[1]),
        seed,
        settings: settings.into(),
        ..RenderOptions::default()
    }
}

/// A turn of an engine of LuxCore's, and its version; the cause where the scene could not be exported.
fn their_turn(
    context: &Context<'_>,
    python: &Path,
    exported: std::result::Result<&Exported, &Error>,
    theirs: &Theirs,
    seed: u32,
) -> Result<(Turn, String)> {
    let exported = exported.map_err(|cause| Error::setting("scene", "exported", cause.to_string()))?;
    let asked = Asked {
        python,
        engine: theirs.engine,
        scene: &exported.scene,
        side: context.pick(SIDE, SMOKE_SIDE),
        samples: theirs.samples,
        pictures: PICTURES,
        further: &["--clear", "--no-roulette", "--depth", theirs.edges],
    };
    luxcore_turn(context, &asked, seed)
}
