//! Radix sort of 32- or 64-bit keys, alone or with 32-bit values.
//!
//! Least-significant-digit first; each digit takes three stages (counts by team, prefix sums of the counts, scatter), after Satish, Harris
//! and Garland, "Designing efficient sorting algorithms for manycore GPUs" (IPDPS 2009), section 4. In the serial form a team is an
//! invocation that walks its block with counters of its own; in the subgroup form a team is a workgroup, and subgroups rank equal digits by
//! ballots (Ashkiani and others, "GPU multisplit", PPoPP 2016). Few keys are one workgroup's work in one dispatch.
//!
//! Guarantees: stable in either order; the same bits on every device and in every form; equal to [`radix_sort`], its twin. Keys are
//! unsigned: those of other types want an order-preserving map first. Only the bits of [`RadixSortOptions::bits`] are compared. How many
//! keys there may be is the device's choice: [`RadixSort::max_keys`].

use std::ops::Range;

use super::form::Form;
use super::radix_plan::{Plan, Tuning};
use super::radix_small::SmallSort;
use super::stream::{self, Count, MAX_COUNT, Prepare};
use crate::catalogue::{Role, Row, sources};
use crate::gpu::ash::vk;
use crate::gpu::interface::ShaderInfo;
use crate::gpu::shaders::kernels::{
    radix_count_serial, radix_count_subgroup, radix_one_group, radix_scan, radix_scatter_serial,
    radix_scatter_subgroup, radix_small, stream_prepare,
};
use crate::gpu::shaders::types::StreamPlan;
use crate::gpu::{Buffer, Category, Gpu, Pass, PipelineInfo, TexelView};
use crate::{Error, Result};

/// Width of keys.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum KeyWidth {
    /// One word.
    #[default]
    Bits32,
    /// Two words, the low one first: `u64` in memory on little-endian hosts.
    Bits64,
}

impl KeyWidth {
    /// Words of a key.
    pub fn words(self) -> u32 {
        match self {
            Self::Bits32 => 1,
            Self::Bits64 => 2,
        }
    }
}

/// Which keys come first.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Order {
    /// The smallest.
    #[default]
    Ascending,
    /// The largest. Equal keys still keep their order.
    Descending,
}

/// What to sort, and how.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct RadixSortOptions {
    /// Width of keys.
    pub key: KeyWidth,
    /// Every key has a 32-bit value that goes where it goes.
    pub values: bool,
    /// Which keys come first.
    pub order: Order,
    /// The bits of keys that are compared, counted from the lowest; fewer bits take fewer passes.
    pub bits: Range<u32>,
    /// What teams are. [`Form::Auto`] sorts few keys by one workgroup in one dispatch: some 2,000, as shared memory allows, and more on
    /// software devices ([`RadixSort::one_dispatch_up_to`]). [`Form::Shared`] does so too, always in shared memory, and is the serial form for more.
    pub form: Form,
}

impl RadixSortOptions {
    /// Ascending, by all bits.
    pub fn new(key: KeyWidth, values: bool) -> Self {
        Self {
            key,
            values,
            order: Order::Ascending,
            bits: 0..32 * key.words(),
            form: Form::Auto,
        }
    }
}

/// Where keys and values are: two sides each, of buffers made by [`RadixSort::keys`] and [`RadixSort::values`].
///
/// The input is on side 0. Each digit goes from one side to the other, so both sides are written, and [`RadixSort::result_side`] says where
/// the result is.
#[derive(Debug, Clone, Copy)]
pub struct SortBuffers<'a> {
    /// The keys.
    pub keys: [&'a TexelView; 2],
    /// The values, where the sort has any.
    pub values: Option<[&'a TexelView; 2]>,
}

/// A radix sort for one kind of keys.
///
/// Barriers: what wrote the input must have been made visible to [`Access::COMPUTE`](crate::gpu::Access::COMPUTE), and so must earlier uses
/// of the other sides and of the scratch memory have ended. After it, both sides and the scratch memory have been read and written by
/// compute shaders, and a count on the device has been read by one: [`rw_compute_to_compute`](crate::gpu::rw_compute_to_compute) and its like are what the next use wants.
#[derive(Debug)]
pub struct RadixSort {
    gpu: Gpu,
    options: RadixSortOptions,
    prepare: Prepare,
    /// For few keys, where the form and the device allow it.
    small: Option<SmallSort>,
    /// For few keys, and for many.
    plans: [Plan; 2],
}

impl RadixSort {
    /// The kernels that a sort may take, on whatever device.
    pub const KERNELS: [&'static ShaderInfo; 8] = [
        &stream_prepare::INFO,
        &radix_small::INFO,
        &radix_one_group::INFO,
        &radix_count_serial::INFO,
        &radix_count_subgroup::INFO,
        &radix_scan::INFO,
        &radix_scatter_serial::INFO,
        &radix_scatter_subgroup::INFO,
    ];

    /// Makes the pipelines.
    ///
    /// # Errors
    /// [`Error::Setting`] when `bits` is empty or passes the key's width, [`Error::MissingFeature`] as [`Form::on`],
    /// [`Error::OutOfMemory`].
    pub fn new(gpu: &Gpu, options: RadixSortOptions) -> Result<Self> {
        let bits = &options.bits;
        if bits.is_empty() || bits.end > 32 * options.key.words() {
            let cause = format!("is not a part of 0..{}", 32 * options.key.words());
            return Err(Error::setting("bits", format!("{bits:?}"), cause));
        }
        // Ranks without subgroup operations come from walking blocks alone.
        let form = match options.form.on(gpu.caps(), "radix sort")? {
            Form::Subgroup => Form::Subgroup,
            _ => Form::Serial,
        };
        let small = match options.form {
            Form::Auto | Form::Shared => SmallSort::new(gpu, &options)?,
            Form::Serial | Form::Subgroup => None,
        };
        let [few, many] = Tuning::of(gpu.caps(), form);
        let plans = [
            Plan::new(gpu, &options, form, few)?,
            Plan::new(gpu, &options, form, many)?,
        ];
        Ok(Self {
            gpu: gpu.clone(),
            options,
            prepare: Prepare::new(gpu)?,
            small,
            plans,
        })
    }

    /// The kernels with their specialization.
    pub fn pipelines(&self) -> Vec<PipelineInfo> {
        let small = self.small.as_ref().map(SmallSort::info);
        let all = std::iter::once(self.prepare.info()).chain(small);
        all.chain(self.plans.iter().flat_map(Plan::pipelines)).collect()
    }

    /// What it sorts.
    pub fn options(&self) -> &RadixSortOptions {
        &self.options
    }

    /// A buffer for one side of `count` keys.
    ///
    /// # Errors
    /// As [`Gpu::storage_texels`]; [`RadixSort::max_keys`] says what is too many.
    pub fn keys(&self, name: &str, count: u32) -> Result<TexelView> {
        self.side_of(name, u64::from(count) * u64::from(self.options.key.words()))
    }

    /// A buffer for one side of `count` values.
    ///
    /// # Errors
    /// As [`Gpu::storage_texels`].
    pub fn values(&self, name: &str, count: u32) -> Result<TexelView> {
        self.side_of(name, count.into())
    }

    fn side_of(&self, name: &str, words: u64) -> Result<TexelView> {
        let format = vk::Format::R32G32B32A32_UINT;
        self.gpu.storage_texels(name, Category::Work, format, words.div_ceil(4))
    }

    /// Bytes of scratch memory for up to `capacity` keys, and for any fewer.
    pub fn scratch_bytes(&self, capacity: u32) -> u64 {
        if self.small(capacity).is_some() {
            return stream::scratch_bytes(0);
        }
        let [few, many] = &self.plans;
        let of_few = few.counters(capacity.min(few.up_to));
        stream::scratch_bytes(if capacity <= few.up_to {
            of_few
        } else {
            of_few.max(many.counters(capacity))
        })
    }

    /// The most keys that the device can sort, memory allowing: one side is read by texels of four words and written as a storage buffer, so
    /// that `maxTexelBufferElements` or `maxStorageBufferRange` binds. Vulkan promises 2¹⁸ words; there are 2²⁵ on Mesa's software driver and
    /// 2²⁹ on NVIDIA's devices.
    pub fn max_keys(&self) -> u32 {
        let caps = self.gpu.caps();
        max_keys(
            caps.max_texel_buffer_elements,
            caps.max_storage_buffer_range,
            self.options.key,
        )
    }

    /// The side of the buffers that holds the result of a sort of up to `capacity` keys.
    pub fn result_side(&self, capacity: u32) -> usize {
        match self.small(capacity) {
            Some(small) => small.result_side(),
            None => self.plan(capacity).digits(&self.options.bits).len() % 2,
        }
    }

    /// Keys that are sorted in one dispatch at most, where the capacity is no larger; 0 where none are.
    pub fn one_dispatch_up_to(&self) -> u32 {
        self.small.as_ref().map_or(0, SmallSort::up_to)
    }

    /// Records a sort of side 0 and returns the side that holds the result. With a count on the device, both depend on the capacity only.
    ///
    /// # Errors
    /// [`Error::LimitExceeded`] when there are more than 2³¹ keys, which no device has room for, or a buffer is too small,
    /// [`Error::Setting`] when there are values and the sort has none, or the other way round; and as [`Pass::dispatch`].
    pub fn record(
        &self,
        pass: &mut Pass<'_>,
        buffers: &SortBuffers<'_>,
        count: Count<'_>,
        scratch: &Buffer,
    ) -> Result<usize> {
        let capacity = count.capacity();
        self.check(buffers, capacity, scratch)?;
        if matches!(count, Count::Host(0)) {
            return Ok(self.result_side(0));
        }
        if let Some(small) = self.small(capacity) {
            small.record(pass, &self.options, buffers, count, scratch)?;
            return Ok(small.result_side());
        }
        let plan = self.plan(capacity);
        let stream = self.prepare.begin(pass, &plan.shape, count, scratch)?;
        let digits = plan.digits(&self.options.bits);
        for (index, digit) in digits.iter().enumerate() {
            if index > 0 {
                let sides = buffers.keys.iter().chain(buffers.values.iter().flatten());
                let sides: Vec<&Buffer> = sides.map(|side| side.buffer()).collect();
                stream.between_stages(pass, &sides);
            }
            plan.record(pass, &stream, buffers, index % 2, self.push(stream.plan, digit))?;
        }
        Ok(digits.len() % 2)
    }

    fn small(&self, capacity: u32) -> Option<&SmallSort> {
        self.small.as_ref().filter(|small| capacity <= small.up_to())
    }

    fn plan(&self, capacity: u32) -> &Plan {
        let [few, many] = &self.plans;
        if capacity <= few.up_to { few } else { many }
    }

    fn check(&self, buffers: &SortBuffers<'_>, capacity: u32, scratch: &Buffer) -> Result<()> {
        stream::check_count("radix sort", capacity)?;
        if buffers.values.is_some() != self.options.values {
            let given = if buffers.values.is_some() { "given" } else { "missing" };
            return Err(Error::setting("values", given, "is not what the sort was made for"));
        }
        let key_bytes = u64::from(capacity) * 4 * u64::from(self.options.key.words());
        for side in buffers.keys {
            stream::check_size(side.buffer(), key_bytes)?;
        }
        for side in buffers.values.iter().flatten() {
            stream::check_size(side.buffer(), u64::from(capacity) * 4)?;
        }
        stream::check_size(scratch, self.scratch_bytes(capacity))
    }

    fn push(&self, plan: StreamPlan, digit: &Range<u32>) -> radix_scan::Push {
        let mask = (1 << digit.len()) - 1;
        radix_scan::Push {
            plan,
            shift: digit.start,
            mask,
            flip: match self.options.order {
                Order::Ascending => 0,
                Order::Descending => mask,
            },
        }
    }
}

/// Keys of one side, of so many texels of four words and so many bytes at most.
fn max_keys(texels: u64, range: u64, key: KeyWidth) -> u32 {
    // Whole texels are bound.
    let texels = texels.min(range / 16);
    (4 * texels / u64::from(key.words())).min(MAX_COUNT.into()) as u32
}

/// Twin of [`RadixSort`]: digits of `digit_bits` bits from the lowest of `bits` up, each by a stable counting sort. `values` is empty or as
/// long as `keys`.
pub fn radix_sort(keys: &mut [u64], values: &mut [u32], bits: Range<u32>, order: Order, digit_bits: u32) {
    for start in bits.clone().step_by(digit_bits.clamp(1, 16) as usize) {
        let width = (bits.end - start).min(digit_bits.clamp(1, 16));
        let mask = (1u64 << width) - 1;
        let flip = if order == Order::Descending { mask } else { 0 };
        let digit = |key: u64| ((key >> start & mask) ^ flip) as usize;
        let mut places = vec![0usize; mask as usize + 1];
        for key in keys.iter() {
            places[digit(*key)] += 1;
        }
        let mut before = 0;
        for place in &mut places {
            before += std::mem::replace(place, before);
        }
        let (old_keys, old_values) = (keys.to_vec(), values.to_vec());
        for (at, key) in old_keys.into_iter().enumerate() {
            let place = &mut places[digit(key)];
            keys[*place] = key;
            if let (Some(target), Some(value)) = (values.get_mut(*place), old_values.get(at)) {
                *target = *value;
            }
            *place += 1;
        }
    }
}

/// Rows of the catalogue.
pub(crate) const ROWS: &[Row] = &[Row {
    id: "PM-B-4",
    name: "radix sort of 32- and 64-bit keys, with or without values",
    role: Role::Kernel,
    limits: "Keys are unsigned: others need an order-preserving map first; the device bounds how many there may be.",
    sources: &[sources::SATISH_2009.whole(), sources::ASHKIANI_2016.whole()],
    shaders: &[
        "shaders/kernels/radix_count_serial.comp",
        "shaders/kernels/radix_count_subgroup.comp",
        "shaders/kernels/radix_one_group.comp",
        "shaders/kernels/radix_scan.comp",
        "shaders/kernels/radix_scatter_serial.comp",
        "shaders/kernels/radix_scatter_subgroup.comp",
        "shaders/kernels/radix_small.comp",
    ],
    tests: &[
        "tests/tests/kernels/sort.rs::every_size_and_pattern_is_as_by_std",
        "tests/tests/kernels/sort.rs::bits_and_orders_are_those_asked_for",
        "tests/tests/kernels/sort.rs::repeated_sorts_give_the_same_bits_in_every_form",
        "tests/tests/kernels/sort.rs::many_keys_take_the_other_plan",
        "tests/tests/kernels/many_sorts.rs::sorts_of_random_sizes_and_patterns_are_as_by_std",
    ],
    experiment: "clerestory bench --sort --peers",
    api: &["clerestory::kernels::RadixSort", "clerestory::kernels::radix_sort"],
    settings: &["clerestory::kernels::RadixSortOptions"],
    ..Row::of(file!())
}];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_limit_that_binds_first_says_how_many_keys_there_may_be() {
        let full_range = u64::from(u32::MAX);
        for (texels, range, key, most) in [
            // What Vulkan promises, the software driver, NVIDIA's devices, and texels without a limit.
            (1 << 16, 1 << 27, KeyWidth::Bits32, 1 << 18),
            (1 << 27, 1 << 27, KeyWidth::Bits32, 1 << 25),
            (1 << 27, full_range, KeyWidth::Bits32, 1 << 29),
            (1 << 27, full_range, KeyWidth::Bits64, 1 << 28),
            (1 << 31, full_range, KeyWidth::Bits32, (1 << 30) - 4),
            (1 << 31, 1 << 40, KeyWidth::Bits32, 1 << 31),
        ] {
            assert_eq!(max_keys(texels, range, key), most, "{texels} {range} {key:?}");
        }
    }
}
