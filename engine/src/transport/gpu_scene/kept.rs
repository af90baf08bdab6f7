//! Instances that are kept: their meshes are stored once, in their own space, and an index of two levels places them.
//!
//! Kept is an instance of a mesh that is placed more than once, where rays can be traced through its transform. Flattened, as all instances are
//! elsewhere, are those of materials that emit, since light sampling chooses among triangles in world space; those of bodies in scenes with media, which know what is around them; and
//! those by transforms that are too uneven ([`InstanceTransform::of`]). All triangles have the numbers that they would have if all were
//! flattened. A kept triangle that lies exactly where an emitting one lies is not looked for, as flattened ones are: light sampling takes the emitter as if it were in front.

use glam::{DAffine3, DMat3, DVec3, Vec3};

use super::bodies::bounds_body;
use super::geometry::{Geometry, corners_of, has_attributes, is_traceable, numbered_instances};
use crate::accel::two_level::{INSTANCE_BYTES, InstanceTransform, MAX_INSTANCES, MeshGeometry, Placement, TwoLevelBvh};
use crate::accel::wide::WideSettings;
use crate::gpu::shaders::constants::INSTANCE_IDENTITY;
use crate::gpu::shaders::types::{SceneInstance, SceneTriangle};
use crate::scene::{Instance, Mesh, Scene, SceneProfile};
use crate::{Error, Result};

/// How many times what keeping instances needs flattening must need for that to be chosen: rays in two levels take longer.
pub(super) const WORTH_RATIO: u64 = 8;

/// Bytes that flattening must need, at least, for instances to be kept where nothing else is asked for.
pub(super) const WORTH_BYTES: u64 = 64 << 20;

/// Texels of a ray index over a triangle, about: its own three, and its share of the nodes.
const INDEX_TEXELS: u64 = 4;

/// What decoded boxes of a tree's root may exceed those of its mesh by, as a share of their extent: 2/127.
const BOX_SPARE: f64 = 2.0 / 127.0;

/// Which instances are kept.
#[derive(Debug, Clone)]
pub(super) struct Keeping {
    /// Of each instance of the scene.
    pub instances: Vec<bool>,
    /// Their meshes, each once, ascending.
    pub meshes: Vec<u32>,
}

impl Keeping {
    /// All that can be kept; `None` where that is nothing.
    pub fn of(scene: &Scene, profile: &SceneProfile) -> Option<Self> {
        let mut placed = vec![0u32; scene.meshes.len()];
        for instance in &scene.instances {
            placed[instance.mesh as usize] += 1;
        }
        let can_be_kept = |mesh: &Mesh| {
            let material = mesh.material.map(|index| &scene.materials[index as usize]);
            let emits = material.is_some_and(|material| material.emission.max_element() > 0.0);
            let bounds =
                material.is_some_and(|material| material.boundary || profile.media.any() && bounds_body(material));
            !mesh.triangles.is_empty() && !emits && !bounds
        };
        let parts: Vec<Option<[DVec3; 2]>> = scene
            .meshes
            .iter()
            .zip(&placed)
            .map(|(mesh, placed)| (*placed > 1 && can_be_kept(mesh)).then(|| spared_box(mesh)))
            .collect();
        let mut kept_meshes = vec![false; scene.meshes.len()];
        let instances: Vec<bool> = scene
            .instances
            .iter()
            .map(|instance| {
                let kept = parts[instance.mesh as usize]
                    .is_some_and(|part| InstanceTransform::of(&instance.transform, &[part]).is_some());
                kept_meshes[instance.mesh as usize] |= kept;
                kept
            })
            .collect();
        let meshes: Vec<u32> = (0u32..)
            .zip(&kept_meshes)
            .filter(|(_, kept)| **kept)
            .map(|(i, _)| i)
            .collect();
        // One more place is for all that is flattened.
        (!meshes.is_empty() && scene.instances.len() < MAX_INSTANCES).then_some(Self { instances, meshes })
    }

    /// Whether it is worth it: flattening would need [`WORTH_RATIO`] times as many bytes, and [`WORTH_BYTES`] or more; or would not fit into texel buffers of
    /// `limit` texels.
    pub fn pays(&self, scene: &Scene, profile: &SceneProfile, limit: u64) -> bool {
        let triangle_bytes = (size_of::<SceneTriangle>() + INDEX_TEXELS as usize * size_of::<[u32; 4]>()) as u64;
        let vector = size_of::<[f32; 4]>() as u64;
        let attributes = [
            profile.has_shading_normals,
            profile.has_textures,
            profile.has_normal_maps,
            profile.has_vertex_colors,
        ];
        let vertex_bytes = vector * attributes.into_iter().filter(|has| *has).count() as u64;
        let corner_bytes = if has_attributes(profile) { vector } else { 0 };
        let bytes = |mesh: &Mesh| {
            (triangle_bytes + corner_bytes) * mesh.triangles.len() as u64 + vertex_bytes * mesh.positions.len() as u64
        };
        let (mut flattened, mut kept, mut triangles) = (0, 0, 0);
        for (instance, keeps) in scene.instances.iter().zip(&self.instances) {
            let mesh = &scene.meshes[instance.mesh as usize];
            flattened += bytes(mesh);
            triangles += mesh.triangles.len() as u64;
            kept += match keeps {
                true => INSTANCE_BYTES + size_of::<SceneInstance>() as u64,
                false => bytes(mesh),
            };
        }
        kept += self
            .meshes
            .iter()
            .map(|mesh| bytes(&scene.meshes[*mesh as usize]))
            .sum::<u64>();
        let fits = INDEX_TEXELS * triangles <= limit;
        !fits || flattened >= WORTH_BYTES && flattened >= WORTH_RATIO * kept
    }
}

/// The box of a mesh, as much larger as that of its tree may be.
fn spared_box(mesh: &Mesh) -> [DVec3; 2] {
    let [lower, upper] = mesh.bounds().map(|p| p.as_dvec3());
    let spare = BOX_SPARE * (upper - lower);
    [lower - spare, upper + spare]
}

/// A mesh that is stored once.
#[derive(Debug, Clone)]
struct StoredMesh {
    /// Its number in the scene.
    mesh: u32,
    /// Where its triangles are stored.
    first: usize,
    count: usize,
}

/// An instance that is kept.
#[derive(Debug, Clone)]
struct KeptInstance {
    /// Its number in the scene.
    object: usize,
    /// Its mesh, by its place among those that are stored.
    mesh: usize,
    /// Its place among the records.
    record: usize,
    transform: DAffine3,
}

/// The instances of a scene that are kept, beside triangles in world space.
#[derive(Debug, Clone)]
pub(super) struct KeptInstances {
    /// Numbers of the triangles in world space, ascending.
    pub names: Vec<u32>,
    /// Of kept instances, and of what is in world space between them, by their first triangles.
    pub records: Vec<SceneInstance>,
    meshes: Vec<StoredMesh>,
    instances: Vec<KeptInstance>,
    kept: Vec<bool>,
}

/// What becomes of an instance's record with a transform.
fn placed(record: &mut SceneInstance, transform: &InstanceTransform) {
    record.row_x = transform.rows[0].to_array();
    record.row_y = transform.rows[1].to_array();
    record.row_z = transform.rows[2].to_array();
    record.translation = transform.translation.to_array();
    record.flags = transform.flags();
}

impl Geometry {
    /// A scene with its instances flattened, but for those that are kept.
    pub(super) fn keep(scene: &Scene, profile: &SceneProfile, keeping: &Keeping) -> Result<Self> {
        let mut all = Self::default();
        let mut kept = KeptInstances {
            names: Vec::new(),
            records: Vec::new(),
            meshes: Vec::new(),
            instances: Vec::new(),
            kept: keeping.instances.clone(),
        };
        // The scene has been checked: all numbers are of 32 bits.
        let mut first = 0u32;
        let mut goes_on = false;
        for (object, instance) in numbered_instances(scene) {
            let count = scene.meshes[instance.mesh as usize].triangles.len() as u32;
            let keeps = keeping.instances[object];
            if keeps || !goes_on {
                kept.records.push(SceneInstance {
                    first,
                    record: all.triangles.len() as u32,
                    flags: INSTANCE_IDENTITY,
                    ..SceneInstance::default()
                });
            }
            if keeps {
                kept.instances.push(KeptInstance {
                    object,
                    mesh: keeping.meshes.partition_point(|mesh| *mesh < instance.mesh),
                    record: kept.records.len() - 1,
                    transform: instance.transform,
                });
            } else {
                all.place(scene, instance, profile)?;
                kept.names.extend(first..first + count);
            }
            goes_on = !keeps;
            first += count;
        }
        for &mesh in &keeping.meshes {
            let first = all.triangles.len();
            all.store(scene, &scene.meshes[mesh as usize], profile)?;
            let count = all.triangles.len() - first;
            kept.meshes.push(StoredMesh { mesh, first, count });
        }
        for instance in &kept.instances {
            kept.records[instance.record].record = kept.meshes[instance.mesh].first as u32;
        }
        all.kept = Some(kept);
        Ok(all)
    }
}

impl KeptInstances {
    /// Whether an instance of the scene is kept.
    pub fn keeps(&self, object: usize) -> bool {
        self.kept.get(object).is_some_and(|kept| *kept)
    }

    /// The place of an instance among those that are kept, which come in the order of the scene.
    fn place(&self, object: usize) -> Option<usize> {
        self.instances
            .binary_search_by_key(&object, |instance| instance.object)
            .ok()
    }

    /// The place of a kept instance among those of its index.
    pub fn placement(&self, object: usize) -> Option<usize> {
        let place = self.place(object)?;
        Some(place + usize::from(!self.names.is_empty()))
    }

    /// The number in the index of a mesh of the scene, and where its triangles are stored; `None` unless it is kept.
    pub fn stored(&self, mesh: u32) -> Option<(usize, usize)> {
        let place = self.meshes.iter().position(|stored| stored.mesh == mesh)?;
        Some((place + usize::from(!self.names.is_empty()), self.meshes[place].first))
    }

    /// The first vertex of a mesh that is stored: behind those of what is flattened, and of meshes with lower numbers.
    pub fn first_vertex(&self, scene: &Scene, mesh: u32) -> usize {
        let vertices = |mesh: u32| scene.meshes[mesh as usize].positions.len();
        let flattened = scene.instances.iter().zip(&self.kept).filter(|(_, kept)| !**kept);
        let before = self
            .meshes
            .iter()
            .map(|stored| stored.mesh)
            .filter(|stored| *stored < mesh);
        flattened.map(|(instance, _)| vertices(instance.mesh)).sum::<usize>() + before.map(vertices).sum::<usize>()
    }

    /// The index of two levels, and, in the records, its transforms. What is in world space is the first of its meshes, if there is any.
    ///
    /// # Errors
    /// As [`TwoLevelBvh::build`].
    pub fn index(&mut self, triangles: &[SceneTriangle], settings: &WideSettings) -> Result<TwoLevelBvh> {
        let corners = |range: std::ops::Range<usize>| triangles[range].iter().map(corners_of).collect::<Vec<_>>();
        let in_world = corners(0..self.names.len());
        let stored: Vec<Vec<[Vec3; 3]>> = self
            .meshes
            .iter()
            .map(|mesh| corners(mesh.first..mesh.first + mesh.count))
            .collect();
        let (mut meshes, mut placements) = (Vec::new(), Vec::new());
        if !in_world.is_empty() {
            meshes.push(MeshGeometry {
                triangles: &in_world,
                names: Some(&self.names),
            });
            placements.push(Placement::identity(0));
        }
        let before = meshes.len();
        meshes.extend(stored.iter().map(|triangles| MeshGeometry { triangles, names: None }));
        placements.extend(self.instances.iter().map(|instance| Placement {
            mesh: (before + instance.mesh) as u32,
            transform: instance.transform,
            first: self.records[instance.record].first,
        }));
        let index = TwoLevelBvh::build(&meshes, &placements, settings)?;
        self.place_records(&index);
        Ok(index)
    }

    /// Writes the transforms of an index to the records.
    pub fn place_records(&mut self, index: &TwoLevelBvh) {
        let transforms = &index.transforms()[usize::from(!self.names.is_empty())..];
        for (instance, transform) in self.instances.iter().zip(transforms) {
            placed(&mut self.records[instance.record], transform);
        }
    }

    /// Each instance's transform with its mesh's triangles.
    fn images<'a>(
        &'a self,
        triangles: &'a [SceneTriangle],
    ) -> impl Iterator<Item = (InstanceTransform, &'a StoredMesh, &'a [SceneTriangle])> {
        let boxes: Vec<[DVec3; 2]> = self
            .meshes
            .iter()
            .map(|mesh| {
                let corners = triangles[mesh.first..mesh.first + mesh.count]
                    .iter()
                    .flat_map(corners_of);
                corners.fold([DVec3::INFINITY, DVec3::NEG_INFINITY], |[lower, upper], p| {
                    [lower.min(p.as_dvec3()), upper.max(p.as_dvec3())]
                })
            })
            .collect();
        self.instances.iter().filter_map(move |instance| {
            let mesh = &self.meshes[instance.mesh];
            let transform = InstanceTransform::of(&instance.transform, &[boxes[instance.mesh]])?;
            Some((transform, mesh, &triangles[mesh.first..mesh.first + mesh.count]))
        })
    }

    /// Bounds with those of all images. What lies within them so far is not looked at triangle by triangle.
    pub fn with_images(&self, mut lower: Vec3, mut upper: Vec3, triangles: &[SceneTriangle]) -> (Vec3, Vec3) {
        for (transform, _, triangles) in self.images(triangles) {
            let bounds = transform.bounds;
            if bounds.lower.cmpge(lower).all() && bounds.upper.cmple(upper).all() {
                continue;
            }
            let corners = triangles
                .iter()
                .flat_map(|triangle| transform.triangle(corners_of(triangle)));
            for p in corners.filter(is_traceable) {
                lower = lower.min(p);
                upper = upper.max(p);
            }
        }
        (lower, upper)
    }

    /// Area of all images, m²; where a transform is uneven, at least that: by Cauchy and Schwarz, of the sizes by which it stretches the triangles, the
    /// root of the mean of squares instead of the mean.
    pub fn surface_area(&self, triangles: &[SceneTriangle]) -> f64 {
        // Of each mesh its area and the sum of n nᵀ over it.
        let moments: Vec<(f64, DMat3)> = self
            .meshes
            .iter()
            .map(|mesh| {
                let mut sums = (0.0, DMat3::ZERO);
                for triangle in &triangles[mesh.first..mesh.first + mesh.count] {
                    let [a, b, c] = corners_of(triangle).map(|corner| corner.as_dvec3());
                    let normal = 0.5 * (b - a).cross(c - a);
                    let area = normal.length();
                    if area.is_finite() && area > 0.0 {
                        sums.0 += area;
                        sums.1 +=
                            DMat3::from_cols(normal * normal.x, normal * normal.y, normal * normal.z) * (1.0 / area);
                    }
                }
                sums
            })
            .collect();
        let area = |instance: &KeptInstance| {
            let m = instance.transform.matrix3;
            let cofactors = DMat3::from_cols(
                m.y_axis.cross(m.z_axis),
                m.z_axis.cross(m.x_axis),
                m.x_axis.cross(m.y_axis),
            );
            let (area, moment) = &moments[instance.mesh];
            let stretched = cofactors * *moment * cofactors.transpose();
            (area * (stretched.x_axis.x + stretched.y_axis.y + stretched.z_axis.z)).sqrt()
        };
        self.instances.iter().map(area).filter(|area| area.is_finite()).sum()
    }

    /// Puts a kept instance to another place.
    pub fn moved(&mut self, object: usize, transform: &DAffine3) {
        if let Some(place) = self.place(object) {
            self.instances[place].transform = *transform;
        }
    }
}

/// Refuses what is not a mesh or an instance that is kept.
pub(super) fn not_kept<T>(name: &str, number: impl ToString) -> Result<T> {
    Err(Error::setting(
        name,
        number.to_string(),
        "is not kept: the scene has it flattened, or not at all",
    ))
}

/// A mesh of another shape, alone.
pub(super) fn alone(scene: &Scene, mesh: &Mesh) -> Scene {
    Scene {
        materials: scene.materials.clone(),
        meshes: vec![mesh.clone()],
        instances: vec![Instance {
            mesh: 0,
            transform: DAffine3::IDENTITY,
            name: String::new(),
        }],
        ..Scene::default()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::Material;
    use glam::DQuat;

    /// Meshes that are placed once and often, one that shines, one that only a plane would hold, and instances of no triangles.
    fn scene() -> Scene {
        let mut scene = Scene::default();
        let stone = scene.add_material(Material::lambert("stone", Vec3::splat(0.5)));
        let lamp = scene.add_material(Material {
            emission: Vec3::ONE,
            ..Material::lambert("lamp", Vec3::ZERO)
        });
        let fan = |material: u32, count: u32| Mesh {
            positions: (0..count + 2)
                .map(|i| Vec3::new((i as f32).cos(), 0.1 * i as f32, (i as f32).sin()))
                .collect(),
            normals: vec![Vec3::Y; count as usize + 2],
            triangles: (0..count).map(|i| [i, i + 1, i + 2]).collect(),
            material: Some(material),
            ..Mesh::default()
        };
        let meshes = [fan(stone, 7), fan(lamp, 3), fan(stone, 5), fan(stone, 0)].map(|mesh| scene.add_mesh(mesh));
        let turn = DAffine3::from_rotation_translation(DQuat::from_rotation_x(1.1), DVec3::new(3.0, -1.0, 2.0));
        let flat = DAffine3::from_scale(DVec3::new(1.0, 0.0, 1.0));
        let mirror = turn * DAffine3::from_scale(DVec3::new(-2.0, 2.0, 2.0));
        let places = [
            (2, DAffine3::IDENTITY),
            (0, turn),
            (1, turn),
            (1, DAffine3::IDENTITY),
            (0, flat),
            (0, mirror),
            (3, turn),
            (0, DAffine3::IDENTITY),
            (3, mirror),
        ];
        scene.instances = places
            .into_iter()
            .map(|(mesh, transform): (usize, DAffine3)| Instance {
                mesh: meshes[mesh],
                transform,
                name: String::new(),
            })
            .collect();
        scene
    }

    #[test]
    fn triangles_have_the_numbers_and_places_of_flattened_ones() {
        let scene = scene();
        let profile = SceneProfile::of(&scene);
        let keeping = Keeping::of(&scene, &profile).expect("a mesh that is placed often");
        let kept_objects: Vec<usize> = (0..scene.instances.len()).filter(|i| keeping.instances[*i]).collect();
        assert_eq!((kept_objects, keeping.meshes.clone()), (vec![1, 5, 7], vec![0]));
        let flat = Geometry::flatten(&scene, &profile).expect("small");
        let mut all = Geometry::keep(&scene, &profile, &keeping).expect("small");
        let mut kept = all.kept.clone().expect("instances");
        let index = kept.index(&all.triangles, &WideSettings::default()).expect("valid");
        assert_eq!(index.work().meshes, 2);
        all.kept = Some(kept.clone());
        let records = &kept.records;
        assert!(records.is_sorted_by_key(|record| record.first));
        // Three that are kept, and four runs of others, the last of no triangles.
        assert_eq!((records.len(), all.triangles.len()), (7, 5 + 2 * 3 + 7 + 7));
        for (number, expected) in flat.triangles.iter().enumerate() {
            let number = number as u32;
            let record = &records[records.partition_point(|record| record.first <= number) - 1];
            let stored = (record.record + number - record.first) as usize;
            let found = &all.triangles[stored];
            assert_eq!(found.material, expected.material);
            if stored < all.in_world() {
                assert_eq!((found, all.name(stored)), (expected, number));
                continue;
            }
            let instance = kept
                .instances
                .iter()
                .find(|instance| records[instance.record].first == record.first);
            let transform = InstanceTransform::of(
                &instance.expect("a kept instance").transform,
                &[spared_box(&scene.meshes[0])],
            );
            let image = transform.expect("a transform").triangle(corners_of(found));
            for (a, b) in image.into_iter().zip(corners_of(expected)) {
                assert!((a - b).abs().max_element() < 1e-5, "{number}: {a} {b}");
            }
        }
        let (bounds, area) = (flat.bounds(), flat.surface_area());
        for (a, b) in all.bounds().into_iter().zip(bounds) {
            assert!((a - b).abs().max_element() < 1e-5, "{a} {b}");
        }
        assert!(
            (all.surface_area() / area - 1.0).abs() < 1e-6,
            "{} {area}",
            all.surface_area()
        );
        assert_eq!(kept.first_vertex(&scene, 0), all.normals.len() - 9);
    }

    #[test]
    fn keeping_pays_where_flattening_needs_much_more_or_does_not_fit() {
        let mut scene = scene();
        scene.meshes[0].triangles = vec![[0, 1, 2]; 10_000];
        let profile = SceneProfile::of(&scene);
        let pays = |scene: &Scene, limit| Keeping::of(scene, &profile).is_some_and(|k| k.pays(scene, &profile, limit));
        assert!(!pays(&scene, u64::MAX), "few bytes");
        assert!(pays(&scene, 100_000), "does not fit");
        let instance = scene.instances[1].clone();
        scene.instances.extend(vec![instance; 60]);
        assert!(pays(&scene, u64::MAX), "80 MB, and 61 for one");
        scene.instances.truncate(1);
        assert!(Keeping::of(&scene, &profile).is_none(), "nothing is placed twice");
    }
}
