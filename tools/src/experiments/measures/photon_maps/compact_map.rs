//! Photon maps of compact pairs beside those of complete nodes: stack entries, bytes and time of a query, exact counts before times.
//!
//! Source of the comparison: "Interactive Manycore Photon Mapping", PhD thesis, Trinity College Dublin, 2011, Table 6.4; bytes by its
//! model in which every access is served by itself (§4.3.3): 32 bytes a node or compact pair, 4 a stack entry.

use clerestory::Result;
use clerestory::accel::photon_map::compact_bvh::COMPACT_PAIR_BYTES;
use clerestory::accel::photon_map::complete_bvh::COMPLETE_NODE_BYTES;
use clerestory::accel::photon_map::leaf_threshold::automatic_leaf_size;

use super::map_quality::SOURCE_SHARE;
use super::photon_kernels::{Map, Prepared, Shape, Work, prepared};
use crate::experiments::measures::Context;
use crate::experiments::measures::clock::nanoseconds;
use crate::experiments::table::{Cell, Table};

/// A row of the source's table: a query of complete nodes, and what compact pairs change in per cent.
struct Published {
    counterpart: &'static str,
    nodes: f64,
    compact_entries: f64,
    bytes: f64,
    compact_bytes: f64,
    /// Of frames a second.
    compact_speed: f64,
}

const PUBLISHED: [Published; 3] = [
    Published {
        counterpart: "Scene 6",
        nodes: 300.7,
        compact_entries: -68.5,
        bytes: 10_826.0,
        compact_bytes: -52.1,
        compact_speed: 8.0,
    },
    Published {
        counterpart: "Passage",
        nodes: 236.3,
        compact_entries: -68.4,
        bytes: 8_505.0,
        compact_bytes: -52.0,
        compact_speed: 6.2,
    },
    Published {
        counterpart: "Ring",
        nodes: 447.7,
        compact_entries: -72.5,
        bytes: 16_119.0,
        compact_bytes: -52.5,
        compact_speed: 14.7,
    },
];

/// The measure.
pub fn measure(context: &Context<'_>) -> Result<Vec<Table>> {
    let mut table = Table::new(
        "Point queries of compact pairs beside those of complete nodes",
        &[
            "scene",
            "counterpart",
            "kernels' shape",
            "pairs whose planes are not recovered",
            "queries that test other kernels",
            "storage (%)",
            "nodes a query",
            "source: nodes",
            "anywhere: nodes a query",
            "stack entries, complete",
            "stack entries, compact (%)",
            "source: stack entries, compact (%)",
            "bytes, complete",
            "bytes, compact (%)",
            "source: bytes, complete",
            "source: bytes, compact (%)",
            "µs a query, complete",
            "speed, compact (%)",
            "speed of the tree alone, compact (%)",
            "source: speed (%)",
            "deviation",
        ],
    );
    for prepared in prepared(context, &Shape::ALL) {
        let Prepared {
            case,
            surfaces,
            kernels,
            shape,
            points,
            anywhere,
        } = prepared?;
        let leaf_size = automatic_leaf_size(kernels.areas(), surfaces.area, SOURCE_SHARE);
        let map = Map::new(&kernels, &kernels.linear(leaf_size))?;
        let decoded = map.compact.decode();
        let reached = map.complete.pairs.iter().zip(&decoded);
        let lost = reached.filter(|(complete, compact)| complete != compact).count() as u64;
        let (mut complete, mut compact, mut different) = (Work::default(), Work::default(), 0_u64);
        for point in &points {
            let before = [complete, compact];
            map.gather_complete(*point, &mut complete);
            map.gather_compact(*point, &mut compact);
            let answer = |after: Work, before: Work| {
                let leaves = after.tree.leaves - before.tree.leaves;
                (
                    after.tests - before.tests,
                    after.contributions - before.contributions,
                    leaves,
                )
            };
            different += u64::from(answer(complete, before[0]) != answer(compact, before[1]));
        }
        let time = |gather: fn(&Map, glam::Vec3, &mut Work)| {
            nanoseconds(context.smoke, &points, |point| {
                let mut work = Work::default();
                gather(&map, *point, &mut work);
                work
            })
        };
        let times = [time(Map::gather_complete), time(Map::gather_compact)];
        let times_of_trees = [time(Map::visit_complete), time(Map::visit_compact)];
        let mut everywhere = Work::default();
        for point in &anywhere {
            map.gather_complete(*point, &mut everywhere);
        }
        let each = |count: u64| count as f64 / points.len().max(1) as f64;
        let less = |[first, second]: [u64; 2]| 100.0 * (second as f64 / first.max(1) as f64 - 1.0);
        let published = PUBLISHED.iter().find(|row| row.counterpart == case.counterpart);
        let theirs = |of: fn(&Published) -> f64| Cell::from(published.map(of));
        let pairs = map.complete.pairs.len() as u64;
        let bytes = less([complete.tree.bytes, compact.tree.bytes]);
        let speed = |[first, second]: [f64; 2]| 100.0 * (first / second - 1.0);
        table.row([
            case.name().into(),
            case.counterpart().into(),
            shape.word().into(),
            lost.into(),
            different.into(),
            less([2 * COMPLETE_NODE_BYTES * pairs, COMPACT_PAIR_BYTES * pairs]).into(),
            each(complete.tree.nodes).into(),
            theirs(|row| row.nodes),
            (everywhere.tree.nodes as f64 / anywhere.len().max(1) as f64).into(),
            each(complete.tree.pushes).into(),
            less([complete.tree.pushes, compact.tree.pushes]).into(),
            theirs(|row| row.compact_entries),
            each(complete.tree.bytes).into(),
            bytes.into(),
            theirs(|row| row.bytes),
            theirs(|row| row.compact_bytes),
            (1e-3 * times[0]).into(),
            speed(times).into(),
            speed(times_of_trees).into(),
            theirs(|row| row.compact_speed),
            published.map_or("no counterpart".into(), |row| {
                deviation(bytes, [speed(times), speed(times_of_trees)], row).into()
            }),
        ]);
    }
    table.note(
        "Linear hierarchy over synthetic kernels about the second and third hits of 2¹⁷ photons (2⁹ in a quick look), as many about a \
         point as in the source's Table 5.1: spheres, and ellipsoids stretched by the incidence. Counts are exact and the same on every \
         machine; bytes are of nodes and stack, not of kernels. The source's byte changes are what its own counts give: it prints −71.4 % for one scene, \
         which is that scene's stack column. Anywhere: as many points evenly on all surfaces.",
    );
    table.note(
        "Speed is of the query alone on one thread of a processor, whose cache takes the bytes that the source's GPU had to fetch; the source's \
         is of whole frames. The tree alone: the same queries without the tests of kernels, which both layouts share. Instructions are not counted here.",
    );
    Ok(vec![table])
}

/// Whether bytes and speed change as in the source.
fn deviation(bytes: f64, [speed, of_tree]: [f64; 2], theirs: &Published) -> String {
    let bytes = format!("bytes {:+.1} points", bytes - theirs.compact_bytes);
    let sign = if speed.signum() == theirs.compact_speed.signum() {
        "speed's sign as there"
    } else {
        "speed's sign turned"
    };
    let reason = if of_tree > speed {
        ", less of it than the tree alone has, by the tests of kernels"
    } else {
        ""
    };
    format!("{bytes}; {sign}{reason}")
}
