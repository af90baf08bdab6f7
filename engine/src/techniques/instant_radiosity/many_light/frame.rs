//! Frames of many lights, submission by submission.

use std::ops::Range;

use glam::DVec2;

use super::kernels::{Sight, seen_from};
use super::maps::Maps;
use super::renderer::ManyLight;
use crate::gpu::shaders::types::SeenFrom;
use crate::gpu::{Access, Area, Recorder, Timings};
use crate::raster::View;
use crate::scene::camera_frame::CameraFrame;
use crate::techniques::instant_radiosity::gather::SWEEPS_A_LIGHT;
use crate::techniques::photon_mapping::Tracing;
use crate::transport::random::{Sampler, SamplerKind, sample_2d};
use crate::transport::warp::square_to_disk;
use crate::{Error, Result};

/// A frame under way.
pub(super) struct Frame {
    view: View,
    from: SeenFrom,
    /// Virtual lights that have landed.
    lights: u32,
    /// What was drawn is visible to compute shaders.
    is_shown: bool,
    stage: Stage,
}

/// What comes next.
enum Stage {
    Walks(Box<Tracing>),
    /// What is seen, from that part on.
    Draw(usize),
    /// Light without virtual lights, from that pixel on.
    Direct(u32),
    /// The shadow maps from that light's part on, of lights from the first one on.
    Maps {
        first: u32,
        from: [u32; 2],
    },
    /// Sweeps over places from that one on, of lights in that range, with the sweeps that there have been.
    Gather {
        lights: Range<u32>,
        place: u32,
        sweeps: u64,
    },
    /// Back to the picture, from that pixel on.
    Merge(u32),
    Ended,
}

impl Frame {
    pub fn has_ended(&self) -> bool {
        matches!(self.stage, Stage::Ended)
    }
}

impl ManyLight {
    /// One place of the pixels and of the lens a frame, the same for all of them, and so of a sequence that is even over frames, whatever the sampler.
    pub(super) fn begin_frame(&mut self) -> Result<Frame> {
        let size = self.film.size();
        let mut numbers = Sampler {
            pixel: 0,
            sample_index: self.done,
            dimension: 0,
            seed: self.settings.seed,
        };
        let mut numbers = || sample_2d(&mut numbers, SamplerKind::Sobol);
        let (place, lens): (DVec2, DVec2) = (numbers(), square_to_disk(numbers()));
        let camera = CameraFrame::new(&self.camera, size)?.seen_through(size, place, lens);
        let surfaces = self.scene.surfaces();
        let view = View::of_frame(&camera, &surfaces, Area::whole(size))?;
        if let (Some(seen), None) = (&self.seen, &self.parts) {
            // Neither the lens nor the place in a pixel changes how much is seen by much.
            let views = std::slice::from_ref(&view);
            self.parts = Some(seen.coverage.parts(&surfaces, views, size)?);
        }
        let stage = match &self.indirect {
            Some(indirect) => Stage::Walks(Box::new(indirect.tracer.begin(self.done, None))),
            None => self.first_drawing(),
        };
        Ok(Frame {
            view,
            from: seen_from(&camera, size),
            lights: 0,
            is_shown: false,
            stage,
        })
    }

    /// Where nothing is seen nothing is drawn.
    fn first_drawing(&self) -> Stage {
        match self.seen {
            Some(_) => Stage::Draw(0),
            None => Stage::Merge(0),
        }
    }

    /// One submission.
    pub(super) fn advance(&mut self, frame: &mut Frame) -> Result<Vec<Timings>> {
        let stage = std::mem::replace(&mut frame.stage, Stage::Ended);
        let (timings, next) = match stage {
            Stage::Walks(tracing) => self.walk(frame, tracing)?,
            Stage::Draw(part) => self.draw(frame, part)?,
            Stage::Direct(pixel) => self.shade(frame, pixel)?,
            Stage::Maps { first, from } => self.draw_maps(frame, first, from)?,
            Stage::Gather { lights, place, sweeps } => self.gather(frame, lights, place, sweeps)?,
            Stage::Merge(pixel) => self.merge(frame, pixel)?,
            Stage::Ended => (Vec::new(), Stage::Ended),
        };
        frame.stage = next;
        Ok(timings)
    }

    /// Records into a command buffer of its own, waits, and counts the passes.
    fn submit(&mut self, record: impl FnOnce(&mut Self, &mut Recorder) -> Result<()>) -> Result<Vec<Timings>> {
        let mut recorder = self.gpu.recorder("many lights")?;
        let left = recorder.passes_left();
        record(self, &mut recorder)?;
        self.counts.passes += (left - recorder.passes_left()) as u64;
        Ok(vec![recorder.submit()?.wait()?])
    }

    fn walk(&mut self, frame: &mut Frame, mut tracing: Box<Tracing>) -> Result<(Vec<Timings>, Stage)> {
        let Some(indirect) = &mut self.indirect else {
            return Ok((Vec::new(), self.first_drawing()));
        };
        let all = indirect.tracer.advance(&mut tracing)?;
        let timings = tracing.take_timings();
        if !all {
            return Ok((timings, Stage::Walks(tracing)));
        }
        let traced = tracing.into_traced();
        frame.lights = traced.records;
        self.counts.walks += traced.counts;
        self.counts.lights += u64::from(traced.records);
        if let Some(maps) = &mut indirect.maps {
            maps.begin(&self.gpu, indirect.tracer.records(), traced.records)?;
        }
        // Where all walks have left the scene, and nothing else is shown, nothing is drawn.
        let is_dark = traced.records == 0 && self.direct.is_none();
        let next = if is_dark { Stage::Merge(0) } else { self.first_drawing() };
        Ok((timings, next))
    }

    /// A part of what is seen, and behind the last one the split picture where there are lights.
    fn draw(&mut self, frame: &mut Frame, part: usize) -> Result<(Vec<Timings>, Stage)> {
        let parts = self.parts.as_ref().map_or(0, Vec::len);
        let is_last = part + 1 >= parts;
        let splits = is_last && frame.lights > 0;
        let timings = self.submit(|own, recorder| {
            let surfaces = own.scene.surfaces();
            let (Some(seen), Some(parts)) = (&own.seen, &own.parts) else {
                return Ok(());
            };
            let views = std::slice::from_ref(&frame.view);
            seen.gbuffer.record_part(recorder, &surfaces, views, &parts[part])?;
            match own.indirect.as_ref().filter(|_| splits) {
                Some(indirect) => recorder.pass("many-light: split", |pass| {
                    seen.show(pass);
                    indirect.split.record_split(pass, seen, frame.lights)
                }),
                None => Ok(()),
            }
        })?;
        frame.is_shown = splits;
        let next = match (is_last, &self.direct) {
            (false, _) => Stage::Draw(part + 1),
            (true, Some(_)) => Stage::Direct(0),
            (true, None) => self.first_lights(frame, 0),
        };
        Ok((timings, next))
    }

    fn shade(&mut self, frame: &mut Frame, first: u32) -> Result<(Vec<Timings>, Stage)> {
        let (all, number) = (self.pixels(), self.done);
        let at_once = self.direct.as_ref().map_or(all, |direct| direct.pixels);
        let end = first.saturating_add(at_once).min(all);
        let timings = self.submit(|own, recorder| {
            let (Some(direct), Some(seen)) = (&own.direct, &own.seen) else {
                return Ok(());
            };
            recorder.pass("many-light: direct", |pass| {
                if !frame.is_shown {
                    seen.show(pass);
                }
                let sight = Sight {
                    scene: &own.scene,
                    seen,
                    from: frame.from,
                };
                direct.record(pass, &sight, number, first..end, &own.radiance)?;
                pass.memory_barrier(Access::COMPUTE, Access::COMPUTE);
                Ok(())
            })
        })?;
        frame.is_shown = true;
        let next = if end < all {
            Stage::Direct(end)
        } else {
            self.first_lights(frame, 0)
        };
        Ok((timings, next))
    }

    /// What gathers the lights from one on: as many as have a map at the same time, or all.
    fn first_lights(&self, frame: &Frame, first: u32) -> Stage {
        let Some(indirect) = self.indirect.as_ref().filter(|_| first < frame.lights) else {
            return Stage::Merge(0);
        };
        match indirect.maps {
            Some(_) => Stage::Maps {
                first,
                from: [first, 0],
            },
            None => Stage::Gather {
                lights: first..frame.lights,
                place: 0,
                sweeps: 0,
            },
        }
    }

    fn draw_maps(&mut self, frame: &Frame, first: u32, from: [u32; 2]) -> Result<(Vec<Timings>, Stage)> {
        let maps = self.indirect.as_ref().and_then(|indirect| indirect.maps.as_ref());
        let Some(maps) = maps else {
            return Ok((Vec::new(), Stage::Merge(0)));
        };
        let end = (first + maps.at_once()).min(frame.lights);
        let (drawings, next) = maps.plan(&self.scene.surfaces(), from, end)?;
        let timings = self.submit(|own, recorder| {
            let maps = own.indirect.as_ref().and_then(|indirect| indirect.maps.as_ref());
            let surfaces = own.scene.surfaces();
            maps.map_or(Ok(()), |maps| maps.record(recorder, &surfaces, first, &drawings))
        })?;
        self.counts.maps += u64::from(next[0] - from[0]);
        let next = if next[0] < end {
            Stage::Maps { first, from: next }
        } else {
            Stage::Gather {
                lights: first..end,
                place: 0,
                sweeps: 0,
            }
        };
        Ok((timings, next))
    }

    fn gather(&mut self, frame: &Frame, lights: Range<u32>, place: u32, sweeps: u64) -> Result<(Vec<Timings>, Stage)> {
        let Some(indirect) = &self.indirect else {
            return Ok((Vec::new(), Stage::Merge(0)));
        };
        let split = &indirect.split;
        let all = split.interleaving.places() as u32;
        let end = place.saturating_add(split.places_at_once).min(all);
        // Those that a subset has, at most, as many a submission as are a bounded piece of work.
        let of_subset = frame.lights.div_ceil(split.subsets).min(lights.end - lights.start);
        let work = u64::from(end - place) * u64::from(split.lights_at_once);
        let wanted = u64::from(of_subset.div_ceil(split.lights_at_once)).saturating_sub(sweeps);
        let count = (split.connections / work.max(1)).clamp(1, wanted.max(1)) as u32;
        let timings = self.submit(|own, recorder| {
            let Some(indirect) = &own.indirect else {
                return Ok(());
            };
            let maps = indirect.maps.as_ref().map(Maps::maps);
            let records = indirect.tracer.records();
            recorder.pass("many-light: gather", |pass| {
                indirect.split.record_sweeps(
                    pass,
                    &own.scene,
                    frame.from,
                    (records, frame.lights),
                    (maps, lights.clone()),
                    (place..end, count),
                )
            })
        })?;
        let Some(indirect) = &self.indirect else {
            return Ok((timings, Stage::Merge(0)));
        };
        let swept = indirect.split.swept()?;
        self.counts.connections += swept.connections;
        self.counts.visibility_tests += swept.tests;
        let sweeps = sweeps + u64::from(count);
        let most = u64::from(frame.lights) * SWEEPS_A_LIGHT;
        if swept.remaining > 0 && sweeps > most {
            return Err(Error::Overflow {
                kernel: "deferred_gather".into(),
                what: "sweeps over the virtual lights".into(),
                needed: sweeps,
                capacity: most,
                instead: "choose another ray index".into(),
            });
        }
        let next = match (swept.remaining > 0, end < all) {
            (true, _) => Stage::Gather { lights, place, sweeps },
            (false, true) => Stage::Gather {
                lights,
                place: end,
                sweeps: 0,
            },
            (false, false) => self.first_lights(frame, lights.end),
        };
        Ok((timings, next))
    }

    fn merge(&mut self, frame: &Frame, first: u32) -> Result<(Vec<Timings>, Stage)> {
        let all = self.pixels();
        let merges = frame.lights > 0;
        let at_once = self.indirect.as_ref().filter(|_| merges);
        let at_once = at_once.map_or(all, |indirect| indirect.split.pixels);
        let end = first.saturating_add(at_once).min(all);
        let timings = self.submit(|own, recorder| {
            if let (Some(indirect), Some(seen), true) = (&own.indirect, &own.seen, merges) {
                recorder.pass("many-light: merge", |pass| {
                    let split = &indirect.split;
                    split.record_merge(pass, seen, frame.lights, first..end, &own.radiance)
                })?;
            } else if own.direct.is_none() {
                recorder.pass("many-light: black", |pass| {
                    pass.fill(own.radiance.view(), 0)?;
                    pass.memory_barrier(Access::TRANSFER_WRITE, Access::COMPUTE);
                    Ok(())
                })?;
            }
            if end < all {
                return Ok(());
            }
            own.film.record_frame(recorder, &own.radiance)
        })?;
        let next = if end < all { Stage::Merge(end) } else { Stage::Ended };
        Ok((timings, next))
    }
}
