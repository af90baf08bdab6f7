//! How many photon kernels a leaf of a map should hold, found from the kernels themselves.
//!
//! Source: B. Fabianowski, "Interactive Manycore Photon Mapping", PhD thesis, Trinity College Dublin, 2011, §6.1.3. A point of a surface lies in as many
//! kernels as their areas cover the scene's; leaves of a fixed share of that number cost about the least. The constant of
//! proportionality is printed there as 8; the leaf sizes and counts of its own table need 1/16 to 1/8, and of these two 1/16 takes fewer nodes and
//! kernels in every tree of the experiment `leaf-sizes`.

use crate::catalogue::{Role, Row, sources};

/// Share of a point's kernels that a leaf holds.
pub const LEAF_SHARE: f64 = 1.0 / 16.0;

/// Least leaf size.
pub const LEAST_LEAF_SIZE: u32 = 5;

/// max(5, `share` · Σ kernel area / scene area), rounded; areas in m². Areas that are not finite, or no area at all, give 5.
pub fn automatic_leaf_size(kernel_areas: impl IntoIterator<Item = f64>, scene_area: f64, share: f64) -> u32 {
    let kernels: f64 = kernel_areas.into_iter().sum();
    let wanted = (share * kernels / scene_area).round();
    if wanted.is_finite() {
        (wanted as u32).max(LEAST_LEAF_SIZE)
    } else {
        LEAST_LEAF_SIZE
    }
}

/// Rows of the catalogue.
pub(crate) const ROWS: &[Row] = &[Row {
    id: "PM-MAP-6",
    name: "automatic leaf size of photon maps",
    role: Role::PartOf("PM-SYS-1"),
    limits: "One size for the whole map, from a mean over the scene's surfaces.",
    sources: &[sources::FABIANOWSKI_2011.at("§6.1.3")],
    tests: &["engine/src/accel/photon_map/leaf_threshold.rs::leaf_sizes_follow_the_cover_of_the_scene"],
    api: &["clerestory::accel::photon_map::leaf_threshold::automatic_leaf_size"],
    ..Row::of(file!())
}];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn leaf_sizes_follow_the_cover_of_the_scene() {
        let kernels = |count: usize, radius: f64| vec![std::f64::consts::PI * radius * radius; count];
        // 2 · 10⁵ kernels of 0.2 m in a room of 144 m²: a point lies in 175 of them.
        assert_eq!(automatic_leaf_size(kernels(200_000, 0.2), 144.0, LEAF_SHARE), 11);
        assert_eq!(automatic_leaf_size(kernels(400_000, 0.2), 144.0, LEAF_SHARE), 22);
        // The source's Scene 6 with 2¹⁷ photons: 337.6 kernels about a point, and leaves of 21.
        assert_eq!(automatic_leaf_size([337.6], 1.0, LEAF_SHARE), 21);
        assert_eq!(
            automatic_leaf_size(kernels(1000, 0.2), 144.0, LEAF_SHARE),
            LEAST_LEAF_SIZE
        );
        assert_eq!(automatic_leaf_size(kernels(0, 0.2), 144.0, LEAF_SHARE), LEAST_LEAF_SIZE);
        for scene in [0.0, f64::NAN, f64::INFINITY] {
            assert_eq!(
                automatic_leaf_size(kernels(1000, 0.2), scene, LEAF_SHARE),
                LEAST_LEAF_SIZE
            );
        }
        assert_eq!(automatic_leaf_size([f64::NAN], 1.0, LEAF_SHARE), LEAST_LEAF_SIZE);
        // The printed constant would ask for 700.
        assert_eq!(automatic_leaf_size(kernels(100_000, 0.2), 144.0, 8.0), 698);
    }
}
