//! Linear bounding volume hierarchy: the tree that sorted Morton codes spell, built in linear time, over triangles or any other boxes.
//!
//! Sources: C. Lauterbach et al., "Fast BVH Construction on GPUs", Eurographics 2009, for the idea; [`radix_tree`] names that of the form
//! built here and on the device. Other forms, which photon maps use, are in [`photon_map`](super::photon_map).
//!
//! Guarantees: the same tree whatever the number of threads; every box the exact union of what it holds; any set of finite boxes gives a
//! tree, equal codes and equal boxes included.

mod codes;
mod device;
mod device_buffers;
pub mod radix_tree;
mod ray_index;
mod sort;

pub use codes::SortedCodes;
pub(in crate::accel) use device::stages_of;
pub use device::{LbvhBuild, LbvhBuilder, ResidentLbvh};
pub use device_buffers::LbvhBuffers;
pub use ray_index::{BuildQuality, LbvhSettings, build, hierarchy_of, refit};
pub(in crate::accel) use ray_index::{check_moved, moved_corners};

use crate::catalogue::{Role, Row, sources};

/// Rows of the catalogue.
pub(crate) const ROWS: &[Row] = &[Row {
    id: "CL-LBVH",
    name: "LBVH (linear BVH) as ray index: built on the host or on the device, and refitted",
    role: Role::Kernel,
    limits: "Unless it is optimised, rays visit more nodes than in trees built by surface area; refitting keeps the tree's shape, however things move.",
    sources: &[sources::APETREI_2014.whole(), sources::KARRAS_2012.whole()],
    shaders: &[
        "shaders/accel/lbvh_grid.comp",
        "shaders/accel/lbvh_codes.comp",
        "shaders/accel/lbvh_hierarchy.comp",
        "shaders/accel/lbvh_climb.comp",
        "shaders/accel/lbvh_boxes.comp",
        "shaders/accel/lbvh_emit.comp",
        "shaders/accel/lbvh_retry.comp",
        "shaders/accel/lbvh_refit.comp",
        "shaders/accel/lbvh_refit_triangles.comp",
    ],
    tests: &[
        "engine/src/accel/lbvh/tests.rs::trees_are_valid_on_hard_boxes",
        "engine/src/accel/morton.rs::cells_fill_the_grid_and_keep_order",
        "engine/src/accel/lbvh/tests.rs::the_order_of_climbing_never_shows",
        "engine/src/accel/lbvh/tests.rs::hits_are_those_of_the_binned_tree",
        "engine/src/accel/lbvh/tests.rs::refitted_trees_have_the_hits_of_new_ones",
        "tests/tests/accel/lbvh.rs::device_builds_are_the_twins_on_soups",
        "tests/tests/accel/lbvh.rs::device_builds_are_the_twins_on_hard_cases",
        "tests/tests/accel/lbvh.rs::trees_that_are_too_deep_are_made_again_as_the_hosts",
        "tests/tests/accel/lbvh.rs::device_refits_are_the_twins",
    ],
    experiment: "clerestory index --peers",
    api: &[
        "clerestory::accel::lbvh::build",
        "clerestory::accel::lbvh::refit",
        "clerestory::accel::lbvh::LbvhBuilder",
    ],
    settings: &[
        "clerestory::accel::lbvh::LbvhSettings",
        "clerestory render --index lbvh",
        "clerestory render --index lbvh-device",
    ],
    ..Row::of(file!())
}];

#[cfg(test)]
mod tests;

#[cfg(test)]
pub(crate) use tests::{hard_boxes, valid};
