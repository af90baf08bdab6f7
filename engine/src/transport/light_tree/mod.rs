//! Choice of one light among many for the point that it is to light: down a binary tree of bounds and cones, by one random word.
//!
//! Sources: Conty Estevez and Kulla, "Importance Sampling of Many Lights with Adaptive Tree Splitting" (HPG 2018), §4: splits by the surface area
//! orientation heuristic, importance by intensity, distance and cones; Walter et al., "Lightcuts" (2005), §4.1: bounds of cosines over a
//! box, far closer than those over a sphere; Pharr, Jakob and Humphreys, "Physically Based Rendering" (4th edition), §12.6.3: the way to a
//! light as bits, by which its probability is found again where a scattered ray has met it. Clusters are not split further at a point, so
//! that one light is chosen, and one shadow ray sent, as without the tree.
//!
//! Distant lights are outside: the root has a fixed share for all of them, within which each has its share by power.
//!
//! Guarantees: at every node each child has a positive multiple of 2⁻²⁴ as its probability, exactly the share of words that choose it, so
//! that no light is lost to rounding or to a bound; at most [`DEPTH_MAX`] steps; equal lights make equal trees. Twin of
//! `transport/light_tree.glsl`.

mod build;
mod cone;
mod cut;
#[cfg(test)]
mod tests;

pub use build::{FixedLight, LightBounds, NearLight, build_light_tree};
pub use cone::{LightCone, cone_measure, cone_union};
pub use cut::{CUT_MAX, CutReceiver, light_node_union, perfect_light_tree};

use crate::catalogue::{Bias, Role, Row, sources};
use crate::gpu::shaders::constants::{
    DISTRIBUTION_QUANTA, LIGHT_CONE_SLACK, LIGHT_COS_MIN, LIGHT_NEAREST_SHARE, LIGHT_NODE_LEAF, LIGHT_SQUARED_MIN,
    LIGHT_TRAIL_NONE, LIGHT_TREE_DEPTH_MAX,
};
use crate::gpu::shaders::types::SceneLightNode;
use crate::transport::distribution::rescaled_word;
use crate::transport::random::{pcg3d, unit_float};
use glam::{DVec2, DVec3, UVec3, Vec3};

/// Most steps from the root to a light.
pub const DEPTH_MAX: u32 = LIGHT_TREE_DEPTH_MAX;

/// Bytes of a four-word texel.
const QUARTER_BYTES: usize = 16;

/// A tree of lights as the device has it.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct LightTree {
    /// The root, then children in pairs.
    pub nodes: Vec<SceneLightNode>,
    /// By light the steps from the root to it, a bit each, set where it goes to the second child; [`LIGHT_TRAIL_NONE`] of lights that are not
    /// in the tree.
    pub trails: Vec<u32>,
}

impl LightTree {
    /// What kernels read: the nodes, then the trails, in whole quarters.
    pub fn bytes(&self) -> Vec<u8> {
        let mut bytes = bytemuck::cast_slice(&self.nodes).to_vec();
        bytes.extend_from_slice(bytemuck::cast_slice(&self.trails));
        bytes.resize(bytes.len().next_multiple_of(QUARTER_BYTES), 0);
        bytes
    }
}

/// Cosine and sine of the difference of two angles in \[0, π\] given so; of 0 where the second is greater.
pub fn angle_less(a: DVec2, b: DVec2) -> DVec2 {
    if a.x >= b.x {
        DVec2::X
    } else {
        DVec2::new(a.x * b.x + a.y * b.y, a.y * b.x - a.x * b.y)
    }
}

/// Greatest cosine between a direction and the ways to the points of a box.
///
/// `along` is the greatest dot product, `least` and `greatest` are the distances.
pub fn cosine_bound(along: f64, least: f64, greatest: f64) -> f64 {
    let distance = if along > 0.0 { least } else { greatest };
    (along / distance.max(f64::from(LIGHT_SQUARED_MIN))).clamp(-1.0, 1.0)
}

/// What the lights of a node may send to a point, relative intensity over m².
///
/// Intensity over the square of a distance between that of their box and that of its middle, times the greatest cosines at the lights and at the
/// point. A `normal` of zero stands for points that scatter from all sides.
pub fn light_node_importance(n: &SceneLightNode, from: DVec3, normal: DVec3) -> f64 {
    let vector = |v: [f32; 3]| Vec3::from_array(v).as_dvec3();
    let (half, axis, radius) = (vector(n.half_extent), vector(n.axis), f64::from(n.radius));
    let (cos_spread, cos_reach) = (f64::from(n.cos_spread), f64::from(n.cos_reach));
    let floor = f64::from(LIGHT_COS_MIN);
    let to = vector(n.center) - from;
    let least = (to.abs() - half).max(DVec3::ZERO).length();
    let greatest = (to.abs() + half).length();
    let middle = to.length().max(radius);
    let squared = (least * middle)
        .max(f64::from(LIGHT_NEAREST_SHARE) * radius * radius)
        .max(f64::from(LIGHT_SQUARED_MIN));
    let mut importance = f64::from(n.strength) / squared;
    if least > 0.0 {
        let with_sine = |cos: f64| DVec2::new(cos, (1.0 - cos * cos).max(0.0).sqrt());
        let seen = cosine_bound(axis.abs().dot(half) - axis.dot(to), least, greatest);
        let beyond = angle_less(with_sine(seen), with_sine(cos_spread)).x;
        importance *= if beyond < cos_reach - f64::from(LIGHT_CONE_SLACK) {
            floor
        } else {
            beyond.max(floor)
        };
        if normal != DVec3::ZERO {
            importance *= cosine_bound(normal.dot(to) + normal.abs().dot(half), least, greatest).max(floor);
        }
    }
    importance
}

/// Probability of the first of two children: `share` where it is fixed, by importance where that is zero.
pub fn light_node_share(
    first: &SceneLightNode,
    second: &SceneLightNode,
    share: f64,
    from: DVec3,
    normal: DVec3,
) -> f64 {
    if share > 0.0 {
        return share;
    }
    let a = light_node_importance(first, from, normal);
    let both = a + light_node_importance(second, from, normal);
    in_quanta(if both > 0.0 { a / both } else { 0.5 })
}

/// The nearest multiple of 2⁻²⁴ strictly between 0 and 1.
fn in_quanta(p: f64) -> f64 {
    let quanta = f64::from(DISTRIBUTION_QUANTA);
    (p * quanta + 0.5).floor().clamp(1.0, quanta - 1.0) / quanta
}

/// The children of a node and the probability of the first; `None` at a leaf.
fn step(
    nodes: &[SceneLightNode],
    node: &SceneLightNode,
    from: DVec3,
    normal: DVec3,
) -> Option<([SceneLightNode; 2], f64)> {
    if node.child & LIGHT_NODE_LEAF != 0 {
        return None;
    }
    let children = [node.child, node.child + 1].map(|i| nodes[i as usize]);
    let p = light_node_share(&children[0], &children[1], node.share.into(), from, normal);
    Some((children, p))
}

/// The light that a word chooses for a point, and its probability. The word becomes its place within that light's share.
pub fn light_tree_sample(
    nodes: &[SceneLightNode],
    from: DVec3,
    normal: DVec3,
    word: &mut u32,
    mut fresh: u32,
) -> (u32, f64) {
    let mut node = nodes[0];
    let mut probability = 1.0;
    for depth in 0..DEPTH_MAX {
        let Some((children, p)) = step(nodes, &node, from, normal) else {
            break;
        };
        let goes_first = unit_float(*word) < p;
        let (first, chosen) = if goes_first { (0.0, p) } else { (p, 1.0 - p) };
        // Each level makes up for its own bits.
        fresh = pcg3d(UVec3::new(fresh, node.child, depth)).x;
        *word = rescaled_word(*word, first, chosen, fresh);
        probability *= chosen;
        node = children[usize::from(!goes_first)];
    }
    (node.child & !LIGHT_NODE_LEAF, probability)
}

/// Probability with which [`light_tree_sample`] chooses a light for a point, by the way to it; 0 for lights that are not in the tree.
pub fn light_tree_probability(tree: &LightTree, light: u32, from: DVec3, normal: DVec3) -> f64 {
    let trail = tree.trails[light as usize];
    if trail == LIGHT_TRAIL_NONE {
        return 0.0;
    }
    let mut node = tree.nodes[0];
    let mut probability = 1.0;
    for depth in 0..DEPTH_MAX {
        let Some((children, p)) = step(&tree.nodes, &node, from, normal) else {
            break;
        };
        let goes_first = trail >> depth & 1 == 0;
        probability *= if goes_first { p } else { 1.0 - p };
        node = children[usize::from(!goes_first)];
    }
    probability
}

/// Rows of the catalogue.
pub(crate) const ROWS: &[Row] = &[Row {
    id: "CL-LIGHT-TREE",
    name: "choice among many lights by a tree of bounds and cones",
    role: Role::PartOf("BG-3"),
    limits: "Blind to shadows, to textures of emission and to what surfaces scatter by; one light is chosen, clusters are not split; photons leave lights by power.",
    sources: &[
        sources::CONTY_KULLA_2018.at("§4"),
        sources::WALTER_2005.at("§4.1: bounds of cosines over a box"),
        sources::PHARR_2023.at("§12.6.3: the way to a light as bits"),
        sources::SHIRLEY_1996.at("one number for the choice and the place"),
    ],
    shaders: &["shaders/transport/light_tree.glsl"],
    bias: Some(Bias::Unbiased),
    tests: &[
        "engine/src/transport/light_tree/tests.rs::importance_bounds_cosines_and_none_is_lost",
        "engine/src/transport/light_tree/tests.rs::probabilities_sum_to_one_and_are_those_of_descents",
        "engine/src/transport/light_tree/tests.rs::lights_are_chosen_as_often_as_their_probability_says",
        "engine/src/transport/light_tree/tests.rs::cones_of_unions_hold_both",
        "tests/tests/twins/light_tree.rs::choices_by_a_tree_agree_with_their_twins",
        "tests/tests/paths/many_lights.rs::pictures_by_the_tree_are_those_by_power",
        "tests/tests/paths/many_lights.rs::few_lamps_have_no_tree",
    ],
    settings: &["light_tree"],
    api: &["clerestory::transport::light_tree"],
    ..Row::of(file!())
}];
