//! Density and shear of maps along meridians, as plots.

use clerestory::maps::statistics::anisotropy;
use clerestory::maps::{MapPoint, Parametrization};
use glam::{DVec2, DVec3, UVec2};

use super::stated_densities::STATED;
use crate::experiments::findings::{Axes, Findings, Measured, curves};
use crate::experiments::plot::Curve;

/// Points of a great circle.
const STEPS: u32 = 720;
/// Steps of plots, and the degrees of each.
const AXIS: (u32, f64) = (4, 45.0);
/// Where plots end: the ratio and the shear.
const TOPS: [f64; 2] = [2.7, 5.0];
/// Files, titles and azimuths in degrees of plots of densities, and of those of shear.
const DENSITIES: [(&str, &str, f64); 2] = [
    ("density-0", "Density along the meridian of azimuth 0°", 0.0),
    ("density-45", "Density along the meridian of azimuth 45°", 45.0),
];
const SHEARS: [(&str, &str, f64); 2] = [
    ("shear-0", "Shear along the meridian of azimuth 0°", 0.0),
    ("shear-45", "Shear along the meridian of azimuth 45°", 45.0),
];
const X: &str = "angle from the pole (degrees)";

/// A function of places of all maps along the meridian of an azimuth, from the pole on.
fn meridians(azimuth: f64, value: impl Fn(Parametrization, MapPoint) -> f64) -> Vec<Curve> {
    let (sin, cos) = azimuth.to_radians().sin_cos();
    let along = DVec2::new(cos, sin);
    let point = |map: Parametrization, step: u32| {
        let degrees = 180.0 * (f64::from(step) + 0.5) / f64::from(STEPS);
        let (sin, cos) = degrees.to_radians().sin_cos();
        let d: DVec3 = (sin * along).extend(cos);
        (map, degrees, map.encode(d).map_or(f64::NAN, |at| value(map, at)))
    };
    let of = |(map, _): &(Parametrization, _)| (0..STEPS).map(|step| point(*map, step)).collect::<Vec<_>>();
    let points: Vec<(Parametrization, f64, f64)> = STATED.iter().flat_map(of).collect();
    curves(
        &points,
        |(map, ..)| map.to_string(),
        |(_, degrees, value)| (*degrees, Measured::exact(*value)),
    )
}

/// Adds plots along two meridians.
pub fn with_plots(mut findings: Findings) -> Findings {
    for (file, title, azimuth) in DENSITIES {
        let axes = Axes::even(X, "solid angle of a texel over the mean", TOPS[0], AXIS);
        findings = findings.curves(file, title, axes, meridians(azimuth, Parametrization::density_ratio));
    }
    let shear = |map: Parametrization, at| anisotropy(map.texel_derivatives(UVec2::new(map.aspect(), 1), at));
    for (file, title, azimuth) in SHEARS {
        let axes = Axes::even(X, "ratio of the axes of a spot", TOPS[1], AXIS);
        findings = findings.curves(file, title, axes, meridians(azimuth, shear));
    }
    findings
}
