//! How many places a submission makes connections for: those that have stopped, with which an arrival stage goes on, or vertices that are shown to the camera.

use std::cell::Cell;

use crate::gpu::{DeviceKind, Pace};

/// Connections of such a submission on software devices: a second or less on two cores.
pub(crate) const SOFTWARE_CONNECTIONS: u32 = 1 << 19;
/// Places that it has at least, and the first one on devices that a driver watches: 2¹⁸ connections at most, 64 a place.
const PLACES_AT_ONCE: u32 = 1 << 12;
/// Connections that one through a grid counts as on software devices, with its place's share of the walk that finds the collision again.
const GRID_CONNECTIONS: u32 = 8;

/// As many as a driver that watches has time for, by what the last one took.
pub(crate) struct ConnectionPace {
    /// In units of [`PLACES_AT_ONCE`].
    pace: Pace,
    /// Units on software devices.
    unwatched: u32,
    /// Places of the submission that was recorded last, until its time is known.
    recorded: Cell<u32>,
}

impl ConnectionPace {
    /// For places that make so many connections in a dispatch, in a scene with or without grids.
    pub fn new(kind: DeviceKind, connections_at_once: u32, has_grids: bool) -> Self {
        let connections = SOFTWARE_CONNECTIONS / if has_grids { GRID_CONNECTIONS } else { 1 };
        Self {
            pace: Pace::new(kind, u32::MAX / PLACES_AT_ONCE),
            unwatched: connections / (connections_at_once * PLACES_AT_ONCE),
            recorded: Cell::new(0),
        }
    }

    /// Of the next submission, in whole workgroups.
    pub fn places(&self) -> u32 {
        self.pace.units(PLACES_AT_ONCE, self.unwatched) * PLACES_AT_ONCE
    }

    /// A submission with so many of them has been recorded.
    pub fn record(&self, places: u32) {
        self.recorded.set(places);
    }

    /// A submission took so long, whether it had such places or not.
    pub fn submitted(&mut self, seconds: f64) {
        let places = self.recorded.take();
        if places > 0 {
            self.pace.submitted(seconds, u64::from(places));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn places_of_a_submission_are_as_many_as_a_driver_has_time_for() {
        let mut pace = ConnectionPace::new(DeviceKind::Discrete, 64, false);
        assert_eq!(pace.places(), PLACES_AT_ONCE);
        // A submission of other stages says nothing of the pace of this one.
        pace.submitted(1.0);
        assert_eq!(pace.places(), PLACES_AT_ONCE);
        let mut after = |places, seconds| {
            pace.record(places);
            pace.submitted(seconds);
            pace.places()
        };
        // A quarter of a second each.
        assert_eq!(after(PLACES_AT_ONCE, 1e-3), 250 * PLACES_AT_ONCE);
        assert_eq!(after(250 * PLACES_AT_ONCE, 1.0), 62 * PLACES_AT_ONCE);
        // Seconds for the least there is: no less is to be had.
        assert_eq!(after(PLACES_AT_ONCE, 3.0), PLACES_AT_ONCE);
        let software = |has_grids| {
            [64, 16, 1].map(|connections| ConnectionPace::new(DeviceKind::Cpu, connections, has_grids).places())
        };
        assert_eq!(software(false), [1 << 13, 1 << 15, 1 << 19]);
        // Less than the least there is, for 64 connections.
        assert_eq!(software(true), [1 << 12, 1 << 12, 1 << 16]);
    }
}
