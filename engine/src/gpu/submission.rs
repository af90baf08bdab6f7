//! Work that the queue has taken, and waiting for it.

use std::time::{Duration, Instant};

use ash::vk;

use super::device::{Gpu, Inner};
use super::options::Validation;
use super::recorded::Recorded;
use super::timing::Timings;
use crate::{Error, Result};

/// How long one call to the driver waits, so that a host thread never blocks for good.
const WAIT_SLICE: Duration = Duration::from_millis(200);

/// A submitted command buffer. It keeps alive what the device uses, whatever else is dropped; dropping it waits for the device.
pub struct Submission {
    pub(super) gpu: Gpu,
    pub(super) name: String,
    pub(super) value: u64,
    pub(super) recorded: Recorded,
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
        self.gpu.inner.in_flight().end(self.value, true);
        self.recorded.timings()
    }
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
