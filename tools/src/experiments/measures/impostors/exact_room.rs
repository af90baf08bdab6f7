//! Rooms of boxes without texels: what searches find of them, and by how much that is off.

use clerestory::maps::impostor::room::{BoxRoom, ShinySphere};
use clerestory::maps::impostor::{
    ImpostorHit, ImpostorImage, ImpostorRay, ImpostorScene, ImpostorSettings, impostor_search,
};
use glam::DVec3;

/// What the map's place sees of a room, exactly: one layer.
fn scene(room: BoxRoom) -> ImpostorScene<impl Fn(u32, DVec3) -> f64> {
    let nearest = room
        .obstacle
        .map_or(1.0, |[low, high]| DVec3::ZERO.clamp(low, high).length());
    ImpostorScene {
        distance: move |_: u32, v: DVec3| {
            let surfaces = room.surfaces(v);
            surfaces
                .first()
                .map_or(f64::from(ImpostorImage::NOTHING), |surface| surface.distance)
        },
        layers: 1,
        extent: [nearest, 3f64.sqrt()],
    }
}

/// What a search finds along a ray.
pub fn found(room: BoxRoom, ray: &ImpostorRay, settings: &ImpostorSettings) -> ImpostorHit {
    impostor_search(&scene(room), ray, settings)
}

/// Angles at the map's place between what is found and the true hits of a sphere's rays, in degrees.
pub fn errors(sphere: &ShinySphere, rays: &[ImpostorRay], settings: &ImpostorSettings) -> Vec<f64> {
    let scene = scene(sphere.room);
    let error = |ray: &ImpostorRay| sphere.room.error(ray, impostor_search(&scene, ray, settings).direction);
    rays.iter().map(error).collect()
}

/// The mean; 0 of nothing.
pub fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len().max(1) as f64
}
