//! Surfaces that tests place where a photon meets them: mirrors and glass, planes, spheres and triangles with normals of their vertices.

use super::{Differentials, normal_derivatives, refract_differentials};
use crate::test_random::Random;
use crate::transport::warp::orthonormal_basis;
use glam::{DVec2, DVec3};

/// What a photon meets, placed where it meets it first.
#[derive(Clone, Copy)]
pub enum Shape {
    Plane {
        n: DVec3,
    },
    /// Normals away from the centre times the sign.
    Sphere {
        centre: DVec3,
        radius: f64,
        sign: f64,
    },
    /// A triangle with normals of its vertices; the plane goes on beyond it.
    Smooth {
        edges: [DVec3; 2],
        normals: [DVec3; 3],
    },
}

#[derive(Clone, Copy)]
pub struct Surface {
    pub shape: Shape,
    /// A point of it; of triangles the first vertex.
    pub point: DVec3,
    /// Index outside / inside; 0 for mirrors.
    pub eta: f64,
}

pub struct Met {
    pub position: DVec3,
    pub t: f64,
    pub geometric: DVec3,
    /// Of the surface, not turned to the photon.
    pub normal: DVec3,
    pub uv: DVec2,
}

impl Surface {
    /// The intersection nearest to the distance `near`.
    pub fn meet(&self, x: DVec3, w: DVec3, near: f64) -> Met {
        let planar = |n: DVec3| (self.point - x).dot(n) / w.dot(n);
        match self.shape {
            Shape::Plane { n } => {
                let t = planar(n);
                Met {
                    position: x + t * w,
                    t,
                    geometric: n,
                    normal: n,
                    uv: DVec2::ZERO,
                }
            }
            Shape::Sphere { centre, radius, sign } => {
                let along = (centre - x).dot(w);
                let half = (radius * radius - (centre - x - along * w).length_squared()).sqrt();
                let t = if (along - half - near).abs() < (along + half - near).abs() {
                    along - half
                } else {
                    along + half
                };
                let position = x + t * w;
                let n = sign * (position - centre) / radius;
                Met {
                    position,
                    t,
                    geometric: n,
                    normal: n,
                    uv: DVec2::ZERO,
                }
            }
            Shape::Smooth { edges, normals } => {
                let area = edges[0].cross(edges[1]);
                let t = planar(area);
                let position = x + t * w;
                let (offset, squared) = (position - self.point, area.length_squared());
                let uv = DVec2::new(
                    offset.cross(edges[1]).dot(area) / squared,
                    edges[0].cross(offset).dot(area) / squared,
                );
                let n = normals[0] + uv.x * (normals[1] - normals[0]) + uv.y * (normals[2] - normals[0]);
                Met {
                    position,
                    t,
                    geometric: area.normalize(),
                    normal: n.normalize(),
                    uv,
                }
            }
        }
    }

    fn normal_derivatives(&self, met: &Met, d: &Differentials) -> [DVec3; 2] {
        match self.shape {
            Shape::Plane { .. } => [DVec3::ZERO; 2],
            Shape::Sphere { radius, sign, .. } => [d.z1, d.z2].map(|z| sign * z / radius),
            Shape::Smooth { edges, normals } => normal_derivatives(edges, normals, met.uv, d),
        }
    }

    /// The direction afterwards and, where asked for, the differentials.
    pub fn scatter(&self, w: DVec3, met: &Met, d: &Differentials, reflect: Reflect) -> (DVec3, Differentials) {
        let facing = if met.normal.dot(w) < 0.0 { 1.0 } else { -1.0 };
        let n = facing * met.normal;
        let dn = self.normal_derivatives(met, d).map(|dn| facing * dn);
        let eta = if facing > 0.0 { self.eta } else { 1.0 / self.eta };
        let c = w.dot(n);
        let squared = 1.0 - eta * eta * (1.0 - c * c);
        if self.eta > 0.0 && squared > 0.0 {
            let out = eta * w - (eta * c + squared.sqrt()) * n;
            (out, refract_differentials(d, w, n, eta, dn))
        } else {
            (w - 2.0 * c * n, reflect(d, w, n, dn))
        }
    }
}

pub type Reflect = fn(&Differentials, DVec3, DVec3, [DVec3; 2]) -> Differentials;

pub fn vector(random: &mut Random) -> DVec3 {
    random.vector().as_dvec3()
}

#[derive(Clone, Copy, PartialEq)]
pub enum Kind {
    PlaneMirror,
    PlaneGlass,
    SphereMirror,
    SphereGlass,
    SmoothMirror,
    SmoothGlass,
}

pub const KINDS: [Kind; 6] = [
    Kind::PlaneMirror,
    Kind::PlaneGlass,
    Kind::SphereMirror,
    Kind::SphereGlass,
    Kind::SmoothMirror,
    Kind::SmoothGlass,
];

/// A surface that the ray meets at a distance, under at most 73 degrees.
pub fn surface(random: &mut Random, kind: Kind, x: DVec3, w: DVec3) -> (Surface, f64) {
    let t = f64::from(random.range(0.3, 2.0));
    let hit = x + t * w;
    let n = loop {
        let n = random.direction().as_dvec3().normalize();
        if n.dot(w).abs() > 0.3 {
            break n;
        }
    };
    let shape = match kind {
        Kind::PlaneMirror | Kind::PlaneGlass => Shape::Plane { n },
        Kind::SphereMirror | Kind::SphereGlass => {
            let radius = f64::from(random.range(0.5, 3.0));
            Shape::Sphere {
                centre: hit - radius * n,
                radius,
                sign: random.choose(&[1.0, -1.0]),
            }
        }
        Kind::SmoothMirror | Kind::SmoothGlass => {
            let (a, b) = orthonormal_basis(n);
            let turn = f64::from(random.range(0.0, 6.0));
            let edge = |angle: f64, length: f64| length * (angle.cos() * a + angle.sin() * b);
            let opening = f64::from(random.range(0.7, 2.0));
            let edges = [
                edge(turn, f64::from(random.range(0.5, 2.0))),
                edge(turn + opening, f64::from(random.range(0.5, 2.0))),
            ];
            // Not of unit length, as after transformations.
            let normals = [0.8, 1.0, 1.3].map(|l| l * (n + 0.3 * vector(random)).normalize());
            Shape::Smooth { edges, normals }
        }
    };
    let point = match shape {
        Shape::Smooth { edges, .. } => hit - 0.3 * edges[0] - 0.4 * edges[1],
        _ => hit,
    };
    let glass = matches!(kind, Kind::PlaneGlass | Kind::SphereGlass | Kind::SmoothGlass);
    let eta = if glass { f64::from(random.range(0.6, 0.9)) } else { 0.0 };
    (Surface { shape, point, eta }, t)
}
