//! Work that the queue has taken, and waiting for it.

use std::ops::Range;
use std::time::{Duration, Instant};

use ash::vk;

use super::device::{Gpu, Inner};
use super::options::Validation;
use super::recorder::Kept;
use super::resources::{COUNTS_OF_DRAWS, Lease};
use super::timing::{Drawn, PassTiming, Timings, elapsed};
use crate::{Error, Result};

/// How long one call to the driver waits, so that a host thread never blocks for good.
const WAIT_SLICE: Duration = Duration::from_millis(200);

/// A submitted command buffer. It keeps alive what the device uses, whatever else is dropped; dropping it waits for the device.
pub struct Submission {
    pub(super) gpu: Gpu,
    pub(super) name: String,
    pub(super) value: u64,
    /// Goes back before what its commands use does.
    pub(super) resources: Lease,
    pub(super) passes: Vec<String>,
    /// Barrier commands of each pass.
    pub(super) barriers: Vec<u32>,
    pub(super) _kept: Kept,
    /// The first pass whose invocations were counted.
    pub(super) counted_from: Option<usize>,
    /// The device is known to have finished.
    pub(super) finished: bool,
}

impl Submission {
    /// True when the device has finished.
    ///
    /// # Errors
    /// [`Error::DeviceLost`].
    pub fn is_done(&self) -> Result<bool> {
        self.wait_slice(Duration::ZERO)
    }

    /// Waits until the device has finished and returns the passes' times.
    ///
    /// # Errors
    /// [`Error::DeviceLost`], naming the last pass that began.
    pub fn wait(self) -> Result<Timings> {
        while !self.wait_slice(WAIT_SLICE)? {}
        Ok(self.finish())
    }

    /// As [`Submission::wait`], for at most `limit`; on [`Error::TimedOut`] the submission comes back to be waited for again.
    ///
    /// # Errors
    /// The error together with the submission, where there is one left.
    pub fn wait_for(self, limit: Duration) -> std::result::Result<Timings, (Error, Option<Box<Self>>)> {
        let start = Instant::now();
        loop {
            let left = limit.saturating_sub(start.elapsed());
            match self.wait_slice(left.min(WAIT_SLICE)) {
                Ok(true) => return Ok(self.finish()),
                Ok(false) if left.is_zero() => {
                    return Err((
                        Error::TimedOut {
                            what: self.name.clone(),
                            seconds: limit.as_secs_f64(),
                        },
                        Some(Box::new(self)),
                    ));
                }
                Ok(false) => {}
                Err(error) => return Err((error, None)),
            }
        }
    }

    fn wait_slice(&self, limit: Duration) -> Result<bool> {
        let inner = &self.gpu.inner;
        inner.check_alive()?;
        let (semaphores, values) = ([inner.timeline], [self.value]);
        let info = vk::SemaphoreWaitInfo::default().semaphores(&semaphores).values(&values);
        // SAFETY: the timeline lives as long as the device.
        match unsafe { inner.device.wait_semaphores(&info, limit.as_nanos() as u64) } {
            Ok(()) => Ok(true),
            Err(vk::Result::TIMEOUT) => Ok(false),
            Err(result) => Err(inner.error("vkWaitSemaphores", result)),
        }
    }

    fn finish(mut self) -> Timings {
        self.finished = true;
        let inner = &self.gpu.inner;
        inner.in_flight().end(self.value, true);
        let count = self.passes.len();
        let timestamps: Option<Vec<u64>> = read(inner, self.resources.timestamps, 0..2 * count);
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

/// Hands a command buffer to the queue: it waits for `wait`, then signals `signal` and raises the timeline to `value`.
///
/// # Safety
/// What the command buffer uses must live until the timeline has reached `value`; the queue must be locked.
pub(super) unsafe fn submit(
    inner: &Inner,
    queue: vk::Queue,
    command_buffer: vk::CommandBuffer,
    wait: &[vk::Semaphore],
    signal: &[vk::Semaphore],
    value: u64,
) -> Result<()> {
    if inner.validation == Validation::GpuAssisted {
        // SAFETY: the caller's promises.
        return unsafe { submit_by_version_1(inner, queue, command_buffer, wait, signal, value) };
    }
    let all = vk::PipelineStageFlags2::ALL_COMMANDS;
    let semaphore = |raw: &vk::Semaphore| vk::SemaphoreSubmitInfo::default().semaphore(*raw).stage_mask(all);
    let waits: Vec<_> = wait.iter().map(semaphore).collect();
    let mut signals: Vec<_> = signal.iter().map(semaphore).collect();
    signals.push(semaphore(&inner.timeline).value(value));
    let buffers = [vk::CommandBufferSubmitInfo::default().command_buffer(command_buffer)];
    let info = vk::SubmitInfo2::default()
        .wait_semaphore_infos(&waits)
        .command_buffer_infos(&buffers)
        .signal_semaphore_infos(&signals);
    // SAFETY: the caller's promises; the infos live on this stack.
    unsafe { inner.device.queue_submit2(queue, &[info], vk::Fence::null()) }
        .map_err(|result| inner.error("vkQueueSubmit2", result))
}

/// As [`submit`] by `vkQueueSubmit`: GPU-assisted validation (1.3.239) does not follow `vkQueueSubmit2`, so it would neither report what
/// shaders did nor see the timeline rise, and every wait would take its ten seconds of patience.
///
/// # Safety
/// As [`submit`].
unsafe fn submit_by_version_1(
    inner: &Inner,
    queue: vk::Queue,
    command_buffer: vk::CommandBuffer,
    wait: &[vk::Semaphore],
    signal: &[vk::Semaphore],
    value: u64,
) -> Result<()> {
    let stages = vec![vk::PipelineStageFlags::ALL_COMMANDS; wait.len()];
    let signals = [signal, &[inner.timeline]].concat();
    // Values of binary semaphores are ignored.
    let wait_values = vec![0; wait.len()];
    let signal_values = [vec![0; signal.len()], vec![value]].concat();
    let mut timeline = vk::TimelineSemaphoreSubmitInfo::default()
        .wait_semaphore_values(&wait_values)
        .signal_semaphore_values(&signal_values);
    let buffers = [command_buffer];
    let info = vk::SubmitInfo::default()
        .wait_semaphores(wait)
        .wait_dst_stage_mask(&stages)
        .command_buffers(&buffers)
        .signal_semaphores(&signals)
        .push_next(&mut timeline);
    // SAFETY: the caller's promises; the infos live on this stack.
    unsafe { inner.device.queue_submit(queue, &[info], vk::Fence::null()) }
        .map_err(|result| inner.error("vkQueueSubmit", result))
}

impl Drop for Submission {
    fn drop(&mut self) {
        if self.finished {
            return;
        }
        let outcome = loop {
            match self.wait_slice(WAIT_SLICE) {
                Ok(false) => {}
                other => break other,
            }
        };
        if outcome.is_err() {
            // A device that was lost while it worked may still be stopping. Afterwards it will never touch anything again.
            self.gpu.inner.wait_for_queue();
        }
        self.gpu.inner.in_flight().end(self.value, outcome.is_ok());
    }
}
