//! Every way through a kd-tree on the device: schemes by one thread per ray and caches in queues, for closest and for any hits.

use clerestory::Result;
use clerestory::accel::DeviceTraversal;
use clerestory::accel::kd::{KdCaches, KdSettings, KdTree};
use clerestory::accel::trace::{Execution, PersistentThreads, Query, RayTracer, TraceSettings};
use clerestory::gpu::{DeviceKind, Gpu, SOFTWARE_LOOP_CAP};
use glam::Vec3;

use super::kd_caches;
use super::kd_traversal::SCHEMES;

/// Most triangles in a leaf of the trees that share their kernels; quotas of software devices depend on it.
const COMMON_LEAF: u32 = 64;

/// Workgroups of a queue's dispatch, so that software devices, whose workgroups trace a few rays each, need not millions of dispatches.
const LEAST_GROUPS: u32 = 128;

/// One way to find hits.
pub struct Variant {
    /// For tables.
    pub query: &'static str,
    /// For tables.
    pub execution: &'static str,
    /// For tables.
    pub words: &'static str,
    /// Its settings.
    pub settings: TraceSettings,
}

/// All, of each query the one first that others are compared with.
pub fn variants(gpu: &Gpu) -> Vec<Variant> {
    let common = DeviceTraversal::Kd {
        longest_leaf: COMMON_LEAF,
    };
    let mut variants = Vec::new();
    for (query_words, query) in [("closest", Query::Closest), ("any", Query::Any)] {
        let mut add = |execution, words, settings: TraceSettings| {
            variants.push(Variant {
                query: query_words,
                execution,
                words,
                settings: TraceSettings { query, ..settings }.fitted(gpu.caps(), common),
            });
        };
        for (words, scheme) in SCHEMES {
            let settings = TraceSettings::ray_per_thread();
            add("ray per thread", words, TraceSettings { scheme, ..settings });
        }
        for (words, caches) in kd_caches::NAMES.into_iter().zip(KdCaches::COMPARED) {
            let mut settings = TraceSettings::persistent(gpu.caps());
            if let Execution::Persistent(threads) = &mut settings.execution {
                threads.groups = threads.groups.max(LEAST_GROUPS);
            }
            add("queue, caches:", words, TraceSettings { caches, ..settings });
        }
    }
    variants
}

/// The settings with quotas that lose no ray; where leaves are too long for several batches a dispatch, with one.
pub fn fitted(gpu: &Gpu, settings: TraceSettings, traversal: DeviceTraversal) -> TraceSettings {
    let caps = gpu.caps();
    let fitted = settings.fitted(caps, traversal);
    let fits = caps.kind != DeviceKind::Cpu || fitted.iterations(caps, traversal) <= u64::from(SOFTWARE_LOOP_CAP);
    match settings.execution {
        Execution::Persistent(threads) if !fits => {
            let threads = PersistentThreads { fetches: 1, ..threads };
            let execution = Execution::Persistent(threads);
            TraceSettings { execution, ..settings }.fitted(caps, traversal)
        }
        _ => fitted,
    }
}

/// Tracers of all variants, so that their kernels stay.
///
/// # Errors
/// Those of kernels.
pub fn kept_kernels(gpu: &Gpu, variants: &[Variant]) -> Result<Vec<RayTracer>> {
    let tree = KdTree::build(&[[Vec3::ZERO, Vec3::X, Vec3::Y]], &KdSettings::default())?;
    let tracers = variants
        .iter()
        .map(|variant| RayTracer::new(gpu, &tree, &variant.settings));
    tracers.collect()
}
