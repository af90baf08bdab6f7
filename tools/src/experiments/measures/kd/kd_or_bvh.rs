//! When a kd-tree is better than a bounding volume hierarchy: rays per second and builds of both, from few layers of triangles behind a pixel
//! to many.
//!
//! Oracle: every index gives the same closest hits to the bit, and the same answers whether there is any. The bounding volumes are the
//! engine's best: binned surface area heuristic, and the optimised linear hierarchy.

use clerestory::Result;
use clerestory::gpu::Gpu;
use glam::Vec3;

use super::flights::{CASES, Case, Flight, Raced, TURNS, different, each_flight, other_answers, race, told};
use super::real_models;
use super::tree_kinds::{Built, Kind, Way, build, kinds, layers, steps};
use crate::experiments::findings::{Bound, Criterion, Findings, Repeats, Study, geometric_mean, rows};
use crate::experiments::measures::Context;
use crate::experiments::measures::photon_maps::photon_scenes::Surfaces;

const fn soup(scene: &'static str) -> Case {
    Case::of_our_own(scene, Vec3::new(0.0, 3.0, 0.0))
}

/// As many triangles each, of growing size: the sweep over depth complexity.
static SOUPS: [Case; 4] = [
    soup("builtin:triangle-soup?n=50000&size=0.005"),
    soup("builtin:triangle-soup?n=50000&size=0.02"),
    soup("builtin:triangle-soup?n=50000&size=0.08"),
    soup("builtin:triangle-soup?n=20000&size=0.3"),
];
static SMOKE_SOUP: Case = soup("builtin:triangle-soup?n=500&size=0.1");

/// Turns of the two that are the best.
const TURNS_OF_BEST: usize = 11;
const MIB: f64 = 1_048_576.0;
/// The place of both kinds of rays among a race's rates.
const BOTH: usize = 2;

rows! {
    /// An index over a scene.
    struct Index = "kd-trees and bounding volumes" by [scene, index] {
        scene: String = "scene",
        triangles: u64 = "triangles",
        layers: f64 = "triangles along a ray",
        index: String = "index",
        different: u64 = "timed closest hits, and answers of any hits, that differ",
        build: Repeats = "build (ms)",
        size: f64 = "MiB",
        closest_steps: f64 = "steps per ray, closest",
        any_steps: f64 = "steps per ray, any",
        closest: Repeats = "closest hits by a stack (M rays/s)",
        any: Repeats = "any hits by a stack (M rays/s)",
        both: Repeats = "both by a stack (M rays/s)",
        fastest: String = "fastest traversal",
        by_fastest: Repeats = "both by it (M rays/s)",
    }
}

rows! {
    /// A scene's answer.
    struct Answer = "Best kd-tree beside best bounding volumes" by [scene] {
        scene: String = "scene",
        layers: f64 = "triangles along a ray",
        kd: String = "best kd-tree",
        bvh: String = "best BVH",
        closest: Repeats = "closest hits: kd / BVH",
        any: Repeats = "any hits: kd / BVH",
        both: Repeats = "both: kd / BVH",
        build: Repeats = "build: kd / BVH",
        pays_after: Option<f64> = "kd pays for its build after (M rays)",
    }
}

/// What was found.
#[derive(Debug, Default, serde::Serialize, serde::Deserialize)]
pub struct Found {
    indexes: Vec<Index>,
    answers: Vec<Answer>,
    /// Whose the real models are.
    models: Option<String>,
}

const OF_INDEXES: &[Criterion<Index>] = &[Criterion::each(
    "closest hits are the same to the bit, and answers whether there is any the same, by every index and every way",
    Bound::AtMost(0.0),
    |index: &Index| index.different.into(),
)
.in_every_form()];

const OF_ANSWERS: &[Criterion<Answer>] = &[Criterion::each(
    "the ratio of both is known: the upper end of its interval over the lower",
    Bound::AtMost(1.1),
    |answer: &Answer| {
        let both = answer.both.measured();
        (both.high / both.low).into()
    },
)
.because("ten per cent apart is alike")];

/// Millions of rays after which the better rate has paid for the longer build; `None` where it never does.
fn pays_after([kd_build, bvh_build]: [f64; 2], [kd_rate, bvh_rate]: [f64; 2]) -> Option<f64> {
    // Milliseconds against microseconds per ray.
    (kd_rate > bvh_rate).then(|| (1e-3 * (kd_build - bvh_build)).max(0.0) / (1.0 / bvh_rate - 1.0 / kd_rate))
}

/// Closest hits, any hits or both of a race, by the median.
fn rate(raced: &Raced, query: usize) -> f64 {
    raced.rates[query].measured().value
}

/// The fastest of the ways that fit.
fn fastest(ways: &[Way], raced: &[Raced], query: usize, fit: impl Fn(&Way) -> bool) -> usize {
    let fit = (0..ways.len()).filter(|way| fit(&ways[*way]));
    fit.max_by(|a, b| rate(&raced[*a], query).total_cmp(&rate(&raced[*b], query)))
        .unwrap_or_default()
}

/// A scene with its indexes.
struct Place<'a> {
    context: &'a Context<'a>,
    gpu: &'a Gpu,
    scene: &'a str,
    surfaces: &'a Surfaces,
    flight: &'a Flight,
    layers: f64,
    kinds: &'a [Kind],
    built: &'a [Built],
    ways: &'a [Way],
}

impl Place<'_> {
    fn race<'w>(&self, turns: usize, ways: impl Iterator<Item = &'w Way>) -> Result<Vec<Raced>> {
        let contenders = ways.map(|way| (&*self.built[way.index].0, way.settings()));
        race(self.context, self.gpu, self.flight, turns, contenders)
    }

    fn index(&self, index: usize, raced: &[Raced]) -> Index {
        let (built, build) = &self.built[index];
        let is_of_it = |way: &Way| way.index == index;
        let by_stack = fastest(self.ways, raced, BOTH, |way| is_of_it(way) && way.is_by_stack());
        let [closest, any, both] = raced[by_stack].rates.clone();
        let fastest = fastest(self.ways, raced, BOTH, is_of_it);
        let of_it = self.ways.iter().zip(raced).filter(|(way, _)| is_of_it(way));
        let [closest_hits, any_hits] = &raced[0].hits;
        let others = |one: &Raced| different(&one.hits[0], closest_hits) + other_answers(&one.hits[1], any_hits);
        let [closest_steps, any_steps] = steps(&**built, self.flight);
        Index {
            scene: self.scene.into(),
            triangles: self.surfaces.triangles.len() as u64,
            layers: self.layers,
            index: self.kinds[index].words.into(),
            different: of_it.map(|(_, one)| others(one)).sum(),
            build: build.clone(),
            size: built.statistics().bytes as f64 / MIB,
            closest_steps,
            any_steps,
            closest,
            any,
            both,
            fastest: self.ways[fastest].by.into(),
            by_fastest: raced[fastest].rates[BOTH].clone(),
        }
    }

    /// The best kd-tree and the best BVH of each kind of rays race again: the turns that chose them flatter them.
    fn answer(&self, raced: &[Raced]) -> Result<Answer> {
        let best = |query| [true, false].map(|kd| fastest(self.ways, raced, query, |way| way.is_kd() == kd));
        let pairs = [0, 1, 2].map(best);
        let again = self.race(TURNS_OF_BEST, pairs.iter().flatten().map(|way| &self.ways[*way]))?;
        let ratio = |query: usize| {
            let [kd, bvh] = [0, 1].map(|side| &again[2 * query + side].rates[query]);
            kd.over(bvh)
        };
        let [kd, bvh] = pairs[BOTH].map(|way| &self.ways[way]);
        let builds = [kd, bvh].map(|way| &self.built[way.index].1);
        let rates = [0, 1].map(|side| rate(&again[2 * BOTH + side], BOTH));
        Ok(Answer {
            scene: self.scene.into(),
            layers: self.layers,
            kd: format!("{}; {}", kd.words, kd.by),
            bvh: bvh.words.into(),
            closest: ratio(0),
            any: ratio(1),
            both: ratio(BOTH),
            build: builds[0].over(builds[1]),
            pays_after: pays_after(builds.map(|build| build.measured().value), rates),
        })
    }
}

impl Study for Found {
    fn measure(context: &Context<'_>) -> Result<Self> {
        let gpu = (context.gpu)()?;
        let kinds = kinds();
        let ways = Way::all(&kinds);
        let mut models = None;
        let scenes = match (told(context), context.smoke) {
            (Some(told), _) => told,
            (None, true) => vec![SMOKE_SOUP.clone()],
            (None, false) => {
                let found = real_models::find();
                models = Some(found.words);
                [&CASES[..], &SOUPS, &found.cases].concat()
            }
        };
        let mut answers = Vec::new();
        let indexes = each_flight(context, &scenes, |case, surfaces, flight| {
            let place = Place {
                context,
                gpu: &gpu,
                scene: case.name(),
                surfaces,
                flight,
                layers: layers(surfaces.index(), &flight.camera),
                kinds: &kinds,
                built: &build(context, &kinds, surfaces)?,
                ways: &ways,
            };
            let raced = place.race(TURNS, ways.iter())?;
            answers.push(place.answer(&raced)?);
            Ok((0..kinds.len()).map(|index| place.index(index, &raced)).collect())
        })?;
        Ok(Self {
            indexes,
            answers,
            models,
        })
    }

    fn findings(&self) -> Findings {
        let findings = Findings::of(&self.indexes, OF_INDEXES).note(
            "Flights as in `kd-heuristics`; the soups have as many triangles each, of growing size, but the last fewer, whose kd-trees would \
             not fit the device, and a camera that stands still. Steps are inner nodes and triangles, exact counts: a step of a kd-tree reads a \
             plane of 8 bytes, one of a bounding volume hierarchy two boxes in 64. kd-trees weigh triangles by their parts, with leaves of 4 \
             (the default) and of 1; steps and rates are those by a stack, and beside them stands the fastest of the five schemes. Hits are \
             those of the timed kernels by every scheme, held against the first one's; of any hits, whether there is one: which is met first is the \
             index's own. All ways take turns; builds, on all of the host's \
             threads, take turns too, but those of more than 3 s, which are timed once.",
        );
        let findings = self.models.iter().fold(findings, Findings::note);
        findings
            .and(Findings::of(&self.answers, OF_ANSWERS))
            .headline(
                "rays per second of the best kd-tree over those of the best BVH, geometric mean over the scenes",
                geometric_mean(self.answers.iter().map(|answer| answer.both.measured())),
            )
            .bars(
                "ratio",
                "Rays per second of the best kd-tree over those of the best BVH",
                &self.answers,
                |answer| ["both kinds of rays".into(), answer.scene.clone()],
                |answer| answer.both.measured(),
            )
            .note(
                "The kd-tree with its traversal and the hierarchy with the highest rate of each kind of rays, which then race again by \
                 themselves; those named are the best of both kinds of rays together. A kd-tree is worth its build where the ratio is above one \
                 and more rays are traced than the last column says.",
            )
    }
}
