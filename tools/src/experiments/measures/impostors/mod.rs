//! Maps with distances: searches along rays in them, and the light of their texels at other places.

pub mod gather_places;
pub mod gather_table;
pub mod gather_terms;
pub mod impostor_methods;
pub mod impostor_roots;
