//! A small glTF 2.0 file with its buffer and texture, written from nothing: a chequered floor, a pyramid and a lamp.

use std::path::{Path, PathBuf};

use clerestory::{Error, Result};
use glam::{Vec2, Vec3};
use serde_json::{Value, json};

/// Texels along a side of the texture, and along a side of its squares.
const TEXELS: u32 = 64;
const SQUARE: u32 = 16;
/// Colours of the squares, sRGB.
const COLORS: [[u8; 4]; 2] = [[230, 220, 200, 255], [60, 90, 130, 255]];
/// `componentType` and buffer view targets of glTF.
const FLOAT: u32 = 5126;
const UNSIGNED_INT: u32 = 5125;
const ARRAY_BUFFER: u32 = 34962;
const ELEMENT_ARRAY_BUFFER: u32 = 34963;

/// Collects accessors and the buffer behind them.
#[derive(Default)]
struct Builder {
    bytes: Vec<u8>,
    views: Vec<Value>,
    accessors: Vec<Value>,
}

impl Builder {
    /// Adds an accessor of numbers; returns its index.
    fn add(&mut self, bytes: Vec<u8>, target: u32, mut accessor: Value) -> usize {
        self.views.push(json!({
            "buffer": 0, "byteOffset": self.bytes.len(), "byteLength": bytes.len(), "target": target,
        }));
        self.bytes.extend(bytes);
        accessor["bufferView"] = json!(self.views.len() - 1);
        self.accessors.push(accessor);
        self.accessors.len() - 1
    }

    /// Adds quadrilaterals and triangles, flat, each with its own corners; returns the mesh.
    fn mesh(&mut self, name: &str, material: usize, faces: &[&[Vec3]], repeat: f32) -> Value {
        let floats = |values: &[f32]| values.iter().flat_map(|value| value.to_le_bytes()).collect();
        let positions: Vec<Vec3> = faces.iter().copied().flatten().copied().collect();
        let low = positions.iter().copied().reduce(Vec3::min).unwrap_or_default();
        let high = positions.iter().copied().reduce(Vec3::max).unwrap_or_default();
        let corners = [Vec2::ZERO, Vec2::X, Vec2::ONE, Vec2::Y];
        let uv: Vec<f32> = faces
            .iter()
            .flat_map(|face| corners.iter().take(face.len()))
            .flat_map(|corner| (*corner * repeat).to_array())
            .collect();
        let mut indices: Vec<u32> = Vec::new();
        let mut first = 0;
        for face in faces {
            let count = face.len() as u32;
            indices.extend((1..count - 1).flat_map(|i| [first, first + i, first + i + 1]));
            first += count;
        }
        let flat: Vec<f32> = positions.iter().flat_map(|p| p.to_array()).collect();
        let vertices = positions.len();
        let position = self.add(
            floats(&flat),
            ARRAY_BUFFER,
            json!({"componentType": FLOAT, "count": vertices, "type": "VEC3",
                "min": low.to_array(), "max": high.to_array()}),
        );
        let uv = self.add(
            floats(&uv),
            ARRAY_BUFFER,
            json!({"componentType": FLOAT, "count": vertices, "type": "VEC2"}),
        );
        let index = self.add(
            indices.iter().flat_map(|index| index.to_le_bytes()).collect(),
            ELEMENT_ARRAY_BUFFER,
            json!({"componentType": UNSIGNED_INT, "count": indices.len(), "type": "SCALAR"}),
        );
        json!({"name": name, "primitives": [{
            "attributes": {"POSITION": position, "TEXCOORD_0": uv}, "indices": index, "material": material,
        }]})
    }
}

/// Writes `small.gltf`, `small.bin` and `checker.png` into a folder; returns the path of the first.
///
/// # Errors
/// [`Error::Io`], [`Error::Picture`].
pub fn write(folder: &Path) -> Result<PathBuf> {
    let mut builder = Builder::default();
    let at = Vec3::new;
    let [a, b, c, d] = [(-3.0, 3.0), (3.0, 3.0), (3.0, -3.0), (-3.0, -3.0)].map(|(x, z)| at(x, 0.0, z));
    let [e, f, g, h] = [(-0.8, 0.8), (0.8, 0.8), (0.8, -0.8), (-0.8, -0.8)].map(|(x, z)| at(x, 0.0, z));
    let top = at(0.0, 1.4, 0.0);
    let [l, m, n, o] = [(-1.0, -0.6), (-1.0, 0.6), (1.0, 0.6), (1.0, -0.6)].map(|(x, z)| at(x, 0.0, z));
    let meshes = [
        builder.mesh("floor", 0, &[&[a, b, c, d]], 3.0),
        builder.mesh(
            "pyramid",
            1,
            &[&[e, f, top], &[f, g, top], &[g, h, top], &[h, e, top]],
            1.0,
        ),
        builder.mesh("lamp", 2, &[&[l, o, n, m]], 1.0),
    ];
    // Turned by 30° around the vertical, and looking down by 20°.
    let (turn, tilt) = (15f32.to_radians(), 10f32.to_radians());
    let document = json!({
        "asset": {"version": "2.0", "generator": "clerestory sample render_gltf"},
        "extensionsUsed": ["KHR_materials_emissive_strength"],
        "scene": 0,
        "scenes": [{"nodes": [0, 1, 2, 3]}],
        "nodes": [
            {"name": "floor", "mesh": 0},
            {"name": "pyramid", "mesh": 1, "rotation": [0.0, turn.sin(), 0.0, turn.cos()]},
            {"name": "lamp", "mesh": 2, "translation": [-1.2, 3.0, 1.0]},
            {"name": "eye", "camera": 0, "translation": [0.0, 2.4, 5.2], "rotation": [-tilt.sin(), 0.0, 0.0, tilt.cos()]},
        ],
        "cameras": [{"name": "main", "type": "perspective", "perspective": {"yfov": 0.7, "znear": 0.1}}],
        "meshes": meshes,
        "materials": [
            {"name": "chequered", "pbrMetallicRoughness": {
                "baseColorTexture": {"index": 0}, "metallicFactor": 0.0, "roughnessFactor": 0.6}},
            {"name": "orange", "pbrMetallicRoughness": {
                "baseColorFactor": [0.8, 0.3, 0.05, 1.0], "metallicFactor": 0.0, "roughnessFactor": 0.4}},
            {"name": "lamp", "emissiveFactor": [1.0, 0.95, 0.85], "pbrMetallicRoughness": {"metallicFactor": 0.0},
                "extensions": {"KHR_materials_emissive_strength": {"emissiveStrength": 14.0}}},
        ],
        "textures": [{"source": 0, "sampler": 0}],
        "samplers": [{}],
        "images": [{"uri": "checker.png"}],
        "buffers": [{"uri": "small.bin", "byteLength": builder.bytes.len()}],
        "bufferViews": builder.views,
        "accessors": builder.accessors,
    });
    let texels: Vec<u8> = (0..TEXELS * TEXELS)
        .flat_map(|i| COLORS[((i % TEXELS / SQUARE + i / TEXELS / SQUARE) % 2) as usize])
        .collect();
    crate::save_png(&folder.join("checker.png"), [TEXELS; 2], &texels)?;
    let save = |name: &str, bytes: &[u8]| {
        let path = folder.join(name);
        std::fs::write(&path, bytes).map_err(|error| Error::io(&path, error))?;
        Ok(path)
    };
    save("small.bin", &builder.bytes)?;
    save("small.gltf", document.to_string().as_bytes())
}
