//! Irradiance of a surface under a map: radiance times the cosine, over the half space about its normal.
//!
//! Source: J. H. Lambert, "Photometria", 1760 (the cosine); R. Ramamoorthi and P. Hanrahan, "An Efficient Representation for Irradiance
//! Environment Maps", SIGGRAPH 2001 (irradiance as a map over normals).
//!
//! The irradiance of a texel that is wholly above the horizon is its radiance times n · ∫ ω dω, with the integral over the texel's own solid
//! angle, which is found once for all normals. It is summed over a grid of rectangles on the texel, each by its exact solid angle and the
//! direction of its middle: off by the square of their extent over 24, relatively. Texels on the horizon are taken by a finer grid of their own.
//! Texels are constant each, as they are stored. Deterministic; sums of f64 in the order of texels. On the device: a map filtered with α = 1 by
//! [`PrefilterGgx`](super::prefilter::PrefilterGgx), times π, where texels have one direction each.

use super::{MapImage, MapPoint, Parametrization, Texel};
use crate::{Error, Result};
use glam::{DVec2, DVec3, UVec2};

/// Rectangles along a texel's side.
const GRID: u32 = 4;
/// The same on the horizon.
const HORIZON_GRID: u32 = 16;

/// A texel that gives light.
#[derive(Debug, Clone, Copy)]
struct Source {
    texel: Texel,
    radiance: DVec3,
    /// ∫ ω dω.
    moment: DVec3,
    /// Its middle, and the distance to its farthest point at most.
    middle: DVec3,
    radius: f64,
}

/// A map that surfaces are lit by.
#[derive(Debug, Clone)]
pub struct IrradianceSource {
    map: Parametrization,
    size: UVec2,
    sources: Vec<Source>,
}

impl IrradianceSource {
    /// Of an image; black texels cost nothing.
    pub fn new(image: &MapImage) -> Self {
        let (map, size) = (image.map(), image.size());
        let source = |texel: Texel| {
            let radiance = image.at(texel).as_dvec3();
            let parts: Vec<(DVec3, f64)> = parts(map, size, texel, GRID).collect();
            if radiance == DVec3::ZERO || parts.is_empty() {
                return None;
            }
            let moment: DVec3 = parts.iter().map(|(d, angle)| *angle * *d).sum();
            let middle = moment.try_normalize()?;
            let farthest = parts.iter().map(|(d, _)| d.distance(middle)).fold(0.0, f64::max);
            // Rectangles are as wide as their middles are apart; twice that is more than half of any, sheared ones included.
            let step = farthest / f64::from(GRID - 1);
            Some(Source {
                texel,
                radiance,
                moment,
                middle,
                radius: farthest + 2.0 * step,
            })
        };
        Self {
            map,
            size,
            sources: map.texels(size).filter_map(source).collect(),
        }
    }

    /// ∫ L max(0, n·ω) dω for a normal of any length, W·m⁻² where radiance is in W·m⁻²·sr⁻¹; `None` for one without direction.
    pub fn irradiance(&self, normal: DVec3) -> Option<DVec3> {
        let n = normal.try_normalize()?;
        let of = |source: &Source| {
            let height = n.dot(source.middle);
            let cosines = if height >= source.radius {
                n.dot(source.moment)
            } else if height <= -source.radius {
                return DVec3::ZERO;
            } else {
                parts(self.map, self.size, source.texel, HORIZON_GRID)
                    .map(|(d, angle)| angle * n.dot(d).max(0.0))
                    .sum()
            };
            source.radiance * cosines
        };
        Some(self.sources.iter().map(of).sum())
    }
}

/// Middles and solid angles of a grid of rectangles on a texel.
fn parts(map: Parametrization, size: UVec2, texel: Texel, grid: u32) -> impl Iterator<Item = (DVec3, f64)> {
    let [lower, upper] = texel.bounds(size);
    let step = (upper - lower) / f64::from(grid);
    (0..grid * grid).filter_map(move |i| {
        let corner = lower + UVec2::new(i % grid, i / grid).as_dvec2() * step;
        let angle = map.rectangle_solid_angle(corner, corner + step);
        // Rectangles that the rim of a disc cuts: their point next to the disc's middle, where their own is outside.
        let places = [corner + 0.5 * step, DVec2::splat(0.5).clamp(corner, corner + step)];
        let layer = texel.layer;
        let d = places.into_iter().find_map(|uv| map.decode(MapPoint { layer, uv }))?;
        (angle > 0.0).then_some((d, angle))
    })
}

/// The irradiance over all normals: a map of them.
///
/// # Errors
/// [`Error::Setting`] for a size that the map cannot have.
pub fn irradiance_map(image: &MapImage, map: Parametrization, size: UVec2) -> Result<MapImage> {
    map.check_size(size)?;
    let source = IrradianceSource::new(image);
    MapImage::from_fn(map, size, |texel| {
        let normal = map.texel_direction(size, texel);
        normal.and_then(|n| source.irradiance(n)).unwrap_or_default()
    })
}

/// The irradiance for one normal ([`IrradianceSource`] serves many).
///
/// # Errors
/// [`Error::Setting`] for a normal without direction.
pub fn irradiance(image: &MapImage, normal: DVec3) -> Result<DVec3> {
    let found = IrradianceSource::new(image).irradiance(normal);
    found.ok_or_else(|| Error::setting("normal", normal, "has no direction"))
}
