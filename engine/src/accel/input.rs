//! What builders of ray indexes are given: settings within their ranges, and triangles, of which those that no ray can meet are left out
//! and counted.
//!
//! Guarantee: what is left out depends on each triangle alone, and the order of the others stays.

use super::bvh2::{Bvh2Triangle, MAX_TRIANGLES};
use super::{Aabb, IndexStatistics, MAX_COORDINATE};
use crate::{Error, Result};
use glam::{DVec3, Vec3};
use rayon::prelude::*;

enum Usability {
    Yes,
    OutOfRange,
    Degenerate,
}

fn classify(triangle: &[Vec3; 3]) -> Usability {
    // NaN fails the comparison.
    if !triangle
        .iter()
        .all(|v| v.abs().cmple(Vec3::splat(MAX_COORDINATE)).all())
    {
        return Usability::OutOfRange;
    }
    let [a, b, c] = triangle.map(|v| v.as_dvec3());
    if (b - a).cross(c - a) == DVec3::ZERO {
        return Usability::Degenerate;
    }
    Usability::Yes
}

/// Whether rays can meet a triangle: in range, and of an area in f64.
pub(crate) fn can_be_met(triangle: &[Vec3; 3]) -> bool {
    matches!(classify(triangle), Usability::Yes)
}

/// The triangles that an index is built of: those that rays can meet, in order.
pub(super) struct UsableTriangles<'a> {
    triangles: &'a [[Vec3; 3]],
    /// Their indices; `None` when that is every one.
    indices: Option<Vec<u32>>,
    /// How many there are and how many were left out.
    pub(super) statistics: IndexStatistics,
}

impl<'a> UsableTriangles<'a> {
    pub(super) fn among(triangles: &'a [[Vec3; 3]]) -> Self {
        let count = |[range, degenerate]: [u64; 2], triangle| match classify(triangle) {
            Usability::Yes => [range, degenerate],
            Usability::OutOfRange => [range + 1, degenerate],
            Usability::Degenerate => [range, degenerate + 1],
        };
        let [excluded_range, excluded_degenerate] = triangles
            .par_iter()
            .fold(|| [0; 2], count)
            .reduce(|| [0; 2], |a, b| [a[0] + b[0], a[1] + b[1]]);
        let excluded = excluded_range + excluded_degenerate;
        let usable = |i: &u32| can_be_met(&triangles[*i as usize]);
        Self {
            triangles,
            indices: (excluded > 0).then(|| (0..triangles.len() as u32).into_par_iter().filter(usable).collect()),
            statistics: IndexStatistics {
                triangles: triangles.len() as u64 - excluded,
                excluded_range,
                excluded_degenerate,
                ..IndexStatistics::default()
            },
        }
    }

    /// Index of the triangle at a place.
    pub(super) fn index(&self, place: u32) -> u32 {
        self.indices.as_ref().map_or(place, |indices| indices[place as usize])
    }

    /// The triangle at a place, as the kernels read it.
    pub(super) fn triangle(&self, place: u32) -> Bvh2Triangle {
        let index = self.index(place);
        Bvh2Triangle::new(self.triangles[index as usize], index)
    }

    /// Something of each, given its corners and its index.
    pub(super) fn map<T: Send>(&self, of: impl Fn(&[Vec3; 3], u32) -> T + Sync) -> Vec<T> {
        let at = |i: u32| of(&self.triangles[i as usize], i);
        match &self.indices {
            None => (0..self.triangles.len() as u32).into_par_iter().map(at).collect(),
            Some(indices) => indices.par_iter().map(|i| at(*i)).collect(),
        }
    }
}

/// The box of a triangle.
pub(super) fn bounds_of(triangle: &[Vec3; 3]) -> Aabb {
    triangle.iter().fold(Aabb::EMPTY, |bounds, v| bounds.with_point(*v))
}

/// Refuses more triangles than child words can address.
pub(super) fn check_count(triangles: usize) -> Result<()> {
    if triangles <= MAX_TRIANGLES {
        return Ok(());
    }
    Err(Error::LimitExceeded {
        name: "bvh2 triangles".into(),
        value: triangles as u64,
        limit_name: "accel::bvh2::MAX_TRIANGLES",
        limit: MAX_TRIANGLES as u64,
    })
}

/// Refuses a setting outside its range, both ends of which it may take.
pub(super) fn check_range(name: &str, value: u32, least: u32, most: u32) -> Result<()> {
    if (least..=most).contains(&value) {
        return Ok(());
    }
    Err(Error::Setting {
        name: name.into(),
        value: value.to_string(),
        cause: format!("is outside {least}..={most}"),
    })
}
