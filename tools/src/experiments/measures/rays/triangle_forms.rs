//! Ways to test rays against triangles, their oracle, and rays and triangles to test.

use clerestory::accel::Ray;
use clerestory::accel::triangle::{TriangleHit, intersect_triangle, ray_shear};
use clerestory::accel::yardstick::{WaldTriangle, intersect_triangle_f64, moller_trumbore};
use glam::{DVec3, Vec3};

use crate::experiments::measures::errors::greatest;
use crate::experiments::measures::kd::hit_errors::Sheared;
use crate::experiments::measures::wide::{Wide, WideVec};
use crate::random::Random;

/// A ray and a triangle.
pub type Input = (Ray, [Vec3; 3]);
/// What a test says.
pub type Answer = Option<TriangleHit<f64>>;
/// A ray, and two triangles on both sides of an edge.
pub type Seam = (Ray, [[Vec3; 3]; 2]);

/// Where the ray meets the triangle's plane, and whether that is inside of the triangle; `None` of one that is seen edge-on.
pub fn exact_in_plane((ray, vertices): &Input) -> Option<(TriangleHit<f64>, bool)> {
    let [v0, v1, v2] = vertices.map(|v| v.as_dvec3());
    let direction = WideVec::from(Vec3::from(ray.direction).as_dvec3());
    let (e1, e2) = (WideVec::between(v1, v0), WideVec::between(v2, v0));
    let delta = WideVec::between(Vec3::from(ray.origin).as_dvec3(), v0);
    let (p, q) = (direction.cross(e2), delta.cross(e1));
    let det = e1.dot(p);
    if det == Wide::ZERO {
        return None;
    }
    let (t, u, v) = (e2.dot(q) / det, delta.dot(p) / det, direction.dot(q) / det);
    let zero = Wide::ZERO;
    let inside = u >= zero && v >= zero && u + v <= Wide::from(1.0) && t >= zero;
    let met = TriangleHit {
        t: t.round(),
        u: u.round(),
        v: v.round(),
    };
    Some((met, inside))
}

/// Whether and where they meet, by numbers of 106 bits.
pub fn exact(input: &Input) -> Answer {
    exact_in_plane(input).and_then(|(met, inside)| inside.then_some(met))
}

fn watertight((ray, vertices): &Input) -> Answer {
    let shear = ray_shear(ray.origin.into(), ray.direction.into());
    intersect_triangle(&shear, vertices, ray.t_min, ray.t_max).map(|hit| TriangleHit {
        t: hit.t.into(),
        u: hit.u.into(),
        v: hit.v.into(),
    })
}

/// The published test in f32, two-sided.
fn moller_trumbore_f32((ray, vertices): &Input) -> Answer {
    let [v0, v1, v2] = *vertices;
    let direction = Vec3::from(ray.direction);
    let (e1, e2) = (v1 - v0, v2 - v0);
    let delta = Vec3::from(ray.origin) - v0;
    let (p, q) = (direction.cross(e2), delta.cross(e1));
    let inverse = 1.0 / e1.dot(p);
    let (t, u, v) = (e2.dot(q) * inverse, delta.dot(p) * inverse, direction.dot(q) * inverse);
    (u >= 0.0 && v >= 0.0 && u + v <= 1.0 && t >= ray.t_min).then(|| TriangleHit {
        t: t.into(),
        u: u.into(),
        v: v.into(),
    })
}

fn wald((ray, vertices): &Input) -> Answer {
    WaldTriangle::new(vertices)?.intersect(ray).map(|hit| TriangleHit {
        t: hit.t.into(),
        u: hit.u.into(),
        v: hit.v.into(),
    })
}

fn watertight_f64((ray, vertices): &Input) -> Answer {
    intersect_triangle_f64(ray, vertices)
}

fn moller_trumbore_f64((ray, vertices): &Input) -> Answer {
    moller_trumbore(ray, vertices)
}

/// One way to test.
pub type Form = fn(&Input) -> Answer;

/// The kernels' test.
pub const KERNELS: &str = "watertight, f32 (kernels)";
/// The test on triangles that were made ready.
pub const WALD: &str = "Wald, f32, made ready";

/// All ways, by name.
pub const FORMS: [(&str, Form); 5] = [
    (KERNELS, watertight),
    ("Möller–Trumbore, f32", moller_trumbore_f32),
    (WALD, wald),
    ("watertight, f64 (oracle)", watertight_f64),
    ("Möller–Trumbore, f64 (oracle)", moller_trumbore_f64),
];

/// A kind of triangles and where rays to them begin.
pub struct Case {
    /// What it is called.
    pub name: &'static str,
    /// Length of the common edge, metres.
    size: f64,
    /// Height over base.
    aspect: f64,
    /// Distance of everything from the origin of coordinates, metres.
    away: f64,
    /// Distance of the ray's origin from the triangle, metres.
    distance: f64,
}

/// All kinds.
pub const CASES: [Case; 5] = [
    Case {
        name: "1 m, seen from 5 m",
        size: 1.0,
        aspect: 1.0,
        away: 0.0,
        distance: 5.0,
    },
    Case {
        name: "slivers of 1 m × 0.1 mm",
        size: 1.0,
        aspect: 1e-4,
        away: 0.0,
        distance: 5.0,
    },
    Case {
        name: "0.1 mm, seen from 1 m",
        size: 1e-4,
        aspect: 1.0,
        away: 0.0,
        distance: 1.0,
    },
    Case {
        name: "1 m, seen from 10 km",
        size: 1.0,
        aspect: 1.0,
        away: 0.0,
        distance: 1e4,
    },
    Case {
        name: "100 m, 1000 km from the origin",
        size: 100.0,
        aspect: 1.0,
        away: 1e6,
        distance: 500.0,
    },
];

impl Case {
    /// Two triangles with a common edge from the first to the second vertex, and the point of the edge's middle.
    fn pair(&self, random: &mut Random) -> [[Vec3; 3]; 2] {
        loop {
            let centre = random.direction() * self.away;
            let edge = random.direction();
            let height = edge.cross(random.direction()).normalize_or_zero() * self.aspect;
            let [a, b] = [-0.5, 0.5].map(|along| (centre + edge * (along * self.size)).as_vec3());
            let [c, d] = [1.0, -1.0].map(|side| {
                let along = random.range(-0.4, 0.4) * edge;
                (centre + (along + side * random.range(0.5, 1.0) * height) * self.size).as_vec3()
            });
            if height != DVec3::ZERO && a != b && a != c && b != c && a != d && b != d {
                return [[a, b, c], [b, a, d]];
            }
        }
    }

    fn towards(&self, random: &mut Random, target: DVec3) -> Ray {
        let origin = (target + random.direction() * self.distance).as_vec3();
        let direction = (target - origin.as_dvec3()).normalize().as_vec3();
        Ray::new(origin, direction)
    }
}

/// A point of weights (u, v).
fn point(vertices: &[Vec3; 3], u: f64, v: f64) -> DVec3 {
    let [a, b, c] = vertices.map(|v| v.as_dvec3());
    a + (b - a) * u + (c - a) * v
}

/// Whether the common edge, seen along the ray, lies between the two triangles: past a fold the ray may meet neither.
fn is_between(ray: &Ray, [[a, b, c], [_, _, d]]: &[[Vec3; 3]; 2]) -> bool {
    let from = |vertex: &Vec3| vertex.as_dvec3() - Vec3::from(ray.origin).as_dvec3();
    let plane = from(a).cross(from(b));
    plane.dot(from(c)) * plane.dot(from(d)) < 0.0
}

/// Whether a ray to the pair stays clear of its outer edges, seen along the ray, by more than what the kernels' test may round.
pub fn is_inside_of_outer_edges((ray, pair): &Seam) -> bool {
    let sheared = pair.map(|vertices| Sheared::new(ray, &vertices));
    let rounding = greatest(sheared.each_ref().map(Sheared::rounding));
    let mut outer = sheared.iter().flat_map(|triangle| {
        let [a, b, c] = triangle.corners.map(DVec3::truncate);
        [(b, c), (c, a)]
    });
    outer.all(|(from, to)| {
        let along = to - from;
        let nearest = (-from.dot(along) / along.length_squared()).clamp(0.0, 1.0);
        (from + along * nearest).length() > rounding
    })
}

/// Rays at and around single triangles, and rays at the common edges of pairs, of which the exact test meets one or both.
pub fn rays(case: &Case, count: u32) -> (Vec<Input>, Vec<Seam>) {
    let mut random = Random::new(2);
    let inputs = (0..count)
        .map(|_| {
            let [vertices, _] = case.pair(&mut random);
            let target = point(&vertices, random.range(-0.2, 0.8), random.range(-0.2, 0.8));
            (case.towards(&mut random, target), vertices)
        })
        .collect();
    let seams = (0..count)
        .map(|_| {
            let pair = case.pair(&mut random);
            let target = point(&pair[0], random.range(0.05, 0.95), 0.0);
            (case.towards(&mut random, target), pair)
        })
        .filter(|(ray, pair)| is_between(ray, pair) && pair.iter().any(|vertices| exact(&(*ray, *vertices)).is_some()))
        .collect();
    (inputs, seams)
}
