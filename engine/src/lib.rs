//! Clerestory: a Vulkan-native rendering engine that says how long every picture took and how wrong it is.
//!
//! ```no_run
//! use clerestory::gpu::{Gpu, GpuOptions};
//! use clerestory::{film, render, scene};
//!
//! # fn main() -> clerestory::Result<()> {
//! let gpu = Gpu::headless(&GpuOptions::default())?;
//! let scene = scene::load("builtin:cornell-box")?;
//! let rendered = render::render(&gpu, &scene, &render::RenderOptions::default())?;
//! film::exr::write("cornell-box.exr", &rendered.picture)?;
//! println!("{:.2} s of GPU time", rendered.report.gpu_seconds);
//! # Ok(())
//! # }
//! ```
//!
//! The modules are floors, and each uses only those below it. From below:
//!
//! 1. [`gpu`]: a thin layer over Vulkan.
//! 2. [`kernels`], sort, scan and the like; [`scene`] and [`film`].
//! 3. [`accel`], spatial indexes, and [`maps`], maps of directions; above them [`raster`], rasterization.
//! 4. [`transport`]: what light does.
//! 5. [`walk`]: its ways through a scene, ray by ray.
//! 6. [`techniques`]: what turns a scene into a picture.
//! 7. [`render`], which ties them together.
//! 8. [`plan`], which chooses among them.
//!
//! [`catalogue`] has the rows that say where each published method lives; [`settings`](mod@settings), [`error`], [`atomic`], [`fingerprint`], [`input`] and
//! [`srgb`] serve all floors.

pub mod accel;
pub mod atomic;
pub mod catalogue;
pub mod error;
pub mod film;
pub mod fingerprint;
pub mod gpu;
pub mod input;
mod kept_file;
pub mod kernels;
pub mod maps;
pub mod plan;
pub mod raster;
pub mod render;
pub mod scene;
pub mod settings;
pub mod srgb;
pub mod techniques;
pub mod transport;
pub mod walk;

#[cfg(test)]
mod test_chi_square;
#[cfg(test)]
pub mod test_random;

pub use error::{Error, Result};

/// The examples of the README, compiled as doc tests.
#[cfg(doctest)]
#[doc = include_str!("../../README.md")]
struct Readme;

/// The examples of the reference, compiled as doc tests.
#[cfg(doctest)]
#[doc = include_str!("../../docs/reference.md")]
struct Reference;
