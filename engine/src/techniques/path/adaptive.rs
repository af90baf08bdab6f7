//! Adaptive samples: after a pilot, more for pixels with more noise, in rounds of waves.
//!
//! Two stages: a pilot of as many samples for each pixel, then the rest of the budget in proportion to the standard error of a pixel's samples, which is the share
//! that minimises the mean of the squared errors (Neyman 1934). [`noise`] says why this is unbiased with the pilot in the picture: what steers
//! the samples of a pixel are the pilot's samples of others. It rests on random numbers that pixels do not share: those of a pixel are keyed by a hash of
//! (seed, pixel, dimension), so that Sobol' points are scrambled for each pixel by itself, and a sample of a pixel has the same numbers whatever the
//! others get. The pilot decides once; what is sampled later never does.
//!
//! Deterministic: noise and shares are found by the host from the film's sums, pixel by pixel. A pixel's samples reach its sum in their order. An interrupted picture
//! has all of the pilot, or each of its pixels the same share of what it is to get, as far as a round over the picture goes.

mod noise;
mod shares;

use self::noise::{noise_of_neighbours, variances};
use self::shares::{end_of, places, share_at, shares};
use super::settings::Adaptive;
use super::wave::{Cursor, Places, SAMPLES_PER_WAVE, SAMPLES_TOGETHER, Wave, samples_of_pass};
use crate::Result;
use crate::catalogue::{Bias, Role, Row, sources};
use crate::film::{FilmBand, GpuFilm};
use crate::gpu::shaders::sets::{PathShareSet, PathSlotSet, WaveSet};
use crate::gpu::shaders::techniques::path::{path_numbers, path_resolve_shares};
use crate::gpu::shaders::types::PathShare;
use crate::gpu::{Buffer, BufferDesc, Category, ComputePipeline, Gpu, Pass, PipelineInfo, Recorder, TexelView};
use crate::walk::stage_barrier;

/// Samples per pixel of a picture over those of its pilot.
const PILOT_PART: u32 = 4;
/// Most samples per pixel of a pilot, a power of two: the noise is well known by then.
const PILOT_MOST: u32 = 256;
/// Fewest samples per pixel that have a pilot: two show a spread.
const SAMPLES_LEAST: u32 = 8;
/// Fewest samples per pixel whose pilot is as large a part of them as that of more, and has four samples.
pub(super) const LIKE_PILOTS: u32 = 4 * PILOT_PART;
/// Most places of a round, far below what a place's number can count.
const ROUND_MOST: u64 = 1 << 30;

/// What adaptive samples of a picture take beside a path tracer.
pub(super) struct AdaptiveSamples {
    gpu: Gpu,
    kind: Adaptive,
    number: ComputePipeline<path_numbers::Kernel>,
    resolve: ComputePipeline<path_resolve_shares::Kernel>,
    /// By slot the pixel and the sample.
    numbers: TexelView,
    /// On the device, of each band.
    shares: Vec<Buffer>,
    /// Standard deviation of a sample of each pixel, once the pilot is there.
    noise: Option<Vec<f32>>,
    /// Samples of each pixel before the round.
    taken: Vec<u32>,
    round: Option<Round>,
    /// Rounds that are left until pixels have the samples asked for.
    rounds: u64,
}

/// A round under way: some samples more for each pixel.
struct Round {
    /// Samples of each pixel behind it.
    shares: Vec<u32>,
    /// Of each band, as on the device.
    places: Vec<Vec<PathShare>>,
}

/// Samples per pixel of the pilot of a picture of so many; 0 where it has none.
fn pilot_samples(samples: u32) -> u32 {
    if samples < SAMPLES_LEAST {
        return 0;
    }
    let most = (samples / PILOT_PART).clamp(2, PILOT_MOST);
    1 << most.ilog2()
}

impl AdaptiveSamples {
    /// Of a film, with `numbers` for each slot of a wave.
    pub fn new(gpu: &Gpu, settings: &super::PathTracerSettings, film: &GpuFilm, numbers: TexelView) -> Result<Self> {
        let of_band = |band: &FilmBand| {
            let bytes = (u64::from(band.pixels()) + 1) * size_of::<PathShare>() as u64;
            gpu.buffer(&BufferDesc::storage("path shares", bytes, Category::Film))
        };
        let mut samples = Self {
            gpu: gpu.clone(),
            kind: settings.adaptive,
            number: gpu.compute_pipeline(&())?,
            resolve: gpu.compute_pipeline(&path_resolve_shares::Spec {
                write_aovs: settings.aovs,
            })?,
            numbers,
            shares: film.bands().iter().map(of_band).collect::<Result<_>>()?,
            noise: None,
            taken: Vec::new(),
            round: None,
            rounds: 0,
        };
        samples.restart(film);
        Ok(samples)
    }

    /// Forgets all samples.
    pub fn restart(&mut self, film: &GpuFilm) {
        let [width, height] = film.size();
        self.taken = vec![0; width as usize * height as usize];
        (self.noise, self.round) = (None, None);
        self.rounds = 0;
    }

    /// The kernels of their own.
    pub fn pipelines(&self) -> [PipelineInfo; 2] {
        [self.number.info(), self.resolve.info()]
    }

    /// The next wave of at most `slots` paths of the round under way, and where the one after it begins; `None` where the round is done.
    pub fn next_wave(&self, cursor: &Cursor, film: &GpuFilm, slots: u32) -> Option<(Wave, Cursor)> {
        let round = self.round.as_ref()?;
        let mut c = *cursor;
        while round.places.get(c.band).is_some_and(|of| end_of(of) == c.in_band) {
            (c.band, c.in_band) = (c.band + 1, 0);
        }
        let (shares, band) = (round.places.get(c.band)?, film.bands().get(c.band)?);
        let (first, mut end) = (c.in_band, end_of(shares).min(c.in_band.saturating_add(slots)));
        let first_pixel = share_at(shares, first, 0, band.pixels());
        let mut last_pixel = share_at(shares, end - 1, first_pixel, band.pixels() - first_pixel);
        // The resolve stage goes through a pixel's samples one by one.
        let of_wave = first_pixel..=last_pixel;
        for (pixel, share) in of_wave.zip(shares[first_pixel as usize..].windows(2)) {
            let most = share[0].first_place.max(first).saturating_add(SAMPLES_PER_WAVE);
            if share[1].first_place.min(end) > most {
                (end, last_pixel) = (most, pixel);
                break;
            }
        }
        let wave = Wave {
            band: c.band,
            first_pixel: band.first_pixel() + first_pixel,
            pixels: last_pixel - first_pixel + 1,
            first_sample: 0,
            samples: 0,
            places: Some(Places {
                first,
                count: end - first,
            }),
        };
        c.in_band = end;
        c.done += u64::from(end - first);
        Some((wave, c))
    }

    /// Begins a round towards `samples` samples per pixel on average, all before it being on the film; false where there is nothing to do.
    pub fn begin_round(&mut self, film: &GpuFilm, slots: u32, samples: u32) -> Result<bool> {
        if let Some(round) = self.round.take() {
            self.taken = round.shares;
        }
        let pixels = self.taken.len() as u64;
        let done: u64 = self.taken.iter().map(|taken| u64::from(*taken)).sum();
        let wanted = u64::from(samples) * pixels;
        let pilot = pilot_samples(samples);
        // Until there is a noise, all pixels have as many.
        let even = self.taken[0];
        if done >= wanted {
            return Ok(false);
        }
        if self.noise.is_none() && pilot > 0 && even >= pilot {
            let variances = variances(&film.picture()?.0, self.kind)?;
            self.noise = Some(noise_of_neighbours(&variances, film.size()[0] as usize));
        }
        let shares = match &self.noise {
            None => {
                let towards = if pilot > 0 { pilot } else { samples };
                let next = towards.min(even.saturating_add(samples_of_pass(film, slots, even)));
                vec![next; self.taken.len()]
            }
            Some(noise) => {
                let mut shares = shares(noise, &self.taken, film.size()[0] as usize, samples);
                // Whole pictures early. How many rounds there are is decided where all pixels have as many, or the samples asked for: it must not
                // follow from the noise.
                if self.rounds == 0 {
                    let round = (pixels * u64::from(SAMPLES_TOGETHER)).max(slots.into()).min(ROUND_MOST);
                    self.rounds = ((wanted - done) / round).max(1);
                }
                let rounds = self.rounds;
                self.rounds -= 1;
                for (share, taken) in shares.iter_mut().zip(&self.taken) {
                    let more = u64::from(*share - taken).div_ceil(rounds);
                    *share = taken + more as u32;
                }
                shares
            }
        };
        if shares == self.taken {
            return Ok(false);
        }
        let mut of_bands = Vec::with_capacity(self.shares.len());
        for (band, buffer) in film.bands().iter().zip(&self.shares) {
            let of_band = band.first_pixel() as usize..(band.first_pixel() + band.pixels()) as usize;
            let places = places(&self.taken[of_band.clone()], &shares[of_band]);
            self.gpu.upload(buffer, 0, &places)?;
            of_bands.push(places);
        }
        self.round = Some(Round {
            shares,
            places: of_bands,
        });
        Ok(true)
    }

    /// Records which sample of which pixel each slot of a wave is.
    pub fn record_numbers(&self, recorder: &mut Recorder, band: &FilmBand, wave: &Wave) -> Result<()> {
        let Some(places) = wave.places else { return Ok(()) };
        let push = path_numbers::Push {
            band_pixel: band.first_pixel(),
            first_pixel: wave.first_pixel - band.first_pixel(),
            pixel_count: wave.pixels,
            first_place: places.first,
            slot_count: places.count,
        };
        let numbers = path_numbers::Set0 {
            path_numbers: self.numbers.buffer().view(),
        };
        recorder.pass("path: numbers", |pass| {
            let groups = [self.number.groups_for(places.count), 1, 1];
            pass.dispatch(&self.number, &[&numbers, &self.share_set(wave)], &push, groups)?;
            stage_barrier(pass);
            Ok(())
        })
    }

    /// Adds a wave's samples to a band of the film.
    pub fn resolve(
        &self,
        pass: &mut Pass<'_>,
        walks: &WaveSet<'_>,
        kept: &PathSlotSet<'_>,
        band: &FilmBand,
        wave: &Wave,
    ) -> Result<()> {
        let Some(places) = wave.places else { return Ok(()) };
        let push = path_resolve_shares::Push {
            first_pixel: wave.first_pixel - band.first_pixel(),
            pixel_count: wave.pixels,
            first_place: places.first,
            slot_count: places.count,
        };
        let groups = [self.resolve.groups_for(wave.pixels), 1, 1];
        let shares = self.share_set(wave);
        pass.dispatch(&self.resolve, &[walks, kept, &shares, &band.set()], &push, groups)
    }

    fn share_set(&self, wave: &Wave) -> PathShareSet<'_> {
        PathShareSet {
            path_shares: self.shares[wave.band].view(),
        }
    }
}

/// Rows of the catalogue.
pub(crate) const ROWS: &[Row] = &[Row {
    id: "CL-ADAPTIVE",
    name: "adaptive samples: more where the pilot shows more noise, unbiased",
    role: Role::PartOf("BG-3"),
    limits: "One pilot decides: light that it has not met gets a quarter of the mean number of samples; the spread of samples stands for the noise, which \
             Sobol' points have less of.",
    sources: &[
        sources::NEYMAN_1934.at("optimum allocation"),
        sources::KIRK_ARVO_1991.whole(),
    ],
    shaders: &[
        "shaders/techniques/path/path_numbers.comp",
        "shaders/techniques/path/path_resolve_shares.comp",
    ],
    bias: Some(Bias::Unbiased),
    tests: &[
        "tests/tests/paths/adaptive.rs::pictures_without_a_pilot_are_those_without_adaptivity",
        "tests/tests/paths/adaptive.rs::how_the_work_is_cut_up_never_shows",
        "tests/tests/paths/adaptive.rs::samples_go_where_the_noise_is_and_spend_the_budget",
        "tests/tests/paths/adaptive.rs::more_samples_asked_for_later_keep_those_that_are_there",
        "tests/tests/paths/adaptive.rs::pictures_of_one_pixel_and_without_noise_are_even",
        "tests/tests/paths/adaptive.rs::adaptive_pictures_are_unbiased",
        "tests/tests/paths/adaptive.rs::slots_get_the_samples_of_their_places",
        "engine/src/techniques/path/adaptive.rs::pilots_are_a_quarter_of_the_samples_and_powers_of_two",
        "tests/tests/paths/non_finite.rs::they_are_counted_by_kind_and_left_out",
        "engine/src/techniques/path/adaptive/noise.rs::the_noise_of_a_pixel_is_that_of_the_other_class",
        "engine/src/techniques/path/adaptive/noise.rs::neighbourhoods_are_as_wide_as_few_pixels_have_the_noise",
        "engine/src/techniques/path/adaptive/shares.rs::shares_follow_the_noise_and_spend_the_budget",
        "engine/src/techniques/path/adaptive/shares.rs::without_noise_samples_are_even",
        "engine/src/techniques/path/adaptive/shares.rs::no_pixel_starves",
        "engine/src/techniques/path/adaptive/shares.rs::every_place_belongs_to_one_pixel",
        "engine/src/techniques/path/adaptive/shares.rs::means_are_unbiased_unless_samples_steer_their_own_weight",
    ],
    settings: &["adaptive", "clerestory render --adaptive"],
    ..Row::of(file!())
}];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pilots_are_a_quarter_of_the_samples_and_powers_of_two() {
        let pilots = [1, 7, 8, 16, 31, 64, 100, 1024, 1 << 20].map(pilot_samples);
        assert_eq!(pilots, [0, 0, 2, 4, 4, 16, 16, 256, 256]);
    }
}
