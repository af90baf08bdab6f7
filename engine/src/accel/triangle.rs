//! The ray/triangle test of all indexes and kernels, which is watertight.
//!
//! Sources: S. Woop, C. Benthin, I. Wald, "Watertight Ray/Triangle Intersection", JCGT 2(1), 2013; the difference of two products as in
//! Cornea, Harrison and Tang, with exact product errors by Dekker's and Veltkamp's splitting ("A floating-point technique for extending
//! the available precision", Numerische Mathematik 18, 1971).
//!
//! The paper falls back to double precision when an edge value is zero. Here every edge value is the difference of two products with
//! both rounding errors added back, in f32 only. Guarantees, with u = 2⁻²⁴ and barring underflow (edge products under 2⁻¹⁰⁰ m²):
//!
//! - An edge value is never of the wrong sign, and its relative error is at most 2u (Jeannerod, "A radix-independent error analysis of
//!   the Cornea–Harrison–Tang method", ACM TOMS 42(3), 2016).
//! - Rule for zero: it counts as inside, for both triangles of the edge. Each triangle thus is closed in the sheared plane; triangles
//!   that share vertices see the same sheared vertices; so a point that a mesh covers there is inside one of its triangles. No gap.
//! - The weights are all of one sign: the point they name lies on the triangle. Its distance from the ray, seen along the dominant
//!   axis, is at most 16uM, and the reported `t` is within 18uM/|d| of the point's, where M is the largest coordinate distance of a
//!   vertex from the ray's origin and |d| the largest component of the direction (derivation at [`BOX_SLACK`](crate::accel::box_test::BOX_SLACK)).
//! - Two-sided. A triangle of which two vertices coincide, or that is seen exactly edge-on, is missed. NaN anywhere is a miss.

pub(crate) mod oracles;
pub(crate) mod wald;

use crate::catalogue::{Role, Row, sources};
use crate::gpu::shaders::constants;
use glam::Vec3;

/// Veltkamp's splitting factor for 24-bit significands, 2¹² + 1.
const SPLITTER: f32 = constants::SPLITTER;

/// What the test needs of a ray, computed once (Woop et al. 2013, §3.1).
#[derive(Debug, Clone, Copy)]
pub struct RayShear {
    /// Ray origin.
    pub origin: Vec3,
    /// The axis of the largest direction component: 0, 1 or 2.
    pub axis: usize,
    /// Shear along the two other axes, in cyclic order, and the reciprocal of the dominant component.
    pub shear: Vec3,
}

/// A candidate: parameter and the weights of vertices 1 and 2.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TriangleHit<T = f32> {
    /// Ray parameter.
    pub t: T,
    /// Weight of vertex 1.
    pub u: T,
    /// Weight of vertex 2.
    pub v: T,
}

/// Cyclic permutation that brings `axis` last.
pub fn dominant_axis_last(v: Vec3, axis: usize) -> Vec3 {
    match axis {
        0 => Vec3::new(v.y, v.z, v.x),
        1 => Vec3::new(v.z, v.x, v.y),
        _ => v,
    }
}

/// Dominant axis and shear of a ray.
pub fn ray_shear(origin: Vec3, direction: Vec3) -> RayShear {
    let a = direction.abs();
    let axis = if a.x >= a.y && a.x >= a.z {
        0
    } else if a.y >= a.z {
        1
    } else {
        2
    };
    let d = dominant_axis_last(direction, axis);
    RayShear {
        origin,
        axis,
        shear: Vec3::new(d.x / d.z, d.y / d.z, 1.0 / d.z),
    }
}

/// Upper and lower half of a significand; their sum is the number.
fn split(a: f32) -> (f32, f32) {
    let c = SPLITTER * a;
    let high = c - (c - a);
    (high, a - high)
}

/// `a·b − c·d` with relative error at most 2u and never the wrong sign; negates exactly when the products change places.
pub fn difference_of_products(a: f32, b: f32, c: f32, d: f32) -> f32 {
    let error = |x: f32, y: f32, product: f32| {
        let (xh, xl) = split(x);
        let (yh, yl) = split(y);
        ((xh * yh - product) + xh * yl + xl * yh) + xl * yl
    };
    let p = a * b;
    let q = c * d;
    (p - q) + (error(a, b, p) - error(c, d, q))
}

/// Watertight test in f32, the kernels' operations one for one. The hit's `t` lies in [t_min, t_max].
pub fn intersect_triangle(ray: &RayShear, vertices: &[Vec3; 3], t_min: f32, t_max: f32) -> Option<TriangleHit> {
    let project = |vertex: Vec3| {
        let a = dominant_axis_last(vertex - ray.origin, ray.axis);
        Vec3::new(a.x - ray.shear.x * a.z, a.y - ray.shear.y * a.z, ray.shear.z * a.z)
    };
    let (a, b, c) = (project(vertices[0]), project(vertices[1]), project(vertices[2]));
    let u = difference_of_products(c.x, b.y, c.y, b.x);
    let v = difference_of_products(a.x, c.y, a.y, c.x);
    let w = difference_of_products(b.x, a.y, b.y, a.x);
    let inside = (u >= 0.0 && v >= 0.0 && w >= 0.0) || (u <= 0.0 && v <= 0.0 && w <= 0.0);
    let det = u + v + w;
    if !inside || det == 0.0 {
        return None;
    }
    let inverse = 1.0 / det;
    let t = (u * a.z + v * b.z + w * c.z) * inverse;
    (t >= t_min && t <= t_max).then_some(TriangleHit {
        t,
        u: v * inverse,
        v: w * inverse,
    })
}

/// Rows of the catalogue.
pub(crate) const ROWS: &[Row] = &[Row {
    id: "CL-TRIANGLE",
    name: "watertight triangle test",
    role: Role::Kernel,
    limits: "Misses triangles with two equal corners or seen exactly edge-on; rays at outer edges, with no neighbour behind them, may pass; its bounds hold for edge products above 2⁻¹⁰⁰ m².",
    sources: &[sources::WOOP_2013.whole()],
    shaders: &["shaders/accel/triangle.glsl"],
    tests: &[
        "engine/src/accel/triangle/tests.rs::hits_keep_their_stated_error_and_misses_are_right",
        "engine/src/accel/triangle/tests.rs::edges_and_vertices_belong_to_both_sides",
        "engine/src/accel/bvh2/tests.rs::no_ray_passes_between_the_triangles_of_a_sphere",
        "tests/tests/accel/seams.rs::no_ray_is_lost_at_seams_in_any_index",
        "tests/tests/accel/seams.rs::kernels_lose_no_ray_at_seams_in_any_index",
        "tests/tests/twins/geometry.rs::triangles_agree_with_their_twins",
    ],
    api: &[
        "clerestory::accel::triangle::intersect_triangle",
        "clerestory::accel::triangle::ray_shear",
    ],
    ..Row::of(file!())
}];

#[cfg(test)]
mod tests;
