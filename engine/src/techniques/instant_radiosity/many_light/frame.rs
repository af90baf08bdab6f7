//! Frames of many lights, submission by submission.

use std::ops::Range;

use glam::{DVec2, UVec4};

use super::interleave::Interleaving;
use super::kernels::{Seen, SharedLights, Sight, seen_from};
use super::maps::Maps;
use super::metropolis::{Chains, Metropolis};
use super::past::Past;
use super::reflective::{LightView, Reflective};
use super::renderer::{Indirect, LightSource, ManyLight};
use super::reservoirs::Reservoirs;
use crate::gpu::shaders::types::SeenFrom;
use crate::gpu::{Access, Area, Pass, Recorder, Timings};
use crate::raster::{DrawPart, View};
use crate::scene::camera_frame::CameraFrame;
use crate::techniques::instant_radiosity::gather::SWEEPS_A_LIGHT;
use crate::techniques::photon_mapping::Tracing;
use crate::transport::GpuScene;
use crate::transport::random::{Sampler, SamplerKind, pcg4d, sample_2d};
use crate::transport::warp::square_to_disk;
use crate::{Error, Result};

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

    fn walk(&mut self, frame: &mut Frame, mut tracing: Box<Tracing>) -> Result<(Vec<Timings>, Stage)> {
        let source = self.indirect.as_mut().map(|indirect| &mut indirect.source);
        let Some(tracer) = source.and_then(LightSource::tracer) else {
            return Ok((Vec::new(), self.first_drawing()));
        };
        let all = tracer.advance(&mut tracing)?;
        let timings = tracing.take_timings();
        if !all {
            return Ok((timings, Stage::Walks(tracing)));
        }
        let traced = tracing.into_traced();
        self.counts.walks += traced.counts;
        if self.metropolis().is_some() && traced.records > 0 {
            frame.chains = Some(Box::new(Chains::new(self.number(), self.film.size(), traced.records)));
            return Ok((timings, self.first_drawing()));
        }
        Ok((timings, self.placed(frame, traced.records)?))
    }

    fn keep(&mut self, frame: &mut Frame) -> Result<(Vec<Timings>, Stage)> {
        let Some(LightSource::Kept(kept)) = self.indirect.as_mut().map(|indirect| &mut indirect.source) else {
            return Ok((Vec::new(), self.first_drawing()));
        };
        let done = kept.keep(&self.gpu, &self.scene)?;
        let lights = kept.count();
        self.counts.passes += done.passes;
        self.counts.renewed += done.renewed;
        self.counts.sight_rays += done.rays;
        Ok((done.timings, self.placed(frame, lights)?))
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

    /// A submission of the chains of a frame, and behind the last one the split picture.
    fn choose(&mut self, frame: &mut Frame) -> Result<(Vec<Timings>, Stage)> {
        let Some(mut chains) = frame.chains.take() else {
            return Ok((Vec::new(), self.after_drawing(frame)));
        };
        let mut rays = 0;
        let timings = self.submit(|own, recorder| {
            let (Some(metropolis), Some(seen)) = (own.metropolis(), &own.seen) else {
                return Ok(());
            };
            let sight = frame.sight(&own.scene, seen);
            rays = metropolis.record(recorder, &sight, &chains, frame.is_shown)?;
            Ok(())
        })?;
        frame.is_shown = true;
        self.counts.chain_rays += rays;
        if let Some(metropolis) = self.metropolis() {
            metropolis.learn(&self.gpu, &mut chains)?;
        }
        let Some(lights) = chains.ended() else {
            frame.chains = Some(chains);
            return Ok((timings, Stage::Chains));
        };
        self.placed(frame, lights)?;
        Ok((timings, self.after_drawing(frame)))
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

    /// What the maps of a frame are drawn from, and the views of that.
    fn emit(&mut self) -> Result<(Vec<Timings>, Stage)> {
        let number = self.number();
        let timings = self.submit(|own, recorder| match own.reflective() {
            Some(reflective) => reflective.record_emitters(recorder, &own.scene, number),
            None => Ok(()),
        })?;
        let Some(reflective) = self.reflective() else {
            return Ok((timings, self.first_drawing()));
        };
        let all = reflective.views(&self.gpu, &self.scene.surfaces())?;
        self.counts.views += all.len() as u64;
        self.viewed = 0;
        let views = LightViews {
            all,
            next: 0,
            parts: Vec::new(),
            part: 0,
        };
        Ok((timings, Stage::View(Box::new(views))))
    }

    /// A part of a view of a light.
    fn draw_view(&mut self, mut views: LightViews) -> Result<(Vec<Timings>, Stage)> {
        let (Some(reflective), Some(view)) = (self.reflective(), views.all.get(views.next).copied()) else {
            return Ok((Vec::new(), Stage::OnViews(views.all.len() as u32)));
        };
        if views.parts.is_empty() {
            let (surfaces, size) = (self.scene.surfaces(), [reflective.side(); 2]);
            views.parts = reflective.coverage().parts(&surfaces, &[view.view], size)?;
        }
        let (number, part) = (views.next as u32, views.parts[views.part].clone());
        let timings = self.submit(|own, recorder| match own.reflective() {
            Some(reflective) => reflective.record_view(recorder, &own.scene, (number, &view), &part),
            None => Ok(()),
        })?;
        views.part += 1;
        if part.ends {
            (views.next, views.part) = (views.next + 1, 0);
            views.parts.clear();
        }
        Ok((timings, Stage::View(Box::new(views))))
    }

    /// Virtual lights on the views of a frame: none where those are black.
    fn place_on_views(&mut self, frame: &mut Frame, views: u32) -> Result<(Vec<Timings>, Stage)> {
        self.viewed = views;
        if self.discs.is_some() {
            frame.views = views;
            return Ok((Vec::new(), self.first_drawing()));
        }
        if views == 0 {
            return Ok((Vec::new(), self.placed(frame, 0)?));
        }
        let number = self.number();
        let timings = self.submit(|own, recorder| match own.reflective() {
            Some(reflective) => reflective.record_lights(recorder, &own.scene, views, number),
            None => Ok(()),
        })?;
        let Some(reflective) = self.reflective() else {
            return Ok((timings, self.first_drawing()));
        };
        let lights = if reflective.total(&self.gpu)? > 0.0 {
            reflective.lights()
        } else {
            0
        };
        Ok((timings, self.placed(frame, lights)?))
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
                let sight = frame.sight(&own.scene, seen);
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

    /// What the texels of a view bring to a part of the pixels.
    fn gather_discs(&mut self, frame: &mut Frame, view: u32, first: u32) -> Result<(Vec<Timings>, Stage)> {
        let (all, number) = (self.pixels(), self.done);
        let at_once = self.discs.as_ref().map_or(all, |discs| discs.pixels);
        let end = first.saturating_add(at_once).min(all);
        let timings = self.submit(|own, recorder| {
            let (Some(discs), Some(seen)) = (&own.discs, &own.seen) else {
                return Ok(());
            };
            recorder.pass("many-light: discs", |pass| {
                if !frame.is_shown {
                    seen.show(pass);
                }
                // What the first view brings is added to direct light, or to nothing.
                if view == 0 && first == 0 {
                    own.record_black(pass)?;
                }
                let sight = frame.sight(&own.scene, seen);
                discs.record(pass, &sight, (number, view), first..end, &own.radiance)
            })
        })?;
        frame.is_shown = true;
        let next = match (end < all, view + 1 < frame.views) {
            (true, _) => Stage::Discs { view, pixel: end },
            (false, true) => Stage::Discs {
                view: view + 1,
                pixel: 0,
            },
            (false, false) => Stage::Merge(0),
        };
        Ok((timings, next))
    }

    /// Where there is no direct light, nothing yet.
    fn record_black(&self, pass: &mut Pass<'_>) -> Result<()> {
        if self.direct.is_none() {
            pass.memory_barrier(Access::COMPUTE, Access::TRANSFER_WRITE);
            pass.fill(self.radiance.view(), 0)?;
            pass.memory_barrier(Access::TRANSFER_WRITE, Access::COMPUTE);
        }
        Ok(())
    }

    /// Where the lights of reservoirs come from, these, and what is seen.
    fn with_reservoirs(&self) -> Option<(&LightSource, &Reservoirs, &Seen)> {
        let indirect = self.indirect.as_ref()?;
        Some((&indirect.source, indirect.reservoirs()?, self.seen.as_ref()?))
    }

    /// Lights that a part of the pixels draw.
    fn resample(&mut self, frame: &mut Frame, first: u32) -> Result<(Vec<Timings>, Stage)> {
        let Some(reservoirs) = self.indirect.as_ref().and_then(Indirect::reservoirs) else {
            return Ok((Vec::new(), Stage::Merge(0)));
        };
        let (all, number) = (self.pixels(), self.done);
        let end = first.saturating_add(reservoirs.pixels[0]).min(all);
        let timings = self.submit(|own, recorder| {
            let Some((source, reservoirs, seen)) = own.with_reservoirs() else {
                return Ok(());
            };
            recorder.pass("many-light: resample", |pass| {
                if !frame.is_shown {
                    seen.show(pass);
                }
                let sight = frame.sight(&own.scene, seen);
                let lights = (source.records(), frame.lights);
                reservoirs.record_resample(pass, &sight, lights, number, first..end)
            })
        })?;
        frame.is_shown = true;
        let next = if end < all {
            Stage::Resample(end)
        } else {
            Stage::Reuse(0)
        };
        Ok((timings, next))
    }

    /// Light of what a part of the pixels and their neighbours keep.
    fn reuse(&mut self, frame: &Frame, first: u32) -> Result<(Vec<Timings>, Stage)> {
        let Some(reservoirs) = self.indirect.as_ref().and_then(Indirect::reservoirs) else {
            return Ok((Vec::new(), Stage::Merge(0)));
        };
        let (all, number) = (self.pixels(), self.done);
        let end = first.saturating_add(reservoirs.pixels[1]).min(all);
        let timings = self.submit(|own, recorder| {
            let Some((source, reservoirs, seen)) = own.with_reservoirs() else {
                return Ok(());
            };
            recorder.pass("many-light: reuse", |pass| {
                if first == 0 {
                    own.record_black(pass)?;
                }
                let sight = frame.sight(&own.scene, seen);
                reservoirs.record_reuse(pass, &sight, source.records(), number, first..end, &own.radiance)
            })
        })?;
        if end < all {
            return Ok((timings, Stage::Reuse(end)));
        }
        if let Some(reservoirs) = self.indirect.as_ref().and_then(Indirect::reservoirs) {
            let [connections, tests] = reservoirs.counts()?;
            self.counts.connections += connections;
            self.counts.visibility_tests += tests;
        }
        Ok((timings, Stage::Merge(0)))
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

    fn draw_maps(&mut self, frame: &mut Frame, first: u32, [light, part]: [u32; 2]) -> Result<(Vec<Timings>, Stage)> {
        let at_once = self.indirect.as_ref().and_then(|indirect| indirect.maps.as_ref());
        let all = (first + at_once.map_or(0, Maps::at_once)).min(frame.lights);
        let lights = self.to_draw(frame, light..all);
        let maps = self.indirect.as_mut().and_then(|indirect| indirect.maps.as_mut());
        let gather = Stage::Gather {
            lights: first..all,
            place: 0,
            sweeps: 0,
        };
        let (Some(lights), Some(maps)) = (lights, maps) else {
            return Ok((Vec::new(), gather));
        };
        let from = [lights.start, if lights.start == light { part } else { 0 }];
        let points = u64::from(maps.points());
        let (drawing, next) = maps.plan(&self.scene.surfaces(), from, lights.end)?;
        let begins = !std::mem::replace(&mut frame.has_maps, true);
        let timings = self.submit(|own, recorder| {
            let maps = own.indirect.as_ref().and_then(|indirect| indirect.maps.as_ref());
            let surfaces = own.scene.surfaces();
            let Some((indirect, maps)) = own.indirect.as_ref().zip(maps) else {
                return Ok(());
            };
            let lights = (indirect.source.records(), frame.lights);
            maps.record(recorder, &surfaces, lights, begins, first, &drawing)
        })?;
        let drawn = u64::from(next[0] - from[0]);
        self.counts.maps += drawn;
        self.counts.splats += drawn * points;
        if let Some(LightSource::Kept(kept)) = self.indirect.as_mut().map(|indirect| &mut indirect.source) {
            kept.have_maps(from[0]..next[0]);
        }
        let next = if next[0] < all {
            Stage::Maps { first, from: next }
        } else {
            gather
        };
        Ok((timings, next))
    }

    fn gather(&mut self, frame: &Frame, lights: Range<u32>, place: u32, sweeps: u64) -> Result<(Vec<Timings>, Stage)> {
        let Some(split) = self.indirect.as_ref().and_then(Indirect::split) else {
            return Ok((Vec::new(), Stage::Merge(0)));
        };
        let all = split.interleaving.places() as u32;
        let end = place.saturating_add(split.places_at_once).min(all);
        // Those that a subset has, at most, as many a submission as are a bounded piece of work.
        let of_subset = frame.lights.div_ceil(split.subsets).min(lights.end - lights.start);
        let work = u64::from(end - place) * u64::from(split.lights_at_once);
        let wanted = u64::from(of_subset.div_ceil(split.lights_at_once)).saturating_sub(sweeps);
        let count = (split.connections / work.max(1)).clamp(1, wanted.max(1)) as u32;
        let shared = self.shared(frame.lights);
        let timings = self.submit(|own, recorder| {
            let Some((indirect, split)) = own.indirect.as_ref().and_then(|own| Some((own, own.split()?))) else {
                return Ok(());
            };
            let maps = indirect.maps.as_ref();
            let records = indirect.source.records();
            recorder.pass("many-light: gather", |pass| {
                split.record_sweeps(
                    pass,
                    &own.scene,
                    frame.from,
                    (records, shared),
                    (maps, lights.clone()),
                    (place..end, count),
                )
            })
        })?;
        let Some(split) = self.indirect.as_ref().and_then(Indirect::split) else {
            return Ok((timings, Stage::Merge(0)));
        };
        let swept = split.swept()?;
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
        let gathered = frame.lights > 0;
        let at_once = self.indirect.as_ref().filter(|_| gathered).and_then(Indirect::split);
        let at_once = at_once.map_or(all, |split| split.pixels);
        let end = first.saturating_add(at_once).min(all);
        let blends = gathered && self.past().is_some();
        let shared = self.shared(frame.lights);
        let timings = self.submit(|own, recorder| {
            let split = own.indirect.as_ref().filter(|_| gathered).and_then(Indirect::split);
            if let (Some(split), Some(seen)) = (split, &own.seen) {
                let target = own.past().map_or(&own.radiance, Past::light);
                recorder.pass("many-light: merge", |pass| {
                    split.record_merge(pass, seen, shared, first..end, target)?;
                    if blends {
                        pass.memory_barrier(Access::COMPUTE, Access::COMPUTE);
                    }
                    Ok(())
                })?;
            } else if own.direct.is_none() && frame.views == 0 && !gathered {
                recorder.pass("many-light: black", |pass| {
                    pass.fill(own.radiance.view(), 0)?;
                    pass.memory_barrier(Access::TRANSFER_WRITE, Access::COMPUTE);
                    Ok(())
                })?;
            }
            if end < all || blends {
                return Ok(());
            }
            own.film.record_frame(recorder, &own.radiance)
        })?;
        let next = match (end < all, blends) {
            (true, _) => Stage::Merge(end),
            (false, true) => Stage::Blend(0),
            (false, false) => {
                // Light that is gone is gone at once.
                let past = self.indirect.iter_mut().filter_map(|indirect| indirect.past.as_mut());
                past.for_each(Past::forget);
                Stage::Ended
            }
        };
        Ok((timings, next))
    }

    /// Indirect light of a part of the pixels with that of the frame before, to the picture.
    fn blend(&mut self, frame: &Frame, first: u32) -> Result<(Vec<Timings>, Stage)> {
        let all = self.pixels();
        let at_once = self.past().map_or(all, |past| past.pixels);
        let end = first.saturating_add(at_once).min(all);
        let timings = self.submit(|own, recorder| {
            let (Some(indirect), Some(seen)) = (&own.indirect, &own.seen) else {
                return Ok(());
            };
            let (Some(past), Some(split)) = (&indirect.past, indirect.split()) else {
                return Ok(());
            };
            recorder.pass("many-light: blend", |pass| {
                let colors = split.colors();
                past.record(pass, seen, frame.from, colors, first..end, &own.radiance)?;
                pass.memory_barrier(Access::COMPUTE, Access::COMPUTE | Access::TRANSFER_READ);
                Ok(())
            })?;
            if end < all {
                return Ok(());
            }
            own.film.record_frame(recorder, &own.radiance)
        })?;
        if end < all {
            return Ok((timings, Stage::Blend(end)));
        }
        if let Some(past) = self.indirect.as_mut().and_then(|indirect| indirect.past.as_mut()) {
            past.keep(frame.from);
        }
        Ok((timings, Stage::Ended))
    }
}
