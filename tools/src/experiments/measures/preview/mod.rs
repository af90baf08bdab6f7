//! The raster preview: shadows of point lights, light of maps that are drawn live, and light of few pixels at many.

pub mod imperfect_maps;
pub mod live_map_pictures;
pub mod live_maps;
mod live_stages;
pub mod planar_mirrors;
pub mod previewed;
pub mod reflection_maps;
mod reflection_stages;
pub mod shadow_maps;
mod shadow_places;
pub mod upsampling;
pub mod view_shadows;
pub mod vpl_warp;
