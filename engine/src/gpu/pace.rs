//! How much one submission holds: drivers end what runs for some seconds, and lose the device with it.

use super::caps::DeviceKind;

/// Device time that a submission may take where a driver watches.
const SUBMISSION_SECONDS: f64 = 0.25;

/// The pace of work in units of so many pieces, such as bounces of so many walks, by what the last submission of it took. A unit is never parted:
/// however long it takes, it is one submission at least.
#[derive(Debug, Clone)]
pub(crate) struct Pace {
    kind: DeviceKind,
    /// Units of a submission, at most.
    most: u32,
    /// Device time of a piece with all that follows from it, in the last submission.
    seconds_a_piece: Option<f64>,
    /// Device time of submissions whose pieces are not counted yet.
    uncounted_seconds: f64,
}

impl Pace {
    pub fn new(kind: DeviceKind, most: u32) -> Self {
        Self {
            kind,
            most: most.max(1),
            seconds_a_piece: None,
            uncounted_seconds: 0.0,
        }
    }

    /// Work begins anew: what has not been counted yet never will be.
    pub fn begin(&mut self) {
        self.uncounted_seconds = 0.0;
    }

    /// Units of the next submission, each of so many pieces: one where nothing is known yet, then as many as a watchdog has time for, if none has
    /// fewer pieces. Software drivers end nothing, and get `unwatched`, so that the submissions are the same on every run.
    pub fn units(&self, pieces: u32, unwatched: u32) -> u32 {
        if self.kind == DeviceKind::Cpu {
            return unwatched.clamp(1, self.most);
        }
        let Some(seconds_a_piece) = self.seconds_a_piece else {
            return 1;
        };
        let units = SUBMISSION_SECONDS / (seconds_a_piece * f64::from(pieces.max(1)));
        (units as u32).clamp(1, self.most)
    }

    /// A submission took so long and finished so many pieces; one that finished none counts with the next that does.
    pub fn submitted(&mut self, seconds: f64, pieces: u64) {
        self.uncounted_seconds += seconds;
        if pieces > 0 {
            let seconds = std::mem::take(&mut self.uncounted_seconds);
            // A clock that has not moved says nothing.
            self.seconds_a_piece = (seconds > 0.0).then(|| seconds / pieces as f64);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn submissions_on_watched_devices_begin_with_one_unit_and_follow_the_measured_time() {
        let mut pace = Pace::new(DeviceKind::Discrete, 12);
        assert_eq!(pace.units(1 << 20, 12), 1);
        // A millisecond for a thousand pieces: a microsecond each.
        pace.submitted(1e-3, 1000);
        assert_eq!(pace.units(50_000, 12), 5);
        assert_eq!(pace.units(1, 12), 12);
        assert_eq!(pace.units(10_000_000, 12), 1);
        // Stalled twice, then on to the end: all of its time is that of its pieces.
        pace.submitted(0.5, 0);
        pace.submitted(0.5, 0);
        assert_eq!(pace.units(50_000, 12), 5);
        pace.submitted(1.0, 1_000_000);
        assert_eq!(pace.units(50_000, 12), 2);
        pace.submitted(7.0, 0);
        pace.begin();
        pace.submitted(1e-3, 1000);
        assert_eq!(pace.units(50_000, 12), 5);
        pace.submitted(0.0, 1000);
        assert_eq!(pace.units(1, 12), 1);
    }

    #[test]
    fn software_drivers_get_the_same_submissions_whatever_they_took() {
        let mut pace = Pace::new(DeviceKind::Cpu, 8);
        assert_eq!(pace.units(1, 8), 8);
        pace.submitted(100.0, 1);
        assert_eq!(pace.units(1 << 20, 8), 8);
        assert_eq!(pace.units(1, 3), 3);
        assert_eq!(Pace::new(DeviceKind::Cpu, 0).units(1, 0), 1);
    }
}
