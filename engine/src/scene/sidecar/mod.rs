//! The TOML sidecar: what glTF cannot say.
//!
//! ```toml
//! file = "model.gltf"           # only in a sidecar that is given as the scene itself; "builtin:ring?metal=gold" works too
//! exposure = 0.5                # stops
//! technique = "path"
//! aspect = 1.5                  # width / height
//!
//! [environment]
//! file = "sky.exr"              # EXR or Radiance HDR, latitude–longitude; or color = [1.0, 1.0, 1.0]
//! rotation = 90.0               # degrees about +Y, counter-clockwise seen from above
//! strength = 2.0
//!
//! [metals]                      # by material name
//! ring = "gold"                 # gold, silver, copper, aluminium, iron, chromium, titanium, nickel, cobalt
//! bowl = { eta = [1.4, 0.9, 0.7], k = [7.6, 6.4, 5.6] }
//!
//! [phong]                       # by material name: the modified Phong model in place of metal and coat; no transmission
//! floor = { exponent = 50.0, share = 0.4 }    # of the reflectance, the base colour; the rest is Lambert's
//!
//! [[cameras]]                   # changes the camera of that name, or adds one
//! name = "main"
//! eye = [0.0, 1.0, 4.0]         # metres
//! target = [0.0, 0.5, 0.0]
//! up = [0.0, 1.0, 0.0]
//! fov = 40.0                    # full vertical angle, degrees
//! aperture = 0.01               # lens radius, metres
//! focus = 4.0                   # distance of the plane in focus, metres
//! ```
//!
//! Participating media are described in [`medium`], grids of their densities in [`density`]. Unknown keys are errors with their line.

pub mod density;
pub mod medium;

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use glam::{DVec3, Quat, Vec3};
use serde::Deserialize;

use medium::MediumTable;

use super::{Camera, ConductorIor, Environment, Material, Note, Projection, Scene, builtin, metals, phong_roughness};
use crate::catalogue::{Role, Row};
use crate::{Error, Result};

/// Greatest number of texels of an environment map.
const MAX_TEXELS: u64 = 1 << 27;
/// Greatest exponent of a Phong lobe; narrower ones are mirrors.
const PHONG_EXPONENT_MAX: f32 = 1e5;

/// A sidecar that was read, before it changes a scene.
#[derive(Debug)]
pub struct Sidecar {
    path: PathBuf,
    content: Content,
}

#[derive(Debug, Default, Deserialize)]
#[serde(deny_unknown_fields)]
struct Content {
    file: Option<String>,
    exposure: Option<f32>,
    technique: Option<String>,
    aspect: Option<f32>,
    environment: Option<EnvironmentTable>,
    #[serde(default)]
    metals: BTreeMap<String, Metal>,
    #[serde(default)]
    phong: BTreeMap<String, PhongTable>,
    #[serde(default)]
    cameras: Vec<CameraTable>,
    #[serde(default, deserialize_with = "medium::one_or_many")]
    medium: Vec<MediumTable>,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct EnvironmentTable {
    file: Option<String>,
    color: Option<[f32; 3]>,
    rotation: Option<f32>,
    strength: Option<f32>,
}

#[derive(Debug, Deserialize)]
#[serde(untagged, expecting = "a metal's name or a table with eta and k")]
enum Metal {
    Named(String),
    Measured(MeasuredMetal),
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct MeasuredMetal {
    eta: [f32; 3],
    k: [f32; 3],
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields, expecting = "a table with exponent and share")]
struct PhongTable {
    exponent: f32,
    share: Option<f32>,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct CameraTable {
    name: String,
    eye: Option<[f64; 3]>,
    target: Option<[f64; 3]>,
    up: Option<[f64; 3]>,
    fov: Option<f32>,
    aperture: Option<f32>,
    focus: Option<f32>,
}

impl Sidecar {
    /// Reads a sidecar file.
    ///
    /// # Errors
    /// [`Error::Io`] when it cannot be read; [`Error::Scene`] with the line for a syntax error, an unknown key or a wrong type.
    pub fn read(path: &Path) -> Result<Self> {
        let text = std::fs::read_to_string(path).map_err(|source| Error::io(path, source))?;
        Self::parse(&text, path)
    }

    /// Reads a sidecar from its text; `path` names it and is where its files are looked for.
    ///
    /// # Errors
    /// As [`Sidecar::read`].
    pub fn parse(text: &str, path: &Path) -> Result<Self> {
        let content = toml::from_str(text).map_err(|error: toml::de::Error| {
            let start = error.span().map_or(0, |span| span.start);
            let line = 1 + text.bytes().take(start).filter(|&b| b == b'\n').count();
            // The names of Rust's types mean nothing to who writes the file.
            let cause = error
                .message()
                .replace("expected f32", "expected a number")
                .replace("expected f64", "expected a number");
            Error::scene(path.display().to_string(), format!("line {line}"), cause)
        })?;
        Ok(Self {
            path: path.into(),
            content,
        })
    }

    /// The model that a sidecar given as the scene names: a path, or a `builtin:` address as it stands.
    ///
    /// # Errors
    /// [`Error::Scene`] when it names none, or another sidecar.
    pub fn model(&self) -> Result<String> {
        let Some(file) = &self.content.file else {
            return Err(self.fault(
                "file",
                "is missing; a sidecar given as the scene names its model, file = \"model.gltf\"",
            ));
        };
        if file.to_lowercase().ends_with(".toml") {
            return Err(self.fault("file", "names another sidecar; it must name a model"));
        }
        Ok(if file.starts_with(builtin::PREFIX) {
            file.clone()
        } else {
            self.folder().join(file).display().to_string()
        })
    }

    /// An error about the file that a key names, with the key.
    pub fn in_file_of(&self, key: &str, error: Error) -> Error {
        match error {
            Error::Io { .. } | Error::Picture { .. } => self.fault(key, error.to_string()),
            other => other,
        }
    }

    /// Changes a scene as the sidecar says.
    ///
    /// # Errors
    /// [`Error::Scene`] naming the key, for unknown metals or materials, for values that cannot be, and for an environment map that cannot
    /// be read.
    pub fn apply(&self, scene: &mut Scene) -> Result<()> {
        let content = &self.content;
        if let Some(exposure) = content.exposure {
            self.require(exposure.is_finite(), "exposure", "must be finite")?;
            scene.defaults.exposure = exposure;
        }
        if content.technique.is_some() {
            scene.defaults.technique = content.technique.clone();
        }
        if let Some(aspect) = content.aspect {
            self.require(aspect.is_finite() && aspect > 0.0, "aspect", "must be above 0")?;
            scene.defaults.aspect = Some(aspect);
        }
        if let Some(table) = &content.environment {
            let (environment, notes) = self.environment(table)?;
            scene.environment = Some(environment);
            scene.notes.extend(notes);
        }
        for (name, metal) in &content.metals {
            self.metal(scene, name, metal)?;
        }
        for (name, table) in &content.phong {
            self.phong(scene, name, table)?;
        }
        for table in &content.cameras {
            self.camera(scene, table)?;
        }
        for (index, table) in content.medium.iter().enumerate() {
            self.medium(scene, index, table)?;
        }
        Ok(())
    }

    fn folder(&self) -> &Path {
        self.path.parent().unwrap_or(Path::new(""))
    }

    fn fault(&self, key: &str, cause: impl Into<String>) -> Error {
        Error::scene(self.path.display().to_string(), format!("key {key:?}"), cause)
    }

    fn require(&self, condition: bool, key: &str, cause: &str) -> Result<()> {
        if condition { Ok(()) } else { Err(self.fault(key, cause)) }
    }

    fn unknown_material(&self, scene: &Scene, key: &str) -> Error {
        let known: Vec<&str> = scene.materials.iter().map(|m| m.name.as_str()).collect();
        self.fault(
            key,
            format!("no material has that name; there are: {}", known.join(", ")),
        )
    }

    fn environment(&self, table: &EnvironmentTable) -> Result<(Environment, Option<Note>)> {
        let (mut environment, note) = match (&table.file, table.color) {
            (Some(file), None) => read_environment(&self.folder().join(file))
                .map_err(|error| self.in_file_of("environment.file", error))?,
            (None, Some(color)) => {
                let sound = color.iter().all(|c| c.is_finite() && *c >= 0.0);
                self.require(sound, "environment.color", "must be finite and at least 0")?;
                (Environment::uniform(Vec3::from_array(color)), None)
            }
            _ => return Err(self.fault("environment", "needs either file or color")),
        };
        let rotation = table.rotation.unwrap_or(0.0);
        let strength = table.strength.unwrap_or(1.0);
        self.require(rotation.is_finite(), "environment.rotation", "must be finite")?;
        self.require(
            strength.is_finite() && strength >= 0.0,
            "environment.strength",
            "must be at least 0",
        )?;
        environment.rotation = Quat::from_rotation_y(rotation.to_radians());
        environment.strength = strength;
        Ok((environment, note))
    }

    fn metal(&self, scene: &mut Scene, name: &str, metal: &Metal) -> Result<()> {
        let key = format!("metals.{name}");
        let conductor = match metal {
            Metal::Named(metal) => metals::by_name(metal).ok_or_else(|| {
                let known: Vec<&str> = metals::names().collect();
                self.fault(
                    &key,
                    format!("metal {metal:?} is not known; known: {}", known.join(", ")),
                )
            })?,
            Metal::Measured(MeasuredMetal { eta, k }) => {
                let sound =
                    eta.iter().all(|e| e.is_finite() && *e > 0.0) && k.iter().all(|k| k.is_finite() && *k >= 0.0);
                self.require(sound, &key, "needs eta above 0 and k at least 0")?;
                ConductorIor {
                    eta: Vec3::from_array(*eta),
                    k: Vec3::from_array(*k),
                }
            }
        };
        self.change_materials(scene, &key, name, |material| {
            material.conductor = Some(conductor);
            material.metallic = 1.0;
        })
    }

    fn phong(&self, scene: &mut Scene, name: &str, table: &PhongTable) -> Result<()> {
        let key = format!("phong.{name}");
        let &PhongTable { exponent, share } = table;
        self.require(
            (0.0..=PHONG_EXPONENT_MAX).contains(&exponent),
            &key,
            "needs an exponent from 0 to 100000",
        )?;
        let share = share.unwrap_or(1.0);
        self.require((0.0..=1.0).contains(&share), &key, "needs a share from 0 to 1")?;
        self.change_materials(scene, &key, name, |material| {
            *material = Material {
                metallic: share,
                roughness: phong_roughness(exponent),
                specular: 0.0,
                phong: true,
                ..material.clone()
            };
        })
    }

    /// Changes all materials of a name, of which there must be one.
    fn change_materials(&self, scene: &mut Scene, key: &str, name: &str, change: impl Fn(&mut Material)) -> Result<()> {
        let mut found = false;
        for material in scene.materials.iter_mut().filter(|m| m.name == name) {
            change(material);
            found = true;
        }
        if found {
            Ok(())
        } else {
            Err(self.unknown_material(scene, key))
        }
    }

    fn camera(&self, scene: &mut Scene, table: &CameraTable) -> Result<()> {
        let key = format!("cameras.{}", table.name);
        let existing = scene.cameras.iter().position(|c| c.name == table.name);
        let vectors = [table.eye, table.target, table.up];
        let finite = vectors.iter().flatten().flatten().all(|x| x.is_finite());
        self.require(finite, &key, "eye, target and up must be finite")?;
        let [eye, target, up] = vectors.map(|v| v.map(DVec3::from_array));
        let old = existing.map(|i| scene.cameras[i].clone());
        let mut camera = match (&old, eye, target) {
            (Some(old), None, None) if up.is_none() => old.clone(),
            (Some(old), eye, target) => {
                let place = old.transform;
                let eye = eye.unwrap_or(place.translation);
                let target = target.unwrap_or(eye - place.matrix3.z_axis);
                let up = up.unwrap_or(place.matrix3.y_axis);
                Camera {
                    projection: old.projection,
                    lens_radius: old.lens_radius,
                    focus_distance: old.focus_distance,
                    ..self.look_at(&table.name, &key, [eye, target, up])?
                }
            }
            (None, Some(eye), Some(target)) => {
                let mut camera = self.look_at(&table.name, &key, [eye, target, up.unwrap_or(DVec3::Y)])?;
                camera.focus_distance = eye.distance(target) as f32;
                camera
            }
            _ => return Err(self.fault(&key, "no camera has that name, and a new one needs eye and target")),
        };
        if let Some(fov) = table.fov {
            self.require(
                fov > 0.0 && fov < 180.0,
                &format!("{key}.fov"),
                "must lie between 0 and 180 degrees",
            )?;
            camera.projection = Projection::Perspective {
                fov_y: fov.to_radians(),
            };
        }
        if let Some(aperture) = table.aperture {
            let sound = aperture.is_finite() && aperture >= 0.0;
            self.require(sound, &format!("{key}.aperture"), "must be at least 0 m")?;
            camera.lens_radius = aperture;
        }
        if let Some(focus) = table.focus {
            self.require(
                focus.is_finite() && focus > 0.0,
                &format!("{key}.focus"),
                "must be above 0 m",
            )?;
            camera.focus_distance = focus;
        }
        match existing {
            Some(i) => scene.cameras[i] = camera,
            None => scene.cameras.push(camera),
        }
        Ok(())
    }

    fn look_at(&self, name: &str, key: &str, [eye, target, up]: [DVec3; 3]) -> Result<Camera> {
        let across = up.normalize_or_zero().cross((eye - target).normalize_or_zero());
        self.require(
            across.length() > 1e-9,
            key,
            "eye and target coincide, or up points along the view",
        )?;
        const DEFAULT_FOV_Y: f32 = std::f32::consts::FRAC_PI_4;
        Ok(Camera::look_at(name, eye, target, up, DEFAULT_FOV_Y))
    }
}

/// Reads a latitude–longitude map. Channels that are negative, as compression leaves them in dark colours, become 0, and texels that are
/// not finite black; both are counted in a note.
fn read_environment(path: &Path) -> Result<(Environment, Option<Note>)> {
    let fail = |cause: String| Error::Picture {
        path: path.display().to_string(),
        cause,
    };
    let name = path.display().to_string();
    let is_exr = path.extension().is_some_and(|e| e.eq_ignore_ascii_case("exr"));
    let (width, height, mut radiance) = if is_exr { read_exr(path) } else { read_hdr(path) }.map_err(fail)?;
    let mut replaced = 0;
    for r in radiance.iter_mut().filter(|r| !r.is_finite() || r.min_element() < 0.0) {
        *r = if r.is_finite() { r.max(Vec3::ZERO) } else { Vec3::ZERO };
        replaced += 1;
    }
    let note = (replaced > 0).then(|| Note {
        feature: "negative or not finite radiance".into(),
        at: name.clone(),
        instead: format!("{replaced} texels: negative channels are taken as 0, what is not finite as black"),
    });
    let environment = Environment {
        name,
        width,
        height,
        radiance,
        rotation: Quat::IDENTITY,
        strength: 1.0,
    };
    Ok((environment, note))
}

type Texels = (u32, u32, Vec<Vec3>);

fn read_exr(path: &Path) -> Result<Texels, String> {
    let meta = exr::meta::MetaData::read_from_file(path, false).map_err(|error| error.to_string())?;
    let texels = meta
        .headers
        .iter()
        .map(|h| h.layer_size.area() as u64)
        .max()
        .unwrap_or(0);
    if texels > MAX_TEXELS {
        return Err(format!("has {texels} texels; at most {MAX_TEXELS} are allowed"));
    }
    let image = exr::prelude::read_first_rgba_layer_from_file(
        path,
        |size, _| (size, vec![Vec3::ZERO; size.area()]),
        |(size, texels), at, (r, g, b, _): (f32, f32, f32, f32)| {
            texels[at.y() * size.width() + at.x()] = Vec3::new(r, g, b)
        },
    )
    .map_err(|error| error.to_string())?;
    let (size, radiance) = image.layer_data.channel_data.pixels;
    Ok((size.width() as u32, size.height() as u32, radiance))
}

fn read_hdr(path: &Path) -> Result<Texels, String> {
    let mut reader = ::image::ImageReader::open(path)
        .and_then(::image::ImageReader::with_guessed_format)
        .map_err(|error| error.to_string())?;
    let mut limits = ::image::Limits::default();
    limits.max_alloc = Some(MAX_TEXELS * 12);
    reader.limits(limits);
    if reader.format() != Some(::image::ImageFormat::Hdr) {
        return Err("is neither OpenEXR nor Radiance HDR".into());
    }
    let image = reader.decode().map_err(|error| error.to_string())?.into_rgb32f();
    Ok((
        image.width(),
        image.height(),
        image.pixels().map(|p| Vec3::from_array(p.0)).collect(),
    ))
}

/// Rows of the catalogue.
pub(crate) const ROWS: &[Row] = &[Row {
    id: "CL-SIDECAR",
    name: "sidecar of a model: environment, metals, modified Phong surfaces, cameras, exposure, technique, participating media with grids of densities",
    role: Role::Service,
    limits: "Says what glTF cannot; geometry and textures stay in the model.",
    tests: &[
        "engine/tests/scene_load.rs::a_sidecar_adds_what_the_model_cannot_say",
        "engine/tests/scene_load.rs::modified_phong_surfaces_are_loaded_and_checked",
        "engine/tests/scene_load.rs::sidecar_faults_have_their_line_or_key",
    ],
    experiment: "tools/models",
    api: &["clerestory::scene::sidecar::Sidecar"],
    ..Row::of(file!())
}];
