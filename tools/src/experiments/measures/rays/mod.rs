//! Rays: tests against primitives, origins, trees and models of execution.

pub mod build_stages;
pub mod camera_footprints;
pub mod persistent_threads;
pub mod ray_engine;
pub mod ray_offsets;
mod sphere_forms;
pub mod sphere_tests;
pub mod tree_quality;
mod triangle_forms;
pub mod triangle_tests;
