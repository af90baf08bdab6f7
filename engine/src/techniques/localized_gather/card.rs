//! The localised gather as a technique.

use std::collections::BTreeMap;

use super::LocalizedGather;
use super::settings::LocalizedGatherSettings;
use crate::catalogue::{Role, Row, sources};
use crate::gpu::shaders::techniques::localized_gather::localized_gather;
use crate::scene::SceneProfile;
use crate::settings::SettingsDecl;
use crate::techniques::impostors::{self, capture};
use crate::techniques::path::card as path;
use crate::techniques::{Bias, Card, Foresight, Skipped, Technique, Variant, reasons};
use crate::transport::PathSet;
/// The catalogue's entry.
pub(in crate::techniques) const CARD: Card = Card {
    id: "localized-gather",
    summary: "direct light, and light of one scattering more from the texels of a coarse map as area lights, seen from each point",
    rows: &[ROWS],
    bias: BIAS,
    needs: capture::NEEDS,
    kernels: &[&path::KERNELS, &capture::KERNELS, &[&localized_gather::INFO]],
    path_set: PathSet::DIRECT_AND_ROUGH,
    refusals,
    settings: SettingsDecl::of::<LocalizedGatherSettings>(),
    variants: &[Variant::DEFAULTS],
    foresight: Foresight::PLAIN,
    create: |gpu, scene, view, settings| {
        let mut settings: LocalizedGatherSettings = settings.read()?;
        settings.seed = view.seed;
        settings.aovs = view.aovs;
        Ok(Box::new(LocalizedGather::new(
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
    "nothing hides a light from the point, what the map's place does not see is not there, each texel is one disc of even radiance, and lobes are powers of cosines",
);

/// The path set as path sets are written.
const DISPLAYED: &str = "L([SV]?|.?[DG])E";

/// Why a scene cannot be modelled.
pub(super) fn refusals(profile: &SceneProfile) -> Vec<String> {
    let mut all = impostors::map_refusals(profile);
    all.extend(reasons(&[
        (
            profile.has_phong,
            "the lobes that stand for microfacets are as wide as GGX's, not as modified Phong lobes",
        ),
        (
            profile.has_classic_microfacets,
            "the lobes that stand for microfacets are as wide as GGX's, not as those of classical microfacets",
        ),
    ]));
    all
}

impl Technique for LocalizedGather {
    forward_to_methods!(LocalizedGather);

    fn path_set(&self) -> PathSet {
        LocalizedGather::path_set(self)
    }

    fn counters(&self) -> BTreeMap<&'static str, u64> {
        LocalizedGather::counters(self)
    }

    fn skipped(&self) -> Vec<Skipped> {
        LocalizedGather::skipped(self)
    }
}

/// Rows of the catalogue.
const ROWS: &[Row] = &[Row {
    id: "CL-LOCALIZED-GATHER",
    name: "technique `localized-gather`: direct light, and light of one scattering more by a localised gather",
    role: Role::Technique,
    limits: "Nothing hides a light from the point that gathers; one layer of surfaces as the map's place sees them, by an octahedron.",
    sources: &[sources::SZIRMAY_KALOS_LAZANYI_2006.whole()],
    shaders: &[
        "shaders/techniques/localized_gather/",
        "shaders/techniques/path/",
        "shaders/walk/",
        "shaders/maps/gather.glsl",
        "shaders/maps/gather_few.glsl",
        "shaders/transport/microfacet_albedo.glsl",
    ],
    path_set: Some(DISPLAYED),
    bias: Some(BIAS),
    needs: capture::NEEDS,
    tests: &[
        "tests/tests/impostor_pictures/gathers.rs::diffuse_rooms_have_the_path_tracers_light_within_the_stated_bias",
        "tests/tests/impostor_pictures/gathers.rs::spheres_of_one_map_are_told_apart_by_their_places",
        "tests/tests/impostor_pictures/gathers.rs::emission_is_never_counted_twice",
        "tests/tests/impostor_pictures/gathers.rs::spheres_about_the_maps_place_have_the_stated_bias",
        "tests/tests/impostor_pictures/gathers.rs::five_terms_keep_the_light_of_a_rough_metal",
        "tests/tests/impostor_pictures/gathers.rs::even_surroundings_keep_their_albedo_at_grazing_views",
        "tests/tests/impostor_pictures/gathers.rs::what_is_behind_a_surface_does_not_shine_on_it",
        "tests/tests/impostor_pictures/edge_cases.rs::what_cannot_be_is_refused_by_name",
        "tests/tests/impostor_pictures/edge_cases.rs::maps_of_gathers_have_no_normals_unasked",
        "tests/tests/impostor_pictures/reflections.rs::scale_changes_nothing",
        "tests/tests/impostor_pictures/bits.rs::bits_are_the_same_whoever_does_the_work",
        "tests/tests/impostor_pictures/bits.rs::bits_of_maps_by_rays_are_the_same_whoever_does_the_work",
        "engine/src/techniques/localized_gather/settings.rs::bad_settings_are_refused_by_name",
        "engine/src/techniques/localized_gather/settings.rs::the_map_has_no_path_of_the_eye",
    ],
    api: &["clerestory::techniques::localized_gather::LocalizedGather"],
    settings: &[
        "clerestory::techniques::localized_gather::LocalizedGatherSettings",
        "clerestory render --technique localized-gather",
    ],
    ..Row::of("engine/src/techniques/localized_gather/mod.rs")
}];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_path_set_is_that_of_its_expression_and_of_the_default_settings() {
        assert_eq!(CARD.path_set, "LE|L.E|L.[DG]E".parse().unwrap());
        assert_eq!(CARD.path_set, LocalizedGatherSettings::default().path_set().unwrap());
    }
}
