//! How many bounces one submission holds: drivers end what runs for some seconds, and lose the device with it.

use crate::gpu::DeviceKind;

/// Device time that a submission may take where a driver watches.
const SUBMISSION_SECONDS: f64 = 0.25;

/// The pace of a walker, by what its submissions took.
#[derive(Debug)]
pub(super) struct Pace {
    kind: DeviceKind,
    /// Bounces of a submission, at most.
    most: usize,
    /// Device time of a ray with all that follows from it, in the last submission.
    seconds_a_ray: Option<f64>,
    /// Device time of submissions whose rays are not counted yet.
    uncounted_seconds: f64,
}

impl Pace {
    pub fn new(kind: DeviceKind, most: usize) -> Self {
        Self {
            kind,
            most: most.max(1),
            seconds_a_ray: None,
            uncounted_seconds: 0.0,
        }
    }

    /// A wave begins.
    pub fn begin(&mut self) {
        self.uncounted_seconds = 0.0;
    }

    /// Bounces of the next submission: as many as a watchdog has time for if no walk ends.
    pub fn bounces(&self, walks: u32) -> usize {
        // Software drivers end nothing, and there the passes are the same on every run.
        if self.kind == DeviceKind::Cpu {
            return self.most;
        }
        let Some(seconds_a_ray) = self.seconds_a_ray else {
            return 1;
        };
        let bounces = SUBMISSION_SECONDS / (seconds_a_ray * f64::from(walks.max(1)));
        (bounces as usize).clamp(1, self.most)
    }

    /// A submission took so long and followed so many rays to their ends; a stalled one counts its rays when they have gone on.
    pub fn submitted(&mut self, seconds: f64, rays: u64) {
        self.uncounted_seconds += seconds;
        if rays > 0 {
            self.seconds_a_ray = Some(std::mem::take(&mut self.uncounted_seconds) / rays as f64);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn submissions_on_watched_devices_begin_with_one_bounce_and_follow_the_measured_time() {
        let mut pace = Pace::new(DeviceKind::Discrete, 12);
        assert_eq!(pace.bounces(1 << 20), 1);
        // A millisecond for a thousand rays: a microsecond a ray.
        pace.submitted(1e-3, 1000);
        assert_eq!(pace.bounces(50_000), 5);
        assert_eq!(pace.bounces(1), 12);
        assert_eq!(pace.bounces(10_000_000), 1);
        // Stalled twice, then on to the end: all of its time is that of its rays.
        pace.submitted(0.5, 0);
        pace.submitted(0.5, 0);
        assert_eq!(pace.bounces(50_000), 5);
        pace.submitted(1.0, 1_000_000);
        assert_eq!(pace.bounces(50_000), 2);
        pace.submitted(7.0, 0);
        pace.begin();
        pace.submitted(1e-3, 1000);
        assert_eq!(pace.bounces(50_000), 5);
    }

    #[test]
    fn software_drivers_get_the_same_submissions_whatever_they_took() {
        let mut pace = Pace::new(DeviceKind::Cpu, 8);
        assert_eq!(pace.bounces(1), 8);
        pace.submitted(100.0, 1);
        assert_eq!(pace.bounces(1 << 20), 8);
        assert_eq!(Pace::new(DeviceKind::Cpu, 0).bounces(1), 1);
    }
}
