//! Triangles of scenes in world space, for what measures indexes without rendering.

use clerestory::scene::{Instance, Scene};
use glam::Vec3;

/// All instances' triangles in world space, metres, with the index of their material; no material is `None`.
pub fn triangles_with_materials(scene: &Scene) -> impl Iterator<Item = ([Vec3; 3], Option<u32>)> + '_ {
    scene.instances.iter().flat_map(|instance: &Instance| {
        let mesh = &scene.meshes[instance.mesh as usize];
        let place = |i: u32| {
            let position = mesh.positions[i as usize].as_dvec3();
            instance.transform.transform_point3(position).as_vec3()
        };
        mesh.triangles.iter().map(move |t| (t.map(place), mesh.material))
    })
}

/// As [`triangles_with_materials`], without the materials.
pub fn triangles(scene: &Scene) -> Vec<[Vec3; 3]> {
    triangles_with_materials(scene).map(|(triangle, _)| triangle).collect()
}

/// Area of a triangle, m².
pub fn area([a, b, c]: &[Vec3; 3]) -> f64 {
    let [a, b, c] = [a, b, c].map(|v| v.as_dvec3());
    0.5 * (b - a).cross(c - a).length()
}
