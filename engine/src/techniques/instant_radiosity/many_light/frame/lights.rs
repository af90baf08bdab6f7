//! Virtual lights of a frame: where they land or are placed, which of them are chosen, and their shadow maps.

use super::{Frame, LightViews, Stage};
use crate::Result;
use crate::gpu::Timings;
use crate::techniques::instant_radiosity::many_light::maps::Maps;
use crate::techniques::instant_radiosity::many_light::metropolis::Chains;
use crate::techniques::instant_radiosity::many_light::renderer::{LightSource, ManyLight};
use crate::techniques::photon_mapping::Tracing;

impl ManyLight {
    pub(super) fn walk(&mut self, frame: &mut Frame, mut tracing: Box<Tracing>) -> Result<(Vec<Timings>, Stage)> {
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

    pub(super) fn keep(&mut self, frame: &mut Frame) -> Result<(Vec<Timings>, Stage)> {
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

    /// A submission of the chains of a frame, and behind the last one the split picture.
    pub(super) fn choose(&mut self, frame: &mut Frame) -> Result<(Vec<Timings>, Stage)> {
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

    /// What the maps of a frame are drawn from, and the views of that.
    pub(super) fn emit(&mut self) -> Result<(Vec<Timings>, Stage)> {
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
    pub(super) fn draw_view(&mut self, mut views: LightViews) -> Result<(Vec<Timings>, Stage)> {
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
    pub(super) fn place_on_views(&mut self, frame: &mut Frame, views: u32) -> Result<(Vec<Timings>, Stage)> {
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

    pub(super) fn draw_maps(
        &mut self,
        frame: &mut Frame,
        first: u32,
        [light, part]: [u32; 2],
    ) -> Result<(Vec<Timings>, Stage)> {
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
}
