//! What halls are built of: columns, and parts that stand about in quarter turns.

use glam::Vec3;

use super::shapes::{MeshBuilder, lathe};
use crate::scene::Mesh;

/// A column with base and capital, `height` tall with a shaft of `radius`.
pub fn column(name: &str, material: u32, radius: f64, height: f64, segments: u32) -> Mesh {
    let outline = [
        (0.0, 0.0),
        (1.5, 0.0),
        (1.5, 0.04),
        (1.25, 0.06),
        (1.3, 0.08),
        (1.0, 0.1),
        (1.02, 0.4),
        (0.9, 0.88),
        (1.15, 0.92),
        (1.4, 0.97),
        (1.4, 1.0),
        (0.0, 1.0),
    ];
    let scaled = outline.map(|(r, y)| (r * radius, y * height));
    lathe(name, material, &scaled, segments)
}

/// Adds a mesh turned by quarters about +Y, then moved.
pub fn put(to: &mut MeshBuilder, mesh: &Mesh, quarters: u32, offset: Vec3) {
    to.append(mesh, |p| {
        let turned = match quarters % 4 {
            0 => p,
            1 => Vec3::new(p.z, p.y, -p.x),
            2 => Vec3::new(-p.x, p.y, -p.z),
            _ => Vec3::new(-p.z, p.y, p.x),
        };
        turned + offset
    });
}
