//! Radix sort of few keys in one dispatch: one workgroup, and shared memory for what moves between digits.
//!
//! For few keys a sort's time is that of its dispatches and barriers. Sources and guarantees are those of [`radix_sort`](super::radix_sort).

use super::radix_sort::{Order, RadixSortOptions, SortBuffers};
use super::stream::Count;
use crate::Result;
use crate::gpu::shaders::constants::STREAM_COUNT_ON_DEVICE;
use crate::gpu::shaders::kernels::radix_small as kernel;
use crate::gpu::{Buffer, Caps, ComputePipeline, DeviceKind, Gpu, Pass, PipelineInfo};

/// Keys at most, where shared memory allows: with more, one workgroup takes longer than many do with their barriers.
const MAX_KEYS: u32 = 2048;
/// Capacities are a multiple of this.
const CAPACITY_STEP: u32 = 256;

/// A sort of up to a number of keys in one dispatch. The result is on side 1.
#[derive(Debug)]
pub(super) struct SmallSort {
    up_to: u32,
    pipeline: ComputePipeline<kernel::Kernel>,
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
    // The scan over the workgroup has a word for each invocation.
    let counters = lanes * bins + lanes;
    let keys = (shared_bytes / 4).saturating_sub(counters) / 2;
    keys.min(MAX_KEYS) / CAPACITY_STEP * CAPACITY_STEP
}

impl SmallSort {
    /// Makes the pipeline; `None` where shared memory is too small.
    pub fn new(gpu: &Gpu, options: &RadixSortOptions) -> Result<Option<Self>> {
        let [lanes, most_bits] = tuning(gpu.caps());
        let bits = options.bits.len() as u32;
        let bins = 1 << bits.div_ceil(bits.div_ceil(most_bits));
        let up_to = capacity(gpu.caps().max_shared_memory, lanes, bins);
        if up_to == 0 {
            return Ok(None);
        }
        let pipeline = gpu.compute_pipeline(&kernel::Spec {
            local_size_x: lanes,
            bins,
            key_words: options.key.words(),
            has_values: options.values,
            capacity: up_to,
        })?;
        Ok(Some(Self { up_to, pipeline }))
    }

    pub fn info(&self) -> PipelineInfo {
        self.pipeline.info()
    }

    /// Keys at most.
    pub fn up_to(&self) -> u32 {
        self.up_to
    }

    /// Records the dispatch from side 0 to side 1.
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
        let set = kernel::Set0 {
            stream_scratch: scratch.view(),
            stream_counts,
            radix_keys_from: from,
            radix_keys_to: to,
            radix_values_from: values_from,
            radix_values_to: values_to,
        };
        let push = kernel::Push {
            count: keys,
            capacity: count.capacity(),
            first_bit: options.bits.start,
            last_bit: options.bits.end,
            descending: u32::from(options.order == Order::Descending),
        };
        pass.dispatch(&self.pipeline, &[&set], &push, [1, 1, 1])
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
}
