//! Virtual lights that pixels keep one each of, and take from their neighbours.
//!
//! Sources: B. Bitterli et al., "Spatiotemporal reservoir resampling for real-time ray tracing with dynamic direct lighting", SIGGRAPH 2020; D. Lin et al., "Generalized
//! Resampled Importance Sampling: Foundations of ReSTIR", SIGGRAPH 2022. Here lights are virtual ones, a frame has nothing of those before, and what neighbours keep is
//! weighted by the balance heuristic over what it brings to each of them, so that the mean is that of all lights.

use std::ops::Range;

use super::kernels::Sight;
use super::settings::ManyLightSettings;
use crate::Result;
use crate::gpu::shaders::techniques::instant_radiosity::{deferred_resample, deferred_reuse};
use crate::gpu::shaders::types::Reservoir;
use crate::gpu::{
    Access, Buffer, BufferDesc, Category, ComputePipeline, Gpu, Pass, PipelineInfo, SOFTWARE_LOOP_CAP, TexelView,
    wide_counter,
};
use crate::raster::Output;
use crate::techniques::Part;
use crate::transport::edge_bound::EdgeBound;
use crate::transport::{GpuScene, surface_spec};

/// What a light takes at a pixel, as so many steps of a ray through an index.
const CONNECTION_WORK: u64 = 8;
/// Tells the numbers that lights are drawn by from those of other samplers.
const RESERVOIR_SEED: u32 = 0x7265_7376;

type Counters = deferred_reuse::ReservoirCounters;

/// The reservoirs of a picture, and what fills and empties them.
pub(super) struct Reservoirs {
    resample: ComputePipeline<deferred_resample::Kernel>,
    reuse: ComputePipeline<deferred_reuse::Kernel>,
    bound: EdgeBound,
    candidates: u32,
    reach: f32,
    plane_max: f32,
    normal_min: f32,
    scale: f32,
    seed: u32,
    reservoirs: Buffer,
    counters: Buffer,
    counters_readback: Buffer,
    /// Pixels of a submission that draws lights, and of one that adds their light.
    pub pixels: [u32; 2],
}

impl Reservoirs {
    /// For pictures of so many pixels.
    pub fn new(gpu: &Gpu, scene: &GpuScene, settings: &ManyLightSettings, pixels: u32) -> Result<Self> {
        let bound = settings.edge_bound(scene.surface_area());
        // The rest is for lights.
        let index = scene.filtered_index_within(gpu, SOFTWARE_LOOP_CAP / 2)?;
        let resample = surface_spec!(deferred_resample, scene, {
            has_multiple_scattering: scene.bsdf_features().multiple_scattering,
            separable_masking: false,
            has_alpha: false,
            edge_bound: bound.kind(),
            ..Default::default()
        });
        let reuse = surface_spec!(deferred_reuse, scene, {
            has_multiple_scattering: scene.bsdf_features().multiple_scattering,
            separable_masking: false,
            has_alpha: scene.profile().has_alpha(),
            edge_bound: bound.kind(),
            visibility: settings.visibility.kind(),
            neighbours: settings.neighbours,
            index_quota: index.quota,
            index_kind: index.kind,
            ..Default::default()
        });
        let of_pixel = [
            CONNECTION_WORK * u64::from(settings.candidates),
            CONNECTION_WORK * u64::from(settings.neighbours + 1).pow(2) + index.steps,
        ];
        let counters = size_of::<Counters>() as u64;
        let [lower, upper] = scene.bounds();
        Ok(Self {
            resample: gpu.compute_pipeline(&resample)?,
            reuse: scene.index_traversal().pipeline(gpu, &reuse)?,
            bound,
            candidates: settings.candidates,
            reach: settings.neighbour_reach,
            plane_max: settings.filter_plane * (upper - lower).length(),
            normal_min: settings.filter_normal,
            scale: 1.0 / settings.lights as f32,
            seed: settings.seed ^ RESERVOIR_SEED,
            reservoirs: gpu.buffer(&BufferDesc::storage(
                "reservoirs",
                size_of::<Reservoir>() as u64 * u64::from(pixels),
                Category::Work,
            ))?,
            counters: gpu.buffer(&BufferDesc::storage("reservoir counters", counters, Category::Work))?,
            counters_readback: gpu.buffer(&BufferDesc::readback("reservoir counters", counters))?,
            pixels: of_pixel.map(|work| pixels.div_ceil(Part::count(gpu, work * u64::from(pixels))).max(1)),
        })
    }

    pub fn set_seed(&mut self, seed: u32) {
        self.seed = seed ^ RESERVOIR_SEED;
    }

    pub fn pipelines(&self) -> [PipelineInfo; 2] {
        [self.resample.info(), self.reuse.info()]
    }

    /// Bytes of what pixels keep.
    pub fn bytes(&self) -> u64 {
        self.reservoirs.bytes()
    }

    /// Draws lights for these pixels, the first of which begin a frame.
    pub fn record_resample(
        &self,
        pass: &mut Pass<'_>,
        sight: &Sight<'_>,
        (records, lights): (&TexelView, u32),
        frame: u32,
        pixels: Range<u32>,
    ) -> Result<()> {
        if pixels.start == 0 {
            pass.memory_barrier(Access::COMPUTE | Access::TRANSFER_READ, Access::TRANSFER_WRITE);
            pass.fill(self.counters.view(), 0)?;
            pass.memory_barrier(Access::TRANSFER_WRITE, Access::COMPUTE);
        }
        let Sight { scene, seen, from } = sight;
        let [lower, upper] = scene.bounds().map(|corner| corner.to_array());
        let push = deferred_resample::Push {
            seen: *from,
            scene_lower: lower,
            edge_bound: self.bound.value(),
            scene_upper: upper,
            lights,
            candidates: self.candidates,
            first_pixel: pixels.start,
            end_pixel: pixels.end,
            frame,
            seed: self.seed,
        };
        let set = deferred_resample::Set0 {
            virtual_light_texels: records,
            seen_triangles: seen.triangles()?,
            seen_weights: seen.weights()?,
            reservoirs: self.reservoirs.view(),
            reservoir_counters: self.counters.view(),
        };
        let groups = self.resample.groups_over(pixels.len() as u32);
        pass.dispatch(&self.resample, &[&set, &scene.scene_set()], &push, groups)?;
        pass.memory_barrier(Access::COMPUTE, Access::COMPUTE);
        Ok(())
    }

    /// Adds the light of what these pixels and their neighbours keep.
    pub fn record_reuse(
        &self,
        pass: &mut Pass<'_>,
        sight: &Sight<'_>,
        records: &TexelView,
        frame: u32,
        pixels: Range<u32>,
        radiance: &Buffer,
    ) -> Result<()> {
        let Sight { scene, seen, from } = sight;
        let [lower, upper] = scene.bounds().map(|corner| corner.to_array());
        let push = deferred_reuse::Push {
            seen: *from,
            scene_lower: lower,
            edge_bound: self.bound.value(),
            scene_upper: upper,
            scale: self.scale,
            reach: self.reach,
            plane_max: self.plane_max,
            normal_min: self.normal_min,
            first_pixel: pixels.start,
            end_pixel: pixels.end,
            frame,
            seed: self.seed,
        };
        let set = deferred_reuse::Set0 {
            virtual_light_texels: records,
            seen_triangles: seen.triangles()?,
            seen_weights: seen.weights()?,
            seen_positions: seen.view(Output::Position, Output::Weights)?,
            seen_normals: seen.view(Output::Normals, Output::Triangle)?,
            reservoirs: self.reservoirs.view(),
            reservoir_counters: self.counters.view(),
            radiance: radiance.view(),
        };
        let groups = self.reuse.groups_over(pixels.len() as u32);
        let (index, scene) = (scene.index_set(), scene.scene_set());
        pass.dispatch(&self.reuse, &[&set, &index, &scene], &push, groups)?;
        pass.memory_barrier(Access::COMPUTE, Access::COMPUTE | Access::TRANSFER_READ);
        pass.copy(self.counters.view(), self.counters_readback.view())
    }

    /// Pairs of a pixel and a light of the last frame, and those whose visibility was asked for.
    pub fn counts(&self) -> Result<[u64; 2]> {
        let counters = self.counters_readback.read::<Counters>(0, 1)?[0];
        Ok([counters.connections, counters.tests].map(wide_counter))
    }
}
