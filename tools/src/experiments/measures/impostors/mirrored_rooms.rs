//! Pictures of mirror spheres in rooms of boxes: what searches in a map find, beside what is there.
//!
//! The map is a cube of nearest distances with planes, seen from the room's middle; walls are checkered, and what a search finds has the colour of what that place sees there.

use clerestory::Result;
use clerestory::maps::Parametrization;
use clerestory::maps::impostor::room::ShinySphere;
use clerestory::maps::impostor::{ImpostorImage, ImpostorSettings, SearchMethod};
use glam::DVec3;

use crate::experiments::measures::Context;
use crate::metal_forms::sheet;

pub(super) const PICTURE: &str = "searches.png";
pub(super) const WORDS: &str = "Mirror spheres in the corner of an empty room (C), beside a box and beside a pillar (P1), each after three steps and below after ten; from the left what is there, the secant from the ray's point, that from the \
     guess, false position, and mixed";

/// In a corner, beside a box, and beside a pillar.
const SPHERES: [ShinySphere; 3] = [ShinySphere::C, ShinySphere::BOX, ShinySphere::P1];
const METHODS: [SearchMethod; 4] = [
    SearchMethod::SecantFromPoint,
    SearchMethod::SecantFromGuess,
    SearchMethod::FalsePosition,
    SearchMethod::Mixed,
];
const STEPS: [u32; 2] = [3, 10];
/// Colours of the walls +x, −x, +y, −y, +z and −z, and of what stands in the room.
const WALLS: [DVec3; 6] = [
    DVec3::new(0.7, 0.15, 0.1),
    DVec3::new(0.1, 0.35, 0.7),
    DVec3::new(0.8, 0.8, 0.75),
    DVec3::new(0.4, 0.4, 0.4),
    DVec3::new(0.15, 0.55, 0.2),
    DVec3::new(0.7, 0.5, 0.1),
];
const OBSTACLE: DVec3 = DVec3::new(0.6, 0.1, 0.6);
/// Squares along half a wall, and what of its colour every second one has.
pub(super) const SQUARES: f64 = 4.0;
const DARK: f64 = 0.3;
/// What sides of a box across x, y and z have of its colour.
const SHADES: [f64; 3] = [1.0, 0.7, 0.45];
/// What lies farther within is no wall.
const WITHIN: f64 = 1.0 - 1e-6;

/// The colour of a surface at a point, by its normal.
pub(super) fn color(point: DVec3, normal: DVec3) -> DVec3 {
    let axis = normal.abs().max_position();
    if point.abs().max_element() < WITHIN {
        return SHADES[axis] * OBSTACLE;
    }
    let wall = WALLS[2 * axis + usize::from(point[axis] < 0.0)];
    let square = |axis: usize| ((point[axis % 3] + 1.0) * SQUARES).floor() as i64;
    let is_dark = (square(axis + 1) + square(axis + 2)) % 2 == 0;
    if is_dark { DARK * wall } else { wall }
}

/// Tiles of a sphere after so many steps: what is there, then by each method; white beside it.
fn tiles(sphere: &ShinySphere, map: &ImpostorImage, steps: u32, side: u32) -> Vec<Vec<DVec3>> {
    let pixels = sphere.pixels(side, None);
    let rows = || pixels.chunks_exact(side as usize).rev().flatten();
    let there = rows().map(|ray| {
        ray.map_or(DVec3::ONE, |ray| {
            let met = sphere.room.surface_from(ray.origin, ray.direction);
            color(ray.origin + met.distance * ray.direction, met.normal)
        })
    });
    let mut tiles = vec![there.collect()];
    for method in METHODS {
        let settings = ImpostorSettings::of(method, steps);
        let found = rows().map(|ray| {
            ray.map_or(DVec3::ONE, |ray| {
                let direction = map.search(&ray, &settings).direction;
                let seen = sphere.room.surfaces(direction);
                seen.first().map_or(DVec3::ZERO, |met| {
                    color(met.distance * direction.normalize_or_zero(), met.normal)
                })
            })
        });
        tiles.push(found.collect());
    }
    tiles
}

/// Draws all of them, of a map of so many texels.
///
/// # Errors
/// As [`ImpostorImage::from_fn`].
pub(super) fn draw(context: &Context<'_>, side: u32, texels: f64) -> Result<()> {
    let cube = Parametrization::Cube;
    let mut shown = Vec::new();
    for sphere in &SPHERES {
        let map = ImpostorImage::from_fn(cube, cube.size_for(texels), 1, true, |d| sphere.room.surfaces(d))?;
        for steps in STEPS {
            shown.extend(tiles(sphere, &map, steps, side));
        }
    }
    context.picture(PICTURE, &sheet(&shown, side, 1 + METHODS.len() as u32));
    Ok(())
}
