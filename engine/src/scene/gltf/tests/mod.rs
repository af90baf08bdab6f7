//! glTF built in memory for tests: a document of JSON and one buffer.

mod features;
mod malformed;

use std::path::Path;

use base64::Engine;
use serde_json::{Value, json};

use super::load_slice;
use crate::scene::Scene;

/// A document under construction: JSON and one buffer.
struct Document {
    json: Value,
    bytes: Vec<u8>,
}

impl Document {
    fn new() -> Self {
        let json = json!({
            "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0, "name": "node"}],
            "meshes": [{"primitives": [{"attributes": {}}], "name": "mesh"}],
            "accessors": [], "bufferViews": [], "buffers": [], "materials": [], "textures": [], "images": [], "cameras": []
        });
        Self {
            json,
            bytes: Vec::new(),
        }
    }

    /// One triangle in the plane z = 0.
    fn triangle() -> Self {
        let mut document = Self::new();
        let positions = document.floats(&[0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0], "VEC3");
        document.primitive()["attributes"]["POSITION"] = positions.into();
        document
    }

    fn list(&mut self, name: &str) -> &mut Vec<Value> {
        self.json[name].as_array_mut().expect("array")
    }

    fn primitive(&mut self) -> &mut Value {
        &mut self.json["meshes"][0]["primitives"][0]
    }

    fn view(&mut self, bytes: &[u8]) -> usize {
        self.bytes.resize(self.bytes.len().next_multiple_of(4), 0);
        let offset = self.bytes.len();
        self.bytes.extend(bytes);
        let view = json!({"buffer": 0, "byteOffset": offset, "byteLength": bytes.len()});
        self.list("bufferViews").push(view);
        self.list("bufferViews").len() - 1
    }

    fn accessor(&mut self, bytes: &[u8], component: u32, shape: &str, count: usize) -> usize {
        let view = self.view(bytes);
        let accessor = json!({"bufferView": view, "componentType": component, "type": shape, "count": count});
        self.list("accessors").push(accessor);
        self.list("accessors").len() - 1
    }

    fn floats(&mut self, values: &[f32], shape: &str) -> usize {
        let width = match shape {
            "SCALAR" => 1,
            "VEC2" => 2,
            "VEC3" => 3,
            _ => 4,
        };
        let bytes: Vec<u8> = values.iter().flat_map(|v| v.to_le_bytes()).collect();
        self.accessor(&bytes, 5126, shape, values.len() / width)
    }

    fn material(&mut self, material: Value) {
        self.list("materials").push(material);
        self.primitive()["material"] = 0.into();
    }

    fn png(&mut self, texels: &[[u8; 4]]) -> usize {
        let mut bytes = Vec::new();
        let flat = texels.as_flattened();
        let encoder = ::image::codecs::png::PngEncoder::new(&mut bytes);
        ::image::ImageEncoder::write_image(encoder, flat, texels.len() as u32, 1, ::image::ExtendedColorType::Rgba8)
            .expect("PNG");
        let view = self.view(&bytes);
        self.list("images")
            .push(json!({"bufferView": view, "mimeType": "image/png"}));
        let image = self.list("images").len() - 1;
        self.list("textures").push(json!({"source": image}));
        self.list("textures").len() - 1
    }

    fn gltf(&self) -> Vec<u8> {
        let mut json = self.json.clone();
        let data = base64::engine::general_purpose::STANDARD.encode(&self.bytes);
        json["buffers"] = json!([{
            "byteLength": self.bytes.len(), "uri": format!("data:application/octet-stream;base64,{data}")
        }]);
        json.to_string().into_bytes()
    }

    fn glb(&self) -> Vec<u8> {
        let mut json = self.json.clone();
        json["buffers"] = json!([{"byteLength": self.bytes.len()}]);
        let mut text = json.to_string().into_bytes();
        text.resize(text.len().next_multiple_of(4), b' ');
        let mut binary = self.bytes.clone();
        binary.resize(binary.len().next_multiple_of(4), 0);
        let mut glb = b"glTF".to_vec();
        let total = 12 + 8 + text.len() + 8 + binary.len();
        for word in [2, total as u32, text.len() as u32] {
            glb.extend(word.to_le_bytes());
        }
        glb.extend(b"JSON");
        glb.extend(text);
        glb.extend((binary.len() as u32).to_le_bytes());
        glb.extend(b"BIN\0");
        glb.extend(binary);
        glb
    }

    fn load(&self) -> Scene {
        load_slice(&self.glb(), Path::new(""), "test.glb").unwrap_or_else(|error| panic!("{error}"))
    }

    fn refusal(&self) -> String {
        load_slice(&self.glb(), Path::new(""), "test.glb")
            .expect_err("must be refused")
            .to_string()
    }
}

fn notes(scene: &Scene) -> String {
    scene
        .notes
        .iter()
        .map(|n| format!("{}@{}; ", n.feature, n.at))
        .collect()
}
