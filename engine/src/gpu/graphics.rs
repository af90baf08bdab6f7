//! Graphics pipelines made from reflected shaders.
//!
//! Deliberately small: dynamic rendering, one sample, no vertex input (shaders pull vertices from buffers by `gl_VertexIndex`), a vertex
//! and a fragment shader, and a geometry shader between them where one is named. What a shader needs of a device is known by reflection,
//! and a device that lacks it is an error that names the way round. Bindings of all stages are checked against barriers as those of
//! compute passes are.

mod checks;

use std::marker::PhantomData;
use std::sync::Arc;

use ash::vk;

use super::device::{Gpu, Inner};
use super::interface::{FragmentShader, GeometryShader, ShaderInfo, SpecConstants, Stage, VertexShader};
use super::layout::{PipelineObjects, ShaderModule, specialization_data, stage_flags};
use super::pipeline::PipelineInfo;
use crate::Result;

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
    /// [`Error::Shader`](crate::Error::Shader) when the shaders do not agree on a binding or on the push constants,
    /// [`Error::MissingFeature`](crate::Error::MissingFeature) on a queue without graphics, when a shader needs what the device lacks (geometry
    /// shaders, clip distances, views, layers from vertex shaders), writes buffers or images from a stage that cannot, when the descriptors,
    /// attachments or views are more than the device allows, or for a format that the device cannot render into,
    /// [`Error::Setting`](crate::Error::Setting) for a topology or comparison beyond those of pipelines without tessellation or a topology that the
    /// geometry shader does not take, [`Error::OutOfMemory`](crate::Error::OutOfMemory), [`Error::Vulkan`](crate::Error::Vulkan).
    pub fn graphics_pipeline<V: VertexShader, F: FragmentShader, G: GeometryStage>(
        &self,
        desc: &GraphicsDesc<'_, V, F, G>,
    ) -> Result<GraphicsPipeline<V, F, G>> {
        let shaders: Vec<_> = [Some(V::info()), G::info(), Some(F::info())]
            .into_iter()
            .flatten()
            .collect();
        self.inner.check_alive()?;
        checks::check(&self.inner, &shaders, desc)?;
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

fn make<V: VertexShader, F: FragmentShader, G: GeometryStage>(
    gpu: &Inner,
    shaders: &[&'static ShaderInfo],
    specs: &[Vec<(u32, u32)>],
    layout: vk::PipelineLayout,
    desc: &GraphicsDesc<'_, V, F, G>,
) -> Result<vk::Pipeline> {
    let modules = shaders
        .iter()
        .zip(specs)
        .map(|(shader, spec)| ShaderModule::specialized(gpu, shader.name, shader.spirv, spec))
        .collect::<Result<Vec<_>>>()?;
    let constants: Vec<_> = modules
        .iter()
        .zip(specs)
        .map(|(module, spec)| specialization_data(module.values(spec)))
        .collect();
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
