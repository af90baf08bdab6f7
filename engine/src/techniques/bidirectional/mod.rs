//! Bidirectional path tracing: paths made from both of their ends, in every way, weighted against each other.

mod card;
mod connect;
mod eye;
mod kernels;
mod light_paths;
pub mod mis;
mod renderer;
#[cfg(test)]
mod rod;
mod settings;
mod splats;

pub(super) use card::CARD;
pub use renderer::{BidirectionalCounts, BidirectionalPaths};
pub use settings::{BidirectionalSettings, Strategies};
