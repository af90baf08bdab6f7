//! Frames of many lights, submission by submission.

mod gathers;
mod lights;
mod picture;

use std::ops::Range;

use glam::{DVec2, UVec4};

use super::interleave::Interleaving;
use super::kernels::{Seen, SharedLights, Sight, seen_from};
use super::metropolis::{Chains, Metropolis};
use super::reflective::{LightView, Reflective};
use super::renderer::{Indirect, LightSource, ManyLight};
use crate::Result;
use crate::gpu::shaders::types::SeenFrom;
use crate::gpu::{Area, Recorder, Timings};
use crate::raster::{DrawPart, View};
use crate::scene::camera_frame::CameraFrame;
use crate::techniques::photon_mapping::Tracing;
use crate::transport::GpuScene;
use crate::transport::random::{Sampler, SamplerKind, pcg4d, sample_2d};
use crate::transport::warp::square_to_disk;

/// Tells the number that chooses the first tile's part of the lights from others.
const FIRST_SUBSET_SEED: u32 = 0x7475_726e;

/// A frame under way.
pub(super) struct Frame {
    view: View,
    from: SeenFrom,
    /// Virtual lights that have landed.
    lights: u32,
    /// That choose them once it is known what is seen.
    chains: Option<Box<Chains>>,
    /// Views that pixels gather from.
    views: u32,
    /// What was drawn is visible to compute shaders.
    is_shown: bool,
    /// A shadow map of a virtual light was drawn.
    has_maps: bool,
    stage: Stage,
}

/// What comes next.
enum Stage {
    Walks(Box<Tracing>),
    /// Virtual lights that are kept, for lamps as they are now.
    Kept,
    /// What reflective shadow maps are drawn from.
    Emitters,
    /// A part of the view of a light, of so many.
    View(Box<LightViews>),
    /// Virtual lights on so many views.
    OnViews(u32),
    /// Discs of that view, from that pixel on.
    Discs {
        view: u32,
        pixel: u32,
    },
    /// What is seen, from that part on.
    Draw(usize),
    /// Chains that choose virtual lights.
    Chains,
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
    /// Lights that pixels draw, from that one on.
    Resample(u32),
    /// Light of those that pixels and their neighbours keep, from that one on.
    Reuse(u32),
    /// Back to the picture, from that pixel on.
    Merge(u32),
    /// Blended with the frame before, from that pixel on.
    Blend(u32),
    Ended,
}

/// The views of the lights of a frame, and what of them comes next.
struct LightViews {
    all: Vec<LightView>,
    next: usize,
    parts: Vec<DrawPart>,
    part: usize,
}

impl Frame {
    fn sight<'a>(&self, scene: &'a GpuScene, seen: &'a Seen) -> Sight<'a> {
        Sight {
            scene,
            seen,
            from: self.from,
        }
    }

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
            Some(Indirect {
                source: LightSource::Walks(tracer),
                ..
            }) => Stage::Walks(Box::new(tracer.begin(self.number(), None))),
            Some(Indirect {
                source: LightSource::Metropolis(chains),
                ..
            }) => Stage::Walks(Box::new(chains.tracer.begin(self.number(), None))),
            Some(Indirect {
                source: LightSource::Kept(_),
                ..
            }) => Stage::Kept,
            Some(_) => Stage::Emitters,
            None if self.discs.is_some() => Stage::Emitters,
            None => self.first_drawing(),
        };
        Ok(Frame {
            view,
            from: seen_from(&camera, size),
            lights: 0,
            chains: None,
            views: 0,
            is_shown: false,
            has_maps: false,
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
            Stage::Kept => self.keep(frame)?,
            Stage::Emitters => self.emit()?,
            Stage::View(views) => self.draw_view(*views)?,
            Stage::OnViews(views) => self.place_on_views(frame, views)?,
            Stage::Discs { view, pixel } => self.gather_discs(frame, view, pixel)?,
            Stage::Draw(part) => self.draw(frame, part)?,
            Stage::Chains => self.choose(frame)?,
            Stage::Direct(pixel) => self.shade(frame, pixel)?,
            Stage::Maps { first, from } => self.draw_maps(frame, first, from)?,
            Stage::Gather { lights, place, sweeps } => self.gather(frame, lights, place, sweeps)?,
            Stage::Resample(pixel) => self.resample(frame, pixel)?,
            Stage::Reuse(pixel) => self.reuse(frame, pixel)?,
            Stage::Merge(pixel) => self.merge(frame, pixel)?,
            Stage::Blend(pixel) => self.blend(frame, pixel)?,
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

    /// What comes behind the virtual lights of a frame.
    fn placed(&mut self, frame: &mut Frame, lights: u32) -> Result<Stage> {
        (frame.lights, self.placed) = (lights, lights);
        self.counts.lights += u64::from(lights);
        let draws_maps = self.to_draw(frame, 0..lights).is_some();
        if let Some(Indirect {
            source,
            maps: Some(maps),
            ..
        }) = &mut self.indirect
            && draws_maps
        {
            maps.begin(&self.gpu, source.records(), lights)?;
        }
        // Where no light has landed, and nothing else is shown, nothing is drawn.
        let is_dark = lights == 0 && self.direct.is_none();
        Ok(if is_dark { Stage::Merge(0) } else { self.first_drawing() })
    }

    /// Chains that choose virtual lights, where these come from them.
    fn metropolis(&self) -> Option<&Metropolis> {
        match self.indirect.as_ref().map(|indirect| &indirect.source) {
            Some(LightSource::Metropolis(chains)) => Some(chains),
            _ => None,
        }
    }

    /// What comes behind what is seen.
    fn after_drawing(&self, frame: &Frame) -> Stage {
        match (&self.direct, &frame.chains) {
            (_, Some(_)) => Stage::Chains,
            (Some(_), None) => Stage::Direct(0),
            (None, None) => self.first_lights(frame, 0),
        }
    }

    /// Reflective shadow maps, where virtual lights come from them.
    pub(super) fn reflective(&self) -> Option<&Reflective> {
        match self.indirect.as_ref().map(|indirect| &indirect.source) {
            Some(LightSource::Reflective(reflective)) => Some(reflective),
            _ => self.discs.as_ref().map(|discs| &discs.reflective),
        }
    }

    /// A part of what is seen, and behind the last one the split picture where there are lights.
    fn draw(&mut self, frame: &mut Frame, part: usize) -> Result<(Vec<Timings>, Stage)> {
        let parts = self.parts.as_ref().map_or(0, Vec::len);
        let is_last = part + 1 >= parts;
        // Chains choose as many as there are settings for.
        let lights = match frame.chains {
            Some(_) => self.settings.lights,
            None => frame.lights,
        };
        let shared = self.shared(lights);
        let split = self.indirect.as_ref().and_then(Indirect::split);
        let splits = is_last && lights > 0 && split.is_some();
        let timings = self.submit(|own, recorder| {
            let surfaces = own.scene.surfaces();
            let (Some(seen), Some(parts)) = (&own.seen, &own.parts) else {
                return Ok(());
            };
            let views = std::slice::from_ref(&frame.view);
            seen.gbuffer.record_part(recorder, &surfaces, views, &parts[part])?;
            match own.indirect.as_ref().filter(|_| splits).and_then(Indirect::split) {
                Some(split) => recorder.pass("many-light: split", |pass| {
                    seen.show(pass);
                    split.record_split(pass, seen, shared)
                }),
                None => Ok(()),
            }
        })?;
        frame.is_shown = splits;
        let next = if is_last {
            self.after_drawing(frame)
        } else {
            Stage::Draw(part + 1)
        };
        Ok((timings, next))
    }

    /// What gathers the lights from one on: as many as have a map at the same time, or all.
    fn first_lights(&self, frame: &Frame, first: u32) -> Stage {
        if frame.views > 0 {
            return Stage::Discs { view: 0, pixel: 0 };
        }
        let Some(indirect) = self.indirect.as_ref().filter(|_| first < frame.lights) else {
            return Stage::Merge(0);
        };
        if indirect.reservoirs().is_some() {
            return Stage::Resample(0);
        }
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

    /// How tiles share out so many lights of a frame. Those of several bounces lie one bounce behind the other, so that each tile has another part in each frame.
    fn shared(&self, lights: u32) -> SharedLights {
        let subsets = self.settings.subsets();
        let first_subset = if self.settings.has_further_bounces() {
            let chosen = pcg4d(UVec4::new(self.settings.seed, FIRST_SUBSET_SEED, 0, 0)).x;
            let on = u64::from(self.number() % subsets) * u64::from(Interleaving::part_step(subsets));
            ((u64::from(chosen) + on) % u64::from(subsets)) as u32
        } else {
            0
        };
        SharedLights {
            count: lights,
            first_subset,
        }
    }

    /// Lights of the range whose maps are to be drawn next: all of them, or of those that are kept, where every light has a map, the next ones without theirs.
    fn to_draw(&self, frame: &Frame, lights: Range<u32>) -> Option<Range<u32>> {
        let Indirect { source, maps, .. } = self.indirect.as_ref()?;
        match source {
            LightSource::Kept(kept) if maps.as_ref()?.at_once() >= frame.lights => kept.unmapped(lights.start),
            _ => Some(lights).filter(|lights| !lights.is_empty()),
        }
    }
}
