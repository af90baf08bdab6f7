//! kd-trees by what weighs their children: size, build time, what rays visit, rays per second; with the light among the surfaces and outside.
//!
//! Source of the comparison: B. Fabianowski, "Interactive Manycore Photon Mapping", PhD thesis, Trinity College Dublin, 2011, tables 4.1 to 4.4. Its trees
//! weigh triangles by their boxes; ours do also by what of them lies in a node.

use clerestory::Result;
use clerestory::accel::kd::{Heuristic, KdCaches, KdCounters, KdTree, Scheme};
use clerestory::accel::trace::TraceSettings;
use clerestory::accel::{Ray, RayIndex};

use super::flights::{Flight, TURNS, cases, each_flight, fly, outside, race, trace};
use super::heuristic_trees::{FORMS, Grown, NEAREST, OF_TREES, grow, published, published_changes};
use super::published::{Changes, Trees};
use crate::experiments::findings::{
    Bound, Criterion, Findings, Measured, Repeats, Study, change, geometric_mean, rows,
};
use crate::experiments::measures::Context;

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

const OF_VISITS: &[Criterion<Visits>] = &[
    Criterion::all(
        "SIROH visits fewer inner nodes in most scenes: scenes with fewer, less those without",
        Bound::AtLeast(1.0),
        |rows: &[&Visits]| {
            let sides = rows.iter().map(|row| if row.nodes_change < 0.0 { 1.0 } else { -1.0 });
            (!rows.is_empty()).then(|| Measured::exact(sides.sum()))
        },
    )
    .among(Visits::is_judged),
    Criterion::each(
        "SIROH visits no more inner nodes in any scene and form: change (%)",
        Bound::AtMost(0.0),
        |row: &Visits| row.nodes_change.into(),
    )
    .among(Visits::is_by_siroh)
    .because(TRADE),
    Criterion::each(
        "SIROH tests no more triangles in any scene and form: change (%)",
        Bound::AtMost(0.0),
        |row: &Visits| row.tests_change.into(),
    )
    .among(Visits::is_by_siroh)
    .because(TRADE),
];
/// Why both kinds of work are judged.
const TRADE: &str = "fewer inner nodes at the price of more tests are a trade, no gain";

impl Visits {
    fn published(&self) -> Option<&'static Trees> {
        published(&self.counterpart, &self.form)
    }

    fn changes(&self) -> Option<&'static Changes> {
        published_changes(&self.counterpart, &self.form, &self.heuristic)
    }

    fn is_by_siroh(&self) -> bool {
        self.heuristic == Heuristic::InteriorOrigin.name()
    }

    fn is_judged(&self) -> bool {
        self.form == NEAREST && self.is_by_siroh()
    }
}

/// Exact work of rays on the host, by a stack.
fn work(tree: &KdTree, rays: [&[Ray]; 2]) -> Result<KdCounters> {
    Ok(trace(tree, Scheme::Stack, KdCaches::default(), rays)?.1)
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
                    .map(|one| (&one.tree as &dyn RayIndex, TraceSettings::ray_per_thread()));
                let raced = race(context, &gpu, flight, TURNS, contenders)?;
                let works = grown.iter().map(|one| work(&one.tree, [&closest, &flight.shadow]));
                let works = works.collect::<Result<Vec<_>>>()?;
                for ((one, work), timed) in grown.iter().zip(&works).zip(&raced) {
                    visits.push(Visits {
                        scene: case.name().into(),
                        counterpart: case.counterpart.into(),
                        form: form.words.into(),
                        heuristic: one.heuristic.name().into(),
                        rays: flight.rays() as u64,
                        nodes: flight.per_ray(work.nodes),
                        nodes_change: change(work.nodes as f64, works[0].nodes as f64),
                        tests: flight.per_ray(work.triangles),
                        tests_change: change(work.triangles as f64, works[0].triangles as f64),
                        leaves: flight.per_ray(work.leaves),
                        rate: timed.rates[2].clone(),
                        speed: timed.rates[2].change_from(&raced[0].rates[2]),
                    });
                    trees.push(Grown::of(case, form, one, &grown[0]));
                }
                if form.words == NEAREST {
                    let pair = [&grown[0].tree, &grown[grown.len() - 1].tree];
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
            .note(
                "Build times by wall clock on all of the host's threads, layout for the kernels and all, in turns. By surface area as by SIROH \
                 what the candidates of an axis share is found once: a candidate takes two products, two additions and a division for each \
                 child by the one, and an addition more by the other. The source's builds by SIROH took 7.2 % longer than by surface area on one \
                 processor and 7.7 % on another, in the mean. Trees by 26 regions are not built above 100,000 triangles: they take twenty \
                 times as long as the others.",
            )
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
