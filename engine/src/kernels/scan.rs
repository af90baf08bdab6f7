//! Inclusive and exclusive scans of 32-bit words by sum, minimum or maximum, of a whole stream or of segments of it.
//!
//! Reduce, then scan: each team reduces its block, one workgroup scans what they found, each team scans its block after what lies before
//! (Dotsenko and others, "Fast scan algorithms on graphics processors", ICS 2008, section 3). Segmented scans by pairs of flag and value
//! (Sengupta and others, "Scan primitives for GPU computing", Graphics Hardware 2007, section 3).
//!
//! Guarantees: equal to [`scan`], its twin, on every device and in every form; sums are modulo 2³².

use super::form::{Form, Teams, Variant};
use super::operation::Operation;
use super::stream::{self, Count, Prepare, Stream};
use crate::catalogue::{Role, Row, sources};
use crate::gpu::interface::ShaderInfo;
use crate::gpu::shaders::constants::STREAM_HEADER_WORDS;
use crate::gpu::shaders::kernels::{
    scan_apply, scan_apply_subgroup, scan_reduce, scan_reduce_subgroup, scan_totals, stream_prepare,
};
use crate::gpu::shaders::sets::{ScanApplySet, ScanReduceSet};
use crate::gpu::{Buffer, BufferView, ComputePipeline, Gpu, Pass, PipelineInfo};
use crate::{Error, Result};

/// What to scan, and how.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct ScanOptions {
    /// By which operation.
    pub operation: Operation,
    /// Element i of the result holds what elements 0 to i give; otherwise 0 to i - 1, so that the first is the identity.
    pub inclusive: bool,
    /// The scan begins anew where a second buffer has a word that is not 0.
    pub segmented: bool,
    /// What teams are.
    pub form: Form,
}

/// Ranges that a scan reads and writes, of one word per element. They must be aligned as storage bindings are; output and input may be one
/// range.
#[derive(Debug, Clone, Copy)]
pub struct ScanBuffers<'a> {
    /// The elements.
    pub input: BufferView<'a>,
    /// Of segmented scans, words that are not 0 where a segment begins. The first element begins one in any case.
    pub heads: Option<BufferView<'a>>,
    /// The result.
    pub output: BufferView<'a>,
}

/// A scan.
///
/// Barriers: what wrote the input must have been made visible to [`Access::COMPUTE`](crate::gpu::Access::COMPUTE), and earlier uses of output
/// and scratch memory must have ended. After it the output has been written, and the scratch memory read and written, by compute shaders.
#[derive(Debug)]
pub struct Scan {
    options: ScanOptions,
    first: ScanTotals,
    apply: Variant<scan_apply::Kernel, scan_apply_subgroup::Kernel>,
}

/// The first two stages, which compaction and split share: totals by team, and what lies before each.
#[derive(Debug)]
pub(super) struct ScanTotals {
    pub teams: Teams,
    prepare: Prepare,
    reduce: Variant<scan_reduce::Kernel, scan_reduce_subgroup::Kernel>,
    totals: ComputePipeline<scan_totals::Kernel>,
}

impl Scan {
    /// The kernels that a scan may take, on whatever device.
    pub const KERNELS: [&'static ShaderInfo; 6] = [
        &stream_prepare::INFO,
        &scan_reduce::INFO,
        &scan_reduce_subgroup::INFO,
        &scan_totals::INFO,
        &scan_apply::INFO,
        &scan_apply_subgroup::INFO,
    ];

    /// Makes the pipelines.
    ///
    /// # Errors
    /// [`Error::MissingFeature`] as [`Form::on`], [`Error::OutOfMemory`].
    pub fn new(gpu: &Gpu, options: ScanOptions) -> Result<Self> {
        let first = ScanTotals::new(gpu, &options, false, "scan")?;
        let ScanOptions {
            inclusive, segmented, ..
        } = options;
        let (local_size_x, operation, serial) = (first.teams.lanes, options.operation.code(), first.teams.serial());
        let apply = if first.teams.form == Form::Subgroup {
            Variant::Subgroup(gpu.compute_pipeline(&scan_apply_subgroup::Spec {
                local_size_x,
                operation,
                serial,
                segmented,
                inclusive,
                ..Default::default()
            })?)
        } else {
            Variant::Plain(gpu.compute_pipeline(&scan_apply::Spec {
                local_size_x,
                operation,
                serial,
                segmented,
                inclusive,
                ..Default::default()
            })?)
        };
        Ok(Self { options, first, apply })
    }

    /// The kernels with their specialization.
    pub fn pipelines(&self) -> Vec<PipelineInfo> {
        let mut all = self.first.pipelines();
        all.push(self.apply.info());
        all
    }

    /// Bytes of scratch memory for up to `capacity` elements.
    pub fn scratch_bytes(&self, capacity: u32) -> u64 {
        self.first.scratch_bytes(capacity)
    }

    /// Where the scratch memory holds what all elements give (of segmented scans, those of the last segment) after a scan: one word.
    pub fn total<'a>(&self, scratch: &'a Buffer) -> BufferView<'a> {
        scratch.slice(4 * u64::from(STREAM_HEADER_WORDS + 1), 4)
    }

    /// Records a scan.
    ///
    /// # Errors
    /// [`Error::LimitExceeded`] when there are more than 2³¹ elements or a range is too small, [`Error::Setting`] when there are heads and
    /// the scan is not segmented, or the other way round; and as [`Pass::dispatch`].
    pub fn record(
        &self,
        pass: &mut Pass<'_>,
        buffers: &ScanBuffers<'_>,
        count: Count<'_>,
        scratch: &Buffer,
    ) -> Result<()> {
        if buffers.heads.is_some() != self.options.segmented {
            let given = if buffers.heads.is_some() { "given" } else { "missing" };
            return Err(Error::setting("heads", given, "is not what the scan was made for"));
        }
        for view in [buffers.input, buffers.output].into_iter().chain(buffers.heads) {
            stream::check_words(view, count.capacity().into())?;
        }
        let stream = self.first.record(pass, buffers.input, buffers.heads, count, scratch)?;
        // The input may be in the same buffer.
        stream.between_stages(pass, &[buffers.output.buffer]);
        let set = ScanApplySet {
            stream_scratch: scratch.view(),
            scan_in: buffers.input,
            scan_starts: buffers.heads.unwrap_or(buffers.input),
            scan_out: buffers.output,
        };
        let plan = stream.plan;
        match &self.apply {
            Variant::Plain(kernel) => stream.dispatch(pass, kernel, &set, &scan_apply::Push { plan }),
            Variant::Subgroup(kernel) => stream.dispatch(pass, kernel, &set, &scan_apply_subgroup::Push { plan }),
        }
    }
}

impl ScanTotals {
    /// `flags`: elements count 1 where they are not 0.
    pub fn new(gpu: &Gpu, options: &ScanOptions, flags: bool, kernel: &str) -> Result<Self> {
        let teams = Teams::new(gpu.caps(), options.form, kernel)?;
        let (local_size_x, operation, serial) = (teams.lanes, options.operation.code(), teams.serial());
        let segmented = options.segmented;
        let reduce = if teams.form == Form::Subgroup {
            Variant::Subgroup(gpu.compute_pipeline(&scan_reduce_subgroup::Spec {
                local_size_x,
                operation,
                serial,
                segmented,
                flags,
                ..Default::default()
            })?)
        } else {
            Variant::Plain(gpu.compute_pipeline(&scan_reduce::Spec {
                local_size_x,
                operation,
                serial,
                segmented,
                flags,
                ..Default::default()
            })?)
        };
        Ok(Self {
            teams,
            prepare: Prepare::new(gpu)?,
            reduce,
            totals: gpu.compute_pipeline(&scan_totals::Spec {
                local_size_x,
                operation,
                ..Default::default()
            })?,
        })
    }

    pub fn pipelines(&self) -> Vec<PipelineInfo> {
        vec![self.prepare.info(), self.reduce.info(), self.totals.info()]
    }

    pub fn scratch_bytes(&self, capacity: u32) -> u64 {
        stream::scratch_bytes(2 + 2 * u64::from(self.teams.shape.max_teams(capacity)))
    }

    /// Records both stages; a barrier after them is the caller's.
    pub fn record<'a>(
        &self,
        pass: &mut Pass<'_>,
        input: BufferView<'_>,
        heads: Option<BufferView<'_>>,
        count: Count<'_>,
        scratch: &'a Buffer,
    ) -> Result<Stream<'a>> {
        stream::check_count("scan", count.capacity())?;
        stream::check_size(scratch, self.scratch_bytes(count.capacity()))?;
        let stream = self.prepare.begin(pass, &self.teams.shape, count, scratch)?;
        let plan = stream.plan;
        let set = ScanReduceSet {
            stream_scratch: scratch.view(),
            scan_from: input,
            scan_heads: heads.unwrap_or(input),
        };
        match &self.reduce {
            Variant::Plain(kernel) => stream.dispatch(pass, kernel, &set, &scan_reduce::Push { plan })?,
            Variant::Subgroup(kernel) => stream.dispatch(pass, kernel, &set, &scan_reduce_subgroup::Push { plan })?,
        }
        stream.between_stages(pass, &[]);
        let set = scan_totals::Set0 {
            stream_scratch: scratch.view(),
        };
        pass.dispatch(&self.totals, &[&set], &scan_totals::Push { plan }, [1, 1, 1])?;
        Ok(stream)
    }
}

/// Twin of [`Scan`]: the result, and what all elements (of the last segment) give.
pub fn scan(values: &[u32], heads: Option<&[u32]>, operation: Operation, inclusive: bool) -> (Vec<u32>, u32) {
    let mut running = operation.identity();
    let mut result = Vec::with_capacity(values.len());
    for (at, value) in values.iter().enumerate() {
        if heads.and_then(|heads| heads.get(at)).is_some_and(|head| *head != 0) {
            running = operation.identity();
        }
        let after = operation.apply(running, *value);
        result.push(if inclusive { after } else { running });
        running = after;
    }
    (result, running)
}

/// Rows of the catalogue.
pub(crate) const ROWS: &[Row] = &[Row {
    id: "PM-B-1",
    name: "inclusive and exclusive scan, segmented scan, reductions",
    role: Role::Kernel,
    limits: "Words of 32 bits; sums of scans are modulo 2³².",
    sources: &[
        sources::BLELLOCH_1990.whole(),
        sources::SENGUPTA_2007.whole(),
        sources::DOTSENKO_2008.whole(),
    ],
    shaders: &[
        "shaders/kernels/scan_reduce.comp",
        "shaders/kernels/scan_reduce_subgroup.comp",
        "shaders/kernels/scan_totals.comp",
        "shaders/kernels/scan_apply.comp",
        "shaders/kernels/scan_apply_subgroup.comp",
        "shaders/kernels/reduce_words.comp",
        "shaders/kernels/reduce_box.comp",
        "shaders/kernels/stream_prepare.comp",
    ],
    tests: &[
        "tests/tests/kernels/blocks.rs::scans_are_as_their_twin",
        "tests/tests/kernels/blocks.rs::a_million_words_and_three_are_as_by_the_twins",
        "tests/tests/kernels/blocks.rs::more_elements_than_the_capacity_are_reported_and_left",
        "tests/tests/kernels/blocks.rs::reductions_of_words_are_as_their_twin",
        "tests/tests/kernels/blocks.rs::boxes_are_exact_and_leave_nans_out",
        "engine/src/kernels/stream.rs::every_element_is_in_one_block",
    ],
    api: &[
        "clerestory::kernels::Scan",
        "clerestory::kernels::ReduceWords",
        "clerestory::kernels::ReduceBox",
        "clerestory::kernels::scan",
    ],
    settings: &["clerestory::kernels::ScanOptions"],
    ..Row::of(file!())
}];
