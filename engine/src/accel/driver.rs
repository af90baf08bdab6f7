//! The driver's acceleration structure as a ray index: its boxes and its traversal, our triangle test. Built and traversed on the device alone, where
//! `VK_KHR_ray_query` is offered; the other indexes are its twins.
//!
//! Source: Khronos, `GLSL_EXT_ray_query` and the ray traversal of "Vulkan Specification".
//!
//! # Boxes, not triangles
//!
//! A structure of triangles would let the driver, and on most devices its hardware, test them: fewer candidates for shaders to look at. But by a rule
//! of the driver's own, which is watertight in itself and not with ours: of two triangles at an edge the driver may name the one that our test finds missed,
//! and the ray is lost between both; to take the driver's word instead gives other distances, other surfaces where distances tie, and another picture on
//! each device. So the structure holds a box for each triangle, and every triangle whose box a ray meets is tried by the test of
//! [`triangle`](super::triangle): hits are those of all other indexes to the bit, ties, filters and seams of meshes included.
//!
//! # How far boxes are grown
//!
//! [`BOX_SLACK`] bounds how far, in parts of the reach M of a ray (the largest component distance from its origin to a corner of the box around all), a
//! hit that the triangle test reports may lie from its triangle, with 20u M left for the slab test. It holds for a driver's slab test, too, if that errs by no
//! more than ours, 8u M, and for rays whose origin is moved into coordinates about the middle of the box, 2u M; a driver that rounds its boxes has to
//! round them outwards. Other indexes grow their boxes by the ray; here they are built once, grown for rays of a reach up to [`DRIVER_REACH`] times the
//! longest side of the box around all: 2⁻¹⁴ of that side. The few rays from beyond, and those that begin behind their origin, which Vulkan has not, try all
//! triangles instead, and stop at the quota as in any index. So whatever the ray, no hit is lost; that the driver keeps to the bound is what
//! tests hold it to.
//!
//! # Determinism
//!
//! The order of candidates is the driver's, and may differ from run to run. Hits do not: of the candidates that pass the least t counts, of equal
//! ones the least triangle index, and filters are pure. Counts of work may.

use glam::{DVec3, Vec3};

use super::box_test::BOX_SLACK;
use super::bvh2::Bvh2Triangle;
use super::input::{UsableTriangles, bounds_of, check_count};
use super::{Aabb, IndexStatistics};
use crate::Result;
use crate::catalogue::{Role, Row, sources};
use crate::gpu::ash::vk;
use crate::gpu::shaders::constants;
use crate::gpu::{AccelerationStructure, Category, Gpu, StructureBox, TexelView};
use bytemuck::{Pod, Zeroable};

/// Reach of the rays that boxes are grown for, in longest sides of the box around all triangles.
pub const DRIVER_REACH: f32 = 16.0;

const _: () = assert!(
    size_of::<Header>() == 16 * constants::DRIVER_HEADER_TEXELS as usize
        && size_of::<Bvh2Triangle>() == 16 * constants::DRIVER_TRIANGLE_TEXELS as usize,
    "the kernels have another layout"
);

/// What kernels read first.
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
#[repr(C)]
struct Header {
    lower: Vec3,
    /// The furthest reach of rays that go to the driver, metres.
    reach: f32,
    upper: Vec3,
    triangles: u32,
    /// Of the structure's coordinates.
    origin: Vec3,
    reserved: u32,
}

/// A driver's acceleration structure over triangles, in device memory.
#[derive(Debug, Clone)]
pub struct DriverIndex {
    /// A box for each triangle that rays can meet.
    pub structure: AccelerationStructure,
    /// The triangles, as `accel/driver_bindings.glsl` has them.
    pub triangles: TexelView,
    /// How many triangles there are, and the bytes of both. What the driver's tree is like it does not say: nodes, leaves and cost are 0.
    pub statistics: IndexStatistics,
}

impl DriverIndex {
    /// Builds over `triangles`, on the host's threads up to the boxes, and from there on on the device. Hits name triangles by their place in it.
    ///
    /// # Errors
    /// [`Error::MissingFeature`](crate::Error::MissingFeature) on a device without [`Caps::ray_query`](crate::gpu::Caps::ray_query);
    /// [`Error::LimitExceeded`](crate::Error::LimitExceeded) for more triangles than [`MAX_TRIANGLES`](super::bvh2::MAX_TRIANGLES), or than the device
    /// has texels or boxes for; those of uploads and of submissions.
    pub fn build(gpu: &Gpu, triangles: &[[Vec3; 3]]) -> Result<Self> {
        check_count(triangles.len())?;
        let usable = UsableTriangles::among(triangles);
        let boxes = usable.map(|triangle, _| bounds_of(triangle));
        let bounds = boxes.iter().fold(Aabb::EMPTY, |all, one| all.union(*one));
        let frame = Frame::around(&bounds);
        let boxes: Vec<_> = boxes.iter().map(|one| frame.grown(one)).collect();
        let structure = gpu.box_structure("the index `driver`", Category::Index, &boxes)?;
        let header = Header {
            lower: bounds.lower,
            reach: frame.reach,
            upper: bounds.upper,
            triangles: boxes.len() as u32,
            origin: frame.origin,
            reserved: 0,
        };
        let mut texels: Vec<[u32; 4]> = bytemuck::cast_slice(&[header]).to_vec();
        let records = usable.map(|corners, index| Bvh2Triangle::new(*corners, index));
        texels.extend_from_slice(bytemuck::cast_slice(&records));
        let format = vk::Format::R32G32B32A32_UINT;
        let triangles = gpu.texels_with("triangles of the driver's index", Category::Index, format, &texels)?;
        Ok(Self {
            statistics: IndexStatistics {
                bytes: structure.bytes() + triangles.buffer().bytes(),
                ..usable.statistics
            },
            structure,
            triangles,
        })
    }
}

/// The coordinates of a structure, and how its boxes are grown.
#[derive(Debug, Clone, Copy)]
struct Frame {
    origin: Vec3,
    reach: f32,
    growth: f64,
}

impl Frame {
    /// For triangles within a box.
    fn around(bounds: &Aabb) -> Self {
        let (lower, upper) = (bounds.lower, bounds.upper);
        // An empty box has no middle.
        let size = (upper - lower).max(Vec3::ZERO).max_element();
        let reach = DRIVER_REACH * size;
        Self {
            origin: if lower.cmple(upper).all() {
                0.5 * (lower + upper)
            } else {
                Vec3::ZERO
            },
            reach,
            growth: f64::from(BOX_SLACK) * f64::from(reach),
        }
    }

    /// A box in these coordinates, grown, and rounded outwards.
    fn grown(&self, bounds: &Aabb) -> StructureBox {
        let at =
            |corner: Vec3, side: f64| corner.as_dvec3() - self.origin.as_dvec3() + DVec3::splat(side * self.growth);
        let lower = at(bounds.lower, -1.0).to_array().map(rounded_down);
        let upper = at(bounds.upper, 1.0).to_array().map(|x| -rounded_down(-x));
        [lower, upper]
    }
}

/// The greatest f32 that is not above a number in its range.
fn rounded_down(x: f64) -> f32 {
    let nearest = x as f32;
    if f64::from(nearest) > x {
        nearest.next_down()
    } else {
        nearest
    }
}

#[cfg(test)]
mod tests;

/// Rows of the catalogue.
pub(crate) const ROWS: &[Row] = &[Row {
    id: "CL-DRIVER",
    name: "ray index: the driver's acceleration structure, by ray queries",
    role: Role::Kernel,
    limits: "Only on devices with `VK_KHR_ray_query`, which the baseline driver lacks; a box for each triangle, so that hardware tests no triangles; rays from beyond 16 lengths of the scene try all triangles; never refitted; counts of work depend on the driver.",
    sources: &[
        sources::KHRONOS_VULKAN.at("ray traversal"),
        sources::KHRONOS_RAY_QUERY.whole(),
    ],
    shaders: &["shaders/accel/driver.glsl"],
    tests: &[
        "engine/src/accel/driver/tests.rs::boxes_hold_what_the_triangle_test_reports_of_rays_within_reach",
        "tests/tests/accel/driver_index.rs::hits_are_those_of_trying_all_triangles_to_the_bit",
        "tests/tests/accel/driver_index.rs::rays_from_beyond_the_reach_stop_at_the_quota_and_go_on",
        "tests/tests/accel/driver_index.rs::devices_without_ray_queries_refuse_it_by_name",
        "tests/tests/accel/index_choice.rs::pictures_are_the_same_to_the_bit_with_every_index",
        "tests/tests/accel/seams.rs::kernels_lose_no_ray_at_seams_in_any_index",
    ],
    experiment: "clerestory index --peers",
    api: &["clerestory::accel::driver::DriverIndex"],
    settings: &["clerestory render --index driver"],
    ..Row::of(file!())
}];
