//! Directional albedos of the GGX reflection lobe, tabulated: what couples a diffuse base to its specular layer and what
//! compensates for multiple scattering.
//!
//! Method: quadrature over the square that the visible-normal sampler maps to half vectors (Dupuy and Benyoub 2023), where the
//! integrand is Fresnel × G2/G1; the use of such tables follows Kulla and Conty, "Revisiting Physically Based Shading at Imageworks"
//! (SIGGRAPH course 2017). Guarantees: the averages are those of the interpolated tables, not of the functions behind them, so that
//! lobes built from both lose and gain no energy but by the interpolation error of the table (stated by the tests). Deterministic.
//! Twin of `transport/albedo.glsl`.
//!
//! Layers: 0 has unit Fresnel; 1..=`ETA_NODES` have max(0, (F − F0)/(1 − F0)) of an exact dielectric, evenly spaced in
//! (η − 1)/(η + 1); the last has Schlick's (1 − cos)⁵. Within a layer row 0 is the mirror (α below `ALPHA_MIN`), the other rows are
//! even in α^¼ from `ALPHA_MIN` to 1, and columns are even in (cos θ)^¼: both follow the boundary layer cos θ ~ α near grazing.

use super::fresnel::{fresnel_dielectric, fresnel_f0, schlick_weight};
use super::ggx::{ALPHA_MIN, ggx_g1, ggx_g2, ggx_sample_visible};
use crate::catalogue::{Role, Row, sources};
use crate::gpu::shaders::constants;
use glam::{DVec2, DVec3};
use rayon::prelude::*;
use std::sync::OnceLock;

/// Columns of a layer.
pub const COS_NODES: usize = constants::COS_NODES as usize;
/// Rows of a layer.
pub const ALPHA_NODES: usize = constants::ALPHA_NODES as usize;
/// Layers for exact dielectrics.
pub const ETA_NODES: usize = constants::ETA_NODES as usize;
/// (η − 1)/(η + 1) of the last of them (η = 3); larger indices use that layer, which only loses energy.
pub const ETA_PARAMETER_MAX: f64 = constants::ETA_PARAMETER_MAX as f64;
/// Number of the layer with Schlick's weight.
pub const SCHLICK_LAYER: usize = constants::SCHLICK_LAYER as usize;
const LAYERS: usize = ETA_NODES + 2;
/// Index of the first cosine-weighted average; each layer has `ALPHA_NODES` of them.
pub const AVERAGE_BASE: usize = constants::AVERAGE_BASE as usize;
/// Floats in the whole table.
pub const TABLE_LENGTH: usize = AVERAGE_BASE + LAYERS * ALPHA_NODES;

/// Points of the quadrature and the generator of its rule: a Fibonacci lattice, which a jump at the horizon does not upset.
const QUADRATURE: [u32; 2] = [1597, 987];
/// α^¼ at [`ALPHA_MIN`].
pub(super) const ALPHA_ROOT_MIN: f64 = 0.177_827_941_003_892_3;

/// The table as uploaded.
#[derive(Debug, Clone)]
pub struct AlbedoTable {
    /// [`TABLE_LENGTH`] values: the layers, then their averages.
    pub values: Vec<f32>,
}

/// Index of refraction of a dielectric layer.
fn layer_eta(layer: usize) -> f64 {
    let x = ETA_PARAMETER_MAX * (layer - 1) as f64 / (ETA_NODES - 1) as f64;
    (1.0 + x) / (1.0 - x)
}

/// The Fresnel factor of each layer, normalised to run from 0 at normal incidence to 1 at grazing (layer 0: always 1).
fn layer_factors(cos_h: f64) -> [f64; LAYERS] {
    std::array::from_fn(|layer| match layer {
        0 => 1.0,
        SCHLICK_LAYER => schlick_weight(cos_h),
        // Equal indices reflect nothing but at grazing incidence.
        1 => 0.0,
        _ => {
            let (eta, f0) = (layer_eta(layer), fresnel_f0(layer_eta(layer)));
            ((fresnel_dielectric(cos_h, eta) - f0) / (1.0 - f0)).max(0.0)
        }
    })
}

/// Albedos of all layers for one direction, by the lattice rule with `points` points and generator `step`.
pub(crate) fn integrate_albedos(cos_o: f64, alpha: f64, [points, step]: [u32; 2]) -> [f64; LAYERS] {
    if alpha == 0.0 {
        return layer_factors(cos_o);
    }
    // The limit towards the horizon, where masking is 0/0 at the horizon itself.
    let cos_o = cos_o.max(1e-6);
    let wo = DVec3::new((1.0 - cos_o * cos_o).max(0.0).sqrt(), 0.0, cos_o);
    let mut sums = [0.0; LAYERS];
    for i in 0..points {
        // Half of the azimuth: the lobe is symmetric about the plane of incidence.
        let x = 0.5 * (f64::from(i) + 0.5) / f64::from(points);
        let y = (f64::from(i * step % points) + 0.5) / f64::from(points);
        let h = ggx_sample_visible(wo, alpha, DVec2::new(x, y));
        let cos_h = wo.dot(h);
        let cos_i = 2.0 * cos_h * h.z - wo.z;
        if cos_i > 0.0 {
            let masking = ggx_g2(cos_o, cos_i, alpha, false) / ggx_g1(cos_o, alpha);
            for (sum, factor) in sums.iter_mut().zip(layer_factors(cos_h)) {
                *sum += masking * factor;
            }
        }
    }
    sums.map(|s| s / f64::from(points))
}

impl AlbedoTable {
    /// The table; computed at the first call and shared.
    pub fn shared() -> &'static Self {
        static TABLE: OnceLock<AlbedoTable> = OnceLock::new();
        TABLE.get_or_init(Self::compute)
    }

    fn compute() -> Self {
        let nodes: Vec<[f64; LAYERS]> = (0..ALPHA_NODES * COS_NODES)
            .into_par_iter()
            .map(|k| {
                let root_cos = (k % COS_NODES) as f64 / (COS_NODES - 1) as f64;
                integrate_albedos(root_cos.powi(4), row_alpha(k / COS_NODES), QUADRATURE)
            })
            .collect();
        #[expect(
            clippy::cast_possible_truncation,
            reason = "the device holds the table in single precision"
        )]
        let mut values: Vec<f32> = (0..LAYERS)
            .flat_map(|layer| nodes.iter().map(move |n| n[layer].min(1.0) as f32))
            .collect();
        for row in 0..LAYERS * ALPHA_NODES {
            let average = average_of_row(&values[row * COS_NODES..][..COS_NODES]);
            #[expect(
                clippy::cast_possible_truncation,
                reason = "the device holds the table in single precision"
            )]
            values.push(average as f32);
        }
        Self { values }
    }

    fn at(&self, index: usize) -> f64 {
        f64::from(self.values[index])
    }
}

/// 2∫ f(μ) μ dμ of the function that is linear in s = μ^¼ between the nodes of a row: exactly, ∫ 8 s⁷ f ds.
fn average_of_row(row: &[f32]) -> f64 {
    let step = 1.0 / (row.len() - 1) as f64;
    row.windows(2)
        .enumerate()
        .map(|(i, pair)| {
            let (s0, s1) = (i as f64 * step, (i + 1) as f64 * step);
            let (f0, f1) = (f64::from(pair[0]), f64::from(pair[1]));
            let slope = (f1 - f0) / step;
            (f0 - slope * s0) * (s1.powi(8) - s0.powi(8)) + slope * (8.0 / 9.0) * (s1.powi(9) - s0.powi(9))
        })
        .sum()
}

/// Position between two nodes: the lower node and the weight of the upper.
fn node(x: f64, count: usize) -> (usize, f64) {
    let p = x.clamp(0.0, 1.0) * (count - 1) as f64;
    let i = (p as usize).min(count - 2);
    (i, p - i as f64)
}

/// α of a row.
fn row_alpha(row: usize) -> f64 {
    if row == 0 {
        return 0.0;
    }
    let t = (row - 1) as f64 / (ALPHA_NODES - 2) as f64;
    (ALPHA_ROOT_MIN + (1.0 - ALPHA_ROOT_MIN) * t).powi(4)
}

/// Row below `alpha` and the weight of the next.
fn alpha_node(alpha: f64) -> (usize, f64) {
    if alpha < ALPHA_MIN {
        return (0, 0.0);
    }
    let (row, t) = node(
        (alpha.sqrt().sqrt() - ALPHA_ROOT_MIN) / (1.0 - ALPHA_ROOT_MIN),
        ALPHA_NODES - 1,
    );
    (row + 1, t)
}

/// Bilinear look-up of the directional albedo of a layer.
pub fn albedo_lookup(table: &AlbedoTable, layer: usize, cos_theta: f64, alpha: f64) -> f64 {
    let (row, fr) = alpha_node(alpha);
    let (column, fc) = node(cos_theta.max(0.0).sqrt().sqrt(), COS_NODES);
    let i = (layer * ALPHA_NODES + row) * COS_NODES + column;
    let mix = |a: f64, b: f64, t: f64| a + (b - a) * t;
    mix(
        mix(table.at(i), table.at(i + 1), fc),
        mix(table.at(i + COS_NODES), table.at(i + COS_NODES + 1), fc),
        fr,
    )
}

/// Linear look-up of a layer's average albedo, 2∫ E(μ) μ dμ.
pub fn albedo_average(table: &AlbedoTable, layer: usize, alpha: f64) -> f64 {
    let (row, fr) = alpha_node(alpha);
    let i = AVERAGE_BASE + layer * ALPHA_NODES + row;
    table.at(i) + (table.at(i + 1) - table.at(i)) * fr
}

/// Layer and weight of the next one for a dielectric of index `eta`; `eta` ≤ 0 stands for Schlick's weight.
pub fn albedo_layer(eta: f64) -> (usize, f64) {
    if eta <= 0.0 {
        return (SCHLICK_LAYER - 1, 1.0);
    }
    let (i, t) = node((eta - 1.0) / (eta + 1.0) / ETA_PARAMETER_MAX, ETA_NODES);
    (i + 1, t)
}

/// Rows of the catalogue.
pub(crate) const ROWS: &[Row] = &[Row {
    id: "CL-MULTISCATTER",
    name: "compensation of rough metals for scattering among microfacets",
    role: Role::PartOf("BG-3"),
    limits: "Metals only; keeps the energy of white ones, with a lobe that is not that of the microfacets; coloured ones reflect up to 0.03 less than walks among microfacets do, at roughness 1.",
    sources: &[sources::KULLA_CONTY_2017.whole()],
    shaders: &["shaders/transport/albedo.glsl"],
    tests: &[
        "engine/src/transport/bsdf/tests.rs::white_furnace",
        "engine/src/transport/bsdf/tests.rs::rough_metals_reflect_as_walks_among_their_microfacets",
        "engine/src/transport/bsdf/tests.rs::albedo_table_interpolates_within_its_bound",
        "tests/tests/twins/tables.rs::albedos_agree_with_their_twins",
        "tests/tests/twins/scattering.rs::the_scattering_function_agrees_with_its_twin",
    ],
    settings: &["multiple_scattering"],
    api: &["clerestory::transport::albedo"],
    ..Row::of(file!())
}];
