//! Directions and points from pairs of numbers, cones and orthonormal bases.

use clerestory::transport::warp::{
    cone_pdf, cosine_hemisphere_pdf, orthonormal_basis, square_to_cone, square_to_cosine_hemisphere, square_to_disk,
    square_to_hemisphere, square_to_sphere, square_to_triangle,
};
use clerestory_tests::twin::{Case, Tolerance, trigonometric_error};
use clerestory_tests::with_gpu;

use crate::{UNIT_EDGES, cases, check, direction, join, list, ulps, unit, v2, v3};

#[test]
fn warps_cones_and_bases_agree_with_their_twins() {
    with_gpu(|gpu| {
        let trig = trigonometric_error(gpu);
        let mut table = cases(2, |r| vec![unit(r), unit(r)]);
        for (i, u) in UNIT_EDGES.iter().flat_map(|a| UNIT_EDGES.map(|b| [*a, b])).enumerate() {
            table[i] = Case::new(&u);
        }
        let near_edges = Tolerance {
            input_size: 1.0,
            ..ulps(8.0, 2.0, trig)
        };
        check(gpu, "warps", 0, &table, near_edges, 2, |x| {
            let u = v2(x, 0);
            list![
                square_to_disk(u).to_array(),
                square_to_cosine_hemisphere(u).to_array(),
                square_to_sphere(u).to_array(),
                square_to_hemisphere(u).to_array(),
                square_to_triangle(u).to_array(),
            ]
        });
        let table = cases(3, |r| {
            join(&[
                &[
                    unit(r),
                    unit(r),
                    r.choose(&[2.0, 1.0, 0.5, 1e-3, 1e-7]),
                    r.range(-1.0, 1.0),
                ],
                &direction(r).to_array(),
            ])
        });
        check(gpu, "cones and bases", 1, &table, ulps(8.0, 2.0, trig), 7, |x| {
            let (t, b) = orthonormal_basis(v3(x, 4));
            list![
                square_to_cone(v2(x, 0), x[2]).to_array(),
                [cone_pdf(x[2]), cosine_hemisphere_pdf(x[3])],
                t.to_array(),
                b.to_array()
            ]
        });
    });
}
