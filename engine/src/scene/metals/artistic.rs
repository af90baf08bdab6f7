//! A conductor by two colours: its reflectance at normal incidence and a tint of its edge.
//!
//! Source: Gulbrandsen, "Artist Friendly Metallic Fresnel" (JCGT 3(4), 2014). For a reflectance r, n lies between (1 − r)/(1 + r), where the tint g
//! is 1, and N = (1 + √r)/(1 − √r), where g and k are zero; k² = (n − 1/N)(N − n) follows from r. Guarantees: the two mappings are inverse to each other;
//! a metal keeps its reflectance at normal incidence. [`artistic_index`] is the twin of that in `transport/fresnel_forms.glsl`.

use glam::{DVec3, Vec3};

use crate::catalogue::{Role, Row, sources};
use crate::gpu::shaders::constants;
use crate::scene::ConductorIor;

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

/// [`artistic_index`] as a scene holds it.
pub fn by_colors(reflectance: Vec3, edge_tint: Vec3) -> ConductorIor {
    let [eta, k] = artistic_index(reflectance.as_dvec3(), edge_tint.as_dvec3());
    ConductorIor {
        eta: eta.as_vec3(),
        k: k.as_vec3(),
    }
}

/// Rows of the catalogue.
pub(crate) const ROWS: &[Row] = &[Row {
    id: "CL-ARTISTIC-METAL",
    name: "conductor by reflectance and edge tint",
    role: Role::PartOf("BG-3"),
    limits: "Reflectances up to 0.9999; a tint moves the dip near grazing incidence, but not where it lies.",
    sources: &[sources::GULBRANDSEN_2014.whole()],
    shaders: &["shaders/transport/fresnel_forms.glsl"],
    tests: &[
        "engine/src/scene/metals/artistic.rs::two_colours_and_an_index_are_one",
        "tests/tests/twins/fresnel_forms.rs::colours_agree_with_their_twin",
        "engine/tests/scene_load.rs::metals_are_named_measured_or_coloured_and_name_their_form",
    ],
    experiment: "clerestory metal gold",
    api: &["clerestory::scene::metals::artistic"],
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
}
