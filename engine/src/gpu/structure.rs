//! The driver's acceleration structures over boxes, which ray queries of kernels go through.
//!
//! Source: Khronos, "Vulkan Specification", the chapter on acceleration structures.

use std::sync::Arc;

use ash::{khr, vk};
use bytemuck::{Pod, Zeroable};

use super::buffer::{Buffer, BufferDesc, Residency};
use super::device::{Gpu, Inner};
use super::memory::Category;
use super::shaders::constants;
use crate::{Error, Result};

/// A box as structures are built of it, `VkAabbPositionsKHR`: lower and upper corner.
pub type StructureBox = [[f32; 3]; 2];

/// `VkAccelerationStructureInstanceKHR`.
#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct Instance {
    /// Rows.
    transform: [[f32; 4]; 3],
    /// 24 bits and 8.
    index_and_mask: u32,
    offset_and_flags: u32,
    structure: vk::DeviceAddress,
}

/// An acceleration structure for ray queries: one instance, where it is, of a geometry of boxes. The primitive index of a candidate is the place of its
/// box. Cloning shares it; its memory goes back when the last clone and the last submission that uses it are gone.
#[derive(Clone)]
pub struct AccelerationStructure {
    pub(super) inner: Arc<StructureInner>,
}

impl std::fmt::Debug for AccelerationStructure {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("AccelerationStructure")
            .field("name", &self.inner.storage.name())
            .field("bytes", &self.bytes())
            .finish()
    }
}

/// A level of a structure.
pub(super) struct StructureInner {
    pub gpu: Arc<Inner>,
    pub raw: vk::AccelerationStructureKHR,
    loader: khr::acceleration_structure::Device,
    storage: Buffer,
    /// What its instance is of.
    below: Option<Arc<StructureInner>>,
}

/// What the levels of a structure have in common.
struct Builder<'a> {
    gpu: &'a Gpu,
    loader: &'a khr::acceleration_structure::Device,
    name: &'a str,
    category: Category,
}

impl Gpu {
    /// Builds a structure over boxes on the device, and waits for it. The same boxes give the same candidates, in an order that is the driver's.
    ///
    /// # Errors
    /// [`Error::MissingFeature`] on a device without [`Caps::ray_query`](super::Caps::ray_query); [`Error::LimitExceeded`] for more boxes than
    /// [`Caps::max_structure_boxes`](super::Caps::max_structure_boxes) and for what is larger than `maxMemoryAllocationSize`; [`Error::Setting`] for a box
    /// that is not finite or whose corners are not in order; [`Error::OutOfMemory`], [`Error::DeviceLost`].
    pub fn box_structure(
        &self,
        name: &str,
        category: Category,
        boxes: &[StructureBox],
    ) -> Result<AccelerationStructure> {
        let Some(loader) = &self.inner.structures else {
            return Err(self.inner.lacks_ray_queries(name));
        };
        let limit = self.caps().max_structure_boxes;
        if boxes.len() as u64 > limit {
            return Err(Error::LimitExceeded {
                name: name.into(),
                value: boxes.len() as u64,
                limit_name: "maxPrimitiveCount",
                limit,
            });
        }
        let in_order = |[lower, upper]: &StructureBox| {
            (0..3).all(|axis| lower[axis].is_finite() && lower[axis] <= upper[axis] && upper[axis].is_finite())
        };
        if let Some(wrong) = boxes.iter().find(|corners| !in_order(corners)) {
            let cause = format!("is no box that {name:?} can be built of");
            return Err(Error::setting("box", format!("{wrong:?}"), cause));
        }
        let builder = Builder {
            gpu: self,
            loader,
            name,
            category,
        };
        let lower = builder.boxes(boxes)?;
        builder.instance_of(lower)
    }
}

impl Builder<'_> {
    /// The lower level.
    fn boxes(&self, boxes: &[StructureBox]) -> Result<Arc<StructureInner>> {
        let input = self.input(boxes)?;
        let data = vk::AccelerationStructureGeometryAabbsDataKHR::default()
            .data(vk::DeviceOrHostAddressConstKHR {
                device_address: self.address(&input),
            })
            .stride(size_of::<StructureBox>() as u64);
        let geometry = vk::AccelerationStructureGeometryKHR::default()
            .geometry_type(vk::GeometryTypeKHR::AABBS)
            .geometry(vk::AccelerationStructureGeometryDataKHR { aabbs: data });
        let kind = vk::AccelerationStructureTypeKHR::BOTTOM_LEVEL;
        self.level(kind, geometry, boxes.len() as u32, &input, None)
    }

    /// The upper level.
    fn instance_of(&self, below: Arc<StructureInner>) -> Result<AccelerationStructure> {
        let of = vk::AccelerationStructureDeviceAddressInfoKHR::default().acceleration_structure(below.raw);
        let input = self.input(&[Instance {
            transform: [[1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0]],
            index_and_mask: constants::DRIVER_MASK << 24,
            offset_and_flags: 0,
            // SAFETY: the structure is alive.
            structure: unsafe { self.loader.get_acceleration_structure_device_address(&of) },
        }])?;
        let data = vk::AccelerationStructureGeometryInstancesDataKHR::default().data(vk::DeviceOrHostAddressConstKHR {
            device_address: self.address(&input),
        });
        let geometry = vk::AccelerationStructureGeometryKHR::default()
            .geometry_type(vk::GeometryTypeKHR::INSTANCES)
            .geometry(vk::AccelerationStructureGeometryDataKHR { instances: data });
        let kind = vk::AccelerationStructureTypeKHR::TOP_LEVEL;
        let inner = self.level(kind, geometry, 1, &input, Some(below))?;
        Ok(AccelerationStructure { inner })
    }

    /// Builds a level of `count` primitives, which are in `input`, and waits for it.
    fn level(
        &self,
        kind: vk::AccelerationStructureTypeKHR,
        geometry: vk::AccelerationStructureGeometryKHR<'_>,
        count: u32,
        input: &Buffer,
        below: Option<Arc<StructureInner>>,
    ) -> Result<Arc<StructureInner>> {
        let gpu = &self.gpu.inner;
        let geometries = [geometry];
        let build = vk::AccelerationStructureBuildGeometryInfoKHR::default()
            .ty(kind)
            .flags(vk::BuildAccelerationStructureFlagsKHR::PREFER_FAST_TRACE)
            .mode(vk::BuildAccelerationStructureModeKHR::BUILD)
            .geometries(&geometries);
        let mut sizes = vk::AccelerationStructureBuildSizesInfoKHR::default();
        // SAFETY: there are as many counts as geometries; addresses are not read.
        unsafe {
            self.loader.get_acceleration_structure_build_sizes(
                vk::AccelerationStructureBuildTypeKHR::DEVICE,
                &build,
                &[count],
                &mut sizes,
            );
        }
        let storage = self.buffer(
            self.name,
            sizes.acceleration_structure_size,
            vk::BufferUsageFlags::ACCELERATION_STRUCTURE_STORAGE_KHR,
        )?;
        let create = vk::AccelerationStructureCreateInfoKHR::default()
            .buffer(storage.raw())
            .size(sizes.acceleration_structure_size)
            .ty(kind);
        // SAFETY: the buffer is as large, and is kept by the structure; destroyed in `StructureInner::drop`.
        let raw = unsafe { self.loader.create_acceleration_structure(&create, None) }
            .map_err(|result| gpu.creation_error("vkCreateAccelerationStructureKHR", result, self.name, 0))?;
        let built = Arc::new(StructureInner {
            gpu: Arc::clone(gpu),
            raw,
            loader: self.loader.clone(),
            storage,
            below,
        });
        gpu.name(raw, self.name);
        let alignment = gpu.caps.structure_scratch_alignment;
        let scratch = self.buffer(
            "scratch of an acceleration structure",
            sizes.build_scratch_size + alignment,
            vk::BufferUsageFlags::STORAGE_BUFFER,
        )?;
        let build = build
            .dst_acceleration_structure(raw)
            .scratch_data(vk::DeviceOrHostAddressKHR {
                device_address: self.address(&scratch).next_multiple_of(alignment),
            });
        let range = vk::AccelerationStructureBuildRangeInfoKHR::default().primitive_count(count);
        // Submissions see all that earlier ones of the queue have written: the input, and the level below.
        let mut recorder = self.gpu.recorder("acceleration structure")?;
        recorder.pass(self.name, |pass| {
            for buffer in [input, &scratch] {
                pass.recorder.keep(&buffer.inner);
            }
            pass.recorder.keep(&built);
            // SAFETY: the structure has the size that this build asked for, the scratch memory too, at an aligned address; the input holds as many
            // primitives; all of them live until the submission is over.
            unsafe {
                self.loader
                    .cmd_build_acceleration_structures(pass.command_buffer, &[build], &[&[range]]);
            }
            Ok(())
        })?;
        recorder.submit()?.wait()?;
        Ok(built)
    }

    /// A buffer that builds read, with what they read.
    fn input<T: bytemuck::NoUninit>(&self, data: &[T]) -> Result<Buffer> {
        let usage =
            vk::BufferUsageFlags::ACCELERATION_STRUCTURE_BUILD_INPUT_READ_ONLY_KHR | vk::BufferUsageFlags::TRANSFER_DST;
        let buffer = self.buffer("input of an acceleration structure", size_of_val(data) as u64, usage)?;
        self.gpu.upload(&buffer, 0, data)?;
        Ok(buffer)
    }

    /// A buffer that builds take by its address.
    fn buffer(&self, name: &str, bytes: u64, usage: vk::BufferUsageFlags) -> Result<Buffer> {
        self.gpu.allocate_buffer(&BufferDesc {
            name,
            bytes,
            residency: Residency::Device,
            category: self.category,
            usage: usage | vk::BufferUsageFlags::SHADER_DEVICE_ADDRESS,
        })
    }

    fn address(&self, buffer: &Buffer) -> vk::DeviceAddress {
        let info = vk::BufferDeviceAddressInfo::default().buffer(buffer.raw());
        // SAFETY: the buffer is alive and was made to be addressed; the feature is enabled wherever ray queries are.
        unsafe { self.gpu.inner.device.get_buffer_device_address(&info) }
    }
}

impl AccelerationStructure {
    /// Bytes of its levels.
    pub fn bytes(&self) -> u64 {
        let below = self.inner.below.as_ref();
        self.inner.storage.bytes() + below.map_or(0, |below| below.storage.bytes())
    }

    /// The Vulkan handle, of the upper level.
    pub fn raw(&self) -> vk::AccelerationStructureKHR {
        self.inner.raw
    }
}

impl Inner {
    /// The error of a device that has no ray queries.
    pub fn lacks_ray_queries(&self, needed_by: &str) -> Error {
        Error::MissingFeature {
            feature: "VK_KHR_ray_query with VK_KHR_acceleration_structure".into(),
            needed_by: needed_by.into(),
            device: self.caps.device.clone(),
            instead: "choose an index of the engine's own, such as `wide`".into(),
        }
    }
}

impl Drop for StructureInner {
    fn drop(&mut self) {
        // SAFETY: the last owner is gone, and submissions own what they use.
        unsafe { self.loader.destroy_acceleration_structure(self.raw, None) };
    }
}
