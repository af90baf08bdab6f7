//! What light does: reflectance, Fresnel, samplers, path sets, the reference path tracer.

pub mod albedo;
pub mod bsdf;
pub mod distribution;
pub mod environment;
pub mod fresnel;
pub mod ggx;
pub mod lights;
pub mod path_set;
pub mod phase;
pub mod phong;
pub mod random;
pub mod shading_normal;
pub mod warp;

pub use path_set::PathSet;

#[cfg(test)]
mod testing;
