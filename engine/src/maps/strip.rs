//! Maps as one picture: layers side by side from left to right in the order of the map, each with its border.

use super::{MapImage, Parametrization, Texel};
use crate::{Error, Result};
use glam::{UVec2, Vec3};

impl Parametrization {
    /// Refuses borders that layers of a size cannot have: of discs, over the poles of a latitude–longitude map of odd width, and wider than the
    /// map.
    ///
    /// # Errors
    /// [`Error::Setting`] with the cause.
    pub fn check_border(self, size: UVec2, border: u32) -> Result<()> {
        let cause = if border > size.min_element() {
            "is wider than the map"
        } else if border > 0 && self.is_disc() {
            "has no texels to repeat: discs have no edges in common"
        } else if border > 0 && self == Self::LatLong && !size.x.is_multiple_of(2) {
            "leads over the pole of a map of odd width"
        } else {
            return Ok(());
        };
        Err(Error::setting("border", border, cause))
    }
}

impl MapImage {
    /// The map as a picture: its extent, and its texels row by row. A border repeats the texels that the map has beyond each edge
    /// ([`Parametrization::wrap`]); beyond the corners of a cube's face, where three faces meet, it is the mean of the two next to it.
    ///
    /// # Errors
    /// As [`Parametrization::check_border`].
    pub fn to_strip(&self, border: u32) -> Result<(UVec2, Vec<Vec3>)> {
        let (map, size) = (self.map(), self.size());
        map.check_border(size, border)?;
        let tile = size + 2 * border;
        let extent = UVec2::new(tile.x * map.layers(), tile.y);
        let mut texels = Vec::with_capacity(extent.x as usize * extent.y as usize);
        for y in 0..extent.y {
            for x in 0..extent.x {
                let at = UVec2::new(x % tile.x, y).as_ivec2() - border as i32;
                let held = self.beyond(x / tile.x, at.x, at.y);
                texels.push(held.ok_or_else(|| Error::setting("border", border, "has no texels to repeat"))?);
            }
        }
        Ok((extent, texels))
    }

    /// The texel at a place inside a layer or beyond its edges.
    fn beyond(&self, layer: u32, x: i32, y: i32) -> Option<Vec3> {
        let (map, size) = (self.map(), self.size());
        let held = |x: i32, y: i32| map.wrap(size, layer, x, y).map(|texel| self.at(texel));
        held(x, y).or_else(|| {
            let last = size.as_ivec2() - 1;
            let sides = (held(x.clamp(0, last.x), y), held(x, y.clamp(0, last.y)));
            (map == Parametrization::Cube)
                .then_some(sides)
                .and_then(|(a, b)| Some(0.5 * (a? + b?)))
        })
    }

    /// Reads a picture as [`MapImage::to_strip`] makes it; what borders hold is dropped.
    ///
    /// # Errors
    /// [`Error::Setting`] for an extent that the map's layers cannot have.
    pub fn from_strip(map: Parametrization, extent: UVec2, border: u32, texels: &[Vec3]) -> Result<Self> {
        let layers = map.layers();
        let across = extent.x / layers;
        let borders = border.saturating_mul(2);
        if !extent.x.is_multiple_of(layers) || across <= borders || extent.y <= borders {
            let value = format!("{} × {}", extent.x, extent.y);
            let cause = format!("does not hold {layers} layers side by side, each with a border of {border}");
            return Err(Error::setting(format!("picture of {map}"), value, cause));
        }
        let size = UVec2::new(across, extent.y) - borders;
        map.check_size(size)?;
        if texels.len() != (extent.x as usize) * (extent.y as usize) {
            let value = format!("{} texels", texels.len());
            return Err(Error::setting(
                format!("picture of {map}"),
                value,
                "are not those of its extent",
            ));
        }
        let at = |texel: Texel| {
            let (x, y) = (texel.layer * across + border + texel.x, border + texel.y);
            texels[y as usize * extent.x as usize + x as usize].as_dvec3()
        };
        Self::from_fn(map, size, at)
    }
}
