//! A scene on the device: world-space triangles, materials, textures, lights and a ray index, in the buffers of sets 1 and 2.
//!
//! What a scene lacks is not allocated: its binding holds a shared buffer of 16 bytes that no specialized kernel reads. Transforms are
//! applied in f64 and rounded once. Deterministic: equal scenes give equal bytes.

use std::collections::BTreeMap;

use glam::{DMat3, DVec3, Vec3};

use super::albedo::AlbedoTable;
use super::bsdf::BsdfFeatures;
use super::distribution::build_distribution;
use super::environment::{environment_distribution, luminance};
use super::fresnel::fresnel_conductor_average;
use super::lights::{light_power, triangle_power};
use crate::accel::bvh2::{Bvh2, Bvh2Settings};
use crate::accel::{IndexStatistics, RayIndex};
use crate::gpu::ash::vk;
use crate::gpu::shaders::sets::{Bvh2Set, SceneSet};
use crate::gpu::shaders::types::{SceneLight, SceneMaterial, SceneTexture, SceneTriangle};
use crate::gpu::{Buffer, Category, Gpu, TexelView};
use crate::scene::{AlphaMode, Environment, Filter, LightKind, Material, Scene, SceneProfile, Texture, Wrap};
use crate::{Error, Result};

/// No light, no texture (`NO_LIGHT`, `NO_TEXTURE` of `scene/bindings.glsl`).
const NONE: u32 = u32::MAX;

// Flags of `scene/bindings.glsl` and `scene/texture.glsl`.
const MATERIAL_DOUBLE_SIDED: u32 = 1;
const MATERIAL_UNLIT: u32 = 2;
const MATERIAL_CONDUCTOR: u32 = 4;
const MATERIAL_MASK: u32 = 8;
const MATERIAL_BLEND: u32 = 16;
const LIGHT_TRIANGLE: u32 = 0;
const LIGHT_POINT: u32 = 1;
const LIGHT_SPOT: u32 = 2;
const LIGHT_DIRECTIONAL: u32 = 3;
const LIGHT_ENVIRONMENT: u32 = 4;
const LIGHT_DARK: u32 = 5;
const TEXTURE_SRGB: u32 = 1;
const TEXTURE_NEAREST: u32 = 2;
const TEXTURE_UV1: u32 = 4;
const TEXTURE_WRAP_U_SHIFT: u32 = 3;
const TEXTURE_WRAP_V_SHIFT: u32 = 5;

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
    /// [`Error::Scene`] for a scene that does not pass [`Scene::check`], [`Error::LimitExceeded`] for one that does not fit the device.
    pub fn new(gpu: &Gpu, scene: &Scene) -> Result<Self> {
        scene.check()?;
        let profile = SceneProfile::of(scene);
        let geometry = Geometry::flatten(scene, &profile)?;
        let bvh = Bvh2::build(&geometry.corners(), &Bvh2Settings::default())?;
        let parts = bvh.buffers();
        let [part] = parts.as_slice() else {
            return Err(Error::Setting {
                name: "index".into(),
                value: bvh.name().into(),
                cause: "does not have the one buffer of its set".into(),
            });
        };
        let index = gpu.texels_with(part.name, Category::Index, vk::Format::R32G32B32A32_UINT, part.bytes)?;
        let bounds = geometry.bounds();
        let default = Material::default();
        let placed = materials_by_use(scene, &default)
            .into_iter()
            .filter(|(_, placed)| *placed);
        let bsdf = BsdfFeatures::of_materials(placed.map(|(material, _)| material));
        let (buffers, light_kinds) = SceneBuffers::upload(gpu, scene, &profile, bsdf, geometry, bounds)?;
        Ok(Self {
            profile,
            bsdf,
            statistics: bvh.statistics(),
            bounds,
            light_kinds,
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

/// All materials with whether some instance places them; last the default one, for meshes that have none.
fn materials_by_use<'a>(scene: &'a Scene, default: &'a Material) -> Vec<(&'a Material, bool)> {
    let mut used = vec![false; scene.materials.len() + 1];
    for instance in &scene.instances {
        let material = scene.meshes[instance.mesh as usize].material;
        used[material.map_or(scene.materials.len(), |index| index as usize)] = true;
    }
    scene.materials.iter().chain([default]).zip(used).collect()
}

/// All instances flattened to world space.
#[derive(Default)]
struct Geometry {
    positions: Vec<Vec3>,
    normals: Vec<Vec3>,
    uvs: Vec<[f32; 4]>,
    tangents: Vec<[f32; 4]>,
    colors: Vec<[f32; 4]>,
    triangles: Vec<SceneTriangle>,
}

impl Geometry {
    fn flatten(scene: &Scene, profile: &SceneProfile) -> Result<Self> {
        let mut all = Self::default();
        let default_material = scene.materials.len() as u32;
        for instance in &scene.instances {
            let mesh = &scene.meshes[instance.mesh as usize];
            let base = u32::try_from(all.positions.len() + mesh.positions.len())
                .map(|end| end - mesh.positions.len() as u32)
                .map_err(|_| Error::scene(&scene.source, "instances", "place more than 2^32 vertices"))?;
            let linear = instance.transform.matrix3;
            // Cofactors transform normals without dividing by a determinant that may be zero.
            let cofactors = DMat3::from_cols(
                linear.y_axis.cross(linear.z_axis),
                linear.z_axis.cross(linear.x_axis),
                linear.x_axis.cross(linear.y_axis),
            );
            let flipped = linear.determinant() < 0.0;
            let orientation = if flipped { -1.0 } else { 1.0 };
            let count = mesh.positions.len();
            all.positions.extend(
                mesh.positions
                    .iter()
                    .map(|p| instance.transform.transform_point3(p.as_dvec3()).as_vec3()),
            );
            if profile.has_shading_normals {
                let normal = |n: &Vec3| (cofactors * n.as_dvec3() * orientation).normalize_or_zero().as_vec3();
                all.normals.extend(mesh.normals.iter().map(normal));
                // Zero stands for "flat" in the shader.
                all.normals.resize(all.positions.len(), Vec3::ZERO);
            }
            if profile.has_textures {
                let uv = |set: &[glam::Vec2], i: usize| set.get(i).copied().unwrap_or_default();
                all.uvs.extend((0..count).map(|i| {
                    let (a, b) = (uv(&mesh.uv0, i), uv(&mesh.uv1, i));
                    [a.x, a.y, b.x, b.y]
                }));
            }
            if profile.has_normal_maps {
                let tangent = |t: &glam::Vec4| {
                    let world = (linear * t.truncate().as_dvec3()).normalize_or_zero().as_vec3();
                    world.extend(t.w * orientation as f32).to_array()
                };
                all.tangents.extend(mesh.tangents.iter().map(tangent));
                all.tangents.resize(all.positions.len(), [0.0; 4]);
            }
            if profile.has_vertex_colors {
                all.colors.extend(mesh.colors.iter().map(|c| c.to_array()));
                all.colors.resize(all.positions.len(), [1.0; 4]);
            }
            let material = mesh.material.unwrap_or(default_material);
            all.triangles.extend(mesh.triangles.iter().map(|&[a, b, c]| {
                let (b, c) = if flipped { (c, b) } else { (b, c) };
                SceneTriangle {
                    vertices: [base + a, base + b, base + c],
                    material,
                    light: NONE,
                }
            }));
        }
        Ok(all)
    }

    fn corners_of(&self, triangle: &SceneTriangle) -> [Vec3; 3] {
        triangle.vertices.map(|vertex| self.positions[vertex as usize])
    }

    /// The corners' bits, whatever their order: equal for triangles that cover the same points.
    fn place_of(&self, triangle: &SceneTriangle) -> [[u32; 3]; 3] {
        // Adding zero makes both zeros one.
        let mut place = self
            .corners_of(triangle)
            .map(|p| (p + Vec3::ZERO).to_array().map(f32::to_bits));
        place.sort_unstable();
        place
    }

    /// The first triangle in each place where some triangle `emits`.
    fn first_copies(&self, emits: impl Fn(&SceneTriangle) -> bool) -> BTreeMap<[[u32; 3]; 3], usize> {
        let emitters = self.triangles.iter().filter(|triangle| emits(triangle));
        let mut first: BTreeMap<_, _> = emitters
            .map(|triangle| (self.place_of(triangle), self.triangles.len()))
            .collect();
        if !first.is_empty() {
            for (index, triangle) in self.triangles.iter().enumerate() {
                if let Some(known) = first.get_mut(&self.place_of(triangle)) {
                    *known = index.min(*known);
                }
            }
        }
        first
    }

    fn corners(&self) -> Vec<[Vec3; 3]> {
        self.triangles
            .iter()
            .map(|triangle| self.corners_of(triangle))
            .collect()
    }

    fn bounds(&self) -> [Vec3; 2] {
        let finite = self.positions.iter().filter(|p| p.is_finite());
        let (lower, upper) = finite.fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(lower, upper), p| {
            (lower.min(*p), upper.max(*p))
        });
        if lower.x <= upper.x {
            [lower, upper]
        } else {
            [Vec3::ZERO; 2]
        }
    }
}

impl SceneBuffers {
    fn upload(
        gpu: &Gpu,
        scene: &Scene,
        profile: &SceneProfile,
        bsdf: BsdfFeatures,
        mut geometry: Geometry,
        bounds: [Vec3; 2],
    ) -> Result<(Self, LightKinds)> {
        let mut textures = Textures::default();
        let default = Material::default();
        let materials: Vec<_> = scene
            .materials
            .iter()
            .chain([&default])
            .map(|material| textures.material(scene, material))
            .collect();
        let lights = Lights::collect(scene, profile, &mut geometry, &materials, bounds)?;
        let absent = gpu.buffer_with("absent", Category::Material, &[0u8; 16])?;
        let optional = |name: &str, category, bytes: &[u8]| {
            if bytes.is_empty() {
                Ok(absent.clone())
            } else {
                gpu.buffer_with(name, category, bytes)
            }
        };
        let albedo = if bsdf.specular_layer || bsdf.multiple_scattering {
            AlbedoTable::shared().values.as_slice()
        } else {
            &[]
        };
        let buffers = Self {
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
            materials: optional("materials", Category::Material, bytemuck::cast_slice(&materials))?,
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
        };
        Ok((buffers, lights.kinds()))
    }
}

/// Texture records and the texels of the images that they use, each image once.
#[derive(Default)]
struct Textures {
    records: Vec<SceneTexture>,
    texels: Vec<[u8; 4]>,
    first_texel: Vec<Option<u32>>,
}

impl Textures {
    fn material(&mut self, scene: &Scene, m: &Material) -> SceneMaterial {
        let conductor = m.conductor;
        let flag = |on: bool, bit| if on { bit } else { 0 };
        let (cutoff, alpha_flag) = match m.alpha_mode {
            AlphaMode::Opaque => (0.0, 0),
            AlphaMode::Mask { cutoff } => (cutoff, MATERIAL_MASK),
            AlphaMode::Blend => (0.0, MATERIAL_BLEND),
        };
        let attenuation = m
            .attenuation_color
            .as_dvec3()
            .map(|c| -c.clamp(f64::from(f32::MIN_POSITIVE), 1.0).ln());
        let attenuation = attenuation / f64::from(m.attenuation_distance);
        SceneMaterial {
            base_color: m.base_color.truncate().to_array(),
            base_alpha: m.base_color.w,
            emission: m.emission.to_array(),
            metallic: m.metallic,
            specular_color: m.specular_color.to_array(),
            roughness: m.roughness,
            conductor_eta: conductor.map_or([1.0; 3], |c| c.eta.to_array()),
            transmission: m.transmission,
            conductor_k: conductor.map_or([0.0; 3], |c| c.k.to_array()),
            ior: m.ior,
            conductor_average: conductor.map_or([0.0; 3], |c| {
                fresnel_conductor_average(c.eta.as_dvec3(), c.k.as_dvec3())
                    .as_vec3()
                    .to_array()
            }),
            specular: m.specular,
            attenuation: attenuation.as_vec3().to_array(),
            thickness: m.thickness,
            alpha_cutoff: cutoff,
            normal_scale: m.normal_scale,
            flags: flag(m.double_sided, MATERIAL_DOUBLE_SIDED)
                | flag(m.unlit, MATERIAL_UNLIT)
                | flag(conductor.is_some(), MATERIAL_CONDUCTOR)
                | alpha_flag,
            base_color_texture: self.record(scene, m.base_color_texture, true),
            metallic_roughness_texture: self.record(scene, m.metallic_roughness_texture, false),
            emission_texture: self.record(scene, m.emission_texture, true),
            normal_texture: self.record(scene, m.normal_texture, false),
            specular_texture: self.record(scene, m.specular_texture, false),
            specular_color_texture: self.record(scene, m.specular_color_texture, true),
            transmission_texture: self.record(scene, m.transmission_texture, false),
        }
    }

    fn record(&mut self, scene: &Scene, texture: Option<Texture>, srgb: bool) -> u32 {
        let Some(texture) = texture else { return NONE };
        let image = &scene.images[texture.image as usize];
        self.first_texel.resize(scene.images.len(), None);
        let first_texel = *self.first_texel[texture.image as usize].get_or_insert_with(|| {
            let first = self.texels.len() as u32;
            self.texels.extend_from_slice(&image.texels);
            first
        });
        let wrap = |mode| match mode {
            Wrap::Repeat => 0,
            Wrap::MirroredRepeat => 1,
            Wrap::ClampToEdge => 2,
        };
        let flags = if srgb { TEXTURE_SRGB } else { 0 }
            | if texture.filter == Filter::Nearest {
                TEXTURE_NEAREST
            } else {
                0
            }
            | if texture.uv_set == 1 { TEXTURE_UV1 } else { 0 }
            | wrap(texture.wrap[0]) << TEXTURE_WRAP_U_SHIFT
            | wrap(texture.wrap[1]) << TEXTURE_WRAP_V_SHIFT;
        let record = SceneTexture {
            transform_u: texture.transform[0],
            first_texel,
            transform_v: texture.transform[1],
            size: image.width | image.height << 16,
            flags,
        };
        let known = self.records.iter().position(|other| *other == record);
        known.unwrap_or_else(|| {
            self.records.push(record);
            self.records.len() - 1
        }) as u32
    }
}

/// Everything that light sampling chooses among: emissive triangles, lights without area, the environment last.
struct Lights {
    records: Vec<SceneLight>,
    /// Cumulative probabilities of the lights, then of the environment's texels.
    cdf: Vec<f32>,
    /// The environment's block: header and texels.
    environment: Vec<u8>,
    /// Some surface shines that is not among the records.
    has_unsampled: bool,
}

impl Lights {
    fn collect(
        scene: &Scene,
        profile: &SceneProfile,
        geometry: &mut Geometry,
        materials: &[SceneMaterial],
        [lower, upper]: [Vec3; 2],
    ) -> Result<Self> {
        let mut records = Vec::new();
        let mut powers = Vec::new();
        let emits = |triangle: &SceneTriangle| {
            let material = &materials[triangle.material as usize];
            material.emission.iter().any(|e| *e > 0.0) && material.flags & MATERIAL_UNLIT == 0
        };
        let first_copies = geometry.first_copies(emits);
        let mut has_unsampled = false;
        for index in 0..geometry.triangles.len() {
            let triangle = geometry.triangles[index];
            if !emits(&triangle) {
                continue;
            }
            let material = &materials[triangle.material as usize];
            let [a, b, c] = geometry.corners_of(&triangle).map(|p| p.as_dvec3());
            let area = 0.5 * (b - a).cross(c - a).length();
            // Of triangles in one place rays meet the first that is there, so only the first one may be a light. What is behind one
            // with alpha shines too, but light sampling cannot tell how much of it: its hits alone count, in full.
            let first = first_copies
                .get(&geometry.place_of(&triangle))
                .copied()
                .unwrap_or(index);
            if first != index {
                let other = geometry.triangles[first];
                if materials[other.material as usize].flags & (MATERIAL_MASK | MATERIAL_BLEND) != 0 {
                    has_unsampled |= area > 0.0;
                } else if other.material == triangle.material {
                    geometry.triangles[index].light = other.light;
                }
                continue;
            }
            if area > 0.0 && area.is_finite() {
                let emission = DVec3::from_array(material.emission.map(f64::from));
                let double_sided = material.flags & MATERIAL_DOUBLE_SIDED != 0;
                geometry.triangles[index].light = records.len() as u32;
                powers.push(luminance(triangle_power(emission, area, double_sided)));
                records.push(SceneLight {
                    kind: LIGHT_TRIANGLE,
                    triangle: index as u32,
                    ..SceneLight::default()
                });
            }
        }
        let radius = 0.5 * (upper - lower).as_dvec3().length();
        for light in &scene.lights {
            let power = luminance(light_power(&light.kind, radius));
            if power > 0.0 {
                powers.push(power);
                records.push(light_record(&light.kind));
            }
        }
        let mut environment = Vec::new();
        let mut environment_cdf = Vec::new();
        if let Some(map) = scene.environment.as_ref().filter(|_| profile.has_environment()) {
            environment_cdf = environment_distribution(map)?;
            powers.push(environment_power(map, radius));
            records.push(SceneLight {
                kind: LIGHT_ENVIRONMENT,
                ..SceneLight::default()
            });
            // The lights' table has one more entry than there are lights; the texels' begins behind it.
            environment = environment_block(map, records.len() as u32 + 1);
        }
        if has_unsampled && records.is_empty() {
            // Kernels that know of emission also sample lights: a dark one to choose.
            powers.push(0.0);
            records.push(SceneLight {
                kind: LIGHT_DARK,
                ..SceneLight::default()
            });
        }
        let mut cdf = if records.is_empty() {
            Vec::new()
        } else {
            build_distribution("lights", &powers)?
        };
        cdf.extend(environment_cdf);
        Ok(Self {
            records,
            cdf,
            environment,
            has_unsampled,
        })
    }

    fn kinds(&self) -> LightKinds {
        let some = |wanted: &[u32]| self.records.iter().any(|light| wanted.contains(&light.kind));
        LightKinds {
            area: self.has_unsampled || some(&[LIGHT_TRIANGLE]),
            punctual: some(&[LIGHT_POINT, LIGHT_SPOT, LIGHT_DIRECTIONAL]),
            environment: some(&[LIGHT_ENVIRONMENT]),
        }
    }
}

fn light_record(kind: &LightKind) -> SceneLight {
    match *kind {
        LightKind::Point { position, intensity } => SceneLight {
            kind: LIGHT_POINT,
            position: position.to_array(),
            strength: intensity.to_array(),
            ..SceneLight::default()
        },
        LightKind::Spot {
            position,
            direction,
            intensity,
            inner,
            outer,
        } => SceneLight {
            kind: LIGHT_SPOT,
            position: position.to_array(),
            direction: direction.to_array(),
            strength: intensity.to_array(),
            cos_inner: inner.cos(),
            cos_outer: outer.cos(),
            ..SceneLight::default()
        },
        LightKind::Directional { direction, irradiance } => SceneLight {
            kind: LIGHT_DIRECTIONAL,
            direction: direction.to_array(),
            strength: irradiance.to_array(),
            ..SceneLight::default()
        },
    }
}

/// Flux of an environment through the disk of the scene's bounding sphere, as for directional lights.
fn environment_power(map: &Environment, radius: f64) -> f64 {
    let mut integral = 0.0;
    for (row, texels) in map.radiance.chunks(map.width as usize).enumerate() {
        let solid_angle =
            super::environment::environment_texel_solid_angle(glam::UVec2::new(map.width, map.height), row as u32);
        integral += texels.iter().map(|texel| luminance(texel.as_dvec3())).sum::<f64>() * solid_angle;
    }
    let radius = if radius > 0.0 { radius } else { 1.0 };
    integral * f64::from(map.strength) * std::f64::consts::PI * radius * radius
}

/// The block `SceneEnvironment`: axes, size, where its table begins, texels scaled by the strength.
fn environment_block(map: &Environment, cdf_base: u32) -> Vec<u8> {
    let axes = [Vec3::X, Vec3::Y, Vec3::Z].map(|axis| (map.rotation * axis).to_array());
    let header = crate::gpu::shaders::transport::path_shade::SceneEnvironment {
        environment_right: axes[0],
        environment_width: map.width,
        environment_up: axes[1],
        environment_height: map.height,
        environment_back: axes[2],
        environment_cdf_base: cdf_base,
    };
    let mut block = bytemuck::bytes_of(&header).to_vec();
    for texel in &map.radiance {
        block.extend_from_slice(bytemuck::bytes_of(&(*texel * map.strength)));
    }
    block
}
