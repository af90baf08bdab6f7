//! Texel buffers: buffers that shaders read by typed texels.
//!
//! What is gathered at addresses that differ from lane to lane is best read this way: software drivers vectorise texel fetches, but load
//! storage buffers lane by lane and word by word. The size limit is `maxTexelBufferElements` instead of `maxStorageBufferRange`.

use std::sync::Arc;

use ash::vk;

use super::buffer::{Buffer, BufferDesc, Residency};
use super::device::{Gpu, Inner};
use super::image::texel_bytes;
use super::memory::Category;
use crate::{Error, Result};

/// A device buffer with a view of all of it in a texel format. Cloning shares it.
#[derive(Clone)]
pub struct TexelView {
    pub(super) inner: Arc<TexelViewInner>,
}

impl std::fmt::Debug for TexelView {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_tuple("TexelView").field(&self.inner.buffer).finish()
    }
}

pub(super) struct TexelViewInner {
    gpu: Arc<Inner>,
    raw: vk::BufferView,
    buffer: Buffer,
}

impl Gpu {
    /// A texel buffer in device memory with the given contents, for kernels to read; `data` is rounded up to whole texels, and at least
    /// one.
    ///
    /// # Errors
    /// [`Error::LimitExceeded`] past `maxTexelBufferElements`, [`Error::Setting`] and [`Error::MissingFeature`] for a format that texel buffers do not
    /// have, here or on the device, and as [`Gpu::buffer`] and [`Gpu::upload`].
    pub fn texels_with<T: bytemuck::NoUninit>(
        &self,
        name: &str,
        category: Category,
        format: vk::Format,
        data: &[T],
    ) -> Result<TexelView> {
        let texels = (size_of_val(data) as u64).div_ceil(texel_size(name, format)?);
        let view = self.texel_view(
            name,
            category,
            format,
            texels,
            vk::BufferUsageFlags::UNIFORM_TEXEL_BUFFER,
        )?;
        if !data.is_empty() {
            self.upload(view.buffer(), 0, data)?;
        }
        Ok(view)
    }

    /// A texel buffer in device memory that kernels write as a storage buffer and later dispatches read by texels; at least one texel. Its
    /// contents are undefined.
    ///
    /// # Errors
    /// As [`Gpu::texels_with`].
    pub fn storage_texels(&self, name: &str, category: Category, format: vk::Format, texels: u64) -> Result<TexelView> {
        let usage = vk::BufferUsageFlags::UNIFORM_TEXEL_BUFFER | vk::BufferUsageFlags::STORAGE_BUFFER;
        self.texel_view(name, category, format, texels, usage)
    }

    fn texel_view(
        &self,
        name: &str,
        category: Category,
        format: vk::Format,
        texels: u64,
        usage: vk::BufferUsageFlags,
    ) -> Result<TexelView> {
        let texel = texel_size(name, format)?;
        let texels = texels.max(1);
        self.caps().check_texels(name, texels)?;
        let buffer = self.buffer(&BufferDesc {
            name,
            bytes: texels * texel,
            residency: Residency::Device,
            category,
            usage: usage | vk::BufferUsageFlags::TRANSFER_SRC | vk::BufferUsageFlags::TRANSFER_DST,
        })?;
        self.make_texel_view(name, &buffer, format, vk::WHOLE_SIZE)
    }

    /// A view of all whole texels of a buffer that was made with `UNIFORM_TEXEL_BUFFER` (and `STORAGE_BUFFER` where kernels write it): of a
    /// host's ([`Gpu::borrow_buffer`]), to be used where kernels take texels.
    ///
    /// # Errors
    /// [`Error::Setting`] for a buffer of another device or that was made for other uses, one without room for a texel, or a format that has no texels
    /// of whole bytes; [`Error::MissingFeature`] for one that the device has no texel buffers of; [`Error::LimitExceeded`] past
    /// `maxTexelBufferElements`, or for one that does not begin at a multiple of `minTexelBufferOffsetAlignment` (256 always is).
    pub fn texel_view_of(&self, buffer: &Buffer, format: vk::Format) -> Result<TexelView> {
        if !Arc::ptr_eq(&buffer.inner.gpu, &self.inner) {
            return Err(Error::setting("buffer", buffer.name(), "belongs to another device"));
        }
        let view = buffer.view();
        view.check_usage(vk::BufferUsageFlags::UNIFORM_TEXEL_BUFFER)?;
        view.check(self.caps().texel_buffer_alignment)?;
        let texel = texel_bytes(format).unwrap_or(0);
        let texels = buffer.bytes().checked_div(texel).unwrap_or(0);
        if texels == 0 {
            let cause = format!("has no texels in the buffer {:?}", buffer.name());
            return Err(Error::setting("format", format!("{format:?}"), cause));
        }
        self.caps().check_texels(buffer.name(), texels)?;
        self.make_texel_view(buffer.name(), buffer, format, texels * texel)
    }

    fn make_texel_view(&self, name: &str, buffer: &Buffer, format: vk::Format, range: u64) -> Result<TexelView> {
        let gpu = &self.inner;
        // SAFETY: the physical device belongs to the instance.
        let offered = unsafe {
            gpu.instance
                .raw
                .get_physical_device_format_properties(gpu.physical_device, format)
        };
        if !offered
            .buffer_features
            .contains(vk::FormatFeatureFlags::UNIFORM_TEXEL_BUFFER)
        {
            return Err(Error::MissingFeature {
                feature: format!("texel buffers of format {format:?}"),
                needed_by: name.into(),
                device: gpu.caps.device.clone(),
                instead: "choose another format".into(),
            });
        }
        let info = vk::BufferViewCreateInfo::default()
            .buffer(buffer.raw())
            .offset(buffer.raw_offset())
            .format(format)
            .range(range);
        // SAFETY: the buffer is alive, and kept so by the view; destroyed in `TexelViewInner::drop`.
        let raw = unsafe { gpu.device.create_buffer_view(&info, None) }
            .map_err(|result| gpu.error("vkCreateBufferView", result))?;
        gpu.name(raw, name);
        Ok(TexelView {
            inner: Arc::new(TexelViewInner {
                gpu: Arc::clone(gpu),
                raw,
                buffer: buffer.clone(),
            }),
        })
    }
}

/// Bytes of a texel.
fn texel_size(name: &str, format: vk::Format) -> Result<u64> {
    texel_bytes(format).ok_or_else(|| {
        let cause = format!("has no texels that the buffer {name:?} can be made of");
        Error::setting("format", format!("{format:?}"), cause)
    })
}

impl TexelView {
    /// The buffer behind it.
    pub fn buffer(&self) -> &Buffer {
        &self.inner.buffer
    }

    /// The Vulkan handle.
    pub fn raw(&self) -> vk::BufferView {
        self.inner.raw
    }
}

impl Drop for TexelViewInner {
    fn drop(&mut self) {
        // SAFETY: the last owner is gone, and submissions own what they use.
        unsafe { self.gpu.device.destroy_buffer_view(self.raw, None) };
    }
}
