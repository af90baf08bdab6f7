//! Every specular event, and chains of up to five, against finite differences of the traced path.

use super::test_surfaces::{KINDS, Kind, Reflect, Surface, surface, vector};
use super::*;
use crate::test_random::Random;

/// The reflected direction's derivative as the source prints it, with dz/dp in the place of one dw/dp.
fn reflect_as_printed(d: &Differentials, w: DVec3, n: DVec3, dn: [DVec3; 2]) -> Differentials {
    let reflected = |dw: DVec3, dz: DVec3, dn: DVec3| dw - 2.0 * (w.dot(n) * dn + (dz.dot(n) + w.dot(dn)) * n);
    Differentials {
        w1: reflected(d.w1, d.z1, dn[0]),
        w2: reflected(d.w2, d.z2, dn[1]),
        ..*d
    }
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
