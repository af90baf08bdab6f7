//! Classical microfacets of metals, in place of GGX under Smith's height-correlated masking with compensation for multiple scattering.

/// How normals of microfacets are distributed; all by the width that the material's roughness gives GGX.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Distribution {
    /// GGX.
    #[default]
    Ggx,
    /// Beckmann's.
    Beckmann,
    /// A power of the cosine.
    CosineLobe,
}

/// How microfacets mask and shadow each other.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Geometry {
    /// Cook and Torrance's grooves.
    #[default]
    CookTorrance,
    /// The term of one cosine by Kelemen and Szirmay-Kalos.
    Simplified,
    /// The distribution's separable Smith term, G1(ωi) G1(ωo), as in Mitsuba.
    Smith,
}

/// Microfacets of a metal without compensation for multiple scattering.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default, serde::Serialize, serde::Deserialize)]
pub struct Microfacets {
    /// Of their normals.
    pub distribution: Distribution,
    /// Of what they hide.
    pub geometry: Geometry,
}
