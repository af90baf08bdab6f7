//! Rays and triangle sets that the tests of this floor share.

pub mod awkward;

pub use crate::test_random::Random;

use super::{Hit, NO_HIT, Ray, triangle};
use glam::{DVec3, Vec3};

/// Unit roundoff of f32.
pub const U: f64 = 1.0 / 16_777_216.0;

/// What is made by so many threads.
pub fn with_threads<T: Send>(threads: usize, make: impl FnOnce() -> T + Send) -> T {
    let pool = rayon::ThreadPoolBuilder::new()
        .num_threads(threads)
        .build()
        .expect("threads");
    pool.install(make)
}

/// Tries all triangles in index order with the kernels' test.
pub fn brute_force(triangles: &[[Vec3; 3]], usable: impl Fn(usize) -> bool, ray: &Ray) -> Hit {
    let mut hit = Hit::none(ray.t_max);
    if !ray.is_traceable() {
        return hit;
    }
    let shear = triangle::ray_shear(ray.origin.into(), ray.direction.into());
    for (i, t) in triangles.iter().enumerate().filter(|(i, _)| usable(*i)) {
        if let Some(c) = triangle::intersect_triangle(&shear, t, ray.t_min, hit.t)
            && (c.t < hit.t || hit.triangle == NO_HIT)
        {
            hit = Hit {
                t: c.t,
                barycentrics: [c.u, c.v],
                triangle: i as u32,
            };
        }
    }
    hit
}

/// A ray and a triangle in f64, seen along the ray: the sheared plane of the watertight test without its rounding.
pub struct Sheared {
    /// Sheared vertices; z is the ray parameter.
    pub vertices: [DVec3; 3],
    /// Largest component distance from the origin to a vertex.
    pub reach: f64,
    /// Size of the direction's largest component.
    pub direction: f64,
    axis: usize,
    shear: DVec3,
    origin: DVec3,
}

impl Sheared {
    pub fn new(ray: &Ray, triangle: &[Vec3; 3]) -> Self {
        let d = Vec3::from(ray.direction);
        let axis = triangle::ray_shear(Vec3::ZERO, d).axis;
        let d = triangle::dominant_axis_last(d, axis).as_dvec3();
        let mut sheared = Self {
            vertices: [DVec3::ZERO; 3],
            reach: 0.0,
            direction: d.z.abs(),
            axis,
            shear: DVec3::new(d.x / d.z, d.y / d.z, 1.0 / d.z),
            origin: Vec3::from(ray.origin).as_dvec3(),
        };
        for (i, v) in triangle.iter().enumerate() {
            sheared.vertices[i] = sheared.project(v.as_dvec3());
            sheared.reach = sheared.reach.max((v.as_dvec3() - sheared.origin).abs().max_element());
        }
        sheared
    }

    pub fn project(&self, point: DVec3) -> DVec3 {
        let a = point - self.origin;
        let a = match self.axis {
            0 => DVec3::new(a.y, a.z, a.x),
            1 => DVec3::new(a.z, a.x, a.y),
            _ => a,
        };
        DVec3::new(a.x - self.shear.x * a.z, a.y - self.shear.y * a.z, self.shear.z * a.z)
    }

    /// Signed distance of the ray from the nearest edge in the sheared plane, positive inside; −∞ when edge-on.
    pub fn depth_inside(&self) -> f64 {
        let [a, b, c] = self.vertices;
        let edge = |p: DVec3, q: DVec3| (p.x * q.y - p.y * q.x, (q - p).truncate().length());
        let edges = [edge(b, c), edge(c, a), edge(a, b)];
        let area: f64 = edges.iter().map(|e| e.0).sum();
        edges
            .iter()
            .map(|(e, l)| e * area.signum() / l)
            .fold(f64::INFINITY, f64::min)
    }

    /// Parameter where the ray meets the triangle's plane, and the largest slope of that parameter over the sheared plane.
    pub fn plane(&self) -> (f64, f64) {
        let [a, b, c] = self.vertices;
        let n = (b - a).cross(c - a);
        (n.dot(a) / n.z, n.truncate().length() / n.z.abs())
    }
}
