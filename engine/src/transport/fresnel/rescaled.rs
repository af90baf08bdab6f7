//! Schlick's approximation from an index of refraction, and its rescaling to a conductor's reflectance at normal incidence.
//!
//! Sources: Schlick, "An Inexpensive BRDF Model for Physically-based Rendering" (1994); Lazányi and Szirmay-Kalos, "Fresnel Term
//! Approximations for Metals" (WSCG 2005). F* = ((n − 1)² + k² + 4n (1 − c)⁵)/((n + 1)² + k²): one minus Schlick's curve, times what makes
//! it meet the exact factor at normal incidence. Guarantees: exact at normal and at grazing incidence; k = 0 gives Schlick's; falls with
//! the cosine, so that the dip of metals near grazing incidence is missing, which is the error. Twin of `transport/fresnel_forms.glsl`.

use glam::DVec3;

use super::{fresnel_schlick, schlick_weight};
use crate::catalogue::{Bias, Role, Row, sources};

/// Reflectance of a conductor against vacuum at normal incidence, ((n − 1)² + k²)/((n + 1)² + k²).
pub fn conductor_f0(eta: DVec3, k: DVec3) -> DVec3 {
    let (below, above, k2) = (eta - 1.0, eta + 1.0, k * k);
    (below * below + k2) / (above * above + k2)
}

/// Schlick's curve of the real part of the index alone.
pub fn fresnel_schlick_index(cos_i: f64, eta: DVec3) -> DVec3 {
    fresnel_schlick(cos_i, conductor_f0(eta, DVec3::ZERO))
}

/// Schlick's curve scaled to the conductor's reflectance at normal incidence, as one fraction.
pub fn fresnel_rescaled(cos_i: f64, eta: DVec3, k: DVec3) -> DVec3 {
    let (below, above, k2) = (eta - 1.0, eta + 1.0, k * k);
    (below * below + k2 + 4.0 * schlick_weight(cos_i) * eta) / (above * above + k2)
}

/// Cosine-weighted hemispherical average 2∫F(μ)μ dμ of Schlick's curve.
pub fn fresnel_schlick_average(f0: DVec3) -> DVec3 {
    // 2∫(1 − μ)⁵ μ dμ
    f0 + (DVec3::ONE - f0) / 21.0
}

/// Rows of the catalogue.
pub(crate) const ROWS: &[Row] = &[
    Row {
        id: "MET-F2",
        name: "Schlick's approximation from the real part of the index",
        role: Role::PartOf("BG-3"),
        limits: "Without k it is useless for metals: 13 to 100 % off; beside dielectrics it is up to 23 % off for indices from 1.3 to 2, and near 1 by a factor of three.",
        sources: &[sources::SCHLICK_1994.whole()],
        shaders: &["shaders/transport/fresnel_forms.glsl"],
        bias: Some(Bias::Biased("k is left out")),
        tests: &[
            "engine/src/transport/fresnel/rescaled.rs::schlick_errs_at_dielectrics_as_published",
            "engine/src/transport/fresnel/form.rs::forms_err_at_metals_as_published",
            "tests/tests/twins/fresnel_forms.rs::forms_agree_with_their_twins",
        ],
        experiment: "clerestory metal gold",
        api: &["clerestory::transport::fresnel::rescaled"],
        settings: &["clerestory::scene::FresnelForm"],
        ..Row::of(file!())
    },
    Row {
        id: "MET-F3",
        name: "Schlick's approximation rescaled to a metal's n and k",
        role: Role::PartOf("BG-3"),
        limits: "Has no dip near grazing incidence: up to 1 % off for silver, 3 % for gold, 5 % for copper, 19 % for aluminium and 34 % for chromium.",
        sources: &[sources::LAZANYI_SZIRMAY_KALOS_2005.whole()],
        shaders: &["shaders/transport/fresnel_forms.glsl"],
        bias: Some(Bias::Biased("the dip near grazing incidence is left out")),
        tests: &[
            "engine/src/transport/fresnel/rescaled.rs::the_rescaled_curve_meets_the_exact_one_at_its_ends",
            "engine/src/transport/fresnel/rescaled.rs::rescaled_curves_err_as_published",
            "engine/src/transport/fresnel/form.rs::forms_err_at_metals_as_published",
            "tests/tests/twins/fresnel_forms.rs::forms_agree_with_their_twins",
        ],
        experiment: "clerestory metal gold",
        api: &["clerestory::transport::fresnel::rescaled"],
        settings: &["clerestory::scene::FresnelForm"],
        ..Row::of(file!())
    },
];

#[cfg(test)]
mod tests {
    use super::super::published::METALS;
    use super::super::{fresnel_conductor, fresnel_dielectric};
    use super::*;

    const SAMPLES: u32 = 20_000;

    /// Greatest absolute and relative error over the cosines.
    fn worst(form: impl Fn(f64) -> f64, exact: impl Fn(f64) -> f64) -> [f64; 2] {
        (0..=SAMPLES).fold([0.0, 0.0], |[absolute, relative], i| {
            let c = f64::from(i) / f64::from(SAMPLES);
            let (f, e) = (exact(c), (form(c) - exact(c)).abs());
            [f64::max(absolute, e), f64::max(relative, e / f)]
        })
    }

    /// Index, greatest absolute and relative error of Schlick's curve for a dielectric.
    const DIELECTRICS: [[f64; 3]; 13] = [
        [1.1, 0.2105, 1.874],
        [1.2, 0.1130, 0.467],
        [1.3, 0.0683, 0.219],
        [1.4, 0.0461, 0.235],
        [1.5, 0.0357, 0.232],
        [1.6, 0.0319, 0.220],
        [1.8, 0.0345, 0.182],
        [2.0, 0.0444, 0.140],
        [2.2, 0.0582, 0.103],
        [2.4, 0.0740, 0.136],
        [2.6, 0.0909, 0.172],
        [2.8, 0.1080, 0.210],
        [3.0, 0.1250, 0.247],
    ];

    #[test]
    fn schlick_errs_at_dielectrics_as_published() {
        for [eta, absolute, relative] in DIELECTRICS {
            let found = worst(
                |c| fresnel_schlick_index(c, DVec3::splat(eta)).x,
                |c| fresnel_dielectric(c, eta),
            );
            assert!((found[0] - absolute).abs() < 1e-4, "{eta}: {found:?}");
            assert!((found[1] - relative).abs() < 1e-3, "{eta}: {found:?}");
        }
        // The dielectric at cosines 1, 0.5, 0.2, 0.1, 0.05, and Schlick's curve.
        let cosines = [1.0, 0.5, 0.2, 0.1, 0.05];
        for (eta, exact, schlick) in [
            (
                1.1,
                [0.0023, 0.0131, 0.1523, 0.3843, 0.6183],
                [0.0023, 0.0334, 0.3292, 0.5914, 0.7743],
            ),
            (
                1.5,
                [0.0400, 0.0892, 0.3389, 0.5716, 0.7521],
                [0.0400, 0.0700, 0.3546, 0.6069, 0.7828],
            ),
            (
                3.0,
                [0.2500, 0.2718, 0.4019, 0.5680, 0.7291],
                [0.2500, 0.2734, 0.4958, 0.6929, 0.8303],
            ),
        ] {
            for ((c, exact), schlick) in cosines.into_iter().zip(exact).zip(schlick) {
                assert!((fresnel_dielectric(c, eta) - exact).abs() < 5e-5, "{eta} {c}");
                assert!(
                    (fresnel_schlick_index(c, DVec3::splat(eta)).x - schlick).abs() < 5e-5,
                    "{eta} {c}"
                );
            }
        }
    }

    #[test]
    fn rescaled_curves_err_as_published() {
        let extinctions = [0.5, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 8.0, 10.0];
        for (eta, published) in [
            (1.1, [0.420, 0.275, 0.027, 0.091, 0.123, 0.129, 0.125, 0.109, 0.095]),
            (1.5, [0.255, 0.187, 0.048, 0.133, 0.167, 0.173, 0.168, 0.148, 0.128]),
            (2.0, [0.128, 0.088, 0.124, 0.191, 0.221, 0.226, 0.219, 0.194, 0.169]),
            (3.0, [0.249, 0.257, 0.286, 0.316, 0.330, 0.327, 0.316, 0.282, 0.247]),
        ] {
            for (k, published) in extinctions.into_iter().zip(published) {
                let (n, k) = (DVec3::splat(eta), DVec3::splat(k));
                let [_, found] = worst(|c| fresnel_rescaled(c, n, k).x, |c| fresnel_conductor(c, n, k).x);
                assert!((found - published).abs() < 1e-3, "n {eta}, k {}: {found}", k.x);
            }
        }
    }

    #[test]
    fn the_rescaled_curve_meets_the_exact_one_at_its_ends() {
        for metal in METALS {
            let (eta, k) = (DVec3::splat(metal.n), DVec3::splat(metal.k));
            for c in [0.0, 1.0] {
                let gap = (fresnel_rescaled(c, eta, k) - fresnel_conductor(c, eta, k)).x.abs();
                assert!(gap < 1e-12, "{} at {c}: {gap}", metal.name);
            }
            for i in 0..=100 {
                let c = f64::from(i) / 100.0;
                // Both ways of writing it, and Schlick's own without k.
                let f0 = conductor_f0(eta, k);
                assert!(
                    (fresnel_rescaled(c, eta, k) - fresnel_schlick(c, f0))
                        .abs()
                        .max_element()
                        < 1e-15
                );
                let without = fresnel_rescaled(c, eta, DVec3::ZERO) - fresnel_schlick_index(c, eta);
                assert!(without.abs().max_element() < 1e-15);
            }
        }
        // One minus it is Schlick's, times a fifth at n = 1.5, k = 5.
        let (eta, k) = (DVec3::splat(1.5), DVec3::splat(5.0));
        let scale = (1.0 - fresnel_rescaled(0.4, eta, k).x) / (1.0 - fresnel_schlick_index(0.4, eta).x);
        assert!((scale - 0.2).abs() < 1e-12, "{scale}");
    }

    #[test]
    fn the_average_of_schlicks_curve_is_its_integral() {
        let f0 = DVec3::new(0.04, 0.5, 0.95);
        let mut sum = DVec3::ZERO;
        for i in 0..10_000 {
            let mu = (f64::from(i) + 0.5) / 10_000.0;
            sum += fresnel_schlick(mu, f0) * (2.0 * mu / 10_000.0);
        }
        assert!((sum - fresnel_schlick_average(f0)).abs().max_element() < 1e-8);
    }
}
