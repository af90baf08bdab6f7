//! What a virtual light would bring to a point if nothing stood between: its potential contribution.
//!
//! Source: the chapter on virtual light sources of a doctoral thesis on metals and reflections on graphics hardware, §6.2 and §6.3 (`MET-V1`, `MET-V3`), with the
//! power and the bound that its listing lacks. Its pseudocode calls the light x and the point y; here as in its equation 6.1 the light is y.

use glam::DVec3;
use std::f64::consts::FRAC_1_PI;

use crate::transport::edge_bound::{EdgeBound, bounded_share, geometry_term};

/// A point that sends light by Lambert's law: of a light source, or of a surface where a walk from one was scattered.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SurfaceLight {
    /// Place, m.
    pub position: DVec3,
    /// Unit normal, to the side that it shines to.
    pub normal: DVec3,
    /// Power that leaves it, W; that which arrives times the reflectance.
    pub power: DVec3,
    /// Scatterings before the light leaves it: 0 of a light source.
    pub bounce: u32,
}

/// A point that lights shine on, of a surface that scatters by Lambert's law.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LitPoint {
    /// Place, m.
    pub position: DVec3,
    /// Unit normal, to the side that it is seen from.
    pub normal: DVec3,
    /// Share of the light that is scattered, by channel.
    pub reflectance: DVec3,
}

/// Radiance that a point scatters of a light's, W·m⁻²·sr⁻¹, if nothing stands between: zero where either is behind the other or both are in one place.
pub fn potential_contribution(light: &SurfaceLight, point: &LitPoint, bound: EdgeBound) -> DVec3 {
    let way = light.position - point.position;
    let squared = way.length_squared();
    let wi = way / squared.sqrt();
    let (cos_here, cos_there) = (point.normal.dot(wi), -light.normal.dot(wi));
    // Also of NaN, where both are in one place.
    if !(cos_here > 0.0 && cos_there > 0.0) {
        return DVec3::ZERO;
    }
    let g = geometry_term(cos_here, cos_there, squared) * bounded_share(bound, cos_here, cos_there, squared);
    point.reflectance * light.power * (g * FRAC_1_PI * FRAC_1_PI)
}
