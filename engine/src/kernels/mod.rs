//! Floor 2: building blocks over buffers, usable alone.
//!
//! Every kernel has one shape. It is made once for a device; it says how much scratch memory a number of elements needs; and it records
//! into a [`Pass`](crate::gpu::Pass) of the caller's command buffer, which also names and times it. What is read must be visible to compute
//! shaders before, and what is written wants a barrier after; each kernel says which accesses. Between its own stages a kernel records its
//! barriers itself. The number of elements is known to the host, or read from a buffer ([`Count`]).
//!
//! Kernels over a stream reduce, then scan, then work: no workgroup ever waits for another. A team, which is a workgroup or a single
//! invocation ([`Form`]), owns a contiguous block of the stream, so results are the same bits whatever the device.

pub mod device_model;
mod histogram;
mod partition;
mod permute;
mod radix_plan;
mod radix_small;
mod radix_sort;
mod reduce;
mod scan;
mod stream;

pub use histogram::{Histogram, MAX_BINS, histogram};
pub use partition::{Keep, Partition, PartitionBuffers, PartitionOptions, compact, split};
pub use permute::{Direction, Permute, PermuteBuffers, gather, scatter};
pub use radix_sort::{KeyWidth, Order, RadixSort, RadixSortOptions, SortBuffers, radix_sort};
pub use reduce::{
    BoxElements, ReduceBox, ReduceWords, float_of_ordered, nan_bits, ordered_float, reduce_box, reduce_words,
};
pub use scan::{Scan, ScanBuffers, ScanOptions, scan};
pub use stream::{Count, Form, Operation, StreamStatus, stream_block, stream_range, stream_teams};
