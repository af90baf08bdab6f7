//! Gathers against exact irradiance in a room whose walls differ.

mod errors;
mod parts;

use std::f64::consts::PI;

use glam::DVec3;

use super::lit_room::{LitRoom, relative_errors};
use super::{GatherLights, GatherPoint, Lobe, Reflectivity, SolidAngleForm, Terms};

/// Errors of a gather's irradiance over a sphere of points, %: RMS and bias.
fn irradiance_errors(lights: &GatherLights, points: &[GatherPoint]) -> [f64; 2] {
    let exact: Vec<f64> = points
        .iter()
        .map(|point| LitRoom::PUBLISHED.irradiance(point))
        .collect();
    let found: Vec<f64> = points.iter().map(|point| lights.irradiance(point).x).collect();
    relative_errors(&found, &exact)
}

/// Points of a sphere at a published place.
fn sphere(place: DVec3) -> Vec<GatherPoint> {
    LitRoom::points(place, 400)
}
