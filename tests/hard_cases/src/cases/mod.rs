//! The cases, one file each.

mod axis_parallel_rays;
mod black_and_white;
mod coplanar_surfaces;
mod degenerate_triangles;
mod empty_scene;
mod extreme_power;
mod extreme_refraction;
mod extreme_roughness;
mod far_from_origin;
mod grazing_incidence;
mod light_inside_geometry;
mod lights_without_power;
mod many_lights;
mod media_albedo_one;
mod media_albedo_zero;
mod media_behind_a_wall;
mod media_extents;
mod media_grids;
mod media_holes;
mod media_inside;
mod media_narrow_phase;
mod media_thin_sheet;
mod media_uneven_bands;
mod million_samples;
mod mirrors;
mod nested_dielectrics;
mod no_light;
mod non_finite_attributes;
mod one_triangle;
mod picture_sizes;
mod rays_from_surfaces;
mod scales;
mod slivers;

use crate::HardCase;

pub(crate) const ALL: &[HardCase] = &[
    scales::CASE,
    far_from_origin::CASE,
    slivers::CASE,
    degenerate_triangles::CASE,
    coplanar_surfaces::CASE,
    axis_parallel_rays::CASE,
    rays_from_surfaces::CASE,
    nested_dielectrics::CASE,
    extreme_roughness::CASE,
    extreme_refraction::CASE,
    grazing_incidence::CASE,
    black_and_white::CASE,
    mirrors::CASE,
    light_inside_geometry::CASE,
    lights_without_power::CASE,
    many_lights::CASE,
    no_light::CASE,
    empty_scene::CASE,
    one_triangle::CASE,
    non_finite_attributes::CASE,
    extreme_power::CASE,
    million_samples::CASE,
    picture_sizes::CASE,
    media_extents::CASE,
    media_albedo_one::CASE,
    media_albedo_zero::CASE,
    media_narrow_phase::CASE,
    media_uneven_bands::CASE,
    media_grids::CASE,
    media_thin_sheet::CASE,
    media_inside::CASE,
    media_holes::CASE,
    media_behind_a_wall::CASE,
];
