//! The instances of a scene flattened to world space, but for those that are [`kept`](super::kept): vertices with what the profile says is used of them, and triangles.
//!
//! Transforms are applied in f64 and rounded once; a mirroring one swaps two corners, so that front faces stay front faces. Triangles
//! keep the order of instances, those of invisible boundaries behind all others: of hits at one distance the first triangle counts, so a
//! surface in the plane of a boundary is met before the boundary is passed.

use std::collections::BTreeMap;

use glam::{DAffine3, DMat3, Vec3};

use super::kept::{Keeping, KeptInstances};
use crate::accel::MAX_COORDINATE;
use crate::gpu::shaders::constants::NO_LIGHT;
use crate::gpu::shaders::types::SceneTriangle;
use crate::raster::ObjectTriangles;
use crate::scene::{Instance, Material, Mesh, Scene, SceneProfile};
use crate::transport::bsdf::Bsdf;
use crate::{Error, Result};

/// All instances flattened to world space, but for those that are kept.
#[derive(Default)]
pub(super) struct Geometry {
    /// Attributes of vertices, and where those of each triangle's corners are; empty without any.
    pub(super) vertices: Vec<[u32; 4]>,
    pub(super) normals: Vec<[f32; 4]>,
    pub(super) uvs: Vec<[f32; 4]>,
    pub(super) tangents: Vec<[f32; 4]>,
    pub(super) colors: Vec<[f32; 4]>,
    pub(super) triangles: Vec<SceneTriangle>,
    /// The instances that are not flattened, where some are not.
    pub(super) kept: Option<KeptInstances>,
    placed_vertices: u32,
}

/// Texels of a triangle's record.
pub(super) const TRIANGLE_TEXELS: u64 = (size_of::<SceneTriangle>() / size_of::<[u32; 4]>()) as u64;

/// Instances in the order of their triangles.
pub(super) fn instances_in_order(scene: &Scene) -> impl Iterator<Item = &Instance> {
    numbered_instances(scene).map(|(_, instance)| instance)
}

/// The same with their numbers in the scene.
pub(super) fn numbered_instances(scene: &Scene) -> impl Iterator<Item = (usize, &Instance)> {
    let all = || scene.instances.iter().enumerate();
    all()
        .filter(|(_, instance)| !bounds_medium(scene, instance))
        .chain(all().filter(|(_, instance)| bounds_medium(scene, instance)))
}

pub(super) fn bounds_medium(scene: &Scene, instance: &Instance) -> bool {
    let material = scene.meshes[instance.mesh as usize].material;
    material.is_some_and(|index| scene.materials[index as usize].boundary)
}

/// Whether a material's factors make it a mirror, or give it a smooth layer.
fn mirrors(material: &Material) -> bool {
    let reflects = material.metallic > 0.0 || material.specular > 0.0;
    reflects && !material.unlit && Bsdf::from_material(material).is_delta()
}

/// Whether they let light through a smooth surface, with a layer or without.
fn transmits(material: &Material) -> bool {
    let bsdf = Bsdf::from_material(material);
    !material.unlit && bsdf.is_delta() && bsdf.metallic < 1.0 && bsdf.transmission > 0.0
}

/// The triangles of each instance that is visible, from the first triangle on.
pub(super) fn visible_objects(scene: &Scene) -> Vec<ObjectTriangles> {
    let mut end = 0;
    numbered_instances(scene)
        .take_while(|(_, instance)| !bounds_medium(scene, instance))
        .map(|(object, instance)| {
            let start = end;
            let mesh = &scene.meshes[instance.mesh as usize];
            let material = mesh.material.map(|index| &scene.materials[index as usize]);
            end += mesh.triangles.len() as u32;
            ObjectTriangles {
                object: object as u32,
                triangles: start..end,
                mirrors: material.is_some_and(mirrors),
                transmits: material.is_some_and(transmits),
            }
        })
        .collect()
}

/// Fails for more triangles or vertices than fit in texel buffers of `limit` texels, before any is placed: a small file may place one mesh a million
/// times. Of the instances that `keeping` keeps each mesh counts once.
pub(super) fn check_placed(scene: &Scene, profile: &SceneProfile, keeping: Option<&Keeping>, limit: u64) -> Result<()> {
    let placed = |of: fn(&Mesh) -> usize| {
        let flattened = (0..scene.instances.len()).filter(|i| keeping.is_none_or(|keeping| !keeping.instances[*i]));
        let placed = flattened.map(|i| of(&scene.meshes[scene.instances[i].mesh as usize]) as u64);
        let kept = keeping.into_iter().flat_map(|keeping| &keeping.meshes);
        placed.sum::<u64>() + kept.map(|mesh| of(&scene.meshes[*mesh as usize]) as u64).sum::<u64>()
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
pub(super) fn has_attributes(profile: &SceneProfile) -> bool {
    profile.has_shading_normals || profile.has_textures || profile.has_normal_maps || profile.has_vertex_colors
}

impl Geometry {
    pub(super) fn flatten(scene: &Scene, profile: &SceneProfile) -> Result<Self> {
        let mut all = Self::default();
        for instance in instances_in_order(scene) {
            all.place(scene, instance, profile)?;
        }
        Ok(all)
    }

    /// Adds the triangles of an instance, in world space.
    pub(super) fn place(&mut self, scene: &Scene, instance: &Instance, profile: &SceneProfile) -> Result<()> {
        let mesh = &scene.meshes[instance.mesh as usize];
        self.add(scene, mesh, &instance.transform, profile)
    }

    /// Adds the triangles of a mesh as they are, in its own space: as an instance that is where it is has them, with normals of unit length.
    pub(super) fn store(&mut self, scene: &Scene, mesh: &Mesh, profile: &SceneProfile) -> Result<()> {
        self.add(scene, mesh, &DAffine3::IDENTITY, profile)
    }

    fn add(&mut self, scene: &Scene, mesh: &Mesh, transform: &DAffine3, profile: &SceneProfile) -> Result<()> {
        let linear = transform.matrix3;
        // Cofactors transform normals without dividing by a determinant that may be zero.
        let cofactors = DMat3::from_cols(
            linear.y_axis.cross(linear.z_axis),
            linear.z_axis.cross(linear.x_axis),
            linear.x_axis.cross(linear.y_axis),
        );
        let flipped = linear.determinant() < 0.0;
        let orientation = if flipped { -1.0 } else { 1.0 };
        let base = self.placed_vertices;
        self.placed_vertices = u32::try_from(mesh.positions.len())
            .ok()
            .and_then(|count| base.checked_add(count))
            .ok_or_else(|| Error::scene(&scene.source, "instances", "place more than 2^32 vertices"))?;
        let end = self.placed_vertices as usize;
        if profile.has_shading_normals {
            let normal = |n: &Vec3| (cofactors * n.as_dvec3() * orientation).normalize_or_zero().as_vec3();
            self.normals
                .extend(mesh.normals.iter().map(|n| normal(n).extend(0.0).to_array()));
            // Zero stands for "flat" in the shader.
            self.normals.resize(end, [0.0; 4]);
        }
        if profile.has_textures {
            let uv = |set: &[glam::Vec2], i: usize| set.get(i).copied().unwrap_or_default();
            self.uvs.extend((0..mesh.positions.len()).map(|i| {
                let (a, b) = (uv(&mesh.uv0, i), uv(&mesh.uv1, i));
                [a.x, a.y, b.x, b.y]
            }));
        }
        if profile.has_normal_maps {
            let tangents = mesh.tangents.iter().map(|t| {
                let world = (linear * t.truncate().as_dvec3()).normalize_or_zero().as_vec3();
                world.extend(t.w * orientation as f32).to_array()
            });
            self.tangents.extend(tangents);
            self.tangents.resize(end, [0.0; 4]);
        }
        if profile.has_vertex_colors {
            self.colors.extend(mesh.colors.iter().map(|c| c.to_array()));
            self.colors.resize(end, [1.0; 4]);
        }
        let material = mesh.material.unwrap_or(scene.materials.len() as u32);
        let has_attributes = has_attributes(profile);
        let place = |p: &Vec3| transform.transform_point3(p.as_dvec3()).as_vec3();
        let positions: Vec<Vec3> = mesh.positions.iter().map(place).collect();
        for &[a, b, c] in &mesh.triangles {
            let (b, c) = if flipped { (c, b) } else { (b, c) };
            self.triangles.push(SceneTriangle {
                a: positions[a as usize].to_array(),
                material,
                b: positions[b as usize].to_array(),
                light: NO_LIGHT,
                c: positions[c as usize].to_array(),
                around: 0,
            });
            if has_attributes {
                self.vertices.push([base + a, base + b, base + c, 0]);
            }
        }
        Ok(())
    }

    /// How many of the triangles are in world space: the first ones.
    pub(super) fn in_world(&self) -> usize {
        self.kept.as_ref().map_or(self.triangles.len(), |kept| kept.names.len())
    }

    /// What hits call a triangle in world space.
    pub(super) fn name(&self, triangle: usize) -> u32 {
        self.kept.as_ref().map_or(triangle as u32, |kept| kept.names[triangle])
    }

    /// The corners' bits, whatever their order: equal for triangles that cover the same points.
    pub(super) fn coincidence_key(triangle: &SceneTriangle) -> [[u32; 3]; 3] {
        // Adding zero makes both zeros one.
        let mut place = corners_of(triangle).map(|p| (p + Vec3::ZERO).to_array().map(f32::to_bits));
        place.sort_unstable();
        place
    }

    /// The first triangle in each place where some triangle `emits`, of those in world space.
    pub(super) fn first_copies(&self, emits: impl Fn(&SceneTriangle) -> bool) -> BTreeMap<[[u32; 3]; 3], usize> {
        let triangles = &self.triangles[..self.in_world()];
        let emitters = triangles.iter().filter(|triangle| emits(triangle));
        let mut first: BTreeMap<_, _> = emitters
            .map(|triangle| (Self::coincidence_key(triangle), triangles.len()))
            .collect();
        if !first.is_empty() {
            for (index, triangle) in triangles.iter().enumerate() {
                if let Some(known) = first.get_mut(&Self::coincidence_key(triangle)) {
                    *known = index.min(*known);
                }
            }
        }
        first
    }

    /// Corners of the triangles in world space.
    pub(super) fn corners(&self) -> Vec<[Vec3; 3]> {
        self.triangles[..self.in_world()].iter().map(corners_of).collect()
    }

    /// Area of all triangles, m²; of those of kept instances as [`KeptInstances::surface_area`] has it.
    pub(super) fn surface_area(&self) -> f64 {
        let area = |triangle: &SceneTriangle| {
            let [a, b, c] = corners_of(triangle).map(|corner| corner.as_dvec3());
            0.5 * (b - a).cross(c - a).length()
        };
        let in_world = self.triangles[..self.in_world()].iter();
        let flattened: f64 = in_world.map(area).filter(|area| area.is_finite()).sum();
        flattened
            + self
                .kept
                .as_ref()
                .map_or(0.0, |kept| kept.surface_area(&self.triangles))
    }

    pub(super) fn bounds(&self) -> [Vec3; 2] {
        let in_world = self.triangles[..self.in_world()].iter();
        let corners = in_world.flat_map(corners_of).filter(is_traceable);
        let (mut lower, mut upper) = corners.fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(lower, upper), p| {
            (lower.min(p), upper.max(p))
        });
        if let Some(kept) = &self.kept {
            (lower, upper) = kept.with_images(lower, upper, &self.triangles);
        }
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
    use super::*;

    #[test]
    fn stored_meshes_are_as_instances_without_a_transform_have_them() {
        let mut scene = Scene::default();
        let mesh = Mesh {
            positions: vec![Vec3::ZERO, Vec3::X, Vec3::new(0.3, 0.7, 0.1)],
            normals: vec![Vec3::new(0.2, 0.3, 4.0), Vec3::ZERO, Vec3::new(-1e-3, 2e-3, 1e-3)],
            triangles: vec![[0, 1, 2]],
            ..Mesh::default()
        };
        scene.place(mesh.clone());
        let profile = SceneProfile::of(&scene);
        assert!(profile.has_shading_normals);
        let flat = Geometry::flatten(&scene, &profile).expect("small");
        let mut stored = Geometry::default();
        stored.store(&scene, &mesh, &profile).expect("small");
        assert_eq!(stored.triangles, flat.triangles);
        assert_eq!(stored.normals, flat.normals);
        for (i, length) in [1.0, 0.0, 1.0].into_iter().enumerate() {
            let [x, y, z, _] = stored.normals[i];
            assert!((Vec3::new(x, y, z).length() - length).abs() < 1e-6, "{i}");
        }
    }

    #[test]
    fn smooth_surfaces_mirror_transmit_or_both() {
        let glass = Material::glass("glass", 1.5);
        let bare = Material {
            specular: 0.0,
            ..glass.clone()
        };
        let rough = Material {
            roughness: 0.3,
            ..glass.clone()
        };
        let closed = Material {
            ior: 0.0,
            ..glass.clone()
        };
        let unlit = Material {
            unlit: true,
            ..glass.clone()
        };
        let metal = Material {
            metallic: 1.0,
            ..glass.clone()
        };
        for (material, expected) in [
            (glass, [true, true]),
            (bare, [false, true]),
            (rough, [false, false]),
            (closed, [true, false]),
            (unlit, [false, false]),
            (metal, [true, false]),
        ] {
            assert_eq!([mirrors(&material), transmits(&material)], expected, "{material:?}");
        }
    }

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
            match check_placed(&scene, &SceneProfile::of(&scene), None, limit) {
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
