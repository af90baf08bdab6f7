//! Scenes that name too much: one file again and again, devices, files outside a folder, pictures larger than their bytes can hold. What is
//! asserted are the reader's own counts, never a time.

use std::io;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use clerestory::Error;
use clerestory::input::{Folder, InputFile, InputLimits, Memory, Resolver};
use clerestory::scene::{self, LoadOptions, Loaded};
use serde_json::{Value, json};

const TRIANGLE: &str = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";

/// Files in memory that count how often they are read, and their bytes.
#[derive(Default)]
struct Counting {
    memory: Memory,
    reads: AtomicU64,
    bytes: AtomicU64,
}

impl Resolver for Counting {
    fn find(&self, path: &Path) -> io::Result<PathBuf> {
        self.memory.find(path)
    }

    fn read(&self, file: &Path, most: u64) -> io::Result<Arc<Vec<u8>>> {
        let bytes = self.memory.read(file, most)?;
        self.reads.fetch_add(1, Ordering::Relaxed);
        self.bytes.fetch_add(bytes.len() as u64, Ordering::Relaxed);
        Ok(bytes)
    }
}

/// Loads `name` from files in memory; the reads and the bytes read come with it.
fn load(files: Memory, name: &str, limits: InputLimits) -> (Result<Loaded, Error>, u64, u64) {
    let counting = Arc::new(Counting {
        memory: files,
        ..Counting::default()
    });
    let options = LoadOptions {
        resolver: counting.clone(),
        limits,
    };
    let loaded = scene::load_with(name, &options);
    let count = |counter: &AtomicU64| counter.load(Ordering::Relaxed);
    (loaded, count(&counting.reads), count(&counting.bytes))
}

fn refusal(files: Memory, name: &str) -> String {
    load(files, name, InputLimits::default())
        .0
        .expect_err("must be refused")
        .to_string()
}

/// A triangle whose positions are in the first of the buffers; each image has a material of its own.
fn gltf(buffers: &[String], images: &[String]) -> Value {
    fn list(names: &[String], of: fn(&str, usize) -> Value) -> Vec<Value> {
        names.iter().enumerate().map(|(i, name)| of(name, i)).collect()
    }
    json!({
        "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
        "accessors": [{"bufferView": 0, "componentType": 5126, "type": "VEC3", "count": 3}],
        "bufferViews": [{"buffer": 0, "byteLength": 36}],
        "buffers": list(buffers, |name, _| json!({"byteLength": 36, "uri": name})),
        "images": list(images, |name, _| json!({"uri": name})),
        "textures": list(images, |_, i| json!({"source": i})),
        "materials": list(images, |_, i| json!({"pbrMetallicRoughness": {"baseColorTexture": {"index": i}}}))
    })
}

fn positions() -> Vec<u8> {
    let values = [0.0f32, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0];
    values.iter().flat_map(|value| value.to_le_bytes()).collect()
}

fn png(side: u32) -> Vec<u8> {
    let mut bytes = Vec::new();
    let picture = image::RgbImage::from_pixel(side, side, image::Rgb([1, 2, 3]));
    let written = picture.write_to(&mut io::Cursor::new(&mut bytes), image::ImageFormat::Png);
    written.expect("PNG");
    bytes
}

#[test]
fn a_file_that_everything_names_is_read_once() {
    let names: Vec<String> = (0..1000)
        .map(|i| format!("{}all.bin", ["", "./", "x/../"][i % 3]))
        .collect();
    let pictures: Vec<String> = (0..200)
        .map(|i| format!("{}all.png", ["", "./", "x/../"][i % 3]))
        .collect();
    let model = gltf(&names, &pictures).to_string();
    let picture = png(64);
    let lengths = [model.len(), 36, picture.len()].map(|length| length as u64);
    let mut files = Memory::default();
    files
        .add("m.gltf", model)
        .add("all.bin", positions())
        .add("all.png", picture);
    let (loaded, reads, bytes) = load(files, "m.gltf", InputLimits::default());
    let loaded = loaded.expect("scene");
    assert_eq!((reads, bytes), (3, lengths.iter().sum::<u64>()));
    // One picture, decoded once.
    assert_eq!((loaded.scene.images.len(), loaded.scene.materials.len()), (1, 200));
    assert_eq!(loaded.bytes_decoded, 4 * 64 * 64);
    let expected = [("m.gltf", lengths[0]), ("all.bin", 36), ("all.png", lengths[2])];
    let expected = expected.map(|(path, bytes)| InputFile {
        path: path.into(),
        bytes,
    });
    assert_eq!(loaded.files, expected);
}

#[test]
fn a_material_library_that_every_line_names_is_read_once() {
    let mut files = Memory::default();
    files
        .add(
            "m.obj",
            format!("{}{TRIANGLE}", "mtllib m.mtl\nmtllib ./m.mtl\n".repeat(1000)),
        )
        .add("m.mtl", "newmtl a\nKd 1 1 1\n".repeat(100));
    let (loaded, reads, _) = load(files, "m.obj", InputLimits::default());
    let scene = loaded.expect("scene").scene;
    // Those of the library and the default one.
    assert_eq!((reads, scene.materials.len()), (2, 101));
}

#[test]
fn totals_are_bounded_before_anything_is_read_or_made() {
    let names = |count| (0..count).map(|i| format!("{i}.bin")).collect::<Vec<String>>();
    let model = gltf(&names(10), &[]).to_string();
    let length = model.len() as u64;
    let mut files = Memory::default();
    files.add("m.gltf", model);
    for name in names(10) {
        files.add(name, positions());
    }
    // Room for the model and five buffers.
    let limits = InputLimits {
        total: length + 5 * 36 + 35,
        ..InputLimits::default()
    };
    let (loaded, reads, bytes) = load(files.clone(), "m.gltf", limits);
    let error = loaded.expect_err("too much").to_string();
    assert!(error.contains("buffers[5].uri") && error.contains("5.bin"), "{error}");
    assert_eq!((reads, bytes), (6, length + 5 * 36));
    let limits = InputLimits {
        file: length - 1,
        ..InputLimits::default()
    };
    assert!(matches!(load(files, "m.gltf", limits), (Err(Error::Io { .. }), 0, 0)));

    // What is generated has no bytes in files: the cells are counted first.
    let media = "[[medium]]\nsigma_a = 1.0\ndensity = { generate = \"constant\", size = 1 }\n\
                 [[medium]]\nmaterial = \"default\"\nboundary = true\nsigma_a = 1.0\n\
                 density = { generate = \"constant\", size = 512 }\n";
    let mut files = Memory::default();
    files.add("m.obj", TRIANGLE).add("m.scene.toml", media);
    let error = refusal(files, "m.obj");
    assert!(error.contains("hold 134217729 cells with this one"), "{error}");

    // Grids of one file are made as often as they are named: each counts.
    let grid = "[[medium]]\nsigma_a = 1.0\nmaterial = \"default\"\nboundary = true\n\
                density = { file = \"d.raw\", size = [16, 16, 16], type = \"uint8\" }\n";
    let mut files = Memory::default();
    files
        .add("m.obj", TRIANGLE)
        .add("m.scene.toml", grid)
        .add("d.raw", [1u8; 4096]);
    let limits = |decoded_base| InputLimits {
        decoded_base,
        decoded_per_byte: 0,
        ..InputLimits::default()
    };
    let loaded = load(files.clone(), "m.obj", limits(4 * 4096)).0.expect("scene");
    assert_eq!(loaded.bytes_decoded, 4 * 4096);
    let error = load(files, "m.obj", limits(4 * 4096 - 1))
        .0
        .expect_err("small")
        .to_string();
    assert!(error.contains("takes 16384 bytes of memory"), "{error}");
}

#[test]
fn triangles_are_counted_for_each_instance() {
    let mut model = gltf(&["a.bin".into()], &[]);
    let zeros = |count| json!({"componentType": 5126, "type": "VEC3", "count": count});
    model["accessors"] = json!([zeros(3000), zeros(500)]);
    model["nodes"][0]["extensions"] = json!({"EXT_mesh_gpu_instancing": {"attributes": {"TRANSLATION": 1}}});
    let mut files = Memory::default();
    files.add("m.gltf", model.to_string()).add("a.bin", positions());
    let limits = InputLimits {
        decoded_base: 1 << 20,
        ..InputLimits::default()
    };
    // Half a million triangles of 48 bytes: meshes without an extent are copied for each instance.
    let error = load(files.clone(), "m.gltf", limits).0.expect_err("24 MB").to_string();
    assert!(error.contains("instances of meshes that are placed before"), "{error}");
    let loaded = load(files, "m.gltf", InputLimits::default()).0.expect("scene");
    assert_eq!(loaded.scene.instances.len(), 500);
}

#[test]
fn pictures_that_promise_more_than_their_bytes_can_hold_are_refused() {
    let mut jpeg = Vec::new();
    let picture = image::RgbImage::from_pixel(8, 8, image::Rgb([1, 2, 3]));
    let written = picture.write_to(&mut io::Cursor::new(&mut jpeg), image::ImageFormat::Jpeg);
    written.expect("JPEG");
    let frame = jpeg
        .windows(2)
        .position(|window| window == [0xFF, 0xC0])
        .expect("frame");
    let with_size = |side: u16| {
        let mut jpeg = jpeg.clone();
        jpeg[frame + 5..frame + 7].copy_from_slice(&side.to_be_bytes());
        jpeg[frame + 7..frame + 9].copy_from_slice(&side.to_be_bytes());
        let mut files = Memory::default();
        files
            .add("m.gltf", gltf(&["a.bin".into()], &["a.jpg".into()]).to_string())
            .add("a.bin", positions())
            .add("a.jpg", jpeg);
        files
    };
    let small = load(with_size(8), "m.gltf", InputLimits::default()).0.expect("scene");
    assert_eq!(small.bytes_decoded, 4 * 64);
    for (side, words) in [(10_000, "bytes of memory"), (18_000, "texels")] {
        let error = refusal(with_size(side), "m.gltf");
        assert!(error.contains("images[0]") && error.contains(words), "{error}");
    }

    let sky = |name: &str, bytes: Vec<u8>| {
        let mut files = Memory::default();
        files
            .add("m.obj", TRIANGLE)
            .add("m.scene.toml", format!("[environment]\nfile = \"{name}\"\n"))
            .add(name, bytes);
        files
    };
    let hdr = b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 8192 +X 8192\n";
    let error = refusal(sky("sky.hdr", hdr.to_vec()), "m.obj");
    assert!(
        error.contains("environment.file") && error.contains("bytes of memory"),
        "{error}"
    );

    let folder = tempfile::tempdir().expect("folder");
    let path = folder.path().join("sky.exr");
    exr::prelude::write_rgb_file(&path, 4, 2, |_, _| (1.0f32, 1.0f32, 1.0f32)).expect("EXR");
    let mut bytes = std::fs::read(&path).expect("file");
    let whole = load(sky("sky.exr", bytes.clone()), "m.obj", InputLimits::default())
        .0
        .expect("scene");
    assert_eq!(whole.bytes_decoded, 8 * 12);
    for name in [&b"dataWindow\0box2i\0"[..], b"displayWindow\0box2i\0"] {
        let place = bytes
            .windows(name.len())
            .position(|window| window == name)
            .expect("attribute");
        let corner = place + name.len() + 4 + 8;
        bytes[corner..corner + 4].copy_from_slice(&7_999i32.to_le_bytes());
        bytes[corner + 4..corner + 8].copy_from_slice(&7_999i32.to_le_bytes());
    }
    let error = refusal(sky("sky.exr", bytes), "m.obj");
    assert!(
        error.contains("environment.file") && error.contains("bytes of memory"),
        "{error}"
    );
}

#[test]
fn a_hundred_thousand_names_are_noted_once_each() {
    const COUNT: usize = 100_000;
    let mut model = gltf(&["a.bin".into()], &[]);
    model["extensionsUsed"] = (0..COUNT).map(|i| format!("EXT_{i}")).collect();
    let mut files = Memory::default();
    files.add("m.gltf", model.to_string()).add("a.bin", positions());
    let loaded = load(files, "m.gltf", InputLimits::default()).0.expect("scene");
    let noted = loaded
        .scene
        .notes
        .iter()
        .filter(|note| note.feature.starts_with("EXT_"));
    assert_eq!(noted.count(), COUNT);
}

#[test]
fn a_sidecar_of_many_names_finds_each() {
    const COUNT: usize = 3000;
    let library: String = (0..COUNT).map(|i| format!("newmtl m{i}\nKd 1 1 1\n")).collect();
    let metals: String = (0..COUNT).map(|i| format!("m{i} = \"gold\"\n")).collect();
    let cameras: String = (0..COUNT)
        .map(|i| {
            format!(
                "[[cameras]]\nname = \"c{}\"\neye = [0, 0, {i}.5]\ntarget = [0, 0, -1]\n",
                i / 2
            )
        })
        .collect();
    let mut files = Memory::default();
    files
        .add("m.obj", format!("mtllib m.mtl\n{TRIANGLE}"))
        .add("m.mtl", library)
        .add("m.scene.toml", format!("[metals]\n{metals}{cameras}"));
    let scene = load(files, "m.obj", InputLimits::default()).0.expect("scene").scene;
    let metals = scene.materials.iter().filter(|material| material.conductor.is_some());
    assert_eq!((metals.count(), scene.cameras.len()), (COUNT, COUNT / 2));
    assert_eq!(scene.cameras[7].transform.translation.z, 15.5);
}

#[test]
#[cfg(unix)]
fn devices_and_pipes_are_refused_wherever_a_scene_names_them() {
    let folder = tempfile::tempdir().expect("folder");
    let write = |name: &str, text: &str| std::fs::write(folder.path().join(name), text).expect("file");
    let load = |name: &str| scene::load(&folder.path().join(name).display().to_string());
    let pipe = folder.path().join("pipe");
    let made = std::process::Command::new("mkfifo")
        .arg(&pipe)
        .status()
        .expect("mkfifo");
    assert!(made.success());
    std::fs::write(folder.path().join("a.bin"), positions()).expect("file");
    for name in ["/dev/zero", "pipe"] {
        let refused = |model: &str| {
            let error = load(model).expect_err(name).to_string();
            assert!(error.contains("not a regular file"), "{name}: {error}");
        };
        let own = |file: &str| vec![file.to_owned()];
        write("m.gltf", &gltf(&own(name), &[]).to_string());
        refused("m.gltf");
        write("m.gltf", &gltf(&own("a.bin"), &own(name)).to_string());
        refused("m.gltf");
        write("m.obj", TRIANGLE);
        for sidecar in [
            format!("[environment]\nfile = \"{name}\"\n"),
            format!("[medium]\nsigma_a = 1.0\ndensity = {{ file = \"{name}\", size = 2 }}\n"),
        ] {
            write("m.scene.toml", &sidecar);
            refused("m.obj");
        }
        std::fs::remove_file(folder.path().join("m.scene.toml")).expect("file");
        write("m.obj", &format!("mtllib {name}\n{TRIANGLE}"));
        let scene = load("m.obj").expect("scene");
        let note = scene
            .notes
            .iter()
            .find(|note| note.at.starts_with("mtllib"))
            .expect("note");
        assert!(note.feature.contains("not a regular file"), "{}", note.feature);
        let link = folder.path().join("linked.ply");
        std::os::unix::fs::symlink(name, &link).expect("link");
        refused("linked.ply");
        std::fs::remove_file(&link).expect("link");
    }
    write("m.obj", TRIANGLE);
    std::fs::rename(&pipe, folder.path().join("m.scene.toml")).expect("pipe");
    assert!(
        load("m.obj")
            .expect_err("a pipe beside")
            .to_string()
            .contains("not a regular file")
    );
}

#[test]
fn a_scene_in_a_folder_reads_nothing_outside() {
    let outside = tempfile::tempdir().expect("folder");
    let root = outside.path().join("scenes");
    std::fs::create_dir(&root).expect("folder");
    std::fs::write(outside.path().join("secret.bin"), positions()).expect("file");
    std::fs::write(root.join("own.bin"), positions()).expect("file");
    let absolute = outside.path().join("secret.bin").display().to_string();
    let options = LoadOptions {
        resolver: Arc::new(Folder::new(&root).expect("folder")),
        ..LoadOptions::default()
    };
    let write = |name: &str| {
        std::fs::write(root.join("m.gltf"), gltf(&[name.to_owned()], &[]).to_string()).expect("file");
    };
    write("own.bin");
    let loaded = scene::load_with("m.gltf", &options).expect("scene");
    let names: Vec<_> = loaded.files.iter().filter_map(|file| file.path.file_name()).collect();
    assert_eq!(names, ["m.gltf", "own.bin"]);
    for name in ["../secret.bin", "../scenes/../secret.bin", &absolute] {
        write(name);
        let error = scene::load_with("m.gltf", &options).expect_err(name).to_string();
        assert!(error.contains("outside the folder"), "{name}: {error}");
        // The default follows every path: the file is listed.
        let path = root.join("m.gltf").display().to_string();
        let loaded = scene::load_with(&path, &LoadOptions::default()).expect("scene");
        assert!(loaded.files[1].path.ends_with("secret.bin"), "{:?}", loaded.files);
    }
    #[cfg(unix)]
    {
        std::os::unix::fs::symlink("../secret.bin", root.join("link.bin")).expect("link");
        write("link.bin");
        let error = scene::load_with("m.gltf", &options).expect_err("link").to_string();
        assert!(error.contains("outside the folder"), "{error}");
    }
}
