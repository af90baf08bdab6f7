//! Photon mapping: density estimation over the places where photons from the lights land.

pub mod kernel;

mod card;
mod collisions;
mod device_map;
mod gather;
mod glow;
mod map;
mod mapper;
mod path_classes;
mod pilot;
mod queue;
mod settings;
mod tracer;
pub mod volume;

pub(super) use card::CARD;
pub(super) use collisions::{CollisionCounts, CollisionPass, CollisionStage};
pub use gather::{GatherCounts, RayFetches};
pub use map::{MapContents, map_contents};
pub use mapper::{MappedEvent, MappedPhoton, MapperCounts, PhotonMapper};
pub use settings::{MapBuild, MapQuery, MapQueue, MapStages, PhotonSettings};
pub use tracer::PhotonCounts;
pub(super) use tracer::{Append, PhotonPlan, PhotonTracer, Stored, Tracing};
