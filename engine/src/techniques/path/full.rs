//! The steps of a path tracer whose wave is kept full.

use super::record::{EyeStages, UnderWay, seed_alone};
use super::{PathTracer, WAVES_PER_FULL_WAVE};
use crate::Result;
use crate::catalogue::{Bias, Role, Row, sources};
use crate::film::Step;
use crate::walk::ArrivalStage;

impl PathTracer {
    /// As [`PathTracer::step`]: slots of paths that have ended take new samples, as long as there are some towards `samples` of each pixel.
    pub(super) fn step_full(&mut self, samples: u32, arrival: Option<&dyn ArrivalStage>) -> Result<Option<Step>> {
        if self.full.as_ref().is_some_and(|full| full.walks.is_none()) {
            // What had ended when a submission failed is still there.
            self.flush_full()?;
        }
        let slots = self.slots();
        let Some(full) = &mut self.full else { return Ok(None) };
        let mut walks = match full.walks.take() {
            Some(walks) => walks,
            None => {
                // Paths that were under way begin anew.
                full.samples.lose();
                self.walker.begin_full(seed_alone(self.settings.seed))?
            }
        };
        let mut begins = Vec::new();
        if walks.is_between_bounces() {
            let (film, cursor) = (&self.film, &mut self.cursor);
            // As many pixels and samples together as whole waves have.
            let wave_slots = slots.saturating_mul(WAVES_PER_FULL_WAVE);
            let next_wave = || {
                let (wave, next) = cursor.next_wave(film, wave_slots, samples)?;
                *cursor = next;
                Some(wave)
            };
            begins = full.samples.begin(slots - walks.walks(), next_wave);
            self.walker
                .refill(&mut walks, begins.iter().map(|piece| piece.count).sum())?;
            if walks.has_ended() {
                full.walks = Some(walks);
                return Ok(None);
            }
        }
        let mut stages = EyeStages {
            scene: &self.scene,
            settings: &self.settings,
            frame: &self.frame,
            eye: self.eye,
            pipelines: &self.pipelines,
            film: &self.film,
            adaptive: None,
            kept: &self.kept,
            light_tree: self.light_tree.as_ref(),
            shared_light: self.shared_light,
            arrival,
            under_way: UnderWay::Full {
                refill: &full.refill,
                samples: &mut full.samples,
                begins,
            },
        };
        let before = walks.walked().clone();
        self.walker.advance(&mut walks, &mut stages)?;
        self.counters.count(&before, walks.walked());
        if walks.is_between_bounces() {
            let ended = full.samples.ended();
            self.counters.waves += full.samples.note(walks.walks(), walks.oldest());
            self.counters.paths += full.samples.ended() - ended;
        }
        let timings = walks.take_timings();
        full.walks = Some(walks);
        Ok(Some(self.step_so_far(timings, samples)))
    }

    /// Adds the samples to the film that have ended.
    pub(super) fn flush_full(&mut self) -> Result<()> {
        let Some(full) = self.full.as_mut().filter(|full| full.samples.are_pending()) else {
            return Ok(());
        };
        let mut recorder = self.gpu.recorder("path film")?;
        let (buffers, pending) = (self.walker.buffers(), full.samples.pending());
        full.refill.record_turnover(
            &mut recorder,
            &self.pipelines,
            &self.film,
            buffers,
            &self.kept,
            &pending,
        )?;
        let submission = recorder.submit()?;
        full.samples.resolve();
        submission.wait()?;
        Ok(())
    }
}

/// Rows of the catalogue.
pub(crate) const ROWS: &[Row] = &[Row {
    id: "CL-FULL-WAVES",
    name: "waves that stay full: slots of paths that have ended take new samples, which reach the film in order",
    role: Role::PartOf("BG-3"),
    limits: "Off by default, being slower on software drivers (`path-stages`); samples reach the film pixel by pixel, so that a picture before its end lacks its \
             last pixels, and wait for the longest path before them; adaptive samples, photon mapping and virtual lights have whole waves.",
    sources: &[sources::NOVAK_2010.whole()],
    shaders: &[
        "shaders/techniques/path/path_refill.comp",
        "shaders/techniques/path/path_retire.comp",
        "shaders/walk/turnover.glsl",
    ],
    bias: Some(Bias::Unbiased),
    tests: &[
        "tests/tests/paths/full_waves.rs::pictures_are_those_of_whole_waves",
        "tests/tests/paths/full_waves.rs::passes_follow_from_segments_and_slots",
        "tests/tests/paths/full_waves.rs::what_has_ended_can_be_looked_at_and_more_be_asked_for",
        "tests/tests/embedding/walk.rs::walks_that_a_full_wave_cannot_take_are_refused",
        "tests/tests/media/mechanics.rs::how_the_work_is_cut_up_never_shows",
        "tests/tests/retries.rs::what_failed_is_done_again_without_a_trace",
        "engine/src/techniques/path/in_order.rs::samples_begin_within_the_results_and_end_in_order",
        "engine/src/techniques/path/in_order.rs::all_results_may_be_taken",
    ],
    ..Row::of(file!())
}];
