//! What the scattering function depends on at a point, and how it follows from glTF's factors.

use glam::DVec3;

use super::{
    BSDF_BECKMANN, BSDF_CLASSIC, BSDF_COMPENSATED_CONDUCTOR, BSDF_COSINE_LOBE, BSDF_EXACT_CONDUCTOR, BSDF_PHONG,
    BSDF_SCHLICK_CONDUCTOR, BSDF_SIMPLIFIED_CONDUCTOR, BSDF_SIMPLIFIED_G, BSDF_SMITH_G, BSDF_TABLE_CONDUCTOR,
    BSDF_THIN, BSDF_TINTED_CONDUCTOR, ETA_MATCHED,
};
use crate::scene::{ConductorIor, Distribution, FresnelForm, Geometry, Material, Microfacets};
use crate::transport::fresnel::form::MetalFresnel;
use crate::transport::fresnel::fresnel_f0;
use crate::transport::ggx::ALPHA_MIN;

/// What the scattering function depends on, at one point of a surface.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bsdf {
    /// Diffuse reflectance, tint of transmission, and normal reflectance of Schlick's metal.
    pub base_color: DVec3,
    /// Share of metal.
    pub metallic: f64,
    /// Normal reflectance of the layer: min(F0(η) · specular colour, 1).
    pub specular_f0: DVec3,
    /// Strength of the layer.
    pub specular: f64,
    /// Real part of the conductor's index, or its normal reflectance: the first of [`MetalFresnel::parameters`].
    pub conductor_a: DVec3,
    /// GGX width, which stands for the exponent of a Phong lobe too; a mirror below [`ALPHA_MIN`].
    pub alpha: f64,
    /// Imaginary part of the conductor's index, or a coefficient: the second of them.
    pub conductor_b: DVec3,
    /// Share of transmission below the layer.
    pub transmission: f64,
    /// Cosine-weighted average of the conductor's factor, or an exponent: the third of them.
    pub conductor_c: DVec3,
    /// Index inside ÷ outside; 0 stands for Schlick's factor.
    pub eta: f64,
    /// `BSDF_…` bits.
    pub flags: u32,
}

/// The bit of [`Bsdf::flags`] that says which form of Fresnel factor a conductor has.
pub(crate) fn conductor_flag(fresnel: &MetalFresnel) -> u32 {
    match fresnel {
        MetalFresnel::Exact { .. } => BSDF_EXACT_CONDUCTOR,
        MetalFresnel::Schlick { .. } => BSDF_SCHLICK_CONDUCTOR,
        MetalFresnel::Compensated { .. } => BSDF_COMPENSATED_CONDUCTOR,
        MetalFresnel::Tinted { .. } => BSDF_TINTED_CONDUCTOR,
        MetalFresnel::Simplified { .. } => BSDF_SIMPLIFIED_CONDUCTOR,
        MetalFresnel::Table { .. } => BSDF_TABLE_CONDUCTOR,
    }
}

/// The bits of [`Bsdf::flags`] for classical microfacets.
pub(crate) fn classic_flags(microfacets: Microfacets) -> u32 {
    let distribution = match microfacets.distribution {
        Distribution::Ggx => 0,
        Distribution::Beckmann => BSDF_BECKMANN,
        Distribution::CosineLobe => BSDF_COSINE_LOBE,
    };
    let geometry = match microfacets.geometry {
        Geometry::CookTorrance => 0,
        Geometry::Simplified => BSDF_SIMPLIFIED_G,
        Geometry::Smith => BSDF_SMITH_G,
    };
    BSDF_CLASSIC | distribution | geometry
}

/// The factors of a glTF material with its `KHR_materials_*` extensions.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GltfFactors {
    /// Linear base colour.
    pub base_color: DVec3,
    /// Metalness.
    pub metallic: f64,
    /// Perceptual roughness.
    pub roughness: f64,
    /// Transmission factor.
    pub transmission: f64,
    /// Index of refraction, 0 for infinite.
    pub ior: f64,
    /// Specular strength.
    pub specular: f64,
    /// Specular F0 colour.
    pub specular_color: DVec3,
    /// Volume thickness.
    pub thickness: f64,
}

/// The parameters that glTF's factors stand for. `thickness` > 0 bounds a solid.
pub fn bsdf_gltf(g: &GltfFactors) -> Bsdf {
    let infinite = g.ior <= 0.0;
    let mut eta = if infinite { 0.0 } else { g.ior.max(1.0) };
    let alpha = (g.roughness * g.roughness).clamp(0.0, 1.0);
    // An infinite index lets nothing in.
    let transmission = if infinite { 0.0 } else { g.transmission.clamp(0.0, 1.0) };
    let specular_f0 = (fresnel_f0(eta) * g.specular_color).clamp(DVec3::ZERO, DVec3::ONE);
    let solid = g.thickness > 0.0;
    if solid && transmission > 0.0 && alpha >= ALPHA_MIN {
        eta = eta.max(ETA_MATCHED);
    }
    Bsdf {
        base_color: g.base_color.clamp(DVec3::ZERO, DVec3::ONE),
        metallic: g.metallic.clamp(0.0, 1.0),
        specular_f0,
        specular: g.specular.clamp(0.0, 1.0),
        conductor_a: DVec3::ONE,
        alpha,
        conductor_b: DVec3::ZERO,
        transmission,
        conductor_c: DVec3::ZERO,
        eta,
        flags: if solid { 0 } else { BSDF_THIN },
    }
}

impl Bsdf {
    /// The scattering function of a material's factors, without its textures.
    pub fn from_material(m: &Material) -> Self {
        let base = bsdf_gltf(&GltfFactors {
            base_color: m.base_color.truncate().as_dvec3(),
            metallic: m.metallic.into(),
            roughness: m.roughness.into(),
            transmission: m.transmission.into(),
            ior: m.ior.into(),
            specular: m.specular.into(),
            specular_color: m.specular_color.as_dvec3(),
            thickness: m.thickness.into(),
        });
        let base = m.conductor.map_or(base, |c| base.with_conductor_form(&c, m.fresnel));
        let base = m
            .classic_microfacets
            .map_or(base, |microfacets| base.with_microfacets(microfacets));
        if m.phong { base.with_phong() } else { base }
    }

    /// The same with classical microfacets of its metal.
    pub fn with_microfacets(self, microfacets: Microfacets) -> Self {
        Self {
            flags: self.flags | classic_flags(microfacets),
            ..self
        }
    }

    /// The same with a modified Phong lobe as its metal.
    pub fn with_phong(self) -> Self {
        Self {
            flags: self.flags | BSDF_PHONG,
            ..self
        }
    }

    /// The same with an exact conductor as its metal.
    pub fn with_conductor(self, ior: &ConductorIor) -> Self {
        self.with_conductor_form(ior, FresnelForm::Exact)
    }

    /// The same with a conductor as its metal, whose Fresnel factor has this form.
    pub fn with_conductor_form(self, ior: &ConductorIor, form: FresnelForm) -> Self {
        let fresnel = MetalFresnel::new(form, ior.eta.as_dvec3(), ior.k.as_dvec3());
        let [conductor_a, conductor_b, conductor_c] = fresnel.parameters();
        Self {
            conductor_a,
            conductor_b,
            conductor_c,
            flags: self.flags | conductor_flag(&fresnel),
            ..self
        }
    }

    /// Whether its microfacet lobes are Dirac deltas.
    pub fn is_delta(&self) -> bool {
        self.alpha < ALPHA_MIN
    }

    pub(super) fn is_thin(&self) -> bool {
        self.flags & BSDF_THIN != 0
    }
}
