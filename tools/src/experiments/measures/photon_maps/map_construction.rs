//! Construction of photon maps: nodes of the linear hierarchy and of the voxel volume heuristic, and build times against the number of kernels,
//! stage by stage; and with kernels that lie in memory in the order of the tree, which tells what the memory costs.
//!
//! Source of the comparison: "Interactive Manycore Photon Mapping", PhD thesis, Trinity College Dublin, 2011, Table 6.2.

use std::convert::Infallible;

use clerestory::accel::Aabb;
use clerestory::accel::box_tree::BoxTree;
use clerestory::accel::lbvh::SortedCodes;
use clerestory::accel::lbvh::{BuildQuality, LbvhBuilder, LbvhSettings};
use clerestory::accel::morton::MORTON_30_AXIS_BITS;
use clerestory::accel::photon_map::clustered::{ClusterCounts, clustered_hierarchy};
use clerestory::accel::photon_map::leaf_threshold::automatic_leaf_size;
use clerestory::accel::photon_map::merge::merged_hierarchy;
use clerestory::accel::photon_map::split_lists::split_list_hierarchy;
use clerestory::gpu::Timings;
use clerestory::{Error, Result};
use glam::Vec3;
use rayon::prelude::*;

use super::map_quality::SOURCE_SHARE;
use super::photon_kernels::{Kernels, SOURCE_SHAPE};
use super::photon_scenes::{CASES, Case, Surfaces};
use crate::experiments::measures::Context;
use crate::experiments::table::{Cell, Table};
use crate::timing::{median, repeated, timed};

/// Photons as powers of two.
const SIZES: [u32; 4] = [13, 15, 17, 19];
/// Of scenes other than the first.
const SIZE: u32 = 17;
const SMOKE_SIZE: u32 = 9;
const REPEATS: usize = 3;
/// Per cent that node counts of the source differ by at most.
const MOST_NODES: f64 = 8.0;
/// Bits of a pass of the clustered form.
const PASS_BITS: u32 = 5;

/// A row of the source's table, at 2¹⁷ photons.
struct Published {
    counterpart: &'static str,
    kernels: u64,
    /// Nodes by the volume heuristic.
    nodes: u64,
    /// What the linear hierarchy adds to them, per cent.
    linear_nodes: f64,
    /// That the linear hierarchy takes.
    linear_microseconds: u32,
}

const PUBLISHED: [Published; 3] = [
    Published {
        counterpart: "Scene 6",
        kernels: 160_298,
        nodes: 23_313,
        linear_nodes: -5.8,
        linear_microseconds: 10_680,
    },
    Published {
        counterpart: "Passage",
        kernels: 70_256,
        nodes: 5_477,
        linear_nodes: -7.7,
        linear_microseconds: 6060,
    },
    Published {
        counterpart: "Ring",
        kernels: 74_101,
        nodes: 31_081,
        linear_nodes: -1.1,
        linear_microseconds: 6280,
    },
];

/// Inner nodes and leaves of a tree that was found valid.
fn nodes(tree: &BoxTree, boxes: &[Aabb]) -> Result<u64> {
    let shape = tree
        .shape(boxes)
        .map_err(|fault| Error::setting("tree", "photon map", format!("is not valid: {fault:?}")))?;
    Ok(u64::from(shape.nodes + shape.leaves))
}

/// What a build gives, and the median of its seconds.
fn built_in<T>(smoke: bool, mut build: impl FnMut() -> T) -> (T, f64) {
    let repeats = if smoke { 0 } else { REPEATS };
    let Ok((built, seconds)) = repeated(repeats, || Ok::<_, Infallible>(timed(&mut build)));
    (built, median(seconds))
}

/// Why the linear hierarchy's nodes differ from the source's, both in per cent of the volume heuristic's.
fn deviation(ours: f64, theirs: f64) -> String {
    let word = if ours.signum() == theirs.signum() {
        "sign as there"
    } else {
        "sign turned: it depends on how kernels lie"
    };
    let within = if ours.abs() <= MOST_NODES {
        "within 8 %"
    } else {
        "beyond 8 %"
    };
    format!("{word}, {within}")
}

/// A triangle whose box is the given one: the device builds over triangles.
fn triangle_in(bounds: &Aabb) -> [Vec3; 3] {
    let corner = Vec3::new(bounds.upper.x, bounds.lower.y, bounds.lower.z);
    [bounds.lower, corner, bounds.upper]
}

/// The device's passes of the fastest of some builds: names and seconds.
fn on_device(builder: &LbvhBuilder, boxes: &[Aabb], smoke: bool) -> Result<Vec<(String, f64)>> {
    let triangles: Vec<[Vec3; 3]> = boxes.iter().map(triangle_in).collect();
    let mut best: Option<Timings> = None;
    for _ in 0..=if smoke { 0 } else { REPEATS } {
        let timings = builder.build(&triangles)?.timings;
        if best.as_ref().is_none_or(|best| timings.seconds() < best.seconds()) {
            best = Some(timings);
        }
    }
    let passes = best.unwrap_or_default().passes.into_iter();
    Ok(passes
        .map(|pass| (pass.name, 1e-9 * pass.nanoseconds.unwrap_or(0) as f64))
        .collect())
}

/// Seconds of all of them.
fn whole(passes: &[(String, f64)]) -> f64 {
    passes.iter().map(|pass| pass.1).sum()
}

/// Pages that this process has touched for the first time so far, where the system tells; else 0.
fn first_touches() -> u64 {
    let text = std::fs::read_to_string("/proc/self/stat").unwrap_or_default();
    // The name in parentheses may hold blanks; minor faults are the eighth field behind it.
    let mut fields = text.rsplit_once(')').map_or("", |(_, rest)| rest).split_whitespace();
    fields.nth(7).and_then(|field| field.parse().ok()).unwrap_or(0)
}

/// Seconds that the first touch of a page takes; 0 where the system does not count them.
fn price_of_a_page(smoke: bool) -> f64 {
    let words = if smoke { 1 << 16 } else { 1 << 23 };
    let before = first_touches();
    let (memory, touched) = timed(|| (0..words).collect::<Vec<u64>>());
    let pages = first_touches().saturating_sub(before);
    let mut memory = std::hint::black_box(memory);
    let ((), again) = timed(|| {
        memory.iter_mut().zip(0..).for_each(|(word, i)| *word = i);
        std::hint::black_box(&memory);
    });
    if pages == 0 {
        0.0
    } else {
        (touched - again).max(0.0) / pages as f64
    }
}

/// Seconds of every stage of the linear hierarchy's build over some number of kernels.
struct Stages {
    kernels: usize,
    seconds: Vec<(String, f64)>,
}

impl Stages {
    /// Takes the times that are not known yet.
    fn of(
        boxes: &[Aabb],
        sorted: &SortedCodes,
        leaf_size: u32,
        builder: &LbvhBuilder,
        page_price: f64,
        smoke: bool,
    ) -> Result<Self> {
        let (_, codes_and_sort) = built_in(smoke, || SortedCodes::of_boxes(boxes, MORTON_30_AXIS_BITS));
        let mut unsorted = vec![0; boxes.len()];
        for (code, i) in sorted.codes.iter().zip(&sorted.order) {
            unsorted[*i as usize] = code << 32 | u64::from(*i);
        }
        let mut seconds_of_sort = f64::INFINITY;
        for _ in 0..=if smoke { 0 } else { REPEATS } {
            let mut pairs = unsorted.clone();
            let ((), seconds) = timed(|| pairs.par_sort_unstable());
            seconds_of_sort = seconds_of_sort.min(seconds);
        }
        let merge = |boxes: &[Aabb], sorted: &SortedCodes| {
            built_in(smoke, || merged_hierarchy(boxes, sorted, leaf_size, |_| {})).1
        };
        let fresh = |build: &mut dyn FnMut() -> Result<()>| -> Result<f64> {
            let before = first_touches();
            build()?;
            Ok(page_price * first_touches().saturating_sub(before) as f64)
        };
        let in_order: Vec<Aabb> = sorted.order.iter().map(|i| boxes[*i as usize]).collect();
        let renumbered = SortedCodes {
            codes: sorted.codes.clone(),
            order: (0..boxes.len() as u32).collect(),
            bits: sorted.bits,
        };
        let fresh_of_merge = fresh(&mut || {
            merged_hierarchy(boxes, sorted, leaf_size, |_| {});
            Ok(())
        })?;
        let passes = on_device(builder, boxes, smoke)?;
        let triangles: Vec<[Vec3; 3]> = boxes.iter().map(triangle_in).collect();
        let fresh_of_device = fresh(&mut || builder.build(&triangles).map(drop))?;
        let passes_in_order = on_device(builder, &in_order, smoke)?;
        let (device, device_in_order) = (whole(&passes), whole(&passes_in_order));
        let host = |name: &str| format!("host: {name}");
        let mut seconds = vec![
            (host("codes and sort"), codes_and_sort),
            (host("of these the sort, by comparisons"), seconds_of_sort),
            (host("merge"), merge(boxes, sorted)),
            (
                host("merge, kernels in the tree's order"),
                merge(&in_order, &renumbered),
            ),
            (host("of the merge fresh memory"), fresh_of_merge),
        ];
        seconds.extend(passes.into_iter().map(|(name, time)| (format!("device: {name}"), time)));
        seconds.push(("device: all".into(), device));
        seconds.push(("device: all, kernels in the tree's order".into(), device_in_order));
        seconds.push((
            "device: fresh memory of a build, its copies included".into(),
            fresh_of_device,
        ));
        Ok(Self {
            kernels: boxes.len(),
            seconds,
        })
    }

    fn second(&self, stage: &str) -> f64 {
        let found = self.seconds.iter().find(|(name, _)| name == stage);
        found.map_or(f64::NAN, |(_, seconds)| *seconds)
    }
}

/// Growth of seconds with the number of kernels: the exponent from the fewest to the most.
fn exponent(first: &Stages, last: &Stages, stage: &str) -> f64 {
    (last.second(stage) / first.second(stage)).ln() / (last.kernels as f64 / first.kernels as f64).ln()
}

/// Nanoseconds a kernel of every stage and size.
fn by_stage(all: &[Stages], page_price: f64) -> Table {
    let sizes: Vec<String> = all
        .iter()
        .map(|one| format!("ns a kernel, {} kernels", one.kernels))
        .collect();
    let mut heads = vec!["stage"];
    heads.extend(sizes.iter().map(String::as_str));
    heads.push("exponent");
    let mut table = Table::new("Construction by stage", &heads);
    let (Some(first), Some(last)) = (all.first(), all.last()) else {
        return table;
    };
    for (stage, _) in &first.seconds {
        let mut cells: Vec<Cell> = vec![stage.clone().into()];
        cells.extend(
            all.iter()
                .map(|one| (1e9 * one.second(stage) / one.kernels as f64).into()),
        );
        let grows = exponent(first, last, stage);
        cells.push(if grows.is_finite() { grows.into() } else { "none".into() });
        table.row(cells);
    }
    table.note(format!(
        "The exponent is that of the number of kernels, from the fewest to the most: 1 is linear, less where fixed costs weigh. The same \
         kernels in the order of the tree ask for the same work from memory that lies side by side: what they save is what scattered \
         reads cost. Fresh memory is the number of pages that a build touches for the first time, as the system counts them, times what such a \
         page costs here, {:.0} ns: small builds get the memory of the one before, large ones get new pages from the system. Sorting by \
         comparisons alone grows as n log n, an exponent of about 1.09 over this range.",
        1e9 * page_price
    ));
    table
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
            "deviation of nodes",
        ],
    );
    let mut stages: Vec<Stages> = Vec::new();
    let page_price = price_of_a_page(context.smoke);
    for (done, (case, size)) in wanted.iter().enumerate() {
        if context.watch.stopped() {
            break;
        }
        context.watch.begin(case.name(), done, wanted.len());
        let surfaces = Surfaces::load(case.scene)?;
        let kernels = Kernels::trace(&surfaces, case.light, 1 << size, case.cover, SOURCE_SHAPE);
        let boxes = &kernels.boxes;
        let leaf_size = automatic_leaf_size(kernels.areas(), surfaces.area, SOURCE_SHARE);
        let (by_volume, volume_seconds) = timed(|| kernels.by_volume(leaf_size));
        let (sorted, sort_seconds) = built_in(context.smoke, || SortedCodes::of_boxes(boxes, MORTON_30_AXIS_BITS));
        let (merged, merge_seconds) = built_in(context.smoke, || merged_hierarchy(boxes, &sorted, leaf_size, |_| {}));
        let ((lists, _), lists_seconds) = built_in(context.smoke, || split_list_hierarchy(boxes, &sorted, leaf_size));
        let (clustered, clustered_seconds) = built_in(context.smoke, || {
            clustered_hierarchy(boxes, &sorted, leaf_size, PASS_BITS, &mut ClusterCounts::default())
        });
        let device = whole(&on_device(&builder, boxes, context.smoke)?);
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
            stages.push(Stages::of(
                boxes,
                &sorted,
                leaf_size,
                &builder,
                page_price,
                context.smoke,
            )?);
        }
        let published = PUBLISHED
            .iter()
            .find(|row| row.counterpart == case.counterpart && *size == SIZE);
        let change = 100.0 * (of_merge as f64 / of_volume as f64 - 1.0);
        table.row([
            case.name().into(),
            case.counterpart().into(),
            (1_u64 << size).into(),
            (boxes.len() as u64).into(),
            published.map(|row| row.kernels).into(),
            u64::from(leaf_size).into(),
            of_volume.into(),
            change.into(),
            published.map(|row| row.nodes).into(),
            published.map(|row| row.linear_nodes).into(),
            (1e3 * volume_seconds).into(),
            (1e3 * sort_seconds).into(),
            (1e3 * merge_seconds).into(),
            (1e3 * lists_seconds).into(),
            (1e3 * clustered_seconds).into(),
            (1e3 * device).into(),
            published.map(|row| 1e-3 * f64::from(row.linear_microseconds)).into(),
            published.map_or("no counterpart".into(), |row| {
                deviation(change, row.linear_nodes).into()
            }),
        ]);
    }
    table.note(
        "Synthetic kernels: ellipsoids about the second and third hits of photons; radii shrink with their number so that a surface point lies \
         in as many as the source's Table 5.1 says of the counterpart, hence leaf sizes stay. Nodes are inner ones and leaves, of trees that \
         were checked; merging, split lists and clusters give the same number. The source's kernels are its own, up to twenty times as long \
         as wide, in its own scenes, so what can be reproduced is that both trees are about the same size; the sign of a change of so few \
         per cent depends on the kernels, there from −7.7 % to +5.2 %.",
    );
    table.note(
        "On the host one thread but for the sort; on the device the least of the passes' times over triangles in the kernels' boxes, by \
         the renderer's form of the linear hierarchy with leaves by surface area. The source's times are of its GPU of 2008.",
    );
    Ok(vec![table, by_stage(&stages, page_price)])
}
