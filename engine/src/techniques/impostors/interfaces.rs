//! Whether refracted rays would pass a second interface: nothing is followed past the first, so that pictures in which they would are refused.
//!
//! Refracted rays are traced on as the path tracer's would be, from off their surface by the error of their place. What they meet is a second interface where it is a smooth surface that transmits, of the same body or of another one that was left out of the map.
//!
//! Limits: alpha is not looked at, and what is nearer to the first interface than that error, which the path tracer passes over, too, is not met. Deterministic.

use std::ops::Range;

use crate::accel::Ray;
use crate::accel::trace::{RayTracer, TraceSettings};
use crate::gpu::{Gpu, PipelineInfo};
use crate::transport::GpuScene;
use crate::{Error, Result};

/// Rays that are traced together: a bounded piece of work.
const RAYS_TOGETHER: usize = 1 << 18;

/// Surfaces that refract, and what traces rays to them.
pub(super) struct Interfaces {
    tracer: RayTracer,
    /// Triangles, in their order.
    triangles: Vec<Range<u32>>,
}

impl Interfaces {
    /// Of some triangles of a scene, in their order.
    pub fn new(gpu: &Gpu, scene: &GpuScene, triangles: Vec<Range<u32>>) -> Result<Self> {
        let index = scene.index_on_device();
        let settings = TraceSettings::ray_per_thread().fitted(gpu.caps(), index.traversal);
        Ok(Self {
            tracer: RayTracer::on_device(gpu, index, &settings)?,
            triangles,
        })
    }

    /// What traces.
    pub fn pipeline(&self) -> PipelineInfo {
        self.tracer.pipeline()
    }

    /// Refuses refracted rays that meet another interface.
    ///
    /// # Errors
    /// [`Error::Unsupported`] with how many do; [`Error::OutOfMemory`], [`Error::DeviceLost`].
    pub fn check(&self, refracted: &[Ray]) -> Result<()> {
        let mut second = 0;
        for part in refracted.chunks(RAYS_TOGETHER) {
            let hits = self.tracer.trace(part)?.hits;
            let is_interface = |triangle: u32| is_in(&self.triangles, triangle);
            second += hits.iter().filter(|hit| is_interface(hit.triangle)).count();
        }
        if second == 0 {
            return Ok(());
        }
        let all = refracted.len();
        Err(Error::Unsupported {
            technique: super::reflections::TECHNIQUE.into(),
            reasons: vec![format!(
                "{second} of {all} refracted rays meet a second interface, and nothing is followed past the first"
            )],
        })
    }
}

/// Whether one of some ranges, which stand in their order, has a number.
fn is_in(ranges: &[Range<u32>], number: u32) -> bool {
    let before = ranges.partition_point(|range| range.end <= number);
    ranges.get(before).is_some_and(|range| range.contains(&number))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::accel::NO_HIT;

    #[test]
    fn numbers_are_found_in_ranges_in_their_order() {
        let ranges = [2..4, 4..5, 7..10];
        let found: Vec<u32> = (0..12)
            .chain([NO_HIT])
            .filter(|number| is_in(&ranges, *number))
            .collect();
        assert_eq!(found, [2, 3, 4, 7, 8, 9]);
        assert!(!is_in(&[], 0));
    }
}
