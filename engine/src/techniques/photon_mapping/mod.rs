//! Photon mapping: density estimation over the places where photons from the lights land.

pub mod kernel;

mod gather;
mod map;
mod mapper;
mod settings;
mod tracer;

pub use mapper::PhotonMapper;
pub use settings::PhotonSettings;
