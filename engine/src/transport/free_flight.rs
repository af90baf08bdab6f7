//! Free flight and transmittance along one ray whose extinction changes on the way: ray marching, which is biased, beside delta and ratio
//! tracking, which are not. The path tracer tracks; marching is the baseline that it is measured against.
//!
//! Sources: Jensen and Christensen, "Efficient Simulation of Light Transport in Scenes with Participating Media Using Photon Maps" (1998),
//! for marching; Woodcock et al., "Techniques Used in the GEM Code for Monte Carlo Neutronics Calculations" (1965) and Coleman (1968) for
//! delta tracking; Novák, Selle and Jarosz, "Residual Ratio Tracking for Estimating Attenuation in Participating Media" (2014).
//! Guarantees: with finite, positive steps and a finite `majorant · t_max`, every function ends after a number of look-ups that its arguments
//! bound, or bound on average. Distances in metres; extinction coefficients in m⁻¹, finite and not negative, by the distance along the ray.
//! The path tracer's own tracking is in `transport/media_tracking.glsl`, by [`sample_null_collision`](super::medium::sample_null_collision).

use crate::catalogue::{Bias, Role, Row, sources};

/// exp(−Σ Δt σ(tᵢ)) over `steps` equal steps up to `t_max`, each looked up at `place` of its length: 1 at its end, ½ in its middle.
///
/// Of an extinction that is smooth the error falls with 1/steps, for ½ with 1/steps². A uniformly random `place` makes the optical depth
/// unbiased, not its exponential. No steps count as one.
pub fn marched_transmittance(extinction: impl Fn(f64) -> f64, t_max: f64, steps: u32, place: f64) -> f64 {
    let steps = steps.max(1);
    let step = t_max / f64::from(steps);
    let depth: f64 = (0..steps)
        .map(|i| extinction((f64::from(i) + place) * step) * step)
        .sum();
    (-depth).exp()
}

/// Ratio tracking: an unbiased estimate of the transmittance up to `t_max`, by about `majorant · t_max` look-ups. `majorant` must bound the
/// extinction; `random` draws from [0, 1).
pub fn ratio_tracked_transmittance(
    extinction: impl Fn(f64) -> f64,
    majorant: f64,
    t_max: f64,
    mut random: impl FnMut() -> f64,
) -> f64 {
    let (mut t, mut weight) = (0.0, 1.0);
    while weight > 0.0 {
        t += tracking_step(majorant, random());
        if t >= t_max {
            return weight;
        }
        weight *= 1.0 - extinction(t) / majorant;
    }
    0.0
}

/// Delta tracking: the distance of a collision before `t_max`, by about `majorant` look-ups per metre. Unbiased, however loose the majorant.
pub fn tracked_free_flight(
    extinction: impl Fn(f64) -> f64,
    majorant: f64,
    t_max: f64,
    mut random: impl FnMut() -> f64,
) -> Option<f64> {
    let mut t = 0.0;
    loop {
        t += tracking_step(majorant, random());
        if t >= t_max {
            return None;
        }
        if random() * majorant < extinction(t) {
            return Some(t);
        }
    }
}

/// Ray marching: a collision in each step of length `step` with the probability 1 − exp(−step · σ), σ looked up at the step's end, which is
/// also the distance it is reported at. Biased: the error falls with the step.
pub fn marched_free_flight(
    extinction: impl Fn(f64) -> f64,
    t_max: f64,
    step: f64,
    mut random: impl FnMut() -> f64,
) -> Option<f64> {
    let steps = (t_max / step).ceil() as u64;
    for i in 0..steps {
        let (begin, end) = (i as f64 * step, ((i + 1) as f64 * step).min(t_max));
        if exponential(random()) < (end - begin) * extinction(end) {
            return Some(end);
        }
    }
    None
}

/// Ray marching by steps of random length, `share` of the local mean free path on average and `longest` at most; collisions as in
/// [`marched_free_flight`]. Biased, and blind to what a step passes by: a thin layer behind thin medium is leapt over.
pub fn adaptively_marched_free_flight(
    extinction: impl Fn(f64) -> f64,
    t_max: f64,
    share: f64,
    longest: f64,
    mut random: impl FnMut() -> f64,
) -> Option<f64> {
    let mut t = 0.0;
    loop {
        let step = (share * exponential(random()) / extinction(t)).min(longest);
        let end = (t + step).min(t_max);
        if exponential(random()) < (end - t) * extinction(end) {
            return Some(end);
        }
        // In a medium so dense that its steps are lost in the distance so far, light ends where it is.
        if step > 0.0 && t + step == t {
            return Some(t);
        }
        if end >= t_max {
            return None;
        }
        t = end;
    }
}

/// The way to the next tentative collision, from `u` in [0, 1); endless where there is nothing to collide with.
fn tracking_step(majorant: f64, u: f64) -> f64 {
    if majorant > 0.0 {
        exponential(u) / majorant
    } else {
        f64::INFINITY
    }
}

/// Exponentially distributed with mean 1, from `u` in [0, 1).
fn exponential(u: f64) -> f64 {
    -(1.0 - u).ln()
}

/// Rows of the catalogue.
pub(crate) const ROWS: &[Row] = &[Row {
    id: "PM-VOL-3",
    name: "free flight by ray marching, steps fixed or adaptive (baseline)",
    role: Role::Yardstick,
    limits: "Wrong by its step, and never in a picture.",
    sources: &[sources::JENSEN_CHRISTENSEN_1998.whole()],
    bias: Some(Bias::Consistent("the step")),
    tests: &["engine/src/transport/free_flight.rs::marched_flights_are_biased_by_their_step"],
    api: &[
        "clerestory::transport::free_flight::marched_free_flight",
        "clerestory::transport::free_flight::adaptively_marched_free_flight",
    ],
    ..Row::of(file!())
}];

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_random::Random;

    const SIGMA: f64 = 4.0;
    /// |z| that chance exceeds once in a million.
    const Z_MAX: f64 = 4.9;

    fn linear(t: f64) -> f64 {
        SIGMA * t
    }

    /// Greatest distance between the distribution of `flights` up to 1 and that of the linear extinction, times √n.
    fn kolmogorov_smirnov(count: u64, mut flight: impl FnMut(&mut dyn FnMut() -> f64) -> Option<f64>) -> f64 {
        let mut random = Random(count);
        let mut draw = || f64::from(random.unit());
        let mut ends: Vec<f64> = (0..count).filter_map(|_| flight(&mut draw)).collect();
        ends.sort_by(f64::total_cmp);
        let n = count as f64;
        let cumulative = |t: f64| 1.0 - (-0.5 * SIGMA * t * t).exp();
        let distance = |(i, t): (usize, &f64)| {
            let f = cumulative(*t);
            ((i + 1) as f64 / n - f).abs().max((i as f64 / n - f).abs())
        };
        let inside = ends.iter().enumerate().map(distance).fold(0.0, f64::max);
        inside.max((ends.len() as f64 / n - cumulative(1.0)).abs()) * n.sqrt()
    }

    #[test]
    fn marched_transmittance_errs_by_the_step_and_in_the_middle_by_its_square() {
        let exact = (-0.5 * SIGMA).exp();
        let error = |steps, place| (marched_transmittance(linear, 1.0, steps, place) / exact - 1.0).abs();
        let ratio = error(512, 1.0) / error(1024, 1.0);
        assert!((1.98..2.02).contains(&ratio), "{ratio}");
        // The midpoint rule is exact for what is linear.
        assert!(error(64, 0.5) < 1e-13);
        let curved = |t: f64| SIGMA * t * t;
        let exact = (-SIGMA / 3.0).exp();
        let error = |steps| (marched_transmittance(curved, 1.0, steps, 0.5) / exact - 1.0).abs();
        let ratio = error(256) / error(512);
        assert!((3.96..4.04).contains(&ratio), "{ratio}");
    }

    #[test]
    fn ratio_tracking_is_unbiased_however_loose_the_majorant() {
        for looseness in [1.0, 1.7, 10.0] {
            let mut random = Random(7);
            let n = 40_000;
            let values: Vec<f64> = (0..n)
                .map(|_| ratio_tracked_transmittance(linear, SIGMA * looseness, 1.0, || f64::from(random.unit())))
                .collect();
            let mean = values.iter().sum::<f64>() / f64::from(n);
            let variance = values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / f64::from(n - 1);
            let z = (mean - (-0.5 * SIGMA).exp()) / (variance / f64::from(n)).sqrt();
            assert!(z.abs() < Z_MAX, "{looseness}: {z}");
        }
        let nothing = ratio_tracked_transmittance(|_| 0.0, 0.0, 1e30, || 0.5);
        assert_eq!(nothing, 1.0);
    }

    /// The limit of √n times the distance exceeds 2.69 once in a million.
    #[test]
    fn tracked_flights_follow_their_distribution_however_loose_the_majorant() {
        for looseness in [1.0, 1.7, 10.0] {
            let distance = kolmogorov_smirnov(100_000, |random| {
                tracked_free_flight(linear, SIGMA * looseness, 1.0, random)
            });
            assert!(distance < 2.69, "{looseness}: {distance}");
        }
        assert_eq!(tracked_free_flight(|_| 0.0, 0.0, f64::INFINITY, || 0.5), None);
        // The greatest number drawn stays finite.
        assert!(tracked_free_flight(|_| 1.0, 1.0, 100.0, || 1.0 - f64::EPSILON / 2.0).is_some_and(f64::is_finite));
    }

    #[test]
    fn marched_flights_are_biased_by_their_step() {
        let n = 100_000;
        let fixed = |step| kolmogorov_smirnov(n, |random| marched_free_flight(linear, 1.0, step, random));
        let (coarse, fine) = (fixed(0.1), fixed(0.01));
        assert!(coarse > 20.0 && coarse > 5.0 * fine, "{coarse} {fine}");
        let adaptive = |share| {
            kolmogorov_smirnov(n, |random| {
                adaptively_marched_free_flight(linear, 1.0, share, share, random)
            })
        };
        let (coarse, fine) = (adaptive(0.5), adaptive(0.05));
        assert!(coarse > 20.0 && coarse > 5.0 * fine, "{coarse} {fine}");
        // A thin layer behind a gap: marching leaps over it, tracking does not.
        let layer = |t: f64| if (0.5..0.502).contains(&t) { 500.0 } else { 0.0 };
        let mut random = Random(3);
        let mut draw = || f64::from(random.unit());
        let hits = |flight: &mut dyn FnMut() -> Option<f64>| (0..10_000).filter(|_| flight().is_some()).count();
        let marched = hits(&mut || marched_free_flight(layer, 1.0, 0.03, &mut draw));
        let tracked = hits(&mut || tracked_free_flight(layer, 500.0, 1.0, &mut draw));
        assert_eq!(marched, 0);
        // Behind a medium there is only vacuum, in which nothing collides, however the last steps are rounded.
        let t_max = 1.7;
        let ends = |t: f64| if t < 0.3 * t_max { 1e-6 } else { 0.0 };
        let mut late =
            || adaptively_marched_free_flight(ends, t_max, 0.5, 5.0, &mut draw).is_some_and(|t| t > 0.3 * t_max);
        assert_eq!((0..10_000).filter(|_| late()).count(), 0);
        // 1 − 1/e of 10,000 is 6321 ± 48.
        assert!((6321 - 250..6321 + 250).contains(&tracked), "{tracked}");
    }
}
