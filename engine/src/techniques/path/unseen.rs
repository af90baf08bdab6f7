//! What no path from the eye finds.

use crate::Result;
use crate::scene::{Light, LightKind, SceneProfile};
use crate::transport::PathSet;
use crate::transport::ggx::ALPHA_MIN;

/// Light that leaves its source for a mirror or glass and reaches something else that it can be seen on.
const BEYOND_MIRRORS: &str = "LS.*[^S].*E";
const BY_NO_EYE_PATH: &str =
    "by way of mirrors and smooth glass, such as caustics: no path from the eye meets a light without area there";
/// Names of lights that are spelt out.
const NAMES: usize = 3;

/// What of the wanted paths no path tracer from the eye finds, in words: light of sources without area by way of mirrors and smooth glass. A
/// path from the eye meets such a light by chance with probability 0, and behind a mirror it cannot be aimed at.
pub(super) fn unseen_by_eye_paths(
    profile: &SceneProfile,
    lights: &[Light],
    wanted: &PathSet,
) -> Result<Option<String>> {
    unseen_of_lights(profile, lights, wanted, BEYOND_MIRRORS, BY_NO_EYE_PATH)
}

/// What lights without area give of the wanted paths that are among those `beyond`, where surfaces are smooth enough for some, in words that end with `how`.
///
/// # Errors
/// [`Error::Setting`](crate::Error::Setting) for an expression that is none.
pub(in crate::techniques) fn unseen_of_lights(
    profile: &SceneProfile,
    lights: &[Light],
    wanted: &PathSet,
    beyond: &str,
    how: &str,
) -> Result<Option<String>> {
    let smooth = profile
        .roughness
        .is_some_and(|[least, _]| f64::from(least).powi(2) < ALPHA_MIN);
    if lights.is_empty() || !smooth {
        return Ok(None);
    }
    let beyond: PathSet = beyond.parse()?;
    // A set that is too large to tell has them for all that is known.
    if wanted.intersection(&beyond).is_ok_and(|both| both.is_empty()) {
        return Ok(None);
    }
    let kind = |light: &Light| match light.kind {
        LightKind::Point { .. } => "point",
        LightKind::Spot { .. } => "spot",
        LightKind::Directional { .. } => "directional",
    };
    let mut names: Vec<String> = lights
        .iter()
        .take(NAMES)
        .map(|light| format!("the {} light {:?}", kind(light), light.name))
        .collect();
    if lights.len() > NAMES {
        names.push(format!("{} more", lights.len() - NAMES));
    }
    Ok(Some(format!(
        "what {} give{} {how}",
        names.join(" and "),
        if lights.len() == 1 { "s" } else { "" }
    )))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene;

    #[test]
    fn caustics_of_lights_without_area_are_said_to_be_missed() {
        let missed = |address: &str, wanted: PathSet| {
            let scene = scene::load(address).unwrap();
            unseen_by_eye_paths(&SceneProfile::of(&scene), &scene.lights, &wanted).unwrap()
        };
        let text = missed("builtin:cornell-box?sphere=glass&source=point", PathSet::ALL).expect("missed");
        assert!(text.contains("point light") && text.contains("caustics"), "{text}");
        for address in ["builtin:cornell-box?sphere=glass", "builtin:cornell-box?source=point"] {
            assert_eq!(missed(address, PathSet::ALL), None, "{address}");
        }
        let glass = "builtin:cornell-box?sphere=glass&source=point";
        assert_eq!(missed(glass, PathSet::DIRECT), None);
        assert_eq!(missed(glass, "!LS.*E".parse().unwrap()), None);
        assert!(missed(glass, PathSet::INDIRECT).is_some());
    }
}
