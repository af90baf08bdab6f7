//! Work that the queue has taken, and waiting for it.

use std::sync::PoisonError;
use std::time::{Duration, Instant};

use ash::vk;

use super::buffer::Buffer;
use super::device::Gpu;
use super::marker;
use super::recorder::Kept;
use super::resources::FrameResources;
use super::timing::{PassTiming, Timings};
use crate::{Error, Result};

/// How long one call to the driver waits, so that a host thread never blocks for good.
const WAIT_SLICE: Duration = Duration::from_millis(200);

/// A submitted command buffer. It keeps alive what the device uses; dropping it waits.
pub struct Submission {
    gpu: Gpu,
    name: String,
    value: u64,
    resources: Option<FrameResources>,
    markers: Option<Buffer>,
    passes: Vec<String>,
    kept: Kept,
    statistics: bool,
}

impl Submission {
    #[expect(clippy::too_many_arguments, reason = "the parts of a recorder, handed over once")]
    pub(super) fn new(
        gpu: Gpu,
        name: String,
        value: u64,
        resources: Option<FrameResources>,
        markers: Option<Buffer>,
        passes: Vec<String>,
        kept: Kept,
        statistics: bool,
    ) -> Self {
        Self {
            gpu,
            name,
            value,
            resources,
            markers,
            passes,
            kept,
            statistics,
        }
    }

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
        self.finish()
    }

    /// As [`Submission::wait`], for at most `limit`; on [`Error::TimedOut`] the submission comes back to be waited for again.
    ///
    /// # Errors
    /// The error together with the submission, where there is one left.
    pub fn wait_for(self, limit: Duration) -> std::result::Result<Timings, (Error, Option<Self>)> {
        let start = Instant::now();
        loop {
            let left = limit.saturating_sub(start.elapsed());
            match self.wait_slice(left.min(WAIT_SLICE)) {
                Ok(true) => return self.finish().map_err(|error| (error, None)),
                Ok(false) if left.is_zero() => {
                    return Err((
                        Error::TimedOut {
                            what: self.name.clone(),
                            seconds: limit.as_secs_f64(),
                        },
                        Some(self),
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
            Err(vk::Result::ERROR_DEVICE_LOST) => {
                let last = self
                    .markers
                    .as_ref()
                    .map(|markers| marker::last_pass(markers, &self.passes));
                let last = inner
                    .lost
                    .get_or_init(|| last.unwrap_or_else(|| format!("somewhere in {:?}", self.name)));
                Err(Error::DeviceLost {
                    last_pass: last.clone(),
                })
            }
            Err(result) => Err(inner.error("vkWaitSemaphores", result)),
        }
    }

    fn finish(mut self) -> Result<Timings> {
        let Some(mut resources) = self.resources.take() else {
            return Ok(Timings::default());
        };
        let inner = &self.gpu.inner;
        let count = self.passes.len();
        let read = |pool: vk::QueryPool, queries: usize| -> Option<Vec<u64>> {
            let mut values = vec![0u64; queries];
            if pool == vk::QueryPool::null() || queries == 0 {
                return None;
            }
            // SAFETY: the queries were written by the submission that has just finished.
            unsafe {
                inner
                    .device
                    .get_query_pool_results(pool, 0, &mut values, vk::QueryResultFlags::TYPE_64)
            }
            .ok()?;
            Some(values)
        };
        let timestamps = read(resources.timestamps, 2 * count);
        let invocations = if self.statistics {
            read(resources.statistics, count)
        } else {
            None
        };
        let period = f64::from(inner.caps.timestamp_period);
        let passes = std::mem::take(&mut self.passes);
        let passes = passes.into_iter().enumerate().map(|(index, name)| PassTiming {
            name,
            nanoseconds: timestamps
                .as_ref()
                .map(|ticks| (ticks[2 * index + 1].saturating_sub(ticks[2 * index]) as f64 * period) as u64),
            invocations: invocations.as_ref().map(|counts| counts[index]),
        });
        let timings = Timings {
            passes: passes.collect(),
        };
        self.kept.clear();
        match resources.reset(inner) {
            Ok(()) => inner
                .recycled
                .lock()
                .unwrap_or_else(PoisonError::into_inner)
                .push(resources),
            // SAFETY: the device has finished with all of it.
            Err(_) => unsafe { resources.destroy(&inner.device) },
        }
        Ok(timings)
    }
}

impl Drop for Submission {
    fn drop(&mut self) {
        let Some(resources) = self.resources.take() else { return };
        while matches!(self.wait_slice(WAIT_SLICE), Ok(false)) {}
        // SAFETY: the device has finished, or is lost and will never touch anything again.
        unsafe { resources.destroy(&self.gpu.inner.device) };
    }
}
