//! Directional maps: how even they are, how well they hold a light field, which one to take, and look-ups in them.

mod choice;
mod choice_plot;
mod environment_look_ups;
mod environments;
mod fastest_ways;
mod filled_maps;
mod filled_quality;
mod glossy_look_ups;
mod heat;
mod light_fields;
mod lobe_errors;
pub mod map_borders;
pub mod map_choice;
pub mod map_density;
pub mod map_error;
pub mod map_glossiness;
pub mod map_levels;
pub mod map_rendering;
mod meridians;
mod needs;
mod seam_levels;
mod seams;
pub(super) mod sphere;
mod stated_densities;
