//! Material records: factors, absorption, and where the textures are.

use super::textures::Textures;
use crate::gpu::shaders::constants::{
    MATERIAL_BLEND, MATERIAL_BOUNDARY, MATERIAL_CONDUCTOR, MATERIAL_DOUBLE_SIDED, MATERIAL_FORM_SHIFT, MATERIAL_MASK,
    MATERIAL_PHONG, MATERIAL_UNLIT,
};
use crate::gpu::shaders::types::SceneMaterial;
use crate::scene::{AlphaMode, Material, Scene};
use crate::transport::bsdf::{classic_flags, conductor_flag};
use crate::transport::fresnel::form::MetalFresnel;
use glam::DVec3;

/// All materials with whether some instance places them; last the default one, for meshes that have none.
pub(super) fn materials_by_use<'a>(scene: &'a Scene, default: &'a Material) -> Vec<(&'a Material, bool)> {
    let mut used = vec![false; scene.materials.len() + 1];
    for instance in &scene.instances {
        let material = scene.meshes[instance.mesh as usize].material;
        used[material.map_or(scene.materials.len(), |index| index as usize)] = true;
    }
    scene.materials.iter().chain([default]).zip(used).collect()
}

/// A material as the kernels read it; its textures join the others.
pub(super) fn material_record(textures: &mut Textures, scene: &Scene, m: &Material) -> SceneMaterial {
    let fresnel = m
        .conductor
        .map(|c| MetalFresnel::new(m.fresnel, c.eta.as_dvec3(), c.k.as_dvec3()));
    let exact = matches!(fresnel, Some(MetalFresnel::Exact { .. }));
    let microfacets = m.microfacets.map_or(0, classic_flags) << MATERIAL_FORM_SHIFT;
    let form = fresnel.as_ref().filter(|_| !exact).map_or(0, conductor_flag) << MATERIAL_FORM_SHIFT;
    let [conductor_eta, conductor_k, conductor_average] = fresnel
        .map_or([DVec3::ONE, DVec3::ZERO, DVec3::ZERO], |fresnel| fresnel.parameters())
        .map(|v| v.as_vec3().to_array());
    let flag = |on: bool, bit| if on { bit } else { 0 };
    let (cutoff, alpha_flag) = match m.alpha_mode {
        AlphaMode::Opaque => (0.0, 0),
        AlphaMode::Mask { cutoff } => (cutoff, MATERIAL_MASK),
        AlphaMode::Blend => (0.0, MATERIAL_BLEND),
    };
    let absorption = m
        .attenuation_color
        .as_dvec3()
        .map(|c| -c.clamp(f64::from(f32::MIN_POSITIVE), 1.0).ln());
    let absorption = absorption / f64::from(m.attenuation_distance);
    // A medium that does nothing is none.
    let interior = m.interior.filter(|&index| !scene.media[index as usize].is_empty());
    SceneMaterial {
        base_color: m.base_color.truncate().to_array(),
        base_alpha: m.base_color.w,
        emission: m.emission.to_array(),
        metallic: m.metallic,
        specular_color: m.specular_color.to_array(),
        roughness: m.roughness,
        conductor_eta,
        transmission: m.transmission,
        conductor_k,
        ior: m.ior,
        conductor_average,
        specular: m.specular,
        absorption: absorption.as_vec3().to_array(),
        thickness: m.thickness,
        alpha_cutoff: cutoff,
        normal_scale: m.normal_scale,
        flags: flag(m.double_sided, MATERIAL_DOUBLE_SIDED)
            | flag(m.unlit, MATERIAL_UNLIT)
            | flag(exact, MATERIAL_CONDUCTOR)
            | form
            | microfacets
            | flag(m.phong, MATERIAL_PHONG)
            | flag(m.boundary, MATERIAL_BOUNDARY)
            | alpha_flag,
        base_color_texture: textures.record(scene, m.base_color_texture, true),
        metallic_roughness_texture: textures.record(scene, m.metallic_roughness_texture, false),
        emission_texture: textures.record(scene, m.emission_texture, true),
        normal_texture: textures.record(scene, m.normal_texture, false),
        specular_texture: textures.record(scene, m.specular_texture, false),
        specular_color_texture: textures.record(scene, m.specular_color_texture, true),
        transmission_texture: textures.record(scene, m.transmission_texture, false),
        interior: interior.map_or(0, |index| index + 1),
        spare: 0,
    }
}
