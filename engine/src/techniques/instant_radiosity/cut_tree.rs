//! The tree over the virtual lights of a pass, made on the device: lights in the order of a Morton curve, and above them, level by level, nodes around two each.
//!
//! Source: D. Lin and C. Yuksel, "Real-Time Stochastic Lightcuts", I3D 2020, §4.1. Nodes are those of the path tracer's tree of lights
//! ([`light_tree`](crate::transport::light_tree)), and so is what chooses among them.
//!
//! Guarantees: deterministic, lights of equal codes in their order; twin [`perfect_light_tree`](crate::transport::light_tree::perfect_light_tree); memory of the
//! most lights so far, refused with the size needed where the device has no buffer as large.

use crate::accel::morton::{MORTON_30_AXIS_BITS, cells_per_length};
use crate::catalogue::{Bias, Role, Row, sources};
use crate::gpu::ash::vk;
use crate::gpu::shaders::constants::{LIGHT_NODE_QUARTERS, LIGHT_TREE_DEPTH_MAX};
use crate::gpu::shaders::techniques::instant_radiosity::{cut_keys, cut_leaves, cut_level};
use crate::gpu::shaders::types::SceneLightNode;
use crate::gpu::{
    Access, Buffer, BufferDesc, Category, ComputePipeline, Gpu, PipelineInfo, Recorder, TexelView, Timings,
};
use crate::kernels::{Count, KeyWidth, RadixSort, RadixSortOptions, SortBuffers};
use crate::transport::GpuScene;
use crate::{Error, Result};

/// Nodes of a tree of so many lights: those of the last level are as many, all others as if it were full.
fn nodes_of(lights: u32) -> u64 {
    u64::from(lights.next_power_of_two() - 1) + u64::from(lights)
}

/// Makes trees.
pub(super) struct CutTree {
    gpu: Gpu,
    sort: RadixSort,
    keys: ComputePipeline<cut_keys::Kernel>,
    leaves: ComputePipeline<cut_leaves::Kernel>,
    level: ComputePipeline<cut_level::Kernel>,
    memory: Option<Memory>,
}

/// Of a number of lights.
struct Memory {
    lights: u32,
    nodes: TexelView,
    keys: [TexelView; 2],
    order: [TexelView; 2],
    scratch: Buffer,
}

impl CutTree {
    pub fn new(gpu: &Gpu, scene: &GpuScene) -> Result<Self> {
        let mut options = RadixSortOptions::new(KeyWidth::Bits32, true);
        options.bits = 0..3 * MORTON_30_AXIS_BITS;
        let (profile, bsdf) = (scene.profile(), scene.bsdf_features());
        let leaves = cut_leaves::Spec {
            has_metal: bsdf.metal,
            has_specular_layer: bsdf.specular_layer,
            has_transmission: bsdf.transmission,
            has_shading_normals: profile.has_shading_normals,
            has_normal_maps: profile.has_normal_maps,
            ..Default::default()
        };
        Ok(Self {
            gpu: gpu.clone(),
            sort: RadixSort::new(gpu, options)?,
            keys: gpu.compute_pipeline(&())?,
            leaves: gpu.compute_pipeline(&leaves)?,
            level: gpu.compute_pipeline(&())?,
            memory: None,
        })
    }

    pub fn pipelines(&self) -> Vec<PipelineInfo> {
        let mut all = self.sort.pipelines();
        all.extend([self.keys.info(), self.leaves.info(), self.level.info()]);
        all
    }

    /// The nodes of the tree that was made last.
    pub fn nodes(&self) -> Option<&TexelView> {
        self.memory.as_ref().map(|memory| &memory.nodes)
    }

    /// Makes the tree of the first `count` lights, at least one, in one submission.
    ///
    /// # Errors
    /// [`Error::Overflow`] for more lights than a tree in a buffer of the device has, [`Error::OutOfMemory`], [`Error::DeviceLost`].
    pub fn build(&mut self, scene: &GpuScene, lights: &TexelView, count: u32) -> Result<Timings> {
        let enough = self.memory.take().filter(|memory| memory.lights >= count);
        let memory = match enough {
            Some(memory) => memory,
            None => self.memory_for(count)?,
        };
        let mut recorder = self.gpu.recorder("tree of virtual lights")?;
        self.record(&mut recorder, scene, lights, &memory, count)?;
        self.memory = Some(memory);
        recorder.submit()?.wait()
    }

    /// The nodes of the tree of so many lights that was made last, brought to the host.
    pub fn read(&self, gpu: &Gpu, count: u32) -> Result<Vec<SceneLightNode>> {
        match self.nodes() {
            Some(nodes) => gpu.read(nodes.buffer().view(), nodes_of(count) as usize),
            None => Ok(Vec::new()),
        }
    }

    fn memory_for(&self, count: u32) -> Result<Memory> {
        let caps = self.gpu.caps();
        let quarters = caps.max_texel_buffer_elements.min(caps.max_storage_buffer_range / 16);
        let most = quarters / u64::from(LIGHT_NODE_QUARTERS);
        let overflow = |needed: u64, capacity: u64| Error::Overflow {
            kernel: "cut_level".into(),
            what: "nodes of the tree of virtual lights".into(),
            needed,
            capacity,
            instead: "follow fewer walks per pass: setting `walks`".into(),
        };
        if count > 1 << LIGHT_TREE_DEPTH_MAX || nodes_of(count) > most {
            return Err(overflow(u64::from(count) * 2, most));
        }
        // Room for a quarter more, since passes differ.
        let lights = count.saturating_add(count / 4).min(self.sort.max_keys());
        let lights = if nodes_of(lights) > most { count } else { lights };
        let quarters = u64::from(LIGHT_NODE_QUARTERS) * nodes_of(lights);
        let category = Category::Work;
        Ok(Memory {
            lights,
            nodes: self.gpu.storage_texels(
                "tree of virtual lights",
                category,
                vk::Format::R32G32B32A32_UINT,
                quarters,
            )?,
            keys: [
                self.sort.keys("virtual light codes", lights)?,
                self.sort.keys("virtual light sorted codes", lights)?,
            ],
            order: [
                self.sort.values("virtual light order", lights)?,
                self.sort.values("virtual light sorted order", lights)?,
            ],
            scratch: self.gpu.buffer(&BufferDesc::storage(
                "virtual light sort",
                self.sort.scratch_bytes(lights),
                category,
            ))?,
        })
    }

    fn record(
        &self,
        recorder: &mut Recorder,
        scene: &GpuScene,
        lights: &TexelView,
        memory: &Memory,
        count: u32,
    ) -> Result<()> {
        let [lower, upper] = scene.bounds();
        recorder.pass("vpl: tree order", |pass| {
            let set = cut_keys::Set0 {
                virtual_light_texels: lights,
                light_keys: memory.keys[0].buffer().view(),
                light_order: memory.order[0].buffer().view(),
            };
            let push = cut_keys::Push {
                lower: lower.to_array(),
                scale: cells_per_length((upper - lower).max_element(), MORTON_30_AXIS_BITS),
                lights: count,
            };
            pass.memory_barrier(Access::COMPUTE, Access::COMPUTE);
            pass.dispatch(&self.keys, &[&set], &push, [self.keys.groups_for(count), 1, 1])?;
            pass.memory_barrier(Access::COMPUTE, Access::COMPUTE);
            let sides = SortBuffers {
                keys: [&memory.keys[0], &memory.keys[1]],
                values: Some([&memory.order[0], &memory.order[1]]),
            };
            self.sort.record(pass, &sides, Count::Host(count), &memory.scratch)?;
            pass.memory_barrier(Access::COMPUTE, Access::COMPUTE.union(Access::TRANSFER_WRITE));
            Ok(())
        })?;
        let depth = count.next_power_of_two().trailing_zeros();
        recorder.pass("vpl: tree", |pass| {
            let nodes = memory.nodes.buffer();
            let set = cut_leaves::Set0 {
                virtual_light_texels: lights,
                light_order: &memory.order[self.sort.result_side(count)],
                light_nodes: nodes.view(),
            };
            let push = cut_leaves::Push {
                first: (1 << depth) - 1,
                lights: count,
                nodes: nodes_of(count) as u32,
            };
            pass.dispatch(&self.leaves, &[&set], &push, [self.leaves.groups_for(count), 1, 1])?;
            pass.memory_barrier(Access::COMPUTE, Access::COMPUTE);
            let set = cut_level::Set0 {
                light_nodes: nodes.view(),
            };
            for level in (0..depth).rev() {
                let of_level = |level: u32| count.div_ceil(1 << (depth - level));
                let push = cut_level::Push {
                    first: (1 << level) - 1,
                    count: of_level(level),
                    children: of_level(level + 1),
                };
                pass.dispatch(&self.level, &[&set], &push, [self.level.groups_for(push.count), 1, 1])?;
                pass.memory_barrier(Access::COMPUTE, Access::COMPUTE);
            }
            Ok(())
        })
    }
}

/// Rows of the catalogue.
pub(super) const ROWS: &[Row] = &[
    Row {
        id: "CL-VPL-CUTS",
        name: "stochastic lightcuts over virtual lights: one light below each node of a cut through a tree of clusters of lights (MET-P9's) that the device makes, setting `selection` cuts of `vpl`",
        role: Role::PartOf("SVO-G0"),
        limits: "Cuts know nothing of shadows, of glossy lobes at either end, or of how often light was scattered; 2²⁰ virtual lights a pass where buffers have 128 MiB.",
        sources: &[
            sources::YUKSEL_2019.at("§3"),
            sources::LIN_YUKSEL_2020.at("§4.1"),
            sources::WALTER_2005.at("§4"),
            sources::CONTY_KULLA_2018.at("§4"),
        ],
        shaders: &[
            "shaders/techniques/instant_radiosity/cut_keys.comp",
            "shaders/techniques/instant_radiosity/cut_leaves.comp",
            "shaders/techniques/instant_radiosity/cut_level.comp",
            "shaders/techniques/instant_radiosity/vpl_gather.comp",
            "shaders/transport/light_cut.glsl",
            "shaders/transport/light_node.glsl",
            "shaders/transport/light_cone.glsl",
        ],
        bias: Some(Bias::Unbiased),
        tests: &[
            "engine/src/transport/light_tree/cut.rs::cuts_part_the_lights_and_estimates_are_unbiased",
            "engine/src/transport/light_tree/cut.rs::larger_cuts_spread_less",
            "engine/src/transport/light_tree/cut.rs::trees_are_perfect_but_for_their_end",
            "tests/tests/instant_radiosity/selection.rs::trees_hold_every_light_once_and_nodes_what_is_below",
            "tests/tests/instant_radiosity/selection.rs::trees_beyond_a_buffer_are_refused_with_their_size",
            "tests/tests/twins/light_tree.rs::cuts_agree_with_their_twins",
            "tests/tests/twins/light_tree.rs::unions_agree_with_their_twins",
            "tests/tests/instant_radiosity/selection.rs::cuts_agree_with_all_lights",
            "tests/tests/instant_radiosity/selection.rs::cuts_of_all_lights_are_all_lights",
            "tests/tests/instant_radiosity/selection.rs::cuts_do_not_depend_on_how_work_is_shared_out",
            "tests/tests/instant_radiosity/selection.rs::threads_and_vector_widths_never_show",
            "tests/tests/instant_radiosity/selection.rs::work_of_cuts_hardly_grows_with_the_lights",
        ],
        api: &["clerestory::transport::light_tree"],
        settings: &["selection", "cut_size"],
        ..Row::of(file!())
    },
    Row {
        id: "CL-VPL-RESAMPLED",
        name: "resampling below nodes of cuts: of several lights one is kept by what it would bring, setting `candidates` of `vpl`",
        role: Role::PartOf("CL-VPL-CUTS"),
        limits: "Each candidate is looked at as a connection is, so that it pays where shadow rays are dear or importances of the tree are far off; places share nothing.",
        sources: &[sources::TALBOT_2005.whole()],
        shaders: &["shaders/techniques/instant_radiosity/vpl_gather.comp"],
        bias: Some(Bias::Unbiased),
        tests: &["tests/tests/instant_radiosity/selection.rs::candidates_have_the_same_mean_and_less_noise"],
        settings: &["candidates"],
        ..Row::of(file!())
    },
];
