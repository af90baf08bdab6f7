//! A progressive rendering by instant radiosity: pass after pass, walks from the lights that leave virtual lights, and eye paths that all of them light.
//!
//! Sources: A. Keller, "Instant Radiosity", SIGGRAPH 1997; T. Kollig and A. Keller, "Illumination in the Presence of Weak Singularities", Monte Carlo and
//! Quasi-Monte Carlo Methods 2004, 2006.
//!
//! Light paths are parted without overlap. The eye paths are the path tracer's: light seen through mirrors alone, and the light that arrives directly where the eye first
//! sees a surface that is none. What arrives there after one scattering or more comes from the virtual lights, as far as the bound of the geometry term leaves it;
//! beyond, eye paths go on with the weight of what it left out, and gather again where they arrive. Light off a mirror or through smooth glass onto the first
//! rough surface is no part of the picture: no virtual light lies on either.
//!
//! In media collisions of walks are virtual lights as well, and eye paths gather at a collision of their ray or at the surface, as free flights choose. A
//! collision scatters by the medium's phase function, and the geometry term has no cosine there. What a mirror sends into a medium is the eye paths', which go on from their
//! collisions.
//!
//! Guarantees: deterministic in (seed, pass, walk) and (seed, pixel, sample), on any number of threads; unbiased on its path set without a bound and with a compensated
//! one, since passes have virtual lights of their own, each an unbiased estimate for all pixels at once; but for walks that go on over surfaces whose shading normals
//! lean, as those bend towards the light on a walk and towards the eye on the path tracer's paths. Pixels share the noise of a pass.

use std::sync::Arc;
use std::time::Instant;

use super::append::LightAppend;
use super::card::refusals;
use super::cut_tree::CutTree;
use super::gather::{Gather, GatherStage, VirtualLightCounts};
use super::medium_lights::MediumLights;
use super::settings::{Selection, VirtualLightSettings};
use crate::film::picture::{NonFiniteSamples, Picture};
use crate::film::{PixelFormat, Step};
use crate::gpu::shaders::constants::VIRTUAL_LIGHT_QUARTERS;
use crate::gpu::shaders::types::SceneLightNode;
use crate::gpu::{Buffer, Gpu, PipelineInfo, seconds_or_waited};
use crate::scene::{Camera, SceneProfile};
use crate::settings::TypedSettings;
use crate::techniques::path::PathCounters;
use crate::techniques::photon_mapping::{Append, PhotonCounts, PhotonPlan, PhotonTracer, Stored, Tracing};
use crate::techniques::{PathTracer, PathTracerSettings};
use crate::transport::random::pcg4d;
use crate::transport::{GpuScene, PathSet};
use crate::walk::ArrivalStage;
use crate::{Error, Result};
use glam::{UVec4, Vec3};

/// Scatterings that a connection adds to those of a walk: at the virtual light, and where it shines on.
const CONNECTED: u32 = 2;

/// What alpha is drawn by on the ways to a pass's virtual lights: independent from pass to pass.
fn seed_of_pass(seed: u32, pass: u32) -> u32 {
    pcg4d(UVec4::new(seed, pass, 0, 0)).x
}

/// Exact counts.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, serde::Serialize)]
#[non_exhaustive]
pub struct PassCounts {
    /// Passes that had virtual lights of their own; 0 where the picture has nothing of one.
    pub passes: u64,
    /// Walks of all passes.
    pub walks: PhotonCounts,
    /// Virtual lights of all passes.
    pub lights: u64,
    /// What they were asked for.
    pub gather: VirtualLightCounts,
}

/// A virtual light, as walks have left it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct VirtualLight {
    /// Place, m.
    pub position: Vec3,
    /// Geometric normal, to the side that the power came from; zero for a collision with a medium.
    pub normal: Vec3,
    /// Power that arrives there, W; at a collision that which is scattered.
    pub power: Vec3,
    /// How often it had been scattered before.
    pub bounce: u32,
}

/// A progressive rendering of one view by virtual lights.
pub struct VirtualLights {
    gpu: Gpu,
    scene: Arc<GpuScene>,
    settings: VirtualLightSettings,
    path_set: PathSet,
    eye: PathTracer,
    /// None where the picture has nothing of virtual lights.
    lights: Option<Lights>,
    counts: PassCounts,
}

struct Lights {
    tracer: PhotonTracer,
    gather: Gather,
    /// Where lights are chosen by cuts.
    tree: Option<CutTree>,
    /// The walks of the pass under way, until all have ended.
    tracing: Option<Tracing>,
    /// How many virtual lights there are in the pass under way.
    count: Option<u32>,
}

impl VirtualLights {
    /// Prepares a rendering of `size` pixels.
    ///
    /// # Errors
    /// [`Error::Setting`] for a setting or size out of range, or one that is not for a scene with participating media, [`Error::Unsupported`] for a scene with unlit
    /// surfaces, an endless medium that emits everywhere, or one with light from infinity, [`Error::LimitExceeded`] for a ray index whose leaves are too long for a
    /// software device and for media that emit among bodies of more than 8,192 triangles, [`Error::OutOfMemory`].
    pub fn new(
        gpu: &Gpu,
        scene: Arc<GpuScene>,
        camera: &Camera,
        size: [u32; 2],
        settings: VirtualLightSettings,
    ) -> Result<Self> {
        settings.check()?;
        let reasons = refusals(scene.profile());
        if !reasons.is_empty() {
            return Err(Error::Unsupported {
                technique: "vpl".into(),
                reasons,
            });
        }
        let has_media = scene.profile().media.any();
        if has_media {
            settings.check_in_media()?;
        }
        let (path_set, eye_paths) = (settings.path_set()?, settings.eye_paths(has_media)?);
        let sends_walks = scene.has_lights() || scene.glow().is_some();
        let has_lights = sends_walks && settings.most().is_none_or(|most| most >= CONNECTED);
        let bound = if has_lights {
            settings.edge_bound(scene.surface_area())
        } else {
            Default::default()
        };
        let tracer = has_lights.then(|| {
            let plan = PhotonPlan {
                photons: settings.walks,
                sampler: settings.sampler,
                seed: settings.seed,
                submission_work: settings.submission_work,
                follows_footprints: false,
                tells_caustics: false,
                even_survival: settings.fractional,
                stores_lights: true,
                only_rough: false,
                carries_light_distance: false,
                stored: Stored {
                    first_bounce: 0,
                    last_bounce: settings.most().map_or(u32::MAX, |most| most - CONNECTED),
                },
            };
            let fewer = "follow fewer walks per pass: setting `walks`";
            let append: Box<dyn Append> = if has_media {
                Box::new(MediumLights::new(gpu, &scene, settings.sampler, fewer)?)
            } else {
                Box::new(LightAppend::new(gpu, &scene, fewer)?)
            };
            PhotonTracer::new(gpu, Arc::clone(&scene), plan, append)
        });
        let tracer = tracer.transpose()?;
        let eye_settings = PathTracerSettings {
            path_set: eye_paths,
            sampler: settings.sampler,
            seed: settings.seed,
            aovs: settings.aovs,
            submission_work: settings.submission_work,
            // What arrives is gathered wave by wave, for each pass of walks.
            full_waves: false,
            ..PathTracerSettings::default()
        };
        // Takes as much memory as is left, if it must, with what gathering keeps.
        let kept = if has_lights {
            Gather::state_bytes(&settings, has_media)
        } else {
            0
        };
        let eye = PathTracer::beyond(gpu, Arc::clone(&scene), camera, size, eye_settings, bound, kept)?;
        let lights = match tracer {
            Some(tracer) => Some(Lights {
                tracer,
                gather: Gather::new(gpu, &scene, &settings, &eye_paths, bound, eye.stage_memory())?,
                tree: match settings.selection {
                    Selection::Cuts => Some(CutTree::new(gpu, &scene)?),
                    Selection::All | Selection::Potential => None,
                },
                tracing: None,
                count: None,
            }),
            None => None,
        };
        Ok(Self {
            gpu: gpu.clone(),
            scene,
            settings,
            path_set,
            eye,
            lights,
            counts: PassCounts::default(),
        })
    }

    /// The settings.
    pub fn settings(&self) -> &VirtualLightSettings {
        &self.settings
    }

    /// The light paths of the picture.
    pub fn path_set(&self) -> PathSet {
        self.path_set
    }

    /// Exact counts since it was made.
    pub fn counts(&self) -> PassCounts {
        self.counts
    }

    /// Whether there are virtual lights.
    pub fn has_lights(&self) -> bool {
        self.lights.is_some()
    }

    /// What the scene needs.
    pub fn profile(&self) -> &SceneProfile {
        self.scene.profile()
    }

    /// Counts of the eye paths.
    pub fn eye_counters(&self) -> PathCounters {
        self.eye.counters()
    }

    /// The kernels with their specialization.
    pub fn pipelines(&self) -> Vec<PipelineInfo> {
        let mut all = self.eye.pipelines();
        if let Some(lights) = &self.lights {
            all.extend(lights.tracer.pipelines());
            all.push(lights.gather.pipeline());
            all.extend(lights.tree.iter().flat_map(CutTree::pipelines));
        }
        all
    }

    /// Looks through another camera and begins anew.
    ///
    /// # Errors
    /// [`Error::Setting`] for a camera that cannot be used, [`Error::DeviceLost`].
    pub fn set_camera(&mut self, camera: &Camera) -> Result<()> {
        self.eye.set_camera(camera)?;
        self.begin();
        Ok(())
    }

    /// Forgets everything gathered so far and begins anew with this seed, with the kernels there are.
    ///
    /// # Errors
    /// [`Error::DeviceLost`], [`Error::OutOfMemory`].
    pub fn restart(&mut self, seed: u32) -> Result<()> {
        self.eye.restart(seed)?;
        self.settings.seed = seed;
        if let Some(lights) = &mut self.lights {
            lights.tracer.set_seed(seed);
        }
        self.begin();
        Ok(())
    }

    /// Before the first pass.
    fn begin(&mut self) {
        if let Some(lights) = &mut self.lights {
            (lights.tracing, lights.count) = (None, None);
        }
    }

    /// Does a bounded piece of work towards `samples` samples per pixel, whatever the scene: a submission of a pass's walks, or one of eye paths; `None` when all
    /// samples are there.
    ///
    /// # Errors
    /// [`Error::DeviceLost`], [`Error::OutOfMemory`], [`Error::Overflow`] for more virtual lights than the device can hold, more than it can make a tree of or
    /// find the potential of where the settings ask for that, and should the index have rays that never end.
    pub fn step(&mut self, samples: u32) -> Result<Option<Step>> {
        let (done, each) = (self.eye.samples_done(), self.settings.samples_per_pass);
        let Some([pass, end]) = self.eye.pass_towards(samples, each) else {
            return Ok(None);
        };
        if let Some(lights) = &mut self.lights
            && lights.count.is_none()
        {
            let begun = lights.tracing.take();
            let mut tracing = begun.unwrap_or_else(|| lights.tracer.begin(pass, None));
            let all = lights.tracer.advance(&mut tracing)?;
            let mut timings = tracing.take_timings();
            if all {
                let traced = tracing.into_traced();
                lights.gather.check(traced.records)?;
                if let Some(tree) = &mut lights.tree
                    && traced.records > 0
                {
                    timings.push(tree.build(&self.scene, lights.tracer.records(), traced.records)?);
                }
                lights.count = Some(traced.records);
                self.counts.passes += 1;
                self.counts.walks += traced.counts;
                self.counts.lights += u64::from(traced.records);
            } else {
                lights.tracing = Some(tracing);
            }
            return Ok(Some(self.eye.step_so_far(timings, samples)));
        }
        let stage = match &self.lights {
            // Where all walks have left the scene, nothing gathers.
            Some(Lights {
                tracer,
                gather,
                tree,
                count: Some(count),
                ..
            }) if *count > 0 => Some(GatherStage {
                gather,
                scene: &self.scene,
                lights: tracer.records(),
                tree: tree.as_ref().and_then(CutTree::nodes),
                count: *count,
                scale: 1.0 / self.settings.walks as f32,
                departures: self.eye.departures(),
                seed: seed_of_pass(self.settings.seed, pass),
            }),
            _ => None,
        };
        let arrival = stage.as_ref().map(|stage| stage as &dyn ArrivalStage);
        let gathers = arrival.is_some();
        let clock = Instant::now();
        let step = self.eye.step_with(end, arrival)?;
        let waited = clock.elapsed().as_secs_f64();
        if let Some(lights) = &mut self.lights {
            let timings = step.iter().flat_map(|step| &step.timings);
            lights.gather.submitted(seconds_or_waited(timings, waited));
            // They are those of a whole wave.
            if gathers && step.is_some() && !self.eye.is_within_wave() {
                let counts = lights.gather.counts()?;
                self.counts.gather.gathers += counts.gathers;
                self.counts.gather.connections += counts.connections;
                self.counts.gather.shadow_rays += counts.shadow_rays;
                self.counts.gather.nodes += counts.nodes;
            }
            if self.eye.has_ended_pass(done, each) {
                lights.count = None;
            }
        }
        let Some(mut step) = step else {
            return Ok(None);
        };
        let timings = std::mem::take(&mut step.timings);
        Ok(Some(self.eye.step_so_far(timings, samples)))
    }

    /// Follows the walks of a pass, and returns the virtual lights that they leave, in the order of waves, in each of bounces and walks. The picture is not
    /// touched, and counts go on; a step's walks that are under way begin anew.
    ///
    /// # Errors
    /// As [`VirtualLights::step`].
    pub fn lights(&mut self, pass: u32) -> Result<Vec<VirtualLight>> {
        let (gpu, scale) = (self.gpu.clone(), 1.0 / self.settings.walks as f32);
        let Some((lights, count)) = self.follow(pass)? else {
            return Ok(Vec::new());
        };
        let records = lights.tracer.records().buffer().view();
        type Record = [[u32; 4]; VIRTUAL_LIGHT_QUARTERS as usize];
        let records: Vec<Record> = gpu.read(records, count as usize)?;
        let vector = |quarter: &[u32; 4]| Vec3::from_array([0, 1, 2].map(|i| f32::from_bits(quarter[i])));
        let light = |record: &Record| VirtualLight {
            position: vector(&record[0]),
            normal: vector(&record[1]),
            power: scale * vector(&record[2]),
            bounce: record[3][3],
        };
        Ok(records.iter().map(light).collect())
    }

    /// Follows the walks of a pass as [`VirtualLights::lights`] does, and returns the tree over the virtual lights that they leave
    /// ([`perfect_light_tree`](crate::transport::light_tree::perfect_light_tree)): strengths are those of all walks together. Empty where lights are not chosen by
    /// cuts, or there are none.
    ///
    /// # Errors
    /// As [`VirtualLights::step`].
    pub fn light_tree(&mut self, pass: u32) -> Result<Vec<SceneLightNode>> {
        let (gpu, scene) = (self.gpu.clone(), Arc::clone(&self.scene));
        match self.follow(pass)? {
            Some((
                Lights {
                    tracer,
                    tree: Some(tree),
                    ..
                },
                count,
            )) if count > 0 => {
                tree.build(&scene, tracer.records(), count)?;
                tree.read(&gpu, count)
            }
            _ => Ok(Vec::new()),
        }
    }

    /// Follows the walks of a pass outside of the picture; the lights, and how many records they left.
    fn follow(&mut self, pass: u32) -> Result<Option<(&mut Lights, u32)>> {
        let Some(lights) = &mut self.lights else {
            return Ok(None);
        };
        (lights.tracing, lights.count) = (None, None);
        let traced = lights.tracer.trace(pass, None)?;
        self.counts.walks += traced.counts;
        Ok(Some((lights, traced.records)))
    }

    /// The picture so far, as [`PathTracer::picture`] has it.
    ///
    /// # Errors
    /// [`Error::DeviceLost`], [`Error::OutOfMemory`].
    pub fn picture(&mut self) -> Result<(Picture, NonFiniteSamples)> {
        self.eye.picture()
    }

    /// As [`PathTracer::display`].
    ///
    /// # Errors
    /// As there.
    pub fn display(&mut self, target: &Buffer, exposure: f32, format: PixelFormat) -> Result<()> {
        self.eye.display(target, exposure, format)
    }
}
