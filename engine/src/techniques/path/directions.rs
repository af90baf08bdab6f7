//! Pictures of what is seen from a point in all directions: an octahedron's texels take the place of pixels.
//!
//! Paths go along the middles of texels, and begin at distances of their own from the point, so that a map of surroundings can leave out what it is made for.
//! Everything else is the path tracer's, noise and guarantees included.

use std::sync::Arc;

use glam::{DVec3, Vec3};

use super::pipelines::CameraStage;
use super::{PathTracer, PathTracerSettings};
use crate::gpu::shaders::constants::OUTSIDE;
use crate::gpu::shaders::sets::WaveSet;
use crate::gpu::shaders::techniques::path::path_directions as kernel;
use crate::gpu::{Buffer, ComputePipeline, Gpu, Pass};
use crate::scene::Camera;
use crate::transport::GpuScene;
use crate::walk::WalkKey;
use crate::{Error, Result};

/// The first stage.
pub(super) struct DirectionsStage {
    pipeline: ComputePipeline<kernel::Kernel>,
    place: Vec3,
    side: u32,
    starts: Buffer,
}

impl DirectionsStage {
    pub fn pipeline(&self) -> &ComputePipeline<kernel::Kernel> {
        &self.pipeline
    }

    /// Begins so many paths.
    pub fn record(&self, pass: &mut Pass<'_>, wave: &WaveSet<'_>, key: WalkKey, paths: u32) -> Result<()> {
        let push = kernel::Push {
            key,
            place: self.place.to_array(),
            side: self.side,
            slot_count: paths,
            interior: OUTSIDE,
        };
        let set = kernel::Set1 {
            starts: self.starts.view(),
        };
        let groups = [self.pipeline.groups_for(paths), 1, 1];
        pass.dispatch(&self.pipeline, &[wave, &set], &push, groups)
    }
}

impl PathTracer {
    /// A rendering of what is seen from a place (metres) in the directions of the octahedron's texels, `side` along each side, instead of through a camera. Paths of a
    /// texel begin `starts` away from the place, metres, one number a texel, row by row, where no body is around them; those below 0 begin so far away, and go towards the place. Without AOVs, and in whole waves.
    ///
    /// # Errors
    /// As [`PathTracer::new`]; [`Error::Setting`] for a place that is not finite.
    pub(in crate::techniques) fn of_directions(
        gpu: &Gpu,
        scene: Arc<GpuScene>,
        (place, side): (Vec3, u32),
        starts: Buffer,
        settings: PathTracerSettings,
    ) -> Result<Self> {
        if !place.is_finite() {
            return Err(Error::setting("place", place, "is not finite"));
        }
        // Stands where paths have their eye; what it looks at is nobody's.
        let eye = place.as_dvec3();
        let camera = Camera::look_at("all directions", eye, eye + DVec3::Z, DVec3::Y, 1.0);
        let settings = PathTracerSettings {
            aovs: false,
            full_waves: false,
            ..settings
        };
        let mut tracer = Self::new(gpu, scene, &camera, [side; 2], settings)?;
        tracer.pipelines.camera = CameraStage::Directions(DirectionsStage {
            pipeline: gpu.compute_pipeline(&())?,
            place,
            side,
            starts,
        });
        Ok(tracer)
    }
}
