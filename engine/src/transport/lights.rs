//! Light from triangles, points, spots and directions, their power, and the weights that combine sampling strategies.
//!
//! Sources: spot falloff of the glTF extension `KHR_lights_punctual`; heuristics of Veach (1997, §9.2). Guarantees: densities are per
//! solid angle at the receiver; a light seen edge-on has density and radiance zero, never infinity. Twin of
//! `transport/lights.glsl`.

use super::warp::square_to_triangle;
use crate::catalogue::{Role, Row, sources};
use crate::gpu::shaders::constants;
use crate::scene::LightKind;
use glam::{DVec2, DVec3};
use std::f64::consts::{PI, TAU};

/// `KHR_lights_punctual`'s least difference of the cosines of the cone angles.
const SPOT_COS_RANGE_MIN: f64 = constants::SPOT_COS_RANGE_MIN as f64;

/// Uniform point of a triangle given by a vertex and its two edges.
pub fn triangle_point(p0: DVec3, e1: DVec3, e2: DVec3, u: DVec2) -> DVec3 {
    let b = square_to_triangle(u);
    p0 + b.y * e1 + b.z * e2
}

/// Density per solid angle of a density per area, under the emitter's |cos|; zero edge-on.
pub fn area_to_solid_angle(pdf_area: f64, distance_squared: f64, cos_emitter: f64) -> f64 {
    if cos_emitter > 0.0 {
        pdf_area * distance_squared / cos_emitter
    } else {
        0.0
    }
}

/// Share of a spot light's axial intensity at an angle to its axis.
pub fn spot_falloff(cos_angle: f64, cos_inner: f64, cos_outer: f64) -> f64 {
    let scale = 1.0 / (cos_inner - cos_outer).max(SPOT_COS_RANGE_MIN);
    let a = ((cos_angle - cos_outer) * scale).clamp(0.0, 1.0);
    a * a
}

/// Weight of the strategy with density `a` against one with density `b`; `a` may be infinite, or both zero.
pub fn balance_heuristic(a: f64, b: f64) -> f64 {
    if a > 0.0 { 1.0 / (1.0 + b / a) } else { 0.0 }
}

/// The balance heuristic of the squared densities.
pub fn power_heuristic(a: f64, b: f64) -> f64 {
    let r = b / a;
    if a > 0.0 { 1.0 / (1.0 + r * r) } else { 0.0 }
}

/// Flux, W per band, of a light without area into a scene of bounding radius `scene_radius` (which only a directional light needs).
pub fn light_power(kind: &LightKind, scene_radius: f64) -> DVec3 {
    match *kind {
        LightKind::Point { intensity, .. } => intensity.as_dvec3() * (4.0 * PI),
        LightKind::Spot {
            intensity,
            inner,
            outer,
            ..
        } => {
            let (inner, outer) = (f64::from(inner).cos(), f64::from(outer).cos());
            // ∫ of the squared ramp, cut where its upper end passes the axis.
            let width = (inner - outer).max(SPOT_COS_RANGE_MIN);
            let end = (outer + width).min(1.0);
            let ramp = (end - outer).powi(3) / (3.0 * width * width);
            intensity.as_dvec3() * (TAU * (1.0 - end + ramp))
        }
        LightKind::Directional { irradiance, .. } => irradiance.as_dvec3() * (PI * scene_radius * scene_radius),
    }
}

/// Flux, W per band, of a triangle that emits `radiance` evenly, from one side or from both.
pub fn triangle_power(radiance: DVec3, area: f64, double_sided: bool) -> DVec3 {
    radiance * (PI * area * if double_sided { 2.0 } else { 1.0 })
}

/// Rows of the catalogue.
pub(crate) const ROWS: &[Row] = &[
    Row {
        id: "PM-F-1",
        name: "radiometry of point and spot lights, split into direct and indirect light, from one record a light, written anew where it moves (SVO-P1)",
        role: Role::PartOf("BG-3"),
        limits: "Points and spots have no extent: no ray meets them, so mirrors do not show them.",
        sources: &[
            sources::VEACH_1997.at("chapter 3"),
            sources::KHRONOS_LIGHTS_PUNCTUAL.whole(),
        ],
        shaders: &["shaders/transport/lights.glsl"],
        tests: &[
            "engine/src/transport/lights.rs::point_light_irradiance_and_flux",
            "engine/src/transport/lights.rs::spot_flux_and_falloff",
            "tests/tests/paths/path_tracer.rs::point_spot_and_directional_lights_follow_their_laws",
            "tests/tests/paths/path_tracer.rs::lights_are_chosen_in_the_end_as_often_as_their_weights_say",
            "tests/tests/paths/path_tracer.rs::path_sets_are_a_partition",
            "tests/tests/paths/scene_records.rs::kernels_load_every_word_of_a_record",
            "tests/tests/paths/moving_lights.rs::a_light_that_moves_is_one_record",
            "tests/tests/instant_radiosity/many_light/reflective.rs::powers_of_spots_and_of_parallel_light_are_closed_forms",
            "tests/tests/twins/lights.rs::lights_agree_with_their_twins",
        ],
        experiment: "clerestory agreement --scene cornell-point,sphere-flake",
        api: &["clerestory::transport::lights"],
        ..Row::of(file!())
    },
    Row {
        id: "MET-B1",
        name: "radiometry and rendering equation",
        role: Role::PartOf("BG-3"),
        limits: "Geometric optics in three bands, without polarization and fluorescence.",
        sources: &[sources::KAJIYA_1986.whole()],
        shaders: &["shaders/transport/lights.glsl"],
        tests: &[
            "engine/src/transport/lights.rs::point_light_irradiance_and_flux",
            "engine/src/transport/lights.rs::spot_flux_and_falloff",
            "engine/src/transport/lights.rs::a_triangle_seen_by_its_density_has_its_solid_angle",
            "engine/src/transport/bsdf/tests.rs::reflection_is_reciprocal_and_transmission_up_to_eta_squared",
            "tests/tests/paths/path_tracer.rs::point_spot_and_directional_lights_follow_their_laws",
            "tests/tests/paths/path_tracer.rs::closed_furnaces_have_the_radiance_of_the_geometric_series",
            "tests/tests/paths/path_tracer.rs::a_light_in_a_lambert_sphere_fills_it_evenly",
            "tests/tests/twins/lights.rs::lights_agree_with_their_twins",
        ],
        experiment: "clerestory agreement --scene cornell-box,cornell-point",
        api: &["clerestory::transport::lights"],
        ..Row::of(file!())
    },
];

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec3;

    /// Trapezium rule over cos θ of the light's intensity.
    fn flux_by_quadrature(cos_inner: f64, cos_outer: f64) -> f64 {
        let n = 200_000;
        (0..n)
            .map(|i| spot_falloff(-1.0 + 2.0 * (f64::from(i) + 0.5) / f64::from(n), cos_inner, cos_outer))
            .sum::<f64>()
            * 2.0
            / f64::from(n)
            * TAU
    }

    #[test]
    fn spot_flux_and_falloff() {
        for (inner, outer) in [(0.0, 0.5), (0.3, 0.31), (0.5, 0.5), (0.0, 0.01), (0.1, 1.5)] {
            let spot = LightKind::Spot {
                position: Vec3::ZERO,
                direction: Vec3::Z,
                intensity: Vec3::ONE,
                inner,
                outer,
            };
            let expected = flux_by_quadrature(f64::from(inner).cos(), f64::from(outer).cos());
            let power = light_power(&spot, 0.0).x;
            assert!(
                (power - expected).abs() < 1e-4 * expected + 1e-7,
                "{inner} {outer}: {power} {expected}"
            );
        }
        let (ci, co) = (0.3f64.cos(), 0.8f64.cos());
        assert_eq!(spot_falloff(1.0, ci, co), 1.0);
        assert_eq!(spot_falloff(co, ci, co), 0.0);
        assert!((spot_falloff(0.5 * (ci + co), ci, co) - 0.25).abs() < 1e-15);
        // A hard cone of half angle 0.5 covers 0.76917 sr.
        assert!((TAU * (1.0 - 0.5f64.cos()) - 0.769_17).abs() < 1e-5);
    }

    #[test]
    fn point_light_irradiance_and_flux() {
        let point = LightKind::Point {
            position: Vec3::ZERO,
            intensity: Vec3::splat(1.0),
        };
        let flux = light_power(&point, 0.0).x;
        // At the foot of the perpendicular: Φ / (4π h²).
        let h = 2.5;
        assert!((1.0 / (h * h) - flux / (4.0 * PI * h * h)).abs() < 1e-15);
        // Over a sphere that does not centre on the light, ∫ I cos / r² dA = Φ, by a product midpoint rule.
        let (n, offset) = (400, DVec3::new(0.3, 0.2, 0.4));
        let mut sum = 0.0;
        for i in 0..n {
            let z = -1.0 + 2.0 * (f64::from(i) + 0.5) / f64::from(n);
            for j in 0..n {
                let phi = TAU * (f64::from(j) + 0.5) / f64::from(n);
                let r = (1.0 - z * z).sqrt();
                let normal = DVec3::new(r * phi.cos(), r * phi.sin(), z);
                let d = normal - offset;
                sum += normal.dot(d) / d.length().powi(3);
            }
        }
        assert!((sum * 4.0 * PI / f64::from(n * n) / flux - 1.0).abs() < 1e-4);
    }

    #[test]
    fn a_triangle_seen_by_its_density_has_its_solid_angle() {
        let (p0, e1, e2) = (
            DVec3::new(-1.0, -0.5, 1.0),
            DVec3::new(2.0, 0.2, 0.3),
            DVec3::new(0.3, 1.7, -0.2),
        );
        let area = 0.5 * e1.cross(e2).length();
        let normal = e1.cross(e2).normalize();
        let n = 300;
        let mut sum = 0.0;
        for i in 0..n * n {
            let u = DVec2::new(f64::from(i % n) + 0.5, f64::from(i / n) + 0.5) / f64::from(n);
            let p = triangle_point(p0, e1, e2, u);
            let d2 = p.length_squared();
            sum += 1.0 / area_to_solid_angle(1.0 / area, d2, normal.dot(p).abs() / d2.sqrt());
        }
        let [a, b, c] = [p0, p0 + e1, p0 + e2].map(DVec3::normalize);
        // Van Oosterom and Strackee (1983).
        let exact = 2.0 * a.dot(b.cross(c)).abs().atan2(1.0 + a.dot(b) + b.dot(c) + c.dot(a));
        assert!((sum / f64::from(n * n) - exact).abs() < 1e-4);
        assert_eq!(area_to_solid_angle(1.0, 1.0, 0.0), 0.0);
    }

    #[test]
    fn heuristics_sum_to_one() {
        for (a, b) in [
            (1.0, 2.0),
            (1e-30, 1e30),
            (1e300, 1e300),
            (0.0, 1.0),
            (f64::INFINITY, 1.0),
        ] {
            for w in [balance_heuristic, power_heuristic] {
                assert!((w(a, b) + w(b, a) - 1.0).abs() < 1e-15, "{a} {b}");
            }
        }
        assert_eq!(power_heuristic(0.0, 0.0), 0.0);
        assert!((power_heuristic(3.0, 1.0) - 0.9).abs() < 1e-15);
    }
}
