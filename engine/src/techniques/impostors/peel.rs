//! Further layers of what a place sees: behind each surface the next one, by rays.
//!
//! Sources: C. Everitt, "Interactive Order-Independent Transparency", NVIDIA, 2001 (layers by what lies behind the last one); L. Szirmay-Kalos et al., "Specular Effects on the GPU: State of the Art",
//! CGF 28(6), 2009 (layered distance maps). The first layer is drawn; rays along the middles of texels, which begin behind the last layer, find the next one.
//!
//! What is met from the place is seen from there. But nobody sees a body's far side from within: where a ray enters an object by a side that faces the place and meets a side of the same object next that turns away, that
//! side's radiance is the one towards beyond, where reflected rays come from.
//!
//! Bias: a surface less than 2⁻¹⁴ of its distance behind the last one is passed over; alpha is not looked at; sheets that are folded like a body show their far side. Deterministic.

use std::ops::Range;

use glam::{DVec3, UVec2, Vec3};

use super::capture::{CapturePlan, MAP};
use crate::Result;
use crate::accel::trace::{RayTracer, TraceSettings};
use crate::accel::{NO_HIT, Ray};
use crate::gpu::shaders::types::SceneTriangle;
use crate::gpu::{Gpu, PipelineInfo, Timings};
use crate::maps::Texel;
use crate::maps::impostor::ImpostorImage;
use crate::raster::ObjectTriangles;
use crate::transport::GpuScene;

/// By how much rays begin behind a surface, as a part of its distance.
const BEHIND: f32 = 1.0 / 16_384.0;
/// By how much paths begin before what a texel shows, as a part of its distance.
const LEAD: f32 = 1.0 / 1024.0;
/// Texels whose rays are traced together: a bounded piece of work.
const TEXELS_TOGETHER: usize = 1 << 18;
/// Surfaces that are left out on the way to the next one, at most; behind more there is nothing.
const LEFT_OUT_MAX: u32 = 64;

/// Layers of surfaces, nearest first.
pub(super) struct Layers {
    place: Vec3,
    side: u32,
    left_out: Vec<Range<u32>>,
    with_normals: bool,
    /// Distances and normals of each, row by row; the last one may lack its end.
    layers: Vec<Layer>,
    /// Triangles of the first, where further ones are wanted.
    drawn: Vec<u32>,
    /// For layers behind the first.
    tracing: Option<Tracing>,
    /// Rays that were traced for them.
    rays: u64,
}

#[derive(Default)]
struct Layer {
    distances: Vec<f32>,
    /// Where they are wanted.
    normals: Vec<DVec3>,
    /// Of surfaces, once further layers are looked for.
    sides: Vec<Side>,
}

/// Which side of what is met.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Side {
    /// Number of its object.
    object: u32,
    /// Whether its triangle turns away from the place.
    turns_away: bool,
}

/// Where nothing is met.
const NO_SIDE: Side = Side {
    object: u32::MAX,
    turns_away: false,
};

struct Tracing {
    tracer: RayTracer,
    triangles: Vec<SceneTriangle>,
    objects: Vec<ObjectTriangles>,
}

impl Tracing {
    /// Which side of a triangle is met along a direction, and its unit normal towards where that comes from.
    fn side(&self, triangle: u32, along: DVec3) -> (Side, DVec3) {
        let Some(corners) = self.triangles.get(triangle as usize) else {
            return (NO_SIDE, -along);
        };
        let [a, b, c] = [corners.a, corners.b, corners.c].map(|v| Vec3::from_array(v).as_dvec3());
        let normal = (b - a).cross(c - a).normalize_or(-along);
        let turns_away = normal.dot(along) > 0.0;
        // In the order of their triangles.
        let before = self.objects.partition_point(|object| object.triangles.end <= triangle);
        let owner = self
            .objects
            .get(before)
            .filter(|object| object.triangles.contains(&triangle));
        let object = owner.map_or(u32::MAX, |owner| owner.object);
        (Side { object, turns_away }, if turns_away { -normal } else { normal })
    }
}

impl Layers {
    /// The first layer, as it was drawn; with its normals where they are wanted, and its triangles where further layers are.
    pub fn new(plan: &CapturePlan, distances: Vec<f32>, normals: Option<Vec<DVec3>>, triangles: Vec<u32>) -> Self {
        Self {
            place: plan.place,
            side: plan.side,
            left_out: plan.left_out.clone(),
            with_normals: normals.is_some(),
            layers: vec![Layer {
                distances,
                normals: normals.unwrap_or_default(),
                sides: Vec::new(),
            }],
            drawn: triangles,
            tracing: None,
            rays: 0,
        }
    }

    /// Whether there are so many layers.
    pub fn has(&self, count: u32) -> bool {
        let texels = self.side as usize * self.side as usize;
        self.layers.len() == count as usize && self.layers.last().is_some_and(|layer| layer.distances.len() == texels)
    }

    /// The direction of a texel.
    fn direction(&self, texel: usize) -> DVec3 {
        direction(self.side, texel)
    }

    /// Makes what traces, and finds the sides of the first layer.
    fn begin(&mut self, gpu: &Gpu, scene: &GpuScene) -> Result<Tracing> {
        let surfaces = scene.surfaces();
        let triangles = surfaces.set.scene_triangles.buffer().view();
        let index = scene.index_on_device();
        let tracing = Tracing {
            tracer: RayTracer::on_device(
                gpu,
                index,
                &TraceSettings::ray_per_thread().fitted(gpu.caps(), index.traversal),
            )?,
            triangles: gpu.read(triangles, surfaces.triangles as usize)?,
            objects: surfaces.objects.to_vec(),
        };
        let side = |(texel, triangle): (usize, &u32)| tracing.side(*triangle, self.direction(texel)).0;
        let sides = self.drawn.iter().enumerate().map(side).collect();
        if let Some(first) = self.layers.first_mut() {
            first.sides = sides;
        }
        Ok(tracing)
    }

    /// Finds a part of the next layer.
    pub fn advance(&mut self, gpu: &Gpu, scene: &GpuScene) -> Result<Timings> {
        let tracing = match self.tracing.take() {
            Some(tracing) => tracing,
            None => self.begin(gpu, scene)?,
        };
        let texels = self.side as usize * self.side as usize;
        if self.layers.last().is_some_and(|layer| layer.distances.len() == texels) {
            self.layers.push(Layer::default());
        }
        let side = self.side;
        let place = self.place.to_array();
        let [.., last, next] = &mut self.layers[..] else {
            return Ok(Timings::default());
        };
        let first = next.distances.len();
        let part = first..texels.min(first + TEXELS_TOGETHER);
        let begin = |texel: usize, distance: f32| Ray {
            origin: place,
            t_min: distance * (1.0 + BEHIND),
            direction: direction(side, texel).as_vec3().to_array(),
            t_max: f32::INFINITY,
        };
        for texel in part.clone() {
            next.distances.push(ImpostorImage::NOTHING);
            if self.with_normals {
                next.normals.push(-direction(side, texel));
            }
            next.sides.push(NO_SIDE);
        }
        let mut waiting: Vec<(usize, Ray)> = part
            .filter(|texel| last.distances[*texel] < ImpostorImage::NOTHING)
            .map(|texel| (texel, begin(texel, last.distances[texel])))
            .collect();
        let mut timings = Timings::default();
        for _ in 0..LEFT_OUT_MAX {
            let rays: Vec<Ray> = waiting.iter().map(|(_, ray)| *ray).collect();
            let traced = tracing.tracer.trace(&rays)?;
            self.rays += rays.len() as u64;
            timings.passes.extend(traced.timings.passes);
            let mut left = Vec::new();
            for ((texel, _), hit) in waiting.into_iter().zip(traced.hits) {
                if hit.triangle == NO_HIT {
                    continue;
                }
                if self.left_out.iter().any(|range| range.contains(&hit.triangle)) {
                    left.push((texel, begin(texel, hit.t)));
                    continue;
                }
                next.distances[texel] = hit.t.clamp(last.distances[texel], ImpostorImage::NOTHING);
                let (met, normal) = tracing.side(hit.triangle, direction(side, texel));
                next.sides[texel] = met;
                if let Some(kept) = next.normals.get_mut(texel) {
                    *kept = normal;
                }
            }
            waiting = left;
            if waiting.is_empty() {
                break;
            }
        }
        self.tracing = Some(tracing);
        Ok(timings)
    }

    /// Where the paths of a layer begin, metres from the place, row by row: just before its surfaces, or `outside` where there are none. Those that are below 0 begin so far behind a body's far side, and go back.
    pub fn starts(&self, layer: u32, outside: f32) -> Vec<f32> {
        let layer = layer as usize;
        let Some(own) = self.layers.get(layer) else {
            return Vec::new();
        };
        let other = |layer: Option<usize>, texel: usize| {
            let layer = layer.and_then(|layer| self.layers.get(layer));
            layer.and_then(|layer| layer.distances.get(texel)).copied()
        };
        let start = |texel: usize| {
            let distance = own.distances[texel];
            if distance >= ImpostorImage::NOTHING {
                return outside;
            }
            let before = layer.checked_sub(1).and_then(|before| self.layers.get(before));
            if before.is_some_and(|before| is_within(before, own, texel)) {
                let next = other(Some(layer + 1), texel).unwrap_or(f32::INFINITY);
                return -((1.0 + LEAD) * distance).min(0.5 * (distance + next));
            }
            let last = other(layer.checked_sub(1), texel).unwrap_or(0.0);
            ((1.0 - LEAD) * distance).max(0.5 * (last + distance))
        };
        (0..own.distances.len()).map(start).collect()
    }

    /// Rays that were traced for layers behind the first.
    pub fn rays(&self) -> u64 {
        self.rays
    }

    /// What has traced them.
    pub fn pipelines(&self) -> Vec<PipelineInfo> {
        let tracing = self.tracing.iter();
        tracing.map(|tracing| tracing.tracer.pipeline()).collect()
    }

    /// All layers as an impostor.
    pub fn image(&self) -> Result<ImpostorImage> {
        let distances = self
            .layers
            .iter()
            .flat_map(|layer| layer.distances.iter().copied())
            .collect();
        let normals: Vec<DVec3> = self
            .layers
            .iter()
            .flat_map(|layer| layer.normals.iter().copied())
            .collect();
        let count = self.layers.len() as u32;
        let normals = self.with_normals.then_some(normals.as_slice());
        ImpostorImage::new(MAP, UVec2::splat(self.side), count, distances, normals)
    }
}

/// The direction of a texel of a map of so many along a side.
fn direction(side: u32, texel: usize) -> DVec3 {
    let texel = Texel {
        layer: 0,
        x: texel as u32 % side,
        y: texel as u32 / side,
    };
    MAP.texel_direction(UVec2::splat(side), texel).unwrap_or(DVec3::Z)
}

/// Whether the way between two layers is within a body.
fn is_within(before: &Layer, layer: &Layer, texel: usize) -> bool {
    match (before.sides.get(texel), layer.sides.get(texel)) {
        (Some(enter), Some(leave)) => enter.object == leave.object && !enter.turns_away && leave.turns_away,
        _ => false,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn paths_begin_between_layers() {
        let side = |object, turns_away| Side { object, turns_away };
        let layer = |distances: [f32; 4], sides: [Side; 4]| Layer {
            distances: distances.into(),
            normals: vec![DVec3::Z; 4],
            sides: sides.into(),
        };
        let nothing = ImpostorImage::NOTHING;
        // A thin body before a wall, a thick one before nothing, nothing, and a body before a wall that turns away.
        let layers = Layers {
            place: Vec3::ZERO,
            side: 1,
            left_out: Vec::new(),
            with_normals: true,
            layers: vec![
                layer(
                    [1.0, 2.0, nothing, 2.0],
                    [side(3, false), side(4, false), NO_SIDE, side(4, false)],
                ),
                layer(
                    [1.0001, 3.0, nothing, 3.0],
                    [side(3, true), side(4, true), NO_SIDE, side(5, true)],
                ),
                layer(
                    [1.0003, nothing, nothing, nothing],
                    [side(5, true), NO_SIDE, NO_SIDE, NO_SIDE],
                ),
            ],
            drawn: Vec::new(),
            tracing: None,
            rays: 0,
        };
        let before = 1.0 - LEAD;
        assert_eq!(layers.starts(0, 9.0), [before, 2.0 * before, 9.0, 2.0 * before]);
        // Nearer to its own surface than to the next one, on the way back; of another object, on the way there.
        let back = [-0.5 * (1.0001 + 1.0003), -3.0 * (1.0 + LEAD)];
        assert_eq!(layers.starts(1, 9.0), [back[0], back[1], 9.0, 3.0 * before]);
        assert_eq!(layers.starts(2, 9.0), [0.5 * (1.0001 + 1.0003), 9.0, 9.0, 9.0]);
        assert!(layers.starts(3, 9.0).is_empty());
    }
}
