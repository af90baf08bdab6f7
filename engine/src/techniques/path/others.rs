//! Light that other means bring to the paths' pictures, so that paths have the rest.

use crate::transport::edge_bound::EdgeBound;

/// Other means, and how far they go.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct OtherMeans {
    /// Up to which they have the light of edges between two scatterings.
    pub edge_bound: EdgeBound,
    /// Photons of a pass that share what paths scatter behind their first scattering in a medium (`transport/photon_share.glsl`); 0: none does.
    pub photons: u32,
    /// Within which these are seen, m.
    pub photon_radius: f32,
}
