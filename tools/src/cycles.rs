//! Export to Cycles, Blender's path tracer, and its pictures: the renderer beside which height-correlated masking is checked, which Mitsuba lacks.
//!
//! A scene becomes one JSON file, which `tools/cycles/reference.py` builds and renders. Only what Cycles models in the same way is written; everything
//! else is refused with material and reason. Conventions, checked by experiment with Cycles 5.0.1: cameras look along −Z and suns shine along it, as
//! here; a sun's strength is its irradiance; α is the square of roughness; the distribution `GGX` scatters once under height-correlated masking, of
//! reflected and of refracted light alike, and `MULTI_GGX` is the same lobe scaled to the albedo of all orders; radiance of light that is refracted
//! once is not scaled by the square of the index, which cancels where it leaves again; F82 with a white edge is Schlick's factor.
//! Guarantees: a deterministic file; none is written for a scene that is refused.

mod peer;
pub mod scenes;

use std::path::Path;

use clerestory::atomic;
use clerestory::scene::{Camera, Environment, FresnelForm, LightKind, Material, Projection, Scene};
use clerestory::{Error, Result};
use glam::{DMat4, Vec3};
use serde::Serialize;

use crate::mitsuba::find_camera;
use crate::mitsuba::mesh::world_mesh;
use crate::mitsuba::surface::{base_color, refuse_common, refuse_unclear};

pub use peer::{Distribution, PYTHON_VARIABLE, Peer, Rendered, Request, cycles_version};

/// Bounces of a scene whose paths are not to be cut: as many as Cycles takes.
pub const MOST_BOUNCES: u32 = 1024;

/// A scene as the script reads it.
#[derive(Debug, Serialize)]
struct SceneFile {
    size: [u32; 2],
    /// Scatterings after the first; 0 is light that comes straight from suns.
    bounces: u32,
    /// Radiance from everywhere.
    sky: Vec3,
    camera: CameraFile,
    meshes: Vec<MeshFile>,
    suns: Vec<SunFile>,
}

#[derive(Debug, Serialize)]
struct CameraFile {
    /// Radians; none where lines of sight are parallel.
    fov_y: Option<f32>,
    /// Metres, where they are.
    half_height: Option<f32>,
    /// The upper rows of the matrix from camera space.
    to_world: [[f64; 4]; 3],
}

#[derive(Debug, Serialize)]
struct MeshFile {
    positions: Vec<Vec3>,
    triangles: Vec<[u32; 3]>,
    surface: Surface,
}

#[derive(Debug, Serialize)]
struct SunFile {
    /// In which light travels.
    direction: Vec3,
    irradiance: Vec3,
}

/// Surfaces that are the same function on both sides.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
enum Surface {
    Diffuse { color: Vec3 },
    WhiteMetal { roughness: f32 },
    SchlickMetal { color: Vec3, roughness: f32 },
    Conductor { eta: Vec3, k: Vec3, roughness: f32 },
    Glass { ior: f32, roughness: f32 },
}

impl Surface {
    /// That of a material, or why there is none.
    fn of(material: &Material) -> Result<Self, String> {
        refuse_common(material)?;
        if material.boundary {
            return Err("an invisible boundary is not exported".into());
        }
        if material.emission != Vec3::ZERO {
            return Err("light of surfaces is not exported".into());
        }
        let roughness = material.roughness;
        if material.metallic == 1.0 {
            let color = base_color(material)?;
            return Ok(match material.conductor {
                Some(_) if material.fresnel != FresnelForm::Exact => {
                    return Err(format!(
                        "a metal by the form {} of its Fresnel factor has no counterpart",
                        material.fresnel
                    ));
                }
                _ if material.classic_microfacets.is_some() => {
                    return Err("classical microfacets are not exported".into());
                }
                Some(conductor) => Self::Conductor {
                    eta: conductor.eta,
                    k: conductor.k,
                    roughness,
                },
                // Schlick's factor with F0 = 1 is 1 at every angle.
                None if color == Vec3::ONE => Self::WhiteMetal { roughness },
                None => Self::SchlickMetal { color, roughness },
            });
        }
        if material.metallic != 0.0 {
            return Err(format!(
                "metallic {} mixes a metal with a dielectric",
                material.metallic
            ));
        }
        if material.transmission > 0.0 {
            refuse_unclear(material)?;
            return Ok(Self::Glass {
                ior: material.ior,
                roughness,
            });
        }
        if material.specular == 0.0 || material.ior == 1.0 {
            return Ok(Self::Diffuse {
                color: base_color(material)?,
            });
        }
        Err("a dielectric layer over a diffuse base has no exact counterpart; set specular to 0 for Lambert".into())
    }
}

/// Writes a scene as seen by a camera (`""`: the first), `size` pixels, to the file `path`. Paths scatter `bounces` times after the first time at
/// most ([`MOST_BOUNCES`] for no limit).
///
/// # Errors
/// [`Error::Unsupported`] with every reason when Cycles cannot model the scene in the same way; [`Error::Setting`] for a camera or size that does
/// not exist; [`Error::Io`] when the file cannot be written.
pub fn export(scene: &Scene, camera: &str, size: [u32; 2], bounces: u32, path: &Path) -> Result<()> {
    if size.contains(&0) {
        return Err(Error::setting(
            "size",
            format!("{}x{}", size[0], size[1]),
            "has no pixels",
        ));
    }
    let camera = find_camera(scene, camera)?;
    let mut reasons = Vec::new();
    let mut meshes = Vec::new();
    for instance in &scene.instances {
        let world = world_mesh(scene, instance, false).and_then(|mesh| {
            let surface = Surface::of(&mesh.material);
            let surface = surface.map_err(|cause| format!("material {:?}: {cause}", mesh.material.name))?;
            Ok(MeshFile {
                positions: mesh.positions,
                triangles: mesh.triangles,
                surface,
            })
        });
        match world {
            Ok(mesh) => meshes.push(mesh),
            Err(reason) => reasons.push(reason),
        }
    }
    meshes.retain(|mesh| !mesh.triangles.is_empty());
    if !scene.media.is_empty() {
        reasons.push("media are not exported".into());
    }
    let mut suns = Vec::new();
    for light in &scene.lights {
        match light.kind {
            LightKind::Directional { direction, irradiance } => suns.push(SunFile { direction, irradiance }),
            _ => reasons.push(format!("light {:?}: only directional lights are exported", light.name)),
        }
    }
    let sky = scene.environment.as_ref().map_or(Ok(Vec3::ZERO), sky_of);
    let sky = sky.unwrap_or_else(|reason| {
        reasons.push(reason);
        Vec3::ZERO
    });
    if camera.lens_radius > 0.0 {
        reasons.push(format!("camera {:?}: lenses are not exported", camera.name));
    }
    if !reasons.is_empty() {
        reasons.sort();
        reasons.dedup();
        return Err(Error::Unsupported {
            technique: "cycles-export".into(),
            reasons,
        });
    }
    let file = SceneFile {
        size,
        bounces: bounces.min(MOST_BOUNCES),
        sky,
        camera: CameraFile::of(camera),
        meshes,
        suns,
    };
    let name = path.display();
    let text = serde_json::to_string(&file).map_err(|cause| Error::setting("scene", name, cause.to_string()))?;
    if let Some(folder) = path.parent() {
        std::fs::create_dir_all(folder).map_err(|cause| Error::io(folder, cause))?;
    }
    atomic::write(path, text.as_bytes())
}

/// Radiance of an environment that is the same everywhere.
fn sky_of(environment: &Environment) -> Result<Vec3, String> {
    match environment.radiance.as_slice() {
        [radiance] => Ok(*radiance * environment.strength),
        _ => Err(format!(
            "environment {:?}: maps are not exported, only one radiance from everywhere",
            environment.name
        )),
    }
}

impl CameraFile {
    fn of(camera: &Camera) -> Self {
        let (fov_y, half_height) = match camera.projection {
            Projection::Perspective { fov_y } => (Some(fov_y), None),
            Projection::Orthographic { half_height } => (None, Some(half_height)),
        };
        let matrix = DMat4::from(camera.transform);
        Self {
            fov_y,
            half_height,
            to_world: [0, 1, 2].map(|row| matrix.row(row).to_array()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use clerestory::scene::{ConductorIor, builtin};
    use glam::Vec4;

    fn sphere() -> Scene {
        let mut scene = builtin::generate("builtin:white-furnace?metallic=1&frequency=2").unwrap();
        scene.meshes[0].normals.clear();
        scene.meshes[0].tangents.clear();
        scene
    }

    fn written(scene: &Scene) -> Result<serde_json::Value> {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("scene.json");
        export(scene, "", [8, 4], 3, &path)?;
        Ok(serde_json::from_slice(&std::fs::read(path).unwrap()).unwrap())
    }

    #[test]
    fn a_scene_is_written_as_the_script_reads_it() {
        let mut scene = sphere();
        scene.add_light(
            "sun",
            LightKind::Directional {
                direction: Vec3::NEG_Y,
                irradiance: Vec3::new(2.0, 1.0, 0.5),
            },
        );
        let file = written(&scene).unwrap();
        assert_eq!(file["size"], serde_json::json!([8, 4]));
        assert_eq!((&file["bounces"], &file["sky"][2]), (&3.into(), &1.0.into()));
        assert_eq!(file["meshes"][0]["surface"]["kind"], "white_metal");
        assert_eq!(file["meshes"][0]["triangles"].as_array().map(Vec::len), Some(80));
        assert_eq!(file["camera"]["to_world"][2], serde_json::json!([0.0, 0.0, 1.0, 4.0]));
        assert!(file["camera"]["fov_y"].is_number() && file["camera"]["half_height"].is_null());
        assert_eq!(file["suns"][0]["direction"][1], -1.0);
        let script = include_str!("../cycles/reference.py");
        for name in ["sky", "bounces", "irradiance", "fov_y", "half_height", "to_world"] {
            assert!(script.contains(&format!("[\"{name}\"]")), "{name}");
        }
    }

    #[test]
    fn materials_become_surfaces_that_the_script_knows() {
        let script = include_str!("../cycles/reference.py");
        let metal = Material {
            roughness: 0.25,
            ..Material::default()
        };
        let gold = ConductorIor {
            eta: Vec3::new(0.2, 0.5, 1.3),
            k: Vec3::new(3.0, 2.3, 1.8),
        };
        let tinted = Material {
            base_color: Vec4::new(0.5, 0.25, 1.0, 1.0),
            ..metal.clone()
        };
        let conductor = Material {
            conductor: Some(gold),
            ..metal.clone()
        };
        for (material, kind) in [
            (metal, "white_metal"),
            (tinted, "schlick_metal"),
            (conductor, "conductor"),
            (Material::glass("glass", 1.5), "glass"),
            (Material::lambert("wall", Vec3::splat(0.5)), "diffuse"),
        ] {
            let surface = serde_json::to_value(Surface::of(&material).unwrap()).unwrap();
            assert_eq!(surface["kind"], kind);
            assert!(script.contains(&format!("kind == \"{kind}\"")), "{kind}");
        }
    }

    #[test]
    fn what_cycles_models_otherwise_is_refused() {
        type Edit = fn(&mut Scene);
        let cases: [(Edit, &str); 6] = [
            (|scene| scene.materials[0].metallic = 0.5, "mixes"),
            (|scene| scene.materials[0].metallic = 0.0, "dielectric layer"),
            (|scene| scene.materials[0].emission = Vec3::ONE, "light of surfaces"),
            (|scene| scene.cameras[0].lens_radius = 0.1, "lenses"),
            (
                |scene| {
                    if let Some(environment) = &mut scene.environment {
                        environment.radiance = vec![Vec3::ONE; 2];
                    }
                },
                "maps are not",
            ),
            (
                |scene| {
                    let lamp = LightKind::Point {
                        position: Vec3::ONE,
                        intensity: Vec3::ONE,
                    };
                    scene.add_light("lamp", lamp);
                },
                "\"lamp\"",
            ),
        ];
        for (edit, reason) in cases {
            let mut scene = sphere();
            edit(&mut scene);
            let refused = written(&scene).unwrap_err().to_string();
            assert!(refused.contains(reason), "{reason}: {refused}");
        }
        let path = Path::new("never-made");
        assert!(export(&sphere(), "", [0, 8], 0, path).is_err() && export(&sphere(), "back", [8; 2], 0, path).is_err());
    }
}
