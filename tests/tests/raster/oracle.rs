//! Which triangles may be seen at a pixel, in f64: all that rounding leaves open, and nothing more.
//!
//! The rule. The rasterizer rounds the places of vertices to 2⁻ᵇ pixels (`subPixelPrecisionBits`, b), by an amount of less than one such
//! step per axis, after their coordinates were computed in f32. So what it covers lies within δ of the exact projection and leaves out no
//! more than a rim of that width: δ = √2·2⁻ᵇ + the rounding of coordinates, [`COORDINATE_ROUNDINGS`] half ulps of the sums that they come from,
//! over w, in pixels, at the point of the outline near the picture ([`GUARD`]) where that is largest: clipping moves an edge by as much. A triangle *may* cover a pixel whose centre is within δ of its projection, and *surely* covers one whose centre is deeper inside than
//! that. Depth there is known within the change over δ and τ: [`DEPTH_ROUNDINGS`] half ulps of what the plane equation sums up over the
//! triangle and the picture, times the triangle's conditioning, the square of its longest side over twice its area, since its gradient is a quotient by that area.
//! A triangle is *legal* at a pixel when it may cover it and its nearest depth is not behind the farthest one of a triangle that surely
//! covers it; nothing is legal where none surely does. Where one answer is legal, rasters and rays must both give that one.

use clerestory::accel::{MAX_COORDINATE, NO_HIT};
use clerestory::gpu::Area;
use clerestory::raster::View;
use glam::{DVec2, DVec3, Vec3};

/// Half an ulp of 1.
const U: f64 = 1.0 / 16_777_216.0;

/// Differences, products, sums and quotients from a position to pixels, and the interpolation where clipping cuts an edge: at most twelve
/// roundings one behind the other, of terms that are no larger than the sums of magnitudes they are multiplied by here.
const COORDINATE_ROUNDINGS: f64 = 12.0;

/// Clip coordinates x and y over w up to which the outline of a triangle is looked at: pixels end at 1.
const GUARD: f64 = 2.0;

/// Pixels from the picture's corner within which drivers keep the vertices of what they rasterize.
const GUARD_BAND: f64 = 32_768.0;

/// Roundings of a plane equation: differences, two products and their sum, a quotient, and the evaluation.
const DEPTH_ROUNDINGS: f64 = 8.0;

/// A point in clip space, with what bounds the rounding of its coordinates.
#[derive(Clone, Copy)]
struct Vertex {
    clip: [f64; 4],
    /// Signed distances to the octant's planes; all positive in other views.
    inside: DVec3,
    magnitude: f64,
}

impl Vertex {
    fn between(a: Self, b: Self, t: f64) -> Self {
        let mix = |a: f64, b: f64| a + t * (b - a);
        Self {
            clip: std::array::from_fn(|i| mix(a.clip[i], b.clip[i])),
            inside: a.inside + t * (b.inside - a.inside),
            magnitude: a.magnitude.max(b.magnitude),
        }
    }
}

/// The largest entry of the rows that make clip coordinates.
fn largest_entry(view: &View) -> f64 {
    let origin = view.origin().as_dvec3();
    let at = |p: DVec3| view.project(p);
    let constant = at(origin);
    let columns = DVec3::AXES.map(|axis| at(origin + axis));
    let entries = columns
        .iter()
        .flat_map(|column| [0, 1, 3].map(|row| (column[row] - constant[row]).abs()));
    entries.fold(0.0, f64::max)
}

fn clipped(polygon: &[Vertex], side: impl Fn(&Vertex) -> f64) -> Vec<Vertex> {
    let mut kept = Vec::new();
    for (i, a) in polygon.iter().enumerate() {
        let b = &polygon[(i + 1) % polygon.len()];
        let (da, db) = (side(a), side(b));
        if da >= 0.0 {
            kept.push(*a);
        }
        if (da < 0.0) != (db < 0.0) {
            kept.push(Vertex::between(*a, *b, da / (da - db)));
        }
    }
    kept
}

/// A triangle at a pixel.
#[derive(Debug, Clone, Copy)]
pub struct Candidate {
    /// Number of the triangle.
    pub triangle: u32,
    /// It surely covers the pixel.
    pub surely: bool,
    depth: [f64; 2],
}

/// All that may be seen at the pixels of a picture.
pub struct Oracle {
    width: u32,
    pixels: Vec<Vec<Candidate>>,
    sub_pixel: f64,
}

impl Oracle {
    /// Of a picture whose device has so many `subPixelPrecisionBits`.
    pub fn new(size: [u32; 2], sub_pixel_bits: u32) -> Self {
        Self {
            width: size[0],
            pixels: vec![Vec::new(); (size[0] * size[1]) as usize],
            sub_pixel: (-f64::from(sub_pixel_bits)).exp2(),
        }
    }

    /// Adds triangles in a view; those with coordinates that no ray can reach are nowhere.
    pub fn add(&mut self, view: &View, area: Area, triangles: &[[Vec3; 3]]) {
        for (index, corners) in (0..).zip(triangles) {
            if corners
                .iter()
                .all(|corner| corner.abs().max_element() <= MAX_COORDINATE)
            {
                self.add_triangle(view, area, index, corners.map(|corner| corner.as_dvec3()));
            }
        }
    }

    fn add_triangle(&mut self, view: &View, area: Area, index: u32, corners: [DVec3; 3]) {
        let signs = view.octant().as_dvec3();
        let scale = largest_entry(view);
        let triangle = corners.map(|corner| {
            let clip = view.project(corner);
            let from = corner - view.origin().as_dvec3();
            Vertex {
                clip,
                inside: if signs == DVec3::ZERO { DVec3::ONE } else { signs * from },
                magnitude: from.abs().element_sum() * scale,
            }
        });
        let mut polygon = clipped(&triangle, |v| v.clip[3] - v.clip[2]);
        for axis in 0..3 {
            polygon = clipped(&polygon, |v| v.inside[axis]);
        }
        let half = 0.5 * DVec2::new(f64::from(area.size[0]), f64::from(area.size[1]));
        let offset = DVec2::new(f64::from(area.offset[0]), f64::from(area.offset[1]));
        let farthest = polygon
            .iter()
            .map(|v| half.max_element() * v.clip[0].hypot(v.clip[1]) / v.clip[3]);
        let reach = farthest.fold(2.0 * half.element_sum(), f64::max).min(GUARD_BAND);
        for axis in 0..2 {
            for sign in [-1.0, 1.0] {
                polygon = clipped(&polygon, |v| GUARD * v.clip[3] + sign * v.clip[axis]);
            }
        }
        if polygon.len() < 3 {
            return;
        }
        let mut rim = 0.0f64;
        let mut depths = [f64::INFINITY, f64::NEG_INFINITY];
        let places: Vec<DVec2> = polygon
            .iter()
            .map(|v| {
                let [x, y, z, w] = v.clip;
                let place = DVec2::new(x, y) / w;
                let rounding = COORDINATE_ROUNDINGS * U * v.magnitude * (1.0 + place.length()) / w;
                rim = rim.max(half.max_element() * rounding);
                depths = [depths[0].min(z / w), depths[1].max(z / w)];
                offset + half + half * place
            })
            .collect();
        let delta = 2f64.sqrt() * self.sub_pixel + rim;
        let shape = Shape::new(&places);
        let plane = Plane::of(&triangle, half, offset);
        let [low, high] = [0, 1].map(|end| {
            let all = places
                .iter()
                .fold(places[0], |a, b| if end == 0 { a.min(*b) } else { a.max(*b) });
            (all + if end == 0 { -delta - 0.5 } else { delta + 0.5 }).clamp(offset, offset + 2.0 * half)
        });
        for y in low.y as u32..(high.y.ceil() as u32).min(area.offset[1] + area.size[1]) {
            for x in low.x as u32..(high.x.ceil() as u32).min(area.offset[0] + area.size[0]) {
                let center = DVec2::new(f64::from(x) + 0.5, f64::from(y) + 0.5);
                let depth_inside = shape.depth_inside(center);
                if depth_inside < 0.0 && shape.distance(center) > delta {
                    continue;
                }
                // The gradient of what has no area in the picture is anything.
                let plane = plane.as_ref().filter(|_| shape.conditioning.is_finite());
                let depth = plane.map_or(depths, |plane| {
                    let tau = DEPTH_ROUNDINGS * U * (depths[1] + shape.conditioning * plane.slope * reach);
                    let (at, change) = (plane.at(center), plane.slope * delta + tau);
                    [
                        (at - change).clamp(depths[0] - tau, depths[1] + tau),
                        (at + change).clamp(depths[0] - tau, depths[1] + tau),
                    ]
                });
                self.pixels[(y * self.width + x) as usize].push(Candidate {
                    triangle: index,
                    surely: depth_inside > delta,
                    depth,
                });
            }
        }
    }

    /// Triangles that may be seen at a pixel; [`NO_HIT`] among them where that may be nothing.
    pub fn legal(&self, pixel: usize) -> Vec<u32> {
        let all = &self.pixels[pixel];
        // Greater depth is nearer.
        let sure = all
            .iter()
            .filter(|c| c.surely)
            .map(|c| c.depth[0])
            .fold(f64::NEG_INFINITY, f64::max);
        let mut legal: Vec<_> = all.iter().filter(|c| c.depth[1] >= sure).map(|c| c.triangle).collect();
        if sure == f64::NEG_INFINITY {
            legal.push(NO_HIT);
        }
        legal.sort_unstable();
        legal.dedup();
        legal
    }

    /// Whether a triangle surely covers a pixel.
    pub fn is_sure(&self, pixel: usize, triangle: u32) -> bool {
        self.pixels[pixel].iter().any(|c| c.triangle == triangle && c.surely)
    }
}

/// A convex polygon.
struct Shape {
    places: Vec<DVec2>,
    orientation: f64,
    conditioning: f64,
}

impl Shape {
    fn new(places: &[DVec2]) -> Self {
        let next = |i: usize| places[(i + 1) % places.len()];
        let double_area: f64 = (1..places.len() - 1)
            .map(|i| (places[i] - places[0]).perp_dot(places[i + 1] - places[0]))
            .sum();
        let longest = (0..places.len())
            .map(|i| (next(i) - places[i]).length_squared())
            .fold(0.0, f64::max);
        Self {
            places: places.to_vec(),
            orientation: double_area.signum(),
            conditioning: longest / double_area.abs(),
        }
    }

    fn edges(&self) -> impl Iterator<Item = [DVec2; 2]> {
        (0..self.places.len()).map(|i| [self.places[i], self.places[(i + 1) % self.places.len()]])
    }

    /// Distance to the nearest edge's line of a point inside; negative outside.
    fn depth_inside(&self, p: DVec2) -> f64 {
        let distance = |[a, b]: [DVec2; 2]| {
            let along = b - a;
            // Edges of no length bound nothing.
            if along == DVec2::ZERO {
                return f64::INFINITY;
            }
            self.orientation * along.perp_dot(p - a) / along.length()
        };
        if self.conditioning.is_finite() {
            self.edges().map(distance).fold(f64::INFINITY, f64::min)
        } else {
            f64::NEG_INFINITY
        }
    }

    /// Distance to the outline.
    fn distance(&self, p: DVec2) -> f64 {
        let distance = |[a, b]: [DVec2; 2]| {
            let along = b - a;
            let squared = along.length_squared();
            let t = if squared > 0.0 {
                ((p - a).dot(along) / squared).clamp(0.0, 1.0)
            } else {
                0.0
            };
            (a + t * along).distance(p)
        };
        self.edges().map(distance).fold(f64::INFINITY, f64::min)
    }
}

/// Depth as a function of the place in pixels.
struct Plane {
    gradient: DVec2,
    constant: f64,
    slope: f64,
}

impl Plane {
    /// Of the plane of a triangle in clip space: z = αx + βy + γw there, so that z/w is affine in the place. `None` for one that is seen edge-on.
    fn of(triangle: &[Vertex; 3], half: DVec2, offset: DVec2) -> Option<Self> {
        let rows = triangle.map(|v| DVec3::new(v.clip[0], v.clip[1], v.clip[3]));
        let matrix = glam::DMat3::from_cols(rows[0], rows[1], rows[2]).transpose();
        let scale: f64 = rows.iter().map(|row| row.length()).product();
        if matrix.determinant().abs() <= 1e-12 * scale {
            return None;
        }
        let solved = matrix.inverse() * DVec3::from(triangle.map(|v| v.clip[2]));
        let gradient = solved.truncate() / half;
        Some(Self {
            gradient,
            constant: solved.z - gradient.dot(offset + half),
            slope: gradient.abs().element_sum(),
        })
    }

    fn at(&self, place: DVec2) -> f64 {
        self.gradient.dot(place) + self.constant
    }
}

/// Pixels of a picture whose answer is not legal.
pub fn illegal(oracle: &Oracle, seen: &[u32]) -> usize {
    let is_illegal = |(pixel, seen): &(usize, &u32)| !oracle.legal(*pixel).contains(seen);
    seen.iter().enumerate().filter(is_illegal).count()
}

/// How a picture of triangles' numbers compares with rays.
#[derive(Debug, Default, PartialEq)]
pub struct Tally {
    /// Pixels.
    pub pixels: usize,
    /// Pixels at which something is seen.
    pub covered: usize,
    /// Pixels where more than one answer is legal.
    pub open: usize,
    /// Differences where one of the two answers is within δ of an edge.
    pub at_edges: usize,
    /// Differences between triangles that both surely cover: equal depths.
    pub at_equal_depths: usize,
}

/// Compares a picture with rays; fails unless both are legal everywhere.
pub fn compare(what: &str, oracle: &Oracle, seen: &[u32], rays: &[u32]) -> Tally {
    let mut tally = Tally {
        pixels: seen.len(),
        ..Tally::default()
    };
    for (pixel, (seen, ray)) in seen.iter().zip(rays).enumerate() {
        let legal = oracle.legal(pixel);
        let place = [pixel as u32 % oracle.width, pixel as u32 / oracle.width];
        for (who, answer) in [("the picture", seen), ("the ray", ray)] {
            assert!(
                legal.contains(answer),
                "{what}, pixel {place:?}: {who} has {answer}, legal are {legal:?} of {:?}",
                oracle.pixels[pixel]
            );
        }
        tally.covered += usize::from(*seen != NO_HIT);
        tally.open += usize::from(legal.len() > 1);
        if seen != ray {
            if oracle.is_sure(pixel, *seen) && oracle.is_sure(pixel, *ray) {
                tally.at_equal_depths += 1;
            } else {
                tally.at_edges += 1;
            }
        }
    }
    println!("{what}: {tally:?}");
    tally
}
