//! Virtual lights that are kept from frame to frame, of points and spots: what the device is asked about them, and their records.
//!
//! Source: S. Laine et al., "Incremental Instant Radiosity for Real-Time Indirect Illumination", EGSR 2007. Which lights go and where new ones come is decided on the host
//! ([`incremental`](crate::techniques::instant_radiosity::incremental)); a frame in which a lamp has moved has a ray for each of its lights, then one for each new light. A frame in which none has
//! moved, and all lights are there, has neither, and no pass.
//!
//! A direction in which a lamp sees nothing, or a mirror, is kept as well, without light: else its share would go to its neighbours.

use std::ops::Range;

use glam::{DVec3, Vec3};

use super::kernels::ray_stopped;
use super::records::LightRecord;
use super::settings::ManyLightSettings;
use crate::accel::NO_HIT;
use crate::gpu::shaders::constants::{KEPT_ABSENT, KEPT_ASKED, KEPT_NEW, KEPT_SEEN, KEPT_STAYS, KEPT_STOPPED};
use crate::gpu::shaders::techniques::instant_radiosity::{kept_lights, kept_rays};
use crate::gpu::shaders::types::{KeptHit, KeptLight};
use crate::gpu::{
    Access, Buffer, BufferDesc, Category, ComputePipeline, Gpu, PipelineInfo, Recorder, SOFTWARE_LOOP_CAP, TexelView,
    Timings,
};
use crate::techniques::instant_radiosity::incremental::{KeptDirections, Lamp};
use crate::transport::environment::luminance;
use crate::transport::random::{Sampler, SamplerKind, sample_2d};
use crate::transport::{GpuScene, surface_spec};
use crate::{Error, Result};

/// Tells the numbers that turn sets of directions from those of other samplers.
const TURN_SEED: u32 = 0x6b65_7074;

/// The lights of all lamps.
pub(super) struct KeptLights {
    rays: ComputePipeline<kept_rays::Kernel>,
    write: ComputePipeline<kept_lights::Kernel>,
    requests: Buffer,
    hits: Buffer,
    records: TexelView,
    /// As the device has them, or is to have them next; one a light.
    asked: Vec<KeptLight>,
    /// None before the first frame, and behind one that failed.
    lamps: Vec<KeptLamp>,
    /// The lamp that new lights go to first.
    turn: usize,
    renewed_max: u32,
    /// Steps through the index after which a ray stops.
    ray_quota: u32,
    seed: u32,
    is_settled: bool,
    /// Some of them have light.
    has_light: bool,
    /// Lights whose shadow map is not that of where they are.
    unmapped: Vec<bool>,
}

struct KeptLamp {
    lamp: Lamp,
    directions: KeptDirections,
    /// By number of the direction.
    ways: Vec<Way>,
}

/// From a lamp to a light.
struct Way {
    light: u32,
    direction: DVec3,
    /// Where it ends; `None` beyond the scene.
    end: Option<DVec3>,
}

/// What a frame has done for kept lights.
#[derive(Default)]
pub(super) struct Kept {
    pub timings: Vec<Timings>,
    pub passes: u64,
    /// That told whether lamps see lights.
    pub rays: u64,
    pub renewed: u64,
}

/// Why the lights of a scene cannot be kept.
fn refusals(scene: &GpuScene) -> Vec<String> {
    let is_parallel = scene.lights_without_area().iter().any(|kind| Lamp::new(kind).is_none());
    let all = [
        (scene.has_area_lights(), "a light has an area"),
        (scene.profile().has_environment(), "the environment shines"),
        (is_parallel, "a light is parallel"),
    ];
    let found = all.into_iter().filter(|(is_so, _)| *is_so);
    found
        .map(|(_, what)| {
            format!("{what}, and placement = \"incremental\" keeps the virtual lights of points and spots only")
        })
        .collect()
}

/// How many of `count` lights each lamp has: one, and of the rest as many as its share of the power.
fn numbers_of_lights(count: usize, powers: &[f64]) -> Vec<usize> {
    let (rest, all): (usize, f64) = (count - powers.len(), powers.iter().sum());
    let (mut sum, mut given) = (0.0, 0);
    powers
        .iter()
        .map(|power| {
            sum += power / all * rest as f64;
            let up_to = (sum.round() as usize).clamp(given, rest);
            let own = up_to - given;
            given = up_to;
            1 + own
        })
        .collect()
}

impl KeptLights {
    pub fn new(gpu: &Gpu, scene: &GpuScene, settings: &ManyLightSettings) -> Result<Self> {
        let reasons = refusals(scene);
        if !reasons.is_empty() {
            return Err(Error::Unsupported {
                technique: "many-light".into(),
                reasons,
            });
        }
        let (count, lamps) = (settings.lights as usize, scene.lights_without_area().len());
        if lamps > count {
            let cause = format!("are fewer than the scene's {lamps} lamps");
            return Err(Error::setting("lights", settings.lights, cause));
        }
        // The rest is for what a ray finds.
        let each = SOFTWARE_LOOP_CAP / 2;
        let (index, filters) = (scene.filtered_index_within(gpu, each)?, scene.profile().has_alpha());
        let rays = surface_spec!(kept_rays, scene, {
            has_multiple_scattering: false,
            has_alpha: filters,
            index_quota: index.quota,
            index_kind: index.kind,
            ..Default::default()
        });
        let write = surface_spec!(kept_lights, scene, {
            has_multiple_scattering: false,
            has_alpha: false,
            ..Default::default()
        });
        let storage = |name, bytes: usize| {
            let bytes = (count * bytes) as u64;
            gpu.buffer(&BufferDesc::storage(name, bytes, Category::Light))
        };
        Ok(Self {
            rays: scene.index_traversal().pipeline(gpu, &rays)?,
            write: gpu.compute_pipeline(&write)?,
            requests: storage("requests of kept lights", size_of::<KeptLight>())?,
            hits: storage("ends of kept lights' ways", size_of::<KeptHit>())?,
            records: LightRecord::texels(gpu, settings.lights)?,
            asked: vec![bytemuck::Zeroable::zeroed(); count],
            lamps: Vec::new(),
            turn: 0,
            renewed_max: settings.renewed,
            ray_quota: index.quota,
            seed: settings.seed ^ TURN_SEED,
            is_settled: false,
            has_light: false,
            unmapped: vec![false; count],
        })
    }

    /// Forgets all lights.
    pub fn set_seed(&mut self, seed: u32) {
        self.seed = seed ^ TURN_SEED;
        self.forget();
    }

    fn forget(&mut self) {
        self.lamps.clear();
        (self.is_settled, self.has_light) = (false, false);
        self.unmapped.fill(false);
    }

    pub fn records(&self) -> &TexelView {
        &self.records
    }

    /// Beside the records.
    pub fn bytes(&self) -> u64 {
        self.requests.bytes() + self.hits.bytes()
    }

    pub fn pipelines(&self) -> Vec<PipelineInfo> {
        vec![self.rays.info(), self.write.info()]
    }

    /// How many a frame has, with those that have no light; none where none has.
    pub fn count(&self) -> u32 {
        if self.has_light { self.asked.len() as u32 } else { 0 }
    }

    /// The next lights from one on whose shadow map is not that of where they are.
    pub fn unmapped(&self, from: u32) -> Option<Range<u32>> {
        let is_unmapped = |light: &u32| self.unmapped.get(*light as usize).copied().unwrap_or(false);
        let first = (from..self.asked.len() as u32).find(is_unmapped)?;
        let end = (first..).find(|light| !is_unmapped(light))?;
        Some(first..end)
    }

    /// Shadow maps of these lights were drawn.
    pub fn have_maps(&mut self, lights: Range<u32>) {
        let lights = lights.start as usize..(lights.end as usize).min(self.unmapped.len());
        if let Some(drawn) = self.unmapped.get_mut(lights) {
            drawn.fill(false);
        }
    }

    /// Makes the lights those of the lamps as they are now. Two bounded submissions at most; waits for the device.
    pub fn keep(&mut self, gpu: &Gpu, scene: &GpuScene) -> Result<Kept> {
        let kept = self.try_to_keep(gpu, scene);
        if kept.is_err() {
            // What is known no longer tells of what the device has.
            self.forget();
        }
        kept
    }

    fn try_to_keep(&mut self, gpu: &Gpu, scene: &GpuScene) -> Result<Kept> {
        let mut done = Kept::default();
        let is_first = self.lamps.is_empty();
        let (mut moved, mut rays) = (false, 0);
        if is_first {
            self.lamps = self.spread(scene);
        } else {
            (moved, rays) = self.follow_lamps(scene);
        }
        let is_as_before = !is_first && !moved && self.is_settled;
        if is_as_before || self.lamps.is_empty() {
            return Ok(done);
        }
        done.rays = rays;
        if done.rays > 0 {
            gpu.upload(&self.requests, 0, &self.asked)?;
            submit(gpu, &mut done, |recorder| self.record_rays(recorder, scene))?;
            self.drop_hidden(&self.read_hits(gpu)?)?;
        }
        let new = self.renew(is_first);
        done.renewed = new.iter().map(|of_lamp| of_lamp.len() as u64).sum();
        self.ask_for(&new);
        gpu.upload(&self.requests, 0, &self.asked)?;
        let has_new = done.renewed > 0;
        submit(gpu, &mut done, |recorder| {
            if has_new {
                self.record_rays(recorder, scene)?;
            }
            self.record_lights(recorder, scene)
        })?;
        if has_new {
            self.learn(&new, &self.read_hits(gpu)?)?;
        }
        self.has_light = self.lamps.iter().any(KeptLamp::has_light);
        Ok(done)
    }

    /// Lamps with new directions. Consecutive lights are of all lamps, so that every range of them is.
    fn spread(&self, scene: &GpuScene) -> Vec<KeptLamp> {
        let lamps: Vec<Lamp> = scene.lights_without_area().iter().filter_map(Lamp::new).collect();
        let powers: Vec<f64> = lamps.iter().map(|lamp| luminance(lamp.power())).collect();
        let numbers = numbers_of_lights(self.asked.len(), &powers);
        let mut order: Vec<(f64, usize)> = Vec::with_capacity(self.asked.len());
        for (lamp, count) in numbers.iter().enumerate() {
            order.extend((0..*count).map(|i| ((i as f64 + 0.5) / *count as f64, lamp)));
        }
        order.sort_by(|(a, of_a), (b, of_b)| a.total_cmp(b).then(of_a.cmp(of_b)));
        let mut found: Vec<KeptLamp> = (0..)
            .zip(lamps.iter().zip(&numbers))
            .map(|(number, (lamp, count))| {
                let mut numbers = Sampler {
                    pixel: number,
                    sample_index: 0,
                    dimension: 0,
                    seed: self.seed,
                };
                let [first, second] = [(); 2].map(|()| sample_2d(&mut numbers, SamplerKind::Pcg));
                let numbers = [first.x, first.y, second.x, second.y];
                KeptLamp {
                    lamp: *lamp,
                    directions: KeptDirections::spread(lamp.domain(), *count as u32, numbers),
                    ways: Vec::with_capacity(*count),
                }
            })
            .collect();
        for (light, (_, lamp)) in (0..).zip(&order) {
            found[*lamp].ways.push(Way {
                light,
                direction: DVec3::Z,
                end: None,
            });
        }
        found
    }

    /// Sees lights from where their lamps are now, drops those that these do not shine at, and asks about the others: whether a lamp has moved, and
    /// by how many rays.
    fn follow_lamps(&mut self, scene: &GpuScene) -> (bool, u64) {
        self.asked.iter_mut().for_each(|light| light.asks = KEPT_STAYS);
        let now = scene.lights_without_area();
        let now = now.iter().filter_map(Lamp::new);
        let (mut moved, mut rays) = (false, 0);
        for (kept, lamp) in self.lamps.iter_mut().zip(now) {
            if kept.lamp == lamp {
                continue;
            }
            moved = true;
            kept.lamp = lamp;
            for (number, way) in kept.ways.iter_mut().enumerate() {
                if kept.directions.points()[number].is_none() {
                    continue;
                }
                if let Some(end) = way.end {
                    way.direction = (end - lamp.position()).normalize_or_zero();
                }
                let point = lamp.point_of(way.direction);
                kept.directions.set(number, point);
                if point.is_some() {
                    self.asked[way.light as usize] = KeptLight {
                        lamp: lamp.position().as_vec3().to_array(),
                        asks: KEPT_ASKED,
                        direction: way.direction.as_vec3().to_array(),
                        power: [0.0; 3],
                    };
                    rays += 1;
                }
            }
        }
        (moved, rays)
    }

    fn drop_hidden(&mut self, hits: &[KeptHit]) -> Result<()> {
        for kept in &mut self.lamps {
            for (number, way) in kept.ways.iter().enumerate() {
                let light = way.light as usize;
                if self.asked[light].asks != KEPT_ASKED {
                    continue;
                }
                match hits[light].sight {
                    KEPT_SEEN => {}
                    KEPT_STOPPED => return Err(ray_stopped("kept_rays", self.ray_quota)),
                    _ => kept.directions.set(number, None),
                }
            }
        }
        Ok(())
    }

    /// Numbers of the directions that are new, by lamp: all of a first frame, else as many as the quota has.
    fn renew(&mut self, is_first: bool) -> Vec<Vec<usize>> {
        if is_first {
            self.is_settled = true;
            return self.lamps.iter().map(|kept| (0..kept.ways.len()).collect()).collect();
        }
        let lamps = self.lamps.len();
        let mut new = vec![Vec::new(); lamps];
        let mut left = self.renewed_max as usize;
        self.is_settled = true;
        for i in 0..lamps {
            let number = (self.turn + i) % lamps;
            let renewed = self.lamps[number].directions.renew(left);
            left -= renewed.points.len();
            self.is_settled &= renewed.is_settled;
            new[number] = renewed.points;
        }
        self.turn = (self.turn + 1) % lamps.max(1);
        new
    }

    /// What the device is to know of all lights, and of which it finds where they are.
    fn ask_for(&mut self, new: &[Vec<usize>]) {
        let count = self.asked.len() as f64;
        for (kept, new) in self.lamps.iter_mut().zip(new) {
            let points = kept.directions.points();
            let mut asks: Vec<u32> = points
                .iter()
                .map(|point| if point.is_some() { KEPT_STAYS } else { KEPT_ABSENT })
                .collect();
            for number in new {
                if let Some(point) = points[*number] {
                    asks[*number] = KEPT_NEW;
                    kept.ways[*number].direction = kept.lamp.direction_of(point);
                }
            }
            let shares = kept.directions.shares();
            for ((way, asks), share) in kept.ways.iter().zip(asks).zip(shares) {
                self.asked[way.light as usize] = KeptLight {
                    lamp: kept.lamp.position().as_vec3().to_array(),
                    asks,
                    direction: way.direction.as_vec3().to_array(),
                    power: (kept.lamp.power() * share * count).as_vec3().to_array(),
                };
            }
        }
    }

    /// Where new ways end.
    fn learn(&mut self, new: &[Vec<usize>], hits: &[KeptHit]) -> Result<()> {
        for (kept, new) in self.lamps.iter_mut().zip(new) {
            for number in new {
                let way = &mut kept.ways[*number];
                let hit = &hits[way.light as usize];
                if hit.sight == KEPT_STOPPED {
                    return Err(ray_stopped("kept_rays", self.ray_quota));
                }
                let is_there = hit.triangle != NO_HIT;
                way.end = is_there.then(|| Vec3::from_array(hit.position).as_dvec3());
                self.unmapped[way.light as usize] = is_there;
            }
        }
        Ok(())
    }

    fn read_hits(&self, gpu: &Gpu) -> Result<Vec<KeptHit>> {
        gpu.read(self.hits.view(), self.asked.len())
    }

    /// The rays that were asked for.
    fn record_rays(&self, recorder: &mut Recorder, scene: &GpuScene) -> Result<()> {
        recorder.pass("many-light: rays of kept lights", |pass| {
            pass.memory_barrier(Access::COMPUTE, Access::COMPUTE);
            let push = kept_rays::Push {
                lights: self.asked.len() as u32,
            };
            let set = kept_rays::Set0 {
                virtual_light_texels: &self.records,
                kept_lights: self.requests.view(),
                kept_hits: self.hits.view(),
            };
            let groups = self.rays.groups_over(self.asked.len() as u32);
            let (index, scene) = (scene.index_set(), scene.scene_set());
            pass.dispatch(&self.rays, &[&set, &index, &scene], &push, groups)?;
            pass.memory_barrier(Access::COMPUTE, Access::COMPUTE | Access::TRANSFER_READ);
            Ok(())
        })
    }

    fn record_lights(&self, recorder: &mut Recorder, scene: &GpuScene) -> Result<()> {
        let [lower, upper] = scene.bounds().map(|corner| corner.to_array());
        recorder.pass("many-light: kept lights", |pass| {
            pass.memory_barrier(Access::COMPUTE, Access::COMPUTE);
            let push = kept_lights::Push {
                scene_lower: lower,
                lights: self.asked.len() as u32,
                scene_upper: upper,
            };
            let set = kept_lights::Set0 {
                kept_lights: self.requests.view(),
                kept_hits: self.hits.view(),
                virtual_light_records: self.records.buffer().view(),
            };
            let groups = self.write.groups_over(self.asked.len() as u32);
            pass.dispatch(&self.write, &[&set, &scene.scene_set()], &push, groups)?;
            pass.memory_barrier(Access::COMPUTE, Access::COMPUTE | Access::TRANSFER_READ);
            Ok(())
        })
    }
}

impl KeptLamp {
    fn has_light(&self) -> bool {
        let mut directions = self.directions.points().iter().zip(&self.ways);
        directions.any(|(point, way)| point.is_some() && way.end.is_some())
    }
}

/// Records into a command buffer of its own, waits, and counts the passes.
fn submit(gpu: &Gpu, done: &mut Kept, record: impl FnOnce(&mut Recorder) -> Result<()>) -> Result<()> {
    let mut recorder = gpu.recorder("kept lights")?;
    let left = recorder.passes_left();
    record(&mut recorder)?;
    done.passes += (left - recorder.passes_left()) as u64;
    done.timings.push(recorder.submit()?.wait()?);
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_lamp_has_a_light_and_bright_ones_have_most() {
        for (count, powers, expected) in [
            (8, vec![1.0], vec![8]),
            (3, vec![1.0, 1e6, 1.0], vec![1, 1, 1]),
            (11, vec![1.0, 3.0, 0.0], vec![3, 7, 1]),
            (64, vec![1.0, 1.0], vec![32, 32]),
        ] {
            let found = numbers_of_lights(count, &powers);
            assert_eq!(found, expected, "{count} {powers:?}");
            assert_eq!(found.iter().sum::<usize>(), count);
        }
    }
}
