//! What light does: reflectance, Fresnel, samplers, path sets, the reference path tracer.

pub mod albedo;
pub mod bsdf;
pub mod fresnel;
pub mod ggx;
pub mod random;
pub mod warp;

#[cfg(test)]
mod testing;
