//! The preview as a frame method.

use std::collections::BTreeMap;
use std::sync::Arc;

use glam::DVec2;

use super::drawing::Drawing;
use super::lights::{LightMap, LightRoom, PreviewShadows};
use super::probe::{LightProbe, LightProbeDesc, ProbeMap};
use super::shade::{PreviewPart, Target};
use crate::Result;
use crate::gpu::{Gpu, PipelineInfo, Recorder};
use crate::raster::{Coverage, DrawPart, SHADOW_WIDTH_MAX, ShadowLayout};
use crate::scene::Camera;
use crate::scene::camera_frame::CameraFrame;
use crate::settings::TypedSettings;
use crate::techniques::{Frame, FrameMethod, FrameTarget, Part, Skipped};
use crate::transport::random::{Sampler, SamplerKind, sample_2d};
use crate::transport::warp::square_to_disk;
use crate::transport::{GpuScene, PathSet};

crate::settings! {
    /// Settings of [`PreviewMethod`].
    pub struct PreviewSettings {
        /// How shadow maps store directions; changes the borders of shadows.
        pub shadow_layout: ShadowLayout = ShadowLayout::Octahedron;
        /// Along a side of an octahedron, or of each face of a cube, and of the square across all of the scene that a directional light has: more give less bias at borders of
        /// shadows.
        ///
        /// Shadows of what is no larger than texels are wrong as a whole: in `builtin:conference` at more than a tenth of the places that face
        /// the light with the default, and at 9 % with 2508.
        pub shadow_side: u32 = 1024, in 1..=16_384, unit "texels";
        /// Width of the shadows' filter: softer borders instead of stairs.
        pub shadow_width: u32 = 2, in 0..=SHADOW_WIDTH_MAX, unit "texels";
        /// Along a side of the environment's map, a power of two: how sharp mirrors are.
        pub probe_side: u32 = 256, in 64..=4096, unit "texels";
        /// Along a side of its finest level that is filtered by a lobe, a power of two.
        ///
        /// The work before the first frame grows with its fourth power.
        pub probe_finest: u32 = 128, in 32..=256, unit "texels";
    }
}

impl PreviewSettings {
    /// What they say of shadow maps.
    pub fn shadows(&self) -> PreviewShadows {
        PreviewShadows {
            layout: self.shadow_layout,
            side: self.shadow_side,
            width: self.shadow_width,
            suns: 0,
        }
    }

    /// What they say of the environment's probe.
    pub fn probe(&self) -> LightProbeDesc {
        LightProbeDesc {
            map: ProbeMap::Octahedron,
            side: self.probe_side,
            finest: self.probe_finest,
        }
    }
}

/// Raster preview of a scene, a sample of every pixel per frame.
#[derive(Debug)]
pub struct PreviewMethod {
    scene: Arc<GpuScene>,
    settings: PreviewSettings,
    drawing: Drawing,
    /// The environment.
    probe: Option<LightProbe>,
    lights_drawn: u64,
    coverage: Coverage,
    /// Shadow maps whose parts have been counted.
    measured: Vec<LightMap>,
    /// Parts of what frames share: which of the maps, and what of it.
    shadow_parts: Vec<(usize, DrawPart)>,
    /// Parts of a frame that draw; further ones shade.
    draw_parts: Vec<DrawPart>,
}

impl PreviewMethod {
    /// Allocates pictures of `size` pixels, makes the pipelines for a scene, and filters its environment, which waits for the device.
    ///
    /// # Errors
    /// [`Error::Setting`](crate::Error::Setting), as [`PreviewShadows`] and [`LightProbeDesc`] have their ranges, and for more lights than shadow maps
    /// serve; [`Error::Unsupported`](crate::Error::Unsupported) for participating media; [`Error::LimitExceeded`](crate::Error::LimitExceeded) for
    /// sizes; [`Error::OutOfMemory`](crate::Error::OutOfMemory), [`Error::DeviceLost`](crate::Error::DeviceLost).
    pub fn new(gpu: &Gpu, scene: Arc<GpuScene>, size: [u32; 2], settings: PreviewSettings) -> Result<Self> {
        let lights = LightRoom::of(&scene.lights_without_area());
        let shadows = (!lights.is_without_maps()).then_some(settings.shadows());
        let environment = scene.read_environment(gpu)?;
        let probe = environment.map(|environment| LightProbe::of_environment(gpu, settings.probe(), &environment));
        let probe = probe.transpose()?;
        Ok(Self {
            drawing: Drawing::new(
                gpu,
                &scene,
                size,
                lights,
                shadows,
                probe.as_ref().map(|probe| probe.desc().map),
            )?,
            scene,
            settings,
            probe,
            lights_drawn: 0,
            coverage: Coverage::new(gpu)?,
            measured: Vec::new(),
            shadow_parts: Vec::new(),
            draw_parts: Vec::new(),
        })
    }

    /// Parts that pixels are shaded in.
    fn shading_parts(&self, gpu: &Gpu) -> u32 {
        let pixels: u64 = self.drawing.size().map(u64::from).iter().product();
        self.drawing.lights.shading_parts(gpu, pixels)
    }
}

impl FrameMethod for PreviewMethod {
    fn begin(&mut self, recorder: &mut Recorder) -> Result<()> {
        let lights = self.scene.lights_without_area();
        self.lights_drawn += lights.len() as u64;
        self.drawing.lights.record(recorder, &self.scene.surfaces(), &lights)
    }

    fn begin_parts(&mut self, _: &Gpu) -> Result<Option<u32>> {
        let (surfaces, lights) = (self.scene.surfaces(), self.scene.lights_without_area());
        let maps = self.drawing.lights.maps(&lights);
        if !maps.starts_with(&self.measured) {
            self.measured.clear();
            self.shadow_parts.clear();
        }
        // A map each time: hosts look at the time between two.
        let next = self.measured.len();
        if let Some(map) = maps.get(next) {
            let parts = self.drawing.lights.parts_of_map(&self.coverage, &surfaces, map)?;
            self.shadow_parts.extend(parts.into_iter().map(|part| (next, part)));
            self.measured.push(*map);
        }
        let is_whole = self.measured.len() == maps.len();
        Ok(is_whole.then(|| self.shadow_parts.len().max(1) as u32))
    }

    fn begin_part(&mut self, recorder: &mut Recorder, part: Part) -> Result<()> {
        let (surfaces, lights) = (self.scene.surfaces(), self.scene.lights_without_area());
        if part.number == 0 {
            self.lights_drawn += lights.len() as u64;
            self.drawing.lights.record_lights(recorder, &surfaces, &lights)?;
        }
        // As the lights are now: a map may be along other axes than when it was measured.
        let maps = self.drawing.lights.maps(&lights);
        let of_part = self.shadow_parts.get(part.number as usize);
        match of_part.and_then(|(map, part)| Some((maps.get(*map)?, part))) {
            Some((map, part)) => self.drawing.lights.record_map(recorder, &surfaces, map, part),
            None => Ok(()),
        }
    }

    fn parts(&mut self, gpu: &Gpu, camera: &Camera, size: [u32; 2]) -> Result<u32> {
        let surfaces = self.scene.surfaces();
        // Neither the lens nor the place in a pixel changes how much is seen by much.
        let view = self.drawing.view(&surfaces, &CameraFrame::new(camera, size)?)?;
        self.draw_parts = self.coverage.parts(&surfaces, &[view], size)?;
        let (drawing, shading) = (self.draw_parts.len() as u32, self.shading_parts(gpu));
        Ok(if drawing == 1 && shading == 1 {
            1
        } else {
            drawing + shading
        })
    }

    fn record(&mut self, recorder: &mut Recorder, frame: &Frame<'_>, target: &FrameTarget<'_>) -> Result<()> {
        let size = self.drawing.size();
        target.check(size)?;
        // One place of the pixels and of the lens a frame, the same for all of them.
        let mut numbers = Sampler {
            pixel: 0,
            sample_index: frame.number,
            dimension: 0,
            seed: frame.seed,
        };
        let mut numbers = || sample_2d(&mut numbers, SamplerKind::Sobol);
        let (place, lens): (DVec2, DVec2) = (numbers(), square_to_disk(numbers()));
        let camera = CameraFrame::new(frame.camera, size)?.seen_through(size, place, lens);
        let surfaces = self.scene.surfaces();
        let of_all = PreviewPart {
            triangles: 0..surfaces.triangles,
            background: true,
            probe: self.probe.as_ref(),
        };
        let target = Target {
            buffer: target.radiance,
            first: 0,
            stride: size[0],
        };
        let (part, scene, drawing) = (frame.part, &self.scene, &self.drawing);
        if part == Part::WHOLE {
            return drawing.record(recorder, scene, &surfaces, &camera, target, &[of_all]);
        }
        if let Some(part) = self.draw_parts.get(part.number as usize) {
            return drawing.record_surfaces(recorder, &surfaces, &camera, part);
        }
        let drawn = self.draw_parts.len() as u32;
        let shading = Part {
            number: part.number - drawn,
            of: part.of - drawn,
        };
        let pixels = shading.range(size[0] * size[1]);
        drawing.record_shading(recorder, scene, &camera, target, (&[of_all], pixels))
    }

    fn path_set(&self) -> PathSet {
        PathSet::UP_TO_DIRECT
    }

    fn settings(&self) -> serde_json::Value {
        self.settings.to_json()
    }

    fn counters(&self) -> BTreeMap<&'static str, u64> {
        BTreeMap::from([("lights_drawn", self.lights_drawn)])
    }

    fn pipelines(&self) -> Vec<PipelineInfo> {
        let mut all: Vec<PipelineInfo> = Vec::new();
        let probe = self.probe.iter().flat_map(LightProbe::pipelines);
        for pipeline in self.drawing.pipelines().into_iter().chain(probe) {
            // Maps of one kind share theirs.
            if !all.contains(&pipeline) {
                all.push(pipeline);
            }
        }
        all
    }

    fn skipped(&self) -> Vec<Skipped> {
        let all = [
            (self.probe.is_none(), "light probe", "the scene has no environment"),
            (
                self.drawing.lights.shadows().is_none(),
                "shadow maps of points and spots",
                "no light has a place",
            ),
            (
                self.drawing.lights.suns().is_none(),
                "shadow maps of directional lights",
                "the scene has none",
            ),
        ];
        let missing = all.into_iter().filter(|(is_missing, ..)| *is_missing);
        missing.map(|(_, what, why)| Skipped { what, why }).collect()
    }
}
