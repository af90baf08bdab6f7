//! The conductor's Fresnel factor with sin² left out beside |n + ik|².
//!
//! Source: Gulbrandsen, "Artist Friendly Metallic Fresnel" (JCGT 3(4), 2014), which takes it for his reflectance and edge tint
//! ([`scene::metals::artistic`](crate::scene::metals::artistic)). Guarantees: exact at normal and at grazing incidence; in [0, 1]. Twin of
//! `transport/fresnel_forms.glsl`.

use glam::DVec3;

use crate::catalogue::{Bias, Role, Row, sources};

/// The conductor's factor with sin² θ left out beside |η + ik|², per band.
pub fn fresnel_simplified(cos_i: f64, eta: DVec3, k: DVec3) -> DVec3 {
    let c2 = cos_i * cos_i;
    let s = eta * eta + k * k;
    let cross = 2.0 * cos_i * eta;
    let (sum_p, sum_s) = (s * c2 + 1.0, s + c2);
    0.5 * ((sum_p - cross) / (sum_p + cross) + (sum_s - cross) / (sum_s + cross))
}

/// Rows of the catalogue.
pub(crate) const ROWS: &[Row] = &[Row {
    id: "CL-SIMPLIFIED-CONDUCTOR",
    name: "simplified conductor: Fresnel factor without the sine in its root",
    role: Role::PartOf("BG-3"),
    limits: "Up to 1.2 % off for the metals that are tabulated, and wrong for dielectrics.",
    sources: &[sources::GULBRANDSEN_2014.whole()],
    shaders: &["shaders/transport/fresnel_forms.glsl"],
    bias: Some(Bias::Biased("sin² is left out beside |n + ik|²")),
    tests: &[
        "engine/src/transport/fresnel/simplified.rs::the_simplified_factor_is_exact_at_its_ends",
        "engine/src/transport/fresnel/form.rs::forms_err_at_metals_as_published",
        "tests/tests/twins/fresnel_forms.rs::forms_agree_with_their_twins",
    ],
    experiment: "clerestory metal gold",
    api: &["clerestory::transport::fresnel::simplified"],
    settings: &["clerestory::scene::FresnelForm"],
    ..Row::of(file!())
}];

#[cfg(test)]
mod tests {
    use super::super::fresnel_conductor;
    use super::super::published::METALS;
    use super::*;

    #[test]
    fn the_simplified_factor_is_exact_at_its_ends() {
        for metal in METALS {
            let (eta, k) = (DVec3::splat(metal.n), DVec3::splat(metal.k));
            for c in [0.0, 1.0] {
                let gap = (fresnel_simplified(c, eta, k) - fresnel_conductor(c, eta, k)).x.abs();
                assert!(gap < 1e-12, "{} at {c}: {gap}", metal.name);
            }
        }
    }
}
