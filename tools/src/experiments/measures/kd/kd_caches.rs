//! Caches of kd-trees that kernels manage themselves: what they keep from memory, and what that gains.
//!
//! Oracle: all give the same hits to the bit. Source of the comparison: "Interactive Manycore Photon Mapping", PhD thesis, Trinity College
//! Dublin, 2011, tables 4.8 and 4.10.

use clerestory::Result;
use clerestory::accel::RayIndex;
use clerestory::accel::kd::{KdCaches, KdCounters, Scheme};
use clerestory::accel::trace::TraceSettings;

use super::flights::{SOURCE_LEAVES, cases, change, different_of_both, each_flight, race, source_tree, trace};
use crate::experiments::measures::Context;
use crate::experiments::table::{Cell, Table};

/// The forms of [`KdCaches::COMPARED`].
pub(super) const NAMES: [&str; 7] = [
    "none",
    "nodes",
    "last entry",
    "a leaf that waits",
    "nodes, last entry",
    "nodes with boxes, entries as bytes",
    "nodes, a leaf that waits",
];

/// What the source says of a scene without caches, a ray: inner nodes fetched, entries of the stack accessed, bytes; and what the six
/// other forms change in these and in frames a second, in per cent.
struct Published {
    counterpart: &'static str,
    none: [f64; 3],
    nodes: [f64; 6],
    entries: [f64; 6],
    bytes: [f64; 6],
    speed: [f64; 6],
}

const PUBLISHED: [Published; 5] = [
    Published {
        counterpart: "Scene 6",
        none: [7.31, 2.01, 74.51],
        nodes: [-96.4, 0.0, 16.0, -96.4, -93.2, -94.3],
        entries: [0.0, -88.7, 2.2, -88.7, -88.1, 2.2],
        bytes: [-75.6, -19.1, 13.0, -94.7, -92.1, -73.5],
        speed: [2.4, 3.8, -6.2, 6.1, 2.5, -3.2],
    },
    Published {
        counterpart: "Sponza",
        none: [29.81, 12.31, 336.95],
        nodes: [-63.8, 0.0, 13.6, -63.8, -49.9, -52.0],
        entries: [0.0, -63.7, 8.9, -63.7, -48.1, 8.9],
        bytes: [-45.2, -18.6, 12.2, -63.8, -49.4, -34.2],
        speed: [-0.3, 1.3, -29.2, 2.3, -4.3, -29.1],
    },
    Published {
        counterpart: "Sibenik",
        none: [37.63, 14.46, 416.72],
        nodes: [-60.9, 0.0, 11.1, -60.9, -43.8, -49.1],
        entries: [0.0, -60.4, 5.0, -60.4, -37.1, 5.0],
        bytes: [-44.0, -16.8, 9.4, -60.8, -41.9, -34.1],
        speed: [-1.0, 1.2, -27.1, 1.8, -6.0, -27.2],
    },
    Published {
        counterpart: "Fairy",
        none: [37.43, 16.96, 435.06],
        nodes: [-62.6, 0.0, 13.0, -62.6, -52.5, -53.4],
        entries: [0.0, -68.6, 4.1, -68.6, -48.7, 4.1],
        bytes: [-43.1, -21.4, 10.2, -64.5, -51.3, -35.5],
        speed: [-1.5, 1.5, -51.7, 1.0, -5.9, -52.5],
    },
    Published {
        counterpart: "Conference",
        none: [19.57, 6.69, 210.03],
        nodes: [-77.7, 0.0, 12.5, -77.7, -64.3, -68.9],
        entries: [0.0, -74.1, 5.8, -74.1, -59.7, 5.8],
        bytes: [-57.9, -18.9, 10.8, -76.8, -63.2, -49.9],
        speed: [-0.1, 0.4, -42.1, 0.8, -2.9, -42.0],
    },
];

/// The measure.
pub fn measure(context: &Context<'_>) -> Result<Vec<Table>> {
    let gpu = (context.gpu)()?;
    let mut table = Table::new(
        "Caches of a kd-tree in persistent threads",
        &[
            "scene",
            "counterpart",
            "leaves of",
            "caches",
            "hits that differ",
            "timed hits that differ",
            "inner nodes a ray from memory",
            "change of nodes (%)",
            "source: nodes (%)",
            "entries a ray written to and read from memory",
            "change of entries (%)",
            "source: entries (%)",
            "bytes a ray",
            "change of bytes (%)",
            "source: bytes (%)",
            "inner nodes a ray in all",
            "M rays/s",
            "speed, change (%)",
            "source: speed (%)",
        ],
    );
    each_flight(context, &cases(context), |case, surfaces, flight| {
        let published = PUBLISHED.iter().find(|row| row.counterpart == case.counterpart);
        for leaf_size in SOURCE_LEAVES {
            let tree = source_tree(surfaces, leaf_size)?;
            let settings = KdCaches::COMPARED.map(|caches| TraceSettings {
                caches,
                ..TraceSettings::persistent(gpu.caps())
            });
            let contenders = settings.map(|settings| (&tree as &dyn RayIndex, settings));
            let raced = race(context, &gpu, flight, contenders)?;
            let closest = flight.closest();
            let of = |caches| trace(&tree, Scheme::Stack, caches, [&closest, &flight.shadow]);
            let traced = KdCaches::COMPARED.into_iter().map(of).collect::<Result<Vec<_>>>()?;
            let each = |count: u64| count as f64 / flight.rays().max(1) as f64;
            let of = |work: &KdCounters| {
                [
                    each(work.nodes - work.cached_nodes),
                    each(work.pushes + work.pops),
                    each(work.bytes()),
                ]
            };
            let (expected, without) = (&traced[0].0, of(&traced[0].1));
            for (i, (name, (hits, work))) in NAMES.into_iter().zip(&traced).enumerate() {
                let of_source = |of: fn(&Published) -> &[f64; 6]| {
                    Cell::from(published.zip(i.checked_sub(1)).map(|(row, i)| of(row)[i]))
                };
                let mut row: Vec<Cell> = vec![
                    case.name().into(),
                    case.counterpart.into(),
                    u64::from(leaf_size).into(),
                    name.into(),
                    different_of_both(hits, expected).into(),
                    different_of_both(&raced[i].hits, expected).into(),
                ];
                let sources: [fn(&Published) -> &[f64; 6]; 3] =
                    [|row| &row.nodes, |row| &row.entries, |row| &row.bytes];
                for ((value, first), source) in of(work).into_iter().zip(without).zip(sources) {
                    row.extend([value.into(), change(value, first).into(), of_source(source)]);
                }
                let rate = |i: usize| raced[i].rates[2];
                row.extend([
                    each(work.nodes).into(),
                    rate(i).into(),
                    change(rate(i), rate(0)).into(),
                    of_source(|row| &row.speed),
                ]);
                table.row(row);
            }
        }
        if let Some(published) = published {
            let [nodes, entries, bytes] = published.none;
            table.note(format!(
                "{}: without caches the source's {} has {nodes} nodes, {entries} entries and {bytes} bytes a ray.",
                case.name(),
                case.counterpart
            ));
        }
        Ok(())
    })?;
    table.note(
        "Flights as in `kd-heuristics`, SIROH trees over boxes; leaves of 4 are those of the source's text, leaves of 1 come nearer to \
         the numbers of nodes that it gives (see there). Traversal with a stack. Hits, of closest and of any hits, are compared with \
         those of the host without caches: first the host's, then those of the kernels that were timed. Counts are exact and the same on \
         every machine; bytes by the source's model of 8 for each node fetched from memory and each entry written or read there. The \
         nodes that a workgroup loads into its cache beforehand are in none of these counts. On a software driver shared memory and \
         registers are ordinary cached memory, and its cap on loops lets a workgroup trace only some dozens of rays for each of these \
         loads: the times say what the forms cost there, nothing about what they would gain on a device with such memories, where the \
         source found +6 to −52 %. Instructions are not counted.",
    );
    Ok(vec![table])
}
