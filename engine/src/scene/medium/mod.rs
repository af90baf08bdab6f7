//! Participating media: what absorbs, scatters and emits light between surfaces.
//!
//! Source: Chandrasekhar, "Radiative Transfer" (1960), chapter 1. Coefficients are those at density 1; a grid of densities scales all
//! of them alike.
//!
//! Where media are: [`Scene::surrounding`](super::Scene::surrounding) fills the space outside all bodies. A placed mesh whose material has
//! an [`interior`](super::Material::interior) holds that medium on the side its faces (counter-clockwise) turn their back to, in place of
//! whatever is around it; so does a solid of glass without one hold nothing. Such meshes are closed, and nested or apart, never crossing.

mod check;
pub mod generate;
mod grid;
mod majorant;
pub mod raw;
pub mod vol;

pub(super) use check::check;
pub use check::{MAX_DENSITY_CELLS, MAX_GRID_DEPTH, MAX_MEDIA};
pub use grid::DensityGrid;
pub(crate) use grid::mean_density;
pub use majorant::MajorantGrid;

use glam::Vec3;

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

/// A medium inside closed surfaces ([`Material::interior`](super::Material::interior)) or around them
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

impl Medium {
    /// Extinction coefficient at density 1 per RGB band, m⁻¹.
    pub fn sigma_t(&self) -> Vec3 {
        self.sigma_a + self.sigma_s
    }

    /// Whether light passes unchanged and none is added, so that it may be left out: all coefficients are 0, or the density is 0 everywhere.
    pub fn is_empty(&self) -> bool {
        let nothing = self.sigma_t() == Vec3::ZERO && self.emission == Vec3::ZERO;
        nothing || self.density.as_ref().is_some_and(|grid| grid.max() == 0.0)
    }

    /// Whether light is added wherever it is, without a grid that has an end.
    pub(crate) fn emits_everywhere(&self) -> bool {
        self.emission != Vec3::ZERO && self.density.is_none()
    }
}
