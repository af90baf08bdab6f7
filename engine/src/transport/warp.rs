//! Warps from the unit square to the domains that a renderer samples, with their densities, and orthonormal bases.
//!
//! Sources: concentric disk of Shirley and Chiu (1997); triangle of Heitz, "A Low-Distortion Map Between Triangle and Square"
//! (2019); basis of Duff et al., "Building an Orthonormal Basis, Revisited" (JCGT 6(1), 2017). Guarantees: densities integrate to
//! one over their domain (solid angle for directions); directions have unit length. Twin of `transport/warp.glsl`.

use glam::{DVec2, DVec3};
use std::f64::consts::{FRAC_1_PI, FRAC_PI_4, TAU};

/// Density of [`square_to_sphere`], sr⁻¹.
pub const UNIFORM_SPHERE_PDF: f64 = 0.25 * FRAC_1_PI;
/// Density of [`square_to_hemisphere`], sr⁻¹.
pub const UNIFORM_HEMISPHERE_PDF: f64 = 0.5 * FRAC_1_PI;

/// Point of the unit disk; density 1/π.
pub fn square_to_disk(u: DVec2) -> DVec2 {
    let p = 2.0 * u - 1.0;
    let wide = p.x.abs() > p.y.abs();
    let (r, other) = if wide { (p.x, p.y) } else { (p.y, p.x) };
    let ratio = if r == 0.0 { 0.0 } else { other / r };
    let (sin, cos) = (ratio * FRAC_PI_4).sin_cos();
    r * if wide {
        DVec2::new(cos, sin)
    } else {
        DVec2::new(sin, cos)
    }
}

/// Direction about +z with density cos θ/π.
pub fn square_to_cosine_hemisphere(u: DVec2) -> DVec3 {
    let p = square_to_disk(u);
    p.extend((1.0 - p.length_squared()).max(0.0).sqrt())
}

/// Density of [`square_to_cosine_hemisphere`], sr⁻¹.
pub fn cosine_hemisphere_pdf(cos_theta: f64) -> f64 {
    cos_theta.max(0.0) * FRAC_1_PI
}

/// Direction at height 1 − d and azimuth 2πu.
pub fn direction_below_pole(d: f64, u: f64) -> DVec3 {
    let r = (d * (2.0 - d)).max(0.0).sqrt();
    let (sin, cos) = (TAU * u).sin_cos();
    DVec3::new(r * cos, r * sin, 1.0 - d)
}

/// Uniform direction; density [`UNIFORM_SPHERE_PDF`].
pub fn square_to_sphere(u: DVec2) -> DVec3 {
    direction_below_pole(2.0 * u.x, u.y)
}

/// Uniform direction with z ≥ 0; density [`UNIFORM_HEMISPHERE_PDF`].
pub fn square_to_hemisphere(u: DVec2) -> DVec3 {
    direction_below_pole(u.x, u.y)
}

/// Uniform direction in the cone about +z; `one_minus_cos` = 1 − cos(half angle), which stays exact for thin cones.
pub fn square_to_cone(u: DVec2, one_minus_cos: f64) -> DVec3 {
    direction_below_pole(one_minus_cos * u.x, u.y)
}

/// Density of [`square_to_cone`], sr⁻¹.
pub fn cone_pdf(one_minus_cos: f64) -> f64 {
    1.0 / (TAU * one_minus_cos)
}

/// Barycentric weights (of vertices 0, 1, 2) of a uniform point of a triangle; density 1/area.
pub fn square_to_triangle(u: DVec2) -> DVec3 {
    let low = 0.5 * u.x.min(u.y);
    let (b1, b2) = if u.x < u.y { (low, u.y - low) } else { (u.x - low, low) };
    DVec3::new(1.0 - b1 - b2, b1, b2)
}

/// Tangent and bitangent of a right-handed frame about the unit vector `n`.
pub fn orthonormal_basis(n: DVec3) -> (DVec3, DVec3) {
    let s = if n.z < 0.0 { -1.0 } else { 1.0 };
    let a = -1.0 / (s + n.z);
    let c = n.x * n.y * a;
    (
        DVec3::new(1.0 + s * n.x * n.x * a, s * c, -s * n.x),
        DVec3::new(c, s + n.y * n.y * a, -n.y),
    )
}
