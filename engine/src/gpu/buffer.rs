//! Buffers: named, counted, checked against the device's limits.

use std::sync::atomic::{AtomicU32, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use ash::vk;
use gpu_allocator::MemoryLocation;
use gpu_allocator::vulkan::Allocation;

use super::device::{Gpu, Inner};
use super::memory::Category;
use crate::{Error, Result};

/// Where a buffer lives.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Residency {
    /// Device memory; filled and read by copies.
    Device,
    /// Mapped, written by the host.
    Upload,
    /// Mapped and cached, read by the host.
    Readback,
}

/// What to allocate.
#[derive(Debug, Clone, Copy)]
pub struct BufferDesc<'a> {
    /// Shown by debuggers, validation messages and memory reports.
    pub name: &'a str,
    /// Size; 0 is rounded up, since Vulkan has no empty buffers.
    pub bytes: u64,
    /// Where it lives.
    pub residency: Residency,
    /// What it is counted as.
    pub category: Category,
    /// How it is used: one or several of Vulkan 1.0's uses.
    pub usage: vk::BufferUsageFlags,
}

/// The uses of Vulkan 1.0; others want features that no device here has enabled.
const USES: vk::BufferUsageFlags = vk::BufferUsageFlags::from_raw(
    vk::BufferUsageFlags::TRANSFER_SRC.as_raw()
        | vk::BufferUsageFlags::TRANSFER_DST.as_raw()
        | vk::BufferUsageFlags::UNIFORM_TEXEL_BUFFER.as_raw()
        | vk::BufferUsageFlags::STORAGE_TEXEL_BUFFER.as_raw()
        | vk::BufferUsageFlags::UNIFORM_BUFFER.as_raw()
        | vk::BufferUsageFlags::STORAGE_BUFFER.as_raw()
        | vk::BufferUsageFlags::INDEX_BUFFER.as_raw()
        | vk::BufferUsageFlags::VERTEX_BUFFER.as_raw()
        | vk::BufferUsageFlags::INDIRECT_BUFFER.as_raw(),
);

impl<'a> BufferDesc<'a> {
    /// A storage buffer in device memory that can also be copied, filled and hold indirect arguments.
    pub fn storage(name: &'a str, bytes: u64, category: Category) -> Self {
        Self {
            name,
            bytes,
            residency: Residency::Device,
            category,
            usage: vk::BufferUsageFlags::STORAGE_BUFFER
                | vk::BufferUsageFlags::INDIRECT_BUFFER
                | vk::BufferUsageFlags::TRANSFER_SRC
                | vk::BufferUsageFlags::TRANSFER_DST,
        }
    }

    /// A uniform buffer in device memory that can also be copied and filled. What shaders read of it at once is bounded by
    /// `maxUniformBufferRange`.
    pub fn uniform(name: &'a str, bytes: u64, category: Category) -> Self {
        Self {
            name,
            bytes,
            residency: Residency::Device,
            category,
            usage: vk::BufferUsageFlags::UNIFORM_BUFFER
                | vk::BufferUsageFlags::TRANSFER_SRC
                | vk::BufferUsageFlags::TRANSFER_DST,
        }
    }

    /// A mapped buffer for copies to the device.
    pub fn upload(name: &'a str, bytes: u64) -> Self {
        let usage = vk::BufferUsageFlags::TRANSFER_SRC;
        Self {
            name,
            bytes,
            residency: Residency::Upload,
            category: Category::Staging,
            usage,
        }
    }

    /// A mapped buffer for copies from the device.
    pub fn readback(name: &'a str, bytes: u64) -> Self {
        let usage = vk::BufferUsageFlags::TRANSFER_DST;
        Self {
            name,
            bytes,
            residency: Residency::Readback,
            category: Category::Staging,
            usage,
        }
    }
}

/// A device buffer. Cloning shares it; the memory goes back when the last clone and the last submission that uses it are gone.
#[derive(Clone)]
pub struct Buffer {
    pub(super) inner: Arc<BufferInner>,
}

impl std::fmt::Debug for Buffer {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Buffer")
            .field("name", &self.inner.name)
            .field("bytes", &self.inner.bytes)
            .finish()
    }
}

pub(super) struct BufferInner {
    pub gpu: Arc<Inner>,
    pub raw: vk::Buffer,
    /// Where it begins in `raw`: 0 but for a host's.
    pub base: u64,
    pub id: u64,
    pub name: String,
    pub bytes: u64,
    pub usage: vk::BufferUsageFlags,
    pub memory: Memory,
    /// The value of the device's timeline at which its last submission that uses this is over; 0 when none is. Of mapped memory alone. Locked
    /// while the host reads or writes the memory, and while a submission that uses it is handed to the queue.
    pub in_use_until: Mutex<u64>,
}

impl BufferInner {
    /// Nothing of the engine's touches mapped memory while the guard lives.
    pub fn lock(&self) -> MutexGuard<'_, u64> {
        // What a panic left behind is at worst half of a copy of plain words.
        self.in_use_until.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// The host reaches the memory.
    pub fn is_mapped(&self) -> bool {
        self.mapping().is_some()
    }

    fn mapping(&self) -> Option<*mut u8> {
        match &self.memory {
            // Where all memory is the host's, that of devices has an address, too.
            Memory::Own { residency, .. } if *residency == Residency::Device => None,
            Memory::Own { allocation, .. } => Some(allocation.as_ref()?.mapped_ptr()?.as_ptr().cast()),
            Memory::Host => None,
        }
    }
}

/// Whose memory a buffer is in.
pub(super) enum Memory {
    /// The engine's.
    Own {
        residency: Residency,
        category: Category,
        bytes: u64,
        /// `None` only while it is made or dropped.
        allocation: Option<Allocation>,
    },
    /// A host's, which also owns the handle.
    Host,
}

impl Gpu {
    /// Allocates a buffer.
    ///
    /// # Errors
    /// [`Error::LimitExceeded`] past `maxStorageBufferRange` (storage) or `maxMemoryAllocationSize`, [`Error::Setting`] for no use or one beyond
    /// Vulkan 1.0's, [`Error::OutOfMemory`].
    pub fn buffer(&self, desc: &BufferDesc<'_>) -> Result<Buffer> {
        let caps = self.caps();
        let limit = |limit_name, limit| Error::LimitExceeded {
            name: desc.name.into(),
            value: desc.bytes,
            limit_name,
            limit,
        };
        if desc.usage.is_empty() || !USES.contains(desc.usage) {
            let cause = format!("is not what the buffer {:?} can be made for", desc.name);
            return Err(Error::setting("usage", format!("{:?}", desc.usage), cause));
        }
        let range = rounded(desc.bytes).filter(|bytes| *bytes > caps.max_storage_buffer_range);
        if desc.usage.contains(vk::BufferUsageFlags::STORAGE_BUFFER) && range.is_some() {
            return Err(limit("maxStorageBufferRange", caps.max_storage_buffer_range));
        }
        self.allocate_buffer(desc)
    }

    /// A buffer of any use that the device has enabled, which need not be bound.
    pub(super) fn allocate_buffer(&self, desc: &BufferDesc<'_>) -> Result<Buffer> {
        let caps = self.caps();
        let limit = |limit_name, limit| Error::LimitExceeded {
            name: desc.name.into(),
            value: desc.bytes,
            limit_name,
            limit,
        };
        let bytes = rounded(desc.bytes).ok_or_else(|| limit("maxMemoryAllocationSize", caps.max_allocation_size))?;
        if bytes > caps.max_allocation_size {
            return Err(limit("maxMemoryAllocationSize", caps.max_allocation_size));
        }
        let gpu = &self.inner;
        gpu.check_alive()?;
        let info = vk::BufferCreateInfo::default()
            .size(bytes)
            .usage(desc.usage)
            .sharing_mode(vk::SharingMode::EXCLUSIVE);
        // SAFETY: `info` is complete; the buffer is destroyed in `BufferInner::drop`.
        let raw = unsafe { gpu.device.create_buffer(&info, None) }
            .map_err(|result| gpu.creation_error("vkCreateBuffer", result, desc.name, bytes))?;
        // SAFETY: `raw` was just created.
        let requirements = unsafe { gpu.device.get_buffer_memory_requirements(raw) };
        let location = match desc.residency {
            Residency::Device => MemoryLocation::GpuOnly,
            Residency::Upload => MemoryLocation::CpuToGpu,
            Residency::Readback => MemoryLocation::GpuToCpu,
        };
        let mut inner = BufferInner {
            gpu: Arc::clone(gpu),
            raw,
            base: 0,
            id: gpu.next_id(),
            name: desc.name.into(),
            bytes,
            usage: desc.usage,
            memory: Memory::Own {
                residency: desc.residency,
                category: desc.category,
                bytes: requirements.size,
                allocation: None,
            },
            in_use_until: Mutex::new(0),
        };
        let allocation = gpu
            .memory
            .allocate(desc.name, desc.category, requirements, location, true)?;
        // SAFETY: the allocation satisfies the requirements and is not bound to anything else.
        let bound = unsafe {
            gpu.device
                .bind_buffer_memory(raw, allocation.memory(), allocation.offset())
        };
        inner.memory = Memory::Own {
            residency: desc.residency,
            category: desc.category,
            bytes: requirements.size,
            allocation: Some(allocation),
        };
        bound.map_err(|result| gpu.error("vkBindBufferMemory", result))?;
        gpu.name(raw, desc.name);
        Ok(Buffer { inner: Arc::new(inner) })
    }
}

/// The size of a buffer of so many bytes; `None` where there is none.
fn rounded(bytes: u64) -> Option<u64> {
    bytes.max(16).checked_next_multiple_of(4)
}

impl Buffer {
    /// Its size in bytes: as allocated (rounded up to 4, at least 16), or as a host lent it.
    pub fn bytes(&self) -> u64 {
        self.inner.bytes
    }

    /// Its name.
    pub fn name(&self) -> &str {
        &self.inner.name
    }

    /// The Vulkan handle. A buffer that a host lent may begin further on in it: [`Buffer::raw_offset`].
    pub fn raw(&self) -> vk::Buffer {
        self.inner.raw
    }

    /// Where it begins in [`Buffer::raw`], in bytes; 0 for the engine's own.
    pub fn raw_offset(&self) -> u64 {
        self.inner.base
    }

    /// All of it.
    pub fn view(&self) -> BufferView<'_> {
        BufferView {
            buffer: self,
            offset: 0,
            bytes: self.inner.bytes,
        }
    }

    /// A part of it. Storage bindings want `offset` aligned to `minStorageBufferOffsetAlignment` (256 always is).
    pub fn slice(&self, offset: u64, bytes: u64) -> BufferView<'_> {
        BufferView {
            buffer: self,
            offset,
            bytes,
        }
    }

    /// Writes a mapped buffer. One thread at a time reads or writes it; the others wait.
    ///
    /// # Errors
    /// [`Error::LimitExceeded`] when `data` does not fit or the buffer is not mapped; [`Error::Setting`] while a submission that uses the buffer
    /// is not over; [`Error::DeviceLost`] when it never will be.
    pub fn write<T: bytemuck::NoUninit>(&self, offset: u64, data: &[T]) -> Result<()> {
        let bytes: &[u8] = bytemuck::cast_slice(data);
        let pointer = self.mapped(offset, bytes.len() as u64)?;
        let _alone = self.lock_unused()?;
        // SAFETY: `mapped` checked that the range lies inside the mapping, which no submission uses and no other thread while the lock is held;
        // the source cannot overlap device memory.
        unsafe { std::ptr::copy_nonoverlapping(bytes.as_ptr(), pointer, bytes.len()) };
        Ok(())
    }

    /// Reads a mapped buffer. One thread at a time reads or writes it; the others wait.
    ///
    /// # Errors
    /// As [`Buffer::write`], before any memory is taken for the values.
    pub fn read<T: bytemuck::Pod>(&self, offset: u64, count: usize) -> Result<Vec<T>> {
        let pointer = self.mapped(offset, bytes_of::<T>(count))?;
        let _alone = self.lock_unused()?;
        // SAFETY: as in `write`.
        Ok(unsafe { values_at(pointer, count) })
    }

    /// Reads a mapped buffer that a submission is using: what the device has made visible to the host in the middle of its work.
    ///
    /// # Errors
    /// [`Error::LimitExceeded`] as [`Buffer::read`].
    ///
    /// # Safety
    /// Neither the device nor another thread writes this part meanwhile.
    pub unsafe fn read_in_use<T: bytemuck::Pod>(&self, offset: u64, count: usize) -> Result<Vec<T>> {
        let pointer = self.mapped(offset, bytes_of::<T>(count))?;
        // SAFETY: `mapped` checked the range; the rest is the caller's.
        Ok(unsafe { values_at(pointer, count) })
    }

    /// The first words of a mapped buffer as they are now, whatever the device does with them; `None` when there are not so many.
    pub(super) fn words_now(&self, count: usize) -> Option<Vec<u32>> {
        let pointer = self.mapped(0, bytes_of::<u32>(count)).ok()?.cast::<u32>();
        if !pointer.is_aligned() {
            return None;
        }
        // SAFETY: the words are aligned and lie inside the mapping; an atomic read of a word may meet a write of it.
        let word = |at| unsafe { AtomicU32::from_ptr(pointer.add(at)) }.load(Ordering::Relaxed);
        Some((0..count).map(word).collect())
    }

    /// The lock of mapped memory that no submission uses.
    fn lock_unused(&self) -> Result<MutexGuard<'_, u64>> {
        let mut until = self.inner.lock();
        if *until == 0 {
            return Ok(until);
        }
        let gpu = &self.inner.gpu;
        gpu.check_alive()?;
        // SAFETY: the timeline lives as long as the device.
        let reached = unsafe { gpu.device.get_semaphore_counter_value(gpu.timeline) }
            .map_err(|result| gpu.error("vkGetSemaphoreCounterValue", result))?;
        if reached < *until {
            let cause = "is in use by a submission that is not over; wait for it first";
            return Err(Error::setting("buffer", self.name(), cause));
        }
        *until = 0;
        Ok(until)
    }

    fn mapped(&self, offset: u64, bytes: u64) -> Result<*mut u8> {
        let error = |limit_name, limit| Error::LimitExceeded {
            name: self.inner.name.clone(),
            value: offset.saturating_add(bytes),
            limit_name,
            limit,
        };
        if offset.saturating_add(bytes) > self.inner.bytes {
            return Err(error("size", self.inner.bytes));
        }
        let pointer = self.inner.mapping().ok_or_else(|| error("mapped size", 0))?;
        // SAFETY: the offset lies inside the mapping.
        Ok(unsafe { pointer.add(offset as usize) })
    }
}

/// Bytes of so many values; more than any buffer has where they cannot be numbered.
fn bytes_of<T>(count: usize) -> u64 {
    (count as u64).saturating_mul(size_of::<T>() as u64)
}

/// Copies values out of mapped memory.
///
/// # Safety
/// So many values begin there, and nothing writes them meanwhile.
unsafe fn values_at<T: bytemuck::Pod>(pointer: *const u8, count: usize) -> Vec<T> {
    let mut data = vec![T::zeroed(); count];
    let bytes: &mut [u8] = bytemuck::cast_slice_mut(&mut data);
    // SAFETY: the caller's; new memory overlaps nothing.
    unsafe { std::ptr::copy_nonoverlapping(pointer, bytes.as_mut_ptr(), bytes.len()) };
    data
}

impl Drop for BufferInner {
    fn drop(&mut self) {
        let Memory::Own {
            category,
            bytes,
            allocation,
            ..
        } = &mut self.memory
        else {
            return;
        };
        // SAFETY: the last owner is gone, and submissions own what they use.
        unsafe { self.gpu.device.destroy_buffer(self.raw, None) };
        if let Some(allocation) = allocation.take() {
            self.gpu.memory.free(*category, *bytes, allocation);
        }
    }
}

/// A range of a buffer.
#[derive(Debug, Clone, Copy)]
pub struct BufferView<'a> {
    /// The buffer.
    pub buffer: &'a Buffer,
    /// First byte.
    pub offset: u64,
    /// Length in bytes.
    pub bytes: u64,
}

impl BufferView<'_> {
    /// Where it begins in the Vulkan buffer.
    pub(super) fn raw_offset(&self) -> u64 {
        self.buffer.inner.base + self.offset
    }

    /// Fails when the buffer was not made, or not lent, for a use.
    pub(super) fn check_usage(&self, usage: vk::BufferUsageFlags) -> Result<()> {
        if self.buffer.inner.usage.contains(usage) {
            return Ok(());
        }
        let cause = format!("is used as {usage:?}, for which it was not made");
        Err(Error::setting("buffer", self.buffer.name(), cause))
    }

    /// Fails when the range does not lie in the buffer or does not begin at a multiple of `alignment`.
    pub(super) fn check(&self, alignment: u64) -> Result<()> {
        let error = |value, limit_name, limit| Error::LimitExceeded {
            name: self.buffer.name().into(),
            value,
            limit_name,
            limit,
        };
        let end = self.offset.saturating_add(self.bytes);
        if end > self.buffer.bytes() {
            return Err(error(end, "size", self.buffer.bytes()));
        }
        let offset = self.raw_offset();
        if !offset.is_multiple_of(alignment) {
            return Err(error(offset, "offset alignment", alignment));
        }
        Ok(())
    }
}

impl<'a> From<&'a Buffer> for BufferView<'a> {
    fn from(buffer: &'a Buffer) -> Self {
        buffer.view()
    }
}
