//! Instances that are kept: their meshes are stored once, in their own space, and an index of two levels places them.
//!
//! Kept is an instance of a mesh that is placed more than once and has an area, where rays can be traced through its transform. Flattened, as all instances are
//! elsewhere, are those of materials that emit, since light sampling chooses among triangles in world space; those of bodies in scenes with media, which know what is around them; those of bodies that absorb where a light is in the box around them, since light that
//! leaves it inside is absorbed; and those by transforms that are too uneven ([`InstanceTransform::of`]). All triangles have the numbers that they would have if all were
//! flattened. A kept triangle that lies exactly where an emitting one lies is not looked for, as flattened ones are: light sampling takes the emitter as if it were in front.

use glam::{DAffine3, DMat3, DVec3, Vec3};

use super::bodies::{bounds_body, boxes_meet, lamp_boxes, placed_box};
use super::geometry::{Geometry, TRIANGLE_TEXELS, corners_of, has_attributes, is_traceable, numbered_instances};
use crate::accel::can_be_met;
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

/// What a device has room for.
#[derive(Debug, Clone, Copy)]
pub(super) struct Room {
    /// Texels of a buffer.
    pub texels: u64,
    /// Bytes of all buffers together.
    pub bytes: u64,
}

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
        let parts: Vec<Option<[[DVec3; 2]; 2]>> = scene
            .meshes
            .iter()
            .zip(&placed)
            .map(|(mesh, placed)| {
                let met = || met_box(mesh.triangles.iter().map(|t| t.map(|i| mesh.positions[i as usize])));
                let met = (*placed > 1 && can_be_kept(mesh)).then(met).flatten()?;
                Some([met, spared_box(mesh)])
            })
            .collect();
        let lamps = if profile.has_absorption {
            lamp_boxes(scene)
        } else {
            Vec::new()
        };
        let holds_lamp = |instance: &Instance| {
            let mesh = &scene.meshes[instance.mesh as usize];
            let material = mesh.material.map(|index| &scene.materials[index as usize]);
            let absorbs = material.is_some_and(|m| bounds_body(m) && m.attenuation_color.min_element() < 1.0);
            absorbs && !lamps.is_empty() && {
                let around = placed_box(mesh, instance);
                lamps.iter().any(|lamp| boxes_meet(&around, lamp))
            }
        };
        let mut kept_meshes = vec![false; scene.meshes.len()];
        let instances: Vec<bool> = scene
            .instances
            .iter()
            .map(|instance| {
                // The tree's box lies between both; what is out of range in the mesh's own space need not be so in the world.
                let fits = |part: [DVec3; 2]| InstanceTransform::of(&instance.transform, &[part]).is_some();
                let kept = parts[instance.mesh as usize].is_some_and(|parts| parts.into_iter().all(fits));
                let kept = kept && !holds_lamp(instance);
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

    /// Whether it is worth it: flattening would need [`WORTH_RATIO`] times as many bytes, and [`WORTH_BYTES`] or more; or what is flattened would not fit the
    /// device, its triangles, vertices or index into a buffer or all of it into its memory.
    pub fn pays(&self, scene: &Scene, profile: &SceneProfile, room: Room) -> bool {
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
        let (mut flattened, mut kept, mut triangles, mut vertices) = (0, 0, 0, 0);
        for (instance, keeps) in scene.instances.iter().zip(&self.instances) {
            let mesh = &scene.meshes[instance.mesh as usize];
            flattened += bytes(mesh);
            triangles += mesh.triangles.len() as u64;
            vertices += mesh.positions.len() as u64;
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
        let vertices = if has_attributes(profile) { vertices } else { 0 };
        let texels = vertices.max(INDEX_TEXELS.max(TRIANGLE_TEXELS) * triangles);
        let fits = texels <= room.texels && flattened <= room.bytes;
        !fits || flattened >= WORTH_BYTES && flattened >= WORTH_RATIO * kept
    }
}

/// The box of those triangles that rays can meet; `None` without any.
pub(super) fn met_box(corners: impl Iterator<Item = [Vec3; 3]>) -> Option<[DVec3; 2]> {
    let points = corners.filter(can_be_met).flatten();
    points
        .map(|p| [p.as_dvec3(); 2])
        .reduce(|[lower, upper], [p, _]| [lower.min(p), upper.max(p)])
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
    /// As the scene has been made; where it has moved since, its index knows.
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
        Some(place + self.before())
    }

    /// The number in the index of a mesh of the scene, and where its triangles are stored; `None` unless it is kept.
    pub fn stored(&self, mesh: u32) -> Option<(usize, usize)> {
        let place = self.meshes.iter().position(|stored| stored.mesh == mesh)?;
        Some((place + self.before(), self.meshes[place].first))
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

    /// An error of the index, where it names a placement, in the scene's words.
    pub fn in_scene(&self, error: Error) -> Error {
        let (name, value, cause) = match error {
            Error::Setting { name, value, cause } => (name, value, cause),
            other => return other,
        };
        let of_placement = name.strip_prefix("placements[").and_then(|rest| rest.split_once(']'));
        let object = of_placement.and_then(|(placement, field)| {
            let place = placement.parse::<usize>().ok()?.checked_sub(self.before())?;
            Some((self.instances.get(place)?.object, field))
        });
        match object {
            Some((object, field)) => Error::setting(format!("instances[{object}]{field}"), value, cause),
            None => Error::Setting { name, value, cause },
        }
    }

    /// How many placements of the index come before those of kept instances, and meshes before theirs: what is in world space, if there is any.
    fn before(&self) -> usize {
        usize::from(!self.names.is_empty())
    }

    /// The number in the scene of a placement of the index, if it is of a kept instance.
    pub fn object(&self, placement: usize) -> Option<usize> {
        let instance = self.instances.get(placement.checked_sub(self.before())?)?;
        Some(instance.object)
    }

    /// The index of two levels, and, in the records, its transforms. What is in world space is the first of its meshes, if there is any.
    ///
    /// # Errors
    /// As [`TwoLevelBvh::build`], with the scene's numbers of instances.
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
        let index = TwoLevelBvh::build(&meshes, &placements, settings).map_err(|error| self.in_scene(error))?;
        self.place_records(&index);
        Ok(index)
    }

    /// Writes the transforms of an index to the records.
    pub fn place_records(&mut self, index: &TwoLevelBvh) {
        let transforms = &index.transforms()[self.before()..];
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
}

/// Refuses what is not a mesh or an instance that is kept.
pub(super) fn not_kept<T>(name: &str, number: impl ToString) -> Result<T> {
    Err(Error::setting(
        name,
        number.to_string(),
        "is not kept: the scene has it flattened, or not at all",
    ))
}

#[cfg(test)]
mod tests;
