//! Trees for rays by every builder and every setting of the optimisation: what they cost to build and what rays visit in them.
//!
//! The surface area cost stands beside the counts, since it does not foretell them: T. Aila, T. Karras, S. Laine, "On Quality Metrics of
//! Bounding Volume Hierarchies", HPG 2013.

use clerestory::Result;
use clerestory::accel::bvh2::{Bvh2, Bvh2Settings};
use clerestory::accel::lbvh::{self, BuildQuality, LbvhSettings};
use clerestory::accel::{Ray, RayIndex, TraversalCounters};
use glam::Vec3;

use crate::experiments::measures::Context;
use crate::experiments::measures::clock::seconds;
use crate::experiments::measures::photon_maps::photon_scenes::{Intersection, Surfaces};
use crate::experiments::table::{Cell, Table};
use crate::random::Random;

/// Scenes with a light.
const CASES: [(&str, Vec3); 4] = [
    ("builtin:box-city?n=25000", Vec3::new(0.0, 400.0, 0.0)),
    ("builtin:sphere-flake?depth=3&frequency=4", Vec3::new(4.0, 6.0, 4.0)),
    ("builtin:materials", Vec3::new(-5.0, 7.0, 5.0)),
    ("builtin:triangle-soup?n=250000&size=0.01", Vec3::new(0.0, 3.0, 0.0)),
];
const SMOKE_CASE: (&str, Vec3) = ("builtin:cornell-box", Vec3::new(0.278, 0.54, 0.28));

/// Bounces of diffuse rays.
const BOUNCES: usize = 2;

/// Kinds of rays.
const KINDS: [&str; 3] = ["primary", "diffuse", "shadow"];

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
        ("linear, fast".to_owned(), Some(fast)),
        ("treelets of 5".to_owned(), of(5, 1, 0, 0)),
        ("treelets of 9, 3 rounds".to_owned(), of(9, 3, 0, 0)),
        ("reinsertion, 3 rounds".to_owned(), of(5, 0, 0, 3)),
    ];
    for mini_tree in [8, 32, 128] {
        all.push((format!("mini trees of {mini_tree}"), of(5, 0, mini_tree, 0)));
    }
    all.push(("high: treelets of 5, mini trees of 32".to_owned(), Some(high)));
    all.push(("high, treelets of 9".to_owned(), of(9, 1, 32, 0)));
    all.push(("high and one reinsertion".to_owned(), of(5, 1, 32, 1)));
    all.push(("high and 3 reinsertions".to_owned(), of(5, 1, 32, 3)));
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
fn work(index: &Bvh2, rays: &[Ray], is_shadow: bool) -> [u64; 2] {
    let mut counters = TraversalCounters::default();
    for ray in rays {
        if is_shadow {
            index.any_hit_filtered(ray, &mut |_, _| true, &mut counters);
        } else {
            index.closest_hit_filtered(ray, &mut |_, _| true, &mut counters);
        }
    }
    [counters.nodes, counters.triangles]
}

/// The measure.
pub fn measure(context: &Context<'_>) -> Result<Vec<Table>> {
    let side = if context.smoke { 8 } else { 192 };
    let smoke = [SMOKE_CASE];
    let cases = if context.smoke { &smoke[..] } else { &CASES[..] };
    let mut heads: Vec<String> = [
        "scene",
        "triangles",
        "tree",
        "build (ms)",
        "build / binned",
        "SAH cost",
        "SAH / binned",
        "depth",
    ]
    .map(str::to_owned)
    .into();
    for kind in KINDS {
        heads.push(format!("nodes a {kind} ray"));
        heads.push(format!("triangles a {kind} ray"));
        heads.push(format!("steps / binned, {kind}"));
    }
    let heads: Vec<&str> = heads.iter().map(String::as_str).collect();
    let mut table = Table::new("Trees for rays by what builds them", &heads);
    for (done, (scene, light)) in cases.iter().enumerate() {
        if context.watch.stopped() {
            break;
        }
        let name = scene.trim_start_matches("builtin:");
        context.watch.begin(name, done, cases.len());
        let surfaces = Surfaces::load(scene)?;
        let rays = rays(&surfaces, *light, side)?;
        let mut binned: Option<[f64; 5]> = None;
        for (tree, settings) in builders() {
            let index = build(&surfaces.triangles, settings.as_ref())?;
            let time = seconds(context.smoke, || {
                build(&surfaces.triangles, settings.as_ref()).map(|index| drop(std::hint::black_box(index)))
            })?;
            let statistics = index.statistics();
            let work: [[u64; 2]; 3] = std::array::from_fn(|kind| work(&index, &rays[kind], kind == 2));
            let each = |kind: usize, count: u64| count as f64 / rays[kind].len().max(1) as f64;
            let steps = |kind: usize| each(kind, work[kind].iter().sum());
            let all = [time, statistics.sah_cost, steps(0), steps(1), steps(2)];
            let first = *binned.get_or_insert(all);
            let ratio = |i: usize| if first[i] > 0.0 { all[i] / first[i] } else { 1.0 };
            let mut row: Vec<Cell> = vec![
                name.into(),
                statistics.triangles.into(),
                tree.into(),
                (1e3 * time).into(),
                ratio(0).into(),
                statistics.sah_cost.into(),
                ratio(1).into(),
                u64::from(statistics.max_depth).into(),
            ];
            for (kind, counts) in work.iter().enumerate() {
                row.extend(counts.map(|count| Cell::from(each(kind, count))));
                row.push(ratio(2 + kind).into());
            }
            table.row(row);
        }
    }
    table.note(
        "Steps are nodes and triangles that a ray visits in the kernels' order, exact counts; ratios are to the tree by binned surface area \
         heuristic. Primary rays go through the pixels of a square picture, diffuse and shadow rays leave where these and the first bounce \
         end. Build times are medians by wall clock on all of the host's threads, layout for the kernels and all, and move with the load \
         of the machine.",
    );
    table.note(
        "The surface area cost does not foretell the steps: treelets alone have the lower cost and the more steps where large triangles lie \
         among small ones. Rebuilding what is above mini trees takes that away in less than the time of a binned build; reinsertion then \
         goes below the binned tree's steps, for several times its build.",
    );
    Ok(vec![table])
}
