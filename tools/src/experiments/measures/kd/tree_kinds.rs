//! Indexes that are compared: kd-trees and bounding volume hierarchies by name, with the ways through each, their builds and their work.

use clerestory::Result;
use clerestory::accel::bvh2::{Bvh2, Bvh2Settings};
use clerestory::accel::kd::{Heuristic, KdSettings, Scheme};
use clerestory::accel::lbvh::BuildQuality;
use clerestory::accel::trace::TraceSettings;
use clerestory::accel::{IndexKind, Ray, RayIndex, TraversalCounters};

use super::flights::{Flight, TURNS};
use super::kd_traversal::SCHEMES;
use crate::experiments::findings::Repeats;
use crate::experiments::measures::Context;
use crate::experiments::measures::photon_maps::photon_scenes::Surfaces;
use crate::timing::timed;

/// An index that took longer to build than these milliseconds is not built again.
const LONG_BUILD: f64 = 3e3;

/// An index and the ways through it that are timed.
pub struct Kind {
    /// For tables.
    pub words: &'static str,
    /// What is built.
    pub index: IndexKind,
    ways: &'static [(&'static str, Scheme)],
}

const BY_STACK: [(&str, Scheme); 1] = [("stack", Scheme::Stack)];

/// Indexes by name, kd-trees first.
pub fn kinds() -> [Kind; 6] {
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

/// A way through one of the indexes.
pub struct Way {
    /// Which.
    pub index: usize,
    /// The index, for tables.
    pub words: &'static str,
    /// The scheme, for tables.
    pub by: &'static str,
    scheme: Scheme,
}

impl Way {
    /// All ways through these.
    pub fn all(kinds: &[Kind]) -> Vec<Self> {
        let of = |(index, kind): (usize, &Kind)| {
            let words = kind.words;
            let ways = kind.ways.iter();
            ways.map(move |(by, scheme)| Self {
                index,
                words,
                by,
                scheme: *scheme,
            })
        };
        kinds.iter().enumerate().flat_map(of).collect()
    }

    /// Whether it goes through a kd-tree.
    pub fn is_kd(&self) -> bool {
        self.index < KD_TREES
    }

    /// Whether it goes by a stack.
    pub fn is_by_stack(&self) -> bool {
        self.scheme == Scheme::Stack
    }

    /// One thread per ray.
    pub fn settings(&self) -> TraceSettings {
        TraceSettings {
            scheme: self.scheme,
            ..TraceSettings::ray_per_thread()
        }
    }
}

/// An index with the times of its builds, milliseconds.
pub type Built = (Box<dyn RayIndex>, Repeats);

/// All indexes; their builds take turns after one of each that warms up, but for those that take long.
///
/// # Errors
/// Those of builds.
pub fn build(context: &Context<'_>, kinds: &[Kind], surfaces: &Surfaces) -> Result<Vec<Built>> {
    let once = |kind: &Kind| {
        let (index, time) = timed(|| kind.index.build(&surfaces.triangles));
        index.map(|index| (index, 1e3 * time))
    };
    let first = kinds.iter().map(once).collect::<Result<Vec<_>>>()?;
    let is_short = |index: &usize| first[*index].1 <= LONG_BUILD;
    let short: Vec<usize> = (0..kinds.len()).filter(is_short).collect();
    let times = context.in_turns(TURNS, short.len(), |i| Ok(once(&kinds[short[i]])?.1))?;
    let mut built: Vec<Built> = first
        .into_iter()
        .map(|(index, time)| (index, Repeats(vec![time])))
        .collect();
    for (index, times) in short.into_iter().zip(times) {
        built[index].1 = Repeats(times);
    }
    Ok(built)
}

/// Nodes and triangles per ray, of closest and of any hits.
pub fn steps(index: &dyn RayIndex, flight: &Flight) -> [f64; 2] {
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

/// Triangles along a ray, all of them.
pub fn layers(index: &Bvh2, rays: &[Ray]) -> f64 {
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
