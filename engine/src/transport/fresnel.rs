//! Fresnel reflectance of unpolarized light at an interface.
//!
//! Sources: dielectric and conductor forms from Fresnel's equations (Born and Wolf, Principles of Optics, 1.5 and 14.2); Schlick,
//! "An Inexpensive BRDF Model for Physically-based Rendering" (1994). Guarantees: results lie in [0, 1]; total internal reflection
//! gives exactly 1; equal indices give exactly 0 off grazing. Twin of `transport/fresnel.glsl`.

use glam::DVec3;

use crate::catalogue::{Role, Row, sources};

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

/// Exact conductor against vacuum, per band; complex index `eta` + i `k`.
pub fn fresnel_conductor(cos_i: f64, eta: DVec3, k: DVec3) -> DVec3 {
    let c2 = cos_i * cos_i;
    let s2 = 1.0 - c2;
    let d = eta * eta - k * k - s2;
    let ek = eta * k;
    let a2b2 = (d * d + 4.0 * ek * ek).map(f64::sqrt);
    let a = (0.5 * (a2b2 + d)).max(DVec3::ZERO).map(f64::sqrt);
    let sum = a2b2 + c2;
    let cross_s = 2.0 * cos_i * a;
    let rs = (sum - cross_s) / (sum + cross_s);
    let sum_p = c2 * a2b2 + s2 * s2;
    let cross_p = cross_s * s2;
    let rp = rs * (sum_p - cross_p) / (sum_p + cross_p);
    (0.5 * (rs + rp)).clamp(DVec3::ZERO, DVec3::ONE)
}

/// Cosine-weighted hemispherical average 2∫F(μ)μ dμ of the conductor's reflectance, by the midpoint rule.
///
/// A material constant of the multiple-scattering compensation; the error is below 1e-5.
pub fn fresnel_conductor_average(eta: DVec3, k: DVec3) -> DVec3 {
    const STEPS: u32 = 256;
    (0..STEPS)
        .map(|i| {
            let mu = (f64::from(i) + 0.5) / f64::from(STEPS);
            fresnel_conductor(mu, eta, k) * (2.0 * mu / f64::from(STEPS))
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
}
