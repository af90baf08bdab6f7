//! The product of a metal's Fresnel factor and the simplified geometric term, tabulated over the one cosine on which both depend.
//!
//! Source: Kelemen and Szirmay-Kalos, "A Microfacet Based Coupled Specular-Matte BRDF Model" (2001), for the term 1/(4 (l·h)²), which holds the
//! usual 1/(4 (n·l)(n·v)) and so leaves one cosine. The product is infinite at a cosine of 0: nodes are even in the cosine's logarithm from 2⁻¹⁰ to
//! 1, and below that the table ends. So the error of linear interpolation is the same share of the value everywhere, 6·10⁻⁴ for 256 nodes; half
//! floats would not hold the first nodes. Twin of `transport/fresnel_table.glsl`.

use glam::DVec3;

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

/// The table of a Fresnel factor: red, green, blue and nothing, for each node.
pub fn fresnel_table(factor: impl Fn(f64) -> DVec3) -> Vec<[f32; 4]> {
    (0..NODES)
        .map(|i| {
            let cos_h = (DEPTH * (i as f64 / (NODES - 1) as f64 - 1.0)).exp2();
            let product = factor(cos_h) * simplified_geometry(cos_h);
            product.as_vec3().extend(0.0).to_array()
        })
        .collect()
}

/// The product at a cosine, by linear interpolation; a smaller one than 2⁻¹⁰ is taken for that.
pub fn fresnel_table_lookup(table: &[[f32; 4]], cos_h: f64) -> DVec3 {
    let depth = -cos_h.clamp((-DEPTH).exp2(), 1.0).log2();
    let p = (DEPTH - depth) * ((NODES - 1) as f64 / DEPTH);
    let i = (p as usize).min(NODES - 2);
    let node = |i: usize| DVec3::new(table[i][0].into(), table[i][1].into(), table[i][2].into());
    node(i).lerp(node(i + 1), p - i as f64)
}

/// Rows of the catalogue.
pub(crate) const ROWS: &[Row] = &[Row {
    id: "MET-F6",
    name: "table of Fresnel factor times simplified geometric term",
    role: Role::Kernel,
    limits: "One metal a table of 4 KiB for a host's own kernels, and no form that materials name; up to 0.06 % off, and cut off at cosines below 2^-10.",
    sources: &[sources::KELEMEN_SZIRMAY_KALOS_2001.whole()],
    shaders: &["shaders/transport/fresnel_table.glsl"],
    bias: Some(Bias::Biased("linear interpolation, and a cut near grazing incidence")),
    tests: &[
        "engine/src/transport/fresnel/table.rs::tables_interpolate_within_their_bound",
        "tests/tests/twins/fresnel_forms.rs::tables_agree_with_their_twin",
    ],
    experiment: "clerestory metal gold",
    api: &["clerestory::transport::fresnel::table"],
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
        // What a half float cannot hold.
        assert!(table[0][0] > 65_504.0);
        // 1 + l·v = 2 (l·h)².
        let (l, v) = (DVec3::new(0.6, 0.0, 0.8), DVec3::new(0.0, 0.8, 0.6));
        let h = (l + v).normalize();
        assert!((simplified_geometry(l.dot(h)) - 1.0 / (2.0 * (1.0 + l.dot(v)))).abs() < 1e-12);
    }
}
