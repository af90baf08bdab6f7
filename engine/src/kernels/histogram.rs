//! Histograms of bit fields of 32-bit words.
//!
//! Each workgroup counts in shared memory and adds what it found by integer atomics, so counts are the same on every run. Guarantees: equal
//! to [`histogram`], its twin.

use std::ops::Range;

use super::form::Teams;
use super::stream::{self, Count, Prepare};
use crate::gpu::shaders::kernels::histogram as kernel;
use crate::gpu::{Buffer, BufferView, ComputePipeline, Gpu, Pass};
use crate::{Error, Result};

/// The most bins of a [`Histogram`].
pub const MAX_BINS: u32 = 4095;

/// Counts how often each value below a bound occurs.
///
/// Barriers: the words, and the counts that it adds to, must have been made visible to [`Access::COMPUTE`](crate::gpu::Access::COMPUTE), and
/// earlier uses of the scratch memory must have ended. After it the counts, and the scratch memory of counts on the device, have been read and
/// written by compute shaders.
#[derive(Debug)]
pub struct Histogram {
    bins: u32,
    bits: Range<u32>,
    teams: Teams,
    prepare: Prepare,
    pipeline: ComputePipeline<kernel::Kernel>,
}

impl Histogram {
    /// Makes the pipeline; values are the given bits of words, counted from the lowest.
    ///
    /// # Errors
    /// [`Error::Setting`] when there are no bins or more than [`MAX_BINS`], or when `bits` is empty or passes 32, [`Error::OutOfMemory`].
    pub fn new(gpu: &Gpu, bins: u32, bits: Range<u32>) -> Result<Self> {
        if bins == 0 || bins > MAX_BINS {
            return Err(Error::setting("bins", bins, format!("is not in 1..={MAX_BINS}")));
        }
        if bits.is_empty() || bits.end > 32 {
            return Err(Error::setting("bits", format!("{bits:?}"), "is not a part of 0..32"));
        }
        let teams = Teams::workgroups(gpu.caps(), 1);
        Ok(Self {
            bins,
            bits,
            teams,
            prepare: Prepare::new(gpu)?,
            pipeline: gpu.compute_pipeline(&kernel::Spec {
                local_size_x: teams.lanes,
                counters: bins + 1,
            })?,
        })
    }

    /// Bytes of scratch memory, for any number of words.
    pub fn scratch_bytes(&self) -> u64 {
        stream::scratch_bytes(1)
    }

    /// Words of the counts: one per bin, and one for all other values.
    pub fn count_words(&self) -> u32 {
        self.bins + 1
    }

    /// Records a histogram. It adds to what is in `counts`, so that several streams can be counted together: clear them before.
    ///
    /// # Errors
    /// [`Error::LimitExceeded`] when there are more than 2³¹ words or a range is too small; and as [`Pass::dispatch`].
    pub fn record(
        &self,
        pass: &mut Pass<'_>,
        words: BufferView<'_>,
        counts: BufferView<'_>,
        count: Count<'_>,
        scratch: &Buffer,
    ) -> Result<()> {
        let capacity = count.capacity();
        stream::check_count("histogram", capacity)?;
        stream::check_words(words, capacity.into())?;
        stream::check_words(counts, self.count_words().into())?;
        stream::check_size(scratch, self.scratch_bytes())?;
        let stream = self.prepare.begin(pass, &self.teams.shape, count, scratch)?;
        let set = kernel::Set0 {
            stream_scratch: scratch.view(),
            histogram_words: words,
            histogram_counts: counts,
        };
        let push = kernel::Push {
            plan: stream.plan,
            shift: self.bits.start,
            mask: u32::MAX >> (32 - self.bits.len() as u32),
        };
        stream.dispatch(pass, &self.pipeline, &set, &push)
    }
}

/// Twin of [`Histogram`]: counts by bin, and of all other values last.
pub fn histogram(words: &[u32], bins: u32, bits: Range<u32>) -> Vec<u32> {
    let mask = u32::MAX >> (32 - (bits.len() as u32).clamp(1, 32));
    let mut counts = vec![0; bins as usize + 1];
    for word in words {
        counts[(word >> bits.start & mask).min(bins) as usize] += 1;
    }
    counts
}
