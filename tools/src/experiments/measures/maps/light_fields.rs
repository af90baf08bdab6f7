//! Light from all directions that maps hold: lobes of several widths, what look-ups give of them, and irradiance under what a map holds.

use clerestory::Result;
use clerestory::maps::irradiance::IrradianceSource;
use clerestory::maps::{MapImage, MapPoint, Parametrization};
use glam::{DVec2, DVec3, UVec2};
use std::f64::consts::PI;

use crate::experiments::measures::errors::greatest;
use crate::random::Random;

/// Concentrations of the lobes, exp(κ(cos − 1)); widths are 1/√κ.
pub const CONCENTRATIONS: [f64; 3] = [4.0, 64.0, 1024.0];
/// Lobes of each.
pub const LOBES: usize = 32;

/// Lobes in random directions: concentration, middle.
pub struct LobeField(Vec<(f64, DVec3)>);

impl LobeField {
    /// That of a seed.
    pub fn new(seed: u32) -> Self {
        let mut random = Random::new(seed);
        let mut lobes = Vec::new();
        for concentration in CONCENTRATIONS {
            lobes.extend((0..LOBES).map(|_| (concentration, random.direction())));
        }
        Self(lobes)
    }

    /// Radiance from a direction.
    pub fn radiance(&self, d: DVec3) -> f64 {
        self.0.iter().map(|(k, middle)| (k * (middle.dot(d) - 1.0)).exp()).sum()
    }

    /// What a bilinear look-up in a map of it is off by.
    pub fn error(&self, map: Parametrization, size: UVec2, d: DVec3, right: f64) -> f64 {
        let taps = map.taps(size, d);
        let taps = taps.iter().flatten().filter(|tap| tap.weight > 0.0);
        // The texel of a rim whose centre is outside of the disc holds what is at the rim.
        let held = taps.map(|tap| {
            let centre = map.texel_direction(size, tap.texel).unwrap_or(d);
            tap.weight * self.radiance(centre)
        });
        held.sum::<f64>() - right
    }
}

/// Standard deviation of values about their mean.
pub fn deviation(values: &[f64]) -> f64 {
    let count = values.len() as f64;
    let mean = values.iter().sum::<f64>() / count;
    (values.iter().map(|value| (value - mean).powi(2)).sum::<f64>() / count).sqrt()
}

/// A map that holds a light at the centres of its texels; at the rim of a disc, at the texel's point next to the middle.
pub fn held(map: Parametrization, size: UVec2, light: impl Fn(DVec3) -> f64 + Sync) -> Result<MapImage> {
    MapImage::from_fn(map, size, |texel| {
        let [lower, upper] = texel.bounds(size);
        let uv = DVec2::splat(0.5).clamp(lower, upper);
        let inside = MapPoint { layer: texel.layer, uv };
        let d = map.texel_direction(size, texel).or_else(|| map.decode(inside));
        DVec3::splat(d.map_or(0.0, &light))
    })
}

/// Irradiance under a sky that fades to the horizon, max(0, z): the integral over the half spaces about z and about the normal.
pub fn irradiance_of_sky(n: &DVec3) -> f64 {
    let gamma = n.z.clamp(-1.0, 1.0).acos();
    2.0 / 3.0 * ((PI - gamma) * gamma.cos() + gamma.sin())
}

/// Greatest errors of irradiance under an image for normals: by the engine's function, and by texels of one direction each.
pub fn errors_of_irradiance(image: &MapImage, normals: &[DVec3], right: impl Fn(&DVec3) -> f64) -> [f64; 2] {
    let (map, size) = (image.map(), image.size());
    let source = IrradianceSource::new(image);
    let parts: Vec<(DVec3, f64)> = map
        .texels(size)
        .filter_map(|texel| {
            let angle = map.texel_solid_angle(size, texel);
            let d = map.texel_direction(size, texel)?;
            Some((d, angle * f64::from(image.at(texel).x)))
        })
        .collect();
    let mut worst = [0.0f64; 2];
    for n in normals {
        let exact = source.irradiance(*n).unwrap_or_default().x;
        let middles: f64 = parts.iter().map(|(d, light)| light * n.dot(*d).max(0.0)).sum();
        for (worst, found) in worst.iter_mut().zip([exact, middles]) {
            *worst = greatest([*worst, (found - right(n)).abs()]);
        }
    }
    worst
}
