//! Origins of rays that leave a surface: does the ray meet its own surface again, does it begin behind a wall close by?
//!
//! Peers: fixed distances along the normal. Oracle: the engine's ray/triangle test itself, against the triangle, a coplanar neighbour ten
//! thousand times its size, and the plane of the wall in f64.

use clerestory::Result;
use clerestory::accel::offset::{offset_ray_origin, scene_reach, surface_point};
use clerestory::accel::triangle::{intersect_triangle, ray_shear};
use glam::Vec3;

use crate::experiments::findings::{Bound, Criterion, Findings, Repeats, Study, rows, total};
use crate::experiments::measures::Context;
use crate::experiments::measures::clock::nanoseconds_once;
use crate::experiments::measures::errors::Errors;
use crate::random::Random;

/// Distance of the wall over the size of the triangle.
const GAP: f64 = 0.01;
/// Sides of the neighbour over those of the triangle.
const NEIGHBOUR: f32 = 100.0;

struct Input {
    triangle: [Vec3; 3],
    neighbour: [Vec3; 3],
    weights: [f32; 2],
    normal: Vec3,
    direction: Vec3,
}

#[derive(Clone, Copy)]
enum Form {
    Engine,
    Fixed(f32),
}

fn start(form: Form, input: &Input) -> Vec3 {
    let [lower, upper] = [Vec3::min, Vec3::max].map(|pick| {
        let all = input.triangle.iter().chain(&input.neighbour).copied();
        all.reduce(pick).unwrap_or_default()
    });
    match form {
        Form::Engine => {
            let on_it = surface_point(&input.triangle, input.weights, 0.0).position;
            let point = surface_point(&input.triangle, input.weights, scene_reach(on_it, lower, upper));
            offset_ray_origin(point.position, point.error, input.normal, input.direction)
        }
        Form::Fixed(distance) => {
            let position = surface_point(&input.triangle, input.weights, 0.0).position;
            let side = if input.normal.dot(input.direction) < 0.0 {
                -1.0
            } else {
                1.0
            };
            position + input.normal * (side * distance)
        }
    }
}

fn input(random: &mut Random, size: f64, away: f64) -> Input {
    loop {
        let centre = random.direction() * away;
        let triangle = [0; 3].map(|_| (centre + random.vector() * size).as_vec3());
        let [a, b, c] = triangle;
        let area = (b - a).as_dvec3().cross((c - a).as_dvec3());
        if area.length() < 0.05 * size * size {
            continue;
        }
        let neighbour = [a, a + (b - a) * -NEIGHBOUR, a + (c - a) * NEIGHBOUR];
        let (u, v) = (random.unit() as f32, random.unit() as f32);
        let weights = if u + v > 1.0 { [1.0 - u, 1.0 - v] } else { [u, v] };
        let normal = area.normalize().as_vec3();
        let free = random.direction().as_vec3();
        // Half of the rays graze.
        let lift = if random.unit() < 0.5 {
            random.magnitude(1e-4, 1.0)
        } else {
            1.0
        };
        let direction = (free - normal * free.dot(normal)) + normal * (free.dot(normal).abs() * lift as f32);
        return Input {
            triangle,
            neighbour,
            weights,
            normal,
            direction,
        };
    }
}

const ENGINES: &str = "by error bounds (engine)";

const FORMS: [(&str, Form); 4] = [
    (ENGINES, Form::Engine),
    ("1e-3 m", Form::Fixed(1e-3)),
    ("1e-4 m", Form::Fixed(1e-4)),
    ("1e-6 m", Form::Fixed(1e-6)),
];

/// Sizes of triangles, and how far they lie from the origin of coordinates, m.
const CASES: [(f64, f64); 7] = [
    (1e-4, 0.0),
    (1e-2, 0.0),
    (1.0, 0.0),
    (1.0, 1e3),
    (1e2, 0.0),
    (1e5, 0.0),
    (1e3, 1e6),
];

rows! {
    /// A way to begin rays, on triangles of a size in a place.
    struct Row = "Rays that leave a triangle" by [offset, size, away] {
        offset: String = "offset",
        size: f64 = "size (m)",
        away: f64 = "from the origin of coordinates (m)",
        met: u64 = "met their own surface",
        behind: u64 = "began behind the wall",
        rays: u64 = "rays",
        distance: f64 = "median distance from the plane (m)",
        time: Repeats = "an origin (ns)",
    }
}
/// What was found.
pub type Found = Vec<Row>;

const CRITERIA: &[Criterion<Row>] = &[
    Criterion::each("no ray meets its own surface", Bound::AtMost(0.0), |row: &Row| {
        row.met.into()
    })
    .among(Row::is_the_engines)
    .in_every_form(),
    Criterion::each("no ray begins behind the wall", Bound::AtMost(0.0), |row: &Row| {
        row.behind.into()
    })
    .among(Row::is_the_engines)
    .in_every_form(),
];

impl Row {
    fn is_the_engines(&self) -> bool {
        self.offset == ENGINES
    }

    fn of((name, form): (&str, Form), (size, away): (f64, f64), inputs: &[Input], time: Vec<f64>) -> Self {
        let (mut met, mut behind, mut distances) = (0, 0, Errors::default());
        for input in inputs {
            let origin = start(form, input);
            let shear = ray_shear(origin, input.direction);
            let meets = |triangle| intersect_triangle(&shear, triangle, 0.0, f32::INFINITY).is_some();
            met += u64::from(meets(&input.triangle) || meets(&input.neighbour));
            let height = (origin.as_dvec3() - input.triangle[0].as_dvec3()).dot(input.normal.as_dvec3());
            behind += u64::from(height > GAP * size);
            distances.add(height);
        }
        Self {
            offset: name.into(),
            size,
            away,
            met,
            behind,
            rays: inputs.len() as u64,
            distance: distances.quantile(0.5),
            time: Repeats(time),
        }
    }
}

impl Study for Found {
    fn measure(context: &Context<'_>) -> Result<Self> {
        let count = context.pick(100_000, 500);
        let name = |(size, away): &(f64, f64)| format!("{size} m, {away} m away");
        context.each(&CASES, name, |case| {
            let mut random = Random::new(7);
            let inputs: Vec<Input> = (0..count).map(|_| input(&mut random, case.0, case.1)).collect();
            let times = context.in_turns(9, FORMS.len(), |i| {
                Ok(nanoseconds_once(&inputs, |input| start(FORMS[i].1, input)))
            })?;
            let forms = FORMS.into_iter().zip(times);
            Ok(forms.map(|(form, time)| Row::of(form, *case, &inputs, time)).collect())
        })
    }

    fn findings(&self) -> Findings {
        Findings::of(self, CRITERIA)
            .headline(
                "rays by the engine's bounds that meet their own surface",
                total(self, Row::is_the_engines, |row| row.met),
            )
            .note(format!(
                "Exact: none and none. The surface is the triangle and a coplanar one {NEIGHBOUR} times as long; half of the rays graze it. The \
                 wall is parallel to it at {GAP} of the triangle's size. The point comes from weights, not from the ray, for all forms; the \
                 speed includes it."
            ))
    }
}
