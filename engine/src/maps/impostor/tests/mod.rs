//! Searches and proxies against exact rays in rooms of boxes.

mod edges;
mod proxies;
mod searches;

use glam::DVec3;

use super::room::{BoxRoom, ShinySphere};
use super::{ImpostorHit, ImpostorImage, ImpostorRay, ImpostorScene, ImpostorSettings, SearchMethod, impostor_search};
use crate::maps::Parametrization;

/// Pixels along a side of a view of the sphere.
const SIDE: u32 = 110;
/// Texels of a cube of 256² a face.
const TEXELS: f64 = 6.0 * 256.0 * 256.0;

/// What a room looks like, exactly.
fn exact(room: BoxRoom, layers: u32) -> ImpostorScene<impl Fn(u32, DVec3) -> f64> {
    let nearest = room
        .obstacle
        .map_or(1.0, |[low, high]| DVec3::ZERO.clamp(low, high).length());
    ImpostorScene {
        distance: move |layer: u32, v: DVec3| {
            let surfaces = room.surfaces(v);
            let surface = surfaces.get(layer as usize);
            surface.map_or(f64::from(ImpostorImage::NOTHING), |surface| surface.distance)
        },
        layers,
        extent: [nearest, 3f64.sqrt()],
    }
}

fn image(map: Parametrization, room: BoxRoom, layers: u32, with_normals: bool) -> ImpostorImage {
    ImpostorImage::from_fn(map, map.size_for(TEXELS), layers, with_normals, |d| room.surfaces(d)).expect("an impostor")
}

/// Errors of look-ups, in degrees.
struct Errors(Vec<f64>);

impl Errors {
    fn mean(&self) -> f64 {
        self.0.iter().sum::<f64>() / self.0.len() as f64
    }

    /// Share below one degree, %.
    fn good(&self) -> f64 {
        100.0 * self.0.iter().filter(|error| **error < 1.0).count() as f64 / self.0.len() as f64
    }
}

fn errors(sphere: &ShinySphere, rays: &[ImpostorRay], search: impl Fn(&ImpostorRay) -> ImpostorHit) -> Errors {
    Errors(
        rays.iter()
            .map(|ray| sphere.room.error(ray, search(ray).direction))
            .collect(),
    )
}

/// Of an exact room of one layer.
fn exact_mean(sphere: &ShinySphere, rays: &[ImpostorRay], method: SearchMethod, steps: u32) -> f64 {
    let scene = exact(sphere.room, 1);
    let settings = ImpostorSettings::of(method, steps);
    errors(sphere, rays, |ray| impostor_search(&scene, ray, &settings)).mean()
}

/// What texels of 256² a face may add to an error, °.
const OF_TEXELS: f64 = 0.03;

/// Fails unless a value is within a fifth of the published one, or so many degrees.
#[track_caller]
fn within(what: &str, found: f64, published: f64, slack: f64) {
    println!("{what}: {found:.4}, published {published}");
    assert!(
        (found - published).abs() <= (0.2 * published).max(slack),
        "{what}: {found}, published {published}"
    );
}

/// Fails unless a value of an exact room is within a fifth of the published one, or the last digit of those.
#[track_caller]
fn near(what: &str, found: f64, published: f64) {
    within(what, found, published, 1e-3);
}
