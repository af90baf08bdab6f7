//! Stand-ins for photon maps: kernels of fixed radius about the second and third hits of photons that walk through a scene, and the
//! surface points that cameras see.
//!
//! Source of what they stand for: "Interactive Manycore Photon Mapping", PhD thesis, Trinity College Dublin, 2011, §5.2 and §6. Photons
//! leave a point evenly, surfaces but mirrors scatter them by the cosine with probability [`SURVIVAL`], and hits two and three are kept.
//! Radii go by the fourth root of the photon's way, the source's dampening; their scale is set so that a point of the scene's surfaces
//! lies in a given number of kernels on average. Spheres take the place of the source's flattened ellipsoids.
//!
//! Guarantee: deterministic.

use clerestory::accel::bvh2::{Aabb, Bvh2, Bvh2Settings};
use clerestory::accel::compact_bvh::CompactBvh;
use clerestory::accel::complete_bvh::{CompleteBvh, QueryCounters};
use clerestory::accel::lbvh::merge::merged_hierarchy;
use clerestory::accel::lbvh::radix::SortedCodes;
use clerestory::accel::lbvh::tree::BoxTree;
use clerestory::accel::morton::MORTON_30_AXIS_BITS;
use clerestory::accel::vvh::{Heuristic, sweep_tree};
use clerestory::accel::{Hit, Ray, RayIndex};
use clerestory::scene::{Camera, Scene};
use clerestory::{Error, Result, scene};
use glam::{Vec3, Vec4};

use super::Context;
use super::inputs::Random;
use crate::geometry::{self, area, triangles_with_materials};

/// Probability that a diffuse surface scatters a photon.
const SURVIVAL: f64 = 0.7;
/// Hits after which a photon ends.
const HITS: u32 = 3;
/// Rays begin that far from surfaces, relative to the scene's extent.
const RELATIVE_OFFSET: f32 = 1e-5;
/// Mirrors that a camera ray is followed through.
const MIRRORS: u32 = 8;

/// A scene with a light, and what the source says of its counterpart.
pub struct Case {
    /// Address of the scene.
    pub scene: &'static str,
    /// Where photons begin, metres.
    pub light: Vec3,
    /// Mean number of kernels about a surface point.
    pub cover: f64,
    /// Name of the counterpart in the source's tables; empty where there is none.
    pub counterpart: &'static str,
}

/// Scenes of the size and number of triangles of the source's, with its numbers of contributions (Table 5.1), and two more.
pub static CASES: [Case; 5] = [
    Case {
        scene: "builtin:box-room?source=point",
        light: Vec3::new(3.0, 2.5, 3.0),
        cover: 337.6,
        counterpart: "Scene 6",
    },
    Case {
        scene: "builtin:passage",
        light: Vec3::new(0.35, 0.97, 0.5),
        cover: 459.6,
        counterpart: "Passage",
    },
    Case {
        scene: "builtin:ring",
        light: Vec3::new(1.7, 1.0, 0.0),
        cover: 186.6,
        counterpart: "Ring",
    },
    Case {
        scene: "builtin:cornell-box?source=point",
        light: Vec3::new(0.278, 0.54, 0.28),
        cover: 200.0,
        counterpart: "",
    },
    Case {
        scene: "builtin:divider-room",
        light: Vec3::new(0.0, 1.9, -0.6),
        cover: 200.0,
        counterpart: "",
    },
];

impl Case {
    /// The scene's name.
    pub fn name(&self) -> &'static str {
        self.scene.trim_start_matches("builtin:")
    }

    /// Its counterpart, for a table's cell.
    pub fn counterpart(&self) -> &'static str {
        if self.counterpart.is_empty() {
            "none"
        } else {
            self.counterpart
        }
    }
}

/// Where a ray meets a surface.
#[derive(Debug, Clone, Copy)]
pub struct Meeting {
    /// The point.
    pub point: Vec3,
    /// Unit normal on the side that the ray comes from.
    pub normal: Vec3,
    /// Length of the way, metres.
    pub distance: f32,
    /// Whether the surface is a mirror.
    pub is_mirror: bool,
}

/// A scene's triangles as rays meet them.
pub struct Surfaces {
    /// The triangles in world space.
    pub triangles: Vec<[Vec3; 3]>,
    /// Their area, m².
    pub area: f64,
    /// How far from a surface rays begin, metres.
    pub offset: f32,
    mirrors: Vec<bool>,
    index: Bvh2,
    camera: Camera,
}

impl Surfaces {
    /// Of a scene that has a camera.
    pub fn load(address: &str) -> Result<Self> {
        let scene: Scene = scene::load(address)?;
        let is_mirror = |material: Option<u32>| {
            let material = material.and_then(|i| scene.materials.get(i as usize));
            material.is_some_and(|m| m.metallic > 0.0 && m.roughness == 0.0)
        };
        let (triangles, mirrors): (Vec<_>, Vec<_>) = triangles_with_materials(&scene)
            .map(|(triangle, material)| (triangle, is_mirror(material)))
            .unzip();
        let corners = triangles.iter().flatten();
        let bounds = corners.fold(Aabb::EMPTY, |bounds, corner| bounds.with_point(*corner));
        Ok(Self {
            area: triangles.iter().map(area).sum(),
            offset: RELATIVE_OFFSET * (bounds.upper - bounds.lower).max_element(),
            mirrors,
            index: Bvh2::build(&triangles, &Bvh2Settings::default())?,
            camera: scene.require_camera(None)?.clone(),
            triangles,
        })
    }

    /// What a ray of unit direction meets first.
    pub fn meet(&self, origin: Vec3, direction: Vec3) -> Option<Meeting> {
        let ray = Ray {
            origin: origin.into(),
            t_min: 0.0,
            direction: direction.into(),
            t_max: f32::INFINITY,
        };
        let hit: Hit = self.index.closest_hit(&ray);
        let [a, b, c] = *self.triangles.get(hit.triangle as usize)?;
        let normal = (b - a).cross(c - a).normalize_or_zero();
        Some(Meeting {
            point: origin + hit.t * direction,
            normal: if normal.dot(direction) > 0.0 { -normal } else { normal },
            distance: hit.t,
            is_mirror: self.mirrors[hit.triangle as usize],
        })
    }

    /// Origin, unit direction and length of the way from a surface to a light.
    pub fn shadow_ray(&self, from: &Meeting, light: Vec3) -> (Vec3, Vec3, f32) {
        let origin = from.point + self.offset * from.normal;
        let way = light - origin;
        (origin, way.normalize_or(Vec3::Y), way.length())
    }

    /// Origin and unit direction of rays through the middles of a picture's pixels, row by row.
    pub fn camera_rays(&self, size: u32) -> Result<Vec<(Vec3, Vec3)>> {
        geometry::camera_rays(&self.camera, size)
    }

    /// The first surface on a ray's way that is no mirror, and all meetings before it.
    pub fn follow(&self, mut origin: Vec3, mut direction: Vec3) -> Vec<(Vec3, Vec3, Option<Meeting>)> {
        let mut way = Vec::new();
        for _ in 0..MIRRORS {
            let meeting = self.meet(origin, direction);
            way.push((origin, direction, meeting));
            let Some(mirror) = meeting.filter(|meeting| meeting.is_mirror) else {
                break;
            };
            direction = direction.reflect(mirror.normal);
            origin = mirror.point + self.offset * mirror.normal;
        }
        way
    }

    /// Surface points that the camera sees, directly or in mirrors.
    pub fn seen(&self, size: u32) -> Result<Vec<Vec3>> {
        let last = |(origin, direction): (Vec3, Vec3)| {
            let (_, _, meeting) = self.follow(origin, direction).pop()?;
            meeting
                .filter(|meeting| !meeting.is_mirror)
                .map(|meeting| meeting.point)
        };
        Ok(self.camera_rays(size)?.into_iter().filter_map(last).collect())
    }
}

/// Kernels about hits of photons.
pub struct Kernels {
    /// Centre and radius, metres.
    pub spheres: Vec<Vec4>,
    /// Their boxes.
    pub boxes: Vec<Aabb>,
}

impl Kernels {
    /// The kernels of `photons` photons, of which `cover` lie about a surface point on average.
    pub fn trace(surfaces: &Surfaces, light: Vec3, photons: u32, cover: f64) -> Self {
        let mut random = Random::new(12);
        let mut hits = Vec::new();
        for _ in 0..photons {
            walk(surfaces, light, &mut random, &mut hits);
        }
        // Radius = scale · (way / 1 m)^(1/4).
        let squares: f64 = hits.iter().map(|(_, way)| f64::from(*way).sqrt()).sum();
        let scale = (cover * surfaces.area / (std::f64::consts::PI * squares)).sqrt();
        let sphere = |(centre, way): &(Vec3, f32)| centre.extend((scale * f64::from(*way).powf(0.25)) as f32);
        let spheres: Vec<Vec4> = hits.iter().map(sphere).collect();
        let bounds = |sphere: &Vec4| Aabb {
            lower: sphere.truncate() - sphere.w,
            upper: sphere.truncate() + sphere.w,
        };
        Self {
            boxes: spheres.iter().map(bounds).collect(),
            spheres,
        }
    }

    /// Areas of their discs on a surface, m².
    pub fn areas(&self) -> impl Iterator<Item = f64> + '_ {
        let area = |sphere: &Vec4| std::f64::consts::PI * f64::from(sphere.w).powi(2);
        self.spheres.iter().map(area)
    }

    /// The tree of the voxel volume heuristic.
    pub fn by_volume(&self, leaf_size: u32) -> BoxTree {
        sweep_tree(&self.boxes, leaf_size, Heuristic::Volume)
    }

    /// The linear hierarchy by merging.
    pub fn linear(&self, leaf_size: u32) -> BoxTree {
        let sorted = SortedCodes::of_boxes(&self.boxes, MORTON_30_AXIS_BITS);
        merged_hierarchy(&self.boxes, &sorted, leaf_size, |_| {})
    }
}

/// Follows one photon and keeps its second and third hits on diffuse surfaces with the length of its way.
fn walk(surfaces: &Surfaces, light: Vec3, random: &mut Random, hits: &mut Vec<(Vec3, f32)>) {
    let (mut origin, mut direction) = (light, random.direction().as_vec3());
    let mut way = 0.0;
    for hit in 1..=HITS {
        let Some(meeting) = surfaces.meet(origin, direction) else {
            return;
        };
        way += meeting.distance;
        if meeting.is_mirror {
            direction = direction.reflect(meeting.normal);
        } else {
            if hit > 1 {
                hits.push((meeting.point, way));
            }
            if random.unit() >= SURVIVAL {
                return;
            }
            // Cosine about the normal: a point of the unit sphere that touches the surface.
            let cosine = meeting.normal.as_dvec3() + random.direction();
            direction = cosine.as_vec3().normalize_or(meeting.normal);
        }
        origin = meeting.point + surfaces.offset * meeting.normal;
    }
}

/// Work of queries.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Work {
    /// Of the tree.
    pub tree: QueryCounters,
    /// Kernels tested.
    pub tests: u64,
    /// Kernels that hold the point.
    pub contributions: u64,
}

/// A photon map in both layouts, records in leaf order.
pub struct Map {
    /// Complete nodes.
    pub complete: CompleteBvh,
    /// Compact pairs.
    pub compact: CompactBvh,
    records: Vec<Vec4>,
}

impl Map {
    /// Lays a tree over kernels out.
    pub fn new(kernels: &Kernels, tree: &BoxTree) -> Result<Self> {
        let complete = CompleteBvh::new(tree)?;
        let compact = CompactBvh::encode(&complete)
            .map_err(|fault| Error::setting("tree", "compact", format!("is not tight: {fault:?}")))?;
        Ok(Self {
            records: complete.order.iter().map(|i| kernels.spheres[*i as usize]).collect(),
            complete,
            compact,
        })
    }

    fn leaf(&self, point: Vec3, first: u32, work: &mut Work) {
        let places = self.records.iter().zip(&self.complete.ends).skip(first as usize);
        for (sphere, is_last) in places {
            work.tests += 1;
            work.contributions += u64::from((sphere.truncate() - point).length_squared() < sphere.w * sphere.w);
            if *is_last {
                break;
            }
        }
    }

    /// Gathers at a point by complete nodes.
    pub fn gather_complete(&self, point: Vec3, work: &mut Work) {
        let mut tree = work.tree;
        self.complete
            .point_query(point, &mut tree, |first| self.leaf(point, first, work));
        work.tree = tree;
    }

    /// Gathers at a point by compact pairs.
    pub fn gather_compact(&self, point: Vec3, work: &mut Work) {
        let mut tree = work.tree;
        self.compact
            .point_query(point, &mut tree, |first| self.leaf(point, first, work));
        work.tree = tree;
    }
}

/// A case with its photons and what its camera sees.
pub struct Prepared {
    /// The case.
    pub case: &'static Case,
    /// Its scene.
    pub surfaces: Surfaces,
    /// Kernels of the photons.
    pub kernels: Kernels,
    /// Points to query at.
    pub points: Vec<Vec3>,
}

/// The cases that a measure takes, each made when its turn comes, until the measure is stopped.
pub fn prepared<'a>(context: &'a Context<'_>) -> impl Iterator<Item = Result<Prepared>> + 'a {
    // Photons sent out, and pixels on a side of the camera.
    let (photons, side) = if context.smoke { (1 << 9, 8) } else { (1 << 17, 96) };
    let cases = if context.smoke { &CASES[..1] } else { &CASES[..] };
    let going_on = cases.iter().enumerate().take_while(|_| !context.watch.stopped());
    going_on.map(move |(done, case)| {
        context.watch.begin(case.name(), done, cases.len());
        let surfaces = Surfaces::load(case.scene)?;
        Ok(Prepared {
            case,
            kernels: Kernels::trace(&surfaces, case.light, photons, case.cover),
            points: surfaces.seen(side)?,
            surfaces,
        })
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn points_lie_in_as_many_kernels_as_asked_for() {
        let case = &CASES[0];
        let surfaces = Surfaces::load(case.scene).unwrap();
        assert!(surfaces.mirrors.iter().any(|m| *m) && surfaces.triangles.len() == 802);
        let kernels = Kernels::trace(&surfaces, case.light, 2000, 50.0);
        let cover = kernels.areas().sum::<f64>() / surfaces.area;
        // Radii are rounded to f32.
        assert!((cover / 50.0 - 1.0).abs() < 1e-6, "{cover}");
        assert!(!kernels.spheres.is_empty() && kernels.spheres.len() <= 2 * 2000);
        let seen = surfaces.seen(16).unwrap();
        assert_eq!(seen.len(), 256);
        let map = Map::new(&kernels, &kernels.linear(8)).unwrap();
        let (mut complete, mut compact, mut brute) = (Work::default(), Work::default(), 0);
        for point in seen {
            map.gather_complete(point, &mut complete);
            map.gather_compact(point, &mut compact);
            let holds = |s: &&Vec4| (s.truncate() - point).length_squared() < s.w * s.w;
            brute += kernels.spheres.iter().filter(holds).count() as u64;
        }
        assert_eq!((complete.contributions, compact.contributions), (brute, brute));
        assert_eq!(complete.tests, compact.tests);
        assert!(brute > 0 && compact.tree.bytes < complete.tree.bytes);
    }
}
