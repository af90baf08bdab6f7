//! Settings of bidirectional path tracing.

use super::splats::{sums_within, vertices_within};
use crate::gpu::Caps;
use crate::gpu::shaders::constants::{
    LIGHT_STATES_GROUP_SHIFT, LIGHT_STATES_SHIFT, PATH_SET_STATES, STRATEGY_COMBINED, STRATEGY_CONNECTIONS,
    STRATEGY_EMISSION, STRATEGY_LIGHT_SAMPLES, STRATEGY_SPLATS,
};
use crate::settings::AboveTo;
use crate::transport::PathSet;
use crate::transport::path_set::PATH_SET_LOBES;
use crate::transport::random::SamplerKind;
use crate::walk::RAY_QUOTA;
use crate::{Error, Result};

/// Light subpaths of a pass, at most: their vertices then stay within the buffers of the baseline even where nothing absorbs.
pub(super) const LIGHT_PATHS_MAX: u32 = 1 << 16;
/// Samples of a pass, at most: a wave's least slots hold some pixels of so many.
const SAMPLES_AT_ONCE_MAX: u32 = 16;
/// And as many as are chosen: light subpaths of a pass are walked for all of its samples, whether or not a picture takes them.
const SAMPLES_AT_ONCE: u32 = 8;
/// Vertices that a light subpath leaves on average, at most: each of the first [`CAPPED_BOUNCE`](crate::gpu::shaders::constants::CAPPED_BOUNCE) bounces, and one in
/// 1 - [`SURVIVAL_MAX`](crate::gpu::shaders::constants::SURVIVAL_MAX) more, if nothing absorbs.
const VERTICES_EXPECTED: u64 = 28;
/// Scatterings that are counted at most.
const BOUNCES_MAX: u32 = 4000;
/// Scatterings that light subpaths are followed through at most, so that none is followed for ever between lossless surfaces.
const WALK_BOUNCES_MAX: u32 = 4096;
/// Histories of vertices hold both (`bdpt_vertex.glsl`).
const _: () = assert!(
    WALK_BOUNCES_MAX < 1 << LIGHT_STATES_GROUP_SHIFT
        && SAMPLES_AT_ONCE_MAX <= 1 << (LIGHT_STATES_SHIFT - LIGHT_STATES_GROUP_SHIFT)
        && PATH_SET_STATES + LIGHT_STATES_SHIFT <= u32::BITS
);

/// Ways in which a path is made.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Strategies {
    /// All, weighted by the balance heuristic.
    #[default]
    Combined,
    /// Eye paths that meet the lamp, alone and in full.
    Emission,
    /// Eye paths that sample a light, alone and in full.
    LightSamples,
    /// Eye paths that are joined to light subpaths, alone, each way to join a path in full.
    Connections,
    /// Light subpaths that meet the camera, alone and in full.
    Splats,
}

impl Strategies {
    /// What kernels are specialized by.
    pub(super) fn kind(self) -> u32 {
        match self {
            Self::Combined => STRATEGY_COMBINED,
            Self::Emission => STRATEGY_EMISSION,
            Self::LightSamples => STRATEGY_LIGHT_SAMPLES,
            Self::Connections => STRATEGY_CONNECTIONS,
            Self::Splats => STRATEGY_SPLATS,
        }
    }

    /// Whether eye paths are joined to light subpaths.
    pub(super) fn connects(self) -> bool {
        matches!(self, Self::Combined | Self::Connections)
    }

    /// Whether light subpaths meet the camera.
    pub(super) fn splats(self) -> bool {
        matches!(self, Self::Combined | Self::Splats)
    }
}

crate::settings! {
    /// Settings of bidirectional path tracing.
    pub struct BidirectionalSettings {
        /// Which light paths the picture contains.
        pub path_set: PathSet = PathSet::ALL, in "all | emitted | direct | indirect | bounces=A..B, with lobes=diffuse+glossy+…; or path expressions: LDE, LS+DE, LS+VE, !L.*S.*E …";
        /// Light subpaths for each sample of all pixels; 0 for as many as there are pixels, as far as a pass has room. Changes the noise only.
        pub light_paths: u32 = 0, in 0..=LIGHT_PATHS_MAX, unit "paths per sample";
        /// Samples of each pixel in a pass, whose eye paths are joined to the light subpaths of all of them: small pictures fill the device so. 0 for as many as make 65536
        /// paths, up to 8. Changes the noise only.
        ///
        /// Above 1 the layer `variance` lacks the noise of the vertices that samples of a pass share.
        pub samples_at_once: u32 = 0, in 0..=SAMPLES_AT_ONCE_MAX, unit "samples";
        /// Vertices of light subpaths that each vertex of an eye path is joined to, drawn evenly from all of the pass; changes the noise only.
        pub connections: u32 = 1, in 1..=16, unit "connections";
        /// Owen-scrambled Sobol' points, or independent samples (PCG); changes the noise only.
        pub sampler: SamplerKind = SamplerKind::Sobol;
        /// First bounce at which Russian roulette may end an eye path; changes the noise only.
        pub roulette_start: u32 = 4, in 0..=4096, unit "bounces";
        /// Greatest probability of surviving a round of roulette; changes the noise only.
        pub roulette_cap: f32 = 0.95, in AboveTo(0.0, 0.999), unit "probability";
    }
    unlisted {
        /// Which ways to make a path there are: all, or one alone, to check it; pictures then have only what it finds.
        pub strategies: Strategies = Strategies::Combined;
        /// Seed of the random numbers. A [`View`](crate::techniques::View) gives its own.
        pub seed: u32 = 0;
        /// Also gathers albedo, normal and depth of what is seen first. A [`View`](crate::techniques::View) says whether.
        pub aovs: bool = false;
        /// Scatterings of the light that is shown, at least, beside those of the path set.
        pub least_bounces: u32 = 0, in 0..=BOUNCES_MAX;
        /// And at most; `None` for any number.
        pub most_bounces: Option<u32> = None;
        /// Work of walks, of eye paths and of shadow rays, in loop iterations, after which a submission begins no further place, as
        /// [`WalkOptions::work`](crate::walk::WalkOptions::work); 0 chooses by the kind of device. Never changes the picture.
        pub submission_work: u64 = 0;
        /// Eye paths under way together, at most; 0 chooses by the kind of device. Never changes the picture.
        pub paths_in_flight: u32 = 0;
        /// Loop iterations after which a ray goes on in a later dispatch, at most; 0 for as many as the device's loops allow. Never changes the picture.
        pub ray_quota: u32 = 0;
    }
    check BidirectionalSettings::fits_together;
}

impl BidirectionalSettings {
    fn fits_together(&self) -> Result<()> {
        if self.light_paths.saturating_mul(self.samples_at_once) > LIGHT_PATHS_MAX {
            let cause = format!(
                "for each of {} samples_at_once are more than the {LIGHT_PATHS_MAX} light subpaths that a pass has room for",
                self.samples_at_once
            );
            return Err(Error::setting("light_paths", self.light_paths, cause));
        }
        self.path_set().map(|_| ())
    }

    /// The least and the greatest number of scatterings.
    pub(super) fn bounces(&self) -> [u32; 2] {
        [self.least_bounces, self.most_bounces.unwrap_or(u32::MAX)]
    }

    /// Scatterings of light subpaths before their last vertex, at most.
    pub(super) fn walk_bounces(&self) -> u32 {
        self.most_bounces
            .map_or(WALK_BOUNCES_MAX, |most| most.saturating_sub(1).min(WALK_BOUNCES_MAX))
    }

    /// Whether there are light subpaths: of one vertex at least, and something that is made of them.
    pub(super) fn has_light_paths(&self) -> bool {
        self.most_bounces != Some(0) && (self.strategies.connects() || self.strategies.splats())
    }

    /// Whether eye paths are joined to light subpaths: a joint has a scattering at each of its ends.
    pub(super) fn joins(&self) -> bool {
        self.has_light_paths() && self.strategies.connects() && self.most_bounces.is_none_or(|most| most > 1)
    }

    /// Loop iterations after which a ray goes on in a later dispatch.
    pub(super) fn quota(&self) -> u32 {
        match self.ray_quota {
            0 => RAY_QUOTA,
            wanted => wanted.min(RAY_QUOTA),
        }
    }

    /// Samples of a pass, at most: of small pictures all of them.
    pub(super) fn samples_of_pass(&self) -> u32 {
        match self.samples_at_once {
            0 => SAMPLES_AT_ONCE,
            wanted => wanted,
        }
    }

    /// With no more samples at once than a device has room for the sums of, where light subpaths meet the camera, and where their number is to be chosen, with no more
    /// light subpaths than it has room for the vertices of.
    ///
    /// # Errors
    /// [`Error::LimitExceeded`] where the sums of one sample are too many.
    pub(super) fn within(self, caps: &Caps, size: [u32; 2]) -> Result<Self> {
        let settings = self.within_sums(caps, size)?;
        Ok(settings.with_room_for(vertices_within(caps), size))
    }

    /// For a pilot picture in place of a picture: with as many light subpaths for each of its pixels and samples.
    pub(super) fn of_pilot(self, picture: [u32; 2], pilot: [u32; 2]) -> Self {
        let pixels = |[width, height]: [u32; 2]| u64::from(width) * u64::from(height);
        let [of_picture, of_pilot] = [picture, pilot].map(pixels);
        if of_picture == of_pilot {
            return self;
        }
        let [samples, paths] = self.pass_of(of_picture.min(u32::MAX.into()) as u32);
        let share = (u64::from(paths) * of_pilot).div_ceil(of_picture.max(1));
        Self {
            light_paths: share.clamp(1, paths.into()) as u32,
            samples_at_once: samples,
            ..self
        }
    }

    /// With light subpaths that leave no more vertices than that, where their number is to be chosen.
    fn with_room_for(self, vertices: u64, [width, height]: [u32; 2]) -> Self {
        let [samples, paths] = self.pass_of(width.saturating_mul(height));
        let most = vertices / VERTICES_EXPECTED / u64::from(samples);
        if self.light_paths > 0 || u64::from(paths) <= most {
            return self;
        }
        Self {
            light_paths: most.max(1) as u32,
            samples_at_once: samples,
            ..self
        }
    }

    fn within_sums(self, caps: &Caps, size: [u32; 2]) -> Result<Self> {
        if !self.strategies.splats() {
            return Ok(self);
        }
        let most = sums_within(caps, size)?;
        let [samples, _] = self.pass_of(size[0].saturating_mul(size[1]));
        Ok(Self {
            samples_at_once: if samples > most { most } else { self.samples_at_once },
            ..self
        })
    }

    /// Samples of a pass of a picture of so many pixels, and light subpaths for each of them.
    pub(super) fn pass_of(&self, pixels: u32) -> [u32; 2] {
        let pixels = pixels.clamp(1, LIGHT_PATHS_MAX);
        let samples = match self.samples_at_once {
            0 => (LIGHT_PATHS_MAX / pixels.max(self.light_paths)).clamp(1, SAMPLES_AT_ONCE),
            wanted => wanted,
        };
        let paths = match self.light_paths {
            0 => pixels.min(LIGHT_PATHS_MAX / samples),
            wanted => wanted,
        };
        [samples, paths]
    }

    /// With the light paths of the picture in `path_set`, and their range in the numbers of bounces.
    ///
    /// # Errors
    /// As [`BidirectionalSettings::path_set`].
    pub(super) fn resolved(self) -> Result<Self> {
        let path_set = self.path_set()?;
        Ok(Self {
            path_set,
            least_bounces: path_set.min_bounces(),
            most_bounces: path_set.max_bounces(),
            ..self
        })
    }

    /// Whether the path set, once [`resolved`](BidirectionalSettings::resolved), is more than a range of bounces, so that subpaths carry states.
    pub(super) fn has_states(&self) -> bool {
        let set = &self.path_set;
        let range = PathSet::new(set.min_bounces(), set.max_bounces(), PATH_SET_LOBES);
        range.is_ok_and(|range| range != *set)
    }

    /// The light paths of the picture.
    ///
    /// # Errors
    /// [`Error::Setting`] for a range that is empty, and for an expression that needs too large an automaton beside it.
    pub(super) fn path_set(&self) -> Result<PathSet> {
        if self.most_bounces.is_some_and(|most| most < self.least_bounces) {
            let cause = format!("is less than the least number of bounces, {}", self.least_bounces);
            return Err(Error::setting("most_bounces", self.bounces()[1], cause));
        }
        let range = PathSet::new(self.least_bounces, self.most_bounces, PATH_SET_LOBES)?;
        if range == PathSet::ALL {
            return Ok(self.path_set);
        }
        if self.path_set == PathSet::ALL {
            return Ok(range);
        }
        self.path_set.intersection(&range)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gpu::shaders::constants::{CAPPED_BOUNCE, SURVIVAL_MAX};
    use crate::settings::TypedSettings;

    #[test]
    fn ranges_of_bounces_decide_how_far_light_subpaths_go() {
        let of = |least_bounces, most_bounces| BidirectionalSettings {
            least_bounces,
            most_bounces,
            ..BidirectionalSettings::default()
        };
        assert_eq!(of(0, None).path_set().unwrap(), PathSet::ALL);
        assert_eq!(
            (of(0, None).walk_bounces(), of(0, None).has_light_paths()),
            (4096, true)
        );
        // The last scattering is towards the eye.
        assert_eq!(
            (of(1, Some(1)).walk_bounces(), of(1, Some(1)).has_light_paths()),
            (0, true)
        );
        assert_eq!(of(1, Some(3)).walk_bounces(), 2);
        assert!(!of(0, Some(0)).has_light_paths());
        assert!(of(3, Some(2)).check().unwrap_err().to_string().contains("most_bounces"));
        let alone = BidirectionalSettings {
            strategies: Strategies::LightSamples,
            ..of(0, None)
        };
        assert!(!alone.has_light_paths());
    }

    #[test]
    fn path_sets_and_ranges_of_bounces_are_one_set() {
        let of = |set: &str, least_bounces, most_bounces| {
            let settings = BidirectionalSettings {
                path_set: set.parse().unwrap(),
                least_bounces,
                most_bounces,
                ..BidirectionalSettings::default()
            };
            settings.resolved().unwrap()
        };
        for (set, [least, most], expected, has_states) in [
            ("all", [0, 9], "bounces=0..9", false),
            ("bounces=2..5", [3, 9], "bounces=3..5", false),
            ("LS+VE", [0, 9], "LS{1,8}VE", true),
            ("LDE|LVE", [1, 9], "LDE|LVE", true),
            ("bounces=0..,lobes=diffuse", [0, 9], "bounces=0..9,lobes=diffuse", true),
        ] {
            let resolved = of(set, least, Some(most));
            assert_eq!(resolved.path_set, expected.parse().unwrap(), "{set}");
            assert_eq!(resolved.has_states(), has_states, "{set}");
            // Once more changes nothing.
            assert_eq!(resolved.path_set().unwrap(), resolved.path_set, "{set}");
        }
        assert!(!of("emitted", 0, None).has_light_paths());
        assert!(of("LS+VE", 0, None).joins());
    }

    #[test]
    fn joints_need_light_subpaths_and_two_scatterings() {
        let of = |most_bounces, strategies| BidirectionalSettings {
            most_bounces,
            strategies,
            ..BidirectionalSettings::default()
        };
        for (most, strategies, joins) in [
            (None, Strategies::Combined, true),
            (Some(2), Strategies::Connections, true),
            (Some(1), Strategies::Combined, false),
            (Some(0), Strategies::Combined, false),
            (None, Strategies::Splats, false),
        ] {
            assert_eq!(of(most, strategies).joins(), joins, "{most:?} {strategies:?}");
        }
    }

    #[test]
    fn light_subpaths_are_as_many_as_there_is_room_for_their_vertices() {
        let of = |light_paths| BidirectionalSettings {
            light_paths,
            ..BidirectionalSettings::default()
        };
        let mean = f64::from(CAPPED_BOUNCE) + 1.0 / (1.0 - f64::from(SURVIVAL_MAX));
        assert!((mean - VERTICES_EXPECTED as f64).abs() < 1e-3, "{mean}");
        let pass = |settings: BidirectionalSettings, vertices| {
            settings.check().unwrap();
            settings.with_room_for(vertices, [128, 128]).pass_of(128 * 128)
        };
        assert_eq!(pass(of(0), 65_536 * 28), [4, 16_384]);
        assert_eq!(pass(of(0), 65_536 * 28 - 1), [4, 16_383]);
        assert_eq!(pass(of(0), 21_845), [4, 195]);
        assert_eq!(pass(of(0), 0), [4, 1]);
        // Whoever asks for more may have them.
        assert_eq!(pass(of(9000), 21_845), [4, 9000]);
    }

    #[test]
    fn pilots_have_as_many_light_subpaths_a_pixel_as_the_picture() {
        let of = |light_paths, samples_at_once| BidirectionalSettings {
            light_paths,
            samples_at_once,
            ..BidirectionalSettings::default()
        };
        for (settings, picture, pilot, expected) in [
            (of(0, 0), [128, 128], [128, 128], [4, 16_384]),
            // A pass of a large picture has 65536 for all of its pixels.
            (of(0, 0), [1920, 1080], [170, 96], [1, 516]),
            (of(0, 0), [512, 256], [128, 64], [1, 4096]),
            (of(1000, 2), [1920, 1080], [170, 96], [2, 8]),
            (of(1, 2), [1920, 1080], [2, 2], [2, 1]),
        ] {
            let pilots = settings.of_pilot(picture, pilot);
            pilots.check().unwrap();
            assert_eq!(pilots.pass_of(pilot[0] * pilot[1]), expected, "{picture:?}");
        }
    }

    #[test]
    fn a_pass_has_a_light_subpath_a_pixel_and_sample_up_to_what_buffers_hold() {
        let of = |light_paths, samples_at_once| BidirectionalSettings {
            light_paths,
            samples_at_once,
            ..BidirectionalSettings::default()
        };
        for (settings, pixels, expected) in [
            (of(0, 0), 1, [8, 1]),
            (of(0, 0), 128 * 128, [4, 128 * 128]),
            (of(0, 0), 1 << 20, [1, 1 << 16]),
            (of(3, 0), 640, [8, 3]),
            (of(1 << 14, 0), 640, [4, 1 << 14]),
            (of(0, 2), 1 << 20, [2, 1 << 15]),
        ] {
            settings.check().unwrap();
            assert_eq!(settings.pass_of(pixels), expected, "{settings:?}");
        }
        assert!(of(1 << 15, 4).check().unwrap_err().to_string().contains("light_paths"));
    }
}
