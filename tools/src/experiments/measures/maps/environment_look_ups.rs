//! Look-ups of every parametrization in environments that are turned, by texels for the whole sphere.

use clerestory::maps::Parametrization;
use glam::{DMat3, DVec3, UVec2};
use rayon::prelude::*;

use super::environments::Environment;
use crate::random::Random;

/// All maps, the perspective family by its members of the document; the first is what the others are compared with.
pub const MAPS: [Parametrization; 12] = [
    Parametrization::Cube,
    Parametrization::EqualArea,
    Parametrization::OctahedronQuadratic,
    Parametrization::OctahedronRectangular,
    Parametrization::OctahedronPerspective {
        c: std::f64::consts::FRAC_1_SQRT_2,
    },
    Parametrization::OctahedronPerspective {
        c: std::f64::consts::SQRT_2,
    },
    Parametrization::OctahedronPerspective { c: 0.5 },
    Parametrization::OctahedronPerspective { c: 2.0 },
    Parametrization::DualParaboloid,
    Parametrization::LatLong,
    Parametrization::Sphere,
    Parametrization::Nusselt,
];

/// Turns of each environment, over which squares of errors are averaged: features lie elsewhere on the maps.
pub const TURNS: u32 = 6;

/// A map's name in tables and plots.
pub fn name(map: Parametrization) -> String {
    match map {
        Parametrization::OctahedronPerspective { c } => format!("octahedron c = {c:.3}")
            .trim_end_matches('0')
            .trim_end_matches('.')
            .into(),
        Parametrization::Nusselt => "nusselt (half)".into(),
        other => other.to_string(),
    }
}

/// The size of a layer that comes closest to a number of texels for the whole sphere.
pub fn size(map: Parametrization, texels: u64) -> UVec2 {
    let share = map.solid_angle() / (4.0 * std::f64::consts::PI);
    map.size_for(share * texels as f64)
}

/// Texels for the whole sphere.
pub fn texels(map: Parametrization, size: UVec2) -> f64 {
    let share = map.solid_angle() / (4.0 * std::f64::consts::PI);
    f64::from(size.element_product() * map.layers()) / share
}

/// Squares of errors, values, squares of values and their number.
type Sums = [f64; 4];

/// RMS errors over the deviation, of all turns together and of each.
#[derive(Debug, Clone, PartialEq)]
pub struct Errors {
    /// Of all turns.
    pub all: f64,
    /// Of each.
    pub by_turn: Vec<f64>,
}

impl Errors {
    fn of(turns: &[Sums]) -> Self {
        let error = |[squares, values, value_squares, count]: Sums| {
            let deviation = (value_squares / count - (values / count).powi(2)).sqrt();
            (squares / count).sqrt() / deviation
        };
        let add = |a: Sums, b: &Sums| -> Sums { std::array::from_fn(|i| a[i] + b[i]) };
        Self {
            all: error(turns.iter().fold([0.0; 4], add)),
            by_turn: turns.iter().copied().map(error).collect(),
        }
    }
}

/// RMS error of look-ups over the environment's deviation, by environment.
pub fn errors(map: Parametrization, size: UVec2, environments: &[Environment], directions: &[DVec3]) -> Vec<Errors> {
    type ByTurn = [Sums; TURNS as usize];
    let turns: Vec<DMat3> = (0..TURNS).map(turn).collect();
    let of = |d: &DVec3| -> Vec<ByTurn> {
        let Some(taps) = map.taps(size, *d) else {
            return vec![ByTurn::default(); environments.len()];
        };
        let held: Vec<(f64, DVec3)> = taps
            .iter()
            .filter(|tap| tap.weight > 0.0)
            // The texel of a rim whose centre is outside of the disc holds what is at the rim.
            .map(|tap| (tap.weight, map.texel_direction(size, tap.texel).unwrap_or(*d)))
            .collect();
        let sums = |environment: &Environment| {
            let mut sums = ByTurn::default();
            for (sums, turn) in sums.iter_mut().zip(&turns) {
                let value = |d: DVec3| (environment.radiance)(*turn * d);
                let right = value(*d);
                let found: f64 = held.iter().map(|(weight, centre)| weight * value(*centre)).sum();
                *sums = [(found - right).powi(2), right, right * right, 1.0];
            }
            sums
        };
        environments.iter().map(sums).collect()
    };
    // In order, so that sums do not depend on the number of threads.
    let all: Vec<Vec<ByTurn>> = directions.par_iter().map(of).collect();
    (0..environments.len())
        .map(|at| {
            let mut sums = ByTurn::default();
            for one in &all {
                let terms = sums.as_flattened_mut().iter_mut().zip(one[at].as_flattened());
                terms.for_each(|(sum, more)| *sum += more);
            }
            Errors::of(&sums)
        })
        .collect()
}

/// A turn that leads no axis to one.
fn turn(number: u32) -> DMat3 {
    let mut random = Random::new(60 + number);
    let (z, other) = (random.direction(), random.direction());
    let x = z.cross(other).normalize();
    DMat3::from_cols(x, z.cross(x), z)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn budgets_are_met_and_names_are_short() {
        for map in MAPS {
            for power in [10, 14, 18] {
                let budget = 1u64 << power;
                let ratio = texels(map, size(map, budget)) / budget as f64;
                // Half a row of the least map.
                assert!((0.9..1.1).contains(&ratio), "{map}: {ratio}");
            }
            assert!(name(map).chars().count() < 24, "{}", name(map));
        }
        assert_eq!(name(MAPS[4]), "octahedron c = 0.707");
        assert_eq!(name(MAPS[7]), "octahedron c = 2");
    }

    /// Bilinear look-ups of smooth light are off by the square of a texel: a quarter with four times the texels. Over folds the map itself has
    /// a kink, where they are off by a texel in a strip as wide: the root of its square over all is the power 3/2.
    #[test]
    fn errors_of_smooth_light_fall_as_the_texels_do() {
        let smooth = [Environment {
            name: "smooth",
            radiance: Box::new(|d| 1.0 + d.x * d.y + 0.5 * d.z),
        }];
        let mut random = Random::new(62);
        let directions: Vec<DVec3> = (0..2000).map(|_| random.direction()).collect();
        for (map, expected) in [
            (Parametrization::LatLong, 4.0f64),
            (Parametrization::OctahedronQuadratic, 4f64.powf(0.75)),
        ] {
            let at = |power: u32| errors(map, size(map, 1 << power), &smooth, &directions)[0].all;
            let ratio = at(12) / at(14);
            assert!((ratio / expected - 1.0).abs() < 0.15, "{map}: {ratio}");
        }
    }
}
