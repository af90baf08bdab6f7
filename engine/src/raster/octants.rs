//! Polygons cut along the planes x = 0, y = 0 and z = 0, and the ways to render an octahedron map that rest on it.
//!
//! Source: T. Engelhardt, "Efficient From-Point Visibility for Global Illumination in Virtual Scenes with Participating
//! Media", PhD thesis, KIT, 2013, §7.2.1 and §7.3.2, of which these cuts differ: clip coordinates are homogeneous, with the norm |x| + |y| + |z| as the divisor, so that what is interpolated inside an octant is
//! right (the source's are divided already, and depth and attributes bend), and no more is emitted than there is.
//!
//! Guarantees. A cut is the same from both ends of an edge, and every octant's piece has the same corners on a plane as its neighbour's:
//! there are no cracks but those of the rasterizer. Coordinates of a crossing lie between those of the edge's ends, so that a polygon's
//! coordinates rise and fall once along its outline however they round, each plane cuts it at two places at most, and its two parts have
//! four corners more at most than the whole. Three cuts make of a triangle 7, 15 and at last [`SPLIT_CORNERS`] corners at most. In exact
//! arithmetic and general position there are at most 7 polygons with 27 corners, or 13 triangles.
//! Twin of `raster/octants.glsl`, in the same precision: the same counts.

use glam::{Vec2, Vec3};

use crate::catalogue::{Bias, Role, Row, sources};

/// Corners that the cut of a triangle along three planes makes at most: of 8 polygons, or 15 triangles. `max_vertices` of
/// `raster/surface_split.geom`.
pub const SPLIT_CORNERS: usize = 31;
/// As [`SPLIT_CORNERS`], of the cut along z = 0: of 2 polygons, or 3 triangles.
pub const HALVES_CORNERS: usize = 7;
/// As [`SPLIT_CORNERS`], of the cut along z = 0 with corners where outlines cross the other planes: of 2 polygons, or 11 triangles.
pub const OUTLINES_CORNERS: usize = 15;

/// How triangles come to the octants of an octahedron map, whose projection is linear in each of them alone.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum OctantCut {
    /// OEM-4g: an instance for each octant, cut by clip distances (`shaderClipDistance`). Exact, and the one to take.
    #[default]
    ClipDistances,
    /// OEM-4a: pieces for each octant by a geometry shader. Exact.
    Split,
    /// OEM-4b: a geometry shader cuts along z = 0 alone; edges stay straight over x = 0 and y = 0, where their images have bends. For the
    /// rectangular layout.
    Halves,
    /// OEM-4c: as [`OctantCut::Halves`], with outlines bent as they should be: silhouettes are exact, what lies in them is not. For the
    /// rectangular layout.
    Outlines,
    /// OEM-4d: an instance for each octant; fragments of other octants are discarded. Exact.
    Mask,
    /// As [`OctantCut::Mask`], by a draw for each octant within the rectangle of pixels around it.
    MaskInRectangles,
    /// OEM-4e: corners are mapped and joined by straight edges, and what lies over a seam is left out: right in the limit of small pieces.
    /// Each triangle is drawn as `level`² pieces, with `level` from 1 to [`MAX_LEVEL`](super::tessellation::MAX_LEVEL).
    Unsplit {
        /// Pieces along an edge.
        level: u32,
    },
}

impl OctantCut {
    /// Whether what is seen at every texel is what its ray meets.
    pub fn is_exact(self) -> bool {
        !matches!(self, Self::Halves | Self::Outlines | Self::Unsplit { .. })
    }

    /// Corners and triangles that reach the rasterizer of one triangle, given from the middle of the map; those that fragments or clipping
    /// drop afterwards included.
    pub fn emitted(self, triangle: [Vec3; 3]) -> Emitted {
        let whole = OctantPolygon::triangle(triangle);
        let mut emitted = Emitted::default();
        match self {
            Self::ClipDistances | Self::Mask | Self::MaskInRectangles => (0..8).for_each(|_| emitted.add(&whole)),
            Self::Split => octant_split(&whole).iter().for_each(|piece| emitted.add(piece)),
            Self::Halves | Self::Outlines => {
                for is_below in [false, true] {
                    let half = octant_half(&whole, 2, is_below);
                    let outline = if self == Self::Outlines {
                        octant_outline(&half)
                    } else {
                        half
                    };
                    emitted.add(&outline);
                }
            }
            Self::Unsplit { level } => (0..level * level).for_each(|_| emitted.add(&whole)),
        }
        emitted
    }
}

/// What a triangle becomes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Emitted {
    /// Polygons.
    pub polygons: usize,
    /// Their corners.
    pub corners: usize,
    /// Triangles that strips make of them.
    pub triangles: usize,
}

impl Emitted {
    fn add(&mut self, polygon: &OctantPolygon) {
        let corners = polygon.corners.len();
        if corners >= 3 {
            self.polygons += 1;
            self.corners += corners;
            self.triangles += corners - 2;
        }
    }

    /// Both together.
    pub fn and(self, other: Self) -> Self {
        Self {
            polygons: self.polygons + other.polygons,
            corners: self.corners + other.corners,
            triangles: self.triangles + other.triangles,
        }
    }
}

/// Corner of a polygon.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OctantCorner {
    /// From the middle of the octants.
    pub p: Vec3,
    /// Weights of the triangle's corners 1 and 2.
    pub weights: Vec2,
}

/// A convex polygon.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct OctantPolygon {
    /// Its corners in order; fewer than three are nothing.
    pub corners: Vec<OctantCorner>,
}

impl OctantPolygon {
    /// A triangle.
    pub fn triangle(corners: [Vec3; 3]) -> Self {
        let weights = [Vec2::ZERO, Vec2::X, Vec2::Y];
        let corner = |i: usize| OctantCorner {
            p: corners[i],
            weights: weights[i],
        };
        Self {
            corners: (0..3).map(corner).collect(),
        }
    }

    fn edges(&self) -> impl Iterator<Item = [OctantCorner; 2]> {
        let count = self.corners.len();
        (0..count).map(move |i| [self.corners[i], self.corners[(i + 1) % count]])
    }
}

/// Octant of a point by bits, set for negative coordinates: zeros of both signs count as positive.
pub fn octant_of(p: Vec3) -> u32 {
    u32::from(p.x < 0.0) | u32::from(p.y < 0.0) << 1 | u32::from(p.z < 0.0) << 2
}

/// Where the edge between two corners on different sides meets a plane: the same bits from either end, and no coordinate beyond the two
/// ends'.
pub fn octant_crossing(one: OctantCorner, other: OctantCorner, axis: usize) -> OctantCorner {
    let (a, b) = if one.p[axis] >= 0.0 { (one, other) } else { (other, one) };
    let span = a.p[axis] - b.p[axis];
    let t = if span > 0.0 { a.p[axis] / span } else { 0.0 };
    let mut p = (a.p + t * (b.p - a.p)).clamp(a.p.min(b.p), a.p.max(b.p));
    p[axis] = 0.0;
    OctantCorner {
        p,
        weights: a.weights + t * (b.weights - a.weights),
    }
}

/// The part of a convex polygon with a coordinate of at least 0, or below it with the plane as its border.
pub fn octant_half(whole: &OctantPolygon, axis: usize, is_below: bool) -> OctantPolygon {
    let mut part = OctantPolygon::default();
    for [a, b] in whole.edges() {
        let [a_is_below, b_is_below] = [a, b].map(|corner| corner.p[axis] < 0.0);
        if a_is_below == is_below {
            part.corners.push(a);
        }
        // The upper part has corners on the plane already.
        if a_is_below != b_is_below && (is_below || a.p[axis].max(b.p[axis]) > 0.0) {
            part.corners.push(octant_crossing(a, b, axis));
        }
    }
    part
}

/// The pieces of a polygon in the octants, numbered as by [`octant_of`].
pub fn octant_split(whole: &OctantPolygon) -> [OctantPolygon; 8] {
    std::array::from_fn(|octant| {
        (0..3).fold(whole.clone(), |piece, axis| {
            // What has no area left is not cut again.
            if piece.corners.len() < 3 {
                return OctantPolygon::default();
            }
            octant_half(&piece, axis, octant >> axis & 1 == 1)
        })
    })
}

/// The same polygon with corners where its edges cross x = 0 and y = 0.
pub fn octant_outline(whole: &OctantPolygon) -> OctantPolygon {
    let mut outline = OctantPolygon::default();
    for [a, b] in whole.edges() {
        outline.corners.push(a);
        // Ends on a plane are corners of it already.
        let crosses = |axis: usize| (a.p[axis] < 0.0) != (b.p[axis] < 0.0) && a.p[axis] != 0.0 && b.p[axis] != 0.0;
        let is_x_first = a.p.x.abs() * (b.p.y - a.p.y).abs() <= a.p.y.abs() * (b.p.x - a.p.x).abs();
        for axis in if is_x_first { [0, 1] } else { [1, 0] } {
            if crosses(axis) {
                outline.corners.push(octant_crossing(a, b, axis));
            }
        }
    }
    outline
}

/// Corner of a convex polygon that comes at a place of the triangle strip that covers it: from both ends in turn.
pub fn octant_strip_corner(place: usize, count: usize) -> usize {
    let step = place.div_ceil(2);
    if place % 2 == 1 || place == 0 {
        step
    } else {
        count - step
    }
}

/// Rows of the catalogue.
pub(crate) const ROWS: &[Row] = &[
    Row {
        id: "OEM-4a",
        name: "octahedron maps rendered live: exact split by a geometry shader",
        role: Role::Kernel,
        limits: "Exact but for cracks of the rasterizer's own rounding; needs geometry shaders.",
        sources: &[sources::ENGELHARDT_2013.at("7.2.1 and 7.3.2")],
        shaders: &["shaders/raster/surface_split.geom"],
        needs: &["geometryShader"],
        tests: &[
            "tests/tests/raster/directions.rs::octahedra_are_as_rays_see_them_and_have_no_holes",
            "tests/tests/raster/cuts.rs::exact_cuts_interpolate_what_rays_meet",
            "tests/tests/raster/cuts.rs::cuts_emit_what_their_twins_say",
            "engine/src/raster/octants.rs::triangles_in_general_position_give_thirteen_at_most",
            "engine/src/raster/octants.rs::triangles_on_a_lattice_give_no_more_than_shaders_may_emit",
            "engine/src/raster/octants.rs::pieces_cover_the_triangle_and_lie_in_their_octants",
            "engine/src/raster/octants.rs::cuts_are_the_same_from_both_ends",
            "tests/tests/twins/raster.rs::pieces_of_octants_agree_with_their_twins",
        ],
        api: &["clerestory::raster::OctantCut", "clerestory::raster::GBuffer"],
        settings: &["clerestory::raster::Layering", "clerestory::raster::GBufferDesc"],
        ..Row::of(file!())
    },
    Row {
        id: "OEM-4b",
        name: "octahedron maps rendered live: split only along the equator",
        role: Role::Kernel,
        limits: "Edges stay straight over x = 0 and y = 0, where their images bend; rectangular layout only.",
        sources: &[sources::ENGELHARDT_2013.at("7.2.1 and 7.3.2")],
        shaders: &["shaders/raster/surface_halves.geom"],
        bias: Some(Bias::Biased("edges stay straight where their images bend")),
        needs: &["geometryShader"],
        tests: &[
            "tests/tests/raster/cuts.rs::halves_and_outlines_are_wrong_as_stated",
            "tests/tests/raster/cuts.rs::cuts_emit_what_their_twins_say",
            "tests/tests/raster/cuts.rs::the_split_emits_least",
        ],
        api: &["clerestory::raster::OctantCut", "clerestory::raster::GBuffer"],
        settings: &["clerestory::raster::Layering", "clerestory::raster::GBufferDesc"],
        ..Row::of(file!())
    },
    Row {
        id: "OEM-4c",
        name: "octahedron maps rendered live: split outlines",
        role: Role::Kernel,
        limits: "Silhouettes are exact, depth and attributes inside them are not; rectangular layout only.",
        sources: &[sources::ENGELHARDT_2013.at("7.2.1 and 7.3.2")],
        shaders: &["shaders/raster/surface_outlines.geom"],
        bias: Some(Bias::Biased("what is interpolated inside outlines")),
        needs: &["geometryShader"],
        tests: &[
            "tests/tests/raster/cuts.rs::halves_and_outlines_are_wrong_as_stated",
            "tests/tests/raster/cuts.rs::cuts_emit_what_their_twins_say",
            "tests/tests/twins/raster.rs::outlines_agree_with_their_twins",
        ],
        api: &["clerestory::raster::OctantCut", "clerestory::raster::GBuffer"],
        settings: &["clerestory::raster::Layering", "clerestory::raster::GBufferDesc"],
        ..Row::of(file!())
    },
];

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_random::Random;

    fn split(triangle: [Vec3; 3]) -> Emitted {
        OctantCut::Split.emitted(triangle)
    }

    fn most(all: impl Iterator<Item = Emitted>) -> [usize; 3] {
        all.fold([0; 3], |most, e| {
            [
                most[0].max(e.polygons),
                most[1].max(e.corners),
                most[2].max(e.triangles),
            ]
        })
    }

    #[test]
    fn triangles_in_general_position_give_thirteen_at_most() {
        let mut random = Random(17);
        let generic = (0..120_000).map(|_| split([0; 3].map(|_| random.vector())));
        // The bound is reached.
        assert_eq!(most(generic), [7, 27, 13]);
    }

    #[test]
    fn triangles_on_a_lattice_give_no_more_than_shaders_may_emit() {
        let mut random = Random(18);
        let mut lattice = |reach: i32| {
            let mut number = || (random.below(2 * reach as usize + 1) as i32 - reach) as f32;
            [0; 3].map(|_| Vec3::new(number(), number(), number()))
        };
        let all: Vec<_> = (0..400_000).map(|i| lattice([2, 3, 7, 12][i % 4])).collect();
        let found = most(all.iter().map(|t| split(*t)));
        println!("split of lattice triangles: {found:?}");
        assert!(
            found[0] <= 8 && found[1] <= SPLIT_CORNERS && found[2] <= 15,
            "{found:?}"
        );
        // About the middle, but for rounding: one plane meets six octants there, and rounding adds slivers.
        let mut random = Random(22);
        let central = (0..200_000).map(|_| {
            let [a, b] = [0; 2].map(|_| random.vector());
            split([a, b, -random.unit() * (a + b)])
        });
        let found = most(central);
        println!("split of triangles about the middle: {found:?}");
        assert!(
            found[0] <= 8 && found[1] <= SPLIT_CORNERS && found[2] <= 15,
            "{found:?}"
        );
        for (cut, bounds) in [
            (OctantCut::Halves, [2, HALVES_CORNERS, 3]),
            (OctantCut::Outlines, [2, OUTLINES_CORNERS, 11]),
        ] {
            let found = most(all.iter().map(|t| cut.emitted(*t)));
            println!("{cut:?} of lattice triangles: {found:?}");
            assert!(
                found.iter().zip(bounds).all(|(found, bound)| *found <= bound),
                "{cut:?}: {found:?}"
            );
        }
        let mut random = Random(19);
        let generic = (0..100_000).map(|_| OctantCut::Outlines.emitted([0; 3].map(|_| random.vector())));
        println!("outlines of generic triangles: {:?}", most(generic));
    }

    /// Twice the area of a polygon.
    fn double_area(polygon: &OctantPolygon) -> f64 {
        let p: Vec<_> = polygon.corners.iter().map(|c| c.p.as_dvec3()).collect();
        (2..p.len())
            .map(|i| (p[i - 1] - p[0]).cross(p[i] - p[0]))
            .fold(glam::DVec3::ZERO, |sum, cross| sum + cross)
            .length()
    }

    #[test]
    fn pieces_cover_the_triangle_and_lie_in_their_octants() {
        let mut random = Random(20);
        for case in 0..20_000 {
            let corners = [0; 3].map(|_| {
                let p = random.vector();
                if case % 2 == 0 { p } else { (4.0 * p).round() }
            });
            let whole = OctantPolygon::triangle(corners);
            let pieces = octant_split(&whole);
            for (octant, piece) in pieces.iter().enumerate() {
                for corner in &piece.corners {
                    for axis in 0..3 {
                        let x = corner.p[axis];
                        assert!(if octant >> axis & 1 == 0 { x >= 0.0 } else { x <= 0.0 }, "{corners:?}");
                    }
                    let [w1, w2] = corner.weights.to_array();
                    let at = corners[0] + w1 * (corners[1] - corners[0]) + w2 * (corners[2] - corners[0]);
                    // A crossing divides by a span that may be short beside the edge's other coordinates, but no cut moves along its
                    // edge by more than its parameter's roundings.
                    assert!(
                        (at - corner.p).abs().max_element() < 1e-5,
                        "{corners:?}: {at} {}",
                        corner.p
                    );
                }
            }
            let sum: f64 = pieces.iter().map(double_area).sum();
            let area = double_area(&whole);
            assert!((sum - area).abs() < 1e-4 * (1.0 + area), "{corners:?}: {sum} {area}");
        }
    }

    #[test]
    fn cuts_are_the_same_from_both_ends() {
        let mut random = Random(21);
        for _ in 0..10_000 {
            let [a, b] = [0; 2].map(|_| OctantCorner {
                p: random.vector(),
                weights: Vec2::new(random.unit(), random.unit()),
            });
            for axis in 0..3 {
                if (a.p[axis] < 0.0) != (b.p[axis] < 0.0) {
                    let crossing = octant_crossing(a, b, axis);
                    assert_eq!(crossing, octant_crossing(b, a, axis));
                    let (low, high) = (a.p.min(b.p), a.p.max(b.p));
                    assert!(crossing.p.cmpge(low).all() && crossing.p.cmple(high).all());
                }
            }
        }
    }

    #[test]
    fn strips_visit_every_corner_once() {
        for count in 3..=8 {
            let mut places: Vec<_> = (0..count).map(|place| octant_strip_corner(place, count)).collect();
            // Three in a row are a triangle of the polygon: they hold two neighbours.
            for three in places.windows(3) {
                let is_side = |a: usize, b: usize| (a + 1) % count == b || (b + 1) % count == a;
                assert!(is_side(three[0], three[2]) || is_side(three[0], three[1]) || is_side(three[1], three[2]));
            }
            places.sort_unstable();
            assert_eq!(places, (0..count).collect::<Vec<_>>());
        }
    }
}
