//! Fresnel reflectance of unpolarized light at an interface.
//!
//! Sources: dielectric and conductor forms from Fresnel's equations (Born and Wolf, Principles of Optics, 1.5 and 14.2); Schlick,
//! "An Inexpensive BRDF Model for Physically-based Rendering" (1994). Guarantees: results lie in [0, 1]; total internal reflection
//! gives exactly 1; equal indices give exactly 0 off grazing. Twin of `transport/fresnel.glsl`.
//!
//! Cheaper forms of the conductor's factor stand in the modules below, each with its error beside the exact one; [`form`] chooses among them.

pub mod compensated;
pub mod curve;
pub mod extinction;
pub mod form;
#[cfg(test)]
mod published;
pub mod rescaled;
pub mod simplified;
pub mod table;
pub mod tinted;

use glam::DVec3;

use crate::catalogue::{Role, Row, sources};
use crate::gpu::shaders::constants;

/// Reflectance at normal incidence for a relative index of refraction.
pub fn fresnel_f0(eta: f64) -> f64 {
    let r = (eta - 1.0) / (eta + 1.0);
    r * r
}

/// Exact dielectric; `cos_i` ≥ 0 on the incident side, `eta` = index beyond ÷ index on the incident side.
pub fn fresnel_dielectric(cos_i: f64, eta: f64) -> f64 {
    let e = eta * eta - 1.0;
    let g2 = e + cos_i * cos_i;
    if g2 <= 0.0 {
        return 1.0;
    }
    let g = g2.sqrt();
    let sum = g + cos_i;
    let a = e / (sum * sum);
    let b = (cos_i * sum - 1.0) / (cos_i * (g - cos_i) + 1.0);
    (0.5 * a * a * (1.0 + b * b)).min(1.0)
}

/// What keeps the cases of 0/0 defined: no interface (η = 1, k = 0) at a cosine of 0, which reflects nothing, and an index too small for its square at a
/// cosine of 1.
const LEAST_SUM: f64 = constants::LEAST_SUM as f64;

/// Exact conductor against vacuum, per band; complex index `eta` + i `k`.
pub fn fresnel_conductor(cos_i: f64, eta: DVec3, k: DVec3) -> DVec3 {
    let c2 = cos_i * cos_i;
    let s2 = 1.0 - c2;
    let d = eta * eta - k * k - s2;
    let ek = eta * k;
    let a2b2 = (d * d + 4.0 * ek * ek).map(f64::sqrt);
    // (a2b2 + d)/2 without its cancellation at good metals, where d is negative: (a2b2 + d)(a2b2 − d) = 4 ek².
    let a2 = DVec3::select(d.cmpge(DVec3::ZERO), 0.5 * (a2b2 + d), 2.0 * ek * ek / (a2b2 - d));
    let a = a2.map(f64::sqrt);
    let sum = a2b2 + c2;
    let cross_s = 2.0 * cos_i * a;
    let rs = (sum - cross_s) / (sum + cross_s + LEAST_SUM);
    let sum_p = c2 * a2b2 + s2 * s2;
    let cross_p = cross_s * s2;
    let rp = rs * (sum_p - cross_p) / (sum_p + cross_p + LEAST_SUM);
    (0.5 * (rs + rp)).clamp(DVec3::ZERO, DVec3::ONE)
}

/// Cosine-weighted hemispherical average 2∫F(μ)μ dμ of the conductor's reflectance, by the midpoint rule.
///
/// A material constant of the multiple-scattering compensation; the error is below 1e-5.
pub fn fresnel_conductor_average(eta: DVec3, k: DVec3) -> DVec3 {
    average(|mu| fresnel_conductor(mu, eta, k))
}

/// 2∫F(μ)μ dμ by the midpoint rule.
fn average(factor: impl Fn(f64) -> DVec3) -> DVec3 {
    const STEPS: u32 = 256;
    (0..STEPS)
        .map(|i| {
            let mu = (f64::from(i) + 0.5) / f64::from(STEPS);
            factor(mu) * (2.0 * mu / f64::from(STEPS))
        })
        .sum()
}

/// (1 − cos θ)⁵
pub fn schlick_weight(cos_i: f64) -> f64 {
    (1.0 - cos_i).clamp(0.0, 1.0).powi(5)
}

/// Schlick's approximation with unit reflectance at grazing incidence.
pub fn fresnel_schlick(cos_i: f64, f0: DVec3) -> DVec3 {
    f0 + (DVec3::ONE - f0) * schlick_weight(cos_i)
}

/// Rows of the catalogue.
pub(crate) const ROWS: &[Row] = &[
    Row {
        id: "MET-F1",
        name: "exact unpolarised conductor Fresnel",
        role: Role::PartOf("BG-3"),
        limits: "Unpolarized light at a smooth interface, by three bands.",
        sources: &[sources::BORN_WOLF_1999.at("14.2")],
        shaders: &["shaders/transport/fresnel.glsl"],
        tests: &[
            "engine/src/transport/fresnel.rs::conductor_without_extinction_is_the_dielectric",
            "engine/src/transport/fresnel.rs::conductors_agree_with_the_complex_form",
            "engine/src/transport/fresnel.rs::conductors_are_finite_at_the_ends_of_their_range",
            "engine/src/transport/fresnel.rs::conductors_reflect_as_published",
            "engine/src/transport/fresnel.rs::conductors_are_numbers_in_half_precision",
            "engine/src/transport/fresnel.rs::curves_dip_where_published",
            "tests/tests/twins/fresnel_forms.rs::the_conductor_in_single_precision_is_the_complex_form",
            "tests/tests/twins/reflection.rs::fresnel_factors_agree_with_their_twins",
        ],
        experiment: "clerestory agreement --scene cornell-metals,ring-mirror",
        api: &["clerestory::transport::fresnel"],
        ..Row::of(file!())
    },
    Row {
        id: "CL-FRESNEL",
        name: "exact dielectric Fresnel",
        role: Role::PartOf("BG-3"),
        limits: "Unpolarized light at a smooth interface, with one index for all bands.",
        sources: &[sources::BORN_WOLF_1999.at("1.5")],
        shaders: &["shaders/transport/fresnel.glsl"],
        tests: &[
            "engine/src/transport/fresnel.rs::dielectric_equals_the_textbook_form_and_its_edges",
            "tests/tests/twins/reflection.rs::fresnel_factors_agree_with_their_twins",
        ],
        experiment: "clerestory agreement --scene cornell-glass",
        api: &["clerestory::transport::fresnel"],
        ..Row::of(file!())
    },
];

#[cfg(test)]
mod tests {
    use exr::prelude::f16;

    use super::super::testing::random3;
    use super::*;

    /// The textbook form with both angles, for comparison.
    fn two_angles(cos_i: f64, eta: f64) -> f64 {
        let cos_t = (1.0 - (1.0 - cos_i * cos_i) / (eta * eta)).sqrt();
        let s = (cos_i - eta * cos_t) / (cos_i + eta * cos_t);
        let p = (eta * cos_i - cos_t) / (eta * cos_i + cos_t);
        0.5 * (s * s + p * p)
    }

    #[test]
    fn dielectric_equals_the_textbook_form_and_its_edges() {
        for eta in [1.0001, 1.1, 1.5, 2.4, 10.0] {
            for i in 1..=1000 {
                let c = f64::from(i) / 1000.0;
                assert!(
                    (fresnel_dielectric(c, eta) - two_angles(c, eta)).abs() < 1e-12,
                    "{c} {eta}"
                );
                // Reversibility: the same reflectance from the other side, at the refracted angle.
                let c_t = (1.0 - (1.0 - c * c) / (eta * eta)).sqrt();
                assert!((fresnel_dielectric(c_t, 1.0 / eta) - fresnel_dielectric(c, eta)).abs() < 1e-9);
            }
            assert!((fresnel_dielectric(1.0, eta) - fresnel_f0(eta)).abs() < 1e-15);
            assert!((fresnel_dielectric(0.0, eta) - 1.0).abs() < 1e-12);
            let critical = (1.0 - 1.0 / (eta * eta)).sqrt();
            assert_eq!(
                fresnel_dielectric(critical * 0.999, 1.0 / eta),
                1.0,
                "total internal reflection"
            );
            assert!(fresnel_dielectric((critical * 1.01).min(1.0), 1.0 / eta) < 1.0);
        }
        assert_eq!(fresnel_dielectric(0.3, 1.0), 0.0);
        let brewster = (1.5f64).atan().cos();
        let s = two_angles(brewster, 1.5);
        assert!((fresnel_dielectric(brewster, 1.5) - s).abs() < 1e-14 && (s - 0.073_964_497).abs() < 1e-8);
    }

    #[test]
    fn conductor_without_extinction_is_the_dielectric() {
        for i in 1..=100 {
            let c = f64::from(i) / 100.0;
            let f = fresnel_conductor(c, DVec3::new(1.2, 1.5, 3.0), DVec3::ZERO);
            for (f, eta) in f.to_array().into_iter().zip([1.2, 1.5, 3.0]) {
                assert!((f - fresnel_dielectric(c, eta)).abs() < 1e-12);
            }
        }
        let (eta, k) = (DVec3::new(0.2, 1.0, 3.0), DVec3::new(3.9, 2.0, 0.5));
        let normal = ((eta - 1.0) * (eta - 1.0) + k * k) / ((eta + 1.0) * (eta + 1.0) + k * k);
        assert!((fresnel_conductor(1.0, eta, k) - normal).abs().max_element() < 1e-14);
        assert_eq!(fresnel_conductor(0.0, eta, k), DVec3::ONE);
    }

    /// The square root whose real part is at least 0, of a complex number.
    fn root([re, im]: [f64; 2]) -> [f64; 2] {
        let size = re.hypot(im);
        // The part that loses no digits first.
        if re >= 0.0 {
            let a = (0.5 * (size + re)).sqrt();
            [a, if a > 0.0 { 0.5 * im / a } else { 0.0 }]
        } else {
            let b = (0.5 * (size - re)).sqrt().copysign(im);
            [0.5 * im / b, b]
        }
    }

    fn squared_ratio(above: [f64; 2], below: [f64; 2]) -> f64 {
        (above[0] * above[0] + above[1] * above[1]) / (below[0] * below[0] + below[1] * below[1])
    }

    /// Fresnel's amplitudes as they stand, with a complex cosine behind the interface.
    fn amplitudes(c: f64, n: f64, k: f64) -> f64 {
        let epsilon = [n * n - k * k, -2.0 * n * k];
        let [a, b] = root([epsilon[0] - (1.0 - c) * (1.0 + c), epsilon[1]]);
        let s = squared_ratio([c - a, -b], [c + a, b]);
        let p = squared_ratio(
            [epsilon[0] * c - a, epsilon[1] * c - b],
            [epsilon[0] * c + a, epsilon[1] * c + b],
        );
        0.5 * (s + p)
    }

    #[test]
    fn conductors_are_finite_at_the_ends_of_their_range() {
        for eta in [0.0, 1e-25, 1e-6, 1.0, 1e6] {
            for k in [0.0, 1e6] {
                for c in [0.0, 1e-6, 0.5, 1.0] {
                    let f = fresnel_conductor(c, DVec3::splat(eta), DVec3::splat(k));
                    assert!(
                        f.is_finite() && f.min_element() >= 0.0 && f.max_element() <= 1.0,
                        "{eta} {k} {c}: {f}"
                    );
                }
            }
        }
    }

    #[test]
    fn conductors_agree_with_the_complex_form() {
        let mut worst = 0.0f64;
        for i in 0..333_334 {
            let [x, y, z] = [1, 2, 3].map(|seed| random3(i, seed));
            let c = if i % 10 == 0 { 1e-6 * z.x } else { z.x };
            let (eta, k) = (0.02 + 4.98 * x, 12.0 * y);
            let found = fresnel_conductor(c, eta, k);
            for band in 0..3 {
                worst = worst.max((found[band] - amplitudes(c, eta[band], k[band])).abs());
            }
        }
        assert!(worst < 1e-13, "{worst:e}");
        // Grazing incidence; without an interface nothing is reflected even there.
        let (eta, k) = (DVec3::new(0.04, 1.0, 2.9), DVec3::new(4.8, 0.0, 3.2));
        for c in [0.0, 1e-7, 1e-4] {
            let f = fresnel_conductor(c, eta, k);
            assert!(f.is_finite() && f.y <= c, "{f}");
            assert!(
                (f.x - 1.0).abs() < 8.0 * c + 1e-15 && (f.z - 1.0).abs() < 16.0 * c + 1e-15,
                "{f}"
            );
        }
    }

    #[test]
    fn conductors_reflect_as_published() {
        for (name, wavelength, curve) in published::CURVES {
            let is = |metal: &&published::Metal| metal.name == *name && metal.wavelength == *wavelength;
            let metal = published::METALS.iter().find(is).expect("metal");
            let [n, k] = metal.index();
            for (c, expected) in published::COSINES.into_iter().zip(curve) {
                let found = fresnel_conductor(c, DVec3::splat(n), DVec3::splat(k)).x;
                assert!(
                    (found - expected).abs() < 5e-5,
                    "{name} {wavelength} at {c}: {found} {expected}"
                );
            }
        }
    }

    fn root_of_half(x: f16) -> f16 {
        f16::from_f64(x.to_f64().sqrt())
    }

    /// The operations of [`fresnel_conductor`] on half floats, each rounded to one; what is left of 1 after the cosine's square is given.
    fn conductor_of_halves(c: f16, s2: f16, n: f16, k: f16) -> f16 {
        let [half, two, four, tiny] = [0.5, 2.0, 4.0, LEAST_SUM].map(f16::from_f64);
        let c2 = c * c;
        let d = n * n - k * k - s2;
        let ek = n * k;
        let a2b2 = root_of_half(d * d + four * ek * ek);
        let a2 = if d >= f16::ZERO {
            half * (a2b2 + d)
        } else {
            two * ek * ek / (a2b2 - d)
        };
        let sum = a2b2 + c2;
        let cross_s = two * c * root_of_half(a2);
        let rs = (sum - cross_s) / (sum + cross_s + tiny);
        let sum_p = c2 * a2b2 + s2 * s2;
        let across = cross_s * s2;
        half * (rs + rs * (sum_p - across) / (sum_p + across + tiny))
    }

    /// The single expression as it is printed, with quotients by the cosine.
    fn printed_of_halves(c: f16, s2: f16, n: f16, k: f16) -> f16 {
        let [half, two, four] = [0.5, 2.0, 4.0].map(f16::from_f64);
        let t = n * n - k * k - s2;
        let q = root_of_half(t * t + four * n * n * k * k);
        let a = root_of_half(half * (q + t));
        let fs = (q - two * a * c + c * c) / (q + two * a * c + c * c);
        let (large, small) = (q + s2 * s2 / (c * c), two * a * s2 / c);
        half * (fs + fs * large / (large + small))
    }

    /// Nothing is evaluated so, but a host's shaders may; the bounds are the published ones.
    #[test]
    fn conductors_are_numbers_in_half_precision() {
        const SAMPLES: u32 = 10_000;
        // From here on squares of the cosine's reciprocal are half floats.
        const LEAST_COSINE: f64 = 1.0 / 256.0;
        let mut worst = 0.0f64;
        for metal in published::METALS {
            let [n, k] = metal.index();
            let [half_n, half_k] = [n, k].map(f16::from_f64);
            for i in 0..=SAMPLES {
                let c = f64::from(i) / f64::from(SAMPLES);
                let half_c = f16::from_f64(c);
                let s2 = f16::ONE - half_c * half_c;
                let found = conductor_of_halves(half_c, s2, half_n, half_k).to_f64();
                let exact = fresnel_conductor(c, DVec3::splat(n), DVec3::splat(k)).x;
                assert!(found.is_finite(), "{} at {c}", metal.name);
                worst = worst.max((found - exact).abs());
                let printed = printed_of_halves(half_c, s2, half_n, half_k);
                assert_eq!(printed.is_nan(), c < LEAST_COSINE, "{} at {c}", metal.name);
            }
        }
        assert!(worst < 1.8e-3, "{worst}");
    }

    /// Whether the reflectance falls with the cosine all the way.
    fn falls(n: f64, k: f64) -> bool {
        let at = |i: u32| fresnel_conductor(f64::from(i) / 2000.0, DVec3::splat(n), DVec3::splat(k)).x;
        (0..2000).all(|i| at(i + 1) <= at(i))
    }

    #[test]
    fn curves_dip_where_published() {
        // n = 1.5: reflectance at normal incidence, least reflectance and its cosine, for k from 0.
        for (k, f0, least, place) in [
            (0.0, 0.0400, 0.0400, 1.0),
            (1.0, 0.1724, 0.1724, 1.0),
            (2.0, 0.4146, 0.4146, 1.0),
            (3.0, 0.6066, 0.5971, 0.469),
            (4.0, 0.7303, 0.693_09, 0.294),
            (5.0, 0.8080, 0.7502, 0.220),
            (6.0, 0.8580, 0.7884, 0.177),
            (7.0, 0.8914, 0.8160, 0.149),
            (8.0, 0.9146, 0.8370, 0.129),
            (9.0, 0.9312, 0.8535, 0.114),
            (10.0, 0.9435, 0.8669, 0.102),
        ] {
            let at = |c: f64| fresnel_conductor(c, DVec3::splat(1.5), DVec3::splat(k)).x;
            let cosines = (0..=10_000).map(|i| f64::from(i) / 10_000.0);
            let found = cosines.min_by(|a, b| at(*a).total_cmp(&at(*b))).expect("cosines");
            assert!(
                (at(1.0) - f0).abs() < 5e-5 && (at(found) - least).abs() < 5e-5,
                "{k}: {}",
                at(found)
            );
            // Half of the last printed digit.
            assert!((found - place).abs() < 5e-4, "{k}: {found}");
        }
        // n and the greatest k up to which the reflectance falls with the cosine.
        for (n, most) in [
            (0.05, 1.79),
            (0.1, 1.84),
            (0.2, 1.93),
            (0.4, 2.08),
            (0.6, 2.19),
            (0.8, 2.27),
            (1.0, 2.32),
            (1.2, 2.36),
            (1.5, 2.37),
            (1.8, 2.34),
            (2.0, 2.30),
            (2.2, 2.24),
            (2.4, 2.15),
            (2.6, 2.05),
            (2.8, 1.91),
            (3.0, 1.74),
            (3.2, 1.52),
            (3.4, 1.23),
            (3.6, 0.79),
        ] {
            assert!(falls(n, most - 0.02) && !falls(n, most + 0.02), "{n} {most}");
        }
        // It closes at n = 2 + √3, where Brewster's minimum of dielectrics reaches normal incidence.
        let closed = 2.0 + 3.0f64.sqrt();
        assert!(falls(closed - 0.01, 0.0) && !falls(closed + 0.01, 0.0));
    }
}
