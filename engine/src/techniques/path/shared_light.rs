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
    /// Where these have planes: the share of their ways that do. No edge is bounded besides.
    pub plane_share: Option<f32>,
}

impl SharedLight {
    /// What paths are told of either, since there is never both.
    pub fn bound_or_plane_share(&self) -> f32 {
        self.plane_share.unwrap_or_else(|| self.edge_bound.value())
    }
}

/// Photons of a pass that share light with paths.
#[derive(Debug, Clone, Copy)]
pub(crate) struct SharingPhotons {
    /// Of a pass; 0: none shares any.
    pub photons: u32,
    /// They have planes, whose light is shared by the flights of these.
    pub have_planes: bool,
}
