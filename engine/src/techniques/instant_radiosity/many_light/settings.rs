//! Settings of frames of many lights.

use crate::gpu::shaders::constants::{VISIBILITY_MAPS, VISIBILITY_NONE, VISIBILITY_RAYS};
use crate::techniques::instant_radiosity::settings::Bound;
use crate::transport::PathSet;
use crate::transport::edge_bound::EdgeBound;
use crate::transport::random::SamplerKind;
use crate::{Error, Result};

/// What tells whether a point sees a virtual light.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Visibility {
    /// Nothing: light goes through everything.
    None,
    /// A shadow ray for each pair.
    #[default]
    Rays,
    /// A shadow map for each light, which all triangles are drawn into.
    Maps,
}

impl Visibility {
    /// The number by which kernels know it.
    pub(super) const fn kind(self) -> u32 {
        match self {
            Self::None => VISIBILITY_NONE,
            Self::Rays => VISIBILITY_RAYS,
            Self::Maps => VISIBILITY_MAPS,
        }
    }
}

/// Tiles along a side at most: windows of filters are as wide, in pixels.
const INTERLEAVE_MAX: u32 = 16;

crate::settings! {
    /// Settings of frames of many lights.
    pub struct ManyLightSettings {
        /// Walks from the lights for each frame, each of which leaves a virtual light where it first lands on a surface that is no mirror.
        pub lights: u32 = 512, in 1..=1 << 16, unit "walks per frame";
        /// What tells whether a point sees a virtual light: a shadow ray, a shadow map of each light, or nothing.
        ///
        /// Of nothing pictures are too bright; maps err at borders of shadows.
        pub visibility: Visibility = Visibility::Rays;
        /// Splits pictures into so many tiles along each side, each with another part of the virtual lights; 1 has all lights at all pixels. Changes the noise only.
        ///
        /// Source: A. Keller and W. Heidrich, "Interleaved Sampling", EGWR 2001.
        pub interleave: u32 = 4, in 1..=INTERLEAVE_MAX, unit "tiles";
        /// Averages the light of neighbouring pixels on the same surface, of as many as there are tiles.
        ///
        /// Source: S. Laine et al., "Incremental Instant Radiosity for Real-Time Indirect Illumination", EGSR 2007.
        pub filter: bool = true;
        /// Distance from a pixel's tangent plane up to which a neighbour counts as being on the same surface, over the diagonal of the scene.
        pub filter_plane: f32 = 0.01, in 0.0..=1.0;
        /// Cosine of the angle between normals above which it does.
        pub filter_normal: f32 = 0.9, in -1.0..=1.0;
        /// Bound of the geometry term between a virtual light and what it lights: none, of the term as a whole, or of the squared distance.
        pub bound: Bound = Bound::Geometry;
        /// The bound: the greatest geometry term, 1/m², or the least squared distance, m²; 0 chooses by the surfaces' area and the walks.
        pub bound_value: f32 = 0.0, in 0.0.., unit "1/m² or m²";
        /// Along a side of the shadow map of a virtual light, an octahedron of directions of which one half sees something.
        pub map_side: u32 = 64, in 8..=1024, unit "texels";
        /// Owen-scrambled Sobol' points, or independent samples (PCG); changes the noise only.
        pub sampler: SamplerKind = SamplerKind::Sobol;
        /// Light paths that are shown: all, or those of fewer bounces.
        pub path_set: PathSet = PathSet::UP_TO_TWO_ROUGH, in "bounces=A..B,lobes=diffuse+glossy, from 0 to 2";
    }
    unlisted {
        /// Seed of the random numbers. A [`View`](crate::techniques::View) gives its own.
        pub seed: u32 = 0;
        /// Gives each tile all lights: the picture, before a filter, is that without tiles to the bit, at the cost of it.
        pub whole_sets: bool = false;
        /// Work of walks, as [`WalkOptions::work`](crate::walk::WalkOptions::work); 0 chooses by the kind of device. Never changes the picture.
        pub submission_work: u64 = 0;
        /// Virtual lights that a pixel takes in one dispatch, at most; 0 for as many as the device's loops allow. Never changes the picture.
        pub lights_at_once: u32 = 0;
        /// Virtual lights whose shadow maps are there at the same time, at most; 0 chooses by their size. Never changes the picture.
        pub maps_at_once: u32 = 0;
    }
    check ManyLightSettings::shows_bounces_up_to_two;
}

impl ManyLightSettings {
    fn shows_bounces_up_to_two(&self) -> Result<()> {
        let (set, all) = (&self.path_set, PathSet::UP_TO_TWO_ROUGH);
        let range = PathSet::new(set.min_bounces(), set.max_bounces(), all.lobes()).ok();
        if set.is_empty() || !set.is_subset_of(&all) || range != Some(*set) {
            let cause = "is no range of bounces of bounces=0..2,lobes=diffuse+glossy";
            return Err(Error::setting("path_set", set, cause));
        }
        Ok(())
    }

    /// Whether light is shown that is scattered so often.
    pub(super) fn shows(&self, bounces: u32) -> bool {
        self.path_set.min_bounces() <= bounces && self.path_set.max_bounces().is_none_or(|most| bounces <= most)
    }

    /// Parts that the lights fall in.
    pub(super) fn subsets(&self) -> u32 {
        if self.whole_sets {
            1
        } else {
            self.interleave * self.interleave
        }
    }

    /// Whether there is anything to average.
    pub(super) fn filters(&self) -> bool {
        self.filter && self.interleave > 1
    }

    /// The bound, for surfaces of that area, m².
    pub(super) fn edge_bound(&self, area: f64) -> EdgeBound {
        self.bound.of_lights(self.bound_value, area, self.lights)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::settings::TypedSettings;

    #[test]
    fn path_sets_are_ranges_of_up_to_two_bounces() {
        let with = |text: &str| ManyLightSettings {
            path_set: text.parse().expect("path set"),
            ..ManyLightSettings::default()
        };
        for (text, shown) in [
            ("bounces=0..2,lobes=diffuse+glossy", [true, true, true, false]),
            ("bounces=2,lobes=diffuse+glossy", [false, false, true, false]),
            ("bounces=0..1,lobes=diffuse+glossy", [true, true, false, false]),
            ("emitted", [true, false, false, false]),
        ] {
            let settings = with(text);
            settings.check().expect(text);
            assert_eq!([0, 1, 2, 3].map(|bounces| settings.shows(bounces)), shown, "{text}");
        }
        for text in [
            "all",
            "bounces=0..3,lobes=diffuse+glossy",
            "direct",
            "bounces=0..2,lobes=diffuse",
            "none",
        ] {
            let error = with(text).check().expect_err(text).to_string();
            assert!(error.contains("path_set"), "{text}: {error}");
        }
    }
}
