//! Settings of ray-bundles.

use crate::transport::PathSet;
use crate::transport::random::SamplerKind;
use crate::{Error, Result};

/// Texels along a side, at least and at most: every device renders as many.
const RASTER_MIN: u32 = 16;
const RASTER_MAX: u32 = 4096;
/// And as many as are chosen.
const CHOSEN: [u32; 2] = [64, 1024];

crate::settings! {
    /// Settings of ray-bundles.
    pub struct RayBundleSettings {
        /// Along a side of the square that the lines of a bundle go through, from 16 on; 0 chooses twice the pixels of the picture's longer side, from 64 to 1,024. More texels have less bias, and take as
        /// much longer as there are more.
        pub raster: u32 = 0, in 0..=RASTER_MAX, unit "texels";
        /// Distance from the plane of a surface, in texels, up to which what the line meets is taken for the surface itself. What rounding makes of a plane is far below the default; 1 leaves out
        /// what is nearer than a texel.
        pub skipped: f32 = 0.015625, in 0.0..=4.0, unit "texels";
        /// Owen-scrambled Sobol' points, or independent samples (PCG); changes the noise only.
        pub sampler: SamplerKind = SamplerKind::Sobol;
        /// Light paths that are shown: all, or those of fewer bounces. Each beyond the first draws a bundle.
        pub path_set: PathSet = PathSet::UP_TO_FOUR_DIFFUSE, in "bounces=A..B,lobes=diffuse, from 0 to 4";
    }
    unlisted {
        /// Seed of the random numbers. A [`View`](crate::techniques::View) gives its own.
        pub seed: u32 = 0;
        /// Parts that rays, sorts and other work of a frame fall in at least. Never changes the picture.
        pub parts: u32 = 1, in 1..=1024;
    }
    check RayBundleSettings::are_sound;
}

impl RayBundleSettings {
    fn are_sound(&self) -> Result<()> {
        if (1..RASTER_MIN).contains(&self.raster) {
            return Err(Error::setting("raster", self.raster, "is neither 0 nor 16 or more"));
        }
        let (set, all) = (&self.path_set, PathSet::UP_TO_FOUR_DIFFUSE);
        let range = PathSet::new(set.min_bounces(), set.max_bounces(), all.lobes()).ok();
        if set.is_empty() || !set.is_subset_of(&all) || range != Some(*set) {
            let cause = "is no range of bounces of bounces=0..4,lobes=diffuse";
            return Err(Error::setting("path_set", set, cause));
        }
        Ok(())
    }

    /// Texels along a side, for a picture of that size.
    pub(super) fn texels(&self, [width, height]: [u32; 2]) -> u32 {
        match self.raster {
            0 => width.max(height).saturating_mul(2).clamp(CHOSEN[0], CHOSEN[1]),
            given => given,
        }
    }

    /// Whether light is shown that is scattered so often.
    pub(super) fn shows(&self, bounces: u32) -> bool {
        self.path_set.min_bounces() <= bounces && bounces <= self.bounces()
    }

    /// Scatterings of the light that is shown, at most.
    pub(super) fn bounces(&self) -> u32 {
        self.path_set.max_bounces().unwrap_or(0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::settings::TypedSettings;

    #[test]
    fn texels_are_as_given_or_twice_the_pixels() {
        let with = |raster| RayBundleSettings {
            raster,
            ..RayBundleSettings::default()
        };
        for (size, texels) in [([7, 3], 64), ([40, 90], 180), ([600, 512], 1024), ([u32::MAX, 1], 1024)] {
            assert_eq!(with(0).texels(size), texels);
            assert_eq!(with(16).texels(size), 16);
        }
        assert!(with(15).check().is_err() && with(4097).check().is_err());
    }

    #[test]
    fn path_sets_are_ranges_of_up_to_four_diffuse_bounces() {
        let with = |text: &str| RayBundleSettings {
            path_set: text.parse().expect("path set"),
            ..RayBundleSettings::default()
        };
        for (text, shown) in [
            ("bounces=0..4,lobes=diffuse", [true, true, true, true, true, false]),
            ("bounces=2..3,lobes=diffuse", [false, false, true, true, false, false]),
            ("bounces=1,lobes=diffuse", [false, true, false, false, false, false]),
            ("emitted", [true, false, false, false, false, false]),
        ] {
            let settings = with(text);
            settings.check().expect(text);
            let found = [0, 1, 2, 3, 4, 5].map(|bounces| settings.shows(bounces));
            assert_eq!(found, shown, "{text}");
        }
        for text in [
            "all",
            "bounces=0..5,lobes=diffuse",
            "direct",
            "bounces=0..2,lobes=diffuse+glossy",
            "none",
        ] {
            let error = with(text).check().expect_err(text).to_string();
            assert!(error.contains("path_set"), "{text}: {error}");
        }
    }
}
