//! Whether refracted rays would pass a second interface: nothing is followed past the first, so that pictures in which they would are refused.
//!
//! Refracted rays are traced on from where they begin. What they meet is a second interface where it is a smooth surface that transmits, of the same body or of another one that was left out of the map.
//!
//! Limits: one less than 2⁻¹⁴ of the width of what refracts behind the first is passed over; alpha is not looked at. Deterministic.

use std::ops::Range;

use glam::Vec3;

use super::capture::bounds_of;
use super::stage::LookUp;
use crate::accel::Ray;
use crate::accel::trace::{RayTracer, TraceSettings};
use crate::gpu::{Gpu, PipelineInfo};
use crate::transport::GpuScene;
use crate::{Error, Result};

/// How far off the first interface another one is looked for, as a part of the width of all that refract.
const BEHIND: f32 = 1.0 / 16_384.0;
/// Rays that are traced together: a bounded piece of work.
const RAYS_TOGETHER: usize = 1 << 18;

/// Surfaces that refract, and what traces rays to them.
pub(super) struct Interfaces {
    tracer: RayTracer,
    /// Triangles, in their order.
    triangles: Vec<Range<u32>>,
    /// Metres.
    least: f32,
}

impl Interfaces {
    /// Of some triangles of a scene.
    pub fn new(gpu: &Gpu, scene: &GpuScene, triangles: Vec<Range<u32>>) -> Result<Self> {
        let index = scene.index_on_device();
        let settings = TraceSettings::ray_per_thread().fitted(gpu.caps(), index.traversal);
        let width = bounds_of(gpu, scene, &triangles)?.map_or(0.0, |[low, high]| (high - low).length());
        Ok(Self {
            tracer: RayTracer::on_device(gpu, index, &settings)?,
            triangles,
            least: BEHIND * width,
        })
    }

    /// What traces.
    pub fn pipeline(&self) -> PipelineInfo {
        self.tracer.pipeline()
    }

    /// Refuses refracted rays, from a place (metres), that meet another interface.
    ///
    /// # Errors
    /// [`Error::Unsupported`] with how many do; [`Error::OutOfMemory`], [`Error::DeviceLost`].
    pub fn check(&self, place: Vec3, looked_up: &[LookUp]) -> Result<()> {
        let refracted = looked_up.iter().filter(|look_up| look_up.is_refracted);
        let rays: Vec<Ray> = refracted
            .map(|look_up| Ray {
                origin: (place + look_up.origin).to_array(),
                t_min: self.least,
                direction: look_up.direction.to_array(),
                t_max: f32::INFINITY,
            })
            .collect();
        let mut second = 0;
        for part in rays.chunks(RAYS_TOGETHER) {
            let hits = self.tracer.trace(part)?.hits;
            let is_interface = |triangle: u32| self.triangles.iter().any(|range| range.contains(&triangle));
            second += hits.iter().filter(|hit| is_interface(hit.triangle)).count();
        }
        if second == 0 {
            return Ok(());
        }
        let all = rays.len();
        Err(Error::Unsupported {
            technique: super::reflections::TECHNIQUE.into(),
            reasons: vec![format!(
                "{second} of {all} refracted rays meet a second interface, and nothing is followed past the first"
            )],
        })
    }
}
