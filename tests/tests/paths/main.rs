//! The path tracer: its closed forms, its points, its sums and its settings.

mod adaptive;
mod alpha;
mod automatic_choice;
mod determinism;
mod fetches;
mod full_waves;
mod many_lights;
mod moving_lights;
mod non_finite;
mod path_sets;
mod path_tracer;
mod profile;
mod samplers;
mod scene_records;
mod spectral_metals;
