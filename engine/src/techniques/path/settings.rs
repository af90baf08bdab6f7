//! The path tracer's settings.

use crate::settings::AboveTo;
use crate::transport::path_set::PathSet;
use crate::transport::random::SamplerKind;
use crate::walk::{RAY_QUOTA, SLOTS_MAX};

/// By which error samples are shared out among pixels.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Adaptive {
    /// By none: every pixel has as many.
    #[default]
    Off,
    /// The relative error: that of the relative MSE, with its usual offset.
    Relative,
    /// The absolute error.
    Absolute,
}

/// Whether lights are chosen by a tree, for the point that they are to light, or by their power.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum LightTreeUse {
    /// By a tree where more than 16 lights have a place.
    #[default]
    Auto,
    /// By a tree wherever a light has a place.
    On,
    /// By power.
    Off,
}

/// Lights with a place up to which power alone chooses among them.
const FEW_LIGHTS: usize = 16;

impl LightTreeUse {
    /// Whether there is a tree of so many lights that have a place.
    pub fn is_for(self, lights: usize) -> bool {
        match self {
            Self::Auto => lights > FEW_LIGHTS,
            Self::On => lights > 0,
            Self::Off => false,
        }
    }
}

crate::settings! {
    /// Settings of the path tracer.
    pub struct PathTracerSettings {
        /// Which light paths the picture contains.
        pub path_set: PathSet = PathSet::ALL,
            in "all | emitted | direct | indirect | bounces=A..B, with lobes=diffuse+glossy+…; or path expressions: LDE, LS+DE, L[DG]{1,3}E, !L.*S.*E …";
        /// Owen-scrambled Sobol' points or independent samples (PCG); changes the noise only.
        ///
        /// `sobol` stratifies each pair of dimensions by itself, `joint-sobol` the first sixteen together: pixel, lens and the first two bounces.
        pub sampler: SamplerKind = SamplerKind::Sobol;
        /// First bounce at which Russian roulette may end a path; changes the noise only.
        pub roulette_start: u32 = 4, in 0..=4096, unit "bounces";
        /// Greatest probability of surviving a round of roulette; changes the noise only.
        ///
        /// With 1, paths in lossless scenes would never end: they end only by roulette.
        pub roulette_cap: f32 = 0.95, in AboveTo(0.0, 0.999), unit "probability";
        /// Compensates rough metals for scattering among microfacets; changes the picture.
        ///
        /// Off for comparison with single-scattering renderers.
        pub multiple_scattering: bool = true;
        /// Uncorrelated instead of height-correlated Smith masking of microfacets; changes the picture.
        pub separable_masking: bool = false;
        /// Also samples light in media by the angle under which a point of a lamp sees the ray; changes the noise only.
        ///
        /// Of points and spots, and of area lights in scenes where one is smaller than half a mean free path; in homogeneous media and in grids of
        /// densities, on ways that pass a lamp within about two thirds of a mean free path. Media inside solids that refract have none.
        pub equiangular: bool = true;
        /// Chooses lights for the point that they are to light, by a tree of them, instead of by power; changes the noise only.
        ///
        /// `auto` does so where more than 16 lights have a place: emissive triangles, points and spots.
        pub light_tree: LightTreeUse = LightTreeUse::Auto;
        /// After a pilot, more samples for pixels with more noise, relative or absolute, as many in all; changes the noise only.
        ///
        /// The pilot is a quarter of the samples, a power of two of 256 at most; pictures of fewer than 8 samples per pixel have none, and are those without. Every
        /// pixel keeps a quarter of the mean at least. Unbiased: the noise of a pixel is taken from the pilot's samples of other pixels alone. How
        /// many samples were asked for at first decides the pilot.
        pub adaptive: Adaptive = Adaptive::Off;
        /// 0 chooses by the kind of device; never changes the picture.
        pub paths_in_flight: u32 = 0, in 0..=SLOTS_MAX, unit "paths";
        /// Iterations after which a ray is continued in a later dispatch; never changes the picture.
        ///
        /// A traversal makes progress only with a quota above twice the depth of the deepest tree, and must stay below
        /// [`SOFTWARE_LOOP_CAP`](crate::gpu::SOFTWARE_LOOP_CAP).
        pub ray_quota: u32 = RAY_QUOTA, in 128..=60_000, unit "loop iterations";
    }
    unlisted {
        /// Seed of the random numbers. A [`View`](crate::techniques::View) gives its own.
        pub seed: u32 = 0;
        /// Also gathers albedo, normal and depth of what is seen first. A [`View`](crate::techniques::View) says whether.
        pub aovs: bool = false;
        /// Lets new paths take the slots of those that have ended, so that passes are fewer, and samples reach the film pixel by pixel: a picture that is looked at
        /// before it is done lacks its last pixels. Without, as with adaptive samples in any case, each wave of paths ends before the next one begins. Never
        /// changes the picture that is done.
        pub full_waves: bool = false;
        /// Counts what is fetched ([`PathCounters::fetches`](crate::techniques::path::PathCounters::fetches)), by other kernels. Never changes the picture: for measuring.
        pub count_fetches: bool = false;
        /// Work, in loop iterations, after which a submission begins no further place, as [`WalkOptions::work`](crate::walk::WalkOptions::work);
        /// 0 chooses by the kind of device. Never changes the picture.
        pub submission_work: u64 = 0;
    }
}

impl PathTracerSettings {
    /// Whether new paths take the slots of those that have ended. A round of adaptive samples follows from all samples before it.
    pub(super) fn keeps_waves_full(&self) -> bool {
        self.adaptive == Adaptive::Off && self.full_waves
    }

    /// Whether slots have pixels and samples of their own.
    pub(super) fn numbers_samples(&self) -> bool {
        self.adaptive != Adaptive::Off || self.keeps_waves_full()
    }
}
