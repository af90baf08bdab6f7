//! Pictures of the nearest surfaces: their triangles, distances, normals, whatever is asked for.

use super::coverage::DrawPart;
use super::output::Output;
use super::pipelines::{DEPTH, Layering, Pipeline, PipelineDesc, used_locations};
use super::surfaces::{SurfaceFeatures, Surfaces};
use super::view::View;
use crate::gpu::ash::vk;
use crate::gpu::shaders::sets::RasterSet;
use crate::gpu::shaders::types::RasterView;
use crate::gpu::{
    Access, Buffer, BufferBarrier, BufferDesc, Category, ColorTarget, DepthTarget, Gpu, Image, ImageBarrier, ImageDesc,
    ImagePart, Pass, PipelineInfo, Recorder, Targets, TexelView,
};
use crate::{Error, Result};

/// What a [`GBuffer`] is.
#[derive(Debug, Clone, Copy)]
pub struct GBufferDesc<'a> {
    /// Pixels across and down.
    pub size: [u32; 2],
    /// In how many views, and how.
    pub layering: Layering,
    /// What is asked for of each pixel, beside depth.
    pub outputs: &'a [Output],
}

/// Pictures of surfaces, and the pipeline that draws them.
#[derive(Debug)]
pub struct GBuffer {
    size: [u32; 2],
    layering: Layering,
    features: SurfaceFeatures,
    pipeline: Pipeline,
    depth: Picture,
    /// By the locations of the fragment shader.
    pictures: Vec<Option<(Output, Picture)>>,
    views: Buffer,
    /// The object of each triangle, where objects are asked for.
    objects: Option<TexelView>,
}

/// An image, and its layers where each is rendered by itself.
#[derive(Debug)]
struct Picture {
    image: Image,
    layers: Vec<Image>,
}

impl Picture {
    /// What one rendering goes into: a layer, or all.
    fn target(&self, rendering: u32) -> &Image {
        self.layers.get(rendering as usize).unwrap_or(&self.image)
    }
}

fn target((output, picture): &(Output, Picture), rendering: u32, begins: bool) -> ColorTarget<'_> {
    ColorTarget {
        image: picture.target(rendering),
        clear: begins.then(|| output.nothing()),
    }
}

/// The uses of views.
const VIEW_READ: Access = Access::VERTEX_READ
    .union(Access::GEOMETRY_READ)
    .union(Access::FRAGMENT_READ);

/// What may have happened to a picture before.
const ANY_USE: Access = Access::SHADER_READ
    .union(Access::TRANSFER_READ)
    .union(Access::COLOR_WRITE);

impl GBuffer {
    /// Allocates what is asked for, and makes the pipeline for these surfaces. Attributes are those at the point where a pixel's ray meets the
    /// triangle; where the views have no such rays (paraboloids, cuts that are not exact), as by [`GBuffer::interpolated`].
    ///
    /// # Errors
    /// [`Error::MissingFeature`] for a way to several views that the device lacks, naming others; [`Error::Setting`] for a wrong number of
    /// views or pieces; [`Error::LimitExceeded`] for a size; [`Error::OutOfMemory`].
    pub fn new(gpu: &Gpu, surfaces: &Surfaces<'_>, desc: &GBufferDesc<'_>) -> Result<Self> {
        Self::make(gpu, surfaces, desc, !desc.layering.has_rays())
    }

    /// As [`GBuffer::new`], with all attributes as the rasterizer interpolates them between corners: cheaper, and off by the
    /// rounding of vertices to parts of a pixel.
    ///
    /// # Errors
    /// As [`GBuffer::new`].
    pub fn interpolated(gpu: &Gpu, surfaces: &Surfaces<'_>, desc: &GBufferDesc<'_>) -> Result<Self> {
        Self::make(gpu, surfaces, desc, true)
    }

    fn make(gpu: &Gpu, surfaces: &Surfaces<'_>, desc: &GBufferDesc<'_>, interpolates: bool) -> Result<Self> {
        let pipeline = Pipeline::new(
            gpu,
            &PipelineDesc {
                size: desc.size,
                layering: desc.layering,
                outputs: desc.outputs,
                features: surfaces.features,
                interpolates,
            },
        )?;
        let picture = |name, format, usage| Picture::new(gpu, desc, name, format, usage);
        let color =
            vk::ImageUsageFlags::COLOR_ATTACHMENT | vk::ImageUsageFlags::SAMPLED | vk::ImageUsageFlags::TRANSFER_SRC;
        let pictures = Output::ALL[..used_locations(desc.outputs)]
            .iter()
            .map(|output| {
                if !desc.outputs.contains(output) {
                    return Ok(None);
                }
                let picture = picture(output.name(), output.format(), color)?;
                Ok(Some((*output, picture)))
            })
            .collect::<Result<_>>()?;
        let depth = vk::ImageUsageFlags::DEPTH_STENCIL_ATTACHMENT | vk::ImageUsageFlags::SAMPLED;
        let objects = || {
            let objects = surfaces.object_of_triangles();
            gpu.texels_with("objects", Category::Geometry, vk::Format::R32_UINT, &objects)
        };
        let views = u64::from(desc.layering.views()) * size_of::<RasterView>() as u64;
        Ok(Self {
            size: desc.size,
            layering: desc.layering,
            features: surfaces.features,
            pipeline,
            depth: picture("G-buffer depth", DEPTH, depth)?,
            pictures,
            views: gpu.buffer(&BufferDesc::storage("raster views", views, Category::Work))?,
            objects: desc.outputs.contains(&Output::Object).then(objects).transpose()?,
        })
    }

    /// Pixels across and down.
    pub fn size(&self) -> [u32; 2] {
        self.size
    }

    /// The shaders that draw it, with their specialization.
    pub fn pipelines(&self) -> Vec<PipelineInfo> {
        self.pipeline.info()
    }

    /// One of the pictures; `None` when it was not asked for. After [`GBuffer::record`] it is in layout `COLOR_ATTACHMENT_OPTIMAL`.
    pub fn image(&self, output: Output) -> Option<&Image> {
        self.pictures()
            .find_map(|(made, picture)| (made == output).then_some(&picture.image))
    }

    /// The depth picture, reversed: [`View`]. After [`GBuffer::record`] it is in layout `DEPTH_ATTACHMENT_OPTIMAL`.
    pub fn depth(&self) -> &Image {
        &self.depth.image
    }

    /// Bytes of all pictures, of what they hold and not of what the device allocates for it.
    pub fn bytes(&self) -> u64 {
        const DEPTH_BYTES: u64 = 4;
        let pixels = u64::from(self.size[0]) * u64::from(self.size[1]) * u64::from(self.layering.layers());
        let outputs: u64 = self.pictures().map(|(output, _)| output.bytes()).sum();
        pixels * (DEPTH_BYTES + outputs)
    }

    /// Records one pass that draws the surfaces. Earlier uses of the pictures, in whatever layout, are waited for; what reads them afterwards wants a
    /// barrier from [`Access::COLOR_WRITE`] or [`Access::DEPTH_WRITE`] and their layouts ([`GBuffer::barrier_to`]).
    ///
    /// # Errors
    /// [`Error::Setting`] for another number of views than the layering takes or views of a layout that it cannot take, or surfaces with other
    /// features than those it was made for; [`Error::LimitExceeded`] for more pieces of triangles than can be numbered;
    /// [`Error::MissingBarrier`] in debug builds.
    pub fn record(&self, recorder: &mut Recorder, surfaces: &Surfaces<'_>, views: &[View]) -> Result<()> {
        let whole = DrawPart::whole(surfaces);
        self.record_part(recorder, surfaces, views, &whole)
    }

    /// As [`GBuffer::record`], a part of the triangles: the first part empties the pictures, and later ones, of the same surfaces and views, draw over what is there.
    ///
    /// # Errors
    /// As [`GBuffer::record`].
    pub(crate) fn record_part(
        &self,
        recorder: &mut Recorder,
        surfaces: &Surfaces<'_>,
        views: &[View],
        part: &DrawPart,
    ) -> Result<()> {
        self.layering.check_views(views)?;
        if surfaces.features != self.features {
            let cause = format!("is not {:?}, which the G-buffer was made for", self.features);
            return Err(Error::setting("surfaces", format!("{:?}", surfaces.features), cause));
        }
        recorder.pass("raster: surfaces", |pass| {
            if part.begins {
                self.upload(pass, views)?;
                self.to_attachments(pass);
            } else {
                self.keep_attachments(pass);
            }
            let raster = RasterSet {
                raster_views: self.views.view(),
                // Without objects no kernel reads it.
                raster_objects: self.objects.as_ref().unwrap_or(surfaces.set.scene_triangles),
            };
            for rendering in 0..self.layering.renderings().unwrap_or(1) {
                let colors: Vec<_> = self
                    .pictures
                    .iter()
                    .map(|slot| slot.as_ref().map(|slot| target(slot, rendering, part.begins)))
                    .collect();
                let targets = Targets {
                    colors: &colors,
                    depth: Some(DepthTarget {
                        image: self.depth.target(rendering),
                        clear: part.begins.then_some(0.0),
                    }),
                    area: None,
                    view_mask: self.layering.view_mask(),
                };
                pass.render(&targets, |render| {
                    let drawn = (surfaces, &part.triangles);
                    self.pipeline.draw(render, &raster, drawn, views, rendering)
                })?;
            }
            Ok(())
        })
    }

    /// A barrier from the pictures' drawing to what comes next, and to a layout for that. Depth is left as it is.
    pub fn barrier_to(&self, pass: &mut Pass<'_>, to: Access, layout: vk::ImageLayout) {
        let barriers: Vec<_> = self
            .pictures()
            .map(|(_, picture)| ImageBarrier {
                image: &picture.image,
                from: Access::COLOR_WRITE,
                to,
                old_layout: vk::ImageLayout::COLOR_ATTACHMENT_OPTIMAL,
                new_layout: layout,
            })
            .collect();
        pass.image_barrier(&barriers);
    }

    /// Reads a picture to the host, all layers one behind the other: `T` is a pixel. It must have been drawn, and be in the layout that
    /// [`GBuffer::record`] leaves.
    ///
    /// # Errors
    /// [`Error::Picture`] for one that was not asked for or whose pixels are not as large as `T`; [`Error::OutOfMemory`],
    /// [`Error::DeviceLost`].
    pub fn read<T: bytemuck::Pod>(&self, gpu: &Gpu, output: Output) -> Result<Vec<T>> {
        let refuse = |cause: &str| Error::Picture {
            path: output.name().into(),
            cause: cause.into(),
        };
        let image = self.image(output).ok_or_else(|| refuse("was not asked for"))?;
        if size_of::<T>() as u64 != output.bytes() {
            return Err(refuse("has pixels of another size"));
        }
        let count = self.size[0] as usize * self.size[1] as usize * self.layering.layers() as usize;
        let bytes = count as u64 * output.bytes();
        let copy = gpu.buffer(&BufferDesc::readback(output.name(), bytes))?;
        let mut recorder = gpu.recorder("read G-buffer")?;
        recorder.pass("raster: copy", |pass| {
            let (attachment, source) = (
                vk::ImageLayout::COLOR_ATTACHMENT_OPTIMAL,
                vk::ImageLayout::TRANSFER_SRC_OPTIMAL,
            );
            let (drawn, read) = (Access::COLOR_WRITE, Access::TRANSFER_READ);
            let barrier = |from, to, old_layout, new_layout| ImageBarrier {
                image,
                from,
                to,
                old_layout,
                new_layout,
            };
            pass.image_barrier(&[barrier(drawn, read, attachment, source)]);
            pass.copy_image_to_buffer(image, copy.view())?;
            pass.image_barrier(&[barrier(read, drawn, source, attachment)]);
            Ok(())
        })?;
        recorder.submit()?.wait()?;
        copy.read(0, count)
    }

    fn pictures(&self) -> impl Iterator<Item = (Output, &Picture)> {
        self.pictures
            .iter()
            .flatten()
            .map(|(output, picture)| (*output, picture))
    }

    fn upload(&self, pass: &mut Pass<'_>, views: &[View]) -> Result<()> {
        let records: Vec<_> = views.iter().map(|view| view.record).collect();
        let barrier = |from, to| BufferBarrier {
            buffer: &self.views,
            from,
            to,
        };
        pass.barrier(&[barrier(VIEW_READ, Access::TRANSFER_WRITE)]);
        pass.update(self.views.view(), &records)?;
        pass.barrier(&[barrier(Access::TRANSFER_WRITE, VIEW_READ)]);
        Ok(())
    }

    /// What was drawn before is there when more is drawn.
    fn keep_attachments(&self, pass: &mut Pass<'_>) {
        let again = |image, access, layout| ImageBarrier {
            image,
            from: access,
            to: access,
            old_layout: layout,
            new_layout: layout,
        };
        let (color, depth) = (
            vk::ImageLayout::COLOR_ATTACHMENT_OPTIMAL,
            vk::ImageLayout::DEPTH_ATTACHMENT_OPTIMAL,
        );
        let mut barriers: Vec<_> = self
            .pictures()
            .map(|(_, picture)| again(&picture.image, Access::COLOR_WRITE, color))
            .collect();
        barriers.push(again(&self.depth.image, Access::DEPTH_WRITE, depth));
        pass.image_barrier(&barriers);
    }

    fn to_attachments(&self, pass: &mut Pass<'_>) {
        let discard = |image, from, to, new_layout| ImageBarrier {
            image,
            from,
            to,
            old_layout: vk::ImageLayout::UNDEFINED,
            new_layout,
        };
        let mut barriers: Vec<_> = self
            .pictures()
            .map(|(_, picture)| {
                let layout = vk::ImageLayout::COLOR_ATTACHMENT_OPTIMAL;
                discard(&picture.image, ANY_USE, Access::COLOR_WRITE, layout)
            })
            .collect();
        barriers.push(discard(
            &self.depth.image,
            Access::SHADER_READ | Access::DEPTH_WRITE,
            Access::DEPTH_WRITE,
            vk::ImageLayout::DEPTH_ATTACHMENT_OPTIMAL,
        ));
        pass.image_barrier(&barriers);
    }
}

impl Picture {
    fn new(
        gpu: &Gpu,
        desc: &GBufferDesc<'_>,
        name: &str,
        format: vk::Format,
        usage: vk::ImageUsageFlags,
    ) -> Result<Self> {
        let image = gpu.image(&ImageDesc {
            name,
            size: desc.size,
            layers: desc.layering.layers(),
            mips: 1,
            format,
            usage,
            category: Category::Film,
        })?;
        let layers = (0..desc.layering.renderings().unwrap_or(0))
            .map(|layer| image.part(&ImagePart::layer(layer, 0)))
            .collect::<Result<_>>()?;
        Ok(Self { image, layers })
    }
}
