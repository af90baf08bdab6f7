//! When a kd-tree is better than a bounding volume hierarchy: rays a second and builds of both, from few layers of triangles behind a pixel
//! to many.
//!
//! Oracle: every index gives the same hits to the bit. The bounding volumes are the engine's best: binned surface area heuristic, and the
//! optimised linear hierarchy.

use clerestory::Result;
use clerestory::accel::bvh2::{Bvh2, Bvh2Settings};
use clerestory::accel::kd::{Heuristic, KdSettings};
use clerestory::accel::lbvh::BuildQuality;
use clerestory::accel::trace::TraceSettings;
use clerestory::accel::{IndexKind, Ray, RayIndex, TraversalCounters};
use glam::Vec3;

use super::flights::{CASES, Case, Flight, each_flight, race};
use crate::experiments::measures::Context;
use crate::experiments::table::{Cell, Table};
use crate::timing::{median, repeated, timed};

const fn soup(scene: &'static str) -> Case {
    Case {
        scene,
        counterpart: "",
        light: Vec3::new(0.0, 3.0, 0.0),
    }
}

/// As many triangles each, of growing size: the sweep over depth complexity.
static SOUPS: [Case; 4] = [
    soup("builtin:triangle-soup?n=50000&size=0.005"),
    soup("builtin:triangle-soup?n=50000&size=0.02"),
    soup("builtin:triangle-soup?n=50000&size=0.08"),
    soup("builtin:triangle-soup?n=50000&size=0.3"),
];
static SMOKE_SOUP: Case = soup("builtin:triangle-soup?n=500&size=0.1");

/// Indexes by name, kd-trees first.
fn kinds() -> [(&'static str, IndexKind); 4] {
    let kd = |heuristic| {
        IndexKind::Kd(KdSettings {
            heuristic,
            ..KdSettings::default()
        })
    };
    [
        ("kd, SIROH", kd(Heuristic::InteriorOrigin)),
        ("kd, surface area", kd(Heuristic::SurfaceArea)),
        ("BVH, binned", IndexKind::Bvh2(Bvh2Settings::default())),
        ("BVH, linear and optimised", IndexKind::lbvh(BuildQuality::High)),
    ]
}
/// How many of them are kd-trees.
const KD_TREES: usize = 2;

/// Triangles along a ray, all of them.
fn layers(index: &Bvh2, rays: &[Ray]) -> f64 {
    let mut met = 0_u64;
    let mut counters = TraversalCounters::default();
    for ray in rays {
        index.any_hit_filtered(
            ray,
            &mut |_, _| {
                met += 1;
                false
            },
            &mut counters,
        );
    }
    met as f64 / rays.len().max(1) as f64
}

/// One index over one scene.
struct Measured {
    build: f64,
    bytes: u64,
    /// Nodes and triangles a ray, of closest and of any hits.
    steps: [f64; 2],
}

fn steps(index: &dyn RayIndex, flight: &Flight) -> [f64; 2] {
    let mut work = [TraversalCounters::default(); 2];
    let closest = flight.closest();
    for ray in &closest {
        index.closest_hit_filtered(ray, &mut |_, _| true, &mut work[0]);
    }
    for ray in &flight.shadow {
        index.any_hit_filtered(ray, &mut |_, _| true, &mut work[1]);
    }
    let counts = [closest.len(), flight.shadow.len()];
    std::array::from_fn(|i| (work[i].nodes + work[i].triangles) as f64 / counts[i].max(1) as f64)
}

/// Millions of rays after which the better rate has paid for the longer build.
fn pays_after(kd: (f64, f64), bvh: (f64, f64)) -> Option<f64> {
    let ((kd_build, kd_rate), (bvh_build, bvh_rate)) = (kd, bvh);
    // Milliseconds against microseconds a ray.
    (kd_rate > bvh_rate).then(|| (1e-3 * (kd_build - bvh_build)).max(0.0) / (1.0 / bvh_rate - 1.0 / kd_rate))
}

/// The measure.
pub fn measure(context: &Context<'_>) -> Result<Vec<Table>> {
    let gpu = (context.gpu)()?;
    let mut indexes = Table::new(
        "kd-trees and bounding volumes",
        &[
            "scene",
            "triangles",
            "triangles along a ray",
            "index",
            "build (ms)",
            "MiB",
            "steps a ray, closest",
            "steps a ray, any",
            "closest hits (M rays/s)",
            "any hits (M rays/s)",
            "both (M rays/s)",
        ],
    );
    let mut answer = Table::new(
        "Best kd-tree beside best bounding volumes",
        &[
            "scene",
            "triangles along a ray",
            "closest hits: kd / BVH",
            "any hits: kd / BVH",
            "both: kd / BVH",
            "build: kd / BVH",
            "kd pays for its build after (M rays)",
        ],
    );
    let scenes: Vec<&Case> = match context.smoke {
        true => vec![&SMOKE_SOUP],
        false => CASES.iter().chain(&SOUPS).collect(),
    };
    each_flight(context, scenes.into_iter(), |case, surfaces, flight| {
        let name = case.name();
        let layers = layers(surfaces.index(), &flight.camera);
        let mut measured = Vec::new();
        let mut built = Vec::new();
        for (_, kind) in kinds() {
            let (index, times) = repeated(if context.smoke { 0 } else { 3 }, || {
                let (index, time) = timed(|| kind.build(&surfaces.triangles));
                index.map(|index| (index, 1e3 * time))
            })?;
            measured.push(Measured {
                build: median(times),
                bytes: index.statistics().bytes,
                steps: steps(&*index, flight),
            });
            built.push(index);
        }
        let contenders = built.iter().map(|index| (&**index, TraceSettings::ray_per_thread()));
        let rates = race(context, &gpu, flight, contenders)?;
        for (((index, _), one), rates) in kinds().iter().zip(&measured).zip(&rates) {
            indexes.row([
                name.into(),
                (surfaces.triangles.len() as u64).into(),
                layers.into(),
                (*index).into(),
                one.build.into(),
                (one.bytes as f64 / f64::from(1 << 20)).into(),
                one.steps[0].into(),
                one.steps[1].into(),
                rates[0].into(),
                rates[1].into(),
                rates[2].into(),
            ]);
        }
        let best = |of: std::ops::Range<usize>, query: usize| {
            let by_rate = |a: &usize, b: &usize| rates[*a][query].total_cmp(&rates[*b][query]);
            of.max_by(by_rate).unwrap_or_default()
        };
        let pair = |query| [best(0..KD_TREES, query), best(KD_TREES..measured.len(), query)];
        let ratio = |query| {
            let [kd, bvh] = pair(query);
            Cell::from(rates[kd][query] / rates[bvh][query])
        };
        let [kd, bvh] = pair(2);
        let of = |i: usize| (measured[i].build, rates[i][2]);
        answer.row([
            name.into(),
            layers.into(),
            ratio(0),
            ratio(1),
            ratio(2),
            (measured[kd].build / measured[bvh].build).into(),
            pays_after(of(kd), of(bvh)).map_or("never".into(), Into::into),
        ]);
        Ok(())
    })?;
    indexes.note(
        "Flights as in `kd-heuristics`; the soups have as many triangles each, of growing size, and a camera that stands still. Steps are \
         inner nodes and triangles, exact counts: a step of a kd-tree reads a plane of 8 bytes, one of a bounding volume hierarchy two boxes \
         in 64. kd-trees with default settings (leaves of 4, triangles weighed by their parts) and traversal by a stack; `kd-heuristics` and \
         `kd-traversal` show what other settings would give. Times are medians of runs that take turns; builds on all of the host's threads.",
    );
    answer.note(
        "By medians of the same run: the kd-tree and the hierarchy with the higher rate of each kind of rays. On the software driver a \
         kd-tree is worth building where rays pass through many triangles that overlap each other's boxes and rays are counted in millions; \
         in rooms, halls and woods the hierarchy is faster to trace and several times faster to build.",
    );
    Ok(vec![indexes, answer])
}
