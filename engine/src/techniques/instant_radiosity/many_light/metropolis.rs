//! Virtual lights that chains have chosen by what they bring to the picture, each of which then brings as much as every other.
//!
//! Sources: B. Segovia, J.-C. Iehl and B. Péroche, "Metropolis Instant Radiosity", Eurographics 2007; J. Liu, F. Liang and W. Wong, "The Multiple-Try Method and Local Optimization
//! in Metropolis Sampling", JASA 95, 2000; C. Kelemen et al., "A Simple and Robust Mutation Strategy for the Metropolis Light Transport Algorithm", Eurographics 2002.
//!
//! A frame's walks leave a pool of virtual lights. A state of a chain is a pixel and a light of the pool; its density is the luminance that this brings there, seen by a ray. So
//! the lights that chains stop at are distributed as the power that they send to the camera. What tries anywhere bring on average tells that of the whole
//! pool, P; chains begin at some of those tries, chosen by what they bring. In the end each chosen light's own power P′ is measured at some pixels, and the light weighted by P/(n P′),
//! so that all n bring as much.
//!
//! The source's chains make their paths from the camera, light by light; here they choose among lights that walks have left, of which a new pool is drawn for every frame.

use super::kernels::{Sight, ray_stopped};
use super::records::LightRecord;
use super::settings::{ManyLightSettings, Visibility};
use crate::Result;
use crate::gpu::shaders::constants::{
    METROPOLIS_POWERS, METROPOLIS_PROPOSALS, METROPOLIS_REFERENCES, METROPOLIS_SEEDS, VISIBILITY_NONE, VISIBILITY_RAYS,
};
use crate::gpu::shaders::techniques::instant_radiosity::{metropolis_accept, metropolis_lights, metropolis_try};
use crate::gpu::shaders::types::MetropolisTry;
use crate::gpu::{
    Access, Buffer, BufferDesc, Category, ComputePipeline, Gpu, Pass, PipelineInfo, Recorder, SOFTWARE_LOOP_CAP,
    TexelView,
};
use crate::techniques::Part;
use crate::techniques::photon_mapping::PhotonTracer;
use crate::transport::edge_bound::EdgeBound;
use crate::transport::random::{Sampler, SamplerKind, pcg4d, sample_1d, sample_2d};
use crate::transport::{GpuScene, surface_spec};
use glam::UVec4;

/// Tells the numbers of chains from those of other samplers.
const CHAIN_SEED: u32 = 0x6d65_7472;
/// Tries anywhere: what they bring tells the power of the pool to a tenth or so where one in a hundred brings anything, and to a hundredth where most do.
const SEEDS: u32 = 16_384;
/// Chains, of as many lights at least.
const CHAINS_MAX: u32 = 64;
/// Tries of a submission that measures lights.
const TRIES_AT_ONCE: u32 = 1 << 16;

/// The pool's walks, the chains, and the lights that they have chosen.
pub(super) struct Metropolis {
    pub tracer: PhotonTracer,
    tries: ComputePipeline<metropolis_try::Kernel>,
    accept: ComputePipeline<metropolis_accept::Kernel>,
    write: ComputePipeline<metropolis_lights::Kernel>,
    tried: Buffer,
    states: Buffer,
    chosen: Buffer,
    pixels: Buffer,
    weights: Buffer,
    counters: Buffer,
    records: TexelView,
    bound: EdgeBound,
    lights: u32,
    walks: u32,
    chains: u32,
    tries_a_step: u32,
    steps_a_light: u32,
    power_pixels: u32,
    seed: u32,
    /// Steps through the index after which a ray stops.
    ray_quota: u32,
    /// Tries anywhere, steps of chains, and tries that measure lights, of a submission.
    at_once: [u32; 3],
}

/// The chains of a frame, and what of them comes next.
pub(super) struct Chains {
    frame: u32,
    /// Of the picture, pixels.
    size: [u32; 2],
    pool: u32,
    next: Next,
    /// What a light of the pool brings to a pixel on average, as if its walk were the only one.
    mean: f64,
    /// Of each chosen light the same.
    powers: Vec<f64>,
    /// Some of them bring something.
    brings: bool,
}

enum Next {
    /// From that try on.
    Seeds(u32),
    Steps(u32),
    /// From that try on.
    Powers(u32),
    Lights,
    Ended {
        lights: u32,
    },
}

impl Chains {
    /// Of a frame of `size` pixels with so many lights in its pool.
    pub fn new(frame: u32, size: [u32; 2], pool: u32) -> Self {
        Self {
            frame,
            size,
            pool,
            next: Next::Seeds(0),
            mean: 0.0,
            powers: Vec::new(),
            brings: false,
        }
    }

    /// How many lights have been placed once all is done: none where the pool brings nothing.
    pub fn ended(&self) -> Option<u32> {
        match self.next {
            Next::Ended { lights } => Some(lights),
            _ => None,
        }
    }
}

impl Metropolis {
    pub fn new(gpu: &Gpu, scene: &GpuScene, settings: &ManyLightSettings, tracer: PhotonTracer) -> Result<Self> {
        let bound = settings.edge_bound(scene.surface_area());
        let index = scene.filtered_index_within(gpu, SOFTWARE_LOOP_CAP / 2)?;
        let spec = surface_spec!(metropolis_try, scene, {
            has_multiple_scattering: scene.bsdf_features().multiple_scattering,
            separable_masking: false,
            has_alpha: scene.profile().has_alpha(),
            edge_bound: bound.kind(),
            // By rays also where maps tell pixels.
            visibility: if settings.visibility == Visibility::None {
                VISIBILITY_NONE
            } else {
                VISIBILITY_RAYS
            },
            index_quota: index.quota,
            index_kind: index.kind,
            ..Default::default()
        });
        let chains = settings.lights.min(CHAINS_MAX);
        let of_step = chains * (2 * settings.tries - 1);
        let steps = settings.lights.div_ceil(chains) * settings.mutations;
        let measures = settings.lights * settings.power_pixels;
        let storage = |name, count: u32, bytes: usize| {
            let bytes = u64::from(count) * bytes as u64;
            gpu.buffer(&BufferDesc::storage(name, bytes, Category::Light))
        };
        let counters = size_of::<metropolis_try::MetropolisCounters>();
        Ok(Self {
            tracer,
            tries: scene.index_traversal().pipeline(gpu, &spec)?,
            accept: gpu.compute_pipeline(&Default::default())?,
            write: gpu.compute_pipeline(&Default::default())?,
            tried: storage(
                "tries of chains",
                SEEDS.max(of_step).max(TRIES_AT_ONCE),
                size_of::<MetropolisTry>(),
            )?,
            states: storage("states of chains", chains, size_of::<MetropolisTry>())?,
            chosen: storage("chosen lights", settings.lights, size_of::<u32>())?,
            pixels: storage("pixels that measure lights", settings.power_pixels, size_of::<u32>())?,
            weights: storage("weights of chosen lights", settings.lights, size_of::<f32>())?,
            counters: storage("counters of chains", 1, counters)?,
            records: LightRecord::texels(gpu, settings.lights)?,
            bound,
            lights: settings.lights,
            walks: settings.pool,
            chains,
            tries_a_step: settings.tries,
            steps_a_light: settings.mutations,
            power_pixels: settings.power_pixels,
            seed: settings.seed,
            ray_quota: index.quota,
            at_once: [
                SEEDS.div_ceil(Part::count(gpu, u64::from(SEEDS) * index.steps)),
                steps.div_ceil(Part::count(gpu, u64::from(steps) * u64::from(of_step) * index.steps)),
                measures
                    .div_ceil(Part::count(gpu, u64::from(measures) * index.steps))
                    .min(TRIES_AT_ONCE),
            ]
            .map(|count| count.max(1)),
        })
    }

    pub fn set_seed(&mut self, seed: u32) {
        self.seed = seed;
        self.tracer.set_seed(seed);
    }

    pub fn records(&self) -> &TexelView {
        &self.records
    }

    /// Beside the records and the pool.
    pub fn bytes(&self) -> u64 {
        let all = [
            &self.tried,
            &self.states,
            &self.chosen,
            &self.pixels,
            &self.weights,
            &self.counters,
        ];
        all.map(Buffer::bytes).iter().sum()
    }

    pub fn pipelines(&self) -> Vec<PipelineInfo> {
        let mut all = self.tracer.pipelines();
        all.extend([self.tries.info(), self.accept.info(), self.write.info()]);
        all
    }

    /// What comes next, recorded as one bounded submission: how many rays that are.
    ///
    /// # Errors
    /// [`DeviceLost`](crate::Error::DeviceLost).
    pub fn record(&self, recorder: &mut Recorder, sight: &Sight<'_>, chains: &Chains, is_shown: bool) -> Result<u64> {
        match chains.next {
            Next::Seeds(first) => {
                let range = [first, self.seeds_end(first)];
                recorder.pass("many-light: seeds of chains", |pass| {
                    if !is_shown {
                        sight.seen.show(pass);
                    }
                    if first == 0 {
                        pass.memory_barrier(Access::COMPUTE | Access::TRANSFER_READ, Access::TRANSFER_WRITE);
                        pass.fill(self.counters.view(), 0)?;
                        pass.memory_barrier(Access::TRANSFER_WRITE, Access::COMPUTE);
                    }
                    self.try_range(pass, sight, chains, METROPOLIS_SEEDS, 0, range)
                })?;
                Ok(u64::from(range[1] - first))
            }
            Next::Steps(first) => {
                let end = self.steps_end(first);
                recorder.pass("many-light: chains", |pass| {
                    (first..end).try_for_each(|step| self.record_step(pass, sight, chains, step))
                })?;
                let rays = self.chains * (2 * self.tries_a_step - 1);
                Ok(u64::from(end - first) * u64::from(rays))
            }
            Next::Powers(first) => {
                let range = [first, self.powers_end(first)];
                recorder.pass("many-light: power of lights", |pass| {
                    self.try_range(pass, sight, chains, METROPOLIS_POWERS, 0, range)
                })?;
                Ok(u64::from(range[1] - first))
            }
            Next::Lights => {
                recorder.pass("many-light: chosen lights", |pass| self.record_lights(pass))?;
                Ok(0)
            }
            Next::Ended { .. } => Ok(0),
        }
    }

    /// What was recorded last has been done.
    ///
    /// # Errors
    /// [`Overflow`](crate::Error::Overflow) should the index have rays that never end.
    pub fn learn(&self, gpu: &Gpu, chains: &mut Chains) -> Result<()> {
        chains.next = match chains.next {
            Next::Seeds(first) if self.seeds_end(first) < SEEDS => Next::Seeds(self.seeds_end(first)),
            Next::Seeds(_) => {
                let tried: Vec<MetropolisTry> = gpu.read(self.tried.view(), SEEDS as usize)?;
                chains.mean = tried.iter().map(|found| f64::from(found.brings)).sum::<f64>() / f64::from(SEEDS);
                if chains.mean > 0.0 {
                    let starts = choose(&tried, self.chains, self.numbers(chains.frame));
                    gpu.upload(&self.states, 0, &starts)?;
                    gpu.upload(&self.pixels, 0, &self.some_pixels(chains))?;
                    Next::Steps(0)
                } else {
                    self.check(gpu)?;
                    Next::Ended { lights: 0 }
                }
            }
            Next::Steps(first) => match self.steps_end(first) {
                end if end < self.steps() => Next::Steps(end),
                _ => Next::Powers(0),
            },
            Next::Powers(first) => {
                let end = self.powers_end(first);
                let tried: Vec<MetropolisTry> = gpu.read(self.tried.view(), (end - first) as usize)?;
                chains.powers.resize(self.lights as usize, 0.0);
                for (number, found) in (first..).zip(&tried) {
                    chains.powers[(number / self.power_pixels) as usize] +=
                        f64::from(found.brings) / f64::from(self.power_pixels);
                }
                if end < self.lights * self.power_pixels {
                    Next::Powers(end)
                } else {
                    let (weights, count) = self.weights_of(chains);
                    chains.brings = count > 0;
                    gpu.upload(&self.weights, 0, &weights)?;
                    Next::Lights
                }
            }
            Next::Lights => {
                self.check(gpu)?;
                Next::Ended {
                    lights: if chains.brings { self.lights } else { 0 },
                }
            }
            Next::Ended { lights } => Next::Ended { lights },
        };
        Ok(())
    }

    fn check(&self, gpu: &Gpu) -> Result<()> {
        let counters: Vec<metropolis_try::MetropolisCounters> = gpu.read(self.counters.view(), 1)?;
        match counters[0].stopped {
            0 => Ok(()),
            _ => Err(ray_stopped("metropolis_try", self.ray_quota)),
        }
    }

    /// Weights by which all lights bring as much; 0 for those that bring nothing to the pixels that measure them, in whose place the others bring more. And how many others
    /// there are.
    fn weights_of(&self, chains: &Chains) -> (Vec<f32>, usize) {
        let count = chains.powers.iter().filter(|power| **power > 0.0).count();
        // Of the pool as a whole, over all pixels, with its walks as they are.
        let carried = f64::from(chains.pool) / f64::from(self.walks) * chains.mean;
        let each = carried / count.max(1) as f64;
        // Sums over lights are divided by their number later.
        let weight = |power: &f64| match *power > 0.0 {
            true => (each / power * f64::from(self.lights)) as f32,
            false => 0.0,
        };
        (chains.powers.iter().map(weight).collect(), count)
    }

    /// Of chains, until all lights are chosen.
    fn steps(&self) -> u32 {
        self.lights.div_ceil(self.chains) * self.steps_a_light
    }

    fn seeds_end(&self, first: u32) -> u32 {
        first.saturating_add(self.at_once[0]).min(SEEDS)
    }

    fn steps_end(&self, first: u32) -> u32 {
        first.saturating_add(self.at_once[1]).min(self.steps())
    }

    fn powers_end(&self, first: u32) -> u32 {
        first
            .saturating_add(self.at_once[2])
            .min(self.lights * self.power_pixels)
    }

    fn numbers(&self, frame: u32) -> Sampler {
        Sampler {
            pixel: 0,
            sample_index: frame,
            dimension: 0,
            seed: self.seed ^ CHAIN_SEED,
        }
    }

    /// Pixels that measure lights, evenly spread over the picture and shifted for each frame.
    fn some_pixels(&self, chains: &Chains) -> Vec<u32> {
        let mut shift = Sampler {
            dimension: 1,
            ..self.numbers(chains.frame)
        };
        let shift = sample_2d(&mut shift, SamplerKind::Pcg);
        let [width, height] = chains.size;
        (0..self.power_pixels)
            .map(|number| {
                let mut numbers = Sampler {
                    pixel: 1,
                    ..self.numbers(number)
                };
                let place = (sample_2d(&mut numbers, SamplerKind::Sobol) + shift).fract();
                let [x, y] = [place.x * f64::from(width), place.y * f64::from(height)].map(|place| place as u32);
                y.min(height - 1) * width + x.min(width - 1)
            })
            .collect()
    }

    /// Tries of a kind, in that range, and what comes behind them.
    fn try_range(
        &self,
        pass: &mut Pass<'_>,
        sight: &Sight<'_>,
        chains: &Chains,
        kind: u32,
        step: u32,
        [first, end]: [u32; 2],
    ) -> Result<()> {
        let Sight { scene, seen, from } = sight;
        let [lower, upper] = scene.bounds().map(|corner| corner.to_array());
        let push = metropolis_try::Push {
            seen: *from,
            scene_lower: lower,
            edge_bound: self.bound.value(),
            scene_upper: upper,
            kind,
            first,
            end,
            pool: chains.pool,
            tries: match kind {
                METROPOLIS_POWERS => self.power_pixels,
                _ => self.tries_a_step,
            },
            chains: self.chains,
            step,
            seed: self.seed_of(chains.frame),
        };
        let set = metropolis_try::Set0 {
            virtual_light_texels: self.tracer.records(),
            seen_triangles: seen.triangles()?,
            seen_weights: seen.weights()?,
            metropolis_tries: self.tried.view(),
            metropolis_states: self.states.view(),
            metropolis_chosen: self.chosen.view(),
            metropolis_pixels: self.pixels.view(),
            metropolis_counters: self.counters.view(),
        };
        let groups = self.tries.groups_over(end - first);
        let (index, scene) = (scene.index_set(), scene.scene_set());
        pass.dispatch(&self.tries, &[&set, &index, &scene], &push, groups)?;
        pass.memory_barrier(Access::COMPUTE, Access::COMPUTE | Access::TRANSFER_READ);
        Ok(())
    }

    /// A step of all chains: proposals, references about those that are chosen, acceptance; behind the last step of a light, that is kept.
    fn record_step(&self, pass: &mut Pass<'_>, sight: &Sight<'_>, chains: &Chains, step: u32) -> Result<()> {
        let all = self.chains;
        self.try_range(
            pass,
            sight,
            chains,
            METROPOLIS_PROPOSALS,
            step,
            [0, all * self.tries_a_step],
        )?;
        if self.tries_a_step > 1 {
            let references = all * (self.tries_a_step - 1);
            self.try_range(pass, sight, chains, METROPOLIS_REFERENCES, step, [0, references])?;
        }
        let push = metropolis_accept::Push {
            tries: self.tries_a_step,
            chains: all,
            step,
            seed: self.seed_of(chains.frame),
            keeps: (step % self.steps_a_light == self.steps_a_light - 1).into(),
            first: step / self.steps_a_light * all,
            lights: self.lights,
        };
        let set = metropolis_accept::Set0 {
            metropolis_tries: self.tried.view(),
            metropolis_states: self.states.view(),
            metropolis_chosen: self.chosen.view(),
        };
        pass.dispatch(&self.accept, &[&set], &push, self.accept.groups_over(all))?;
        pass.memory_barrier(Access::COMPUTE, Access::COMPUTE | Access::TRANSFER_READ);
        Ok(())
    }

    fn record_lights(&self, pass: &mut Pass<'_>) -> Result<()> {
        pass.memory_barrier(Access::COMPUTE | Access::TRANSFER_READ, Access::COMPUTE);
        let push = metropolis_lights::Push { lights: self.lights };
        let set = metropolis_lights::Set0 {
            virtual_light_texels: self.tracer.records(),
            metropolis_chosen: self.chosen.view(),
            metropolis_weights: self.weights.view(),
            virtual_light_records: self.records.buffer().view(),
        };
        pass.dispatch(&self.write, &[&set], &push, self.write.groups_over(self.lights))?;
        pass.memory_barrier(Access::COMPUTE, Access::COMPUTE | Access::TRANSFER_READ);
        Ok(())
    }

    fn seed_of(&self, frame: u32) -> u32 {
        pcg4d(UVec4::new(self.seed ^ CHAIN_SEED, frame, 0, 0)).x
    }
}

/// As many of the tries, chosen by what they bring, at even steps from a number on.
fn choose(tried: &[MetropolisTry], count: u32, mut numbers: Sampler) -> Vec<MetropolisTry> {
    let u = sample_1d(&mut numbers, SamplerKind::Pcg);
    let total: f64 = tried.iter().map(|found| f64::from(found.brings)).sum();
    let mut chosen = Vec::with_capacity(count as usize);
    let mut sum = 0.0;
    for found in tried {
        sum += f64::from(found.brings);
        while chosen.len() < count as usize && sum * f64::from(count) > (chosen.len() as f64 + u) * total {
            chosen.push(*found);
        }
    }
    chosen
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tries_are_chosen_as_often_as_they_bring() {
        let of = |brings| MetropolisTry {
            pixel: 0,
            light: brings as u32,
            brings,
        };
        let tried: Vec<_> = [1.0, 0.0, 3.0, 4.0].map(of).into();
        for seed in 0..20 {
            let numbers = Sampler {
                pixel: 0,
                sample_index: 0,
                dimension: 0,
                seed,
            };
            let chosen = choose(&tried, 16, numbers);
            let count = |light| chosen.iter().filter(|found| found.light == light).count();
            assert_eq!([1, 0, 3, 4].map(count), [2, 0, 6, 8]);
        }
    }
}
