//! Objects that move on the device: for what is rasterized, and, where instances are kept, for rays.

use glam::{DAffine3, Vec3};

use super::geometry::{Geometry, corners_of, instances_in_order};
use super::kept::{met_box, not_kept};
use super::{GpuScene, Kept, lock};
use crate::accel::two_level::InstanceTransform;
use crate::accel::{Aabb, DeviceTraversal, IndexReport, RayIndex, can_be_met, wide};
use crate::gpu::shaders::types::SceneTriangle;
use crate::gpu::{Gpu, TexelView};
use crate::scene::check::check_mesh;
use crate::scene::{Instance, Mesh, Scene};
use crate::{Error, Result};

impl GpuScene {
    /// Puts an object (an instance of the scene, by its index) to another place, for what is rasterized from here on: triangles, normals and tangents
    /// are as if the scene had been made with it there, bit for bit. The ray index stays, so that rays still meet the object where it was, until
    /// [`GpuScene::refit_index`].
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

    /// Refits the ray index to where objects have been moved ([`GpuScene::move_object`]): rays meet them there from here on, as if the scene had been made so, but
    /// for triangles without an area to speak of, which the build left out and which stay out. The tree keeps its form, so rays are fast where little has moved, and what is known of it ([`GpuScene::index_statistics`]) stays that of its build. It is
    /// brought to the host and back, with all triangles.
    ///
    /// Pictures under way must be restarted, or they mix both; nothing that reads the scene may be under way.
    ///
    /// # Errors
    /// [`Error::Setting`] for an index that is no wide hierarchy, and for scenes that keep their instances, whose index follows by itself; [`Error::DeviceLost`],
    /// [`Error::OutOfMemory`].
    pub fn refit_index(&self, gpu: &Gpu) -> Result<()> {
        let IndexReport {
            kind,
            statistics,
            instead_because,
            ..
        } = self.index.report;
        if self.index.traversal != DeviceTraversal::Wide {
            let why = instead_because.map_or(String::new(), |why| format!("; it stands for another, since {why}"));
            let cause = format!("cannot be refitted to objects that moved; wide can{why}");
            return Err(Error::setting("index", kind, cause));
        }
        if statistics.triangles == 0 {
            return Ok(());
        }
        let all = statistics.triangles + statistics.excluded_range + statistics.excluded_degenerate;
        let triangles: Vec<SceneTriangle> = gpu.read(self.buffers.triangles.buffer().view(), all as usize)?;
        let corners: Vec<[Vec3; 3]> = triangles.iter().map(corners_of).collect();
        wide::refit_resident(gpu, &self.index.texels, statistics, &corners)
    }

    /// Puts instances of the scene, by their numbers, to other places, where instances are kept: rays meet them there from here on, as if the scene had been
    /// made so. Of the index only the tree over the instances is made anew ([`GpuScene::index_work`] counts). What is known of the scene as a whole stays: its
    /// box ([`GpuScene::bounds`]), with the power of distant lights, its [`GpuScene::surface_area`], and which lights are inside bodies that absorb.
    ///
    /// Pictures under way must be restarted, or they mix both; nothing that reads the scene may be under way.
    ///
    /// # Errors
    /// [`Error::Setting`] for an instance that is not kept, for a transform that rays cannot be traced through
    /// ([`InstanceTransform::of`](crate::accel::two_level::InstanceTransform::of)), and for one by which a triangle would leave the box around the scene, and
    /// nothing has moved then; [`Error::DeviceLost`], [`Error::OutOfMemory`], after which the scene has to be made again.
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
            let found = kept.index.transform(placement, transform);
            let found = found.map_err(|error| kept.instances.in_scene(error))?;
            let triangles = kept.index.corners_at(placement);
            self.check_inside(*object, &found, Some(&found.bounds), triangles)?;
            placements.push((placement, *transform));
        }
        kept.index.move_instances(&placements)?;
        self.upload_kept(gpu, &mut kept, None)
    }

    /// Gives a mesh of the scene that is kept another shape: as many vertices, and the same triangles. Its tree keeps its form, so rays are fast where
    /// little has moved. Normals and tangents are those of `mesh`; colours and texture coordinates stay, and what [`GpuScene::move_instances`] says.
    ///
    /// `scene` is the one that this was made of. Pictures under way must be restarted, or they mix both; nothing that reads the scene may be under way.
    ///
    /// # Errors
    /// [`Error::Setting`] for a mesh that is not kept, that [`Scene::check`] would refuse, or that has other triangles or another number of vertices, normals or tangents, for
    /// one that its instances cannot place, and for one by which a triangle would leave the box around the scene, and nothing has changed then; [`Error::DeviceLost`],
    /// [`Error::OutOfMemory`], after which the scene has to be made again.
    pub fn refit_mesh(&self, gpu: &Gpu, scene: &Scene, number: usize, mesh: &Mesh) -> Result<()> {
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
            let cause = "has other triangles, or another number of vertices, normals or tangents";
            return Err(Error::setting("mesh", number, cause));
        }
        let shape = Mesh {
            material: known.material,
            ..mesh.clone()
        };
        if let Err((field, cause)) = check_mesh(&shape, scene.materials.len()) {
            return Err(Error::setting(format!("mesh{field}"), number, cause));
        }
        let mut moved = Geometry::default();
        moved.store(scene, &shape, &self.profile)?;
        let corners: Vec<[Vec3; 3]> = moved.triangles.iter().map(corners_of).collect();
        let part = met_box(corners.iter().copied());
        for (i, placement) in kept.index.placements().iter().enumerate() {
            let Some(object) = kept.instances.object(i).filter(|_| placement.mesh as usize == place) else {
                continue;
            };
            let loose = part.and_then(|part| InstanceTransform::of(&placement.transform, &[part]));
            let met = corners.iter().copied().filter(can_be_met);
            // Images are made by what does not depend on the shape.
            let transform = &kept.index.transforms()[i];
            self.check_inside(object, transform, loose.map(|loose| loose.bounds).as_ref(), met)?;
        }
        let refitted = kept.index.refit_mesh(place, &corners);
        refitted.map_err(|error| kept.instances.in_scene(error))?;
        self.upload_kept(gpu, &mut kept, Some(place))?;
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

    /// Refuses an instance that would reach beyond the box around the scene: by its loose box or else by its triangles' images.
    fn check_inside(
        &self,
        object: usize,
        transform: &InstanceTransform,
        loose: Option<&Aabb>,
        triangles: impl Iterator<Item = [Vec3; 3]>,
    ) -> Result<()> {
        let [lower, upper] = self.bounds;
        let inside = |low: Vec3, high: Vec3| low.cmpge(lower).all() && high.cmple(upper).all();
        let is_inside = loose.is_some_and(|loose| inside(loose.lower, loose.upper))
            || triangles
                .flat_map(|triangle| transform.triangle(triangle))
                .all(|p| inside(p, p));
        if is_inside {
            return Ok(());
        }
        let cause = format!("would leave the box around the scene, from {lower} to {upper}");
        Err(Error::setting("object", object, cause))
    }

    /// Uploads what has changed in the index.
    fn upload_kept(&self, gpu: &Gpu, kept: &mut Kept, mesh: Option<usize>) -> Result<()> {
        let Kept { instances, index } = kept;
        let meshes = mesh.map(|mesh| index.mesh_texels(mesh)).into_iter().flatten();
        for range in [index.top_texels(), index.instance_texels()].into_iter().chain(meshes) {
            let offset = (range.start * size_of::<[u32; 4]>()) as u64;
            gpu.upload(self.index.texels.buffer(), offset, &index.texels()[range])?;
        }
        instances.place_records(index);
        gpu.upload(self.buffers.instances.buffer(), 0, &instances.records)
    }
}
