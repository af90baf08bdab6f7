//! Objects that move on the device, for what is rasterized.

use glam::{DAffine3, Vec3};

use super::GpuScene;
use super::geometry::{Geometry, corners_of, instances_in_order};
use crate::gpu::shaders::types::SceneTriangle;
use crate::gpu::{Gpu, TexelView};
use crate::scene::{Instance, Scene};
use crate::{Error, Result};

impl GpuScene {
    /// Puts an object (an instance of the scene, by its index) to another place, for what is rasterized from here on: triangles, normals and tangents
    /// are as if the scene had been made with it there, bit for bit. The ray index stays, so that rays still meet the object where it was.
    ///
    /// `scene` is the one that this was made of. Nothing that reads the scene may be under way.
    ///
    /// # Errors
    /// [`Error::Setting`] for an object that does not exist, is invisible, emits light, or would leave the box around the scene, for a placement that is not finite or mirrors
    /// what was not mirrored, and for scenes with participating media; [`Error::DeviceLost`], [`Error::OutOfMemory`].
    pub fn move_object(&self, gpu: &Gpu, scene: &Scene, object: usize, transform: DAffine3) -> Result<()> {
        let refuse = |cause: &str| Err(Error::setting("object", object, cause));
        let known = self.objects.iter().find(|known| known.object as usize == object);
        let (Some(known), Some(instance)) = (known, scene.instances.get(object)) else {
            return refuse("does not exist, or bounds a medium");
        };
        let mesh = &scene.meshes[instance.mesh as usize];
        if mesh.triangles.len() != known.triangles.len() {
            return refuse("is of another scene");
        }
        if self.profile.media.any() {
            return refuse("may be around a medium");
        }
        let emits = |index: u32| scene.materials[index as usize].emission.max_element() > 0.0;
        if mesh.material.is_some_and(emits) {
            return refuse("emits light, whose choice depends on its place");
        }
        if !transform.is_finite() {
            return refuse("would have a place that is not finite");
        }
        // The vertices of its triangles stay as they are numbered.
        let mirrors = |transform: &DAffine3| transform.matrix3.determinant() < 0.0;
        if mirrors(&transform) != mirrors(&instance.transform) {
            return refuse("would be mirrored");
        }
        let alone = Scene {
            materials: scene.materials.clone(),
            meshes: vec![mesh.clone()],
            instances: vec![Instance {
                mesh: 0,
                transform,
                ..instance.clone()
            }],
            ..Scene::default()
        };
        let moved = Geometry::flatten(&alone, &self.profile)?;
        let [lower, upper] = self.bounds;
        let inside = |corner: Vec3| corner.cmpge(lower).all() && corner.cmple(upper).all();
        if !moved.triangles.iter().flat_map(corners_of).all(inside) {
            return refuse("would leave the box around the scene");
        }
        let before = instances_in_order(scene).take_while(|other| !std::ptr::eq(*other, instance));
        let first_vertex: usize = before
            .map(|other| scene.meshes[other.mesh as usize].positions.len())
            .sum();
        let upload = |view: &TexelView, data: &[[f32; 4]]| {
            if data.is_empty() {
                return Ok(());
            }
            gpu.upload(view.buffer(), (first_vertex * size_of::<[f32; 4]>()) as u64, data)
        };
        let first = u64::from(known.triangles.start) * size_of::<SceneTriangle>() as u64;
        gpu.upload(self.buffers.triangles.buffer(), first, &moved.triangles)?;
        upload(&self.buffers.normals, &moved.normals)?;
        upload(&self.buffers.tangents, &moved.tangents)
    }
}
