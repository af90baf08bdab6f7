//! Light of reflective shadow maps without virtual lights: pixels gather from texels in a disc of each view.
//!
//! Source: C. Dachsbacher and M. Stamminger, "Reflective Shadow Maps", I3D 2005. The samples of a disc lie as densely in each ring, which has the density 1/(2π r_max r): its
//! inverse, linear in the distance, is the weight that has the disc's sum as its mean. The published weight by the square of the distance gives as much to what
//! is the same everywhere, an eighth too much to what grows with the distance, and a quarter too little to what falls to nothing at the rim.

use std::ops::Range;

use super::kernels::Sight;
use super::reflective::Reflective;
use super::settings::{Gathering, ManyLightSettings};
use crate::Result;
use crate::gpu::shaders::techniques::instant_radiosity::rsm_gather;
use crate::gpu::{Access, Buffer, ComputePipeline, Gpu, Pass, PipelineInfo};
use crate::techniques::Part;
use crate::transport::edge_bound::EdgeBound;
use crate::transport::{GpuScene, surface_spec};

/// What a sample of a disc takes, as so many steps of a ray through an index.
const SAMPLE_WORK: u64 = 8;
/// Tells the numbers that turn discs from those of other samplers.
const DISC_SEED: u32 = 0x6469_7363;

/// The maps, and what gathers from them.
pub(super) struct Discs {
    pub reflective: Reflective,
    pipeline: ComputePipeline<rsm_gather::Kernel>,
    bound: EdgeBound,
    radius: f32,
    seed: u32,
    /// Pixels of a submission.
    pub pixels: u32,
}

impl Discs {
    pub fn new(gpu: &Gpu, scene: &GpuScene, settings: &ManyLightSettings, pixels: u32) -> Result<Self> {
        let bound = settings.edge_bound(scene.surface_area());
        let spec = surface_spec!(rsm_gather, scene, {
            has_multiple_scattering: scene.bsdf_features().multiple_scattering,
            separable_masking: false,
            has_alpha: false,
            edge_bound: bound.kind(),
            disc_samples: settings.disc_samples,
            disc_squared: settings.gathering == Gathering::DiscSquared,
            ..Default::default()
        });
        let work = SAMPLE_WORK * u64::from(settings.disc_samples) * u64::from(pixels);
        Ok(Self {
            reflective: Reflective::new(gpu, scene, settings)?,
            pipeline: gpu.compute_pipeline(&spec)?,
            bound,
            radius: settings.disc_radius * settings.rsm_side as f32,
            seed: settings.seed ^ DISC_SEED,
            pixels: pixels.div_ceil(Part::count(gpu, work)).max(1),
        })
    }

    pub fn set_seed(&mut self, seed: u32) {
        self.seed = seed ^ DISC_SEED;
        self.reflective.set_seed(seed);
    }

    pub fn pipelines(&self) -> Vec<PipelineInfo> {
        let mut all = self.reflective.pipelines();
        all.push(self.pipeline.info());
        all
    }

    /// Adds what the texels of a view bring to these pixels.
    pub fn record(
        &self,
        pass: &mut Pass<'_>,
        sight: &Sight<'_>,
        (frame, view): (u32, u32),
        pixels: Range<u32>,
        radiance: &Buffer,
    ) -> Result<()> {
        let Sight { scene, seen, from } = sight;
        let [lower, upper] = scene.bounds().map(|corner| corner.to_array());
        let push = rsm_gather::Push {
            seen: *from,
            scene_lower: lower,
            edge_bound: self.bound.value(),
            scene_upper: upper,
            radius: self.radius,
            view,
            first_pixel: pixels.start,
            end_pixel: pixels.end,
            frame,
            seed: self.seed,
        };
        let [emitters, views, texels] = self.reflective.texels();
        let set = rsm_gather::Set0 {
            virtual_light_texels: self.reflective.records(),
            seen_triangles: seen.triangles()?,
            seen_weights: seen.weights()?,
            rsm_emitters: emitters.view(),
            rsm_views: views.view(),
            rsm_texels: texels.view(),
            radiance: radiance.view(),
        };
        let groups = self.pipeline.groups_over(pixels.len() as u32);
        pass.dispatch(&self.pipeline, &[&set, &scene.scene_set()], &push, groups)?;
        pass.memory_barrier(Access::COMPUTE, Access::COMPUTE);
        Ok(())
    }
}
