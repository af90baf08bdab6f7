//! Density of maps in colours: on the sphere and on the map itself, side by side.

use clerestory::film::png::Rgb8;
use clerestory::maps::{MapPoint, Parametrization};
use glam::{DVec2, DVec3};

/// Ratio of densities in full colour: red too coarse, blue too fine; logarithmic between.
pub const FULL_COLOR: f64 = 4.0;
/// Cells of the chequered pattern that shows shapes, over the height of a layer.
const CELLS: f64 = 16.0;
const SHADE: f64 = 0.82;
const OUTSIDE: [u8; 3] = [96; 3];
const GAP: u32 = 4;
/// Where the sphere is seen from: an edge of the octahedron's upper half in the middle, a corner of the cube to one side.
const EYE: DVec3 = DVec3::new(1.0, 0.45, 0.65);

fn color(map: Parametrization, at: MapPoint) -> [u8; 3] {
    let shift = (map.density_ratio(at).log2() / FULL_COLOR.log2()).clamp(-1.0, 1.0);
    let cell = (at.uv * CELLS * DVec2::new(f64::from(map.aspect()), 1.0)).floor();
    let shade = if (cell.x + cell.y).rem_euclid(2.0) < 1.0 {
        1.0
    } else {
        SHADE
    };
    let rest = 1.0 - shift.abs();
    let mixed = if shift > 0.0 {
        [1.0, rest, rest]
    } else {
        [rest, rest, 1.0]
    };
    mixed.map(|channel| (255.0 * shade * channel).round() as u8)
}

/// The sphere from afar.
fn on_sphere(map: Parametrization, p: DVec2) -> Option<[u8; 3]> {
    let towards = EYE.normalize();
    let right = DVec3::Z.cross(towards).normalize();
    let up = towards.cross(right);
    let squared = p.length_squared();
    let depth = (1.0 - squared).max(0.0).sqrt();
    let d = p.x * right + p.y * up + depth * towards;
    (squared <= 1.0).then(|| map.encode(d).map_or(OUTSIDE, |at| color(map, at)))
}

/// All layers of the map; `p` in \[0, 1\]².
fn on_map(map: Parametrization, p: DVec2) -> Option<[u8; 3]> {
    let (columns, rows) = match map.layers() {
        1 => (1, 1),
        2 => (2, 1),
        layers => (layers / 2, 2),
    };
    let shape = DVec2::new(f64::from(columns * map.aspect()), f64::from(rows));
    // As large as fits, in the middle.
    let q = (p - 0.5) * (shape.max_element() / shape) + 0.5;
    if q.cmplt(DVec2::ZERO).any() || q.cmpge(DVec2::ONE).any() {
        return None;
    }
    let place = q * DVec2::new(f64::from(columns), f64::from(rows));
    let cell = place.floor().as_uvec2();
    let at = MapPoint {
        layer: cell.y * columns + cell.x,
        uv: place.fract(),
    };
    Some(if map.holds(at) { color(map, at) } else { OUTSIDE })
}

/// A column for each map: above on the sphere, below on the map.
pub fn strip(maps: &[Parametrization], side: u32) -> Rgb8 {
    let columns = maps.len() as u32;
    let (width, height) = (columns * side + (columns - 1) * GAP, 2 * side + GAP);
    let mut bytes = Vec::with_capacity((width * height * 3) as usize);
    for y in 0..height {
        for x in 0..width {
            let (column, row) = (x / (side + GAP), y / (side + GAP));
            let inside = DVec2::new(f64::from(x % (side + GAP)), f64::from(y % (side + GAP)));
            let p = (inside + 0.5) / f64::from(side);
            let map = maps[column as usize];
            let found = match row {
                _ if p.max_element() > 1.0 => None,
                0 => on_sphere(map, DVec2::new(2.0 * p.x - 1.0, 1.0 - 2.0 * p.y)),
                _ => on_map(map, p),
            };
            bytes.extend(found.unwrap_or([255; 3]));
        }
    }
    Rgb8 { width, height, bytes }
}
