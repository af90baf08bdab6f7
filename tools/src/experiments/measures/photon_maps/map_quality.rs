//! Photon maps of the linear hierarchy beside those of the voxel volume heuristic: nodes fetched, kernels tested and time of a query.
//!
//! Source of the comparison: "Interactive Manycore Photon Mapping", PhD thesis, Trinity College Dublin, 2011, Table 6.3.

use clerestory::Result;
use clerestory::accel::photon_map::leaf_threshold::automatic_leaf_size;
use glam::Vec3;

use super::leaf_sizes::query_times;
use super::photon_kernels::{Map, Prepared, Shape, Work, prepared};
use crate::experiments::measures::Context;
use crate::experiments::table::{Cell, Table};

/// The share of a point's kernels in a leaf that the source's leaf sizes need.
pub const SOURCE_SHARE: f64 = 1.0 / 16.0;
const REPEATS: usize = 5;

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

/// The measure.
pub fn measure(context: &Context<'_>) -> Result<Vec<Table>> {
    let mut table = Table::new(
        "Queries of the linear hierarchy beside those of the volume heuristic",
        &[
            "scene",
            "counterpart",
            "kernels' shape",
            "kernels",
            "leaf size",
            "nodes, volume heuristic",
            "nodes, linear (%)",
            "source: nodes",
            "source: nodes, linear (%)",
            "kernels tested, volume heuristic",
            "kernels tested, linear (%)",
            "source: kernels tested",
            "source: kernels tested, linear (%)",
            "volume cost, linear / heuristic",
            "anywhere: nodes, linear (%)",
            "anywhere: kernels tested, linear (%)",
            "µs a query, volume heuristic",
            "speed, linear (%)",
            "source: speed (%)",
            "deviation",
        ],
    );
    let mut sums = [[0.0; 5]; 2];
    let mut stretches = Vec::new();
    let mut rows = [0_u32; 2];
    for prepared in prepared(context, &Shape::ALL) {
        let Prepared {
            case,
            surfaces,
            kernels,
            shape,
            points,
            anywhere,
        } = prepared?;
        if shape == Shape::Ellipsoids {
            stretches.push(kernels.mean_stretch());
        }
        let leaf_size = automatic_leaf_size(kernels.areas(), surfaces.area, SOURCE_SHARE);
        let trees = [kernels.by_volume(leaf_size), kernels.linear(leaf_size)];
        let maps = trees.iter().map(|tree| Map::new(&kernels, tree));
        let maps: Vec<Map> = maps.collect::<Result<_>>()?;
        let repeats = if context.smoke { 1 } else { REPEATS };
        let times = query_times(&maps, &points, repeats, Map::gather_complete);
        let all_work = |points: &[Vec3]| {
            [0, 1].map(|i| {
                let mut work = Work::default();
                points
                    .iter()
                    .for_each(|point| maps[i].gather_complete(*point, &mut work));
                work
            })
        };
        let (work, work_anywhere) = (all_work(&points), all_work(&anywhere));
        let each = |count: u64| count as f64 / points.len().max(1) as f64;
        let more = |[first, second]: [u64; 2]| 100.0 * (second as f64 / first.max(1) as f64 - 1.0);
        let published = PUBLISHED.iter().find(|row| row.counterpart == case.counterpart);
        let theirs = |of: fn(&Published) -> f64| Cell::from(published.map(of));
        let (nodes, tests) = (work.map(|w| w.tree.nodes), work.map(|w| w.tests));
        let ours = [
            more(nodes),
            more(tests),
            100.0 * (times[0] / times[1] - 1.0),
            more(work_anywhere.map(|w| w.tree.nodes)),
            more(work_anywhere.map(|w| w.tests)),
        ];
        let of_shape = usize::from(shape == Shape::Ellipsoids);
        for (sum, value) in sums[of_shape].iter_mut().zip(ours) {
            *sum += value;
        }
        rows[of_shape] += 1;
        table.row([
            case.name().into(),
            case.counterpart().into(),
            shape.word().into(),
            (kernels.len() as u64).into(),
            u64::from(leaf_size).into(),
            each(nodes[0]).into(),
            ours[0].into(),
            theirs(|row| row.nodes),
            theirs(|row| row.linear_nodes),
            each(tests[0]).into(),
            ours[1].into(),
            theirs(|row| row.kernels),
            theirs(|row| row.linear_kernels),
            (trees[1].volume_cost() / trees[0].volume_cost()).into(),
            ours[3].into(),
            ours[4].into(),
            (1e-3 * times[0]).into(),
            ours[2].into(),
            theirs(|row| row.linear_speed),
            published.map_or("no counterpart".into(), |row| deviation(shape, &ours, row).into()),
        ]);
    }
    for (of_shape, shape) in Shape::ALL.iter().enumerate() {
        let [nodes, tests, speed, nodes_anywhere, tests_anywhere] =
            sums[of_shape].map(|sum| sum / f64::from(rows[of_shape].max(1)));
        table.note(format!(
            "Means of {}: nodes {nodes:+.1} %, kernels tested {tests:+.1} %, queries a second {speed:+.1} % where the camera looks; nodes \
             {nodes_anywhere:+.1} %, kernels tested {tests_anywhere:+.1} % anywhere on the surfaces; the source's over its nine rows are +13.3 %, +9.4 % and \
             −8.5 % of its frames a second.",
            shape.word()
        ));
    }
    let stretch = stretches.iter().sum::<f64>() / stretches.len().max(1) as f64;
    table.note(format!(
        "Synthetic kernels about the second and third hits of 2¹⁷ photons (2⁹ in a quick look) in scenes of the source's sizes, as many about a \
         point as in its Table 5.1: spheres, and ellipsoids of the same area that are stretched as the footprint of a beam is by its incidence, \
         {stretch:.2} times as long as wide on average and at most 20 times, the source's bound. The source's come from photon differentials \
         in its own scenes. Counts are exact: nodes fetched, two a pair; times on one thread, complete nodes. Anywhere: as many points evenly on \
         all surfaces. The shape alone moves the linear hierarchy's loss from below the source's means to above them."
    ));
    Ok(vec![table])
}

/// Whether nodes, kernels and speed change as in the source, and by how much less or more.
fn deviation(shape: Shape, ours: &[f64; 5], theirs: &Published) -> String {
    let pairs = [
        (ours[0], theirs.linear_nodes),
        (ours[1], theirs.linear_kernels),
        (ours[2], theirs.linear_speed),
    ];
    let turned = pairs.iter().filter(|(ours, theirs)| ours.signum() != theirs.signum());
    let signs = match turned.count() {
        0 => "signs as there".to_owned(),
        count => format!("{count} signs turned"),
    };
    let ratio = |(ours, theirs): (f64, f64)| format!("{:.1}", ours / theirs);
    let reason = match shape {
        Shape::Spheres => "rounder kernels",
        Shape::Ellipsoids => "boxes of kernels askew",
    };
    format!(
        "{signs}; nodes {} and kernels {} times theirs: {reason}",
        ratio(pairs[0]),
        ratio(pairs[1])
    )
}
