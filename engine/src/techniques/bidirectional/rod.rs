//! Tests of weights in media by a rod of fog: what it lets through has a closed form, and all ways to make paths find it together.
//!
//! Light moves along the rod alone, towards the lamp at its far end or towards the eye at its near end, and leaves it at both. What arrives at the eye is the transmission of two-stream
//! theory (A. Schuster, "Radiation through a Foggy Atmosphere", The Astrophysical Journal 21, 1905). Subpaths of both ends have the flights and the weights of the kernels: densities of
//! phase functions and squared distances, and nothing of flights, though flights are what their collisions are sampled by.

use super::mis::{PartialWeights, mis_weight};
use crate::test_random::Random;
use crate::transport::medium::{sample_free_flight, transmittance};
use glam::DVec3;

/// Of the rod, m.
const LENGTH: f64 = 1.5;
/// Probability with which what is scattered goes on as before.
const ONWARDS: f64 = 0.7;
const SAMPLES: u32 = 100_000;
/// That a mean may be off by, for a fixed seed: three bands exceed it in one right estimate of 120.
const STANDARD_ERRORS: f64 = 3.0;

/// Bands that come differently far.
struct Rod {
    sigma_s: DVec3,
    sigma_t: DVec3,
}

/// Where a subpath has arrived.
struct Arrived {
    at: f64,
    /// 1 towards the lamp, -1 towards the eye.
    heading: f64,
    throughput: DVec3,
    weights: PartialWeights,
}

/// Density with which what comes with one heading is scattered into another one; the same both ways.
fn scattering(heading: f64, on: f64) -> f64 {
    if heading * on > 0.0 { ONWARDS } else { 1.0 - ONWARDS }
}

impl Rod {
    /// A subpath: its collisions, and where it has left the rod.
    fn walk(
        &self,
        random: &mut Random,
        mut at: f64,
        mut heading: f64,
        mut weights: PartialWeights,
    ) -> (Vec<Arrived>, Arrived) {
        let mut collisions = Vec::new();
        let (mut throughput, mut bands) = (DVec3::ONE, DVec3::splat(1.0 / 3.0));
        loop {
            let way = if heading > 0.0 { LENGTH - at } else { at };
            let u = [0, 1].map(|_| f64::from(random.unit()));
            let flight = sample_free_flight(self.sigma_s, self.sigma_t, bands, way, u);
            throughput *= flight.weight;
            bands = flight.bands;
            at += heading * flight.t;
            weights = weights.mis_arrive(flight.t * flight.t, 1.0);
            let arrived = Arrived {
                at,
                heading,
                throughput,
                weights,
            };
            if !flight.collides {
                return (collisions, arrived);
            }
            collisions.push(arrived);
            let on = if f64::from(random.unit()) < ONWARDS {
                heading
            } else {
                -heading
            };
            let density = scattering(heading, on);
            weights = weights.mis_scatter(1.0, density, density);
            heading = on;
        }
    }

    /// What an eye subpath and a light subpath find of a lamp of radiance 1, in every way.
    fn estimate(&self, random: &mut Random) -> DVec3 {
        let from_eye = PartialWeights { d_vcm: 1.0, d_vc: 0.0 };
        // The lamp is sampled and shines with certainty, and is met as well.
        let from_lamp = PartialWeights { d_vcm: 1.0, d_vc: 1.0 };
        let (eye, end) = self.walk(random, 0.0, 1.0, from_eye);
        let (light, _) = self.walk(random, LENGTH, -1.0, from_lamp);
        let mut found = DVec3::ZERO;
        if end.heading > 0.0 {
            // The lamp is met; what the eye sees of it itself is found in no other way.
            let weight = if eye.is_empty() {
                1.0
            } else {
                mis_weight(0.0, end.weights.d_vcm + end.weights.d_vc)
            };
            found += weight * end.throughput;
        }
        for here in &eye {
            let way = LENGTH - here.at;
            let to_lamp = scattering(here.heading, 1.0);
            let density = way * way;
            let weight = mis_weight(to_lamp / density, here.weights.mis_behind(to_lamp) / density);
            found += weight * to_lamp * here.throughput * transmittance(self.sigma_t, way);
            for there in &light {
                let way = there.at - here.at;
                let squared = way * way;
                let on = scattering(here.heading, way.signum());
                let back = scattering(there.heading, -way.signum());
                let weight = mis_weight(
                    on / squared * there.weights.mis_behind(back),
                    back / squared * here.weights.mis_behind(on),
                );
                let passed = transmittance(self.sigma_t, way.abs());
                found += weight * on * back * here.throughput * there.throughput * passed;
            }
        }
        for there in &light {
            let to_eye = scattering(there.heading, -1.0);
            let shown = 1.0 / (there.at * there.at);
            let weight = mis_weight(shown * there.weights.mis_behind(to_eye), 0.0);
            found += weight * to_eye * there.throughput * transmittance(self.sigma_t, there.at);
        }
        found
    }

    /// The closed form.
    fn transmission(&self) -> DVec3 {
        let absorbed = self.sigma_t - self.sigma_s;
        let reflected = self.sigma_s * (1.0 - ONWARDS);
        let of_band = |k: f64, s: f64| {
            let rate = (k * (k + 2.0 * s)).sqrt();
            rate / (rate * (rate * LENGTH).cosh() + (k + s) * (rate * LENGTH).sinh())
        };
        DVec3::new(
            of_band(absorbed.x, reflected.x),
            of_band(absorbed.y, reflected.y),
            of_band(absorbed.z, reflected.z),
        )
    }
}

/// Without bias in every band, though no weight knows how probable a flight is: each way samples the flights of all edges but one, whose transmittance is its estimate.
#[test]
fn all_ways_to_make_paths_through_fog_find_what_it_lets_through() {
    let rod = Rod {
        sigma_s: DVec3::new(0.4, 0.8, 1.6),
        sigma_t: DVec3::new(0.7, 0.9, 1.65),
    };
    let mut random = Random(19);
    let (mut sum, mut squares) = (DVec3::ZERO, DVec3::ZERO);
    for _ in 0..SAMPLES {
        let found = rod.estimate(&mut random);
        sum += found;
        squares += found * found;
    }
    let n = f64::from(SAMPLES);
    let (mean, truth) = (sum / n, rod.transmission());
    let error = ((squares / n - mean * mean) / n).to_array().map(f64::sqrt);
    for (band, error) in error.into_iter().enumerate() {
        let (mean, truth) = (mean[band], truth[band]);
        assert!(error < 0.005 * truth, "band {band}: {mean} ± {error}");
        assert!(
            (mean - truth).abs() < STANDARD_ERRORS * error,
            "band {band}: {mean} ± {error} instead of {truth}"
        );
    }
}
