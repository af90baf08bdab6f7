//! Distance impostors: maps that hold how far away what they show is, so that reflections depend on where they are seen from.
//!
//! Sources: L. Szirmay-Kalos, B. Aszódi, I. Lazányi, M. Premecz, "Approximate Ray-Tracing on the GPU with Distance Impostors", CGF 24(3)
//! (Eurographics), 2005 (the ratio, the one step, secants, false position); T. Umenhoffer, G. Patow, L. Szirmay-Kalos, "Robust Multiple Specular
//! Reflections and Refractions", GPU Gems 3, 2007, chapter 17 (layers, the march); F. Policarpo, M. Oliveira, J. Comba, "Real-Time Relief Mapping
//! on Arbitrary Polygonal Surfaces", I3D 2005 (bisection).
//!
//! A ray begins at x, from the map's place o, in the unit direction r; both are in the map's axes. Where to find what:
//!
//! - [`ImpostorImage`]: distances and normals on the host, [`Impostor`] on the device, whose texels hold planes, normals or distances alone ([`ImpostorTexels`]);
//! - [`ImpostorSettings`]: the method and its steps; [`ImpostorImage::search`] and [`Impostor::search`]: what rays meet, one by one and in batches;
//! - [`proxy`]: spheres, boxes and a hemisphere in place of distances; [`places`]: which maps serve a point; [`proxy_maps`]: both on the device;
//! - [`views`]: several maps together, blended by what each of them sees;
//! - [`room`]: rooms with exact answers, which searches are measured by, with the errors of [`published`] searches there; [`layouts`]: what the layout of texels is measured by.
//!
//! Guarantees: deterministic, each ray by itself; every number in a result is finite, for rays of any numbers: one whose direction is no unit vector, or that
//! begins as far as [`ImpostorImage::NOTHING`], finds nothing, and batches refuse it by name. The residual |1 − g| of a result says
//! how far, relatively, the point that was found is from a surface: above a few hundredths no surface was found.
//!
//! Bias: what o does not see is not there. Behind a silhouette the search sticks to its edge, which the residual shows, and false position may
//! return a later hit than the first. [`SearchMethod::March`] returns the first crossing whose residual is below the tolerance: the first hit where o
//! sees it, and where it is hidden a later surface; several layers hold what lies behind. A texel's distance
//! holds for its centre: with normals look-ups go on along its plane, without they are off by up to half a texel.
//!
//! Cost: with m·y = 1 on a texel's plane, |l| over its distance in the direction of l is m·l, so that a look-up of a plane in a cube or an octahedron takes one texel,
//! one root for the bound, and no direction of unit length.

pub mod layouts;
pub mod places;
pub mod proxy;
pub mod proxy_maps;
pub mod published;
pub mod room;
pub mod views;

mod device;
mod image;
mod search;
mod settings;
#[cfg(test)]
mod tests;

pub use device::{Impostor, ImpostorSearch};
pub use image::{ImpostorImage, ImpostorSurface, impostor_plane, impostor_plane_ratio};
pub use search::{ImpostorScene, impostor_by_march, impostor_by_steps, impostor_ratio, impostor_search, impostor_step};
pub use settings::{ImpostorSettings, ImpostorTexels, MAX_BISECTIONS, MAX_STEPS, SearchMethod};

use glam::DVec3;

use crate::catalogue::{Bias, Role, Row, sources};

/// A ray from a point near a map.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ImpostorRay {
    /// Where it begins, from the map's place.
    pub origin: DVec3,
    /// Its unit direction.
    pub direction: DVec3,
}

/// What a search found.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ImpostorHit {
    /// The unit direction, from the map's place, in which the map shows what the ray meets; the ray's own where it leaves to the sky, and 0 for a
    /// ray that is none.
    pub direction: DVec3,
    /// How far the ray goes; [`ImpostorImage::NOTHING`] to the sky.
    pub distance: f64,
    /// |1 − g|; 0 in the sky, and 1 where nothing was searched for.
    pub residual: f64,
    /// Layer of the surface.
    pub layer: u32,
}

/// What every search lacks.
const UNSEEN: Bias = Bias::Biased("what the map's place does not see is not there");

/// Rows of the catalogue.
pub(crate) const ROWS: &[Row] = &[
    Row {
        id: "MET-D1",
        name: "distance impostors: maps of distances and normals, and searches along rays in them",
        role: Role::Kernel,
        limits: "What the map's place does not see is not there; a reflector has to be left out of its own map.",
        sources: &[sources::SZIRMAY_KALOS_2005.whole()],
        shaders: &[
            "shaders/maps/impostor.glsl",
            "shaders/maps/impostor_step.glsl",
            "shaders/maps/impostor_set.glsl",
            "shaders/maps/impostor_query.glsl",
            "shaders/maps/impostor_search.comp",
        ],
        bias: Some(UNSEEN),
        tests: &[
            "engine/src/maps/impostor/tests/edges.rs::distances_are_never_averaged",
            "engine/src/maps/impostor/tests/edges.rs::planes_hold_over_a_texel_and_no_farther",
            "engine/src/maps/impostor/tests/edges.rs::texels_on_the_device_are_those_of_the_host",
            "engine/src/maps/impostor/tests/edges.rs::bad_maps_and_settings_are_refused_by_name",
            "engine/src/maps/impostor/tests/edges.rs::the_sky_is_seen_in_the_rays_own_direction",
            "engine/src/maps/impostor/tests/edges.rs::zero_vectors_and_numbers_that_are_none_find_nothing",
            "engine/src/maps/impostor/tests/searches.rs::texels_with_normals_give_what_exact_rooms_do",
            "engine/src/maps/impostor/tests/searches.rs::texels_without_normals_are_off_by_less_than_a_texel",
            "engine/src/maps/impostor/tests/edges.rs::all_numbers_stay_finite",
            "tests/tests/maps/impostors.rs::every_method_agrees_with_its_twin_and_repeats_its_bits",
            "tests/tests/maps/impostors.rs::every_map_agrees_with_its_twin_with_normals_and_without",
            "tests/tests/maps/impostor_texels.rs::texels_of_planes_and_of_normals_find_the_same",
            "tests/tests/twins/impostors.rs::planes_agree_with_their_twins",
            "tests/tests/maps/impostors.rs::rays_that_are_none_find_nothing_in_the_kernel",
            "tests/tests/maps/impostors.rs::the_sky_is_seen_in_the_rays_own_direction",
            "tests/tests/maps/impostors.rs::what_cannot_be_searched_is_refused_by_name",
            "tests/tests/maps/impostor_texels.rs::distances_beyond_a_texel_buffer_are_refused",
            "tests/tests/maps/impostor_texels.rs::planes_beyond_a_storage_buffers_range_are_looked_up",
        ],
        api: &[
            "clerestory::maps::impostor::Impostor",
            "clerestory::maps::impostor::ImpostorImage",
            "clerestory::maps::impostor::ImpostorSearch",
            "clerestory::maps::impostor::impostor_search",
        ],
        settings: &[
            "clerestory::maps::impostor::ImpostorSettings",
            "clerestory::maps::impostor::ImpostorTexels",
        ],
        ..Row::of(file!())
    },
    Row {
        id: "MET-D2",
        name: "perpendicular guess: the surface seen along the ray stands across it",
        role: Role::PartOf("MET-D1"),
        limits: "Exact where it does; off by a degree and more in a room.",
        sources: &[sources::SZIRMAY_KALOS_2005.whole()],
        shaders: &["shaders/maps/impostor.glsl"],
        bias: Some(UNSEEN),
        tests: &[
            "engine/src/maps/impostor/tests/searches.rs::convex_rooms_give_the_published_errors",
            "tests/tests/maps/impostors.rs::every_method_agrees_with_its_twin_and_repeats_its_bits",
        ],
        settings: &["clerestory::maps::impostor::SearchMethod"],
        ..Row::of(file!())
    },
    Row {
        id: "MET-D3",
        name: "one step from the perpendicular guess: the parallax-corrected single look-up",
        role: Role::PartOf("MET-D1"),
        limits: "Exact where guess and far surface are one plane; sticks to silhouettes.",
        sources: &[sources::SZIRMAY_KALOS_2005.whole()],
        shaders: &["shaders/maps/impostor.glsl"],
        bias: Some(UNSEEN),
        tests: &[
            "engine/src/maps/impostor/tests/searches.rs::convex_rooms_give_the_published_errors",
            "engine/src/maps/impostor/tests/searches.rs::one_step_beats_the_classical_map_a_hundredfold",
            "engine/src/maps/impostor/tests/searches.rs::spherical_surroundings_give_the_published_distances",
            "tests/tests/maps/impostors.rs::convex_rooms_give_the_published_errors",
            "tests/tests/twins/impostors.rs::steps_agree_with_their_twins",
        ],
        settings: &["clerestory::maps::impostor::SearchMethod"],
        ..Row::of(file!())
    },
    Row {
        id: "MET-D4",
        name: "secant from the ray's own point",
        role: Role::PartOf("MET-D1"),
        limits: "Goes back to its start in corners for every seventh ray, and stays there.",
        sources: &[sources::SZIRMAY_KALOS_2005.whole()],
        shaders: &["shaders/maps/impostor.glsl"],
        bias: Some(UNSEEN),
        tests: &[
            "engine/src/maps/impostor/tests/searches.rs::convex_rooms_give_the_published_errors",
            "tests/tests/maps/impostors.rs::every_method_agrees_with_its_twin_and_repeats_its_bits",
            "tests/tests/twins/searches.rs::parts_of_searches_agree_with_their_twins",
        ],
        settings: &["clerestory::maps::impostor::SearchMethod"],
        ..Row::of(file!())
    },
    Row {
        id: "MET-D5",
        name: "secant from the perpendicular guess",
        role: Role::PartOf("MET-D1"),
        limits: "Misses faces that are partly hidden.",
        sources: &[sources::SZIRMAY_KALOS_2005.whole()],
        shaders: &["shaders/maps/impostor.glsl"],
        bias: Some(UNSEEN),
        tests: &[
            "engine/src/maps/impostor/tests/searches.rs::convex_rooms_give_the_published_errors",
            "tests/tests/maps/impostors.rs::every_method_agrees_with_its_twin_and_repeats_its_bits",
            "tests/tests/twins/searches.rs::searches_agree_with_their_twins",
        ],
        settings: &["clerestory::maps::impostor::SearchMethod"],
        ..Row::of(file!())
    },
    Row {
        id: "MET-D6",
        name: "false position: a bracket of a guess in front and one behind",
        role: Role::PartOf("MET-D1"),
        limits: "Needs a point that the map's place sees; converges linearly, and may find a later hit than the first.",
        sources: &[sources::SZIRMAY_KALOS_2005.whole()],
        shaders: &["shaders/maps/impostor.glsl"],
        bias: Some(UNSEEN),
        tests: &[
            "engine/src/maps/impostor/tests/searches.rs::convex_rooms_give_the_published_errors",
            "engine/src/maps/impostor/tests/searches.rs::hidden_surfaces_give_the_published_errors",
            "engine/src/maps/impostor/tests/searches.rs::a_moving_sphere_stays_below_a_degree",
            "engine/src/maps/impostor/tests/edges.rs::a_march_finds_the_first_hit_where_brackets_find_a_later_one",
            "engine/src/maps/impostor/tests/edges.rs::silhouettes_show_in_the_residual",
            "tests/tests/maps/impostors.rs::convex_rooms_give_the_published_errors",
        ],
        settings: &["clerestory::maps::impostor::SearchMethod"],
        ..Row::of(file!())
    },
    Row {
        id: "MET-D7",
        name: "mixed: brackets from the perpendicular guess; and the hybrid, false position where the map's place sees the ray's point",
        role: Role::PartOf("MET-D1"),
        limits: "Misses hits near x that false position finds.",
        sources: &[sources::SZIRMAY_KALOS_2005.whole()],
        shaders: &["shaders/maps/impostor.glsl"],
        bias: Some(UNSEEN),
        tests: &[
            "engine/src/maps/impostor/tests/searches.rs::convex_rooms_give_the_published_errors",
            "engine/src/maps/impostor/tests/searches.rs::hidden_surfaces_give_the_published_errors",
            "engine/src/maps/impostor/tests/searches.rs::points_that_are_hidden_need_the_hybrid",
            "tests/tests/maps/impostors.rs::convex_rooms_give_the_published_errors",
            "tests/tests/maps/impostors.rs::hidden_points_need_the_hybrid",
        ],
        settings: &["clerestory::maps::impostor::SearchMethod"],
        ..Row::of(file!())
    },
    Row {
        id: "MET-D8",
        name: "refracted rays by the same searches",
        role: Role::PartOf("MET-D1"),
        limits: "One interface: a ray ends on what lies beyond the body as if it had no other side, and technique `impostor` refuses pictures in which it has one.",
        sources: &[sources::SZIRMAY_KALOS_2005.whole()],
        shaders: &[
            "shaders/maps/proxy.glsl",
            "shaders/maps/impostor.glsl",
            "shaders/techniques/impostors/impostor_reflect.comp",
        ],
        bias: Some(UNSEEN),
        tests: &[
            "engine/src/maps/impostor/tests/searches.rs::refracted_rays_are_found_as_published",
            "tests/tests/maps/impostors.rs::refracted_rays_are_found_as_published",
            "tests/tests/impostor_pictures/refractions.rs::glass_shows_what_the_path_tracer_shows_behind_one_interface",
            "engine/src/maps/impostor/tests/proxies.rs::all_light_is_reflected_where_none_is_refracted",
            "tests/tests/twins/impostors.rs::directions_agree_with_their_twins",
        ],
        ..Row::of(file!())
    },
    Row {
        id: "MET-D9",
        name: "distances in a buffer of their own, beside radiance and normals",
        role: Role::PartOf("MET-D1"),
        limits: "Up to an eighth slower on a software driver than four numbers a texel with the distance as the fourth, whose fetch brings the radiance into the cache, and which is there for one layer without normals alone; a texture cache's bandwidth, which it saves, is not what bounds that driver.",
        sources: &[sources::SZIRMAY_KALOS_2005.whole()],
        shaders: &["shaders/maps/impostor_set.glsl", "shaders/maps/impostor_layouts.comp"],
        bias: None,
        tests: &[
            "tests/tests/maps/impostor_texels.rs::distances_have_a_buffer_of_their_own",
            "tests/tests/maps/impostor_texels.rs::layouts_show_the_same_radiance",
            "engine/src/maps/impostor/tests/edges.rs::distances_are_never_averaged",
        ],
        api: &["clerestory::maps::impostor::layouts::ImpostorLayouts"],
        ..Row::of(file!())
    },
    Row {
        id: "MET-D10",
        name: "layers of surfaces: what lies behind what the map's place sees",
        role: Role::PartOf("MET-D1"),
        limits: "Up to eight layers; a ray through more is left at the last.",
        sources: &[sources::UMENHOFFER_2007.at("chapter 17"), sources::EVERITT_2001.whole()],
        shaders: &["shaders/maps/impostor.glsl"],
        bias: Some(UNSEEN),
        tests: &[
            "engine/src/maps/impostor/tests/searches.rs::layers_hold_what_lies_behind",
            "tests/tests/maps/impostors.rs::three_layers_hold_what_lies_behind",
            "engine/src/maps/impostor/tests/edges.rs::the_sky_is_seen_in_the_rays_own_direction",
        ],
        ..Row::of(file!())
    },
    Row {
        id: "MET-D11",
        name: "march to the first crossing that is a surface, then bisection",
        role: Role::PartOf("MET-D1"),
        limits: "What is thinner than a step is stepped over; where the first hit is hidden, a later surface is found.",
        sources: &[
            sources::UMENHOFFER_2007.at("chapter 17"),
            sources::POLICARPO_2005.whole(),
        ],
        shaders: &["shaders/maps/impostor.glsl"],
        bias: Some(UNSEEN),
        tests: &[
            "engine/src/maps/impostor/tests/searches.rs::hidden_surfaces_give_the_published_errors",
            "engine/src/maps/impostor/tests/searches.rs::the_first_crossing_errs_as_published",
            "engine/src/maps/impostor/tests/edges.rs::a_march_finds_the_first_hit_where_brackets_find_a_later_one",
            "engine/src/maps/impostor/tests/edges.rs::a_march_begins_in_front_of_coarse_texels",
            "tests/tests/maps/impostors.rs::three_layers_hold_what_lies_behind",
            "tests/tests/maps/impostors.rs::a_march_begins_in_front_of_coarse_texels",
        ],
        settings: &["clerestory::maps::impostor::SearchMethod"],
        ..Row::of(file!())
    },
];
