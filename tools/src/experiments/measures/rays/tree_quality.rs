//! Trees for rays by every builder and every setting of the optimisation: what they cost to build and what rays visit in them.
//!
//! The surface area cost stands beside the counts, since it does not foretell them: T. Aila, T. Karras, S. Laine, "On Quality Metrics of
//! Bounding Volume Hierarchies", HPG 2013.

use clerestory::Result;
use clerestory::accel::bvh2::{Bvh2, Bvh2Settings};
use clerestory::accel::lbvh::{self, BuildQuality, LbvhSettings};
use clerestory::accel::{Ray, RayIndex, TraversalCounters};
use glam::Vec3;

use crate::experiments::findings::{Bound, Criterion, Findings, Measured, Repeats, Study, largest, rows};
use crate::experiments::measures::Context;
use crate::experiments::measures::photon_maps::photon_scenes::{Intersection, Surfaces};
use crate::experiments::reference::short_name;
use crate::random::Random;
use crate::timing::timed;

/// Scenes with a light.
const CASES: [(&str, Vec3); 4] = [
    ("builtin:box-city?n=25000", Vec3::new(0.0, 400.0, 0.0)),
    ("builtin:sphere-flake?depth=3&frequency=4", Vec3::new(4.0, 6.0, 4.0)),
    ("builtin:materials", Vec3::new(-5.0, 7.0, 5.0)),
    ("builtin:triangle-soup?n=250000&size=0.01", Vec3::new(0.0, 3.0, 0.0)),
];
const SMOKE_CASES: &[(&str, Vec3)] = &[("builtin:cornell-box", Vec3::new(0.278, 0.54, 0.28))];

/// Bounces of diffuse rays.
const BOUNCES: usize = 2;

/// Kinds of rays, and whether any hit will do.
const KINDS: [(&str, bool); 3] = [("primary", false), ("diffuse", false), ("shadow", true)];

const FAST: &str = "linear, fast";
const REINSERTED: &str = "high and 3 reinsertions";
const HIGH: &str = "high: treelets of 5, mini trees of 32";

/// What a tree is built by, the one that others are compared with first.
fn builders() -> Vec<(String, Option<LbvhSettings>)> {
    let high = LbvhSettings::default();
    let of = |treelet, rounds, mini_tree, reinsertions| {
        Some(LbvhSettings {
            treelet,
            rounds,
            mini_tree,
            reinsertions,
            ..high
        })
    };
    let fast = LbvhSettings {
        quality: BuildQuality::Fast,
        ..high
    };
    let mut all = vec![
        ("binned".to_owned(), None),
        (FAST.to_owned(), Some(fast)),
        ("treelets of 5".to_owned(), of(5, 1, 0, 0)),
        ("treelets of 9, 3 rounds".to_owned(), of(9, 3, 0, 0)),
        ("reinsertion, 3 rounds".to_owned(), of(5, 0, 0, 3)),
    ];
    for mini_tree in [8, 32, 128] {
        all.push((format!("mini trees of {mini_tree}"), of(5, 0, mini_tree, 0)));
    }
    all.push((HIGH.to_owned(), Some(high)));
    all.push(("high, treelets of 9".to_owned(), of(9, 1, 32, 0)));
    all.push(("high and one reinsertion".to_owned(), of(5, 1, 32, 1)));
    all.push((REINSERTED.to_owned(), of(5, 1, 32, 3)));
    all
}

fn build(triangles: &[[Vec3; 3]], settings: Option<&LbvhSettings>) -> Result<Bvh2> {
    match settings {
        Some(settings) => lbvh::build(triangles, settings),
        None => Bvh2::build(triangles, &Bvh2Settings::default()),
    }
}

fn ray(origin: Vec3, direction: Vec3, t_max: f32) -> Ray {
    Ray {
        origin: origin.into(),
        t_min: 0.0,
        direction: direction.into(),
        t_max,
    }
}

/// Rays of every kind: through the pixels of a square picture, by the cosine from where these end, and to the light from there.
fn rays(surfaces: &Surfaces, light: Vec3, side: u32) -> Result<[Vec<Ray>; 3]> {
    let mut random = Random::new(91);
    let mut all = [const { Vec::new() }; 3];
    for (origin, direction) in surfaces.camera_rays(side)? {
        all[0].push(ray(origin, direction, f32::INFINITY));
        let mut meeting: Option<Intersection> = surfaces.meet(origin, direction);
        for _ in 0..BOUNCES {
            let Some(from) = meeting else {
                break;
            };
            let (origin, to_light, distance) = surfaces.shadow_ray(&from, light);
            all[2].push(ray(origin, to_light, distance));
            let cosine = from.normal.as_dvec3() + random.direction();
            let direction = cosine.as_vec3().normalize_or(from.normal);
            all[1].push(ray(origin, direction, f32::INFINITY));
            meeting = surfaces.meet(origin, direction);
        }
    }
    Ok(all)
}

/// Nodes and triangles that rays visit.
fn work(index: &Bvh2, rays: &[Ray], any_hit: bool) -> TraversalCounters {
    let mut counters = TraversalCounters::default();
    for ray in rays {
        if any_hit {
            index.any_hit_filtered(ray, &mut |_, _| true, &mut counters);
        } else {
            index.closest_hit_filtered(ray, &mut |_, _| true, &mut counters);
        }
    }
    counters
}

rows! {
    /// A tree of a scene.
    struct Tree = "Trees for rays by what builds them" by [scene, tree] {
        scene: String = "scene",
        triangles: u64 = "triangles",
        tree: String = "tree",
        build: Repeats = "build (ms)",
        build_over: Repeats = "build over the binned one's",
        cost: f64 = "SAH cost",
        cost_over: f64 = "SAH cost over the binned tree's",
        depth: u64 = "depth",
    }
}

rows! {
    /// Rays of a kind in a tree.
    struct Visits = "What rays visit in them" by [scene, tree, kind] {
        scene: String = "scene",
        tree: String = "tree",
        kind: String = "rays",
        nodes: f64 = "nodes per ray",
        triangles: f64 = "triangles per ray",
        steps_over: f64 = "steps over the binned tree's",
    }
}

/// What was found.
#[derive(Debug, Default, serde::Serialize, serde::Deserialize)]
pub struct Found {
    trees: Vec<Tree>,
    visits: Vec<Visits>,
}

const OF_TREES: &[Criterion<Tree>] = &[Criterion::each(
    "high quality takes less time to build than the binned tree: over it",
    Bound::AtMost(1.0),
    |tree: &Tree| (&tree.build_over).into(),
)
.among(|tree| tree.tree == HIGH)];

const OF_VISITS: &[Criterion<Visits>] = &[Criterion::each(
    "steps by high quality are within 5 % of the binned tree's: over it",
    Bound::AtMost(1.05),
    |visits: &Visits| visits.steps_over.into(),
)
.among(Visits::is_high)];

impl Visits {
    fn is_high(&self) -> bool {
        self.tree == HIGH
    }
}

/// A number over the first one's; two of nothing are alike.
fn over(value: f64, first: f64) -> f64 {
    if value == first { 1.0 } else { value / first }
}

/// All trees of a scene, with what rays visit in them.
fn of_scene(context: &Context<'_>, address: &str, light: Vec3) -> Result<(Vec<Tree>, Vec<Visits>)> {
    let surfaces = Surfaces::load(address)?;
    let rays = rays(&surfaces, light, context.pick(192, 8))?;
    let builders = builders();
    let times = context.in_turns(7, builders.len(), |i| {
        let build = || build(&surfaces.triangles, builders[i].1.as_ref());
        let (built, seconds) = timed(|| build().map(|index| drop(std::hint::black_box(index))));
        built.map(|()| 1e3 * seconds)
    })?;
    let times: Vec<Repeats> = times.into_iter().map(Repeats).collect();
    let (mut trees, mut visits) = (Vec::<Tree>::new(), Vec::<Visits>::new());
    for ((tree, settings), time) in builders.iter().zip(&times) {
        let index = build(&surfaces.triangles, settings.as_ref())?;
        let statistics = index.statistics();
        let binned = trees.first().map_or(statistics.sah_cost, |tree| tree.cost);
        trees.push(Tree {
            scene: short_name(address).into(),
            triangles: statistics.triangles,
            tree: tree.clone(),
            build: time.clone(),
            build_over: time.over(&times[0]),
            cost: statistics.sah_cost,
            cost_over: over(statistics.sah_cost, binned),
            depth: statistics.max_depth.into(),
        });
        for ((kind, any_hit), rays) in KINDS.iter().zip(&rays) {
            let work = work(&index, rays, *any_hit);
            let per_ray = |count: u64| count as f64 / rays.len().max(1) as f64;
            let (nodes, triangles) = (per_ray(work.nodes), per_ray(work.triangles));
            let binned = visits.iter().find(|of| of.kind == *kind);
            let binned = binned.map_or(nodes + triangles, |of| of.nodes + of.triangles);
            visits.push(Visits {
                scene: short_name(address).into(),
                tree: tree.clone(),
                kind: (*kind).into(),
                nodes,
                triangles,
                steps_over: over(nodes + triangles, binned),
            });
        }
    }
    Ok((trees, visits))
}

impl Study for Found {
    fn measure(context: &Context<'_>) -> Result<Self> {
        let cases = context.pick(&CASES[..], SMOKE_CASES);
        let name = |(address, _): &(&str, Vec3)| short_name(address).to_owned();
        let mut visits = Vec::new();
        let trees = context.each(cases, name, |(address, light)| {
            let (trees, of_scene) = of_scene(context, address, *light)?;
            visits.extend(of_scene);
            Ok(trees)
        })?;
        Ok(Self { trees, visits })
    }

    fn findings(&self) -> Findings {
        let of_plot = |visits: &&Visits| [FAST, HIGH, REINSERTED].contains(&&*visits.tree);
        let shown: Vec<Visits> = self.visits.iter().filter(of_plot).cloned().collect();
        Findings::of(&self.trees, OF_TREES)
            .headline(
                "steps by high quality over those of the binned tree, the worst kind of rays and scene",
                largest(&self.visits, Visits::is_high, |visits| visits.steps_over),
            )
            .note(
                "Ratios are to the tree by the binned surface area heuristic, those of times turn by turn. Build times are by wall clock on all of \
                 the host's threads, with the layout for the kernels.",
            )
            .and(Findings::pivoted(&self.visits, "kind", OF_VISITS))
            .note(
                "Steps are nodes and triangles that a ray visits in the kernels' order, exact counts. Primary rays go through the pixels of a \
                 square picture, diffuse and shadow rays leave where these and the first bounce end.",
            )
            .note("The surface area cost does not foretell the steps.")
            .bars(
                "steps",
                "Steps over those of the binned tree",
                &shown,
                |visits| [format!("{}, {} rays", visits.scene, visits.kind), visits.tree.clone()],
                |visits| Measured::exact(visits.steps_over),
            )
    }
}
