//! Ways to test rays against spheres, their oracle, and rays and spheres to test.

use clerestory::accel::sphere::{closest_approach, intersect_sphere};
use glam::{DVec3, Vec3};

use crate::experiments::measures::wide::{Wide, WideVec};
use crate::random::Random;

/// A ray and a sphere; all numbers are representable in f32 for the forms in f32.
pub struct Input {
    /// Of the ray.
    pub origin: DVec3,
    /// Of the ray, of about unit length.
    pub direction: DVec3,
    /// Of the sphere.
    pub centre: DVec3,
    /// Of the sphere.
    pub radius: f64,
}

/// Distance at the closest approach and, for a hit, the parameter of the entry.
pub type Answer = (f64, Option<f64>);
/// One way to compute them.
pub type Form = fn(&Input) -> Answer;

/// By numbers of 106 bits.
pub fn exact(input: &Input) -> Answer {
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
pub fn input(random: &mut Random, away: [f64; 2], near: [f64; 2]) -> Input {
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

/// A form with its name, and half a step of its numbers.
pub struct Kind {
    /// What it is called.
    pub name: &'static str,
    /// The form.
    pub compute: Form,
    /// Half a step.
    pub unit: f64,
}

const UNIT_F32: f64 = 0.5 * f32::EPSILON as f64;
/// Half a step of f64 beside 1.
pub const UNIT_F64: f64 = 0.5 * f64::EPSILON;
/// The kernels' form.
pub const ENGINES: &str = "engine, f32";

/// The engine's and the textbook's, of either kind of numbers.
pub const PAIRS: [[Kind; 2]; 2] = [
    [
        Kind {
            name: ENGINES,
            compute: engine_f32,
            unit: UNIT_F32,
        },
        Kind {
            name: "textbook, f32",
            compute: textbook_f32,
            unit: UNIT_F32,
        },
    ],
    [
        Kind {
            name: "engine, f64",
            compute: engine_f64,
            unit: UNIT_F64,
        },
        Kind {
            name: "textbook, f64",
            compute: textbook_f64,
            unit: UNIT_F64,
        },
    ],
];
