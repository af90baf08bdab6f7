//! Photon mapping as a technique.

use std::collections::BTreeMap;

use super::{PhotonMapper, PhotonSettings};
use crate::Result;
use crate::film::picture::{NonFiniteSamples, Picture};
use crate::film::{PixelFormat, Step};
use crate::gpu::{Buffer, PipelineInfo};
use crate::scene::{Camera, SceneProfile};
use crate::settings::{SettingsDecl, TypedSettings};
use crate::techniques::{Bias, Card, Skipped, Technique, Variant};
use crate::transport::PathSet;

/// The catalogue's entry.
pub(in crate::techniques) const CARD: Card = Card {
    id: "photon",
    summary: "progressive photon mapping: what diffuse surfaces get indirectly from a map of photons, anew for each pass, with kernels that shrink",
    publication: "Jensen 2001; Hachisuka and Jensen 2009; Knaus and Zwicker 2011; Interactive Manycore Photon Mapping, 2011",
    bias: Bias::Consistent("kernels blur what they gather, and lose light at edges, until they have shrunk"),
    needs: &[],
    path_set: PathSet::ALL,
    refusals,
    settings: SettingsDecl::of::<PhotonSettings>(),
    variants: &[Variant {
        name: "defaults",
        settings: || serde_json::json!({}),
    }],
    create: |gpu, scene, view, settings| {
        let mut settings: PhotonSettings = settings.read()?;
        settings.seed = view.seed;
        settings.aovs = view.aovs;
        Ok(Box::new(PhotonMapper::new(
            gpu,
            scene,
            view.camera,
            view.size,
            settings,
        )?))
    },
};

fn refusals(profile: &SceneProfile) -> Vec<String> {
    if profile.media.any() {
        vec!["the scene has participating media, and photon maps hold surfaces only".into()]
    } else {
        Vec::new()
    }
}

impl Technique for PhotonMapper {
    fn step(&mut self, samples: u32) -> Result<Option<Step>> {
        PhotonMapper::step(self, samples)
    }

    fn picture(&mut self) -> Result<(Picture, NonFiniteSamples)> {
        PhotonMapper::picture(self)
    }

    fn display(&mut self, target: &Buffer, exposure: f32, format: PixelFormat) -> Result<()> {
        PhotonMapper::display(self, target, exposure, format)
    }

    fn set_camera(&mut self, camera: &Camera) -> Result<()> {
        PhotonMapper::set_camera(self, camera)
    }

    fn path_set(&self) -> PathSet {
        PhotonMapper::settings(self).path_set
    }

    fn settings(&self) -> serde_json::Value {
        PhotonMapper::settings(self).to_json()
    }

    fn counters(&self) -> BTreeMap<&'static str, u64> {
        let (eye, c) = (self.eye_counters(), self.counts());
        BTreeMap::from([
            ("paths", eye.paths),
            ("extend_rays", eye.extend_rays),
            ("shadow_rays", eye.shadow_rays),
            ("photon_rays", c.photons.rays),
            ("rays", eye.extend_rays + eye.shadow_rays + c.photons.rays),
            ("waves", eye.waves),
            ("stalls", eye.stalls),
            ("passes", c.passes),
            ("photons_emitted", c.photons.emitted),
            ("photons_escaped", c.photons.escaped),
            ("photons_absorbed", c.photons.absorbed),
            ("photons_stored", c.records),
            ("photons_without_kernel", c.photons.without_kernel),
            ("map_queries", c.gather.queries),
            ("photons_gathered", c.gather.photons),
        ])
    }

    fn pipelines(&self) -> Vec<PipelineInfo> {
        PhotonMapper::pipelines(self)
    }

    fn skipped(&self) -> Vec<Skipped> {
        let mut skipped = Vec::new();
        if !self.has_map() {
            skipped.push(Skipped {
                what: "photons and their map",
                why: "no light can be chosen, or the path set has nothing of a map",
            });
        }
        if self.profile().has_unlit {
            skipped.push(Skipped {
                what: "light from unlit surfaces beyond the first diffuse reflection",
                why: "photons are sent by lights alone",
            });
        }
        skipped
    }
}
