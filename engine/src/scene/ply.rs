//! The Stanford triangle format, PLY 1.0: ASCII and binary, vertices and polygonal faces.
//!
//! After G. Turk, "The PLY Polygon File Format", 1994. Read: vertex x y z, nx ny nz, u v (or s t, texture_u texture_v), red green blue (or
//! diffuse_red …); face vertex_indices (or vertex_index), cut into fans; tristrips, whose strips −1 ends. Other elements and properties are skipped;
//! those that a picture would show are noted. Own code rather than a crate, because counts in the header must not decide allocations: memory is
//! bounded by the file's size.
//!
//! Beyond the format, as older exporters write it: comments that go on in lines without the word, in any encoding; lines that end in a carriage
//! return alone; `1.#IND` for what is no number.

use std::path::Path;

use glam::{Vec2, Vec3, Vec4};

use super::{Material, Mesh, Note, Scene, files};
use crate::catalogue::{Role, Row, sources};
use crate::input::InputFiles;
use crate::srgb::linear_from_srgb;
use crate::{Error, Result};

/// Reads a PLY file as one grey mesh.
pub(super) fn load(path: &Path, read: &InputFiles<'_>) -> Result<Scene> {
    let bytes = files::read(path, read)?;
    let source = path.display().to_string();
    let mesh = parse(&bytes).map_err(|(at, cause)| Error::scene(&source, at, cause))?;
    let mut scene = Scene {
        name: files::stem(path),
        source,
        notes: notes(&bytes),
        ..Scene::default()
    };
    const GREY: Vec3 = Vec3::splat(0.6);
    let colored = !mesh.colors.is_empty();
    let material = scene.add_material(Material::lambert("default", if colored { Vec3::ONE } else { GREY }));
    scene.place(Mesh {
        name: scene.name.clone(),
        material: Some(material),
        ..mesh
    });
    scene.check()?;
    Ok(scene)
}

type Fault = (String, String);

fn fault<T>(at: impl Into<String>, cause: impl Into<String>) -> Result<T, Fault> {
    Err((at.into(), cause.into()))
}

#[derive(Clone, Copy, PartialEq)]
enum Encoding {
    Ascii,
    Little,
    Big,
}

#[derive(Clone, Copy)]
enum Scalar {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    F32,
    F64,
}

impl Scalar {
    fn named(name: &str) -> Option<Self> {
        Some(match name {
            "char" | "int8" => Self::I8,
            "uchar" | "uint8" => Self::U8,
            "short" | "int16" => Self::I16,
            "ushort" | "uint16" => Self::U16,
            "int" | "int32" => Self::I32,
            "uint" | "uint32" => Self::U32,
            "float" | "float32" => Self::F32,
            "double" | "float64" => Self::F64,
            _ => return None,
        })
    }

    fn size(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::I32 | Self::U32 | Self::F32 => 4,
            Self::F64 => 8,
        }
    }

    /// What a colour of this type is divided by.
    fn color_scale(self) -> f32 {
        match self {
            Self::U8 => 255.0,
            Self::U16 => 65535.0,
            _ => 1.0,
        }
    }
}

struct Property {
    name: String,
    kind: Scalar,
    /// For a list, the type of its length.
    list: Option<Scalar>,
}

struct Element {
    name: String,
    count: u64,
    properties: Vec<Property>,
}

/// The body of the file, read value by value.
struct Body<'a> {
    bytes: &'a [u8],
    encoding: Encoding,
}

impl Body<'_> {
    fn value(&mut self, kind: Scalar) -> Option<f64> {
        if self.encoding == Encoding::Ascii {
            let start = self.bytes.iter().position(|b| !b.is_ascii_whitespace())?;
            let rest = &self.bytes[start..];
            let end = rest.iter().position(u8::is_ascii_whitespace).unwrap_or(rest.len());
            let (word, rest) = rest.split_at(end);
            self.bytes = rest;
            let word = std::str::from_utf8(word).ok()?;
            // As Microsoft's library prints what is no number, or infinite: 1.#QNAN, -1.#IND, 1.#INF.
            return if word.contains(".#") {
                Some(f64::NAN)
            } else {
                word.parse().ok()
            };
        }
        let (bytes, rest) = self.bytes.split_at_checked(kind.size())?;
        self.bytes = rest;
        let mut buffer = [0; 8];
        buffer[..bytes.len()].copy_from_slice(bytes);
        if self.encoding == Encoding::Big {
            buffer[..bytes.len()].reverse();
        }
        let [a, b, c, d, ..] = buffer;
        Some(match kind {
            Scalar::I8 => f64::from(i8::from_le_bytes([a])),
            Scalar::U8 => f64::from(a),
            Scalar::I16 => f64::from(i16::from_le_bytes([a, b])),
            Scalar::U16 => f64::from(u16::from_le_bytes([a, b])),
            Scalar::I32 => f64::from(i32::from_le_bytes([a, b, c, d])),
            Scalar::U32 => f64::from(u32::from_le_bytes([a, b, c, d])),
            Scalar::F32 => f64::from(f32::from_le_bytes([a, b, c, d])),
            Scalar::F64 => f64::from_le_bytes(buffer),
        })
    }
}

fn parse(bytes: &[u8]) -> Result<Mesh, Fault> {
    let (encoding, elements, body) = header(bytes)?;
    let mut body = Body { bytes: body, encoding };
    let mut mesh = Mesh::default();
    for element in &elements {
        match element.name.as_str() {
            "vertex" => vertices(&mut body, element, &mut mesh)?,
            "face" => faces(&mut body, element, &mut mesh, fan)?,
            "tristrips" => faces(&mut body, element, &mut mesh, strip)?,
            _ => skip(&mut body, element)?,
        }
    }
    if let Some(i) = mesh.positions.iter().position(|p| !p.is_finite()) {
        return fault(format!("vertex {i}"), format!("{} is not finite", mesh.positions[i]));
    }
    let n = mesh.positions.len();
    if let Some(t) = mesh.triangles.iter().find(|t| t.iter().any(|&v| v as usize >= n)) {
        return fault("element face", format!("{t:?} is out of range; there are {n} vertices"));
    }
    if mesh.triangles.is_empty() {
        let names: Vec<&str> = elements.iter().map(|element| element.name.as_str()).collect();
        let cause = format!(
            "there are no triangles among the elements ({}); point clouds have no surface",
            names.join(", ")
        );
        return fault("element face", cause);
    }
    for normal in &mut mesh.normals {
        *normal = if normal.is_finite() {
            normal.normalize_or(Vec3::Y)
        } else {
            Vec3::Y
        };
    }
    for uv in mesh.uv0.iter_mut().filter(|uv| !uv.is_finite()) {
        *uv = Vec2::ZERO;
    }
    for color in mesh.colors.iter_mut().filter(|c| !c.is_finite()) {
        *color = Vec4::ONE;
    }
    Ok(mesh)
}

/// What of a file is left out though a picture would show it, where its header can be read.
fn notes(bytes: &[u8]) -> Vec<Note> {
    let Ok((_, elements, _)) = header(bytes) else {
        return Vec::new();
    };
    let mut notes = Vec::new();
    for element in elements.iter().filter(|element| element.count > 0) {
        let mut left_out = |feature: &str| {
            notes.push(Note {
                feature: feature.into(),
                at: format!("element {}", element.name),
                instead: "left out".into(),
            });
        };
        let has = |name: &str| element.properties.iter().any(|property| property.name == name);
        match element.name.as_str() {
            "vertex" | "tristrips" => {}
            "face" => {
                if has("texcoord") {
                    left_out("texture coordinates of faces");
                }
                if has("red") && has("green") && has("blue") {
                    left_out("colours of faces");
                }
            }
            _ => left_out("an element that is not known"),
        }
    }
    notes
}

fn header(bytes: &[u8]) -> Result<(Encoding, Vec<Element>, &[u8]), Fault> {
    let mut rest = bytes;
    let mut encoding = None;
    // The first line says how all of them end: where a carriage return does, a body may begin with a newline's byte.
    let end_of_line = match bytes.iter().position(|b| [b'\r', b'\n'].contains(b)) {
        Some(end) if bytes[end] == b'\r' && bytes.get(end + 1) != Some(&b'\n') => b'\r',
        _ => b'\n',
    };
    let mut in_comment = false;
    let mut elements: Vec<Element> = Vec::new();
    for number in 1.. {
        let at = format!("line {number}");
        let Some(end) = rest.iter().position(|&b| b == end_of_line) else {
            return fault(at, "the header is cut off");
        };
        let (line, tail) = rest.split_at(end);
        rest = &tail[1..];
        // Comments may be in any encoding; all else is ASCII.
        let line = String::from_utf8_lossy(line);
        let words: Vec<&str> = line.split_ascii_whitespace().collect();
        let was_in_comment = std::mem::take(&mut in_comment);
        match (number, words.as_slice()) {
            (1, ["ply"]) => {}
            (1, _) => return fault(at, "this is not a PLY file"),
            (_, ["format", name, "1.0"]) => {
                encoding = match *name {
                    "ascii" => Some(Encoding::Ascii),
                    "binary_little_endian" => Some(Encoding::Little),
                    "binary_big_endian" => Some(Encoding::Big),
                    _ => return fault(at, format!("format {name:?} is not known")),
                }
            }
            (_, ["element", name, count]) => {
                let Ok(count) = count.parse() else {
                    return fault(at, format!("{count:?} is not a count"));
                };
                elements.push(Element {
                    name: name.to_string(),
                    count,
                    properties: Vec::new(),
                });
            }
            (_, ["property", what @ ..]) => {
                let kinds = match what {
                    ["list", length, kind, name] => {
                        Scalar::named(length).map(Some).zip(Scalar::named(kind)).zip(Some(name))
                    }
                    [kind, name] => Some(None).zip(Scalar::named(kind)).zip(Some(name)),
                    _ => None,
                };
                let (Some(((list, kind), name)), Some(element)) = (kinds, elements.last_mut()) else {
                    return fault(at, format!("{line:?} is not a property"));
                };
                element.properties.push(Property {
                    name: name.to_string(),
                    kind,
                    list,
                });
            }
            (_, ["end_header"]) => break,
            (_, []) => in_comment = was_in_comment,
            (_, ["comment" | "obj_info", ..]) => in_comment = true,
            // Text that goes on. A misspelt keyword among it is found by the properties or the body that then lack their element.
            _ if was_in_comment => in_comment = true,
            _ => return fault(at, format!("{line:?} is not understood")),
        }
    }
    match encoding {
        Some(encoding) => Ok((encoding, elements, rest)),
        None => fault("header", "names no format 1.0"),
    }
}

fn cut_off<T>(element: &Element, i: u64) -> Result<T, Fault> {
    fault(format!("{} {i}", element.name), "is cut off or no number")
}

/// Refuses counts that the rest of the file cannot hold.
fn check_count(body: &Body<'_>, element: &Element) -> Result<(), Fault> {
    let least: usize = match body.encoding {
        // A digit and a separator.
        Encoding::Ascii => 2 * element.properties.len(),
        _ => element.properties.iter().map(|p| p.list.unwrap_or(p.kind).size()).sum(),
    };
    let needed = element.count.saturating_mul(least.max(1) as u64);
    if needed > body.bytes.len() as u64 + 1 {
        let cause = format!(
            "{} entries do not fit into the remaining {} bytes",
            element.count,
            body.bytes.len()
        );
        return fault(format!("element {}", element.name), cause);
    }
    Ok(())
}

fn skip(body: &mut Body<'_>, element: &Element) -> Result<(), Fault> {
    check_count(body, element)?;
    // Rows without values take nothing of the body, however many there are.
    let count = if element.properties.is_empty() {
        0
    } else {
        element.count
    };
    for i in 0..count {
        for property in &element.properties {
            skip_property(body, element, property, i)?;
        }
    }
    Ok(())
}

fn skip_property(body: &mut Body<'_>, element: &Element, property: &Property, i: u64) -> Result<(), Fault> {
    let length = match property.list {
        None => 1,
        Some(kind) => match body.value(kind) {
            Some(length) => length as u64,
            None => return cut_off(element, i),
        },
    };
    for _ in 0..length {
        if body.value(property.kind).is_none() {
            return cut_off(element, i);
        }
    }
    Ok(())
}

fn vertices(body: &mut Body<'_>, element: &Element, mesh: &mut Mesh) -> Result<(), Fault> {
    check_count(body, element)?;
    let is_number = |p: &Property, names: &[&str]| p.list.is_none() && names.contains(&p.name.as_str());
    let place = |names: &[&str]| element.properties.iter().position(|p| is_number(p, names));
    let x = [place(&["x"]), place(&["y"]), place(&["z"])];
    let n = [place(&["nx"]), place(&["ny"]), place(&["nz"])];
    let uv = [place(&["u", "s", "texture_u"]), place(&["v", "t", "texture_v"])];
    let rgb = [
        place(&["red", "diffuse_red"]),
        place(&["green", "diffuse_green"]),
        place(&["blue", "diffuse_blue"]),
    ];
    let [Some(px), Some(py), Some(pz)] = x else {
        return fault("element vertex", "has no x, y and z");
    };
    let mut row = vec![0.0f32; element.properties.len()];
    for i in 0..element.count {
        for (value, property) in row.iter_mut().zip(&element.properties) {
            if property.list.is_some() {
                skip_property(body, element, property, i)?;
                continue;
            }
            match body.value(property.kind) {
                Some(number) => *value = number as f32,
                None => return cut_off(element, i),
            }
        }
        mesh.positions.push(Vec3::new(row[px], row[py], row[pz]));
        if let [Some(a), Some(b), Some(c)] = n {
            mesh.normals.push(Vec3::new(row[a], row[b], row[c]));
        }
        if let [Some(a), Some(b)] = uv {
            // PLY's v grows upwards.
            mesh.uv0.push(Vec2::new(row[a], 1.0 - row[b]));
        }
        if let [Some(a), Some(b), Some(c)] = rgb {
            let color = [a, b, c].map(|k| linear_color(row[k] / element.properties[k].kind.color_scale()));
            mesh.colors.push(Vec3::from_array(color).extend(1.0));
        }
    }
    Ok(())
}

fn linear_color(encoded: f32) -> f32 {
    linear_from_srgb(f64::from(encoded.clamp(0.0, 1.0))) as f32
}

/// The end of a strip among its corners.
const STRIP_END: u32 = u32::MAX;

/// A polygon's triangles.
fn fan(corners: &[u32], triangles: &mut Vec<[u32; 3]>) {
    triangles.extend(corners.windows(2).skip(1).map(|pair| [corners[0], pair[0], pair[1]]));
}

/// The triangles of strips, each of which turns the other way than the one before it.
fn strip(corners: &[u32], triangles: &mut Vec<[u32; 3]>) {
    for strip in corners.split(|corner| *corner == STRIP_END) {
        let turned = |(i, t): (usize, &[u32])| {
            if i % 2 == 0 {
                [t[0], t[1], t[2]]
            } else {
                [t[1], t[0], t[2]]
            }
        };
        triangles.extend(strip.windows(3).enumerate().map(turned));
    }
}

/// Reads lists of corners, of which `cut` makes triangles.
fn faces(
    body: &mut Body<'_>,
    element: &Element,
    mesh: &mut Mesh,
    cut: fn(&[u32], &mut Vec<[u32; 3]>),
) -> Result<(), Fault> {
    let is_of_strips = element.name == "tristrips";
    check_count(body, element)?;
    let is_indices = |p: &Property| p.list.is_some() && (p.name == "vertex_indices" || p.name == "vertex_index");
    if !element.properties.iter().any(is_indices) {
        return fault(format!("element {}", element.name), "has no list vertex_indices");
    }
    let mut corners: Vec<u32> = Vec::new();
    for i in 0..element.count {
        for property in &element.properties {
            let length = match property.list {
                None => 1,
                Some(kind) => match body.value(kind) {
                    Some(length) if length >= 0.0 => length as u64,
                    _ => return cut_off(element, i),
                },
            };
            corners.clear();
            for _ in 0..length {
                match body.value(property.kind) {
                    Some(value) if is_of_strips && is_indices(property) && value == -1.0 => corners.push(STRIP_END),
                    Some(value) if !is_indices(property) || (0.0..=f64::from(u32::MAX)).contains(&value) => {
                        if is_indices(property) {
                            corners.push(value as u32);
                        }
                    }
                    Some(value) => {
                        let cause = format!("index {value} is out of range");
                        return fault(format!("{} {i}", element.name), cause);
                    }
                    None => return cut_off(element, i),
                }
            }
            if is_indices(property) {
                cut(&corners, &mut mesh.triangles);
            }
        }
    }
    Ok(())
}

/// Rows of the catalogue.
pub(crate) const ROWS: &[Row] = &[Row {
    id: "CL-MESH",
    name: "readers of PLY and OBJ",
    role: Role::Service,
    limits: "Triangles, strips and polygons cut into fans, no free-form surfaces; of .mtl files only Kd and Ke.",
    sources: &[sources::TURK_1994.whole(), sources::WAVEFRONT_OBJ.whole()],
    tests: &[
        "engine/src/scene/ply.rs::all_encodings_are_read",
        "engine/src/scene/ply.rs::every_cut_is_an_error_and_no_panic",
        "engine/src/scene/ply.rs::files_of_older_exporters_are_read",
        "engine/src/scene/obj.rs::lines_of_older_exporters_are_read",
        "engine/src/scene/obj.rs::faces_materials_and_coordinates_are_read",
    ],
    experiment: "tools/models",
    api: &["clerestory::scene::load"],
    ..Row::of(file!())
}];

#[cfg(test)]
mod tests {
    use super::*;

    const ASCII: &str = "ply\nformat ascii 1.0\ncomment made by hand\nelement vertex 4\nproperty float x\nproperty float y\n\
        property float z\nproperty uchar red\nproperty uchar green\nproperty uchar blue\nelement edge 1\nproperty int a\n\
        element face 1\nproperty list uchar int vertex_indices\nend_header\n\
        0 0 0 255 255 255\n1 0 0 255 0 0\n1 1 0 0 0 0\n0 1 0 0 0 0\n7\n4 0 1 2 3\n";

    fn binary(big: bool, count: u32) -> Vec<u8> {
        let name = if big {
            "binary_big_endian"
        } else {
            "binary_little_endian"
        };
        let mut bytes = format!(
            "ply\nformat {name} 1.0\nelement vertex {count}\nproperty double x\nproperty float y\nproperty float z\n\
             element face 1\nproperty list uchar ushort vertex_index\nend_header\n"
        )
        .into_bytes();
        let order = |mut b: Vec<u8>| {
            if big {
                b.reverse();
            }
            b
        };
        for i in 0..3u8 {
            bytes.extend(order(f64::from(i).to_le_bytes().to_vec()));
            bytes.extend(order(f32::from(i * i).to_le_bytes().to_vec()));
            bytes.extend(order(0.5f32.to_le_bytes().to_vec()));
        }
        bytes.push(3);
        for i in [0u16, 1, 2] {
            bytes.extend(order(i.to_le_bytes().to_vec()));
        }
        bytes
    }

    #[test]
    fn all_encodings_are_read() {
        let quad = parse(ASCII.as_bytes()).expect("mesh");
        assert_eq!(quad.triangles, [[0, 1, 2], [0, 2, 3]]);
        assert_eq!(quad.positions[2], Vec3::new(1.0, 1.0, 0.0));
        assert_eq!(quad.colors[1], Vec4::new(1.0, 0.0, 0.0, 1.0));
        for big in [false, true] {
            let mesh = parse(&binary(big, 3)).expect("mesh");
            assert_eq!(mesh.positions[2], Vec3::new(2.0, 4.0, 0.5));
            assert_eq!(mesh.triangles, [[0, 1, 2]]);
        }
    }

    #[test]
    fn every_cut_is_an_error_and_no_panic() {
        for bytes in [ASCII.as_bytes().to_vec(), binary(false, 3), binary(true, 3)] {
            // The last index's last digit and the newline after it may go.
            for cut in 0..bytes.len() - 2 {
                assert!(parse(&bytes[..cut]).is_err(), "{cut}");
            }
        }
    }

    #[test]
    fn changed_bytes_do_not_panic() {
        for bytes in [ASCII.as_bytes().to_vec(), binary(false, 3), binary(true, 3)] {
            for place in 0..bytes.len() {
                for byte in [0, 1, b'9', b'-', b'\n', b' ', 0x7F, 0xFF] {
                    let mut changed = bytes.clone();
                    changed[place] = byte;
                    let _ = parse(&changed);
                }
            }
        }
    }

    #[test]
    fn files_of_older_exporters_are_read() {
        let quad = parse(ASCII.as_bytes()).expect("mesh");
        // A comment that goes on, over an empty line as well; one in Latin-1; colours by another name.
        let comments = "comment made by hand\nwith a tool of its own, version 2.1\n\nall rights reserved\n";
        let text = ASCII.replace("comment made by hand\n", comments);
        assert_eq!(parse(text.as_bytes()).expect("mesh").triangles, quad.triangles);
        let latin: Vec<u8> = ASCII.replace("by hand", "by \u{dc}").chars().map(|c| c as u8).collect();
        assert!(parse(&latin).is_ok());
        let diffuse = ASCII.replace("uchar red", "uchar diffuse_red");
        let diffuse = diffuse.replace("uchar green", "uchar diffuse_green");
        let diffuse = diffuse.replace("uchar blue", "uchar diffuse_blue");
        assert_eq!(parse(diffuse.as_bytes()).expect("mesh").colors, quad.colors);
        // Each way to end lines, and a body that begins with the byte of a newline.
        for end in ["\r\n", "\r"] {
            assert_eq!(
                parse(ASCII.replace('\n', end).as_bytes()).expect("mesh").positions,
                quad.positions
            );
        }
        let mut binary = b"ply\rformat binary_little_endian 1.0\relement first 1\rproperty uchar a\relement vertex 3\r\
            property float x\rproperty float y\rproperty list uchar uchar marks\rproperty float z\relement face 1\r\
            property list uchar uchar vertex_indices\rend_header\r\n"
            .to_vec();
        for i in 0..3u8 {
            binary.extend(f32::from(i).to_le_bytes());
            binary.extend(f32::from(i * i).to_le_bytes());
            // A list of two, which is nobody's.
            binary.extend([2, 7, 7]);
            binary.extend(1.0f32.to_le_bytes());
        }
        binary.extend([3, 0, 1, 2]);
        let mesh = parse(&binary).expect("mesh");
        assert_eq!(
            (mesh.positions[2], mesh.triangles[0]),
            (Vec3::new(2.0, 4.0, 1.0), [0, 1, 2])
        );
        // What is no number may be a normal, and no position.
        let normals = ASCII
            .replace("uchar red", "float nx")
            .replace("uchar green", "float ny");
        let normals = normals.replace("uchar blue", "float nz");
        let text = normals.replace("255 0 0", "-1.#IND00 1.#QNAN 0");
        assert_eq!(parse(text.as_bytes()).expect("mesh").normals[1], Vec3::Y);
        let text = ASCII.replace("1 1 0 0 0 0", "1.#INF 1 0 0 0 0");
        assert_eq!(parse(text.as_bytes()).expect_err("infinite").0, "vertex 2");
    }

    #[test]
    fn text_that_is_no_comment_is_refused() {
        let at = |text: String| parse(text.as_bytes()).expect_err("fault");
        let (line, cause) = at(ASCII.replace("element edge", "elemnt edge"));
        assert!(line == "line 11" && cause.contains("elemnt"), "{line}: {cause}");
        // Right after a comment it reads as text, and its properties have no place.
        let (line, cause) = at(ASCII.replace("element vertex", "elemnt vertex"));
        assert!(line == "line 5" && cause.contains("property"), "{line}: {cause}");
    }

    #[test]
    fn strips_are_cut_and_turn() {
        let strips = ASCII.replace("element face 1", "element tristrips 1");
        let strips = strips.replace("uchar int vertex_indices", "int int vertex_indices");
        let of = |list: &str| parse(strips.replace("4 0 1 2 3", list).as_bytes());
        assert_eq!(of("4 0 1 3 2").expect("mesh").triangles, [[0, 1, 3], [3, 1, 2]]);
        assert_eq!(
            of("9 0 1 3 -1 1 2 3 0 -1").expect("mesh").triangles,
            [[0, 1, 3], [1, 2, 3], [3, 2, 0]]
        );
        assert_eq!(of("4 0 1 3 -2").expect_err("index").0, "tristrips 0");
        let (_, cause) = of("2 0 1").expect_err("no triangle");
        assert!(cause.contains("vertex, edge, tristrips"), "{cause}");
    }

    #[test]
    fn what_is_left_out_is_noted() {
        let faces = ASCII.replace(
            "vertex_indices\n",
            "vertex_indices\nproperty list uchar float texcoord\nproperty uchar red\nproperty uchar green\nproperty uchar blue\n",
        );
        let names: Vec<String> = notes(faces.as_bytes()).into_iter().map(|note| note.feature).collect();
        assert_eq!(
            names,
            [
                "an element that is not known",
                "texture coordinates of faces",
                "colours of faces"
            ]
        );
        let at: Vec<String> = notes(ASCII.as_bytes()).into_iter().map(|note| note.at).collect();
        assert_eq!(at, ["element edge"]);
    }

    #[test]
    fn elements_without_properties_cost_nothing() {
        // Row by row they are 10¹¹ steps.
        let rows = "element nothing 1000000\n".repeat(100_000);
        let text = ASCII.replace("element face", &format!("{rows}element face"));
        let mesh = parse(&[text.as_bytes(), &[b' '; 1 << 20]].concat()).expect("mesh");
        assert_eq!(mesh.triangles.len(), 2);
    }

    #[test]
    fn counts_and_indices_are_checked() {
        let (at, cause) = parse(&binary(false, u32::MAX)).expect_err("too many");
        assert!(at.contains("vertex") && cause.contains("do not fit"), "{at} {cause}");
        let bad = ASCII.replace("4 0 1 2 3", "4 0 1 2 9");
        assert!(
            parse(bad.as_bytes())
                .expect_err("out of range")
                .1
                .contains("out of range")
        );
        let bad = ASCII.replace("4 0 1 2 3", "4 0 1 2 -1");
        assert!(parse(bad.as_bytes()).expect_err("negative").1.contains("-1"));
        let bad = ASCII.replace("1 1 0 0 0 0", "nan 1 0 0 0 0");
        assert_eq!(parse(bad.as_bytes()).expect_err("NaN").0, "vertex 2");
        let endless = ASCII.replace("4 0 1 2 3", "1e18 0 1 2 3");
        assert!(parse(endless.as_bytes()).is_err());
    }
}
