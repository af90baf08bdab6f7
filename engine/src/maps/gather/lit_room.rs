//! A room with walls of different radiance and a bright patch on its floor, whose irradiance is known exactly: what gathers are judged by.
//!
//! The irradiance of an even polygon is J. H. Lambert's closed form ("Photometria", 1760) of what is above the horizon of the point.

use std::f64::consts::{PI, TAU};

use glam::{DVec3, UVec2};

use super::{GatherLights, GatherPoint, SolidAngleForm};
use crate::Result;
use crate::maps::impostor::ImpostorImage;
use crate::maps::impostor::room::BoxRoom;
use crate::maps::{MapImage, Parametrization};

/// The room \[-1, 1\]³.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LitRoom {
    /// Radiances of the walls +x, −x, +y, −y, +z and −z.
    pub walls: [f64; 6],
    /// Radiance of the patch on the floor −y.
    pub patch: f64,
    /// Its middle's x and z, and half its width.
    pub patch_at: [f64; 3],
}

impl LitRoom {
    /// With the radiances of the published figures.
    pub const PUBLISHED: Self = Self {
        walls: [1.0, 0.2, 0.8, 0.3, 0.5, 0.1],
        patch: 20.0,
        patch_at: [0.5, 0.3, 0.15],
    };
    /// The same radiance everywhere.
    pub const EVEN: Self = Self {
        walls: [1.0; 6],
        patch: 1.0,
        patch_at: [0.5, 0.3, 0.15],
    };

    /// Places of spheres that were published: the middle, half-way to a wall, near the patch, and a corner.
    pub const PLACES: [DVec3; 4] = [
        DVec3::ZERO,
        DVec3::new(0.5, 0.0, 0.0),
        DVec3::new(0.5, -0.5, 0.3),
        DVec3::new(0.8, -0.8, 0.8),
    ];

    /// Radius of the spheres whose points are lit.
    pub const RADIUS: f64 = 0.15;

    /// Radiance of the wall that is seen in a direction from the middle.
    pub fn radiance(&self, direction: DVec3) -> f64 {
        let point = direction / direction.abs().max_element();
        let axis = point.abs().max_position();
        let [x, z, half] = self.patch_at;
        if axis == 1 && point.y < 0.0 && (point.x - x).abs() < half && (point.z - z).abs() < half {
            return self.patch;
        }
        self.walls[2 * axis + usize::from(point[axis] < 0.0)]
    }

    /// Irradiance of a point in the room about a unit normal, exact.
    pub fn irradiance(&self, point: &GatherPoint) -> f64 {
        let mut sum = 0.0;
        for (i, radiance) in self.walls.into_iter().enumerate() {
            let axis = i / 2;
            let [u, v] = [DVec3::AXES[(axis + 1) % 3], DVec3::AXES[(axis + 2) % 3]];
            let middle = if i % 2 == 0 {
                DVec3::AXES[axis]
            } else {
                -DVec3::AXES[axis]
            };
            sum += radiance * polygon([middle - u - v, middle + u - v, middle + u + v, middle - u + v], point);
        }
        let [x, z, half] = self.patch_at;
        let corner = |sx: f64, sz: f64| DVec3::new(x + sx * half, -1.0, z + sz * half);
        let corners = [
            corner(-1.0, -1.0),
            corner(1.0, -1.0),
            corner(1.0, 1.0),
            corner(-1.0, 1.0),
        ];
        sum + (self.patch - self.walls[3]) * polygon(corners, point)
    }

    /// Radiance of points by the normalised lobe of an exponent about their axes: sums over the directions of `side`² texels of each face of a cube about
    /// each point, of what is seen there. Off by the patch's border, which a texel sees or does not.
    pub fn glossy(&self, points: &[GatherPoint], exponent: f64, side: u32) -> Vec<f64> {
        let (map, size) = (Parametrization::Cube, UVec2::splat(side));
        let directions: Vec<(DVec3, f64)> = map
            .texels(size)
            .filter_map(|texel| Some((map.texel_direction(size, texel)?, map.texel_solid_angle(size, texel))))
            .collect();
        let value = |point: &GatherPoint| {
            let seen = |(direction, solid_angle): &(DVec3, f64)| {
                let cosine = point.axis.dot(*direction);
                if cosine <= 0.0 {
                    return 0.0;
                }
                let hit = point.position + BoxRoom::EMPTY.hit(point.position, *direction) * *direction;
                cosine.powf(exponent) * solid_angle * self.radiance(hit)
            };
            (exponent + 1.0) / TAU * directions.iter().map(seen).sum::<f64>()
        };
        points.iter().map(value).collect()
    }

    /// Points of a sphere at a place of the room, evenly over it.
    pub fn points(place: DVec3, count: u32) -> Vec<GatherPoint> {
        let golden = PI * (3.0 - 5f64.sqrt());
        let point = |i: u32| {
            let z = 1.0 - (2.0 * f64::from(i) + 1.0) / f64::from(count);
            let (s, c) = (golden * f64::from(i)).sin_cos();
            let axis = DVec3::new(c, s, 0.0) * (1.0 - z * z).sqrt() + z * DVec3::Z;
            GatherPoint {
                position: place + Self::RADIUS * axis,
                axis,
            }
        };
        (0..count).map(point).collect()
    }

    /// Mean radiance, over the wall, of what a cube's texel of `width` half widths about a direction shows: of those over the patch's border, by the
    /// part of the texel's square that lies in it.
    fn radiance_of_texel(&self, direction: DVec3, width: f64) -> f64 {
        let point = direction / direction.abs().max_element();
        if point.y > -1.0 {
            return self.radiance(direction);
        }
        let [x, z, half] = self.patch_at;
        let overlap = |at: f64, middle: f64| {
            let low = (at - 0.5 * width).max(middle - half);
            let high = (at + 0.5 * width).min(middle + half);
            (high - low).max(0.0) / width
        };
        let part = overlap(point.x, x) * overlap(point.z, z);
        self.walls[3] + part * (self.patch - self.walls[3])
    }

    /// Radiance and distances of the room in a map of so many texels a side. A cube's texels have the mean over their squares on the walls, so that the patch
    /// has its whole light and no more; other maps' have the radiance of their centres.
    ///
    /// # Errors
    /// As [`MapImage::from_fn`] and [`ImpostorImage::from_fn`].
    pub fn maps(&self, map: Parametrization, side: u32) -> Result<(MapImage, ImpostorImage)> {
        let size = UVec2::splat(side);
        let of = |direction: DVec3| match map {
            Parametrization::Cube => self.radiance_of_texel(direction, 2.0 / f64::from(side)),
            _ => self.radiance(direction),
        };
        let radiance = MapImage::from_fn(map, size, |texel| {
            DVec3::splat(map.texel_direction(size, texel).map_or(0.0, of))
        })?;
        let impostor = ImpostorImage::from_fn(map, size, 1, true, |d| BoxRoom::EMPTY.surfaces(d))?;
        Ok((radiance, impostor))
    }

    /// The lights of the room in a cube of 256 texels a side, `side` lights a side of a face.
    ///
    /// # Errors
    /// As [`GatherLights::new`].
    pub fn lights(&self, side: u32, form: SolidAngleForm) -> Result<GatherLights> {
        let (radiance, impostor) = self.maps(Parametrization::Cube, 256)?;
        GatherLights::new(&radiance, &impostor, side, form)
    }

    /// The same as [`GatherLights::as_printed`].
    ///
    /// # Errors
    /// As [`GatherLights::new`].
    pub fn printed_lights(&self, side: u32, form: SolidAngleForm) -> Result<GatherLights> {
        let (radiance, impostor) = self.maps(Parametrization::Cube, 256)?;
        GatherLights::as_printed(&radiance, &impostor, side, form)
    }
}

/// RMS of the difference over the mean of what is exact, and the change of the mean, both in %.
pub fn relative_errors(found: &[f64], exact: &[f64]) -> [f64; 2] {
    let count = exact.len() as f64;
    let mean = exact.iter().sum::<f64>() / count;
    let squares: f64 = found.iter().zip(exact).map(|(a, b)| (a - b) * (a - b)).sum();
    let bias = found.iter().sum::<f64>() / count / mean - 1.0;
    [100.0 * (squares / count).sqrt() / mean, 100.0 * bias]
}

/// ∫ max(0, n·ω) dω over a convex polygon, whichever way round its corners are.
fn polygon(corners: [DVec3; 4], point: &GatherPoint) -> f64 {
    let n = point.axis;
    let seen = corners.map(|corner| corner - point.position);
    // What is above the horizon.
    let mut above = Vec::with_capacity(6);
    for i in 0..4 {
        let (a, b) = (seen[i], seen[(i + 1) % 4]);
        let (ha, hb) = (n.dot(a), n.dot(b));
        if ha > 0.0 {
            above.push(a);
        }
        if (ha > 0.0) != (hb > 0.0) {
            above.push(a + ha / (ha - hb) * (b - a));
        }
    }
    let mut sum = 0.0;
    for (i, a) in above.iter().enumerate() {
        let b = above[(i + 1) % above.len()];
        let cross = a.cross(b);
        let length = cross.length();
        if length > 0.0 {
            sum += length.atan2(a.dot(b)) * n.dot(cross) / length;
        }
    }
    0.5 * sum.abs()
}
