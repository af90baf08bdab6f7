//! Gather and scatter: elements of some words by indices.
//!
//! Guarantees: equal to [`gather`] and [`scatter`], the twins. Indices out of range touch nothing and are counted. A scatter with equal indices
//! is deterministic only when their elements are equal, too.

use super::form::Teams;
use super::stream::{self, Count, Prepare};
use crate::gpu::shaders::kernels::permute as kernel;
use crate::gpu::{Buffer, BufferView, ComputePipeline, Gpu, Pass};
use crate::{Error, Result};

/// Which way elements go.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Direction {
    /// Output i is input `index[i]`; zeros where that is out of range.
    Gather,
    /// Output `index[i]` is input i; what no index names is left as it was.
    Scatter,
}

/// Ranges that a permutation reads and writes. They must be aligned as storage bindings are, and be apart.
#[derive(Debug, Clone, Copy)]
pub struct PermuteBuffers<'a> {
    /// One word per element.
    pub indices: BufferView<'a>,
    /// The elements.
    pub input: BufferView<'a>,
    /// The elements in their new places.
    pub output: BufferView<'a>,
    /// One word, to which the number of indices out of range is added.
    pub faults: BufferView<'a>,
    /// Elements of what is indexed: the input of a gather, the output of a scatter.
    pub places: u32,
}

/// Moves elements by indices.
///
/// Barriers: indices, input and faults must have been made visible to [`Access::COMPUTE`](crate::gpu::Access::COMPUTE), and earlier uses of the
/// output and the scratch memory must have ended. After it the output has been written, and the faults, and the scratch memory of counts on
/// the device, read and written, by compute shaders.
#[derive(Debug)]
pub struct Permute {
    direction: Direction,
    words: u32,
    teams: Teams,
    prepare: Prepare,
    pipeline: ComputePipeline<kernel::Kernel>,
}

/// Words of an element of a [`Permute`] at most.
const MAX_WORDS: u32 = 64;

impl Permute {
    /// Makes the pipeline, for elements of `words` words.
    ///
    /// # Errors
    /// [`Error::Setting`] when elements have no words or more than 64, [`Error::OutOfMemory`].
    pub fn new(gpu: &Gpu, direction: Direction, words: u32) -> Result<Self> {
        if words == 0 || words > MAX_WORDS {
            return Err(Error::setting("words", words, format!("is not in 1..={MAX_WORDS}")));
        }
        let teams = Teams::workgroups(gpu.caps(), 1 + words);
        Ok(Self {
            direction,
            words,
            teams,
            prepare: Prepare::new(gpu)?,
            pipeline: gpu.compute_pipeline(&kernel::Spec {
                local_size_x: teams.lanes,
                element_words: words,
                scatter: direction == Direction::Scatter,
            })?,
        })
    }

    /// Bytes of scratch memory, for any number of elements.
    pub fn scratch_bytes(&self) -> u64 {
        stream::scratch_bytes(1)
    }

    /// Records a gather or scatter.
    ///
    /// # Errors
    /// [`Error::LimitExceeded`] when there are more than 2³¹ elements, more than 2³² words of them, or a range is too small; and as
    /// [`Pass::dispatch`].
    pub fn record(
        &self,
        pass: &mut Pass<'_>,
        buffers: &PermuteBuffers<'_>,
        count: Count<'_>,
        scratch: &Buffer,
    ) -> Result<()> {
        let capacity = count.capacity();
        let (moved, placed) = match self.direction {
            Direction::Gather => (buffers.output, buffers.input),
            Direction::Scatter => (buffers.input, buffers.output),
        };
        stream::check_count("permute", capacity)?;
        stream::check_words(buffers.indices, capacity.into())?;
        stream::check_words(buffers.faults, 1)?;
        for (view, elements) in [(moved, capacity), (placed, buffers.places)] {
            let words = u64::from(elements) * u64::from(self.words);
            if words > 1 << 32 {
                return Err(Error::LimitExceeded {
                    name: view.buffer.name().into(),
                    value: words,
                    limit_name: "words that kernels can number",
                    limit: 1 << 32,
                });
            }
            stream::check_words(view, words)?;
        }
        stream::check_size(scratch, self.scratch_bytes())?;
        let stream = self.prepare.begin(pass, &self.teams.shape, count, scratch)?;
        let set = kernel::Set0 {
            stream_scratch: scratch.view(),
            permute_indices: buffers.indices,
            permute_in: buffers.input,
            permute_out: buffers.output,
            permute_faults: buffers.faults,
        };
        let push = kernel::Push {
            plan: stream.plan,
            places: buffers.places,
        };
        stream.dispatch(pass, &self.pipeline, &set, &push)
    }
}

/// Twin of [`Permute`] with [`Direction::Gather`]: the elements and the number of indices out of range. Elements have `words` words.
pub fn gather(indices: &[u32], input: &[u32], words: usize) -> (Vec<u32>, u32) {
    let (mut output, mut faults) = (Vec::with_capacity(indices.len() * words), 0);
    for index in indices {
        let from = *index as usize * words;
        match input.get(from..from + words) {
            Some(element) => output.extend_from_slice(element),
            None => {
                output.resize(output.len() + words, 0);
                faults += 1;
            }
        }
    }
    (output, faults)
}

/// Twin of [`Permute`] with [`Direction::Scatter`]: writes to `output` and gives the number of indices out of range.
pub fn scatter(indices: &[u32], input: &[u32], words: usize, output: &mut [u32]) -> u32 {
    let mut faults = 0;
    for (index, element) in indices.iter().zip(input.chunks_exact(words)) {
        let to = *index as usize * words;
        match output.get_mut(to..to + words) {
            Some(place) => place.copy_from_slice(element),
            None => faults += 1,
        }
    }
    faults
}
