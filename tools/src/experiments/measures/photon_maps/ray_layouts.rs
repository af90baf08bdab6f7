//! Trees over triangles in both layouts of pairs, complete and compact, and the rays that query them.
//!
//! Guarantee: deterministic.

use clerestory::accel::photon_map::compact_bvh::CompactBvh;
use clerestory::accel::photon_map::complete_bvh::{CompleteBvh, QueryCounters};
use clerestory::accel::triangle::{intersect_triangle, ray_shear};
use clerestory::accel::yardstick::area_sweep_tree;
use clerestory::accel::{Aabb, Ray};
use clerestory::{Error, Result};
use glam::Vec3;

use super::photon_scenes::Surfaces;

/// Triangles in a leaf at most, as in the source's trees.
pub const LEAF_SIZE: u32 = 5;
/// Bytes that shadow rays spare on a complete pair's stack entry: they need no distance.
pub const SHADOW_ENTRY_SPARES: u64 = 4;

/// Work over some rays.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Counts {
    /// Nodes fetched.
    pub nodes: u64,
    /// Stack entries.
    pub entries: u64,
    /// Bytes of nodes and stack.
    pub bytes: u64,
    /// Triangles tested.
    pub tests: u64,
}

/// A ray and whether it only asks for any hit.
#[derive(Clone, Copy)]
pub struct Query {
    origin: Vec3,
    direction: Vec3,
    t_max: f32,
    /// Whether any hit will do.
    pub is_shadow: bool,
}

/// Triangles in leaf order with their trees.
pub struct Trees {
    /// Complete pairs.
    pub complete: CompleteBvh,
    compact: CompactBvh,
    triangles: Vec<[Vec3; 3]>,
}

/// What a ray found and how.
#[derive(Clone, Copy, PartialEq)]
pub struct Answer {
    /// Parameter of the hit, or infinity.
    pub t: f32,
    /// Triangles tested.
    tests: u64,
    /// Work of the tree.
    tree: QueryCounters,
}

impl Trees {
    /// Of triangles, by full sweeps of the surface area heuristic.
    pub fn new(triangles: &[[Vec3; 3]]) -> Result<Self> {
        let corners = |t: &[Vec3; 3]| t.iter().fold(Aabb::EMPTY, |bounds, corner| bounds.with_point(*corner));
        let boxes: Vec<Aabb> = triangles.iter().map(corners).collect();
        let complete = CompleteBvh::new(&area_sweep_tree(&boxes, LEAF_SIZE))?;
        let compact = CompactBvh::encode(&complete)
            .map_err(|fault| Error::setting("tree", "compact", format!("is not tight: {fault:?}")))?;
        Ok(Self {
            triangles: complete.order.iter().map(|i| triangles[*i as usize]).collect(),
            complete,
            compact,
        })
    }

    /// Bytes of the pairs of both layouts as they lie in memory, complete ones first.
    pub fn bytes(&self) -> [u64; 2] {
        [
            size_of_val(self.complete.pairs.as_slice()),
            size_of_val(self.compact.pairs.as_slice()),
        ]
        .map(|bytes| bytes as u64)
    }

    /// What a ray finds in one of the layouts.
    pub fn answer(&self, query: &Query, is_compact: bool) -> Answer {
        let mut answer = Answer {
            t: f32::INFINITY,
            tests: 0,
            tree: QueryCounters::default(),
        };
        let shear = ray_shear(query.origin, query.direction);
        let mut nearest = query.t_max;
        let (mut t, mut tests) = (f32::INFINITY, 0);
        let leaf = |first: u32, t_max: &mut f32| {
            let places = self.triangles.iter().zip(&self.complete.ends).skip(first as usize);
            for (triangle, is_last) in places {
                tests += 1;
                if let Some(hit) = intersect_triangle(&shear, triangle, 0.0, nearest) {
                    (nearest, t) = (hit.t, hit.t);
                    // A shadow ray ends at any hit: nothing lies before its begin.
                    *t_max = if query.is_shadow { -1.0 } else { hit.t };
                    if query.is_shadow {
                        break;
                    }
                }
                if *is_last {
                    break;
                }
            }
        };
        let ray = Ray {
            origin: query.origin.into(),
            t_min: 0.0,
            direction: query.direction.into(),
            t_max: query.t_max,
        };
        if is_compact {
            self.compact.ray_query(&ray, &mut answer.tree, leaf);
        } else {
            self.complete.ray_query(&ray, &mut answer.tree, leaf);
        }
        (answer.t, answer.tests) = (t, tests);
        answer
    }

    /// Counts over all rays.
    pub fn counts(&self, queries: &[Query], is_compact: bool) -> Counts {
        let mut counts = Counts::default();
        for query in queries {
            let answer = self.answer(query, is_compact);
            let spared = if query.is_shadow && !is_compact {
                SHADOW_ENTRY_SPARES * answer.tree.pushes
            } else {
                0
            };
            counts.nodes += answer.tree.nodes;
            counts.entries += answer.tree.pushes;
            counts.bytes += answer.tree.bytes - spared;
            counts.tests += answer.tests;
        }
        counts
    }

    /// Whether a ray ends elsewhere in the other layout.
    pub fn differ(&self, query: &Query) -> bool {
        let [a, b] = [false, true].map(|is_compact| self.answer(query, is_compact).t);
        if query.is_shadow {
            a.is_finite() != b.is_finite()
        } else {
            a.to_bits() != b.to_bits()
        }
    }
}

/// Up to four rays per pixel: the camera's, its reflection, and a shadow ray from where each ends.
pub fn queries(surfaces: &Surfaces, light: Vec3, side: u32) -> Result<Vec<Query>> {
    let mut all = Vec::new();
    for (origin, direction) in surfaces.camera_rays(side)? {
        for (origin, direction, meeting) in surfaces.follow(origin, direction).into_iter().take(2) {
            all.push(Query {
                origin,
                direction,
                t_max: f32::INFINITY,
                is_shadow: false,
            });
            if let Some(meeting) = meeting {
                let (origin, direction, t_max) = surfaces.shadow_ray(&meeting, light);
                all.push(Query {
                    origin,
                    direction,
                    t_max,
                    is_shadow: true,
                });
            }
        }
    }
    Ok(all)
}
