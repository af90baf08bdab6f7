//! Ray against sphere: the engine's closest approach and hit, in f64 and with the kernels' operations in f32, beside the textbook's
//! quadratic equation.
//!
//! Oracle: the same ray in numbers of 106 bits, its direction's length included.

use clerestory::Result;
use clerestory::accel::sphere::{closest_approach, intersect_sphere};
use glam::{DVec3, Vec3};

use crate::experiments::measures::Context;
use crate::experiments::measures::clock::nanoseconds;
use crate::experiments::measures::errors::Errors;
use crate::experiments::measures::wide::{Wide, WideVec};
use crate::experiments::table::Table;
use crate::random::Random;

/// A ray and a sphere; all numbers are representable in f32 for the forms in f32.
struct Input {
    origin: DVec3,
    direction: DVec3,
    centre: DVec3,
    radius: f64,
}

/// Distance at the closest approach and, for a hit, the parameter of the entry.
type Answer = (f64, Option<f64>);
/// One way to compute them.
type Form = fn(&Input) -> Answer;

fn exact(input: &Input) -> Answer {
    let delta = WideVec::between(input.centre, input.origin);
    let d = WideVec::from(input.direction);
    let length = d.dot(d).sqrt();
    let cross = delta.cross(d);
    let distance = cross.dot(cross).sqrt() / length;
    let r = Wide::from(input.radius);
    let chord = (r - distance) * (r + distance);
    let entry = (chord >= Wide::ZERO).then(|| (delta.dot(d) / length - chord.sqrt()) / length);
    (distance.round(), entry.map(Wide::round))
}

fn engine_f64(i: &Input) -> Answer {
    let approach = closest_approach(i.origin, i.direction, i.centre);
    let hit = intersect_sphere(i.origin, i.direction, i.centre, i.radius);
    (approach.distance_squared.sqrt(), hit.map(|[entry, _]| entry))
}

fn textbook_f64(i: &Input) -> Answer {
    let l = i.origin - i.centre;
    let (b, l2) = (l.dot(i.direction), l.length_squared());
    let discriminant = b * b - (l2 - i.radius * i.radius);
    (
        (l2 - b * b).max(0.0).sqrt(),
        (discriminant >= 0.0).then(|| -b - discriminant.sqrt()),
    )
}

/// The operations of `accel/sphere.glsl`.
fn engine_f32(i: &Input) -> Answer {
    let (origin, d, centre, r) = single(i);
    let delta = centre - origin;
    let t = delta.dot(d);
    let distance = (delta - t * d).length_squared().sqrt();
    let chord = (r - distance) * (r + distance);
    (distance.into(), (chord >= 0.0).then(|| f64::from(t - chord.sqrt())))
}

fn textbook_f32(i: &Input) -> Answer {
    let (origin, d, centre, r) = single(i);
    let l = origin - centre;
    let (b, l2) = (l.dot(d), l.length_squared());
    let discriminant = b * b - (l2 - r * r);
    (
        (l2 - b * b).max(0.0).sqrt().into(),
        (discriminant >= 0.0).then(|| f64::from(-b - discriminant.sqrt())),
    )
}

fn single(i: &Input) -> (Vec3, Vec3, Vec3, f32) {
    (
        i.origin.as_vec3(),
        i.direction.as_vec3(),
        i.centre.as_vec3(),
        i.radius as f32,
    )
}

/// A sphere whose centre is `away` radii off, passed at `near` radii from its centre.
fn input(random: &mut Random, away: [f64; 2], near: [f64; 2]) -> Input {
    let radius = random.magnitude(0.1, 10.0) as f32 as f64;
    let direction = random.direction();
    let side = direction
        .cross(random.direction())
        .normalize_or(direction.any_orthonormal_vector());
    let origin = (random.vector() * 10.0).as_vec3().as_dvec3();
    let centre = origin
        + direction * (radius * random.magnitude(away[0], away[1]))
        + side * (radius * random.range(near[0], near[1]));
    Input {
        origin,
        direction: direction.as_vec3().as_dvec3(),
        centre: centre.as_vec3().as_dvec3(),
        radius,
    }
}

/// The measure.
pub fn measure(context: &Context<'_>) -> Result<Vec<Table>> {
    let count = if context.smoke { 500 } else { 100_000 };
    let mut table = Table::new(
        "Ray against sphere",
        &[
            "case",
            "form",
            "closest distance: worst error (radii)",
            "entry: median error (radii)",
            "entry: 99.9 % error (radii)",
            "entry: worst error (radii)",
            "wrong verdicts",
            "rays",
            "ns a ray",
        ],
    );
    let forms: [(&str, Form); 4] = [
        ("engine, f32", engine_f32),
        ("textbook, f32", textbook_f32),
        ("engine, f64", engine_f64),
        ("textbook, f64", textbook_f64),
    ];
    for (case, away, near) in [
        ("2 to 10 radii away", [2.0, 10.0], [0.0, 1.25]),
        ("2 to 10 radii away, nearly tangent", [2.0, 10.0], [0.9999, 1.0001]),
        ("10⁴ radii away", [1e4, 1.01e4], [0.0, 1.25]),
        ("10⁶ radii away", [1e6, 1.01e6], [0.0, 1.25]),
    ] {
        let mut random = Random::new(1);
        let inputs: Vec<Input> = (0..count).map(|_| input(&mut random, away, near)).collect();
        for (form, function) in forms {
            let (mut distances, mut entries, mut wrong) = (Errors::default(), Errors::default(), 0_u64);
            for input in &inputs {
                // Forms in f64 need a direction of unit length in f64.
                let input = &if form.ends_with("f64") {
                    Input {
                        direction: input.direction.normalize(),
                        ..*input
                    }
                } else {
                    Input { ..*input }
                };
                let (expected, found) = (exact(input), function(input));
                distances.add((found.0 - expected.0) / input.radius);
                match (expected.1, found.1) {
                    (Some(expected), Some(found)) => entries.add((found - expected) / input.radius),
                    (None, None) => {}
                    _ => wrong += 1,
                }
            }
            table.row([
                case.into(),
                form.into(),
                distances.worst().into(),
                entries.quantile(0.5).into(),
                entries.quantile(0.999).into(),
                entries.worst().into(),
                wrong.into(),
                (inputs.len() as u64).into(),
                nanoseconds(context.smoke, &inputs, function).into(),
            ]);
        }
    }
    table.note(
        "Errors against the same ray in numbers of 106 bits. A wrong verdict is a hit where there is none, or none where there is one. Radii are \
         0.1 to 10 m. The engine's form takes the distance from what projection leaves over, the textbook's from a difference of squares. \
         Kernels run the operations of the form in f32; speeds include the closest approach, on one thread of the processor.",
    );
    Ok(vec![table])
}
