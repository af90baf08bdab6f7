//! One test a feature of the glTF reader.

use std::path::Path;

use glam::{DVec3, Vec2, Vec3, Vec4};
use serde_json::json;

use super::super::image::transform_rows;
use super::super::{load, load_slice};
use super::{Document, notes};
use crate::scene::{AlphaMode, Filter, LightKind, Projection, SceneProfile, Wrap};

#[test]
fn text_and_binary_containers_give_the_same_scene() {
    let document = Document::triangle();
    let text = load_slice(&document.gltf(), Path::new(""), "test.gltf").expect("scene");
    let binary = document.load();
    assert_eq!(text.meshes[0].positions, binary.meshes[0].positions);
    assert_eq!(binary.meshes[0].triangles, [[0, 1, 2]]);
    assert_eq!(binary.instances[0].name, "node");
    assert!(binary.notes.is_empty(), "{}", notes(&binary));
}

#[test]
fn external_files_are_percent_decoded() {
    let folder = tempfile::tempdir().expect("folder");
    let document = Document::triangle();
    std::fs::write(folder.path().join("a b.bin"), &document.bytes).expect("file");
    let mut json = document.json.clone();
    json["buffers"] = json!([{"byteLength": document.bytes.len(), "uri": "a%20b.bin"}]);
    let path = folder.path().join("m.gltf");
    std::fs::write(&path, json.to_string()).expect("file");
    let scene = load(&path).expect("scene");
    assert_eq!((scene.name.as_str(), scene.meshes.len()), ("m", 1));
    json["buffers"][0]["uri"] = "missing.bin".into();
    std::fs::write(&path, json.to_string()).expect("file");
    let error = load(&path).expect_err("missing").to_string();
    assert!(
        error.contains("buffers[0].uri") && error.contains("missing.bin"),
        "{error}"
    );
    json["buffers"][0]["uri"] = "https://example.org/a.bin".into();
    std::fs::write(&path, json.to_string()).expect("file");
    assert!(load(&path).is_err());
}

#[test]
fn all_index_types_and_topologies_are_read() {
    let square = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 1.0, 1.0, 0.0];
    for component in [5121, 5123, 5125] {
        for (mode, indices, expected) in [
            (4, vec![0u32, 1, 2, 2, 1, 3], vec![[0, 1, 2], [2, 1, 3]]),
            (5, vec![0, 1, 2, 3], vec![[0, 1, 2], [1, 3, 2]]),
            (6, vec![0, 1, 3, 2], vec![[1, 3, 0], [3, 2, 0]]),
        ] {
            let mut document = Document::new();
            let positions = document.floats(&square, "VEC3");
            let bytes: Vec<u8> = indices
                .iter()
                .flat_map(|i| match component {
                    5121 => vec![*i as u8],
                    5123 => (*i as u16).to_le_bytes().to_vec(),
                    _ => i.to_le_bytes().to_vec(),
                })
                .collect();
            let accessor = document.accessor(&bytes, component, "SCALAR", indices.len());
            *document.primitive() = json!({"attributes": {"POSITION": positions}, "indices": accessor, "mode": mode});
            assert_eq!(
                document.load().meshes[0].triangles,
                expected,
                "mode {mode}, component {component}"
            );
        }
    }
}

#[test]
fn points_and_lines_are_reported() {
    let mut document = Document::triangle();
    document.primitive()["mode"] = 1.into();
    let scene = document.load();
    assert!(scene.instances.is_empty() && notes(&scene).contains("Lines primitives@meshes[0].primitives[0]"));
}

#[test]
fn normalized_and_quantized_attributes_are_scaled() {
    let mut document = Document::new();
    document.json["extensionsRequired"] = json!(["KHR_mesh_quantization"]);
    let positions: Vec<u8> = [0i16, 0, 0, 0, i16::MAX, 0, 0, 0, 0, i16::MIN, 0, 0]
        .iter()
        .flat_map(|v| v.to_le_bytes())
        .collect();
    let position = document.accessor(&positions, 5122, "VEC3", 3);
    document.list("bufferViews")[0]["byteStride"] = 8.into();
    document.list("accessors")[position]["normalized"] = true.into();
    let uv = document.accessor(&[0, 0, 255, 0, 0, 255], 5121, "VEC2", 3);
    document.list("accessors")[uv]["normalized"] = true.into();
    let color = document.accessor(&[255, 0, 0, 51, 0, 255, 0, 102, 0, 0, 255, 255], 5121, "VEC4", 3);
    document.list("accessors")[color]["normalized"] = true.into();
    *document.primitive() = json!({"attributes": {"POSITION": position, "TEXCOORD_0": uv, "COLOR_0": color}});
    let mesh = &document.load().meshes[0];
    assert_eq!(mesh.positions, [Vec3::ZERO, Vec3::X, Vec3::NEG_Y]);
    assert_eq!(mesh.uv0, [Vec2::ZERO, Vec2::X, Vec2::Y]);
    assert_eq!(mesh.colors[0], Vec4::new(1.0, 0.0, 0.0, 0.2));
    // Colours of three components are opaque.
    let color = document.floats(&[0.5, 0.25, 0.125, 0.0, 0.0, 0.0, 1.0, 1.0, 1.0], "VEC3");
    document.primitive()["attributes"]["COLOR_0"] = color.into();
    assert_eq!(document.load().meshes[0].colors[0], Vec4::new(0.5, 0.25, 0.125, 1.0));
}

#[test]
fn sparse_and_zero_accessors_follow_the_specification() {
    let mut document = Document::new();
    let indices = document.view(&[1, 2]);
    let values: Vec<u8> = [1f32, 0.0, 0.0, 0.0, 1.0, 0.0]
        .iter()
        .flat_map(|v| v.to_le_bytes())
        .collect();
    let values = document.view(&values);
    document.list("accessors").push(json!({
        "componentType": 5126, "type": "VEC3", "count": 3,
        "sparse": {"count": 2, "indices": {"bufferView": indices, "componentType": 5121}, "values": {"bufferView": values}}
    }));
    document.primitive()["attributes"]["POSITION"] = 0.into();
    assert_eq!(document.load().meshes[0].positions, [Vec3::ZERO, Vec3::X, Vec3::Y]);
    document.list("accessors")[0]["count"] = 2.into();
    assert!(document.refusal().contains("accessors[0].sparse.indices"));
    // Without any data: zeros.
    let mut zeros = Document::new();
    zeros
        .list("accessors")
        .push(json!({"componentType": 5126, "type": "VEC3", "count": 3}));
    zeros.primitive()["attributes"]["POSITION"] = 0.into();
    assert_eq!(zeros.load().meshes[0].positions, [Vec3::ZERO; 3]);
    zeros.list("accessors")[0]["count"] = 4_000_000_000u64.into();
    assert!(zeros.refusal().contains("accessors[0].count"));
}

#[test]
fn hierarchies_multiply_transforms() {
    let mut document = Document::triangle();
    document.json["nodes"] = json!([
        {"children": [1, 2], "translation": [1, 2, 3]},
        {"mesh": 0, "rotation": [0, 0, std::f64::consts::FRAC_1_SQRT_2, std::f64::consts::FRAC_1_SQRT_2], "scale": [2, 3, 4]},
        {"mesh": 0, "matrix": [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, -1, 0, 5, 6, 7, 1]}
    ]);
    let scene = document.load();
    assert_eq!(scene.meshes.len(), 1);
    let at = |i: usize, p: DVec3| scene.instances[i].transform.transform_point3(p);
    // Rotating +X by 90° about Z after scaling by 2 gives +2Y; f32 quaternions are good to 1e-7.
    assert!(at(0, DVec3::X).distance(DVec3::new(1.0, 4.0, 3.0)) < 1e-6);
    assert!(at(0, DVec3::Y).distance(DVec3::new(-2.0, 2.0, 3.0)) < 1e-6);
    assert_eq!(at(1, DVec3::Z), DVec3::new(6.0, 8.0, 9.0));
    assert!(scene.instances[1].transform.matrix3.determinant() < 0.0);
}

#[test]
fn gpu_instancing_places_every_instance() {
    let mut document = Document::triangle();
    let translation = document.floats(&[0.0, 0.0, 0.0, 10.0, 0.0, 0.0], "VEC3");
    let rotation = document.accessor(&[0, 0, 0, 127, 0, 0, 127, 0], 5120, "VEC4", 2);
    document.list("accessors")[rotation]["normalized"] = true.into();
    let scale = document.floats(&[1.0, 1.0, 1.0, 2.0, 2.0, 2.0], "VEC3");
    document.json["extensionsRequired"] = json!(["EXT_mesh_gpu_instancing"]);
    document.json["nodes"][0]["translation"] = json!([0, 1, 0]);
    document.json["nodes"][0]["extensions"] = json!({"EXT_mesh_gpu_instancing": {
        "attributes": {"TRANSLATION": translation, "ROTATION": rotation, "SCALE": scale}
    }});
    let scene = document.load();
    assert_eq!(scene.instances.len(), 2);
    assert_eq!(scene.instances[0].transform.translation, DVec3::Y);
    // A half turn about Z and twice the size.
    let p = scene.instances[1].transform.transform_point3(DVec3::X);
    assert!(p.distance(DVec3::new(8.0, 1.0, 0.0)) < 1e-12, "{p}");
    document.json["nodes"][0]["extensions"]["EXT_mesh_gpu_instancing"]["attributes"]["SCALE"] = 99.into();
    assert!(document.refusal().contains("accessor 99 does not exist"));
    document.json["nodes"][0]["extensions"]["EXT_mesh_gpu_instancing"] = json!({"attributes": {}});
    assert!(document.refusal().contains("EXT_mesh_gpu_instancing.attributes"));
}

#[test]
fn cameras_keep_their_axes_without_scale() {
    let mut document = Document::triangle();
    document.json["cameras"] = json!([
        {"type": "perspective", "perspective": {"yfov": 0.7, "znear": 0.1, "aspectRatio": 1.5}},
        {"type": "orthographic", "orthographic": {"xmag": 4.0, "ymag": 2.0, "znear": 0.1, "zfar": 9.0}}
    ]);
    document.json["nodes"] =
        json!([{"camera": 0, "scale": [2, 2, 2], "children": [1]}, {"camera": 1, "name": "side", "mesh": 0}]);
    let scene = document.load();
    assert_eq!(scene.cameras[0].projection, Projection::Perspective { fov_y: 0.7 });
    assert_eq!(
        scene.cameras[1].projection,
        Projection::Orthographic { half_height: 2.0 }
    );
    assert_eq!(
        (scene.cameras[1].name.as_str(), scene.defaults.aspect),
        ("side", Some(1.5))
    );
    assert_eq!(scene.cameras[0].transform.matrix3, glam::DMat3::IDENTITY);
    document.json["cameras"][0] = json!({"type": "perspective"});
    assert!(document.refusal().contains("cameras[0]"));
    document.json["cameras"][0] = json!({"type": "perspective", "perspective": {"yfov": 4.0, "znear": 0.1}});
    assert!(document.refusal().contains("cameras[0]"));
}

#[test]
fn punctual_lights_are_placed_by_their_nodes() {
    let mut document = Document::triangle();
    document.json["extensionsUsed"] = json!(["KHR_lights_punctual"]);
    document.json["extensions"] = json!({"KHR_lights_punctual": {"lights": [
        {"type": "point", "color": [1, 0.5, 0.25], "intensity": 8.0, "name": "bulb"},
        {"type": "spot", "intensity": 2.0, "spot": {"innerConeAngle": 0.1, "outerConeAngle": 0.5}},
        {"type": "directional", "range": 3.0}
    ]}});
    let light = |i: usize| json!({"KHR_lights_punctual": {"light": i}});
    document.json["scenes"][0]["nodes"] = json!([0, 1, 2, 3]);
    document.json["nodes"] = json!([
        {"mesh": 0},
        {"extensions": light(0), "translation": [1, 2, 3]},
        {"extensions": light(1), "rotation": [-std::f64::consts::FRAC_1_SQRT_2, 0, 0, std::f64::consts::FRAC_1_SQRT_2]},
        {"extensions": light(2), "scale": [3, 3, 3]}
    ]);
    let scene = document.load();
    let LightKind::Point { position, intensity } = scene.lights[0].kind else {
        panic!("point");
    };
    assert_eq!(
        (position, intensity),
        (Vec3::new(1.0, 2.0, 3.0), Vec3::new(8.0, 4.0, 2.0))
    );
    let LightKind::Spot {
        direction,
        inner,
        outer,
        ..
    } = scene.lights[1].kind
    else {
        panic!("spot");
    };
    assert!(direction.distance(Vec3::NEG_Y) < 1e-6 && inner == 0.1 && outer == 0.5);
    let LightKind::Directional { direction, irradiance } = scene.lights[2].kind else {
        panic!("directional");
    };
    assert_eq!((direction, irradiance), (Vec3::NEG_Z, Vec3::ONE));
    assert!(notes(&scene).contains("range"));
    document.json["nodes"][1]["extensions"] = light(7);
    assert!(document.refusal().contains("light 7 does not exist"));
}

#[test]
fn material_extensions_are_carried_over() {
    let mut document = Document::triangle();
    document.material(json!({
        "name": "m", "alphaMode": "MASK", "alphaCutoff": 0.25, "doubleSided": true, "emissiveFactor": [0.5, 0.25, 1],
        "pbrMetallicRoughness": {"baseColorFactor": [0.1, 0.2, 0.3, 0.4], "metallicFactor": 0.5, "roughnessFactor": 0.25},
        "extensions": {
            "KHR_materials_emissive_strength": {"emissiveStrength": 8.0},
            "KHR_materials_ior": {"ior": 1.25},
            "KHR_materials_specular": {"specularFactor": 0.5, "specularColorFactor": [1, 0.5, 0.25]},
            "KHR_materials_transmission": {"transmissionFactor": 0.75},
            "KHR_materials_volume": {"thicknessFactor": 2.0, "attenuationColor": [0.5, 0.5, 1], "attenuationDistance": 4.0},
            "KHR_materials_unlit": {},
            "KHR_materials_clearcoat": {"clearcoatFactor": 1.0}
        }
    }));
    let scene = document.load();
    let m = &scene.materials[0];
    assert_eq!(m.alpha_mode, AlphaMode::Mask { cutoff: 0.25 });
    assert_eq!(
        (m.base_color, m.metallic, m.roughness),
        (Vec4::new(0.1, 0.2, 0.3, 0.4), 0.5, 0.25)
    );
    assert_eq!((m.emission, m.ior, m.specular), (Vec3::new(4.0, 2.0, 8.0), 1.25, 0.5));
    assert_eq!(m.specular_color, Vec3::new(1.0, 0.5, 0.25));
    assert_eq!((m.transmission, m.thickness, m.attenuation_distance), (0.75, 2.0, 4.0));
    assert_eq!(m.attenuation_color, Vec3::new(0.5, 0.5, 1.0));
    assert!(m.unlit && m.double_sided && SceneProfile::of(&scene).has_unlit);
    assert_eq!(notes(&scene), "KHR_materials_clearcoat@materials[0].extensions; ");
    // The default volume is clear, and the default material is the specification's.
    let mut plain = Document::triangle();
    plain.material(json!({"extensions": {"KHR_materials_volume": {"thicknessFactor": 1.0}}}));
    let m = &plain.load().materials[0];
    assert_eq!(
        (m.attenuation_distance, m.metallic, m.roughness, m.ior),
        (f32::INFINITY, 1.0, 1.0, 1.5)
    );
    plain.json["materials"][0] = json!({"pbrMetallicRoughness": {"roughnessFactor": 1.5}});
    assert!(plain.refusal().contains("materials[0]") && plain.refusal().contains("roughness"));
    for (mode, read) in [
        (json!({"alphaMode": "BLEND"}), AlphaMode::Blend),
        (json!({"alphaMode": "MASK"}), AlphaMode::Mask { cutoff: 0.5 }),
        (json!({}), AlphaMode::Opaque),
    ] {
        plain.json["materials"][0] = mode;
        assert_eq!(plain.load().materials[0].alpha_mode, read);
    }
    plain.json["materials"][0] = json!({"alphaMode": "FANCY"});
    assert!(plain.refusal().contains("materials[0].alphaMode"));
}

#[test]
fn textures_have_samplers_and_transforms() {
    let mut document = Document::triangle();
    let uv = document.floats(&[0.0, 0.0, 1.0, 0.0, 0.0, 1.0], "VEC2");
    document.primitive()["attributes"]["TEXCOORD_1"] = uv.into();
    let texture = document.png(&[[255, 0, 0, 255], [0, 255, 0, 128]]);
    document.json["samplers"] = json!([{"magFilter": 9728, "wrapS": 33071, "wrapT": 33648}]);
    document.list("textures")[texture]["sampler"] = 0.into();
    document.material(json!({"pbrMetallicRoughness": {"baseColorTexture": {
        "index": texture, "extensions": {"KHR_texture_transform": {"offset": [0.5, 0.25], "scale": [2, 3], "texCoord": 1}}
    }}}));
    let scene = document.load();
    assert_eq!(scene.images[0].texels, [[255, 0, 0, 255], [0, 255, 0, 128]]);
    let texture = scene.materials[0].base_color_texture.expect("texture");
    assert_eq!((texture.uv_set, texture.filter), (1, Filter::Nearest));
    assert_eq!(texture.wrap, [Wrap::ClampToEdge, Wrap::MirroredRepeat]);
    assert_eq!(texture.transform, [[2.0, 0.0, 0.5], [0.0, 3.0, 0.25]]);
    // The extension's own example: the lower left quadrant of the image, turned by 90°.
    let m = transform_rows([0.0, 1.0], std::f32::consts::FRAC_PI_2, [0.5, 0.5]);
    let apply = |u: f32, v: f32| m.map(|r| r[0] * u + r[1] * v + r[2]);
    for (u, v) in [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0), (1.0, 1.0)] {
        let [x, y] = apply(u, v);
        assert!(
            (-1e-6..=0.5 + 1e-6).contains(&x) && (0.5 - 1e-6..=1.0 + 1e-6).contains(&y),
            "{x} {y}"
        );
    }
    // Counter-clockwise as seen with v down: u turns towards −v. Rotation follows an unequal scale and precedes the offset.
    let m = transform_rows([0.25, 0.5], std::f32::consts::FRAC_PI_6, [2.0, 4.0]);
    let (sin, cos) = std::f32::consts::FRAC_PI_6.sin_cos();
    assert_eq!(m, [[2.0 * cos, 4.0 * sin, 0.25], [-2.0 * sin, 4.0 * cos, 0.5]]);
}

#[test]
fn unknown_image_formats_are_left_out_by_name() {
    let mut document = Document::triangle();
    let view = document.view(b"RIFF\0\0\0\0WEBPVP8 ");
    document.json["images"] = json!([{"bufferView": view}]);
    document.json["textures"] = json!([{"source": 0}, {"extensions": {"KHR_texture_basisu": {"source": 0}}}]);
    document
        .material(json!({"emissiveTexture": {"index": 1}, "pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}));
    let scene = document.load();
    assert!(scene.materials[0].base_color_texture.is_none() && scene.materials[0].emission_texture.is_none());
    let notes = notes(&scene);
    assert!(
        notes.contains("WebP@images[0]") && notes.contains("KHR_texture_basisu@textures[1]"),
        "{notes}"
    );
    // A PNG that is damaged is an error.
    let view = document.view(b"\x89PNG\r\n\x1a\n garbage");
    document.json["images"] = json!([{"bufferView": view}]);
    assert!(document.refusal().contains("images[0]"));
}

#[test]
fn tangents_come_from_the_file_or_from_mikktspace() {
    let mut document = Document::triangle();
    let uv = document.floats(&[0.0, 1.0, 1.0, 1.0, 0.0, 0.0], "VEC2");
    let normals = document.floats(&[0.0, 0.0, 2.0, 0.0, 0.0, 1.0, f32::NAN, 0.0, 1.0], "VEC3");
    let texture = document.png(&[[128, 128, 255, 255]]);
    document.primitive()["attributes"]["TEXCOORD_0"] = uv.into();
    document.primitive()["attributes"]["NORMAL"] = normals.into();
    document.material(json!({"normalTexture": {
        "index": texture, "scale": 0.5, "extensions": {"KHR_texture_transform": {"scale": [2, 2]}}
    }}));
    let scene = document.load();
    let mesh = &scene.meshes[0];
    assert!(notes(&scene).contains("unusable vertex attribute values@meshes[0].primitives[0].attributes.NORMAL"));
    assert_eq!(mesh.normals[0], Vec3::Z);
    assert_eq!(mesh.tangents.len(), mesh.positions.len());
    assert!(
        (mesh.tangents[0] - Vec4::new(1.0, 0.0, 0.0, 1.0)).length() < 1e-6,
        "{}",
        mesh.tangents[0]
    );
    assert_eq!(scene.materials[0].normal_scale, 0.5);
    assert_eq!(scene.materials[0].normal_texture.expect("map").transform[0][0], 2.0);
    let tangents = document.floats(&[0.0, 3.0, 0.0, -1.0, 0.0, 1.0, 0.0, -1.0, 0.0, 0.0, 0.0, 0.0], "VEC4");
    document.primitive()["attributes"]["TANGENT"] = tangents.into();
    let mesh = &document.load().meshes[0];
    assert_eq!(mesh.tangents[0], Vec4::new(0.0, 1.0, 0.0, -1.0));
    assert!((mesh.tangents[2].truncate().length() - 1.0).abs() < 1e-6);
}

#[test]
fn what_is_not_modelled_is_named() {
    let mut document = Document::triangle();
    let joints = document.accessor(&[0; 12], 5121, "VEC4", 3);
    document.primitive()["attributes"]["JOINTS_0"] = joints.into();
    document.primitive()["targets"] = json!([{"POSITION": 0}]);
    document.json["extensionsUsed"] = json!(["KHR_materials_sheen"]);
    document.json["animations"] = json!([{"channels": [], "samplers": []}]);
    let names = notes(&document.load());
    for feature in ["skinning", "morph targets", "KHR_materials_sheen", "animations"] {
        assert!(names.contains(feature), "{feature}: {names}");
    }
    for required in [
        "KHR_draco_mesh_compression",
        "EXT_meshopt_compression",
        "KHR_texture_basisu",
    ] {
        document.json["extensionsRequired"] = json!([required]);
        let error = document.refusal();
        assert!(
            error.contains("extensionsRequired[0]") && error.contains(required),
            "{error}"
        );
    }
}
