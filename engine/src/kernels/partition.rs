//! Stream compaction and split: words, or the numbers of elements, in the order of flags.
//!
//! A scan of the flags says where elements go (Blelloch, "Prefix sums and their applications", 1990, sections 1.3 and 1.3.1). Guarantees:
//! stable; equal to [`compact`] and [`split`], the twins, on every device and in every form.

use super::form::{Form, Variant};
use super::scan::{ScanOptions, ScanTotals};
use super::stream::{self, Count};
use crate::catalogue::{Role, Row, sources};
use crate::gpu::shaders::kernels::{partition, partition_subgroup};
use crate::gpu::shaders::sets::PartitionSet;
use crate::gpu::{Buffer, BufferView, Gpu, Pass};
use crate::{Error, Result};

/// Which elements stay.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Keep {
    /// Those with a flag; what lies behind them in the output is left as it was.
    #[default]
    Flagged,
    /// All: those without a flag first, then those with one.
    Split,
}

/// How to partition.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct PartitionOptions {
    /// Which elements stay.
    pub keep: Keep,
    /// The elements are their own numbers in the stream; otherwise words of a buffer.
    pub numbers: bool,
    /// What teams are.
    pub form: Form,
}

/// Ranges that a partition reads and writes, of one word per element. They must be aligned as storage bindings are, and be apart.
#[derive(Debug, Clone, Copy)]
pub struct PartitionBuffers<'a> {
    /// Flags: words that are not 0.
    pub flags: BufferView<'a>,
    /// The elements, unless they are numbers.
    pub input: Option<BufferView<'a>>,
    /// The elements in their new order.
    pub output: BufferView<'a>,
    /// One word: how many elements are flagged.
    pub flagged: BufferView<'a>,
}

/// Stream compaction or split.
///
/// Barriers: flags and input must have been made visible to [`Access::COMPUTE`](crate::gpu::Access::COMPUTE), and earlier uses of the outputs
/// and the scratch memory must have ended. After it the outputs have been written, and the scratch memory read and written, by compute shaders.
#[derive(Debug)]
pub struct Partition {
    options: PartitionOptions,
    first: ScanTotals,
    last: Variant<partition::Kernel, partition_subgroup::Kernel>,
}

impl Partition {
    /// Makes the pipelines.
    ///
    /// # Errors
    /// [`Error::MissingFeature`] as [`Form::on`], [`Error::OutOfMemory`].
    pub fn new(gpu: &Gpu, options: PartitionOptions) -> Result<Self> {
        let scan = ScanOptions {
            form: options.form,
            ..Default::default()
        };
        let first = ScanTotals::new(gpu, &scan, true, "partition")?;
        let (local_size_x, serial) = (first.teams.lanes, first.teams.serial());
        let (split, numbers) = (options.keep == Keep::Split, options.numbers);
        let last = if first.teams.form == Form::Subgroup {
            Variant::Subgroup(gpu.compute_pipeline(&partition_subgroup::Spec {
                local_size_x,
                serial,
                split,
                numbers,
                ..Default::default()
            })?)
        } else {
            Variant::Plain(gpu.compute_pipeline(&partition::Spec {
                local_size_x,
                serial,
                split,
                numbers,
                ..Default::default()
            })?)
        };
        Ok(Self { options, first, last })
    }

    /// Bytes of scratch memory for up to `capacity` elements.
    pub fn scratch_bytes(&self, capacity: u32) -> u64 {
        self.first.scratch_bytes(capacity)
    }

    /// Records a partition.
    ///
    /// # Errors
    /// [`Error::LimitExceeded`] when there are more than 2³¹ elements or a range is too small, [`Error::Setting`] when an input is missing or
    /// not wanted; and as [`Pass::dispatch`].
    pub fn record(
        &self,
        pass: &mut Pass<'_>,
        buffers: &PartitionBuffers<'_>,
        count: Count<'_>,
        scratch: &Buffer,
    ) -> Result<()> {
        if buffers.input.is_some() == self.options.numbers {
            let given = if buffers.input.is_some() { "given" } else { "missing" };
            return Err(Error::setting("input", given, "is not what the partition was made for"));
        }
        for view in [buffers.flags, buffers.output].into_iter().chain(buffers.input) {
            stream::check_words(view, count.capacity().into())?;
        }
        stream::check_words(buffers.flagged, 1)?;
        let stream = self.first.record(pass, buffers.flags, None, count, scratch)?;
        // All may be in one buffer.
        stream.between_stages(pass, &[buffers.output.buffer, buffers.flagged.buffer]);
        let set = PartitionSet {
            stream_scratch: scratch.view(),
            partition_flags: buffers.flags,
            partition_in: buffers.input.unwrap_or(buffers.flags),
            partition_out: buffers.output,
            partition_count: buffers.flagged,
        };
        let plan = stream.plan;
        match &self.last {
            Variant::Plain(kernel) => stream.dispatch(pass, kernel, &set, &partition::Push { plan }),
            Variant::Subgroup(kernel) => stream.dispatch(pass, kernel, &set, &partition_subgroup::Push { plan }),
        }
    }
}

/// Twin of [`Partition`] with [`Keep::Flagged`]: the flagged elements.
pub fn compact(flags: &[u32], elements: &[u32]) -> Vec<u32> {
    let flagged = flags.iter().zip(elements).filter(|(flag, _)| **flag != 0);
    flagged.map(|(_, element)| *element).collect()
}

/// Twin of [`Partition`] with [`Keep::Split`]: the elements without a flag, then those with one.
pub fn split(flags: &[u32], elements: &[u32]) -> Vec<u32> {
    let others = flags.iter().zip(elements).filter(|(flag, _)| **flag == 0);
    let others = others.map(|(_, element)| *element);
    others.chain(compact(flags, elements)).collect()
}

/// Rows of the catalogue.
pub(crate) const ROWS: &[Row] = &[
    Row {
        id: "PM-B-2",
        name: "stream compaction",
        role: Role::Kernel,
        limits: "Moves words of 32 bits or the numbers of elements: longer records are gathered by these numbers afterwards.",
        sources: &[sources::BLELLOCH_1990.whole()],
        shaders: &[
            "shaders/kernels/partition.comp",
            "shaders/kernels/partition_subgroup.comp",
        ],
        tests: &[
            "tests/tests/kernels/blocks.rs::partitions_are_as_their_twins",
            "tests/tests/kernels/blocks.rs::more_elements_than_the_capacity_are_reported_and_left",
        ],
        api: &["clerestory::kernels::Partition", "clerestory::kernels::compact"],
        settings: &["clerestory::kernels::PartitionOptions"],
        ..Row::of(file!())
    },
    Row {
        id: "PM-B-3",
        name: "split",
        role: Role::Kernel,
        limits: "Moves words of 32 bits or the numbers of elements: longer records are gathered by these numbers afterwards.",
        sources: &[sources::BLELLOCH_1990.whole()],
        shaders: &[
            "shaders/kernels/partition.comp",
            "shaders/kernels/partition_subgroup.comp",
        ],
        tests: &[
            "tests/tests/kernels/blocks.rs::partitions_are_as_their_twins",
            "tests/tests/kernels/blocks.rs::a_million_words_and_three_are_as_by_the_twins",
            "tests/tests/kernels/blocks.rs::more_elements_than_the_capacity_are_reported_and_left",
            "tests/tests/kernels/blocks.rs::splits_by_bits_sort",
        ],
        api: &["clerestory::kernels::Partition", "clerestory::kernels::split"],
        settings: &["clerestory::kernels::PartitionOptions"],
        ..Row::of(file!())
    },
];
