//! A rendering of one view by eye paths along ray-bundles.

use std::ops::Range;
use std::sync::Arc;

use glam::{DVec2, Vec3};

use super::card::refusals;
use super::lists::{BundleLists, Counted, Lists, after_all};
use super::settings::RayBundleSettings;
use crate::film::picture::{NonFiniteSamples, Picture};
use crate::film::{GpuFilm, PixelFormat, Step};
use crate::gpu::shaders::constants::{BUNDLE_GOES_ON, BUNDLE_SHOWS_DIRECT, BUNDLE_SHOWS_EMITTED};
use crate::gpu::shaders::techniques::ray_bundles::{bundle_eye, bundle_shade};
use crate::gpu::shaders::types::{BundleVertex, CameraRays};
use crate::gpu::{
    Buffer, BufferDesc, Category, ComputePipeline, Gpu, PipelineInfo, Recorder, SOFTWARE_LOOP_CAP, Timings,
};
use crate::raster::{DrawPart, View};
use crate::scene::camera_frame::CameraFrame;
use crate::scene::{Camera, SceneProfile};
use crate::settings::TypedSettings;
use crate::techniques::foresight::frame_fits;
use crate::techniques::{FrameTarget, Part};
use crate::transport::random::{Sampler, sample_2d};
use crate::transport::warp::square_to_sphere;
use crate::transport::{GpuScene, PathSet, surface_spec};
use crate::{Error, Result};

/// Stands for a pixel in the random numbers of directions, which all pixels share.
const OF_ALL_PIXELS: u32 = u32::MAX;

/// Rays of a pixel where light is.
const RAYS: u64 = 2;

/// Exact counts.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, serde::Serialize)]
#[non_exhaustive]
pub struct RayBundleCounts {
    /// Frames, each a sample of every pixel.
    pub frames: u64,
    /// Bundles, of which a frame has one for each scattering beyond the first.
    pub bundles: u64,
    /// Entries of all their lists.
    pub entries: u64,
    /// Of the longest list.
    pub longest: u64,
    /// How often the room for lists was too small, and was made larger before anything was written.
    pub enlarged: u64,
    /// Passes that were recorded.
    pub passes: u64,
}

/// A rendering of one view by eye paths along ray-bundles.
pub struct RayBundles {
    gpu: Gpu,
    scene: Arc<GpuScene>,
    settings: RayBundleSettings,
    camera: Camera,
    film: GpuFilm,
    radiance: Buffer,
    vertices: Buffer,
    eye: ComputePipeline<bundle_eye::Kernel>,
    /// None where no surface sends anything.
    shade: Option<ComputePipeline<bundle_shade::Kernel>>,
    /// None where paths end at their first surface.
    lists: Option<Lists>,
    /// Pixels of a submission of rays.
    pixels_at_once: u32,
    frame: Option<Frame>,
    /// Frames on the film.
    done: u32,
    counts: RayBundleCounts,
}

/// A frame under way.
struct Frame {
    camera: CameraRays,
    bundle: Option<Bundle>,
    stage: Stage,
}

/// The bundle under way.
struct Bundle {
    view: View,
    parts: Vec<DrawPart>,
    counted: Counted,
}

/// What comes next. Bounces count the scatterings of the light that is found where paths are.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Stage {
    /// Rays of the eye, from that pixel on.
    Eye(u32),
    /// Light where paths are, from that pixel on.
    Shade {
        bounce: u32,
        pixel: u32,
    },
    /// The first drawing of a bundle, from that part on.
    Count {
        bounce: u32,
        part: usize,
    },
    /// What it has counted is read.
    Counted {
        bounce: u32,
    },
    /// The second drawing, from that part on.
    Write {
        bounce: u32,
        part: usize,
    },
    /// The sort of lists, from that fragment on.
    Sort {
        bounce: u32,
        fragment: u32,
    },
    /// The way along the bundle's lines.
    Hop {
        bounce: u32,
    },
    /// Onto the film.
    Film,
    Ended,
}

/// Pieces of a submission of work of so many pieces in so many parts.
fn at_once(pieces: u32, parts: u32) -> u32 {
    pieces.div_ceil(parts.max(1)).max(1)
}

fn no_bundle() -> Error {
    Error::Internal {
        what: "ray-bundles".into(),
        fault: "go on along a bundle that there is not".into(),
    }
}

impl RayBundles {
    /// Prepares a rendering of `size` pixels.
    ///
    /// # Errors
    /// [`Error::Setting`] for a setting, camera or size out of range, [`Error::Unsupported`] for a scene that it cannot model, with every reason, [`Error::LimitExceeded`] for a
    /// picture or square larger than a buffer of the device or a ray index whose leaves are too long for a software device, [`Error::MissingFeature`] for a device whose fragment
    /// shaders write no buffers, [`Error::OutOfMemory`].
    pub fn new(
        gpu: &Gpu,
        scene: Arc<GpuScene>,
        camera: &Camera,
        size: [u32; 2],
        settings: RayBundleSettings,
    ) -> Result<Self> {
        settings.check()?;
        let reasons = refusals(scene.profile());
        if !reasons.is_empty() {
            return Err(Error::Unsupported {
                technique: "ray-bundles".into(),
                reasons,
            });
        }
        let film = GpuFilm::new(gpu, size, false)?;
        CameraFrame::new(camera, size)?;
        frame_fits(gpu.caps(), size)?;
        // Two thirds for the two rays where light is, the rest for the choice of a light.
        let index = scene.index_within(gpu, SOFTWARE_LOOP_CAP / 3)?;
        let (profile, traversal) = (scene.profile(), scene.index_traversal());
        let eye = bundle_eye::Spec {
            has_environment: profile.has_environment(),
            sampler_kind: settings.sampler as u32,
            shows_emitted: settings.shows(0),
            index_quota: index.quota,
            index_kind: index.kind,
            ..Default::default()
        };
        let has_surfaces = scene.surfaces().triangles > 0;
        let is_lit = settings.bounces() > 0 && scene.has_lights();
        let shows = has_surfaces && (is_lit || (settings.shows(0) && scene.has_area_lights()));
        let shade = shows.then(|| {
            let spec = surface_spec!(bundle_shade, scene, {
                has_multiple_scattering: false,
                separable_masking: false,
                has_environment: profile.has_environment(),
                has_area_lights: scene.has_area_lights(),
                has_punctual_lights: scene.has_punctual_lights(),
                has_light_tree: false,
                has_alpha: false,
                sampler_kind: settings.sampler as u32,
                index_quota: index.quota,
                index_kind: index.kind,
                ..Default::default()
            });
            traversal.pipeline(gpu, &spec)
        });
        let hops = has_surfaces && is_lit && settings.bounces() > 1;
        let lists = hops.then(|| Lists::new(gpu, settings.texels(size))).transpose()?;
        let pixels = size[0] * size[1];
        let parts = Part::count(gpu, RAYS * index.steps * u64::from(pixels)).max(settings.parts);
        let vertices = size_of::<BundleVertex>() as u64 * u64::from(pixels);
        Ok(Self {
            gpu: gpu.clone(),
            eye: traversal.pipeline(gpu, &eye)?,
            shade: shade.transpose()?,
            lists,
            radiance: gpu.buffer(&BufferDesc::storage("frame", FrameTarget::bytes(size), Category::Film))?,
            vertices: gpu.buffer(&BufferDesc::storage("bundle vertices", vertices, Category::Work))?,
            pixels_at_once: at_once(pixels, parts),
            settings,
            camera: camera.clone(),
            film,
            frame: None,
            done: 0,
            counts: RayBundleCounts::default(),
            scene,
        })
    }

    /// The settings.
    pub fn settings(&self) -> &RayBundleSettings {
        &self.settings
    }

    /// The light paths of the picture.
    pub fn path_set(&self) -> PathSet {
        self.settings.path_set
    }

    /// Exact counts since it was made.
    pub fn counts(&self) -> RayBundleCounts {
        self.counts
    }

    /// What the scene needs.
    pub fn profile(&self) -> &SceneProfile {
        self.scene.profile()
    }

    /// Whether surfaces send light that is shown.
    pub fn has_surface_light(&self) -> bool {
        self.shade.is_some()
    }

    /// Whether there are bundles.
    pub fn has_bundles(&self) -> bool {
        self.lists.is_some()
    }

    /// Bytes of lists, of what makes them, and of paths.
    pub fn bytes(&self) -> u64 {
        self.vertices.bytes() + self.lists.as_ref().map_or(0, Lists::bytes)
    }

    /// The lists of the last bundle of the last frame; `None` before the first one is whole, and while another is under way.
    ///
    /// # Errors
    /// [`Error::DeviceLost`], [`Error::OutOfMemory`].
    pub fn lists(&self) -> Result<Option<BundleLists>> {
        self.lists.as_ref().map_or(Ok(None), Lists::read)
    }

    /// The kernels with their specialization.
    pub fn pipelines(&self) -> Vec<PipelineInfo> {
        let mut all = vec![self.eye.info()];
        all.extend(self.shade.iter().map(ComputePipeline::info));
        all.extend(self.lists.iter().flat_map(Lists::pipelines));
        all.extend(self.film.pipelines());
        all
    }

    /// Looks through another camera and begins anew.
    ///
    /// # Errors
    /// [`Error::Setting`] for a camera that cannot be used, [`Error::DeviceLost`].
    pub fn set_camera(&mut self, camera: &Camera) -> Result<()> {
        CameraFrame::new(camera, self.film.size())?;
        self.film.clear()?;
        self.camera = camera.clone();
        (self.done, self.frame) = (0, None);
        Ok(())
    }

    /// Forgets everything gathered so far and begins anew with this seed, with the kernels there are.
    ///
    /// # Errors
    /// [`Error::DeviceLost`], [`Error::OutOfMemory`].
    pub fn restart(&mut self, seed: u32) -> Result<()> {
        self.film.clear()?;
        self.settings.seed = seed;
        (self.done, self.frame) = (0, None);
        Ok(())
    }

    /// Does a bounded piece of work towards `samples` samples of each pixel, whatever the scene; `None` when all samples are there.
    ///
    /// # Errors
    /// [`Error::DeviceLost`], [`Error::OutOfMemory`], [`Error::Overflow`] for lists that the device has no room for. The frame under way is then begun anew.
    pub fn step(&mut self, samples: u32) -> Result<Option<Step>> {
        if self.done >= samples {
            return Ok(None);
        }
        let mut frame = match self.frame.take() {
            Some(frame) => frame,
            None => {
                self.keep(None);
                self.begin_frame()?
            }
        };
        let timings = self.advance(&mut frame)?;
        if frame.stage == Stage::Ended {
            self.done += 1;
            self.counts.frames += 1;
            self.keep(frame.bundle);
        } else {
            self.frame = Some(frame);
        }
        let pixels = u64::from(self.pixels());
        Ok(Some(Step {
            timings: vec![timings],
            done: pixels * u64::from(self.done),
            wanted: pixels * u64::from(samples),
        }))
    }

    /// Notes whose lists there are.
    fn keep(&mut self, bundle: Option<Bundle>) {
        if let Some(lists) = &mut self.lists {
            lists.keep(bundle.map(|bundle| (bundle.view, bundle.counted.entries)));
        }
    }

    /// The picture so far.
    ///
    /// # Errors
    /// [`Error::DeviceLost`], [`Error::OutOfMemory`].
    pub fn picture(&mut self) -> Result<(Picture, NonFiniteSamples)> {
        self.film.picture()
    }

    /// Writes the picture so far to a buffer of four bytes per pixel: `exposure` in stops, clipped, sRGB-encoded.
    ///
    /// # Errors
    /// [`Error::Setting`] when the buffer is too small, [`Error::DeviceLost`].
    pub fn display(&mut self, target: &Buffer, exposure: f32, format: PixelFormat) -> Result<()> {
        self.film.display(target, exposure, format)
    }

    fn pixels(&self) -> u32 {
        self.film.size().iter().product()
    }

    fn begin_frame(&self) -> Result<Frame> {
        let size = self.film.size();
        Ok(Frame {
            camera: CameraFrame::new(&self.camera, size)?.rays(size),
            bundle: None,
            stage: Stage::Eye(0),
        })
    }

    /// The direction of a frame's bundle behind so many scatterings, and by what part of a texel its square is moved.
    fn line(&self, bounce: u32) -> (Vec3, DVec2) {
        let mut numbers = Sampler {
            pixel: OF_ALL_PIXELS,
            sample_index: self.done,
            dimension: 2 * bounce,
            seed: self.settings.seed,
        };
        let mut numbers = || sample_2d(&mut numbers, self.settings.sampler);
        let direction = square_to_sphere(numbers()).as_vec3();
        (direction, numbers() - 0.5)
    }

    /// One submission: stage after stage, as long as each is recorded whole and none needs what the host has to read.
    fn advance(&mut self, frame: &mut Frame) -> Result<Timings> {
        let mut wrote = false;
        let mut recorder = self.gpu.recorder("ray-bundles")?;
        let left = recorder.passes_left();
        loop {
            match frame.stage {
                Stage::Counted { bounce } => frame.stage = self.read_counts(frame, bounce)?,
                Stage::Count { bounce, part: 0 } => frame.bundle = self.bundle(bounce)?,
                _ => {}
            }
            let (next, goes_on) = self.record_stage(&mut recorder, frame)?;
            wrote |= matches!(frame.stage, Stage::Write { .. }) && !matches!(next, Stage::Write { .. });
            frame.stage = next;
            if !goes_on || matches!(next, Stage::Counted { .. } | Stage::Ended) {
                break;
            }
        }
        let passes = (left - recorder.passes_left()) as u64;
        let timings = recorder.submit()?.wait()?;
        self.counts.passes += passes;
        if let (true, Some(lists)) = (wrote, &self.lists) {
            lists.check_written()?;
        }
        Ok(timings)
    }

    /// Makes room for what the first drawing has counted.
    fn read_counts(&mut self, frame: &mut Frame, bounce: u32) -> Result<Stage> {
        let (Some(lists), Some(bundle)) = (&mut self.lists, &mut frame.bundle) else {
            return Err(no_bundle());
        };
        bundle.counted = lists.counted()?;
        let Counted { entries, longest } = bundle.counted;
        self.counts.enlarged += u64::from(lists.make_room(entries)?);
        self.counts.bundles += 1;
        self.counts.entries += u64::from(entries);
        self.counts.longest = self.counts.longest.max(longest.into());
        Ok(Stage::Write { bounce, part: 0 })
    }

    /// Records a stage, or a part of it: what comes next, and whether there is room for that in the same submission.
    fn record_stage(&self, recorder: &mut Recorder, frame: &Frame) -> Result<(Stage, bool)> {
        let pixels = self.pixels();
        match frame.stage {
            Stage::Eye(first) => {
                let end = first.saturating_add(self.pixels_at_once).min(pixels);
                self.record_eye(recorder, &frame.camera, first..end)?;
                let shades = Stage::Shade { bounce: 1, pixel: 0 };
                let next = match (end < pixels, &self.shade) {
                    (true, _) => Stage::Eye(end),
                    (false, Some(_)) => shades,
                    (false, None) => Stage::Film,
                };
                Ok((next, self.pixels_at_once >= pixels))
            }
            Stage::Shade { bounce, pixel } => {
                let end = pixel.saturating_add(self.pixels_at_once).min(pixels);
                let hops = self.lists.is_some() && bounce < self.settings.bounces();
                self.record_shade(recorder, bounce, hops, pixel..end)?;
                let next = match (end < pixels, hops) {
                    (true, _) => Stage::Shade { bounce, pixel: end },
                    (false, true) => Stage::Count { bounce, part: 0 },
                    (false, false) => Stage::Film,
                };
                Ok((next, self.pixels_at_once >= pixels))
            }
            Stage::Count { bounce, part } => {
                let (lists, bundle) = self.bundle_of(frame)?;
                let drawn = &bundle.parts[part];
                lists.record_count(recorder, &self.scene.surfaces(), &bundle.view, drawn)?;
                Ok(if drawn.ends {
                    (Stage::Counted { bounce }, false)
                } else {
                    (Stage::Count { bounce, part: part + 1 }, false)
                })
            }
            Stage::Write { bounce, part } => {
                let (lists, bundle) = self.bundle_of(frame)?;
                let drawn = &bundle.parts[part];
                lists.record_write(recorder, &self.scene.surfaces(), drawn)?;
                let next = match (drawn.ends, bundle.counted.entries) {
                    (false, _) => Stage::Write { bounce, part: part + 1 },
                    (true, 0) => Stage::Hop { bounce },
                    (true, _) => Stage::Sort { bounce, fragment: 0 },
                };
                Ok((next, bundle.parts.len() == 1))
            }
            Stage::Sort { bounce, fragment } => {
                let (lists, bundle) = self.bundle_of(frame)?;
                let Counted { entries, longest } = bundle.counted;
                let work = u64::from(entries) * u64::from(longest);
                let most = at_once(entries, Part::count(&self.gpu, work).max(self.settings.parts));
                let end = fragment.saturating_add(most).min(entries);
                lists.record_sort(recorder, fragment..end)?;
                let next = if end < entries {
                    Stage::Sort { bounce, fragment: end }
                } else {
                    Stage::Hop { bounce }
                };
                Ok((next, most >= entries))
            }
            Stage::Hop { bounce } => {
                let (lists, bundle) = self.bundle_of(frame)?;
                let along = (&bundle.view, self.settings.skipped);
                lists.record_hop(recorder, &self.scene, along, self.vertices.view(), pixels)?;
                let next = Stage::Shade {
                    bounce: bounce + 1,
                    pixel: 0,
                };
                Ok((next, true))
            }
            Stage::Film => {
                self.film.record_frame(recorder, &self.radiance)?;
                Ok((Stage::Ended, false))
            }
            // Nothing is recorded of these.
            Stage::Counted { .. } | Stage::Ended => Ok((frame.stage, false)),
        }
    }

    /// The lists, and the bundle under way.
    fn bundle_of<'a>(&'a self, frame: &'a Frame) -> Result<(&'a Lists, &'a Bundle)> {
        self.lists.as_ref().zip(frame.bundle.as_ref()).ok_or_else(no_bundle)
    }

    /// The bundle behind so many scatterings. May wait for the device.
    fn bundle(&self, bounce: u32) -> Result<Option<Bundle>> {
        let Some(lists) = &self.lists else {
            return Ok(None);
        };
        let (direction, shift) = self.line(bounce);
        let surfaces = self.scene.surfaces();
        let view = lists.view(direction, &surfaces, shift)?;
        Ok(Some(Bundle {
            parts: lists.parts(&surfaces, &view)?,
            view,
            counted: Counted::default(),
        }))
    }

    fn record_eye(&self, recorder: &mut Recorder, camera: &CameraRays, pixels: Range<u32>) -> Result<()> {
        recorder.pass("ray-bundles: eye", |pass| {
            after_all(pass);
            let set = bundle_eye::Set0 {
                radiance: self.radiance.view(),
                bundle_vertices: self.vertices.view(),
            };
            let push = bundle_eye::Push {
                camera: *camera,
                frame: self.done,
                seed: self.settings.seed,
                first_pixel: pixels.start,
                end_pixel: pixels.end,
            };
            let groups = self.eye.groups_over(pixels.len() as u32);
            let (index, scene) = (self.scene.index_set(), self.scene.scene_set());
            pass.dispatch(&self.eye, &[&set, &index, &scene], &push, groups)
        })
    }

    fn record_shade(&self, recorder: &mut Recorder, bounce: u32, hops: bool, pixels: Range<u32>) -> Result<()> {
        let Some(shade) = &self.shade else {
            return Ok(());
        };
        let emitted = bounce == 1 && self.settings.shows(0);
        let direct = self.settings.shows(bounce) && self.scene.has_lights();
        let does = [
            (emitted, BUNDLE_SHOWS_EMITTED),
            (direct, BUNDLE_SHOWS_DIRECT),
            (hops, BUNDLE_GOES_ON),
        ];
        let (line, _) = self.line(bounce);
        let [lower, upper] = self.scene.bounds().map(|corner| corner.to_array());
        recorder.pass("ray-bundles: shade", |pass| {
            after_all(pass);
            let set = bundle_shade::Set0 {
                radiance: self.radiance.view(),
                bundle_vertices: self.vertices.view(),
            };
            let push = bundle_shade::Push {
                scene_lower: lower,
                frame: self.done,
                scene_upper: upper,
                seed: self.settings.seed,
                line: line.to_array(),
                bounce,
                first_pixel: pixels.start,
                end_pixel: pixels.end,
                does: does.iter().filter(|(is, _)| *is).map(|(_, bit)| bit).sum(),
            };
            let groups = shade.groups_over(pixels.len() as u32);
            let (index, scene) = (self.scene.index_set(), self.scene.scene_set());
            pass.dispatch(shade, &[&set, &index, &scene], &push, groups)
        })
    }
}
