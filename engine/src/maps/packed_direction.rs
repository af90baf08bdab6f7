//! Directions in a word: the octahedron map's two coordinates as signed normalized integers.
//!
//! Sources: Meyer et al., "On Floating-Point Normal Vectors" (2010), as surveyed by Cigolle et al. (JCGT 3(2), 2014), which also has the
//! rounding that tries all four neighbours. Guarantees, for 2 × `bits` with s = 2^(bits − 1) − 1 steps per side: directions are off by at most
//! [`packed_error`] = 3/(√2 s) radians and 2·10⁻⁷ for the roundings of f32, those along axes by nothing: 1.7·10⁻² for 8 bits, 1.04·10⁻³ for 12,
//! 5.2·10⁻⁴ for 13, 1.3·10⁻⁴ for 15, 6.5·10⁻⁵ for 16. Packing is in f32 as on the device. Twin of `maps/packed_direction.glsl`.

use super::octahedron::octahedron_decode;
use crate::catalogue::{Role, Row, sources};
use glam::{DVec2, DVec3, Vec2, Vec3};

/// The greatest angle between a direction and what comes back from [`pack_octahedral`] with that many bits, rad: that of half a step in
/// both coordinates in the middle of a face.
pub fn packed_error(bits: u32) -> f64 {
    1.5 * std::f64::consts::SQRT_2 / steps(bits)
}

fn steps(bits: u32) -> f64 {
    f64::from((1u32 << (bits - 1)) - 1)
}

/// A unit vector with so many `bits` (2 to 16) for each of the two coordinates, the first ones lowest.
pub fn pack_octahedral(n: Vec3, bits: u32) -> u32 {
    let p = n.truncate() / (n.x.abs() + n.y.abs() + n.z.abs());
    let sign = |x: f32| if x < 0.0 { -1.0 } else { 1.0 };
    let p = if n.z < 0.0 {
        Vec2::new((1.0 - p.y.abs()) * sign(p.x), (1.0 - p.x.abs()) * sign(p.y))
    } else {
        p
    };
    let steps = steps(bits) as f32;
    let q = (p * steps + 0.5).floor() + steps;
    q.x as u32 | (q.y as u32) << bits
}

/// As [`pack_octahedral`], with the one of the four roundings about the coordinates whose direction is nearest: two thirds of the greatest
/// error, for hosts.
pub fn pack_octahedral_nearest(n: DVec3, bits: u32) -> u32 {
    let steps = steps(bits);
    let corner = (super::octahedron::octahedron_encode(n) * steps)
        .floor()
        .min(DVec2::splat(steps - 1.0));
    let mut nearest = (f64::INFINITY, 0);
    for step in [DVec2::ZERO, DVec2::X, DVec2::Y, DVec2::ONE] {
        let q = corner + step + steps;
        let word = q.x as u32 | (q.y as u32) << bits;
        let distance = (unpack_octahedral(word, bits) - n).length_squared();
        if distance < nearest.0 {
            nearest = (distance, word);
        }
    }
    nearest.1
}

/// The unit vector of a word.
pub fn unpack_octahedral(word: u32, bits: u32) -> DVec3 {
    let mask = (1u32 << bits) - 1;
    let coordinate = |shift: u32| f64::from((word >> shift) & mask) / steps(bits) - 1.0;
    octahedron_decode(DVec2::new(coordinate(0), coordinate(bits)))
}

/// Rows of the catalogue.
pub(crate) const ROWS: &[Row] = &[Row {
    id: "CL-PACKED",
    name: "directions in a word",
    role: Role::Kernel,
    limits: "Directions are off by up to 3/(√2 s) radians for s steps per side; those along axes are exact.",
    sources: &[sources::MEYER_2010.whole(), sources::CIGOLLE_2014.whole()],
    shaders: &["shaders/maps/packed_direction.glsl"],
    tests: &[
        "engine/src/maps/packed_direction.rs::directions_come_back_within_their_bounds",
        "engine/src/maps/packed_direction.rs::the_nearest_of_four_is_two_thirds_as_far_off",
        "tests/tests/twins/maps.rs::levels_borders_and_words_agree_with_their_twins",
    ],
    api: &[
        "clerestory::maps::packed_direction::pack_octahedral",
        "clerestory::maps::packed_direction::unpack_octahedral",
    ],
    ..Row::of(file!())
}];

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_random::Random;

    /// Directions, every second near the middle of a face, where the map stretches most.
    fn directions(seed: u64, count: u32) -> impl Iterator<Item = Vec3> {
        let mut random = Random(seed);
        (0..count).map(move |i| {
            let n = random.direction();
            let side = Vec3::new(n.x.signum(), n.y.signum(), n.z.signum());
            if i % 2 == 0 {
                (side + 0.05 * random.vector()).normalize()
            } else {
                n
            }
        })
    }

    fn angle(a: DVec3, b: DVec3) -> f64 {
        2.0 * (0.5 * (a - b).length()).asin()
    }

    #[test]
    fn directions_come_back_within_their_bounds() {
        for bits in [8, 12, 13, 15, 16] {
            let bound = packed_error(bits);
            let mut worst = 0.0f64;
            for n in directions(u64::from(bits), 100_000) {
                let back = unpack_octahedral(pack_octahedral(n, bits), bits);
                worst = worst.max(angle(back, n.as_dvec3()));
            }
            println!("{bits} bits: {worst:.4e}, bound {bound:.4e}");
            // A bound that is far from met would be as wrong as one that is exceeded. Beyond it lie the roundings of f32 and, of
            // second order in the step, the curvature of the face.
            assert!(
                worst < bound * (1.0 + bound) + 2e-7 && worst > 0.9 * bound,
                "{bits}: {worst}"
            );
            for axis in [Vec3::X, Vec3::Y, Vec3::Z] {
                for n in [axis, -axis] {
                    assert_eq!(unpack_octahedral(pack_octahedral(n, bits), bits), n.as_dvec3());
                }
            }
        }
    }

    #[test]
    fn the_nearest_of_four_is_two_thirds_as_far_off() {
        for bits in [8, 12, 16] {
            let mut worst = 0.0f64;
            for n in directions(u64::from(bits), 50_000) {
                let n = n.as_dvec3().normalize();
                let back = |word| angle(unpack_octahedral(word, bits), n);
                let (plain, nearest) = (
                    back(pack_octahedral(n.as_vec3(), bits)),
                    back(pack_octahedral_nearest(n, bits)),
                );
                assert!(nearest <= plain + 1e-12, "{n}");
                worst = worst.max(nearest);
            }
            let share = worst / packed_error(bits);
            println!("{bits} bits: {worst:.4e}, {share:.4} of the bound");
            assert!((0.62..0.68).contains(&share), "{share}");
        }
        for axis in [DVec3::X, DVec3::Y, DVec3::Z] {
            for n in [axis, -axis] {
                assert_eq!(unpack_octahedral(pack_octahedral_nearest(n, 8), 8), n);
            }
        }
    }
}
