//! Persistent threads in kd-trees beside one thread a ray: rates of both on flights through the source's scenes.
//!
//! Oracle: the hits of one thread a ray, to the bit. Source of the comparison: "Interactive Manycore Photon Mapping", PhD thesis, Trinity
//! College Dublin, 2011, table 4.1 and appendix A.1, whose code bases I and II are the two models of execution.

use clerestory::Result;
use clerestory::accel::RayIndex;
use clerestory::accel::kd::{Heuristic, KdCaches, KdSettings, KdTree};
use clerestory::accel::trace::{Execution, RayTracer, TraceSettings};
use clerestory::gpu::Gpu;

use super::flights::{Flight, cases, different_of_both, each_flight, race};
use crate::experiments::measures::Context;
use crate::experiments::table::{Cell, Table};

/// Frames a second of the source's persistent threads over those of one thread a ray, trees by surface area (table 4.1).
const PUBLISHED: [(&str, f64); 5] = [
    ("Scene 6", 341.8 / 382.2),
    ("Sponza", 215.6 / 99.6),
    ("Sibenik", 189.4 / 101.0),
    ("Fairy", 144.1 / 75.9),
    ("Conference", 171.0 / 71.9),
];

/// The best of the source's caches: nodes and the last entry of the stack.
const BEST_CACHES: KdCaches = KdCaches::COMPARED[4];

/// A form by name, one thread a ray first.
fn forms(gpu: &Gpu) -> Vec<(&'static str, TraceSettings)> {
    let queue = TraceSettings::persistent(gpu.caps());
    let cached = TraceSettings {
        caches: BEST_CACHES,
        ..queue
    };
    let mut forms = vec![
        ("ray per thread", TraceSettings::ray_per_thread()),
        ("queue", queue),
        ("queue, nodes and last entry cached", cached),
    ];
    if gpu.caps().subgroup.vote {
        let caches = KdCaches::SPECULATION;
        forms.push(("queue, leaves wait for a vote", TraceSettings { caches, ..queue }));
    }
    forms
}

/// The settings with the number of workgroups that traces these rays fastest.
fn tuned(gpu: &Gpu, tree: &KdTree, settings: TraceSettings, flight: &Flight) -> Result<TraceSettings> {
    let fitted = settings.fitted(gpu.caps(), tree.device_traversal());
    let mut tracer = RayTracer::new(gpu, tree, &fitted)?;
    tracer.tune(&flight.closest())?;
    Ok(tracer.settings())
}

/// The measure.
pub fn measure(context: &Context<'_>) -> Result<Vec<Table>> {
    let gpu = (context.gpu)()?;
    let mut table = Table::new(
        "Rays in kd-trees by one thread each and by persistent threads",
        &[
            "scene",
            "counterpart",
            "rays",
            "form",
            "timed hits that differ",
            "closest hits (M rays/s)",
            "any hits (M rays/s)",
            "both (M rays/s)",
            "ratio",
            "source: ratio",
            "workgroups",
            "rays a workgroup and dispatch",
        ],
    );
    each_flight(context, &cases(context), |case, surfaces, flight| {
        let settings = KdSettings {
            heuristic: Heuristic::SurfaceArea,
            clip: false,
            leaf_size: 1,
            ..KdSettings::default()
        };
        let tree = KdTree::build(&surfaces.triangles, &settings)?;
        let forms = forms(&gpu).into_iter();
        let forms = forms.map(|(name, settings)| Ok((name, tuned(&gpu, &tree, settings, flight)?)));
        let forms = forms.collect::<Result<Vec<_>>>()?;
        let contenders = forms.iter().map(|(_, settings)| (&tree as &dyn RayIndex, *settings));
        let raced = race(context, &gpu, flight, contenders)?;
        let published = PUBLISHED
            .iter()
            .find(|(counterpart, _)| *counterpart == case.counterpart);
        for (i, ((name, settings), one)) in forms.iter().zip(&raced).enumerate() {
            let (groups, rays) = match settings.execution {
                Execution::RayPerThread => ("all".into(), Cell::from("none")),
                Execution::Persistent(threads) => (
                    Cell::from(u64::from(threads.groups)),
                    (u64::from(threads.batch) * u64::from(threads.fetches)).into(),
                ),
            };
            table.row([
                case.name().into(),
                case.counterpart.into(),
                (flight.rays() as u64).into(),
                (*name).into(),
                different_of_both(&one.hits, &raced[0].hits).into(),
                one.rates[0].into(),
                one.rates[1].into(),
                one.rates[2].into(),
                (one.rates[2] / raced[0].rates[2]).into(),
                published.filter(|_| i == 1).map(|(_, ratio)| *ratio).into(),
                groups,
                rays,
            ]);
        }
        Ok(())
    })?;
    table.note(
        "Flights as in `kd-heuristics`; trees by surface area over boxes with leaves of 1, which come nearest to the source's, traversal \
         by a stack. Times are medians of runs that take turns; workgroups are the fastest power of two on the rays that ask for the \
         closest hit. The source's ratio is of frames a second on one device of 2011, where persistent threads spare the scheduler's work \
         for warps whose rays end at different times. A software driver has no such scheduler: it runs workgroups one after the other on \
         each of the host's threads, and its cap on loops lets a workgroup trace only some dozens of rays a dispatch, so here the ratio \
         says what the queue costs.",
    );
    Ok(vec![table])
}
