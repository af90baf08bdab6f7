//! Floor 4: what light does. Reflectance, Fresnel, samplers, path sets, the scene on the device.

pub mod albedo;
pub mod bsdf;
pub mod choice;
pub mod densest_band;
pub mod differentials;
pub mod distribution;
pub mod edge_bound;
pub mod environment;
pub mod free_flight;
pub mod fresnel;
pub mod ggx;
pub mod gpu_scene;
pub mod light_tree;
pub mod lights;
pub mod medium;
pub mod microfacets;
pub mod packing;
pub mod path_set;
pub mod phase;
pub mod phong;
pub mod photon_share;
pub mod random;
pub mod random_table;
pub mod shading_normal;
pub mod sobol;
mod surface_spec;
pub mod warp;

pub use gpu_scene::GpuScene;
pub(crate) use gpu_scene::ray_iterations;
pub use path_set::PathSet;
pub use surface_spec::surface_spec;
pub(crate) use surface_spec::{COMPENSATION, METAL_LOBES, SURFACE_FEATURES, emission_spec};

#[cfg(test)]
pub(crate) mod testing;
