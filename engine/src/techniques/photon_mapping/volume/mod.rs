//! Photons in participating media: events where they collide, the map of these, and what eye paths see of them along their ways.
//!
//! Sources: H. W. Jensen and P. H. Christensen, "Efficient Simulation of Light Transport in Scenes with Participating Media Using Photon Maps", SIGGRAPH 1998;
//! W. Jarosz, M. Zwicker and H. W. Jensen, "The Beam Radiance Estimate for Volumetric Photon Mapping", Computer Graphics Forum 27(2), 2008; B. Fabianowski,
//! "Interactive Manycore Photon Mapping", PhD thesis, Trinity College Dublin, 2011, chapter 7; C. Knaus and M. Zwicker, "Progressive Photon Mapping: A
//! Probabilistic Approach", ACM TOG 30(3), 2011; B. Bitterli and W. Jarosz, "Beyond Points and Beams: Higher-Dimensional Photon Samples for Volumetric Light
//! Transport", ACM TOG 36(4), 2017; J. Křivánek et al., "Unifying Points, Beams, and Paths in Volumetric Light Transport Simulation", ACM TOG 33(4), 2014.
//!
//! What is seen first by a scattering in a medium is the eye paths' where it is the only one, unless the map has direct light, and else the photons'. With eye paths that go on
//! ([`volume_paths`](super::PhotonSettings::volume_paths)) photons and eye paths share it, each path of light by weights that sum to one
//! ([`photon_share`](crate::transport::photon_share)), but for what a mirror scatters first, which no light sample finds: that stays with collisions, beams and planes.
//!
//! Beside planes each path of light is of one of two kinds, by the scattering x₁ that comes before the one that is seen, x₀, on its way from the light. Planes have it where x₁ lies in the medium of x₀ with
//! neither a surface nor a boundary in between: then the way from x₁ on begins at a collision, and is no beam. Beams have it elsewhere: from a surface, from behind a boundary of media, and from the light
//! itself. Of ways that only by chance have planes these have their light over the chance. An eye path that goes on knows either kind once it has been scattered at x₀ and again at x₁: it is that of planes if
//! both are collisions and it has passed no boundary on the way. With a weight of the kind's own (the volume that its two last flights and the ray span, or a beam's angle) it carries what photons of that kind
//! leave. Both sides know all that a weight is a function of: directions, the density at x₀, the medium there, how far the light is from the first scattering and how that turned it, which photons carry
//! along. Light that is scattered once is shared by nobody, as without.
//!
//! Nothing of it is made for scenes without media. Bias: kernels blur, and lose the light of media by walls and boundaries as far as they reach, since there are
//! no events beyond; a thin wall lets them through. Both fade as kernels shrink. Planes have none: what they carry is unbiased, the rest comes by beams.

mod beam;
#[cfg(test)]
mod chain_tests;
pub mod event;
pub mod footprint;
mod map;
pub mod neighbor;
pub mod plane;
mod plane_rays;
mod trace;
pub mod transmittance;
pub mod ways;

pub(super) use beam::{Beam, BeamAsk, BeamStage, paths_in_flight};
pub(super) use map::{EventMap, EventMaps};
pub(super) use plane_rays::SWEEPS_MAX;
pub(super) use trace::{Room, VolumeOptions, VolumePass, VolumeTrace};

use crate::catalogue::{Bias, Role, Row, sources};
use crate::gpu::shaders::constants::{EVENT_QUARTERS, WIDE_QUARTERS};

/// How events are seen along eye paths.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum VolumeEstimate {
    /// The beam estimate: disks across the ray, one query for all of it.
    Ray,
    /// Beams: ways of photons through homogeneous media, as far as the next surface or by chance ([`BeamLength`](ways::BeamLength)), each seen where the ray passes it.
    Beams,
    /// Planes that two flights in a row through one homogeneous medium span, without kernels, each seen where the ray meets it; and beams for all else. With
    /// [`volume_paths`](super::PhotonSettings::volume_paths) each is weighted by what eye paths have of it that go on.
    Planes,
    /// Collisions and, in homogeneous media, ways: disks and beams, each weighted by what the other has of the same light (balance heuristic); with
    /// [`volume_paths`](super::PhotonSettings::volume_paths) also by what eye paths have of it that go on.
    Unified,
    /// Balls at places of the ray that lie as far apart as they are wide, from a first one by chance.
    March,
}

/// Dimensions of the kernels of beams: their width.
pub(super) const BEAM_DIMENSIONS: f64 = 1.0;

impl VolumeEstimate {
    /// Of its kernels.
    pub(super) fn dimensions(self) -> f64 {
        match self {
            // What planes leave is seen by beams.
            Self::Beams | Self::Planes => BEAM_DIMENSIONS,
            // Of its collisions, which shrink slowest; beams beside them shrink as beams do.
            Self::Ray | Self::Unified => 2.0,
            Self::March => 3.0,
        }
    }

    /// Whether the ways of photons are stored, instead of their collisions or beside them.
    pub(super) fn stores_ways(self) -> bool {
        matches!(self, Self::Beams | Self::Planes | Self::Unified)
    }

    /// Whether it sees nothing in media with a density grid.
    pub(super) fn needs_homogeneous_media(self) -> bool {
        matches!(self, Self::Beams | Self::Planes)
    }

    /// And collisions beside the ways.
    pub(super) fn stores_points(self) -> bool {
        self == Self::Unified
    }

    /// Whether it knows what eye paths have of its light that go on.
    pub(super) fn shares_with_paths(self) -> bool {
        matches!(self, Self::Unified | Self::Planes)
    }

    /// Whether a map has records of another kind beside beams.
    fn stores_beside(self) -> bool {
        self.stores_planes() || self.stores_points()
    }

    /// And planes instead of those that begin at a collision.
    pub(super) fn stores_planes(self) -> bool {
        self == Self::Planes
    }

    /// Words of its records, over four.
    fn quarters(self) -> u32 {
        if self.stores_beside() {
            WIDE_QUARTERS
        } else {
            EVENT_QUARTERS
        }
    }

    /// As settings spell it.
    pub(super) fn word(self) -> &'static str {
        match self {
            Self::Ray => "ray",
            Self::Beams => "beams",
            Self::Planes => "planes",
            Self::Unified => "unified",
            Self::March => "march",
        }
    }
}

/// How wide events' kernels are.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum VolumeKernel {
    /// All alike.
    Fixed,
    /// As the photon's footprint is.
    Footprint,
    /// As far as the nearest of the other events in its medium of which the setting `volume_neighbors` says the number.
    Neighbor,
}

impl VolumeKernel {
    /// As settings spell it.
    pub(super) fn word(self) -> &'static str {
        match self {
            Self::Fixed => "fixed",
            Self::Footprint => "footprint",
            Self::Neighbor => "neighbor",
        }
    }
}

const BIAS: Bias = Bias::Consistent(
    "kernels blur events, and lose light by walls and boundaries or leak it through thin ones, until they have shrunk",
);

/// Rows of the catalogue.
pub(crate) const ROWS: &[Row] = &[
    Row {
        id: "PM-VOL-7",
        name: "beam estimate: one query of the volume map per ray, in corrected units (PM-VOL-6 are the original ones)",
        role: Role::PartOf("PM-SYS-1"),
        limits: "Single scattering is the eye paths' by default; in a grid the transmittance along a ray is an estimate, the same for all that the ray sees.",
        sources: &[
            sources::FABIANOWSKI_2011.at("§7.1"),
            sources::JAROSZ_2008.whole(),
            sources::JENSEN_CHRISTENSEN_1998.whole(),
            sources::KNAUS_ZWICKER_2011.whole(),
        ],
        bias: Some(BIAS),
        shaders: &[
            "shaders/techniques/photon_mapping/photon_beam.comp",
            "shaders/techniques/photon_mapping/photon_beam.glsl",
            "shaders/techniques/photon_mapping/photon_beam_way.glsl",
            "shaders/techniques/photon_mapping/photon_event.glsl",
            "shaders/techniques/photon_mapping/photon_event_boxes.comp",
            "shaders/techniques/photon_mapping/photon_event_leaves.comp",
        ],
        tests: &[
            "engine/src/techniques/photon_mapping/volume/event.rs::single_scattering_has_its_constants_and_original_units_do_not",
            "engine/src/techniques/photon_mapping/volume/event.rs::records_come_back",
            "engine/src/techniques/photon_mapping/volume/event.rs::boxes_hold_what_rays_find_within_the_radius",
            "tests/tests/twins/photons.rs::records_of_events_agree_with_their_twins",
            "tests/tests/photon/volume.rs::airlight_has_its_six_constants",
            "tests/tests/photon/volume_kernels.rs::no_phase_function_is_mirrored",
            "tests/tests/photon/volume_truths.rs::media_scatter_what_they_take_in_furnaces",
            "tests/tests/photon/volume.rs::fog_agrees_with_the_path_tracer",
            "tests/tests/photon/volume.rs::grids_agree_with_the_path_tracer",
            "tests/tests/photon/volume.rs::glass_in_fog_agrees_with_the_path_tracer",
            "tests/tests/photon/volume.rs::errors_fall_with_passes",
            "tests/tests/photon/volume.rs::lengths_times_eight_give_a_sixty_fourth",
            "tests/tests/photon/volume.rs::beams_that_a_quota_stops_go_through_all_records",
            "engine/src/techniques/photon_mapping/pilot.rs::shares_are_found_whatever_the_law",
            "tests/tests/photon/volume_kernels.rs::rays_meet_some_tens_of_kernels",
            "tests/tests/photon/volume_kernels.rs::radii_scale_with_the_scene",
            "tests/tests/photon/volume_kernels.rs::kernels_stay_in_their_medium",
            "tests/tests/photon/volume_kernels.rs::dense_bodies_elsewhere_leave_kernels_as_they_are",
            "tests/tests/photon/volume_truths.rs::slabs_have_the_radiance_of_the_tables",
            "tests/tests/photon/volume_truths.rs::rays_past_a_source_have_the_exact_multiple_scattering",
            "tests/tests/photon/volume_truths.rs::furnaces_stay_even_with_lossless_media_inside",
            "tests/tests/photon/volume_extremes.rs::collisions_along_rays_stay_finite",
            "tests/tests/photon/volume_extremes.rs::furnaces_are_even_by_collisions_along_rays",
            "tests/tests/photon/volume_extremes.rs::narrow_kernels_err_by_less_than_a_hundredth",
        ],
        settings: &["volume", "volume_radius", "reduction"],
        ..Row::of(file!())
    },
    Row {
        id: "CL-PHOTON-BEAMS",
        name: "photon beams: long ones, seen by rays under kernels of one dimension",
        role: Role::PartOf("PM-SYS-1"),
        limits: "Homogeneous media alone; a way has no light beyond sixteen mean free paths; rays along a beam are noise.",
        sources: &[sources::JAROSZ_2011.whole(), sources::KNAUS_ZWICKER_2011.whole()],
        bias: Some(BIAS),
        shaders: &[
            "shaders/techniques/photon_mapping/photon_beam.comp",
            "shaders/techniques/photon_mapping/photon_medium.comp",
        ],
        tests: &[
            "engine/src/techniques/photon_mapping/volume/event.rs::beams_have_the_airlight_integral",
            "tests/tests/photon/volume.rs::beams_have_the_six_constants",
            "tests/tests/photon/volume.rs::beams_have_the_airlight_constant_to_a_hundredth",
            "tests/tests/photon/volume.rs::fog_agrees_with_the_path_tracer",
            "tests/tests/photon/volume_kernels.rs::beams_have_no_kernels_of_their_own",
            "tests/tests/photon/volume_queues.rs::beams_are_the_same_in_every_form_on_any_number_of_threads",
            "tests/tests/photon/volume_truths.rs::slabs_have_the_radiance_of_the_tables",
            "tests/tests/photon/volume_extremes.rs::beams_stay_finite",
            "tests/tests/photon/volume_extremes.rs::furnaces_are_even_by_beams",
            "tests/tests/photon/volume_extremes.rs::narrow_kernels_err_by_less_than_a_hundredth",
            "tests/tests/twins/photons.rs::beams_agree_with_their_twins",
        ],
        settings: &["volume"],
        ..Row::of(file!())
    },
    Row {
        id: "CL-PHOTON-UNIFIED",
        name: "photon collisions and beams together, and eye paths that go on, weighted by the balance heuristic",
        role: Role::PartOf("PM-SYS-1"),
        limits: "Photons are seen where eye paths first scatter in a medium, under one radius for both in the first pass, which shrinks as beams' and as collisions' do, in grids collisions alone; eye paths go on only where `volume_paths` asks for them, and have none of what a mirror scatters first; their weights take the ends of a path alone, without transmittances and as if lights and first scatterings were even; planes are not weighted against the others; records take 48 bytes, of which 128 MiB hold 2.8 million.",
        sources: &[
            sources::GPUUPBP.at("the published order of collisions and beams on a GPU"),
            sources::KRIVANEK_2014.whole(),
            sources::MOONEN_JALBA_2023.at("recursive weights, which the ends of a path stand for here"),
            sources::VEACH_1997.at("9.2.2"),
        ],
        bias: Some(BIAS),
        shaders: &[
            "shaders/techniques/photon_mapping/photon_beam.comp",
            "shaders/techniques/photon_mapping/photon_event.glsl",
            "shaders/techniques/photon_mapping/photon_medium.comp",
            "shaders/transport/photon_share.glsl",
            "shaders/techniques/path/path_medium.comp",
            "shaders/techniques/path/path_shade.comp",
        ],
        tests: &[
            "engine/src/techniques/photon_mapping/volume/event.rs::shares_of_collisions_are_those_of_the_balance_heuristic",
            "engine/src/transport/photon_share.rs::eye_paths_and_photons_share_every_path",
            "engine/src/transport/photon_share.rs::shares_are_those_of_densities_but_for_what_they_leave_out",
            "engine/src/transport/photon_share.rs::lengths_do_not_show_and_narrow_kernels_leave_all_to_eye_paths",
            "engine/src/transport/photon_share.rs::photons_carry_the_distance_of_their_first_scattering",
            "engine/src/techniques/photon_mapping/path_classes.rs::eye_paths_and_maps_have_every_path_once",
            "tests/tests/photon/unified.rs::unified_estimates_agree_with_the_path_tracer",
            "tests/tests/photon/unified.rs::errors_are_near_to_those_of_the_better_estimate",
            "tests/tests/photon/volume_queues.rs::unified_estimates_are_the_same_in_every_form_on_any_number_of_threads",
            "tests/tests/photon/shared_paths.rs::photons_and_eye_paths_share_all_light",
            "tests/tests/photon/shared_paths.rs::lamps_that_eye_paths_meet_are_shared",
            "tests/tests/photon/shared_paths.rs::light_without_a_place_is_shared",
            "tests/tests/photon/shared_paths.rs::direct_light_from_the_map_is_not_shared",
            "tests/tests/photon/shared_paths.rs::shares_have_the_same_bits_however_it_is_done",
            "tests/tests/photon/shared_paths.rs::eye_paths_go_on_beside_collisions_and_ways_alone",
            "tests/tests/photon/volume_truths.rs::rays_past_a_source_have_the_exact_multiple_scattering",
            "tests/tests/photon/volume_extremes.rs::collisions_and_beams_together_stay_finite",
            "tests/tests/photon/volume_extremes.rs::furnaces_are_even_by_collisions_and_beams_together",
            "tests/tests/photon/volume_extremes.rs::narrow_kernels_err_by_less_than_a_hundredth",
            "tests/tests/twins/photons.rs::beams_agree_with_their_twins",
            "tests/tests/twins/photons.rs::shares_with_eye_paths_agree_with_their_twins",
        ],
        api: &["clerestory::transport::photon_share"],
        settings: &["volume", "volume_paths"],
        ..Row::of(file!())
    },
    Row {
        id: "CL-PHOTON-PLANES",
        name: "photon planes: two flights in a row through a medium, seen where a ray meets what they span, without kernels",
        role: Role::PartOf("PM-SYS-1"),
        limits: "Homogeneous media alone, and only light scattered there twice at last with nothing in between, the rest by beams; short flights; without a `volume_radius` no more than a share of all ways has planes; records take 48 bytes, of which 128 MiB hold 2.8 million; one ray along a flight stands for all planes of an eye path's way; without `volume_paths`, by which eye paths share the light of planes, and for what a mirror scatters first, a ray nearly in a plane is noise without bound, by which the variance grows with the logarithm of the number of planes, pictures of few passes are too dark under narrow phase functions, and parallel light along parallel rays is missing.",
        sources: &[sources::BITTERLI_JAROSZ_2017.whole()],
        bias: Some(Bias::Unbiased),
        shaders: &[
            "shaders/techniques/photon_mapping/photon_beam.comp",
            "shaders/techniques/photon_mapping/photon_event.glsl",
            "shaders/techniques/photon_mapping/photon_medium.comp",
            "shaders/techniques/photon_mapping/photon_plane_ray.glsl",
            "shaders/techniques/photon_mapping/photon_plane_rays.comp",
            "shaders/transport/photon_share.glsl",
            "shaders/techniques/path/path_medium.comp",
            "shaders/techniques/path/path_shade.comp",
        ],
        tests: &[
            "engine/src/techniques/photon_mapping/volume/plane.rs::planes_come_back_and_their_boxes_hold_them",
            "engine/src/techniques/photon_mapping/volume/plane.rs::rays_meet_planes_where_both_are",
            "engine/src/techniques/photon_mapping/volume/plane.rs::planes_have_the_double_scattering_integral",
            "engine/src/techniques/photon_mapping/volume/plane.rs::eye_paths_and_planes_know_one_volume",
            "engine/src/transport/photon_share.rs::planes_share_by_densities_of_narrow_phase_functions",
            "engine/src/transport/photon_share.rs::shares_of_planes_make_up_for_their_volume",
            "tests/tests/photon/planes.rs::planes_have_the_exact_multiple_scattering",
            "tests/tests/photon/planes.rs::planes_agree_with_the_path_tracer_without_blur",
            "tests/tests/photon/planes.rs::planes_and_beams_have_every_path_once",
            "tests/tests/photon/planes.rs::single_scattering_is_that_of_beams",
            "tests/tests/photon/planes.rs::lengths_times_eight_give_a_sixty_fourth_by_planes",
            "tests/tests/photon/volume_kernels.rs::planes_scale_with_the_scene",
            "tests/tests/photon/planes.rs::planes_that_a_quota_stops_go_through_all_records",
            "tests/tests/photon/volume_queues.rs::planes_are_the_same_in_every_form_on_any_number_of_threads",
            "tests/tests/photon/planes.rs::planes_of_thin_bodies_are_no_larger_than_these",
            "tests/tests/photon/planes.rs::what_is_chosen_alone_has_planes",
            "tests/tests/photon/planes.rs::errors_of_planes_fall_with_the_root_of_passes",
            "tests/tests/photon/planes.rs::eye_paths_have_what_planes_lack_of_narrow_phase_functions",
            "tests/tests/photon/planes.rs::eye_paths_share_the_light_of_planes_and_of_beams",
            "tests/tests/photon/planes.rs::light_without_a_place_is_shared_with_planes",
            "tests/tests/photon/planes.rs::light_off_mirrors_is_shared_with_planes",
            "tests/tests/photon/planes.rs::direct_light_is_shared_with_planes",
            "tests/tests/photon/planes.rs::eye_paths_have_parallel_light_along_parallel_rays",
            "tests/tests/photon/planes.rs::shares_of_planes_have_the_same_bits_however_it_is_done",
            "tests/tests/photon/volume_extremes.rs::planes_stay_finite",
            "tests/tests/photon/volume_extremes.rs::furnaces_are_even_by_planes",
            "tests/tests/photon/volume_extremes.rs::furnaces_are_even_by_planes_and_eye_paths",
            "tests/tests/photon/volume_extremes.rs::planes_agree_with_the_path_tracer_whichever_way_phase_functions_point",
            "tests/tests/photon/volume_extremes.rs::planes_have_what_thin_rooms_scatter_twice",
            "tests/tests/photon/volume_extremes.rs::planes_have_what_rooms_scatter_twice",
            "tests/tests/photon/volume_extremes.rs::planes_have_what_dense_rooms_scatter_twice",
            "tests/tests/twins/photons.rs::planes_agree_with_their_twins",
            "tests/tests/twins/photons.rs::shares_with_eye_paths_agree_with_their_twins",
        ],
        settings: &["volume", "volume_paths"],
        ..Row::of("engine/src/techniques/photon_mapping/volume/plane.rs")
    },
    Row {
        id: "PM-VOL-5",
        name: "marched estimate of the volume map",
        role: Role::PartOf("PM-SYS-1"),
        limits: "Noisier than the beam estimate for the same events; places lie as far apart as kernels are wide.",
        sources: &[
            sources::FABIANOWSKI_2011.at("§3.4.2.4"),
            sources::JENSEN_CHRISTENSEN_1998.whole(),
        ],
        bias: Some(BIAS),
        shaders: &["shaders/techniques/photon_mapping/photon_beam.comp"],
        tests: &[
            "engine/src/techniques/photon_mapping/volume/event.rs::kernels_integrate_to_one_over_space_and_marches_to_a_disk",
            "tests/tests/photon/volume_queues.rs::marches_are_the_same_in_every_form_on_any_number_of_threads",
            "tests/tests/photon/volume.rs::fog_agrees_with_the_path_tracer",
            "tests/tests/photon/volume_extremes.rs::marches_stay_finite",
            "tests/tests/photon/volume_extremes.rs::furnaces_are_even_by_marches",
            "tests/tests/photon/volume_extremes.rs::narrow_kernels_err_by_less_than_a_hundredth",
        ],
        settings: &["volume"],
        ..Row::of(file!())
    },
    Row {
        id: "PM-PD-12",
        name: "photons that collide in media: stored with what they scatter, roulette by the albedo",
        role: Role::PartOf("PM-SYS-1"),
        limits: "Media that scatter nothing have no collisions; a collision takes 32 bytes of the map, and 48 beside ways, so that 128 MiB hold 4.2 million, or 2.8.",
        sources: &[
            sources::FABIANOWSKI_2011.at("§3.4.1.3 and §7.2.3"),
            sources::JENSEN_CHRISTENSEN_1998.whole(),
        ],
        shaders: &[
            "shaders/techniques/photon_mapping/photon_medium.comp",
            "shaders/techniques/photon_mapping/photon_volume_flags.comp",
            "shaders/techniques/photon_mapping/photon_volume_append.comp",
        ],
        tests: &[
            "tests/tests/photon/volume.rs::photons_in_media_are_kept_to_the_count",
            "tests/tests/photon/volume_counts.rs::photons_are_kept_to_the_count_by_every_estimate",
            "tests/tests/photon/volume_counts.rs::photons_are_kept_to_the_count_whatever_becomes_of_them",
            "tests/tests/photon/volume.rs::collisions_are_as_many_as_the_albedo_says",
            "tests/tests/photon/volume_truths.rs::collisions_about_a_source_are_those_of_the_exact_fluence",
            "tests/tests/photon/volume.rs::scenes_without_media_have_nothing_of_it",
            "tests/tests/photon/without.rs::without_media_there_is_no_pass_byte_or_branch_of_them_and_the_same_bits",
            "tests/tests/photon/volume.rs::threads_never_show_in_media",
            "tests/tests/photon/volume.rs::room_for_events_grows",
            "tests/tests/photon/volume.rs::collisions_beyond_a_buffer_are_refused_by_the_name_of_its_limit",
        ],
        settings: &["photons"],
        ..Row::of(file!())
    },
    Row {
        id: "PM-DE-7",
        name: "kernels in media as wide as footprints, dampened by a logarithm",
        role: Role::PartOf("PM-SYS-1"),
        limits: "Isotropic, whatever the footprint's form; in grids what has passed is reckoned from the bounds of the density; the unit of the dampening is a ninth of the scene's diagonal, not a metre.",
        sources: &[sources::FABIANOWSKI_2011.at("§7.2, §7.3.1 and §7.3.2")],
        bias: Some(BIAS),
        shaders: &["shaders/techniques/photon_mapping/photon_footprint.glsl"],
        tests: &[
            "engine/src/techniques/photon_mapping/volume/footprint.rs::volumes_are_reciprocals_of_the_density_of_collisions",
            "engine/src/techniques/photon_mapping/volume/footprint.rs::dampening_has_its_published_values",
            "engine/src/techniques/photon_mapping/volume/footprint.rs::scattering_keeps_the_expected_volume",
            "engine/src/techniques/photon_mapping/volume/footprint.rs::scaling_the_scene_and_the_unit_scales_the_kernel",
            "engine/src/techniques/photon_mapping/volume/footprint.rs::footprints_without_a_volume_have_the_least_kernel_and_endless_ones_the_greatest",
            "engine/src/techniques/photon_mapping/volume/chain_tests.rs::each_event_in_media_agrees_with_finite_differences",
            "engine/src/techniques/photon_mapping/volume/chain_tests.rs::chains_of_events_in_media_agree_with_finite_differences",
            "engine/src/techniques/photon_mapping/volume/chain_tests.rs::footprints_that_forget_who_has_collided_are_too_small",
            "tests/tests/photon/volume.rs::kernels_from_footprints_hold_as_many_collisions_as_they_should",
            "tests/tests/photon/volume.rs::kernels_from_footprints_agree_with_the_path_tracer",
            "tests/tests/photon/volume_footprints.rs::kernels_in_nested_bodies_are_those_of_all_that_photons_have_passed",
            "tests/tests/photon/volume_footprints.rs::kernels_behind_glass_are_those_of_refracted_footprints",
            "tests/tests/twins/photons.rs::footprints_in_media_agree_with_their_twins",
        ],
        settings: &["volume_kernel", "volume_spread", "volume_dampening"],
        ..Row::of(file!())
    },
    Row {
        id: "PM-VOL-8",
        name: "kernels in media as wide as a neighbour is far, the 85th by default",
        role: Role::PartOf("PM-SYS-1"),
        limits: "The host finds neighbours, which takes longer than all the rest of a pass; a baseline for kernels from footprints.",
        sources: &[
            sources::FABIANOWSKI_2011.at("§7.3.4"),
            sources::JENSEN_CHRISTENSEN_1998.whole(),
        ],
        bias: Some(BIAS),
        shaders: &["shaders/techniques/photon_mapping/photon_beam.comp"],
        tests: &[
            "engine/src/techniques/photon_mapping/volume/neighbor.rs::radii_are_those_of_all_pairs",
            "tests/tests/photon/volume_kernels.rs::kernels_by_neighbours_hold_so_many",
            "tests/tests/photon/volume_kernels.rs::radii_scale_with_the_scene",
            "tests/tests/photon/volume_kernels.rs::rays_see_the_kernels_that_events_have",
        ],
        settings: &["volume_kernel", "volume_neighbors"],
        ..Row::of(file!())
    },
    Row {
        id: "BG-6",
        name: "beam estimate with kernels by neighbours, as a baseline of light in media",
        role: Role::PartOf("PM-SYS-1"),
        limits: "A million collisions and 117 neighbours, as the source has them, are settings; the host finds neighbours.",
        sources: &[
            sources::ENGELHARDT_2013.at("4.6 and 10.4"),
            sources::JAROSZ_2008.whole(),
        ],
        bias: Some(BIAS),
        shaders: &["shaders/techniques/photon_mapping/photon_beam.comp"],
        tests: &[
            "tests/tests/photon/volume_kernels.rs::kernels_by_neighbours_hold_so_many",
            "tests/tests/photon/volume_kernels.rs::rays_see_the_kernels_that_events_have",
            "tests/tests/photon/volume.rs::airlight_has_its_six_constants",
        ],
        settings: &["volume", "volume_kernel", "volume_neighbors", "photons"],
        ..Row::of(file!())
    },
    Row {
        id: "PM-SYS-2",
        name: "light in participating media as a whole: photons through media, kernels from footprints, a compact map, queries along rays, a moving light",
        role: Role::PartOf("PM-SYS-1"),
        limits: "Photons, map and kernels are made anew for each frame; the source's queries by packets are a setting.",
        sources: &[sources::FABIANOWSKI_2011.at("§7.5")],
        bias: Some(BIAS),
        shaders: &["shaders/techniques/photon_mapping/"],
        tests: &[
            "tests/tests/photon/volume.rs::kernels_from_footprints_agree_with_the_path_tracer",
            "tests/tests/photon/volume.rs::grids_agree_with_the_path_tracer",
            "tests/tests/photon/volume_queues.rs::every_queue_and_packets_give_the_same_picture_through_media",
            "tests/tests/photon/without.rs::without_diffuse_surfaces_there_is_no_map_of_them_and_the_same_bits",
            "tests/tests/photon/without.rs::without_media_there_is_no_pass_byte_or_branch_of_them_and_the_same_bits",
        ],
        settings: &["volume", "volume_kernel", "queue", "query"],
        ..Row::of("engine/src/techniques/photon_mapping/mapper.rs")
    },
];
