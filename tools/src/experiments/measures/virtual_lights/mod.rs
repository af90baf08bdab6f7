//! Virtual lights on the host, in the unit box of the digest: their walks, their potential, and orders in which points take them.

mod unit_box;
pub mod vpl_order;
pub mod vpl_potential;
pub mod vpl_walks;
