//! Rays of every awkward kind about triangles.
//!
//! The hard cases include this file as a module of theirs.

use super::{Random, Ray};
use glam::Vec3;

/// Rays along axes with signed zeros, through vertices and edges, starting on them, bounded, about triangles that `pick` chooses.
pub fn rays(random: &mut Random, count: usize, pick: impl Fn(&mut Random) -> [Vec3; 3]) -> Vec<Ray> {
    let negative_zero = Vec3::splat(-0.0);
    (0..count)
        .map(|i| {
            let (a, b) = (pick(random), pick(random));
            let size = (a[0] - b[0]).length().max((a[1] - a[0]).length());
            let outside = b[1] + random.vector() * size;
            let axis = random.choose(&Vec3::AXES) * random.choose(&[1.0, -1.0]);
            match i % 10 {
                0 => Ray::new(outside, random.vector()),
                1 => Ray::new(outside, a[0] - outside),
                2 => Ray::new(outside, (a[0] + a[1]) * 0.5 - outside),
                3 => Ray::new(outside, ((a[0] + a[1] + a[2]) / 3.0 - outside).normalize_or_zero()),
                // Parallel to an axis, through a vertex, an edge, a box face.
                4 => Ray::new(a[0] - axis * size, axis),
                5 => Ray::new((a[0] + a[1]) * 0.5 - axis * size, axis + negative_zero),
                6 => Ray::new(a[0].with_x(b[0].x), axis),
                // Starting on a vertex; along an edge.
                7 => Ray::new(a[0], random.vector()),
                8 => Ray::new(a[0], a[1] - a[0]),
                _ => Ray {
                    t_min: 0.25,
                    t_max: 1.0,
                    ..Ray::new(outside, a[0] - outside)
                },
            }
        })
        .collect()
}
