//! Construction of photon maps: nodes of the linear hierarchy and of the voxel volume heuristic, and build times against the number of kernels.
//!
//! Source of the comparison: "Interactive Manycore Photon Mapping", PhD thesis, Trinity College Dublin, 2011, Table 6.2.

use std::time::Instant;

use clerestory::accel::bvh2::Aabb;
use clerestory::accel::lbvh::clustered::{ClusterCounts, clustered_hierarchy};
use clerestory::accel::lbvh::leaf_threshold::automatic_leaf_size;
use clerestory::accel::lbvh::merge::merged_hierarchy;
use clerestory::accel::lbvh::radix::SortedCodes;
use clerestory::accel::lbvh::split_lists::split_list_hierarchy;
use clerestory::accel::lbvh::tree::BoxTree;
use clerestory::accel::lbvh::{BuildQuality, LbvhBuilder, LbvhSettings};
use clerestory::accel::morton::MORTON_30_AXIS_BITS;
use clerestory::{Error, Result};
use glam::Vec3;

use super::Context;
use super::map_quality::SOURCE_SHARE;
use super::photon_kernels::{CASES, Case, Kernels, Surfaces};
use crate::experiments::table::Table;
use crate::machine::median;

/// Photons as powers of two.
const SIZES: [u32; 4] = [13, 15, 17, 19];
/// Of scenes other than the first.
const SIZE: u32 = 17;
const SMOKE_SIZE: u32 = 9;
const REPEATS: usize = 3;
/// Bits of a pass of the clustered form.
const PASS_BITS: u32 = 5;

/// Kernels, nodes by the volume heuristic, change of nodes in per cent, microseconds, at 2¹⁷ photons.
const DOCUMENT: [(&str, [f64; 4]); 3] = [
    ("Scene 6", [160_298.0, 23_313.0, -5.8, 10_680.0]),
    ("Passage", [70_256.0, 5_477.0, -7.7, 6_060.0]),
    ("Ring", [74_101.0, 31_081.0, -1.1, 6_280.0]),
];

/// Inner nodes and leaves of a tree that was found valid.
fn nodes(tree: &BoxTree, boxes: &[Aabb]) -> Result<u64> {
    let shape = tree
        .shape(boxes)
        .map_err(|fault| Error::setting("tree", "photon map", format!("is not valid: {fault:?}")))?;
    Ok(u64::from(shape.nodes + shape.leaves))
}

/// What a build gives, and the median of its seconds.
fn timed<T>(smoke: bool, mut build: impl FnMut() -> T) -> (T, f64) {
    let mut seconds = Vec::new();
    let mut run = || {
        let start = Instant::now();
        let built = build();
        seconds.push(start.elapsed().as_secs_f64());
        built
    };
    let mut built = run();
    for _ in 0..if smoke { 0 } else { REPEATS } {
        built = run();
    }
    // The first run warms up.
    let later = if seconds.len() > 1 {
        seconds.split_off(1)
    } else {
        seconds
    };
    (built, median(later))
}

/// A triangle whose box is the given one: the device builds over triangles.
fn triangle_in(bounds: &Aabb) -> [Vec3; 3] {
    let corner = Vec3::new(bounds.upper.x, bounds.lower.y, bounds.lower.z);
    [bounds.lower, corner, bounds.upper]
}

/// Milliseconds of the device's passes, least of some builds.
fn on_device(builder: &LbvhBuilder, boxes: &[Aabb], smoke: bool) -> Result<f64> {
    let triangles: Vec<[Vec3; 3]> = boxes.iter().map(triangle_in).collect();
    let mut least = f64::INFINITY;
    for _ in 0..=if smoke { 0 } else { REPEATS } {
        least = least.min(1e3 * builder.build(&triangles)?.timings.seconds());
    }
    Ok(least)
}

/// The measure.
pub fn measure(context: &Context<'_>) -> Result<Vec<Table>> {
    let gpu = (context.gpu)()?;
    let settings = LbvhSettings {
        quality: BuildQuality::Fast,
        ..LbvhSettings::default()
    };
    let builder = LbvhBuilder::new(&gpu, &settings)?;
    let mut wanted: Vec<(&Case, u32)> = if context.smoke {
        vec![(&CASES[0], SMOKE_SIZE)]
    } else {
        SIZES.iter().map(|size| (&CASES[0], *size)).collect()
    };
    if !context.smoke {
        wanted.extend(CASES[1..].iter().map(|case| (case, SIZE)));
    }
    let mut table = Table::new(
        "Construction of photon maps",
        &[
            "scene",
            "counterpart",
            "photons",
            "kernels",
            "source: kernels",
            "leaf size",
            "nodes, volume heuristic",
            "nodes, linear (%)",
            "source: nodes, volume heuristic",
            "source: linear (%)",
            "volume heuristic, host (ms)",
            "codes and sort, host (ms)",
            "merge, host (ms)",
            "split lists, host (ms)",
            "clusters, host (ms)",
            "linear, device (ms)",
            "source: linear (ms)",
        ],
    );
    let mut points = Vec::new();
    for (done, (case, size)) in wanted.iter().enumerate() {
        if context.watch.stopped() {
            break;
        }
        context.watch.begin(case.name(), done, wanted.len());
        let surfaces = Surfaces::load(case.scene)?;
        let kernels = Kernels::trace(&surfaces, case.light, 1 << size, case.cover);
        let boxes = &kernels.boxes;
        let leaf_size = automatic_leaf_size(kernels.areas(), surfaces.area, SOURCE_SHARE);
        let start = Instant::now();
        let by_volume = kernels.by_volume(leaf_size);
        let volume_seconds = start.elapsed().as_secs_f64();
        let (sorted, sort_seconds) = timed(context.smoke, || SortedCodes::of_boxes(boxes, MORTON_30_AXIS_BITS));
        let (merged, merge_seconds) = timed(context.smoke, || merged_hierarchy(boxes, &sorted, leaf_size, |_| {}));
        let ((lists, _), lists_seconds) = timed(context.smoke, || split_list_hierarchy(boxes, &sorted, leaf_size));
        let (clustered, clustered_seconds) = timed(context.smoke, || {
            clustered_hierarchy(boxes, &sorted, leaf_size, PASS_BITS, &mut ClusterCounts::default())
        });
        let device = on_device(&builder, boxes, context.smoke)?;
        let [of_volume, of_merge, of_lists, of_clusters] = [
            nodes(&by_volume, boxes)?,
            nodes(&merged, boxes)?,
            nodes(&lists, boxes)?,
            nodes(&clustered, boxes)?,
        ];
        if (of_merge, of_merge) != (of_lists, of_clusters) {
            return Err(Error::setting(
                "tree",
                case.name(),
                "differs between forms of the linear hierarchy",
            ));
        }
        if case.scene == CASES[0].scene {
            points.push((boxes.len() as f64, [1e3 * (sort_seconds + merge_seconds), device]));
        }
        let document = DOCUMENT
            .iter()
            .find(|row| row.0 == case.counterpart && *size == SIZE)
            .map(|row| row.1);
        table.row([
            case.name().into(),
            case.counterpart().into(),
            (1_u64 << size).into(),
            (boxes.len() as u64).into(),
            document.map_or("none".into(), |row| (row[0] as u64).into()),
            u64::from(leaf_size).into(),
            of_volume.into(),
            (100.0 * (of_merge as f64 / of_volume as f64 - 1.0)).into(),
            document.map_or("none".into(), |row| (row[1] as u64).into()),
            document.map_or("none".into(), |row| row[2].into()),
            (1e3 * volume_seconds).into(),
            (1e3 * sort_seconds).into(),
            (1e3 * merge_seconds).into(),
            (1e3 * lists_seconds).into(),
            (1e3 * clustered_seconds).into(),
            device.into(),
            document.map_or("none".into(), |row| (1e-3 * row[3]).into()),
        ]);
    }
    if let (Some(first), Some(last)) = (points.first(), points.last())
        && last.0 > first.0
    {
        let exponent = |i: usize| (last.1[i] / first.1[i]).ln() / (last.0 / first.0).ln();
        table.note(format!(
            "From the fewest kernels of the first scene to the most, build times grow as the number of kernels to the power {:.2} on the host \
             (codes, sort and merge) and {:.2} on the device; 1 is linear, less where fixed costs weigh, more where data outgrow a cache.",
            exponent(0),
            exponent(1)
        ));
    }
    table.note(
        "Synthetic kernels: spheres about the second and third hits of photons; radii shrink with their number so that a surface point lies \
         in as many as the source's Table 5.1 says of the counterpart, hence leaf sizes stay. Nodes are inner ones and leaves, of trees that \
         were checked; merging, split lists and clusters give the same number. The source's kernels are its own, up to twenty times as long \
         as wide, in its own scenes, so what can be reproduced is that both trees are about the same size; the sign of a change of so few \
         per cent depends on the kernels, there from −7.7 % to +5.2 %.",
    );
    table.note(
        "On the host one thread but for the sort; on the device the least of the passes' times over triangles in the kernels' boxes, by \
         the renderer's form of the linear hierarchy with leaves by surface area. The source's times are of its GPU of 2008.",
    );
    Ok(vec![table])
}
