//! Photon mapping: density estimation over the places where photons from the lights land.

pub mod kernel;
