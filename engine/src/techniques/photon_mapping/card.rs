//! Photon mapping as a technique.

use std::collections::BTreeMap;

use super::{PhotonMapper, PhotonSettings, gather, kernel, queue, tracer, volume};
use crate::Result;
use crate::accel::photon_map::device::MapBuilder;
use crate::catalogue::{Role, Row, sources};
use crate::gpu::interface::ShaderInfo;
use crate::gpu::shaders::techniques::path::path_shade;
use crate::gpu::shaders::techniques::photon_mapping::{
    photon_append, photon_beam, photon_boxes, photon_emit, photon_event_boxes, photon_event_leaves, photon_gather,
    photon_gather_packet, photon_glow, photon_leaf_size, photon_leaves, photon_medium, photon_scatter,
    photon_volume_append, photon_volume_flags,
};
use crate::kernels::{RadixSort, Scan};
use crate::scene::SceneProfile;
use crate::settings::{Settings, SettingsDecl};
use crate::techniques::path::card as path;
use crate::techniques::skipped::{Omission, skipped};
use crate::techniques::{Bias, Card, Foresight, Law, Skipped, Technique, Variant};
use crate::transport::{PathSet, SURFACE_FEATURES};
/// The catalogue's entry.
pub(in crate::techniques) const CARD: Card = Card {
    id: "photon",
    summary: "progressive photon mapping: indirect light on diffuse surfaces and in media from maps of photons, rebuilt for each pass, with kernels that shrink",
    rows: &[
        ROWS,
        gather::ROWS,
        kernel::ROWS,
        queue::ROWS,
        tracer::ROWS,
        volume::ROWS,
        volume::transmittance::ROWS,
        volume::ways::ROWS,
        volume::footprint::ROWS,
    ],
    bias: BIAS,
    needs: &[],
    kernels: &[
        &path::KERNELS,
        &KERNELS,
        &DEVICE_MAP_KERNELS,
        &MapBuilder::KERNELS,
        &RadixSort::KERNELS,
        &Scan::KERNELS,
    ],
    path_set: PathSet::ALL,
    refusals,
    settings: SettingsDecl::of::<PhotonSettings>(),
    variants: &VARIANTS,
    foresight: Foresight {
        law,
        ..Foresight::PLAIN
    },
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

/// The defaults, and how media may be seen otherwise: where the mean free path is long beside kernels, beams and planes are far ahead, in dense media collisions are.
/// Marches are none: they see the collisions of the default under kernels of one dimension more.
const VARIANTS: [Variant; 4] = [
    Variant::DEFAULTS,
    Variant {
        name: "photon beams",
        settings: || serde_json::json!({ "volume": "beams" }),
        suits: scatters_evenly,
    },
    Variant {
        name: "photon planes",
        settings: || serde_json::json!({ "volume": "planes" }),
        suits: scatters_evenly,
    },
    Variant {
        name: "collisions and beams",
        settings: || serde_json::json!({ "volume": "unified" }),
        // In grids there are collisions alone.
        suits: |profile| profile.media.scatters && profile.media.homogeneous,
    },
];

/// Whether ways and planes can be stored, and something is seen of them: in grids they are refused.
fn scatters_evenly(profile: &SceneProfile) -> bool {
    profile.media.scatters && !profile.media.heterogeneous
}

/// With reduction α, kernels' area falls as passes^(α − 1). What they blur is off by as much, and the variance falls as passes^(−α). The width of beams and the
/// volume of balls fall so, too, and blur goes with the square of lengths, so that what is off falls as passes^(2(α − 1)) by beams, and by balls as
/// passes^(2(α − 1)/3); by collisions beside beams the slower one decides. Settings that ask for beams or balls are taken for those of pictures of media.
///
/// Source: C. Knaus and M. Zwicker, "Progressive Photon Mapping: A Probabilistic Approach", ACM TOG 30(3), 2011, §4.
fn law(settings: &Settings) -> Result<Law> {
    let settings: PhotonSettings = settings.read()?;
    let reduction = f64::from(settings.reduction);
    Ok(Law {
        slope: reduction,
        bias_exponent: if settings.kernels_shrink() {
            4.0 * (1.0 - reduction) / settings.volume.dimensions()
        } else {
            0.0
        },
        samples_a_pass: settings.samples_per_pass,
        samples_least: 1,
        shares_noise: true,
    })
}

/// Why a scene cannot be modelled.
pub(super) fn refusals(profile: &SceneProfile) -> Vec<String> {
    let mut reasons = Vec::new();
    if profile.media.emits_endlessly {
        reasons.push(
            "the scene has an endless participating medium that emits everywhere, more than photons carry".into(),
        );
    }
    let from_infinity = profile.has_environment() || profile.lights.directional > 0;
    if profile.media.surrounding && from_infinity {
        let reason =
            "the scene has endless participating media and light from infinity, which no photon brings through them";
        reasons.push(reason.into());
    }
    reasons
}

/// What a picture may take with default settings, of whatever scene, beside what eye paths do.
const KERNELS: [&ShaderInfo; 9] = [
    &photon_emit::INFO,
    &photon_glow::INFO,
    &photon_medium::INFO,
    &photon_scatter::INFO,
    &photon_append::INFO,
    &photon_volume_flags::INFO,
    &photon_volume_append::INFO,
    &photon_beam::INFO,
    &photon_gather::INFO,
];

/// The same where the device builds the map, beside those of its tree.
const DEVICE_MAP_KERNELS: [&ShaderInfo; 5] = [
    &photon_boxes::INFO,
    &photon_leaf_size::INFO,
    &photon_leaves::INFO,
    &photon_event_boxes::INFO,
    &photon_event_leaves::INFO,
];

/// What the specialization constants of photons' scattering and of queries stand for, beside those of eye paths.
const PHOTON_FEATURES: [Omission; 2] = [
    ("has_differentials", "footprints of photons", "kernels have one size"),
    (
        "tells_caustics",
        "telling caustics from other photons",
        "there is no final gather",
    ),
];
const QUERY_FEATURES: [Omission; 2] = [
    (
        "nearest",
        "searches for the nearest photons",
        "photons have kernels of their own",
    ),
    (
        "counts_bounces",
        "counting of scatterings",
        "the path set has every number of them",
    ),
];

impl Technique for PhotonMapper {
    forward_to_methods!(PhotonMapper);

    fn path_set(&self) -> PathSet {
        PhotonMapper::settings(self).path_set
    }

    fn counters(&self) -> BTreeMap<&'static str, u64> {
        let (eye, c) = (self.eye_counters(), self.counts());
        let mut all = BTreeMap::from([
            ("paths", eye.paths),
            ("extend_rays", eye.extend_rays),
            ("shadow_rays", eye.shadow_rays),
            ("photon_rays", c.photons.rays),
            (
                "rays",
                eye.extend_rays + eye.shadow_rays + c.photons.rays + c.beams.rays,
            ),
            ("waves", eye.waves),
            ("stalls", eye.stalls),
            ("postponed", eye.postponed),
            ("passes", c.passes),
            ("photons_emitted", c.photons.emitted),
            ("photons_escaped", c.photons.escaped),
            ("photons_absorbed", c.photons.absorbed),
            ("photons_stored", c.records),
            ("photons_without_kernel", c.photons.without_kernel),
            ("map_queries", c.gather.queries),
            ("photons_gathered", c.gather.photons),
        ]);
        if self.profile().media.any() {
            all.extend([
                ("medium_collisions", eye.medium_collisions + c.photons.collisions),
                ("events_stored", c.events),
                ("beam_queries", c.beams.queries),
                ("events_gathered", c.beams.photons),
                ("plane_rays", c.beams.rays),
            ]);
        }
        if PhotonMapper::settings(self).count_fetches {
            all.extend([
                ("later_beam_queries", c.ray_fetches.later_queries()),
                ("map_nodes_fetched", c.ray_fetches.nodes),
                ("events_fetched", c.ray_fetches.records),
                ("ray_tests", c.ray_fetches.tests),
            ]);
        }
        all
    }

    fn skipped(&self) -> Vec<Skipped> {
        let pipelines = PhotonMapper::pipelines(self);
        let off = |shader: &ShaderInfo, omissions: &[Omission]| skipped(&pipelines, shader.name, omissions);
        let mut skipped = off(&path_shade::INFO, &SURFACE_FEATURES);
        skipped.extend(off(&photon_scatter::INFO, &PHOTON_FEATURES));
        skipped.extend(off(&photon_gather::INFO, &QUERY_FEATURES));
        skipped.extend(off(&photon_gather_packet::INFO, &QUERY_FEATURES));
        if !self.has_map() {
            skipped.push(Skipped {
                what: "photons and their map",
                why: "nothing sends light, or nothing scatters it diffusely, or the path set has nothing of a map",
            });
        }
        if self.has_map() && !self.has_surface_map() {
            skipped.push(Skipped {
                what: "the photon map of surfaces",
                why: "no surface may be diffuse",
            });
        }
        if self.profile().has_unlit {
            skipped.push(Skipped {
                what: "light from unlit surfaces beyond the first diffuse reflection",
                why: "only lights send photons",
            });
        }
        skipped
    }
}

const BIAS: Bias = Bias::Consistent("kernels blur what they gather, and lose light at edges, until they have shrunk");

/// Rows of the catalogue.
const ROWS: &[Row] = &[Row {
    id: "PM-SYS-1",
    name: "technique `photon`: direct light and specular chains by rays, all else from a photon map, rebuilt for each pass (stochastic progressive photon mapping)",
    role: Role::Technique,
    limits: "Refuses endless media that emit everywhere or have light from infinity; light of unlit surfaces beyond the first diffuse reflection is missing, and glossy lobes never use the map.",
    sources: &[
        sources::JENSEN_2001.whole(),
        sources::HACHISUKA_JENSEN_2009.whole(),
        sources::KNAUS_ZWICKER_2011.whole(),
        sources::FABIANOWSKI_2011.at("§6.3"),
    ],
    shaders: &[
        "shaders/techniques/photon_mapping/",
        "shaders/techniques/path/",
        "shaders/walk/",
    ],
    path_set: Some("all"),
    bias: Some(BIAS),
    tests: &[
        "engine/src/techniques/photon_mapping/path_classes.rs::eye_paths_and_maps_have_every_path_once",
        "tests/tests/photon/volume.rs::expressions_agree_with_the_path_tracer",
        "tests/tests/photon/convergence.rs::radii_fall_at_the_rate_of_the_theory",
        "tests/tests/photon/settings.rs::direct_photons_and_final_gather_have_the_same_light",
        "tests/tests/photon/settings.rs::parts_of_the_light_sum_to_the_whole",
        "tests/tests/photon/scale.rs::powers_of_two_never_show",
        "tests/tests/photon/traps.rs::glass_is_not_black",
        "tests/tests/photon/without.rs::without_diffuse_surfaces_there_is_no_map_of_them_and_the_same_bits",
        "tests/tests/photon/without.rs::maps_of_surfaces_are_made_wherever_a_material_may_be_diffuse",
        "tests/tests/photon/traps.rs::the_ring_has_its_cusp_where_geometry_puts_it",
    ],
    api: &["clerestory::techniques::photon_mapping::PhotonMapper"],
    settings: &[
        "clerestory::techniques::photon_mapping::PhotonSettings",
        "clerestory render --technique photon",
    ],
    ..Row::of("engine/src/techniques/photon_mapping/mapper.rs")
}];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn laws_follow_the_settings() {
        let of = |settings: serde_json::Value| law(&settings.into()).unwrap();
        let usual = of(serde_json::json!({}));
        assert!((usual.bias_exponent - 2.0 / 3.0).abs() < 1e-6 && (usual.slope - 2.0 / 3.0).abs() < 1e-6);
        assert_eq!(usual.samples_a_pass, 1);
        let settings = serde_json::json!({ "reduction": 0.5, "samples_per_pass": 8, "neighbors": 100 });
        let law = of(settings);
        assert_eq!((law.bias_exponent, law.slope, law.samples_a_pass), (1.0, 0.5, 8));
        // RMSE falls as passes^(-2/7), (-1/3) and (-2/5) at the reductions under which noise and blur fall alike.
        for (volume, reduction, rate) in [
            ("march", 4.0 / 7.0, 2.0 / 7.0),
            ("ray", 2.0 / 3.0, 1.0 / 3.0),
            ("beams", 0.8, 0.4),
            ("planes", 0.8, 0.4),
            ("unified", 2.0 / 3.0, 1.0 / 3.0),
        ] {
            let law = of(serde_json::json!({ "volume": volume, "reduction": reduction }));
            assert!((0.5 * law.slope - rate).abs() < 1e-6, "{volume}: {law:?}");
            assert!((0.5 * law.bias_exponent - rate).abs() < 1e-6, "{volume}: {law:?}");
        }
        // What does not shrink does not move.
        for settings in [
            serde_json::json!({ "reduction": 1 }),
            serde_json::json!({ "neighbors": 2 }),
        ] {
            assert_eq!(of(settings).bias_exponent, 0.0);
        }
    }

    #[test]
    fn volume_estimates_are_tried_where_they_can_be_seen() {
        let tried = |address: &str| {
            let profile = SceneProfile::of(&crate::scene::load(address).unwrap());
            let suiting = VARIANTS.iter().filter(|variant| (variant.suits)(&profile));
            suiting.map(|variant| variant.name).collect::<Vec<_>>()
        };
        assert_eq!(tried("builtin:cornell-box"), ["defaults"]);
        assert_eq!(tried("builtin:smoke?size=8"), ["defaults"]);
        // Fog that only absorbs shows nothing of photons.
        assert_eq!(tried("builtin:fog-box?sigma_s=0"), ["defaults"]);
        assert_eq!(
            tried("builtin:fog-box"),
            ["defaults", "photon beams", "photon planes", "collisions and beams"]
        );
    }

    #[test]
    fn features_are_constants_of_their_kernels() {
        for (shader, features) in [
            (&photon_scatter::INFO, &PHOTON_FEATURES),
            (&photon_gather::INFO, &QUERY_FEATURES),
            (&photon_gather_packet::INFO, &QUERY_FEATURES),
        ] {
            for (name, ..) in features {
                let known = shader.spec_constants.iter().any(|constant| constant.name == *name);
                assert!(known, "{name} is not a constant of {}", shader.name);
            }
        }
        // What photons need of the scene, eye paths need too, and say; classes of paths are the settings'.
        for constant in photon_scatter::INFO
            .spec_constants
            .iter()
            .filter(|c| c.name.starts_with("has_") && c.name != "has_classes")
        {
            let said = SURFACE_FEATURES.iter().chain(&PHOTON_FEATURES);
            assert!(
                said.into_iter().any(|(name, ..)| *name == constant.name),
                "{}",
                constant.name
            );
        }
    }
}
