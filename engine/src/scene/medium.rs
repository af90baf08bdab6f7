//! Participating media: what absorbs, scatters and emits light between surfaces.
//!
//! Source: Chandrasekhar, "Radiative Transfer" (1960), chapter 1. Coefficients are those at density 1; a grid of densities scales all
//! of them alike.

use glam::{DAffine3, Vec3};

/// How a medium scatters about the direction of propagation. All are normalised to one over the sphere.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum Phase {
    /// Evenly.
    #[default]
    Isotropic,
    /// After Henyey and Greenstein (1941).
    HenyeyGreenstein {
        /// Mean cosine in (−1, 1); forward scattering is positive.
        g: f32,
    },
    /// After Blasi, Le Saëc and Schlick (1993).
    Schlick {
        /// Eccentricity in (−1, 1); forward scattering is positive.
        k: f32,
    },
    /// By particles far smaller than the wavelength: 3/(16π)·(1 + cos²θ).
    Rayleigh,
}

/// A medium inside of closed surfaces ([`Material::interior`](super::Material::interior)) or around them
/// ([`Scene::surrounding`](super::Scene::surrounding)).
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Medium {
    /// Name from the file.
    pub name: String,
    /// Absorption coefficient per RGB band, m⁻¹.
    pub sigma_a: Vec3,
    /// Scattering coefficient per RGB band, m⁻¹.
    pub sigma_s: Vec3,
    /// Radiance emitted per metre, W·m⁻³·sr⁻¹.
    pub emission: Vec3,
    /// Phase function.
    pub phase: Phase,
    /// Density over space; `None` for 1 everywhere.
    pub density: Option<DensityGrid>,
}

/// Densities at the centres of a grid's cells, interpolated linearly between them, constant from the outermost centres to the faces
/// of the grid, and zero outside of it.
#[derive(Debug, Clone, PartialEq)]
pub struct DensityGrid {
    /// Cells along x, y and z; each at least 1.
    pub size: [u32; 3],
    /// Densities, finite and not negative, x fastest and z slowest.
    pub values: Vec<f32>,
    /// The unit cube, which the grid fills, to world space.
    pub to_world: DAffine3,
}
