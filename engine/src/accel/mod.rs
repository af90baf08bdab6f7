//! Floor 3: spatial indexes and their traversal. What a ray meets first, and whether it meets anything.
//!
//! Every index but the driver's implements [`RayIndex`]: it is built on the CPU or holds what a device build read back, offers the texels that the
//! kernels bind as set 1, and carries the twin of its traversal. All indexes report the same hit for the same ray, bit for bit on one
//! machine: the triangle test is shared ([`triangle`]), boxes are conservative for everything that test can report, and of candidates
//! with equal distance the lowest triangle index wins.
//!
//! What is only measured, and what tests compare with, is in [`yardstick`].
//!
//! # How to add an index
//!
//! Beside its [`RayIndex`] it has an include `accel/<name>.glsl` with a function over the texel buffer of set 1
//! (`accel/index_bindings.glsl`),
//!
//! ```glsl
//! uint <name>_traverse(Ray ray, uint resume, const bool any_hit, inout Hit hit);
//! ```
//!
//! which returns `INDEX_FINISHED`, or where to go on when the quota `INDEX_QUOTA` has stopped the ray; `resume` is `INDEX_START` at first and
//! `hit` is `no_hit(ray.t_max)`. With `CLERESTORY_CANDIDATE_FILTER` defined it asks `accept_candidate` before a hit counts, and where
//! `INDEX_RESUMES` is false no call goes on with a ray. It has a number of its own in `accel/index.glsl`, by which kernels are specialized
//! ([`DeviceTraversal::kind`]): every kernel that traverses any index traverses this one, too. Kernels but those of persistent threads also traverse the driver's structure
//! ([`driver`]), from modules of their own, since devices without ray queries must not see those.

mod aabb;
pub mod box_test;
pub mod box_tree;
pub mod bvh2;
mod device_traversal;
pub mod driver;
mod input;
pub mod kd;
mod kind;
pub mod lbvh;
mod leaf_rule;
pub mod morton;
pub mod offset;
pub mod optimise;
pub mod photon_map;
pub mod sphere;
mod stages;
pub(crate) mod sweep;
pub mod trace;
pub mod triangle;
pub mod two_level;
pub mod wide;
pub mod yardstick;

#[cfg(test)]
mod test_support;

pub use aabb::Aabb;
pub use device_traversal::DeviceTraversal;
pub(crate) use input::can_be_met;
pub use kind::{IndexBinding, IndexKept, IndexKind, IndexOnDevice, IndexReport};
pub use leaf_rule::LeafRule;
pub use stages::BuildStages;

use crate::gpu::shaders::constants;
use bytemuck::{Pod, Zeroable};
use glam::Vec3;

/// [`Hit::triangle`] of a ray that met nothing.
pub const NO_HIT: u32 = constants::NO_HIT;

/// Stands for "done" where a traversal that can be stopped says where to resume.
pub const FINISHED: u32 = constants::INDEX_FINISHED;

/// Smallest largest-component of a ray direction that is traced; shorter directions, zero among them, meet nothing.
pub const MIN_DIRECTION: f32 = constants::MIN_DIRECTION;

/// Largest direction component that is traced (2²⁸); beyond it products of the triangle test could overflow.
pub const MAX_DIRECTION: f32 = constants::MAX_DIRECTION;

/// Largest coordinate, metres, of an indexed vertex or a ray origin (2³⁰); what lies beyond is left out and counted.
pub const MAX_COORDINATE: f32 = constants::MAX_COORDINATE;

/// A ray segment as the kernels read it (32 bytes, scalar layout).
///
/// The direction needs no unit length; `t` counts in multiples of it. Hits with `t_min` ≤ t ≤ `t_max` are reported. A ray with a NaN or
/// an infinite origin or direction, or outside [`MIN_DIRECTION`], [`MAX_DIRECTION`], [`MAX_COORDINATE`], meets nothing; an infinite
/// `t_max` is allowed.
#[derive(Debug, Clone, Copy, PartialEq, Default, Pod, Zeroable)]
#[repr(C)]
pub struct Ray {
    /// Origin, metres.
    pub origin: [f32; 3],
    /// Smallest parameter of a hit.
    pub t_min: f32,
    /// Direction, not necessarily of unit length.
    pub direction: [f32; 3],
    /// Largest parameter of a hit.
    pub t_max: f32,
}

impl Ray {
    /// The ray from `origin`, metres, along `direction`, of any length: `t` from 0 to infinity.
    pub fn new(origin: Vec3, direction: Vec3) -> Self {
        Self {
            origin: origin.to_array(),
            t_min: 0.0,
            direction: direction.to_array(),
            t_max: f32::INFINITY,
        }
    }

    /// Whether the ray can meet anything: finite and in range.
    pub fn is_traceable(&self) -> bool {
        let largest = |v: &[f32; 3]| v.iter().fold(0.0f32, |m, x| if x.abs() > m { x.abs() } else { m });
        self.origin.iter().all(|x| x.abs() <= MAX_COORDINATE)
            && self.direction.iter().all(|x| x.abs() <= MAX_DIRECTION)
            && largest(&self.direction) >= MIN_DIRECTION
    }
}

/// What a ray met (16 bytes, scalar layout).
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct Hit {
    /// Ray parameter; the ray's `t_max` when nothing was met.
    pub t: f32,
    /// Weights of vertices 1 and 2; vertex 0 has one minus their sum.
    pub barycentrics: [f32; 2],
    /// Index of the triangle as given to the index, or [`NO_HIT`].
    pub triangle: u32,
}

impl Hit {
    /// Nothing met yet up to `t_max`.
    pub fn none(t_max: f32) -> Self {
        Self {
            t: t_max,
            barycentrics: [0.0; 2],
            triangle: NO_HIT,
        }
    }

    /// Whether something was met.
    pub fn is_hit(&self) -> bool {
        self.triangle != NO_HIT
    }
}

/// Size and quality of an index.
#[derive(Debug, Clone, Copy, PartialEq, Default, serde::Serialize)]
#[non_exhaustive]
pub struct IndexStatistics {
    /// Triangles that rays can meet.
    pub triangles: u64,
    /// Triangles left out since a coordinate is NaN, infinite or beyond [`MAX_COORDINATE`].
    pub excluded_range: u64,
    /// Triangles left out since their area is zero.
    pub excluded_degenerate: u64,
    /// Inner nodes; in two levels with the places for nodes over the instances.
    pub nodes: u64,
    /// Leaves that hold triangles.
    pub leaves: u64,
    /// Largest number of inner nodes on a way from the root.
    pub max_depth: u32,
    /// Surface area heuristic: expected node visits and triangle tests of a line that meets the root box, unit costs.
    pub sah_cost: f64,
    /// Bytes of all buffers.
    pub bytes: u64,
}

impl IndexStatistics {
    /// The counts of triangles alone.
    fn of_triangles(&self) -> Self {
        Self {
            triangles: self.triangles,
            excluded_range: self.excluded_range,
            excluded_degenerate: self.excluded_degenerate,
            ..Self::default()
        }
    }
}

/// Exact work counters of a traversal.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[non_exhaustive]
pub struct TraversalCounters {
    /// Inner nodes visited: two box tests each in binary hierarchies, eight in wide ones.
    pub nodes: u64,
    /// Triangle tests.
    pub triangles: u64,
    /// Loop iterations, those of resuming included.
    pub iterations: u64,
}

/// Decides whether a candidate hit counts: original triangle index and the weights of vertices 1 and 2. Must be pure.
pub type CandidateFilter<'a> = &'a mut dyn FnMut(u32, [f32; 2]) -> bool;

/// A spatial index over triangles that kernels can traverse.
pub trait RayIndex: Send + Sync {
    /// Short name, as in reports.
    fn name(&self) -> &'static str;

    /// Size and quality.
    fn statistics(&self) -> IndexStatistics;

    /// Times of the stages that built it; all zero where they are not known.
    fn stages(&self) -> BuildStages;

    /// How kernels traverse it.
    fn device_traversal(&self) -> DeviceTraversal;

    /// What kernels read: the texels, four words each (`R32G32B32A32_UINT`), of the uniform texel buffer that is set 1; never empty.
    fn texels(&self) -> &[[u32; 4]];

    /// Twin of the closest-hit kernel: the accepted candidate of least `t`, of equal ones that of least index.
    fn closest_hit_filtered(&self, ray: &Ray, filter: CandidateFilter<'_>, counters: &mut TraversalCounters) -> Hit;

    /// Twin of the any-hit kernel: whether an accepted candidate exists.
    fn any_hit_filtered(&self, ray: &Ray, filter: CandidateFilter<'_>, counters: &mut TraversalCounters) -> bool;

    /// Closest hit among all triangles.
    fn closest_hit(&self, ray: &Ray) -> Hit {
        self.closest_hit_filtered(ray, &mut |_, _| true, &mut TraversalCounters::default())
    }

    /// Whether the ray meets any triangle.
    fn any_hit(&self, ray: &Ray) -> bool {
        self.any_hit_filtered(ray, &mut |_, _| true, &mut TraversalCounters::default())
    }
}
