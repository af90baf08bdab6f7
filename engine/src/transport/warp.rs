//! Warps from the unit square to the domains that a renderer samples, with their densities.
//!
//! Sources: concentric disk of Shirley and Chiu (1997); triangle of Heitz, "A Low-Distortion Map Between Triangle and Square"
//! (2019); linear densities in the stable form of Pharr et al. (2023, 2.3.2). Guarantees: densities integrate to one over their domain
//! (solid angle for directions); directions have unit length. Twin of `transport/warp.glsl`.

pub use crate::scene::normal_map::orthonormal_basis;

use super::choice::BELOW_ONE;
use glam::{DVec2, DVec3};
use std::f64::consts::{FRAC_1_PI, FRAC_PI_4, TAU};

use crate::catalogue::{Bias, Role, Row, sources};

/// Keeps a quotient of zeros zero.
const LINEAR_LEAST: f64 = crate::gpu::shaders::constants::LINEAR_LEAST as f64;

/// Density of [`square_to_sphere`], sr⁻¹.
pub const UNIFORM_SPHERE_PDF: f64 = 0.25 * FRAC_1_PI;
/// Density of [`square_to_hemisphere`], sr⁻¹.
pub const UNIFORM_HEMISPHERE_PDF: f64 = 0.5 * FRAC_1_PI;

/// Point of the unit disk; density 1/π.
pub fn square_to_disk(u: DVec2) -> DVec2 {
    let p = 2.0 * u - 1.0;
    let wide = p.x.abs() > p.y.abs();
    let (r, other) = if wide { (p.x, p.y) } else { (p.y, p.x) };
    let ratio = if r == 0.0 { 0.0 } else { other / r };
    let (sin, cos) = (ratio * FRAC_PI_4).sin_cos();
    r * if wide {
        DVec2::new(cos, sin)
    } else {
        DVec2::new(sin, cos)
    }
}

/// Direction about +z with density cos θ/π.
pub fn square_to_cosine_hemisphere(u: DVec2) -> DVec3 {
    let p = square_to_disk(u);
    p.extend((1.0 - p.length_squared()).max(0.0).sqrt())
}

/// Density of [`square_to_cosine_hemisphere`], sr⁻¹.
pub fn cosine_hemisphere_pdf(cos_theta: f64) -> f64 {
    cos_theta.max(0.0) * FRAC_1_PI
}

/// Direction at height 1 − d and azimuth 2πu.
pub fn direction_below_pole(d: f64, u: f64) -> DVec3 {
    let r = (d * (2.0 - d)).max(0.0).sqrt();
    let (sin, cos) = (TAU * u).sin_cos();
    DVec3::new(r * cos, r * sin, 1.0 - d)
}

/// Uniform direction; density [`UNIFORM_SPHERE_PDF`].
pub fn square_to_sphere(u: DVec2) -> DVec3 {
    direction_below_pole(2.0 * u.x, u.y)
}

/// Uniform direction with z ≥ 0; density [`UNIFORM_HEMISPHERE_PDF`].
pub fn square_to_hemisphere(u: DVec2) -> DVec3 {
    direction_below_pole(u.x, u.y)
}

/// Uniform direction in the cone about +z; `one_minus_cos` = 1 − cos(half angle), which stays exact for thin cones.
pub fn square_to_cone(u: DVec2, one_minus_cos: f64) -> DVec3 {
    direction_below_pole(one_minus_cos * u.x, u.y)
}

/// Density of [`square_to_cone`], sr⁻¹.
pub fn cone_pdf(one_minus_cos: f64) -> f64 {
    1.0 / (TAU * one_minus_cos)
}

/// Barycentric weights (of vertices 0, 1, 2) of a uniform point of a triangle; density 1/area.
pub fn square_to_triangle(u: DVec2) -> DVec3 {
    let low = 0.5 * u.x.min(u.y);
    let (b1, b2) = if u.x < u.y { (low, u.y - low) } else { (u.x - low, low) };
    DVec3::new(1.0 - b1 - b2, b1, b2)
}

/// Number in [0, 1) whose density changes linearly from one end to the other, where it is in proportion to `a` and `b`, not both zero.
pub fn linear_sample(u: f64, a: f64, b: f64) -> f64 {
    let most = a.max(b);
    let (a, b) = (a / most, b / most);
    let root = (a * a + (b * b - a * a) * u).sqrt();
    (u * (a + b) / (a + root).max(LINEAR_LEAST)).min(BELOW_ONE)
}

/// Density of [`linear_sample`] at `x`.
pub fn linear_pdf(x: f64, a: f64, b: f64) -> f64 {
    (a + (b - a) * x) / (0.5 * a + 0.5 * b)
}

/// Rows of the catalogue.
pub(crate) const ROWS: &[Row] = &[Row {
    id: "BG-2",
    name: "Monte Carlo and importance sampling",
    role: Role::PartOf("BG-3"),
    limits: "Sampling follows closed forms and tables; nothing is learned from samples already taken.",
    sources: &[sources::VEACH_1997.at("chapters 2 and 9")],
    shaders: &["shaders/transport/warp.glsl"],
    bias: Some(Bias::Unbiased),
    tests: &[
        "engine/src/transport/warp.rs::directions_follow_their_density",
        "engine/src/transport/bsdf/tests.rs::samples_follow_their_density",
        "engine/src/transport/bsdf/tests.rs::weight_is_value_over_density_and_density_integrates",
        "tests/tests/paths/samplers.rs::warps_keep_areas",
        "tests/tests/paths/samplers.rs::pairs_fill_the_square_evenly",
        "engine/src/transport/warp.rs::disk_and_triangle_are_uniform",
        "engine/src/transport/warp.rs::linear_densities_are_followed",
        "tests/tests/twins/directions.rs::warps_cones_and_bases_agree_with_their_twins",
    ],
    api: &["clerestory::transport::warp"],
    ..Row::of(file!())
}];

#[cfg(test)]
mod tests {
    use super::super::testing::{chi_square_test, random3, sphere_test};
    use super::*;

    #[test]
    fn the_shaders_constants_are_the_rounded_ones() {
        use crate::gpu::shaders::constants;
        assert_eq!(UNIFORM_SPHERE_PDF as f32, constants::UNIFORM_SPHERE_PDF);
        assert_eq!(UNIFORM_HEMISPHERE_PDF as f32, constants::UNIFORM_HEMISPHERE_PDF);
        // Rust's own constants stand for the shaders' in `constants`: here is what the file says.
        let source = include_str!("../../../shaders/pi.glsl");
        for (name, value) in [("PI", std::f64::consts::PI), ("INV_PI", FRAC_1_PI)] {
            let line = source
                .lines()
                .find_map(|line| line.strip_prefix(&format!("const float {name} = ")));
            let written: f32 = line
                .and_then(|rest| rest.strip_suffix(';'))
                .unwrap_or("")
                .parse()
                .unwrap();
            assert_eq!(value as f32, written, "{name}");
        }
    }

    /// Chi-square tests at p = 1e-5 each.
    const SIGNIFICANCE: f64 = 1e-5;

    #[test]
    fn directions_follow_their_density() {
        let narrow = 0.2;
        let upper = |w: DVec3, pdf: f64| if w.z > 0.0 { pdf } else { 0.0 };
        let n = 40_000;
        let tests: [(&str, f64); 4] = [
            (
                "sphere",
                sphere_test(
                    n,
                    1,
                    4,
                    |u| Some(square_to_sphere(u.truncate())),
                    |_| UNIFORM_SPHERE_PDF,
                ),
            ),
            (
                "hemisphere",
                sphere_test(
                    n,
                    2,
                    4,
                    |u| Some(square_to_hemisphere(u.truncate())),
                    |w| upper(w, UNIFORM_HEMISPHERE_PDF),
                ),
            ),
            (
                "cosine",
                sphere_test(
                    n,
                    3,
                    16,
                    |u| Some(square_to_cosine_hemisphere(u.truncate())),
                    |w| cosine_hemisphere_pdf(w.z),
                ),
            ),
            // The rim of the cone lies on the rim of a row of cells.
            (
                "cone",
                sphere_test(
                    n,
                    4,
                    4,
                    |u| Some(square_to_cone(u.truncate(), 0.25)),
                    |w| if w.z > 0.75 { cone_pdf(0.25) } else { 0.0 },
                ),
            ),
        ];
        for (name, p) in tests {
            assert!(p > SIGNIFICANCE, "{name}: {p}");
        }
        let wrong = sphere_test(
            n,
            3,
            16,
            |u| Some(square_to_hemisphere(u.truncate())),
            |w| cosine_hemisphere_pdf(w.z),
        );
        assert!(wrong < SIGNIFICANCE, "the test must be able to fail");
        for i in 0..1000 {
            let w = square_to_cone(random3(i, 5).truncate(), narrow * 1e-9);
            assert!((w.length() - 1.0).abs() < 1e-12 && 1.0 - w.z <= narrow * 1e-9 + 1e-15);
        }
    }

    /// Cells of equal area: rings by sectors of the disk, and the 64 congruent parts of a triangle.
    #[test]
    fn disk_and_triangle_are_uniform() {
        let n = 64_000;
        let (mut disk, mut triangle) = (vec![0.0; 64], vec![0.0; 64]);
        for i in 0..n {
            let u = random3(i, 6).truncate();
            let p = square_to_disk(u);
            let ring = ((p.length_squared() * 8.0) as usize).min(7);
            let sector = ((p.y.atan2(p.x).rem_euclid(TAU) / TAU * 8.0) as usize).min(7);
            disk[ring * 8 + sector] += 1.0;
            let b = square_to_triangle(u);
            assert!(b.min_element() >= 0.0 && (b.element_sum() - 1.0).abs() < 1e-15);
            let (row, column) = ((b.y * 8.0) as usize, (b.z * 8.0) as usize);
            // Small triangles of a row: upright ones first, then the inverted ones.
            let inverted = (b.y * 8.0).fract() + (b.z * 8.0).fract() > 1.0;
            let before: usize = (0..row).map(|r| 15 - 2 * r).sum();
            triangle[before + column + if inverted { 8 - row } else { 0 }] += 1.0;
        }
        let expected = vec![f64::from(n) / 64.0; 64];
        assert!(chi_square_test(&disk, &expected) > SIGNIFICANCE);
        assert!(chi_square_test(&triangle, &expected) > SIGNIFICANCE);
        assert_eq!(square_to_disk(DVec2::splat(0.5)), DVec2::ZERO);
    }

    #[test]
    fn linear_densities_are_followed() {
        let n = 20_000;
        for (k, (a, b)) in [(1.0, 1.0), (0.0, 3.0), (2e200, 1e200), (1e-30, 4e-24)]
            .into_iter()
            .enumerate()
        {
            let mut cells = vec![0.0; 32];
            for i in 0..n {
                let x = linear_sample(random3(i, 8 + k as u32).x, a, b);
                assert!((0.0..1.0).contains(&x));
                cells[(x * 32.0) as usize] += 1.0;
            }
            let expected: Vec<f64> = (0..32)
                .map(|cell| linear_pdf((f64::from(cell) + 0.5) / 32.0, a, b) * f64::from(n) / 32.0)
                .collect();
            assert!(chi_square_test(&cells, &expected) > SIGNIFICANCE, "{a} {b}");
        }
        assert_eq!((linear_sample(0.0, 0.0, 1.0), linear_sample(0.0, 1.0, 0.0)), (0.0, 0.0));
    }

    #[test]
    fn bases_are_orthonormal_everywhere() {
        let poles = [
            DVec3::Z,
            -DVec3::Z,
            DVec3::new(1e-9, 0.0, -1.0),
            DVec3::X,
            -DVec3::Y,
            DVec3::new(1.0, 0.0, -0.0),
        ];
        for n in poles
            .into_iter()
            .chain((0..1000).map(|i| square_to_sphere(random3(i, 7).truncate())))
        {
            let (t, b) = orthonormal_basis(n);
            assert!((t.length() - 1.0).abs() < 1e-14 && (b.length() - 1.0).abs() < 1e-14);
            assert!(t.dot(n).abs() < 1e-14 && (t.cross(b) - n).length() < 1e-14, "{n}");
        }
    }
}
