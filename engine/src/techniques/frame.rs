//! Techniques that draw one picture per frame, and what turns them into progressive techniques.
//!
//! A [`FrameMethod`] records into a command buffer of the engine or of a host: it submits nothing and waits for nothing. [`Accumulated`] owns
//! what a [`Technique`] needs beside that: film, camera, and how many frames a step takes.
//!
//! # A host's own frame
//!
//! [`begin`](FrameMethod::begin) once, and again when lights, surfaces or settings have changed; then [`record`](FrameMethod::record) for each frame:
//!
//! | | the caller's | the method's |
//! |---|---|---|
//! | before | the target may be written by compute shaders: earlier uses have been waited for | barriers among its own passes |
//! | after | what compute shaders have written to the target is made visible to whoever reads it | all that it drew is there |
//!
//! Bounded: a step of [`Accumulated`] is one frame at least, which is never parted. How long one takes is the method's to bound: rays may end
//! at a quota, and [`preview`](super::preview) draws each triangle once a view, however much of the picture it covers.
//!
//! Deterministic: a frame's picture depends on scene, camera, size, settings, seed and number alone.

use std::collections::BTreeMap;

use super::foresight::frame_fits;
use super::{Skipped, Technique, View};
use crate::film::picture::{NonFiniteSamples, Picture};
use crate::film::{GpuFilm, PixelFormat, Step};
use crate::gpu::{Buffer, BufferDesc, Category, Gpu, Pace, PipelineInfo, Recorder, Timings};
use crate::scene::Camera;
use crate::scene::camera_frame::CameraFrame;
use crate::transport::PathSet;
use crate::{Error, Result};

/// Frames of a step, at most; fewer where their passes fill a recorder.
const FRAMES_MAX: u32 = 32;
/// Samples of a step on software devices, about.
const STEP_SAMPLES: u64 = 1 << 18;
/// Seconds of a step, about, unless one frame takes longer: hosts look at the time and at wishes to stop between two steps.
const STEP_SECONDS: f64 = 0.25;

/// What a picture is drawn of.
#[derive(Debug, Clone, Copy)]
pub struct Frame<'a> {
    /// Where it is seen from.
    pub camera: &'a Camera,
    /// Seed of the random numbers.
    pub seed: u32,
    /// Counts pictures of one seed from 0 on. Each is another sample of the same expected picture.
    pub number: u32,
}

/// Where a picture goes: three f32 per pixel, linear RGB radiance, row by row from the top without gaps.
#[derive(Debug, Clone, Copy)]
pub struct FrameTarget<'a> {
    /// A storage buffer of twelve bytes per pixel or more. Compute shaders write it.
    pub radiance: &'a Buffer,
    /// Pixels across and down.
    pub size: [u32; 2],
}

impl FrameTarget<'_> {
    /// Bytes that a picture of that size takes.
    pub const fn bytes(size: [u32; 2]) -> u64 {
        size_of::<[f32; 3]>() as u64 * size[0] as u64 * size[1] as u64
    }

    /// Refuses a target of another size than `size`, for which the method was made, and what [`pixels`](Self::pixels) refuses.
    ///
    /// # Errors
    /// [`Error::Setting`].
    pub fn check(&self, size: [u32; 2]) -> Result<()> {
        if self.size != size {
            let cause = format!("is not the {size:?} that the method was made for");
            return Err(Error::setting("size", format!("{:?}", self.size), cause));
        }
        self.pixels().map(|_| ())
    }

    /// How many pixels the picture has: every method asks this, or [`check`](Self::check), before it records what writes them.
    ///
    /// # Errors
    /// [`Error::Setting`] for a buffer that is too small for them, and for none or 2³² pixels and more.
    pub fn pixels(&self) -> Result<u32> {
        let pixels = u64::from(self.size[0]) * u64::from(self.size[1]);
        let Some(pixels) = u32::try_from(pixels).ok().filter(|pixels| *pixels > 0) else {
            let cause = "has no pixels, or 2^32 and more";
            return Err(Error::setting("size", format!("{:?}", self.size), cause));
        };
        let (bytes, found) = (Self::bytes(self.size), self.radiance.bytes());
        if found < bytes {
            let cause = format!("has {found} bytes; the picture needs {bytes}");
            return Err(Error::setting("target", self.radiance.name(), cause));
        }
        Ok(pixels)
    }
}

/// Draws one picture per frame. [`Accumulated`] makes a [`Technique`] of it.
///
/// What `begin` and one `record` take together must be less than the 1024 passes of a [`Recorder`], since [`Accumulated`] adds one of its own.
pub trait FrameMethod: Send {
    /// Records what frames share, such as shadow maps: before the first, and again when lights or surfaces have moved.
    ///
    /// # Errors
    /// [`Error::Setting`]; [`Error::MissingBarrier`] in debug builds.
    fn begin(&mut self, recorder: &mut Recorder) -> Result<()> {
        let _ = recorder;
        Ok(())
    }

    /// Records one picture: one sample of every pixel. Barriers before and after: see the [module](self). [`FrameTarget::pixels`] or
    /// [`FrameTarget::check`] refuses targets that it must not write.
    ///
    /// # Errors
    /// [`Error::Setting`] for a camera that cannot be used or a target of a wrong size; [`Error::MissingBarrier`] in debug builds.
    fn record(&mut self, recorder: &mut Recorder, frame: &Frame<'_>, target: &FrameTarget<'_>) -> Result<()>;

    /// The light paths of the picture.
    fn path_set(&self) -> PathSet;

    /// The settings in force.
    fn settings(&self) -> serde_json::Value {
        serde_json::json!({})
    }

    /// Exact counts of work by name, beside `frames` and `samples`, which [`Accumulated`] counts.
    fn counters(&self) -> BTreeMap<&'static str, u64> {
        BTreeMap::new()
    }

    /// The kernels and their specialization.
    fn pipelines(&self) -> Vec<PipelineInfo>;

    /// What was left out, and why.
    fn skipped(&self) -> Vec<Skipped> {
        Vec::new()
    }
}

/// A technique whose samples are the frames of a method.
pub struct Accumulated<M> {
    gpu: Gpu,
    method: M,
    camera: Camera,
    seed: u32,
    wants_aovs: bool,
    film: GpuFilm,
    radiance: Buffer,
    /// Frames on the film.
    done: u32,
    /// What frames share has been drawn.
    begun: bool,
    pace: Pace,
    /// Seconds of a frame of the last step.
    seconds_a_frame: f64,
    /// Most passes of a frame so far, the film's included.
    passes_a_frame: usize,
    /// Frames since it was made.
    frames: u64,
}

impl<M: FrameMethod> Accumulated<M> {
    /// Prepares a rendering of a view by frames of `method`, which must have been made for the view's size.
    ///
    /// # Errors
    /// [`Error::Setting`] for a camera or a size that cannot be used, [`Error::LimitExceeded`] for a picture larger than a storage buffer,
    /// [`Error::OutOfMemory`].
    pub fn new(gpu: &Gpu, view: &View<'_>, method: M) -> Result<Self> {
        let film = GpuFilm::new(gpu, view.size, false)?;
        CameraFrame::new(view.camera, view.size)?;
        frame_fits(gpu.caps(), view.size)?;
        let bytes = FrameTarget::bytes(view.size);
        Ok(Self {
            gpu: gpu.clone(),
            method,
            camera: view.camera.clone(),
            seed: view.seed,
            wants_aovs: view.aovs,
            film,
            radiance: gpu.buffer(&BufferDesc::storage("frame", bytes, Category::Film))?,
            done: 0,
            begun: false,
            pace: Pace::new(gpu.caps().kind, FRAMES_MAX),
            seconds_a_frame: 0.0,
            passes_a_frame: 0,
            frames: 0,
        })
    }

    /// The same as what [`Card::create`](super::Card::create) returns.
    ///
    /// # Errors
    /// As [`Accumulated::new`].
    pub fn boxed(gpu: &Gpu, view: &View<'_>, method: M) -> Result<Box<dyn Technique>>
    where
        M: 'static,
    {
        Ok(Box::new(Self::new(gpu, view, method)?))
    }

    /// The method.
    pub fn method(&self) -> &M {
        &self.method
    }

    /// Frames of the next step: one at first, which compiles the kernels, then as many as a watchdog, or a host that waits, has time for.
    fn frames_for_step(&self) -> u32 {
        let [width, height] = self.film.size();
        if self.frames == 0 {
            return 1;
        }
        let unwatched = STEP_SAMPLES / (u64::from(width) * u64::from(height));
        let frames = self.pace.units(1, unwatched.min(u64::from(FRAMES_MAX)) as u32);
        let in_time = STEP_SECONDS / self.seconds_a_frame.max(f64::MIN_POSITIVE);
        frames.min(in_time as u32).max(1)
    }

    /// Draws `frames` frames, or as many as one recorder has room for, and says how many these were.
    fn submit(&mut self, frames: u32) -> Result<(u32, Timings)> {
        let mut recorder = self.gpu.recorder("frames")?;
        if !self.begun {
            self.method.begin(&mut recorder)?;
        }
        let target = FrameTarget {
            radiance: &self.radiance,
            size: self.film.size(),
        };
        let mut drawn = 0;
        while drawn < frames && (drawn == 0 || recorder.passes_left() >= self.passes_a_frame) {
            let left = recorder.passes_left();
            let frame = Frame {
                camera: &self.camera,
                seed: self.seed,
                number: self.done + drawn,
            };
            self.method.record(&mut recorder, &frame, &target)?;
            // Waits for the frame, and leaves the target to the next one.
            self.film.record_frame(&mut recorder, &self.radiance)?;
            self.passes_a_frame = self.passes_a_frame.max(left - recorder.passes_left());
            drawn += 1;
        }
        Ok((drawn, recorder.submit()?.wait()?))
    }
}

impl<M: FrameMethod> Technique for Accumulated<M> {
    fn step(&mut self, samples: u32) -> Result<Option<Step>> {
        if self.done >= samples {
            return Ok(None);
        }
        let wanted = self.frames_for_step().min(samples - self.done);
        let clock = std::time::Instant::now();
        let (frames, timings) = self.submit(wanted)?;
        let seconds = timings
            .untimed
            .as_ref()
            .map_or(timings.seconds(), |_| clock.elapsed().as_secs_f64());
        // The first step also compiles.
        if self.frames > 0 {
            self.seconds_a_frame = seconds / f64::from(frames);
            self.pace.submitted(seconds, u64::from(frames));
        }
        self.begun = true;
        self.done += frames;
        self.frames += u64::from(frames);
        let [width, height] = self.film.size().map(u64::from);
        Ok(Some(Step {
            timings: vec![timings],
            done: width * height * u64::from(self.done),
            wanted: width * height * u64::from(samples),
        }))
    }

    fn picture(&mut self) -> Result<(Picture, NonFiniteSamples)> {
        self.film.picture()
    }

    fn display(&mut self, target: &Buffer, exposure: f32, format: PixelFormat) -> Result<()> {
        self.film.display(target, exposure, format)
    }

    fn set_camera(&mut self, camera: &Camera) -> Result<()> {
        CameraFrame::new(camera, self.film.size())?;
        self.film.clear()?;
        self.camera = camera.clone();
        (self.done, self.begun) = (0, false);
        Ok(())
    }

    fn path_set(&self) -> PathSet {
        self.method.path_set()
    }

    fn settings(&self) -> serde_json::Value {
        self.method.settings()
    }

    fn counters(&self) -> BTreeMap<&'static str, u64> {
        let mut counters = self.method.counters();
        let [width, height] = self.film.size().map(u64::from);
        counters.insert("frames", self.frames);
        counters.insert("samples", self.frames * width * height);
        counters
    }

    fn pipelines(&self) -> Vec<PipelineInfo> {
        let mut all = self.method.pipelines();
        all.extend(self.film.pipelines());
        all
    }

    fn skipped(&self) -> Vec<Skipped> {
        let mut skipped = self.method.skipped();
        skipped.push(Skipped {
            what: "albedo, normal and depth",
            why: if self.wants_aovs {
                "frames hold only radiance"
            } else {
                "they were not asked for"
            },
        });
        skipped
    }
}
