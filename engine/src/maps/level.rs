//! The level of detail of a look-up: log₂ of the footprint's width in texels, not clamped.
//!
//! Sources: P. Heckbert, "Fundamentals of Texture Mapping and Image Warping", 1989 (the longer of two derivatives); T. Engelhardt, PhD
//! thesis, KIT, 2013, §7.2.2 (the mirrored direction). Differences of coordinates are wrong where a quad of pixels straddles a seam.
//! Three ways that are not:
//!
//! - [`octahedron_level`] and [`octahedron_rectangular_level`] differentiate the map of the direction's own octant, which has no seam: the one
//!   to use where derivatives of the direction are known.
//! - [`octahedron_level_folded`] takes differences twice, of the directions and of those mirrored to z ≥ 0, and the lesser level. It does so
//!   only where the whole quad has z < 0: mirrored, a quad on the equator folds onto itself and would look finer than it is. It repairs the
//!   square layout alone: the edges of the rectangle lie on the equator.
//! - [`Parametrization::cone_level`] needs no neighbours.
//!
//! Twin of `maps/level.glsl`.

use super::Parametrization;
use super::octahedron::{octahedron_derivatives, octahedron_encode, octahedron_rectangular_derivatives};
use glam::{DVec2, DVec3, UVec2};

/// The level of two derivatives in texels.
pub fn level_of_derivatives(across: DVec2, down: DVec2) -> f64 {
    0.5 * across.length_squared().max(down.length_squared()).log2()
}

/// The level in the square layout of n × n texels; `by` are the derivatives of the direction by the pixel's coordinates.
pub fn octahedron_level(d: DVec3, by: [DVec3; 2], n: f64) -> f64 {
    // A map of extent 2.
    let [across, down] = octahedron_derivatives(d, by).map(|v| 0.5 * n * v);
    level_of_derivatives(across, down)
}

/// The level in the rectangular layout of 2n × n texels.
pub fn octahedron_rectangular_level(d: DVec3, by: [DVec3; 2], n: f64) -> f64 {
    let [across, down] = octahedron_rectangular_derivatives(d, by).map(|v| 0.5 * n * v);
    level_of_derivatives(across, down)
}

/// The level in the square layout of n × n texels from the directions of a pixel, its neighbour across and its neighbour below.
pub fn octahedron_level_folded(d: DVec3, across: DVec3, down: DVec3, n: f64) -> f64 {
    let level = |fold: bool| {
        let encode = |v: DVec3| {
            let z = if fold { v.z.abs() } else { v.z };
            0.5 * n * octahedron_encode(v.truncate().extend(z))
        };
        let here = encode(d);
        level_of_derivatives(encode(across) - here, encode(down) - here)
    };
    let plain = level(false);
    if d.z.max(across.z).max(down.z) < 0.0 {
        plain.min(level(true))
    } else {
        plain
    }
}

impl Parametrization {
    /// The level at which a texel is as large as a cone of a solid angle (sr) about a direction; `None` for a direction that the map does
    /// not hold.
    pub fn cone_level(self, size: UVec2, direction: DVec3, solid_angle: f64) -> Option<f64> {
        let at = self.encode(direction)?;
        let texel = self.solid_angle_density(at.uv) / size.as_dvec2().element_product();
        Some(0.5 * (solid_angle / texel).log2())
    }
}
