//! Distances and normals in the texels of a map, on the host: the twin of what [`Impostor`](super::Impostor) holds on the device.

use glam::{DVec3, DVec4, UVec2};

use super::super::packed_direction::{pack_octahedral_nearest, unpack_octahedral};
use super::super::{Parametrization, Texel};
use crate::gpu::shaders::constants::{
    IMPOSTOR_LAYERS_MAX, IMPOSTOR_NOTHING, IMPOSTOR_NOTHING_INVERSE, IMPOSTOR_PLANE_BOUND, PACKED_NORMAL_BITS,
};
use crate::{Error, Result};

/// A surface that is seen in a direction from the map's place.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ImpostorSurface {
    /// Distance from the map's place, at least [`ImpostorImage::LEAST`].
    pub distance: f64,
    /// Normal of any length, to either side.
    pub normal: DVec3,
}

/// Distances from the map's place to what lies in the direction of each texel's centre, in one layer or in several, the next surface behind
/// those of the last layer in each; and, where they are wanted, the normals there.
///
/// Distances are f32 and never averaged: a look-up takes the texel that holds the direction. With normals it takes the distance to the plane
/// through the texel's point, which is exact on planes and off by the square of the texel's width on curved surfaces; without, a texel's
/// distance holds for all of it. [`NOTHING`](Self::NOTHING) stands where there is no surface, so that no look-up is infinite.
#[derive(Debug, Clone, PartialEq)]
pub struct ImpostorImage {
    map: Parametrization,
    size: UVec2,
    layers: u32,
    distances: Vec<f32>,
    normals: Option<Vec<u32>>,
    nearest: f32,
    farthest: f32,
}

/// Refuses maps that impostors do not have, and numbers of layers.
pub(super) fn check(map: Parametrization, size: UVec2, layers: u32) -> Result<()> {
    if !ImpostorImage::has_texels(map) {
        let cause = "has no impostors; the cube, octahedra with c = 1, and maps of one rectangle have";
        return Err(Error::setting("map", map, cause));
    }
    map.check_size(size)?;
    if !(1..=IMPOSTOR_LAYERS_MAX).contains(&layers) {
        let cause = format!("is not in 1..={IMPOSTOR_LAYERS_MAX}");
        return Err(Error::setting("impostor layers", layers, cause));
    }
    Ok(())
}

/// A texel's plane, of the points y with m·y = 1, where m is the first three numbers; the fourth is one over the distance at the texel's centre, which is given and
/// lies in the unit direction `c`. Of a normal of any length, to either side; a plane that is seen from aside, along it, is none: m is 0.
pub fn impostor_plane(inverse: f64, n: DVec3, c: DVec3) -> DVec4 {
    let at_centre = n.dot(c);
    let m = if at_centre == 0.0 {
        DVec3::ZERO
    } else {
        (inverse / at_centre) * n
    };
    m.extend(inverse)
}

/// The length `size` of l over the distance of a texel's plane in the direction of l: below 1 in front of it. No more than a bound from that over the distance at
/// the texel's centre, since a plane seen from aside has any distance within a texel; where the plane does not lie that way, just that.
pub fn impostor_plane_ratio(plane: DVec4, l: DVec3, size: f64) -> f64 {
    let at_centre = plane.w * size;
    let along = plane.truncate().dot(l);
    if along > 0.0 {
        let bound = f64::from(IMPOSTOR_PLANE_BOUND);
        along.clamp(at_centre / bound, at_centre * bound)
    } else {
        at_centre
    }
}

impl ImpostorImage {
    /// The distance that stands where there is no surface, in the unit of lengths: finite, so that ratios of it are.
    pub const NOTHING: f32 = IMPOSTOR_NOTHING;
    /// The least distance of a surface: ratios to it are finite too.
    pub const LEAST: f32 = 1e-16;

    /// Whether a map can be one: those whose texels all hold directions, but for perspective octahedra.
    pub(super) fn has_texels(map: Parametrization) -> bool {
        matches!(
            map,
            Parametrization::Cube
                | Parametrization::OctahedronQuadratic
                | Parametrization::OctahedronRectangular
                | Parametrization::EqualArea
                | Parametrization::LatLong
        )
    }

    /// An impostor of its texels: layer of surfaces by layer, each layer by layer of the map, row by row.
    ///
    /// # Errors
    /// [`Error::Setting`] for maps of discs and perspective octahedra, sizes that the map cannot have, no layers or more than eight, numbers of
    /// texels that do not fit, distances that are below [`LEAST`](Self::LEAST) or not finite or lie before those of the last layer, and normals without direction.
    pub fn new(
        map: Parametrization,
        size: UVec2,
        layers: u32,
        distances: Vec<f32>,
        normals: Option<&[DVec3]>,
    ) -> Result<Self> {
        check(map, size, layers)?;
        let of_layer = (size.element_product() * map.layers()) as usize;
        let wanted = of_layer * layers as usize;
        for (name, count) in [
            ("impostor distances", Some(distances.len())),
            ("impostor normals", normals.map(<[_]>::len)),
        ] {
            if let Some(count) = count.filter(|count| *count != wanted) {
                return Err(Error::setting(name, count, format!("are not {wanted}")));
            }
        }
        let wrong = |i: usize, what: &str, value: String, cause: &str| {
            Error::setting(format!("impostor {what} of texel {i}"), value, cause)
        };
        for (i, distance) in distances.iter().enumerate() {
            if !(*distance >= Self::LEAST && distance.is_finite()) {
                let cause = format!("is below {:e}, or not finite", Self::LEAST);
                return Err(wrong(i, "distance", distance.to_string(), &cause));
            }
            if i >= of_layer && *distance < distances[i - of_layer] {
                return Err(wrong(
                    i,
                    "distance",
                    distance.to_string(),
                    "lies before that of the last layer",
                ));
            }
        }
        let pack = |normals: &[DVec3]| -> Result<Vec<u32>> {
            let of = |(i, normal): (usize, &DVec3)| match normal.try_normalize() {
                Some(n) => Ok(pack_octahedral_nearest(n, PACKED_NORMAL_BITS)),
                None => Err(wrong(i, "normal", normal.to_string(), "has no direction")),
            };
            normals.iter().enumerate().map(of).collect()
        };
        let normals = normals.map(pack).transpose()?;
        let found = distances.iter().copied().filter(|distance| *distance < Self::NOTHING);
        let (nearest, farthest) = found.fold((Self::NOTHING, 0.0), |(low, high): (f32, f32), distance| {
            (low.min(distance), high.max(distance))
        });
        Ok(Self {
            map,
            size,
            layers,
            distances,
            normals,
            nearest,
            farthest,
        })
    }

    /// An impostor of what lies in each direction, nearest first: with fewer surfaces than layers there is nothing in the others.
    ///
    /// # Errors
    /// As [`ImpostorImage::new`].
    pub fn from_fn(
        map: Parametrization,
        size: UVec2,
        layers: u32,
        with_normals: bool,
        surfaces: impl Fn(DVec3) -> Vec<ImpostorSurface>,
    ) -> Result<Self> {
        check(map, size, layers)?;
        let of_layer = (size.element_product() * map.layers()) as usize;
        let count = of_layer * layers as usize;
        let mut distances = vec![Self::NOTHING; count];
        let mut normals = vec![DVec3::Z; if with_normals { count } else { 0 }];
        for (i, texel) in map.texels(size).enumerate() {
            let Some(direction) = map.texel_direction(size, texel) else {
                continue;
            };
            for (layer, surface) in surfaces(direction).into_iter().take(layers as usize).enumerate() {
                let at = layer * of_layer + i;
                distances[at] = surface.distance as f32;
                if let Some(normal) = normals.get_mut(at) {
                    *normal = surface.normal;
                }
            }
        }
        Self::new(map, size, layers, distances, with_normals.then_some(normals.as_slice()))
    }

    /// Its parametrization, in whose axes directions are.
    pub fn map(&self) -> Parametrization {
        self.map
    }

    /// Texels of a layer of the map.
    pub fn size(&self) -> UVec2 {
        self.size
    }

    /// Layers of surfaces.
    pub fn layers(&self) -> u32 {
        self.layers
    }

    /// Layer of surfaces by layer, each layer by layer of the map, row by row.
    pub fn distances(&self) -> &[f32] {
        &self.distances
    }

    /// Normals in the same order, packed by [`pack_octahedral_nearest`] with 16 bits a coordinate.
    pub fn normals(&self) -> Option<&[u32]> {
        self.normals.as_deref()
    }

    /// Least and greatest distance of a surface; [`NOTHING`](Self::NOTHING) and 0 where there is none.
    pub fn extent(&self) -> [f32; 2] {
        [self.nearest, self.farthest]
    }

    /// Whether some direction may have [`NOTHING`](Self::NOTHING): a texel of some layer, or what its plane comes to within it.
    pub fn is_open(&self) -> bool {
        let farthest = match self.normals {
            Some(_) => Self::NOTHING / IMPOSTOR_PLANE_BOUND,
            None => Self::NOTHING,
        };
        self.distances.iter().any(|distance| *distance >= farthest)
    }

    /// One over the distance of a texel, by its number.
    fn inverse(&self, i: usize) -> f64 {
        let distance = self.distances[i];
        if distance < Self::NOTHING {
            1.0 / f64::from(distance)
        } else {
            f64::from(IMPOSTOR_NOTHING_INVERSE)
        }
    }

    /// Texels as kernels read them without normals: one over the distance.
    pub(super) fn inverses(&self) -> Vec<f32> {
        (0..self.distances.len()).map(|i| self.inverse(i) as f32).collect()
    }

    /// Texels as kernels read them by planes: [`impostor_plane`], without one where there is no surface. `None` without normals.
    pub(super) fn planes(&self) -> Option<Vec<[f32; 4]>> {
        let normals = self.normals.as_ref()?;
        let layers = (0..self.layers).flat_map(|_| self.map.texels(self.size));
        let plane = |(i, texel): (usize, Texel)| {
            let inverse = self.inverse(i);
            let centre = self.map.texel_direction(self.size, texel);
            let plane = match centre.filter(|_| self.distances[i] < Self::NOTHING) {
                Some(centre) => impostor_plane(inverse, unpack_octahedral(normals[i], PACKED_NORMAL_BITS), centre),
                None => DVec3::ZERO.extend(inverse),
            };
            plane.as_vec4().to_array()
        };
        Some(layers.enumerate().map(plane).collect())
    }

    /// Distance to the surface of a layer in a direction of any length but 0; a length over it is what `impostor_look_up` of `maps/impostor_set.glsl` gives.
    pub fn distance(&self, layer: u32, direction: DVec3) -> f64 {
        let nothing = f64::from(Self::NOTHING);
        let Some((at, v)) = self.map.encode(direction).zip(direction.try_normalize()) else {
            return nothing;
        };
        let p = (at.uv * self.size.as_dvec2()).as_uvec2().min(self.size - 1);
        let texel = Texel {
            layer: at.layer,
            x: p.x,
            y: p.y,
        };
        let row = (layer * self.map.layers() + texel.layer) * self.size.y + texel.y;
        let i = (row * self.size.x + texel.x) as usize;
        let Some(distance) = self
            .distances
            .get(i)
            .copied()
            .filter(|distance| *distance < Self::NOTHING)
        else {
            return nothing;
        };
        let plane = self.normals.as_ref().zip(self.map.texel_direction(self.size, texel));
        plane.map_or(f64::from(distance), |(normals, centre)| {
            let n = unpack_octahedral(normals[i], PACKED_NORMAL_BITS);
            1.0 / impostor_plane_ratio(impostor_plane(self.inverse(i), n, centre), v, 1.0)
        })
    }
}
