//! The cost model of the device: what a load costs by the size of what it lies in, what copies, tickets of a queue, boundaries between
//! dispatches and submissions cost.
//!
//! Source of the comparison: B. Fabianowski, "Interactive Manycore Photon Mapping", PhD thesis, Trinity College Dublin, 2011, §2.2.2 to §2.2.4.

use clerestory::accel::Ray;
use clerestory::accel::bvh2::{Bvh2, Bvh2Settings};
use clerestory::accel::trace::{RayTracer, TraceSettings};
use clerestory::gpu::{Caps, Gpu};
use clerestory::kernels::device_model::{DeviceModel, MAX_ITERATIONS};
use clerestory::{Result, scene};

use crate::experiments::findings::{Axes, Bound, Criterion, Findings, Repeats, Study, curves, rows};
use crate::experiments::measures::Context;
use crate::geometry;
use crate::timing::timed;

/// Working sets as powers of two, bytes; copies likewise; steps of a walk, workgroups and tickets of an invocation, side of a picture of rays,
/// dispatches.
struct Plan {
    sets: std::ops::RangeInclusive<u32>,
    copies: &'static [u32],
    steps: u32,
    groups: u32,
    fetches: u32,
    side: u32,
    dispatches: u32,
}

const FULL: Plan = Plan {
    sets: 12..=26,
    copies: &[16, 20, 24, 26],
    steps: MAX_ITERATIONS,
    groups: 64,
    fetches: 512,
    side: 384,
    dispatches: 256,
};
const SMOKE: Plan = Plan {
    sets: 12..=13,
    copies: &[16],
    steps: 256,
    groups: 2,
    fetches: 8,
    side: 16,
    dispatches: 4,
};

/// Clock of the source's GPU, cycles a nanosecond: 1.296 GHz of its processors.
const SOURCE_CLOCK: f64 = 1.296;
/// Largest working set, KiB, and the cycles that the source gives for loads from it.
const SOURCE_CYCLES: [(u64, f64); 3] = [(8 << 10, 440.0), (32 << 10, 487.0), (u64::MAX, 698.0)];

/// What timestamps can tell apart at best.
const LEAST_SECONDS: f64 = 1e-9;
const TURNS: usize = 9;
/// Invocations of a workgroup that takes tickets.
const GROUP_SIZE: u32 = 64;
/// Whose rays tickets are held against: few triangles, so that no rays of a scene cost less.
const CHEAPEST: &str = "builtin:cornell-box";

rows! {
    /// A fact of the device.
    struct Fact = "The device" by [what] {
        what: String = "what",
        value: u64 = "value",
    }
}

rows! {
    /// A walk through a working set.
    struct Load = "Loads that wait for each other" by [set] {
        set: u64 = "working set (KiB)",
        steps: u64 = "steps",
        time: Repeats = "a load (ns)",
    }
    beside "GTX 280, 1.296 GHz (source): a load (ns)" = |row| of_source(row.set).into();
}

rows! {
    /// Copies of a size.
    struct Copied = "Copies" by [size] {
        size: u64 = "size (KiB)",
        by_kernel: Repeats = "by a kernel (GB/s)",
        by_command: Repeats = "by the copy command (GB/s)",
        differ: u64 = "copies that differ",
    }
}

rows! {
    /// A way to draw tickets.
    struct Ticket = "Tickets of one counter" by [way] {
        way: String = "way",
        tickets: u64 = "tickets",
        wrong: u64 = "runs that do not give each once",
        time: Repeats = "a ticket (ns)",
        ray: Repeats = "a ray (ns)",
        over_ray: Repeats = "a ticket over a ray",
    }
}

rows! {
    /// A boundary.
    struct Boundary = "Boundaries" by [what] {
        what: String = "what",
        time: Repeats = "time (ns)",
    }
}

/// What was found.
#[derive(Debug, Default, serde::Serialize, serde::Deserialize)]
pub struct Found {
    facts: Vec<Fact>,
    loads: Vec<Load>,
    copies: Vec<Copied>,
    tickets: Vec<Ticket>,
    boundaries: Vec<Boundary>,
}

const BY_SUBGROUPS: &str = "a subgroup at once";

const OF_COPIES: &[Criterion<Copied>] =
    &[Criterion::each("copies are exact", Bound::AtMost(0.0), |row: &Copied| row.differ.into()).in_every_form()];

const OF_TICKETS: &[Criterion<Ticket>] = &[
    Criterion::each("tickets are exact", Bound::AtMost(0.0), |row: &Ticket| row.wrong.into()).in_every_form(),
    Criterion::each(
        "one counter is no bottleneck of persistent threads: a ticket's time over that of a ray",
        Bound::AtMost(0.1),
        |row: &Ticket| (&row.over_ray).into(),
    )
    .among(|row| row.way == BY_SUBGROUPS)
    .because("far below what the cheapest rays take, of the same run: a tenth"),
];

impl Study for Found {
    fn measure(context: &Context<'_>) -> Result<Self> {
        let plan = context.pick(&FULL, &SMOKE);
        let gpu = (context.gpu)()?;
        let model = DeviceModel::new(&gpu)?;
        let kib = |power: &u32| format!("{} KiB", kib(*power));
        let sets: Vec<u32> = plan.sets.clone().collect();
        Ok(Self {
            facts: facts(gpu.caps()),
            loads: context.each(&sets, kib, |set| Ok(vec![load(context, plan, &model, *set)?]))?,
            copies: context.each(plan.copies, kib, |size| Ok(vec![copied(context, &model, *size)?]))?,
            tickets: tickets(context, plan, &gpu, &model)?,
            boundaries: boundaries(context, plan, &model)?,
        })
    }

    fn findings(&self) -> Findings {
        let last = self.loads.last();
        let (ours, theirs) = ("this device".to_owned(), "the source's GPU".to_owned());
        let mut loads = curves(
            &self.loads,
            |_| ours.clone(),
            |row| (row.set as f64, row.time.measured()),
        );
        loads.extend(curves(
            &self.loads,
            |_| theirs.clone(),
            |row| (row.set as f64, of_source(row.set).unwrap_or(f64::NAN).into()),
        ));
        Findings::of(&self.facts, &[])
            .headline(
                "a load from the largest working set (ns)",
                last.map(|row| (&row.time).into()),
            )
            .and(Findings::of(&self.loads, &[]))
            .note(
                "One invocation follows a random cycle of indices 64 bytes apart; an empty dispatch is taken off turn by turn. A step is a load, a \
                 test and a jump. The source's GPU has no cache before its memory: its steps are by the reach of its address translation, here \
                 they are those of the caches.",
            )
            .curves(
                "loads",
                "Loads that wait for each other",
                Axes::rates("working set (KiB)", "a load (ns)"),
                loads,
            )
            .and(Findings::of(&self.copies, OF_COPIES))
            .note("Bytes copied a second; each is read once and written once.")
            .and(Findings::of(&self.tickets, OF_TICKETS))
            .note(
                "Persistent threads fetch rays as tickets, a subgroup at once. Beside them, in turns, rays of the eye through a Cornell box, one \
                 thread each: the time of all over their number.",
            )
            .and(Findings::of(&self.boundaries, &[]))
            .note("Kernels that go through levels pay a dispatch for each.")
    }
}

/// KiB of a power of two of bytes.
const fn kib(power: u32) -> u64 {
    1 << (power - 10)
}

/// What the source gives for a load from a working set of so many KiB, ns.
fn of_source(set: u64) -> Option<f64> {
    let within = SOURCE_CYCLES.iter().find(|(largest, _)| set <= *largest);
    within.map(|(_, cycles)| cycles / SOURCE_CLOCK)
}

fn facts(caps: &Caps) -> Vec<Fact> {
    let all = [
        ("lanes of a subgroup", caps.subgroup_size.into()),
        ("shared memory of a workgroup (bytes)", caps.max_shared_memory.into()),
        ("invocations of a workgroup", caps.max_workgroup_invocations.into()),
        ("push constants (bytes)", caps.max_push_constants.into()),
        ("storage buffer (bytes)", caps.max_storage_buffer_range),
        ("heap (bytes)", caps.device_heap),
    ];
    let of = |(what, value): (&str, u64)| Fact {
        what: what.into(),
        value,
    };
    all.into_iter().map(of).collect()
}

fn load(context: &Context<'_>, plan: &Plan, model: &DeviceModel, set: u32) -> Result<Load> {
    let chain = model.chain(1 << set)?;
    let walks = [plan.steps, 0];
    let seconds = context.in_turns(TURNS, walks.len(), |i| chain.walk(walks[i]))?;
    // What an empty dispatch takes is no part of the walk.
    let a_load = |(walk, idle): (&f64, &f64)| 1e9 * (walk - idle).max(0.0) / f64::from(plan.steps);
    Ok(Load {
        set: kib(set),
        steps: plan.steps.into(),
        time: seconds[0].iter().zip(&seconds[1]).map(a_load).collect(),
    })
}

fn copied(context: &Context<'_>, model: &DeviceModel, size: u32) -> Result<Copied> {
    let mut differ = 0;
    // Of each a new pair, so that neither finds what the other has copied.
    let ways = [model.copies(1 << size)?, model.copies(1 << size)?];
    let rates = context.in_turns(TURNS, ways.len(), |i| {
        let copy = &ways[i];
        let seconds = if i == 0 { copy.by_kernel() } else { copy.by_command() }?;
        Ok(1e-9 * copy.bytes() as f64 / seconds.max(LEAST_SECONDS))
    })?;
    for copy in &ways {
        differ += u64::from(!copy.are_equal()?);
    }
    let [by_kernel, by_command] = [0, 1].map(|way| Repeats(rates[way].clone()));
    Ok(Copied {
        size: kib(size),
        by_kernel,
        by_command,
        differ,
    })
}

/// Rays of the eye, and what traces them one thread each.
fn cheapest_rays(gpu: &Gpu, side: u32) -> Result<(RayTracer, Vec<Ray>)> {
    let scene = scene::load(CHEAPEST)?;
    let index = Bvh2::build(&geometry::triangles(&scene), &Bvh2Settings::default())?;
    let ray = |(origin, direction): (glam::Vec3, glam::Vec3)| Ray::new(origin, direction);
    let rays = geometry::camera_rays(scene.require_camera(None)?, side)?;
    let tracer = RayTracer::new(gpu, &index, &TraceSettings::ray_per_thread())?;
    Ok((tracer, rays.into_iter().map(ray).collect()))
}

fn tickets(context: &Context<'_>, plan: &Plan, gpu: &Gpu, model: &DeviceModel) -> Result<Vec<Ticket>> {
    let asked = plan.groups * GROUP_SIZE * plan.fetches;
    let joined = (0..asked).fold(0, |joined, ticket| joined ^ ticket);
    let (tracer, rays) = cheapest_rays(gpu, plan.side)?;
    let whats = ["each invocation by itself", BY_SUBGROUPS];
    let mut wrong = [0; 2];
    let times = context.in_turns(TURNS, whats.len() + 1, |i| {
        if i == whats.len() {
            let (traced, wall) = timed(|| tracer.trace(&rays));
            let on_device = traced?.seconds();
            let seconds = if on_device > 0.0 { on_device } else { wall };
            return Ok(1e9 * seconds.max(LEAST_SECONDS) / rays.len().max(1) as f64);
        }
        let tickets = model.tickets(plan.groups, plan.fetches, i == 1)?;
        wrong[i] += u64::from((tickets.given, tickets.joined) != (asked, joined));
        Ok(1e9 * tickets.seconds.max(LEAST_SECONDS) / f64::from(asked))
    })?;
    let times: Vec<Repeats> = times.into_iter().map(Repeats).collect();
    let ray = &times[whats.len()];
    let of = |((way, wrong), time): ((&str, u64), &Repeats)| Ticket {
        way: way.into(),
        tickets: asked.into(),
        wrong,
        time: time.clone(),
        ray: ray.clone(),
        over_ray: time.over(ray),
    };
    Ok(whats.into_iter().zip(wrong).zip(&times).map(of).collect())
}

fn boundaries(context: &Context<'_>, plan: &Plan, model: &DeviceModel) -> Result<Vec<Boundary>> {
    let whats = [
        "dispatch of one idle invocation with a barrier",
        "submission of one, to the end of waiting",
    ];
    let seconds = context.in_turns(TURNS, whats.len(), |i| match i {
        0 => Ok(model.boundaries(plan.dispatches)? / f64::from(plan.dispatches)),
        _ => model.submission(),
    })?;
    let of = |(what, seconds): (&str, Vec<f64>)| Boundary {
        what: what.into(),
        time: Repeats(seconds).scaled(1e9),
    };
    Ok(whats.into_iter().zip(seconds).map(of).collect())
}
