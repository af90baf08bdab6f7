//! Footprints of pixels by differentials of camera rays: directly, in a mirror ball, and through a glass ball.
//!
//! Oracle: where rays through a pixel's four corners arrive. Derivatives at its centre are right to second order in its size.

use clerestory::Result;
use clerestory::transport::differentials::{
    Differentials, camera_differentials, reflect_differentials, refract_differentials, transfer_differentials,
};
use glam::DVec3;

use crate::experiments::findings::{Bound, Criterion, Findings, Study, rows};
use crate::experiments::measures::Context;
use crate::experiments::measures::errors::Errors;

/// The camera looks along −Z at a ball of radius 1.
const EYE: DVec3 = DVec3::new(0.0, 1.0, 4.0);
const BALL: DVec3 = DVec3::Y;
/// Side of the picture at distance 1.
const SIDE: f64 = 0.7;
/// Index of the glass.
const ETA: f64 = 1.5;
/// Rays that go farther are left out.
const FAR: f64 = 30.0;
/// Pixels a side.
const SIZES: [u32; 4] = [32, 64, 128, 256];

/// A ray with its differentials.
struct Ray {
    place: DVec3,
    direction: DVec3,
    by: Differentials,
}

impl Ray {
    /// Through a point of the picture at distance 1, its pixels of that side.
    fn new(x: f64, y: f64, pixel: f64) -> Self {
        let pinhole = DVec3::new(x, y, -1.0);
        Self {
            place: EYE,
            direction: pinhole.normalize(),
            by: camera_differentials(pinhole, pixel * DVec3::X, pixel * DVec3::Y),
        }
    }

    fn go(&mut self, t: f64, normal: DVec3) {
        self.place += t * self.direction;
        self.by = transfer_differentials(&self.by, t, self.direction, normal);
    }

    fn at_plane(mut self, point: DVec3, normal: DVec3) -> Option<Self> {
        let t = (point - self.place).dot(normal) / self.direction.dot(normal);
        (t > 0.0 && t <= FAR).then(|| {
            self.go(t, normal);
            self
        })
    }

    /// To the ball from outside: its normal there, the derivatives of which are those of the place.
    fn meet_ball(&mut self) -> Option<DVec3> {
        let from = self.place - BALL;
        let b = from.dot(self.direction);
        let squared = b * b - from.length_squared() + 1.0;
        (squared > 0.0).then(|| {
            let t = -b - squared.sqrt();
            let normal = from + t * self.direction;
            self.go(t, normal);
            normal
        })
    }

    /// Refraction at a normal that faces the ray and changes by so much of the place's change.
    fn refract(&mut self, normal: DVec3, eta: f64, bend: f64) {
        let w = self.direction;
        self.by = refract_differentials(&self.by, w, normal, eta, [bend * self.by.z1, bend * self.by.z2]);
        let c = w.dot(normal);
        let cosine = (1.0 - eta * eta * (1.0 - c * c)).sqrt();
        self.direction = eta * w - (eta * c + cosine) * normal;
    }
}

/// What a pixel's ray meets in the end.
type Way = fn(Ray) -> Option<Ray>;

const WALL: &str = "wall that faces the camera";
const WAYS: [(&str, Way); 4] = [
    (WALL, |ray| ray.at_plane(-2.0 * DVec3::Z, DVec3::Z)),
    ("floor", |ray| ray.at_plane(DVec3::ZERO, DVec3::Y)),
    ("floor in a mirror ball", |mut ray| {
        let (normal, w) = (ray.meet_ball()?, ray.direction);
        ray.by = reflect_differentials(&ray.by, w, normal, [ray.by.z1, ray.by.z2]);
        ray.direction = w - 2.0 * w.dot(normal) * normal;
        ray.at_plane(DVec3::ZERO, DVec3::Y)
    }),
    ("wall behind a glass ball", |mut ray| {
        let normal = ray.meet_ball()?;
        ray.refract(normal, 1.0 / ETA, 1.0);
        let t = -2.0 * ray.direction.dot(normal);
        let normal = normal + t * ray.direction;
        ray.go(t, normal);
        ray.refract(-normal, ETA, -1.0);
        ray.at_plane(-3.0 * DVec3::Z, DVec3::Z)
    }),
];

rows! {
    /// What is seen, and pixels.
    struct Row = "Areas of footprints against those between the corners' rays" by [seen, size] {
        seen: String = "seen",
        size: u64 = "pixels a side",
        pixels: u64 = "pixels that see it whole",
        median: f64 = "relative error, median",
        most: f64 = "relative error of 95 of 100",
        worst: f64 = "relative error, worst",
        fall: Option<f64> = "median over that of half as many pixels a side",
    }
}
/// What was found.
pub type Found = Vec<Row>;

const CRITERIA: &[Criterion<Row>] = &[
    Criterion::each(
        "footprints on a wall that faces the camera are its pixels: worst relative error",
        Bound::AtMost(1e-9),
        |row: &Row| row.worst.into(),
    )
    .among(|row| row.seen == WALL)
    .in_every_form(),
    Criterion::each(
        "elsewhere errors are of second order: median over that of half as many pixels a side",
        Bound::Between(0.2, 0.3),
        |row: &Row| row.fall.unwrap_or(f64::NAN).into(),
    )
    .among(|row| row.seen != WALL && row.fall.is_some())
    .because("a quarter for twice the pixels"),
    Criterion::each(
        "95 of 100 footprints of 256 pixels a side are within 5 %: their relative error",
        Bound::AtMost(0.05),
        |row: &Row| row.most.into(),
    )
    .among(|row| row.size == 256),
];

/// Relative errors of the pixels that see it whole.
fn errors(way: Way, size: u32) -> (Errors, u64) {
    let (pixel, mut errors, mut pixels) = (SIDE / f64::from(size), Errors::default(), 0);
    for i in 0..size * size {
        let [x, y] = [i % size, i / size].map(|k| (f64::from(k) + 0.5) * pixel - 0.5 * SIDE);
        let at = |dx: f64, dy: f64| way(Ray::new(x + dx * pixel, y + dy * pixel, pixel));
        let corners = [(-0.5, -0.5), (0.5, -0.5), (0.5, 0.5), (-0.5, 0.5)].map(|(dx, dy)| at(dx, dy));
        if let (Some(centre), [Some(a), Some(b), Some(c), Some(d)]) = (at(0.0, 0.0), corners) {
            let area = 0.5 * (c.place - a.place).cross(d.place - b.place).length();
            errors.add(centre.by.z1.cross(centre.by.z2).length() / area - 1.0);
            pixels += 1;
        }
    }
    (errors, pixels)
}

impl Study for Found {
    fn measure(context: &Context<'_>) -> Result<Self> {
        let sizes = context.first(&SIZES, 2);
        let name = |way: &(&str, Way)| way.0.to_owned();
        context.each(&WAYS, name, |(seen, way)| {
            let mut rows: Vec<Row> = Vec::new();
            for &size in sizes {
                let (mut errors, pixels) = errors(*way, size);
                let median = errors.quantile(0.5);
                rows.push(Row {
                    seen: (*seen).into(),
                    size: size.into(),
                    pixels,
                    median,
                    most: errors.quantile(0.95),
                    worst: errors.worst(),
                    fall: rows.last().map(|half| median / half.median),
                });
            }
            Ok(rows)
        })
    }

    fn findings(&self) -> Findings {
        let ball = |row: &&Row| row.seen == WAYS[3].0 && row.size == 256;
        Findings::of(self, CRITERIA)
            .headline(
                "relative error of footprints behind a glass ball, median of 256 pixels a side",
                self.iter().find(ball).map(|row| row.median.into()),
            )
            .note(
                "The area of a footprint is that of the parallelogram of both derivatives, in steps of a pixel. On the facing wall it is exact, so \
                 that only rounding is left.",
            )
    }
}
