//! Localised gathering: the texels of a coarse map with distances as area lights, whose solid angles are those seen from the shaded point.
//!
//! Source: L. Szirmay-Kalos, I. Lazányi, "Indirect Diffuse and Glossy Illumination on the GPU", SCCG 2006, which gives the solid angle by the ratio
//! of squared distances ([`SolidAngleForm::Ratio`]) or by that of a disc ([`SolidAngleForm::Disc`]), both with the surface at the same angle to the
//! map's place as to the point. Here texels have their exact solid angles at the map's place, positions are averaged instead of distances, so that
//! lights over a plane lie on it, and with normals ([`SolidAngleForm::DiscWithNormals`]) the disc keeps its own angle to the point.
//!
//! A [`GatherLight`] is a texel of the coarse map: mean radiance by solid angle, mean position, and the disc that it is taken for. A [`Gather`]
//! on the device, and [`GatherLights::gather`] as its twin, sum a lobe's reflectivity times radiance times solid angle over all lights: an exponent of 1
//! about a normal is irradiance over π, a greater one about the mirrored direction what a glossy surface reflects. The lobe is
//! normalised, (s + 1)/(2π) max(0, cos)ˢ, without a cosine beside it: surroundings of radiance 1 give 1 at the map's place.
//!
//! - *Reflectivity* at the middle of a light, or its mean over the light's cone from a table of sizes and cosines ([`Reflectivity`]), which also counts
//!   lights whose middle is below the horizon.
//! - *Few terms*: the five greatest terms alone, scaled by the lobe's whole over theirs ([`Terms::Five`]).
//!
//! Bias: nothing hides a light from the point; radiance is that towards the map's place; each texel is one disc, over a silhouette one between what is
//! near and what is far. Without normals the error does not
//! vanish with more texels. The work is linear in the number of lights. Deterministic: sums in the order of texels, in blocks of 64.

mod device;
mod lights;
pub mod lit_room;
mod reflectivity;
#[cfg(test)]
mod tests;

pub use device::Gather;
pub(crate) use device::device_lights;
pub use lights::{
    GatherLight, GatherLights, GatherPoint, GatherSettings, Lobe, SolidAngleForm, Terms, gather_solid_angle,
};
pub use reflectivity::{Reflectivity, cone_reflectivity};

use crate::catalogue::{Bias, Role, Row, sources};

const ONE_DISC: Bias = Bias::Biased("nothing hides a light, and each texel is one disc of even radiance");

/// Rows of the catalogue.
pub(crate) const ROWS: &[Row] = &[
    Row {
        id: "MET-G1",
        name: "irradiance of a map at its place: the baseline that no object's place changes",
        role: Role::Yardstick,
        limits: "The same at every place.",
        sources: &[sources::RAMAMOORTHI_HANRAHAN_2001.whole()],
        tests: &[
            "engine/src/maps/gather/tests/errors.rs::the_map_at_its_place_errs_as_published",
            "tests/tests/impostor_pictures/gathers.rs::spheres_of_one_map_are_told_apart_by_their_places",
        ],
        api: &["clerestory::maps::irradiance::IrradianceSource"],
        ..Row::of(file!())
    },
    Row {
        id: "MET-G2",
        name: "glossy light of a map at its place: the gather with the point there",
        role: Role::Yardstick,
        limits: "The same at every place.",
        sources: &[sources::MILLER_HOFFMAN_1984.whole()],
        tests: &["engine/src/maps/gather/tests/parts.rs::at_the_maps_place_it_is_the_convolved_map"],
        api: &["clerestory::maps::gather::GatherLights"],
        ..Row::of(file!())
    },
    Row {
        id: "MET-G3",
        name: "localised gather: texels of a coarse map as area lights",
        role: Role::Kernel,
        limits: "Nothing hides a light; without normals the error stays however many texels there are.",
        sources: &[sources::SZIRMAY_KALOS_LAZANYI_2006.whole()],
        shaders: &[
            "shaders/maps/gather.glsl",
            "shaders/maps/gather_disc.glsl",
            "shaders/maps/gather.comp",
        ],
        bias: Some(ONE_DISC),
        tests: &[
            "engine/src/maps/gather/tests/errors.rs::gathers_err_as_published",
            "engine/src/maps/gather/tests/errors.rs::normals_make_it_converge",
            "engine/src/maps/gather/tests/parts.rs::lights_hold_the_sphere_and_its_light",
            "engine/src/maps/gather/tests/parts.rs::even_surroundings_stay_even",
            "engine/src/maps/gather/tests/parts.rs::even_surroundings_err_as_published_elsewhere",
            "engine/src/maps/gather/tests/parts.rs::the_sky_is_far_and_does_not_draw_lights_away",
            "engine/src/maps/gather/tests/parts.rs::a_light_over_a_silhouette_lies_between",
            "engine/src/maps/gather/tests/parts.rs::bad_maps_and_settings_are_refused_by_name",
            "tests/tests/maps/gathers.rs::gathers_are_their_twins",
            "tests/tests/maps/gathers.rs::the_published_errors_hold_on_the_device",
        ],
        api: &[
            "clerestory::maps::gather::Gather",
            "clerestory::maps::gather::GatherLights",
        ],
        settings: &["clerestory::maps::gather::GatherSettings"],
        ..Row::of(file!())
    },
    Row {
        id: "MET-G4",
        name: "solid angle of a disc seen from elsewhere, bounded by a hemisphere",
        role: Role::PartOf("MET-G3"),
        limits: "Takes the disc's axis through both places, unless normals are stored.",
        sources: &[sources::SZIRMAY_KALOS_LAZANYI_2006.whole()],
        shaders: &["shaders/maps/gather.glsl", "shaders/maps/gather_disc.glsl"],
        bias: Some(ONE_DISC),
        tests: &[
            "engine/src/maps/gather/tests/parts.rs::solid_angles_are_bounded_and_right_far_away",
            "engine/src/maps/gather/tests/errors.rs::gathers_err_as_published",
            "tests/tests/maps/gathers.rs::gathers_are_their_twins",
            "tests/tests/twins/impostors.rs::discs_and_reflectivities_agree_with_their_twins",
        ],
        settings: &["clerestory::maps::gather::SolidAngleForm"],
        ..Row::of(file!())
    },
    Row {
        id: "MET-G5",
        name: "reflectivity at the middle of a light",
        role: Role::PartOf("MET-G3"),
        limits: "Middles of lights show on surfaces near them.",
        sources: &[sources::SZIRMAY_KALOS_LAZANYI_2006.whole()],
        shaders: &["shaders/maps/gather.glsl"],
        bias: Some(ONE_DISC),
        tests: &["engine/src/maps/gather/tests/errors.rs::cones_leave_no_spots_at_a_wall"],
        settings: &["clerestory::maps::gather::GatherSettings"],
        ..Row::of(file!())
    },
    Row {
        id: "MET-G6",
        name: "reflectivity as its mean over a light's cone, from a table",
        role: Role::PartOf("MET-G3"),
        limits: "Cones up to a hemisphere; between 64 sizes and 64 angles it is bilinear.",
        sources: &[sources::SZIRMAY_KALOS_LAZANYI_2006.whole()],
        shaders: &["shaders/maps/gather_disc.glsl"],
        bias: Some(ONE_DISC),
        tests: &[
            "engine/src/maps/gather/tests/parts.rs::means_over_cones_are_the_published_ones",
            "engine/src/maps/gather/tests/parts.rs::narrow_lobes_keep_their_light_in_the_table",
            "engine/src/maps/gather/tests/errors.rs::cones_leave_no_spots_at_a_wall",
            "tests/tests/maps/gathers.rs::gathers_are_their_twins",
            "tests/tests/twins/impostors.rs::discs_and_reflectivities_agree_with_their_twins",
        ],
        api: &["clerestory::maps::gather::Reflectivity"],
        settings: &["clerestory::maps::gather::Lobe"],
        ..Row::of(file!())
    },
    Row {
        id: "MET-G7",
        name: "the five greatest terms of a glossy gather, scaled to the whole",
        role: Role::PartOf("MET-G3"),
        limits: "Of use where five texels hold most of the lobe, not of finer maps.",
        sources: &[sources::SZIRMAY_KALOS_LAZANYI_2006.whole()],
        shaders: &["shaders/maps/gather_few.glsl"],
        bias: Some(Bias::Biased(
            "the light of all texels but five is taken to be as theirs",
        )),
        tests: &[
            "engine/src/maps/gather/tests/errors.rs::five_terms_keep_the_energy",
            "tests/tests/maps/gathers.rs::gathers_are_their_twins",
            "tests/tests/impostor_pictures/gathers.rs::five_terms_keep_the_light_of_a_rough_metal",
        ],
        settings: &[
            "clerestory::maps::gather::Terms",
            "clerestory::techniques::localized_gather::GatherTerms",
        ],
        ..Row::of(file!())
    },
];
