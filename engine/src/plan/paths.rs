//! Which light paths matter in a scene: when two path sets give the same picture of it.

use crate::Result;
use crate::scene::SceneProfile;
use crate::transport::PathSet;
use crate::transport::bsdf::{LOBE_DIFFUSE, LOBE_REFLECTION, LOBE_TRANSMISSION};
use crate::transport::path_set::{LOBE_VOLUME, PATH_SET_LOBES};

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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene;

    fn of(address: &str) -> SceneProfile {
        SceneProfile::of(&scene::load(address).unwrap())
    }

    #[test]
    fn sets_that_differ_in_what_a_scene_lacks_give_the_same_picture() {
        let set = |text: &str| text.parse::<PathSet>().unwrap();
        let matte = of("builtin:cornell-box?source=point");
        assert!(same_picture(&matte, &PathSet::DIRECT, &set("LDE")));
        assert!(same_picture(&matte, &PathSet::DIRECT, &set("LE|LDE")));
        assert!(!same_picture(&matte, &PathSet::ALL, &set("LDE")));
        let lit = of("builtin:cornell-box");
        assert!(same_picture(&lit, &PathSet::DIRECT, &set("LDE")));
        assert!(!same_picture(&lit, &PathSet::DIRECT, &set("LE|LDE")));
        let glass = of("builtin:cornell-box?sphere=glass");
        assert!(!same_picture(&glass, &PathSet::DIRECT, &set("LDE")));
    }
}
