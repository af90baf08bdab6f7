//! Floor 2: building blocks over buffers, usable alone.
//!
//! Every kernel has one shape. It is made once for a device; it says how much scratch memory a number of elements needs; and it records
//! into a [`Pass`](crate::gpu::Pass) of the caller's command buffer (a host's own by [`Recorder::borrow`](crate::gpu::Recorder::borrow)), which
//! also names and times it. What is read must be visible to compute
//! shaders before, and what is written wants a barrier after; each kernel says which accesses. Between its own stages a kernel records its
//! barriers itself. The number of elements is known to the host, or read from a buffer ([`Count`]).
//!
//! Kernels number up to 2³¹ elements, but a device's buffers end before: none holds 2³⁰ words, and `maxStorageBufferRange` says how many fit;
//! for sorts see [`RadixSort::max_keys`].
//!
//! # What safe calls can do to memory
//!
//! No code here is `unsafe`; what is recorded goes through [`gpu`](crate::gpu), whose checks hold. Beyond these:
//!
//! | call | what holds |
//! |---|---|
//! | `new` of each | its specialization constants are made here, from checked options: bins of a [`Histogram`] are at most [`MAX_BINS`], words of a [`Permute`]'s elements at most 64, bits of a [`RadixSort`] a part of its keys; what shared memory a kernel takes is less than the device's |
//! | `record` of each | the number of elements, every range and the scratch memory are compared before anything is recorded. A count on the device that is above its capacity is taken for none |
//! | [`Permute`] | indices out of range touch nothing, and are counted |
//! | [`StreamStatus::read`] | as [`Gpu::read`](crate::gpu::Gpu::read) |
//! | `device_model` | buffers and sizes are its own |
//! | twins | slices, whose bounds Rust checks |
//!
//! Ranges that must be apart and are not, and barriers that are missing, give other numbers, within the buffers.
//!
//! The twin of a kernel is a plain Rust function of the same result ([`scan()`], [`radix_sort()`] …); tests hold both together.
//!
//! ```no_run
//! use clerestory::gpu::{BufferDesc, Category, Gpu, GpuOptions};
//! use clerestory::kernels::{Count, KeyWidth, RadixSort, RadixSortOptions, SortBuffers};
//!
//! # fn main() -> clerestory::Result<()> {
//! let gpu = Gpu::headless(&GpuOptions::default())?;
//! let sort = RadixSort::new(&gpu, RadixSortOptions::new(KeyWidth::Bits32, false))?;
//! let keys = [30_u32, 10, 20];
//! let count = keys.len() as u32;
//! // Two sides: passes go from one to the other and back.
//! let sides = [sort.keys("keys", count)?, sort.keys("other keys", count)?];
//! gpu.upload(sides[0].buffer(), 0, &keys)?;
//! let scratch = gpu.buffer(&BufferDesc::storage("scratch", sort.scratch_bytes(count), Category::Work))?;
//! let buffers = SortBuffers { keys: [&sides[0], &sides[1]], values: None };
//! let mut recorder = gpu.recorder("sort")?;
//! let mut side = 0;
//! recorder.pass("sort", |pass| {
//!     side = sort.record(pass, &buffers, Count::Host(count), &scratch)?;
//!     Ok(())
//! })?;
//! recorder.submit()?.wait()?;
//! // No barriers here: a submission sees all that earlier ones wrote, and reading back waits.
//! let sorted: Vec<u32> = gpu.read(sides[side].buffer().view(), keys.len())?;
//! assert_eq!(sorted, [10, 20, 30]);
//! # Ok(())
//! # }
//! ```
//!
//! Kernels over a stream reduce, then scan, then work: no workgroup ever waits for another. A team, which is a workgroup or a single
//! invocation ([`Form`]), owns a contiguous block of the stream, so results are the same bits whatever the device.

pub mod device_model;
mod form;
mod histogram;
mod operation;
pub(crate) mod partition;
mod permute;
mod radix_plan;
mod radix_small;
pub(crate) mod radix_sort;
mod reduce;
pub(crate) mod scan;
mod stream;

pub use form::Form;
pub use histogram::{Histogram, MAX_BINS, histogram};
pub use operation::Operation;
pub use partition::{Keep, Partition, PartitionBuffers, PartitionOptions, compact, split};
pub use permute::{Direction, Permute, PermuteBuffers, gather, scatter};
pub use radix_sort::{KeyWidth, Order, RadixSort, RadixSortOptions, SortBuffers, radix_sort};
pub use reduce::{
    BoxElements, ReduceBox, ReduceWords, float_of_ordered, nan_bits, ordered_float, reduce_box, reduce_words,
};
pub use scan::{Scan, ScanBuffers, ScanOptions, scan};
pub(crate) use stream::IndirectCount;
pub use stream::{Count, StreamStatus, stream_block, stream_range, stream_teams};
