//! The registry of hard cases: scenes, rays and directions that break naive renderers, each with what is known to be right about it.
//!
//! A case is judged on every subject that it concerns: each technique with each of its samplers, and in media with each of its estimates of them ([`Easel`]), each ray index
//! ([`INDEXES`]) and the scattering functions ([`LOBES`]). What is known is a closed form, a well-conditioned twin of the scene, a search
//! through all triangles, or that an error names its place; never a picture of an earlier run. Verdicts: a case passes, is refused, degrades as
//! [`HardCase::documented`] says and no further, or fails. Both the test suite and `clerestory stability` run this table.
//!
//! # How to add a case
//!
//! A file in `cases/` with a constant `CASE`, and its line in [`all`]. Pictures whose means are judged are
//! [painted in passes](Easel::paint_in_passes). Statistical checks reject a right picture with a probability of [`FALSE_ALARM`] each, for a driver
//! never seen before; seeds are fixed.

mod cases;
#[path = "../../../engine/src/test_chi_square.rs"]
pub mod chi_square;
mod easel;
mod judgement;
mod lobes;
mod page;
#[path = "../../../engine/src/test_random.rs"]
pub mod random;
mod rays;
mod run;
pub mod scenes;
#[cfg(test)]
mod tests;

pub use easel::{Easel, Painted};
pub use judgement::{FALSE_ALARM, Figure, Judgement};
pub use lobes::{LOBES, Lobe};
pub use page::{PAGE, PICTURES, Row, case_section, markdown, promises};
pub use rays::{INDEXES, IndexCase, RaySet, hit_bits, misses, soup_with_rays};
pub use run::{Outcome, Subject, Verdict, judge, subjects};

use clerestory::Result;
use clerestory::scene::Scene;

/// A hard case.
#[derive(Debug, Clone, Copy)]
pub struct HardCase {
    /// Unique name in lower case with hyphens.
    pub name: &'static str,
    /// What breaks in naive code.
    pub breaks: &'static str,
    /// What has to come out instead.
    pub expects: &'static str,
    /// What its picture shows.
    pub picture: fn() -> Result<Scene>,
    /// How techniques degrade and what a user can do about it, for cases where that is so.
    pub documented: Option<&'static str>,
    /// The same of techniques with a bias, where others do not degrade.
    pub documented_bias: Option<&'static str>,
    /// The same of techniques without one whose light comes by walks from the lights, which all pixels of a pass share.
    pub documented_walks: Option<&'static str>,
    /// Has participating media: what a technique offers for them is judged, too.
    pub of_media: bool,
    /// Judges a technique; `None` for what concerns none.
    pub techniques: Option<fn(&Easel<'_>) -> Result<Judgement>>,
    /// What every ray index has to answer as a search through all triangles does.
    pub rays: Option<fn() -> Vec<RaySet>>,
    /// Judges a scattering function in f64.
    pub lobes: Option<fn(&Lobe, &mut Judgement)>,
}

impl HardCase {
    /// How a subject may degrade.
    pub fn documented_of(&self, subject: &Subject) -> Option<&'static str> {
        let of_bias = self.documented_bias.filter(|_| subject.has_bias());
        let of_walks = self
            .documented_walks
            .filter(|_| subject.shares_noise() && !subject.has_bias());
        self.documented.or(of_bias).or(of_walks)
    }

    /// What cases take for the parts that they leave out.
    const BASE: Self = Self {
        name: "",
        breaks: "",
        expects: "",
        picture: || Ok(Scene::default()),
        documented: None,
        documented_bias: None,
        documented_walks: None,
        of_media: false,
        techniques: None,
        rays: None,
        lobes: None,
    };
}

/// All cases, in the order of the page.
pub fn all() -> &'static [HardCase] {
    cases::ALL
}

/// The case of that name.
pub fn by_name(name: &str) -> Option<&'static HardCase> {
    all().iter().find(|case| case.name == name)
}
