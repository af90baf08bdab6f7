//! Light of the paths' pictures that virtual lights or photons bring.

use crate::transport::edge_bound::EdgeBound;

/// What virtual lights or photons bring of a picture's light, which paths then leave out.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct SharedLight {
    /// Bound up to which virtual lights bring the light of an edge between two scatterings.
    pub edge_bound: EdgeBound,
    /// Photons of a pass that share what paths scatter behind their first scattering in a medium (`transport/photon_share.glsl`); 0: none does.
    pub photons: u32,
    /// Radii within which these photons are seen, m.
    pub radii: PhotonRadii,
    /// Where these have planes: the share of their ways that do. No edge is bounded besides.
    pub plane_share: Option<f32>,
}

impl SharedLight {
    /// What paths are told in one place, since there is never more than one of them: the bound, or of photons the share of planes, or the radius of collisions.
    pub fn bound_or_photons(&self) -> f32 {
        match (self.photons, self.plane_share) {
            (_, Some(share)) => share,
            (0, None) => self.edge_bound.value(),
            (_, None) => self.radii.collisions as f32,
        }
    }
}

/// Radii of the kernels of photons in media, m.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct PhotonRadii {
    /// Of beams; of collisions where there are no beams.
    pub beams: f64,
    /// Of collisions, which may stand beside beams.
    pub collisions: f64,
}

/// Photons of a pass that share light with paths.
#[derive(Debug, Clone, Copy)]
pub(crate) struct SharingPhotons {
    /// Of a pass; 0: none shares any.
    pub photons: u32,
    /// They have planes, whose light is shared by the flights of these.
    pub have_planes: bool,
}
