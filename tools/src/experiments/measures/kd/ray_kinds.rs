//! Rays of six kinds among triangles, from those that a picture asks for to those that kd-trees get wrong: along axes, in planes that cut
//! the tree, through vertices and edges.
//!
//! Guarantee: deterministic, the same on every machine.

use clerestory::Result;
use clerestory::accel::bvh2::Bvh2;
use clerestory::accel::{Aabb, Ray, RayIndex};
use clerestory::scene::Camera;
use glam::Vec3;

use crate::geometry;
use crate::random::Random;

/// Names of the kinds, in the order of [`rays`].
pub const KINDS: [&str; 6] = ["camera", "interior", "diffuse", "axis-parallel", "in-plane", "seam"];

/// One in so many rays has an end, and one in so many a beginning away from its origin.
const BOUNDED: usize = 4;
const BEGUN: usize = 7;
/// Where diffuse rays begin, as a share of the largest side of all bounds.
const DIFFUSE_BEGIN: f32 = 1e-5;

/// What rays are drawn among.
struct Place<'a> {
    triangles: &'a [[Vec3; 3]],
    bounds: Aabb,
    random: Random,
}

impl Place<'_> {
    fn within(&mut self) -> Vec3 {
        let share = Vec3::new(self.unit(), self.unit(), self.unit());
        self.bounds.lower + share * (self.bounds.upper - self.bounds.lower)
    }

    fn unit(&mut self) -> f32 {
        self.random.unit() as f32
    }

    fn direction(&mut self) -> Vec3 {
        self.random.direction().as_vec3()
    }

    fn below(&mut self, count: usize) -> usize {
        self.random.word() as usize % count
    }

    fn sign(&mut self) -> f32 {
        if self.random.word() & 1 == 0 { 1.0 } else { -1.0 }
    }

    /// Corners of any of the triangles.
    fn triangle(&mut self) -> [Vec3; 3] {
        match self.triangles.len() {
            0 => [Vec3::ZERO, Vec3::X, Vec3::Y],
            count => self.triangles[self.below(count)],
        }
    }

    fn corner(&mut self) -> Vec3 {
        let corner = self.below(3);
        self.triangle()[corner]
    }

    /// From anywhere along an axis, other components a zero of either sign; half of them through coordinates of corners.
    fn axis_parallel(&mut self) -> Ray {
        let mut origin = self.within();
        if self.sign() > 0.0 {
            origin = Vec3::new(self.corner().x, self.corner().y, self.corner().z);
        }
        let axis = self.below(3);
        let mut direction = Vec3::new(self.sign(), self.sign(), self.sign()) * 0.0;
        direction[axis] = self.sign();
        Ray::new(origin, direction)
    }

    /// Within a plane across an axis that holds a corner, as the planes of kd-trees do.
    fn in_plane(&mut self) -> Ray {
        let (mut origin, mut direction) = (self.within(), self.direction());
        let axis = self.below(3);
        origin[axis] = self.corner()[axis];
        direction[axis] = 0.0 * self.sign();
        Ray::new(origin, direction)
    }

    /// To a corner or a point of an edge from anywhere, or from it in any direction; of unit length, or as long as the way.
    fn seam(&mut self, i: usize) -> Ray {
        let [a, b, _] = self.triangle();
        let along = [0.0, 0.5, self.unit()][self.below(3)];
        let target = a + along * (b - a);
        if i.is_multiple_of(5) {
            return Ray::new(target, self.direction());
        }
        let origin = self.within();
        let way = target - origin;
        Ray::new(
            origin,
            if i.is_multiple_of(2) {
                way.normalize_or(Vec3::X)
            } else {
                way
            },
        )
    }
}

/// As many rays of each kind. Where the camera sees nothing, diffuse ones begin anywhere.
///
/// # Errors
/// Those of a camera that is not in perspective.
pub fn rays(
    triangles: &[[Vec3; 3]],
    index: &Bvh2,
    camera: &Camera,
    of_each: usize,
    seed: u32,
) -> Result<[Vec<Ray>; KINDS.len()]> {
    let corners = triangles.iter().flatten();
    let bounds = corners.fold(Aabb::EMPTY, |bounds, corner| bounds.with_point(*corner));
    let size = (bounds.upper - bounds.lower).max_element();
    let mut place = Place {
        triangles,
        bounds,
        random: Random::new(seed),
    };
    let side = (of_each as f64).sqrt().ceil() as u32;
    let seen = geometry::camera_rays(camera, side)?.into_iter().take(of_each);
    let camera: Vec<Ray> = seen.map(|(origin, direction)| Ray::new(origin, direction)).collect();
    let ends = camera.iter().filter_map(|ray| {
        let hit = index.closest_hit(ray);
        hit.is_hit()
            .then(|| Vec3::from(ray.origin) + hit.t * Vec3::from(ray.direction))
    });
    let ends: Vec<Vec3> = ends.collect();
    let mut of = |kind: fn(&mut Place<'_>, usize) -> Ray| -> Vec<Ray> {
        let bounded = |i: usize, mut ray: Ray, share: f32| {
            let longest = Vec3::from(ray.direction).abs().max_element();
            if i % BOUNDED == BOUNDED - 1 && longest > 0.0 {
                ray.t_max = share * size / longest;
            }
            if i % BEGUN == BEGUN - 1 && longest > 0.0 {
                ray.t_min = 0.1 * share * size / longest;
            }
            ray
        };
        let one = |i| {
            let ray = kind(&mut place, i);
            bounded(i, ray, place.unit())
        };
        (0..of_each).map(one).collect()
    };
    let interior = of(|place, _| Ray::new(place.within(), place.direction()));
    let axis_parallel = of(|place, _| place.axis_parallel());
    let in_plane = of(|place, _| place.in_plane());
    let seam = of(|place, i| place.seam(i));
    let diffuse = (0..of_each).map(|i| {
        let origin = match ends.len() {
            0 => place.within(),
            count => ends[i % count],
        };
        Ray {
            t_min: DIFFUSE_BEGIN * size,
            ..Ray::new(origin, place.direction())
        }
    });
    Ok([camera, interior, diffuse.collect(), axis_parallel, in_plane, seam])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::experiments::measures::photon_maps::photon_scenes::Surfaces;
    use clerestory::scene;

    #[test]
    fn kinds_are_what_they_are_called() {
        let address = "builtin:cornell-box";
        let surfaces = Surfaces::load(address).unwrap();
        let scene = scene::load(address).unwrap();
        let camera = scene.require_camera(None).unwrap();
        let of = |seed| rays(&surfaces.triangles, surfaces.index(), camera, 210, seed).unwrap();
        let all = of(1);
        assert!(all.iter().all(|kind| kind.len() == 210));
        assert_eq!(all, of(1));
        let [.., interior, diffuse, axis_parallel, in_plane, seam] = all;
        assert!(interior.iter().any(|ray| ray.t_max.is_finite()) && interior.iter().any(|ray| ray.t_min > 0.0));
        assert!(diffuse.iter().all(|ray| ray.t_min > 0.0));
        let zeros = |ray: &Ray| ray.direction.iter().filter(|component| **component == 0.0).count();
        assert!(axis_parallel.iter().all(|ray| zeros(ray) == 2));
        let corners: Vec<Vec3> = surfaces.triangles.iter().flatten().copied().collect();
        for ray in &in_plane {
            let axis = (0..3).find(|axis| ray.direction[*axis] == 0.0).unwrap();
            assert!(corners.iter().any(|corner| corner[axis] == ray.origin[axis]));
        }
        // Ways to corners that are given by their ends pass the corners at 1 to within rounding.
        let ends = seam.iter().filter(|ray| {
            let end = Vec3::from(ray.origin) + Vec3::from(ray.direction);
            corners.iter().any(|corner| corner.distance(end) < 1e-6)
        });
        assert!(ends.count() > 10);
    }
}
