//! Eye subpaths: waves of consecutive pixels with the samples of a pass, on the path tracer's camera rays and film.

use super::connect::{Connect, ConnectStage};
use super::kernels::{Counts, Viewpoint, media_set_of, path_states, set_of, work};
use super::light_paths::LightPaths;
use super::settings::BidirectionalSettings;
use crate::Result;
use crate::film::GpuFilm;
use crate::gpu::ash::vk;
use crate::gpu::interface::BindingSet;
use crate::gpu::shaders::constants::{NO_MEDIUM, WALK_GROUP};
use crate::gpu::shaders::sets::{BidirectionalSet, PathSlotSet, WaveSet};
use crate::gpu::shaders::techniques::bidirectional::{bdpt_eye_medium, bdpt_shade};
use crate::gpu::shaders::techniques::path::{path_camera, path_resolve};
use crate::gpu::shaders::types::{CameraView, ConnectionState, MediumConnectionState, PartialWeights, PathAov};
use crate::gpu::{Access, Buffer, Category, ComputePipeline, Gpu, PipelineInfo, Recorder, TexelView};
use crate::transport::{GpuScene, surface_spec};
use crate::walk::{
    ArrivalStage, Bounce, WalkKey, WalkStages, WaveBuffers, WaveNeeds, default_slots, slots_of_device, stage_barrier,
};
use std::f32::consts::PI;

/// A wave: consecutive pixels of a band of the film × consecutive samples of a pass.
#[derive(Debug, Clone, Copy)]
pub(super) struct EyeWave {
    pub band: usize,
    pub first_pixel: u32,
    pub pixels: u32,
    pub first_sample: u32,
    pub samples: u32,
}

/// Where the next wave begins.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Cursor {
    band: usize,
    in_band: u32,
    /// Samples that all pixels have.
    pub sample: u32,
    /// Samples of each pixel in the waves of this way over the picture.
    samples: u32,
    /// Samples of all pixels.
    pub done: u64,
}

impl EyeWave {
    /// Its paths.
    pub fn paths(&self) -> u32 {
        self.pixels * self.samples
    }

    /// What their random numbers are keyed by.
    pub fn key(&self, seed: u32) -> WalkKey {
        WalkKey {
            first_sequence: self.first_pixel,
            first_index: self.first_sample,
            indices: self.samples,
            seed,
        }
    }
}

impl Cursor {
    /// The next wave of at most `slots` paths towards `wanted` samples per pixel, of which a pass has `samples_per_pass`; and where the one after it begins.
    pub fn next_wave(&self, film: &GpuFilm, slots: u32, samples_per_pass: u32, wanted: u32) -> (EyeWave, Self) {
        let mut c = *self;
        let bands = film.bands();
        let band = &bands[c.band];
        if c.band == 0 && c.in_band == 0 {
            let left = wanted.saturating_sub(c.sample);
            c.samples = (samples_per_pass - c.sample % samples_per_pass)
                .min(left)
                .clamp(1, slots);
        }
        let pixels = (band.pixels() - c.in_band).min(slots / c.samples);
        let wave = EyeWave {
            band: c.band,
            first_pixel: band.first_pixel() + c.in_band,
            pixels,
            first_sample: c.sample,
            samples: c.samples,
        };
        c.in_band += pixels;
        if c.in_band == band.pixels() {
            (c.band, c.in_band) = (c.band + 1, 0);
        }
        if c.band == bands.len() {
            (c.band, c.sample) = (0, c.sample + c.samples);
        }
        c.done += u64::from(wave.paths());
        (wave, c)
    }
}

/// What eye paths keep by slot or place beside their walks.
pub(super) struct EyeMemory {
    aovs: Buffer,
    pub weights: Buffer,
    /// Of connections, by place.
    pub states: Buffer,
    /// Of path sets that are more than a range of bounces.
    path_states: Option<Buffer>,
    pub counts: Counts,
    /// Stands where no light subpath has left vertices.
    pub no_vertices: TexelView,
}

impl EyeMemory {
    fn new(gpu: &Gpu, slots: u32, has_media: bool, settings: &BidirectionalSettings) -> Result<Self> {
        let format = vk::Format::R32G32B32A32_UINT;
        let states = if settings.joins() { slots } else { 1 };
        let aovs = if settings.aovs { slots } else { 1 };
        Ok(Self {
            aovs: work(gpu, "path aovs", size_of::<PathAov>(), aovs)?,
            weights: work(gpu, "eye subpath weights", size_of::<PartialWeights>(), slots)?,
            states: work(gpu, "connection states", connection_bytes(has_media), states)?,
            path_states: path_states(gpu, settings)?,
            counts: Counts::new(gpu)?,
            no_vertices: gpu.storage_texels("no light vertices", Category::Work, format, 1)?,
        })
    }

    /// Memory for as many slots as there is room for, up to what a pass of so many paths fills.
    ///
    /// # Errors
    /// As [`WaveBuffers::within_memory`].
    pub fn within(
        gpu: &Gpu,
        scene: &GpuScene,
        paths: u32,
        settings: &BidirectionalSettings,
    ) -> Result<(WaveBuffers, Self)> {
        let has_media = scene.profile().media.any();
        let needs = WaveNeeds {
            waiting: scene.has_lights(),
            media: has_media,
            airlight: false,
        };
        let wanted = match settings.paths_in_flight {
            0 => default_slots(gpu),
            wanted => wanted,
        };
        let mut slots = wanted
            .min(paths)
            .max(1)
            .next_multiple_of(WALK_GROUP)
            .min(slots_of_device(gpu));
        if settings.joins() {
            let range = gpu.caps().max_storage_buffer_range;
            slots = slots.min(slots_within(range, connection_bytes(has_media)));
        }
        WaveBuffers::within_memory(gpu, slots, needs, |slots| Self::new(gpu, slots, has_media, settings))
    }

    /// Set 1 of the path tracer's kernels; what they do not use is another buffer.
    pub fn path_slots(&self) -> PathSlotSet<'_> {
        PathSlotSet {
            path_aovs: self.aovs.view(),
            path_receivers: self.aovs.view(),
            path_departures: self.aovs.view(),
            path_even_distances: self.aovs.view(),
            path_flights: self.aovs.view(),
        }
    }

    fn set(&self) -> BidirectionalSet<'_> {
        self.set_with(&self.no_vertices)
    }

    /// The set with those vertices, and of the rest what eye paths have.
    pub fn set_with<'a>(&'a self, vertices: &'a TexelView) -> BidirectionalSet<'a> {
        BidirectionalSet {
            bidirectional_states: self.path_states.as_ref().unwrap_or(&self.weights).view(),
            ..set_of(vertices, &self.weights)
        }
    }
}

/// What a place keeps of its connections.
fn connection_bytes(has_media: bool) -> usize {
    if has_media {
        size_of::<MediumConnectionState>()
    } else {
        size_of::<ConnectionState>()
    }
}

/// Slots with so many bytes each of which a binding of so many holds all, in whole workgroups.
fn slots_within(range: u64, bytes: usize) -> u32 {
    let slots = (range / bytes as u64).min(u32::MAX.into()) as u32;
    slots - slots % WALK_GROUP
}

/// The kernels of eye paths; all but the last depend on the camera.
pub(super) struct EyeKernels {
    camera: ComputePipeline<path_camera::Kernel>,
    /// Only where there are media.
    medium: Option<ComputePipeline<bdpt_eye_medium::Kernel>>,
    shade: ComputePipeline<bdpt_shade::Kernel>,
    connect: Option<Connect>,
    resolve: ComputePipeline<path_resolve::Kernel>,
    pub view: Viewpoint,
}

impl EyeKernels {
    pub fn new(
        gpu: &Gpu,
        scene: &GpuScene,
        view: &Viewpoint,
        settings: &BidirectionalSettings,
        connects: bool,
    ) -> Result<Self> {
        let (profile, frame) = (scene.profile(), &view.frame);
        let camera = path_camera::Spec {
            sampler_kind: settings.sampler as u32,
            has_lens: frame.lens_radius > 0.0 && !frame.orthographic,
            orthographic: frame.orthographic,
            write_aovs: settings.aovs,
            numbered: false,
        };
        let shade = surface_spec!(bdpt_shade, scene, {
            has_multiple_scattering: scene.bsdf_features().multiple_scattering,
            separable_masking: false,
            has_environment: profile.has_environment(),
            has_area_lights: scene.has_area_lights(),
            has_punctual_lights: scene.has_punctual_lights(),
            has_alpha: profile.has_alpha(),
            has_media: profile.media.any(),
            has_light_tree: false,
            has_path_automaton: settings.has_states(),
            has_lobe_labels: false,
            sampler_kind: settings.sampler as u32,
            write_aovs: settings.aovs,
            strategy: settings.strategies.kind(),
            parallel_camera: frame.orthographic,
        });
        let medium = bdpt_eye_medium::Spec {
            // What surfaces scatter by is not compiled into this stage.
            has_textures: shade.has_textures,
            has_vertex_colors: shade.has_vertex_colors,
            has_shading_normals: false,
            has_normal_maps: false,
            has_absorption: shade.has_absorption,
            has_unlit: shade.has_unlit,
            has_instances: shade.has_instances,
            has_environment: shade.has_environment,
            has_area_lights: shade.has_area_lights,
            has_punctual_lights: shade.has_punctual_lights,
            has_alpha: shade.has_alpha,
            has_path_automaton: shade.has_path_automaton,
            sampler_kind: shade.sampler_kind,
            has_grids: profile.media.heterogeneous,
            has_homogeneous: profile.media.homogeneous,
            strategy: shade.strategy,
            parallel_camera: shade.parallel_camera,
            ..Default::default()
        };
        let medium = shade.has_media.then(|| gpu.compute_pipeline(&medium));
        let connect = connects.then(|| Connect::new(gpu, scene, frame.orthographic, settings));
        Ok(Self {
            camera: gpu.compute_pipeline(&camera)?,
            medium: medium.transpose()?,
            shade: gpu.compute_pipeline(&shade)?,
            connect: connect.transpose()?,
            resolve: gpu.compute_pipeline(&path_resolve::Spec {
                write_aovs: settings.aovs,
            })?,
            view: *view,
        })
    }

    pub fn pipelines(&self) -> Vec<PipelineInfo> {
        let mut all = vec![self.camera.info(), self.shade.info(), self.resolve.info()];
        all.extend(self.medium.as_ref().map(ComputePipeline::info));
        all.extend(self.connect.as_ref().map(Connect::pipeline));
        all
    }

    /// A submission of eye paths took so long.
    pub fn submitted(&mut self, seconds: f64) {
        if let Some(connect) = &mut self.connect {
            connect.submitted(seconds);
        }
    }

    /// A pixel's area in the picture at distance 1, or in m² of an orthographic camera.
    fn pixel_area(&self, [width, height]: [u32; 2]) -> f32 {
        let frame = &self.view.frame;
        4.0 * frame.half_width * frame.half_height / (width as f32 * height as f32)
    }
}

/// What all waves of eye paths need.
#[derive(Clone, Copy)]
pub(super) struct EyeParts<'a> {
    pub scene: &'a GpuScene,
    pub settings: &'a BidirectionalSettings,
    pub kernels: &'a EyeKernels,
    pub memory: &'a EyeMemory,
    /// [`GpuScene::emission_choice`].
    pub emission: Option<&'a TexelView>,
    /// Of the picture, in pixels.
    pub size: [u32; 2],
}

/// What the stages of a wave of eye paths need.
pub(super) struct EyeStages<'a> {
    parts: EyeParts<'a>,
    wave: EyeWave,
    camera_measure: f32,
    connect: Option<ConnectStage<'a>>,
}

impl<'a> EyeStages<'a> {
    pub fn new(parts: EyeParts<'a>, lights: Option<&'a LightPaths>, wave: EyeWave) -> Self {
        let EyeParts {
            scene,
            settings,
            kernels,
            memory,
            size,
            ..
        } = parts;
        let shown = lights.filter(|lights| lights.meet_the_camera());
        let camera_measure = shown.map_or(0.0, |lights| lights.walks()[1] as f32 * kernels.pixel_area(size));
        let connect = match (
            &kernels.connect,
            lights.map(|lights| (lights.vertices(), lights.walks())),
        ) {
            // Where no walk has left a vertex, there is nothing to join.
            (Some(connect), Some(((vertices, count), [walks, _]))) if count > 0 => Some(ConnectStage {
                connect,
                scene,
                memory,
                vertices,
                count,
                walks,
                key: wave.key(settings.seed),
                camera_forward: kernels.view.frame.forward,
                camera_measure,
            }),
            _ => None,
        };
        Self {
            parts,
            wave,
            camera_measure,
            connect,
        }
    }

    fn view(&self) -> CameraView {
        let v = &self.parts.kernels.view.frame;
        CameraView {
            origin: v.origin,
            half_width: v.half_width,
            right: v.right,
            half_height: v.half_height,
            up: v.up,
            lens_radius: v.lens_radius,
            forward: v.forward,
            focus_distance: v.focus_distance,
            width: self.parts.size[0],
            height: self.parts.size[1],
            interior: self.parts.kernels.view.interior,
        }
    }
}

impl WalkStages for EyeStages<'_> {
    fn record_start(&self, recorder: &mut Recorder, wave: &WaveSet<'_>) -> Result<()> {
        let EyeParts {
            settings,
            kernels,
            memory,
            ..
        } = self.parts;
        let camera = &kernels.camera;
        let push = path_camera::Push {
            view: self.view(),
            key: self.wave.key(settings.seed),
            slot_count: self.wave.paths(),
        };
        recorder.pass("bidirectional: camera", |pass| {
            let groups = [camera.groups_for(self.wave.paths()), 1, 1];
            pass.dispatch(camera, &[wave, &memory.path_slots()], &push, groups)?;
            stage_barrier(pass);
            Ok(())
        })
    }

    fn arrival(&self) -> Option<&dyn ArrivalStage> {
        self.connect.as_ref().map(|connect| connect as &dyn ArrivalStage)
    }

    /// What happens on the way through media, and where paths have arrived.
    fn record_scatter(&self, recorder: &mut Recorder, bounce: &Bounce<'_>) -> Result<()> {
        let EyeParts {
            scene,
            settings,
            kernels,
            memory,
            emission,
            ..
        } = self.parts;
        let [lower, upper] = scene.bounds();
        let radius = 0.5 * (upper - lower).length();
        let push = bdpt_shade::Push {
            scene_lower: lower.to_array(),
            least_bounces: settings.bounces()[0],
            scene_upper: upper.to_array(),
            most_bounces: settings.bounces()[1],
            key: self.wave.key(settings.seed),
            roulette_start: settings.roulette_start,
            roulette_cap: settings.roulette_cap,
            camera_forward: kernels.view.frame.forward,
            camera_measure: self.camera_measure,
            disk_pdf: if radius > 0.0 {
                1.0 / (PI * radius * radius)
            } else {
                0.0
            },
        };
        if let Some(medium) = &kernels.medium {
            let push = bdpt_eye_medium::Push {
                scene_lower: push.scene_lower,
                least_bounces: push.least_bounces,
                scene_upper: push.scene_upper,
                most_bounces: push.most_bounces,
                key: push.key,
                roulette_start: push.roulette_start,
                roulette_cap: push.roulette_cap,
                camera_forward: push.camera_forward,
                camera_measure: push.camera_measure,
                disk_pdf: push.disk_pdf,
                surrounding: scene.surrounding().unwrap_or(NO_MEDIUM),
            };
            recorder.pass("bidirectional: media", |pass| {
                let (of_scene, own) = (scene.emission_set(emission), memory.set());
                let media = media_set_of(scene, &memory.weights);
                let sets: [&dyn BindingSet<'_>; 4] = [&bounce.wave, &of_scene, &own, &media];
                pass.dispatch_indirect(medium, &sets, &push, bounce.places.items)?;
                stage_barrier(pass);
                Ok(())
            })?;
        }
        recorder.pass("bidirectional: shade", |pass| {
            let (scene, slots, own) = (scene.emission_set(emission), memory.path_slots(), memory.set());
            let sets: [&dyn BindingSet<'_>; 4] = [&bounce.wave, &slots, &scene, &own];
            pass.dispatch_indirect(&kernels.shade, &sets, &push, bounce.places.items)?;
            stage_barrier(pass);
            Ok(())
        })
    }

    /// The shadow rays to lights, which decide nothing but what is gathered.
    fn record_waiting(&self, recorder: &mut Recorder, bounce: &Bounce<'_>) -> Result<()> {
        if self.parts.scene.has_lights() {
            bounce.record_shadow(recorder)
        } else {
            Ok(())
        }
    }
}

/// Records a wave's way to the film, with what light subpaths show the camera, of which the wave's first sample is that of the pass.
///
/// # Errors
/// Those of recording.
pub(super) fn record_resolve(
    recorder: &mut Recorder,
    kernels: &EyeKernels,
    memory: &EyeMemory,
    buffers: &WaveBuffers,
    film: &GpuFilm,
    lights: Option<(&LightPaths, u32)>,
    wave: &EyeWave,
) -> Result<()> {
    let walks = buffers.set(0);
    if let Some((lights, sample_in_pass)) = lights {
        lights.record_add(recorder, &walks, wave, sample_in_pass)?;
    }
    let band = &film.bands()[wave.band];
    let push = path_resolve::Push {
        first_film_pixel: wave.first_pixel - band.first_pixel(),
        pixel_count: wave.pixels,
        sample_count: wave.samples,
        first_sample: 0,
        slot_count: wave.paths(),
        first_slot: 0,
    };
    recorder.pass("bidirectional: resolve", |pass| {
        let groups = [kernels.resolve.groups_for(wave.pixels), 1, 1];
        let (slots, film) = (memory.path_slots(), band.set());
        pass.dispatch(&kernels.resolve, &[&walks, &slots, &film], &push, groups)?;
        pass.memory_barrier(
            Access::COMPUTE,
            Access::COMPUTE | Access::TRANSFER_WRITE | Access::TRANSFER_READ,
        );
        Ok(())
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gpu::shaders::types::WalkState;

    /// Those of media are larger than what else a slot has, by which waves are made.
    #[test]
    fn states_of_connections_fit_a_binding() {
        const { assert!(size_of::<MediumConnectionState>() > size_of::<WalkState>()) };
        let range = 1 << 27;
        for has_media in [false, true] {
            let bytes = connection_bytes(has_media);
            let slots = slots_within(range, bytes);
            assert_eq!(slots % WALK_GROUP, 0);
            assert!(u64::from(slots) * bytes as u64 <= range, "{slots} of {bytes} bytes");
            assert!(
                u64::from(slots + WALK_GROUP) * bytes as u64 > range,
                "{slots} of {bytes} bytes"
            );
        }
    }
}
