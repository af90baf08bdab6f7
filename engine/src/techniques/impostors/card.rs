//! Reflections by distance impostors as a technique.

use std::collections::BTreeMap;

use super::ImpostorReflections;
use super::capture;
use super::settings::ReflectionSettings;
use crate::catalogue::{Role, Row, sources};
use crate::gpu::shaders::techniques::impostors::impostor_reflect;
use crate::scene::SceneProfile;
use crate::settings::SettingsDecl;
use crate::techniques::path::card as path;
use crate::techniques::{Bias, Card, Foresight, Skipped, Technique, Variant, reasons};
use crate::transport::PathSet;
/// The catalogue's entry.
pub(in crate::techniques) const CARD: Card = Card {
    id: "impostor",
    summary: "direct light, and reflections of smooth surfaces by a map of radiance and distance, in which reflected rays are followed",
    rows: &[ROWS],
    bias: BIAS,
    needs: capture::NEEDS,
    kernels: &[&path::KERNELS, &capture::KERNELS, &[&impostor_reflect::INFO]],
    path_set: PathSet::DIRECT_AND_MIRRORED,
    refusals,
    settings: SettingsDecl::of::<ReflectionSettings>().lifting(|settings, reason| {
        reason == TRANSMITS
            && settings
                .read::<ReflectionSettings>()
                .is_ok_and(|settings| settings.refracts)
    }),
    variants: &[Variant::DEFAULTS],
    foresight: Foresight::PLAIN,
    create: |gpu, scene, view, settings| {
        let mut settings: ReflectionSettings = settings.read()?;
        settings.seed = view.seed;
        settings.aovs = view.aovs;
        Ok(Box::new(ImpostorReflections::new(
            gpu,
            scene,
            view.camera,
            view.size,
            settings,
        )?))
    },
};

/// The causes, as the module's documentation has them.
const BIAS: Bias = Bias::Biased(
    "what the map's place does not see is not there, radiance is that towards the map's place, searches end beside surfaces, and rasterized maps have the preview's shadows",
);

/// The path set as path sets are written.
const DISPLAYED: &str = "L(S?|[^S]|.S)E";

/// Why surfaces that transmit are refused, unless rays are refracted.
const TRANSMITS: &str = "surfaces transmit light, and nothing is followed through them without the setting `refracts`";
/// The same for what refracts none.
const NEVER_REFRACTS: &str = "surfaces transmit light, and nothing is followed through them";

/// Why a scene cannot be modelled with default settings.
fn refusals(profile: &SceneProfile) -> Vec<String> {
    refusals_with(profile, false)
}

/// The same where rays may be refracted.
pub(super) fn refusals_with(profile: &SceneProfile, refracts: bool) -> Vec<String> {
    refusals_of(profile, (!refracts).then_some(TRANSMITS))
}

/// Why a scene cannot be modelled by a map of its surfaces alone.
pub(in crate::techniques) fn map_refusals(profile: &SceneProfile) -> Vec<String> {
    refusals_of(profile, Some(NEVER_REFRACTS))
}

fn refusals_of(profile: &SceneProfile, transmits: Option<&str>) -> Vec<String> {
    reasons(&[
        (
            profile.media.any(),
            "the scene has participating media, and the map holds surfaces only",
        ),
        (
            profile.has_transmission() && transmits.is_some(),
            transmits.unwrap_or_default(),
        ),
        (
            profile.keeps_instances,
            "the map is drawn triangle by triangle, and the scene keeps its instances; with another ray index, such as `wide`, they are flattened",
        ),
    ])
}

impl Technique for ImpostorReflections {
    forward_to_methods!(ImpostorReflections);

    fn path_set(&self) -> PathSet {
        ImpostorReflections::path_set(self)
    }

    fn counters(&self) -> BTreeMap<&'static str, u64> {
        ImpostorReflections::counters(self)
    }

    fn skipped(&self) -> Vec<Skipped> {
        ImpostorReflections::skipped(self)
    }
}

/// Rows of the catalogue.
const ROWS: &[Row] = &[
    Row {
        id: "CL-IMPOSTOR",
        name: "technique `impostor`: direct light, and reflections of smooth surfaces by a distance impostor",
        role: Role::Technique,
        limits: "The map is an octahedron of few layers of surfaces, by default one, so that what its place does not see is not there; reflecting bodies do not show in reflections, and what refracts has one interface and absorbs nothing of the light on its way to what lies within.",
        sources: &[
            sources::SZIRMAY_KALOS_2005.whole(),
            sources::UMENHOFFER_2007.at("chapter 17"),
        ],
        shaders: &[
            "shaders/techniques/impostors/",
            "shaders/techniques/path/",
            "shaders/walk/",
            "shaders/maps/impostor.glsl",
            "shaders/maps/impostor_set.glsl",
        ],
        path_set: Some(DISPLAYED),
        bias: Some(BIAS),
        needs: capture::NEEDS,
        tests: &[
            "tests/tests/impostor_pictures/reflections.rs::mirrors_in_a_diffuse_room_show_what_the_path_tracer_shows",
            "tests/tests/impostor_pictures/reflections.rs::directions_err_as_published",
            "tests/tests/impostor_pictures/edge_cases.rs::what_cannot_be_is_refused_by_name",
            "tests/tests/impostor_pictures/refractions.rs::second_interfaces_are_refused",
            "tests/tests/impostor_pictures/refractions.rs::a_pane_shows_what_lies_behind_it",
            "tests/tests/impostor_pictures/refractions.rs::what_is_seen_in_a_pool_is_absorbed_on_the_way",
            "engine/src/techniques/impostors/interfaces.rs::numbers_are_found_in_ranges_in_their_order",
            "tests/tests/impostor_pictures/edge_cases.rs::glossy_surroundings_are_mirrored_as_the_maps_place_sees_them",
            "tests/tests/impostor_pictures/edge_cases.rs::hard_places_degrade_as_documented",
            "tests/tests/impostor_pictures/bits.rs::bits_are_the_same_whoever_does_the_work",
            "tests/tests/impostor_pictures/bits.rs::bits_of_maps_by_rays_are_the_same_whoever_does_the_work",
            "engine/src/techniques/impostors/settings.rs::bad_settings_are_refused_by_name",
            "engine/src/techniques/impostors/settings.rs::places_are_about_the_scene",
            "engine/src/techniques/impostors/settings.rs::eye_paths_are_part_of_the_picture_and_bounces_are_those_of_the_map",
        ],
        api: &["clerestory::techniques::impostors::ImpostorReflections"],
        settings: &[
            "clerestory::techniques::impostors::ReflectionSettings",
            "clerestory render --technique impostor",
        ],
        ..Row::of("engine/src/techniques/impostors/mod.rs")
    },
    Row {
        id: "CL-CAPTURE",
        name: "maps of what a place sees: distances and normals drawn, radiance drawn or by rays, objects left out",
        role: Role::PartOf("CL-IMPOSTOR"),
        limits: "Radiance at texels' middles, so that borders of shadows are up to half a texel off: one that glass magnifies is 5 % RMS of its picture with 512² texels and 2 % with 1024² by rays, 6 and 5 % drawn, with the borders of shadow maps of 1024²; drawn maps have light of points, spots and directions alone.",
        sources: &[
            sources::SZIRMAY_KALOS_2005.whole(),
            sources::ENGELHARDT_DACHSBACHER_2008.whole(),
        ],
        shaders: &[
            "shaders/techniques/path/path_directions.comp",
            "shaders/techniques/preview/preview_shade.comp",
            "shaders/raster/surface_octant.vert",
            "shaders/raster/surface.vert",
        ],
        bias: Some(Bias::Biased(
            "radiance at texels' middles; the preview's shadows where it is drawn",
        )),
        needs: capture::NEEDS,
        tests: &[
            "engine/src/techniques/impostors/draw.rs::parts_are_all_but_what_is_left_out",
            "tests/tests/impostor_pictures/reflections.rs::area_lights_and_skies_are_mirrored_by_rays",
            "tests/tests/impostor_pictures/reflections.rs::maps_of_places_under_a_sun_are_drawn_with_its_shadows",
            "tests/tests/impostor_pictures/reflections.rs::scale_changes_nothing",
            "tests/tests/impostor_pictures/edge_cases.rs::without_a_reflector_there_is_no_map",
            "tests/tests/impostor_pictures/edge_cases.rs::hard_places_give_finite_pictures",
            "tests/tests/impostor_pictures/edge_cases.rs::maps_beyond_a_storage_buffers_range_are_refused",
            "tests/tests/impostor_pictures/edge_cases.rs::maps_of_gathers_have_no_normals_unasked",
            "tests/tests/impostor_pictures/edge_cases.rs::maps_tell_what_they_took",
        ],
        settings: &["capture", "side", "capture_samples", "shadow_side", "bounces"],
        ..Row::of("engine/src/techniques/impostors/capture.rs")
    },
    Row {
        id: "CL-PEELED-CAPTURE",
        name: "further layers of surfaces of a map: behind each the next one, by rays",
        role: Role::PartOf("CL-IMPOSTOR"),
        limits: "Four layers at most, in maps captured by rays; alpha is not looked at, and surfaces that nearly touch are one.",
        sources: &[sources::EVERITT_2001.whole(), sources::SZIRMAY_KALOS_2009.whole()],
        shaders: &[
            "shaders/accel/trace_rays.comp",
            "shaders/techniques/path/path_directions.comp",
        ],
        bias: Some(Bias::Biased(
            "what lies behind more surfaces than there are layers is not there",
        )),
        tests: &[
            "engine/src/techniques/impostors/peel.rs::paths_begin_between_layers",
            "tests/tests/impostor_pictures/reflections.rs::layers_show_what_a_pillar_hides",
        ],
        settings: &["layers"],
        ..Row::of("engine/src/techniques/impostors/peel.rs")
    },
];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_path_set_is_that_of_its_expression_and_of_the_default_settings() {
        assert_eq!(CARD.path_set, "LE|L.E|L.SE".parse().unwrap());
        assert_eq!(CARD.path_set, ReflectionSettings::default().path_set().unwrap());
    }
}
