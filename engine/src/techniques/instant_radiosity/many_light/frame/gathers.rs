//! What arrives at the pixels of a frame: direct light, light of texels in discs, of lights that pixels draw, and of all lights of a tile.

use std::ops::Range;

use super::{Frame, Stage};
use crate::gpu::{Access, Pass, Timings};
use crate::techniques::instant_radiosity::gather::SWEEPS_A_LIGHT;
use crate::techniques::instant_radiosity::many_light::kernels::Seen;
use crate::techniques::instant_radiosity::many_light::renderer::{Indirect, LightSource, ManyLight};
use crate::techniques::instant_radiosity::many_light::reservoirs::Reservoirs;
use crate::{Error, Result};

impl ManyLight {
    pub(super) fn shade(&mut self, frame: &mut Frame, first: u32) -> Result<(Vec<Timings>, Stage)> {
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
    pub(super) fn gather_discs(&mut self, frame: &mut Frame, view: u32, first: u32) -> Result<(Vec<Timings>, Stage)> {
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
    pub(super) fn resample(&mut self, frame: &mut Frame, first: u32) -> Result<(Vec<Timings>, Stage)> {
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
    pub(super) fn reuse(&mut self, frame: &Frame, first: u32) -> Result<(Vec<Timings>, Stage)> {
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

    pub(super) fn gather(
        &mut self,
        frame: &Frame,
        lights: Range<u32>,
        place: u32,
        sweeps: u64,
    ) -> Result<(Vec<Timings>, Stage)> {
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
}
