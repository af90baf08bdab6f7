//! Reflective shadow maps: what texels of a light's view span, pyramids of what they reflect, and points that come to texels in proportion to that.
//!
//! Sources: C. Dachsbacher and M. Stamminger, "Reflective Shadow Maps", I3D 2005; P. Clarberg et al., "Wavelet Importance Sampling", SIGGRAPH 2005 (hierarchical warping);
//! A. van Oosterom and J. Strackee, "The Solid Angle of a Plane Triangle", IEEE Transactions on Biomedical Engineering 30(2), 1983; J. Halton, "On the Efficiency
//! of Certain Quasi-Random Sequences of Points", Numerische Mathematik 2, 1960; J. Hammersley, "Monte Carlo Methods for Solving Multivariable Problems", 1960.
//!
//! The solid angle of a texel is that of two triangles of the plane at distance 1, whose triple product is their double area: no digits cancel, however small texels
//! are. Pyramids hold sums, not means, of square maps whose side is a power of two, so that what a texel is chosen with is its share of the whole.
//!
//! Guarantees: sums in a fixed order; texels without anything are never chosen where there are others. Twins of `raster/reflective.glsl`: [`rsm_solid_angle`],
//! [`rsm_radical_inverse`], [`rsm_warp`], [`rsm_disc_place`], [`rsm_disc_weight`]; of the pyramid: [`flux_levels`].

use glam::{DVec2, DVec3, UVec2};

use crate::catalogue::{Role, Row, sources};
use crate::gpu::shaders::raster::rsm_sums;
use crate::gpu::shaders::types::AtlasLevel;
use crate::gpu::{Buffer, BufferDesc, Category, ComputePipeline, Gpu, Pass, PipelineInfo, rw_compute_to_compute};
use crate::{Error, Result};

/// The greatest number below 1 that the device's points have.
const BELOW_ONE: f64 = 1.0 - 1.0 / 16_777_216.0;

/// Pyramids of sums over square maps, one behind the other and level by level.
#[derive(Debug)]
pub struct FluxPyramids {
    levels: Vec<AtlasLevel>,
    maps: u32,
    sums: Buffer,
    pipeline: ComputePipeline<rsm_sums::Kernel>,
}

impl FluxPyramids {
    /// Of so many maps of `side` × `side` texels.
    ///
    /// # Errors
    /// [`Error::Setting`] for no maps or a side that is no power of two; [`Error::LimitExceeded`] for more than a storage buffer holds; [`Error::OutOfMemory`].
    pub fn new(gpu: &Gpu, side: u32, maps: u32) -> Result<Self> {
        if !side.is_power_of_two() || maps == 0 {
            let value = format!("{maps} of side {side}");
            return Err(Error::setting(
                "reflective maps",
                value,
                "are none, or no powers of two",
            ));
        }
        let sides = (0..=side.trailing_zeros()).map(|level| side >> level);
        let (mut levels, mut texels) = (Vec::new(), 0u64);
        for side in sides {
            levels.push((texels, side));
            texels += u64::from(maps) * u64::from(side).pow(2);
        }
        let bytes = texels * size_of::<f32>() as u64;
        gpu.caps().check_storage("flux pyramids", bytes)?;
        let level = |(first, side)| AtlasLevel {
            first: first as u32,
            side,
        };
        Ok(Self {
            levels: levels.into_iter().map(level).collect(),
            maps,
            sums: gpu.buffer(&BufferDesc::storage("flux pyramids", bytes, Category::Light))?,
            pipeline: gpu.compute_pipeline(&())?,
        })
    }

    /// The sums: the maps themselves, one behind the other, then their coarser levels.
    pub fn sums(&self) -> &Buffer {
        &self.sums
    }

    /// The coarsest level: a texel for each map.
    pub fn top(&self) -> AtlasLevel {
        self.levels.last().copied().unwrap_or_default()
    }

    /// Maps that there is room for.
    pub fn maps(&self) -> u32 {
        self.maps
    }

    /// The kernel.
    pub fn pipeline(&self) -> PipelineInfo {
        self.pipeline.info()
    }

    /// Records the coarser levels of the first `maps` maps. These must have been made visible to compute shaders; afterwards all levels are.
    ///
    /// # Errors
    /// As [`Pass::dispatch`].
    pub fn record(&self, pass: &mut Pass<'_>, maps: u32) -> Result<()> {
        let maps = maps.min(self.maps);
        for pair in self.levels.windows(2) {
            let push = rsm_sums::Push {
                fine: pair[0],
                coarse: pair[1],
                maps,
            };
            let set = rsm_sums::Set0 {
                flux_sums: self.sums.view(),
            };
            let groups = self.pipeline.groups_over(maps * push.coarse.side * push.coarse.side);
            pass.dispatch(&self.pipeline, &[&set], &push, groups)?;
            pass.barrier(&[rw_compute_to_compute(&self.sums)]);
        }
        Ok(())
    }
}

/// Solid angle of a triangle on the plane z = 1, sr.
fn triangle_solid_angle(corners: [DVec2; 3]) -> f64 {
    let [ab, ac] = [corners[1] - corners[0], corners[2] - corners[0]];
    let [a, b, c] = corners.map(|corner| corner.extend(1.0));
    let [la, lb, lc] = [a, b, c].map(DVec3::length);
    let denominator = la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb;
    2.0 * (ab.perp_dot(ac).abs() / denominator).atan()
}

/// Solid angle of a rectangle on the plane z = 1, sr, from its lower and upper corner.
pub fn rsm_solid_angle(lower: DVec2, upper: DVec2) -> f64 {
    let (b, d) = (DVec2::new(upper.x, lower.y), DVec2::new(lower.x, upper.y));
    triangle_solid_angle([lower, b, upper]) + triangle_solid_angle([lower, upper, d])
}

/// The digits of an index in a base, behind the point in reverse.
pub fn rsm_radical_inverse(mut index: u32, base: u32) -> f64 {
    let (mut sum, mut scale) = (0.0, 1.0);
    while index > 0 {
        scale /= f64::from(base);
        sum += f64::from(index % base) * scale;
        index /= base;
    }
    sum.min(BELOW_ONE)
}

/// Where in a disc of that radius about the middle a point of the unit square comes: as many in each ring, however narrow.
pub fn rsm_disc_place(point: DVec2, radius: f64) -> DVec2 {
    let angle = std::f64::consts::TAU * point.y;
    radius * point.x * DVec2::new(angle.sin(), angle.cos())
}

/// Area that such a point stands for times the number of points, by its distance from the middle over the radius: the inverse of its density; or `squared`, as published,
/// by the square of the distance over the mean of that.
pub fn rsm_disc_weight(distance: f64, radius: f64, squared: bool) -> f64 {
    let disc = std::f64::consts::PI * radius * radius;
    disc * if squared {
        3.0 * distance * distance
    } else {
        2.0 * distance
    }
}

/// The child of four sums (left and right above, left and right below) that a point of the unit square falls in by their shares, and its place within that child's.
pub fn rsm_warp(children: [f64; 4], point: DVec2) -> (UVec2, DVec2) {
    // A share of nothing is not a number, which no place is below.
    let step = |first: f64, second: f64, place: f64| {
        let share = first / (first + second);
        if place >= share {
            (1, (place - share) / (1.0 - share))
        } else {
            (0, place / share)
        }
    };
    let [a, b, c, d] = children;
    let (row, y) = step(a + b, c + d, point.y);
    let (left, right) = if row == 1 { (c, d) } else { (a, b) };
    let (column, x) = step(left, right, point.x);
    let place = DVec2::new(x, y).clamp(DVec2::ZERO, DVec2::splat(BELOW_ONE));
    (UVec2::new(column, row), place)
}

/// A map of `side` × `side` texels and its coarser levels of sums, down to a single texel; `side` a power of two.
pub fn flux_levels(map: &[f64], side: usize) -> Vec<Vec<f64>> {
    let mut levels = vec![map.to_vec()];
    let mut side = side;
    while side > 1 {
        let fine = &levels[levels.len() - 1];
        let half = side / 2;
        let sums = (0..half * half).map(|place| {
            let (x, y) = (place % half, place / half);
            [[0, 0], [1, 0], [0, 1], [1, 1]]
                .iter()
                .map(|[i, j]| fine[(2 * y + j) * side + 2 * x + i])
                .sum()
        });
        let sums = sums.collect();
        levels.push(sums);
        side = half;
    }
    levels
}

/// The texel of [`flux_levels`] that a point comes to, row by row, and what it was chosen with; `None` where there is nothing.
pub fn warp_through(levels: &[Vec<f64>], point: DVec2) -> Option<(usize, f64)> {
    let total = levels.last()?[0];
    if total.is_nan() || total <= 0.0 {
        return None;
    }
    let (mut at, mut point) = (UVec2::ZERO, point);
    for level in levels.iter().rev().skip(1) {
        let side = level.len().isqrt();
        let child = |i: u32| level[(2 * at.y + i / 2) as usize * side + (2 * at.x + i % 2) as usize];
        let (step, place) = rsm_warp([0, 1, 2, 3].map(child), point);
        (at, point) = (2 * at + step, place);
    }
    let texel = at.y as usize * levels[0].len().isqrt() + at.x as usize;
    Some((texel, levels[0][texel] / total))
}

/// Rows of the catalogue.
pub(crate) const ROWS: &[Row] = &[Row {
    id: "SVO-P9",
    name: "pyramids of what texels reflect, and points of low discrepancy that are warped through them",
    role: Role::PartOf("SVO-P8"),
    limits: "Square maps whose side is a power of two; a level takes about a bit of each coordinate; where what is seen changes within a pixel, the shift that all pixels of a frame share makes as much noise as random points.",
    sources: &[
        sources::CLARBERG_2005.whole(),
        sources::HALTON_1960.whole(),
        sources::HAMMERSLEY_1960.whole(),
        sources::VAN_OOSTEROM_STRACKEE_1983.whole(),
        sources::SUN_2015.at("§4.8"),
    ],
    shaders: &[
        "shaders/raster/reflective.glsl",
        "shaders/raster/rsm_sums.comp",
        "shaders/techniques/instant_radiosity/rsm_lights.comp",
    ],
    tests: &[
        "engine/src/raster/reflective.rs::faces_of_a_cube_are_a_sixth_of_the_sphere",
        "engine/src/raster/reflective.rs::warped_points_are_as_many_as_what_texels_have",
        "engine/src/raster/reflective.rs::even_maps_leave_points_where_they_are",
        "engine/src/raster/reflective.rs::radical_inverses_are_the_digits_in_reverse",
        "tests/tests/instant_radiosity/many_light/reflective.rs::each_light_reflects_as_much",
        "tests/tests/instant_radiosity/many_light/reflective.rs::even_sequences_have_the_same_mean_and_less_noise",
        "tests/tests/instant_radiosity/many_light/reflective.rs::black_maps_give_no_lights",
        "tests/tests/twins/reflective.rs::reflective_maps_agree_with_their_twins",
    ],
    api: &["clerestory::raster::reflective::FluxPyramids"],
    settings: &["rsm_sequence"],
    ..Row::of(file!())
}];

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_chi_square::{chi_square, chi_square_z};
    use crate::test_random::Random;

    /// The 99th percentile of the standard normal distribution.
    const ONE_IN_A_HUNDRED: f64 = 2.326;

    /// The sum over a face of a cube in so many texels.
    fn face(side: u32, extent: impl Fn(DVec2, DVec2) -> f64) -> f64 {
        let corner = |x, y| 2.0 * DVec2::new(f64::from(x), f64::from(y)) / f64::from(side) - 1.0;
        let texels = (0..side).flat_map(|y| (0..side).map(move |x| (x, y)));
        texels.map(|(x, y)| extent(corner(x, y), corner(x + 1, y + 1))).sum()
    }

    #[test]
    fn faces_of_a_cube_are_a_sixth_of_the_sphere() {
        let sixth = 4.0 * std::f64::consts::PI / 6.0;
        for side in [1, 2, 8, 64, 256] {
            let sum = face(side, rsm_solid_angle);
            assert!((sum - sixth).abs() < 1e-12 * f64::from(side), "{side}: {sum}");
        }
        // The usual approximation by the middle is off.
        let middle = |lower: DVec2, upper: DVec2| {
            let distance = (0.5 * (lower + upper)).extend(1.0).length();
            (upper - lower).element_product() / distance.powi(3)
        };
        assert!((face(256, middle) - 2.094_402_9).abs() < 1e-7);
        // The difference of four arc tangents, which cancels.
        let corner = |x: f64, y: f64| (x * y / (1.0 + x * x + y * y).sqrt()).atan();
        let (lower, upper) = (DVec2::new(-0.3, 0.1), DVec2::new(0.9, 0.2));
        let four =
            corner(upper.x, upper.y) - corner(lower.x, upper.y) - corner(upper.x, lower.y) + corner(lower.x, lower.y);
        assert!((rsm_solid_angle(lower, upper) - four).abs() < 1e-15);
    }

    #[test]
    fn radical_inverses_are_the_digits_in_reverse() {
        let of = |base: u32, count: u32| {
            (1..=count)
                .map(move |i| rsm_radical_inverse(i, base))
                .collect::<Vec<_>>()
        };
        assert_eq!(of(2, 8), [0.5, 0.25, 0.75, 0.125, 0.625, 0.375, 0.875, 0.0625]);
        let ninths = of(3, 8).into_iter().map(|x| (9.0 * x).round() as u32);
        assert!(ninths.eq([3, 6, 1, 4, 7, 2, 5, 8]));
        assert!(rsm_radical_inverse(u32::MAX, 2) < 1.0 && rsm_radical_inverse(0, 5) == 0.0);
    }

    #[test]
    fn warped_points_are_as_many_as_what_texels_have() {
        let mut random = Random(71);
        let side = 8;
        // A map with empty texels, rows and quarters, over six decades.
        let map: Vec<f64> = (0..side * side)
            .map(|texel| {
                let is_empty = texel % side == 3 || texel / side < 2 || texel % 5 == 0;
                if is_empty {
                    0.0
                } else {
                    10f64.powf(3.0 * f64::from(random.unit()))
                }
            })
            .collect();
        let levels = flux_levels(&map, side);
        let total: f64 = map.iter().sum();
        assert!((levels[3][0] / total - 1.0).abs() < 1e-12 && levels.len() == 4);
        let count = 1_000_000;
        let mut found = vec![0.0; side * side];
        for _ in 0..count {
            let point = DVec2::new(random.unit().into(), random.unit().into());
            let (texel, probability) = warp_through(&levels, point).expect("a texel");
            assert!((probability - map[texel] / total).abs() < 1e-12);
            found[texel] += 1.0;
        }
        let expected: Vec<f64> = map.iter().map(|flux| flux / total * f64::from(count)).collect();
        // Infinite where a texel was found that has nothing.
        let (statistic, degrees) = chi_square(&found, &expected).expect("enough texels");
        let z = chi_square_z(statistic, degrees);
        assert!(z < ONE_IN_A_HUNDRED, "{statistic} {degrees}");
        assert!(warp_through(&flux_levels(&[0.0; 16], 4), DVec2::splat(0.5)).is_none());
    }

    /// The published weight is right for what is the same everywhere, and off by an eighth and a quarter for what grows and falls along the radius.
    #[test]
    fn discs_are_weighted_by_the_inverse_of_their_density() {
        let (radius, count) = (20.0, 4096);
        let mean = |squared, field: fn(f64) -> f64| {
            let sum: f64 = (0..count)
                .map(|i| {
                    let point = DVec2::new((f64::from(i) + 0.5) / f64::from(count), rsm_radical_inverse(i, 2));
                    let place = rsm_disc_place(point, radius);
                    rsm_disc_weight(point.x, radius, squared) * field(place.length() / radius)
                })
                .sum();
            sum / f64::from(count) / (std::f64::consts::PI * radius * radius)
        };
        for (field, exact, published) in [
            ((|_| 1.0) as fn(f64) -> f64, 1.0, 1.0),
            (|r| r, 2.0 / 3.0, 9.0 / 8.0),
            (|r| 1.0 - r, 1.0 / 3.0, 3.0 / 4.0),
        ] {
            assert!((mean(false, field) / exact - 1.0).abs() < 1e-5);
            assert!((mean(true, field) / exact - published).abs() < 1e-5);
        }
        // In all directions.
        let places = (0..256).map(|i| rsm_disc_place(DVec2::new(1.0, rsm_radical_inverse(i, 2)), 1.0));
        assert!(places.sum::<DVec2>().length() < 1e-9);
    }

    #[test]
    fn even_maps_leave_points_where_they_are() {
        let side = 16;
        let levels = flux_levels(&vec![1.0; side * side], side);
        for number in 0..256 {
            let point = DVec2::new(rsm_radical_inverse(number, 2), rsm_radical_inverse(number, 3));
            let place = (point * side as f64).as_uvec2();
            let expected = place.y as usize * side + place.x as usize;
            assert_eq!(warp_through(&levels, point), Some((expected, 1.0 / 256.0)));
        }
    }
}
