//! Glossy reflections of a map at the pixels of a sphere: by the lobe's own integral, by boxes of a summed-area table and by prefiltered levels.

use clerestory::Result;
use clerestory::film::png::{self, Rgb8};
use clerestory::film::{Picture, ToneMap};
use clerestory::gpu::{Gpu, compute_to_transfer, rw_compute_to_compute};
use clerestory::maps::box_lobe::{Lobe, RING_BOXES, WeightedBox, box_lobe, ring_lobe};
use clerestory::maps::directional_map::DirectionalMap;
use clerestory::maps::prefilter::{PrefilterGgx, ggx_mean, ggx_solid_angle, weighted_texels};
use clerestory::maps::spherical_sat::{SphericalSat, sat_half_width};
use clerestory::maps::{MapImage, Parametrization};
use clerestory::techniques::preview::probe::probe_level;
use glam::{DVec3, UVec2, Vec3, Vec4};
use rayon::prelude::*;
use std::f64::consts::PI;

use super::sphere::Sphere;
use crate::experiments::measures::errors::greatest;
use crate::experiments::table::Cell;

/// The map.
pub const MAP: Parametrization = Parametrization::OctahedronQuadratic;
/// Prefiltered maps: evenly spaced in roughness √α.
pub const LEVELS: u32 = 6;
/// Least texels along a side of one.
const LEAST_FILTERED: u32 = 32;
/// The least width of lobes.
pub const LEAST_ALPHA: f64 = 0.02;
/// Steps of lobes whose boxes are about one middle.
pub const NESTED: [usize; 4] = [1, 2, 4, 8];
/// Steps of lobes of rings.
const RINGS: [usize; 4] = [1, 2, 3, 4];
/// Lobes between the least roughness and the greatest, of which each pixel takes the nearest.
pub const LOBES: usize = 65;

/// A sky with a sun, over ground of squares.
fn environment(d: DVec3) -> DVec3 {
    let sun = DVec3::new(0.8, 0.5, 0.35).normalize();
    let glow = (600.0 * (sun.dot(d) - 1.0)).exp();
    if d.z > 0.0 {
        return DVec3::new(0.25, 0.45, 0.9).lerp(DVec3::splat(0.9), (1.0 - d.z).powi(3))
            + 300.0 * glow * DVec3::new(1.0, 0.9, 0.7);
    }
    let ground = d.truncate() / (0.05 - d.z);
    let cell = (1.5 * ground).floor();
    let square = (cell.x + cell.y).rem_euclid(2.0);
    DVec3::new(0.6, 0.35, 0.15).lerp(DVec3::new(0.1, 0.25, 0.1), square)
}

/// A sky with a sun over ground of squares, in a map of so many rows.
pub fn image(rows: u32) -> Result<MapImage> {
    let size = UVec2::splat(rows);
    MapImage::from_fn(MAP, size, |texel| {
        MAP.texel_direction(size, texel).map_or(DVec3::ZERO, environment)
    })
}

/// An image on the device with a border and levels.
pub fn filled(gpu: &Gpu, image: &MapImage, border: u32) -> Result<DirectionalMap> {
    let map = DirectionalMap::new(gpu, image.map(), image.size(), 1, border)?;
    map.upload(0, image)?;
    map.fill_levels()?;
    Ok(map)
}

/// Widths of the lobes that maps are filtered by.
fn filtered_alphas() -> impl Iterator<Item = f64> {
    (0..LEVELS).map(|level| (f64::from(level) / f64::from(LEVELS - 1)).powi(2).max(LEAST_ALPHA))
}

/// Texels along a side of a filtered map: at most half the lobe's width each, as far as the source has so fine ones.
fn filtered_side(alpha: f64, rows: u32) -> u32 {
    let side = (2.0 * (4.0 * PI).sqrt() / alpha).ceil() as u32;
    side.next_power_of_two().max(LEAST_FILTERED).min(rows)
}

/// Sides and widths of filtered maps in words.
pub fn filtered_sizes(rows: u32) -> String {
    let of = |alpha: f64| format!("{}² for α = {}", filtered_side(alpha, rows), Cell::from(alpha));
    filtered_alphas().map(of).collect::<Vec<_>>().join(", ")
}

/// Maps filtered by lobes of growing width.
pub struct Filtered {
    alphas: Vec<f32>,
    maps: Vec<DirectionalMap>,
}

impl Filtered {
    /// Of a source of so many rows; empty.
    pub fn new(gpu: &Gpu, rows: u32) -> Result<Self> {
        let alphas: Vec<f64> = filtered_alphas().collect();
        let maps = alphas
            .iter()
            .map(|alpha| DirectionalMap::new(gpu, MAP, UVec2::splat(filtered_side(*alpha, rows)), 1, 1));
        Ok(Self {
            maps: maps.collect::<Result<_>>()?,
            alphas: alphas.iter().map(|alpha| *alpha as f32).collect(),
        })
    }

    /// Fills all from the source.
    pub fn fill(&self, gpu: &Gpu, source: &DirectionalMap) -> Result<()> {
        let filter = PrefilterGgx::new(gpu, source)?;
        for (map, alpha) in self.maps.iter().zip(&self.alphas) {
            let mut recorder = gpu.recorder("prefilter")?;
            recorder.pass("prefilter", |pass| {
                filter.record(pass, (source, 0), (map, 0), *alpha)?;
                pass.barrier(&[rw_compute_to_compute(map.texels())]);
                map.record_border(pass, 0)?;
                pass.barrier(&[compute_to_transfer(map.texels())]);
                Ok(())
            })?;
            recorder.submit()?.wait()?;
        }
        Ok(())
    }

    /// Mixtures of the two maps whose lobes are next to each pixel's.
    pub fn look_up(&self, pixels: &[Pixel]) -> Result<Vec<Vec3>> {
        let queries: Vec<Vec4> = pixels
            .iter()
            .map(|pixel| pixel.direction.as_vec3().extend(0.0))
            .collect();
        let held: Vec<Vec<Vec3>> = self
            .maps
            .iter()
            .map(|map| map.look_up(&queries))
            .collect::<Result<_>>()?;
        let last = self.maps.len() - 1;
        let mixed = pixels.iter().enumerate().map(|(at, pixel)| {
            let level = probe_level(&self.alphas, pixel.alpha);
            let fine = (level as usize).min(last);
            held[fine][at].lerp(held[(fine + 1).min(last)][at], level.fract() as f32)
        });
        Ok(mixed.collect())
    }
}

/// A pixel of the sphere: where it looks, and how rough it is.
pub struct Pixel {
    /// Its number by rows.
    pub at: usize,
    /// Where it looks.
    pub direction: DVec3,
    /// How wide its lobe is.
    pub alpha: f64,
}

/// Roughness √α grows from left to right.
pub fn pixels(sphere: &Sphere) -> Vec<Pixel> {
    let all = (0..sphere.side).flat_map(|y| (0..sphere.side).map(move |x| (x, y)));
    all.filter_map(|(x, y)| {
        let p = sphere.place(x, y);
        Some(Pixel {
            at: (y * sphere.side + x) as usize,
            direction: sphere.mirrored(p)?,
            alpha: (0.5 + 0.5 * p.x).powi(2).max(LEAST_ALPHA),
        })
    })
    .collect()
}

/// What pixels see by the lobe's sum over all texels.
pub fn truth(image: &MapImage, pixels: &[Pixel]) -> Vec<Vec3> {
    let texels = weighted_texels(image);
    let of = |pixel: &Pixel| ggx_mean(&texels, pixel.direction, pixel.alpha).as_vec3();
    pixels.par_iter().map(of).collect()
}

/// Pixels as a picture.
pub fn shown(side: u32, pixels: &[Pixel], values: &[Vec3]) -> Result<Rgb8> {
    let mut radiance = vec![1.0; 3 * (side * side) as usize];
    for (pixel, value) in pixels.iter().zip(values) {
        radiance[3 * pixel.at..3 * pixel.at + 3].copy_from_slice(&value.to_array());
    }
    let picture = Picture::from_radiance(side, side, radiance)?;
    Ok(png::tone_mapped(picture.main_layer()?, side, &ToneMap::default()))
}

/// RMS and mean of differences over the mean.
pub fn errors(values: &[Vec3], truth: &[Vec3]) -> [f64; 2] {
    let mean = truth.iter().map(|v| v.as_dvec3()).sum::<DVec3>().element_sum();
    let (mut squares, mut signed) = (0.0, 0.0);
    for (value, right) in values.iter().zip(truth) {
        let off = (*value - *right).as_dvec3();
        squares += off.length_squared();
        signed += off.element_sum();
    }
    let count = 3.0 * truth.len() as f64;
    let mean = mean / count;
    [(squares / count).sqrt() / mean, signed / count / mean]
}

/// The greatest difference of neighbouring pixels of a row.
pub fn greatest_step(pixels: &[Pixel], values: &[Vec3]) -> f64 {
    let all: Vec<(&Pixel, &Vec3)> = pixels.iter().zip(values).collect();
    let steps = all.windows(2).filter(|pair| pair[0].0.at + 1 == pair[1].0.at);
    greatest(steps.map(|pair| f64::from(pair[0].1.distance(*pair[1].1))))
}

/// Look-ups of one box with the variance of each pixel's lobe.
pub fn by_one_box(table: &SphericalSat, source: &MapImage, pixels: &[Pixel]) -> Result<Vec<Vec3>> {
    let query = |pixel: &Pixel| {
        let half =
            sat_half_width(MAP, source.size(), pixel.direction, ggx_solid_angle(pixel.alpha)).unwrap_or_default();
        pixel.direction.as_vec3().extend(half as f32)
    };
    let queries: Vec<Vec4> = pixels.iter().map(query).collect();
    table.look_up(&queries)
}

/// The lobe of a number of all, even in roughness.
fn alpha_of_lobe(number: usize) -> f64 {
    (number as f64 / (LOBES - 1) as f64).powi(2).max(LEAST_ALPHA)
}

/// How a lobe is made of boxes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Fit {
    /// So many about one middle.
    Nested(usize),
    /// So many steps, divided.
    Rings(usize),
}

/// Those that are shown.
pub const SHOWN_NESTED: Fit = Fit::Nested(4);
/// The same in rings.
pub const SHOWN_RINGS: Fit = Fit::Rings(4);

/// All ways.
pub fn fits() -> impl Iterator<Item = Fit> {
    NESTED
        .into_iter()
        .map(Fit::Nested)
        .chain(RINGS.into_iter().map(Fit::Rings))
}

impl Fit {
    /// The boxes of a lobe.
    pub fn boxes(self, lobe: Lobe) -> Result<Vec<WeightedBox>> {
        match self {
            Self::Nested(steps) => box_lobe(lobe, steps),
            Self::Rings(steps) => ring_lobe(lobe, steps),
        }
    }

    /// In tables.
    pub fn name(self) -> String {
        match self {
            Self::Nested(1) => "1 box".into(),
            Self::Nested(steps) => format!("{steps} boxes"),
            Self::Rings(steps) => format!("{} boxes in rings", RING_BOXES[0] + (steps - 1) * RING_BOXES[1]),
        }
    }

    /// The next with fewer boxes of its kind.
    pub fn with_fewer(self) -> Option<Self> {
        let before = |all: &[usize], steps| {
            let at = all.iter().position(|known| *known == steps)?;
            Some(all[at.checked_sub(1)?])
        };
        match self {
            Self::Nested(steps) => before(&NESTED, steps).map(Self::Nested),
            Self::Rings(steps) => before(&RINGS, steps).map(Self::Rings),
        }
    }
}

/// Look-ups of lobes of boxes, each pixel's the nearest of all.
pub fn by_lobes(table: &SphericalSat, pixels: &[Pixel], fit: Fit) -> Result<Vec<Vec3>> {
    let lobes: Vec<Vec<WeightedBox>> = (0..LOBES)
        .map(|number| {
            fit.boxes(Lobe::Ggx {
                alpha: alpha_of_lobe(number),
            })
        })
        .collect::<Result<_>>()?;
    let query = |pixel: &Pixel| {
        let number = (pixel.alpha.sqrt() * (LOBES - 1) as f64).round() as usize;
        (pixel.direction.as_vec3(), number.min(LOBES - 1))
    };
    let queries: Vec<(Vec3, usize)> = pixels.iter().map(query).collect();
    table.look_up_lobes(&queries, &lobes)
}
