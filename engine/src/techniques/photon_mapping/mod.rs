//! Photon mapping: density estimation over the places where photons from the lights land.

pub mod kernel;

pub(super) mod card;
mod device_map;
mod gather;
mod map;
mod mapper;
mod queue;
mod settings;
mod tracer;

pub use gather::GatherCounts;
pub use map::{MapContents, map_contents};
pub use mapper::{MappedPhoton, MapperCounts, PhotonMapper};
pub use settings::{MapBuild, MapQuery, MapQueue, PhotonSettings};
pub use tracer::PhotonCounts;
