//! Shading normals under which no more light is seen than arrives.
//!
//! Method: the shading normal is turned to the side of the geometric normal and, where it faces away from the viewer, bent towards
//! him until it is just visible; scattered directions that lie on different sides of the two normals are rejected (Veach 1997,
//! §5.3, describes the trouble). Guarantee: reflectances seen from any direction are those of the scattering function or less, since
//! f |cos to the shading normal| is integrated over a part of its domain. Reciprocity is lost, as with every shading normal, and with it
//! the same for beams: one that comes in flat to the surface, but not to the shading normal, scatters more energy than it brings, about as
//! the one cosine is to the other. Twin of `transport/shading_normal.glsl`.

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
    name: "shading normals and normal maps under which no more light is seen than arrives",
    role: Role::PartOf("BG-3"),
    limits: "Loses light where the two normals disagree, and reciprocity with every shading normal; what is seen never gains energy, but a beam may scatter more than it brings, 1.9 times as much 60 degrees off a white surface whose normal is tilted by 45, and without bound towards grazing.",
    sources: &[sources::VEACH_1997.at("5.3 for the problem; the bend towards the viewer is the engine's own")],
    shaders: &["shaders/transport/shading_normal.glsl"],
    tests: &[
        "engine/src/transport/shading_normal.rs::adapted_normals_face_the_viewer_and_show_no_more_light_than_arrives",
        "engine/src/transport/shading_normal.rs::beams_scatter_more_energy_than_they_bring",
        "engine/src/transport/shading_normal.rs::directions_between_the_two_surfaces_are_rejected",
        "engine/src/scene/normal_map.rs::flat_maps_keep_the_normal",
        "tests/tests/twins/reflection.rs::shading_normals_agree_with_their_twins",
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
    use std::f64::consts::{PI, TAU};

    #[test]
    fn adapted_normals_face_the_viewer_and_show_no_more_light_than_arrives() {
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
        let (mut brightest, mut sharpest) = (0.0f64, f64::INFINITY);
        for i in 0..100 {
            let ns = square_to_sphere(random3(i, 1).truncate());
            let wo = square_to_sphere(random3(i, 2).truncate());
            let ng = square_to_sphere(random3(i, 3).truncate());
            let ng = if ng.dot(wo) < 0.0 { -ng } else { ng };
            let n = adapt_shading_normal(ns, ng, wo);
            assert!((n.length() - 1.0).abs() < 1e-12 && n.dot(wo) >= 0.99 * VISIBLE_COS_MIN && n.dot(ng) >= 0.0);
            let (t, b) = orthonormal_basis(n);
            let local = DVec3::new(wo.dot(t), wo.dot(b), wo.dot(n));
            let samples = 8192;
            let (mut sum, mut squares) = (0.0, 0.0);
            for k in 0..samples {
                let s = bsdf_sample(&context, &white, local, random3(k, 4 + i), LOBE_ALL);
                if s.flags != 0 && sides_agree(n, ng, t * s.wi.x + b * s.wi.y + n * s.wi.z) {
                    sum += s.weight.x;
                    squares += s.weight.x * s.weight.x;
                }
            }
            let count = f64::from(samples);
            let mean: f64 = sum / count;
            let error = ((squares / count - mean * mean).max(0.0) / count).sqrt();
            // What the table of albedos errs by in lobes as wide, and five standard deviations: 3e-5 for all.
            assert!(
                mean <= 1.0012 + 5.0 * error,
                "{mean} ± {error}, normal {ns}, seen along {wo}"
            );
            if mean > brightest {
                (brightest, sharpest) = (mean, 5.0 * error);
            }
        }
        println!("brightest {brightest}, within {sharpest}");
        // Where nothing is lost, a gain of a few per cent would be seen.
        assert!(brightest > 0.95 && sharpest < 0.04);
    }

    #[test]
    fn directions_between_the_two_surfaces_are_rejected() {
        let (ns, ng) = (DVec3::new(0.6, 0.0, 0.8), DVec3::Z);
        // Above both, above the one or the other, below both.
        for (wi, agree) in [
            (DVec3::new(0.0, 0.6, 0.8), true),
            (DVec3::new(0.8, 0.0, -0.28).normalize(), false),
            (DVec3::new(-0.96, 0.0, 0.28), false),
            (DVec3::new(0.0, 0.6, -0.8), true),
        ] {
            assert_eq!(sides_agree(ns, ng, wi), agree, "{wi}");
        }
    }

    /// The known defect of shading normals: what holds for what is seen does not hold for a beam.
    #[test]
    fn beams_scatter_more_energy_than_they_bring() {
        // The share of a beam that a white diffuse surface scatters up, and what is seen of even light, by a midpoint rule over directions.
        let tilt = 45f64.to_radians();
        let (ns, ng) = (DVec3::new(tilt.sin(), 0.0, tilt.cos()), DVec3::Z);
        let steps = 200;
        let upper = || {
            (0..steps * steps).map(move |k| {
                let z = (f64::from(k / steps) + 0.5) / f64::from(steps);
                let (sin, cos) = (TAU * (f64::from(k % steps) + 0.5) / f64::from(steps)).sin_cos();
                let r = (1.0 - z * z).sqrt();
                DVec3::new(r * cos, r * sin, z)
            })
        };
        let scattered = |wo: DVec3, wi: DVec3| {
            let n = adapt_shading_normal(ns, ng, wo);
            if sides_agree(n, ng, wi) { n.dot(wi) / PI } else { 0.0 }
        };
        let solid_angle = TAU / f64::from(steps * steps);
        for (degrees, expected) in [(0.0f64, 0.72), (45.0, 1.41), (60.0, 1.91), (85.0, 8.53)] {
            let (sin, cos) = degrees.to_radians().sin_cos();
            let along = DVec3::new(sin, 0.0, cos);
            let beam: f64 = upper().map(|wo| scattered(wo, along) * wo.z / cos).sum::<f64>() * solid_angle;
            let seen: f64 = upper().map(|wi| scattered(along, wi)).sum::<f64>() * solid_angle;
            println!("{degrees} degrees: {beam:.3} of a beam, {seen:.3} seen");
            assert!((beam / expected - 1.0).abs() < 0.01, "{degrees} degrees: {beam}");
            assert!(seen <= 1.001, "{degrees} degrees: {seen}");
        }
    }
}
