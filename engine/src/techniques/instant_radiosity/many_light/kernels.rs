//! The kernels of a frame, and the buffers between them.

use std::ops::Range;

use glam::Vec3;

use super::interleave::Interleaving;
use super::maps::{LAYOUT, Maps};
use super::settings::{ManyLightSettings, Visibility};
use crate::gpu::ash::vk;
use crate::gpu::interface::{BindingSet, SampledView};
use crate::gpu::shaders::constants::INTERLEAVE_GROUP;
use crate::gpu::shaders::sets::OmniShadowSet;
use crate::gpu::shaders::techniques::instant_radiosity::{
    deferred_direct, deferred_gather, deferred_merge, deferred_split,
};
use crate::gpu::shaders::types::{GatherState, SeenFrom, SplitPlace};
use crate::gpu::{
    Access, Buffer, BufferDesc, Category, ComputePipeline, Gpu, Image, Pass, PipelineInfo, SOFTWARE_LOOP_CAP, Sampler,
    SamplerDesc, TexelView, wide_counter,
};
use crate::raster::{Coverage, GBuffer, GBufferDesc, Layering, Output, Surfaces};
use crate::scene::camera_frame::CameraFrame;
use crate::techniques::Part;
use crate::techniques::instant_radiosity::gather::{connections_at_once, lights_at_once};
use crate::transport::edge_bound::EdgeBound;
use crate::transport::{GpuScene, surface_spec};
use crate::{Error, Result};

/// Tells the numbers of direct light from those that place a frame's pixels.
const DIRECT_SEED: u32 = 0x6469_7265;
/// Rays of a pixel for its direct light.
const DIRECT_RAYS: u64 = 2;
/// What a pixel of a filter takes, as so many steps of a ray through an index.
const FILTER_WORK: u64 = 8;

/// What a frame sees.
pub(super) struct Seen {
    pub gbuffer: GBuffer,
    pub coverage: Coverage,
    sampler: Sampler,
}

impl Seen {
    /// For pictures of `size` pixels, with what tells neighbours on the same surface if those are asked for, and what a history reads if there is one.
    pub fn new(
        gpu: &Gpu,
        surfaces: &Surfaces<'_>,
        size: [u32; 2],
        has_neighbours: bool,
        has_history: bool,
    ) -> Result<Self> {
        let mut outputs = vec![Output::Triangle, Output::Weights];
        if has_neighbours || has_history {
            outputs.extend([Output::Position, Output::Normals]);
        }
        if has_history {
            outputs.push(Output::Object);
        }
        let desc = GBufferDesc {
            size,
            layering: Layering::One,
            outputs: &outputs,
        };
        Ok(Self {
            gbuffer: GBuffer::new(gpu, surfaces, &desc)?,
            coverage: Coverage::new(gpu)?,
            sampler: gpu.sampler(&SamplerDesc {
                name: "seen texels",
                filter: vk::Filter::NEAREST,
                address: vk::SamplerAddressMode::CLAMP_TO_EDGE,
            })?,
        })
    }

    /// Makes what was drawn visible to compute shaders.
    pub fn show(&self, pass: &mut Pass<'_>) {
        let layout = vk::ImageLayout::SHADER_READ_ONLY_OPTIMAL;
        self.gbuffer.barrier_to(pass, Access::COMPUTE_READ, layout);
    }

    /// One of its pictures, or another that stands for it where it was not asked for, which the kernel then does not read.
    pub fn view(&self, output: Output, other: Output) -> Result<SampledView<'_>> {
        let image = |output| self.gbuffer.image(output);
        let image: &Image = image(output).or_else(|| image(other)).ok_or_else(|| Error::Picture {
            path: output.name().into(),
            cause: "was not asked for".into(),
        })?;
        Ok(SampledView {
            image,
            sampler: &self.sampler,
        })
    }

    pub fn triangles(&self) -> Result<SampledView<'_>> {
        self.view(Output::Triangle, Output::Triangle)
    }

    pub fn weights(&self) -> Result<SampledView<'_>> {
        self.view(Output::Weights, Output::Weights)
    }

    pub fn positions(&self) -> Result<SampledView<'_>> {
        self.view(Output::Position, Output::Weights)
    }

    pub fn normals(&self) -> Result<SampledView<'_>> {
        self.view(Output::Normals, Output::Triangle)
    }

    pub fn objects(&self) -> Result<SampledView<'_>> {
        self.view(Output::Object, Output::Object)
    }
}

/// From where a frame is seen, as kernels take it.
pub(super) fn seen_from(camera: &CameraFrame, [width, height]: [u32; 2]) -> SeenFrom {
    let scaled = |axis: [f32; 3], by: f32| (Vec3::from_array(axis) * by).to_array();
    SeenFrom {
        origin: camera.origin,
        width,
        right: scaled(camera.right, camera.half_width),
        height,
        down: scaled(camera.up, -camera.half_height),
        is_parallel: camera.orthographic.into(),
        forward: camera.middle().to_array(),
    }
}

/// Of a ray of a kernel that has stopped at its quota, for good.
pub(super) fn ray_stopped(kernel: &str, quota: u32) -> Error {
    Error::Overflow {
        kernel: kernel.into(),
        what: "steps of a ray through the index".into(),
        needed: u64::from(quota) + 1,
        capacity: quota.into(),
        instead: "choose another ray index".into(),
    }
}

/// What a frame's kernels look at.
pub(super) struct Sight<'a> {
    pub scene: &'a GpuScene,
    pub seen: &'a Seen,
    pub from: SeenFrom,
}

/// Light without virtual lights.
pub(super) struct Direct {
    pipeline: ComputePipeline<deferred_direct::Kernel>,
    seed: u32,
    /// Pixels of a submission.
    pub pixels: u32,
}

impl Direct {
    pub fn new(gpu: &Gpu, scene: &GpuScene, settings: &ManyLightSettings, pixels: u32) -> Result<Self> {
        // Two thirds for the two rays, the rest for the choice of a light.
        let each = SOFTWARE_LOOP_CAP / 3;
        let (index, filters) = (scene.filtered_index_within(gpu, each)?, scene.profile().has_alpha());
        let spec = surface_spec!(deferred_direct, scene, {
            has_multiple_scattering: scene.bsdf_features().multiple_scattering,
            separable_masking: false,
            has_alpha: filters,
            has_environment: scene.profile().has_environment(),
            has_area_lights: scene.has_area_lights(),
            has_punctual_lights: scene.has_punctual_lights(),
            has_light_tree: false,
            sampler_kind: settings.sampler as u32,
            shows_emitted: settings.shows(0),
            shows_direct: settings.shows(1) && scene.has_lights(),
            index_quota: index.quota,
            index_kind: index.kind,
            ..Default::default()
        });
        let work = DIRECT_RAYS * index.steps * u64::from(pixels);
        Ok(Self {
            pipeline: scene.index_traversal().pipeline(gpu, &spec)?,
            seed: settings.seed ^ DIRECT_SEED,
            pixels: pixels.div_ceil(Part::count(gpu, work)).max(1),
        })
    }

    pub fn info(&self) -> PipelineInfo {
        self.pipeline.info()
    }

    pub fn set_seed(&mut self, seed: u32) {
        self.seed = seed ^ DIRECT_SEED;
    }

    /// Radiance of these pixels.
    pub fn record(
        &self,
        pass: &mut Pass<'_>,
        sight: &Sight<'_>,
        frame: u32,
        pixels: Range<u32>,
        radiance: &Buffer,
    ) -> Result<()> {
        let Sight { scene, seen, from } = sight;
        let [lower, upper] = scene.bounds().map(|corner| corner.to_array());
        let groups = self.pipeline.groups_over(pixels.len() as u32);
        let push = deferred_direct::Push {
            seen: *from,
            scene_lower: lower,
            frame,
            scene_upper: upper,
            seed: self.seed,
            first_pixel: pixels.start,
            end_pixel: pixels.end,
        };
        let set = deferred_direct::Set0 {
            seen_triangles: seen.triangles()?,
            seen_weights: seen.weights()?,
            radiance: radiance.view(),
        };
        let (index, scene) = (scene.index_set(), scene.scene_set());
        pass.dispatch(&self.pipeline, &[&set, &index, &scene], &push, groups)
    }
}

type Counters = deferred_gather::DeferredCounters;

/// A frame's virtual lights, and how tiles share them out.
#[derive(Debug, Clone, Copy)]
pub(super) struct SharedLights {
    pub count: u32,
    /// The part of them that the first tile has.
    pub first_subset: u32,
}

/// What sweeps over places have done.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Swept {
    pub remaining: u32,
    pub connections: u64,
    pub tests: u64,
}

/// The split picture, and what gathers there and goes back.
pub(super) struct Split {
    pub interleaving: Interleaving,
    size: [u32; 2],
    tiles: u32,
    pub subsets: u32,
    split: ComputePipeline<deferred_split::Kernel>,
    gather: ComputePipeline<deferred_gather::Kernel>,
    merge: ComputePipeline<deferred_merge::Kernel>,
    plane_max: f32,
    normal_min: f32,
    bound: EdgeBound,
    scale: f32,
    places: Buffer,
    states: Buffer,
    colors: Buffer,
    counters: Buffer,
    counters_readback: Buffer,
    no_maps: Buffer,
    pub lights_at_once: u32,
    /// Places of a dispatch, in whole workgroups.
    pub places_at_once: u32,
    /// Sweeps of as many places for a submission.
    pub connections: u64,
    /// Pixels of a submission that merges.
    pub pixels: u32,
}

impl Split {
    /// For pictures of `size` pixels that have other light beside it, or not.
    pub fn new(
        gpu: &Gpu,
        scene: &GpuScene,
        settings: &ManyLightSettings,
        size: [u32; 2],
        adds: bool,
        has_maps: bool,
    ) -> Result<Self> {
        let interleaving = Interleaving::new(size, settings.interleave);
        let places = interleaving.places();
        let places = u32::try_from(places).map_err(|_| Error::LimitExceeded {
            name: "places of a split picture".into(),
            value: places,
            limit_name: "numbers of places",
            limit: u32::MAX.into(),
        })?;
        let bound = settings.edge_bound(scene.surface_area());
        let (lights_at_once, index_quota) = lights_at_once(gpu, scene, settings.lights_at_once)?;
        let traversal = scene.index_traversal();
        let spec = surface_spec!(deferred_gather, scene, {
            has_multiple_scattering: scene.bsdf_features().multiple_scattering,
            separable_masking: false,
            has_alpha: scene.profile().has_alpha(),
            edge_bound: bound.kind(),
            lights_at_once,
            visibility: settings.visibility.kind(),
            keeps_colors: settings.keeps_colors(),
            shadow_kind: if has_maps { LAYOUT.kind() } else { 0 },
            shadow_width: 0,
            index_quota,
            index_kind: traversal.kind(),
            ..Default::default()
        });
        let buffer = |name, bytes: usize, count: u32| {
            let bytes = bytes as u64 * u64::from(count);
            gpu.buffer(&BufferDesc::storage(name, bytes, Category::Work))
        };
        let (filters, counters) = (settings.filters(), size_of::<Counters>());
        let colors = if settings.keeps_colors() { places } else { 1 };
        let [lower, upper] = scene.bounds();
        let connections = connections_at_once(gpu);
        let at_once = (connections / lights_at_once).max(1);
        let pixels = size[0] * size[1];
        let window = if filters {
            u64::from(settings.interleave + 1).pow(2)
        } else {
            1
        };
        let merges = Part::count(gpu, FILTER_WORK * window * u64::from(pixels));
        Ok(Self {
            interleaving,
            size,
            tiles: settings.interleave,
            subsets: settings.subsets(),
            split: gpu.compute_pipeline(&Default::default())?,
            gather: if settings.visibility == Visibility::Rays {
                traversal.pipeline(gpu, &spec)?
            } else {
                gpu.compute_pipeline(&spec)?
            },
            merge: gpu.compute_pipeline(&deferred_merge::Spec { filters, adds })?,
            plane_max: settings.filter_plane * (upper - lower).length(),
            normal_min: settings.filter_normal,
            bound,
            scale: 1.0 / settings.lights as f32,
            places: buffer("split places", size_of::<SplitPlace>(), places)?,
            states: buffer("split states", size_of::<GatherState>(), places)?,
            colors: buffer("split colors", size_of::<[f32; 3]>(), colors)?,
            counters: buffer("deferred counters", counters, 1)?,
            counters_readback: gpu.buffer(&BufferDesc::readback("deferred counters", counters as u64))?,
            no_maps: gpu.buffer_with("no shadows", Category::Light, &[f32::INFINITY])?,
            lights_at_once,
            places_at_once: at_once.next_multiple_of(INTERLEAVE_GROUP),
            connections: connections.into(),
            pixels: pixels.div_ceil(merges).max(1),
        })
    }

    pub fn pipelines(&self) -> [PipelineInfo; 3] {
        [self.split.info(), self.gather.info(), self.merge.info()]
    }

    /// Bytes of what places keep.
    pub fn bytes(&self) -> u64 {
        [&self.places, &self.states, &self.colors]
            .map(Buffer::bytes)
            .iter()
            .sum()
    }

    /// The G-buffer by tiles, before the first of the lights.
    pub fn record_split(&self, pass: &mut Pass<'_>, seen: &Seen, lights: SharedLights) -> Result<()> {
        let push = deferred_split::Push {
            width: self.size[0],
            height: self.size[1],
            interleave: self.tiles,
            subsets: self.subsets,
            first_subset: lights.first_subset,
            lights: lights.count,
        };
        let set = deferred_split::Set0 {
            seen_triangles: seen.triangles()?,
            seen_weights: seen.weights()?,
            split_places: self.places.view(),
            split_states: self.states.view(),
        };
        let groups = self.split.groups_over(self.interleaving.places() as u32);
        pass.dispatch(&self.split, &[&set], &push, groups)?;
        pass.memory_barrier(Access::COMPUTE, Access::COMPUTE);
        Ok(())
    }

    /// Sweeps over a range of places, each of which takes more of the frame's lights there; the first of those that have a map now, and the end of them.
    pub fn record_sweeps(
        &self,
        pass: &mut Pass<'_>,
        scene: &GpuScene,
        from: SeenFrom,
        (records, lights): (&TexelView, SharedLights),
        (maps, mapped): (Option<&Maps>, Range<u32>),
        (places, sweeps): (Range<u32>, u32),
    ) -> Result<()> {
        let [lower, upper] = scene.bounds().map(|corner| corner.to_array());
        let push = deferred_gather::Push {
            seen: from,
            scene_lower: lower,
            edge_bound: self.bound.value(),
            scene_upper: upper,
            lights: lights.count,
            end_light: mapped.end,
            first_place: places.start,
            end_place: places.end,
            interleave: self.tiles,
            subsets: self.subsets,
            first_subset: lights.first_subset,
            first_map: mapped.start,
            map_side: maps.map_or(0, |maps| maps.side() as i32),
        };
        let set = deferred_gather::Set0 {
            virtual_light_texels: records,
            split_places: self.places.view(),
            split_states: self.states.view(),
            split_colors: self.colors.view(),
            deferred_counters: self.counters.view(),
        };
        let shadows = maps.map_or(
            OmniShadowSet {
                shadow_distances: self.no_maps.view(),
            },
            Maps::set,
        );
        let (index, scene) = (scene.index_set(), scene.scene_set());
        let sets: [&dyn BindingSet<'_>; 4] = [&set, &index, &scene, &shadows];
        let groups = self.gather.groups_over(places.len() as u32);
        let remaining = std::mem::offset_of!(Counters, remaining) as u64;
        for sweep in 0..sweeps {
            if sweep == 0 {
                pass.fill(self.counters.view(), 0)?;
            } else {
                pass.memory_barrier(Access::COMPUTE, Access::TRANSFER_WRITE);
                pass.fill(self.counters.slice(remaining, size_of::<u32>() as u64), 0)?;
            }
            pass.memory_barrier(Access::TRANSFER_WRITE | Access::COMPUTE, Access::COMPUTE);
            pass.dispatch(&self.gather, &sets, &push, groups)?;
        }
        pass.memory_barrier(Access::COMPUTE, Access::COMPUTE | Access::TRANSFER_READ);
        pass.copy(self.counters.view(), self.counters_readback.view())
    }

    /// What the sweeps of the last submission have done.
    pub fn swept(&self) -> Result<Swept> {
        let counters = self.counters_readback.read::<Counters>(0, 1)?[0];
        Ok(Swept {
            remaining: counters.remaining,
            connections: wide_counter(counters.connections),
            tests: wide_counter(counters.tests),
        })
    }

    /// Sums of these pixels to the picture.
    pub fn record_merge(
        &self,
        pass: &mut Pass<'_>,
        seen: &Seen,
        lights: SharedLights,
        pixels: Range<u32>,
        radiance: &Buffer,
    ) -> Result<()> {
        let groups = self.merge.groups_over(pixels.len() as u32);
        let push = deferred_merge::Push {
            width: self.size[0],
            height: self.size[1],
            interleave: self.tiles,
            subsets: self.subsets,
            first_subset: lights.first_subset,
            lights: lights.count,
            scale: self.scale,
            plane_max: self.plane_max,
            normal_min: self.normal_min,
            first_pixel: pixels.start,
            end_pixel: pixels.end,
        };
        let set = deferred_merge::Set0 {
            split_states: self.states.view(),
            split_colors: self.colors.view(),
            seen_positions: seen.positions()?,
            seen_normals: seen.normals()?,
            radiance: radiance.view(),
        };
        pass.dispatch(&self.merge, &[&set], &push, groups)
    }

    /// Of surfaces, by place, where settings keep them.
    pub fn colors(&self) -> &Buffer {
        &self.colors
    }
}
