//! What a recorded command buffer needs until the device is done with it, and the times of its passes.

use std::collections::BTreeMap;
use std::ops::Range;
use std::sync::Arc;

use ash::vk;

use super::buffer::BufferInner;
use super::device::{Gpu, Inner};
use super::recorder::{Kept, MAX_PASSES};
use super::resources::{COUNTS_OF_DRAWS, Lease};
use super::timing::{Drawn, PassTiming, Timings, elapsed};
use crate::Result;

/// What a command buffer uses: descriptor sets, query pools, and everything that was bound.
///
/// From [`BorrowedRecorder::finish`](super::BorrowedRecorder::finish): the host drops it when the device is done with the command buffer
/// (its fence or semaphore has been waited for), or when the command buffer will never be submitted again. It waits for nothing itself.
pub struct Recorded {
    pub(super) gpu: Gpu,
    /// Goes back before what its commands use does.
    pub(super) resources: Lease,
    pub(super) passes: Vec<String>,
    /// Barrier commands of each pass.
    pub(super) barriers: Vec<u32>,
    pub(super) kept: Kept,
    /// The buffers in use that the host reaches, too, by their numbers: all threads lock several of them in one order.
    pub(super) mapped: BTreeMap<u64, Arc<BufferInner>>,
    /// The first pass whose invocations are counted.
    pub(super) counted_from: Option<usize>,
    /// Passes write timestamps.
    pub(super) is_timed: bool,
}

impl Recorded {
    /// Nothing yet, with query pools that are reset.
    pub(super) fn new(gpu: &Gpu, is_timed: bool) -> Result<Self> {
        let resources = Lease::take(gpu)?;
        let device = &gpu.inner.device;
        // SAFETY: the pools are idle, and hostQueryReset is enabled.
        unsafe {
            if is_timed && resources.timestamps != vk::QueryPool::null() {
                device.reset_query_pool(resources.timestamps, 0, 2 * MAX_PASSES as u32);
            }
            if resources.statistics != vk::QueryPool::null() {
                device.reset_query_pool(resources.statistics, 0, MAX_PASSES as u32);
            }
        }
        Ok(Self {
            gpu: gpu.clone(),
            resources,
            passes: Vec::new(),
            barriers: Vec::new(),
            kept: Kept::new(),
            mapped: BTreeMap::new(),
            counted_from: None,
            is_timed,
        })
    }

    /// The passes with their times and counts, as far as the device is done: it does not wait, and says in [`Timings::untimed`] why there
    /// are none.
    pub fn timings(&self) -> Timings {
        let inner = &self.gpu.inner;
        let count = self.passes.len();
        let timed = if self.is_timed { 2 * count } else { 0 };
        let timestamps: Option<Vec<u64>> = read(inner, self.resources.timestamps, 0..timed);
        // Queries of passes before the first counted one never began, and to read one would give nothing at all.
        let counted_from = self.counted_from.unwrap_or(count);
        let counted = read_counts(inner, self.resources.statistics, counted_from..count);
        let (period, valid_bits) = (f64::from(inner.caps.timestamp_period), inner.caps.timestamp_valid_bits);
        let nanoseconds = |index: usize| {
            let ticks = timestamps.as_ref()?;
            Some((elapsed(ticks[2 * index], ticks[2 * index + 1], valid_bits) as f64 * period) as u64)
        };
        let passes = self.passes.iter().zip(&self.barriers).enumerate();
        let passes = passes.map(|(index, (name, barriers))| {
            let counts = index.checked_sub(counted_from).and_then(|place| counted.get(place));
            PassTiming {
                name: name.clone(),
                nanoseconds: nanoseconds(index),
                barriers: *barriers,
                invocations: counts.map(|(_, invocations)| *invocations),
                drawn: counts.and_then(|(drawn, _)| *drawn),
            }
        });
        Timings {
            passes: passes.collect(),
            untimed: match &timestamps {
                Some(_) => None,
                None if valid_bits == 0 => Some("the device's queue has no timestamps"),
                None if count == 0 => Some("there is no pass"),
                None if !self.is_timed => Some("no timestamps were asked for"),
                None => Some("the driver did not give the timestamps"),
            },
        }
    }
}

/// Results of queries, `T` each; `None` without any.
fn read<T: Copy + Default>(inner: &Inner, pool: vk::QueryPool, queries: Range<usize>) -> Option<Vec<T>> {
    if pool == vk::QueryPool::null() || queries.is_empty() {
        return None;
    }
    let mut values = vec![T::default(); queries.len()];
    let flags = vk::QueryResultFlags::TYPE_64;
    // SAFETY: the queries were written by the submission that has just finished, and `T` holds the numbers of one.
    unsafe {
        inner
            .device
            .get_query_pool_results(pool, queries.start as u32, &mut values, flags)
    }
    .ok()?;
    Some(values)
}

/// What draws and compute shaders of passes did; none without counts.
fn read_counts(inner: &Inner, pool: vk::QueryPool, queries: Range<usize>) -> Vec<(Option<Drawn>, u64)> {
    if !inner.caps.graphics {
        let counts: Option<Vec<u64>> = read(inner, pool, queries);
        return counts.unwrap_or_default().into_iter().map(|n| (None, n)).collect();
    }
    let counts: Option<Vec<[u64; COUNTS_OF_DRAWS + 1]>> = read(inner, pool, queries);
    let sort = |[vertices, primitives, fragments, invocations]: [u64; COUNTS_OF_DRAWS + 1]| {
        let drawn = Drawn {
            vertices,
            primitives,
            fragments,
        };
        (Some(drawn), invocations)
    };
    counts.unwrap_or_default().into_iter().map(sort).collect()
}
