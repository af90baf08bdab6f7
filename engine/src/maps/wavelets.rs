//! Light from all directions in Haar wavelets on a cube's faces, of which the greatest are kept: few numbers for light with edges.
//!
//! Source: R. Ng, R. Ramamoorthi, P. Hanrahan, "All-Frequency Shadows Using Non-linear Wavelet Lighting Approximation", SIGGRAPH 2003: the two-dimensional Haar basis on each face,
//! and the choice of terms by their size. Here texels are scaled by the root of their solid angle, so that the basis is orthonormal over the sphere: no other terms of the basis, as many of them, leave a
//! smaller square of the error.
//!
//! Bias: terms that are left out. In the mean over the sphere nothing is lost once the terms of the whole faces are kept, but for solid angles that differ within a face. Which terms are kept depends on the light, and each has its place as a further
//! number; harmonics of few bands ([`harmonics`](super::harmonics)) have none. Of equal terms the first are kept. Deterministic. A yardstick for maps that are looked up.

use glam::DVec3;

use super::{MapImage, Parametrization};
use crate::catalogue::{Bias, Role, Row, Source};
use crate::{Error, Result};

/// The greatest terms of the light about a place.
#[derive(Debug, Clone, PartialEq)]
pub struct WaveletLight {
    side: u32,
    /// Places among all terms, face by face, and values; the greatest first.
    terms: Vec<(u32, DVec3)>,
    /// Of the terms that are left out: their squares' sum over that of all.
    lost: f64,
}

impl WaveletLight {
    /// So many terms, at most all, of a cube map (W·m⁻²·sr⁻¹).
    ///
    /// # Errors
    /// [`Error::Setting`] for a map that is no cube with a power of two of texels along a side, and for texels that are not finite.
    pub fn new(image: &MapImage, terms: usize) -> Result<Self> {
        let (map, size) = (image.map(), image.size());
        if map != Parametrization::Cube || !size.x.is_power_of_two() {
            let value = format!("{map} of {size}");
            let cause = "is no cube with a power of two of texels along a side";
            return Err(Error::setting("map", value, cause));
        }
        if !image.texels().iter().all(|texel| texel.is_finite()) {
            return Err(Error::setting("map", map, "has a texel that is not finite"));
        }
        let scaled = image.texels().iter().zip(roots(size.x));
        let mut values: Vec<DVec3> = scaled.map(|(texel, root)| root * texel.as_dvec3()).collect();
        for face in values.chunks_exact_mut((size.x * size.x) as usize) {
            haar(face, size.x as usize);
        }
        let mut all: Vec<(u32, DVec3)> = (0..).zip(values).collect();
        // Stable: of equal ones the first.
        all.sort_by(|a, b| b.1.length_squared().total_cmp(&a.1.length_squared()));
        let power = |terms: &[(u32, DVec3)]| terms.iter().rev().map(|term| term.1.length_squared()).sum::<f64>();
        let kept = terms.min(all.len());
        let whole = power(&all);
        let lost = if whole > 0.0 { power(&all[kept..]) / whole } else { 0.0 };
        all.truncate(kept);
        Ok(Self {
            side: size.x,
            terms: all,
            lost,
        })
    }

    /// How many terms there are, each a number for red, green and blue and its place.
    pub fn numbers(&self) -> usize {
        self.terms.len()
    }

    /// ∫ (L − L̃)² dω over ∫ L² dω, of the radiance L̃ that is kept.
    pub fn lost(&self) -> f64 {
        self.lost
    }

    /// Radiance as far as the terms go; it may be below 0.
    ///
    /// # Errors
    /// None of what [`WaveletLight::new`] takes.
    pub fn image(&self) -> Result<MapImage> {
        let texels = (self.side * self.side) as usize;
        let mut values = vec![DVec3::ZERO; texels * Parametrization::Cube.layers() as usize];
        for (place, value) in &self.terms {
            values[*place as usize] = *value;
        }
        for face in values.chunks_exact_mut(texels) {
            unhaar(face, self.side as usize);
        }
        let scaled = values.iter().zip(roots(self.side));
        MapImage::new(
            Parametrization::Cube,
            glam::UVec2::splat(self.side),
            scaled.map(|(value, root)| (*value / root).as_vec3()).collect(),
        )
    }
}

/// Roots of the texels' solid angles, in their order.
fn roots(side: u32) -> impl Iterator<Item = f64> {
    let (map, size) = (Parametrization::Cube, glam::UVec2::splat(side));
    map.texels(size)
        .map(move |texel| map.texel_solid_angle(size, texel).sqrt())
}

/// The orthonormal two-dimensional Haar transform of a square, row by row, in place: at each level means of four go to the first quarter, differences across, down and both to the others.
pub fn haar(values: &mut [DVec3], side: usize) {
    let mut level = side;
    let mut square = vec![DVec3::ZERO; side * side];
    while level > 1 {
        let half = level / 2;
        for y in 0..half {
            for x in 0..half {
                let at = |i: usize, j: usize| values[(2 * y + j) * side + 2 * x + i];
                let (a, b, c, d) = (at(0, 0), at(1, 0), at(0, 1), at(1, 1));
                square[y * level + x] = 0.5 * (a + b + c + d);
                square[y * level + half + x] = 0.5 * (a - b + c - d);
                square[(half + y) * level + x] = 0.5 * (a + b - c - d);
                square[(half + y) * level + half + x] = 0.5 * (a - b - c + d);
            }
        }
        for y in 0..level {
            values[y * side..y * side + level].copy_from_slice(&square[y * level..(y + 1) * level]);
        }
        level = half;
    }
}

/// The inverse of [`haar`], which is its transpose.
pub fn unhaar(values: &mut [DVec3], side: usize) {
    let mut level = 2;
    let mut square = vec![DVec3::ZERO; side * side];
    while level <= side {
        let half = level / 2;
        for y in 0..half {
            for x in 0..half {
                let at = |i: usize, j: usize| values[(j * half + y) * side + i * half + x];
                let (mean, across, down, both) = (at(0, 0), at(1, 0), at(0, 1), at(1, 1));
                let mut put = |i: usize, j: usize, value: DVec3| square[(2 * y + j) * level + 2 * x + i] = 0.5 * value;
                put(0, 0, mean + across + down + both);
                put(1, 0, mean - across + down - both);
                put(0, 1, mean + across - down - both);
                put(1, 1, mean - across - down + both);
            }
        }
        for y in 0..level {
            values[y * side..y * side + level].copy_from_slice(&square[y * level..(y + 1) * level]);
        }
        level *= 2;
    }
}

const NG_2003: Source = Source {
    key: "ng-2003",
    authors: "R. Ng, R. Ramamoorthi, P. Hanrahan",
    title: "All-Frequency Shadows Using Non-linear Wavelet Lighting Approximation",
    venue: "SIGGRAPH",
    year: 2003,
};

/// Rows of the catalogue.
pub(crate) const ROWS: &[Row] = &[Row {
    id: "MET-P9-WAVELETS",
    name: "environment light in Haar wavelets on a cube, the greatest terms kept",
    role: Role::Yardstick,
    limits: "One place, light as far as infinity; a term takes its place beside its value, and the transform is of the host.",
    sources: &[NG_2003.whole()],
    bias: Some(Bias::Biased("terms that are left out")),
    tests: &[
        "engine/src/maps/wavelets.rs::terms_are_orthonormal_and_give_the_map_back",
        "engine/src/maps/wavelets.rs::few_terms_hold_edges_that_harmonics_blur",
        "engine/src/maps/wavelets.rs::maps_without_wavelets_are_refused",
    ],
    api: &["clerestory::maps::wavelets::WaveletLight"],
    ..Row::of(file!())
}];

#[cfg(test)]
mod tests {
    use super::*;
    use crate::maps::gather::lit_room::LitRoom;
    use crate::maps::harmonics::HarmonicLight;
    use glam::UVec2;

    const SIDE: u32 = 16;

    fn lit() -> MapImage {
        LitRoom::PUBLISHED.maps(Parametrization::Cube, SIDE).expect("maps").0
    }

    /// ∫ (L − L̃)² dω over ∫ L² dω.
    fn lost(map: &MapImage, found: impl Fn(crate::maps::Texel) -> DVec3) -> f64 {
        let (kind, size) = (map.map(), map.size());
        let (mut off, mut whole) = (0.0, 0.0);
        for texel in kind.texels(size) {
            let (angle, value) = (kind.texel_solid_angle(size, texel), map.at(texel).as_dvec3());
            off += angle * (found(texel) - value).length_squared();
            whole += angle * value.length_squared();
        }
        off / whole
    }

    #[test]
    fn terms_are_orthonormal_and_give_the_map_back() {
        // Columns of the transform of a square of 8².
        let columns: Vec<Vec<DVec3>> = (0..64)
            .map(|i| {
                let mut values = vec![DVec3::ZERO; 64];
                values[i] = DVec3::ONE;
                haar(&mut values, 8);
                values
            })
            .collect();
        for (i, a) in columns.iter().enumerate() {
            for (j, b) in columns.iter().enumerate() {
                let sum: f64 = a.iter().zip(b).map(|(a, b)| a.x * b.x).sum();
                assert!((sum - f64::from(u8::from(i == j))).abs() < 1e-12, "{i} {j}: {sum}");
            }
        }
        // An even square is its mean alone, and a slope across has nothing down.
        let mut even = vec![DVec3::ONE; 64];
        haar(&mut even, 8);
        assert!((even[0] - 8.0).length() < 1e-12 && even[1..].iter().all(|value| value.length() < 1e-12));
        let mut slope: Vec<DVec3> = (0..64).map(|i| DVec3::splat(f64::from(i % 8))).collect();
        haar(&mut slope, 8);
        assert!(slope[32..].iter().all(|value| value.length() < 1e-12) && slope[1].x < -1.0);
        let map = lit();
        let all = WaveletLight::new(&map, usize::MAX).expect("light");
        assert_eq!((all.numbers(), all.lost()), (6 * 16 * 16, 0.0));
        for (found, expected) in all.image().expect("map").texels().iter().zip(map.texels()) {
            assert!((*found - *expected).abs().max_element() < 1e-5, "{found} {expected}");
        }
        let dark = MapImage::from_fn(Parametrization::Cube, UVec2::splat(4), |_| DVec3::ZERO).expect("map");
        assert_eq!(WaveletLight::new(&dark, 3).expect("light").lost(), 0.0);
    }

    #[test]
    fn few_terms_hold_edges_that_harmonics_blur() {
        let map = lit();
        let mut last = 1.0;
        for (order, terms) in [(2, 9), (4, 25), (8, 81)] {
            let light = WaveletLight::new(&map, terms).expect("light");
            assert_eq!(light.numbers(), terms);
            let image = light.image().expect("map");
            let off = lost(&map, |texel| image.at(texel).as_dvec3());
            // What is said to be lost is.
            assert!((off - light.lost()).abs() < 1e-6, "{off} {}", light.lost());
            let harmonics = HarmonicLight::new(&map, order).expect("light");
            assert_eq!(harmonics.numbers(), terms);
            let direction = |texel| map.map().texel_direction(map.size(), texel).expect("direction");
            let blurred = lost(&map, |texel| harmonics.radiance(direction(texel)));
            println!("{terms} numbers: wavelets lose {off:.4}, harmonics {blurred:.4}");
            assert!(off < 0.6 * blurred && off < 0.7 * last, "{terms}: {off} {blurred}");
            last = off;
            // The greatest are kept: any other choice of as many loses more.
            let least = light.terms.last().expect("terms").1.length();
            let all = WaveletLight::new(&map, usize::MAX).expect("light");
            assert!(all.terms[terms..].iter().all(|term| term.1.length() <= least));
        }
    }

    #[test]
    fn maps_without_wavelets_are_refused() {
        let even = |map, side| MapImage::from_fn(map, UVec2::splat(side), |_| DVec3::ONE).expect("map");
        for (map, words) in [
            (even(Parametrization::OctahedronQuadratic, 16), "is no cube"),
            (even(Parametrization::Cube, 12), "is no cube with a power of two"),
            (
                MapImage::from_fn(Parametrization::Cube, UVec2::splat(4), |_| DVec3::INFINITY).expect("map"),
                "not finite",
            ),
        ] {
            let error = WaveletLight::new(&map, 4).expect_err(words).to_string();
            assert!(error.contains(words), "{error}");
        }
    }
}
