//! Persistent threads on a queue of rays beside one thread a ray: rates, exact work, and what the quotas of the queue cost.
//!
//! Oracle: the hits of one thread a ray, to the bit, and its work. Source of the comparison: "Interactive Manycore Photon Mapping", PhD
//! thesis, Trinity College Dublin, 2011, appendix A.1, whose trees by the surface area heuristic gave the persistent form a ratio of
//! 0.9 on a trivial scene and of 1.9 to 2.4 on four others.

use std::time::Instant;

use clerestory::accel::bvh2::{Bvh2, Bvh2Settings};
use clerestory::accel::trace::{Execution, PersistentThreads, RayTracer, TraceSettings, Traced};
use clerestory::accel::{Hit, Ray};
use clerestory::gpu::Gpu;
use clerestory::scene::Camera;
use clerestory::{Result, scene};
use glam::Vec3;

use super::Context;
use super::inputs::Random;
use crate::experiments::table::Table;
use crate::geometry;
use crate::machine::median;

/// The trivial scene first.
const SCENES: [&str; 4] = [
    "builtin:cornell-box",
    "builtin:materials",
    "builtin:sphere-flake?depth=3&frequency=4",
    "builtin:box-city?n=25000",
];

/// Pixels across and down, repeats, scenes.
const FULL: (u32, usize, usize) = (384, 15, SCENES.len());
const SMOKE: (u32, usize, usize) = (24, 1, 1);

/// One way to deal out rays, ready to run.
struct Form {
    name: String,
    tracer: RayTracer,
    seconds: Vec<f64>,
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
pub(super) fn primary_rays(camera: &Camera, side: u32) -> Result<Vec<Ray>> {
    let rays = geometry::camera_rays(camera, side)?.into_iter();
    Ok(rays.map(|(eye, direction)| ray(eye, direction, 0.0)).collect())
}

/// From where the rays end, in uniform directions.
pub(super) fn diffuse_rays(rays: &[Ray], hits: &[Hit]) -> Vec<Ray> {
    let mut random = Random::new(1);
    let met = rays.iter().zip(hits).filter(|(_, hit)| hit.is_hit());
    met.map(|(from, hit)| {
        let end = Vec3::from(from.origin) + hit.t * Vec3::from(from.direction);
        ray(end, random.direction().as_vec3(), 1e-3)
    })
    .collect()
}

/// The forms, those with a queue tuned to the rays.
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
        ("thread a ray", TraceSettings::thread_a_ray()),
        ("queue, batches of a subgroup", persistent(1)),
        ("queue, batches of 4 subgroups", persistent(4)),
    ] {
        let mut tracer = RayTracer::new(gpu, index, &settings)?;
        tracer.tune(rays)?;
        forms.push(Form {
            name: name.into(),
            tracer,
            seconds: Vec::new(),
        });
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

/// Words of a hit, to compare.
pub(super) fn bits(hit: &Hit) -> [u32; 4] {
    let [u, v] = hit.barycentrics.map(f32::to_bits);
    [hit.t.to_bits(), u, v, hit.triangle]
}

/// The measure.
pub fn measure(context: &Context<'_>) -> Result<Vec<Table>> {
    let (side, repeats, scenes) = if context.smoke { SMOKE } else { FULL };
    let gpu = (context.gpu)()?;
    let mut table = Table::new(
        "Rays by one thread each and by persistent threads",
        &[
            "scene",
            "rays",
            "form",
            "hits that differ",
            "M rays/s",
            "ratio",
            "nodes a ray",
            "triangles a ray",
            "workgroups",
            "batches",
            "dispatches",
            "rays stopped",
        ],
    );
    for address in &SCENES[..scenes] {
        let scene = scene::load(address)?;
        let index = Bvh2::build(&geometry::triangles(&scene), &Bvh2Settings::default())?;
        let primary = primary_rays(scene.require_camera(None)?, side)?;
        let hits = RayTracer::new(&gpu, &index, &TraceSettings::thread_a_ray())?
            .trace(&primary)?
            .hits;
        let diffuse = diffuse_rays(&primary, &hits);
        for (kind, rays) in [("primary", &primary), ("diffuse", &diffuse)] {
            let mut forms = forms(&gpu, &index, rays)?;
            for _ in 0..repeats {
                for form in &mut forms {
                    let begin = Instant::now();
                    let traced = form.tracer.trace(rays)?;
                    let wall = begin.elapsed().as_secs_f64();
                    let on_device = traced.seconds();
                    form.seconds.push(if on_device > 0.0 { on_device } else { wall });
                }
            }
            let mut first: Option<(Vec<f64>, Vec<Hit>)> = None;
            for form in &forms {
                let traced = count(&gpu, &index, rays, form)?;
                let seconds = median(form.seconds.clone());
                let (base, expected) = first.get_or_insert_with(|| (form.seconds.clone(), traced.hits.clone()));
                // Runs of one repeat lie side by side in time, so that other work on the machine slows both.
                let ratio = median(base.iter().zip(&form.seconds).map(|(a, b)| a / b).collect());
                let differ = traced.hits.iter().zip(&*expected).filter(|(a, b)| bits(a) != bits(b));
                let per_ray = |work: u64| work as f64 / rays.len().max(1) as f64;
                table.row([
                    (*address).into(),
                    kind.into(),
                    form.name.clone().into(),
                    (differ.count() as u64).into(),
                    (rays.len() as f64 / seconds * 1e-6).into(),
                    ratio.into(),
                    per_ray(traced.work.nodes).into(),
                    per_ray(traced.work.triangles).into(),
                    form.tracer
                        .groups()
                        .map_or_else(|| "all".into(), |n| n.to_string())
                        .into(),
                    traced.batches.into(),
                    u64::from(traced.dispatches).into(),
                    traced.unfinished.into(),
                ]);
            }
        }
    }
    table.note(
        "Rates by GPU timestamps, median of repeats in turn; the ratio is the median of those to one thread a ray in the same repeat. Workgroups are the fastest power \
         of two. Rays stopped by their quota go on in another round, which fetches all batches again.",
    );
    table.note(
        "The source's trees by the surface area heuristic gave ratios of 0.89 on its trivial scene and of 2.16, 1.88, 1.90 and 2.38 on four \
         others.",
    );
    Ok(vec![table])
}
