//! Pictures of a mirror sphere that moves through point-lit rooms while its map stays: their errors, the times of frames, and how they look.
//!
//! Oracle: the path tracer on the same light paths. The map's place is where the way begins, and the map is there before frames are timed.

use std::sync::Arc;
use std::time::Instant;

use clerestory::film::png::{self, Rgb8};
use clerestory::film::{CompareOptions, Picture, ToneCurve, ToneMap, compare};
use clerestory::gpu::Gpu;
use clerestory::scene::{self, Camera, Scene};
use clerestory::techniques::impostors::{ImpostorReflections, ReflectionMethod, ReflectionSettings};
use clerestory::techniques::{PathTracer, PathTracerSettings, Technique};
use clerestory::transport::{GpuScene, PathSet};
use clerestory::{Error, Result};
use glam::DVec3;

use crate::experiments::findings::{Bound, Criterion, Findings, Measured, Repeats, rows};
use crate::experiments::measures::Context;
use crate::experiments::measures::maps::sphere::sheet;
use crate::experiments::measures::pictures::finished;
use crate::experiments::reference::SEED;

/// A room with its sphere.
struct Room {
    name: &'static str,
    address: &'static str,
    /// From where the sphere is looked at, metres.
    eye: DVec3,
    /// Field of view, degrees.
    view: f32,
    /// The file of its pictures.
    file: &'static str,
    /// Times that were published over the classical look-up's: of one step, and of one and eight steps of false position.
    published: [Option<f64>; 3],
}

const EMPTY: &str = "checkered";
const DIVIDED: &str = "checkered, with a divider";
const ROOMS: [Room; 3] = [
    Room {
        name: EMPTY,
        address: "builtin:divider-room?source=point&object=mirror&divider=no",
        eye: DVec3::new(1.7, 0.5, 1.9),
        view: 42.0,
        file: "moving-empty.png",
        // 642, 447 and 323 pictures a second.
        published: [Some(642.0 / 447.0), Some(642.0 / 323.0), None],
    },
    Room {
        name: DIVIDED,
        address: "builtin:divider-room?source=point&object=mirror",
        eye: DVec3::new(1.7, 0.5, 1.9),
        view: 42.0,
        file: "moving-divided.png",
        // 630, 430, 323 and 108, beside a box.
        published: [Some(630.0 / 430.0), Some(630.0 / 323.0), Some(630.0 / 108.0)],
    },
    Room {
        name: "furnished",
        address: "builtin:box-room?source=point&mirror=no&object=mirror",
        eye: DVec3::new(3.6, 1.9, 5.6),
        view: 32.0,
        file: "moving-furnished.png",
        published: [None; 3],
    },
];
/// Shares of the way.
const SHARES: [f64; 3] = [0.0, 0.5, 1.0];

const CLASSICAL: &str = "classical";
const ONE_STEP: &str = "one step";
const EIGHT_STEPS: &str = "false position +8";
const PATHS: &str = "path tracer";
/// Look-ups and their steps.
type Way = (&'static str, ReflectionMethod, u32);
const WAYS: [Way; 4] = [
    (CLASSICAL, ReflectionMethod::Classical, 0),
    (ONE_STEP, ReflectionMethod::OneStep, 0),
    ("false position +1", ReflectionMethod::FalsePosition, 1),
    (EIGHT_STEPS, ReflectionMethod::FalsePosition, 8),
];
const TURNS: usize = 7;
/// Of shown pictures: walls that a point light lights are dark.
const TONE: ToneMap = ToneMap {
    exposure: 1.0,
    curve: ToneCurve::Srgb,
};

/// Sizes of a run.
#[derive(Clone, Copy)]
struct Sizes {
    /// Pixels along a side.
    pixels: u32,
    /// Samples a pixel of a frame.
    samples: u32,
    /// Samples a pixel of the reference.
    reference: u32,
    /// Texels along a side of the map.
    map: u32,
    /// Texels along a side of its shadow maps.
    shadows: u32,
}

const FULL: Sizes = Sizes {
    pixels: 96,
    samples: 16,
    reference: 1024,
    map: 256,
    shadows: 1024,
};
const SMOKE: Sizes = Sizes {
    pixels: 12,
    samples: 2,
    reference: 16,
    map: 32,
    shadows: 64,
};

rows! {
    /// A picture of the sphere at a place of its way.
    struct Frame = "Pictures of a moving sphere beside the path tracer's" by [room, share, way] {
        room: String = "room",
        share: f64 = "share of the way",
        way: String = "way",
        error: f64 = "relative RMSE (%)",
        of_classical: f64 = "relative RMSE over that of the classical look-up",
        of_paths: f64 = "relative RMSE over that of the path tracer",
        non_finite: u64 = "samples and pixels that are not finite",
        time: Repeats = "frame (ms)",
        over_classical: Repeats = "frame: time over the classical look-up's",
    }
    beside "source: time over the classical look-up's" = |row| published(row).into();
}

/// What was published of a row's time.
fn published(row: &Frame) -> Option<f64> {
    let room = ROOMS.iter().find(|room| room.name == row.room)?;
    let way = WAYS[1..].iter().position(|way| way.0 == row.way)?;
    room.published[way]
}

/// What is good of pictures.
const OF_PICTURES: &[Criterion<Frame>] = &[
    Criterion::each(
        "where nothing is hidden pictures of one step err less than the classical look-up's: relative RMSE over theirs",
        Bound::AtMost(1.0),
        |row: &Frame| row.of_classical.into(),
    )
    .among(|row| row.room == EMPTY && row.way == ONE_STEP),
    Criterion::each(
        "what the divider hides stays smeared in pictures of eight steps: relative RMSE over the path tracer's",
        Bound::AtLeast(1.0),
        |row: &Frame| row.of_paths.into(),
    )
    .among(|row| row.room == DIVIDED && row.way == EIGHT_STEPS && row.share == 1.0),
    Criterion::each(
        "a frame of one step takes at most twice that of the classical look-up",
        Bound::AtMost(2.0),
        |row: &Frame| Measured::from(&row.over_classical),
    )
    .among(|row| row.way == ONE_STEP),
    Criterion::each(
        "pictures are finite: samples and pixels that are not",
        Bound::AtMost(0.0),
        |row: &Frame| row.non_finite.into(),
    )
    .in_every_form(),
];

/// The middle of the sphere, metres.
fn middle(scene: &Scene) -> Result<DVec3> {
    let sphere = scene.meshes.iter().find(|mesh| mesh.name == "object");
    let sphere = sphere.ok_or_else(|| Error::setting("object", "none", "is no sphere to move"))?;
    let [low, high] = sphere.bounds().map(|corner| corner.as_dvec3());
    Ok(low.midpoint(high))
}

/// Milliseconds of a frame, begun anew.
fn frame(technique: &mut dyn Technique, camera: &Camera, samples: u32) -> Result<f64> {
    technique.set_camera(camera)?;
    let clock = Instant::now();
    while technique.step(samples)?.is_some() {}
    technique.picture()?;
    Ok(1e3 * clock.elapsed().as_secs_f64())
}

/// A picture that was rendered in turns.
struct Shown {
    way: &'static str,
    picture: Picture,
    error: f64,
    non_finite: u64,
    times: Repeats,
}

/// Frames of a place of the way by all ways, and pictures: of the reference and of each look-up.
fn at_a_place(
    context: &Context<'_>,
    gpu: &Gpu,
    room: &Room,
    share: f64,
    (ways, sizes): (&[Way], Sizes),
) -> Result<(Vec<Frame>, Vec<Rgb8>)> {
    let load = |share: f64| scene::load(&format!("{}&place={share}", room.address));
    let (begin, scene) = (middle(&load(0.0)?)?, load(share)?);
    let (eye, target, size) = (room.eye, middle(&scene)?, [sizes.pixels; 2]);
    let camera = Camera::look_at("sphere", eye, target, DVec3::Y, room.view.to_radians());
    let on_device = Arc::new(GpuScene::new(gpu, &scene)?);
    let by_paths = |seed: u32| {
        let settings = PathTracerSettings {
            path_set: PathSet::DIRECT_AND_MIRRORED,
            seed,
            ..PathTracerSettings::default()
        };
        PathTracer::new(gpu, Arc::clone(&on_device), &camera, size, settings)
    };
    let reference = finished(&mut by_paths(SEED)?, sizes.reference)?;
    let mut techniques: Vec<(&'static str, Box<dyn Technique>)> = Vec::new();
    for (name, method, steps) in ways {
        let settings = ReflectionSettings {
            place: Some(begin.as_vec3().to_array()),
            method: *method,
            steps: *steps,
            side: sizes.map,
            shadow_side: sizes.shadows,
            ..ReflectionSettings::default()
        };
        let technique = ImpostorReflections::new(gpu, Arc::clone(&on_device), &camera, size, settings)?;
        techniques.push((*name, Box::new(technique)));
    }
    techniques.push((PATHS, Box::new(by_paths(0)?)));
    let times = context.in_turns(TURNS, techniques.len(), |i| {
        frame(techniques[i].1.as_mut(), &camera, sizes.samples)
    })?;
    let mut all = Vec::new();
    for ((way, technique), times) in techniques.iter_mut().zip(times) {
        let (picture, skipped) = technique.picture()?;
        let report = compare(&picture, &reference, &CompareOptions::default())?;
        all.push(Shown {
            way,
            picture,
            error: report.relative_mse.sqrt(),
            non_finite: skipped.total() + report.non_finite_test,
            times: Repeats(times),
        });
    }
    let error_of = |way: &str| all.iter().find(|one| one.way == way).map_or(f64::NAN, |one| one.error);
    let classical = all.first().map_or_else(Repeats::default, |one| one.times.clone());
    let row = |one: &Shown| Frame {
        room: room.name.into(),
        share,
        way: one.way.into(),
        error: 100.0 * one.error,
        of_classical: one.error / error_of(CLASSICAL),
        of_paths: one.error / error_of(PATHS),
        non_finite: one.non_finite,
        over_classical: one.times.over(&classical),
        time: one.times.clone(),
    };
    let rows = all.iter().map(row).collect();
    let look_ups = all.iter().filter(|one| one.way != PATHS).map(|one| &one.picture);
    let tile = |picture: &Picture| Ok::<_, Error>(png::tone_mapped(picture.main_layer()?, picture.width(), &TONE));
    let tiles: Result<Vec<Rgb8>> = std::iter::once(&reference).chain(look_ups).map(tile).collect();
    Ok((rows, tiles?))
}

/// Frames of all places in all rooms; pictures go beside the tables.
///
/// # Errors
/// Those of scenes and of rendering.
pub(super) fn moving(context: &Context<'_>, gpu: &Gpu) -> Result<Vec<Frame>> {
    let (shares, sizes) = context.pick((&SHARES[..], FULL), (&SHARES[2..], SMOKE));
    let ways = context.pick(WAYS.to_vec(), vec![WAYS[0], WAYS[1], WAYS[3]]);
    // A smoke run has the rooms of the criteria.
    let rooms = context.first(&ROOMS, 2);
    context.each(
        rooms,
        |room| room.name.into(),
        |room| {
            let (mut rows, mut shown) = (Vec::new(), Vec::new());
            for share in shares {
                let (found, tiles) = at_a_place(context, gpu, room, *share, (&ways, sizes))?;
                rows.extend(found);
                shown.push(tiles);
            }
            context.picture(room.file, &sheet(&shown));
            Ok(rows)
        },
    )
}

/// What pictures say, with those of each room that there are.
pub(super) fn findings(rows: &[Frame]) -> Findings {
    let found = Findings::of(rows, OF_PICTURES).note(format!(
        "{0} × {0} pixels of {1} samples; the map is seen from where the way begins, and drawn before frames are timed. Published times are those of whole pictures on a graphics processor of 2004, \
         in an empty room and beside a box.",
        FULL.pixels, FULL.samples
    ));
    let there = ROOMS.iter().filter(|room| rows.iter().any(|row| row.room == room.name));
    there.fold(found, |found, room| {
        let words = format!(
            "A mirror sphere in a room ({}), from top to bottom at the beginning, the middle and the end of its way; from the left the path tracer, the classical look-up, one step, and one and eight steps of \
             false position",
            room.name
        );
        found.picture(room.file, &words)
    })
}
