//! A binary tree over boxes as all builders of this floor make it, with its validation and its costs.
//!
//! Costs: the surface area heuristic (J. Goldsmith and J. Salmon, "Automatic Creation of Object Hierarchies for Ray Tracing", IEEE CG&A
//! 7(5), 1987) for rays, its volume twin (the voxel volume heuristic of photon maps) for point queries, both with unit costs.
//!
//! Guarantee: [`BoxTree::shape`] accepts exactly the trees in which every primitive lies in one leaf and every box is the union of the
//! primitives below it, equal as numbers are: −0 is +0.

use super::Aabb;

/// Where a tree goes on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Child {
    /// Primitives at consecutive places of [`BoxTree::order`].
    Leaf {
        /// First place.
        first: u32,
        /// Number of places.
        count: u32,
    },
    /// Index of an inner node.
    Inner(u32),
}

/// An inner node: the boxes of both children, and where they are.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PairNode {
    /// Boxes of the left and the right child.
    pub bounds: [Aabb; 2],
    /// Left and right child.
    pub children: [Child; 2],
}

/// A node before it is written.
pub(crate) const EMPTY_NODE: PairNode = PairNode {
    bounds: [Aabb::EMPTY; 2],
    children: [Child::Leaf { first: 0, count: 0 }; 2],
};

/// A binary tree over boxes.
#[derive(Debug, Clone, PartialEq)]
pub struct BoxTree {
    /// Primitives in leaf order.
    pub order: Vec<u32>,
    /// Inner nodes, in no particular order.
    pub nodes: Vec<PairNode>,
    /// Box of all; empty without primitives.
    pub bounds: Aabb,
    /// Where to begin: a leaf when all primitives lie in one, also when there are none.
    pub root: Child,
}

/// Size of a valid tree.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct TreeShape {
    /// Inner nodes that are reached.
    pub nodes: u32,
    /// Leaves that hold primitives.
    pub leaves: u32,
    /// Most inner nodes on a way from the root.
    pub max_depth: u32,
    /// Most primitives in a leaf.
    pub largest_leaf: u32,
}

/// What is wrong with a tree.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum TreeFault {
    /// A node is reached twice or does not exist.
    Node(u32),
    /// A leaf lies outside the order or is empty.
    Leaf {
        /// First place.
        first: u32,
        /// Number of places.
        count: u32,
    },
    /// A place is in several leaves, or a primitive at several places, or it does not exist.
    Repeated(u32),
    /// So many primitives are in no leaf.
    Missing(u32),
    /// A stored box is not the union of what is below.
    Box {
        /// The node that stores it; `None` for the root's box.
        node: Option<u32>,
        /// Which child: 0 left, 1 right; 0 for the root's box.
        side: u32,
    },
    /// A plane of a node's box is a plane of neither child.
    Plane {
        /// The node whose children these are.
        node: u32,
        /// 0, 1, 2 of the lower planes x, y, z; 3, 4, 5 of the upper ones.
        plane: u32,
    },
}

impl BoxTree {
    /// A tree whose primitives all lie in one leaf, in the order given.
    pub(crate) fn single_leaf(order: Vec<u32>, bounds: Aabb) -> Self {
        Self {
            root: Child::Leaf {
                first: 0,
                count: order.len() as u32,
            },
            order,
            nodes: Vec::new(),
            bounds,
        }
    }

    /// Inner nodes with their depth (the root's is 1), parents before children, left before right.
    pub fn preorder(&self) -> impl Iterator<Item = (u32, u32)> + '_ {
        let mut pending = match self.root {
            Child::Inner(root) => vec![(root, 1)],
            Child::Leaf { .. } => Vec::new(),
        };
        std::iter::from_fn(move || {
            let (node, depth) = pending.pop()?;
            if let Some(pair) = self.nodes.get(node as usize) {
                for child in pair.children.iter().rev() {
                    if let Child::Inner(child) = child {
                        pending.push((*child, depth + 1));
                    }
                }
            }
            Some((node, depth))
        })
    }

    /// Checks the tree over the primitives' boxes, and measures it.
    ///
    /// # Errors
    /// The first [`TreeFault`] that is found.
    pub fn shape(&self, boxes: &[Aabb]) -> Result<TreeShape, TreeFault> {
        let mut shape = TreeShape::default();
        let mut placed = vec![false; self.order.len()];
        let mut present = vec![false; boxes.len()];
        let (mut leaves, mut largest_leaf) = (0, 0);
        let mut leaf = |first: u32, count: u32| {
            let end = first as usize + count as usize;
            if count == 0 || end > self.order.len() {
                return Err(TreeFault::Leaf { first, count });
            }
            let places = first as usize..end;
            for (placed, primitive) in placed[places.clone()].iter_mut().zip(&self.order[places]) {
                let seen = present.get_mut(*primitive as usize);
                if std::mem::replace(placed, true) || seen.is_none_or(|s| std::mem::replace(s, true)) {
                    return Err(TreeFault::Repeated(*primitive));
                }
            }
            leaves += 1;
            largest_leaf = largest_leaf.max(count);
            Ok(())
        };
        if let Child::Leaf { first, count } = self.root
            && (count > 0 || !boxes.is_empty())
        {
            leaf(first, count)?;
        }
        let mut visited = vec![false; self.nodes.len()];
        let mut order = Vec::with_capacity(self.nodes.len());
        for (node, depth) in self.preorder() {
            if visited
                .get_mut(node as usize)
                .is_none_or(|v| std::mem::replace(v, true))
            {
                return Err(TreeFault::Node(node));
            }
            shape.max_depth = shape.max_depth.max(depth);
            for child in self.nodes[node as usize].children {
                if let Child::Leaf { first, count } = child {
                    leaf(first, count)?;
                }
            }
            order.push(node);
        }
        (shape.leaves, shape.largest_leaf) = (leaves, largest_leaf);
        shape.nodes = order.len() as u32;
        let missing = present.iter().filter(|p| !**p).count();
        if missing > 0 {
            return Err(TreeFault::Missing(missing as u32));
        }
        let exact = |child: Child, inner: &[Aabb]| match child {
            Child::Inner(node) => inner[node as usize],
            Child::Leaf { first, count } => self.order[first as usize..(first + count) as usize]
                .iter()
                .fold(Aabb::EMPTY, |b, i| b.union(boxes[*i as usize])),
        };
        let mut inner = vec![Aabb::EMPTY; self.nodes.len()];
        for &node in order.iter().rev() {
            let pair = &self.nodes[node as usize];
            for side in 0..2 {
                let bounds = exact(pair.children[side], &inner);
                if bounds != pair.bounds[side] {
                    return Err(TreeFault::Box {
                        node: Some(node),
                        side: side as u32,
                    });
                }
                inner[node as usize] = inner[node as usize].union(bounds);
            }
        }
        if exact(self.root, &inner) != self.bounds {
            return Err(TreeFault::Box { node: None, side: 0 });
        }
        Ok(shape)
    }

    /// Expected node visits and primitive tests of a line that meets the root box.
    pub fn area_cost(&self) -> f64 {
        self.cost(Aabb::half_area)
    }

    /// Expected node visits and primitive tests of a point in the root box.
    pub fn volume_cost(&self) -> f64 {
        self.cost(Aabb::volume)
    }

    fn cost(&self, measure: impl Fn(&Aabb) -> f64) -> f64 {
        let whole = measure(&self.bounds);
        let weight = |child: Child| match child {
            Child::Leaf { count, .. } => f64::from(count),
            Child::Inner(_) => 1.0,
        };
        if whole <= 0.0 {
            return 0.0;
        }
        let below = self.preorder().map(|(node, _)| {
            let pair = &self.nodes[node as usize];
            (0..2)
                .map(|i| measure(&pair.bounds[i]) * weight(pair.children[i]))
                .sum::<f64>()
        });
        below.sum::<f64>() / whole + weight(self.root)
    }
}
