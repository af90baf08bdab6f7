//! Radix sort of few keys in one dispatch of one workgroup.
//!
//! For few keys a sort's time is that of its dispatches and barriers. What moves between digits is in shared memory; on software devices, where that is
//! memory like any other, keys and values go from side to side of the buffers, so that there may be more of them. Sources and guarantees are
//! those of [`radix_sort`](super::radix_sort).

use super::form::{BLOCK_ITERATIONS, Form};
use super::radix_sort::{Order, RadixSortOptions, SortBuffers};
use super::stream::Count;
use crate::Result;
use crate::gpu::shaders::constants::{KEYS_PER_READ, PAIR_BITS, STREAM_COUNT_ON_DEVICE};
use crate::gpu::shaders::kernels::{radix_one_group, radix_small};
use crate::gpu::{Buffer, Caps, ComputePipeline, DeviceKind, Gpu, Pass, PipelineInfo};

/// Keys at most in shared memory, where that allows: with more, one workgroup takes longer than many do with their barriers.
const MAX_KEYS: u32 = 2048;
/// The same in the buffers of a software device: an estimate by what dispatches and keys take there, not a measurement.
const MAX_KEYS_IN_BUFFERS: u32 = 1 << 14;
const _: () = assert!(MAX_KEYS_IN_BUFFERS < 1 << PAIR_BITS);
/// Capacities are a multiple of this.
const CAPACITY_STEP: u32 = 256;
/// Loops over the keys of a block and over pairs of bins, for each digit.
const KEY_LOOPS: u32 = 2;
const BIN_LOOPS: u32 = 5;

/// A sort of up to a number of keys in one dispatch.
#[derive(Debug)]
pub(super) struct SmallSort {
    up_to: u32,
    /// Digits that keys go from one side of the buffers to the other for; with shared memory one, whatever there is.
    moves: u32,
    kernel: Kernel,
}

#[derive(Debug)]
enum Kernel {
    Shared(ComputePipeline<radix_small::Kernel>),
    Buffers(ComputePipeline<radix_one_group::Kernel>),
}

/// Invocations and bits of digits, by measurement.
fn tuning(caps: &Caps) -> [u32; 2] {
    if caps.kind == DeviceKind::Cpu {
        [caps.subgroup_size.max(1), 8]
    } else {
        [caps.max_workgroup_invocations.min(256), 4]
    }
}

/// Keys that shared memory of so many bytes holds beside the counters: two words each.
fn capacity(shared_bytes: u32, lanes: u32, bins: u32) -> u32 {
    let keys = (shared_bytes / 4).saturating_sub(counters(lanes, bins)) / 2;
    keys.min(MAX_KEYS) / CAPACITY_STEP * CAPACITY_STEP
}

/// Words of shared memory for counters: one for each digit of an invocation, and one for each invocation in the scan over the workgroup.
fn counters(lanes: u32, bins: u32) -> u32 {
    lanes * bins + lanes
}

/// Keys in buffers beside counters in shared memory of so many bytes: no loop over them may be longer than software drivers let loops be.
fn capacity_in_buffers(shared_bytes: u32, lanes: u32, bins: u32, digits: u32) -> u32 {
    let pairs = bins / 2;
    if 4 * counters(lanes, pairs) > shared_bytes {
        return 0;
    }
    let of_keys = (BLOCK_ITERATIONS / digits).saturating_sub(BIN_LOOPS * pairs) / KEY_LOOPS;
    let keys = lanes * KEYS_PER_READ * of_keys;
    keys.min(MAX_KEYS_IN_BUFFERS) / CAPACITY_STEP * CAPACITY_STEP
}

impl SmallSort {
    /// Makes the pipeline; `None` where shared memory is too small.
    pub fn new(gpu: &Gpu, options: &RadixSortOptions) -> Result<Option<Self>> {
        let [lanes, most_bits] = tuning(gpu.caps());
        let bits = options.bits.len() as u32;
        let digits = bits.div_ceil(most_bits);
        let digit_bits = bits.div_ceil(digits);
        // Of digits that wide there may be fewer.
        let digits = bits.div_ceil(digit_bits);
        let bins = 1 << digit_bits;
        let (key_words, has_values) = (options.key.words(), options.values);
        let shared_bytes = gpu.caps().max_shared_memory;
        let in_buffers = options.form == Form::Auto && gpu.caps().kind == DeviceKind::Cpu;
        let up_to = if in_buffers {
            capacity_in_buffers(shared_bytes, lanes, bins, digits)
        } else {
            capacity(shared_bytes, lanes, bins)
        };
        if up_to == 0 {
            return Ok(None);
        }
        let (kernel, moves) = if in_buffers {
            let spec = radix_one_group::Spec {
                local_size_x: lanes,
                bins,
                key_words,
                has_values,
            };
            (Kernel::Buffers(gpu.compute_pipeline(&spec)?), digits)
        } else {
            let spec = radix_small::Spec {
                local_size_x: lanes,
                bins,
                key_words,
                has_values,
                capacity: up_to,
            };
            (Kernel::Shared(gpu.compute_pipeline(&spec)?), 1)
        };
        Ok(Some(Self { up_to, moves, kernel }))
    }

    pub fn info(&self) -> PipelineInfo {
        match &self.kernel {
            Kernel::Shared(pipeline) => pipeline.info(),
            Kernel::Buffers(pipeline) => pipeline.info(),
        }
    }

    /// Keys at most.
    pub fn up_to(&self) -> u32 {
        self.up_to
    }

    /// The side that holds the result.
    pub fn result_side(&self) -> usize {
        self.moves as usize % 2
    }

    /// Records the dispatch from side 0.
    pub fn record(
        &self,
        pass: &mut Pass<'_>,
        options: &RadixSortOptions,
        buffers: &SortBuffers<'_>,
        count: Count<'_>,
        scratch: &Buffer,
    ) -> Result<()> {
        let [from, to] = buffers.keys.map(|side| side.buffer().view());
        // Kernels without values, and those with a count from the host, have the bindings nevertheless.
        let values = buffers.values.unwrap_or(buffers.keys);
        let [values_from, values_to] = values.map(|side| side.buffer().view());
        let (keys, stream_counts) = match count {
            Count::Host(count) => (count, scratch.view()),
            Count::Device { view, .. } => (STREAM_COUNT_ON_DEVICE, view),
        };
        let stream_scratch = scratch.view();
        let capacity = count.capacity();
        let (first_bit, last_bit) = (options.bits.start, options.bits.end);
        let descending = u32::from(options.order == Order::Descending);
        match &self.kernel {
            Kernel::Shared(pipeline) => {
                let set = radix_small::Set0 {
                    stream_scratch,
                    stream_counts,
                    radix_keys_from: from,
                    radix_keys_to: to,
                    radix_values_from: values_from,
                    radix_values_to: values_to,
                };
                let push = radix_small::Push {
                    count: keys,
                    capacity,
                    first_bit,
                    last_bit,
                    descending,
                };
                pass.dispatch(pipeline, &[&set], &push, [1, 1, 1])
            }
            Kernel::Buffers(pipeline) => {
                let set = radix_one_group::Set0 {
                    stream_scratch,
                    stream_counts,
                    radix_keys_a: from,
                    radix_keys_b: to,
                    radix_values_a: values_from,
                    radix_values_b: values_to,
                };
                let push = radix_one_group::Push {
                    count: keys,
                    capacity,
                    first_bit,
                    last_bit,
                    descending,
                };
                pass.dispatch(pipeline, &[&set], &push, [1, 1, 1])
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shared_memory_is_not_passed() {
        for (bytes, lanes, bins, expected) in [
            (32 << 10, 8, 256, 2048),
            (32 << 10, 256, 16, 1792),
            (16 << 10, 128, 16, 768),
            (48 << 10, 256, 16, 2048),
            (16 << 10, 256, 16, 0),
            (0, 8, 2, 0),
        ] {
            let keys = capacity(bytes, lanes, bins);
            assert_eq!(keys, expected, "{bytes} bytes, {lanes} lanes, {bins} bins");
            assert!(keys == 0 || 4 * (2 * keys + lanes * bins + lanes) <= bytes);
        }
    }

    #[test]
    fn loops_over_buffers_keep_the_quota() {
        for (bytes, lanes, bins, digits, expected) in [
            (32 << 10, 8, 256, 4, 1 << 14),
            (32 << 10, 8, 256, 8, 1 << 14),
            (32 << 10, 4, 256, 8, 1 << 14),
            (32 << 10, 16, 256, 8, 1 << 14),
            (16 << 10, 16, 256, 8, 1 << 14),
            (16 << 10, 32, 256, 8, 0),
            (16 << 10, 1, 256, 8, 6912),
            (16 << 10, 8, 2, 1, 1 << 14),
        ] {
            let keys = capacity_in_buffers(bytes, lanes, bins, digits);
            assert_eq!(
                keys, expected,
                "{bytes} bytes, {lanes} lanes, {bins} bins, {digits} digits"
            );
            let block = keys.div_ceil(lanes * KEYS_PER_READ);
            assert!(digits * (KEY_LOOPS * block + BIN_LOOPS * bins / 2) <= BLOCK_ITERATIONS || keys == 0);
        }
    }
}
