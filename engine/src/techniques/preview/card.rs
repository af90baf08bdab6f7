//! The raster preview as a technique.

use super::{PreviewMethod, PreviewSettings, fading, live, planar, probe, reflection};
use crate::catalogue::{Role, Row, sources};
use crate::gpu::interface::ShaderInfo;
use crate::gpu::shaders::maps::{directional_border, directional_coarser, prefilter_ggx};
use crate::gpu::shaders::raster::{surface_frag, surface_octant_vert, surface_vert};
use crate::gpu::shaders::techniques::preview::preview_shade;
use crate::raster::SHADOW_MAPS_MAX;
use crate::scene::SceneProfile;
use crate::settings::SettingsDecl;
use crate::techniques::{Accumulated, Bias, Card, Foresight, Variant};
use crate::transport::PathSet;

/// The causes, as the module's documentation has them.
const BIAS: Bias = Bias::Biased(
    "shadow maps err at borders of shadows, and as a whole where things are no larger than texels; an \
     environment's light is not occluded, and its reflections are filtered by round lobes, with Schlick's factor off rough metals",
);

/// Clip distances cut the octants of shadow maps, as the default layout has them.
const NEEDS: &[&str] = &["VK_QUEUE_GRAPHICS_BIT", "shaderClipDistance"];

/// What a picture may take with default settings, of whatever scene.
const KERNELS: [&ShaderInfo; 7] = [
    &preview_shade::INFO,
    &surface_vert::INFO,
    &surface_octant_vert::INFO,
    &surface_frag::INFO,
    &directional_coarser::INFO,
    &directional_border::INFO,
    &prefilter_ggx::INFO,
];

/// Why there is nothing of a scene with media.
pub(super) const NO_MEDIA: &str = "participating media are not shown";
/// Why there is nothing of a scene with classical microfacets.
pub(super) const NO_CLASSIC: &str = "its probes are filtered by the GGX lobe, not by classical microfacets";
/// Why there is nothing of a scene with modified Phong surfaces.
pub(super) const NO_PHONG: &str = "its probes are not filtered by modified Phong lobes";

/// The catalogue's entry.
pub(in crate::techniques) const CARD: Card = Card {
    id: "preview",
    summary: "raster preview: surfaces from a G-buffer, lights with shadow maps, the environment as a filtered probe; a picture per frame",
    rows: &[
        ROWS,
        fading::ROWS,
        live::ROWS,
        planar::ROWS,
        probe::ROWS,
        reflection::ROWS,
    ],
    bias: BIAS,
    needs: NEEDS,
    kernels: &[&KERNELS],
    path_set: PathSet::UP_TO_DIRECT,
    refusals,
    settings: SettingsDecl::of::<PreviewSettings>(),
    variants: &[Variant::DEFAULTS],
    foresight: Foresight::FRAMES,
    create: |gpu, scene, view, settings| {
        let settings: PreviewSettings = settings.read()?;
        Accumulated::boxed(gpu, view, PreviewMethod::new(gpu, scene, view.size, settings)?)
    },
};

fn refusals(profile: &SceneProfile) -> Vec<String> {
    let placed = profile.lights.point + profile.lights.spot;
    let emits = profile.has_area_lights() || profile.has_unlit;
    let all = [
        (
            emits,
            "surfaces emit light, and what they send to others is not shown".to_owned(),
        ),
        (
            profile.has_transmission(),
            "nothing is seen through materials that transmit".into(),
        ),
        (profile.has_phong, NO_PHONG.into()),
        (profile.has_classic_microfacets, NO_CLASSIC.into()),
        (profile.alpha.blend, "partial alpha is drawn opaque".into()),
        (profile.media.any(), NO_MEDIA.into()),
        (
            profile.keeps_instances,
            "it draws triangle by triangle, and the scene keeps its instances; with another ray index, such as `wide`, they are flattened".into(),
        ),
        (
            placed > SHADOW_MAPS_MAX as usize,
            format!("{placed} lights have a place, and there are shadow maps for {SHADOW_MAPS_MAX}"),
        ),
        (
            profile.lights.directional > SHADOW_MAPS_MAX as usize,
            format!(
                "{} lights are directional, and there are shadow maps for {SHADOW_MAPS_MAX}",
                profile.lights.directional
            ),
        ),
    ];
    all.into_iter()
        .filter(|(holds, _)| *holds)
        .map(|(_, why)| why)
        .collect()
}

/// Rows of the catalogue.
const ROWS: &[Row] = &[Row {
    id: "CL-PREVIEW",
    name: "technique `preview`: deferred shading with shadow maps and light probes, frame by frame, and the same for hosts' own frames",
    role: Role::Technique,
    limits: "Light of surfaces on others is left out, except for what a host's probe holds; nothing is seen through glass, and classical microfacets and modified Phong surfaces are refused.",
    sources: &[
        sources::DEERING_1988.whole(),
        sources::SAITO_TAKAHASHI_1990.whole(),
        sources::KAUTZ_2000.whole(),
        sources::KARIS_2013.whole(),
    ],
    shaders: &[
        "shaders/techniques/preview/",
        "shaders/raster/coverage.comp",
        "shaders/raster/surface.vert",
    ],
    path_set: Some("bounces=0..1"),
    bias: Some(BIAS),
    needs: NEEDS,
    tests: &[
        "tests/tests/preview/light.rs::white_surfaces_vanish_in_a_white_furnace",
        "tests/tests/preview/light.rs::albedos_in_a_uniform_environment_are_the_path_tracers",
        "tests/tests/preview/light.rs::a_lambert_sphere_under_a_cosine_sky_has_the_closed_form",
        "tests/tests/preview/light.rs::a_mirror_sphere_shows_the_environment",
        "tests/tests/preview/light.rs::direct_light_is_the_path_tracers",
        "tests/tests/preview/moving.rs::moved_objects_are_as_if_made_there",
        "tests/tests/preview/moving.rs::passes_are_those_that_are_needed",
        "tests/tests/preview/technique.rs::pictures_come_to_be_the_path_tracers",
        "tests/tests/preview/technique.rs::each_light_has_a_shadow_map_of_its_kind",
        "engine/src/techniques/preview/probe.rs::lobes_grow_from_level_to_level",
        "engine/src/techniques/preview/probe.rs::levels_of_lobes_are_those_of_their_widths",
        "engine/src/techniques/preview/probe.rs::mixtures_are_near_the_lobe",
    ],
    api: &[
        "clerestory::techniques::preview::Preview",
        "clerestory::techniques::preview::PreviewMethod",
    ],
    settings: &[
        "clerestory::techniques::preview::PreviewSettings",
        "clerestory::techniques::preview::PreviewDesc",
        "clerestory render --technique preview",
    ],
    ..Row::of("engine/src/techniques/preview/mod.rs")
}];
