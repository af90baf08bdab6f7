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
//! vase = { metal = "gold", fresnel = "compensated" }  # exact, schlick, rescaled, compensated, f82-tint, hoffman, simplified, table
//! cup = { reflectance = [0.9, 0.7, 0.4], edge_tint = [0.8, 0.6, 0.5] }  # at normal incidence, up to 0.9999, and near grazing incidence; 0 to 1
//! coin = { spectrum = "coin.csv" }                    # lines of a wavelength in nanometres, n, k
//! pan = { metal = "copper", distribution = "beckmann", geometry = "cook-torrance" }  # ggx, beckmann, cosine-lobe; cook-torrance, simplified, smith
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

use std::collections::{BTreeMap, HashMap};
use std::io::{self, Cursor, ErrorKind};
use std::path::{Path, PathBuf};

use ::image::ImageDecoder;
use exr::prelude::{ReadChannels, ReadLayers};
use glam::{DVec3, Quat, Vec3};
use serde::Deserialize;

use medium::MediumTable;

use super::metals::artistic::REFLECTANCE_MAX;
use super::{
    Camera, ConductorIor, Distribution, Environment, FresnelForm, Geometry, Material, Microfacets, Note, Projection,
    Scene, builtin, files, metals, phong_roughness,
};
use crate::catalogue::{Role, Row};
use crate::input::InputFiles;
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
#[serde(
    untagged,
    expecting = "a metal's name, or a table with metal, spectrum, eta and k, or reflectance and edge_tint, and if wanted fresnel: exact, \
                 schlick, rescaled, compensated, f82-tint, hoffman, simplified or table; distribution: ggx, beckmann or cosine-lobe; \
                 geometry: cook-torrance, simplified or smith"
)]
enum Metal {
    Named(String),
    Described(MetalTable),
}

#[derive(Debug, Default, Deserialize)]
#[serde(deny_unknown_fields)]
struct MetalTable {
    metal: Option<String>,
    spectrum: Option<String>,
    eta: Option<[f32; 3]>,
    k: Option<[f32; 3]>,
    reflectance: Option<[f32; 3]>,
    edge_tint: Option<[f32; 3]>,
    fresnel: Option<FresnelForm>,
    distribution: Option<Distribution>,
    geometry: Option<Geometry>,
}

impl MetalTable {
    /// Classical microfacets where either part is named.
    fn microfacets(&self) -> Option<Microfacets> {
        (self.distribution.is_some() || self.geometry.is_some()).then(|| Microfacets {
            distribution: self.distribution.unwrap_or_default(),
            geometry: self.geometry.unwrap_or_default(),
        })
    }
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
        files::alone(|read| Self::from_bytes(&files::read(path, read)?, path))
    }

    pub(super) fn from_bytes(bytes: &[u8], path: &Path) -> Result<Self> {
        let not_text = |_| Error::io(path, io::Error::new(ErrorKind::InvalidData, "is not UTF-8"));
        Self::parse(std::str::from_utf8(bytes).map_err(not_text)?, path)
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

    /// Changes a scene as the sidecar says; the files that it names are those that the process may read, within the default limits.
    ///
    /// # Errors
    /// [`Error::Scene`] naming the key, for unknown metals or materials, for values that cannot be, and for an environment map that cannot
    /// be read.
    pub fn apply(&self, scene: &mut Scene) -> Result<()> {
        files::alone(|read| self.apply_from(scene, read))
    }

    pub(super) fn apply_from(&self, scene: &mut Scene, read: &InputFiles<'_>) -> Result<()> {
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
            let (environment, notes) = self.environment(table, read)?;
            scene.environment = Some(environment);
            scene.notes.extend(notes);
        }
        let named = named(scene.materials.iter().map(|material| material.name.as_str()));
        for (name, metal) in &content.metals {
            self.metal(scene, &named, name, metal, read)?;
        }
        for (name, table) in &content.phong {
            self.phong(scene, &named, name, table)?;
        }
        let mut cameras = self::named(scene.cameras.iter().map(|camera| camera.name.as_str()));
        for table in &content.cameras {
            self.camera(scene, &mut cameras, table)?;
        }
        let mut cells = 0;
        for medium in &scene.media {
            cells += medium.density.as_ref().map_or(0, |grid| grid.values.len() as u64);
        }
        for (index, table) in content.medium.iter().enumerate() {
            self.medium(
                scene,
                &named,
                index,
                table,
                &mut Budget {
                    read,
                    cells: &mut cells,
                },
            )?;
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

    fn environment(&self, table: &EnvironmentTable, read: &InputFiles<'_>) -> Result<(Environment, Option<Note>)> {
        let (mut environment, note) = match (&table.file, table.color) {
            (Some(file), None) => read_environment(&self.folder().join(file), read)
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

    fn metal(&self, scene: &mut Scene, named: &Named, name: &str, metal: &Metal, read: &InputFiles<'_>) -> Result<()> {
        let key = format!("metals.{name}");
        let (conductor, fresnel, microfacets) = match metal {
            Metal::Named(metal) => (self.named_metal(&key, metal)?, FresnelForm::Exact, None),
            Metal::Described(table) => (
                self.described_metal(&key, table, read)?,
                table.fresnel.unwrap_or_default(),
                table.microfacets(),
            ),
        };
        if microfacets.is_some() {
            let places = named.get(name).into_iter().flatten();
            let mut materials = places.map(|&place| &scene.materials[place]);
            let is_metal = |m: &Material| m.metallic_roughness_texture.is_none() && m.transmission == 0.0;
            let cause = "names microfacets, which need a material without transmission and without a texture of metal and roughness";
            self.require(materials.all(is_metal), &key, cause)?;
        }
        if let Metal::Described(table) = metal
            && let Some(reflectance) = table.reflectance
            && reflectance.iter().any(|r| *r > REFLECTANCE_MAX as f32)
        {
            scene.notes.push(Note {
                feature: format!("reflectance above {}", REFLECTANCE_MAX as f32),
                at: key.clone(),
                instead: format!("it is taken as {}: 1 needs an infinite index", REFLECTANCE_MAX as f32),
            });
        }
        self.change_materials(scene, named, [&key, name], |material| {
            material.conductor = Some(conductor);
            material.fresnel = fresnel;
            material.classic_microfacets = microfacets;
            material.metallic = 1.0;
        })
    }

    fn named_metal(&self, key: &str, metal: &str) -> Result<ConductorIor> {
        metals::by_name(metal).ok_or_else(|| {
            let known: Vec<&str> = metals::names().collect();
            self.fault(
                key,
                format!("metal {metal:?} is not known; known: {}", known.join(", ")),
            )
        })
    }

    fn described_metal(&self, key: &str, table: &MetalTable, read: &InputFiles<'_>) -> Result<ConductorIor> {
        let colors = [table.eta, table.k, table.reflectance, table.edge_tint];
        let given = colors.iter().flatten().count()
            + usize::from(table.metal.is_some())
            + usize::from(table.spectrum.is_some());
        let [index, two_colors] = [table.eta.zip(table.k), table.reflectance.zip(table.edge_tint)];
        match (given, &table.metal, &table.spectrum, index, two_colors) {
            (1, Some(metal), ..) => self.named_metal(key, metal),
            (1, _, Some(file), ..) => self.spectrum(&format!("{key}.spectrum"), file, read),
            (2, _, _, Some((eta, k)), _) => {
                let index = ConductorIor {
                    eta: Vec3::from_array(eta),
                    k: Vec3::from_array(k),
                };
                let cause = "needs eta from a millionth to a million and k from 0 to a million";
                self.require(index.is_in_range(), key, cause)?;
                Ok(index)
            }
            (2, .., Some((reflectance, edge_tint))) => {
                metals::by_colors(reflectance.into(), edge_tint.into()).map_err(|error| match error {
                    Error::Setting { name, value, cause } => {
                        self.fault(&format!("{key}.{name}"), format!("{value} {cause}"))
                    }
                    other => other,
                })
            }
            _ => Err(self.fault(
                key,
                "needs one of: metal; spectrum; eta and k; reflectance and edge_tint",
            )),
        }
    }

    /// The channels of a spectrum in a file of its own.
    fn spectrum(&self, key: &str, file: &str, read: &InputFiles<'_>) -> Result<ConductorIor> {
        let bytes = files::read(&self.folder().join(file), read).map_err(|error| self.in_file_of(key, error))?;
        let fault = |cause: &str| self.fault(key, format!("{file}: {cause}"));
        let text = std::str::from_utf8(&bytes).map_err(|_| fault("is not UTF-8"))?;
        let spectrum = metals::IndexSpectrum::parse(text).map_err(|cause| fault(&cause))?;
        Ok(spectrum.channels())
    }

    fn phong(&self, scene: &mut Scene, named: &Named, name: &str, table: &PhongTable) -> Result<()> {
        let key = format!("phong.{name}");
        let &PhongTable { exponent, share } = table;
        self.require(
            (0.0..=PHONG_EXPONENT_MAX).contains(&exponent),
            &key,
            "needs an exponent from 0 to 100000",
        )?;
        let share = share.unwrap_or(1.0);
        self.require((0.0..=1.0).contains(&share), &key, "needs a share from 0 to 1")?;
        self.change_materials(scene, named, [&key, name], |material| {
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
    fn change_materials(
        &self,
        scene: &mut Scene,
        named: &Named,
        [key, name]: [&str; 2],
        change: impl Fn(&mut Material),
    ) -> Result<()> {
        let Some(places) = named.get(name) else {
            return Err(self.unknown_material(scene, key));
        };
        for &place in places {
            change(&mut scene.materials[place]);
        }
        Ok(())
    }

    fn camera(&self, scene: &mut Scene, named: &mut Named, table: &CameraTable) -> Result<()> {
        let key = format!("cameras.{}", table.name);
        let existing = named.get(&table.name).and_then(|places| places.first().copied());
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
            None => {
                named.insert(table.name.clone(), vec![scene.cameras.len()]);
                scene.cameras.push(camera);
            }
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

/// Where in a list the items of each name are.
type Named = HashMap<String, Vec<usize>>;

fn named<'n>(names: impl Iterator<Item = &'n str>) -> Named {
    let mut named = Named::new();
    for (place, name) in names.enumerate() {
        named.entry(name.to_owned()).or_default().push(place);
    }
    named
}

/// What the media of a scene may still read and hold.
struct Budget<'b> {
    read: &'b InputFiles<'b>,
    /// Cells of all density grids so far.
    cells: &'b mut u64,
}

/// Reads a latitude–longitude map. Channels that are negative, as compression leaves them in dark colours, become 0, and texels that are
/// not finite black; both are counted in a note.
fn read_environment(path: &Path, read: &InputFiles<'_>) -> Result<(Environment, Option<Note>)> {
    let fail = |cause: String| Error::Picture {
        path: path.display().to_string(),
        cause,
    };
    let name = path.display().to_string();
    let is_exr = path.extension().is_some_and(|e| e.eq_ignore_ascii_case("exr"));
    let bytes = files::read(path, read)?;
    let read_file = if is_exr { read_exr } else { read_hdr };
    let (width, height, mut radiance) = read_file(&bytes, read).map_err(fail)?;
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

/// Counts the texels of a map before they are allocated: `decoded` bytes each while it is decoded, and those of the scene's own.
fn reserve([width, height]: [u64; 2], decoded: u64, read: &InputFiles<'_>) -> Result<(), String> {
    let texels = width.saturating_mul(height);
    if texels > MAX_TEXELS {
        return Err(format!("has {texels} texels; at most {MAX_TEXELS} are allowed"));
    }
    let kept = texels * size_of::<Vec3>() as u64;
    read.reserve(kept + texels * decoded, kept)
}

fn read_exr(bytes: &[u8], read: &InputFiles<'_>) -> Result<Texels, String> {
    let meta = exr::meta::MetaData::read_from_buffered(Cursor::new(bytes), false).map_err(|error| error.to_string())?;
    let mut most = [0, 0];
    for header in &meta.headers {
        let size = [header.layer_size.width() as u64, header.layer_size.height() as u64];
        if size[0].saturating_mul(size[1]) > most[0] * most[1] {
            most = size;
        }
        // The decoder holds whole blocks of all channels, up to as many as the picture has.
        let channels = header.channels.list.len() as u64;
        let samples = size[0].saturating_mul(size[1]).saturating_mul(channels);
        read.reserve(samples.saturating_mul(4), 0)?;
    }
    reserve(most, 0, read)?;
    let image = exr::prelude::read()
        .no_deep_data()
        .largest_resolution_level()
        .rgba_channels(
            |size, _| (size, vec![Vec3::ZERO; size.area()]),
            |(size, texels), at, (r, g, b, _): (f32, f32, f32, f32)| {
                texels[at.y() * size.width() + at.x()] = Vec3::new(r, g, b)
            },
        )
        .first_valid_layer()
        .all_attributes()
        .from_buffered(Cursor::new(bytes))
        .map_err(|error| error.to_string())?;
    let (size, radiance) = image.layer_data.channel_data.pixels;
    Ok((size.width() as u32, size.height() as u32, radiance))
}

fn read_hdr(bytes: &[u8], read: &InputFiles<'_>) -> Result<Texels, String> {
    let mut reader = ::image::ImageReader::new(Cursor::new(bytes))
        .with_guessed_format()
        .map_err(|error| error.to_string())?;
    let mut limits = ::image::Limits::default();
    limits.max_alloc = Some(MAX_TEXELS * 12);
    reader.limits(limits);
    if reader.format() != Some(::image::ImageFormat::Hdr) {
        return Err("is neither OpenEXR nor Radiance HDR".into());
    }
    let decoder = reader.into_decoder().map_err(|error| error.to_string())?;
    let (width, height) = decoder.dimensions();
    reserve([width.into(), height.into()], 12, read)?;
    let image = ::image::DynamicImage::from_decoder(decoder).map_err(|error| error.to_string())?;
    let image = image.into_rgb32f();
    Ok((width, height, image.pixels().map(|p| Vec3::from_array(p.0)).collect()))
}

/// Rows of the catalogue.
pub(crate) const ROWS: &[Row] = &[Row {
    id: "CL-SIDECAR",
    name: "sidecar of a model: environment, metals, modified Phong surfaces, cameras, exposure, technique, participating media with grids of densities",
    role: Role::Service,
    limits: "Says what glTF cannot; geometry and textures stay in the model.",
    tests: &[
        "engine/tests/scene_load.rs::a_sidecar_adds_what_the_model_cannot_say",
        "engine/tests/scene_load.rs::metals_are_named_measured_or_coloured_and_name_their_form",
        "engine/tests/scene_load.rs::two_colours_of_a_metal_are_kept_or_refused",
        "engine/tests/scene_load.rs::modified_phong_surfaces_are_loaded_and_checked",
        "engine/tests/scene_load.rs::sidecar_faults_have_their_line_or_key",
    ],
    experiment: "tools/models",
    api: &["clerestory::scene::sidecar::Sidecar"],
    ..Row::of(file!())
}];
