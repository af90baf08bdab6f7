//! Conversion between maps: each texel becomes the mean radiance over its own solid angle.
//!
//! The area-weighted mean of the source is taken by a regular grid of rectangles on the texel, each weighted by its solid angle (the
//! density at its middle: off by the square of its extent, relatively) and valued by the source at its middle. Guarantees: deterministic;
//! weights of a texel sum to 1, so that constant radiance stays constant to the last bit but one; values stay within those of the source.
//! Under [`Reconstruction::Box`] the source is what its texels are, constant over each, and only rectangles that straddle two of its
//! texels are in error: with s rectangles along the finer of both maps' texels about 2.5/s of the area straddles, so a texel is off by less
//! than 2.5/s of the range of radiance that it touches. What one texel gets too much its neighbour lacks, so the integral errs by far
//! less; it is the caller's to compare ([`MapImage::integral`]).

use super::{MapImage, MapPoint, Parametrization, Texel};
use crate::catalogue::{Role, Row};
use crate::{Error, Result};
use glam::{DMat3, DVec2, DVec3, UVec2};
use rayon::prelude::*;

/// What a map is between the centres of its texels.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Reconstruction {
    /// Constant over each texel: what was stored is what there is.
    #[default]
    Box,
    /// Interpolated bilinearly over all seams: smooth where the target is finer. The integral is that of the interpolant.
    Bilinear,
}

/// How a map is resampled.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ResampleSettings {
    /// Rectangles along the side of the finer map's texels, 1 to 64.
    pub samples: u32,
    /// What the source is between its texels' centres.
    pub reconstruction: Reconstruction,
}

impl Default for ResampleSettings {
    fn default() -> Self {
        Self {
            samples: 4,
            reconstruction: Reconstruction::Box,
        }
    }
}

/// Greatest [`ResampleSettings::samples`].
pub const MAX_SAMPLES: u32 = 64;
/// Texels of a map that are finer than the mean one by more than this, in solid angle, are taken as so fine: those at poles have no bound.
const FINEST: f64 = 1.0 / 64.0;

/// Converts a map. `to_source` takes directions of the target's axes to those of the source: the identity where both are the same, or from
/// [`Parametrization::world_axes`]. Texels without directions are black, and so is what the source does not hold.
///
/// # Errors
/// [`Error::Setting`] for a size that the map cannot have, or for a number of samples out of range.
pub fn resample(
    source: &MapImage,
    to: Parametrization,
    size: UVec2,
    to_source: DMat3,
    settings: &ResampleSettings,
) -> Result<MapImage> {
    let conversion = Conversion::new(source, to, size, to_source, settings)?;
    MapImage::from_fn(to, size, |texel| conversion.texel(texel))
}

/// As [`resample`], telling `go_on` the share that is done before each row of texels and at the end; `None` when it has said no.
///
/// # Errors
/// As [`resample`].
pub fn resample_watched(
    source: &MapImage,
    to: Parametrization,
    size: UVec2,
    to_source: DMat3,
    settings: &ResampleSettings,
    go_on: &mut dyn FnMut(f64) -> bool,
) -> Result<Option<MapImage>> {
    let conversion = Conversion::new(source, to, size, to_source, settings)?;
    let rows = to.layers() * size.y;
    let mut texels = Vec::with_capacity((rows * size.x) as usize);
    for row in 0..rows {
        if !go_on(f64::from(row) / f64::from(rows)) {
            return Ok(None);
        }
        let (layer, y) = (row / size.y, row % size.y);
        let of_row = (0..size.x).into_par_iter();
        texels.par_extend(of_row.map(|x| conversion.texel(Texel { layer, x, y }).as_vec3()));
    }
    go_on(1.0);
    MapImage::new(to, size, texels).map(Some)
}

/// A map on its way to another.
struct Conversion<'a> {
    source: &'a MapImage,
    to: Parametrization,
    size: UVec2,
    to_source: DMat3,
    settings: &'a ResampleSettings,
}

impl<'a> Conversion<'a> {
    fn new(
        source: &'a MapImage,
        to: Parametrization,
        size: UVec2,
        to_source: DMat3,
        settings: &'a ResampleSettings,
    ) -> Result<Self> {
        to.check_size(size)?;
        let samples = settings.samples;
        if !(1..=MAX_SAMPLES).contains(&samples) {
            let cause = format!("is not in 1..={MAX_SAMPLES}");
            return Err(Error::setting("samples", samples, cause));
        }
        Ok(Self {
            source,
            to,
            size,
            to_source,
            settings,
        })
    }

    /// Of the source, in a direction of the target's axes.
    fn value(&self, d: DVec3) -> Option<DVec3> {
        match self.settings.reconstruction {
            Reconstruction::Box => self.source.nearest(self.to_source * d).map(|v| v.as_dvec3()),
            Reconstruction::Bilinear => self.source.look_up(self.to_source * d),
        }
    }

    fn texel(&self, texel: Texel) -> DVec3 {
        let Self { to, size, .. } = *self;
        let steps = steps(self.source, to, size, texel, self.to_source, self.settings.samples);
        let [lower, upper] = texel.bounds(size);
        let step = (upper - lower) / f64::from(steps);
        let (mut sum, mut whole) = (DVec3::ZERO, 0.0);
        for y in 0..steps {
            for x in 0..steps {
                let uv = lower + (UVec2::new(x, y).as_dvec2() + 0.5) * step;
                if let Some(d) = to.decode(MapPoint { layer: texel.layer, uv }) {
                    let weight = to.solid_angle_density(uv);
                    sum += weight * self.value(d).unwrap_or_default();
                    whole += weight;
                }
            }
        }
        if whole > 0.0 {
            return sum / whole;
        }
        // The rim of a disc cuts off less than a rectangle: the texel's point next to the middle.
        let uv = DVec2::splat(0.5).clamp(lower, upper);
        let rim = to.decode(MapPoint { layer: texel.layer, uv });
        rim.and_then(|d| self.value(d)).unwrap_or_default()
    }
}

/// Rectangles along a side of a target's texel: the samples times a power of two, so that maps of which one refines the other meet edge to
/// edge.
fn steps(source: &MapImage, to: Parametrization, size: UVec2, texel: Texel, to_source: DMat3, samples: u32) -> u32 {
    let texels = source.size().as_dvec2().element_product();
    let mean = source.map().solid_angle() / (texels * f64::from(source.map().layers()) * source.map().coverage());
    let [lower, upper] = texel.bounds(size);
    let places = [
        0.5 * (lower + upper),
        lower,
        upper,
        DVec2::new(lower.x, upper.y),
        DVec2::new(upper.x, lower.y),
    ];
    let fine = places
        .into_iter()
        .filter_map(|uv| to.decode(MapPoint { layer: texel.layer, uv }))
        .filter_map(|d| source.map().encode(to_source * d))
        .map(|at| source.map().solid_angle_density(at.uv) / texels)
        .fold(f64::INFINITY, f64::min)
        .clamp(FINEST * mean, mean);
    let ratio = (to.texel_solid_angle(size, texel) / fine).sqrt();
    // A ratio that is a power of two but for rounding and the density's change over a texel.
    const SLACK: f64 = 0.9;
    let doublings = (SLACK * ratio).log2().ceil().max(0.0);
    samples << (doublings as u32).min(16)
}

/// Rows of the catalogue.
pub(crate) const ROWS: &[Row] = &[Row {
    id: "CL-RESAMPLE",
    name: "conversion between maps by solid angle, `clerestory maps`",
    role: Role::Service,
    limits: "A texel is off by less than 2.5/s of the range of radiance that it touches, with s rectangles along the finer map's texels.",
    tests: &[
        "engine/src/maps/tests/conversions.rs::constant_radiance_stays_constant_in_every_map",
        "engine/src/maps/tests/conversions.rs::halves_of_a_map_are_means_of_its_texels",
        "engine/src/maps/tests/conversions.rs::conversions_keep_the_integral",
        "engine/src/maps/tests/conversions.rs::smooth_light_comes_back",
        "engine/src/maps/tests/conversions.rs::conversions_can_be_watched_and_stopped",
        "tools/tests/maps.rs::every_format_leads_to_every_other",
        "tools/tests/maps.rs::a_conversion_that_is_stopped_leaves_the_old_file",
        "tools/tests/maps.rs::directions_are_those_of_environments",
        "tools/tests/maps.rs::scenes_look_the_same_after_a_round_trip",
    ],
    experiment: "clerestory maps sky.hdr sky.exr --to octahedron",
    api: &["clerestory::maps::resample::resample"],
    settings: &[
        "clerestory::maps::resample::ResampleSettings",
        "clerestory maps sky.hdr sky.exr --to octahedron",
    ],
    ..Row::of(file!())
}];
