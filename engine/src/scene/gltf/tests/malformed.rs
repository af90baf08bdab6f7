//! What the glTF reader must refuse, and that it ends whatever it is given.

use std::path::Path;

use serde_json::{Value, json};

use super::super::load_slice;
use super::Document;
use crate::Result;
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
