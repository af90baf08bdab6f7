//! Floor 6: techniques. What turns a scene on the device into a picture.
//!
//! [`all`] lists the engine's own. Each says what it needs of a device, which scenes it can model (and refuses the others with the
//! reason), which light paths its picture contains, and whether and how it is biased.
//!
//! There are two kinds with one face, [`Technique`]. *Progressive* ones implement it: bounded steps add whole samples to a film. A [`FrameMethod`] draws one
//! picture per frame, into a command buffer of the engine or of a host; [`Accumulated`] makes a technique of it. Whatever takes a technique takes both.
//!
//! # How to add one
//!
//! `CONTRIBUTING.md` says it in one page, with [`ambient`] as the example: a folder here and one of the same name in `shaders/techniques/`, a test, an
//! experiment, and the module's name in this file's list. In a host there is nothing to list:
//! [`Renderer::start_technique`](crate::render::Renderer::start_technique) takes a [`Card`] as it is.
//!
//! 1. A frame method: a type with pipelines, specialized to [`GpuScene::profile`], that implements [`FrameMethod`]. A progressive technique: a type with settings,
//!    pipelines, working memory and a [`GpuFilm`](crate::film::GpuFilm) that implements [`Technique`]; [`PathTracer`] shows the pattern. What the scene does not
//!    need is left out, and said by `skipped`.
//! 2. A constant [`Card`]. Its [`create`](Card::create) is called once device and scene have been found fit.

mod accumulated;
mod device_needs;
mod foresight;
pub mod frame;
mod skipped;

/// What a [`Technique`] hands on to methods of the same names that the type has of its own, its settings as JSON; within the implementation.
macro_rules! forward_to_methods {
    ($type:ident) => {
        fn step(&mut self, samples: u32) -> $crate::Result<Option<$crate::film::Step>> {
            $type::step(self, samples)
        }

        fn picture(
            &mut self,
        ) -> $crate::Result<(
            $crate::film::picture::Picture,
            $crate::film::picture::NonFiniteSamples,
        )> {
            $type::picture(self)
        }

        fn display(
            &mut self,
            target: &$crate::gpu::Buffer,
            exposure: f32,
            format: $crate::film::PixelFormat,
        ) -> $crate::Result<()> {
            $type::display(self, target, exposure, format)
        }

        fn set_camera(&mut self, camera: &$crate::scene::Camera) -> $crate::Result<()> {
            $type::set_camera(self, camera)
        }

        fn settings(&self) -> serde_json::Value {
            $crate::settings::TypedSettings::to_json($type::settings(self))
        }

        fn pipelines(&self) -> Vec<$crate::gpu::PipelineInfo> {
            $type::pipelines(self)
        }
    };
}

/// Declares the modules of techniques, and [`ALL`] of their cards: each has a constant `CARD`. A `+` stands before the card of a family's further method.
macro_rules! methods {
    ($($module:ident,)* $(+ $family:ident::$card:ident,)*) => {
        $(pub mod $module;)*

        const ALL: &[Card] = &[$($module::CARD,)* $($family::$card,)*];
    };
}

methods! {
    path,
    photon_mapping,
    preview,
    ambient,
    instant_radiosity,
    bidirectional,
    impostors,
    localized_gather,
    ray_bundles,
    + instant_radiosity::MANY_LIGHT,
}

use std::collections::BTreeMap;
use std::sync::Arc;

use crate::catalogue::Row;
use crate::film::picture::{NonFiniteSamples, Picture};
use crate::film::{PixelFormat, Step};
use crate::gpu::interface::ShaderInfo;
use crate::gpu::{Buffer, Caps, Gpu, PipelineInfo};
use crate::scene::{Camera, SceneProfile};
use crate::settings::{Settings, SettingsDecl};
use crate::transport::{GpuScene, PathSet};
use crate::{Error, Result};

pub use crate::catalogue::row::Bias;
pub use device_needs::{Lack, lacks, offers};
pub use foresight::{Foresight, Law};
pub use frame::{Accumulated, Frame, FrameMethod, FrameTarget, Part};
pub use path::{PathTracer, PathTracerSettings};

/// A technique as the catalogue knows it.
pub struct Card {
    /// Name on the command line.
    pub id: &'static str,
    /// One sentence.
    pub summary: &'static str,
    /// Its rows of the [`catalogue`](crate::catalogue), of it and of its parts, a list per file. The first is the technique's own
    /// ([`Role::Technique`](crate::catalogue::Role::Technique)); a host's card may have none.
    pub rows: &'static [&'static [Row]],
    /// Bias.
    pub bias: Bias,
    /// Device features beyond the baseline, by the Vulkan names that [`offers`] knows.
    pub needs: &'static [&'static str],
    /// Kernels that a picture may take, of whatever scene, with default settings, beside those of the film, a list per file; [`lacks`] tells from their interfaces which limits of a device are too
    /// low. The list may be empty: what is missing is then found when a pipeline is made.
    pub kernels: &'static [&'static [&'static ShaderInfo]],
    /// The light paths of its picture with default settings; a setting `path_set` may restrict them to a part.
    pub path_set: PathSet,
    /// Why it cannot model a scene with default settings; empty when it can. Others may take reasons back ([`SettingsDecl::lifting`]).
    pub refusals: fn(&SceneProfile) -> Vec<String>,
    /// Its settings, as [`settings!`](crate::settings!) declares them.
    pub settings: SettingsDecl,
    /// Settings that an automatic choice tries ([`plan`](mod@crate::plan)) where they suit the scene: all of them give the same expected picture. The
    /// first are the defaults.
    pub variants: &'static [Variant],
    /// What pilot pictures do not show of it; [`Foresight::PLAIN`], or [`Foresight::FRAMES`] for a frame method, unless it has more to say.
    pub foresight: Foresight,
    /// Makes the technique. Whoever wants one calls [`Card::prepare`], which looks at device and scene first.
    pub create: Create,
}

/// Settings that may suit one scene better than another.
#[derive(Debug, Clone, Copy)]
pub struct Variant {
    /// What distinguishes them, in a word or two.
    pub name: &'static str,
    /// Settings as JSON; missing ones take their defaults.
    pub settings: fn() -> serde_json::Value,
    /// Whether they are worth a try: not where they give the picture of the defaults to the bit, or are refused.
    pub suits: fn(&SceneProfile) -> bool,
}

/// Makes a technique for a view, with its settings, which [`Settings::read`] makes its own struct.
pub type Create = fn(&Gpu, Arc<GpuScene>, &View<'_>, &Settings) -> Result<Box<dyn Technique>>;

impl Variant {
    /// The defaults.
    pub const DEFAULTS: Self = Self {
        name: "defaults",
        settings: || serde_json::json!({}),
        suits: |_| true,
    };
}

impl std::fmt::Debug for Card {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Card").field("id", &self.id).finish_non_exhaustive()
    }
}

/// What is looked at, and how finely.
#[derive(Debug, Clone)]
pub struct View<'a> {
    /// The camera.
    pub camera: &'a Camera,
    /// Pixels across and down.
    pub size: [u32; 2],
    /// Seed of the random numbers.
    pub seed: u32,
    /// Also gathers albedo, normal and depth.
    pub aovs: bool,
}

/// A technique at work on one view. It refines its picture step by step.
pub trait Technique: Send {
    /// Does a bounded piece of work towards `samples` samples per pixel, whatever the scene; `None` when there is nothing left to do. Whoever calls looks at time and
    /// stop requests between two steps, so that a step is one submission or a few; samples that it leaves under way go on with the next one, and
    /// [`Step::done`] counts them once they are on the film.
    ///
    /// # Errors
    /// [`Error::DeviceLost`], [`Error::OutOfMemory`], [`Error::Overflow`].
    fn step(&mut self, samples: u32) -> Result<Option<Step>>;

    /// The picture so far, and how many samples were left out because they were not finite.
    ///
    /// # Errors
    /// [`Error::DeviceLost`], [`Error::OutOfMemory`].
    fn picture(&mut self) -> Result<(Picture, NonFiniteSamples)>;

    /// Writes the picture so far to a buffer of four bytes per pixel on the device: `exposure` in stops, clipped, sRGB-encoded.
    ///
    /// # Errors
    /// [`Error::Setting`] when the buffer is too small, [`Error::DeviceLost`].
    fn display(&mut self, target: &Buffer, exposure: f32, format: PixelFormat) -> Result<()>;

    /// Begins anew through another camera.
    ///
    /// # Errors
    /// [`Error::Setting`] for a camera that cannot be used, with which nothing changes; [`Error::DeviceLost`].
    fn set_camera(&mut self, camera: &Camera) -> Result<()>;

    /// The light paths of the picture.
    fn path_set(&self) -> PathSet;

    /// The settings in force.
    fn settings(&self) -> serde_json::Value;

    /// Exact counts of work by name since it was made, earlier cameras included.
    fn counters(&self) -> BTreeMap<&'static str, u64>;

    /// The kernels and their specialization.
    fn pipelines(&self) -> Vec<PipelineInfo>;

    /// What was left out, and why.
    fn skipped(&self) -> Vec<Skipped>;
}

/// Something that was not compiled, allocated or recorded.
#[derive(Debug, Clone, PartialEq, Eq, serde::Serialize)]
pub struct Skipped {
    /// What.
    pub what: &'static str,
    /// Why.
    pub why: &'static str,
}

/// Every technique of the engine.
pub fn all() -> &'static [Card] {
    ALL
}

/// The technique of that id.
///
/// # Errors
/// [`Error::Setting`] that lists the ids there are.
pub fn by_id(id: &str) -> Result<&'static Card> {
    all().iter().find(|technique| technique.id == id).ok_or_else(|| {
        let ids: Vec<_> = all().iter().map(|technique| technique.id).collect();
        Error::setting("technique", id, format!("is unknown; there is: {}", ids.join(", ")))
    })
}

/// The reasons that hold: what [`Card::refusals`] returns.
pub fn reasons(all: &[(bool, &str)]) -> Vec<String> {
    let holding = all.iter().filter(|(holds, _)| *holds);
    holding.map(|(_, reason)| (*reason).to_owned()).collect()
}

/// The setting that restricts pictures to a part of the light paths.
const PATH_SET: &str = "path_set";

impl Card {
    /// Prepares the technique for a view, with its settings.
    ///
    /// # Errors
    /// [`Error::MissingFeature`] for a device that lacks one of its needs, [`Error::Unsupported`] with every reason why the scene cannot
    /// be modelled, [`Error::Setting`], [`Error::OutOfMemory`].
    pub fn prepare(
        &self,
        gpu: &Gpu,
        scene: Arc<GpuScene>,
        view: &View<'_>,
        settings: &Settings,
    ) -> Result<Box<dyn Technique>> {
        let settings = self.admit(gpu.caps(), scene.profile(), settings)?;
        (self.create)(gpu, scene, view, &settings)
    }

    /// Refuses what [`Card::prepare`] refuses before anything is made. Returns the settings for [`Card::create`].
    pub(crate) fn admit(&self, caps: &Caps, profile: &SceneProfile, settings: &Settings) -> Result<Settings> {
        device_needs::check(caps, self)?;
        let own = self.without_path_set(settings);
        let mut reasons = (self.refusals)(profile);
        reasons.retain(|reason| !self.settings.lifts(&own, reason));
        reasons.extend(self.path_set_refusal(settings));
        if !reasons.is_empty() {
            return Err(Error::Unsupported {
                technique: self.id.into(),
                reasons,
            });
        }
        self.settings.check_given(&own)?;
        Ok(own)
    }

    /// The light paths of its pictures with these settings, as far as a path set among them can be read.
    pub(crate) fn path_set_with(&self, settings: &Settings) -> PathSet {
        let json = settings.to_json();
        let named = json.get(PATH_SET).and_then(|text| text.as_str()?.parse().ok());
        named.unwrap_or(self.path_set)
    }

    /// Settings without a path set that says no more than the technique's own does, for one that has no such setting.
    fn without_path_set(&self, settings: &Settings) -> Settings {
        let mut json = settings.to_json();
        let named = json.get(PATH_SET).and_then(|text| text.as_str()?.parse().ok());
        if named == Some(self.path_set)
            && !self.settings.has(PATH_SET)
            && let Some(object) = json.as_object_mut()
        {
            object.remove(PATH_SET);
            return json.into();
        }
        settings.clone()
    }

    /// Why the path set in settings cannot be rendered, if it can be read and is not part of the technique's own, or a part to which it cannot be
    /// restricted.
    fn path_set_refusal(&self, settings: &Settings) -> Option<String> {
        let wanted: PathSet = settings.to_json().get(PATH_SET)?.as_str()?.parse().ok()?;
        if !self.settings.has(PATH_SET) && wanted != self.path_set {
            return Some(format!(
                "its pictures contain the paths {} and no others",
                self.path_set
            ));
        }
        let missing = !wanted.is_subset_of(&self.path_set);
        missing.then(|| {
            format!(
                "its pictures contain the paths {}, but {wanted} has others",
                self.path_set
            )
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_setting_is_explained_and_defaults_and_variants_fit() {
        for technique in all() {
            for info in technique.settings.infos() {
                let texts = [&info.meaning, &info.range];
                assert!(texts.iter().all(|text| !text.is_empty()), "{}: {info:?}", technique.id);
            }
            let variants = technique.variants.iter().map(|variant| (variant.settings)());
            for json in variants.chain([technique.settings.defaults()]) {
                technique.settings.check(&json).expect(technique.id);
            }
        }
    }
}
