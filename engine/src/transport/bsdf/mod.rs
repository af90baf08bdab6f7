//! The surface scattering function: glTF 2.0 metallic-roughness with transmission, exact conductors, and the modified Phong model.
//!
//! f = m f_metal + (1 − m)(f_layer + (1 − t) f_diffuse + t f_transmission), m = metallic, t = transmission:
//! - f_layer: GGX reflection under the exact dielectric Fresnel factor, tinted as `KHR_materials_specular` asks;
//! - f_diffuse: base colour · (1 − E(ωo))(1 − E(ωi)) / (π(1 − E_avg)), E the albedo of f_layer: reciprocal, and a white base gives
//!   back all that the layer lets through (Kelemen and Szirmay-Kalos 2001; Shirley et al. 1997);
//! - f_transmission: Walter et al. (EGSR 2007) through solids, with radiance scaled by 1/η²; a mirrored GGX lobe through thin walls
//!   (`KHR_materials_transmission`);
//! - f_metal: GGX with Schlick's or a conductor's Fresnel factor, exact or in the form that it names, plus the multiple-scattering lobe of Kulla and Conty (2017); or
//!   base colour · the modified Phong lobe ([`phong`](super::phong)), meant for surfaces without layer and transmission, which are then
//!   base colour · (m Phong + (1 − m) Lambert).
//!
//! Guarantees: never gains energy beyond the interpolation error of the albedo table (stated by the tests); reflection is reciprocal,
//! transmission up to η²; `specular` 0 without transmission and metal is exactly Lambert. Rough transmission is single scattering:
//! what the microfacets shadow is lost. From inside a solid (`wo.z` < 0) the diffuse base is black: what glTF calls the opaque part
//! absorbs there. Frame: z is the shading normal; of a solid it points out of the body. Opaque and thin surfaces scatter alike on
//! both sides. Twin of `transport/bsdf.glsl`.

mod features;
mod label;
mod lobes;
mod parameters;

use glam::{DVec2, DVec3};

pub(crate) use self::features::may_have_diffuse_base;
pub use self::features::{BsdfContext, BsdfFeatures};
pub use self::label::bsdf_label;
use self::lobes::{CosineLobes, reflection_probability, refraction_scale};
pub use self::parameters::{Bsdf, GltfFactors, bsdf_gltf};
pub(crate) use self::parameters::{classic_flags, conductor_flag};
use super::choice::choose_first;
use super::ggx::{ggx_d, ggx_g1, ggx_g2, ggx_sample_visible, ggx_visible_pdf};
use super::microfacets::{beckmann_sample, cosine_lobe_exponent, cosine_lobe_sample};
use super::phong::{phong_eval, phong_exponent, phong_pdf, phong_sample};
use super::warp::{cosine_hemisphere_pdf, square_to_cosine_hemisphere};
use crate::catalogue::{Bias, Role, Row, sources};
use crate::gpu::shaders::constants;

/// The diffuse base.
pub const LOBE_DIFFUSE: u32 = constants::LOBE_DIFFUSE;
/// GGX lobes of width [`ALPHA_MIN`](super::ggx::ALPHA_MIN) and more, with what compensates them.
pub const LOBE_GLOSSY: u32 = constants::LOBE_GLOSSY;
/// Dirac deltas: mirrors and clear refraction.
pub const LOBE_SPECULAR: u32 = constants::LOBE_SPECULAR;
/// Scattering to the side of ωo.
pub const LOBE_REFLECTION: u32 = constants::LOBE_REFLECTION;
/// Scattering to the other side.
pub const LOBE_TRANSMISSION: u32 = constants::LOBE_TRANSMISSION;
/// Every class on both sides. These are sets of lobes, a bit each: a lobe is what a class and a side have in common.
pub const LOBE_ALL: u32 = constants::LOBE_ALL;

/// Transmission goes straight through a thin wall.
pub const BSDF_THIN: u32 = constants::BSDF_THIN;
/// The metal is `conductor_a` + i `conductor_b`, not `base_color`.
pub const BSDF_EXACT_CONDUCTOR: u32 = constants::BSDF_EXACT_CONDUCTOR;
/// The metal is a conductor of normal reflectance `conductor_a` by Schlick's curve.
pub const BSDF_SCHLICK_CONDUCTOR: u32 = constants::BSDF_SCHLICK_CONDUCTOR;
/// The same less a term of coefficient `conductor_b` and exponent `conductor_c`.
pub const BSDF_COMPENSATED_CONDUCTOR: u32 = constants::BSDF_COMPENSATED_CONDUCTOR;
/// The same less a term of coefficient `conductor_b` and exponent 6.
pub const BSDF_TINTED_CONDUCTOR: u32 = constants::BSDF_TINTED_CONDUCTOR;
/// The metal is `conductor_a` + i `conductor_b` by the simplified factor.
pub const BSDF_SIMPLIFIED_CONDUCTOR: u32 = constants::BSDF_SIMPLIFIED_CONDUCTOR;
/// The metal is `conductor_a` + i `conductor_b` by a table of the exact factor; the device has the number of the table in the first band of `conductor_a`.
pub const BSDF_TABLE_CONDUCTOR: u32 = constants::BSDF_TABLE_CONDUCTOR;
/// The metal's microfacets are not GGX's under Smith's masking with compensation; with the next four bits it says which they are.
pub const BSDF_CLASSIC: u32 = constants::BSDF_CLASSIC;
/// Beckmann's distribution.
pub const BSDF_BECKMANN: u32 = constants::BSDF_BECKMANN;
/// A power of the cosine.
pub const BSDF_COSINE_LOBE: u32 = constants::BSDF_COSINE_LOBE;
/// The simplified geometric term in place of Cook and Torrance's.
pub const BSDF_SIMPLIFIED_G: u32 = constants::BSDF_SIMPLIFIED_G;
/// Smith's separable term in place of it.
pub const BSDF_SMITH_G: u32 = constants::BSDF_SMITH_G;
/// ωo is where particles come from: refraction is not scaled by 1/η².
pub const BSDF_IMPORTANCE: u32 = constants::BSDF_IMPORTANCE;
/// The metal is a modified Phong lobe of constant reflectance `base_color`, of the exponent that `alpha` stands for
/// ([`phong_exponent`]).
pub const BSDF_PHONG: u32 = constants::BSDF_PHONG;

/// A rough solid whose index is that of its surroundings has no defined half vector: it is given this index.
pub const ETA_MATCHED: f64 = constants::ETA_MATCHED as f64;
/// Below this 1 − E_avg there is no multiple scattering to speak of.
const LOSS_MIN: f64 = constants::LOSS_MIN as f64;

/// One sampled direction.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BsdfSample {
    /// Unit direction.
    pub wi: DVec3,
    /// Density per solid angle; 0 for a delta lobe.
    pub pdf: f64,
    /// Probability that this delta lobe was chosen; 1 for others, whose density has it.
    pub choice: f64,
    /// f |cos| / pdf with all probabilities included.
    pub weight: DVec3,
    /// The lobe of the strategy that was used, one bit; 0 when no direction was found. A path is restricted to lobes by the mask, not
    /// by looking at these: strategies overlap.
    pub flags: u32,
}

impl BsdfSample {
    const NONE: Self = Self {
        wi: DVec3::ZERO,
        pdf: 0.0,
        choice: 1.0,
        weight: DVec3::ZERO,
        flags: 0,
    };
}

/// Mean of the three bands.
pub fn mean3(v: DVec3) -> f64 {
    v.element_sum() / 3.0
}

/// Whether a mask allows a lobe.
pub fn lobe_allowed(mask: u32, lobe: u32) -> bool {
    mask & lobe != 0
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

    /// The value of the lobes in `part`, of which `upper` holds the cosine's, and the density under `mask`.
    fn eval_upper(&self, b: &Bsdf, upper: &Upper, wi: DVec3, mask: u32, part: u32) -> (DVec3, f64) {
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
        if self.is_phong(b) && !b.is_delta() {
            if reflected {
                let exponent = phong_exponent(b.alpha);
                let shown = lobe_allowed(part, LOBE_GLOSSY & LOBE_REFLECTION);
                let m = if shown { self.metallic(b) } else { 0.0 };
                value += phong_eval(m * b.base_color, exponent, wo, wi);
                pdf += (1.0 - p_cosine) * phong_pdf(exponent, wo, wi);
            }
            return (value, pdf);
        }
        if self.is_classic(b) {
            if reflected {
                let (classic, density) = self.classic_eval(b, wo, wi);
                let shown = lobe_allowed(part, LOBE_GLOSSY & LOBE_REFLECTION);
                value += if shown { self.metallic(b) * classic } else { DVec3::ZERO };
                pdf += (1.0 - p_cosine) * density;
            }
            return (value, pdf);
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
        let (mut r, mut t) = self.microfacet_split(b, cos_h, eta, mask);
        let p_reflection = reflection_probability(r, t);
        let side = if reflected { LOBE_REFLECTION } else { LOBE_TRANSMISSION };
        if !lobe_allowed(part, LOBE_GLOSSY & side) {
            (r, t) = (DVec3::ZERO, DVec3::ZERO);
        }
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

/// f |cos θi| of the lobes in `part`, a subset of `mask`, and the density of [`bsdf_sample`] under `mask`; without deltas.
pub fn bsdf_eval_part(context: &BsdfContext, b: &Bsdf, wo: DVec3, wi: DVec3, mask: u32, part: u32) -> (DVec3, f64) {
    let mut upper = context.upper(b, wo, mask);
    if !lobe_allowed(part, LOBE_DIFFUSE & LOBE_REFLECTION) {
        upper.lobes.diffuse = DVec3::ZERO;
    }
    if !lobe_allowed(part, LOBE_GLOSSY & LOBE_REFLECTION) {
        upper.lobes.metal = DVec3::ZERO;
    }
    let wi = DVec3::new(wi.x, wi.y, wi.z * upper.side);
    context.eval_upper(b, &upper, wi, mask, part)
}

/// f |cos θi| and the density of [`bsdf_sample`] of all allowed lobes that are not deltas.
pub fn bsdf_eval_pdf(context: &BsdfContext, b: &Bsdf, wo: DVec3, wi: DVec3, mask: u32) -> (DVec3, f64) {
    bsdf_eval_part(context, b, wo, wi, mask, mask)
}

/// f |cos θi| of all allowed lobes that are not deltas, sr⁻¹.
pub fn bsdf_eval(context: &BsdfContext, b: &Bsdf, wo: DVec3, wi: DVec3, mask: u32) -> DVec3 {
    bsdf_eval_pdf(context, b, wo, wi, mask).0
}

/// Density of [`bsdf_sample`] for a direction, sr⁻¹; deltas have none.
pub fn bsdf_pdf(context: &BsdfContext, b: &Bsdf, wo: DVec3, wi: DVec3, mask: u32) -> f64 {
    bsdf_eval_pdf(context, b, wo, wi, mask).1
}

/// A normal of a classical metal: of GGX one that is visible, of others one by their density times their cosine.
fn classic_sample(b: &Bsdf, wo: DVec3, u: DVec2) -> DVec3 {
    if b.flags & BSDF_BECKMANN != 0 {
        beckmann_sample(b.alpha, u)
    } else if b.flags & BSDF_COSINE_LOBE != 0 {
        cosine_lobe_sample(cosine_lobe_exponent(b.alpha), u)
    } else {
        ggx_sample_visible(wo, b.alpha, u)
    }
}

/// A direction in proportion to the allowed lobes: `u.xy` choose the lobe and the direction, `u.z` between the two sides of a rough
/// microfacet.
///
/// Strategies: the cosine for the diffuse base and the metal's multiple scattering, visible normals for all microfacet lobes, with
/// reflection and transmission told apart by the Fresnel factor of the sampled facet, or the power of the cosine for a Phong lobe; all
/// balance-weighted (one-sample MIS).
pub fn bsdf_sample(context: &BsdfContext, b: &Bsdf, wo: DVec3, u: DVec3, mask: u32) -> BsdfSample {
    let upper = context.upper(b, wo, mask);
    let &Upper {
        wo,
        eta,
        p_cosine,
        side,
        ..
    } = &upper;
    let mut uv = DVec2::new(u.x, u.y);
    let (mut wi, mut flags);
    if choose_first(&mut uv.x, p_cosine) {
        wi = square_to_cosine_hemisphere(uv);
        flags = LOBE_DIFFUSE & LOBE_REFLECTION;
    } else if context.is_phong(b) && !b.is_delta() {
        wi = phong_sample(phong_exponent(b.alpha), wo, uv);
        flags = LOBE_GLOSSY & LOBE_REFLECTION;
    } else if context.is_classic(b) {
        let h = classic_sample(b, wo, uv);
        wi = 2.0 * wo.dot(h) * h - wo;
        flags = LOBE_GLOSSY & LOBE_REFLECTION;
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
        // A delta leaves the number over that chose it.
        let reflected = if delta { uv.x } else { u.z } < p_reflection;
        wi = 2.0 * cos_h * h - wo;
        let shape = if delta { LOBE_SPECULAR } else { LOBE_GLOSSY };
        flags = shape & LOBE_REFLECTION;
        let mut choice = p_reflection * (1.0 - p_cosine);
        let mut scale = 1.0 / choice;
        if wi.z <= 0.0 && (reflected || b.is_thin()) {
            return BsdfSample::NONE;
        }
        if !reflected {
            flags = shape & LOBE_TRANSMISSION;
            choice = (1.0 - p_reflection) * (1.0 - p_cosine);
            scale = 1.0 / choice;
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
                choice,
                weight,
                flags: if weight == DVec3::ZERO { 0 } else { flags },
            };
        }
    }
    let (value, pdf) = context.eval_upper(b, &upper, wi, mask, mask);
    if pdf <= 0.0 {
        return BsdfSample::NONE;
    }
    BsdfSample {
        wi: DVec3::new(wi.x, wi.y, wi.z * side),
        pdf,
        choice: 1.0,
        weight: value / pdf,
        flags,
    }
}

/// Rows of the catalogue.
pub(crate) const ROWS: &[Row] = &[
    Row {
        id: "MET-B2",
        name: "microfacet product of distribution, masking and Fresnel factor",
        role: Role::PartOf("BG-3"),
        limits: "Isotropic; what rough transmission scatters among microfacets is lost.",
        sources: &[sources::WALTER_2007.whole(), sources::HEITZ_2014.whole()],
        shaders: &["shaders/transport/bsdf.glsl"],
        bias: Some(Bias::Unbiased),
        tests: &[
            "engine/src/transport/bsdf/tests.rs::white_furnace",
            "engine/src/transport/bsdf/tests.rs::reflection_is_reciprocal_and_transmission_up_to_eta_squared",
            "engine/src/transport/bsdf/tests.rs::samples_follow_their_density",
            "engine/src/transport/bsdf/tests.rs::classical_metals_are_the_product_of_their_parts",
            "tests/tests/twins/scattering.rs::the_scattering_function_agrees_with_its_twin",
        ],
        experiment: "clerestory agreement --scene furnace-metal,furnace-glass,cornell-beckmann",
        settings: &["separable_masking"],
        api: &["clerestory::transport::bsdf"],
        ..Row::of(file!())
    },
    Row {
        id: "MET-B7",
        name: "coupled matte and specular reflection",
        role: Role::PartOf("BG-3"),
        limits: "Exact but for the interpolation of its table of albedos.",
        sources: &[
            sources::KELEMEN_SZIRMAY_KALOS_2001.whole(),
            sources::SHIRLEY_1997.whole(),
        ],
        shaders: &["shaders/transport/bsdf.glsl"],
        bias: Some(Bias::Unbiased),
        tests: &[
            "engine/src/transport/bsdf/tests.rs::white_furnace",
            "engine/src/transport/bsdf/tests.rs::reflection_is_reciprocal_and_transmission_up_to_eta_squared",
        ],
        api: &["clerestory::transport::bsdf"],
        ..Row::of(file!())
    },
];

#[cfg(test)]
mod tests;
