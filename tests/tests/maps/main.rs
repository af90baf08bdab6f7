//! Maps of directions, with distance and as lights.

mod directional_maps;
mod gathers;
mod impostor_texels;
mod impostors;
mod proxies;
