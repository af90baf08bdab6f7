//! A tall glossy body between two balls of fire: which parts of it show them, by the map at its place and by localised gathers.
//!
//! Source of the comparison: L. Szirmay-Kalos, I. Lazányi, "Indirect Diffuse and Glossy Illumination on the GPU", SCCG 2006. Oracle: sums over directions of what is seen in them from
//! the points.

use clerestory::Result;
use clerestory::gpu::Gpu;
use clerestory::maps::gather::lit_room::{LitRoom, relative_errors};
use clerestory::maps::gather::{Gather, GatherLights, GatherPoint, GatherSettings, SolidAngleForm};
use clerestory::maps::impostor::room::BoxRoom;
use clerestory::maps::impostor::{ImpostorImage, ImpostorSurface};
use clerestory::maps::{MapImage, Parametrization};
use glam::{DVec3, UVec2};

use super::exact_room::mean;
use super::gather_glossy::{CLASSICAL, CLASSICAL_SIDE, at_the_maps_place, way};
use crate::experiments::findings::{Axes, Bound, Criterion, Findings, curves, rows};
use crate::experiments::measures::Context;

/// The published exponent.
const EXPONENT: f32 = 10.0;
/// Radiances of its walls: ceiling and floor are the third and the fourth, and there is no patch.
const ROOM: LitRoom = LitRoom {
    walls: [0.2, 0.2, 0.8, 0.3, 0.2, 0.2],
    patch: 0.3,
    patch_at: [0.0; 3],
};
/// Middles of the balls from the map's place, their radius in half widths of the room, and their radiance.
const BALLS: [DVec3; 2] = [DVec3::new(0.5, 0.0, 0.0), DVec3::new(-0.5, 0.0, 0.0)];
const BALL_RADIUS: f64 = 0.12;
const FIRE: f64 = 20.0;
/// Radius of the body, an upright column.
const RADIUS: f64 = 0.1;
/// Heights above its foot, in half widths; it stands about the map's place.
const HEIGHTS: [f64; 5] = [0.0, 0.3, MIDDLE, 0.9, TOP];
const MIDDLE: f64 = 0.6;
const TOP: f64 = 1.2;
/// Points around it at a height.
const AROUND: u32 = 48;
/// Directions along the sides of the faces of a cube that the oracle sums over.
const DIRECTIONS: u32 = 96;
/// Texels along a side of the faces of the map, and lights.
const MAP_SIDE: u32 = 256;
const SIDES: [u32; 3] = [4, 8, 16];

rows! {
    /// A way at a height.
    struct Part = "Glossy light of a column between two balls of fire, exponent 10" by [height, way] {
        height: f64 = "height above its foot (half widths)",
        way: String = "way",
        light: f64 = "mean light",
        of_middle: f64 = "light over that in the middle",
        rms: f64 = "RMS (%)",
        of_classical: f64 = "RMS over that of the map at its place",
    }
}

const EXACT: &str = "what is seen";

impl Part {
    /// Whether it is at the head or at the base.
    fn is_end(&self) -> bool {
        [0.0, TOP].contains(&self.height)
    }
}

/// Criteria of the column.
pub const OF_PARTS: &[Criterion<Part>] = &[
    Criterion::each(
        "fire lights the middle alone: light of head and base over that in the middle",
        Bound::AtMost(0.5),
        |row: &Part| row.of_middle.into(),
    )
    .among(|row| row.is_end() && row.way == EXACT),
    Criterion::each(
        "by the map at its place head and base are lit as the middle is: light over that in the middle",
        Bound::Between(0.999, 1.001),
        |row: &Part| row.of_middle.into(),
    )
    .among(|row| row.is_end() && row.way == CLASSICAL)
    .because("it knows no place"),
    Criterion::each(
        "by eight texels a side head and base are not lit as the middle is: light over that in the middle",
        Bound::AtMost(0.5),
        |row: &Part| row.of_middle.into(),
    )
    .among(|row| row.is_end() && row.way == way(8))
    .because("they were published to be lit from floor and ceiling"),
    Criterion::each(
        "eight texels a side are ahead of the map at its place at head and base: RMS over its",
        Bound::AtMost(1.0),
        |row: &Part| row.of_classical.into(),
    )
    .among(|row| row.is_end() && row.way == way(8)),
];

/// What is seen from a point in a unit direction: radiance, and the surface.
fn seen(x: DVec3, d: DVec3) -> (f64, ImpostorSurface) {
    let wall = BoxRoom::EMPTY.surface_from(x, d);
    let mut first = (ROOM.radiance(x + wall.distance * d), wall);
    for middle in BALLS {
        let to_middle = middle - x;
        let along = d.dot(to_middle);
        let root = along * along - to_middle.length_squared() + BALL_RADIUS * BALL_RADIUS;
        if root <= 0.0 {
            continue;
        }
        let distance = along - root.sqrt();
        if distance > 0.0 && distance < first.1.distance {
            let normal = distance * d - to_middle;
            first = (FIRE, ImpostorSurface { distance, normal });
        }
    }
    first
}

/// Points around the column at a height, each with the lobe about its own normal.
fn points(height: f64, count: u32) -> Vec<GatherPoint> {
    let point = |i: u32| {
        let (sine, cosine) = (std::f64::consts::TAU * f64::from(i) / f64::from(count)).sin_cos();
        let axis = DVec3::new(cosine, 0.0, sine);
        GatherPoint {
            position: RADIUS * axis + (height - MIDDLE) * DVec3::Y,
            axis,
        }
    };
    (0..count).map(point).collect()
}

/// What is seen in each direction, by the lobe about each point's axis.
fn exact(points: &[GatherPoint], side: u32) -> Vec<f64> {
    let (map, size) = (Parametrization::Cube, UVec2::splat(side));
    let directions: Vec<(DVec3, f64)> = map
        .texels(size)
        .filter_map(|texel| Some((map.texel_direction(size, texel)?, map.texel_solid_angle(size, texel))))
        .collect();
    let exponent = f64::from(EXPONENT);
    let value = |point: &GatherPoint| {
        let term = |(direction, solid_angle): &(DVec3, f64)| {
            let cosine = point.axis.dot(*direction);
            if cosine <= 0.0 {
                return 0.0;
            }
            cosine.powf(exponent) * solid_angle * seen(point.position, *direction).0
        };
        (exponent + 1.0) / std::f64::consts::TAU * directions.iter().map(term).sum::<f64>()
    };
    points.iter().map(value).collect()
}

/// The column by each way at each height.
///
/// # Errors
/// Those of maps and of the device.
pub fn parts(context: &Context<'_>, gpu: &Gpu) -> Result<Vec<Part>> {
    let (count, directions, side) = context.pick((AROUND, DIRECTIONS, MAP_SIDE), (8, 24, 64));
    let sides = context.pick(&SIDES[..], &SIDES[1..2]);
    let (map, size) = (Parametrization::Cube, UVec2::splat(side));
    let radiance = MapImage::from_fn(map, size, |texel| {
        let direction = map.texel_direction(size, texel);
        DVec3::splat(direction.map_or(0.0, |d| seen(DVec3::ZERO, d).0))
    })?;
    let impostor = ImpostorImage::from_fn(map, size, 1, true, |d| vec![seen(DVec3::ZERO, d.normalize()).1])?;
    let gather = |side: u32, form: SolidAngleForm| -> Result<Gather> {
        let lights = GatherLights::new(&radiance, &impostor, side, form)?;
        Gather::new(gpu, &lights, &GatherSettings::default(), EXPONENT)
    };
    let still = gather(CLASSICAL_SIDE, SolidAngleForm::Disc)?;
    let gathers: Vec<(u32, Gather)> = sides
        .iter()
        .map(|side| Ok((*side, gather(*side, SolidAngleForm::DiscWithNormals)?)))
        .collect::<Result<_>>()?;
    let gathered = |gather: &Gather, points: &[GatherPoint]| -> Result<Vec<f64>> {
        Ok(gather.gather(points)?.into_iter().map(|value| value.x).collect())
    };
    let at = |height: f64| -> Result<Vec<(String, Vec<f64>)>> {
        let points = points(height, count);
        let mut ways = vec![
            (EXACT.to_owned(), exact(&points, directions)),
            (CLASSICAL.to_owned(), gathered(&still, &at_the_maps_place(&points))?),
        ];
        for (side, gather) in &gathers {
            ways.push((way(*side), gathered(gather, &points)?));
        }
        Ok(ways)
    };
    let in_the_middle = at(MIDDLE)?;
    context.each(
        &HEIGHTS,
        |height| format!("column at {height}"),
        |height| {
            let ways = at(*height)?;
            let rms = |values: &[f64]| relative_errors(values, &ways[0].1)[0];
            let classical = rms(&ways[1].1);
            let part = |(of_way, of_middle): (&(String, Vec<f64>), _)| {
                let ((way, values), (_, middle)): (_, &(String, Vec<f64>)) = (of_way, of_middle);
                Part {
                    height: *height,
                    way: way.clone(),
                    light: mean(values),
                    of_middle: mean(values) / mean(middle),
                    rms: rms(values),
                    of_classical: rms(values) / classical,
                }
            };
            Ok(ways.iter().zip(&in_the_middle).map(part).collect())
        },
    )
}

/// What a page says of it.
pub fn findings(parts: &[Part]) -> Findings {
    Findings::of(parts, OF_PARTS)
        .note(
            "A column of radius 0.1 about the map's place in the room [−1, 1]³, between two balls of radiance 20 and radius 0.12 half-way to the walls at the height of its middle; floor and ceiling \
             have 0.3 and 0.8, the walls 0.2. Lobes are about the column's own normals.",
        )
        .curves(
            "column",
            "Light of a column between balls of fire",
            Axes::even("height above its foot (half widths)", "mean light", 2.5, (4, 0.3)),
            curves(parts, |row| row.way.clone(), |row| (row.height, row.light.into())),
        )
}
