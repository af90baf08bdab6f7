//! Blocking uploads and readbacks through staging buffers.

use super::barrier::{Access, BufferBarrier};
use super::buffer::{Buffer, BufferDesc, BufferView};
use super::device::Gpu;
use super::memory::Category;
use crate::{Error, Result};

/// Bytes of one staging copy.
const CHUNK: usize = 16 << 20;

impl Gpu {
    /// A storage buffer in device memory with the given contents.
    ///
    /// # Errors
    /// As [`Gpu::buffer`] and [`Gpu::upload`].
    pub fn buffer_with<T: bytemuck::NoUninit>(&self, name: &str, category: Category, data: &[T]) -> Result<Buffer> {
        let buffer = self.buffer(&BufferDesc::storage(name, size_of_val(data) as u64, category))?;
        self.upload(&buffer, 0, data)?;
        Ok(buffer)
    }

    /// Copies `data` into a device buffer and waits.
    ///
    /// # Errors
    /// [`crate::Error::LimitExceeded`] when it does not fit, [`crate::Error::OutOfMemory`], [`crate::Error::DeviceLost`].
    pub fn upload<T: bytemuck::NoUninit>(&self, buffer: &Buffer, offset: u64, data: &[T]) -> Result<()> {
        let bytes: &[u8] = bytemuck::cast_slice(data);
        let mut padded;
        for (index, chunk) in bytes.chunks(CHUNK).enumerate() {
            // Copies move whole words; a short tail is padded with zeros, which the buffer's own rounding leaves room for.
            let chunk = if chunk.len() % 4 == 0 {
                chunk
            } else {
                padded = chunk.to_vec();
                padded.resize(chunk.len().next_multiple_of(4), 0);
                &padded
            };
            let staging = self.buffer(&BufferDesc::upload("upload", chunk.len() as u64))?;
            staging.write(0, chunk)?;
            let start = offset + (index * CHUNK) as u64;
            let mut recorder = self.recorder("upload")?;
            recorder.pass("upload", |pass| {
                let target = buffer.slice(start, buffer.bytes().saturating_sub(start));
                pass.copy(staging.slice(0, chunk.len() as u64), target)
            })?;
            recorder.submit()?.wait()?;
        }
        Ok(())
    }

    /// Reads `count` values from a device buffer, after all work submitted before.
    ///
    /// # Errors
    /// As [`Gpu::upload`].
    pub fn read<T: bytemuck::Pod>(&self, view: BufferView<'_>, count: usize) -> Result<Vec<T>> {
        if count == 0 {
            return Ok(Vec::new());
        }
        let bytes = (count as u64).saturating_mul(size_of::<T>() as u64);
        if bytes > view.bytes {
            return Err(Error::LimitExceeded {
                name: view.buffer.name().into(),
                value: bytes,
                limit_name: "size",
                limit: view.bytes,
            });
        }
        BufferView { bytes, ..view }.check(1)?;
        let bytes = bytes.next_multiple_of(4);
        let staging = self.buffer(&BufferDesc::readback("readback", bytes))?;
        let mut recorder = self.recorder("readback")?;
        recorder.pass("readback", |pass| {
            let source = BufferView {
                bytes: bytes.min(view.bytes),
                ..view
            };
            pass.copy(source, staging.view())?;
            pass.barrier(&[BufferBarrier {
                buffer: &staging,
                from: Access::TRANSFER_WRITE,
                to: Access::HOST_READ,
            }]);
            Ok(())
        })?;
        recorder.submit()?.wait()?;
        staging.read(0, count)
    }
}
