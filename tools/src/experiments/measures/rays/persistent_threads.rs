//! Persistent threads on a queue of rays beside one thread per ray: rates, exact work, and what the quotas of the queue cost.
//!
//! Oracle: the hits of one thread per ray, to the bit, and its work. Source of the comparison: B. Fabianowski, "Interactive Manycore Photon Mapping", PhD
//! thesis, Trinity College Dublin, 2011, appendix A.1, whose trees by the surface area heuristic gave the persistent form a ratio of
//! 0.9 on a trivial scene and of 1.9 to 2.4 on four others.

use clerestory::accel::bvh2::{Bvh2, Bvh2Settings};
use clerestory::accel::trace::{Execution, PersistentThreads, RayTracer, TraceSettings, Traced};
use clerestory::accel::{Hit, Ray};
use clerestory::gpu::Gpu;
use clerestory::scene::Camera;
use clerestory::{Result, scene};
use glam::Vec3;

use crate::experiments::findings::{Bound, Criterion, Findings, Repeats, Study, geometric_mean, rows};
use crate::experiments::measures::Context;
use crate::experiments::reference::short_name;
use crate::geometry;
use crate::random::Random;
use crate::timing::timed;

/// The trivial scene first.
const SCENES: [&str; 4] = [
    "builtin:cornell-box",
    "builtin:materials",
    "builtin:sphere-flake?depth=3&frequency=4",
    "builtin:box-city?n=25000",
];

const ONE_THREAD: &str = "ray per thread";

/// One way to deal out rays, ready to run.
struct Form {
    name: &'static str,
    tracer: RayTracer,
}

fn ray(origin: Vec3, direction: Vec3, t_min: f32) -> Ray {
    Ray {
        origin: origin.into(),
        t_min,
        direction: direction.into(),
        t_max: f32::INFINITY,
    }
}

/// A ray through the middle of each pixel, row by row.
fn primary_rays(camera: &Camera, side: u32) -> Result<Vec<Ray>> {
    let rays = geometry::camera_rays(camera, side)?.into_iter();
    Ok(rays.map(|(eye, direction)| ray(eye, direction, 0.0)).collect())
}

/// From where the rays end, in uniform directions.
fn diffuse_rays(rays: &[Ray], hits: &[Hit]) -> Vec<Ray> {
    let mut random = Random::new(1);
    let met = rays.iter().zip(hits).filter(|(_, hit)| hit.is_hit());
    met.map(|(from, hit)| {
        let end = Vec3::from(from.origin) + hit.t * Vec3::from(from.direction);
        ray(end, random.direction().as_vec3(), 1e-3)
    })
    .collect()
}

/// The forms, one thread per ray first, those with a queue tuned to the rays.
fn forms(gpu: &Gpu, index: &Bvh2, rays: &[Ray]) -> Result<Vec<Form>> {
    let threads = PersistentThreads::on(gpu.caps());
    let persistent = |subgroups: u32| {
        let batch = subgroups * gpu.caps().subgroup_size.max(1);
        TraceSettings {
            execution: Execution::Persistent(PersistentThreads {
                batch,
                // A workgroup's quota of rays stays what it is.
                fetches: (threads.fetches * threads.batch / batch).max(1),
                ..threads
            }),
            ..TraceSettings::persistent(gpu.caps())
        }
    };
    let mut forms = Vec::new();
    for (name, settings) in [
        (ONE_THREAD, TraceSettings::ray_per_thread()),
        ("queue, batches of a subgroup", persistent(1)),
        ("queue, batches of 4 subgroups", persistent(4)),
    ] {
        let mut tracer = RayTracer::new(gpu, index, &settings)?;
        tracer.tune(rays)?;
        forms.push(Form { name, tracer });
    }
    Ok(forms)
}

/// As [`Form`]s trace, with counts of the work.
fn count(gpu: &Gpu, index: &Bvh2, rays: &[Ray], form: &Form) -> Result<Traced> {
    let settings = TraceSettings {
        count: true,
        ..form.tracer.settings()
    };
    RayTracer::new(gpu, index, &settings)?.trace(rays)
}

/// How many of the hits are not those expected, to the bit; those that are missing too.
fn different(hits: &[Hit], expected: &[Hit]) -> u64 {
    let pairs = hits.iter().zip(expected);
    let missing = hits.len().abs_diff(expected.len());
    (pairs.filter(|(a, b)| bits(a) != bits(b)).count() + missing) as u64
}

fn bits(hit: &Hit) -> [u32; 4] {
    let [u, v] = hit.barycentrics.map(f32::to_bits);
    [hit.t.to_bits(), u, v, hit.triangle]
}

rows! {
    /// A form on rays of a kind in a scene.
    struct Row = "Rays by one thread each and by persistent threads" by [scene, kind, form] {
        scene: String = "scene",
        kind: String = "rays",
        form: String = "form",
        differ: u64 = "hits that differ, of timed and of counting kernels",
        rate: Repeats = "rate (M rays/s)",
        ratio: Repeats = "rate over one thread per ray's",
        nodes: f64 = "nodes per ray",
        triangles: f64 = "triangles per ray",
        other_work: u64 = "nodes and triangles more or fewer than one thread per ray's",
        groups: Option<u64> = "workgroups that stay",
        batches: u64 = "batches",
        dispatches: u64 = "dispatches",
        unfinished: u64 = "rays stopped",
    }
}
/// What was found.
pub type Found = Vec<Row>;

const CRITERIA: &[Criterion<Row>] = &[
    Criterion::each("no hits differ", Bound::AtMost(0.0), |row: &Row| row.differ.into()).in_every_form(),
    Criterion::each(
        "the work is equal: nodes and triangles more or fewer",
        Bound::AtMost(0.0),
        |row: &Row| row.other_work.into(),
    )
    .in_every_form(),
    Criterion::each(
        "a queue's rate is not below that of one thread per ray",
        Bound::AtLeast(1.0),
        |row: &Row| (&row.ratio).into(),
    )
    .among(Row::has_queue),
];

impl Row {
    fn has_queue(&self) -> bool {
        self.form != ONE_THREAD
    }

    /// All but scene, kind and times of a form, with the hits of its timed kernels, beside what one thread per ray found.
    fn of(form: &Form, traced: &Traced, timed: &[Hit], first: &Traced, rays: usize) -> Self {
        let per_ray = |work: u64| work as f64 / rays.max(1) as f64;
        let steps = |traced: &Traced| traced.work.nodes + traced.work.triangles;
        Self {
            form: form.name.into(),
            differ: different(&traced.hits, &first.hits) + different(timed, &first.hits),
            nodes: per_ray(traced.work.nodes),
            triangles: per_ray(traced.work.triangles),
            other_work: steps(traced).abs_diff(steps(first)),
            groups: form.tracer.groups().map(u64::from),
            batches: traced.batches,
            dispatches: traced.dispatches.into(),
            unfinished: traced.unfinished,
            ..Self::default()
        }
    }
}

impl Study for Found {
    fn measure(context: &Context<'_>) -> Result<Self> {
        let side = context.pick(384, 24);
        let gpu = (context.gpu)()?;
        let name = |address: &&str| short_name(address).to_owned();
        context.each(context.first(&SCENES, 1), name, |address| {
            let scene = scene::load(address)?;
            let index = Bvh2::build(&geometry::triangles(&scene), &Bvh2Settings::default())?;
            let primary = primary_rays(scene.require_camera(None)?, side)?;
            let hits = RayTracer::new(&gpu, &index, &TraceSettings::ray_per_thread())?
                .trace(&primary)?
                .hits;
            let diffuse = diffuse_rays(&primary, &hits);
            let mut rows = Vec::new();
            for (kind, rays) in [("primary", &primary), ("diffuse", &diffuse)] {
                let found = of_rays(context, &gpu, &index, rays)?;
                rows.extend(found.into_iter().map(|row| Row {
                    scene: short_name(address).into(),
                    kind: kind.into(),
                    ..row
                }));
            }
            Ok(rows)
        })
    }

    fn findings(&self) -> Findings {
        let queues = self.iter().filter(|row| row.has_queue());
        Findings::of(self, CRITERIA)
            .headline(
                "rate by queues over one thread per ray's, geometric mean",
                geometric_mean(queues.map(|row| row.ratio.measured())),
            )
            .note(
                "Rates by GPU timestamps, in turns. Hits are those of the last timed turn and of the kernel that counts the work, both against one thread \
                 per ray's with counts. Workgroups are the fastest power of two. Rays stopped by their quota go on in another round, \
                 which fetches all batches again.",
            )
            .note(
                "The source's trees by the surface area heuristic gave ratios of 0.89 on its trivial scene and of 2.16, 1.88, 1.90 and 2.38 on \
                 four others.",
            )
            .bars(
                "ratio",
                "Rate over that of one thread per ray",
                self,
                |row| [format!("{}, {} rays", row.scene, row.kind), row.form.clone()],
                |row| row.ratio.measured(),
            )
    }
}

/// All forms on some rays.
fn of_rays(context: &Context<'_>, gpu: &Gpu, index: &Bvh2, rays: &[Ray]) -> Result<Vec<Row>> {
    let forms = forms(gpu, index, rays)?;
    // Of the last of the timed turns.
    let mut hits = vec![Vec::new(); forms.len()];
    let seconds = context.in_turns(15, forms.len(), |i| {
        let (traced, wall) = timed(|| forms[i].tracer.trace(rays));
        let traced = traced?;
        let on_device = traced.seconds();
        hits[i] = traced.hits;
        Ok(if on_device > 0.0 { on_device } else { wall })
    })?;
    let seconds: Vec<Repeats> = seconds.into_iter().map(Repeats).collect();
    let first = count(gpu, index, rays, &forms[0])?;
    let of = |((form, time), hits): ((&Form, &Repeats), &Vec<Hit>)| {
        let traced = count(gpu, index, rays, form)?;
        let rate = |seconds: &f64| rays.len() as f64 / seconds * 1e-6;
        Ok(Row {
            rate: time.0.iter().map(rate).collect(),
            ratio: seconds[0].over(time),
            ..Row::of(form, &traced, hits, &first, rays.len())
        })
    };
    forms.iter().zip(&seconds).zip(&hits).map(of).collect()
}
