//! A conductor by two colours: its reflectance at normal incidence and a tint of its edge.
//!
//! Source: Gulbrandsen, "Artist Friendly Metallic Fresnel" (JCGT 3(4), 2014). For a reflectance r, n lies between (1 − r)/(1 + r), where the tint g
//! is 1, and N = (1 + √r)/(1 − √r), where g and k are zero; k² = (n − 1/N)(N − n) follows from r. Guarantees: the two mappings are inverse to each other;
//! a metal keeps its reflectance at normal incidence and, of 0.01 and more, its tint within 10⁻⁶, in single precision too. [`artistic_index`] is the twin of that in
//! `transport/fresnel_forms.glsl`.
//!
//! The host makes n and k once; from there on the metal is one by its index, and any form of the Fresnel factor serves it. The published model is
//! [`FresnelForm::Simplified`](crate::scene::FresnelForm::Simplified), the default [`FresnelForm::Exact`](crate::scene::FresnelForm::Exact).

use glam::{DVec3, Vec3};

use crate::catalogue::{Role, Row, sources};
use crate::gpu::shaders::constants;
use crate::scene::ConductorIor;
use crate::{Error, Result};

/// Greatest reflectance: 1 would need an infinite index.
pub const REFLECTANCE_MAX: f64 = constants::REFLECTANCE_MAX as f64;

/// Least and greatest real part of an index that reflects `r` at normal incidence.
fn range(r: f64) -> [f64; 2] {
    let above = 1.0 + r.sqrt();
    [(1.0 - r) / (1.0 + r), above * above / (1.0 - r)]
}

/// n and k of a reflectance at normal incidence, cut off at [`REFLECTANCE_MAX`], and an edge tint in [0, 1].
pub fn artistic_index(reflectance: DVec3, edge_tint: DVec3) -> [DVec3; 2] {
    let band = |band: usize| {
        let (r, g) = (
            reflectance[band].clamp(0.0, REFLECTANCE_MAX),
            edge_tint[band].clamp(0.0, 1.0),
        );
        let [least, greatest] = range(r);
        let n = g * least + (1.0 - g) * greatest;
        let k2 = (n - 1.0 / greatest) * (g * (greatest - least));
        [n, k2.max(0.0).sqrt()]
    };
    let bands = [0, 1, 2].map(band);
    [0, 1].map(|part| DVec3::from_array(bands.map(|band| band[part])))
}

/// Reflectance at normal incidence and edge tint of an index; the tint is 1 where nothing is reflected.
pub fn artistic_parameters(eta: DVec3, k: DVec3) -> [DVec3; 2] {
    let (below, above, k2) = (eta - 1.0, eta + 1.0, k * k);
    let r = (below * below + k2) / (above * above + k2);
    let tint = |band: usize| {
        let [least, greatest] = range(r[band]);
        if greatest > least {
            (greatest - eta[band]) / (greatest - least)
        } else {
            1.0
        }
    };
    [r, DVec3::from_array([0, 1, 2].map(tint))]
}

/// [`artistic_index`] as a scene holds it: reflectances above [`REFLECTANCE_MAX`] are cut off there.
///
/// # Errors
/// [`Error::Setting`] with the colour's name, the value and its band for one that is not from 0 to 1, or no number.
pub fn by_colors(reflectance: Vec3, edge_tint: Vec3) -> Result<ConductorIor> {
    for (name, color) in [("reflectance", reflectance), ("edge_tint", edge_tint)] {
        for (band, value) in ["red", "green", "blue"].into_iter().zip(color.to_array()) {
            // NaN is nowhere.
            if !(0.0..=1.0).contains(&value) {
                return Err(Error::setting(name, value, format!("in {band} is not from 0 to 1")));
            }
        }
    }
    let [eta, k] = artistic_index(reflectance.as_dvec3(), edge_tint.as_dvec3());
    Ok(ConductorIor {
        eta: eta.as_vec3(),
        k: k.as_vec3(),
    })
}

/// Rows of the catalogue.
pub(crate) const ROWS: &[Row] = &[Row {
    id: "CL-ARTISTIC-METAL",
    name: "conductor by reflectance and edge tint",
    role: Role::PartOf("BG-3"),
    limits: "Reflectances up to 0.9999, greater ones are taken as that; a tint moves the dip near grazing incidence, but not where it lies.",
    sources: &[sources::GULBRANDSEN_2014.whole()],
    shaders: &["shaders/transport/fresnel_forms.glsl"],
    tests: &[
        "engine/src/scene/metals/artistic.rs::two_colours_and_an_index_are_one",
        "engine/src/scene/metals/artistic.rs::an_index_is_that_of_the_printed_formulas",
        "engine/src/scene/metals/artistic.rs::scenes_keep_both_colours",
        "engine/src/scene/metals/artistic.rs::colours_out_of_range_are_refused_by_name_and_band",
        "engine/src/transport/bsdf/tests.rs::metals_by_two_colours_are_exact_conductors",
        "tests/tests/twins/fresnel_forms.rs::colours_agree_with_their_twin",
        "tests/tests/paths/path_tracer.rs::metals_by_two_colours_show_their_reflectance_and_are_exact",
        "engine/tests/scene_load.rs::metals_are_named_measured_or_coloured_and_name_their_form",
        "engine/tests/scene_load.rs::two_colours_of_a_metal_are_kept_or_refused",
    ],
    experiment: "clerestory metal gold",
    api: &["clerestory::scene::metals::artistic"],
    settings: &["clerestory::scene::FresnelForm"],
    ..Row::of(file!())
}];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn two_colours_and_an_index_are_one() {
        for (n, k) in [
            (0.041, 4.8025),
            (1.0066, 2.5823),
            (1.4346, 1.9405),
            (3.1812, 3.3291),
            (1.5, 0.0),
        ] {
            let (eta, k) = (DVec3::splat(n), DVec3::splat(k));
            let [r, g] = artistic_parameters(eta, k);
            assert!((-1e-12..=1.0).contains(&g.x), "{n}: {g}");
            let [found, extinction] = artistic_index(r, g);
            assert!((found - eta).abs().max_element() < 1e-9, "{n}: {found}");
            assert!((extinction - k).abs().max_element() < 1e-6, "{n}: {extinction}");
        }
        for r in [0.0, 0.04, 0.5, 0.9, 0.9999, 1.0] {
            for g in [0.0, 0.3, 1.0] {
                let [n, k] = artistic_index(DVec3::splat(r), DVec3::splat(g));
                assert!(
                    n.min_element() > 0.0 && n.is_finite() && k.is_finite(),
                    "{r} {g}: {n} {k}"
                );
                let kept = artistic_parameters(n, k)[0].x;
                assert!((kept - r.min(REFLECTANCE_MAX)).abs() < 1e-9, "{r} {g}: {kept}");
            }
        }
        // Without a tint k is zero: a dielectric.
        let [_, k] = artistic_index(DVec3::splat(0.04), DVec3::ZERO);
        assert!(k.x < 1e-6, "{k}");
    }

    /// Reflectances from nearly none to nearly all, each with tints from none to all.
    fn colors() -> impl Iterator<Item = [f32; 2]> {
        let reflectances = [0.01f32, 0.04, 0.3, 0.5, 0.9, 0.99, 0.9998];
        reflectances
            .into_iter()
            .flat_map(|r| [0.0, 0.25, 0.5, 0.9, 1.0].map(|g| [r, g]))
    }

    /// As they are printed, with k from the reflectance: k² = (r (n + 1)² − (n − 1)²)/(1 − r), which cancels for great n.
    #[test]
    fn an_index_is_that_of_the_printed_formulas() {
        const ROUNDING: f64 = 1e-14;
        for [r, g] in colors().map(|color| color.map(f64::from)) {
            let [least, greatest] = [(1.0 - r) / (1.0 + r), (1.0 + r.sqrt()) / (1.0 - r.sqrt())];
            let n = g * least + (1.0 - g) * greatest;
            let k2 = (r * (n + 1.0).powi(2) - (n - 1.0).powi(2)) / (1.0 - r);
            let [eta, k] = artistic_index(DVec3::splat(r), DVec3::splat(g)).map(|part| part.x);
            let [of_n, of_k2] = [greatest / (1.0 - r), (n + 1.0).powi(2) / (1.0 - r)].map(|size| ROUNDING * size);
            assert!((eta - n).abs() <= of_n, "{r} {g}: {eta} {n}");
            // What n is off by moves k², too.
            assert!(
                (k * k - k2).abs() <= of_k2 + 2.0 * greatest * of_n,
                "{r} {g}: {} {k2}",
                k * k
            );
        }
    }

    #[test]
    fn scenes_keep_both_colours() {
        for [r, g] in colors() {
            let ior = by_colors(Vec3::splat(r), Vec3::splat(g)).expect("colours");
            assert!(ior.is_in_range(), "{r} {g}: {ior:?}");
            let [kept, tint] = artistic_parameters(ior.eta.as_dvec3(), ior.k.as_dvec3()).map(|color| color.x);
            assert!((kept - f64::from(r)).abs() < 1e-6, "{r} {g}: {kept}");
            assert!((tint - f64::from(g)).abs() < 1e-6, "{r} {g}: {tint}");
        }
        // What nothing can reflect is cut off; what reflects nothing is no interface, whatever its tint.
        let all = by_colors(Vec3::ONE, Vec3::ONE).expect("colours");
        assert!(all.is_in_range(), "{all:?}");
        let kept = artistic_parameters(all.eta.as_dvec3(), all.k.as_dvec3())[0];
        assert!((kept - REFLECTANCE_MAX).abs().max_element() < 1e-6, "{kept}");
        let none = by_colors(Vec3::ZERO, Vec3::splat(0.5)).expect("colours");
        assert_eq!((none.eta, none.k), (Vec3::ONE, Vec3::ZERO));
    }

    #[test]
    fn colours_out_of_range_are_refused_by_name_and_band() {
        for value in [-1e-6, 1.000_001, 2.0, f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
            for (band, name) in ["red", "green", "blue"].into_iter().enumerate() {
                let mut color = Vec3::splat(0.5);
                color[band] = value;
                for (key, [r, g]) in [("reflectance", [color, Vec3::ONE]), ("edge_tint", [Vec3::ONE, color])] {
                    let message = by_colors(r, g).expect_err(key).to_string();
                    assert!(
                        message.contains(&format!("{key}: {value} in {name}")),
                        "{key} {value}: {message}"
                    );
                }
            }
        }
    }
}
