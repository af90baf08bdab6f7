//! What maps that are filled from a scene hold wrongly: triangles and positions at texels, and shadows that are looked up in them.

use clerestory::accel::RayIndex;
use clerestory::raster::splats::surfels_of;
use clerestory::raster::tessellation::{tessellation_point, tessellation_weights};
use glam::{DVec3, Vec3};
use rayon::prelude::*;
use std::f64::consts::PI;

use super::filled_maps::{Filled, FilledScene, Seen, Variant, Way, texel_index};
use crate::experiments::measures::errors::Errors;

/// Points seen at a smaller cosine than this do not count: there the depth of a texel spans more than their distance over ten texels.
pub const LEAST_COSINE: f64 = 0.1;
/// Of distances, beside what the texel's width makes.
pub const ROUNDING_BIAS: f64 = 1e-4;

/// A point on a surface, for shadows.
pub struct ShadowPoint {
    direction: DVec3,
    distance: f64,
    /// Of the angle between the surface's normal and the direction.
    tangent: f64,
    /// Whether light in the map's middle reaches it.
    pub is_lit: bool,
}

/// About so many points, evenly over all surfaces but those seen at grazing angles.
pub fn shadow_points(live: &FilledScene, count: u32) -> Vec<ShadowPoint> {
    let point = |surfel: &clerestory::gpu::shaders::types::Surfel| {
        let from = Vec3::from_array(surfel.position).as_dvec3() - live.origin.as_dvec3();
        let [a, b, c] = live.corners[surfel.number as usize].map(|corner| corner.as_dvec3());
        let direction = from.try_normalize()?;
        let cosine = (b - a).cross(c - a).try_normalize()?.dot(direction).abs();
        if cosine < LEAST_COSINE {
            return None;
        }
        let distance = from.length();
        let hit = live.index.closest_hit(&live.ray(direction));
        Some(ShadowPoint {
            direction,
            distance,
            tangent: (1.0 - cosine * cosine).max(0.0).sqrt() / cosine,
            is_lit: f64::from(hit.t) >= distance * (1.0 - ROUNDING_BIAS),
        })
    };
    surfels_of(&live.corners, count).par_iter().filter_map(point).collect()
}

/// Mean angle of a texel of a map.
fn texel_width(variant: &Variant) -> f64 {
    let texels = variant.size.element_product() * variant.map.layers();
    (4.0 * PI / f64::from(texels)).sqrt()
}

/// Shares of points that are lit wrongly and in shadow wrongly.
fn shadow_errors(variant: &Variant, filled: &Filled, points: &[ShadowPoint]) -> [f64; 2] {
    let width = texel_width(variant);
    let wrong = |point: &ShadowPoint| {
        let Some(at) = variant.map.encode(point.direction) else {
            return [0, 1];
        };
        let stored = f64::from(filled.distances[texel_index(variant.size, at)]);
        let bias = point.distance * (width * point.tangent + ROUNDING_BIAS);
        let is_lit = point.distance <= stored + bias;
        [
            usize::from(is_lit && !point.is_lit),
            usize::from(!is_lit && point.is_lit),
        ]
    };
    let sums = points
        .iter()
        .map(wrong)
        .fold([0, 0], |sum, wrong| [sum[0] + wrong[0], sum[1] + wrong[1]]);
    sums.map(|sum| sum as f64 / points.len().max(1) as f64)
}

/// What of a map differs from rays.
#[derive(Default)]
pub struct Quality {
    /// Share of texels with another triangle.
    pub wrong: f64,
    /// Share of texels with nothing where there is something.
    pub empty: f64,
    /// Mean and 99th percentile of the angles between texels and what they show, in texels' widths; none where nothing is interpolated.
    pub angles: Option<[f64; 2]>,
    /// Lit wrongly, and in shadow wrongly.
    pub shadow: [f64; 2],
}

/// A filled map beside what rays see and what shadow rays say.
pub fn quality(variant: &Variant, filled: &Filled, seen: &Seen, points: &[ShadowPoint]) -> Quality {
    let (mut held, mut wrong, mut empty) = (0, 0, 0);
    let mut angles = Errors::default();
    for (texel, direction) in seen.directions.iter().enumerate() {
        let Some(direction) = direction else { continue };
        held += 1;
        let (found, exact) = (filled.triangles[texel], seen.hits[texel].triangle);
        wrong += usize::from(found != exact);
        empty += usize::from(found == u32::MAX && found != exact);
        if let Some(position) = filled.positions[texel] {
            angles.add(position.angle_between(*direction) / texel_width(variant));
        }
    }
    let share = |count: usize| count as f64 / f64::from(held.max(1));
    Quality {
        wrong: share(wrong),
        empty: share(empty),
        angles: (variant.way != Way::Splats).then(|| [angles.mean(), angles.quantile(0.99)]),
        shadow: shadow_errors(variant, filled, points),
    }
}

/// Mean angle, in radians, that edges of pieces are seen at.
pub fn edge_length(live: &FilledScene, level: u32) -> f64 {
    let origin = live.origin;
    let of = |triangle: &[Vec3; 3]| -> [f64; 2] {
        let pieces = (0..level * level).map(|piece| {
            let corner = |i| tessellation_point(tessellation_weights(level, piece, i), level, *triangle) - origin;
            let [a, b, c] = [0, 1, 2].map(|i| corner(i).as_dvec3());
            a.angle_between(b) + b.angle_between(c) + c.angle_between(a)
        });
        [pieces.filter(|sum| sum.is_finite()).sum(), f64::from(3 * level * level)]
    };
    let add = |a: [f64; 2], b: [f64; 2]| [a[0] + b[0], a[1] + b[1]];
    let [sum, count] = live.corners.par_iter().map(of).reduce(|| [0.0; 2], add);
    sum / count.max(1.0)
}
