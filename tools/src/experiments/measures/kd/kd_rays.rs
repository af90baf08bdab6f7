//! Whether every way through a kd-tree finds the same hits: ten million rays by every scheme and every cache, on the device and on the host.
//!
//! Oracles: a bounding volume hierarchy's hits, to the bit; on a part of the rays all triangles in turn, in f32 to the bit and in f64 up to
//! the stated bounds ([`hit_errors`](super::hit_errors)).

use clerestory::accel::bvh2::{Bvh2, Bvh2Settings};
use clerestory::accel::kd::{KdSettings, KdTraversal, KdTree};
use clerestory::accel::trace::{Query, RayTracer, TraceSettings};
use clerestory::accel::{Hit, Ray, RayIndex};
use clerestory::gpu::Gpu;
use clerestory::{Result, scene};
use clerestory_hard_cases::RaySet;
use glam::Vec3;
use rayon::prelude::*;

use super::flights::{CASES, Case, different, on_hardware, told};
use super::hit_errors::{self, Reachable, judge};
use super::kd_variants::{Variant, fitted, kept_kernels, variants};
use super::ray_kinds;
use crate::experiments::findings::{Bound, Criterion, Findings, Measured, Study, rows, total};
use crate::experiments::measures::Context;
use crate::experiments::measures::photon_maps::photon_scenes::Surfaces;

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

rows! {
    /// A way through the trees.
    struct Way = "Hits of every variant" by [query, execution, variant] {
        query: String = "query",
        execution: String = "execution",
        variant: String = "variant",
        rays: u64 = "rays",
        hits: u64 = "hits",
        different: u64 = "hits that differ",
        other_answers: u64 = "answers that differ",
        on_host: u64 = "rays on the host",
        different_on_host: u64 = "hits of the host that differ",
        on_hardware: bool = "on a device of its own",
    }
}

rows! {
    /// A scene or a hard case.
    struct Place = "Rays, differing hits and errors by scene" by [scene] {
        scene: String = "scene",
        triangles: u64 = "triangles",
        rays: u64 = "rays",
        hits: u64 = "hits",
        different: u64 = "hits of all variants that differ",
        tried: u64 = "rays tried on all triangles",
        different_from_all: u64 = "hits that differ from trying all",
        above: u64 = "hits above the bound in f64",
        parameter: f64 = "largest error of t (of its bound)",
        point: f64 = "largest error of u, v (of their bound)",
        on_hardware: bool = "on a device of its own",
    }
}

/// What was found.
#[derive(Debug, Default, serde::Serialize, serde::Deserialize)]
pub struct Found {
    ways: Vec<Way>,
    places: Vec<Place>,
}

const EXACT: &str = "a device whose division is exact";

const OF_WAYS: &[Criterion<Way>] = &[
    Criterion::each(
        "no hit of a variant differs on the device",
        Bound::AtMost(0.0),
        |way: &Way| way.different.into(),
    )
    .in_every_form(),
    Criterion::each(
        "no answer differs from the closest hit's",
        Bound::AtMost(0.0),
        |way: &Way| way.other_answers.into(),
    )
    .in_every_form(),
    Criterion::each(
        "no hit of the host differs from the device's",
        Bound::AtMost(0.0),
        |way: &Way| way.different_on_host.into(),
    )
    .among(|way| !way.on_hardware)
    .needs(EXACT)
    .in_every_form(),
];

const OF_PLACES: &[Criterion<Place>] = &[
    Criterion::each(
        "no hit differs in any scene, of all variants and of the hierarchy on the host",
        Bound::AtMost(0.0),
        |place: &Place| place.different.into(),
    )
    .among(|place| !place.on_hardware)
    .needs(EXACT)
    .in_every_form(),
    Criterion::each(
        "no hit differs from trying all triangles in f32",
        Bound::AtMost(0.0),
        |place: &Place| place.different_from_all.into(),
    )
    .among(|place| !place.on_hardware)
    .needs(EXACT)
    .in_every_form(),
    Criterion::each(
        "no error is above its bound: the largest, of it",
        Bound::AtMost(1.0),
        |place: &Place| place.parameter.max(place.point).into(),
    )
    .in_every_form(),
    Criterion::each("hits above their bound in f64", Bound::AtMost(0.0), |place: &Place| {
        place.above.into()
    })
    .in_every_form(),
    Criterion::all("rays that are traced", Bound::AtLeast(1e7), |places: &[&Place]| {
        let rays: u64 = places.iter().map(|place| place.rays).sum();
        (!places.is_empty()).then(|| Measured::from(rays))
    }),
];

impl Way {
    fn of(variant: &Variant, on_hardware: bool) -> Self {
        Self {
            query: variant.query.into(),
            execution: variant.execution.into(),
            variant: variant.words.into(),
            on_hardware,
            ..Self::default()
        }
    }

    /// Counts of another set of rays on top, and how many of these differ in any way.
    fn add(
        &mut self,
        hits: &[Hit],
        [different, other_answers]: [u64; 2],
        [on_host, different_on_host]: [u64; 2],
    ) -> u64 {
        self.rays += hits.len() as u64;
        self.hits += count_hits(hits);
        self.different += different;
        self.other_answers += other_answers;
        self.on_host += on_host;
        self.different_on_host += different_on_host;
        different + other_answers + different_on_host
    }
}

impl Place {
    /// Another set of the same case on top.
    fn add(self, other: Self) -> Self {
        Self {
            triangles: self.triangles + other.triangles,
            rays: self.rays + other.rays,
            hits: self.hits + other.hits,
            different: self.different + other.different,
            tried: self.tried + other.tried,
            different_from_all: self.different_from_all + other.different_from_all,
            above: self.above + other.above,
            parameter: self.parameter.max(other.parameter),
            point: self.point.max(other.point),
            ..other
        }
    }
}

/// About `count` of them, evenly, with their hits.
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

/// All variants on the device.
struct Check<'a> {
    gpu: &'a Gpu,
    variants: &'a [Variant],
    amount: &'a Amount,
}

impl Check<'_> {
    /// Of a set, with what all variants have found so far.
    fn set(&self, name: &str, set: &Set<'_>, ways: &mut [Way]) -> Result<Place> {
        let closest = RayTracer::new(self.gpu, set.index, &TraceSettings::ray_per_thread())?
            .trace(set.rays)?
            .hits;
        let host_rays = some(set.rays, &closest, self.amount.on_host);
        let mut differ = other_hits(&host_rays, |ray| Ok(set.index.closest_hit(ray)))?;
        let mut any: Option<Vec<Hit>> = None;
        for (variant, way) in self.variants.iter().zip(ways) {
            let settings = fitted(self.gpu, variant.settings, set.tree.device_traversal());
            let hits = RayTracer::new(self.gpu, &set.tree, &settings)?.trace(set.rays)?.hits;
            let expected = match variant.settings.query {
                Query::Closest => &closest,
                Query::Any => any.get_or_insert_with(|| hits.clone()),
            };
            let answers = hits.iter().zip(&closest).filter(|(a, b)| a.is_hit() != b.is_hit());
            let on_device = [different(&hits, expected), answers.count() as u64];
            let host_rays = some(set.rays, &hits, self.amount.on_host);
            let different_on_host = other_hits(&host_rays, |ray| on_host(&set.tree, &settings, ray))?;
            differ += way.add(&hits, on_device, [host_rays.len() as u64, different_on_host]);
        }
        let reachable = Reachable::among(set.triangles);
        let tried = some(set.rays, &closest, self.amount.tests / reachable.count().max(1));
        let verdicts = tried.par_iter().map(|(ray, hit)| judge(&reachable, ray, hit));
        let verdict = verdicts.reduce(hit_errors::Verdict::default, hit_errors::Verdict::and);
        Ok(Place {
            scene: name.into(),
            triangles: set.triangles.len() as u64,
            rays: set.rays.len() as u64,
            hits: count_hits(&closest),
            different: differ,
            tried: tried.len() as u64,
            different_from_all: verdict.different,
            above: verdict.above,
            parameter: verdict.parameter,
            point: verdict.point,
            on_hardware: on_hardware(self.gpu),
        })
    }

    /// Rays of all kinds in a scene.
    fn scene(&self, case: &Case, seed: u32, ways: &mut [Way]) -> Result<Place> {
        let surfaces = Surfaces::load(&case.scene)?;
        let scene = scene::load(&case.scene)?;
        let (camera, of_each) = (scene.require_camera(None)?, self.amount.of_each);
        let kinds = ray_kinds::rays(&surfaces.triangles, surfaces.index(), camera, of_each, seed)?;
        let set = Set {
            triangles: &surfaces.triangles,
            rays: &kinds.concat(),
            index: surfaces.index(),
            tree: KdTree::build(&surfaces.triangles, &KdSettings::default())?,
        };
        self.set(case.name(), &set, ways)
    }

    /// All sets of a hard case.
    fn hard_case(&self, name: &str, sets: &[RaySet], ways: &mut [Way]) -> Result<Place> {
        sets.iter().try_fold(Place::default(), |all, set| {
            let index = Bvh2::build(&set.triangles, &Bvh2Settings::default())?;
            let set = Set {
                triangles: &set.triangles,
                rays: &set.rays,
                index: &index,
                tree: KdTree::build(&set.triangles, &KdSettings::default())?,
            };
            Ok(all.add(self.set(name, &set, ways)?))
        })
    }
}

/// Where rays are from.
enum Origin {
    /// A scene, with a seed.
    Scene(Case, u32),
    /// A hard case, by name.
    HardCase(String, fn() -> Vec<RaySet>),
}

impl Origin {
    fn all(context: &Context<'_>) -> Vec<Self> {
        let ours = [&CASES[..], &MORE].concat();
        let scenes = told(context).unwrap_or_else(|| context.first(&ours, 1).to_vec());
        let scenes = scenes.into_iter().zip(0..).map(|(case, seed)| Self::Scene(case, seed));
        let hard = clerestory_hard_cases::all().iter();
        let hard = hard.filter_map(|case| Some(Self::HardCase(format!("hard case: {}", case.name), case.rays?)));
        scenes.chain(hard).collect()
    }

    fn name(&self) -> String {
        match self {
            Self::Scene(case, _) => case.name().to_owned(),
            Self::HardCase(name, _) => name.clone(),
        }
    }
}

impl Study for Found {
    fn measure(context: &Context<'_>) -> Result<Self> {
        let gpu = (context.gpu)()?;
        let variants = variants(&gpu);
        let kept = kept_kernels(&gpu, &variants)?;
        let check = Check {
            gpu: &gpu,
            variants: &variants,
            amount: &context.pick(FULL, SMOKE),
        };
        let is_hardware = on_hardware(&gpu);
        let mut ways: Vec<Way> = variants.iter().map(|variant| Way::of(variant, is_hardware)).collect();
        let places = context.each(&Origin::all(context), Origin::name, |origin| {
            let place = match origin {
                Origin::Scene(case, seed) => check.scene(case, *seed, &mut ways)?,
                Origin::HardCase(name, sets) => check.hard_case(name, &sets(), &mut ways)?,
            };
            Ok(vec![place])
        })?;
        drop(kept);
        Ok(Self { ways, places })
    }

    fn findings(&self) -> Findings {
        Findings::of(&self.ways, OF_WAYS)
            .headline(
                "hits that differ between variants, of all rays by every variant",
                total(&self.ways, |_| true, |way| way.different + way.other_answers),
            )
            .note(format!(
                "Rays of {} in even shares, a fourth of those but the camera's and the diffuse ones with an end, and those of all hard cases; \
                 kd-trees with default settings. A hit is t, u, v and the triangle, and differs where one bit of these does: closest hits from \
                 those of the engine's bounding volume hierarchy on the device, any hits from those of the first variant; answers, whether \
                 there is a hit, from those of the closest. The host traces an even part of the rays by the twin of each kernel. Devices whose \
                 division is not exact, which Vulkan lets them have, may differ from the host in last bits; software devices must not.",
                ray_kinds::KINDS.join(", ")
            ))
            .and(Findings::of(&self.places, OF_PLACES))
            .note(
                "All triangles are tried, for an even part of the rays, by the kernels' test in f32 and by the same test in f64. With u = 2⁻²⁴, \
                 M the largest coordinate distance of a triangle's corner from the ray's origin, |d| the direction's largest component and s the \
                 slopes of t in the triangle's plane across the ray, t must lie within 18uM/|d| + 16uMs of the plane's in f64, no triangle that \
                 f64 meets clear of its edges may be nearer by more than that, and the point that u and v name must lie within 32uM of the ray \
                 along each axis (`clerestory::accel::triangle`). Errors are shares of these bounds, the largest of all.",
            )
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::experiments::measures::kd::kd_traversal::SCHEMES;
    use crate::experiments::watch::Unwatched;
    use clerestory::accel::kd::KdCaches;

    #[test]
    fn no_variant_finds_another_hit_and_none_is_above_its_bound() {
        let context = Context {
            smoke: true,
            scenes: &[],
            gpu: &|| Gpu::headless(&clerestory::gpu::GpuOptions::default()),
            folder: std::path::Path::new(""),
            watch: &Unwatched,
        };
        let found = Found::measure(&context).unwrap();
        assert_eq!(found.ways.len(), 2 * (SCHEMES.len() + KdCaches::COMPARED.len()));
        for way in &found.ways {
            assert!(way.hits > 1000, "{way:?}");
            assert_eq!((way.different, way.other_answers), (0, 0), "{way:?}");
            assert!(way.on_hardware || way.different_on_host == 0, "{way:?}");
        }
        for place in &found.places {
            assert!(
                place.on_hardware || (place.different, place.different_from_all) == (0, 0),
                "{place:?}"
            );
            assert_eq!(place.above, 0, "{place:?}");
        }
    }
}
