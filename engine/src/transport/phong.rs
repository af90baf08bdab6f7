//! Modified Phong reflection with conserved energy.
//!
//! f = reflectance · (n + 2)/(2π) · cosⁿ α, α measured from the mirror direction: Lafortune and Willems, "Using the Modified Phong
//! Reflectance Model for Physically Based Rendering" (1994). Guarantees: reciprocal; albedo = reflectance at normal incidence, less
//! at other angles, where the horizon cuts the lobe. The lobe ends a right angle from the mirror direction, so that n = 0 is Lambert at
//! normal incidence only. cosⁿ α comes from the distance to the mirror direction, so that narrow lobes keep their digits in f32. Materials
//! give an exponent by the width of a GGX lobe ([`phong_exponent`]). Frame: z is the normal; `wo.z` > 0. Twin of `transport/phong.glsl`.

use super::warp::{direction_below_pole, orthonormal_basis};
use crate::catalogue::{Bias, Role, Row, sources};
use glam::{DVec2, DVec3};
use std::f64::consts::FRAC_1_PI;

fn mirror(wo: DVec3) -> DVec3 {
    DVec3::new(-wo.x, -wo.y, wo.z)
}

/// The exponent whose lobe is about as wide as the GGX lobe of width `alpha` in (0, 1]: 0 for 1.
///
/// About the half vector an exponent m is as wide as α² = 2/(m + 2) (Walter et al. 2007, §5.2), and the half vector turns by half the angle
/// of the mirror direction: m = 4n.
pub fn phong_exponent(alpha: f64) -> f64 {
    0.5 * (1.0 / (alpha * alpha) - 1.0)
}

/// cosⁿ of the angle from the mirror direction; 0 from a right angle on.
fn phong_power(exponent: f64, wo: DVec3, wi: DVec3) -> f64 {
    let below_one = 0.5 * (wi - mirror(wo)).length_squared();
    if below_one < 1.0 {
        (exponent * (-below_one).ln_1p()).exp()
    } else {
        0.0
    }
}

/// f cos θi, sr⁻¹.
pub fn phong_eval(reflectance: DVec3, exponent: f64, wo: DVec3, wi: DVec3) -> DVec3 {
    if wi.z <= 0.0 {
        return DVec3::ZERO;
    }
    reflectance * ((exponent + 2.0) * (0.5 * FRAC_1_PI) * phong_power(exponent, wo, wi) * wi.z)
}

/// Density of [`phong_sample`] over the whole sphere, sr⁻¹.
pub fn phong_pdf(exponent: f64, wo: DVec3, wi: DVec3) -> f64 {
    (exponent + 1.0) * (0.5 * FRAC_1_PI) * phong_power(exponent, wo, wi)
}

/// A direction about the mirror direction; it may lie below the surface, where [`phong_eval`] is zero.
pub fn phong_sample(exponent: f64, wo: DVec3, u: DVec2) -> DVec3 {
    // One minus the cosine (1 − u)^(1/(n + 1)).
    let below_one = -((-u.y).ln_1p() / (exponent + 1.0)).exp_m1();
    let w = direction_below_pole(below_one, u.x);
    let axis = mirror(wo);
    let (t, b) = orthonormal_basis(axis);
    t * w.x + b * w.y + axis * w.z
}

/// Rows of the catalogue.
pub(crate) const ROWS: &[Row] = &[Row {
    id: "PM-F-2",
    name: "surface models: Lambert, mirror, refraction, modified Phong",
    role: Role::PartOf("BG-3"),
    limits: "A modified Phong lobe stands in place of a metal's, on a base without coat or transmission; the preview refuses it.",
    sources: &[sources::LAFORTUNE_WILLEMS_1994.whole(), sources::WALTER_2007.whole()],
    shaders: &["shaders/transport/phong.glsl", "shaders/transport/below_one.glsl"],
    bias: Some(Bias::Unbiased),
    tests: &[
        "engine/src/transport/phong.rs::white_furnace",
        "engine/src/transport/phong.rs::reciprocal",
        "engine/src/transport/phong.rs::samples_follow_their_density",
        "engine/src/transport/bsdf/tests.rs::phong_surfaces_are_their_two_lobes",
        "engine/src/transport/bsdf/tests.rs::specular_zero_is_exactly_lambert",
        "engine/src/transport/bsdf/tests.rs::clear_solid_is_the_smooth_dielectric",
        "engine/tests/scene_load.rs::modified_phong_surfaces_are_loaded_and_checked",
        "tests/tests/twins/scattering.rs::the_scattering_function_agrees_with_its_twin",
        "tests/tests/paths/path_tracer.rs::phong_floors_under_a_sky_have_their_albedo",
        "tests/tests/paths/path_tracer.rs::smooth_slabs_transmit_and_reflect_in_closed_form",
        "tests/tests/photon/materials.rs::walls_of_all_kinds_light_the_floor",
        "tests/tests/preview/technique.rs::scenes_whose_light_it_would_leave_out_are_refused",
        "tests/tests/twins/reflection.rs::phong_agrees_with_its_twin",
    ],
    experiment: "clerestory agreement --scene cornell-box,cornell-mirror,cornell-glass",
    api: &["clerestory::transport::phong"],
    settings: &["clerestory::scene::Material"],
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

    /// Of Beckmann's normals of width α, 1 − e⁻¹ lie within the angle whose tangent is α, and turn light by less than twice as much at normal
    /// incidence; as much of the Phong lobe lies there.
    #[test]
    fn exponents_are_those_of_widths() {
        assert_eq!(phong_exponent(1.0), 0.0);
        for alpha in [0.003f64, 0.01, 0.03] {
            let within = 1.0 - (2.0 * alpha.atan()).cos().powf(phong_exponent(alpha) + 1.0);
            assert!((within - (1.0 - (-1.0f64).exp())).abs() < alpha, "{alpha}: {within}");
        }
    }

    /// Where f32 would lose all digits of a cosine that is nearly one.
    #[test]
    fn narrow_lobes_are_those_of_the_power() {
        let (wo, exponent) = (direction(0.7), 5e5);
        for angle in [0.0, 1e-4, 1e-3, 3e-3] {
            let wi = DVec3::new(-wo.x * f64::cos(angle), wo.x * f64::sin(angle), wo.z);
            let c = mirror(wo).dot(wi);
            let (found, power) = (phong_power(exponent, wo, wi), c.powf(exponent));
            assert!((found - power).abs() <= 1e-9 * power, "{angle}: {found} {power}");
        }
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
