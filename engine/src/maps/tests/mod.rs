//! The maps against their definitions, closed forms and the tables of the source; where a printed form is wrong, that it fails.

mod box_lobes;
mod conversions;
mod density;
mod glossy;
mod irradiance;
mod levels;
mod places;
mod printed;
mod seams;
mod solid_angles;

use crate::test_random::Random;
use glam::DVec3;

/// Uniform directions, and before them all those of components −1, −0, 0 and 1.
fn directions(seed: u64, count: usize) -> Vec<DVec3> {
    let sides = [-1.0, -0.0, 0.0, 1.0];
    let mut all = Vec::new();
    for x in sides {
        for y in sides {
            all.extend(
                sides
                    .map(|z| DVec3::new(x, y, z))
                    .into_iter()
                    .filter_map(DVec3::try_normalize),
            );
        }
    }
    let mut random = Random(seed);
    all.extend((0..count).map(|_| random.direction().as_dvec3().normalize()));
    all
}

/// The angle between unit vectors, rad, to full precision near 0.
fn angle(a: DVec3, b: DVec3) -> f64 {
    a.cross(b).length().atan2(a.dot(b))
}
