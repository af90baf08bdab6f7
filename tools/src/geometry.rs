//! Triangles of scenes in world space, for what measures indexes without rendering.

use clerestory::scene::{Camera, Projection, Scene};
use clerestory::{Error, Result};
use glam::{DVec3, Vec3};

/// All instances' triangles in world space, metres.
pub fn triangles(scene: &Scene) -> Vec<[Vec3; 3]> {
    scene.triangles().map(|(triangle, _)| triangle).collect()
}

/// Area of a triangle, m².
pub fn area([a, b, c]: &[Vec3; 3]) -> f64 {
    let [a, b, c] = [a, b, c].map(|v| v.as_dvec3());
    0.5 * (b - a).cross(c - a).length()
}

/// Origin and unit direction of rays through the middles of the pixels of a square picture, row by row.
///
/// # Errors
/// [`Error::Setting`] for a camera that is not in perspective.
pub fn camera_rays(camera: &Camera, size: u32) -> Result<Vec<(Vec3, Vec3)>> {
    let Projection::Perspective { fov_y } = camera.projection else {
        return Err(Error::setting("camera", &camera.name, "is not in perspective"));
    };
    let half = (0.5 * f64::from(fov_y)).tan();
    let to_plane = |i: u32| half * (f64::from(2 * i + 1) / f64::from(size) - 1.0);
    let origin = camera.transform.translation.as_vec3();
    let direction = |(x, y)| {
        let in_camera = DVec3::new(to_plane(x), -to_plane(y), -1.0);
        camera.transform.transform_vector3(in_camera).normalize().as_vec3()
    };
    let pixels = (0..size).flat_map(|y| (0..size).map(move |x| (x, y)));
    Ok(pixels.map(|pixel| (origin, direction(pixel))).collect())
}
