//! When a kd-tree is better than a bounding volume hierarchy: rays a second and builds of both, from few layers of triangles behind a pixel
//! to many.
//!
//! Oracle: every index gives the same hits to the bit. The bounding volumes are the engine's best: binned surface area heuristic, and the
//! optimised linear hierarchy.

use clerestory::Result;
use clerestory::accel::bvh2::{Bvh2, Bvh2Settings};
use clerestory::accel::kd::{Heuristic, KdSettings, Scheme};
use clerestory::accel::lbvh::BuildQuality;
use clerestory::accel::trace::TraceSettings;
use clerestory::accel::{IndexKind, Ray, RayIndex, TraversalCounters};
use glam::Vec3;

use super::flights::{CASES, Case, Flight, different, each_flight, race, told};
use super::kd_traversal::SCHEMES;
use super::real_models;
use crate::experiments::measures::Context;
use crate::experiments::measures::photon_maps::photon_scenes::Surfaces;
use crate::experiments::table::{Cell, Table};
use crate::timing::{median, timed};

const fn soup(scene: &'static str) -> Case {
    Case::of_our_own(scene, Vec3::new(0.0, 3.0, 0.0))
}

/// As many triangles each, of growing size: the sweep over depth complexity.
static SOUPS: [Case; 4] = [
    soup("builtin:triangle-soup?n=50000&size=0.005"),
    soup("builtin:triangle-soup?n=50000&size=0.02"),
    soup("builtin:triangle-soup?n=50000&size=0.08"),
    soup("builtin:triangle-soup?n=20000&size=0.3"),
];
static SMOKE_SOUP: Case = soup("builtin:triangle-soup?n=500&size=0.1");

/// A tree that took longer to build than these seconds is not built again for a median.
const LONG_BUILD: f64 = 3.0;
/// Timed builds of others, after one to warm up.
const REPEATS: usize = 3;

/// An index and the ways through it that are timed.
struct Kind {
    words: &'static str,
    index: IndexKind,
    ways: &'static [(&'static str, Scheme)],
}

const BY_STACK: [(&str, Scheme); 1] = [("stack", Scheme::Stack)];

/// Indexes by name, kd-trees first.
fn kinds() -> [Kind; 6] {
    let kd = |words, heuristic, leaf_size| Kind {
        words,
        index: IndexKind::Kd(KdSettings {
            heuristic,
            leaf_size,
            ..KdSettings::default()
        }),
        ways: &SCHEMES,
    };
    let bvh = |words, index| Kind {
        words,
        index,
        ways: &BY_STACK,
    };
    [
        kd("kd, SIROH", Heuristic::InteriorOrigin, 4),
        kd("kd, surface area", Heuristic::SurfaceArea, 4),
        kd("kd, SIROH, leaves of 1", Heuristic::InteriorOrigin, 1),
        kd("kd, surface area, leaves of 1", Heuristic::SurfaceArea, 1),
        bvh("BVH, binned", IndexKind::Bvh2(Bvh2Settings::default())),
        bvh("BVH, linear and optimised", IndexKind::lbvh(BuildQuality::High)),
    ]
}
/// How many of them are kd-trees.
const KD_TREES: usize = 4;

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

/// A way through one of the indexes.
struct Way {
    /// Which.
    index: usize,
    words: &'static str,
    by: &'static str,
    scheme: Scheme,
}

impl Way {
    fn all(index: usize, kind: &Kind) -> impl Iterator<Item = Self> {
        let words = kind.words;
        kind.ways.iter().map(move |(by, scheme)| Self {
            index,
            words,
            by,
            scheme: *scheme,
        })
    }
}

/// An index and the median of its builds, milliseconds.
fn build(context: &Context<'_>, kind: &Kind, surfaces: &Surfaces) -> Result<(Box<dyn RayIndex>, f64)> {
    let once = || {
        let (index, time) = timed(|| kind.index.build(&surfaces.triangles));
        index.map(|index| (index, 1e3 * time))
    };
    let (mut index, first) = once()?;
    if context.smoke || first > 1e3 * LONG_BUILD {
        return Ok((index, first));
    }
    let mut times = Vec::new();
    for _ in 0..REPEATS {
        let (again, time) = once()?;
        index = again;
        times.push(time);
    }
    Ok((index, median(times)))
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
            "timed closest hits that differ",
            "build (ms)",
            "MiB",
            "steps a ray, closest",
            "steps a ray, any",
            "closest hits (M rays/s)",
            "any hits (M rays/s)",
            "both (M rays/s)",
            "fastest traversal",
            "both by it (M rays/s)",
        ],
    );
    let mut answer = Table::new(
        "Best kd-tree beside best bounding volumes",
        &[
            "scene",
            "triangles along a ray",
            "best kd-tree",
            "best BVH",
            "closest hits: kd / BVH",
            "any hits: kd / BVH",
            "both: kd / BVH",
            "build: kd / BVH",
            "kd pays for its build after (M rays)",
        ],
    );
    let mut models = None;
    let scenes = match (told(context), context.smoke) {
        (Some(told), _) => told,
        (None, true) => vec![SMOKE_SOUP.clone()],
        (None, false) => {
            let found = models.insert(real_models::find());
            [&CASES[..], &SOUPS, &found.cases].concat()
        }
    };
    each_flight(context, &scenes, |case, surfaces, flight| {
        let name = case.name();
        let layers = layers(surfaces.index(), &flight.camera);
        let mut measured = Vec::new();
        let mut built = Vec::new();
        for kind in &kinds() {
            let (index, build) = build(context, kind, surfaces)?;
            measured.push(Measured {
                build,
                bytes: index.statistics().bytes,
                steps: steps(&*index, flight),
            });
            built.push(index);
        }
        let ways: Vec<Way> = kinds()
            .iter()
            .enumerate()
            .flat_map(|(index, kind)| Way::all(index, kind))
            .collect();
        let contenders = ways.iter().map(|way| {
            let settings = TraceSettings {
                scheme: way.scheme,
                ..TraceSettings::ray_per_thread()
            };
            (&*built[way.index], settings)
        });
        let raced = race(context, &gpu, flight, contenders)?;
        let fastest = |fit: &dyn Fn(&Way) -> bool, query: usize| {
            let fit = (0..ways.len()).filter(|way| fit(&ways[*way]));
            fit.max_by(|a, b| raced[*a].rates[query].total_cmp(&raced[*b].rates[query]))
                .unwrap_or_default()
        };
        for (index, (kind, one)) in kinds().iter().zip(&measured).enumerate() {
            let is_of_it = |way: &Way| way.index == index;
            let by_stack = fastest(&|way| is_of_it(way) && way.scheme == Scheme::Stack, 2);
            let rates = raced[by_stack].rates;
            let fastest = fastest(&is_of_it, 2);
            let hits = ways.iter().zip(&raced).filter(|(way, _)| is_of_it(way));
            let differ = hits
                .map(|(_, one)| different(&one.hits[0], &raced[0].hits[0]))
                .sum::<u64>();
            indexes.row([
                name.into(),
                (surfaces.triangles.len() as u64).into(),
                layers.into(),
                kind.words.into(),
                differ.into(),
                one.build.into(),
                (one.bytes as f64 / f64::from(1 << 20)).into(),
                one.steps[0].into(),
                one.steps[1].into(),
                rates[0].into(),
                rates[1].into(),
                rates[2].into(),
                ways[fastest].by.into(),
                raced[fastest].rates[2].into(),
            ]);
        }
        let is_kd = |way: &Way| way.index < KD_TREES;
        let pair = |query| [fastest(&is_kd, query), fastest(&|way| !is_kd(way), query)];
        let ratio = |query| {
            let [kd, bvh] = pair(query);
            Cell::from(raced[kd].rates[query] / raced[bvh].rates[query])
        };
        let [kd, bvh] = pair(2);
        let of = |way: usize| (measured[ways[way].index].build, raced[way].rates[2]);
        answer.row([
            name.into(),
            layers.into(),
            format!("{}; {}", ways[kd].words, ways[kd].by).into(),
            ways[bvh].words.into(),
            ratio(0),
            ratio(1),
            ratio(2),
            (of(kd).0 / of(bvh).0).into(),
            pays_after(of(kd), of(bvh)).map_or("never".into(), Into::into),
        ]);
        Ok(())
    })?;
    indexes.note(
        "Flights as in `kd-heuristics`; the soups have as many triangles each, of growing size, but the last fewer, whose kd-trees would not fit the device, and a camera that stands still. Steps are \
         inner nodes and triangles, exact counts: a step of a kd-tree reads a plane of 8 bytes, one of a bounding volume hierarchy two \
         boxes in 64. kd-trees weigh triangles by their parts, with leaves of 4 (the default) and of 1; steps and rates are those by a \
         stack, and beside them stands the fastest of the five schemes. Hits are those of the timed kernels by every scheme, held against \
         the first one's. Times are medians of runs that take turns; builds on all of the host's threads, after one to warm up, but those \
         of more than 3 s, which are timed once.",
    );
    if let Some(models) = models {
        indexes.note(models.words);
    }
    answer.note(
        "By medians of the same run: the kd-tree with its traversal and the hierarchy with the highest rate of each kind of rays; those named \
         are the best of both kinds together. A kd-tree is worth its build where the ratio is above one and more \
         rays are traced than the last column says: occlusion rays, which end at any hit, and rays through many triangles that overlap \
         each other's boxes favour it; scenes of few large triangles favour the hierarchy.",
    );
    Ok(vec![indexes, answer])
}
