//! Pictures of spheres in a lit room, side by side: one row for each view, and in it one tile for each way to light it.

use clerestory::Result;
use clerestory::film::png::Rgb8;
use clerestory::maps::gather::GatherPoint;
use clerestory::maps::gather::lit_room::LitRoom;
use glam::DVec3;

use crate::metal_forms::sheet;

/// What a view shows of a sphere by pixels, row by row; `None` beside it.
pub(super) type SeenPoints = Vec<Option<GatherPoint>>;
/// Values of points.
pub(super) type Lit<'a> = Box<dyn Fn(&[GatherPoint]) -> Result<Vec<f64>> + 'a>;

/// A sphere at a place of the room as it is seen from a direction, without perspective and with +y up, in `side`² pixels that just hold it; axes are normals.
pub(super) fn seen(place: DVec3, from: DVec3, side: u32) -> SeenPoints {
    let towards = from.normalize();
    let right = DVec3::Y.cross(towards).normalize();
    let up = towards.cross(right);
    let at = |i: u32| 2.0 * (f64::from(i) + 0.5) / f64::from(side) - 1.0;
    let point = |i: u32| {
        let (x, y) = (at(i % side), -at(i / side));
        let depth = (1.0 - x * x - y * y).max(0.0).sqrt();
        let axis = x * right + y * up + depth * towards;
        (depth > 0.0).then_some(GatherPoint {
            position: place + LitRoom::RADIUS * axis,
            axis,
        })
    };
    (0..side * side).map(point).collect()
}

/// The same with the directions that a mirror would show as axes.
pub(super) fn seen_in_lobes(place: DVec3, from: DVec3, side: u32) -> SeenPoints {
    let towards = from.normalize();
    let mirrored = |point: GatherPoint| GatherPoint {
        axis: (2.0 * point.axis.dot(towards) * point.axis - towards).normalize(),
        ..point
    };
    seen(place, from, side)
        .into_iter()
        .map(|point| point.map(mirrored))
        .collect()
}

/// Tiles of all views by all ways, the first of which is the oracle: the brightest point that it has in a view is white there.
///
/// # Errors
/// Those of the ways.
pub(super) fn sheet_of(views: &[SeenPoints], ways: &[Lit<'_>], side: u32) -> Result<Rgb8> {
    let mut tiles = Vec::new();
    for view in views {
        let points: Vec<GatherPoint> = view.iter().flatten().copied().collect();
        let mut white = None;
        for way in ways {
            let found = way(&points)?;
            let white = *white.get_or_insert_with(|| found.iter().copied().fold(f64::MIN_POSITIVE, f64::max));
            let mut values = found.into_iter();
            let pixel = |point: &Option<GatherPoint>| {
                let value = point.and_then(|_| values.next());
                DVec3::splat(value.unwrap_or(0.0) / white)
            };
            tiles.push(view.iter().map(pixel).collect());
        }
    }
    Ok(sheet(&tiles, side, ways.len() as u32))
}
