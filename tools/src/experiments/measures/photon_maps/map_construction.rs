//! Construction of photon maps: nodes of the linear hierarchy and of the voxel volume heuristic, and build times against the number of kernels,
//! stage by stage; and with kernels that lie in memory in the order of the tree, which tells what the memory costs.
//!
//! Source of the comparison: B. Fabianowski, "Interactive Manycore Photon Mapping", PhD thesis, Trinity College Dublin, 2011, Table 6.2.

use clerestory::accel::Aabb;
use clerestory::accel::box_tree::BoxTree;
use clerestory::accel::lbvh::{BuildQuality, LbvhBuilder, LbvhSettings, SortedCodes};
use clerestory::accel::morton::MORTON_30_AXIS_BITS;
use clerestory::accel::photon_map::leaf_threshold::automatic_leaf_size;
use clerestory::accel::photon_map::merge::merged_hierarchy;
use clerestory::accel::yardstick::{ClusterCounts, clustered_hierarchy, sort_by_clusters, split_list_hierarchy};
use clerestory::{Error, Result};

use super::construction_stages::{
    Growth, ON_DEVICE, ON_HOST, Stage, TURNS, on_device, price_of_a_page, stages, triangles_in, whole,
};
use super::map_quality::SOURCE_SHARE;
use super::photon_kernels::{Kernels, Shape};
use super::photon_scenes::{CASES, Case, Surfaces};
use crate::experiments::findings::{Axes, Bound, Criterion, Findings, Repeats, Study, change, curves, rows};
use crate::experiments::measures::Context;
use crate::timing::timed;

/// Photons as powers of two.
const SIZES: &[u32] = &[13, 15, 17, 19];
const SMOKE_SIZES: &[u32] = &[8, 9];
/// Of scenes other than the first.
const SIZE: u32 = 17;
/// Bits of a pass of the clustered form.
const PASS_BITS: u32 = 5;
/// Bits by which the clustered form puts runs of the input together: half of a code's.
const UPPER_BITS: u32 = 15;
/// What builds, in turns: the volume heuristic, codes and sort, merging, split lists, clusters, the rays' form on the device, the sort by clusters.
const FORMS: usize = 7;

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

rows! {
    /// Kernels of a scene.
    struct Row = "Construction of photon maps" by [scene, photons] {
        scene: String = "scene",
        counterpart: String = "counterpart",
        photons: u64 = "photons",
        kernels: u64 = "kernels",
        leaf_size: u64 = "leaf size",
        nodes: u64 = "nodes, volume heuristic",
        linear_nodes: f64 = "nodes, linear (%)",
        different: u64 = "nodes by which split lists and clusters differ from merging",
        by_volume: Repeats = "volume heuristic, host (ms)",
        sort: Repeats = "codes and sort, host (ms)",
        merge: Repeats = "merge, host (ms)",
        linear: Repeats = "linear by merging, host (ms)",
        lists: Repeats = "split lists, host (ms)",
        clusters: Repeats = "clusters, host (ms)",
        cluster_sort: Repeats = "sort by clusters, host (ms)",
        merge_over_clusters: Repeats = "merge over clusters, sorted codes",
        device: Repeats = "linear for rays, device (ms)",
    }
    beside "source: kernels" = |row| row.published().map(|source| source.kernels).into();
    beside "source: nodes, volume heuristic" = |row| row.published().map(|source| source.nodes).into();
    beside "source: nodes, linear (%)" = |row| row.published().map(|source| source.linear_nodes).into();
    beside "source: linear (ms)" = |row| row.published().map(|source| 1e-3 * f64::from(source.linear_microseconds)).into();
}

/// Times of a row.
type Times = fn(&Row) -> &Repeats;

/// What was found.
#[derive(Debug, Default, serde::Serialize, serde::Deserialize)]
pub struct Found {
    maps: Vec<Row>,
    /// Of the first scene.
    stages: Vec<Stage>,
    /// What the first touch of a page takes, ns.
    page_price: f64,
}

const CRITERIA: &[Criterion<Row>] = &[
    Criterion::each(
        "the linear hierarchy has the same number of nodes in its three forms: nodes that differ",
        Bound::AtMost(0.0),
        |row: &Row| row.different.into(),
    )
    .in_every_form(),
    Criterion::each(
        "node counts within 8 %: nodes of the linear hierarchy (%)",
        Bound::Between(-8.0, 8.0),
        |row: &Row| row.linear_nodes.into(),
    ),
    Criterion::each(
        "merging takes no longer than clusters do over the same sorted codes: time over theirs",
        Bound::AtMost(1.0),
        |row: &Row| (&row.merge_over_clusters).into(),
    )
    .because("the source describes clusters and does not measure them"),
];

/// Below what n log n has.
const LINEAR: Bound = Bound::AtMost(1.05);
const N_LOG_N: &str = "sorting by comparisons alone, n log n, has 1.09 over this range";
const OF_GROWTH: &[Criterion<Growth>] = &[
    Criterion::each(
        "build time on the host is linear in the number of kernels: exponent",
        LINEAR,
        |growth: &Growth| (&growth.exponent).into(),
    )
    .among(|growth| growth.stage == ON_HOST)
    .because(N_LOG_N),
    Criterion::each(
        "build time of the rays' hierarchy on the device is linear in the number of kernels: exponent",
        LINEAR,
        |growth: &Growth| (&growth.exponent).into(),
    )
    .among(|growth| growth.stage == ON_DEVICE)
    .because(N_LOG_N),
];

/// Codes that were sorted, in the order of what they belong to.
fn codes_before(sorted: &SortedCodes) -> Vec<u64> {
    let mut codes = vec![0; sorted.order.len()];
    for (code, i) in sorted.codes.iter().zip(&sorted.order) {
        codes[*i as usize] = *code;
    }
    codes
}

/// Kernels of so many photons in a scene, and the leaf size for them.
fn kernels(case: &Case, size: u32) -> Result<(Kernels, u32)> {
    let surfaces = Surfaces::load(case.scene)?;
    let kernels = Kernels::trace(&surfaces, case.light, 1 << size, case.cover, Shape::Ellipsoids);
    let leaf_size = automatic_leaf_size(kernels.areas(), surfaces.area, SOURCE_SHARE);
    Ok((kernels, leaf_size))
}

impl Row {
    fn published(&self) -> Option<&'static Published> {
        let mut all = PUBLISHED.iter().filter(|_| self.photons == 1 << SIZE);
        all.find(|source| source.counterpart == self.counterpart)
    }

    fn of(
        context: &Context<'_>,
        builder: &LbvhBuilder,
        (case, size): (&Case, u32),
        kernels: &Kernels,
        leaf_size: u32,
    ) -> Result<Self> {
        let boxes = &kernels.boxes;
        let triangles = triangles_in(boxes);
        let sorted = SortedCodes::of_boxes(boxes, MORTON_30_AXIS_BITS);
        let merge = || merged_hierarchy(boxes, &sorted, leaf_size, |_| {});
        let lists = || split_list_hierarchy(boxes, &sorted, leaf_size).0;
        let clusters = || clustered_hierarchy(boxes, &sorted, leaf_size, PASS_BITS, &mut ClusterCounts::default());
        let unsorted = codes_before(&sorted);
        let by_clusters = || sort_by_clusters(&unsorted, sorted.bits, UPPER_BITS, &mut ClusterCounts::default());
        if by_clusters() != sorted {
            return Err(Error::setting("order", case.name(), "is another by clusters"));
        }
        let turns = context.in_turns(TURNS, FORMS, |form| {
            let seconds = match form {
                0 => timed(|| kernels.by_volume(leaf_size)).1,
                1 => timed(|| SortedCodes::of_boxes(boxes, MORTON_30_AXIS_BITS)).1,
                2 => timed(merge).1,
                3 => timed(lists).1,
                4 => timed(clusters).1,
                5 => whole(&on_device(builder, &triangles)?),
                _ => timed(by_clusters).1,
            };
            Ok(1e3 * seconds)
        })?;
        let [by_volume, sort, merging, of_lists, of_clusters, device, cluster_sort] =
            std::array::from_fn(|form| Repeats(turns[form].clone()));
        let by_merging = nodes(&merge(), boxes)?;
        let others = [nodes(&lists(), boxes)?, nodes(&clusters(), boxes)?];
        let of_volume = nodes(&kernels.by_volume(leaf_size), boxes)?;
        let both = sort.0.iter().zip(&merging.0);
        Ok(Self {
            scene: case.name().into(),
            counterpart: case.counterpart().into(),
            photons: 1 << size,
            kernels: kernels.len() as u64,
            leaf_size: leaf_size.into(),
            nodes: of_volume,
            linear_nodes: change(by_merging as f64, of_volume as f64),
            different: others.iter().map(|other| other.abs_diff(by_merging)).sum(),
            linear: both.map(|(sort, merge)| sort + merge).collect(),
            by_volume,
            sort,
            merge_over_clusters: merging.over(&of_clusters),
            merge: merging,
            lists: of_lists,
            clusters: of_clusters,
            cluster_sort,
            device,
        })
    }
}

impl Study for Found {
    fn measure(context: &Context<'_>) -> Result<Self> {
        let gpu = (context.gpu)()?;
        let settings = LbvhSettings {
            quality: BuildQuality::Fast,
            ..LbvhSettings::default()
        };
        let builder = LbvhBuilder::new(&gpu, &settings)?;
        let [first, others @ ..] = &CASES;
        let sizes = context.pick(SIZES, SMOKE_SIZES).iter().map(|size| (first, *size));
        let others = context.first(others, 0).iter().map(|case| (case, SIZE));
        let wanted: Vec<(&Case, u32)> = sizes.chain(others).collect();
        let page_price = price_of_a_page(context.smoke);
        let mut of_stages = Vec::new();
        let name = |(case, size): &(&Case, u32)| format!("{}, 2^{size} photons", case.name());
        let maps = context.each(&wanted, name, |(case, size)| {
            let (kernels, leaf_size) = kernels(case, *size)?;
            if case.scene == first.scene {
                of_stages.extend(stages(context, &kernels.boxes, leaf_size, &builder, page_price)?);
            }
            Ok(vec![Row::of(context, &builder, (*case, *size), &kernels, leaf_size)?])
        })?;
        Ok(Self {
            maps,
            stages: of_stages,
            page_price: 1e9 * page_price,
        })
    }

    fn findings(&self) -> Findings {
        let first = CASES[0].name();
        let grown: Vec<Row> = self.maps.iter().filter(|row| row.scene == first).cloned().collect();
        let of_headline = grown.iter().find(|row| row.photons == 1 << SIZE);
        let forms: [(&str, Times); 5] = [
            ("volume heuristic, host", |row| &row.by_volume),
            ("linear by merging, host", |row| &row.linear),
            ("split lists, sorted codes, host", |row| &row.lists),
            ("clusters, sorted codes, host", |row| &row.clusters),
            ("linear for rays, device", |row| &row.device),
        ];
        let curves = forms.into_iter().flat_map(|(name, time)| {
            curves(
                &grown,
                |_| name.to_owned(),
                |row| (row.kernels as f64, time(row).into()),
            )
        });
        Findings::of(&self.maps, CRITERIA)
            .headline(
                "linear build over the kernels of 2¹⁷ photons by merging, host (ms)",
                of_headline.map(|row| row.linear.measured()),
            )
            .curves(
                "times",
                "Construction of photon maps",
                Axes::rates("kernels", "build (ms)"),
                curves.collect(),
            )
            .note(
                "Synthetic kernels: ellipsoids about the second and third hits of photons; radii shrink with their number so that a surface \
                 point lies in as many as the source's Table 5.1 says of the counterpart, hence leaf sizes stay. Nodes are inner ones and \
                 leaves, of trees that were checked. The source's kernels are its own, up to twenty times as long as wide, in its own scenes, \
                 so what can be reproduced is that both trees are about the same size; the sign of a change of so few per cent depends on the \
                 kernels, there from −7.7 % to +5.2 %.",
            )
            .note(
                "On the host one thread but for the sort; on the device the passes' times over triangles in the kernels' boxes, by the \
                 renderer's form of the linear hierarchy for rays, with leaves by surface area: not the maps' own, whose build on the device \
                 `photon-frame` measures. The source's times are of its GPU of 2008. Split lists, clusters and merging begin with sorted codes; \
                 the sort by clusters, on one thread, begins with codes in the kernels' order, which is that of the photons: nearly every \
                 kernel is a cluster of its own. Clusters go from the root down and end at leaves; merging goes from single kernels up, \
                 through all that lies inside of leaves too. The trees are the same.",
            )
            .and(Findings::pivoted(&self.stages, "kernels", &[]))
            .note(format!(
                "The same kernels in the order of the tree ask for the same work from memory that lies side by side: what they save is what \
                 scattered reads cost. Fresh memory is the number of pages that a build touches for the first time, as the system counts them, \
                 times what such a page costs here, {:.0} ns: small builds get the memory of the one before, large ones get new pages from the \
                 system.",
                self.page_price
            ))
            .and(Findings::of(&Growth::all(&self.stages), OF_GROWTH))
            .note("1 is linear, less where fixed costs weigh.")
    }
}
