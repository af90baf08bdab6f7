//! Phase functions: how a medium scatters about the direction of propagation.
//!
//! c is the cosine between the directions of propagation before and after (forward scattering: g, k > 0). Sources: Henyey and
//! Greenstein (1941); Rayleigh (1871); Blasi, Le Saëc and Schlick, "A Rendering Algorithm for Discrete Volume Density Objects" (1993). Guarantees:
//! densities per solid angle that integrate to one and are sampled exactly, so that weights are one. Twin of
//! `transport/phase.glsl`.

use super::warp::{UNIFORM_SPHERE_PDF, direction_below_pole, orthonormal_basis};
use crate::catalogue::{Bias, Role, Row, sources};
use crate::scene::Phase;
use glam::DVec3;

/// Henyey and Greenstein's density, sr⁻¹, of `a` = |g|, where the cosine is `x` = 1 − c below that of the peak.
pub fn henyey_greenstein_below_peak(x: f64, a: f64) -> f64 {
    // 1 + g² − 2gc without its cancellation.
    let d = (1.0 - a) * (1.0 - a) + 2.0 * a * x;
    UNIFORM_SPHERE_PDF * (1.0 - a) * (1.0 + a) / (d * d.sqrt())
}

/// Henyey and Greenstein's density, sr⁻¹; `g` in (−1, 1) is its mean cosine.
pub fn henyey_greenstein(c: f64, g: f64) -> f64 {
    henyey_greenstein_below_peak((1.0 - if g < 0.0 { -c } else { c }).max(0.0), g.abs())
}

/// A cosine with density 2π [`henyey_greenstein`].
pub fn henyey_greenstein_sample(g: f64, u: f64) -> f64 {
    // The inversion as a distance from the peak, which neither cancels there nor divides by g.
    let a = g.abs();
    let s = 1.0 - a + 2.0 * a * u;
    let x = (1.0 - a) * (1.0 - u) * ((1.0 - a) * (1.0 + a) / s + 1.0 - a) / s;
    let c = (1.0 - x).clamp(-1.0, 1.0);
    if g < 0.0 { -c } else { c }
}

/// Schlick's density, sr⁻¹, of `a` = |k|, where the cosine is `x` = 1 − c below that of the peak.
pub fn schlick_below_peak(x: f64, a: f64) -> f64 {
    let d = 1.0 - a + a * x;
    UNIFORM_SPHERE_PDF * (1.0 - a) * (1.0 + a) / (d * d)
}

/// Schlick's density, sr⁻¹; `k` in (−1, 1).
pub fn schlick_phase(c: f64, k: f64) -> f64 {
    schlick_below_peak((1.0 - if k < 0.0 { -c } else { c }).max(0.0), k.abs())
}

/// A cosine with density 2π [`schlick_phase`].
pub fn schlick_phase_sample(k: f64, u: f64) -> f64 {
    let x = 2.0 * u - 1.0;
    ((x + k) / (1.0 + k * x)).clamp(-1.0, 1.0)
}

/// Mean cosine of [`schlick_phase`].
pub fn schlick_phase_mean_cosine(k: f64) -> f64 {
    if k.abs() < 1e-2 {
        // The first terms of its series 2k/3 + 2k³/15 + …, where the closed form cancels.
        return k * (2.0 / 3.0 + k * k * (2.0 / 15.0));
    }
    let k2 = k * k;
    (1.0 - k2) / (2.0 * k2) * (2.0 * k / (1.0 - k2) + ((1.0 - k) / (1.0 + k)).ln())
}

/// Rayleigh's density, sr⁻¹: scattering by particles far smaller than the wavelength.
pub fn rayleigh_phase(c: f64) -> f64 {
    0.75 * UNIFORM_SPHERE_PDF * (1.0 + c * c)
}

/// A cosine with density 2π [`rayleigh_phase`].
pub fn rayleigh_phase_sample(u: f64) -> f64 {
    // The real root of c³ + 3c = 2q.
    let q = 4.0 * u - 2.0;
    let z = (q.abs() + (q * q + 1.0).sqrt()).cbrt();
    ((z - 1.0 / z) * q.signum()).clamp(-1.0, 1.0)
}

/// The density of a medium's phase function, sr⁻¹, from propagation direction `w` to `wi`.
pub fn phase_function(phase: Phase, w: DVec3, wi: DVec3) -> f64 {
    // Half the square of the chord to the peak is 1 − c without its cancellation.
    let below = |backward: bool| 0.5 * if backward { wi + w } else { wi - w }.length_squared();
    match phase {
        Phase::Isotropic => UNIFORM_SPHERE_PDF,
        Phase::HenyeyGreenstein { g } => henyey_greenstein_below_peak(below(g < 0.0), f64::from(g.abs())),
        Phase::Schlick { k } => schlick_below_peak(below(k < 0.0), f64::from(k.abs())),
        Phase::Rayleigh => rayleigh_phase(1.0 - below(false)),
    }
}

/// A cosine with density 2π [`phase_function`].
pub fn phase_function_sample(phase: Phase, u: f64) -> f64 {
    match phase {
        Phase::Isotropic => 1.0 - 2.0 * u,
        Phase::HenyeyGreenstein { g } => henyey_greenstein_sample(f64::from(g), u),
        Phase::Schlick { k } => schlick_phase_sample(f64::from(k), u),
        Phase::Rayleigh => rayleigh_phase_sample(u),
    }
}

/// The direction after scattering of propagation direction `w`, at cosine `c` and azimuth 2πu.
pub fn phase_direction(w: DVec3, c: f64, u: f64) -> DVec3 {
    let local = direction_below_pole(1.0 - c, u);
    let (t, b) = orthonormal_basis(w);
    t * local.x + b * local.y + w * local.z
}

/// Rows of the catalogue.
pub(crate) const ROWS: &[Row] = &[Row {
    id: "PM-F-3",
    name: "phase functions of Henyey and Greenstein, Schlick and Rayleigh",
    role: Role::PartOf("BG-3"),
    limits: "Rotationally symmetric and without polarization; no measured tables.",
    sources: &[sources::HENYEY_GREENSTEIN_1941.whole(), sources::BLASI_1993.whole()],
    shaders: &["shaders/transport/phase.glsl"],
    bias: Some(Bias::Unbiased),
    tests: &[
        "engine/src/transport/phase.rs::normalised_with_their_mean_cosines",
        "engine/src/transport/phase.rs::samples_follow_their_density",
        "tests/tests/twins/lights.rs::phase_functions_agree_with_their_twins",
        "tests/tests/twins/lights.rs::phase_functions_near_their_peaks_agree_with_their_twins",
    ],
    api: &["clerestory::transport::phase"],
    ..Row::of(file!())
}];

#[cfg(test)]
mod tests {
    use super::super::testing::{chi_square_test, random3};
    use super::*;
    use std::f64::consts::TAU;

    /// 2π∫ f(c) dc by the midpoint rule with 10⁵ points.
    fn over_sphere(f: impl Fn(f64) -> f64) -> f64 {
        let n = 100_000;
        (0..n)
            .map(|i| f(-1.0 + (2.0 * f64::from(i) + 1.0) / f64::from(n)))
            .sum::<f64>()
            * TAU
            * 2.0
            / f64::from(n)
    }

    #[test]
    fn normalised_with_their_mean_cosines() {
        for x in [-0.9, -0.5, 0.0, 1e-4, 5e-4, 9.9e-4, 0.5, 0.9] {
            assert!((over_sphere(|c| henyey_greenstein(c, x)) - 1.0).abs() < 1e-5, "g = {x}");
            assert!(
                (over_sphere(|c| c * henyey_greenstein(c, x)) - x).abs() < 1e-5,
                "g = {x}"
            );
            assert!((over_sphere(|c| schlick_phase(c, x)) - 1.0).abs() < 1e-5, "k = {x}");
            let mean = over_sphere(|c| c * schlick_phase(c, x));
            assert!((mean - schlick_phase_mean_cosine(x)).abs() < 1e-5, "k = {x}");
        }
        assert!((schlick_phase_mean_cosine(0.5) - 0.352_08).abs() < 1e-5);
        assert!((schlick_phase_mean_cosine(0.9) - 0.765_78).abs() < 1e-5);
        assert!(
            (schlick_phase_mean_cosine(0.0101) - schlick_phase_mean_cosine(0.0099) - 0.0002 * 2.0 / 3.0).abs() < 1e-7
        );
    }

    /// The mean cosine is g however small; the midpoint rule of 1000 points is wrong by 5e-7 of it.
    #[test]
    fn small_parameters_are_sampled_exactly() {
        for g in [-9.9e-4, 1e-7, 5e-4, 9.9e-4] {
            let n = 1000;
            let at = |i: u32| (f64::from(i) + 0.5) / f64::from(n);
            let mean = (0..n).map(|i| henyey_greenstein_sample(g, at(i))).sum::<f64>() / f64::from(n);
            assert!((mean - g).abs() < 1e-6 * g.abs(), "{g}: {mean}");
        }
    }

    /// Chi-square of the cosines (p = 1e-5) and the mean of 10⁵ of them within 4 standard errors (6e-5), 15 tests each.
    #[test]
    fn samples_follow_their_density() {
        type Functions = (fn(f64, f64) -> f64, fn(f64, f64) -> f64, fn(f64) -> f64);
        let phases: [Functions; 3] = [
            (henyey_greenstein, henyey_greenstein_sample, |g| g),
            (schlick_phase, schlick_phase_sample, schlick_phase_mean_cosine),
            (|c, _| rayleigh_phase(c), |_, u| rayleigh_phase_sample(u), |_| 0.0),
        ];
        let (n, cells, fine) = (100_000u32, 40usize, 200);
        for (density, sample, mean) in phases {
            for (seed, x) in [(1, -0.9), (2, -0.3), (3, 0.0), (4, 0.5), (5, 0.95)] {
                let (mut observed, mut sum, mut squares) = (vec![0.0; cells], 0.0, 0.0);
                for i in 0..n {
                    let c = sample(x, random3(i, seed).x);
                    observed[(((c + 1.0) * 0.5 * cells as f64) as usize).min(cells - 1)] += 1.0;
                    sum += c;
                    squares += c * c;
                }
                let width = 2.0 / (cells * fine) as f64;
                let expected: Vec<f64> = (0..cells)
                    .map(|cell| {
                        (0..fine)
                            .map(|k| density(-1.0 + ((cell * fine + k) as f64 + 0.5) * width, x))
                            .sum::<f64>()
                            * TAU
                            * width
                            * f64::from(n)
                    })
                    .collect();
                let p = chi_square_test(&observed, &expected);
                assert!(p > 1e-5, "{x}: {p}");
                let (m, n) = (sum / f64::from(n), f64::from(n));
                let error = ((squares / n - m * m) / n).sqrt();
                assert!((m - mean(x)).abs() < 4.0 * error, "{x}: {m}");
            }
        }
        for i in 0..100 {
            let u = random3(i, 6);
            let w = direction_below_pole(2.0 * u.x, u.y);
            let scattered = phase_direction(w, 2.0 * u.z - 1.0, u.y);
            assert!((scattered.dot(w) - (2.0 * u.z - 1.0)).abs() < 1e-12 && (scattered.length() - 1.0).abs() < 1e-12);
        }
    }
}
