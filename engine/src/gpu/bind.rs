//! Descriptor sets: allocated, written from typed resources, bound, and every use noted for the barrier checks.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use ash::vk;

use super::barrier::Access;
use super::image::Image;
use super::interface::{BindingInfo, BindingKind, BindingSet, BoundResource, ShaderInfo, Stage, ViewKind};
use super::layout::descriptor_type;
use super::recorder::Pass;
use crate::{Error, Result};

/// How the stage of a shader reads and writes a binding.
fn access(stage: Stage, binding: &BindingInfo) -> Access {
    let (read, write, uniform) = match stage {
        Stage::Compute => (
            Access::COMPUTE_READ,
            Access::COMPUTE_WRITE,
            Access::COMPUTE_UNIFORM_READ,
        ),
        Stage::Vertex => (Access::VERTEX_READ, Access::VERTEX_WRITE, Access::VERTEX_UNIFORM_READ),
        Stage::Geometry => (
            Access::GEOMETRY_READ,
            Access::GEOMETRY_WRITE,
            Access::GEOMETRY_UNIFORM_READ,
        ),
        Stage::Fragment => (
            Access::FRAGMENT_READ,
            Access::FRAGMENT_WRITE,
            Access::FRAGMENT_UNIFORM_READ,
        ),
    };
    if binding.kind == BindingKind::UniformBuffer {
        return uniform;
    }
    let read = if binding.reads { read } else { Access::NONE };
    let write = if binding.writes { write } else { Access::NONE };
    read | write
}

/// A place in a descriptor set.
pub(super) struct Slot<'a> {
    /// The shader's name, for errors.
    pub shader: &'a str,
    /// The binding's.
    pub name: &'a str,
    pub binding: u32,
    pub kind: BindingKind,
    /// What the shader sees an image as.
    pub view: Option<ViewKind>,
    /// Bytes that the shader reaches by no index.
    pub fixed_bytes: u64,
    /// How the shader uses what is there.
    pub access: Access,
}

impl Slot<'_> {
    /// Fails for an image that is not seen as the shader does: it would look for layers that are not there.
    fn check_view(&self, image: &Image) -> Result<()> {
        let wanted = match self.view {
            None => return Ok(()),
            Some(ViewKind::Plane) => vk::ImageViewType::TYPE_2D,
            Some(ViewKind::Layers) => vk::ImageViewType::TYPE_2D_ARRAY,
            Some(ViewKind::Cube) => vk::ImageViewType::CUBE,
        };
        let found = image.inner.kind;
        if found == wanted {
            return Ok(());
        }
        Err(Error::Shader {
            name: self.shader.into(),
            message: format!(
                "{} is seen as {wanted:?}, and {:?} is {found:?}; Image::part makes a view of another kind",
                self.name,
                image.name()
            ),
        })
    }
}

/// Fails when one command would read a buffer by texels and write it: texel fetches may see the memory as it was before, whatever the
/// shader's own barriers.
fn check_texels(shaders: &[&'static ShaderInfo], sets: &[&dyn BindingSet<'_>]) -> Result<()> {
    let (mut read, mut written) = (BTreeMap::new(), BTreeMap::new());
    for set in sets {
        let resources = set.resources();
        for (shader, binding) in shaders.iter().flat_map(|s| s.used_bindings().map(move |b| (s.name, b))) {
            if binding.set != set.set() {
                continue;
            }
            for (_, resource) in resources.iter().filter(|(at, _)| *at == binding.binding) {
                match resource {
                    BoundResource::Texels(view) => drop(read.insert(view.buffer().inner.id, binding.name)),
                    BoundResource::Buffer(view) if binding.writes => {
                        written.insert(view.buffer.inner.id, (shader, binding.name));
                    }
                    _ => {}
                }
            }
        }
    }
    match written.iter().find_map(|(id, by)| Some((by, read.get(id)?))) {
        None => Ok(()),
        Some(((shader, output), input)) => Err(Error::Shader {
            name: (*shader).into(),
            message: format!("{input} is read by texels and {output} is written, and both are one buffer"),
        }),
    }
}

impl Pass<'_> {
    /// Allocates, writes and binds the descriptor sets of the shaders of one pipeline. Shaders may share sets; several givers of one set
    /// number make one set together.
    pub(super) fn bind_sets(
        &mut self,
        shaders: &[&'static ShaderInfo],
        point: vk::PipelineBindPoint,
        layout: vk::PipelineLayout,
        set_layouts: &[vk::DescriptorSetLayout],
        sets: &[&dyn BindingSet<'_>],
    ) -> Result<()> {
        let inner = Arc::clone(&self.recorder.gpu.inner);
        if cfg!(debug_assertions) {
            check_texels(shaders, sets)?;
        }
        let numbers: BTreeSet<u32> = shaders
            .iter()
            .flat_map(|shader| shader.used_bindings())
            .map(|binding| binding.set)
            .collect();
        for number in numbers {
            let Some(set_layout) = set_layouts.get(number as usize) else {
                continue;
            };
            let given: Vec<_> = sets
                .iter()
                .filter(|set| set.set() == number)
                .flat_map(|set| set.resources())
                .collect();
            let raw = self.recorder.resources().descriptor_set(&inner, *set_layout)?;
            for shader in shaders {
                for binding in shader.used_bindings().filter(|binding| binding.set == number) {
                    let resource = given.iter().find(|(at, _)| *at == binding.binding);
                    let (_, resource) = resource.ok_or_else(|| Error::Shader {
                        name: shader.name.into(),
                        message: format!(
                            "{} (set {number}, binding {}) was not given",
                            binding.name, binding.binding
                        ),
                    })?;
                    let slot = Slot {
                        shader: shader.name,
                        name: binding.name,
                        binding: binding.binding,
                        kind: binding.kind,
                        view: binding.view,
                        fixed_bytes: binding.fixed_bytes.into(),
                        access: access(shader.stage, binding),
                    };
                    self.write_descriptor(raw, &slot, *resource)?;
                }
            }
            // SAFETY: the set was just allocated with the layout of this pipeline.
            unsafe {
                inner
                    .device
                    .cmd_bind_descriptor_sets(self.command_buffer, point, layout, number, &[raw], &[])
            };
        }
        Ok(())
    }

    /// Fails for an image of another device, or one that was not made for a use.
    pub(super) fn check_image(&self, image: &Image, usage: vk::ImageUsageFlags) -> Result<()> {
        self.recorder.check_device(&image.inner.gpu, "image", image.name())?;
        image.check_usage(usage)
    }

    /// Writes a resource to its place in a set that is not in use yet, and notes the use.
    pub(super) fn write_descriptor(
        &mut self,
        set: vk::DescriptorSet,
        slot: &Slot<'_>,
        resource: BoundResource<'_>,
    ) -> Result<()> {
        let descriptor = vk::WriteDescriptorSet::default()
            .dst_set(set)
            .dst_binding(slot.binding)
            .descriptor_type(descriptor_type(slot.kind));
        let inner = Arc::clone(&self.recorder.gpu.inner);
        match (slot.kind, resource) {
            (BindingKind::StorageBuffer | BindingKind::UniformBuffer, BoundResource::Buffer(view)) => {
                let uniform = slot.kind == BindingKind::UniformBuffer;
                if view.bytes == 0 {
                    let message = format!("binding {} was given nothing of {:?}", slot.name, view.buffer.name());
                    return Err(Error::Shader {
                        name: slot.shader.into(),
                        message,
                    });
                }
                view.check(if uniform {
                    inner.caps.uniform_buffer_alignment
                } else {
                    inner.caps.storage_buffer_alignment
                })?;
                if uniform && view.bytes > inner.caps.max_uniform_buffer_range {
                    return Err(Error::LimitExceeded {
                        name: view.buffer.name().into(),
                        value: view.bytes,
                        limit_name: "maxUniformBufferRange",
                        limit: inner.caps.max_uniform_buffer_range,
                    });
                }
                view.check_usage(if uniform {
                    vk::BufferUsageFlags::UNIFORM_BUFFER
                } else {
                    vk::BufferUsageFlags::STORAGE_BUFFER
                })?;
                self.recorder.touch(self.name, view.buffer, slot.access)?;
                if !inner.caps.robust_buffer_access && view.bytes < slot.fixed_bytes {
                    return Err(Error::LimitExceeded {
                        name: view.buffer.name().into(),
                        value: slot.fixed_bytes,
                        limit_name: "size of the range, which nothing guards without robustBufferAccess",
                        limit: view.bytes,
                    });
                }
                let raw = [vk::DescriptorBufferInfo {
                    buffer: view.buffer.raw(),
                    offset: view.raw_offset(),
                    range: view.bytes,
                }];
                // SAFETY: set and buffer are alive, and the set is not in use yet.
                unsafe {
                    inner
                        .device
                        .update_descriptor_sets(&[descriptor.buffer_info(&raw)], &[])
                };
            }
            (BindingKind::TexelBuffer, BoundResource::Texels(view)) => {
                self.recorder.keep(&view.inner);
                self.recorder.touch(self.name, view.buffer(), slot.access)?;
                let raw = [view.raw()];
                // SAFETY: as above.
                unsafe {
                    inner
                        .device
                        .update_descriptor_sets(&[descriptor.texel_buffer_view(&raw)], &[])
                };
            }
            (BindingKind::StorageImage, BoundResource::StorageImage(image)) => {
                self.check_image(image, vk::ImageUsageFlags::STORAGE)?;
                slot.check_view(image)?;
                self.recorder.keep(&image.inner);
                let raw = [vk::DescriptorImageInfo::default()
                    .image_view(image.view())
                    .image_layout(vk::ImageLayout::GENERAL)];
                // SAFETY: as above.
                unsafe { inner.device.update_descriptor_sets(&[descriptor.image_info(&raw)], &[]) };
            }
            (BindingKind::SampledImage, BoundResource::Sampled(view)) => {
                self.check_image(view.image, vk::ImageUsageFlags::SAMPLED)?;
                slot.check_view(view.image)?;
                self.recorder
                    .check_device(&view.sampler.inner.gpu, "sampler", slot.name)?;
                self.recorder.keep(&view.image.inner);
                self.recorder.keep(&view.sampler.inner);
                let raw = [vk::DescriptorImageInfo::default()
                    .image_view(view.image.view())
                    .sampler(view.sampler.inner.raw)
                    .image_layout(vk::ImageLayout::SHADER_READ_ONLY_OPTIMAL)];
                // SAFETY: as above.
                unsafe { inner.device.update_descriptor_sets(&[descriptor.image_info(&raw)], &[]) };
            }
            (BindingKind::AccelerationStructure, BoundResource::Structure(structure)) => {
                let name = slot.name;
                self.recorder
                    .check_device(&structure.inner.gpu, "acceleration structure", name)?;
                self.recorder.keep(&structure.inner);
                let raw = [structure.raw()];
                let mut structures =
                    vk::WriteDescriptorSetAccelerationStructureKHR::default().acceleration_structures(&raw);
                let descriptor = descriptor.descriptor_count(1).push_next(&mut structures);
                // SAFETY: as above.
                unsafe { inner.device.update_descriptor_sets(&[descriptor], &[]) };
            }
            _ => {
                let message = format!("binding {} is not a {:?}", slot.name, slot.kind);
                return Err(Error::Shader {
                    name: slot.shader.into(),
                    message,
                });
            }
        }
        Ok(())
    }
}
