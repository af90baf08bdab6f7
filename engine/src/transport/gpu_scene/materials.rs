//! Material records: factors, absorption, and where the textures are.

use super::textures::Textures;
use crate::gpu::shaders::constants::{
    MATERIAL_BLEND, MATERIAL_BOUNDARY, MATERIAL_DOUBLE_SIDED, MATERIAL_EXACT_CONDUCTOR, MATERIAL_FORM_SHIFT,
    MATERIAL_MASK, MATERIAL_PHONG, MATERIAL_UNLIT,
};
use crate::gpu::shaders::types::SceneMaterial;
use crate::scene::{AlphaMode, ConductorIor, FresnelForm, Material, Scene};
use crate::transport::bsdf::{classic_flags, conductor_flag};
use crate::transport::fresnel::form::MetalFresnel;
use crate::transport::fresnel::fresnel_conductor;
use crate::transport::fresnel::table::{NODES, fresnel_table};
use std::borrow::Cow;
use std::collections::HashMap;

/// A metal in records: flags of its Fresnel factor, and what that is evaluated from.
type MetalRecord = (u32, [[f32; 3]; 3]);

/// The metals of a scene, each made once however many materials have it: a fit takes milliseconds.
#[derive(Default)]
pub(super) struct Metals {
    /// By form and the bits of the index.
    known: HashMap<(FresnelForm, [u32; 6]), MetalRecord>,
    /// How many were made.
    made: usize,
    /// Nodes of the tables of those that name one, table after table.
    tables: Vec<[f32; 4]>,
}

impl Metals {
    fn record(&mut self, form: FresnelForm, ior: ConductorIor) -> MetalRecord {
        let [a, b, c] = ior.eta.to_array().map(f32::to_bits);
        let [d, e, f] = ior.k.to_array().map(f32::to_bits);
        *self.known.entry((form, [a, b, c, d, e, f])).or_insert_with(|| {
            self.made += 1;
            let fresnel = MetalFresnel::new(form, ior.eta.as_dvec3(), ior.k.as_dvec3());
            let flags = match fresnel {
                MetalFresnel::Exact { .. } => MATERIAL_EXACT_CONDUCTOR,
                _ => conductor_flag(&fresnel) << MATERIAL_FORM_SHIFT,
            };
            let mut parameters = fresnel.parameters().map(|v| v.as_vec3().to_array());
            if let MetalFresnel::Table { eta, k } = fresnel {
                let number = (self.tables.len() / NODES) as f32;
                self.tables.extend(fresnel_table(|c| fresnel_conductor(c, eta, k)));
                [parameters[0], parameters[1]] = [[number, 0.0, 0.0], [0.0; 3]];
            }
            (flags, parameters)
        })
    }

    /// Nodes of the tables of those that name one, table after table.
    pub(super) fn tables(&self) -> &[[f32; 4]] {
        &self.tables
    }
}

/// Records in quarters, and behind them the nodes of all tables from the last to the first, which kernels find from the end.
pub(super) fn material_quarters<'r>(records: &'r [SceneMaterial], tables: &[[f32; 4]]) -> Cow<'r, [[u32; 4]]> {
    let records: &[[u32; 4]] = bytemuck::cast_slice(records);
    if tables.is_empty() {
        return Cow::Borrowed(records);
    }
    let nodes = tables.iter().rev().map(|node| node.map(f32::to_bits));
    Cow::Owned(records.iter().copied().chain(nodes).collect())
}

/// All materials with whether some instance places them; last the default one, for meshes that have none.
pub(super) fn materials_by_use<'a>(scene: &'a Scene, default: &'a Material) -> Vec<(&'a Material, bool)> {
    let mut used = vec![false; scene.materials.len() + 1];
    for instance in &scene.instances {
        let material = scene.meshes[instance.mesh as usize].material;
        used[material.map_or(scene.materials.len(), |index| index as usize)] = true;
    }
    scene.materials.iter().chain([default]).zip(used).collect()
}

/// A material as the kernels read it; its textures and its metal join the others.
pub(super) fn material_record(
    textures: &mut Textures,
    metals: &mut Metals,
    scene: &Scene,
    m: &Material,
) -> SceneMaterial {
    let microfacets = m.classic_microfacets.map_or(0, classic_flags) << MATERIAL_FORM_SHIFT;
    let no_metal = (0, [[1.0; 3], [0.0; 3], [0.0; 3]]);
    let (form, [conductor_a, conductor_b, conductor_c]) =
        m.conductor.map_or(no_metal, |ior| metals.record(m.fresnel, ior));
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
        conductor_a,
        transmission: m.transmission,
        conductor_b,
        ior: m.ior,
        conductor_c,
        specular: m.specular,
        absorption: absorption.as_vec3().to_array(),
        thickness: m.thickness,
        alpha_cutoff: cutoff,
        normal_scale: m.normal_scale,
        flags: flag(m.double_sided, MATERIAL_DOUBLE_SIDED)
            | flag(m.unlit, MATERIAL_UNLIT)
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::metals;

    #[test]
    fn a_metal_is_fitted_once() {
        let mut made = Metals::default();
        let named = |name: &str| metals::by_name(name).expect("metal");
        let mut other = named("gold");
        other.k.z += 1e-6;
        for _ in 0..3 {
            for (form, ior) in [
                (FresnelForm::Compensated, named("gold")),
                (FresnelForm::Compensated, named("silver")),
                (FresnelForm::Compensated, other),
                (FresnelForm::Exact, named("gold")),
            ] {
                let fresnel = MetalFresnel::new(form, ior.eta.as_dvec3(), ior.k.as_dvec3());
                let (flags, parameters) = made.record(form, ior);
                assert_eq!(parameters, fresnel.parameters().map(|v| v.as_vec3().to_array()));
                assert_eq!(flags == MATERIAL_EXACT_CONDUCTOR, form == FresnelForm::Exact);
            }
        }
        assert_eq!(made.made, 4);
        assert!(made.tables().is_empty());
    }

    #[test]
    fn each_metal_by_a_table_has_one_behind_the_records() {
        let (mut made, mut textures) = (Metals::default(), Textures::default());
        let (scene, named) = (Scene::default(), |name: &str| metals::by_name(name).expect("metal"));
        let materials = [
            ("gold", FresnelForm::Table),
            ("gold", FresnelForm::Exact),
            ("silver", FresnelForm::Table),
            ("gold", FresnelForm::Table),
        ]
        .map(|(name, fresnel)| Material {
            conductor: Some(named(name)),
            fresnel,
            ..Material::mirror(name, glam::Vec3::ONE)
        });
        let records = materials
            .each_ref()
            .map(|material| material_record(&mut textures, &mut made, &scene, material));
        let numbers = records.map(|record| record.conductor_a);
        assert_eq!(
            [numbers[0], numbers[2], numbers[3]],
            [[0.0; 3], [1.0, 0.0, 0.0], [0.0; 3]]
        );
        assert_eq!(numbers[1], named("gold").eta.to_array());
        assert_eq!(made.tables().len(), 2 * NODES);
        let quarters = material_quarters(&records, made.tables());
        assert_eq!(bytemuck::cast_slice::<_, SceneMaterial>(&quarters[..40]), records);
        for (number, name) in [(0, "gold"), (1, "silver")] {
            let (eta, k) = (named(name).eta.as_dvec3(), named(name).k.as_dvec3());
            let table = fresnel_table(|c| fresnel_conductor(c, eta, k));
            for (i, node) in table.iter().enumerate() {
                let found = quarters[quarters.len() - 1 - (number * NODES + i)];
                assert_eq!(found.map(f32::from_bits), *node, "{name} {i}");
            }
        }
        // Averages are those of the form.
        let gold = named("gold");
        let fresnel = MetalFresnel::new(FresnelForm::Table, gold.eta.as_dvec3(), gold.k.as_dvec3());
        assert_eq!(records[0].conductor_c, fresnel.average().as_vec3().to_array());
    }
}
