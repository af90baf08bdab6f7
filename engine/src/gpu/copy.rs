//! Copies and fills of buffers and images, checked against their sizes.

use std::sync::Arc;

use ash::vk;

use super::barrier::Access;
use super::buffer::BufferView;
use super::image::{Image, texel_bytes};
use super::recorder::Pass;
use crate::{Error, Result};

impl Pass<'_> {
    /// Fills a buffer with a word; the part must begin at and be a multiple of 4 bytes.
    ///
    /// # Errors
    /// [`Error::LimitExceeded`] for a part that is not in the buffer or not of whole words, [`Error::Setting`] for a buffer of another device or one
    /// that was not made for it, [`Error::MissingBarrier`] in debug builds.
    pub fn fill(&mut self, view: BufferView<'_>, word: u32) -> Result<()> {
        view.check(4)?;
        if !view.bytes.is_multiple_of(4) {
            return Err(Error::LimitExceeded {
                name: view.buffer.name().into(),
                value: view.bytes,
                limit_name: "whole words of a fill, in bytes",
                limit: view.bytes / 4 * 4,
            });
        }
        view.check_usage(vk::BufferUsageFlags::TRANSFER_DST)?;
        if view.bytes == 0 {
            return Ok(());
        }
        self.recorder.next_command();
        self.recorder.touch(self.name, view.buffer, Access::TRANSFER_WRITE)?;
        // SAFETY: the range lies in the buffer (sizes are multiples of 4), which is kept alive.
        unsafe {
            self.recorder.gpu.inner.device.cmd_fill_buffer(
                self.command_buffer,
                view.buffer.raw(),
                view.raw_offset(),
                view.bytes,
                word,
            );
        }
        Ok(())
    }

    /// Writes a few values (at most 64 KiB) that travel inside the command buffer.
    ///
    /// # Errors
    /// [`Error::LimitExceeded`] when they do not fit, [`Error::Setting`] as [`Pass::fill`], [`Error::MissingBarrier`] in debug builds.
    pub fn update<T: bytemuck::NoUninit>(&mut self, view: BufferView<'_>, data: &[T]) -> Result<()> {
        let bytes: &[u8] = bytemuck::cast_slice(data);
        let limit = view.bytes.min(65_536);
        if bytes.len() as u64 > limit || !bytes.len().is_multiple_of(4) {
            return Err(Error::LimitExceeded {
                name: view.buffer.name().into(),
                value: bytes.len() as u64,
                limit_name: "size of an inline update, in whole words",
                limit,
            });
        }
        view.check(4)?;
        view.check_usage(vk::BufferUsageFlags::TRANSFER_DST)?;
        if bytes.is_empty() {
            return Ok(());
        }
        self.recorder.next_command();
        self.recorder.touch(self.name, view.buffer, Access::TRANSFER_WRITE)?;
        // SAFETY: size and alignment were checked; the buffer is kept alive.
        unsafe {
            self.recorder.gpu.inner.device.cmd_update_buffer(
                self.command_buffer,
                view.buffer.raw(),
                view.raw_offset(),
                bytes,
            )
        };
        Ok(())
    }

    /// Copies `from` to the start of `to`.
    ///
    /// # Errors
    /// [`Error::LimitExceeded`] when it does not fit, [`Error::Setting`] as [`Pass::fill`] and when one part lies over the other,
    /// [`Error::MissingBarrier`] in debug builds.
    pub fn copy(&mut self, from: BufferView<'_>, to: BufferView<'_>) -> Result<()> {
        if from.bytes > to.bytes {
            return Err(Error::LimitExceeded {
                name: to.buffer.name().into(),
                value: from.bytes,
                limit_name: "size",
                limit: to.bytes,
            });
        }
        from.check(1)?;
        to.check(1)?;
        from.check_usage(vk::BufferUsageFlags::TRANSFER_SRC)?;
        to.check_usage(vk::BufferUsageFlags::TRANSFER_DST)?;
        if from.bytes == 0 {
            return Ok(());
        }
        let (source, target) = (from.raw_offset(), to.raw_offset());
        let is_one = from.buffer.raw() == to.buffer.raw() && Arc::ptr_eq(&from.buffer.inner.gpu, &to.buffer.inner.gpu);
        if is_one && source.abs_diff(target) < from.bytes {
            let cause = "is copied onto a part that lies over it";
            return Err(Error::setting("buffer", from.buffer.name(), cause));
        }
        self.recorder.next_command();
        self.recorder.touch(self.name, from.buffer, Access::TRANSFER_READ)?;
        self.recorder.touch(self.name, to.buffer, Access::TRANSFER_WRITE)?;
        let region = vk::BufferCopy {
            src_offset: from.raw_offset(),
            dst_offset: to.raw_offset(),
            size: from.bytes,
        };
        // SAFETY: both ranges lie in their buffers, which are kept alive.
        unsafe {
            self.recorder.gpu.inner.device.cmd_copy_buffer(
                self.command_buffer,
                from.buffer.raw(),
                to.buffer.raw(),
                &[region],
            );
        }
        Ok(())
    }

    /// Copies all layers of an image's first mip level, in layout `TRANSFER_SRC_OPTIMAL`, to a buffer, rows and layers packed.
    ///
    /// # Errors
    /// [`Error::LimitExceeded`] when the buffer is too small, [`Error::Setting`] for an image or a buffer of another device or one that was not made
    /// for it, [`Error::MissingBarrier`] in debug builds.
    pub fn copy_image_to_buffer(&mut self, from: &Image, to: BufferView<'_>) -> Result<()> {
        image_rows(from, to)?;
        self.check_image(from, vk::ImageUsageFlags::TRANSFER_SRC)?;
        to.check_usage(vk::BufferUsageFlags::TRANSFER_DST)?;
        self.recorder.next_command();
        self.recorder.keep(&from.inner);
        self.recorder.touch(self.name, to.buffer, Access::TRANSFER_WRITE)?;
        let layout = vk::ImageLayout::TRANSFER_SRC_OPTIMAL;
        // SAFETY: both are kept alive; the author put the image into the layout.
        unsafe {
            self.recorder.gpu.inner.device.cmd_copy_image_to_buffer(
                self.command_buffer,
                from.raw(),
                layout,
                to.buffer.raw(),
                &[whole_image(from, to.raw_offset())],
            );
        }
        Ok(())
    }

    /// Copies packed rows and layers to an image's first mip level, in layout `TRANSFER_DST_OPTIMAL`.
    ///
    /// # Errors
    /// [`Error::LimitExceeded`] when the buffer is too small, [`Error::Setting`] for an image or a buffer of another device or one that was not made
    /// for it, [`Error::MissingBarrier`] in debug builds.
    pub fn copy_buffer_to_image(&mut self, from: BufferView<'_>, to: &Image) -> Result<()> {
        image_rows(to, from)?;
        self.check_image(to, vk::ImageUsageFlags::TRANSFER_DST)?;
        from.check_usage(vk::BufferUsageFlags::TRANSFER_SRC)?;
        self.recorder.next_command();
        self.recorder.keep(&to.inner);
        self.recorder.touch(self.name, from.buffer, Access::TRANSFER_READ)?;
        let layout = vk::ImageLayout::TRANSFER_DST_OPTIMAL;
        // SAFETY: as in `copy_image_to_buffer`.
        unsafe {
            self.recorder.gpu.inner.device.cmd_copy_buffer_to_image(
                self.command_buffer,
                from.buffer.raw(),
                to.raw(),
                layout,
                &[whole_image(to, from.raw_offset())],
            );
        }
        Ok(())
    }
}

/// Fails when the packed rows of the image's layers do not fit into the view.
fn image_rows(image: &Image, view: BufferView<'_>) -> Result<()> {
    let [width, height] = image.size().map(u64::from);
    let texel = texel_bytes(image.format()).ok_or_else(|| Error::Picture {
        path: image.inner.name.clone(),
        cause: format!("copies of format {:?} are not supported", image.format()),
    })?;
    let rows = BufferView {
        bytes: width * height * texel * u64::from(image.layers()),
        ..view
    };
    rows.check(texel.max(4))?;
    if rows.bytes > view.bytes {
        return Err(Error::LimitExceeded {
            name: view.buffer.name().into(),
            value: rows.bytes,
            limit_name: "size of the part",
            limit: view.bytes,
        });
    }
    Ok(())
}

fn whole_image(image: &Image, buffer_offset: u64) -> vk::BufferImageCopy {
    let range = image.inner.range;
    vk::BufferImageCopy {
        buffer_offset,
        image_subresource: vk::ImageSubresourceLayers {
            aspect_mask: range.aspect_mask,
            mip_level: range.base_mip_level,
            base_array_layer: range.base_array_layer,
            layer_count: range.layer_count,
        },
        image_extent: vk::Extent3D {
            width: image.size()[0],
            height: image.size()[1],
            depth: 1,
        },
        ..Default::default()
    }
}
