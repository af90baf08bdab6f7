//! Pictures with indirect light by a localised gather.

use std::collections::BTreeMap;
use std::ops::Range;
use std::sync::Arc;

use glam::Vec3;

use super::card::refusals;
use super::settings::{GatherForm, LocalizedGatherSettings};
use super::stage::{Gather, LocalizedStage};
use crate::film::picture::{NonFiniteSamples, Picture};
use crate::film::{PixelFormat, Step};
use crate::gpu::{Buffer, Gpu, PipelineInfo};
use crate::maps::gather::GatherLights;
use crate::scene::Camera;
use crate::settings::TypedSettings;
use crate::techniques::impostors::capture::{Capture, CapturePlan, Captured, middle_of};
use crate::techniques::impostors::check_place_about;
use crate::techniques::impostors::renderer::{MapRenderer, MapUse, eye_settings};
use crate::techniques::{PathTracer, Skipped};
use crate::transport::{GpuScene, PathSet};
use crate::walk::ArrivalStage;
use crate::{Error, Result};

/// The technique's name in errors.
const TECHNIQUE: &str = "localized-gather";

/// A progressive rendering of one view whose rough surfaces gather indirect light from a coarse map.
pub struct LocalizedGather {
    settings: LocalizedGatherSettings,
    path_set: PathSet,
    place: Vec3,
    renderer: MapRenderer<Gathering>,
}

/// The gather, once there is a map.
struct Gathering {
    settings: LocalizedGatherSettings,
    place: Vec3,
    triangles: Range<u32>,
    gather: Option<Gather>,
    gathers: u64,
    map_bytes: u64,
}

impl MapUse for Gathering {
    fn take(&mut self, gpu: &Gpu, scene: &GpuScene, captured: Captured, _slots: u32) -> Result<()> {
        let Some(impostor) = &captured.impostor else {
            return Ok(());
        };
        let settings = &self.settings;
        self.map_bytes = captured.bytes();
        let lights = GatherLights::new(&captured.read(gpu)?, impostor, settings.lights, settings.form.form())?;
        self.gather = Some(Gather::new(
            gpu,
            scene,
            &lights,
            settings,
            self.place,
            self.triangles.clone(),
        )?);
        Ok(())
    }

    fn stage<'a>(&'a self, scene: &'a GpuScene, _is_first: bool) -> Option<Box<dyn ArrivalStage + 'a>> {
        let gather = self.gather.as_ref()?;
        Some(Box::new(LocalizedStage { gather, scene }))
    }

    fn count(&mut self, _is_first: bool) -> Result<()> {
        if let Some(gather) = &self.gather {
            self.gathers += gather.gathers()?;
        }
        Ok(())
    }

    fn counters(&self) -> BTreeMap<&'static str, u64> {
        let lights = self.gather.as_ref().map_or(0, Gather::lights);
        BTreeMap::from([
            ("gathers", self.gathers),
            ("lights", lights.into()),
            ("map_bytes", self.map_bytes),
        ])
    }

    fn pipelines(&self) -> Vec<PipelineInfo> {
        self.gather.iter().map(Gather::pipeline).collect()
    }
}

impl LocalizedGather {
    /// Prepares a rendering of `size` pixels.
    ///
    /// # Errors
    /// [`Error::Setting`] for a setting or size out of range, for a place far outside of the scene, and for an object that is none; [`Error::Unsupported`] for a scene with participating media, with surfaces that transmit or have other microfacets
    /// than GGX's, or that keeps its instances, and for light that a rasterized map lacks where one is asked for; [`Error::MissingFeature`] where clip distances are missing; [`Error::OutOfMemory`].
    pub fn new(
        gpu: &Gpu,
        scene: Arc<GpuScene>,
        camera: &Camera,
        size: [u32; 2],
        settings: LocalizedGatherSettings,
    ) -> Result<Self> {
        settings.check()?;
        let reasons = refusals(scene.profile());
        if !reasons.is_empty() {
            return Err(Error::Unsupported {
                technique: TECHNIQUE.into(),
                reasons,
            });
        }
        let surfaces = scene.surfaces();
        check_place_about(settings.place, surfaces.bounds)?;
        let left_out: Vec<Range<u32>> = match settings.object {
            None => Vec::new(),
            Some(number) => {
                let range = surfaces.triangles_of(number);
                if range.is_empty() {
                    return Err(Error::setting("object", number, "is the number of no visible object"));
                }
                vec![range]
            }
        };
        let place = match settings.place {
            Some(place) => Vec3::from_array(place),
            None => match middle_of(gpu, &scene, &left_out)? {
                Some(middle) => middle,
                None => middle_of_bounds(surfaces.bounds),
            },
        };
        let triangles = left_out.first().cloned().unwrap_or(0..surfaces.triangles);
        let by = settings
            .capture
            .resolved(TECHNIQUE, (gpu, &scene), [settings.bounces, 1], settings.shadow_side)?;
        let plan = CapturePlan {
            place,
            side: settings.side,
            by,
            // What emits is found by eye paths alone.
            bounces: [1, settings.bounces],
            with_distances: true,
            with_normals: settings.form == GatherForm::DiscWithNormals,
            layers: 1,
            left_out,
            shadow_side: settings.shadow_side,
            samples: settings.capture_samples,
            sampler: settings.sampler,
        };
        let has_light = surfaces.triangles > 0 && scene.has_lights();
        let capture = has_light.then(|| Capture::new(gpu, &scene, plan)).transpose()?;
        let path_set = settings.path_set()?;
        let eye_settings = eye_settings(PathSet::UP_TO_DIRECT, settings.sampler, settings.seed, settings.aovs);
        let tracer = PathTracer::new(gpu, Arc::clone(&scene), camera, size, eye_settings)?;
        let gathering = Gathering {
            settings: settings.clone(),
            place,
            triangles,
            gather: None,
            gathers: 0,
            map_bytes: 0,
        };
        Ok(Self {
            settings,
            path_set,
            place,
            renderer: MapRenderer::new(gpu, scene, tracer, capture, gathering),
        })
    }

    /// The settings.
    pub fn settings(&self) -> &LocalizedGatherSettings {
        &self.settings
    }

    /// Where the map is seen from, metres.
    pub fn place(&self) -> Vec3 {
        self.place
    }

    /// The light paths of the picture.
    pub fn path_set(&self) -> PathSet {
        self.path_set
    }

    /// Does a bounded piece of work towards `samples` samples per pixel: a piece of the map, or a submission of eye paths; `None` when all samples are there.
    ///
    /// # Errors
    /// [`Error::DeviceLost`], [`Error::OutOfMemory`], [`Error::Overflow`] should the index have rays that never end.
    pub fn step(&mut self, samples: u32) -> Result<Option<Step>> {
        self.renderer.step(samples)
    }

    /// The picture so far, as [`PathTracer::picture`] has it.
    ///
    /// # Errors
    /// [`Error::DeviceLost`], [`Error::OutOfMemory`].
    pub fn picture(&mut self) -> Result<(Picture, NonFiniteSamples)> {
        self.renderer.picture()
    }

    /// As [`PathTracer::display`].
    ///
    /// # Errors
    /// As there.
    pub fn display(&mut self, target: &Buffer, exposure: f32, format: PixelFormat) -> Result<()> {
        self.renderer.display(target, exposure, format)
    }

    /// Looks through another camera and begins anew, with the map there is.
    ///
    /// # Errors
    /// [`Error::Setting`] for a camera that cannot be used, [`Error::DeviceLost`].
    pub fn set_camera(&mut self, camera: &Camera) -> Result<()> {
        self.renderer.set_camera(camera)
    }

    /// Exact counts of all work by name.
    pub fn counters(&self) -> BTreeMap<&'static str, u64> {
        self.renderer.counters()
    }

    /// The kernels with their specialization.
    pub fn pipelines(&self) -> Vec<PipelineInfo> {
        self.renderer.pipelines()
    }

    /// What was left out, and why.
    pub fn skipped(&self) -> Vec<Skipped> {
        let mut all = self.renderer.skipped(Skipped {
            what: "map and gather",
            why: "nothing is lit",
        });
        if self.settings.form != GatherForm::DiscWithNormals {
            all.push(Skipped {
                what: "normals",
                why: "this form of the solid angle needs none",
            });
        }
        all
    }
}

/// The middle of a scene's bounds; the origin for those of an empty one.
fn middle_of_bounds([lower, upper]: [Vec3; 2]) -> Vec3 {
    let middle = lower + 0.5 * (upper - lower);
    if middle.is_finite() { middle } else { Vec3::ZERO }
}
