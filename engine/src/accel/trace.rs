//! Closest hits of a buffer of rays on the device, or whether they meet anything, in either model of execution: one invocation per ray, or persistent threads that fetch
//! rays from a queue.
//!
//! Sources: T. Aila and S. Laine, "Understanding the Efficiency of Ray Traversal on GPUs", HPG 2009 (persistent threads); "Interactive
//! Manycore Photon Mapping", 2011, §2.2.3.4 and appendix A.1 (both models beside each other). The kernels are
//! `shaders/accel/trace_rays.comp`, `trace_queue.comp` and, where subgroups vote, `trace_queue_vote.comp`.
//!
//! Guarantees: all give the hits and, but for votes, the exact work of [`Traversal`](super::bvh2::Traversal), [`KdTraversal`](super::kd::KdTraversal) and [`WideTraversal`](super::wide::WideTraversal); no ray is lost and none is traced twice,
//! since queues have quotas and what they leave is dispatched again; no workgroup waits for another. Which workgroup traces which ray
//! differs from run to run, and shows in nothing but the time. In the driver's structure ([`driver`](super::driver)), one invocation per ray, hits are the
//! same, and how many triangles are tried is the driver's.

mod settings;

pub use settings::{Execution, PersistentThreads, Query, TraceSettings};

use super::kd::KdCounters;
use super::{DeviceTraversal, Hit, IndexBinding, IndexOnDevice, Ray, RayIndex, TraversalCounters};
use crate::catalogue::{Role, Row, sources};
use crate::gpu::ash::vk;
use crate::gpu::shaders::accel::trace_queue::{self, TraceQueue, TraceStatus};
use crate::gpu::shaders::accel::{trace_queue_vote, trace_rays};
use crate::gpu::{
    AccelerationStructure, Access, Buffer, BufferDesc, Category, ComputePipeline, Gpu, PipelineInfo, Recorder,
    TexelView, Timings, wide_counter,
};
use crate::{Error, Result};

/// Most rays of one call.
pub const MAX_RAYS: usize = 1 << 31;

/// Dispatches of one submission, so that none takes seconds.
const DISPATCHES_PER_SUBMISSION: u32 = 1024;

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
        self.timings.seconds_of(TRACE_PASS)
    }
}

const TRACE_PASS: &str = "trace";

#[derive(Debug)]
enum Kernel {
    RayPerThread(ComputePipeline<trace_rays::Kernel>),
    Queue(PersistentThreads, QueueKernel),
}

/// The kernels of persistent threads: of one interface, but of types of their own.
#[derive(Debug)]
enum QueueKernel {
    Plain(ComputePipeline<trace_queue::Kernel>),
    Vote(ComputePipeline<trace_queue_vote::Kernel>),
}

/// The specialization of a queue's kernel.
macro_rules! queue_spec {
    ($kernel:ident, $caps:expr, $threads:expr, $settings:expr, $traversal:expr) => {{
        let (kd_flags, kd_push_down, kd_short_stack) = $settings.scheme.specialization();
        $kernel::Spec {
            local_size_x: $threads.lanes($caps),
            trace_fetches: $threads.fetches,
            trace_batch: $threads.batch,
            index_quota: $settings.ray_quota,
            index_count: $settings.count,
            index_kind: $traversal.kind(),
            trace_any: $settings.query == Query::Any,
            kd_flags,
            kd_push_down,
            kd_short_stack,
            kd_cache_levels: $settings.caches.node_levels,
            kd_stack_cache: $settings.caches.stack_specialization(),
            kd_postpones: $settings.caches.postpone,
        }
    }};
}

/// A dispatch of a queue's kernel.
macro_rules! dispatch_queue {
    ($kernel:ident, $pipeline:expr, $pass:expr, $buffers:expr, $index:expr, $count:expr, $groups:expr) => {{
        let set = $kernel::Set0 {
            trace_rays: $buffers.rays.view(),
            trace_hits: $buffers.hits.view(),
            trace_resume: $buffers.resume.view(),
            trace_status: $buffers.status.view(),
            trace_queue: $buffers.queue.view(),
        };
        let push = $kernel::Push {
            first_ray: 0,
            ray_count: $count,
        };
        $pass.dispatch($pipeline, &[&set, $index], &push, [$groups, 1, 1])
    }};
}

/// An index on a device and the kernel that traces rays in it.
#[derive(Debug)]
pub struct RayTracer {
    gpu: Gpu,
    kernel: Kernel,
    texels: TexelView,
    structure: Option<AccelerationStructure>,
    traversal: DeviceTraversal,
    settings: TraceSettings,
}

/// Rays of a call, what they have met, and where those go on that were stopped.
#[derive(Debug)]
pub struct TraceBuffers {
    count: u32,
    /// The rays, [`Ray`] each.
    pub rays: Buffer,
    /// The hits, [`Hit`] each.
    pub hits: Buffer,
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
        if traversal == DeviceTraversal::Driver {
            let cause = "is no index of texels; RayTracer::on_device takes it";
            return Err(Error::setting("index", "driver", cause));
        }
        Self::make(gpu, index, None, traversal, settings)
    }

    /// The same for an index of any kind that is on the device.
    ///
    /// # Errors
    /// As [`RayTracer::new`]; [`Error::Setting`] for persistent threads in the driver's structure.
    pub fn on_device(gpu: &Gpu, index: &IndexOnDevice, settings: &TraceSettings) -> Result<Self> {
        let (texels, structure) = (index.texels.clone(), index.structure.clone());
        Self::make(gpu, texels, structure, index.traversal, settings)
    }

    fn make(
        gpu: &Gpu,
        texels: TexelView,
        structure: Option<AccelerationStructure>,
        traversal: DeviceTraversal,
        settings: &TraceSettings,
    ) -> Result<Self> {
        settings.check(gpu.caps(), traversal)?;
        let (index_quota, index_count) = (settings.ray_quota, settings.count);
        let index_kind = traversal.kind();
        let trace_any = settings.query == Query::Any;
        let (kd_flags, kd_push_down, kd_short_stack) = settings.scheme.specialization();
        let kernel = match settings.execution {
            Execution::RayPerThread => {
                let spec = trace_rays::Spec {
                    index_quota,
                    index_count,
                    index_kind,
                    trace_any,
                    kd_flags,
                    kd_push_down,
                    kd_short_stack,
                };
                Kernel::RayPerThread(traversal.pipeline(gpu, &spec)?)
            }
            Execution::Persistent(threads) => {
                let caps = gpu.caps();
                let kernel = if settings.caches.vote {
                    let spec = queue_spec!(trace_queue_vote, caps, threads, settings, traversal);
                    QueueKernel::Vote(gpu.compute_pipeline(&spec)?)
                } else {
                    let spec = queue_spec!(trace_queue, caps, threads, settings, traversal);
                    QueueKernel::Plain(gpu.compute_pipeline(&spec)?)
                };
                Kernel::Queue(threads, kernel)
            }
        };
        Ok(Self {
            gpu: gpu.clone(),
            kernel,
            texels,
            structure,
            traversal,
            settings: *settings,
        })
    }

    /// The settings as they are now, those that [`RayTracer::tune`] has chosen among them.
    pub fn settings(&self) -> TraceSettings {
        let execution = match &self.kernel {
            Kernel::RayPerThread(_) => Execution::RayPerThread,
            Kernel::Queue(threads, _) => Execution::Persistent(*threads),
        };
        TraceSettings {
            execution,
            ..self.settings
        }
    }

    /// The kernel with its specialization.
    pub fn pipeline(&self) -> PipelineInfo {
        match &self.kernel {
            Kernel::RayPerThread(pipeline) => pipeline.info(),
            Kernel::Queue(_, QueueKernel::Plain(pipeline)) => pipeline.info(),
            Kernel::Queue(_, QueueKernel::Vote(pipeline)) => pipeline.info(),
        }
    }

    /// Workgroups of a dispatch, of persistent threads.
    pub fn groups(&self) -> Option<u32> {
        match &self.kernel {
            Kernel::RayPerThread(_) => None,
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
        let buffers = self.buffers(rays.len() as u32)?;
        self.gpu.upload(&buffers.rays, 0, rays)?;
        loop {
            self.round(&buffers, &mut traced)?;
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

    /// Memory for so many rays.
    ///
    /// # Errors
    /// [`Error::Setting`] for none or for more than [`MAX_RAYS`], [`Error::LimitExceeded`] when a buffer is larger than the device binds,
    /// [`Error::OutOfMemory`].
    pub fn buffers(&self, count: u32) -> Result<TraceBuffers> {
        let buffer = |name, bytes: u64| self.gpu.buffer(&BufferDesc::storage(name, bytes, Category::Work));
        let rays = buffer("rays", size_of::<Ray>() as u64 * u64::from(count))?;
        let hits = buffer("hits", size_of::<Hit>() as u64 * u64::from(count))?;
        self.buffers_over(count, &rays, &hits)
    }

    /// The same over rays and hits of the caller's, such as a host's ([`Gpu::borrow_buffer`]): storage buffers of [`Ray`] and [`Hit`].
    ///
    /// # Errors
    /// As [`RayTracer::buffers`], where one of them is too small, too.
    pub fn buffers_over(&self, count: u32, rays: &Buffer, hits: &Buffer) -> Result<TraceBuffers> {
        if count == 0 || count as usize > MAX_RAYS {
            return Err(Error::setting("rays", count, format!("is not from 1 to {MAX_RAYS}")));
        }
        for (buffer, bytes) in [(rays, size_of::<Ray>()), (hits, size_of::<Hit>())] {
            let value = bytes as u64 * u64::from(count);
            if buffer.bytes() < value {
                return Err(Error::LimitExceeded {
                    name: buffer.name().into(),
                    value,
                    limit_name: "size",
                    limit: buffer.bytes(),
                });
            }
        }
        let buffer = |name, bytes: u64| self.gpu.buffer(&BufferDesc::storage(name, bytes, Category::Work));
        Ok(TraceBuffers {
            count,
            rays: rays.clone(),
            hits: hits.clone(),
            resume: buffer("resume", 4 * u64::from(count))?,
            status: buffer("trace status", size_of::<TraceStatus>() as u64)?,
            queue: buffer("trace queue", size_of::<TraceQueue>() as u64)?,
        })
    }

    /// Records the tracing of the rays that are in `buffers`, in `rounds` rounds (at least one): in each a ray takes as many iterations as
    /// its quota allows, and those that have ended cost little. Passes `trace: begin` and `trace` for each. [`RayTracer::unfinished`] says
    /// afterwards whether rays are left, whose hits do not count yet; [`RayTracer::record_on`] goes on with them.
    ///
    /// Barriers: rays and index must have been made visible to compute shaders. Earlier uses of the buffers by compute shaders are waited for.
    /// After it hits are visible to compute shaders and copies.
    ///
    /// # Errors
    /// As [`Pass::dispatch`](crate::gpu::Pass::dispatch).
    pub fn record(&self, recorder: &mut Recorder, buffers: &TraceBuffers, rounds: u32) -> Result<()> {
        for round in 0..rounds.max(1) {
            self.record_round(recorder, buffers, round == 0)?;
        }
        Ok(())
    }

    /// Records one more round, for the rays that [`RayTracer::record`] has left unfinished. Barriers: as there.
    ///
    /// # Errors
    /// As [`RayTracer::record`].
    pub fn record_on(&self, recorder: &mut Recorder, buffers: &TraceBuffers) -> Result<()> {
        self.record_round(recorder, buffers, false)
    }

    /// Rays that their quota stopped in the last round; waits for what was submitted.
    ///
    /// # Errors
    /// [`Error::DeviceLost`], [`Error::OutOfMemory`].
    pub fn unfinished(&self, buffers: &TraceBuffers) -> Result<u32> {
        let status = self.gpu.read::<TraceStatus>(buffers.status.view(), 1)?;
        Ok(status.first().map_or(0, |status| status.unfinished))
    }

    fn record_round(&self, recorder: &mut Recorder, buffers: &TraceBuffers, is_first: bool) -> Result<()> {
        self.record_begin(recorder, buffers, is_first, true)?;
        self.record_dispatches(recorder, buffers, self.dispatches(buffers.count), &mut 0)
    }

    /// Records the barriers before a round's dispatches, and its counters where it `begins`.
    fn record_begin(
        &self,
        recorder: &mut Recorder,
        buffers: &TraceBuffers,
        is_first: bool,
        begins: bool,
    ) -> Result<()> {
        recorder.pass("trace: begin", |pass| {
            pass.memory_barrier(Access::COMPUTE, Access::COMPUTE.union(Access::TRANSFER_WRITE));
            if begins {
                if is_first {
                    pass.fill(buffers.resume.view(), 0)?;
                }
                pass.fill(buffers.status.view(), 0)?;
                pass.fill(buffers.queue.view(), 0)?;
            }
            pass.memory_barrier(Access::TRANSFER_WRITE, Access::COMPUTE);
            Ok(())
        })
    }

    fn record_dispatches(
        &self,
        recorder: &mut Recorder,
        buffers: &TraceBuffers,
        dispatches: u32,
        first: &mut u32,
    ) -> Result<()> {
        recorder.pass(TRACE_PASS, |pass| {
            for _ in 0..dispatches {
                self.dispatch(pass, buffers, first, buffers.count)?;
                pass.memory_barrier(Access::COMPUTE, Access::COMPUTE.union(Access::TRANSFER));
            }
            Ok(())
        })
    }

    /// Goes through all rays once, in as many dispatches as that takes.
    fn round(&self, buffers: &TraceBuffers, traced: &mut Traced) -> Result<()> {
        let mut dispatches = self.dispatches(buffers.count);
        let mut first = 0;
        let mut begins = true;
        while dispatches > 0 {
            let mut recorder = self.gpu.recorder("trace")?;
            self.record_begin(&mut recorder, buffers, traced.rounds == 0, begins)?;
            let now = dispatches.min(DISPATCHES_PER_SUBMISSION);
            self.record_dispatches(&mut recorder, buffers, now, &mut first)?;
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
            Kernel::RayPerThread(kernel) => kernel.groups_for(count).div_ceil(self.gpu.caps().max_workgroups[0]),
            Kernel::Queue(threads, _) => {
                let crew = u64::from(threads.groups) * u64::from(threads.fetches);
                u64::from(count.div_ceil(threads.batch)).div_ceil(crew) as u32
            }
        }
    }

    fn dispatch(
        &self,
        pass: &mut crate::gpu::Pass<'_>,
        buffers: &TraceBuffers,
        first: &mut u32,
        count: u32,
    ) -> Result<()> {
        let index = IndexBinding::new(&self.texels, self.structure.as_ref());
        match &self.kernel {
            Kernel::RayPerThread(kernel) => {
                let most = u64::from(self.gpu.caps().max_workgroups[0]) * u64::from(kernel.group_size());
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
                let groups = threads.groups;
                match kernel {
                    QueueKernel::Plain(kernel) => {
                        dispatch_queue!(trace_queue, kernel, pass, buffers, &index, count, groups)
                    }
                    QueueKernel::Vote(kernel) => {
                        dispatch_queue!(trace_queue_vote, kernel, pass, buffers, &index, count, groups)
                    }
                }
            }
        }
    }
}

/// Rows of the catalogue.
pub(crate) const ROWS: &[Row] = &[
    Row {
        id: "PM-X-1",
        name: "closest hits of a buffer of rays: one thread per ray",
        role: Role::Kernel,
        limits: "A subgroup takes as long as its slowest ray.",
        sources: &[sources::AILA_LAINE_2009.whole()],
        shaders: &["shaders/accel/trace_rays.comp"],
        tests: &[
            "tests/tests/accel/persistent_threads.rs::both_models_trace_every_ray_once_and_find_what_the_twin_finds",
            "tests/tests/accel/ray_index.rs::kernels_are_their_twins_on_soups",
            "tests/tests/accel/ray_index.rs::kernels_are_their_twins_on_hard_cases",
        ],
        api: &["clerestory::accel::trace::RayTracer"],
        settings: &["clerestory::accel::trace::TraceSettings"],
        ..Row::of(file!())
    },
    Row {
        id: "PM-X-2",
        name: "closest hits of a buffer of rays: persistent threads on a queue with quotas",
        role: Role::Kernel,
        limits: "Which workgroup traces which ray differs from run to run, and shows only in the time; on the software driver kd-trees are slower by the queue than by one thread per ray.",
        sources: &[
            sources::AILA_LAINE_2009.whole(),
            sources::FABIANOWSKI_2011.at("§2.2.3.4"),
        ],
        shaders: &["shaders/accel/trace_queue.comp", "shaders/accel/trace_queue_vote.comp"],
        tests: &[
            "tests/tests/accel/persistent_threads.rs::both_models_trace_every_ray_once_and_find_what_the_twin_finds",
            "tests/tests/accel/persistent_threads.rs::a_queue_without_a_quota_loses_rays_where_loops_are_capped_and_one_with_a_quota_none",
            "tests/tests/accel/persistent_threads.rs::a_queue_of_many_rays_traces_each_once",
            "tests/tests/accel/persistent_threads.rs::settings_that_could_lose_rays_are_refused",
        ],
        api: &["clerestory::accel::trace::RayTracer"],
        settings: &[
            "clerestory::accel::trace::TraceSettings",
            "clerestory::accel::trace::PersistentThreads",
        ],
        ..Row::of(file!())
    },
];
