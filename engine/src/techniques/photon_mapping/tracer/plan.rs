//! What photons are traced for, and the counts of it.

use crate::transport::random::SamplerKind;

/// Exact counts of a pass, or of several.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, serde::Serialize)]
#[non_exhaustive]
pub struct PhotonCounts {
    /// Photons emitted.
    pub emitted: u64,
    /// Photons that left the scene.
    pub escaped: u64,
    /// Photons that ended on a surface or in a medium: by roulette, where nothing is scattered, or after the last bounce.
    pub absorbed: u64,
    /// Rays traced.
    pub rays: u64,
    /// Hits that were to be stored.
    pub deposits: u64,
    /// Those that were not, since their footprint is degenerate.
    pub without_kernel: u64,
    /// Collisions with media.
    pub collisions: u64,
    /// Those that were stored.
    pub events: u64,
}

impl std::ops::AddAssign for PhotonCounts {
    fn add_assign(&mut self, other: Self) {
        self.emitted += other.emitted;
        self.escaped += other.escaped;
        self.absorbed += other.absorbed;
        self.rays += other.rays;
        self.deposits += other.deposits;
        self.without_kernel += other.without_kernel;
        self.collisions += other.collisions;
        self.events += other.events;
    }
}

/// What is stored of photons: those scattered at least and at most so often before they land.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(in crate::techniques) struct Stored {
    pub first_bounce: u32,
    pub last_bounce: u32,
}

/// What photons are traced for, and how.
#[derive(Debug, Clone, Copy)]
pub(in crate::techniques) struct PhotonPlan {
    /// Photons of a pass.
    pub photons: u32,
    pub sampler: SamplerKind,
    pub seed: u32,
    /// As [`WalkOptions::work`](crate::walk::WalkOptions::work).
    pub submission_work: u64,
    /// They carry footprints.
    pub follows_footprints: bool,
    /// They know whether they were scattered diffusely.
    pub tells_caustics: bool,
    /// One number of each photon, evenly spread over a pass, decides how far it comes.
    pub even_survival: bool,
    /// Deposits are those of virtual lights: of all surfaces that scatter into more than one direction, with the power that arrives.
    pub stores_lights: bool,
    /// Photons are scattered by diffuse and glossy lobes alone: one specular scattering makes another path set.
    pub only_rough: bool,
    /// They carry how far their light is from their first scattering, and records beside ways in media have it.
    pub carries_light_distance: bool,
    pub stored: Stored,
}
