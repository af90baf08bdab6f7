//! Bits of previews that mirror, over threads of the driver: maps that fade, searched reflections and planar mirrors.

use clerestory_tests::child::{hash_in_child, print_hash};
use clerestory_tests::with_gpu;

use crate::fading::faded_values;
use crate::planar::mirrored_values;
use crate::search::searched_values;

/// Set in the processes that only print their pictures' hash.
const CHILD: &str = "CLERESTORY_TEST_PRINT_HASH_OF_PREVIEWS";
const CHILD_TEST: &str = "bits::prints_its_hash_when_asked";

#[test]
fn threads_of_the_driver_never_show() {
    let hash = |threads| hash_in_child(CHILD_TEST, CHILD, &[("LP_NUM_THREADS", threads)]);
    assert_eq!(hash("2"), hash("1"));
}

#[test]
fn prints_its_hash_when_asked() {
    if std::env::var_os(CHILD).is_none() {
        return;
    }
    with_gpu(|gpu| {
        let mut words = Vec::new();
        for values in [faded_values(gpu), searched_values(gpu), mirrored_values(gpu)] {
            assert!(values.iter().any(|value| *value > 0.1));
            words.extend(values.into_iter().map(f32::to_bits));
        }
        print_hash(words);
    });
}
