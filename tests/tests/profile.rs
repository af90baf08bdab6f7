//! Only what a scene needs: passes, bytes and compiled branches follow from its profile, and what is compiled in without need changes
//! no bit of a picture.

use std::collections::BTreeMap;

use clerestory::gpu::{Category, Gpu, PipelineInfo};
use clerestory::scene::{Environment, Filter, Image, LightKind, Material, Mesh, Scene, Texture, Wrap};
use clerestory::transport::{PathTracer, PathTracerSettings};
use clerestory_tests::render::{builtin, camera_down, finish, floor, independent, point_triangle, render, tracer};
use clerestory_tests::with_gpu;
use glam::{Vec2, Vec3, Vec4};

/// A Lambert floor under nothing at all.
fn bare() -> Scene {
    let mut scene = Scene::default();
    let material = scene.add_material(Material::lambert("floor", Vec3::splat(0.5)));
    scene.place(floor("floor", material, 4.0, 0.0));
    scene.cameras.push(camera_down(1.0, 10.0));
    scene
}

fn image() -> Image {
    Image {
        name: "grey".into(),
        width: 2,
        height: 2,
        texels: vec![[128, 128, 255, 255]; 4],
    }
}

fn texture(image: u32) -> Texture {
    Texture {
        image,
        uv_set: 0,
        wrap: [Wrap::Repeat; 2],
        filter: Filter::Linear,
        transform: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]],
    }
}

/// Passes of one wave by name, rounds of bounces counted once.
fn passes(tracer: &mut PathTracer) -> BTreeMap<String, usize> {
    let mut counts = BTreeMap::new();
    while let Some(step) = tracer.step(2).unwrap() {
        for pass in step.timings.iter().flat_map(|t| &t.passes) {
            *counts.entry(pass.name.to_string()).or_insert(0) += 1;
        }
    }
    counts
}

/// The features compiled into the shading kernel.
fn features(pipelines: &[PipelineInfo]) -> Vec<&'static str> {
    let shade = pipelines.iter().find(|p| p.shader.ends_with("path_shade.comp"));
    let constants = shade.map_or(&[][..], |p| &p.specialization[..]);
    constants
        .iter()
        .filter(|(name, bits)| name.starts_with("has_") && *bits != 0)
        .map(|(name, _)| *name)
        .collect()
}

/// Bytes of a scene by category, in the order geometry, index, material, light.
fn bytes(gpu: &Gpu, scene: &Scene) -> [u64; 4] {
    let categories = [Category::Geometry, Category::Index, Category::Material, Category::Light];
    let before = gpu.memory_report();
    let uploaded = clerestory_tests::render::upload(gpu, scene);
    let after = gpu.memory_report();
    drop(uploaded);
    categories.map(|c| after.of(c) - before.of(c))
}

#[test]
fn features_are_those_of_the_scene() {
    with_gpu(|gpu| {
        let mut metal = bare();
        metal.materials[0] = Material::mirror("mirror", Vec3::splat(0.9));
        let mut glass = bare();
        glass.materials[0] = Material::glass("glass", 1.5);
        let mut glossy = bare();
        glossy.materials[0].specular = 1.0;
        let mut lamp = bare();
        lamp.materials[0].emission = Vec3::ONE;
        let mut sun = bare();
        sun.add_light(
            "sun",
            LightKind::Directional {
                direction: Vec3::NEG_Y,
                irradiance: Vec3::ONE,
            },
        );
        let mut sky = bare();
        sky.environment = Some(Environment::uniform(Vec3::ONE));
        let mut textured = bare();
        textured.add_image(image());
        textured.materials[0].base_color_texture = Some(texture(0));
        textured.meshes[0].uv0 = vec![Vec2::ZERO; 4];
        let mut colored = bare();
        colored.meshes[0].colors = vec![Vec4::ONE; 4];
        let mut smooth = bare();
        smooth.meshes[0].normals = vec![Vec3::Y; 4];
        let mut unlit = bare();
        unlit.materials[0].unlit = true;
        for (what, scene, expected) in [
            ("bare", bare(), &[][..]),
            ("metal", metal, &["has_metal", "has_multiple_scattering"]),
            ("glass", glass, &["has_specular_layer", "has_transmission"]),
            ("glossy", glossy, &["has_specular_layer"]),
            ("lamp", lamp, &["has_area_lights"]),
            ("sun", sun, &["has_punctual_lights"]),
            ("sky", sky, &["has_environment"]),
            ("textured", textured, &["has_textures"]),
            ("colored", colored, &["has_vertex_colors"]),
            ("smooth", smooth, &["has_shading_normals"]),
            ("unlit", unlit, &["has_unlit"]),
        ] {
            let tracer = tracer(gpu, &scene, [8, 8], &PathTracerSettings::default());
            assert_eq!(features(&tracer.pipelines()), expected, "{what}");
        }
    });
}

#[test]
fn what_is_absent_costs_no_pass() {
    with_gpu(|gpu| {
        let settings = PathTracerSettings::default();
        let mut lit = bare();
        lit.add_light(
            "sun",
            LightKind::Directional {
                direction: Vec3::NEG_Y,
                irradiance: Vec3::ONE,
            },
        );
        let dark = passes(&mut tracer(gpu, &bare(), [8, 8], &settings));
        let light = passes(&mut tracer(gpu, &lit, [8, 8], &settings));
        assert!(!dark.contains_key("path: shadow"), "{dark:?}");
        assert_eq!(light["path: shadow"], light["path: extend"], "{light:?}");
        let without: BTreeMap<_, _> = light.into_iter().filter(|(name, _)| name != "path: shadow").collect();
        assert_eq!(dark, without, "nothing else differs");
    });
}

#[test]
fn what_is_absent_costs_no_byte() {
    with_gpu(|gpu| {
        let bare_bytes = bytes(gpu, &bare());
        // 2 triangles of 48 bytes; a lone black surface has no light.
        assert_eq!((bare_bytes[0], bare_bytes[3]), (2 * 48, 0), "{bare_bytes:?}");
        // Attributes are 16 bytes a vertex, and with any of them each triangle has 16 bytes that say which vertices are its own.
        let attribute = 4 * 16 + 2 * 16;
        let more = |change: &dyn Fn(&mut Scene)| {
            let mut scene = bare();
            change(&mut scene);
            let bytes = bytes(gpu, &scene);
            [0, 1, 2, 3].map(|i| bytes[i] as i64 - bare_bytes[i] as i64)
        };
        assert_eq!(
            more(&|s| s.meshes[0].colors = vec![Vec4::ONE; 4]),
            [attribute, 0, 0, 0],
            "vertex colours"
        );
        assert_eq!(
            more(&|s| s.meshes[0].normals = vec![Vec3::Y; 4]),
            [attribute, 0, 0, 0],
            "normals"
        );
        // Texture coordinates without a texture are not kept; with one they are, and an image is uploaded once.
        assert_eq!(
            more(&|s| s.meshes[0].uv0 = vec![Vec2::ZERO; 4]),
            [0; 4],
            "unused texture coordinates"
        );
        let textured = more(&|s| {
            s.add_image(image());
            s.materials[0].base_color_texture = Some(texture(0));
            s.materials[0].emission_texture = Some(texture(0));
        });
        assert_eq!(
            (textured[0], textured[1], textured[3]),
            (attribute, 0, 0),
            "{textured:?}"
        );
        assert_eq!(more(&|s| s.images.push(image())), [0; 4], "an image that nothing uses");
        let sun = |s: &mut Scene| {
            s.add_light(
                "sun",
                LightKind::Directional {
                    direction: Vec3::NEG_Y,
                    irradiance: Vec3::ONE,
                },
            )
        };
        let lights = more(&sun);
        assert_eq!(lights[..3], [0; 3]);
        assert!(lights[3] > 0, "{lights:?}");
        let table = more(&|s| s.materials[0].specular = 1.0);
        assert!(
            table[2] > 10_000 && table[0] == 0 && table[3] == 0,
            "the albedo table of glossy materials: {table:?}"
        );

        // AOVs cost film and working memory only when they are asked for.
        let of = |aovs| {
            let before = gpu.memory_report();
            let kept = tracer(
                gpu,
                &bare(),
                [8, 8],
                &PathTracerSettings {
                    aovs,
                    paths_in_flight: 64,
                    ..PathTracerSettings::default()
                },
            );
            let after = gpu.memory_report();
            drop(kept);
            [Category::Film, Category::Work].map(|c| after.of(c) - before.of(c))
        };
        let (without, with) = (of(false), of(true));
        assert_eq!(with[0] - without[0], 64 * 60 - 16, "film: 7 pairs of f32 and a count");
        assert!(with[1] > without[1]);
        assert_eq!(gpu.memory_report().of(Category::Film), 0, "everything is given back");
    });
}

/// Adds every feature of materials and meshes where no ray can meet it: the kernel is compiled for all of them.
fn with_everything(mut scene: Scene) -> Scene {
    let place = scene.meshes[0].positions[0];
    let image = scene.add_image(image());
    let everything = Material {
        name: "everything".into(),
        base_color_texture: Some(texture(image)),
        normal_texture: Some(texture(image)),
        metallic: 0.5,
        roughness: 0.5,
        transmission: 0.5,
        thickness: 0.1,
        attenuation_color: Vec3::splat(0.5),
        attenuation_distance: 1.0,
        emission: Vec3::ONE,
        conductor: Some(clerestory::scene::ConductorIor {
            eta: Vec3::splat(0.2),
            k: Vec3::splat(3.0),
        }),
        ..Material::default()
    };
    point_triangle(&mut scene, everything, place);
    point_triangle(
        &mut scene,
        Material {
            unlit: true,
            ..Material::default()
        },
        place,
    );
    let material = Some(scene.materials.len() as u32 - 1);
    scene.place(Mesh {
        name: "attributes".into(),
        positions: vec![place; 3],
        normals: vec![Vec3::Y; 3],
        tangents: vec![Vec4::X; 3],
        uv0: vec![Vec2::ZERO; 3],
        colors: vec![Vec4::ONE; 3],
        triangles: vec![[0, 1, 2]],
        material,
        ..Mesh::default()
    });
    scene
}

#[test]
fn features_that_are_compiled_in_without_need_change_no_bit() {
    with_gpu(|gpu| {
        for address in ["builtin:cornell-box", "builtin:white-furnace?frequency=4&roughness=0.4"] {
            let scene = builtin(address);
            let settings = independent();
            let lean = render(gpu, &scene, [16, 16], 16, &settings);
            let mut full_tracer = tracer(gpu, &with_everything(scene), [16, 16], &settings);
            let compiled = features(&full_tracer.pipelines());
            for feature in [
                "has_metal",
                "has_conductor",
                "has_specular_layer",
                "has_transmission",
                "has_multiple_scattering",
                "has_textures",
                "has_shading_normals",
                "has_normal_maps",
                "has_vertex_colors",
                "has_absorption",
                "has_unlit",
            ] {
                assert!(compiled.contains(&feature), "{feature}: {compiled:?}");
            }
            let full = finish(&mut full_tracer, 16);
            let different = full
                .radiance
                .iter()
                .zip(&lean.radiance)
                .filter(|(a, b)| a.to_bits() != b.to_bits())
                .count();
            assert_eq!(
                different,
                0,
                "{address}: {different} of {} values differ",
                lean.radiance.len()
            );
        }
    });
}
