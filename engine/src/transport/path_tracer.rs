//! The reference path tracer: unidirectional, with next-event estimation and multiple importance sampling, in wavefront stages.
//!
//! Sources: BG-2 and BG-3; Kajiya, "The Rendering Equation" (SIGGRAPH 1986); Veach, "Robust Monte Carlo Methods for Light Transport
//! Simulation" (1997), chapters 9 and 10; wavefront form after Laine, Karras and Aila, "Megakernels Considered Harmful" (HPG 2013).
//!
//! Unbiased: paths end by Russian roulette or by the [`PathSet`] alone. Deterministic: a pixel's sum depends on (seed, pixel, sample
//! numbers) only, never on wave size, queue order or threads. Nothing is lost in silence: rays that an iteration quota stops go on in a
//! later dispatch, and samples that are not finite are counted and left out.

use std::sync::Arc;

use glam::DVec3;

use super::gpu_scene::GpuScene;
use super::path_set::PathSet;
use super::random::SamplerKind;
use crate::film::accumulate::TwoFloat;
use crate::film::picture::Picture;
use crate::gpu::shaders::film::display;
use crate::gpu::shaders::sets::{Bvh2Set, PathBuffers, SceneSet};
use crate::gpu::shaders::transport::{
    path_camera, path_compact_count, path_compact_scan, path_compact_scatter, path_extend, path_extend_alpha,
    path_resolve, path_shade, path_shadow, path_shadow_alpha,
};
use crate::gpu::shaders::types::{FilmAov, FilmPixel, Hit, PathAov, PathState, Ray, ShadowRay};
use crate::gpu::{
    Access, Buffer, BufferDesc, Category, ComputePipeline, Gpu, Pass, PipelineInfo, Recorder, Timings,
    rw_compute_to_compute,
};
use crate::scene::{Camera, Projection};
use crate::{Error, Result};

/// Bounces recorded into one command buffer; a wave that needs more is submitted again.
const BOUNCES_PER_SUBMISSION: usize = 12;
/// Pixels of one film buffer, so that no picture's size meets `maxStorageBufferRange`.
const BAND_PIXELS: u32 = 1 << 20;
/// Samples of a pixel in one wave: the resolve stage loops over them, and software drivers silently end a kernel's loops after 65,535
/// iterations in all.
const SAMPLES_A_WAVE: u32 = 1024;
/// Places that one invocation of the compaction kernels handles (`COMPACT_CHUNK`).
const COMPACT_CHUNK: u32 = 32;
/// Invocations of a workgroup of every stage (`PATH_GROUP`).
const PATH_GROUP: u32 = 64;
/// Bounds of the roulette's settings, so that every path ends.
const ROULETTE_CAP_MAX: f32 = 0.999;
const ROULETTE_START_MAX: u32 = 4096;
/// `STALLED_SHADOW` of `path_buffers.glsl`.
const STALLED_SHADOW: u32 = 2;
/// Submissions in a row that may end without finishing a bounce before the tracer gives up: each one advances every stopped ray by a
/// whole quota, so this many stand for more iterations than any index of 2²⁸ triangles has.
const STALLS_MAX: u32 = 1 << 16;

/// Settings of the path tracer.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct PathTracerSettings {
    /// Which light paths the picture contains.
    pub path_set: PathSet,
    /// Random numbers: Owen-scrambled Sobol' or PCG.
    pub sampler: SamplerKind,
    /// Seed of the random numbers; the view's, where settings come as text.
    #[serde(skip)]
    pub seed: u32,
    /// First bounce at which Russian roulette may end a path, at most 4096.
    pub roulette_start: u32,
    /// Largest probability to survive a round of roulette, in (0, 0.999]: with 1, paths in lossless scenes would never end.
    pub roulette_cap: f32,
    /// Compensation of rough metals for scattering among microfacets; off for comparison with single-scattering renderers.
    pub multiple_scattering: bool,
    /// Uncorrelated instead of height-correlated Smith masking, for the same comparison.
    pub separable_masking: bool,
    /// Paths in flight; 0 chooses by the kind of device. Never changes the picture.
    pub paths_in_flight: u32,
    /// Loop iterations after which a ray goes on in a later dispatch. Never changes the picture.
    pub ray_quota: u32,
    /// Also gathers albedo, normal and depth of what is seen first; the view's, where settings come as text.
    #[serde(skip)]
    pub aovs: bool,
}

impl Default for PathTracerSettings {
    fn default() -> Self {
        Self {
            path_set: PathSet::ALL,
            sampler: SamplerKind::Sobol,
            seed: 0,
            roulette_start: 4,
            roulette_cap: 0.95,
            multiple_scattering: true,
            separable_masking: false,
            paths_in_flight: 0,
            ray_quota: 32_768,
            aovs: false,
        }
    }
}

impl PathTracerSettings {
    fn check(&self) -> Result<()> {
        let fail = |name: &str, value: String, cause: &str| {
            Err(Error::Setting {
                name: name.into(),
                value,
                cause: cause.into(),
            })
        };
        // Paths in scenes that lose nothing end by roulette alone.
        if !(self.roulette_cap > 0.0 && self.roulette_cap <= ROULETTE_CAP_MAX) {
            return fail("roulette_cap", self.roulette_cap.to_string(), "is not in (0, 0.999]");
        }
        if self.roulette_start > ROULETTE_START_MAX {
            return fail("roulette_start", self.roulette_start.to_string(), "is more than 4096");
        }
        // A traversal makes progress only with a quota above twice the depth of the deepest tree.
        if self.ray_quota < 128 || self.ray_quota > 60_000 {
            return fail("ray_quota", self.ray_quota.to_string(), "is not in 128..=60000");
        }
        if self.paths_in_flight > 1 << 22 {
            return fail(
                "paths_in_flight",
                self.paths_in_flight.to_string(),
                "is more than 4194304",
            );
        }
        Ok(())
    }
}

/// Exact counts of what the device did.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, serde::Serialize)]
pub struct PathCounters {
    /// Paths begun.
    pub paths: u64,
    /// Closest-hit rays.
    pub extend_rays: u64,
    /// Shadow rays.
    pub shadow_rays: u64,
    /// Waves rendered.
    pub waves: u64,
    /// Submissions that ended with rays stopped by the quota, which then went on.
    pub stalls: u64,
}

/// What one step of rendering has done.
#[derive(Debug, Clone)]
pub struct Step {
    /// GPU times of its passes.
    pub timings: Vec<Timings>,
    /// Pixel samples finished so far, and wanted in all.
    pub done: u64,
    /// See `done`.
    pub wanted: u64,
}

/// A progressive rendering of one view.
pub struct PathTracer {
    gpu: Gpu,
    scene: Arc<GpuScene>,
    settings: PathTracerSettings,
    size: [u32; 2],
    view: View,
    pipelines: Pipelines,
    buffers: WaveBuffers,
    slots: u32,
    bands: Vec<Band>,
    pending: Option<Wave>,
    cursor: Cursor,
    counters: PathCounters,
}

/// Camera parameters as the kernel takes them.
struct View {
    origin: [f32; 3],
    right: [f32; 3],
    up: [f32; 3],
    forward: [f32; 3],
    half_width: f32,
    half_height: f32,
    lens_radius: f32,
    focus_distance: f32,
    orthographic: bool,
}

struct Pipelines {
    camera: ComputePipeline<path_camera::Kernel>,
    trace: TracePipelines,
    shade: ComputePipeline<path_shade::Kernel>,
    count: ComputePipeline<path_compact_count::Kernel>,
    scan: ComputePipeline<path_compact_scan::Kernel>,
    scatter: ComputePipeline<path_compact_scatter::Kernel>,
    resolve: ComputePipeline<path_resolve::Kernel>,
}

/// Ray kernels, with the alpha test only where a scene has alpha.
enum TracePipelines {
    Opaque {
        extend: ComputePipeline<path_extend::Kernel>,
        shadow: ComputePipeline<path_shadow::Kernel>,
    },
    Alpha {
        extend: ComputePipeline<path_extend_alpha::Kernel>,
        shadow: ComputePipeline<path_shadow_alpha::Kernel>,
    },
}

/// Working memory of a wave.
struct WaveBuffers {
    status: Buffer,
    queues: [Buffer; 2],
    rays: Buffer,
    states: Buffer,
    hits: Buffer,
    shadow: Buffer,
    flags: Buffer,
    resume: Buffer,
    chunks: Buffer,
    aovs: Buffer,
    readback: Buffer,
}

/// Pixels that share film buffers.
struct Band {
    first_pixel: u32,
    pixels: u32,
    film: Buffer,
    aovs: Buffer,
}

/// One wave: consecutive pixels of a band × consecutive samples.
#[derive(Debug, Clone, Copy)]
struct Wave {
    band: usize,
    first_pixel: u32,
    pixels: u32,
    first_sample: u32,
    samples: u32,
}

/// Where the next wave begins.
#[derive(Debug, Clone, Copy, Default)]
struct Cursor {
    band: usize,
    pixel_in_band: u32,
    sample: u32,
    done: u64,
}

type Status = path_camera::PathStatusBlock;

impl PathTracer {
    /// Prepares a rendering of `size` pixels.
    ///
    /// # Errors
    /// [`Error::Setting`] for a setting or size out of range, [`Error::OutOfMemory`], [`Error::MissingFeature`].
    pub fn new(
        gpu: &Gpu,
        scene: Arc<GpuScene>,
        camera: &Camera,
        size: [u32; 2],
        settings: PathTracerSettings,
    ) -> Result<Self> {
        settings.check()?;
        let pixels = u64::from(size[0]) * u64::from(size[1]);
        if pixels == 0 || pixels > u64::from(u32::MAX) {
            return Err(Error::Setting {
                name: "size".into(),
                value: format!("{}x{}", size[0], size[1]),
                cause: "has no pixels, or more than 2^32".into(),
            });
        }
        let pixels = pixels as u32;
        let slots = match settings.paths_in_flight {
            // A software device works best while a wave's memory stays in the processor's caches.
            0 if gpu.caps().kind == "cpu" => 1 << 16,
            0 => 1 << 20,
            wanted => wanted.next_multiple_of(PATH_GROUP),
        };
        let slots = slots.min(slots_of_device(gpu));
        let view = View::new(camera, size)?;
        let pipelines = Pipelines::new(gpu, &scene, &settings, &view, camera)?;
        let buffers = WaveBuffers::new(gpu, slots, settings.aovs)?;
        let bands = (0..pixels.div_ceil(BAND_PIXELS))
            .map(|band| {
                Band::new(
                    gpu,
                    band * BAND_PIXELS,
                    (pixels - band * BAND_PIXELS).min(BAND_PIXELS),
                    settings.aovs,
                )
            })
            .collect::<Result<_>>()?;
        let mut tracer = Self {
            gpu: gpu.clone(),
            scene,
            settings,
            size,
            view,
            pipelines,
            buffers,
            slots,
            bands,
            pending: None,
            cursor: Cursor::default(),
            counters: PathCounters::default(),
        };
        tracer.clear()?;
        Ok(tracer)
    }

    /// Forgets everything gathered so far and looks through another camera.
    ///
    /// # Errors
    /// [`Error::Setting`] for a camera that cannot be used, [`Error::DeviceLost`].
    pub fn set_camera(&mut self, camera: &Camera) -> Result<()> {
        let view = View::new(camera, self.size)?;
        self.pipelines.camera = camera_pipeline(&self.gpu, &self.settings, &view, camera)?;
        self.view = view;
        self.clear()
    }

    /// Renders one more wave towards `samples` samples a pixel; `None` when all are there. The first wave also compiles the kernels.
    ///
    /// # Errors
    /// [`Error::DeviceLost`], [`Error::OutOfMemory`], [`Error::Overflow`] should the index have rays that never end.
    pub fn step(&mut self, samples: u32) -> Result<Option<Step>> {
        let wanted = u64::from(samples) * u64::from(self.size[0]) * u64::from(self.size[1]);
        let Some((wave, next)) = self.next_wave(samples) else {
            return Ok(None);
        };
        // A wave that fails is rendered again by the next step.
        let timings = self.run(&wave)?;
        self.cursor = next;
        Ok(Some(Step {
            timings,
            done: self.cursor.done,
            wanted,
        }))
    }

    /// Renders until every pixel has `samples` samples.
    ///
    /// # Errors
    /// As [`PathTracer::step`].
    pub fn render(&mut self, samples: u32) -> Result<()> {
        while self.step(samples)?.is_some() {}
        Ok(())
    }

    /// Exact counts since the tracer was made.
    pub fn counters(&self) -> PathCounters {
        self.counters
    }

    /// The settings.
    pub fn settings(&self) -> &PathTracerSettings {
        &self.settings
    }

    /// Pixels across and down.
    pub fn size(&self) -> [u32; 2] {
        self.size
    }

    /// The kernels with their specialization.
    pub fn pipelines(&self) -> Vec<PipelineInfo> {
        let p = &self.pipelines;
        let [extend, shadow] = p.trace.info();
        vec![
            p.camera.info(),
            extend,
            shadow,
            p.shade.info(),
            p.count.info(),
            p.scan.info(),
            p.scatter.info(),
            p.resolve.info(),
        ]
    }

    /// Reads the picture: layers `radiance`, `variance` (of the mean), `samples`, and the AOVs that were asked for; with the number of
    /// samples that were left out because they were not finite.
    ///
    /// # Errors
    /// [`Error::DeviceLost`], [`Error::OutOfMemory`].
    pub fn picture(&mut self) -> Result<(Picture, u64)> {
        self.flush()?;
        let mut film = Vec::new();
        let mut aovs: Vec<FilmAov> = Vec::new();
        for band in &self.bands {
            film.extend(self.gpu.read::<FilmPixel>(band.film.view(), band.pixels as usize)?);
            if self.settings.aovs {
                aovs.extend(self.gpu.read::<FilmAov>(band.aovs.view(), band.pixels as usize)?);
            }
        }
        let mut picture = Picture::new(self.size[0], self.size[1])?;
        picture.add_layer(
            "radiance",
            3,
            film.iter().flat_map(|pixel| statistics(pixel).0).collect(),
        )?;
        picture.add_layer(
            "variance",
            3,
            film.iter().flat_map(|pixel| statistics(pixel).1).collect(),
        )?;
        picture.add_layer("samples", 1, film.iter().map(|pixel| pixel.samples as f32).collect())?;
        if self.settings.aovs {
            let mean = |aov: &FilmAov, i: usize| {
                let sum = TwoFloat {
                    hi: aov.sum[i].hi,
                    lo: aov.sum[i].lo,
                }
                .to_f64();
                (sum / f64::from(aov.hits.max(1))) as f32
            };
            let layer = |first: usize| {
                aovs.iter()
                    .flat_map(|a| [0, 1, 2].map(|i| mean(a, first + i)))
                    .collect::<Vec<_>>()
            };
            picture.add_layer("albedo", 3, layer(0))?;
            picture.add_layer("normal", 3, layer(3))?;
            picture.add_layer("depth", 1, aovs.iter().map(|a| mean(a, 6)).collect())?;
        }
        Ok((picture, film.iter().map(|pixel| u64::from(pixel.non_finite)).sum()))
    }

    /// Writes what there is so far to a buffer of four bytes a pixel, rows from the top, on the device: exposed by `exposure` stops, clipped
    /// and sRGB-encoded, blue first where `bgra` says so.
    ///
    /// # Errors
    /// [`Error::LimitExceeded`] when the buffer is too small, [`Error::DeviceLost`].
    pub fn display(&mut self, target: &Buffer, exposure: f32, bgra: bool) -> Result<()> {
        let bytes = 4 * u64::from(self.size[0]) * u64::from(self.size[1]);
        if target.bytes() < bytes {
            return Err(Error::LimitExceeded {
                name: target.name().into(),
                bytes,
                limit_name: "size",
                limit: target.bytes(),
            });
        }
        self.flush()?;
        let kernel = self.gpu.compute_pipeline::<display::Kernel>(&())?;
        let mut recorder = self.gpu.recorder("display")?;
        recorder.pass("film: display", |pass| {
            for band in &self.bands {
                let push = display::Push {
                    first_pixel: band.first_pixel,
                    pixel_count: band.pixels,
                    scale: exposure.exp2(),
                    bgra: bgra.into(),
                };
                let set = display::Set0 {
                    film_pixels: band.film.view(),
                    display_pixels: target.view(),
                };
                pass.dispatch(&kernel, &[&set], &push, [kernel.groups_for(band.pixels), 1, 1])?;
                pass.barrier(&[rw_compute_to_compute(target)]);
            }
            Ok(())
        })?;
        recorder.submit()?.wait()?;
        Ok(())
    }

    /// The next wave, and where the one after it begins.
    fn next_wave(&self, samples: u32) -> Option<(Wave, Cursor)> {
        let mut c = self.cursor;
        if c.sample >= samples {
            return None;
        }
        let band = &self.bands[c.band];
        let pixels = (band.pixels - c.pixel_in_band).min(self.slots);
        // Several samples of a pixel share a wave only where all of the picture fits.
        let whole = self.bands.len() == 1 && pixels == band.pixels;
        let wave_samples = if whole {
            (self.slots / pixels).clamp(1, SAMPLES_A_WAVE).min(samples - c.sample)
        } else {
            1
        };
        let wave = Wave {
            band: c.band,
            first_pixel: band.first_pixel + c.pixel_in_band,
            pixels,
            first_sample: c.sample,
            samples: wave_samples,
        };
        c.pixel_in_band += pixels;
        if c.pixel_in_band == band.pixels {
            c.pixel_in_band = 0;
            c.band += 1;
        }
        if c.band == self.bands.len() {
            c.band = 0;
            c.sample += wave_samples;
        }
        c.done += u64::from(pixels) * u64::from(wave_samples);
        Some((wave, c))
    }

    fn run(&mut self, wave: &Wave) -> Result<Vec<Timings>> {
        let paths = wave.pixels * wave.samples;
        let mut timings = Vec::new();
        let mut status = Status {
            active_count: paths,
            ..Status::default()
        };
        let mut first = true;
        let mut stalls_in_a_row = 0;
        while first || status.active_count > 0 {
            let mut recorder = self.gpu.recorder("path wave")?;
            if let Some(pending) = &self.pending {
                self.record_resolve(&mut recorder, pending)?;
            }
            let resume_shadow = status.stalled == STALLED_SHADOW;
            // A stalled round leaves no groups to dispatch.
            let groups = group_counts(status.active_count);
            (status.item_groups, status.chunk_groups, status.scatter_groups) = (groups[0], groups[1], groups[1]);
            (status.stalled, status.unfinished) = (0, 0);
            recorder.pass("path: begin", |pass| {
                pass.update(self.buffers.status.view(), &[status])?;
                pass.memory_barrier(
                    Access::TRANSFER_WRITE | Access::COMPUTE,
                    Access::COMPUTE | Access::INDIRECT_READ,
                );
                Ok(())
            })?;
            if first {
                self.record_camera(&mut recorder, wave)?;
            }
            for bounce in 0..BOUNCES_PER_SUBMISSION {
                let parity = (status.rounds as usize + bounce) % 2;
                self.record_bounce(&mut recorder, wave, parity, bounce == 0 && resume_shadow)?;
            }
            recorder.pass("path: read status", |pass| {
                pass.memory_barrier(Access::COMPUTE, Access::TRANSFER_READ);
                pass.copy(
                    self.buffers.status.slice(0, size_of::<Status>() as u64),
                    self.buffers.readback.view(),
                )
            })?;
            timings.push(recorder.submit()?.wait()?);
            self.pending = None;
            let before = status.rounds;
            status = self.buffers.readback.read::<Status>(0, 1)?[0];
            if status.stalled != 0 {
                self.counters.stalls += 1;
                stalls_in_a_row = if status.rounds == before {
                    stalls_in_a_row + 1
                } else {
                    0
                };
                if stalls_in_a_row > STALLS_MAX {
                    return Err(Error::Overflow {
                        kernel: "path_extend".into(),
                        what: "iterations of a ray".into(),
                        needed: u64::from(stalls_in_a_row) * u64::from(self.settings.ray_quota),
                        capacity: u64::from(STALLS_MAX) * u64::from(self.settings.ray_quota),
                        instead: "rebuild the index".into(),
                    });
                }
            }
            first = false;
        }
        let wide = |words: [u32; 2]| u64::from(words[0]) | u64::from(words[1]) << 32;
        self.counters.paths += u64::from(paths);
        self.counters.extend_rays += wide(status.extend_rays);
        self.counters.shadow_rays += wide(status.shadow_rays);
        self.counters.waves += 1;
        self.pending = Some(*wave);
        Ok(timings)
    }

    fn record_camera(&self, recorder: &mut Recorder, wave: &Wave) -> Result<()> {
        let v = &self.view;
        let push = path_camera::Push {
            origin: v.origin,
            half_width: v.half_width,
            right: v.right,
            half_height: v.half_height,
            up: v.up,
            lens_radius: v.lens_radius,
            forward: v.forward,
            focus_distance: v.focus_distance,
            width: self.size[0],
            height: self.size[1],
            first_pixel: wave.first_pixel,
            pixel_count: wave.pixels,
            first_sample: wave.first_sample,
            sample_count: wave.samples,
            seed: self.settings.seed,
        };
        recorder.pass("path: camera", |pass| {
            let groups = self.pipelines.camera.groups_for(wave.pixels * wave.samples);
            pass.dispatch(&self.pipelines.camera, &[&self.buffers.set(0)], &push, [groups, 1, 1])?;
            stage_barrier(pass);
            Ok(())
        })
    }

    fn record_bounce(&self, recorder: &mut Recorder, wave: &Wave, parity: usize, resume_shadow: bool) -> Result<()> {
        let p = &self.pipelines;
        let paths = self.buffers.set(parity);
        let index: Bvh2Set<'_> = self.scene.index_set();
        let scene: SceneSet<'_> = self.scene.scene_set();
        let (first_pixel, pixel_count, first_sample, seed) =
            (wave.first_pixel, wave.pixels, wave.first_sample, self.settings.seed);
        let status = &self.buffers.status;
        let items = status.slice(std::mem::offset_of!(Status, item_groups) as u64, 12);
        let chunks = status.slice(std::mem::offset_of!(Status, chunk_groups) as u64, 12);
        let scatter = status.slice(std::mem::offset_of!(Status, scatter_groups) as u64, 12);
        if !resume_shadow {
            recorder.pass("path: extend", |pass| {
                match &p.trace {
                    TracePipelines::Opaque { extend, .. } => {
                        pass.dispatch_indirect(extend, &[&paths, &index], &(), items)?;
                    }
                    TracePipelines::Alpha { extend, .. } => {
                        let push = path_extend_alpha::Push {
                            first_pixel,
                            pixel_count,
                            first_sample,
                            seed,
                        };
                        pass.dispatch_indirect(extend, &[&paths, &index, &scene], &push, items)?;
                    }
                }
                stage_barrier(pass);
                Ok(())
            })?;
            let [lower, upper] = self.scene.bounds();
            let push = path_shade::Push {
                scene_lower: lower.to_array(),
                first_pixel,
                scene_upper: upper.to_array(),
                pixel_count,
                first_sample,
                seed,
                path_set: self.settings.path_set.packed(),
                roulette_start: self.settings.roulette_start,
                roulette_cap: self.settings.roulette_cap,
            };
            recorder.pass("path: shade", |pass| {
                pass.dispatch_indirect(&p.shade, &[&paths, &scene], &push, items)?;
                stage_barrier(pass);
                Ok(())
            })?;
        }
        if self.scene.has_lights() {
            recorder.pass("path: shadow", |pass| {
                match &p.trace {
                    TracePipelines::Opaque { shadow, .. } => {
                        pass.dispatch_indirect(shadow, &[&paths, &index], &(), items)?;
                    }
                    TracePipelines::Alpha { shadow, .. } => {
                        let push = path_shadow_alpha::Push {
                            first_pixel,
                            pixel_count,
                            first_sample,
                            seed,
                        };
                        pass.dispatch_indirect(shadow, &[&paths, &index, &scene], &push, items)?;
                    }
                }
                stage_barrier(pass);
                Ok(())
            })?;
        }
        recorder.pass("path: compact", |pass| {
            pass.dispatch_indirect(&p.count, &[&paths], &(), chunks)?;
            stage_barrier(pass);
            pass.dispatch(&p.scan, &[&paths], &(), [1, 1, 1])?;
            stage_barrier(pass);
            pass.dispatch_indirect(&p.scatter, &[&paths], &(), scatter)?;
            stage_barrier(pass);
            Ok(())
        })
    }

    fn record_resolve(&self, recorder: &mut Recorder, wave: &Wave) -> Result<()> {
        let band = &self.bands[wave.band];
        let push = path_resolve::Push {
            first_film_pixel: wave.first_pixel - band.first_pixel,
            pixel_count: wave.pixels,
            sample_count: wave.samples,
        };
        let film = path_resolve::Set1 {
            film_pixels: band.film.view(),
            film_aovs: band.aovs.view(),
        };
        recorder.pass("path: resolve", |pass| {
            let groups = self.pipelines.resolve.groups_for(wave.pixels);
            pass.dispatch(
                &self.pipelines.resolve,
                &[&self.buffers.set(0), &film],
                &push,
                [groups, 1, 1],
            )?;
            pass.memory_barrier(
                Access::COMPUTE,
                Access::COMPUTE | Access::TRANSFER_WRITE | Access::TRANSFER_READ,
            );
            Ok(())
        })
    }

    /// Adds the last wave to the film.
    fn flush(&mut self) -> Result<()> {
        let Some(wave) = self.pending.take() else { return Ok(()) };
        let mut recorder = self.gpu.recorder("path film")?;
        self.record_resolve(&mut recorder, &wave)?;
        recorder.submit()?.wait()?;
        Ok(())
    }

    fn clear(&mut self) -> Result<()> {
        self.pending = None;
        self.cursor = Cursor::default();
        let mut recorder = self.gpu.recorder("path film")?;
        recorder.pass("path: clear film", |pass| {
            for band in &self.bands {
                pass.fill(band.film.view(), 0)?;
                if self.settings.aovs {
                    pass.fill(band.aovs.view(), 0)?;
                }
            }
            Ok(())
        })?;
        recorder.submit()?.wait()?;
        Ok(())
    }
}

/// What every stage leaves behind is for the next one to read, write or take its arguments from.
fn stage_barrier(pass: &mut Pass<'_>) {
    pass.memory_barrier(
        Access::COMPUTE | Access::INDIRECT_READ,
        Access::COMPUTE | Access::INDIRECT_READ,
    );
}

/// Indirect arguments of stages with one invocation a place, and a chunk, of a queue.
fn group_counts(places: u32) -> [[u32; 3]; 2] {
    [places, places.div_ceil(COMPACT_CHUNK)].map(|count| [count.div_ceil(PATH_GROUP), 1, 1])
}

/// Mean and variance of the mean, per channel; zero for a pixel without samples.
fn statistics(pixel: &FilmPixel) -> ([f32; 3], [f32; 3]) {
    let n = f64::from(pixel.samples);
    let value = |pair: &crate::gpu::shaders::types::TwoFloat| {
        TwoFloat {
            hi: pair.hi,
            lo: pair.lo,
        }
        .to_f64()
    };
    let mean = |c: usize| if n > 0.0 { value(&pixel.sum[c]) / n } else { 0.0 };
    let variance = |c: usize| {
        if n > 1.0 {
            ((value(&pixel.square[c]) / n - mean(c) * mean(c)).max(0.0) / (n - 1.0)) as f32
        } else {
            0.0
        }
    };
    ([0, 1, 2].map(|c| mean(c) as f32), [0, 1, 2].map(variance))
}

impl View {
    fn new(camera: &Camera, size: [u32; 2]) -> Result<Self> {
        let aspect = f64::from(size[0]) / f64::from(size[1]);
        let axis = |v: DVec3| v.normalize_or_zero().as_vec3().to_array();
        let (half_height, orthographic) = match camera.projection {
            Projection::Perspective { fov_y } => ((0.5 * f64::from(fov_y)).tan(), false),
            Projection::Orthographic { half_height } => (f64::from(half_height), true),
        };
        let usable = half_height.is_finite()
            && half_height > 0.0
            && camera.transform.is_finite()
            && camera.lens_radius >= 0.0
            && camera.lens_radius.is_finite()
            && camera.focus_distance > 0.0
            && camera.focus_distance.is_finite()
            && camera.transform.translation.as_vec3().is_finite();
        if !usable {
            return Err(Error::Setting {
                name: "camera".into(),
                value: camera.name.clone(),
                cause: "has a field of view, lens or place that cannot be used".into(),
            });
        }
        let matrix = camera.transform.matrix3;
        Ok(Self {
            origin: camera.transform.translation.as_vec3().to_array(),
            right: axis(matrix.x_axis),
            up: axis(matrix.y_axis),
            forward: axis(-matrix.z_axis),
            half_width: (half_height * aspect) as f32,
            half_height: half_height as f32,
            lens_radius: camera.lens_radius,
            focus_distance: camera.focus_distance,
            orthographic,
        })
    }
}

/// Slots that one dispatch reaches and whose largest buffer can be bound, in whole workgroups.
fn slots_of_device(gpu: &Gpu) -> u32 {
    let slot_bytes = size_of::<PathState>().max(size_of::<ShadowRay>()) as u64;
    let by_range = gpu.caps().max_storage_buffer_range / slot_bytes;
    let by_groups = u64::from(gpu.caps().max_workgroups) * u64::from(PATH_GROUP);
    let slots = by_range.min(by_groups).min(1 << 22) as u32;
    slots - slots % PATH_GROUP
}

fn camera_pipeline(
    gpu: &Gpu,
    settings: &PathTracerSettings,
    view: &View,
    camera: &Camera,
) -> Result<ComputePipeline<path_camera::Kernel>> {
    gpu.compute_pipeline(&path_camera::Spec {
        sampler_kind: settings.sampler as u32,
        has_lens: camera.lens_radius > 0.0 && !view.orthographic,
        orthographic: view.orthographic,
        write_aovs: settings.aovs,
    })
}

impl Pipelines {
    fn new(gpu: &Gpu, scene: &GpuScene, settings: &PathTracerSettings, view: &View, camera: &Camera) -> Result<Self> {
        let (profile, bsdf) = (scene.profile(), scene.bsdf_features());
        let shade = path_shade::Spec {
            has_metal: bsdf.metal,
            has_conductor: bsdf.conductor,
            has_specular_layer: bsdf.specular_layer,
            has_transmission: bsdf.transmission,
            has_multiple_scattering: bsdf.multiple_scattering && settings.multiple_scattering,
            separable_masking: settings.separable_masking && (bsdf.metal || bsdf.specular_layer || bsdf.transmission),
            has_textures: profile.has_textures,
            has_shading_normals: profile.has_shading_normals,
            has_normal_maps: profile.has_normal_maps,
            has_vertex_colors: profile.has_vertex_colors,
            has_attenuation: profile.has_attenuation,
            has_unlit: profile.has_unlit,
            has_environment: profile.has_environment(),
            has_area_lights: scene.has_area_lights(),
            has_punctual_lights: scene.has_punctual_lights(),
            sampler_kind: settings.sampler as u32,
            write_aovs: settings.aovs,
            has_alpha: profile.has_alpha(),
        };
        Ok(Self {
            camera: camera_pipeline(gpu, settings, view, camera)?,
            trace: TracePipelines::new(gpu, scene, settings.ray_quota)?,
            shade: gpu.compute_pipeline(&shade)?,
            count: gpu.compute_pipeline(&())?,
            scan: gpu.compute_pipeline(&())?,
            scatter: gpu.compute_pipeline(&())?,
            resolve: gpu.compute_pipeline(&path_resolve::Spec {
                write_aovs: settings.aovs,
            })?,
        })
    }
}

impl TracePipelines {
    fn new(gpu: &Gpu, scene: &GpuScene, bvh2_quota: u32) -> Result<Self> {
        let profile = scene.profile();
        if !profile.has_alpha() {
            return Ok(Self::Opaque {
                extend: gpu.compute_pipeline(&path_extend::Spec {
                    bvh2_quota,
                    ..Default::default()
                })?,
                shadow: gpu.compute_pipeline(&path_shadow::Spec {
                    bvh2_quota,
                    ..Default::default()
                })?,
            });
        }
        let (has_textures, has_vertex_colors) = (profile.has_textures, profile.has_vertex_colors);
        let extend = path_extend_alpha::Spec {
            has_textures,
            has_vertex_colors,
            bvh2_quota,
            ..Default::default()
        };
        let shadow = path_shadow_alpha::Spec {
            has_textures,
            has_vertex_colors,
            bvh2_quota,
            ..Default::default()
        };
        Ok(Self::Alpha {
            extend: gpu.compute_pipeline(&extend)?,
            shadow: gpu.compute_pipeline(&shadow)?,
        })
    }

    fn info(&self) -> [PipelineInfo; 2] {
        match self {
            Self::Opaque { extend, shadow } => [extend.info(), shadow.info()],
            Self::Alpha { extend, shadow } => [extend.info(), shadow.info()],
        }
    }
}

impl WaveBuffers {
    fn new(gpu: &Gpu, slots: u32, aovs: bool) -> Result<Self> {
        let buffer = |name: &str, bytes: usize| {
            gpu.buffer(&BufferDesc::storage(
                name,
                bytes as u64 * u64::from(slots),
                Category::Work,
            ))
        };
        Ok(Self {
            status: gpu.buffer(&BufferDesc::storage(
                "path status",
                size_of::<Status>() as u64,
                Category::Work,
            ))?,
            queues: [buffer("path queue a", 4)?, buffer("path queue b", 4)?],
            rays: buffer("path rays", size_of::<Ray>())?,
            states: buffer("path states", size_of::<PathState>())?,
            hits: buffer("path hits", size_of::<Hit>())?,
            shadow: buffer("path shadow rays", size_of::<ShadowRay>())?,
            flags: buffer("path flags", 4)?,
            resume: buffer("path resume", 8)?,
            chunks: gpu.buffer(&BufferDesc::storage(
                "path chunks",
                u64::from(slots.div_ceil(COMPACT_CHUNK)) * 8,
                Category::Work,
            ))?,
            aovs: gpu.buffer(&BufferDesc::storage(
                "path aovs",
                if aovs {
                    u64::from(slots) * size_of::<PathAov>() as u64
                } else {
                    0
                },
                Category::Work,
            ))?,
            readback: gpu.buffer(&BufferDesc::readback(
                "path status readback",
                size_of::<Status>() as u64,
            ))?,
        })
    }

    /// Set 0 with the queues in the roles of a bounce of this parity.
    fn set(&self, parity: usize) -> PathBuffers<'_> {
        PathBuffers {
            status: self.status.view(),
            path_queue_in: self.queues[parity].view(),
            path_queue_out: self.queues[1 - parity].view(),
            path_rays: self.rays.view(),
            path_states: self.states.view(),
            path_hits: self.hits.view(),
            path_shadow_rays: self.shadow.view(),
            path_flags: self.flags.view(),
            path_resume: self.resume.view(),
            path_chunks: self.chunks.view(),
            path_aovs: self.aovs.view(),
        }
    }
}

impl Band {
    fn new(gpu: &Gpu, first_pixel: u32, pixels: u32, aovs: bool) -> Result<Self> {
        let buffer = |name: &str, bytes: u64| gpu.buffer(&BufferDesc::storage(name, bytes, Category::Film));
        let aov_bytes = if aovs {
            u64::from(pixels) * size_of::<FilmAov>() as u64
        } else {
            0
        };
        Ok(Self {
            first_pixel,
            pixels,
            film: buffer("film", u64::from(pixels) * size_of::<FilmPixel>() as u64)?,
            aovs: buffer("film aovs", aov_bytes)?,
        })
    }
}
