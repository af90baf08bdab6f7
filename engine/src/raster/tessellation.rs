//! Triangles divided into level² equal ones, by numbers alone, for maps whose edges are bent. Twin of `raster/tessellation.glsl`.

use glam::Vec3;

use crate::catalogue::{Bias, Role, Row, sources};

/// The most pieces along an edge.
pub const MAX_LEVEL: u32 = 64;

/// Weights of the whole triangle's corners at a corner of a piece, as whole numbers over the level. Pieces stand in rows from corner 0 on, and
/// neighbours alternate.
pub fn tessellation_weights(level: u32, piece: u32, corner: u32) -> [u32; 3] {
    let row = piece.isqrt();
    let along = piece - row * row;
    let column = along / 2;
    let (down, right) = if along.is_multiple_of(2) {
        (row + corner.min(1), column + u32::from(corner == 2))
    } else {
        (row + u32::from(corner == 1), column + corner.min(1))
    };
    [level - down, down - right, right]
}

/// The same bits along an edge in both triangles that share it, in whichever order they have its ends.
pub fn tessellation_point(weights: [u32; 3], level: u32, [a, b, c]: [Vec3; 3]) -> Vec3 {
    let [x, y, z] = weights.map(|weight| weight as f32);
    (x * a + y * b + z * c) / level as f32
}

/// Rows of the catalogue.
pub(crate) const ROWS: &[Row] = &[Row {
    id: "OEM-4e",
    name: "octahedron maps rendered live: unsplit pieces of triangles",
    role: Role::Kernel,
    limits: "Edges stay straight along a piece, and what lies over a seam is left out: right only as pieces shrink.",
    sources: &[sources::ENGELHARDT_2013.at("7.2.1 and 7.3.2")],
    shaders: &["shaders/raster/surface_unsplit.vert"],
    bias: Some(Bias::Consistent("straight edges, and gaps at seams, as long as pieces")),
    tests: &[
        "tests/tests/raster/cuts.rs::unsplit_maps_come_nearer_with_smaller_pieces",
        "engine/src/raster/tessellation.rs::pieces_fill_the_triangle_and_share_their_edges",
        "tests/tests/twins/raster.rs::pieces_of_triangles_agree_with_their_twins",
    ],
    api: &[
        "clerestory::raster::OctantCut",
        "clerestory::raster::GBuffer",
        "clerestory::raster::tessellation::tessellation_point",
    ],
    settings: &["clerestory::raster::Layering", "clerestory::raster::GBufferDesc"],
    ..Row::of(file!())
}];

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeMap;

    #[test]
    fn pieces_fill_the_triangle_and_share_their_edges() {
        for level in [1, 2, 3, 5, 8, MAX_LEVEL] {
            let mut edges = BTreeMap::new();
            for piece in 0..level * level {
                let corners = [0, 1, 2].map(|corner| tessellation_weights(level, piece, corner));
                assert!(
                    corners
                        .iter()
                        .all(|w| w.iter().sum::<u32>() == level && w.iter().all(|w| *w <= level))
                );
                let [a, b, c] = corners.map(|w| [i64::from(w[1]), i64::from(w[2])]);
                let double_area = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
                assert_eq!(double_area, 1, "as the whole, level² times as small");
                for i in 0..3 {
                    let mut edge = [corners[i], corners[(i + 1) % 3]];
                    edge.sort_unstable();
                    *edges.entry(edge).or_insert(0u32) += 1;
                }
            }
            let (inner, outer): (Vec<_>, Vec<_>) = edges.into_values().partition(|count| *count == 2);
            assert_eq!(outer, vec![1; 3 * level as usize]);
            assert_eq!(inner.len() as u32, 3 * level * (level - 1) / 2);
        }
    }

    #[test]
    fn shared_edges_have_the_same_points() {
        let [a, b, c, d] = [
            Vec3::new(0.1, 0.7, -0.3),
            Vec3::new(1.3, -0.2, 0.9),
            Vec3::new(-0.4, 0.33, 0.21),
            Vec3::new(5.0, -3.0, 0.77),
        ];
        for i in 0..=7 {
            let one = tessellation_point([7 - i, i, 0], 7, [a, b, c]);
            assert_eq!(one, tessellation_point([0, i, 7 - i], 7, [d, b, a]));
        }
        assert_eq!(tessellation_point([1, 0, 0], 1, [a, b, c]), a);
    }
}
