//! Graphics pipelines made from reflected shaders, and rendering into images.
//!
//! Deliberately small: dynamic rendering, one sample, no vertex input (shaders pull vertices from storage buffers by `gl_VertexIndex`), and
//! viewport and scissor that cover the targets. Bindings of both stages are checked against barriers as those of compute passes are;
//! attachments are images, whose barriers and layouts are the author's.

use std::marker::PhantomData;
use std::sync::Arc;

use ash::vk;

use super::device::{Gpu, Inner};
use super::image::Image;
use super::interface::{BindingSet, FragmentShader, PushConstants, ShaderInfo, SpecConstants, VertexShader};
use super::layout::{PipelineObjects, ShaderModule, specialization_data};
use super::recorder::Pass;
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

/// What a graphics pipeline is made of, beside its shaders.
#[derive(Debug, Clone)]
pub struct GraphicsDesc<'a, V: VertexShader, F: FragmentShader> {
    /// Specialization constants of the vertex shader.
    pub vertex: V::Spec,
    /// Specialization constants of the fragment shader.
    pub fragment: F::Spec,
    /// Formats of the colour attachments, in the order of the fragment shader's output locations.
    pub colors: &'a [vk::Format],
    /// Format of the depth attachment; with one, depth is tested (nearer or equal passes, 0 is near) and written.
    pub depth: Option<vk::Format>,
    /// How vertices make primitives.
    pub topology: vk::PrimitiveTopology,
    /// Which triangles are dropped.
    pub cull: Cull,
    /// Colour is added to what is there instead of replacing it.
    pub additive: bool,
}

impl<V: VertexShader, F: FragmentShader> Default for GraphicsDesc<'_, V, F> {
    /// Triangles, no culling, no attachment.
    fn default() -> Self {
        Self {
            vertex: V::Spec::default(),
            fragment: F::Spec::default(),
            colors: &[],
            depth: None,
            topology: vk::PrimitiveTopology::TRIANGLE_LIST,
            cull: Cull::None,
            additive: false,
        }
    }
}

/// A graphics pipeline of the shaders `V` and `F`. Cloning shares it.
pub struct GraphicsPipeline<V, F> {
    inner: Arc<GraphicsInner>,
    shaders: PhantomData<fn() -> (V, F)>,
}

impl<V, F> Clone for GraphicsPipeline<V, F> {
    fn clone(&self) -> Self {
        Self {
            inner: Arc::clone(&self.inner),
            shaders: PhantomData,
        }
    }
}

impl<V, F> std::fmt::Debug for GraphicsPipeline<V, F> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let [vertex, fragment] = self.inner.shaders;
        f.debug_tuple("GraphicsPipeline")
            .field(&vertex.name)
            .field(&fragment.name)
            .finish()
    }
}

struct GraphicsInner {
    objects: PipelineObjects,
    shaders: [&'static ShaderInfo; 2],
    colors: Vec<vk::Format>,
    depth: Option<vk::Format>,
}

const STAGES: vk::ShaderStageFlags =
    vk::ShaderStageFlags::from_raw(vk::ShaderStageFlags::VERTEX.as_raw() | vk::ShaderStageFlags::FRAGMENT.as_raw());

impl Gpu {
    /// Makes a graphics pipeline. The vertex shader's push-constant block is the pipeline's; the fragment shader declares the same block or
    /// none.
    ///
    /// # Errors
    /// [`Error::Shader`] when the shaders do not agree on a binding or on the push constants, [`Error::MissingFeature`] on a queue without
    /// graphics, when a shader writes buffers or images from a stage that cannot or when the descriptors are more than the device allows,
    /// [`Error::OutOfMemory`], [`Error::Vulkan`].
    pub fn graphics_pipeline<V: VertexShader, F: FragmentShader>(
        &self,
        desc: &GraphicsDesc<'_, V, F>,
    ) -> Result<GraphicsPipeline<V, F>> {
        let shaders = [V::info(), F::info()];
        self.inner.check_alive()?;
        check_shaders(&self.inner, shaders)?;
        let attachments = desc.colors.len() as u32;
        let mut objects = PipelineObjects::new(&self.inner, &shaders, attachments)?;
        let name = shaders[0].name;
        objects.set_pipeline(make(&self.inner, shaders, objects.layout, desc)?, name);
        let inner = GraphicsInner {
            objects,
            shaders,
            colors: desc.colors.to_vec(),
            depth: desc.depth,
        };
        Ok(GraphicsPipeline {
            inner: Arc::new(inner),
            shaders: PhantomData,
        })
    }
}

fn check_shaders(gpu: &Inner, shaders: [&'static ShaderInfo; 2]) -> Result<()> {
    let [vertex, fragment] = shaders;
    let missing = |feature: &str, shader: &ShaderInfo, instead: &str| Error::MissingFeature {
        feature: feature.into(),
        needed_by: shader.name.into(),
        device: gpu.caps.device.clone(),
        instead: instead.into(),
    };
    if !gpu.caps.graphics {
        return Err(missing("a graphics queue", vertex, "choose a device that has one"));
    }
    for (shader, stores, feature) in [
        (vertex, gpu.caps.vertex_stores, "vertexPipelineStoresAndAtomics"),
        (fragment, gpu.caps.fragment_stores, "fragmentStoresAndAtomics"),
    ] {
        if !stores && shader.used_bindings().any(|binding| binding.writes) {
            return Err(missing(feature, shader, "write from a compute shader"));
        }
    }
    let disagree = |message| {
        Err(Error::Shader {
            name: fragment.name.into(),
            message,
        })
    };
    if fragment.push_constant_bytes > 0 && fragment.push_constant_bytes != vertex.push_constant_bytes {
        return disagree(format!(
            "its push constants have {} bytes, those of {} have {}",
            fragment.push_constant_bytes, vertex.name, vertex.push_constant_bytes
        ));
    }
    for binding in fragment.bindings {
        let place = (binding.set, binding.binding);
        let other = vertex.bindings.iter().find(|b| (b.set, b.binding) == place);
        if other.is_some_and(|other| other.kind != binding.kind) {
            return disagree(format!(
                "binding {} is a {:?} here and another thing in {}",
                binding.name, binding.kind, vertex.name
            ));
        }
    }
    Ok(())
}

fn make<V: VertexShader, F: FragmentShader>(
    gpu: &Inner,
    shaders: [&'static ShaderInfo; 2],
    layout: vk::PipelineLayout,
    desc: &GraphicsDesc<'_, V, F>,
) -> Result<vk::Pipeline> {
    let vertex = ShaderModule::new(gpu, shaders[0].name, shaders[0].spirv)?;
    let fragment = ShaderModule::new(gpu, shaders[1].name, shaders[1].spirv)?;
    let (vertex_entries, vertex_data) = specialization_data(&desc.vertex.values());
    let (fragment_entries, fragment_data) = specialization_data(&desc.fragment.values());
    let vertex_spec = vk::SpecializationInfo::default()
        .map_entries(&vertex_entries)
        .data(&vertex_data);
    let fragment_spec = vk::SpecializationInfo::default()
        .map_entries(&fragment_entries)
        .data(&fragment_data);
    let stage = |stage, module: &ShaderModule<'_>| {
        vk::PipelineShaderStageCreateInfo::default()
            .stage(stage)
            .module(module.raw)
            .name(c"main")
    };
    let stages = [
        stage(vk::ShaderStageFlags::VERTEX, &vertex).specialization_info(&vertex_spec),
        stage(vk::ShaderStageFlags::FRAGMENT, &fragment).specialization_info(&fragment_spec),
    ];
    let input = vk::PipelineVertexInputStateCreateInfo::default();
    let assembly = vk::PipelineInputAssemblyStateCreateInfo::default().topology(desc.topology);
    let viewport = vk::PipelineViewportStateCreateInfo::default()
        .viewport_count(1)
        .scissor_count(1);
    let raster = vk::PipelineRasterizationStateCreateInfo::default()
        .polygon_mode(vk::PolygonMode::FILL)
        .cull_mode(match desc.cull {
            Cull::None => vk::CullModeFlags::NONE,
            Cull::Back => vk::CullModeFlags::BACK,
            Cull::Front => vk::CullModeFlags::FRONT,
        })
        .front_face(vk::FrontFace::COUNTER_CLOCKWISE)
        .line_width(1.0);
    let samples = vk::PipelineMultisampleStateCreateInfo::default().rasterization_samples(vk::SampleCountFlags::TYPE_1);
    let depth = vk::PipelineDepthStencilStateCreateInfo::default()
        .depth_test_enable(desc.depth.is_some())
        .depth_write_enable(desc.depth.is_some())
        .depth_compare_op(vk::CompareOp::LESS_OR_EQUAL);
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

/// A colour attachment, in layout `COLOR_ATTACHMENT_OPTIMAL`.
#[derive(Debug, Clone, Copy)]
pub struct ColorTarget<'a> {
    /// The image.
    pub image: &'a Image,
    /// What it is filled with first; `None` keeps what is there.
    pub clear: Option<[f32; 4]>,
}

/// A depth attachment, in layout `DEPTH_ATTACHMENT_OPTIMAL`.
#[derive(Debug, Clone, Copy)]
pub struct DepthTarget<'a> {
    /// The image.
    pub image: &'a Image,
    /// What it is filled with first; `None` keeps what is there.
    pub clear: Option<f32>,
}

/// What is rendered into. All images have one size; layered images are rendered in all their layers.
#[derive(Debug, Clone, Copy, Default)]
pub struct Targets<'a> {
    /// Colour attachments, in the order of the fragment shader's output locations.
    pub colors: &'a [ColorTarget<'a>],
    /// Depth attachment.
    pub depth: Option<DepthTarget<'a>>,
}

/// Draws between the begin and the end of rendering.
pub struct Render<'p, 'a> {
    pass: &'p mut Pass<'a>,
    colors: Vec<vk::Format>,
    depth: Option<vk::Format>,
}

impl<'a> Pass<'a> {
    /// Renders into images: `record` draws. Barriers are for before and after.
    ///
    /// # Errors
    /// [`Error::Picture`] when the targets differ in size or there is none; whatever `record` returns.
    pub fn render<R>(
        &mut self,
        targets: &Targets<'_>,
        record: impl FnOnce(&mut Render<'_, 'a>) -> Result<R>,
    ) -> Result<R> {
        let images: Vec<&Image> = targets
            .colors
            .iter()
            .map(|target| target.image)
            .chain(targets.depth.map(|target| target.image))
            .collect();
        let size = images.first().map_or([0, 0], |image| image.size());
        if let Some(odd) = images.iter().find(|image| image.size() != size) {
            return Err(Error::Picture {
                path: odd.inner.name.clone(),
                cause: format!(
                    "is {:?} and another target of pass {:?} is {size:?}",
                    odd.size(),
                    self.name
                ),
            });
        }
        if images.is_empty() {
            return Err(Error::Picture {
                path: self.name.into(),
                cause: "the pass renders into no image".into(),
            });
        }
        let layers = images.iter().map(|image| image.inner.layers).min().unwrap_or(1);
        for image in &images {
            self.recorder.keep(&image.inner);
        }
        self.recorder.next_command();
        let extent = vk::Extent2D {
            width: size[0],
            height: size[1],
        };
        let colors: Vec<_> = targets.colors.iter().map(color_attachment).collect();
        let depth = targets.depth.as_ref().map(depth_attachment);
        let mut info = vk::RenderingInfo::default()
            .render_area(extent.into())
            .layer_count(layers)
            .color_attachments(&colors);
        if let Some(depth) = &depth {
            info = info.depth_attachment(depth);
        }
        let viewport = [vk::Viewport {
            width: size[0] as f32,
            height: size[1] as f32,
            max_depth: 1.0,
            ..Default::default()
        }];
        let inner = Arc::clone(&self.recorder.gpu.inner);
        let command_buffer = self.command_buffer;
        // SAFETY: the command buffer is recording, outside of rendering; the images are kept alive.
        unsafe {
            inner.device.cmd_begin_rendering(command_buffer, &info);
            inner.device.cmd_set_viewport(command_buffer, 0, &viewport);
            inner.device.cmd_set_scissor(command_buffer, 0, &[extent.into()]);
        }
        let result = record(&mut Render {
            pass: self,
            colors: targets.colors.iter().map(|target| target.image.format()).collect(),
            depth: targets.depth.map(|target| target.image.format()),
        });
        // SAFETY: rendering was begun above.
        unsafe { inner.device.cmd_end_rendering(command_buffer) };
        result
    }
}

impl Render<'_, '_> {
    /// Draws vertices without vertex input: `vertices` a primitive list, `instances` times.
    ///
    /// # Errors
    /// [`Error::Shader`] when the pipeline's attachments are not those of the targets or the sets do not cover the bindings,
    /// [`Error::MissingBarrier`] in debug builds.
    pub fn draw<V: VertexShader, F: FragmentShader>(
        &mut self,
        pipeline: &GraphicsPipeline<V, F>,
        sets: &[&dyn BindingSet<'_>],
        push: &V::Push,
        vertices: u32,
        instances: u32,
    ) -> Result<()> {
        let pass = &mut *self.pass;
        let inner = &pipeline.inner;
        if inner.colors != self.colors || inner.depth != self.depth {
            return Err(Error::Shader {
                name: inner.shaders[1].name.into(),
                message: format!(
                    "made for attachments {:?} and depth {:?}, drawn into {:?} and {:?}",
                    inner.colors, inner.depth, self.colors, self.depth
                ),
            });
        }
        pass.recorder.next_command();
        pass.recorder.keep(inner);
        let point = vk::PipelineBindPoint::GRAPHICS;
        let device = pass.recorder.gpu.inner.device.clone();
        // SAFETY: pipeline, layout and sets are alive and come from one reflection.
        unsafe { device.cmd_bind_pipeline(pass.command_buffer, point, inner.objects.raw) };
        pass.bind_sets(&inner.shaders, point, inner.objects.layout, &inner.objects.sets, sets)?;
        let bytes = push.bytes();
        // SAFETY: the generated struct has the size of the block.
        unsafe {
            if !bytes.is_empty() {
                device.cmd_push_constants(pass.command_buffer, inner.objects.layout, STAGES, 0, bytes);
            }
            device.cmd_draw(pass.command_buffer, vertices, instances, 0, 0);
        }
        Ok(())
    }
}

fn color_attachment(target: &ColorTarget<'_>) -> vk::RenderingAttachmentInfo<'static> {
    let clear = vk::ClearValue {
        color: vk::ClearColorValue {
            float32: target.clear.unwrap_or_default(),
        },
    };
    attachment(
        target.image,
        vk::ImageLayout::COLOR_ATTACHMENT_OPTIMAL,
        target.clear.is_some(),
        clear,
    )
}

fn depth_attachment(target: &DepthTarget<'_>) -> vk::RenderingAttachmentInfo<'static> {
    let clear = vk::ClearValue {
        depth_stencil: vk::ClearDepthStencilValue {
            depth: target.clear.unwrap_or_default(),
            stencil: 0,
        },
    };
    attachment(
        target.image,
        vk::ImageLayout::DEPTH_ATTACHMENT_OPTIMAL,
        target.clear.is_some(),
        clear,
    )
}

fn attachment(
    image: &Image,
    layout: vk::ImageLayout,
    clears: bool,
    clear: vk::ClearValue,
) -> vk::RenderingAttachmentInfo<'static> {
    vk::RenderingAttachmentInfo::default()
        .image_view(image.view())
        .image_layout(layout)
        .load_op(if clears {
            vk::AttachmentLoadOp::CLEAR
        } else {
            vk::AttachmentLoadOp::LOAD
        })
        .store_op(vk::AttachmentStoreOp::STORE)
        .clear_value(clear)
}
