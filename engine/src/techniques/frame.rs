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
//! Bounded: a method says in how many [`Part`]s of bounded work a frame falls, and what frames share. [`Accumulated`] submits each by itself, so that a step of it
//! ends after some tenths of a second whatever the scene. A host that records whole frames waits for whole frames.
//!
//! Deterministic: a frame's picture depends on scene, camera, size, settings, seed and number alone.

use std::collections::BTreeMap;
use std::ops::Range;
use std::time::Instant;

use super::foresight::frame_fits;
use super::{Skipped, Technique, View};
use crate::film::picture::{NonFiniteSamples, Picture};
use crate::film::{GpuFilm, PixelFormat, Step};
use crate::gpu::{Buffer, BufferDesc, Category, DeviceKind, Gpu, Pace, PipelineInfo, Recorder, Timings};
use crate::scene::Camera;
use crate::scene::camera_frame::CameraFrame;
use crate::transport::PathSet;
use crate::{Error, Result};

/// Frames of a step, at most; fewer where their passes fill a recorder.
const FRAMES_MAX: u32 = 32;
/// Samples of a step on software devices, about.
const STEP_SAMPLES: u64 = 1 << 18;
/// Seconds of a step, about, unless one part of a frame takes longer: hosts look at the time and at stop requests between two steps.
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
    /// What of it is recorded: [`Part::WHOLE`], or each part in turn.
    pub part: Part,
}

/// A part of a frame, or of what frames share: a bounded piece of work.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Part {
    /// Its number, from 0 on.
    pub number: u32,
    /// How many there are.
    pub of: u32,
}

/// Work of a part, in steps of rays through an index: some tenths of a second, on software devices on two cores.
const SOFTWARE_WORK: u64 = 1 << 26;
const DEVICE_WORK: u64 = 1 << 32;

impl Part {
    /// All at once.
    pub const WHOLE: Self = Self { number: 0, of: 1 };

    /// How many parts work on such a device falls in: one or more. Work is counted in steps of rays through an index, at most.
    pub fn count(gpu: &Gpu, work: u64) -> u32 {
        let most = if gpu.caps().kind == DeviceKind::Cpu {
            SOFTWARE_WORK
        } else {
            DEVICE_WORK
        };
        work.div_ceil(most).clamp(1, u64::from(u32::MAX)) as u32
    }

    /// What it has of `count` pieces: each part about as many.
    pub fn range(self, count: u32) -> Range<u32> {
        let end = |number: u32| (u64::from(count) * u64::from(number) / u64::from(self.of.max(1))) as u32;
        end(self.number)..end(self.number.saturating_add(1)).min(count)
    }

    /// The one behind it.
    fn next(self) -> Self {
        Self {
            number: self.number + 1,
            ..self
        }
    }

    fn is_last(self) -> bool {
        self.number + 1 >= self.of
    }
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

    /// In how many parts what frames share falls, now: those of [`FrameMethod::begin_part`]. May wait for the device, a bounded time: `None` when it has
    /// not counted all of them yet, and is to be asked again.
    ///
    /// # Errors
    /// [`Error::OutOfMemory`], [`Error::DeviceLost`].
    fn begin_parts(&mut self, gpu: &Gpu) -> Result<Option<u32>> {
        let _ = gpu;
        Ok(Some(1))
    }

    /// As [`FrameMethod::begin`], one of the parts that [`FrameMethod::begin_parts`] has told last. One that failed is recorded again.
    ///
    /// # Errors
    /// As [`FrameMethod::begin`].
    fn begin_part(&mut self, recorder: &mut Recorder, part: Part) -> Result<()> {
        let _ = part;
        self.begin(recorder)
    }

    /// In how many parts frames of a camera and of that size fall. May wait for the device.
    ///
    /// # Errors
    /// [`Error::Setting`] for a camera that cannot be used; [`Error::OutOfMemory`], [`Error::DeviceLost`].
    fn parts(&mut self, gpu: &Gpu, camera: &Camera, size: [u32; 2]) -> Result<u32> {
        let _ = (gpu, camera, size);
        Ok(1)
    }

    /// Records one picture: one sample of every pixel. Barriers before and after: see the [module](self). [`FrameTarget::pixels`] or
    /// [`FrameTarget::check`] refuses targets that it must not write. Of a part, what it adds to those before it, which [`FrameMethod::parts`] has counted for the
    /// camera; one that failed is recorded again.
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
    /// What of that comes next; `None` before it has been counted.
    begin_part: Option<Part>,
    /// What of a frame comes next; `None` before its parts have been counted.
    frame_part: Option<Part>,
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
            begin_part: None,
            frame_part: None,
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
                part: Part::WHOLE,
            };
            self.method.record(&mut recorder, &frame, &target)?;
            // Waits for the frame, and leaves the target to the next one.
            self.film.record_frame(&mut recorder, &self.radiance)?;
            self.passes_a_frame = self.passes_a_frame.max(left - recorder.passes_left());
            drawn += 1;
        }
        Ok((drawn, recorder.submit()?.wait()?))
    }

    /// Counts the parts of what frames share, if that has not been done, until `goes_on` says no; whether they are counted.
    fn count_begin_parts(&mut self, goes_on: impl Fn() -> bool) -> Result<bool> {
        while !self.begun && self.begin_part.is_none() {
            match self.method.begin_parts(&self.gpu)? {
                Some(of) => self.begin_part = Some(Part { number: 0, of }),
                None if goes_on() => {}
                None => return Ok(false),
            }
        }
        Ok(true)
    }

    /// What comes next of what frames share; `None` when it is there, or goes with the first frame.
    fn next_begin_part(&self) -> Option<Part> {
        self.begin_part.filter(|part| !self.begun && part.of > 1)
    }

    /// What comes next of a frame that falls in parts; `None` for frames that do not.
    fn next_frame_part(&mut self) -> Result<Option<Part>> {
        let part = match self.frame_part {
            Some(part) => part,
            None => Part {
                number: 0,
                of: self.method.parts(&self.gpu, &self.camera, self.film.size())?,
            },
        };
        self.frame_part = Some(part);
        Ok((part.of > 1).then_some(part))
    }

    /// Counts parts and draws them, each a submission, until the time of a step is over, or what frames share is there, or a frame is; whether that was
    /// the step.
    fn submit_parts(&mut self, timings: &mut Vec<Timings>) -> Result<bool> {
        let clock = Instant::now();
        let goes_on = || clock.elapsed().as_secs_f64() < STEP_SECONDS;
        if !self.count_begin_parts(goes_on)? {
            return Ok(true);
        }
        while let Some(part) = self.next_begin_part() {
            let mut recorder = self.gpu.recorder("what frames share")?;
            self.method.begin_part(&mut recorder, part)?;
            timings.push(recorder.submit()?.wait()?);
            (self.begin_part, self.begun) = (Some(part.next()), part.is_last());
            if self.begun || !goes_on() {
                return Ok(true);
            }
        }
        while let Some(part) = self.next_frame_part()? {
            let target = FrameTarget {
                radiance: &self.radiance,
                size: self.film.size(),
            };
            let mut recorder = self.gpu.recorder("part of a frame")?;
            if !self.begun {
                self.method.begin(&mut recorder)?;
            }
            let frame = Frame {
                camera: &self.camera,
                seed: self.seed,
                number: self.done,
                part,
            };
            self.method.record(&mut recorder, &frame, &target)?;
            if part.is_last() {
                self.film.record_frame(&mut recorder, &self.radiance)?;
            }
            timings.push(recorder.submit()?.wait()?);
            self.begun = true;
            if part.is_last() {
                self.frame_part = Some(Part { number: 0, ..part });
                (self.done, self.frames) = (self.done + 1, self.frames + 1);
                return Ok(true);
            }
            self.frame_part = Some(part.next());
            if !goes_on() {
                return Ok(true);
            }
        }
        Ok(false)
    }

    /// What is there towards `samples` samples of each pixel.
    fn step_so_far(&self, timings: Vec<Timings>, samples: u32) -> Step {
        let [width, height] = self.film.size().map(u64::from);
        Step {
            timings,
            done: width * height * u64::from(self.done),
            wanted: width * height * u64::from(samples),
        }
    }
}

impl<M: FrameMethod> Technique for Accumulated<M> {
    fn step(&mut self, samples: u32) -> Result<Option<Step>> {
        if self.done >= samples {
            return Ok(None);
        }
        let mut parts = Vec::new();
        if self.submit_parts(&mut parts)? {
            return Ok(Some(self.step_so_far(parts, samples)));
        }
        let wanted = self.frames_for_step().min(samples - self.done);
        let clock = Instant::now();
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
        Ok(Some(self.step_so_far(vec![timings], samples)))
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
        (self.begin_part, self.frame_part) = (None, None);
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_have_every_piece_once() {
        for (count, of) in [(0, 3), (7, 7), (100, 7), (3, 8), (u32::MAX, 5), (262_144, 256)] {
            let mut end = 0;
            for number in 0..of {
                let range = Part { number, of }.range(count);
                assert_eq!(range.start, end, "{number} of {of}");
                assert!(range.len() as u32 <= count / of + 1, "{number} of {of}");
                end = range.end;
            }
            assert_eq!(end, count);
        }
        assert_eq!(Part::WHOLE.range(9), 0..9);
    }
}
