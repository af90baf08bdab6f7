//! Where the time of our rays goes on the device: steps at inner nodes, tests of triangles, lanes that wait, and what each ray costs besides.
//!
//! A subgroup goes through the kernel's loop until its last lane is done; in wide trees, through the nodes of each round until its last lane has triangles
//! to test, and through these until its last lane has tested its own. The traversal's twin gives the steps of each ray, and of the rays of
//! a subgroup side by side follows exactly how many iterations only visit nodes, only test triangles, or do both, and how many lanes
//! do which. Parts of the rays are then traced by themselves, and the times of the parts are fitted, without negative costs and each part with
//! the same relative weight, as a sum over these counts: one cost for a subgroup's begin and end, one for an iteration, and what nodes and
//! triangles add to it, by scene, since what a step costs depends on the caches, and apart for binary and for wide trees. The least time of some runs counts, which other work on
//! the machine changes least. An iteration's time belongs in equal shares to its lanes: those at nodes,
//! those at triangles, and those that wait.
//!
//! Guarantee: counts are exact and deterministic; times and the costs that come from them are measured, and the error of the fit stands beside
//! them.

use clerestory::Result;
use clerestory::accel::bvh2::{Step, Traversal};
use clerestory::accel::wide::WideTraversal;
use clerestory::accel::{Ray, TraversalCounters};
use clerestory::gpu::Gpu;
use clerestory_tools::least_squares::non_negative;
use rayon::prelude::*;

use super::KINDS;
use super::ours::{Built, Kernel, Ours};

/// Parts of the rays of a kind.
const PARTS: usize = 8;
/// Parts have whole workgroups.
const WORKGROUP: usize = 64;
/// Texels that the kernel fetches of a node, binary or wide, and of a triangle (the traffic model in which each access is served by itself).
const NODE_FETCHES: [u64; 2] = [4, 5];
const TRIANGLE_FETCHES: u64 = 3;
/// Bytes of a texel.
const FETCH_BYTES: f64 = 16.0;
/// Kinds of iterations: only nodes, only triangles, both.
const ITERATIONS: usize = 3;
/// Costs: of a subgroup, of an iteration, and what nodes and triangles add to one.
const COSTS: usize = 4;

/// What subgroups do with some rays.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
struct Lockstep {
    subgroups: u64,
    nodes: u64,
    triangles: u64,
    iterations: [u64; ITERATIONS],
    /// Lanes at nodes and lanes at triangles, by kind of iteration, sums over iterations.
    lanes: [[u64; 2]; ITERATIONS],
}

impl Lockstep {
    fn of(index: &Ours, rays: &[Ray], width: usize) -> Self {
        let subgroups = rays.par_chunks(width).map(|rays| {
            let steps: Vec<Vec<Step>> = rays.iter().map(|ray| steps(index, ray)).collect();
            match index {
                Ours::Binary(_) => Self::of_subgroup(&steps),
                Ours::Wide(_) => Self::of_rounds(&steps),
            }
        });
        subgroups.reduce(Self::default, Self::plus)
    }

    fn of_subgroup(steps: &[Vec<Step>]) -> Self {
        let mut found = Self {
            subgroups: 1,
            ..Self::default()
        };
        for i in 0..steps.iter().map(Vec::len).max().unwrap_or(0) {
            let at = |kind| steps.iter().filter(|steps| steps.get(i) == Some(&kind)).count() as u64;
            let (nodes, triangles) = (at(Step::Node), at(Step::Triangle));
            let kind = match (nodes, triangles) {
                (_, 0) => 0,
                (0, _) => 1,
                _ => 2,
            };
            found.nodes += nodes;
            found.triangles += triangles;
            found.iterations[kind] += 1;
            found.lanes[kind][0] += nodes;
            found.lanes[kind][1] += triangles;
        }
        found
    }

    /// Of a kernel whose rounds have a loop over nodes and one over triangles.
    fn of_rounds(steps: &[Vec<Step>]) -> Self {
        let rounds: Vec<Vec<[u64; 2]>> = steps.iter().map(|steps| rounds(steps)).collect();
        let mut found = Self {
            subgroups: 1,
            ..Self::default()
        };
        for i in 0..rounds.iter().map(Vec::len).max().unwrap_or(0) {
            for step in 0..2 {
                let counts = rounds.iter().map(|rounds| rounds.get(i).map_or(0, |round| round[step]));
                found.iterations[step] += counts.clone().max().unwrap_or(0);
                found.lanes[step][step] += counts.sum::<u64>();
            }
        }
        [found.nodes, found.triangles] = [found.lanes[0][0], found.lanes[1][1]];
        found
    }

    fn plus(mut self, other: Self) -> Self {
        self.subgroups += other.subgroups;
        self.nodes += other.nodes;
        self.triangles += other.triangles;
        for kind in 0..ITERATIONS {
            self.iterations[kind] += other.iterations[kind];
            for step in 0..2 {
                self.lanes[kind][step] += other.lanes[kind][step];
            }
        }
        self
    }

    /// What costs are counted by.
    fn counts(&self) -> [f64; COSTS] {
        let [nodes, triangles, both] = self.iterations.map(|count| count as f64);
        [
            self.subgroups as f64,
            nodes + triangles + both,
            nodes + both,
            triangles + both,
        ]
    }

    fn seconds(&self, costs: &[f64; COSTS]) -> f64 {
        self.counts().iter().zip(costs).map(|(count, cost)| count * cost).sum()
    }

    /// Seconds at nodes, at triangles, of waiting lanes, and of begins and ends.
    fn parts(&self, costs: &[f64; COSTS], width: usize) -> [f64; 4] {
        let mut parts = [0.0, 0.0, 0.0, self.subgroups as f64 * costs[0]];
        for kind in 0..ITERATIONS {
            let lane = by_kind(costs)[kind] / width as f64;
            let [nodes, triangles] = self.lanes[kind];
            parts[0] += lane * nodes as f64;
            parts[1] += lane * triangles as f64;
            parts[2] += lane * (self.iterations[kind] * width as u64 - nodes - triangles) as f64;
        }
        parts
    }
}

/// What iterations cost that only visit nodes, only test triangles, or do both.
fn by_kind([_, each, nodes, triangles]: &[f64; COSTS]) -> [f64; ITERATIONS] {
    [each + nodes, each + triangles, each + nodes + triangles]
}

fn steps(index: &Ours, ray: &Ray) -> Vec<Step> {
    let (mut steps, mut counters) = (Vec::new(), TraversalCounters::default());
    let watch = |step| steps.push(step);
    match index {
        Ours::Binary(index) => {
            Traversal::closest(ray).run_watched(index, ray, u64::MAX, &mut |_, _| true, &mut counters, watch);
        }
        Ours::Wide(index) => {
            WideTraversal::closest(ray).run_watched(index, ray, u64::MAX, &mut |_, _| true, &mut counters, watch);
        }
    }
    steps
}

/// Nodes and triangles of the rounds of a ray, each of which goes through nodes until there are triangles to test.
fn rounds(steps: &[Step]) -> Vec<[u64; 2]> {
    let mut rounds: Vec<[u64; 2]> = Vec::new();
    let mut last = Step::Triangle;
    for step in steps {
        if *step == Step::Node && last == Step::Triangle {
            rounds.push([0; 2]);
        }
        if let Some(round) = rounds.last_mut() {
            round[usize::from(*step == Step::Triangle)] += 1;
        }
        last = *step;
    }
    rounds
}

/// The work of one kind of rays in one of our indexes.
#[derive(Debug, serde::Serialize)]
pub struct Work {
    /// Address.
    pub scene: String,
    /// Name of the index.
    pub index: &'static str,
    /// Whether it has nodes of eight children.
    pub is_wide: bool,
    /// Kind of rays.
    pub kind: &'static str,
    /// Inner nodes that a ray visits.
    pub nodes: f64,
    /// Triangles that a ray tests.
    pub triangles: f64,
    /// Texels of the index that a ray fetches.
    pub fetches: f64,
    /// Bytes of these.
    pub bytes: f64,
    /// Iterations of a subgroup.
    pub iterations: f64,
    /// Share of its lanes that have something to do.
    pub busy_lanes: f64,
    /// Measured nanoseconds per ray, all threads together.
    pub nanoseconds: f64,
    /// Shares of the time: nodes, triangles, lanes that wait, begin and end of rays.
    pub shares: [f64; 4],
    /// Nanoseconds: of a subgroup's begin and end, and of iterations with nodes, with triangles, with both; of all threads together.
    pub costs: [f64; COSTS],
    /// Fitted over measured time of these rays.
    pub fitted: f64,
    /// Root of the mean square of the scene's relative errors: fitted over measured times of the parts, less 1.
    pub relative_error: f64,
}

/// Measures the indexes of one scene.
pub fn measure(gpu: &Gpu, scene: &str, built: &[Built], rays: &[Vec<Ray>; 2], repeat: u32) -> Result<Vec<Work>> {
    let width = gpu.caps().subgroup_size.max(1) as usize;
    // Of binary and of wide trees.
    let mut rows = [Vec::new(), Vec::new()];
    let mut all = Vec::new();
    for one in built {
        let form = usize::from(matches!(one.index, Ours::Wide(_)));
        for (kind, rays) in rays.iter().enumerate() {
            let size = rays.len().div_ceil(PARTS).next_multiple_of(WORKGROUP);
            let parts: Vec<&[Ray]> = rays.chunks(size).collect();
            let kernel = Kernel::new(gpu, one.index.index(), &parts)?;
            let mut seconds = vec![Vec::new(); parts.len()];
            for round in 0..=repeat {
                for (part, seconds) in seconds.iter_mut().enumerate() {
                    let time = kernel.trace(part)?;
                    if round > 0 {
                        seconds.push(time);
                    }
                }
            }
            let least = |times: Vec<f64>| times.into_iter().fold(f64::INFINITY, f64::min);
            let seconds: Vec<f64> = seconds.into_iter().map(least).collect();
            let steps: Vec<Lockstep> = parts.iter().map(|rays| Lockstep::of(&one.index, rays, width)).collect();
            rows[form].extend(steps.iter().map(Lockstep::counts).zip(seconds.iter().copied()));
            let whole = steps.into_iter().fold(Lockstep::default(), Lockstep::plus);
            all.push((
                one.name,
                form,
                kind,
                rays.len() as f64,
                whole,
                seconds.iter().sum::<f64>(),
            ));
        }
    }
    let fits = rows.map(|rows| non_negative(&rows));
    let work = all.into_iter().map(|(index, form, kind, count, whole, seconds)| {
        let costs = fits[form].coefficients;
        let fetches = (NODE_FETCHES[form] * whole.nodes + TRIANGLE_FETCHES * whole.triangles) as f64 / count;
        let (fitted, parts) = (whole.seconds(&costs), whole.parts(&costs, width));
        let iterations: u64 = whole.iterations.iter().sum();
        Work {
            scene: scene.to_owned(),
            index,
            is_wide: form == 1,
            kind: KINDS[kind],
            nodes: whole.nodes as f64 / count,
            triangles: whole.triangles as f64 / count,
            fetches,
            bytes: FETCH_BYTES * fetches,
            iterations: iterations as f64 / whole.subgroups as f64,
            busy_lanes: (whole.nodes + whole.triangles) as f64 / (iterations * width as u64) as f64,
            nanoseconds: 1e9 * seconds / count,
            shares: parts.map(|part| part / fitted),
            costs: {
                let [nodes, triangles, both] = by_kind(&costs);
                [costs[0], nodes, triangles, both].map(|cost| 1e9 * cost)
            },
            fitted: fitted / seconds,
            relative_error: fits[form].relative_error,
        }
    });
    Ok(work.collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use clerestory::accel::bvh2::{Bvh2, Bvh2Settings};
    use clerestory::accel::wide::{WideBvh, WideSettings};
    use glam::Vec3;

    #[test]
    fn subgroups_go_on_until_their_last_lane_is_done() {
        use Step::{Node, Triangle};
        let found = Lockstep::of_subgroup(&[
            vec![Node, Node, Triangle],
            vec![Node],
            vec![Node, Triangle, Triangle, Triangle],
        ]);
        let expected = Lockstep {
            subgroups: 1,
            nodes: 4,
            triangles: 4,
            iterations: [1, 2, 1],
            lanes: [[3, 0], [0, 3], [1, 1]],
        };
        assert_eq!(found, expected);
        let parts = found.parts(&[10.0, 0.0, 4.0, 8.0], 4);
        assert_eq!(parts, [3.0 + 3.0, 6.0 + 3.0, 1.0 + 10.0 + 6.0, 10.0]);
        assert_eq!(parts.iter().sum::<f64>(), found.seconds(&[10.0, 0.0, 4.0, 8.0]));
    }

    #[test]
    fn rounds_wait_for_their_last_lane_at_nodes_and_at_triangles() {
        use Step::{Node, Triangle};
        let found = Lockstep::of_rounds(&[
            vec![Node, Node, Triangle, Node, Triangle, Triangle],
            vec![Node],
            vec![Node, Triangle, Triangle, Triangle, Node],
        ]);
        let expected = Lockstep {
            subgroups: 1,
            nodes: 6,
            triangles: 6,
            iterations: [3, 5, 0],
            lanes: [[6, 0], [0, 6], [0, 0]],
        };
        assert_eq!(found, expected);
    }

    #[test]
    fn steps_are_those_that_the_traversal_counts() {
        let mut stream = clerestory_tools::random::Random::new(7);
        let mut random = || stream.unit() as f32;
        let triangles: Vec<[Vec3; 3]> = (0..300)
            .map(|_| {
                let centre = Vec3::new(random(), random(), random());
                [0, 1, 2].map(|_| centre + 0.2 * Vec3::new(random(), random(), random()))
            })
            .collect();
        let binary = Bvh2::build(&triangles, &Bvh2Settings::default()).unwrap();
        let wide = WideBvh::build(&triangles, &WideSettings::default()).unwrap();
        let rays: Vec<Ray> = (0..40)
            .map(|_| Ray {
                origin: [random(), 3.0, random()],
                t_min: 0.0,
                direction: [random() - 0.5, -2.0, random() - 0.5],
                t_max: f32::INFINITY,
            })
            .collect();
        for (index, both_at_once) in [(Ours::Binary(binary), true), (Ours::Wide(wide), false)] {
            let mut counters = TraversalCounters::default();
            for ray in &rays {
                index.index().closest_hit_filtered(ray, &mut |_, _| true, &mut counters);
            }
            let found = Lockstep::of(&index, &rays, 8);
            assert_eq!(
                (found.nodes, found.triangles, found.subgroups),
                (counters.nodes, counters.triangles, 5)
            );
            assert!(found.triangles > 0 && (found.iterations[2] > 0) == both_at_once);
        }
    }
}
