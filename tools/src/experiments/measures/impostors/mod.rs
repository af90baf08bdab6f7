//! Maps with distances: searches along rays in them, and the light of their texels at other places.

pub mod convolved_maps;
mod cut_stone;
pub mod exact_room;
pub mod gather_counts;
pub mod gather_fireballs;
pub mod gather_frame;
pub mod gather_glossy;
pub mod gather_places;
pub mod gather_table;
pub mod gather_terms;
pub mod impostor_methods;
pub mod impostor_motion;
pub mod impostor_occlusion;
pub mod impostor_roots;
pub mod impostor_trace;
mod judged_pictures;
mod lit_spheres;
mod mirrored_rooms;
pub mod moving_mirror;
mod moving_pictures;
pub mod previous_reflections;
pub mod published_lobe;
pub mod search_times;
mod shining_rooms;
pub mod virtual_images;
