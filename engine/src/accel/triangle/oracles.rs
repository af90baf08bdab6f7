//! Two ray/triangle tests in f64, which tests hold the watertight one to: the same test, and another.
//!
//! Source: T. Möller and B. Trumbore, "Fast, Minimum Storage Ray/Triangle Intersection", JGT 2(1), 1997.

use super::TriangleHit;
use crate::accel::Ray;
use crate::catalogue::{Role, Row, sources};
use glam::{DVec3, Vec3};

/// The watertight test in f64. Differences and products of f32 input are exact or nearly so.
pub fn intersect_triangle_f64(ray: &Ray, vertices: &[Vec3; 3]) -> Option<TriangleHit<f64>> {
    let o = Vec3::from(ray.origin).as_dvec3();
    let direction = Vec3::from(ray.direction).as_dvec3();
    let axis = direction.abs().max_position();
    let cyclic = |v: DVec3| match axis {
        0 => DVec3::new(v.y, v.z, v.x),
        1 => DVec3::new(v.z, v.x, v.y),
        _ => v,
    };
    let d = cyclic(direction);
    let project = |vertex: Vec3| {
        let a = cyclic(vertex.as_dvec3() - o);
        DVec3::new(a.x - d.x / d.z * a.z, a.y - d.y / d.z * a.z, a.z / d.z)
    };
    let (a, b, c) = (project(vertices[0]), project(vertices[1]), project(vertices[2]));
    let u = c.x * b.y - c.y * b.x;
    let v = a.x * c.y - a.y * c.x;
    let w = b.x * a.y - b.y * a.x;
    let inside = (u >= 0.0 && v >= 0.0 && w >= 0.0) || (u <= 0.0 && v <= 0.0 && w <= 0.0);
    let det = u + v + w;
    if !inside || det == 0.0 {
        return None;
    }
    let t = (u * a.z + v * b.z + w * c.z) / det;
    (t >= f64::from(ray.t_min) && t <= f64::from(ray.t_max)).then_some(TriangleHit {
        t,
        u: v / det,
        v: w / det,
    })
}

/// Möller and Trumbore's test in f64, two-sided. Where the determinant is zero the triangle is missed.
pub fn moller_trumbore(ray: &Ray, vertices: &[Vec3; 3]) -> Option<TriangleHit<f64>> {
    let [v0, v1, v2] = vertices.map(|v| v.as_dvec3());
    let direction = Vec3::from(ray.direction).as_dvec3();
    let (e1, e2) = (v1 - v0, v2 - v0);
    let delta = Vec3::from(ray.origin).as_dvec3() - v0;
    let p = direction.cross(e2);
    let q = delta.cross(e1);
    let det = e1.dot(p);
    if det == 0.0 {
        return None;
    }
    let (t, u, v) = (e2.dot(q) / det, delta.dot(p) / det, direction.dot(q) / det);
    let hit = u >= 0.0 && v >= 0.0 && u + v <= 1.0 && t >= f64::from(ray.t_min) && t <= f64::from(ray.t_max);
    hit.then_some(TriangleHit { t, u, v })
}

/// Rows of the catalogue.
pub(crate) const ROWS: &[Row] = &[Row {
    id: "PM-I-2",
    name: "Möller–Trumbore triangle test (oracle in f64)",
    role: Role::Yardstick,
    limits: "Not watertight: rays can pass between triangles that share an edge.",
    sources: &[sources::MOLLER_TRUMBORE_1997.whole()],
    tests: &["engine/src/accel/triangle/tests.rs::oracles_agree_with_each_other"],
    api: &["clerestory::accel::yardstick::moller_trumbore"],
    ..Row::of(file!())
}];
