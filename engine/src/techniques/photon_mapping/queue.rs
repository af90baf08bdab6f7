//! Queues of the eye paths that ask a photon map, where they have arrived or on their way through media: which places of a wave a query's invocations are for.
//!
//! Source: B. Fabianowski, "Interactive Manycore Photon Mapping", PhD thesis, Trinity College Dublin, 2011, §7.4.1. Each place's sum is its own, so that the
//! picture does not depend on the queue. Points and rays have queues in the same memory. Nothing is compiled, allocated or recorded for a queue that was not asked for.

use std::sync::Arc;

use super::settings::MapQueue;
use crate::catalogue::{Role, Row, sources};
use crate::gpu::shaders::constants::{COMPACT_CHUNK, QUEUE_BLOCKS, QUEUE_COMPACTED, QUEUE_SLOTS, WALK_GROUP};
use crate::gpu::shaders::sets::{GatherQueue, WaveSet};
use crate::gpu::shaders::techniques::photon_mapping::{photon_queue_blocks, photon_queue_flags};
use crate::gpu::shaders::types::AskSettings;
use crate::gpu::{Access, Buffer, BufferDesc, BufferView, Category, ComputePipeline, Gpu, Pass, PipelineInfo};
use crate::kernels::{Count, IndirectCount, Partition, PartitionBuffers, PartitionOptions};
use crate::transport::{GpuScene, surface_spec};
use crate::walk::{Places, stage_barrier};
use crate::{Error, Result};

/// Places that a workgroup of the queue in blocks walks.
const PLACES_PER_GROUP: u32 = COMPACT_CHUNK * WALK_GROUP;

type Head = photon_queue_blocks::GatherQueueHead;

/// What the decision whether a place asks is specialized to, beside the scene.
#[derive(Debug, Clone, Copy)]
pub(super) struct AskSpec {
    pub has_path_automaton: bool,
    pub counts_bounces: bool,
    /// Whether rays through media ask, as photon_beam_ways.comp marked them, instead of points.
    pub of_rays: bool,
}

/// What queues of a wave are made of, which points and rays share: each queue is filled and its queries are made before the next one is filled.
pub(super) enum QueueMemory {
    /// Nothing: the places themselves.
    Slots,
    Compacted(Arc<CompactedMemory>),
    Blocks(Arc<BlocksMemory>),
}

/// Flags by place, and their compaction.
pub(super) struct CompactedMemory {
    partition: Partition,
    arguments: IndirectCount,
    slots: u32,
    head: Buffer,
    places: Buffer,
    flags: Buffer,
    flag_count: Buffer,
    /// Places that ask: one word.
    asking: Buffer,
    scratch: Buffer,
}

/// Blocks of places, as wide as subgroups.
pub(super) struct BlocksMemory {
    head: Buffer,
    places: Buffer,
    blocks: Buffer,
}

impl QueueMemory {
    /// For waves of up to `slots` paths.
    ///
    /// # Errors
    /// [`Error::OutOfMemory`].
    pub fn new(gpu: &Gpu, queue: MapQueue, slots: u32) -> Result<Self> {
        let words = |name: &str, words: u32| {
            let bytes = u64::from(words) * size_of::<u32>() as u64;
            gpu.buffer(&BufferDesc::storage(name, bytes, Category::Work))
        };
        match queue {
            MapQueue::Slots => Ok(Self::Slots),
            MapQueue::Compacted => {
                let partition = PartitionOptions {
                    numbers: true,
                    ..PartitionOptions::default()
                };
                let partition = Partition::new(gpu, partition)?;
                let scratch = BufferDesc::storage("gather scratch", partition.scratch_bytes(slots), Category::Work);
                let head = BufferDesc::storage("gather queue", IndirectCount::BYTES, Category::Work);
                Ok(Self::Compacted(Arc::new(CompactedMemory {
                    arguments: IndirectCount::new(gpu)?,
                    slots,
                    head: gpu.buffer(&head)?,
                    places: words("gather places", slots)?,
                    flags: words("gather flags", slots)?,
                    flag_count: words("gather flag count", 1)?,
                    asking: words("gather count", 1)?,
                    scratch: gpu.buffer(&scratch)?,
                    partition,
                })))
            }
            MapQueue::Blocks => {
                // Only the last block of a team is partial, and its team had walked a block's places for it.
                let places = slots.next_multiple_of(PLACES_PER_GROUP);
                let head = BufferDesc::storage("gather queue", size_of::<Head>() as u64, Category::Work);
                Ok(Self::Blocks(Arc::new(BlocksMemory {
                    head: gpu.buffer(&head)?,
                    places: words("gather places", places)?,
                    // However narrow blocks are.
                    blocks: words("gather blocks", places)?,
                })))
            }
        }
    }
}

/// A queue: what fills it, and its memory.
pub(super) enum Queue {
    /// The places themselves.
    Slots,
    Compacted(Compacted),
    Blocks(Blocks),
}

/// Flags places that ask, and compacts them.
pub(super) struct Compacted {
    flag: ComputePipeline<photon_queue_flags::Kernel>,
    memory: Arc<CompactedMemory>,
}

/// Appends blocks of places that ask.
pub(super) struct Blocks {
    append: ComputePipeline<photon_queue_blocks::Kernel>,
    memory: Arc<BlocksMemory>,
}

impl Queue {
    /// A queue in this memory.
    ///
    /// # Errors
    /// [`Error::OutOfMemory`].
    pub fn new(gpu: &Gpu, scene: &GpuScene, memory: &QueueMemory, spec: AskSpec) -> Result<Self> {
        let AskSpec {
            has_path_automaton,
            counts_bounces,
            of_rays,
        } = spec;
        match memory {
            QueueMemory::Slots => Ok(Self::Slots),
            QueueMemory::Compacted(memory) => {
                let flag = surface_spec!(photon_queue_flags, scene, {
                    has_media: scene.profile().media.any(),
                    has_path_automaton,
                    counts_bounces,
                    of_rays,
                    ..Default::default()
                });
                Ok(Self::Compacted(Compacted {
                    flag: gpu.compute_pipeline(&flag)?,
                    memory: Arc::clone(memory),
                }))
            }
            QueueMemory::Blocks(memory) => {
                // Both are powers of two, so that the lesser one divides the other.
                let queue_width = gpu.caps().subgroup_size.clamp(1, WALK_GROUP);
                let append = surface_spec!(photon_queue_blocks, scene, {
                    queue_width,
                    has_media: scene.profile().media.any(),
                    has_path_automaton,
                    counts_bounces,
                    of_rays,
                    ..Default::default()
                });
                Ok(Self::Blocks(Blocks {
                    append: gpu.compute_pipeline(&append)?,
                    memory: Arc::clone(memory),
                }))
            }
        }
    }

    /// Whether something is to be recorded before queries.
    pub fn collects(&self) -> bool {
        !matches!(self, Self::Slots)
    }

    /// How shaders call it.
    pub fn kind(&self) -> u32 {
        match self {
            Self::Slots => QUEUE_SLOTS,
            Self::Compacted(_) => QUEUE_COMPACTED,
            Self::Blocks(_) => QUEUE_BLOCKS,
        }
    }

    /// The kernels that decide who asks; a compaction's own are any buffer's.
    pub fn pipelines(&self) -> Vec<PipelineInfo> {
        match self {
            Self::Slots => Vec::new(),
            Self::Compacted(queue) => vec![queue.flag.info()],
            Self::Blocks(queue) => vec![queue.append.info()],
        }
    }

    /// What queries read it by; where there is nothing to read, `other` stands there.
    pub fn set<'a>(&'a self, other: &'a Buffer) -> GatherQueue<'a> {
        let none = GatherQueue {
            gather_head: other.view(),
            gather_places: other.view(),
            gather_flags: other.view(),
            gather_blocks: other.view(),
            gather_flag_count: other.view(),
        };
        match self {
            Self::Slots => none,
            Self::Compacted(Compacted { memory, .. }) => GatherQueue {
                gather_head: memory.head.view(),
                gather_places: memory.places.view(),
                gather_flags: memory.flags.view(),
                gather_flag_count: memory.flag_count.view(),
                ..none
            },
            Self::Blocks(Blocks { memory, .. }) => GatherQueue {
                gather_head: memory.head.view(),
                gather_places: memory.places.view(),
                gather_blocks: memory.blocks.view(),
                ..none
            },
        }
    }

    /// Records what fills it from the places of a wave; where the arguments of its queries' dispatch are. Rays ask whatever `ask` says.
    pub fn record<'a>(
        &'a self,
        pass: &mut Pass<'_>,
        scene: &GpuScene,
        wave: &WaveSet<'_>,
        places: Places<'a>,
        ask: AskSettings,
        set: &GatherQueue<'_>,
    ) -> Result<BufferView<'a>> {
        // What an earlier bounce has left must not be taken for this one's, should nothing have arrived.
        let reset = |pass: &mut Pass<'_>, head: &Buffer, words: &[u32]| {
            pass.memory_barrier(Access::COMPUTE | Access::INDIRECT_READ, Access::TRANSFER_WRITE);
            pass.update(head.view(), words)?;
            pass.memory_barrier(Access::TRANSFER_WRITE, Access::COMPUTE | Access::INDIRECT_READ);
            Ok::<(), Error>(())
        };
        let scene = scene.scene_set();
        match self {
            Self::Slots => Ok(places.items),
            Self::Compacted(Compacted { flag, memory }) => {
                reset(pass, &memory.flag_count, &[0])?;
                let push = photon_queue_flags::Push { ask };
                pass.dispatch_indirect(flag, &[wave, &scene, set], &push, places.items)?;
                stage_barrier(pass);
                let buffers = PartitionBuffers {
                    flags: memory.flags.view(),
                    input: None,
                    output: memory.places.view(),
                    flagged: memory.asking.view(),
                };
                let count = Count::Device {
                    view: memory.flag_count.view(),
                    capacity: memory.slots,
                };
                memory.partition.record(pass, &buffers, count, &memory.scratch)?;
                stage_barrier(pass);
                memory
                    .arguments
                    .record(pass, memory.asking.view(), memory.slots, WALK_GROUP, &memory.head)?;
                stage_barrier(pass);
                Ok(memory.head.slice(0, size_of::<[u32; 3]>() as u64))
            }
            Self::Blocks(Blocks { append, memory }) => {
                let empty = Head {
                    groups: [0, 1, 1],
                    ..Head::default()
                };
                reset(pass, &memory.head, bytemuck::cast_slice(&[empty]))?;
                let push = photon_queue_blocks::Push { ask };
                pass.dispatch_indirect(append, &[wave, &scene, set], &push, places.chunks)?;
                stage_barrier(pass);
                Ok(memory.head.slice(0, size_of::<[u32; 3]>() as u64))
            }
        }
    }
}

/// Rows of the catalogue.
pub(crate) const ROWS: &[Row] = &[
    Row {
        id: "PM-ST-2",
        name: "queue of queries, type I: an invocation per place of the wave",
        role: Role::PartOf("PM-SYS-1"),
        limits: "Places that ask nothing idle; rays find their ways in the kernel of their queries.",
        sources: &[sources::FABIANOWSKI_2011.at("§7.4.1")],
        shaders: &[
            "shaders/techniques/photon_mapping/photon_queue.glsl",
            "shaders/techniques/photon_mapping/photon_queued_place.glsl",
        ],
        tests: &[
            "tests/tests/photon/queues.rs::every_queue_gives_the_same_picture",
            "tests/tests/photon/queues.rs::queues_take_places_that_all_lie_in_the_same_thousand_kernels",
            "tests/tests/photon/queues.rs::nothing_is_asked_behind_the_end_of_a_queue",
            "tests/tests/photon/volume_queues.rs::every_queue_and_packets_give_the_same_picture_through_media",
        ],
        settings: &["queue"],
        ..Row::of(file!())
    },
    Row {
        id: "PM-ST-3",
        name: "queue of queries, type II: places that ask, by stream compaction",
        role: Role::PartOf("PM-SYS-1"),
        limits: "Costs passes over all places before each query, for rays one more, which finds their ways.",
        sources: &[sources::FABIANOWSKI_2011.at("§7.4.1")],
        shaders: &[
            "shaders/techniques/photon_mapping/photon_queue_flags.comp",
            "shaders/techniques/photon_mapping/photon_queue_asks.glsl",
            "shaders/techniques/photon_mapping/photon_beam_ways.comp",
        ],
        tests: &[
            "tests/tests/photon/queues.rs::queues_take_queries_that_a_quota_stops",
            "tests/tests/photon/queues.rs::queues_may_stay_empty",
            "tests/tests/photon/volume_queues.rs::points_and_rays_share_the_memory_of_their_queues",
            "tests/tests/photon/volume_queues.rs::queues_and_packets_go_through_grids",
            "tests/tests/photon/volume_queues.rs::queues_and_packets_wait_for_walks_through_grids",
            "tests/tests/photon/volume_queues.rs::queues_and_packets_are_the_same_in_parts",
        ],
        settings: &["queue"],
        ..Row::of(file!())
    },
    Row {
        id: "PM-ST-4",
        name: "queue of queries, type III: places that ask, in blocks as wide as subgroups, collected in shared memory",
        role: Role::PartOf("PM-SYS-1"),
        limits: "Those who collect wait for each other, a workgroup at a time; blocks may be partial and come in any order, which no picture shows.",
        sources: &[sources::FABIANOWSKI_2011.at("§7.4.1")],
        shaders: &[
            "shaders/techniques/photon_mapping/photon_queue_blocks.comp",
            "shaders/techniques/photon_mapping/photon_queue_asks.glsl",
            "shaders/techniques/photon_mapping/photon_beam_ways.comp",
        ],
        tests: &[
            "tests/tests/photon/queues.rs::every_queue_gives_the_same_picture",
            "tests/tests/photon/queues.rs::queues_never_show_on_any_number_of_threads",
            "tests/tests/photon/queues.rs::blocks_need_no_subgroup_operations",
            "tests/tests/photon/volume_queues.rs::every_queue_and_packets_give_the_same_picture_through_media",
            "tests/tests/photon/volume_queues.rs::planes_are_the_same_in_every_form_on_any_number_of_threads",
            "tests/tests/photon/volume_queues.rs::queues_and_packets_never_show_on_any_number_of_threads",
        ],
        settings: &["queue"],
        ..Row::of(file!())
    },
];
