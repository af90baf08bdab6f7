//! The one entrance for scenes: `builtin:` addresses, model files with their sidecar, and sidecars given directly.
//!
//! A model without a camera gets one that frames it, and a model without any light gets a uniform environment, so that a picture comes
//! out; both are reported as notes, and so is a model without any geometry.
//!
//! Everything that a scene names comes through [`input`](crate::input): each file is read once, what may be read and how much is the host's to say.

use std::fmt;
use std::path::Path;
use std::sync::Arc;

use glam::{DVec3, Vec3};

use super::check::camera_is_sound;
use super::placed::placed_again;
use super::{Camera, Environment, EnvironmentUse, Note, Scene, SceneProfile, builtin, gltf, obj, ply, sidecar};
use crate::input::{AnyFile, InputFile, InputFiles, InputLimits, Resolver};
use crate::{Error, Result};

/// Which files a scene may read, and how much of them.
#[derive(Clone)]
pub struct LoadOptions {
    /// Finds and reads the files. By default [`AnyFile`]: every regular file that the process may read.
    pub resolver: Arc<dyn Resolver>,
    /// Bounds of the files and of their decoded contents.
    pub limits: InputLimits,
}

impl Default for LoadOptions {
    fn default() -> Self {
        Self {
            resolver: Arc::new(AnyFile),
            limits: InputLimits::default(),
        }
    }
}

impl fmt::Debug for LoadOptions {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("LoadOptions")
            .field("limits", &self.limits)
            .finish_non_exhaustive()
    }
}

/// A scene and what was read for it.
#[derive(Debug, Clone)]
pub struct Loaded {
    /// The scene.
    pub scene: Scene,
    /// All files, in the order of their first use; none for a `builtin:` address.
    pub files: Vec<InputFile>,
    /// Bytes of decoded texels, densities, radiance and materials, and of what one place of a file makes many of (placements, names), that were counted
    /// against the limits.
    pub bytes_decoded: u64,
}

/// Loads a scene: a `builtin:` address, a model (`.gltf`, `.glb`, `.ply`, `.obj`) or a sidecar (`.toml` with `file`).
///
/// Beside a model `NAME.EXT`, a file `NAME.scene.toml` is read as its sidecar. The scene may name every file that the process may read, by
/// absolute paths, `..` and links: [`load_with`] keeps scenes that are not trusted in a folder.
///
/// # Errors
/// [`Error::Io`] for a file that cannot be read, is not a regular file or is too long; [`Error::Scene`] with the place of the first fault in it.
pub fn load(address_or_path: &str) -> Result<Scene> {
    load_with(address_or_path, &LoadOptions::default()).map(|loaded| loaded.scene)
}

/// As [`load`], with files by the host's resolver and within its limits; says which files were read.
///
/// ```no_run
/// use std::sync::Arc;
///
/// use clerestory::input::Folder;
/// use clerestory::scene::{LoadOptions, load_with};
///
/// # fn main() -> clerestory::Result<()> {
/// let options = LoadOptions {
///     resolver: Arc::new(Folder::new("uploads")?),
///     ..LoadOptions::default()
/// };
/// let loaded = load_with("model.glb", &options)?;
/// for file in &loaded.files {
///     println!("{} ({} bytes)", file.path.display(), file.bytes);
/// }
/// # Ok(())
/// # }
/// ```
///
/// # Errors
/// As [`load`]; beyond a limit, the error names the file or the place that asked for too much.
pub fn load_with(address_or_path: &str, options: &LoadOptions) -> Result<Loaded> {
    let files = InputFiles::new(&*options.resolver, options.limits);
    let scene = load_from(address_or_path, &files)?;
    Ok(Loaded {
        scene,
        files: files.files(),
        bytes_decoded: files.bytes_decoded(),
    })
}

fn load_from(address_or_path: &str, files: &InputFiles<'_>) -> Result<Scene> {
    if address_or_path.starts_with(builtin::PREFIX) {
        return builtin::generate(address_or_path);
    }
    let path = Path::new(address_or_path);
    let mut scene = if extension(path) == "toml" {
        let bytes = read(path, files)?;
        let sidecar = sidecar::Sidecar::from_bytes(&bytes, path)?;
        let address = sidecar.model()?;
        let mut scene = if address.starts_with(builtin::PREFIX) {
            builtin::generate(&address)?
        } else {
            model(Path::new(&address), files).map_err(|error| sidecar.in_file_of("file", error))?
        };
        scene.name = stem(path);
        sidecar.apply_from(&mut scene, files)?;
        scene
    } else {
        let mut scene = model(path, files)?;
        let beside = path.with_extension("scene.toml");
        let found = files
            .read_if_there(&beside)
            .map_err(|cause| Error::io(&beside, cause))?;
        if let Some(bytes) = found {
            sidecar::Sidecar::from_bytes(&bytes, &beside)?.apply_from(&mut scene, files)?;
        }
        scene
    };
    scene.source = address_or_path.into();
    complete(&mut scene)?;
    scene.check()?;
    Ok(scene)
}

/// The bytes of a file that a scene names.
pub(super) fn read(path: &Path, files: &InputFiles<'_>) -> Result<Arc<Vec<u8>>> {
    files.read(path).map_err(|cause| Error::io(path, cause))
}

/// Reads one file by a function with a reader of files of its own: default limits, and whatever the process may read.
pub(super) fn alone<T>(read: impl FnOnce(&InputFiles<'_>) -> Result<T>) -> Result<T> {
    read(&InputFiles::new(&AnyFile, InputLimits::default()))
}

fn extension(path: &Path) -> String {
    path.extension()
        .map(|e| e.to_string_lossy().to_lowercase())
        .unwrap_or_default()
}

/// The file's name without its extensions, for output files.
pub(super) fn stem(path: &Path) -> String {
    let stem = path
        .file_stem()
        .map(|s| s.to_string_lossy().into_owned())
        .unwrap_or_default();
    stem.strip_suffix(".scene").map(str::to_string).unwrap_or(stem)
}

fn model(path: &Path, files: &InputFiles<'_>) -> Result<Scene> {
    let scene = read_model(path, files)?;
    let bytes = placed_again(&scene);
    let counted = files.reserve(bytes, bytes);
    counted.map_err(|cause| Error::scene(&scene.source, "instances of meshes that are placed before", cause))?;
    Ok(scene)
}

fn read_model(path: &Path, files: &InputFiles<'_>) -> Result<Scene> {
    match extension(path).as_str() {
        "gltf" | "glb" => gltf::load_from(path, files),
        "ply" => ply::load(path, files),
        "obj" => obj::load(path, files),
        other => {
            let cause = match other {
                "" => "has no ending that tells its kind".into(),
                _ => format!("{other:?} is not a known kind of scene file"),
            };
            let known = "known: gltf, glb, ply, obj, toml, and builtin: addresses";
            let text = path.display().to_string();
            let name = text.split_once('?').map_or(text.as_str(), |(name, _)| name);
            let known = match builtin::nearest(name) {
                Some(near) => format!("did you mean {}{near}? {known}", builtin::PREFIX),
                None => known.to_owned(),
            };
            Err(Error::scene(
                path.display().to_string(),
                "file name",
                format!("{cause}; {known}"),
            ))
        }
    }
}

/// Adds what a picture needs and the file did not say.
///
/// # Errors
/// [`Error::Scene`] for geometry so large that no camera can frame it.
fn complete(scene: &mut Scene) -> Result<()> {
    let profile = SceneProfile::of(scene);
    if profile.triangles == 0 {
        scene.notes.push(Note {
            feature: "no geometry".into(),
            at: "meshes".into(),
            instead: "the picture shows only the background".into(),
        });
    }
    if scene.cameras.is_empty() {
        let camera = framing_camera(&profile);
        if !camera_is_sound(&camera) {
            // Coordinates that are no numbers are faults of their own.
            scene.check()?;
            let [low, high] = profile.bounds.unwrap_or_default();
            let cause = format!(
                "reaches from {low:?} m to {high:?} m: no camera can frame that, and the file has none. Scale it, leave out what lies far away, or give a camera"
            );
            return Err(Error::scene(&scene.source, "geometry", cause));
        }
        scene.cameras.push(camera);
        scene.notes.push(Note {
            feature: "no camera in the file".into(),
            at: "cameras".into(),
            instead: "a camera \"main\" that frames the scene is used".into(),
        });
    }
    let lights = profile.lights.point + profile.lights.spot + profile.lights.directional;
    let shines = profile.has_area_lights() || profile.has_unlit || profile.media.emits;
    let dark = profile.environment == EnvironmentUse::Absent && !shines;
    if lights == 0 && dark && scene.environment.is_none() {
        scene.environment = Some(Environment::uniform(Vec3::ONE));
        scene.notes.push(Note {
            feature: "no light in the file".into(),
            at: "lights".into(),
            instead: "a uniform environment of radiance 1 is used".into(),
        });
    }
    Ok(())
}

/// A camera that sees the whole bounding sphere from the front, a little from above and from the right.
fn framing_camera(profile: &SceneProfile) -> Camera {
    const FOV_Y: f32 = std::f32::consts::FRAC_PI_4;
    const MARGIN: f64 = 1.1;
    let [low, high] = profile
        .bounds
        .map_or([DVec3::NEG_ONE, DVec3::ONE], |b| b.map(DVec3::from_array));
    let centre = low.midpoint(high);
    let radius = low.distance(high) / 2.0;
    let radius = if radius > 0.0 { radius } else { 1.0 };
    let direction = DVec3::new(0.35, 0.3, 1.0).normalize();
    let distance = MARGIN * radius / (f64::from(FOV_Y) / 2.0).sin();
    let mut camera = Camera::look_at("main", centre + direction * distance, centre, DVec3::Y, FOV_Y);
    camera.focus_distance = distance as f32;
    camera
}
