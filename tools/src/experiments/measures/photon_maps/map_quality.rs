//! Photon maps of the linear hierarchy beside those of the voxel volume heuristic: nodes fetched, kernels tested and time of a query.
//!
//! Source of the comparison: B. Fabianowski, "Interactive Manycore Photon Mapping", PhD thesis, Trinity College Dublin, 2011, Table 6.3.

use clerestory::Result;
use clerestory::accel::photon_map::leaf_threshold::automatic_leaf_size;
use glam::Vec3;

use super::photon_kernels::{Map, Prepared, SOURCE_SHAPE, Shape, of_each_prepared};
use crate::experiments::findings::{Bound, Criterion, Findings, Measured, Repeats, Study, change, rows};
use crate::experiments::measures::Context;

/// The share of a point's kernels in a leaf that the source's leaf sizes need.
pub const SOURCE_SHARE: f64 = 1.0 / 16.0;

/// A row of the source's table: a query by the volume heuristic, and what the linear hierarchy changes in per cent.
struct Published {
    counterpart: &'static str,
    nodes: f64,
    linear_nodes: f64,
    /// Kernels tested.
    kernels: f64,
    linear_kernels: f64,
    /// Of frames a second.
    linear_speed: f64,
}

const PUBLISHED: [Published; 3] = [
    Published {
        counterpart: "Scene 6",
        nodes: 288.4,
        linear_nodes: 4.3,
        kernels: 1163.8,
        linear_kernels: 8.9,
        linear_speed: -3.9,
    },
    Published {
        counterpart: "Passage",
        nodes: 211.3,
        linear_nodes: 11.8,
        kernels: 1683.6,
        linear_kernels: 7.2,
        linear_speed: -7.9,
    },
    Published {
        counterpart: "Ring",
        nodes: 369.9,
        linear_nodes: 21.0,
        kernels: 481.9,
        linear_kernels: 13.1,
        linear_speed: -12.7,
    },
];
/// Means of all nine scenes of the source: nodes, kernels tested, frames a second.
const PUBLISHED_MEANS: [f64; 3] = [13.3, 9.4, -8.5];

rows! {
    /// A scene with kernels of a shape.
    struct Row = "Queries of the linear hierarchy beside those of the volume heuristic" by [scene, shape] {
        scene: String = "scene",
        counterpart: String = "counterpart",
        shape: String = "kernels' shape",
        kernels: u64 = "kernels",
        stretch: f64 = "length of a kernel over its width, mean",
        leaf_size: u64 = "leaf size",
        nodes: f64 = "nodes, volume heuristic",
        linear_nodes: f64 = "nodes, linear (%)",
        tests: f64 = "kernels tested, volume heuristic",
        linear_tests: f64 = "kernels tested, linear (%)",
        cost: f64 = "volume cost, linear / heuristic",
        linear_nodes_anywhere: f64 = "anywhere: nodes, linear (%)",
        linear_tests_anywhere: f64 = "anywhere: kernels tested, linear (%)",
        time: Repeats = "a query, volume heuristic (µs)",
        linear_speed: Repeats = "speed, linear (%)",
    }
    beside "source: nodes, volume heuristic" = |row| row.published().map(|source| source.nodes).into();
    beside "source: nodes, linear (%)" = |row| row.published().map(|source| source.linear_nodes).into();
    beside "source: kernels tested, volume heuristic" = |row| row.published().map(|source| source.kernels).into();
    beside "source: kernels tested, linear (%)" = |row| row.published().map(|source| source.linear_kernels).into();
    beside "source: speed, linear (%)" = |row| row.published().map(|source| source.linear_speed).into();
}

rows! {
    /// All scenes with kernels of a shape.
    struct Mean = "What the linear hierarchy changes, means of the scenes" by [shape] {
        shape: String = "kernels' shape",
        nodes: f64 = "nodes (%)",
        tests: f64 = "kernels tested (%)",
        speed: Measured = "speed (%)",
        nodes_anywhere: f64 = "anywhere: nodes (%)",
        tests_anywhere: f64 = "anywhere: kernels tested (%)",
    }
    beside "source: nodes (%)" = |_row| PUBLISHED_MEANS[0].into();
    beside "source: kernels tested (%)" = |_row| PUBLISHED_MEANS[1].into();
    beside "source: speed (%)" = |_row| PUBLISHED_MEANS[2].into();
}

/// What was found.
pub type Found = Vec<Row>;

const AS_FAR: &str = "about the source's mean: half of it to twice";
const NODES: f64 = PUBLISHED_MEANS[0];
const TESTS: f64 = PUBLISHED_MEANS[1];
/// Slower: below zero.
const SPEED: f64 = PUBLISHED_MEANS[2];

const CRITERIA: &[Criterion<Mean>] = &[
    Criterion::each(
        "nodes, mean of the scenes (%)",
        Bound::Between(0.5 * NODES, 2.0 * NODES),
        |mean: &Mean| mean.nodes.into(),
    )
    .among(Mean::is_as_the_source)
    .because(AS_FAR),
    Criterion::each(
        "kernels tested, mean of the scenes (%)",
        Bound::Between(0.5 * TESTS, 2.0 * TESTS),
        |mean: &Mean| mean.tests.into(),
    )
    .among(Mean::is_as_the_source)
    .because(AS_FAR),
    Criterion::each(
        "speed, mean of the scenes (%)",
        Bound::Between(2.0 * SPEED, 0.5 * SPEED),
        |mean: &Mean| mean.speed,
    )
    .among(Mean::is_as_the_source)
    .because(AS_FAR),
];

impl Mean {
    fn is_as_the_source(&self) -> bool {
        self.shape == SOURCE_SHAPE.word()
    }

    /// Of each shape that has rows.
    fn all(rows: &[Row]) -> Vec<Self> {
        let of = |shape: Shape| {
            let of_shape: Vec<&Row> = rows.iter().filter(|row| row.shape == shape.word()).collect();
            let mean =
                |of: &dyn Fn(&Row) -> f64| of_shape.iter().map(|row| of(row)).sum::<f64>() / of_shape.len() as f64;
            (!of_shape.is_empty()).then(|| Self {
                shape: shape.word().into(),
                nodes: mean(&|row| row.linear_nodes),
                tests: mean(&|row| row.linear_tests),
                speed: Measured {
                    value: mean(&|row| row.linear_speed.measured().value),
                    low: mean(&|row| row.linear_speed.measured().low),
                    high: mean(&|row| row.linear_speed.measured().high),
                },
                nodes_anywhere: mean(&|row| row.linear_nodes_anywhere),
                tests_anywhere: mean(&|row| row.linear_tests_anywhere),
            })
        };
        Shape::ALL.into_iter().filter_map(of).collect()
    }
}

impl Row {
    fn published(&self) -> Option<&'static Published> {
        PUBLISHED.iter().find(|source| source.counterpart == self.counterpart)
    }

    fn of(context: &Context<'_>, prepared: &Prepared) -> Result<Self> {
        let Prepared {
            case,
            surfaces,
            kernels,
            shape,
            points,
            anywhere,
        } = prepared;
        let leaf_size = automatic_leaf_size(kernels.areas(), surfaces.area, SOURCE_SHARE);
        let trees = [kernels.by_volume(leaf_size), kernels.linear(leaf_size)];
        let maps = [Map::new(kernels, &trees[0])?, Map::new(kernels, &trees[1])?];
        let times = context.in_turns(9, maps.len(), |i| {
            Ok(1e-3 * maps[i].nanoseconds(points, Map::gather_complete))
        })?;
        let times: Vec<Repeats> = times.into_iter().map(Repeats).collect();
        let work = |points: &[Vec3]| [0, 1].map(|i: usize| maps[i].work(points, Map::gather_complete));
        let (work, work_anywhere) = (work(points), work(anywhere));
        let each = |count: u64| count as f64 / points.len().max(1) as f64;
        let more = |[first, second]: [u64; 2]| change(second as f64, first.max(1) as f64);
        Ok(Self {
            scene: case.name().into(),
            counterpart: case.counterpart().into(),
            shape: shape.word().into(),
            kernels: kernels.len() as u64,
            stretch: kernels.mean_stretch(),
            leaf_size: leaf_size.into(),
            nodes: each(work[0].tree.nodes),
            linear_nodes: more(work.map(|work| work.tree.nodes)),
            tests: each(work[0].tests),
            linear_tests: more(work.map(|work| work.tests)),
            cost: trees[1].volume_cost() / trees[0].volume_cost(),
            linear_nodes_anywhere: more(work_anywhere.map(|work| work.tree.nodes)),
            linear_tests_anywhere: more(work_anywhere.map(|work| work.tests)),
            linear_speed: times[0].change_from(&times[1]),
            time: times[0].clone(),
        })
    }
}

impl Study for Found {
    fn measure(context: &Context<'_>) -> Result<Self> {
        of_each_prepared(context, |prepared| Ok(vec![Row::of(context, prepared)?]))
    }

    fn findings(&self) -> Findings {
        let means = Mean::all(self);
        let of_source = means.iter().find(|mean| mean.is_as_the_source());
        Findings::of(&means, CRITERIA)
            .headline(
                "change of a query's speed by the linear hierarchy, mean of the scenes (%)",
                of_source.map(|mean| mean.speed),
            )
            .note(
                "The source's means are over its nine scenes, of frames a second. Its kernels come from photon differentials, as footprints do, in \
                 its own scenes.",
            )
            .bars(
                "nodes",
                "Nodes of a query in the linear hierarchy, over those in the tree of the volume heuristic",
                self,
                |row| [row.scene.clone(), row.shape.clone()],
                |row| (1.0 + row.linear_nodes / 100.0).into(),
            )
            .and(Findings::of(self, &[]))
            .note(
                "Footprints: kernels of 2¹⁷ photons (2⁹ in a smoke run) by the photon tracer, with the source's settings, about as many about a \
                 point as in its Table 5.1; criteria are of these. Spheres and ellipsoids: stand-ins about the second and third hits, the latter \
                 stretched as the footprint of a beam is by its incidence, at most 20 times as long as wide, the source's bound. \
                 Counts are exact: nodes fetched, two per pair; times \
                 on one thread, complete nodes. Anywhere: as many points evenly on all surfaces.",
            )
    }
}
