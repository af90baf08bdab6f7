//! How wide fixed kernels in media are at first: by what rays meet in a small picture of few photons.
//!
//! The rule is the engine's own. The size of a scene says little of how densely photons collide where it is seen: in endless fog rays may meet most of them within a
//! fiftieth of what its walls measure. Kernels so wide cost time and blur, kernels that a ray meets a few of cost noise. Guarantees: the same for every seed and on any number of
//! threads; it scales with the scene; never wider than without.

use std::sync::Arc;

use super::mapper::sends_photons;
use super::{PhotonMapper, PhotonSettings};
use crate::Result;
use crate::gpu::Gpu;
use crate::scene::Camera;
use crate::transport::GpuScene;

/// Kernels that a ray through media shall meet on average in the first pass: of disks and balls, whose noise is that of the number, and of beams, whose noise is
/// greater for the different angles at which rays pass them.
const EVENTS_WANTED: f64 = 64.0;
const BEAMS_WANTED: f64 = 64.0;
/// Photons of the pilot, at most.
const PILOT_PHOTONS: u32 = 1 << 11;
/// Pixels of the pilot along its longer side.
const PILOT_SIDE: u32 = 16;
/// Pictures of the pilot, at most.
const PILOT_ROUNDS: u32 = 5;
/// A picture is the last one whose kernels are as many as wanted but for this factor.
const PILOT_WITHIN: f64 = 1.15;
/// Share that the first picture has, so that rays do not meet all there is.
const PILOT_SHARE: f64 = 0.25;
const PILOT_SEED: u32 = 0;

/// Share that is left of the automatic radius of kernels in media, in (0, 1]; 1 where nothing is chosen.
///
/// # Errors
/// As [`PhotonMapper::new`] and [`PhotonMapper::step`].
pub(super) fn event_share(
    gpu: &Gpu,
    scene: &Arc<GpuScene>,
    (camera, size): (&Camera, [u32; 2]),
    settings: &PhotonSettings,
) -> Result<f64> {
    let chooses = settings.radius_is_automatic() && settings.needs_photons() && sends_photons(scene);
    if !chooses || scene.extinctions().is_none() {
        return Ok(1.0);
    }
    let own = PhotonSettings {
        photons: settings.photons.min(PILOT_PHOTONS),
        // Neighbours on surfaces say nothing of media.
        neighbors: 0,
        seed: PILOT_SEED,
        aovs: false,
        samples_per_pass: 1,
        // Nor do eye paths behind the map.
        volume_paths: false,
        ..settings.clone()
    };
    let more = f64::from(settings.photons) / f64::from(own.photons);
    let wanted = if settings.stores_ways() {
        BEAMS_WANTED
    } else {
        EVENTS_WANTED
    };
    let mut mapper =
        PhotonMapper::with_event_share(gpu, Arc::clone(scene), (camera, pilot_size(size)), own, PILOT_SHARE)?;
    let mut search = ShareSearch::new(settings.event_dimensions(), wanted);
    for _ in 0..PILOT_ROUNDS {
        mapper.restart_with(PILOT_SEED, search.share)?;
        let before = mapper.counts().beams;
        while mapper.step(1)?.is_some() {}
        let after = mapper.counts().beams;
        let queries = after.queries - before.queries;
        let met = (after.photons - before.photons) as f64 * more / queries.max(1) as f64;
        if !search.goes_on_after(met) {
            break;
        }
    }
    Ok(search.share)
}

/// Pixels of the pilot for a picture of so many.
fn pilot_size(size: [u32; 2]) -> [u32; 2] {
    let longer = size[0].max(size[1]).max(1);
    size.map(|side| {
        (f64::from(side) / f64::from(longer) * f64::from(PILOT_SIDE))
            .round()
            .max(1.0) as u32
    })
}

/// Finds the share under which as many kernels are met as wanted, by the power law through the last two.
struct ShareSearch {
    share: f64,
    wanted: f64,
    /// Kernels that are met go with this power of the share, where they lie evenly.
    dimensions: f64,
    exponent: f64,
    last: Option<[f64; 2]>,
}

impl ShareSearch {
    fn new(dimensions: f64, wanted: f64) -> Self {
        Self {
            share: PILOT_SHARE,
            wanted,
            dimensions,
            exponent: dimensions,
            last: None,
        }
    }

    /// Takes what is met under the share, and chooses the next one; false where it stays.
    fn goes_on_after(&mut self, met: f64) -> bool {
        let off = met / self.wanted;
        if off < PILOT_WITHIN && (self.share >= 1.0 || off > 1.0 / PILOT_WITHIN) {
            return false;
        }
        if let Some([share, before]) = self.last
            && met > 0.0
            && share != self.share
        {
            // Under wide kernels many are met already, under narrow ones only those close by.
            let slope = (met / before).ln() / (self.share / share).ln();
            self.exponent = slope.clamp(0.25 * self.dimensions, 2.0 * self.dimensions);
        }
        self.last = (met > 0.0).then_some([self.share, met]);
        // None at all: twice as wide.
        let factor = if met > 0.0 { off.powf(-1.0 / self.exponent) } else { 2.0 };
        let next = (self.share * factor).min(1.0);
        let moves = next != self.share;
        self.share = next;
        moves
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shares_are_found_whatever_the_law() {
        /// Dimensions of the kernels, and how many are met by the share.
        type Met = (f64, fn(f64) -> f64);
        let laws: [Met; 4] = [
            (2.0, |share| 4000.0 * share * share),
            (1.0, |share| 900.0 * share),
            // Most are met already, under wide kernels.
            (2.0, |share| 60_000.0 * share * share / (0.02 + share * share)),
            (1.0, |share| 5000.0 * share / (0.1 + share)),
        ];
        for (dimensions, met) in laws {
            let mut search = ShareSearch::new(dimensions, 64.0);
            let rounds = (0..PILOT_ROUNDS)
                .take_while(|_| search.goes_on_after(met(search.share)))
                .count();
            let found = met(search.share) / 64.0;
            println!("{dimensions}: {rounds} rounds, {found} times as many as wanted");
            assert!((found.ln()).abs() < 1.3f64.ln(), "{found}");
        }
        // Few, or none: it never grows beyond what it was.
        for most in [0.0, 3.0, 50.0] {
            let mut search = ShareSearch::new(2.0, 64.0);
            let rounds = (0..PILOT_ROUNDS).take_while(|_| search.goes_on_after(most * search.share.powi(2)));
            assert!(rounds.count() < PILOT_ROUNDS as usize);
            assert_eq!(search.share, 1.0);
        }
    }

    #[test]
    fn pilots_have_the_form_of_their_picture() {
        assert_eq!(pilot_size([640, 480]), [16, 12]);
        assert_eq!(pilot_size([1, 4096]), [1, 16]);
        assert_eq!(pilot_size([0, 0]), [1, 1]);
        assert_eq!(pilot_size([8, 8]), [16, 16]);
    }
}
