//! The raster preview: its pictures, shadows of point lights, and light of maps that are drawn live.

pub mod live_maps;
pub mod preview_picture;
pub mod shadow_maps;
