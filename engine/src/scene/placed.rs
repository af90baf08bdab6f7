//! What the instances of a file cost: a mesh that is placed again is stored once where that can be done, and copied elsewhere.

use glam::{DAffine3, DMat3, DVec3};

use super::{Instance, Mesh, Scene};

/// Bytes that a triangle takes on the device where its instance is flattened, an index left out.
const PLACED_TRIANGLE: u64 = 48;

/// Bytes that an instance takes where its mesh is stored once, about.
const SHARED_INSTANCE: u64 = 272;

/// Instances from which on all are flattened.
const MOST_SHARED: usize = 1 << 20;

/// Entries of transforms, and products of the largest with that of the inverse, within these are traced through: stricter by a factor of two or more than
/// where a scene is uploaded.
const SHARED_SCALE: f64 = 524_288.0;
const SHARED_UNEVENNESS: f64 = 32_768.0;

/// Extents and coordinates that shared meshes and their images have, in their spaces.
const LEAST_EXTENT: f64 = 2e-12;
const MOST_COORDINATE: f64 = 5e8;

/// Bytes on the device of the instances of meshes that are placed before: those of a mesh's first instance are in the file.
pub(super) fn placed_again(scene: &Scene) -> u64 {
    let mut boxes = vec![None; scene.meshes.len()];
    let mut again = 0u64;
    for instance in &scene.instances {
        let Some(mesh) = scene.meshes.get(instance.mesh as usize) else {
            continue;
        };
        let Some(bounds) = boxes[instance.mesh as usize] else {
            boxes[instance.mesh as usize] = Some(mesh.bounds().map(|p| p.as_dvec3()));
            continue;
        };
        let flattened = PLACED_TRIANGLE.saturating_mul(mesh.triangles.len() as u64);
        let shared = scene.instances.len() < MOST_SHARED && is_shared(scene, mesh, instance, bounds);
        again = again.saturating_add(if shared {
            flattened.min(SHARED_INSTANCE)
        } else {
            flattened
        });
    }
    again
}

/// Whether a mesh that is placed again needs no copy in any scene: what emits light, and bodies, may need one.
fn is_shared(scene: &Scene, mesh: &Mesh, instance: &Instance, [lower, upper]: [DVec3; 2]) -> bool {
    let material = mesh.material.and_then(|index| scene.materials.get(index as usize));
    let copied = material.is_some_and(|material| {
        material.emission.max_element() > 0.0
            || material.boundary
            || material.transmission > 0.0 && material.thickness > 0.0
    });
    let farthest = lower.abs().max(upper.abs());
    let DAffine3 { matrix3, translation } = instance.transform;
    let image = matrix3.abs() * farthest + translation.abs();
    // Comparisons that NaN fails.
    !copied
        && is_even(&matrix3)
        && (upper - lower).max_element() >= LEAST_EXTENT
        && farthest.max_element() <= MOST_COORDINATE
        && image.max_element() <= MOST_COORDINATE
}

fn is_even(matrix: &DMat3) -> bool {
    let largest = |m: &DMat3| m.to_cols_array().iter().fold(0.0f64, |largest, x| largest.max(x.abs()));
    let inverse = matrix.inverse();
    let in_range = |size: f64| (1.0 / SHARED_SCALE..=SHARED_SCALE).contains(&size);
    let (size, inverse_size) = (largest(matrix), largest(&inverse));
    matrix.determinant() != 0.0
        && inverse.is_finite()
        && in_range(size)
        && in_range(inverse_size)
        && size * inverse_size <= SHARED_UNEVENNESS
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;
    use crate::scene::Material;

    #[test]
    fn meshes_that_are_placed_again_cost_an_instance_or_a_copy() {
        let mut scene = Scene::default();
        let lamp = scene.add_material(Material {
            emission: Vec3::ONE,
            ..Material::default()
        });
        let mut mesh = Mesh {
            positions: vec![Vec3::ZERO, Vec3::X, Vec3::Y],
            triangles: vec![[0, 1, 2]; 100],
            ..Mesh::default()
        };
        let cost = |mesh: &Mesh, transform: DAffine3| {
            let at = |transform| Instance {
                mesh: 0,
                transform,
                name: String::new(),
            };
            let scene = Scene {
                meshes: vec![mesh.clone()],
                instances: vec![at(DAffine3::IDENTITY), at(transform), at(transform)],
                materials: scene.materials.clone(),
                ..Scene::default()
            };
            placed_again(&scene)
        };
        assert_eq!(
            cost(&mesh, DAffine3::from_scale(DVec3::splat(2.0))),
            2 * SHARED_INSTANCE
        );
        let copies = 2 * 100 * PLACED_TRIANGLE;
        for transform in [
            DAffine3::from_scale(DVec3::new(1.0, 0.0, 1.0)),
            DAffine3::from_scale(DVec3::new(1.0, 1e-5, 1.0)),
            DAffine3::from_translation(DVec3::splat(1e9)),
        ] {
            assert_eq!(cost(&mesh, transform), copies, "{transform:?}");
        }
        mesh.material = Some(lamp);
        assert_eq!(cost(&mesh, DAffine3::IDENTITY), copies);
        mesh.material = None;
        mesh.triangles.truncate(2);
        assert_eq!(cost(&mesh, DAffine3::IDENTITY), 4 * PLACED_TRIANGLE);
    }
}
