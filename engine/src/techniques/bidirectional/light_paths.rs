//! Light subpaths of a pass: walks from the lights in one wave, the vertices that they leave, and what these show the camera.
//!
//! They are emitted and walked as photons are, by the same functions, waves and queues, in kernels of their own: each vertex carries partial weights of both ends, and follows
//! no footprint.
//!
//! Guarantees: vertices depend on (seed, pass, walk) alone, and have the order of bounces and walks; vertices that do not fit are never lost silently, since the
//! pass is walked again with room for them; what the camera is shown is summed in integers, so that it is the same bits in whatever order; a submission is a bounded piece of work.

use std::sync::Arc;
use std::time::Instant;

use super::eye::EyeWave;
use super::kernels::{Counters, Counts, Viewpoint, check_sweeps, media_set_of, path_states, set_of, work};
use super::settings::BidirectionalSettings;
use super::splats::{CameraSplats, Shown, ShownWalks, SightKernel, splats, vertices_within};
use crate::gpu::ash::vk;
use crate::gpu::interface::BindingSet;
use crate::gpu::shaders::constants::{LIGHT_VERTEX_QUARTERS, NO_MEDIUM, WALK_GROUP};
use crate::gpu::shaders::sets::{BidirectionalSet, WaveSet};
use crate::gpu::shaders::techniques::bidirectional::{
    bdpt_add, bdpt_append, bdpt_emit, bdpt_scatter, bdpt_splat, bdpt_walk_medium,
};
use crate::gpu::shaders::types::PartialWeights;
use crate::gpu::{
    Access, Buffer, Category, ComputePipeline, Gpu, PipelineInfo, Recorder, TexelView, Timings, seconds_or_waited,
    wide_counter,
};
use crate::transport::{GpuScene, emission_spec, surface_spec};
use crate::walk::{
    Bounce, ConnectionPace, WalkKey, WalkOptions, WalkStages, Walker, WaveBuffers, WaveInFlight, WaveNeeds,
    slots_of_device, stage_barrier,
};
use crate::{Error, Result};

/// Bounces recorded into one command buffer, at most.
const BOUNCES_PER_SUBMISSION: usize = 8;
/// Vertices that there is room for at first, a walk.
const VERTICES_PER_WALK: u32 = 6;
/// Rays to the camera of a submission in scenes with media, at most: what is kept of each on its way has room.
const MEDIA_RAYS: u32 = 1 << 18;
/// Tells the random numbers of light subpaths from those of eye paths.
const LIGHT_SEED: u32 = 0x6c69_6768;

/// Light subpaths of a pass, as far as they are.
#[expect(clippy::large_enum_variant, reason = "there is one for each renderer")]
enum Phase {
    /// Before the first submission.
    Before,
    Walking(WaveInFlight),
    /// So many of the vertices have been shown to the camera, and rays of those from there up to `end` were stopped `sweeps` times.
    Showing {
        shown: u32,
        end: u32,
        sweeps: u64,
    },
    Ready,
}

/// Exact counts.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct LightCounts {
    pub walks: u64,
    pub rays: u64,
    pub vertices: u64,
    /// Vertices that the camera might see.
    pub in_view: u64,
    pub shadow_rays: u64,
    /// With media.
    pub collisions: u64,
    pub stalls: u64,
    pub postponed: u64,
}

/// Walks light subpaths, pass by pass.
pub(super) struct LightPaths {
    gpu: Gpu,
    walker: Walker,
    walks: LightWalks,
    camera: Option<CameraSplats>,
    phase: Phase,
    vertices: u32,
    /// Vertices of a submission, by what those take whose rays begin; those that go on are some of these.
    pace: ConnectionPace,
    /// Vertices of a submission at most, of which each keeps its ray where there are media.
    rays_at_once: u32,
    counts: LightCounts,
}

/// What walks from the lights are made of, but for the walker.
struct LightWalks {
    scene: Arc<GpuScene>,
    emit: ComputePipeline<bdpt_emit::Kernel>,
    /// Only where there are media.
    medium: Option<ComputePipeline<bdpt_walk_medium::Kernel>>,
    scatter: ComputePipeline<bdpt_scatter::Kernel>,
    append: ComputePipeline<bdpt_append::Kernel>,
    /// Of path sets that are more than a range of bounces.
    states: Option<Buffer>,
    /// [`GpuScene::emission_choice`].
    emission: Option<TexelView>,
    weights: Buffer,
    counts: Counts,
    vertices: TexelView,
    capacity: u32,
    /// Of a pass.
    count: u32,
    /// Of each group: light subpaths for one sample of all pixels.
    group: u32,
    seed: u32,
    last_bounce: u32,
}

struct LightStages<'a> {
    walks: &'a LightWalks,
    key: WalkKey,
}

impl LightPaths {
    pub fn new(
        gpu: &Gpu,
        scene: &Arc<GpuScene>,
        view: &Viewpoint,
        size: [u32; 2],
        settings: &BidirectionalSettings,
    ) -> Result<Self> {
        let (profile, media) = (scene.profile(), scene.profile().media);
        let emit = emission_spec!(bdpt_emit, scene, {
            sampler_kind: settings.sampler as u32,
            has_path_automaton: settings.has_states(),
            ..Default::default()
        });
        let scatter = surface_spec!(bdpt_scatter, scene, {
            has_multiple_scattering: scene.bsdf_features().multiple_scattering,
            separable_masking: false,
            sampler_kind: settings.sampler as u32,
            has_media: media.any(),
            has_path_automaton: settings.has_states(),
            ..Default::default()
        });
        let medium = bdpt_walk_medium::Spec {
            has_absorption: profile.has_absorption,
            has_instances: profile.keeps_instances,
            has_grids: media.heterogeneous,
            has_homogeneous: media.homogeneous,
            sampler_kind: settings.sampler as u32,
            has_path_automaton: settings.has_states(),
            ..Default::default()
        };
        let medium = media.any().then(|| gpu.compute_pipeline(&medium));
        let [samples, group] = settings.pass_of(size[0] * size[1]);
        let group = group.min(slots_of_device(gpu) / samples);
        let count = samples * group;
        let slots = count.next_multiple_of(WALK_GROUP).min(slots_of_device(gpu));
        let needs = WaveNeeds {
            waiting: true,
            media: media.any(),
            airlight: false,
        };
        let options = WalkOptions {
            name: "light subpaths",
            shadows: false,
            ray_quota: settings.quota(),
            bounces: BOUNCES_PER_SUBMISSION,
            work: settings.submission_work,
            ..WalkOptions::default()
        };
        let capacity = u64::from(count) * u64::from(VERTICES_PER_WALK);
        let capacity = capacity.min(vertices_within(gpu.caps())) as u32;
        let buffers = WaveBuffers::new(gpu, slots, needs)?;
        let mut paths = Self {
            walker: Walker::new(gpu, Arc::clone(scene), buffers, options)?,
            walks: LightWalks {
                emit: gpu.compute_pipeline(&emit)?,
                medium: medium.transpose()?,
                scatter: gpu.compute_pipeline(&scatter)?,
                append: gpu.compute_pipeline(&Default::default())?,
                states: path_states(gpu, settings)?,
                emission: scene.emission_choice(gpu)?,
                weights: work(gpu, "light subpath weights", size_of::<PartialWeights>(), slots)?,
                counts: Counts::new(gpu)?,
                vertices: vertex_texels(gpu, capacity)?,
                capacity,
                scene: Arc::clone(scene),
                count,
                group,
                seed: settings.seed,
                last_bounce: settings.walk_bounces(),
            },
            gpu: gpu.clone(),
            camera: None,
            phase: Phase::Before,
            vertices: 0,
            pace: pace_of(gpu, scene, 1),
            rays_at_once: if media.any() { MEDIA_RAYS } else { u32::MAX },
            counts: LightCounts::default(),
        };
        if settings.strategies.splats() {
            let room = (capacity, paths.rays_at_once);
            let camera = CameraSplats::new(gpu, scene, view, size, settings, room)?;
            paths.pace = pace_of(gpu, scene, camera.stretches);
            paths.camera = Some(camera);
        }
        Ok(paths)
    }

    /// Light subpaths of a pass, and for each of its samples.
    pub fn walks(&self) -> [u32; 2] {
        [self.walks.count, self.walks.group]
    }

    /// Whether they meet the camera.
    pub fn meet_the_camera(&self) -> bool {
        self.camera.is_some()
    }

    /// The vertices of the pass, and how many there are.
    pub fn vertices(&self) -> (&TexelView, u32) {
        (&self.walks.vertices, self.vertices)
    }

    /// Whether all of the pass is there.
    pub fn are_ready(&self) -> bool {
        matches!(self.phase, Phase::Ready)
    }

    /// What is there is given up: the next submission begins a pass.
    pub fn begin(&mut self) {
        self.phase = Phase::Before;
        self.vertices = 0;
    }

    /// Goes on with another seed.
    pub fn set_seed(&mut self, seed: u32) {
        self.walks.seed = seed;
    }

    /// Looks through another camera.
    pub fn set_camera(&mut self, view: &Viewpoint, settings: &BidirectionalSettings) -> Result<()> {
        if let Some(camera) = &mut self.camera {
            (camera.sight, camera.stretches) = SightKernel::new(&self.gpu, &self.walks.scene, view, settings)?;
            camera.view = *view;
            // What vertices took with the kernel before says nothing of this one.
            self.pace = pace_of(&self.gpu, &self.walks.scene, camera.stretches);
        }
        Ok(())
    }

    pub fn counts(&self) -> LightCounts {
        self.counts
    }

    pub fn pipelines(&self) -> Vec<PipelineInfo> {
        let walks = &self.walks;
        let mut all = vec![walks.emit.info(), walks.scatter.info(), walks.append.info()];
        all.extend(walks.medium.as_ref().map(ComputePipeline::info));
        all.extend(self.walker.trace_pipelines());
        if let Some(camera) = &self.camera {
            all.extend([camera.sight.pipeline(), camera.splat.info(), camera.add.info()]);
        }
        all
    }

    /// One submission towards the light subpaths of a pass, a bounded piece of work.
    ///
    /// # Errors
    /// [`Error::DeviceLost`], [`Error::OutOfMemory`], [`Error::Overflow`] for more vertices than a buffer holds, or rays that never end.
    pub fn advance(&mut self, pass: u32) -> Result<Vec<Timings>> {
        let phase = std::mem::replace(&mut self.phase, Phase::Before);
        match phase {
            Phase::Before => {
                let wave = self.walker.begin(self.key(pass), self.walks.count)?;
                self.walk(pass, wave)
            }
            Phase::Walking(wave) => self.walk(pass, wave),
            Phase::Showing { shown, end, sweeps } => self.show(pass, [shown, end], sweeps),
            Phase::Ready => {
                self.phase = Phase::Ready;
                Ok(Vec::new())
            }
        }
    }

    fn key(&self, pass: u32) -> WalkKey {
        WalkKey {
            first_sequence: pass,
            first_index: 0,
            indices: self.walks.count,
            seed: self.walks.seed ^ LIGHT_SEED,
        }
    }

    fn walk(&mut self, pass: u32, mut wave: WaveInFlight) -> Result<Vec<Timings>> {
        let mut stages = LightStages {
            walks: &self.walks,
            key: self.key(pass),
        };
        self.walker.advance(&mut wave, &mut stages)?;
        let timings = wave.take_timings();
        if !wave.has_ended() {
            self.phase = Phase::Walking(wave);
            return Ok(timings);
        }
        let walked = wave.walked();
        let (needed, most) = (walked.waited, vertices_within(self.gpu.caps()));
        if needed > most {
            return Err(Error::Overflow {
                kernel: "bdpt_append".into(),
                what: "vertices of light subpaths".into(),
                needed,
                capacity: most,
                instead: "let a pass have fewer light_paths".into(),
            });
        }
        self.counts.rays += walked.rays;
        self.counts.collisions += walked.media.collisions;
        self.counts.stalls += walked.stalls;
        self.counts.postponed += walked.postponed;
        if needed > u64::from(self.walks.capacity) {
            // The pass is walked again, with room for all.
            let capacity = (needed + needed / 4).min(most) as u32;
            // First what can fail: vertices and what is shown of them have the same room.
            let vertices = vertex_texels(&self.gpu, capacity)?;
            if let Some(camera) = &mut self.camera {
                camera.splats = splats(&self.gpu, capacity)?;
            }
            (self.walks.vertices, self.walks.capacity) = (vertices, capacity);
            return Ok(timings);
        }
        self.vertices = needed as u32;
        self.counts.walks += u64::from(self.walks.count);
        self.counts.vertices += needed;
        self.phase = match self.camera {
            Some(_) => Phase::Showing {
                shown: 0,
                end: 0,
                sweeps: 0,
            },
            None => Phase::Ready,
        };
        Ok(timings)
    }

    /// Shows some vertices more to the camera, from `shown` on, or goes on with those up to `end` whose rays were stopped; the last submission of them also sums.
    fn show(&mut self, pass: u32, [shown, end]: [u32; 2], sweeps: u64) -> Result<Vec<Timings>> {
        let Some(camera) = &self.camera else {
            self.phase = Phase::Ready;
            return Ok(Vec::new());
        };
        let end = if sweeps > 0 {
            end
        } else {
            let vertices = self.pace.places().min(self.rays_at_once);
            shown.saturating_add(vertices).min(self.vertices)
        };
        let walks = ShownWalks {
            pass,
            group: self.walks.group,
            seed: self.walks.seed,
        };
        let (set, scene) = (camera.set(self.walks.set()), &self.walks.scene);
        let vertices = Shown {
            first: shown,
            end,
            goes_on: sweeps > 0,
        };
        let mut recorder = self.gpu.recorder("bidirectional splats")?;
        recorder.pass("light subpaths: to the camera", |p| {
            if shown == 0 && sweeps == 0 {
                p.fill(camera.sums.view(), 0)?;
                p.fill(self.walks.counts.device.view(), 0)?;
            } else {
                let offset = std::mem::offset_of!(Counters, remaining) as u64;
                p.fill(self.walks.counts.device.slice(offset, size_of::<u32>() as u64), 0)?;
            }
            p.memory_barrier(Access::TRANSFER_WRITE, Access::COMPUTE);
            if end > shown {
                camera.record(p, scene, &set, walks, vertices)?;
            }
            p.memory_barrier(Access::COMPUTE, Access::COMPUTE | Access::TRANSFER_READ);
            p.copy(self.walks.counts.device.view(), self.walks.counts.readback.view())
        })?;
        let clock = Instant::now();
        let mut timings = vec![recorder.submit()?.wait()?];
        if sweeps == 0 {
            self.pace.record(end - shown);
            self.pace
                .submitted(seconds_or_waited(&timings, clock.elapsed().as_secs_f64()));
        }
        let counters = self.walks.counts.read()?;
        if counters.remaining > 0 {
            check_sweeps("bdpt_camera", sweeps + 1)?;
            self.phase = Phase::Showing {
                shown,
                end,
                sweeps: sweeps + 1,
            };
            return Ok(timings);
        }
        if end < self.vertices {
            self.phase = Phase::Showing {
                shown: end,
                end,
                sweeps: 0,
            };
            return Ok(timings);
        }
        self.counts.in_view += wide_counter(counters.in_view);
        self.counts.shadow_rays += wide_counter(counters.shadow_rays);
        if self.vertices > 0 {
            timings.push(self.sum(camera)?);
        }
        self.phase = Phase::Ready;
        Ok(timings)
    }

    fn sum(&self, camera: &CameraSplats) -> Result<Timings> {
        let set = camera.set(self.walks.set());
        let mut recorder = self.gpu.recorder("bidirectional splats")?;
        recorder.pass("light subpaths: sum", |pass| {
            let push = bdpt_splat::Push { count: self.vertices };
            let groups = [camera.splat.groups_for(self.vertices), 1, 1];
            pass.dispatch(&camera.splat, &[&set], &push, groups)?;
            stage_barrier(pass);
            Ok(())
        })?;
        recorder.submit()?.wait()
    }

    /// Records what adds to the eye paths of a wave what the camera is shown of the pass. Of the pass, their first sample is `first_sample`.
    ///
    /// # Errors
    /// Those of recording.
    pub fn record_add(
        &self,
        recorder: &mut Recorder,
        walks: &WaveSet<'_>,
        wave: &EyeWave,
        first_sample: u32,
    ) -> Result<()> {
        let Some(camera) = &self.camera else {
            return Ok(());
        };
        let set = camera.set(self.walks.set());
        recorder.pass("light subpaths: add", |pass| {
            let push = bdpt_add::Push {
                first_pixel: wave.first_pixel,
                count: wave.paths(),
                samples: wave.samples,
                first_sample,
                pixels: camera.size[0] * camera.size[1],
            };
            let groups = [camera.add.groups_for(push.count), 1, 1];
            pass.dispatch(&camera.add, &[walks, &set], &push, groups)?;
            stage_barrier(pass);
            Ok(())
        })
    }
}

impl LightWalks {
    fn set(&self) -> BidirectionalSet<'_> {
        BidirectionalSet {
            subpath_weights: self.weights.view(),
            bdpt_counters: self.counts.device.view(),
            bidirectional_states: self.states.as_ref().unwrap_or(&self.weights).view(),
            ..set_of(&self.vertices, &self.weights)
        }
    }
}

impl WalkStages for LightStages<'_> {
    /// Walks leave the lights.
    fn record_start(&self, recorder: &mut Recorder, wave: &WaveSet<'_>) -> Result<()> {
        let walks = self.walks;
        let [lower, upper] = walks.scene.bounds();
        let push = bdpt_emit::Push {
            scene_lower: lower.to_array(),
            radius: 0.5 * (upper - lower).length(),
            scene_upper: upper.to_array(),
            key: self.key,
        };
        recorder.pass("light subpaths: emit", |pass| {
            let groups = [walks.emit.groups_for(self.key.indices), 1, 1];
            let (scene, own) = (walks.scene.emission_set(walks.emission.as_ref()), walks.set());
            pass.dispatch(&walks.emit, &[wave, &scene, &own], &push, groups)?;
            stage_barrier(pass);
            Ok(())
        })
    }

    /// What happens on the way through media, and where walks have arrived.
    fn record_scatter(&self, recorder: &mut Recorder, bounce: &Bounce<'_>) -> Result<()> {
        let walks = self.walks;
        if let Some(medium) = &walks.medium {
            let push = bdpt_walk_medium::Push {
                key: self.key,
                surrounding: walks.scene.surrounding().unwrap_or(NO_MEDIUM),
                last_bounce: walks.last_bounce,
                group: walks.group,
            };
            recorder.pass("light subpaths: media", |pass| {
                let (scene, own) = (walks.scene.scene_set(), walks.set());
                let media = media_set_of(&walks.scene, &walks.weights);
                let sets: [&dyn BindingSet<'_>; 4] = [&bounce.wave, &scene, &own, &media];
                pass.dispatch_indirect(medium, &sets, &push, bounce.places.items)?;
                stage_barrier(pass);
                Ok(())
            })?;
        }
        let [lower, upper] = walks.scene.bounds();
        let push = bdpt_scatter::Push {
            scene_lower: lower.to_array(),
            last_bounce: walks.last_bounce,
            scene_upper: upper.to_array(),
            group: walks.group,
            key: self.key,
        };
        recorder.pass("light subpaths: scatter", |pass| {
            let (scene, own) = (walks.scene.scene_set(), walks.set());
            let sets: [&dyn BindingSet<'_>; 3] = [&bounce.wave, &scene, &own];
            pass.dispatch_indirect(&walks.scatter, &sets, &push, bounce.places.items)?;
            stage_barrier(pass);
            Ok(())
        })
    }

    /// What waits becomes vertices.
    fn record_waiting(&self, recorder: &mut Recorder, bounce: &Bounce<'_>) -> Result<()> {
        let walks = self.walks;
        recorder.pass("light subpaths: append", |pass| {
            let push = bdpt_append::Push {
                capacity: walks.capacity,
            };
            let own = walks.set();
            pass.dispatch_indirect(&walks.append, &[&bounce.wave, &own], &push, bounce.places.waiting)?;
            stage_barrier(pass);
            Ok(())
        })
    }
}

/// The pace of vertices whose rays take so many stretches in a dispatch, of which nothing is known yet.
fn pace_of(gpu: &Gpu, scene: &GpuScene, stretches: u32) -> ConnectionPace {
    ConnectionPace::new(gpu.caps().kind, stretches, scene.profile().media.heterogeneous)
}

fn vertex_texels(gpu: &Gpu, vertices: u32) -> Result<TexelView> {
    let texels = u64::from(vertices) * u64::from(LIGHT_VERTEX_QUARTERS);
    gpu.storage_texels("light vertices", Category::Work, vk::Format::R32G32B32A32_UINT, texels)
}
