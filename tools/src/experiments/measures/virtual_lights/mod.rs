//! Virtual lights: on the host, in the unit box, their walks, their potential, their spikes, and orders in which points take them; on the device those that are kept from frame to frame,
//! light that is, what tells whether they are seen, and what discs of reflective shadow maps have of their light.

mod deferred_pictures;
pub mod deferred_stages;
pub mod rsm_discs;
mod unit_box;
pub mod vpl_history;
pub mod vpl_incremental;
pub mod vpl_order;
mod vpl_order_shown;
pub mod vpl_potential;
mod vpl_receiver;
mod vpl_shares;
pub mod vpl_sight;
pub mod vpl_spikes;
pub mod vpl_walks;
