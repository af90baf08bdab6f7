//! Classical parts of the microfacet product f = D · G · F: Beckmann's distribution and the cosine lobe, and the geometric terms of Cook and Torrance,
//! of Kelemen and Szirmay-Kalos, and of Smith.
//!
//! Sources: Beckmann and Spizzichino, The Scattering of Electromagnetic Waves from Rough Surfaces (1963), with the 1/π that makes it a density by
//! ∫ D cos δ dω = 1; Blinn, "Models of Light Reflection for Computer Synthesized Pictures" (SIGGRAPH 1977) for the lobe; Cook and Torrance, "A
//! Reflectance Model for Computer Graphics" (ACM TOG 1(1), 1982); Kelemen and Szirmay-Kalos, "A Microfacet Based Coupled Specular-Matte BRDF Model"
//! (2001); for Smith's term Walter et al., "Microfacet Models for Refraction through Rough Surfaces" (EGSR 2007, equation 27), and Ribardière et al.,
//! "STD: Student's t-Distribution of Slopes for Microfacet Based BSDFs" (Eurographics 2017), of whose slopes those of the cosine lobe are a case.
//! Geometric terms hold the 1/(4 (n·l)(n·v)) of the product. Guarantees: reciprocal; with any term no more light leaves than comes in, at any
//! slope: Cook and Torrance's loses up to 0.55 of it at slope 1, the simplified one up to 0.63, Smith's up to 0.54. The simplified term is nowhere above
//! Cook and Torrance's: with n·l + n·v = 2 (l·h)(n·h), their ratio is (n·l)(n·v)/(l·h)² ≤ (n·h)² where nothing is masked, else the greater of the two
//! cosines over their sum.
//!
//! Smith's term is the product of the masking G1 of both directions, not the height-correlated form, so that it can be compared with Mitsuba's, which has
//! the same Beckmann G1. That of the lobe stands between Beckmann's and GGX's, which the lobe is at an infinite exponent and at 0: 1/G1 is mixed of
//! theirs by a share that is exact at grazing incidence. With a = 1/(α tan θ) and α² = 2/(s + 2), Smith's Λ is k/a there, k = 1/(2√π) for Beckmann's, ½ for
//! GGX's, and Γ((s + 3)/2) / (√π α (s + 1) Γ((s + 2)/2)) for the lobe's slopes, whose quotient of gamma functions is taken to the third power of α². The
//! usual choice, Beckmann's G1 at that α, is up to 1.7 times as large for broad lobes, and light would come out of nothing.
//!
//! Metals take them by [`Material::classic_microfacets`](crate::scene::Material::classic_microfacets); without, the engine uses GGX ([`ggx`](super::ggx)).
//! Twin of `transport/microfacets.glsl`; all directions in the frame whose z is the normal.

use glam::{DVec2, DVec3};
use std::f64::consts::{FRAC_1_PI, TAU};

use crate::catalogue::{Role, Row, sources};
use crate::gpu::shaders::constants;

/// Below this cosine of microfacet incidence the simplified term is cut off.
const SIMPLIFIED_COSINE_MIN: f64 = constants::SIMPLIFIED_COSINE_MIN as f64;
/// From this 1/(m tan θ) on Beckmann's G1 is taken as 1 (Walter et al. 2007, equation 27).
const BECKMANN_UNMASKED_MIN: f64 = constants::BECKMANN_UNMASKED_MIN as f64;
/// √π − 1: Smith's Λ of GGX over that of Beckmann's distribution at grazing incidence, less 1.
const GGX_EXCESS: f64 = constants::GGX_EXCESS as f64;

/// Beckmann's density of microfacet normals, of root mean square slope `m`/√2 along an axis, sr⁻¹.
pub fn beckmann_d(h: DVec3, m: f64) -> f64 {
    if h.z <= 0.0 {
        return 0.0;
    }
    let (c2, m2) = (h.z * h.z, m * m);
    (-h.truncate().length_squared() / (c2 * m2)).exp() * FRAC_1_PI / (m2 * c2 * c2)
}

/// The cosine lobe's density of microfacet normals, of exponent `s`, sr⁻¹.
pub fn cosine_lobe_d(h: DVec3, s: f64) -> f64 {
    let sin2 = h.truncate().length_squared();
    if h.z > 0.0 && sin2 < 1.0 {
        (s + 2.0) * (0.5 * FRAC_1_PI) * (0.5 * s * (-sin2).ln_1p()).exp()
    } else {
        0.0
    }
}

/// The exponent of the lobe that is about as wide as Beckmann's and GGX's of width `alpha`: 0 for 1 (Walter et al. 2007, §5.2).
pub fn cosine_lobe_exponent(alpha: f64) -> f64 {
    2.0 / (alpha * alpha) - 2.0
}

fn normal_at(cos_theta: f64, sin_theta: f64, u: f64) -> DVec3 {
    let (sin, cos) = (TAU * u).sin_cos();
    DVec3::new(sin_theta * cos, sin_theta * sin, cos_theta)
}

/// A normal by the density [`beckmann_d`] times its cosine.
pub fn beckmann_sample(m: f64, u: DVec2) -> DVec3 {
    let tan2 = -m * m * (-u.y).ln_1p();
    let cos_theta = (1.0 + tan2).sqrt().recip();
    normal_at(cos_theta, cos_theta * tan2.sqrt(), u.x)
}

/// A normal by the density [`cosine_lobe_d`] times its cosine.
pub fn cosine_lobe_sample(s: f64, u: DVec2) -> DVec3 {
    let sin2 = -(2.0 * (-u.y).ln_1p() / (s + 2.0)).exp_m1();
    normal_at((1.0 - sin2).sqrt(), sin2.sqrt(), u.x)
}

/// Density per solid angle of the direction that a normal of density `d` reflects, drawn by its density times its cosine.
pub fn reflected_pdf(d: f64, v: DVec3, h: DVec3) -> f64 {
    d * h.z / (4.0 * v.dot(h))
}

/// Cook and Torrance's geometric term over 4 (n·l)(n·v): masking and shadowing by grooves of V shape.
pub fn cook_torrance_g(l: DVec3, v: DVec3, h: DVec3) -> f64 {
    let g = (2.0 * h.z * l.z.min(v.z) / v.dot(h)).min(1.0);
    g / (4.0 * l.z * v.z)
}

/// The simplified term of Kelemen and Szirmay-Kalos, 1/(4 (l·h)²) = 1/|l + v|², of one cosine, cut off at 10⁻³ of it.
pub fn kelemen_g(l: DVec3, h: DVec3) -> f64 {
    super::fresnel::table::simplified_geometry(l.dot(h).max(SIMPLIFIED_COSINE_MIN))
}

/// Beckmann's masking of the direction `w`, of slope `m`: a rational function, within 0.4 % of Smith's with the error function.
pub fn beckmann_g1(w: DVec3, m: f64) -> f64 {
    let c = w.z;
    let slope = m * w.truncate().length();
    if c >= BECKMANN_UNMASKED_MIN * slope {
        return 1.0;
    }
    c * (3.535 * slope + 2.181 * c) / (slope * slope + 2.276 * slope * c + 2.577 * c * c)
}

/// The cosine lobe's masking of the direction `w`, of exponent `s` ≥ 0: within 1 % of Smith's.
pub fn cosine_lobe_g1(w: DVec3, s: f64) -> f64 {
    let width2 = 2.0 / (s + 2.0);
    let beckmann = beckmann_g1(w, width2.sqrt());
    let ggx = 2.0 * w.z / (w.z + (w.z * w.z + width2 * w.truncate().length_squared()).sqrt());
    let last = GGX_EXCESS - 0.75 - 1.0 / 64.0;
    let share = width2 * (0.75 + width2 * (1.0 / 64.0 + width2 * last)) / ((2.0 - width2) * GGX_EXCESS);
    beckmann * ggx / (ggx + share * (beckmann - ggx))
}

/// Smith's term of the masking of `l` and that of `v`, over 4 (n·l)(n·v).
pub fn smith_g(l: DVec3, v: DVec3, g1_l: f64, g1_v: f64) -> f64 {
    g1_l * g1_v / (4.0 * l.z * v.z)
}

/// Rows of the catalogue.
pub(crate) const ROWS: &[Row] = &[
    Row {
        id: "MET-B3",
        name: "Beckmann distribution of microfacets",
        role: Role::PartOf("BG-3"),
        limits: "Isotropic metals alone, uncompensated for multiple scattering, and not in the preview; other renderers' pictures are beside it with Smith's term alone.",
        sources: &[sources::BECKMANN_SPIZZICHINO_1963.whole(), sources::WALTER_2007.whole()],
        experiment: "clerestory agreement --scene cornell-beckmann",
        ..ROW
    },
    Row {
        id: "MET-B4",
        name: "cosine-lobe distribution of microfacets",
        role: Role::PartOf("BG-3"),
        limits: "Isotropic metals alone, without the tail of real surfaces; Smith's masking of it is within 1 %.",
        sources: &[sources::BLINN_1977.whole(), sources::RIBARDIERE_2017.whole()],
        ..ROW
    },
    Row {
        id: "MET-B5",
        name: "geometric term of Cook and Torrance",
        role: Role::PartOf("BG-3"),
        limits: "Grooves of one shape for all distributions; loses up to 0.55 of the light at Beckmann slope 1.",
        sources: &[sources::COOK_TORRANCE_1982.whole()],
        ..ROW
    },
    Row {
        id: "MET-B6",
        name: "simplified geometric term of one cosine",
        role: Role::PartOf("BG-3"),
        limits: "Gains no light, since it is nowhere above Cook and Torrance's term, but loses up to 0.63 of it at Beckmann slope 1, and is infinite where light and viewer are opposite, but for a cut.",
        sources: &[sources::KELEMEN_SZIRMAY_KALOS_2001.whole()],
        ..ROW
    },
];

/// What the rows have in common.
const ROW: Row = Row {
    shaders: &["shaders/transport/microfacets.glsl"],
    tests: &[
        "engine/src/transport/microfacets.rs::distributions_are_normalised",
        "engine/src/transport/microfacets.rs::reflections_are_reciprocal_and_gain_nothing",
        "engine/src/transport/microfacets.rs::samples_follow_their_density",
        "engine/src/transport/microfacets.rs::masking_leaves_what_is_seen_from_a_direction",
        "engine/src/transport/bsdf/tests.rs::classical_metals_are_the_product_of_their_parts",
        "tests/tests/twins/fresnel_forms.rs::microfacets_agree_with_their_twins",
        "tests/tests/twins/scattering.rs::the_scattering_function_agrees_with_its_twin",
    ],
    api: &["clerestory::transport::microfacets"],
    settings: &["clerestory::scene::Microfacets"],
    ..Row::of(file!())
};

#[cfg(test)]
mod tests {
    use super::super::ggx::ggx_g1;
    use super::super::testing::{random3, sphere_test};
    use super::super::warp::square_to_hemisphere;
    use super::*;
    use crate::scene::Geometry;

    const SLOPES: [f64; 5] = [0.1, 0.3, 0.5, 0.7, 1.0];
    const EXPONENTS: [f64; 4] = [5.0, 10.0, 50.0, 200.0];
    const TERMS: [Geometry; 3] = [Geometry::CookTorrance, Geometry::Simplified, Geometry::Smith];

    type OfDirection = Box<dyn Fn(DVec3) -> f64>;

    /// A distribution with its sampler and Smith's masking.
    struct Distributed {
        name: String,
        density: OfDirection,
        sampler: Box<dyn Fn(DVec2) -> DVec3>,
        masking: OfDirection,
        /// What the masking may err by, relatively.
        masking_error: f64,
    }

    fn distributions() -> Vec<Distributed> {
        let slopes = SLOPES.map(|m| Distributed {
            name: format!("Beckmann {m}"),
            density: Box::new(move |h| beckmann_d(h, m)),
            sampler: Box::new(move |u| beckmann_sample(m, u)),
            masking: Box::new(move |w| beckmann_g1(w, m)),
            masking_error: 4e-3,
        });
        slopes.into_iter().chain(EXPONENTS.map(lobe)).collect()
    }

    fn lobe(s: f64) -> Distributed {
        Distributed {
            name: format!("lobe {s}"),
            density: Box::new(move |h| cosine_lobe_d(h, s)),
            sampler: Box::new(move |u| cosine_lobe_sample(s, u)),
            masking: Box::new(move |w| cosine_lobe_g1(w, s)),
            masking_error: 1e-2,
        }
    }

    fn direction(cos_theta: f64) -> DVec3 {
        DVec3::new((1.0 - cos_theta * cos_theta).sqrt(), 0.0, cos_theta)
    }

    #[test]
    fn distributions_are_normalised() {
        for Distributed { name, density, .. } in distributions() {
            const STEPS: u32 = 20_000;
            let mut sum = 0.0;
            for i in 0..STEPS {
                let theta = TAU / 4.0 * (f64::from(i) + 0.5) / f64::from(STEPS);
                let h = DVec3::new(theta.sin(), 0.0, theta.cos());
                sum += density(h) * h.z * theta.sin() * TAU * (TAU / 4.0) / f64::from(STEPS);
            }
            assert!((sum - 1.0).abs() < 1e-3, "{name}: {sum}");
        }
        // As it was printed, without 1/π, Beckmann's integrates to π.
        assert!((beckmann_d(DVec3::Z, 0.3) * 0.09 - FRAC_1_PI).abs() < 1e-12);
    }

    /// The microfacets that face a direction have a projected area of ∫ D max(w·h, 0) dω; what masking leaves of it is the surface's own, the cosine.
    #[test]
    fn masking_leaves_what_is_seen_from_a_direction() {
        const SIDE: u32 = 400;
        let at = |i: u32| (f64::from(i) + 0.5) / f64::from(SIDE);
        // Between exponents 0 and 5 the lobe is farthest from what its masking stands for.
        let wide = [0.5, 1.5, 3.0].map(lobe);
        for one in distributions().into_iter().chain(wide) {
            for cos_w in [0.02, 0.05, 0.1, 0.2, 0.4, 0.7, 1.0] {
                let w = direction(cos_w);
                let area = (0..SIDE).map(|i| {
                    let (sin, cos) = (TAU / 4.0 * at(i)).sin_cos();
                    let facing = |j: u32| (w.x * sin * (TAU / 2.0 * at(j)).cos() + w.z * cos).max(0.0);
                    (one.density)(DVec3::new(sin, 0.0, cos)) * sin * (0..SIDE).map(facing).sum::<f64>()
                });
                let area = area.sum::<f64>() * (TAU / 4.0) * TAU / f64::from(SIDE * SIDE);
                let error = (one.masking)(w) * area / cos_w - 1.0;
                assert!(error.abs() <= one.masking_error, "{}, {cos_w}: {error}", one.name);
            }
        }
        // A lobe of exponent 0 is GGX's of width 1, one of a great exponent is Beckmann's.
        for cos_w in [0.02, 0.1, 0.3, 0.8, 1.0] {
            let w = direction(cos_w);
            assert!((cosine_lobe_g1(w, 0.0) - ggx_g1(cos_w, 1.0)).abs() < 1e-7);
            assert!((cosine_lobe_g1(w, 2e6) - beckmann_g1(w, 1e-3)).abs() < 1e-6);
        }
    }

    /// A geometric term of a distribution.
    fn term(one: &Distributed, geometry: Geometry, l: DVec3, v: DVec3, h: DVec3) -> f64 {
        match geometry {
            Geometry::CookTorrance => cook_torrance_g(l, v, h),
            Geometry::Simplified => kelemen_g(l, h),
            Geometry::Smith => smith_g(l, v, (one.masking)(l), (one.masking)(v)),
        }
    }

    /// A white metal: D · G.
    fn product(one: &Distributed, geometry: Geometry, l: DVec3, v: DVec3) -> f64 {
        let h = (l + v).normalize();
        (one.density)(h) * term(one, geometry, l, v, h)
    }

    /// The light that leaves towards v, by normals drawn by their density times their cosine; and the greatest ratio of the simplified term to that of
    /// Cook and Torrance.
    fn albedo(one: &Distributed, geometry: Geometry, cos_v: f64) -> (f64, f64) {
        const SIDE: u32 = 200;
        let v = direction(cos_v);
        let (mut sum, mut ratio) = (0.0, 0.0f64);
        for i in 0..SIDE * SIDE {
            let [x, y] = [i % SIDE, i / SIDE].map(|i| (f64::from(i) + 0.5) / f64::from(SIDE));
            let h = (one.sampler)(DVec2::new(x, y));
            let l = 2.0 * v.dot(h) * h - v;
            if v.dot(h) <= 0.0 || l.z <= 0.0 {
                continue;
            }
            sum += term(one, geometry, l, v, h) * l.z * 4.0 * v.dot(h) / h.z;
            ratio = ratio.max(kelemen_g(l, h) / cook_torrance_g(l, v, h));
        }
        (sum / f64::from(SIDE * SIDE), ratio)
    }

    #[test]
    fn reflections_are_reciprocal_and_gain_nothing() {
        for one in distributions() {
            let name = &one.name;
            for i in 0..1000 {
                let [l, v] = [1, 2].map(|seed| {
                    let w = square_to_hemisphere(random3(i, seed).truncate());
                    w.with_z(w.z.max(1e-4)).normalize()
                });
                for geometry in TERMS {
                    let [forth, back] = [product(&one, geometry, l, v), product(&one, geometry, v, l)];
                    assert!((forth - back).abs() <= 1e-6 * forth, "{name}: {forth} {back}");
                }
                // 1 + l·v = 2 (l·h)².
                let h = (l + v).normalize();
                let identity = 1.0 / (2.0 * (1.0 + l.dot(v)));
                assert!(l.dot(h) < SIMPLIFIED_COSINE_MIN || (kelemen_g(l, h) - identity).abs() <= 1e-6 * identity);
            }
            for geometry in TERMS {
                for cos_v in [0.01, 0.02, 0.05, 0.1, 0.2, 0.4, 0.7, 1.0] {
                    let (leaves, ratio) = albedo(&one, geometry, cos_v);
                    assert!(leaves <= 1.0 + 1e-3, "{name}, {geometry:?}, {cos_v}: {leaves}");
                    let least = if geometry == Geometry::Simplified { 0.36 } else { 0.44 };
                    assert!(leaves > least, "{name}, {geometry:?}, {cos_v}: {leaves}");
                    assert!(ratio <= 1.0 + 1e-12, "{name}, {cos_v}: {ratio}");
                }
            }
        }
        // The least, which the rows state.
        let roughest = &distributions()[4];
        for (geometry, least) in TERMS.into_iter().zip([0.453, 0.368, 0.462]) {
            let (leaves, _) = albedo(roughest, geometry, 1.0);
            assert!((leaves - least).abs() < 2e-3, "{geometry:?}: {leaves}");
        }
    }

    /// Chi-square at p = 1e-5 each, 9 tests.
    #[test]
    fn samples_follow_their_density() {
        for (seed, one) in (50..).zip(distributions()) {
            let Distributed {
                name, density, sampler, ..
            } = &one;
            let p = sphere_test(
                40_000,
                seed,
                24,
                |u| Some(sampler(u.truncate())),
                |h| if h.z > 0.0 { density(h) * h.z } else { 0.0 },
            );
            assert!(p > 1e-5, "{name}: {p}");
            // Directions have the density that is stated: its integral over normals' weights is 1.
            let (v, h) = (DVec3::Z, sampler(DVec2::new(0.2, 0.4)));
            assert!((reflected_pdf(density(h), v, h) * 4.0 - density(h)).abs() < 1e-12 * density(h));
        }
    }
}
