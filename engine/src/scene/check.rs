//! The last look at a scene before anything is uploaded: every index in range, every number finite.
//!
//! Readers and generators end with it, and a host that builds a [`Scene`] itself should too: what passes cannot make an upload or a
//! traversal read outside its buffers.

use super::{Camera, ConductorIor, FresnelForm, LightKind, Material, Mesh, Projection, Scene, Texture, medium};
use crate::{Error, Result};

/// Greatest number of triangles that all instances together may place: hits name each by a number of 32 bits, the last of which names none. What a device
/// holds of them is less where instances are flattened.
pub const MAX_PLACED_TRIANGLES: u64 = (1 << 32) - 1;
/// Most texels along a side of an image: texture records on the device hold both sides in 16 bits each.
pub const MAX_IMAGE_SIDE: u32 = u16::MAX as u32;
/// Greatest number of instances.
pub const MAX_INSTANCES: usize = 1 << 22;

impl Scene {
    /// Checks indices, lengths and finiteness throughout.
    ///
    /// # Errors
    /// [`Error::Scene`] with the first offending place.
    pub fn check(&self) -> Result<()> {
        let fail = |at: String, cause: String| Err(Error::scene(&self.source, at, cause));
        for (i, mesh) in self.meshes.iter().enumerate() {
            if let Err((field, cause)) = check_mesh(mesh, self.materials.len()) {
                return fail(format!("meshes[{i}] {:?}{field}", mesh.name), cause);
            }
        }
        if self.instances.len() > MAX_INSTANCES {
            return fail(
                "instances".into(),
                format!("{} are more than {MAX_INSTANCES}", self.instances.len()),
            );
        }
        let mut placed = 0u64;
        for (i, instance) in self.instances.iter().enumerate() {
            let Some(mesh) = self.meshes.get(instance.mesh as usize) else {
                return fail(
                    format!("instances[{i}].mesh"),
                    format!("{} is out of range; there are {}", instance.mesh, self.meshes.len()),
                );
            };
            placed += mesh.triangles.len() as u64;
            if !instance.transform.is_finite() {
                return fail(format!("instances[{i}].transform"), "is not finite".into());
            }
        }
        if placed > MAX_PLACED_TRIANGLES {
            return fail(
                "instances".into(),
                format!("place {placed} triangles; at most {MAX_PLACED_TRIANGLES} are allowed"),
            );
        }
        for (i, image) in self.images.iter().enumerate() {
            let texels = u64::from(image.width) * u64::from(image.height);
            if image.width.max(image.height) > MAX_IMAGE_SIDE {
                return fail(
                    format!("images[{i}]"),
                    format!(
                        "is {} × {}; at most {MAX_IMAGE_SIDE} per side are allowed",
                        image.width, image.height
                    ),
                );
            }
            if texels == 0 || texels != image.texels.len() as u64 {
                return fail(
                    format!("images[{i}]"),
                    format!(
                        "is {} × {} but holds {} texels",
                        image.width,
                        image.height,
                        image.texels.len()
                    ),
                );
            }
        }
        for (i, material) in self.materials.iter().enumerate() {
            if let Err((field, cause)) = check_material(material, self.images.len()) {
                return fail(format!("materials[{i}] {:?}.{field}", material.name), cause);
            }
        }
        if let Err((at, cause)) = medium::check(self) {
            return fail(at, cause);
        }
        for (i, light) in self.lights.iter().enumerate() {
            if !light_is_sound(&light.kind) {
                return fail(
                    format!("lights[{i}] {:?}", light.name),
                    "holds a number that is not finite or a negative intensity".into(),
                );
            }
        }
        for (i, camera) in self.cameras.iter().enumerate() {
            if !camera_is_sound(camera) {
                return fail(
                    format!("cameras[{i}] {:?}", camera.name),
                    "has a field of view, extent, lens or place that cannot be".into(),
                );
            }
        }
        if let Some(environment) = &self.environment {
            let texels = u64::from(environment.width) * u64::from(environment.height);
            let sound = environment
                .radiance
                .iter()
                .all(|r| r.is_finite() && r.min_element() >= 0.0)
                && environment.strength.is_finite()
                && environment.strength >= 0.0
                && environment.rotation.is_normalized();
            if texels == 0 || texels != environment.radiance.len() as u64 || !sound {
                return fail(
                    "environment".into(),
                    "has no texels, not as many as its size says, or a radiance that is negative or not finite".into(),
                );
            }
        }
        Ok(())
    }
}

/// Where, and what is wrong there.
pub(crate) type Fault = (String, String);

/// Whether a mesh's indices, lengths and numbers are sound, of a scene with so many materials.
pub(crate) fn check_mesh(mesh: &Mesh, materials: usize) -> Result<(), Fault> {
    let n = mesh.positions.len();
    if let Some(i) = mesh.positions.iter().position(|p| !p.is_finite()) {
        return Err((
            format!(".positions[{i}]"),
            format!("{} is not finite", mesh.positions[i]),
        ));
    }
    for (name, length) in [
        ("normals", mesh.normals.len()),
        ("tangents", mesh.tangents.len()),
        ("uv0", mesh.uv0.len()),
        ("uv1", mesh.uv1.len()),
        ("colors", mesh.colors.len()),
    ] {
        if length != 0 && length != n {
            return Err((format!(".{name}"), format!("has {length} entries for {n} positions")));
        }
    }
    let finite = mesh.normals.iter().all(|x| x.is_finite())
        && mesh.tangents.iter().all(|x| x.is_finite())
        && mesh.uv0.iter().chain(&mesh.uv1).all(|x| x.is_finite())
        && mesh.colors.iter().all(|x| x.is_finite());
    if !finite {
        return Err((String::new(), "has a vertex attribute that is not finite".into()));
    }
    if let Some(i) = mesh.triangles.iter().position(|t| t.iter().any(|&v| v as usize >= n)) {
        let cause = format!("{:?} is out of range; there are {n} vertices", mesh.triangles[i]);
        return Err((format!(".triangles[{i}]"), cause));
    }
    match mesh.material {
        Some(m) if m as usize >= materials => Err((
            ".material".into(),
            format!("{m} is out of range; there are {materials}"),
        )),
        _ => Ok(()),
    }
}

impl Material {
    /// All textures of this material with their field names.
    pub fn textures(&self) -> impl Iterator<Item = (&'static str, &Texture)> {
        [
            ("base_color_texture", &self.base_color_texture),
            ("metallic_roughness_texture", &self.metallic_roughness_texture),
            ("emission_texture", &self.emission_texture),
            ("normal_texture", &self.normal_texture),
            ("specular_texture", &self.specular_texture),
            ("specular_color_texture", &self.specular_color_texture),
            ("transmission_texture", &self.transmission_texture),
        ]
        .into_iter()
        .filter_map(|(name, texture)| texture.as_ref().map(|texture| (name, texture)))
    }
}

fn check_material(material: &Material, images: usize) -> Result<(), Fault> {
    for (name, texture) in material.textures() {
        if texture.image as usize >= images {
            return Err((
                name.into(),
                format!("image {} is out of range; there are {images}", texture.image),
            ));
        }
        if texture.uv_set > 1 {
            return Err((
                name.into(),
                format!("texture coordinate set {} is not 0 or 1", texture.uv_set),
            ));
        }
        if !texture.transform.as_flattened().iter().all(|x| x.is_finite()) {
            return Err((name.into(), "has a transform that is not finite".into()));
        }
    }
    let unit = |name: &str, value: f32| {
        if (0.0..=1.0).contains(&value) {
            Ok(())
        } else {
            Err((name.to_string(), format!("{value} is not in [0, 1]")))
        }
    };
    let color = |name: &str, value: glam::Vec3| {
        if value.is_finite() && value.min_element() >= 0.0 {
            Ok(())
        } else {
            Err((name.to_string(), format!("{value} is negative or not finite")))
        }
    };
    for (name, value) in [
        ("metallic", material.metallic),
        ("roughness", material.roughness),
        ("specular", material.specular),
        ("transmission", material.transmission),
        ("base_color alpha", material.base_color.w),
    ] {
        unit(name, value)?;
    }
    color("base_color", material.base_color.truncate())?;
    color("emission", material.emission)?;
    color("specular_color", material.specular_color)?;
    color("attenuation_color", material.attenuation_color)?;
    if let Some(conductor) = material.conductor {
        if !conductor.is_in_range() {
            let [least, greatest] = ConductorIor::ETA;
            let cause = format!(
                "eta {} is not in [{least}, {greatest}], or k {} not in [0, {}]",
                conductor.eta,
                conductor.k,
                ConductorIor::K_MAX
            );
            return Err(("conductor".into(), cause));
        }
    } else if material.fresnel != FresnelForm::Exact {
        return Err(("fresnel".into(), format!("{} needs a conductor", material.fresnel)));
    }
    if material.classic_microfacets.is_some() {
        let sound = material.metallic == 1.0
            && material.metallic_roughness_texture.is_none()
            && material.transmission == 0.0
            && !material.phong;
        if !sound {
            return Err((
                "classic_microfacets".into(),
                "are those of a metal: metallic 1 without a texture of it, no transmission, no modified Phong model"
                    .into(),
            ));
        }
    }
    if material.phong {
        let others = [
            ("transmission", material.transmission > 0.0),
            ("specular", material.specular > 0.0),
            ("conductor", material.conductor.is_some()),
        ];
        if let Some((name, _)) = others.iter().find(|(_, there)| *there) {
            return Err((
                (*name).into(),
                "must not be there on a surface of the modified Phong model".into(),
            ));
        }
    }
    let sound = (material.ior == 0.0 || material.ior >= 1.0)
        && material.ior.is_finite()
        && material.thickness >= 0.0
        && material.thickness.is_finite()
        && material.attenuation_distance > 0.0
        && material.normal_scale.is_finite();
    if sound {
        Ok(())
    } else {
        Err((
            "ior, thickness, attenuation_distance or normal_scale".into(),
            "is out of its range".into(),
        ))
    }
}

/// Whether a light's numbers are finite and in their ranges, its directions unit vectors.
pub(crate) fn light_is_sound(kind: &LightKind) -> bool {
    let strength = |x: glam::Vec3| x.is_finite() && x.min_element() >= 0.0;
    match *kind {
        LightKind::Point { position, intensity } => position.is_finite() && strength(intensity),
        LightKind::Spot {
            position,
            direction,
            intensity,
            inner,
            outer,
        } => {
            position.is_finite()
                && direction.is_normalized()
                && strength(intensity)
                && inner >= 0.0
                && inner <= outer
                && outer <= std::f32::consts::FRAC_PI_2 + 1e-6
        }
        LightKind::Directional { direction, irradiance } => direction.is_normalized() && strength(irradiance),
    }
}

/// Whether a camera can be used.
pub(super) fn camera_is_sound(camera: &Camera) -> bool {
    let projection = match camera.projection {
        Projection::Perspective { fov_y } => fov_y > 0.0 && fov_y < std::f32::consts::PI,
        Projection::Orthographic { half_height } => half_height > 0.0 && half_height.is_finite(),
    };
    // f64 rotations are orthonormal to 1e-9 unless something is wrong with them.
    let m = camera.transform.matrix3;
    let orthonormal = (m.transpose() * m - glam::DMat3::IDENTITY)
        .to_cols_array()
        .iter()
        .all(|x| x.abs() < 1e-6);
    projection
        && orthonormal
        && camera.transform.is_finite()
        && camera.lens_radius >= 0.0
        && camera.lens_radius.is_finite()
        && camera.focus_distance > 0.0
        && camera.focus_distance.is_finite()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::builtin::generate;

    fn refusal(change: impl FnOnce(&mut Scene)) -> String {
        let mut scene = generate("builtin:materials").expect("scene");
        change(&mut scene);
        scene.check().expect_err("must be refused").to_string()
    }

    #[test]
    fn every_kind_of_fault_is_named() {
        assert!(refusal(|s| s.meshes[0].triangles[0] = [0, 1, 9999]).contains("triangles[0]"));
        assert!(refusal(|s| s.meshes[0].positions[1].x = f32::NAN).contains("positions[1]"));
        assert!(refusal(|s| s.meshes[0].material = Some(999)).contains("material"));
        assert!(refusal(|s| s.meshes[0].colors = vec![glam::Vec4::ONE]).contains("colors"));
        assert!(refusal(|s| s.instances[0].mesh = 999).contains("instances[0].mesh"));
        assert!(refusal(|s| s.instances[0].transform.translation.x = f64::INFINITY).contains("transform"));
        assert!(refusal(|s| s.images[0].width += 1).contains("images[0]"));
        assert!(
            refusal(|s| {
                s.images[0].width = 65_536;
                s.images[0].height = 1;
                s.images[0].texels = vec![[0; 4]; 65_536];
            })
            .contains("at most 65535 per side")
        );
        assert!(refusal(|s| s.materials[0].roughness = 2.0).contains("roughness"));
        assert!(refusal(|s| s.materials[0].roughness = f32::NAN).contains("roughness"));
        assert!(refusal(|s| s.materials[0].emission.x = -1.0).contains("emission"));
        assert!(refusal(|s| s.images.clear()).contains("image 0 is out of range"));
        for (eta, k) in [
            (1e-7, 1.0),
            (2e6, 1.0),
            (f32::NAN, 1.0),
            (1.0, -1.0),
            (1.0, 2e6),
            (1.0, f32::INFINITY),
        ] {
            let ior = |eta, k| ConductorIor {
                eta: glam::Vec3::new(1.0, eta, 1.0),
                k: glam::Vec3::new(1.0, 1.0, k),
            };
            let refused = refusal(|s| s.materials[0].conductor = Some(ior(eta, k)));
            assert!(refused.contains("conductor"), "{eta} {k}: {refused}");
        }
        assert!(refusal(|s| s.cameras[0].projection = Projection::Perspective { fov_y: 0.0 }).contains("cameras[0]"));
        assert!(
            refusal(|s| {
                if let Some(e) = &mut s.environment {
                    e.radiance[0].x = f32::NAN;
                }
            })
            .contains("environment")
        );
    }
}
