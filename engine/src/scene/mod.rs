//! Floor 2: the scene on the CPU. What the readers produce and everything above consumes.
//!
//! Units are metres, radians and W·m⁻²·sr⁻¹ (radiance), W·sr⁻¹ (point and spot intensity), W·m⁻² (directional irradiance). World space is
//! right-handed with +Y up, as in glTF 2.0; a camera looks along its local −Z.

pub mod builtin;
pub(crate) mod camera_frame;
pub mod check;
mod files;
pub mod gltf;
pub mod medium;
pub mod metals;
mod microfacets;
mod mtl;
pub mod normal_map;
mod obj;
mod placed;
pub(crate) mod ply;
pub(crate) mod profile;
pub mod sidecar;
pub mod tangents;
pub mod texture;

pub use files::{LoadOptions, Loaded, load, load_with};
pub(crate) use medium::mean_density;
pub use medium::{DensityGrid, MajorantGrid, Medium, Phase};
pub use metals::FresnelForm;
pub use microfacets::{Distribution, Geometry, Microfacets};
pub use profile::{AlphaUse, EnvironmentUse, LightCounts, MediaUse, PhaseUse, SceneProfile, TransmissionUse};

use glam::{DAffine3, Vec2, Vec3, Vec4};

use crate::{Error, Result};

/// A scene as described, before anything is uploaded.
#[derive(Debug, Clone, Default)]
pub struct Scene {
    /// Short name, used for output files.
    pub name: String,
    /// The file or `builtin:` address that it came from.
    pub source: String,
    /// Triangle meshes in their own space.
    pub meshes: Vec<Mesh>,
    /// Placements of meshes in the world.
    pub instances: Vec<Instance>,
    /// Materials; a mesh without one uses [`Material::default`].
    pub materials: Vec<Material>,
    /// Decoded images that textures refer to.
    pub images: Vec<Image>,
    /// Point, spot and directional lights in world space. Area lights are emissive materials.
    pub lights: Vec<Light>,
    /// Radiance arriving from infinity; black without one.
    pub environment: Option<Environment>,
    /// Participating media that [`Material::interior`] and [`Scene::surrounding`] refer to.
    pub media: Vec<Medium>,
    /// Index into [`Scene::media`] of the one that fills the space outside all bodies.
    pub surrounding: Option<u32>,
    /// Cameras in world space; the first is the default.
    pub cameras: Vec<Camera>,
    /// What the scene file asks of a render.
    pub defaults: RenderDefaults,
    /// What the reader met and could not carry over, by name.
    pub notes: Vec<Note>,
}

impl Scene {
    /// Adds a material; returns its index.
    pub fn add_material(&mut self, material: Material) -> u32 {
        self.materials.push(material);
        self.materials.len() as u32 - 1
    }

    /// Adds an image; returns its index.
    pub fn add_image(&mut self, image: Image) -> u32 {
        self.images.push(image);
        self.images.len() as u32 - 1
    }

    /// Adds a mesh without placing it; returns its index.
    pub fn add_mesh(&mut self, mesh: Mesh) -> u32 {
        self.meshes.push(mesh);
        self.meshes.len() as u32 - 1
    }

    /// Adds a mesh and places it once, where it is.
    pub fn place(&mut self, mesh: Mesh) {
        let name = mesh.name.clone();
        let mesh = self.add_mesh(mesh);
        self.instances.push(Instance {
            mesh,
            transform: DAffine3::IDENTITY,
            name,
        });
    }

    /// All instances' triangles in world space, metres, with the index of their material; no material is `None`. Indices of vertices and of meshes must be in
    /// range, as [`Scene::check`] sees to it.
    pub fn triangles(&self) -> impl Iterator<Item = ([Vec3; 3], Option<u32>)> + '_ {
        self.instances.iter().flat_map(|instance| {
            let mesh = &self.meshes[instance.mesh as usize];
            let place = |i: u32| {
                let position = mesh.positions[i as usize].as_dvec3();
                instance.transform.transform_point3(position).as_vec3()
            };
            mesh.triangles.iter().map(move |t| (t.map(place), mesh.material))
        })
    }

    /// Adds a light without area.
    pub fn add_light(&mut self, name: impl Into<String>, kind: LightKind) {
        self.lights.push(Light {
            name: name.into(),
            kind,
        });
    }

    /// The camera of that name, or the first one for `None`.
    pub fn camera(&self, name: Option<&str>) -> Option<&Camera> {
        match name {
            Some(name) => self.cameras.iter().find(|camera| camera.name == name),
            None => self.cameras.first(),
        }
    }

    /// As [`Scene::camera`], for a camera that must be there.
    ///
    /// # Errors
    /// [`Error::Setting`] that lists the cameras there are.
    pub fn require_camera(&self, name: Option<&str>) -> Result<&Camera> {
        self.camera(name).ok_or_else(|| {
            let names: Vec<_> = self.cameras.iter().map(|camera| camera.name.as_str()).collect();
            let cause = if names.is_empty() {
                "is not in the scene, which has none".to_owned()
            } else {
                format!("is not in the scene; there is: {}", names.join(", "))
            };
            Error::setting("camera", name.unwrap_or("(the first)"), cause)
        })
    }
}

/// Something a reader met and did not model: always reported, never dropped silently.
#[derive(Debug, Clone, PartialEq, Eq, Hash, serde::Serialize)]
pub struct Note {
    /// The extension or feature by its name.
    pub feature: String,
    /// Where it was met.
    pub at: String,
    /// What the reader does instead.
    pub instead: String,
}

/// An indexed triangle mesh (one glTF primitive). Optional attributes are empty or as long as `positions`.
#[derive(Debug, Clone, Default)]
pub struct Mesh {
    /// Name from the file, or made up.
    pub name: String,
    /// Positions, metres.
    pub positions: Vec<Vec3>,
    /// Unit shading normals; empty means flat shading.
    pub normals: Vec<Vec3>,
    /// Unit tangents, w = ±1 bitangent sign; present when the material has a normal map.
    pub tangents: Vec<Vec4>,
    /// Texture coordinates, set 0.
    pub uv0: Vec<Vec2>,
    /// Texture coordinates, set 1.
    pub uv1: Vec<Vec2>,
    /// Linear vertex colours, multiplied onto base colour and alpha.
    pub colors: Vec<Vec4>,
    /// Three vertex indices per triangle, counter-clockwise seen from the front.
    pub triangles: Vec<[u32; 3]>,
    /// Index into [`Scene::materials`].
    pub material: Option<u32>,
}

impl Mesh {
    /// Least and greatest corner of its vertices in its own space; infinite, and the least above the greatest, without any.
    pub fn bounds(&self) -> [Vec3; 2] {
        let none = [Vec3::INFINITY, Vec3::NEG_INFINITY];
        let with = |[lower, upper]: [Vec3; 2], p: &Vec3| [lower.min(*p), upper.max(*p)];
        self.positions.iter().fold(none, with)
    }
}

/// A mesh placed in the world.
#[derive(Debug, Clone)]
pub struct Instance {
    /// Index into [`Scene::meshes`].
    pub mesh: u32,
    /// Mesh space to world space; a negative determinant flips the winding.
    pub transform: DAffine3,
    /// Name of the node it came from.
    pub name: String,
}

/// How alpha decides whether a surface is there (glTF 2.0 §3.9.4).
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum AlphaMode {
    /// Alpha is ignored.
    #[default]
    Opaque,
    /// There where alpha ≥ the cutoff.
    Mask {
        /// The cutoff.
        cutoff: f32,
    },
    /// There with probability alpha.
    Blend,
}

/// The exact complex index of refraction of a metal, per RGB band.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ConductorIor {
    /// Real part.
    pub eta: Vec3,
    /// Extinction coefficient.
    pub k: Vec3,
}

impl ConductorIor {
    /// Least and greatest real part: products of four of them and of extinctions are numbers of f32.
    pub const ETA: [f32; 2] = [1e-6, 1e6];
    /// Greatest extinction coefficient.
    pub const K_MAX: f32 = 1e6;

    /// Whether real parts lie in [`Self::ETA`], and extinctions from 0 to [`Self::K_MAX`].
    pub fn is_in_range(&self) -> bool {
        let [least, greatest] = Self::ETA.map(Vec3::splat);
        // NaN is nowhere.
        let eta = self.eta.cmpge(least).all() && self.eta.cmple(greatest).all();
        eta && self.k.cmpge(Vec3::ZERO).all() && self.k.cmple(Vec3::splat(Self::K_MAX)).all()
    }
}

/// A surface material: glTF 2.0 metallic-roughness with its `KHR_materials_*` extensions, measured metals, and the modified Phong model.
#[derive(Debug, Clone)]
pub struct Material {
    /// Name from the file.
    pub name: String,
    /// Linear base colour factor and alpha.
    pub base_color: Vec4,
    /// sRGB base colour texture with alpha.
    pub base_color_texture: Option<Texture>,
    /// Metalness factor in [0, 1].
    pub metallic: f32,
    /// Perceptual roughness factor in [0, 1]; the GGX α is its square.
    pub roughness: f32,
    /// Linear texture: roughness in G, metalness in B.
    pub metallic_roughness_texture: Option<Texture>,
    /// Emitted radiance factor × `KHR_materials_emissive_strength`, W·m⁻²·sr⁻¹.
    pub emission: Vec3,
    /// sRGB emission texture.
    pub emission_texture: Option<Texture>,
    /// Tangent-space normal map.
    pub normal_texture: Option<Texture>,
    /// Scale of the normal map's x and y.
    pub normal_scale: f32,
    /// Index of refraction of the dielectric base (`KHR_materials_ior`); 0 stands for infinite (unit Fresnel).
    pub ior: f32,
    /// `KHR_materials_specular` strength.
    pub specular: f32,
    /// `KHR_materials_specular` strength texture (A).
    pub specular_texture: Option<Texture>,
    /// `KHR_materials_specular` F0 colour.
    pub specular_color: Vec3,
    /// `KHR_materials_specular` sRGB colour texture.
    pub specular_color_texture: Option<Texture>,
    /// `KHR_materials_transmission` factor.
    pub transmission: f32,
    /// `KHR_materials_transmission` texture (R).
    pub transmission_texture: Option<Texture>,
    /// `KHR_materials_volume` thickness: > 0 bounds a solid body, 0 is a thin wall.
    pub thickness: f32,
    /// Beer–Lambert attenuation colour after `attenuation_distance`.
    pub attenuation_color: Vec3,
    /// Metres; infinite means clear.
    pub attenuation_distance: f32,
    /// Index into [`Scene::media`] of the medium inside a closed mesh, behind its faces. Only for a [`Material::boundary`] or a solid that
    /// transmits, and instead of its attenuation: both are an error.
    pub interior: Option<u32>,
    /// Bounds [`Material::interior`], which it must have, and is otherwise not there: light goes through unchanged, and no bounce is counted.
    /// All else that the material says is ignored; it must not emit or have alpha.
    pub boundary: bool,
    /// Exact conductor that replaces the metallic lobe's Schlick Fresnel (sidecar only).
    pub conductor: Option<ConductorIor>,
    /// How the conductor's reflectance follows from its index (sidecar only); without a conductor it must be [`FresnelForm::Exact`].
    pub fresnel: FresnelForm,
    /// Classical microfacets in place of GGX under Smith's masking (sidecar only), for a metal alone: metallic must be 1, without a texture of it and without
    /// transmission and the modified Phong model.
    pub classic_microfacets: Option<Microfacets>,
    /// The metal is a modified Phong lobe of reflectance `base_color` (sidecar only): base colour · (metallic · Phong + (1 − metallic) ·
    /// Lambert). Its exponent is (1/α² − 1)/2 with α = roughness², that of a lobe about as wide as GGX's of this α. Only without
    /// transmission, conductor and specular layer: each of them is an error.
    pub phong: bool,
    /// Alpha mode.
    pub alpha_mode: AlphaMode,
    /// Emits from both sides; surfaces scatter on both sides either way.
    pub double_sided: bool,
    /// `KHR_materials_unlit`: shows base colour as emitted radiance, reflects nothing.
    pub unlit: bool,
}

/// Bytes of a name in a note, about.
const NOTED_NAME: usize = 200;

/// A name as notes show it: without the end of one that is too long to be read, since there may be many notes.
pub(crate) fn shortened(name: &str) -> String {
    match name.char_indices().find(|(start, _)| *start >= NOTED_NAME) {
        Some((end, _)) => format!("{}…", &name[..end]),
        None => name.into(),
    }
}

impl Default for Material {
    fn default() -> Self {
        Self {
            name: String::new(),
            base_color: Vec4::ONE,
            base_color_texture: None,
            metallic: 1.0,
            roughness: 1.0,
            metallic_roughness_texture: None,
            emission: Vec3::ZERO,
            emission_texture: None,
            normal_texture: None,
            normal_scale: 1.0,
            ior: 1.5,
            specular: 1.0,
            specular_texture: None,
            specular_color: Vec3::ONE,
            specular_color_texture: None,
            transmission: 0.0,
            transmission_texture: None,
            thickness: 0.0,
            attenuation_color: Vec3::ONE,
            attenuation_distance: f32::INFINITY,
            interior: None,
            boundary: false,
            conductor: None,
            fresnel: FresnelForm::Exact,
            classic_microfacets: None,
            phong: false,
            alpha_mode: AlphaMode::Opaque,
            double_sided: false,
            unlit: false,
        }
    }
}

impl Material {
    /// Whether its metal is, at least in part, a conductor whose Fresnel factor has one of these forms.
    pub fn has_conductor(&self, forms: &[FresnelForm]) -> bool {
        self.metallic > 0.0 && self.conductor.is_some() && forms.contains(&self.fresnel)
    }

    /// Smooth, clear glass of a solid body; it needs a closed mesh. Its thickness only marks it as solid.
    pub fn glass(name: impl Into<String>, ior: f32) -> Self {
        Self {
            name: name.into(),
            metallic: 0.0,
            roughness: 0.0,
            ior,
            transmission: 1.0,
            thickness: 1.0,
            double_sided: true,
            ..Self::default()
        }
    }

    /// A smooth metal of reflectance `reflectance` at normal incidence, two-sided.
    pub fn mirror(name: impl Into<String>, reflectance: Vec3) -> Self {
        Self {
            name: name.into(),
            base_color: reflectance.extend(1.0),
            metallic: 1.0,
            roughness: 0.0,
            double_sided: true,
            ..Self::default()
        }
    }

    /// A surface of one colour that reflects by the modified Phong model: `share` by the lobe of this exponent, the rest by Lambert's law.
    pub fn phong(name: impl Into<String>, reflectance: Vec3, share: f32, exponent: f32) -> Self {
        Self {
            metallic: share,
            roughness: phong_roughness(exponent),
            phong: true,
            ..Self::lambert(name, reflectance)
        }
    }

    /// An ideally diffuse, one-coloured material: Lambert reflectance `reflectance`, no specular coat.
    pub fn lambert(name: impl Into<String>, reflectance: Vec3) -> Self {
        Self {
            name: name.into(),
            base_color: reflectance.extend(1.0),
            metallic: 0.0,
            specular: 0.0,
            double_sided: true,
            ..Self::default()
        }
    }
}

/// The perceptual roughness that stands for an exponent of the modified Phong model ([`Material::phong()`]): 1 for 0.
pub fn phong_roughness(exponent: f32) -> f32 {
    (2.0 * exponent + 1.0).powf(-0.25)
}

/// A use of an image by a material.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Texture {
    /// Index into [`Scene::images`].
    pub image: u32,
    /// Texture coordinate set, 0 or 1.
    pub uv_set: u32,
    /// Wrap mode along u and v.
    pub wrap: [Wrap; 2],
    /// Magnification filter; mip levels are not used by the path tracer.
    pub filter: Filter,
    /// `KHR_texture_transform` as rows of a 2×3 matrix: uv' = M · (u, v, 1).
    pub transform: [[f32; 3]; 2],
}

/// Texture wrap mode.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Wrap {
    /// Repeats.
    #[default]
    Repeat,
    /// Repeats, every second time mirrored.
    MirroredRepeat,
    /// The edge texel goes on for ever.
    ClampToEdge,
}

/// Texture filter.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Filter {
    /// Bilinear.
    #[default]
    Linear,
    /// Nearest texel.
    Nearest,
}

/// A decoded 8-bit RGBA image, top row first. Whether it is sRGB or linear is the texture slot's matter.
#[derive(Debug, Clone, Default)]
pub struct Image {
    /// Name or path.
    pub name: String,
    /// Texels across.
    pub width: u32,
    /// Texels down.
    pub height: u32,
    /// `width × height` RGBA texels.
    pub texels: Vec<[u8; 4]>,
}

/// A light without area, in world space.
#[derive(Debug, Clone, PartialEq)]
pub struct Light {
    /// Name from the file.
    pub name: String,
    /// Its kind, place and strength.
    pub kind: LightKind,
}

/// Kinds of lights without area (`KHR_lights_punctual`; candela are taken 1:1 as W·sr⁻¹, lux as W·m⁻²).
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum LightKind {
    /// Radiates equally in all directions.
    Point {
        /// Metres.
        position: Vec3,
        /// W·sr⁻¹.
        intensity: Vec3,
    },
    /// Radiates into a cone.
    Spot {
        /// Metres.
        position: Vec3,
        /// Unit axis of the cone, away from the light.
        direction: Vec3,
        /// W·sr⁻¹ on the axis.
        intensity: Vec3,
        /// Half angle where the falloff begins, radians.
        inner: f32,
        /// Half angle where it ends, radians.
        outer: f32,
    },
    /// Parallel light from infinity.
    Directional {
        /// Unit direction in which light travels.
        direction: Vec3,
        /// W·m⁻² on a surface facing it.
        irradiance: Vec3,
    },
}

/// Radiance from infinity as a latitude–longitude map: u = atan2(x, −z)/2π + ½, v = acos(y)/π, in the environment's own frame.
#[derive(Debug, Clone)]
pub struct Environment {
    /// Name or path.
    pub name: String,
    /// Texels across.
    pub width: u32,
    /// Texels down.
    pub height: u32,
    /// Linear RGB radiance, `width × height`, top row (+Y) first.
    pub radiance: Vec<Vec3>,
    /// Environment frame to world frame.
    pub rotation: glam::Quat,
    /// Multiplies `radiance`.
    pub strength: f32,
}

impl Environment {
    /// The same radiance from everywhere.
    pub fn uniform(radiance: Vec3) -> Self {
        Self {
            name: "uniform".into(),
            width: 1,
            height: 1,
            radiance: vec![radiance],
            rotation: glam::Quat::IDENTITY,
            strength: 1.0,
        }
    }
}

/// A camera in world space.
#[derive(Debug, Clone, PartialEq)]
pub struct Camera {
    /// Name from the file, or made up.
    pub name: String,
    /// Camera space (looking along −Z, +Y up) to world space, without scale.
    pub transform: DAffine3,
    /// How it projects.
    pub projection: Projection,
    /// Thin-lens radius, metres; 0 is a pinhole.
    pub lens_radius: f32,
    /// Distance of the plane in focus along −Z, metres.
    pub focus_distance: f32,
}

/// Camera projections. The picture's own width/height ratio decides the horizontal extent.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Projection {
    /// Perspective.
    Perspective {
        /// Full vertical field of view, radians.
        fov_y: f32,
    },
    /// Orthographic.
    Orthographic {
        /// Half the height seen, metres.
        half_height: f32,
    },
}

impl Camera {
    /// A pinhole camera at `eye` that looks at `target`.
    pub fn look_at(
        name: impl Into<String>,
        eye: glam::DVec3,
        target: glam::DVec3,
        up: glam::DVec3,
        fov_y: f32,
    ) -> Self {
        let back = (eye - target).normalize();
        let right = up.cross(back).normalize();
        let matrix = glam::DMat3::from_cols(right, back.cross(right), back);
        Self {
            name: name.into(),
            transform: DAffine3::from_mat3_translation(matrix, eye),
            projection: Projection::Perspective { fov_y },
            lens_radius: 0.0,
            focus_distance: 1.0,
        }
    }
}

/// What a scene file asks of a render; a command line or host overrides it.
#[derive(Debug, Clone, PartialEq)]
pub struct RenderDefaults {
    /// Exposure in stops, for tone mapping only.
    pub exposure: f32,
    /// Technique id.
    pub technique: Option<String>,
    /// Width ÷ height that the scene was composed for.
    pub aspect: Option<f32>,
}

impl Default for RenderDefaults {
    fn default() -> Self {
        Self {
            exposure: 0.0,
            technique: None,
            aspect: None,
        }
    }
}
