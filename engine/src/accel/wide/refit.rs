//! A wide tree whose triangles have moved: grids and boxes anew from the leaves up, while nodes, slots and triangles stay where they are.
//!
//! Guarantees: a refit of triangles that have not moved gives the same bytes; boxes contain what they hold, as after a build, so that hits are those of
//! trying all triangles. Twin of the kernels `wide_refit_triangles` and `wide_refit`.

use super::frame::set_boxes;
use super::{SLOTS, WideBvh, WideNode, texels_of};
use crate::Result;
use crate::accel::bvh2::Bvh2Triangle;
use crate::accel::lbvh::{check_moved, moved_corners};
use crate::accel::{Aabb, BuildStages, IndexStatistics, RayIndex};
use crate::gpu::{Gpu, TexelView};
use glam::Vec3;

/// Refits an index to its triangles where they are now: the tree stays what it was, grids, boxes and corners are new. Triangles that were left
/// out stay so, and those that have lost their area shrink to points. Best where little has moved, since boxes grow where neighbours part.
///
/// # Errors
/// [`Error::Setting`](crate::Error::Setting) for another number of triangles, or for one that has moved out of range.
pub fn refit(index: &WideBvh, triangles: &[[Vec3; 3]]) -> Result<WideBvh> {
    let before = index.statistics();
    check_moved(&before, index.triangles(), triangles)?;
    let indices: Vec<u32> = index.triangles().iter().map(|t| t.index).collect();
    let corners = moved_corners(&indices, triangles);
    let moved: Vec<Bvh2Triangle> = corners
        .into_iter()
        .zip(indices)
        .map(|(corners, index)| Bvh2Triangle::new(corners, index))
        .collect();
    let mut nodes = index.nodes().to_vec();
    let mut bounds = index.bounds();
    if !moved.is_empty() {
        bounds = refit_nodes(&mut nodes, 0, &moved, 0);
    }
    let statistics = IndexStatistics {
        max_depth: before.max_depth,
        ..before.of_triangles()
    };
    let stages = BuildStages::default();
    Ok(WideBvh::assembled(&nodes, &moved, &bounds, statistics, stages))
}

/// Refits a tree in the device's memory, whose statistics these are; the host does it, so the tree is read back and uploaded.
///
/// # Errors
/// As [`refit`]; [`Error::DeviceLost`](crate::Error::DeviceLost), [`Error::OutOfMemory`](crate::Error::OutOfMemory).
pub(crate) fn refit_resident(
    gpu: &Gpu,
    texels: &TexelView,
    statistics: IndexStatistics,
    triangles: &[[Vec3; 3]],
) -> Result<()> {
    let nodes = statistics.nodes as usize;
    let count = texels_of(nodes, statistics.triangles as usize);
    let words = gpu.read(texels.buffer().view(), count)?;
    let before = WideBvh::of_texels(words, nodes, statistics, BuildStages::default());
    gpu.upload(texels.buffer(), 0, refit(&before, triangles)?.texels())
}

/// Sets the boxes of all nodes of a tree, from the triangles up: of nodes whose first, the root, has the number `first_node`, over triangles whose first has
/// the number `first_triangle`. A node that holds nothing stays as it is. The box of everything; empty without triangles.
pub(in crate::accel) fn refit_nodes(
    nodes: &mut [WideNode],
    first_node: u32,
    triangles: &[Bvh2Triangle],
    first_triangle: u32,
) -> Aabb {
    let mut all = vec![Aabb::EMPTY; nodes.len()];
    // Children come behind their parents.
    for (place, node) in nodes.iter_mut().enumerate().rev() {
        let mut boxes = [None; SLOTS];
        for (slot, bounds) in boxes.iter_mut().enumerate() {
            let (first, count) = node.leaf(slot);
            *bounds = match node.child(slot) {
                Some(child) => Some(all[(child - first_node) as usize]),
                None if count == 0 => None,
                None => Some(bounds_of(
                    &triangles[(first - first_triangle) as usize..][..count as usize],
                )),
            };
        }
        let held = || (0..SLOTS).zip(boxes).filter_map(|(slot, bounds)| Some((slot, bounds?)));
        all[place] = held().fold(Aabb::EMPTY, |all, (_, bounds)| all.union(bounds));
        if held().next().is_some() {
            set_boxes(node, &all[place], held());
        }
    }
    all.first().copied().unwrap_or(Aabb::EMPTY)
}

/// The box of triangles; adding zero leaves one kind of it.
fn bounds_of(triangles: &[Bvh2Triangle]) -> Aabb {
    let corners = triangles.iter().flat_map(|triangle| triangle.corners);
    corners.fold(Aabb::EMPTY, |bounds, corner| bounds.with_point(corner + Vec3::ZERO))
}
