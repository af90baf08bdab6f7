//! Floor 3: directional maps. The sphere of directions on one or more rectangles of texels.
//!
//! A [`Parametrization`] is one of the maps behind a common face: a direction is a layer and coordinates in \[0, 1\]² there. Each has a
//! module of its own with the functions in the map's natural coordinates, whose GLSL twins have the same names. The third axis is the pole
//! of every map. Where to find what:
//!
//! - [`Parametrization`]: encode, decode, density, derivatives, exact solid angles of texels;
//! - [`topology`]: which texel a border texel repeats; [`taps`]: weights of seamless look-ups and of mips; [`level`]: the level of detail;
//! - [`MapImage`]: radiance in the texels of a map; [`resample`]: from one map to another; [`statistics`]: how even a map is;
//! - [`directional_map`]: levels with borders on the device; [`spherical_sat`], [`box_lobe`] and [`prefilter`]: glossy look-ups;
//! - [`to_lat_long`]: a latitude–longitude map of one that was drawn;
//! - [`irradiance`]: what a surface receives;
//! - [`gather`]: the light of a coarse map's texels at other places than its own;
//! - [`impostor`]: maps with distances, and what rays meet by them;
//! - [`packed_direction`]: directions in a word; [`turn`]: the angles that maps take.
//!
//! Guarantees: all is exact up to rounding and deterministic; solid angles of texels are closed forms or spherical polygons, cut at the rims
//! of discs, and sum to that of the sphere.
//!
//! ```
//! use clerestory::maps::Parametrization;
//! use glam::{DVec3, UVec2};
//!
//! let map = Parametrization::OctahedronQuadratic;
//! let place = map.encode(-DVec3::Z).expect("the map holds all directions");
//! assert_eq!(place.uv.to_array(), [1.0, 1.0]);
//! let size = UVec2::new(16, 16);
//! let sum: f64 = map.texels(size).map(|texel| map.texel_solid_angle(size, texel)).sum();
//! assert!((sum - 4.0 * std::f64::consts::PI).abs() < 1e-12);
//! ```

pub mod box_lobe;
pub mod cube;
pub mod directional_map;
mod disc;
pub mod equal_area;
pub mod gather;
pub mod harmonics;
mod image;
pub mod impostor;
pub mod irradiance;
pub mod lat_long;
pub mod level;
mod name;
pub mod nusselt;
pub mod octahedron;
pub mod packed_direction;
pub mod paraboloid;
pub mod prefilter;
pub mod resample;
pub mod sphere_map;
pub mod spherical;
pub mod spherical_sat;
pub mod statistics;
mod strip;
pub mod taps;
pub mod to_lat_long;
pub mod topology;
pub mod turn;
pub mod wavelets;

#[cfg(test)]
mod tests;

pub use image::MapImage;

use glam::{DVec2, DVec3, UVec2};
use std::f64::consts::PI;

/// By how much the length of a direction may be off 1.
const UNIT_SLACK: f64 = 1e-4;

/// Whether a direction is a unit vector, as rays and axes of lobes have to be.
fn is_unit(direction: DVec3) -> bool {
    (direction.length() - 1.0).abs() <= UNIT_SLACK
}

/// A map of directions.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Parametrization {
    /// [`lat_long`].
    LatLong,
    /// [`sphere_map`], a disc.
    Sphere,
    /// [`cube`], six faces.
    Cube,
    /// [`paraboloid`], two discs.
    DualParaboloid,
    /// [`nusselt`], a disc for the hemisphere z ≥ 0 alone.
    Nusselt,
    /// [`octahedron`], the square layout.
    OctahedronQuadratic,
    /// [`octahedron`], the layout of two squares.
    OctahedronRectangular,
    /// [`octahedron`], the square layout of the octahedron |x| + |y| + c|z| = 1.
    OctahedronPerspective {
        /// How flat the octahedron is, above 0.
        c: f64,
    },
    /// [`equal_area`], a square.
    EqualArea,
}

/// A place on a map.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MapPoint {
    /// Face or disc.
    pub layer: u32,
    /// Coordinates in \[0, 1\]².
    pub uv: DVec2,
}

/// A texel of a map.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Texel {
    /// Face or disc.
    pub layer: u32,
    /// Column.
    pub x: u32,
    /// Row.
    pub y: u32,
}

impl Parametrization {
    /// One of each, with c = ½ for the perspective family.
    pub const ALL: [Self; 9] = [
        Self::LatLong,
        Self::Sphere,
        Self::Cube,
        Self::DualParaboloid,
        Self::Nusselt,
        Self::OctahedronQuadratic,
        Self::OctahedronRectangular,
        Self::OctahedronPerspective { c: 0.5 },
        Self::EqualArea,
    ];

    /// Number of rectangles.
    pub fn layers(self) -> u32 {
        match self {
            Self::Cube => cube::CUBE_FACES,
            Self::DualParaboloid => 2,
            _ => 1,
        }
    }

    /// Width over height of a layer whose texels are meant to be square.
    pub fn aspect(self) -> u32 {
        match self {
            Self::LatLong | Self::OctahedronRectangular => 2,
            _ => 1,
        }
    }

    /// Texels of a layer, square ones, of the map that has next to `texels` in all, those that hold no direction counted.
    pub fn size_for(self, texels: f64) -> UVec2 {
        let rows = (texels / f64::from(self.layers() * self.aspect())).sqrt();
        let rows = rows.round().max(1.0) as u32;
        UVec2::new(rows * self.aspect(), rows)
    }

    /// Whether layers hold directions on their inscribed disc alone.
    pub fn is_disc(self) -> bool {
        matches!(self, Self::Sphere | Self::DualParaboloid | Self::Nusselt)
    }

    /// Share of the texels' area that holds directions.
    pub fn coverage(self) -> f64 {
        if self.is_disc() { 0.25 * PI } else { 1.0 }
    }

    /// Solid angle of all directions that the map holds, sr.
    pub fn solid_angle(self) -> f64 {
        if self == Self::Nusselt { 2.0 * PI } else { 4.0 * PI }
    }

    /// Natural coordinates at (0, 0) and their extent.
    fn span(self) -> (DVec2, DVec2) {
        match self {
            Self::LatLong => (DVec2::ZERO, DVec2::ONE),
            Self::OctahedronRectangular => (DVec2::new(-2.0, -1.0), DVec2::new(4.0, 2.0)),
            _ => (DVec2::NEG_ONE, DVec2::splat(2.0)),
        }
    }

    fn natural(self, uv: DVec2) -> DVec2 {
        let (low, extent) = self.span();
        low + uv * extent
    }

    /// Where a direction of any length lies. `None` for one that the map does not hold: zero, not finite, or below the horizon of the
    /// Nusselt map.
    pub fn encode(self, direction: DVec3) -> Option<MapPoint> {
        let d = direction.try_normalize()?;
        let (layer, p) = match self {
            Self::LatLong => (0, lat_long::lat_long_encode(d)),
            Self::Sphere => (0, sphere_map::sphere_map_encode(d)),
            Self::Cube => cube::cube_encode(d),
            Self::DualParaboloid => paraboloid::paraboloid_encode(d),
            Self::Nusselt if d.z < 0.0 => return None,
            Self::Nusselt => (0, nusselt::nusselt_encode(d)),
            Self::OctahedronQuadratic => (0, octahedron::octahedron_encode(d)),
            Self::OctahedronRectangular => (0, octahedron::octahedron_rectangular_encode(d)),
            Self::OctahedronPerspective { c } => (0, octahedron::octahedron_perspective_encode(d, c)),
            Self::EqualArea => (0, equal_area::equal_area_encode(d)),
        };
        let (low, extent) = self.span();
        Some(MapPoint {
            layer,
            uv: (p - low) / extent,
        })
    }

    /// Whether there is a direction at a place.
    pub fn holds(self, at: MapPoint) -> bool {
        let inside = at.uv.cmpge(DVec2::ZERO).all() && at.uv.cmple(DVec2::ONE).all();
        inside && at.layer < self.layers() && (!self.is_disc() || self.natural(at.uv).length_squared() <= 1.0)
    }

    /// The unit direction at a place; `None` outside the map.
    pub fn decode(self, at: MapPoint) -> Option<DVec3> {
        let p = self.natural(at.uv);
        self.holds(at).then(|| match self {
            Self::LatLong => lat_long::lat_long_decode(p),
            Self::Sphere => sphere_map::sphere_map_decode(p),
            Self::Cube => cube::cube_decode(at.layer, p),
            Self::DualParaboloid => paraboloid::paraboloid_decode(at.layer, p),
            Self::Nusselt => nusselt::nusselt_decode(p),
            Self::OctahedronQuadratic => octahedron::octahedron_decode(p),
            Self::OctahedronRectangular => octahedron::octahedron_rectangular_decode(p),
            Self::OctahedronPerspective { c } => octahedron::octahedron_perspective_decode(p, c),
            Self::EqualArea => equal_area::equal_area_decode(p),
        })
    }

    /// dω/duv: solid angle over area of a layer's \[0, 1\]², sr; the same on all layers.
    pub fn solid_angle_density(self, uv: DVec2) -> f64 {
        let (_, extent) = self.span();
        let p = self.natural(uv);
        let natural = match self {
            Self::LatLong => lat_long::lat_long_density(p),
            Self::Sphere => sphere_map::sphere_map_density(p),
            Self::Cube => cube::cube_density(p),
            Self::DualParaboloid => paraboloid::paraboloid_density(p),
            Self::Nusselt => nusselt::nusselt_density(p),
            Self::OctahedronQuadratic => octahedron::octahedron_density(p),
            Self::OctahedronRectangular => octahedron::octahedron_rectangular_density(p),
            Self::OctahedronPerspective { c } => octahedron::octahedron_perspective_density(p, c),
            Self::EqualArea => equal_area::equal_area_density(p),
        };
        natural * extent.x * extent.y
    }

    /// Derivatives of the direction by the two coordinates; on a fold those of one side.
    pub fn derivatives(self, at: MapPoint) -> [DVec3; 2] {
        let (_, extent) = self.span();
        let p = self.natural(at.uv);
        let [along, down] = match self {
            Self::LatLong => lat_long::derivatives(p),
            Self::Sphere => sphere_map::derivatives(p),
            Self::Cube => cube::derivatives(at.layer, p),
            Self::DualParaboloid => paraboloid::derivatives(at.layer, p),
            Self::Nusselt => nusselt::derivatives(p),
            Self::OctahedronQuadratic => octahedron::derivatives(p, 1.0),
            Self::OctahedronRectangular => octahedron::rectangular_derivatives(p),
            Self::OctahedronPerspective { c } => octahedron::derivatives(p, c),
            Self::EqualArea => equal_area::derivatives(p),
        };
        [along * extent.x, down * extent.y]
    }

    /// Solid angle of a rectangle of a layer, sr: exact, what lies outside a disc left out.
    pub fn rectangle_solid_angle(self, lower: DVec2, upper: DVec2) -> f64 {
        let (low, high) = (self.natural(lower), self.natural(upper));
        match self {
            Self::LatLong => lat_long::solid_angle(low, high),
            Self::Sphere => sphere_map::solid_angle(low, high),
            Self::Cube => cube::solid_angle(low, high),
            Self::DualParaboloid => paraboloid::solid_angle(low, high),
            Self::Nusselt => nusselt::solid_angle(low, high),
            Self::OctahedronQuadratic => octahedron::solid_angle(low, high, 1.0),
            Self::OctahedronRectangular => octahedron::rectangular_solid_angle(low, high),
            Self::OctahedronPerspective { c } => octahedron::solid_angle(low, high, c),
            Self::EqualArea => equal_area::equal_area_density(low) * (high - low).element_product(),
        }
    }

    /// Share of a rectangle's area that holds directions.
    pub fn rectangle_coverage(self, lower: DVec2, upper: DVec2) -> f64 {
        if !self.is_disc() {
            return 1.0;
        }
        let (low, high) = (self.natural(lower), self.natural(upper));
        disc::area(low, high) / (high - low).element_product()
    }

    /// Solid angle of a texel of a map of that many texels per layer, sr.
    pub fn texel_solid_angle(self, size: UVec2, texel: Texel) -> f64 {
        let [lower, upper] = texel.bounds(size);
        self.rectangle_solid_angle(lower, upper)
    }

    /// All texels of a map: layer by layer, row by row.
    pub fn texels(self, size: UVec2) -> impl Iterator<Item = Texel> {
        let rows = (0..self.layers()).flat_map(move |layer| (0..size.y).map(move |y| (layer, y)));
        rows.flat_map(move |(layer, y)| (0..size.x).map(move |x| Texel { layer, x, y }))
    }

    /// The unit direction of a texel's centre; `None` where that lies outside a disc.
    pub fn texel_direction(self, size: UVec2, texel: Texel) -> Option<DVec3> {
        self.decode(texel.centre(size))
    }
}

impl Texel {
    /// Its lower and upper corner in \[0, 1\]².
    pub fn bounds(self, size: UVec2) -> [DVec2; 2] {
        let at = UVec2::new(self.x, self.y);
        [at, at + 1].map(|corner| corner.as_dvec2() / size.as_dvec2())
    }

    /// Its centre.
    pub fn centre(self, size: UVec2) -> MapPoint {
        MapPoint {
            layer: self.layer,
            uv: (UVec2::new(self.x, self.y).as_dvec2() + 0.5) / size.as_dvec2(),
        }
    }
}
