//! Ray against triangle: the watertight test of the kernels, Möller–Trumbore's and Wald's, in f32, and the first two as oracles in f64.
//!
//! Oracle of all of them: Möller–Trumbore's in numbers of 106 bits.

use clerestory::Result;
use clerestory::accel::Ray;
use clerestory::accel::triangle::wald::WaldTriangle;
use clerestory::accel::triangle::{
    TriangleHit, intersect_triangle, intersect_triangle_f64, moller_trumbore, ray_shear,
};
use glam::{DVec3, Vec3};

use crate::experiments::findings::{Bound, Criterion, Findings, Repeats, Study, rows, total};
use crate::experiments::measures::Context;
use crate::experiments::measures::clock::nanoseconds_once;
use crate::experiments::measures::errors::{Errors, greatest};
use crate::experiments::measures::kd::hit_errors::Sheared;
use crate::experiments::measures::wide::{Wide, WideVec};
use crate::random::Random;

/// The unit of relative errors, half a step of f32.
const UNIT: f64 = 1.0 / 16_777_216.0;

type Input = (Ray, [Vec3; 3]);
type Answer = Option<TriangleHit<f64>>;
/// A ray, and two triangles on both sides of an edge.
type Seam = (Ray, [[Vec3; 3]; 2]);

/// Where the ray meets the triangle's plane, and whether that is inside of the triangle; `None` of one that is seen edge-on.
fn exact_in_plane((ray, vertices): &Input) -> Option<(TriangleHit<f64>, bool)> {
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

fn exact(input: &Input) -> Answer {
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
type Form = fn(&Input) -> Answer;

const KERNELS: &str = "watertight, f32 (kernels)";
const WALD: &str = "Wald, f32, made ready";

const FORMS: [(&str, Form); 5] = [
    (KERNELS, watertight),
    ("Möller–Trumbore, f32", moller_trumbore_f32),
    (WALD, wald),
    ("watertight, f64 (oracle)", watertight_f64),
    ("Möller–Trumbore, f64 (oracle)", moller_trumbore_f64),
];

/// A kind of triangles and where rays to them begin.
struct Case {
    name: &'static str,
    size: f64,
    /// Height over base.
    aspect: f64,
    /// Distance of everything from the origin of coordinates, metres.
    away: f64,
    /// Distance of the ray's origin from the triangle, metres.
    distance: f64,
}

const CASES: [Case; 5] = [
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
        Ray {
            origin: origin.into(),
            t_min: 0.0,
            direction: direction.into(),
            t_max: f32::INFINITY,
        }
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
fn is_inside_of_outer_edges((ray, pair): &Seam) -> bool {
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
fn rays(case: &Case, count: u32) -> (Vec<Input>, Vec<Seam>) {
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

rows! {
    /// A form of the test on a case.
    struct Row = "Ray against triangle" by [case, form] {
        case: String = "case",
        form: String = "form",
        t_median: f64 = "t: median relative error (2⁻²⁴)",
        t_most: f64 = "t: 99.9 % (2⁻²⁴)",
        t_worst: f64 = "t: worst (2⁻²⁴)",
        t_of_bound: f64 = "t: greatest share of its bound",
        weights_most: f64 = "weights: 99.9 % error",
        weights_worst: f64 = "weights: worst error",
        missed: u64 = "missed hits",
        false_hits: u64 = "false hits",
        rays: u64 = "rays",
        lost: u64 = "lost between two triangles",
        seams: u64 = "rays at common edges",
        lost_past: u64 = "lost past outer edges",
        outer: u64 = "rays at common and outer edges",
        time: Repeats = "a test (ns)",
    }
}
/// What was found.
pub type Found = Vec<Row>;

const CRITERIA: &[Criterion<Row>] = &[
    Criterion::each("no ray is lost between neighbours", Bound::AtMost(0.0), |row: &Row| {
        row.lost.into()
    })
    .among(Row::is_the_kernels)
    .in_every_form(),
    Criterion::each(
        "the ray's parameter errs by no more than its bound",
        Bound::AtMost(1.0),
        |row: &Row| row.t_of_bound.into(),
    )
    .among(Row::is_the_kernels)
    .because(
        "a few units of rounding of the reach, and of its slopes: what `clerestory::accel::triangle` and its derivation at `BOX_SLACK` state for \
         every ray",
    )
    .in_every_form(),
];

impl Row {
    fn is_the_kernels(&self) -> bool {
        self.form == KERNELS
    }

    fn of(case: &Case, (form, test): (&str, Form), inputs: &[Input], seams: &[Seam], time: Vec<f64>) -> Self {
        let (mut parameters, mut weights, mut shares) = (Errors::default(), Errors::default(), Errors::default());
        let (mut missed, mut false_hits) = (0, 0);
        for input in inputs {
            let (in_plane, found) = (exact_in_plane(input), test(input));
            if let (Some((expected, _)), Some(found)) = (in_plane, found) {
                shares.add((found.t - expected.t) / Sheared::new(&input.0, &input.1).plane().1);
            }
            match (in_plane.filter(|(_, inside)| *inside), found) {
                (Some((expected, _)), Some(found)) => {
                    parameters.add((found.t / expected.t - 1.0) / UNIT);
                    weights.add(greatest([found.u - expected.u, found.v - expected.v].map(f64::abs)));
                }
                (Some(_), None) => missed += 1,
                (None, Some(_)) => false_hits += 1,
                (None, None) => {}
            }
        }
        let (inside, outer): (Vec<&Seam>, Vec<&Seam>) = seams.iter().partition(|seam| is_inside_of_outer_edges(seam));
        let is_lost = |(ray, pair): &Seam| pair.iter().all(|vertices| test(&(*ray, *vertices)).is_none());
        let lost = |seams: &[&Seam]| seams.iter().filter(|seam| is_lost(seam)).count() as u64;
        Self {
            case: case.name.into(),
            form: form.into(),
            t_median: parameters.quantile(0.5),
            t_most: parameters.quantile(0.999),
            t_worst: parameters.worst(),
            t_of_bound: shares.worst(),
            weights_most: weights.quantile(0.999),
            weights_worst: weights.worst(),
            missed,
            false_hits,
            rays: inputs.len() as u64,
            lost: lost(&inside),
            seams: inside.len() as u64,
            lost_past: lost(&outer),
            outer: outer.len() as u64,
            time: Repeats(time),
        }
    }
}

impl Study for Found {
    fn measure(context: &Context<'_>) -> Result<Self> {
        let count = context.pick(100_000, 500);
        context.each(
            &CASES,
            |case| case.name.to_owned(),
            |case| {
                let (inputs, seams) = rays(case, count);
                let ready = |(ray, vertices): &Input| Some((*ray, WaldTriangle::new(vertices)?));
                let ready: Vec<(Ray, WaldTriangle)> = inputs.iter().filter_map(ready).collect();
                let times = context.in_turns(9, FORMS.len(), |i| {
                    Ok(match FORMS[i] {
                        (WALD, _) => nanoseconds_once(&ready, |(ray, triangle)| triangle.intersect(ray)),
                        (_, test) => nanoseconds_once(&inputs, test),
                    })
                })?;
                let forms = FORMS.into_iter().zip(times);
                Ok(forms
                    .map(|(form, time)| Row::of(case, form, &inputs, &seams, time))
                    .collect())
            },
        )
    }

    fn findings(&self) -> Findings {
        Findings::of(self, CRITERIA)
            .headline(
                "rays that the kernels' test loses between neighbours",
                total(self, Row::is_the_kernels, |row| row.lost),
            )
            .note(
                "Errors against Möller–Trumbore's test in numbers of 106 bits, on the same f32 input. Rays are aimed at and around each \
                 triangle; rays at common edges at pairs with one triangle on each side, as the ray sees them, of which the exact test meets \
                 one or both: lost are those that meet neither. Rays that pass an outer edge too, within what the kernels' test rounds at \
                 most, may be lost past it; they are counted by themselves. The bound of t is the watertight test's, for hits of every form: \
                 18uM/|d| + 16uM·s with u = 2⁻²⁴, M the largest coordinate distance of a vertex from the ray's origin, |d| the direction's \
                 largest component and s the sizes of both slopes of the plane. The watertight test counts a zero as inside for both triangles of an edge: what it adds by that shows as false \
                 hits. Tests on one thread, the ray's shear computed anew for each, which kernels compute once a ray; Wald's test is timed on \
                 triangles that were made ready, of which it reads 36 bytes and an axis, and it ends at the plane unless that lies in the \
                 ray's range.",
            )
    }
}
