//! Whole pictures: whether they are what was asked for, how their lights are chosen, what many lamps cost, what they cost and where, how they stop, their sums and files, and agreement with
//! each other, with Mitsuba 3, with LuxCore and with Cycles.

pub mod adaptive_choice;
pub mod automatic_choice;
pub mod bdpt_peers;
pub mod cycles;
pub mod fog_peers;
pub mod light_choice;
pub mod many_lamps;
pub mod metal_agreement;
pub mod mitsuba;
pub mod path_sets;
pub mod path_stages;
mod peers;
pub mod picture_formats;
pub mod sample_sums;
pub mod scene_profile;
pub mod stops;
mod sums;
pub mod technique_choice;
mod unseen_features;
pub mod walk_agreement;
