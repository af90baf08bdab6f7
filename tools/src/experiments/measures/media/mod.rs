//! Participating media: absorption, free flight and phase functions.

pub mod absorption;
pub mod free_flight;
mod methods;
pub mod phase_functions;
mod profiles;
