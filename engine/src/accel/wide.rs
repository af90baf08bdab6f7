//! Wide bounding volume hierarchy: eight children a node in 80 bytes, made of a binary tree on the host or on the device, refitted there, laid out for
//! the kernels, and traversed by a twin of them.
//!
//! Source: H. Ylitie, T. Karras and S. Laine, "Efficient Incoherent Ray Traversal on GPUs Through Compressed Wide BVHs", HPG 2017: nodes with
//! boxes of 8 bits a plane on a grid of their own (§4.1), the cheapest collapse of a binary tree by dynamic programming (§3.1), children in
//! slots by the octant that they lie in (§3.2), and stacks of groups of children (§4.2). Here the word that says what slots hold gives each slot three
//! bits for triangles and one for a child node, so that slots need no words of their own, and the parent, which stopped rays climb by, has room.
//!
//! Guarantees: the same bytes whatever the number of threads; every triangle that can be met lies in exactly one slot, the others are counted;
//! depth at most [`MAX_DEPTH`], since no way is longer than in the binary tree; decoded boxes contain the boxes that they are made of, exactly
//! (see [`WideNode::planes`]), and the test of decoded boxes keeps within the slack by which boxes are grown (see [`traverse`]). So
//! traversal returns exactly what trying all triangles in index order returns.

mod collapse;
mod device;
mod device_refit;
pub(super) mod frame;
mod grid;
pub(super) mod refit;
pub(super) mod slots;
pub mod traverse;

pub use device::{ResidentWide, WideBuffers, WideBuild, WideBuilder};
pub use device_refit::{RefittableWide, WideRefitter};
pub use refit::refit;
pub(crate) use refit::refit_resident;
pub use traverse::WideTraversal;

use super::bvh2::{Bvh2, Bvh2Triangle};
use super::input::check_range;
use super::lbvh::{self, LbvhSettings};
use super::stages::Stopwatch;
use super::{
    Aabb, BuildStages, CandidateFilter, DeviceTraversal, Hit, IndexStatistics, Ray, RayIndex, TraversalCounters,
};
use crate::catalogue::{Role, Row, sources};
use crate::gpu::shaders::constants;
use crate::{Error, Result};
use bytemuck::{Pod, Zeroable};
use glam::{DVec3, Vec3};

/// Most nodes on a way from the root, which is the size of the kernels' stack.
pub const MAX_DEPTH: u32 = constants::WIDE_MAX_DEPTH;

/// Slots of a node.
pub const SLOTS: usize = constants::WIDE_SLOTS as usize;

/// Most triangles of a slot.
pub const LEAF_SIZE: u32 = constants::WIDE_LEAF_SIZE;

/// Most triangles of a node.
pub const NODE_TRIANGLES: u32 = constants::WIDE_NODE_TRIANGLES;

/// Texels of a node.
const NODE_TEXELS: usize = size_of::<WideNode>() / size_of::<[u32; 4]>();

const _: () = assert!(
    NODE_TEXELS == constants::WIDE_NODE_TEXELS as usize
        && size_of::<Header>() == 16 * constants::WIDE_HEADER_TEXELS as usize
        && size_of::<Bvh2Triangle>() == 16 * constants::WIDE_TRIANGLE_TEXELS as usize
        && MAX_DEPTH >= super::bvh2::MAX_DEPTH
        && MAX_DEPTH <= constants::WIDE_LEVELS,
    "the kernels have another layout"
);

/// Settings of the build.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct WideSettings {
    /// The binary tree that is collapsed; its leaves have at most [`LEAF_SIZE`] triangles. By default the optimised linear hierarchy: collapsed it has
    /// rays as fast as those of the binned heuristic or faster, and is built sooner.
    pub binary: LbvhSettings,
    /// Cost of a triangle's test, relative to that of a node's visit, by which the binary tree is collapsed, 0 to 100. Default 0.4.
    pub triangle_cost: f32,
}

impl Default for WideSettings {
    fn default() -> Self {
        Self {
            binary: LbvhSettings {
                leaf_size: LEAF_SIZE,
                ..LbvhSettings::default()
            },
            triangle_cost: 0.4,
        }
    }
}

/// What the texels begin with (32 bytes).
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
#[repr(C)]
struct Header {
    lower: Vec3,
    /// Texel where the triangles begin.
    triangles: u32,
    upper: Vec3,
    zero: u32,
}

/// A node as the kernels read it (80 bytes).
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct WideNode {
    /// Corner of the grid: a multiple of its step along each axis, at or below all that the node holds.
    pub corner: Vec3,
    /// Steps of the grid along x, y and z: a biased exponent of two each, x in the lowest byte.
    pub exponents: u32,
    /// First child node; the others follow in the order of slots.
    pub children: u32,
    /// First triangle, by its place; the others follow in the order of slots.
    pub triangles: u32,
    /// What slots hold: bits 3s to 3s + 2 of slot s one for each triangle, bit 24 + s a child node.
    pub slots: u32,
    /// Parent's index × 8 + which of its slots this is; 0 at the root. Resuming climbs along it.
    pub parent: u32,
    /// By axis the lower and the upper planes of all slots: plane q lies at `corner + q · step`. A lower plane is the greatest multiple of the step that is
    /// not above what it bounds, an upper one the least that is not below: so decoded boxes contain the boxes that were given.
    pub planes: [[[u8; SLOTS]; 2]; 3],
}

impl WideNode {
    /// Step of the grid along an axis, metres.
    pub fn step(&self, axis: usize) -> f32 {
        f32::from_bits((self.exponents >> (8 * axis) & 0xFF) << constants::WIDE_EXPONENT_SHIFT)
    }

    /// The box of a slot as kernels decode it, metres: exact.
    pub fn bounds(&self, slot: usize) -> [DVec3; 2] {
        let plane = |side: usize| {
            DVec3::from_array([0, 1, 2].map(|axis: usize| {
                f64::from(self.corner[axis]) + f64::from(self.planes[axis][side][slot]) * f64::from(self.step(axis))
            }))
        };
        [plane(0), plane(1)]
    }

    /// Slots that hold child nodes, a bit each.
    pub fn inner(&self) -> u32 {
        self.slots >> constants::WIDE_INNER_SHIFT
    }

    /// The child node in a slot, if there is one.
    pub fn child(&self, slot: usize) -> Option<u32> {
        let before = self.inner() & ((1 << slot) - 1);
        (self.inner() >> slot & 1 != 0).then(|| self.children + before.count_ones())
    }

    /// Places of a slot's triangles: the first, and how many; none of a child node.
    pub fn leaf(&self, slot: usize) -> (u32, u32) {
        let held = self.slots & constants::WIDE_TRIANGLE_MASK;
        let first = LEAF_SIZE * slot as u32;
        let before = held & ((1 << first) - 1);
        let own = held >> first & ((1 << LEAF_SIZE) - 1);
        (self.triangles + before.count_ones(), own.count_ones())
    }
}

/// A wide bounding volume hierarchy over triangles.
#[derive(Debug, Clone)]
pub struct WideBvh {
    texels: Vec<[u32; 4]>,
    nodes: usize,
    statistics: IndexStatistics,
    stages: BuildStages,
}

impl WideBvh {
    /// Builds over `triangles`: a linear hierarchy, collapsed. Hits name triangles by their place in it.
    /// Deterministic whatever the number of threads.
    ///
    /// # Errors
    /// [`Error::Setting`] for settings out of range, [`Error::LimitExceeded`] for more than [`MAX_TRIANGLES`](super::bvh2::MAX_TRIANGLES).
    pub fn build(triangles: &[[Vec3; 3]], settings: &WideSettings) -> Result<Self> {
        check_range("wide.binary.leaf_size", settings.binary.leaf_size, 1, LEAF_SIZE)?;
        check_triangle_cost(settings)?;
        Self::collapse(&lbvh::build(triangles, &settings.binary)?, settings)
    }

    /// The wide tree of least cost among those whose nodes are nodes of a binary tree.
    ///
    /// # Errors
    /// [`Error::Setting`] for a cost out of range and for a tree with leaves of more than [`LEAF_SIZE`] triangles.
    pub fn collapse(binary: &Bvh2, settings: &WideSettings) -> Result<Self> {
        check_triangle_cost(settings)?;
        collapse::collapse(binary, settings.triangle_cost, SLOTS)
    }

    /// Nodes and triangles with the header before them, measured; of `statistics` the counts of triangles and the depth are given.
    fn assembled(
        nodes: &[WideNode],
        triangles: &[Bvh2Triangle],
        bounds: &Aabb,
        statistics: IndexStatistics,
        stages: BuildStages,
    ) -> Self {
        let header = Header {
            lower: bounds.lower,
            triangles: first_triangle_texel(nodes.len()) as u32,
            upper: bounds.upper,
            zero: 0,
        };
        let mut texels: Vec<[u32; 4]> = Vec::with_capacity(texels_of(nodes.len(), triangles.len()));
        texels.extend(bytemuck::cast::<Header, [[u32; 4]; 2]>(header));
        texels.extend_from_slice(bytemuck::cast_slice(nodes));
        texels.extend_from_slice(bytemuck::cast_slice(triangles));
        Self::of_texels(texels, nodes.len(), statistics, stages)
    }

    /// What lies in memory, measured; of `statistics` as for [`WideBvh::assembled`].
    fn of_texels(texels: Vec<[u32; 4]>, nodes: usize, statistics: IndexStatistics, mut stages: BuildStages) -> Self {
        let mut watch = Stopwatch::start();
        let mut index = Self {
            nodes,
            texels,
            statistics,
            stages,
        };
        let (bytes, bounds) = (size_of_val(index.texels.as_slice()), index.bounds());
        let mut statistics = IndexStatistics {
            bytes: bytes as u64,
            ..statistics
        };
        measure(index.nodes(), &bounds, &mut statistics);
        stages.statistics += watch.lap();
        (index.statistics, index.stages) = (statistics, stages);
        index
    }

    /// Nodes; the root is the first.
    pub fn nodes(&self) -> &[WideNode] {
        let first = constants::WIDE_HEADER_TEXELS as usize;
        bytemuck::cast_slice(&self.texels[first..first + NODE_TEXELS * self.nodes])
    }

    /// Triangles in the order of leaves.
    pub fn triangles(&self) -> &[Bvh2Triangle] {
        bytemuck::cast_slice(&self.texels[first_triangle_texel(self.nodes)..])
    }

    /// Box of all triangles; a point where there are none.
    pub fn bounds(&self) -> Aabb {
        let header: Header = bytemuck::cast([self.texels[0], self.texels[1]]);
        Aabb {
            lower: header.lower,
            upper: header.upper,
        }
    }
}

/// Where triangles begin behind so many nodes.
fn first_triangle_texel(nodes: usize) -> usize {
    constants::WIDE_HEADER_TEXELS as usize + NODE_TEXELS * nodes
}

/// Texels of a tree.
fn texels_of(nodes: usize, triangles: usize) -> usize {
    first_triangle_texel(nodes) + constants::WIDE_TRIANGLE_TEXELS as usize * triangles
}

/// Counts nodes and leaves, and sums the SAH cost of decoded boxes.
fn measure(nodes: &[WideNode], bounds: &Aabb, statistics: &mut IndexStatistics) {
    let (mut cost, mut leaves) = (0.0, 0);
    for node in nodes {
        for slot in 0..SLOTS {
            let count = node.leaf(slot).1;
            let tests = if node.child(slot).is_some() { 1 } else { count };
            let [lower, upper] = node.bounds(slot);
            let e = upper - lower;
            cost += f64::from(tests) * (e.x * e.y + e.y * e.z + e.z * e.x);
            leaves += u64::from(count > 0);
        }
    }
    let root = bounds.half_area();
    statistics.nodes = nodes.len() as u64;
    statistics.leaves = leaves;
    statistics.sah_cost = if root > 0.0 { 1.0 + cost / root } else { 0.0 };
}

fn check_triangle_cost(settings: &WideSettings) -> Result<()> {
    let cost = settings.triangle_cost;
    if (0.0..=100.0).contains(&cost) {
        return Ok(());
    }
    Err(Error::setting("wide.triangle_cost", cost, "is outside 0..=100"))
}

impl RayIndex for WideBvh {
    fn name(&self) -> &'static str {
        "wide"
    }

    fn statistics(&self) -> IndexStatistics {
        self.statistics
    }

    fn stages(&self) -> BuildStages {
        self.stages
    }

    fn texels(&self) -> &[[u32; 4]] {
        &self.texels
    }

    fn device_traversal(&self) -> DeviceTraversal {
        DeviceTraversal::Wide
    }

    fn closest_hit_filtered(&self, ray: &Ray, filter: CandidateFilter<'_>, counters: &mut TraversalCounters) -> Hit {
        let mut traversal = WideTraversal::closest(ray);
        traversal.run(self, ray, u64::MAX, filter, counters);
        traversal.hit
    }

    fn any_hit_filtered(&self, ray: &Ray, filter: CandidateFilter<'_>, counters: &mut TraversalCounters) -> bool {
        let mut traversal = WideTraversal::any(ray);
        traversal.run(self, ray, u64::MAX, filter, counters);
        traversal.hit.is_hit()
    }
}

#[cfg(test)]
mod estimates;

#[cfg(test)]
mod tests;

/// Rows of the catalogue.
pub(crate) const ROWS: &[Row] = &[Row {
    id: "CL-WIDE",
    name: "ray index: BVH of eight children a node, in 80 bytes",
    role: Role::Kernel,
    limits: "Boxes are up to 1/127 of their node's size larger than what they hold; refitting keeps the tree's shape, however things move; the device collapses the tree that codes spell, which is not optimised.",
    sources: &[sources::YLITIE_2017.whole()],
    shaders: &[
        "shaders/accel/wide.glsl",
        "shaders/accel/wide_costs.comp",
        "shaders/accel/wide_level.comp",
        "shaders/accel/wide_collapse.comp",
        "shaders/accel/wide_refit_triangles.comp",
        "shaders/accel/wide_refit.comp",
    ],
    tests: &[
        "engine/src/accel/wide/tests.rs::traversal_equals_trying_all_triangles_bit_for_bit",
        "engine/src/accel/wide/tests.rs::decoded_boxes_contain_what_they_are_made_of",
        "engine/src/accel/wide/tests.rs::spans_of_decoded_boxes_keep_their_stated_error",
        "engine/src/accel/wide/tests.rs::stopped_traversals_go_on_without_loss_or_repetition",
        "engine/src/accel/wide/tests.rs::no_other_collapse_costs_less",
        "engine/src/accel/wide/tests.rs::refitted_trees_have_the_hits_of_all_triangles",
        "tests/tests/accel/wide.rs::kernels_are_their_twins",
        "tests/tests/accel/wide.rs::rays_that_a_quota_stops_go_on",
        "tests/tests/accel/wide.rs::kernels_give_a_million_rays_the_hits_of_the_binary_tree",
        "tests/tests/accel/wide.rs::device_builds_are_the_twins",
        "tests/tests/accel/wide.rs::host_trees_are_collapsed_by_the_device_as_by_the_host",
        "tests/tests/accel/wide.rs::a_build_and_rays_go_into_one_submission",
        "tests/tests/accel/wide.rs::device_refits_are_the_twins",
        "tests/tests/accel/wide.rs::refits_follow_copies_in_one_submission",
        "tests/tests/hard_cases.rs::ray_indexes_answer_as_a_search_through_all_triangles",
        "tests/tests/accel/index_choice.rs::pictures_are_the_same_to_the_bit_with_every_index",
    ],
    experiment: "clerestory index --peers",
    api: &[
        "clerestory::accel::wide::WideBvh",
        "clerestory::accel::wide::refit",
        "clerestory::accel::wide::WideBuilder",
        "clerestory::accel::wide::WideRefitter",
    ],
    settings: &[
        "clerestory::accel::wide::WideSettings",
        "clerestory render --index wide",
        "clerestory render --index wide-device",
    ],
    ..Row::of(file!())
}];
