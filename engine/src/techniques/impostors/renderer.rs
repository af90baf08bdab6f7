//! Progressive pictures of eye paths and a map: first the map, piece by piece, then eye paths with a stage that looks it up.

use std::collections::BTreeMap;
use std::sync::Arc;

use super::capture::{Capture, CaptureCounts, Captured};
use crate::Result;
use crate::film::picture::{NonFiniteSamples, Picture};
use crate::film::{PixelFormat, Step};
use crate::gpu::shaders::techniques::path::path_shade;
use crate::gpu::{Buffer, Gpu, PipelineInfo};
use crate::scene::Camera;
use crate::techniques::skipped::skipped;
use crate::techniques::{PathTracer, PathTracerSettings, Skipped};
use crate::transport::random::SamplerKind;
use crate::transport::{GpuScene, PathSet, SURFACE_FEATURES};
use crate::walk::ArrivalStage;

/// What eye paths do with a map.
pub(in crate::techniques) trait MapUse: Send {
    /// Takes the map, for eye paths of so many slots.
    fn take(&mut self, gpu: &Gpu, scene: &GpuScene, captured: Captured, slots: u32) -> Result<()>;
    /// The stage of a wave, `is_first` for one of pixels' first samples; `None` before there is a map, or where there is none.
    fn stage<'a>(&'a self, scene: &'a GpuScene, is_first: bool) -> Option<Box<dyn ArrivalStage + 'a>>;
    /// Looks at what a wave that has ended met, `is_first` as above, and adds its counts. One that fails is asked for again, before the next wave.
    fn count(&mut self, is_first: bool) -> Result<()>;
    fn counters(&self) -> BTreeMap<&'static str, u64>;
    fn pipelines(&self) -> Vec<PipelineInfo>;
}

/// Settings of eye paths whose stage looks a map up.
pub(in crate::techniques) fn eye_settings(
    path_set: PathSet,
    sampler: SamplerKind,
    seed: u32,
    aovs: bool,
) -> PathTracerSettings {
    PathTracerSettings {
        path_set,
        sampler,
        seed,
        aovs,
        // Counts are read wave by wave.
        full_waves: false,
        ..PathTracerSettings::default()
    }
}

/// A progressive rendering of one view by a map and eye paths.
pub(in crate::techniques) struct MapRenderer<U> {
    gpu: Gpu,
    scene: Arc<GpuScene>,
    eye: PathTracer,
    /// Until the map is there; `None` from then on, and where none is needed.
    capture: Option<Capture>,
    has_map: bool,
    /// What has made the map that is there.
    captured_by: Vec<PipelineInfo>,
    /// Work of the map: submissions, and what they have traced.
    capture_steps: u64,
    capture_counts: CaptureCounts,
    /// A wave that has ended and is not counted yet: whether it is one of pixels' first samples. What it met may refuse the picture, which stays refused then.
    uncounted: Option<bool>,
    pub map_use: U,
}

impl<U: MapUse> MapRenderer<U> {
    pub fn new(gpu: &Gpu, scene: Arc<GpuScene>, eye: PathTracer, capture: Option<Capture>, map_use: U) -> Self {
        Self {
            gpu: gpu.clone(),
            scene,
            eye,
            has_map: capture.is_some(),
            capture,
            captured_by: Vec::new(),
            capture_steps: 0,
            capture_counts: CaptureCounts::default(),
            uncounted: None,
            map_use,
        }
    }

    /// A piece of the map, or a submission of eye paths.
    pub fn step(&mut self, samples: u32) -> Result<Option<Step>> {
        self.count()?;
        if self.eye.samples_done() >= samples && !self.eye.is_within_wave() {
            return Ok(None);
        }
        if let Some(capture) = &mut self.capture {
            let timings = capture.advance(&self.gpu, &self.scene)?;
            self.capture_steps += 1;
            if let Some(capture) = self.capture.take_if(|capture| capture.is_done()) {
                self.captured_by = capture.pipelines();
                self.capture_counts = capture.counts();
                let slots = self.eye.slots();
                self.map_use
                    .take(&self.gpu, &self.scene, capture.into_captured(), slots)?;
            }
            return Ok(Some(self.eye.step_so_far(timings, samples)));
        }
        let is_first = self.eye.samples_done() == 0;
        let stage = self.map_use.stage(&self.scene, is_first);
        let step = self.eye.step_with(samples, stage.as_deref())?;
        let looks_up = stage.is_some();
        drop(stage);
        // They are those of a whole wave.
        if looks_up && step.is_some() && !self.eye.is_within_wave() {
            self.uncounted = Some(is_first);
            self.count()?;
        }
        Ok(step)
    }

    /// Counts a wave that has ended.
    fn count(&mut self) -> Result<()> {
        if let Some(is_first) = self.uncounted {
            self.map_use.count(is_first)?;
            self.uncounted = None;
        }
        Ok(())
    }

    pub fn picture(&mut self) -> Result<(Picture, NonFiniteSamples)> {
        self.eye.picture()
    }

    pub fn display(&mut self, target: &Buffer, exposure: f32, format: PixelFormat) -> Result<()> {
        self.eye.display(target, exposure, format)
    }

    /// The map does not depend on the camera.
    pub fn set_camera(&mut self, camera: &Camera) -> Result<()> {
        self.eye.set_camera(camera)?;
        self.uncounted = None;
        Ok(())
    }

    pub fn counters(&self) -> BTreeMap<&'static str, u64> {
        let eye = self.eye.counters();
        let mut all = BTreeMap::from([
            ("paths", eye.paths),
            ("extend_rays", eye.extend_rays),
            ("shadow_rays", eye.shadow_rays),
            ("rays", eye.extend_rays + eye.shadow_rays),
            ("waves", eye.waves),
            ("stalls", eye.stalls),
            ("postponed", eye.postponed),
            ("capture_steps", self.capture_steps),
            ("map_paths", self.capture_counts.paths),
            ("map_rays", self.capture_counts.rays),
            ("map_non_finite", self.capture_counts.non_finite),
        ]);
        all.extend(self.map_use.counters());
        all
    }

    pub fn pipelines(&self) -> Vec<PipelineInfo> {
        let mut all = self.eye.pipelines();
        all.extend(self.capture.iter().flat_map(Capture::pipelines));
        all.extend(self.captured_by.iter().cloned());
        all.extend(self.map_use.pipelines());
        all
    }

    /// What eye paths leave out, and the map where there is none.
    pub fn skipped(&self, no_map: Skipped) -> Vec<Skipped> {
        let mut all = skipped(&self.eye.pipelines(), path_shade::INFO.name, &SURFACE_FEATURES);
        if !self.has_map {
            all.push(no_map);
        }
        all
    }
}
