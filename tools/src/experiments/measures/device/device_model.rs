//! The cost model of the device: what a load costs by the size of what it lies in, what copies, tickets of a queue, boundaries between
//! dispatches and submissions cost.
//!
//! Source of the comparison: "Interactive Manycore Photon Mapping", PhD thesis, Trinity College Dublin, 2011, §2.2.2 to §2.2.4.

use clerestory::kernels::device_model::{DeviceModel, MAX_ITERATIONS};
use clerestory::{Error, Result};

use crate::experiments::measures::Context;
use crate::experiments::table::Table;
use crate::timing::{median, repeated};

/// Working sets as powers of two, bytes; copies likewise; steps of a walk, repeats, workgroups and tickets of an invocation, dispatches.
struct Plan {
    sets: std::ops::RangeInclusive<u32>,
    copies: &'static [u32],
    steps: u32,
    repeats: usize,
    groups: u32,
    fetches: u32,
    dispatches: u32,
}

const FULL: Plan = Plan {
    sets: 12..=26,
    copies: &[16, 20, 24, 26],
    steps: MAX_ITERATIONS,
    repeats: 9,
    groups: 64,
    fetches: 512,
    dispatches: 256,
};
const SMOKE: Plan = Plan {
    sets: 12..=13,
    copies: &[16],
    steps: 256,
    repeats: 1,
    groups: 2,
    fetches: 8,
    dispatches: 4,
};

/// Clock of the source's GPU, cycles a nanosecond: 1.296 GHz of its processors.
const SOURCE_CLOCK: f64 = 1.296;
/// Largest working set as a power of two, and the cycles that the source gives for loads from it.
const SOURCE_CYCLES: [(u32, f64); 3] = [(23, 440.0), (25, 487.0), (u32::MAX, 698.0)];

/// What timestamps can tell apart at best.
const LEAST_SECONDS: f64 = 1e-9;

/// Median of some runs after one that warms up, above zero.
fn typical(repeats: usize, mut run: impl FnMut() -> Result<f64>) -> Result<f64> {
    let ((), seconds) = repeated(repeats, || Ok(((), run()?)))?;
    Ok(median(seconds).max(LEAST_SECONDS))
}

/// The measure.
pub fn measure(context: &Context<'_>) -> Result<Vec<Table>> {
    let plan = if context.smoke { &SMOKE } else { &FULL };
    let gpu = (context.gpu)()?;
    let model = DeviceModel::new(&gpu)?;
    let caps = gpu.caps();
    let mut facts = Table::new("The device", &["what", "value"]);
    for (what, value) in [
        ("lanes of a subgroup", u64::from(caps.subgroup_size)),
        (
            "shared memory of a workgroup (bytes)",
            u64::from(caps.max_shared_memory),
        ),
        ("invocations of a workgroup", u64::from(caps.max_workgroup_invocations)),
        ("push constants (bytes)", u64::from(caps.max_push_constants)),
        ("storage buffer (bytes)", caps.max_storage_buffer_range),
        ("heap (bytes)", caps.device_heap),
    ] {
        facts.row([what.into(), value.into()]);
    }
    facts.note(format!("{}, driver {}.", caps.device, caps.driver));

    let mut loads = Table::new(
        "Loads that wait for each other",
        &["working set (KiB)", "ns a load", "source's GPU (ns)"],
    );
    let sets = plan.sets.clone();
    for (done, set) in sets.clone().enumerate() {
        if context.watch.stopped() {
            break;
        }
        context.watch.begin("loads", done, sets.clone().count());
        let chain = model.chain(1 << set)?;
        let seconds = typical(plan.repeats, || chain.walk(plan.steps))?;
        // What an empty dispatch takes is no part of the walk.
        let idle = typical(plan.repeats, || chain.walk(0))?;
        let source = SOURCE_CYCLES.iter().find(|(largest, _)| set <= *largest);
        loads.row([
            (1_u64 << (set - 10)).into(),
            (1e9 * (seconds - idle).max(0.0) / f64::from(plan.steps)).into(),
            source.map_or("none".into(), |(_, cycles)| (cycles / SOURCE_CLOCK).into()),
        ]);
    }
    loads.note(format!(
        "One invocation follows a random cycle of indices 64 bytes apart for {} steps, medians of {}, less an empty dispatch. A step is a \
         load, a test and a jump. The source's GPU (GTX 280, 1.296 GHz) has no cache before its memory: 436 to 443 cycles up to 8 MiB, \
         487 up to 32 MiB, 698 beyond, by the reach of its address translation; here the steps are those of the caches.",
        plan.steps, plan.repeats
    ));

    let mut copies = Table::new("Copies", &["KiB", "by a kernel (GB/s)", "by the copy command (GB/s)"]);
    for size in plan.copies {
        let copy = model.copies(1 << size)?;
        let rate = |seconds: f64| 1e-9 * copy.bytes() as f64 / seconds;
        let (by_kernel, by_command) = (
            typical(plan.repeats, || copy.by_kernel())?,
            typical(plan.repeats, || copy.by_command())?,
        );
        if !copy.are_equal()? {
            return Err(Error::setting("copy", *size, "is not what was copied"));
        }
        copies.row([
            (1_u64 << (size - 10)).into(),
            rate(by_kernel).into(),
            rate(by_command).into(),
        ]);
    }
    copies.note("Bytes copied a second; each is read once and written once.");

    let mut queue = Table::new(
        "Tickets of one counter and boundaries",
        &["what", "tickets", "M/s", "ns"],
    );
    for by_subgroup in [false, true] {
        let mut given = 0;
        let seconds = typical(plan.repeats, || {
            let tickets = model.tickets(plan.groups, plan.fetches, by_subgroup)?;
            given = u64::from(tickets.given);
            Ok(tickets.seconds)
        })?;
        let what = if by_subgroup {
            "tickets, a subgroup at once"
        } else {
            "tickets, each invocation by itself"
        };
        let each = seconds / given.max(1) as f64;
        queue.row([what.into(), given.into(), (1e-6 / each).into(), (1e9 * each).into()]);
    }
    let boundary = typical(plan.repeats, || model.boundaries(plan.dispatches))? / f64::from(plan.dispatches);
    let submission = typical(plan.repeats, || model.submission())?;
    for (what, seconds) in [
        ("dispatch of one idle invocation with a barrier", boundary),
        ("submission of one, to the end of waiting", submission),
    ] {
        queue.row([
            what.into(),
            "none".into(),
            (1e-6 / seconds).into(),
            (1e9 * seconds).into(),
        ]);
    }
    queue.note(
        "Persistent threads fetch rays as tickets, a subgroup at once; a ray costs microseconds, so that the counter is no bottleneck where a \
         ticket costs nanoseconds. Kernels that go through levels pay a boundary for each.",
    );
    Ok(vec![facts, loads, copies, queue])
}
