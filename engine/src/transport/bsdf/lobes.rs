//! The terms of the scattering function: what a microfacet reflects and lets through, and the two lobes that follow the cosine.

use std::f64::consts::FRAC_1_PI;

use glam::DVec3;

use super::{
    BSDF_BECKMANN, BSDF_CLASSIC, BSDF_COMPENSATED_CONDUCTOR, BSDF_COSINE_LOBE, BSDF_EXACT_CONDUCTOR, BSDF_IMPORTANCE,
    BSDF_PHONG, BSDF_SCHLICK_CONDUCTOR, BSDF_SIMPLIFIED_CONDUCTOR, BSDF_SIMPLIFIED_G, BSDF_SMITH_G,
    BSDF_TABLE_CONDUCTOR, BSDF_TINTED_CONDUCTOR, Bsdf, BsdfContext, LOBE_DIFFUSE, LOBE_GLOSSY, LOBE_REFLECTION,
    LOBE_SPECULAR, LOBE_TRANSMISSION, LOSS_MIN, lobe_allowed, mean3,
};
use crate::transport::albedo::{albedo_average, albedo_layer, albedo_lookup};
use crate::transport::fresnel::compensated::{fresnel_compensated, fresnel_compensated_average};
use crate::transport::fresnel::simplified::fresnel_simplified;
use crate::transport::fresnel::table::fresnel_tabulated;
use crate::transport::fresnel::tinted::fresnel_tinted;
use crate::transport::fresnel::{fresnel_conductor, fresnel_dielectric, fresnel_f0, fresnel_schlick};
use crate::transport::ggx::{ggx_d, ggx_g1, ggx_visible_pdf};
use crate::transport::microfacets::{
    beckmann_d, beckmann_g1, cook_torrance_g, cosine_lobe_d, cosine_lobe_exponent, cosine_lobe_g1, kelemen_g, smith_g,
};

/// Reflectances of the two lobes that are sampled by the cosine: the diffuse base and the metal's multiple scattering.
pub(super) struct CosineLobes {
    pub diffuse: DVec3,
    pub metal: DVec3,
    /// Their albedo towards ωo.
    pub seen: DVec3,
}

impl BsdfContext<'_> {
    pub(super) fn metallic(&self, b: &Bsdf) -> f64 {
        if self.features.metal { b.metallic } else { 0.0 }
    }

    pub(super) fn transmission(&self, b: &Bsdf) -> f64 {
        if self.features.transmission {
            b.transmission
        } else {
            0.0
        }
    }

    /// Whether its metal is a modified Phong lobe.
    pub(super) fn is_phong(&self, b: &Bsdf) -> bool {
        self.features.phong && b.flags & BSDF_PHONG != 0
    }

    /// Whether its metal has classical microfacets that are no mirror.
    pub(super) fn is_classic(&self, b: &Bsdf) -> bool {
        self.features.classic_microfacets && b.flags & BSDF_CLASSIC != 0 && !b.is_delta()
    }

    /// f |cos| of a classical metal, and the density of the directions that its normals reflect; both cosines positive.
    pub(super) fn classic_eval(&self, b: &Bsdf, wo: DVec3, wi: DVec3) -> (DVec3, f64) {
        let h = (wo + wi).normalize();
        let cos_h = wo.dot(h);
        if cos_h <= 0.0 || h.z <= 0.0 {
            return (DVec3::ZERO, 0.0);
        }
        let (d, normals) = if b.flags & BSDF_BECKMANN != 0 {
            let d = beckmann_d(h, b.alpha);
            (d, d * h.z)
        } else if b.flags & BSDF_COSINE_LOBE != 0 {
            let d = cosine_lobe_d(h, cosine_lobe_exponent(b.alpha));
            (d, d * h.z)
        } else {
            (ggx_d(h, b.alpha), ggx_visible_pdf(wo, h, b.alpha))
        };
        let g = classic_g(b, wo, wi, h);
        (self.metal_fresnel(b, cos_h) * (d * g * wi.z), normals / (4.0 * cos_h))
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
        if self.is_phong(b) {
            return b.base_color;
        }
        let [eta, k, exponent] = [b.conductor_a, b.conductor_b, b.conductor_c];
        match b.flags & self.conductor_flags() {
            BSDF_EXACT_CONDUCTOR => fresnel_conductor(cos_h, eta, k),
            BSDF_SCHLICK_CONDUCTOR => fresnel_schlick(cos_h, eta),
            BSDF_COMPENSATED_CONDUCTOR => fresnel_compensated(cos_h, eta, k, exponent),
            BSDF_TINTED_CONDUCTOR => fresnel_tinted(cos_h, eta, k),
            BSDF_SIMPLIFIED_CONDUCTOR => fresnel_simplified(cos_h, eta, k),
            BSDF_TABLE_CONDUCTOR => fresnel_tabulated(cos_h, |c| fresnel_conductor(c, eta, k)),
            _ => fresnel_schlick(cos_h, b.base_color),
        }
    }

    /// The flags of the conductors that are compiled in.
    fn conductor_flags(&self) -> u32 {
        let f = &self.features;
        [
            (f.exact_conductor, BSDF_EXACT_CONDUCTOR),
            (f.schlick_conductor, BSDF_SCHLICK_CONDUCTOR),
            (f.compensated_conductor, BSDF_COMPENSATED_CONDUCTOR),
            (f.tinted_conductor, BSDF_TINTED_CONDUCTOR),
            (f.simplified_conductor, BSDF_SIMPLIFIED_CONDUCTOR),
            (f.table_conductor, BSDF_TABLE_CONDUCTOR),
        ]
        .into_iter()
        .filter_map(|(on, flag)| on.then_some(flag))
        .sum()
    }

    /// Cosine-weighted hemispherical average of a conductor's factor; `None` for a metal by its base colour.
    fn conductor_average(&self, b: &Bsdf) -> Option<DVec3> {
        match b.flags & self.conductor_flags() {
            0 => None,
            BSDF_COMPENSATED_CONDUCTOR => {
                Some(fresnel_compensated_average(b.conductor_a, b.conductor_b, b.conductor_c))
            }
            _ => Some(b.conductor_c),
        }
    }

    /// What a microfacet reflects and what goes through it, as the mask allows.
    pub(super) fn microfacet_split(&self, b: &Bsdf, cos_h: f64, eta: f64, mask: u32) -> (DVec3, DVec3) {
        let shape = if b.is_delta() { LOBE_SPECULAR } else { LOBE_GLOSSY };
        let f = self.layer_fresnel(b, cos_h, eta);
        let m = self.metallic(b);
        let mut r = (1.0 - m) * f;
        if self.features.metal {
            r += m * self.metal_fresnel(b, cos_h);
        }
        let mut t = ((1.0 - m) * self.transmission(b)) * b.base_color * (DVec3::ONE - f);
        if !lobe_allowed(mask, shape & LOBE_REFLECTION) {
            r = DVec3::ZERO;
        }
        if !lobe_allowed(mask, shape & LOBE_TRANSMISSION) {
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

    pub(super) fn cosine_lobes(&self, b: &Bsdf, cos_o: f64, inside: bool, mask: u32) -> CosineLobes {
        let m = self.metallic(b);
        let opaque = (1.0 - m) * (1.0 - self.transmission(b));
        let mut diffuse = DVec3::ZERO;
        if opaque > 0.0 && !inside && lobe_allowed(mask, LOBE_DIFFUSE & LOBE_REFLECTION) {
            diffuse = opaque * b.base_color * self.layer_loss(b, cos_o);
        }
        let mut metal = DVec3::ZERO;
        let microfacets = !b.is_delta() && !self.is_phong(b) && !self.is_classic(b);
        let compensated = self.features.metal && self.features.multiple_scattering && microfacets;
        if compensated && lobe_allowed(mask, LOBE_GLOSSY & LOBE_REFLECTION) {
            let e_average = albedo_average(self.table, 0, b.alpha);
            let loss = 1.0 - e_average;
            if loss > LOSS_MIN {
                // 1/21 = 2∫(1 − μ)⁵ μ dμ
                let by_color = || b.base_color.lerp(DVec3::ONE, 1.0 / 21.0);
                let f = self.conductor_average(b).unwrap_or_else(by_color);
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

    pub(super) fn cosine_lobes_eval(&self, b: &Bsdf, lobes: &CosineLobes, cos_i: f64) -> DVec3 {
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
}

/// Smith's masking of one direction by a classical metal.
fn classic_g1(b: &Bsdf, w: DVec3) -> f64 {
    if b.flags & BSDF_BECKMANN != 0 {
        beckmann_g1(w, b.alpha)
    } else if b.flags & BSDF_COSINE_LOBE != 0 {
        cosine_lobe_g1(w, cosine_lobe_exponent(b.alpha))
    } else {
        ggx_g1(w.z, b.alpha)
    }
}

/// The geometric term of a classical metal, over 4 (n·ωi)(n·ωo).
fn classic_g(b: &Bsdf, wo: DVec3, wi: DVec3, h: DVec3) -> f64 {
    if b.flags & BSDF_SIMPLIFIED_G != 0 {
        kelemen_g(wi, h)
    } else if b.flags & BSDF_SMITH_G != 0 {
        smith_g(wi, wo, classic_g1(b, wi), classic_g1(b, wo))
    } else {
        cook_torrance_g(wi, wo, h)
    }
}

/// Probability of reflection at a microfacet.
pub(super) fn reflection_probability(r: DVec3, t: DVec3) -> f64 {
    let total = mean3(r) + mean3(t);
    if total > 0.0 { mean3(r) / total } else { 1.0 }
}

/// Radiance scaling of a refraction.
pub(super) fn refraction_scale(b: &Bsdf, eta: f64) -> f64 {
    if b.flags & BSDF_IMPORTANCE != 0 {
        1.0
    } else {
        1.0 / (eta * eta)
    }
}
