//! Surfaces of bodies that reflect, as several generated scenes have them.

use glam::Vec3;

use crate::scene::{Material, metals};

/// Reflectance of a mirror.
const MIRROR: f32 = 0.95;

/// What a body that reflects is made of, by a word: `mirror`, `plastic` of this colour, or else gold; of this perceptual roughness.
pub fn glossy(word: &str, color: Vec3, roughness: f32) -> Material {
    match word {
        "mirror" => Material {
            roughness,
            ..Material::mirror(word, Vec3::splat(MIRROR))
        },
        "plastic" => plastic(word, color, roughness),
        _ => Material {
            conductor: metals::by_name("gold"),
            roughness,
            ..Material::mirror("gold", Vec3::ONE)
        },
    }
}

/// A matte colour below a dielectric coat of this perceptual roughness.
pub fn plastic(name: &str, color: Vec3, roughness: f32) -> Material {
    Material {
        specular: 1.0,
        roughness,
        ..Material::lambert(name, color)
    }
}
