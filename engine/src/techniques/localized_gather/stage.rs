//! The gather at work: where eye paths first arrive at rough surfaces, light of the map's coarse texels. A stage of the path tracer's bounces.

use std::ops::Range;

use glam::Vec3;

use super::settings::{GatherTerms, LocalizedGatherSettings};
use crate::Result;
use crate::gpu::interface::BindingSet;
use crate::gpu::shaders::sets::WaveSet;
use crate::gpu::shaders::techniques::localized_gather::localized_gather as kernel;
use crate::gpu::{Buffer, BufferDesc, Category, ComputePipeline, Gpu, Pass, PipelineInfo, Recorder};
use crate::maps::gather::{GatherLights, Reflectivity, SolidAngleForm, device_lights};
use crate::transport::{GpuScene, surface_spec};
use crate::walk::{ArrivalStage, Places, StoppedPlaces, stage_barrier};

type Counters = kernel::LocalizedCounters;

/// The lights on the device, and the kernel.
pub(super) struct Gather {
    pipeline: ComputePipeline<kernel::Kernel>,
    lights: Buffer,
    count: u32,
    table: Option<Buffer>,
    place: Vec3,
    triangles: Range<u32>,
    counters: Buffer,
    counters_readback: Buffer,
}

impl Gather {
    /// For eye paths that arrive at some triangles, from a map at `place`, metres.
    pub fn new(
        gpu: &Gpu,
        scene: &GpuScene,
        lights: &GatherLights,
        settings: &LocalizedGatherSettings,
        place: Vec3,
        triangles: Range<u32>,
    ) -> Result<Self> {
        let spec = surface_spec!(kernel, scene, {
            has_multiple_scattering: scene.bsdf_features().multiple_scattering,
            separable_masking: false,
            gather_form: lights.form().number(),
            gather_five: settings.terms == GatherTerms::Five,
            gather_cones: settings.cones,
            ..Default::default()
        });
        let has_normals = lights.form() == SolidAngleForm::DiscWithNormals;
        let records = device_lights(lights, has_normals);
        let table = || {
            let table = Reflectivity::new(1.0)?;
            gpu.buffer_with("localized gather: reflectivities", Category::Light, table.values())
        };
        let bytes = size_of::<Counters>() as u64;
        Ok(Self {
            pipeline: gpu.compute_pipeline(&spec)?,
            count: records.len() as u32,
            lights: gpu.buffer_with("localized gather: lights", Category::Light, &records)?,
            table: settings.cones.then(table).transpose()?,
            place,
            triangles,
            counters: gpu.buffer(&BufferDesc::storage("localized gather counters", bytes, Category::Work))?,
            counters_readback: gpu.buffer(&BufferDesc::readback("localized gather counters", bytes))?,
        })
    }

    pub fn pipeline(&self) -> PipelineInfo {
        self.pipeline.info()
    }

    /// How many lights there are.
    pub fn lights(&self) -> u32 {
        self.count
    }

    /// Points that gathered in the last wave.
    pub fn gathers(&self) -> Result<u64> {
        Ok(self.counters_readback.read::<Counters>(0, 1)?[0].gathers.into())
    }
}

/// A gather to be recorded with a wave.
pub(super) struct LocalizedStage<'a> {
    pub gather: &'a Gather,
    pub scene: &'a GpuScene,
}

impl LocalizedStage<'_> {
    fn push(&self) -> kernel::Push {
        let g = self.gather;
        let [lower, upper] = self.scene.bounds().map(|corner| corner.to_array());
        kernel::Push {
            scene_lower: lower,
            first_triangle: g.triangles.start,
            scene_upper: upper,
            end_triangle: g.triangles.end,
            place: g.place.to_array(),
            lights: g.count,
        }
    }
}

impl ArrivalStage for LocalizedStage<'_> {
    fn record(&self, recorder: &mut Recorder, wave: &WaveSet<'_>, places: Places<'_>) -> Result<()> {
        let g = self.gather;
        let own = kernel::Set1 {
            gather_lights: g.lights.view(),
            // Kernels without a table do not read it.
            gather_table: g.table.as_ref().unwrap_or(&g.lights).view(),
            localized_counters: g.counters.view(),
        };
        let scene = self.scene.scene_set();
        recorder.pass("localized gather", |pass| {
            let sets: [&dyn BindingSet<'_>; 3] = [wave, &own, &scene];
            pass.dispatch_indirect(&g.pipeline, &sets, &self.push(), places.items)?;
            stage_barrier(pass);
            Ok(())
        })
    }

    fn reset(&self, pass: &mut Pass<'_>) -> Result<()> {
        pass.update(self.gather.counters.view(), &[Counters::default()])
    }

    fn read_back(&self, pass: &mut Pass<'_>) -> Result<()> {
        pass.copy(self.gather.counters.view(), self.gather.counters_readback.view())
    }

    /// A gather never stops.
    fn record_stopped(
        &self,
        _recorder: &mut Recorder,
        _wave: &WaveSet<'_>,
        _stopped: StoppedPlaces,
        _part: u64,
    ) -> Result<Option<u64>> {
        Ok(None)
    }
}
