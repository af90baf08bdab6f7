//! The surface scattering function: glTF 2.0 metallic-roughness with transmission, and exact conductors.
//!
//! f = m f_metal + (1 − m)(f_layer + (1 − t) f_diffuse + t f_transmission), m = metallic, t = transmission:
//! - f_layer: GGX reflection under the exact dielectric Fresnel factor, tinted as `KHR_materials_specular` asks;
//! - f_diffuse: base colour · (1 − E(ωo))(1 − E(ωi)) / (π(1 − E_avg)), E the albedo of f_layer: reciprocal, and a white base gives
//!   back all that the layer lets through (Kelemen and Szirmay-Kalos 2001; Shirley et al. 1997);
//! - f_transmission: Walter et al. (EGSR 2007) through solids, with radiance scaled by 1/η²; a mirrored GGX lobe through thin walls
//!   (`KHR_materials_transmission`);
//! - f_metal: GGX with Schlick's or the exact conductor's Fresnel factor, plus the multiple-scattering lobe of Kulla and Conty (2017).
//!
//! Guarantees: never gains energy beyond the interpolation error of the albedo table (stated by the tests); reflection is reciprocal,
//! transmission up to η²; `specular` 0 without transmission and metal is exactly Lambert. Rough transmission is single scattering:
//! what the microfacets shadow is lost. From inside a solid (`wo.z` < 0) the diffuse base is black: what glTF calls the opaque part
//! absorbs there. Frame: z is the shading normal; of a solid it points out of the body. Opaque and thin surfaces scatter alike on
//! both sides. Twin of `transport/bsdf.glsl`.

use super::albedo::{AlbedoTable, albedo_average, albedo_layer, albedo_lookup};
use super::fresnel::{fresnel_conductor, fresnel_conductor_average, fresnel_dielectric, fresnel_f0, fresnel_schlick};
use super::ggx::{ALPHA_MIN, ggx_d, ggx_g1, ggx_g2, ggx_sample_visible, ggx_visible_pdf};
use super::warp::{cosine_hemisphere_pdf, square_to_cosine_hemisphere};
use crate::gpu::shaders::constants;
use crate::scene::{ConductorIor, Material};
use glam::{DVec2, DVec3};
use std::f64::consts::FRAC_1_PI;

/// The diffuse base.
pub const LOBE_DIFFUSE: u32 = constants::LOBE_DIFFUSE;
/// GGX lobes of width [`ALPHA_MIN`] and more, with what compensates them.
pub const LOBE_GLOSSY: u32 = constants::LOBE_GLOSSY;
/// Dirac deltas: mirrors and clear refraction.
pub const LOBE_SPECULAR: u32 = constants::LOBE_SPECULAR;
/// Scattering to the side of ωo.
pub const LOBE_REFLECTION: u32 = constants::LOBE_REFLECTION;
/// Scattering to the other side.
pub const LOBE_TRANSMISSION: u32 = constants::LOBE_TRANSMISSION;
/// Every class on both sides. A mask allows a lobe when it has the bits of both its class and its side.
pub const LOBE_ALL: u32 = constants::LOBE_ALL;

/// Transmission goes straight through a thin wall.
pub const BSDF_THIN: u32 = constants::BSDF_THIN;
/// The metal is `conductor_eta` + i `conductor_k`, not `base_color`.
pub const BSDF_CONDUCTOR: u32 = constants::BSDF_CONDUCTOR;
/// ωo is where particles come from: refraction is not scaled by 1/η².
pub const BSDF_IMPORTANCE: u32 = constants::BSDF_IMPORTANCE;

/// A rough solid whose index is that of its surroundings has no defined half vector: it is given this index.
pub const ETA_MATCHED: f64 = 1.001;
/// Below this 1 − E_avg there is no multiple scattering to speak of.
const LOSS_MIN: f64 = 1e-5;

/// Which terms are compiled in: the values of the shader's specialization constants of the same names in capitals (`HAS_METAL` …).
///
/// A feature that no material uses can be left out without changing a result.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[expect(clippy::struct_excessive_bools, reason = "one for each specialization constant")]
pub struct BsdfFeatures {
    /// Some `metallic` > 0.
    pub metal: bool,
    /// Some metal is an exact conductor.
    pub conductor: bool,
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
        conductor: true,
        specular_layer: true,
        transmission: true,
        multiple_scattering: true,
        separable_masking: false,
    };
    /// Lambert only.
    pub const NONE: Self = Self {
        metal: false,
        conductor: false,
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
                conductor: f.conductor || (m.metallic > 0.0 && m.conductor.is_some()),
                specular_layer: f.specular_layer
                    || (m.specular > 0.0 && m.metallic < 1.0)
                    || (m.specular > 0.0 && m.metallic_roughness_texture.is_some()),
                transmission: f.transmission || m.transmission > 0.0,
                multiple_scattering: f.multiple_scattering || m.metallic > 0.0,
                separable_masking: false,
            })
    }
}

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
    /// Real part of the conductor's index.
    pub conductor_eta: DVec3,
    /// GGX width; a mirror below [`ALPHA_MIN`].
    pub alpha: f64,
    /// Imaginary part of the conductor's index.
    pub conductor_k: DVec3,
    /// Share of transmission below the layer.
    pub transmission: f64,
    /// [`fresnel_conductor_average`] of the conductor.
    pub conductor_average: DVec3,
    /// Index inside ÷ outside; 0 stands for Schlick's factor.
    pub eta: f64,
    /// `BSDF_…` bits.
    pub flags: u32,
}

/// One sampled direction.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BsdfSample {
    /// Unit direction.
    pub wi: DVec3,
    /// Density per solid angle; 0 for a delta lobe.
    pub pdf: f64,
    /// f |cos| / pdf with all probabilities included.
    pub weight: DVec3,
    /// `LOBE_…` bits of the strategy that was used, 0 when no direction was found. A path is restricted to lobes by the mask, not
    /// by looking at these: strategies overlap.
    pub flags: u32,
}

impl BsdfSample {
    const NONE: Self = Self {
        wi: DVec3::ZERO,
        pdf: 0.0,
        weight: DVec3::ZERO,
        flags: 0,
    };
}

/// The features and the table that the twin functions read, as the shader reads its constants and its buffer.
#[derive(Debug, Clone, Copy)]
pub struct BsdfContext<'a> {
    /// Terms compiled in.
    pub features: BsdfFeatures,
    /// Albedos of the GGX lobe.
    pub table: &'a AlbedoTable,
}

/// Mean of the three bands.
pub fn mean3(v: DVec3) -> f64 {
    v.element_sum() / 3.0
}

/// Whether a mask allows a lobe (class and side bits).
pub fn lobe_allowed(mask: u32, lobe: u32) -> bool {
    mask & lobe == lobe
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
        conductor_eta: DVec3::ONE,
        alpha,
        conductor_k: DVec3::ZERO,
        transmission,
        conductor_average: DVec3::ZERO,
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
        m.conductor.map_or(base, |c| base.with_conductor(&c))
    }

    /// The same with an exact conductor as its metal.
    pub fn with_conductor(self, ior: &ConductorIor) -> Self {
        let (eta, k) = (ior.eta.as_dvec3(), ior.k.as_dvec3());
        Self {
            conductor_eta: eta,
            conductor_k: k,
            conductor_average: fresnel_conductor_average(eta, k),
            flags: self.flags | BSDF_CONDUCTOR,
            ..self
        }
    }

    /// Whether its microfacet lobes are Dirac deltas.
    pub fn is_delta(&self) -> bool {
        self.alpha < ALPHA_MIN
    }

    fn is_thin(&self) -> bool {
        self.flags & BSDF_THIN != 0
    }
}

/// Reflectances of the two lobes that are sampled by the cosine: the diffuse base and the metal's multiple scattering.
struct CosineLobes {
    diffuse: DVec3,
    metal: DVec3,
    /// Their albedo towards ωo.
    seen: DVec3,
}

/// What does not change between the directions of one look: the side-adjusted ωo and what follows from it.
struct Upper {
    wo: DVec3,
    eta: f64,
    side: f64,
    lobes: CosineLobes,
    p_cosine: f64,
}

impl BsdfContext<'_> {
    fn metallic(&self, b: &Bsdf) -> f64 {
        if self.features.metal { b.metallic } else { 0.0 }
    }

    fn transmission(&self, b: &Bsdf) -> f64 {
        if self.features.transmission {
            b.transmission
        } else {
            0.0
        }
    }

    /// Reflectance of the dielectric layer; `eta` is that beyond over that on the side of ωo.
    pub fn layer_fresnel(&self, b: &Bsdf, cos_h: f64, eta: f64) -> DVec3 {
        if b.eta <= 0.0 {
            return if self.features.specular_layer {
                b.specular * fresnel_schlick(cos_h, b.specular_f0)
            } else {
                DVec3::ZERO
            };
        }
        if self.features.transmission && eta * eta - 1.0 + cos_h * cos_h <= 0.0 {
            return DVec3::ONE;
        }
        if !self.features.specular_layer {
            return DVec3::ZERO;
        }
        let f = fresnel_dielectric(cos_h, eta);
        let f0 = fresnel_f0(eta);
        // F where specular_f0 = F0; unit reflectance at grazing incidence whatever the tint.
        b.specular * (f + (b.specular_f0 - f0) * ((1.0 - f) / (1.0 - f0))).max(DVec3::ZERO)
    }

    /// Reflectance of the metal.
    pub fn metal_fresnel(&self, b: &Bsdf, cos_h: f64) -> DVec3 {
        if self.features.conductor && b.flags & BSDF_CONDUCTOR != 0 {
            return fresnel_conductor(cos_h, b.conductor_eta, b.conductor_k);
        }
        fresnel_schlick(cos_h, b.base_color)
    }

    /// What a microfacet reflects and what goes through it, as the mask allows.
    fn microfacet_split(&self, b: &Bsdf, cos_h: f64, eta: f64, mask: u32) -> (DVec3, DVec3) {
        let shape = if b.is_delta() { LOBE_SPECULAR } else { LOBE_GLOSSY };
        let f = self.layer_fresnel(b, cos_h, eta);
        let m = self.metallic(b);
        let mut r = (1.0 - m) * f;
        if self.features.metal {
            r += m * self.metal_fresnel(b, cos_h);
        }
        let mut t = ((1.0 - m) * self.transmission(b)) * b.base_color * (DVec3::ONE - f);
        if !lobe_allowed(mask, shape | LOBE_REFLECTION) {
            r = DVec3::ZERO;
        }
        if !lobe_allowed(mask, shape | LOBE_TRANSMISSION) {
            t = DVec3::ZERO;
        }
        (r, t)
    }

    /// One minus the layer's albedo, from its look-ups at layer 0 and in the layer of the index.
    fn layer_loss_of(&self, b: &Bsdf, look_up: impl Fn(usize) -> f64) -> DVec3 {
        if !self.features.specular_layer {
            return DVec3::ONE;
        }
        let (layer, w) = albedo_layer(b.eta);
        let (lower, upper) = (look_up(layer), look_up(layer + 1));
        let rest = lower + (upper - lower) * w;
        DVec3::ONE - b.specular * (b.specular_f0 * look_up(0) + (DVec3::ONE - b.specular_f0) * rest)
    }

    /// One minus the albedo of the layer towards one direction.
    pub fn layer_loss(&self, b: &Bsdf, cos_theta: f64) -> DVec3 {
        self.layer_loss_of(b, |layer| albedo_lookup(self.table, layer, cos_theta, b.alpha))
    }

    /// The cosine-weighted average of [`Self::layer_loss`].
    pub fn layer_loss_average(&self, b: &Bsdf) -> DVec3 {
        self.layer_loss_of(b, |layer| albedo_average(self.table, layer, b.alpha))
    }

    fn cosine_lobes(&self, b: &Bsdf, cos_o: f64, inside: bool, mask: u32) -> CosineLobes {
        let m = self.metallic(b);
        let opaque = (1.0 - m) * (1.0 - self.transmission(b));
        let mut diffuse = DVec3::ZERO;
        if opaque > 0.0 && !inside && lobe_allowed(mask, LOBE_DIFFUSE | LOBE_REFLECTION) {
            diffuse = opaque * b.base_color * self.layer_loss(b, cos_o);
        }
        let mut metal = DVec3::ZERO;
        let compensated = self.features.metal && self.features.multiple_scattering && !b.is_delta();
        if compensated && lobe_allowed(mask, LOBE_GLOSSY | LOBE_REFLECTION) {
            let e_average = albedo_average(self.table, 0, b.alpha);
            let loss = 1.0 - e_average;
            if loss > LOSS_MIN {
                let exact = self.features.conductor && b.flags & BSDF_CONDUCTOR != 0;
                // 1/21 = 2∫(1 − μ)⁵ μ dμ
                let f = if exact {
                    b.conductor_average
                } else {
                    b.base_color.lerp(DVec3::ONE, 1.0 / 21.0)
                };
                let escape = f * f * e_average / (DVec3::ONE - f * loss);
                metal = m * escape * (1.0 - albedo_lookup(self.table, 0, cos_o, b.alpha));
            }
        }
        CosineLobes {
            diffuse,
            metal,
            seen: diffuse + metal,
        }
    }

    fn cosine_lobes_eval(&self, b: &Bsdf, lobes: &CosineLobes, cos_i: f64) -> DVec3 {
        let mut f = lobes.diffuse;
        if self.features.specular_layer && f != DVec3::ZERO {
            f *= self.layer_loss(b, cos_i) / self.layer_loss_average(b).max(DVec3::splat(LOSS_MIN));
        }
        if lobes.metal != DVec3::ZERO {
            let loss = 1.0 - albedo_lookup(self.table, 0, cos_i, b.alpha);
            f += lobes.metal * (loss / (1.0 - albedo_average(self.table, 0, b.alpha)));
        }
        f * FRAC_1_PI
    }

    fn upper(&self, b: &Bsdf, mut wo: DVec3, mask: u32) -> Upper {
        let below = wo.z < 0.0;
        let inside = below && self.transmission(b) > 0.0 && !b.is_thin();
        wo.z = wo.z.abs();
        let eta = if inside { 1.0 / b.eta } else { b.eta };
        let lobes = self.cosine_lobes(b, wo.z, inside, mask);
        let (r, t) = self.microfacet_split(b, wo.z, eta, mask);
        let d = mean3(lobes.seen);
        let p_cosine = if d > 0.0 { d / (d + mean3(r) + mean3(t)) } else { 0.0 };
        Upper {
            wo,
            eta,
            side: if below { -1.0 } else { 1.0 },
            lobes,
            p_cosine,
        }
    }

    fn eval_upper(&self, b: &Bsdf, upper: &Upper, wi: DVec3, mask: u32) -> (DVec3, f64) {
        let &Upper { wo, eta, p_cosine, .. } = upper;
        let (reflected, cos_i) = (wi.z > 0.0, wi.z.abs());
        if cos_i <= 0.0 || wo.z <= 0.0 {
            return (DVec3::ZERO, 0.0);
        }
        let (mut value, mut pdf) = (DVec3::ZERO, 0.0);
        if reflected {
            value = self.cosine_lobes_eval(b, &upper.lobes, cos_i) * cos_i;
            pdf = p_cosine * cosine_hemisphere_pdf(cos_i);
        }
        let f = &self.features;
        let microfacets = f.metal || f.specular_layer || f.transmission;
        if !microfacets || b.is_delta() || !(reflected || self.transmission(b) > 0.0) {
            return (value, pdf);
        }
        let refracted = !reflected && !b.is_thin();
        let sum = if refracted {
            -(wo + eta * wi)
        } else {
            wo + DVec3::new(wi.x, wi.y, cos_i)
        };
        let h = if sum.z < 0.0 { -sum } else { sum }.normalize();
        let (cos_h, cos_ih) = (wo.dot(h), wi.dot(h));
        if cos_h <= 0.0 || (refracted && cos_ih >= 0.0) {
            return (value, pdf);
        }
        let (r, t) = self.microfacet_split(b, cos_h, eta, mask);
        let p_reflection = reflection_probability(r, t);
        let p_side = if reflected { p_reflection } else { 1.0 - p_reflection };
        let density = (1.0 - p_cosine) * ggx_visible_pdf(wo, h, b.alpha) * p_side;
        let d = ggx_d(h, b.alpha);
        if refracted {
            let q = cos_h + eta * cos_ih;
            let jacobian = -cos_ih * eta * eta / (q * q);
            let masking = ggx_g1(wo.z, b.alpha) * ggx_g1(cos_i, b.alpha);
            let shape = d * masking * cos_h / wo.z * jacobian * refraction_scale(b, eta);
            return (t * shape, density * jacobian);
        }
        let shape = d * ggx_g2(wo.z, cos_i, b.alpha, f.separable_masking) / (4.0 * wo.z);
        value += if reflected { r } else { t } * shape;
        (value, pdf + density / (4.0 * cos_h))
    }
}

/// Probability of reflection at a microfacet.
fn reflection_probability(r: DVec3, t: DVec3) -> f64 {
    let total = mean3(r) + mean3(t);
    if total > 0.0 { mean3(r) / total } else { 1.0 }
}

/// Radiance scaling of a refraction.
fn refraction_scale(b: &Bsdf, eta: f64) -> f64 {
    if b.flags & BSDF_IMPORTANCE != 0 {
        1.0
    } else {
        1.0 / (eta * eta)
    }
}

/// f |cos θi| and the density of [`bsdf_sample`] of all allowed lobes that are not deltas.
pub fn bsdf_eval_pdf(context: &BsdfContext, b: &Bsdf, wo: DVec3, wi: DVec3, mask: u32) -> (DVec3, f64) {
    let upper = context.upper(b, wo, mask);
    let wi = DVec3::new(wi.x, wi.y, wi.z * upper.side);
    context.eval_upper(b, &upper, wi, mask)
}

/// f |cos θi| of all allowed lobes that are not deltas, sr⁻¹.
pub fn bsdf_eval(context: &BsdfContext, b: &Bsdf, wo: DVec3, wi: DVec3, mask: u32) -> DVec3 {
    bsdf_eval_pdf(context, b, wo, wi, mask).0
}

/// Density of [`bsdf_sample`] for a direction, sr⁻¹; deltas have none.
pub fn bsdf_pdf(context: &BsdfContext, b: &Bsdf, wo: DVec3, wi: DVec3, mask: u32) -> f64 {
    bsdf_eval_pdf(context, b, wo, wi, mask).1
}

/// A direction in proportion to the allowed lobes: `u.xy` choose the direction, `u.z` the lobe.
///
/// Strategies: the cosine for the diffuse base and the metal's multiple scattering, visible normals for all microfacet lobes, with
/// reflection and transmission told apart by the Fresnel factor of the sampled facet; all balance-weighted (one-sample MIS).
pub fn bsdf_sample(context: &BsdfContext, b: &Bsdf, wo: DVec3, u: DVec3, mask: u32) -> BsdfSample {
    let upper = context.upper(b, wo, mask);
    let &Upper {
        wo,
        eta,
        p_cosine,
        side,
        ..
    } = &upper;
    let uv = DVec2::new(u.x, u.y);
    let (mut wi, mut flags);
    if u.z < p_cosine {
        wi = square_to_cosine_hemisphere(uv);
        flags = LOBE_DIFFUSE | LOBE_REFLECTION;
    } else {
        let delta = b.is_delta();
        let h = if delta {
            DVec3::Z
        } else {
            ggx_sample_visible(wo, b.alpha, uv)
        };
        let cos_h = wo.dot(h);
        let (r, t) = context.microfacet_split(b, cos_h, eta, mask);
        let p_reflection = reflection_probability(r, t);
        let reflected = u.z - p_cosine < p_reflection * (1.0 - p_cosine);
        wi = 2.0 * cos_h * h - wo;
        flags = if delta { LOBE_SPECULAR } else { LOBE_GLOSSY } | LOBE_REFLECTION;
        let mut scale = 1.0 / (p_reflection * (1.0 - p_cosine));
        if wi.z <= 0.0 && (reflected || b.is_thin()) {
            return BsdfSample::NONE;
        }
        if !reflected {
            flags ^= LOBE_REFLECTION | LOBE_TRANSMISSION;
            scale = 1.0 / ((1.0 - p_reflection) * (1.0 - p_cosine));
            if b.is_thin() {
                wi.z = -wi.z;
            } else {
                let inv = 1.0 / eta;
                let cos_t = (1.0 - (1.0 - cos_h * cos_h) * inv * inv).max(0.0).sqrt();
                wi = (cos_h * inv - cos_t) * h - inv * wo;
                scale *= refraction_scale(b, eta);
                if wi.z >= 0.0 {
                    return BsdfSample::NONE;
                }
            }
        }
        if delta {
            let weight = if reflected { r } else { t } * scale;
            return BsdfSample {
                wi: DVec3::new(wi.x, wi.y, wi.z * side),
                pdf: 0.0,
                weight,
                flags: if weight == DVec3::ZERO { 0 } else { flags },
            };
        }
    }
    let (value, pdf) = context.eval_upper(b, &upper, wi, mask);
    if pdf <= 0.0 {
        return BsdfSample::NONE;
    }
    BsdfSample {
        wi: DVec3::new(wi.x, wi.y, wi.z * side),
        pdf,
        weight: value / pdf,
        flags,
    }
}

#[cfg(test)]
#[path = "bsdf_tests.rs"]
mod tests;
