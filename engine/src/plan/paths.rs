//! Which light paths matter in a scene: when two path sets give the same picture of it, and which paths eye paths never find.

use crate::Result;
use crate::scene::{Light, LightKind, SceneProfile};
use crate::transport::PathSet;
use crate::transport::bsdf::{LOBE_DIFFUSE, LOBE_REFLECTION, LOBE_TRANSMISSION};
use crate::transport::ggx::ALPHA_MIN;
use crate::transport::path_set::{LOBE_VOLUME, PATH_SET_LOBES};

/// Light that leaves its source for a mirror or glass and reaches something else that it can be seen on.
const BEYOND_MIRRORS: &str = "LS.*[^S].*E";
/// Names of lights that are spelt out.
const NAMES: usize = 3;

/// Whether two path sets give the same picture of such a scene: whatever they differ in, the scene does not have.
pub fn same_picture(profile: &SceneProfile, a: &PathSet, b: &PathSet) -> bool {
    if a == b {
        return true;
    }
    let there = |set: &PathSet| -> Result<PathSet> {
        let set = set.intersection(&PathSet::new(0, None, lobes(profile))?)?;
        if emits(profile) {
            Ok(set)
        } else {
            set.without(&PathSet::EMITTED)
        }
    };
    matches!((there(a), there(b)), (Ok(a), Ok(b)) if a == b)
}

/// The kinds of scattering that a scene can have, and maybe more.
fn lobes(profile: &SceneProfile) -> u32 {
    let mut lobes = LOBE_DIFFUSE & LOBE_REFLECTION;
    if profile.has_transmission() {
        lobes |= PATH_SET_LOBES & LOBE_TRANSMISSION;
    }
    if profile.roughness.is_some() {
        lobes |= PATH_SET_LOBES & LOBE_REFLECTION;
    }
    if profile.media.any() {
        lobes |= LOBE_VOLUME;
    }
    lobes
}

/// Whether anything can be seen that shines by itself.
fn emits(profile: &SceneProfile) -> bool {
    profile.has_area_lights() || profile.has_environment() || profile.has_unlit || profile.media.emits
}

/// What of the wanted paths no path tracer from the eye finds, in words: light of sources without area by way of mirrors and smooth glass. A
/// path from the eye meets such a light by chance with probability 0, and behind a mirror it cannot be aimed at.
pub fn unseen_by_eye_paths(profile: &SceneProfile, lights: &[Light], wanted: &PathSet) -> Result<Option<String>> {
    let smooth = profile
        .roughness
        .is_some_and(|[least, _]| f64::from(least).powi(2) < ALPHA_MIN);
    if lights.is_empty() || !smooth {
        return Ok(None);
    }
    let beyond: PathSet = BEYOND_MIRRORS.parse()?;
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
        "what {} give{} by way of mirrors and smooth glass, such as caustics: no path from the eye meets a light without area there",
        names.join(" and "),
        if lights.len() == 1 { "s" } else { "" }
    )))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene;

    fn of(address: &str) -> (SceneProfile, Vec<Light>) {
        let scene = scene::load(address).unwrap();
        (SceneProfile::of(&scene), scene.lights)
    }

    #[test]
    fn sets_that_differ_in_what_a_scene_lacks_give_the_same_picture() {
        let set = |text: &str| text.parse::<PathSet>().unwrap();
        let (matte, _) = of("builtin:cornell-box?source=point");
        assert!(same_picture(&matte, &PathSet::DIRECT, &set("LDE")));
        assert!(same_picture(&matte, &PathSet::DIRECT, &set("LE|LDE")));
        assert!(!same_picture(&matte, &PathSet::ALL, &set("LDE")));
        let (lit, _) = of("builtin:cornell-box");
        assert!(same_picture(&lit, &PathSet::DIRECT, &set("LDE")));
        assert!(!same_picture(&lit, &PathSet::DIRECT, &set("LE|LDE")));
        let (glass, _) = of("builtin:cornell-box?sphere=glass");
        assert!(!same_picture(&glass, &PathSet::DIRECT, &set("LDE")));
    }

    #[test]
    fn caustics_of_lights_without_area_are_said_to_be_missed() {
        let missed = |address: &str, wanted: PathSet| {
            let (profile, lights) = of(address);
            unseen_by_eye_paths(&profile, &lights, &wanted).unwrap()
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
