//! Look-ups on both sides of the seams of an octahedron map, in a field of lobes of random colours.

use clerestory::Result;
use clerestory::maps::{MapImage, Parametrization};
use glam::{DVec3, IVec2, UVec2};

use crate::experiments::measures::errors::greatest;
use crate::random::Random;

/// How far directions lie beside a seam.
pub const ASIDE: f64 = 1e-7;
/// Lobes of the field.
pub const LOBES: usize = 64;
/// Concentration of a lobe, exp(κ(cos − 1)): a twelfth wide.
const CONCENTRATION: f64 = 150.0;

fn field(lobes: &[(DVec3, DVec3)], d: DVec3) -> DVec3 {
    let light = |(middle, color): &(DVec3, DVec3)| (CONCENTRATION * (middle.dot(d) - 1.0)).exp() * *color;
    lobes.iter().map(light).sum()
}

/// A bilinear look-up of a tile: beyond its border the last texel goes on.
pub fn clamped(image: &MapImage, border: u32, d: DVec3) -> Option<DVec3> {
    let (map, size) = (image.map(), image.size());
    let at = map.encode(d)?;
    let place = at.uv * size.as_dvec2() - 0.5;
    let (corner, part) = (place.floor().as_ivec2(), place.fract_gl());
    let border = border.cast_signed();
    let held = |x: i32, y: i32| {
        let p = (corner + IVec2::new(x, y)).clamp(IVec2::splat(-border), size.as_ivec2() - 1 + border);
        Some(image.at(map.wrap(size, 0, p.x, p.y)?).as_dvec3())
    };
    let upper = held(0, 0)?.lerp(held(1, 0)?, part.x);
    Some(upper.lerp(held(0, 1)?.lerp(held(1, 1)?, part.x), part.y))
}

/// Directions at both sides of the seams of the square layout: the planes x = 0 and y = 0 below the equator.
pub fn pairs(count: u32) -> Vec<[DVec3; 2]> {
    let mut random = Random::new(17);
    let pair = |i: u32| {
        let turn = random.range(0.0, std::f64::consts::PI);
        let (sin, cos) = turn.sin_cos();
        [ASIDE, -ASIDE].map(|aside| match i % 2 {
            0 => DVec3::new(aside, cos, -sin),
            _ => DVec3::new(cos, aside, -sin),
        })
    };
    (0..count).map(pair).collect()
}

/// RMS difference of look-ups over pairs of directions; not a number where one of them fails.
pub fn jump(pairs: &[[DVec3; 2]], look_up: impl Fn(DVec3) -> Option<DVec3>) -> f64 {
    let square = |[a, b]: &[DVec3; 2]| Some((look_up(*a)? - look_up(*b)?).length_squared());
    let squares = pairs.iter().map(|pair| square(pair).unwrap_or(f64::NAN));
    (squares.sum::<f64>() / (3.0 * pairs.len() as f64)).sqrt()
}

/// Lobes of random colours in random directions.
fn lobes() -> Vec<(DVec3, DVec3)> {
    let mut random = Random::new(18);
    let mut lobe = || {
        let middle = random.direction();
        (middle, DVec3::new(random.unit(), random.unit(), random.unit()))
    };
    (0..LOBES).map(|_| lobe()).collect()
}

/// The field in a map of so many rows.
pub fn image(map: Parametrization, rows: u32) -> Result<MapImage> {
    let (lobes, size) = (lobes(), UVec2::new(rows * map.aspect(), rows));
    MapImage::from_fn(map, size, |texel| {
        map.texel_direction(size, texel)
            .map_or(DVec3::ZERO, |d| field(&lobes, d))
    })
}

/// Standard deviation of what an image holds over all directions.
pub fn deviation(image: &MapImage) -> f64 {
    let (map, size) = (image.map(), image.size());
    let mean = image.integral() / map.solid_angle();
    let squares: f64 = map
        .texels(size)
        .map(|texel| map.texel_solid_angle(size, texel) * (image.at(texel).as_dvec3() - mean).length_squared())
        .sum();
    (squares / (3.0 * map.solid_angle())).sqrt()
}

/// Relative change of ∫ L dω, worst of the channels.
pub fn lost(image: &MapImage, before: DVec3) -> f64 {
    greatest(((image.integral() - before) / before).abs().to_array())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_look_up_that_fails_is_no_continuous_one() {
        let pairs = pairs(4);
        assert!(jump(&pairs, Some) < 2.0 * ASIDE);
        let [_, failing] = pairs[2];
        assert!(jump(&pairs, |d| (d != failing).then_some(d)).is_nan());
    }
}
