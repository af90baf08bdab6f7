//! Whether every way through a kd-tree finds the same hits: ten million rays by every scheme and every cache, on the device and on the host.
//!
//! Oracles: a bounding volume hierarchy's hits, to the bit; on a part of the rays all triangles in turn, in f32 to the bit and in f64 up to
//! the stated bounds ([`hit_errors`](super::hit_errors)).

use clerestory::accel::bvh2::{Bvh2, Bvh2Settings};
use clerestory::accel::kd::{KdCaches, KdSettings, KdTraversal, KdTree};
use clerestory::accel::trace::{Execution, PersistentThreads, Query, RayTracer, TraceSettings};
use clerestory::accel::{DeviceTraversal, Hit, Ray, RayIndex};
use clerestory::gpu::{DeviceKind, Gpu, SOFTWARE_LOOP_CAP};
use clerestory::{Result, scene};
use glam::Vec3;
use rayon::prelude::*;

use super::flights::{CASES, Case, different, told};
use super::hit_errors::{Reachable, Verdict, judge};
use super::kd_traversal::SCHEMES;
use super::{kd_caches, ray_kinds};
use crate::experiments::measures::Context;
use crate::experiments::measures::photon_maps::photon_scenes::Surfaces;
use crate::experiments::table::Table;

/// Scenes beside the source's: spheres of spheres, streets, soups of small and of large triangles, finely cut spheres.
static MORE: [Case; 5] = [
    Case::of_our_own("builtin:sphere-flake?depth=3&frequency=4", Vec3::Y),
    Case::of_our_own("builtin:box-city?n=25000", Vec3::Y),
    Case::of_our_own("builtin:triangle-soup?n=50000&size=0.02", Vec3::Y),
    Case::of_our_own("builtin:triangle-soup?n=5000&size=0.3", Vec3::Y),
    Case::of_our_own("builtin:materials", Vec3::Y),
];

/// How much is traced.
struct Amount {
    /// Rays of each kind in each scene.
    of_each: usize,
    /// Rays of a scene, or of a set of a hard case, that the host traces too.
    on_host: usize,
    /// Triangle tests of a scene, or of a set, by trying all triangles.
    tests: usize,
}

/// Ten scenes of six kinds: ten million rays.
const FULL: Amount = Amount {
    of_each: 166_667,
    on_host: 50_000,
    tests: 100_000_000,
};
const SMOKE: Amount = Amount {
    of_each: 40,
    on_host: 100,
    tests: 100_000,
};

/// Most triangles in a leaf of the trees that share their kernels; quotas of software devices depend on it.
const COMMON_LEAF: u32 = 64;

/// Workgroups of a queue's dispatch, so that software devices, whose workgroups trace a few rays each, need not millions of dispatches.
const LEAST_GROUPS: u32 = 128;

/// One way to find hits.
struct Variant {
    query: &'static str,
    execution: &'static str,
    words: &'static str,
    settings: TraceSettings,
}

/// All, of each query the one first that others are compared with.
fn variants(gpu: &Gpu) -> Vec<Variant> {
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

/// What was found of one variant.
#[derive(Default)]
struct Found {
    rays: u64,
    hits: u64,
    /// Hits that are not those of the hierarchy, or of any hits those of the first variant.
    different: u64,
    /// Answers that are not those of the closest hit.
    other_answers: u64,
    on_host: u64,
    /// Hits of the host that are not those of the device.
    different_on_host: u64,
}

/// What was found in one scene.
#[derive(Default)]
struct InScene {
    triangles: u64,
    rays: u64,
    hits: u64,
    /// Of all variants, device and host, and of the hierarchy on the host.
    different: u64,
    tried: u64,
    verdict: Verdict,
}

impl InScene {
    fn add(&mut self, other: &Self) {
        self.triangles += other.triangles;
        self.rays += other.rays;
        self.hits += other.hits;
        self.different += other.different;
        self.tried += other.tried;
        self.verdict = self.verdict.and(other.verdict);
    }

    fn write(&self, table: &mut Table, name: &str) {
        table.row([
            name.into(),
            self.triangles.into(),
            self.rays.into(),
            self.hits.into(),
            self.different.into(),
            self.tried.into(),
            self.verdict.different.into(),
            self.verdict.above.into(),
            self.verdict.parameter.into(),
            self.verdict.point.into(),
        ]);
    }
}

/// About `count` of them, evenly, with their places.
fn some<'a>(rays: &'a [Ray], hits: &'a [Hit], count: usize) -> Vec<(&'a Ray, &'a Hit)> {
    let step = rays.len().div_ceil(count.max(1)).max(1);
    rays.iter().zip(hits).step_by(step).collect()
}

fn count_hits(hits: &[Hit]) -> u64 {
    hits.iter().filter(|hit| hit.is_hit()).count() as u64
}

/// How many of these rays the host answers otherwise.
fn other_hits(rays: &[(&Ray, &Hit)], host: impl Fn(&Ray) -> Result<Hit> + Sync) -> Result<u64> {
    let other = |(ray, expected): &(&Ray, &Hit)| Ok(different(&[host(ray)?], &[**expected]));
    rays.par_iter().map(other).sum()
}

fn on_host(tree: &KdTree, settings: &TraceSettings, ray: &Ray) -> Result<Hit> {
    let traversal = match settings.query {
        Query::Closest => KdTraversal::closest(settings.scheme, ray),
        Query::Any => KdTraversal::any(settings.scheme, ray),
    };
    let mut traversal = traversal.with_caches(settings.caches)?;
    traversal.run(tree, ray, u64::MAX, &mut |_, _| true, &mut Default::default());
    Ok(traversal.hit)
}

/// Triangles with their rays and both indexes.
struct Set<'a> {
    triangles: &'a [[Vec3; 3]],
    rays: &'a [Ray],
    index: &'a Bvh2,
    tree: KdTree,
}

/// The settings with quotas that lose no ray; where leaves are too long for several batches a dispatch, with one.
fn fitted(gpu: &Gpu, settings: TraceSettings, traversal: DeviceTraversal) -> TraceSettings {
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

fn check(gpu: &Gpu, set: &Set<'_>, variants: &[Variant], found: &mut [Found], amount: &Amount) -> Result<InScene> {
    let closest = RayTracer::new(gpu, set.index, &TraceSettings::ray_per_thread())?
        .trace(set.rays)?
        .hits;
    let host_rays = some(set.rays, &closest, amount.on_host);
    let mut in_scene = InScene {
        triangles: set.triangles.len() as u64,
        rays: set.rays.len() as u64,
        hits: count_hits(&closest),
        different: other_hits(&host_rays, |ray| Ok(set.index.closest_hit(ray)))?,
        ..InScene::default()
    };
    let mut any: Option<Vec<Hit>> = None;
    for (variant, found) in variants.iter().zip(found) {
        let settings = fitted(gpu, variant.settings, set.tree.device_traversal());
        let hits = RayTracer::new(gpu, &set.tree, &settings)?.trace(set.rays)?.hits;
        let expected = match variant.settings.query {
            Query::Closest => &closest,
            Query::Any => any.get_or_insert_with(|| hits.clone()),
        };
        let answers = hits.iter().zip(&closest).filter(|(a, b)| a.is_hit() != b.is_hit());
        let host_rays = some(set.rays, &hits, amount.on_host);
        let one = Found {
            rays: hits.len() as u64,
            hits: count_hits(&hits),
            different: different(&hits, expected),
            other_answers: answers.count() as u64,
            on_host: host_rays.len() as u64,
            different_on_host: other_hits(&host_rays, |ray| on_host(&set.tree, &settings, ray))?,
        };
        in_scene.different += one.different + one.other_answers + one.different_on_host;
        found.rays += one.rays;
        found.hits += one.hits;
        found.different += one.different;
        found.other_answers += one.other_answers;
        found.on_host += one.on_host;
        found.different_on_host += one.different_on_host;
    }
    let reachable = Reachable::among(set.triangles);
    let tried = some(set.rays, &closest, amount.tests / reachable.count().max(1));
    let verdicts = tried.par_iter().map(|(ray, hit)| judge(&reachable, ray, hit));
    in_scene.tried = tried.len() as u64;
    in_scene.verdict = verdicts.reduce(Verdict::default, Verdict::and);
    Ok(in_scene)
}

/// Tracers of all variants, so that their kernels stay.
fn kept_kernels(gpu: &Gpu, variants: &[Variant]) -> Result<Vec<RayTracer>> {
    let tree = KdTree::build(&[[Vec3::ZERO, Vec3::X, Vec3::Y]], &KdSettings::default())?;
    let tracers = variants
        .iter()
        .map(|variant| RayTracer::new(gpu, &tree, &variant.settings));
    tracers.collect()
}

fn in_scene(
    gpu: &Gpu,
    case: &Case,
    seed: u32,
    variants: &[Variant],
    found: &mut [Found],
    amount: &Amount,
) -> Result<InScene> {
    let surfaces = Surfaces::load(&case.scene)?;
    let scene = scene::load(&case.scene)?;
    let camera = scene.require_camera(None)?;
    let kinds = ray_kinds::rays(&surfaces.triangles, surfaces.index(), camera, amount.of_each, seed)?;
    let set = Set {
        triangles: &surfaces.triangles,
        rays: &kinds.concat(),
        index: surfaces.index(),
        tree: KdTree::build(&surfaces.triangles, &KdSettings::default())?,
    };
    check(gpu, &set, variants, found, amount)
}

/// The measure.
pub fn measure(context: &Context<'_>) -> Result<Vec<Table>> {
    let gpu = (context.gpu)()?;
    let amount = if context.smoke { SMOKE } else { FULL };
    let variants = variants(&gpu);
    let kept = kept_kernels(&gpu, &variants)?;
    let mut found: Vec<Found> = variants.iter().map(|_| Found::default()).collect();
    let mut all = InScene::default();
    let mut scenes = Table::new(
        "Rays, differing hits and errors by scene",
        &[
            "scene",
            "triangles",
            "rays",
            "hits",
            "hits of all variants that differ",
            "rays tried on all triangles",
            "hits that differ from trying all",
            "hits above the bound in f64",
            "largest error of t (of its bound)",
            "largest error of u, v (of their bound)",
        ],
    );
    let mut wanted = CASES[..1].to_vec();
    if !context.smoke {
        wanted = [&CASES[..], &MORE].concat();
    }
    let wanted = told(context).unwrap_or(wanted);
    let hard = clerestory_hard_cases::all();
    let hard: Vec<_> = hard.iter().filter_map(|case| Some((case.name, case.rays?))).collect();
    let count = wanted.len() + hard.len();
    for (case, seed) in wanted.iter().zip(0..) {
        if context.watch.stopped() {
            break;
        }
        context.watch.begin(case.name(), seed as usize, count);
        let one = in_scene(&gpu, case, seed, &variants, &mut found, &amount)?;
        one.write(&mut scenes, case.name());
        all.add(&one);
    }
    for (done, (name, sets)) in (wanted.len()..).zip(&hard) {
        if context.watch.stopped() {
            break;
        }
        context.watch.begin(name, done, count);
        let mut one = InScene::default();
        for set in sets() {
            let index = Bvh2::build(&set.triangles, &Bvh2Settings::default())?;
            let set = Set {
                triangles: &set.triangles,
                rays: &set.rays,
                index: &index,
                tree: KdTree::build(&set.triangles, &KdSettings::default())?,
            };
            one.add(&check(&gpu, &set, &variants, &mut found, &amount)?);
        }
        one.write(&mut scenes, &format!("hard case: {name}"));
        all.add(&one);
    }
    drop(kept);
    all.write(&mut scenes, "all");
    let mut table = Table::new(
        "Hits of every variant",
        &[
            "query",
            "execution",
            "variant",
            "rays",
            "hits",
            "hits that differ",
            "answers that differ",
            "rays on the host",
            "hits of the host that differ",
        ],
    );
    for (variant, found) in variants.iter().zip(&found) {
        table.row([
            variant.query.into(),
            variant.execution.into(),
            variant.words.into(),
            found.rays.into(),
            found.hits.into(),
            found.different.into(),
            found.other_answers.into(),
            found.on_host.into(),
            found.different_on_host.into(),
        ]);
    }
    table.note(format!(
        "Rays of {} in even shares, a fourth of those but the camera's and the diffuse ones with an end, and those of all hard cases; \
         kd-trees with default settings. A hit is t, u, v and the triangle, and differs where one bit of these does: closest hits from those of the engine's bounding volume \
         hierarchy on the device, any hits from those of the first variant; answers, whether there is a hit, from those of the closest. \
         The host traces an even part of the rays by the twin of each kernel. Devices whose division is not exact, which Vulkan lets them \
         have, may differ from the host in last bits; software devices must not.",
        ray_kinds::KINDS.join(", ")
    ));
    scenes.note(
        "All triangles are tried, for an even part of the rays, by the kernels' test in f32 and by the same test in f64. With u = 2⁻²⁴, M \
         the largest coordinate distance of a triangle's corner from the ray's origin, |d| the direction's largest component and s the \
         slopes of t in the triangle's plane across the ray, t must lie within 18uM/|d| + 16uMs of the plane's in f64, no triangle that \
         f64 meets clear of its edges may be nearer by more than that, and the point that u and v name must lie within 32uM of the ray \
         along each axis (`clerestory::accel::triangle`). Errors are shares of these bounds, the largest of all; above 1 a bound is \
         broken.",
    );
    Ok(vec![table, scenes])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::experiments::table::Cell;
    use crate::experiments::watch::Unwatched;

    #[test]
    fn no_variant_finds_another_hit_and_none_is_above_its_bound() {
        let context = Context {
            smoke: true,
            scenes: &[],
            gpu: &|| Gpu::headless(&clerestory::gpu::GpuOptions::default()),
            folder: std::path::Path::new(""),
            watch: &Unwatched,
        };
        let exact = (context.gpu)().unwrap().caps().kind == DeviceKind::Cpu;
        let tables = measure(&context).unwrap();
        let [variants, scenes] = &tables[..] else {
            panic!("{} tables", tables.len());
        };
        assert_eq!(variants.rows.len(), 2 * (SCHEMES.len() + KdCaches::COMPARED.len()));
        for row in &variants.rows {
            assert!(matches!(row[4], Cell::Count(hits) if hits > 1000), "{row:?}");
            assert_eq!(row[5..7], [Cell::Count(0), Cell::Count(0)], "{row:?}");
            assert!(!exact || row[8] == Cell::Count(0), "{row:?}");
        }
        for row in &scenes.rows {
            assert!(
                !exact || (row[4] == Cell::Count(0) && row[6] == Cell::Count(0)),
                "{row:?}"
            );
            assert_eq!(row[7], Cell::Count(0), "{row:?}");
        }
    }
}
