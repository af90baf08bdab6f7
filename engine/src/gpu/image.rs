//! Images and samplers.

use std::sync::Arc;

use ash::vk;
use gpu_allocator::MemoryLocation;
use gpu_allocator::vulkan::Allocation;

use super::device::{Gpu, Inner};
use super::memory::Category;
use crate::{Error, Result};

/// What image to allocate: two-dimensional, one sample, in device memory.
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

/// A device image with a view of all of it. Cloning shares it.
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
    gpu: Arc<Inner>,
    pub raw: vk::Image,
    pub view: vk::ImageView,
    pub name: String,
    pub size: [u32; 2],
    pub format: vk::Format,
    pub layers: u32,
    allocated: u64,
    category: Category,
    /// `None` for images that a swapchain owns.
    allocation: Option<Allocation>,
    borrowed: bool,
}

impl Gpu {
    /// Allocates an image in layout `UNDEFINED`.
    ///
    /// # Errors
    /// [`Error::OutOfMemory`], [`Error::MissingFeature`] for a format or use that the device lacks, [`Error::LimitExceeded`] for a size.
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
            layers: desc.layers,
            allocated: requirements.size,
            category: desc.category,
            allocation: None,
            borrowed: false,
        };
        let allocation = gpu
            .memory
            .allocate(desc.name, desc.category, requirements, MemoryLocation::GpuOnly, false)?;
        // SAFETY: the allocation satisfies the requirements and is not bound to anything else.
        let bound = unsafe {
            gpu.device
                .bind_image_memory(raw, allocation.memory(), allocation.offset())
        };
        inner.allocation = Some(allocation);
        bound.map_err(|result| gpu.error("vkBindImageMemory", result))?;
        if desc.usage.intersects(VIEWED) {
            inner.make_view(desc.layers, desc.mips)?;
        } else {
            gpu.name(raw, desc.name);
        }
        Ok(Image { inner: Arc::new(inner) })
    }
}

impl Inner {
    /// Fails when the device cannot make such an image.
    fn check_image(&self, desc: &ImageDesc<'_>) -> Result<()> {
        // SAFETY: the physical device belongs to the instance.
        let properties = unsafe {
            self.instance.raw.get_physical_device_image_format_properties(
                self.physical_device,
                desc.format,
                vk::ImageType::TYPE_2D,
                vk::ImageTiling::OPTIMAL,
                desc.usage,
                vk::ImageCreateFlags::empty(),
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
    /// Wraps an image that a swapchain owns; only the view is this one's.
    pub fn borrowed(gpu: &Arc<Inner>, raw: vk::Image, name: &str, size: [u32; 2], format: vk::Format) -> Result<Self> {
        let mut inner = Self {
            gpu: Arc::clone(gpu),
            raw,
            view: vk::ImageView::null(),
            name: name.into(),
            size,
            format,
            layers: 1,
            allocated: 0,
            category: Category::Film,
            allocation: None,
            borrowed: true,
        };
        inner.make_view(1, 1)?;
        Ok(inner)
    }

    fn make_view(&mut self, layers: u32, mips: u32) -> Result<()> {
        let kind = if layers > 1 {
            vk::ImageViewType::TYPE_2D_ARRAY
        } else {
            vk::ImageViewType::TYPE_2D
        };
        let range = vk::ImageSubresourceRange {
            aspect_mask: aspect(self.format),
            base_mip_level: 0,
            level_count: mips,
            base_array_layer: 0,
            layer_count: layers,
        };
        let info = vk::ImageViewCreateInfo::default()
            .image(self.raw)
            .view_type(kind)
            .format(self.format)
            .subresource_range(range);
        // SAFETY: the image is alive and bound.
        self.view = unsafe { self.gpu.device.create_image_view(&info, None) }
            .map_err(|result| self.gpu.error("vkCreateImageView", result))?;
        self.gpu.name(self.raw, &self.name);
        self.gpu.name(self.view, &self.name);
        Ok(())
    }
}

impl Image {
    /// Texels across and down.
    pub fn size(&self) -> [u32; 2] {
        self.inner.size
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
}

impl Drop for ImageInner {
    fn drop(&mut self) {
        // SAFETY: the last owner is gone, and submissions own what they use; a swapchain's images are its own.
        unsafe {
            self.gpu.device.destroy_image_view(self.view, None);
            if !self.borrowed {
                self.gpu.device.destroy_image(self.raw, None);
            }
        }
        if let Some(allocation) = self.allocation.take() {
            self.gpu.memory.free(self.category, self.allocated, allocation);
        }
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
    gpu: Arc<Inner>,
    pub raw: vk::Sampler,
}

impl Gpu {
    /// Makes a sampler.
    ///
    /// # Errors
    /// [`Error::OutOfMemory`].
    pub fn sampler(&self, desc: &SamplerDesc<'_>) -> Result<Sampler> {
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
