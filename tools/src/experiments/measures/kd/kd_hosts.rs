//! SIROH in other tracers than the one that chose it: persistent threads with caches, and rays without a full stack, beside one thread per ray by a
//! stack; with the light among the surfaces and outside.
//!
//! Oracle: every tracer finds the same hits in both trees. Source of the comparison: B. Fabianowski, "Interactive Manycore Photon Mapping", PhD
//! thesis, Trinity College Dublin, 2011, §4.1.4, tables 4.1 and 4.2: its own second code base, RT² and Radius-CUDA.

use clerestory::Result;
use clerestory::accel::RayIndex;
use clerestory::accel::kd::{Heuristic, KdCaches, KdCounters, KdSettings, KdTree, Scheme};
use clerestory::accel::trace::TraceSettings;
use clerestory::gpu::Gpu;

use super::flights::{
    Case, Flight, Raced, TURNS, cases, different, each_flight, fly, other_answers, outside, race, trace,
};
use super::kd_threads::{BEST_CACHES, tuned};
use super::kd_traversal::SCHEMES;
use super::published::{OTHER_TRACERS, RADIUS, of_source};
use crate::experiments::findings::{
    Bound, Criterion, Findings, Measured, Repeats, Study, change, geometric_mean, rows,
};
use crate::experiments::measures::Context;
use crate::experiments::measures::photon_maps::photon_scenes::Surfaces;

/// A tracer: its name, its way through trees, its caches.
type Tracer = (&'static str, Scheme, KdCaches);

/// The one of `kd-heuristics` first.
const TRACERS: [Tracer; 3] = [
    ("one thread per ray, stack", Scheme::Stack, KdCaches::COMPARED[0]),
    ("queue, nodes and last entry cached", Scheme::Stack, BEST_CACHES),
    (
        "one thread per ray, push-down and short stack of 4",
        SCHEMES[4].1,
        KdCaches::COMPARED[0],
    ),
];

/// Means of the source's five scenes, of frames a second over those by surface area: its code base II, and RT².
const SOURCE_MEANS: [f64; 2] = [1.041, 1.029];

const INSIDE: &str = "inside";
const OUTSIDE: &str = "outside";

rows! {
    /// A tracer in a scene with a light.
    struct Row = "SIROH beside surface area by tracer" by [scene, tracer, light] {
        scene: String = "scene",
        counterpart: String = "counterpart",
        tracer: String = "tracer",
        light: String = "light",
        rays: u64 = "rays",
        different: u64 = "timed closest hits, and answers of shadow rays, that differ",
        nodes: f64 = "inner nodes per ray, surface area",
        nodes_change: f64 = "SIROH: change of nodes (%)",
        tests_change: f64 = "SIROH: change of tests (%)",
        bytes: f64 = "bytes per ray, surface area",
        bytes_change: f64 = "SIROH: change of bytes (%)",
        rate: Repeats = "surface area (M rays/s)",
        closest_speed: Repeats = "SIROH: change of speed, closest hits (%)",
        shadow_speed: Repeats = "SIROH: change of speed, shadow rays (%)",
        speed: Repeats = "SIROH: change of speed, both (%)",
    }
    beside "source, code base II: change of speed (%)" = |row| row.of_source(0).into();
    beside "source, RT²: change of speed (%)" = |row| row.of_source(1).into();
    beside "source, Radius-CUDA: change of speed (%)" = |row| row.of_radius().into();
}

rows! {
    /// A tracer over all scenes, the light inside.
    struct Mean = "SIROH over surface area, the light among the surfaces, all scenes" by [tracer] {
        tracer: String = "tracer",
        scenes: u64 = "scenes",
        fewer: u64 = "scenes with fewer inner nodes",
        nodes: f64 = "inner nodes, geometric mean",
        speed: Measured = "speed, geometric mean",
    }
    beside "source, code base II: speed, mean" = |_row| SOURCE_MEANS[0].into();
    beside "source, RT²: speed, mean" = |_row| SOURCE_MEANS[1].into();
}

/// What was found.
pub type Found = Vec<Row>;

const CRITERIA: &[Criterion<Row>] = &[Criterion::each(
    "closest hits are the same to the bit, and answers of shadow rays the same, in both trees by every tracer",
    Bound::AtMost(0.0),
    |row: &Row| row.different.into(),
)
.in_every_form()];

const OF_MEANS: &[Criterion<Mean>] = &[
    Criterion::each(
        "SIROH visits fewer inner nodes in most scenes by every tracer: scenes with fewer, less those without",
        Bound::AtLeast(1.0),
        |mean: &Mean| (2.0 * mean.fewer as f64 - mean.scenes as f64).into(),
    ),
    Criterion::each(
        "rays are no slower by SIROH in the mean of the scenes, by every tracer: speed over that by surface area",
        Bound::AtLeast(1.0),
        |mean: &Mean| mean.speed,
    )
    .because("the source's means are 1.029 to 1.041"),
];

impl Row {
    /// Of the source's other tracers, whose lights were inside.
    fn of_source(&self, tracer: usize) -> Option<f64> {
        let changes = of_source(&OTHER_TRACERS, &self.counterpart)?;
        (self.light == INSIDE).then_some(changes[tracer])
    }

    fn of_radius(&self) -> Option<f64> {
        let (scene, [inside, outside]) = RADIUS;
        let change = if self.light == INSIDE { inside } else { outside };
        (self.counterpart == scene).then_some(change)
    }
}

impl Mean {
    /// Of each tracer that has rows.
    fn all(rows: &[Row]) -> Vec<Self> {
        let ratio = |change: f64| 1.0 + 0.01 * change;
        let of = |(tracer, ..): &Tracer| {
            let of_tracer = rows.iter().filter(|row| row.tracer == *tracer && row.light == INSIDE);
            let rows: Vec<&Row> = of_tracer.collect();
            let speed = |row: &&Row| row.speed.0.iter().map(|change| ratio(*change)).collect::<Repeats>();
            Some(Self {
                tracer: (*tracer).into(),
                scenes: rows.len() as u64,
                fewer: rows.iter().filter(|row| row.nodes_change < 0.0).count() as u64,
                nodes: geometric_mean(rows.iter().map(|row| ratio(row.nodes_change).into()))?.value,
                speed: geometric_mean(rows.iter().map(|row| speed(row).measured()))?,
            })
        };
        TRACERS.iter().filter_map(of).collect()
    }
}

/// Trees by surface area and by SIROH, of the form that is nearest to the source's.
fn trees(surfaces: &Surfaces) -> Result<[KdTree; 2]> {
    let build = |heuristic| {
        let settings = KdSettings {
            heuristic,
            clip: false,
            leaf_size: 1,
            ..KdSettings::default()
        };
        KdTree::build(&surfaces.triangles, &settings)
    };
    Ok([build(Heuristic::SurfaceArea)?, build(Heuristic::InteriorOrigin)?])
}

/// How the device runs a tracer, with the number of workgroups that suits the tree by surface area.
fn settings(gpu: &Gpu, tree: &KdTree, (_, scheme, caches): Tracer, flight: &Flight) -> Result<TraceSettings> {
    if caches == KdCaches::default() {
        let settings = TraceSettings::ray_per_thread();
        return Ok(TraceSettings { scheme, ..settings });
    }
    let settings = TraceSettings::persistent(gpu.caps());
    tuned(gpu, tree, TraceSettings { caches, ..settings }, flight)
}

/// All tracers in both trees, with a light.
fn in_light(
    (context, gpu): (&Context<'_>, &Gpu),
    case: &Case,
    trees: &[KdTree; 2],
    settings: &[TraceSettings],
    (light, flight): (&str, &Flight),
) -> Result<Vec<Row>> {
    let of_trees = |settings: &TraceSettings| trees.each_ref().map(|tree| (tree as &dyn RayIndex, *settings));
    let raced = race(context, gpu, flight, TURNS, settings.iter().flat_map(of_trees))?;
    let [closest_hits, any_hits] = &raced[0].hits;
    let differ = |one: &Raced| different(&one.hits[0], closest_hits) + other_answers(&one.hits[1], any_hits);
    let mut rows = Vec::new();
    for (tracer, timed) in TRACERS.into_iter().zip(raced.chunks_exact(2)) {
        let [area, siroh] = work(tracer, trees, flight)?;
        let speed = |query: usize| timed[1].rates[query].change_from(&timed[0].rates[query]);
        rows.push(Row {
            scene: case.name().into(),
            counterpart: case.counterpart.into(),
            tracer: tracer.0.into(),
            light: light.into(),
            rays: flight.rays() as u64,
            different: timed.iter().map(differ).sum(),
            nodes: flight.per_ray(area.nodes),
            nodes_change: change(siroh.nodes as f64, area.nodes as f64),
            tests_change: change(siroh.triangles as f64, area.triangles as f64),
            bytes: flight.per_ray(area.bytes()),
            bytes_change: change(siroh.bytes() as f64, area.bytes() as f64),
            rate: timed[0].rates[2].clone(),
            closest_speed: speed(0),
            shadow_speed: speed(1),
            speed: speed(2),
        });
    }
    Ok(rows)
}

/// Exact work of a tracer in both trees, on the host.
fn work((_, scheme, caches): Tracer, trees: &[KdTree; 2], flight: &Flight) -> Result<[KdCounters; 2]> {
    let closest = flight.closest();
    let of = |tree: &KdTree| -> Result<KdCounters> { Ok(trace(tree, scheme, caches, [&closest, &flight.shadow])?.1) };
    Ok([of(&trees[0])?, of(&trees[1])?])
}

impl Study for Found {
    fn measure(context: &Context<'_>) -> Result<Self> {
        let gpu = (context.gpu)()?;
        each_flight(context, &cases(context), |case, surfaces, flight| {
            let trees = trees(surfaces)?;
            let settings = TRACERS.map(|tracer| settings(&gpu, &trees[0], tracer, flight));
            let settings = settings.into_iter().collect::<Result<Vec<_>>>()?;
            let in_light =
                |light: &str, flight: &Flight| in_light((context, &gpu), case, &trees, &settings, (light, flight));
            // A scene without a light among its surfaces is lit from outside.
            if case.light.is_none() {
                return in_light(OUTSIDE, flight);
            }
            let mut rows = in_light(INSIDE, flight)?;
            rows.extend(in_light(OUTSIDE, &fly(context, case, surfaces, outside(surfaces))?)?);
            Ok(rows)
        })
    }

    fn findings(&self) -> Findings {
        let means = Mean::all(self);
        let others = means.iter().skip(1);
        let inside: Vec<Row> = self.iter().filter(|row| row.light == INSIDE).cloned().collect();
        Findings::of(self, CRITERIA)
            .headline(
                "speed by SIROH over that by surface area in both other tracers, the light among the surfaces, geometric mean",
                geometric_mean(others.map(|mean| mean.speed)),
            )
            .bars(
                "nodes",
                "Inner nodes per ray by SIROH over those by surface area",
                &inside,
                |row| [row.scene.clone(), row.tracer.clone()],
                |row| (1.0 + 0.01 * row.nodes_change).into(),
            )
            .note(
                "Flights and trees as in `kd-heuristics`: boxes, leaves of 1. Work is counted on the host, exact and the same on every machine; \
                 bytes are 8 for each inner node and each entry of the stack that memory serves. Both trees take turns in all tracers; the \
                 queue's number of workgroups is the fastest in the tree by surface area. Hits are those of the timed kernels. The source's other \
                 tracers are not at hand: their figures are of frames a second, of its scenes, and Radius-CUDA's of one view of the animation \
                 that the forest stands for, there with shadow rays; without them SIROH is 2.5 % faster.",
            )
            .and(Findings::of(&means, OF_MEANS))
    }
}

#[cfg(test)]
mod tests {
    use super::super::flights::CASES;
    use super::*;
    use crate::random::Random;
    use clerestory::accel::{Aabb, Ray};
    use glam::Vec3;

    #[test]
    fn siroh_visits_fewer_nodes_from_inside_a_scene_in_every_tracer() {
        let cathedral = &CASES[2];
        let surfaces = Surfaces::load(&cathedral.scene).unwrap();
        let corners = surfaces.triangles.iter().flatten();
        let bounds = corners.fold(Aabb::EMPTY, |bounds, corner| bounds.with_point(*corner));
        let mut random = Random::new(21);
        // What SIROH supposes: origins evenly in the scene's box, and directions even too.
        let mut ray = |t_max: f32| {
            let place = Vec3::from_array([0; 3].map(|_| random.unit() as f32));
            Ray {
                origin: (bounds.lower + place * (bounds.upper - bounds.lower)).into(),
                t_min: 0.0,
                direction: random.direction().as_vec3().into(),
                t_max,
            }
        };
        let mut rays = |t_max: f32| -> Vec<Ray> { (0..2000).map(|_| ray(t_max)).collect() };
        let flight = Flight {
            camera: rays(f32::INFINITY),
            reflection: Vec::new(),
            shadow: rays(5.0),
        };
        let trees = trees(&surfaces).unwrap();
        let both = [&flight.camera[..], &flight.shadow[..]];
        let (expected, by_stack) = trace(&trees[0], Scheme::Stack, KdCaches::default(), both).unwrap();
        for tracer in TRACERS {
            for tree in &trees {
                let (hits, _) = trace(tree, tracer.1, tracer.2, both).unwrap();
                assert_eq!(different(&hits[0], &expected[0]), 0, "{}", tracer.0);
                assert_eq!(other_answers(&hits[1], &expected[1]), 0, "{}", tracer.0);
            }
            let [area, siroh] = work(tracer, &trees, &flight).unwrap();
            assert!(siroh.nodes < area.nodes, "{}: {siroh:?} {area:?}", tracer.0);
            // Caches change where nodes come from, not which are visited.
            assert!(
                tracer.1 != Scheme::Stack || area.nodes == by_stack.nodes,
                "{}",
                tracer.0
            );
        }
    }
}
