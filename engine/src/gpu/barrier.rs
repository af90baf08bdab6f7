//! Barriers in the vocabulary of synchronization2, with short names for the common ones.

use ash::vk;

use super::buffer::Buffer;
use super::image::Image;

/// A set of uses of a resource: pipeline stages together with access kinds.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Access(u16);

impl Access {
    /// Nothing.
    pub const NONE: Self = Self(0);
    /// Reads in compute shaders.
    pub const COMPUTE_READ: Self = Self(1);
    /// Writes in compute shaders.
    pub const COMPUTE_WRITE: Self = Self(1 << 1);
    /// Reads by copies.
    pub const TRANSFER_READ: Self = Self(1 << 2);
    /// Writes by copies, fills and updates.
    pub const TRANSFER_WRITE: Self = Self(1 << 3);
    /// Arguments of indirect dispatches and draws.
    pub const INDIRECT_READ: Self = Self(1 << 4);
    /// Reads by the host.
    pub const HOST_READ: Self = Self(1 << 5);
    /// Reads in fragment shaders.
    pub const FRAGMENT_READ: Self = Self(1 << 6);
    /// Reads and writes of colour attachments.
    pub const COLOR_WRITE: Self = Self(1 << 7);
    /// Reads in vertex shaders.
    pub const VERTEX_READ: Self = Self(1 << 8);
    /// Reads and writes of depth attachments.
    pub const DEPTH_WRITE: Self = Self(1 << 9);
    /// Writes in fragment shaders.
    pub const FRAGMENT_WRITE: Self = Self(1 << 10);
    /// Writes in vertex shaders.
    pub const VERTEX_WRITE: Self = Self(1 << 11);
    /// Reads and writes in compute shaders.
    pub const COMPUTE: Self = Self(Self::COMPUTE_READ.0 | Self::COMPUTE_WRITE.0);

    /// Reads and writes by copies.
    pub const TRANSFER: Self = Self(Self::TRANSFER_READ.0 | Self::TRANSFER_WRITE.0);

    const WRITES: u16 = Self::COMPUTE_WRITE.0
        | Self::TRANSFER_WRITE.0
        | Self::COLOR_WRITE.0
        | Self::DEPTH_WRITE.0
        | Self::FRAGMENT_WRITE.0
        | Self::VERTEX_WRITE.0;

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
    pub(super) const fn writes(self) -> Self {
        Self(self.0 & Self::WRITES)
    }

    /// `self` without the uses whose stage `other` covers.
    pub(super) fn without_stages_of(self, other: Self) -> Self {
        let covered = TABLE
            .iter()
            .filter(|(_, stage, _)| other.stages().contains(*stage))
            .fold(0, |bits, (bit, ..)| bits | bit);
        Self(self.0 & !covered)
    }

    /// Pipeline stages.
    pub fn stages(self) -> vk::PipelineStageFlags2 {
        TABLE
            .iter()
            .filter(|(bit, ..)| self.0 & bit != 0)
            .fold(vk::PipelineStageFlags2::NONE, |all, (_, stage, _)| all | *stage)
    }

    /// Access kinds.
    pub fn kinds(self) -> vk::AccessFlags2 {
        TABLE
            .iter()
            .filter(|(bit, ..)| self.0 & bit != 0)
            .fold(vk::AccessFlags2::NONE, |all, (.., kind)| all | *kind)
    }
}

impl std::ops::BitOr for Access {
    type Output = Self;

    fn bitor(self, other: Self) -> Self {
        self.union(other)
    }
}

const COLOR_KINDS: vk::AccessFlags2 = vk::AccessFlags2::from_raw(
    vk::AccessFlags2::COLOR_ATTACHMENT_READ.as_raw() | vk::AccessFlags2::COLOR_ATTACHMENT_WRITE.as_raw(),
);
const DEPTH_STAGES: vk::PipelineStageFlags2 = vk::PipelineStageFlags2::from_raw(
    vk::PipelineStageFlags2::EARLY_FRAGMENT_TESTS.as_raw() | vk::PipelineStageFlags2::LATE_FRAGMENT_TESTS.as_raw(),
);
const DEPTH_KINDS: vk::AccessFlags2 = vk::AccessFlags2::from_raw(
    vk::AccessFlags2::DEPTH_STENCIL_ATTACHMENT_READ.as_raw()
        | vk::AccessFlags2::DEPTH_STENCIL_ATTACHMENT_WRITE.as_raw(),
);

/// Stage and access of every bit of [`Access`].
const TABLE: [(u16, vk::PipelineStageFlags2, vk::AccessFlags2); 12] = [
    (
        Access::COMPUTE_READ.0,
        vk::PipelineStageFlags2::COMPUTE_SHADER,
        vk::AccessFlags2::SHADER_READ,
    ),
    (
        Access::COMPUTE_WRITE.0,
        vk::PipelineStageFlags2::COMPUTE_SHADER,
        vk::AccessFlags2::SHADER_WRITE,
    ),
    (
        Access::TRANSFER_READ.0,
        vk::PipelineStageFlags2::ALL_TRANSFER,
        vk::AccessFlags2::TRANSFER_READ,
    ),
    (
        Access::TRANSFER_WRITE.0,
        vk::PipelineStageFlags2::ALL_TRANSFER,
        vk::AccessFlags2::TRANSFER_WRITE,
    ),
    (
        Access::INDIRECT_READ.0,
        vk::PipelineStageFlags2::DRAW_INDIRECT,
        vk::AccessFlags2::INDIRECT_COMMAND_READ,
    ),
    (
        Access::HOST_READ.0,
        vk::PipelineStageFlags2::HOST,
        vk::AccessFlags2::HOST_READ,
    ),
    (
        Access::FRAGMENT_READ.0,
        vk::PipelineStageFlags2::FRAGMENT_SHADER,
        vk::AccessFlags2::SHADER_READ,
    ),
    (
        Access::COLOR_WRITE.0,
        vk::PipelineStageFlags2::COLOR_ATTACHMENT_OUTPUT,
        COLOR_KINDS,
    ),
    (
        Access::VERTEX_READ.0,
        vk::PipelineStageFlags2::VERTEX_SHADER,
        vk::AccessFlags2::SHADER_READ,
    ),
    (Access::DEPTH_WRITE.0, DEPTH_STAGES, DEPTH_KINDS),
    (
        Access::FRAGMENT_WRITE.0,
        vk::PipelineStageFlags2::FRAGMENT_SHADER,
        vk::AccessFlags2::SHADER_WRITE,
    ),
    (
        Access::VERTEX_WRITE.0,
        vk::PipelineStageFlags2::VERTEX_SHADER,
        vk::AccessFlags2::SHADER_WRITE,
    ),
];

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
