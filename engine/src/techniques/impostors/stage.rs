//! Reflected rays at work: where eye paths first arrive at smooth surfaces, what the rays meet is looked up in the map. A stage of the path tracer's bounces.

use std::ops::Range;

use glam::Vec3;

use super::capture::Captured;
use super::settings::{ReflectionMethod, ReflectionSettings};
use crate::Result;
use crate::accel::Ray;
use crate::gpu::interface::BindingSet;
use crate::gpu::shaders::constants::{
    DIRECTIONAL_OCTAHEDRON, IMPOSTOR_CLASSICAL, IMPOSTOR_HOLDS_DISTANCE, REFLECTION_NONE, REFLECTION_REFRACTED,
};
use crate::gpu::shaders::sets::{ImpostorSet, WaveSet};
use crate::gpu::shaders::techniques::impostors::impostor_reflect as kernel;
use crate::gpu::{Buffer, BufferDesc, Category, ComputePipeline, Gpu, Pass, PipelineInfo, Recorder};
use crate::maps::impostor::Impostor;
use crate::transport::{GpuScene, PathSet, surface_spec};
use crate::walk::{ArrivalStage, Places, StoppedPlaces, stage_barrier};

/// A reflected ray, or a refracted one, and where the map was looked up for it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LookUp {
    /// The eye path's slot in its wave: with a sample per pixel and one wave, the pixel. Of two rays of a path the refracted one is kept.
    pub slot: u32,
    /// Where the ray begins, from the map's place, metres.
    pub origin: Vec3,
    /// Its unit direction.
    pub direction: Vec3,
    /// The unit direction in which the map shows what it meets.
    pub found: Vec3,
    /// |1 − g|, how far the place that was found is from a surface, relatively; 1 where nothing was searched for.
    pub residual: f32,
    /// Whether it is a refracted ray.
    pub is_refracted: bool,
}

/// Exact counts of look-ups.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, serde::Serialize)]
#[non_exhaustive]
pub struct LookUpCounts {
    /// Reflected and refracted rays.
    pub reflections: u64,
    /// The refracted ones.
    pub refractions: u64,
    /// Those that left to the sky.
    pub sky: u64,
    /// Those whose search ended farther from a surface than the tolerance.
    pub unfound: u64,
}

type Counters = kernel::ReflectionCounters;
type Record = crate::gpu::shaders::types::ReflectionRecord;

/// The map on the device, and the kernel.
pub(super) struct Reflections {
    gpu: Gpu,
    pipeline: ComputePipeline<kernel::Kernel>,
    radiance: Buffer,
    side: u32,
    impostor: Option<Impostor>,
    place: Vec3,
    tolerance: f32,
    triangles: Range<u32>,
    records: Option<Buffer>,
    counters: Buffer,
    counters_readback: Buffer,
}

impl Reflections {
    /// For eye paths of the set `eye`, up to `slots` at once, that arrive at some triangles. Waves' look-ups can be kept where the settings say so, and where `refracts`.
    pub fn new(
        gpu: &Gpu,
        scene: &GpuScene,
        settings: &ReflectionSettings,
        (captured, place): (Captured, Vec3),
        (eye, slots): (&PathSet, u32),
        triangles: Range<u32>,
        refracts: bool,
    ) -> Result<Self> {
        let search = settings.search();
        let impostor = captured
            .impostor
            .as_ref()
            .map(|image| Impostor::with_texels(gpu, image, settings.texels))
            .transpose()?;
        // Refracted rays are traced on.
        let keeps_look_ups = settings.keeps_look_ups || refracts;
        let spec = surface_spec!(kernel, scene, {
            has_multiple_scattering: false,
            separable_masking: false,
            has_path_automaton: eye.has_automaton(),
            directional_kind: DIRECTIONAL_OCTAHEDRON,
            directional_border: 0,
            impostor_method: search.map_or(IMPOSTOR_CLASSICAL, |search| search.method.number()),
            impostor_steps: search.map_or(0, |search| search.steps),
            impostor_bisections: search.map_or(0, |search| search.bisections),
            impostor_layers: settings.layers,
            impostor_holds: impostor.as_ref().map_or(IMPOSTOR_HOLDS_DISTANCE, Impostor::holds),
            impostor_is_open: impostor.as_ref().is_none_or(Impostor::is_open),
            reflects_in_box: settings.method == ReflectionMethod::Box,
            keeps_look_ups,
            // By textures surfaces may be smooth, too.
            refracts: settings.refracts && scene.profile().has_transmission(),
            ..Default::default()
        });
        let bytes = size_of::<Counters>() as u64;
        let records = || {
            let bytes = u64::from(slots) * size_of::<Record>() as u64;
            gpu.buffer(&BufferDesc::storage("reflection look-ups", bytes, Category::Work))
        };
        Ok(Self {
            gpu: gpu.clone(),
            pipeline: gpu.compute_pipeline(&spec)?,
            radiance: captured.radiance,
            side: captured.side,
            impostor,
            place,
            tolerance: settings.tolerance,
            triangles,
            records: keeps_look_ups.then(records).transpose()?,
            counters: gpu.buffer(&BufferDesc::storage("reflection counters", bytes, Category::Work))?,
            counters_readback: gpu.buffer(&BufferDesc::readback("reflection counters", bytes))?,
        })
    }

    pub fn pipeline(&self) -> PipelineInfo {
        self.pipeline.info()
    }

    /// Bytes of the map.
    pub fn bytes(&self) -> u64 {
        self.radiance.bytes() + self.impostor.as_ref().map_or(0, Impostor::bytes)
    }

    /// Counts of the last wave.
    pub fn counts(&self) -> Result<LookUpCounts> {
        let counters = self.counters_readback.read::<Counters>(0, 1)?[0];
        Ok(LookUpCounts {
            reflections: counters.reflections.into(),
            refractions: counters.refractions.into(),
            sky: counters.sky.into(),
            unfound: counters.unfound.into(),
        })
    }

    /// What is kept of the last wave that kept any, slot by slot.
    fn kept(&self) -> Result<Vec<Record>> {
        let Some(records) = &self.records else {
            return Ok(Vec::new());
        };
        let count = (records.bytes() / size_of::<Record>() as u64) as usize;
        self.gpu.read(records.view(), count)
    }

    /// The refracted rays of the last wave that kept its look-ups, from where the path tracer's would begin.
    pub fn refracted_rays(&self) -> Result<Vec<Ray>> {
        let ray = |record: &Record| Ray {
            origin: record.start,
            t_min: 0.0,
            direction: record.direction,
            t_max: f32::INFINITY,
        };
        let kept = self.kept()?;
        let refracted = kept.iter().filter(|record| record.kind == REFLECTION_REFRACTED);
        Ok(refracted.map(ray).collect())
    }

    /// What the last wave has looked up, by slot; nothing where that is not kept.
    pub fn looked_up(&self) -> Result<Vec<LookUp>> {
        let kept = (0..).zip(self.kept()?);
        let used = kept.filter(|(_, record)| record.kind != REFLECTION_NONE);
        Ok(used
            .map(|(slot, record)| LookUp {
                slot,
                origin: Vec3::from_array(record.origin),
                direction: Vec3::from_array(record.direction),
                found: Vec3::from_array(record.found),
                residual: record.residual,
                is_refracted: record.kind == REFLECTION_REFRACTED,
            })
            .collect())
    }
}

/// Look-ups to be recorded with a wave.
pub(super) struct ReflectionStage<'a> {
    pub reflections: &'a Reflections,
    pub scene: &'a GpuScene,
    /// Whether look-ups are kept, where they can be.
    pub keeps: bool,
}

impl ReflectionStage<'_> {
    fn push(&self) -> kernel::Push {
        let r = self.reflections;
        let [lower, upper] = self.scene.bounds().map(|corner| corner.to_array());
        kernel::Push {
            scene_lower: lower,
            first_triangle: r.triangles.start,
            scene_upper: upper,
            end_triangle: r.triangles.end,
            place: r.place.to_array(),
            tolerance: r.tolerance,
            side: r.side,
            keeps: self.keeps.into(),
        }
    }

    /// Set 1; without distances other buffers stand in their place, which no kernel reads.
    fn impostor_set(&self) -> ImpostorSet<'_> {
        let r = self.reflections;
        r.impostor.as_ref().map_or(
            ImpostorSet {
                impostor_shapes: r.radiance.view(),
                impostor_texels: self.scene.scene_set().scene_triangles,
            },
            Impostor::set,
        )
    }

    fn set(&self) -> kernel::Set3<'_> {
        let r = self.reflections;
        kernel::Set3 {
            map_radiance: r.radiance.view(),
            reflection_counters: r.counters.view(),
            // Kernels that keep none do not write it.
            reflection_records: r.records.as_ref().unwrap_or(&r.counters).view(),
        }
    }
}

impl ArrivalStage for ReflectionStage<'_> {
    fn record(&self, recorder: &mut Recorder, wave: &WaveSet<'_>, places: Places<'_>) -> Result<()> {
        let (distances, scene, own) = (self.impostor_set(), self.scene.scene_set(), self.set());
        recorder.pass("impostor: reflect", |pass| {
            let sets: [&dyn BindingSet<'_>; 4] = [wave, &distances, &scene, &own];
            pass.dispatch_indirect(&self.reflections.pipeline, &sets, &self.push(), places.items)?;
            stage_barrier(pass);
            Ok(())
        })
    }

    fn reset(&self, pass: &mut Pass<'_>) -> Result<()> {
        if let Some(records) = self.reflections.records.as_ref().filter(|_| self.keeps) {
            pass.fill(records.view(), 0)?;
        }
        pass.update(self.reflections.counters.view(), &[Counters::default()])
    }

    fn read_back(&self, pass: &mut Pass<'_>) -> Result<()> {
        pass.copy(
            self.reflections.counters.view(),
            self.reflections.counters_readback.view(),
        )
    }

    /// A look-up never stops.
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
