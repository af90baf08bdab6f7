//! The operations of scans and reductions over words; twins of `shaders/kernels/operation.glsl` and `scan.glsl`.

use crate::gpu::shaders::constants::{OPERATION_MAX, OPERATION_MIN, OPERATION_SUM};

/// An operation of scans and reductions.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Operation {
    /// The sum; of scans modulo 2³².
    #[default]
    Sum,
    /// The minimum of unsigned words.
    Min,
    /// The maximum of unsigned words.
    Max,
}

impl Operation {
    pub(super) fn code(self) -> u32 {
        match self {
            Self::Sum => OPERATION_SUM,
            Self::Min => OPERATION_MIN,
            Self::Max => OPERATION_MAX,
        }
    }

    /// What changes nothing. Twin of `scan_identity`.
    pub fn identity(self) -> u32 {
        if self == Self::Min { u32::MAX } else { 0 }
    }

    /// Twin of `scan_operation`.
    pub fn apply(self, a: u32, b: u32) -> u32 {
        match self {
            Self::Sum => a.wrapping_add(b),
            Self::Min => a.min(b),
            Self::Max => a.max(b),
        }
    }
}
