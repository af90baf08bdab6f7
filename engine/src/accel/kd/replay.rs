//! Whether a tree that something else has written is one of the triangles at hand: they are handed down its planes again, by the rule of
//! construction.
//!
//! Guarantees: a tree that passes has in every leaf the triangles that construction would put there, so that hits are those of trying all
//! triangles; and its leaves longer than [`LONG_LEAF`] are those of construction, with the planes above them. Its other planes may be any: they change how
//! long rays take, and no hit. The work is bounded by references and depth, whatever the tree.

use super::build::{Builder, Side, side_of, triangle_bounds};
use super::tree::KdKind;
use super::{KdSettings, KdTree};
use rayon::prelude::*;
use std::ops::Range;

/// Leaves of so many triangles fit into the loops of every software device, of 16 lanes among media.
pub(super) const LONG_LEAF: u32 = 32;

/// The leaves of a tree, numbered from below to above.
struct Leaves {
    /// Of each node the leaves below it.
    spans: Vec<Range<u32>>,
    /// Where the leaves of each triangle begin in `holding`.
    begin: Vec<usize>,
    /// The leaves that hold each triangle, ascending.
    holding: Vec<u32>,
    /// Whether a node is a long leaf or above one.
    long: Vec<bool>,
}

impl Leaves {
    /// `None` where a leaf's references do not ascend. The tree is valid, and its leaves have no more references than there are.
    fn of(tree: &KdTree) -> Option<Self> {
        let mut leaves = Self {
            spans: vec![0..0; tree.nodes.len()],
            begin: vec![0; tree.positions.len() + 1],
            holding: Vec::new(),
            long: vec![false; tree.nodes.len()],
        };
        let mut ranges = Vec::new();
        leaves.number(tree, 0, &mut ranges);
        let mut count = 0;
        for range in &ranges {
            let references = &tree.references[range.clone()];
            if !references.is_sorted_by(|a, b| a < b) {
                return None;
            }
            for reference in references {
                leaves.begin[*reference as usize + 1] += 1;
            }
            count += references.len();
        }
        for place in 0..tree.positions.len() {
            leaves.begin[place + 1] += leaves.begin[place];
        }
        let mut next = leaves.begin.clone();
        leaves.holding = vec![0; count];
        for (leaf, range) in ranges.into_iter().enumerate() {
            for reference in &tree.references[range] {
                let place = &mut next[*reference as usize];
                leaves.holding[*place] = leaf as u32;
                *place += 1;
            }
        }
        Some(leaves)
    }

    /// Numbers the leaves below a node, at most [`MAX_DEPTH`](super::MAX_DEPTH) levels, and gathers their references.
    fn number(&mut self, tree: &KdTree, node: u32, ranges: &mut Vec<Range<usize>>) {
        let (place, begin) = (node as usize, ranges.len() as u32);
        self.long[place] = match tree.nodes[place].kind() {
            KdKind::Leaf { first, count } => {
                ranges.push(first as usize..first as usize + count as usize);
                count > LONG_LEAF
            }
            KdKind::Inner { children, .. } => {
                self.number(tree, children, ranges);
                self.number(tree, children + 1, ranges);
                self.long[children as usize] || self.long[children as usize + 1]
            }
        };
        self.spans[place] = begin..ranges.len() as u32;
    }

    /// The leaves that hold a triangle.
    fn holding(&self, triangle: usize) -> &[u32] {
        &self.holding[self.begin[triangle]..self.begin[triangle + 1]]
    }
}

/// Whether a tree is of its triangles. It is valid, and its leaves have no more references than there are.
pub(super) fn is_of_its_triangles(tree: &KdTree, settings: &KdSettings) -> bool {
    let Some(leaves) = Leaves::of(tree) else {
        return false;
    };
    let builder = Builder::new(&tree.positions, tree.bounds, settings);
    let handed_down = |triangle| is_handed_down(tree, &builder, &leaves, triangle);
    (0..tree.positions.len()).into_par_iter().all(handed_down) && builder.has_built(tree, &leaves.long)
}

/// Whether a triangle lies in the leaves that it comes to, and in no other.
fn is_handed_down(tree: &KdTree, builder: &Builder<'_>, leaves: &Leaves, triangle: usize) -> bool {
    let (corners, holding) = (&tree.positions[triangle], leaves.holding(triangle));
    let mut found = 0;
    let mut pending = vec![(0, tree.bounds, triangle_bounds(corners))];
    while let Some((node, bounds, part)) = pending.pop() {
        let node: u32 = node;
        match tree.nodes[node as usize].kind() {
            KdKind::Leaf { .. } => {
                if holding.binary_search(&leaves.spans[node as usize].start).is_err() {
                    return false;
                }
                found += 1;
            }
            KdKind::Inner { axis, plane, children } => {
                let (mut below, mut above) = (bounds, bounds);
                below.upper[axis] = plane;
                above.lower[axis] = plane;
                let (below, above) = ((children, below), (children + 1, above));
                match side_of(&part, axis, plane) {
                    Some(Side::Below) => pending.push((below.0, below.1, part)),
                    Some(Side::Above) => pending.push((above.0, above.1, part)),
                    Some(Side::Both) => pending.extend([below, above].into_iter().filter_map(|(child, bounds)| {
                        let part = builder.part(corners, &bounds)?;
                        Some((child, bounds, part))
                    })),
                    // Which side construction has chosen for triangles in the plane is not written down: the one that has it.
                    None => {
                        let span = &leaves.spans[children as usize];
                        let first = holding.partition_point(|leaf| *leaf < span.start);
                        let is_below = holding.get(first).is_some_and(|leaf| *leaf < span.end);
                        let (child, bounds) = if is_below { below } else { above };
                        pending.push((child, bounds, part));
                    }
                }
            }
        }
    }
    found == holding.len()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::accel::DeviceTraversal;
    use crate::accel::bvh2::tests::{hard_scenes, soup};
    use crate::accel::device_traversal::KdRounds;
    use crate::accel::kd::{Heuristic, KdNode, MAX_DEPTH};
    use crate::accel::test_support::Random;
    use crate::gpu::SOFTWARE_LOOP_CAP;
    use crate::gpu::shaders::constants::{SHADOW_SURFACES, SHADOW_SURFACES_ALPHA};
    use glam::Vec3;

    fn soup_of(count: usize) -> Vec<[Vec3; 3]> {
        soup(&mut Random(94), count, 0.1, 1.0, Vec3::ZERO)
    }

    fn tree_of(triangles: &[[Vec3; 3]], nodes: Vec<KdNode>, references: Vec<u32>) -> KdTree {
        KdTree::from_nodes(triangles, nodes, references).expect("a tree")
    }

    #[test]
    fn trees_that_are_built_are_of_their_triangles() {
        let default = KdSettings::default();
        let others = [
            KdSettings {
                heuristic: Heuristic::SurfaceArea,
                clip: false,
                ..default
            },
            // Long leaves, by depth and by cost.
            KdSettings {
                max_depth: 3,
                ..default
            },
            KdSettings {
                intersection_cost: 0.05,
                ..default
            },
            KdSettings {
                intersection_cost: 1000.0,
                leaf_size: 1,
                ..default
            },
        ];
        let mut longest = 0;
        for (name, triangles) in hard_scenes().into_iter().chain([("soup", soup_of(900))]) {
            for settings in [default].iter().chain(&others) {
                let tree = KdTree::build(&triangles, settings).expect("a tree");
                assert!(is_of_its_triangles(&tree, settings), "{name} {settings:?}");
                longest = longest.max(tree.longest_leaf());
            }
        }
        assert!(longest > LONG_LEAF, "{longest}");
    }

    /// A wall of two triangles in the plane x = 1, and one triangle on either side.
    #[test]
    fn planes_choose_the_side_of_triangles_within_them() {
        let at = |x: f32| [Vec3::new(x, 0.0, 0.0), Vec3::new(x, 1.0, 0.0), Vec3::new(x, 0.0, 1.0)];
        let triangles = [at(0.0), at(1.0), at(1.0), at(2.0)];
        let nodes = |below| {
            vec![
                KdNode::inner(0, 1.0, 2),
                KdNode::leaf(0, 0),
                KdNode::leaf(0, below),
                KdNode::leaf(below, 4 - below),
            ]
        };
        for below in [1, 2, 3] {
            let tree = tree_of(&triangles, nodes(below), vec![0, 1, 2, 3]);
            assert!(is_of_its_triangles(&tree, &KdSettings::default()), "{below}");
        }
    }

    #[test]
    fn triangles_in_other_leaves_are_found() {
        let triangles = soup_of(200);
        let settings = KdSettings::default();
        let tree = KdTree::build(&triangles, &settings).expect("a tree");
        let leaf_of = |place: usize| {
            let holds = |node: &&KdNode| match node.kind() {
                KdKind::Leaf { first, count } => (first as usize..first as usize + count as usize).contains(&place),
                KdKind::Inner { .. } => false,
            };
            tree.nodes.iter().find(holds).map(KdNode::kind)
        };
        let mut refused = 0;
        for place in 0..tree.references.len() {
            let mut references = tree.references.clone();
            references[place] = (references[place] + 1) % tree.positions.len() as u32;
            // Trees that lose a triangle, or have one twice in a leaf, are found without.
            let Some(KdKind::Leaf { first, count }) = leaf_of(place) else {
                panic!("no leaf for {place}");
            };
            references[first as usize..first as usize + count as usize].sort_unstable();
            if let Ok(wrong) = KdTree::from_nodes(&triangles, tree.nodes.clone(), references) {
                assert!(!is_of_its_triangles(&wrong, &settings), "{place}");
                refused += 1;
            }
        }
        assert!(refused > 20, "{refused}");
    }

    #[test]
    fn moved_planes_are_found_where_triangles_cross_them() {
        let triangles = soup_of(200);
        let settings = KdSettings::default();
        let tree = KdTree::build(&triangles, &settings).expect("a tree");
        let KdKind::Inner { axis, plane, children } = tree.nodes[0].kind() else {
            panic!("no tree");
        };
        // A triangle begins or ends at the plane, and crosses it once it moves that way.
        let moved = |plane: &f32| {
            let mut nodes = tree.nodes.clone();
            nodes[0] = KdNode::inner(axis as u8, *plane, children);
            let moved = KdTree::from_nodes(&triangles, nodes, tree.references.clone());
            moved.is_ok_and(|moved| !is_of_its_triangles(&moved, &settings))
        };
        assert!([plane.next_up(), plane.next_down()].iter().any(moved));
    }

    /// One leaf of all; and as deep as trees are, planes that cut off nothing, or a triangle each.
    #[test]
    fn long_leaves_are_those_of_construction() {
        let corner = |i: u32| Vec3::new(i as f32, (i % 7) as f32, (i % 5) as f32);
        let triangles: Vec<[Vec3; 3]> = (0..200)
            .map(|i| [corner(i), corner(i) + Vec3::Y, corner(i) + Vec3::Z])
            .collect();
        let count = triangles.len() as u32;
        let settings = KdSettings::default();
        let one_leaf = tree_of(
            &triangles,
            vec![KdNode::leaf(0, count), KdNode::leaf(0, 0)],
            (0..count).collect(),
        );
        assert!(!is_of_its_triangles(&one_leaf, &settings));
        let chain = |plane: fn(u32) -> f32, each: u32| {
            let mut nodes = vec![KdNode::default(), KdNode::leaf(0, 0)];
            for level in 0..MAX_DEPTH {
                let children = nodes.len() as u32;
                let place = if level == 0 { 0 } else { nodes.len() - 1 };
                nodes[place] = KdNode::inner(0, plane(level), children);
                nodes.extend([KdNode::leaf(level * each, each), KdNode::default()]);
            }
            let last = nodes.len() - 1;
            nodes[last] = KdNode::leaf(MAX_DEPTH * each, count - MAX_DEPTH * each);
            tree_of(&triangles, nodes, (0..count).collect())
        };
        for tree in [chain(|_| 0.0, 0), chain(|level| level as f32 + 0.5, 1)] {
            assert!(tree.longest_leaf() > LONG_LEAF);
            assert!(!is_of_its_triangles(&tree, &settings));
        }
        // What cannot be cut is left long by construction, too.
        let equal = vec![triangles[0]; 2 * LONG_LEAF as usize];
        let tree = KdTree::build(&equal, &settings).expect("a tree");
        assert!(tree.longest_leaf() > LONG_LEAF && is_of_its_triangles(&tree, &settings));
    }

    #[test]
    fn leaves_that_are_not_long_fit_into_the_loops_of_software_devices() {
        let cases = [
            (SOFTWARE_LOOP_CAP, true),
            (SOFTWARE_LOOP_CAP / 2 / SHADOW_SURFACES, false),
            (SOFTWARE_LOOP_CAP / 2 / SHADOW_SURFACES_ALPHA, true),
        ];
        for (most, filters) in cases {
            let rounds = KdRounds { waits: false, filters };
            let iterations = DeviceTraversal::kd_iterations(LONG_LEAF, 0, 16, rounds);
            assert!(iterations < u64::from(most), "{iterations} of {most}");
        }
    }
}
