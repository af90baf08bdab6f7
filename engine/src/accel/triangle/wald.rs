//! Wald's projected triangle test: what does not depend on the ray is computed beforehand, and most tests end at the triangle's plane.
//!
//! Source: I. Wald, "Realtime Ray Tracing and Interactive Global Illumination", PhD thesis, Saarland University, 2004, §7.1.
//!
//! A measured alternative to the watertight test, which the kernels run: neighbours project their common edge by their own normals, so
//! rays can slip through between them, and weights lose digits where a triangle is far smaller than its distance from the origin of
//! coordinates.

use super::TriangleHit;
use crate::accel::Ray;
use crate::catalogue::{Role, Row, sources};
use glam::Vec3;

/// A triangle made ready: nine numbers and an axis, of which the plane's four are read first.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WaldTriangle {
    /// The axis on which the normal is largest.
    axis: usize,
    /// The normal's other two components, in cyclic order, and the plane's distance, over the largest one.
    plane: Vec3,
    /// The weights of vertices 1 and 2 as affine functions of the projected point.
    weights: [Vec3; 2],
}

/// The two axes that follow one cyclically.
fn others(axis: usize) -> [usize; 2] {
    [(axis + 1) % 3, (axis + 2) % 3]
}

impl WaldTriangle {
    /// `None` for a triangle whose normal vanishes in f64, which no ray meets.
    pub fn new(vertices: &[Vec3; 3]) -> Option<Self> {
        let [v0, v1, v2] = vertices.map(|v| v.as_dvec3());
        let (e1, e2) = (v1 - v0, v2 - v0);
        let normal = e1.cross(e2);
        let axis = normal.abs().max_position();
        if normal[axis] == 0.0 || !normal.is_finite() {
            return None;
        }
        let [i, j] = others(axis);
        // Of the projection; the normal's largest component.
        let area = normal[axis];
        let weight = |e: glam::DVec3, sign: f64| {
            let constant = e[j] * v0[i] - e[i] * v0[j];
            (sign * glam::DVec3::new(-e[j], e[i], constant) / area).as_vec3()
        };
        let plane = glam::DVec3::new(normal[i], normal[j], v0.dot(normal)) / area;
        Some(Self {
            axis,
            plane: plane.as_vec3(),
            weights: [weight(e2, -1.0), weight(e1, 1.0)],
        })
    }

    /// Parameter at which a ray meets the plane; NaN or infinite where it runs along it.
    pub fn plane_distance(&self, ray: &Ray) -> f32 {
        let ([i, j], k) = (others(self.axis), self.axis);
        let (x, w) = (ray.origin, ray.direction);
        let along = w[k] + self.plane.x * w[i] + self.plane.y * w[j];
        (self.plane.z - x[k] - self.plane.x * x[i] - self.plane.y * x[j]) / along
    }

    /// The hit, two-sided, with its `t` in [`Ray::t_min`, `Ray::t_max`]; edges belong to the triangle as far as rounding allows.
    pub fn intersect(&self, ray: &Ray) -> Option<TriangleHit> {
        let t = self.plane_distance(ray);
        // NaN fails the comparison; a ray along the plane meets nothing.
        if !(t >= ray.t_min && t <= ray.t_max && t.is_finite()) {
            return None;
        }
        let [i, j] = others(self.axis);
        let point = [i, j].map(|axis| ray.origin[axis] + t * ray.direction[axis]);
        let [u, v] = self
            .weights
            .map(|weight| weight.x * point[0] + weight.y * point[1] + weight.z);
        (u >= 0.0 && v >= 0.0 && u + v <= 1.0).then_some(TriangleHit { t, u, v })
    }
}

/// Rows of the catalogue.
pub(crate) const ROWS: &[Row] = &[Row {
    id: "PM-I-3",
    name: "projected triangle test, precomputed (measured, not in the kernels)",
    role: Role::Yardstick,
    limits: "Not watertight, and weights lose digits where a triangle is far smaller than its distance from the origin of coordinates.",
    sources: &[sources::WALD_2004.at("7.1")],
    tests: &["engine/src/accel/triangle/wald.rs::hits_differ_from_the_oracle_only_near_edges"],
    api: &["clerestory::accel::yardstick::WaldTriangle"],
    ..Row::of(file!())
}];

#[cfg(test)]
mod tests {
    use super::*;
    use crate::accel::test_support::Random;
    use crate::accel::triangle::oracles::moller_trumbore;

    /// Where a ray's line meets a triangle's plane, inside or not, in f64.
    fn in_plane(ray: &Ray, vertices: &[Vec3; 3]) -> TriangleHit<f64> {
        let [v0, v1, v2] = vertices.map(|v| v.as_dvec3());
        let direction = Vec3::from(ray.direction).as_dvec3();
        let (e1, e2) = (v1 - v0, v2 - v0);
        let delta = Vec3::from(ray.origin).as_dvec3() - v0;
        let (p, q) = (direction.cross(e2), delta.cross(e1));
        let det = e1.dot(p);
        TriangleHit {
            t: e2.dot(q) / det,
            u: delta.dot(p) / det,
            v: direction.dot(q) / det,
        }
    }

    #[test]
    fn hits_differ_from_the_oracle_only_near_edges() {
        let mut random = Random(71);
        let (mut met, mut differ) = (0, 0);
        for i in 0..200_000 {
            let vertices = [(); 3].map(|()| random.vector());
            let Some(triangle) = WaldTriangle::new(&vertices) else {
                continue;
            };
            let target = if i % 2 == 0 {
                let [a, b] = [(); 2].map(|()| 0.3 + 0.5 * random.signed());
                vertices[0] + (vertices[1] - vertices[0]) * a + (vertices[2] - vertices[0]) * b
            } else {
                let edge = random.below(3);
                let (from, to) = (vertices[edge], vertices[(edge + 1) % 3]);
                from + (to - from) * random.unit() + random.vector() * random.magnitude(-30, -18)
            };
            let origin = random.vector() * 3.0;
            let ray = Ray::new(origin, (target - origin).normalize_or(Vec3::X));
            let (found, expected) = (triangle.intersect(&ray), moller_trumbore(&ray, &vertices));
            met += u32::from(expected.is_some());
            let [a, b, c] = vertices.map(|v| v.as_dvec3());
            let normal = (b - a).cross(c - a);
            let cosine = normal.normalize().dot(Vec3::from(ray.direction).as_dvec3()).abs();
            match (found, expected) {
                (Some(found), Some(expected)) => {
                    // Slivers and rays that graze the plane lose digits; the rest is rounding.
                    let bound = 1e-5 / (normal.length() * cosine.max(1e-6));
                    assert!(
                        (f64::from(found.u) - expected.u).abs() < bound,
                        "{found:?} {expected:?} {bound}"
                    );
                    assert!(
                        (f64::from(found.v) - expected.v).abs() < bound,
                        "{found:?} {expected:?} {bound}"
                    );
                    let moved = (f64::from(found.t) - expected.t).abs() * cosine;
                    assert!(moved < 1e-5, "{found:?} {expected:?} {cosine}");
                }
                (None, None) => {}
                _ => {
                    differ += 1;
                    // Metres from the nearest edge, or from the ray's begin, as seen along the ray: rays that graze the plane go farther in it.
                    let exact = in_plane(&ray, &vertices);
                    let weights = [(exact.u, c - a), (exact.v, b - a), (1.0 - exact.u - exact.v, c - b)];
                    let away = weights.map(|(weight, edge)| weight.abs() * normal.length() / edge.length());
                    let nearest = away.into_iter().fold(exact.t.abs(), f64::min);
                    assert!(nearest * cosine < 1e-5, "{ray:?} {vertices:?}: {nearest} off, {cosine}");
                }
            }
        }
        assert!(met > 50_000 && differ > 1000, "{differ} of {met} differ");
    }

    #[test]
    fn degenerate_triangles_and_rays_along_the_plane_meet_nothing() {
        assert_eq!(WaldTriangle::new(&[Vec3::ZERO, Vec3::X, Vec3::X * 2.0]), None);
        assert_eq!(WaldTriangle::new(&[Vec3::NAN, Vec3::X, Vec3::Y]), None);
        let triangle = WaldTriangle::new(&[Vec3::ZERO, Vec3::X, Vec3::Y]).expect("a triangle");
        for origin in [Vec3::new(-1.0, 0.2, 0.0), Vec3::new(-1.0, 0.2, 0.5)] {
            assert_eq!(triangle.intersect(&Ray::new(origin, Vec3::X)), None);
        }
        let hit = triangle.intersect(&Ray::new(Vec3::new(0.25, 0.5, 2.0), Vec3::NEG_Z));
        assert_eq!(
            hit,
            Some(TriangleHit {
                t: 2.0,
                u: 0.25,
                v: 0.5
            })
        );
    }
}
