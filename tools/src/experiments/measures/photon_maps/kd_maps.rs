//! Photon maps of kd-trees over points, as they were at first, beside trees of boxes over kernels: build, nodes, bytes, kernels tested and time of a
//! query, and of searches for the nearest photons.
//!
//! Source of the comparison: B. Fabianowski, "Interactive Manycore Photon Mapping", PhD thesis, Trinity College Dublin, 2011, §3.4.3, which
//! describes the kd-trees and measures none of them. Oracle: each query finds as many kernels in every map, and the nearest points are the same
//! in both trees.

use clerestory::Result;
use clerestory::accel::photon_map::compact_bvh::COMPACT_PAIR_BYTES;
use clerestory::accel::photon_map::leaf_threshold::automatic_leaf_size;
use clerestory::accel::yardstick::left_balanced::LeftBalancedTree;
use clerestory::accel::yardstick::voxel_volume::VoxelVolumeTree;
use glam::Vec3;

use super::map_quality::SOURCE_SHARE;
use super::photon_kernels::{Map, Prepared, Work, of_each_prepared};
use super::point_maps::PointMap;
use crate::experiments::findings::{Bound, Criterion, Findings, Repeats, Study, geometric_mean, rows};
use crate::experiments::measures::Context;
use crate::experiments::measures::clock::nanoseconds_once;
use crate::timing::timed;

/// One in so many of the points that the camera sees is asked for: queries of trees over points take as long as all kernels within the widest one.
const POINT_STEP: usize = 16;
const BALANCED: &str = "points, left-balanced kd-tree";
const BY_VOLUME: &str = "points, kd-tree by volume heuristic";
/// kd-trees first, the one that others are compared with before all.
const MAPS: [&str; 4] = [
    BALANCED,
    BY_VOLUME,
    "kernels, boxes by volume heuristic",
    "kernels, linear hierarchy",
];
/// Photons of a search for the nearest.
const NEAREST: usize = 50;
const BUILDS: usize = 5;
const TURNS: usize = 9;

rows! {
    /// A map of a scene's kernels.
    struct Row = "Photon maps of kd-trees over points beside trees of boxes over kernels" by [scene, shape, map] {
        scene: String = "scene",
        counterpart: String = "counterpart",
        shape: String = "kernels' shape",
        map: String = "map",
        kernels: u64 = "kernels",
        different: u64 = "queries with another number of kernels than in the first map",
        build: Repeats = "build (ms)",
        storage: f64 = "bytes of nodes per kernel",
        nodes: f64 = "nodes per query",
        nodes_ratio: f64 = "nodes / those of the first map",
        read: f64 = "bytes of nodes and stack per query",
        tests: f64 = "kernels tested per query",
        contributions: f64 = "kernels that count",
        time: Repeats = "a query (µs)",
        speed: Repeats = "speed / that of the first map",
        nearest_different: Option<u64> = "searches for the 50 nearest that find others than the first map",
        nearest_nodes: Option<f64> = "nodes per search for the 50 nearest",
    }
}
/// What was found.
pub type Found = Vec<Row>;

const CRITERIA: &[Criterion<Row>] = &[
    Criterion::each(
        "every query finds as many kernels in each map, and searches the same points: queries and searches that differ",
        Bound::AtMost(0.0),
        |row: &Row| (row.different + row.nearest_different.unwrap_or(0)).into(),
    )
    .in_every_form(),
    Criterion::each(
        "the volume heuristic's kd-tree visits fewer nodes than the balanced one: nodes over those",
        Bound::AtMost(1.0),
        |row: &Row| row.nodes_ratio.into(),
    )
    .among(|row| row.map == BY_VOLUME)
    .because("what it is built for: Wald, Günther and Slusallek, 2004"),
];

/// All maps of a case.
fn of(context: &Context<'_>, prepared: &Prepared) -> Result<Vec<Row>> {
    let Prepared {
        case,
        surfaces,
        kernels,
        shape,
        points,
        ..
    } = prepared;
    let points: &[Vec3] = &points.iter().copied().step_by(POINT_STEP).collect::<Vec<_>>();
    let leaf_size = automatic_leaf_size(kernels.areas(), surfaces.area, SOURCE_SHARE);
    let (centres, reach) = (kernels.centres(), kernels.reach());
    let builds = context.in_turns(BUILDS, MAPS.len(), |map| {
        let seconds = match map {
            0 => timed(|| LeftBalancedTree::build(&centres)).1,
            1 => timed(|| VoxelVolumeTree::build(&centres, reach)).1,
            2 => timed(|| kernels.by_volume(leaf_size)).1,
            _ => timed(|| kernels.linear(leaf_size)).1,
        };
        Ok(1e3 * seconds)
    })?;
    let balanced = PointMap::new(kernels, LeftBalancedTree::build(&centres)?);
    let by_volume = PointMap::new(kernels, VoxelVolumeTree::build(&centres, reach)?);
    let boxes = Map::new(kernels, &kernels.by_volume(leaf_size))?;
    let linear = Map::new(kernels, &kernels.linear(leaf_size))?;
    let gather = |map: usize, point: &Vec3| {
        let mut work = Work::default();
        match map {
            0 => balanced.gather(*point, &mut work),
            1 => by_volume.gather(*point, &mut work),
            2 => boxes.gather_compact(*point, &mut work),
            _ => linear.gather_compact(*point, &mut work),
        }
        work
    };
    let times = context.in_turns(TURNS, MAPS.len(), |map| {
        Ok(1e-3 * nanoseconds_once(points, |point| gather(map, point)))
    })?;
    let times: Vec<Repeats> = times.into_iter().map(Repeats).collect();
    let works: Vec<Vec<Work>> = (0..MAPS.len())
        .map(|map| points.iter().map(|point| gather(map, point)).collect())
        .collect();
    let per_query = |sum: u64| sum as f64 / points.len().max(1) as f64;
    let mean = |map: usize, of: fn(&Work) -> u64| per_query(works[map].iter().map(of).sum());
    let pairs = |map: &Map| COMPACT_PAIR_BYTES * map.compact.pairs.len() as u64;
    let bytes = [balanced.bytes(), by_volume.bytes(), pairs(&boxes), pairs(&linear)];
    let nearest = [balanced.nearest(points, NEAREST), by_volume.nearest(points, NEAREST)];
    let row = |map: usize| {
        let others = works[map].iter().zip(&works[0]);
        let searches = nearest.get(map);
        let other_points = |found: &[Vec<u32>]| {
            let pairs = found.iter().zip(&nearest[0].0);
            pairs.filter(|(found, first)| found != first).count() as u64
        };
        Row {
            scene: case.name().into(),
            counterpart: case.counterpart().into(),
            shape: shape.word().into(),
            map: MAPS[map].into(),
            kernels: kernels.len() as u64,
            different: others.filter(|(a, b)| a.contributions != b.contributions).count() as u64,
            build: Repeats(builds[map].clone()),
            storage: bytes[map] as f64 / kernels.len().max(1) as f64,
            nodes: mean(map, |work| work.tree.nodes),
            nodes_ratio: mean(map, |work| work.tree.nodes) / mean(0, |work| work.tree.nodes),
            read: mean(map, |work| work.tree.bytes),
            tests: mean(map, |work| work.tests),
            contributions: mean(map, |work| work.contributions),
            speed: times[0].over(&times[map]),
            time: times[map].clone(),
            nearest_different: searches.map(|(found, _)| other_points(found)),
            nearest_nodes: searches.map(|(_, counters)| per_query(counters.nodes)),
        }
    };
    Ok((0..MAPS.len()).map(row).collect())
}

impl Study for Found {
    fn measure(context: &Context<'_>) -> Result<Self> {
        of_each_prepared(context, |prepared| of(context, prepared))
    }

    fn findings(&self) -> Findings {
        let by_volume = self.iter().filter(|row| row.map == BY_VOLUME);
        Findings::of(self, CRITERIA)
            .headline(
                "nodes of a query in the kd-tree by the volume heuristic over those in the left-balanced one, geometric mean",
                geometric_mean(by_volume.map(|row| row.nodes_ratio.into())),
            )
            .bars(
                "tests",
                "Kernels tested per query",
                self,
                |row| [format!("{}, {}", row.scene, row.shape), row.map.clone()],
                |row| row.tests.into(),
            )
            .note(
                "Kernels of 2¹⁷ photons (2⁹ in a smoke run), footprints and stand-ins for them, as in `map-quality`; queries at one in 16 of the points where the \
                 camera looks, one thread. Counts are exact. A kd-tree over points knows no kernel's extent: it asks every point as near as the \
                 widest kernel reaches, where boxes ask those of the leaves that hold the point. Its nodes of 16 and 20 bytes hold the points; \
                 those of boxes, 32 bytes a pair, do not. Bytes are of nodes and stack entries, not of kernels. Searches for the 50 nearest \
                 photons, which trees of boxes do not answer, begin with the same reach.",
            )
            .note(
                "Both kd-trees are built on one thread, the balanced one by medians, the other by sorted lists that are handed down. No picture \
                 takes either.",
            )
    }
}
