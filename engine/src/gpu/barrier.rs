//! Barriers in the vocabulary of synchronization2, with short names for the common ones.

use ash::vk;
use ash::vk::{AccessFlags2 as Kinds, PipelineStageFlags2 as Stages};

use super::buffer::Buffer;
use super::caps::Caps;
use super::image::Image;

/// A set of uses of a resource: pipeline stages together with access kinds.
///
/// Storage, sampled and texel-buffer reads of a stage are one use (`COMPUTE_READ` …); uniform buffers are another
/// (`COMPUTE_UNIFORM_READ` …), since Vulkan reads them by another path. Uses whose stage the device or its queue lacks are left out of
/// barriers, so the unions over all stages can be used everywhere.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Access(u32);

macro_rules! uses {
    ($($(#[$doc:meta])+ $name:ident = $bit:literal, $stage:expr, $kind:expr;)*) => {
        impl Access {
            $($(#[$doc])+ pub const $name: Self = Self(1 << $bit);)*
        }

        /// Stage and access kinds of every single use.
        const TABLE: &[(u32, vk::PipelineStageFlags2, vk::AccessFlags2)] = &[$((1 << $bit, $stage, $kind),)*];
    };
}

uses! {
    /// Storage, sampled and texel-buffer reads in compute shaders.
    COMPUTE_READ = 0, Stages::COMPUTE_SHADER, Kinds::SHADER_READ;
    /// Storage writes in compute shaders.
    COMPUTE_WRITE = 1, Stages::COMPUTE_SHADER, Kinds::SHADER_WRITE;
    /// Uniform buffers in compute shaders.
    COMPUTE_UNIFORM_READ = 2, Stages::COMPUTE_SHADER, Kinds::UNIFORM_READ;
    /// Reads by copies.
    TRANSFER_READ = 3, Stages::ALL_TRANSFER, Kinds::TRANSFER_READ;
    /// Writes by copies, fills and updates.
    TRANSFER_WRITE = 4, Stages::ALL_TRANSFER, Kinds::TRANSFER_WRITE;
    /// Arguments of indirect dispatches and draws.
    INDIRECT_READ = 5, Stages::DRAW_INDIRECT, Kinds::INDIRECT_COMMAND_READ;
    /// Reads by the host, after the submission was waited for.
    HOST_READ = 6, Stages::HOST, Kinds::HOST_READ;
    /// Writes by the host. Only those that come while the device waits for the host want a barrier: a submission sees all earlier ones.
    HOST_WRITE = 7, Stages::HOST, Kinds::HOST_WRITE;
    /// Storage, sampled and texel-buffer reads in vertex shaders.
    VERTEX_READ = 8, Stages::VERTEX_SHADER, Kinds::SHADER_READ;
    /// Storage writes in vertex shaders.
    VERTEX_WRITE = 9, Stages::VERTEX_SHADER, Kinds::SHADER_WRITE;
    /// Uniform buffers in vertex shaders.
    VERTEX_UNIFORM_READ = 10, Stages::VERTEX_SHADER, Kinds::UNIFORM_READ;
    /// Storage, sampled and texel-buffer reads in geometry shaders.
    GEOMETRY_READ = 11, Stages::GEOMETRY_SHADER, Kinds::SHADER_READ;
    /// Storage writes in geometry shaders.
    GEOMETRY_WRITE = 12, Stages::GEOMETRY_SHADER, Kinds::SHADER_WRITE;
    /// Uniform buffers in geometry shaders.
    GEOMETRY_UNIFORM_READ = 13, Stages::GEOMETRY_SHADER, Kinds::UNIFORM_READ;
    /// Storage, sampled and texel-buffer reads in fragment shaders.
    FRAGMENT_READ = 14, Stages::FRAGMENT_SHADER, Kinds::SHADER_READ;
    /// Storage writes in fragment shaders.
    FRAGMENT_WRITE = 15, Stages::FRAGMENT_SHADER, Kinds::SHADER_WRITE;
    /// Uniform buffers in fragment shaders.
    FRAGMENT_UNIFORM_READ = 16, Stages::FRAGMENT_SHADER, Kinds::UNIFORM_READ;
    /// Vertex attributes fetched by fixed function.
    VERTEX_ATTRIBUTE_READ = 17, Stages::VERTEX_ATTRIBUTE_INPUT, Kinds::VERTEX_ATTRIBUTE_READ;
    /// Vertex indices of indexed draws.
    VERTEX_INDEX_READ = 18, Stages::INDEX_INPUT, Kinds::INDEX_READ;
    /// Reads of colour attachments: by loading or blending.
    COLOR_READ = 19, Stages::COLOR_ATTACHMENT_OUTPUT, Kinds::COLOR_ATTACHMENT_READ;
    /// Writes of colour attachments, with the reads that go with them.
    COLOR_WRITE = 20, Stages::COLOR_ATTACHMENT_OUTPUT, COLOR_KINDS;
    /// Reads of depth attachments: by loading or testing.
    DEPTH_READ = 21, DEPTH_STAGES, Kinds::DEPTH_STENCIL_ATTACHMENT_READ;
    /// Writes of depth attachments, with the reads that go with them.
    DEPTH_WRITE = 22, DEPTH_STAGES, DEPTH_KINDS;
}

const COLOR_KINDS: Kinds =
    Kinds::from_raw(Kinds::COLOR_ATTACHMENT_READ.as_raw() | Kinds::COLOR_ATTACHMENT_WRITE.as_raw());
const DEPTH_STAGES: Stages =
    Stages::from_raw(Stages::EARLY_FRAGMENT_TESTS.as_raw() | Stages::LATE_FRAGMENT_TESTS.as_raw());
const DEPTH_KINDS: Kinds =
    Kinds::from_raw(Kinds::DEPTH_STENCIL_ATTACHMENT_READ.as_raw() | Kinds::DEPTH_STENCIL_ATTACHMENT_WRITE.as_raw());

/// Stages that only a queue with graphics has.
const GRAPHICS_STAGES: Stages = Stages::from_raw(
    Stages::VERTEX_SHADER.as_raw()
        | Stages::GEOMETRY_SHADER.as_raw()
        | Stages::FRAGMENT_SHADER.as_raw()
        | Stages::VERTEX_ATTRIBUTE_INPUT.as_raw()
        | Stages::INDEX_INPUT.as_raw()
        | Stages::COLOR_ATTACHMENT_OUTPUT.as_raw()
        | DEPTH_STAGES.as_raw(),
);

impl Access {
    /// Nothing.
    pub const NONE: Self = Self(0);
    /// Storage, sampled and texel-buffer reads, and storage writes, in compute shaders.
    pub const COMPUTE: Self = Self(Self::COMPUTE_READ.0 | Self::COMPUTE_WRITE.0);
    /// Reads and writes by copies.
    pub const TRANSFER: Self = Self(Self::TRANSFER_READ.0 | Self::TRANSFER_WRITE.0);
    /// Uniform buffers in shaders of any stage.
    pub const UNIFORM_READ: Self = Self(
        Self::COMPUTE_UNIFORM_READ.0
            | Self::VERTEX_UNIFORM_READ.0
            | Self::GEOMETRY_UNIFORM_READ.0
            | Self::FRAGMENT_UNIFORM_READ.0,
    );
    /// Storage, sampled and texel-buffer reads in shaders of any stage.
    pub const SHADER_READ: Self =
        Self(Self::COMPUTE_READ.0 | Self::VERTEX_READ.0 | Self::GEOMETRY_READ.0 | Self::FRAGMENT_READ.0);

    /// All uses of either.
    pub const fn union(self, other: Self) -> Self {
        Self(self.0 | other.0)
    }

    /// True when every use in `other` is in `self`.
    pub const fn contains(self, other: Self) -> bool {
        self.0 & other.0 == other.0
    }

    pub(super) const fn is_empty(self) -> bool {
        self.0 == 0
    }

    /// The uses that write.
    pub(super) fn writes(self) -> Self {
        let writing = Kinds::SHADER_WRITE
            | Kinds::TRANSFER_WRITE
            | Kinds::HOST_WRITE
            | Kinds::COLOR_ATTACHMENT_WRITE
            | Kinds::DEPTH_STENCIL_ATTACHMENT_WRITE;
        self.only(|_, kinds| kinds.intersects(writing))
    }

    /// The uses that a device has stages for.
    pub(super) fn on(self, caps: &Caps) -> Self {
        self.only(|stages, _| {
            (caps.graphics || !GRAPHICS_STAGES.contains(stages))
                && (caps.geometry_shader || !stages.contains(Stages::GEOMETRY_SHADER))
        })
    }

    /// `self` without the uses whose stage `other` covers.
    pub(super) fn without_stages_of(self, other: Self) -> Self {
        let covered = other.stages();
        self.only(|stages, _| !covered.contains(stages))
    }

    fn only(self, keep: impl Fn(Stages, Kinds) -> bool) -> Self {
        self.rows()
            .filter(|(_, stages, kinds)| keep(*stages, *kinds))
            .fold(Self::NONE, |all, (bit, ..)| Self(all.0 | bit))
    }

    fn rows(self) -> impl Iterator<Item = &'static (u32, Stages, Kinds)> {
        TABLE.iter().filter(move |(bit, ..)| self.0 & bit != 0)
    }

    /// Pipeline stages.
    pub fn stages(self) -> vk::PipelineStageFlags2 {
        self.rows().fold(Stages::NONE, |all, (_, stages, _)| all | *stages)
    }

    /// Access kinds.
    pub fn kinds(self) -> vk::AccessFlags2 {
        self.rows().fold(Kinds::NONE, |all, (.., kinds)| all | *kinds)
    }
}

impl std::ops::BitOr for Access {
    type Output = Self;

    fn bitor(self, other: Self) -> Self {
        self.union(other)
    }
}

/// Makes the writes among `from` visible to `to`, and keeps `to` from starting before `from` has ended, for one buffer.
#[derive(Debug, Clone, Copy)]
pub struct BufferBarrier<'a> {
    /// The buffer.
    pub buffer: &'a Buffer,
    /// Uses before.
    pub from: Access,
    /// Uses after.
    pub to: Access,
}

/// A barrier and layout transition of all of an image.
#[derive(Debug, Clone, Copy)]
pub struct ImageBarrier<'a> {
    /// The image.
    pub image: &'a Image,
    /// Uses before.
    pub from: Access,
    /// Uses after.
    pub to: Access,
    /// Layout before; `UNDEFINED` discards the contents.
    pub old_layout: vk::ImageLayout,
    /// Layout after.
    pub new_layout: vk::ImageLayout,
}

/// Compute reads and writes, then compute reads and writes.
pub fn rw_compute_to_compute(buffer: &Buffer) -> BufferBarrier<'_> {
    BufferBarrier {
        buffer,
        from: Access::COMPUTE,
        to: Access::COMPUTE,
    }
}

/// A copy, fill or update, then compute reads and writes.
pub fn transfer_to_compute(buffer: &Buffer) -> BufferBarrier<'_> {
    BufferBarrier {
        buffer,
        from: Access::TRANSFER,
        to: Access::COMPUTE,
    }
}

/// Compute reads and writes, then a copy, fill or update.
pub fn compute_to_transfer(buffer: &Buffer) -> BufferBarrier<'_> {
    BufferBarrier {
        buffer,
        from: Access::COMPUTE,
        to: Access::TRANSFER,
    }
}

/// Compute writes, then indirect arguments and compute.
pub fn compute_to_indirect(buffer: &Buffer) -> BufferBarrier<'_> {
    BufferBarrier {
        buffer,
        from: Access::COMPUTE,
        to: Access::INDIRECT_READ | Access::COMPUTE,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_use_has_a_bit_a_stage_and_a_kind_of_its_own() {
        for (index, row) in TABLE.iter().enumerate() {
            assert_eq!(row.0, 1 << index, "bits are in order and none is used twice");
            assert!(!row.1.is_empty() && !row.2.is_empty());
            assert!(TABLE[..index].iter().all(|other| (other.1, other.2) != (row.1, row.2)));
        }
    }

    #[test]
    fn writes_are_told_from_reads() {
        let all = Access((1 << TABLE.len()) - 1);
        let writes = Access::COMPUTE_WRITE
            | Access::TRANSFER_WRITE
            | Access::HOST_WRITE
            | Access::VERTEX_WRITE
            | Access::GEOMETRY_WRITE
            | Access::FRAGMENT_WRITE
            | Access::COLOR_WRITE
            | Access::DEPTH_WRITE;
        assert_eq!(all.writes(), writes);
        assert_eq!(Access::UNIFORM_READ.kinds(), Kinds::UNIFORM_READ);
        assert_eq!(Access::SHADER_READ.kinds(), Kinds::SHADER_READ);
        // A barrier for storage reads does not hold for uniform reads.
        assert!(!Access::COMPUTE.contains(Access::COMPUTE_UNIFORM_READ));
        // What waits for a stage waits for all its uses.
        assert_eq!(
            (Access::COMPUTE_UNIFORM_READ | Access::TRANSFER_READ).without_stages_of(Access::COMPUTE_WRITE),
            Access::TRANSFER_READ
        );
    }
}
