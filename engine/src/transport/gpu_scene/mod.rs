//! A scene on the device: world-space triangles, materials, textures, lights and a ray index, in the buffers of sets 1 and 2.
//!
//! What a scene lacks is not allocated: its binding holds one texel that no specialized kernel reads. Deterministic:
//! equal scenes give equal bytes.

mod airlight;
mod bodies;
mod geometry;
mod glow;
mod index;
mod kept;
mod light_tree;
mod lights;
mod materials;
mod media;
mod moving;
mod punctual;
mod textures;

use std::path::Path;
use std::sync::Mutex;

use glam::{DVec3, Vec3};

use self::bodies::Bodies;
use self::geometry::{Geometry, check_placed, visible_objects};
pub(crate) use self::glow::Glow;
use self::index::{index_for, index_over_instances};
use self::kept::{Keeping, KeptInstances, Room};
use self::light_tree::TreeOfLights;
use self::lights::Lights;
pub(crate) use self::lights::light_record;
use self::materials::{Metals, material_quarters, material_record, materials_by_use};
use self::media::GpuMedia;
use self::punctual::PunctualLights;
use self::textures::Textures;
use super::albedo::AlbedoTable;
use super::bsdf::{BsdfFeatures, may_have_diffuse_base};
use crate::accel::two_level::{TwoLevelBvh, TwoLevelWork};
use crate::accel::{DeviceTraversal, IndexBinding, IndexKind, IndexOnDevice, IndexReport, IndexStatistics, RayIndex};
use crate::gpu::ash::vk;
use crate::gpu::shaders::constants::{self, SHADOW_SURFACES, SHADOW_SURFACES_ALPHA};
use crate::gpu::shaders::sets::{MediaSet, SceneSet};
use crate::gpu::shaders::types::SceneLight;
use crate::gpu::{Category, DeviceKind, Gpu, SOFTWARE_LOOP_CAP, TexelView};
use crate::raster::{ObjectTriangles, SurfaceFeatures, Surfaces};
use crate::scene::{Environment, LightKind, Material, Scene, SceneProfile};
use crate::{Error, Result};

/// A scene in device memory. Make it once and render it with any technique.
#[derive(Debug)]
pub struct GpuScene {
    profile: SceneProfile,
    bsdf: BsdfFeatures,
    has_diffuse_base: bool,
    objects: Vec<ObjectTriangles>,
    bounds: [Vec3; 2],
    surface_area: f64,
    light_power: f64,
    light_kinds: LightKinds,
    /// Only where media emit.
    glow: Option<Glow>,
    airlight_helps: bool,
    /// What photons choose by, where light sampling leaves some to scattered rays.
    emission_cdf: Option<Vec<f32>>,
    punctual_lights: PunctualLights,
    light_tree: TreeOfLights,
    index: IndexOnDevice,
    /// Where instances are kept: what moves them.
    kept: Option<Mutex<Kept>>,
    buffers: SceneBuffers,
    /// Where it matters which body a point is in.
    bodies: Option<Bodies>,
    media: Option<GpuMedia>,
}

/// Kept instances and their index, as the device has them.
#[derive(Debug)]
struct Kept {
    instances: KeptInstances,
    index: TwoLevelBvh,
}

/// Which kinds of lights there are to choose: emitters without area and lights without power are none.
#[derive(Debug, Clone, Copy, Default)]
struct LightKinds {
    area: bool,
    punctual: bool,
    environment: bool,
}

#[derive(Debug)]
struct SceneBuffers {
    triangles: TexelView,
    vertices: TexelView,
    normals: TexelView,
    uvs: TexelView,
    tangents: TexelView,
    colors: TexelView,
    materials: TexelView,
    textures: TexelView,
    texels: TexelView,
    lights: TexelView,
    cdf: TexelView,
    environment: TexelView,
    albedo_table: TexelView,
    instances: TexelView,
}

/// How kernels trace rays that stop for good at a quota.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct IndexWithin {
    /// What kernels are specialized by, as the quota.
    pub kind: u32,
    /// Steps after which a ray stops.
    pub quota: u32,
    /// Steps that a ray takes, at most.
    pub steps: u64,
}

/// Loop iterations that a ray of a scene may take in one dispatch on a software device: with media half of [`SOFTWARE_LOOP_CAP`] is for walks through grids, and the
/// rest for all surfaces that a shadow ray passes.
pub(crate) fn ray_iterations(profile: &SceneProfile) -> u32 {
    match (profile.has_alpha(), profile.media.any()) {
        (_, false) => SOFTWARE_LOOP_CAP,
        (false, true) => SOFTWARE_LOOP_CAP / 2 / SHADOW_SURFACES,
        (true, true) => SOFTWARE_LOOP_CAP / 2 / SHADOW_SURFACES_ALPHA,
    }
}

impl GpuScene {
    /// Checks the scene, builds its index on the host's threads, of the kind that is the default, and uploads everything.
    ///
    /// # Errors
    /// [`Error::Scene`] for a scene that does not pass [`Scene::check`],
    /// [`Error::LimitExceeded`] for one that does not fit the device.
    pub fn new(gpu: &Gpu, scene: &Scene) -> Result<Self> {
        Self::with_index(gpu, scene, &IndexKind::default())
    }

    /// As [`GpuScene::new`], with the ray index of the host's choice. Pictures do not depend on it, but for two levels. A kd-tree with a leaf that is too long for a software device's loops,
    /// as where thousands of triangles lie in one place, is replaced by the binned hierarchy, and the report says so ([`IndexReport::instead_because`]).
    ///
    /// With [`IndexKind::TwoLevel`] instances are kept: meshes that are placed more than once are stored once, but for those that emit light, those without an area, those that are
    /// bodies in scenes with media, those that absorb with a light in the box around them, and instances by transforms too uneven for rays ([`InstanceTransform::of`](crate::accel::two_level::InstanceTransform::of)). Their vertices are in
    /// other places by rounding in f32, so pictures differ by as much. [`IndexKind::Automatic`] keeps instances where flattening them would need at least eight times as
    /// many bytes of geometry and index as that, and 64 MiB or more, or more texels than the device can bind, or more bytes than it has memory; elsewhere it is the
    /// wide hierarchy.
    /// What is rasterized needs flattened scenes.
    ///
    /// # Errors
    /// As [`GpuScene::new`], [`Error::Setting`] for settings of the index that are out of range, and [`Error::MissingFeature`] for one that the device
    /// has not.
    pub fn with_index(gpu: &Gpu, scene: &Scene, kind: &IndexKind) -> Result<Self> {
        Self::with_kept_index(gpu, scene, kind, None)
    }

    /// As [`GpuScene::with_index`]; with a folder a kd-tree is read from there where the same was kept before, and kept there otherwise.
    ///
    /// # Errors
    /// As [`GpuScene::with_index`]; what cannot be read or written there is none.
    pub fn with_kept_index(gpu: &Gpu, scene: &Scene, kind: &IndexKind, folder: Option<&Path>) -> Result<Self> {
        scene.check()?;
        let mut profile = SceneProfile::of(scene);
        let limit = gpu.caps().max_texel_buffer_elements;
        let room = Room {
            texels: limit,
            bytes: gpu.caps().device_heap,
        };
        let keeping = match kind {
            IndexKind::TwoLevel(settings) => Keeping::of(scene, &profile).map(|keeping| (keeping, settings)),
            IndexKind::Automatic(settings) => Keeping::of(scene, &profile)
                .filter(|keeping| keeping.pays(scene, &profile, room))
                .map(|keeping| (keeping, settings)),
            _ => None,
        };
        check_placed(scene, &profile, keeping.as_ref().map(|(keeping, _)| keeping), limit)?;
        let mut geometry = match &keeping {
            Some((keeping, _)) => Geometry::keep(scene, &profile, keeping)?,
            None => Geometry::flatten(scene, &profile)?,
        };
        profile.keeps_instances = geometry.kept.is_some();
        let bodies = bodies::matter(scene, &profile).then(|| Bodies::place(scene, &mut geometry));
        let bounds = geometry.bounds();
        let kept = match &keeping {
            Some((_, settings)) => index_over_instances(gpu, &mut geometry, &profile, settings)?,
            None => None,
        };
        let (index, kept) = match kept {
            Some((index, kept)) => (index, Some(Mutex::new(kept))),
            None => (index_for(gpu, &geometry, &profile, kind, folder)?, None),
        };
        let default = Material::default();
        let materials = materials_by_use(scene, &default);
        let placed = materials
            .iter()
            .filter(|(material, placed)| *placed && !material.boundary);
        let placed = placed.map(|(material, _)| *material);
        let has_diffuse_base = placed.clone().any(may_have_diffuse_base);
        let bsdf = BsdfFeatures::of_materials(placed);
        let (mut textures, mut metals) = (Textures::default(), Metals::default());
        let records: Vec<_> = materials
            .iter()
            .map(|(material, _)| material_record(&mut textures, &mut metals, scene, material))
            .collect();
        let mut lights = Lights::collect(scene, &profile, &mut geometry, &records, bounds)?;
        if let Some(bodies) = &bodies {
            bodies.enclose(scene, &mut lights.records, &geometry);
        }
        let quarters = material_quarters(&records, metals.tables());
        let albedo: &[f32] = if bsdf.specular_layer || bsdf.multiple_scattering {
            &AlbedoTable::shared().values
        } else {
            &[]
        };
        let buffers = SceneBuffers::upload(gpu, &geometry, &quarters, &textures, &lights, albedo)?;
        let has_media = profile.media.any();
        let media = has_media.then(|| GpuMedia::new(gpu, scene)).transpose()?;
        let surrounding = media.as_ref().and_then(|media| media.surrounding);
        let glow = bodies.as_ref().filter(|_| profile.media.emits);
        let glow = glow.and_then(|bodies| Glow::new(scene, surrounding, bodies));
        Ok(Self {
            bsdf,
            has_diffuse_base,
            // What is rasterized is drawn triangle by triangle.
            objects: match profile.keeps_instances {
                true => Vec::new(),
                false => visible_objects(scene),
            },
            profile,
            bounds,
            surface_area: geometry.surface_area(),
            light_power: lights.power,
            light_kinds: lights.kinds(),
            glow,
            airlight_helps: airlight::airlight_helps(scene),
            emission_cdf: lights.emission_cdf,
            punctual_lights: lights.punctual,
            light_tree: lights.tree,
            index,
            kept,
            buffers,
            bodies,
            media,
        })
    }

    /// What the scene needs.
    pub fn profile(&self) -> &SceneProfile {
        &self.profile
    }

    /// What the index of two levels has built so far, where instances are kept.
    pub fn index_work(&self) -> Option<TwoLevelWork> {
        self.kept.as_ref().map(|kept| lock(kept).index.work())
    }

    /// What its materials need of the scattering function.
    pub fn bsdf_features(&self) -> BsdfFeatures {
        self.bsdf
    }

    /// Whether light may be scattered diffusely by some surface: where it is not, no map of photons on surfaces has anything.
    pub(crate) fn has_diffuse_base(&self) -> bool {
        self.has_diffuse_base
    }

    /// Size and quality of its ray index, as it is now.
    pub fn index_statistics(&self) -> IndexStatistics {
        let built = self.index.report.statistics;
        self.kept.as_ref().map_or(built, |kept| lock(kept).index.statistics())
    }

    /// Which ray index it has and how long its build took, with size and quality as they are now.
    pub fn index_report(&self) -> IndexReport {
        IndexReport {
            statistics: self.index_statistics(),
            ..self.index.report
        }
    }

    /// Its ray index.
    pub(crate) fn index_on_device(&self) -> &IndexOnDevice {
        &self.index
    }

    /// How kernels traverse its ray index.
    pub fn index_traversal(&self) -> DeviceTraversal {
        self.index.traversal
    }

    /// How kernels trace rays of at most so many steps each, which do not go on elsewhere when they stop.
    ///
    /// # Errors
    /// [`Error::LimitExceeded`] for an index whose leaves are too long for a software device.
    pub fn index_within(&self, gpu: &Gpu, steps: u32) -> Result<IndexWithin> {
        let traversal = self.index.traversal;
        let mut quota = traversal.quota_within(gpu.caps(), steps, steps, false)?;
        let texels = self.index.texels.buffer().bytes() / size_of::<[u32; 4]>() as u64;
        // Rays from beyond its reach try all triangles.
        let triangles = texels / u64::from(constants::DRIVER_TRIANGLE_TEXELS);
        if traversal == DeviceTraversal::Driver && triangles > u64::from(quota) {
            if gpu.caps().kind == DeviceKind::Cpu {
                return Err(Error::LimitExceeded {
                    name: "triangles in the driver's structure".into(),
                    value: triangles,
                    limit_name: "iterations of a software device's loops",
                    limit: quota.into(),
                });
            }
            quota = u32::try_from(triangles).unwrap_or(u32::MAX);
        }
        Ok(IndexWithin {
            kind: traversal.kind(),
            quota,
            steps: match traversal {
                // A step is a node or a triangle, of a texel or more, and none is met twice.
                DeviceTraversal::Bvh2 | DeviceTraversal::Driver => texels.min(quota.into()),
                // A round's further iterations beside a node's five texels and a triangle's three.
                DeviceTraversal::Wide => (2 * texels).min(quota.into()),
                // A mesh is met once an instance.
                DeviceTraversal::Kd { .. } | DeviceTraversal::TwoLevel => quota.into(),
            },
        })
    }

    /// As [`index_within`](Self::index_within), for kernels that ask about candidates where surfaces let light through in places: lanes that ask wait for each other, whose iterations software devices add up.
    ///
    /// # Errors
    /// As there, and for quotas that are too small once lanes wait.
    pub fn filtered_index_within(&self, gpu: &Gpu, steps: u32) -> Result<IndexWithin> {
        let within = self.index_within(gpu, steps)?;
        if !self.profile.has_alpha() || gpu.caps().kind != DeviceKind::Cpu {
            return Ok(within);
        }
        let quota = (steps / gpu.caps().subgroup_size.max(1)).min(within.quota);
        let quota = self.index.traversal.quota_within(gpu.caps(), quota, steps, true)?;
        Ok(IndexWithin { quota, ..within })
    }

    /// Least and greatest corner, world space, metres.
    pub fn bounds(&self) -> [Vec3; 2] {
        self.bounds
    }

    /// What is rasterized of it: all triangles but those of invisible boundaries; none where instances are kept ([`SceneProfile::keeps_instances`]).
    pub fn surfaces(&self) -> Surfaces<'_> {
        Surfaces {
            set: self.scene_set(),
            triangles: self.objects.last().map_or(0, |last| last.triangles.end),
            objects: &self.objects,
            features: SurfaceFeatures::of(&self.profile),
            bounds: self.bounds,
        }
    }

    /// Area of all triangles, m², as the scene has been made: what moves or is refitted since does not change it.
    pub fn surface_area(&self) -> f64 {
        self.surface_area
    }

    /// Power of the lights that light sampling chooses among, W of luminance; that of distant ones is what they send through a disk as large
    /// as the bounding sphere of the scene.
    pub fn light_power(&self) -> f64 {
        self.light_power
    }

    /// Where photons of media that emit start.
    pub(crate) fn glow(&self) -> Option<&Glow> {
        self.glow.as_ref()
    }

    /// True when there is anything for light sampling to choose.
    pub fn has_lights(&self) -> bool {
        let kinds = self.light_kinds;
        kinds.area || kinds.punctual || kinds.environment
    }

    /// Lights that light sampling chooses among: each triangle that emits, each point, spot and direction, and the environment.
    pub(crate) fn light_count(&self) -> u32 {
        (self.buffers.lights.buffer().bytes() / (u64::from(constants::LIGHT_QUARTERS) * size_of::<[u32; 4]>() as u64))
            as u32
    }

    /// True when some surface of positive area emits.
    pub fn has_area_lights(&self) -> bool {
        self.light_kinds.area
    }

    /// True when some point, spot or directional light has power.
    pub fn has_punctual_lights(&self) -> bool {
        self.light_kinds.punctual
    }

    /// Whether light on ways through media is worth equi-angular samples: that of lamps smaller than half a mean free path, in media that light
    /// enters unbent.
    pub(crate) fn airlight_helps(&self) -> bool {
        self.airlight_helps && (self.light_kinds.area || self.light_kinds.punctual)
    }

    /// How many lights have a place, emissive triangles and points and spots with power, so that a tree can choose among them.
    pub fn near_light_count(&self) -> usize {
        self.light_tree.near_count()
    }

    /// The tree by which light sampling may choose among the lights that have a place ([`light_tree`](crate::transport::light_tree)), for
    /// [`Self::light_tree_set`]: made when it is first asked for, and anew where lights have moved since. `None` where no light has a place.
    ///
    /// # Errors
    /// [`Error::OutOfMemory`], [`Error::LimitExceeded`] for more lights than a buffer of the device holds, [`Error::DeviceLost`].
    pub fn light_tree(&self, gpu: &Gpu) -> Result<Option<TexelView>> {
        self.light_tree.on_device(gpu)
    }

    /// Moves or turns a point, spot or directional light, by its index in [`Scene::lights`]: as if the scene had been made with the light like
    /// this. Where light sampling chooses by power, its probabilities stay, so the light's kind and its power must.
    ///
    /// Pictures under way must be restarted ([`PathTracer::restart`](crate::techniques::PathTracer::restart),
    /// [`PhotonMapper::restart`](crate::techniques::photon_mapping::PhotonMapper::restart) or
    /// [`Technique::set_camera`](crate::techniques::Technique::set_camera)), or they mix both; none of the scene's may be in the middle of a step.
    ///
    /// # Errors
    /// [`Error::Setting`] for a light that does not exist or has no power, for one of another kind or another power, and for
    /// numbers that [`Scene::check`] refuses; [`Error::DeviceLost`], [`Error::OutOfMemory`].
    pub fn move_light(&self, gpu: &Gpu, light: usize, kind: &LightKind) -> Result<()> {
        let (mut record, index) = self.punctual_lights.moved(light, kind)?;
        if let Some(bodies) = &self.bodies {
            bodies.enclose_point(&mut record);
        }
        let offset = u64::from(index) * size_of::<SceneLight>() as u64;
        gpu.upload(self.buffers.lights.buffer(), offset, &[record])?;
        self.punctual_lights.keep(light, kind);
        self.light_tree.moved(index, kind);
        Ok(())
    }

    /// The point, spot and directional lights that have power, as they are now, in the order of [`Scene::lights`].
    pub fn lights_without_area(&self) -> Vec<LightKind> {
        self.punctual_lights.shining()
    }

    /// The environment as it is on the device, its strength multiplied in; `None` without one.
    ///
    /// # Errors
    /// [`Error::DeviceLost`], [`Error::OutOfMemory`].
    pub fn read_environment(&self, gpu: &Gpu) -> Result<Option<Environment>> {
        if !self.profile.has_environment() {
            return Ok(None);
        }
        lights::read_environment(gpu, self.buffers.environment.buffer()).map(Some)
    }

    /// Set 3. Without participating media no specialized kernel reads it, and other buffers stand there.
    pub fn media_set(&self) -> MediaSet<'_> {
        let b = &self.buffers;
        self.media.as_ref().map_or(
            MediaSet {
                media_records: &b.materials,
                media_densities: &b.cdf,
                media_majorants: &b.cdf,
            },
            GpuMedia::set,
        )
    }

    /// Of each of the participating media that scatter the greatest extinction coefficient of any band anywhere, 1/m: the least and the greatest of these; `None`
    /// without any.
    pub fn extinctions(&self) -> Option<[f64; 2]> {
        self.media.as_ref()?.extinctions
    }

    /// Index of the medium outside all bodies, if there is one that does something.
    pub fn surrounding(&self) -> Option<u32> {
        self.media.as_ref()?.surrounding
    }

    /// Index of the material of the innermost body around a point, in scenes with participating media: of the solids that refract and the
    /// boundaries of media.
    pub fn body_around(&self, point: DVec3) -> Option<u32> {
        self.media.as_ref()?;
        self.bodies.as_ref()?.around(point)
    }

    /// Set 1.
    pub fn index_set(&self) -> IndexBinding<'_> {
        self.index.set()
    }

    /// Set 2.
    pub fn scene_set(&self) -> SceneSet<'_> {
        let b = &self.buffers;
        SceneSet {
            scene_triangles: &b.triangles,
            scene_vertices: &b.vertices,
            scene_normals: &b.normals,
            scene_uvs: &b.uvs,
            scene_tangents: &b.tangents,
            scene_colors: &b.colors,
            scene_materials: &b.materials,
            scene_textures: &b.textures,
            scene_texels: &b.texels,
            scene_lights: &b.lights,
            scene_cdf: &b.cdf,
            scene_environment: &b.environment,
            scene_albedo_table: &b.albedo_table,
            // Of the same format; kernels without a tree do not read it.
            scene_light_tree: &b.materials,
            scene_instances: &b.instances,
        }
    }

    /// Set 2 for kernels that choose lights by [`Self::light_tree`], where there is one.
    pub fn light_tree_set<'a>(&'a self, tree: Option<&'a TexelView>) -> SceneSet<'a> {
        let set = self.scene_set();
        SceneSet {
            scene_light_tree: tree.unwrap_or(set.scene_light_tree),
            ..set
        }
    }
}

/// What is behind a lock, also where a thread has panicked that held it.
fn lock(kept: &Mutex<Kept>) -> std::sync::MutexGuard<'_, Kept> {
    kept.lock().unwrap_or_else(std::sync::PoisonError::into_inner)
}

impl GpuScene {
    /// The probabilities by which photons leave lights, where they are others than those of light sampling, for [`Self::emission_set`].
    pub(crate) fn emission_choice(&self, gpu: &Gpu) -> Result<Option<TexelView>> {
        let upload = |cdf: &Vec<f32>| {
            let data = bytemuck::cast_slice(cdf);
            gpu.texels_with::<u8>("photon probabilities", Category::Light, vk::Format::R32_SFLOAT, data)
        };
        self.emission_cdf.as_ref().map(upload).transpose()
    }

    /// Set 2 for the emission of photons.
    pub(crate) fn emission_set<'a>(&'a self, choice: Option<&'a TexelView>) -> SceneSet<'a> {
        let set = self.scene_set();
        SceneSet {
            scene_cdf: choice.unwrap_or(&self.buffers.cdf),
            ..set
        }
    }
}

impl SceneBuffers {
    fn upload(
        gpu: &Gpu,
        geometry: &Geometry,
        materials: &[[u32; 4]],
        textures: &Textures,
        lights: &Lights,
        albedo: &[f32],
    ) -> Result<Self> {
        // One for each kind of component, since a fetch must agree with its format.
        let [no_words, no_floats] = [vk::Format::R32_UINT, vk::Format::R32_SFLOAT]
            .map(|format| gpu.texels_with::<u32>("absent", Category::Material, format, &[]));
        let (no_words, no_floats) = (no_words?, no_floats?);
        let optional = |name: &str, category, format, data: &[u8], absent: &TexelView| {
            if data.is_empty() {
                Ok(absent.clone())
            } else {
                gpu.texels_with(name, category, format, data)
            }
        };
        let words = |name: &str, category, data: &[u8]| optional(name, category, vk::Format::R32_UINT, data, &no_words);
        let quarters = |name: &str, category, data: &[u8]| {
            optional(name, category, vk::Format::R32G32B32A32_UINT, data, &no_words)
        };
        let floats = |name: &str, category, data: &[f32]| {
            optional(
                name,
                category,
                vk::Format::R32_SFLOAT,
                bytemuck::cast_slice(data),
                &no_floats,
            )
        };
        let vectors = |name: &str, data: &[[f32; 4]]| {
            let format = vk::Format::R32G32B32A32_SFLOAT;
            optional(name, Category::Geometry, format, bytemuck::cast_slice(data), &no_floats)
        };
        let [a, b, c] = [Category::Geometry, Category::Material, Category::Light];
        Ok(Self {
            triangles: quarters("triangles", a, bytemuck::cast_slice(&geometry.triangles))?,
            vertices: quarters("vertices of triangles", a, bytemuck::cast_slice(&geometry.vertices))?,
            normals: vectors("normals", &geometry.normals)?,
            uvs: vectors("texture coordinates", &geometry.uvs)?,
            tangents: vectors("tangents", &geometry.tangents)?,
            colors: vectors("vertex colours", &geometry.colors)?,
            materials: quarters("materials", b, bytemuck::cast_slice(materials))?,
            textures: quarters("textures", b, bytemuck::cast_slice(&textures.records))?,
            texels: words("texels", b, bytemuck::cast_slice(&textures.texels))?,
            lights: quarters("lights", c, bytemuck::cast_slice(&lights.records))?,
            cdf: floats("light probabilities", c, &lights.cdf)?,
            environment: quarters("environment", c, &lights.environment)?,
            albedo_table: floats("albedo table", b, albedo)?,
            instances: match &geometry.kept {
                Some(kept) => quarters("instances", a, bytemuck::cast_slice(&kept.records))?,
                None => no_words,
            },
        })
    }
}
