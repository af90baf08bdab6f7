//! What the command line program and its tests share.

pub mod agreement;
pub mod cycles;
pub mod experiments;
pub mod fuzzing;
pub mod geometry;
mod json_file;
pub mod least_squares;
pub mod machine;
pub mod metal_forms;
pub mod mitsuba;
pub mod page;
mod python;
pub mod random;
pub mod timing;
