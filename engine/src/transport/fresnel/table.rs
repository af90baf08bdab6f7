//! The product of a metal's Fresnel factor and the simplified geometric term, tabulated over the one cosine on which both depend.
//!
//! Source: Kelemen and Szirmay-Kalos, "A Microfacet Based Coupled Specular-Matte BRDF Model" (2001), for the term 1/(4 (l·h)²), which holds the
//! usual 1/(4 (n·l)(n·v)) and so leaves one cosine. The product is infinite at a cosine of 0: nodes are even in the cosine's logarithm from 2⁻¹⁰ to
//! 1, and below that the table ends. So the error of linear interpolation is the same share of the value everywhere, 6·10⁻⁴ for 256 nodes; half
//! floats would not hold the first nodes. Twin of `transport/fresnel_table.glsl`.
//!
//! A metal whose scene names [`FresnelForm::Table`](crate::scene::FresnelForm::Table) has the factor itself from it ([`fresnel_tabulated`]), under any geometric term.
//! Guarantees of that: off by as much, but at grazing incidence, where it is exact as at normal incidence; in [0, 1].

use glam::{DVec3, Vec3};

use crate::catalogue::{Bias, Role, Row, sources};
use crate::gpu::shaders::constants;

/// Nodes of a table.
pub const NODES: usize = constants::FRESNEL_TABLE_NODES as usize;
/// Binary logarithm of one over the least cosine.
const DEPTH: f64 = constants::FRESNEL_TABLE_DEPTH as f64;

/// The simplified geometric term with 1/(4 (n·l)(n·v)) inside: 1/(4 (l·h)²) = 1/|l + v|².
pub fn simplified_geometry(cos_h: f64) -> f64 {
    1.0 / (4.0 * cos_h * cos_h)
}

/// The product at a node, as tables hold it.
fn node(i: usize, factor: impl Fn(f64) -> DVec3) -> Vec3 {
    let cos_h = (DEPTH * (i as f64 / (NODES - 1) as f64 - 1.0)).exp2();
    (factor(cos_h) * simplified_geometry(cos_h)).as_vec3()
}

/// The product at a cosine, by linear interpolation between nodes; a smaller one than 2⁻¹⁰ is taken for that.
fn interpolated(node: impl Fn(usize) -> DVec3, cos_h: f64) -> DVec3 {
    let depth = -cos_h.clamp((-DEPTH).exp2(), 1.0).log2();
    let p = (DEPTH - depth) * ((NODES - 1) as f64 / DEPTH);
    let i = (p as usize).min(NODES - 2);
    node(i).lerp(node(i + 1), p - i as f64)
}

/// The table of a Fresnel factor: red, green, blue and nothing, for each node.
pub fn fresnel_table(factor: impl Fn(f64) -> DVec3) -> Vec<[f32; 4]> {
    (0..NODES).map(|i| node(i, &factor).extend(0.0).to_array()).collect()
}

/// The product at a cosine, by linear interpolation; a smaller one than 2⁻¹⁰ is taken for that.
pub fn fresnel_table_lookup(table: &[[f32; 4]], cos_h: f64) -> DVec3 {
    interpolated(
        |i| DVec3::new(table[i][0].into(), table[i][1].into(), table[i][2].into()),
        cos_h,
    )
}

/// The factor at a cosine from a table of it, of which only the two nodes about the cosine are made; below 2⁻¹⁰ straight to 1.
pub fn fresnel_tabulated(cos_i: f64, factor: impl Fn(f64) -> DVec3) -> DVec3 {
    let least = (-DEPTH).exp2();
    let cosine = cos_i.clamp(least, 1.0);
    let looked_up = interpolated(|i| node(i, &factor).as_dvec3(), cosine) / simplified_geometry(cosine);
    let share = (cos_i / least).clamp(0.0, 1.0);
    // A product that is convex is interpolated from above.
    DVec3::ONE.lerp(looked_up, share).clamp(DVec3::ZERO, DVec3::ONE)
}

/// Rows of the catalogue.
pub(crate) const ROWS: &[Row] = &[Row {
    id: "MET-F6",
    name: "table of Fresnel factor times simplified geometric term",
    role: Role::Kernel,
    limits: "One metal a table of 4 KiB; up to 0.06 % off, and cut off at cosines below 2^-10, where the factor of a metal that names it goes straight to 1.",
    sources: &[sources::KELEMEN_SZIRMAY_KALOS_2001.whole()],
    shaders: &["shaders/transport/fresnel_table.glsl"],
    bias: Some(Bias::Biased("linear interpolation, and a cut near grazing incidence")),
    tests: &[
        "engine/src/transport/fresnel/table.rs::tables_interpolate_within_their_bound",
        "engine/src/transport/fresnel/table.rs::metals_by_a_table_reflect_within_its_bound",
        "engine/src/transport/bsdf/tests.rs::metals_reflect_by_the_form_they_name",
        "engine/src/transport/gpu_scene/materials.rs::each_metal_by_a_table_has_one_behind_the_records",
        "tests/tests/twins/fresnel_forms.rs::tables_agree_with_their_twin",
        "tests/tests/twins/scattering.rs::the_scattering_function_agrees_with_its_twin",
        "tests/tests/paths/path_tracer.rs::metals_by_tables_have_each_their_own",
        "engine/tests/scene_load.rs::metals_are_named_measured_or_coloured_and_name_their_form",
    ],
    experiment: "clerestory metal gold",
    api: &["clerestory::transport::fresnel::table"],
    settings: &["clerestory::scene::FresnelForm"],
    ..Row::of(file!())
}];

#[cfg(test)]
mod tests {
    use super::super::fresnel_conductor;
    use super::super::published::METALS;
    use super::*;

    #[test]
    fn tables_interpolate_within_their_bound() {
        for metal in METALS {
            let factor = |c| fresnel_conductor(c, DVec3::splat(metal.n), DVec3::splat(metal.k));
            let table = fresnel_table(factor);
            assert_eq!(table.len(), NODES);
            let mut worst = 0.0f64;
            for i in 0..=20_000 {
                let c = (-DEPTH * (1.0 - f64::from(i) / 20_000.0)).exp2();
                let exact = factor(c) * simplified_geometry(c);
                worst = worst.max(((fresnel_table_lookup(&table, c) - exact) / exact).abs().max_element());
            }
            assert!(worst < 6e-4, "{} {}: {worst}", metal.name, metal.wavelength);
        }
        let table = fresnel_table(|_| DVec3::ONE);
        for c in [0.0, 1e-30, -0.1] {
            let found = fresnel_table_lookup(&table, c);
            assert!(
                found.is_finite() && found.x <= 0.25 * (2.0 * DEPTH).exp2(),
                "{c}: {found}"
            );
        }
        let constant = fresnel_tabulated(0.3, |_| DVec3::ONE);
        assert!(
            constant.max_element() <= 1.0 && constant.min_element() > 1.0 - 6e-4,
            "{constant}"
        );
        // What a half float cannot hold.
        assert!(table[0][0] > 65_504.0);
        // 1 + l·v = 2 (l·h)².
        let (l, v) = (DVec3::new(0.6, 0.0, 0.8), DVec3::new(0.0, 0.8, 0.6));
        let h = (l + v).normalize();
        assert!((simplified_geometry(l.dot(h)) - 1.0 / (2.0 * (1.0 + l.dot(v)))).abs() < 1e-12);
    }

    #[test]
    fn metals_by_a_table_reflect_within_its_bound() {
        for metal in METALS {
            let factor = |c| fresnel_conductor(c, DVec3::splat(metal.n), DVec3::splat(metal.k));
            let table = fresnel_table(factor);
            let what = (metal.name, metal.wavelength);
            let mut worst = 0.0f64;
            // Half of them between the last node and grazing incidence.
            let near = (0..=1000).map(|i| f64::from(i) * 1e-6);
            for c in near.chain((0..=1000).map(|i| f64::from(i) * 1e-3)) {
                let found = fresnel_tabulated(c, factor);
                assert!(
                    found.min_element() >= 0.0 && found.max_element() <= 1.0,
                    "{what:?} {c}: {found}"
                );
                worst = worst.max((found / factor(c) - 1.0).abs().max_element());
                if c >= (-DEPTH).exp2() {
                    let held = fresnel_table_lookup(&table, c) / simplified_geometry(c);
                    assert!(
                        (found - held.min(DVec3::ONE)).abs().max_element() < 1e-12,
                        "{what:?} {c}: {found} {held}"
                    );
                }
            }
            assert!(worst < 6e-4, "{what:?}: {worst}");
            assert_eq!(fresnel_tabulated(0.0, factor), DVec3::ONE, "{what:?}");
            // The last node in single precision.
            let normal = (fresnel_tabulated(1.0, factor) - factor(1.0)).abs().max_element();
            assert!(normal < 1e-7, "{what:?}: {normal}");
        }
    }
}
