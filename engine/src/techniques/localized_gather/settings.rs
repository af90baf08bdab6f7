//! Settings of the localised gather, and the light paths of its pictures.

use crate::maps::gather::SolidAngleForm;
use crate::techniques::impostors::{CaptureBy, check_place};
use crate::transport::PathSet;
use crate::transport::random::SamplerKind;
use crate::{Error, Result};

/// How the solid angle of a light is carried from the map's place to a point.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum GatherForm {
    /// By the ratio of squared distances, as published first: without bound close to a light.
    Ratio,
    /// As that of a disc on the axis through the point.
    Disc,
    /// As that of a disc with the surface's own angle to the point.
    #[default]
    DiscWithNormals,
}

impl GatherForm {
    /// As the lights are made.
    pub(super) fn form(self) -> SolidAngleForm {
        match self {
            Self::Ratio => SolidAngleForm::Ratio,
            Self::Disc => SolidAngleForm::Disc,
            Self::DiscWithNormals => SolidAngleForm::DiscWithNormals,
        }
    }
}

/// Which lights the lobe takes that stands for microfacets.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum GatherTerms {
    /// All.
    #[default]
    All,
    /// The five of the greatest reflectivity times solid angle, scaled to the lobe's whole: as published for glossy surfaces.
    Five,
}

crate::settings! {
    /// Settings of [`LocalizedGather`](super::LocalizedGather).
    pub struct LocalizedGatherSettings {
        /// Number of the object that is lit, that of its instance in the scene; null for all surfaces.
        ///
        /// It is left out of the map. Surfaces of other objects have direct light alone then.
        pub object: Option<u32> = None, in "an object's number, or null";
        /// Where the map is seen from, x, y and z; null for the middle of the object, or of the scene.
        ///
        /// Refused are places that are farther outside of the scene's bounds than their diagonal is long.
        pub place: Option<[f32; 3]> = None, in "three finite numbers, or null", unit "m";
        /// Texels along a side of the octahedron of lights, which must divide those of the map; the time of a picture grows with its square.
        ///
        /// Light of a small bright patch wants many: see the results.
        pub lights: u32 = 32, in 2..=64, unit "lights";
        /// How the solid angle of a light is carried from the map's place to a point; changes the picture.
        pub form: GatherForm = GatherForm::DiscWithNormals;
        /// Takes the mean of a cosine lobe over a light's cone instead of the lobe at its middle: no bright spots near walls.
        pub cones: bool = true;
        /// Which lights the lobe takes that stands for microfacets; changes the picture. What is reflected evenly about the normal takes all.
        ///
        /// Five are of use where they hold most of the lobe: 8² lights for exponents about 10. All terms are evaluated to find them.
        pub terms: GatherTerms = GatherTerms::All;
        /// How radiance comes into the map: rasterized, by rays, or by rays where rasterization lacks light of the scene.
        pub capture: CaptureBy = CaptureBy::Auto;
        /// Along a side of the map's octahedron, whose texels the lights are means of.
        pub side: u32 = 128, in 16..=2048, unit "texels";
        /// Scatterings of the light in the map, at most; more than one take a capture by rays.
        pub bounces: u32 = 1, in 1..=8, unit "scatterings";
        /// Along a side of the shadow maps of a rasterized map.
        pub shadow_side: u32 = 1024, in 1..=16_384, unit "texels";
        /// Paths of each texel of a map by rays; more have less noise, which stays in the picture.
        pub capture_samples: u32 = 16, in 1..=65_536, unit "samples";
        /// Owen-scrambled Sobol' points, or independent samples (PCG); changes the noise only.
        pub sampler: SamplerKind = SamplerKind::Sobol;
    }
    unlisted {
        /// Seed of the random numbers. A [`View`](crate::techniques::View) gives its own.
        pub seed: u32 = 0;
        /// Also gathers albedo, normal and depth of what is seen first. A [`View`](crate::techniques::View) says whether.
        pub aovs: bool = false;
    }
    check LocalizedGatherSettings::fit;
}

impl LocalizedGatherSettings {
    fn fit(&self) -> Result<()> {
        check_place(self.place)?;
        if !self.side.is_multiple_of(self.lights) {
            let cause = format!("does not divide the {} texels of the map", self.side);
            return Err(Error::setting("lights", self.lights, cause));
        }
        Ok(())
    }

    /// The light paths of the picture: emission comes by light sampling and what eye paths meet alone, and is not in the map.
    ///
    /// # Errors
    /// None that a range of [`bounces`](Self::bounces) could cause.
    pub(super) fn path_set(&self) -> Result<PathSet> {
        format!("LE|L.E|L.{{1,{}}}[DG]E", self.bounces).parse()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::settings::TypedSettings;

    #[test]
    fn bad_settings_are_refused_by_name() {
        let defaults = LocalizedGatherSettings::default;
        for (settings, words) in [
            (
                LocalizedGatherSettings {
                    lights: 0,
                    ..defaults()
                },
                "setting lights",
            ),
            (
                LocalizedGatherSettings {
                    lights: 65,
                    ..defaults()
                },
                "setting lights",
            ),
            (
                LocalizedGatherSettings {
                    lights: 24,
                    ..defaults()
                },
                "does not divide",
            ),
            (
                LocalizedGatherSettings {
                    bounces: 0,
                    ..defaults()
                },
                "setting bounces",
            ),
            (
                LocalizedGatherSettings {
                    place: Some([0.0, 0.0, f32::NAN]),
                    ..defaults()
                },
                "setting place",
            ),
        ] {
            let error = settings.check().expect_err(words).to_string();
            assert!(error.contains(words), "{error}");
        }
        assert!(defaults().check().is_ok());
    }

    /// Each path of the picture comes by one way alone.
    #[test]
    fn the_map_has_no_path_of_the_eye() {
        let settings = LocalizedGatherSettings::default();
        let all = settings.path_set().unwrap();
        let by_map: PathSet = "L.[DG]E".parse().unwrap();
        assert!(PathSet::UP_TO_DIRECT.intersection(&by_map).unwrap().is_empty());
        assert_eq!(PathSet::UP_TO_DIRECT.union(&by_map).unwrap(), all);
    }
}
