//! Photon differentials: how position and direction of a photon change with the two parameters of its emission.
//!
//! They are carried along a photon's path, so that the distance to its neighbours is known wherever it lands. Sources: Igehy, "Tracing
//! Ray Differentials" (1999); Schjøth, Frisvad, Erleben and Sporring, "Photon Differentials" (2007); B. Fabianowski,
//! "Interactive Manycore Photon Mapping" (2011), §3.1.2 and §5.1. Conventions: vectors are derivatives, unscaled by the step √(4π/n) that n photons are apart in
//! either parameter ([`global_step`]). A direction of density p per solid angle has derivatives of length 1/√(4πp): one rule for
//! emission, diffuse reflection and every sampled lobe. The density counts every choice up to the class of paths: one of two lights that
//! are chosen evenly emits with half of its own density. A specular lobe has no density: the probability of choosing it is that of a
//! roulette ([`BsdfSample::choice`](super::bsdf::BsdfSample::choice)). Likewise the exact account of an earlier roulette with survival Q is to hand p·Q
//! and Ω/Q to a re-emission. Guarantees: scaling the scene scales `z1` and `z2` and nothing else; in a direction of finite density the
//! results are finite. Bias: none by itself, since footprints only choose the size of kernels. Twin of `transport/differentials.glsl`.

#[cfg(test)]
mod chain_tests;
#[cfg(test)]
mod footprint_tests;
pub mod path_differentials;
#[cfg(test)]
pub(crate) mod test_surfaces;
#[cfg(test)]
pub(crate) mod testing;

use super::warp::orthonormal_basis;
use crate::catalogue::{Role, Row, sources};
use crate::gpu::shaders::constants;
use glam::{DVec2, DVec3};
use std::f64::consts::{FRAC_1_PI, PI, TAU};

/// Least |cos| of incidence in a transfer: beyond it the footprint stops growing.
pub const DIFFERENTIAL_COS_MIN: f64 = constants::DIFFERENTIAL_COS_MIN as f64;
/// Least |cos| of the refracted direction in its derivative, which is infinite at the critical angle.
pub const DIFFERENTIAL_REFRACTED_COS_MIN: f64 = constants::DIFFERENTIAL_REFRACTED_COS_MIN as f64;
/// Least cosine, or density in its place, of a re-emission: the variance of the footprint's area is infinite without.
pub const DIFFERENTIAL_REEMISSION_COS_MIN: f64 = constants::DIFFERENTIAL_REEMISSION_COS_MIN as f64;
/// Bound of all components; of positions in unit lengths.
pub const DIFFERENTIAL_MAX: f64 = constants::DIFFERENTIAL_MAX as f64;

/// Derivatives of a photon by its two parameters.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Differentials {
    /// Position by the first parameter, m.
    pub z1: DVec3,
    /// Position by the second one, m.
    pub z2: DVec3,
    /// Direction by the first parameter.
    pub w1: DVec3,
    /// Direction by the second one.
    pub w2: DVec3,
}

/// Distance of n photons in either parameter: √(4π/n).
pub fn global_step(photons: f64) -> f64 {
    (4.0 * PI / photons).sqrt()
}

/// Of a point that emits with density `pdf` per solid angle.
pub fn emission_differentials(direction: DVec3, pdf: f64) -> Differentials {
    let (t, b) = orthonormal_basis(direction);
    let g = 1.0 / (4.0 * PI * pdf).sqrt();
    Differentials {
        w1: g * t,
        w2: g * b,
        ..Differentials::default()
    }
}

/// Of a footprint of side √|z1 × z2| that is absorbed and emitted anew with density `pdf` over directions of total solid angle `support`.
///
/// It comes from a point behind, so far that the expected area of the footprint stays: E\[1/p\] is the support, so that the offset t has
/// t²·Ω = 4π·side².
pub fn reemission_differentials(side: f64, direction: DVec3, pdf: f64, support: f64) -> Differentials {
    let least = 2.0 * DIFFERENTIAL_REEMISSION_COS_MIN / support;
    let emitted = emission_differentials(direction, pdf.max(least));
    let offset = side * (4.0 * PI / support).sqrt();
    Differentials {
        z1: offset * emitted.w1,
        z2: offset * emitted.w2,
        ..emitted
    }
}

/// Of a light with area that emits with density `pdf` per solid angle over the solid angle `support`, and with `pdf_area` per area.
///
/// The expected footprint on the light is then the area 1/(n · `pdf_area`) that each of n photons has there.
pub fn area_light_differentials(direction: DVec3, pdf: f64, pdf_area: f64, support: f64) -> Differentials {
    reemission_differentials(1.0 / (4.0 * PI * pdf_area).sqrt(), direction, pdf, support)
}

/// Of a parallel beam, or of all light from afar, that starts on a disk across it with density `pdf_area` per area.
///
/// Light of all directions of an environment crosses a plane at the same density, which is why the direction's own one has no part.
pub fn parallel_beam_differentials(direction: DVec3, pdf_area: f64) -> Differentials {
    let emitted = emission_differentials(direction, pdf_area);
    Differentials {
        z1: emitted.w1,
        z2: emitted.w2,
        w1: DVec3::ZERO,
        w2: DVec3::ZERO,
    }
}

/// Of the unit direction along `pinhole` = axis + p1 · `step1` + p2 · `step2` from a pinhole (Igehy 1999, §3.1).
pub fn camera_differentials(pinhole: DVec3, step1: DVec3, step2: DVec3) -> Differentials {
    let scale = 1.0 / pinhole.length();
    let w = scale * pinhole;
    Differentials {
        w1: scale * (step1 - w.dot(step1) * w),
        w2: scale * (step2 - w.dot(step2) * w),
        ..Differentials::default()
    }
}

/// √|z1 × z2|, m.
pub fn footprint_side(d: &Differentials) -> f64 {
    d.z1.cross(d.z2).length().sqrt()
}

/// After the distance `t` along `w` to a surface of geometric normal `n` (of either side); `z1` and `z2` lie in its tangent plane.
pub fn transfer_differentials(d: &Differentials, t: f64, w: DVec3, n: DVec3) -> Differentials {
    let c = w.dot(n);
    let incidence = if c < 0.0 {
        c.min(-DIFFERENTIAL_COS_MIN)
    } else {
        c.max(DIFFERENTIAL_COS_MIN)
    };
    let transferred = |z: DVec3| {
        let z = z - z.dot(n) / incidence * w;
        z - z.dot(n) * n
    };
    Differentials {
        z1: transferred(d.z1 + t * d.w1),
        z2: transferred(d.z2 + t * d.w2),
        ..*d
    }
}

/// Derivatives of the normalised interpolated normal n0 + u (n1 − n0) + v (n2 − n0) on a triangle with `edges` from its first vertex.
///
/// `uv` are the coordinates of the hit, `d` lies in the triangle's plane. Those of a normal turned to the other side have the other sign.
/// Zero where the interpolated normal vanishes, as for the face's own.
pub fn normal_derivatives(edges: [DVec3; 2], normals: [DVec3; 3], uv: DVec2, d: &Differentials) -> [DVec3; 2] {
    let [e1, e2] = edges;
    let (du, dv) = (normals[1] - normals[0], normals[2] - normals[0]);
    let n = normals[0] + uv.x * du + uv.y * dv;
    let area = e1.cross(e2);
    let (n_squared, area_squared) = (n.length_squared(), area.length_squared());
    if n_squared <= 0.0 || area_squared <= 0.0 {
        return [DVec3::ZERO; 2];
    }
    let factor = 1.0 / (n_squared.sqrt() * area_squared);
    let (grad_u, grad_v) = (factor * e2.cross(area), factor * area.cross(e1));
    let across = |v: DVec3| v - v.dot(n) / n_squared * n;
    let (du, dv) = (across(du), across(dv));
    [d.z1, d.z2].map(|z| du * grad_u.dot(z) + dv * grad_v.dot(z))
}

/// Mirror reflection of `w` about `n`, which changes by `dn`.
pub fn reflect_differentials(d: &Differentials, w: DVec3, n: DVec3, dn: [DVec3; 2]) -> Differentials {
    let reflected = |dw: DVec3, dn: DVec3| dw - 2.0 * (w.dot(n) * dn + (dw.dot(n) + w.dot(dn)) * n);
    Differentials {
        w1: reflected(d.w1, dn[0]),
        w2: reflected(d.w2, dn[1]),
        ..*d
    }
}

/// Refraction of `w` at `n`, which faces the incoming side (w · n < 0) and changes by `dn`; `eta` = index there / index beyond.
///
/// Where all is reflected, as [`reflect_differentials`].
pub fn refract_differentials(d: &Differentials, w: DVec3, n: DVec3, eta: f64, dn: [DVec3; 2]) -> Differentials {
    let c = w.dot(n);
    let squared = 1.0 - eta * eta * (1.0 - c * c);
    if squared <= 0.0 {
        return reflect_differentials(d, w, n, dn);
    }
    let refracted = -squared.sqrt();
    let mu = eta * c - refracted;
    let slope = eta - eta * eta * c / refracted.min(-DIFFERENTIAL_REFRACTED_COS_MIN);
    let changed = |dw: DVec3, dn: DVec3| eta * dw - (mu * dn + slope * (dw.dot(n) + w.dot(dn)) * n);
    Differentials {
        w1: changed(d.w1, dn[0]),
        w2: changed(d.w2, dn[1]),
        ..*d
    }
}

/// Diffuse reflection or transmission into `direction` with density `pdf` over the hemisphere.
pub fn diffuse_reemission(d: &Differentials, direction: DVec3, pdf: f64) -> Differentials {
    reemission_differentials(footprint_side(d), direction, pdf, TAU)
}

/// A rough lobe: as if it had the density `pdf` in all of its directions.
///
/// Narrow lobes so keep the area of each photon's footprint, not the mean of areas most of which lie in their tails.
pub fn rough_reemission(d: &Differentials, direction: DVec3, pdf: f64) -> Differentials {
    let density = pdf.max(DIFFERENTIAL_REEMISSION_COS_MIN * FRAC_1_PI);
    reemission_differentials(footprint_side(d), direction, density, 1.0 / density)
}

/// Accounts for the survival of a roulette, or for the probability of choosing a specular lobe among others. It is to be applied once the new direction's
/// derivatives are known, since a re-emission would forget it.
pub fn roulette_differentials(d: &Differentials, survival: f64) -> Differentials {
    let scale = 1.0 / survival.sqrt();
    Differentials {
        z1: scale * d.z1,
        z2: scale * d.z2,
        w1: scale * d.w1,
        w2: scale * d.w2,
    }
}

/// The differentials, or zero and `false` where they are not numbers or too large.
pub fn guard_differentials(d: &Differentials, unit_length: f64) -> (Differentials, bool) {
    let within = |v: DVec3, bound: f64| v.is_finite() && v.abs().max_element() <= bound;
    let fit = within(d.z1, DIFFERENTIAL_MAX * unit_length)
        && within(d.z2, DIFFERENTIAL_MAX * unit_length)
        && within(d.w1, DIFFERENTIAL_MAX)
        && within(d.w2, DIFFERENTIAL_MAX);
    (if fit { *d } else { Differentials::default() }, fit)
}

/// Rows of the catalogue.
pub(crate) const ROWS: &[Row] = &[
    Row {
        id: "PM-PD-0",
        name: "photon differentials: four vectors and one global step",
        role: Role::PartOf("PM-SYS-1"),
        limits: "First derivatives only: footprints that bend within themselves are misjudged, which changes the size of kernels, and with `widen_flat` off which photons are left out with their light.",
        sources: &[
            sources::IGEHY_1999.whole(),
            sources::SCHJOTH_2007.whole(),
            sources::FABIANOWSKI_2011.at("§3.1.2 and §5.1"),
        ],
        shaders: &["shaders/transport/differentials.glsl"],
        tests: &[
            "engine/src/transport/differentials/chain_tests.rs::chains_of_events_agree_with_finite_differences",
            "engine/src/transport/differentials/footprint_tests.rs::scaling_the_scene_scales_positions_alone",
            "engine/src/transport/differentials/footprint_tests.rs::what_is_not_a_number_or_too_large_is_zeroed",
            "tests/tests/twins/photons.rs::guards_agree_with_their_twins",
        ],
        api: &[
            "clerestory::transport::differentials::Differentials",
            "clerestory::transport::differentials::global_step",
        ],
        ..Row::of(file!())
    },
    Row {
        id: "PM-PD-1",
        name: "differentials of emission",
        role: Role::PartOf("PM-SYS-1"),
        limits: "Both derivatives have the length that the density says: the shape of a light's cell is not kept.",
        sources: &[sources::FABIANOWSKI_2011.at("§5.1.1")],
        shaders: &["shaders/transport/differentials.glsl"],
        tests: &[
            "engine/src/transport/differentials/footprint_tests.rs::emitted_photons_share_what_they_meet",
            "engine/src/transport/differentials/footprint_tests.rs::lights_with_area_and_beams_share_their_surface",
            "tests/tests/twins/photons.rs::emissions_agree_with_their_twins",
        ],
        experiment: "tools/test",
        api: &[
            "clerestory::transport::differentials::emission_differentials",
            "clerestory::transport::differentials::area_light_differentials",
            "clerestory::transport::differentials::parallel_beam_differentials",
        ],
        ..Row::of(file!())
    },
    Row {
        id: "PM-PD-2",
        name: "differentials of propagation to a surface",
        role: Role::PartOf("PM-SYS-1"),
        limits: "Takes the surface as a plane, and the cosine of incidence as at least 10⁻³: below that, grazing footprints stop growing.",
        sources: &[sources::IGEHY_1999.whole(), sources::FABIANOWSKI_2011.at("§3.1.2.3")],
        shaders: &["shaders/transport/differentials.glsl"],
        tests: &[
            "engine/src/transport/differentials/chain_tests.rs::each_event_agrees_with_finite_differences",
            "engine/src/transport/differentials/footprint_tests.rs::grazing_transfers_stay_finite_and_in_the_plane",
            "tests/tests/twins/photons.rs::events_agree_with_their_twins",
        ],
        experiment: "tools/test",
        api: &["clerestory::transport::differentials::transfer_differentials"],
        ..Row::of(file!())
    },
    Row {
        id: "PM-PD-3",
        name: "differentials of mirror reflection",
        role: Role::PartOf("PM-SYS-1"),
        limits: "Sees curvature only in interpolated normals; the printed form is corrected.",
        sources: &[sources::IGEHY_1999.whole(), sources::FABIANOWSKI_2011.at("§3.1.2.4")],
        shaders: &["shaders/transport/differentials.glsl"],
        tests: &[
            "engine/src/transport/differentials/chain_tests.rs::the_printed_reflection_is_wrong",
            "engine/src/transport/differentials/chain_tests.rs::each_event_agrees_with_finite_differences",
            "engine/src/transport/differentials/footprint_tests.rs::a_concave_mirror_about_the_light_focuses_to_nothing",
            "engine/src/transport/differentials/footprint_tests.rs::mirrors_and_flat_glass_have_the_areas_of_unfolded_paths",
            "tests/tests/photon/footprints.rs::footprints_behind_mirrors_and_coats_are_those_of_finite_differences",
            "tests/tests/twins/photons.rs::events_agree_with_their_twins",
        ],
        experiment: "tools/test",
        api: &["clerestory::transport::differentials::reflect_differentials"],
        ..Row::of(file!())
    },
    Row {
        id: "PM-PD-4",
        name: "derivatives of interpolated normals from a hit's coordinates",
        role: Role::PartOf("PM-SYS-1"),
        limits: "Facets have none: without interpolated normals a surface is flat.",
        sources: &[sources::FABIANOWSKI_2011.at("§5.1.2")],
        shaders: &["shaders/transport/differentials.glsl"],
        tests: &[
            "engine/src/transport/differentials/chain_tests.rs::derivatives_of_normals_agree_with_finite_differences",
            "tests/tests/twins/photons.rs::derivatives_of_normals_agree_with_their_twins",
        ],
        experiment: "tools/test",
        api: &["clerestory::transport::differentials::normal_derivatives"],
        ..Row::of(file!())
    },
    Row {
        id: "PM-PD-5",
        name: "differentials of refraction",
        role: Role::PartOf("PM-SYS-1"),
        limits: "First derivatives only, which misjudge footprints close to total reflection.",
        sources: &[sources::IGEHY_1999.whole(), sources::FABIANOWSKI_2011.at("§3.1.2.5")],
        shaders: &["shaders/transport/differentials.glsl"],
        tests: &[
            "engine/src/transport/differentials/chain_tests.rs::each_event_agrees_with_finite_differences",
            "engine/src/transport/differentials/footprint_tests.rs::mirrors_and_flat_glass_have_the_areas_of_unfolded_paths",
            "tests/tests/photon/footprints.rs::footprints_behind_glass_are_those_of_finite_differences",
            "tests/tests/twins/photons.rs::events_agree_with_their_twins",
        ],
        api: &["clerestory::transport::differentials::refract_differentials"],
        ..Row::of(file!())
    },
    Row {
        id: "PM-PD-6",
        name: "differentials of diffuse reflection: absorbed and re-emitted",
        role: Role::PartOf("PM-SYS-1"),
        limits: "Keeps the expected area of a footprint and forgets its shape; footprints are then too large, 2.58 times the share of each photon in the median of a closed room.",
        sources: &[sources::FABIANOWSKI_2011.at("§5.1.3")],
        shaders: &["shaders/transport/differentials.glsl"],
        tests: &[
            "engine/src/transport/differentials/footprint_tests.rs::reemission_keeps_the_expected_area",
            "engine/src/techniques/photon_mapping/kernel/room_tests.rs::footprints_after_a_diffuse_bounce_follow_the_density_of_photons",
            "engine/src/transport/differentials/path_differentials.rs::reemission_stands_between_its_two_parameters_and_all_four",
        ],
        experiment: "tools/test",
        api: &[
            "clerestory::transport::differentials::diffuse_reemission",
            "clerestory::transport::differentials::reemission_differentials",
        ],
        ..Row::of(file!())
    },
    Row {
        id: "PM-PD-7",
        name: "differentials of Russian roulette, and of the choice among specular lobes",
        role: Role::PartOf("PM-SYS-1"),
        limits: "Right for many photons and not for each: the next diffuse reflection keeps the area of the footprint alone, without the probabilities of rough lobes, labels and blended surfaces.",
        sources: &[sources::FABIANOWSKI_2011.at("§5.1.4")],
        shaders: &["shaders/transport/differentials.glsl"],
        tests: &[
            "engine/src/transport/differentials/footprint_tests.rs::roulette_makes_up_for_those_that_it_ends",
            "engine/src/transport/bsdf/tests.rs::delta_lobes_are_chosen_as_often_as_they_say",
            "tests/tests/twins/scattering.rs::the_scattering_function_agrees_with_its_twin",
            "tests/tests/photon/footprints.rs::footprints_behind_glass_are_those_of_finite_differences",
            "tests/tests/photon/footprints.rs::footprints_behind_mirrors_and_coats_are_those_of_finite_differences",
            "tests/tests/twins/photons.rs::events_agree_with_their_twins",
        ],
        experiment: "tools/test",
        api: &["clerestory::transport::differentials::roulette_differentials"],
        ..Row::of(file!())
    },
    Row {
        id: "PM-PD-13",
        name: "differentials of camera rays",
        role: Role::Kernel,
        limits: "Pinholes only; a function, since no kernel filters textures by it.",
        sources: &[sources::IGEHY_1999.whole()],
        shaders: &["shaders/transport/differentials.glsl"],
        tests: &[
            "engine/src/transport/differentials/footprint_tests.rs::camera_footprints_are_pixels",
            "tests/tests/twins/photons.rs::emissions_agree_with_their_twins",
        ],
        api: &["clerestory::transport::differentials::camera_differentials"],
        ..Row::of(file!())
    },
];
