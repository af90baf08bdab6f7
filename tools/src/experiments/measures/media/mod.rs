//! Participating media: absorption, free flight, also of all bands at once, and phase functions.

pub mod absorption;
pub mod free_flight;
mod methods;
pub mod phase_functions;
mod profiles;
pub mod volume_bands;
