//! Photon mapping on surfaces as a whole: what photons and kernels come to, and what a frame costs; kernels and queries in media; pictures are compared by sweeps.

pub mod beam_estimate;
pub mod cases;
mod frames;
mod kernel_contest;
mod kernel_statistics;
pub mod map_builds;
pub mod path_differentials;
pub mod photon_defaults;
pub mod photon_frame;
pub mod photon_peers;
pub mod photon_queues;
pub mod photon_statistics;
pub mod random_numbers;
mod scenarios;
pub mod volume_bandwidths;
pub mod volume_choice;
pub mod volume_crossover;
pub mod volume_dampening;
pub mod volume_frame;
pub mod volume_peers;
mod volume_queue_stages;
pub mod volume_queues;
pub mod volume_scenes;
pub mod volume_transmittance;
