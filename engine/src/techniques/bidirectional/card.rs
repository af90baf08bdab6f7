//! Bidirectional path tracing as a technique.

use std::collections::BTreeMap;

use super::mis;
use super::renderer::BidirectionalPaths;
use super::settings::BidirectionalSettings;
use super::splats::sums_within;
use crate::catalogue::{Role, Row, sources};
use crate::gpu::interface::ShaderInfo;
use crate::gpu::shaders::techniques::bidirectional::{
    bdpt_add, bdpt_append, bdpt_camera, bdpt_connect, bdpt_emit, bdpt_eye_medium, bdpt_medium_camera,
    bdpt_medium_connect, bdpt_scatter, bdpt_shade, bdpt_splat, bdpt_walk_medium,
};
use crate::gpu::shaders::techniques::path::{path_camera, path_resolve};
use crate::gpu::shaders::walk::{compact_count, compact_scan, compact_scatter, extend, shadow};
use crate::scene::SceneProfile;
use crate::settings::SettingsDecl;
use crate::techniques::path::unseen::unseen_of_lights;
use crate::techniques::skipped::skipped;
use crate::techniques::{Bias, Card, Foresight, Law, Skipped, Technique, Variant, reasons};
use crate::transport::{PathSet, SURFACE_FEATURES};
/// The catalogue's entry.
pub(in crate::techniques) const CARD: Card = Card {
    id: "bdpt",
    summary: "bidirectional path tracing: paths made from both ends in every way, weighted by the balance heuristic",
    rows: &[ROWS, mis::ROWS],
    bias: BIAS,
    needs: &[],
    kernels: &[&KERNELS],
    path_set: PathSet::ALL,
    refusals,
    settings: SettingsDecl::of::<BidirectionalSettings>(),
    variants: &[Variant::DEFAULTS],
    foresight: Foresight {
        misses: |profile, lights, wanted| unseen_of_lights(profile, lights, wanted, BETWEEN_MIRRORS, BY_NO_JOINT),
        law: |settings| {
            let settings: BidirectionalSettings = settings.read()?;
            Ok(Law {
                samples_a_pass: settings.samples_of_pass(),
                // All pixels have the light subpaths of a pass.
                shares_noise: true,
                ..Law::INDEPENDENT
            })
        },
        fits: |caps, size| sums_within(caps, size).map(|_| ()),
        pilot: |settings, picture, pilot| {
            let settings: BidirectionalSettings = settings.read()?;
            Ok(settings.of_pilot(picture, pilot).into())
        },
    },
    create: |gpu, scene, view, settings| {
        let mut settings: BidirectionalSettings = settings.read()?;
        settings.seed = view.seed;
        settings.aovs = view.aovs;
        Ok(Box::new(BidirectionalPaths::new(
            gpu,
            scene,
            view.camera,
            view.size,
            settings,
        )?))
    },
};

/// Light off mirrors onto surfaces, or into media, that are seen in mirrors alone: nowhere two vertices follow each other that can be joined.
const BETWEEN_MIRRORS: &str = "LS+([DGV]S+)+E";
const BY_NO_JOINT: &str = "by way of mirrors and smooth glass onto what is seen in such, like caustics behind glass: no subpaths of eye and light can be joined there";

/// Why a scene cannot be modelled.
pub(super) fn refusals(profile: &SceneProfile) -> Vec<String> {
    let from_infinity = profile.has_environment() || profile.lights.directional > 0;
    reasons(&[(
        profile.media.surrounding && from_infinity,
        "the scene has endless participating media and light from infinity, which no light subpath brings through them",
    )])
}

/// What a picture may take with default settings, of whatever scene.
const KERNELS: [&ShaderInfo; 19] = [
    &path_camera::INFO,
    &extend::INFO,
    &shadow::INFO,
    &compact_count::INFO,
    &compact_scan::INFO,
    &compact_scatter::INFO,
    &path_resolve::INFO,
    &bdpt_emit::INFO,
    &bdpt_scatter::INFO,
    &bdpt_append::INFO,
    &bdpt_camera::INFO,
    &bdpt_splat::INFO,
    &bdpt_add::INFO,
    &bdpt_connect::INFO,
    &bdpt_shade::INFO,
    &bdpt_walk_medium::INFO,
    &bdpt_eye_medium::INFO,
    &bdpt_medium_connect::INFO,
    &bdpt_medium_camera::INFO,
];

impl Technique for BidirectionalPaths {
    forward_to_methods!(BidirectionalPaths);

    fn path_set(&self) -> PathSet {
        BidirectionalPaths::path_set(self)
    }

    fn counters(&self) -> BTreeMap<&'static str, u64> {
        let c = self.counts();
        BTreeMap::from([
            ("paths", c.paths),
            ("extend_rays", c.extend_rays),
            ("shadow_rays", c.shadow_rays),
            ("light_rays", c.light_rays),
            ("rays", c.extend_rays + c.shadow_rays + c.light_rays),
            ("waves", c.waves),
            ("stalls", c.stalls),
            ("postponed", c.postponed),
            ("light_paths", c.light_paths),
            ("light_vertices", c.light_vertices),
            ("vertices_in_view", c.vertices_in_view),
            ("connections", c.connections),
            ("collisions", c.collisions),
        ])
    }

    fn skipped(&self) -> Vec<Skipped> {
        let pipelines = BidirectionalPaths::pipelines(self);
        let mut skipped = skipped(&pipelines, bdpt_shade::INFO.name, &SURFACE_FEATURES);
        if !self.has_light_paths() {
            skipped.push(Skipped {
                what: "light subpaths",
                why: "no light can be chosen, or the picture has nothing of theirs",
            });
        }
        skipped
    }
}

const BIAS: Bias = Bias::Unbiased;

/// Rows of the catalogue.
const ROWS: &[Row] = &[
    Row {
        id: "CL-BDPT",
        name: "technique `bdpt`: bidirectional path tracing on surfaces and in media, all ways to make a path weighted by the balance heuristic",
        role: Role::Technique,
        limits: "Refuses light from infinity in endless media; chooses among many lights by power alone; mirrors and smooth glass are joined to nothing, so that light of sources without area is missing that a mirror or smooth glass throws onto what is seen in another; a light subpath for each pixel and sample up to 65,536 a pass, of which large pictures have less; each sample has light subpaths of its own, which costs where light arrives directly.",
        sources: &[
            sources::LAFORTUNE_WILLEMS_1993.whole(),
            sources::VEACH_1997.at("chapters 9 and 10"),
            sources::GEORGIEV_2012.whole(),
            sources::DAVIDOVIC_2014.at("§4: a cache of light vertices"),
        ],
        shaders: &[
            "shaders/techniques/bidirectional/",
            "shaders/transport/emission.glsl",
            "shaders/techniques/path/path_camera.comp",
            "shaders/techniques/path/path_resolve.comp",
            "shaders/walk/",
        ],
        path_set: Some("all"),
        bias: Some(BIAS),
        tests: &[
            "tests/tests/bidirectional/agreement.rs::lights_in_a_lambert_sphere_fill_it_evenly",
            "tests/tests/bidirectional/agreement.rs::lamps_agree_with_the_path_tracer",
            "tests/tests/bidirectional/agreement.rs::defaults_and_more_connections_agree_with_the_path_tracer",
            "tests/tests/bidirectional/agreement.rs::lights_without_area_and_skies_agree_with_the_path_tracer",
            "tests/tests/bidirectional/agreement.rs::materials_of_all_kinds_agree_with_the_path_tracer",
            "tests/tests/bidirectional/agreement.rs::bodies_that_absorb_agree_with_the_path_tracer",
            "tests/tests/bidirectional/path_sets.rs::expressions_agree_with_the_path_tracer",
            "tests/tests/bidirectional/path_sets.rs::expressions_in_grids_agree_with_the_path_tracer",
            "tests/tests/bidirectional/path_sets.rs::parts_of_the_light_sum_to_the_whole",
            "tests/tests/bidirectional/media.rs::fog_agrees_with_the_path_tracer",
            "engine/src/techniques/bidirectional/settings.rs::path_sets_and_ranges_of_bounces_are_one_set",
            "engine/src/techniques/bidirectional/settings.rs::joints_need_light_subpaths_and_two_scatterings",
            "engine/src/techniques/bidirectional/settings.rs::light_subpaths_are_as_many_as_there_is_room_for_their_vertices",
            "engine/src/techniques/bidirectional/settings.rs::pilots_have_as_many_light_subpaths_a_pixel_as_the_picture",
            "tests/tests/bidirectional/edge_cases.rs::pictures_do_not_depend_on_how_the_work_is_cut_up",
            "tests/tests/bidirectional/edge_cases.rs::vertices_beyond_what_there_is_room_for_are_not_lost",
            "tests/tests/bidirectional/edge_cases.rs::scenes_without_lights_or_reflection_have_nothing_to_join",
            "tests/tests/bidirectional/edge_cases.rs::what_cannot_be_modelled_is_refused_by_name",
        ],
        api: &["clerestory::techniques::bidirectional::BidirectionalPaths"],
        settings: &[
            "clerestory::techniques::bidirectional::BidirectionalSettings",
            "clerestory render --technique bdpt",
        ],
        ..Row::of("engine/src/techniques/bidirectional/renderer.rs")
    },
    Row {
        id: "CL-BDPT-MEDIA",
        name: "bidirectional path tracing in media: collisions of eye paths and light subpaths are vertices, joined to each other, to surfaces, lights and the camera through what media let through",
        role: Role::PartOf("CL-BDPT"),
        limits: "Weights have phase functions and squared distances, and nothing of free flights: no bias comes of it, in media of whatever colour and density, but dense media have more noise than with the probability of flights in them; what media emit is found by eye paths alone; light from infinity in endless media is refused.",
        sources: &[
            sources::LAFORTUNE_WILLEMS_1996.whole(),
            sources::GEORGIEV_2012.whole(),
            sources::VEACH_1997.at("chapter 10"),
        ],
        shaders: &[
            "shaders/techniques/bidirectional/bdpt_walk_medium.comp",
            "shaders/techniques/bidirectional/bdpt_eye_medium.comp",
            "shaders/techniques/bidirectional/bdpt_medium_connect.comp",
            "shaders/techniques/bidirectional/bdpt_medium_camera.comp",
            "shaders/techniques/bidirectional/bdpt_ends.glsl",
            "shaders/techniques/bidirectional/bdpt_joint.glsl",
            "shaders/techniques/bidirectional/bdpt_sight.glsl",
            "shaders/walk/flight.glsl",
            "shaders/walk/medium_ray.glsl",
        ],
        bias: Some(BIAS),
        tests: &[
            "engine/src/techniques/bidirectional/rod.rs::all_ways_to_make_paths_through_fog_find_what_it_lets_through",
            "engine/src/techniques/bidirectional/eye.rs::states_of_connections_fit_a_binding",
            "tests/tests/bidirectional/media.rs::fog_agrees_with_the_path_tracer",
            "tests/tests/bidirectional/media.rs::grids_agree_with_the_path_tracer",
            "tests/tests/bidirectional/media.rs::bodies_in_fog_agree_with_the_path_tracer",
            "tests/tests/bidirectional/media.rs::cameras_in_bodies_of_fog_agree_with_the_path_tracer",
            "tests/tests/bidirectional/media.rs::lenses_and_parallel_light_meet_bodies_of_fog",
            "tests/tests/bidirectional/media.rs::media_that_emit_agree_with_the_path_tracer",
            "tests/tests/bidirectional/media.rs::furnaces_with_fog_are_even",
            "tests/tests/bidirectional/media.rs::each_way_to_make_a_path_in_fog_finds_the_same_light",
            "tests/tests/bidirectional/media.rs::joined_collisions_find_all_that_is_scattered_twice",
            "tests/tests/bidirectional/media.rs::caustics_of_a_tiny_lamp_in_fog_are_those_of_photons",
            "tests/tests/bidirectional/media.rs::pictures_of_media_do_not_depend_on_how_the_work_is_cut_up",
            "tests/tests/bidirectional/media.rs::threads_of_the_driver_never_show_in_media",
            "tests/tests/bidirectional/media.rs::scenes_without_media_have_nothing_of_them",
            "tests/tests/bidirectional/media.rs::what_media_have_no_light_subpaths_for_is_refused_by_name",
        ],
        ..Row::of("engine/src/techniques/bidirectional/light_paths.rs")
    },
    Row {
        id: "CL-LIGHT-SPLATS",
        name: "light subpaths that meet the camera, summed by integers: the same bits in whatever order",
        role: Role::PartOf("CL-BDPT"),
        limits: "Steps are 2⁻⁴⁰ of the greatest contribution of a pass; pictures whose sums, 24 bytes a pixel, pass a buffer of the device are refused.",
        sources: &[sources::VEACH_1997.at("10.3.2")],
        shaders: &[
            "shaders/techniques/bidirectional/bdpt_camera.comp",
            "shaders/techniques/bidirectional/bdpt_medium_camera.comp",
            "shaders/techniques/bidirectional/bdpt_sight.glsl",
            "shaders/techniques/bidirectional/bdpt_splat.comp",
            "shaders/techniques/bidirectional/bdpt_add.comp",
        ],
        tests: &[
            "tests/tests/bidirectional/strategies.rs::light_subpaths_meet_cameras_of_all_kinds",
            "tests/tests/bidirectional/edge_cases.rs::threads_of_the_driver_never_show",
            "tests/tests/bidirectional/edge_cases.rs::passes_have_as_many_samples_as_there_are_sums_for",
        ],
        ..Row::of("engine/src/techniques/bidirectional/splats.rs")
    },
];

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene;

    #[test]
    fn pilots_have_light_subpaths_as_their_picture() {
        let settings = BidirectionalSettings::default().into();
        let of_pilot = (CARD.foresight.pilot)(&settings, [1920, 1080], [170, 96]).unwrap();
        assert_eq!(of_pilot.read::<BidirectionalSettings>().unwrap().light_paths, 516);
    }

    #[test]
    fn caustics_behind_glass_are_said_to_be_missed_and_those_in_view_are_not() {
        let missed = |address: &str, wanted: &str| -> Option<String> {
            let scene = scene::load(address).unwrap();
            let profile = SceneProfile::of(&scene);
            (CARD.foresight.misses)(&profile, &scene.lights, &wanted.parse().unwrap()).unwrap()
        };
        let glass = "builtin:cornell-box?sphere=glass&source=point";
        assert!(missed(glass, "all").expect("missed").contains("point light"));
        assert_eq!(missed(glass, "LS+DE"), None);
        // In fog light that glass sends there is seen, but for that which is seen through glass.
        let fog = "builtin:fog-box?sphere=glass&source=point";
        assert_eq!(missed(fog, "LS+VE"), None);
        assert!(missed(fog, "LS+VS+E").is_some());
        assert_eq!(missed("builtin:cornell-box?sphere=glass", "all"), None);
    }
}
