//! Light of the paths' pictures that virtual lights or photons bring.

use crate::transport::edge_bound::EdgeBound;

/// What virtual lights or photons bring of a picture's light, which paths then leave out.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct SharedLight {
    /// Bound up to which virtual lights bring the light of an edge between two scatterings.
    pub edge_bound: EdgeBound,
    /// Photons of a pass that share what paths scatter behind their first scattering in a medium (`transport/photon_share.glsl`); 0: none does.
    pub photons: u32,
    /// Radius within which these photons are seen, m.
    pub photon_radius: f32,
}
