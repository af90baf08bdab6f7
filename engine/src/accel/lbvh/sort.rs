//! Morton codes in order, on the host: a stable radix sort from the lowest digit up, in parallel.
//!
//! Source: M. Zagha and G. Blelloch, "Radix Sort for Vector Multiprocessors", Supercomputing 1991: each part counts its digits, and what
//! lies before each digit of each part is where it writes.
//!
//! Guarantee: equal keys keep their order, so the result does not depend on the number of parts.

use rayon::prelude::*;

/// Bits of a digit: the ends of all digits' ranges stay in a core's nearest cache.
const DIGIT_BITS: u32 = 11;

/// Fewer than this are not worth a task.
const PART: usize = 4096;

/// Sorts by the lowest `bits` bits of the keys.
pub(super) fn sort_by_key<T: Copy + Default + Send + Sync>(
    items: &mut Vec<T>,
    bits: u32,
    key: impl Fn(&T) -> u64 + Sync,
) {
    let passes = bits.div_ceil(DIGIT_BITS).max(1);
    let digit_bits = bits.div_ceil(passes);
    let part = items.len().div_ceil(rayon::current_num_threads()).max(PART);
    let mut other = vec![T::default(); items.len()];
    for pass in 0..passes {
        let digit = |item: &T| (key(item) >> (pass * digit_bits)) as usize & ((1 << digit_bits) - 1);
        let counts: Vec<Vec<u32>> = items
            .par_chunks(part)
            .map(|items| {
                let mut counts = vec![0; 1 << digit_bits];
                items.iter().for_each(|item| counts[digit(item)] += 1);
                counts
            })
            .collect();
        let is_one_digit = items
            .first()
            .is_some_and(|item| counts.iter().map(|c| c[digit(item)] as usize).sum::<usize>() == items.len());
        if is_one_digit {
            continue;
        }
        let targets = targets(&mut other, &counts);
        items.par_chunks(part).zip(targets).for_each(|(items, mut targets)| {
            for item in items {
                if let Some(to) = targets[digit(item)].next() {
                    *to = *item;
                }
            }
        });
        std::mem::swap(items, &mut other);
    }
}

/// Where each part writes each digit.
fn targets<'a, T>(mut rest: &'a mut [T], counts: &[Vec<u32>]) -> Vec<Vec<std::slice::IterMut<'a, T>>> {
    let digits = counts.first().map_or(0, Vec::len);
    let mut targets: Vec<Vec<_>> = counts.iter().map(|_| Vec::with_capacity(digits)).collect();
    for digit in 0..digits {
        for (counts, targets) in counts.iter().zip(&mut targets) {
            let (own, after) = rest.split_at_mut(counts[digit] as usize);
            targets.push(own.iter_mut());
            rest = after;
        }
    }
    targets
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::accel::test_support::with_threads;
    use crate::test_random::Random;

    #[test]
    fn items_are_sorted_and_equal_keys_keep_their_order() {
        let mut random = Random(51);
        for count in [0, 1, 2, PART - 1, PART, PART + 1, 3 * PART + 7, 50_000] {
            for bits in [1, 10, 11, 12, 30, 63] {
                // Few different keys, so that many are equal; and all.
                for mask in [0, 0x111, u64::MAX >> (64 - bits)] {
                    let item = |i| (u64::from(random.word()) << 32 | u64::from(random.word()), i);
                    let mut items: Vec<(u64, u32)> = (0..count as u32).map(item).collect();
                    items.iter_mut().for_each(|item| item.0 &= mask);
                    let mut expected = items.clone();
                    expected.sort_by_key(|item| item.0 & (u64::MAX >> (64 - bits)));
                    for threads in [1, 3] {
                        let mut sorted = items.clone();
                        with_threads(threads, || sort_by_key(&mut sorted, bits, |item| item.0));
                        assert!(sorted == expected, "{count} of {bits} bits, mask {mask:x}");
                    }
                }
            }
        }
    }
}
