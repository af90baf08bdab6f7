//! Closest hits by a pass over all rays for each triangle, beside an index on the same device.
//!
//! Oracle: hits of the index, whose triangle test is the same.

use std::f64::consts::TAU;

use clerestory::Result;
use clerestory::accel::bvh2::{Bvh2, Bvh2Settings};
use clerestory::accel::trace::{RayTracer, TraceSettings};
use clerestory::accel::yardstick::ray_engine::RayEngine;
use clerestory::accel::{Hit, Ray};
use clerestory::scene;
use glam::Vec3;

use crate::experiments::findings::{Bound, Criterion, Findings, Measured, Repeats, Study, rows};
use crate::experiments::measures::Context;

const SCENES: [&str; 3] = [
    "builtin:box-room?contents=empty&source=point",
    "builtin:ring",
    "builtin:box-room?source=point",
];
const TURNS: usize = 7;

rows! {
    /// A scene.
    struct Row = "Closest hits without an index, and with one" by [scene] {
        scene: String = "scene",
        triangles: u64 = "triangles",
        rays: u64 = "rays",
        passes: u64 = "passes",
        tests: u64 = "tests of a ray with a triangle",
        other: u64 = "hits at another distance than the index's",
        engine: Repeats = "time of a ray by passes (ns)",
        index: Repeats = "time of a ray by the index (ns)",
        over_index: Repeats = "passes over index",
        a_test: Repeats = "time of a test (ns)",
    }
}
/// What was found.
pub type Found = Vec<Row>;

const CRITERIA: &[Criterion<Row>] = &[
    Criterion::each(
        "both find the same: hits at another distance",
        Bound::AtMost(0.0),
        |row: &Row| row.other.into(),
    )
    .in_every_form(),
    Criterion::each(
        "hundreds of triangles take an index: passes over index",
        Bound::AtLeast(1.0),
        |row: &Row| (&row.over_index).into(),
    )
    .among(|row| row.triangles > 500),
];

/// Rays from a point of the scene's box into all directions, by a spiral.
fn rays(corners: &[[Vec3; 3]], count: u32) -> Vec<Ray> {
    let none = [Vec3::INFINITY, Vec3::NEG_INFINITY];
    let [low, high] = corners
        .iter()
        .flatten()
        .fold(none, |[low, high], p| [low.min(*p), high.max(*p)]);
    let place = low + Vec3::new(0.43, 0.61, 0.37) * (high - low);
    let ray = |i: u32| {
        let z = 1.0 - (2.0 * f64::from(i) + 1.0) / f64::from(count);
        let (sine, cosine) = (TAU * 0.618_033_988_749_895 * f64::from(i)).sin_cos();
        let across = (1.0 - z * z).sqrt();
        Ray::new(
            place,
            Vec3::new((across * cosine) as f32, (across * sine) as f32, z as f32),
        )
    };
    (0..count).map(ray).collect()
}

impl Study for Found {
    fn measure(context: &Context<'_>) -> Result<Self> {
        let gpu = (context.gpu)()?;
        let engine = RayEngine::new(&gpu)?;
        let count = context.pick(1 << 16, 1 << 8);
        let scenes = context.first(&SCENES, 1);
        context.each(
            scenes,
            |scene| (*scene).into(),
            |address| {
                let corners: Vec<[Vec3; 3]> = scene::load(address)?.triangles().map(|(corners, _)| corners).collect();
                let rays = rays(&corners, count);
                let index = Bvh2::build(&corners, &Bvh2Settings::default())?;
                let tracer = RayTracer::new(&gpu, &index, &TraceSettings::ray_per_thread())?;
                let (found, timings) = engine.trace(&corners, &rays)?;
                let expected = tracer.trace(&rays)?.hits;
                let is_other = |(a, b): &(&Hit, &Hit)| a.is_hit() != b.is_hit() || a.t.to_bits() != b.t.to_bits();
                let other = found.iter().zip(&expected).filter(is_other).count();
                let times = context.in_turns(TURNS, 2, |contender| {
                    let seconds: f64 = if contender == 0 {
                        let (_, timings) = engine.trace(&corners, &rays)?;
                        let passes = timings.iter().flat_map(|timings| &timings.passes);
                        passes
                            .filter_map(|pass| pass.nanoseconds)
                            .map(|ns| 1e-9 * ns as f64)
                            .sum()
                    } else {
                        tracer.trace(&rays)?.seconds()
                    };
                    Ok(1e9 * seconds / f64::from(count))
                })?;
                let [engine, index] =
                    [0, 1].map(|contender: usize| Repeats(times.get(contender).cloned().unwrap_or_default()));
                let tests = corners.len() as u64 * u64::from(count);
                Ok(vec![Row {
                    scene: (*address).into(),
                    triangles: corners.len() as u64,
                    rays: count.into(),
                    passes: timings.len() as u64,
                    tests,
                    other: other as u64,
                    over_index: engine.over(&index),
                    a_test: engine.scaled(1.0 / corners.len().max(1) as f64),
                    engine,
                    index,
                }])
            },
        )
    }

    fn findings(&self) -> Findings {
        let largest = self.iter().max_by_key(|row| row.triangles);
        Findings::of(self, CRITERIA)
            .headline(
                "time by passes over time by the index, at the most triangles",
                largest.map(|row| Measured::from(&row.over_index)),
            )
            .note("Rays from one point into all directions. A pass of the table is a submission of 256 triangles at most.")
    }
}
