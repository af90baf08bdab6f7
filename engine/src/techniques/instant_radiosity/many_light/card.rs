//! Frames of many lights as a technique.

use std::collections::BTreeMap;

use super::{Interleaving, ManyLight, ManyLightSettings, Placement, Visibility};
use crate::Result;
use crate::catalogue::{Role, Row, sources};
use crate::gpu::Caps;
use crate::gpu::interface::ShaderInfo;
use crate::gpu::shaders::raster::{surface_frag, surface_vert};
use crate::gpu::shaders::techniques::instant_radiosity::{
    deferred_direct, deferred_gather, deferred_merge, deferred_split, vpl_append,
};
use crate::gpu::shaders::techniques::photon_mapping::{photon_emit, photon_scatter};
use crate::gpu::shaders::types::GatherState;
use crate::gpu::shaders::walk::{compact_count, compact_scan, compact_scatter, extend};
use crate::scene::SceneProfile;
use crate::settings::{Settings, SettingsDecl};
use crate::techniques::foresight::frame_fits;
use crate::techniques::skipped::skipped;
use crate::techniques::{Bias, Card, Foresight, Law, Skipped, Technique, Variant, reasons};
use crate::transport::{PathSet, SURFACE_FEATURES};
/// The causes, as the module's documentation has them.
const BIAS: Bias = Bias::Biased(
    "what the bound of the geometry term leaves out is not compensated; the filter averages the light of neighbouring pixels on a surface; \
     visibility by maps errs at borders of shadows by their texels, by imperfect ones also by what their points miss or hang over, and without any light goes through \
     everything; by reflective shadow maps a texel's middle stands for all of the texel; lights that are kept stand for all directions in every frame; \
     with a history light lags behind what changes; silhouettes are the rasterizer's, off by parts of a pixel",
);

const NEEDS: &[&str] = &["VK_QUEUE_GRAPHICS_BIT"];

/// What a picture may take with default settings, of whatever scene.
const KERNELS: [&ShaderInfo; 13] = [
    &photon_emit::INFO,
    &photon_scatter::INFO,
    &vpl_append::INFO,
    &extend::INFO,
    &compact_count::INFO,
    &compact_scan::INFO,
    &compact_scatter::INFO,
    &surface_vert::INFO,
    &surface_frag::INFO,
    &deferred_direct::INFO,
    &deferred_split::INFO,
    &deferred_gather::INFO,
    &deferred_merge::INFO,
];

/// The catalogue's entry.
pub(in crate::techniques) const CARD: Card = Card {
    id: "many-light",
    summary: "many lights on a deferred frame: direct light and one reflection more, or several, of virtual lights from walks, from reflective shadow maps or kept from frame to frame that are shared out among interleaved tiles, with shadow rays, shadow maps, imperfect ones or nothing",
    rows: &[ROWS],
    bias: BIAS,
    needs: NEEDS,
    kernels: &[&KERNELS],
    path_set: PathSet::UP_TO_TWO_ROUGH,
    refusals,
    settings: SettingsDecl::of::<ManyLightSettings>(),
    variants: &[Variant::DEFAULTS],
    foresight: Foresight {
        fits,
        law,
        ..Foresight::PLAIN
    },
    create: |gpu, scene, view, settings| {
        let mut settings: ManyLightSettings = settings.read()?;
        settings.seed = view.seed;
        let technique = ManyLight::new(gpu, scene, view.camera, view.size, settings)?;
        Ok(Box::new(technique))
    },
};

/// Refuses pictures that are larger than a storage buffer, or whose split ones are.
fn fits(caps: &Caps, size: [u32; 2]) -> Result<()> {
    frame_fits(caps, size)?;
    let places = Interleaving::new(size, ManyLightSettings::default().interleave).places();
    caps.check_storage("split states", places * size_of::<GatherState>() as u64)
}

/// Frames are independent, and pixels of a tile have the lights of one; lights that are kept bring the same error in all of them.
fn law(settings: &Settings) -> Result<Law> {
    // What is wrong with settings is said where they are used.
    let read = settings.read::<ManyLightSettings>();
    let stays = read.is_ok_and(|settings| settings.placement == Placement::Incremental);
    Ok(Law {
        slope: if stays { 0.0 } else { Law::INDEPENDENT.slope },
        shares_noise: true,
        ..Law::INDEPENDENT
    })
}

/// Why a scene cannot be modelled.
pub(super) fn refusals(profile: &SceneProfile) -> Vec<String> {
    reasons(&[
        (
            profile.media.any(),
            "the scene has participating media, and this technique's virtual lights lie on surfaces only; technique `vpl` has them at collisions, too",
        ),
        (
            profile.has_unlit,
            "unlit surfaces send light that no walk from the lights brings",
        ),
        (profile.alpha.blend, "partial alpha is drawn opaque"),
        (
            profile.keeps_instances,
            "it draws triangle by triangle, and the scene keeps its instances; with another ray index, such as `wide`, they are flattened",
        ),
    ])
}

impl Technique for ManyLight {
    forward_to_methods!(ManyLight);

    fn path_set(&self) -> PathSet {
        ManyLight::path_set(self)
    }

    fn counters(&self) -> BTreeMap<&'static str, u64> {
        let c = self.counts();
        BTreeMap::from([
            ("frames", c.frames),
            ("walks", c.walks.emitted),
            ("walk_rays", c.walks.rays),
            ("walks_escaped", c.walks.escaped),
            ("walks_absorbed", c.walks.absorbed),
            ("views_of_lights", c.views),
            ("virtual_lights", c.lights),
            ("kept_lights_renewed", c.renewed),
            ("kept_lights_asked", c.sight_rays),
            ("chain_rays", c.chain_rays),
            ("connections", c.connections),
            ("visibility_tests", c.visibility_tests),
            ("shadow_maps", c.maps),
            ("splats", c.splats),
            ("passes", c.passes),
            ("bytes_between_passes", self.bytes()),
        ])
    }

    fn skipped(&self) -> Vec<Skipped> {
        let (pipelines, settings) = (ManyLight::pipelines(self), ManyLight::settings(self));
        let shader = match self.has_direct_light() {
            true => deferred_direct::INFO.name,
            false => deferred_gather::INFO.name,
        };
        let mut all = skipped(&pipelines, shader, &SURFACE_FEATURES);
        let (lights, discs) = (self.has_virtual_lights(), self.has_discs());
        let further = [
            (
                !self.has_direct_light(),
                "direct light",
                "nothing sends any, or the picture has none of it",
            ),
            (
                !lights && !discs,
                "virtual lights",
                "no light can be chosen, or the picture has nothing of theirs",
            ),
            (discs, "virtual lights", "pixels gather from reflective shadow maps"),
            (
                lights && matches!(settings.visibility, Visibility::None | Visibility::Rays),
                "shadow maps of virtual lights",
                "they were not asked for",
            ),
            (
                lights && settings.placement == Placement::Walks,
                "reflective shadow maps",
                "virtual lights come from walks",
            ),
            (
                lights
                    && settings.placement == Placement::Incremental
                    && !matches!(settings.visibility, Visibility::None | Visibility::Rays)
                    && !self.keeps_maps(),
                "shadow maps that stay from frame to frame",
                "there are more lights than maps fit in memory at the same time",
            ),
            (
                lights && settings.placement == Placement::Incremental,
                "walks and reflective shadow maps",
                "virtual lights are kept from frame to frame",
            ),
            (
                lights && !settings.has_history(),
                "history of indirect light",
                "it was not asked for",
            ),
            (
                lights && !self.has_reservoirs() && !settings.filters(),
                "filter of neighbouring pixels",
                "it was not asked for, or all pixels have all lights",
            ),
            (
                self.has_reservoirs(),
                "tiles, and the filter of neighbouring pixels",
                "pixels take their light from reservoirs",
            ),
            (true, "albedo, normal and depth", "frames hold only radiance"),
        ];
        let missing = further.into_iter().filter(|(is_missing, ..)| *is_missing);
        all.extend(missing.map(|(_, what, why)| Skipped { what, why }));
        all
    }
}

/// [`PathSet::UP_TO_TWO_ROUGH`] as path sets are written.
const DISPLAYED: &str = "bounces=0..2,lobes=diffuse+glossy+reflection+transmission";

/// Rows of the catalogue.
const ROWS: &[Row] = &[
    Row {
        id: "SVO-P12",
        name: "technique `many-light`: deferred frames, on a G-buffer (SVO-P6), of direct light and of one reflection more, or several, by virtual lights, new for each frame or kept",
        role: Role::Technique,
        limits: "Paths by lobes other than mirrors; one indirect bounce of reflective shadow maps and of kept lights, any number of walks and of chains, of which a tile has had all parts after as many frames as there are tiles; media, unlit surfaces, partial alpha and kept instances are refused; the bound is not compensated; frames wait for the device, as the count of lights is read back between walks and gather, so that they have steps of their own and cannot be recorded into a host's command buffer.",
        sources: &[
            sources::KELLER_1997.whole(),
            sources::SAITO_TAKAHASHI_1990.whole(),
            sources::SUN_2015.at("§3.3 and §4.10"),
        ],
        shaders: &[
            "shaders/techniques/instant_radiosity/",
            "shaders/techniques/photon_mapping/photon_emit.comp",
            "shaders/techniques/photon_mapping/photon_scatter.comp",
            "shaders/walk/",
            "shaders/raster/surface.vert",
            "shaders/raster/surface.frag",
        ],
        path_set: Some(DISPLAYED),
        bias: Some(BIAS),
        needs: NEEDS,
        tests: &[
            "tests/tests/instant_radiosity/many_light.rs::frames_with_rays_are_the_path_tracers",
            "tests/tests/instant_radiosity/many_light/bounces.rs::further_bounces_are_the_path_tracers",
            "tests/tests/instant_radiosity/many_light/bounces.rs::walks_go_on_by_rough_lobes_alone",
            "tests/tests/instant_radiosity/many_light/bounces.rs::tiles_have_all_bounces_over_as_many_frames",
            "tests/tests/instant_radiosity/many_light/tiles.rs::twice_the_lights_are_as_bright",
            "tests/tests/instant_radiosity/many_light/truths.rs::a_virtual_light_lights_a_plane_as_its_law_says",
            "tests/tests/instant_radiosity/many_light/truths.rs::all_of_a_lights_power_arrives_on_the_plane",
            "tests/tests/instant_radiosity/many_light/truths.rs::squares_have_their_form_factors_behind_a_blocker",
            "tests/tests/twins/edges.rs::faces_that_emit_bring_their_own_emission_inside",
            "tests/tests/instant_radiosity/many_light/truths.rs::errors_fall_with_the_root_of_the_lights",
            "tests/tests/instant_radiosity/many_light/bounces.rs::further_bounces_do_not_depend_on_how_work_is_shared_out",
            "tests/tests/raster/gbuffer.rs::positions_project_to_the_middles_of_their_pixels",
            "tests/tests/instant_radiosity/many_light.rs::frames_do_not_depend_on_how_work_is_shared_out",
            "tests/tests/instant_radiosity/many_light.rs::what_is_not_needed_is_not_recorded",
            "tests/tests/instant_radiosity/many_light.rs::lambert_ends_cost_no_branch",
            "tests/tests/instant_radiosity/many_light/scales.rs::frames_know_no_lengths",
            "tests/tests/instant_radiosity/many_light.rs::scenes_without_lights_are_black_and_walks_that_leave_do_no_harm",
            "tests/tests/instant_radiosity/many_light.rs::what_frames_cannot_model_is_refused_by_name",
        ],
        api: &["clerestory::techniques::instant_radiosity::many_light::ManyLight"],
        settings: &[
            "clerestory::techniques::instant_radiosity::many_light::ManyLightSettings",
            "clerestory render --technique many-light",
        ],
        ..Row::of("engine/src/techniques/instant_radiosity/many_light/renderer.rs")
    },
    Row {
        id: "SVO-P10",
        name: "direct light of a deferred frame: a sample of the lights and one of the scattering function at each pixel, weighted against each other",
        role: Role::PartOf("SVO-P12"),
        limits: "Rays, not shadow maps; lights are chosen by power alone, whatever they light.",
        sources: &[sources::VEACH_1997.at("9.2"), sources::SUN_2015.at("§4.9")],
        shaders: &["shaders/techniques/instant_radiosity/deferred_direct.comp"],
        bias: Some(Bias::Unbiased),
        tests: &[
            "tests/tests/instant_radiosity/many_light.rs::direct_light_is_the_path_tracers",
            "tests/tests/instant_radiosity/many_light/truths.rs::points_light_a_plane_as_their_law_says",
            "tests/tests/instant_radiosity/many_light/truths.rs::walls_that_emit_bring_their_own_radiosity",
            "tests/tests/instant_radiosity/many_light/truths.rs::all_of_a_lights_power_arrives_on_the_plane",
            "tests/tests/instant_radiosity/many_light.rs::direct_light_is_the_path_tracers_through_any_camera",
        ],
        settings: &["path_set"],
        ..Row::of("engine/src/techniques/instant_radiosity/many_light/kernels.rs")
    },
    Row {
        id: "SVO-P7",
        name: "interleaved sampling: G-buffers split into tiles that share a part of the lights, and merged again (SVO-P13)",
        role: Role::PartOf("SVO-P12"),
        limits: "Each pixel has one of n² parts of the lights, which shows as a pattern where no filter follows.",
        sources: &[
            sources::KELLER_HEIDRICH_2001.whole(),
            sources::SEGOVIA_2006.whole(),
            sources::SUN_2015.at("§3.3, §4.6 and §4.11"),
        ],
        shaders: &[
            "shaders/techniques/instant_radiosity/deferred_split.comp",
            "shaders/techniques/instant_radiosity/interleave.glsl",
        ],
        tests: &[
            "engine/src/techniques/instant_radiosity/many_light/interleave.rs::merging_what_was_split_is_exact",
            "engine/src/techniques/instant_radiosity/many_light/interleave.rs::windows_have_every_tile_once_and_workgroups_have_one_tile",
            "engine/src/techniques/instant_radiosity/many_light/interleave.rs::parts_have_every_light_once",
            "engine/src/techniques/instant_radiosity/many_light/interleave.rs::frames_in_a_row_have_parts_from_all_over",
            "tests/tests/twins/interleave.rs::interleaved_pixels_agree_with_their_twins",
            "tests/tests/instant_radiosity/many_light/tiles.rs::tiles_that_have_all_lights_give_the_same_bits",
            "tests/tests/instant_radiosity/many_light/tiles.rs::parts_of_the_lights_bring_as_much_as_all",
        ],
        settings: &["interleave"],
        ..Row::of("engine/src/techniques/instant_radiosity/many_light/interleave.rs")
    },
    Row {
        id: "SVO-P14",
        name: "filter of interleaved light over neighbours in the same plane with the same normal",
        role: Role::PartOf("SVO-P12"),
        limits: "Blurs contact shadows, and highlights of glossy surfaces, by half as many pixels as there are tiles along a side, and surfaces of one height that lie apart but are neighbours in the picture; single pixels without neighbours keep their pattern.",
        sources: &[sources::LAINE_2007.whole(), sources::SUN_2015.at("§4.12")],
        shaders: &[
            "shaders/techniques/instant_radiosity/deferred_merge.comp",
            "shaders/techniques/instant_radiosity/light_color.glsl",
        ],
        bias: Some(Bias::Biased(
            "the light of neighbouring pixels on a surface is averaged",
        )),
        tests: &[
            "tests/tests/instant_radiosity/many_light/tiles.rs::filters_average_what_lies_in_one_plane_alone",
            "tests/tests/instant_radiosity/many_light/tiles.rs::filters_leave_constants_as_they_are_to_the_bit",
            "tests/tests/instant_radiosity/many_light/tiles.rs::filters_divide_by_all_that_a_surface_scatters",
            "tests/tests/instant_radiosity/many_light/tiles.rs::filtered_tiles_are_nearly_what_all_lights_bring",
            "tests/tests/instant_radiosity/many_light/truths.rs::filters_leave_a_sixteenth_of_the_noise",
        ],
        settings: &["filter", "filter_plane", "filter_normal"],
        ..Row::of("engine/src/techniques/instant_radiosity/many_light/kernels.rs")
    },
    Row {
        id: "SVO-P8",
        name: "reflective shadow maps of points, spots and directions, and of points of lights with an area and directions of the environment, as virtual lights (MET-P7)",
        role: Role::PartOf("SVO-P12"),
        limits: "Light of a texel is where its middle is; a few primary virtual lights a frame stand for lights with an area and the environment.",
        sources: &[
            sources::DACHSBACHER_STAMMINGER_2005.whole(),
            sources::KELLER_1997.whole(),
            sources::SUN_2015.at("§4.7"),
        ],
        shaders: &[
            "shaders/techniques/instant_radiosity/rsm.glsl",
            "shaders/techniques/instant_radiosity/rsm_emitters.comp",
            "shaders/techniques/instant_radiosity/rsm_flux.comp",
            "shaders/techniques/instant_radiosity/rsm_lights.comp",
        ],
        bias: Some(Bias::Consistent("a texel's middle stands for all of the texel")),
        needs: NEEDS,
        tests: &[
            "tests/tests/instant_radiosity/many_light/reflective.rs::each_light_reflects_as_much",
            "tests/tests/instant_radiosity/many_light/reflective.rs::moved_bodies_are_as_if_made_there",
            "tests/tests/instant_radiosity/many_light/reflective.rs::powers_of_spots_and_of_parallel_light_are_closed_forms",
            "tests/tests/instant_radiosity/many_light/reflective.rs::frames_of_reflective_maps_are_the_path_tracers",
            "tests/tests/instant_radiosity/many_light/reflective.rs::even_sequences_have_the_same_mean_and_less_noise",
            "tests/tests/instant_radiosity/many_light/reflective.rs::black_maps_give_no_lights",
            "tests/tests/instant_radiosity/many_light/reflective.rs::reflective_maps_are_drawn_for_no_others_and_shared_out_alike",
        ],
        api: &["clerestory::techniques::instant_radiosity::many_light::ReflectiveMap"],
        settings: &["placement", "rsm_side", "rsm_sequence", "emitters"],
        ..Row::of("engine/src/techniques/instant_radiosity/many_light/reflective.rs")
    },
    Row {
        id: "SVO-G1",
        name: "light gathered from texels in discs of reflective shadow maps, weighted by the inverse of their density or as published",
        role: Role::PartOf("SVO-P12"),
        limits: "Light comes through everything; what lies beyond a disc, or beyond the edge of the view that it is in, is missing.",
        sources: &[
            sources::DACHSBACHER_STAMMINGER_2005.whole(),
            sources::SUN_2015.at("§2.2.1"),
        ],
        shaders: &["shaders/techniques/instant_radiosity/rsm_gather.comp"],
        bias: Some(Bias::Biased(
            "visibility is left out, and light beyond a disc; the published weight is off by what light grows or falls over a disc",
        )),
        needs: NEEDS,
        tests: &[
            "tests/tests/instant_radiosity/many_light/discs.rs::a_virtual_light_on_each_texel_brings_the_sum_of_all_texels",
            "tests/tests/instant_radiosity/many_light/discs.rs::discs_have_the_sum_of_their_texels_as_their_mean",
            "tests/tests/instant_radiosity/many_light/discs.rs::light_through_everything_exceeds_that_of_rays_by_what_is_hidden",
            "tests/tests/instant_radiosity/many_light/discs.rs::discs_over_all_texels_bring_what_all_lights_do",
            "tests/tests/instant_radiosity/many_light/discs.rs::discs_need_reflective_maps_and_no_lights",
            "engine/src/raster/reflective.rs::discs_are_weighted_by_the_inverse_of_their_density",
        ],
        settings: &["gathering", "disc_samples", "disc_radius"],
        ..Row::of("engine/src/techniques/instant_radiosity/many_light/discs.rs")
    },
    Row {
        id: "CL-VPL-RESERVOIRS",
        name: "reservoirs of virtual lights: one of some that each pixel draws, or of those that it and its neighbours keep, with one test of visibility",
        role: Role::PartOf("SVO-P12"),
        limits: "Nothing is kept from frame to frame, and visibility is by a ray or none; errors of neighbouring pixels are alike, in spots of the neighbours' reach.",
        sources: &[
            sources::BITTERLI_2020.whole(),
            sources::LIN_2022.whole(),
            sources::TALBOT_2005.whole(),
        ],
        shaders: &[
            "shaders/techniques/instant_radiosity/deferred_resample.comp",
            "shaders/techniques/instant_radiosity/deferred_reuse.comp",
            "shaders/techniques/instant_radiosity/reservoir.glsl",
            "shaders/techniques/instant_radiosity/resampling.glsl",
        ],
        bias: Some(Bias::Unbiased),
        tests: &[
            "tests/tests/instant_radiosity/many_light/reservoirs.rs::reservoirs_are_the_path_tracers",
            "tests/tests/instant_radiosity/many_light/reservoirs.rs::one_light_is_kept_by_all",
            "tests/tests/instant_radiosity/many_light/reservoirs.rs::candidates_and_neighbours_take_noise_away",
            "tests/tests/instant_radiosity/many_light/reservoirs.rs::reservoirs_have_their_passes_alone",
            "tests/tests/twins/resampling.rs::resampled_candidates_agree_with_their_twins",
            "engine/src/techniques/instant_radiosity/resampling.rs::candidates_are_kept_by_their_shares",
        ],
        settings: &["gathering", "candidates", "neighbours", "neighbour_reach"],
        ..Row::of("engine/src/techniques/instant_radiosity/many_light/reservoirs.rs")
    },
    Row {
        id: "SVO-G2",
        name: "incremental instant radiosity: virtual lights of points and spots that are kept from frame to frame, with shares of the power by Voronoi cells of their directions (IMS-M18, of surfaces)",
        role: Role::PartOf("SVO-P12"),
        limits: "One bounce in scenes where nothing but lamps moves; what a set of directions misses it misses in every frame, and after a jump of a lamp new lights take frames to come; exact shadow maps are kept of up to 256 lights and 128 MiB, and else drawn anew in every frame.",
        sources: &[sources::LAINE_2007.whole(), sources::SUN_2015.at("§2.2.2")],
        shaders: &[
            "shaders/techniques/instant_radiosity/kept.glsl",
            "shaders/techniques/instant_radiosity/kept_rays.comp",
            "shaders/techniques/instant_radiosity/kept_lights.comp",
        ],
        bias: Some(Bias::Consistent(
            "each light stands for the directions that are nearest to its own; of a point's sets that were just spread the mean over seeds is exact",
        )),
        needs: NEEDS,
        tests: &[
            "engine/src/techniques/instant_radiosity/incremental/voronoi.rs::circles_about_corners_are_empty_and_cells_fill_the_domain",
            "engine/src/techniques/instant_radiosity/incremental/voronoi.rs::degenerate_sets_have_their_cells",
            "engine/src/techniques/instant_radiosity/incremental/voronoi.rs::neighbours_are_all_that_a_cell_needs",
            "engine/src/techniques/instant_radiosity/incremental/voronoi.rs::gaps_are_where_no_point_is",
            "engine/src/techniques/instant_radiosity/incremental/directions.rs::spread_sets_have_nothing_to_renew",
            "engine/src/techniques/instant_radiosity/incremental/directions.rs::spread_sets_have_narrower_gaps_than_independent_points",
            "engine/src/techniques/instant_radiosity/incremental/directions.rs::what_is_lost_comes_back_under_the_quota",
            "engine/src/techniques/instant_radiosity/incremental/directions.rs::twins_part_and_turns_are_even",
            "engine/src/techniques/instant_radiosity/incremental/lamp.rs::directions_are_found_again_and_lie_within_the_cone",
            "engine/src/techniques/instant_radiosity/incremental/lamp.rs::equal_areas_have_equal_shares_of_the_power",
            "tests/tests/instant_radiosity/many_light/kept.rs::still_lamps_keep_all_lights_and_their_maps",
            "tests/tests/instant_radiosity/many_light/kept.rs::moved_lamps_renew_no_more_than_the_quota",
            "tests/tests/instant_radiosity/many_light/kept.rs::lamps_that_jump_lose_what_they_do_not_see",
            "tests/tests/instant_radiosity/many_light/kept.rs::kept_lights_have_all_of_the_power",
            "tests/tests/instant_radiosity/many_light/kept.rs::the_same_walks_change_less_from_frame_to_frame",
            "tests/tests/instant_radiosity/many_light/kept.rs::means_over_seeds_are_the_path_tracers",
            "tests/tests/instant_radiosity/many_light/kept.rs::other_lights_are_refused",
        ],
        api: &["clerestory::techniques::instant_radiosity::incremental"],
        settings: &["placement", "renewed"],
        ..Row::of("engine/src/techniques/instant_radiosity/many_light/kept.rs")
    },
    Row {
        id: "SVO-G5",
        name: "Metropolis instant radiosity: virtual lights of many walks that multiple-try chains choose by the power they send to the camera, each weighted to bring as much",
        role: Role::PartOf("SVO-P12"),
        limits: "Chains choose among a pool of walks instead of making paths from the camera, so that a region no walk of the pool reaches stays dark in that frame; lights change from frame to frame and flicker.",
        sources: &[
            sources::SEGOVIA_2007.whole(),
            sources::LIU_2000.whole(),
            sources::KELEMEN_2002.whole(),
            sources::SUN_2015.at("§2.2.5"),
        ],
        shaders: &[
            "shaders/techniques/instant_radiosity/metropolis.glsl",
            "shaders/techniques/instant_radiosity/metropolis_state.glsl",
            "shaders/techniques/instant_radiosity/metropolis_try.comp",
            "shaders/techniques/instant_radiosity/metropolis_accept.comp",
            "shaders/techniques/instant_radiosity/metropolis_lights.comp",
        ],
        bias: Some(Bias::Consistent(
            "chains are finite, and a light's weight is one over a power measured at some pixels",
        )),
        tests: &[
            "engine/src/techniques/instant_radiosity/many_light/metropolis.rs::tries_are_chosen_as_often_as_they_bring",
            "tests/tests/instant_radiosity/many_light/metropolis.rs::chosen_lights_bring_all_that_the_pool_brings",
            "tests/tests/instant_radiosity/many_light/metropolis.rs::chosen_lights_are_as_bright_as_the_path_tracers",
            "tests/tests/instant_radiosity/many_light/metropolis.rs::chains_halve_the_error_of_as_many_walks_behind_a_wall",
            "tests/tests/instant_radiosity/many_light/metropolis.rs::chains_are_begun_anew_and_refuse_what_they_cannot_measure",
        ],
        settings: &["placement", "pool", "tries", "mutations", "power_pixels"],
        ..Row::of("engine/src/techniques/instant_radiosity/many_light/metropolis.rs")
    },
    Row {
        id: "SVO-G4",
        name: "temporal coherence: indirect light blended with that of the frame before where the camera before saw the same surface, by a confidence that changes of position, normal and light lower",
        role: Role::PartOf("SVO-P12"),
        limits: "Points of objects that move are looked up where they are now, so that light follows what slides along its own surface, lags where that rises or turns, and is new where it does so by more in a frame than neighbours of one surface may differ; light lags behind what changes, shadows of what moves among it, and smears along surfaces that pixels move over; frames on a film are no independent samples; a frame without virtual lights ends the history.",
        sources: &[sources::SUN_2015.at("§2.2.4")],
        shaders: &[
            "shaders/techniques/instant_radiosity/deferred_history.comp",
            "shaders/techniques/instant_radiosity/history.glsl",
            "shaders/techniques/instant_radiosity/light_color.glsl",
        ],
        bias: Some(Bias::Biased(
            "light lags behind what changes, is resampled where pixels move, and is bounded by what is around before it enters",
        )),
        tests: &[
            "engine/src/techniques/instant_radiosity/many_light/history.rs::points_on_a_pixels_ray_are_in_its_middle",
            "engine/src/techniques/instant_radiosity/many_light/history.rs::weights_sum_to_one_and_middles_have_one_pixel",
            "engine/src/techniques/instant_radiosity/many_light/history.rs::confidence_falls_with_the_largest_change",
            "engine/src/techniques/instant_radiosity/many_light/history.rs::changes_are_relative_and_bounds_scale",
            "tests/tests/twins/history.rs::histories_agree_with_their_twins",
            "tests/tests/instant_radiosity/many_light/history.rs::noise_falls_as_the_closed_form_says",
            "tests/tests/instant_radiosity/many_light/history.rs::means_over_seeds_are_the_path_tracers",
            "tests/tests/instant_radiosity/many_light/history.rs::steps_of_light_arrive_as_powers_of_the_confidence",
            "tests/tests/instant_radiosity/many_light/history.rs::what_was_hidden_has_no_confidence",
            "tests/tests/instant_radiosity/many_light/history.rs::ghosts_stay_near_what_was_hidden",
            "tests/tests/instant_radiosity/many_light/history.rs::ghosts_stay_near_what_moves",
            "tests/tests/instant_radiosity/many_light/history.rs::what_leaves_its_own_surface_has_no_confidence",
            "tests/tests/instant_radiosity/many_light/history.rs::changes_of_light_lower_the_confidence",
            "tests/tests/instant_radiosity/many_light/history.rs::single_bright_pixels_are_bounded",
            "tests/tests/instant_radiosity/many_light/history.rs::histories_cost_what_they_keep_and_nothing_where_there_are_none",
            "tests/tests/instant_radiosity/many_light/history.rs::histories_do_not_depend_on_how_work_is_shared_out",
            "tests/tests/instant_radiosity/many_light.rs::threads_and_widths_of_the_driver_never_show",
        ],
        api: &["clerestory::techniques::instant_radiosity::many_light::history"],
        settings: &[
            "history",
            "history_position",
            "history_normal",
            "history_light",
            "history_bound",
        ],
        ..Row::of("engine/src/techniques/instant_radiosity/many_light/past.rs")
    },
    Row {
        id: "SVO-B0",
        name: "shadow maps of virtual lights, exact ones of all triangles",
        role: Role::PartOf("SVO-P12"),
        limits: "An octahedron of all directions for each light, of which its surface hides one half, where paraboloids and half octahedra have one texel for two; costs as lights times triangles; contact shadows begin a texel's diagonal late; glass is opaque, and partial alpha is refused; cut-outs are seen through in exact maps, and are opaque in imperfect ones alone.",
        sources: &[
            sources::ENGELHARDT_DACHSBACHER_2008.whole(),
            sources::SUN_2015.at("§1 and §6"),
        ],
        shaders: &[
            "shaders/techniques/instant_radiosity/deferred_gather.comp",
            "shaders/raster/omni_shadow_set.glsl",
        ],
        bias: Some(Bias::Biased(
            "borders of shadows err by half a texel of a map, and small things as a whole; contact shadows begin late, and what is very near to a light casts none",
        )),
        needs: &["VK_QUEUE_GRAPHICS_BIT", "shaderClipDistance"],
        tests: &[
            "engine/src/techniques/instant_radiosity/many_light/maps.rs::maps_are_shared_out_by_what_a_buffer_holds",
            "tests/tests/instant_radiosity/many_light.rs::errors_of_visibility_fall_from_none_over_maps_to_rays",
            "tests/tests/instant_radiosity/many_light/truths.rs::squares_have_their_form_factors_behind_a_blocker",
            "tests/tests/instant_radiosity/many_light.rs::threads_and_widths_of_the_driver_never_show",
        ],
        settings: &["map_side"],
        ..Row::of("engine/src/techniques/instant_radiosity/many_light/exact_maps.rs")
    },
];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_path_set_is_that_of_its_expression() {
        assert_eq!(CARD.path_set, DISPLAYED.parse().expect("path set"));
        assert_eq!(
            CARD.path_set,
            "bounces=0..2,lobes=diffuse+glossy".parse().expect("path set")
        );
        assert_eq!(CARD.path_set.to_string(), DISPLAYED);
    }
}
