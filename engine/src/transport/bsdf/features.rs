//! Which terms of the scattering function a scene needs.

use crate::scene::{FresnelForm, Material};
use crate::transport::albedo::AlbedoTable;
use glam::Vec3;

/// Which terms are compiled in: the values of the shader's specialization constants of the same names in capitals (`HAS_METAL` …).
///
/// A feature that no material uses can be left out without changing a result.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[expect(clippy::struct_excessive_bools, reason = "one for each specialization constant")]
pub struct BsdfFeatures {
    /// Some `metallic` > 0.
    pub metal: bool,
    /// Some metal is an exact conductor.
    pub exact_conductor: bool,
    /// Some conductor has Schlick's curve, its own or rescaled.
    pub schlick_conductor: bool,
    /// Some conductor has a compensated curve.
    pub compensated_conductor: bool,
    /// Some conductor has a tinted curve.
    pub tinted_conductor: bool,
    /// Some conductor has the simplified factor.
    pub simplified_conductor: bool,
    /// Some conductor has a table of its factor.
    pub table_conductor: bool,
    /// Some metal has classical microfacets.
    pub classic_microfacets: bool,
    /// Some metal is a modified Phong lobe.
    pub phong: bool,
    /// Some dielectric has `specular` > 0.
    pub specular_layer: bool,
    /// Some `transmission` > 0.
    pub transmission: bool,
    /// Metals are compensated for multiple scattering; off for comparison with single-scattering renderers.
    pub multiple_scattering: bool,
    /// Masking is G1·G1 (`SEPARABLE_MASKING`), for comparison; meant to be used without `multiple_scattering`.
    pub separable_masking: bool,
}

impl BsdfFeatures {
    /// Everything, height-correlated.
    pub const ALL: Self = Self {
        metal: true,
        exact_conductor: true,
        schlick_conductor: true,
        compensated_conductor: true,
        tinted_conductor: true,
        simplified_conductor: true,
        table_conductor: true,
        classic_microfacets: true,
        phong: true,
        specular_layer: true,
        transmission: true,
        multiple_scattering: true,
        separable_masking: false,
    };
    /// Lambert only.
    pub const NONE: Self = Self {
        metal: false,
        exact_conductor: false,
        schlick_conductor: false,
        compensated_conductor: false,
        tinted_conductor: false,
        simplified_conductor: false,
        table_conductor: false,
        classic_microfacets: false,
        phong: false,
        specular_layer: false,
        transmission: false,
        multiple_scattering: false,
        separable_masking: false,
    };

    /// What a set of materials needs; textures can only lower a factor, so factors decide.
    pub fn of_materials<'a>(materials: impl IntoIterator<Item = &'a Material>) -> Self {
        materials
            .into_iter()
            .filter(|m| !m.unlit)
            .fold(Self::NONE, |f, m| Self {
                metal: f.metal || m.metallic > 0.0,
                exact_conductor: f.exact_conductor || m.has_conductor(&[FresnelForm::Exact]),
                schlick_conductor: f.schlick_conductor
                    || m.has_conductor(&[FresnelForm::Schlick, FresnelForm::Rescaled]),
                compensated_conductor: f.compensated_conductor || m.has_conductor(&[FresnelForm::Compensated]),
                tinted_conductor: f.tinted_conductor || m.has_conductor(&[FresnelForm::F82Tint, FresnelForm::Hoffman]),
                simplified_conductor: f.simplified_conductor || m.has_conductor(&[FresnelForm::Simplified]),
                table_conductor: f.table_conductor || m.has_conductor(&[FresnelForm::Table]),
                classic_microfacets: f.classic_microfacets || m.classic_microfacets.is_some(),
                phong: f.phong || (m.metallic > 0.0 && m.phong),
                specular_layer: f.specular_layer
                    || (m.specular > 0.0 && m.metallic < 1.0)
                    || (m.specular > 0.0 && m.metallic_roughness_texture.is_some()),
                transmission: f.transmission || m.transmission > 0.0,
                multiple_scattering: f.multiple_scattering
                    || (m.metallic > 0.0 && !m.phong && m.classic_microfacets.is_none()),
                separable_masking: false,
            })
    }
}

/// Whether a surface of the material may have a diffuse base (`bsdf_has_diffuse_base`); textures can only lower a factor.
pub(crate) fn may_have_diffuse_base(material: &Material) -> bool {
    let lowered = |factor: f32, has_texture: bool| factor < 1.0 || has_texture;
    !material.unlit
        && !material.boundary
        && material.base_color.truncate() != Vec3::ZERO
        && lowered(material.metallic, material.metallic_roughness_texture.is_some())
        && lowered(material.transmission, material.transmission_texture.is_some())
}

/// The features and the table that the twin functions read, as the shader reads its constants and its buffer.
#[derive(Debug, Clone, Copy)]
pub struct BsdfContext<'a> {
    /// Terms compiled in.
    pub features: BsdfFeatures,
    /// Albedos of the GGX lobe.
    pub table: &'a AlbedoTable,
}
