//! Voronoi cells of points on a disc or a sphere, and the largest circles without points.
//!
//! Which cells border on each other is known from Delaunay's triangulation (crate `spade`, with exact predicates): on the disc that of the plane, on the sphere that of the other points as
//! seen from one of them on the plane opposite, which maps circles to circles, and those of its hull border on that one. A cell is the domain cut by the bisectors with these; its
//! area is that of polygons within a circle, or of spherical triangles. Points that lie where another one does have no cell.

use std::collections::BTreeSet;

use glam::{DVec2, DVec3};
use spade::{DelaunayTriangulation, HasPosition, Point2, Triangulation};

use super::lamp::Domain;

/// So few points are all next to each other.
const FEW: usize = 4;
/// Coordinates below that are none to the triangulation.
const COORDINATE_MIN: f64 = 1e-40;
/// Share of a gap's width by which a place at the rim that is too near to that comes inwards.
const THIRD: f64 = 1.0 / 3.0;

/// The part of a domain that is nearer to a point than to others.
#[derive(Debug, Clone, PartialEq)]
pub struct Cell {
    /// Of the domain's area.
    pub share: f64,
    /// Where it has corners, also with the rim of a disc, and on axes of a sphere.
    pub corners: Vec<DVec3>,
    /// Numbers of the points whose cells border on it, and of some that touch it.
    pub neighbours: Vec<usize>,
}

/// A circle within a domain that no point lies in.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Gap {
    /// Its middle.
    pub at: DVec3,
    /// Distance from there to the nearest point, and at most twice that to the rim, as if each point had an image beyond it.
    pub radius: f64,
}

/// A point of the triangulation.
struct Site {
    at: Point2<f64>,
    number: usize,
}

impl HasPosition for Site {
    type Scalar = f64;

    fn position(&self) -> Point2<f64> {
        self.at
    }
}

/// The cells of points of a domain; none for those that lie where an earlier one does.
pub fn voronoi_cells(domain: Domain, points: &[DVec3]) -> Vec<Option<Cell>> {
    let mut seen = BTreeSet::new();
    let is_new = |number: &usize| seen.insert((points[*number] + DVec3::ZERO).to_array().map(f64::to_bits));
    let distinct: Vec<usize> = (0..points.len()).filter(is_new).collect();
    let mut cells = vec![None; points.len()];
    for (number, neighbours) in bordering(domain, points, &distinct) {
        let others = neighbours.iter().map(|other| points[*other]);
        let (area, corners) = match domain {
            Domain::Disc => disc_cell(points[number], others),
            Domain::Sphere => sphere_cell(points[number], others),
        };
        cells[number] = Some(Cell {
            share: area / domain.area(),
            corners,
            neighbours,
        });
    }
    cells
}

/// Numbers of points, each with those that its cell borders on.
fn bordering(domain: Domain, points: &[DVec3], distinct: &[usize]) -> Vec<(usize, Vec<usize>)> {
    if distinct.len() <= FEW {
        let others = |number: usize| distinct.iter().copied().filter(|other| *other != number).collect();
        return distinct.iter().map(|number| (*number, others(*number))).collect();
    }
    match domain {
        Domain::Disc => of_triangulation(&triangulation(distinct, |number| points[number].truncate()), None),
        Domain::Sphere => {
            let pole = points[distinct[0]];
            let (right, up) = pole.any_orthonormal_pair();
            // Of unit vectors, half their squared distance is one minus their cosine, without its cancellation.
            let on_plane = |number: usize| {
                let point = points[number];
                DVec2::new(point.dot(right), point.dot(up)) / (0.5 * point.distance_squared(pole))
            };
            of_triangulation(&triangulation(&distinct[1..], on_plane), Some(distinct[0]))
        }
    }
}

fn triangulation(numbers: &[usize], at: impl Fn(usize) -> DVec2) -> DelaunayTriangulation<Site> {
    let mut all = DelaunayTriangulation::new();
    for number in numbers {
        let coordinate = |value: f64| if value.abs() < COORDINATE_MIN { 0.0 } else { value };
        let at = at(*number);
        let site = Site {
            at: Point2::new(coordinate(at.x), coordinate(at.y)),
            number: *number,
        };
        // What is no point has no cell.
        let _ = all.insert(site);
    }
    all
}

/// What borders on each other in a triangulation, and on a point that sees all of its hull.
fn of_triangulation(all: &DelaunayTriangulation<Site>, pole: Option<usize>) -> Vec<(usize, Vec<usize>)> {
    let hull: BTreeSet<usize> = match pole {
        Some(_) => all.convex_hull().map(|edge| edge.from().data().number).collect(),
        None => BTreeSet::new(),
    };
    let mut found: Vec<(usize, Vec<usize>)> = all
        .vertices()
        .map(|vertex| {
            let number = vertex.data().number;
            let mut near: Vec<usize> = vertex.out_edges().map(|edge| edge.to().data().number).collect();
            near.extend(pole.filter(|_| hull.contains(&number)));
            (number, near)
        })
        .collect();
    found.extend(pole.map(|pole| (pole, hull.into_iter().collect())));
    found
}

/// Cuts away what of a convex polygon lies below a plane; on a sphere its edges are great circles.
fn cut(polygon: &mut Vec<DVec3>, normal: DVec3, offset: f64, is_spherical: bool) {
    let height = |corner: DVec3| corner.dot(normal) - offset;
    let mut kept = Vec::with_capacity(polygon.len() + 1);
    for (i, a) in polygon.iter().enumerate() {
        let b = polygon[(i + 1) % polygon.len()];
        let (at_a, at_b) = (height(*a), height(b));
        if at_a >= 0.0 {
            kept.push(*a);
        }
        if at_a * at_b < 0.0 {
            let crossing = (*a * at_b.abs() + b * at_a.abs()) / (at_a.abs() + at_b.abs());
            kept.push(if is_spherical {
                crossing.normalize_or(*a)
            } else {
                crossing
            });
        }
    }
    *polygon = kept;
}

/// What of a polygon is nearer to a point than to the others.
fn cut_by_bisectors(polygon: &mut Vec<DVec3>, point: DVec3, others: impl Iterator<Item = DVec3>, is_spherical: bool) {
    for other in others {
        let offset = if is_spherical {
            0.0
        } else {
            0.5 * (point.length_squared() - other.length_squared())
        };
        cut(polygon, point - other, offset, is_spherical);
        if polygon.is_empty() {
            return;
        }
    }
}

fn disc_cell(point: DVec3, others: impl Iterator<Item = DVec3>) -> (f64, Vec<DVec3>) {
    let around = [(1.0, 1.0), (-1.0, 1.0), (-1.0, -1.0), (1.0, -1.0)];
    let mut polygon: Vec<DVec3> = around.map(|(x, y)| DVec3::new(x, y, 0.0)).to_vec();
    cut_by_bisectors(&mut polygon, point, others, false);
    let mut corners: Vec<DVec3> = polygon
        .iter()
        .copied()
        .filter(|corner| corner.length_squared() <= 1.0)
        .collect();
    let edges = (0..polygon.len()).map(|i| [polygon[i], polygon[(i + 1) % polygon.len()]]);
    let area = edges
        .map(|edge| area_within_disc(edge.map(DVec3::truncate), &mut corners))
        .sum();
    (area, corners)
}

/// Signed area of the unit disc between its middle and an edge, and where the edge goes in or out.
fn area_within_disc([a, b]: [DVec2; 2], crossings: &mut Vec<DVec3>) -> f64 {
    let along = b - a;
    let sector = |from: DVec2, to: DVec2| 0.5 * from.perp_dot(to).atan2(from.dot(to));
    let (squared, middle) = (along.length_squared(), a.dot(along));
    let root = middle * middle - squared * (a.length_squared() - 1.0);
    let is_met = root > 0.0 && squared > 0.0;
    if !is_met {
        return sector(a, b);
    }
    let (enters, leaves) = ((-middle - root.sqrt()) / squared, (-middle + root.sqrt()) / squared);
    if leaves <= 0.0 || enters >= 1.0 {
        return sector(a, b);
    }
    let (first, last) = (a + enters.max(0.0) * along, a + leaves.min(1.0) * along);
    if enters > 0.0 {
        crossings.push(first.extend(0.0));
    }
    if leaves < 1.0 {
        crossings.push(last.extend(0.0));
    }
    let before = if enters > 0.0 { sector(a, first) } else { 0.0 };
    let behind = if leaves < 1.0 { sector(last, b) } else { 0.0 };
    before + 0.5 * first.perp_dot(last) + behind
}

/// By octants, in which polygons are far from half of the sphere, however few points there are.
fn sphere_cell(point: DVec3, others: impl Iterator<Item = DVec3> + Clone) -> (f64, Vec<DVec3>) {
    let (mut area, mut corners) = (0.0, Vec::new());
    for octant in 0..8 {
        let side = |axis: u32| if (octant >> axis) & 1 == 0 { 1.0 } else { -1.0 };
        let [x, y, z] = [0, 1, 2].map(side);
        let mut polygon = vec![DVec3::X * x, DVec3::Y * y, DVec3::Z * z];
        if x * y * z < 0.0 {
            polygon.swap(1, 2);
        }
        cut_by_bisectors(&mut polygon, point, others.clone(), true);
        for pair in polygon.windows(2).skip(1) {
            area += solid_angle(polygon[0], pair[0], pair[1]);
        }
        corners.extend(polygon);
    }
    (area, corners)
}

/// Of the triangle that unit vectors span (A. Van Oosterom and J. Strackee, 1983).
fn solid_angle(a: DVec3, b: DVec3, c: DVec3) -> f64 {
    2.0 * a.dot(b.cross(c)).atan2(1.0 + a.dot(b) + b.dot(c) + c.dot(a))
}

/// The widest gap between points, by their cells.
pub fn widest_gap(domain: Domain, points: &[DVec3], cells: &[Option<Cell>]) -> Gap {
    let (middle, on_axes): (DVec3, &[DVec3]) = match domain {
        Domain::Disc => (DVec3::ZERO, &[DVec3::X, DVec3::Y, DVec3::NEG_X, DVec3::NEG_Y]),
        Domain::Sphere => (DVec3::Z, &[]),
    };
    let nearest = |at: DVec3| {
        let distances = points.iter().map(|point| point.distance_squared(at));
        distances.fold(f64::INFINITY, f64::min).sqrt()
    };
    let corners = points.iter().zip(cells).flat_map(|(point, cell)| {
        let corners = cell.iter().flat_map(|cell| &cell.corners);
        corners.map(move |corner| (*corner, corner.distance(*point)))
    });
    let mut widest = Gap {
        at: middle,
        radius: nearest(middle),
    };
    for (at, radius) in corners.chain(on_axes.iter().map(|at| (*at, nearest(*at)))) {
        if radius <= widest.radius {
            continue;
        }
        let gap = match domain {
            Domain::Disc => within_disc(at, radius, nearest),
            Domain::Sphere => Gap { at, radius },
        };
        if gap.radius > widest.radius {
            widest = gap;
        }
    }
    widest
}

/// The gap about a place of the disc that is so far from the nearest point; where that place is too near to the rim, about one as far from the point as from the point's image, or
/// farther.
fn within_disc(at: DVec3, radius: f64, nearest: impl Fn(DVec3) -> f64) -> Gap {
    let excess = radius - 2.0 * (1.0 - at.length());
    if excess <= 0.0 {
        return Gap { at, radius };
    }
    let at = at * (1.0 - THIRD * excess / at.length());
    let radius = nearest(at).min(2.0 * (1.0 - at.length()));
    Gap { at, radius }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_random::Random;
    use std::f64::consts::TAU;

    const DOMAINS: [Domain; 2] = [Domain::Disc, Domain::Sphere];

    /// Even over a domain, or crowded about one place of it.
    fn points(domain: Domain, count: usize, crowded: bool, random: &mut Random) -> Vec<DVec3> {
        let mut unit = || f64::from(random.unit());
        let mut point = || {
            let (angle, height) = (TAU * unit(), unit());
            let across = DVec3::new(angle.cos(), angle.sin(), 0.0);
            let even = match domain {
                Domain::Disc => height.sqrt() * across,
                Domain::Sphere => {
                    let z = 2.0 * height - 1.0;
                    ((1.0 - z * z).max(0.0).sqrt() * across + z * DVec3::Z).normalize()
                }
            };
            match (crowded, domain) {
                (false, _) => even,
                (true, Domain::Disc) => 0.01 * even + DVec3::new(0.6, 0.3, 0.0),
                (true, Domain::Sphere) => (0.01 * even + DVec3::new(0.48, 0.6, 0.64)).normalize(),
            }
        };
        (0..count).map(|_| point()).collect()
    }

    fn shares(cells: &[Option<Cell>]) -> Vec<f64> {
        cells.iter().flatten().map(|cell| cell.share).collect()
    }

    /// Delaunay's condition: no point is nearer to a corner of a cell than the cell's own, in 10,000 sets of all sizes; and cells fill the domain.
    #[test]
    fn circles_about_corners_are_empty_and_cells_fill_the_domain() {
        let mut random = Random(8);
        for number in 0..10_000 {
            let domain = DOMAINS[number % 2];
            let count = 1 + random.below(if number % 100 < 2 { 200 } else { 20 });
            let points = points(domain, count, number % 7 == 0, &mut random);
            let cells = voronoi_cells(domain, &points);
            let sum: f64 = shares(&cells).iter().sum();
            assert!((sum - 1.0).abs() < 1e-9, "{domain:?}, {count} points: {sum}");
            for (i, cell) in cells.iter().enumerate() {
                let Some(cell) = cell else { continue };
                assert!(cell.share > -1e-12);
                for corner in &cell.corners {
                    let own = corner.distance(points[i]);
                    let least = points.iter().map(|point| point.distance(*corner)).fold(4.0, f64::min);
                    assert!(least > own - 1e-9, "{domain:?}, {count} points: {least} {own}");
                }
            }
        }
    }

    /// Of what lies on one circle, in one place or on a grid, where triangulations are not unique.
    #[test]
    fn degenerate_sets_have_their_cells() {
        let on_circle = |count: u32, axis: fn(f64, f64) -> DVec3| -> Vec<DVec3> {
            let angle = |i: u32| TAU * f64::from(i) / f64::from(count);
            (0..count).map(|i| axis(angle(i).cos(), angle(i).sin())).collect()
        };
        for count in [1, 2, 3, 4, 5, 8, 64] {
            let expected = 1.0 / f64::from(count);
            let equator = on_circle(count, |x, y| DVec3::new(x, y, 0.0));
            let meridian = on_circle(count, |x, y| DVec3::new(x, 0.0, y));
            let ring: Vec<DVec3> = equator.iter().map(|point| 0.5 * *point).collect();
            for (domain, points) in [
                (Domain::Sphere, &equator),
                (Domain::Sphere, &meridian),
                (Domain::Disc, &ring),
                (Domain::Disc, &equator),
            ] {
                for share in shares(&voronoi_cells(domain, points)) {
                    assert!((share - expected).abs() < 1e-9, "{domain:?}, {count}: {share}");
                }
            }
        }
        let axes = [DVec3::X, DVec3::Y, DVec3::Z];
        let octahedron: Vec<DVec3> = axes.iter().flat_map(|axis| [*axis, -*axis]).collect();
        for share in shares(&voronoi_cells(Domain::Sphere, &octahedron)) {
            assert!((share - 1.0 / 6.0).abs() < 1e-12, "{share}");
        }
        let twice = [DVec3::X, DVec3::NEG_X, DVec3::X, DVec3::NEG_X];
        let cells = voronoi_cells(Domain::Sphere, &twice);
        assert!(cells[2].is_none() && cells[3].is_none());
        assert_eq!(shares(&cells).len(), 2);
        assert!(voronoi_cells(Domain::Disc, &[]).is_empty());
    }

    /// The triangulation leaves out only what does not matter: cells that are cut by the bisectors with all other points are the same.
    #[test]
    fn neighbours_are_all_that_a_cell_needs() {
        let mut random = Random(5);
        for domain in DOMAINS {
            for crowded in [false, true] {
                let points = points(domain, 150, crowded, &mut random);
                for (i, cell) in voronoi_cells(domain, &points).iter().enumerate() {
                    let others = points
                        .iter()
                        .enumerate()
                        .filter(|(j, _)| *j != i)
                        .map(|(_, point)| *point);
                    let (area, _) = match domain {
                        Domain::Disc => disc_cell(points[i], others),
                        Domain::Sphere => sphere_cell(points[i], others),
                    };
                    let share = cell.as_ref().map_or(0.0, |cell| cell.share);
                    assert!(
                        (share - area / domain.area()).abs() < 1e-12,
                        "{domain:?}: {share} {area}"
                    );
                }
            }
        }
    }

    #[test]
    fn gaps_are_where_no_point_is() {
        let mut random = Random(6);
        for domain in DOMAINS {
            // An image beyond the rim is twice as far as the rim.
            let free = |at: DVec3, points: &[DVec3]| {
                let rim = match domain {
                    Domain::Disc => 2.0 * (1.0 - at.length()),
                    Domain::Sphere => f64::INFINITY,
                };
                points.iter().map(|point| point.distance(at)).fold(rim, f64::min)
            };
            for count in [0, 1, 2, 3, 5, 40, 200] {
                let some = points(domain, count, false, &mut random);
                let gap = widest_gap(domain, &some, &voronoi_cells(domain, &some));
                let found = free(gap.at, &some);
                assert!(
                    count == 0 || (found - gap.radius).abs() < 1e-9,
                    "{domain:?}, {count}: {gap:?} {found}"
                );
                // As wide as that of any other place, but for what lies between the places that are looked at near the rim.
                let tried = points(domain, 2000, false, &mut random);
                let most = tried.iter().map(|at| free(*at, &some)).fold(0.0, f64::max);
                assert!(
                    count == 0 || gap.radius > 0.8 * most,
                    "{domain:?}, {count}: {gap:?} {most}"
                );
            }
        }
    }
}
