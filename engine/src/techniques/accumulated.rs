//! A progressive technique made of a frame method: film, camera and pace.

use std::collections::BTreeMap;
use std::time::Instant;

use super::foresight::frame_fits;
use super::frame::{Frame, FrameMethod, FrameTarget, Part};
use super::{Skipped, Technique, View};
use crate::Result;
use crate::film::picture::{NonFiniteSamples, Picture};
use crate::film::{GpuFilm, PixelFormat, Step};
use crate::gpu::{Buffer, BufferDesc, Category, Gpu, Pace, PipelineInfo, Timings};
use crate::scene::Camera;
use crate::scene::camera_frame::CameraFrame;
use crate::transport::PathSet;

/// Frames of a step, at most; fewer where their passes fill a recorder.
const FRAMES_MAX: u32 = 32;
/// Samples of a step on software devices, about.
const STEP_SAMPLES: u64 = 1 << 18;
/// Seconds of a step, about, unless one part of a frame takes longer: hosts look at the time and at stop requests between two steps.
const STEP_SECONDS: f64 = 0.25;

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
    /// [`Error::Setting`](crate::Error::Setting) for a camera or a size that cannot be used, [`Error::LimitExceeded`](crate::Error::LimitExceeded) for a
    /// picture larger than a storage buffer, [`Error::OutOfMemory`](crate::Error::OutOfMemory).
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
