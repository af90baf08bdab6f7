//! The spheres on which rough surfaces of the engine and of Cycles are compared.
//!
//! A sphere of flat faces is convex, so that light meets a metal once, and a picture shows it from all angles of sight. Under a sky of radiance 1 a
//! pixel is the albedo towards the eye; under a sun from the side it is the lobe itself, with grazing light, where forms of masking differ most.
//! Guarantees: a pure function; the exporter accepts every one (a test checks it).

use clerestory::scene::{ConductorIor, LightKind, Material, Scene, builtin, metals};
use clerestory::{Error, Result};
use glam::Vec3;

use super::MOST_BOUNCES;

/// Perceptual roughnesses; α is their square.
pub const ROUGHNESSES: [f64; 4] = [0.1, 0.3, 0.6, 1.0];
/// Half of the picture's height is 1: the sphere has the radius 0.795 in it, and covers this disc whole.
pub const DISC: f64 = 0.75;

/// The sphere as it is seen: a few pixels a face, so that most pixels see one.
const ADDRESS: &str = "builtin:white-furnace?frequency=6";
const IOR: f32 = 1.5;
const TINT: Vec3 = Vec3::new(0.9, 0.6, 0.3);
const TO_SUN: Vec3 = Vec3::new(0.8, 0.5, 0.33);
const IRRADIANCE: f32 = 2.0;

/// What the sphere is made of.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Substance {
    /// Reflects everything.
    WhiteMetal,
    /// By Schlick's factor.
    TintedMetal,
    /// By its complex index.
    Gold,
    /// Clear and solid.
    Glass,
}

impl Substance {
    /// All of them.
    pub const ALL: [Self; 4] = [Self::WhiteMetal, Self::TintedMetal, Self::Gold, Self::Glass];

    /// In words.
    pub fn name(self) -> &'static str {
        match self {
            Self::WhiteMetal => "white metal",
            Self::TintedMetal => "tinted metal",
            Self::Gold => "gold",
            Self::Glass => "glass",
        }
    }

    fn material(self, roughness: f32) -> Result<Material> {
        let metal = |color, conductor: Option<ConductorIor>| Material {
            roughness,
            conductor,
            ..Material::mirror(self.name(), color)
        };
        Ok(match self {
            Self::WhiteMetal => metal(Vec3::ONE, None),
            Self::TintedMetal => metal(TINT, None),
            Self::Gold => {
                let gold = metals::by_name("gold");
                let gold = gold.ok_or_else(|| Error::setting("metal", "gold", "is not known"))?;
                metal(Vec3::ONE, Some(gold))
            }
            Self::Glass => Material {
                roughness,
                ..Material::glass(self.name(), IOR)
            },
        })
    }
}

/// Where light comes from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Source {
    /// Radiance 1 from everywhere.
    Sky,
    /// One direction, from the side.
    Sun,
}

impl Source {
    /// Both.
    pub const ALL: [Self; 2] = [Self::Sky, Self::Sun];

    /// In a word.
    pub fn name(self) -> &'static str {
        match self {
            Self::Sky => "sky",
            Self::Sun => "sun",
        }
    }
}

/// A sphere to compare.
#[derive(Debug, Clone)]
pub struct Sphere {
    /// Its substance.
    pub substance: Substance,
    /// Its light.
    pub source: Source,
    /// Its perceptual roughness.
    pub roughness: f64,
    /// The scene; its first camera is used.
    pub scene: Scene,
    /// The light paths, as our setting.
    pub path_set: &'static str,
    /// The light paths, as Cycles limits them.
    pub bounces: u32,
}

impl Sphere {
    /// A sphere of flat faces.
    ///
    /// # Errors
    /// Those of the generated scene.
    pub fn new(substance: Substance, source: Source, roughness: f64) -> Result<Self> {
        let mut scene = builtin::generate(ADDRESS)?;
        let material = scene.add_material(substance.material(roughness as f32)?);
        for mesh in &mut scene.meshes {
            mesh.material = Some(material);
        }
        if source == Source::Sun {
            scene.environment = None;
            scene.add_light(
                "sun",
                LightKind::Directional {
                    direction: -TO_SUN.normalize(),
                    irradiance: Vec3::splat(IRRADIANCE),
                },
            );
        }
        // Under the sun glass shows its reflection alone: light that went through it has met another form of masking.
        let (path_set, bounces) = match (substance, source) {
            (Substance::Glass, Source::Sun) => ("direct", 0),
            _ => ("all", MOST_BOUNCES),
        };
        Ok(Self {
            substance,
            source,
            roughness,
            scene,
            path_set,
            bounces,
        })
    }

    /// All of them, rougher ones behind smoother ones.
    ///
    /// # Errors
    /// As [`Sphere::new`].
    pub fn all() -> Result<Vec<Self>> {
        let mut all = Vec::new();
        for substance in Substance::ALL {
            for source in Source::ALL {
                for roughness in ROUGHNESSES {
                    all.push(Self::new(substance, source, roughness)?);
                }
            }
        }
        Ok(all)
    }

    /// In words; also as the name of its files.
    pub fn name(&self) -> String {
        let (substance, source) = (self.substance.name(), self.source.name());
        format!("{substance} {source} {}", self.roughness).replace(' ', "-")
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cycles::export;
    use std::collections::BTreeSet;

    #[test]
    fn every_sphere_is_exported_and_has_its_light() {
        let folder = tempfile::tempdir().unwrap();
        let all = Sphere::all().unwrap();
        for sphere in &all {
            let path = folder.path().join(sphere.name());
            export(&sphere.scene, "", [8; 2], sphere.bounces, &path).unwrap();
            assert_eq!(sphere.scene.lights.is_empty(), sphere.source == Source::Sky);
            assert_eq!(sphere.scene.environment.is_none(), sphere.source == Source::Sun);
        }
        let names: BTreeSet<String> = all.iter().map(Sphere::name).collect();
        assert_eq!((names.len(), names.contains("white-metal-sky-0.1")), (32, true));
    }

    #[test]
    fn the_disc_lies_in_the_sphere() {
        let sphere = Sphere::new(Substance::Gold, Source::Sky, 1.0).unwrap();
        let clerestory::scene::Projection::Perspective { fov_y } = sphere.scene.cameras[0].projection else {
            panic!("a perspective");
        };
        // Of a sphere of radius 1 at distance 4, whose faces cut off less than a hundredth.
        let radius = (0.99f64 / 4.0).asin().tan() / (0.5 * f64::from(fov_y)).tan();
        assert!(radius > DISC && radius < 0.8, "{radius}");
    }
}
