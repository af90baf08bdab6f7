//! What lies beyond the edges of a map: borders repeat texels of its inside, so that filters need no case for seams.
//!
//! Source of the octahedron's square: T. Engelhardt and C. Dachsbacher, "Octahedron Environment Maps", VMV 2008; the rules as written
//! here are derived, and hold to any depth up to the map's size. Twin of `maps/topology.glsl`.

use super::cube::{CUBE_FACES, cube_axes, cube_encode};
use super::{Parametrization, Texel};
use glam::{IVec2, UVec2};

/// The square layout of octahedra: crossing an edge turns the map about that edge's middle; a corner is the opposite one's inside.
pub fn octahedron_wrap(texel: IVec2, size: IVec2) -> IVec2 {
    let mut p = texel;
    if p.x < 0 || p.x >= size.x {
        p = IVec2::new(if p.x < 0 { -1 - p.x } else { 2 * size.x - 1 - p.x }, size.y - 1 - p.y);
    }
    if p.y < 0 || p.y >= size.y {
        p = IVec2::new(size.x - 1 - p.x, if p.y < 0 { -1 - p.y } else { 2 * size.y - 1 - p.y });
    }
    p
}

/// The rectangular layout of the octahedron: it repeats along the first axis; crossing the upper or lower edge turns it about the edge's
/// middle.
pub fn octahedron_rectangular_wrap(texel: IVec2, size: IVec2) -> IVec2 {
    let mut p = texel;
    if p.y < 0 || p.y >= size.y {
        p = IVec2::new(size.x - 1 - p.x, if p.y < 0 { -1 - p.y } else { 2 * size.y - 1 - p.y });
    }
    IVec2::new(p.x.rem_euclid(size.x), p.y)
}

/// The latitude–longitude map: it repeats along the first axis; beyond a pole lies the other side, half a turn on. Of even width.
pub fn lat_long_wrap(texel: IVec2, size: IVec2) -> IVec2 {
    let mut p = texel;
    if p.y < 0 || p.y >= size.y {
        p = IVec2::new(p.x + size.x / 2, if p.y < 0 { -1 - p.y } else { 2 * size.y - 1 - p.y });
    }
    IVec2::new(p.x.rem_euclid(size.x), p.y)
}

/// The cube: the texel as deep in the next face as the border texel is outside. `None` beyond a corner, where three faces meet.
fn cube_wrap(face: u32, texel: IVec2, size: i32) -> Option<Texel> {
    let outside = |v: i32| v < 0 || v >= size;
    if outside(texel.x) && outside(texel.y) || face >= CUBE_FACES {
        return None;
    }
    let [s, t, normal] = cube_axes(face);
    let n = f64::from(size);
    let mut at = (2.0 * texel.as_dvec2() + 1.0) / n - 1.0;
    // Fold what sticks out down the cube's side.
    let deep = (at.abs().max_element() - 1.0).max(0.0);
    at = at.clamp(glam::DVec2::NEG_ONE, glam::DVec2::ONE);
    let (layer, uv) = cube_encode(at.x * s + at.y * t + (1.0 - deep) * normal);
    // The point is the middle of a texel.
    let place = (uv * 0.5 + 0.5) * n;
    Some(Texel {
        layer,
        x: place.x as u32,
        y: place.y as u32,
    })
}

impl Parametrization {
    /// The texel of the map that the texel in column `x`, row `y` repeats, counted from the corner of its layer and up to one size outside.
    ///
    /// `None` where no texel repeats: on discs, beyond the corners of a cube's face, beyond the poles of a latitude–longitude map of odd
    /// width, for faces and octahedra that are not square, and farther outside.
    pub fn wrap(self, size: UVec2, layer: u32, x: i32, y: i32) -> Option<Texel> {
        let (n, at) = (size.as_ivec2(), IVec2::new(x, y));
        if layer >= self.layers() || at.cmplt(-n).any() || at.cmpge(2 * n).any() {
            return None;
        }
        if at.cmpge(IVec2::ZERO).all() && at.cmplt(n).all() {
            let at = at.as_uvec2();
            return Some(Texel {
                layer,
                x: at.x,
                y: at.y,
            });
        }
        let beyond_pole = y < 0 || y >= n.y;
        let inside = match self {
            Self::Sphere | Self::DualParaboloid | Self::Nusselt => return None,
            Self::LatLong if beyond_pole && n.x % 2 == 1 => return None,
            Self::LatLong => lat_long_wrap(at, n),
            Self::Cube if n.x == n.y => return cube_wrap(layer, at, n.x),
            Self::OctahedronRectangular => octahedron_rectangular_wrap(at, n),
            Self::OctahedronQuadratic | Self::OctahedronPerspective { .. } | Self::EqualArea if n.x == n.y => {
                octahedron_wrap(at, n)
            }
            _ => return None,
        };
        let inside = inside.as_uvec2();
        Some(Texel {
            layer,
            x: inside.x,
            y: inside.y,
        })
    }
}

/// The greatest level of a chain of mips, each half the last, that a border of that many texels at level 0 still serves with one texel:
/// log₂. `None` for no border.
pub fn border_levels(border: u32) -> Option<u32> {
    border.checked_ilog2()
}
