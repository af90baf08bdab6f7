//! Index of two levels: a wide tree for each mesh, in the mesh's own space, and one over the instances that place them.
//!
//! Sources: I. Wald, C. Benthin, P. Slusallek, "Distributed Interactive Ray Tracing of Dynamic Scenes", PVG 2003 (trees of objects under a tree over
//! their instances); the trees are those of [`wide`](super::wide).
//!
//! Hits name triangles by numbers that are consecutive over an instance: its first number plus the triangle's place in the mesh. So a hit says
//! what it would if all instances had been flattened to world space, and [`transform`] says what images that world consists of. Guarantees: hits
//! are, to the bit, those of trying all images in order; a mesh's trees, boxes and triangles are there once, and an instance takes
//! [`INSTANCE_BYTES`] at most; moving instances makes the tree above anew and nothing else, and refitting a mesh leaves all other meshes alone; the
//! same bytes whatever the number of threads.

mod changes;
pub(crate) mod top;
pub mod transform;
pub mod traverse;

pub use transform::InstanceTransform;
pub use traverse::TwoLevelTraversal;

use super::bvh2::Bvh2Triangle;
use super::stages::Stopwatch;
use super::wide::{WideBvh, WideNode, WideSettings};
use super::{
    Aabb, BuildStages, CandidateFilter, DeviceTraversal, Hit, IndexStatistics, NO_HIT, Ray, RayIndex, TraversalCounters,
};
use crate::catalogue::{Role, Row, sources};
use crate::gpu::shaders::constants;
use crate::{Error, Result};
use bytemuck::{Pod, Zeroable};
use glam::{DAffine3, DVec3, Vec3};
use std::ops::Range;

/// Most instances: a search for one among them takes [`constants::INSTANCE_SEARCH_STEPS`] steps.
pub const MAX_INSTANCES: usize = 1 << constants::INSTANCE_SEARCH_STEPS;

/// Bytes of an instance: two nodes of the tree above, at most, and its record.
pub const INSTANCE_BYTES: u64 = (2 * size_of::<WideNode>() + size_of::<InstanceRecord>()) as u64;

const HEADER_TEXELS: usize = constants::TWO_LEVEL_HEADER_TEXELS as usize;
const NODE_TEXELS: usize = constants::WIDE_NODE_TEXELS as usize;
const INSTANCE_TEXELS: usize = constants::TWO_LEVEL_INSTANCE_TEXELS as usize;
const TRIANGLE_TEXELS: usize = constants::WIDE_TRIANGLE_TEXELS as usize;

const _: () = assert!(
    size_of::<Header>() == 16 * HEADER_TEXELS
        && size_of::<InstanceNode>() == 16 * NODE_TEXELS
        && size_of::<InstanceRecord>() == 16 * INSTANCE_TEXELS,
    "the kernels have another layout"
);

/// What the texels begin with (48 bytes).
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
#[repr(C)]
struct Header {
    lower: Vec3,
    /// Texel where the triangles begin.
    triangles: u32,
    upper: Vec3,
    /// Texel where the instances' records begin.
    instances: u32,
    /// Places for nodes of the tree above.
    top: u32,
    count: u32,
    zero: [u32; 2],
}

/// What stands in the place of a node where a ray enters an instance (80 bytes).
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub(super) struct InstanceNode {
    pub inverse_x: Vec3,
    pub flags: u32,
    pub inverse_y: Vec3,
    /// As [`WideNode::parent`].
    pub parent: u32,
    pub inverse_z: Vec3,
    /// Root of the mesh's tree.
    pub root: u32,
    pub translation: Vec3,
    pub instance: u32,
    pub slack: Vec3,
    pub zero: u32,
}

/// What is known of an instance by its number (48 bytes).
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub(super) struct InstanceRecord {
    pub x: Vec3,
    /// Number of its first triangle; 0 where the mesh's triangles have numbers of their own.
    pub first: u32,
    pub y: Vec3,
    /// Number of the mesh's root among the nodes of all instances, by which stopped rays are known.
    pub first_node: u32,
    pub z: Vec3,
    /// Its place among the nodes of the tree above.
    pub place: u32,
}

/// A mesh to build a tree of.
#[derive(Debug, Clone, Copy)]
pub struct MeshGeometry<'a> {
    /// Its triangles, in its own space.
    pub triangles: &'a [[Vec3; 3]],
    /// How hits name each of them, where it isn't by its place, by numbers below 2³² − 1: only for a mesh that is placed once.
    pub names: Option<&'a [u32]>,
}

/// A mesh in a place.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Placement {
    /// Which mesh.
    pub mesh: u32,
    /// Of its space to the world.
    pub transform: DAffine3,
    /// How hits name its first triangle; without effect on meshes with names.
    pub first: u32,
}

impl Placement {
    /// A mesh that is where it is, with its triangles named by their places.
    pub fn identity(mesh: u32) -> Self {
        Self {
            mesh,
            transform: DAffine3::IDENTITY,
            first: 0,
        }
    }
}

/// What was built, exactly.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, serde::Serialize)]
pub struct TwoLevelWork {
    /// Trees of meshes, built.
    pub meshes: u64,
    /// Trees of meshes, refitted.
    pub refits: u64,
    /// Trees over instances, built.
    pub tops: u64,
}

/// A mesh's tree in the texels.
#[derive(Debug, Clone)]
struct MeshTree {
    /// Number of its root, and how many nodes it has.
    root: u32,
    nodes: u32,
    /// Place of its first triangle, and how many it has.
    first_triangle: u32,
    triangles: u32,
    /// Boxes of the root's slots, or the root's box.
    parts: Vec<[DVec3; 2]>,
    statistics: IndexStatistics,
    has_names: bool,
}

/// An index of two levels.
#[derive(Debug, Clone)]
pub struct TwoLevelBvh {
    texels: Vec<[u32; 4]>,
    meshes: Vec<MeshTree>,
    placements: Vec<Placement>,
    transforms: Vec<InstanceTransform>,
    settings: WideSettings,
    statistics: IndexStatistics,
    stages: BuildStages,
    work: TwoLevelWork,
}

/// What a mesh's images lie in, by parts: boxes of its tree's root.
fn parts_of(tree: &[WideNode]) -> Vec<[DVec3; 2]> {
    let root = &tree[0];
    let held = |slot: &usize| root.child(*slot).is_some() || root.leaf(*slot).1 > 0;
    let parts: Vec<_> = (0..super::wide::SLOTS)
        .filter(held)
        .map(|slot| root.bounds(slot))
        .collect();
    if parts.is_empty() {
        vec![[DVec3::ZERO; 2]]
    } else {
        parts
    }
}

impl TwoLevelBvh {
    /// Builds a tree for each mesh and one over the placements. Deterministic whatever the number of threads.
    ///
    /// # Errors
    /// [`Error::Setting`] for settings out of range, for a placement of a mesh that does not exist or by a transform that rays cannot be traced
    /// through ([`InstanceTransform::of`]), and for a mesh with names that is placed more than once, has another number of names than of triangles, or
    /// a name that is not below 2³² − 1; [`Error::LimitExceeded`] for more than [`MAX_INSTANCES`], for triangles whose numbers are not below 2³² − 1,
    /// and for more nodes than numbers of 32 bits tell apart over all instances.
    pub fn build(meshes: &[MeshGeometry<'_>], placements: &[Placement], settings: &WideSettings) -> Result<Self> {
        let top = top::capacity(placements.len());
        check_limit(
            "instances of a ray index",
            placements.len() as u64,
            MAX_INSTANCES as u64,
        )?;
        check_names(meshes)?;
        let trees = meshes
            .iter()
            .map(|mesh| WideBvh::build(mesh.triangles, settings))
            .collect::<Result<Vec<_>>>()?;
        let mut stages = BuildStages::default();
        for tree in &trees {
            stages = stages.plus(&tree.stages());
        }
        let mut watch = Stopwatch::start();
        let nodes = top as u64 + trees.iter().map(|tree| tree.nodes().len() as u64).sum::<u64>();
        // Parents are numbered with three bits more.
        check_limit(
            "nodes of a ray index",
            nodes,
            u64::from(u32::MAX >> constants::WIDE_SLOT_BITS),
        )?;
        let instances_at = HEADER_TEXELS + NODE_TEXELS * nodes as usize;
        let triangles_at = instances_at + INSTANCE_TEXELS * placements.len();
        let triangles: usize = trees.iter().map(|tree| tree.triangles().len()).sum();
        let mut texels = vec![[0; 4]; triangles_at + TRIANGLE_TEXELS * triangles];
        let mut found = Vec::with_capacity(meshes.len());
        let (mut root, mut first_triangle) = (top as u32, 0u32);
        for (mesh, tree) in meshes.iter().zip(&trees) {
            let at = HEADER_TEXELS + NODE_TEXELS * root as usize;
            let to = &mut texels[at..at + NODE_TEXELS * tree.nodes().len()];
            to.copy_from_slice(bytemuck::cast_slice(tree.nodes()));
            for (i, node) in bytemuck::cast_slice_mut::<_, WideNode>(to).iter_mut().enumerate() {
                node.children += root;
                node.triangles += first_triangle;
                if i > 0 {
                    node.parent += root << constants::WIDE_SLOT_BITS;
                }
            }
            let at = triangles_at + TRIANGLE_TEXELS * first_triangle as usize;
            let to = &mut texels[at..at + TRIANGLE_TEXELS * tree.triangles().len()];
            to.copy_from_slice(bytemuck::cast_slice(tree.triangles()));
            if let Some(names) = mesh.names {
                for triangle in bytemuck::cast_slice_mut::<_, Bvh2Triangle>(to) {
                    triangle.index = names[triangle.index as usize];
                }
            }
            found.push(MeshTree {
                root,
                nodes: tree.nodes().len() as u32,
                first_triangle,
                triangles: tree.triangles().len() as u32,
                parts: parts_of(tree.nodes()),
                statistics: tree.statistics(),
                has_names: mesh.names.is_some(),
            });
            root += tree.nodes().len() as u32;
            first_triangle += tree.triangles().len() as u32;
        }
        let mut built = Self {
            texels,
            meshes: found,
            placements: placements.to_vec(),
            transforms: Vec::new(),
            settings: *settings,
            statistics: IndexStatistics::default(),
            stages,
            work: TwoLevelWork {
                meshes: meshes.len() as u64,
                ..TwoLevelWork::default()
            },
        };
        built.check_numbers()?;
        built.transforms = (0..placements.len())
            .map(|i| built.transform(i, &placements[i].transform))
            .collect::<Result<_>>()?;
        built.stages.layout += watch.lap();
        built.make_top();
        built.stages.hierarchy += watch.lap();
        Ok(built)
    }

    /// Refuses placements whose triangles or nodes have no numbers.
    fn check_numbers(&self) -> Result<()> {
        let mut named = vec![false; self.meshes.len()];
        let mut nodes = top::capacity(self.placements.len()) as u64;
        for (i, placement) in self.placements.iter().enumerate() {
            let Some(mesh) = self.meshes.get(placement.mesh as usize) else {
                return Err(Error::setting(
                    format!("placements[{i}].mesh"),
                    placement.mesh,
                    "does not exist",
                ));
            };
            if mesh.has_names && std::mem::replace(&mut named[placement.mesh as usize], true) {
                let cause = "has names for its triangles and is placed before";
                return Err(Error::setting(format!("placements[{i}].mesh"), placement.mesh, cause));
            }
            let statistics = &mesh.statistics;
            let triangles = statistics.triangles + statistics.excluded_range + statistics.excluded_degenerate;
            let end = u64::from(placement.first) + triangles;
            check_limit("triangles of all instances", end, u64::from(u32::MAX))?;
            nodes += u64::from(mesh.nodes);
        }
        check_limit("nodes of all instances", nodes, u64::from(u32::MAX))
    }

    /// What a transform would make of a placement that exists.
    ///
    /// # Errors
    /// [`Error::Setting`] for one that rays cannot be traced through.
    pub(crate) fn transform(&self, placement: usize, transform: &DAffine3) -> Result<InstanceTransform> {
        let mesh = &self.meshes[self.placements[placement].mesh as usize];
        InstanceTransform::of(transform, &mesh.parts).ok_or_else(|| {
            let cause = "is not a transform that rays can be traced through";
            Error::setting(
                format!("placements[{placement}].transform"),
                format!("{transform:?}"),
                cause,
            )
        })
    }

    /// What was built so far.
    pub fn work(&self) -> TwoLevelWork {
        self.work
    }

    /// The placements as they are now.
    pub fn placements(&self) -> &[Placement] {
        &self.placements
    }

    /// The transforms of the placements.
    pub fn transforms(&self) -> &[InstanceTransform] {
        &self.transforms
    }

    /// Box of all images; a point where there are none.
    pub fn bounds(&self) -> Aabb {
        let header = self.header();
        Aabb {
            lower: header.lower,
            upper: header.upper,
        }
    }

    /// Texels of the header and the tree over the instances.
    pub fn top_texels(&self) -> Range<usize> {
        0..HEADER_TEXELS + NODE_TEXELS * top::capacity(self.placements.len())
    }

    /// Texels of the instances' records.
    pub fn instance_texels(&self) -> Range<usize> {
        let first = self.instances_at();
        first..first + INSTANCE_TEXELS * self.placements.len()
    }

    /// Texels of a mesh's nodes and triangles.
    ///
    /// # Panics
    /// For a mesh that does not exist.
    pub fn mesh_texels(&self, mesh: usize) -> [Range<usize>; 2] {
        let tree = &self.meshes[mesh];
        let nodes = HEADER_TEXELS + NODE_TEXELS * tree.root as usize;
        let triangles = self.instance_texels().end + TRIANGLE_TEXELS * tree.first_triangle as usize;
        [
            nodes..nodes + NODE_TEXELS * tree.nodes as usize,
            triangles..triangles + TRIANGLE_TEXELS * tree.triangles as usize,
        ]
    }

    /// Corners of the triangles that rays can meet in the mesh of a placement that exists, in the mesh's own space.
    pub(crate) fn corners_at(&self, placement: usize) -> impl Iterator<Item = [Vec3; 3]> {
        let mesh = &self.meshes[self.placements[placement].mesh as usize];
        let triangles = &self.triangles()[mesh.first_triangle as usize..][..mesh.triangles as usize];
        triangles.iter().map(|triangle| triangle.corners)
    }

    fn header(&self) -> Header {
        bytemuck::cast([self.texels[0], self.texels[1], self.texels[2]])
    }

    fn instances_at(&self) -> usize {
        let nodes: usize = self.meshes.iter().map(|mesh| mesh.nodes as usize).sum();
        HEADER_TEXELS + NODE_TEXELS * (top::capacity(self.placements.len()) + nodes)
    }

    /// Nodes of the tree above, then of the meshes' trees.
    fn nodes(&self) -> &[WideNode] {
        bytemuck::cast_slice(&self.texels[HEADER_TEXELS..self.instances_at()])
    }

    fn records(&self) -> &[InstanceRecord] {
        bytemuck::cast_slice(&self.texels[self.instance_texels()])
    }

    /// Triangles of all meshes, in the order of leaves.
    fn triangles(&self) -> &[Bvh2Triangle] {
        bytemuck::cast_slice(&self.texels[self.instance_texels().end..])
    }
}

/// Refuses names that are not one a triangle, and that which stands for no triangle.
fn check_names(meshes: &[MeshGeometry<'_>]) -> Result<()> {
    for (i, mesh) in meshes.iter().enumerate() {
        let Some(names) = mesh.names else { continue };
        if names.len() != mesh.triangles.len() {
            let cause = format!("are not one for each of {} triangles", mesh.triangles.len());
            return Err(Error::setting(format!("meshes[{i}].names"), names.len(), cause));
        }
        if let Some(place) = names.iter().position(|name| *name == NO_HIT) {
            let cause = "stands for no triangle";
            return Err(Error::setting(format!("meshes[{i}].names[{place}]"), NO_HIT, cause));
        }
    }
    Ok(())
}

fn check_limit(name: &str, value: u64, limit: u64) -> Result<()> {
    if value <= limit {
        return Ok(());
    }
    Err(Error::LimitExceeded {
        name: name.into(),
        value,
        limit_name: "index of two levels",
        limit,
    })
}

impl RayIndex for TwoLevelBvh {
    fn name(&self) -> &'static str {
        "two-level"
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
        DeviceTraversal::TwoLevel
    }

    fn closest_hit_filtered(&self, ray: &Ray, filter: CandidateFilter<'_>, counters: &mut TraversalCounters) -> Hit {
        let mut traversal = TwoLevelTraversal::closest(ray);
        traversal.run(self, ray, u64::MAX, filter, counters);
        traversal.hit
    }

    fn any_hit_filtered(&self, ray: &Ray, filter: CandidateFilter<'_>, counters: &mut TraversalCounters) -> bool {
        let mut traversal = TwoLevelTraversal::any(ray);
        traversal.run(self, ray, u64::MAX, filter, counters);
        traversal.hit.is_hit()
    }
}

#[cfg(test)]
mod tests;

/// Rows of the catalogue.
pub(crate) const ROWS: &[Row] = &[Row {
    id: "CL-TWO-LEVEL",
    name: "ray index of two levels: a wide BVH a mesh, and one over the instances that place them",
    role: Role::Kernel,
    limits: "Images of vertices are those of f32, within 4u of the coordinates and products that make them; instances that overlap are all entered; transforms more uneven than 2¹⁶ are refused; built on the host.",
    sources: &[
        sources::WALD_2003.whole(),
        sources::WALD_2008.whole(),
        sources::YLITIE_2017.whole(),
        sources::PHARR_2023.at("6.8"),
    ],
    shaders: &["shaders/accel/two_level.glsl"],
    tests: &[
        "engine/src/accel/two_level/tests.rs::traversal_equals_trying_all_images_bit_for_bit",
        "engine/src/accel/two_level/tests.rs::images_keep_their_stated_error",
        "engine/src/accel/two_level/tests.rs::no_ray_passes_between_the_triangles_of_an_instance",
        "engine/src/accel/two_level/tests.rs::stopped_traversals_go_on_without_loss_or_repetition",
        "engine/src/accel/two_level/tests.rs::moving_makes_the_tree_above_and_nothing_else",
        "engine/src/accel/two_level/tests.rs::refitted_meshes_have_the_hits_of_new_ones",
        "engine/src/accel/two_level/tests.rs::bytes_grow_with_meshes_and_little_with_instances",
        "engine/src/accel/two_level/tests.rs::names_that_no_hit_could_have_are_refused",
        "engine/src/transport/gpu_scene/kept/tests.rs::meshes_without_an_area_are_flattened",
        "tests/tests/accel/two_level.rs::kernels_are_their_twins",
        "tests/tests/accel/two_level.rs::rays_that_a_quota_stops_go_on",
        "tests/tests/accel/instances.rs::instances_without_rounding_have_the_pictures_of_flattened_ones",
        "tests/tests/accel/instances.rs::normals_and_colours_of_instances_are_those_of_flattened_ones",
        "tests/tests/accel/instances.rs::moved_instances_and_refitted_meshes_are_as_if_made_so",
        "tests/tests/accel/instances.rs::moves_are_held_against_the_box_by_their_triangles",
        "tests/tests/accel/instances.rs::memory_grows_with_meshes_and_little_with_instances",
        "tests/tests/accel/instances.rs::five_hundred_million_triangles_are_rendered_within_the_baseline",
        "tests/tests/accel/seams.rs::no_ray_is_lost_at_seams_in_any_index",
    ],
    experiment: "clerestory index",
    api: &["clerestory::accel::two_level::TwoLevelBvh"],
    settings: &["clerestory render --index two-level"],
    ..Row::of(file!())
}];
