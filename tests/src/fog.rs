//! Media of tests: coloured fog, a denser body of it behind an invisible boundary, and densities that change across a box.

use clerestory::scene::{DensityGrid, Material, Medium, Phase, Scene};
use glam::{DVec3, Vec3};

/// A medium whose bands come differently far.
pub fn fog(phase: Phase) -> Medium {
    Medium {
        sigma_s: Vec3::new(0.4, 0.6, 0.9),
        sigma_a: Vec3::new(0.2, 0.1, 0.05),
        phase,
        ..Medium::default()
    }
}

/// Adds a medium three to four times as dense, and the material of an invisible boundary around it, whose number is returned.
pub fn add_boundary(scene: &mut Scene, phase: Phase) -> u32 {
    let interior = scene.media.len() as u32;
    scene.media.push(Medium {
        sigma_s: Vec3::new(2.0, 3.0, 4.0),
        ..fog(phase)
    });
    scene.add_material(Material {
        name: "boundary".into(),
        boundary: true,
        interior: Some(interior),
        ..Material::default()
    })
}

/// A density that changes across a box.
pub fn uneven_density(lower: DVec3, upper: DVec3) -> DensityGrid {
    let density = |p: DVec3| (2.0 * p.x * (0.5 + 0.5 * (7.0 * p.y).sin()) + 0.3 * p.z) as f32;
    DensityGrid::from_fn([8, 12, 6], density).in_box(lower, upper)
}
