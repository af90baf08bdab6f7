//! What the glTF reader must refuse, and that it ends whatever it is given.

use std::path::Path;

use serde_json::{Value, json};

use super::super::{load_bytes, load_slice};
use super::Document;
use crate::Result;
use crate::input::{AnyFile, InputFiles, InputLimits};
use crate::scene::Scene;

#[test]
fn faults_are_refused_with_their_place() {
    type Change = fn(&mut Value);
    let cases: &[(&str, Change)] = &[
        ("meshes[0].primitives[0].attributes.POSITION", |j| {
            j["meshes"][0]["primitives"][0]["attributes"]["POSITION"] = 9.into()
        }),
        ("meshes[0].primitives[0].material", |j| {
            j["meshes"][0]["primitives"][0]["material"] = 5.into()
        }),
        ("meshes[0].primitives[0].indices", |j| {
            j["meshes"][0]["primitives"][0]["indices"] = 0.into()
        }),
        ("meshes[0].primitives[0].mode", |j| {
            j["meshes"][0]["primitives"][0]["mode"] = 9.into()
        }),
        ("accessors[0]", |j| j["accessors"][0]["count"] = 4.into()),
        ("accessors[0]", |j| j["accessors"][0]["count"] = (u64::MAX / 2).into()),
        ("accessors[0].count", |j| j["accessors"][0]["count"] = 0.into()),
        ("accessors[0].componentType", |j| {
            j["accessors"][0]["componentType"] = 1.into()
        }),
        ("accessors[0].type", |j| j["accessors"][0]["type"] = "VEC9".into()),
        ("POSITION", |j| j["accessors"][0]["type"] = "MAT4".into()),
        ("accessors[0]", |j| j["accessors"][0]["byteOffset"] = u64::MAX.into()),
        ("accessors[0]", |j| j["bufferViews"][0]["byteStride"] = 4.into()),
        ("accessors[0]", |j| j["bufferViews"][0]["byteStride"] = 252.into()),
        ("bufferViews[0]", |j| {
            j["bufferViews"][0]["byteLength"] = u64::MAX.into()
        }),
        ("bufferViews[0].buffer", |j| j["bufferViews"][0]["buffer"] = 3.into()),
        ("buffer view 8", |j| j["accessors"][0]["bufferView"] = 8.into()),
        ("nodes[0]", |j| j["nodes"][0]["children"] = json!([0])),
        ("nodes[0].mesh", |j| j["nodes"][0]["mesh"] = 1.into()),
        ("nodes[0].rotation", |j| j["nodes"][0]["rotation"] = json!([0, 0, 0, 0])),
        ("number out of range", |j| {
            j["nodes"][0]["matrix"] = json!([1e39, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1])
        }),
        ("nodes[0].matrix", |j| {
            j["nodes"][0]["matrix"] = json!([1, 0, 0, 1, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1])
        }),
        ("node 4 does not exist", |j| j["scenes"][0]["nodes"] = json!([4])),
        ("is reached twice", |j| j["scenes"][0]["nodes"] = json!([0, 0])),
        ("scene 3 does not exist", |j| j["scene"] = 3.into()),
        ("asset.version", |j| j["asset"]["version"] = "1.0".into()),
        ("JSON", |j| j["meshes"] = "no".into()),
        ("JSON", |j| j["nodes"][0]["mesh"] = (-1).into()),
    ];
    for (place, change) in cases {
        let mut document = Document::triangle();
        change(&mut document.json);
        let error = document.refusal();
        assert!(error.contains(place), "{place}: {error}");
    }
}

#[test]
fn unusable_positions_and_counts_are_refused() {
    let mut document = Document::new();
    let positions = document.floats(&[0.0, 0.0, 0.0, 1.0, f32::INFINITY, 0.0, 0.0, 1.0, 0.0], "VEC3");
    document.primitive()["attributes"]["POSITION"] = positions.into();
    assert!(document.refusal().contains("attributes.POSITION: element 1"));
    let mut document = Document::triangle();
    let normals = document.floats(&[0.0, 0.0, 1.0], "VEC3");
    document.primitive()["attributes"]["NORMAL"] = normals.into();
    assert!(document.refusal().contains("1 elements for 3 positions"));
    let mut document = Document::triangle();
    let indices = document.accessor(&[0, 1, 2, 3], 5121, "SCALAR", 3);
    document.primitive()["indices"] = indices.into();
    document.list("accessors")[indices]["byteOffset"] = 1.into();
    assert!(document.refusal().contains("index 3 at 2 is out of range"));
}

#[test]
fn repeated_use_cannot_multiply_work_without_bound() {
    let mut document = Document::new();
    document
        .list("accessors")
        .push(json!({"componentType": 5121, "type": "VEC3", "count": 3_000_000}));
    document.json["meshes"][0]["primitives"] = (0..1000).map(|_| json!({"attributes": {"POSITION": 0}})).collect();
    assert!(document.refusal().contains("too many for its size"));
}

/// Reads a document with room for 200 kB of what its file makes many of.
fn read_within(document: &Document) -> Result<Scene> {
    let limits = InputLimits {
        decoded_base: 200_000,
        decoded_per_byte: 0,
        ..InputLimits::default()
    };
    let files = InputFiles::new(&AnyFile, limits);
    load_bytes(&document.glb(), Path::new(""), &files, "test.glb")
}

fn place_many(document: &mut Document, count: u32) {
    let zeros = json!({"componentType": 5126, "type": "VEC3", "count": count});
    document.list("accessors").push(zeros);
    document.json["nodes"][0]["extensions"] = json!({"EXT_mesh_gpu_instancing": {"attributes": {"TRANSLATION": 1}}});
}

fn nodes_of(document: &mut Document, node: Value) {
    document.json["nodes"] = json!(vec![node; 500]);
    document.json["scenes"][0]["nodes"] = (0..500).collect();
}

#[test]
fn one_name_cannot_multiply_memory() {
    type Change = fn(&mut Document, &str);
    let cases: [(&str, Change); 4] = [
        ("placements", |document, name| {
            place_many(document, 500);
            document.json["nodes"][0]["name"] = name.into();
        }),
        ("primitives", |document, name| {
            let primitive = document.primitive().clone();
            document.json["meshes"][0] = json!({"name": name, "primitives": vec![primitive; 500]});
        }),
        ("lights", |document, name| {
            let light = json!({"type": "point", "name": name});
            document.json["extensions"] = json!({"KHR_lights_punctual": {"lights": [light]}});
            nodes_of(document, json!({"extensions": {"KHR_lights_punctual": {"light": 0}}}));
        }),
        ("cameras", |document, name| {
            let perspective = json!({"yfov": 0.7, "znear": 0.1});
            document.json["cameras"] = json!([{"type": "perspective", "name": name, "perspective": perspective}]);
            nodes_of(document, json!({"camera": 0}));
        }),
    ];
    for (what, change) in cases {
        let with = |name: &str| {
            let mut document = Document::triangle();
            change(&mut document, name);
            read_within(&document)
        };
        let scene = with("a").unwrap_or_else(|error| panic!("{what}: {error}"));
        let counts = [scene.instances.len(), scene.lights.len(), scene.cameras.len()];
        assert!(counts.contains(&500), "{what}: {counts:?}");
        let error = with(&"a".repeat(1000)).expect_err(what).to_string();
        assert!(error.contains("bytes of memory"), "{what}: {error}");
    }
}

#[test]
fn placements_are_counted_before_they_are_made() {
    let mut document = Document::triangle();
    place_many(&mut document, 100_000);
    let error = read_within(&document).expect_err("10 MB of them").to_string();
    assert!(
        error.contains("EXT_mesh_gpu_instancing") && error.contains("bytes of memory"),
        "{error}"
    );
    assert_eq!(document.load().instances.len(), 100_000);
}

#[test]
fn views_of_one_picture_are_decoded_a_few_times_only() {
    let with = |views: usize| {
        let mut document = Document::triangle();
        document.png(&[[1, 2, 3, 4]; 3]);
        // What follows a picture is no part of it, and a view may hold it.
        document.bytes.resize(document.bytes.len() + 100_000, 0);
        let view = document.list("bufferViews")[1].clone();
        for i in 0..views {
            let mut view = view.clone();
            view["byteLength"] = (100_000 - i).into();
            document.list("bufferViews").push(view);
            document.list("images").push(json!({"bufferView": 2 + i}));
            document.list("textures").push(json!({"source": 1 + i}));
            let texture = json!({"index": 1 + i});
            let material = json!({"pbrMetallicRoughness": {"baseColorTexture": texture}});
            document.list("materials").push(material);
        }
        document
    };
    assert_eq!(with(3).load().images.len(), 3);
    let error = with(6).refusal();
    assert!(error.contains("images[") && error.contains("to be decoded"), "{error}");
}

#[test]
fn notes_do_not_repeat_long_names() {
    let mut document = Document::triangle();
    let name = "ä".repeat(5000);
    document.json["textures"] = json!([{"extensions": {name: {}}}]);
    let material = json!({"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}});
    document.json["materials"] = json!(vec![material; 100]);
    let scene = document.load();
    let notes = scene.notes.iter().filter(|note| note.feature.starts_with('ä'));
    assert_eq!(notes.count(), 100);
    assert!(scene.notes.iter().all(|note| note.feature.len() < 300));
}

#[test]
fn deep_hierarchies_are_walked_without_recursion() {
    let mut document = Document::triangle();
    const DEPTH: usize = 100_000;
    document.json["nodes"] = (0..DEPTH)
        .map(|i| {
            if i + 1 < DEPTH {
                json!({"children": [i + 1]})
            } else {
                json!({"mesh": 0})
            }
        })
        .collect();
    assert_eq!(document.load().instances.len(), 1);
    document.json["nodes"][DEPTH - 1] = json!({"children": [0]});
    assert!(document.refusal().contains("nodes[0]"));
}

/// A document that uses most of the reader.
fn rich() -> Document {
    let mut document = Document::triangle();
    let uv = document.floats(&[0.0, 1.0, 1.0, 1.0, 0.0, 0.0], "VEC2");
    let normals = document.floats(&[0.0, 0.0, 1.0, 0.0, 0.0, 1.0, 0.0, 0.0, 1.0], "VEC3");
    let indices = document.accessor(&[0, 1, 2], 5121, "SCALAR", 3);
    let texture = document.png(&[[128, 128, 255, 255]; 3]);
    document.primitive()["attributes"]["TEXCOORD_0"] = uv.into();
    document.primitive()["attributes"]["NORMAL"] = normals.into();
    document.primitive()["indices"] = indices.into();
    document.material(json!({"normalTexture": {"index": texture}, "emissiveTexture": {"index": texture}}));
    let translation = document.floats(&[0.0, 0.0, 0.0, 10.0, 0.0, 0.0], "VEC3");
    document.json["nodes"][0]["extensions"] =
        json!({"EXT_mesh_gpu_instancing": {"attributes": {"TRANSLATION": translation}}});
    document.json["cameras"] = json!([{"type": "perspective", "perspective": {"yfov": 0.7, "znear": 0.1}}]);
    document.json["nodes"][0]["camera"] = 0.into();
    document
}

fn read(bytes: &[u8]) -> Result<Scene> {
    load_slice(bytes, Path::new("/nonexistent"), "test")
}

#[test]
fn every_truncation_is_an_error() {
    for bytes in [rich().glb(), rich().gltf()] {
        read(&bytes).expect("whole");
        for cut in 0..bytes.len() {
            assert!(read(&bytes[..cut]).is_err(), "{cut}");
        }
    }
}

proptest::proptest! {
    #![proptest_config(proptest::prelude::ProptestConfig {
        cases: 400,
        rng_seed: proptest::test_runner::RngSeed::Fixed(20),
        failure_persistence: None,
        ..proptest::prelude::ProptestConfig::default()
    })]

    /// Whatever bytes are changed, reading ends, with a scene that passes its check or with an error.
    #[test]
    fn mutated_bytes_never_panic(changes in proptest::collection::vec((0usize..1 << 16, proptest::num::u8::ANY), 1..8), text: bool) {
        let mut bytes = if text { rich().gltf() } else { rich().glb() };
        let length = bytes.len();
        for (at, value) in changes {
            bytes[at % length] = value;
        }
        if let Ok(scene) = read(&bytes) {
            proptest::prop_assert!(scene.check().is_ok());
        }
    }

    /// Whatever number stands in whatever place of the JSON, reading ends.
    #[test]
    fn mutated_numbers_never_panic(place in 0usize..1 << 16, value in proptest::sample::select(vec![
        "-1", "0", "1", "2", "3", "7", "255", "65535", "2147483648", "4294967295", "4294967296", "18446744073709551615",
        "1e39", "1.5", "null", "\"x\"", "[]", "{}", "true", "5120", "5125", "5126"
    ])) {
        let text = String::from_utf8(rich().gltf()).expect("UTF-8");
        let bytes = text.as_bytes();
        let base = text.find("base64,").unwrap_or(0);
        let starts: Vec<usize> = (1..bytes.len())
            .filter(|&i| bytes[i].is_ascii_digit() && matches!(bytes[i - 1], b':' | b',' | b'['))
            .filter(|&i| i < base || i > base + 10)
            .collect();
        let start = starts[place % starts.len()];
        let end = start + bytes[start..].iter().take_while(|b| b.is_ascii_digit() || **b == b'.').count();
        let changed = format!("{}{value}{}", &text[..start], &text[end..]);
        if let Ok(scene) = read(changed.as_bytes()) {
            proptest::prop_assert!(scene.check().is_ok());
        }
    }
}
