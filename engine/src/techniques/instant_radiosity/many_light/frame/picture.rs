//! What has arrived becomes the frame's picture, blended with the frame before where there is a history.

use super::{Frame, Stage};
use crate::Result;
use crate::gpu::{Access, Timings};
use crate::techniques::instant_radiosity::many_light::past::Past;
use crate::techniques::instant_radiosity::many_light::renderer::{Indirect, ManyLight};

impl ManyLight {
    pub(super) fn merge(&mut self, frame: &Frame, first: u32) -> Result<(Vec<Timings>, Stage)> {
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
    pub(super) fn blend(&mut self, frame: &Frame, first: u32) -> Result<(Vec<Timings>, Stage)> {
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
