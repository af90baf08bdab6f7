//! Only what a scene needs: passes, bytes and compiled branches follow from its profile, and what is compiled in without need changes
//! no bit of a picture.

use std::collections::BTreeMap;

use clerestory::gpu::{Category, Gpu, PipelineInfo};
use clerestory::scene::{
    AlphaMode, Camera, Environment, Filter, FresnelForm, Image, LightKind, Material, Mesh, Microfacets, Scene, Texture,
    Wrap, metals,
};
use clerestory::techniques::{PathTracer, PathTracerSettings};
use clerestory::transport::environment::EnvironmentTables;
use clerestory_tests::render::{
    Rendered, builtin, camera_down, cuboid, finish, floor, independent, point_triangle, render, tracer,
};
use clerestory_tests::with_gpu;
use glam::{DVec3, Vec2, Vec3, Vec4};

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

type Change<'a> = &'a dyn Fn(&mut Scene);

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
        let mut phong = bare();
        phong.materials[0] = Material::phong("phong", Vec3::splat(0.5), 0.5, 20.0);
        let metal_of = |fresnel| {
            let mut scene = bare();
            scene.materials[0] = Material {
                conductor: metals::by_name("gold"),
                fresnel,
                ..Material::mirror("metal", Vec3::ONE)
            };
            scene
        };
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
            ("phong", phong, &["has_metal", "has_phong"]),
            (
                "exact",
                metal_of(FresnelForm::Exact),
                &["has_metal", "has_exact_conductor", "has_multiple_scattering"],
            ),
            (
                "rescaled",
                metal_of(FresnelForm::Rescaled),
                &["has_metal", "has_multiple_scattering", "has_schlick_conductor"],
            ),
            (
                "compensated",
                metal_of(FresnelForm::Compensated),
                &["has_metal", "has_multiple_scattering", "has_compensated_conductor"],
            ),
            (
                "F82-tint",
                metal_of(FresnelForm::F82Tint),
                &["has_metal", "has_multiple_scattering", "has_tinted_conductor"],
            ),
            (
                "simplified",
                metal_of(FresnelForm::Simplified),
                &["has_metal", "has_multiple_scattering", "has_simplified_conductor"],
            ),
            (
                "table",
                metal_of(FresnelForm::Table),
                &["has_metal", "has_multiple_scattering", "has_table_conductor"],
            ),
            (
                "classical",
                {
                    let mut scene = metal_of(FresnelForm::Exact);
                    scene.materials[0].classic_microfacets = Some(Microfacets::default());
                    scene
                },
                &["has_metal", "has_exact_conductor", "has_classic_microfacets"],
            ),
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
        // Attributes are 16 bytes per vertex, and with any of them each triangle has 16 bytes that say which vertices are its own.
        let attribute = 4 * 16 + 2 * 16;
        let more = |change: Change| {
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
        let lamp = |s: &mut Scene| s.materials[0].emission = Vec3::ONE;
        let sky = |s: &mut Scene| s.environment = Some(Environment::uniform(Vec3::ONE));
        let all: [(&str, Change); 3] = [("sun", &sun), ("lamp", &lamp), ("sky", &sky)];
        for (what, change) in all {
            let lights = more(change);
            assert_eq!(lights[..3], [0; 3], "{what}");
            assert!(lights[3] > 0, "{what}: {lights:?}");
        }
        assert_eq!(
            more(&|s| s.environment = Some(Environment::uniform(Vec3::ZERO))),
            [0; 4],
            "a black sky"
        );
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
    point_triangle(&mut scene, Material::phong("phong", Vec3::splat(0.5), 0.5, 20.0), place);
    let classic = Material {
        conductor: metals::by_name("copper"),
        classic_microfacets: Some(Microfacets::default()),
        ..Material::default()
    };
    point_triangle(&mut scene, classic, place);
    for fresnel in FresnelForm::ALL {
        let metal = Material {
            conductor: metals::by_name("copper"),
            fresnel,
            ..Material::default()
        };
        point_triangle(&mut scene, metal, place);
    }
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
                "has_exact_conductor",
                "has_schlick_conductor",
                "has_compensated_conductor",
                "has_tinted_conductor",
                "has_simplified_conductor",
                "has_table_conductor",
                "has_classic_microfacets",
                "has_phong",
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
            expect_same_bits(address, &lean, &full);
        }
    });
}

fn expect_same_bits(what: &str, lean: &Rendered, full: &Rendered) {
    assert!(lean.radiance.iter().any(|value| *value > 0.0), "{what}: black");
    let bits = lean.bits();
    let different = bits.iter().zip(full.bits()).filter(|(a, b)| **a != *b).count();
    assert_eq!(different, 0, "{what}: {different} of {} values differ", bits.len());
}

/// Half the side of the room, metres, and the place of the cupboard's centre in it.
const ROOM: f32 = 2.0;
const CUPBOARD: Vec3 = Vec3::new(-1.0, -1.0, -1.0);
/// Emission (radiance) and area of the lamp in the cupboard. Its power π·emission·area is that of every light that no path can reach.
const HIDDEN_EMISSION: f32 = 8.0;
const HIDDEN_AREA: f32 = 1.0 / 32.0;

/// A closed cube of the first material.
fn cube(name: &str, centre: Vec3, half: f32) -> Mesh {
    cuboid(name, 0, centre - half, centre + half)
}

/// A triangle that faces down, of two legs of a right angle at `place`.
fn lamp(scene: &mut Scene, material: Material, place: Vec3, leg: f32) {
    let material = scene.add_material(material);
    scene.place(Mesh {
        name: "lamp".into(),
        positions: vec![place, place + Vec3::X * leg, place + Vec3::Z * leg],
        triangles: vec![[0, 1, 2]],
        material: Some(material),
        ..Mesh::default()
    });
}

fn glowing(emission: f32) -> Material {
    Material {
        emission: Vec3::splat(emission),
        double_sided: false,
        ..Material::lambert("glowing", Vec3::splat(0.5))
    }
}

fn point_light(scene: &mut Scene, position: Vec3, intensity: f32) {
    let intensity = Vec3::splat(intensity);
    scene.add_light("point", LightKind::Point { position, intensity });
}

/// A closed room without light, seen from inside, and in it a closed cupboard.
fn room() -> Scene {
    let mut scene = bare();
    scene.name = "room".into();
    scene.meshes.clear();
    scene.instances.clear();
    scene.place(cube("room", Vec3::ZERO, ROOM));
    scene.place(cube("cupboard", CUPBOARD, 0.5));
    let (eye, target) = (DVec3::new(1.5, 0.5, 1.5), DVec3::new(-1.0, 0.0, -1.0));
    scene.cameras[0] = Camera::look_at("inside", eye, target, DVec3::Y, 1.2);
    scene
}

/// Lights of each kind that no path reaches. The choice of a light gives every light its share, so one that is added changes what the others
/// are divided by: the pictures are compared with a light in the last place of the table that is unreachable, too, and of the same power.
#[test]
fn lights_that_are_compiled_in_without_need_change_no_bit() {
    with_gpu(|gpu| {
        let hidden_lamp = |s: &mut Scene| lamp(s, glowing(HIDDEN_EMISSION), CUPBOARD, (2.0 * HIDDEN_AREA).sqrt());
        // 4π·intensity.
        let hidden_point = |s: &mut Scene| point_light(s, CUPBOARD, 0.25 * HIDDEN_EMISSION * HIDDEN_AREA);
        // 4π·radiance·π·(radius of the scene)², of which light sampling has a share. An even sky would be left to scattered rays.
        let sky = |s: &mut Scene| {
            let mut map = Environment::uniform(Vec3::ZERO);
            (map.width, map.height) = (2, 1);
            map.radiance = vec![Vec3::ZERO, Vec3::splat(2.0)];
            let share = EnvironmentTables::build(&map, true).expect("tables").share as f32;
            map.strength = HIDDEN_EMISSION * HIDDEN_AREA / (4.0 * std::f32::consts::PI * 3.0 * ROOM * ROOM * share);
            s.environment = Some(map);
        };
        // Of two triangles in one place, the first with alpha, the second shines but is not among the lights to choose from.
        let unsampled_lamp = |s: &mut Scene| {
            let mask = Material {
                alpha_mode: AlphaMode::Mask { cutoff: 0.5 },
                ..Material::lambert("mask", Vec3::splat(0.5))
            };
            lamp(s, mask, CUPBOARD, 0.25);
            lamp(s, glowing(HIDDEN_EMISSION), CUPBOARD, 0.25);
        };
        let blend = |s: &mut Scene| {
            let half = Material {
                alpha_mode: AlphaMode::Blend,
                base_color: Vec4::splat(0.5),
                ..Material::lambert("half", Vec3::splat(0.5))
            };
            point_triangle(s, half, Vec3::splat(ROOM));
        };
        let mut lamp_room = room();
        lamp(&mut lamp_room, glowing(4.0), Vec3::new(-0.5, 1.5, -0.5), 1.5);
        let mut point_room = room();
        point_light(&mut point_room, Vec3::new(0.5, 1.5, -0.5), 2.0);
        let make = |scene: &Scene, changes: &[Change]| {
            let mut scene = scene.clone();
            changes.iter().for_each(|change| change(&mut scene));
            scene
        };
        let check = |scene: &Scene, lean: &[Change], lean_features: &[&str], full: &[(&str, &[Change], &[&str])]| {
            let tracer_of = |changes: &[Change]| tracer(gpu, &make(scene, changes), [16, 16], &independent());
            let mut tracer = tracer_of(lean);
            assert_eq!(features(&tracer.pipelines()), lean_features);
            let expected = finish(&mut tracer, 16);
            expected.expect_sound("lean", 16);
            for (what, changes, full_features) in full {
                let mut tracer = tracer_of(changes);
                assert_eq!(features(&tracer.pipelines()), *full_features, "{what}");
                expect_same_bits(what, &expected, &finish(&mut tracer, 16));
            }
        };
        check(
            &lamp_room,
            &[&hidden_lamp],
            &["has_area_lights"],
            &[
                (
                    "a point light",
                    &[&hidden_point],
                    &["has_area_lights", "has_punctual_lights"],
                ),
                ("a sky", &[&sky], &["has_environment", "has_area_lights"]),
                ("alpha", &[&hidden_lamp, &blend], &["has_area_lights", "has_alpha"]),
            ],
        );
        check(
            &point_room,
            &[&hidden_point],
            &["has_punctual_lights"],
            &[
                (
                    "a sky beside points",
                    &[&sky],
                    &["has_environment", "has_punctual_lights"],
                ),
                (
                    "a lamp",
                    &[&hidden_point, &unsampled_lamp],
                    &["has_area_lights", "has_punctual_lights", "has_alpha"],
                ),
            ],
        );
        // The comparison would see a light that can be reached.
        let lit = render(
            gpu,
            &make(&lamp_room, &[&|s| point_light(s, Vec3::Y, 1.0)]),
            [16, 16],
            16,
            &independent(),
        );
        let unlit = render(gpu, &make(&lamp_room, &[&hidden_point]), [16, 16], 16, &independent());
        assert_ne!(lit.bits(), unlit.bits());
    });
}
