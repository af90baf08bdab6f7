//! Several maps at several places: the nearest, or the two nearest blended.
//!
//! Source: L. Szirmay-Kalos et al., "Specular Effects on the GPU: State of the Art", CGF 28(6), 2009 (several maps, and their blend); the weights
//! are the engine's own. The nearest map changes at once where another place becomes nearer. The two nearest
//! have weights (d₃ − d₁)/d₁ and (d₃ − d₂)/d₂ of the distances to the three nearest places, which change continuously over space but for the points
//! that are equally far from three places: the second map has no weight where the third takes its turn, and both have the same where they
//! change places. Of two maps in all the weights are 1/d₁ and 1/d₂. GLSL: `maps/map_places.glsl`.

use glam::DVec3;

use crate::catalogue::{Role, Row, sources};
use crate::gpu::shaders::constants::MAP_PLACES_MAX;
use crate::{Error, Result};

/// Two maps and the weight of the second; the first has the rest.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MapBlend {
    /// The nearest map, and the second nearest; the nearest again where there is one alone.
    pub maps: [u32; 2],
    /// Weight of the second, 0 to ½.
    pub weight: f64,
}

/// The maps for a point, such as what a ray meets, by the places of all.
///
/// # Errors
/// [`Error::Setting`] for no places or more than 16, and for places or a point that are not finite.
pub fn blended_maps(places: &[DVec3], point: DVec3) -> Result<MapBlend> {
    let most = MAP_PLACES_MAX as usize;
    if !(1..=most).contains(&places.len()) {
        return Err(Error::setting(
            "places of maps",
            places.len(),
            format!("are not 1 to {most}"),
        ));
    }
    for place in places.iter().chain([&point]) {
        if !place.is_finite() {
            return Err(Error::setting("place of a map, or point", place, "is not finite"));
        }
    }
    // Nearest first; of equal distances the first map.
    let (mut maps, mut near) = ([0, 0], [f64::INFINITY; 3]);
    for (i, place) in places.iter().enumerate() {
        let d = place.distance(point);
        if d < near[0] {
            (maps, near) = ([i as u32, maps[0]], [d, near[0], near[1]]);
        } else if d < near[1] {
            (maps, near) = ([maps[0], i as u32], [near[0], d, near[1]]);
        } else {
            near[2] = near[2].min(d);
        }
    }
    if places.len() == 1 {
        maps[1] = maps[0];
    }
    Ok(MapBlend {
        maps,
        weight: map_weight(near, places.len() as u32),
    })
}

/// Weight of the second of two maps, by the distances to the three nearest of `count` places.
pub fn map_weight(near: [f64; 3], count: u32) -> f64 {
    // The weights times d₁ d₂, which is 0 at a place.
    let [first, second] = match count {
        0 | 1 => [1.0, 0.0],
        2 => [near[1], near[0]],
        _ => [(near[2] - near[0]) * near[1], (near[2] - near[1]) * near[0]],
    };
    let sum = first + second;
    if sum > 0.0 { second / sum } else { 0.0 }
}

/// The map for a point by the nearest place alone.
///
/// # Errors
/// As [`blended_maps`].
pub fn nearest_map(places: &[DVec3], point: DVec3) -> Result<u32> {
    blended_maps(places, point).map(|blend| blend.maps[0])
}

/// Rows of the catalogue.
pub(crate) const ROWS: &[Row] = &[Row {
    id: "MET-E3",
    name: "several maps: the nearest, or the two nearest blended",
    role: Role::Kernel,
    limits: "The nearest map changes at once half-way between places, and blends show both maps' parallax.",
    sources: &[sources::SZIRMAY_KALOS_2009.whole()],
    shaders: &["shaders/maps/map_places.glsl", "shaders/maps/proxy_look_up.comp"],
    tests: &[
        "engine/src/maps/impostor/tests/proxies.rs::the_nearest_map_jumps_and_the_blend_does_not",
        "engine/src/maps/impostor/tests/proxies.rs::places_that_are_none_are_refused",
        "tests/tests/twins/impostors.rs::maps_are_chosen_as_their_twins_say",
        "tests/tests/maps/proxies.rs::two_maps_are_looked_up_and_blended",
        "tests/tests/maps/proxies.rs::maps_and_shapes_that_are_none_are_refused",
    ],
    api: &[
        "clerestory::maps::impostor::places::nearest_map",
        "clerestory::maps::impostor::places::blended_maps",
        "clerestory::maps::impostor::proxy_maps::ProxyMaps",
    ],
    ..Row::of(file!())
}];
