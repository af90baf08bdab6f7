//! Instant radiosity: indirect light as that of virtual point lights, which walks from the lights leave on surfaces and in media.

mod append;
mod card;
mod cut_tree;
mod gather;
pub mod incremental;
pub mod many_light;
mod medium_gather;
mod medium_lights;
mod renderer;
pub mod resampling;
pub mod selection;
mod settings;

pub(super) use card::CARD;
pub use gather::VirtualLightCounts;
pub(super) use many_light::CARD as MANY_LIGHT;
pub use renderer::{PassCounts, VirtualLight, VirtualLights};
pub use settings::{Bound, Compensation, Selection, VirtualLightSettings};
