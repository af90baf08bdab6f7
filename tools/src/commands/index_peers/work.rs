//! Where the time of our rays goes on the device: steps at inner nodes, tests of triangles, lanes that wait, and what each ray costs besides.
//!
//! A subgroup goes through the kernel's loop until its last lane is done. The traversal's twin gives the steps of each ray, and of the rays of
//! a subgroup side by side follows exactly how many iterations only visit nodes, only test triangles, or do both, and how many lanes
//! do which. Parts of the rays are then traced by themselves, and the times of the parts are fitted, without negative costs and each part with
//! the same relative weight, as a sum over these counts: one cost for a subgroup's begin and end, one for an iteration, and what nodes and
//! triangles add to it, by scene, since what a step costs depends on the caches. The least time of some runs counts, which other work on
//! the machine changes least. An iteration's time belongs in equal shares to its lanes: those at nodes,
//! those at triangles, and those that wait.
//!
//! Guarantee: counts are exact and deterministic; times and the costs that come from them are measured, and the error of the fit stands beside
//! them.

use clerestory::Result;
use clerestory::accel::bvh2::{Bvh2, Step, Traversal};
use clerestory::accel::{Ray, TraversalCounters};
use clerestory::gpu::Gpu;
use clerestory_tools::least_squares::non_negative;
use rayon::prelude::*;

use super::KINDS;
use super::ours::{Built, Kernel};

/// Parts of the rays of a kind.
const PARTS: usize = 8;
/// Parts have whole workgroups.
const WORKGROUP: usize = 64;
/// Bytes that the kernel reads of a node and of a triangle (the traffic model in which each access is served by itself).
const NODE_BYTES: u64 = 64;
const TRIANGLE_BYTES: u64 = 48;
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
    fn of(index: &Bvh2, rays: &[Ray], width: usize) -> Self {
        let subgroups = rays.par_chunks(width).map(|rays| {
            let steps: Vec<Vec<Step>> = rays.iter().map(|ray| steps(index, ray)).collect();
            Self::of_subgroup(&steps)
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

fn steps(index: &Bvh2, ray: &Ray) -> Vec<Step> {
    let (mut steps, mut counters) = (Vec::new(), TraversalCounters::default());
    let mut traversal = Traversal::closest(ray);
    traversal.run_watched(index, ray, u64::MAX, &mut |_, _| true, &mut counters, |step| {
        steps.push(step)
    });
    steps
}

/// The work of one kind of rays in one of our indexes.
#[derive(Debug, serde::Serialize)]
pub struct Work {
    /// Address.
    pub scene: String,
    /// Name of the index.
    pub index: &'static str,
    /// Kind of rays.
    pub kind: &'static str,
    /// Inner nodes that a ray visits.
    pub nodes: f64,
    /// Triangles that a ray tests.
    pub triangles: f64,
    /// Bytes of the index that a ray reads.
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
    let mut rows = Vec::new();
    let mut all = Vec::new();
    for one in built {
        for (kind, rays) in rays.iter().enumerate() {
            let size = rays.len().div_ceil(PARTS).next_multiple_of(WORKGROUP);
            let parts: Vec<&[Ray]> = rays.chunks(size).collect();
            let kernel = Kernel::new(gpu, &one.index, &parts)?;
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
            rows.extend(steps.iter().map(Lockstep::counts).zip(seconds.iter().copied()));
            let whole = steps.into_iter().fold(Lockstep::default(), Lockstep::plus);
            all.push((one.name, kind, rays.len() as f64, whole, seconds.iter().sum::<f64>()));
        }
    }
    let fit = non_negative(&rows);
    let costs = fit.coefficients;
    let work = all.into_iter().map(|(index, kind, count, whole, seconds)| {
        let (fitted, parts) = (whole.seconds(&costs), whole.parts(&costs, width));
        let iterations: u64 = whole.iterations.iter().sum();
        Work {
            scene: scene.to_owned(),
            index,
            kind: KINDS[kind],
            nodes: whole.nodes as f64 / count,
            triangles: whole.triangles as f64 / count,
            bytes: (NODE_BYTES * whole.nodes + TRIANGLE_BYTES * whole.triangles) as f64 / count,
            iterations: iterations as f64 / whole.subgroups as f64,
            busy_lanes: (whole.nodes + whole.triangles) as f64 / (iterations * width as u64) as f64,
            nanoseconds: 1e9 * seconds / count,
            shares: parts.map(|part| part / fitted),
            costs: {
                let [nodes, triangles, both] = by_kind(&costs);
                [costs[0], nodes, triangles, both].map(|cost| 1e9 * cost)
            },
            fitted: fitted / seconds,
            relative_error: fit.relative_error,
        }
    });
    Ok(work.collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use clerestory::accel::RayIndex;
    use clerestory::accel::bvh2::Bvh2Settings;
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
    fn steps_are_those_that_the_traversal_counts() {
        let mut stream = clerestory_tools::random::Random::new(7);
        let mut random = || stream.unit() as f32;
        let triangles: Vec<[Vec3; 3]> = (0..300)
            .map(|_| {
                let centre = Vec3::new(random(), random(), random());
                [0, 1, 2].map(|_| centre + 0.2 * Vec3::new(random(), random(), random()))
            })
            .collect();
        let index = Bvh2::build(&triangles, &Bvh2Settings::default()).unwrap();
        let rays: Vec<Ray> = (0..40)
            .map(|_| Ray {
                origin: [random(), 3.0, random()],
                t_min: 0.0,
                direction: [random() - 0.5, -2.0, random() - 0.5],
                t_max: f32::INFINITY,
            })
            .collect();
        let mut counters = TraversalCounters::default();
        for ray in &rays {
            index.closest_hit_filtered(ray, &mut |_, _| true, &mut counters);
        }
        let found = Lockstep::of(&index, &rays, 8);
        assert_eq!(
            (found.nodes, found.triangles, found.subgroups),
            (counters.nodes, counters.triangles, 5)
        );
        assert!(found.triangles > 0 && found.iterations[2] > 0);
    }
}
