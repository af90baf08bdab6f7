//! A wave of eye paths that is kept full: memory and passes beside those of whole waves.
//!
//! At the beginning of a submission paths that have ended leave their slots: what they have gathered goes to their samples' results, and samples before which all have
//! ended go to the film. Then new samples take the slots that are free.

use super::in_order::{Piece, SamplesInOrder};
use super::kept::KeptBySlot;
use super::pipelines::{CameraStage, Pipelines};
use super::record::{FilmPieces, record_pieces};
use crate::Result;
use crate::film::GpuFilm;
use crate::gpu::ash::vk;
use crate::gpu::shaders::sets::{PathSlotSet, WaveSet};
use crate::gpu::shaders::techniques::path::{path_refill, path_retire};
use crate::gpu::shaders::types::{CameraView, GatheredLight, PathAov};
use crate::gpu::{Buffer, BufferDesc, Category, ComputePipeline, Gpu, PipelineInfo, Recorder, TexelView};
use crate::walk::{self, WaveBuffers, WaveInFlight, stage_barrier};

/// Results for each slot, as long as they can be bound: about as many as the longest paths of a wave have bounces for each that the mean path has.
const RESULTS_PER_SLOT: u32 = 8;

/// What a path tracer has where waves are kept full.
pub(super) struct FullWave {
    pub refill: RefillStage,
    pub samples: SamplesInOrder,
    /// The wave, until a submission fails.
    pub walks: Option<WaveInFlight>,
}

/// Memory of results and kernels.
pub(super) struct RefillStage {
    retire: ComputePipeline<path_retire::Kernel>,
    numbers: TexelView,
    memory: ResultMemory,
}

/// What paths have gathered that have ended, by sample.
pub(super) struct ResultMemory {
    gathered: Buffer,
    aovs: Buffer,
    count: u32,
}

impl ResultMemory {
    /// Beside so many slots.
    pub fn new(gpu: &Gpu, slots: u32, has_aovs: bool) -> Result<Self> {
        let result_bytes = if has_aovs {
            size_of::<PathAov>()
        } else {
            size_of::<GatheredLight>()
        };
        let most = gpu.caps().max_storage_buffer_range / result_bytes as u64;
        let count = u64::from(slots.saturating_mul(RESULTS_PER_SLOT)).min(most) as u32;
        let work = |name, bytes: usize, count: u32| {
            let bytes = bytes as u64 * u64::from(count);
            gpu.buffer(&BufferDesc::storage(name, bytes, Category::Work))
        };
        Ok(Self {
            gathered: work("path results", size_of::<GatheredLight>(), count)?,
            aovs: work(
                "path result aovs",
                size_of::<PathAov>(),
                if has_aovs { count } else { 0 },
            )?,
            count,
        })
    }
}

/// By slot the numbers of paths: pixel, sample, round and result.
pub(super) fn slot_numbers(gpu: &Gpu, slots: u32) -> Result<TexelView> {
    let format = vk::Format::R32G32B32A32_UINT;
    gpu.storage_texels("path numbers", Category::Work, format, slots.into())
}

impl FullWave {
    pub fn new(gpu: &Gpu, numbers: TexelView, memory: ResultMemory, write_aovs: bool) -> Result<Self> {
        Ok(Self {
            samples: SamplesInOrder::new(memory.count),
            refill: RefillStage {
                retire: gpu.compute_pipeline(&path_retire::Spec { write_aovs })?,
                numbers,
                memory,
            },
            walks: None,
        })
    }

    /// Forgets all samples.
    pub fn clear(&mut self) {
        self.samples = SamplesInOrder::new(self.refill.memory.count);
        self.walks = None;
    }
}

impl RefillStage {
    /// Its kernel.
    pub fn pipeline(&self) -> PipelineInfo {
        self.retire.info()
    }

    /// Records that paths that have ended leave their slots, and the way of `pending` samples to the film.
    pub fn record_turnover(
        &self,
        recorder: &mut Recorder,
        pipelines: &Pipelines,
        film: &GpuFilm,
        buffers: &WaveBuffers,
        kept: &KeptBySlot,
        pending: &[Piece],
    ) -> Result<()> {
        let Some(turnover) = buffers.turnover() else {
            return Ok(());
        };
        let lists = buffers.turnover_set();
        let results = path_retire::Set2 {
            path_results: self.memory.gathered.view(),
            path_result_aovs: self.memory.aovs.view(),
        };
        recorder.pass("path: turnover", |pass| {
            turnover.record(pass, &lists)?;
            let groups = turnover.ended_groups();
            pass.dispatch_indirect(&self.retire, &[&lists, &kept.set(), &results], &(), groups)?;
            stage_barrier(pass);
            Ok(())
        })?;
        let from = FilmPieces {
            walks: WaveSet {
                walk_gathered: self.memory.gathered.view(),
                ..buffers.set(0)
            },
            kept: PathSlotSet {
                path_aovs: self.memory.aovs.view(),
                ..kept.set()
            },
            pieces: pending,
        };
        record_pieces(recorder, &pipelines.resolve, film, &from)
    }

    /// Records where the paths of samples begin that take free slots, the lists of [`record_turnover`](RefillStage::record_turnover) being there.
    #[allow(
        clippy::too_many_arguments,
        reason = "what a stage of a bounce reads, from as many places"
    )]
    pub fn record_begin(
        &self,
        recorder: &mut Recorder,
        camera: &CameraStage,
        view: CameraView,
        seed: u32,
        buffers: &WaveBuffers,
        wave: &WaveSet<'_>,
        kept: &KeptBySlot,
        pieces: &[Piece],
        refill: walk::Refill,
    ) -> Result<()> {
        let (CameraStage::Refilled(camera), Some(turnover)) = (camera, buffers.turnover()) else {
            return Ok(());
        };
        let slots = path_refill::Set2 {
            path_free: turnover.free(),
            path_turnover: turnover.slots(),
            path_numbers: self.numbers.buffer().view(),
        };
        recorder.pass("path: camera", |pass| {
            let mut begun = 0;
            for piece in pieces {
                let push = path_refill::Push {
                    view,
                    key: piece.wave.key(seed),
                    first_sample: piece.first,
                    sample_count: piece.count,
                    first_place: refill.place + begun,
                    first_free: begun,
                    first_result: piece.result,
                    round: refill.round,
                };
                let groups = [camera.groups_for(piece.count), 1, 1];
                pass.dispatch(camera, &[wave, &kept.set(), &slots], &push, groups)?;
                // The next piece writes beside it.
                stage_barrier(pass);
                begun += piece.count;
            }
            Ok(())
        })
    }
}
