//! Rendering into images: what is rendered into, which part of it, and draws.
//!
//! A rendering has targets of one size: whole images or parts of them ([`Image::part`]), of one layer, of several that shaders choose
//! among by `gl_Layer`, or of several views that each primitive goes to. Attachments are images, whose barriers and layouts are the author's.
//! A rendering of an area without an image is for fragment shaders that write buffers.

use std::ops::Range;
use std::sync::Arc;

use ash::vk;

use super::barrier::Access;
use super::buffer::BufferView;
use super::device::Inner;
use super::graphics::{Attachments, GeometryStage, GraphicsPipeline};
use super::image::Image;
use super::interface::{BindingSet, FragmentShader, PushConstants, VertexShader};
use super::recorder::{Pass, check_push};
use crate::{Error, Result};

/// What a colour attachment is filled with.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum ClearColor {
    /// For formats that shaders write as floats.
    Float([f32; 4]),
    /// For formats of unsigned integers.
    Uint([u32; 4]),
}

impl From<[f32; 4]> for ClearColor {
    fn from(color: [f32; 4]) -> Self {
        Self::Float(color)
    }
}

impl From<[u32; 4]> for ClearColor {
    fn from(color: [u32; 4]) -> Self {
        Self::Uint(color)
    }
}

/// A colour attachment, in layout `COLOR_ATTACHMENT_OPTIMAL`.
#[derive(Debug, Clone, Copy)]
pub struct ColorTarget<'a> {
    /// The image.
    pub image: &'a Image,
    /// What it is filled with first; `None` keeps what is there.
    pub clear: Option<ClearColor>,
}

/// A depth attachment, in layout `DEPTH_ATTACHMENT_OPTIMAL`.
#[derive(Debug, Clone, Copy)]
pub struct DepthTarget<'a> {
    /// The image.
    pub image: &'a Image,
    /// What it is filled with first; `None` keeps what is there.
    pub clear: Option<f32>,
}

/// A rectangle of pixels.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Area {
    /// Its first pixel: from the left, from above.
    pub offset: [u32; 2],
    /// Pixels across and down.
    pub size: [u32; 2],
}

impl Area {
    /// All of something of this size.
    pub const fn whole(size: [u32; 2]) -> Self {
        Self { offset: [0; 2], size }
    }

    fn is_in(&self, size: [u32; 2]) -> bool {
        let fits = |axis: usize| {
            self.size[axis] > 0 && u64::from(self.offset[axis]) + u64::from(self.size[axis]) <= u64::from(size[axis])
        };
        fits(0) && fits(1)
    }

    fn rectangle(&self) -> vk::Rect2D {
        vk::Rect2D {
            offset: vk::Offset2D {
                x: self.offset[0] as i32,
                y: self.offset[1] as i32,
            },
            extent: vk::Extent2D {
                width: self.size[0],
                height: self.size[1],
            },
        }
    }
}

/// What is rendered into. All images have one size; layered images are rendered in all their layers.
#[derive(Debug, Clone, Copy, Default)]
pub struct Targets<'a> {
    /// Colour attachments by the fragment shader's output locations; `None` for an output that goes nowhere.
    pub colors: &'a [Option<ColorTarget<'a>>],
    /// Depth attachment.
    pub depth: Option<DepthTarget<'a>>,
    /// The part that is filled and drawn into; `None` for all. What is outside it stays as it is. Where there is no image, the pixels that there are.
    pub area: Option<Area>,
    /// Layers that every primitive is rendered into, one bit a view; 0 for rendering without views.
    pub view_mask: u32,
}

/// Pixels along a side up to which every device renders without an image.
const WITHOUT_IMAGE_MAX: u32 = 4096;

/// A rendering that was begun; it ends when this is dropped, by a panic of whoever draws, too.
struct Rendering {
    gpu: Arc<Inner>,
    command_buffer: vk::CommandBuffer,
}

impl Drop for Rendering {
    fn drop(&mut self) {
        // SAFETY: the command buffer is recording, and the rendering was begun where this was made.
        unsafe { self.gpu.device.cmd_end_rendering(self.command_buffer) };
    }
}

/// Draws between the begin and the end of rendering.
pub struct Render<'p, 'a> {
    pass: &'p mut Pass<'a>,
    attachments: Attachments,
    area: Area,
}

impl<'a> Pass<'a> {
    /// Renders into images: `record` draws. Barriers are for before and after.
    ///
    /// # Errors
    /// [`Error::Picture`] when the targets differ in size, there is none and no area of up to 4,096 pixels a side, the area is not in them or they have fewer layers
    /// than there are views; [`Error::Setting`] for an image of another device or one that was not made to be such a target; [`Error::LimitExceeded`] past
    /// `maxColorAttachments` or `maxMultiviewViewCount`; [`Error::MissingFeature`] on a queue without graphics; whatever `record` returns.
    pub fn render<R>(
        &mut self,
        targets: &Targets<'_>,
        record: impl FnOnce(&mut Render<'_, 'a>) -> Result<R>,
    ) -> Result<R> {
        let colors = || targets.colors.iter().flatten();
        let images: Vec<&Image> = colors()
            .map(|target| target.image)
            .chain(targets.depth.map(|target| target.image))
            .collect();
        for target in colors() {
            self.check_image(target.image, vk::ImageUsageFlags::COLOR_ATTACHMENT)?;
        }
        if let Some(target) = &targets.depth {
            self.check_image(target.image, vk::ImageUsageFlags::DEPTH_STENCIL_ATTACHMENT)?;
        }
        let (area, layers) = self.check_targets(&images, targets)?;
        self.check_limits(targets)?;
        for image in &images {
            self.recorder.keep(&image.inner);
        }
        self.recorder.next_command();
        let colors: Vec<_> = targets
            .colors
            .iter()
            .map(|target| target.as_ref().map_or_else(Default::default, color_attachment))
            .collect();
        let depth = targets.depth.as_ref().map(depth_attachment);
        let mut info = vk::RenderingInfo::default()
            .render_area(area.rectangle())
            .layer_count(layers)
            .view_mask(targets.view_mask)
            .color_attachments(&colors);
        if let Some(depth) = &depth {
            info = info.depth_attachment(depth);
        }
        let inner = Arc::clone(&self.recorder.gpu.inner);
        let command_buffer = self.command_buffer;
        // SAFETY: the command buffer is recording, outside rendering; the images are kept alive.
        unsafe { inner.device.cmd_begin_rendering(command_buffer, &info) };
        let rendering = Rendering {
            gpu: inner,
            command_buffer,
        };
        let format = |target: &Option<ColorTarget<'_>>| target.map_or(vk::Format::UNDEFINED, |t| t.image.format());
        let mut render = Render {
            pass: self,
            attachments: Attachments {
                colors: targets.colors.iter().map(format).collect(),
                depth: targets.depth.map(|target| target.image.format()),
                view_mask: targets.view_mask,
            },
            area,
        };
        let result = render.set_area(area).and_then(|()| record(&mut render));
        drop(rendering);
        result
    }

    /// Fails for what the device cannot render into at once.
    fn check_limits(&self, targets: &Targets<'_>) -> Result<()> {
        let caps = self.recorder.gpu.caps();
        if !caps.graphics {
            return Err(Error::MissingFeature {
                feature: "a graphics queue".into(),
                needed_by: self.name.into(),
                device: caps.device.clone(),
                instead: "choose a device that has one".into(),
            });
        }
        let views = u32::BITS - targets.view_mask.leading_zeros();
        for (value, limit_name, limit) in [
            (
                targets.colors.len() as u64,
                "maxColorAttachments",
                caps.max_color_attachments,
            ),
            (u64::from(views), "maxMultiviewViewCount", caps.max_views),
        ] {
            if value > u64::from(limit) {
                return Err(Error::LimitExceeded {
                    name: self.name.into(),
                    value,
                    limit_name,
                    limit: u64::from(limit),
                });
            }
        }
        Ok(())
    }

    /// The area to render and the layers of the targets.
    fn check_targets(&self, images: &[&Image], targets: &Targets<'_>) -> Result<(Area, u32)> {
        let refuse = |path: &str, cause| {
            Err(Error::Picture {
                path: path.into(),
                cause,
            })
        };
        let Some(first) = images.first() else {
            let is_fine = |area: &Area| targets.view_mask == 0 && area.is_in([WITHOUT_IMAGE_MAX; 2]);
            return match targets.area.filter(is_fine) {
                Some(area) => Ok((area, 1)),
                None => {
                    let cause = format!(
                        "the pass renders into no image, and not into an area of one view within {WITHOUT_IMAGE_MAX} pixels a side"
                    );
                    refuse(self.name, cause)
                }
            };
        };
        let size = first.size();
        if let Some(odd) = images.iter().find(|image| image.size() != size) {
            let cause = format!(
                "is {:?} and another target of pass {:?} is {size:?}",
                odd.size(),
                self.name
            );
            return refuse(odd.name(), cause);
        }
        let area = targets.area.unwrap_or(Area::whole(size));
        if !area.is_in(size) {
            let cause = format!("pass {:?} renders into {area:?} of {size:?}", self.name);
            return refuse(first.name(), cause);
        }
        let layers = images.iter().map(|image| image.layers()).min().unwrap_or(1);
        let views = u32::BITS - targets.view_mask.leading_zeros();
        if views > layers {
            let cause = format!("has {layers} layers and pass {:?} renders {views} views", self.name);
            return refuse(first.name(), cause);
        }
        Ok((area, layers))
    }
}

impl Render<'_, '_> {
    /// Draws go to this part of the targets from here on: clip space spans it, and nothing is drawn outside. It begins as the part that is
    /// rendered into, and must lie in it.
    ///
    /// # Errors
    /// [`Error::Picture`] when it does not.
    pub fn set_area(&mut self, area: Area) -> Result<()> {
        self.set_scissor(area)?;
        let viewport = [vk::Viewport {
            x: area.offset[0] as f32,
            y: area.offset[1] as f32,
            width: area.size[0] as f32,
            height: area.size[1] as f32,
            max_depth: 1.0,
            ..Default::default()
        }];
        let command_buffer = self.pass.command_buffer;
        let device = &self.pass.recorder.gpu.inner.device;
        // SAFETY: the command buffer is recording.
        unsafe { device.cmd_set_viewport(command_buffer, 0, &viewport) };
        Ok(())
    }

    /// Nothing is drawn outside this part of the targets from here on; what clip space spans stays as it is. It must lie in the part that is
    /// rendered into.
    ///
    /// # Errors
    /// [`Error::Picture`] when it does not.
    pub fn set_scissor(&mut self, area: Area) -> Result<()> {
        let Area { offset, size } = self.area;
        let inside = |axis: usize| {
            area.offset[axis] >= offset[axis]
                && area.size[axis] > 0
                && u64::from(area.offset[axis]) + u64::from(area.size[axis])
                    <= u64::from(offset[axis]) + u64::from(size[axis])
        };
        if !(inside(0) && inside(1)) {
            return Err(Error::Picture {
                path: self.pass.name.into(),
                cause: format!("draws go to {area:?} and the pass renders into {:?}", self.area),
            });
        }
        let device = &self.pass.recorder.gpu.inner.device;
        // SAFETY: the command buffer is recording.
        unsafe { device.cmd_set_scissor(self.pass.command_buffer, 0, &[area.rectangle()]) };
        Ok(())
    }

    /// Draws vertices without vertex input: `vertices` a primitive list, `instances` times.
    ///
    /// # Errors
    /// [`Error::Shader`] when the pipeline's attachments are not those of the targets or the sets do not cover the bindings,
    /// [`Error::Setting`] for what belongs to another device or was not made for the use, [`Error::MissingBarrier`] in debug builds.
    pub fn draw<V: VertexShader, F: FragmentShader, G: GeometryStage>(
        &mut self,
        pipeline: &GraphicsPipeline<V, F, G>,
        sets: &[&dyn BindingSet<'_>],
        push: &V::Push,
        vertices: u32,
        instances: u32,
    ) -> Result<()> {
        self.draw_range(pipeline, sets, push, 0..vertices, instances)
    }

    /// As [`Render::draw`], of the vertices with these numbers; none for a range that ends before it begins.
    ///
    /// # Errors
    /// As [`Render::draw`].
    pub fn draw_range<V: VertexShader, F: FragmentShader, G: GeometryStage>(
        &mut self,
        pipeline: &GraphicsPipeline<V, F, G>,
        sets: &[&dyn BindingSet<'_>],
        push: &V::Push,
        vertices: Range<u32>,
        instances: u32,
    ) -> Result<()> {
        self.pass.recorder.next_command();
        self.bind(pipeline, sets, push)?;
        let device = &self.pass.recorder.gpu.inner.device;
        let count = vertices.end.saturating_sub(vertices.start);
        // SAFETY: pipeline, sets and push constants are bound.
        unsafe { device.cmd_draw(self.pass.command_buffer, count, instances, vertices.start, 0) };
        Ok(())
    }

    /// As [`Render::draw`], with the counts read from a buffer: four words, vertices, instances, the first vertex and the first instance,
    /// which is 0.
    ///
    /// # Errors
    /// As [`Render::draw`]; [`Error::LimitExceeded`] when the words are not in the buffer.
    pub fn draw_indirect<V: VertexShader, F: FragmentShader, G: GeometryStage>(
        &mut self,
        pipeline: &GraphicsPipeline<V, F, G>,
        sets: &[&dyn BindingSet<'_>],
        push: &V::Push,
        arguments: BufferView<'_>,
    ) -> Result<()> {
        let bytes = size_of::<vk::DrawIndirectCommand>();
        let words = BufferView {
            bytes: bytes as u64,
            ..arguments
        };
        words.check(4)?;
        words.check_usage(vk::BufferUsageFlags::INDIRECT_BUFFER)?;
        let pass = &mut *self.pass;
        pass.recorder.next_command();
        pass.recorder
            .touch(pass.name, arguments.buffer, Access::INDIRECT_READ)?;
        self.bind(pipeline, sets, push)?;
        let device = &self.pass.recorder.gpu.inner.device;
        let (buffer, offset) = (arguments.buffer.raw(), arguments.raw_offset());
        // SAFETY: as in `draw`; the arguments are kept alive.
        unsafe { device.cmd_draw_indirect(self.pass.command_buffer, buffer, offset, 1, bytes as u32) };
        Ok(())
    }

    fn bind<V: VertexShader, F: FragmentShader, G: GeometryStage>(
        &mut self,
        pipeline: &GraphicsPipeline<V, F, G>,
        sets: &[&dyn BindingSet<'_>],
        push: &V::Push,
    ) -> Result<()> {
        let pass = &mut *self.pass;
        let inner = &pipeline.inner;
        if inner.attachments != self.attachments {
            return Err(Error::Shader {
                name: F::info().name.into(),
                message: format!("made for {:?}, drawn into {:?}", inner.attachments, self.attachments),
            });
        }
        let bytes = push.bytes();
        pass.recorder
            .check_device(inner.objects.gpu(), "pipeline", F::info().name)?;
        // The vertex shader's block is the pipeline's.
        check_push(inner.shaders[0], bytes)?;
        pass.recorder.keep(inner);
        let point = vk::PipelineBindPoint::GRAPHICS;
        let device = pass.recorder.gpu.inner.device.clone();
        // SAFETY: pipeline, layout and sets are alive and come from one reflection.
        unsafe { device.cmd_bind_pipeline(pass.command_buffer, point, inner.objects.raw) };
        pass.bind_sets(&inner.shaders, point, inner.objects.layout, &inner.objects.sets, sets)?;
        if !bytes.is_empty() {
            let layout = inner.objects.layout;
            // SAFETY: the bytes are as many as the block has, which was checked.
            unsafe { device.cmd_push_constants(pass.command_buffer, layout, inner.stages(), 0, bytes) };
        }
        Ok(())
    }
}

fn color_attachment(target: &ColorTarget<'_>) -> vk::RenderingAttachmentInfo<'static> {
    let clear = vk::ClearValue {
        color: match target.clear {
            Some(ClearColor::Uint(uint32)) => vk::ClearColorValue { uint32 },
            Some(ClearColor::Float(float32)) => vk::ClearColorValue { float32 },
            None => vk::ClearColorValue::default(),
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
