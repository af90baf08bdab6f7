//! Materials as Mitsuba plugins: those that are the same function on both sides, and the reasons against all others.

use clerestory::scene::{AlphaMode, Distribution, FresnelForm, Geometry, Material, Microfacets};
use glam::Vec3;

use super::rgb;

/// Below this GGX α the engine's lobe is a mirror, and so is the exported one.
const MIRROR_ALPHA: f32 = 1e-3;

/// The note for rough metals and rough solids.
const SINGLE_SCATTERING: &str =
    "rough surfaces: render without multiple-scattering compensation and with separable (G1 · G1) masking";

/// The `<bsdf>` and `<emitter>` elements of a shape, or why there are none.
pub(super) fn describe(material: &Material, notes: &mut Vec<String>) -> Result<String, String> {
    if material.boundary {
        return Ok("    <bsdf type=\"null\"/>\n".into());
    }
    refuse_common(material)?;
    let alpha = material.roughness * material.roughness;
    let bsdf = if material.metallic == 1.0 {
        two_sided(&metal(material, alpha)?)
    } else if material.metallic != 0.0 {
        return Err(format!(
            "metallic {} mixes a metal with a dielectric",
            material.metallic
        ));
    } else if material.transmission > 0.0 {
        solid(material, alpha)?
    } else if material.specular == 0.0 || material.ior == 1.0 {
        two_sided(&format!(
            "<bsdf type=\"diffuse\">{}</bsdf>",
            rgb("reflectance", base_color(material)?)
        ))
    } else {
        return Err(
            "a dielectric layer over a diffuse base has no exact counterpart; set specular to 0 for Lambert".into(),
        );
    };
    let is_rough = (material.metallic == 1.0 || material.transmission > 0.0) && alpha >= MIRROR_ALPHA;
    if is_rough && material.classic_microfacets.is_none() {
        notes.push(SINGLE_SCATTERING.into());
    }
    let emitter = emitter(material)?;
    Ok(format!("    {bsdf}\n{emitter}"))
}

/// What no other renderer models in exactly the same way, of any kind of surface.
pub(crate) fn refuse_common(material: &Material) -> Result<(), String> {
    let textures = [
        ("base colour", material.base_color_texture.is_some()),
        ("metallic-roughness", material.metallic_roughness_texture.is_some()),
        ("emission", material.emission_texture.is_some()),
        ("normal", material.normal_texture.is_some()),
        ("specular", material.specular_texture.is_some()),
        ("specular colour", material.specular_color_texture.is_some()),
        ("transmission", material.transmission_texture.is_some()),
    ];
    let named: Vec<&str> = textures
        .iter()
        .filter(|(_, there)| *there)
        .map(|(name, _)| *name)
        .collect();
    if !named.is_empty() {
        return Err(format!("textures are filtered differently ({})", named.join(", ")));
    }
    if material.phong {
        return Err("the modified Phong model has no counterpart".into());
    }
    if material.unlit {
        return Err("unlit surfaces have no counterpart".into());
    }
    let opaque = match material.alpha_mode {
        AlphaMode::Opaque => true,
        AlphaMode::Mask { cutoff } => material.base_color.w >= cutoff,
        AlphaMode::Blend => material.base_color.w >= 1.0,
    };
    if opaque {
        Ok(())
    } else {
        Err("alpha leaves holes".into())
    }
}

/// The base colour of a surface that gains no light.
pub(crate) fn base_color(material: &Material) -> Result<Vec3, String> {
    let color = material.base_color.truncate();
    if color.cmpge(Vec3::ZERO).all() && color.cmple(Vec3::ONE).all() {
        Ok(color)
    } else {
        Err(format!("base colour {color} is not in [0, 1]"))
    }
}

/// The engine's opaque surfaces scatter alike on both sides; Mitsuba's are black behind.
fn two_sided(bsdf: &str) -> String {
    format!("<bsdf type=\"twosided\">{bsdf}</bsdf>")
}

fn metal(material: &Material, alpha: f32) -> Result<String, String> {
    let index = match material.conductor {
        Some(_) if material.fresnel != FresnelForm::Exact => {
            return Err(format!(
                "a metal by the form {} of its Fresnel factor has no counterpart",
                material.fresnel
            ));
        }
        Some(conductor) => rgb("eta", conductor.eta) + &rgb("k", conductor.k),
        // Schlick's factor with F0 = 1 is 1 at every angle.
        None if material.base_color.truncate() == Vec3::ONE => "<string name=\"material\" value=\"none\"/>".into(),
        None => {
            return Err("a metal by Schlick's Fresnel factor has no counterpart; give it a measured conductor".into());
        }
    };
    let distribution = distribution(material.classic_microfacets)?;
    Ok(microfacet("conductor", alpha, distribution, &index))
}

/// Mitsuba's name of a metal's distribution, which it masks by the product of Smith's terms.
fn distribution(microfacets: Option<Microfacets>) -> Result<&'static str, String> {
    let Some(Microfacets { distribution, geometry }) = microfacets else {
        return Ok("ggx");
    };
    if geometry != Geometry::Smith {
        return Err(
            "classical microfacets have no counterpart under Cook and Torrance's or the simplified term: Mitsuba masks by Smith's term"
                .into(),
        );
    }
    match distribution {
        Distribution::Ggx => Ok("ggx"),
        Distribution::Beckmann => Ok("beckmann"),
        Distribution::CosineLobe => Err("the cosine lobe of classical microfacets has no counterpart".into()),
    }
}

/// Refuses bodies that are not solid, clear and colourless.
pub(crate) fn refuse_unclear(material: &Material) -> Result<(), String> {
    let wanted = [
        (material.transmission == 1.0, "transmission below 1"),
        (material.thickness > 0.0, "a thin wall"),
        (
            material.specular == 1.0 && material.specular_color == Vec3::ONE,
            "a tinted or weakened specular layer",
        ),
        (
            material.base_color.truncate() == Vec3::ONE,
            "a base colour that tints transmission",
        ),
        (
            material.attenuation_distance == f32::INFINITY || material.attenuation_color == Vec3::ONE,
            "absorption inside",
        ),
        (material.ior > 1.0, "an index of refraction of 1 or less, or infinite"),
    ];
    match wanted.iter().find(|(fits, _)| !fits) {
        Some((_, reason)) => Err(format!("{reason} has no exact counterpart")),
        None => Ok(()),
    }
}

fn solid(material: &Material, alpha: f32) -> Result<String, String> {
    refuse_unclear(material)?;
    let index = format!(
        "<float name=\"int_ior\" value=\"{}\"/><float name=\"ext_ior\" value=\"1\"/>",
        material.ior
    );
    Ok(microfacet("dielectric", alpha, "ggx", &index))
}

/// The smooth or the rough plugin of a family.
fn microfacet(family: &str, alpha: f32, distribution: &str, index: &str) -> String {
    if alpha < MIRROR_ALPHA {
        return format!("<bsdf type=\"{family}\">{index}</bsdf>");
    }
    format!(
        "<bsdf type=\"rough{family}\">{index}<string name=\"distribution\" value=\"{distribution}\"/>\
         <boolean name=\"sample_visible\" value=\"true\"/><float name=\"alpha\" value=\"{alpha}\"/></bsdf>"
    )
}

fn emitter(material: &Material) -> Result<String, String> {
    let emission = material.emission;
    if emission == Vec3::ZERO {
        Ok(String::new())
    } else if !emission.is_finite() || emission.min_element() < 0.0 {
        Err(format!("emission {emission} is negative or not finite"))
    } else if material.double_sided {
        Err("it emits on both sides, Mitsuba's area lights on one; make it single-sided".into())
    } else if material.transmission > 0.0 {
        Err("emission of a transmitting surface is seen from inside too".into())
    } else {
        Ok(format!(
            "    <emitter type=\"area\">{}</emitter>\n",
            rgb("radiance", emission)
        ))
    }
}
