//! Photon maps of the linear hierarchy beside those of the voxel volume heuristic: nodes fetched, kernels tested and time of a query.
//!
//! Source of the comparison: "Interactive Manycore Photon Mapping", PhD thesis, Trinity College Dublin, 2011, Table 6.3.

use clerestory::Result;
use clerestory::accel::lbvh::leaf_threshold::automatic_leaf_size;

use super::Context;
use super::leaf_sizes::query_times;
use super::photon_kernels::{Map, Prepared, Work, prepared};
use crate::experiments::table::{Cell, Table};

/// The share of a point's kernels in a leaf that the source's leaf sizes need.
pub const SOURCE_SHARE: f64 = 1.0 / 16.0;
const REPEATS: usize = 5;

/// Nodes a query by the volume heuristic and what the linear hierarchy adds, kernels likewise, change of frames a second; per cent.
const DOCUMENT: [(&str, [f64; 5]); 3] = [
    ("Scene 6", [288.4, 4.3, 1163.8, 8.9, -3.9]),
    ("Passage", [211.3, 11.8, 1683.6, 7.2, -7.9]),
    ("Ring", [369.9, 21.0, 481.9, 13.1, -12.7]),
];

/// The measure.
pub fn measure(context: &Context<'_>) -> Result<Vec<Table>> {
    let mut table = Table::new(
        "Queries of the linear hierarchy beside those of the volume heuristic",
        &[
            "scene",
            "counterpart",
            "kernels",
            "leaf size",
            "nodes, volume heuristic",
            "nodes, linear (%)",
            "source: nodes",
            "source: linear (%)",
            "kernels tested, volume heuristic",
            "linear (%)",
            "source: kernels tested",
            "source: linear (%) ",
            "volume cost, linear / heuristic",
            "µs a query, volume heuristic",
            "speed, linear (%)",
            "source: speed (%)",
        ],
    );
    let mut sums = [0.0; 3];
    let mut rows = 0;
    for prepared in prepared(context) {
        let Prepared {
            case,
            surfaces,
            kernels,
            points,
        } = prepared?;
        let leaf_size = automatic_leaf_size(kernels.areas(), surfaces.area, SOURCE_SHARE);
        let trees = [kernels.by_volume(leaf_size), kernels.linear(leaf_size)];
        let maps = trees.iter().map(|tree| Map::new(&kernels, tree));
        let maps: Vec<Map> = maps.collect::<Result<_>>()?;
        let repeats = if context.smoke { 1 } else { REPEATS };
        let times = query_times(&maps, &points, repeats, Map::gather_complete);
        let work = [0, 1].map(|i| {
            let mut work = Work::default();
            points
                .iter()
                .for_each(|point| maps[i].gather_complete(*point, &mut work));
            work
        });
        let each = |count: u64| count as f64 / points.len().max(1) as f64;
        let more = |[first, second]: [u64; 2]| 100.0 * (second as f64 / first.max(1) as f64 - 1.0);
        let document = DOCUMENT.iter().find(|row| row.0 == case.counterpart).map(|row| row.1);
        let theirs = |i: usize| document.map_or(Cell::from("none"), |row| row[i].into());
        let (nodes, tests) = (work.map(|w| w.tree.nodes), work.map(|w| w.tests));
        let ours = [more(nodes), more(tests), 100.0 * (times[0] / times[1] - 1.0)];
        for (sum, value) in sums.iter_mut().zip(ours) {
            *sum += value;
        }
        rows += 1;
        table.row([
            case.name().into(),
            case.counterpart().into(),
            (kernels.spheres.len() as u64).into(),
            u64::from(leaf_size).into(),
            each(nodes[0]).into(),
            ours[0].into(),
            theirs(0),
            theirs(1),
            each(tests[0]).into(),
            ours[1].into(),
            theirs(2),
            theirs(3),
            (trees[1].volume_cost() / trees[0].volume_cost()).into(),
            (1e-3 * times[0]).into(),
            ours[2].into(),
            theirs(4),
        ]);
    }
    let [nodes, tests, speed] = sums.map(|sum| sum / f64::from(rows.max(1)));
    table.note(format!(
        "Means: nodes {nodes:+.1} %, kernels tested {tests:+.1} %, queries a second {speed:+.1} %; the source's over its nine rows are \
         +13.3 %, +9.4 % and −8.5 % of its frames a second."
    ));
    table.note(
        "Synthetic kernels: spheres about the second and third hits of 2¹⁷ photons (2⁹ in a quick look) in scenes of the source's sizes, as \
         many about a point as in its Table 5.1; the source's are flat ellipsoids from photon differentials in its own scenes, so counts differ \
         and signs and ranking are what can be reproduced. The linear \
         hierarchy is worse in everything on every scene, as there, by about half as much: kernels of one scene hardly differ in size here, \
         while the source's are up to twenty times as long as wide and leave more for a heuristic to choose. Counts are exact: nodes fetched, two a pair; times on one thread, complete nodes.",
    );
    Ok(vec![table])
}
