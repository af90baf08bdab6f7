//! Builds the tree of lights: splits by the surface area orientation heuristic in buckets, then the distant lights beside it.
//!
//! Source: Conty Estevez and Kulla (2018), §4.1 to §4.3, with the sphere around a box in place of its surface, which is nothing for lamps in a
//! row. Deterministic whatever the number of threads: each subtree has its own part of the nodes.

use glam::{DVec3, Vec3};

use super::cone::{LightCone, cone_measure, cone_union};
use super::{DEPTH_MAX, LightTree, in_quanta};
use crate::gpu::shaders::constants::{LIGHT_NODE_LEAF, LIGHT_TRAIL_NONE};
use crate::gpu::shaders::types::SceneLightNode;

/// Buckets along an axis (§4.3).
const BUCKETS: usize = 12;
/// Lights from which on both sides of a split are built at the same time.
const PARALLEL_LIGHTS: usize = 4096;
/// Intensity that a light counts as having at least, in that of the strongest: 2⁻⁴⁰, so that importances are normal numbers.
const STRENGTH_MIN: f64 = 9.094_947_017_729_282e-13;

/// Where lights are, to where they shine, and how strongly.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LightBounds {
    /// Least corner of the box around them, m.
    pub lower: DVec3,
    /// Greatest corner.
    pub upper: DVec3,
    /// Cone of their light.
    pub cone: LightCone,
    /// Sum of their greatest intensities, W/sr of luminance.
    pub strength: f64,
}

/// A light that has a place.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NearLight {
    /// Its index.
    pub light: u32,
    /// Its bounds.
    pub bounds: LightBounds,
}

/// A light that is chosen with the same probability everywhere.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FixedLight {
    /// Its index.
    pub light: u32,
    /// Weight of the choice; the near lights together have a weight in the same unit.
    pub weight: f64,
}

impl LightBounds {
    pub(super) fn union(&self, other: &Self) -> Self {
        Self {
            lower: self.lower.min(other.lower),
            upper: self.upper.max(other.upper),
            cone: cone_union(&self.cone, &other.cone),
            strength: self.strength + other.strength,
        }
    }

    fn middle(&self) -> DVec3 {
        0.5 * (self.lower + self.upper)
    }

    /// What a cluster costs: strength, by the sphere around its box, by its cone (equation 1).
    fn cost(&self) -> f64 {
        self.strength * (self.upper - self.lower).length_squared() * cone_measure(&self.cone)
    }

    /// A node around what is here, in f32 that hold no less.
    pub(super) fn node(&self) -> SceneLightNode {
        let center = self.middle().as_vec3();
        let half = (self.upper - center.as_dvec3()).max(center.as_dvec3() - self.lower);
        let half = Vec3::from_array(half.to_array().map(|h| {
            let rounded = h as f32;
            if f64::from(rounded) < h {
                rounded.next_up()
            } else {
                rounded
            }
        }));
        SceneLightNode {
            center: center.to_array(),
            strength: self.strength as f32,
            half_extent: half.to_array(),
            radius: half.length(),
            axis: self.cone.axis.as_vec3().to_array(),
            cos_spread: self.cone.spread.cos() as f32,
            cos_reach: self.cone.reach.cos() as f32,
            ..SceneLightNode::default()
        }
    }
}

fn leaf(light: u32) -> SceneLightNode {
    SceneLightNode {
        child: LIGHT_NODE_LEAF | light,
        ..SceneLightNode::default()
    }
}

/// Steps down to a leaf of a balanced tree of so many.
fn balanced_depth(leaves: usize) -> u32 {
    leaves.next_power_of_two().trailing_zeros()
}

/// The tree of `near` lights, which together have the weight `near_weight`, and of `fixed` ones, of which those of weight zero are left out; for
/// light indices below `light_count`. Empty without near lights.
///
/// Indices must be different and below `light_count`, of which there may be 2²⁸; bounds finite, strengths and weights not negative.
pub fn build_light_tree(near: &[NearLight], near_weight: f64, fixed: &[FixedLight], light_count: usize) -> LightTree {
    let mut lights = near.to_vec();
    let strongest = lights.iter().map(|light| light.bounds.strength).fold(0.0, f64::max);
    for light in &mut lights {
        let relative = if strongest > 0.0 {
            light.bounds.strength / strongest
        } else {
            1.0
        };
        light.bounds.strength = relative.max(STRENGTH_MIN);
    }
    let fixed: Vec<FixedLight> = fixed.iter().copied().filter(|light| light.weight > 0.0).collect();
    let leaves = lights.len() + fixed.len();
    if lights.is_empty() {
        return LightTree::default();
    }
    let mut nodes = vec![SceneLightNode::default(); 2 * leaves - 1];
    if fixed.is_empty() {
        let (root, below) = nodes.split_at_mut(1);
        root[0] = near_subtree(&mut lights, below, 1, DEPTH_MAX);
    } else {
        // The root has the near lights and all others for children; each side has its own part of what follows.
        let far: f64 = fixed.iter().map(|light| light.weight).sum();
        let (top, below) = nodes.split_at_mut(3);
        let (near_nodes, far_nodes) = below.split_at_mut(2 * lights.len() - 2);
        top[0] = SceneLightNode {
            child: 1,
            share: in_quanta(near_weight / (near_weight + far)) as f32,
            ..SceneLightNode::default()
        };
        let far_base = 3 + near_nodes.len() as u32;
        top[1] = near_subtree(&mut lights, near_nodes, 3, DEPTH_MAX - 1);
        top[2] = fixed_subtree(&fixed, far_nodes, far_base);
    }
    nodes[0].node_count = nodes.len() as u32;
    let trails = trails(&nodes, light_count);
    LightTree { nodes, trails }
}

/// Writes what is below a node to `below`, whose first element has the index `base`; gives the node. `depth` steps may follow.
fn near_subtree(lights: &mut [NearLight], below: &mut [SceneLightNode], base: u32, depth: u32) -> SceneLightNode {
    if let [one] = lights {
        return SceneLightNode {
            child: leaf(one.light).child,
            ..one.bounds.node()
        };
    }
    let mut bounds = lights[0].bounds;
    for light in &lights[1..] {
        bounds = bounds.union(&light.bounds);
    }
    let middle = split(lights, &bounds, depth);
    let (first, second) = lights.split_at_mut(middle);
    let (pair, below) = below.split_at_mut(2);
    let (of_first, of_second) = below.split_at_mut(2 * first.len() - 2);
    let bases = [base + 2, base + 2 + of_first.len() as u32];
    let is_large = first.len() + second.len() >= PARALLEL_LIGHTS;
    let mut build_first = || near_subtree(first, of_first, bases[0], depth - 1);
    let mut build_second = || near_subtree(second, of_second, bases[1], depth - 1);
    (pair[0], pair[1]) = if is_large {
        rayon::join(build_first, build_second)
    } else {
        (build_first(), build_second())
    };
    SceneLightNode {
        child: base,
        ..bounds.node()
    }
}

/// Sorts lights to both sides of a split; how many the first side has, at least one and not all.
fn split(lights: &mut [NearLight], bounds: &LightBounds, depth: u32) -> usize {
    let (mut lower, mut upper) = (lights[0].bounds.middle(), lights[0].bounds.middle());
    for light in &*lights {
        lower = lower.min(light.bounds.middle());
        upper = upper.max(light.bounds.middle());
    }
    let extent = upper - lower;
    // Each side must still fit below if it has all lights but one.
    let has_room = balanced_depth(lights.len() - 1) < depth;
    let best = if has_room {
        best_split(lights, bounds, lower, extent)
    } else {
        None
    };
    if let Some((axis, bucket)) = best {
        let is_first = |light: &NearLight| bucket_of(light, axis, lower, extent) <= bucket;
        // Stable, so that trees do not depend on how a sort works.
        lights.sort_by_key(|light| !is_first(light));
        return lights.iter().take_while(|light| is_first(light)).count();
    }
    let axis = (0..3).fold(
        0,
        |widest, axis| if extent[axis] > extent[widest] { axis } else { widest },
    );
    lights.sort_by(|a, b| a.bounds.middle()[axis].total_cmp(&b.bounds.middle()[axis]));
    lights.len() / 2
}

fn bucket_of(light: &NearLight, axis: usize, lower: DVec3, extent: DVec3) -> usize {
    let place = (light.bounds.middle()[axis] - lower[axis]) / extent[axis];
    ((place * BUCKETS as f64) as usize).min(BUCKETS - 1)
}

/// The axis and the last bucket of the first side of the cheapest split; `None` where all middles are in one place.
fn best_split(lights: &[NearLight], bounds: &LightBounds, lower: DVec3, extent: DVec3) -> Option<(usize, usize)> {
    let join = |a: Option<LightBounds>, b: &Option<LightBounds>| match (a, b) {
        (Some(a), Some(b)) => Some(a.union(b)),
        (a, b) => a.or(*b),
    };
    let diagonal = bounds.upper - bounds.lower;
    let mut best: Option<(f64, usize, usize)> = None;
    for axis in (0..3).filter(|axis| extent[*axis] > 0.0) {
        let mut buckets: [Option<LightBounds>; BUCKETS] = [None; BUCKETS];
        for light in lights {
            let bucket = &mut buckets[bucket_of(light, axis, lower, extent)];
            *bucket = join(*bucket, &Some(light.bounds));
        }
        // Of the buckets behind each split.
        let mut behind = [None; BUCKETS];
        let mut so_far = None;
        for bucket in (1..BUCKETS).rev() {
            so_far = join(so_far, &buckets[bucket]);
            behind[bucket - 1] = so_far;
        }
        // Thin slabs cost more (§4.3).
        let slabs = diagonal.max_element() / diagonal[axis].max(f64::MIN_POSITIVE);
        let mut before = None;
        for bucket in 0..BUCKETS - 1 {
            before = join(before, &buckets[bucket]);
            if let (Some(first), Some(second)) = (&before, &behind[bucket]) {
                let cost = slabs * (first.cost() + second.cost());
                if best.is_none_or(|(least, ..)| cost < least) {
                    best = Some((cost, axis, bucket));
                }
            }
        }
    }
    best.map(|(_, axis, bucket)| (axis, bucket))
}

/// As [`near_subtree`], balanced, with fixed shares.
fn fixed_subtree(lights: &[FixedLight], below: &mut [SceneLightNode], base: u32) -> SceneLightNode {
    if let [one] = lights {
        return leaf(one.light);
    }
    let (first, second) = lights.split_at(lights.len() / 2);
    let [a, b] = [first, second].map(|side| side.iter().map(|light| light.weight).sum::<f64>());
    let (pair, below) = below.split_at_mut(2);
    let (of_first, of_second) = below.split_at_mut(2 * first.len() - 2);
    pair[0] = fixed_subtree(first, of_first, base + 2);
    pair[1] = fixed_subtree(second, of_second, base + 2 + of_first.len() as u32);
    SceneLightNode {
        child: base,
        share: in_quanta(a / (a + b)) as f32,
        ..SceneLightNode::default()
    }
}

fn trails(nodes: &[SceneLightNode], light_count: usize) -> Vec<u32> {
    let mut trails = vec![LIGHT_TRAIL_NONE; light_count];
    let mut open = vec![(0u32, 0u32, 0u32)];
    while let Some((node, trail, depth)) = open.pop() {
        let child = nodes[node as usize].child;
        if child & LIGHT_NODE_LEAF == 0 {
            open.push((child, trail, depth + 1));
            open.push((child + 1, trail | 1 << depth, depth + 1));
        } else {
            trails[(child & !LIGHT_NODE_LEAF) as usize] = trail;
        }
    }
    trails
}
