//! Objects that move on the device: for what is rasterized, and, where instances are kept, for rays.

use glam::{DAffine3, Vec3};

use super::geometry::{Geometry, corners_of, instances_in_order};
use super::kept::{alone, not_kept};
use super::{GpuScene, Kept, lock};
use crate::accel::RayIndex;
use crate::accel::two_level::TwoLevelBvh;
use crate::gpu::shaders::types::SceneTriangle;
use crate::gpu::{Gpu, TexelView};
use crate::scene::{Instance, Mesh, Scene};
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
        if self.kept.is_some() {
            return refuse("is in a scene that keeps its instances, which move_instances moves");
        }
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

    /// Puts instances of the scene, by their numbers, to other places, where instances are kept: rays meet them there from here on, as if the scene had been
    /// made so. Of the index only the tree over the instances is made anew ([`GpuScene::index_work`] counts).
    ///
    /// Pictures under way must be restarted, or they mix both; nothing that reads the scene may be under way.
    ///
    /// # Errors
    /// [`Error::Setting`] for an instance that is not kept, for a transform that rays cannot be traced through
    /// ([`InstanceTransform::of`](crate::accel::two_level::InstanceTransform::of)), and for one that would leave the box around the scene, and nothing
    /// has moved then; [`Error::DeviceLost`], [`Error::OutOfMemory`].
    pub fn move_instances(&self, gpu: &Gpu, moves: &[(usize, DAffine3)]) -> Result<()> {
        let Some(kept) = &self.kept else {
            return not_kept("instances", moves.len());
        };
        let mut kept = lock(kept);
        let mut placements = Vec::with_capacity(moves.len());
        for (object, transform) in moves {
            let Some(placement) = kept.instances.placement(*object) else {
                return not_kept("object", object);
            };
            placements.push((placement, *transform));
        }
        let mut index = kept.index.clone();
        index.move_instances(&placements)?;
        self.check_inside(&index)?;
        for (object, transform) in moves {
            kept.instances.moved(*object, transform);
        }
        self.upload_kept(gpu, &mut kept, index, None)
    }

    /// Gives a mesh of the scene that is kept another shape: as many vertices, and the same triangles. Its tree keeps its form, so rays are fast where
    /// little has moved. Normals and tangents are those of `mesh`; colours and texture coordinates stay.
    ///
    /// `scene` is the one that this was made of. Pictures under way must be restarted, or they mix both; nothing that reads the scene may be under way.
    ///
    /// # Errors
    /// [`Error::Setting`] for a mesh that is not kept, or has other triangles or another number of vertices, normals or tangents, and for one that would leave the box
    /// around the scene, and nothing has changed then; [`Error::DeviceLost`], [`Error::OutOfMemory`].
    pub fn refit_mesh(&self, gpu: &Gpu, scene: &Scene, number: usize, mesh: &Mesh) -> Result<()> {
        let refuse = |cause: &str| Err(Error::setting("mesh", number, cause));
        let Some(kept) = &self.kept else {
            return not_kept("mesh", number);
        };
        let mut kept = lock(kept);
        let stored = u32::try_from(number)
            .ok()
            .and_then(|number| kept.instances.stored(number));
        let (Some((place, first)), Some(known)) = (stored, scene.meshes.get(number)) else {
            return not_kept("mesh", number);
        };
        let lengths = |mesh: &Mesh| [mesh.positions.len(), mesh.normals.len(), mesh.tangents.len()];
        if mesh.triangles != known.triangles || lengths(mesh) != lengths(known) {
            return refuse("has other triangles, or another number of vertices, normals or tangents");
        }
        let shape = Mesh {
            material: known.material,
            ..mesh.clone()
        };
        let moved = Geometry::flatten(&alone(scene, &shape), &self.profile)?;
        let corners: Vec<[Vec3; 3]> = moved.triangles.iter().map(corners_of).collect();
        let mut index = kept.index.clone();
        index.refit_mesh(place, &corners)?;
        self.check_inside(&index)?;
        self.upload_kept(gpu, &mut kept, index, Some(place))?;
        gpu.upload(
            self.buffers.triangles.buffer(),
            (first * size_of::<SceneTriangle>()) as u64,
            &moved.triangles,
        )?;
        let first_vertex = kept.instances.first_vertex(scene, number as u32);
        let upload = |view: &TexelView, data: &[[f32; 4]]| {
            if data.is_empty() {
                return Ok(());
            }
            gpu.upload(view.buffer(), (first_vertex * size_of::<[f32; 4]>()) as u64, data)
        };
        upload(&self.buffers.normals, &moved.normals)?;
        upload(&self.buffers.tangents, &moved.tangents)
    }

    /// Refuses an index that reaches beyond the box around the scene, by more than boxes of instances exceed what is in them.
    fn check_inside(&self, index: &TwoLevelBvh) -> Result<()> {
        let [lower, upper] = self.bounds;
        let bounds = index.bounds();
        let before = self.index_bounds;
        let inside =
            bounds.lower.cmpge(lower.min(before.lower)).all() && bounds.upper.cmple(upper.max(before.upper)).all();
        if inside {
            return Ok(());
        }
        Err(Error::setting(
            "instances",
            format!("{bounds:?}"),
            "would leave the box around the scene",
        ))
    }

    /// Uploads what differs in another index, and has it instead.
    fn upload_kept(&self, gpu: &Gpu, kept: &mut Kept, index: TwoLevelBvh, mesh: Option<usize>) -> Result<()> {
        let meshes = mesh.map(|mesh| index.mesh_texels(mesh)).into_iter().flatten();
        for range in [index.top_texels(), index.instance_texels()].into_iter().chain(meshes) {
            let offset = (range.start * size_of::<[u32; 4]>()) as u64;
            gpu.upload(self.index.texels.buffer(), offset, &index.texels()[range])?;
        }
        kept.index = index;
        let Kept { instances, index } = kept;
        instances.place_records(index);
        gpu.upload(self.buffers.instances.buffer(), 0, &instances.records)
    }
}
