//! Device features by the names that techniques ask for them.

use std::collections::BTreeMap;

use crate::gpu::interface::ShaderInfo;
use crate::gpu::shaders::film::{add_frame, display};
use crate::gpu::{Caps, ExceededLimit};
use crate::{Error, Result};

use super::Card;

/// A feature's Vulkan name, and whether a device has it enabled.
type DeviceFeature = (&'static str, fn(&Caps) -> bool);

/// What [`Card::needs`] may name.
const FEATURES: [DeviceFeature; 17] = [
    ("geometryShader", |caps| caps.geometry_shader),
    ("shaderClipDistance", |caps| caps.max_clip_distances > 0),
    ("shaderInt64", |caps| caps.int64),
    ("shaderFloat64", |caps| caps.float64),
    ("shaderBufferInt64Atomics", |caps| caps.int64_atomics),
    ("robustBufferAccess", |caps| caps.robust_buffer_access),
    ("pipelineStatisticsQuery", |caps| caps.pipeline_statistics),
    ("fragmentStoresAndAtomics", |caps| caps.fragment_stores),
    ("vertexPipelineStoresAndAtomics", |caps| caps.vertex_stores),
    ("runtimeDescriptorArray", |caps| caps.descriptor_indexing),
    ("VK_KHR_ray_query", |caps| caps.ray_query),
    ("VK_QUEUE_GRAPHICS_BIT", |caps| caps.graphics),
    ("VK_SUBGROUP_FEATURE_BASIC_BIT", |caps| caps.subgroup.basic),
    ("VK_SUBGROUP_FEATURE_VOTE_BIT", |caps| caps.subgroup.vote),
    ("VK_SUBGROUP_FEATURE_ARITHMETIC_BIT", |caps| caps.subgroup.arithmetic),
    ("VK_SUBGROUP_FEATURE_BALLOT_BIT", |caps| caps.subgroup.ballot),
    ("VK_SUBGROUP_FEATURE_SHUFFLE_BIT", |caps| caps.subgroup.shuffle),
];

/// What every technique's film takes.
const FILM_KERNELS: [&ShaderInfo; 2] = [&add_frame::INFO, &display::INFO];

/// Whether a device has a feature, by its Vulkan name; `None` for a name that the engine does not know.
pub fn offers(caps: &Caps, feature: &str) -> Option<bool> {
    let (_, has) = FEATURES.iter().find(|(name, _)| *name == feature)?;
    Some(has(caps))
}

/// Something that a technique needs and a device does not have.
#[derive(Debug, Clone, PartialEq, Eq, serde::Serialize)]
pub struct Lack {
    /// A feature by its Vulkan name, or a limit with the least value that would do: `maxBoundDescriptorSets >= 5`.
    pub what: String,
    /// The limit's value; `None` of features.
    pub offered: Option<u32>,
    /// Kernels that want more than it; none of features.
    pub kernels: Vec<&'static str>,
}

/// Everything that a device lacks of what a technique needs: the features that it names, and limits by the interfaces of its kernels. A scene that needs
/// fewer kernels may be rendered in spite of a limit.
pub fn lacks(caps: &Caps, technique: &Card) -> Vec<Lack> {
    let features = technique
        .needs
        .iter()
        .filter(|feature| offers(caps, feature) != Some(true));
    let mut all: Vec<Lack> = features
        .map(|feature| Lack {
            what: (*feature).to_owned(),
            offered: None,
            kernels: Vec::new(),
        })
        .collect();
    let mut limits: BTreeMap<&str, (ExceededLimit, Vec<&str>)> = BTreeMap::new();
    for shader in technique.kernels.iter().copied().flatten().chain(&FILM_KERNELS) {
        for exceeded in caps.exceeded_by(shader) {
            let (worst, names) = limits.entry(exceeded.name).or_insert((exceeded, Vec::new()));
            worst.wanted = worst.wanted.max(exceeded.wanted);
            if !names.contains(&shader.name) {
                names.push(shader.name);
            }
        }
    }
    all.extend(limits.into_values().map(|(limit, kernels)| Lack {
        what: format!("{} >= {}", limit.name, limit.wanted),
        offered: Some(limit.offered),
        kernels,
    }));
    all
}

/// Refuses a device that lacks what the technique needs.
pub(super) fn check(caps: &Caps, technique: &Card) -> Result<()> {
    for feature in technique.needs {
        match offers(caps, feature) {
            Some(true) => {}
            Some(false) => {
                return Err(Error::MissingFeature {
                    feature: (*feature).into(),
                    needed_by: format!("technique {}", technique.id),
                    device: caps.device.clone(),
                    instead: way_round(caps),
                });
            }
            None => {
                let known: Vec<_> = FEATURES.iter().map(|(name, _)| *name).collect();
                let cause = format!(
                    "is needed by technique {} but is not one of {}",
                    technique.id,
                    known.join(", ")
                );
                return Err(Error::setting("needs", feature, cause));
            }
        }
    }
    Ok(())
}

/// What to do on a device that does not do: the engine's own techniques that run on it.
fn way_round(caps: &Caps) -> String {
    let fits = |technique: &&Card| technique.needs.iter().all(|need| offers(caps, need) == Some(true));
    let ids: Vec<_> = super::all().iter().filter(fits).map(|technique| technique.id).collect();
    format!(
        "choose a device that has it (or enable it, where the host made the device), or one of the techniques that run here: {}",
        ids.join(", ")
    )
}
