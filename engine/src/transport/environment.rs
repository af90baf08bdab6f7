//! Latitude–longitude environment maps: directions, texels and densities, in the environment's own frame.
//!
//! u = atan2(x, −z)/2π + ½, v = acos(y)/π, as [`Environment`] says. A texel is chosen by luminance × solid angle and a direction
//! evenly over the texel's solid angle, so that densities stay finite at the poles and a uniform environment is sampled uniformly.
//! Guarantee: wherever the map, read by nearest texel or bilinearly, has luminance, the density is positive. Twin of
//! `transport/environment.glsl`.

use super::distribution::{build_distribution_2d, distribution_probability_2d, distribution_sample_2d};
use crate::catalogue::{Bias, Role, Row, sources};
use crate::scene::Environment;
use crate::{Error, Result};
use glam::{DVec2, DVec3, UVec2};
use std::f64::consts::{FRAC_1_PI, PI, TAU};

/// Luminance of linear sRGB (Rec. 709 primaries).
pub fn luminance(rgb: DVec3) -> f64 {
    rgb.dot(DVec3::new(0.2126, 0.7152, 0.0722))
}

/// Texture coordinates of a unit direction.
pub fn environment_uv(w: DVec3) -> DVec2 {
    DVec2::new(
        w.x.atan2(-w.z) * (0.5 * FRAC_1_PI) + 0.5,
        w.x.hypot(w.z).atan2(w.y) * FRAC_1_PI,
    )
}

/// Unit direction of texture coordinates.
pub fn environment_direction(uv: DVec2) -> DVec3 {
    let (sin_phi, cos_phi) = (TAU * (uv.x - 0.5)).sin_cos();
    let (sin, cos) = (PI * uv.y).sin_cos();
    DVec3::new(sin * sin_phi, cos, -sin * cos_phi)
}

/// Texel that holds texture coordinates.
pub fn environment_texel(uv: DVec2, size: UVec2) -> UVec2 {
    (uv * size.as_dvec2()).as_uvec2().min(size - 1)
}

/// Solid angle of a texel of a row, sr.
pub fn environment_texel_solid_angle(size: UVec2, row: u32) -> f64 {
    let step = PI / f64::from(size.y);
    4.0 * PI / f64::from(size.x) * ((f64::from(row) + 0.5) * step).sin() * (0.5 * step).sin()
}

/// Density of [`environment_sample`] for a direction, sr⁻¹; `base` is where the map's tables begin in `cdf`.
pub fn environment_pdf(cdf: &[f32], base: usize, size: UVec2, w: DVec3) -> f64 {
    let texel = environment_texel(environment_uv(w), size);
    distribution_probability_2d(cdf, base, size, texel) / environment_texel_solid_angle(size, texel.y)
}

/// A direction, its texel and its density: `u_texel` chooses the texel, `u_within` the direction inside it.
pub fn environment_sample(
    cdf: &[f32],
    base: usize,
    size: UVec2,
    u_texel: DVec2,
    u_within: DVec2,
) -> (DVec3, UVec2, f64) {
    let (texel, p) = distribution_sample_2d(cdf, base, size, u_texel);
    let pdf = p / environment_texel_solid_angle(size, texel.y);
    let south = 2 * texel.y >= size.y;
    let row = f64::from(if south { size.y - 1 - texel.y } else { texel.y });
    let half_step = 0.5 * PI / f64::from(size.y);
    let (s0, s1) = ((row * half_step).sin(), ((row + 1.0) * half_step).sin());
    let t = if south { 1.0 - u_within.y } else { u_within.y };
    let d = 2.0 * (s0 * s0 + (s1 * s1 - s0 * s0) * t);
    let r = (d * (2.0 - d)).max(0.0).sqrt();
    let (sin, cos) = (TAU * ((f64::from(texel.x) + u_within.x) / f64::from(size.x) - 0.5)).sin_cos();
    let w = DVec3::new(r * sin, if south { d - 1.0 } else { 1.0 - d }, -r * cos);
    (w, texel, pdf)
}

/// The sampling tables of a map: luminance, integrated over each texel as if interpolated bilinearly, times solid angle.
///
/// Layout: [`build_distribution_2d`]. Errors: a size that does not fit the texels, a radiance that is negative or not finite.
pub fn environment_distribution(environment: &Environment) -> Result<Vec<f32>> {
    let size = UVec2::new(environment.width, environment.height);
    let (width, height) = (size.x as usize, size.y as usize);
    if environment.radiance.is_empty() || environment.radiance.len() != width * height {
        let name = format!("environment {}", environment.name);
        let value = format!("{} texels", environment.radiance.len());
        return Err(Error::setting(name, value, format!("are not {width} × {height}")));
    }
    let texels: Vec<f64> = environment.radiance.iter().map(|c| luminance(c.as_dvec3())).collect();
    // Share of a linear interpolant between texel centres that comes from the texel itself and from each neighbour.
    const NEIGHBOUR: f64 = 0.125;
    let along = |row: usize, x: usize| {
        let at = |x: usize| texels[row * width + x % width];
        (1.0 - 2.0 * NEIGHBOUR) * at(x) + NEIGHBOUR * (at(x + 1) + at(x + width - 1))
    };
    let weights: Vec<f64> = (0..width * height)
        .map(|i| {
            let (x, y) = (i % width, i / width);
            let (above, below) = (y.saturating_sub(1), (y + 1).min(height - 1));
            let mean = (1.0 - 2.0 * NEIGHBOUR) * along(y, x) + NEIGHBOUR * (along(above, x) + along(below, x));
            #[expect(clippy::cast_possible_truncation, reason = "rows are counted in 32 bits")]
            let row = y as u32;
            mean * environment_texel_solid_angle(size, row)
        })
        .collect();
    build_distribution_2d(&format!("environment {}", environment.name), size, &weights)
}

/// Rows of the catalogue.
pub(crate) const ROWS: &[Row] = &[Row {
    id: "CL-ENVIRONMENT",
    name: "environment light with importance sampling",
    role: Role::PartOf("BG-3"),
    limits: "Chooses by luminance and solid angle, blind to what the surface reflects and to what hides the sky.",
    sources: &[sources::PHARR_2016.at("14.2.4")],
    shaders: &["shaders/transport/environment.glsl"],
    bias: Some(Bias::Unbiased),
    tests: &[
        "engine/src/transport/environment.rs::directions_and_coordinates_agree",
        "engine/src/transport/environment.rs::samples_follow_the_density",
        "engine/src/transport/environment.rs::light_is_never_missed_and_bad_maps_are_errors",
        "tests/tests/samplers.rs::environments_are_sampled_by_their_texels_and_evenly_within",
        "tests/tests/path_tracer.rs::environments_light_a_plane_by_their_cosine_integral",
        "tests/tests/preview/technique.rs::the_environment_is_read_back_as_it_was",
        "tests/tests/twins/tables.rs::environments_agree_with_their_twins",
    ],
    experiment: "clerestory agreement --scene box-city-sky",
    api: &["clerestory::transport::environment"],
    ..Row::of(file!())
}];

#[cfg(test)]
mod tests {
    use super::super::testing::{random3, sphere_test};
    use super::super::warp::{UNIFORM_SPHERE_PDF, square_to_sphere};
    use super::*;
    use glam::Vec3;

    fn map(width: u32, height: u32) -> Environment {
        let mut e = Environment::uniform(Vec3::ONE);
        (e.width, e.height) = (width, height);
        e.radiance = (0..width * height).map(|i| random3(i, 4).as_vec3().powf(3.0)).collect();
        e
    }

    #[test]
    fn directions_and_coordinates_agree() {
        for (w, uv) in [
            (-DVec3::Z, DVec2::new(0.5, 0.5)),
            (DVec3::X, DVec2::new(0.75, 0.5)),
            (-DVec3::X, DVec2::new(0.25, 0.5)),
        ] {
            assert!((environment_uv(w) - uv).length() < 1e-15);
        }
        assert_eq!((environment_uv(DVec3::Y).y, environment_uv(-DVec3::Y).y), (0.0, 1.0));
        for i in 0..1000 {
            let w = square_to_sphere(random3(i, 1).truncate());
            assert!((environment_direction(environment_uv(w)) - w).length() < 1e-14);
        }
    }

    #[test]
    fn samples_lie_in_their_texel_with_its_density() {
        for (width, height) in [(1, 1), (2, 1), (5, 3), (16, 8), (7, 64)] {
            let size = UVec2::new(width, height);
            let cdf = environment_distribution(&map(width, height)).unwrap();
            for i in 0..2000 {
                let (u, v) = (random3(i, 2), random3(i, 3));
                let within = v.truncate().clamp(DVec2::splat(1e-6), DVec2::splat(1.0 - 1e-6));
                let (w, texel, pdf) = environment_sample(&cdf, 0, size, u.truncate(), within);
                assert!((w.length() - 1.0).abs() < 1e-12);
                assert_eq!(environment_texel(environment_uv(w), size), texel);
                assert_eq!(environment_pdf(&cdf, 0, size, w), pdf);
            }
            let sphere: f64 = (0..height)
                .map(|row| f64::from(width) * environment_texel_solid_angle(size, row))
                .sum();
            assert!((sphere - 4.0 * PI).abs() < 1e-12);
        }
    }

    /// Chi-square over the sphere, poles included: false alarm 1e-5. The map's texels are whole cells of the test.
    #[test]
    fn samples_follow_the_density() {
        let size = UVec2::new(24, 6);
        let cdf = environment_distribution(&map(24, 6)).unwrap();
        // The test's pole is z: turn y there.
        let turn = |w: DVec3| DVec3::new(-w.z, w.x, w.y);
        let back = |w: DVec3| DVec3::new(w.y, w.z, -w.x);
        let p = sphere_test(
            40_000,
            5,
            64,
            |u| {
                Some(turn(
                    environment_sample(&cdf, 0, size, u.truncate(), DVec2::new(u.z, (u.x * 4096.0).fract())).0,
                ))
            },
            |w| environment_pdf(&cdf, 0, size, back(w)),
        );
        assert!(p > 1e-5, "{p}");
    }

    #[test]
    fn uniform_maps_are_sampled_uniformly() {
        let mut e = map(64, 32);
        e.radiance.fill(Vec3::splat(0.5));
        let cdf = environment_distribution(&e).unwrap();
        for i in 0..1000 {
            let w = square_to_sphere(random3(i, 1).truncate());
            let pdf = environment_pdf(&cdf, 0, UVec2::new(64, 32), w);
            // Rounding moves a quantum or two of the 40,000 of a polar row.
            assert!((pdf / UNIFORM_SPHERE_PDF - 1.0).abs() < 1e-4, "{w}: {pdf}");
        }
    }

    #[test]
    fn light_is_never_missed_and_bad_maps_are_errors() {
        let mut e = map(8, 4);
        e.radiance.fill(Vec3::ZERO);
        e.radiance[8] = Vec3::splat(1e-20);
        let cdf = environment_distribution(&e).unwrap();
        for x in [0, 1, 7] {
            for y in 0..3 {
                assert!(distribution_probability_2d(&cdf, 0, UVec2::new(8, 4), UVec2::new(x, y)) > 0.0);
            }
        }
        assert_eq!(
            distribution_probability_2d(&cdf, 0, UVec2::new(8, 4), UVec2::new(4, 1)),
            0.0
        );
        e.radiance[3] = Vec3::splat(f32::NAN);
        assert!(environment_distribution(&e).is_err());
        e.radiance.pop();
        assert!(environment_distribution(&e).is_err());
    }
}
