//! Peers that are crates: obvhs (binary trees by PLOC and its eightfold wide ones) and bvh (binary trees by binned surface areas).
//!
//! Trees and box tests are theirs; triangles are tested by obvhs' test, one for all, which as most does not close the seams between
//! triangles. The walks are obvhs' own; that over bvh's public nodes is ours, near child first and without what lies behind the hit, since
//! the crate's iterators go through all boxes that a ray pierces.

use std::time::Duration;

use bvh::aabb::{Aabb, Bounded};
use bvh::bounding_hierarchy::BHShape;
use bvh::bvh::{Bvh, BvhNode, rayon_executor};
use clerestory::Result;
use clerestory::accel::Ray;
use glam::{Vec3, Vec3A};
use nalgebra::{Point3, Vector3};
use obvhs::BvhBuildParams;
use obvhs::bvh2::Bvh2;
use obvhs::bvh2::builder::build_bvh2;
use obvhs::cwbvh::CwBvh;
use obvhs::cwbvh::builder::build_cwbvh;
use obvhs::ray::{Ray as PeerRay, RayHit};
use obvhs::rt_triangle::RtTriangle;
use obvhs::triangle::Triangle;

use super::verdicts::SAME_HEURISTIC;
use super::{BASE, Contender, Intersection, built_in, in_parallel};

/// Rays of both kinds as obvhs has them.
pub type PeerRays = [Vec<PeerRay>; 2];

/// Rays as obvhs has them.
pub fn peer_rays(rays: &[Vec<Ray>; 2]) -> PeerRays {
    let peer = |ray: &Ray| PeerRay::new(ray.origin.into(), ray.direction.into(), ray.t_min, ray.t_max);
    [0, 1].map(|kind| rays[kind].iter().map(peer).collect())
}

/// Triangles as obvhs has them.
pub fn peer_triangles(triangles: &[[Vec3; 3]]) -> Vec<Triangle> {
    let peer = |[a, b, c]: &[Vec3; 3]| Triangle {
        v0: Vec3A::from(*a),
        v1: Vec3A::from(*b),
        v2: Vec3A::from(*c),
    };
    triangles.iter().map(peer).collect()
}

/// Triangles as they are tested fastest, in leaf order.
fn in_order(order: &[u32], triangles: &[Triangle]) -> Vec<RtTriangle> {
    let tested = |i: &u32| RtTriangle::from(&triangles[*i as usize]);
    order.iter().map(tested).collect()
}

fn met(hit: &RayHit, order: &[u32]) -> Intersection {
    if hit.t.is_finite() {
        Intersection {
            t: hit.t,
            triangle: order[hit.primitive_id as usize],
        }
    } else {
        Intersection::NONE
    }
}

/// The surface area cost as [`clerestory::accel::IndexStatistics`] has it.
fn cost_of_obvhs(tree: &Bvh2) -> f64 {
    let Some(root) = tree.nodes.first() else {
        return 0.0;
    };
    let weight = |count: u32| f64::from(count.max(1));
    let area = |node: &obvhs::bvh2::node::Bvh2Node| f64::from(node.aabb().half_area());
    let sum: f64 = tree.nodes.iter().map(|node| area(node) * weight(node.prim_count)).sum();
    sum / area(root)
}

/// The trees of obvhs, two builds of each of two kinds.
pub fn of_obvhs<'a>(triangles: &[Triangle], rays: &'a PeerRays, repeat: u32) -> Result<Vec<Contender<'a>>> {
    let mut contenders = Vec::new();
    for (names, settings) in [
        (["obvhs BVH2, fast", "obvhs CWBVH, fast"], BvhBuildParams::fast_build()),
        (["obvhs BVH2, medium", BASE], BvhBuildParams::medium_build()),
    ] {
        let (tree, build) = built_in(repeat, || Ok(build_bvh2(triangles, settings, &mut Duration::default())))?;
        contenders.push(Contender {
            name: names[0].into(),
            build,
            sah_cost: Some(cost_of_obvhs(&tree)),
            trace: by_bvh2(tree, triangles, rays),
        });
        let (tree, build) = built_in(repeat, || {
            Ok(build_cwbvh(triangles, settings, &mut Duration::default()))
        })?;
        contenders.push(Contender {
            name: names[1].into(),
            build,
            sah_cost: None,
            trace: by_cwbvh(tree, triangles, rays),
        });
    }
    Ok(contenders)
}

fn by_bvh2<'a>(tree: Bvh2, triangles: &[Triangle], rays: &'a PeerRays) -> super::Trace<'a> {
    let ordered = in_order(&tree.primitive_indices, triangles);
    Box::new(move |kind| {
        let trace = |(): &mut (), ray: &PeerRay| {
            let mut hit = RayHit::none();
            tree.ray_traverse(*ray, &mut hit, |ray, i| ordered[i].intersect(ray));
            met(&hit, &tree.primitive_indices)
        };
        Ok(in_parallel(&rays[kind], || (), trace))
    })
}

fn by_cwbvh<'a>(tree: CwBvh, triangles: &[Triangle], rays: &'a PeerRays) -> super::Trace<'a> {
    let ordered = in_order(&tree.primitive_indices, triangles);
    Box::new(move |kind| {
        let trace = |(): &mut (), ray: &PeerRay| {
            let mut hit = RayHit::none();
            tree.ray_traverse(*ray, &mut hit, |ray, i| ordered[i].intersect(ray));
            met(&hit, &tree.primitive_indices)
        };
        Ok(in_parallel(&rays[kind], || (), trace))
    })
}

/// What the crate bvh builds over.
#[derive(Debug, Clone, Copy)]
struct Shape {
    bounds: Aabb<f32, 3>,
    node: usize,
}

impl Bounded<f32, 3> for Shape {
    fn aabb(&self) -> Aabb<f32, 3> {
        self.bounds
    }
}

impl BHShape<f32, 3> for Shape {
    fn set_bh_node_index(&mut self, index: usize) {
        self.node = index;
    }

    fn bh_node_index(&self) -> usize {
        self.node
    }
}

fn shapes(triangles: &[[Vec3; 3]]) -> Vec<Shape> {
    let point = |corner: Vec3| Point3::new(corner.x, corner.y, corner.z);
    let shape = |[a, b, c]: &[Vec3; 3]| Shape {
        bounds: Aabb::with_bounds(point(a.min(*b).min(*c)), point(a.max(*b).max(*c))),
        node: 0,
    };
    triangles.iter().map(shape).collect()
}

/// The tree of the crate bvh. Seconds are of its build, which begins with boxes.
pub fn of_bvh<'a>(
    triangles: &[[Vec3; 3]],
    tested: &[Triangle],
    rays: &'a [Vec<Ray>; 2],
    peer_rays: &'a PeerRays,
    repeat: u32,
) -> Result<Contender<'a>> {
    let mut shapes = shapes(triangles);
    let (tree, build) = built_in(repeat, || Ok(Bvh::build_with_executor(&mut shapes, rayon_executor)))?;
    let tested: Vec<RtTriangle> = tested.iter().map(RtTriangle::from).collect();
    let boxed = |ray: &Ray| {
        let ([x, y, z], [u, v, w]) = (ray.origin, ray.direction);
        bvh::ray::Ray::new(Point3::new(x, y, z), Vector3::new(u, v, w))
    };
    let rays = [0, 1].map(|kind| {
        let pairs = rays[kind].iter().zip(&peer_rays[kind]);
        pairs.map(|(ray, peer)| (boxed(ray), *peer)).collect::<Vec<_>>()
    });
    Ok(Contender {
        name: SAME_HEURISTIC.into(),
        build,
        sah_cost: Some(cost_of_bvh(&tree)),
        trace: Box::new(move |kind| {
            let trace = |stack: &mut Vec<(usize, f32)>, (boxed, ray): &(bvh::ray::Ray<f32, 3>, PeerRay)| {
                walk(&tree, &tested, boxed, *ray, stack)
            };
            Ok(in_parallel(&rays[kind], Vec::new, trace))
        }),
    })
}

/// The closest hit, near child first; boxes behind the hit so far are left out.
fn walk(
    tree: &Bvh<f32, 3>,
    triangles: &[RtTriangle],
    boxed: &bvh::ray::Ray<f32, 3>,
    mut ray: PeerRay,
    stack: &mut Vec<(usize, f32)>,
) -> Intersection {
    let mut met = Intersection::NONE;
    stack.clear();
    if !tree.nodes.is_empty() {
        stack.push((0, 0.0));
    }
    while let Some((mut node, enter)) = stack.pop() {
        if enter > ray.tmax {
            continue;
        }
        loop {
            match &tree.nodes[node] {
                BvhNode::Leaf { shape_index, .. } => {
                    let t = triangles[*shape_index].intersect(&ray);
                    if t < ray.tmax {
                        ray.tmax = t;
                        met = Intersection {
                            t,
                            triangle: *shape_index as u32,
                        };
                    }
                    break;
                }
                BvhNode::Node {
                    child_l_index,
                    child_l_aabb,
                    child_r_index,
                    child_r_aabb,
                    ..
                } => {
                    let enter = |bounds| {
                        let slice = boxed.intersection_slice_for_aabb(bounds);
                        slice.map(|(enter, _)| enter).filter(|enter| *enter <= ray.tmax)
                    };
                    node = match (enter(child_l_aabb), enter(child_r_aabb)) {
                        (Some(left), Some(right)) if right < left => {
                            stack.push((*child_l_index, left));
                            *child_r_index
                        }
                        (Some(_), Some(right)) => {
                            stack.push((*child_r_index, right));
                            *child_l_index
                        }
                        (Some(_), None) => *child_l_index,
                        (None, Some(_)) => *child_r_index,
                        (None, None) => break,
                    };
                }
            }
        }
    }
    met
}

/// As [`cost_of_obvhs`]; leaves have one triangle.
fn cost_of_bvh(tree: &Bvh<f32, 3>) -> f64 {
    let half_area = |bounds: &Aabb<f32, 3>| {
        let size = bounds.max - bounds.min;
        let [x, y, z] = [size.x, size.y, size.z].map(f64::from);
        x * y + y * z + z * x
    };
    let children = tree.nodes.iter().filter_map(|node| match node {
        BvhNode::Node {
            child_l_aabb,
            child_r_aabb,
            ..
        } => Some([child_l_aabb, child_r_aabb]),
        BvhNode::Leaf { .. } => None,
    });
    let mut all = children.clone();
    let Some([left, right]) = all.next() else {
        return 1.0;
    };
    let root = half_area(&left.join(right));
    1.0 + children.flatten().map(half_area).sum::<f64>() / root
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_walk_over_nodes_equals_trying_all_triangles() {
        let mut stream = clerestory_tools::random::Random::new(7);
        let mut random = || stream.unit() as f32;
        let triangles: Vec<[Vec3; 3]> = (0..200)
            .map(|_| {
                let centre = Vec3::new(random(), random(), random());
                [0, 1, 2].map(|_| centre + 0.2 * Vec3::new(random(), random(), random()))
            })
            .collect();
        let rays: Vec<Ray> = (0..500)
            .map(|_| Ray {
                origin: [1.2 * random(), 3.0, 1.2 * random()],
                t_min: 0.0,
                direction: [0.2 * random() - 0.1, -1.0, 0.2 * random() - 0.1],
                t_max: f32::INFINITY,
            })
            .collect();
        let rays = [rays, Vec::new()];
        let (peer_rays, tested) = (peer_rays(&rays), peer_triangles(&triangles));
        let all: Vec<RtTriangle> = tested.iter().map(RtTriangle::from).collect();
        let brute = |ray: &PeerRay| all.iter().map(|t| t.intersect(ray)).fold(f32::INFINITY, f32::min);
        let expected: Vec<f32> = peer_rays[0].iter().map(brute).collect();
        assert!(expected.iter().filter(|t| t.is_finite()).count() > 50);
        let mut contenders = of_obvhs(&tested, &peer_rays, 1).unwrap();
        contenders.push(of_bvh(&triangles, &tested, &rays, &peer_rays, 1).unwrap());
        for contender in &mut contenders {
            let (_, met) = (contender.trace)(0).unwrap();
            let found: Vec<f32> = met.iter().map(|met| met.t).collect();
            assert_eq!(found, expected, "{}", contender.name);
            assert!(contender.sah_cost.is_none_or(|cost| cost > 1.0));
        }
    }
}
