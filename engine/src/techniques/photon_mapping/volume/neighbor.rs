//! Kernels in media by neighbours: as wide as the n-th of the other events of a medium is far.
//!
//! Source: B. Fabianowski, "Interactive Manycore Photon Mapping", PhD thesis, Trinity College Dublin, 2011, §3.4.2.4 and §7.3.4, whose original extrapolates from fewer
//! neighbours to the 85th; here they are exact. Guarantee: radii are those of all pairs of events by the same arithmetic, on any number of threads.

use crate::Result;
use crate::accel::photon_map::complete_bvh::QueryCounters;
use crate::accel::yardstick::left_balanced::LeftBalancedTree;
use crate::accel::yardstick::point_tree::PointTree;
use glam::Vec3;
use rayon::prelude::*;
use std::collections::BTreeMap;

/// Distance from each event, a place and the number of its medium, to the `neighbors`-th nearest other event of the same medium, m; `greatest` where there are not so
/// many within that.
///
/// # Errors
/// [`Error::LimitExceeded`](crate::Error::LimitExceeded) for more events than a tree of them can hold.
pub fn neighbor_radii(events: &[(Vec3, u32)], neighbors: usize, greatest: f32) -> Result<Vec<f32>> {
    let mut of_media: BTreeMap<u32, Vec<u32>> = BTreeMap::new();
    for (index, (_, medium)) in events.iter().enumerate() {
        of_media.entry(*medium).or_default().push(index as u32);
    }
    let mut radii = vec![greatest; events.len()];
    for indices in of_media.values() {
        let places: Vec<Vec3> = indices.iter().map(|index| events[*index as usize].0).collect();
        let tree = LeftBalancedTree::build(&places)?;
        let distance = |place: &Vec3| {
            // Itself, or one in its place, comes first.
            let near = tree.nearest(*place, neighbors + 1, greatest, &mut QueryCounters::default());
            near.get(neighbors).map_or(greatest, |last| last.squared.sqrt())
        };
        let found: Vec<f32> = places.par_iter().map(distance).collect();
        for (index, radius) in indices.iter().zip(found) {
            radii[*index as usize] = radius;
        }
    }
    Ok(radii)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_random::Random;

    #[test]
    fn radii_are_those_of_all_pairs() {
        let mut random = Random(31);
        // Unevenly spread, in two media, with some in one place.
        let mut events: Vec<(Vec3, u32)> = (0..600)
            .map(|i| (random.vector() * random.unit().powi(2), u32::from(i % 5 == 0)))
            .collect();
        for i in 0..20 {
            events.push(events[i]);
        }
        for (neighbors, greatest) in [(1, 9.0), (85, 9.0), (85, 0.25), (1000, 9.0)] {
            let radii = neighbor_radii(&events, neighbors, greatest).unwrap();
            let mut at_most = 0;
            for (i, (place, medium)) in events.iter().enumerate() {
                let mut others: Vec<f32> = events
                    .iter()
                    .enumerate()
                    .filter(|(j, other)| *j != i && other.1 == *medium)
                    .map(|(_, other)| (other.0 - *place).length_squared().sqrt())
                    .collect();
                others.sort_by(f32::total_cmp);
                let expected = others.get(neighbors - 1).map_or(greatest, |far| far.min(greatest));
                assert!(
                    (radii[i] - expected).abs() <= 2.0 * f32::EPSILON * expected,
                    "{neighbors} {i}: {} {expected}",
                    radii[i]
                );
                at_most += u32::from(radii[i] == greatest);
            }
            assert_eq!(at_most == 620, neighbors == 1000, "{neighbors} {greatest}: {at_most}");
        }
        assert!(neighbor_radii(&[], 85, 1.0).unwrap().is_empty());
    }
}
