//! Frames about normals, and normal maps in them.
//!
//! Sources: basis of Duff et al., "Building an Orthonormal Basis, Revisited" (JCGT 6(1), 2017); normal maps of glTF 2.0 §3.9.3. Twin of
//! `scene/normal_map.glsl`.

use crate::gpu::shaders::constants;
use glam::{DVec3, DVec4};

/// Tangents whose part normal to n is shorter than this are replaced.
const TANGENT_LENGTH_MIN: f64 = constants::TANGENT_LENGTH_MIN as f64;

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

/// World-space normal of a tangent-space normal map: `texel` in [0, 1], `tangent.w` the sign of the bitangent.
pub fn mapped_normal(n: DVec3, tangent: DVec4, texel: DVec3, scale: f64) -> DVec3 {
    let m = (2.0 * texel - 1.0) * DVec3::new(scale, scale, 1.0);
    let t = tangent.truncate() - n * n.dot(tangent.truncate());
    let (t, b) = if t.length_squared() < TANGENT_LENGTH_MIN * TANGENT_LENGTH_MIN {
        orthonormal_basis(n)
    } else {
        let t = t.normalize();
        (t, n.cross(t) * if tangent.w < 0.0 { -1.0 } else { 1.0 })
    };
    (t * m.x + b * m.y + n * m.z).try_normalize().unwrap_or(n)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn flat_maps_keep_the_normal() {
        let n = DVec3::new(0.6, 0.0, 0.8);
        let flat = DVec3::new(0.5, 0.5, 1.0);
        for tangent in [
            DVec4::new(0.8, 0.0, -0.6, 1.0),
            DVec4::new(0.6, 0.0, 0.8, -1.0),
            DVec4::ZERO,
        ] {
            assert!((mapped_normal(n, tangent, flat, 1.0) - n).length() < 1e-15);
        }
        let tilted = mapped_normal(
            DVec3::Z,
            DVec4::new(1.0, 0.0, 0.0, -1.0),
            DVec3::new(0.5, 1.0, 1.0),
            1.0,
        );
        assert!(
            (tilted - DVec3::new(0.0, -1.0, 1.0).normalize()).length() < 1e-15,
            "w = -1 turns the bitangent"
        );
        assert_eq!(mapped_normal(n, DVec4::ZERO, DVec3::splat(0.5), 1.0), n, "a null texel");
    }
}
