//! Settings of frames of many lights.

use crate::gpu::shaders::constants::{RESERVOIR_MEMBERS_MAX, VISIBILITY_MAPS, VISIBILITY_NONE, VISIBILITY_RAYS};
use crate::techniques::instant_radiosity::incremental::DIRECTIONS_MAX;
use crate::techniques::instant_radiosity::settings::Bound;
use crate::techniques::photon_mapping::Stored;
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
    /// An imperfect one for each light, which some points of all surfaces are drawn into, with holes filled.
    Imperfect,
}

impl Visibility {
    /// The number by which kernels know it.
    pub(super) const fn kind(self) -> u32 {
        match self {
            Self::None => VISIBILITY_NONE,
            Self::Rays => VISIBILITY_RAYS,
            // Look-ups are the same.
            Self::Maps | Self::Imperfect => VISIBILITY_MAPS,
        }
    }
}

/// Where virtual lights come from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Placement {
    /// Walks from the lights.
    #[default]
    Walks,
    /// Reflective shadow maps of the lights.
    Rsm,
    /// They are kept from frame to frame where their lamps still see them, and a few are placed anew.
    Incremental,
    /// Those of many walks that Metropolis chains choose by what they bring to the picture.
    Metropolis,
}

/// Points that choose texels of reflective shadow maps.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum RsmSequence {
    /// Of the bases 2 and 3.
    #[default]
    Halton,
    /// Their number over all of their tile, and the base 2: a set for each tile, with a shift of its own.
    Hammersley,
    /// Independent ones.
    Random,
}

/// How pixels gather the light of virtual lights.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Gathering {
    /// From each of their tile.
    #[default]
    Lights,
    /// From texels in a disc of each reflective shadow map, weighted by the inverse of their density; without visibility.
    Disc,
    /// So, weighted by the square of their distance from the disc's middle, as published.
    DiscSquared,
    /// From one that is kept of several drawn for each pixel, or of those that neighbours keep.
    Reservoirs,
}

/// Scatterings that a connection adds to those of a walk: at the virtual light, and where it shines on.
const CONNECTED: u32 = 2;
/// Lights that chains choose at most.
const CHOSEN_MAX: u32 = 4096;
/// Lights that a pixel draws at most: loops of software drivers end after some iterations.
const RESERVOIR_CANDIDATES_MAX: u32 = 1024;
/// Tiles along a side at most: windows of filters are as wide, in pixels.
const INTERLEAVE_MAX: u32 = 16;

crate::settings! {
    /// Settings of frames of many lights.
    pub struct ManyLightSettings {
        /// Virtual lights of each frame: as many walks from the lights, each of which leaves one where it first lands on a surface that is no mirror (and, beyond two bounces, where it lands
        /// further on), points on reflective shadow maps, directions of the lamps, or those that chains choose.
        pub lights: u32 = 512, in 1..=1 << 16, unit "lights per frame";
        /// Where they come from: walks; reflective shadow maps of the lights, drawn anew each frame, whose texels are chosen by what they reflect; or, of points and spots alone,
        /// incremental: they are kept from frame to frame, with exact shadow maps of 128 MiB and 256 lights at most, weighted by the directions of the lamp that are nearest to them; or metropolis: chains choose those of many walks that
        /// bring light to the picture, each of which then brings as much.
        ///
        /// Sources: C. Dachsbacher and M. Stamminger, "Reflective Shadow Maps", I3D 2005; S. Laine et al., "Incremental Instant Radiosity for Real-Time Indirect
        /// Illumination", EGSR 2007; B. Segovia, J.-C. Iehl and B. Péroche, "Metropolis Instant Radiosity", Eurographics 2007.
        pub placement: Placement = Placement::Walks;
        /// Kept lights that are placed anew in a frame at most, but for the first one: in place of those that a lamp which has moved no longer sees, or that crowd others.
        pub renewed: u32 = 8, in 1..=DIRECTIONS_MAX, unit "lights per frame";
        /// Of metropolis: walks of a frame, whose virtual lights chains choose from.
        pub pool: u32 = 8192, in 1..=1 << 16, unit "walks per frame";
        /// Of metropolis: proposals for a step of a chain, of which it chooses one by what they bring.
        ///
        /// Source: J. Liu, F. Liang and W. Wong, "The Multiple-Try Method and Local Optimization in Metropolis Sampling", JASA 95, 2000.
        pub tries: u32 = 4, in 1..=16, unit "tries";
        /// Of metropolis: steps of a chain from a light that it chooses to the next; more make lights less alike.
        pub mutations: u32 = 64, in 1..=256, unit "steps";
        /// Of metropolis: pixels at which the power is measured that a chosen light sends to the picture, by a ray each.
        pub power_pixels: u32 = 1024, in 16..=4096, unit "pixels";
        /// Along a side of each view of a light, of which a point light has six; a power of two.
        pub rsm_side: u32 = 64, in 8..=1024, unit "texels";
        /// Points that choose texels of reflective shadow maps; changes the noise only.
        pub rsm_sequence: RsmSequence = RsmSequence::Halton;
        /// Primary virtual lights of a frame that have reflective shadow maps, where a light has an area or surrounds the scene, or there are more lights; else each light has its own.
        pub emitters: u32 = 4, in 1..=64, unit "lights";
        /// How pixels gather: from virtual lights, or from texels in a disc of each view of a light, about where that shows the pixel's point, which brings light through everything and
        /// leaves out what is beyond the disc; or from reservoirs, with one ray: of some lights drawn for each pixel one is kept by what it would bring, and of those that a pixel and its
        /// neighbours keep one is taken, without tiles or filter.
        ///
        /// Sources: C. Dachsbacher and M. Stamminger, "Reflective Shadow Maps", I3D 2005; B. Bitterli et al., "Spatiotemporal reservoir resampling for real-time ray
        /// tracing with dynamic direct lighting", SIGGRAPH 2020.
        pub gathering: Gathering = Gathering::Lights;
        /// Samples of a disc.
        pub disc_samples: u32 = 400, in 1..=4096, unit "texels";
        /// Radius of discs over the width of a view.
        pub disc_radius: f32 = 0.3, in 0.0..=2.0;
        /// Of reservoirs: lights that are drawn for each pixel, from as many even parts of all.
        pub candidates: u32 = 16, in 1..=RESERVOIR_CANDIDATES_MAX, unit "lights";
        /// Of reservoirs: neighbouring pixels that are asked for what they keep, of which those on the same surface count, as `filter_plane` and `filter_normal` say.
        pub neighbours: u32 = 3, in 0..=RESERVOIR_MEMBERS_MAX - 1, unit "pixels";
        /// Of reservoirs: how far neighbours are away along each axis, at most.
        pub neighbour_reach: f32 = 8.0, in 1.0..=64.0, unit "pixels";
        /// What tells whether a point sees a virtual light: a shadow ray, a shadow map of each light, an imperfect one of points of the surfaces, or nothing.
        ///
        /// Of nothing pictures are too bright; maps err at borders of shadows, imperfect ones also by what their points miss.
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
        /// Blends the indirect light of a frame with that of the frame before where this showed the same surface: the greatest share of the latter, 0 for no history. Shares of 0.9 to 0.97 suit
        /// frames that are shown one by one; a picture that is the mean of many gains nothing.
        ///
        /// Source: C. Sun, "Many-Light Real-Time Global Illumination using Sparse Voxel Octree", 2015, §2.2.4.
        pub history: f32 = 0.0, in 0.0..=0.99;
        /// By how much the share of the frame before falls with the distance of a point from what stands for it there, over the diagonal of the scene.
        pub history_position: f32 = 10.0, in 0.0..=1e6;
        /// By how much it falls with one minus the cosine of the angle between normals.
        pub history_normal: f32 = 4.0, in 0.0..=1e6;
        /// By how much it falls with the third power of the change of luminance over what it was, in means over as many pixels as a filter has.
        pub history_light: f32 = 4.0, in 0.0..=1e6;
        /// Indirect light enters a history up to so many times as bright as its neighbours, or as what was there; 0 bounds nothing.
        pub history_bound: f32 = 8.0, in 0.0..=1e6;
        /// Bound of the geometry term between a virtual light and what it lights: none, of the term as a whole, or of the squared distance.
        pub bound: Bound = Bound::Geometry;
        /// The bound: the greatest geometry term, 1/m², or the least squared distance, m²; 0 chooses by the surfaces' area and the walks.
        pub bound_value: f32 = 0.0, in 0.0.., unit "1/m² or m²";
        /// Along a side of the shadow map of a virtual light, an octahedron of directions of which one half sees something.
        pub map_side: u32 = 64, in 8..=1024, unit "texels";
        /// Points of the surfaces in an imperfect shadow map.
        ///
        /// Source: T. Ritschel et al., "Imperfect Shadow Maps for Efficient Computation of Indirect Illumination", SIGGRAPH Asia 2008.
        pub map_points: u32 = 4096, in 64..=1 << 16, unit "points";
        /// Coarser levels that holes of an imperfect shadow map are filled from, each twice as far about a hole as the one before; as many as have whole texels.
        pub map_fill: u32 = 2, in 0..=6, unit "levels";
        /// Owen-scrambled Sobol' points, or independent samples (PCG); changes the noise only.
        pub sampler: SamplerKind = SamplerKind::Sobol;
        /// Light paths that are shown, by the number of their bounces. Beyond two virtual lights come from walks (placement walks or metropolis) that go on, and leave one at each
        /// landing.
        pub path_set: PathSet = PathSet::UP_TO_TWO_ROUGH, in "bounces=A..B,lobes=diffuse+glossy";
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
    check ManyLightSettings::are_sound;
}

impl ManyLightSettings {
    fn are_sound(&self) -> Result<()> {
        let (set, all) = (&self.path_set, PathSet::ROUGH);
        let range = PathSet::new(set.min_bounces(), set.max_bounces(), all.lobes()).ok();
        if set.is_empty() || !set.is_subset_of(&all) || range != Some(*set) {
            let cause = "is no range of bounces of lobes=diffuse+glossy";
            return Err(Error::setting("path_set", set, cause));
        }
        if self.has_further_bounces() && !matches!(self.placement, Placement::Walks | Placement::Metropolis) {
            let cause = "needs virtual lights of walks beyond two bounces: placement = \"walks\" or \"metropolis\"";
            return Err(Error::setting("path_set", set, cause));
        }
        if self.has_discs() && self.placement != Placement::Rsm {
            let cause = "needs reflective shadow maps: placement = \"rsm\"";
            return Err(Error::setting("gathering", format!("{:?}", self.gathering), cause));
        }
        if self.gathering == Gathering::Reservoirs && !matches!(self.visibility, Visibility::None | Visibility::Rays) {
            let cause = "has no part in reservoirs, which ask with one ray a pixel: visibility = \"rays\"";
            return Err(Error::setting("visibility", format!("{:?}", self.visibility), cause));
        }
        if self.placement == Placement::Incremental && self.lights > DIRECTIONS_MAX {
            let cause = format!("are more than the {DIRECTIONS_MAX} that placement = \"incremental\" keeps");
            return Err(Error::setting("lights", self.lights, cause));
        }
        if self.placement == Placement::Metropolis && self.lights > CHOSEN_MAX {
            let cause = format!("are more than the {CHOSEN_MAX} that placement = \"metropolis\" measures");
            return Err(Error::setting("lights", self.lights, cause));
        }
        if self.has_history() && self.gathering != Gathering::Lights {
            let cause = "needs the light of virtual lights: gathering = \"lights\"";
            return Err(Error::setting("history", self.history, cause));
        }
        if !self.rsm_side.is_power_of_two() {
            return Err(Error::setting("rsm_side", self.rsm_side, "is no power of two"));
        }
        Ok(())
    }

    /// Whether light is shown that virtual lights bring.
    pub(super) fn shows_virtual_lights(&self) -> bool {
        self.path_set.max_bounces().is_none_or(|most| most >= CONNECTED)
    }

    /// Whether light is shown that takes walks which go on from where they first land.
    pub(super) fn has_further_bounces(&self) -> bool {
        self.path_set.max_bounces().is_none_or(|most| most > CONNECTED)
    }

    /// The virtual lights of walks that bring what is shown, by how often they have been scattered.
    pub(super) fn stored(&self) -> Stored {
        Stored {
            first_bounce: self.path_set.min_bounces().saturating_sub(CONNECTED),
            last_bounce: self
                .path_set
                .max_bounces()
                .map_or(u32::MAX, |most| most.saturating_sub(CONNECTED)),
        }
    }

    /// Whether light is shown that is scattered so often.
    pub(super) fn shows(&self, bounces: u32) -> bool {
        self.path_set.min_bounces() <= bounces && self.path_set.max_bounces().is_none_or(|most| bounces <= most)
    }

    /// Whether pixels gather from reflective shadow maps.
    pub(super) fn has_discs(&self) -> bool {
        matches!(self.gathering, Gathering::Disc | Gathering::DiscSquared)
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
        self.gathering == Gathering::Lights && self.filter && self.interleave > 1
    }

    /// Whether pixels ask which others see the same surface.
    pub(super) fn has_neighbours(&self) -> bool {
        self.filters() || self.gathering == Gathering::Reservoirs && self.neighbours > 0
    }

    /// Whether light is blended with that of the frame before.
    pub(super) fn has_history(&self) -> bool {
        self.history > 0.0
    }

    /// Whether surfaces' colours are kept, by which light is divided before it is mixed.
    pub(super) fn keeps_colors(&self) -> bool {
        self.filters() || self.has_history()
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
    fn path_sets_are_ranges_of_bounces() {
        let with = |text: &str| ManyLightSettings {
            path_set: text.parse().expect("path set"),
            ..ManyLightSettings::default()
        };
        for (text, shown) in [
            ("bounces=0..2,lobes=diffuse+glossy", [true, true, true, false]),
            ("bounces=2,lobes=diffuse+glossy", [false, false, true, false]),
            ("bounces=0..1,lobes=diffuse+glossy", [true, true, false, false]),
            ("emitted", [true, false, false, false]),
            ("bounces=1..3,lobes=diffuse+glossy", [false, true, true, true]),
            ("bounces=3..,lobes=diffuse+glossy", [false, false, false, true]),
        ] {
            let settings = with(text);
            settings.check().expect(text);
            assert_eq!([0, 1, 2, 3].map(|bounces| settings.shows(bounces)), shown, "{text}");
        }
        for text in ["all", "direct", "bounces=0..2,lobes=diffuse", "none"] {
            let error = with(text).check().expect_err(text).to_string();
            assert!(error.contains("path_set"), "{text}: {error}");
        }
    }

    #[test]
    fn walks_store_what_two_scatterings_more_bring() {
        let stored = |text: &str, placement| {
            let settings = ManyLightSettings {
                path_set: text.parse().expect("path set"),
                placement,
                ..ManyLightSettings::default()
            };
            settings.check().map(|()| {
                let stored = settings.stored();
                (settings.shows_virtual_lights(), stored.first_bounce, stored.last_bounce)
            })
        };
        for (text, expected) in [
            ("bounces=0..2,lobes=diffuse+glossy", (true, 0, 0)),
            ("bounces=0..5,lobes=diffuse+glossy", (true, 0, 3)),
            ("bounces=3..4,lobes=diffuse+glossy", (true, 1, 2)),
            ("bounces=1..,lobes=diffuse+glossy", (true, 0, u32::MAX)),
            ("bounces=0..1,lobes=diffuse+glossy", (false, 0, 0)),
        ] {
            for placement in [Placement::Walks, Placement::Metropolis] {
                assert_eq!(stored(text, placement).expect(text), expected, "{text}");
            }
        }
        for placement in [Placement::Rsm, Placement::Incremental] {
            let error = stored("bounces=0..3,lobes=diffuse+glossy", placement).expect_err("no walks");
            assert!(error.to_string().contains("needs virtual lights of walks"), "{error}");
            stored("bounces=0..2,lobes=diffuse+glossy", placement).expect("two bounces");
        }
    }
}
