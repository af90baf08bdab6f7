//! Procedural density grids: bodies with closed forms for tests, and smoke and clouds from noise.
//!
//! Noise: K. Perlin, "Improving Noise" (SIGGRAPH 2002), with an integer hash ([`noise`](crate::scene::builtin::noise)) for its permutation;
//! sums of octaves (fractional Brownian motion) and the shaping of clouds by noise in the falloff of simple bodies: Ebert, Musgrave, Peachey,
//! Perlin and Worley, "Texturing and Modeling: A Procedural Approach", 3rd edition (2003), chapters 2 and 9. The shapes are the engine's own.
//! Guarantees: pure functions of their parameters, made of additions, multiplications and square roots alone, so that they give the same bits
//! on every machine; densities lie in [0, 1]; smoke, clouds and balls are zero in the outermost cells of grids of at least 8 per side.

use glam::{DAffine3, DVec2, DVec3};
use rayon::prelude::*;

use super::DensityGrid;
use crate::scene::builtin::noise::hash;

/// Greatest number of cells per side.
pub const MAX_SIDE: u32 = 512;

/// A procedural density over the unit cube, y upwards.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Generator {
    /// 1 everywhere.
    Constant,
    /// From 0 at x = 0 to 1 at x = 1, linearly.
    Gradient,
    /// A ball around the centre: 1 there, (1 − r²)² at r of its radius of 0.45.
    Ball,
    /// A plume that rises from the middle of the floor, widens and breaks up.
    Smoke,
    /// A cumulus: a heap of balls on a flat base with a torn surface.
    Cloud,
}

impl Generator {
    /// All of them by their names in files.
    pub const ALL: [(&str, Self); 5] = [
        ("constant", Self::Constant),
        ("gradient", Self::Gradient),
        ("ball", Self::Ball),
        ("smoke", Self::Smoke),
        ("cloud", Self::Cloud),
    ];

    /// The generator of that name.
    pub fn by_name(name: &str) -> Option<Self> {
        Self::ALL
            .iter()
            .find(|(known, _)| *known == name)
            .map(|(_, generator)| *generator)
    }

    /// A grid of `size` cells per side, each held to 1 … [`MAX_SIDE`], at the unit cube. Only smoke and clouds look at the seed.
    pub fn grid(self, size: [u32; 3], seed: u32) -> DensityGrid {
        let size = size.map(|s| s.clamp(1, MAX_SIDE));
        let centre = |i: usize, n: u32| (i as f64 + 0.5) / f64::from(n);
        let [nx, ny, nz] = size.map(|s| s as usize);
        let heap = self.heap(seed);
        let values = (0..ny * nz)
            .into_par_iter()
            .flat_map_iter(|row| {
                let (y, z) = (centre(row % ny, size[1]), centre(row / ny, size[2]));
                let heap = &heap;
                (0..nx).map(move |i| self.density(DVec3::new(centre(i, size[0]), y, z), seed, heap) as f32)
            })
            .collect();
        DensityGrid {
            size,
            values,
            to_world: DAffine3::IDENTITY,
        }
    }

    /// The balls of a cloud.
    fn heap(self, seed: u32) -> Vec<(DVec3, f64)> {
        const BALLS: u32 = 14;
        let count = if self == Self::Cloud { BALLS } else { 0 };
        (0..count)
            .map(|item| {
                let unit = |dimension| f64::from(crate::scene::builtin::noise::unit(seed, item, dimension));
                // Balls lie over an ellipse, the lower and larger ones farther out.
                let height = unit(2) * unit(2);
                let reach = 0.26 * (1.0 - height);
                let across = DVec2::new(2.0 * unit(0) - 1.0, 2.0 * unit(1) - 1.0) * reach;
                let centre = DVec3::new(0.5 + across.x, 0.32 + 0.26 * height, 0.5 + 0.8 * across.y);
                (centre, 0.11 + 0.07 * unit(3))
            })
            .collect()
    }

    fn density(self, p: DVec3, seed: u32, heap: &[(DVec3, f64)]) -> f64 {
        match self {
            Self::Constant => 1.0,
            Self::Gradient => p.x,
            Self::Ball => {
                const RADIUS: f64 = 0.45;
                let inside = 1.0 - (p - DVec3::splat(0.5)).length_squared() / (RADIUS * RADIUS);
                inside.max(0.0) * inside.max(0.0)
            }
            Self::Smoke => smoke(p, seed),
            Self::Cloud => cloud(p, seed, heap),
        }
    }
}

/// Rises from 0 at `from` to 1 at `to` (or falls, when `from` is greater), with flat ends.
fn smooth_step(from: f64, to: f64, x: f64) -> f64 {
    let t = ((x - from) / (to - from)).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

/// Falls to zero in the outermost sixteenth of the cube.
fn fade_at_faces(p: DVec3) -> f64 {
    let to_face = p.min(DVec3::ONE - p).min_element();
    smooth_step(0.0625, 0.125, to_face)
}

fn smoke(p: DVec3, seed: u32) -> f64 {
    // The plume sways with height, more the higher it is.
    let sway = |salt: u32| fbm(seed ^ salt, DVec3::new(p.y * 2.5, 0.7, 0.3), 2) * 0.22 * p.y;
    let radius = 0.06 + 0.2 * p.y;
    // Sway reaches 0.75 · 0.22 and warp 0.875 · 0.15 along each of two axes: nothing lies farther out than the plume with both.
    const GREATEST_SHIFT: f64 = 0.42;
    let across = DVec2::new(p.x - 0.5, p.z - 0.5);
    let fade = fade_at_faces(p);
    if fade == 0.0 || across.length_squared() > (radius + GREATEST_SHIFT) * (radius + GREATEST_SHIFT) {
        return 0.0;
    }
    // Domain warping: the swirls.
    let warp = DVec3::new(
        fbm(seed ^ 3, p * 4.0, 3),
        fbm(seed ^ 4, p * 4.0, 3),
        fbm(seed ^ 5, p * 4.0, 3),
    ) * (0.05 + 0.1 * p.y);
    let r = (across + DVec2::new(sway(1) + warp.x, sway(2) + warp.z)).length() / radius;
    let body = smooth_step(1.0, 0.25, r);
    if body == 0.0 {
        return 0.0;
    }
    let stretched = (p + warp) * DVec3::new(9.0, 6.0, 9.0);
    let texture = 0.45 + 1.4 * fbm(seed ^ 6, stretched, 4);
    let thinning = 1.0 - smooth_step(0.4, 0.95, p.y);
    (body * texture.max(0.0) * thinning * fade).clamp(0.0, 1.0)
}

fn cloud(p: DVec3, seed: u32, heap: &[(DVec3, f64)]) -> f64 {
    let fade = fade_at_faces(p);
    if fade == 0.0 {
        return 0.0;
    }
    // A smooth union: the falloffs of all balls add up.
    let body: f64 = heap
        .iter()
        .map(|&(centre, radius)| {
            let inside = 1.0 - p.distance_squared(centre) / (4.0 * radius * radius);
            inside.max(0.0) * inside.max(0.0)
        })
        .sum();
    if body <= 0.0 {
        return 0.0;
    }
    let torn = body - 0.62 + 0.75 * fbm(seed ^ 7, p * 9.0, 5);
    let base = smooth_step(0.24, 0.3, p.y);
    (smooth_step(0.0, 0.35, torn) * base * fade).clamp(0.0, 1.0)
}

/// Sum of octaves of gradient noise, each of twice the frequency and half the amplitude: about [−1, 1].
pub fn fbm(seed: u32, p: DVec3, octaves: u32) -> f64 {
    let (mut sum, mut amplitude, mut at) = (0.0, 0.5, p);
    for octave in 0..octaves {
        sum += amplitude * gradient_noise(hash(seed).wrapping_add(octave), at);
        amplitude *= 0.5;
        at *= 2.0;
    }
    sum
}

/// Perlin's improved noise in [−1, 1]: zero at whole coordinates, smooth to the second derivative.
pub fn gradient_noise(seed: u32, p: DVec3) -> f64 {
    let cell = p.floor();
    let t = p - cell;
    let [x, y, z] = [cell.x, cell.y, cell.z].map(|c| c as i64 as u32);
    let fade = |t: f64| t * t * t * (t * (t * 6.0 - 15.0) + 10.0);
    let mix = |a: f64, b: f64, t: f64| a + t * (b - a);
    let corner = |dx: u32, dy: u32, dz: u32| {
        let column = hash(
            seed.wrapping_add(hash(x.wrapping_add(dx)))
                .wrapping_add(y.wrapping_add(dy)),
        );
        let offset = t - DVec3::new(f64::from(dx), f64::from(dy), f64::from(dz));
        edge_gradient(hash(column.wrapping_add(z.wrapping_add(dz))), offset)
    };
    let row = |dy, dz| mix(corner(0, dy, dz), corner(1, dy, dz), fade(t.x));
    let plane = |dz| mix(row(0, dz), row(1, dz), fade(t.y));
    mix(plane(0), plane(1), fade(t.z))
}

/// Dot product with one of the twelve directions to the edges of a cube, four of them twice.
fn edge_gradient(hash: u32, p: DVec3) -> f64 {
    let direction = hash >> 28;
    let u = if direction < 8 { p.x } else { p.y };
    let v = match direction {
        0..4 => p.y,
        12 | 14 => p.x,
        _ => p.z,
    };
    let sign = |bit: u32, value: f64| if direction & bit == 0 { value } else { -value };
    sign(1, u) + sign(2, v)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn noise_is_zero_at_lattice_points_bounded_and_continuous() {
        let mut greatest = 0.0f64;
        for i in 0..4000u32 {
            let unit = |d| f64::from(crate::scene::builtin::noise::unit(3, i, d));
            let p = DVec3::new(unit(0), unit(1), unit(2)) * 40.0 - 20.0;
            assert_eq!(gradient_noise(9, p.floor()), 0.0);
            let value = gradient_noise(9, p);
            // Gradients are no longer than √2 and the fade's slope is below 2, on eight corners: 12 bounds the slope by far.
            let step = DVec3::splat(1e-6);
            assert!((gradient_noise(9, p + step) - value).abs() < 12.0 * step.length());
            greatest = greatest.max(value.abs());
        }
        assert!(greatest > 0.5 && greatest <= 1.0, "{greatest}");
    }

    #[test]
    fn test_bodies_have_their_closed_forms() {
        let n = 16;
        for (name, generator) in Generator::ALL {
            assert_eq!(Generator::by_name(name), Some(generator));
        }
        assert_eq!(Generator::by_name("fog"), None);
        assert!(Generator::Constant.grid([n, 1, 2], 0).values.iter().all(|v| *v == 1.0));
        let gradient = Generator::Gradient.grid([n, 2, 3], 0);
        assert_eq!((gradient.size, gradient.values.len()), ([n, 2, 3], 96));
        assert!((gradient.density_in_cube(DVec3::new(0.3, 0.9, 0.1)) - 0.3).abs() < 1e-6);
        let ball = Generator::Ball.grid([n; 3], 0);
        // Central cells lie (√3/32)/0.45 of the radius out.
        let inside = 1.0 - 3.0 / 1024.0 / 0.2025;
        assert!((ball.cell(7, 8, 7) - inside * inside).abs() < 1e-7);
    }

    #[test]
    fn smoke_and_clouds_fill_some_of_the_cube_and_none_of_its_faces() {
        for generator in [Generator::Smoke, Generator::Cloud] {
            let n = 24u32;
            let grid = generator.grid([n; 3], 1);
            assert_eq!(grid, generator.grid([n; 3], 1));
            assert_ne!(grid, generator.grid([n; 3], 2));
            assert!(grid.values.iter().all(|v| (0.0..=1.0).contains(v)));
            let filled = grid.values.iter().filter(|v| **v > 0.05).count() as f64 / f64::from(n * n * n);
            assert!((0.02..0.6).contains(&filled), "{generator:?}: {filled}");
            assert!(grid.max() > 0.4, "{generator:?}: {}", grid.max());
            for (a, b) in (0..n).flat_map(|a| (0..n).map(move |b| (a, b))) {
                for end in [0, n - 1] {
                    assert_eq!(grid.cell(end, a, b) + grid.cell(a, end, b) + grid.cell(a, b, end), 0.0);
                }
            }
        }
    }
}
