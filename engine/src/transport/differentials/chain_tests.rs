//! Every specular event, and chains of up to five, against finite differences of the traced path.

use super::*;
use crate::test_random::Random;

/// What a photon meets, placed where it meets it first.
#[derive(Clone, Copy)]
enum Shape {
    Plane {
        n: DVec3,
    },
    /// Normals away from the centre times the sign.
    Sphere {
        centre: DVec3,
        radius: f64,
        sign: f64,
    },
    /// A triangle with normals of its vertices; the plane goes on beyond it.
    Smooth {
        edges: [DVec3; 2],
        normals: [DVec3; 3],
    },
}

#[derive(Clone, Copy)]
struct Surface {
    shape: Shape,
    /// A point of it; of triangles the first vertex.
    point: DVec3,
    /// Index outside / inside; 0 for mirrors.
    eta: f64,
}

struct Met {
    position: DVec3,
    t: f64,
    geometric: DVec3,
    /// Of the surface, not turned to the photon.
    normal: DVec3,
    uv: DVec2,
}

impl Surface {
    /// The intersection nearest to the distance `near`.
    fn meet(&self, x: DVec3, w: DVec3, near: f64) -> Met {
        let planar = |n: DVec3| (self.point - x).dot(n) / w.dot(n);
        match self.shape {
            Shape::Plane { n } => {
                let t = planar(n);
                Met {
                    position: x + t * w,
                    t,
                    geometric: n,
                    normal: n,
                    uv: DVec2::ZERO,
                }
            }
            Shape::Sphere { centre, radius, sign } => {
                let along = (centre - x).dot(w);
                let half = (radius * radius - (centre - x - along * w).length_squared()).sqrt();
                let t = if (along - half - near).abs() < (along + half - near).abs() {
                    along - half
                } else {
                    along + half
                };
                let position = x + t * w;
                let n = sign * (position - centre) / radius;
                Met {
                    position,
                    t,
                    geometric: n,
                    normal: n,
                    uv: DVec2::ZERO,
                }
            }
            Shape::Smooth { edges, normals } => {
                let area = edges[0].cross(edges[1]);
                let t = planar(area);
                let position = x + t * w;
                let (offset, squared) = (position - self.point, area.length_squared());
                let uv = DVec2::new(
                    offset.cross(edges[1]).dot(area) / squared,
                    edges[0].cross(offset).dot(area) / squared,
                );
                let n = normals[0] + uv.x * (normals[1] - normals[0]) + uv.y * (normals[2] - normals[0]);
                Met {
                    position,
                    t,
                    geometric: area.normalize(),
                    normal: n.normalize(),
                    uv,
                }
            }
        }
    }

    fn normal_derivatives(&self, met: &Met, d: &Differentials) -> [DVec3; 2] {
        match self.shape {
            Shape::Plane { .. } => [DVec3::ZERO; 2],
            Shape::Sphere { radius, sign, .. } => [d.z1, d.z2].map(|z| sign * z / radius),
            Shape::Smooth { edges, normals } => normal_derivatives(edges, normals, met.uv, d),
        }
    }

    /// The direction afterwards and, where asked for, the differentials.
    fn scatter(&self, w: DVec3, met: &Met, d: &Differentials, reflect: Reflect) -> (DVec3, Differentials) {
        let facing = if met.normal.dot(w) < 0.0 { 1.0 } else { -1.0 };
        let n = facing * met.normal;
        let dn = self.normal_derivatives(met, d).map(|dn| facing * dn);
        let eta = if facing > 0.0 { self.eta } else { 1.0 / self.eta };
        let c = w.dot(n);
        let squared = 1.0 - eta * eta * (1.0 - c * c);
        if self.eta > 0.0 && squared > 0.0 {
            let out = eta * w - (eta * c + squared.sqrt()) * n;
            (out, refract_differentials(d, w, n, eta, dn))
        } else {
            (w - 2.0 * c * n, reflect(d, w, n, dn))
        }
    }
}

type Reflect = fn(&Differentials, DVec3, DVec3, [DVec3; 2]) -> Differentials;

/// The reflected direction's derivative as the source prints it, with dz/dp in the place of one dw/dp.
fn reflect_as_printed(d: &Differentials, w: DVec3, n: DVec3, dn: [DVec3; 2]) -> Differentials {
    let reflected = |dw: DVec3, dz: DVec3, dn: DVec3| dw - 2.0 * (w.dot(n) * dn + (dz.dot(n) + w.dot(dn)) * n);
    Differentials {
        w1: reflected(d.w1, d.z1, dn[0]),
        w2: reflected(d.w2, d.z2, dn[1]),
        ..*d
    }
}

fn vector(random: &mut Random) -> DVec3 {
    random.vector().as_dvec3()
}

#[derive(Clone, Copy, PartialEq)]
enum Kind {
    PlaneMirror,
    PlaneGlass,
    SphereMirror,
    SphereGlass,
    SmoothMirror,
    SmoothGlass,
}

const KINDS: [Kind; 6] = [
    Kind::PlaneMirror,
    Kind::PlaneGlass,
    Kind::SphereMirror,
    Kind::SphereGlass,
    Kind::SmoothMirror,
    Kind::SmoothGlass,
];

/// A surface that the ray meets at a distance, under at most 73 degrees.
fn surface(random: &mut Random, kind: Kind, x: DVec3, w: DVec3) -> (Surface, f64) {
    let t = f64::from(random.range(0.3, 2.0));
    let hit = x + t * w;
    let n = loop {
        let n = random.direction().as_dvec3().normalize();
        if n.dot(w).abs() > 0.3 {
            break n;
        }
    };
    let shape = match kind {
        Kind::PlaneMirror | Kind::PlaneGlass => Shape::Plane { n },
        Kind::SphereMirror | Kind::SphereGlass => {
            let radius = f64::from(random.range(0.5, 3.0));
            Shape::Sphere {
                centre: hit - radius * n,
                radius,
                sign: random.choose(&[1.0, -1.0]),
            }
        }
        Kind::SmoothMirror | Kind::SmoothGlass => {
            let (a, b) = orthonormal_basis(n);
            let turn = f64::from(random.range(0.0, 6.0));
            let edge = |angle: f64, length: f64| length * (angle.cos() * a + angle.sin() * b);
            let opening = f64::from(random.range(0.7, 2.0));
            let edges = [
                edge(turn, f64::from(random.range(0.5, 2.0))),
                edge(turn + opening, f64::from(random.range(0.5, 2.0))),
            ];
            // Not of unit length, as after transformations.
            let normals = [0.8, 1.0, 1.3].map(|l| l * (n + 0.3 * vector(random)).normalize());
            Shape::Smooth { edges, normals }
        }
    };
    let point = match shape {
        Shape::Smooth { edges, .. } => hit - 0.3 * edges[0] - 0.4 * edges[1],
        _ => hit,
    };
    let glass = matches!(kind, Kind::PlaneGlass | Kind::SphereGlass | Kind::SmoothGlass);
    let eta = if glass { f64::from(random.range(0.6, 0.9)) } else { 0.0 };
    (Surface { shape, point, eta }, t)
}

/// A path over surfaces that ends on the last one, and the photon's start.
struct Chain {
    surfaces: Vec<(Surface, f64)>,
    start: DVec3,
    direction: DVec3,
    differentials: Differentials,
}

impl Chain {
    /// Events of these kinds, each met by the ray of the one before, and a plane to end on; `None` where an event is ill-conditioned.
    fn new(random: &mut Random, kinds: &[Kind]) -> Option<Self> {
        let (start, direction) = (vector(random), random.direction().as_dvec3().normalize());
        let mut differentials = emission_differentials(direction, f64::from(random.range(0.05, 0.5)));
        (differentials.z1, differentials.z2) = (0.3 * vector(random), 0.3 * vector(random));
        let (mut x, mut w) = (start, direction);
        let mut surfaces = Vec::new();
        for kind in kinds {
            let (surface, t) = surface(random, *kind, x, w);
            let met = surface.meet(x, w, t);
            let out = surface
                .scatter(w, &met, &Differentials::default(), reflect_differentials)
                .0;
            // Near the critical angle the second derivative, and so the error of differences, is unbounded.
            if surface.eta > 0.0 && (out.dot(met.normal).abs() < 0.2 || (out.dot(met.normal) * w.dot(met.normal) < 0.0))
            {
                return None;
            }
            surfaces.push((surface, t));
            (x, w) = (met.position, out);
        }
        surfaces.push(surface(random, Kind::PlaneMirror, x, w));
        Some(Self {
            surfaces,
            start,
            direction,
            differentials,
        })
    }

    /// Where it ends for parameters away from the photon's.
    fn trace(&self, p: DVec2) -> [DVec3; 2] {
        let d = &self.differentials;
        let mut x = self.start + p.x * d.z1 + p.y * d.z2;
        let mut w = (self.direction + p.x * d.w1 + p.y * d.w2).normalize();
        let (last, events) = self.surfaces.split_last().unwrap();
        for (surface, t) in events {
            let met = surface.meet(x, w, *t);
            w = surface
                .scatter(w, &met, &Differentials::default(), reflect_differentials)
                .0;
            x = met.position;
        }
        [last.0.meet(x, w, last.1).position, w]
    }

    fn differentials(&self, reflect: Reflect) -> Differentials {
        let (mut x, mut w, mut d) = (self.start, self.direction, self.differentials);
        let (last, events) = self.surfaces.split_last().unwrap();
        for (surface, t) in events {
            let met = surface.meet(x, w, *t);
            d = transfer_differentials(&d, met.t, w, met.geometric);
            (w, d) = surface.scatter(w, &met, &d, reflect);
            x = met.position;
        }
        let met = last.0.meet(x, w, last.1);
        transfer_differentials(&d, met.t, w, met.geometric)
    }

    /// Largest error of the carried derivatives against differences of fourth order, relative to the derivative's length. Of three steps the
    /// one that suits the chain's curvature counts: a wrong derivative agrees with none.
    fn error(&self, reflect: Reflect) -> f64 {
        let d = self.differentials(reflect);
        let with_step = |h: f64| {
            let difference = |axis: DVec2| {
                let at = |s: f64| self.trace(s * h * axis);
                let (a, b) = ([at(1.0), at(-1.0)], [at(2.0), at(-2.0)]);
                [0, 1].map(|i| (8.0 * (a[0][i] - a[1][i]) - (b[0][i] - b[1][i])) / (12.0 * h))
            };
            let ([z1, w1], [z2, w2]) = (difference(DVec2::X), difference(DVec2::Y));
            [(d.z1, z1), (d.z2, z2), (d.w1, w1), (d.w2, w2)]
                .iter()
                .map(|(carried, difference)| (*carried - *difference).length() / difference.length())
                .fold(0.0, f64::max)
        };
        [2e-4, 2e-5, 2e-6]
            .map(with_step)
            .into_iter()
            .fold(f64::INFINITY, f64::min)
    }
}

/// Chains whose carried derivatives are compared, with the largest and the middle of their errors.
fn errors(seed: u64, count: usize, reflect: Reflect, kinds: impl Fn(&mut Random) -> Vec<Kind>) -> (f64, f64) {
    let mut random = Random(seed);
    let mut errors = Vec::new();
    while errors.len() < count {
        let kinds = kinds(&mut random);
        if let Some(chain) = Chain::new(&mut random, &kinds) {
            // Chains that spread a photon over hundreds of metres are as ill-conditioned for the differences.
            let d = chain.differentials(reflect_differentials);
            let sizes = [d.z1, d.z2, d.w1, d.w2].map(DVec3::length);
            if sizes.iter().all(|l| (0.01..100.0).contains(l)) {
                errors.push(chain.error(reflect));
            }
        }
    }
    errors.sort_by(f64::total_cmp);
    (errors[count - 1], errors[count / 2])
}

#[test]
fn each_event_agrees_with_finite_differences() {
    for (i, kind) in KINDS.iter().enumerate() {
        let (largest, middle) = errors(i as u64, 500, reflect_differentials, |_| vec![*kind]);
        println!("event {i}: {largest:.1e}, median {middle:.1e}");
        // The differences' own error is 1e-16/h of rounding, 5e-13 to 5e-11, and h⁴ times the fifth derivative.
        assert!(largest < 1e-8 && middle < 1e-10, "event {i}: {largest:e} {middle:e}");
    }
}

#[test]
fn chains_of_events_agree_with_finite_differences() {
    for length in 2..=5 {
        let (largest, middle) = errors(100 + length as u64, 500, reflect_differentials, |random| {
            (0..length).map(|_| random.choose(&KINDS)).collect()
        });
        println!("{length} events: {largest:.1e}, median {middle:.1e}");
        assert!(
            largest < 1e-4 && middle < 1e-9,
            "{length} events: {largest:e} {middle:e}"
        );
    }
}

#[test]
fn the_printed_reflection_is_wrong() {
    let printed = errors(7, 100, reflect_as_printed, |_| vec![Kind::SphereMirror]);
    assert!(printed.1 > 0.1, "median error {:e}", printed.1);
}

#[test]
fn derivatives_of_normals_agree_with_finite_differences() {
    let mut random = Random(3);
    let mut worst = 0.0f64;
    for _ in 0..3000 {
        let vertices = [vector(&mut random), vector(&mut random), vector(&mut random)];
        let edges = [vertices[1] - vertices[0], vertices[2] - vertices[0]];
        let normals = [0; 3].map(|_| vector(&mut random));
        let uv = DVec2::new(f64::from(random.unit()), f64::from(random.unit()));
        let n = |uv: DVec2| normals[0] + uv.x * (normals[1] - normals[0]) + uv.y * (normals[2] - normals[0]);
        if edges[0].cross(edges[1]).length() < 0.1 || n(uv).length() < 0.2 {
            continue;
        }
        // The derivatives by z of a vector in the plane, known by its coordinates.
        let c = [0; 2].map(|_| DVec2::new(f64::from(random.signed()), f64::from(random.signed())));
        let d = Differentials {
            z1: c[0].x * edges[0] + c[0].y * edges[1],
            z2: c[1].x * edges[0] + c[1].y * edges[1],
            ..Differentials::default()
        };
        let h = 1e-4;
        for (c, carried) in c.iter().zip(normal_derivatives(edges, normals, uv, &d)) {
            let at = |s: f64| n(uv + s * h * *c).normalize();
            let difference = (8.0 * (at(1.0) - at(-1.0)) - (at(2.0) - at(-2.0))) / (12.0 * h);
            worst = worst.max((difference - carried).length() / difference.length());
        }
    }
    println!("normals: {worst:.1e}");
    assert!(worst < 1e-8, "{worst:e}");
    // Opposed normals cancel half-way; triangles without area have no plane.
    let d = Differentials {
        z1: DVec3::X,
        ..Differentials::default()
    };
    let opposed = [DVec3::Z, -DVec3::Z, DVec3::Z];
    assert_eq!(
        normal_derivatives([DVec3::X, DVec3::Y], opposed, DVec2::new(0.5, 0.0), &d),
        [DVec3::ZERO; 2]
    );
    assert_eq!(
        normal_derivatives([DVec3::X, DVec3::X], [DVec3::Z, DVec3::X, DVec3::Y], DVec2::ZERO, &d),
        [DVec3::ZERO; 2]
    );
}
