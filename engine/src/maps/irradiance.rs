//! Irradiance of a surface under a map: radiance times the cosine, over the half space about its normal.
//!
//! Source: J. H. Lambert, "Photometria", 1760 (the cosine); R. Ramamoorthi and P. Hanrahan, "An Efficient Representation for Irradiance
//! Environment Maps", SIGGRAPH 2001 (irradiance as a map over normals).
//!
//! The irradiance of a texel that is wholly above the horizon is its radiance times n · ∫ ω dω, with the integral over the texel's own solid
//! angle, which is found once for all normals. It is summed over a grid of rectangles on the texel, each by its exact solid angle and the
//! direction of its middle: off by a twelfth of their solid angle, relatively, times a half to three halves of their shear
//! (which has no bound at the rims of the sphere map, which cost up to 3·10⁻⁴ of the irradiance, and of Nusselt's, up to 3·10⁻³). Texels on
//! the horizon are taken by a finer grid, weighted by the map's density and scaled to the texel's solid angle. Texels are constant each, as they are stored. Deterministic; sums of f64 in the order of texels. On the device: a map filtered with α = 1 by
//! [`PrefilterGgx`](super::prefilter::PrefilterGgx), times π, where texels have one direction each.

use super::{MapImage, MapPoint, Parametrization, Texel};
use crate::catalogue::{Role, Row, sources};
use crate::{Error, Result};
use glam::{DVec2, DVec3, UVec2};

/// Solid angle of the rectangles of a texel's own grid, sr: directions of middles are then off by a hundred-thousandth of the integral.
const PART: f64 = 1.2e-4;
/// Rectangles along a texel's side, at least and at most.
const GRIDS: [f64; 2] = [2.0, 16.0];
/// The same on the horizon.
const HORIZON_GRID: u32 = 12;

/// A texel that gives light.
#[derive(Debug, Clone, Copy)]
struct Source {
    texel: Texel,
    radiance: DVec3,
    /// ∫ dω and ∫ ω dω.
    angle: f64,
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
            if radiance == DVec3::ZERO {
                return None;
            }
            let sides = (map.texel_solid_angle(size, texel) / PART).sqrt().ceil();
            let grid = sides.clamp(GRIDS[0], GRIDS[1]) as u32;
            let parts: Vec<(DVec3, f64)> = parts(map, size, texel, grid).collect();
            let moment: DVec3 = parts.iter().map(|(d, angle)| *angle * *d).sum();
            let middle = moment.try_normalize()?;
            let farthest = parts.iter().map(|(d, _)| d.distance(middle)).fold(0.0, f64::max);
            // Rectangles are as wide as their middles are apart; twice that is more than half of any, sheared ones included.
            let step = farthest / f64::from(grid - 1);
            Some(Source {
                texel,
                radiance,
                angle: parts.iter().map(|(_, angle)| angle).sum(),
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
                self.on_horizon(source, n)
            };
            source.radiance * cosines
        };
        Some(self.sources.iter().map(of).sum())
    }

    /// ∫ max(0, n·ω) dω of a texel.
    fn on_horizon(&self, source: &Source, n: DVec3) -> f64 {
        let (mut sum, mut whole) = (0.0, 0.0);
        for (layer, uv) in middles(self.size, source.texel, HORIZON_GRID) {
            if let Some(d) = self.map.decode(MapPoint { layer, uv }) {
                let weight = self.map.solid_angle_density(uv);
                sum += weight * n.dot(d).max(0.0);
                whole += weight;
            }
        }
        if whole > 0.0 {
            source.angle * sum / whole
        } else {
            n.dot(source.moment).max(0.0)
        }
    }
}

/// Layer and middles of a grid of rectangles on a texel.
fn middles(size: UVec2, texel: Texel, grid: u32) -> impl Iterator<Item = (u32, DVec2)> {
    let [lower, upper] = texel.bounds(size);
    let step = (upper - lower) / f64::from(grid);
    (0..grid * grid).map(move |i| {
        let at = UVec2::new(i % grid, i / grid).as_dvec2() + 0.5;
        (texel.layer, lower + at * step)
    })
}

/// Directions and solid angles of the rectangles of a grid on a texel.
fn parts(map: Parametrization, size: UVec2, texel: Texel, grid: u32) -> impl Iterator<Item = (DVec3, f64)> {
    let [lower, upper] = texel.bounds(size);
    let half = 0.5 * (upper - lower) / f64::from(grid);
    middles(size, texel, grid).filter_map(move |(layer, uv)| {
        let (lower, upper) = (uv - half, uv + half);
        let angle = map.rectangle_solid_angle(lower, upper);
        // Of rectangles that the rim of a disc cuts and whose middle is outside: their point next to the disc's middle.
        let places = [uv, DVec2::splat(0.5).clamp(lower, upper)];
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

/// Rows of the catalogue.
pub(crate) const ROWS: &[Row] = &[Row {
    id: "CL-IRRADIANCE",
    name: "irradiance under a map, and maps of it over normals",
    role: Role::Kernel,
    limits: "Each texel counts as constant; at the rims of the sphere map and of Nusselt's off by up to 3·10⁻⁴ and 3·10⁻³.",
    sources: &[
        sources::LAMBERT_1760.whole(),
        sources::RAMAMOORTHI_HANRAHAN_2001.whole(),
    ],
    tests: &[
        "engine/src/maps/tests/irradiance.rs::constant_radiance_gives_pi_for_every_normal",
        "engine/src/maps/tests/irradiance.rs::a_sky_that_fades_to_the_horizon_gives_two_thirds_of_pi",
        "engine/src/maps/tests/irradiance.rs::a_sun_of_one_texel_is_lamberts_polygon",
        "engine/src/maps/tests/irradiance.rs::maps_of_irradiance_hold_it_for_every_normal",
        "tests/tests/maps/directional_maps.rs::the_widest_lobe_is_irradiance",
    ],
    api: &[
        "clerestory::maps::irradiance::irradiance_map",
        "clerestory::maps::irradiance::IrradianceSource",
    ],
    ..Row::of(file!())
}];
