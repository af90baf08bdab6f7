//! Persistent threads in kd-trees beside one thread per ray: rates of both on flights through the source's scenes.
//!
//! Oracle: the hits of one thread per ray, to the bit. Source of the comparison: B. Fabianowski, "Interactive Manycore Photon Mapping", PhD thesis, Trinity
//! College Dublin, 2011, table 4.1 and appendix A.1, whose code bases I and II are the two models of execution.

use clerestory::Result;
use clerestory::accel::RayIndex;
use clerestory::accel::kd::{Heuristic, KdCaches, KdSettings, KdTree};
use clerestory::accel::trace::{Execution, RayTracer, TraceSettings};
use clerestory::gpu::Gpu;

use super::flights::{Case, Flight, TURNS, cases, different_of_both, each_flight, race};
use super::published::{CACHES, THREADS, of_source};
use crate::experiments::findings::{Bound, Criterion, Findings, Repeats, Study, geometric_mean, rows};
use crate::experiments::measures::Context;

const BY_RAY: &str = "ray per thread";
const QUEUE: &str = "queue";
const CACHED: &str = "queue, nodes and last entry cached";

/// The best of the source's caches: nodes and the last entry of the stack.
pub(super) const BEST_CACHES: KdCaches = KdCaches::COMPARED[4];
/// Their place among the source's forms that have caches.
const BEST_OF_SOURCE: usize = 3;

rows! {
    /// A form of execution in a scene.
    struct Row = "Rays in kd-trees by one thread each and by persistent threads" by [scene, form] {
        scene: String = "scene",
        counterpart: String = "counterpart",
        rays: u64 = "rays",
        form: String = "form",
        different: u64 = "hits that differ",
        closest: Repeats = "closest hits (M rays/s)",
        any: Repeats = "any hits (M rays/s)",
        both: Repeats = "both (M rays/s)",
        ratio: Repeats = "both, over one thread per ray",
        over_queue: Option<Repeats> = "both, cached over not",
        groups: Option<u64> = "workgroups",
        batch: Option<u64> = "rays per workgroup and dispatch",
    }
    beside "source: queue over one thread per ray" = |row| row.published().into();
    beside "source: cached over not" = |row| row.published_of_caches().into();
}
/// What was found.
pub type Found = Vec<Row>;

const CRITERIA: &[Criterion<Row>] = &[
    Criterion::each(
        "hits are those of one thread per ray",
        Bound::AtMost(0.0),
        |row: &Row| row.different.into(),
    )
    .in_every_form(),
    Criterion::each(
        "the queue's ratio is about the source's: over it",
        Bound::Between(2.0 / 3.0, 1.5),
        |row: &Row| row.ratio.scaled(1.0 / row.published().unwrap_or(f64::NAN)).measured(),
    )
    .among(|row| row.published().is_some())
    .because(
        "about, for a ratio: within a factor of 1.5 either way; the source has 0.89 and 1.88 to 2.38, on a GPU of 2008",
    ),
    Criterion::each(
        "nodes and the last entry cached make the queue faster, as they do the source's: ratio",
        Bound::AtLeast(1.0),
        |row: &Row| row.over_queue.as_ref().map_or(f64::NAN.into(), Repeats::measured),
    )
    .among(|row| row.published_of_caches().is_some())
    .because("the source has 1.008 to 1.061"),
];

impl Row {
    fn published(&self) -> Option<f64> {
        of_source(&THREADS, &self.counterpart)
            .copied()
            .filter(|_| self.form == QUEUE)
    }

    /// What its caches gain, of trees by its own heuristic.
    fn published_of_caches(&self) -> Option<f64> {
        let caches = of_source(&CACHES, &self.counterpart).filter(|_| self.form == CACHED)?;
        Some(1.0 + 0.01 * caches.speed[BEST_OF_SOURCE])
    }
}

/// A form by name, one thread per ray first.
fn forms(gpu: &Gpu) -> Vec<(&'static str, TraceSettings)> {
    let queue = TraceSettings::persistent(gpu.caps());
    let cached = TraceSettings {
        caches: BEST_CACHES,
        ..queue
    };
    let mut forms = vec![
        (BY_RAY, TraceSettings::ray_per_thread()),
        (QUEUE, queue),
        (CACHED, cached),
    ];
    if gpu.caps().subgroup.vote {
        let caches = KdCaches::SPECULATION;
        forms.push(("queue, leaves wait for a vote", TraceSettings { caches, ..queue }));
    }
    forms
}

/// The settings with the number of workgroups that traces these rays fastest.
///
/// # Errors
/// Those of kernels and of submissions.
pub(super) fn tuned(gpu: &Gpu, tree: &KdTree, settings: TraceSettings, flight: &Flight) -> Result<TraceSettings> {
    let fitted = settings.fitted(gpu.caps(), tree.device_traversal());
    let mut tracer = RayTracer::new(gpu, tree, &fitted)?;
    tracer.tune(&flight.closest())?;
    Ok(tracer.settings())
}

impl Study for Found {
    fn measure(context: &Context<'_>) -> Result<Self> {
        let gpu = (context.gpu)()?;
        each_flight(context, &cases(context), |case, surfaces, flight| {
            let settings = KdSettings {
                heuristic: Heuristic::SurfaceArea,
                clip: false,
                leaf_size: 1,
                ..KdSettings::default()
            };
            let tree = KdTree::build(&surfaces.triangles, &settings)?;
            in_scene(context, &gpu, case, &tree, flight)
        })
    }

    fn findings(&self) -> Findings {
        let queues = self.iter().filter(|row| row.form == QUEUE);
        Findings::of(self, CRITERIA)
            .headline(
                "rays per second by the queue over those by one thread per ray, geometric mean",
                geometric_mean(queues.map(|row| row.ratio.measured())),
            )
            .bars(
                "rates",
                "Rays per second over those by one thread per ray",
                self,
                |row| [row.scene.clone(), row.form.clone()],
                |row| row.ratio.measured(),
            )
            .note(
                "Flights as in `kd-heuristics`; trees by surface area over boxes with leaves of 1, which come nearest to the source's, traversal \
                 by a stack. Forms take turns; workgroups are the fastest power of two on the rays that ask for the closest hit. The source's \
                 ratio is of frames a second on one device of 2011, where persistent threads spare the scheduler's work for warps whose rays \
                 end at different times. A software driver has no such scheduler: it runs workgroups one after the other on each of the host's \
                 threads, and its cap on loops lets a workgroup trace only some dozens of rays per dispatch, so there the ratio says what the \
                 queue costs.",
            )
    }
}

/// All forms in one tree.
fn in_scene(context: &Context<'_>, gpu: &Gpu, case: &Case, tree: &KdTree, flight: &Flight) -> Result<Vec<Row>> {
    let forms = forms(gpu).into_iter();
    let forms = forms.map(|(form, settings)| Ok((form, tuned(gpu, tree, settings, flight)?)));
    let forms = forms.collect::<Result<Vec<_>>>()?;
    let contenders = forms.iter().map(|(_, settings)| (tree as &dyn RayIndex, *settings));
    let raced = race(context, gpu, flight, TURNS, contenders)?;
    let rows = forms.iter().zip(&raced).map(|((form, settings), timed)| {
        let threads = match settings.execution {
            Execution::RayPerThread => None,
            Execution::Persistent(threads) => Some(threads),
        };
        let [closest, any, both] = timed.rates.clone();
        // The queue without caches is the second.
        let over_queue = (*form == CACHED).then(|| both.over(&raced[1].rates[2]));
        Row {
            scene: case.name().into(),
            counterpart: case.counterpart.into(),
            rays: flight.rays() as u64,
            form: (*form).into(),
            different: different_of_both(&timed.hits, &raced[0].hits),
            closest,
            any,
            ratio: both.over(&raced[0].rates[2]),
            both,
            over_queue,
            groups: threads.map(|threads| threads.groups.into()),
            batch: threads.map(|threads| u64::from(threads.batch) * u64::from(threads.fetches)),
        }
    });
    Ok(rows.collect())
}
