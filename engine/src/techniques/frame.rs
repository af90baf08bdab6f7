//! Techniques that draw one picture per frame, and what turns them into progressive techniques.
//!
//! A [`FrameMethod`] records into a command buffer of the engine or of a host: it submits nothing and waits for nothing. [`Accumulated`] owns
//! what a [`Technique`](super::Technique) needs beside that: film, camera, and how many frames a step takes.
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

use super::Skipped;
use crate::gpu::{Buffer, DeviceKind, Gpu, PipelineInfo, Recorder};
use crate::scene::Camera;
use crate::transport::PathSet;
use crate::{Error, Result};

pub use super::accumulated::Accumulated;

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
    pub(super) fn next(self) -> Self {
        Self {
            number: self.number + 1,
            ..self
        }
    }

    pub(super) fn is_last(self) -> bool {
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

/// Draws one picture per frame. [`Accumulated`] makes a [`Technique`](super::Technique) of it.
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
