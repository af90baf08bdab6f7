//! Which slot of a wide node a child goes to: that of the octant where it lies, seen from the node's centre, as far as others leave it free.
//!
//! Source: Ylitie, Karras and Laine, HPG 2017, §3.2: a ray visits slots in the order of slot ^ octant, which is front to back when children sit in
//! their octants; the sum of the children's distances along the diagonals of their slots is made large. The paper finds the greatest sum by an
//! auction; here the largest distance that is left is taken next, child nodes before leaves, whose order matters less.

use super::SLOTS;
use crate::accel::Aabb;
use glam::Vec3;

/// A child's box, and whether it is a node.
pub(in crate::accel) type Placed = (Aabb, bool);

/// The slot of each child, at most eight.
pub(in crate::accel) fn assign(centre: Vec3, children: &[Placed]) -> [u8; SLOTS] {
    let mut slots = [0; SLOTS];
    let mut free = (1u32 << SLOTS) - 1;
    let mut left: u32 = (1 << children.len()) - 1;
    let mut distances = [[0.0; SLOTS]; SLOTS];
    for (distances, (bounds, _)) in distances.iter_mut().zip(children) {
        // Twice the distance: halving would only cost a rounding.
        let [x, y, z] = ((bounds.lower - centre) + (bounds.upper - centre)).to_array();
        for (slot, distance) in distances.iter_mut().enumerate() {
            let along = |bit: usize, x: f32| if slot >> bit & 1 != 0 { x } else { -x };
            *distance = along(0, x) + along(1, y) + along(2, z);
        }
    }
    let nodes = children.iter().enumerate().filter(|(_, (_, is_node))| *is_node);
    let nodes = nodes.fold(0u32, |nodes, (i, _)| nodes | 1 << i);
    while left != 0 {
        let among = if left & nodes != 0 { left & nodes } else { left };
        let mut best = (
            f32::NEG_INFINITY,
            among.trailing_zeros() as usize,
            free.trailing_zeros() as usize,
        );
        for child in (0..SLOTS).filter(|child| among >> child & 1 != 0) {
            for slot in (0..SLOTS).filter(|slot| free >> slot & 1 != 0) {
                if distances[child][slot] > best.0 {
                    best = (distances[child][slot], child, slot);
                }
            }
        }
        let (_, child, slot) = best;
        slots[child] = slot as u8;
        free &= !(1 << slot);
        left &= !(1 << child);
    }
    slots
}
