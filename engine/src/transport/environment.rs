//! Latitude–longitude environment maps: directions, radiance and densities, in the environment's own frame.
//!
//! u = atan2(x, −z)/2π + ½, v = acos(y)/π, as [`Environment`] says. Radiance is bilinear between the centres of texels, around in u;
//! beyond the outer rows the last one reaches to the pole. Light is sampled in proportion to what is looked up: a cell between four centres
//! by luminance × solid angle, by tables, then a direction in it with a density bilinear in the luminances at its corners, by inversion of
//! its linear marginal and conditional distributions. The density is bilinear over azimuth and *height*, over which solid angle is even,
//! where radiance is over azimuth and polar angle: so it needs no factor for the map's distortion, stays finite at the poles, samples a
//! uniform environment uniformly, and is in proportion to luminance but for that bend of the rows, of a factor from ½ to 2 in the row next to a
//! pole and of 1 ± O(1/row) beyond.
//!
//! Scattered rays find light of all directions alike, so that light sampling that is combined with them has the lesser variance where it leaves
//! the mean luminance to them and follows what stands out (Karlík et al. 2019). What alone has to find all light, the emission of photons,
//! has tables of its own. Guarantee: wherever the map has luminance, the density of emission is positive. Twin of
//! `transport/environment.glsl`.

use super::distribution::{build_distribution_2d, distribution_probability_2d, distribution_sample_2d};
use super::random::unit_float;
use super::warp::linear_sample;
use crate::catalogue::{Bias, Role, Row, sources};
use crate::gpu::shaders::constants;
use crate::scene::Environment;
use crate::{Error, Result};
use glam::{DVec2, DVec3, DVec4, UVec2, Vec4};
use std::f64::consts::{FRAC_1_PI, PI, TAU};

/// Least luminance that corners are taken to have, so that densities in a cell are quotients of normal numbers: 2⁻⁸⁰.
pub const ENVIRONMENT_LUMINANCE_MIN: f64 = constants::ENVIRONMENT_LUMINANCE_MIN as f64;

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

/// Solid angle of a texel of a row, sr.
pub fn environment_texel_solid_angle(size: UVec2, row: u32) -> f64 {
    let step = PI / f64::from(size.y);
    4.0 * PI / f64::from(size.x) * ((f64::from(row) + 0.5) * step).sin() * (0.5 * step).sin()
}

/// The cell that holds texture coordinates, and the place in it by angles.
///
/// Cell (x, y) lies between the centres of columns x and x + 1 and of rows y − 1 and y; there is one row of cells more than of texels.
pub fn environment_cell(uv: DVec2, size: UVec2) -> (UVec2, DVec2) {
    let p = uv * size.as_dvec2() + DVec2::new(-0.5, 0.5);
    let last = size.as_ivec2() - glam::IVec2::X;
    let cell = p.floor().as_ivec2().clamp(-glam::IVec2::X, last);
    let within = (p - cell.as_dvec2()).clamp(DVec2::ZERO, DVec2::ONE);
    let x = if cell.x < 0 { last.x } else { cell.x };
    (glam::IVec2::new(x, cell.y).as_uvec2(), within)
}

/// Solid angle of a cell of a row, sr.
pub fn environment_cell_solid_angle(size: UVec2, row: u32) -> f64 {
    let ([first, last], _) = environment_rims(row, size.y);
    2.0 * (last - first) * TAU / f64::from(size.x)
}

/// The rims of a row of cells: halves of their distances 1 − cos from the nearer pole, which keeps its precision there; and whether
/// that is the south pole.
pub fn environment_rims(row: u32, height: u32) -> ([f64; 2], bool) {
    let south = 2 * row > height;
    let from_pole = f64::from(if south { height - row } else { row });
    let rim = |edge: f64| (edge * 0.5 * PI / f64::from(height)).sin().powi(2);
    ([rim((from_pole - 0.5).max(0.0)), rim(from_pole + 0.5)], south)
}

/// Luminance at the left and the right side of a cell.
pub fn environment_sides(luminances: DVec4, down: f64) -> DVec2 {
    luminances
        .truncate()
        .truncate()
        .lerp(DVec2::new(luminances.z, luminances.w), down)
}

/// Radiance inside a cell.
pub fn environment_interpolated(corners: &[DVec4; 4], within: DVec2) -> DVec3 {
    let [a, b, c, d] = corners.map(DVec4::truncate);
    a.lerp(b, within.x).lerp(c.lerp(d, within.x), within.y)
}

/// Luminances at the corners of a cell above `left_out`, what is left to scattered rays; [`ENVIRONMENT_LUMINANCE_MIN`] at least.
pub fn environment_luminances(corners: &[DVec4; 4], left_out: f64) -> DVec4 {
    DVec4::from_array(corners.map(|corner| (luminance(corner.truncate()) - left_out).max(ENVIRONMENT_LUMINANCE_MIN)))
}

/// Least share of the light of a map that is worth sampling; what is above the mean in less is a difference of f32 numbers, whose rounding
/// would show.
const LEAST_SHARE: f64 = 1.0 / 64.0;

/// The cells of a map, row by row.
fn cells(size: UVec2) -> impl Iterator<Item = UVec2> {
    (0..=size.y).flat_map(move |y| (0..size.x).map(move |x| UVec2::new(x, y)))
}

/// A map as light sampling reads it.
#[derive(Debug, Clone, PartialEq)]
pub struct EnvironmentTables {
    /// Of the map, in texels.
    pub size: UVec2,
    /// Luminance that light sampling leaves to scattered rays; that of photons leaves none.
    pub left_out: f32,
    /// How much light sampling has of the map's light, from 0 to 1; where it is 0, no density is positive.
    pub share: f64,
    /// Cumulative probabilities of the cells for light sampling: [`build_distribution_2d`] of one row more than the map has.
    pub cdf: Vec<f32>,
    /// The same for emission, where it differs.
    pub emission_cdf: Option<Vec<f32>>,
    /// By row: radiance with the map's strength, and what the luminances at the corners of cell (x, y) are multiplied by for the density,
    /// sr⁻¹. The last row is there twice, the second time for the cells at the south pole.
    pub texels: Vec<Vec4>,
}

impl EnvironmentTables {
    /// The tables of a map; `compensated` where light sampling leaves the mean luminance to scattered rays.
    ///
    /// Errors: a size that does not fit the texels, a cell whose light is negative or not finite.
    pub fn build(environment: &Environment, compensated: bool) -> Result<Self> {
        let size = UVec2::new(environment.width, environment.height);
        let (width, height) = (size.x as usize, size.y as usize);
        let name = format!("environment {}", environment.name);
        if environment.radiance.is_empty() || environment.radiance.len() != width * height {
            let value = format!("{} texels", environment.radiance.len());
            return Err(Error::setting(name, value, format!("are not {width} × {height}")));
        }
        let last = &environment.radiance[width * (height - 1)..];
        let texels = (environment.radiance.iter().chain(last)).map(|c| (*c * environment.strength).extend(0.0));
        let mut tables = Self {
            size,
            left_out: 0.0,
            share: 1.0,
            cdf: Vec::new(),
            emission_cdf: None,
            texels: texels.collect(),
        };
        let grid = size + UVec2::Y;
        let all = tables.cell_weights();
        tables.cdf = build_distribution_2d(&name, grid, &all)?;
        let total: f64 = all.iter().sum();
        if compensated && total > 0.0 {
            #[expect(clippy::cast_possible_truncation, reason = "the device computes in f32")]
            let left_out = (total / (4.0 * PI)) as f32;
            tables.left_out = left_out;
            let rest = tables.cell_weights();
            let share = rest.iter().sum::<f64>() / total;
            tables.share = if share < LEAST_SHARE { 0.0 } else { share };
            let cdf = build_distribution_2d(&name, grid, &rest)?;
            tables.emission_cdf = Some(std::mem::replace(&mut tables.cdf, cdf));
        }
        if tables.share > 0.0 {
            for (i, cell) in cells(size).enumerate() {
                let luminances = environment_luminances(&tables.environment_corners(cell), tables.left_out.into());
                let solid_angle = environment_cell_solid_angle(size, cell.y);
                let probability = distribution_probability_2d(&tables.cdf, 0, grid, cell);
                #[expect(clippy::cast_possible_truncation, reason = "the device computes in f32")]
                let factor = (probability / (0.25 * luminances.element_sum() * solid_angle)) as f32;
                tables.texels[i].w = factor;
            }
        }
        Ok(tables)
    }

    /// Luminance above what is left to scattered rays, times solid angle.
    fn cell_weights(&self) -> Vec<f64> {
        let above = |corner: DVec4| {
            let above = luminance(corner.truncate()) - f64::from(self.left_out);
            // What is not a number stays so.
            if self.left_out > 0.0 && above < 0.0 { 0.0 } else { above }
        };
        cells(self.size)
            .map(|cell| {
                let sum: f64 = self.environment_corners(cell).into_iter().map(above).sum();
                0.25 * sum * environment_cell_solid_angle(self.size, cell.y)
            })
            .collect()
    }

    /// The texels at the upper corners of a cell, then those at the lower ones, of which the first has the factor of the cell's density.
    pub fn environment_corners(&self, cell: UVec2) -> [DVec4; 4] {
        let next = if cell.x + 1 == self.size.x { 0 } else { cell.x + 1 };
        let at = |x: u32, y: u32| self.texels[y as usize * self.size.x as usize + x as usize].as_dvec4();
        let upper = cell.y.saturating_sub(1);
        [at(cell.x, upper), at(next, upper), at(cell.x, cell.y), at(next, cell.y)]
    }

    /// Radiance from a direction, and in the last component the density of light sampling there, sr⁻¹.
    pub fn environment_look_up(&self, w: DVec3) -> DVec4 {
        let (cell, within) = environment_cell(environment_uv(w), self.size);
        let corners = self.environment_corners(cell);
        let ([first, last], south) = environment_rims(cell.y, self.size.y);
        let rim = 0.5 * (w.x * w.x + w.z * w.z) / (1.0 + if south { -w.y } else { w.y });
        let from_rim = ((rim - first) / (last - first)).clamp(0.0, 1.0);
        let down = if south { 1.0 - from_rim } else { from_rim };
        let sides = environment_sides(environment_luminances(&corners, self.left_out.into()), down);
        let pdf = corners[2].w * (sides.x + (sides.y - sides.x) * within.x);
        environment_interpolated(&corners, within).extend(pdf)
    }

    /// Density of [`environment_sample`](Self::environment_sample) for emission in a direction, sr⁻¹.
    pub fn environment_emission_pdf(&self, w: DVec3) -> f64 {
        let (cell, within) = environment_cell(environment_uv(w), self.size);
        let ([first, last], south) = environment_rims(cell.y, self.size.y);
        let rim = 0.5 * (w.x * w.x + w.z * w.z) / (1.0 + if south { -w.y } else { w.y });
        let from_rim = ((rim - first) / (last - first)).clamp(0.0, 1.0);
        let luminances = environment_luminances(&self.environment_corners(cell), 0.0);
        let sides = environment_sides(luminances, if south { 1.0 - from_rim } else { from_rim });
        let cdf = self.emission_cdf.as_ref().unwrap_or(&self.cdf);
        let probability = distribution_probability_2d(cdf, 0, self.size + UVec2::Y, cell);
        let factor = probability / (0.25 * luminances.element_sum() * environment_cell_solid_angle(self.size, cell.y));
        factor * (sides.x + (sides.y - sides.x) * within.x)
    }

    /// A direction that two words choose, its radiance and density: for light sampling those of [`environment_look_up`](Self::environment_look_up).
    /// `fresh` are two more words, for the bits that the choice of a cell takes.
    pub fn environment_sample(&self, emission: bool, mut word: [u32; 2], fresh: [u32; 2]) -> (DVec3, DVec4) {
        let size = self.size;
        let cdf = self.emission_cdf.as_ref().filter(|_| emission).unwrap_or(&self.cdf);
        let (cell, probability) = distribution_sample_2d(cdf, 0, size + UVec2::Y, &mut word, fresh);
        let corners = self.environment_corners(cell);
        let luminances = environment_luminances(&corners, if emission { 0.0 } else { self.left_out.into() });
        let (upper, lower) = (luminances.x + luminances.y, luminances.z + luminances.w);
        let down = linear_sample(unit_float(word[1]), 0.5 * upper, 0.5 * lower);
        let sides = environment_sides(luminances, down);
        let around = linear_sample(unit_float(word[0]), sides.x, sides.y);
        let ([first, last], south) = environment_rims(cell.y, size.y);
        let d = 2.0 * (first + (last - first) * if south { 1.0 - down } else { down });
        let r = (d * (2.0 - d)).max(0.0).sqrt();
        let y = if south { d - 1.0 } else { 1.0 - d };
        let (sin, cos) = (TAU * ((f64::from(cell.x) + 0.5 + around) / f64::from(size.x) - 0.5)).sin_cos();
        let row = r.atan2(y) * FRAC_1_PI * f64::from(size.y) + 0.5;
        let within = DVec2::new(around, (row - f64::from(cell.y)).clamp(0.0, 1.0));
        let solid_angle = environment_cell_solid_angle(size, cell.y);
        let factor = if emission {
            probability / (0.25 * luminances.element_sum() * solid_angle)
        } else {
            corners[2].w
        };
        let pdf = factor * (sides.x + (sides.y - sides.x) * around);
        let found = environment_interpolated(&corners, within).extend(pdf);
        (DVec3::new(r * sin, y, -r * cos), found)
    }
}

/// Rows of the catalogue.
pub(crate) const ROWS: &[Row] = &[Row {
    id: "CL-ENVIRONMENT",
    name: "environment light with importance sampling",
    role: Role::PartOf("BG-3"),
    limits: "Chooses by luminance and solid angle, blind to what the surface reflects and to what hides the sky.",
    sources: &[
        sources::PHARR_2016.at("14.2.4"),
        sources::PHARR_2023.at("2.4.2 of bilinear densities"),
        sources::KARLIK_2019.whole(),
    ],
    shaders: &["shaders/transport/environment.glsl"],
    bias: Some(Bias::Unbiased),
    tests: &[
        "engine/src/transport/environment.rs::directions_and_coordinates_agree",
        "engine/src/transport/environment.rs::samples_follow_the_density",
        "engine/src/transport/environment.rs::samples_have_the_density_that_is_looked_up",
        "engine/src/transport/environment.rs::density_is_in_proportion_to_luminance",
        "engine/src/transport/environment.rs::light_is_never_missed_and_bad_maps_are_errors",
        "engine/src/transport/environment.rs::uniform_maps_are_sampled_uniformly",
        "engine/src/transport/gpu_scene/lights.rs::small_bright_parts_of_a_sky_are_aimed_at_beside_lamps",
        "tests/tests/paths/samplers.rs::environments_are_sampled_by_what_is_looked_up",
        "tests/tests/paths/path_tracer.rs::environments_light_a_plane_by_their_cosine_integral",
        "tests/tests/preview/technique.rs::the_environment_is_read_back_as_it_was",
        "tests/tests/twins/tables.rs::environments_agree_with_their_twins",
        "tests/tests/twins/tables.rs::choices_and_linear_densities_agree_with_their_twins",
    ],
    experiment: "clerestory agreement --scene box-city-sky",
    api: &["clerestory::transport::environment"],
    ..Row::of(file!())
}];

#[cfg(test)]
mod tests {
    use super::super::random::pcg4d;
    use super::super::testing::{random3, sphere_test};
    use super::super::warp::{UNIFORM_SPHERE_PDF, square_to_sphere};
    use super::*;
    use glam::{UVec4, Vec3};

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

    /// Words of the `i`-th draw: two that choose, two fresh ones.
    fn words(i: u32) -> [[u32; 2]; 2] {
        let [x, y, a, b] = pcg4d(UVec4::new(i, 17, 0xe2f, 0)).to_array();
        [[x, y], [a, b]]
    }

    /// What is sampled has the radiance and density that are looked up, but at the edges of cells, where quanta of probability differ.
    #[test]
    fn samples_have_the_density_that_is_looked_up() {
        for (width, height) in [(1, 1), (2, 1), (5, 3), (16, 8), (7, 64)] {
            let tables = EnvironmentTables::build(&map(width, height), height == 8).unwrap();
            let (mut equal, mut equal_emitted) = (0, 0);
            for i in 0..2000 {
                let [word, fresh] = words(i);
                let (w, found) = tables.environment_sample(false, word, fresh);
                assert!((w.length() - 1.0).abs() < 1e-12);
                if tables.emission_cdf.is_none() {
                    let (same, emitted) = tables.environment_sample(true, word, fresh);
                    assert!(same == w && (emitted.w / found.w - 1.0).abs() < 1e-6);
                }
                let seen = tables.environment_look_up(w);
                let largest = found.truncate().max_element();
                assert!((found - seen).truncate().abs().max_element() <= 1e-9 * largest + 1e-12);
                equal += u32::from((seen.w / found.w - 1.0).abs() < 1e-9);
                let (w, emitted) = tables.environment_sample(true, word, fresh);
                equal_emitted += u32::from((tables.environment_emission_pdf(w) / emitted.w - 1.0).abs() < 1e-9);
            }
            assert!(equal >= 1998, "{width} × {height}: {equal}");
            assert!(equal_emitted >= 1998, "{width} × {height}: {equal_emitted}");
            let sphere: f64 = (0..=height)
                .map(|row| f64::from(width) * environment_cell_solid_angle(UVec2::new(width, height), row))
                .sum();
            assert!((sphere - 4.0 * PI).abs() < 1e-12);
            let texels: f64 = (0..height)
                .map(|row| f64::from(width) * environment_texel_solid_angle(UVec2::new(width, height), row))
                .sum();
            assert!((texels - 4.0 * PI).abs() < 1e-12);
        }
    }

    /// Chi-square over the sphere, poles included: false alarm 1e-5 each.
    #[test]
    fn samples_follow_the_density() {
        // The test's pole is z: turn y there.
        let turn = |w: DVec3| DVec3::new(-w.z, w.x, w.y);
        let back = |w: DVec3| DVec3::new(w.y, w.z, -w.x);
        // As many draws as cells resolve to a few per cent: a density constant in each cell would be seen.
        for (width, height, compensated) in [(1, 3, false), (12, 6, false), (8, 1, false), (12, 6, true)] {
            let tables = EnvironmentTables::build(&map(width, height), compensated).unwrap();
            let next = std::cell::Cell::new(0);
            let sample = |_: DVec3| {
                let [word, fresh] = words(next.replace(next.get() + 1));
                Some(turn(tables.environment_sample(false, word, fresh).0))
            };
            let density = |w: DVec3| tables.environment_look_up(back(w)).w;
            let p = sphere_test(120_000, 5, 16, sample, density);
            assert!(p > 1e-5, "{width} × {height}: {p}");
            next.set(0);
            let wrong = sphere_test(120_000, 5, 16, sample, |w| {
                let (cell, _) = environment_cell(environment_uv(back(w)), tables.size);
                distribution_probability_2d(&tables.cdf, 0, tables.size + UVec2::Y, cell)
                    / environment_cell_solid_angle(tables.size, cell.y)
            });
            assert!(wrong < 1e-5, "the test must be able to fail");
        }
    }

    /// The density is luminance over its integral, but for the bend of rows between polar angle and height.
    #[test]
    fn density_is_in_proportion_to_luminance() {
        let tables = EnvironmentTables::build(&map(64, 32), true).unwrap();
        let n = 40_000;
        let mean = (0..n)
            .map(|i| {
                luminance(
                    tables
                        .environment_look_up(square_to_sphere(random3(i, 6).truncate()))
                        .truncate(),
                )
            })
            .sum::<f64>()
            / f64::from(n);
        let (mut sum, mut squares, mut flat) = (0.0, 0.0, 0.0);
        for i in 0..n {
            let [word, fresh] = words(i);
            let (w, found) = tables.environment_sample(true, word, fresh);
            let ratio = luminance(found.truncate()) / (found.w * 4.0 * PI * mean);
            assert!((0.4..2.5).contains(&ratio), "{ratio}");
            sum += ratio;
            squares += (ratio - 1.0).powi(2);
            let (cell, _) = environment_cell(environment_uv(w), tables.size);
            let mean = 0.25 * environment_luminances(&tables.environment_corners(cell), 0.0).element_sum();
            flat += (luminance(found.truncate()) / mean - 1.0).powi(2);
        }
        assert!((sum / f64::from(n) - 1.0).abs() < 0.02);
        // Far below what a density constant in each cell would leave.
        assert!(squares < 0.02 * flat, "{squares} {flat}");
    }

    #[test]
    fn uniform_maps_are_sampled_uniformly() {
        let mut e = map(64, 32);
        e.radiance.fill(Vec3::splat(0.5));
        let tables = EnvironmentTables::build(&e, false).unwrap();
        let compensated = EnvironmentTables::build(&e, true).unwrap();
        assert_eq!(compensated.share, 0.0);
        for i in 0..1000 {
            let w = square_to_sphere(random3(i, 1).truncate());
            assert_eq!(compensated.environment_look_up(w).w, 0.0);
            let pdf = tables.environment_look_up(w).w;
            // Rounding moves a quantum or two of the 10,000 of a cap's row.
            assert!((pdf / UNIFORM_SPHERE_PDF - 1.0).abs() < 3e-4, "{w}: {pdf}");
        }
    }

    #[test]
    fn light_is_never_missed_and_bad_maps_are_errors() {
        let mut e = map(8, 4);
        e.radiance.fill(Vec3::ZERO);
        e.radiance[8] = Vec3::splat(1e-20);
        for faint in [1e-20, 1e-38] {
            e.radiance[8] = Vec3::splat(faint);
            let tables = EnvironmentTables::build(&e, true).unwrap();
            let cdf = tables.emission_cdf.as_ref().unwrap();
            let probability = |x, y| distribution_probability_2d(cdf, 0, UVec2::new(8, 5), UVec2::new(x, y));
            for (x, y) in [(0, 1), (7, 1), (0, 2), (7, 2)] {
                assert!(probability(x, y) > 0.0);
            }
            assert_eq!(
                (probability(1, 1), probability(0, 0), probability(0, 3)),
                (0.0, 0.0, 0.0)
            );
            for i in 0..100 {
                let [word, fresh] = words(i);
                for emission in [false, true] {
                    let (w, found) = tables.environment_sample(emission, word, fresh);
                    assert!(found.is_finite() && found.w > 0.0, "{w}: {found}");
                }
            }
        }
        e.radiance[3] = Vec3::splat(f32::NAN);
        assert!(EnvironmentTables::build(&e, false).is_err());
        e.radiance.pop();
        assert!(EnvironmentTables::build(&e, false).is_err());
    }
}
