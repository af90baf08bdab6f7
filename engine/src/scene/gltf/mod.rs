//! glTF 2.0: `.gltf` with data URIs and external files, and `.glb`.
//!
//! After "glTF 2.0 Specification", Khronos Group, and the registered extensions named in `SUPPORTED_EXTENSIONS`. The crate `gltf`
//! deserializes the JSON; every index, offset and count is checked here before use, because that crate's own accessors (and its
//! validation of positions) index unchecked.
//!
//! Guarantees: malformed input ends in [`Error::Scene`] with the JSON place; work and memory are bounded by the files' size and by the
//! limits below, however often one file or image is named; what is not modelled becomes a [`Note`] or, when the file requires it, an error by name.

mod accessor;
mod container;
mod image;
mod material;
mod mesh;
mod nodes;
mod uri;

#[cfg(test)]
mod tests;

use std::collections::{BTreeMap, BTreeSet, HashSet};
use std::path::Path;
use std::sync::Arc;

use ::gltf::json::{self, Index, Root};

use super::{Note, Scene, files, shortened};
use crate::catalogue::{Role, Row, sources};
use crate::input::InputFiles;
use crate::{Error, Result};

/// Extensions that are carried over.
const SUPPORTED_EXTENSIONS: &[&str] = &[
    "EXT_mesh_gpu_instancing",
    "KHR_lights_punctual",
    "KHR_materials_emissive_strength",
    "KHR_materials_ior",
    "KHR_materials_specular",
    "KHR_materials_transmission",
    "KHR_materials_unlit",
    "KHR_materials_volume",
    "KHR_mesh_quantization",
    "KHR_texture_transform",
];

/// Greatest number of accessor elements that one file may make us decode, repeated use counted: for each byte of its buffers, beyond a
/// free allowance, and at all. Sharing one vertex buffer among a hundred primitives fits; a small file cannot ask for gigabytes.
const ELEMENTS_PER_BYTE: u64 = 32;
const FREE_ELEMENTS: u64 = MAX_ZERO_ELEMENTS;
const MAX_ELEMENTS: u64 = 1 << 27;
/// Greatest length of an accessor without a buffer view (all zeros): it costs no bytes in the file.
const MAX_ZERO_ELEMENTS: u64 = 1 << 22;
/// Greatest number of texels of all images together.
const MAX_TEXELS: u64 = 1 << 27;
/// Greatest size of one side of an image.
const MAX_IMAGE_SIDE: u32 = 1 << 15;

/// Reads a glTF file, and whatever files it names that the process may read, within the default limits; [`load_with`](super::load_with) lets the
/// host choose both.
///
/// # Errors
/// [`Error::Io`] when the file cannot be read, [`Error::Scene`] with the JSON place for everything else.
pub fn load(path: &Path) -> Result<Scene> {
    files::alone(|read| load_from(path, read))
}

pub(super) fn load_from(path: &Path, read: &InputFiles<'_>) -> Result<Scene> {
    let bytes = files::read(path, read)?;
    let folder = path.parent().unwrap_or(Path::new(""));
    let mut scene = load_bytes(&bytes, folder, read, &path.display().to_string())?;
    scene.name = files::stem(path);
    Ok(scene)
}

/// Reads glTF from memory; `folder` is where external files are looked for and `source` names it in errors.
///
/// # Errors
/// As [`load`].
pub fn load_slice(bytes: &[u8], folder: &Path, source: &str) -> Result<Scene> {
    files::alone(|read| {
        read.count(bytes.len() as u64);
        load_bytes(bytes, folder, read, source)
    })
}

fn load_bytes(bytes: &[u8], folder: &Path, files: &InputFiles<'_>, source: &str) -> Result<Scene> {
    let container::Container { root, blob } = container::open(bytes, source)?;
    let mut reader = Reader {
        source,
        files,
        root: &root,
        buffers: Vec::new(),
        elements: 0,
        element_budget: 0,
        texels: 0,
        encoded: 0,
        images: BTreeMap::new(),
        decoded: BTreeMap::new(),
        meshes: BTreeMap::new(),
        noted: HashSet::new(),
        scene: Scene {
            source: source.into(),
            ..Scene::default()
        },
    };
    reader.check_extensions()?;
    reader.load_buffers(folder, blob)?;
    reader.load_materials(folder)?;
    reader.load_nodes()?;
    let scene = reader.scene;
    scene.check()?;
    Ok(scene)
}

/// What one file's reading carries along.
struct Reader<'a> {
    source: &'a str,
    files: &'a InputFiles<'a>,
    root: &'a Root,
    /// Buffers of one file share its bytes.
    buffers: Vec<Arc<Vec<u8>>>,
    /// Accessor elements decoded so far.
    elements: u64,
    /// How many may be.
    element_budget: u64,
    /// Texels decoded so far.
    texels: u64,
    /// Bytes of encoded images decoded so far.
    encoded: u64,
    /// glTF image index to scene image index; `None` for one that cannot be used.
    images: BTreeMap<usize, Option<u32>>,
    /// Where an image's bytes begin in memory and how many there are, to the scene's image: what is there once is decoded once.
    decoded: BTreeMap<(usize, usize), u32>,
    /// glTF mesh index to the scene meshes of its primitives.
    meshes: BTreeMap<usize, Vec<u32>>,
    /// The scene's notes, for none to be there twice.
    noted: HashSet<Note>,
    scene: Scene,
}

impl<'a> Reader<'a> {
    fn fail<T>(&self, at: impl Into<String>, cause: impl Into<String>) -> Result<T> {
        Err(Error::scene(self.source, at, cause))
    }

    /// Counts memory that the scene is about to take for good: one name in a file may be that of a million things.
    fn reserve(&self, bytes: u64, at: &str) -> Result<()> {
        let counted = self.files.reserve(bytes, bytes);
        counted.map_err(|cause| Error::scene(self.source, at, cause))
    }

    fn note(&mut self, feature: impl Into<String>, at: impl Into<String>, instead: impl Into<String>) {
        let note = Note {
            // Each use of one long name may be a note.
            feature: shortened(&feature.into()),
            at: at.into(),
            instead: instead.into(),
        };
        if self.noted.insert(note.clone()) {
            self.scene.notes.push(note);
        }
    }

    /// Looks an index up in one of the root's arrays.
    fn get<T>(&self, array: &'a [T], name: &str, index: usize, at: &str) -> Result<&'a T> {
        match array.get(index) {
            Some(item) => Ok(item),
            None => self.fail(at, format!("{name} {index} does not exist; there are {}", array.len())),
        }
    }

    fn check_extensions(&mut self) -> Result<()> {
        for (i, name) in self.root.extensions_required.iter().enumerate() {
            if !SUPPORTED_EXTENSIONS.contains(&name.as_str()) {
                return self.fail(
                    format!("extensionsRequired[{i}]"),
                    format!(
                        "{name} is not supported; supported: {}",
                        SUPPORTED_EXTENSIONS.join(", ")
                    ),
                );
            }
        }
        for (i, name) in self.root.extensions_used.iter().enumerate() {
            if !SUPPORTED_EXTENSIONS.contains(&name.as_str()) {
                self.note(
                    name,
                    format!("extensionsUsed[{i}]"),
                    "ignored; the core glTF data is used",
                );
            }
        }
        if !self.root.animations.is_empty() {
            self.note("animations", "animations", "the file's own pose is used");
        }
        Ok(())
    }

    fn load_buffers(&mut self, folder: &Path, mut blob: Option<Vec<u8>>) -> Result<()> {
        for (i, buffer) in self.root.buffers.iter().enumerate() {
            let at = format!("buffers[{i}]");
            let bytes = match (&buffer.uri, i) {
                (Some(uri), _) => uri::read(uri, folder, self.files, self.source, &format!("{at}.uri"))?,
                (None, 0) => match blob.take() {
                    Some(blob) => Arc::new(blob),
                    None => return self.fail(at, "has no uri, and there is no binary chunk"),
                },
                (None, _) => return self.fail(at, "has no uri; only the first buffer may be the binary chunk"),
            };
            if (bytes.len() as u64) < buffer.byte_length.0 {
                return self.fail(
                    format!("{at}.byteLength"),
                    format!("{} bytes are promised, {} are there", buffer.byte_length.0, bytes.len()),
                );
            }
            self.buffers.push(bytes);
        }
        let mut counted = BTreeSet::new();
        let new = self.buffers.iter().filter(|buffer| counted.insert(Arc::as_ptr(buffer)));
        let bytes: u64 = new.map(|buffer| buffer.len() as u64).sum();
        self.element_budget = (FREE_ELEMENTS + ELEMENTS_PER_BYTE * bytes).min(MAX_ELEMENTS);
        Ok(())
    }

    /// The bytes of a buffer view and its stride.
    fn view(&self, index: Index<json::buffer::View>, at: &str) -> Result<(&[u8], Option<usize>)> {
        let i = index.value();
        let view = self.get(&self.root.buffer_views, "buffer view", i, at)?;
        let at = format!("bufferViews[{i}]");
        let Some(buffer) = self.buffers.get(view.buffer.value()) else {
            return self.fail(
                format!("{at}.buffer"),
                format!(
                    "buffer {} does not exist; there are {}",
                    view.buffer.value(),
                    self.buffers.len()
                ),
            );
        };
        let start = view.byte_offset.unwrap_or_default().0;
        let end = start.checked_add(view.byte_length.0);
        let bytes = end.and_then(|end| {
            let (start, end) = (usize::try_from(start).ok()?, usize::try_from(end).ok()?);
            buffer.get(start..end)
        });
        match bytes {
            Some(bytes) => Ok((bytes, view.byte_stride.map(|s| s.0))),
            None => self.fail(
                at,
                format!(
                    "offset {start} and length {} leave the buffer of {} bytes",
                    view.byte_length.0,
                    buffer.len()
                ),
            ),
        }
    }
}

/// Rows of the catalogue.
pub(crate) const ROWS: &[Row] = &[Row {
    id: "CL-GLTF",
    name: "reader of glTF 2.0",
    role: Role::Service,
    limits: "Animations, skins and morph targets are reported and left out.",
    sources: &[sources::KHRONOS_GLTF.whole()],
    tests: &[
        "engine/src/scene/gltf/tests/features.rs::text_and_binary_containers_give_the_same_scene",
        "engine/src/scene/gltf/tests/features.rs::material_extensions_are_carried_over",
        "engine/src/scene/gltf/tests/malformed.rs::every_truncation_is_an_error",
    ],
    experiment: "tools/models",
    api: &["clerestory::scene::gltf::load", "clerestory::scene::load"],
    ..Row::of(file!())
}];
