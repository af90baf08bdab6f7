//! Pictures against the path tracer's of the same light paths.

use super::*;
use clerestory::scene::AlphaMode;

const PASSES: u32 = 64;
/// Eye paths of a pixel and pass.
const EACH: u32 = 4;

fn several() -> VirtualLightSettings {
    VirtualLightSettings {
        samples_per_pass: EACH,
        ..settings()
    }
}

/// No virtual light is nearer than another in a sphere: spikes there are none.
#[test]
fn unbounded_lights_agree_with_the_path_tracer_in_a_sphere() {
    with_gpu(|gpu| {
        let mut scene = builtin("builtin:sphere-light?rho=0.5&frequency=12");
        scene.lights.clear();
        add_point(&mut scene, Vec3::new(0.1, 0.2, -0.1), Vec3::ONE);
        let settings = VirtualLightSettings {
            bound: Bound::None,
            ..several()
        };
        let found = passes(gpu, &scene, &settings, PASSES);
        found.expect_same_as("unbounded in a sphere", &traced(gpu, &scene, 1024), 0.0);
        let counts = found.counts;
        assert_eq!(counts.passes, u64::from(PASSES));
        assert_eq!(counts.walks.emitted, u64::from(8 * PASSES));
        assert_eq!(counts.walks.escaped, 0);
        // Each pixel and pass has had each of its lights once, and none of them is behind another surface.
        assert_eq!(counts.gather.gathers, u64::from(SIDE * SIDE * PASSES * EACH));
        assert_eq!(counts.gather.connections, u64::from(SIDE * SIDE * EACH) * counts.lights);
    });
}

/// A bound of a kind, and walks of a pass.
type Walked = (Bound, f32, u32);

/// Fails unless a scene with each of these bounds has the path tracer's light.
fn expect_agreement(scene: &Scene, bounds: &[Walked]) {
    with_gpu(|gpu| {
        let reference = traced(gpu, scene, 2048);
        for &(bound, bound_value, walks) in bounds {
            let settings = VirtualLightSettings {
                walks,
                bound,
                bound_value,
                ..several()
            };
            let found = passes(gpu, scene, &settings, 48);
            let what = format!("{}, {bound:?} {bound_value}", scene.name);
            found.expect_same_as(&what, &reference, 0.0);
        }
    });
}

/// Three decades about the bounds that would be chosen, and of looser ones more walks, each of whose lights is less of a spike.
#[test]
fn compensated_bounds_agree_with_the_path_tracer() {
    let bounds = [
        (Bound::Geometry, 0.03, 4),
        (Bound::Geometry, 1.0, 4),
        (Bound::Geometry, 30.0, 16),
    ];
    expect_agreement(&room(), &bounds);
}

/// Where edges of all lengths and angles meet.
#[test]
fn compensated_distances_agree_with_the_path_tracer_in_a_room() {
    expect_agreement(&room(), &[(Bound::Distance, 1.0, 4), (Bound::Distance, 0.03, 16)]);
}

#[test]
fn compensated_distances_agree_with_the_path_tracer_in_a_sphere() {
    let mut sphere = builtin("builtin:sphere-light?rho=0.5&frequency=12");
    sphere.lights.clear();
    add_point(&mut sphere, Vec3::new(0.3, -0.2, 0.1), Vec3::ONE);
    let bounds = [
        (Bound::Distance, 4.0, 4),
        (Bound::Distance, 0.1, 4),
        (Bound::Distance, 0.004, 4),
    ];
    expect_agreement(&sphere, &bounds);
}

/// A rough conductor with interpolated normals, mirrors, coats, and panes that are there in part or let light through.
#[test]
fn materials_of_all_kinds_agree_with_the_path_tracer() {
    with_gpu(|gpu| {
        let mut metal = builtin("builtin:cornell-box?sphere=gold");
        metal.name = "rough gold".into();
        for material in &mut metal.materials {
            if material.conductor.is_some() {
                material.roughness = 0.5;
            }
        }
        let mut panes = room();
        panes.name = "panes".into();
        let coated = panes.add_material(Material {
            specular: 1.0,
            roughness: 0.5,
            ..Material::lambert("coated", Vec3::new(0.2, 0.3, 0.6))
        });
        let blended = panes.add_material(Material {
            base_color: Vec3::new(0.8, 0.7, 0.2).extend(0.5),
            alpha_mode: AlphaMode::Blend,
            ..Material::lambert("blended", Vec3::ONE)
        });
        let frosted = panes.add_material(Material {
            transmission: 0.8,
            roughness: 0.6,
            specular: 1.0,
            ..Material::lambert("frosted", Vec3::splat(0.9))
        });
        let mirror = panes.add_material(Material {
            metallic: 1.0,
            roughness: 0.0,
            ..Material::lambert("mirror", Vec3::splat(0.9))
        });
        for (name, material, x) in [
            ("coated", coated, -0.9),
            ("blended", blended, -0.4),
            ("frosted", frosted, 0.1),
            ("mirror", mirror, 0.6),
        ] {
            let lower = Vec3::new(x, -0.9, 0.2);
            panes.place(cuboid(name, material, lower, lower + Vec3::new(0.3, 1.2, 0.05)));
        }
        for scene in [metal, panes] {
            let reference = traced(gpu, &scene, 2048);
            let settings = VirtualLightSettings {
                bound: Bound::Geometry,
                ..several()
            };
            passes(gpu, &scene, &settings, 48).expect_same_as(&scene.name, &reference, 0.0);
        }
    });
}

/// Walks are absorbed on all ways through a body, also on the first one from a light that is inside.
#[test]
fn bodies_that_absorb_agree_with_the_path_tracer() {
    with_gpu(|gpu| {
        let mut scene = room();
        scene.name = "tinted body".into();
        scene.lights.clear();
        add_lit_body(&mut scene, 2.0);
        let found = passes(gpu, &scene, &several(), 48);
        found.expect_same_as(&scene.name, &traced(gpu, &scene, 2048), 0.0);
    });
}
