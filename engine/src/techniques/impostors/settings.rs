//! Settings of reflections by distance impostors, and the light paths of their pictures.

use glam::{DVec3, Vec3};

use super::capture::CaptureBy;
use crate::maps::impostor::{ImpostorSettings, ImpostorTexels, MAX_BISECTIONS, MAX_STEPS, SearchMethod};
use crate::transport::PathSet;
use crate::transport::random::SamplerKind;
use crate::{Error, Result};

/// How what a reflected ray meets is found in the map.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ReflectionMethod {
    /// In the ray's own direction, as if all were infinitely far: no distances, so that bodies that absorb are refused.
    Classical,
    /// Where the ray leaves the box about the scene: no distances. Exact in an empty box.
    Box,
    /// Where the surface would be were it perpendicular to the ray.
    Perpendicular,
    /// The step from there to the plane through both guesses: the parallax-corrected single look-up.
    OneStep,
    /// Where the ray leaves the sphere about the map's place through the surface of the last guess.
    FixedPoint,
    /// Secants from the ray's own point. Diverges in corners.
    SecantFromPoint,
    /// Secants from the perpendicular guess.
    SecantFromGuess,
    /// False position from the ray's own point.
    FalsePosition,
    /// False position from the perpendicular guess.
    Mixed,
    /// False position where the map's place sees the ray's point, mixed elsewhere.
    #[default]
    Hybrid,
    /// Even steps to the first crossing, then bisection.
    March,
}

impl ReflectionMethod {
    /// All of them.
    pub const ALL: [Self; 11] = [
        Self::Classical,
        Self::Box,
        Self::Perpendicular,
        Self::OneStep,
        Self::FixedPoint,
        Self::SecantFromPoint,
        Self::SecantFromGuess,
        Self::FalsePosition,
        Self::Mixed,
        Self::Hybrid,
        Self::March,
    ];

    /// The search in distances; `None` where there are none.
    pub fn search(self) -> Option<SearchMethod> {
        Some(match self {
            Self::Classical | Self::Box => return None,
            Self::Perpendicular => SearchMethod::Perpendicular,
            Self::OneStep | Self::SecantFromGuess => SearchMethod::SecantFromGuess,
            Self::FixedPoint => SearchMethod::FixedPoint,
            Self::SecantFromPoint => SearchMethod::SecantFromPoint,
            Self::FalsePosition => SearchMethod::FalsePosition,
            Self::Mixed => SearchMethod::Mixed,
            Self::Hybrid => SearchMethod::Hybrid,
            Self::March => SearchMethod::March,
        })
    }
}

/// Layers of surfaces at most: behind front, back and front again there is little that reflections miss.
const LAYERS_MAX: u32 = 4;

crate::settings! {
    /// Settings of [`ImpostorReflections`](super::ImpostorReflections).
    pub struct ReflectionSettings {
        /// Number of the object whose smooth surfaces reflect, that of its instance in the scene; null for all smooth surfaces.
        ///
        /// It is left out of the map. Smooth surfaces of other objects reflect nothing then.
        pub reflector: Option<u32> = None, in "an object's number, or null";
        /// Where the map is seen from, x, y and z; null for the middle of what reflects.
        ///
        /// From there, reflections close to a body's middle are right whatever the method. Refused are places that are farther outside of the scene's bounds than their diagonal is long.
        pub place: Option<[f32; 3]> = None, in "three finite numbers, or null", unit "m";
        /// How what a reflected ray meets is found in the map; changes the picture.
        pub method: ReflectionMethod = ReflectionMethod::Hybrid;
        /// Steps after the first guess, and intervals of a march; more are nearer to the surface.
        ///
        /// The classical and the perpendicular guess, the box and the one step take none.
        pub steps: u32 = 3, in 0..=MAX_STEPS, unit "look-ups";
        /// Halvings of the interval of a march that holds a crossing.
        pub bisections: u32 = 12, in 0..=MAX_BISECTIONS, unit "look-ups";
        /// Relative distance to the surface below which a place counts as found: a march goes on beyond others, and all methods count them.
        pub tolerance: f32 = 0.02, in crate::settings::AboveTo(0.0, 0.99);
        /// How radiance comes into the map: rasterized, by rays, or by rays where rasterization lacks light of the scene.
        pub capture: CaptureBy = CaptureBy::Auto;
        /// Layers of surfaces, each behind the last one: what is hidden from the map's place shows in reflections by those behind the first.
        ///
        /// More than one take a method that searches distances, best a march, and a capture by rays.
        pub layers: u32 = 1, in 1..=LAYERS_MAX, unit "layers";
        /// What a texel holds beside radiance: its plane, in sixteen bytes, distance and normal in eight, of which each look-up makes the plane, or the distance alone in four.
        ///
        /// Pictures by planes and by normals are the same but for rounding; a look-up of a plane does less than half. With distances alone no normals are captured, and searches are off by up to half a texel.
        pub texels: ImpostorTexels = ImpostorTexels::Planes;
        /// Along a side of the map's octahedron: how sharp reflections are, and how near searches end.
        pub side: u32 = 256, in 16..=2048, unit "texels";
        /// Scatterings of the light in the map, at most; more than one take a capture by rays.
        pub bounces: u32 = 1, in 0..=8, unit "scatterings";
        /// Along a side of the shadow maps of a rasterized map.
        pub shadow_side: u32 = 1024, in 1..=16_384, unit "texels";
        /// Paths of each texel of a map by rays; more have less noise, which stays in the picture.
        pub capture_samples: u32 = 16, in 1..=65_536, unit "samples";
        /// Smooth surfaces that transmit show what lies along the refracted ray, too, past one interface.
        ///
        /// Without it scenes with such surfaces are refused, and with it pictures in which refracted rays meet a second one: most solid bodies. Light paths are the same, with transmission among the specular scatterings. Bodies absorb along refracted rays, and light on its way to what lies within them is not absorbed.
        pub refracts: bool = false;
        /// Owen-scrambled Sobol' points, or independent samples (PCG); changes the noise only.
        pub sampler: SamplerKind = SamplerKind::Sobol;
    }
    unlisted {
        /// Seed of the random numbers. A [`View`](crate::techniques::View) gives its own.
        pub seed: u32 = 0;
        /// Also gathers albedo, normal and depth of what is seen first. A [`View`](crate::techniques::View) says whether.
        pub aovs: bool = false;
        /// Keeps what the reflected rays of the last wave were and where they were found: [`ImpostorReflections::looked_up`](super::ImpostorReflections::looked_up).
        pub keeps_look_ups: bool = false;
    }
    check ReflectionSettings::fit;
}

/// Eye paths: direct light where the eye first sees a rough surface; media, which are refused, belong to the path set as these do.
const EYE: &str = "LE|L[DGV]E";

impl ReflectionSettings {
    fn fit(&self) -> Result<()> {
        check_place(self.place)?;
        match self.search() {
            Some(search) => search.check(self.layers),
            None if self.layers > 1 => {
                let cause = "take a method that searches distances";
                Err(Error::setting("layers", self.layers, cause))
            }
            None => Ok(()),
        }
    }

    /// The search, where there is one.
    pub(super) fn search(&self) -> Option<ImpostorSettings> {
        let method = self.method.search()?;
        Some(ImpostorSettings {
            method,
            steps: match self.method {
                ReflectionMethod::OneStep => 0,
                _ => self.steps,
            },
            bisections: self.bisections,
            tolerance: self.tolerance,
        })
    }

    /// The light paths of the picture.
    ///
    /// # Errors
    /// None that a range of [`bounces`](Self::bounces) could cause.
    pub(super) fn path_set(&self) -> Result<PathSet> {
        format!("{EYE}|L.{{0,{}}}SE", self.bounces).parse()
    }

    /// Those of eye paths.
    ///
    /// # Errors
    /// None.
    pub(super) fn eye_paths(&self) -> Result<PathSet> {
        EYE.parse()
    }
}

/// Refuses places that are none.
pub(in crate::techniques) fn check_place(place: Option<[f32; 3]>) -> Result<()> {
    match place.map(Vec3::from_array) {
        Some(place) if !place.is_finite() => Err(Error::setting("place", place, "is not finite")),
        _ => Ok(()),
    }
}

/// Refuses places that are farther outside of a scene's bounds than their diagonal is long: what reflects or is lit is within them.
pub(in crate::techniques) fn check_place_about(place: Option<[f32; 3]>, bounds: [Vec3; 2]) -> Result<()> {
    let Some(place) = place.map(Vec3::from_array) else {
        return Ok(());
    };
    let [lower, upper] = bounds.map(|corner| corner.as_dvec3());
    let (at, diagonal) = (place.as_dvec3(), lower.distance(upper));
    let outside = (lower - at).max(at - upper).max(DVec3::ZERO).length();
    // An empty scene has no bounds to be outside of.
    if diagonal > 0.0 && outside > diagonal {
        let cause = format!(
            "is outside of the scene, {outside} m from its bounds {lower} to {upper}; their diagonal is the most"
        );
        return Err(Error::setting("place", place, cause));
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::settings::TypedSettings;

    #[test]
    fn bad_settings_are_refused_by_name() {
        let defaults = ReflectionSettings::default;
        for (settings, words) in [
            (
                ReflectionSettings {
                    place: Some([0.0, f32::NAN, 0.0]),
                    ..defaults()
                },
                "setting place",
            ),
            (
                ReflectionSettings {
                    place: Some([f32::INFINITY, 0.0, 0.0]),
                    ..defaults()
                },
                "setting place",
            ),
            (
                ReflectionSettings {
                    steps: MAX_STEPS + 1,
                    ..defaults()
                },
                "setting steps",
            ),
            (
                ReflectionSettings {
                    method: ReflectionMethod::March,
                    steps: 0,
                    ..defaults()
                },
                "impostor steps",
            ),
            (
                ReflectionSettings {
                    tolerance: f32::NAN,
                    ..defaults()
                },
                "setting tolerance",
            ),
            (ReflectionSettings { side: 8, ..defaults() }, "setting side"),
            (
                ReflectionSettings {
                    layers: LAYERS_MAX + 1,
                    ..defaults()
                },
                "setting layers",
            ),
            (
                ReflectionSettings {
                    layers: 2,
                    method: ReflectionMethod::Box,
                    ..defaults()
                },
                "setting layers: 2 take a method",
            ),
        ] {
            let error = settings.check().expect_err(words).to_string();
            assert!(error.contains(words), "{error}");
        }
        assert!(defaults().check().is_ok());
    }

    #[test]
    fn places_are_about_the_scene() {
        // The diagonal is 7 long.
        let bounds = [Vec3::new(-1.0, 0.0, 10.0), Vec3::new(1.0, 3.0, 16.0)];
        for place in [
            None,
            Some([0.0, 1.0, 12.0]),
            Some([-7.9, 1.0, 12.0]),
            Some([0.0, 6.9, 21.7]),
        ] {
            assert!(check_place_about(place, bounds).is_ok(), "{place:?}");
        }
        for place in [
            [-8.1, 1.0, 12.0],
            [0.0, 10.1, 12.0],
            [0.0, 9.9, 22.9],
            [0.0, 1.0, 2.9],
            [1e30, 1.0, 12.0],
        ] {
            let error = check_place_about(Some(place), bounds).expect_err("place").to_string();
            assert!(
                error.contains("setting place") && error.contains("outside of the scene"),
                "{error}"
            );
        }
        // An empty scene.
        assert!(check_place_about(Some([5.0, 0.0, 0.0]), [Vec3::ZERO; 2]).is_ok());
    }

    #[test]
    fn eye_paths_are_part_of_the_picture_and_bounces_are_those_of_the_map() {
        for (bounces, inside, outside) in [
            (0, "LSE", "LDSE"),
            (1, "LDSE|LSSE|LVSE", "LDDSE"),
            (2, "LDGSE", "LDDDSE"),
        ] {
            let settings = ReflectionSettings {
                bounces,
                ..ReflectionSettings::default()
            };
            let (all, eye) = (settings.path_set().unwrap(), settings.eye_paths().unwrap());
            let part = |text: &str| text.parse::<PathSet>().unwrap().is_subset_of(&all);
            assert!(
                eye.is_subset_of(&all) && part(inside) && !part(outside),
                "{bounces}: {all}"
            );
            // What is mirrored comes from the map alone.
            assert!(eye.intersection(&"L.*SE".parse().unwrap()).unwrap().is_empty(), "{eye}");
        }
    }
}
