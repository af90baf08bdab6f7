//! Isotropic GGX microfacets with Smith masking.
//!
//! Sources: Walter et al., "Microfacet Models for Refraction through Rough Surfaces" (EGSR 2007); Heitz, "Understanding the
//! Masking-Shadowing Function" (JCGT 3(2), 2014); visible normals by spherical caps, Dupuy and Benyoub, "Sampling Visible GGX
//! Normals with Spherical Caps" (HPG 2023). Guarantees: for alpha ≥ [`ALPHA_MIN`] all values are finite, in f32 too; sampled
//! normals face `wo` and the macrosurface. Twin of `transport/ggx.glsl`; all directions in the frame whose z is the normal.

use glam::{DVec2, DVec3};
use std::f64::consts::{FRAC_1_PI, TAU};

use crate::catalogue::{Bias, Role, Row, sources};

/// Below this the lobe is a Dirac delta: half vectors carry f32 errors of 1e-7, a part in 10⁴ of this width. The shader has it rounded;
/// the albedo table is laid out by the exact value.
pub const ALPHA_MIN: f64 = 1e-3;

/// Density of microfacet normals.
pub fn ggx_d(h: DVec3, alpha: f64) -> f64 {
    let a2 = alpha * alpha;
    let d = h.truncate().length_squared() + a2 * h.z * h.z;
    a2 * FRAC_1_PI / (d * d)
}

/// cos θ √(1 + α² tan² θ): the part of Smith's Λ that all masking terms share.
pub fn ggx_stretched_cos(cos_theta: f64, alpha: f64) -> f64 {
    let a2 = alpha * alpha;
    (a2 + (1.0 - a2) * cos_theta * cos_theta).sqrt()
}

/// Smith masking of one direction; the cosine must be positive.
pub fn ggx_g1(cos_theta: f64, alpha: f64) -> f64 {
    2.0 * cos_theta / (cos_theta + ggx_stretched_cos(cos_theta, alpha))
}

/// Masking and shadowing of a reflection, height-correlated or (`separable`) G1·G1; both cosines positive.
pub fn ggx_g2(cos_o: f64, cos_i: f64, alpha: f64, separable: bool) -> f64 {
    if separable {
        return ggx_g1(cos_o, alpha) * ggx_g1(cos_i, alpha);
    }
    let o = cos_i * ggx_stretched_cos(cos_o, alpha);
    let i = cos_o * ggx_stretched_cos(cos_i, alpha);
    2.0 * cos_o * cos_i / (o + i)
}

/// Density of the normals visible from `wo`, per solid angle of `h`.
pub fn ggx_visible_pdf(wo: DVec3, h: DVec3, alpha: f64) -> f64 {
    2.0 * wo.dot(h).max(0.0) * ggx_d(h, alpha) / (wo.z + ggx_stretched_cos(wo.z, alpha))
}

/// A normal visible from `wo` (`wo.z` ≥ 0) with density [`ggx_visible_pdf`].
pub fn ggx_sample_visible(wo: DVec3, alpha: f64, u: DVec2) -> DVec3 {
    let v = DVec3::new(alpha * wo.x, alpha * wo.y, wo.z).normalize();
    let z = (1.0 - u.y) * (1.0 + v.z) - v.z;
    let r = (1.0 - z * z).clamp(0.0, 1.0).sqrt();
    let (sin, cos) = (TAU * u.x).sin_cos();
    let h = DVec3::new(r * cos, r * sin, z) + v;
    DVec3::new(alpha * h.x, alpha * h.y, h.z).normalize()
}

/// Rows of the catalogue.
pub(crate) const ROWS: &[Row] = &[Row {
    id: "CL-GGX",
    name: "GGX distribution, height-correlated masking, visible normals by spherical caps",
    role: Role::PartOf("BG-3"),
    limits: "Isotropic, without scattering among microfacets.",
    sources: &[
        sources::WALTER_2007.whole(),
        sources::HEITZ_2014.whole(),
        sources::DUPUY_BENYOUB_2023.whole(),
    ],
    shaders: &["shaders/transport/ggx.glsl"],
    bias: Some(Bias::Unbiased),
    tests: &[
        "engine/src/transport/ggx.rs::densities_are_normalised",
        "engine/src/transport/ggx.rs::visible_normals_follow_their_density",
        "engine/src/transport/ggx.rs::masking_limits",
        "engine/src/transport/bsdf/tests.rs::light_of_one_reflection_leaves_as_walks_over_heights_do",
        "tests/tests/paths/samplers.rs::visible_normals_follow_their_density",
        "tests/tests/paths/path_tracer.rs::rough_glass_loses_what_the_f64_twin_says",
        "tests/tests/twins/reflection.rs::ggx_agrees_with_its_twin",
    ],
    experiment: "clerestory agreement --scene cornell-frosted,ring-rough",
    api: &["clerestory::transport::ggx"],
    ..Row::of(file!())
}];

#[cfg(test)]
mod tests {
    use super::super::testing::{random3, sphere_test};
    use super::*;
    use crate::gpu::shaders::constants;
    use crate::transport::albedo::ALPHA_ROOT_MIN;

    #[test]
    fn the_shaders_least_width_is_the_rounded_one() {
        assert_eq!(ALPHA_MIN as f32, constants::ALPHA_MIN);
        assert_eq!(ALPHA_ROOT_MIN as f32, constants::ALPHA_ROOT_MIN);
        assert!((ALPHA_ROOT_MIN.powi(4) - ALPHA_MIN).abs() < 1e-17);
    }

    /// ∫ over the sphere's upper half of `f`, by a midpoint rule in θ² / φ that resolves narrow lobes at the pole.
    fn integrate(f: impl Fn(DVec3) -> f64) -> f64 {
        let n = 600;
        let mut sum = 0.0;
        for i in 0..n {
            let s = (f64::from(i) + 0.5) / f64::from(n);
            let theta = s * s * TAU / 4.0;
            for j in 0..n / 6 {
                let phi = TAU * (f64::from(j) + 0.5) / f64::from(n / 6);
                let h = DVec3::new(theta.sin() * phi.cos(), theta.sin() * phi.sin(), theta.cos());
                sum += f(h) * theta.sin() * s;
            }
        }
        sum * (TAU / 2.0) * TAU / f64::from(n * (n / 6))
    }

    #[test]
    fn densities_are_normalised() {
        for alpha in [0.01, 0.1, 0.5, 1.0] {
            assert!(
                (integrate(|h| ggx_d(h, alpha) * h.z) - 1.0).abs() < 2e-3,
                "projected area, alpha {alpha}"
            );
            for cos_o in [0.05, 0.5, 1.0f64] {
                let wo = DVec3::new((1.0 - cos_o * cos_o).sqrt(), 0.0, cos_o);
                let seen = integrate(|h| ggx_visible_pdf(wo, h, alpha));
                assert!(
                    (seen - 1.0).abs() < 5e-3,
                    "visible normals, alpha {alpha}, cos {cos_o}: {seen}"
                );
            }
        }
    }

    /// Chi-square at p = 1e-5 each, 6 tests.
    #[test]
    fn visible_normals_follow_their_density() {
        for (seed, alpha) in [(1, 0.2), (2, 0.6), (3, 1.0)] {
            for cos_o in [0.1, 0.8f64] {
                let wo = DVec3::new((1.0 - cos_o * cos_o).sqrt(), 0.0, cos_o);
                let p = sphere_test(
                    40_000,
                    seed,
                    16,
                    |u| Some(ggx_sample_visible(wo, alpha, u.truncate())),
                    |h| if h.z > 0.0 { ggx_visible_pdf(wo, h, alpha) } else { 0.0 },
                );
                assert!(p > 1e-5, "alpha {alpha}, cos {cos_o}: {p}");
            }
        }
    }

    /// What is seen from two directions at once, by heights that are evenly distributed: a place that lies higher than a share x of all is seen
    /// from a direction with the probability x^Λ, whatever is seen from the other (Heitz 2014, §5).
    fn seen_from_both(g1: [f64; 2]) -> f64 {
        let lambda = g1.map(|g1| 1.0 / g1 - 1.0);
        let n = 4000_u32;
        let seen = |i: u32| {
            let x = (f64::from(i) + 0.5) / f64::from(n);
            x.powf(lambda[0]) * x.powf(lambda[1])
        };
        (0..n).map(seen).sum::<f64>() / f64::from(n)
    }

    #[test]
    fn masking_limits() {
        let mut told_apart = 0;
        for i in 0..1000 {
            let u = random3(i, 4);
            let (o, w, alpha) = (u.x.max(1e-6), u.y.max(1e-6), u.z.max(ALPHA_MIN));
            let g1 = [o, w].map(|cos| ggx_g1(cos, alpha));
            let (least, g2, product) = (g1[0].min(g1[1]), ggx_g2(o, w, alpha, false), ggx_g2(o, w, alpha, true));
            assert!(
                g2 <= least + 1e-15 && product <= g2 + 1e-15,
                "correlated masking lies between the bounds"
            );
            assert_eq!(ggx_g2(o, w, alpha, false), ggx_g2(w, o, alpha, false));
            // The rule of midpoints errs by less than 10⁻⁵ there.
            if o.min(w) > 0.02 {
                let both = seen_from_both(g1);
                assert!((g2 - both).abs() < 1e-5, "cos {o} and {w}, alpha {alpha}: {g2} {both}");
                told_apart += u32::from(least - g2 > 1e-3 && g2 - product > 1e-3);
            }
        }
        assert!(told_apart > 500, "{told_apart} are neither bound");
        assert_eq!(ggx_g1(1.0, 0.7), 1.0);
        assert_eq!(ggx_g2(1.0, 1.0, 0.7, false), 1.0);
        let edge = ggx_sample_visible(DVec3::X, 0.5, DVec2::new(0.3, 1.0));
        assert!(edge.is_finite() && edge.z >= 0.0);
    }
}
