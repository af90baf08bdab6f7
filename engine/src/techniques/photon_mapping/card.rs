//! Photon mapping as a technique.

use std::collections::BTreeMap;

use super::{PhotonMapper, PhotonSettings, gather, kernel, queue, tracer};
use crate::Result;
use crate::card::{Role, Row, sources};
use crate::film::Step;
use crate::film::picture::{NonFiniteSamples, Picture};
use crate::gpu::{Buffer, PipelineInfo};
use crate::scene::{Camera, SceneProfile};
use crate::settings::from_json;
use crate::techniques::{Bias, Card, SettingInfo, Skipped, Technique, Variant};
use crate::transport::PathSet;

/// The catalogue's entry.
pub(in crate::techniques) const CARD: Card = Card {
    id: "photon",
    summary: "progressive photon mapping: what diffuse surfaces get indirectly from a map of photons, anew for each pass, with kernels that shrink",
    rows: &[ROWS, gather::ROWS, kernel::ROWS, queue::ROWS, tracer::ROWS],
    bias: BIAS,
    needs: &[],
    path_set: PathSet::ALL,
    refusals,
    settings: SETTINGS,
    default_settings: || serde_json::to_value(PhotonSettings::default()).unwrap_or_default(),
    variants: &[Variant {
        name: "defaults",
        settings: || serde_json::json!({}),
    }],
    create: |gpu, scene, view, settings| {
        let mut settings: PhotonSettings = from_json(settings)?;
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

const SETTINGS: &[SettingInfo] = &[
    SettingInfo {
        name: "path_set",
        range: "all | emitted | direct | indirect | bounces=A..B, up to 63",
        unit: "",
        meaning: "which light paths the picture contains",
    },
    SettingInfo {
        name: "photons",
        range: "1 … 16777216",
        unit: "photons a pass",
        meaning: "more have less noise, and less bias with kernels that follow footprints",
    },
    SettingInfo {
        name: "shape",
        range: "fixed | isotropic | principal | skewed",
        unit: "",
        meaning: "kernels of one radius, or of each photon's footprint: disks of its area, ellipses by its principal axes or by its differentials",
    },
    SettingInfo {
        name: "neighbors",
        range: "0, or 2 … 1000",
        unit: "photons",
        meaning: "takes the nearest so many photons of each point under one kernel, as wide as the last is away, fewer as passes go on, down to 2; 0: photons have kernels of their own",
    },
    SettingInfo {
        name: "profile",
        range: "uniform | cone | epanechnikov",
        unit: "",
        meaning: "how kernels fall off: noise against visible rims",
    },
    SettingInfo {
        name: "radius",
        range: "0 or more",
        unit: "m",
        meaning: "of fixed kernels, greatest axis of others, farthest neighbour, in the first pass; 0 chooses by the size of the scene, for neighbours by its area and the photons",
    },
    SettingInfo {
        name: "spread",
        range: "above 0",
        unit: "footprints",
        meaning: "size of kernels that follow footprints, in the first pass",
    },
    SettingInfo {
        name: "dampening",
        range: "above 0, at most 1",
        unit: "exponent",
        meaning: "of kernels that follow footprints: evens out the sizes of footprints; 1 leaves them as they are",
    },
    SettingInfo {
        name: "unit_length",
        range: "0 or more",
        unit: "m",
        meaning: "size that the dampening leaves as it is; 0 for a ninth of the scene's diagonal",
    },
    SettingInfo {
        name: "flatness",
        range: "0 or more, below 1",
        unit: "",
        meaning: "of kernels that follow footprints: least area over the square of the longer axis of a footprint that is not flat",
    },
    SettingInfo {
        name: "widen_flat",
        range: "true | false",
        unit: "",
        meaning: "widens flat footprints to the least flatness; else photons that have them are left out, with their light, in every pass",
    },
    SettingInfo {
        name: "reduction",
        range: "above 0, at most 1",
        unit: "",
        meaning: "α of progressive photon mapping: pass i + 1 has kernels of (i + α)/(i + 1) the area; less has less bias and more noise, 1 keeps the bias",
    },
    SettingInfo {
        name: "samples_per_pass",
        range: "1 … 1024",
        unit: "samples",
        meaning: "eye paths of a pixel that ask the same map",
    },
    SettingInfo {
        name: "direct_photons",
        range: "true | false",
        unit: "",
        meaning: "takes direct light from the map too; not with final_gather",
    },
    SettingInfo {
        name: "final_gather",
        range: "true | false",
        unit: "",
        meaning: "sees the map after one more diffuse reflection, caustics directly; not with direct_photons",
    },
    SettingInfo {
        name: "query",
        range: "single | packet",
        unit: "",
        meaning: "points ask the map by themselves, or those of a subgroup together, which needs subgroup votes; where a query's quota stops it, last bits may differ",
    },
    SettingInfo {
        name: "queue",
        range: "slots | compacted | blocks",
        unit: "",
        meaning: "invocations of queries are for every path under way, for those that ask the map by stream compaction, or in blocks that subgroups collect; changes no picture but as query does",
    },
    SettingInfo {
        name: "sampler",
        range: "sobol | pcg",
        unit: "",
        meaning: "Owen-scrambled Sobol' points, or independent samples; changes the noise only",
    },
];

impl Technique for PhotonMapper {
    fn step(&mut self, samples: u32) -> Result<Option<Step>> {
        PhotonMapper::step(self, samples)
    }

    fn picture(&mut self) -> Result<(Picture, NonFiniteSamples)> {
        PhotonMapper::picture(self)
    }

    fn display(&mut self, target: &Buffer, exposure: f32, bgra: bool) -> Result<()> {
        PhotonMapper::display(self, target, exposure, bgra)
    }

    fn set_camera(&mut self, camera: &Camera) -> Result<()> {
        PhotonMapper::set_camera(self, camera)
    }

    fn path_set(&self) -> PathSet {
        PhotonMapper::settings(self).path_set
    }

    fn settings(&self) -> serde_json::Value {
        serde_json::to_value(PhotonMapper::settings(self)).unwrap_or_default()
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

const BIAS: Bias = Bias::Consistent("kernels blur what they gather, and lose light at edges, until they have shrunk");

/// Rows of the catalogue.
const ROWS: &[Row] = &[Row {
    id: "PM-SYS-1",
    name: "technique `photon`: direct light and specular chains by rays, all else from a photon map, anew for each pass (stochastic progressive photon mapping)",
    role: Role::Technique,
    limits: "Refuses scenes with media; light of unlit surfaces beyond the first diffuse reflection is missing, and glossy lobes never use the map.",
    sources: &[
        sources::JENSEN_2001.whole(),
        sources::HACHISUKA_JENSEN_2009.whole(),
        sources::KNAUS_ZWICKER_2011.whole(),
        sources::FABIANOWSKI_2011.at("§6.3"),
    ],
    shaders: &["shaders/techniques/photon_mapping/"],
    path_set: Some("all"),
    bias: Some(BIAS),
    tests: &[
        "tests/tests/photon/convergence.rs::bias_and_variance_fall_as_radii_foretell",
        "tests/tests/photon/convergence.rs::radii_fall_at_the_rate_of_the_theory",
        "tests/tests/photon/settings.rs::every_shape_agrees_with_the_path_tracer",
        "tests/tests/photon/settings.rs::direct_photons_and_final_gather_have_the_same_light",
        "tests/tests/photon/settings.rs::parts_of_the_light_sum_to_the_whole",
        "tests/tests/photon/sphere.rs::furnaces_are_uniform",
        "tests/tests/photon/scale.rs::powers_of_two_never_show",
        "tests/tests/photon/traps.rs::glass_is_not_black",
        "tests/tests/photon/traps.rs::the_ring_has_its_cusp_where_geometry_puts_it",
        "tests/tests/photon/traps.rs::colours_bleed_through_the_passage_as_they_should",
        "tests/tests/hard_cases.rs::techniques_take_every_second_case_as_documented",
    ],
    experiment: "clerestory report photon-convergence photon-or-path photon-nearest photon-ring photon-frame photon-peers photon-settings",
    ..Row::of(file!())
}];
