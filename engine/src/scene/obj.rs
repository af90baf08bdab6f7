//! Wavefront OBJ: positions, normals, texture coordinates and faces, with the Kd and Ke of `.mtl` files.
//!
//! Read by the crate `tobj`, libraries by `mtl.rs`; polygons are cut into fans. Materials are Lambert with their Kd, and emit their Ke; everything else an
//! `.mtl` says is reported, and so are free-form curves and surfaces. Texts that are not UTF-8 (names in older encodings) are read as far as they are;
//! what older exporters write that the crate does not take is made plain before. A library that is named again changes nothing: it is read once, and
//! its materials exist once.

use std::cell::RefCell;
use std::collections::HashSet;
use std::io::Cursor;
use std::path::Path;
use std::sync::Arc;

use glam::{Vec2, Vec3};

use super::mtl::{self, LibraryMaterial};
use super::{Material, Mesh, Note, Scene, files, shortened};
use crate::input::InputFiles;
use crate::{Error, Result};

/// Reflectance of what has no material of its own.
const GREY: Vec3 = Vec3::splat(0.6);

/// Reads an OBJ file and the material libraries beside it.
pub(super) fn load(path: &Path, read: &InputFiles<'_>) -> Result<Scene> {
    let bytes = files::read(path, read)?;
    let folder = path.parent().unwrap_or(Path::new(""));
    let mut scene = parse(&bytes, &path.display().to_string(), folder, read)?;
    scene.name = files::stem(path);
    Ok(scene)
}

/// The libraries of one model, each read at its first use.
struct Libraries<'r> {
    folder: &'r Path,
    read: &'r InputFiles<'r>,
    /// Names that were met.
    names: HashSet<Box<Path>>,
    /// Where the bytes of those lie that were read: one file may have many names.
    files: HashSet<*const Vec<u8>>,
    materials: Vec<LibraryMaterial>,
    /// Names of those that cannot be read, and why.
    unread: Vec<(String, String)>,
}

impl Libraries<'_> {
    /// The materials that a library adds: none when it has been met before, or cannot be read.
    fn add(&mut self, name: &Path) -> &[LibraryMaterial] {
        let known = self.materials.len();
        if self.names.insert(name.into())
            && let Err(cause) = self.parse(name)
        {
            self.unread.push((name.display().to_string(), cause));
        }
        &self.materials[known..]
    }

    fn parse(&mut self, name: &Path) -> Result<(), String> {
        let bytes = self
            .read
            .read(&self.folder.join(name))
            .map_err(|cause| cause.to_string())?;
        if !self.files.insert(Arc::as_ptr(&bytes)) {
            return Ok(());
        }
        let materials = mtl::parse(&String::from_utf8_lossy(&bytes))?;
        let each = size_of::<LibraryMaterial>() + size_of::<tobj::Material>() + size_of::<Material>();
        let memory = materials.len() as u64 * each as u64;
        self.read.reserve(memory, memory)?;
        self.materials.extend(materials);
        Ok(())
    }
}

fn parse(bytes: &[u8], source: &str, folder: &Path, read: &InputFiles<'_>) -> Result<Scene> {
    let at_line = |(line, cause): (usize, String)| Error::scene(source, format!("line {line}"), cause);
    let text = plain(bytes).map_err(at_line)?;
    check_indices(&text).map_err(at_line)?;
    let names = copied_names(&text);
    let counted = read.reserve(names, names);
    counted.map_err(|cause| Error::scene(source, "names of objects", cause))?;
    let options = tobj::LoadOptions {
        single_index: true,
        triangulate: true,
        ignore_points: true,
        ignore_lines: true,
    };
    let mut scene = Scene {
        source: source.into(),
        ..Scene::default()
    };
    let libraries = RefCell::new(Libraries {
        folder,
        read,
        names: HashSet::new(),
        files: HashSet::new(),
        materials: Vec::new(),
        unread: Vec::new(),
    });
    let loaded = tobj::load_obj_buf(&mut Cursor::new(text.as_bytes()), &options, |name| {
        let named = |material: &LibraryMaterial| tobj::Material {
            name: material.name.clone(),
            ..tobj::Material::default()
        };
        let all: Vec<tobj::Material> = libraries.borrow_mut().add(name).iter().map(named).collect();
        let indices = all.iter().enumerate().map(|(i, material)| (material.name.clone(), i));
        let indices = indices.collect();
        Ok((all, indices))
    });
    let (models, _) = loaded.map_err(|error| Error::scene(source, "content", error.to_string()))?;
    if let Some(number) = (text.lines()).position(|line| FREE_FORM.contains(&key_of(line))) {
        scene.notes.push(Note {
            feature: "free-form curves and surfaces".into(),
            at: format!("line {}", number + 1),
            instead: "left out".into(),
        });
    }
    let Libraries { materials, unread, .. } = libraries.into_inner();
    for (name, cause) in unread {
        scene.notes.push(Note {
            feature: format!("material library that cannot be read: {cause}"),
            at: format!("mtllib {name}"),
            instead: "its materials are grey".into(),
        });
    }
    for material in &materials {
        add_material(&mut scene, material);
    }
    let grey = scene.add_material(Material::lambert("default", GREY));
    for model in models {
        let name = model.name;
        let noted = format!("object {:?}", shortened(&name));
        let mesh = model.mesh;
        if mesh.indices.is_empty() {
            continue;
        }
        let vectors = |values: &[f32]| values.as_chunks::<3>().0.iter().map(|v| Vec3::from_array(*v)).collect();
        let mut normals: Vec<Vec3> = vectors(&mesh.normals);
        for normal in &mut normals {
            *normal = if normal.is_finite() {
                normal.normalize_or(Vec3::Y)
            } else {
                Vec3::Y
            };
        }
        let positions: Vec<Vec3> = vectors(&mesh.positions);
        let mut uv0: Vec<Vec2> = (mesh.texcoords.as_chunks::<2>().0.iter())
            // OBJ's v grows upwards.
            .map(|[u, v]| Vec2::new(*u, 1.0 - v))
            .map(|uv| if uv.is_finite() { uv } else { Vec2::ZERO })
            .collect();
        for (what, count) in [("normals", normals.len()), ("texture coordinates", uv0.len())] {
            if count != 0 && count != positions.len() {
                scene.notes.push(Note {
                    feature: format!("{what} at some corners only"),
                    at: noted.clone(),
                    instead: "left out".into(),
                });
            }
        }
        if !mesh.vertex_color.is_empty() {
            scene.notes.push(Note {
                feature: "vertex colours".into(),
                at: noted,
                instead: "left out".into(),
            });
        }
        if normals.len() != positions.len() {
            normals.clear();
        }
        if uv0.len() != positions.len() {
            uv0.clear();
        }
        let material = mesh
            .material_id
            .filter(|&i| i < materials.len())
            .map_or(grey, |i| i as u32);
        scene.place(Mesh {
            name,
            positions,
            normals,
            uv0,
            triangles: mesh.indices.as_chunks::<3>().0.to_vec(),
            material: Some(material),
            ..Mesh::default()
        });
    }
    if scene.meshes.is_empty() {
        return Err(Error::scene(source, "faces", "there are none"));
    }
    scene.check()?;
    Ok(scene)
}

/// Bytes of the copies of objects' names: the crate ends a mesh at each change of material, and both it and its placement have the name.
fn copied_names(text: &str) -> u64 {
    let (mut name, mut has_faces, mut bytes) = (0, false, 0);
    // Behind the last line a mesh ends, too.
    for line in text.lines().chain(["o"]) {
        let line = line.trim();
        match key_of(line) {
            "f" => has_faces = true,
            key @ ("o" | "g" | "usemtl") => {
                if std::mem::take(&mut has_faces) {
                    bytes += 2 * name;
                }
                if key != "usemtl" {
                    name = line[key.len()..].trim().len() as u64;
                }
            }
            _ => {}
        }
    }
    bytes
}

/// Keys of shapes that are no faces.
const FREE_FORM: [&str; 3] = ["surf", "curv", "curv2"];

fn key_of(line: &str) -> &str {
    line.split_ascii_whitespace().next().unwrap_or("")
}

/// The text line by line as the crate takes it, each line with the number it has in the file: what is not UTF-8 is replaced, in the library as
/// in the model, so that names still meet; lines that a backslash continues are one, with empty ones behind it; a mark of the encoding, line
/// ends of a carriage return alone, comments behind numbers, `fo` for `f` and Microsoft's ways to print NaN are gone.
fn plain(bytes: &[u8]) -> Result<String, (usize, String)> {
    if bytes.starts_with(b"\xFE\xFF") || bytes.starts_with(b"\xFF\xFE") {
        return Err((1, "is UTF-16; save the file as UTF-8".into()));
    }
    let text = String::from_utf8_lossy(bytes);
    let text = text.strip_prefix('\u{FEFF}').unwrap_or(&text);
    let end = if text.contains('\n') { '\n' } else { '\r' };
    let mut plain = String::with_capacity(text.len() + 1);
    let (mut whole, mut continued) = (String::new(), 0);
    for line in text.split(end) {
        let line = line.trim_ascii_end();
        // Comments may end in a folder's name.
        let is_comment = whole.is_empty() && key_of(line).starts_with('#');
        if let (Some(part), false) = (line.strip_suffix('\\'), is_comment) {
            whole += part;
            whole.push(' ');
            continued += 1;
            continue;
        }
        whole += line;
        push_plain(&mut plain, &whole);
        plain.extend(std::iter::repeat_n('\n', continued + 1));
        whole.clear();
        continued = 0;
    }
    push_plain(&mut plain, &whole);
    Ok(plain)
}

fn push_plain(plain: &mut String, line: &str) {
    let key = match key_of(line) {
        "fo" => "f",
        key => key,
    };
    if !["v", "vt", "vn", "f"].contains(&key) {
        *plain += line;
        return;
    }
    *plain += key;
    let words = line.split_ascii_whitespace().skip(1);
    for word in words.take_while(|word| !word.starts_with('#')) {
        plain.push(' ');
        *plain += if key != "f" && word.contains(".#") { "nan" } else { word };
    }
}

fn add_material(scene: &mut Scene, source: &LibraryMaterial) {
    let unit = |value: f32| if value.is_finite() { value.clamp(0.0, 1.0) } else { 0.0 };
    let diffuse = source.diffuse.unwrap_or(GREY).to_array().map(unit);
    let mut material = Material::lambert(&source.name, Vec3::from_array(diffuse));
    let usable = |emission: &Vec3| emission.is_finite() && emission.min_element() >= 0.0;
    material.emission = source.emission.filter(usable).unwrap_or(Vec3::ZERO);
    if !source.others.is_empty() {
        let keys: Vec<&str> = source.others.iter().map(String::as_str).collect();
        scene.notes.push(Note {
            feature: format!("material keys {}", keys.join(", ")),
            at: format!("newmtl {}", source.name),
            instead: "only Kd and Ke are used".into(),
        });
    }
    scene.add_material(material);
}

/// Checks faces and numbers line by line before the crate sees them, so that faults have a line.
fn check_indices(text: &str) -> Result<(), (usize, String)> {
    // Counts of v, vt, vn so far: faces may refer backwards only, by the format's rules; forwards is refused.
    let mut counts = [0i64; 3];
    for (i, line) in text.lines().enumerate() {
        let mut words = line.split_ascii_whitespace();
        let Some(key) = words.next() else {
            continue;
        };
        if let Some(slot) = ["v", "vt", "vn"].iter().position(|k| *k == key) {
            counts[slot] += 1;
            if key == "v" && !words.take(3).all(|w| w.parse::<f32>().is_ok_and(f32::is_finite)) {
                return Err((i + 1, "a position is not a finite number".into()));
            }
        } else if key == "usemtl" && words.next().is_none() {
            return Err((i + 1, "usemtl without a name".into()));
        } else if key == "f" {
            let mut corners = words.peekable();
            if corners.peek().is_none() {
                return Err((i + 1, "a face without corners".into()));
            }
            for corner in corners {
                for (part, count) in corner.split('/').zip(counts) {
                    if part.is_empty() {
                        continue;
                    }
                    let index = part
                        .parse::<i64>()
                        .map_err(|_| (i + 1, format!("{part:?} is not an index")))?;
                    if index == 0 || index > count || index < -count {
                        return Err((
                            i + 1,
                            format!("index {index} is out of range; there are {count} so far"),
                        ));
                    }
                }
            }
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use std::io::ErrorKind;
    use std::sync::atomic::{AtomicUsize, Ordering};

    use super::*;
    use crate::input::{Callback, InputLimits, Memory};

    /// A model whose libraries come from a function.
    fn parse(bytes: &[u8], source: &str, library: impl Fn(&Path) -> Option<Vec<u8>> + Send + Sync) -> Result<Scene> {
        let resolver = Callback::new(|path, _| library(path).ok_or(ErrorKind::NotFound.into()));
        let read = InputFiles::new(&resolver, InputLimits::default());
        super::parse(bytes, source, Path::new(""), &read)
    }

    const TEXT: &str = "mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 1 1\nvn 0 0 2\nusemtl red\n\
        f 1/1/1 2/2/1 3/3/1 -1/-1/-1\nusemtl lamp\nf 1//1 2//1 3//1\n";
    const MTL: &str = "newmtl red\nKd 0.8 0.1 0.1\nKs 0.5 0.5 0.5\nNs 10\nnewmtl lamp\nKd 0 0 0\nKe 3 2 1\n";

    fn read(text: &str) -> Result<Scene> {
        parse(text.as_bytes(), "a.obj", |_| Some(MTL.as_bytes().to_vec()))
    }

    #[test]
    fn faces_materials_and_coordinates_are_read() {
        let scene = read(TEXT).expect("scene");
        let triangles: usize = scene.meshes.iter().map(|m| m.triangles.len()).sum();
        assert_eq!((triangles, scene.meshes.len()), (3, 2));
        let mesh = &scene.meshes[0];
        assert_eq!(mesh.normals[0], Vec3::Z);
        assert_eq!(mesh.uv0[0], Vec2::new(0.0, 1.0));
        let material = |i: usize| &scene.materials[scene.meshes[i].material.expect("material") as usize];
        assert_eq!(material(0).base_color.truncate(), Vec3::new(0.8, 0.1, 0.1));
        assert_eq!(material(1).emission, Vec3::new(3.0, 2.0, 1.0));
        assert!(
            scene.notes.iter().any(|n| n.feature.contains("Ks")),
            "{:?}",
            scene.notes
        );
    }

    #[test]
    fn lines_of_older_exporters_are_read() {
        let expected = read(TEXT).expect("scene");
        let same = |text: &str| {
            let scene = read(text).unwrap_or_else(|error| panic!("{error}: {text:?}"));
            assert_eq!(scene.meshes.len(), expected.meshes.len(), "{text:?}");
            for (mesh, other) in scene.meshes.iter().zip(&expected.meshes) {
                assert_eq!(
                    (&mesh.positions, &mesh.triangles),
                    (&other.positions, &other.triangles),
                    "{text:?}"
                );
                assert_eq!(mesh.material, other.material, "{text:?}");
            }
        };
        same(&TEXT.replace("2/2/1 3/3/1", "2/2/1 \\\n 3/3/1"));
        same(&TEXT.replace("2/2/1 3/3/1", "2/2/1 \\\r\n\\\r\n 3/3/1"));
        same(&format!("\u{FEFF}{TEXT}"));
        same(&TEXT.replace('\n', "\r"));
        same(&TEXT.replace("v 1 1 0", "v 1 1 0 # the third"));
        same(&TEXT.replace("1//1 2//1 3//1", "1//1 2//1 3//1 # the lamp"));
        same(&TEXT.replace("f 1//1", "fo 1//1"));
        same(&TEXT.replace("mtllib", "# C:\\models\\\nmtllib"));
        let scene = read(&TEXT.replace("vn 0 0 2", "vn -1.#IND00 0 1.#QNAN")).expect("scene");
        assert_eq!(scene.meshes[0].normals[0], Vec3::Y);
        // Lines have the numbers that they have in the file.
        let text = TEXT.replace("2/2/1 3/3/1", "2/2/1 \\\n 3/3/1");
        let error = read(&text.replace("1//1 2//1 3//1", "1//1 2//1 9//1")).expect_err("fault");
        assert!(error.to_string().contains("line 14"), "{error}");
        // A library with a mark of its encoding.
        let library = format!("\u{FEFF}{MTL}").into_bytes();
        let scene = parse(TEXT.as_bytes(), "a.obj", |_| Some(library.clone())).expect("scene");
        assert!(scene.materials.iter().any(|material| material.name == "lamp"));
    }

    #[test]
    fn free_form_surfaces_are_left_out_by_name() {
        let scene = read(&format!("{TEXT}cstype bezier\ndeg 3 3\nsurf 0 1 0 1 1 2 3 4\nend\n")).expect("scene");
        let note = scene
            .notes
            .iter()
            .find(|note| note.feature.contains("free-form"))
            .expect("note");
        assert_eq!(note.at, "line 16");
    }

    #[test]
    fn faults_have_their_line() {
        let at = |text: String| read(&text).expect_err("fault").to_string();
        assert!(at(TEXT.replace("1//1 2//1 3//1", "1//1 2//1 9//1")).contains("line 13"));
        assert!(at(TEXT.replace("1//1 2//1 3//1", "1//1 2//1 0//1")).contains("line 13"));
        assert!(at(TEXT.replace("v 1 1 0", "v 1 nan 0")).contains("line 4"));
        assert!(at("v 0 0 0\n".into()).contains("faces"));
        assert!(at(TEXT.replace("f 1//1 2//1 3//1", "f")).contains("line 13"));
        assert!(at(TEXT.replace("usemtl lamp", "usemtl")).contains("line 12"));
        let utf16: Vec<u8> = std::iter::once(0xFEFF)
            .chain(TEXT.encode_utf16())
            .flat_map(u16::to_be_bytes)
            .collect();
        let error = parse(&utf16, "a.obj", |_| None).expect_err("fault").to_string();
        assert!(error.contains("UTF-16"), "{error}");
    }

    #[test]
    fn vertex_colours_are_left_out_by_name() {
        let scene = read("v 0 0 0 1 0 0\nv 1 0 0 0 1 0\nv 1 1 0 0 0 1\nf 1 2 3\n").expect("scene");
        assert!(
            scene.notes.iter().any(|note| note.feature == "vertex colours"),
            "{:?}",
            scene.notes
        );
    }

    #[test]
    fn names_in_older_encodings_meet_their_materials() {
        let latin = |text: &str| {
            text.replace("red", "r\u{e9}d")
                .chars()
                .map(|c| c as u8)
                .collect::<Vec<u8>>()
        };
        let scene = parse(&latin(TEXT), "a.obj", |_| Some(latin(MTL))).expect("scene");
        let material = scene.meshes[0].material.expect("material") as usize;
        assert_eq!(
            scene.materials[material].base_color.truncate(),
            Vec3::new(0.8, 0.1, 0.1)
        );
    }

    #[test]
    fn cut_and_changed_files_do_not_panic() {
        let bytes = b"90-/\\ \n.e\xFF";
        for place in 0..TEXT.len() {
            let _ = read(&TEXT[..place]);
            for byte in bytes {
                let mut changed = TEXT.as_bytes().to_vec();
                changed[place] = *byte;
                let _ = parse(&changed, "a.obj", |_| Some(MTL.as_bytes().to_vec()));
            }
        }
        for place in 0..MTL.len() {
            for byte in bytes {
                let mut changed = MTL.as_bytes().to_vec();
                changed[place] = *byte;
                let _ = parse(TEXT.as_bytes(), "a.obj", |_| Some(changed.clone()));
            }
        }
    }

    #[test]
    fn a_library_named_again_is_read_once_and_adds_nothing() {
        let names = "mtllib a.mtl\nmtllib ./a.mtl\nmtllib x/../a.mtl\nmtllib none.mtl\n".repeat(500);
        let count = AtomicUsize::new(0);
        let library = |path: &Path| {
            count.fetch_add(1, Ordering::Relaxed);
            (path == Path::new("a.mtl")).then(|| MTL.as_bytes().to_vec())
        };
        let scene = parse(format!("{names}{TEXT}").as_bytes(), "a.obj", library).expect("scene");
        assert_eq!(count.load(Ordering::Relaxed), 2, "the library and the missing one");
        let names: Vec<&str> = scene.materials.iter().map(|material| material.name.as_str()).collect();
        assert_eq!(names, ["red", "lamp", "default"]);
        let unread = scene.notes.iter().filter(|note| note.at == "mtllib none.mtl");
        assert_eq!(unread.count(), 1);
    }

    #[test]
    fn materials_are_counted_before_they_are_made() {
        let mut memory = Memory::default();
        memory.add("a.mtl", "newmtl a\n".repeat(1000));
        let limits = InputLimits {
            decoded_base: 0,
            decoded_per_byte: 1,
            ..InputLimits::default()
        };
        let read = InputFiles::new(&memory, limits);
        let scene = super::parse(TEXT.as_bytes(), "a.obj", Path::new(""), &read).expect("scene");
        assert_eq!((scene.materials.len(), read.bytes_decoded()), (1, 0));
        let note = scene.notes.iter().find(|note| note.at == "mtllib a.mtl").expect("note");
        assert!(note.feature.contains("bytes of memory"), "{}", note.feature);
    }

    #[test]
    fn names_of_objects_are_counted_for_each_change_of_material() {
        let changes = "usemtl red\nf 1 2 3\nusemtl lamp\nf 1 2 3\n".repeat(100);
        let model = |name: &str| format!("mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 1 1 0\no {name}\n{changes}");
        let mut memory = Memory::default();
        memory.add("a.mtl", MTL);
        let limits = InputLimits {
            decoded_base: 100_000,
            decoded_per_byte: 0,
            ..InputLimits::default()
        };
        let parse = |name: &str| {
            let read = InputFiles::new(&memory, limits);
            super::parse(model(name).as_bytes(), "a.obj", Path::new(""), &read)
        };
        assert_eq!(parse("b").expect("scene").meshes.len(), 200);
        let error = parse(&"a".repeat(1000)).expect_err("400 kB of names").to_string();
        assert!(
            error.contains("names of objects") && error.contains("bytes of memory"),
            "{error}"
        );
    }

    #[test]
    fn a_library_that_cannot_be_read_is_a_note() {
        let scene = parse(TEXT.as_bytes(), "a.obj", |_| None).expect("scene");
        assert!(scene.notes.iter().any(|n| n.at == "mtllib a.mtl"));
        let scene = parse(TEXT.as_bytes(), "a.obj", |_| Some(b"newmtl\nKd x\n".to_vec())).expect("scene");
        let note = scene.notes.iter().find(|n| n.at == "mtllib a.mtl").expect("note");
        assert!(
            note.feature.contains("line 1: a material without a name"),
            "{}",
            note.feature
        );
    }
}
