//! Cuts through a tree of lights: nodes below which every light is once. Below each of them one light is chosen, so that a sum over all lights is estimated
//! without bias by as many lights as the cut has nodes.
//!
//! Sources: Walter et al., "Lightcuts" (2005), §4: the node that may send the most is split first; Yuksel, "Stochastic Lightcuts" (2019), §3: cuts of a fixed
//! size and a choice below each node; Lin and Yuksel, "Real-Time Stochastic Lightcuts" (2020), §4.1: trees that are perfect, over lights in the order of
//! a curve, bottom up.
//!
//! Guarantees: deterministic; probabilities below a node sum to one, and each is at least 2⁻²⁴ a level. Twin of `transport/light_cut.glsl` and
//! `transport/light_node.glsl`.

use super::{DEPTH_MAX, LightBounds, LightCone, in_quanta, light_node_importance};
use crate::gpu::shaders::constants::{LIGHT_CUT_MAX, LIGHT_NODE_LEAF};
use crate::gpu::shaders::types::SceneLightNode;
use crate::transport::distribution::rescaled_word;
use crate::transport::random::{pcg3d, unit_float};
use glam::{DVec3, UVec3, Vec3};

/// Most nodes of a cut.
pub const CUT_MAX: u32 = LIGHT_CUT_MAX;

/// A tree of lights for a point that they are to light.
#[derive(Debug, Clone, Copy)]
pub struct CutReceiver<'a> {
    /// The root, then children in pairs.
    pub nodes: &'a [SceneLightNode],
    /// The point, m.
    pub from: DVec3,
    /// Its unit normal; zero for points that scatter from all sides.
    pub normal: DVec3,
    /// Geometry term that lights have at most, m⁻²; infinite where it is not bounded.
    pub geometry_most: f64,
}

fn bounds_of(n: &SceneLightNode) -> LightBounds {
    let vector = |v: [f32; 3]| Vec3::from_array(v).as_dvec3();
    LightBounds {
        lower: vector(n.center) - vector(n.half_extent),
        upper: vector(n.center) + vector(n.half_extent),
        cone: LightCone {
            axis: vector(n.axis),
            spread: f64::from(n.cos_spread).clamp(-1.0, 1.0).acos(),
            reach: f64::from(n.cos_reach).clamp(-1.0, 1.0).acos(),
        },
        strength: n.strength.into(),
    }
}

/// What is around both nodes, without children or shares.
pub fn light_node_union(a: &SceneLightNode, b: &SceneLightNode) -> SceneLightNode {
    bounds_of(a).union(&bounds_of(b)).node()
}

/// A tree over nodes of single lights, in this order: perfect but for the end of each level, the levels behind each other from the root on. A node without
/// its second child has a share of one for its first.
pub fn perfect_light_tree(leaves: &[SceneLightNode]) -> Vec<SceneLightNode> {
    let depth = leaves.len().next_power_of_two().trailing_zeros();
    let first = (1usize << depth) - 1;
    let mut nodes = vec![SceneLightNode::default(); first + leaves.len()];
    nodes[first..].copy_from_slice(leaves);
    for level in (0..depth).rev() {
        let first = (1usize << level) - 1;
        let [count, children] = [level, level + 1].map(|level| leaves.len().div_ceil(1 << (depth - level)));
        for place in 0..count {
            let child = 2 * (first + place) + 1;
            let has_both = 2 * place + 1 < children;
            let around = if has_both {
                light_node_union(&nodes[child], &nodes[child + 1])
            } else {
                nodes[child]
            };
            nodes[first + place] = SceneLightNode {
                share: if has_both { 0.0 } else { 1.0 },
                child: child as u32,
                ..around
            };
        }
    }
    nodes
}

impl CutReceiver<'_> {
    fn importance(&self, node: &SceneLightNode) -> f64 {
        let importance = light_node_importance(node, self.from, self.normal);
        importance.min(f64::from(node.strength) * self.geometry_most)
    }

    fn share(&self, node: &SceneLightNode) -> f64 {
        if node.share > 0.0 {
            return node.share.into();
        }
        let [a, b] = [0, 1].map(|i| self.importance(&self.nodes[(node.child + i) as usize]));
        in_quanta(if a + b > 0.0 { a / (a + b) } else { 0.5 })
    }

    /// The cut of a size, or of fewer nodes where there are fewer lights that may send anything.
    pub fn light_cut(&self, size: u32) -> Vec<u32> {
        let importance = |index: u32| {
            let node = &self.nodes[index as usize];
            let is_leaf = node.child & LIGHT_NODE_LEAF != 0;
            if is_leaf { 0.0 } else { self.importance(node) }
        };
        let mut cut = vec![(0u32, importance(0))];
        for _ in 0..size + DEPTH_MAX {
            let strongest = (1..cut.len()).fold(0, |best, i| if cut[i].1 > cut[best].1 { i } else { best });
            if cut.len() >= size as usize || cut[strongest].1 <= 0.0 {
                break;
            }
            let node = self.nodes[cut[strongest].0 as usize];
            cut[strongest] = (node.child, importance(node.child));
            if node.share < 1.0 {
                cut.push((node.child + 1, importance(node.child + 1)));
            }
        }
        cut.into_iter().map(|(index, _)| index).collect()
    }

    /// The light below a node that a word chooses, and its probability among those below it.
    pub fn light_cut_sample(&self, index: u32, mut word: u32, mut fresh: u32) -> (u32, f64) {
        let mut node = self.nodes[index as usize];
        let mut probability = 1.0;
        for depth in 0..DEPTH_MAX {
            if node.child & LIGHT_NODE_LEAF != 0 {
                break;
            }
            let p = self.share(&node);
            let goes_first = unit_float(word) < p;
            let (first, chosen) = if goes_first { (0.0, p) } else { (p, 1.0 - p) };
            fresh = pcg3d(UVec3::new(fresh, node.child, depth)).x;
            word = rescaled_word(word, first, chosen, fresh);
            probability *= chosen;
            node = self.nodes[(node.child + u32::from(!goes_first)) as usize];
        }
        (node.child & !LIGHT_NODE_LEAF, probability)
    }

    /// All lights below a node, with their probabilities.
    pub fn lights_below(&self, index: u32) -> Vec<(u32, f64)> {
        let (mut lights, mut open) = (Vec::new(), vec![(index, 1.0)]);
        while let Some((index, probability)) = open.pop() {
            let node = &self.nodes[index as usize];
            if node.child & LIGHT_NODE_LEAF != 0 {
                lights.push((node.child & !LIGHT_NODE_LEAF, probability));
                continue;
            }
            let p = self.share(node);
            if node.share < 1.0 {
                open.push((node.child + 1, probability * (1.0 - p)));
            }
            open.push((node.child, probability * p));
        }
        lights
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_random::Random;
    use crate::transport::environment::luminance;

    /// Lights of Lambert's law in a room, along a curve as far as a test needs one.
    fn leaves(random: &mut Random, count: u32) -> Vec<SceneLightNode> {
        let mut places: Vec<Vec3> = (0..count).map(|_| 5.0 * random.vector()).collect();
        places.sort_by(|a, b| {
            (a.x.floor(), a.y.floor(), a.z)
                .partial_cmp(&(b.x.floor(), b.y.floor(), b.z))
                .expect("finite")
        });
        let light = |(number, place): (u32, Vec3)| SceneLightNode {
            center: place.to_array(),
            strength: random.magnitude(-6, 2),
            axis: random.direction().to_array(),
            cos_spread: 1.0,
            child: LIGHT_NODE_LEAF | number,
            ..SceneLightNode::default()
        };
        (0..count).zip(places).map(light).collect()
    }

    fn receiver<'a>(nodes: &'a [SceneLightNode], random: &mut Random) -> CutReceiver<'a> {
        CutReceiver {
            nodes,
            from: 6.0 * random.vector().as_dvec3(),
            normal: random.direction().as_dvec3().normalize(),
            geometry_most: random.choose(&[f32::INFINITY, 10.0, 0.1]).into(),
        }
    }

    /// Every light once below the nodes of a cut, and below each probabilities that sum to one: so the estimate is unbiased, to the digit.
    #[test]
    fn cuts_part_the_lights_and_estimates_are_unbiased() {
        let mut random = Random(61);
        for count in [1, 2, 3, 5, 64, 65, 300] {
            let nodes = perfect_light_tree(&leaves(&mut random, count));
            let brought: Vec<f64> = (0..count).map(|_| f64::from(random.magnitude(-8, 4))).collect();
            let whole: f64 = brought.iter().sum();
            for size in [1, 2, 7, 32, CUT_MAX] {
                let receiver = receiver(&nodes, &mut random);
                let cut = receiver.light_cut(size);
                assert!(
                    cut.len() <= size as usize && (cut.len() == size.min(count) as usize),
                    "{count} {size} {}",
                    cut.len()
                );
                let mut times = vec![0; count as usize];
                let mut mean = 0.0;
                for node in &cut {
                    let below = receiver.lights_below(*node);
                    let sum: f64 = below.iter().map(|(_, p)| p).sum();
                    assert!((sum - 1.0).abs() < 1e-9, "{sum}");
                    for (light, p) in &below {
                        times[*light as usize] += 1;
                        assert!(*p > 0.0);
                        mean += p * (brought[*light as usize] / p);
                    }
                    let (light, p) = receiver.light_cut_sample(*node, random.word(), random.word());
                    assert!(below.contains(&(light, p)), "{light} {p}");
                }
                assert!(times.iter().all(|times| *times == 1), "{count} {size}");
                assert!((mean / whole - 1.0).abs() < 1e-9);
            }
        }
    }

    /// The sum over a cut's choices spreads less the larger the cut: mean squares over points, by the probabilities, no number drawn.
    #[test]
    fn larger_cuts_spread_less() {
        let mut random = Random(62);
        let leaves = leaves(&mut random, 512);
        let nodes = perfect_light_tree(&leaves);
        let receivers: Vec<CutReceiver<'_>> = (0..30).map(|_| receiver(&nodes, &mut random)).collect();
        let spread = |size| {
            let of = receivers.iter().map(|r| {
                let sent = |light: u32| {
                    let n = leaves
                        .iter()
                        .find(|n| n.child & !LIGHT_NODE_LEAF == light)
                        .expect("leaf");
                    let way = Vec3::from_array(n.center).as_dvec3() - r.from;
                    let wi = way.normalize();
                    let cosines = r.normal.dot(wi).max(0.0) * (-Vec3::from_array(n.axis).as_dvec3().dot(wi)).max(0.0);
                    luminance(DVec3::splat(n.strength.into())) * (cosines / way.length_squared()).min(r.geometry_most)
                };
                let (mut sum, mut variance) = (0.0, 0.0);
                for node in r.light_cut(size) {
                    let below = r.lights_below(node);
                    let mean: f64 = below.iter().map(|(light, _)| sent(*light)).sum();
                    let square: f64 = below.iter().map(|(light, p)| sent(*light).powi(2) / p).sum();
                    sum += mean;
                    variance += square - mean * mean;
                }
                if sum > 0.0 { variance / (sum * sum) } else { 0.0 }
            });
            of.sum::<f64>() / receivers.len() as f64
        };
        let found = [1, 4, 16, 64].map(spread);
        for pair in found.windows(2) {
            assert!(pair[1] < 0.8 * pair[0], "{found:?}");
        }
    }

    #[test]
    fn trees_are_perfect_but_for_their_end() {
        let mut random = Random(63);
        for (count, nodes) in [(1, 1), (2, 3), (3, 6), (4, 7), (5, 12), (8, 15)] {
            let tree = perfect_light_tree(&leaves(&mut random, count));
            assert_eq!(tree.len(), nodes, "{count}");
            let strength: f32 = tree[tree.len() - count as usize..].iter().map(|n| n.strength).sum();
            assert!((tree[0].strength / strength - 1.0).abs() < 1e-5);
        }
        // Of five lights, the last is alone below the root's second child, two levels down.
        let tree = perfect_light_tree(&leaves(&mut random, 5));
        assert_eq!((tree[0].share, tree[2].share, tree[5].share), (0.0, 1.0, 1.0));
        assert_eq!(
            (tree[2].child, tree[5].child, tree[11].child),
            (5, 11, LIGHT_NODE_LEAF | 4)
        );
    }
}
