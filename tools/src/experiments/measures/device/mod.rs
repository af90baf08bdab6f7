//! The device: what its operations and the building blocks over its buffers cost, and whether its barriers are right and few.

pub mod barriers;
mod blocks;
pub mod device_model;
mod hazards;
pub mod parallel_blocks;
