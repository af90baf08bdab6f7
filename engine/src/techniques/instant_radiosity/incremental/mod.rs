//! Directions of a lamp that are kept from frame to frame: where its virtual lights lie, which of them go, where new ones come, and what share of the lamp's power each has.
//!
//! Source: S. Laine, H. Saransaari, J. Kontkanen, J. Lehtinen, T. Aila, "Incremental Instant Radiosity for Real-Time Indirect Illumination", EGSR 2007.
//!
//! Directions are points of a domain in which equal areas have equal shares of the power ([`Lamp`]): the unit sphere for a point, the unit disc for a spot, with its falloff.
//! The share of a direction is that of its Voronoi cell ([`voronoi_cells`]), so that shares sum to one however uneven the points lie. A lamp that moves sees its virtual
//! lights in other directions: those that it no longer sees are dropped, new ones come where the largest empty circle is, and where points lie much closer to
//! each other than that circle is wide, one of them moves there ([`KeptDirections::renew`]); all of it under a quota a frame.
//!
//! # Bias
//!
//! A set of directions is turned about as a whole by its seed. On the sphere each direction is then evenly distributed, and what the directions bring in the mean over seeds is exact, for
//! a set that was just spread. On the disc, and in sets of a lamp that has moved, shares belong to where points lie, and the mean is off by what light changes over a cell: an
//! error of the order of one over the directions.
//!
//! Guarantees: deterministic; shares sum to one up to rounding; a set that is spread evenly has nothing to renew; at most the quota is new.

mod directions;
mod lamp;
mod voronoi;

pub use directions::{KeptDirections, Renewed};
pub use lamp::{Domain, Lamp};
pub use voronoi::{Cell, Gap, voronoi_cells, widest_gap};

/// Directions of a lamp at most: cells are found anew for each that is renewed.
pub const DIRECTIONS_MAX: u32 = 4096;
