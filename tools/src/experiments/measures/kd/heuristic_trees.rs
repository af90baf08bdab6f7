//! kd-trees by heuristic: their forms, their builds, their sizes.

use clerestory::Result;
use clerestory::accel::RayIndex;
use clerestory::accel::kd::{Heuristic, KdSettings, KdTree};

use super::flights::{Case, TURNS};
use super::published::{Changes, TREES, Trees, of_source};
use crate::experiments::findings::{Bound, Criterion, Repeats, change, rows};
use crate::experiments::measures::Context;
use crate::experiments::measures::photon_maps::photon_scenes::Surfaces;
use crate::timing::timed;

/// Heuristics, the one that others are compared with first.
const HEURISTICS: [Heuristic; 3] = [Heuristic::SurfaceArea, Heuristic::Regions, Heuristic::InteriorOrigin];
/// Triangles up to which trees are built by 26 regions, which takes twenty times as long as the others.
const MANY_TRIANGLES: usize = 100_000;

/// How triangles are weighed, and how many a node may hold to be a leaf whatever it costs.
pub struct Form {
    /// Both, for tables.
    pub words: &'static str,
    clip: bool,
    leaf_size: u32,
}

/// All.
pub const FORMS: [Form; 3] = [
    Form {
        words: "boxes, leaves of 4",
        clip: false,
        leaf_size: 4,
    },
    Form {
        words: "boxes, leaves of 1",
        clip: false,
        leaf_size: 1,
    },
    Form {
        words: "parts in a node, leaves of 4",
        clip: true,
        leaf_size: 4,
    },
];
/// The form whose numbers of nodes are nearest to the source's.
pub const NEAREST: &str = FORMS[1].words;
/// The form that the source does not have.
const OURS_ALONE: &str = FORMS[2].words;

rows! {
    /// A tree.
    struct Grown = "Trees by heuristic" by [scene, form, heuristic] {
        scene: String = "scene",
        counterpart: String = "counterpart",
        triangles: u64 = "triangles",
        form: String = "weighed by",
        heuristic: String = "heuristic",
        build: Repeats = "build (ms)",
        build_change: Repeats = "build, change (%)",
        nodes: u64 = "inner nodes",
        nodes_change: f64 = "change of nodes (%)",
        references: u64 = "references",
        depth: u64 = "depth",
        longest_leaf: u64 = "longest leaf",
    }
    beside "source: build, change (%), its processor I" = |row| row.source_build(0).into();
    beside "source: build, change (%), its processor II" = |row| row.source_build(1).into();
    beside "source: inner nodes by surface area" = |row| published(&row.counterpart, &row.form).map(|trees| trees.nodes).into();
    beside "source: change of nodes (%)" = |row| row.changes().and_then(|changes| changes.nodes).into();
}

/// What is good of them.
pub const OF_TREES: &[Criterion<Grown>] = &[Criterion::each(
    "trees by SIROH have the size of those by surface area: change of inner nodes (%)",
    Bound::Between(-2.0, 2.0),
    |tree: &Grown| tree.nodes_change.into(),
)
.among(|tree| tree.form == NEAREST && tree.heuristic == Heuristic::InteriorOrigin.name())
.because("the source's are −1.0 to 1.5")];

/// What the source says of trees over a scene's counterpart; its boxes stand beside ours alone.
pub fn published(counterpart: &str, form: &str) -> Option<&'static Trees> {
    of_source(&TREES, counterpart).filter(|_| form != OURS_ALONE)
}

/// What it says that a heuristic changes.
pub fn published_changes(counterpart: &str, form: &str, heuristic: &str) -> Option<&'static Changes> {
    let trees = published(counterpart, form)?;
    let changes = [
        (Heuristic::Regions, &trees.regions),
        (Heuristic::InteriorOrigin, &trees.siroh),
    ];
    let known = changes.into_iter().find(|(of, _)| of.name() == heuristic);
    known.map(|(_, changes)| changes)
}

impl Grown {
    fn changes(&self) -> Option<&'static Changes> {
        published_changes(&self.counterpart, &self.form, &self.heuristic)
    }

    /// What the source says that the build takes more, on one of its processors.
    fn source_build(&self, processor: usize) -> Option<f64> {
        self.changes()?.build.map(|build| build[processor])
    }

    /// A tree beside the first one of its form.
    pub fn of(case: &Case, form: &Form, one: &Tree, first: &Tree) -> Self {
        let statistics = one.tree.statistics();
        Self {
            scene: case.name().into(),
            counterpart: case.counterpart.into(),
            triangles: statistics.triangles,
            form: form.words.into(),
            heuristic: one.heuristic.name().into(),
            build: one.build.clone(),
            build_change: one.build.change_from(&first.build),
            nodes: statistics.nodes,
            nodes_change: change(statistics.nodes as f64, first.tree.statistics().nodes as f64),
            references: one.tree.references().len() as u64,
            depth: statistics.max_depth.into(),
            longest_leaf: one.tree.longest_leaf().into(),
        }
    }
}

/// A tree with the times of its builds.
pub struct Tree {
    /// What weighs its children.
    pub heuristic: Heuristic,
    /// The tree.
    pub tree: KdTree,
    /// Milliseconds.
    pub build: Repeats,
}

/// Trees of a form by all heuristics, built in turns.
///
/// # Errors
/// As [`KdTree::build`].
pub fn grow(context: &Context<'_>, surfaces: &Surfaces, form: &Form) -> Result<Vec<Tree>> {
    let is_large = surfaces.triangles.len() > MANY_TRIANGLES;
    let wanted = HEURISTICS.into_iter().filter(|h| *h != Heuristic::Regions || !is_large);
    let wanted: Vec<Heuristic> = wanted.collect();
    let mut trees: Vec<Option<KdTree>> = wanted.iter().map(|_| None).collect();
    let times = context.in_turns(TURNS, wanted.len(), |i| {
        let settings = KdSettings {
            heuristic: wanted[i],
            clip: form.clip,
            leaf_size: form.leaf_size,
            ..KdSettings::default()
        };
        let (tree, time) = timed(|| KdTree::build(&surfaces.triangles, &settings));
        trees[i] = Some(tree?);
        Ok(1e3 * time)
    })?;
    let trees = trees.into_iter().flatten();
    let grown = wanted.into_iter().zip(trees).zip(times);
    Ok(grown
        .map(|((heuristic, tree), times)| Tree {
            heuristic,
            tree,
            build: Repeats(times),
        })
        .collect())
}
