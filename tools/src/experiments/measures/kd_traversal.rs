//! Schemes and caches of the traversal of kd-trees beside each other, and beside the binned hierarchy: hits, exact work, rates.
//!
//! Oracle: the hits of the binned hierarchy, to the bit. Source of the comparison: "Interactive Manycore Photon Mapping", PhD thesis, Trinity
//! College Dublin, 2011, tables 4.5 and 4.8.

use clerestory::accel::bvh2::{Bvh2, Bvh2Settings};
use clerestory::accel::kd::{KdCaches, KdSettings, KdTree, Scheme};
use clerestory::accel::trace::{Execution, PersistentThreads, RayTracer, TraceSettings};
use clerestory::accel::{Hit, Ray, RayIndex};
use clerestory::gpu::{DeviceKind, Gpu};
use clerestory::{Result, scene};

use super::Context;
use super::persistent_threads::{bits, diffuse_rays, primary_rays};
use crate::experiments::table::Table;
use crate::geometry;
use crate::machine::median;

/// The trivial scene first.
const SCENES: [&str; 4] = [
    "builtin:cornell-box",
    "builtin:materials",
    "builtin:box-city?n=4000",
    "builtin:sphere-flake?depth=3&frequency=4",
];

/// Pixels across and down, repeats, scenes.
const FULL: (u32, usize, usize) = (256, 5, SCENES.len());
const SMOKE: (u32, usize, usize) = (16, 1, 1);

const fn flags(push_down: bool, short_stack: u32) -> Scheme {
    Scheme::Flags { push_down, short_stack }
}

const SCHEMES: [(&str, Scheme); 5] = [
    ("stack", Scheme::Stack),
    ("flags, plain", flags(false, 0)),
    ("flags, push-down", flags(true, 0)),
    ("flags, short stack of 4", flags(false, 4)),
    ("flags, both", flags(true, 4)),
];

const CACHES: [&str; 7] = [
    "queue",
    "queue, nodes",
    "queue, head of the stack",
    "queue, waiting leaf",
    "queue, nodes and head",
    "queue, nodes with boxes and bytes",
    "queue, nodes and waiting leaf",
];

/// One way to trace, and the stack's or the queue's that it is compared with.
struct Form<'a> {
    name: &'static str,
    index: &'a dyn RayIndex,
    settings: TraceSettings,
    starts_group: bool,
}

/// Queues whose workgroups are large enough for loading a cache to pay.
fn queue(gpu: &Gpu) -> TraceSettings {
    let lanes = gpu.caps().subgroup_size.max(1);
    let software = gpu.caps().kind == DeviceKind::Cpu;
    let subgroups = (256 / lanes).clamp(1, 8);
    TraceSettings {
        execution: Execution::Persistent(PersistentThreads {
            subgroups,
            batch: subgroups * lanes,
            fetches: if software { 2 } else { 64 },
            ..PersistentThreads::on(gpu.caps())
        }),
        ..TraceSettings::thread_a_ray()
    }
}

fn forms<'a>(gpu: &Gpu, bvh: &'a Bvh2, kd: &'a KdTree) -> Vec<Form<'a>> {
    let thread_a_ray = TraceSettings::thread_a_ray();
    let mut forms = vec![Form {
        name: "binned hierarchy",
        index: bvh,
        settings: thread_a_ray,
        starts_group: true,
    }];
    forms.extend(SCHEMES.map(|(name, scheme)| Form {
        name,
        index: kd,
        settings: TraceSettings { scheme, ..thread_a_ray },
        starts_group: scheme == Scheme::Stack,
    }));
    let cached = CACHES.into_iter().zip(KdCaches::COMPARED);
    forms.extend(cached.map(|(name, caches)| Form {
        name,
        index: kd,
        settings: TraceSettings { caches, ..queue(gpu) },
        starts_group: caches == KdCaches::default(),
    }));
    forms
}

/// Adds a row a form for one set of rays.
fn compare(
    table: &mut Table,
    gpu: &Gpu,
    forms: &[Form<'_>],
    names: [&str; 2],
    rays: &[Ray],
    repeats: usize,
) -> Result<()> {
    let mut truth: Option<Vec<Hit>> = None;
    let (mut base_rate, mut base_nodes) = (0.0, 0.0);
    for form in forms {
        let settings = form.settings.fitted(gpu.caps(), form.index.device_traversal());
        let tracer = RayTracer::new(gpu, form.index, &settings)?;
        let mut seconds = Vec::new();
        for _ in 0..=repeats {
            seconds.push(tracer.trace(rays)?.seconds());
        }
        // The first may compile the kernel.
        let rate = rays.len() as f64 / median(seconds.split_off(1)) * 1e-6;
        let counting = TraceSettings {
            count: true,
            ..settings
        };
        let traced = RayTracer::new(gpu, form.index, &counting)?.trace(rays)?;
        let expected = truth.get_or_insert_with(|| traced.hits.clone());
        let differ = traced.hits.iter().zip(&*expected).filter(|(a, b)| bits(a) != bits(b));
        let per_ray = |work: u64| work as f64 / rays.len().max(1) as f64;
        let nodes = per_ray(traced.work.nodes);
        if base_rate == 0.0 {
            base_rate = rate;
        }
        if form.starts_group {
            base_nodes = nodes;
        }
        let work = traced.kd_work;
        table.row([
            names[0].into(),
            names[1].into(),
            form.name.into(),
            (differ.count() as u64).into(),
            rate.into(),
            (rate / base_rate).into(),
            nodes.into(),
            (100.0 * (nodes / base_nodes - 1.0)).into(),
            per_ray(work.cached_nodes).into(),
            per_ray(traced.work.triangles).into(),
            per_ray(work.pushes + work.pops).into(),
            per_ray(work.register_pushes + work.register_pops).into(),
            per_ray(work.bytes()).into(),
        ]);
    }
    Ok(())
}

/// The measure.
pub fn measure(context: &Context<'_>) -> Result<Vec<Table>> {
    let (side, repeats, scenes) = if context.smoke { SMOKE } else { FULL };
    let gpu = (context.gpu)()?;
    let mut table = Table::new(
        "Rays through kd-trees by every scheme and with caches",
        &[
            "scene",
            "rays",
            "form",
            "hits that differ",
            "M rays/s",
            "ratio",
            "nodes a ray",
            "change, %",
            "of them cached",
            "triangles a ray",
            "stack entries a ray",
            "in registers",
            "bytes a ray",
        ],
    );
    for address in &SCENES[..scenes] {
        let scene = scene::load(address)?;
        let triangles = geometry::triangles(&scene);
        let bvh = Bvh2::build(&triangles, &Bvh2Settings::default())?;
        let kd = KdTree::build(&triangles, &KdSettings::default())?;
        let forms = forms(&gpu, &bvh, &kd);
        let primary = primary_rays(scene.require_camera(None)?, side)?;
        let first = RayTracer::new(&gpu, &bvh, &TraceSettings::thread_a_ray())?.trace(&primary)?;
        let diffuse = diffuse_rays(&primary, &first.hits);
        for (kind, rays) in [("primary", &primary), ("diffuse", &diffuse)] {
            compare(&mut table, &gpu, &forms, [address, kind], rays, repeats)?;
        }
    }
    table.note(
        "Rates by GPU timestamps, medians; their ratio is to the binned hierarchy. The change of nodes is that to the stack, and with caches to the \
         queue without. A node of the hierarchy is two boxes, of a kd-tree a plane. Bytes are 8 for each node and stack entry from memory.",
    );
    table.note(
        "The source has, on a GPU of 2008, 123 % more nodes for plain flags, 77 % for push-down and 0.4 % with the short stack, means of five scenes; with \
         caches 13 % more for the waiting leaf, and 53, 19, -11, 72, 60 and 45 % fewer bytes in the order of the rows. There a leaf with a hit ends a \
         ray; here leaves are gone through that begin before it.",
    );
    Ok(vec![table])
}
