//! Where an instance is: its vertices in world space, and rays of world space in the space of its mesh.
//!
//! Source: forward error analysis as in M. Pharr, W. Jakob, G. Humphreys, "Physically Based Rendering", 4th ed., §6.8 ("Managing Rounding Error").
//!
//! Triangles are tested in world space, where they are the images of their mesh's vertices under A·p + b in f32, each of which is computed from its
//! vertex and the instance alone: triangles that share a vertex share its image to the bit. So the triangle test is as watertight as it is over
//! triangles that were in world space from the start, `t` needs no transform, and all bounds that the test keeps hold with the image's
//! coordinates. With u = 2⁻²⁴, an image is within E = 3uL + uC of A·p + b by component, L being the largest component of |A||p| and C that of an
//! image, and A and b are within u of what was asked for, relative to each number: see [`InstanceTransform::vertex_error`].
//!
//! # Why no hit is culled
//!
//! Only boxes are met in the space of the mesh, by a ray with origin W(o − b) and direction W·d, where W is A's inverse rounded to f32. The triangle
//! test reports t so that o + t·d is within 34uM of a point of an image, hence within 34uM + E of A·p + b for a point p of the triangle (M as in
//! [`BOX_SLACK`](crate::accel::box_test::BOX_SLACK)). Let R = W·A − I, known exactly but for f64, and wᵢ the sum of the sizes of row i of W. Then W(o − b) + t·W·d is, by
//! component i, within
//!
//! - |R·p|ᵢ + wᵢ(34uM + E) of p;
//! - the computed origin within 4u·wᵢ(M + L) of W(o − b), since b is within M + L of o: difference u, product u, two sums 2u;
//! - t times the computed direction within 3u·wᵢM of t·W·d, since t·d is within M by component: product u, two sums 2u.
//!
//! With the 12u·wᵢM of spans of decoded boxes (see [`wide::traverse`](crate::accel::wide::traverse)), whose planes are within wᵢM of the origin, that is under
//! 53u·wᵢM + |R·p|ᵢ + wᵢ(E + 4uL) to first order. Boxes are grown by 64u·wᵢM, and by an instance's own [`InstanceTransform::slack`], which is 1.01 times the rest.
//! Components of the direction below 2⁻⁴⁴ of the largest are replaced by that, which moves the ray by 2⁻⁴⁴ of the largest wM: within the slack
//! while A is no more uneven than [`MAX_UNEVENNESS`].

use crate::accel::{Aabb, MAX_COORDINATE};
use crate::gpu::shaders::constants;
use glam::{DAffine3, DMat3, DVec3, Vec3};

/// Largest and, as its reciprocal, least size of the largest entry of a transform and of its inverse: 2²⁰.
pub const MAX_SCALE: f64 = 1_048_576.0;

/// Largest entry of a transform times that of its inverse, at most: 2¹⁶. With it no product of the box test overflows.
pub const MAX_UNEVENNESS: f64 = 65_536.0;

/// Least extent of a mesh along its longest axis, in its own space, 2⁻⁴⁰: below it steps of grids times reciprocal directions may underflow.
const MIN_EXTENT: f64 = 9.094_947_017_729_282e-13;

/// Unit roundoff of f32.
const U: f64 = 1.0 / 16_777_216.0;

/// What is added to bounds of first order, and to what f64 has computed.
const SPARE: f64 = 1.01;

/// Smallest component of a direction in the space of a mesh that the box test takes as it is, relative to the largest: 2⁻⁴⁴.
pub const MIN_INSTANCE_COMPONENT: f32 = constants::TWO_LEVEL_MIN_COMPONENT;

/// Rows of a 3 × 3 matrix.
pub type Rows = [Vec3; 3];

/// A row times a vector, from left to right. Twin of the kernels' function of this name.
pub fn instance_row(row: Vec3, v: Vec3) -> f32 {
    row.x * v.x + row.y * v.y + row.z * v.z
}

/// Rows times a vector.
pub fn instance_rows(rows: &Rows, v: Vec3) -> Vec3 {
    Vec3::from_array(rows.map(|row| instance_row(row, v)))
}

/// The image of a vertex. Twin of the kernels' function of this name.
pub fn instance_vertex(rows: &Rows, translation: Vec3, vertex: Vec3) -> Vec3 {
    instance_rows(rows, vertex) + translation
}

/// A placement that rays can be traced through.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct InstanceTransform {
    /// A, of mesh space to world space.
    pub rows: Rows,
    /// b, metres.
    pub translation: Vec3,
    /// W, of world space to mesh space.
    pub inverse: Rows,
    /// What boxes of the mesh are grown by, by axis, on top of their share of the ray's reach.
    pub slack: Vec3,
    /// Box of all images, metres.
    pub bounds: Aabb,
    /// E: how far, by component, an image may be from what the rounded transform makes of its vertex exactly, metres.
    pub vertex_error: f64,
}

/// A as f64 has it.
fn matrix_of(rows: &Rows) -> DMat3 {
    DMat3::from_cols_array_2d(&rows.map(|row| row.as_dvec3().to_array())).transpose()
}

fn rows_of(matrix: DMat3) -> Rows {
    [0, 1, 2].map(|i| matrix.row(i).as_vec3())
}

fn largest(rows: &Rows) -> f64 {
    rows.iter()
        .map(|row| f64::from(row.abs().max_element()))
        .fold(0.0, f64::max)
}

impl InstanceTransform {
    /// Of a mesh that lies in `parts`, boxes in its own space, of which there is at least one.
    ///
    /// `None` for a transform that is not finite, not invertible, or more uneven or of another scale than rays can be traced through, for images
    /// beyond [`MAX_COORDINATE`], and for meshes smaller than 2⁻⁴⁰ in their own space.
    pub fn of(transform: &DAffine3, parts: &[[DVec3; 2]]) -> Option<Self> {
        if *transform == DAffine3::IDENTITY {
            return Some(Self::identity(parts));
        }
        let rows = rows_of(transform.matrix3);
        let translation = transform.translation.as_vec3();
        let matrix = matrix_of(&rows);
        let finite = matrix.is_finite() && translation.is_finite();
        if !finite || matrix.determinant() == 0.0 {
            return None;
        }
        let inverse = rows_of(matrix.inverse());
        let (size, inverse_size) = (largest(&rows), largest(&inverse));
        let in_range = |size: f64| (1.0 / MAX_SCALE..=MAX_SCALE).contains(&size);
        let (lower, upper) = parts
            .iter()
            .fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(lower, upper), part| {
                (lower.min(part[0]), upper.max(part[1]))
            });
        let fits = in_range(size)
            && in_range(inverse_size)
            && size * inverse_size <= MAX_UNEVENNESS
            && (upper - lower).max_element() >= MIN_EXTENT
            && lower.abs().max(upper.abs()).max_element() <= f64::from(MAX_COORDINATE);
        if !fits {
            return None;
        }
        // L, C and E.
        let farthest = lower.abs().max(upper.abs());
        let offset = (matrix.abs() * farthest).max_element();
        let error = SPARE * U * (3.0 * offset + (offset + f64::from(translation.abs().max_element())));
        let bounds = image_of(&matrix, translation.as_dvec3(), parts, error);
        if bounds.lower.abs().max(bounds.upper.abs()).max_element() > MAX_COORDINATE {
            return None;
        }
        let inverse_matrix = matrix_of(&inverse);
        let residue = (inverse_matrix * matrix - DMat3::IDENTITY).abs() * farthest;
        let sums = inverse_matrix.abs() * DVec3::ONE;
        let slack = SPARE * (residue + sums * (error + 4.0 * U * offset));
        Some(Self {
            rows,
            translation,
            inverse,
            slack: Vec3::from_array(slack.to_array().map(rounded_up)),
            bounds,
            vertex_error: error,
        })
    }

    /// Of a mesh that is where it is: images are the vertices themselves.
    fn identity(parts: &[[DVec3; 2]]) -> Self {
        let rows = rows_of(DMat3::IDENTITY);
        Self {
            rows,
            translation: Vec3::ZERO,
            inverse: rows,
            slack: Vec3::ZERO,
            bounds: image_of(&DMat3::IDENTITY, DVec3::ZERO, parts, 0.0),
            vertex_error: 0.0,
        }
    }

    /// Whether images are the vertices themselves.
    pub fn is_identity(&self) -> bool {
        self.rows == rows_of(DMat3::IDENTITY) && self.translation == Vec3::ZERO
    }

    /// Whether it turns fronts into backs, which swapped corners undo.
    pub fn mirrors(&self) -> bool {
        matrix_of(&self.rows).determinant() < 0.0
    }

    /// What kernels are told of it: `INSTANCE_IDENTITY`, `INSTANCE_MIRRORED`.
    pub(crate) fn flags(&self) -> u32 {
        let flag = |holds: bool, bit| if holds { bit } else { 0 };
        flag(self.is_identity(), constants::INSTANCE_IDENTITY) | flag(self.mirrors(), constants::INSTANCE_MIRRORED)
    }

    /// The corners of a triangle in world space, the second and the third swapped where it mirrors.
    pub fn triangle(&self, [a, b, c]: [Vec3; 3]) -> [Vec3; 3] {
        let corners = if self.mirrors() { [a, c, b] } else { [a, b, c] };
        if self.is_identity() {
            return corners;
        }
        corners.map(|corner| instance_vertex(&self.rows, self.translation, corner))
    }
}

/// The box around the images of boxes, grown by an error, with corners that f32 has.
fn image_of(matrix: &DMat3, translation: DVec3, parts: &[[DVec3; 2]], error: f64) -> Aabb {
    let absolute = matrix.abs();
    let (mut low, mut high) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
    for [lower, upper] in parts {
        let centre = *matrix * (0.5 * (*lower + *upper)) + translation;
        let half = absolute * (0.5 * (*upper - *lower));
        low = low.min(centre - half);
        high = high.max(centre + half);
    }
    if error > 0.0 {
        low -= error;
        high += error;
    }
    Aabb {
        lower: Vec3::from_array(low.to_array().map(|x| -rounded_up(-x))),
        upper: Vec3::from_array(high.to_array().map(rounded_up)),
    }
}

/// The least number of f32 that is not below.
fn rounded_up(x: f64) -> f32 {
    let near = x as f32;
    if f64::from(near) < x { near.next_up() } else { near }
}
