//! Nusselt's map: the hemisphere about z, dropped on its base, so that equal areas have equal projected solid angles.
//!
//! Source: W. Nusselt, "Graphische Bestimmung des Winkelverhältnisses bei der Wärmestrahlung", Zeitschrift des VDI 72, 1928. Solid angles
//! are without bound at the horizon. Twin of `maps/nusselt.glsl`.

use super::disc;
use glam::{DVec2, DVec3};

/// Coordinates on the unit disc of a unit direction with z ≥ 0.
pub fn nusselt_encode(d: DVec3) -> DVec2 {
    DVec2::new(d.x, d.y)
}

/// The unit direction; outside of the disc it lies on the horizon.
pub fn nusselt_decode(uv: DVec2) -> DVec3 {
    let squared = uv.length_squared();
    uv.extend((1.0 - squared).max(0.0).sqrt()) / squared.max(1.0).sqrt()
}

/// Solid angle over area of the disc, sr: 1/z.
pub fn nusselt_density(uv: DVec2) -> f64 {
    1.0 / (1.0 - uv.length_squared()).max(0.0).sqrt()
}

/// Derivatives of the direction by the two coordinates.
pub(super) fn derivatives(uv: DVec2) -> [DVec3; 2] {
    let z = (1.0 - uv.length_squared()).max(0.0).sqrt();
    [DVec2::X, DVec2::Y].map(|axis| axis.extend(-uv.dot(axis) / z))
}

/// Solid angle of the part of a rectangle within the disc, exact.
pub(super) fn solid_angle(lower: DVec2, upper: DVec2) -> f64 {
    disc::integrate(disc::over_cosine, lower, upper)
}
