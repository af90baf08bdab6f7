//! Shading normals that never gain energy.
//!
//! Method: the shading normal is turned to the side of the geometric normal and, where it faces away from the viewer, bent towards
//! him until it is just visible; scattered directions that lie on different sides of the two normals are rejected (Veach 1997,
//! §5.3, describes the trouble). Guarantee: reflectances are those of the scattering function or less, since f |cos to the shading
//! normal| is integrated over a part of its domain. Reciprocity is lost, as with every shading normal. Twin of
//! `transport/shading_normal.glsl`.

use crate::catalogue::{Role, Row, sources};
use crate::gpu::shaders::constants;
use glam::DVec3;

/// Least cosine between the adapted normal and ωo: far above rounding errors, far below what the eye sees of a bent normal.
pub const VISIBLE_COS_MIN: f64 = constants::VISIBLE_COS_MIN as f64;

/// The shading normal to use, on the side of `wo`; `ng` must already face `wo`.
///
/// For the inside of a solid the caller turns the result back, since a scattering frame's z points out of the body.
pub fn adapt_shading_normal(ns: DVec3, ng: DVec3, wo: DVec3) -> DVec3 {
    let ns = if ns.dot(ng) < 0.0 { -ns } else { ns };
    let c = ns.dot(wo);
    if c < VISIBLE_COS_MIN {
        (ns + (VISIBLE_COS_MIN - c) * wo).normalize()
    } else {
        ns
    }
}

/// Whether a direction lies on the same side of both normals; what does not is rejected by sampling and evaluation alike.
pub fn sides_agree(ns: DVec3, ng: DVec3, wi: DVec3) -> bool {
    ns.dot(wi) * ng.dot(wi) > 0.0
}

/// Rows of the catalogue.
pub(crate) const ROWS: &[Row] = &[Row {
    id: "CL-NORMALS",
    name: "shading normals and normal maps that never gain energy",
    role: Role::PartOf("BG-3"),
    limits: "Loses light where the two normals disagree, and reciprocity with every shading normal.",
    sources: &[sources::VEACH_1997.at("5.3 for the problem; the bend towards the viewer is the engine's own")],
    shaders: &["shaders/transport/shading_normal.glsl"],
    tests: &[
        "engine/src/transport/shading_normal.rs::adapted_normals_face_the_viewer_and_lose_energy_only",
        "engine/src/scene/normal_map.rs::flat_maps_keep_the_normal",
    ],
    api: &["clerestory::transport::shading_normal"],
    ..Row::of(file!())
}];

#[cfg(test)]
mod tests {
    use super::super::albedo::AlbedoTable;
    use super::super::bsdf::{BsdfContext, BsdfFeatures, GltfFactors, LOBE_ALL, bsdf_gltf, bsdf_sample};
    use super::super::testing::random3;
    use super::super::warp::square_to_sphere;
    use super::*;
    use crate::scene::normal_map::orthonormal_basis;

    #[test]
    fn adapted_normals_face_the_viewer_and_lose_energy_only() {
        let context = BsdfContext {
            features: BsdfFeatures::ALL,
            table: AlbedoTable::shared(),
        };
        let white = bsdf_gltf(&GltfFactors {
            base_color: DVec3::ONE,
            metallic: 0.5,
            roughness: 0.6,
            transmission: 0.0,
            ior: 1.5,
            specular: 1.0,
            specular_color: DVec3::ONE,
            thickness: 0.0,
        });
        for i in 0..200 {
            let ns = square_to_sphere(random3(i, 1).truncate());
            let wo = square_to_sphere(random3(i, 2).truncate());
            let ng = square_to_sphere(random3(i, 3).truncate());
            let ng = if ng.dot(wo) < 0.0 { -ng } else { ng };
            let n = adapt_shading_normal(ns, ng, wo);
            assert!((n.length() - 1.0).abs() < 1e-12 && n.dot(wo) >= 0.99 * VISIBLE_COS_MIN && n.dot(ng) >= 0.0);
            let (t, b) = orthonormal_basis(n);
            let local = DVec3::new(wo.dot(t), wo.dot(b), wo.dot(n));
            let samples = 256;
            let mut sum = 0.0;
            for k in 0..samples {
                let s = bsdf_sample(&context, &white, local, random3(k, 4 + i), LOBE_ALL);
                if s.flags != 0 && sides_agree(n, ng, t * s.wi.x + b * s.wi.y + n * s.wi.z) {
                    sum += s.weight.x;
                }
            }
            // Weights of this material lie in [0, 2]: Hoeffding's bound at 1e-9 each, 2e-7 for all.
            assert!(sum / f64::from(samples) <= 1.005 + 2.0 * (20.7 / (2.0 * f64::from(samples))).sqrt());
        }
    }
}
