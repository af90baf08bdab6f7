//! The layout of a kd-tree: nodes of 8 bytes in pairs of siblings; references of leaves on the host, triangles in the order of leaves on the
//! device, where a reference would be one more dependent load for each test. That costs 48 bytes per reference and saves its 4.
//!
//! Source: B. Fabianowski, "Interactive Manycore Photon Mapping", PhD thesis, Trinity College Dublin, 2011, §3.2.3.1; the packed form of a node goes back
//! to I. Wald, "Realtime Ray Tracing and Interactive Global Illumination", PhD thesis, Saarland University, 2004, §7.1.

use super::bounds::Bounds;
use super::build::Built;
use super::cache::MAX_CACHED_LEVELS;
use super::probability::Heuristic;
use super::{KdTree, MAX_DEPTH};
use crate::accel::bvh2::Bvh2Triangle;
use crate::accel::input::{UsableTriangles, check_count};
use crate::accel::stages::Stopwatch;
use crate::accel::{Aabb, BuildStages, IndexStatistics};
use crate::gpu::shaders::constants;
use crate::{Error, Result};
use bytemuck::{Pod, Zeroable};
use glam::Vec3;

/// Low bits of a node's word: the axis, or this for a leaf.
const LEAF: u32 = constants::KD_LEAF;
const KIND_BITS: u32 = constants::KD_KIND_BITS;

/// Most references, and most nodes.
const MAX_INDEX: u64 = 1 << (32 - KIND_BITS);

/// A node as kernels read it (8 bytes).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Pod, Zeroable)]
#[repr(C)]
pub struct KdNode {
    /// Coordinate of the plane, as bits of f32; of a leaf the number of its references.
    pub value: u32,
    /// Low two bits: axis of the plane, or 3 for a leaf. Above: index of the child below the plane, that above is the next; of a leaf the
    /// first of its references.
    pub word: u32,
}

/// What a node is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum KdKind {
    /// A plane, and the index of the child below it.
    Inner { axis: usize, plane: f32, children: u32 },
    /// A range of references.
    Leaf { first: u32, count: u32 },
}

impl KdNode {
    /// A plane across an axis (0 to 2), and the index of the child below it.
    pub fn inner(axis: u8, plane: f32, children: u32) -> Self {
        Self {
            value: plane.to_bits(),
            word: children << KIND_BITS | u32::from(axis),
        }
    }

    /// A leaf: the first of its references, and their number.
    pub fn leaf(first: u32, count: u32) -> Self {
        Self {
            value: count,
            word: first << KIND_BITS | LEAF,
        }
    }

    /// What it is.
    pub fn kind(&self) -> KdKind {
        let above = self.word >> KIND_BITS;
        match self.word & LEAF {
            LEAF => KdKind::Leaf {
                first: above,
                count: self.value,
            },
            axis => KdKind::Inner {
                axis: axis as usize,
                plane: f32::from_bits(self.value),
                children: above,
            },
        }
    }
}

/// What is wrong with a tree.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum KdFault {
    /// A plane outside its node.
    Plane {
        /// Index of the node.
        node: u32,
    },
    /// A way from the root with more than [`MAX_DEPTH`] inner nodes.
    Depth {
        /// Index of the first node too deep.
        node: u32,
    },
    /// A triangle that lies in no leaf.
    Lost {
        /// Its place in [`KdTree::positions`].
        triangle: u32,
    },
}

/// The same tree with its top levels as a heap, and what is below in depth-first order.
fn top_as_heap(nodes: &[KdNode]) -> Vec<KdNode> {
    let mut levels = 1;
    let mut level = vec![0];
    while levels < MAX_CACHED_LEVELS {
        let kinds = level.iter().map(|node| nodes[*node as usize].kind());
        level = kinds
            .filter_map(|kind| match kind {
                KdKind::Inner { children, .. } => Some([children, children + 1]),
                KdKind::Leaf { .. } => None,
            })
            .flatten()
            .collect();
        if level.is_empty() {
            break;
        }
        levels += 1;
    }
    let mut placed = vec![KdNode::leaf(0, 0); 1 << levels];
    // Index, place, and the name in the heap, 0 for nodes below it.
    let mut pending = vec![(0, 0, 1)];
    while let Some((node, place, name)) = pending.pop() {
        let node: KdNode = nodes[node as usize];
        let KdKind::Inner { axis, plane, children } = node.kind() else {
            placed[place] = node;
            continue;
        };
        let in_heap = name > 0 && 2 * name < 1 << levels;
        let first = if in_heap { 2 * name } else { placed.len() };
        if !in_heap {
            placed.extend([KdNode::default(); 2]);
        }
        placed[place] = KdNode::inner(axis as u8, plane, first as u32);
        let names = if in_heap { [first, first + 1] } else { [0; 2] };
        pending.extend([(children + 1, first + 1, names[1]), (children, first, names[0])]);
    }
    placed
}

/// Box of all triangles; empty when there are none.
pub(super) fn bounds_of_all(positions: &[[Vec3; 3]]) -> Aabb {
    positions
        .iter()
        .flatten()
        .fold(Aabb::EMPTY, |b, p| b.with_point(*p))
        .without_negative_zero()
}

impl KdTree {
    /// Lays out what was built.
    pub(super) fn lay_out(
        built: &Built,
        bounds: Aabb,
        positions: Vec<[Vec3; 3]>,
        indices: Vec<u32>,
        statistics: IndexStatistics,
    ) -> Result<Self> {
        let mut nodes = vec![KdNode::leaf(0, 0); 2];
        let mut references = Vec::new();
        let mut pending = vec![(built, 0)];
        while let Some((built, place)) = pending.pop() {
            let place: usize = place;
            match built {
                Built::Leaf(triangles) => {
                    nodes[place] = KdNode::leaf(references.len() as u32, triangles.len() as u32);
                    references.extend_from_slice(triangles);
                }
                Built::Inner(axis, plane, children) => {
                    let first = nodes.len();
                    nodes[place] = KdNode::inner(*axis, *plane, first as u32);
                    nodes.extend([KdNode::default(); 2]);
                    pending.extend([(&children[1], first + 1), (&children[0], first)]);
                }
            }
            if nodes.len().max(references.len()) as u64 >= MAX_INDEX {
                return Err(Error::LimitExceeded {
                    name: "kd-tree".into(),
                    value: nodes.len().max(references.len()) as u64,
                    limit_name: "2^30 nodes and references",
                    limit: MAX_INDEX,
                });
            }
        }
        Ok(Self::complete(
            bounds, nodes, references, positions, indices, statistics,
        ))
    }

    /// A tree that something else has built over `triangles`: the root, a pad, and pairs of siblings, each behind the node above them;
    /// references name triangles by their place among those that rays can meet, which keep their order.
    ///
    /// # Errors
    /// [`Error::Setting`] for what is not a tree of [`MAX_DEPTH`] at most whose leaves hold every triangle.
    pub fn from_nodes(triangles: &[[Vec3; 3]], nodes: Vec<KdNode>, references: Vec<u32>) -> Result<Self> {
        check_count(triangles.len())?;
        let met = UsableTriangles::among(triangles);
        let indices: Vec<u32> = met.map(|_, index| index);
        let positions: Vec<[Vec3; 3]> = met.map(|triangle, _| *triangle);
        let sound = |(place, node): (usize, &KdNode)| match node.kind() {
            KdKind::Inner { children, .. } => {
                children % 2 == 0 && children as usize > place && (children as usize) < nodes.len() - 1
            }
            KdKind::Leaf { first, count } => u64::from(first) + u64::from(count) <= references.len() as u64,
        };
        let places = references.iter().all(|place| (*place as usize) < positions.len());
        let mut named = vec![false; nodes.len() / 2];
        let mut is_named_once = |node: &KdNode| match node.kind() {
            KdKind::Inner { children, .. } => named
                .get_mut(children as usize / 2)
                .is_some_and(|named| !std::mem::replace(named, true)),
            KdKind::Leaf { .. } => true,
        };
        let once = nodes.iter().all(&mut is_named_once);
        if nodes.len() < 2 || !nodes.len().is_multiple_of(2) || !places || !once || !nodes.iter().enumerate().all(sound)
        {
            return Err(Error::setting("kd.nodes", nodes.len(), "are not a tree"));
        }
        let bounds = bounds_of_all(&positions);
        let tree = Self::complete(bounds, nodes, references, positions, indices, met.statistics);
        match tree.validate() {
            Ok(()) => Ok(tree),
            Err(fault) => Err(Error::setting("kd.nodes", tree.nodes.len(), format!("{fault:?}"))),
        }
    }

    fn complete(
        bounds: Aabb,
        nodes: Vec<KdNode>,
        references: Vec<u32>,
        positions: Vec<[Vec3; 3]>,
        indices: Vec<u32>,
        statistics: IndexStatistics,
    ) -> Self {
        let mut watch = Stopwatch::start();
        let mut stages = BuildStages::default();
        let mut tree = Self {
            bounds,
            nodes: top_as_heap(&nodes),
            references,
            positions,
            indices,
            packed: Vec::new(),
            longest_leaf: 0,
            statistics,
            stages: BuildStages::default(),
        };
        tree.packed = tree.pack();
        stages.layout = watch.lap();
        tree.measure();
        stages.statistics = watch.lap();
        tree.stages = stages;
        tree
    }

    /// Box and where triangles begin, then a pair of nodes per texel, and three texels for the triangle of each reference.
    fn pack(&self) -> Vec<[u32; 4]> {
        const HEADER: usize = constants::KD_HEADER_TEXELS as usize;
        let triangles = HEADER + self.nodes.len() / 2;
        let corner = |v: Vec3, word: usize| [v.x.to_bits(), v.y.to_bits(), v.z.to_bits(), word as u32];
        let mut packed = vec![corner(self.bounds.lower, triangles), corner(self.bounds.upper, 0)];
        packed.extend_from_slice(bytemuck::cast_slice(&self.nodes));
        for reference in &self.references {
            let place = *reference as usize;
            let triangle = Bvh2Triangle::new(self.positions[place], self.indices[place]);
            packed.extend_from_slice(bytemuck::cast_slice(&[triangle]));
        }
        packed
    }

    /// Nodes, leaves, depth, cost by surface areas.
    fn measure(&mut self) {
        let mut statistics = self.statistics;
        let mut longest_leaf = 0;
        let scene = Bounds::from(self.bounds);
        let mut tests_and_visits = 0.0;
        self.walk(|_, kind, bounds, depth| {
            let share = if scene.half_area() > 0.0 {
                Heuristic::SurfaceArea.probability(&Bounds::from(*bounds), &scene)
            } else {
                1.0
            };
            match kind {
                KdKind::Inner { .. } => {
                    statistics.nodes += 1;
                    statistics.max_depth = statistics.max_depth.max(depth + 1);
                    tests_and_visits += share;
                }
                KdKind::Leaf { count, .. } => {
                    statistics.leaves += u64::from(count > 0);
                    longest_leaf = longest_leaf.max(count);
                    tests_and_visits += share * f64::from(count);
                }
            }
        });
        statistics.sah_cost = tests_and_visits;
        statistics.triangles = self.positions.len() as u64;
        statistics.bytes = size_of_val(self.packed.as_slice()) as u64;
        self.statistics = statistics;
        self.longest_leaf = longest_leaf;
    }

    /// Every node with its box and the number of inner nodes above it.
    pub(super) fn walk(&self, mut visit: impl FnMut(u32, KdKind, &Aabb, u32)) {
        let mut pending = vec![(0, self.bounds, 0)];
        while let Some((node, bounds, depth)) = pending.pop() {
            let kind = self.nodes[node as usize].kind();
            visit(node, kind, &bounds, depth);
            if let KdKind::Inner { axis, plane, children } = kind {
                let (mut below, mut above) = (bounds, bounds);
                below.upper[axis] = plane;
                above.lower[axis] = plane;
                pending.extend([(children + 1, above, depth + 1), (children, below, depth + 1)]);
            }
        }
    }

    /// Whether planes lie in their nodes, ways are short enough, and every triangle is in a leaf.
    ///
    /// # Errors
    /// The first [`KdFault`].
    pub fn validate(&self) -> Result<(), KdFault> {
        let mut fault = None;
        let mut found = vec![false; self.positions.len()];
        self.walk(|node, kind, bounds, depth| match kind {
            KdKind::Inner { axis, plane, .. } => {
                if !(bounds.lower[axis] <= plane && plane <= bounds.upper[axis]) {
                    fault.get_or_insert(KdFault::Plane { node });
                }
                if depth >= MAX_DEPTH {
                    fault.get_or_insert(KdFault::Depth { node });
                }
            }
            KdKind::Leaf { first, count } => {
                for reference in &self.references[first as usize..][..count as usize] {
                    found[*reference as usize] = true;
                }
            }
        });
        let lost = found.iter().position(|found| !found);
        match fault.or(lost.map(|triangle| KdFault::Lost {
            triangle: triangle as u32,
        })) {
            Some(fault) => Err(fault),
            None => Ok(()),
        }
    }
}
