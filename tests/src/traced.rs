//! Rays that kernels trace, against the twins of their traversals: hits to the bit, and the work exactly.
//!
//! Equality of bits is asked of software devices: Vulkan lets others divide with an error of 2.5 ULP, so there the hits are held to the
//! f64 test.

use clerestory::accel::kd::{KdCounters, KdTraversal, KdTree};
use clerestory::accel::trace::{Query, RayTracer, TraceSettings, Traced};
use clerestory::accel::wide::{WideBvh, WideTraversal};
use clerestory::accel::{FINISHED, Hit, Ray, RayIndex, TraversalCounters};
use clerestory::gpu::{DeviceKind, Gpu};
use clerestory_hard_cases::{hit_bits, misses};
use glam::Vec3;

/// An index and rays in it.
pub struct Case<I> {
    /// Name in messages.
    pub what: String,
    /// Corners, metres.
    pub triangles: Vec<[Vec3; 3]>,
    /// An index over them.
    pub index: I,
    /// What is traced.
    pub rays: Vec<Ray>,
}

/// An index whose traversal has a twin that can be stopped.
pub trait StoppableIndex: RayIndex + Sized {
    /// Counters of work.
    type Work: Default + PartialEq + std::fmt::Debug;

    /// Traces a ray with as many stops as its quota makes, and counts these.
    fn trace(&self, ray: &Ray, settings: &TraceSettings, work: &mut Self::Work, stops: &mut u64) -> Hit;

    /// What the kernels have counted.
    fn work_of(traced: &Traced) -> Self::Work;
}

impl StoppableIndex for WideBvh {
    type Work = TraversalCounters;

    fn trace(&self, ray: &Ray, settings: &TraceSettings, work: &mut Self::Work, stops: &mut u64) -> Hit {
        let mut traversal = match settings.query {
            Query::Closest => WideTraversal::closest(ray),
            Query::Any => WideTraversal::any(ray),
        };
        loop {
            traversal.run(self, ray, settings.ray_quota.into(), &mut |_, _| true, work);
            if traversal.resume == FINISHED {
                return traversal.hit;
            }
            *stops += 1;
        }
    }

    fn work_of(traced: &Traced) -> Self::Work {
        traced.work
    }
}

impl StoppableIndex for KdTree {
    type Work = KdCounters;

    fn trace(&self, ray: &Ray, settings: &TraceSettings, work: &mut Self::Work, stops: &mut u64) -> Hit {
        let begun = match settings.query {
            Query::Closest => KdTraversal::closest(settings.scheme, ray),
            Query::Any => KdTraversal::any(settings.scheme, ray),
        };
        let mut traversal = begun.with_caches(settings.caches).expect("the tracer takes them too");
        loop {
            traversal.run(self, ray, settings.ray_quota.into(), &mut |_, _| true, work);
            if traversal.resume == FINISHED {
                return traversal.hit;
            }
            *stops += 1;
        }
    }

    fn work_of(traced: &Traced) -> Self::Work {
        traced.kd_work
    }
}

/// Holds hits that kernels have found to those of the twin, whose work and stops it returns.
pub fn check_hits<I: StoppableIndex>(
    gpu: &Gpu,
    case: &Case<I>,
    settings: &TraceSettings,
    hits: &[Hit],
) -> (I::Work, u64) {
    let exact = gpu.caps().kind == DeviceKind::Cpu;
    let (mut work, mut stops) = (I::Work::default(), 0);
    for (ray, found) in case.rays.iter().zip(hits) {
        let expected = case.index.trace(ray, settings, &mut work, &mut stops);
        if exact {
            assert_eq!(
                hit_bits(found),
                hit_bits(&expected),
                "{}, {settings:?}: {ray:?}",
                case.what
            );
        } else if settings.query == Query::Closest || !found.is_hit() {
            assert!(
                !misses(&case.triangles, ray, found),
                "{}, {settings:?}: {ray:?}",
                case.what
            );
        }
    }
    (work, stops)
}

/// Traces all cases with the same settings, or with as much of their quota as fits a software device's loops: the wider its subgroups, the less. How often
/// rays were stopped by the quota that was asked for.
pub fn check<I: StoppableIndex>(gpu: &Gpu, cases: &[Case<I>], asked: &TraceSettings) -> u64 {
    // Kept, so that all share a pipeline.
    let mut tracers = Vec::new();
    let mut stopped = 0;
    for case in cases {
        let settings = &asked.fitted(gpu.caps(), case.index.device_traversal());
        let what = format!("{}, {settings:?}", case.what);
        let tracer = RayTracer::new(gpu, &case.index, settings).expect("settings that fit");
        let traced = tracer.trace(&case.rays).expect("rays that fit");
        tracers.push(tracer);
        if settings.ray_quota == asked.ray_quota {
            stopped += traced.unfinished;
        }
        let (work, stops) = check_hits(gpu, case, settings, &traced.hits);
        if gpu.caps().kind == DeviceKind::Cpu {
            assert_eq!(I::work_of(&traced), work, "{what}");
            assert_eq!(traced.unfinished, stops, "{what}");
        }
    }
    stopped
}
