//! A closed empty room whose photons carry differentials, for tests.

use super::{
    Differentials, diffuse_reemission, emission_differentials, reflect_differentials, roulette_differentials,
    transfer_differentials,
};
use crate::test_random::Random;
use crate::transport::warp::{
    UNIFORM_SPHERE_PDF, cosine_hemisphere_pdf, orthonormal_basis, square_to_cosine_hemisphere, square_to_sphere,
};
use glam::{DVec2, DVec3};

/// Sides of the room, m; a corner is the origin.
pub const ROOM: DVec3 = DVec3::new(6.0, 6.0, 3.0);
/// Its walls, m².
pub const ROOM_AREA: f64 = 144.0;
/// Its isotropic point light.
pub const ROOM_LIGHT: DVec3 = DVec3::new(3.0, 3.0, 2.5);

/// A photon at a wall.
pub struct RoomHit {
    /// 1 for the first hit.
    pub number: u32,
    pub position: DVec3,
    /// Into the room.
    pub normal: DVec3,
    pub differentials: Differentials,
}

/// Distance to the walls and the normal there, into the room.
pub fn room_wall(x: DVec3, w: DVec3) -> (f64, DVec3) {
    let mut best = (f64::INFINITY, DVec3::ZERO);
    for axis in 0..3 {
        let t = (if w[axis] > 0.0 { ROOM[axis] - x[axis] } else { -x[axis] }) / w[axis];
        if w[axis] != 0.0 && t < best.0 {
            best = (t, -w[axis].signum() * DVec3::AXES[axis]);
        }
    }
    best
}

/// Sends `photons` through the room up to their third hits, with walls of reflectivity `rho`, diffuse or mirrors.
pub fn room_photons(photons: u32, rho: f64, mirrors: bool, scale: f64, seed: u64, mut visit: impl FnMut(&RoomHit)) {
    let mut random = Random(seed);
    for _ in 0..photons {
        let mut unit = || f64::from(random.unit());
        let mut x = ROOM_LIGHT;
        let mut w = square_to_sphere(DVec2::new(unit(), unit()));
        let mut d = emission_differentials(w, UNIFORM_SPHERE_PDF);
        for number in 1..=3 {
            let (t, n) = room_wall(x, w);
            x = (x + t * w).clamp(DVec3::ZERO, ROOM);
            d = transfer_differentials(&d, scale * t, w, n);
            visit(&RoomHit {
                number,
                position: x,
                normal: n,
                differentials: d,
            });
            if unit() >= rho {
                break;
            }
            let u = DVec2::new(unit(), unit());
            if mirrors {
                d = reflect_differentials(&d, w, n, [DVec3::ZERO; 2]);
                w -= 2.0 * w.dot(n) * n;
            } else {
                let local = square_to_cosine_hemisphere(u);
                let (tangent, bitangent) = orthonormal_basis(n);
                w = local.x * tangent + local.y * bitangent + local.z * n;
                d = diffuse_reemission(&d, w, cosine_hemisphere_pdf(local.z));
            }
            d = roulette_differentials(&d, rho);
        }
    }
}
