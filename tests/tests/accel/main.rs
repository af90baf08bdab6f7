//! Indexes for rays: built, refitted, walked, and chosen.

mod bounded_steps;
mod driver_index;
mod index_choice;
mod instances;
mod kd;
mod lbvh;
mod persistent_threads;
mod ray_index;
mod seams;
mod two_level;
mod wide;
