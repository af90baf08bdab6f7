//! Simple shapes in place of the surroundings: where a ray from x meets a sphere or a box about a map, or a hemisphere above it; and the
//! mirrored and refracted directions that rays have.
//!
//! Sources: K. Bjorke, "Image-Based Lighting", GPU Gems, 2004, chapter 19 (the sphere); S. Lagarde, A. Zanuttini, "Local Image-based
//! Lighting with Parallax-corrected Cubemaps", SIGGRAPH Talks, 2012 (the box); L. Szirmay-Kalos et al., "Specular Effects on the GPU:
//! State of the Art", CGF 28(6), 2009 (the hemisphere above a ground).
//!
//! x is where the ray begins, from the map's place; r is its unit direction. The direction to look up is x + d r. Bias: the proxy's shape in
//! place of the true one; a box that is the room is exact. Each gives 0 for a proxy that lies behind the ray. GLSL: `maps/proxy.glsl`.

use glam::DVec3;

use crate::catalogue::{Role, Row, sources};

/// Distance along the ray to where it leaves the sphere about the map's place; of a ray that misses it, to its point next to that place.
pub fn sphere_proxy(x: DVec3, r: DVec3, radius: f64) -> f64 {
    let along = x.dot(r);
    // The squared distance of the line from the place, without the difference of squares that cancels.
    let aside = (x - along * r).length_squared();
    ((radius * radius - aside).max(0.0).sqrt() - along).max(0.0)
}

/// Distance along the ray to where it leaves a box.
pub fn box_proxy(x: DVec3, r: DVec3, low: DVec3, high: DVec3) -> f64 {
    let mut least = f64::INFINITY;
    for axis in 0..3 {
        let wall = if r[axis] < 0.0 { low[axis] } else { high[axis] };
        if r[axis] != 0.0 {
            least = least.min((wall - x[axis]) / r[axis]);
        }
    }
    least.max(0.0)
}

/// Height of a hemisphere above x, along its unit `up`: what rays that leave the ground at a right angle have to go. One offset of the
/// look-up for all rays of a point, exact for r = up alone.
pub fn hemisphere_proxy(x: DVec3, up: DVec3, radius: f64) -> f64 {
    let height = x.dot(up);
    let aside = (x - height * up).length_squared();
    ((radius * radius - aside).max(0.0).sqrt() - height).max(0.0)
}

/// The mirrored direction of one that arrives, about a unit normal.
pub fn mirrored(d: DVec3, n: DVec3) -> DVec3 {
    d - 2.0 * n.dot(d) * n
}

/// The refracted direction of one that arrives against a unit normal, with `ratio` the index where it comes from over that where it goes;
/// the mirrored one where all light is reflected.
pub fn refracted(d: DVec3, n: DVec3, ratio: f64) -> DVec3 {
    let cos_i = n.dot(d);
    let k = 1.0 - ratio * ratio * (1.0 - cos_i * cos_i);
    if k < 0.0 {
        return mirrored(d, n);
    }
    ratio * d - (ratio * cos_i + k.sqrt()) * n
}

/// Rows of the catalogue.
pub(crate) const ROWS: &[Row] = &[
    Row {
        id: "MET-E4",
        name: "spheres and boxes in place of the surroundings of a map",
        role: Role::Kernel,
        limits: "The proxy's shape shows wherever the surroundings are not it; nothing hides anything.",
        sources: &[
            sources::BJORKE_2004.at("chapter 19"),
            sources::LAGARDE_ZANUTTINI_2012.whole(),
        ],
        shaders: &["shaders/maps/proxy.glsl", "shaders/maps/proxy_look_up.comp"],
        tests: &[
            "engine/src/maps/impostor/tests/proxies.rs::a_box_is_exact_in_its_room",
            "engine/src/maps/impostor/tests/proxies.rs::spheres_err_as_published",
            "engine/src/maps/impostor/tests/proxies.rs::proxies_behind_a_ray_and_rays_along_walls_give_finite_distances",
            "engine/src/maps/impostor/proxy_maps.rs::shapes_beyond_single_precision_are_refused",
            "tests/tests/twins/impostors.rs::proxies_agree_with_their_twins",
            "tests/tests/maps/proxies.rs::shapes_are_looked_up_as_their_twins_say",
            "tests/tests/impostor_pictures/reflections.rs::a_box_is_exact_in_a_box",
        ],
        api: &[
            "clerestory::maps::impostor::proxy::sphere_proxy",
            "clerestory::maps::impostor::proxy::box_proxy",
            "clerestory::maps::impostor::proxy_maps::ProxyMaps",
        ],
        ..Row::of(file!())
    },
    Row {
        id: "MET-E5",
        name: "a hemisphere above a ground at fixed height: one offset of look-ups for all rays of a point",
        role: Role::Kernel,
        limits: "Exact for rays at a right angle to the ground alone.",
        sources: &[sources::SZIRMAY_KALOS_2009.whole()],
        shaders: &["shaders/maps/proxy.glsl", "shaders/maps/proxy_look_up.comp"],
        tests: &[
            "engine/src/maps/impostor/tests/proxies.rs::a_hemisphere_is_exact_for_rays_that_rise",
            "tests/tests/twins/impostors.rs::proxies_agree_with_their_twins",
            "tests/tests/maps/proxies.rs::shapes_are_looked_up_as_their_twins_say",
        ],
        api: &[
            "clerestory::maps::impostor::proxy::hemisphere_proxy",
            "clerestory::maps::impostor::proxy_maps::ProxyMaps",
        ],
        ..Row::of(file!())
    },
];
