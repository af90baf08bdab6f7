//! Materials: metallic-roughness and the KHR_materials_* extensions ("glTF 2.0 Specification", §3.9).

use std::path::Path;

use ::gltf::json;
use ::gltf::json::validation::Checked;
use glam::{Vec3, Vec4};

use super::image::{TextureUse, transform_from_json};
use super::{Reader, SUPPORTED_EXTENSIONS};
use crate::Result;
use crate::scene::{AlphaMode, Material, Texture};

impl Reader<'_> {
    /// Reads all materials, in the file's order, so that indices stay the file's.
    pub fn load_materials(&mut self, folder: &Path) -> Result<()> {
        for (i, source) in self.root.materials.iter().enumerate() {
            let material = self.material(source, folder, &format!("materials[{i}]"))?;
            self.scene.materials.push(material);
        }
        Ok(())
    }

    fn slot(&mut self, info: Option<&json::texture::Info>, folder: &Path, at: String) -> Result<Option<Texture>> {
        match info {
            Some(info) => self.texture(&TextureUse::of(info), folder, &at),
            None => Ok(None),
        }
    }

    fn material(&mut self, source: &json::Material, folder: &Path, at: &str) -> Result<Material> {
        let pbr = &source.pbr_metallic_roughness;
        let alpha_mode = match source.alpha_mode {
            Checked::Valid(json::material::AlphaMode::Opaque) => AlphaMode::Opaque,
            Checked::Valid(json::material::AlphaMode::Mask) => AlphaMode::Mask {
                cutoff: source.alpha_cutoff.map_or(0.5, |c| c.0),
            },
            Checked::Valid(json::material::AlphaMode::Blend) => AlphaMode::Blend,
            Checked::Invalid => return self.fail(format!("{at}.alphaMode"), "is not one of OPAQUE, MASK, BLEND"),
        };
        let mut material = Material {
            name: source.name.clone().unwrap_or_else(|| at.into()),
            base_color: Vec4::from_array(pbr.base_color_factor.0),
            base_color_texture: self.slot(
                pbr.base_color_texture.as_ref(),
                folder,
                format!("{at}.pbrMetallicRoughness.baseColorTexture"),
            )?,
            metallic: pbr.metallic_factor.0,
            roughness: pbr.roughness_factor.0,
            metallic_roughness_texture: self.slot(
                pbr.metallic_roughness_texture.as_ref(),
                folder,
                format!("{at}.pbrMetallicRoughness.metallicRoughnessTexture"),
            )?,
            emission: Vec3::from_array(source.emissive_factor.0),
            emission_texture: self.slot(
                source.emissive_texture.as_ref(),
                folder,
                format!("{at}.emissiveTexture"),
            )?,
            alpha_mode,
            double_sided: source.double_sided,
            ..Material::default()
        };
        if let Some(normal) = &source.normal_texture {
            let others = normal
                .extensions
                .as_ref()
                .map(|e| serde_json::Value::Object(e.others.clone()));
            let transform = others.as_ref().and_then(transform_from_json);
            let usage = TextureUse {
                index: normal.index,
                tex_coord: normal.tex_coord,
                transform: transform.as_ref(),
            };
            material.normal_texture = self.texture(&usage, folder, &format!("{at}.normalTexture"))?;
            material.normal_scale = normal.scale;
        }
        if source.occlusion_texture.is_some() {
            self.note(
                "occlusionTexture",
                format!("{at}.occlusionTexture"),
                "ignored; occlusion follows from the geometry",
            );
        }
        if let Some(extensions) = &source.extensions {
            self.material_extensions(&mut material, extensions, folder, at)?;
        }
        Ok(material)
    }

    fn material_extensions(
        &mut self,
        material: &mut Material,
        extensions: &json::extensions::material::Material,
        folder: &Path,
        at: &str,
    ) -> Result<()> {
        material.unlit = extensions.unlit.is_some();
        if let Some(strength) = &extensions.emissive_strength {
            material.emission *= strength.emissive_strength.0;
        }
        if let Some(ior) = &extensions.ior {
            material.ior = ior.ior.0;
        }
        if let Some(specular) = &extensions.specular {
            let at = format!("{at}.extensions.KHR_materials_specular");
            material.specular = specular.specular_factor.0;
            material.specular_color = Vec3::from_array(specular.specular_color_factor.0);
            let strength = specular.specular_texture.as_ref();
            material.specular_texture = self.slot(strength, folder, format!("{at}.specularTexture"))?;
            let color = specular.specular_color_texture.as_ref();
            material.specular_color_texture = self.slot(color, folder, format!("{at}.specularColorTexture"))?;
        }
        if let Some(transmission) = &extensions.transmission {
            let at = format!("{at}.extensions.KHR_materials_transmission.transmissionTexture");
            material.transmission = transmission.transmission_factor.0;
            material.transmission_texture = self.slot(transmission.transmission_texture.as_ref(), folder, at)?;
        }
        if let Some(volume) = &extensions.volume {
            material.thickness = volume.thickness_factor.0;
            material.attenuation_color = Vec3::from_array(volume.attenuation_color.0);
            material.attenuation_distance = volume.attenuation_distance.0;
            if volume.thickness_texture.is_some() {
                self.note(
                    "KHR_materials_volume thicknessTexture",
                    format!("{at}.extensions.KHR_materials_volume.thicknessTexture"),
                    "ignored; light travels through the mesh as it is",
                );
            }
        }
        for name in extensions
            .others
            .keys()
            .filter(|name| !SUPPORTED_EXTENSIONS.contains(&name.as_str()))
        {
            self.note(
                name,
                format!("{at}.extensions"),
                "ignored; the rest of the material is used",
            );
        }
        Ok(())
    }
}
