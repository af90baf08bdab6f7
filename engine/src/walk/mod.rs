//! Floor 5: light's walks through a scene on the device, ray by ray, in waves: eye paths, photons, and whatever a host or a technique begins.
//!
//! A [`Walker`] follows a wave of walks to their ends. Its owner says by [`WalkStages`] where walks start, what happens where their rays arrive
//! and what is done with what waits by place: shadow rays, for which the walker has a stage of its own, or deposits. The rest is the walker's: closest
//! hits with alpha and media, compaction of the queues, rays that a quota stopped, and submissions, each a bounded piece of work whatever the scene:
//! [`Walker::advance`] makes one, [`Walker::run`] all of a wave. A wave may also be kept full, new walks taking the slots of those that have ended ([`Turnover`]).
//!
//! Wavefront form after Laine, Karras and Aila, "Megakernels Considered Harmful" (HPG 2013). Kernels include `walk/wave.glsl`, `walk/hand_on.glsl` and `walk/draws.glsl`;
//! the working memory is descriptor set 0, [`WaveSet`]. `tests/tests/embedding/walk.rs` is a technique of a host's own.
//!
//! Guarantees: queues keep their order, so that memory is the same bits on every run, whatever the number of threads, the size of waves and the
//! length of submissions; counts are exact; rays that a quota stopped go on where they were, none is lost. How many submissions a wave takes may differ from run
//! to run where one of them has used up its work, since it is a race which places it had begun by then.

mod arrival;
mod compaction;
mod connection_pace;
mod in_flight;
mod stages;
mod stall;
mod trace;
mod turnover;
mod walker;
mod wave;

pub use arrival::{ArrivalStage, Places, StoppedPlaces};
pub(crate) use connection_pace::{ConnectionPace, SOFTWARE_CONNECTIONS};
pub use in_flight::{Fetches, Walked, WaveInFlight};
pub use stages::{Refill, WalkStages};
pub use trace::{RAY_QUOTA, ray_quota};
pub(crate) use trace::{grid_walk_iterations, work_least};
pub use turnover::Turnover;
pub use walker::{Bounce, WalkOptions, Walker};
pub use wave::{MediumCounts, SLOTS_MAX, WaveBuffers, WaveNeeds, default_slots, slots_of_device, stage_barrier};

pub use crate::gpu::shaders::sets::WaveSet;
pub use crate::gpu::shaders::types::WalkKey;
