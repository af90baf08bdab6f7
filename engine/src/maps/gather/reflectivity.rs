//! Reflectivities of lobes as means over cones: the table that lights of any size are looked up in.

use std::f64::consts::{PI, TAU};

use glam::DVec2;

use crate::gpu::shaders::constants::GATHER_TABLE_SIDE;
use crate::{Error, Result};

/// Rings of a cone, and points of a half ring.
const RINGS: u32 = 64;
const POINTS: u32 = 32;
/// Greatest exponent of a lobe, whose rows are 1.8° apart about its axis.
const MAX_EXPONENT: f64 = 64.0;

/// Means of a normalised lobe over cones, by the cosine of the cone's half angle and by half the distance of two points on the unit sphere, √((1 − c)/2) of
/// the cosine c of the cone's axis with the lobe's: evenly fine in angle about the lobe's axis. Each size of cone has the integral 1 over all axes, linear between
/// rows, so that what lines add between entries of narrow lobes is not there.
#[derive(Debug, Clone, PartialEq)]
pub struct Reflectivity {
    exponent: f64,
    values: Vec<f32>,
}

/// Mean over a ring, with cosines a + b cos φ, of max(0, cosine)ˢ.
fn ring(a: f64, b: f64, exponent: f64) -> f64 {
    if exponent == 1.0 {
        if a >= b {
            return a;
        }
        if a <= -b {
            return 0.0;
        }
        let edge = (-a / b).acos();
        return (a * edge + b * edge.sin()) / PI;
    }
    let point = |i: u32| {
        let angle = PI * (f64::from(i) + 0.5) / f64::from(POINTS);
        (a + b * angle.cos()).max(0.0).powf(exponent)
    };
    (0..POINTS).map(point).sum::<f64>() / f64::from(POINTS)
}

/// Mean of (s + 1)/(2π) max(0, cos)ˢ over the cone whose half angle has the cosine `cone`, 0 to 1, about a direction with the cosine `axis` to the
/// lobe's.
pub fn cone_reflectivity(exponent: f64, cone: f64, axis: f64) -> f64 {
    let norm = (exponent + 1.0) / TAU;
    let half = cone.clamp(0.0, 1.0).acos();
    let aside = (1.0 - axis * axis).max(0.0).sqrt();
    if half < 1e-6 {
        return norm * axis.max(0.0).powf(exponent);
    }
    let (mut sum, mut whole) = (0.0, 0.0);
    for i in 0..RINGS {
        let angle = half * (f64::from(i) + 0.5) / f64::from(RINGS);
        let (s, c) = angle.sin_cos();
        sum += s * ring(axis * c, aside * s, exponent);
        whole += s;
    }
    norm * sum / whole
}

/// What a row counts in the integral over all axes of a function that is linear between rows 0 to `last`: solid angle grows by 8π u du with u the row over
/// `last`.
fn axis_weight(row: f64, last: f64) -> f64 {
    let below = if row > 0.0 { row / 2.0 - 1.0 / 6.0 } else { 0.0 };
    let above = if row < last { row / 2.0 + 1.0 / 6.0 } else { 0.0 };
    4.0 * TAU * (below + above) / (last * last)
}

impl Reflectivity {
    /// The table of an exponent.
    ///
    /// # Errors
    /// [`Error::Setting`] for an exponent below 1 or above 64, or one that is no number.
    pub fn new(exponent: f64) -> Result<Self> {
        if !(1.0..=MAX_EXPONENT).contains(&exponent) {
            let cause = format!("is not in 1..={MAX_EXPONENT}");
            return Err(Error::setting("exponent of a gather", exponent, cause));
        }
        let side = GATHER_TABLE_SIDE;
        let last = f64::from(side - 1);
        let value = |i: u32| {
            let (cone, apart) = (f64::from(i % side) / last, f64::from(i / side) / last);
            cone_reflectivity(exponent, cone, 1.0 - 2.0 * apart * apart)
        };
        let mut values: Vec<f64> = (0..side * side).map(value).collect();
        let side = side as usize;
        for cone in 0..side {
            let of_cone = (0..side).map(|row| axis_weight(row as f64, last) * values[row * side + cone]);
            let whole: f64 = of_cone.sum();
            values
                .iter_mut()
                .skip(cone)
                .step_by(side)
                .for_each(|value| *value /= whole);
        }
        Ok(Self {
            exponent,
            values: values.into_iter().map(|value| value as f32).collect(),
        })
    }

    /// The lobe's exponent.
    pub fn exponent(&self) -> f64 {
        self.exponent
    }

    /// Rows from the lobe's axis to its opposite, by √((1 − c)/2) from 0 to 1, each over cosines of half angles from 0 to 1.
    pub fn values(&self) -> &[f32] {
        &self.values
    }

    /// The mean over a cone, by the cosines of its half angle and of its axis with the lobe's, bilinear between entries: twin of `gather_reflectivity`.
    pub fn at(&self, cone: f64, axis: f64) -> f64 {
        let side = GATHER_TABLE_SIDE as usize;
        let last = (side - 1) as f64;
        let place = last * DVec2::new(cone.clamp(0.0, 1.0), (0.5 - 0.5 * axis).clamp(0.0, 1.0).sqrt());
        let corner = place.floor().min(DVec2::splat(last - 1.0));
        let part = place - corner;
        let first = corner.y as usize * side + corner.x as usize;
        let at = |i: usize| f64::from(self.values[first + i]);
        let upper = at(0) + part.x * (at(1) - at(0));
        let lower = at(side) + part.x * (at(side + 1) - at(side));
        upper + part.y * (lower - upper)
    }
}
