//! kd-trees by what weighs their children: size, build time, what rays visit, rays a second; with the light among the surfaces and outside.
//!
//! Source of the comparison: "Interactive Manycore Photon Mapping", PhD thesis, Trinity College Dublin, 2011, tables 4.1 to 4.4. Its trees
//! weigh triangles by their boxes; ours do also by what of them lies in a node.

use clerestory::Result;
use clerestory::accel::kd::{Heuristic, KdCaches, KdCounters, KdSettings, KdTree, Scheme};
use clerestory::accel::trace::TraceSettings;
use clerestory::accel::{Ray, RayIndex};

use super::flights::{Flight, TURNS, cases, changes, each_flight, fly, outside, race, trace};
use super::published::{Changes, TREES, Trees, of_source};
use crate::experiments::findings::{
    Bound, Criterion, Findings, Measured, Repeats, Study, change, geometric_mean, rows,
};
use crate::experiments::measures::Context;
use crate::experiments::measures::photon_maps::photon_scenes::Surfaces;
use crate::timing::timed;

/// Heuristics, the one that others are compared with first.
const HEURISTICS: [Heuristic; 3] = [Heuristic::SurfaceArea, Heuristic::Regions, Heuristic::InteriorOrigin];
/// Triangles up to which trees are built by 26 regions, which takes twenty times as long as the others.
const MANY_TRIANGLES: usize = 100_000;

/// How triangles are weighed, and how many a node may hold to be a leaf whatever it costs.
struct Form {
    words: &'static str,
    clip: bool,
    leaf_size: u32,
}

const FORMS: [Form; 3] = [
    Form {
        words: "boxes, leaves of 4",
        clip: false,
        leaf_size: 4,
    },
    Form {
        words: "boxes, leaves of 1",
        clip: false,
        leaf_size: 1,
    },
    Form {
        words: "parts in a node, leaves of 4",
        clip: true,
        leaf_size: 4,
    },
];
/// The form whose numbers of nodes are nearest to the source's.
const NEAREST: &str = FORMS[1].words;
/// The form that the source does not have.
const OURS_ALONE: &str = FORMS[2].words;

rows! {
    /// What rays visit of a tree.
    struct Visits = "What rays visit by heuristic" by [scene, form, heuristic] {
        scene: String = "scene",
        counterpart: String = "counterpart",
        form: String = "weighed by",
        heuristic: String = "heuristic",
        rays: u64 = "rays",
        nodes: f64 = "inner nodes per ray",
        nodes_change: f64 = "change (%)",
        tests: f64 = "triangle tests per ray",
        tests_change: f64 = "change of tests (%)",
        leaves: f64 = "leaves per ray",
        rate: Repeats = "M rays/s",
        speed: Repeats = "speed, change (%)",
    }
    beside "source: inner nodes per ray by surface area" = |row| row.published().map(|trees| trees.visits).into();
    beside "source: change (%)" = |row| row.changes().map(|changes| changes.visits).into();
    beside "source: triangle tests per ray by surface area" = |row| row.published().map(|trees| trees.tests).into();
    beside "source: change of tests (%)" = |row| row.changes().map(|changes| changes.tests).into();
    beside "source: speed, change (%)" = |row| row.changes().map(|changes| changes.speed).into();
}

rows! {
    /// A tree.
    struct Grown = "Trees by heuristic" by [scene, form, heuristic] {
        scene: String = "scene",
        counterpart: String = "counterpart",
        triangles: u64 = "triangles",
        form: String = "weighed by",
        heuristic: String = "heuristic",
        build: Repeats = "build (ms)",
        build_change: Repeats = "build, change (%)",
        nodes: u64 = "inner nodes",
        nodes_change: f64 = "change of nodes (%)",
        references: u64 = "references",
        depth: u64 = "depth",
        longest_leaf: u64 = "longest leaf",
    }
    beside "source: inner nodes by surface area" = |row| published(&row.counterpart, &row.form).map(|trees| trees.nodes).into();
    beside "source: change of nodes (%)" = |row| row.changes().and_then(|changes| changes.nodes).into();
}

rows! {
    /// Shadow rays to a light.
    struct Light = "Shadow rays by the place of the light" by [scene, light] {
        scene: String = "scene",
        light: String = "light",
        nodes: f64 = "inner nodes per ray, surface area",
        nodes_change: f64 = "SIROH, change (%)",
        tests: f64 = "triangle tests per ray, surface area",
        tests_change: f64 = "SIROH, change of tests (%)",
    }
}

/// What was found.
#[derive(Debug, Default, serde::Serialize, serde::Deserialize)]
pub struct Found {
    visits: Vec<Visits>,
    trees: Vec<Grown>,
    lights: Vec<Light>,
}

const OF_VISITS: &[Criterion<Visits>] = &[Criterion::all(
    "SIROH visits fewer inner nodes in most scenes: scenes with fewer, less those without",
    Bound::AtLeast(1.0),
    |rows: &[&Visits]| {
        let sides = rows.iter().map(|row| if row.nodes_change < 0.0 { 1.0 } else { -1.0 });
        (!rows.is_empty()).then(|| Measured::exact(sides.sum()))
    },
)
.among(Visits::is_judged)];

const OF_TREES: &[Criterion<Grown>] = &[Criterion::each(
    "trees by SIROH have the size of those by surface area: change of inner nodes (%)",
    Bound::Between(-2.0, 2.0),
    |tree: &Grown| tree.nodes_change.into(),
)
.among(|tree| tree.form == NEAREST && tree.heuristic == Heuristic::InteriorOrigin.name())
.because("the source's are −1.0 to 1.5")];

/// The source's boxes stand beside ours alone.
fn published(counterpart: &str, form: &str) -> Option<&'static Trees> {
    of_source(&TREES, counterpart).filter(|_| form != OURS_ALONE)
}

fn published_changes(counterpart: &str, form: &str, heuristic: &str) -> Option<&'static Changes> {
    let trees = published(counterpart, form)?;
    let changes = [
        (Heuristic::Regions, &trees.regions),
        (Heuristic::InteriorOrigin, &trees.siroh),
    ];
    let known = changes.into_iter().find(|(of, _)| of.name() == heuristic);
    known.map(|(_, changes)| changes)
}

impl Visits {
    fn published(&self) -> Option<&'static Trees> {
        published(&self.counterpart, &self.form)
    }

    fn changes(&self) -> Option<&'static Changes> {
        published_changes(&self.counterpart, &self.form, &self.heuristic)
    }

    fn is_judged(&self) -> bool {
        self.form == NEAREST && self.heuristic == Heuristic::InteriorOrigin.name()
    }
}

impl Grown {
    fn changes(&self) -> Option<&'static Changes> {
        published_changes(&self.counterpart, &self.form, &self.heuristic)
    }
}

/// Exact work of rays on the host, by a stack.
fn work(tree: &KdTree, rays: [&[Ray]; 2]) -> Result<KdCounters> {
    Ok(trace(tree, Scheme::Stack, KdCaches::default(), rays)?.1)
}

/// Trees by heuristic with the times of their builds, milliseconds.
fn grow(context: &Context<'_>, surfaces: &Surfaces, form: &Form) -> Result<Vec<(Heuristic, KdTree, Repeats)>> {
    let is_large = surfaces.triangles.len() > MANY_TRIANGLES;
    let wanted = HEURISTICS.into_iter().filter(|h| *h != Heuristic::Regions || !is_large);
    let wanted: Vec<Heuristic> = wanted.collect();
    let mut trees: Vec<Option<KdTree>> = wanted.iter().map(|_| None).collect();
    let times = context.in_turns(TURNS, wanted.len(), |i| {
        let settings = KdSettings {
            heuristic: wanted[i],
            clip: form.clip,
            leaf_size: form.leaf_size,
            ..KdSettings::default()
        };
        let (tree, time) = timed(|| KdTree::build(&surfaces.triangles, &settings));
        trees[i] = Some(tree?);
        Ok(1e3 * time)
    })?;
    let trees = trees.into_iter().flatten();
    let grown = wanted.into_iter().zip(trees).zip(times);
    Ok(grown
        .map(|((heuristic, tree), times)| (heuristic, tree, Repeats(times)))
        .collect())
}

/// Inner nodes of a tree.
fn inner_nodes(tree: &KdTree) -> u64 {
    let statistics = tree.statistics();
    statistics.nodes - statistics.leaves
}

impl Study for Found {
    fn measure(context: &Context<'_>) -> Result<Self> {
        let gpu = (context.gpu)()?;
        let (mut trees, mut lights) = (Vec::new(), Vec::new());
        let visits = each_flight(context, &cases(context), |case, surfaces, flight| {
            let closest = flight.closest();
            let mut visits = Vec::new();
            for form in &FORMS {
                let grown = grow(context, surfaces, form)?;
                let contenders = grown
                    .iter()
                    .map(|(_, tree, _)| (tree as &dyn RayIndex, TraceSettings::ray_per_thread()));
                let raced = race(context, &gpu, flight, TURNS, contenders)?;
                let of = |(_, tree, _): &(Heuristic, KdTree, Repeats)| work(tree, [&closest, &flight.shadow]);
                let works = grown.iter().map(of).collect::<Result<Vec<_>>>()?;
                let (_, first_tree, first_build) = &grown[0];
                for (((heuristic, tree, build), work), timed) in grown.iter().zip(&works).zip(&raced) {
                    visits.push(Visits {
                        scene: case.name().into(),
                        counterpart: case.counterpart.into(),
                        form: form.words.into(),
                        heuristic: heuristic.name().into(),
                        rays: flight.rays() as u64,
                        nodes: flight.per_ray(work.nodes),
                        nodes_change: change(work.nodes as f64, works[0].nodes as f64),
                        tests: flight.per_ray(work.triangles),
                        tests_change: change(work.triangles as f64, works[0].triangles as f64),
                        leaves: flight.per_ray(work.leaves),
                        rate: timed.rates[2].clone(),
                        speed: changes(&timed.rates[2], &raced[0].rates[2]),
                    });
                    trees.push(Grown {
                        scene: case.name().into(),
                        counterpart: case.counterpart.into(),
                        triangles: tree.statistics().triangles,
                        form: form.words.into(),
                        heuristic: heuristic.name().into(),
                        build: build.clone(),
                        build_change: changes(build, first_build),
                        nodes: inner_nodes(tree),
                        nodes_change: change(inner_nodes(tree) as f64, inner_nodes(first_tree) as f64),
                        references: tree.references().len() as u64,
                        depth: tree.statistics().max_depth.into(),
                        longest_leaf: tree.longest_leaf().into(),
                    });
                }
                if form.words == NEAREST {
                    let pair = [first_tree, &grown[grown.len() - 1].1];
                    let lit_from_outside = fly(context, case, surfaces, outside(surfaces))?;
                    for (light, flight) in [("inside", flight), ("outside", &lit_from_outside)] {
                        lights.push(shadows(case.name(), light, pair, flight)?);
                    }
                }
            }
            Ok(visits)
        })?;
        Ok(Self { visits, trees, lights })
    }

    fn findings(&self) -> Findings {
        let shown: Vec<Visits> = self.visits.iter().filter(|row| row.form == NEAREST).cloned().collect();
        let siroh = shown.iter().filter(|row| row.is_judged());
        Findings::of(&self.visits, OF_VISITS)
            .headline(
                "inner nodes per ray by SIROH over those by surface area, boxes, leaves of 1, geometric mean",
                geometric_mean(siroh.map(|row| (1.0 + 0.01 * row.nodes_change).into())),
            )
            .bars(
                "visits",
                "Inner nodes per ray, trees over boxes with leaves of 1",
                &shown,
                |row| [row.scene.clone(), row.heuristic.clone()],
                |row| row.nodes.into(),
            )
            .note(
                "Camera flights of 10 frames of 96 × 96 pixels (2 of 8 × 8 in a smoke run): camera rays, reflections at mirrors, and a shadow \
                 ray from the end of each; traversal with a stack. Counts are exact and the same on every machine; trees take turns. The \
                 source's models but Scene 6 are files that are not here: its figures stand beside generated scenes of the same kind and number \
                 of triangles, so what can agree is the sign and the size of the changes. By its text nodes of four triangles or fewer are \
                 leaves; its numbers of nodes are nearer to those of trees that split such nodes too, so both stand here.",
            )
            .and(Findings::of(&self.trees, OF_TREES))
            .note(format!(
                "Build times by wall clock on all of the host's threads, layout for the kernels and all, in turns. Trees by 26 regions are not \
                 built above {MANY_TRIANGLES} triangles: they take twenty times as long as the others."
            ))
            .and(Findings::of(&self.lights, &[]))
            .note(
                "Trees over boxes with leaves of 1. SIROH takes origins to lie among the surfaces. The source found frames with a light inside \
                 1.7 % faster and with one outside 3.8 % slower than by surface area (its table 4.2, another tracer's scene with an animated \
                 light).",
            )
    }
}

/// Shadow rays of a flight in trees by surface area and by SIROH.
fn shadows(scene: &str, light: &str, [area, siroh]: [&KdTree; 2], flight: &Flight) -> Result<Light> {
    let per_ray = |count: u64| count as f64 / flight.shadow.len().max(1) as f64;
    let (area, siroh) = (work(area, [&[], &flight.shadow])?, work(siroh, [&[], &flight.shadow])?);
    Ok(Light {
        scene: scene.into(),
        light: light.into(),
        nodes: per_ray(area.nodes),
        nodes_change: change(siroh.nodes as f64, area.nodes as f64),
        tests: per_ray(area.triangles),
        tests_change: change(siroh.triangles as f64, area.triangles as f64),
    })
}
