//! Cones of the normals of lights and of the directions around them: unions and their measure.
//!
//! Source: Conty Estevez and Kulla (2018), §4.1 and algorithm 1.

use glam::DVec3;
use std::f64::consts::{FRAC_PI_2, PI, TAU};

/// Length of the cross product below which two axes are opposite or equal.
const PARALLEL: f64 = 1e-9;

/// To where lights shine: normals within an angle of an axis, and light within another angle of the normals.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LightCone {
    /// Unit vector.
    pub axis: DVec3,
    /// Greatest angle between the axis and a normal, in \[0, π\].
    pub spread: f64,
    /// Greatest angle between a normal and a direction that its light takes, in \[0, π\].
    pub reach: f64,
}

impl LightCone {
    /// Of light to all sides.
    pub const ALL: Self = Self {
        axis: DVec3::Z,
        spread: PI,
        reach: FRAC_PI_2,
    };

    /// Of a surface that shines from its front.
    pub fn of_front(normal: DVec3) -> Self {
        Self {
            axis: normal,
            spread: 0.0,
            reach: FRAC_PI_2,
        }
    }
}

/// A cone that holds two others; the least one where neither axis is opposite to the other.
pub fn cone_union(a: &LightCone, b: &LightCone) -> LightCone {
    let (a, b) = if a.spread >= b.spread { (a, b) } else { (b, a) };
    let reach = a.reach.max(b.reach);
    let angle = a.axis.angle_between(b.axis);
    if (angle + b.spread).min(PI) <= a.spread {
        return LightCone { reach, ..*a };
    }
    let spread = 0.5 * (a.spread + angle + b.spread);
    let pivot = a.axis.cross(b.axis);
    if spread >= PI || pivot.length() < PARALLEL {
        // Axes that are equal but for rounding differ by less than any slack.
        let spread = if spread < PI && a.axis.dot(b.axis) > 0.0 {
            a.spread
        } else {
            PI
        };
        return LightCone { spread, reach, ..*a };
    }
    let turn = spread - a.spread;
    let across = pivot.normalize().cross(a.axis);
    LightCone {
        axis: (a.axis * turn.cos() + across * turn.sin()).normalize(),
        spread,
        reach,
    }
}

/// The measure of a cone in the cost of a split: its solid angle, and around it the directions that light takes, weighted by the cosine.
pub fn cone_measure(cone: &LightCone) -> f64 {
    let (spread, whole) = (cone.spread, (cone.spread + cone.reach).min(PI));
    TAU * (1.0 - spread.cos())
        + FRAC_PI_2
            * (2.0 * whole * spread.sin() - (spread - 2.0 * whole).cos() - 2.0 * spread * spread.sin() + spread.cos())
}
