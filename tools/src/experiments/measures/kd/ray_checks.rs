//! Rays by every variant of a kd-tree, on the device and on the host, beside a bounding volume hierarchy and a search through all triangles.

use clerestory::accel::bvh2::{Bvh2, Bvh2Settings};
use clerestory::accel::kd::{KdSettings, KdTraversal, KdTree};
use clerestory::accel::trace::{Query, RayTracer, TraceSettings};
use clerestory::accel::{Hit, Ray, RayIndex};
use clerestory::gpu::Gpu;
use clerestory::{Result, scene};
use clerestory_hard_cases::RaySet;
use glam::Vec3;
use rayon::prelude::*;

use super::flights::{Case, different, on_hardware};
use super::hit_errors::{Reachable, Verdict, judge};
use super::kd_variants::{Variant, fitted};
use super::ray_kinds;
use crate::experiments::findings::rows;
use crate::experiments::measures::errors::greatest;
use crate::experiments::measures::photon_maps::photon_scenes::Surfaces;

/// How much is traced.
pub struct Amount {
    /// Rays of each kind in each scene.
    pub of_each: usize,
    /// Rays of a scene, or of a set of a hard case, that the host traces too.
    pub on_host: usize,
    /// Triangle tests of a scene, or of a set, by trying all triangles.
    pub tests: usize,
}

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

impl Way {
    /// Nothing yet, of a variant.
    pub fn of(variant: &Variant, on_hardware: bool) -> Self {
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
            parameter: greatest([self.parameter, other.parameter]),
            point: greatest([self.point, other.point]),
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
pub struct Check<'a> {
    /// The device.
    pub gpu: &'a Gpu,
    /// The variants.
    pub variants: &'a [Variant],
    /// How much is traced.
    pub amount: &'a Amount,
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
        let verdict = verdicts.reduce(Verdict::default, Verdict::and);
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
    ///
    /// # Errors
    /// Those of the scene, of builds and of submissions.
    pub fn scene(&self, case: &Case, seed: u32, ways: &mut [Way]) -> Result<Place> {
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
    ///
    /// # Errors
    /// Those of builds and of submissions.
    pub fn hard_case(&self, name: &str, sets: &[RaySet], ways: &mut [Way]) -> Result<Place> {
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
