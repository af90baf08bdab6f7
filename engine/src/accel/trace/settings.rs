//! Settings of the tracing of rays in a buffer: what is asked, how rays are dealt out, and the quotas without which drivers that cap loops lose
//! rays.

use crate::accel::DeviceTraversal;
use crate::accel::bvh2::{MAX_DEPTH, MAX_LEAF_SIZE};
use crate::accel::device_traversal::KdRounds;
use crate::accel::input::check_range;
use crate::accel::kd::{KdCaches, Scheme};
use crate::gpu::{Caps, DeviceKind, SOFTWARE_LOOP_CAP};
use crate::{Error, Result};

/// Batches of a dispatch where quotas are fitted to a cap.
const FITTED_FETCHES: u32 = 4;

/// Loop iterations in which a lane loads a cached node and its box, at most.
const LOAD_ITERATIONS: u64 = 16;

/// How rays are dealt out to invocations.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Execution {
    /// As many invocations as rays; the driver's scheduler deals them out.
    RayPerThread,
    /// As many workgroups as stay on the device, which fetch batches of rays from a counter.
    Persistent(PersistentThreads),
}

/// The size of a queue's crew and its quota.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize)]
pub struct PersistentThreads {
    /// Workgroups of a dispatch, 1..=65,535; best as many as stay resident, which only a measurement tells (see
    /// [`RayTracer::tune`](super::RayTracer::tune)).
    pub groups: u32,
    /// Rays that a workgroup fetches at once, 1..=16,384.
    pub batch: u32,
    /// Batches that a workgroup fetches in one dispatch, from 1 on.
    pub fetches: u32,
    /// Subgroups of a workgroup, which share caches and wait for each other at each fetch, 1..=32; best one without caches.
    pub subgroups: u32,
}

impl PersistentThreads {
    /// Invocations of a workgroup.
    pub(super) fn lanes(&self, caps: &Caps) -> u32 {
        group_size(caps) * self.subgroups
    }

    /// What suits a device before anything is measured: batches of a subgroup; on software devices batches of four, two workgroups for each
    /// thread of the host, and quotas below [`SOFTWARE_LOOP_CAP`].
    pub fn on(caps: &Caps) -> Self {
        let software = caps.kind == DeviceKind::Cpu;
        let threads = std::thread::available_parallelism().map_or(1, |threads| threads.get() as u32);
        Self {
            groups: if software { 2 * threads.min(512) } else { 1024 },
            // Software devices run each barrier lane by lane: fewer fetches are fewer barriers.
            batch: group_size(caps) * if software { 4 } else { 1 },
            fetches: if software { 16 } else { 4096 },
            subgroups: 1,
        }
    }
}

/// What is asked of rays.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, serde::Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Query {
    /// The closest hit.
    #[default]
    Closest,
    /// Whether there is a hit; that which is returned may be any of a ray's hits.
    Any,
}

/// Settings of a [`RayTracer`](super::RayTracer).
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize)]
pub struct TraceSettings {
    /// What is asked of rays. Default the closest hit.
    pub query: Query,
    /// How rays are dealt out.
    pub execution: Execution,
    /// Iterations after which a ray stops and waits for the next dispatch, above [`MAX_DEPTH`].
    pub ray_quota: u32,
    /// Whether work is counted, which costs a little time.
    pub count: bool,
    /// How kd-trees are traversed.
    pub scheme: Scheme,
    /// The caches of kd-trees, of persistent threads that traverse by a stack. Default none.
    pub caches: KdCaches,
}

impl TraceSettings {
    /// One invocation per ray.
    pub fn ray_per_thread() -> Self {
        Self {
            query: Query::Closest,
            execution: Execution::RayPerThread,
            ray_quota: 32_768,
            count: false,
            scheme: Scheme::Stack,
            caches: KdCaches::default(),
        }
    }

    /// Persistent threads with the quotas that suit the device.
    pub fn persistent(caps: &Caps) -> Self {
        Self {
            query: Query::Closest,
            execution: Execution::Persistent(PersistentThreads::on(caps)),
            ray_quota: if caps.kind == DeviceKind::Cpu { 512 } else { 32_768 },
            count: false,
            scheme: Scheme::Stack,
            caches: KdCaches::default(),
        }
    }

    /// The same with such quotas that a software device loses no ray in an index of this kind, as far as that is possible.
    pub fn fitted(mut self, caps: &Caps, traversal: DeviceTraversal) -> Self {
        if caps.kind != DeviceKind::Cpu || self.iterations(caps, traversal) <= u64::from(SOFTWARE_LOOP_CAP) {
            return self;
        }
        let mut fetches = 1;
        if let Execution::Persistent(mut threads) = self.execution {
            threads.batch = threads.batch.min(threads.lanes(caps));
            let fits = |fetches| {
                let least = Self {
                    execution: Execution::Persistent(PersistentThreads { fetches, ..threads }),
                    ray_quota: traversal.least_quota(),
                    ..self
                };
                least.iterations(caps, traversal) <= u64::from(SOFTWARE_LOOP_CAP)
            };
            // Rays finish the leaf that they are in: the longer leaves are, the fewer batches fit.
            fetches = threads.fetches.clamp(1, FITTED_FETCHES);
            while fetches > 1 && !fits(fetches) {
                fetches -= 1;
            }
            threads.fetches = fetches;
            self.execution = Execution::Persistent(threads);
        }
        let unstopped = Self { ray_quota: 0, ..self }.iterations(caps, traversal);
        let left = u64::from(SOFTWARE_LOOP_CAP).saturating_sub(unstopped);
        let share = left / u64::from(fetches * lanes_in_sum(caps, traversal));
        self.ray_quota = self.ray_quota.min(share as u32).max(traversal.least_quota());
        self
    }

    /// Iterations of all loops of an invocation together in one dispatch, at most. The test that ends a loop counts too.
    pub fn iterations(&self, caps: &Caps, traversal: DeviceTraversal) -> u64 {
        let ray = match traversal {
            DeviceTraversal::Bvh2 => {
                let leaves_on_the_stack = (MAX_DEPTH + 1) * MAX_LEAF_SIZE;
                let walk_back = MAX_DEPTH + 1;
                u64::from(self.ray_quota) + u64::from(leaves_on_the_stack + walk_back)
            }
            DeviceTraversal::Kd { longest_leaf } => {
                let rounds = KdRounds {
                    waits: self.caches.postpone || self.caches.vote,
                    filters: false,
                };
                DeviceTraversal::kd_iterations(longest_leaf, self.ray_quota, lanes_in_sum(caps, traversal), rounds)
            }
            DeviceTraversal::Wide => {
                DeviceTraversal::wide_iterations(self.ray_quota, lanes_in_sum(caps, traversal), false)
            }
            DeviceTraversal::TwoLevel => {
                DeviceTraversal::two_level_iterations(self.ray_quota, lanes_in_sum(caps, traversal), false)
            }
            // Of rays that try all triangles.
            DeviceTraversal::Driver => u64::from(self.ray_quota),
        };
        match self.execution {
            Execution::RayPerThread => ray,
            Execution::Persistent(threads) => {
                let lanes = threads.lanes(caps);
                let rays = u64::from(threads.batch.div_ceil(lanes));
                let loads = match self.caches.node_levels {
                    0 => 0,
                    levels => (1u64 << levels).div_ceil(u64::from(lanes)) * LOAD_ITERATIONS,
                };
                u64::from(threads.fetches)
                    .saturating_mul(rays * (ray + 1) + 2)
                    .saturating_add(loads)
            }
        }
    }

    pub(super) fn check(&self, caps: &Caps, traversal: DeviceTraversal) -> Result<()> {
        check_range("trace.ray_quota", self.ray_quota, traversal.least_quota(), u32::MAX)?;
        if let Execution::Persistent(threads) = self.execution {
            if traversal == DeviceTraversal::Driver {
                let cause = "is not for the driver's acceleration structure, which has one invocation per ray";
                return Err(Error::setting("trace.execution", "persistent", cause));
            }
            check_range("trace.groups", threads.groups, 1, 65_535)?;
            check_range("trace.batch", threads.batch, 1, 16_384)?;
            check_range("trace.fetches", threads.fetches, 1, u32::MAX)?;
            check_range("trace.subgroups", threads.subgroups, 1, 32)?;
        }
        self.caches.check()?;
        if !matches!(traversal, DeviceTraversal::Kd { .. }) {
            self.caches.check_absent("are of kd-trees")?;
        } else if self.scheme != Scheme::Stack {
            self.caches.check_absent("are of traversals by a stack")?;
        } else if self.execution == Execution::RayPerThread {
            self.caches.check_absent("are of persistent threads")?;
        }
        if self.caches.vote && !caps.subgroup.vote {
            return Err(Error::MissingFeature {
                feature: "subgroup votes in compute shaders".into(),
                needed_by: "kd.vote".into(),
                device: caps.device.clone(),
                instead: "trace without `vote`".into(),
            });
        }
        let iterations = self.iterations(caps, traversal);
        if caps.kind == DeviceKind::Cpu && iterations > u64::from(SOFTWARE_LOOP_CAP) {
            let cause = format!(
                "lets an invocation run {iterations} iterations; software devices end loops after {SOFTWARE_LOOP_CAP}"
            );
            return Err(match self.execution {
                Execution::RayPerThread => Error::setting("trace.ray_quota", self.ray_quota, cause),
                Execution::Persistent(threads) => Error::setting("trace.fetches", threads.fetches, cause),
            });
        }
        Ok(())
    }
}

/// Lanes of a queue's workgroup: a subgroup, so that no lane waits for the rays of another one.
fn group_size(caps: &Caps) -> u32 {
    caps.subgroup_size.clamp(1, 128)
}

/// Lanes whose loop iterations add up in a subgroup.
fn lanes_in_sum(caps: &Caps, traversal: DeviceTraversal) -> u32 {
    match traversal {
        DeviceTraversal::Bvh2 | DeviceTraversal::Driver => 1,
        DeviceTraversal::Kd { .. } | DeviceTraversal::Wide | DeviceTraversal::TwoLevel => caps.subgroup_size.max(1),
    }
}
