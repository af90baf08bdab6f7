//! What a command buffer needs beside itself; reused from submission to submission.

use ash::vk;

use super::caps::Caps;
use super::device::{Gpu, Inner};
use super::recorder::MAX_PASSES;
use crate::Result;

/// Descriptor sets of one pool.
const SETS_PER_POOL: u32 = 256;
/// Descriptors of each type of one pool.
const DESCRIPTORS_PER_POOL: u32 = 2048;

/// Frame resources on loan. They go back to the device's store when this is dropped, so the device must be done with them by then.
pub(super) struct Lease {
    gpu: Gpu,
    held: FrameResources,
}

impl Lease {
    /// Takes recycled resources or makes new ones.
    pub fn take(gpu: &Gpu) -> Result<Self> {
        let recycled = gpu.inner.recycled().pop();
        let held = recycled.map_or_else(|| FrameResources::new(&gpu.inner), Ok)?;
        Ok(Self { gpu: gpu.clone(), held })
    }
}

impl std::ops::Deref for Lease {
    type Target = FrameResources;

    fn deref(&self) -> &FrameResources {
        &self.held
    }
}

impl std::ops::DerefMut for Lease {
    fn deref_mut(&mut self) -> &mut FrameResources {
        &mut self.held
    }
}

impl Drop for Lease {
    fn drop(&mut self) {
        let mut held = std::mem::take(&mut self.held);
        match held.reset(&self.gpu.inner) {
            Ok(()) => self.gpu.inner.recycled().push(held),
            // SAFETY: the device is done with all of it.
            Err(_) => unsafe { held.destroy(&self.gpu.inner.device) },
        }
    }
}

/// A command pool with its buffer, query pools and descriptor pools.
#[derive(Default)]
pub(super) struct FrameResources {
    pub command_pool: vk::CommandPool,
    pub command_buffer: vk::CommandBuffer,
    /// Two timestamps per pass; null without timestamp support.
    pub timestamps: vk::QueryPool,
    /// The counts of [`counted`] of each pass; null without support.
    pub statistics: vk::QueryPool,
    descriptor_pools: Vec<vk::DescriptorPool>,
    pool_in_use: usize,
}

/// Counts of draws, in the order in which queries give them.
pub(super) const COUNTS_OF_DRAWS: usize = 3;

/// What pipeline statistics count: draws where there are any, and compute shader invocations, which come last.
fn counted(caps: &Caps) -> vk::QueryPipelineStatisticFlags {
    let draws = vk::QueryPipelineStatisticFlags::VERTEX_SHADER_INVOCATIONS
        | vk::QueryPipelineStatisticFlags::CLIPPING_INVOCATIONS
        | vk::QueryPipelineStatisticFlags::FRAGMENT_SHADER_INVOCATIONS;
    let compute = vk::QueryPipelineStatisticFlags::COMPUTE_SHADER_INVOCATIONS;
    if caps.graphics { draws | compute } else { compute }
}

impl FrameResources {
    fn new(inner: &Inner) -> Result<Self> {
        let device = &inner.device;
        let mut resources = Self::default();
        if let Err(error) = resources.fill(inner) {
            // SAFETY: nothing of it is in use yet.
            unsafe { resources.destroy(device) };
            return Err(error);
        }
        Ok(resources)
    }

    fn fill(&mut self, inner: &Inner) -> Result<()> {
        let device = &inner.device;
        let info = vk::CommandPoolCreateInfo::default()
            .queue_family_index(inner.queue_family)
            .flags(vk::CommandPoolCreateFlags::TRANSIENT);
        // SAFETY: plain creation on a live device.
        self.command_pool =
            unsafe { device.create_command_pool(&info, None) }.map_err(|r| inner.error("vkCreateCommandPool", r))?;
        let info = vk::CommandBufferAllocateInfo::default()
            .command_pool(self.command_pool)
            .command_buffer_count(1);
        // SAFETY: the pool was just made.
        self.command_buffer = unsafe { device.allocate_command_buffers(&info) }
            .map_err(|r| inner.error("vkAllocateCommandBuffers", r))?[0];
        if inner.caps.timestamp_valid_bits > 0 {
            let info = vk::QueryPoolCreateInfo::default()
                .query_type(vk::QueryType::TIMESTAMP)
                .query_count(2 * MAX_PASSES as u32);
            // SAFETY: plain creation.
            self.timestamps =
                unsafe { device.create_query_pool(&info, None) }.map_err(|r| inner.error("vkCreateQueryPool", r))?;
        }
        if inner.caps.pipeline_statistics {
            let info = vk::QueryPoolCreateInfo::default()
                .query_type(vk::QueryType::PIPELINE_STATISTICS)
                .pipeline_statistics(counted(&inner.caps))
                .query_count(MAX_PASSES as u32);
            // SAFETY: the feature is enabled where it is offered.
            self.statistics =
                unsafe { device.create_query_pool(&info, None) }.map_err(|r| inner.error("vkCreateQueryPool", r))?;
        }
        Ok(())
    }

    /// A descriptor set from the pools, which grow as needed.
    pub fn descriptor_set(&mut self, inner: &Inner, layout: vk::DescriptorSetLayout) -> Result<vk::DescriptorSet> {
        let layouts = [layout];
        loop {
            let fresh = self.pool_in_use == self.descriptor_pools.len();
            if fresh {
                self.descriptor_pools.push(descriptor_pool(inner)?);
            }
            let pool = self.descriptor_pools[self.pool_in_use];
            let info = vk::DescriptorSetAllocateInfo::default()
                .descriptor_pool(pool)
                .set_layouts(&layouts);
            // SAFETY: pool and layout are alive.
            match unsafe { inner.device.allocate_descriptor_sets(&info) } {
                Ok(sets) => return Ok(sets[0]),
                Err(vk::Result::ERROR_OUT_OF_POOL_MEMORY | vk::Result::ERROR_FRAGMENTED_POOL) if !fresh => {
                    self.pool_in_use += 1
                }
                Err(result) => return Err(inner.error("vkAllocateDescriptorSets", result)),
            }
        }
    }

    /// Makes everything ready to be recorded again. The device must be done with it.
    fn reset(&mut self, inner: &Inner) -> Result<()> {
        // SAFETY: the caller waited for the submission that used these.
        unsafe {
            inner
                .device
                .reset_command_pool(self.command_pool, vk::CommandPoolResetFlags::empty())
                .map_err(|r| inner.error("vkResetCommandPool", r))?;
            for pool in &self.descriptor_pools {
                inner
                    .device
                    .reset_descriptor_pool(*pool, vk::DescriptorPoolResetFlags::empty())
                    .map_err(|r| inner.error("vkResetDescriptorPool", r))?;
            }
        }
        self.pool_in_use = 0;
        Ok(())
    }

    /// # Safety
    /// The device must be done with everything.
    pub unsafe fn destroy(self, device: &ash::Device) {
        // SAFETY: see above; null handles are allowed.
        unsafe {
            for pool in &self.descriptor_pools {
                device.destroy_descriptor_pool(*pool, None);
            }
            device.destroy_query_pool(self.timestamps, None);
            device.destroy_query_pool(self.statistics, None);
            device.destroy_command_pool(self.command_pool, None);
        }
    }
}

fn descriptor_pool(inner: &Inner) -> Result<vk::DescriptorPool> {
    let size = |ty| vk::DescriptorPoolSize {
        ty,
        descriptor_count: DESCRIPTORS_PER_POOL,
    };
    let mut sizes = vec![
        size(vk::DescriptorType::STORAGE_BUFFER),
        size(vk::DescriptorType::UNIFORM_BUFFER),
        size(vk::DescriptorType::STORAGE_IMAGE),
        size(vk::DescriptorType::COMBINED_IMAGE_SAMPLER),
        size(vk::DescriptorType::UNIFORM_TEXEL_BUFFER),
    ];
    if inner.caps.ray_query {
        sizes.push(size(vk::DescriptorType::ACCELERATION_STRUCTURE_KHR));
    }
    let info = vk::DescriptorPoolCreateInfo::default()
        .max_sets(SETS_PER_POOL)
        .pool_sizes(&sizes);
    // SAFETY: plain creation.
    unsafe { inner.device.create_descriptor_pool(&info, None) }.map_err(|r| inner.error("vkCreateDescriptorPool", r))
}
