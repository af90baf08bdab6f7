//! What the kernels of one photon map come to: counts, shares, and the lengths of their axes.

use clerestory::Result;
use clerestory::gpu::Gpu;
use clerestory::scene::Scene;
use clerestory::techniques::photon_mapping::PhotonSettings;
use clerestory::techniques::photon_mapping::kernel::{KernelSettings, PhotonRecord};
use glam::Vec3;

use super::cases::mapper;
use crate::timing::median;

/// An axis counts as clamped that near to the greatest length: records are of f32.
const CLAMPED_FROM: f64 = 1.0 - 1e-5;

/// Bounds between the bins of lengths, m.
const BINS: [f64; 11] = [
    0.015_625, 0.0221, 0.031_25, 0.0442, 0.0625, 0.0884, 0.125, 0.177, 0.25, 0.354, 0.5,
];

/// What one map comes to.
pub struct Statistics {
    /// Photons sent out.
    pub emitted: u64,
    /// Hits that were to be stored.
    pub deposits: u64,
    /// Kernels.
    pub stored: u64,
    /// Hits without a kernel, %.
    pub discarded: f64,
    /// Kernels with a clamped axis, %.
    pub clamped: f64,
    /// Kernels about a query.
    pub contributions: f64,
    /// Kernels about a point of the scene.
    pub cover: f64,
    /// Of the longer axes A and the shorter ones B, m.
    pub axes: [Vec<f64>; 2],
}

impl Statistics {
    /// Of a scene's first pass.
    ///
    /// # Errors
    /// Those of scenes and techniques.
    pub fn of(gpu: &Gpu, scene: &Scene, size: [u32; 2], settings: PhotonSettings) -> Result<Self> {
        let mut mapper = mapper(gpu, scene, size, settings)?;
        let kernel = mapper.kernel(0);
        while mapper.step(1)?.is_some() {}
        // What the first pass was made of, traced again.
        let counts = mapper.counts();
        let photons: Vec<PhotonRecord> = mapper.photons(0)?.iter().map(|photon| photon.record).collect();
        let share = |part: u64, whole: u64| 100.0 * part as f64 / whole.max(1) as f64;
        let clamped = photons.iter().filter(|photon| is_clamped(&kernel, photon)).count();
        let lengths = |axis: fn(&PhotonRecord) -> Vec3| photons.iter().map(|p| f64::from(axis(p).length())).collect();
        Ok(Self {
            emitted: counts.photons.emitted,
            deposits: counts.photons.deposits,
            stored: counts.records,
            discarded: share(counts.photons.without_kernel, counts.photons.deposits),
            clamped: share(clamped as u64, counts.records),
            contributions: counts.gather.photons as f64 / counts.gather.queries.max(1) as f64,
            cover: counts.cover,
            axes: [lengths(|p| p.along), lengths(|p| p.across)],
        })
    }
}

fn is_clamped(kernel: &KernelSettings, photon: &PhotonRecord) -> bool {
    let length = f64::from(photon.along.length().max(photon.across.length()));
    length >= kernel.length_max * kernel.unit_length * CLAMPED_FROM
}

/// Shares of lengths in the bins, %, each with its name.
pub fn shares(lengths: &[f64]) -> Vec<(String, f64)> {
    let mut counts = [0_u64; BINS.len() + 1];
    for length in lengths {
        counts[BINS.partition_point(|bound| bound <= length)] += 1;
    }
    let name = |bin: usize| match (bin, BINS.get(bin)) {
        (0, Some(bound)) => format!("below {bound} m"),
        (_, Some(bound)) => format!("… {bound} m"),
        _ => "more".to_owned(),
    };
    let share = |count: u64| 100.0 * count as f64 / lengths.len().max(1) as f64;
    (0..)
        .zip(counts)
        .map(|(bin, count)| (name(bin), share(count)))
        .collect()
}

/// The median; 0 of none.
pub fn middle(lengths: &[f64]) -> f64 {
    if lengths.is_empty() {
        0.0
    } else {
        median(lengths.to_vec())
    }
}

/// The largest difference between two empirical distributions.
pub fn distribution_distance(a: &[f64], b: &[f64]) -> f64 {
    let sorted = |values: &[f64]| {
        let mut values = values.to_vec();
        values.sort_by(f64::total_cmp);
        values
    };
    let (a, b) = (sorted(a), sorted(b));
    let below = |values: &[f64], x: f64| values.partition_point(|v| *v <= x) as f64 / values.len().max(1) as f64;
    let all = a.iter().chain(&b);
    all.map(|x| (below(&a, *x) - below(&b, *x)).abs()).fold(0.0, f64::max)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn distributions_that_do_not_meet_have_distance_one() {
        assert_eq!(distribution_distance(&[1.0, 2.0], &[3.0, 4.0]), 1.0);
        assert_eq!(distribution_distance(&[1.0, 2.0], &[1.0, 2.0]), 0.0);
        assert_eq!(distribution_distance(&[1.0, 3.0], &[2.0, 3.0]), 0.5);
    }

    #[test]
    fn lengths_are_in_bins_whose_shares_are_all() {
        let shares = shares(&[0.01, 0.2, 0.2, 9.0]);
        assert_eq!(shares.iter().map(|bin| bin.1).sum::<f64>(), 100.0);
        let of = |name: &str| shares.iter().find(|bin| bin.0 == name).map(|bin| bin.1);
        assert_eq!(
            [of("below 0.015625 m"), of("… 0.25 m"), of("more")],
            [25.0, 50.0, 25.0].map(Some)
        );
    }
}
