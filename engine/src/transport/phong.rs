//! Modified Phong reflection with conserved energy.
//!
//! f = reflectance · (n + 2)/(2π) · cosⁿ α, α measured from the mirror direction: Lafortune and Willems, "Using the Modified Phong
//! Reflectance Model for Physically Based Rendering" (1994). Guarantees: reciprocal; albedo = reflectance at normal incidence, less
//! at other angles, where the horizon cuts the lobe. The lobe ends a right angle from the mirror direction, so that n = 0 is Lambert at
//! normal incidence only. Frame: z is the normal; `wo.z` > 0. Twin of `transport/phong.glsl`.

use super::warp::{direction_below_pole, orthonormal_basis};
use crate::catalogue::{Bias, Role, Row, sources};
use glam::{DVec2, DVec3};
use std::f64::consts::FRAC_1_PI;

fn mirror(wo: DVec3) -> DVec3 {
    DVec3::new(-wo.x, -wo.y, wo.z)
}

/// f cos θi, sr⁻¹.
pub fn phong_eval(reflectance: DVec3, exponent: f64, wo: DVec3, wi: DVec3) -> DVec3 {
    let c = mirror(wo).dot(wi);
    if wi.z <= 0.0 || c <= 0.0 {
        return DVec3::ZERO;
    }
    reflectance * ((exponent + 2.0) * (0.5 * FRAC_1_PI) * c.powf(exponent) * wi.z)
}

/// Density of [`phong_sample`] over the whole sphere, sr⁻¹.
pub fn phong_pdf(exponent: f64, wo: DVec3, wi: DVec3) -> f64 {
    let c = mirror(wo).dot(wi);
    if c > 0.0 {
        (exponent + 1.0) * (0.5 * FRAC_1_PI) * c.powf(exponent)
    } else {
        0.0
    }
}

/// A direction about the mirror direction; it may lie below the surface, where [`phong_eval`] is zero.
pub fn phong_sample(exponent: f64, wo: DVec3, u: DVec2) -> DVec3 {
    let c = (1.0 - u.y).powf(1.0 / (exponent + 1.0));
    let w = direction_below_pole(1.0 - c, u.x);
    let axis = mirror(wo);
    let (t, b) = orthonormal_basis(axis);
    t * w.x + b * w.y + axis * w.z
}

/// Rows of the catalogue.
pub(crate) const ROWS: &[Row] = &[Row {
    id: "PM-F-2",
    name: "surface models: Lambert, mirror, refraction (path tracer); modified Phong (function)",
    role: Role::PartOf("BG-3"),
    limits: "The modified Phong lobe is only a function: no material of a scene has it.",
    sources: &[sources::LAFORTUNE_WILLEMS_1994.whole(), sources::WALTER_2007.whole()],
    shaders: &["shaders/transport/phong.glsl"],
    bias: Some(Bias::Unbiased),
    tests: &[
        "engine/src/transport/phong.rs::white_furnace",
        "engine/src/transport/phong.rs::reciprocal",
        "engine/src/transport/phong.rs::samples_follow_their_density",
        "engine/src/transport/bsdf/tests.rs::specular_zero_is_exactly_lambert",
        "engine/src/transport/bsdf/tests.rs::clear_solid_is_the_smooth_dielectric",
        "tests/tests/path_tracer.rs::smooth_slabs_transmit_and_reflect_in_closed_form",
        "tests/tests/twins/reflection.rs::phong_agrees_with_its_twin",
    ],
    experiment: "clerestory agreement --scene cornell-box,cornell-mirror,cornell-glass",
    api: &["clerestory::transport::phong"],
    ..Row::of(file!())
}];

#[cfg(test)]
mod tests {
    use super::super::testing::{random3, sphere_test};
    use super::super::warp::{square_to_cosine_hemisphere, square_to_hemisphere};
    use super::*;
    use std::f64::consts::PI;

    fn direction(cos_theta: f64) -> DVec3 {
        DVec3::new((1.0 - cos_theta * cos_theta).sqrt(), 0.0, cos_theta)
    }

    /// Midpoint rule of 10⁶ points over the hemisphere, even in projected solid angle.
    fn reflectivity(f: impl Fn(DVec3) -> f64) -> f64 {
        let n = 1000u32;
        let mut sum = 0.0;
        for i in 0..n * n {
            let u = (DVec2::new(f64::from(i % n), f64::from(i / n)) + 0.5) / f64::from(n);
            let wi = square_to_cosine_hemisphere(u);
            sum += f(wi) * PI / wi.z;
        }
        sum / f64::from(n * n)
    }

    #[test]
    fn white_furnace() {
        let k = 0.7;
        let lambert = reflectivity(|wi| k * FRAC_1_PI * wi.z);
        assert!((lambert - k).abs() < 1e-4);
        for exponent in [0.0, 1.0, 20.0] {
            let at = |cos_o: f64| reflectivity(|wi| phong_eval(DVec3::splat(k), exponent, direction(cos_o), wi).x);
            assert!((at(1.0) - k).abs() < 1e-4, "normal incidence, n = {exponent}");
            assert!(at(0.05) < k, "grazing incidence, n = {exponent}");
        }
        let without_cosine = |wi: DVec3| k * FRAC_1_PI * wi.z / wi.z;
        assert!(
            reflectivity(without_cosine) > 1.9 * k,
            "without the cosine a Lambert surface seems to give twice"
        );
    }

    #[test]
    fn reciprocal() {
        for i in 0..10_000 {
            let (a, b) = (random3(i, 1), random3(i, 2));
            let (wo, wi) = (square_to_hemisphere(a.truncate()), square_to_hemisphere(b.truncate()));
            let forth = phong_eval(DVec3::ONE, 30.0 * a.z, wo, wi).x / wi.z;
            let back = phong_eval(DVec3::ONE, 30.0 * a.z, wi, wo).x / wo.z;
            assert!((forth - back).abs() <= 1e-6 * forth.max(1.0));
        }
    }

    /// Chi-square at p = 1e-5.
    #[test]
    fn samples_follow_their_density() {
        for (seed, exponent) in [(1, 1.0), (2, 10.0)] {
            let wo = direction(0.4);
            let p = sphere_test(
                40_000,
                seed,
                16,
                |u| Some(phong_sample(exponent, wo, u.truncate())),
                |wi| phong_pdf(exponent, wo, wi),
            );
            assert!(p > 1e-5, "n = {exponent}: {p}");
        }
    }
}
