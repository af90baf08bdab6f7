//! What a localised gather evaluates: paths of the map once, and a term for each light at each point, in place of paths from each point.
//!
//! Oracle: the counts that sizes and settings say. Counters are the technique's own.

use std::f64::consts::TAU;

use clerestory::Result;
use clerestory::maps::gather::lit_room::LitRoom;
use clerestory::maps::gather::{SolidAngleForm, gather_solid_angle};
use clerestory::maps::impostor::room::BoxRoom;
use clerestory::maps::{MapImage, Parametrization};
use clerestory::render::{RenderOptions, Renderer};
use clerestory::scene;
use glam::{DVec3, UVec2};
use serde_json::json;

use super::convolved_maps::unfolded;
use crate::experiments::findings::{Bound, Criterion, Findings, Measured, Study, rows};
use crate::experiments::measures::Context;
use crate::metal_forms::sheet;

const SCENE: &str = "builtin:box-room?source=point&mirror=no&contents=empty";
/// Lights along a side of the octahedron.
const LIGHTS: [u32; 4] = [8, 16, 32, 64];
/// Texels along a side of the map, and paths of each.
const SIDE: u32 = 128;
const SAMPLES: u32 = 4;
const PICTURE: &str = "lights.png";
/// Texels along a side of a shown face.
const FACE: u32 = 42;
/// Lights along a side of a face that are shown, and about which places: the map's own first.
const SHOWN: u32 = 4;
const ABOUT: [DVec3; 3] = [LitRoom::PLACES[0], LitRoom::PLACES[1], LitRoom::PLACES[2]];
/// Colours of lights' middles, of the rims of their cones, and of the brightest wall.
const MIDDLE: DVec3 = DVec3::new(1.0, 0.9, 0.1);
const RIM: DVec3 = DVec3::new(0.8, 0.1, 0.05);
const WALL: DVec3 = DVec3::splat(0.5);

rows! {
    /// A picture.
    struct Row = "Evaluations of a picture by a localised gather" by [lights] {
        lights: u64 = "lights",
        points: u64 = "points that gather",
        pixels: u64 = "pixels",
        map_paths: u64 = "paths of the map",
        map_rays: u64 = "rays of the map",
        terms: u64 = "terms: lights of all points",
        in_place: u64 = "paths that each point would take in their place",
        share: f64 = "paths and terms over these",
        rays_share: f64 = "rays of the map over these paths",
    }
}
/// What was found.
pub type Found = Vec<Row>;

const CRITERIA: &[Criterion<Row>] = &[
    Criterion::each(
        "each path of the map is traced once: paths over texels and samples",
        Bound::Between(1.0, 1.0),
        |row: &Row| (row.map_paths as f64 / f64::from(SIDE * SIDE * SAMPLES)).into(),
    ),
    Criterion::each(
        "all rough points gather, and no other: points over pixels",
        Bound::Between(0.5, 1.0),
        |row: &Row| (row.points as f64 / row.pixels as f64).into(),
    )
    .because("the room fills the picture")
    .in_every_form(),
    Criterion::each(
        "a gather replaces paths from each point: paths and terms over them",
        Bound::AtMost(0.1),
        |row: &Row| row.share.into(),
    )
    .because("64² lights are a sixteenth of the map's paths"),
];

fn row(renderer: &Renderer, lights: u32, [size, side]: [u32; 2]) -> Result<Row> {
    let rendered = renderer.render(&RenderOptions {
        technique: Some("localized-gather".into()),
        size: [size; 2],
        spp: 1,
        settings: json!({"lights": lights, "side": side, "capture": "rays", "capture_samples": SAMPLES}).into(),
        ..RenderOptions::default()
    })?;
    let count = |name: &str| rendered.report.counters.get(name).copied().unwrap_or(0);
    let (points, map_paths, map_rays) = (count("gathers"), count("map_paths"), count("map_rays"));
    let terms = points * count("lights");
    let in_place = points * map_paths;
    Ok(Row {
        lights: count("lights"),
        points,
        pixels: u64::from(size * size),
        map_paths,
        map_rays,
        terms,
        in_place,
        share: (map_paths + terms) as f64 / in_place.max(1) as f64,
        rays_share: map_rays as f64 / in_place.max(1) as f64,
    })
}

/// Unfolded cubes of what is seen about places, with all lights as cones of the solid angles that they have there.
fn overlays(side: u32) -> Result<Vec<Vec<DVec3>>> {
    let (room, form) = (LitRoom::PUBLISHED, SolidAngleForm::DiscWithNormals);
    let lights = room.lights(SHOWN, form)?;
    let (map, size) = (Parametrization::Cube, UVec2::splat(side));
    // About the angle that a texel is seen under.
    let texel_angle = 2.0 / f64::from(side);
    let overlay = |place: &DVec3| {
        // Directions to the lights, and half angles of their cones.
        let cones = lights.lights().iter().filter_map(|light| {
            let v = light.position - *place;
            let direction = v.try_normalize()?;
            let cosine = -light.normal.dot(direction);
            let solid_angle = gather_solid_angle(form, light.area, v.length_squared(), cosine);
            Some((direction, (1.0 - solid_angle / TAU).acos()))
        });
        let cones: Vec<(DVec3, f64)> = cones.collect();
        let image = MapImage::from_fn(map, size, |texel| {
            let direction = map.texel_direction(size, texel).unwrap_or_default();
            let off = |towards: DVec3| towards.angle_between(direction);
            if cones.iter().any(|(towards, _)| off(*towards) < texel_angle) {
                return MIDDLE;
            }
            let is_rim = |(towards, cone): &(DVec3, f64)| (off(*towards) - cone).abs() < 0.5 * texel_angle;
            if cones.iter().any(is_rim) {
                return RIM;
            }
            let hit = *place + BoxRoom::EMPTY.hit(*place, direction) * direction;
            room.radiance(hit).min(1.0) * WALL
        })?;
        Ok(unfolded(&image, 1.0))
    };
    ABOUT.iter().map(overlay).collect()
}

impl Study for Found {
    fn measure(context: &Context<'_>) -> Result<Self> {
        let gpu = (context.gpu)()?;
        let side = context.pick(FACE, 4);
        context.picture(PICTURE, &sheet(&overlays(side)?, 3 * side, ABOUT.len() as u32));
        let renderer = Renderer::new(&gpu, &scene::load(SCENE)?)?;
        let sizes = context.pick([64, SIDE], [8, 16]);
        let lights = context.first(&LIGHTS, 1);
        context.each(
            lights,
            |lights| format!("{lights}² lights"),
            |lights| Ok(vec![row(&renderer, *lights, sizes)?]),
        )
    }

    fn findings(&self) -> Findings {
        let default = self.iter().find(|row| row.lights == 32 * 32);
        let findings = Findings::of(self, CRITERIA)
            .headline(
                "paths of the map and terms of 32² lights over paths from each point",
                default.map(|row| Measured::exact(row.share)),
            )
            .note("A picture of one sample a pixel of an empty room, its map by rays. Paths from each point would be as many as the map's, so that each point had as little noise.");
        if self.is_empty() {
            return findings;
        }
        findings.picture(
            PICTURE,
            "Lights of 4² texels a face of a lit room, about the map's place, half-way to a wall and near the bright patch: their middles, yellow, and the rims of cones of the solid angles that they have there, \
             red, over what is seen; faces +x, −x and +y above −y, +z and −z",
        )
    }
}
