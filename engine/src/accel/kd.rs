//! kd-trees: space itself is cut by planes, so leaves come in the order of the ray and a triangle may lie in several.
//!
//! Sources: I. Wald and V. Havran, "On building fast kd-Trees for Ray Tracing, and on doing that in O(N log N)", IEEE RT 2006;
//! B. Fabianowski, "Interactive Manycore Photon Mapping", PhD thesis, Trinity College Dublin, 2011, chapters 3 and 4 (heuristics for origins inside the
//! scene, traversal without a stack by a word of flags, push-down and short stack).
//!
//! Guarantees: the same tree whatever the number of threads; at most [`MAX_DEPTH`] inner nodes on a way from the root; hits are those of
//! trying all triangles in index order, bit for bit, whatever the traversal. The last needs more than the source's rule that a hit within
//! its leaf is final: planes are met a little later and left a little earlier than their distance says, by the bound that
//! [`BOX_SLACK`](super::box_test::BOX_SLACK) derives for slabs, and leaves are gone through until they begin beyond the best hit.

pub mod bounds;
pub(crate) mod build;
pub(crate) mod cache;
mod clip;
mod counters;
mod entries;
mod kept;
pub mod probability;
mod replay;
pub(crate) mod shifted_restart;
pub(crate) mod traverse;
mod tree;

pub use cache::{KdCaches, MAX_BYTE_LEVELS, MAX_CACHED_LEVELS, StackCache};
pub use counters::KdCounters;
pub use kept::KeptTree;
pub use probability::Heuristic;
pub use traverse::{KdTraversal, MAX_SHORT_STACK, Scheme};
pub use tree::{KdFault, KdNode};

use super::input::{UsableTriangles, check_count, check_range};
use super::stages::Stopwatch;
use super::{
    Aabb, BuildStages, CandidateFilter, DeviceTraversal, Hit, IndexStatistics, Ray, RayIndex, TraversalCounters,
};
use crate::gpu::shaders::constants;
use crate::{Error, Result};
use glam::Vec3;

/// Most inner nodes on a way from the root: the bits of the word of flags.
pub const MAX_DEPTH: u32 = constants::KD_MAX_DEPTH;

/// Largest number of triangles that settings may ask a leaf to be left at.
pub const MAX_LEAF_SIZE: u32 = 64;

/// Settings of the construction; the defaults are those of the source (§4.1.4), but for clipping.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct KdSettings {
    /// What children are weighed by. Default SIROH, by which rays visit fewer inner nodes than by surface area, but test more triangles in most
    /// scenes.
    pub heuristic: Heuristic,
    /// Cost of visiting an inner node. Default 1.
    pub traversal_cost: f64,
    /// Cost of a triangle test. Default 3.
    pub intersection_cost: f64,
    /// Nodes of so many triangles or fewer are leaves, 1..=64. Default 4.
    pub leaf_size: u32,
    /// What a plane's cost is lowered by when it cuts off empty space, as a share. Default 0.2.
    pub empty_bonus: f64,
    /// Share of the node's volume that this space must exceed. Default 0.3.
    pub empty_share: f64,
    /// Most inner nodes on a way from the root, 0..=[`MAX_DEPTH`]. Default 32.
    pub max_depth: u32,
    /// Whether triangles are weighed by what of them lies in a node ("perfect splits"), not by their boxes. Default true; the source has
    /// false.
    pub clip: bool,
}

impl Default for KdSettings {
    fn default() -> Self {
        Self {
            heuristic: Heuristic::InteriorOrigin,
            traversal_cost: 1.0,
            intersection_cost: 3.0,
            leaf_size: 4,
            empty_bonus: 0.2,
            empty_share: 0.3,
            max_depth: MAX_DEPTH,
            clip: true,
        }
    }
}

impl KdSettings {
    fn check(&self) -> Result<()> {
        check_range("kd.leaf_size", self.leaf_size, 1, MAX_LEAF_SIZE)?;
        check_range("kd.max_depth", self.max_depth, 0, MAX_DEPTH)?;
        for (name, value, most) in [
            ("kd.traversal_cost", self.traversal_cost, f64::MAX),
            ("kd.intersection_cost", self.intersection_cost, f64::MAX),
            ("kd.empty_bonus", self.empty_bonus, 1.0),
            ("kd.empty_share", self.empty_share, 1.0),
        ] {
            if !(0.0..=most).contains(&value) {
                return Err(Error::setting(name, value, "is not a number from 0 on, or too large"));
            }
        }
        Ok(())
    }
}

/// A kd-tree over triangles.
#[derive(Debug, Clone)]
pub struct KdTree {
    bounds: Aabb,
    /// The root, a pad, and pairs of siblings: the top levels as a heap, what is below in depth-first order.
    nodes: Vec<KdNode>,
    /// Triangles of leaves, as places in `positions`, ascending in each leaf.
    references: Vec<u32>,
    positions: Vec<[Vec3; 3]>,
    /// Original index of each of `positions`, ascending.
    indices: Vec<u32>,
    /// What kernels read.
    packed: Vec<[u32; 4]>,
    longest_leaf: u32,
    statistics: IndexStatistics,
    stages: BuildStages,
}

impl KdTree {
    /// Builds over `triangles`; hits name triangles by their place in it. Deterministic whatever the number of threads.
    ///
    /// # Errors
    /// [`Error::Setting`] for settings out of range, [`Error::LimitExceeded`] for more than [`MAX_TRIANGLES`](super::bvh2::MAX_TRIANGLES), or for more references than
    /// nodes can name.
    pub fn build(triangles: &[[Vec3; 3]], settings: &KdSettings) -> Result<Self> {
        settings.check()?;
        check_count(triangles.len())?;
        let mut watch = Stopwatch::start();
        let mut stages = BuildStages::default();
        let met = UsableTriangles::among(triangles);
        let indices: Vec<u32> = met.map(|_, index| index);
        let positions: Vec<[Vec3; 3]> = met.map(|triangle, _| *triangle);
        let statistics = met.statistics;
        let bounds = tree::bounds_of_all(&positions);
        stages.triangles = watch.lap();
        let built = match positions.is_empty() {
            true => build::Built::Leaf(Vec::new()),
            false => build::build(&positions, bounds, settings),
        };
        stages.hierarchy = watch.lap();
        let mut tree = Self::lay_out(&built, bounds, positions, indices, statistics)?;
        tree.stages.triangles = stages.triangles;
        tree.stages.hierarchy = stages.hierarchy;
        Ok(tree)
    }

    /// Box of all triangles; empty when there are none.
    pub fn bounds(&self) -> Aabb {
        self.bounds
    }

    /// The root, a pad, and pairs of siblings. The top levels, as many as there are up to [`MAX_CACHED_LEVELS`], are a heap with holes: the
    /// children of the node at i are at 2i and 2i + 1, those of the root at 2 and 3; so are what caches hold. Holes are leaves of nothing.
    pub fn nodes(&self) -> &[KdNode] {
        &self.nodes
    }

    /// Triangles of leaves, as places in [`KdTree::positions`].
    pub fn references(&self) -> &[u32] {
        &self.references
    }

    /// Triangles that rays can meet.
    pub fn positions(&self) -> &[[Vec3; 3]] {
        &self.positions
    }

    /// Original index of each triangle.
    pub fn indices(&self) -> &[u32] {
        &self.indices
    }

    /// Most triangles in a leaf.
    pub fn longest_leaf(&self) -> u32 {
        self.longest_leaf
    }

    /// Closest hit by a scheme of traversal.
    pub fn closest_hit_by(
        &self,
        scheme: Scheme,
        ray: &Ray,
        filter: CandidateFilter<'_>,
        counters: &mut KdCounters,
    ) -> Hit {
        let mut traversal = KdTraversal::closest(scheme, ray);
        traversal.run(self, ray, u64::MAX, filter, counters);
        traversal.hit
    }

    /// The first accepted candidate that a scheme of traversal finds; occluded once the hit has a triangle.
    pub fn any_hit_by(&self, scheme: Scheme, ray: &Ray, filter: CandidateFilter<'_>, counters: &mut KdCounters) -> Hit {
        let mut traversal = KdTraversal::any(scheme, ray);
        traversal.run(self, ray, u64::MAX, filter, counters);
        traversal.hit
    }
}

impl RayIndex for KdTree {
    fn name(&self) -> &'static str {
        "kd"
    }

    fn statistics(&self) -> IndexStatistics {
        self.statistics
    }

    fn stages(&self) -> BuildStages {
        self.stages
    }

    fn texels(&self) -> &[[u32; 4]] {
        &self.packed
    }

    fn device_traversal(&self) -> DeviceTraversal {
        DeviceTraversal::Kd {
            longest_leaf: self.longest_leaf,
        }
    }

    fn closest_hit_filtered(&self, ray: &Ray, filter: CandidateFilter<'_>, counters: &mut TraversalCounters) -> Hit {
        let mut work = KdCounters::default();
        let hit = self.closest_hit_by(Scheme::Stack, ray, filter, &mut work);
        work.add_to(counters);
        hit
    }

    fn any_hit_filtered(&self, ray: &Ray, filter: CandidateFilter<'_>, counters: &mut TraversalCounters) -> bool {
        let mut work = KdCounters::default();
        let hit = self.any_hit_by(Scheme::Stack, ray, filter, &mut work);
        work.add_to(counters);
        hit.is_hit()
    }
}

#[cfg(test)]
mod cost_tests;
#[cfg(test)]
mod shifted_restart_tests;
#[cfg(test)]
mod tests;
