//! Every plane that the construction takes has the least cost of all, and every leaf costs less: each candidate weighed by itself, by the
//! definition, with triangles counted one by one.

use super::bounds::Bounds;
use super::build::{Built, build};
use super::clip::clipped_bounds;
use super::tree::bounds_of_all;
use super::{Heuristic, KdSettings};
use crate::accel::Aabb;
use crate::accel::bvh2::tests::{grid, soup};
use crate::accel::input::bounds_of;
use crate::accel::test_support::Random;
use glam::Vec3;
use std::collections::BTreeSet;

/// Relative rounding of costs that are summed in another order.
const ROUNDING: f64 = 1e-12;

/// A triangle and the box of what a node has of it.
type Part = (u32, Aabb);

/// A plane, and the side that triangles within it go to.
#[derive(Debug, Clone, Copy)]
struct Candidate {
    axis: usize,
    plane: f32,
    planar_below: bool,
}

impl Candidate {
    /// Whether a part goes below and above.
    fn sides(&self, part: &Aabb) -> [bool; 2] {
        let (lower, upper) = (part.lower[self.axis], part.upper[self.axis]);
        if self.holds(part) {
            [self.planar_below, !self.planar_below]
        } else {
            [lower < self.plane, upper > self.plane]
        }
    }

    /// Whether a part lies in the plane.
    fn holds(&self, part: &Aabb) -> bool {
        part.lower[self.axis] == self.plane && part.upper[self.axis] == self.plane
    }
}

/// What was met on the way through trees, so that no rule goes untested.
#[derive(Debug, Default)]
struct Met {
    planes: u32,
    planes_with_triangles: u32,
    planes_with_bonus: u32,
    leaves_not_worth_splitting: u32,
}

struct Check<'a> {
    triangles: &'a [[Vec3; 3]],
    settings: &'a KdSettings,
    scene: Bounds,
    met: &'a mut Met,
}

impl Check<'_> {
    fn probability(&self, node: &Bounds) -> f64 {
        self.settings.heuristic.probability(node, &self.scene)
    }

    /// The cost of a candidate and whether it cuts off empty space; `None` where it makes no progress.
    fn cost(&self, bounds: &Aabb, parts: &[Part], candidate: Candidate) -> Option<(f64, bool)> {
        let sides = parts.iter().map(|(_, part)| candidate.sides(part));
        let counts = sides.fold([0u32; 2], |[below, above], [is_below, is_above]| {
            [below + u32::from(is_below), above + u32::from(is_above)]
        });
        let node = Bounds::from(*bounds);
        let children = node.split(candidate.axis, f64::from(candidate.plane));
        let shares = children.map(|child| child.extent()[candidate.axis] / node.extent()[candidate.axis]);
        let is_nothing = (0..2).any(|side| counts[side] == 0 && shares[side] <= 0.0);
        if counts == [parts.len() as u32; 2] || is_nothing {
            return None;
        }
        let settings = self.settings;
        let visit = settings.traversal_cost * self.probability(&node);
        let tests =
            [0, 1].map(|side| self.probability(&children[side]) * settings.intersection_cost * f64::from(counts[side]));
        let is_empty = (0..2).any(|side| counts[side] == 0 && shares[side] > settings.empty_share);
        let factor = if is_empty { 1.0 - settings.empty_bonus } else { 1.0 };
        Some((factor * (visit + tests[0] + tests[1]), is_empty))
    }

    /// The least cost of all planes at which a part begins or ends; infinite where none makes progress.
    fn least(&self, bounds: &Aabb, parts: &[Part]) -> f64 {
        let extent = Bounds::from(*bounds).extent();
        let mut least = f64::INFINITY;
        for axis in (0..3).filter(|axis| extent[*axis] > 0.0) {
            for plane in parts.iter().flat_map(|(_, part)| [part.lower[axis], part.upper[axis]]) {
                for planar_below in [true, false] {
                    let candidate = Candidate {
                        axis,
                        plane,
                        planar_below,
                    };
                    least = least.min(self.cost(bounds, parts, candidate).map_or(least, |(cost, _)| cost));
                }
            }
        }
        least
    }

    /// The boxes of the children and their parts.
    fn split(&self, bounds: &Aabb, parts: &[Part], candidate: Candidate) -> [(Aabb, Vec<Part>); 2] {
        let mut children = [(*bounds, Vec::new()), (*bounds, Vec::new())];
        children[0].0.upper[candidate.axis] = candidate.plane;
        children[1].0.lower[candidate.axis] = candidate.plane;
        for (triangle, part) in parts {
            let sides = candidate.sides(part);
            for (goes, (child, kept)) in sides.into_iter().zip(&mut children) {
                let cut = match sides {
                    [true, true] => self.cut(*triangle, child),
                    _ => Some(*part),
                };
                kept.extend(cut.filter(|_| goes).map(|part| (*triangle, part)));
            }
        }
        children
    }

    /// The box of what a node has of a triangle.
    fn cut(&self, triangle: u32, node: &Aabb) -> Option<Aabb> {
        let triangle = &self.triangles[triangle as usize];
        if self.settings.clip {
            return clipped_bounds(triangle, node);
        }
        let bounds = bounds_of(triangle).without_negative_zero();
        Some(Aabb {
            lower: bounds.lower.max(node.lower),
            upper: bounds.upper.min(node.upper),
        })
    }

    fn node(&mut self, built: &Built, bounds: &Aabb, parts: &[Part]) {
        let least = self.least(bounds, parts);
        let visits = self.probability(&Bounds::from(*bounds));
        let leaf = visits * self.settings.intersection_cost * parts.len() as f64;
        let is_small = parts.len() <= self.settings.leaf_size as usize;
        let (axis, plane, children) = match built {
            Built::Leaf(held) => {
                assert!(held.iter().eq(parts.iter().map(|(triangle, _)| triangle)));
                assert!(
                    is_small || least >= leaf * (1.0 - ROUNDING),
                    "{least} is less than {leaf}"
                );
                self.met.leaves_not_worth_splitting += u32::from(!is_small);
                return;
            }
            Built::Inner(axis, plane, children) => (usize::from(*axis), *plane, children),
        };
        assert!(!is_small);
        // The side of triangles within the plane is told by where they are found.
        let candidates = [true, false].map(|planar_below| Candidate {
            axis,
            plane,
            planar_below,
        });
        let taken = candidates.into_iter().find(|candidate| {
            let split = self.split(bounds, parts, *candidate);
            (0..2).all(|side| {
                let has: BTreeSet<u32> = split[side].1.iter().map(|(triangle, _)| *triangle).collect();
                triangles_of(&children[side]).is_subset(&has)
            })
        });
        let taken = taken.expect("triangles on the sides of the plane");
        let (cost, is_empty) = self.cost(bounds, parts, taken).expect("progress");
        assert!(cost <= least * (1.0 + ROUNDING), "{taken:?} costs {cost}, not {least}");
        assert!(cost <= leaf * (1.0 + ROUNDING), "{taken:?} costs {cost}, a leaf {leaf}");
        self.met.planes += 1;
        self.met.planes_with_bonus += u32::from(is_empty);
        self.met.planes_with_triangles += u32::from(parts.iter().any(|(_, part)| taken.holds(part)));
        let split = self.split(bounds, parts, taken);
        for (child, (bounds, parts)) in children.iter().zip(&split) {
            self.node(child, bounds, parts);
        }
    }
}

fn triangles_of(built: &Built) -> BTreeSet<u32> {
    match built {
        Built::Leaf(held) => held.iter().copied().collect(),
        Built::Inner(_, _, children) => children.iter().flat_map(triangles_of).collect(),
    }
}

/// Triangles anywhere; a wall in a cloud of them; two clouds with nothing between them.
fn scenes() -> [Vec<[Vec3; 3]>; 3] {
    let mut random = Random(73);
    let random = &mut random;
    let mut walled = grid(3);
    walled.extend(soup(random, 16, 0.3, 1.5, Vec3::new(1.5, 1.5, 0.8)));
    let mut apart = soup(random, 9, 0.3, 0.3, Vec3::ZERO);
    apart.extend(soup(random, 9, 0.3, 0.3, Vec3::new(3.0, 1.0, 0.5)));
    [soup(random, 40, 0.3, 1.0, Vec3::ZERO), walled, apart]
}

#[test]
fn every_plane_has_the_least_cost_and_every_leaf_costs_less() {
    let source = KdSettings {
        leaf_size: 1,
        ..KdSettings::default()
    };
    // Each constant on its own scale, so that none can stand for another.
    let uneven = KdSettings {
        traversal_cost: 2.5,
        intersection_cost: 1.7,
        empty_bonus: 0.5,
        empty_share: 0.1,
        clip: false,
        ..source
    };
    let coarse = KdSettings { leaf_size: 4, ..source };
    let mut met = Met::default();
    for triangles in scenes() {
        let bounds = bounds_of_all(&triangles);
        let boxes = triangles
            .iter()
            .map(|triangle| bounds_of(triangle).without_negative_zero());
        let parts: Vec<Part> = (0..).zip(boxes).collect();
        for settings in [source, uneven, coarse] {
            for heuristic in [Heuristic::SurfaceArea, Heuristic::InteriorOrigin, Heuristic::Regions] {
                // Slow to weigh so often.
                if heuristic == Heuristic::Regions && triangles.len() > 18 {
                    continue;
                }
                let settings = KdSettings { heuristic, ..settings };
                let mut check = Check {
                    triangles: &triangles,
                    settings: &settings,
                    scene: Bounds::from(bounds),
                    met: &mut met,
                };
                check.node(&build(&triangles, bounds, &settings), &bounds, &parts);
            }
        }
    }
    println!("{met:?}");
    assert!(met.planes > 60 && met.planes_with_triangles > 0);
    assert!(met.planes_with_bonus > 0 && met.leaves_not_worth_splitting > 0);
}
