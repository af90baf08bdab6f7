//! What changes when instances move or meshes are refitted: the tree over the instances is made anew, and a mesh's boxes.

use super::{
    HEADER_TEXELS, Header, INSTANCE_TEXELS, InstanceNode, InstanceRecord, NODE_TEXELS, TwoLevelBvh, parts_of, top,
};
use crate::accel::bvh2::Bvh2Triangle;
use crate::accel::lbvh::{check_moved, moved_corners};
use crate::accel::wide::WideNode;
use crate::accel::wide::refit::refit_nodes;
use crate::accel::{Aabb, IndexStatistics};
use crate::{Error, Result};
use bytemuck::Zeroable;
use glam::{DAffine3, Vec3};

impl TwoLevelBvh {
    /// The tree over the instances where they are now.
    pub(super) fn make_top(&mut self) {
        let boxes: Vec<Aabb> = self.transforms.iter().map(|transform| transform.bounds).collect();
        let top = top::build(&boxes, &self.settings.binary);
        let capacity = top::capacity(boxes.len());
        let instances_at = self.instances_at();
        let header = Header {
            lower: top.bounds.lower,
            triangles: (instances_at + INSTANCE_TEXELS * boxes.len()) as u32,
            upper: top.bounds.upper,
            instances: instances_at as u32,
            top: capacity as u32,
            count: boxes.len() as u32,
            zero: [0; 2],
        };
        let mut nodes = top.nodes;
        nodes.resize(capacity, WideNode::zeroed());
        let mut first_node = capacity as u32;
        let mut records = Vec::with_capacity(boxes.len());
        for (i, (placement, transform)) in self.placements.iter().zip(&self.transforms).enumerate() {
            let mesh = &self.meshes[placement.mesh as usize];
            let place = top.places[i];
            let node = InstanceNode {
                inverse_x: transform.inverse[0],
                flags: transform.flags(),
                inverse_y: transform.inverse[1],
                parent: nodes[place as usize].parent,
                inverse_z: transform.inverse[2],
                root: mesh.root,
                translation: transform.translation,
                instance: i as u32,
                slack: transform.slack,
                zero: 0,
            };
            nodes[place as usize] = bytemuck::cast(node);
            records.push(InstanceRecord {
                x: transform.rows[0],
                first: if mesh.has_names { 0 } else { placement.first },
                y: transform.rows[1],
                first_node,
                z: transform.rows[2],
                place,
            });
            first_node += mesh.nodes;
        }
        self.texels[..HEADER_TEXELS].copy_from_slice(&bytemuck::cast::<Header, [[u32; 4]; HEADER_TEXELS]>(header));
        let top_end = HEADER_TEXELS + NODE_TEXELS * capacity;
        self.texels[HEADER_TEXELS..top_end].copy_from_slice(bytemuck::cast_slice(&nodes));
        let records: &[[u32; 4]] = bytemuck::cast_slice(&records);
        self.texels[instances_at..instances_at + records.len()].copy_from_slice(records);
        self.work.tops += 1;
        self.statistics = self.measured(&top.bounds, top.area, top.depth);
    }

    /// Counts over all instances, but nodes, leaves and bytes as they are stored, nodes with the places over the instances; the cost with that of each mesh's tree below its instances.
    fn measured(&self, bounds: &Aabb, area: f64, depth: u32) -> IndexStatistics {
        let root = bounds.half_area();
        let mut all = IndexStatistics {
            bytes: size_of_val(self.texels.as_slice()) as u64,
            ..IndexStatistics::default()
        };
        let mut cost = area;
        let mut deepest = 0;
        for (placement, transform) in self.placements.iter().zip(&self.transforms) {
            let mesh = &self.meshes[placement.mesh as usize].statistics;
            all.triangles += mesh.triangles;
            all.excluded_range += mesh.excluded_range;
            all.excluded_degenerate += mesh.excluded_degenerate;
            cost += transform.bounds.half_area() * mesh.sah_cost;
            deepest = deepest.max(mesh.max_depth);
        }
        for mesh in &self.meshes {
            all.nodes += mesh.statistics.nodes;
            all.leaves += mesh.statistics.leaves;
        }
        all.nodes += top::capacity(self.placements.len()) as u64;
        all.max_depth = depth + 1 + deepest;
        all.sah_cost = if root > 0.0 { 1.0 + cost / root } else { 0.0 };
        all
    }

    /// Moves instances, by their numbers, and makes the tree over them anew. [`Self::top_texels`] and [`Self::instance_texels`] have changed.
    ///
    /// # Errors
    /// [`Error::Setting`] for an instance that does not exist, and for a transform that rays cannot be traced through; nothing has moved then.
    pub fn move_instances(&mut self, moves: &[(usize, DAffine3)]) -> Result<()> {
        let mut moved = Vec::with_capacity(moves.len());
        for (instance, transform) in moves {
            if *instance >= self.placements.len() {
                return Err(Error::setting("instance", instance, "does not exist"));
            }
            moved.push(self.transform(*instance, transform)?);
        }
        for ((instance, transform), found) in moves.iter().zip(moved) {
            self.placements[*instance].transform = *transform;
            self.transforms[*instance] = found;
        }
        self.make_top();
        Ok(())
    }

    /// Refits the tree of a mesh to its triangles where they are now, and makes the tree over the instances anew. Triangles that were left out stay
    /// so, and those that have lost their area shrink to points. Statistics keep the cost of the tree as it was built. [`Self::mesh_texels`] have changed beside what [`Self::move_instances`] changes.
    ///
    /// # Errors
    /// [`Error::Setting`] for a mesh that does not exist, for another number of triangles, for one that has moved out of range, and for a mesh that its
    /// instances can then not place; the index is as it was.
    pub fn refit_mesh(&mut self, mesh: usize, triangles: &[[Vec3; 3]]) -> Result<()> {
        let Some(tree) = self.meshes.get(mesh) else {
            return Err(Error::setting("mesh", mesh, "does not exist"));
        };
        if tree.has_names {
            return Err(Error::setting("mesh", mesh, "has triangles with names of their own"));
        }
        let ranges = self.mesh_texels(mesh);
        let old = ranges.clone().map(|range| self.texels[range].to_vec());
        let mut moved: Vec<Bvh2Triangle> = bytemuck::cast_slice(&old[1]).to_vec();
        check_moved(&tree.statistics, &moved, triangles)?;
        let indices: Vec<u32> = moved.iter().map(|triangle| triangle.index).collect();
        for (triangle, corners) in moved.iter_mut().zip(moved_corners(&indices, triangles)) {
            triangle.corners = corners;
        }
        let (root, first_triangle) = (tree.root, tree.first_triangle);
        let [nodes_range, triangles_range] = ranges;
        let nodes: &mut [WideNode] = bytemuck::cast_slice_mut(&mut self.texels[nodes_range.clone()]);
        refit_nodes(nodes, root, &moved, first_triangle);
        let parts = parts_of(nodes);
        self.texels[triangles_range].copy_from_slice(bytemuck::cast_slice(&moved));
        let parts = std::mem::replace(&mut self.meshes[mesh].parts, parts);
        let found: Result<Vec<_>> = (0..self.placements.len())
            .filter(|i| self.placements[*i].mesh as usize == mesh)
            .map(|i| Ok((i, self.transform(i, &self.placements[i].transform)?)))
            .collect();
        match found {
            Ok(found) => found
                .into_iter()
                .for_each(|(i, transform)| self.transforms[i] = transform),
            Err(error) => {
                self.meshes[mesh].parts = parts;
                for (range, old) in self.mesh_texels(mesh).into_iter().zip(old) {
                    self.texels[range].copy_from_slice(&old);
                }
                return Err(error);
            }
        }
        self.work.refits += 1;
        self.make_top();
        Ok(())
    }
}
