//! Light from all directions in spherical harmonics: a few numbers in place of a map, for matte surfaces.
//!
//! Source: R. Ramamoorthi and P. Hanrahan, "An Efficient Representation for Irradiance Environment Maps", SIGGRAPH 2001. Real harmonics of the bands 0 to `order`, orthonormal
//! over the sphere; the cosine's share of each band is in closed form, that of odd ones above the first is 0.
//!
//! Bias: bands above the order are left out. Irradiance of the second order is off by a few percent of its mean under walls with a bright patch, and by 9 % at most of what may be; radiance itself rings about edges. Sums of f64 in the
//! order of texels, each at its middle by its exact solid angle. Deterministic. A yardstick for maps that are looked up.

use std::f64::consts::{PI, TAU};

use glam::DVec3;

use super::MapImage;
use crate::catalogue::{Bias, Role, Row, sources};
use crate::{Error, Result};

/// Greatest order.
pub const ORDER_MAX: u32 = 16;

/// Coefficients of the light about a place.
#[derive(Debug, Clone, PartialEq)]
pub struct HarmonicLight {
    order: u32,
    /// Band by band, from −l to l.
    coefficients: Vec<DVec3>,
}

impl HarmonicLight {
    /// Of a map, W·m⁻²·sr⁻¹, by the bands up to an order.
    ///
    /// # Errors
    /// [`Error::Setting`] for an order above [`ORDER_MAX`].
    pub fn new(image: &MapImage, order: u32) -> Result<Self> {
        if order > ORDER_MAX {
            return Err(Error::setting("order", order, format!("is above {ORDER_MAX}")));
        }
        let (map, size) = (image.map(), image.size());
        let mut coefficients = vec![DVec3::ZERO; count(order)];
        for texel in map.texels(size) {
            let Some(direction) = map.texel_direction(size, texel) else {
                continue;
            };
            let light = map.texel_solid_angle(size, texel) * image.at(texel).as_dvec3();
            for (sum, value) in coefficients.iter_mut().zip(harmonics(order, direction)) {
                *sum += value * light;
            }
        }
        Ok(Self { order, coefficients })
    }

    /// How many numbers there are for each of red, green and blue.
    pub fn numbers(&self) -> usize {
        self.coefficients.len()
    }

    /// Radiance from a unit direction, as far as the bands go; it may be below 0.
    pub fn radiance(&self, direction: DVec3) -> DVec3 {
        self.weighted(direction, |_| 1.0)
    }

    /// ∫ L max(0, n·ω) dω about a unit normal, as far as the bands go; it may be below 0.
    pub fn irradiance(&self, normal: DVec3) -> DVec3 {
        self.weighted(normal, cosine_share)
    }

    fn weighted(&self, direction: DVec3, share: impl Fn(u32) -> f64) -> DVec3 {
        let values = harmonics(self.order, direction);
        let mut sum = DVec3::ZERO;
        for band in 0..=self.order {
            let first = (band * band) as usize;
            let own = first..first + 2 * band as usize + 1;
            let of_band: DVec3 = own.map(|i| values[i] * self.coefficients[i]).sum();
            sum += share(band) * of_band;
        }
        sum
    }
}

/// Numbers of all bands up to an order.
const fn count(order: u32) -> usize {
    ((order + 1) * (order + 1)) as usize
}

/// Real orthonormal harmonics of a unit direction, band by band, from −l to l.
pub fn harmonics(order: u32, direction: DVec3) -> Vec<f64> {
    let z = direction.z.clamp(-1.0, 1.0);
    let across = direction.truncate().length();
    let (cosine, sine) = if across > 0.0 {
        (direction.x / across, direction.y / across)
    } else {
        (1.0, 0.0)
    };
    let mut all = vec![0.0; count(order)];
    // Associated Legendre polynomials of the degree m with their normalization, which keeps them near 1, up in l; cosines and sines of m angles beside.
    let (mut diagonal, mut turned) = ((1.0 / (2.0 * TAU)).sqrt(), (1.0, 0.0));
    for m in 0..=order {
        let two = if m == 0 { 1.0 } else { 2f64.sqrt() };
        let (mut last, mut value) = (0.0, diagonal);
        for l in m..=order {
            let middle = (l * l + l) as usize;
            all[middle + m as usize] = two * value * turned.0;
            if m > 0 {
                all[middle - m as usize] = two * value * turned.1;
            }
            let before = if l > m { last / step(l, m) } else { 0.0 };
            let next = step(l + 1, m) * (z * value - before);
            (last, value) = (value, next);
        }
        let next = f64::from(m + 1);
        diagonal *= across * ((2.0 * next + 1.0) / (2.0 * next)).sqrt();
        turned = (turned.0 * cosine - turned.1 * sine, turned.0 * sine + turned.1 * cosine);
    }
    all
}

/// What the recurrence in l multiplies by, for l above m: √((4l² − 1)/(l² − m²)).
fn step(l: u32, m: u32) -> f64 {
    let (l, m) = (f64::from(l), f64::from(m));
    ((4.0 * l * l - 1.0) / (l * l - m * m)).sqrt()
}

/// What the cosine over a half space makes of a band.
fn cosine_share(band: u32) -> f64 {
    match band {
        0 => PI,
        1 => TAU / 3.0,
        odd if odd % 2 == 1 => 0.0,
        band => {
            let l = f64::from(band);
            // l! / (2^l (l/2)!²), factor by factor.
            let central: f64 = (1..=band / 2).map(|i| 1.0 - 0.5 / f64::from(i)).product();
            let sign = if band % 4 == 2 { 1.0 } else { -1.0 };
            TAU * sign * central / ((l + 2.0) * (l - 1.0))
        }
    }
}

/// Rows of the catalogue.
pub(crate) const ROWS: &[Row] = &[Row {
    id: "MET-P9",
    name: "environment light in spherical harmonics",
    role: Role::Yardstick,
    limits: "Matte surfaces at one place: light is as far as infinity, and edges of radiance ring.",
    sources: &[sources::RAMAMOORTHI_HANRAHAN_2001.whole()],
    bias: Some(Bias::Biased("bands above the order are left out")),
    tests: &[
        "engine/src/maps/harmonics.rs::harmonics_are_orthonormal_and_add_up",
        "engine/src/maps/harmonics.rs::irradiance_converges_to_that_of_the_map",
    ],
    api: &["clerestory::maps::harmonics::HarmonicLight"],
    ..Row::of(file!())
}];

#[cfg(test)]
mod tests {
    use super::*;
    use crate::maps::Parametrization;
    use crate::maps::gather::lit_room::{LitRoom, relative_errors};
    use crate::maps::irradiance::IrradianceSource;
    use glam::UVec2;

    /// Legendre polynomials.
    fn legendre(band: u32, x: f64) -> f64 {
        let (mut last, mut value) = (0.0, 1.0);
        for l in 0..band {
            let l = f64::from(l);
            (last, value) = (value, ((2.0 * l + 1.0) * x * value - l * last) / (l + 1.0));
        }
        value
    }

    #[test]
    fn harmonics_are_orthonormal_and_add_up() {
        let axes = [
            DVec3::Z,
            DVec3::NEG_Z,
            DVec3::X,
            DVec3::new(0.6, -0.64, 0.48),
            DVec3::new(-0.36, 0.48, -0.8),
        ];
        for a in axes {
            for b in axes {
                let (of_a, of_b) = (harmonics(ORDER_MAX, a), harmonics(ORDER_MAX, b));
                for band in 0..=ORDER_MAX {
                    let first = (band * band) as usize;
                    let sum: f64 = (first..first + 2 * band as usize + 1).map(|i| of_a[i] * of_b[i]).sum();
                    let expected = f64::from(2 * band + 1) / (2.0 * TAU) * legendre(band, a.dot(b));
                    assert!((sum - expected).abs() < 1e-9, "band {band}: {sum} {expected}");
                }
            }
        }
        // Signs and places of the first bands, and orthonormality by sums over a map.
        let [x, y, z] = [0.6, -0.64, 0.48];
        let first = harmonics(1, DVec3::new(x, y, z));
        let scale = (3.0 / (2.0 * TAU)).sqrt();
        for (found, expected) in first
            .iter()
            .zip([(1.0 / (2.0 * TAU)).sqrt(), scale * y, scale * z, scale * x])
        {
            assert!((found - expected).abs() < 1e-12);
        }
        let (map, size) = (Parametrization::Cube, UVec2::splat(24));
        let mut sums = vec![[0.0; 25]; 25];
        for texel in map.texels(size) {
            let values = harmonics(4, map.texel_direction(size, texel).expect("direction"));
            let angle = map.texel_solid_angle(size, texel);
            for i in 0..25 {
                for j in 0..25 {
                    sums[i][j] += angle * values[i] * values[j];
                }
            }
        }
        for (i, row) in sums.iter().enumerate() {
            for (j, sum) in row.iter().enumerate() {
                assert!((sum - f64::from(u8::from(i == j))).abs() < 0.02, "{i} {j}: {sum}");
            }
        }
    }

    #[test]
    fn irradiance_converges_to_that_of_the_map() {
        // Of even light all of it is in the first band, and it is π.
        let size = UVec2::splat(16);
        let even = MapImage::from_fn(Parametrization::Cube, size, |_| DVec3::ONE).expect("map");
        let even = HarmonicLight::new(&even, 4).expect("light");
        assert!((even.irradiance(DVec3::new(0.6, -0.64, 0.48)) - PI).abs().max_element() < 5e-3);
        assert_eq!(even.numbers(), 25);

        let (map, _) = LitRoom::PUBLISHED.maps(Parametrization::Cube, 32).expect("maps");
        let source = IrradianceSource::new(&map);
        let points = LitRoom::points(DVec3::ZERO, 100);
        let exact: Vec<f64> = points
            .iter()
            .map(|p| source.irradiance(p.axis).expect("normal").x)
            .collect();
        let off = |order: u32| {
            let light = HarmonicLight::new(&map, order).expect("light");
            let found: Vec<f64> = points.iter().map(|p| light.irradiance(p.axis).x).collect();
            relative_errors(&found, &exact)[0]
        };
        let [none, first, second, third, fourth, eighth] = [0, 1, 2, 3, 4, 8].map(off);
        println!("{none} {first} {second} {third} {fourth} {eighth}");
        assert!(
            (none - 36.0).abs() < 4.0 && (first - 11.5).abs() < 2.0,
            "{none} {first}"
        );
        assert!(second < 3.0 && (third - second).abs() < 1e-9, "{second} {third}");
        assert!(fourth < 0.6 * second && eighth < 0.5 * fourth, "{fourth} {eighth}");
        assert!(HarmonicLight::new(&map, ORDER_MAX + 1).is_err());
        // Radiance is on the side where it comes from.
        let light = HarmonicLight::new(&map, 8).expect("light");
        let patch = DVec3::new(0.5, -1.0, 0.3).normalize();
        assert!(light.radiance(patch).x > 2.0 * light.radiance(-patch).x);
    }
}
