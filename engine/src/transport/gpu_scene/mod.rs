//! A scene on the device: world-space triangles, materials, textures, lights and a ray index, in the buffers of sets 1 and 2.
//!
//! What a scene lacks is not allocated: its binding holds a shared buffer of 16 bytes that no specialized kernel reads. Deterministic:
//! equal scenes give equal bytes.

mod geometry;
mod lights;
mod materials;
mod textures;

use glam::Vec3;

use self::geometry::Geometry;
use self::lights::Lights;
use self::materials::{material_record, materials_by_use};
use self::textures::Textures;
use super::albedo::AlbedoTable;
use super::bsdf::BsdfFeatures;
use crate::Result;
use crate::accel::bvh2::{Bvh2, Bvh2Settings};
use crate::accel::{IndexStatistics, RayIndex};
use crate::gpu::ash::vk;
use crate::gpu::shaders::sets::{Bvh2Set, SceneSet};
use crate::gpu::shaders::types::SceneMaterial;
use crate::gpu::{Buffer, Category, Gpu, TexelView};
use crate::scene::{Material, Scene, SceneProfile};

/// A scene in device memory. Make it once and render it with any technique.
#[derive(Debug)]
pub struct GpuScene {
    profile: SceneProfile,
    bsdf: BsdfFeatures,
    statistics: IndexStatistics,
    bounds: [Vec3; 2],
    light_kinds: LightKinds,
    index: TexelView,
    buffers: SceneBuffers,
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
    positions: Buffer,
    triangles: Buffer,
    normals: Buffer,
    uvs: Buffer,
    tangents: Buffer,
    colors: Buffer,
    materials: Buffer,
    textures: Buffer,
    texels: Buffer,
    lights: Buffer,
    cdf: Buffer,
    environment: Buffer,
    albedo_table: Buffer,
}

impl GpuScene {
    /// Checks the scene, builds its index on the host's threads and uploads everything.
    ///
    /// # Errors
    /// [`Error::Scene`](crate::Error::Scene) for a scene that does not pass [`Scene::check`],
    /// [`Error::LimitExceeded`](crate::Error::LimitExceeded) for one that does not fit the device.
    pub fn new(gpu: &Gpu, scene: &Scene) -> Result<Self> {
        scene.check()?;
        let profile = SceneProfile::of(scene);
        let mut geometry = Geometry::flatten(scene, &profile)?;
        let bounds = geometry.bounds();
        let bvh = Bvh2::build(&geometry.corners(), &Bvh2Settings::default())?;
        let index = gpu.texels_with(bvh.name(), Category::Index, vk::Format::R32G32B32A32_UINT, bvh.packed())?;
        let default = Material::default();
        let materials = materials_by_use(scene, &default);
        let placed = materials.iter().filter(|(_, placed)| *placed);
        let bsdf = BsdfFeatures::of_materials(placed.map(|(material, _)| *material));
        let mut textures = Textures::default();
        let records: Vec<_> = materials
            .iter()
            .map(|(material, _)| material_record(&mut textures, scene, material))
            .collect();
        let lights = Lights::collect(scene, &profile, &mut geometry, &records, bounds)?;
        let albedo: &[f32] = if bsdf.specular_layer || bsdf.multiple_scattering {
            &AlbedoTable::shared().values
        } else {
            &[]
        };
        let buffers = SceneBuffers::upload(gpu, &geometry, &records, &textures, &lights, albedo)?;
        Ok(Self {
            profile,
            bsdf,
            statistics: bvh.statistics(),
            bounds,
            light_kinds: lights.kinds(),
            index,
            buffers,
        })
    }

    /// What the scene needs.
    pub fn profile(&self) -> &SceneProfile {
        &self.profile
    }

    /// What its materials need of the scattering function.
    pub fn bsdf_features(&self) -> BsdfFeatures {
        self.bsdf
    }

    /// Size and quality of its ray index.
    pub fn index_statistics(&self) -> IndexStatistics {
        self.statistics
    }

    /// Least and greatest corner, world space, metres.
    pub fn bounds(&self) -> [Vec3; 2] {
        self.bounds
    }

    /// True when there is anything for light sampling to choose.
    pub fn has_lights(&self) -> bool {
        let kinds = self.light_kinds;
        kinds.area || kinds.punctual || kinds.environment
    }

    /// True when some surface of positive area emits.
    pub fn has_area_lights(&self) -> bool {
        self.light_kinds.area
    }

    /// True when some point, spot or directional light has power.
    pub fn has_punctual_lights(&self) -> bool {
        self.light_kinds.punctual
    }

    /// Set 1.
    pub fn index_set(&self) -> Bvh2Set<'_> {
        Bvh2Set {
            bvh2_quarters: &self.index,
        }
    }

    /// Set 2.
    pub fn scene_set(&self) -> SceneSet<'_> {
        let b = &self.buffers;
        SceneSet {
            scene_positions: b.positions.view(),
            scene_triangles: b.triangles.view(),
            scene_normals: b.normals.view(),
            scene_uvs: b.uvs.view(),
            scene_tangents: b.tangents.view(),
            scene_colors: b.colors.view(),
            scene_materials: b.materials.view(),
            scene_textures: b.textures.view(),
            scene_texels: b.texels.view(),
            scene_lights: b.lights.view(),
            scene_cdf: b.cdf.view(),
            scene_environment: b.environment.view(),
            scene_albedo_table: b.albedo_table.view(),
        }
    }
}

impl SceneBuffers {
    fn upload(
        gpu: &Gpu,
        geometry: &Geometry,
        materials: &[SceneMaterial],
        textures: &Textures,
        lights: &Lights,
        albedo: &[f32],
    ) -> Result<Self> {
        let absent = gpu.buffer_with("absent", Category::Material, &[0u8; 16])?;
        let optional = |name: &str, category, bytes: &[u8]| {
            if bytes.is_empty() {
                Ok(absent.clone())
            } else {
                gpu.buffer_with(name, category, bytes)
            }
        };
        Ok(Self {
            positions: optional(
                "positions",
                Category::Geometry,
                bytemuck::cast_slice(&geometry.positions),
            )?,
            triangles: optional(
                "triangles",
                Category::Geometry,
                bytemuck::cast_slice(&geometry.triangles),
            )?,
            normals: optional("normals", Category::Geometry, bytemuck::cast_slice(&geometry.normals))?,
            uvs: optional(
                "texture coordinates",
                Category::Geometry,
                bytemuck::cast_slice(&geometry.uvs),
            )?,
            tangents: optional("tangents", Category::Geometry, bytemuck::cast_slice(&geometry.tangents))?,
            colors: optional(
                "vertex colours",
                Category::Geometry,
                bytemuck::cast_slice(&geometry.colors),
            )?,
            materials: optional("materials", Category::Material, bytemuck::cast_slice(materials))?,
            textures: optional("textures", Category::Material, bytemuck::cast_slice(&textures.records))?,
            texels: optional("texels", Category::Material, bytemuck::cast_slice(&textures.texels))?,
            lights: optional("lights", Category::Light, bytemuck::cast_slice(&lights.records))?,
            cdf: optional(
                "light probabilities",
                Category::Light,
                bytemuck::cast_slice(&lights.cdf),
            )?,
            environment: optional("environment", Category::Light, &lights.environment)?,
            albedo_table: optional("albedo table", Category::Material, bytemuck::cast_slice(albedo))?,
        })
    }
}
