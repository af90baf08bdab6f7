//! Spherical summed-area tables: means over boxes of any size of a bordered map, for glossiness that varies from pixel to pixel.
//!
//! Sources: F. Crow, "Summed-Area Tables for Texture Mapping", SIGGRAPH 1984; T. Engelhardt, C. Dachsbacher, "Octahedron Environment
//! Maps", VMV 2008, §5 (the table of an octahedron map with a border as wide as the largest box reaches). Here texels count by their solid
//! angle, the weight being summed as a fourth channel: a box's value is the mean over the directions in it, and constant radiance stays
//! constant. Boxes end between texels: texels are constant each, those cut count by the part inside, so that the mean is continuous in place
//! and size. A box is a square of the map, not a cone.
//!
//! Sums of bright texels hide dim ones: a difference of four sums is off by about as many units in the last place of the largest sum as there
//! are rows. [`SatNumbers`] are the measures against that, with [`SatRange`] what is taken from radiance beforehand:
//!
//! - [`SatNumbers::Float`]: f32 alone; with the mean taken off sums stay small, unless few texels hold the light;
//! - [`SatNumbers::TwoFloat`]: pairs of f32, 2⁻⁴⁴ of the sum an addition;
//! - [`SatNumbers::Fixed`]: 64-bit integers, whose sums and differences are exact; each texel is rounded once, to 2⁻⁶² of the largest sum
//!   that there could be.
//!
//! Bias: exact for piecewise constant texels (twins: [`SatImage::sat_mean`] in f64, [`box_mean`] without a table). GLSL:
//! `maps/spherical_sat.glsl`. Table: four channels of eight bytes per texel of the bordered map.

use super::directional_map::{DirectionalMap, answer};
use super::lat_long::lat_long_pole_density;
use super::{MapImage, Parametrization};
use crate::catalogue::{Role, Row, sources};
use crate::gpu::shaders::constants::{SAT_FIXED, SAT_FLOAT, SAT_TWO_FLOAT};
use crate::gpu::shaders::maps::{sat_columns, sat_look_up, sat_rows};
use crate::gpu::shaders::sets::SphericalSatSet;
use crate::gpu::shaders::types::{SatShape, SatValue};
use crate::gpu::{Buffer, BufferDesc, Category, ComputePipeline, Gpu, Pass, rw_compute_to_compute};
use crate::{Error, Result};
use glam::{DVec2, DVec3, DVec4, IVec2, UVec2, Vec3, Vec4};
use std::f64::consts::PI;

/// What the sums are.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum SatNumbers {
    /// f32.
    Float,
    /// The unevaluated sum of two f32.
    TwoFloat,
    /// 64-bit integers.
    Fixed,
}

impl SatNumbers {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::Float, Self::TwoFloat, Self::Fixed];

    fn constant(self) -> u32 {
        match self {
            Self::Float => SAT_FLOAT,
            Self::TwoFloat => SAT_TWO_FLOAT,
            Self::Fixed => SAT_FIXED,
        }
    }
}

/// What is known of the radiance to be summed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SatRange {
    /// Taken from radiance before it is summed, and added to means.
    pub offset: Vec3,
    /// |radiance − offset| at most, above 0: sums of integers overflow beyond. Texels of integers are no finer than 2⁻¹²⁰, whatever it is.
    pub deviation: f32,
}

impl SatRange {
    /// Of an image: with its mean over the sphere as offset, or with none.
    pub fn of(image: &MapImage, subtract_mean: bool) -> Self {
        let mean = image.integral() / image.map().solid_angle();
        let offset = if subtract_mean { mean.as_vec3() } else { Vec3::ZERO };
        let texels = image.texels().iter();
        Self {
            offset,
            deviation: texels
                .map(|texel| (*texel - offset).abs().max_element())
                .fold(f32::MIN_POSITIVE, f32::max),
        }
    }
}

/// Half the side, over the map's height, of the box about a direction that holds a solid angle (sr) where a map of that many texels is as dense
/// as there, and at the poles of the latitude–longitude map as the row of texels there: finite everywhere.
pub fn sat_half_width(map: Parametrization, size: UVec2, direction: DVec3, solid_angle: f64) -> Option<f64> {
    Some(half_width_at(map, size, map.encode(direction)?.uv, solid_angle))
}

/// Twin of `sat_half_width` of `maps/box_lobe.glsl`: of [`sat_half_width`] at a place in \[0, 1\]².
pub(super) fn half_width_at(map: Parametrization, size: UVec2, uv: DVec2, solid_angle: f64) -> f64 {
    let least = match map {
        Parametrization::LatLong => lat_long_pole_density(size.y.into()),
        _ => 0.0,
    };
    let density = map.solid_angle_density(uv).max(least);
    0.5 * (f64::from(map.aspect()) * solid_angle / density).sqrt()
}

/// Bits of sums of integers, of which one more is the sign.
const FIXED_BITS: f64 = 62.0;
/// Largest scale of integers as a power of two: it and what it multiplies stay within f32.
const MAX_SCALE: f64 = 120.0;
/// Longest line of a table: a line is a loop of some steps per texel, and software drivers end loops after 65,535.
const MAX_LINE: u32 = 4096;

/// A table on the device.
#[derive(Debug)]
pub struct SphericalSat {
    gpu: Gpu,
    numbers: SatNumbers,
    size: UVec2,
    shape: SatShape,
    per_angle: f32,
    constants: super::directional_map::DirectionalConstants,
    shapes: Buffer,
    sums: Buffer,
    rows: ComputePipeline<sat_rows::Kernel>,
    columns: ComputePipeline<sat_columns::Kernel>,
}

impl SphericalSat {
    /// A table for level 0 of a map with its border, not yet filled.
    ///
    /// # Errors
    /// [`Error::Setting`] for a range that is not finite or without extent, or for a map of several layers or of discs; [`Error::LimitExceeded`] for a map with its border wider than 4096
    /// texels or for a table beyond what buffers hold; [`Error::OutOfMemory`].
    pub fn new(gpu: &Gpu, map: &DirectionalMap, numbers: SatNumbers, range: SatRange) -> Result<Self> {
        map.check_one_layer()?;
        let level = map.level(0)?;
        let size = UVec2::from_array(level.size.map(i32::cast_unsigned));
        let tile = size + 2 * map.border();
        if tile.max_element() > MAX_LINE {
            return Err(Error::LimitExceeded {
                name: "summed-area table".into(),
                value: tile.max_element().into(),
                limit_name: "texels of a line",
                limit: MAX_LINE.into(),
            });
        }
        if !range.offset.is_finite() || !range.deviation.is_finite() || range.deviation <= 0.0 {
            return Err(Error::setting(
                "range",
                format!("{range:?}"),
                "is not finite, or has no extent",
            ));
        }
        let per_angle = f64::from(size.element_product()) / (4.0 * PI);
        // The largest sums that there can be.
        let weight = per_angle * map.greatest_solid_angle();
        let count = f64::from(tile.element_product());
        let bits = |largest: f64| (FIXED_BITS - (largest * weight * count).log2()).floor();
        let scale = |largest: f64| bits(largest).min(MAX_SCALE).exp2() as f32;
        let color = scale(range.deviation.into());
        let shape = SatShape {
            size: level.size,
            border: map.border().cast_signed(),
            scale: [color, color, color, scale(1.0)],
            offset: range.offset.to_array(),
        };
        let entries = u64::from((tile + 1).element_product());
        let bytes = entries * size_of::<SatValue>() as u64;
        let constants = map.constants();
        Ok(Self {
            gpu: gpu.clone(),
            numbers,
            size: tile + 1,
            per_angle: per_angle as f32,
            constants,
            shapes: gpu.buffer_with("summed-area table: shape", Category::Light, &[shape])?,
            sums: gpu.buffer(&BufferDesc::storage("summed-area table: sums", bytes, Category::Light))?,
            rows: gpu.compute_pipeline(&sat_rows::Spec {
                directional_kind: constants.kind,
                directional_border: constants.border,
                sat_numbers: numbers.constant(),
            })?,
            columns: gpu.compute_pipeline(&sat_columns::Spec {
                sat_numbers: numbers.constant(),
            })?,
            shape,
        })
    }

    pub(super) fn gpu(&self) -> &Gpu {
        &self.gpu
    }

    pub(super) fn constants(&self) -> super::directional_map::DirectionalConstants {
        self.constants
    }

    /// `SAT_NUMBERS`.
    pub(super) fn numbers(&self) -> u32 {
        self.numbers.constant()
    }

    /// Bytes of its sums.
    pub fn bytes(&self) -> u64 {
        self.sums.bytes()
    }

    /// The set that `maps/spherical_sat.glsl` reads.
    pub fn set(&self) -> SphericalSatSet<'_> {
        SphericalSatSet {
            sat_shapes: self.shapes.view(),
            sat_sums: self.sums.view(),
        }
    }

    /// Records the sums of a map of the shape that the table was made for.
    ///
    /// Barriers: the map's texels, borders included, must have been made visible to [`Access::COMPUTE`](crate::gpu::Access::COMPUTE), and
    /// earlier uses of the table must have ended. After it the table is visible to compute shaders.
    ///
    /// # Errors
    /// [`Error::Setting`] for a map of another shape, and as [`Pass::dispatch`].
    pub fn record(&self, pass: &mut Pass<'_>, map: &DirectionalMap) -> Result<()> {
        if map.level(0)?.size != self.shape.size || map.constants() != self.constants {
            return Err(Error::setting("map", map.map(), "is not of the table's shape"));
        }
        let rows = sat_rows::Push {
            scale: self.shape.scale,
            offset: self.shape.offset,
            per_angle: self.per_angle,
        };
        let set = sat_rows::Set0 { sums: self.sums.view() };
        let groups = [self.rows.groups_for(self.size.y), 1, 1];
        pass.dispatch(&self.rows, &[&set, &map.set()], &rows, groups)?;
        pass.barrier(&[rw_compute_to_compute(&self.sums)]);
        let columns = sat_columns::Push {
            size: self.size.to_array(),
        };
        let set = sat_columns::Set0 { sums: self.sums.view() };
        let groups = [self.columns.groups_for(self.size.x), 1, 1];
        pass.dispatch(&self.columns, &[&set], &columns, groups)?;
        pass.barrier(&[rw_compute_to_compute(&self.sums)]);
        Ok(())
    }

    /// Sums a map, and waits.
    ///
    /// # Errors
    /// As [`SphericalSat::record`], [`Error::DeviceLost`].
    pub fn fill(&self, map: &DirectionalMap) -> Result<()> {
        let mut recorder = self.gpu.recorder("summed-area table")?;
        recorder.pass("summed-area table", |pass| self.record(pass, map))?;
        recorder.submit()?.wait()?;
        Ok(())
    }

    /// Means over boxes about unit directions (x, y, z of the map's axes), half whose side over the map's height is w, by the device. Boxes
    /// end where the border does.
    ///
    /// # Errors
    /// [`Error::DeviceLost`], [`Error::OutOfMemory`], and as [`Pass::dispatch`].
    pub fn look_up(&self, queries: &[Vec4]) -> Result<Vec<Vec3>> {
        let pipeline = self.gpu.compute_pipeline::<sat_look_up::Kernel>(&sat_look_up::Spec {
            directional_kind: self.constants.kind,
            directional_border: self.constants.border,
            sat_numbers: self.numbers.constant(),
        })?;
        answer(&self.gpu, queries, |pass, queries, values, count| {
            let set = sat_look_up::Set0 {
                queries: queries.view(),
                values: values.view(),
            };
            let groups = [pipeline.groups_for(count), 1, 1];
            pass.dispatch(&pipeline, &[&set, &self.set()], &sat_look_up::Push { count }, groups)
        })
    }
}

/// Twin of [`SphericalSat`] in f64.
#[derive(Debug, Clone)]
pub struct SatImage {
    pub(super) size: UVec2,
    border: u32,
    /// Radiance × solid angle, and solid angle.
    sums: Vec<DVec4>,
}

/// What a bordered map holds beyond its edges, times its solid angle, and that.
fn weighted(image: &MapImage, p: IVec2) -> Option<DVec4> {
    let texel = image.map().wrap(image.size(), 0, p.x, p.y)?;
    let angle = image.map().texel_solid_angle(image.size(), texel);
    Some((angle * image.at(texel).as_dvec3()).extend(angle))
}

/// The box of [`SphericalSat::look_up`], in texels of the bordered map.
fn box_of(size: UVec2, border: u32, uv: DVec2, half_width: f64) -> [DVec2; 2] {
    let tile = (size + 2 * border).as_dvec2();
    let middle = uv * size.as_dvec2() + f64::from(border);
    let reach = half_width * f64::from(size.y);
    [middle - reach, middle + reach].map(|corner| corner.clamp(DVec2::ZERO, tile))
}

impl SatImage {
    /// The table of a map of one layer with a border.
    ///
    /// # Errors
    /// [`Error::Setting`] for a map without texels beyond its edges.
    pub fn new(image: &MapImage, border: u32) -> Result<Self> {
        let size = image.size();
        let tile = size + 2 * border;
        let line = tile.x as usize + 1;
        let mut sums = vec![DVec4::ZERO; line * (tile.y as usize + 1)];
        for y in 0..tile.y {
            let mut row = DVec4::ZERO;
            for x in 0..tile.x {
                let p = UVec2::new(x, y).as_ivec2() - border.cast_signed();
                let held = weighted(image, p);
                row += held.ok_or_else(|| Error::setting("map", image.map(), "has no texels beyond its edges"))?;
                let at = (y as usize + 1) * line + x as usize + 1;
                sums[at] = sums[at - line] + row;
            }
        }
        Ok(Self { size, border, sums })
    }

    /// Twin of `sat_mean`: the mean over a box about a place in \[0, 1\]², half whose side is `half_width` times the map's height.
    pub fn sat_mean(&self, uv: DVec2, half_width: f64) -> DVec3 {
        let tile = self.size + 2 * self.border;
        let [low, high] = box_of(self.size, self.border, uv, half_width);
        // The table between its lines: integrals of constant texels are bilinear.
        let at = |p: DVec2| {
            let corner = p.as_uvec2().min(tile - 1);
            let part = p - corner.as_dvec2();
            let entry = |x: u32, y: u32| {
                let (x, y) = (corner.x + x, corner.y + y);
                self.sums[(y * (tile.x + 1) + x) as usize]
            };
            let upper = entry(0, 0).lerp(entry(1, 0), part.x);
            upper.lerp(entry(0, 1).lerp(entry(1, 1), part.x), part.y)
        };
        let sums = at(high) - at(DVec2::new(low.x, high.y)) - at(DVec2::new(high.x, low.y)) + at(low);
        sums.truncate() / sums.w
    }
}

/// The mean of [`SatImage::sat_mean`] by adding up its texels.
pub fn box_mean(image: &MapImage, border: u32, uv: DVec2, half_width: f64) -> DVec3 {
    let [low, high] = box_of(image.size(), border, uv, half_width);
    let (first, last) = (low.floor().as_ivec2(), high.ceil().as_ivec2());
    let mut sums = DVec4::ZERO;
    for y in first.y..last.y {
        for x in first.x..last.x {
            let p = IVec2::new(x, y);
            let inside = high.min(p.as_dvec2() + 1.0) - low.max(p.as_dvec2());
            let held = weighted(image, p - border.cast_signed()).unwrap_or_default();
            sums += inside.element_product() * held;
        }
    }
    sums.truncate() / sums.w
}

/// Rows of the catalogue.
pub(crate) const ROWS: &[Row] = &[Row {
    id: "OEM-6",
    name: "spherical summed-area table: means over boxes, and lobes of several, for continuous glossiness",
    role: Role::Kernel,
    limits: "A box is a square of the map, not a cone, and no larger than the border is wide.",
    sources: &[sources::CROW_1984.whole(), sources::ENGELHARDT_DACHSBACHER_2008.whole()],
    shaders: &[
        "shaders/maps/sat_rows.comp",
        "shaders/maps/sat_columns.comp",
        "shaders/maps/sat_look_up.comp",
    ],
    tests: &[
        "tests/tests/maps/directional_maps.rs::tables_hold_means_of_boxes_under_a_sun",
        "tests/tests/maps/directional_maps.rs::constant_radiance_stays_constant",
        "engine/src/maps/tests/glossy.rs::tables_hold_the_means_of_boxes",
        "engine/src/maps/tests/glossy.rs::boxes_have_no_seams",
        "tests/tests/maps/directional_maps.rs::lobes_are_their_twins",
        "engine/src/maps/tests/box_lobes.rs::borders_hold_the_largest_box",
        "engine/src/maps/tests/box_lobes.rs::lobes_on_folds_and_edges_are_as_good_as_elsewhere",
    ],
    api: &["clerestory::maps::spherical_sat::SphericalSat"],
    settings: &[
        "clerestory::maps::spherical_sat::SatNumbers",
        "clerestory::maps::spherical_sat::SatRange",
    ],
    ..Row::of(file!())
}];
