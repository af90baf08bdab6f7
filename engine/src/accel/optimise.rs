//! Works on a finished binary tree so that rays visit less of it: what turns a fast build into a good one.
//!
//! Three steps, each of which has its file and its source: treelets are rearranged from the leaves up, everything above the small subtrees
//! that result is built anew from the root down, and subtrees may then be taken out and put back where they cost least. Treelets alone
//! lower the surface area cost below that of a tree built from the root down and still leave rays more to visit: large primitives among
//! small ones pull the boxes of good subtrees over each other, which the cost, an expectation over lines through the whole scene, hardly
//! sees (T. Aila, T. Karras, S. Laine, "On Quality Metrics of Bounding Volume Hierarchies", HPG 2013). The second step takes that overlap
//! away.
//!
//! Guarantees: the expected cost never exceeds that of the tree given; the depth bound holds; the same tree whatever the number of
//! threads.

mod leaves;
mod mini_trees;
mod reinsertion;
mod treelets;

pub use treelets::MAX_TREELET;

use super::Aabb;
use super::box_tree::{BoxTree, Child, EMPTY_NODE, PairNode};
use super::leaf_rule::{LeafRule, half_area};
use crate::catalogue::{Role, Row, sources};
use leaves::{choose, with_leaves};

/// How much to do.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Optimisation {
    /// Leaves of a treelet, 3..=[`MAX_TREELET`].
    pub treelet: usize,
    /// Passes of treelets over the tree.
    pub rounds: u32,
    /// Most primitives in a subtree that is kept when what is above is built anew; 0 leaves the step out.
    pub mini_tree: u32,
    /// Rounds of reinsertion.
    pub reinsertions: u32,
    /// When subtrees become leaves; part of the cost.
    pub leaves: LeafRule,
    /// Most inner nodes on a way from the root; the tree that is given must keep it, and ⌈log₂ n⌉ must.
    pub max_depth: u32,
}

/// Optimises a tree, each of whose leaves holds one primitive, and makes its leaves. Nodes come in depth-first order.
pub fn optimise(tree: &BoxTree, boxes: &[Aabb], settings: &Optimisation) -> BoxTree {
    let (mut best, given_cost) = treelets::restructure(tree, boxes, settings);
    let mut leaves = None;
    if settings.mini_tree > 0 {
        best = mini_trees::rebuild(best, settings.mini_tree, settings.max_depth);
        let chosen = choose(&best, settings.leaves);
        if chosen.cost <= given_cost {
            leaves = Some(chosen);
        } else {
            // So rare that the tree before is rather made twice than kept.
            best = treelets::restructure(tree, boxes, settings).0;
        }
    }
    let mut leaves = leaves.unwrap_or_else(|| choose(&best, settings.leaves));
    if settings.reinsertions > 0 {
        let moved = reinsertion::reinsert(&best, settings.reinsertions, settings.max_depth);
        let chosen = choose(&moved, settings.leaves);
        if chosen.cost <= leaves.cost {
            (best, leaves) = (moved, chosen);
        }
    }
    with_leaves(&best, &leaves)
}

/// Rows of the catalogue.
pub(crate) const ROWS: &[Row] = &[Row {
    id: "CL-TREELETS",
    name: "optimisation of trees by treelets, mini trees and reinsertion",
    role: Role::PartOf("CL-LBVH"),
    limits: "On the host only; minds only the expected cost, in which overlap of boxes hardly shows.",
    sources: &[
        sources::DOMINGUES_PEDRINI_2015.whole(),
        sources::GANESTAM_2015.whole(),
        sources::MEISTER_BITTNER_2018.whole(),
    ],
    tests: &[
        "engine/src/accel/optimise/tests.rs::every_step_gives_valid_trees_that_cost_no_more",
        "engine/src/accel/optimise/tests.rs::two_clusters_that_are_paired_crosswise_come_apart",
        "engine/src/accel/optimise/tests.rs::trees_do_not_depend_on_the_number_of_threads",
        "engine/src/accel/lbvh/tests.rs::restructured_trees_are_valid_and_cost_no_more",
        "engine/src/accel/lbvh/tests.rs::bytes_do_not_depend_on_the_number_of_threads",
    ],
    api: &["clerestory::accel::optimise::optimise"],
    settings: &[
        "clerestory::accel::optimise::Optimisation",
        "clerestory render --index lbvh-high",
    ],
    ..Row::of(file!())
}];

#[cfg(test)]
mod tests;
