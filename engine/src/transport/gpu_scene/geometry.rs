//! All instances of a scene flattened to world space: vertices with what the profile says is used of them, and triangles.
//!
//! Transforms are applied in f64 and rounded once; a mirroring one swaps two corners, so that front faces stay front faces. Triangles
//! keep the order of instances, those of invisible boundaries behind all others: of hits at one distance the first triangle counts, so a
//! surface in the plane of a boundary is met before the boundary is passed.

use std::collections::BTreeMap;

use glam::{DMat3, Vec3};

use crate::accel::MAX_COORDINATE;
use crate::gpu::shaders::constants::NO_LIGHT;
use crate::gpu::shaders::types::SceneTriangle;
use crate::raster::ObjectTriangles;
use crate::scene::{Instance, Mesh, Scene, SceneProfile};
use crate::{Error, Result};

/// All instances flattened to world space.
#[derive(Default)]
pub(super) struct Geometry {
    /// Attributes of vertices, and where those of each triangle's corners are; empty without any.
    pub(super) vertices: Vec<[u32; 4]>,
    pub(super) normals: Vec<[f32; 4]>,
    pub(super) uvs: Vec<[f32; 4]>,
    pub(super) tangents: Vec<[f32; 4]>,
    pub(super) colors: Vec<[f32; 4]>,
    pub(super) triangles: Vec<SceneTriangle>,
}

/// Instances in the order of their triangles.
pub(super) fn instances_in_order(scene: &Scene) -> impl Iterator<Item = &Instance> {
    numbered_instances(scene).map(|(_, instance)| instance)
}

/// The same with their numbers in the scene.
fn numbered_instances(scene: &Scene) -> impl Iterator<Item = (usize, &Instance)> {
    let all = || scene.instances.iter().enumerate();
    all()
        .filter(|(_, instance)| !bounds_medium(scene, instance))
        .chain(all().filter(|(_, instance)| bounds_medium(scene, instance)))
}

fn bounds_medium(scene: &Scene, instance: &Instance) -> bool {
    let material = scene.meshes[instance.mesh as usize].material;
    material.is_some_and(|index| scene.materials[index as usize].boundary)
}

/// The triangles of each instance that is visible, from the first triangle on.
pub(super) fn visible_objects(scene: &Scene) -> Vec<ObjectTriangles> {
    let mut end = 0;
    numbered_instances(scene)
        .take_while(|(_, instance)| !bounds_medium(scene, instance))
        .map(|(object, instance)| {
            let start = end;
            end += scene.meshes[instance.mesh as usize].triangles.len() as u32;
            ObjectTriangles {
                object: object as u32,
                triangles: start..end,
            }
        })
        .collect()
}

/// Fails for more triangles or vertices than fit in texel buffers of `limit` texels, before any is placed: a small file may place one mesh a million
/// times.
pub(super) fn check_placed(scene: &Scene, profile: &SceneProfile, limit: u64) -> Result<()> {
    const TRIANGLE_TEXELS: u64 = (size_of::<SceneTriangle>() / size_of::<[u32; 4]>()) as u64;
    let placed = |of: fn(&Mesh) -> usize| {
        let counts = scene
            .instances
            .iter()
            .map(|at| of(&scene.meshes[at.mesh as usize]) as u64);
        counts.sum::<u64>()
    };
    let vertices = if has_attributes(profile) {
        placed(|mesh| mesh.positions.len())
    } else {
        0
    };
    for (name, value) in [
        ("triangles", TRIANGLE_TEXELS * placed(|mesh| mesh.triangles.len())),
        ("vertices", vertices),
    ] {
        if value > limit {
            return Err(Error::LimitExceeded {
                name: format!("{name} of all instances"),
                value,
                limit_name: "maxTexelBufferElements",
                limit,
            });
        }
    }
    Ok(())
}

/// Whether shading reads more of vertices than where they are.
fn has_attributes(profile: &SceneProfile) -> bool {
    profile.has_shading_normals || profile.has_textures || profile.has_normal_maps || profile.has_vertex_colors
}

impl Geometry {
    pub(super) fn flatten(scene: &Scene, profile: &SceneProfile) -> Result<Self> {
        let mut all = Self::default();
        let default_material = scene.materials.len() as u32;
        let has_attributes = has_attributes(profile);
        let mut placed = 0u32;
        for instance in instances_in_order(scene) {
            let mesh = &scene.meshes[instance.mesh as usize];
            let base = placed;
            placed = u32::try_from(mesh.positions.len())
                .ok()
                .and_then(|count| base.checked_add(count))
                .ok_or_else(|| Error::scene(&scene.source, "instances", "place more than 2^32 vertices"))?;
            let end = placed as usize;
            let linear = instance.transform.matrix3;
            // Cofactors transform normals without dividing by a determinant that may be zero.
            let cofactors = DMat3::from_cols(
                linear.y_axis.cross(linear.z_axis),
                linear.z_axis.cross(linear.x_axis),
                linear.x_axis.cross(linear.y_axis),
            );
            let flipped = linear.determinant() < 0.0;
            let orientation = if flipped { -1.0 } else { 1.0 };
            let positions: Vec<_> = mesh
                .positions
                .iter()
                .map(|p| instance.transform.transform_point3(p.as_dvec3()).as_vec3())
                .collect();
            if profile.has_shading_normals {
                let normal = |n: &Vec3| (cofactors * n.as_dvec3() * orientation).normalize_or_zero().as_vec3();
                all.normals
                    .extend(mesh.normals.iter().map(|n| normal(n).extend(0.0).to_array()));
                // Zero stands for "flat" in the shader.
                all.normals.resize(end, [0.0; 4]);
            }
            if profile.has_textures {
                let uv = |set: &[glam::Vec2], i: usize| set.get(i).copied().unwrap_or_default();
                all.uvs.extend((0..positions.len()).map(|i| {
                    let (a, b) = (uv(&mesh.uv0, i), uv(&mesh.uv1, i));
                    [a.x, a.y, b.x, b.y]
                }));
            }
            if profile.has_normal_maps {
                let tangent = |t: &glam::Vec4| {
                    let world = (linear * t.truncate().as_dvec3()).normalize_or_zero().as_vec3();
                    world.extend(t.w * orientation as f32).to_array()
                };
                all.tangents.extend(mesh.tangents.iter().map(tangent));
                all.tangents.resize(end, [0.0; 4]);
            }
            if profile.has_vertex_colors {
                all.colors.extend(mesh.colors.iter().map(|c| c.to_array()));
                all.colors.resize(end, [1.0; 4]);
            }
            let material = mesh.material.unwrap_or(default_material);
            for &[a, b, c] in &mesh.triangles {
                let (b, c) = if flipped { (c, b) } else { (b, c) };
                all.triangles.push(SceneTriangle {
                    a: positions[a as usize].to_array(),
                    material,
                    b: positions[b as usize].to_array(),
                    light: NO_LIGHT,
                    c: positions[c as usize].to_array(),
                    around: 0,
                });
                if has_attributes {
                    all.vertices.push([base + a, base + b, base + c, 0]);
                }
            }
        }
        Ok(all)
    }

    /// The corners' bits, whatever their order: equal for triangles that cover the same points.
    pub(super) fn coincidence_key(triangle: &SceneTriangle) -> [[u32; 3]; 3] {
        // Adding zero makes both zeros one.
        let mut place = corners_of(triangle).map(|p| (p + Vec3::ZERO).to_array().map(f32::to_bits));
        place.sort_unstable();
        place
    }

    /// The first triangle in each place where some triangle `emits`.
    pub(super) fn first_copies(&self, emits: impl Fn(&SceneTriangle) -> bool) -> BTreeMap<[[u32; 3]; 3], usize> {
        let emitters = self.triangles.iter().filter(|triangle| emits(triangle));
        let mut first: BTreeMap<_, _> = emitters
            .map(|triangle| (Self::coincidence_key(triangle), self.triangles.len()))
            .collect();
        if !first.is_empty() {
            for (index, triangle) in self.triangles.iter().enumerate() {
                if let Some(known) = first.get_mut(&Self::coincidence_key(triangle)) {
                    *known = index.min(*known);
                }
            }
        }
        first
    }

    pub(super) fn corners(&self) -> Vec<[Vec3; 3]> {
        self.triangles.iter().map(corners_of).collect()
    }

    /// Area of all triangles, m².
    pub(super) fn surface_area(&self) -> f64 {
        let area = |triangle: &SceneTriangle| {
            let [a, b, c] = corners_of(triangle).map(|corner| corner.as_dvec3());
            0.5 * (b - a).cross(c - a).length()
        };
        self.triangles.iter().map(area).filter(|area| area.is_finite()).sum()
    }

    pub(super) fn bounds(&self) -> [Vec3; 2] {
        let corners = self.triangles.iter().flat_map(corners_of).filter(is_traceable);
        let (lower, upper) = corners.fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(lower, upper), p| {
            (lower.min(p), upper.max(p))
        });
        if lower.x <= upper.x {
            [lower, upper]
        } else {
            [Vec3::ZERO; 2]
        }
    }
}

/// Whether rays can meet a point at all: the index leaves the others out.
pub(super) fn is_traceable(p: &Vec3) -> bool {
    p.abs().cmple(Vec3::splat(MAX_COORDINATE)).all()
}

/// The corners of a triangle, metres.
pub(super) fn corners_of(triangle: &SceneTriangle) -> [Vec3; 3] {
    [triangle.a, triangle.b, triangle.c].map(Vec3::from_array)
}

#[cfg(test)]
mod tests {
    use glam::DAffine3;

    use super::*;

    #[test]
    fn what_instances_place_is_held_against_the_limit() {
        let mut scene = Scene::default();
        let mut mesh = Mesh {
            positions: vec![Vec3::ZERO; 7],
            triangles: vec![[0, 1, 2]; 2],
            ..Mesh::default()
        };
        let mut refused = |mesh: &Mesh, limit| {
            scene.meshes = vec![mesh.clone()];
            let at = Instance {
                mesh: 0,
                transform: DAffine3::IDENTITY,
                name: String::new(),
            };
            scene.instances = vec![at; 5];
            match check_placed(&scene, &SceneProfile::of(&scene), limit) {
                Err(Error::LimitExceeded { name, value, .. }) => Some((name, value)),
                _ => None,
            }
        };
        // Three texels for each of ten triangles; 35 vertices, of which nothing is kept.
        assert_eq!(refused(&mesh, 30), None);
        assert_eq!(refused(&mesh, 29), Some(("triangles of all instances".into(), 30)));
        mesh.normals = vec![Vec3::Z; 7];
        assert_eq!(refused(&mesh, 34), Some(("vertices of all instances".into(), 35)));
        assert_eq!(refused(&mesh, 35), None);
    }
}
