//! The device: what its operations cost, and whether its barriers are right and few.

pub mod barriers;
pub mod device_model;
mod hazards;
