//! Closest hits of a buffer of rays on the device, or whether they meet anything, in either model of execution: one invocation a ray, or persistent threads that fetch
//! rays from a queue.
//!
//! Sources: T. Aila and S. Laine, "Understanding the Efficiency of Ray Traversal on GPUs", HPG 2009 (persistent threads); "Interactive
//! Manycore Photon Mapping", 2011, §2.2.3.4 and appendix A.1 (both models beside each other). The kernels are
//! `shaders/accel/trace_rays.comp` and `trace_queue.comp`.
//!
//! Guarantees: both give the hits and the exact work of [`Traversal`](super::bvh2::Traversal) and [`KdTraversal`](super::kd::KdTraversal); no ray is lost and none is traced twice,
//! since queues have quotas and what they leave is dispatched again; no workgroup waits for another. Which workgroup traces which ray
//! differs from run to run, and shows in nothing but the time.

use super::bvh2::build::check_range;
use super::bvh2::{MAX_DEPTH, MAX_LEAF_SIZE};
use super::kd::{KdCaches, KdCounters, Scheme};
use super::{DeviceTraversal, Hit, Ray, RayIndex, TraversalCounters};
use crate::gpu::ash::vk;
use crate::gpu::shaders::accel::trace_queue::{self, TraceQueue, TraceStatus};
use crate::gpu::shaders::accel::trace_rays;
use crate::gpu::shaders::sets::IndexSet;
use crate::gpu::{Access, Buffer, BufferDesc, Caps, Category, ComputePipeline, DeviceKind, Gpu, TexelView, Timings};
use crate::{Error, Result};

/// Iterations of all loops of an invocation together after which software drivers end loops in silence.
pub const SOFTWARE_LOOP_CAP: u32 = 65_535;

/// Most rays of one call.
pub const MAX_RAYS: usize = 1 << 31;

/// Loop iterations in which a lane loads a cached node and its box, at most.
const LOAD_ITERATIONS: u64 = 16;

/// Batches of a dispatch where quotas are fitted to a cap.
const FITTED_FETCHES: u32 = 4;

/// Dispatches of one submission, so that none takes seconds.
const DISPATCHES_A_SUBMISSION: u32 = 1024;

/// How rays are dealt out to invocations.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Execution {
    /// As many invocations as rays; the driver's scheduler deals them out.
    ThreadARay,
    /// As many workgroups as stay on the device, which fetch batches of rays from a counter.
    Persistent(PersistentThreads),
}

/// The size of a queue's crew and its quota.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize)]
pub struct PersistentThreads {
    /// Workgroups of a dispatch, 1..=65,535; best as many as stay resident, which only a measurement tells (see
    /// [`RayTracer::tune`]).
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
    fn lanes(&self, caps: &Caps) -> u32 {
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

/// Settings of a [`RayTracer`].
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
    /// One invocation a ray.
    pub fn thread_a_ray() -> Self {
        Self {
            query: Query::Closest,
            execution: Execution::ThreadARay,
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
        if let Execution::Persistent(threads) = &mut self.execution {
            threads.batch = threads.batch.min(threads.lanes(caps));
            fetches = threads.fetches.clamp(1, FITTED_FETCHES);
            threads.fetches = fetches;
        }
        let unstopped = Self { ray_quota: 0, ..self }.iterations(caps, traversal);
        let left = u64::from(SOFTWARE_LOOP_CAP).saturating_sub(unstopped);
        let share = left / u64::from(fetches * lanes_in_sum(caps, traversal));
        self.ray_quota = self.ray_quota.min(share as u32).max(MAX_DEPTH + 1);
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
            DeviceTraversal::Kd { mut longest_leaf } => {
                if self.caches.postpone {
                    longest_leaf = longest_leaf.saturating_mul(2);
                }
                DeviceTraversal::kd_iterations(longest_leaf, self.ray_quota, lanes_in_sum(caps, traversal))
            }
        };
        match self.execution {
            Execution::ThreadARay => ray,
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

    fn check(&self, caps: &Caps, traversal: DeviceTraversal) -> Result<()> {
        check_range("trace.ray_quota", self.ray_quota, MAX_DEPTH + 1, u32::MAX)?;
        if let Execution::Persistent(threads) = self.execution {
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
        } else if self.execution == Execution::ThreadARay {
            self.caches.check_absent("are of persistent threads")?;
        }
        let iterations = self.iterations(caps, traversal);
        if caps.kind == DeviceKind::Cpu && iterations > u64::from(SOFTWARE_LOOP_CAP) {
            let cause = format!(
                "lets an invocation run {iterations} iterations; software devices end loops after {SOFTWARE_LOOP_CAP}"
            );
            return Err(match self.execution {
                Execution::ThreadARay => Error::setting("trace.ray_quota", self.ray_quota, cause),
                Execution::Persistent(threads) => Error::setting("trace.fetches", threads.fetches, cause),
            });
        }
        Ok(())
    }
}

/// A counter of the kernels: two words, the low one first.
pub fn wide_counter([low, high]: [u32; 2]) -> u64 {
    u64::from(high) << 32 | u64::from(low)
}

/// Lanes of a queue's workgroup: a subgroup, so that no lane waits for the rays of another one.
fn group_size(caps: &Caps) -> u32 {
    caps.subgroup_size.clamp(1, 128)
}

/// Lanes whose loop iterations add up in a subgroup.
fn lanes_in_sum(caps: &Caps, traversal: DeviceTraversal) -> u32 {
    match traversal {
        DeviceTraversal::Bvh2 => 1,
        DeviceTraversal::Kd { .. } => caps.subgroup_size.max(1),
    }
}

/// What rays met, and the work it took.
#[derive(Debug, Clone, Default)]
pub struct Traced {
    /// The hit of each ray.
    pub hits: Vec<Hit>,
    /// Exact work, when it was counted.
    pub work: TraversalCounters,
    /// The same in more detail, of kd-trees.
    pub kd_work: KdCounters,
    /// Batches that were fetched, all rounds together, when work was counted; 0 without a queue.
    pub batches: u64,
    /// Rays that were fetched, all rounds together, when work was counted; 0 without a queue.
    pub fetched_rays: u64,
    /// Rays that were stopped by their quota, all rounds together.
    pub unfinished: u64,
    /// Times that the rays were gone through, until none was unfinished.
    pub rounds: u32,
    /// Dispatches.
    pub dispatches: u32,
    /// Passes: `trace: begin` and, for the tracing, `trace`.
    pub timings: Timings,
}

impl Traced {
    /// GPU seconds of the tracing; 0 without timestamps.
    pub fn seconds(&self) -> f64 {
        let passes = self.timings.passes.iter().filter(|pass| pass.name == TRACE_PASS);
        passes
            .filter_map(|pass| pass.nanoseconds)
            .map(|ns| ns as f64 * 1e-9)
            .sum()
    }
}

const TRACE_PASS: &str = "trace";

#[derive(Debug)]
enum Kernel {
    ThreadARay(ComputePipeline<trace_rays::Kernel>),
    Queue(PersistentThreads, ComputePipeline<trace_queue::Kernel>),
}

/// An index on a device and the kernel that traces rays in it.
#[derive(Debug)]
pub struct RayTracer {
    gpu: Gpu,
    kernel: Kernel,
    index: TexelView,
    traversal: DeviceTraversal,
    settings: TraceSettings,
}

struct Buffers {
    rays: Buffer,
    hits: Buffer,
    resume: Buffer,
    status: Buffer,
    queue: Buffer,
}

impl RayTracer {
    /// Uploads the index and makes the kernel.
    ///
    /// # Errors
    /// [`Error::Setting`] for settings out of range, or with which a software device could lose rays; [`Error::LimitExceeded`] for an index
    /// that does not fit the device; [`Error::OutOfMemory`].
    pub fn new(gpu: &Gpu, index: &dyn RayIndex, settings: &TraceSettings) -> Result<Self> {
        let format = vk::Format::R32G32B32A32_UINT;
        let texels = gpu.texels_with(index.name(), Category::Index, format, index.texels())?;
        Self::with_texels(gpu, texels, index.device_traversal(), settings)
    }

    /// The same for an index that is on the device, such as [`ResidentLbvh::quarters`](super::lbvh::ResidentLbvh::quarters): texels as
    /// [`RayIndex::texels`] has them.
    ///
    /// # Errors
    /// As [`RayTracer::new`].
    pub fn with_texels(
        gpu: &Gpu,
        index: TexelView,
        traversal: DeviceTraversal,
        settings: &TraceSettings,
    ) -> Result<Self> {
        settings.check(gpu.caps(), traversal)?;
        let (index_quota, index_count) = (settings.ray_quota, settings.count);
        let index_kind = traversal.kind();
        let trace_any = settings.query == Query::Any;
        let (kd_flags, kd_push_down, kd_short_stack) = settings.scheme.specialization();
        let kernel = match settings.execution {
            Execution::ThreadARay => Kernel::ThreadARay(gpu.compute_pipeline(&trace_rays::Spec {
                index_quota,
                index_count,
                index_kind,
                trace_any,
                kd_flags,
                kd_push_down,
                kd_short_stack,
            })?),
            Execution::Persistent(threads) => {
                let spec = trace_queue::Spec {
                    local_size_x: threads.lanes(gpu.caps()),
                    trace_fetches: threads.fetches,
                    trace_batch: threads.batch,
                    index_quota,
                    index_count,
                    index_kind,
                    trace_any,
                    kd_flags,
                    kd_push_down,
                    kd_short_stack,
                    kd_cache_levels: settings.caches.node_levels,
                    kd_stack_cache: settings.caches.stack_specialization(),
                    kd_postpones: settings.caches.postpone,
                };
                Kernel::Queue(threads, gpu.compute_pipeline(&spec)?)
            }
        };
        Ok(Self {
            gpu: gpu.clone(),
            kernel,
            index,
            traversal,
            settings: *settings,
        })
    }

    /// The settings as they are now, those that [`RayTracer::tune`] has chosen among them.
    pub fn settings(&self) -> TraceSettings {
        let execution = match &self.kernel {
            Kernel::ThreadARay(_) => Execution::ThreadARay,
            Kernel::Queue(threads, _) => Execution::Persistent(*threads),
        };
        TraceSettings {
            execution,
            ..self.settings
        }
    }

    /// Workgroups of a dispatch, of persistent threads.
    pub fn groups(&self) -> Option<u32> {
        match &self.kernel {
            Kernel::ThreadARay(_) => None,
            Kernel::Queue(threads, _) => Some(threads.groups),
        }
    }

    /// Tries powers of two for the number of workgroups on `rays` and keeps the fastest; does nothing where there is no queue, where the
    /// device has no timestamps, or without rays. Returns what [`RayTracer::groups`] is now.
    ///
    /// # Errors
    /// As [`RayTracer::trace`].
    pub fn tune(&mut self, rays: &[Ray]) -> Result<Option<u32>> {
        const MOST: u32 = 1 << 14;
        // The first run may compile the kernel.
        let first = self.trace(rays)?;
        if rays.is_empty() || first.timings.untimed.is_some() {
            return Ok(self.groups());
        }
        let mut best: Option<(f64, u32)> = None;
        let mut groups = 1;
        while let Kernel::Queue(threads, _) = &mut self.kernel
            && groups <= MOST
        {
            threads.groups = groups;
            let seconds = self.trace(rays)?.seconds();
            match best {
                // Twice as slow as the best: more will not help.
                Some((least, _)) if seconds > 2.0 * least => break,
                Some((least, _)) if seconds >= least => {}
                _ => best = Some((seconds, groups)),
            }
            groups *= 2;
        }
        if let (Kernel::Queue(threads, _), Some((_, groups))) = (&mut self.kernel, best) {
            threads.groups = groups;
        }
        Ok(self.groups())
    }

    /// Traces rays to the end, each once.
    ///
    /// # Errors
    /// [`Error::Setting`] for more than [`MAX_RAYS`], [`Error::LimitExceeded`] when a buffer is larger than the device binds,
    /// [`Error::OutOfMemory`], [`Error::DeviceLost`].
    pub fn trace(&self, rays: &[Ray]) -> Result<Traced> {
        if rays.len() > MAX_RAYS {
            return Err(Error::setting("rays", rays.len(), format!("is above {MAX_RAYS}")));
        }
        let mut traced = Traced::default();
        if rays.is_empty() {
            return Ok(traced);
        }
        let count = rays.len() as u32;
        let buffer = |name, bytes: u64| self.gpu.buffer(&BufferDesc::storage(name, bytes, Category::Work));
        let buffers = Buffers {
            rays: self.gpu.buffer_with("rays", Category::Work, rays)?,
            hits: buffer("hits", size_of::<Hit>() as u64 * u64::from(count))?,
            resume: buffer("resume", 4 * u64::from(count))?,
            status: buffer("trace status", size_of::<TraceStatus>() as u64)?,
            queue: buffer("trace queue", size_of::<TraceQueue>() as u64)?,
        };
        loop {
            self.round(&buffers, count, &mut traced)?;
            traced.rounds += 1;
            let [status] = self.gpu.read::<TraceStatus>(buffers.status.view(), 1)?[..] else {
                break;
            };
            let [queue] = self.gpu.read::<TraceQueue>(buffers.queue.view(), 1)?[..] else {
                break;
            };
            if self.settings.count {
                traced.work.nodes += wide_counter(status.node_visits);
                traced.work.triangles += wide_counter(status.triangle_tests);
                traced.work.iterations += wide_counter(status.iterations);
                traced.kd_work.leaves += wide_counter(status.kd_leaves);
                traced.kd_work.pushes += wide_counter(status.kd_pushes);
                traced.kd_work.pops += wide_counter(status.kd_pops);
                traced.kd_work.restarts += wide_counter(status.kd_restarts);
                traced.kd_work.cached_nodes += wide_counter(status.kd_cached_nodes);
                traced.kd_work.register_pushes += wide_counter(status.kd_register_pushes);
                traced.kd_work.register_pops += wide_counter(status.kd_register_pops);
            }
            traced.batches += u64::from(queue.batches);
            traced.fetched_rays += u64::from(queue.fetched_rays);
            traced.unfinished += u64::from(status.unfinished);
            if status.unfinished == 0 {
                break;
            }
        }
        if let DeviceTraversal::Kd { .. } = self.traversal {
            traced.kd_work.nodes = traced.work.nodes;
            traced.kd_work.triangles = traced.work.triangles;
            traced.kd_work.iterations = traced.work.iterations;
        }
        traced.hits = self.gpu.read(buffers.hits.view(), rays.len())?;
        Ok(traced)
    }

    /// Goes through all rays once, in as many dispatches as that takes.
    fn round(&self, buffers: &Buffers, count: u32, traced: &mut Traced) -> Result<()> {
        let mut dispatches = self.dispatches(count);
        let mut first = 0;
        let mut begins = true;
        while dispatches > 0 {
            let mut recorder = self.gpu.recorder("trace")?;
            recorder.pass("trace: begin", |pass| {
                pass.memory_barrier(Access::COMPUTE, Access::COMPUTE.union(Access::TRANSFER_WRITE));
                if begins {
                    if traced.rounds == 0 {
                        pass.fill(buffers.resume.view(), 0)?;
                    }
                    pass.fill(buffers.status.view(), 0)?;
                    pass.fill(buffers.queue.view(), 0)?;
                }
                pass.memory_barrier(Access::TRANSFER_WRITE, Access::COMPUTE);
                Ok(())
            })?;
            let now = dispatches.min(DISPATCHES_A_SUBMISSION);
            recorder.pass(TRACE_PASS, |pass| {
                for _ in 0..now {
                    self.dispatch(pass, buffers, &mut first, count)?;
                    pass.memory_barrier(Access::COMPUTE, Access::COMPUTE.union(Access::TRANSFER));
                }
                Ok(())
            })?;
            let timings = recorder.submit()?.wait()?;
            traced.timings.untimed = timings.untimed;
            traced.timings.passes.extend(timings.passes);
            traced.dispatches += now;
            dispatches -= now;
            begins = false;
        }
        Ok(())
    }

    /// Dispatches that go through `count` rays. Of a queue's none but the last leaves a workgroup with less than its quota.
    fn dispatches(&self, count: u32) -> u32 {
        match &self.kernel {
            Kernel::ThreadARay(kernel) => kernel.groups_for(count).div_ceil(self.gpu.caps().max_workgroups),
            Kernel::Queue(threads, _) => {
                let crew = u64::from(threads.groups) * u64::from(threads.fetches);
                u64::from(count.div_ceil(threads.batch)).div_ceil(crew) as u32
            }
        }
    }

    fn dispatch(&self, pass: &mut crate::gpu::Pass<'_>, buffers: &Buffers, first: &mut u32, count: u32) -> Result<()> {
        let index = IndexSet {
            index_texels: &self.index,
        };
        match &self.kernel {
            Kernel::ThreadARay(kernel) => {
                let most = u64::from(self.gpu.caps().max_workgroups) * u64::from(kernel.group_size());
                let ray_count = u64::from(count - *first).min(most) as u32;
                let set = trace_rays::Set0 {
                    trace_rays: buffers.rays.view(),
                    trace_hits: buffers.hits.view(),
                    trace_resume: buffers.resume.view(),
                    trace_status: buffers.status.view(),
                };
                let push = trace_rays::Push {
                    first_ray: *first,
                    ray_count,
                };
                *first += ray_count;
                pass.dispatch(kernel, &[&set, &index], &push, [kernel.groups_for(ray_count), 1, 1])
            }
            Kernel::Queue(threads, kernel) => {
                let set = trace_queue::Set0 {
                    trace_rays: buffers.rays.view(),
                    trace_hits: buffers.hits.view(),
                    trace_resume: buffers.resume.view(),
                    trace_status: buffers.status.view(),
                    trace_queue: buffers.queue.view(),
                };
                let push = trace_queue::Push {
                    first_ray: 0,
                    ray_count: count,
                };
                pass.dispatch(kernel, &[&set, &index], &push, [threads.groups, 1, 1])
            }
        }
    }
}
