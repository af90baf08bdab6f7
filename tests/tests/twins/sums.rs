//! Sums in pairs of floats, bit for bit.

use clerestory::film::accumulate::{
    TwoFloat, split, two_float_add, two_float_add_square, two_float_add_two_float, two_product, two_sum,
};
use clerestory_tests::random::Random;
use clerestory_tests::with_gpu;

use crate::{cases, twin_math};

#[test]
fn sums_in_pairs_are_equal_bit_for_bit() {
    with_gpu(|gpu| {
        let table = cases(13, |r| {
            let number = |r: &mut Random| r.range(-1.0, 1.0) * 2f32.powi(r.below(60) as i32 - 30);
            let hi = number(r);
            let other = number(r);
            vec![
                hi,
                hi * r.range(-1.0, 1.0) * 2f32.powi(-25),
                number(r),
                number(r),
                other,
                other * 2f32.powi(-26),
            ]
        });
        for (case, result) in table.iter().zip(twin_math(gpu, 11, &table, &[])) {
            let x = case.0;
            let a = TwoFloat { hi: x[0], lo: x[1] };
            let expected = [
                two_sum(x[2], x[3]),
                split(x[2]),
                two_product(x[2], x[3]),
                two_float_add(a, x[2]),
                two_float_add_two_float(a, TwoFloat { hi: x[4], lo: x[5] }),
                two_float_add_square(a, x[2]),
            ];
            for (i, e) in expected.into_iter().enumerate() {
                assert_eq!(
                    [result.0[2 * i], result.0[2 * i + 1]],
                    [e.hi, e.lo],
                    "function {i} of {x:?}"
                );
            }
        }
    });
}
