//! Fingerprints: hashes by which kept references and measurements are known again.
//!
//! They guard against what has changed, not against who would deceive; see [`Fingerprint`].

use std::collections::BTreeMap;
use std::fmt::Write;

pub use clerestory::fingerprint::Fingerprint;
use clerestory::gpu::{PipelineInfo, shaders};
use clerestory::scene::Scene;

/// The hash of everything in a scene that can change a picture: all fields, so none that is added later is forgotten, but where it came
/// from. Floating-point numbers count to the last bit.
pub fn scene(scene: &mut Scene) -> String {
    let source = std::mem::take(&mut scene.source);
    let name = std::mem::take(&mut scene.name);
    let mut print = Fingerprint::default();
    // Into a hash, writing cannot fail. `Debug` prints the shortest decimals that read back to the same bits.
    let _ = write!(print, "{scene:?}");
    (scene.source, scene.name) = (source, name);
    print.text()
}

/// The hash of each kernel among some pipelines, by name. The constants that it was specialized to follow from scene and settings.
pub fn kernels(pipelines: &[PipelineInfo]) -> BTreeMap<String, String> {
    let one = |pipeline: &PipelineInfo| {
        let print = kernel(pipeline.shader)?;
        Some((pipeline.shader.to_owned(), print))
    };
    pipelines.iter().filter_map(one).collect()
}

/// Whether this build still has all of these kernels as they were.
pub fn kernels_are_current(kernels: &BTreeMap<String, String>) -> bool {
    kernels
        .iter()
        .all(|(name, print)| kernel(name).is_some_and(|now| now == *print))
}

fn kernel(name: &str) -> Option<String> {
    let info = shaders::ALL.iter().find(|info| info.name == name)?;
    Some(Fingerprint::of(info.spirv))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn scenes_are_known_by_their_content() {
        let load = |address: &str| clerestory::scene::load(address).unwrap();
        let print = |address: &str| scene(&mut load(address));
        let plain = print("builtin:cornell-box");
        assert_eq!(
            plain,
            print("builtin:cornell-box?boxes=both"),
            "another address of the same scene"
        );
        assert_ne!(plain, print("builtin:cornell-box?light=17,12,4.0001"));
        let mut kept = load("builtin:cornell-box");
        scene(&mut kept);
        assert_eq!(kept.name, load("builtin:cornell-box").name);
    }

    #[test]
    fn a_kernel_that_changed_or_went_is_noticed() {
        let info = shaders::ALL[0];
        let now = kernels(&[PipelineInfo {
            shader: info.name,
            specialization: Vec::new(),
        }]);
        assert_eq!(now.len(), 1);
        assert!(kernels_are_current(&now));
        assert!(!kernels_are_current(&BTreeMap::from([(
            info.name.to_owned(),
            "0".to_owned()
        )])));
        assert!(!kernels_are_current(&BTreeMap::from([(
            "gone.comp".to_owned(),
            "0".to_owned()
        )])));
    }
}
