//! Scenes of photon maps: with a light, what the source says of their counterparts, and surfaces that rays meet.
//!
//! Source of what they stand for: B. Fabianowski, "Interactive Manycore Photon Mapping", PhD thesis, Trinity College Dublin, 2011, §5.2 and §6.
//!
//! Guarantee: deterministic.

use clerestory::accel::Aabb;
use clerestory::accel::bvh2::{Bvh2, Bvh2Settings};
use clerestory::accel::{Hit, Ray, RayIndex};
use clerestory::scene::{Camera, Scene};
use clerestory::{Result, scene};
use glam::Vec3;

use crate::experiments::reference::short_name;
use crate::geometry::{self, area};
use crate::random::Random;

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
        short_name(self.scene)
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
pub struct Intersection {
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
        let (triangles, mirrors): (Vec<_>, Vec<_>) = scene
            .triangles()
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

    /// Over the triangles, by the binned surface area heuristic.
    pub fn index(&self) -> &Bvh2 {
        &self.index
    }

    /// What a ray of unit direction meets first.
    pub fn meet(&self, origin: Vec3, direction: Vec3) -> Option<Intersection> {
        let ray = Ray::new(origin, direction);
        let hit: Hit = self.index.closest_hit(&ray);
        let [a, b, c] = *self.triangles.get(hit.triangle as usize)?;
        let normal = (b - a).cross(c - a).normalize_or_zero();
        Some(Intersection {
            point: origin + hit.t * direction,
            normal: if normal.dot(direction) > 0.0 { -normal } else { normal },
            distance: hit.t,
            is_mirror: self.mirrors[hit.triangle as usize],
        })
    }

    /// Origin, unit direction and length of the way from a surface to a light.
    pub fn shadow_ray(&self, from: &Intersection, light: Vec3) -> (Vec3, Vec3, f32) {
        let origin = from.point + self.offset * from.normal;
        let way = light - origin;
        (origin, way.normalize_or(Vec3::Y), way.length())
    }

    /// Origin and unit direction of rays through the middles of a picture's pixels, row by row.
    pub fn camera_rays(&self, size: u32) -> Result<Vec<(Vec3, Vec3)>> {
        geometry::camera_rays(&self.camera, size)
    }

    /// The first surface on a ray's way that is no mirror, and all meetings before it.
    pub fn follow(&self, mut origin: Vec3, mut direction: Vec3) -> Vec<(Vec3, Vec3, Option<Intersection>)> {
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

    /// Points anywhere on the surfaces but mirrors, evenly by area.
    pub fn anywhere(&self, count: usize) -> Vec<Vec3> {
        let mut random = Random::new(13);
        let mut sum = 0.0;
        let sums: Vec<f64> = self
            .triangles
            .iter()
            .zip(&self.mirrors)
            .map(|(triangle, is_mirror)| {
                sum += if *is_mirror { 0.0 } else { area(triangle) };
                sum
            })
            .collect();
        let point = |_| {
            let wanted = sum * random.unit();
            let [a, b, c] = self.triangles[sums.partition_point(|sum| *sum <= wanted).min(sums.len() - 1)];
            let (root, along) = (random.unit().sqrt() as f32, random.unit() as f32);
            a + root * ((b - a) + along * (c - b))
        };
        (0..count).map(point).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_case_has_a_mirror() {
        let surfaces = Surfaces::load(CASES[0].scene).unwrap();
        assert!(surfaces.mirrors.iter().any(|m| *m) && surfaces.triangles.len() == 802);
    }

    #[test]
    fn points_anywhere_lie_on_the_surfaces() {
        let surfaces = Surfaces::load("builtin:cornell-box").unwrap();
        let points = surfaces.anywhere(300);
        let near = |point: &Vec3| {
            surfaces.triangles.iter().any(|[a, b, c]| {
                let normal = (*b - *a).cross(*c - *a).normalize_or_zero();
                (*point - *a).dot(normal).abs() < 1e-5
            })
        };
        assert!(points.len() == 300 && points.iter().all(near));
    }
}
