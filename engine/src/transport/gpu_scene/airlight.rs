//! Whether light on ways through a scene's media is worth equi-angular samples.
//!
//! What they resolve is the glow about a lamp, which grows with the inverse distance down to the lamp's own size. Of lamps that are as large as light
//! flies freely, collisions and next-event estimation find it as well, and a medium that light enters bent alone has no light to sample. The rule
//! decides about noise and time alone, never about what a picture converges to.

use crate::gpu::shaders::constants;
use crate::scene::{DensityGrid, Instance, LightKind, Medium, Scene};
use glam::DVec3;

/// Size of a lamp in mean free paths below which samples are taken. By squared error × time they gain 1.2 at a fifth of one, and lose a fifth at one.
const LAMP_MEAN_FREE_PATHS: f64 = 0.5;

/// Parts that a way through a grid may have, were the grid as dense as its densest cell everywhere. Kernels cut ways into parts of one depth, and each
/// costs a search for the surface: in a plume with one very dense cell, far more than the noise is worth.
const GRID_PARTS_MOST: f64 = 64.0;

/// Whether some lamp's light is, in some medium.
pub(super) fn airlight_helps(scene: &Scene) -> bool {
    let placed = |instance: &Instance| scene.meshes[instance.mesh as usize].material;
    let inside = scene.instances.iter().filter_map(placed).filter_map(|material| {
        let material = &scene.materials[material as usize];
        material.interior.filter(|_| material.boundary)
    });
    let media: Vec<&Medium> = inside
        .chain(scene.surrounding)
        .map(|index| &scene.media[index as usize])
        .collect();
    if media
        .iter()
        .any(|medium| greatest_depth(medium) > GRID_PARTS_MOST * f64::from(constants::AIRLIGHT_DEPTH))
    {
        return false;
    }
    let longest = media
        .iter()
        .filter_map(|medium| mean_free_path(medium))
        .fold(0.0, f64::max);
    let has_point = scene.lights.iter().any(|light| {
        let (LightKind::Point { intensity, .. } | LightKind::Spot { intensity, .. }) = light.kind else {
            return false;
        };
        intensity.max_element() > 0.0
    });
    let mut lamps = scene.instances.iter().filter_map(|instance| lamp_size(scene, instance));
    longest > 0.0 && (has_point || lamps.any(|size| size < LAMP_MEAN_FREE_PATHS * longest))
}

/// Optical depth across a grid's diagonal by its greatest density; 0 of a homogeneous medium.
fn greatest_depth(medium: &Medium) -> f64 {
    medium.density.as_ref().map_or(0.0, |grid| {
        let axes = grid.to_world.matrix3;
        let diagonal = axes.x_axis.length() + axes.y_axis.length() + axes.z_axis.length();
        f64::from(medium.sigma_t().max_element() * grid.max()) * diagonal
    })
}

/// Mean free path at the mean density, in metres; `None` of what does not scatter.
fn mean_free_path(medium: &Medium) -> Option<f64> {
    let scatters = !medium.is_empty() && medium.sigma_s.max_element() > 0.0;
    let density = medium.density.as_ref().map_or(1.0, DensityGrid::mean);
    let extinction = f64::from(medium.sigma_t().element_sum()) / 3.0 * density;
    (scatters && extinction > 0.0).then(|| extinction.recip())
}

/// The side of a square as large as what shines of an instance, in metres; `None` where nothing does.
fn lamp_size(scene: &Scene, instance: &Instance) -> Option<f64> {
    let mesh = &scene.meshes[instance.mesh as usize];
    let material = &scene.materials[mesh.material? as usize];
    if material.emission.max_element() <= 0.0 {
        return None;
    }
    let area: f64 = mesh
        .triangles
        .iter()
        .map(|corners| {
            let [a, b, c] = corners.map(|i| -> DVec3 {
                instance
                    .transform
                    .transform_point3(mesh.positions[i as usize].as_dvec3())
            });
            0.5 * (b - a).cross(c - a).length()
        })
        .sum();
    (area > 0.0).then(|| area.sqrt())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn small_lamps_in_thin_open_media_are_worth_samples() {
        for (address, expected) in [
            ("cornell-box", false),
            ("fog-box", true),
            ("fog-box?source=point&sigma_s=8", true),
            ("fog-box?sigma_s=8", false),
            ("fog-box?sigma_s=8&lamp=0.1", true),
            ("fog-box?sigma_s=0", false),
            ("fog-box?light=0", false),
            ("fog-box?sigma_s=0.1&fill=everywhere", true),
            ("point-in-fog", true),
            // Smoke is thin on average; there light flies as far as its panel is wide in dense smoke only.
            ("smoke", true),
            ("smoke?sigma_t=100", false),
            ("smoke?sigma_t=1e6", false),
            ("smoke?light=0", false),
            // Lit from infinity.
            ("cloud", false),
            // Its medium is inside a solid that refracts, whose surface lets no light to a lamp pass straight.
            ("wax", false),
        ] {
            let scene = crate::scene::load(&format!("builtin:{address}")).expect("scene");
            assert_eq!(airlight_helps(&scene), expected, "{address}");
        }
    }

    #[test]
    fn grids_of_one_very_dense_cell_have_none() {
        for (densest, expected) in [(1.0, true), (1e5, false)] {
            let mut scene = crate::scene::load("builtin:smoke").expect("scene");
            let grid = scene.media[0].density.as_mut().expect("a grid");
            grid.values[0] = densest;
            assert_eq!(airlight_helps(&scene), expected, "{densest}");
        }
    }
}
