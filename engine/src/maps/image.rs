//! Radiance in the texels of a map, on the host: what look-ups, levels and conversions on the device are compared with.
//!
//! Guarantees: as many texels as the map's layers hold, of a shape that its borders allow; integrals by exact solid angles of texels.

use super::{Parametrization, Texel};
use crate::{Error, Result};
use glam::{DMat3, DVec3, UVec2, Vec3};
use rayon::prelude::*;

/// Linear RGB radiance in the texels of a map.
#[derive(Debug, Clone, PartialEq)]
pub struct MapImage {
    map: Parametrization,
    size: UVec2,
    texels: Vec<Vec3>,
}

impl Parametrization {
    /// Refuses sizes of layers that the map cannot have: empty ones, ones that cannot be counted in 31 bits, and, save for the
    /// latitude–longitude map and the octahedron's rectangle, ones that are not square.
    ///
    /// # Errors
    /// [`Error::Setting`] with the cause.
    pub fn check_size(self, size: UVec2) -> Result<()> {
        let texels = u64::from(size.x) * u64::from(size.y) * u64::from(self.layers());
        let cause = if texels == 0 || texels > i32::MAX as u64 {
            "has no texels, or more than 2³¹"
        } else if size.x != size.y && !matches!(self, Self::LatLong | Self::OctahedronRectangular) {
            "is not square"
        } else {
            return Ok(());
        };
        Err(Error::setting(
            format!("size of {self}"),
            format!("{} × {}", size.x, size.y),
            cause,
        ))
    }

    /// Axes of the map in files: takes directions of the world (y up) to those of the map, whose pole is z.
    ///
    /// Poles are the world's up, and azimuth 0 is its +x. The cube keeps the world's axes, as cube images do. The latitude–longitude map is
    /// that of [`crate::scene::Environment`], whose first coordinate grows clockwise as seen from above: its axes are a mirrored frame.
    pub fn world_axes(self) -> DMat3 {
        match self {
            Self::Cube => DMat3::IDENTITY,
            Self::LatLong => DMat3::from_cols(-DVec3::Y, DVec3::Z, DVec3::X),
            _ => DMat3::from_cols(DVec3::X, DVec3::Z, -DVec3::Y),
        }
    }
}

impl MapImage {
    /// A map from its texels: layer by layer, row by row.
    ///
    /// # Errors
    /// [`Error::Setting`] for a size that the map cannot have or that does not fit the texels.
    pub fn new(map: Parametrization, size: UVec2, texels: Vec<Vec3>) -> Result<Self> {
        map.check_size(size)?;
        let wanted = (size.x * size.y * map.layers()) as usize;
        if texels.len() != wanted {
            let value = format!("{} texels", texels.len());
            return Err(Error::setting(format!("map {map}"), value, format!("are not {wanted}")));
        }
        Ok(Self { map, size, texels })
    }

    /// A map by its texels' values, computed by all threads.
    ///
    /// # Errors
    /// As [`MapImage::new`].
    pub fn from_fn(map: Parametrization, size: UVec2, value: impl Fn(Texel) -> DVec3 + Sync) -> Result<Self> {
        map.check_size(size)?;
        let rows = (0..map.layers() * size.y).into_par_iter();
        let texels = rows.flat_map_iter(|row| {
            let value = &value;
            (0..size.x).map(move |x| {
                let texel = Texel {
                    layer: row / size.y,
                    x,
                    y: row % size.y,
                };
                value(texel).as_vec3()
            })
        });
        Self::new(map, size, texels.collect())
    }

    /// Its parametrization.
    pub fn map(&self) -> Parametrization {
        self.map
    }

    /// Texels of a layer.
    pub fn size(&self) -> UVec2 {
        self.size
    }

    /// Layer by layer, row by row.
    pub fn texels(&self) -> &[Vec3] {
        &self.texels
    }

    /// A texel of the map.
    pub fn at(&self, texel: Texel) -> Vec3 {
        self.texels[((texel.layer * self.size.y + texel.y) * self.size.x + texel.x) as usize]
    }

    /// The texel that holds a direction; `None` where the map holds none.
    pub fn nearest(&self, direction: DVec3) -> Option<Vec3> {
        let at = self.map.encode(direction)?;
        let p = (at.uv * self.size.as_dvec2()).as_uvec2().min(self.size - 1);
        Some(self.at(Texel {
            layer: at.layer,
            x: p.x,
            y: p.y,
        }))
    }

    /// Radiance from a direction, bilinear and seamless by [`Parametrization::taps`]; `None` where the map holds none.
    pub fn look_up(&self, direction: DVec3) -> Option<DVec3> {
        let taps = self.map.taps(self.size, direction)?;
        Some(
            taps.iter()
                .filter(|tap| tap.weight > 0.0)
                .map(|tap| tap.weight * self.at(tap.texel).as_dvec3())
                .sum(),
        )
    }

    /// ∫ L dω over all directions that the map holds: sums of f64 in the order of texels.
    pub fn integral(&self) -> DVec3 {
        let values = self.texels.iter().zip(self.map.texels(self.size));
        values
            .map(|(value, texel)| self.map.texel_solid_angle(self.size, texel) * value.as_dvec3())
            .sum()
    }

    /// The next coarser level: each texel the mean of four by solid angle ([`Parametrization::children`]), so that the integral stays.
    ///
    /// # Errors
    /// [`Error::Setting`] when the size is odd.
    pub fn coarser(&self) -> Result<Self> {
        if !(self.size % 2 == UVec2::ZERO) {
            let value = format!("{} × {}", self.size.x, self.size.y);
            return Err(Error::setting("size", value, "cannot be halved"));
        }
        Self::from_fn(self.map, self.size / 2, |texel| {
            let taps = self.map.children(self.size, texel);
            taps.iter().map(|tap| tap.weight * self.at(tap.texel).as_dvec3()).sum()
        })
    }
}
