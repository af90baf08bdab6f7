//! Schlick's curve with its reflectance given near grazing incidence too, at a cosine of 1/7 (82°), where the term c (1 − c)⁶ is greatest.
//!
//! Sources: Hoffman, "Fresnel Equations Considered Harmful" (Eurographics Workshop on Material Appearance Modeling 2019), which fixes the
//! exponent of Lazányi and Szirmay-Kalos (2005) at 6 and gives the reflectance there; Kutz, Hašan and Edmondson, "Novel Aspects of the Adobe
//! Standard Material" (2021), F82-tint, which gives it as a share of Schlick's curve in [0, 1], so that the curve can only be lowered.
//! Guarantees: exact at normal incidence, at grazing incidence and, but for a tint that was cut off, at 1/7; results lie in [0, 1]. Twin of
//! `transport/fresnel_forms.glsl`.

use glam::DVec3;

use super::rescaled::{conductor_f0, fresnel_schlick_average};
use super::{fresnel_conductor, fresnel_schlick, schlick_weight};
use crate::catalogue::{Bias, Role, Row, sources};

/// Where the reflectance is given.
pub const TINT_COSINE: f64 = 1.0 / 7.0;
/// c (1 − c)⁶ there: (6/7)⁶/7.
const TERM_THERE: f64 = 46_656.0 / 823_543.0;

/// Schlick's curve less b c (1 − c)⁶ per band, kept in [0, 1].
pub fn fresnel_tinted(cos_i: f64, f0: DVec3, b: DVec3) -> DVec3 {
    let m = (1.0 - cos_i).clamp(0.0, 1.0);
    let term = cos_i * m * schlick_weight(cos_i);
    (fresnel_schlick(cos_i, f0) - b * term).clamp(DVec3::ZERO, DVec3::ONE)
}

/// Cosine-weighted hemispherical average 2∫F(μ)μ dμ of [`fresnel_tinted`] where nothing is cut off.
pub fn fresnel_tinted_average(f0: DVec3, b: DVec3) -> DVec3 {
    // 4/((6 + 1)(6 + 2)(6 + 3)), as for any other exponent.
    fresnel_schlick_average(f0) - b / 126.0
}

/// The coefficient for a reflectance `f82` at [`TINT_COSINE`] (Hoffman).
pub fn hoffman_coefficient(f0: DVec3, f82: DVec3) -> DVec3 {
    (fresnel_schlick(TINT_COSINE, f0) - f82) / TERM_THERE
}

/// The coefficient for a tint in [0, 1] of Schlick's curve there (Kutz et al.); others are cut off.
pub fn f82_tint_coefficient(f0: DVec3, tint: DVec3) -> DVec3 {
    let tint = tint.clamp(DVec3::ZERO, DVec3::ONE);
    hoffman_coefficient(f0, tint * fresnel_schlick(TINT_COSINE, f0))
}

/// Normal reflectance and coefficient of a metal, matched at [`TINT_COSINE`]; `tint` keeps to tints of at most 1.
pub fn tinted_metal(eta: DVec3, k: DVec3, tint: bool) -> [DVec3; 2] {
    let (f0, f82) = (conductor_f0(eta, k), fresnel_conductor(TINT_COSINE, eta, k));
    let b = if tint {
        f82_tint_coefficient(f0, f82 / fresnel_schlick(TINT_COSINE, f0))
    } else {
        hoffman_coefficient(f0, f82)
    };
    [f0, b]
}

/// Rows of the catalogue.
pub(crate) const ROWS: &[Row] = &[Row {
    id: "CL-F82-TINT",
    name: "Schlick approximation with a reflectance at 82 degrees: Hoffman's and F82-tint",
    role: Role::PartOf("BG-3"),
    limits: "One exponent for all metals: up to 3.8 % off for those that are tabulated; F82-tint cannot rise above Schlick's curve.",
    sources: &[
        sources::HOFFMAN_2019.whole(),
        sources::KUTZ_2021.at("F82-tint"),
        sources::LAZANYI_SZIRMAY_KALOS_2005.whole(),
    ],
    shaders: &["shaders/transport/fresnel_forms.glsl"],
    bias: Some(Bias::Biased("one term of one coefficient stands for the dip")),
    tests: &[
        "engine/src/transport/fresnel/tinted.rs::curves_meet_the_exact_one_at_82_degrees",
        "engine/src/transport/fresnel/form.rs::forms_err_at_metals_as_published",
        "tests/tests/twins/fresnel_forms.rs::forms_agree_with_their_twins",
    ],
    experiment: "clerestory metal gold",
    api: &["clerestory::transport::fresnel::tinted"],
    settings: &["clerestory::scene::FresnelForm"],
    ..Row::of(file!())
}];

#[cfg(test)]
mod tests {
    use super::super::published::METALS;
    use super::*;

    #[test]
    fn curves_meet_the_exact_one_at_82_degrees() {
        // The term is greatest there.
        let term = |c: f64| c * (1.0 - c).powi(6);
        assert!((TERM_THERE - term(TINT_COSINE)).abs() < 1e-16);
        assert!(term(TINT_COSINE) > term(TINT_COSINE - 1e-3) && term(TINT_COSINE) > term(TINT_COSINE + 1e-3));
        for metal in METALS {
            let [eta, k] = metal.index().map(DVec3::splat);
            let exact = fresnel_conductor(TINT_COSINE, eta, k).x;
            assert!((exact - metal.at_82_degrees).abs() < 5e-5, "{}: {exact}", metal.name);
            let [f0, b] = tinted_metal(eta, k, false);
            assert!((f0.x - metal.f0).abs() < 5e-5, "{}: {}", metal.name, f0.x);
            assert!((b.x - metal.tinted[0]).abs() < 5e-5, "{}: {}", metal.name, b.x);
            assert!((fresnel_tinted(TINT_COSINE, f0, b).x - exact).abs() < 1e-12);
            assert_eq!(fresnel_tinted(1.0, f0, b), f0);
            assert_eq!(fresnel_tinted(0.0, f0, b), DVec3::ONE);
            // No tabulated metal lies above Schlick's curve there, and the two forms are one.
            assert!(
                (tinted_metal(eta, k, true)[1] - b).abs().max_element() < 1e-12,
                "{}",
                metal.name
            );
        }
        // A dielectric near 1 does: the tint is cut off, Hoffman's coefficient is negative.
        let (eta, k) = (DVec3::splat(1.5), DVec3::splat(1.0));
        let above = fresnel_conductor(TINT_COSINE, eta, k).x > fresnel_schlick(TINT_COSINE, conductor_f0(eta, k)).x;
        assert!(above && tinted_metal(eta, k, false)[1].x < 0.0);
        assert_eq!(tinted_metal(eta, k, true)[1], DVec3::ZERO);
        // A black edge stays at zero where the curve would go below.
        let black = f82_tint_coefficient(DVec3::splat(0.02), DVec3::ZERO);
        for i in 0..=1000 {
            assert!(fresnel_tinted(f64::from(i) / 1000.0, DVec3::splat(0.02), black).min_element() >= 0.0);
        }
    }

    #[test]
    fn the_average_is_the_integral() {
        let (f0, b) = (DVec3::new(0.9, 0.5, 0.7), DVec3::new(3.2, 0.06, 1.6));
        let mut sum = DVec3::ZERO;
        for i in 0..20_000 {
            let mu = (f64::from(i) + 0.5) / 20_000.0;
            sum += fresnel_tinted(mu, f0, b) * (2.0 * mu / 20_000.0);
        }
        let found = fresnel_tinted_average(f0, b);
        assert!((sum - found).abs().max_element() < 1e-7, "{sum} {found}");
    }
}
