//! What a scene needs of a renderer: the facts from which passes, buffers and shader specializations are chosen.
//!
//! A pure function of the scene; only what is placed by an instance counts. Factors of zero count as absence, and textures are looked
//! at texel by texel where their values matter.

use std::fmt;

use glam::{DAffine3, DVec3, Vec3};

use super::{AlphaMode, FresnelForm, Image, LightKind, Material, Medium, Phase, Scene, Texture};
use crate::catalogue::{Role, Row, sources};

/// How alpha is used by the materials that are placed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize)]
pub struct AlphaUse {
    /// Some material is cut out at a threshold.
    pub mask: bool,
    /// Some material is there with a probability.
    pub blend: bool,
}

/// What kind of environment there is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "snake_case")]
pub enum EnvironmentUse {
    /// None, or black.
    Absent,
    /// The same radiance from everywhere.
    Constant,
    /// A map that wants importance sampling.
    Map,
}

/// How specular transmission is used.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize)]
pub struct TransmissionUse {
    /// Solid bodies that refract.
    pub solid: bool,
    /// Thin walls.
    pub thin: bool,
}

/// How many lights without area there are.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize)]
pub struct LightCounts {
    /// Point lights.
    pub point: usize,
    /// Spot lights.
    pub spot: usize,
    /// Directional lights.
    pub directional: usize,
}

/// Which phase functions the media that scatter have. An eccentricity of 0 is isotropic.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, serde::Serialize)]
pub struct PhaseUse {
    /// Even scattering.
    pub isotropic: bool,
    /// Henyey and Greenstein's.
    pub henyey_greenstein: bool,
    /// Schlick's.
    pub schlick: bool,
    /// Rayleigh's.
    pub rayleigh: bool,
}

/// What the participating media need: of the surrounding one and those inside placed materials. A medium that does nothing
/// ([`Medium::is_empty`]) is counted by `boundaries` and `in_solids` alone.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, serde::Serialize)]
pub struct MediaUse {
    /// Media that do something.
    pub count: usize,
    /// Some medium has the same density everywhere.
    pub homogeneous: bool,
    /// Some medium's density comes from a grid.
    pub heterogeneous: bool,
    /// Some medium absorbs.
    pub absorbs: bool,
    /// Some medium scatters.
    pub scatters: bool,
    /// Some medium emits.
    pub emits: bool,
    /// That outside all bodies emits everywhere.
    pub emits_endlessly: bool,
    /// Some medium's extinction coefficient differs between the RGB bands, so that one free flight cannot serve all of them exactly.
    pub chromatic: bool,
    /// Phase functions of those that scatter.
    pub phases: PhaseUse,
    /// The space outside all bodies holds a medium.
    pub surrounding: bool,
    /// Some placed material is an invisible boundary.
    pub boundaries: bool,
    /// Some placed solid that refracts has a medium inside.
    pub in_solids: bool,
}

impl MediaUse {
    /// Whether paths must know which medium they are in.
    pub fn any(&self) -> bool {
        self.count > 0 || self.boundaries || self.in_solids
    }

    fn add(&mut self, medium: &Medium) {
        self.count += 1;
        self.heterogeneous |= medium.density.is_some();
        self.homogeneous |= medium.density.is_none();
        self.absorbs |= medium.sigma_a != Vec3::ZERO;
        self.scatters |= medium.sigma_s != Vec3::ZERO;
        self.emits |= medium.emission != Vec3::ZERO;
        let extinction = medium.sigma_t();
        self.chromatic |= extinction != Vec3::splat(extinction.x);
        if medium.sigma_s != Vec3::ZERO {
            match medium.phase {
                Phase::Isotropic => self.phases.isotropic = true,
                Phase::HenyeyGreenstein { g: value } | Phase::Schlick { k: value } if value == 0.0 => {
                    self.phases.isotropic = true;
                }
                Phase::HenyeyGreenstein { .. } => self.phases.henyey_greenstein = true,
                Phase::Schlick { .. } => self.phases.schlick = true,
                Phase::Rayleigh => self.phases.rayleigh = true,
            }
        }
    }
}

/// What a scene needs of a renderer.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct SceneProfile {
    /// Triangles over all instances.
    pub triangles: u64,
    /// Triangles of the placed meshes, each mesh once.
    pub unique_triangles: u64,
    /// Vertices of the placed meshes, each mesh once.
    pub vertices: u64,
    /// Instances.
    pub instances: usize,
    /// Some placed material uses an image.
    pub has_textures: bool,
    /// Some placed material has a normal map.
    pub has_normal_maps: bool,
    /// The environment.
    pub environment: EnvironmentUse,
    /// Some placed material is, at least in part, metal.
    pub has_metal: bool,
    /// Some metal has a complex index of refraction.
    pub has_conductor: bool,
    /// Some metal's Fresnel factor has another form than the exact one.
    pub has_other_conductor: bool,
    /// Some metal has classical microfacets.
    pub has_classic_microfacets: bool,
    /// Some metal is a modified Phong lobe.
    pub has_phong: bool,
    /// Some non-metal reflects specularly.
    pub has_rough_dielectric_spec: bool,
    /// Specular transmission.
    pub transmission: TransmissionUse,
    /// Some solid body absorbs by its attenuation colour.
    pub has_absorption: bool,
    /// Participating media.
    pub media: MediaUse,
    /// Alpha.
    pub alpha: AlphaUse,
    /// Triangles over all instances whose material emits.
    pub emissive_triangles: u64,
    /// Lights without area.
    pub lights: LightCounts,
    /// Some placed mesh has vertex colours.
    pub has_vertex_colors: bool,
    /// Some placed mesh interpolates normals.
    pub has_shading_normals: bool,
    /// Some placed material is unlit.
    pub has_unlit: bool,
    /// Some camera has a lens.
    pub has_lens: bool,
    /// Least and greatest perceptual roughness of placed materials that reflect or transmit specularly; `None` without such.
    pub roughness: Option<[f32; 2]>,
    /// World bounds, metres: least and greatest corner; `None` for a scene without vertices.
    pub bounds: Option<[[f64; 3]; 2]>,
    /// Instances are kept on the device, not flattened: said by [`GpuScene::profile`](crate::transport::GpuScene::profile) alone.
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    pub keeps_instances: bool,
}

/// A box around the image of a box, a little larger than that.
fn image_bounds(transform: &DAffine3, lower: Vec3, upper: Vec3) -> [DVec3; 2] {
    /// More than what f64 rounds a corner by, relative to what makes it.
    const ROUNDING: f64 = 1e-14;
    let (lower, upper) = (lower.as_dvec3(), upper.as_dvec3());
    let centre = transform.transform_point3(0.5 * (lower + upper));
    let absolute = transform.matrix3.abs();
    let half = absolute * (0.5 * (upper - lower));
    let half = half + ROUNDING * (absolute * lower.abs().max(upper.abs()) + transform.translation.abs());
    [centre - half, centre + half]
}

impl SceneProfile {
    /// Looks through a scene that passed [`Scene::check`].
    pub fn of(scene: &Scene) -> Self {
        let mut placed = vec![0u64; scene.meshes.len()];
        let mut boxes = vec![None; scene.meshes.len()];
        let (mut low, mut high) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        for instance in &scene.instances {
            let Some(mesh) = scene.meshes.get(instance.mesh as usize) else {
                continue;
            };
            placed[instance.mesh as usize] += 1;
            // What lies within the bounds so far does not change them: of many instances few are looked at vertex by vertex.
            let [near, far] = *boxes[instance.mesh as usize].get_or_insert_with(|| mesh.bounds());
            let [near, far] = image_bounds(&instance.transform, near, far);
            if near.cmpge(low).all() && far.cmple(high).all() {
                continue;
            }
            for p in &mesh.positions {
                let world = instance.transform.transform_point3(p.as_dvec3());
                low = low.min(world);
                high = high.max(world);
            }
        }
        let default_material = Material::default();
        let material_of = |index: Option<u32>| {
            index
                .and_then(|i| scene.materials.get(i as usize))
                .unwrap_or(&default_material)
        };
        let mut profile = Self {
            triangles: 0,
            unique_triangles: 0,
            vertices: 0,
            instances: scene.instances.len(),
            has_textures: false,
            has_normal_maps: false,
            environment: environment_use(scene),
            has_metal: false,
            has_conductor: false,
            has_other_conductor: false,
            has_classic_microfacets: false,
            has_phong: false,
            has_rough_dielectric_spec: false,
            transmission: TransmissionUse {
                solid: false,
                thin: false,
            },
            has_absorption: false,
            media: MediaUse::default(),
            alpha: AlphaUse {
                mask: false,
                blend: false,
            },
            emissive_triangles: 0,
            lights: LightCounts {
                point: 0,
                spot: 0,
                directional: 0,
            },
            has_vertex_colors: false,
            has_shading_normals: false,
            has_unlit: false,
            has_lens: scene.cameras.iter().any(|c| c.lens_radius > 0.0),
            roughness: None,
            bounds: (low.x <= high.x).then(|| [low.to_array(), high.to_array()]),
            keeps_instances: false,
        };
        for (mesh, &count) in scene.meshes.iter().zip(&placed).filter(|(_, count)| **count > 0) {
            let triangles = mesh.triangles.len() as u64;
            profile.triangles += triangles * count;
            profile.unique_triangles += triangles;
            profile.vertices += mesh.positions.len() as u64;
            profile.has_vertex_colors |= !mesh.colors.is_empty();
            profile.has_shading_normals |= !mesh.normals.is_empty();
            if emits(material_of(mesh.material)) {
                profile.emissive_triangles += triangles * count;
            }
        }
        let mut used: Vec<Option<u32>> = (scene.meshes.iter().zip(&placed))
            .filter(|(_, count)| **count > 0)
            .map(|(mesh, _)| mesh.material)
            .collect();
        used.sort_unstable();
        used.dedup();
        let mut media: Vec<u32> = scene.surrounding.into_iter().collect();
        for index in used {
            let material = material_of(index);
            media.extend(material.interior);
            profile.media.boundaries |= material.boundary;
            profile.media.in_solids |= material.interior.is_some() && !material.boundary;
            if !material.boundary {
                profile.add_material(material, &scene.images);
            }
        }
        let medium_of = |index: u32| scene.media.get(index as usize).filter(|medium| !medium.is_empty());
        let surrounding = scene.surrounding.and_then(medium_of);
        profile.media.surrounding = surrounding.is_some();
        profile.media.emits_endlessly = surrounding.is_some_and(Medium::emits_everywhere);
        media.sort_unstable();
        media.dedup();
        for medium in media.into_iter().filter_map(medium_of) {
            profile.media.add(medium);
        }
        for light in &scene.lights {
            match light.kind {
                LightKind::Point { .. } => profile.lights.point += 1,
                LightKind::Spot { .. } => profile.lights.spot += 1,
                LightKind::Directional { .. } => profile.lights.directional += 1,
            }
        }
        profile
    }

    fn add_material(&mut self, material: &Material, images: &[Image]) {
        self.has_textures |= material.textures().next().is_some();
        match material.alpha_mode {
            AlphaMode::Opaque => {}
            AlphaMode::Mask { .. } => self.alpha.mask = true,
            AlphaMode::Blend => self.alpha.blend = true,
        }
        if material.unlit {
            // Unlit surfaces reflect nothing, whatever else the material says.
            self.has_unlit = true;
            return;
        }
        const ROUGHNESS_CHANNEL: usize = 1;
        const METAL_CHANNEL: usize = 2;
        let metal = channel_range(&material.metallic_roughness_texture, METAL_CHANNEL, images);
        let roughness = channel_range(&material.metallic_roughness_texture, ROUGHNESS_CHANNEL, images);
        let metallic = metal.map(|m| m * material.metallic);
        let dielectric = metallic[0] < 1.0;
        let fresnel = material.ior != 1.0;
        let reflects = dielectric && fresnel && material.specular > 0.0 && material.specular_color.max_element() > 0.0;
        let transmits = dielectric && material.transmission > 0.0;
        self.has_normal_maps |= material.normal_texture.is_some();
        self.has_metal |= metallic[1] > 0.0;
        let conductor = metallic[1] > 0.0 && material.conductor.is_some();
        self.has_conductor |= conductor;
        self.has_other_conductor |= conductor && material.fresnel != FresnelForm::Exact;
        self.has_classic_microfacets |= material.classic_microfacets.is_some();
        self.has_phong |= metallic[1] > 0.0 && material.phong;
        self.has_rough_dielectric_spec |= reflects;
        if transmits {
            let solid = material.thickness > 0.0;
            self.transmission.solid |= solid;
            self.transmission.thin |= !solid;
            self.has_absorption |=
                solid && material.attenuation_distance.is_finite() && material.attenuation_color != Vec3::ONE;
        }
        if reflects || transmits || metallic[1] > 0.0 {
            let range = roughness.map(|r| r * material.roughness);
            self.roughness = Some(match self.roughness {
                None => range,
                Some([low, high]) => [low.min(range[0]), high.max(range[1])],
            });
        }
    }

    /// Whether any surface emits.
    pub fn has_area_lights(&self) -> bool {
        self.emissive_triangles > 0
    }

    /// Whether anything but the environment is a light.
    pub fn shines(&self) -> bool {
        let lights = self.lights;
        self.has_area_lights() || lights.point + lights.spot + lights.directional > 0
    }

    /// Whether there is light from infinity.
    pub fn has_environment(&self) -> bool {
        self.environment != EnvironmentUse::Absent
    }

    /// Whether some material transmits specularly.
    pub fn has_transmission(&self) -> bool {
        self.transmission.solid || self.transmission.thin
    }

    /// Whether no surface lets light through.
    pub fn is_opaque(&self) -> bool {
        !self.has_alpha() && !self.has_transmission()
    }

    /// Whether alpha matters.
    pub fn has_alpha(&self) -> bool {
        self.alpha.mask || self.alpha.blend
    }
}

fn emits(material: &Material) -> bool {
    !material.unlit && !material.boundary && material.emission.max_element() > 0.0
}

fn environment_use(scene: &Scene) -> EnvironmentUse {
    let Some(environment) = &scene.environment else {
        return EnvironmentUse::Absent;
    };
    let dark = environment.strength == 0.0 || environment.radiance.iter().all(|r| *r == Vec3::ZERO);
    let constant = environment.radiance.windows(2).all(|pair| pair[0] == pair[1]);
    match (dark, constant) {
        (true, _) => EnvironmentUse::Absent,
        (false, true) => EnvironmentUse::Constant,
        (false, false) => EnvironmentUse::Map,
    }
}

/// Least and greatest value of an image channel in [0, 1]; 1 without a texture.
fn channel_range(texture: &Option<Texture>, channel: usize, images: &[Image]) -> [f32; 2] {
    let Some(image) = texture.and_then(|t| images.get(t.image as usize)) else {
        return [1.0, 1.0];
    };
    let (mut low, mut high) = (u8::MAX, 0);
    for texel in &image.texels {
        low = low.min(texel[channel]);
        high = high.max(texel[channel]);
    }
    [f32::from(low) / 255.0, f32::from(high) / 255.0]
}

impl fmt::Display for SceneProfile {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(
            f,
            "geometry      {} triangles ({} unique), {} vertices, {} instances",
            self.triangles, self.unique_triangles, self.vertices, self.instances
        )?;
        if let Some([low, high]) = self.bounds {
            writeln!(
                f,
                "bounds        {:.4} {:.4} {:.4} … {:.4} {:.4} {:.4} m",
                low[0], low[1], low[2], high[0], high[1], high[2]
            )?;
        }
        let LightCounts {
            point,
            spot,
            directional,
        } = self.lights;
        let environment = match self.environment {
            EnvironmentUse::Absent => "no",
            EnvironmentUse::Constant => "constant",
            EnvironmentUse::Map => "mapped",
        };
        writeln!(
            f,
            "lights        {} emissive triangles, {point} point, {spot} spot, {directional} directional, {environment} environment",
            self.emissive_triangles
        )?;
        let features = [
            ("textures", self.has_textures),
            ("normal maps", self.has_normal_maps),
            ("vertex colours", self.has_vertex_colors),
            ("shading normals", self.has_shading_normals),
            ("metal", self.has_metal),
            ("measured metal", self.has_conductor),
            ("metal by a form of its Fresnel factor", self.has_other_conductor),
            ("classical microfacets", self.has_classic_microfacets),
            ("modified Phong", self.has_phong),
            ("dielectric reflection", self.has_rough_dielectric_spec),
            ("solid transmission", self.transmission.solid),
            ("thin transmission", self.transmission.thin),
            ("absorption", self.has_absorption),
            ("alpha mask", self.alpha.mask),
            ("alpha blend", self.alpha.blend),
            ("unlit", self.has_unlit),
            ("lens", self.has_lens),
        ];
        let present: Vec<&str> = features
            .iter()
            .filter(|(_, there)| *there)
            .map(|(name, _)| *name)
            .collect();
        let list = if present.is_empty() {
            "diffuse only".into()
        } else {
            present.join(", ")
        };
        write!(f, "materials     {list}")?;
        if let Some([low, high]) = self.roughness {
            write!(f, "\nroughness     {low:.3} … {high:.3}")?;
        }
        if self.media.any() {
            write!(f, "\nmedia         {}", self.media)?;
        }
        Ok(())
    }
}

impl fmt::Display for MediaUse {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let facts = [
            ("homogeneous", self.homogeneous),
            ("heterogeneous", self.heterogeneous),
            ("absorbing", self.absorbs),
            ("scattering", self.scatters),
            ("emitting", self.emits),
            ("chromatic", self.chromatic),
            ("isotropic", self.phases.isotropic),
            ("Henyey-Greenstein", self.phases.henyey_greenstein),
            ("Schlick", self.phases.schlick),
            ("Rayleigh", self.phases.rayleigh),
            ("around everything", self.surrounding),
            ("inside boundaries", self.boundaries),
            ("inside solids", self.in_solids),
        ];
        write!(f, "{}", self.count)?;
        facts
            .iter()
            .filter(|(_, there)| *there)
            .try_for_each(|(name, _)| write!(f, ", {name}"))
    }
}

/// Rows of the catalogue.
pub(crate) const ROWS: &[Row] = &[Row {
    id: "CL-PROFILE",
    name: "only what a scene needs: profile and specialization",
    role: Role::Service,
    limits: "Knows what a scene holds, not what is seen of it.",
    sources: &[sources::KHRONOS_SPIRV.at("2.12, specialization constants")],
    tests: &[
        "tests/tests/paths/profile.rs::what_is_absent_costs_no_pass",
        "tests/tests/paths/profile.rs::what_is_absent_costs_no_byte",
        "tests/tests/paths/profile.rs::features_that_are_compiled_in_without_need_change_no_bit",
    ],
    api: &["clerestory::scene::SceneProfile"],
    ..Row::of(file!())
}];
