//! Clerestory: a Vulkan-native rendering engine that says how long every picture took and how wrong it is.

pub mod accel;
pub mod error;
pub mod film;
pub mod gpu;
pub mod scene;
pub mod transport;

pub use error::{Error, Result};
