//! Graphics pipelines made from reflected shaders.
//!
//! Deliberately small: dynamic rendering, one sample, no vertex input (shaders pull vertices from buffers by `gl_VertexIndex`), a vertex
//! and a fragment shader, and a geometry shader between them where one is named. What a shader needs of a device is known by reflection,
//! and a device that lacks it is an error that names the way round. Bindings of all stages are checked against barriers as those of
//! compute passes are.

use std::marker::PhantomData;
use std::sync::Arc;

use ash::vk;

use super::device::{Gpu, Inner};
use super::image::texel_bytes;
use super::interface::{Capability, FragmentShader, GeometryShader, ShaderInfo, SpecConstants, Stage, VertexShader};
use super::layout::{PipelineObjects, ShaderModule, specialization_data, stage_flags};
use super::pipeline::PipelineInfo;
use crate::{Error, Result};

/// Which triangles are dropped; front faces are counter-clockwise in the picture (y downwards).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Cull {
    /// None.
    #[default]
    None,
    /// Those seen from behind.
    Back,
    /// Those seen from the front.
    Front,
}

/// An offset of all depths, for the surfaces of shadow maps.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct DepthBias {
    /// In units of the least step that the depth format resolves there.
    pub constant: f32,
    /// In units of the triangle's greatest change of depth from pixel to pixel.
    pub slope: f32,
}

/// What stands between the vertex and the fragment shader: a [`GeometryShader`], or [`NoGeometry`].
///
/// # Safety
/// As of a [`GeometryShader`], where there is a shader.
pub unsafe trait GeometryStage {
    /// Specialization constants, `()` for none.
    type Spec: SpecConstants;
    /// The reflected interface of the shader, if there is one.
    fn info() -> Option<&'static ShaderInfo>;
}

// SAFETY: that of the shader.
unsafe impl<G: GeometryShader> GeometryStage for G {
    type Spec = G::Spec;

    fn info() -> Option<&'static ShaderInfo> {
        Some(G::info())
    }
}

/// Primitives go straight from the vertex shader to the rasterizer.
#[derive(Debug)]
pub enum NoGeometry {}

// SAFETY: there is no shader.
unsafe impl GeometryStage for NoGeometry {
    type Spec = ();

    fn info() -> Option<&'static ShaderInfo> {
        None
    }
}

/// What a graphics pipeline is made of, beside its shaders.
#[derive(Debug, Clone)]
pub struct GraphicsDesc<'a, V: VertexShader, F: FragmentShader, G: GeometryStage = NoGeometry> {
    /// Specialization constants of the vertex shader.
    pub vertex: V::Spec,
    /// Specialization constants of the geometry shader.
    pub geometry: G::Spec,
    /// Specialization constants of the fragment shader.
    pub fragment: F::Spec,
    /// Formats of the colour attachments by the fragment shader's output locations; `UNDEFINED` for an output that goes nowhere.
    pub colors: &'a [vk::Format],
    /// Format of the depth attachment; with one, depth is tested and written.
    pub depth: Option<vk::Format>,
    /// The comparison of a fragment's depth (left) with the depth that is there (right) by which the fragment stays.
    pub depth_compare: vk::CompareOp,
    /// The offset of all depths.
    pub depth_bias: Option<DepthBias>,
    /// Layers that each primitive is rendered into, one bit a view, with `gl_ViewIndex` as their number; 0 for rendering without views.
    pub view_mask: u32,
    /// How vertices make primitives.
    pub topology: vk::PrimitiveTopology,
    /// Which triangles are dropped.
    pub cull: Cull,
    /// Colour is added to what is there instead of replacing it.
    pub additive: bool,
}

impl<V: VertexShader, F: FragmentShader, G: GeometryStage> Default for GraphicsDesc<'_, V, F, G> {
    /// Triangles, no culling, no attachment; of depths the lesser or an equal one stays.
    fn default() -> Self {
        Self {
            vertex: V::Spec::default(),
            geometry: G::Spec::default(),
            fragment: F::Spec::default(),
            colors: &[],
            depth: None,
            depth_compare: vk::CompareOp::LESS_OR_EQUAL,
            depth_bias: None,
            view_mask: 0,
            topology: vk::PrimitiveTopology::TRIANGLE_LIST,
            cull: Cull::None,
            additive: false,
        }
    }
}

/// A graphics pipeline of the shaders `V` and `F`, with `G` between them. Cloning shares it.
pub struct GraphicsPipeline<V, F, G = NoGeometry> {
    pub(super) inner: Arc<GraphicsInner>,
    shaders: Shaders<V, F, G>,
}

/// The shaders as types that are sent between threads whatever they are.
type Shaders<V, F, G> = PhantomData<fn() -> (V, F, G)>;

impl<V, F, G> Clone for GraphicsPipeline<V, F, G> {
    fn clone(&self) -> Self {
        Self {
            inner: Arc::clone(&self.inner),
            shaders: PhantomData,
        }
    }
}

impl<V, F, G> GraphicsPipeline<V, F, G> {
    /// What it was made of: its shaders in the order of the stages.
    pub fn info(&self) -> Vec<PipelineInfo> {
        let inner = &self.inner;
        let stages = inner.shaders.iter().zip(&inner.specs);
        stages.map(|(shader, spec)| PipelineInfo::of(shader, spec)).collect()
    }
}

impl<V, F, G> std::fmt::Debug for GraphicsPipeline<V, F, G> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let mut tuple = f.debug_tuple("GraphicsPipeline");
        for shader in &self.inner.shaders {
            tuple.field(&shader.name);
        }
        tuple.finish()
    }
}

pub(super) struct GraphicsInner {
    pub objects: PipelineObjects,
    /// In the order of the stages.
    pub shaders: Vec<&'static ShaderInfo>,
    pub attachments: Attachments,
    /// Constants of each shader.
    specs: Vec<Vec<(u32, u32)>>,
}

impl GraphicsInner {
    /// The stages that see the push constants.
    pub fn stages(&self) -> vk::ShaderStageFlags {
        let stages = self.shaders.iter().map(|shader| stage_flags(shader.stage));
        stages.fold(vk::ShaderStageFlags::empty(), |all, stage| all | stage)
    }
}

/// What a pipeline is made for, and what it is drawn into: they must be equal.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Attachments {
    pub colors: Vec<vk::Format>,
    pub depth: Option<vk::Format>,
    pub view_mask: u32,
}

impl Gpu {
    /// Makes a graphics pipeline. The vertex shader's push-constant block is the pipeline's; the other shaders declare the same block or
    /// none.
    ///
    /// # Errors
    /// [`Error::Shader`] when the shaders do not agree on a binding or on the push constants, [`Error::MissingFeature`] on a queue without
    /// graphics, when a shader needs what the device lacks (geometry shaders, clip distances, views, layers from vertex shaders), writes
    /// buffers or images from a stage that cannot, when the descriptors, attachments or views are more than the device allows, or for a format that
    /// the device cannot render into, [`Error::Setting`] for a topology or comparison beyond those of pipelines without tessellation
    /// or a topology that the geometry shader does not take,
    /// [`Error::OutOfMemory`], [`Error::Vulkan`].
    pub fn graphics_pipeline<V: VertexShader, F: FragmentShader, G: GeometryStage>(
        &self,
        desc: &GraphicsDesc<'_, V, F, G>,
    ) -> Result<GraphicsPipeline<V, F, G>> {
        let shaders: Vec<_> = [Some(V::info()), G::info(), Some(F::info())]
            .into_iter()
            .flatten()
            .collect();
        self.inner.check_alive()?;
        check_shaders(&self.inner, &shaders)?;
        check_attachments(&self.inner, shaders[0].name, desc.colors, desc.view_mask)?;
        check_state(&self.inner, shaders[0].name, desc)?;
        check_topology(desc.topology, G::info())?;
        let attachments = desc.colors.len() as u32;
        let mut objects = PipelineObjects::new(&self.inner, &shaders, attachments)?;
        let name = shaders[0].name;
        let specs: Vec<_> = shaders
            .iter()
            .map(|shader| match shader.stage {
                Stage::Geometry => desc.geometry.values(),
                Stage::Fragment => desc.fragment.values(),
                _ => desc.vertex.values(),
            })
            .collect();
        objects.set_pipeline(make(&self.inner, &shaders, &specs, objects.layout, desc)?, name);
        let inner = GraphicsInner {
            objects,
            shaders,
            specs,
            attachments: Attachments {
                colors: desc.colors.to_vec(),
                depth: desc.depth,
                view_mask: desc.view_mask,
            },
        };
        Ok(GraphicsPipeline {
            inner: Arc::new(inner),
            shaders: PhantomData,
        })
    }
}

fn missing(gpu: &Inner, feature: impl Into<String>, needed_by: &str, instead: &str) -> Error {
    Error::MissingFeature {
        feature: feature.into(),
        needed_by: needed_by.into(),
        device: gpu.caps.device.clone(),
        instead: instead.into(),
    }
}

fn check_shaders(gpu: &Inner, shaders: &[&'static ShaderInfo]) -> Result<()> {
    let vertex = shaders[0];
    if !gpu.caps.graphics {
        let instead = "choose a device that has one";
        return Err(missing(gpu, "a graphics queue", vertex.name, instead));
    }
    for shader in shaders {
        for capability in shader.capabilities {
            check_capability(gpu, shader, *capability)?;
        }
        let (stores, feature) = match shader.stage {
            Stage::Fragment => (gpu.caps.fragment_stores, "fragmentStoresAndAtomics"),
            _ => (gpu.caps.vertex_stores, "vertexPipelineStoresAndAtomics"),
        };
        if !stores && shader.used_bindings().any(|binding| binding.writes) {
            return Err(missing(gpu, feature, shader.name, "write from a compute shader"));
        }
        let disagree = |message| {
            Err(Error::Shader {
                name: shader.name.into(),
                message,
            })
        };
        if shader.push_constant_bytes > 0 && shader.push_constant_bytes != vertex.push_constant_bytes {
            return disagree(format!(
                "its push constants have {} bytes, those of {} have {}",
                shader.push_constant_bytes, vertex.name, vertex.push_constant_bytes
            ));
        }
        for binding in shader.bindings {
            let place = (binding.set, binding.binding);
            let same_place = |other: &&'static ShaderInfo| {
                let found = other.bindings.iter().find(|b| (b.set, b.binding) == place)?;
                (found.kind != binding.kind).then_some(other.name)
            };
            if let Some(other) = shaders.iter().find_map(same_place) {
                return disagree(format!(
                    "binding {} is a {:?} here and another thing in {other}",
                    binding.name, binding.kind
                ));
            }
        }
    }
    Ok(())
}

fn check_capability(gpu: &Inner, shader: &ShaderInfo, capability: Capability) -> Result<()> {
    let (offered, feature, instead) = match capability {
        Capability::Geometry => (
            gpu.caps.geometry_shader,
            "geometryShader",
            "render once for each layer, or by views",
        ),
        Capability::ClipDistance => (
            gpu.caps.max_clip_distances > 0,
            "shaderClipDistance",
            "discard fragments by the distance instead",
        ),
        Capability::MultiView => (
            gpu.caps.max_views > 0,
            "multiview",
            "render once for each view, with the view's number in the push constants",
        ),
        Capability::VertexLayer => (
            gpu.caps.vertex_layer,
            "shaderOutputLayer with VK_EXT_shader_viewport_index_layer",
            "choose the layer in a geometry shader, or render once for each layer",
        ),
    };
    if offered {
        Ok(())
    } else {
        Err(missing(gpu, feature, shader.name, instead))
    }
}

fn check_attachments(gpu: &Inner, name: &str, colors: &[vk::Format], view_mask: u32) -> Result<()> {
    let views = u32::BITS - view_mask.leading_zeros();
    for (wanted, offered, limit, instead) in [
        (
            colors.len() as u32,
            gpu.caps.max_color_attachments,
            "maxColorAttachments",
            "render in several passes",
        ),
        (
            views,
            gpu.caps.max_views,
            "maxMultiviewViewCount",
            "render once for each view",
        ),
    ] {
        if wanted > offered {
            return Err(missing(gpu, format!("{limit} >= {wanted}"), name, instead));
        }
    }
    Ok(())
}

/// Fails for formats, topologies and comparisons that the device, or no device, has pipelines of.
fn check_state<V: VertexShader, F: FragmentShader, G: GeometryStage>(
    gpu: &Inner,
    name: &str,
    desc: &GraphicsDesc<'_, V, F, G>,
) -> Result<()> {
    let blended = if desc.additive {
        vk::FormatFeatureFlags::COLOR_ATTACHMENT_BLEND
    } else {
        vk::FormatFeatureFlags::empty()
    };
    let colors = desc.colors.iter().filter(|format| **format != vk::Format::UNDEFINED);
    let colors = colors.map(|format| (*format, vk::FormatFeatureFlags::COLOR_ATTACHMENT | blended));
    let depth = desc
        .depth
        .map(|format| (format, vk::FormatFeatureFlags::DEPTH_STENCIL_ATTACHMENT));
    for (format, wanted) in colors.chain(depth) {
        // Others have no image here, and drivers need not know what to answer.
        let known = texel_bytes(format).is_some();
        // SAFETY: the physical device belongs to the instance.
        let offered = known.then(|| unsafe {
            gpu.instance
                .raw
                .get_physical_device_format_properties(gpu.physical_device, format)
        });
        if !offered.is_some_and(|offered| offered.optimal_tiling_features.contains(wanted)) {
            let feature = format!("{wanted:?} for format {format:?}");
            return Err(missing(gpu, feature, name, "choose another format"));
        }
    }
    let topologies = [
        vk::PrimitiveTopology::POINT_LIST,
        vk::PrimitiveTopology::LINE_LIST,
        vk::PrimitiveTopology::LINE_STRIP,
        vk::PrimitiveTopology::TRIANGLE_LIST,
        vk::PrimitiveTopology::TRIANGLE_STRIP,
        vk::PrimitiveTopology::TRIANGLE_FAN,
    ];
    let comparisons = vk::CompareOp::NEVER.as_raw()..=vk::CompareOp::ALWAYS.as_raw();
    for (setting, value, known) in [
        (
            "topology",
            format!("{:?}", desc.topology),
            topologies.contains(&desc.topology),
        ),
        (
            "depth_compare",
            format!("{:?}", desc.depth_compare),
            comparisons.contains(&desc.depth_compare.as_raw()),
        ),
    ] {
        if !known {
            let cause = format!("is not one that the pipeline of {name} can have");
            return Err(Error::setting(setting, value, cause));
        }
    }
    Ok(())
}

/// Fails for primitives that are not those that the geometry shader takes, by its module's own word.
fn check_topology(topology: vk::PrimitiveTopology, geometry: Option<&'static ShaderInfo>) -> Result<()> {
    let Some(shader) = geometry else {
        return Ok(());
    };
    let input = match topology {
        vk::PrimitiveTopology::POINT_LIST => INPUT_POINTS,
        vk::PrimitiveTopology::LINE_LIST | vk::PrimitiveTopology::LINE_STRIP => INPUT_LINES,
        _ => INPUT_TRIANGLES,
    };
    if execution_modes(shader.spirv).any(|mode| mode == input) {
        return Ok(());
    }
    let cause = format!("is not what the geometry shader {} takes", shader.name);
    Err(Error::setting("topology", format!("{topology:?}"), cause))
}

/// Execution modes of SPIR-V that say what a geometry shader takes ("SPIR-V Specification", "Execution Mode").
const INPUT_POINTS: u32 = 19;
const INPUT_LINES: u32 = 20;
const INPUT_TRIANGLES: u32 = 22;

/// The execution modes of a module ("SPIR-V Specification", §2.3, and OpExecutionMode).
fn execution_modes(spirv: &[u8]) -> impl Iterator<Item = u32> {
    const HEADER_WORDS: usize = 5;
    const OP_EXECUTION_MODE: u32 = 16;
    let word = move |index: usize| {
        let bytes = spirv.get(4 * index..4 * index + 4)?;
        Some(u32::from_le_bytes(bytes.try_into().ok()?))
    };
    let mut at = HEADER_WORDS;
    let instructions = std::iter::from_fn(move || {
        let first = word(at)?;
        let mode = word(at + 2);
        // No instruction has no words; a module that says so ends here.
        let length = (first >> 16) as usize;
        at = if length == 0 { usize::MAX / 8 } else { at + length };
        Some((first & 0xFFFF, mode))
    });
    instructions.filter_map(|(operation, mode)| mode.filter(|_| operation == OP_EXECUTION_MODE))
}

fn make<V: VertexShader, F: FragmentShader, G: GeometryStage>(
    gpu: &Inner,
    shaders: &[&'static ShaderInfo],
    specs: &[Vec<(u32, u32)>],
    layout: vk::PipelineLayout,
    desc: &GraphicsDesc<'_, V, F, G>,
) -> Result<vk::Pipeline> {
    let modules = shaders
        .iter()
        .map(|shader| ShaderModule::new(gpu, shader.name, shader.spirv))
        .collect::<Result<Vec<_>>>()?;
    let constants: Vec<_> = specs.iter().map(|spec| specialization_data(spec)).collect();
    let specializations: Vec<_> = constants
        .iter()
        .map(|(entries, data)| vk::SpecializationInfo::default().map_entries(entries).data(data))
        .collect();
    let stages: Vec<_> = shaders
        .iter()
        .zip(&modules)
        .zip(&specializations)
        .map(|((shader, module), specialization)| {
            vk::PipelineShaderStageCreateInfo::default()
                .stage(stage_flags(shader.stage))
                .module(module.raw)
                .name(c"main")
                .specialization_info(specialization)
        })
        .collect();
    let input = vk::PipelineVertexInputStateCreateInfo::default();
    let assembly = vk::PipelineInputAssemblyStateCreateInfo::default().topology(desc.topology);
    let viewport = vk::PipelineViewportStateCreateInfo::default()
        .viewport_count(1)
        .scissor_count(1);
    let bias = desc.depth_bias.unwrap_or_default();
    let raster = vk::PipelineRasterizationStateCreateInfo::default()
        .polygon_mode(vk::PolygonMode::FILL)
        .cull_mode(match desc.cull {
            Cull::None => vk::CullModeFlags::NONE,
            Cull::Back => vk::CullModeFlags::BACK,
            Cull::Front => vk::CullModeFlags::FRONT,
        })
        .front_face(vk::FrontFace::COUNTER_CLOCKWISE)
        .depth_bias_enable(desc.depth_bias.is_some())
        .depth_bias_constant_factor(bias.constant)
        .depth_bias_slope_factor(bias.slope)
        .line_width(1.0);
    let samples = vk::PipelineMultisampleStateCreateInfo::default().rasterization_samples(vk::SampleCountFlags::TYPE_1);
    let depth = vk::PipelineDepthStencilStateCreateInfo::default()
        .depth_test_enable(desc.depth.is_some())
        .depth_write_enable(desc.depth.is_some())
        .depth_compare_op(desc.depth_compare);
    let blend = vk::PipelineColorBlendAttachmentState::default()
        .color_write_mask(vk::ColorComponentFlags::RGBA)
        .blend_enable(desc.additive)
        .src_color_blend_factor(vk::BlendFactor::ONE)
        .dst_color_blend_factor(vk::BlendFactor::ONE)
        .src_alpha_blend_factor(vk::BlendFactor::ONE)
        .dst_alpha_blend_factor(vk::BlendFactor::ONE);
    let blends = vec![blend; desc.colors.len()];
    let blend = vk::PipelineColorBlendStateCreateInfo::default().attachments(&blends);
    let dynamic = [vk::DynamicState::VIEWPORT, vk::DynamicState::SCISSOR];
    let dynamic = vk::PipelineDynamicStateCreateInfo::default().dynamic_states(&dynamic);
    let mut rendering = vk::PipelineRenderingCreateInfo::default()
        .view_mask(desc.view_mask)
        .color_attachment_formats(desc.colors)
        .depth_attachment_format(desc.depth.unwrap_or_default());
    let create = vk::GraphicsPipelineCreateInfo::default()
        .stages(&stages)
        .vertex_input_state(&input)
        .input_assembly_state(&assembly)
        .viewport_state(&viewport)
        .rasterization_state(&raster)
        .multisample_state(&samples)
        .depth_stencil_state(&depth)
        .color_blend_state(&blend)
        .dynamic_state(&dynamic)
        .layout(layout)
        .push_next(&mut rendering);
    // SAFETY: every pointer in `create` lives on this stack; modules and layout come from the same reflection.
    let made = unsafe {
        gpu.device
            .create_graphics_pipelines(gpu.pipeline_cache.raw, &[create], None)
    };
    let made =
        made.map_err(|(_, result)| gpu.creation_error("vkCreateGraphicsPipelines", result, shaders[0].name, 0))?;
    Ok(made[0])
}
