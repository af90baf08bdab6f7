//! Photon maps of kd-trees over points.

use clerestory::accel::photon_map::complete_bvh::QueryCounters;
use clerestory::accel::yardstick::point_tree::PointTree;
use glam::Vec3;

use super::photon_kernels::{Kernels, Records, Work};

/// A kd-tree with what its points stand for, in the order of its nodes.
pub struct PointMap<T> {
    tree: T,
    records: Records,
    reach: f32,
}

impl<T: PointTree> PointMap<T> {
    /// Of a tree over the centres of these kernels.
    pub fn new(kernels: &Kernels, tree: T) -> Self {
        let order = (0..tree.count()).map(|place| tree.node(place).point as usize);
        Self {
            records: kernels.in_order(order),
            reach: kernels.reach(),
            tree,
        }
    }

    /// Asks every point as near as the widest kernel reaches.
    pub fn gather(&self, point: Vec3, work: &mut Work) {
        let (mut tests, mut contributions) = (0, 0);
        self.tree.within(point, self.reach, &mut work.tree, |near| {
            tests += 1;
            contributions += u64::from(self.records.holds(near.place as usize, point));
        });
        work.tests += tests;
        work.contributions += contributions;
    }

    /// The points as near as that which are nearest to each of these, so many at most, by index, and the work.
    pub fn nearest(&self, points: &[Vec3], most: usize) -> (Vec<Vec<u32>>, QueryCounters) {
        let mut counters = QueryCounters::default();
        let indices = |point: &Vec3| {
            let found = self.tree.nearest(*point, most, self.reach, &mut counters);
            found.iter().map(|near| near.point).collect::<Vec<u32>>()
        };
        let found = points.iter().map(indices).collect();
        (found, counters)
    }

    /// Bytes of the nodes.
    pub fn bytes(&self) -> u64 {
        T::NODE_BYTES * u64::from(self.tree.count())
    }
}

#[cfg(test)]
mod tests {
    use super::super::photon_kernels::{Map, Shape, skewed_records};
    use super::super::photon_scenes::{CASES, Surfaces};
    use super::*;
    use crate::random::Random;
    use clerestory::accel::yardstick::left_balanced::LeftBalancedTree;
    use clerestory::accel::yardstick::voxel_volume::VoxelVolumeTree;

    /// All maps over kernels, at points.
    fn check(kernels: &Kernels, points: &[Vec3]) {
        let boxes = Map::new(kernels, &kernels.linear(8)).unwrap();
        let centres = kernels.centres();
        let balanced = PointMap::new(kernels, LeftBalancedTree::build(&centres).unwrap());
        let by_volume = VoxelVolumeTree::build(&centres, kernels.reach()).unwrap();
        let by_volume = PointMap::new(kernels, by_volume);
        let mut sum = 0;
        for point in points {
            let mut works = [Work::default(); 3];
            boxes.gather_compact(*point, &mut works[0]);
            balanced.gather(*point, &mut works[1]);
            by_volume.gather(*point, &mut works[2]);
            assert_eq!(works.map(|work| work.contributions), [works[0].contributions; 3]);
            assert_eq!(works[1].tests, works[2].tests);
            assert!(works[1].tests <= works[1].tree.nodes);
            sum += works[0].contributions;
        }
        assert!(sum > 0, "no kernel was found");
        assert_eq!(balanced.nearest(points, 9).0, by_volume.nearest(points, 9).0);
    }

    #[test]
    fn every_point_lies_in_the_kernels_of_the_compact_map() {
        let case = &CASES[0];
        let surfaces = Surfaces::load(case.scene).unwrap();
        let seen = surfaces.seen(12).unwrap();
        for shape in [Shape::Spheres, Shape::Ellipsoids] {
            check(&Kernels::trace(&surfaces, case.light, 1000, 40.0, shape), &seen);
        }
        // Skewed footprints, the widest of which reach farther than their axes.
        let mut random = Random::new(15);
        let kernels = Kernels::of_records(&skewed_records(&mut random, 400));
        let points: Vec<Vec3> = (0..300).map(|_| 0.3 * random.direction().as_vec3()).collect();
        check(&kernels, &points);
    }
}
