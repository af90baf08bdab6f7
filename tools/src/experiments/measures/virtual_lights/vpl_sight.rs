//! Light of the same virtual lights by what tells whether they are seen: how far it is from that by shadow rays, what it takes to ask, and what it takes to draw exact maps by how
//! many there are and how many triangles.
//!
//! Source of the ways: C. Sun, "Many-Light Real-Time Global Illumination using Sparse Voxel Octree", Master's thesis, WPI, 2015, §1 and §6; T. Ritschel et al., SIGGRAPH Asia 2008. Oracle:
//! shadow rays in frames of the same seed, which have the same lights at the same places.

use std::sync::Arc;

use clerestory::film::picture;
use clerestory::gpu::Gpu;
use clerestory::raster::{OmniShadowDesc, OmniShadowMaps, ShadowLayout};
use clerestory::techniques::instant_radiosity::Bound;
use clerestory::techniques::instant_radiosity::many_light::{ManyLight, ManyLightSettings, Visibility};
use clerestory::transport::GpuScene;
use clerestory::transport::random::SamplerKind;
use clerestory::{Result, scene};
use glam::Vec3;

use crate::experiments::findings::{
    Axes, Bound as Limit, Criterion, Findings, Measured, Repeats, Study, curves, geometric_mean, rows,
};
use crate::experiments::measures::Context;
use crate::experiments::measures::pictures::mean_of;
use crate::experiments::reference::short_name;
use crate::experiments::slope::least_squares;

const SCENES: [&str; 4] = [
    "builtin:cornell-box",
    "builtin:passage",
    "builtin:box-room",
    "builtin:divider-room",
];
/// Scenes of 6,000, 25,000 and 100,000 triangles whose maps are timed.
const CITIES: [&str; 3] = [
    "builtin:box-city?n=525",
    "builtin:box-city?n=2100",
    "builtin:box-city?n=8400",
];
/// Maps that are drawn at once.
const MAPS: [u32; 4] = [4, 8, 16, 32];
/// Where their light is, as a share of the box around the scene.
const LIGHT: Vec3 = Vec3::new(0.55, 0.9, 0.52);
/// Texels along a side of a map, as techniques have them by default.
const MAP_SIDE: u32 = 64;
const INDIRECT: &str = "bounces=2,lobes=diffuse+glossy";

const NOTHING: &str = "nothing";
const IMPERFECT: &str = "imperfect maps";
const EXACT: &str = "exact maps";
const RAYS: &str = "shadow rays";
/// From the coarsest to the oracle.
const WAYS: [(&str, Visibility); 4] = [
    (NOTHING, Visibility::None),
    (IMPERFECT, Visibility::Imperfect),
    (EXACT, Visibility::Maps),
    (RAYS, Visibility::Rays),
];
const GATHER: &str = "many-light: gather";
/// How passes begin that make maps.
const DRAWING: [&str; 3] = ["shadow maps", "imperfect maps", "many-light: places of lights"];
/// Of the mean light: added to a pixel's own where its error is taken, else few dark ones had all of it.
const FLOOR: f64 = 0.1;

const FULL: Form = Form {
    side: 48,
    walks: 512,
    map_side: MAP_SIDE,
    turns: 5,
};
const SMOKE: Form = Form {
    side: 12,
    walks: 32,
    map_side: 16,
    turns: 2,
};

#[derive(Clone, Copy)]
struct Form {
    /// Pixels along a side.
    side: u32,
    walks: u32,
    map_side: u32,
    turns: usize,
}

rows! {
    /// What tells whether a light is seen.
    struct Row = "The same virtual lights, seen by other means" by [scene, way] {
        scene: String = "scene",
        way: String = "asked by",
        asked: u64 = "pairs that are asked for",
        error: Repeats = "relative RMSE from shadow rays",
        over: Repeats = "RMSE over that of the way before",
        light: Repeats = "light over that by shadow rays",
        pair: Repeats = "gather, a pair that is asked for (ns)",
        faster: Repeats = "that with shadow rays over this",
        drawing: Repeats = "drawing maps (ms)",
    }
}
rows! {
    /// So many maps at once.
    struct Drawn = "Exact maps by how many are drawn at once" by [scene, maps] {
        scene: String = "scene",
        maps: u64 = "maps",
        triangles: u64 = "triangles",
        time: Repeats = "time (ms)",
        each: Repeats = "a map (ms)",
        over: Repeats = "a map over one of the fewest",
    }
}

/// What was found.
#[derive(Default, serde::Serialize, serde::Deserialize)]
pub struct Found {
    ways: Vec<Row>,
    drawn: Vec<Drawn>,
}

/// The exponent of time against maps times triangles.
fn exponent(rows: &[&Drawn]) -> Option<Measured> {
    let points: Vec<(f64, f64)> = rows
        .iter()
        .map(|row| {
            let work = (row.maps * row.triangles) as f64;
            (work.ln(), row.time.measured().value.ln())
        })
        .collect();
    least_squares(&points).map(Measured::exact)
}

const OF_WAYS: &[Criterion<Row>] = &[
    Criterion::each(
        "imperfect maps err less than nothing: ratio of errors of the same lights",
        Limit::AtMost(1.0),
        |row: &Row| (&row.over).into(),
    )
    .among(|row| row.way == IMPERFECT),
    Criterion::each(
        "exact maps err less than imperfect ones: ratio of errors of the same lights",
        Limit::AtMost(1.0),
        |row: &Row| (&row.over).into(),
    )
    .among(|row| row.way == EXACT),
    Criterion::each(
        "rays err less than exact maps: ratio of errors of the same lights",
        Limit::AtMost(1.0),
        |row: &Row| (&row.over).into(),
    )
    .among(|row| row.way == RAYS)
    .because("rays are the oracle, and have none"),
    Criterion::each(
        "a look-up takes no longer than a ray: time of a pair with a ray over that with an exact map",
        Limit::AtLeast(1.0),
        |row: &Row| (&row.faster).into(),
    )
    .among(|row| row.way == EXACT)
    .because("what maps are for"),
];
const OF_DRAWN: &[Criterion<Drawn>] = &[
    Criterion::each(
        "drawing is linear in the maps: time of a map over that of one of the fewest",
        Limit::Between(0.9, 1.1),
        |row: &Drawn| (&row.over).into(),
    ),
    Criterion::all(
        "drawing is linear in maps times triangles: exponent",
        Limit::Between(0.9, 1.1),
        exponent,
    ),
];

/// A frame.
struct Frame {
    radiance: Vec<f32>,
    /// Seconds of the device.
    gather: f64,
    drawing: f64,
    /// Pairs whose visibility was asked for.
    asked: u64,
}

impl Frame {
    fn of(renderer: &mut ManyLight, seed: u32) -> Result<Self> {
        renderer.restart(seed)?;
        let before = renderer.counts().visibility_tests;
        let (mut gather, mut drawing) = (0.0, 0.0);
        while let Some(step) = renderer.step(1)? {
            for pass in step.timings.iter().flat_map(|timings| &timings.passes) {
                let seconds = pass.nanoseconds.map_or(f64::NAN, |ns| ns as f64 * 1e-9);
                if pass.name == GATHER {
                    gather += seconds;
                } else if DRAWING.iter().any(|begin| pass.name.starts_with(begin)) {
                    drawing += seconds;
                }
            }
        }
        let (picture, _) = renderer.picture()?;
        Ok(Self {
            radiance: picture.require(picture::RADIANCE)?.values().to_vec(),
            gather,
            drawing,
            asked: renderer.counts().visibility_tests - before,
        })
    }

    /// Nanoseconds of the gather for a pair that is asked for.
    fn pair(&self) -> f64 {
        1e9 * self.gather / self.asked as f64
    }

    /// Root of the mean squared difference to the truth, relative to it.
    fn error(&self, truth: &Self) -> f64 {
        let floor = FLOOR * mean_of(&truth.radiance);
        let pairs = self.radiance.iter().zip(&truth.radiance);
        let squares = pairs.map(|(found, truth)| (f64::from(found - truth) / (f64::from(*truth) + floor)).powi(2));
        (squares.sum::<f64>() / truth.radiance.len() as f64).sqrt()
    }
}

fn of_scene(context: &Context<'_>, gpu: &Gpu, address: &str) -> Result<Vec<Row>> {
    let form = context.pick(FULL, SMOKE);
    let scene = scene::load(address)?;
    let on_device = Arc::new(GpuScene::new(gpu, &scene)?);
    let mut renderers = Vec::new();
    for (_, visibility) in WAYS {
        let settings = ManyLightSettings {
            lights: form.walks,
            visibility,
            map_side: form.map_side,
            interleave: 1,
            filter: false,
            bound: Bound::None,
            sampler: SamplerKind::Pcg,
            path_set: INDIRECT.parse()?,
            ..ManyLightSettings::default()
        };
        let camera = scene.require_camera(None)?;
        let renderer = ManyLight::new(gpu, Arc::clone(&on_device), camera, [form.side; 2], settings)?;
        renderers.push((renderer, 0));
    }
    // The same seeds for all of them.
    let found = context.in_turns(form.turns, WAYS.len(), |i| {
        let (renderer, seed) = &mut renderers[i];
        *seed += 1;
        Frame::of(renderer, *seed)
    })?;
    let [_, _, _, rays] = &found[..] else {
        return Ok(Vec::new());
    };
    let mut rows: Vec<Row> = Vec::new();
    for ((way, _), frames) in WAYS.iter().zip(&found) {
        let beside = |value: &dyn Fn(&Frame, &Frame) -> f64| -> Repeats {
            frames.iter().zip(rays).map(|(own, rays)| value(own, rays)).collect()
        };
        let error = beside(&|own, rays| own.error(rays));
        rows.push(Row {
            scene: short_name(address).into(),
            way: (*way).into(),
            asked: frames.iter().map(|frame| frame.asked).sum(),
            over: match rows.last() {
                Some(before) => error.over(&before.error),
                None => frames.iter().map(|_| 1.0).collect(),
            },
            error,
            light: beside(&|own, rays| mean_of(&own.radiance) / mean_of(&rays.radiance)),
            pair: frames.iter().map(Frame::pair).collect(),
            faster: beside(&|own, rays| rays.pair() / own.pair()),
            drawing: frames.iter().map(|frame| 1e3 * frame.drawing).collect(),
        });
    }
    Ok(rows)
}

/// Times of so many maps at one place.
fn drawn_of_scene(context: &Context<'_>, gpu: &Gpu, address: &str) -> Result<Vec<Drawn>> {
    let form = context.pick(FULL, SMOKE);
    let scene = GpuScene::new(gpu, &scene::load(address)?)?;
    let [lower, upper] = scene.bounds();
    let light = lower + (upper - lower) * LIGHT;
    let counts = context.first(&MAPS, 2);
    let mut atlases = Vec::new();
    for maps in counts {
        let desc = OmniShadowDesc {
            layout: ShadowLayout::Octahedron,
            side: form.map_side,
            maps: *maps,
        };
        atlases.push(OmniShadowMaps::new(gpu, &scene.surfaces(), desc)?);
    }
    let found = context.in_turns(form.turns, counts.len(), |i| {
        let mut recorder = gpu.recorder("exact maps")?;
        let lights = vec![light; counts[i] as usize];
        atlases[i].record(&mut recorder, &scene.surfaces(), &lights)?;
        Ok(1e3 * recorder.submit()?.wait()?.seconds())
    })?;
    let times: Vec<Repeats> = found.into_iter().map(Repeats).collect();
    let each = |i: usize| times[i].scaled(1.0 / f64::from(counts[i]));
    let row = |(i, time): (usize, &Repeats)| Drawn {
        scene: short_name(address).into(),
        maps: counts[i].into(),
        triangles: scene.surfaces().triangles.into(),
        time: time.clone(),
        each: each(i),
        over: each(i).over(&each(0)),
    };
    Ok(times.iter().enumerate().map(row).collect())
}

impl Study for Found {
    fn measure(context: &Context<'_>) -> Result<Self> {
        let gpu = (context.gpu)()?;
        let name = |address: &&str| short_name(address).to_owned();
        Ok(Self {
            ways: context.each(context.first(&SCENES, 1), name, |address| {
                of_scene(context, &gpu, address)
            })?,
            drawn: context.each(context.first(&CITIES, 1), name, |address| {
                drawn_of_scene(context, &gpu, address)
            })?,
        })
    }

    fn findings(&self) -> Findings {
        let exact = self.ways.iter().filter(|row| row.way == EXACT);
        let ways = Findings::of(&self.ways, OF_WAYS)
            .headline(
                "error of exact maps over that of imperfect ones, with the same lights, geometric mean of four scenes",
                geometric_mean(exact.map(|row| Measured::from(&row.over))),
            )
            .note(format!(
                "{0} × {0} pixels, {1} walks, all lights at all pixels, without bound and filter; maps of {2}² texels. Ways take turns with the same seeds, so that their lights and places are the same, and \
                 noise of lights has no part in what they differ by. Errors are over a pixel's own light and a tenth of the mean. Pairs are those of all turns.",
                FULL.side, FULL.walks, FULL.map_side
            ))
            .bars(
                "errors",
                "Relative RMSE from shadow rays with the same lights",
                &self.ways,
                |row| [row.scene.clone(), row.way.clone()],
                |row| (&row.error).into(),
            );
        let drawn = Findings::of(&self.drawn, OF_DRAWN)
            .note("Octahedra about one place, times of the device.")
            .curves(
                "maps",
                "Time of exact maps against their number",
                Axes::rates("maps", "time (ms)"),
                curves(
                    &self.drawn,
                    |row| format!("{} triangles", row.triangles),
                    |row| (row.maps as f64, row.time.measured()),
                ),
            );
        ways.and(drawn)
    }
}
