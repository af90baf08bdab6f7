//! Pictures with reflections by a distance impostor.

use std::collections::BTreeMap;
use std::ops::Range;
use std::sync::Arc;

use glam::Vec3;

use super::capture::{Capture, CaptureBy, CapturePlan, Captured, middle_of};
use super::card::refusals_with;
use super::interfaces::Interfaces;
use super::renderer::{MapRenderer, MapUse, eye_settings};
use super::settings::{ReflectionMethod, ReflectionSettings, check_place_about};
use super::stage::{LookUp, LookUpCounts, ReflectionStage, Reflections};
use crate::film::picture::{NonFiniteSamples, Picture};
use crate::film::{PixelFormat, Step};
use crate::gpu::{Buffer, Gpu, PipelineInfo};
use crate::maps::impostor::{Impostor, ImpostorTexels};
use crate::raster::ObjectTriangles;
use crate::scene::Camera;
use crate::settings::TypedSettings;
use crate::techniques::{PathTracer, Skipped};
use crate::transport::{GpuScene, PathSet};
use crate::walk::ArrivalStage;
use crate::{Error, Result};

/// The technique's name in errors.
pub(super) const TECHNIQUE: &str = "impostor";

/// A progressive rendering of one view whose smooth surfaces reflect by a map with distances.
pub struct ImpostorReflections {
    settings: ReflectionSettings,
    path_set: PathSet,
    place: Vec3,
    /// How the map is captured, where there is one.
    captured_by: Option<CaptureBy>,
    renderer: MapRenderer<LookUps>,
}

/// The look-ups, once there is a map.
struct LookUps {
    settings: ReflectionSettings,
    eye: PathSet,
    place: Vec3,
    triangles: Range<u32>,
    /// Triangles of what refracts.
    refracting: Vec<Range<u32>>,
    reflections: Option<Reflections>,
    /// Once there is a map, where something refracts.
    interfaces: Option<Interfaces>,
    counts: LookUpCounts,
}

impl MapUse for LookUps {
    fn take(&mut self, gpu: &Gpu, scene: &GpuScene, captured: Captured, slots: u32) -> Result<()> {
        let (map, eye) = ((captured, self.place), (&self.eye, slots));
        let (triangles, refracts) = (self.triangles.clone(), !self.refracting.is_empty());
        let reflections = Reflections::new(gpu, scene, &self.settings, map, eye, triangles, refracts)?;
        self.reflections = Some(reflections);
        if refracts {
            self.interfaces = Some(Interfaces::new(gpu, scene, self.refracting.clone())?);
        }
        Ok(())
    }

    fn stage<'a>(&'a self, scene: &'a GpuScene, is_first: bool) -> Option<Box<dyn ArrivalStage + 'a>> {
        Some(Box::new(ReflectionStage {
            reflections: self.reflections.as_ref()?,
            scene,
            keeps: is_first || self.settings.keeps_look_ups,
        }))
    }

    fn count(&mut self, is_first: bool) -> Result<()> {
        let Some(reflections) = &self.reflections else {
            return Ok(());
        };
        if let Some(interfaces) = self.interfaces.as_ref().filter(|_| is_first) {
            interfaces.check(&reflections.refracted_rays()?)?;
        }
        let counts = reflections.counts()?;
        self.counts.reflections += counts.reflections;
        self.counts.refractions += counts.refractions;
        self.counts.sky += counts.sky;
        self.counts.unfound += counts.unfound;
        Ok(())
    }

    fn counters(&self) -> BTreeMap<&'static str, u64> {
        let map_bytes = self.reflections.as_ref().map_or(0, Reflections::bytes);
        BTreeMap::from([
            ("reflections", self.counts.reflections),
            ("refractions", self.counts.refractions),
            ("reflections_of_sky", self.counts.sky),
            ("reflections_unfound", self.counts.unfound),
            ("map_bytes", map_bytes),
        ])
    }

    fn pipelines(&self) -> Vec<PipelineInfo> {
        let mut all: Vec<PipelineInfo> = self.reflections.iter().map(Reflections::pipeline).collect();
        all.extend(self.interfaces.iter().map(Interfaces::pipeline));
        all
    }
}

/// The objects that reflect, or refract where that is followed, by the settings.
fn reflectors<'a>(objects: &'a [ObjectTriangles], settings: &ReflectionSettings) -> Result<Vec<&'a ObjectTriangles>> {
    let is_followed = |object: &ObjectTriangles| object.mirrors || (settings.refracts && object.transmits);
    let Some(number) = settings.reflector else {
        return Ok(objects.iter().filter(|object| is_followed(object)).collect());
    };
    let object = objects.iter().find(|object| object.object == number);
    let object = object.ok_or_else(|| Error::setting("reflector", number, "is the number of no visible object"))?;
    if !is_followed(object) {
        return Err(Error::setting(
            "reflector",
            number,
            "is an object without smooth surface",
        ));
    }
    Ok(vec![object])
}

impl ImpostorReflections {
    /// Prepares a rendering of `size` pixels.
    ///
    /// # Errors
    /// [`Error::Setting`] for a setting or size out of range, for a place far outside of the scene, for a reflector that is none, and for a method without distances where bodies absorb; [`Error::Unsupported`] for a scene with participating media, with
    /// surfaces that transmit, unless rays are to be [refracted](ReflectionSettings::refracts), or that keeps its instances, and for light that a rasterized map lacks where one is asked for; [`Error::LimitExceeded`] for a map of more texels than the device's buffers have; [`Error::MissingFeature`] where clip distances are missing and there is something that reflects;
    /// [`Error::OutOfMemory`].
    pub fn new(
        gpu: &Gpu,
        scene: Arc<GpuScene>,
        camera: &Camera,
        size: [u32; 2],
        settings: ReflectionSettings,
    ) -> Result<Self> {
        settings.check()?;
        let reasons = refusals_with(scene.profile(), settings.refracts);
        if !reasons.is_empty() {
            return Err(Error::Unsupported {
                technique: TECHNIQUE.into(),
                reasons,
            });
        }
        if scene.profile().has_absorption && settings.method == ReflectionMethod::Classical {
            let cause = "has no distances, along which bodies of the scene absorb light";
            return Err(Error::setting("method", "classical", cause));
        }
        let surfaces = scene.surfaces();
        check_place_about(settings.place, surfaces.bounds)?;
        let reflectors = reflectors(surfaces.objects, &settings)?;
        let triangles_of = |objects: &[&ObjectTriangles]| -> Vec<Range<u32>> {
            let ranges = objects.iter().map(|object| object.triangles.clone());
            ranges.filter(|range| !range.is_empty()).collect()
        };
        let left_out = triangles_of(&reflectors);
        let refracting: Vec<_> = reflectors
            .into_iter()
            .filter(|object| settings.refracts && object.transmits)
            .collect();
        let place = match settings.place {
            Some(place) => Vec3::from_array(place),
            None => middle_of(gpu, &scene, &left_out)?.unwrap_or(Vec3::ZERO),
        };
        let triangles = match settings.reflector {
            Some(_) => left_out.first().cloned().unwrap_or(0..0),
            None => 0..surfaces.triangles,
        };
        let by = settings.capture.resolved(
            TECHNIQUE,
            (gpu, &scene),
            [settings.bounces, settings.layers],
            settings.shadow_side,
        )?;
        let plan = CapturePlan {
            place,
            side: settings.side,
            by,
            bounces: [0, settings.bounces],
            with_distances: settings.search().is_some(),
            // A texel's distance is that to the plane through its point, unless it is to be the same for all of it.
            with_normals: settings.search().is_some() && settings.texels != ImpostorTexels::Distances,
            layers: settings.layers,
            left_out,
            shadow_side: settings.shadow_side,
            samples: settings.capture_samples,
            sampler: settings.sampler,
        };
        let has_reflector = !plan.left_out.is_empty();
        if has_reflector && plan.with_distances {
            // Not after a map that takes long.
            gpu.caps().check_texels(Impostor::TEXELS_NAME, plan.texels())?;
        }
        let capture = has_reflector.then(|| Capture::new(gpu, &scene, plan)).transpose()?;
        let (path_set, eye) = (settings.path_set()?, settings.eye_paths()?);
        let eye_settings = eye_settings(eye, settings.sampler, settings.seed, settings.aovs);
        let tracer = PathTracer::new(gpu, Arc::clone(&scene), camera, size, eye_settings)?;
        let look_ups = LookUps {
            settings: settings.clone(),
            eye,
            place,
            triangles,
            refracting: triangles_of(&refracting),
            reflections: None,
            interfaces: None,
            counts: LookUpCounts::default(),
        };
        Ok(Self {
            settings,
            path_set,
            place,
            captured_by: has_reflector.then_some(by),
            renderer: MapRenderer::new(gpu, scene, tracer, capture, look_ups),
        })
    }

    /// The settings.
    pub fn settings(&self) -> &ReflectionSettings {
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
    /// [`Error::Unsupported`] where refracted rays of a pixel's first sample meet a second interface, from then on until there is [another camera](Self::set_camera); [`Error::DeviceLost`], [`Error::OutOfMemory`], [`Error::Overflow`] should the index have rays that never end.
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

    /// Exact counts of look-ups in waves that have ended.
    pub fn counts(&self) -> LookUpCounts {
        self.renderer.map_use.counts
    }

    /// Exact counts of all work by name.
    pub fn counters(&self) -> BTreeMap<&'static str, u64> {
        self.renderer.counters()
    }

    /// What the last wave has looked up, by slot: needs [`ReflectionSettings::keeps_look_ups`]. Empty without a reflector.
    ///
    /// # Errors
    /// [`Error::Setting`] without that setting; [`Error::DeviceLost`], [`Error::OutOfMemory`].
    pub fn looked_up(&self) -> Result<Vec<LookUp>> {
        if !self.settings.keeps_look_ups {
            let cause = "is needed before, and is off";
            return Err(Error::setting("keeps_look_ups", false, cause));
        }
        let reflections = self.renderer.map_use.reflections.as_ref();
        reflections.map_or(Ok(Vec::new()), Reflections::looked_up)
    }

    /// The kernels with their specialization.
    pub fn pipelines(&self) -> Vec<PipelineInfo> {
        self.renderer.pipelines()
    }

    /// What was left out, and why.
    pub fn skipped(&self) -> Vec<Skipped> {
        let mut all = self.renderer.skipped(Skipped {
            what: "distances, map and look-ups",
            why: "nothing reflects",
        });
        if self.settings.search().is_none() {
            all.push(Skipped {
                what: "distances",
                why: "the method looks none up",
            });
        } else if self.settings.texels == ImpostorTexels::Distances {
            all.push(Skipped {
                what: "normals",
                why: "texels hold distances alone",
            });
        }
        if self.captured_by == Some(CaptureBy::Rays) {
            all.push(Skipped {
                what: "shadow maps",
                why: "the map is captured by rays",
            });
        }
        all
    }
}
