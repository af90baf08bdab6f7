//! Binary bounding volume hierarchy: built on the CPU by the binned surface area heuristic, laid out for the kernels, and traversed by a
//! twin of them.
//!
//! Sources: I. Wald, "On fast Construction of SAH-based Bounding Volume Hierarchies", IEEE RT 2007 (binning); T. Aila and S. Laine,
//! "Understanding the Efficiency of Ray Traversal on GPUs", HPG 2009 (both children's boxes in the parent); S. Laine, "Restart Trail for
//! Stackless BVH Traversal", HPG 2010 (the order of children does not depend on the hit so far, so a place in it can be found again).
//!
//! Guarantees: the same bytes whatever the number of threads; depth at most [`MAX_DEPTH`]; every triangle that can be met lies in exactly
//! one leaf, the others are counted; a hit that the triangle test reports is never culled (see
//! [`BOX_SLACK`](super::box_test::BOX_SLACK)), so traversal returns exactly what trying all triangles in index order returns.

pub(super) mod build;
pub(super) mod layout;
mod traverse;

pub use build::Bvh2Settings;
pub use traverse::{Step, Traversal};

use super::{
    Aabb, BuildStages, CandidateFilter, DeviceTraversal, Hit, IndexStatistics, Ray, RayIndex, TraversalCounters,
};
use crate::Result;
use crate::catalogue::{Role, Row, sources};
use crate::gpu::shaders::constants;
use bytemuck::{Pod, Zeroable};
use glam::Vec3;

/// Most inner nodes on a way from the root, which is the size of the kernels' stack.
pub const MAX_DEPTH: u32 = constants::BVH2_MAX_DEPTH;

/// Largest number of triangles in a leaf that settings may ask for.
pub const MAX_LEAF_SIZE: u32 = 8;

/// Bits of a child word that hold the number of triangles; zero there marks an inner node, whose index is in the bits above. In a leaf
/// the bits above hold its first triangle.
pub const COUNT_BITS: u32 = constants::BVH2_COUNT_BITS;

/// These bits.
pub const COUNT_MASK: u32 = constants::BVH2_COUNT_MASK;

/// Most triangles that child words can address.
pub const MAX_TRIANGLES: usize = 1 << (32 - COUNT_BITS - 1);

/// Quarters of a node, the unit in which kernels read.
pub(super) const NODE_QUARTERS: usize = size_of::<Bvh2Node>() / size_of::<[u32; 4]>();

/// Quarters of a triangle.
pub(super) const TRIANGLE_QUARTERS: usize = size_of::<Bvh2Triangle>() / size_of::<[u32; 4]>();

const _: () = assert!(
    NODE_QUARTERS == constants::BVH2_NODE_QUARTERS as usize
        && TRIANGLE_QUARTERS == constants::BVH2_TRIANGLE_QUARTERS as usize,
    "the kernels have another layout"
);

/// The child word of a leaf.
pub(super) fn leaf_word(first: u32, count: u32) -> u32 {
    first << COUNT_BITS | count
}

/// An inner node as the kernels read it: both children's boxes and words (64 bytes).
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct Bvh2Node {
    /// Boxes of child 0 and child 1.
    pub bounds: [Aabb; 2],
    /// Child words: see [`COUNT_BITS`].
    pub children: [u32; 2],
    /// Parent's index × 2 + which of its children this is; 0 at the root. Resuming climbs along it.
    pub parent: u32,
    /// Of the root: where the triangles begin, in quarters of a node (16 bytes); else 0.
    pub triangles: u32,
}

/// A triangle as the kernels read it (48 bytes).
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct Bvh2Triangle {
    /// Vertices, metres.
    pub corners: [Vec3; 3],
    /// How hits name it.
    pub index: u32,
    /// Zero.
    pub reserved: [u32; 2],
}

impl Bvh2Triangle {
    pub(super) fn new(corners: [Vec3; 3], index: u32) -> Self {
        Self {
            corners,
            index,
            reserved: [0; 2],
        }
    }
}

/// A binary bounding volume hierarchy over triangles.
///
/// Nodes and triangles are one array, nodes first, which is what the kernels read: an iteration of theirs reads three quarters from one
/// address, whatever it is about to test. On devices that load lane by lane (software ones) that is most of the traversal's time.
#[derive(Debug, Clone)]
pub struct Bvh2 {
    /// What built it.
    name: &'static str,
    quarters: Vec<[u32; 4]>,
    nodes: usize,
    statistics: IndexStatistics,
    stages: BuildStages,
}

impl Bvh2 {
    /// Builds over `triangles`; hits name triangles by their place in it. Deterministic whatever the number of threads.
    ///
    /// # Errors
    /// [`Error::Setting`](crate::Error::Setting) for a leaf size outside 1..=[`MAX_LEAF_SIZE`] or a number of bins outside 2..=64,
    /// [`Error::LimitExceeded`](crate::Error::LimitExceeded) for more than [`MAX_TRIANGLES`].
    pub fn build(triangles: &[[Vec3; 3]], settings: &Bvh2Settings) -> Result<Self> {
        build::build(triangles, settings)
    }

    /// Inner nodes; the root is the first.
    pub fn nodes(&self) -> &[Bvh2Node] {
        bytemuck::cast_slice(&self.quarters[..NODE_QUARTERS * self.nodes])
    }

    /// Triangles in leaf order.
    pub fn triangles(&self) -> &[Bvh2Triangle] {
        bytemuck::cast_slice(&self.quarters[NODE_QUARTERS * self.nodes..])
    }
}

impl RayIndex for Bvh2 {
    fn name(&self) -> &'static str {
        self.name
    }

    fn statistics(&self) -> IndexStatistics {
        self.statistics
    }

    fn stages(&self) -> BuildStages {
        self.stages
    }

    fn texels(&self) -> &[[u32; 4]] {
        &self.quarters
    }

    fn device_traversal(&self) -> DeviceTraversal {
        DeviceTraversal::Bvh2
    }

    fn closest_hit_filtered(&self, ray: &Ray, filter: CandidateFilter<'_>, counters: &mut TraversalCounters) -> Hit {
        let mut traversal = Traversal::closest(ray);
        traversal.run(self, ray, u64::MAX, filter, counters);
        traversal.hit
    }

    fn any_hit_filtered(&self, ray: &Ray, filter: CandidateFilter<'_>, counters: &mut TraversalCounters) -> bool {
        let mut traversal = Traversal::any(ray);
        traversal.run(self, ray, u64::MAX, filter, counters);
        traversal.hit.is_hit()
    }
}

#[cfg(test)]
pub(super) mod tests;

/// Rows of the catalogue.
pub(crate) const ROWS: &[Row] = &[Row {
    id: "BG-14",
    name: "ray index: binary BVH by binned surface-area heuristic",
    role: Role::Kernel,
    limits: "Built on the host, more slowly than by the libraries that `clerestory index --peers` measures, and never refitted: what moves is rebuilt.",
    sources: &[
        sources::WALD_2007.whole(),
        sources::AILA_LAINE_2009.whole(),
        sources::LAINE_2010.whole(),
        sources::IZE_2013.whole(),
    ],
    shaders: &["shaders/accel/bvh2.glsl"],
    tests: &[
        "engine/src/accel/bvh2/tests.rs::traversal_equals_trying_all_triangles_bit_for_bit",
        "engine/src/accel/bvh2/tests.rs::hits_agree_with_f64_up_to_their_stated_error",
        "engine/src/accel/bvh2/tests.rs::no_ray_passes_between_the_triangles_of_a_sphere",
        "engine/src/accel/bvh2/tests.rs::stopped_traversals_go_on_without_loss_or_repetition",
        "tests/tests/accel/ray_index.rs::kernels_are_their_twins_on_soups",
        "tests/tests/accel/ray_index.rs::kernels_are_their_twins_on_hard_cases",
        "tests/tests/hard_cases.rs::ray_indexes_answer_as_a_search_through_all_triangles",
        "tests/tests/raster/gbuffer.rs::what_is_seen_is_what_rays_meet",
        "tests/tests/raster/gbuffer.rs::hard_cases_are_seen_as_rays_meet_them",
    ],
    experiment: "clerestory index --peers",
    api: &["clerestory::accel::bvh2::Bvh2"],
    settings: &[
        "clerestory::accel::bvh2::Bvh2Settings",
        "clerestory render --index bvh2",
    ],
    ..Row::of(file!())
}];
