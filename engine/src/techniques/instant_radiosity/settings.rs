//! Settings of virtual point lights, and the path sets of their two parts.

use crate::gpu::shaders::constants::{CUT_CANDIDATES_MAX, LIGHT_CUT_MAX, SELECT_ALL, SELECT_CUTS, SELECT_POTENTIAL};
use crate::techniques::path::SAMPLES_PER_WAVE;
use crate::transport::PathSet;
use crate::transport::edge_bound::EdgeBound;
use crate::transport::path_set::{PATH_SET_LOBES, PATH_SET_UNBOUNDED};
use crate::transport::random::SamplerKind;
use crate::{Error, Result};

/// What eye paths have where virtual lights bring all that is reflected more than once.
const DIRECT: &str = "L[DG]?S*E";
/// The same where there are media, in which no virtual light has what a mirror sends: paths go on from there through mirrors alone, up to the next scattering, where virtual
/// lights bring what is scattered once more before.
const DIRECT_IN_MEDIA: &str = "L[DG]?S*E|LS*([DGV]S+)*VS*E";
/// A path set's range has twelve bits for each of its ends.
const BOUNCES_MAX: u32 = PATH_SET_UNBOUNDED - 1;

/// How the geometry term between a virtual light and a point that it lights is bounded.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Bound {
    /// Not at all: unbiased, with spikes about each light.
    None,
    /// min(G, b).
    #[default]
    Geometry,
    /// cos cos / max(d², B).
    Distance,
}

impl Bound {
    /// With that value, or for 0 the square of the distance of neighbouring walks, or one over it, if so many ended evenly spread over an area, m².
    pub(super) fn of_lights(self, value: f32, area: f64, walks: u32) -> EdgeBound {
        let apart = area / f64::from(walks);
        // A scene without surfaces has no edges.
        let apart = if apart > 0.0 { apart } else { 1.0 };
        let or = |automatic: f64| match f64::from(value) {
            0.0 => automatic,
            set => set,
        };
        match self {
            Self::None => EdgeBound::Unbounded,
            Self::Geometry => EdgeBound::Geometry(or(1.0 / apart)),
            Self::Distance => EdgeBound::Distance(or(apart)),
        }
    }
}

/// What brings the light that a bound leaves out.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Compensation {
    /// Nothing: corners are too dark.
    None,
    /// Eye paths that go on, weighted by what is left out, until the weight is zero: unbiased.
    #[default]
    Rays,
}

/// Which virtual lights send a place shadow rays.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Selection {
    /// All of them.
    #[default]
    All = SELECT_ALL as isize,
    /// The strongest, by what they would bring if nothing stood between, that carry a share of the sum: biased.
    Potential = SELECT_POTENTIAL as isize,
    /// One below each node of a cut through a tree of them, over its probability: unbiased, in time that hardly grows with their number.
    Cuts = SELECT_CUTS as isize,
}

crate::settings! {
    /// Settings of virtual point lights.
    pub struct VirtualLightSettings {
        /// Walks from the lights for each pass, which leave a virtual light wherever they are scattered; more walks give less noise and proportionally more shadow rays.
        ///
        /// A pass whose virtual lights, 64 bytes each, do not fit into a buffer of the device ends with an error.
        pub walks: u32 = 64, in 1..=1 << 20, unit "walks per pass";
        /// Bound of the geometry term between a virtual light and what it lights: none, of the term as a whole, or of the squared distance.
        ///
        /// Without compensation each bound loses other light near edges and corners; with it, it changes the noise only.
        pub bound: Bound = Bound::Geometry;
        /// The bound: the greatest geometry term, 1/m², or the least squared distance, m²; 0 chooses by the surfaces' area and the walks.
        ///
        /// 0 stands for the square of the distance of neighbouring walks if they ended evenly spread: r² = area / walks, B = r², b = 1/r².
        pub bound_value: f32 = 0.0, in 0.0.., unit "1/m² or m²";
        /// Brings what a bound leaves out by eye paths that go on, or leaves it out.
        ///
        /// Source: T. Kollig and A. Keller, "Illumination in the Presence of Weak Singularities", MCQMC 2004, 2006.
        pub compensation: Compensation = Compensation::Rays;
        /// Scatterings of eye paths that go on for the compensation, at most, which leaves a part of the light out; 0 goes on until the weight is zero.
        ///
        /// 0 alone in scenes with participating media.
        pub compensation_steps: u32 = 0, in 0..=8, unit "scatterings";
        /// Which virtual lights send a place shadow rays: all, the strongest, or by chance one below each node of a cut through a tree of them.
        ///
        /// All and cuts have the same expected picture; the strongest alone bias it, as `rescales` says. Scenes with participating media have all alone.
        pub selection: Selection = Selection::All;
        /// Of `selection` potential: the share of what all lights would bring if nothing stood between that those taken carry.
        pub potential_share: f32 = 0.9, in 0.0..=1.0, unit "of the potential";
        /// Of `selection` potential: multiplies what the lights taken bring by what all would bring over what they would, as if the others were seen as often.
        ///
        /// Without it pictures are too dark by the others' light; with it a few hundredths too bright, since weak lights are seen less often. The source calls it a
        /// compensation.
        pub rescales: bool = true;
        /// Of `selection` cuts: nodes of a place's cut, and so shadow rays at most; more give less noise.
        ///
        /// Source: C. Yuksel, "Stochastic Lightcuts", HPG 2019.
        pub cut_size: u32 = 16, in 1..=LIGHT_CUT_MAX, unit "nodes";
        /// Of `selection` cuts: lights that are drawn below each node, of which one is kept by what they would bring if nothing stood between; more give less noise
        /// for a shadow ray, and take as many looks at surfaces.
        ///
        /// Source: J. Talbot, D. Cline and P. Egbert, "Importance Resampling for Global Illumination", EGSR 2005.
        pub candidates: u32 = 1, in 1..=CUT_CANDIDATES_MAX, unit "lights";
        /// Ends walks by one number each, evenly spread over a pass, so that as many survive each scattering as albedos say, instead of by a
        /// roulette at each; changes the noise only.
        ///
        /// Not in scenes with participating media. Source: A. Keller, "Instant Radiosity", SIGGRAPH 1997, whose walks are fractional powers of the albedo times their number.
        pub fractional: bool = false;
        /// Eye paths per pixel that the same virtual lights light.
        ///
        /// Above 1 the layer `variance` lacks the noise of the virtual lights, which the samples of a pass share.
        pub samples_per_pass: u32 = 1, in 1..=SAMPLES_PER_WAVE, unit "samples";
        /// Owen-scrambled Sobol' points, or independent samples (PCG); changes the noise only.
        pub sampler: SamplerKind = SamplerKind::Sobol;
    }
    unlisted {
        /// Seed of the random numbers. A [`View`](crate::techniques::View) gives its own.
        pub seed: u32 = 0;
        /// Also gathers albedo, normal and depth of what is seen first. A [`View`](crate::techniques::View) says whether.
        pub aovs: bool = false;
        /// Scatterings of the light that is shown, at least.
        pub least_bounces: u32 = 0, in 0..=BOUNCES_MAX;
        /// And at most; 0 for any number.
        pub most_bounces: u32 = 0, in 0..=BOUNCES_MAX;
        /// Work of walks, of eye paths and of shadow rays, in loop iterations, after which a submission begins no further place, as
        /// [`WalkOptions::work`](crate::walk::WalkOptions::work); 0 chooses by the kind of device. Never changes the picture.
        pub submission_work: u64 = 0;
        /// Virtual lights that a place takes in one dispatch, at most; 0 for as many as the device's loops allow. Never changes the picture.
        pub lights_at_once: u32 = 0;
    }
    check VirtualLightSettings::has_a_range;
}

impl VirtualLightSettings {
    fn has_a_range(&self) -> Result<()> {
        if self.most().is_some_and(|most| most < self.least_bounces) {
            let cause = format!("is less than the least number of bounces, {}", self.least_bounces);
            return Err(Error::setting("most_bounces", self.most_bounces, cause));
        }
        Ok(())
    }

    /// The greatest number of scatterings, if there is one.
    pub(super) fn most(&self) -> Option<u32> {
        (self.most_bounces > 0).then_some(self.most_bounces)
    }

    /// The bound, for surfaces of that area, m².
    pub(super) fn edge_bound(&self, area: f64) -> EdgeBound {
        self.bound.of_lights(self.bound_value, area, self.walks)
    }

    /// Whether eye paths bring what a bound leaves out.
    pub(super) fn compensates(&self) -> bool {
        self.bound != Bound::None && self.compensation == Compensation::Rays
    }

    /// Why the picture is not that of its path set on average, if so.
    pub(super) fn leaves_out(&self) -> Option<&'static str> {
        match (self.bound, self.compensation, self.compensation_steps) {
            (Bound::None, ..) | (_, Compensation::Rays, 0) => None,
            (_, Compensation::Rays, _) => Some("the compensation ends after some scatterings"),
            (_, Compensation::None, _) => Some("the bound is not compensated"),
        }
    }

    /// What becomes of the light of virtual lights that places do not take, if they do not take all or some by chance.
    pub(super) fn passes_over(&self) -> Option<&'static str> {
        match (self.selection, self.rescales) {
            (Selection::Potential, _) if self.potential_share >= 1.0 => None,
            (Selection::Potential, true) => Some("those taken stand for them, as if they were seen as often"),
            (Selection::Potential, false) => Some("they carry too little of the potential"),
            (Selection::All | Selection::Cuts, _) => None,
        }
    }

    /// The light paths of the picture.
    ///
    /// # Errors
    /// [`Error::Setting`] for a range that needs too large an automaton.
    pub(super) fn path_set(&self) -> Result<PathSet> {
        let range = PathSet::new(self.least_bounces, self.most(), PATH_SET_LOBES)?;
        if range == PathSet::ALL {
            return Ok(PathSet::LIT_OFF_NO_MIRROR);
        }
        PathSet::LIT_OFF_NO_MIRROR.intersection(&range)
    }

    /// Refuses what is for scenes without participating media.
    ///
    /// # Errors
    /// [`Error::Setting`].
    pub(super) fn check_in_media(&self) -> Result<()> {
        let refuse = |name: &str, value: &str, instead: &str| {
            let cause = format!("is for scenes without participating media; take {instead}");
            Err(Error::setting(name, value, cause))
        };
        match (self.selection, self.fractional, self.compensation_steps) {
            (Selection::Potential, ..) => refuse("selection", "potential", "\"all\""),
            (Selection::Cuts, ..) => refuse("selection", "cuts", "\"all\""),
            (_, true, _) => refuse("fractional", "true", "false"),
            (_, _, 0) => Ok(()),
            (_, _, steps) => refuse("compensation_steps", &steps.to_string(), "0"),
        }
    }

    /// What eye paths have by themselves, and beyond the bound, in a scene with or without media.
    ///
    /// # Errors
    /// As [`path_set`](Self::path_set).
    pub(super) fn eye_paths(&self, has_media: bool) -> Result<PathSet> {
        let paths: PathSet = match (self.compensates(), self.compensation_steps) {
            (false, _) if has_media => DIRECT_IN_MEDIA.parse()?,
            (false, _) => DIRECT.parse()?,
            (true, 0) => PathSet::LIT_OFF_NO_MIRROR,
            (true, steps) => format!("L[DG]{{0,{}}}S*E", steps + 1).parse()?,
        };
        // The range stays beside the automaton: folded into it, it would end eye paths whose own light is too short for it, but which virtual lights light.
        Ok(paths.in_range(self.least_bounces, self.most()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::settings::TypedSettings;

    #[test]
    fn bounds_choose_themselves_by_area_and_walks() {
        let of = |bound, bound_value, area| {
            let settings = VirtualLightSettings {
                walks: 50,
                bound,
                bound_value,
                ..VirtualLightSettings::default()
            };
            settings.edge_bound(area)
        };
        assert_eq!(of(Bound::None, 3.0, 10.0), EdgeBound::Unbounded);
        assert_eq!(of(Bound::Geometry, 0.0, 10.0), EdgeBound::Geometry(5.0));
        assert_eq!(of(Bound::Distance, 0.0, 10.0), EdgeBound::Distance(0.2));
        assert_eq!(of(Bound::Geometry, 0.5, 10.0), EdgeBound::Geometry(0.5));
        assert_eq!(of(Bound::Distance, 0.0, 0.0), EdgeBound::Distance(1.0));
        // A length's square: a scene that is twice as large has bounds of four times and a quarter.
        assert_eq!(of(Bound::Distance, 0.0, 40.0), EdgeBound::Distance(0.8));
    }

    #[test]
    fn eye_paths_are_part_of_the_picture_and_have_direct_light() {
        let settings = |bound, compensation, compensation_steps| VirtualLightSettings {
            bound,
            compensation,
            compensation_steps,
            ..VirtualLightSettings::default()
        };
        let direct: PathSet = "LE|L[DG]E".parse().unwrap();
        for (settings, all, whole) in [
            (settings(Bound::None, Compensation::Rays, 3), false, true),
            (settings(Bound::Geometry, Compensation::None, 0), false, false),
            (settings(Bound::Distance, Compensation::Rays, 0), true, true),
            (settings(Bound::Geometry, Compensation::Rays, 2), false, false),
        ] {
            let (eye, picture) = (settings.eye_paths(false).unwrap(), settings.path_set().unwrap());
            assert!(eye.is_subset_of(&picture) && direct.is_subset_of(&eye), "{eye}");
            assert_eq!(picture.is_subset_of(&eye), all, "{eye}");
            assert_eq!(settings.leaves_out().is_none(), whole, "{settings:?}");
        }
        // Two steps scatter thrice in all.
        let eye = settings(Bound::Geometry, Compensation::Rays, 2)
            .eye_paths(false)
            .unwrap();
        let contains = |text: &str| text.parse::<PathSet>().unwrap().is_subset_of(&eye);
        assert!(contains("LDGDSE") && !contains("LDDDDE") && !contains("LSDE"));
        let ranged = VirtualLightSettings {
            least_bounces: 3,
            most_bounces: 2,
            ..VirtualLightSettings::default()
        };
        assert!(ranged.check().unwrap_err().to_string().contains("most_bounces"));
    }

    #[test]
    fn eye_paths_in_media_also_have_what_mirrors_send_there() {
        let settings = VirtualLightSettings {
            bound: Bound::None,
            ..VirtualLightSettings::default()
        };
        let (eye, picture) = (settings.eye_paths(true).unwrap(), settings.path_set().unwrap());
        assert!(eye.is_subset_of(&picture), "{eye}");
        let contains = |text: &str| text.parse::<PathSet>().unwrap().is_subset_of(&eye);
        for own in [
            "LE",
            "LSE",
            "LDE",
            "LGSE",
            "LVE",
            "LVSE",
            "LSVE",
            "LDSVE",
            "LVSVE",
            "LDSDSSVSE",
        ] {
            assert!(contains(own), "{own}");
        }
        // Edges between two scatterings are the virtual lights', and light off a mirror to the first rough surface nobody's.
        for others in ["LDDE", "LVDE", "LDVE", "LVVE", "LVDSVE", "LSDE", "LSDSE", "LSDDE"] {
            assert!(!contains(others), "{others}");
        }
        // Those without media have no other paths than before.
        let of_surfaces: PathSet = "L[DG]?S*E".parse().unwrap();
        assert_eq!(settings.eye_paths(false).unwrap(), of_surfaces);
        assert!(settings.check_in_media().is_ok());
        let refused = [
            (
                "selection",
                VirtualLightSettings {
                    selection: Selection::Cuts,
                    ..settings.clone()
                },
            ),
            (
                "fractional",
                VirtualLightSettings {
                    fractional: true,
                    ..settings
                },
            ),
        ];
        for (name, settings) in refused {
            let error = settings.check_in_media().unwrap_err().to_string();
            assert!(error.contains(name) && error.contains("participating media"), "{error}");
        }
    }
}
