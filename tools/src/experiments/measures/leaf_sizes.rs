//! Leaf sizes of photon maps: what a query reads, tests and takes, from 1 kernel a leaf to 128, beside the size chosen from the kernels.
//!
//! Source of the sweep: "Interactive Manycore Photon Mapping", PhD thesis, Trinity College Dublin, 2011, Table 6.1.

use std::hint::black_box;
use std::time::Instant;

use clerestory::Result;
use clerestory::accel::lbvh::leaf_threshold::{LEAF_SHARE, automatic_leaf_size};
use glam::Vec3;

use super::Context;
use super::photon_kernels::{Kernels, Map, Prepared, Work, prepared};
use crate::experiments::table::Table;
use crate::machine::median;

const SIZES: [u32; 8] = [1, 2, 4, 8, 16, 32, 64, 128];
/// The share that the source's own leaf sizes need.
const SMALL_SHARE: f64 = 1.0 / 16.0;
const REPEATS: usize = 5;

/// Hundredths of frames a second in the source for sizes 1 to 128, then for its automatic size: counterpart, tree, values.
const DOCUMENT: [(&str, &str, [u32; 9]); 4] = [
    (
        "Scene 6",
        "volume heuristic",
        [260, 327, 349, 371, 374, 368, 355, 328, 374],
    ),
    ("Scene 6", "linear", [256, 291, 323, 350, 356, 355, 335, 314, 359]),
    (
        "Passage",
        "volume heuristic",
        [478, 517, 539, 558, 569, 572, 554, 528, 567],
    ),
    ("Passage", "linear", [446, 473, 495, 519, 528, 521, 501, 452, 522]),
];

/// Nanoseconds a query of every map, medians of runs that take turns.
pub fn query_times(maps: &[Map], points: &[Vec3], repeats: usize, gather: fn(&Map, Vec3, &mut Work)) -> Vec<f64> {
    let mut times = vec![Vec::new(); maps.len()];
    for repeat in 0..=repeats {
        for (map, times) in maps.iter().zip(&mut times) {
            let mut work = Work::default();
            let start = Instant::now();
            for point in points {
                gather(map, black_box(*point), &mut work);
            }
            let nanoseconds = start.elapsed().as_secs_f64() * 1e9 / points.len().max(1) as f64;
            black_box(work);
            // The first run warms up.
            if repeat > 0 {
                times.push(nanoseconds);
            }
        }
    }
    times.into_iter().map(median).collect()
}

/// The measure.
pub fn measure(context: &Context<'_>) -> Result<Vec<Table>> {
    let sizes = if context.smoke { &SIZES[..3] } else { &SIZES[..] };
    let mut sweep = Table::new(
        "Queries of photon maps by leaf size",
        &[
            "scene",
            "tree",
            "leaf size",
            "chosen by",
            "nodes a query",
            "kernels tested a query",
            "kernels that count",
            "nodes + kernels: best of the sweep / this",
            "µs a query",
            "speed / best of the sweep",
            "source: frames/s / best of its sweep",
        ],
    );
    let (mut worst, mut sum, mut sets) = ([f64::INFINITY; 2], [0.0; 2], 0_u32);
    for prepared in prepared(context) {
        let Prepared {
            case,
            surfaces,
            kernels,
            points,
        } = prepared?;
        let automatic = |share| automatic_leaf_size(kernels.areas(), surfaces.area, share);
        let mut wanted: Vec<(u32, &str)> = sizes.iter().map(|size| (*size, "sweep")).collect();
        wanted.extend([
            (automatic(LEAF_SHARE), "share 1/8"),
            (automatic(SMALL_SHARE), "share 1/16"),
        ]);
        for (tree, build) in [
            ("volume heuristic", Kernels::by_volume as fn(&Kernels, u32) -> _),
            ("linear", Kernels::linear),
        ] {
            let maps = wanted
                .iter()
                .map(|(size, _)| Map::new(&kernels, &build(&kernels, *size)));
            let maps: Vec<Map> = maps.collect::<Result<_>>()?;
            let repeats = if context.smoke { 1 } else { REPEATS };
            let times = query_times(&maps, &points, repeats, Map::gather_compact);
            let best = times[..sizes.len()].iter().copied().fold(f64::INFINITY, f64::min);
            let document = DOCUMENT.iter().find(|row| row.0 == case.counterpart && row.1 == tree);
            let most = document.map_or(1.0, |row| {
                f64::from(row.2[..SIZES.len()].iter().copied().fold(0, u32::max))
            });
            let works = maps.iter().map(|map| {
                let mut work = Work::default();
                points.iter().for_each(|point| map.gather_compact(*point, &mut work));
                work
            });
            let works: Vec<Work> = works.collect();
            let steps = |work: &Work| work.tree.nodes + work.tests;
            let fewest = works[..sizes.len()].iter().map(steps).min().unwrap_or(0) as f64;
            sets += 1;
            for (chosen, work) in works[sizes.len()..].iter().enumerate() {
                let relative = fewest / steps(work) as f64;
                worst[chosen] = worst[chosen].min(relative);
                sum[chosen] += relative;
            }
            for (i, (work, time)) in works.iter().zip(&times).enumerate() {
                let each = |count: u64| count as f64 / points.len().max(1) as f64;
                let (size, by) = wanted[i];
                let column = match by {
                    "sweep" => Some(i),
                    "share 1/16" => Some(SIZES.len()),
                    _ => None,
                };
                let theirs = document
                    .zip(column)
                    .map(|(row, column)| f64::from(row.2[column]) / most);
                sweep.row([
                    case.name().into(),
                    tree.into(),
                    u64::from(size).into(),
                    by.into(),
                    each(work.tree.nodes).into(),
                    each(work.tests).into(),
                    each(work.contributions).into(),
                    (fewest / steps(work) as f64).into(),
                    (1e-3 * time).into(),
                    (best / time).into(),
                    theirs.map_or("none".into(), Into::into),
                ]);
            }
        }
    }
    let [eighth, sixteenth] = [0, 1].map(|i| (worst[i], sum[i] / f64::from(sets.max(1))));
    sweep.note(format!(
        "By exact counts, nodes and kernels at the same price, sizes of share 1/16 reach {:.3} of the sweep's best on average and {:.3} at \
         worst, of share 1/8 {:.3} and {:.3}; by frames a second the source's reach 0.997 and 0.982.",
        sixteenth.1, sixteenth.0, eighth.1, eighth.0
    ));
    sweep.note(
        "Synthetic kernels: spheres about the second and third hits of 2¹⁷ photons (2⁹ in a quick look), radii by the fourth root of the \
         photon's way, scaled so that a surface point lies in as many as the source's Table 5.1 says of the counterpart. Queries at the \
         points that the scene's camera sees, on compact pairs, one thread, medians of runs that take turns. Node and kernel counts are exact.",
    );
    sweep.note(
        "Beside them frames a second of the source's Table 6.1 over their best in the sweep, its automatic size in the row of share 1/16, \
         which its own sizes need. A frame holds rays and shading too, so the source's curves are flatter. By counts the best sizes \
         here are the source's; by time they are greater, since on a processor a node costs more than a kernel of these, whose test is a few \
         instructions in a row. Where the camera looks, the number of \
         kernels that count differs from the scene's mean. Times move with the load of the machine, counts do not.",
    );
    Ok(vec![sweep])
}
