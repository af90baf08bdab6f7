//! Restarts of rays behind a leaf, without flags: how many rays lose their way.

use clerestory::accel::Ray;
use clerestory::accel::kd::KdTree;
use clerestory::accel::yardstick::{ShiftedRestart, leaves_by_stack};

use super::flights::{Case, Flight};
use crate::experiments::findings::rows;

/// Restarts behind a leaf, each of which fails.
const RESTARTS: [(&str, ShiftedRestart); 4] = [
    ("closed intervals", ShiftedRestart::Closed),
    ("open intervals", ShiftedRestart::Open),
    ("closed, 1e-5 m behind", ShiftedRestart::ClosedBehind(1e-5)),
    ("closed, 1e-8 m behind", ShiftedRestart::ClosedBehind(1e-8)),
];
/// Rays that are followed so, and leaves after which there is no end.
const RESTARTED_RAYS: usize = 2000;
const MOST_LEAVES: usize = 4096;

rows! {
    /// A form of restarts in a scene.
    struct Restart = "Restarts behind a leaf" by [scene, form] {
        scene: String = "scene",
        form: String = "form",
        rays: u64 = "rays",
        endless: u64 = "rays without an end",
        other: u64 = "rays with other leaves",
    }
}

/// Rays whose leaves have no end, and those whose leaves are not the stack's.
fn failures(tree: &KdTree, rays: &[&Ray], form: ShiftedRestart) -> [u64; 2] {
    let mut failures = [0; 2];
    for ray in rays {
        let found = form.leaves(tree, ray, MOST_LEAVES);
        if found.endless {
            failures[0] += 1;
        } else if found != leaves_by_stack(tree, ray) {
            failures[1] += 1;
        }
    }
    failures
}

/// Some of a flight's camera rays by every form.
pub fn restarts(case: &Case, tree: &KdTree, flight: &Flight) -> Vec<Restart> {
    let step = flight.camera.len().div_ceil(RESTARTED_RAYS).max(1);
    let some: Vec<&Ray> = flight.camera.iter().step_by(step).collect();
    let of = |(form, restart): (&str, ShiftedRestart)| {
        let [endless, other] = failures(tree, &some, restart);
        Restart {
            scene: case.name().into(),
            form: form.into(),
            rays: some.len() as u64,
            endless,
            other,
        }
    };
    RESTARTS.map(of).to_vec()
}
