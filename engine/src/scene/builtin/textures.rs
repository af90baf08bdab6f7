//! Procedural images for generated scenes: checkers, blotches, bump-derived normal maps, and a sky.
//!
//! The sky is a plain gradient with a sun disc, not a model of the atmosphere.

use glam::{Quat, Vec3};

use super::noise::value_noise;
use crate::scene::{Environment, Filter, Image, Texture, Wrap};
use crate::srgb;

/// Encodes a linear value as an sRGB byte (IEC 61966-2-1), rounded to the nearest.
pub fn srgb_byte(linear: f32) -> u8 {
    srgb::srgb_byte(linear.into())
}

/// Encodes a value in [0, 1] as a byte, rounded to the nearest.
pub fn unorm_byte(value: f32) -> u8 {
    (value.clamp(0.0, 1.0) * 255.0 + 0.5) as u8
}

/// A use of an image without a transform, repeating.
pub fn plain(image: u32, filter: Filter) -> Texture {
    Texture {
        image,
        uv_set: 0,
        wrap: [Wrap::Repeat; 2],
        filter,
        transform: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]],
    }
}

/// An image from a function of texel coordinates.
pub fn image(name: &str, width: u32, height: u32, texel: impl Fn(u32, u32) -> [u8; 4]) -> Image {
    Image {
        name: name.into(),
        width,
        height,
        texels: (0..height)
            .flat_map(|y| (0..width).map(move |x| (x, y)))
            .map(|(x, y)| texel(x, y))
            .collect(),
    }
}

/// Two linear colours in a checkerboard of `cells`² squares, sRGB encoded.
pub fn checker(name: &str, size: u32, cells: u32, colors: [Vec3; 2]) -> Image {
    let cell = (size / cells.max(1)).max(1);
    image(name, size, size, |x, y| {
        let color = colors[((x / cell + y / cell) % 2) as usize];
        [srgb_byte(color.x), srgb_byte(color.y), srgb_byte(color.z), 255]
    })
}

/// Three octaves of value noise in [0, 1] that tile over the image.
pub fn blotches(seed: u32, size: u32, cells: u32, x: u32, y: u32) -> f32 {
    let mut sum = 0.0;
    let mut weight = 0.0;
    for octave in 0..3 {
        let period = cells << octave;
        let scale = period as f32 / size as f32;
        let amplitude = 0.5f32.powi(octave);
        sum += amplitude * value_noise(seed + octave as u32, x as f32 * scale, y as f32 * scale, period);
        weight += amplitude;
    }
    sum / weight
}

/// A tangent-space normal map from tiling bumps (glTF convention: +Y up in texture space, v grows downwards).
pub fn bumps(name: &str, seed: u32, size: u32, cells: u32, strength: f32) -> Image {
    let height = |x: u32, y: u32| blotches(seed, size, cells, x % size, y % size);
    let slope = strength * size as f32 / cells as f32;
    image(name, size, size, |x, y| {
        let dx = (height(x + 1, y) - height(x + size - 1, y)) / 2.0 * slope;
        let dy = (height(x, y + 1) - height(x, y + size - 1)) / 2.0 * slope;
        let n = Vec3::new(-dx, dy, 1.0).normalize() * 0.5 + 0.5;
        [unorm_byte(n.x), unorm_byte(n.y), unorm_byte(n.z), 255]
    })
}

/// A blue gradient over a grey ground with a sun disc towards `sun` (unit), 128 × 64 texels.
pub fn sky(sun: Vec3, strength: f32) -> Environment {
    const WIDTH: u32 = 128;
    const HEIGHT: u32 = 64;
    const ZENITH: Vec3 = Vec3::new(0.15, 0.35, 0.9);
    const HORIZON: Vec3 = Vec3::new(0.8, 0.9, 1.0);
    const GROUND: Vec3 = Vec3::new(0.2, 0.18, 0.16);
    const SUN: Vec3 = Vec3::new(300.0, 270.0, 220.0);
    const SUN_HALF_ANGLE: f32 = 0.05;
    let radiance = (0..WIDTH * HEIGHT).map(|i| {
        let theta = ((i / WIDTH) as f32 + 0.5) / HEIGHT as f32 * std::f32::consts::PI;
        let phi = (((i % WIDTH) as f32 + 0.5) / WIDTH as f32 - 0.5) * std::f32::consts::TAU;
        let direction = Vec3::new(theta.sin() * phi.sin(), theta.cos(), -theta.sin() * phi.cos());
        let base = if direction.y < 0.0 {
            GROUND
        } else {
            HORIZON.lerp(ZENITH, direction.y.sqrt())
        };
        if direction.angle_between(sun) < SUN_HALF_ANGLE {
            base + SUN
        } else {
            base
        }
    });
    Environment {
        name: "procedural sky".into(),
        width: WIDTH,
        height: HEIGHT,
        radiance: radiance.collect(),
        rotation: Quat::IDENTITY,
        strength,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn srgb_encoding_hits_its_fixed_points() {
        assert_eq!(
            [0.0, 1.0, 0.214_041_14, -1.0, 9.0].map(srgb_byte),
            [0, 255, 128, 0, 255]
        );
    }

    #[test]
    fn the_sun_is_where_it_was_asked_for() {
        let sun = Vec3::new(0.3, 0.6, -0.74).normalize();
        let sky = sky(sun, 1.0);
        let brightest = (0..sky.radiance.len())
            .max_by(|&a, &b| sky.radiance[a].x.total_cmp(&sky.radiance[b].x))
            .expect("texels");
        let v = ((brightest as u32 / sky.width) as f32 + 0.5) / sky.height as f32;
        let u = ((brightest as u32 % sky.width) as f32 + 0.5) / sky.width as f32;
        // The documented mapping: u = atan2(x, −z)/2π + ½, v = acos(y)/π; one texel is 0.05 rad.
        assert!((v - sun.y.acos() / std::f32::consts::PI).abs() < 2.0 / 64.0);
        assert!((u - (sun.x.atan2(-sun.z) / std::f32::consts::TAU + 0.5)).abs() < 3.0 / 128.0);
    }

    #[test]
    fn normal_maps_hold_unit_vectors_and_bumps() {
        let map = bumps("b", 1, 64, 4, 1.0);
        let decoded = |t: &[u8; 4]| Vec3::new(t[0].into(), t[1].into(), t[2].into()) / 127.5 - 1.0;
        // A byte step is 1/127.5, so that the decoded length is within √3/255 of 1.
        assert!(map.texels.iter().all(|t| (decoded(t).length() - 1.0).abs() < 0.0069));
        assert!(map.texels.iter().any(|t| decoded(t).z < 0.95));
    }
}
