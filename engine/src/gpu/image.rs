//! Images and samplers.

use std::sync::Arc;

use ash::vk;
use gpu_allocator::MemoryLocation;
use gpu_allocator::vulkan::Allocation;

use super::device::{Gpu, Inner};
use super::memory::Category;
use super::surface::SwapchainInner;
use crate::{Error, Result};

/// What image to allocate: two-dimensional, one sample, in device memory. Square images with a multiple of six layers can be seen as cubes
/// ([`ImagePart`](super::ImagePart)).
#[derive(Debug, Clone, Copy)]
pub struct ImageDesc<'a> {
    /// Shown by debuggers, validation messages and memory reports.
    pub name: &'a str,
    /// Texels across and down.
    pub size: [u32; 2],
    /// Array layers.
    pub layers: u32,
    /// Mip levels.
    pub mips: u32,
    /// Texel format.
    pub format: vk::Format,
    /// How it is used.
    pub usage: vk::ImageUsageFlags,
    /// What it is counted as.
    pub category: Category,
}

/// The uses that want a view.
const VIEWED: vk::ImageUsageFlags = vk::ImageUsageFlags::from_raw(
    vk::ImageUsageFlags::SAMPLED.as_raw()
        | vk::ImageUsageFlags::STORAGE.as_raw()
        | vk::ImageUsageFlags::COLOR_ATTACHMENT.as_raw()
        | vk::ImageUsageFlags::DEPTH_STENCIL_ATTACHMENT.as_raw(),
);

/// The uses of Vulkan 1.0, but for attachments without memory of their own.
const USES: vk::ImageUsageFlags = vk::ImageUsageFlags::from_raw(
    VIEWED.as_raw() | vk::ImageUsageFlags::TRANSFER_SRC.as_raw() | vk::ImageUsageFlags::TRANSFER_DST.as_raw(),
);

/// Faces of a cube.
pub(super) const CUBE_FACES: u32 = 6;

/// A device image, or a part of one, with a view of all of it. Cloning shares it.
#[derive(Clone)]
pub struct Image {
    pub(super) inner: Arc<ImageInner>,
}

impl std::fmt::Debug for Image {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Image")
            .field("name", &self.inner.name)
            .field("size", &self.inner.size)
            .finish()
    }
}

pub(super) struct ImageInner {
    pub gpu: Arc<Inner>,
    pub raw: vk::Image,
    pub view: vk::ImageView,
    pub name: String,
    /// Of the first mip level that is in `range`.
    pub size: [u32; 2],
    pub format: vk::Format,
    pub usage: vk::ImageUsageFlags,
    /// What shaders see it as.
    pub kind: vk::ImageViewType,
    /// Six of its layers can be seen as a cube.
    pub cubes: bool,
    /// What of `raw` this is.
    pub range: vk::ImageSubresourceRange,
    pub owner: Owner,
}

/// Who destroys an image.
pub(super) enum Owner {
    /// The handle here, with its memory.
    Own {
        allocated: u64,
        category: Category,
        allocation: Option<Allocation>,
    },
    /// A swapchain, which goes with its last image.
    Swapchain(#[expect(dead_code, reason = "it is kept alive")] Arc<SwapchainInner>),
    /// The image that this one is a part of.
    Whole(#[expect(dead_code, reason = "it is kept alive")] Arc<ImageInner>),
}

impl Gpu {
    /// Allocates an image in layout `UNDEFINED`.
    ///
    /// # Errors
    /// [`Error::OutOfMemory`], [`Error::MissingFeature`] for a format or use that the device lacks, [`Error::LimitExceeded`] for a size,
    /// [`Error::Setting`] for no use, one beyond Vulkan 1.0's, or a format of blocks, planes or stencils.
    pub fn image(&self, desc: &ImageDesc<'_>) -> Result<Image> {
        let gpu = &self.inner;
        gpu.check_alive()?;
        gpu.check_image(desc)?;
        let info = vk::ImageCreateInfo::default()
            .image_type(vk::ImageType::TYPE_2D)
            .format(desc.format)
            .extent(vk::Extent3D {
                width: desc.size[0],
                height: desc.size[1],
                depth: 1,
            })
            .mip_levels(desc.mips)
            .array_layers(desc.layers)
            .samples(vk::SampleCountFlags::TYPE_1)
            .tiling(vk::ImageTiling::OPTIMAL)
            .flags(image_flags(desc))
            .usage(desc.usage);
        // SAFETY: `info` is complete; the image is destroyed in `ImageInner::drop`.
        let raw = unsafe { gpu.device.create_image(&info, None) }
            .map_err(|result| gpu.creation_error("vkCreateImage", result, desc.name, 0))?;
        // SAFETY: `raw` was just created.
        let requirements = unsafe { gpu.device.get_image_memory_requirements(raw) };
        let mut inner = ImageInner {
            gpu: Arc::clone(gpu),
            raw,
            view: vk::ImageView::null(),
            name: desc.name.into(),
            size: desc.size,
            format: desc.format,
            usage: desc.usage,
            kind: if desc.layers > 1 {
                vk::ImageViewType::TYPE_2D_ARRAY
            } else {
                vk::ImageViewType::TYPE_2D
            },
            cubes: image_flags(desc).contains(vk::ImageCreateFlags::CUBE_COMPATIBLE),
            range: whole_range(desc.format, desc.layers, desc.mips),
            owner: Owner::Own {
                allocated: requirements.size,
                category: desc.category,
                allocation: None,
            },
        };
        let memory = gpu
            .memory
            .allocate(desc.name, desc.category, requirements, MemoryLocation::GpuOnly, false)?;
        // SAFETY: the allocation satisfies the requirements and is not bound to anything else.
        let bound = unsafe { gpu.device.bind_image_memory(raw, memory.memory(), memory.offset()) };
        if let Owner::Own { allocation, .. } = &mut inner.owner {
            *allocation = Some(memory);
        }
        bound.map_err(|result| gpu.error("vkBindImageMemory", result))?;
        gpu.name(raw, desc.name);
        if desc.usage.intersects(VIEWED) {
            inner.make_view()?;
        }
        Ok(Image { inner: Arc::new(inner) })
    }
}

impl Inner {
    /// Fails when the device cannot make such an image.
    fn check_image(&self, desc: &ImageDesc<'_>) -> Result<()> {
        if desc.usage.is_empty() || !USES.contains(desc.usage) {
            let cause = format!("is not what the image {:?} can be made for", desc.name);
            return Err(Error::setting("usage", format!("{:?}", desc.usage), cause));
        }
        if texel_bytes(desc.format).is_none() {
            let cause = format!("is not a format that the image {:?} can have", desc.name);
            return Err(Error::setting("format", format!("{:?}", desc.format), cause));
        }
        // SAFETY: the physical device belongs to the instance.
        let properties = unsafe {
            self.instance.raw.get_physical_device_image_format_properties(
                self.physical_device,
                desc.format,
                vk::ImageType::TYPE_2D,
                vk::ImageTiling::OPTIMAL,
                desc.usage,
                image_flags(desc),
            )
        };
        let properties = properties.map_err(|_| Error::MissingFeature {
            feature: format!("format {:?} for {:?}", desc.format, desc.usage),
            needed_by: desc.name.into(),
            device: self.caps.device.clone(),
            instead: "choose another format".into(),
        })?;
        let extent = properties.max_extent;
        let largest_mips = u32::BITS - desc.size[0].max(desc.size[1]).leading_zeros();
        let limits = [
            (desc.size[0], extent.width, "maxExtent.width"),
            (desc.size[1], extent.height, "maxExtent.height"),
            (desc.layers, properties.max_array_layers, "maxArrayLayers"),
            (desc.mips, properties.max_mip_levels.min(largest_mips), "maxMipLevels"),
        ];
        match limits.iter().find(|(wanted, limit, _)| *wanted == 0 || wanted > limit) {
            None => Ok(()),
            Some((wanted, limit, limit_name)) => Err(Error::LimitExceeded {
                name: desc.name.into(),
                value: u64::from(*wanted),
                limit_name,
                limit: u64::from(*limit),
            }),
        }
    }
}

impl ImageInner {
    /// Wraps an image that a swapchain owns and this keeps; only the view is this one's.
    pub fn of_swapchain(raw: vk::Image, swapchain: &Arc<SwapchainInner>) -> Result<Self> {
        let SwapchainInner {
            size, format, usage, ..
        } = **swapchain;
        let gpu = swapchain.gpu();
        let name = "swapchain image";
        let mut inner = Self {
            gpu: Arc::clone(gpu),
            raw,
            view: vk::ImageView::null(),
            name: name.into(),
            size,
            format,
            usage,
            kind: vk::ImageViewType::TYPE_2D,
            cubes: false,
            range: whole_range(format, 1, 1),
            owner: Owner::Swapchain(Arc::clone(swapchain)),
        };
        gpu.name(raw, name);
        inner.make_view()?;
        Ok(inner)
    }

    /// Makes the view of what this is.
    pub fn make_view(&mut self) -> Result<()> {
        let info = vk::ImageViewCreateInfo::default()
            .image(self.raw)
            .view_type(self.kind)
            .format(self.format)
            .subresource_range(self.range);
        // SAFETY: the image is alive and bound.
        self.view = unsafe { self.gpu.device.create_image_view(&info, None) }
            .map_err(|result| self.gpu.error("vkCreateImageView", result))?;
        self.gpu.name(self.view, &self.name);
        Ok(())
    }
}

impl Image {
    /// The name it was made with.
    pub fn name(&self) -> &str {
        &self.inner.name
    }

    /// Texels across and down, of its first mip level.
    pub fn size(&self) -> [u32; 2] {
        self.inner.size
    }

    /// Array layers.
    pub fn layers(&self) -> u32 {
        self.inner.range.layer_count
    }

    /// Mip levels.
    pub fn mips(&self) -> u32 {
        self.inner.range.level_count
    }

    /// Texel format.
    pub fn format(&self) -> vk::Format {
        self.inner.format
    }

    /// The Vulkan handle.
    pub fn raw(&self) -> vk::Image {
        self.inner.raw
    }

    /// The view of all of it; null for an image that is only copied.
    pub fn view(&self) -> vk::ImageView {
        self.inner.view
    }

    /// Fails when the image was not made for a use.
    pub(super) fn check_usage(&self, usage: vk::ImageUsageFlags) -> Result<()> {
        if self.inner.usage.contains(usage) {
            return Ok(());
        }
        let cause = format!("is used as {usage:?}, for which it was not made");
        Err(Error::setting("image", self.name(), cause))
    }

    /// Fails for a layout that the image cannot be in, by what it was made for.
    pub(super) fn check_layout(&self, layout: vk::ImageLayout) -> Result<()> {
        let usage = match layout {
            vk::ImageLayout::GENERAL => return Ok(()),
            vk::ImageLayout::PRESENT_SRC_KHR if matches!(self.inner.owner, Owner::Swapchain(_)) => return Ok(()),
            vk::ImageLayout::TRANSFER_SRC_OPTIMAL => vk::ImageUsageFlags::TRANSFER_SRC,
            vk::ImageLayout::TRANSFER_DST_OPTIMAL => vk::ImageUsageFlags::TRANSFER_DST,
            vk::ImageLayout::SHADER_READ_ONLY_OPTIMAL => vk::ImageUsageFlags::SAMPLED,
            vk::ImageLayout::COLOR_ATTACHMENT_OPTIMAL => vk::ImageUsageFlags::COLOR_ATTACHMENT,
            vk::ImageLayout::DEPTH_ATTACHMENT_OPTIMAL => vk::ImageUsageFlags::DEPTH_STENCIL_ATTACHMENT,
            other => {
                let cause = format!("cannot be in layout {other:?}");
                return Err(Error::setting("image", self.name(), cause));
            }
        };
        self.check_usage(usage)
    }
}

impl Drop for ImageInner {
    fn drop(&mut self) {
        // SAFETY: the last owner is gone, and submissions own what they use; other owners destroy their images themselves.
        unsafe {
            self.gpu.device.destroy_image_view(self.view, None);
            if let Owner::Own { .. } = self.owner {
                self.gpu.device.destroy_image(self.raw, None);
            }
        }
        if let Owner::Own {
            allocated,
            category,
            allocation,
        } = &mut self.owner
            && let Some(allocation) = allocation.take()
        {
            self.gpu.memory.free(*category, *allocated, allocation);
        }
    }
}

fn image_flags(desc: &ImageDesc<'_>) -> vk::ImageCreateFlags {
    if desc.size[0] == desc.size[1] && desc.layers.is_multiple_of(CUBE_FACES) {
        vk::ImageCreateFlags::CUBE_COMPATIBLE
    } else {
        vk::ImageCreateFlags::empty()
    }
}

fn whole_range(format: vk::Format, layers: u32, mips: u32) -> vk::ImageSubresourceRange {
    vk::ImageSubresourceRange {
        aspect_mask: aspect(format),
        base_mip_level: 0,
        level_count: mips,
        base_array_layer: 0,
        layer_count: layers,
    }
}

/// Colour or depth, by format.
pub(super) fn aspect(format: vk::Format) -> vk::ImageAspectFlags {
    match format {
        vk::Format::D16_UNORM | vk::Format::D32_SFLOAT | vk::Format::X8_D24_UNORM_PACK32 => vk::ImageAspectFlags::DEPTH,
        _ => vk::ImageAspectFlags::COLOR,
    }
}

/// Bytes of one texel, for the formats that pictures and tables use.
pub(super) fn texel_bytes(format: vk::Format) -> Option<u64> {
    Some(match format {
        vk::Format::R8_UNORM | vk::Format::R8_UINT => 1,
        vk::Format::D16_UNORM | vk::Format::R16_SFLOAT | vk::Format::R16_UNORM | vk::Format::R8G8_UNORM => 2,
        vk::Format::R8G8B8A8_UNORM
        | vk::Format::R8G8B8A8_SRGB
        | vk::Format::B8G8R8A8_UNORM
        | vk::Format::B8G8R8A8_SRGB
        | vk::Format::A2B10G10R10_UNORM_PACK32
        | vk::Format::R16G16_SFLOAT
        | vk::Format::R32_SFLOAT
        | vk::Format::R32_UINT
        | vk::Format::R32_SINT
        | vk::Format::D32_SFLOAT
        | vk::Format::X8_D24_UNORM_PACK32 => 4,
        vk::Format::R16G16B16A16_SFLOAT | vk::Format::R32G32_SFLOAT | vk::Format::R32G32_UINT => 8,
        vk::Format::R32G32B32A32_SFLOAT | vk::Format::R32G32B32A32_UINT => 16,
        _ => return None,
    })
}

/// How to sample.
#[derive(Debug, Clone, Copy)]
pub struct SamplerDesc<'a> {
    /// Shown by debuggers.
    pub name: &'a str,
    /// Filter for magnification, minification and mips.
    pub filter: vk::Filter,
    /// Address mode of all axes.
    pub address: vk::SamplerAddressMode,
}

impl SamplerDesc<'_> {
    /// Fails for a filter or address mode that is an extension's or a feature's that no device here has enabled.
    fn check(&self) -> Result<()> {
        let filters = [vk::Filter::NEAREST, vk::Filter::LINEAR];
        let addresses = [
            vk::SamplerAddressMode::REPEAT,
            vk::SamplerAddressMode::MIRRORED_REPEAT,
            vk::SamplerAddressMode::CLAMP_TO_EDGE,
            vk::SamplerAddressMode::CLAMP_TO_BORDER,
        ];
        for (name, value, known) in [
            ("filter", format!("{:?}", self.filter), filters.contains(&self.filter)),
            (
                "address",
                format!("{:?}", self.address),
                addresses.contains(&self.address),
            ),
        ] {
            if !known {
                return Err(Error::setting(name, value, "is not one of Vulkan 1.0's"));
            }
        }
        Ok(())
    }
}

/// A sampler. Cloning shares it.
#[derive(Clone)]
pub struct Sampler {
    pub(super) inner: Arc<SamplerInner>,
}

impl std::fmt::Debug for Sampler {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Sampler").finish_non_exhaustive()
    }
}

pub(super) struct SamplerInner {
    pub gpu: Arc<Inner>,
    pub raw: vk::Sampler,
}

impl Gpu {
    /// Makes a sampler.
    ///
    /// # Errors
    /// [`Error::OutOfMemory`]; [`Error::Setting`] for filters and address modes beyond Vulkan 1.0's.
    pub fn sampler(&self, desc: &SamplerDesc<'_>) -> Result<Sampler> {
        desc.check()?;
        let mipmap = if desc.filter == vk::Filter::NEAREST {
            vk::SamplerMipmapMode::NEAREST
        } else {
            vk::SamplerMipmapMode::LINEAR
        };
        let info = vk::SamplerCreateInfo::default()
            .mag_filter(desc.filter)
            .min_filter(desc.filter)
            .mipmap_mode(mipmap)
            .address_mode_u(desc.address)
            .address_mode_v(desc.address)
            .address_mode_w(desc.address)
            .max_lod(vk::LOD_CLAMP_NONE);
        // SAFETY: `info` is complete; destroyed in `SamplerInner::drop`.
        let raw = unsafe { self.inner.device.create_sampler(&info, None) }
            .map_err(|r| self.inner.error("vkCreateSampler", r))?;
        self.inner.name(raw, desc.name);
        Ok(Sampler {
            inner: Arc::new(SamplerInner {
                gpu: Arc::clone(&self.inner),
                raw,
            }),
        })
    }
}

impl Drop for SamplerInner {
    fn drop(&mut self) {
        // SAFETY: the last owner is gone, and submissions own what they use.
        unsafe { self.gpu.device.destroy_sampler(self.raw, None) };
    }
}
