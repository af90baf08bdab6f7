//! Seeds: small sound files that mutations begin with. All are made here; none is larger than a few kilobytes.

use std::path::Path;

use clerestory::accel::kd::{KdSettings, KdTree};
use clerestory::film::picture::{DEPTH, NORMAL};
use clerestory::film::{Picture, exr, hdr};
use clerestory::gpu::{Gpu, GpuOptions};
use clerestory::scene::DensityGrid;
use clerestory::scene::medium::vol;
use clerestory::{Error, Result, techniques};
use glam::{DVec3, Vec3};

use super::case::Case;

/// A file that could not be made, which is a fault of this module.
fn unmade(name: &str, cause: impl ToString) -> Error {
    Error::setting("seed", name, cause.to_string())
}

fn read(path: &Path) -> Result<Vec<u8>> {
    std::fs::read(path).map_err(|error| Error::io(path, error))
}

/// An image of 4 × 4 texels in a format of the library's.
fn image_file(format: image::ImageFormat) -> Result<Vec<u8>> {
    let mut bytes = std::io::Cursor::new(Vec::new());
    let texels = image::RgbImage::from_fn(4, 4, |x, y| image::Rgb([60 * x as u8, 60 * y as u8, 128]));
    texels
        .write_to(&mut bytes, format)
        .map_err(|error| unmade("image", error))?;
    Ok(bytes.into_inner())
}

fn png() -> Result<Vec<u8>> {
    image_file(image::ImageFormat::Png)
}

fn jpeg() -> Result<Vec<u8>> {
    image_file(image::ImageFormat::Jpeg)
}

/// A picture with several layers.
fn picture() -> Result<Picture> {
    let values = |count: u32| (0..count).map(|i| 0.125 * i as f32).collect();
    let mut picture = Picture::from_radiance(6, 4, values(6 * 4 * 3))?;
    picture.add_layer(NORMAL, 3, values(6 * 4 * 3))?;
    picture.add_layer(DEPTH, 1, values(6 * 4))?;
    Ok(picture)
}

fn exr_file() -> Result<Vec<u8>> {
    exr::to_bytes(&picture()?, "seed")
}

fn hdr_file(scratch: &Path) -> Result<Vec<u8>> {
    let path = scratch.join("seed.hdr");
    hdr::write(&path, &picture()?)?;
    read(&path)
}

/// Floats of two triangles: positions, normals and texture coordinates one after the other, then six bytes of indices.
fn buffer() -> Vec<u8> {
    let positions: [f32; 12] = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 1.0, 1.0, 0.0, 0.0, 1.0, 0.25];
    let normals: [f32; 12] = [0.0, 0.0, 1.0, 0.0, 0.0, 1.0, 0.0, 0.0, 1.0, 0.0, 0.0, 1.0];
    let places: [f32; 8] = [0.0, 1.0, 1.0, 1.0, 1.0, 0.0, 0.0, 0.0];
    let floats = positions.iter().chain(&normals).chain(&places);
    let mut bytes: Vec<u8> = floats.flat_map(|value| value.to_le_bytes()).collect();
    bytes.extend([0, 1, 2, 0, 2, 3, 0, 0]);
    bytes
}

/// glTF with most of what the reader knows; BUFFER, FIRST and SECOND stand for the buffer's and the images' addresses.
const GLTF: &str = r#"{
"asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0, 1, 2, 3]}],
"extensionsUsed": ["KHR_lights_punctual", "KHR_materials_ior", "KHR_texture_transform", "EXT_mesh_gpu_instancing"],
"extensions": {"KHR_lights_punctual": {"lights": [
  {"type": "point", "intensity": 5.0, "color": [1.0, 0.9, 0.8]},
  {"type": "spot", "intensity": 3.0, "spot": {"innerConeAngle": 0.2, "outerConeAngle": 0.6}}]}},
"nodes": [
  {"mesh": 0, "name": "wall", "scale": [1.0, 2.0, 1.0], "rotation": [0.0, 0.0, 0.0, 1.0], "children": [4]},
  {"camera": 0, "translation": [0.5, 0.5, 3.0]},
  {"translation": [0.0, 1.0, 2.0], "extensions": {"KHR_lights_punctual": {"light": 0}}},
  {"matrix": [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 1, 1], "extensions": {"KHR_lights_punctual": {"light": 1}}},
  {"mesh": 1, "extensions": {"EXT_mesh_gpu_instancing": {"attributes": {"TRANSLATION": 0}}}}],
"cameras": [{"type": "perspective", "perspective": {"yfov": 0.7, "znear": 0.1, "aspectRatio": 1.5}}],
"meshes": [
  {"primitives": [{"attributes": {"POSITION": 0, "NORMAL": 1, "TEXCOORD_0": 2}, "indices": 3, "material": 0, "mode": 4}]},
  {"primitives": [{"attributes": {"POSITION": 4}, "material": 1}]}],
"materials": [
  {"name": "brick", "pbrMetallicRoughness": {"baseColorFactor": [0.8, 0.5, 0.3, 1.0], "roughnessFactor": 0.4, "metallicFactor": 0.1,
    "baseColorTexture": {"index": 0, "extensions": {"KHR_texture_transform": {"offset": [0.1, 0.2], "scale": [2.0, 2.0]}}}},
   "normalTexture": {"index": 1, "scale": 0.5}, "alphaMode": "MASK", "alphaCutoff": 0.25, "doubleSided": true},
  {"name": "lamp", "emissiveFactor": [1.0, 0.5, 0.25], "extensions": {"KHR_materials_ior": {"ior": 1.4}}}],
"textures": [{"source": 0, "sampler": 0}, {"source": 1}],
"samplers": [{"magFilter": 9729, "wrapS": 33071, "wrapT": 33648}],
"images": [{"uri": "FIRST"}, {"uri": "SECOND"}],
"accessors": [
  {"bufferView": 0, "componentType": 5126, "type": "VEC3", "count": 4, "min": [0, 0, 0], "max": [1, 1, 0.25]},
  {"bufferView": 0, "byteOffset": 48, "componentType": 5126, "type": "VEC3", "count": 4},
  {"bufferView": 0, "byteOffset": 96, "componentType": 5126, "type": "VEC2", "count": 4},
  {"bufferView": 1, "componentType": 5121, "type": "SCALAR", "count": 6},
  {"bufferView": 0, "componentType": 5126, "type": "VEC3", "count": 3, "sparse": {"count": 1,
    "indices": {"bufferView": 1, "byteOffset": 1, "componentType": 5121}, "values": {"bufferView": 0, "byteOffset": 12}}}],
"bufferViews": [{"buffer": 0, "byteLength": 128}, {"buffer": 0, "byteOffset": 128, "byteLength": 6}],
"buffers": [{BUFFER "byteLength": 136}]
}
"#;

/// The document; without an address, the buffer is the binary chunk.
fn gltf_document(buffer: Option<&str>, [first, second]: [&str; 2]) -> String {
    let buffer = buffer.map_or_else(String::new, |uri| format!("\"uri\": \"{uri}\","));
    let text = GLTF.replace("BUFFER", &buffer).replace("FIRST", first);
    text.replace("SECOND", second)
}

/// Names of images beside a document.
const IMAGES: [&str; 2] = ["a.png", "b.jpg"];

fn data(kind: &str, bytes: &[u8]) -> String {
    use base64::Engine;
    let text = base64::engine::general_purpose::STANDARD.encode(bytes);
    format!("data:{kind};base64,{text}")
}

/// With files beside it, and with everything inside.
pub fn gltf(_: &Path) -> Result<Vec<Case>> {
    let inside = [data("image/png", &png()?), data("image/jpeg", &jpeg()?)];
    let whole = gltf_document(
        Some(&data("application/octet-stream", &buffer())),
        [&inside[0], &inside[1]],
    );
    Ok(vec![
        Case::of("main.gltf", gltf_document(Some("a.bin"), IMAGES))
            .with("a.bin", buffer())
            .with("a.png", png()?)
            .with("b.jpg", jpeg()?),
        Case::of("main.gltf", whole),
    ])
}

/// A binary file with the buffer as its chunk.
pub fn glb(_: &Path) -> Result<Vec<Case>> {
    let mut text = gltf_document(None, IMAGES).into_bytes();
    text.resize(text.len().next_multiple_of(4), b' ');
    let chunk = buffer();
    let total = 12 + 8 + text.len() + 8 + chunk.len();
    let mut bytes = b"glTF".to_vec();
    for word in [2, total as u32, text.len() as u32] {
        bytes.extend(word.to_le_bytes());
    }
    bytes.extend(b"JSON");
    bytes.extend(text);
    bytes.extend((chunk.len() as u32).to_le_bytes());
    bytes.extend(b"BIN\0");
    bytes.extend(chunk);
    let case = Case::of("main.glb", bytes).with_fixed("a.png", png()?);
    Ok(vec![case.with_fixed("b.jpg", jpeg()?)])
}

/// A glTF file that stays, with images that do not.
pub fn textures(_: &Path) -> Result<Vec<Case>> {
    let case = Case::default().with_fixed("main.gltf", gltf_document(Some("a.bin"), IMAGES));
    let case = case.with_fixed("a.bin", buffer()).with("a.png", png()?);
    Ok(vec![case.with("b.jpg", jpeg()?)])
}

const OBJ: &str = "\
mtllib a.mtl
o box
v 0 0 0
v 1 0 0
v 1 1 0
v 0 1 0.5
vn 0 0 1
vt 0 0
vt 1 1
usemtl red
f 1/1/1 2/2/1 3/1/1 4/2/1
g back
usemtl lamp
s off
f -4 -3 -2
f 1 3 4
";
const MTL: &str = "\
newmtl red
Kd 0.8 0.1 0.1
Ks 0 0 0
illum 2
newmtl lamp
Ke 4 4 3
Kd 0 0 0
d 1
map_Kd a.png
";

/// With its library of materials.
pub fn obj(_: &Path) -> Result<Vec<Case>> {
    Ok(vec![
        Case::of("main.obj", OBJ).with("a.mtl", MTL).with_fixed("a.png", png()?),
    ])
}

/// As text, and as numbers of both orders of bytes.
pub fn ply(_: &Path) -> Result<Vec<Case>> {
    let vertices: [[f32; 6]; 4] = [
        [0.0, 0.0, 0.0, 0.0, 0.0, 1.0],
        [1.0, 0.0, 0.0, 0.0, 0.0, 1.0],
        [1.0, 1.0, 0.0, 0.0, 0.0, 1.0],
        [0.0, 1.0, 0.5, 0.0, 0.0, 1.0],
    ];
    let faces: [&[i32]; 2] = [&[0, 1, 2], &[0, 1, 2, 3]];
    let head = |format: &str| {
        let axes = ["x", "y", "z", "nx", "ny", "nz"].map(|axis| format!("property float {axis}\n"));
        format!(
            "ply\nformat {format} 1.0\ncomment made here\nelement vertex 4\n{}property uchar red\nproperty uchar green\nproperty uchar blue\nelement face 2\n\
             property list uchar int vertex_indices\nend_header\n",
            axes.concat()
        )
    };
    let mut text = head("ascii");
    for vertex in &vertices {
        text += &format!("{} 200 100 50\n", vertex.map(|value| value.to_string()).join(" "));
    }
    for face in faces {
        let indices: Vec<String> = face.iter().map(i32::to_string).collect();
        text += &format!("{} {}\n", face.len(), indices.join(" "));
    }
    let mut cases = vec![Case::of("main.ply", text)];
    for (format, big_endian) in [("binary_little_endian", false), ("binary_big_endian", true)] {
        let word = |bits: u32| {
            if big_endian {
                bits.to_be_bytes()
            } else {
                bits.to_le_bytes()
            }
        };
        let mut bytes = head(format).into_bytes();
        for vertex in &vertices {
            bytes.extend(vertex.iter().flat_map(|value| word(value.to_bits())));
            bytes.extend([200, 100, 50]);
        }
        for face in faces {
            bytes.push(face.len() as u8);
            bytes.extend(face.iter().flat_map(|index| word(*index as u32)));
        }
        cases.push(Case::of("main.ply", bytes));
    }
    cases.push(Case::of(
        "main.ply",
        "ply\nformat ascii 1.0\nelement vertex 4\nproperty double x\nproperty double y\nproperty double z\nelement tristrips 1\n\
         property list int int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n1 1 1e-3\n5 0 1 2 -1 3\n",
    ));
    Ok(cases)
}

const SIDECAR: &str = "\
file = \"a.obj\"
exposure = 0.5
technique = \"path\"
aspect = 1.5

[environment]
color = [1.0, 0.9, 0.8]
rotation = 90.0
strength = 2.0

[metals]
red = { eta = [1.4, 0.9, 0.7], k = [7.6, 6.4, 5.6] }
lamp = { reflectance = [0.9, 0.7, 0.4], edge_tint = [0.8, 0.6, 0.5], fresnel = \"simplified\" }

[[cameras]]
name = \"main\"
eye = [0.5, 1.0, 4.0]
target = [0.5, 0.5, 0.0]
up = [0.0, 1.0, 0.0]
fov = 40.0
aperture = 0.01
focus = 4.0

[[medium]]
sigma_a = 0.01
sigma_s = [0.10, 0.12, 0.15]
phase = \"hg\"
g = 0.5
";
const MEDIA: &str = "\
file = \"builtin:slab\"

[[medium]]
name = \"smoke\"
sigma_t = 20.0
albedo = [0.9, 0.9, 0.9]
emission = 0.1
phase = \"schlick\"
k = 0.3
density = { generate = \"ball\", size = [4, 5, 6], seed = 7, factor = 2.0, low = [-1, 0, -1], high = [1, 2, 1], rotate = [0, 30, 0], scale = 0.5, translate = [0, 1, 0] }
";

/// Given as the scene, and beside a model.
pub fn sidecars(_: &Path) -> Result<Vec<Case>> {
    let phong = "[phong]\nred = { exponent = 50.0, share = 0.4 }\n[metals]\nlamp = \"gold\"\n";
    Ok(vec![
        Case::of("main.toml", SIDECAR)
            .with_fixed("a.obj", OBJ)
            .with_fixed("a.mtl", MTL),
        Case::of("main.toml", MEDIA),
        Case::default()
            .with_fixed("main.obj", OBJ)
            .with_fixed("a.mtl", MTL)
            .with("main.scene.toml", phong),
    ])
}

/// OpenEXR and Radiance HDR as surroundings of light.
pub fn environments(scratch: &Path) -> Result<Vec<Case>> {
    let sidecar = |name: &str| format!("file = \"builtin:slab\"\n[environment]\nfile = \"{name}\"\nstrength = 2.0\n");
    Ok(vec![
        Case::default()
            .with_fixed("main.toml", sidecar("a.exr"))
            .with("a.exr", exr_file()?),
        Case::default()
            .with_fixed("main.toml", sidecar("a.hdr"))
            .with("a.hdr", hdr_file(scratch)?),
    ])
}

/// Grids of densities in files that know their size, and in files that do not.
pub fn grids(_: &Path) -> Result<Vec<Case>> {
    let grid = DensityGrid::from_fn([3, 4, 5], |place| place.x as f32);
    let floats: Vec<u8> = grid.values.iter().flat_map(|value| value.to_be_bytes()).collect();
    let sidecar = |density: &str| {
        format!(
            "file = \"builtin:slab\"\n[[medium]]\nsigma_a = 0.5\nsigma_s = [1.0, 2.0, 3.0]\ndensity = {{ {density} }}\n"
        )
    };
    let raw = sidecar(
        "file = \"a.raw\", size = [3, 4, 5], type = \"float32\", endian = \"big\", offset = 0, low = [0, 0, 0], high = [2, 2, 1]",
    );
    Ok(vec![
        Case::of("main.toml", sidecar("file = \"a.vol\", factor = 0.5"))
            .with("a.vol", vol::to_bytes(&grid, &[1.0], DVec3::ZERO, DVec3::ONE)),
        Case::of("main.toml", raw).with("a.raw", floats),
    ])
}

/// Pictures of the engine's own.
pub fn exr_pictures(_: &Path) -> Result<Vec<Case>> {
    Ok(vec![Case::of("main.exr", exr_file()?)])
}

/// Pictures of the engine's own.
pub fn hdr_pictures(scratch: &Path) -> Result<Vec<Case>> {
    Ok(vec![Case::of("main.hdr", hdr_file(scratch)?)])
}

/// The defaults and the variants of all techniques.
pub fn settings(_: &Path) -> Result<Vec<Case>> {
    let of = |card: &techniques::Card| {
        let variants = card.variants.iter().map(|variant| (variant.settings)());
        let all: Vec<_> = variants.chain([card.settings.defaults()]).collect();
        let case = |json: serde_json::Value| Case::of(&format!("{}.json", card.id), json.to_string());
        all.into_iter().map(case).collect::<Vec<_>>()
    };
    Ok(techniques::all().iter().flat_map(of).collect())
}

/// Words, ranges and expressions.
pub fn path_sets(_: &Path) -> Result<Vec<Case>> {
    let texts = [
        "all",
        "none",
        "direct,lobes=diffuse+glossy+reflection",
        "bounces=1..4,lobes=specular+volume+transmission",
        "indirect,bounces=2..",
        "LDE",
        "L(D|S)+E",
        "!L.*S.*E",
        "ES{1,2}DL|ED+L",
        "L[DrGt]{2,5}E",
    ];
    Ok(texts.map(|text| Case::of("main.txt", text)).into())
}

/// Triangles of the tree that is kept.
pub fn kd_triangles() -> Vec<[Vec3; 3]> {
    let corner = |i: u32| Vec3::new((i % 3) as f32, (i / 3 % 3) as f32, (i / 9) as f32);
    let triangle = |i: u32| {
        [
            corner(i),
            corner(i) + 0.5 * Vec3::X,
            corner(i) + Vec3::new(0.1, 0.4, 0.3),
        ]
    };
    (0..27).map(triangle).collect()
}

/// The file of a tree that is kept.
pub fn kd_caches(scratch: &Path) -> Result<Vec<Case>> {
    let kept = KdTree::kept(&kd_triangles(), &KdSettings::default(), scratch)?;
    let name = kept.path.file_name().unwrap_or_default().to_string_lossy().into_owned();
    Ok(vec![Case::of(&name, read(&kept.path)?)])
}

/// The file that a device leaves behind.
pub fn pipeline_caches(scratch: &Path) -> Result<Vec<Case>> {
    let folder = scratch.join("pipelines");
    drop(Gpu::headless(&GpuOptions {
        cache_folder: Some(folder.clone()),
        ..GpuOptions::default()
    })?);
    let mut cases = Vec::new();
    // Without a file the device keeps none.
    for entry in std::fs::read_dir(&folder).into_iter().flatten().flatten() {
        let name = entry.file_name().to_string_lossy().into_owned();
        cases.push(Case::of(&name, read(&entry.path())?));
    }
    Ok(cases)
}
