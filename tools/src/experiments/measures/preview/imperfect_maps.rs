//! Imperfect shadow maps beside exact ones: what a thousand of them cost by how many triangles there are, and how often they are wrong by how many points they have.
//!
//! Source: T. Ritschel et al., SIGGRAPH Asia 2008. Oracle: a ray from each place to the light.

use clerestory::Result;
use clerestory::gpu::{Category, Gpu};
use clerestory::raster::splat_atlas::{SplatAtlas, SplatAtlasDesc};
use clerestory::raster::{OmniShadowDesc, OmniShadowImage, OmniShadowMaps, ShadowLayout};
use glam::Vec3;

use super::shadow_places::Subject;
use crate::experiments::findings::{Bound, Criterion, Findings, Measured, Repeats, Study, geometric_mean, rows};
use crate::experiments::measures::Context;
use crate::experiments::reference::short_name;

/// Scenes, and the light's place as a share of the box around each: of some hundred triangles to a hundred thousand.
const SCENES: [(&str, Vec3); 4] = [
    ("builtin:cornell-box", Vec3::new(0.5, 0.9, 0.55)),
    ("builtin:divider-room", Vec3::new(0.3, 0.5, 0.4)),
    ("builtin:conference", Vec3::new(0.45, 0.85, 0.55)),
    ("builtin:box-city?n=8400", Vec3::new(0.55, 0.9, 0.52)),
];
/// Texels along a side, as techniques have them by default.
const SIDE: u32 = 64;
const POINTS: [u32; 3] = [1024, 4096, 16_384];
/// Points as techniques have them by default.
const DEFAULT: u64 = 4096;
const FILL_LEVELS: u32 = 2;
const PLACES: usize = 50_000;
const TURNS: usize = 5;
/// Maps that are timed, of which a thousand take as many times as long.
const EXACT_MAPS: u32 = 16;
const IMPERFECT_MAPS: u32 = 256;
const THOUSAND: f64 = 1000.0;
/// Triangles of a scene that counts as large.
const LARGE: u64 = 100_000;
const EXACT: &str = "exact";

rows! {
    /// A kind of maps in a scene.
    struct Row = "Shadow maps of many lights, 64² texels each" by [scene, way] {
        scene: String = "scene",
        way: String = "way",
        triangles: u64 = "triangles",
        points: u64 = "points of a map",
        lit: f64 = "share of lit places",
        wrong: f64 = "share of wrong places",
        draw: Repeats = "1,000 maps (ms)",
        bytes: f64 = "points and one map (KiB)",
    }
}

rows! {
    /// Imperfect maps with the default points beside exact ones, and with most beside fewest points.
    struct Pair = "Imperfect maps beside exact ones" by [scene] {
        scene: String = "scene",
        triangles: u64 = "triangles",
        faster: Measured = "time of exact maps over that of imperfect ones",
        wrong: f64 = "wrong places of imperfect maps over those of exact ones",
        fewest: f64 = "wrong places with fewest points over those with most",
    }
}

/// What was found.
pub type Found = Vec<Row>;

const OF_PAIRS: &[Criterion<Pair>] = &[
    Criterion::each(
        "1,000 imperfect maps are ten times as fast as exact ones at 100,000 triangles: ratio of times",
        Bound::AtLeast(10.0),
        |row: &Pair| row.faster,
    )
    .among(|row| row.triangles >= LARGE),
    Criterion::each(
        "more points err less: wrong places with fewest points over those with most",
        Bound::AtLeast(1.0),
        |row: &Pair| row.fewest.into(),
    ),
    Criterion::each(
        "imperfect maps of 4,096 points err three times as much as exact ones at most",
        Bound::AtMost(3.0),
        |row: &Pair| row.wrong.into(),
    )
    .because("one of their texels of indirect light is one of many"),
];

fn pairs(rows: &[Row]) -> Vec<Pair> {
    let exact = rows.iter().filter(|row| row.way == EXACT);
    let pair = |exact: &Row| {
        let imperfect = rows.iter().filter(|row| row.scene == exact.scene && row.way != EXACT);
        let all: Vec<&Row> = imperfect.collect();
        let default = all.iter().find(|row| row.points == DEFAULT)?;
        let (fewest, most) = (all.first()?, all.last()?);
        Some(Pair {
            scene: exact.scene.clone(),
            triangles: exact.triangles,
            faster: exact.draw.over(&default.draw).measured(),
            wrong: default.wrong / exact.wrong,
            fewest: fewest.wrong / most.wrong,
        })
    };
    exact.filter_map(pair).collect()
}

/// Share of the places where a map says otherwise than a ray.
fn wrong(subject: &Subject, map: &OmniShadowImage) -> f64 {
    let share = |place| map.visibility(subject.light, 0, place) as f32;
    subject.error(&subject.places.iter().map(share).collect::<Vec<f32>>())
}

struct Exact(OmniShadowMaps);

impl Exact {
    fn new(gpu: &Gpu, subject: &Subject, maps: u32) -> Result<Self> {
        let desc = OmniShadowDesc {
            layout: ShadowLayout::Octahedron,
            side: SIDE,
            maps,
        };
        Ok(Self(OmniShadowMaps::new(gpu, &subject.scene.surfaces(), desc)?))
    }

    /// Seconds of the device for a thousand.
    fn draw(&self, gpu: &Gpu, subject: &Subject) -> Result<f64> {
        let maps = self.0.desc().maps;
        let mut recorder = gpu.recorder("exact maps")?;
        let lights = vec![subject.light; maps as usize];
        self.0.record(&mut recorder, &subject.scene.surfaces(), &lights)?;
        Ok(recorder.submit()?.wait()?.seconds() * THOUSAND / f64::from(maps))
    }
}

fn imperfect(gpu: &Gpu, subject: &Subject, points: u32, maps: u32) -> Result<SplatAtlas> {
    let desc = SplatAtlasDesc {
        side: SIDE,
        maps,
        points,
        fill_levels: FILL_LEVELS,
    };
    SplatAtlas::new(gpu, &subject.scene.surfaces(), desc)
}

fn draw(gpu: &Gpu, subject: &Subject, atlas: &SplatAtlas) -> Result<f64> {
    let maps = atlas.desc().maps;
    let origins = vec![subject.light.extend(0.0).to_array(); maps as usize];
    let origins = gpu.buffer_with("places of lights", Category::Light, &origins)?;
    let mut recorder = gpu.recorder("imperfect maps")?;
    atlas.record_surfels(&mut recorder, &subject.scene.surfaces())?;
    atlas.record(&mut recorder, &origins, [0, 0, maps])?;
    Ok(recorder.submit()?.wait()?.seconds() * THOUSAND / f64::from(maps))
}

fn of_scene(context: &Context<'_>, gpu: &Gpu, address: &str, share: Vec3) -> Result<Vec<Row>> {
    let subject = Subject::new(gpu, address, share, context.pick(PLACES, 2000))?;
    let exact = Exact::new(gpu, &subject, context.pick(EXACT_MAPS, 1))?;
    let points = context.first(&POINTS, 2);
    let atlases: Vec<SplatAtlas> = points
        .iter()
        .map(|points| imperfect(gpu, &subject, *points, context.pick(IMPERFECT_MAPS, 8)))
        .collect::<Result<_>>()?;
    let turns = context.in_turns(TURNS, 1 + atlases.len(), |contender| match contender.checked_sub(1) {
        None => exact.draw(gpu, &subject),
        Some(atlas) => draw(gpu, &subject, &atlases[atlas]),
    })?;
    let times: Vec<Repeats> = turns
        .into_iter()
        .map(|turns| turns.into_iter().collect::<Repeats>().scaled(1e3))
        .collect();
    let row = |way: String, points: u32, map: &OmniShadowImage, draw: &Repeats, bytes: u64| Row {
        scene: short_name(address).to_owned(),
        way,
        triangles: subject.scene.surfaces().triangles.into(),
        points: points.into(),
        lit: subject.lit_share(),
        wrong: wrong(&subject, map),
        draw: draw.clone(),
        bytes: bytes as f64 / 1024.0,
    };
    let texels = u64::from(SIDE).pow(2) * size_of::<f32>() as u64;
    let mut rows = vec![row(EXACT.into(), 0, &exact.0.read(0)?, &times[0], texels)];
    for ((points, atlas), times) in points.iter().zip(&atlases).zip(&times[1..]) {
        let maps = atlas.desc().map_bytes();
        let bytes = atlas.bytes() - maps * u64::from(atlas.desc().maps - 1);
        rows.push(row(
            format!("imperfect, {points} points"),
            *points,
            &atlas.read(0)?,
            times,
            bytes,
        ));
    }
    Ok(rows)
}

impl Study for Found {
    fn measure(context: &Context<'_>) -> Result<Self> {
        let gpu = (context.gpu)()?;
        context.each(
            context.first(&SCENES, 1),
            |(address, _)| short_name(address).to_owned(),
            |(address, share)| of_scene(context, &gpu, address, *share),
        )
    }

    fn findings(&self) -> Findings {
        let pairs = pairs(self);
        let large = pairs
            .iter()
            .filter(|pair| pair.triangles >= LARGE)
            .map(|pair| pair.faster);
        Findings::of(&pairs, OF_PAIRS)
            .headline(
                "time of 1,000 exact maps over that of imperfect ones at 100,000 triangles",
                geometric_mean(large),
            )
            .and(Findings::of(self, &[]))
            .note(format!(
                "Octahedra of {SIDE}² texels about one place. {EXACT_MAPS} exact and {IMPERFECT_MAPS} imperfect maps are drawn at once, and a thousand counted as so many times as long. Places are \
                 spread evenly over what turns its outer side to the light; a place is wrong where the nearest texel says otherwise than the ray from it to the light. \
                 Times are of the device's timestamps; ways take turns."
            ))
    }
}
